"""Projection conditions at both ends of a connecting orbit, in a kernel.

The rows of L span the left eigenvectors of some eigenvalues of the Jacobian A at an equilibrium e, and L (u - e) = 0 at that
end. With the orthonormal rows Q of an earlier L, and N of the complement, L = Q + Y N; and L is an invariant space where

        B12 + Y B22 - B11 Y - Y B21 Y = 0,                [ B11  B12 ]   [ Q ]   [ Q ]^T
                                                          [ B21  B22 ] = [ N ] A [ N ]

which Newton's method solves. Its updates D, and the derivatives of Y by parameters, solve D S2 - S1 D = right with

        S1 = B11 + Y B21,  S2 = B22 - B21 Y.              Their eigenvalues are those of L, and the others.
"""

from __future__ import annotations

import functools
import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from contin.arrays import Array, Indices
from contin.functions.interpreter import Loaded, Points, load, run_loaded
from contin.functions.program import Inputs, program
from contin.functions.tape import Tape
from contin.kernels.kernel import kernel
from contin.kernels.kernel_parts import IndexVector, Matrix, Stack, Vector, helper
from contin.levels import MOST_UPDATES
from contin.linalg.small import factor_small, fill_eigenvalues, solve_small

#: An update of Y below this is the last: the next would be its square. Ten times larger, 1e-16 would be lost.
_SETTLED = 1e-9


class End(NamedTuple):
    """One end: ``conditions`` is their number, 0 for none.

    ``frame`` (n, n) holds Q and N, ``place`` (n, parameters) takes all parameters to the equilibrium, ``directions`` (k, n +
    parameters) say how that and the parameters change with each of the k free ones. The others are rooms.
    """

    conditions: int
    frame: Matrix
    place: Matrix
    directions: Matrix
    solution: Matrix
    own: Stack
    others: Stack
    matrix: Matrix
    lu: Matrix
    exchanges: IndexVector
    right: Vector
    real: Matrix
    imaginary: Matrix


class Projections(NamedTuple):
    """Both ends; ``values`` (both counts,) are those of the conditions. There are none where ``total`` is 0.

    ``slopes`` is the program of the vector field with its Jacobian, ``along`` that of the derivative of the Jacobian along
    directions. The others are rooms.
    """

    total: int
    first: End
    last: End
    values: Vector
    slopes: Loaded
    along: Loaded
    times: Vector
    at: Matrix
    rates: Matrix
    jacobians: Stack
    none: Matrix
    nothing: Matrix
    half: Matrix
    turned: Matrix
    apart: Vector


def projections(slopes: Loaded, along: Loaded, counts: Sequence[int], places: Sequence[Array], free: Indices) -> Projections:
    """Return the room for so many conditions at both ends, with ``places`` that take all parameters to the equilibria.

    ``free`` are the places of the free parameters among all.
    """
    n, parameters = places[0].shape
    empty, units, k = np.empty, np.eye(parameters)[free], len(free)

    def end(count: int, place: Array) -> End:
        rest, size = n - count, count * (n - count)
        return End(
            count, np.eye(n), np.ascontiguousarray(place), np.hstack([units @ place.T, units]), empty((count, rest)),
            empty((1, count, count)), empty((1, rest, rest)), empty((size, size)), empty((size, size)), empty(size, np.int64),
            empty(size), empty((2, n)), empty((2, n)),
        )  # fmt: skip

    first, last = map(end, counts, places)
    points = max(k, 1)
    return Projections(
        sum(counts), first, last, empty(sum(counts)), slopes, along, np.zeros(points), empty((points, n)), empty((1, n)),
        np.zeros((points, n, n)), empty((0, n)), empty((points, 0)), empty((n, n)), empty((n, n)), empty(n),
    )  # fmt: skip


@functools.cache
def no_projections() -> Projections:
    """Return the room of all systems without such conditions: kernels see that there are none, and leave it."""
    none = load(program(Tape(), [], Inputs({}, {}, {})))
    return projections(none, none, (0, 0), [np.empty((1, 0))] * 2, np.empty(0, dtype=np.int64))


@helper
def _fill_end(room, end, last, p, x, states, rows, slopes):
    """Fill in the conditions of one end, the first or the ``last``."""
    count, n, frame, solution, apart = end.conditions, end.frame.shape[0], end.frame, end.solution, room.apart
    row, place = (room.first.conditions, states - n) if last else (0, 0)
    if count == 0:
        return True
    for a in range(n):
        total = 0.0
        for q in range(p.size):
            total += end.place[a, q] * p[q]
        for j in range(room.at.shape[0]):
            room.at[j, a] = total
    run_loaded(room.slopes, p, Points(room.times[:1], room.at[:1], room.none), room.rates, room.jacobians[:1])
    _turn(frame, room.jacobians[0], room.half, room.turned)
    if not _solve_riccati(room.turned, end, not last):
        return False
    for i in range(n):
        apart[i] = 0.0
        for a in range(n):
            apart[i] += frame[i, a] * (x[place + a] - room.at[0, a])
    for i in range(count):
        room.values[row + i] = apart[i]
        for k in range(n - count):
            room.values[row + i] += solution[i, k] * apart[count + k]
    if slopes:
        _fill_rows(room, end, row, place, p, states, rows)
    return True


@helper
def _fill_rows(room, end, row, place, p, states, rows):
    """Fill in the derivatives of the conditions of one end, for its room as they were evaluated."""
    count, n, frame, solution, right = end.conditions, end.frame.shape[0], end.frame, end.solution, end.right
    rest, turned = n - count, room.turned
    for i in range(count):
        for a in range(n):
            rows[row + i, place + a] = frame[i, a]
            for k in range(rest):
                rows[row + i, place + a] += solution[i, k] * frame[count + k, a]
    run_loaded(room.along, p, Points(room.times, room.at, end.directions), room.nothing, room.jacobians)
    for j in range(end.directions.shape[0]):
        _turn(frame, room.jacobians[j], room.half, turned)
        for i in range(count):
            for k in range(rest):
                total = turned[i, count + k]
                for q in range(rest):
                    total += solution[i, q] * turned[count + q, count + k]
                for r in range(count):
                    part = turned[i, r]
                    for q in range(rest):
                        part += solution[i, q] * turned[count + q, r]
                    total -= part * solution[r, k]
                right[i * rest + k] = -total
        solve_small(end.lu, end.exchanges, right)
        for i in range(count):
            total = 0.0
            for k in range(rest):
                total += right[i * rest + k] * room.apart[count + k]
            for a in range(n):
                total -= rows[row + i, place + a] * end.directions[j, a]
            rows[row + i, states + j] = total


@helper
def _turn(frame, matrix, half, turned):
    """Fill in a matrix in the coordinates of a frame."""
    n = frame.shape[0]
    for i in range(n):
        for b in range(n):
            half[i, b] = 0.0
            for a in range(n):
                half[i, b] += frame[i, a] * matrix[a, b]
    for i in range(n):
        for j in range(n):
            turned[i, j] = 0.0
            for b in range(n):
                turned[i, j] += half[i, b] * frame[j, b]


@helper
def _solve_riccati(turned, end, least):
    """Fill in Y, and the factors of its linearized equation; return whether it was found.

    The eigenvalues must be those with the ``least``, or the largest, real parts.
    """
    count, solution, right = end.conditions, end.solution, end.right
    rest, settled = end.frame.shape[0] - count, False
    own, others, matrix = end.own[0], end.others[0], end.matrix
    for i in range(count):
        for k in range(rest):
            solution[i, k] = 0.0
    for _ in range(MOST_UPDATES):
        for i in range(count):
            for j in range(count):
                own[i, j] = turned[i, j]
                for k in range(rest):
                    own[i, j] += solution[i, k] * turned[count + k, j]
        for k in range(rest):
            for q in range(rest):
                others[k, q] = turned[count + k, count + q]
                for i in range(count):
                    others[k, q] -= turned[count + k, i] * solution[i, q]
        for i in range(count):
            for k in range(rest):
                total = turned[i, count + k]
                for q in range(rest):
                    total += solution[i, q] * others[q, k]
                for j in range(count):
                    total -= turned[i, j] * solution[j, k]
                right[i * rest + k] = -total
                for j in range(count):
                    for q in range(rest):
                        same = others[q, k] if i == j else 0.0
                        matrix[i * rest + k, j * rest + q] = same - (own[i, j] if k == q else 0.0)
        if right.size > 0 and factor_small(matrix, end.lu, end.exchanges) == 0.0:
            return False
        if settled or right.size == 0:
            return _are_apart(end, least)
        solve_small(end.lu, end.exchanges, right)
        size, largest = 0.0, 1.0
        for i in range(count):
            for k in range(rest):
                solution[i, k] += right[i * rest + k]
                size, largest = max(size, abs(right[i * rest + k])), max(largest, abs(solution[i, k]))
        if not size < math.inf:
            return False
        settled = size <= _SETTLED * largest
    return False


@helper
def _are_apart(end, least):
    """Return whether the eigenvalues of L are those with the least, or the largest, real parts."""
    real, rest = end.real, end.frame.shape[0] - end.conditions
    fill_eigenvalues(end.own, end.conditions, real[:1], end.imaginary[:1])
    fill_eigenvalues(end.others, rest, real[1:], end.imaginary[1:])
    sign = 1.0 if least else -1.0
    for i in range(end.conditions):
        if not abs(real[0, i]) < math.inf:
            return False
        for k in range(rest):
            if not sign * real[0, i] < sign * real[1, k]:
                return False
    return True


@kernel(reorder=False, last=True)
def fill_projections(room: Projections, p: Vector, x: Vector, states: int, rows: Matrix, slopes: int) -> int:
    """Fill in the values at x, with ``slopes`` also the ``rows`` of derivatives; return 1 where both spaces were found, else 0.

    ``p`` are all parameters, ``states`` is the place of the free ones in x.
    """
    if not _fill_end(room, room.first, False, p, x, states, rows, slopes):
        return 0
    return 1 if _fill_end(room, room.last, True, p, x, states, rows, slopes) else 0
