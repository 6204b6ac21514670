"""Why no step succeeds, and what to change: each setting that may help is tried on the step that failed last."""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence
from typing import Any

import numpy as np

from contin.arrays import Array
from contin.continuation.points import Notes
from contin.continuation.rules import aims, judged, predict
from contin.core.protocol import Discretization, inner
from contin.core.settings import Settings
from contin.core.step import Reason, State, Stop, corrected
from contin.core.trial import Event, Trial
from contin.errors import ConvergenceError
from contin.events.corner import changed_between
from contin.levels import CORRECTED, DOUBLED, MOST_STEPS, ROUGH
from contin.text import exact_text

#: A run whose primary parameter has stood still for so many steps says so, and is asked whether it should go on.
_STANDING = 6
#: Shorter steps that are tried, as parts of ``min_step``: the largest that goes on is told.
_SHORTER = (1e-2, 1e-4)
#: Looser tolerances that are tried, as multiples of the one that failed: the smallest that goes on is told.
_LOOSER = (1e3, 1e4, 1e5)
#: An advice must let the run go on for so many steps, and over ``min_step`` or, where it is given, to limits or for
#: `MOST_STEPS`: some steps may succeed right before what ends the run.
_STEPS = 10
#: Each of them is tried so much longer than the one before.
_LONGER = 1.5
#: Largest growth of a size since the start: numbers there are round-off then. Ten times larger, a run has six points more.
_FAR = 1 / np.finfo(float).eps
#: A run fails where a test function that ends runs is zero, if it is below this part of its value at the first point: steps as
#: small as min_step come much nearer, and regular points do not come so near.
_NEARLY = 1e-2


def met(ends: Sequence[Event], here: Trial, first: Trial) -> Stop | None:
    """Return the reason to stop where the domain of the equations ends: a test function that ends runs is nearly zero."""
    for test in ends:
        if abs(here.value(test)) < _NEARLY * abs(first.value(test)):
            return Stop(Reason.EVENT, f"met {test.name}", event=test.name)
    return None


def no_convergence(state: State, settings: Settings, error: ConvergenceError) -> Stop:
    """Return the reason why no step from a state succeeds, the last of which failed with an error."""
    least = exact_text(settings.min_step)
    if not np.isfinite(state.system.residual(predict(state, settings.min_step))).all():
        return Stop(
            Reason.NO_CONVERGENCE, f"the equations have no finite value a step of min_step = {least} further on",
            "look for what they divide by, or take a root or logarithm of: their domain ends there",
        )  # fmt: skip
    known = advice(state, settings)
    if corner := changed_between(*(Trial.without_tangent(state.system, predict(state, way)) for way in (0.0, ROUGH))):
        return Stop(
            Reason.NO_CONVERGENCE, f"the curve meets a corner: {corner[0]} changes",
            "curves in two parameters end there: start another one from a special point on the other side",
        )  # fmt: skip
    return Stop(
        Reason.NO_CONVERGENCE, f"the step became smaller than min_step = {least} ({error})", known or _as_it_is(state, settings)
    )


def advice(state: State, settings: Settings) -> str:
    """Return what lets the run go on from a state, as a clause; empty where nothing that is tried does.

    So it is where steps succeed as they are: then what lies on them is the reason.
    """
    way = settings.min_step
    if _goes_on(state, settings, way):
        return ""
    for tolerance in (times * settings.newton.tolerance for times in _LOOSER):
        if tolerance > ROUGH:
            break
        loose = dataclasses.replace(settings.newton, tolerance=tolerance)
        if _goes_on(state, dataclasses.replace(settings, newton=loose), np.inf):
            return f"the run goes on with newton=Newton(tolerance={loose.tolerance:g}): the one that is set is round-off here"
    if (shorter := _least_step(state, settings, np.inf)) is not None:
        return f"the run goes on with steps of {shorter:g}: set min_step to that or less"
    finer = _on_finer_mesh(state)
    return _mesh_advice(finer.system, settings) if finer is not None and _goes_on(finer, settings, way) else ""


def shorter_steps(state: State, settings: Settings) -> float | None:
    """Return the ``min_step`` with which a run goes on from a state, below the default; None where another one was set.

    So it is at corners of a smooth curve, as that of a canard where its cycles get their head.
    """
    if settings.min_step != Settings.min_step or _goes_on(state, settings, settings.min_step):
        return None
    return _least_step(state, settings, settings.min_step)


def _least_step(state: State, settings: Settings, way: float) -> float | None:
    """Return the largest of some shorter ``min_step`` with which a run goes on; None where it does with none."""
    shorter = (part * settings.min_step for part in _SHORTER if part * settings.min_step > 0)
    return next((step for step in shorter if _goes_on(state, dataclasses.replace(settings, min_step=step), way)), None)


def _as_it_is(state: State, settings: Settings) -> str:
    """Return what has been tried in vain, and what the last point looks like."""
    system = state.system
    loosest = max(
        (times * settings.newton.tolerance for times in _LOOSER if times * settings.newton.tolerance <= ROUGH), default=0
    )
    tried = [f"steps of {_SHORTER[-1] * settings.min_step:g}", *([f"a tolerance of {loosest:g}"] if loosest else [])]
    tried += ["twice the intervals"] if system.refined() else []
    place = [f"{name} = {system.parameter(state.x, name):.6g}" for name in system.free]
    place.append(f"its largest state is {np.max(np.abs(system.states(state.x)), initial=0.0):.3g}")
    return f"tried in vain: {', '.join(tried)}; at the last point {', '.join(place)}"


def _mesh_advice(system: Discretization, settings: Settings) -> str:
    """Return what allows the mesh of a system."""
    number = system.intervals
    if settings.mesh.every and number > settings.mesh.max_intervals:
        return f"the run goes on with {number} intervals: mesh=MeshControl(max_intervals={number}) or more, or a higher degree"
    return (
        f"the run goes on with {number} intervals: mesh=MeshControl(min_intervals={number}) or a smaller tolerance of the mesh"
    )


def _on_finer_mesh(state: State) -> State | None:
    """Return the state on the mesh halved, not corrected; None where there is no mesh."""
    finer: Any = state.system.refined()
    return None if finer is None else state.carried(*finer)


def _goes_on(state: State, settings: Settings, way: float) -> bool:
    """Return whether a run with these settings makes some steps from a state, and goes a ``way``."""
    step, gone = settings.min_step, 0.0
    for number in range(MOST_STEPS):
        inside = all(low <= state.system.parameter(state.x, name) <= high
                     for name, (low, high) in settings.limits.items() if name in state.system.free)  # fmt: skip
        if number >= _STEPS and gone >= way or not inside:
            return True
        trial = _next(state, step, settings)
        while trial is None:
            step /= 2
            if step < settings.min_step:
                return False
            trial = _next(state, step, settings)
        state = dataclasses.replace(
            state, x=trial.x, tangent=trial.tangent, previous_tangent=state.tangent, previous_step=step, singular=False
        )
        gone += step
        step = min(_LONGER * step, settings.max_step)
    return way == np.inf


def _next(state: State, step: float, settings: Settings) -> Trial | None:
    """Return the point at the end of a step; None where it is not found, or the tangent turns too far."""
    guess = predict(state, step)
    try:
        trial = corrected(state, guess, step, settings.newton)
    except ConvergenceError:
        return None
    finite = np.isfinite(trial.system.residual(trial.x)).all() and np.isfinite(inner(state.system, trial.x, trial.x))
    return trial if finite and judged(state, guess, trial).turn <= aims(settings, state.system)[0] else None


def runs_away(system: Discretization, x: Array, start: Discretization, begun: Array) -> bool:
    """Return whether sizes are so much larger than at the start that the numbers there are round-off.

    Unknowns whose sizes do not grow, as of maps, leave of others that tend to zero what is round-off then: their inverse.
    """
    now, then = system.solution.scales, start.solution.scales
    if now is then:
        return not system.on_curve and bool(np.abs(x).max() * DOUBLED > max(1.0, np.abs(begun).max()))
    return bool(np.append(now.states / then.states, now.parameters / then.parameters).max() > _FAR)


def _nears(trial: Trial, state: State, limits: Sequence[float], primary: str) -> bool:
    """Return whether the primary parameter goes to a limit, and not to zero or to a value before it as states grow."""
    value, place = trial[primary], trial.system.parameter_index(primary)
    size = trial.system.free_scales[place - trial.system.state_size]
    gone = state.tangent[place] * size * state.previous_step
    return abs(gone) > CORRECTED * abs(value) and (limits[int(gone > 0)] * value > 0 or abs(value) > ROUGH * size)


def limit_neared(state: State, settings: Settings, start: Discretization) -> str:
    """Return the limit of a free parameter that a run has reached up to round-off, while no size has grown; "" if none is.

    So it is where a branch tends to a limit and never comes there. Where states grow, it goes to infinity.
    """
    system, now, then = state.system, state.system.solution.scales, start.solution.scales
    if now is not then and (now.states / then.states).max(initial=0.0) > 1 / DOUBLED:
        return ""
    values, rates = (vector[system.state_size :].tolist() for vector in (state.x, state.tangent))
    for name, size, value, rate in zip(system.free, system.free_scales.tolist(), values, rates):
        value *= size
        for limit in settings.limits.get(name, ()):
            if 0 < abs(limit - value) < (abs(limit) or size) / _FAR and (limit - value) * rate > 0:
                return f"{name} = {exact_text(limit)}"
    return ""


def ended(
    trial: Trial, state: State, settings: Settings, primary: str, notes: Notes, start: tuple[Discretization, Array]
) -> Stop | None:
    """Return why a run ends after a step: it has as many points as it may have, a limit, goes to infinity, or stands still."""
    if state.accepted >= settings.max_points:
        return Stop(Reason.MAX_POINTS, f"max_points = {settings.max_points} reached", "raise it to go on")
    if near := limit_neared(state, settings, start[0]):
        return Stop(Reason.LIMIT, f"reached {near} up to round-off")
    limits = settings.limits.get(primary)
    far = runs_away(trial.system, trial.x, *start)
    if far and not (limits and _nears(trial, state, limits, primary)):
        names = (*(name for name in trial.system.free), "the largest state")
        sizes = (*(trial[name] for name in trial.system.free), np.abs(trial.system.states(trial.x)).max(initial=0.0))
        place = ", ".join(f"{name} = {size:.3g}" for name, size in zip(names, sizes))
        return Stop(
            Reason.INFINITY,
            f"the branch goes to infinity: {place}",
            f"it comes no nearer to a limit of {primary}" if limits else f"limits of {primary} end it earlier, or let it go on",
        )
    if not settings.folds or state.accepted != _STANDING or state.sense:
        return None
    stop: Stop | None = trial.system.standstill(trial, primary)
    if stop is None and not trial.system.intervals:
        place = f"{primary} stays at {trial[primary]:.10g}, as far as can be told"
        notes.add(f"{place}: a vertical family, as of a linear or conservative system; folds are not told there")
    return stop
