"""The number of singular values of [F_x; row] that pass zero in a step.

The determinant sees the parity only: two modes that cross together, or two branch points in one step, leave its sign as it
was. They are seen in the quotient of the inverse matrices at both ends, restricted to the directions in which these differ
most: each passage of a singular value through zero turns one of its eigenvalues negative. Directions in which the matrix is
nearest to singular are not the same: small singular values that stay as they are would hide those that pass.
"""

from __future__ import annotations

import numpy as np

from contin.arrays import ComplexArray, Mask
from contin.linalg.factors import Factors
from contin.linalg.singular import orthonormalize, random_rows

#: Singular values that are watched between two points: two that vanish together, and more of those that change.
_WATCHED = 4
#: Part of the inverse at the end in the difference of the inverses that the power method takes: a little less than all of it,
#: so that the difference is regular where nothing changes.
_KEPT = 0.9
#: A singular value that changes by less than this factor stays about as it is. Where one of those watched does, all that change
#: more are watched, too.
_STEADY = 3.0
#: Factor by which a watched singular value may shrink in one step without passing zero: one that ends close to zero may pass
#: it in the next step twice, and come back. Without this, two branch points of the test bank are lost.
_SHRINKS = 20.0
#: One that passes zero and ends this many times smaller vanishes at the very end of the step, on neither side for certain.
_VANISHES = 1e4
#: Up to this change no singular value comes near zero, and factors of an iterate close by do as well. A fifth of it costs 10 %
#: more factorizations on the test bank, twice as much saves 0.5 %.
_CALM = 10.0


def quotients(before: Factors, after: Factors, size: int, rounds: int = 2) -> ComplexArray:
    """Return how the singular values that change most do so between two points, from factors there: shape (watched,), complex.

    Parameters
    ----------
    before, after : Factors
        Of [F_x; row] with one row.
    size : int
        Of the matrix.
    rounds : int
        Rounds of the power method.

    Returns
    -------
    ndarray
        Eigenvalues of the quotient; NaN where a matrix is exactly singular.
    """
    watched = min(_WATCHED, size)
    while True:
        values = _quotients(before, after, size, watched, rounds)
        if watched == size or not np.all(np.isfinite(values)) or _steady(values):
            return values
        watched, rounds = min(2 * watched, size), 2  # all of them change: there may be more


def _steady(values: ComplexArray) -> bool:
    """Return whether one of the singular values stays about as it is."""
    return bool(np.any((values.real > 1 / _STEADY) & (np.abs(values) < _STEADY)))


def _quotients(before: Factors, after: Factors, size: int, watched: int, rounds: int) -> ComplexArray:
    with np.errstate(all="ignore"):
        right = random_rows(watched, size)
        for _ in range(rounds):
            left = before.solve_transposed(right) - _KEPT * after.solve_transposed(right)
            orthonormalize(left)
            earlier, later = before.solve(left), after.solve(left)
            right = earlier - _KEPT * later
            orthonormalize(right)
        later, earlier = right @ later.T, right @ earlier.T
        if not (np.all(np.isfinite(later)) and np.all(np.isfinite(earlier))):
            return np.full(watched, np.nan, dtype=complex)
        try:
            return np.linalg.eigvals(np.linalg.solve(earlier, later)).astype(complex, copy=False)
        except np.linalg.LinAlgError:
            return np.full(watched, np.nan, dtype=complex)


def calm(values: ComplexArray) -> bool:
    """Return whether no singular value comes anywhere near zero, from `quotients`, be they of approximate factors."""
    return bool(np.all((values.real > 0) & (np.abs(values) < _CALM)))


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
