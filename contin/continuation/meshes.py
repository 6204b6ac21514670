"""The mesh of a run: the error of a point, a finer mesh where it is too large, a coarser one where it is small."""

from __future__ import annotations

import dataclasses
import functools
import math
from collections.abc import Callable, Sequence
from typing import Any, Protocol

import numpy as np

from contin.arrays import Array
from contin.collocation.mesh import MeshControl
from contin.continuation.points import unsettled
from contin.continuation.rules import Judgement
from contin.continuation.scaling import outgrown
from contin.continuation.steps import Steps
from contin.core.newton import correct
from contin.core.protocol import Carrier, Discretization, inner
from contin.core.step import State, trial_of
from contin.core.trial import Event, Trial, linearization
from contin.draws import generator
from contin.errors import ConvergenceError
from contin.events.arc import Arc
from contin.events.inspection import jumped
from contin.levels import CERTAIN, LOCATED


class _Bordered:
    """Factors of [[F_x, c], [row, 0], [r, 0]] at a simple branch point, for right-hand sides of [F_x; row]."""

    def __init__(self, trial: Trial) -> None:
        system, random = trial.system, generator("accuracy")
        self._size = system.size
        rows = np.zeros((2, system.size + 1))
        rows[0, :-1] = system.weights * trial.tangent
        rows[1, :-1] = system.weights * random.standard_normal(system.size)
        column = random.standard_normal((1, system.equations)) / np.sqrt(system.equations)
        self._factors = system.linearize(trial.x, rows, column)[1]

    def solve(self, b: Array) -> Array:
        """Return the unknowns."""
        return self._factors.solve(np.append(b, 0.0))[: self._size]


def error_at_branch_point(trial: Trial) -> float:
    """Return the estimated error of a branch point from which a run starts, without the part in the kernel of F_x.

    A cycle of no size, as that at a Hopf point, is the same on every mesh.
    """
    system = trial.system
    if not system.intervals or (system.size_of_solutions is not None and not np.ptp(system.states(trial.x), axis=0).any()):
        return 0.0
    factors: Any = _Bordered(trial)
    return system.discretization_error(trial.x, factors, trial)


#: A finer mesh stays if it makes the error smaller than this part of it. Where it does not, as at round-off or at a jump of the
#: equations inside an interval, meshes would grow without end.
_HELPS = 0.5
#: Times that a step is made on finer and finer meshes.
ATTEMPTS = 4
#: Part of the tolerance that a finer mesh aims at. Ten times larger, the points after it exceed the tolerance again, and more
#: steps are made twice on the bank of reference problems. Ten times smaller takes 18 % more intervals of degree 7.
_MARGIN = 0.1
#: Factor by which the number of intervals grows at most at a time: where the error is large, its estimate is no guide to how
#: many are needed.
_GROWTH = 4
#: Part of the tolerance below which an error may be round-off: at the usual tolerance it is some 1e-14.
_FAR_BELOW = 0.03
#: Intervals, as a multiple of those that the density asks for, that may make round-off larger: 25 before a Hopf point behind
#: canards. Ten times smaller, meshes before explosions become coarser, where errors of the mesh are taken for round-off.
_FAR_TOO_MANY = 4

#: A state, and its point with what is known of it beyond the state.
Moved = tuple[State, Trial | None]


def is_poor(trial: Trial, control: MeshControl) -> bool:
    """Return whether a point has a larger error than the tolerance of the mesh, which a finer one would lower."""
    is_above = bool(control.every) and trial.discretization_error > control.tolerance
    return is_above and trial.system.intervals < control.max_intervals and not _is_round_off(trial)


def _is_round_off(trial: Trial) -> bool:
    """Return whether a finer mesh would not make the error of a point smaller."""
    return trial.discretization_error <= CERTAIN * trial.system.newton_error(trial.x, trial.factors)


def finer(system: Discretization, x: Array, error: float, control: MeshControl) -> tuple[Discretization, Carrier] | None:
    """Return the system on a finer mesh that is adapted to x, as fine as the error takes; None if it may not be finer."""
    count = min(max(_intervals_for(system, error, control), system.intervals + 1), control.max_intervals)
    if count <= system.intervals:
        return None
    return system.adapted(x, dataclasses.replace(control, min_intervals=count, max_intervals=count))


def _intervals_for(system: Discretization, error: float, control: MeshControl) -> int:
    """Return the number of intervals with which a point of this error, of the order h^(2 d), is within the tolerance."""
    order = 2 * max(system.degree, 1)
    factor = min(float(error / (_MARGIN * control.tolerance)) ** (1 / order), _GROWTH)
    return int(math.ceil(system.intervals * factor))


@functools.lru_cache(maxsize=64)
def _with_fewest(control: MeshControl, count: int) -> MeshControl:
    """Return the same with another least number of intervals."""
    return dataclasses.replace(control, min_intervals=count)


class Place(Protocol):
    """Where a run is: what a step begins from, which may move to another mesh."""

    state: State

    def here(self) -> Trial:
        """Return the state's point."""

    def go_on(self, moved: Moved | None) -> bool:
        """Let the run go on from a state on another mesh, if there is one."""

    def ends_inside(self, arc: Arc) -> bool:
        """Return whether the run ends inside a step, at a place whose end is not accepted."""


@dataclasses.dataclass(frozen=True)
class MeshPolicy:
    """When a run changes its mesh, and whether it goes on from there.

    - ``steps`` (Steps): How the steps of the run are made, with its settings.
    - ``tests`` (sequence of Event): Those that have the same sign on every mesh.
    - ``own`` (sequence of Event): Those of the kind of problem.
    """

    steps: Steps
    tests: Sequence[Event]
    own: Sequence[Event]

    def adapted(self, state: State, here: Callable[[], Trial]) -> Moved | None:
        """Return the state on a mesh that is adapted to it, if one serves; ``here`` returns the state's point."""
        control = self.steps.settings.mesh
        if state.singular:
            return None
        fewest = self._fewest_intervals(state, here)
        half = max(control.min_intervals, state.system.intervals // 2)
        for count in (half, fewest) if self._is_too_fine(state, here) else (fewest,):
            wanted = control if count == control.min_intervals else _with_fewest(control, count)
            other = outgrown(state.system, state.x, state.system.adapted(state.x, wanted))
            moved = None if other is None else self.moved(state, here, other)
            if moved is not None:
                return moved
        return None

    def moved(self, state: State, here: Callable[[], Trial], other: tuple[Discretization, Carrier]) -> Moved | None:
        """Return the state on another mesh, or with other sizes, corrected there; None where the run does not go on from there.

        It does not where the point is not found there, where a special point would fall between the meshes, or where a mesh of
        fewer intervals is not good enough.
        """
        newton, (system, carry) = self.steps.settings.newton, other
        moved = state.carried(system, carry)
        length = float(np.sqrt(inner(system, moved.tangent, moved.tangent)))
        moved = dataclasses.replace(moved, tangent=moved.tangent / length)
        if system.scales is not state.system.scales:
            step = float(np.clip(state.step * length, self.steps.settings.min_step, self.steps.settings.max_step))
            moved = dataclasses.replace(moved, previous_tangent=None, step=step)
        x, row = moved.x, moved.row
        if state.singular:  # a corrected point has a tangent of any of the branches; the first step corrects what is carried
            return moved, None
        try:
            if carry is np.array and system.holds(x, newton.tolerance):  # the mesh stays: x is the same point, not only near it
                end = Trial(system, x, linearization(system, x, row))
                return dataclasses.replace(moved, tangent=end.tangent, sign=end.sign), end
            done = correct(system, x, row, row @ x, newton, within=np.inf)
            end = trial_of(system, dataclasses.replace(done, iterations=0, error=0.0), row)
            system.check_jumps(end.x, state, False)
        except ConvergenceError:
            return None  # the old mesh still serves; the step control will notice if it does not
        before, name, coarser = here(), self.steps.settings.trivial, system.intervals < state.system.intervals
        if system.collapsed(x, done.x) or self.steps.reverses(before, end) or (coarser and not self._serves(state, end)):
            return None
        if any(np.sign(before.value(test)) != np.sign(end.value(test)) for test in self.tests):
            return None  # the next point will do as well
        if name is not None and jumped(before, end, name, newton):
            return None
        return dataclasses.replace(moved, x=end.x, tangent=end.tangent, sign=end.sign), end

    def good_step(self, run: Place, arc: Arc, judgement: Judgement) -> tuple[Arc, Judgement]:
        """Make a step again until its end has an error within the tolerance of the mesh, as far as finer ones help.

        The mesh is adapted to the end of a step that is not good enough, and the step is made again from the same point, before
        it is looked at closely: that takes longer than to make it. Raises ConvergenceError.
        """
        control, step = self.steps.settings.mesh, arc.step
        for _ in range(ATTEMPTS):
            end, known = arc.trial.settled, (run.state, run.here())
            if not is_poor(end, control) or run.ends_inside(arc) or unsettled(end, control.tolerance, self.steps.primary):
                break
            there = run.state if end.system.outcomes.size else end  # the state has other crossings than the end
            other = finer(there.system, there.x, end.discretization_error, control)
            if other is not None and not end.system.outcomes.size:
                mesh = other[0]  # it has points where the end meets corners; the state has others
                mesh = (mesh.on_switches(run.state.system.carrier(mesh)(run.state.x)) or other)[0]
                other = mesh, run.state.system.carrier(mesh)
            if other is None or not run.go_on(self.moved(run.state, run.here, other)):
                break
            near = end.system.carrier(run.state.system)(end.x)
            again, judged_again = self.steps.attempt(run.state, run.here(), step, near=near)
            if not again.trial.settled.discretization_error < _HELPS * end.discretization_error:
                run.go_on(known)
                break
            arc, judgement = again, judged_again
        return arc, judgement

    def ends_finer(self, arc: Arc, judgement: Judgement) -> bool:
        """Move the end of a plain step to a finer mesh, half the work of making it again; return whether that will do."""
        state, control = self.steps.accepted(arc, judgement, False), self.steps.settings.mesh
        end = best = arc.trial
        hangs = any(not (test.asks or test.still) for test in self.own)  # those of connections differ from mesh to mesh
        if hangs or end.system.outcomes.size or unsettled(end, control.tolerance, self.steps.primary):
            return False
        while is_poor(best, control):
            other = finer(state.system, state.x, best.discretization_error, control)
            moved = None if other is None else self.moved(state, lambda: end, other)
            if moved is None or (found := moved[1]) is None or found.sign != end.sign:
                return False
            if not found.discretization_error < _HELPS * best.discretization_error:
                break
            passes = any(test.passed(end.value(test), found.value(test)) for test in self.own)
            if passes or self.steps.sense(end) != self.steps.sense(found):
                return False  # a special point lies between both meshes
            state, best = moved[0], found
        if best is not end and state.previous_tangent is not None:
            best.refactor(state.system.weights * state.previous_tangent)  # as a run that goes on from its file has them
        end.settled = best
        return True

    def _fewest_intervals(self, state: State, here: Callable[[], Trial]) -> int:
        """Return the fewest intervals that keep the state's error within the tolerance, however few the density asks for.

        An error far below the tolerance may be round-off, which does not grow on coarser meshes: half of the intervals may do.
        What Newton's method leaves on a path does not grow there, either. Connections keep their meshes then: inclination flips
        depend on the mesh more than orbits do.
        """
        control, now, error = self.steps.settings.mesh, state.system.intervals, state.discretization_error
        if math.isnan(error) or not now:
            return control.min_intervals
        far_below = error < _FAR_BELOW * control.tolerance
        if not far_below and now > _FAR_TOO_MANY * control.min_intervals and self.steps.settings.newton.tolerance > LOCATED:
            far_below = state.system.size_of_solutions is not None and _is_round_off(here())
        count = now // 2 if far_below else min(_intervals_for(state.system, error, control), now)
        return max(control.min_intervals, min(count, control.max_intervals))

    def _serves(self, state: State, end: Trial) -> bool:
        """Return whether the state's point is as good on a mesh of fewer intervals as it should be, or as it was.

        Round-off does not grow there. Where canards amplify it, they amplify errors of the mesh, too, and these do.
        """
        before, control = state.discretization_error, self.steps.settings.mesh
        return not is_poor(end, control) and not (before > control.tolerance and end.discretization_error > before)

    def _is_too_fine(self, state: State, here: Callable[[], Trial]) -> bool:
        """Return whether the error is round-off above the tolerance, on far more intervals than the density asks for.

        Half of them may do then: short intervals make it larger, as where cycles shrink after canards. Where the parameter
        stands still, in an explosion, errors of the mesh are taken for round-off.
        """
        control, now = self.steps.settings.mesh, state.system.intervals
        far = state.discretization_error > control.tolerance and control.min_intervals * _FAR_TOO_MANY <= now
        wanted = state.system.adapted(state.x, control) if far else None
        far = wanted is not None and wanted[0].intervals * _FAR_TOO_MANY <= now
        return far and _is_round_off(here()) and bool(self.steps.sense(here()))
