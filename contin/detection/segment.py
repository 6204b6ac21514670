"""What happens inside a step, located to the precision of the corrector; and how well the mesh resolves it."""

from __future__ import annotations

import contextlib
import dataclasses
import functools
import itertools
from collections.abc import Iterable
from dataclasses import dataclass
from typing import Any

import numpy as np

from contin.arrays import Array
from contin.detection.branch_point import MultiplePoint, along, locate_branch_point
from contin.detection.root import find_zero
from contin.discretization.protocol import Discretization, inner
from contin.errors import ConvergenceError
from contin.linalg.factors import Factors
from contin.linalg.singular import smallest_directions
from contin.stepping.settings import Settings
from contin.stepping.state import State, Stop
from contin.stepping.step import Located, located
from contin.stepping.trial import Monitor, Trial, sign_changed

#: A component of the unit tangent below this at both ends of a step is zero: its sign says nothing.
_ROUND_OFF = 1e-9
#: An event of the first step, this close to where it began (as a part of the step), is the first point itself.
_AT_START = 1e-6
#: This close to a branch point tangents are round-off.
_BLURRED = 1e-7
#: A monitor is zero at the first point of a run where it is smaller by this factor than at the next.
_ON_ZERO = 1e-8
#: A change of a parameter below this, relative to 1 + its size, may be round-off.
_STANDS = 1e-11
#: A slope that sinks to this part of its values at the ends may pass zero.
_SHALLOW = 0.5
#: The search for a smallest slope goes on while it lowers it to this part at least.
_DEEPER = 0.5
#: A slope at one end below this part of what it would be at the other, were the parabola's vertex at this one, is near zero.
_BESIDE = 0.05
#: A tangent's component at a branch point below this is zero: tangents there come from differences.
_STATIONARY = 1e-5
#: To which part of a step, and to which part of the corrector's tolerance of it, a zero is looked for.
_PRECISE, _SHARE = 1e-12, 1e-2
#: Into how many parts a step is divided to look inside it, and how often parts with several events are halved.
_PARTS, _CUTS = 4, 20
#: How far outside a step a branch point may be found that changes the determinant's sign inside it (as a part of the step).
_OUTSIDE = 1e-6

#: The first point of a run: system, x, tangent.
Start = tuple[Discretization, Array, Array]
#: Where on a step: the distance along the state's tangent, and the point.
Place = tuple[float, Trial]


@dataclass(frozen=True, eq=False)
class Event:
    """What was located inside a step: at which distance along the tangent, what, the stop that it causes, whose zero it is."""

    at: float
    label: str
    name: str
    trial: Trial
    stop: Stop | None = None
    details: Any = None
    monitor: Monitor | None = None


class Segment:
    """The piece of a branch between a state and the corrected point at the end of a step.

    Parameters
    ----------
    state : State
    before : Trial
        Where monitors start from: the state's point or, where that is a branch point, one close to it.
    low : float
        Place of ``before`` along the state's tangent.
    trial : Trial
        The end, at ``step`` along the state's tangent.
    settings : Settings
    start : tuple (system, x, tangent)
        The first point of the run, to recognise a closed branch.
    fold : Monitor, optional
        What vanishes where the primary parameter, its name, turns round.
    """

    def __init__(
        self,
        state: State,
        before: Trial,
        low: float,
        trial: Trial,
        step: float,
        settings: Settings,
        start: Start,
        fold: Monitor | None = None,
    ) -> None:
        self.state, self.before, self.low, self.trial, self.step = state, before, low, trial, step
        self.settings, self.start = settings, start
        self.fold: Any = fold
        self._last: tuple[float, Located] | None = None
        #: At which part of the step the branch point is expected that lies inside it.
        self.share = 0.5

    def events(self, monitors: Iterable[Monitor]) -> list[Event]:
        """What happens in the step, in order."""
        found, state, trial = [], self.state, self.trial
        home = None if state.singular else self._returned()
        if home is not None:
            found.append(home)
        elif self.settings.branch_points and sign_changed(self.before.sign, trial.sign):
            found.append(self.crossing())
        elif trial.passed > 1:
            found.append(self._multiple_point())
        for monitor in monitors:
            found += self._zeros(monitor)
        found += [event for event in self.turns if not _same_place(event, found, self.step)]
        found = [event for event in found if not self._at_the_start(event)]
        closed = self._closed()
        if closed is not None:
            found.append(closed)
        return sorted(found, key=lambda event: event.at)

    def _at_the_start(self, event: Event) -> bool:
        """Whether an event is the first point of the run once more."""
        near = max(_AT_START * self.step, _BLURRED if self.state.singular else 0.0)
        return self.state.accepted == 0 and event.stop is None and event.at < near

    def _at(self, at: float) -> Trial:
        """The point of the curve at this place along the state's tangent, with its exact tangent and factors."""
        if self._last is not None and self._last[0] == at:
            return self._last[1]
        guess, factors = self._between(at), self.trial.factors
        if self._last is not None:  # off the cubic by about as much as the last one was
            place, last = self._last
            guess = guess + last.x - self._between(place)
            factors = last.factors if last.sharp else factors
        there = located(self.state, guess, at, self.settings.newton, factors)
        self._last = at, there
        return there

    def _between(self, at: float) -> Array:
        """A guess on the curve by the cubic through both ends and their tangents."""
        state, trial, step = self.state, self.trial, self.step
        s = at / step
        ahead = trial.x - state.x
        rate = step / max(inner(state.system, state.tangent, trial.tangent), 0.1)
        a, b = state.tangent * step, trial.tangent * rate
        return state.x + s * a + s**2 * (3 * ahead - 2 * a - b) + s**3 * (a + b - 2 * ahead)

    @functools.cached_property
    def turns(self) -> list[Event]:
        """Places inside the step where the primary parameter turns round, in order."""
        return [] if self.fold is None else self._turns_between((self.low, self.before), (self.step, self.trial))

    def _turns_between(self, left: Place, right: Place) -> list[Event]:
        """Turns between two places (s, trial): where the tangent's component changes sign, once or, in a dip, twice."""
        ends = [trial.value(self.fold) for _, trial in (left, right)]
        if max(map(abs, ends)) < _ROUND_OFF:
            return []
        if sign_changed(*ends):
            return [self._turn_at_crossing() or self._locate(self.fold, left, right)]
        dip = self._dip(left, right)
        return [] if dip is None else self._turns_between(left, dip) + self._turns_between(dip, right)

    def _turn_at_crossing(self) -> Event | None:
        """The turn of a pitchfork, right at the branch point inside the step; None if there is none or it turns elsewhere."""
        if not (self.settings.branch_points and sign_changed(self.before.sign, self.trial.sign)):
            return None
        found = self.crossing()
        if found.name == "possible" or not found.details.tangents:
            return None
        component = found.details.tangents[0][self.trial.system.parameter_index(self.fold.name)]
        return dataclasses.replace(found, label=self.fold.label, monitor=self.fold) if abs(component) < _STATIONARY else None

    def _slope(self, trial: Trial) -> float:
        """Rate of the primary parameter along the state's tangent."""
        return trial.value(self.fold) / inner(self.state.system, self.state.tangent, trial.tangent)

    def _dip(self, left: Place, right: Place) -> Place | None:
        """A place (s, trial) between two of equal slopes where the slope has the other sign; None if there is none.

        The smallest slope is looked for, where there is reason to, by parabolas through three places so close together that the
        slope doubles from one to the next if it is smallest in the first: closer and closer as it sinks.
        """
        sense = float(np.sign(self._slope(left[1])) or np.sign(self._slope(right[1])))
        place, square = self._suspect(left, right, sense)
        lowest = np.inf
        while place is not None:
            there = place[1]
            value = sense * self._slope(there)
            if value <= 0:
                return place
            if value > _DEEPER * lowest:
                return None
            lowest, apart = value, np.sqrt(value / square)
            if place[0] + 2 * apart >= right[0]:
                apart = -apart
            if place[0] + 2 * apart < left[0]:
                return None
            near = [(s, self._at(s)) for s in (place[0] + apart, place[0] + 2 * apart)]
            values = [sense * self._slope(trial) for _, trial in near]
            if min(values) <= 0:
                return near[int(np.argmin(values))]
            bend = values[1] - 2 * values[0] + value
            if not bend > 0:
                return None
            s = place[0] + apart * (0.5 - (values[0] - value) / bend)
            place = (s, self._at(s)) if left[0] < s < right[0] else None
        return None

    def _parabola(self, left: Place, right: Place) -> tuple[float, float, float, float]:
        """The slope between two places: its values there, and c, d of the parabola first + c z + d z^2, z from 0 to 1.

        The mean of the parabola is the mean slope, known from the parameter itself.
        """
        (a, start), (b, end) = left, right
        first, last = self._slope(start), self._slope(end)
        at = self.trial.system.parameter_index(self.fold.name)
        mean = (end.x[at] - start.x[at]) / (b - a)
        return first, last, 6 * mean - 4 * first - 2 * last, 3 * first + 3 * last - 6 * mean

    def _turn(self, left: Place, right: Place) -> float | None:
        """About where the slope vanishes between two places, at which it has opposite signs."""
        first, last, linear, square = self._parabola(left, right)
        root = np.sqrt(max(linear**2 - 4 * square * first, 0.0))
        lower = -2 * first / (linear + (root if last > first else -root))  # the zero where the slope grows from first to last
        return float(left[0] + (right[0] - left[0]) * lower) if 0 < lower < 1 else None

    def _suspect(self, left: Place, right: Place, sense: float) -> tuple[Place | None, float]:
        """A place (s, trial) between two where the slope could come near zero, or None, and half its second derivative.

        Slopes at both ends and the mean slope between them, from the parameter itself, make a parabola: its vertex. Where that
        lies outside, but the slope at one end is close to zero already: that end.
        """
        a, width = left[0], right[0] - left[0]
        first, last, linear, square = (sense * value for value in self._parabola(left, right))
        smaller = min(first, last)
        if 0 < -linear < 2 * square and first - linear**2 / (4 * square) < _SHALLOW * smaller:
            s = a - width * linear / (2 * square)
            return (s, self._at(s)), square / width**2
        inwards = linear if first < last else -linear - 2 * square
        beside = smaller < _BESIDE * square and inwards < _SHALLOW * square
        return (left if first < last else right) if beside else None, square / width**2

    def steady(self) -> bool:
        """Whether the primary parameter goes, between its turns, the way that the tangents say; if not, the branch was left."""
        if self.fold is None:
            return True
        knots = [self.before, *(turn.trial for turn in self.turns), self.trial]
        at = self.trial.system.parameter_index(self.fold.name)
        sense = np.sign(self.before.value(self.fold))
        for left, right in itertools.pairwise(knots):
            if sense * (right.x[at] - left.x[at]) < -_STANDS * (1 + abs(right.x[at])):
                return False
            sense = -sense
        return True

    def _zeros(self, monitor: Monitor) -> list[Event]:
        """Zeros of a monitor inside the step, looked for between the places where the primary parameter turns."""
        state, found = self.state, []
        for left, right in itertools.pairwise(self._knots(monitor)):
            before, after = left[1].value(monitor), right[1].value(monitor)
            if state.accepted == 0 and left[0] == 0 and abs(before) < _ON_ZERO * abs(after):
                before = 0.0  # the first point lies on the zero
            if not monitor.passed(before, after):
                continue
            event = self._locate(monitor, left, right)
            if monitor.confirm is None or monitor.confirm(event.trial):
                found.append(event)
            if monitor.terminal:
                break
        return found

    def _knots(self, monitor: Monitor) -> list[Place]:
        """The places (s, trial) between which a monitor has one zero at most, as far as can be told."""
        state = self.state
        first = Trial(state.system, state.x, state.tangent, state.sign) if state.singular else self.before
        knots = [(0.0, first), *((event.at, event.trial) for event in self.turns), (self.step, self.trial)]
        if monitor.several is None:
            return knots
        inside = [self.step * part / _PARTS for part in range(1, _PARTS)]
        values = [first.value(monitor), *(monitor.function(self._guess(s)) for s in inside), self.trial.value(monitor)]
        if np.count_nonzero(np.diff(np.sign(values))) > 1:
            knots = sorted([*knots, *((s, self._near(s)) for s in inside)], key=lambda knot: knot[0])
        for _ in range(_CUTS):
            crowded = [pair for pair in itertools.pairwise(knots) if monitor.several(pair[0][1], pair[1][1])]
            if not crowded:
                break
            middles = [(left[0] + right[0]) / 2 for left, right in crowded]
            knots = sorted([*knots, *((s, self._near(s)) for s in middles)], key=lambda knot: knot[0])
        return knots

    def _guess(self, at: float) -> Trial:
        return Trial(self.state.system, self._between(at), self.state.tangent, np.nan)

    def _near(self, at: float) -> Trial:
        """The point of the curve at a place or, where Newton fails (close to a singular one), the guess."""
        try:
            return self._at(at)
        except ConvergenceError:
            return self._guess(at)

    def _locate(self, monitor: Monitor, left: Place, right: Place) -> Event:
        """The zero of a monitor between two places (s, trial); where location fails, the further one, named "possible"."""
        (a, first), (b, last) = left, right
        ends, name = (first.value(monitor), last.value(monitor)), monitor.name
        try:
            if ends[0] * ends[1] > 0 or ends[0] == 0:  # a limit that the run starts on
                at, there = a, first
            else:
                precise = max(_PRECISE, _SHARE * self.settings.newton.tolerance) * self.step
                guess = self._turn(left, right) if monitor is self.fold else None
                at = find_zero(lambda s: monitor.function(self._at(s)), a, ends[0], b, ends[1], precise, guess)
                there = self._at(at)
        except ConvergenceError:
            at, there, name = b, last, f"possible {monitor.name}"
        stop = None
        if monitor.terminal:
            stop = Stop("limit", f"reached {monitor.name}") if monitor.limit else Stop("event", f"met {monitor.name}")
        details = None if monitor.describe is None else monitor.describe(there)
        return Event(at, monitor.label, name, there, stop, details, monitor)

    def crossing(self) -> Event:
        """The branch point inside the step, located once."""
        if self.trial.crossing is None:
            self.trial.crossing = self._branch_point()
        crossing: Event = self.trial.crossing
        return crossing

    def _branch_point(self) -> Event:
        """The branch point inside a step, its bracket halved until the locator's answer lies inside it."""
        state, trial, step = self.state, self.trial, self.step
        low, high = self.low, step
        middle = low + self.share * (high - low)
        for _ in range(12):
            try:
                found = locate_branch_point(state.system, self._between(middle), self.settings.newton)
                at = inner(state.system, state.tangent, found.x - state.x)
                gap = found.x - self._between(at)
                off = np.sqrt(inner(state.system, gap, gap))
                found = along(state.system, found, trial.x - state.x)
                if self.low - _OUTSIDE * step <= at <= step * (1 + _OUTSIDE) and off < 0.1 * step:
                    there = Trial(state.system, found.x, np.full_like(found.x, np.nan), np.nan)
                    return Event(at, "BP", "", there, details=found)
            except ConvergenceError:
                pass
            try:
                sign = self._at(middle).sign
            except ConvergenceError:
                break
            low, high = (middle, high) if sign == self.before.sign else (low, middle)
            middle = (low + high) / 2
        return Event(high, "BP", "possible", trial)

    def _multiple_point(self) -> Event:
        """Where two or more singular values pass zero together: the zero of their mean, with the kernel."""
        state, trial, step = self.state, self.trial, self.step
        system = state.system
        right, left, _ = smallest_directions(trial.factors, system.size)

        def mean(factors: Factors) -> float:
            response = right @ factors.solve(left).T
            values = np.linalg.eigvals(np.linalg.inv(response))
            return float(np.sort_complex(values[np.argsort(np.abs(values))[:2]]).real.mean())

        at, there = step, trial
        with contextlib.suppress(ConvergenceError, np.linalg.LinAlgError):
            ends = mean(self.before.factors), mean(trial.factors)
            if sign_changed(*ends):

                def inside(s: float) -> float:
                    return mean(self._at(s).factors)

                at = find_zero(inside, self.low, ends[0], step, ends[1], 1e-9 * step)
                there = self._at(at)
        right, _, response = smallest_directions(there.factors, system.size)
        u, values, _ = np.linalg.svd(response)
        dimension = max(2, int(np.count_nonzero(values > 1e-3 * values[0])))
        kernel = u[:, :dimension].T @ right
        return Event(at, "BP", f"kernel of dimension {dimension}", there, details=MultiplePoint(dimension, kernel))

    def _returned(self) -> Event | None:
        """The end of a branch on the trivial one, where ``settings.trivial`` passes zero."""
        before, trial = self.before, self.trial
        name = self.settings.trivial
        if name is None or not sign_changed(before[name], trial[name]):
            return None
        stop = Stop("trivial branch", f"returned to the trivial branch ({name} = 0)")
        event = self.crossing()
        if abs(event.trial[name]) > 1e-6 * max(abs(before[name]), abs(trial[name])):
            monitor = Monitor("EP", "trivial branch", lambda there: there[name], terminal=True)
            event = self._locate(monitor, (0.0, before), (self.step, trial))
        return dataclasses.replace(event, label="EP", name="trivial branch", stop=stop)

    def _closed(self) -> Event | None:
        """The end of a branch that comes back to its first point."""
        state, trial, step = self.state, self.trial, self.step
        home, x, tangent = self.start
        if state.accepted < 3:
            return None
        p, q = x[home.state_size :], trial.x[state.system.state_size :]
        if np.max(np.abs(p - q)) > 2 * step:
            return None
        if home is not state.system:
            carry = home.carrier(state.system)
            x, tangent = carry(x), carry(tangent)
        gaps = [end - x for end in (state.x, trial.x)]
        passed = [inner(state.system, gap, tangent) for gap in gaps]
        if not passed[0] < 0 <= passed[1] or inner(state.system, trial.tangent, tangent) < 0.5:
            return None
        at = step * passed[0] / (passed[0] - passed[1])
        off = self._between(at) - x
        if np.sqrt(inner(state.system, off, off)) > 0.1 * step:
            return None
        there = Trial(state.system, x, tangent, trial.sign, trial.iterations, trial.newton_error)
        return Event(at, "EP", "closed", there, Stop("closed", "the branch closed on its first point"))


def _same_place(event: Event, found: list[Event], step: float) -> bool:
    """Whether a fold is no event of its own: the parameter also turns where branches cross, and at a cusp of folds.

    Close to a crossing the tangent is the less certain the closer, so "at" means within a small part of the step.
    """
    others = [other for other in found if other.label in ("BP", "CP") or other.name == "trivial branch"]
    if event.label != "LP" or not others:
        return False
    lost = event.name.startswith("possible")  # the equations are singular at the crossing: nothing else was found
    return lost or any(np.max(np.abs(event.trial.x - other.trial.x)) < 1e-4 + 2e-3 * step for other in others)
