"""A zero of a scalar function, located as far as round-off allows.

Not SciPy's: each evaluation is a correction by Newton's method, and on the 206 zeros of the test bank this method takes 4.0 of
them a zero, `scipy.optimize.brentq` 5.3 and `toms748` 5.9. It begins with a guess where there is one, and stops where the
values no longer fall.
"""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np

from contin.errors import ConvergenceError
from contin.levels import CORRECTED, MOST_HALVINGS

#: Steps up to so many tolerances may be round-off of the function: it is known to about a thousand times that of the place.
_IDLE = 1e3
#: Values scatter, which is round-off, where the bracket closes to this part, in so many evaluations or more, and the larger one
#: at its ends is not half as small: even with the slope of a cube root it is, where the bracket closes to an eighth.
_NOISY, _OFTEN = 1e-2, 4
#: Values of which the smaller one is more than this part of the larger one are alike: round-off gives both.
_ALIKE = 0.01
#: A value where the bracket closes is no zero if it is above this part of the larger one at its first ends: the function jumps.
#: At a zero with an infinite slope, as of a square root, it is 1e-6 of them.
_JUMP = 1e-3
#: Part of the first bracket in which a function has come down to `_JUMP` of its values, even with the slope of a cube root, or
#: jumps. Ten times larger saves three evaluations of 30 where it jumps, and takes such a root for a jump.
_CLOSED = _JUMP**3

#: A place and the function's value there.
Value = tuple[float, float]


def find_zero(
    function: Callable[[float], float], left: Value, right: Value, tolerance: float, guess: float | None = None
) -> float:
    """Return a zero of ``function`` between two places where its values differ in sign: a place where it was evaluated.

    Inverse quadratic interpolation through the last three places, the secant method with the Anderson-Björck rule where that
    leaves the bracket or the ``guess`` is missing, bisection where neither makes progress. Ends when the next step would be
    below ``tolerance``, or when the values no longer fall: they are round-off.

    Raises
    ------
    ConvergenceError
        The function jumps: it has no zero between the two places.

    Examples
    --------
    >>> print(round(find_zero(lambda x: x * x - 2, (1.0, -1.0), (2.0, 2.0), 1e-12), 12))
    1.414213562373
    """
    (a, fa), (b, fb) = left, right
    if fa == 0 or fb == 0:
        return a if fa == 0 else b
    known, beyond, closed = [left, right], fa, _CLOSED * abs(b - a)
    best, idle, c, fc = (np.inf, b), 0, guess, np.nan
    course = _Course(abs(b - a), max(abs(fa), abs(fb)))
    small, least = _JUMP * max(abs(fa), abs(fb)), min(abs(fa), abs(fb))
    # A value that stays above the level has not come nearer to zero.
    level = least / 2 if least > CORRECTED * max(abs(fa), abs(fb)) else np.inf
    for _ in range(MOST_HALVINGS):
        c = _inside(c, (a, fa), (b, fb))
        fc = function(c)
        if fc == 0:
            return c
        if (fc < 0) != (fb < 0):
            a, fa, beyond = b, fb, fb
        else:
            shrink = 1 - fc / fb
            fa *= shrink if shrink > 0 else 0.5
        b, fb = c, fc
        if abs(b - a) < closed and min(abs(beyond), abs(fb)) > small:
            break
        known = [*known[-2:], (c, fc)]
        following = _interpolated(known, _secant((a, fa), (b, fb)))
        move = abs(following - c)
        if move < _IDLE * tolerance and level <= abs(fc) <= small:
            c = (a + b) / 2  # it is as small all along one side, and jumps somewhere
            continue
        if move <= tolerance and abs(fc) <= small:
            return c
        idle = idle + 1 if move < _IDLE * tolerance and abs(fc) > best[0] / 2 else 0
        best = min(best, (abs(fc), c))
        course.go_on(abs(b - a), *sorted((abs(beyond), abs(fb))))
        if best[0] <= small and (idle == 2 or course.scatters):
            return best[1]
        # It stands still as for an exponential function seen from where that is flat.
        halve = move > _IDLE * tolerance and abs(fc) > least / 2 and course.bisects()
        c = (a + b) / 2 if halve else following
    if best[0] <= CORRECTED * small:  # a zero of a higher order, to which values fall slowly
        return best[1]
    raise ConvergenceError(f"no zero between the two ends (last value {fc:.1e})")


def _inside(place: float | None, one: Value, other: Value) -> float:
    """Return a place if it lies between two others, else where the secant has its zero, or else the middle."""
    low, high = sorted((one[0], other[0]))
    if place is None or not low < place < high:
        place = _secant(one, other)
    return place if low < place < high else (low + high) / 2


def _secant(one: Value, other: Value) -> float:
    """Return where the straight line through two places has value zero."""
    (a, fa), (b, fb) = one, other
    return b - fb * (b - a) / (fb - fa)


class _Course:
    """How a bracket closes, while the larger value at its ends does not become half as small.

    Attributes
    ----------
    scatters : bool
        Values are round-off: the bracket closes, and they are alike at both ends, where a jump may have a flat side.
    """

    def __init__(self, width: float, value: float) -> None:
        self._width, self._value, self._often, self._patience = width, value, 0, _OFTEN
        self._stands_still = self.scatters = False

    def go_on(self, width: float, smaller: float, larger: float) -> None:
        """Take the next bracket."""
        self._often += 1
        if larger < self._value / 2:
            self._width, self._value, self._often = width, larger, 0
        self._stands_still = self._often >= self._patience and width > self._width / 2
        self.scatters = self._often >= _OFTEN and width < _NOISY * self._width and smaller > _ALIKE * larger

    def bisects(self) -> bool:
        """Return whether the bracket is halved; if so, sooner the next time: two zeros may be close, seen from afar."""
        if self._stands_still:
            self._patience = max(self._patience // 2, 1)
        return self._stands_still


def _interpolated(known: list[Value], otherwise: float) -> float:
    """Return where the parabola through three places, as a function of the value, has value zero."""
    (x, fx), (y, fy), (z, fz) = known
    if fx == fy or fy == fz or fz == fx:
        return otherwise
    size = -math.frexp(max(abs(fx), abs(fy), abs(fz)))[1]  # with the largest of order one, no product below is zero or infinite
    fx, fy, fz = (math.ldexp(value, size) for value in (fx, fy, fz))
    return x * fy * fz / ((fx - fy) * (fx - fz)) + y * fx * fz / ((fy - fx) * (fy - fz)) + z * fx * fy / ((fz - fx) * (fz - fy))
