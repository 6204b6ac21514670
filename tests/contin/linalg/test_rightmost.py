"""Eigenvalues near the imaginary axis against those of the dense matrix."""

import numpy as np
import pytest
import scipy.sparse

from contin.linalg.matrices import rightmost


def turning(frequency, growth, seed):
    """Return a sparse matrix of random entries with a pair ``growth`` -+ i ``frequency``."""
    random = np.random.default_rng(seed)
    matrix = scipy.sparse.random(200, 200, 0.01, random_state=seed, data_rvs=random.standard_normal).toarray() - 1.6 * np.eye(
        200
    )
    matrix[:2], matrix[:, :2] = 0, 0
    matrix[:2, :2] = [[growth, frequency], [-frequency, growth]]
    return matrix


@pytest.mark.sample(2)
@pytest.mark.parametrize("frequency", [0.3, 5.0, 300.0])
@pytest.mark.parametrize("growth", [0.01, -0.01])
def test_all_beside_the_axis_are_found(frequency, growth):
    matrix = turning(frequency, growth, 3)
    found, expected = rightmost(scipy.sparse.csc_array(matrix)), np.linalg.eigvals(matrix)
    assert np.count_nonzero(found.real > 0) == np.count_nonzero(expected.real > 0)
    for value in expected[expected.real > -0.05]:
        assert np.abs(found - value).min() < 1e-9 * (1 + abs(value))
    assert all(np.abs(expected - value).min() < 1e-8 * (1 + abs(value)) for value in found)


def test_more_unstable_ones_than_are_looked_for_at_first():
    diagonal = np.append(np.linspace(0.1, 1, 40), -np.linspace(0.1, 30, 160))
    found = rightmost(scipy.sparse.diags_array(diagonal))
    assert np.count_nonzero(found.real > 0) == 40


def test_a_matrix_that_is_not_finite():
    assert np.all(np.isnan(rightmost(scipy.sparse.csc_array(np.full((3, 3), np.inf)))))
