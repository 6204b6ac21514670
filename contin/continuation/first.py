"""The first point of a run: corrected, on a mesh that serves, with sizes of its states and a direction."""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence

import numpy as np

from contin.arrays import Array
from contin.continuation.meshes import ATTEMPTS, finer, is_poor
from contin.continuation.scaling import renewed, scaled
from contin.core.newton import Newton, correct
from contin.core.protocol import Discretization, inner
from contin.core.settings import Settings
from contin.core.step import ROUNDS, Reason, State, Stop, standing_at
from contin.core.trial import Event, Linearization, Trial, linearization
from contin.draws import DRAWS, generator
from contin.errors import ConvergenceError
from contin.events.corner import ways, with_outcomes, zeros
from contin.events.folds import growing
from contin.levels import APART, LOCATED
from contin.text import value_names

#: Rounds of correcting and adapting the mesh; each settles most of what is left.
ROUNDS_OF_MESHES = 4


def on_branch(system: Discretization, x: Array, tangent: Array, settings: Settings, singular: bool) -> State:
    """Return the state at a point of a branch, to go the way of its tangent; ``singular``: it is a branch point."""
    system, carry = renewed(system, x)
    x, tangent = carry(x), carry(tangent)
    unit = tangent / np.sqrt(inner(system, tangent, tangent))
    state = dataclasses.replace(standing_at(system, x, unit, settings.step), singular=singular)
    return state if singular else _with_sign(state)


def corrected_first(system: Discretization, x: Array, settings: Settings, primary: str) -> State:
    """Return the state at the point that Newton's method finds from x, on a mesh on which its error is within the tolerance.

    Raises ConvergenceError where Newton's method fails.
    """
    system, x = system.crossed(x)
    for _ in range(ROUNDS_OF_MESHES):
        system, x, row = _on_switches(system, x, settings, primary)
        adapted = system.adapted(x, settings.mesh)
        if adapted is None:
            break
        system, carry = adapted
        x = carry(x)
    else:
        system, x, row = _on_switches(system, x, settings, primary)
    linear = linearization(system, x, row)
    rescaled, z = scaled(system, x, row, linear, primary, settings)
    if rescaled is not system:
        x, row = _correction(rescaled, z, primary, settings.newton)
        system, linear = rescaled, linearization(rescaled, x, row)
    system, x, linear = _accurate(system, x, linear, settings, primary)
    unit = settings.direction * growing(system, x, linear.tangent, primary, settings.newton)
    sign = linear.sign * np.sign(inner(system, unit, linear.tangent))  # the determinant of [F_x; row] is linear in row
    return dataclasses.replace(standing_at(system, x, unit, settings.step), sign=sign)


def frozen(state: State) -> State:
    """Return a first state with the outcomes of conditions; at a corner those of the way nearest to its tangent."""
    system = with_outcomes(state.system, state.x)
    every = ways(system, state.x, zero)[0] if (zero := zeros(system, state.x)) else []
    if not every:
        return dataclasses.replace(state, system=system)
    way = max(every, key=lambda way: inner(system, way.tangent, state.tangent))
    return _with_sign(dataclasses.replace(state, system=way.system, tangent=way.tangent, singular=False))


def _with_sign(state: State) -> State:
    return dataclasses.replace(state, sign=state.system.linearize(state.x, (state.row,))[1].sign)


def _accurate(
    system: Discretization, x: Array, linear: Linearization, settings: Settings, primary: str
) -> tuple[Discretization, Array, Linearization]:
    """Return the point on a mesh on which its error is within the tolerance, as far as one is found."""
    for _ in range(ATTEMPTS):
        trial = Trial(system, x, linear)
        other = finer(system, x, trial.discretization_error, settings.mesh) if is_poor(trial, settings.mesh) else None
        if other is None:
            break
        system, carry = other
        system, x, row = _on_switches(system, carry(x), settings, primary)
        linear = linearization(system, x, row)
    return system, x, linear


def _on_switches(system: Discretization, x: Array, settings: Settings, primary: str) -> tuple[Discretization, Array, Array]:
    """Correct x, on a mesh with points where conditions that the solution decides switch; return the row held, too."""
    x, row = _correction(system, x, primary, settings.newton)
    for _ in range(ROUNDS if settings.mesh.every else 0):
        moved = system.on_switches(x)
        if moved is None:
            break
        system, carry = moved
        x, row = _correction(system, carry(x), primary, settings.newton)
    return system, x, row


def _correction(system: Discretization, x: Array, primary: str, newton: Newton) -> tuple[Array, Array]:
    """Correct x at fixed primary parameter or, where that is singular (at a fold), across a random direction.

    Returns x and the row that was held.
    """
    fixed = np.eye(1, system.size, system.parameter_index(primary))[0]
    rows = generator("first").standard_normal((DRAWS, system.size)) * np.sqrt(system.weights)
    failed = list[ConvergenceError]()
    # at a branch point these are singular; beside it a row is, too, that passes two branches at equal distances
    beside = ((x + APART * row / np.abs(row).max(), row) for row in rows)
    for start, row in ((x, fixed), (x, rows[0]), *beside):
        try:
            return correct(system, start, row, row @ start, newton, sizes=system.magnitudes).x, row
        except ConvergenceError as error:
            failed.append(error)
    raise failed[0]


def begins_outside(trial: Trial, settings: Settings, own: Sequence[Event], singular: bool) -> Stop | None:
    """Return the reason to stop at the first point: it lies outside a limit, or outside the domain of the equations.

    ``own`` are the test functions of the kind of problem. Where a curve begins, one that ends runs may be zero up to round-off,
    and is positive a little further on.
    """
    for name, (low, high) in settings.limits.items():
        size = min(1.0, high - low)
        if not low - LOCATED * (size + abs(low)) <= trial[name] <= high + LOCATED * (size + abs(high)):
            ends = " ... ".join(value_names((low, high)).values())
            return Stop(Reason.LIMIT, f"{name} = {trial[name]:.10g} at the start lies outside {ends}")
    beside = Trial.without_tangent(trial.system, trial.x + APART * trial.tangent)
    for test in own:
        if test.terminal and trial.value(test) < 0 and (singular or not test.function(beside) > 0):
            return Stop(Reason.EVENT, f"{test.name} at the first point")
    return None
