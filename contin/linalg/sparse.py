"""LU factorization of a sparse matrix, by SuperLU."""

from __future__ import annotations

from typing import Any

import numpy as np

from contin.arrays import Array, Indices

#: Border rows are scaled to this part of the matrix: one becomes a pivot only where all other entries are smaller. Otherwise
#: they would become pivots anywhere, and fill the factors. Pivots that small lose nine digits; refinement gives them back.
_BORDER = 2.0**-30


class SparseFactors:
    """LU of a sparse matrix: `Factors` of large systems without a mesh.

    Parameters
    ----------
    matrix : scipy.sparse array, shape (n, n)
    borders : int
        So many rows at the end are dense.

    Raises
    ------
    ValueError
        If the matrix is not square.

    Examples
    --------
    >>> from scipy.sparse import csc_array
    >>> factors = SparseFactors(csc_array(np.array([[0.0, 2.0], [1.0, 0.0]])))
    >>> factors.solve(np.array([2.0, 3.0])).tolist(), factors.sign
    ([3.0, 1.0], -1.0)
    """

    def __repr__(self) -> str:
        return f"{type(self).__name__}(sign of the determinant {self.sign:g})"

    def __init__(self, matrix: Any, borders: int = 0) -> None:
        from scipy.sparse.linalg import splu  # type: ignore[import-untyped]  # .1 s; only large problems need it

        if matrix.shape[0] != matrix.shape[1]:
            raise ValueError(f"a matrix of {matrix.shape[0]} rows and {matrix.shape[1]} columns is not square")
        self._matrix = matrix.tocsc(copy=True)
        self._lu: Any = None
        self._scale = np.ones(matrix.shape[0])
        if borders:
            rows = abs(matrix.tocsr())
            self._scale[-borders:] = _BORDER * (rows[:-borders].max() or 1.0) / (rows[-borders:].max() or 1.0)
        self._matrix.data *= self._scale[self._matrix.indices]
        #: Sign of the determinant: 0 if the matrix is singular, NaN if it is not finite.
        self.sign = np.nan
        if np.isfinite(matrix.data).all():
            try:
                self._lu = splu(self._matrix)
            except RuntimeError:  # a pivot is exactly zero
                self.sign = 0.0
            else:
                self.sign = self._sign()

    def _sign(self) -> float:
        negative = np.count_nonzero(self._lu.U.diagonal() < 0) + _odd(self._lu.perm_r) + _odd(self._lu.perm_c)
        return -1.0 if negative % 2 else 1.0

    def solve(self, b: Array) -> Array:
        """Return the x with J x = b, or for rows of b the rows x; NaN if J is singular."""
        return self._solved(b, "N")

    def solve_transposed(self, c: Array) -> Array:
        """Return the y with J^T y = c, likewise."""
        return self._solved(c, "T")

    def _solved(self, b: Array, kind: str) -> Array:
        b = np.asarray(b, dtype=float)
        if self._lu is None:
            return np.full(b.shape, np.nan)
        transposed = kind == "T"
        right = np.ascontiguousarray(b.T if transposed else (b * self._scale).T)
        matrix = self._matrix.T if transposed else self._matrix
        x = self._lu.solve(right, kind)
        x += self._lu.solve(right - matrix @ x, kind)
        return np.ascontiguousarray(x.T * self._scale if transposed else x.T)


def _odd(permutation: Indices) -> int:
    """Return 1 for an odd permutation, 0 for an even one: its length less the number of its cycles."""
    from scipy.sparse import coo_array  # type: ignore[import-untyped]
    from scipy.sparse.csgraph import connected_components  # type: ignore[import-untyped]

    n = len(permutation)
    graph = coo_array((np.ones(n), (np.arange(n), permutation)), shape=(n, n))
    return int(n - connected_components(graph, directed=False)[0]) % 2
