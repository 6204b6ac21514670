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

import contextlib
import dataclasses
from collections.abc import Callable, Iterator

import numpy as np

from contin.arrays import Array
from contin.boundary.grazing import Touch
from contin.continuation.failure import ended, limit_neared, met, no_convergence, runs_away, shorter_steps
from contin.continuation.first import begins_outside, corrected_first, frozen, on_branch
from contin.continuation.lane import FEWEST, MOST, Handed, Lanes
from contin.continuation.meshes import MeshPolicy, Moved, error_at_branch_point, is_poor
from contin.continuation.points import IndexChange, Notes, begun_at, index_changes, is_confirmed, located_again, told, unsettled
from contin.continuation.rules import JUMPS, NOISY, judged, length_of_step, predict
from contin.continuation.steps import Step, Steps
from contin.core.labels import Label
from contin.core.newton import correct
from contin.core.protocol import Discretization
from contin.core.settings import Settings, check
from contin.core.small import FAILED
from contin.core.step import CLEAR, Reason, State, Stop, settled, trial_of
from contin.core.trial import Linearization, Trial
from contin.errors import ConvergenceError, Grazing
from contin.events.arc import Arc, SpecialPoint
from contin.events.corner import Way, changed_between, conditions, corner_at, hit_of, on_mesh_of, refrozen
from contin.events.folds import STILL
from contin.events.inspection import Start
from contin.events.usual import extremum, fold, limits, user_zeros, within_limits
from contin.events.watch import Watch
from contin.levels import APART, ROUGH
from contin.results.point import Point
from contin.text import exact_text


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
    origin : Point, optional
        The labelled branch point that x is: its errors are known.

    Raises
    ------
    ProblemError
        Names or numbers that do not fit the problem.
    ConvergenceError
        The first point cannot be corrected.

    Examples
    --------
    >>> from contin import AlgebraicProblem
    >>> from contin.lowlevel import Algebraic
    >>> parabola = AlgebraicProblem(lambda u, p: (p.a - u.x**2,), ["x"], {"a": 1.0})
    >>> run = Continuation(Algebraic(parabola, ["a"]), np.array([1.0, 1.0]), Settings(direction=-1, limits={"a": (-1, 4)}))
    >>> print([point.label for point in run if point.label], run.stop)
    ['EP', 'LP', 'EP'] reached a = 4
    """

    def __init__(
        self, system: Discretization, x: Array, settings: Settings = Settings(), tangent: Array | None = None,
        state: State | None = None, start: Start | None = None, singular: bool = True, origin: Point | None = None,
    ) -> None:  # fmt: skip
        self.stop: Stop | None = None
        self._end: Trial | None = None  # the state's point, with what is known of it beyond the state
        check(system, settings)
        self.primary = settings.primary or system.free[0]
        self._settings, self._path = settings, settings.on_path(system if state is None else state.system)
        self._steps = Steps(self._path, self.primary, fold(self.primary) if settings.folds else None)
        self._state: State | Callable[[], State] = state or self._first(system, np.asarray(x, dtype=float), tangent, singular)
        self._conditions = conditions(self.state.system)
        if self._conditions:
            self.state = frozen(self.state)
        self._curved = self.state.system.on_curve
        self._own = [test for test in self.state.system.events() if test.unless not in settings.limits]
        self._limits = limits(settings.limits)
        general = [*user_zeros(settings.zeros), *self._limits, *map(extremum, settings.extrema), *settings.events]
        self._tests = [*general, *self._conditions, *self._own]
        self._meshes = MeshPolicy(self._steps, general, [*self._conditions, *self._own])
        self._notes = Notes(self.primary, self._path.mesh.tolerance, bool(settings.mesh.every))
        if conserved := getattr(system.solution.problem, "conserved", ""):
            self._notes.add(conserved)
        if state is not None and state.previous_tangent is not None:
            self.here().refactor(state.system.weights * state.previous_tangent)  # as the step before left them
        self._resumed = state is not None
        self._error = np.nan  # of the mesh, at the end of the last step
        self.start = start or (self.state.system, self.state.x, self.state.tangent)
        self._watch = Watch(self.start, self._path, self._tests, general, self._steps.fold)
        if state is None:
            self._notes.check_phases(self.here())
        self._origin = origin
        self._handed: Handed | None = None  # the next step, where a kernel has made it
        self._left: list[tuple[float, Array]] = []  # corners: the arclength, and the place with the tangent of the way on
        self._adapted = -1  # regular points at which the mesh was looked at last
        self._lanes = Lanes(self.start, self._tests, [*self._conditions, *self._own])

    @property
    def settings(self) -> Settings:
        """The settings of the run from here on."""
        return self._settings

    @settings.setter
    def settings(self, settings: Settings) -> None:
        self._settings, self._path = settings, settings.on_path(self.state.system)
        self._follow()

    def _follow(self) -> None:
        """Make steps with the tolerance of the path, and exact ones where those cannot tell the primary's sense."""
        state, settings = self.state, self._settings
        if self._steps.fold is None or not STILL < abs(state.tangent[state.system.parameter_index(self.primary)]) < CLEAR:
            settings = self._path
        if settings is not self._steps.settings:
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
            trial = self.here()
            first = SpecialPoint(0.0, Label.BRANCH_POINT if self.state.singular else Label.END, "start", trial)
            first = dataclasses.replace(first, label=trial.system.judged(first).label)
            located = located_again(begun_at(self._origin, first), self.settings)
            self._notes.corners(trial)
            self._notes.contacts(trial)
            yield self._point(located, self.state, error=error_at_branch_point(trial) if self.state.singular else None)
            self.stop = begins_outside(trial, self.settings, self._own, self.state.singular)
        while self.stop is None:
            self._follow()
            yield from self._plain()
            yield from self._advance()

    def _plain(self) -> Iterator[Point]:
        """Make plain steps, many at a time, up to the first that wants a closer look; yield their points."""
        most = FEWEST
        while True:
            due, state = self._adapt(), self.state
            lane = None if state.singular else self._lanes.of(state.system, self._steps.settings, self._notes.is_noisy)
            if lane is None or runs_away(state.system, state.x, *self.start[:2]):
                return
            if limit_neared(state, self.settings, self.start[0]):
                return
            most = min(most, due, self.settings.max_points - 1 - state.accepted)  # the last one has a label
            block = lane.steps(state, max(most, 0), self.here())
            for self._state, point in block.points():
                self._end, self._error = None, point.discretization_error
                yield point
            if block.made < most or most <= 0:
                self._handed = block.handed
                if block.handed is not None and (self._end is None or self._end.factors is None):
                    self._end = block.handed[1]
                return
            most = min(2 * most, MOST)

    def _adapt(self) -> int:
        """Adapt the mesh, or borders, if that is due; return after how many steps the mesh is due again."""
        state, control = self.state, self._steps.settings.mesh
        every = control.every if state.system.intervals else 1  # without a mesh it is borders that are renewed, at no cost
        if every and state.accepted % every == 0 and self._adapted != state.accepted:
            self.go_on(self._meshes.adapted(state, self.here))
            self._adapted = state.accepted
        return every - state.accepted % every if every and state.system.intervals else MOST

    def predicted(self, step: float) -> Array:
        """Return the guess (shape (size,), of ``state.system``) from which the corrector starts at a distance ``step``."""
        return predict(self.state, step)

    def here(self) -> Trial:
        """Return the state's point, as the step before left it, so that both decide from the same values."""
        if self._end is None:
            self._end = Trial(self.state.system, self.state.x, Linearization(self.state.tangent, self.state.sign))
        return self._end

    def go_on(self, moved: Moved | None) -> bool:
        """Let the run go on from a state on another mesh, if there is one."""
        if moved is not None:
            self.state, self._end = moved
        return moved is not None

    def ends_inside(self, arc: Arc) -> bool:
        """Return whether the run ends inside a step, and not at a limit: the point at its end is not accepted."""
        return self._watch.ends_inside(arc)

    def _advance(self) -> Iterator[Point]:
        """Make one step: yield the labelled points inside it, then the point at its end."""
        self._adapt()
        try:
            step = self._step(self.state)
        except ConvergenceError as error:
            yield from self._without_step(error)
            return
        if isinstance(step, SpecialPoint):
            self.stop = step.stop
            yield self._point(located_again(step, self.settings), self.state, error=self._error)
            return
        self._error = step.end.discretization_error
        arc, special = step.arc, [step.arc.trial.system.judged(point) for point in step.special]
        special = within_limits(arc, special, self._limits)
        found = list[SpecialPoint]()
        while len(found) < len(special) and not (found and found[-1].stop):
            found.append(located_again(special[len(found)], self.settings))
        goes_on = not (found and found[-1].stop)
        found = [point for point in found if is_confirmed(point, arc, self._notes)]
        last = self._left[-1][0] - arc.state.arclength if self._left else -np.inf  # a corner tells of branches there, too
        corner = next((point.at for point in found if point.test in self._conditions), last)
        found = [point for point in found if point.label != Label.BRANCH_POINT or abs(point.at - corner) > APART * arc.step]
        changes = index_changes(self._watch.index, arc, found, self._notes)
        if goes_on:
            self._notes.doubts(self._watch.index, arc, found, step.doubt if len(found) == len(special) else "")
        for point, change in zip(found, changes):
            if point.test in self._conditions:
                yield from self._turn(point, arc)
                return
            behind = None
            if isinstance(point.details, Touch):
                point, behind = self._grazed(point, arc, any(each.label == Label.FOLD for each in found))
            if point.stop is not None:
                self.stop = point.trial.system.explained(point.stop, point.trial)
                if self.stop.details and isinstance(point.details, (dict, type(None))):  # no details of another kind
                    point = dataclasses.replace(point, details={**(point.details or {}), **self.stop.details})
            if point.label != Label.BRANCH_POINT or not self._notes.phases(point, self._error):
                yield self._point(point, arc.state, change)
            if self.go_on(None if behind is None else (behind, None)) or self.stop is not None:
                return
        accepted = self._steps.accepted(arc, step.judgement, step.turns)
        bends = any(isinstance(point.details, Touch) for point in found)  # how it bends before tells nothing of behind
        self.go_on((dataclasses.replace(accepted, previous_tangent=None) if bends else accepted, step.end))
        if any(step.end.value(test) >= 0 for test in self._conditions):  # the equations are the same beyond
            self.state = dataclasses.replace(self.state, system=refrozen(step.end))
        for name in changed_between(arc.before, arc.trial) if self._curved else ():
            self._notes.inside(f"the curve passes a corner: {name} changes", arc)
        other = self.state.system.crossed(self.state.x)[0]  # corners, which come and go where they do not matter
        if other is not self.state.system:
            self.go_on(self._meshes.moved(self.state, self.here, (other, self.state.system.carrier(other))))
        self._notes.corners(step.end)
        self._notes.noise(arc, max(self._steps.settings.newton.tolerance, NOISY))
        self.stop = ended(arc.trial, self.state, self.settings, self.primary, self._notes, self.start[:2])
        label, name = (Label.END, str(self.stop.reason)) if self.stop else (Label.REGULAR, "")
        found_at_end = located_again(SpecialPoint(arc.step, label, name, step.end), self.settings)
        yield self._point(found_at_end, arc.state, error=self._error)

    def _without_step(self, error: ConvergenceError) -> Iterator[Point]:
        """Yield the point at which no step was possible and end there, unless shorter steps are left to try."""
        here, first = self.here(), Trial(*self.start[:2], Linearization(self.start[2], np.nan))
        stop: Stop = met(self._watch.ends, here, first) or no_convergence(self.state, self._steps.settings, error)
        grazes = isinstance(error, Grazing)
        stop = self.state.system.explained(Stop(Reason.EVENT, str(error), event="grazing") if grazes else stop, here)
        if stop.reason == Reason.NO_CONVERGENCE and self._takes_shorter_steps():
            return
        self.stop = stop
        label = Label.FAILED if not stop.event else Label.GRAZING if grazes else Label.END
        failure = SpecialPoint(0.0, label, stop.event or "no convergence", here, is_located=not grazes)  # within a step
        yield self._point(failure, self.state, error=self._error)

    def _turn(self, point: SpecialPoint, arc: Arc) -> Iterator[Point]:
        """Go on behind a corner, and yield it: a run that is resumed there does not come to it again."""
        assert point.test is not None
        state, settings, came = arc.state, self.settings, point.trial.tangent
        came = came if np.isfinite(came).all() else state.tangent
        hit = hit_of(point.test, point.trial)
        corner, ways = corner_at(point, came, hit, self.primary)
        shown = settings.corners or hit not in state.system.knots
        corner = corner if corner and (shown or corner.details.kind != "goes on") else None
        if corner is not None and not ways:
            self.stop = Stop(Reason.EVENT, f"met a corner, {corner.name}", event=corner.name)
        if ways:
            at, accepted = corner or point, state.accepted + (corner is not None)
            behind = on_branch(*on_mesh_of(state.system, ways[0], at.trial.x, hit), settings, False)
            length, step = state.arclength + at.at, min(state.step, settings.step) if corner else state.step
            self.go_on((dataclasses.replace(behind, arclength=length, step=step, accepted=accepted), None))
            left = np.concatenate([at.trial.x, ways[0].tangent])
            if any(np.abs(left - known).max() < APART for _, known in self._left if known.size == left.size):
                self.stop = Stop(Reason.KNOWN_BRANCH, "the run comes back to a corner, and the way on is known")
            elif accepted >= settings.max_points:
                self.stop = ended(at.trial, self.state, settings, self.primary, self._notes, self.start[:2])
            self._left.append((length, left))
        if corner is not None:
            yield self._point(corner, state, self._index_across(corner, ways), self._error)

    def _grazed(self, point: SpecialPoint, arc: Arc, turned: bool) -> tuple[SpecialPoint, State | None]:
        """Return a grazing point, as a fold where the parameter turns, and the state behind it if the step's end is none.

        It is none where the branch bends too much there: switches lie inside intervals of its mesh.
        """
        behind: State | None = None
        touch: Touch = point.details
        if point.at >= arc.step or unsettled(arc.trial.settled, self.settings.mesh.tolerance, self.primary):
            with contextlib.suppress(ConvergenceError):
                behind = on_branch(*touch.beyond(point.trial, self.settings.newton), settings=self.settings, singular=False)
                length, accepted = arc.state.arclength + point.at, arc.state.accepted + 1
                behind = dataclasses.replace(behind, arclength=length, accepted=accepted)
        if touch.jumps and behind is None:
            told = f"met grazing: {touch.text}, where the equations jump"
            return dataclasses.replace(point, stop=Stop(Reason.EVENT, told, event="grazing")), None
        ends = arc.state.tangent, (behind or arc.trial.settled).tangent
        free = arc.state.system.free
        rates = [tangent[free.index(self.primary) - len(free)] for tangent in ends]
        details = dataclasses.replace(touch, folds=bool(rates[0] * rates[1] < 0 and not turned))
        return dataclasses.replace(point, name=details.text, details=details), behind

    def _index_across(self, corner: SpecialPoint, ways: list[Way]) -> IndexChange | None:
        """Return the index before and behind a corner: what contacts hold does not move."""
        if self._watch.index is None or not ways:
            return None
        both = corner.trial, Trial.without_tangent(ways[0].system, corner.trial.x)
        before, behind = (trial.value(self._watch.index) for trial in both)
        return None if np.isnan(before + behind) else (int(before), int(behind))

    def _takes_shorter_steps(self) -> bool:
        """Take steps below the default ``min_step`` from here on, if the run goes on with them; say so."""
        shorter = shorter_steps(self.state, self._steps.settings)
        if shorter is None:
            return False
        here, least = self.here()[self.primary], exact_text(self.settings.min_step)
        self._notes.add(f"from {self.primary} = {here:.10g} on, steps below {least} are taken: the branch bends sharply there")
        self.settings = dataclasses.replace(self.settings, min_step=shorter)
        return True

    # --- one step ------------------------------------------------------------------------------------------------

    def _step(self, state: State) -> Step | SpecialPoint:
        """Predict and correct, halving the step until the corrected point can be believed; or return the end of the branch."""
        settings, (step, _, made, plain), self._handed = self._steps.settings, self._handed or (0.0, None, None, False), None
        if made is None or made[0].system is not state.system:  # the mesh may have changed meanwhile
            step, made = length_of_step(self._steps.room(state)), None
        finest = max(settings.min_step, ROUGH * step)
        while True:
            try:
                arc, judgement = self._steps.attempt(self.state, self.here(), step, made)
                inspection, poor = self._watch.inspection(arc, plain and bool(made)), is_poor(arc.trial.settled, settings.mesh)
                asks = self._watch.asks(inspection)
                if poor and (asks or not self._meshes.ends_finer(arc, judgement)):
                    arc, judgement = self._meshes.good_step(self, arc, judgement)
                    asks = self._watch.asks(inspection := self._watch.inspection(arc))
                if not asks:
                    return Step(arc, judgement)
                doubt = self._watch.doubt(inspection)
                if step < 2 * finest or not doubt:
                    special = inspection.special_points  # where these cannot be found the step is halved
                    return Step(arc, judgement, special, bool(inspection.folds), doubt)
                problem = ConvergenceError(doubt)
            except ConvergenceError as error:
                problem = error
                if isinstance(error, Grazing) and self._went_round(step, error):
                    state, (step, made) = self.state, (length_of_step(self._steps.room(self.state)), None)
                    continue
                home: SpecialPoint | None = state.system.home_ahead(state, step)
                if home is not None and all(test.function(home.trial) <= 0 for test in self._limits):
                    found = home if home.stop is not None else self._up_to(home)
                    if found is not None:
                        return found
            step, made = step / 2, None
            if step < settings.min_step:
                raise problem

    def _up_to(self, point: SpecialPoint) -> Step | None:
        """Return the step from the state to a located point ahead, if it can be believed."""
        arc = Arc(self.state, (0.0, self.here()), point.trial, point.at, self.settings.newton)
        judgement = judged(self.state, self.predicted(point.at), point.trial, point.at, self.settings)
        inspection = self._watch.inspection(arc)
        if judgement.outcome in (FAILED, JUMPS):
            return None
        if point.details.jumps < 0:  # what the equations say has no limit there
            at = self.state.system.parameter_index(self.primary)
            turns = point.trial.tangent[at] * self.state.tangent[at] < 0
            return None if turns or any(map(arc.passes, self._meshes.tests)) else Step(arc, judgement, [point])
        if self._watch.doubt(inspection):
            return None
        others = [other for other in inspection.special_points if not isinstance(other.details, Touch)]
        return Step(arc, judgement, [*others, point], bool(inspection.folds))

    def _went_round(self, step: float, error: Grazing) -> bool:
        """Go on where a jump of the equations passes an end of the period in a step; return whether one did.

        No point is made. The crossing lies as far before one end as it has been behind the other, and moves on from there.
        """
        state, newton = self.state, self._steps.settings.newton
        if (other := state.system.round_end(state.x, error)) is None:
            return False
        system, carry = other
        x, tangent = carry(predict(state, step, self.settings)), carry(state.tangent)
        row = system.weights * tangent
        with contextlib.suppress(ConvergenceError):
            end = settled(trial_of(system, correct(system, x, row, row @ x, newton), row), tangent, newton).settled
            end.system.check_jumps(end.x, state)
            behind = on_branch(end.system, end.x, end.tangent, self.settings, False)
            kept = {name: getattr(state, name) for name in ("step", "accepted", "sense", "sensed")}
            return self.go_on((dataclasses.replace(behind, arclength=state.arclength + step, **kept), None))
        return False

    # --- results -------------------------------------------------------------------------------------------------

    def _point(self, found: SpecialPoint, state: State, change: IndexChange | None = None, error: float | None = None) -> Point:
        """Return the point of a branch; its error that is due to the mesh is estimated where it is not known."""
        trial = found.trial
        if error is None and not found.closes and np.isfinite(trial.tangent).all():
            error = trial.discretization_error
        elif error is None:  # at a branch point the equations are singular; the end of the step is on no finer mesh
            error = self._error
        if found.label != Label.BRANCH_POINT and found.label:  # branch points are asked before
            self._notes.phases(found, error)
        return told(found, state.arclength + found.at, self._watch.index, change, error)
