"""Pseudo-arclength continuation: a run is an iterable of points over an explicit state.

    run = Continuation(system, x, settings)
    for point in run:
        ...
    print(run.stop)

One step is: adapt the mesh if due; predict; correct; halve the step until the corrected point can be believed; locate the
special points between the two ends; accept. The loop knows of a system only its protocol (`contin.discretization.protocol`),
not its kind.
"""

from __future__ import annotations

import dataclasses
import itertools
import math
from collections.abc import Callable, Iterator, Sequence
from typing import NamedTuple

import numpy as np

from contin import checks, threads
from contin.arrays import Array
from contin.continuation.corners import jump, unsettled, why_lost
from contin.continuation.failure import no_convergence, shorter_steps
from contin.continuation.lane import FEWEST, MOST, Lane, lane_of
from contin.continuation.plain import NOISY
from contin.continuation.scaling import outgrown, renewed, scaled
from contin.detection.accuracy import Accuracy, accuracy_of, at_branch_point
from contin.detection.extrema import extremum
from contin.detection.hopf_end import collapsed
from contin.detection.inspection import Inspection, Start
from contin.detection.phase_loads import phase_loads
from contin.detection.refinement import refined
from contin.detection.second_variation import Stability, contradiction, index_of, nullity_of, stability_of
from contin.detection.segment import Place, Segment, SpecialPoint, with_details
from contin.detection.significance import STANDS, free_values, growing, sense
from contin.detection.test_functions import (
    fold,
    limits,
    own_end,
    own_normal_form,
    own_standstill,
    own_stop,
    own_test_functions,
    user_zeros,
    with_normal_form,
    within_limits,
)
from contin.detection.trivial import crossed, jumped
from contin.detection.watch import watch_list
from contin.discretization.protocol import Carrier, Discretization, inner
from contin.errors import ConvergenceError, ProblemError
from contin.names import exact_text, value_names
from contin.results.branch import Branch
from contin.results.point import Point
from contin.stepping.newton import correct
from contin.stepping.settings import Settings
from contin.stepping.settling import ROUNDS, settled
from contin.stepping.state import State, Stop, standing_at
from contin.stepping.step import (
    ASTRAY,
    Judgement,
    aims,
    corrected,
    following_step,
    is_astray,
    judged,
    located,
    longest_step,
    predict,
    trial_of,
    up_to_limits,
)
from contin.stepping.trial import Linearization, TestFunction, Trial, linearization

#: A step is cut down to this fraction of itself to take several branch points one by one.
_FINEST = 1e-3
#: Beside a branch point, special points are looked for from this fraction of the first step on: closer, tangents are blurred.
#: The next one is taken where the equations are still too nearly singular for Newton's method.
_ASIDE = (0.01, 0.1, 0.5)
#: A start this far outside a limit (relative to 1 + its size) still lies on it: it was located there, to round-off.
_SLACK = 1e-9
#: A curve that begins where a test function that ends runs is zero has it positive this far along its tangent: what is known to
#: 1e-10 is then told from round-off, and no regular start lies so near to an end.
_ENTERS = 1e-6
#: Rounds of correcting and adapting the mesh at the first point; each settles most of what is left.
_ROUNDS = 3
#: A run fails where a test function that ends runs is zero, if it is below this part of its value at the first point: steps as
#: small as min_step come much nearer, and regular points do not come so near.
_NEARLY = 1e-2
#: A run whose primary parameter has stood still for so many steps says so, and is asked whether it should go on.
_STANDING = 6
#: Part of the tolerance that a finer mesh aims at. Ten times larger, the points after it exceed the tolerance again, and more
#: steps are made twice on the bank of reference problems. Ten times smaller takes 18 % more intervals of degree 7.
_MARGIN = 0.1
#: Part of the tolerance below which an error may be round-off: at the usual tolerance it is some 1e-14.
_FAR_BELOW = 0.03
#: Intervals, as a multiple of those that the density asks for, that may make round-off larger: 25 before a Hopf point behind
#: canards. Ten times smaller, meshes before explosions become coarser, where errors of the mesh are taken for round-off.
_FAR_TOO_MANY = 4
#: Times that a step is made on finer and finer meshes, and the factor by which the number of intervals grows at most each time:
#: where the error is large, its estimate is no guide to how many are needed.
_ATTEMPTS, _GROWTH = 4, 4
#: A finer mesh stays if it makes the error smaller than this part of it. Where it does not, as at round-off or at a jump of the
#: equations inside an interval, meshes would grow without end.
_HELPS = 0.5
#: Labels of points that must not be missed on a finer mesh. Others (of codimension two, user zeros) keep theirs with ± NaN.
_CONFIRMED = ("LP", "BP", "HB", "PD", "TR")
#: Labels of points that no derivative by the solution tells.
_BY_VALUES = ("EP", "UZ", "MX")

#: The index on both sides of a special point; None where it is not defined.
IndexChange = tuple[int | None, int | None]

#: Distance from a first point that is exactly a branch point to where Newton's method begins. Ten times larger, the corrected
#: point is a thousandth of a usual first step away.
_BESIDE = 1e-6


class Step(NamedTuple):
    """A step that was made.

    Attributes
    ----------
    segment : Segment
    judgement : Judgement
    special : sequence of SpecialPoint
        Inside it, in order.
    turns : bool
        The primary parameter turns inside it.
    doubt : str
        What is left of it where the step cannot be halved any more.
    """

    segment: Segment
    judgement: Judgement
    special: Sequence[SpecialPoint] = ()
    turns: bool = False
    doubt: str = ""

    @property
    def end(self) -> Trial:
        """The end of the segment on a mesh with points where conditions that the solution decides switch."""
        return self.segment.trial.settled


class Continuation:
    """One run along a branch; iterate over it for the points, then read ``stop``.

    Parameters
    ----------
    system : Collocation or alike
    x : ndarray, shape (size,)
        A first point; corrected at fixed primary parameter unless a tangent is given.
    settings : Settings
    tangent : ndarray, shape (size,), optional
        Where to go; needed when x is a branch point. Its sign is then kept.
    singular : bool
        With ``tangent``: x is a branch point.
    state : State, optional
        Continue from here instead (x and tangent are then not used).
    start : tuple (system, x, tangent), optional
        With ``state``: the first point of the run that is continued, to recognise a closed branch.

    Raises
    ------
    ProblemError
        Names or numbers that do not fit the problem.
    ConvergenceError
        The first point cannot be corrected.

    Examples
    --------
    >>> from contin import Algebraic, AlgebraicProblem
    >>> parabola = AlgebraicProblem(lambda u, p: (p.a - u.x**2,), ["x"], {"a": 1.0})
    >>> run = Continuation(Algebraic(parabola, ["a"]), np.array([1.0, 1.0]), Settings(direction=-1, limits={"a": (-1, 4)}))
    >>> print([point.label for point in run if point.label], run.stop)
    ['EP', 'LP', 'EP'] reached a = 4
    """

    def __init__(
        self,
        system: Discretization,
        x: Array,
        settings: Settings = Settings(),
        tangent: Array | None = None,
        state: State | None = None,
        start: Start | None = None,
        singular: bool = True,
    ) -> None:
        self.settings = settings
        self.stop: Stop | None = None
        self._noted: set[str] = set()  # what is said of conditions on states once
        self._is_noisy = False  # some point is not known to the tolerance
        self._end: Trial | None = None  # the state's point, with what is known of it beyond the state
        self._check(system)
        self.primary = settings.primary or system.free[0]
        self._state: State | Callable[[], State] = state or self._first(system, np.asarray(x, dtype=float), tangent, singular)
        self._fold = fold(self.primary) if settings.folds else None
        self._own = [test for test in own_test_functions(self.state.system) if test.unless not in settings.limits]
        self._limits = limits(settings.limits)
        general = self._general_test_functions()
        self._tests = [*general, *self._own]
        self._ends = [test for test in self._tests if test.terminal and not test.limit]
        self._comparable = general  # have the same sign on every mesh
        self._index = index_of(self.state.system)
        self._watch = watch_list(self.state.system, settings, self._tests, self._fold, self._index)
        self.notes: list[str] = []
        self._resumed = state is not None
        self._accuracy = Accuracy(np.nan)  # of the end of the last step
        self.start = start or (self.state.system, self.state.x, self.state.tangent)
        self._lane_for: object = None
        self._known_lane: Lane | None = None

    @property
    def state(self) -> State:
        """The state behind the last point."""
        known = self._state
        if not isinstance(known, State):
            self._state = known = known()
        return known

    @state.setter
    def state(self, state: State) -> None:
        self._state = state

    def __repr__(self) -> str:
        return f"Continuation({self.state!r}; {self.stop or 'not ended'})"

    def _check(self, system: Discretization) -> None:
        threads.count()  # refuses a wrong number, also where the problem is too small to use it
        if len(system.free) != system.problem.free_size:
            raise ProblemError(
                f"free parameters: {len(system.free)} given ({', '.join(system.free)}), a curve of this problem needs "
                f"{system.problem.free_size} (conditions - states + 1)"
            )
        primary = self.settings.primary
        if primary is not None and primary not in system.free:
            raise ProblemError(f"primary: {primary!r} is not one of the free parameters {', '.join(system.free)}")
        known = (*system.problem.parameters, *system.problem.functionals, *system.named_states)
        trivial = () if self.settings.trivial is None else (self.settings.trivial,)
        for name in (*self.settings.limits, *self.settings.zeros, *self.settings.extrema, *trivial):
            if name not in known:
                raise ProblemError(f"{name!r} is no column of this problem ({checks.listed(known)})")

    def _general_test_functions(self) -> list[TestFunction]:
        """Return those of the settings."""
        settings = self.settings
        found = [*user_zeros(settings.zeros), *self._limits, *map(extremum, settings.extrema)]
        return [*found, *settings.monitors, *settings.test_functions]

    # --- the first point -----------------------------------------------------------------------------------------

    def _first(self, system: Discretization, x: Array, tangent: Array | None, singular: bool) -> State:
        settings = self.settings
        if tangent is not None:
            system, carry = renewed(system, x)
            x, tangent = carry(x), carry(tangent)
            unit = tangent / np.sqrt(inner(system, tangent, tangent))
            state = dataclasses.replace(standing_at(system, x, unit, settings.step), singular=singular)
            return state if singular else dataclasses.replace(state, sign=system.linearize(x, (state.row,))[1].sign)
        for _ in range(_ROUNDS):
            system, x, row = self._first_on_switches(system, x)
            adapted = system.adapted(x, settings.mesh)
            if adapted is None:
                break
            system, carry = adapted
            x = carry(x)
        else:
            system, x, row = self._first_on_switches(system, x)
        linear = linearization(system, x, row)
        rescaled, z = scaled(system, x, row, linear, self.primary, settings)
        if rescaled is not system:
            x, row = self._first_correction(rescaled, z)
            system, linear = rescaled, linearization(rescaled, x, row)
        system, x, linear = self._accurate_first(system, x, linear)
        unit = settings.direction * growing(system, x, linear.tangent, self.primary, settings.newton)
        state = standing_at(system, x, unit, settings.step)
        return dataclasses.replace(state, sign=system.linearize(x, (state.row,))[1].sign)

    def _accurate_first(
        self, system: Discretization, x: Array, linear: Linearization
    ) -> tuple[Discretization, Array, Linearization]:
        """Return the first point on a mesh on which its error is within the tolerance, as far as one is found."""
        for _ in range(_ATTEMPTS):
            accuracy = accuracy_of(Trial(system, x, linear))
            finer = self._finer_mesh(system, x, accuracy.error) if self._is_poor(accuracy) else None
            if finer is None:
                break
            system, carry = finer
            system, x, row = self._first_on_switches(system, carry(x))
            linear = linearization(system, x, row)
        return system, x, linear

    def _first_on_switches(self, system: Discretization, x: Array) -> tuple[Discretization, Array, Array]:
        """Correct x, on a mesh with points where conditions that the solution decides switch; return the row held, too."""
        x, row = self._first_correction(system, x)
        for _ in range(ROUNDS if self.settings.mesh.every else 0):
            moved = system.on_switches(x)
            if moved is None:
                break
            system, carry = moved
            x, row = self._first_correction(system, carry(x))
        return system, x, row

    def _first_correction(self, system: Discretization, x: Array) -> tuple[Array, Array]:
        """Correct x at fixed primary parameter or, where that is singular (at a fold), across a random direction.

        Returns x and the row that was held.
        """
        fixed = np.zeros(system.size)
        fixed[system.parameter_index(self.primary)] = 1.0
        across = np.random.default_rng(3).standard_normal(system.size) * np.sqrt(system.weights)
        failed: ConvergenceError | None = None
        beside = x + _BESIDE * across / np.abs(across).max()  # of a branch point, where both are singular
        for start, row in ((x, fixed), (x, across), (beside, across)):
            try:
                return correct(system, start, row, row @ start, self.settings.newton, sizes=system.magnitudes).x, row
            except ConvergenceError as error:
                failed = failed or error
        assert failed is not None
        raise failed

    # --- the loop ------------------------------------------------------------------------------------------------

    def __iter__(self) -> Iterator[Point]:
        if not self._resumed:
            trial = self._state_trial()
            first = SpecialPoint(0.0, "BP" if self.state.singular else "EP", "start", trial)
            located = self._located(dataclasses.replace(first, label=own_end(trial.system, first).label))
            self._note_corners(trial)
            yield self._point(located, self.state, accuracy=at_branch_point(trial) if self.state.singular else None)
            if (stop := self._out_of_limits(trial) or self._out_of_domain(trial)) is not None:
                self.stop = stop
                return
        while self.stop is None:
            yield from self._plain()
            yield from self._advance()

    def _plain(self) -> Iterator[Point]:
        """Make plain steps, many at a time, up to the first that wants a closer look; yield their points."""
        most = FEWEST
        while (lane := self._lane) is not None and not self.state.singular:
            most = min(most, self.settings.max_points - 1 - self.state.accepted)  # the last one has a label
            block = lane.steps(self.state, max(most, 0))
            for self._state, point in block.points():
                self._end, self._accuracy = None, Accuracy(0.0)
                yield point
            if block.made < most or most <= 0:
                return
            most = min(2 * most, MOST)

    @property
    def _lane(self) -> Lane | None:
        """The lane of plain steps, made anew where what it depends on has changed; None where there is none."""
        system, settings, noisy = depends = self.state.system, self.settings, self._is_noisy
        if self._lane_for != depends:
            self._lane_for = depends
            self._known_lane = lane_of(system, settings, self.start, self._tests, self._own, noisy)
        return self._known_lane

    def predicted(self, step: float) -> Array:
        """Return the guess (shape (size,), of ``state.system``) from which the corrector starts at a distance ``step``."""
        return predict(self.state, step)

    def _state_trial(self) -> Trial:
        """Return the state's point as a trial."""
        state = self.state
        return Trial(state.system, state.x, Linearization(state.tangent, state.sign))

    def _out_of_limits(self, trial: Trial) -> Stop | None:
        for name, (low, high) in self.settings.limits.items():
            size = min(1.0, high - low)
            if not low - _SLACK * (size + abs(low)) <= trial[name] <= high + _SLACK * (size + abs(high)):
                ends = " ... ".join(value_names((low, high)).values())
                return Stop("limit", f"{name} = {trial[name]:.10g} at the start lies outside {ends}")
        return None

    def _out_of_domain(self, trial: Trial) -> Stop | None:
        """Return the reason to stop at the first point: a test function of the kind of problem that ends runs is negative.

        At a point where a curve begins it is zero up to round-off, and positive a little further on.
        """
        beside = Trial.without_tangent(trial.system, trial.x + _ENTERS * trial.tangent)
        for test in self._own:
            if test.terminal and trial.value(test) < 0 and (self.state.singular or not test.function(beside) > 0):
                return Stop("event", f"{test.name} at the first point")
        return None

    def _advance(self) -> Iterator[Point]:
        """Make one step: yield the labelled points inside it, then the point at its end."""
        self._adapt_mesh()
        try:
            step = self._accurate_step()
        except ConvergenceError as error:
            stop = own_stop(self.state.system, self._state_trial(), self._failure(error))
            if stop.reason == "no convergence" and self._takes_shorter_steps():
                return
            self.stop = stop
            met = self.stop.reason == "event"
            label, name = ("EP", self.stop.message.removeprefix("met ")) if met else ("MX", "no convergence")
            yield self._point(SpecialPoint(0.0, label, name, self._state_trial()), self.state, accuracy=self._accuracy)
            return
        segment, special = step.segment, [own_end(step.segment.trial.system, point) for point in step.special]
        special = within_limits(segment, special, self._limits)
        end = next((number for number, point in enumerate(special) if point.stop is not None), len(special))
        found = [self._located(point) for point in special[: end + 1]]
        found = [point for point in found if self._is_confirmed(point, segment)]
        changes = self._index_changes(segment, found)
        if end == len(special):
            self._note_doubts(segment, found, step.doubt if len(found) == len(special) else "")
        for point, change in zip(found, changes):
            if point.stop is not None:
                self.stop = own_stop(point.trial.system, point.trial, point.stop)
                point = with_details(point, self.stop)
            yield self._point(point, segment.state, change)
            if self.stop is not None:
                return
        self.state = self._accept(segment, step.judgement, step.turns)
        self._stand_at(step.end)
        self._note_corners(step.end)
        if segment.trial.newton_error > max(self.settings.newton.tolerance, NOISY) and not self._is_noisy:
            self._is_noisy = True
            self._note(
                "from here on the updates of Newton's method are round-off above its tolerance: see newton_error", segment
            )
        if self.state.accepted >= self.settings.max_points:
            self.stop = Stop("max points", f"max_points = {self.settings.max_points} reached", "raise it to go on")
        elif self._fold is not None and self.state.accepted == _STANDING and not self.state.sense:
            self.stop = own_standstill(segment.trial.system, segment.trial, self.primary)
            if self.stop is None and not segment.trial.system.intervals:
                here = f"{self.primary} stays at {segment.trial[self.primary]:.10g}, as far as can be told"
                self.notes.append(f"{here}: a vertical family, as of a linear or conservative system; folds are not told there")
        label, name = ("EP", self.stop.reason) if self.stop else ("", "")
        found_at_end = self._located(SpecialPoint(segment.step, label, name, step.end))
        yield self._point(found_at_end, segment.state, accuracy=self._accuracy)

    def _takes_shorter_steps(self) -> bool:
        """Take steps below the default ``min_step`` from here on, if the run goes on with them; say so."""
        shorter = shorter_steps(self.state, self.settings)
        if shorter is None:
            return False
        here, least = self._state_trial()[self.primary], exact_text(self.settings.min_step)
        self.notes.append(
            f"from {self.primary} = {here:.10g} on, steps below {least} are taken: the branch bends sharply there"
        )
        self.settings = dataclasses.replace(self.settings, min_step=shorter)
        return True

    def _failure(self, error: ConvergenceError) -> Stop:
        """Return the reason why no step succeeds: the domain of the equations ends, or the last error."""
        first, here = Trial(*self.start[:2], Linearization(self.start[2], np.nan)), self._state_trial()
        for test in self._ends:
            if abs(here.value(test)) < _NEARLY * abs(first.value(test)):
                return Stop("event", f"met {test.name}")
        return no_convergence(self.state, self.settings, error)

    # --- one step ------------------------------------------------------------------------------------------------

    def _accurate_step(self) -> Step:
        """Make a step whose end has an error within the tolerance of the mesh, as far as a finer mesh makes it smaller.

        The mesh is adapted to the end of a step that is not good enough, and the step is made again from the same point.
        """
        step = self._step(self.state)
        self._accuracy = accuracy_of(step.end)
        for _ in range(_ATTEMPTS):
            end, known = step.end, (self.state, self._end)
            if not self._is_poor(self._accuracy) or self._ends_inside(step.segment):
                break
            if unsettled(end, self.settings.mesh.tolerance, self.primary):
                break  # finer meshes are no help
            finer = self._finer_mesh(end.system, end.x, self._accuracy.error)
            if finer is None or not self._move_to(finer):
                break
            again = self._step(self.state)
            accuracy = accuracy_of(again.end)
            if not accuracy.error < _HELPS * self._accuracy.error:
                self.state, self._end = known
                break
            step, self._accuracy = again, accuracy
        return step

    def _moved_past(self, trial: Trial) -> str:
        """Return a clause if special points lie between a point and the same one with other mesh points; "" otherwise."""
        end = trial.settled
        if end is trial:
            return ""
        same = end.sign == trial.sign and self._sense(end) * self._sense(trial) >= 0
        same = same and all(np.sign(trial.value(test)) == np.sign(end.value(test)) for test in self._comparable)
        return "" if same else "a special point moves out of the step with the places where conditions on states switch"

    def _stand_at(self, trial: Trial) -> None:
        """Let the run go on from the accepted point as it is on another mesh."""
        state, self._end = self.state, trial
        if trial.system is state.system:
            return
        carry = state.system.carrier(trial.system)
        previous = None if state.previous_tangent is None else carry(state.previous_tangent)
        self.state = dataclasses.replace(
            state, system=trial.system, x=trial.x, tangent=trial.tangent, previous_tangent=previous, sign=trial.sign,
            discretization_error=trial.discretization_error,
        )  # fmt: skip

    def _lost_end(self, segment: Segment, inspection: Inspection) -> str:
        """Return a clause if the run ends inside a step, at a place that was not located; "" otherwise."""
        if not self._ends_inside(segment):
            return ""
        ends = [point for point in inspection.special_points(self._tests) if point.stop is not None]
        return "" if all(point.is_located for point in ends) else "the end of the run inside the step was not located"

    def _ends_inside(self, segment: Segment) -> bool:
        """Return whether the run ends inside a step, and not at a limit: the point at its end is not accepted.

        The equations may not hold there, and no mesh be fine enough.
        """
        before, trial = segment.before, segment.trial
        return any(test.passed(before.value(test), trial.value(test)) for test in self._ends)

    def _is_poor(self, accuracy: Accuracy) -> bool:
        """Return whether a point has a larger error than the tolerance of the mesh, which a finer one would lower."""
        control = self.settings.mesh
        if not (control.every and accuracy.error > control.tolerance and accuracy.trial is not None):
            return False
        return accuracy.trial.system.intervals < control.max_intervals and not accuracy.is_round_off

    def _finer_mesh(self, system: Discretization, x: Array, error: float) -> tuple[Discretization, Carrier] | None:
        """Return the system on a finer mesh that is adapted to x, as fine as the error takes; None if it may not be finer."""
        control, now = self.settings.mesh, system.intervals
        count = min(max(self._intervals_for(system, error), now + 1), control.max_intervals)
        if count <= now:
            return None
        return system.adapted(x, dataclasses.replace(control, min_intervals=count, max_intervals=count))

    def _step(self, state: State) -> Step:
        """Predict and correct, halving the step until the corrected point can be believed."""
        step, settings = up_to_limits(state, self.settings.limits, self.settings.min_step), self.settings
        finest = max(settings.min_step, _FINEST * step)
        while True:
            try:
                segment, judgement = self._attempt(state, step)
                inspection = Inspection(segment, settings, self.start, self._fold)
                if not (state.singular or segment.is_moved or any(asks(inspection) for asks in self._watch)):
                    return Step(segment, judgement)
                doubt = inspection.doubt() or self._contradiction(segment, inspection) or self._lost_end(segment, inspection)
                doubt = doubt or self._moved_past(segment.trial) or inspection.strays(self._tests)
                if step < 2 * finest or not doubt:
                    special = inspection.special_points(self._tests)  # where these cannot be found the step is halved
                    return Step(segment, judgement, special, inspection.turns, doubt)
                problem = ConvergenceError(doubt)
            except ConvergenceError as error:
                problem = error
            step /= 2
            if step < settings.min_step:
                raise problem

    def _attempt(self, state: State, step: float) -> tuple[Segment, Judgement]:
        """Make one step of a given length, as far as it can be believed by itself.

        Raises
        ------
        ConvergenceError
        """
        settings = self.settings
        guess = predict(state, step)
        trial = corrected(state, guess, step, settings.newton)
        if collapsed(state.system, state.x, trial.x):
            raise ConvergenceError("the cycle at the corrected point is an equilibrium")
        judgement = judged(state, guess, trial)
        angle, accuracy = aims(settings, state.system)
        if not (judgement.turn <= angle and judgement.missed <= ASTRAY * accuracy * step):
            raise ConvergenceError(
                f"tangents turn by {judgement.turn:.2f} rad in one step, the prediction is off by "
                f"{judgement.missed / step:.2f} of it"
            )
        if self._fold is not None and self._jumped(state, guess, trial, step):
            raise ConvergenceError(f"{self.primary} does not go where the tangents at both ends say")
        low, before = self._before(state, step)
        self._stay_off_trivial(state, before, trial)
        if settings.mesh.every:
            trial = settled(trial, state.tangent, settings.newton)
        return Segment(state, (low, before), trial, step, settings.newton, bool(settings.mesh.every)), judgement

    def _stay_off_trivial(self, state: State, before: Trial, trial: Trial) -> None:
        """Raise ConvergenceError where the corrected point lies on the trivial branch, or where the first step passes it."""
        name, newton = self.settings.trivial, self.settings.newton
        if name is None:
            return
        if jumped(before, trial, name, newton):
            raise ConvergenceError(f"the corrected point lies on the trivial branch, {name} = {trial[name]:.1e}")
        if state.singular and crossed(before, trial, name, newton):
            raise ConvergenceError(f"{name} changes its sign in the first step")

    def _before(self, state: State, step: float) -> Place:
        """Return where a step's test functions start from.

        That is the state's point, as the step before left it, so that both decide from the same values. At a branch point
        tangent and determinant say nothing: a point close to it stands in.
        """
        if not state.singular:
            if self._end is None:
                self._end = Trial(state.system, state.x, Linearization(state.tangent, state.sign))
            return 0.0, self._end
        return self._aside(state, step)

    def _aside(self, state: State, step: float) -> Place:
        """Return the nearest point beside a branch point that Newton's method finds, with a tangent along the branch."""
        problem = ConvergenceError("another branch was met right beside the branch point")
        for share in _ASIDE:
            try:
                guess = state.x + share * step * state.tangent
                aside = located(state, guess, share * step, self.settings.newton)
                if judged(state, guess, aside).turn <= aims(self.settings, state.system)[0]:
                    return share * step, aside
            except ConvergenceError as error:
                problem = error
        raise problem

    def _jumped(self, state: State, guess: Array, trial: Trial, step: float) -> bool:
        """Return whether the primary parameter misses its prediction by much of what it changes at all.

        It may be a small part of the whole: the distance from the prediction does not show it then, and folds would be jumped.
        """
        at = trial.system.parameter_index(self.primary)
        missed = abs(guess[at] - trial.x[at])
        tangents = [state.tangent, trial.tangent] + ([] if state.previous_tangent is None else [state.previous_tangent])
        change = step * max(abs(tangent[at]) for tangent in tangents)
        return bool(is_astray(missed, change, trial.newton_error, trial.x[at]) and self._sense(trial))

    def _has_moved(self, start: Array, trial: Trial) -> bool:
        """Return whether a step has moved the primary parameter by more than round-off: tangents are blurred at Hopf points."""
        at = trial.system.parameter_index(self.primary)
        return bool(abs(trial.x[at] - start[at]) > STANDS * (1 + abs(trial.x[at])))

    def _sense(self, trial: Trial) -> float:
        """Return the sense in which the primary parameter goes; zero where that cannot be told, or is not wanted."""
        return 0.0 if self._fold is None else sense(trial, self._fold, self.settings.newton)

    def _accept(self, segment: Segment, judgement: Judgement, turned: bool) -> State:
        """Return the next state, its step chosen so that the predictor's error is ``accuracy`` of it.

        ``turned``: the step passes a fold. Behind it the parameter goes the other way, be it by less than round-off yet.
        """
        settings, state, trial, step = self.settings, segment.state, segment.trial, segment.step
        angle, accuracy = aims(settings, state.system)
        order, longest, free = (
            2 if state.previous_tangent is None else 3,
            settings.max_step,
            slice(state.system.state_size, None),
        )
        for value, rate in zip(trial.x[free].tolist(), trial.tangent[free].tolist()):
            longest = longest_step(longest, settings.change, value, rate)
        following = following_step(step, judgement.missed, judgement.turn, order, accuracy, angle, settings.min_step, longest)
        way = self._sense(trial) if turned or self._has_moved(state.x, trial) else 0.0
        way = 0.0 if way * state.sense < 0 and not turned else way  # a fold that was not seen: the next step has it behind it
        return State(
            state.system, trial.x, trial.tangent, None if state.singular else state.tangent, step, following, trial.sign,
            state.arclength + judgement.length, state.accepted + 1, False,
            way or state.sense, free_values(trial) if way else state.sensed, trial.discretization_error,
        )  # fmt: skip

    # --- the index -----------------------------------------------------------------------------------------------

    def _contradiction(self, segment: Segment, inspection: Inspection) -> str:
        """Return how the change of index over a step contradicts its special points; "" if not."""
        if not contradiction(self._index, segment, ()):
            return ""  # without special points, which take time
        return contradiction(self._index, segment, inspection.special_points(self._tests))

    def _note_doubts(self, segment: Segment, found: list[SpecialPoint], doubt: str) -> None:
        """Note what the labelled points of a step do not explain: a change of the index or, without one, a doubt."""
        contradicts = contradiction(self._index, segment, found)
        if contradicts and not found:  # beside points, changes of the index are noted
            self._note(f"{contradicts}, and the labelled points do not explain it", segment)
        elif doubt and not contradicts:
            self._note(doubt, segment)

    def _note(self, text: str, segment: Segment) -> None:
        """Note what was seen inside a step and not understood."""
        ends = (trial[self.primary] for trial in (segment.before, segment.trial))
        self.notes.append(f"{text} (between {self.primary} = {' and '.join(f'{end:.10g}' for end in ends)})")

    def _note_corners(self, trial: Trial) -> None:
        """Note once that conditions on states make the equations jump, and once that mesh points do not follow them."""
        tolerance = self.settings.mesh.tolerance if self.settings.mesh.every else np.inf
        for kind, note in (("jump", jump(trial, self.primary)), ("unsettled", unsettled(trial, tolerance, self.primary))):
            if note and kind not in self._noted:
                self._noted.add(kind)
                self.notes.append(note)

    def _note_phases(self, found: SpecialPoint, error: float) -> None:
        """Note the phase conditions that load a labelled point, which is known to ``error``."""
        trial = found.trial
        place = f"at {found.label} ({self.primary} = {trial[self.primary]:.10g})"
        known = trial.newton_error + (self.settings.mesh.tolerance if np.isnan(error) else error)
        for name, load, is_mode in phase_loads(trial.system, trial.x, getattr(found.details, "kernel", ()), known):
            what = f"has {load:.3g} of the largest number of a mode {place}" if is_mode else f"= {load:.6g} {place}"
            self.notes.append(f"phases: {name} {what} and not zero, so the phase condition loads the structure; leave it out")

    def _is_confirmed(self, point: SpecialPoint, segment: Segment) -> bool:
        """Return whether a special point was located and, where that was asked for, not missed on a finer mesh.

        Others are noted: they get no label. The end of a run keeps its own. So does a point whose errors are not known because
        Newton's method fails on the finer mesh; that is noted.
        """
        what = f"{point.label} {point.name.removeprefix('possible').strip()}".strip()
        unknown = point.label in _CONFIRMED and any(np.isnan(error) for error in (point.errors or {}).values())
        if point.stop is not None or (point.is_located and not (unknown and point.is_lost)):
            if point.stop is None and unknown:
                place = f"{self.primary} = {point.trial[self.primary]:.10g}"
                self.notes.append(f"{what} at {place}: its ± is nan, since Newton's method failed at the second look")
            return True
        why = why_lost(point.trial, point.is_located)
        self._note(f"a possible {what} {why}", segment)
        return False

    def _index_changes(self, segment: Segment, special: list[SpecialPoint]) -> list[IndexChange | None]:
        """Return the index before and after each special point of a step, and note what contradicts itself."""
        if self._index is None or not special:
            return [None] * len(special)
        groups = [list(group) for _, group in itertools.groupby(special, lambda point: (point.same_as or point).at)]
        middles = [(a[-1].at + b[0].at) / 2 for a, b in itertools.pairwise(groups)]
        last = special[-1]  # behind a limit the step does not belong to the branch
        ends_there = last.stop is not None and last.test is not None and last.same_as is None
        between = [segment.before, *(segment.near(s) for s in middles), last.trial if ends_there else segment.trial]
        values = [trial.value(self._index) for trial in between]
        whole = [None if np.isnan(value) else int(value) for value in values]
        changes: list[IndexChange | None] = []
        for group, (before, after), pair in zip(groups, itertools.pairwise(values), itertools.pairwise(whole)):
            changes += [pair if nullity_of(point) else None for point in group]
            if abs(after - before) > sum(map(nullity_of, group)) or (group[0].label == "LP" and after == before):
                name = f"{group[0].label} {group[0].name}".strip()
                place = f"{self.primary} = {group[0].trial[self.primary]:.10g}"
                self.notes.append(f"the index goes from {before:g} to {after:g} at {name} ({place})")
        return changes

    # --- the mesh ------------------------------------------------------------------------------------------------

    def _adapt_mesh(self) -> None:
        """Adapt the mesh now and then, and correct the point on it."""
        control, state = self.settings.mesh, self.state
        due = control.every if state.system.intervals else 1  # without a mesh it is borders that are renewed, at no cost
        if state.singular or not due or state.accepted % due:
            return
        fewest = self._fewest_intervals(state)
        half = max(control.min_intervals, state.system.intervals // 2)
        for count in (half, fewest) if self._is_too_fine(state) else (fewest,):
            wanted = control if count == control.min_intervals else dataclasses.replace(control, min_intervals=count)
            adapted = outgrown(state.system, state.x, state.system.adapted(state.x, wanted))
            if adapted is not None and self._move_to(adapted):
                return

    def _intervals_for(self, system: Discretization, error: float) -> int:
        """Return the number of intervals with which a point of this error, of the order h^(2 d), is within the tolerance."""
        order = 2 * max(system.degree, 1)
        factor = float(error / (_MARGIN * self.settings.mesh.tolerance)) ** (1 / order)
        return math.ceil(system.intervals * min(float(factor), _GROWTH))

    def _fewest_intervals(self, state: State) -> int:
        """Return the fewest intervals that keep the state's error within the tolerance, however few the density asks for.

        An error far below the tolerance may be round-off, which does not grow on coarser meshes: half of the intervals may do.
        """
        control, now, error = self.settings.mesh, state.system.intervals, state.discretization_error
        if math.isnan(error) or not now:
            return control.min_intervals
        count = now // 2 if error < _FAR_BELOW * control.tolerance else min(self._intervals_for(state.system, error), now)
        return max(control.min_intervals, min(count, control.max_intervals))

    def _serves(self, end: Trial) -> bool:
        """Return whether the state's point is as good on a mesh of fewer intervals as it should be, or as it was.

        Round-off does not grow there. Where canards amplify it, they amplify errors of the mesh, too, and these do.
        """
        accuracy, before = accuracy_of(end), self.state.discretization_error
        return not self._is_poor(accuracy) and not (before > self.settings.mesh.tolerance and accuracy.error > before)

    def _is_too_fine(self, state: State) -> bool:
        """Return whether the error is round-off above the tolerance, on far more intervals than the density asks for.

        Half of them may do then: short intervals make it larger, as where cycles shrink after canards. Where the parameter
        stands still, in an explosion, errors of the mesh are taken for round-off.
        """
        control, end = self.settings.mesh, self._end
        if end is None or not state.discretization_error > control.tolerance or not accuracy_of(end).is_round_off:
            return False
        wanted = state.system.adapted(state.x, control)
        if wanted is None or wanted[0].intervals * _FAR_TOO_MANY > state.system.intervals:
            return False
        return bool(self._sense(end))

    def _move_to(self, adapted: tuple[Discretization, Carrier]) -> bool:
        """Correct the state's point on another mesh, or with other sizes, and return whether the run goes on from there.

        It does not where the point is not found there, where a special point would fall between the meshes, or where a mesh of
        fewer intervals is not good enough.
        """
        state, (system, carry) = self.state, adapted
        tangent = carry(state.tangent)
        length = float(np.sqrt(inner(system, tangent, tangent)))
        tangent /= length
        previous, step = None if state.previous_tangent is None else carry(state.previous_tangent), state.step
        if system.scales is not state.system.scales:
            previous, step = None, float(np.clip(step * length, self.settings.min_step, self.settings.max_step))
        x, row = carry(state.x), system.weights * tangent
        if state.singular:  # a corrected point has a tangent of any of the branches; the first step corrects what is carried
            self.state = dataclasses.replace(state, system=system, x=x, tangent=tangent, step=step)
            return True
        try:
            done = correct(system, x, row, row @ x, self.settings.newton)
            end = trial_of(system, dataclasses.replace(done, iterations=0, error=0.0), row)
        except ConvergenceError:
            return False  # the old mesh still serves; the step control will notice if it does not
        if collapsed(system, x, done.x):
            return False
        before = self._before(state, state.step)[1]
        if any(np.sign(before.value(test)) != np.sign(end.value(test)) for test in self._comparable):
            return False  # the next point will do as well
        if self._sense(before) * self._sense(end) < 0:
            return False
        if self.settings.trivial is not None and jumped(before, end, self.settings.trivial, self.settings.newton):
            return False
        if system.intervals < state.system.intervals and not self._serves(end):
            return False
        self._end = end
        self.state = dataclasses.replace(
            state, system=system, x=end.x, tangent=end.tangent, previous_tangent=previous, step=step, sign=end.sign,
            discretization_error=end.discretization_error,
        )  # fmt: skip
        return True

    # --- results -------------------------------------------------------------------------------------------------

    def _located(self, found: SpecialPoint) -> SpecialPoint:
        """Return a special point located again on finer meshes, with its errors, if these are wanted; and its normal form."""
        if not found.label:
            return found  # a regular point
        labelled = found.label != "MX" and found.name != "closed"  # closed: the first point once more
        coarse = own_normal_form(found.trial.system, found)
        if found.errors is None and labelled and self.settings.errors:
            again = refined(found.same_as or found, self.settings)
            details, errors, is_lost = found.details if found.same_as else again.details, again.errors, again.is_lost
            if found.label not in _BY_VALUES and again.trial.system.switching(again.trial.x).jumps.any():
                errors, is_lost = dict.fromkeys(errors, np.nan), True
            found = dataclasses.replace(found, trial=again.trial, details=details, errors=errors, is_lost=is_lost)
        if coarse is not None:
            better = own_normal_form(found.trial.system, found) if found.errors else coarse
            found = with_normal_form(found, better or coarse, coarse)
        return found

    def _point(
        self, found: SpecialPoint, state: State, change: IndexChange | None = None, accuracy: Accuracy | None = None
    ) -> Point:
        """Return the point of a branch; its accuracy is estimated where it is not known."""
        trial, system = found.trial, found.trial.system
        parameters = dict(zip(system.problem.parameters, map(float, system.all_parameters(trial.x))))
        if accuracy is None and found.name != "closed" and np.isfinite(trial.tangent).all():
            accuracy = accuracy_of(trial)
        elif accuracy is None:  # at a branch point the equations are singular; the end of the step is on no finer mesh
            accuracy = self._accuracy
        stability = Stability()
        if self._index is not None:
            stability = stability_of(found)
        if found.label:
            self._note_phases(found, accuracy.error)
        return Point(
            found.label, found.name, parameters, trial.functionals, trial.x, trial.tangent, system,
            state.arclength + found.at, trial.iterations, trial.newton_error, found.errors or {}, found.details,
            stability.index, stability.nullity, change, stability.breaks,
            *(("", None) if found.test is None else (found.test.column, found.test.value)), accuracy.error,
        )  # fmt: skip


def follow(
    system: Discretization, x: Array, settings: Settings = Settings(), tangent: Array | None = None, singular: bool = True
) -> Branch:
    """Run to the end and return the branch: `Continuation` as one call.

    Examples
    --------
    >>> from contin import Algebraic, AlgebraicProblem
    >>> parabola = AlgebraicProblem(lambda u, p: (p.a - u.x**2,), ["x"], {"a": 1.0})
    >>> branch = follow(Algebraic(parabola, ["a"]), np.array([1.0, 1.0]), Settings(direction=-1, limits={"a": (-1, 4)}))
    >>> [point.label for point in branch if point.label]
    ['EP', 'LP', 'EP']
    """
    run = Continuation(system, x, settings, tangent, singular=singular)
    points = list(run)
    return Branch(points, run.stop, run.notes)
