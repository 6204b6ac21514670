"""How many singular values pass zero in a step."""

from __future__ import annotations

import numpy as np

from contin.arrays import ComplexArray
from contin.linalg.singular import smallest_directions
from contin.stepping.trial import Trial

#: Factor by which a watched singular value may shrink in one step without passing zero, ...
_SHRINKS = 3.5
#: ... with passing zero (beyond it the zero lies at the very end, on neither side for certain), ...
_VANISHES = 1e4
#: ... and so that factors from a nearby iterate cannot mistake the one for the other.
_CALM = 2.0


def quotients(before: Trial, after: Trial, rounds: int = 2) -> ComplexArray:
    """How the smallest singular values change between two neighbouring trials, from their factors: shape (watched,), complex.

    In the directions in which ``after`` is nearest to singular, J^-1 of the two is compared: each passage of a singular value
    through zero turns one eigenvalue of the quotient negative. A determinant sees the parity only; two modes that cross
    together, or two branch points in one step, are seen here. NaN where a matrix is exactly singular.
    """
    with np.errstate(all="ignore"):
        right, left, response = smallest_directions(after.factors, after.system.size, rounds)
        earlier = right @ before.factors.solve(left).T
        if not (np.all(np.isfinite(response)) and np.all(np.isfinite(earlier))):
            return np.full(len(response), np.nan, dtype=complex)
        try:
            return np.linalg.eigvals(np.linalg.solve(earlier, response)).astype(complex, copy=False)
        except np.linalg.LinAlgError:
            return np.full(len(response), np.nan, dtype=complex)


def calm(values: ComplexArray) -> bool:
    """Whether no singular value comes anywhere near zero, so that quotients of approximate factors are good enough."""
    return bool(np.all((values.real > 0) & (np.abs(values) < _CALM)))


def crossings(values: ComplexArray) -> tuple[int, bool]:
    """How many singular values pass zero, from their `quotients`, and whether that is clear.

    Where a watched value shrinks by a large factor, others may have passed behind it: that is not clear.
    """
    passed = (values.real < 0) & (np.abs(values.imag) < np.abs(values.real))
    clear = np.abs(values) < np.where(passed, _VANISHES, _SHRINKS)
    return int(np.count_nonzero(passed)), bool(np.all(clear))
