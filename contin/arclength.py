"""Pseudo-arclength continuation: a run is an iterable of points over an explicit state.

    run = Continuation(system, x, settings)
    for point in run:
        ...
    print(run.stop)

One step is: predict, correct, judge (accept or halve), look for events between the two ends and locate them, accept,
refine the mesh. The loop knows of a system only its interface (residual, linearize, weights, adapt), not what it is.
"""

from __future__ import annotations

import contextlib
import dataclasses
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np

from contin.branch import Branch, Point, Stop
from contin.corrector import Newton, correct
from contin.errors import ConvergenceError, ProblemError
from contin.events import Monitor, Trial, find_zero, fold, limit, sign_changed, user_zero
from contin.mesh import MeshControl
from contin.switching import MultiplePoint, along, crossings, inner, locate_branch_point, smallest_directions

#: A step is cut down to this fraction of itself to take several branch points one by one, before they count as one.
_FINEST = 1e-3
#: A corrected point this many times further from its prediction than aimed at is not believed.
_ASTRAY = 2.5
#: Share of the states in a tangent below which their direction says nothing.
_STILL = 0.01


@dataclass(frozen=True)
class Settings:
    """What to follow, how carefully, and where to stop. Frozen, checked when made.

    Attributes
    ----------
    primary : str, optional
        The parameter of folds and of the printed columns; the first free one by default.
    direction : int
        +1 or -1: the way to go from the first point, by the sign of the primary parameter's change.
    step, min_step, max_step : float
        First, smallest and largest step of arclength.
    max_points : int
        Regular points after which the run ends.
    limits : mapping of str to pair of float
        The run ends where a parameter or functional leaves its interval.
    zeros : mapping of str to sequence of float
        Values of parameters or functionals to label (UZ).
    trivial : str, optional
        A parameter or functional that vanishes on a known trivial branch only: the run ends where it changes sign.
    monitors : sequence of Monitor
        Events of one's own.
    folds, branch_points, errors : bool
        Whether to look for folds, for branch points, and to solve labelled points again on the mesh halved, until that
        changes them by less than the mesh tolerance: the last change is their error estimate.
    angle : float
        Largest angle between the tangents of consecutive points, radians.
    change : float
        Largest change of any free parameter p in one step, as a fraction of 1 + |p|.
    accuracy : float
        Distance between predicted and corrected point that the step aims at, as a fraction of the step.
    newton, mesh :
        See :class:`Newton`, :class:`MeshControl`.
    """

    primary: str | None = None
    direction: int = 1
    step: float = 0.05
    min_step: float = 1e-6
    max_step: float = 1e6
    max_points: int = 2000
    limits: Mapping[str, Sequence[float]] = field(default_factory=dict)
    zeros: Mapping[str, Sequence[float]] = field(default_factory=dict)
    trivial: str | None = None
    monitors: Sequence[Monitor] = ()
    folds: bool = True
    branch_points: bool = True
    errors: bool = True
    angle: float = 0.35
    change: float = 0.4
    accuracy: float = 0.02
    newton: Newton = field(default_factory=Newton)
    mesh: MeshControl = field(default_factory=MeshControl)

    def __post_init__(self):
        if self.direction not in (1, -1):
            raise ProblemError(f"direction: {self.direction} must be +1 or -1")
        if not 0 < self.min_step <= self.step <= self.max_step:
            raise ProblemError(
                f"step: {self.step} must be positive and lie between min_step {self.min_step} and max_step {self.max_step}"
            )
        if self.max_points < 1:
            raise ProblemError(f"max_points: {self.max_points} must be at least 1")
        for name in ("angle", "accuracy", "change"):
            if not 0 < getattr(self, name) < 1.5:
                raise ProblemError(f"{name}: {getattr(self, name)} must lie between 0 and 1.5")
        for name, ends in self.limits.items():
            if len(ends) != 2 or not ends[0] < ends[1]:
                raise ProblemError(f"limits: {name}: {ends} must be two numbers, the first the smaller")


@dataclass(frozen=True, eq=False)
class State:
    """Everything that the next step depends on; with it a run continues as if never interrupted.

    ``x``, ``tangent`` and ``previous_tangent`` live on ``system``; ``sign`` is that of the determinant on this mesh;
    ``accepted`` counts the regular points; ``singular`` says that x is a branch point.
    """

    system: object
    x: np.ndarray
    tangent: np.ndarray
    previous_tangent: np.ndarray | None
    previous_step: float
    step: float
    sign: float
    arclength: float
    accepted: int
    singular: bool


@dataclass(frozen=True, eq=False)
class _Event:
    """What was located inside a step: at which distance along the tangent, what, and the stop that it causes."""

    at: float
    label: str
    name: str
    trial: Trial
    stop: Stop | None = None
    details: object = None


def _same_place(event: _Event, found: list[_Event]) -> bool:
    """Whether a fold is no event of its own: the parameter also turns where branches cross, and at a cusp of folds."""
    others = [other for other in found if other.label in ("BP", "CP") or other.name == "trivial branch"]
    if event.label != "LP" or not others:
        return False
    lost = event.name.startswith("possible")  # the equations are singular at the crossing: nothing else was found
    return lost or any(np.max(np.abs(event.trial.x - other.trial.x)) < 1e-4 for other in others)


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
        _, factors = system.linearize(x, (row,))
        tangent = factors.solve(np.append(np.zeros(system.equations), 1.0))
        return tangent / np.sqrt(inner(system, tangent, tangent))

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
        for point, stop in self._events(state, trial, step):
            yield point
            if stop is not None:
                self.stop = stop
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
                guess = self._predict(state, step)
                trial = self._trial(state, guess, step)
                if not np.all(np.isfinite(state.system.residual(trial.x))):
                    raise ConvergenceError("the equations are not finite at the corrected point")
                gap = guess - trial.x
                distance = np.sqrt(inner(state.system, gap, gap))
                turn = self._turn(state, trial)
                if turn <= settings.angle and distance <= _ASTRAY * settings.accuracy * step:
                    trial.passed, clear = self._passed(state, trial)
                    if step < 2 * finest or (trial.passed < 2 and clear):
                        return state, step, trial, distance
                    problem = ConvergenceError("several branch points in one step")
                else:
                    problem = ConvergenceError(
                        f"tangents turn by {turn:.2f} rad in one step, the prediction is off by {distance / step:.2f} of it"
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

    def _passed(self, state: State, trial: Trial) -> tuple[int, bool]:
        """How many branch points the step passes, by :func:`crossings` (the determinant sees the parity only)."""
        if state.singular or not self.settings.branch_points:
            return 0, True
        if self._factors is None or self._factors[0] is not state.system:
            self._factors = (state.system, state.system.linearize(state.x, (state.system.weights * state.tangent,))[1])
        return crossings(self._factors[1], trial.factors, state.system.size)

    @staticmethod
    def _turn(state: State, trial: Trial) -> float:
        """The angle between the tangents at both ends: of the whole and, at half weight, of the states alone.

        Where parameters are large they dominate the norm, and two branches can look parallel that are not.
        """
        system = state.system
        whole = inner(system, trial.tangent, state.tangent)
        weights = system.weights[: system.state_size]
        a, b = trial.tangent[: system.state_size], state.tangent[: system.state_size]
        sizes = np.sqrt((weights * a) @ a), np.sqrt((weights * b) @ b)
        part = (weights * a) @ b / (sizes[0] * sizes[1]) if min(sizes) > _STILL else 1.0
        return float(max(np.arccos(np.clip(whole, -1, 1)), np.arccos(np.clip(part, -1, 1)) / 2))

    @staticmethod
    def _predict(state: State, step: float):
        """Along the tangent, with the curvature known from the last step."""
        guess = state.x + step * state.tangent
        if state.previous_tangent is not None:
            guess += (step**2 / (2 * state.previous_step)) * (state.tangent - state.previous_tangent)
        return guess

    def _trial(self, state: State, guess, step: float, exact=False) -> Trial:
        """The point of the curve at ``step`` along the tangent; ``exact``: with the tangent taken right there."""
        system = state.system
        row = system.weights * state.tangent
        done = correct(system, guess, row, row @ state.x + step, self.settings.newton)
        factors = system.linearize(done.x, (row,))[1] if exact else done.factors
        tangent = factors.solve(np.append(np.zeros(system.equations), 1.0))
        tangent /= np.sqrt(inner(system, tangent, tangent))
        return Trial(system, done.x, tangent, factors.sign, done.iterations, done.error, factors)

    def _accept(self, state: State, trial: Trial, step: float, distance: float) -> State:
        """The next state, its step chosen so that the predictor's error is ``accuracy`` of it."""
        settings = self.settings
        order = 2 if state.previous_tangent is None else 3
        aim = settings.accuracy * step
        factor = 2.0 if distance == 0 else (aim / distance) ** (1 / order)
        turn = self._turn(state, trial)
        factor = min(factor, 0.8 * settings.angle / max(turn, 1e-12))
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
        tangent = factors.solve(np.append(np.zeros(system.equations), 1.0))
        tangent /= np.sqrt(inner(system, tangent, tangent))
        self.state = dataclasses.replace(
            state, system=system, x=done.x, tangent=tangent, previous_tangent=previous, sign=factors.sign
        )

    # --- events --------------------------------------------------------------------------------------------------

    def _events(self, state: State, trial: Trial, step: float):
        """The labelled points between the two ends of a step, in order, each with the stop that it causes or None."""
        found = []
        if not state.singular:
            before = Trial(state.system, state.x, state.tangent, state.sign)
            home = self._returned(state, trial, step, before)
            if home is not None:
                found.append(home)
            elif self.settings.branch_points and sign_changed(state.sign, trial.sign):
                found.append(self._branch_point(state, trial, step))
            elif trial.passed > 1:
                found.append(self._multiple_point(state, trial, step))
            for monitor in self._monitors:
                if self._changes(monitor, state, before, trial, step):
                    event = self._locate(state, trial, step, monitor)
                    if monitor.confirm is not None and not monitor.confirm(event.trial):
                        continue
                    found.append(event)
            found = [event for event in found if not _same_place(event, found)]
        closed = self._closed(state, trial, step)
        if closed is not None:
            found.append(closed)
        for event in sorted(found, key=lambda event: event.at):
            yield self._point(event.label, event.name, event.trial, event.at, state, event.details), event.stop

    def _changes(self, monitor, state, before, trial, step) -> bool:
        """Whether a monitor passes zero in a step; one of the tangent is looked at again with the exact one."""
        value = monitor.function(before)
        if not sign_changed(value, monitor.function(trial)):
            return False
        return monitor.label != "LP" or sign_changed(value, monitor.function(self._trial(state, trial.x, step, exact=True)))

    def _between(self, state, trial, step, at):
        """A guess on the curve by the cubic through both ends and their tangents."""
        s = at / step
        ahead = trial.x - state.x
        rate = step / max(inner(state.system, state.tangent, trial.tangent), 0.1)
        a, b = state.tangent * step, trial.tangent * rate
        return state.x + s * a + s**2 * (3 * ahead - 2 * a - b) + s**3 * (a + b - 2 * ahead)

    def _at(self, state, trial, step, at, exact=True) -> Trial:
        return self._trial(state, self._between(state, trial, step, at), at, exact)

    def _locate(self, state, trial, step, monitor: Monitor):
        """The zero of a monitor inside a step; where location fails, the nearer end, named "possible"."""
        exact = monitor.label == "LP"
        ends = monitor.function(Trial(state.system, state.x, state.tangent, state.sign)), monitor.function(trial)
        name = monitor.name
        try:
            at = find_zero(
                lambda s: monitor.function(self._at(state, trial, step, s, exact)), 0.0, ends[0], step, ends[1], 1e-12 * step
            )
            there = self._at(state, trial, step, at)
        except ConvergenceError:
            at, there, name = step, trial, f"possible {monitor.name}"
        stop = None
        if monitor.terminal:
            stop = Stop("limit", f"reached {monitor.name}") if monitor.label == "EP" else Stop("event", f"met {monitor.name}")
        details = None if monitor.describe is None else monitor.describe(there)
        return _Event(at, monitor.label, name, there, stop, details)

    def _branch_point(self, state, trial, step):
        """The branch point inside a step, its bracket halved until the locator's answer lies inside it."""
        low, high = 0.0, step
        for _ in range(12):
            middle = (low + high) / 2
            try:
                found = locate_branch_point(state.system, self._between(state, trial, step, middle), self.settings.newton)
                at = inner(state.system, state.tangent, found.x - state.x)
                off = found.x - self._between(state, trial, step, at)
                found = along(state.system, found, trial.x - state.x)
                if -1e-9 * step <= at <= step * (1 + 1e-9) and np.sqrt(inner(state.system, off, off)) < 0.1 * step:
                    there = Trial(state.system, found.x, np.full_like(found.x, np.nan), np.nan)
                    return _Event(at, "BP", "", there, details=found)
            except ConvergenceError:
                pass
            try:
                sign = self._at(state, trial, step, middle, exact=False).sign
            except ConvergenceError:
                break
            low, high = (middle, high) if sign == state.sign else (low, middle)
        return _Event(high, "BP", "possible", trial)

    def _multiple_point(self, state, trial, step):
        """Where two or more singular values pass zero together: the zero of their mean, with the kernel."""
        system = state.system
        right, left, _ = smallest_directions(trial.factors, system.size)

        def mean(factors):
            response = right.T @ np.array([factors.solve(w) for w in left.T]).T
            values = np.linalg.eigvals(np.linalg.inv(response))
            return float(np.sort_complex(values[np.argsort(np.abs(values))[:2]]).real.mean())

        at, there = step, trial
        with contextlib.suppress(ConvergenceError, np.linalg.LinAlgError):
            ends = mean(self._factors[1]), mean(trial.factors)
            if sign_changed(*ends):

                def inside(s):
                    return mean(self._at(state, trial, step, s).factors)

                at = find_zero(inside, 0.0, ends[0], step, ends[1], 1e-9 * step)
                there = self._at(state, trial, step, at)
        right, _, response = smallest_directions(there.factors, system.size)
        u, values, _ = np.linalg.svd(response)
        dimension = max(2, int(np.count_nonzero(values > 1e-3 * values[0])))
        kernel = (right @ u[:, :dimension]).T
        return _Event(at, "BP", f"kernel of dimension {dimension}", there, details=MultiplePoint(dimension, kernel))

    def _returned(self, state, trial, step, before):
        """The end of a branch on the trivial one, where ``settings.trivial`` passes zero."""
        name = self.settings.trivial
        if name is None or not sign_changed(before[name], trial[name]):
            return None
        stop = Stop("trivial branch", f"returned to the trivial branch ({name} = 0)")
        event = self._branch_point(state, trial, step) if self.settings.branch_points else None
        if event is None or abs(event.trial[name]) > 1e-6 * max(abs(before[name]), abs(trial[name])):
            monitor = Monitor("EP", "trivial branch", lambda there: there[name], terminal=True)
            event = self._locate(state, trial, step, monitor)
        return dataclasses.replace(event, label="EP", name="trivial branch", stop=stop)

    def _closed(self, state, trial, step):
        """The end of a branch that comes back to its first point."""
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
        off = self._between(state, trial, step, at) - x
        if np.sqrt(inner(state.system, off, off)) > 0.1 * step:
            return None
        there = Trial(state.system, x, tangent, trial.sign, trial.iterations, trial.newton_error)
        return _Event(at, "EP", "closed", there, Stop("closed", "the branch closed on its first point"))

    # --- what comes out ------------------------------------------------------------------------------------------

    def _point(self, label, name, trial: Trial, gone: float, state: State | None = None, details=None) -> Point:
        arclength, errors = (state or self.state).arclength + gone, {}
        if label and label != "MX" and self.settings.errors:
            trial, errors, details = self._refined(label, trial, details)
        system = trial.system
        parameters = dict(zip(system.problem.parameters, map(float, system.all_parameters(trial.x))))
        return Point(
            label, name, parameters, trial.functionals, trial.x, trial.tangent, system, arclength, trial.iterations,
            trial.newton_error, errors, details,
        )  # fmt: skip

    def _refined(self, label, trial: Trial, details):
        """The same special point on a mesh halved until its free parameters agree to the mesh tolerance.

        Returns the last solution, by how much its parameters differ from the one before, and its details.
        """
        errors = dict.fromkeys(trial.system.free, np.nan)
        for _ in range(4):
            coarse, refined = trial.system, trial.system.refined()
            if refined is None:
                return trial, dict.fromkeys(coarse.free, 0.0), details
            system, carry = refined
            tangent = carry(trial.tangent)
            try:
                if isinstance(details, MultiplePoint):
                    return trial, errors, details
                if label == "BP" or not np.all(np.isfinite(tangent)):
                    found = locate_branch_point(system, carry(trial.x), self.settings.newton)
                    details = along(system, found, carry(details.tangents[0])) if details and details.tangents else found
                    better = Trial(system, details.x, tangent, np.nan)
                elif label == "LP":
                    better = self._fold_again(system, carry(trial.x), tangent)
                else:
                    better = self._held(system, carry(trial.x), tangent)
            except ConvergenceError:
                break
            steps = np.abs(better.x[system.state_size :] - trial.x[coarse.state_size :])
            steps = np.maximum(steps, 16 * np.finfo(float).eps * (1 + np.abs(better.x[system.state_size :]).max()))
            errors, trial = dict(zip(system.free, map(float, steps))), better
            if np.all(steps <= self.settings.mesh.tolerance * (1 + np.abs(trial.x[system.state_size :]))):
                break
        return trial, errors, details

    def _held(self, system, x, tangent) -> Trial:
        """The point near x with the same primary parameter, on another mesh."""
        row = np.zeros(system.size)
        row[system.parameter_index(self.primary)] = 1.0
        done = correct(system, x, row, row @ x, self.settings.newton)
        return Trial(system, done.x, tangent / np.sqrt(inner(system, tangent, tangent)), np.nan, done.iterations, done.error)

    def _fold_again(self, system, x, tangent) -> Trial:
        """The fold near x on another mesh, by the secant method along the tangent."""
        tangent = tangent / np.sqrt(inner(system, tangent, tangent))
        state = State(system, x, tangent, None, 1.0, 1.0, 1.0, 0.0, 0, False)
        at = system.parameter_index(self.primary)
        s, points = [0.0, 1e-3], []
        for _ in range(12):
            trial = self._trial(state, x + s[len(points)] * tangent, s[len(points)], exact=True)
            points.append(trial)
            if len(points) > 1:
                f0, f1 = points[-2].tangent[at], points[-1].tangent[at]
                if f1 == f0 or abs(s[-1] - s[-2]) < 1e-9:
                    return trial
                s.append(s[-1] - f1 * (s[-1] - s[-2]) / (f1 - f0))
        raise ConvergenceError("the fold was not found again on the finer mesh")


def follow(system, x, settings: Settings = Settings(), tangent=None) -> Branch:
    """Run to the end and return the branch: :class:`Continuation` as one call."""
    run = Continuation(system, x, settings, tangent)
    points = list(run)
    return Branch(points, run.stop)
