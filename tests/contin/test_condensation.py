"""The structured factorization against numpy's dense one."""

import numpy as np
import pytest

from contin.condensation import Factorization


def random_blocks(n, degree, intervals, k, r, seed=0):
    """Blocks of a random matrix, and the same matrix dense with equations and unknowns in the documented order."""
    random = np.random.default_rng(seed)
    rows, width = n * degree, n * (degree + 1) + k
    local = random.standard_normal((intervals, rows, width))
    border = random.standard_normal((intervals, r, width))
    corner = random.standard_normal((r, k))
    boundary_count = n + k - r
    first = random.standard_normal((boundary_count, n))
    last = random.standard_normal((boundary_count, n + k))
    size = (intervals * degree + 1) * n + k
    dense = np.zeros((size, size))
    inner = n * (degree - 1)
    for j in range(intervals):
        start = j * rows
        columns = np.concatenate([
            np.arange(start + n, start + n + inner), np.arange(start, start + n),
            np.arange(start + rows, start + rows + n), np.arange(size - k, size),
        ])  # fmt: skip
        dense[start : start + rows, columns] = local[j]
        dense[size - r :, columns[: inner + 2 * n]] += border[j, :, : inner + 2 * n]
    at = intervals * rows
    dense[at : at + boundary_count, :n] = first
    dense[at : at + boundary_count, size - k - n :] = last
    dense[size - r :, size - k :] = corner
    return (local, border, corner, first, last), dense


@pytest.mark.parametrize(
    ("n", "degree", "intervals", "k", "r"),
    [(1, 2, 1, 1, 1), (2, 4, 7, 1, 1), (3, 3, 5, 4, 2), (4, 7, 12, 3, 1), (5, 8, 2, 2, 2), (13, 4, 6, 4, 1), (2, 2, 30, 0, 1)],
)
def test_solves_agree_with_dense(n, degree, intervals, k, r):
    blocks, dense = random_blocks(n, degree, intervals, k, r)
    factors = Factorization(*blocks)
    b = np.random.default_rng(1).standard_normal(len(dense))
    tolerance = 1e-14 * np.linalg.cond(dense)
    assert np.allclose(factors.solve(b), np.linalg.solve(dense, b), atol=tolerance, rtol=tolerance)
    assert np.allclose(factors.solve_transposed(b), np.linalg.solve(dense.T, b), atol=tolerance, rtol=tolerance)


def test_determinant_changes_sign_with_the_dense_one():
    """Up to one factor for the shape: products of signs over random matrices agree."""
    signs = []
    for seed in range(20):
        blocks, dense = random_blocks(2, 3, 4, 2, 1, seed)
        signs.append(Factorization(*blocks).sign * np.sign(np.linalg.det(dense)))
    assert len(set(signs)) == 1


def test_the_count_must_be_square():
    blocks, _ = random_blocks(2, 3, 4, 2, 1)
    with pytest.raises(ValueError, match="2 states and 2 parameters"):
        Factorization(*blocks[:3], blocks[3][:-1], blocks[4][:-1])
