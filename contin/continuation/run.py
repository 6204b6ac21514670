"""Pseudo-arclength continuation: a run is an iterable of points over an explicit state.

    run = Continuation(system, x, settings)
    for point in run:
        ...
    print(run.stop)

One step is: predict, correct, judge (accept or halve), look for events between the two ends and locate them, accept,
refine the mesh. The loop knows of a system only its interface (residual, linearize, weights, adapt), not what it is.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Iterator, Mapping

import numpy as np

from contin.arrays import Array
from contin.detection.passages import calm, crossings, quotients
from contin.detection.refinement import refined
from contin.detection.segment import Segment, Start
from contin.detection.test_functions import fold, kind_monitors, limit, user_zero
from contin.discretization.protocol import Discretization, inner
from contin.errors import ConvergenceError, ProblemError
from contin.results.branch import Branch
from contin.results.point import Point
from contin.stepping.newton import correct
from contin.stepping.settings import Settings
from contin.stepping.state import State, Stop
from contin.stepping.step import corrected, hidden_turn, located, predict, sharpened, tangent_error, turn, unit_tangent
from contin.stepping.trial import Monitor, Trial, sign_changed

#: A step is cut down to this fraction of itself to take several branch points one by one, before they count as one.
_FINEST = 1e-3
#: A corrected point this many times further from its prediction than aimed at is not believed.
_ASTRAY = 2.5
#: A tangent's component with a larger estimated error than this, relative to itself, may have the wrong sign.
_DOUBT = 0.2
#: A component above this is never in doubt.
_STEEP = 0.3
#: Beside a branch point, events are looked for from this fraction of the first step on.
_ASIDE = 0.01
#: A start this far outside a limit (relative to 1 + its size) still lies on it.
_SLACK = 1e-9


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
    """

    def __init__(
        self,
        system: Discretization,
        x: Array,
        settings: Settings = Settings(),
        tangent: Array | None = None,
        state: State | None = None,
        start: Start | None = None,
    ) -> None:
        self.settings = settings
        self.stop: Stop | None = None
        self._end: Trial | None = None  # the state's point, with what is known of it beyond the state
        self._check(system)
        self.primary = settings.primary or system.free[0]
        self.state = state or self._first(system, np.asarray(x, dtype=float), tangent)
        self._fold = fold(self.primary) if settings.folds else None
        self._monitors = self._all_monitors()
        own = len(kind_monitors(self.state.system))  # of the system itself: their signs may differ between meshes
        self._comparable = [*self._monitors[: len(self._monitors) - own], *([self._fold] if self._fold else [])]
        self._resumed = state is not None
        self.start = start or (self.state.system, self.state.x, self.state.tangent)

    def _check(self, system: Discretization) -> None:
        if len(system.free) != system.problem.free_size:
            raise ProblemError(
                f"free parameters: {len(system.free)} given ({', '.join(system.free)}), a curve of this problem needs "
                f"{system.problem.free_size} (conditions - states + 1)"
            )
        primary = self.settings.primary
        if primary is not None and primary not in system.free:
            raise ProblemError(f"primary: {primary!r} is not one of the free parameters {', '.join(system.free)}")
        known = (*system.problem.parameters, *system.problem.functionals)
        trivial = () if self.settings.trivial is None else (self.settings.trivial,)
        for name in (*self.settings.limits, *self.settings.zeros, *trivial):
            if name not in known:
                raise ProblemError(f"{name!r} is neither a parameter nor a functional ({', '.join(known)})")

    def _all_monitors(self) -> list[Monitor]:
        settings = self.settings
        monitors = [user_zero(name, value) for name, values in settings.zeros.items() for value in values]
        monitors += [limit(name, end, side) for name, ends in settings.limits.items() for end, side in zip(ends, (-1, 1))]
        return [*monitors, *settings.monitors, *kind_monitors(self.state.system)]

    # --- the first point -----------------------------------------------------------------------------------------

    def _first(self, system: Discretization, x: Array, tangent: Array | None) -> State:
        settings = self.settings
        if tangent is not None:
            tangent = tangent / np.sqrt(inner(system, tangent, tangent))
            return State(system, x, tangent, None, 1.0, settings.step, np.nan, 0.0, 0, True)
        for _ in range(3):
            x, row = self._first_correction(system, x)
            adapted = system.adapted(x, settings.mesh)
            if adapted is None:
                break
            system, carry = adapted
            x = carry(x)
        else:
            x, row = self._first_correction(system, x)
        tangent = self._tangent(system, x, row)
        tangent *= settings.direction * (np.sign(tangent[system.parameter_index(self.primary)]) or 1.0)
        sign = system.linearize(x, (system.weights * tangent,))[1].sign
        return State(system, x, tangent, None, 1.0, settings.step, sign, 0.0, 0, False)

    def _first_correction(self, system: Discretization, x: Array) -> tuple[Array, Array]:
        """x corrected at fixed primary parameter or, where that is singular (at a fold), across a random direction."""
        fixed = np.zeros(system.size)
        fixed[system.parameter_index(self.primary)] = 1.0
        across = np.random.default_rng(3).standard_normal(system.size) * np.sqrt(system.weights)
        try:
            return correct(system, x, fixed, fixed @ x, self.settings.newton).x, fixed
        except ConvergenceError as error:
            try:
                return correct(system, x, across, across @ x, self.settings.newton).x, across
            except ConvergenceError:
                raise error from None

    @staticmethod
    def _tangent(system: Discretization, x: Array, row: Array) -> Array:
        """The unit vector along the curve at x with row.tangent > 0."""
        return unit_tangent(system, system.linearize(x, (row,))[1])

    # --- the loop ------------------------------------------------------------------------------------------------

    def __iter__(self) -> Iterator[Point]:
        if not self._resumed:
            state = self.state
            label = "BP" if state.singular else "EP"
            trial = Trial(state.system, state.x, state.tangent, state.sign)
            yield self._point(label, "start", trial, 0.0)
            if (stop := self._out_of_limits(trial)) is not None:
                self.stop = stop
                return
        while self.stop is None:
            yield from self._advance()

    def _out_of_limits(self, trial: Trial) -> Stop | None:
        for name, (low, high) in self.settings.limits.items():
            if not low - _SLACK * (1 + abs(low)) <= trial[name] <= high + _SLACK * (1 + abs(high)):
                return Stop("limit", f"{name} = {trial[name]:g} at the start lies outside {low:g} ... {high:g}")
        return None

    def _advance(self) -> Iterator[Point]:
        """One step: the mesh refined if due, the labelled points inside the step, then the point at its end."""
        self._refine()
        state = self.state
        try:
            segment, distance = self._step(state)
        except ConvergenceError as error:
            self.stop = Stop(
                "no convergence", f"the step became smaller than min_step = {self.settings.min_step:g} ({error})",
                "more intervals, a smaller min_step, or a start elsewhere may help",
            )  # fmt: skip
            yield self._point("MX", "no convergence", Trial(state.system, state.x, state.tangent, state.sign), 0.0)
            return
        state, trial, step = segment.state, segment.trial, segment.step
        for event in segment.events(self._monitors):
            yield self._point(event.label, event.name, event.trial, event.at, state, event.details, event.monitor)
            if event.stop is not None:
                self.stop = event.stop
                return
        self.state = self._accept(state, trial, step, distance)
        self._end = trial
        if self.state.accepted >= self.settings.max_points:
            self.stop = Stop("max points", f"max_points = {self.settings.max_points} reached", "raise it to go on")
        yield self._point("EP" if self.stop else "", "max points" if self.stop else "", trial, step, state)

    # --- one step ------------------------------------------------------------------------------------------------

    def _step(self, state: State) -> tuple[Segment, float]:
        """Predict and correct, halving the step until the corrected point can be believed.

        Returns the step and the distance from prediction to corrected point. At the first failure the state's tangent is taken
        anew, right at its point.
        """
        step, settings, exact = state.step, self.settings, False
        finest = max(settings.min_step, _FINEST * step)
        while True:
            try:
                segment, distance = self._attempt(state, step)
                if self._simple(segment) or step < 2 * finest:
                    return segment, distance
                problem = ConvergenceError("several branch points in one step, or another branch at its end")
            except ConvergenceError as error:
                problem = error
            if not exact and not state.singular:
                state, exact = dataclasses.replace(state, tangent=self._exact_tangent(state)), True
            step /= 2
            if step < settings.min_step:
                raise problem

    def _attempt(self, state: State, step: float) -> tuple[Segment, float]:
        """One step of a given length, as far as it can be believed by itself."""
        settings = self.settings
        guess = predict(state, step)
        trial = corrected(state, guess, step, settings.newton)
        residual = state.system.residual(trial.x)
        if not np.all(np.isfinite(residual)):
            raise ConvergenceError("the equations are not finite at the corrected point")
        gap = guess - trial.x
        distance = np.sqrt(inner(state.system, gap, gap))
        angle = turn(state, trial)
        if not (angle <= settings.angle and distance <= _ASTRAY * settings.accuracy * step):
            raise ConvergenceError(
                f"tangents turn by {angle:.2f} rad in one step, the prediction is off by {distance / step:.2f} of it"
            )
        if hidden_turn(state, trial) > settings.angle:
            raise ConvergenceError("the corrected point does not lie where the tangents at both ends lead")
        if self._fold is not None and self._may_turn(trial, residual):
            trial = sharpened(state, trial)
        low, before = self._before(state, step)
        return Segment(state, before, low, trial, step, settings, self.start, self._fold), distance

    def _before(self, state: State, step: float) -> tuple[float, Trial]:
        """Where a step's monitors start from: its place, and the point.

        That is the state's point, as the step before left it, so that both decide from the same values. At a branch point
        tangent and determinant say nothing: a point close to it stands in.
        """
        if not state.singular:
            if self._end is None:
                self._end = Trial(state.system, state.x, state.tangent, state.sign)
            return 0.0, self._end
        low = _ASIDE * step
        aside = located(state, state.x + low * state.tangent, low, self.settings.newton)
        if turn(state, aside) > self.settings.angle:
            raise ConvergenceError("another branch was met right beside the branch point")
        return low, aside

    def _may_turn(self, trial: Trial, residual: Array) -> bool:
        """Whether the primary parameter is so near to turning that an approximate tangent may have the wrong sign."""
        at = trial.system.parameter_index(self.primary)
        component = abs(trial.tangent[at])
        return component < _STEEP and not abs(tangent_error(trial, residual)[at]) < _DOUBT * component

    def _exact_tangent(self, state: State) -> Array:
        """The tangent right at the state's point (the one it came with is from where Newton last took the Jacobian)."""
        row = state.system.weights * state.tangent
        tangent = self._tangent(state.system, state.x, row)
        return tangent if np.all(np.isfinite(tangent)) else state.tangent

    def _simple(self, segment: Segment) -> bool:
        """Whether a step stays on its branch, and passes one branch point at most, which can be located; notes how many.

        Without one, a change of the determinant's sign means that Newton left the branch.
        """
        if not self.settings.branch_points:
            return segment.steady()
        trial = segment.trial
        trial.passed, clear = self._passed(segment)
        if trial.passed > 1 or not clear or not segment.steady():
            return False
        return not sign_changed(segment.before.sign, trial.sign) or segment.crossing().name != "possible"

    def _passed(self, segment: Segment) -> tuple[int, bool]:
        """How many branch points the step passes, by `crossings` (the determinant sees the parity only).

        Factors from Newton's last iterates do where nothing happens; the rest is decided by those right at both ends.
        """
        state, before, trial = segment.state, segment.before, segment.trial
        system, rows = state.system, (state.system.weights * state.tangent,)
        if before.factors is None:
            before.factors = system.linearize(before.x, rows)[1]
        if before.sign == trial.sign and calm(quotients(before, trial, 1)):
            return 0, True
        before.factors = system.linearize(before.x, rows)[1]
        if not trial.exact:
            trial.factors, trial.exact = system.linearize(trial.x, rows)[1], True
            trial.sign = trial.factors.sign
        values = quotients(before, trial)
        passing = np.abs(values[values.real < 0])
        if len(passing) == 1:  # the singular value changes about evenly
            segment.share = float(passing[0] / (1 + passing[0]))
        return crossings(values)

    def _accept(self, state: State, trial: Trial, step: float, distance: float) -> State:
        """The next state, its step chosen so that the predictor's error is ``accuracy`` of it."""
        settings = self.settings
        order = 2 if state.previous_tangent is None else 3
        aim = settings.accuracy * step
        factor = 2.0 if distance == 0 else (aim / distance) ** (1 / order)
        factor = min(factor, 0.8 * settings.angle / max(turn(state, trial), 1e-12))
        p, rate = trial.x[state.system.state_size :], trial.tangent[state.system.state_size :]
        longest = min(settings.max_step, settings.change * float(np.min((1 + np.abs(p)) / (np.abs(rate) + 1e-300))))
        following = float(np.clip(step * np.clip(factor, 0.3, 2.0), settings.min_step, max(longest, settings.min_step)))
        gone = trial.x - state.x
        return State(
            state.system, trial.x, trial.tangent, None if state.singular else state.tangent, step, following, trial.sign,
            state.arclength + np.sqrt(inner(state.system, gone, gone)), state.accepted + 1, False,
        )  # fmt: skip

    def _refine(self) -> None:
        """Adapt the mesh now and then, and correct the point on it."""
        control, state = self.settings.mesh, self.state
        due = control.every if state.system.intervals else 1  # without a mesh it is borders that are renewed, at no cost
        if state.singular or not due or state.accepted % due:
            return
        adapted = state.system.adapted(state.x, control)
        if adapted is None:
            return
        system, carry = adapted
        tangent = carry(state.tangent)
        tangent /= np.sqrt(inner(system, tangent, tangent))
        previous = None if state.previous_tangent is None else carry(state.previous_tangent)
        x, row = carry(state.x), system.weights * tangent
        try:
            done = correct(system, x, row, row @ x, self.settings.newton)
        except ConvergenceError:
            return  # the old mesh still serves; the step control will notice if it does not
        along = unit_tangent(system, done.factors, done.along)
        end = Trial(system, done.x, along, done.factors.sign, factors=done.factors)
        before = self._before(state, state.step)[1]
        if any(np.sign(before.value(monitor)) != np.sign(end.value(monitor)) for monitor in self._comparable):
            return  # an event would fall between the meshes; the next point will do as well
        self._end = end
        self.state = dataclasses.replace(
            state, system=system, x=end.x, tangent=end.tangent, previous_tangent=previous, sign=end.sign
        )

    # --- what comes out ------------------------------------------------------------------------------------------

    def _point(
        self,
        label: str,
        name: str,
        trial: Trial,
        gone: float,
        state: State | None = None,
        details: object = None,
        monitor: Monitor | None = None,
    ) -> Point:
        arclength = (state or self.state).arclength + gone
        errors: Mapping[str, float] = {}
        if label and label != "MX" and name != "closed" and self.settings.errors:  # closed: the first point once more
            trial, errors, details = refined(label, trial, details, monitor, self.settings)
        system = trial.system
        parameters = dict(zip(system.problem.parameters, map(float, system.all_parameters(trial.x))))
        return Point(
            label, name, parameters, trial.functionals, trial.x, trial.tangent, system, arclength, trial.iterations,
            trial.newton_error, errors, details,
        )  # fmt: skip


def follow(system: Discretization, x: Array, settings: Settings = Settings(), tangent: Array | None = None) -> Branch:
    """Run to the end and return the branch: `Continuation` as one call."""
    run = Continuation(system, x, settings, tangent)
    points = list(run)
    return Branch(points, run.stop)
