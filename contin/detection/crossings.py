"""The number of singular values of [F_x; row] that pass zero in a step.

The determinant sees the parity only: two modes that cross together, or two branch points in one step, leave its sign as it
was. They are seen in the quotient of the inverse matrices at both ends: each passage of a singular value through zero turns one
of its eigenvalues negative. Of a small matrix all eigenvalues are computed; of a larger one those in the directions in which
the inverses differ most, by a block Krylov method. Directions in which the matrix is nearest to singular are not the same:
small singular values that stay as they are would hide those that pass.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from contin.arrays import Array, ComplexArray, Mask
from contin.linalg.dense import eigenvalues
from contin.linalg.factors import Factors
from contin.linalg.singular import orthonormalize, random_rows

#: Size of the largest matrix of which all eigenvalues are computed at once (some 5 ms). The iteration takes a tenth of that;
#: it went wrong where eigenvectors were nearly parallel (inverses of size 1e6): with 24, one of 60 random problems lost 7
#: double points.
_SMALL = 64
#: Size of the largest matrix of which all are computed where the iteration does not decide.
_MEDIUM = 128
#: Directions added in a round, and the largest number of them: where more change, the step is divided, which takes as long as
#: 16 directions do. With 64 the half loop of the benchmarks took 1.7 times as long, with 24 a fifth more.
_ADDED, _MOST = 4, 16
#: Residual of an eigenvalue, relative to the size of its terms, below which it has converged: its sign is then certain.
_CONVERGED = 0.1
#: Part of the inverse at the end in the difference of the inverses that the power method takes: a little less than all of it,
#: so that the difference is regular where nothing changes.
_KEPT = 0.999
#: A singular value that changes by less than this factor stays about as it is. Those that change less than it need not be
#: watched: where all singular values move by the same amount, those that pass zero change at least three times as much.
_STEADY = 3.0
#: Factor by which a watched singular value may shrink in one step without passing zero: one that ends close to zero may pass
#: it in the next step twice, and come back. Without this, two branch points of the test bank are lost.
_SHRINKS = 20.0
#: One that passes zero and ends this many times smaller vanishes at the very end of the step, on neither side for certain.
_VANISHES = 1e4
#: Up to this change no singular value comes near zero, and factors of an iterate close by do as well. A fifth of it costs 10 %
#: more factorizations on the test bank, twice as much saves 0.5 %.
_CALM = 10.0


def quotients(before: Factors, after: Factors, size: int) -> ComplexArray:
    """Return how the singular values that change most do so between two points, from factors there: shape (watched,), complex.

    Parameters
    ----------
    before, after : Factors
        Of [F_x; row] with one row.
    size : int
        Of the matrix.

    Returns
    -------
    ndarray
        Eigenvalues of the quotient; NaN where a matrix is exactly singular, or where too many change.
    """
    if size > _SMALL:
        values = _watched(before, after, size)
        if values is not None:
            return values
    return _all(before, after, size) if size <= _MEDIUM else np.full(1, np.nan, dtype=complex)


def _all(before: Factors, after: Factors, size: int) -> ComplexArray:
    """Return all eigenvalues of the quotient."""
    with np.errstate(all="ignore"):
        unit = np.eye(size)
        earlier, later = before.solve(unit).T, after.solve(unit).T
        if not (np.all(np.isfinite(later)) and np.all(np.isfinite(earlier))):
            return np.full(size, np.nan, dtype=complex)
        try:
            quotient: Any = np.linalg.solve(earlier, later)
            return eigenvalues(quotient)
        except np.linalg.LinAlgError:
            return np.full(size, np.nan, dtype=complex)


def _watched(before: Factors, after: Factors, size: int) -> ComplexArray | None:
    """Return the eigenvalues in those directions in which the inverses differ most; None where these are too many.

    A block of directions is added to both bases in each round, as by Golub and Kahan. The directions suffice where one of them
    is steady, and it and all that change more have converged.
    """
    left = right = earlier = later = np.empty((0, size))
    block = random_rows(_ADDED, size)
    with np.errstate(all="ignore"):
        while len(right) < min(_MOST, size / 2):
            new = _apart(before.solve_transposed(block) - _KEPT * after.solve_transposed(block), left)
            images = before.solve(new), after.solve(new)
            block = _apart(images[0] - _KEPT * images[1], right)
            left, right = np.vstack([left, new]), np.vstack([right, block])
            earlier, later = np.vstack([earlier, images[0]]), np.vstack([later, images[1]])
            values, vectors = _eigenvalues(right @ earlier.T, right @ later.T)
            if not np.all(np.isfinite(values)):
                return values
            first, last = _combined(vectors, earlier), _combined(vectors, later)
            missed = _lengths(last - values[:, None] * first)
            converged = missed < _CONVERGED * (_lengths(last) + np.abs(values) * _lengths(first))
            changes = _lengths(first - _KEPT * last)
            steady = converged & _is_steady(values)
            if not np.any(steady):
                continue
            decided = changes >= changes[steady].max()
            if np.all(converged[decided]) and np.all(decided | (values.real > 0)):
                found: ComplexArray = values[decided]
                return found
    return None


def _apart(rows: Array, others: Array) -> Array:
    """Return an orthonormal basis of what rows add to orthonormal others."""
    found = np.ascontiguousarray(rows / np.abs(rows).max(axis=1, keepdims=True))
    for _ in range(2):  # the second time takes what round-off left
        found = found - (found @ others.T) @ others
        orthonormalize(found)
    return found


def _eigenvalues(earlier: Array, later: Array) -> tuple[ComplexArray, ComplexArray]:
    """Return the eigenvalues of earlier^-1 later, and its eigenvectors as columns of unit length; NaN where it is singular."""
    if np.all(np.isfinite(later)) and np.all(np.isfinite(earlier)):
        try:
            values, vectors = np.linalg.eig(np.linalg.solve(earlier, later))
            return values.astype(complex, copy=False), vectors.astype(complex, copy=False)
        except np.linalg.LinAlgError:
            pass
    return np.full(len(later), np.nan, dtype=complex), np.full(later.shape, np.nan, dtype=complex)


def _combined(vectors: ComplexArray, rows: Array) -> ComplexArray:
    """Return the combinations of rows whose coefficients are the columns of ``vectors``.

    In real numbers: OpenBLAS gives products of complex matrices of this size to several threads, which took 14 ms instead of
    20 us, and different last digits.
    """
    found: ComplexArray = (vectors.real.T @ rows) + 1j * (vectors.imag.T @ rows)
    return found


def _lengths(rows: ComplexArray) -> Array:
    lengths: Array = np.sqrt(np.sum(rows.real**2 + rows.imag**2, axis=1))
    return lengths


def _is_steady(values: ComplexArray) -> Mask:
    """Return which of the singular values stay about as they are."""
    return (values.real > 1 / _STEADY) & (np.abs(values) < _STEADY)


def calm(before: Factors, after: Factors, size: int) -> bool:
    """Return whether no singular value comes anywhere near zero between two points, be it from approximate factors."""
    values = _all(before, after, size) if size <= _SMALL else _glance(before, after, size)
    sizes = np.abs(values)
    return bool(np.all((values.real > 0) & (sizes < _CALM) & (sizes > 1 / _CALM)))


def _glance(before: Factors, after: Factors, size: int) -> ComplexArray:
    """Return the eigenvalues in a few directions after one round: enough where nothing changes much."""
    with np.errstate(all="ignore"):
        left = before.solve_transposed(random_rows(_ADDED, size)) - _KEPT * after.solve_transposed(random_rows(_ADDED, size))
        orthonormalize(left)
        earlier, later = before.solve(left), after.solve(left)
        right = earlier - _KEPT * later
        orthonormalize(right)
        return _eigenvalues(right @ earlier.T, right @ later.T)[0]


def crossings(values: ComplexArray) -> tuple[int, bool]:
    """Return how many singular values pass zero, from `quotients`, and whether that is clear.

    It is not where one of them is close to zero at the end.
    """
    passing = (values.real < 0) & (np.abs(values.imag) < np.abs(values.real))
    clear = np.abs(values) < np.where(passing, _VANISHES, _SHRINKS)
    return int(np.count_nonzero(passing)), bool(np.all(clear))


def passed(values: ComplexArray) -> tuple[Mask, Mask]:
    """Return which singular values pass zero before the second point, and which vanish right there, from `quotients`.

    Of those that vanish, round-off decides on the sign.
    """
    vanishing = np.abs(values) > _VANISHES
    passing = (values.real < 0) & (np.abs(values.imag) < np.abs(values.real)) & ~vanishing
    return passing, vanishing
