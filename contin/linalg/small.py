"""LU of a small matrix inside kernels."""

from __future__ import annotations

import math

from contin.arrays import Array, Indices
from contin.functions.kernel import kernel
from contin.functions.kernel_parts import IndexVector, Matrix, ReadOnlyMatrix, helper


@helper
def factor_small(matrix: Array, lu: Array, exchanges: Indices) -> float:
    """Fill in the factors of a matrix, with partial pivoting; return the sign of its determinant, 0 where it is singular."""
    size, sign = matrix.shape[0], 1.0
    for i in range(size):
        for j in range(size):
            lu[i, j] = matrix[i, j]
    for column in range(size):
        place = column
        for i in range(column + 1, size):
            if abs(lu[i, column]) > abs(lu[place, column]):
                place = i
        exchanges[column] = place
        if place != column:
            sign = -sign
            for j in range(size):
                lu[column, j], lu[place, j] = lu[place, j], lu[column, j]
        pivot = lu[column, column]
        if not abs(pivot) > 0.0:  # NaN, too
            return 0.0
        if pivot < 0.0:
            sign = -sign
        for i in range(column + 1, size):
            factor = lu[i, column] / pivot
            lu[i, column] = factor
            if factor != 0.0:
                for j in range(column + 1, size):
                    lu[i, j] -= factor * lu[column, j]
    return sign


@helper
def solve_small(lu: Array, exchanges: Indices, right: Array) -> None:
    """Solve with the factors, in place."""
    size = right.size
    for i in range(size):
        place = exchanges[i]
        if place != i:
            right[i], right[place] = right[place], right[i]
    for i in range(1, size):
        total = right[i]
        for j in range(i):
            total -= lu[i, j] * right[j]
        right[i] = total
    for i in range(size - 1, -1, -1):
        total = right[i]
        for j in range(i + 1, size):
            total -= lu[i, j] * right[j]
        right[i] = total / lu[i, i]


@helper
def solve_small_transposed(lu: Array, exchanges: Indices, right: Array) -> None:
    """Solve with the transposed matrix, in place."""
    size = right.size
    for i in range(size):
        right[i] /= lu[i, i]
        for j in range(i + 1, size):
            right[j] -= lu[i, j] * right[i]
    for i in range(size - 1, 0, -1):
        for j in range(i):
            right[j] -= lu[i, j] * right[i]
    for i in range(size - 1, -1, -1):
        place = exchanges[i]
        if place != i:
            right[i], right[place] = right[place], right[i]


@kernel(reorder=False, last=True)
def factor_matrix(matrix: ReadOnlyMatrix, lu: Matrix, exchanges: IndexVector) -> float:
    """Fill in the factors of a matrix; return the sign of its determinant: 0 if it is singular, NaN if it is not finite."""
    for i in range(matrix.shape[0]):
        for j in range(matrix.shape[1]):
            if not abs(matrix[i, j]) < math.inf:
                return math.nan
    return factor_small(matrix, lu, exchanges)


@kernel(reorder=False, last=True)
def solve_rows(lu: Matrix, exchanges: IndexVector, rows: Matrix, transposed: int) -> None:
    """Solve with the factors, or with those of the transposed matrix, for each of some rows, in place."""
    for number in range(rows.shape[0]):
        if transposed:
            solve_small_transposed(lu, exchanges, rows[number])
        else:
            solve_small(lu, exchanges, rows[number])
