"""Singular vectors of the smallest singular values, by inverse iteration."""

from __future__ import annotations

import functools

import numpy as np

from contin.arrays import Array
from contin.functions.kernel import kernel
from contin.functions.kernel_parts import Matrix
from contin.linalg.factors import Factors


@functools.lru_cache(maxsize=8)
def random_rows(count: int, size: int) -> Array:
    """Return rows to start an iteration from, shape (count, size), always the same: not to be written to."""
    block = np.random.default_rng(5).standard_normal((count, size))
    block.flags.writeable = False
    return block


@kernel
def orthonormalize(rows: Matrix) -> None:
    """Make the rows orthonormal, in place: Gram-Schmidt, twice."""
    count, size = rows.shape
    for i in range(count):
        largest = 0.0
        for k in range(size):
            largest = max(largest, abs(rows[i, k]))
        for k in range(size):  # near a bifurcation solutions are huge
            rows[i, k] /= largest
        for turn in range(2 * i + 1):
            j = turn % i if turn < 2 * i else i
            product = 0.0
            for k in range(size):
                product += rows[j, k] * rows[i, k]
            for k in range(size):
                rows[i, k] = rows[i, k] - product * rows[j, k] if j < i else rows[i, k] / np.sqrt(product)


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
        orthonormalize(left)
        solved = factors.solve(left)
        right = solved.copy()
        orthonormalize(right)
    return right, left, right @ solved.T
