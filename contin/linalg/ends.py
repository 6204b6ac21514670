"""What a linear equation on a mesh says of both ends of the domain, and how much that differs between two points of a curve.

Condensation leaves n rows that relate both ends and the parameters; they span the boundary values of all solutions of the
differential equation. So do the n rows that it leaves at each mesh point, for the domain up to there. Only the span has a
meaning: which rows they are depends on pivots. Of the span, orthonormal rows R are taken; the border rows, which are reduced by
multiples of the same rows, without their part in it::

                 first point   last point   parameters
    condensed  [  R            R            R     ]   n rows
               [  boundary     boundary     boundary ]
               [  border       border       border   ]

Of a matrix in S segments each has its own relations, from its first point on, and its own share of the border; the condensed
matrix has n rows R of each, by the points where segments begin or end, as drawn in `contin.linalg.elimination`.

This matrix is singular where the whole one is, with a kernel of the same dimension, and has (S + 1) n + k rows.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from contin.arrays import Array, Indices
from contin.kernels.kernel import kernel
from contin.kernels.kernel_parts import IndexVector, Matrix, Stack, Vector, helper
from contin.linalg.border import orthonormalize_row
from contin.linalg.elimination import Eliminated


class Relations(NamedTuple):
    """What condensation has left of a matrix.

    - ``relations`` (ndarray, shape (N - S, n, 2 n + k)): Orthonormal rows that relate the first mesh point of a segment to each
      of the others in it, from the second on.
    - ``sides`` (ndarray, shape (N - S,)): On which side these rows are: 1 or -1, so that rows times it turn with the matrix,
      whatever the pivots are.
    - ``condensed`` (ndarray, shape ((S + 1) n + k, (S + 1) n + k)): The condensed matrix: S n rows R, boundary conditions and
      border.
    """

    relations: Stack
    sides: Vector
    condensed: Matrix

    @classmethod
    def unfilled(cls, intervals: int, n: int, k: int, segments: int) -> Relations:
        """Return room for those of a matrix with so many parameters."""
        points, size = intervals - segments, (segments + 1) * n + k
        return cls(np.empty((points, n, 2 * n + k)), np.empty(points), np.empty((size, size)))


@kernel
def relate_ends(
    offsets: IndexVector, factors: Eliminated, carried: Stack, first: Matrix, last: Matrix, starts: IndexVector,
    found: Relations,
) -> None:  # fmt: skip
    """Fill in relations, by the arguments of `relations_of`."""
    relations, sides, condensed = found
    (conditions, n), segments, (_, height, width), rows = first.shape, starts.size - 1, carried.shape, factors.local.shape[1]
    end, size, number = segments * n, condensed.shape[0], 0
    for i in range(size):
        for b in range(size):
            condensed[i, b] = 0.0
    for s in range(segments):
        side = _side_of_interval(factors, starts[s], offsets)
        for j in range(starts[s] + 1, starts[s + 1]):
            block, span = factors.chain[j - 1], relations[number]
            side *= _side_of_interval(factors, j, offsets) * _side(block, factors.pivots[j, rows - n :], 0, 0, n)
            sides[number] = side
            for i in range(n):
                for b in range(width):
                    span[i, b] = block[n + i, n + b]
                orthonormalize_row(span, i)
            number += 1
        span, border = relations[number - 1], carried[s, n:]
        for i in range(n):
            _add_row(condensed[s * n + i], span[i], 1.0, s * n, end + n, n)
        for i in range(height - n):
            row = condensed[end + conditions + i]
            _add_row(row, border[i], 1.0, s * n, end + n, n)
            for k in range(n):
                _add_row(row, span[k], -_product(border[i], span[k]), s * n, end + n, n)
    for i in range(conditions):
        row = condensed[end + i]
        for b in range(n):
            row[b] = first[i, b]
        for b in range(width - n):
            row[end + b] = last[i, b]


@helper
def _add_row(row, part, factor, left, right, n):
    """Add a multiple of a row by [first point | last point | parameters] of a segment to a row of the condensed matrix."""
    for b in range(2 * n):
        row[left + b] += factor * part[b]
    for b in range(part.size - 2 * n):
        row[right + b] += factor * part[2 * n + b]


@helper
def _side(block, pivots, top, left, right):
    """Return the sign of the product of the pivots of some columns, times -1 for each exchange of rows."""
    sign = 1.0
    for column in range(left, right):
        row = top + column - left
        if (block[row, column] < 0) != (pivots[column] != row):  # inverse triangles are kept
            sign = -sign
    return sign


@helper
def _side_of_interval(factors, j, offsets):
    """Return the same of the interior columns of an interval."""
    sign, n = 1.0, offsets[offsets.size - 1]
    degree = factors.local.shape[1] // n
    for g in range(offsets.size - 1):
        left, right = (degree - 1) * offsets[g], (degree - 1) * offsets[g + 1]
        sign *= _side(factors.local[j], factors.pivots[j], degree * offsets[g], left, right)
    return sign


@helper
def _product(one, other):
    """Return the inner product of two rows."""
    product = 0.0
    for b in range(one.size):
        product += one[b] * other[b]
    return product


@kernel
def divide_ends(before: Relations, after: Relations, quotient: Matrix, work: Matrix) -> float:
    """Fill the ``quotient`` ((S + 1) n + k squared), and return the largest turn, both described in `compared`."""
    points, n, width = before.relations.shape
    size = before.condensed.shape[0]
    largest, related = 0.0, size - (width - n)
    for j in range(points):
        total = float(n)
        for i in range(n):
            for k in range(n):
                product = _product(before.relations[j, i], after.relations[j, k])
                total -= product * product
                work[i, k] = product
        if _sign(work, n) * before.sides[j] * after.sides[j] < 0:
            total = math.inf
        if not total <= largest:
            largest = total
    for i in range(size):
        for b in range(size):
            quotient[i, b] = before.condensed[i, b]
            work[i, b] = 0.0 if i < related else after.condensed[i, b]
    for i in range(related):
        for k in range(i - i % n, i - i % n + n):
            product = _product(before.condensed[i], after.condensed[k])
            for b in range(size):
                work[i, b] += product * after.condensed[k, b]
    _solve(work, quotient)
    return largest


@helper
def _pivot(matrix, column, size):
    """Exchange rows so that the largest entry of a column stands on the diagonal; return the row that it came from."""
    place = column
    for i in range(column + 1, size):
        if abs(matrix[i, column]) > abs(matrix[place, column]):
            place = i
    if place != column:
        for b in range(size):
            matrix[column, b], matrix[place, b] = matrix[place, b], matrix[column, b]
    return place


@helper
def _sign(matrix, size):
    """Return the sign of the determinant of the first rows and columns of a matrix, which are overwritten."""
    sign = 1.0
    for column in range(size):
        if (_pivot(matrix, column, size) != column) != (matrix[column, column] < 0):
            sign = -sign
        for i in range(column + 1, size):
            factor = matrix[i, column] / matrix[column, column] if matrix[column, column] != 0.0 else 0.0
            for b in range(column + 1, size):
                matrix[i, b] -= factor * matrix[column, b]
    return sign


@helper
def _solve(matrix, right):
    """Solve for the columns of the right-hand side, in place, by elimination with partial pivoting; NaN if it is singular."""
    size = matrix.shape[0]
    for column in range(size):
        place = _pivot(matrix, column, size)
        if place != column:
            for b in range(size):
                right[column, b], right[place, b] = right[place, b], right[column, b]
        pivot = matrix[column, column] if matrix[column, column] != 0.0 else math.nan
        for i in range(column + 1, size):
            factor = matrix[i, column] / pivot
            if factor == 0.0:
                continue
            for b in range(column + 1, size):
                matrix[i, b] -= factor * matrix[column, b]
            for b in range(size):
                right[i, b] -= factor * right[column, b]
    for column in range(size - 1, -1, -1):
        for k in range(column + 1, size):
            factor = matrix[column, k]
            for b in range(size):
                right[column, b] -= factor * right[k, b]
        pivot = matrix[column, column] if matrix[column, column] != 0.0 else math.nan
        for b in range(size):
            right[column, b] /= pivot


@kernel
def is_near_one(matrix: Matrix, apart: float, factor: float, work: Matrix) -> int:
    """Return 1 where all eigenvalues certainly have a positive real part and sizes between 1 / factor and factor, 0 elsewhere.

    That is where the matrix differs from the identity by less than ``apart`` < 1 in the Frobenius norm; and where its symmetric
    part S has S - I / factor positive definite, and a norm of the matrix is less than the factor.
    """
    size, distance, square = matrix.shape[0], 0.0, 0.0
    for i in range(size):
        for b in range(size):
            entry = matrix[i, b]
            gap = entry - 1.0 if i == b else entry
            distance, square = distance + gap * gap, square + entry * entry
            work[i, b] = 0.5 * (entry + matrix[b, i])
        work[i, i] -= 1.0 / factor
    if distance < apart * apart:
        return 1
    rows, columns = 0.0, 0.0
    for i in range(size):
        row, column = 0.0, 0.0
        for b in range(size):
            row, column = row + abs(matrix[i, b]), column + abs(matrix[b, i])
        rows, columns = max(rows, row), max(columns, column)
    if not min(square, rows * columns) < factor * factor:
        return 0
    for k in range(size):  # Cholesky's elimination of the lower triangle
        if not work[k, k] > 0.0:
            return 0
        for i in range(k + 1, size):
            part = work[i, k] / work[k, k]
            for b in range(k + 1, i + 1):
                work[i, b] -= part * work[b, k]
    return 1


def relations_of(
    offsets: Indices, factors: Eliminated, carried: Array, first: Array, last: Array, starts: Indices
) -> Relations:
    """Return what condensation has left of a matrix.

    - ``offsets`` (ndarray of int): Where the groups of states begin, as in `contin.linalg.blocks.Layout`.
    - ``factors`` (Eliminated)
    - ``carried`` (ndarray, shape (S, n + r, 2 n + k)): The rows that relate both ends of each segment, and their share of the
      border.
    - ``first``, ``last`` (ndarray, shape (n_bc, n) and (n_bc, n + k)): The boundary conditions.
    - ``starts`` (ndarray of int, shape (S + 1,)): The first intervals of the segments, and N.
    """
    n = first.shape[1]
    found = Relations.unfilled(len(factors.local), n, carried.shape[2] - 2 * n, len(carried))
    relate_ends(offsets, factors, carried, first, last, starts, found)
    return found


def compared(before: Relations, after: Relations) -> tuple[Array, float]:
    """Return the quotient after^-1 before of the condensed matrices at two points, and the largest turn.

    The rows that relate the ends at the second point are the projections of those at the first one to their span there, segment
    by segment, so that both matrices have the same rows. The turn is the largest sum, over the mesh points, of the squared
    sines of the angles between the two spans of relations; infinity where a span has turned to its other side, as where a mode
    that no end feels becomes singular inside.
    """
    quotient, work = np.empty((2, *before.condensed.shape))
    turn = divide_ends(before, after, quotient, work)
    return quotient, turn
