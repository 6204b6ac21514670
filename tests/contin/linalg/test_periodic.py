"""Eigenvalues of products of matrices that are never formed, and the transition matrices that they are taken of."""

import numpy as np
import pytest

from contin.collocation.mesh import basis
from contin.linalg.periodic import condense, log_eigenvalues


def chain(diagonals, seed=0):
    """Return S_1 D_1 S_0^-1, S_2 D_2 S_1^-1, ...; the last S is S_0 again: the product has the eigenvalues of D_N ... D_1."""
    count, n = diagonals.shape
    bases = np.random.default_rng(seed).standard_normal((count, n, n)) + 2 * np.eye(n)
    return np.array([bases[(j + 1) % count] @ np.diag(diagonals[j]) @ np.linalg.inv(bases[j]) for j in range(count)])


@pytest.mark.parametrize("rates", [[1.0], [2.0, 1.0], [1.0, -40.0], [600.0, 0.0, -3.0, -900.0], [3.0, 2.9, 2.8, -5.0, -5.1]])
def test_eigenvalues_of_any_size_have_relative_accuracy(rates):
    """Each matrix has its share of the logarithms; the second eigenvalue of the product is negative."""
    count, rates = 301, np.array(rates)
    diagonals = np.tile(np.exp(rates / count), (count, 1))
    diagonals[:, 1:2] *= -1  # an odd number of them
    found = log_eigenvalues(chain(diagonals))
    assert found.real == pytest.approx(np.sort(rates)[::-1], abs=1e-10, rel=1e-12)
    assert np.count_nonzero(np.abs(found.imag) > 3) == (len(rates) > 1)


def test_a_complex_pair():
    """A turn by 0.1 in each of 20 matrices that grow by 1 %, seen from other bases."""
    turn = 1.01 * np.array([[np.cos(0.1), -np.sin(0.1)], [np.sin(0.1), np.cos(0.1)]])
    bases = np.random.default_rng(1).standard_normal((20, 2, 2))
    factors = np.array([bases[(j + 1) % 20] @ turn @ np.linalg.inv(bases[j]) for j in range(20)])
    assert sorted(log_eigenvalues(factors).imag) == pytest.approx([-2, 2])
    assert log_eigenvalues(factors).real == pytest.approx(20 * np.log(1.01))


def test_zero_and_no_number():
    assert np.all(np.isneginf(log_eigenvalues(np.zeros((3, 2, 2))).real))
    assert np.all(np.isnan(log_eigenvalues(np.full((3, 2, 2), np.nan))))


@pytest.mark.parametrize(("n", "degree"), [(1, 2), (3, 4), (5, 3), (9, 4)])
def test_transition_matrices_solve_the_collocation_equations(n, degree):
    """A perturbation of one at the left end and what the equations make of it at the right end, by a dense solve."""
    tables, h, random = basis(degree), np.array([0.2, 0.5, 0.3]), np.random.default_rng(2)
    jacobian = random.standard_normal((3 * degree, n, n))
    by_node = np.einsum("qm,ab->qamb", tables.slope, np.eye(n)) - np.einsum(
        "j,qm,jqab->jqamb", h, tables.value, jacobian.reshape(3, degree, n, n)
    )
    matrices = by_node.reshape(3, degree * n, -1)
    solved = np.linalg.solve(matrices[:, :, n:], -matrices[:, :, :n])[:, -n:]
    found, block = np.empty((3, n, n)), np.empty((degree * n, (degree + 1) * n))
    condense(tables.value, tables.slope, h, jacobian, block, np.empty((degree + 1) * n, np.int64), found)
    assert found == pytest.approx(solved, abs=1e-12)
