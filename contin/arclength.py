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
from collections.abc import Iterator

import numpy as np

from contin.branch import Branch, Point, Stop
from contin.corrector import correct
from contin.errors import ConvergenceError, ProblemError
from contin.events import Monitor, Trial, fold, limit, sign_changed, user_zero
from contin.location import Segment, refined
from contin.settings import Settings
from contin.steps import State, corrected, predict, turn, unit_tangent
from contin.switching import crossings, inner

#: A step is cut down to this fraction of itself to take several branch points one by one, before they count as one.
_FINEST = 1e-3
#: A corrected point this many times further from its prediction than aimed at is not believed.
_ASTRAY = 2.5


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

    def __init__(self, system, x, settings: Settings = Settings(), tangent=None, state: State | None = None, start=None):
        self.settings = settings
        self.stop: Stop | None = None
        self._factors = None  # of the state's point, to compare the next ones with
        self._check(system)
        self.primary = settings.primary or system.free[0]
        self.state = state or self._first(system, np.asarray(x, dtype=float), tangent)
        self._monitors = self._all_monitors()
        self._resumed = state is not None
        self.start = start or (self.state.system, self.state.x, self.state.tangent)

    def _check(self, system):
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

    def _all_monitors(self):
        settings = self.settings
        monitors = [fold(self.primary)] if settings.folds else []
        monitors += [user_zero(name, value) for name, values in settings.zeros.items() for value in values]
        monitors += [limit(name, value) for name, values in settings.limits.items() for value in values]
        return [*monitors, *self.state.system.monitors(), *settings.monitors]

    # --- the first point -----------------------------------------------------------------------------------------

    def _first(self, system, x, tangent) -> State:
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

    def _first_correction(self, system, x):
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
    def _tangent(system, x, row):
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

    def _out_of_limits(self, trial) -> Stop | None:
        for name, (low, high) in self.settings.limits.items():
            if not low <= trial[name] <= high:
                return Stop("limit", f"{name} = {trial[name]:g} at the start lies outside {low:g} ... {high:g}")
        return None

    def _advance(self) -> Iterator[Point]:
        """One step: the mesh refined if due, the labelled points inside the step, then the point at its end."""
        self._refine()
        state = self.state
        try:
            state, step, trial, distance = self._step(state)
        except ConvergenceError as error:
            self.stop = Stop(
                "no convergence", f"the step became smaller than min_step = {self.settings.min_step:g} ({error})",
                "more intervals, a smaller min_step, or a start elsewhere may help",
            )  # fmt: skip
            yield self._point("MX", "no convergence", Trial(state.system, state.x, state.tangent, state.sign), 0.0)
            return
        for event in self._segment(state, trial, step).events(self._monitors):
            yield self._point(event.label, event.name, event.trial, event.at, state, event.details, event.monitor)
            if event.stop is not None:
                self.stop = event.stop
                return
        self.state = self._accept(state, trial, step, distance)
        self._factors = (state.system, trial.factors)
        if self.state.accepted >= self.settings.max_points:
            self.stop = Stop("max points", f"max_points = {self.settings.max_points} reached", "raise it to go on")
        yield self._point("EP" if self.stop else "", "max points" if self.stop else "", trial, step, state)

    # --- one step ------------------------------------------------------------------------------------------------

    def _step(self, state: State):
        """Predict and correct, halving the step until the corrected point can be believed.

        Returns the state as well: at the first failure its tangent is taken anew, right at its point.
        """
        step, settings, exact = state.step, self.settings, False
        finest = max(settings.min_step, _FINEST * step)
        while True:
            try:
                guess = predict(state, step)
                trial = corrected(state, guess, step, settings.newton)
                if not np.all(np.isfinite(state.system.residual(trial.x))):
                    raise ConvergenceError("the equations are not finite at the corrected point")
                gap = guess - trial.x
                distance = np.sqrt(inner(state.system, gap, gap))
                angle = turn(state, trial)
                if angle <= settings.angle and distance <= _ASTRAY * settings.accuracy * step:
                    trial.passed, clear = self._passed(state, trial)
                    if step < 2 * finest or (trial.passed < 2 and clear and self._connected(state, trial, step)):
                        return state, step, trial, distance
                    problem = ConvergenceError("several branch points in one step, or another branch at its end")
                else:
                    problem = ConvergenceError(
                        f"tangents turn by {angle:.2f} rad in one step, the prediction is off by {distance / step:.2f} of it"
                    )
            except ConvergenceError as error:
                problem = error
            if not exact and not state.singular:
                state, exact = dataclasses.replace(state, tangent=self._exact_tangent(state)), True
            step /= 2
            if step < settings.min_step:
                raise problem

    def _exact_tangent(self, state: State):
        """The tangent right at the state's point (the one it came with is from where Newton last took the Jacobian)."""
        row = state.system.weights * state.tangent
        tangent = self._tangent(state.system, state.x, row)
        return tangent if np.all(np.isfinite(tangent)) else state.tangent

    def _connected(self, state: State, trial: Trial, step: float) -> bool:
        """Whether a change of the determinant's sign comes from a branch point: without one, Newton left the branch."""
        if state.singular or not self.settings.branch_points or not sign_changed(state.sign, trial.sign):
            return True
        return self._segment(state, trial, step).crossing().name != "possible"

    def _segment(self, state: State, trial: Trial, step: float) -> Segment:
        return Segment(state, trial, step, self.settings, self.start, self._factors and self._factors[1])

    def _passed(self, state: State, trial: Trial) -> tuple[int, bool]:
        """How many branch points the step passes, by :func:`crossings` (the determinant sees the parity only)."""
        if state.singular or not self.settings.branch_points:
            return 0, True
        if self._factors is None or self._factors[0] is not state.system:
            self._factors = (state.system, state.system.linearize(state.x, (state.system.weights * state.tangent,))[1])
        return crossings(self._factors[1], trial.factors, state.system.size)

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

    def _refine(self):
        """Adapt the mesh now and then, and correct the point on it."""
        control, state = self.settings.mesh, self.state
        if state.singular or not control.every or state.accepted % control.every:
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
        _, factors = system.linearize(done.x, (row,))
        tangent = unit_tangent(system, factors)
        self.state = dataclasses.replace(
            state, system=system, x=done.x, tangent=tangent, previous_tangent=previous, sign=factors.sign
        )

    # --- what comes out ------------------------------------------------------------------------------------------

    def _point(
        self, label, name, trial: Trial, gone: float, state: State | None = None, details=None, monitor: Monitor | None = None
    ) -> Point:
        arclength, errors = (state or self.state).arclength + gone, {}
        if label and label != "MX" and name != "closed" and self.settings.errors:  # closed: the first point once more
            trial, errors, details = refined(label, trial, details, monitor, self.settings)
        system = trial.system
        parameters = dict(zip(system.problem.parameters, map(float, system.all_parameters(trial.x))))
        return Point(
            label, name, parameters, trial.functionals, trial.x, trial.tangent, system, arclength, trial.iterations,
            trial.newton_error, errors, details,
        )  # fmt: skip


def follow(system, x, settings: Settings = Settings(), tangent=None) -> Branch:
    """Run to the end and return the branch: :class:`Continuation` as one call."""
    run = Continuation(system, x, settings, tangent)
    points = list(run)
    return Branch(points, run.stop)
