"""What happens inside a step, located to the precision of the corrector; and how well the mesh resolves it."""

from __future__ import annotations

import contextlib
import dataclasses
from dataclasses import dataclass

import numpy as np

from contin.branch import Stop
from contin.errors import ConvergenceError
from contin.events import Monitor, Trial, find_zero, sign_changed
from contin.settings import Settings
from contin.steps import State, corrected
from contin.switching import MultiplePoint, along, inner, locate_branch_point, smallest_directions

#: A component of the unit tangent below this at both ends of a step is zero: its sign says nothing.
_ROUND_OFF = 1e-9


@dataclass(frozen=True, eq=False)
class Event:
    """What was located inside a step: at which distance along the tangent, what, the stop that it causes, whose zero it is."""

    at: float
    label: str
    name: str
    trial: Trial
    stop: Stop | None = None
    details: object = None
    monitor: Monitor | None = None


class Segment:
    """The piece of a branch between a state and the corrected point at the end of a step.

    Parameters
    ----------
    state : State
    trial : Trial
        The end, at ``step`` along the state's tangent.
    settings : Settings
    start : tuple (system, x, tangent)
        The first point of the run, to recognise a closed branch.
    factors : optional
        Factorization at the state, for points where several branch points fall together.
    """

    def __init__(self, state: State, trial: Trial, step: float, settings: Settings, start, factors=None):
        self.state, self.trial, self.step, self.settings, self.start, self.factors = (
            state,
            trial,
            step,
            settings,
            start,
            factors,
        )
        self.before = Trial(state.system, state.x, state.tangent, state.sign)

    def events(self, monitors) -> list[Event]:
        """What happens in the step, in order."""
        found, state, trial = [], self.state, self.trial
        if not state.singular:
            home = self._returned()
            if home is not None:
                found.append(home)
            elif self.settings.branch_points and sign_changed(state.sign, trial.sign):
                found.append(self.crossing())
            elif trial.passed > 1:
                found.append(self._multiple_point())
            for monitor in monitors:
                if self._changes(monitor):
                    event = self._locate(monitor)
                    if monitor.confirm is None or monitor.confirm(event.trial):
                        found.append(event)
            found = [event for event in found if not _same_place(event, found, self.step)]
        closed = self._closed()
        if closed is not None:
            found.append(closed)
        return sorted(found, key=lambda event: event.at)

    def _corrected(self, guess, at, exact) -> Trial:
        return corrected(self.state, guess, at, self.settings.newton, exact)

    def _at(self, at, exact=True) -> Trial:
        return self._corrected(self._between(at), at, exact)

    def _between(self, at):
        """A guess on the curve by the cubic through both ends and their tangents."""
        state, trial, step = self.state, self.trial, self.step
        s = at / step
        ahead = trial.x - state.x
        rate = step / max(inner(state.system, state.tangent, trial.tangent), 0.1)
        a, b = state.tangent * step, trial.tangent * rate
        return state.x + s * a + s**2 * (3 * ahead - 2 * a - b) + s**3 * (a + b - 2 * ahead)

    def _changes(self, monitor) -> bool:
        """Whether a monitor passes zero in the step; one of the tangent is looked at again with the exact ones."""
        if not sign_changed(monitor.function(self.before), monitor.function(self.trial)):
            return False
        if monitor.label != "LP":
            return True
        ends = self._corrected(self.state.x, 0.0, exact=True), self._corrected(self.trial.x, self.step, exact=True)
        values = [monitor.function(end) for end in ends]
        return sign_changed(*values) and max(map(abs, values)) > _ROUND_OFF

    def _locate(self, monitor: Monitor):
        """The zero of a monitor inside a step; where location fails, the nearer end, named "possible"."""
        trial, step = self.trial, self.step
        exact = monitor.label == "LP"
        ends = monitor.function(self.before), monitor.function(trial)
        name = monitor.name
        try:
            at = find_zero(lambda s: monitor.function(self._at(s, exact)), 0.0, ends[0], step, ends[1], 1e-12 * step)
            there = self._at(at)
        except ConvergenceError:
            at, there, name = step, trial, f"possible {monitor.name}"
        stop = None
        if monitor.terminal:
            stop = Stop("limit", f"reached {monitor.name}") if monitor.label == "EP" else Stop("event", f"met {monitor.name}")
        details = None if monitor.describe is None else monitor.describe(there)
        return Event(at, monitor.label, name, there, stop, details, monitor)

    def crossing(self) -> Event:
        """The branch point inside the step, located once."""
        if self.trial.crossing is None:
            self.trial.crossing = self._branch_point()
        return self.trial.crossing

    def _branch_point(self) -> Event:
        """The branch point inside a step, its bracket halved until the locator's answer lies inside it."""
        state, trial, step = self.state, self.trial, self.step
        low, high = 0.0, step
        for _ in range(12):
            middle = (low + high) / 2
            try:
                found = locate_branch_point(state.system, self._between(middle), self.settings.newton)
                at = inner(state.system, state.tangent, found.x - state.x)
                off = found.x - self._between(at)
                found = along(state.system, found, trial.x - state.x)
                if -1e-9 * step <= at <= step * (1 + 1e-9) and np.sqrt(inner(state.system, off, off)) < 0.1 * step:
                    there = Trial(state.system, found.x, np.full_like(found.x, np.nan), np.nan)
                    return Event(at, "BP", "", there, details=found)
            except ConvergenceError:
                pass
            try:
                sign = self._at(middle, exact=False).sign
            except ConvergenceError:
                break
            low, high = (middle, high) if sign == state.sign else (low, middle)
        return Event(high, "BP", "possible", trial)

    def _multiple_point(self):
        """Where two or more singular values pass zero together: the zero of their mean, with the kernel."""
        state, trial, step = self.state, self.trial, self.step
        system = state.system
        right, left, _ = smallest_directions(trial.factors, system.size)

        def mean(factors):
            response = right.T @ np.array([factors.solve(w) for w in left.T]).T
            values = np.linalg.eigvals(np.linalg.inv(response))
            return float(np.sort_complex(values[np.argsort(np.abs(values))[:2]]).real.mean())

        at, there = step, trial
        with contextlib.suppress(ConvergenceError, np.linalg.LinAlgError):
            ends = mean(self.factors), mean(trial.factors)
            if sign_changed(*ends):

                def inside(s):
                    return mean(self._at(s).factors)

                at = find_zero(inside, 0.0, ends[0], step, ends[1], 1e-9 * step)
                there = self._at(at)
        right, _, response = smallest_directions(there.factors, system.size)
        u, values, _ = np.linalg.svd(response)
        dimension = max(2, int(np.count_nonzero(values > 1e-3 * values[0])))
        kernel = (right @ u[:, :dimension]).T
        return Event(at, "BP", f"kernel of dimension {dimension}", there, details=MultiplePoint(dimension, kernel))

    def _returned(self):
        """The end of a branch on the trivial one, where ``settings.trivial`` passes zero."""
        before, trial = self.before, self.trial
        name = self.settings.trivial
        if name is None or not sign_changed(before[name], trial[name]):
            return None
        stop = Stop("trivial branch", f"returned to the trivial branch ({name} = 0)")
        event = self.crossing() if self.settings.branch_points else None
        if event is None or abs(event.trial[name]) > 1e-6 * max(abs(before[name]), abs(trial[name])):
            monitor = Monitor("EP", "trivial branch", lambda there: there[name], terminal=True)
            event = self._locate(monitor)
        return dataclasses.replace(event, label="EP", name="trivial branch", stop=stop)

    def _closed(self):
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


# --- how well the mesh resolves a point -----------------------------------------------------------------------------


def refined(label: str, trial: Trial, details, monitor: Monitor | None, settings: Settings):
    """The same special point on a mesh halved until its free parameters agree to the mesh tolerance.

    Returns
    -------
    trial, errors, details
        The last solution, by how much its free parameters differ from the one before, and its details.
    """
    errors = dict.fromkeys(trial.system.free, np.nan)
    if isinstance(details, MultiplePoint):
        return trial, errors, details
    for _ in range(4):
        coarse, finer = trial.system, trial.system.refined()
        if finer is None:
            return trial, dict.fromkeys(coarse.free, 0.0), details
        system, carry = finer
        try:
            if label == "BP" or not np.all(np.isfinite(trial.tangent)):
                found = locate_branch_point(system, carry(trial.x), settings.newton)
                details = along(system, found, carry(details.tangents[0])) if details and details.tangents else found
                better = Trial(system, details.x, carry(trial.tangent), np.nan)
            else:
                better = _again(system, carry(trial.x), carry(trial.tangent), monitor, settings)
        except ConvergenceError:
            break
        steps = np.abs(better.x[system.state_size :] - trial.x[coarse.state_size :])
        steps = np.maximum(steps, 16 * np.finfo(float).eps * (1 + np.abs(better.x[system.state_size :]).max()))
        errors, trial = dict(zip(system.free, map(float, steps))), better
        if np.all(steps <= settings.mesh.tolerance * (1 + np.abs(trial.x[system.state_size :]))):
            break
    return trial, errors, details


def _again(system, x, tangent, monitor: Monitor | None, settings: Settings) -> Trial:
    """The zero of a monitor near x on another mesh, by the secant method along the tangent; without one, x corrected."""
    tangent = tangent / np.sqrt(inner(system, tangent, tangent))
    state = State(system, x, tangent, None, 1.0, 1.0, 1.0, 0.0, 0, False)

    def at(s):
        return corrected(state, x + s * tangent, s, settings.newton, exact=True)

    trial = at(0.0)
    if monitor is None:
        return trial
    s, last, value = 1e-3, 0.0, monitor.function(trial)
    for _ in range(12):
        if value == 0:
            return trial
        trial, before = at(s), value
        value = monitor.function(trial)
        if abs(s - last) < 1e-9 or value == before:
            return trial
        s, last = s - value * (s - last) / (value - before), s
    raise ConvergenceError("the point was not found again on the finer mesh")
