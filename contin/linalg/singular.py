"""Singular vectors of the smallest singular values, by inverse iteration."""

from __future__ import annotations

import functools

import numpy as np

from contin.arrays import Array
from contin.draws import generator
from contin.functions.kernel import kernel
from contin.functions.kernel_parts import Matrix, helper
from contin.linalg.factors import Factors


@functools.lru_cache(maxsize=8)
def random_rows(count: int, size: int) -> Array:
    """Return rows to start an iteration from, shape (count, size), always the same: not to be written to."""
    block = generator("singular").standard_normal((count, size))
    block.flags.writeable = False
    return block


@helper
def orthonormalize_row(rows, i):
    """Make a row orthonormal to those before, which are orthonormal: Gram-Schmidt, twice where little of the row is left."""
    size = rows.shape[1]
    largest, square = 0.0, 0.0
    for k in range(size):
        largest = max(largest, abs(rows[i, k]))
    for k in range(size):  # near a bifurcation solutions are huge
        rows[i, k] /= largest
        square += rows[i, k] * rows[i, k]
    for _ in range(2):
        before, square = square, 0.0
        for j in range(i):
            product = 0.0
            for k in range(size):
                product += rows[j, k] * rows[i, k]
            for k in range(size):
                rows[i, k] -= product * rows[j, k]
        for k in range(size):
            square += rows[i, k] * rows[i, k]
        if square >= 0.5 * before:  # otherwise what is left is partly round-off
            break
    for k in range(size):
        rows[i, k] /= np.sqrt(square)


@kernel
def orthonormalize(rows: Matrix, first: int) -> None:
    """Make the rows from ``first`` on orthonormal, and orthogonal to those before, which are: in place."""
    for i in range(first, rows.shape[0]):
        orthonormalize_row(rows, i)


@kernel
def fill_products(one: Matrix, other: Matrix, known: int, count: int, products: Matrix) -> None:
    """Fill one[i].other[j] for i, j < ``count``, in place, where not both are less than ``known``; both are multiples of four.

    BLAS gives products of this size to several threads: on a busy machine they wait for each other, a thousand times as long as
    the products take.
    """
    size = one.shape[1]
    for i in range(count):
        row = one[i]
        for j in range(known if i < known else 0, count, 4):
            a, b, c, d = 0.0, 0.0, 0.0, 0.0
            for k in range(size):
                a += row[k] * other[j, k]
                b += row[k] * other[j + 1, k]
                c += row[k] * other[j + 2, k]
                d += row[k] * other[j + 3, k]
            products[i, j], products[i, j + 1], products[i, j + 2], products[i, j + 3] = a, b, c, d


def smallest_directions(factors: Factors, size: int, count: int, rounds: int = 2) -> tuple[Array, Array, Array]:
    """Return right and left singular vectors of the ``count`` smallest singular values, as rows, by block inverse iteration.

    It starts from random vectors, not from those of the point before: a resumed run must decide as one that was never
    interrupted.

    Returns
    -------
    right, left : ndarray, shape (count, size)
    response : ndarray, shape (count, count)
        right J^-1 left^T: about the reciprocals of the singular values.
    """
    right = random_rows(min(count, size), size)
    for _ in range(rounds):
        left = factors.solve_transposed(right)
        orthonormalize(left, 0)
        solved = factors.solve(left)
        right = solved.copy()
        orthonormalize(right, 0)
    return right, left, right @ solved.T
