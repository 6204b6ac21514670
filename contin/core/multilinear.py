"""Multilinear forms: derivatives of a function along several directions, combined.

Directions are numbered, and a derivative along some of them belongs to a tuple of their numbers, in order.
"""

from __future__ import annotations

import functools
import itertools
import math
from collections import Counter
from collections.abc import Callable, Sequence
from typing import Any

import numpy as np

from contin.arrays import Array

#: Numbers of directions.
Numbers = tuple[int, ...]


def of_complex(form: Callable[[Sequence[Array]], Array], vectors: Sequence[Any]) -> Any:
    """Return a real multilinear form of complex vectors, from its values at their real and imaginary parts.

    ``form`` is called once, with a stack of each vector's parts, and returns the stack of values.

    Examples
    --------
    >>> print(of_complex(lambda v: v[0] * v[1], [np.array([1 + 2j]), np.array([3 - 1j])]).item())
    (5+5j)
    """
    parts = [[(1.0, vector)] if np.isrealobj(vector) else [(1.0, vector.real), (1j, vector.imag)] for vector in vectors]
    every = list(itertools.product(*parts))
    factors = np.array([math.prod(factor for factor, _ in chosen) for chosen in every])
    stacks = [np.array(stack) for stack in zip(*([vector for _, vector in chosen] for chosen in every))]
    values = form(stacks)
    return (factors @ values.reshape(len(every), -1)).reshape(values.shape[1:])


def of_lines(form: Callable[[Array], Array], directions: Sequence[Array]) -> Array:
    """Return a symmetric multilinear form of several directions, from its values ``form(v)`` with equal ones (polarization).

    Examples
    --------
    >>> print(of_lines(lambda v: v[:1] * v[:1] * v[1:], [np.array([1.0, 0.0])] * 2 + [np.array([2.0, 5.0])]).round(6).item())
    1.666667
    """
    sizes = [float(np.abs(direction).max(initial=0.0)) for direction in directions]
    if not all(sizes):
        return np.zeros_like(form(directions[0]))
    units = [direction / size for direction, size in zip(directions, sizes)]
    count = len(units)
    total: Any = 0.0
    for signs in itertools.product((1.0, -1.0), repeat=count - 1):
        along = units[0] + sum(sign * unit for sign, unit in zip(signs, units[1:]))
        if np.any(along):
            total = total + np.prod(signs) * form(along)
    return total * np.prod(sizes) / (2 ** (count - 1) * np.prod(np.arange(1, count + 1)))


def subsets(count: int) -> list[Numbers]:
    """Return all subsets of the first numbers, small ones first.

    Examples
    --------
    >>> subsets(2)
    [(), (0,), (1,), (0, 1)]
    """
    return [chosen for size in range(count + 1) for chosen in itertools.combinations(range(count), size)]


def classes(directions: Sequence[Array]) -> Numbers:
    """Return for each direction the number of the first one that is equal to it.

    Examples
    --------
    >>> classes([np.ones(2), np.zeros(2), np.ones(2)])
    (0, 1, 0)
    """
    first: dict[bytes, int] = {}
    return tuple(first.setdefault(direction.tobytes(), number) for number, direction in enumerate(directions))


@functools.cache
def alike(same: Numbers, chosen: Numbers) -> Numbers:
    """Return the first numbers that stand for the same directions as those that are chosen; ``same`` is that of `classes`.

    Examples
    --------
    >>> alike((0, 1, 0, 0), (1, 2, 3))
    (0, 1, 2)
    """
    left, found = list(range(len(same))), list[int]()
    for number in chosen:
        found.append(next(each for each in left if same[each] == same[number]))
        left.remove(found[-1])
    return tuple(sorted(found))


@functools.cache
def shares(same: Numbers, chosen: Numbers, parts: int) -> list[tuple[int, tuple[Numbers, ...]]]:
    """Return the ways to give directions to the factors of a product (Leibniz's rule), each with how often it occurs.

    Examples
    --------
    >>> shares((0, 0), (0, 1), 2)
    [(1, ((0, 1), ())), (2, ((0,), (0,))), (1, ((), (0, 1)))]
    """
    found: Counter[tuple[Numbers, ...]] = Counter()
    for owners in itertools.product(range(parts), repeat=len(chosen)):
        given = (tuple(number for number, owner in zip(chosen, owners) if owner == part) for part in range(parts))
        found[tuple(alike(same, each) for each in given)] += 1
    return [(count, given) for given, count in found.items()]
