"""Largest and smallest values of the states of a piecewise polynomial on a periodic mesh."""

from __future__ import annotations

import functools
import math
from typing import NamedTuple

import numpy as np

from contin.arrays import Array
from contin.collocation.basis import basis, interpolation
from contin.functions.kernel import kernel
from contin.functions.kernel_parts import Matrix, ReadOnlyVector, Vector, helper

#: Values that are compared in each interval, per degree.
_LOOKS = 4
#: Parabolas through three places near an extreme value: the error falls with the sixth power of their distance.
_PARABOLAS = 2


class Curve(NamedTuple):
    """A piecewise polynomial: ``nodes`` and ``barycentric`` (d + 1,) of its basis, ``mesh`` (N + 1,) from 0 to 1."""

    nodes: Vector
    barycentric: Vector
    mesh: Vector


def extremes(degree: int, mesh: Array, x: Array, n: int) -> Array:
    """Return the largest and the smallest value of each state, shape (n, 2); x begins with the states at the nodes.

    The extreme one of several values in each interval is moved to the vertex of the parabola through three places near it.
    """
    tables, found = basis(degree), np.empty((n, 2))
    find(Curve(tables.nodes, tables.barycentric, mesh), _values(degree), x, found)
    return found


@functools.cache
def _values(degree: int) -> Array:
    """Return the matrix from the nodal values of an interval to the values that are compared."""
    tables, count = basis(degree), _LOOKS * degree
    return interpolation(tables.nodes, tables.barycentric, np.linspace(0, 1, count, endpoint=False))


@helper
def _at(curve: Curve, x: ReadOnlyVector, n: int, state: int, t: float) -> float:
    """Return the value of a state at a time from 0 to 1."""
    nodes, barycentric, mesh = curve
    low, high = 0, mesh.size - 1
    while high - low > 1:
        middle = (low + high) // 2
        if mesh[middle] <= t:
            low = middle
        else:
            high = middle
    s, first = (t - mesh[low]) / (mesh[high] - mesh[low]), low * (nodes.size - 1)
    above, below = 0.0, 0.0
    for m in range(nodes.size):
        value: float = x[(first + m) * n + state]
        if s == nodes[m]:
            return value
        share = barycentric[m] / (s - nodes[m])
        above += share * value
        below += share
    return above / below


@kernel(reorder=False, last=True)
def find(curve: Curve, values: Matrix, x: ReadOnlyVector, found: Matrix) -> None:
    """Fill the extremes (n, 2) of the states in x; ``values`` (looks, d + 1) takes nodal values to those that are compared."""
    n, looks, d, mesh = found.shape[0], values.shape[0], curve.nodes.size - 1, curve.mesh
    for state in range(n):
        for side in range(2):
            sign, known, at, apart = 1.0 - 2.0 * side, -math.inf, 0.0, 0.0
            for j in range(mesh.size - 1):
                for i in range(looks):
                    value = 0.0
                    for m in range(d + 1):
                        value += values[i, m] * x[(j * d + m) * n + state]
                    if sign * value > known:
                        known, apart = sign * value, (mesh[j + 1] - mesh[j]) / looks
                        at = mesh[j] + i * apart
            for _ in range(_PARABOLAS):
                before, here = sign * _at(curve, x, n, state, (at - apart) % 1.0), sign * _at(curve, x, n, state, at % 1.0)
                behind = sign * _at(curve, x, n, state, (at + apart) % 1.0)
                bend = before - 2 * here + behind
                if bend < 0:
                    at += apart * min(1.0, max(-1.0, (before - behind) / (2 * bend)))
                apart /= 10
            found[state, side] = sign * max(known, sign * _at(curve, x, n, state, at % 1.0))
