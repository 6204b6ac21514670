"""LU factorization of a dense matrix."""

from __future__ import annotations

import functools
import math
from typing import Any

import numpy as np

from contin.arrays import Array, ComplexArray
from contin.linalg.small import factor_matrix, solve_rows
from contin.linalg.spectrum import fill_eigenvalues

#: Number of rows up to which kernels are used, which start no threads: one solution of a small system with those of BLAS takes
#: 7 ms of the processor where other processes run. Eigenvalues are found faster than by LAPACK, ten times for three rows, twice
#: for sixty; factors twice as fast up to fifty rows, half as fast for a hundred.
_SMALL = 100


@functools.cache
def _lapack() -> Any:
    """Return SciPy's LAPACK: it takes .1 s to load, and only problems without a mesh need it.

    `scipy.linalg.lu_solve` takes 14 us for ten unknowns, `numpy.linalg.solve`, which factors again, 6 us, and dgetrs 0.7 us.
    """
    from scipy.linalg import lapack  # type: ignore[import-untyped]

    return lapack


def eigenvalues(matrix: Array) -> ComplexArray:
    """Return the eigenvalues of a real matrix, complex; NaN where it is not finite, as outside the domain of the equations.

    Several matrices, shape (..., n, n), have one row of eigenvalues each, all NaN where one of them is not finite.

    Raises
    ------
    numpy.linalg.LinAlgError
        They are not found, of a large matrix; they are NaN of a small one then.

    Examples
    --------
    >>> eigenvalues(np.diag([1.0, 2.0])).tolist(), eigenvalues(np.full((1, 1), np.inf)).tolist()
    ([(1+0j), (2+0j)], [(nan+0j)])
    """
    if not np.isfinite(matrix).all():
        return np.full(matrix.shape[:-1], np.nan, dtype=complex)
    n = matrix.shape[-1]
    if n > _SMALL:
        return np.linalg.eigvals(matrix).astype(complex, copy=False)
    count = math.prod(matrix.shape[:-2])
    real, imaginary = np.empty((2, count, n))
    fill_eigenvalues(np.array(matrix, dtype=float, order="C").reshape(count, n, n), n, real, imaginary)
    return np.asarray(real + 1j * imaginary).reshape(matrix.shape[:-1])


class DenseFactors:
    """LU of a dense matrix, real or complex, with partial pivoting: `Factors` of small systems.

    Parameters
    ----------
    matrix : ndarray, shape (n, n)

    Raises
    ------
    ValueError
        If the matrix is not square.

    Examples
    --------
    >>> factors = DenseFactors(np.array([[0.0, 2.0], [1.0, 0.0]]))
    >>> factors.solve(np.array([2.0, 3.0])).tolist(), factors.sign
    ([3.0, 1.0], -1.0)
    """

    def __repr__(self) -> str:
        return f"{type(self).__name__}(sign of the determinant {self.sign:g})"

    def __init__(self, matrix: Array) -> None:
        if matrix.shape[0] != matrix.shape[1]:
            raise ValueError(f"a matrix of {matrix.shape[0]} rows and {matrix.shape[1]} columns is not square")
        #: The matrix itself.
        self.matrix = matrix
        self._is_complex = np.iscomplexobj(matrix)
        self._is_small = not self._is_complex and len(matrix) <= _SMALL
        if self._is_small:
            self._lu, self._exchanges = np.empty(matrix.shape), np.empty(len(matrix), dtype=np.int64)
            sign = factor_matrix(np.ascontiguousarray(matrix, dtype=float), self._lu, self._exchanges)
            self._singular = not abs(sign) > 0  # or not finite
        else:
            self._lu, self._exchanges, zero_pivot = (_lapack().zgetrf if self._is_complex else _lapack().dgetrf)(matrix)
            self._singular = zero_pivot > 0
            sign = self._sign() if not self._is_complex and np.isfinite(matrix).all() else np.nan
        #: Sign of the determinant: 0 if the matrix is singular, NaN if it is not finite or complex.
        self.sign = sign

    def _sign(self) -> float:
        """Return the sign of the product of the pivots, times -1 for each exchange of rows."""
        if self._singular:
            return 0.0
        exchanges = sum(row != place for place, row in enumerate(self._exchanges.tolist()))
        return -1.0 if (exchanges + np.count_nonzero(self._lu.diagonal() < 0)) % 2 else 1.0

    @property
    def reciprocal_condition(self) -> float:
        """About 1 / (|J| |J^-1|) in the norm of the largest sum of a column: 0 of a singular matrix."""
        if self.sign == 0 or not np.isfinite(self.sign):
            return self.sign
        return float(_lapack().dgecon(self._lu, np.abs(self.matrix).sum(axis=0).max())[0])

    def solve(self, b: Array) -> Array:
        """Return the x with J x = b, or for rows of b the rows x; NaN if J is singular."""
        return self._solved(b, transposed=False)

    def solve_transposed(self, c: Array) -> Array:
        """Return the y with J^T y = c, likewise."""
        return self._solved(c, transposed=True)

    def _solved(self, b: Array, transposed: bool) -> Array:
        b = np.asarray(b)
        if self._singular:
            return np.full(b.shape, np.nan)
        if self._is_small and not np.iscomplexobj(b):
            rows = np.array(b, dtype=float, order="C", ndmin=2)
            solve_rows(self._lu, self._exchanges, rows, int(transposed))
            return rows.reshape(b.shape)
        if self._is_small:
            return np.asarray(self._solved(b.real, transposed) + 1j * self._solved(b.imag, transposed))
        solve = _lapack().zgetrs if self._is_complex else _lapack().dgetrs
        return np.ascontiguousarray(solve(self._lu, self._exchanges, b.T, trans=transposed)[0].T)
