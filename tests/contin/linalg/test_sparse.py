"""The sparse factorization against the dense one, and a large equilibrium problem."""

import numpy as np
import pytest
from scipy import sparse

from contin import AlgebraicProblem, solve, trace
from contin.equilibria import equations as algebraic
from contin.linalg.matrices import DenseFactors, SparseFactors

RANDOM = np.random.default_rng(4)


def bordered(n, borders):
    """Return a matrix with few entries, except for some last rows and columns."""
    matrix = np.where(RANDOM.random((n, n)) < 4 / n, RANDOM.random((n, n)), 0.0) + np.diag(RANDOM.standard_normal(n))
    if borders:
        matrix[-borders:] = RANDOM.standard_normal((borders, n))
        matrix[:, -borders:] = RANDOM.standard_normal((n, borders))
    return matrix


@pytest.mark.parametrize("borders", [0, 1, 3])
def test_solutions_and_sign_are_those_of_the_dense_factorization(borders):
    for _ in range(5):
        matrix = bordered(60, borders)
        found, expected = SparseFactors(sparse.csr_array(matrix), borders), DenseFactors(matrix)
        assert found.sign == expected.sign == np.sign(np.linalg.det(matrix))
        one, three = RANDOM.standard_normal(60), RANDOM.standard_normal((3, 60))
        for b in (one, three):
            assert np.allclose(found.solve(b), expected.solve(b), rtol=1e-8, atol=1e-9)
            assert np.allclose(found.solve_transposed(b), expected.solve_transposed(b), rtol=1e-8, atol=1e-9)


def test_a_border_makes_a_singular_matrix_regular():
    """As at a fold: the Laplacian with free ends has the constant as its null vector."""
    n = 50
    laplacian = sparse.diags_array([np.ones(n - 1), -2 * np.ones(n), np.ones(n - 1)], offsets=[-1, 0, 1]).toarray()
    laplacian[0, 0] = laplacian[-1, -1] = -1
    matrix = np.block([[laplacian, np.ones((n, 1))], [np.ones((1, n)), np.zeros((1, 1))]])
    b = RANDOM.standard_normal(n + 1)
    assert np.abs(matrix @ SparseFactors(sparse.csr_array(matrix), 1).solve(b) - b).max() < 1e-11


def test_singular_and_infinite_matrices():
    zero = SparseFactors(sparse.csr_array(np.array([[1.0, 2.0], [2.0, 4.0]])))
    assert zero.sign == 0 and np.all(np.isnan(zero.solve(np.ones(2))))
    assert np.isnan(SparseFactors(sparse.csr_array(np.array([[np.inf, 0.0], [0.0, 1.0]]))).sign)
    with pytest.raises(ValueError, match="2 rows and 3 columns"):
        SparseFactors(sparse.csr_array(np.ones((2, 3))))


def bratu(u, p, out):
    h = 1.0 / (len(u) + 1)
    out[:] = -2 * u + h**2 * p[0] * np.exp(u)
    out[1:] += u[:-1]
    out[:-1] += u[1:]


def fold(n):
    problem = AlgebraicProblem(bratu, n, {"lam": 0.0}, count=n, dynamics=False)
    branch = trace(solve(problem, [0.0] * n), free=["lam"], limits={"lam": (0, 4)}, max_points=12)
    return branch.labelled("LP")[0]


@pytest.mark.full
def test_a_large_problem_is_kept_sparse_and_has_the_fold_of_the_dense_one(monkeypatch):
    """Finite differences of Bratu's problem: an error of second order in its fold, 3.513830719125161."""
    found = fold(250)
    assert found.system.is_sparse
    assert abs(found["lam"] - 3.513830719125161) < 10 / 250**2
    monkeypatch.setattr(algebraic, "MANY", 1000)
    dense = fold(250)
    assert not dense.system.is_sparse
    assert abs(found["lam"] - dense["lam"]) < 1e-11
