"""Why no step succeeds, and what to change: each setting that may help is tried on the step that failed last."""

from __future__ import annotations

import dataclasses
from typing import Any

import numpy as np

from contin.discretization.protocol import Discretization, inner
from contin.errors import ConvergenceError
from contin.names import exact_text
from contin.stepping.newton import Newton
from contin.stepping.settings import Settings
from contin.stepping.state import State, Stop
from contin.stepping.step import corrected, predict, turn

#: A shorter step that is tried, as a part of ``min_step``. With a smaller one the advice would be good for more, and say less.
_SHORTER = 1e-2
#: Looser tolerances that are tried, as multiples of the one that failed: the smallest that succeeds is told.
_LOOSER = (1e3, 1e4, 1e5)
#: The way along the tangent on which a corner is looked for, and the part that its bend has of the usual change of the residual
#: on such a way: for a smooth function, it is about as large as the way.
_CORNER, _JUMP = 1e-4, 0.1
_OTHERWISE = "more intervals, a smaller min_step, scales for unknowns far from one, or a start elsewhere may help"


def no_convergence(state: State, settings: Settings, error: ConvergenceError) -> Stop:
    """Return the reason why no step from a state succeeds, the last of which failed with an error."""
    least = exact_text(settings.min_step)
    if not np.all(np.isfinite(state.system.residual(predict(state, settings.min_step)))):
        return Stop(
            "no convergence", f"the equations have no finite value a step of min_step = {least} further on",
            "look for what they divide by, or take a root or logarithm of: their domain ends there",
        )  # fmt: skip
    if _meets_corner(state):
        return Stop(
            "no convergence", f"the derivatives of the equations jump a step of min_step = {least} further on",
            "abs, max, min, if and tables have corners; a smooth form such as sqrt(x**2 + d**2) for abs(x) can be followed",
        )  # fmt: skip
    return Stop("no convergence", f"the step became smaller than min_step = {least} ({error})", advice(state, settings))


def _meets_corner(state: State) -> bool:
    """Return whether the residual bends within a short way along the tangent as only a corner does."""
    system, x, way = state.system, state.x, _CORNER * state.tangent
    here = system.residual(x)
    forth, back = (system.residual(x + sign * way) - here for sign in (1, -1))
    across = np.random.default_rng(17).standard_normal(system.size)
    across *= _CORNER / np.sqrt(inner(system, across, across))
    usual = np.max(np.abs(system.residual(x + across) - here), initial=0.0)
    return bool(np.max(np.abs(forth + back), initial=0.0) > _JUMP * usual)


def advice(state: State, settings: Settings) -> str:
    """Return what lets the step of length ``min_step`` from a state succeed, or what else may help, as a clause."""
    least, newton = settings.min_step, settings.newton
    for times in _LOOSER:
        loose = dataclasses.replace(newton, tolerance=times * newton.tolerance)
        if _succeeds(state, least, settings, loose):
            return f"a step succeeds with newton=Newton(tolerance={loose.tolerance:g}): the one that is set is round-off here"
    shorter = _SHORTER * least
    if _succeeds(state, shorter, settings, newton):
        return f"a step of {shorter:g} succeeds: set min_step to that or less"
    finer = _on_finer_mesh(state)
    if finer is not None and _succeeds(finer, least, settings, newton):
        return _mesh_advice(finer.system, settings)
    return _OTHERWISE


def _mesh_advice(system: Discretization, settings: Settings) -> str:
    """Return what allows the mesh of a system."""
    number = system.intervals
    if settings.mesh.every and number > settings.mesh.max_intervals:
        return f"a step succeeds on {number} intervals: mesh=MeshControl(max_intervals={number}) or more, or a higher degree"
    return f"a step succeeds on {number} intervals: mesh=MeshControl(min_intervals={number}) or a smaller tolerance of the mesh"


def _on_finer_mesh(state: State) -> State | None:
    """Return the state on the mesh halved, not corrected; None where there is no mesh."""
    finer: Any = state.system.refined()
    if finer is None:
        return None
    system, carry = finer
    tangent = carry(state.tangent)
    previous = None if state.previous_tangent is None else carry(state.previous_tangent)
    return dataclasses.replace(state, system=system, x=carry(state.x), tangent=tangent, previous_tangent=previous)


def _succeeds(state: State, step: float, settings: Settings, newton: Newton) -> bool:
    """Return whether a step is corrected to a point that the tangents at both ends allow."""
    guess = predict(state, step)
    try:
        trial = corrected(state, guess, step, newton)
    except ConvergenceError:
        return False
    finite = np.all(np.isfinite(trial.system.residual(trial.x))) and np.isfinite(inner(state.system, trial.x, trial.x))
    return bool(finite and turn(state, trial) <= settings.angle)
