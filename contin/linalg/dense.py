"""LU factorization of a dense matrix."""

from __future__ import annotations

import numpy as np

from contin.arrays import Array


class DenseFactors:
    """LU of a dense matrix with the interface of `contin.condensation.Factorization`."""

    def __init__(self, matrix: Array) -> None:
        if matrix.shape[0] != matrix.shape[1]:
            raise ValueError(f"a matrix of {matrix.shape[0]} rows and {matrix.shape[1]} columns is not square")
        self._matrix = matrix
        #: Sign of the determinant.
        self.sign = np.linalg.slogdet(matrix)[0] if np.all(np.isfinite(matrix)) else np.nan

    def _solve(self, matrix: Array, b: Array) -> Array:
        try:
            return np.ascontiguousarray(np.linalg.solve(matrix, np.asarray(b).T).T)
        except np.linalg.LinAlgError:
            return np.full(np.shape(b), np.nan)

    def solve(self, b: Array) -> Array:
        """The x with J x = b, or for rows of b the rows x; NaN where J is singular."""
        return self._solve(self._matrix, b)

    def solve_transposed(self, c: Array) -> Array:
        """The y with J^T y = c."""
        return self._solve(self._matrix.T, c)
