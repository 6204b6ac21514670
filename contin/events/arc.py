"""The piece of a curve inside a step: points of it at any distance, and zeros of functions, as far as round-off allows.

The method for zeros is not SciPy's: each evaluation is a correction by Newton's method, and on the 206 zeros of the test bank
this method takes 4.0 of them a zero, `scipy.optimize.brentq` 5.3 and `toms748` 5.9. It begins with a guess where there is one,
and stops where the values no longer fall.
"""

from __future__ import annotations

import functools
import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from contin.arrays import Array
from contin.core.newton import Newton, correct
from contin.core.protocol import inner
from contin.core.small import corrected_small
from contin.core.step import Reason, State, Stop, located, settled
from contin.core.trial import Event, Linearization, Trial, linearization
from contin.errors import ConvergenceError
from contin.levels import CORRECTED, LOCATED, MOST_HALVINGS, ROUGH
from contin.text import Shown

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
    below ``tolerance``, or when the values no longer fall: they are round-off. Raises ConvergenceError where the function
    jumps: it has no zero between the two places.

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

    - ``scatters`` (bool): Values are round-off: the bracket closes, and they are alike at both ends, where a jump may have a
      flat side.
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


#: Part of the corrector's tolerance of a step to which a zero is located: what the corrector leaves is round-off of functions.
_SHARE = 1e-2
#: Points of the curve lie no further off the cubic than this part of the step; others belong to another branch.
OFF = 0.1
#: Least cosine between the tangents at both ends that the cubic is made with: accepted steps turn by less.
LEAST_COSINE = 0.1

#: Where on a step: the distance along the state's tangent, and the point.
Place = tuple[float, Trial]


@dataclass(frozen=True, eq=False, repr=False)
class SpecialPoint(Shown):
    """A point located inside a step.

    - ``at`` (float): Distance from the beginning of the step, along the tangent there.
    - ``label``, ``name`` (str): As in `Event`.
    - ``trial`` (Trial)
    - ``stop`` (Stop, optional): The run ends here.
    - ``details`` (object): As in `contin.Point`.
    - ``test`` (Event, optional): Vanishes here.
    - ``same_as`` (SpecialPoint, optional): The fold or branch point that lies at the same place and is located better.
    - ``errors`` (mapping of str to float, optional): Errors of the free parameters, where they are known from how the point was
      found.
    - ``is_lost`` (bool): It was looked for on a finer mesh, and is not there.
    - ``is_located`` (bool): It was found, and not only bracketed.
    - ``slope`` (float): Derivative of the test function along the branch, roughly; NaN where it is not known.
    - ``coarse`` (SpecialPoint, optional): As the step has found it, where a normal form may belong to it.
    """

    at: float
    label: str
    name: str
    trial: Trial
    stop: Stop | None = None
    details: Any = None
    test: Event | None = None
    same_as: SpecialPoint | None = None
    errors: Mapping[str, float] | None = None
    is_lost: bool = False
    is_located: bool = True
    slope: float = math.nan
    coarse: SpecialPoint | None = None

    @property
    def full_name(self) -> str:
        """The name, for users: a "possible" one of a point that was only bracketed."""
        return self.name if self.is_located else f"possible {self.name}".strip()

    @property
    def is_simple(self) -> bool:
        """It was located, and one eigenvalue or pair is critical there."""
        return self.is_located and isinstance(self.details, dict) and self.details.get("pairs") == 1

    @property
    def closes(self) -> bool:
        """The branch closes here: it is the first point once more."""
        return self.stop is not None and self.stop.reason == Reason.CLOSED

    @property
    def is_trivial(self) -> bool:
        """The branch ends here, on the trivial one."""
        return self.stop is not None and self.stop.reason == Reason.TRIVIAL_BRANCH

    @property
    def turns_back(self) -> bool:
        """The curve ends here, on a symmetric solution: beyond, it is its own mirror image."""
        return self.stop is not None and self.stop.reason == Reason.PITCHFORK


class Arc:
    """The piece of a curve between the state of a run and the corrected point at the end of a step.

    - ``state`` (State)
    - ``before`` (tuple (float, Trial)): Where test functions start from: the state's point or, where that is a branch point,
      one close to it; and its distance along the state's tangent.
    - ``trial`` (Trial): The end, at ``step`` along the state's tangent.
    - ``step`` (float)
    - ``newton`` (Newton)
    - ``settles`` (bool): Points are settled (`contin.core.step`).
    """

    def __init__(self, state: State, before: Place, trial: Trial, step: float, newton: Newton, settles: bool = False) -> None:
        self.settles = settles
        self.state, self.trial, self.step, self.newton = state, trial, step, newton
        self.low, self.before = before
        self._last: Place | None = None
        #: Factors that the step left. Searches may take new ones; a resumed run, without factors of its first point from
        #: Newton's method, does so in other steps.
        self._factors = trial.factors if trial.is_linearized else None

    def passes(self, test: Event) -> bool:
        """Return whether there is a zero of a test function by its values at both ends."""
        return test.passed(self.before.value(test), self.trial.value(test))

    def at(self, distance: float) -> Trial:
        """Return the point of the curve at a distance along the state's tangent; raise ConvergenceError where there is none."""
        if self._last is not None and self._last[0] == distance:
            return self._last[1]
        guess, factors = self.guess(distance), self.trial.factors if self._factors is None else self._factors
        if self._last is not None:  # off the cubic by about as much as the last one was
            place, last = self._last
            guess = guess + last.x - self.guess(place)
            factors = last.factors if last.is_linearized else factors
        there = located(self.state, guess, distance, self.newton, factors)
        if self.settles:
            there = settled(there, self.state.tangent, self.newton)
        self._last = distance, there
        return there

    def guess(self, distance: float) -> Array:
        """Return the cubic through both ends and their tangents at a distance, shape (size,)."""
        s = distance / self.step
        return np.array([1.0, s, s * s, s * s * s]) @ self._cubic

    def direction(self, distance: float) -> Array:
        """Return the derivative of the cubic at a distance, by the part of the step, shape (size,)."""
        s = distance / self.step
        return np.array([0.0, 1.0, 2 * s, 3 * s * s]) @ self._cubic

    @functools.cached_property
    def _cubic(self) -> Array:
        """The coefficients of the cubic by powers of the part of the step, shape (4, size)."""
        state, trial, step = self.state, self.trial, self.step
        ahead = trial.x - state.x
        rate = step / max(inner(state.system, state.tangent, trial.tangent), LEAST_COSINE)
        a, b = state.tangent * step, trial.tangent * rate
        return np.array([state.x, a, 3 * ahead - 2 * a - b, a + b - 2 * ahead])

    def passes_by(self, x: Array, at: float) -> bool:
        """Return whether x lies near the cubic at a distance along the state's tangent, and not on another branch."""
        gap = x - self.guess(at)
        return float(np.sqrt(inner(self.state.system, gap, gap))) < OFF * self.step

    def guessed(self, distance: float) -> Trial:
        """Return the cubic at a distance as a trial, with the state's tangent."""
        return Trial(self.state.system, self.guess(distance), Linearization(self.state.tangent, float("nan")))

    def near(self, distance: float) -> Trial:
        """Return the point of the curve or, where Newton's method fails (close to a singular point), that of the cubic."""
        try:
            return self.at(distance)
        except ConvergenceError:
            return self.guessed(distance)

    @property
    def precision(self) -> float:
        """Distance to which zeros are located."""
        return max(CORRECTED, _SHARE * self.newton.tolerance) * self.step

    def beginning(self) -> Trial:
        """Return the state's point, be it a branch point."""
        state = self.state
        if not state.singular:
            return self.before
        return Trial(state.system, state.x, Linearization(state.tangent, state.sign))

    def locate(self, test: Event, left: Place, right: Place, guess: float | None = None) -> SpecialPoint:
        """Return the zero of a test function between two places; where location fails, the second one, which is not located."""
        (a, first), (b, last) = left, right
        ends, is_located, slope = (first.value(test), last.value(test)), True, math.nan
        looks = [(a, ends[0]), (b, ends[1])]

        def look(s: float) -> float:
            looks.append((s, test.function(self.at(s))))
            return looks[-1][1]

        try:
            if test.holds_one_of(first.system.free) and ends[0] * ends[1] < 0:
                held = self._held(test, left, right)
                if held is not None:
                    return SpecialPoint(held[0], test.label, test.name, held[1], stop_of(test), None, test)
            if np.sign(ends[0]) == np.sign(ends[1]) or ends[0] == 0:  # a limit that the run starts on
                at, there = a, first
            else:
                at = find_zero(look, looks[0], looks[1], self.precision, guess)
                there = self.at(at)
                s, value = min((place for place in looks if abs(place[0] - at) > LOCATED), key=lambda place: abs(place[0] - at))
                slope = (value - test.function(there)) / (s - at) * inner(self.state.system, self.state.tangent, there.tangent)
        except ConvergenceError:
            at, there, is_located = b, last, False
        details = None if test.describe is None else test.describe(there)
        given: Any = {"is_located": is_located, "slope": slope}
        return SpecialPoint(at, test.label, test.name, there, stop_of(test), details, test, **given)

    def _held(self, test: Event, left: Place, right: Place) -> Place | None:
        """Return the place between two where a free parameter has a value, with that held; None if it is not found.

        It begins where the cubic has the value. It finds no other place than one between the two, near the cubic.
        """
        assert test.value is not None
        state, system = self.state, self.state.system
        at = system.parameter_index(test.column)
        value = test.value / system.free_scales[at - system.state_size]
        one, two, three, four = self._cubic[:, at].tolist()

        def gap(distance: float) -> float:
            s = distance / self.step
            return float(one + s * (two + s * (three + s * four)) - value)

        ends = (left[0], gap(left[0])), (right[0], gap(right[0]))
        if not ends[0][1] * ends[1][1] < 0:
            return None
        row = np.zeros(system.size)
        row[at] = 1.0
        try:
            there = self._corrected(self.guess(find_zero(gap, *ends, ROUGH * self.step)), row, value)
        except ConvergenceError:
            return None
        place = inner(system, state.tangent, there.x - state.x)
        inside = left[0] < place < right[0] and self.passes_by(there.x, place)
        if not inside or (self.settles and system.on_switches(there.x) is not None):
            return None
        return place, there

    def _corrected(self, guess: Array, row: Array, value: float) -> Trial:
        """Return the point of the curve where a row has a value, with its tangent along the state's.

        Raises ConvergenceError where there is none.
        """
        system, state = self.state.system, self.state
        small = corrected_small(system, guess, row, value, self.newton)
        if small is None:
            done = correct(system, guess, row, value, self.newton)
            return Trial(system, done.x, lambda: linearization(system, done.x, state.row), done.iterations, done.error)
        side = math.copysign(1.0, inner(system, state.tangent, small.tangent))  # the determinant goes with row.tangent
        return Trial(system, small.x, Linearization(side * small.tangent, side * small.sign), small.iterations, small.error)


def stop_of(test: Event) -> Stop | None:
    """Return the reason why a run ends at a zero of a test function; None where it goes on."""
    if not test.terminal:
        return None
    if test.limit:
        return Stop(Reason.LIMIT, f"reached {test.name}")
    return Stop(Reason.EVENT, f"met {test.name}", event=test.name)
