"""What to change where no step succeeds: each setting that may help is tried on the step that failed last."""

from __future__ import annotations

import dataclasses
from typing import Any

import numpy as np

from contin.discretization.protocol import Discretization, inner
from contin.errors import ConvergenceError
from contin.stepping.newton import Newton
from contin.stepping.settings import Settings
from contin.stepping.state import State
from contin.stepping.step import corrected, predict, turn

#: A shorter step is this part of ``min_step``, and a looser tolerance so many times the one that failed. With larger factors
#: the advice would be good for more, and say less.
_SHORTER, _LOOSER = 1e-2, 1e3
_OTHERWISE = "more intervals, a smaller min_step, scales for unknowns far from one, or a start elsewhere may help"


def advice(state: State, settings: Settings) -> str:
    """Return what lets the step of length ``min_step`` from a state succeed, or what else may help, as a clause."""
    least, newton = settings.min_step, settings.newton
    loose = dataclasses.replace(newton, tolerance=_LOOSER * newton.tolerance)
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
