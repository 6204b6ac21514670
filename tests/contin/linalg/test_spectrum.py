"""Eigenvalues of small matrices by the kernel, against LAPACK."""

import numpy as np
import pytest
from scipy.optimize import linear_sum_assignment

from contin.linalg.matrices import eigenvalues


def apart(found, known):
    """Return the largest distance of an eigenvalue from its counterpart, relative to the largest one."""
    gaps = np.abs(found[:, None] - known)
    return gaps[linear_sum_assignment(gaps)].max() / (np.abs(known).max() or 1.0)


def matrices(kind, count=1000):
    random = np.random.default_rng(len(kind))
    for _ in range(count):
        n = random.integers(1, 15)
        matrix = random.standard_normal((n, n))
        if kind == "entries of all sizes":
            matrix *= 10.0 ** random.uniform(-3, 3, (n, n))
        elif kind == "badly scaled":
            sizes = 10.0 ** random.uniform(-8, 8, n)
            matrix *= sizes[:, None] / sizes
        elif kind == "symmetric":
            matrix += matrix.T
        elif kind == "rotations":
            matrix -= matrix.T
        elif kind == "many zeros":
            matrix *= random.random((n, n)) < 0.5
            np.fill_diagonal(matrix, random.standard_normal(n))
        yield matrix


@pytest.mark.sample(2)
@pytest.mark.parametrize("kind", ["normal", "entries of all sizes", "badly scaled", "symmetric", "rotations", "many zeros"])
def test_random_matrices(kind):
    for matrix in matrices(kind):
        assert apart(eigenvalues(matrix), np.linalg.eigvals(matrix)) < 1e-13


def test_eigenvalues_of_defective_matrices_belong_to_matrices_near_by():
    """Those of a Jordan block move by the n-th root of round-off: singular values of A - lambda tell."""
    random = np.random.default_rng(4)
    for n in (2, 3, 5, 8):
        for block in (np.eye(n) + np.eye(n, k=1), np.eye(n, k=1), np.eye(n, k=-1) - np.eye(n)):
            basis = np.linalg.qr(random.standard_normal((n, n)))[0]
            matrix = basis @ block @ basis.T
            for value in eigenvalues(matrix):
                assert np.linalg.svd(matrix - value * np.eye(n), compute_uv=False)[-1] < 1e-14


@pytest.mark.parametrize("n", [1, 2, 5])
def test_zeros_ones_and_permutations(n):
    assert np.array_equal(eigenvalues(np.zeros((n, n))), np.zeros(n))
    assert np.array_equal(eigenvalues(3.0 * np.eye(n)), np.full(n, 3.0))
    assert np.array_equal(eigenvalues(np.eye(n, k=1)), np.zeros(n))
    roots = np.exp(2j * np.pi * np.arange(n) / n)
    assert apart(eigenvalues(np.roll(np.eye(n), 1, axis=0)), roots) < 1e-14


def test_pairs_are_exactly_conjugate_and_the_matrix_stays():
    matrix = np.random.default_rng(1).standard_normal((4, 7, 7))
    given = matrix.copy()
    found = eigenvalues(matrix)
    assert np.array_equal(matrix, given)
    for row in found:
        assert set(row.tolist()) == set(row.conj().tolist())
    assert np.array_equal(found[2], eigenvalues(matrix[2]))


def test_large_matrices_and_those_without_rows():
    matrix = np.random.default_rng(2).standard_normal((130, 130))
    assert apart(eigenvalues(matrix), np.linalg.eigvals(matrix)) < 1e-13
    assert eigenvalues(np.empty((0, 0))).shape == (0,)
    assert eigenvalues(np.empty((0, 3, 3))).shape == (0, 3)


@pytest.mark.parametrize("value", [np.nan, np.inf])
def test_what_is_not_finite_has_none(value):
    assert np.isnan(eigenvalues(np.array([[1.0, value], [0.0, 1.0]]))).all()
