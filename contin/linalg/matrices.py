"""Matrices without a mesh: LU factors of dense and sparse ones, and their eigenvalues."""

from __future__ import annotations

import contextlib
import functools
import math
from typing import Any

import numpy as np

from contin.arrays import Array, ComplexArray, Function, Indices
from contin.draws import generator
from contin.levels import CORRECTED, DOUBLED
from contin.linalg.small import factor_matrix, fill_eigenvalues, solve_rows

#: Number of rows up to which kernels are used, which start no threads: one solution of a small system with those of BLAS takes
#: 7 ms of the processor where other processes run, a spectrum of a hundred rows 200 ms in place of 4. Factors are twice as
#: fast as LAPACK's up to fifty rows, half as fast for a hundred; spectra ten times for three rows, as fast for two hundred.
_SMALL, _SMALL_SPECTRUM = 128, 200


@functools.cache
def _lapack() -> Any:
    """Return SciPy's LAPACK: it takes .1 s to load, and only problems without a mesh need it.

    `scipy.linalg.lu_solve` takes 14 us for ten unknowns, `numpy.linalg.solve`, which factors again, 6 us, and dgetrs 0.7 us.
    """
    from scipy.linalg import lapack  # type: ignore[import-untyped]

    return lapack


def eigenvalues(matrix: Array) -> ComplexArray:
    """Return the eigenvalues of a real matrix, complex; NaN where it is not finite, as outside the domain of the equations.

    Several matrices, shape (..., n, n), have one row of eigenvalues each, all NaN where one of them is not finite. Raises
    numpy.linalg.LinAlgError where they are not found, of a large matrix; they are NaN of a small one then.

    Examples
    --------
    >>> eigenvalues(np.diag([1.0, 2.0])).tolist(), eigenvalues(np.full((1, 1), np.inf)).tolist()
    ([(1+0j), (2+0j)], [(nan+0j)])
    """
    if not np.isfinite(matrix).all():
        return np.full(matrix.shape[:-1], np.nan, dtype=complex)
    n = matrix.shape[-1]
    if n > _SMALL_SPECTRUM:
        return np.linalg.eigvals(matrix).astype(complex, copy=False)
    count = math.prod(matrix.shape[:-2])
    real, imaginary = np.empty((2, count, n))
    fill_eigenvalues(np.array(matrix, dtype=float, order="C").reshape(count, n, n), n, real, imaginary)
    return np.asarray(real + 1j * imaginary).reshape(matrix.shape[:-1])


class DenseFactors:
    """LU of a dense matrix, real or complex, with partial pivoting: `Factors` of small systems.

    Raises ValueError if the matrix is not square.

    - ``matrix`` (ndarray, shape (n, n))

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
        if self._is_small and b.dtype.kind != "c":
            rows = np.array(b, dtype=float, order="C", ndmin=2)
            solve_rows(self._lu, self._exchanges, rows, int(transposed))
            return rows.reshape(b.shape)
        if self._is_small:
            return np.asarray(self._solved(b.real, transposed) + 1j * self._solved(b.imag, transposed))
        solve = _lapack().zgetrs if self._is_complex else _lapack().dgetrs
        return np.ascontiguousarray(solve(self._lu, self._exchanges, b.T, trans=transposed)[0].T)


#: Border rows are scaled to this part of the matrix: one becomes a pivot only where all other entries are smaller. Otherwise
#: they would become pivots anywhere, and fill the factors. Pivots that small lose nine digits; refinement gives them back.
_BORDER = 2.0**-30


class SparseFactors:
    """LU of a sparse matrix, real or complex: `Factors` of large systems without a mesh.

    Raises ValueError if the matrix is not square.

    - ``matrix`` (scipy.sparse array, shape (n, n))
    - ``borders`` (int): So many rows at the end are dense.
    - ``solver`` (callable, optional): Factors a matrix, see `contin.AlgebraicProblem`; SciPy's SuperLU by default.

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
            sizes, within = np.abs(self._matrix.data), self._matrix.indices < matrix.shape[0] - borders
            largest = [sizes[kept].max(initial=0.0) or 1.0 for kept in (within, ~within)]
            self._scale[-borders:] = _BORDER * largest[0] / largest[1]
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


#: Eigenvalues that each operator gives at first, and restarts. Those that converge late are not wanted: without a bound on
#: restarts, a reaction-diffusion problem takes a hundred times as long.
_COUNT = 12
#: Dimension of the Krylov space for each eigenvalue.
_SPACE = 4
#: Shifts of the Cayley transforms, as multiples of the largest eigenvalue near zero: oscillations with frequencies up to ten
#: times the largest shift are found.
_SHIFTS = (1.0, 30.0)
#: Cayley transforms look right of the line Re z = -_STRIP times the shift.
_STRIP = 0.2


def rightmost(matrix: Any, solver: Function | None = None) -> ComplexArray:
    """Return the eigenvalues of a real sparse matrix that lie right of the imaginary axis or near to it, by Arnoldi's method.

    The Cayley transform (A - s)^-1 (A + s + 2 d) with s, d > 0 has the eigenvalues (z + s + 2 d) / (z - s): larger than one
    exactly for the z with Re z > -d, so that Arnoldi's method finds these first (Meerbergen, Spence and Roose 1994). Its shifts
    s come from the eigenvalues that are nearest to zero. Eigenvalues far left of the axis are not looked for.

    - ``matrix`` (scipy.sparse array, shape (n, n))
    - ``solver`` (callable, optional): Factors a matrix, see `contin.AlgebraicProblem`; SciPy's SuperLU by default.

    Returns
    -------
    ndarray
        In conjugate pairs, each once; NaN where the matrix is not finite.

    Examples
    --------
    >>> from scipy.sparse import diags_array
    >>> turning = np.append(3.0, np.zeros(60))
    >>> values = rightmost(diags_array([np.append([0.5, 0.5], -1.0 - np.arange(60)), turning, -turning], offsets=[0, 1, -1]))
    >>> [complex(z) for z in np.round(values[values.real > 0], 9)]
    [(0.5+3j), (0.5-3j)]
    """
    from scipy.sparse import csc_array, eye_array  # .1 s; only large problems need it
    from scipy.sparse.linalg import splu

    factor = solver or splu
    matrix = csc_array(matrix, dtype=float)
    if not np.isfinite(matrix.data).all():
        return np.full(2, np.nan, dtype=complex)
    n, size = matrix.shape[0], float(abs(matrix).sum(axis=0).max())
    one = eye_array(n, format="csc")

    def inverse(pole: float) -> Function:
        factors = factor(matrix - pole * one)
        return lambda v: factors.solve(v, "N")

    return rightmost_of(inverse, n, size, size)


def rightmost_of(inverse: Function, n: int, size: float, largest: float = math.inf) -> ComplexArray:
    """Return the same eigenvalues of an operator A that is known by its inverses, as in `rightmost`.

    - ``inverse`` (callable): ``inverse(s)`` returns the function v -> (A - s)^-1 v of vectors (n,); it raises RuntimeError
      where there is none.
    - ``n`` (int)
    - ``size``, ``largest`` (float): A size of A: zero is looked at from a billionth of it. The largest shift.
    """
    found = [_transformed(inverse, n, 1e-9 * size, 0.0)]  # a matrix at a fold is singular itself
    scale = float(np.abs(found[0]).max(initial=0.0)) or 1.0
    for share in _SHIFTS:
        shift, count = min(share * scale, largest), _COUNT
        found.append(_transformed(inverse, n, shift, (1 + 2 * _STRIP) * shift))
        while np.all(found[-1].real > 0) and found[-1].size and 2 * count < n:  # there may be more
            count *= 2
            found.append(_transformed(inverse, n, shift, (1 + 2 * _STRIP) * shift, count))
    return _distinct(np.concatenate(found))


def nearest(matrix: Any, value: complex) -> complex:
    """Return the eigenvalue of a real sparse matrix that is nearest to a value; NaN where none is found.

    Examples
    --------
    >>> from scipy.sparse import diags_array
    >>> print(np.round(nearest(diags_array([np.arange(50.0)], offsets=[0]), 7.3), 9))
    (7+0j)
    """
    from scipy.sparse import csc_array, eye_array
    from scipy.sparse.linalg import splu

    n = matrix.shape[0]
    shifted = csc_array(matrix, dtype=complex) - complex(value) * eye_array(n, format="csc")
    if not np.isfinite(shifted.data).all():
        return complex("nan")
    return nearest_of(lambda _: splu(shifted).solve, n, value)


def nearest_of(inverse: Function, n: int, value: complex) -> complex:
    """Return the same of an operator A that is known by its inverses: ``inverse(s)`` is the function v -> (A - s)^-1 v."""
    from scipy.sparse.linalg import ArpackError, LinearOperator, eigs

    start = generator("rightmost").standard_normal(n).astype(complex)
    try:
        operator = LinearOperator((n, n), inverse(complex(value)), dtype=complex)
    except RuntimeError:  # exactly singular
        return complex(value)
    try:
        found = eigs(operator, 1, v0=start, tol=CORRECTED, return_eigenvectors=False)
    except ArpackError:
        return complex("nan")
    return complex(value + 1 / found[0])


def _transformed(inverse: Function, n: int, pole: float, zero: float, count: int = _COUNT) -> ComplexArray:
    """Return the eigenvalues z of largest |(z + zero) / (z - pole)|, or of largest 1 / |z - pole| without a zero."""
    from scipy.sparse.linalg import ArpackError, ArpackNoConvergence, LinearOperator, eigs

    try:
        solve = inverse(pole)
    except RuntimeError:  # exactly singular
        return np.empty(0, dtype=complex)
    operator = LinearOperator((n, n), lambda v: v + (pole + zero) * solve(v) if zero else solve(v), dtype=float)
    start = generator("rightmost").standard_normal(n)
    options = {"ncv": min(_SPACE * count, n), "maxiter": _COUNT, "tol": CORRECTED, "return_eigenvectors": False}
    try:
        values: Any = eigs(operator, min(count, n - 2), v0=start, **options)
    except ArpackNoConvergence as error:
        values = error.eigenvalues
    except ArpackError:
        values = np.empty(0)
    values = np.asarray(values, dtype=complex)
    with np.errstate(all="ignore"):
        back: Any = (pole * values + zero) / (values - 1) if zero else pole + 1 / values
    return back[np.isfinite(back)]


def _distinct(values: ComplexArray) -> ComplexArray:
    """Return each of the values once, with its conjugate."""
    upper = values[values.imag >= 0]
    kept: list[complex] = []
    for value in upper[np.argsort(-upper.real, kind="stable")]:
        if all(abs(value - other) > DOUBLED * (1 + abs(value)) for other in kept):
            kept.append(complex(value))
    pairs = [each for z in kept for each in ((z, z.conjugate()) if z.imag > DOUBLED * (1 + abs(z)) else (complex(z.real),))]
    return np.array(pairs, dtype=complex)
