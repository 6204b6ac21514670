"""Eigenvalues of a large sparse matrix that decide on stability: those right of the imaginary axis, and those nearest to it."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from contin.arrays import ComplexArray, Function
from contin.draws import generator
from contin.levels import CORRECTED, DOUBLED

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

    Parameters
    ----------
    matrix : scipy.sparse array, shape (n, n)
    solver : callable, optional
        Factors a matrix, see `contin.AlgebraicProblem`; SciPy's SuperLU by default.

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
    from scipy.sparse import csc_array, eye_array  # type: ignore[import-untyped]  # .1 s; only large problems need it
    from scipy.sparse.linalg import splu  # type: ignore[import-untyped]

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

    Parameters
    ----------
    inverse : callable
        ``inverse(s)`` returns the function v -> (A - s)^-1 v of vectors (n,); it raises RuntimeError where there is none.
    n : int
    size, largest : float
        A size of A: zero is looked at from a billionth of it. The largest shift.
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
