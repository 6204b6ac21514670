"""Factorization of a sparse matrix, by SuperLU or by a solver of the user."""

from __future__ import annotations

import contextlib
import functools
from typing import Any

import numpy as np

from contin.arrays import Array, Function, Indices

#: Border rows are scaled to this part of the matrix: one becomes a pivot only where all other entries are smaller. Otherwise
#: they would become pivots anywhere, and fill the factors. Pivots that small lose nine digits; refinement gives them back.
_BORDER = 2.0**-30


class SparseFactors:
    """LU of a sparse matrix, real or complex: `Factors` of large systems without a mesh.

    Parameters
    ----------
    matrix : scipy.sparse array, shape (n, n)
    borders : int
        So many rows at the end are dense.
    solver : callable, optional
        Factors a matrix, see `contin.AlgebraicProblem`; SciPy's SuperLU by default.

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

    def __init__(self, matrix: Any, borders: int = 0, solver: Function | None = None) -> None:
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
        self._is_finite = bool(np.isfinite(matrix.data).all())
        if self._is_finite:
            with contextlib.suppress(RuntimeError):  # a pivot is exactly zero
                self._lu = (solver or splu)(self._matrix)

    @functools.cached_property
    def sign(self) -> float:
        """Sign of the determinant: 0 if the matrix is singular, NaN if it is complex or not finite, or the solver does not say.

        It takes a copy of SuperLU's factors, so it is computed when it is first asked for.
        """
        lu = self._lu
        if lu is None:
            return 0.0 if self._is_finite else np.nan
        if hasattr(lu, "sign"):
            return float(lu.sign)
        if np.iscomplexobj(self._matrix) or not (hasattr(lu, "perm_r") and hasattr(lu, "perm_c") and hasattr(lu, "U")):
            return np.nan
        negative = np.count_nonzero(lu.U.diagonal() < 0) + _odd(lu.perm_r) + _odd(lu.perm_c)
        return -1.0 if negative % 2 else 1.0

    def solve(self, b: Array) -> Array:
        """Return the x with J x = b, or for rows of b the rows x; NaN if J is singular."""
        return self._solved(b, "N")

    def solve_transposed(self, c: Array) -> Array:
        """Return the y with J^T y = c, likewise."""
        return self._solved(c, "T")

    def _solved(self, b: Array, kind: str) -> Array:
        b = np.asarray(b, dtype=self._matrix.dtype)
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
