"""Derivatives along a line by differences, with an estimate of their error, and multilinear forms.

Differences serve what states no derivatives: discretizations and functions that others have written. Everything in `contin`
itself has exact ones.

Multilinear forms are derivatives of a function along several directions, combined. Directions are numbered, and a derivative
along some of them belongs to a tuple of their numbers, in order.
"""

from __future__ import annotations

import functools
import itertools
from collections import Counter
from collections.abc import Callable, Sequence
from typing import Any

import numpy as np

from contin.arrays import Array, Indices

#: First length, by order of the derivative: the fifth, sixth and seventh root of round-off, where the errors of a fourth-order
#: difference and of round-off are equal for functions that bend on the scale of one. With a ten times larger one the first
#: estimate of exp is wrong by 1e-8, and the lengths below are tried.
_LENGTHS = {1: 1e-3, 2: 3e-3, 3: 6e-3}
#: Factor between lengths. With .01 the best of them is missed by more.
_SHORTER = 0.1
#: Number of lengths: the shortest is 1e-7, where round-off of first derivatives is 1e-9.
_TIMES = 5
#: Differences of second and of fourth order that agree to this part are taken at once: the better one is good to the square of
#: it. Ten times larger, tangents at branch points could be wrong by 1e-5.
_AGREE = 1e-4
#: Weights of the function at h and at 2 h, for fourth and for second order; odd derivatives take differences of the two sides,
#: even ones sums less twice the middle. The third derivative of fourth order also takes 3 h.
_WEIGHTS = {
    1: np.array([[8.0, -1.0, 0.0], [6.0, 0.0, 0.0]]) / 12,
    2: np.array([[16.0, -1.0, 0.0], [12.0, 0.0, 0.0]]) / 12,
    3: np.array([[-13.0, 8.0, -1.0], [-8.0, 4.0, 0.0]]) / 8,
}


def derivative(function: Callable[[float], Any], order: int = 1, size: float = 1.0) -> tuple[Any, float]:
    """Return the derivative at 0 of a function of one number, a number or an array, and an estimate of its error.

    - ``function`` (callable)
    - ``order`` (int): 1, 2 or 3.
    - ``size`` (float): The change of the argument that counts as one.

    Returns
    -------
    value, error : number or ndarray, float
        The error is that of the largest component.

    Examples
    --------
    >>> import math
    >>> value, error = derivative(lambda s: math.sin(s), 3)
    >>> abs(value + 1) < error < 1e-6
    True
    """
    middle = np.asarray(function(0.0), dtype=float)
    best, least = np.full(middle.shape, np.nan), np.inf
    length = _LENGTHS[order] * size
    for _ in range(_TIMES):
        (fourth, second), most = _differences(function, middle, order, length)
        scale, apart = _largest(fourth), _largest(fourth - second)
        round_off = _EPSILON * most / length**order
        error = min(apart, _SAFE * apart * apart / scale if scale else 0.0) + round_off
        if error < least:  # not where values are not finite
            best, least = fourth, error
        if apart <= _AGREE * scale or round_off > least:
            break
        length *= _SHORTER
    return (best if best.shape else float(best)), least


#: Round-off of a function, relative to its value. Three times larger, derivatives of third order miss by 2e-5.
_EPSILON = 1e-15
#: The error of fourth order is estimated as this times the square of that of second order, relative: of sin(1 + x) it is 1.6
#: times that at most. Ten times larger, differences are taken over shorter lengths than needed.
_SAFE = 4.0


def _largest(values: Array) -> float:
    return float(np.abs(values).max(initial=0.0))


def _differences(function: Callable[[float], Any], middle: Array, order: int, h: float) -> tuple[Array, float]:
    """Return differences of a length, of fourth order and of second, and the largest value."""
    weights = _WEIGHTS[order]
    count = int(np.count_nonzero(weights[0]))
    total, most = np.zeros((2, *middle.shape)), _largest(middle)  # zero where the function is, but not its round-off
    for k in range(count):
        ahead, behind = (np.asarray(function(s * (k + 1) * h), dtype=float) for s in (1, -1))
        most = max(most, _largest(ahead), _largest(behind))
        total += np.multiply.outer(weights[:, k], ahead - behind if order % 2 else ahead + behind - 2 * middle)
    return total / h**order, most


#: Numbers of directions.
Numbers = tuple[int, ...]


@functools.cache
def _combined(counts: Numbers) -> tuple[Indices, Any]:
    """Return the parts of vectors that are combined, 1 for an imaginary one, and the powers of i that belong to them."""
    chosen = np.indices(counts).reshape(len(counts), -1)
    powers = np.array([1, 1j, -1, -1j])[chosen.sum(axis=0) % 4]
    return chosen, powers if chosen.any() else powers.real


def of_complex(form: Callable[[Sequence[Array]], Array], vectors: Sequence[Any]) -> Any:
    """Return a real multilinear form of complex vectors, from its values at their real and imaginary parts.

    ``form`` is called once, with a stack of each vector's parts, and returns the stack of values.

    Examples
    --------
    >>> print(of_complex(lambda v: v[0] * v[1], [np.array([1 + 2j]), np.array([3 - 1j])]).item())
    (5+5j)
    """
    parts = [np.array([vector.real, vector.imag] if vector.dtype.kind == "c" else [vector]) for vector in vectors]
    chosen, factors = _combined(tuple(map(len, parts)))
    values = form([part[each] for part, each in zip(parts, chosen)])
    return (factors @ values.reshape(len(factors), -1)).reshape(values.shape[1:])


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


def of_function(function: Callable[[Array], Array], x: Array, directions: Sequence[Array]) -> Array:
    """Return the derivative of a function of vectors at x along several directions.

    Examples
    --------
    >>> print(of_function(lambda x: x[:1] * x[:1] * x[1:], np.ones(2), np.eye(2)).round(6).item())
    2.0
    """
    count = len(directions)
    return of_lines(lambda v: derivative(lambda s: function(x + s * v), count, 1 / np.abs(v).max())[0], directions)


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
