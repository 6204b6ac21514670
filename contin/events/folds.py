"""Folds inside a step: places where the primary parameter turns, by more than the error of the discretization.

In a canard explosion a parameter stays within 1e-10 or less over many steps, while its rate on the mesh is 1e-11 with an
arbitrary sign: that of the error of the mesh. A rate that small is compared with the one on a finer mesh or, without a mesh,
with round-off. Where they differ, or where it is no more than that, the parameter stands still as far as can be told, and no
fold is seen there. A fold lies on such a plateau if the parameter leaves it in the other sense than the one it came in.

The rate r of the primary parameter along the step vanishes at a fold. One fold changes its sign from one end of the step to the
other; two folds leave it as it was, and show as a dip of r between the ends. From its values at both ends and its mean, which
is known from the parameter itself, r is a parabola. Where that, or an end close to zero, raises the suspicion of a dip, the
smallest |r| is searched by parabolas through three places, closer and closer as it sinks, until a place of the other sign
is found or r stays away from zero.
"""

from __future__ import annotations

import functools
import math
from collections.abc import Callable
from typing import Any

import numpy as np

from contin import draws
from contin.arrays import Array
from contin.core.newton import UNITS, Newton, correct
from contin.core.protocol import Discretization, inner
from contin.core.step import CLEAR, trial_of
from contin.core.trial import Event, Trial, linearization, sign_changed
from contin.errors import ConvergenceError
from contin.events.arc import Arc, Place, SpecialPoint
from contin.events.dips import DEEPER, followed
from contin.kernels.kernel_parts import helper
from contin.levels import APART, BESIDE, LAST_PLACES, LOCATED, ROUND_OFF
from contin.linalg.orientation import oriented

#: A change of a parameter below this, relative to 1 + its size, may be round-off of the corrector.
STANDS = 1e-13
#: A rate is significant where that on the finer mesh differs by less than this part of it.
_AGREES = 0.5
#: One up to this is not, on a mesh: one that agrees is round-off, too.
STILL = ROUND_OFF / (1 + _AGREES)


def sense(trial: Trial, fold: Event, newton: Newton) -> float:
    """Return the sign of the primary parameter's rate at a trial, computed once; zero where it is not significant."""
    return trial.value(_sense(fold, newton))


@functools.lru_cache(maxsize=8)
def _sense(fold: Event, newton: Newton) -> Event:
    def is_significant(trial: Trial, rate: float) -> bool:
        if not abs(rate) < CLEAR:
            return True
        if not trial.system.intervals:  # without a mesh, there is round-off only
            return abs(rate) > _noise(trial, fold)
        finer = on_finer_mesh(trial, newton) if abs(rate) > STILL else None
        again = 0.0 if finer is None else finer.value(fold)
        return abs(again) > ROUND_OFF and abs(again - rate) < _AGREES * abs(rate)

    def function(trial: Trial) -> float:
        rate = trial.value(fold)
        return float(np.sign(rate)) if is_significant(trial, rate) else 0.0

    return Event(fold.label, f"sense of {fold.name}", function)


def _noise(trial: Trial, fold: Event) -> float:
    """Return the rate of the primary parameter that is round-off, without a mesh.

    Each equation is evaluated with an error as large as one unit in the last place of x makes, of its own sign: discretized
    derivatives make it large. The equations of the tangent are those of a change of x, with errors in proportion.
    """
    system, x, tangent = trial.system, trial.x, trial.tangent
    size, own = (float(np.linalg.norm(vector[: system.state_size])) for vector in (x, tangent))
    if not size:
        return 0.0
    residual, factors = system.linearize(x, (system.weights * tangent,))

    def change(random: np.random.Generator) -> float:
        error = system.residual(draws.rounded(random, x)) - residual
        return float(factors.solve(np.append(error * draws.signs(random, error), 0.0))[system.parameter_index(fold.name)])

    return float(UNITS * draws.spread("significance", change) * own / size)


def growing(system: Discretization, x: Array, tangent: Array, primary: str, newton: Newton) -> Array:
    """Return the unit tangent at x along which the primary parameter grows, or the one `oriented` where it stands still.

    It stands still at x if its rates on both sides of x have opposite signs, as at a fold: the rate at x is round-off then. A
    small rate with one sign on both sides belongs to a parameter of another size.
    """
    at = system.parameter_index(primary)
    if abs(tangent[at]) >= CLEAR:
        return tangent * np.sign(tangent[at])
    row = system.weights * tangent
    try:
        places = [correct(system, x + s * tangent, row, row @ x + s, newton).x for s in (-BESIDE, BESIDE)]
    except ConvergenceError:
        return np.asarray(oriented(tangent))
    before, behind = (linearization(system, place, row).tangent[at] for place in places)
    return np.asarray(tangent * np.sign(before) if before * behind > 0 else oriented(tangent))


def on_finer_mesh(trial: Trial, newton: Newton) -> Trial | None:
    """Return a trial corrected on the mesh halved; None where it is not found there."""
    finer: Any = trial.system.refined()
    system, carry = finer
    x, row = carry(trial.x), system.weights * carry(trial.tangent)
    try:
        return trial_of(system, correct(system, x, row, row @ x, newton, within=np.inf), row)
    except ConvergenceError:
        return None


def senses(arc: Arc, fold: Event) -> tuple[float, float]:
    """Return the sense at both ends of a step.

    Beside a branch point or Hopf point tangents are blurred: there the parameter itself must have gone the same way.
    """
    state, before = arc.state, arc.before
    first, last = sense(before, fold, arc.newton), sense(arc.trial, fold, arc.newton)
    at = before.system.parameter_index(fold.name)
    gone = before.x[at] - state.x[at] if state.singular else 0.0
    return (0.0 if gone * first < -STANDS * (1 + abs(before.x[at])) else first), last


def passed_before(arc: Arc, fold: Event) -> list[SpecialPoint]:
    """Return the fold that a step has behind it, where the parameter goes by more than round-off against its last sense.

    A fold on which the parameter changes by less than round-off over a whole step is not seen in that step: it lies on a
    plateau, on which a rate may seem significant by chance. The errors of such a fold are the length of the plateau, in all
    free parameters.
    """
    state, behind = arc.state, sense(arc.trial, fold, arc.newton)
    at = state.system.parameter_index(fold.name)
    gone = arc.trial.x[at] - state.x[at]
    moved = gone * behind > STANDS * (1 + abs(state.x[at]))
    if not moved or state.sense * behind >= 0 or state.sensed is None:
        return []
    errors = dict(zip(state.system.free, map(float, np.abs(free_values(arc.trial) - state.sensed))))
    return [SpecialPoint(0.0, fold.label, fold.name, arc.before, test=fold, errors=errors)]


def free_values(trial: Trial) -> Array:
    """Return the free parameters of a trial in the user's units."""
    return np.array([trial[name] for name in trial.system.free])


#: The rate right beside a pitchfork's fold is taken at this part of the step from it. Closer, tangents are blurred; further
#: away, another fold would be between.
_ASIDE = 1e-2
#: A rate at one end below this part of what it would be at the other, were the parabola's vertex at this one, is near zero.
_BESIDE = 0.05


@helper
def dips(first: float, last: float, linear: float, square: float) -> bool:
    """Return whether a parabola first + linear z + square z^2 comes near zero between the places z = 0 and 1."""
    return 0 < -linear < 2 * square and first - linear**2 / (4 * square) < DEEPER * min(first, last)


@helper
def ends_low(first: float, last: float, linear: float, square: float) -> bool:
    """Return whether it is near zero at one place already, and lower beside it."""
    inwards = linear if first < last else -linear - 2 * square
    return min(first, last) < _BESIDE * square and inwards < DEEPER * square


def may_turn(arc: Arc, fold: Event) -> bool:
    """Return whether the primary parameter may turn inside a step, by its rates at both ends and their parabola.

    It may, too, where its sense cannot be told at the beginning, or is not that in which it went before. Where it stands still
    at the end, as far as can be told, no fold is seen.
    """
    if not sense(arc.trial, fold, arc.newton):
        return False
    ends = senses(arc, fold)
    if not ends[0] * ends[1] > 0 or arc.state.sense * ends[1] < 0:
        return True
    search = FoldSearch(arc, fold, lambda: None)
    parabola = ends[0] * search._parabola((arc.low, arc.before), (arc.step, arc.trial))
    return dips(*parabola) or ends_low(*parabola)


class FoldSearch:
    """The search for folds inside one step.

    - ``arc`` (Arc)
    - ``fold`` (Event): The tangent's component of the primary parameter, which is its name.
    - ``pitchfork`` (callable): Returns the fold at the branch point inside the step, where the parameter turns right there, or
      None.
    """

    def __init__(self, arc: Arc, fold: Event, pitchfork: Callable[[], SpecialPoint | None]) -> None:
        self.arc, self.fold, self.pitchfork = arc, fold, pitchfork
        self._index = arc.trial.system.parameter_index(fold.name)
        self._outside = APART * arc.step

    def find(self) -> list[SpecialPoint]:
        """Return the folds inside the step, in order.

        The parameter goes one way before a fold and the other way behind it. Where its rate is so small that it may be
        round-off, or the equations so nearly singular that Newton's method stays above its tolerance, and the parameter itself
        does not differ from one fold to the next, or to both ends of the step, there is none. A fold where it does not differ
        from a first point on which branches cross is that point. Rates that may be errors of
        the mesh are compared with those on a finer one.
        """
        arc = self.arc
        left, right = (arc.low, arc.before), (arc.step, arc.trial)
        if not all(senses(arc, self.fold)):
            return passed_before(arc, self.fold)
        found = self.between(left, right)
        while arc.state.singular and found and not self._differs(left[1], found[0].trial):
            del found[0]  # the first point itself: beside it tangents are blurred
        clear = max(abs(left[1].value(self.fold)), abs(right[1].value(self.fold))) >= LOCATED
        if found and not (clear and arc.trial.newton_error <= arc.newton.tolerance):
            self._drop_round_off(found, left, right)
        return found or passed_before(arc, self.fold)

    def _drop_round_off(self, found: list[SpecialPoint], left: Place, right: Place) -> None:
        """Take out of the folds found those between which, or beside which, the parameter does not differ."""
        at = 0
        while at < len(found):
            places = [left[1], *(fold.trial for fold in found), right[1]]
            if at + 1 < len(found) and not self._differs(places[at + 1], places[at + 2]):
                del found[at : at + 2]
            elif not (self._differs(places[at], places[at + 1]) or self._differs(places[at + 1], places[at + 2])):
                del found[at]
            else:
                at += 1

    def _differs(self, one: Trial, other: Trial) -> bool:
        """Return whether the parameter differs between two points by more than round-off."""
        p, q = one.x[self._index], other.x[self._index]
        noise = LAST_PLACES + one.newton_error + other.newton_error
        return bool(abs(p - q) > noise * (1 + abs(p)))

    def between(self, left: Place, right: Place) -> list[SpecialPoint]:
        """Return the places between two where the rate changes its sign, in order."""
        ends = left[1].value(self.fold), right[1].value(self.fold)
        if max(abs(ends[0]), abs(ends[1])) < LOCATED and not self._differs(left[1], right[1]):
            return []
        fork = self.pitchfork()
        if fork is not None and left[0] - self._outside <= fork.at <= right[0] + self._outside:
            return self._around(fork, left, right)
        if sign_changed(*ends):
            return [self.arc.locate(self.fold, left, right, self.estimate(left, right))]
        dip = self._dip(left, right)
        return [] if dip is None else self.between(left, dip) + self.between(dip, right)

    def _around(self, fork: SpecialPoint, left: Place, right: Place) -> list[SpecialPoint]:
        """Return the fold of a pitchfork between two places, and the folds before and behind it.

        The rate is odd around it: where another fold is close, its mirror image is, too, and the rate at the two places has
        the signs that it would have without both.
        """
        aside = _ASIDE * self.arc.step
        sides = [s for s in (fork.at - aside, fork.at + aside) if left[0] < s < right[0]]
        try:
            near = [(s, self.arc.at(s)) for s in sides]
        except ConvergenceError:  # right beside the fork the equations are too nearly singular: the ends decide
            return [fork] if sign_changed(left[1].value(self.fold), right[1].value(self.fold)) else []
        before, behind = (near[0] if fork.at - aside > left[0] else left), (near[-1] if fork.at + aside < right[0] else right)
        found = [fork] if sign_changed(before[1].value(self.fold), behind[1].value(self.fold)) else []
        if before is not left:
            found = self.between(left, before) + found
        if behind is not right:
            found = found + self.between(behind, right)
        return self._turning(found, fork, left, right)

    def _turning(self, found: list[SpecialPoint], fork: SpecialPoint, left: Place, right: Place) -> list[SpecialPoint]:
        """Return the folds at which the parameter turns: beside the fork tangents are blurred."""
        at = 0
        while at < len(found):
            values = [trial.x[self._index] for trial in (left[1], *(fold.trial for fold in found), right[1])]
            if found[at] is not fork and (values[at + 1] - values[at]) * (values[at + 2] - values[at + 1]) > 0:
                del found[at]
                at = 0
            else:
                at += 1
        return found

    def rate(self, trial: Trial) -> float:
        """Return the rate of the primary parameter along the state's tangent."""
        state = self.arc.state
        return trial.value(self.fold) / inner(state.system, state.tangent, trial.tangent)

    def estimate(self, left: Place, right: Place) -> float | None:
        """Return about where the rate vanishes between two places at which it has opposite signs."""
        first, last, linear, square = self._parabola(left, right)
        root = np.sqrt(max(linear**2 - 4 * square * first, 0.0))
        slope = linear + (root if last > first else -root)
        if slope == 0:
            return None
        zero = -2 * first / slope  # the one where the rate goes from first to last
        return float(left[0] + (right[0] - left[0]) * zero) if 0 < zero < 1 else None

    def _parabola(self, left: Place, right: Place) -> Array:
        """Return the parabola of the rate between two places, as `dips` takes it."""
        (a, start), (b, end) = left, right
        first, last = self.rate(start), self.rate(end)
        mean = (end.x[self._index] - start.x[self._index]) / (b - a)
        return np.array([first, last, 6 * mean - 4 * first - 2 * last, 3 * first + 3 * last - 6 * mean])

    def _dip(self, left: Place, right: Place) -> Place | None:
        """Return a place between two of equal rates where the rate has the other sign by more than round-off, or None.

        Where the parameter stands still and goes on, as at a hysteresis point, signs are round-off.
        """
        parabola, (a, b) = self._parabola(left, right), (left[0], right[0])
        sign = math.copysign(1.0, parabola[0] or parabola[1])
        first, last, linear, square = (sign * parabola).tolist()  # positive at both ends
        if not (first or last):
            return None
        if dips(first, last, linear, square):
            at = a - (b - a) * linear / (2 * square)  # the vertex
        elif ends_low(first, last, linear, square):
            at = a if first < last else b
        else:
            return None
        dip, flat = (at, square / (b - a) ** 2), LAST_PLACES * max(abs(first), abs(last))
        found = followed(lambda s: (s, self.arc.at(s)), lambda trial: sign * self.rate(trial), dip, (a, b), flat)
        return found if found is not None and sense(found[1], self.fold, self.arc.newton) else None
