"""Pseudo-arclength continuation: a run is an iterable of points over an explicit state.

    run = Continuation(system, x, settings)
    for point in run:
        ...
    print(run.stop)

One step is: adapt the mesh if due; predict; correct; halve the step until the corrected point can be believed; locate the
special points between the two ends; accept. The loop knows of a system only its protocol (`contin.core.protocol`),
not its kind.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Callable, Iterator, Sequence
from typing import NamedTuple

import numpy as np

from contin.arrays import Array
from contin.continuation.failure import met, no_convergence, shorter_steps
from contin.continuation.findings import IndexChange, index_changes, is_confirmed, located_again
from contin.continuation.first import begins_outside, corrected_first, on_branch
from contin.continuation.lane import FEWEST, MOST, Handed, Lane, lane_of
from contin.continuation.meshes import MeshPolicy, Moved, finer, is_poor
from contin.continuation.notes import Notes, unsettled
from contin.continuation.rules import NOISY
from contin.continuation.steps import Steps
from contin.core.protocol import Discretization
from contin.core.settings import Settings, check
from contin.core.state import Reason, State, Stop
from contin.core.step import Judgement, predict, up_to_limits
from contin.core.trial import Linearization, Trial
from contin.errors import ConvergenceError
from contin.events.accuracy import Accuracy, accuracy_of, at_branch_point
from contin.events.extrema import extremum
from contin.events.index import Stability, contradiction
from contin.events.inspection import Inspection, Start
from contin.events.segment import Segment, SpecialPoint, with_details
from contin.events.test_functions import (
    fold,
    limits,
    user_zeros,
    within_limits,
)
from contin.events.watch import watch_list
from contin.names import exact_text
from contin.results.branch import Branch
from contin.results.point import Point

#: A step is cut down to this fraction of itself to take several branch points one by one.
_FINEST = 1e-3
#: A run whose primary parameter has stood still for so many steps says so, and is asked whether it should go on.
_STANDING = 6
#: Times that a step is made on finer and finer meshes.
_ATTEMPTS = 4
#: A finer mesh stays if it makes the error smaller than this part of it. Where it does not, as at round-off or at a jump of the
#: equations inside an interval, meshes would grow without end.
_HELPS = 0.5


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
        self.stop: Stop | None = None
        self._end: Trial | None = None  # the state's point, with what is known of it beyond the state
        check(system, settings)
        self.primary = settings.primary or system.free[0]
        self._steps = Steps(settings, self.primary, fold(self.primary) if settings.folds else None)
        self._state: State | Callable[[], State] = state or self._first(system, np.asarray(x, dtype=float), tangent, singular)
        self._own = [test for test in self.state.system.events() if test.unless not in settings.limits]
        self._limits = limits(settings.limits)
        general = [
            *user_zeros(settings.zeros), *self._limits, *map(extremum, settings.extrema),
            *settings.monitors, *settings.test_functions,
        ]  # fmt: skip
        self._tests = [*general, *self._own]
        self._ends = [test for test in self._tests if test.terminal and not test.limit]
        self._meshes = MeshPolicy(self._steps, general)
        self._index = self.state.system.index
        self._watch = watch_list(self.state.system, settings, self._tests, self._steps.fold, self._index)
        self._notes = Notes(self.primary, settings.mesh.tolerance, bool(settings.mesh.every))
        self._resumed = state is not None
        self._accuracy = Accuracy(np.nan)  # of the end of the last step
        self.start = start or (self.state.system, self.state.x, self.state.tangent)
        self._handed: Handed | None = None  # the next step, where a kernel has made it
        self._adapted = -1  # regular points at which the mesh was looked at last
        self._lane_for: object = None
        self._known_lane: Lane | None = None

    @property
    def settings(self) -> Settings:
        """The settings of the steps from here on."""
        return self._steps.settings

    @settings.setter
    def settings(self, settings: Settings) -> None:
        self._steps = dataclasses.replace(self._steps, settings=settings)
        self._meshes = dataclasses.replace(self._meshes, steps=self._steps)

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

    @property
    def notes(self) -> list[str]:
        """What was seen and not understood, and what a reader should know: sentences."""
        return self._notes.texts

    def __repr__(self) -> str:
        return f"Continuation({self.state!r}; {self.stop or 'not ended'})"

    def _first(self, system: Discretization, x: Array, tangent: Array | None, singular: bool) -> State:
        if tangent is None:
            return corrected_first(system, x, self.settings, self.primary)
        return on_branch(system, x, tangent, self.settings, singular)

    # --- the loop ------------------------------------------------------------------------------------------------

    def __iter__(self) -> Iterator[Point]:
        if not self._resumed:
            trial = self._here()
            first = SpecialPoint(0.0, "BP" if self.state.singular else "EP", "start", trial)
            located = located_again(dataclasses.replace(first, label=trial.system.judged(first).label), self.settings)
            self._notes.corners(trial)
            yield self._point(located, self.state, accuracy=at_branch_point(trial) if self.state.singular else None)
            self.stop = begins_outside(trial, self.settings, self._own, self.state.singular)
        while self.stop is None:
            yield from self._plain()
            yield from self._advance()

    def _plain(self) -> Iterator[Point]:
        """Make plain steps, many at a time, up to the first that wants a closer look; yield their points."""
        most = FEWEST
        while True:
            due, state = self._adapt(), self.state
            lane = None if state.singular else self._lane
            if lane is None:
                return
            most = min(most, due, self.settings.max_points - 1 - state.accepted)  # the last one has a label
            block = lane.steps(state, max(most, 0), self._here())
            for self._state, point in block.points():
                self._end, self._accuracy = None, Accuracy(point.discretization_error)
                yield point
            if block.made < most or most <= 0:
                self._handed = block.handed
                return
            most = min(2 * most, MOST)

    @property
    def _lane(self) -> Lane | None:
        """The lane of plain steps, made anew where what it depends on has changed; None where there is none."""
        system, settings, noisy = depends = self.state.system, self.settings, self._notes.is_noisy
        if self._lane_for != depends:
            self._lane_for = depends
            if self._known_lane is None or not self._known_lane.serves(system, settings, noisy):
                self._known_lane = lane_of(system, settings, self.start, self._tests, self._own, noisy)
        return self._known_lane

    def _adapt(self) -> int:
        """Adapt the mesh, or borders, if that is due; return after how many steps the mesh is due again."""
        state, control = self.state, self.settings.mesh
        every = control.every if state.system.intervals else 1  # without a mesh it is borders that are renewed, at no cost
        if every and state.accepted % every == 0 and self._adapted != state.accepted:
            self._go_on(self._meshes.adapted(state, self._here))
            self._adapted = state.accepted
        return every - state.accepted % every if every and state.system.intervals else MOST

    def predicted(self, step: float) -> Array:
        """Return the guess (shape (size,), of ``state.system``) from which the corrector starts at a distance ``step``."""
        return predict(self.state, step)

    def _here(self) -> Trial:
        """Return the state's point, as the step before left it, so that both decide from the same values."""
        if self._end is None:
            self._end = Trial(self.state.system, self.state.x, Linearization(self.state.tangent, self.state.sign))
        return self._end

    def _go_on(self, moved: Moved | None) -> bool:
        """Let the run go on from a state on another mesh, if there is one."""
        if moved is not None:
            self.state, self._end = moved
        return moved is not None

    def _advance(self) -> Iterator[Point]:
        """Make one step: yield the labelled points inside it, then the point at its end."""
        self._adapt()
        try:
            step = self._step(self.state)
        except ConvergenceError as error:
            here, first = self._here(), Trial(*self.start[:2], Linearization(self.start[2], np.nan))
            failed = met(self._ends, here, first) or no_convergence(self.state, self.settings, error)
            stop = self.state.system.explained(failed, here)
            if stop.reason == Reason.NO_CONVERGENCE and self._takes_shorter_steps():
                return
            self.stop = stop
            label, name = ("EP", stop.event) if stop.event else ("MX", "no convergence")
            yield self._point(SpecialPoint(0.0, label, name, here), self.state, accuracy=self._accuracy)
            return
        self._accuracy = accuracy_of(step.end)
        segment, special = step.segment, [step.segment.trial.system.judged(point) for point in step.special]
        special = within_limits(segment, special, self._limits)
        end = next((number for number, point in enumerate(special) if point.stop is not None), len(special))
        found = [located_again(point, self.settings) for point in special[: end + 1]]
        found = [point for point in found if is_confirmed(point, segment, self._notes)]
        changes = index_changes(self._index, segment, found, self._notes)
        if end == len(special):
            self._notes.doubts(self._index, segment, found, step.doubt if len(found) == len(special) else "")
        for point, change in zip(found, changes):
            if point.stop is not None:
                self.stop = point.trial.system.explained(point.stop, point.trial)
                point = with_details(point, self.stop)
            yield self._point(point, segment.state, change)
            if self.stop is not None:
                return
        self._go_on((self._steps.accepted(segment, step.judgement, step.turns), step.end))
        self._notes.corners(step.end)
        self._notes.noise(segment, max(self.settings.newton.tolerance, NOISY))
        if self.state.accepted >= self.settings.max_points:
            self.stop = Stop(Reason.MAX_POINTS, f"max_points = {self.settings.max_points} reached", "raise it to go on")
        elif self._steps.fold is not None and self.state.accepted == _STANDING and not self.state.sense:
            self.stop = segment.trial.system.standstill(segment.trial, self.primary)
            if self.stop is None and not segment.trial.system.intervals:
                place = f"{self.primary} stays at {segment.trial[self.primary]:.10g}, as far as can be told"
                self._notes.add(f"{place}: a vertical family, as of a linear or conservative system; folds are not told there")
        label, name = ("EP", str(self.stop.reason)) if self.stop else ("", "")
        found_at_end = located_again(SpecialPoint(segment.step, label, name, step.end), self.settings)
        yield self._point(found_at_end, segment.state, accuracy=self._accuracy)

    def _takes_shorter_steps(self) -> bool:
        """Take steps below the default ``min_step`` from here on, if the run goes on with them; say so."""
        shorter = shorter_steps(self.state, self.settings)
        if shorter is None:
            return False
        here, least = self._here()[self.primary], exact_text(self.settings.min_step)
        self._notes.add(f"from {self.primary} = {here:.10g} on, steps below {least} are taken: the branch bends sharply there")
        self.settings = dataclasses.replace(self.settings, min_step=shorter)
        return True

    # --- one step ------------------------------------------------------------------------------------------------

    def _attempt(self, step: float, made: Trial | None) -> tuple[Segment, Judgement]:
        """Make a step of a given length whose end has an error within the tolerance of the mesh, as far as finer ones help.

        The mesh is adapted to the end of a step that is not good enough, and the step is made again from the same point, before
        it is looked at closely: that takes longer than to make it. ``made`` is its end, where a kernel has it.
        """
        segment, judgement = self._steps.attempt(self.state, self._here(), step, made)
        accuracy, control = accuracy_of(segment.trial.settled), self.settings.mesh
        for _ in range(_ATTEMPTS):
            end, known = segment.trial.settled, (self.state, self._end)
            if not is_poor(accuracy, control) or self._ends_inside(segment):
                break
            if unsettled(end, control.tolerance, self.primary):
                break  # finer meshes are no help
            other = finer(end.system, end.x, accuracy.error, control)
            if other is None or not self._go_on(self._meshes.moved(self.state, self._here, other)):
                break
            again, judged_again = self._steps.attempt(self.state, self._here(), step)
            better = accuracy_of(again.trial.settled)
            if not better.error < _HELPS * accuracy.error:
                self.state, self._end = known
                break
            segment, judgement, accuracy = again, judged_again, better
        return segment, judgement

    def _moved_past(self, trial: Trial) -> str:
        """Return a clause if special points lie between a point and the same one with other mesh points; "" otherwise."""
        end = trial.settled
        if end is trial:
            return ""
        same = end.sign == trial.sign and self._steps.sense(end) * self._steps.sense(trial) >= 0
        same = same and all(np.sign(trial.value(test)) == np.sign(end.value(test)) for test in self._meshes.tests)
        return "" if same else "a special point moves out of the step with the places where conditions on states switch"

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

    def _step(self, state: State) -> Step:
        """Predict and correct, halving the step until the corrected point can be believed."""
        settings, (step, made), self._handed = self.settings, self._handed or (0.0, None), None
        if made is None or made.system is not state.system:  # the mesh may have changed meanwhile
            step, made = up_to_limits(state, settings.limits, settings.min_step), None
        finest = max(settings.min_step, _FINEST * step)
        while True:
            try:
                segment, judgement = self._attempt(step, made)
                inspection = Inspection(segment, settings, self.start, self._steps.fold)
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
            step, made = step / 2, None
            if step < settings.min_step:
                raise problem

    def _contradiction(self, segment: Segment, inspection: Inspection) -> str:
        """Return how the change of index over a step contradicts its special points; "" if not."""
        if not contradiction(self._index, segment, ()):
            return ""  # without special points, which take time
        return contradiction(self._index, segment, inspection.special_points(self._tests))

    # --- results -------------------------------------------------------------------------------------------------

    def _point(
        self, found: SpecialPoint, state: State, change: IndexChange | None = None, accuracy: Accuracy | None = None
    ) -> Point:
        """Return the point of a branch; its accuracy is estimated where it is not known."""
        trial, system = found.trial, found.trial.system
        parameters = dict(zip(system.problem.parameters, map(float, system.all_parameters(trial.x))))
        if accuracy is None and not found.closes and np.isfinite(trial.tangent).all():
            accuracy = accuracy_of(trial)
        elif accuracy is None:  # at a branch point the equations are singular; the end of the step is on no finer mesh
            accuracy = self._accuracy
        stability = Stability()
        if self._index is not None:
            stability = system.stability(found)
        if found.label:
            self._notes.phases(found, accuracy.error)
        return Point(
            found.label, found.full_name, parameters, trial.functionals, trial.x, trial.tangent, system,
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
