"""The number of singular values of [F_x; row] that pass zero in a step.

The determinant sees the parity only: two modes that cross together, or two branch points in one step, leave its sign as it
was. They are seen in the quotient of the inverse matrices at both ends, restricted to the directions in which the matrix at
the end is nearest to singular: each passage of a singular value through zero turns one of its eigenvalues negative.
"""

from __future__ import annotations

import numpy as np

from contin.arrays import ComplexArray
from contin.linalg.factors import Factors
from contin.linalg.singular import smallest_directions

#: Factor by which a watched singular value may shrink in one step without passing zero; beyond it, others may have passed
#: behind it. Smaller is safer and slower: ten times larger saves 2 % of the work on the test bank, and loses nothing there.
_SHRINKS = 3.5
#: The same for one that passes zero: where it ends ten thousand times smaller the zero lies at the very end of the step, on
#: neither side for certain.
_VANISHES = 1e4
#: Up to this change no singular value comes near zero, and factors of an iterate close by do as well. Ten times larger saves
#: 3 % of the work on the test bank, and loses nothing there.
_CALM = 2.0


def quotients(before: Factors, after: Factors, size: int, rounds: int = 2) -> ComplexArray:
    """Return how the smallest singular values change between two points, from factors there: shape (watched,), complex.

    Parameters
    ----------
    before, after : Factors
        Of [F_x; row] with one row.
    size : int
        Of the matrix.
    rounds : int
        Rounds of inverse iteration.

    Returns
    -------
    ndarray
        Eigenvalues of the quotient; NaN where a matrix is exactly singular.
    """
    with np.errstate(all="ignore"):
        right, left, response = smallest_directions(after, size, rounds)
        earlier = right @ before.solve(left).T
        if not (np.all(np.isfinite(response)) and np.all(np.isfinite(earlier))):
            return np.full(len(response), np.nan, dtype=complex)
        try:
            return np.linalg.eigvals(np.linalg.solve(earlier, response)).astype(complex, copy=False)
        except np.linalg.LinAlgError:
            return np.full(len(response), np.nan, dtype=complex)


def calm(values: ComplexArray) -> bool:
    """Return whether no singular value comes anywhere near zero, from `quotients`, be they of approximate factors."""
    return bool(np.all((values.real > 0) & (np.abs(values) < _CALM)))


def crossings(values: ComplexArray) -> tuple[int, bool]:
    """Return how many singular values pass zero, from `quotients`, and whether that is clear.

    It is not where a watched value shrinks by a large factor.
    """
    passed = (values.real < 0) & (np.abs(values.imag) < np.abs(values.real))
    clear = np.abs(values) < np.where(passed, _VANISHES, _SHRINKS)
    return int(np.count_nonzero(passed)), bool(np.all(clear))
