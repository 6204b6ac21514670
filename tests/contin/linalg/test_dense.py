"""LU of dense matrices that is kept, against numpy, which factors at every solve."""

import numpy as np
import pytest

from contin.linalg.matrices import DenseFactors


@pytest.mark.parametrize("n", [*range(1, 13), 60])
def test_solves_agree_with_numpy(n):
    random = np.random.default_rng(n)
    for _ in range(20):
        matrix, b = random.standard_normal((n, n)), random.standard_normal((3, n))
        given = matrix.copy()
        factors = DenseFactors(given)
        tolerance = 1e-14 * np.linalg.cond(matrix)
        for found, transposed in ((factors.solve, matrix), (factors.solve_transposed, matrix.T)):
            known = np.linalg.solve(transposed, b.T).T
            assert np.abs(found(b) - known).max() <= tolerance * np.abs(known).max()
            assert found(b).flags.c_contiguous
            assert np.array_equal(found(b[1]), found(b[1:2])[0])
            assert found(b[:0]).shape == (0, n)
        assert factors.sign == np.linalg.slogdet(matrix)[0]
        assert np.array_equal(given, matrix)


def test_a_singular_matrix_has_sign_zero_and_no_solution():
    for matrix in (np.zeros((2, 2)), np.array([[1.0, 2.0], [2.0, 4.0]])):
        factors = DenseFactors(matrix)
        assert factors.sign == 0
        assert np.all(np.isnan(factors.solve(np.ones(2))))
        assert factors.solve_transposed(np.ones((3, 2))).shape == (3, 2)
        assert np.all(np.isnan(factors.solve_transposed(np.ones((3, 2)))))


@pytest.mark.parametrize("value", [np.nan, np.inf])
def test_a_matrix_that_is_not_finite_has_no_sign(value):
    factors = DenseFactors(np.array([[1.0, value], [1.0, 1.0]]))
    assert np.isnan(factors.sign) and np.isnan(factors.solve(np.ones(2))).all()


def test_the_matrix_must_be_square():
    with pytest.raises(ValueError, match="2 rows and 3 columns is not square"):
        DenseFactors(np.ones((2, 3)))
