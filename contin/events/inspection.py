"""The special points inside a step, and where a branch ends by itself.

A branch ends on the trivial one where the quantity that vanishes there (``settings.trivial``) crosses zero with a slope: at
both ends of the step it is well above its round-off, and its signs differ. Where it falls from well above its round-off to next
to nothing Newton's method has left for the trivial branch: the step is refused. Where it is round-off at the beginning already
(it can decay along a branch that runs on, beside a homoclinic orbit), its sign says nothing.

In order: the end on the trivial branch, or a branch point, or several; zeros of the test functions, looked for between the
folds; the folds; the end of a closed branch. What was located is sorted by its distance along the step.
"""

from __future__ import annotations

import dataclasses
import functools
import itertools
import math
from collections.abc import Callable, Sequence
from typing import Any, NamedTuple

import numpy as np

from contin.arrays import Array
from contin.core.labels import SINGULAR, Label
from contin.core.newton import Newton
from contin.core.protocol import Discretization, inner
from contin.core.settings import Settings
from contin.core.step import Reason, Stop
from contin.core.trial import Event, Linearization, Trial, sign_changed
from contin.events.arc import Arc, Place, SpecialPoint, stop_of
from contin.events.branch_points import BranchPointSearch
from contin.events.dips import separated
from contin.events.folds import FoldSearch
from contin.events.labelled import finding_of
from contin.kernels.kernel_parts import helper
from contin.levels import APART, BESIDE, CERTAIN, CORRECTED, DEPENDENT, DOUBLED, ROUGH, ROUND_OFF

#: A value this many times its round-off that falls by this factor in one step has jumped, or the step ends right at a zero, or
#: a decay is fast: all are then taken in shorter steps. At 10 a decay beside a homoclinic orbit would be cut into many steps,
#: at 1e6 a jump from a branch of small amplitude would pass.
_CLEAR = 1e3


def round_off(trial: Trial, name: str, newton: Newton) -> float:
    """Return about how large the quantity can be by errors of the corrector alone."""
    relative = CERTAIN * max(newton.tolerance, trial.newton_error, ROUND_OFF)
    system = trial.system
    if name in system.free:
        at = system.parameter_index(name)
        return float(relative * (1 + abs(trial.x[at])) * system.free_scales[at - system.state_size])
    signs = np.where(np.arange(system.size) % 2, 1.0, -1.0)  # of the errors: not all alike, which a difference would hide
    moved = Trial.without_tangent(system, trial.x + relative * signs * (1 + np.abs(trial.x)))
    return abs(moved[name] - trial[name])


def jumped(before: Trial, trial: Trial, name: str, newton: Newton) -> bool:
    """Return whether the quantity, well above its round-off at one end of a step, is next to nothing at the other."""
    value, after = abs(before[name]), abs(trial[name])
    return after * _CLEAR < value and value > _CLEAR * round_off(trial, name, newton)


def crossed(before: Trial, trial: Trial, name: str, newton: Newton) -> bool:
    """Return whether the quantity changes its sign from one end of a step to the other, well above its round-off at both."""
    if not sign_changed(before[name], trial[name]):
        return False
    return min(abs(before[name]), abs(trial[name])) > round_off(trial, name, newton)


#: Special points closer than this are at one place: those that coincide exactly are located 1e-15 to 1e-9 apart. Ten times
#: larger, points that are distinct in the digits shown could change places.
_AT_ONCE = 1e-8
#: What may help where a step stays unexplained.
_ADVICE = "a smaller max_step or accuracy, or more intervals may help"
#: A branch can close on its first point after this many regular points.
FEWEST = 3
#: A closing branch comes back to its first point along its tangent there: with this cosine at least.
_SAME_WAY = 0.5
#: A first point inside a step is not further than so many steps from its end, nor from both ends together.
REACH = 2
#: A fold within this part of the step, and `BESIDE`, of a point where branches cross is that point ...
_SAME_SHARE = 2e-3
#: ... unless the parameter goes from the one to the other by what the tangent at the crossing says, up to this factor.
_EXPLAINED = 2.0

#: The first point of a run: system, x, tangent.
Start = tuple[Discretization, Array, Array]


class Sought(NamedTuple):
    """What a run looks for.

    - ``settings`` (Settings): Those that it begins with.
    - ``start`` (tuple (system, x, tangent)): Its first point, to recognise a closed branch.
    - ``tests`` (sequence of Event)
    - ``fold`` (Event or None): The tangent's component of the primary parameter; None where folds are not looked for.
    - ``ends`` (sequence of callables): ``end(inspection)``: the end of the branch inside a step that it knows of, or None.
    """

    settings: Settings
    start: Start
    tests: Sequence[Event]
    fold: Event | None
    ends: Sequence[Callable[[Inspection], SpecialPoint | None]]


class Inspection:
    """The inspection of one step; what is looked for is found once. A ``plain`` one passes no branch point or first point."""

    def __init__(self, arc: Arc, sought: Sought, plain: bool = False) -> None:
        self.arc, self.sought, self.plain = arc, sought, plain
        self.branch_points = BranchPointSearch(arc)
        if plain:
            self.branch_points.count, self._returned = (0, True), None

    # --- special points ------------------------------------------------------------------------------------------

    @functools.cached_property
    def special_points(self) -> list[SpecialPoint]:
        """The special points inside the step, in order.

        Raises ConvergenceError where a point inside the step that is needed to tell is not found.
        """
        found: list[SpecialPoint] = []
        if self.home is not None:
            found.append(self.home)
        elif self.sought.settings.branch_points and self.branch_points.count[0] > 1:
            found.append(self.branch_points.multiple)
        elif self.sought.settings.branch_points and self.branch_points.sign_changes:
            found.append(self.branch_points.simple)
        crossings = [point for point in found if point.is_located]
        for test in self.sought.tests:
            found += self._zeros(test, crossings)
        found += [fold for fold in self.folds if not self._same_place(fold, found)]
        found = [point for point in found if not self._at_the_start(point)]
        closed = self._closed()
        if closed is not None:
            found.insert(0, closed)  # the first point once more, which was labelled already
        if len(found) < 2:
            return found
        order = sorted(found, key=lambda point: point.at)
        group = np.cumsum(np.diff([point.at for point in order], prepend=-np.inf) >= _AT_ONCE)
        place = {id(point): number for point, number in zip(order, group)}
        # at one place points without a test function and folds come first; others stay as they were found
        return sorted(found, key=lambda point: (place[id(point)], point.test is not None and point.test.label != Label.FOLD))

    def _at_the_start(self, point: SpecialPoint) -> bool:
        """Return whether a special point is the first point of the run once more."""
        state = self.arc.state
        near = max(APART * self.arc.step, DOUBLED if state.singular else 0.0)
        return state.accepted == 0 and point.stop is None and point.at < near

    # --- folds ---------------------------------------------------------------------------------------------------

    @functools.cached_property
    def folds(self) -> list[SpecialPoint]:
        """Places where the primary parameter turns, in order, be it where branches cross."""
        return [] if self.sought.fold is None else FoldSearch(self.arc, self.sought.fold, self._pitchfork).find()

    def _pitchfork(self) -> SpecialPoint | None:
        """Return the fold of a pitchfork, right at the branch point inside the step; None if there is none."""
        fold: Any = self.sought.fold
        if self.home is not None:
            found = dataclasses.replace(self.home, stop=None)
        elif self.sought.settings.branch_points and self.branch_points.sign_changes:
            found = self.branch_points.simple
        else:
            return None
        tangents = finding_of(found.details).leaving
        if not tangents:
            return None
        component = tangents[0][self.arc.trial.system.parameter_index(fold.name)]
        stationary = abs(component) < DOUBLED
        return dataclasses.replace(found, label=fold.label, name=fold.name, test=fold) if stationary else None

    # --- zeros of test functions ---------------------------------------------------------------------------------

    def _zeros(self, test: Event, crossings: list[SpecialPoint]) -> list[SpecialPoint]:
        """Return the zeros of a test function, looked for between the folds. At a fold or branch point they lie right there."""
        if test.asks is not None and not test.asks(self.arc):
            return []
        if test.search is not None:
            points: list[SpecialPoint] | None = test.search(self.arc, self._knots)
            if points is not None:
                return points
        ends = self._knots[0][1].value(test), self.arc.trial.value(test)
        if not (self.folds or crossings or test.looks or test.passed(*ends)):
            return []
        state = self.arc.state
        largest = max(abs(self.arc.before.value(test)), abs(ends[1]))
        known = [point for point in (*self.folds, *crossings) if point.is_located and not self._at_the_start(point)]
        same = [point for point in known if abs(point.trial.value(test)) <= DEPENDENT * largest]
        found = [self._at_special(test, point) for point in same if test.confirm is None or test.confirm(point.trial)]
        for left, right in self._pieces(test, same):
            before, after = left[1].value(test), right[1].value(test)
            if state.accepted == 0 and left[0] == 0 and abs(before) < DOUBLED * abs(after):
                before = 0.0  # the first point lies on the zero
            if not test.passed(before, after):
                continue
            point = self.arc.locate(test, left, right)
            if not point.is_located:  # beside a branch point at which it vanishes up to the discretization
                near = (special for special in crossings if abs(special.trial.value(test)) <= APART * largest)
                point = next((self._at_special(test, special) for special in near), point)
            again = any(abs(point.at - other.at) < ROUGH * self.arc.step for other in same)
            if not again and (test.confirm is None or test.confirm(point.trial)):
                found.append(point)
            if test.terminal:
                break
        return found

    def _at_special(self, test: Event, point: SpecialPoint) -> SpecialPoint:
        """Return the zero of a test function that lies at a special point."""
        details = None if test.describe is None else test.describe(point.trial)
        return SpecialPoint(point.at, test.label, test.name, point.trial, stop_of(test), details, test, same_as=point)

    def _pieces(self, test: Event, same: list[SpecialPoint]) -> list[tuple[Place, Place]]:
        """Return the pieces of the step between the folds, without what is right beside some special points."""
        arc, aside = self.arc, BESIDE * self.arc.step
        parts = [part / (test.looks + 1) for part in range(1, test.looks + 1)]
        between = separated(arc, test, self._knots, parts, dips=False) if test.looks else self._knots
        if not same:
            return list(itertools.pairwise(between))
        knots, cut = [], [point.at for point in same]
        for place in between:
            if not any(abs(place[0] - at) <= aside for at in cut) or place[0] in (0.0, arc.step):
                knots.append(place)
        beside = [s for at in cut for s in (at - aside, at + aside) if 0 < s < arc.step]
        knots = sorted([*knots, *((s, arc.near(s)) for s in beside)], key=lambda place: place[0])
        pairs = itertools.pairwise(knots)
        return [(left, right) for left, right in pairs if not any(left[0] < at < right[0] for at in cut)]

    @functools.cached_property
    def _knots(self) -> list[Place]:
        """Return places, each behind the one before, between which a test function has one zero at most, if all is seen."""
        arc = self.arc
        folds = [(fold.at, fold.trial) for fold in self.folds if 0 < fold.at < arc.step]
        return [(0.0, arc.beginning()), *folds, (arc.step, arc.trial)]

    # --- ends ----------------------------------------------------------------------------------------------------

    @functools.cached_property
    def home(self) -> SpecialPoint | None:
        """The end of the branch inside the step."""
        return next((end for known in self.sought.ends if (end := known(self)) is not None), None)

    def trivial_end(self) -> SpecialPoint | None:
        """The end of a branch on the trivial one, where ``settings.trivial`` crosses zero; not located without a zero there.

        It is the branch point inside the step if the quantity is zero there, else the quantity's zero. Either must lie on the
        cubic through both ends of the step: elsewhere it belongs to another branch.
        """
        arc, name = self.arc, self.sought.settings.trivial
        before, trial = arc.before, arc.trial
        if name is None or not crossed(before, trial, name, arc.newton):
            return None
        stop = Stop(Reason.TRIVIAL_BRANCH, f"returned to the trivial branch ({name} = 0)")
        if not self.sought.settings.branch_points or self.branch_points.sign_changes:
            point = self.branch_points.simple
            if self._is_home(point):
                return dataclasses.replace(point, label=Label.END, name="trivial branch", stop=stop)
        test = Event(Label.END, "trivial branch", lambda there: there[name], terminal=True)
        point = arc.locate(test, (arc.low, before), (arc.step, trial))
        if self._is_home(point):
            return dataclasses.replace(point, stop=stop)
        stop = Stop(Reason.NO_CONVERGENCE, f"{name} changed its sign, but no zero of it was found on the branch", _ADVICE)
        return SpecialPoint(arc.step, Label.FAILED, "trivial branch", trial, stop, is_located=False)

    def _is_home(self, point: SpecialPoint) -> bool:
        """Return whether the trivial quantity vanishes at a point on the branch."""
        arc, name = self.arc, self.sought.settings.trivial
        assert name is not None
        zero = max(APART * max(abs(arc.before[name]), abs(arc.trial[name])), round_off(point.trial, name, arc.newton))
        if not point.is_located or abs(point.trial[name]) > zero:
            return False
        return arc.passes_by(point.trial.x, point.at)

    def may_close(self) -> bool:
        """Return whether the first point of the run may lie in this step."""
        return self.arc.state.accepted >= FEWEST and self._returned is not None

    @functools.cached_property
    def _returned(self) -> Returned | None:
        arc = self.arc
        return returned(self.sought.start, arc.beginning(), arc.trial, arc.step)

    def _closed(self) -> SpecialPoint | None:
        """Return the end of a branch that comes back to its first point."""
        if not self.may_close() or self._returned is None:
            return None
        arc, (at, x, tangent, first) = self.arc, self._returned
        system, trial = arc.state.system, arc.trial
        if not arc.passes_by(first, at):
            return None
        there = Trial(system, x, Linearization(tangent, trial.sign), trial.iterations, trial.newton_error)
        return SpecialPoint(at, Label.END, "closed", there, Stop(Reason.CLOSED, "the branch closed on its first point"))

    def _same_place(self, fold: SpecialPoint, found: list[SpecialPoint]) -> bool:
        """Return whether a fold is no special point of its own: the parameter also turns where branches cross, and at a cusp.

        Close to a crossing the tangent is the less certain the closer, so "at" means within a small part of the step.
        """
        others = [other for other in found if other.label in SINGULAR or other is self.home or other.turns_back]
        if not others:
            return False
        if not fold.is_located:  # the equations are singular at the crossing: nothing else was found
            return True
        near = BESIDE + _SAME_SHARE * self.arc.step
        close = [other for other in others if np.max(np.abs(fold.trial.x - other.trial.x)) < near]
        return any(not self._is_beside(fold, other) for other in close)

    def _is_beside(self, fold: SpecialPoint, crossing: SpecialPoint) -> bool:
        """Return whether a fold near a branch point is another point, as the parameter does not turn at that.

        With the rate c there, and the fold at a distance d, it differs by c d / 2.
        """
        known = finding_of(crossing.details)
        if not known.is_simple_branch_point or not known.leaving:
            return False
        at = self.arc.trial.system.parameter_index(fold.name)
        rate, p = known.leaving[0][at], crossing.trial.x[at]
        change, expected = fold.trial.x[at] - p, rate * (fold.at - crossing.at) / 2
        if abs(rate) < DOUBLED or abs(change) < CORRECTED * (1 + abs(p)):
            return False
        return bool(1 / _EXPLAINED < change / expected < _EXPLAINED)


class Returned(NamedTuple):
    """A place in a step that the first point of a run is behind: x and tangent there, and x in phase with the step's end."""

    at: float
    x: Array
    tangent: Array
    first: Array


def returned(start: Start, before: Trial, trial: Trial, step: float) -> Returned | None:
    """Return where a step passes the first point of a run, which it may leave aside; None where it certainly does not."""
    if _is_elsewhere(start, before, trial, step) or not np.array_equal(start[0].sides, trial.system.sides):
        return None
    system, (home, x, tangent) = trial.system, start
    if home is not system:
        carry = home.carrier(system)
        x, tangent = carry(x), carry(tangent)
        if home.scales is not system.scales:
            tangent = tangent / np.sqrt(inner(system, tangent, tangent))
    x = system.lifted(x, trial.x)
    first, (leaving,) = system.in_phase(x, (tangent,), trial.x)
    a, b = (inner(system, end.x - first, leaving) for end in (before, trial))
    chord = trial.x - before.x  # at a sharp turn the tangents at both ends say nothing of the one between them
    if not a < 0 <= b or b - a < _SAME_WAY * np.sqrt(inner(system, chord, chord)):
        return None
    return Returned(step * a / (a - b), x, tangent, first)


def _is_elsewhere(start: Start, before: Trial, trial: Trial, step: float) -> bool:
    """Return whether the first point of a run is certainly not in a step: a parameter or the distance is too far from it.

    Without this each step would carry the first point to its mesh and bring it in phase.
    """
    system, (home, x, _) = trial.system, start
    first, size = free_of(home, x, system).tolist(), system.state_size
    ends = [end.x[size:].tolist() for end in (before, trial)]
    rates = [end.tangent[size:].tolist() for end in (before, trial)]
    if any(misses(value, a, t, b, u, step) for value, a, t, b, u in zip(first, ends[0], rates[0], ends[1], rates[1])):
        return True
    lengths = np.sqrt(system.weights[size:])
    if sum(math.hypot(*(lengths * np.subtract(first, end))) for end in ends) > REACH * step:
        return True  # the free parameters are
    if home.scales is not system.scales:
        return False
    kept = home.lasting(x)
    return sum(math.dist(kept, system.lasting(end.x)) for end in (before, trial)) > REACH * step


def free_of(home: Discretization, x: Array, system: Discretization) -> Array:
    """Return the unknowns of one system that are no states, in the units of another."""
    found: Array = x[home.state_size :].copy()
    found[: len(home.free)] *= home.free_scales / system.free_scales
    return found


@helper
def misses(value: float, first: float, rate: float, last: float, last_rate: float, step: float) -> bool:
    """Return whether a parameter certainly does not take a value in a step, by its values and rates at both ends."""
    margin = step * max(abs(rate), abs(last_rate)) + APART * (1 + abs(value))
    return value < min(first, last) - margin or value > max(first, last) + margin
