"""Sensitivities: derivatives of special points by further parameters, from null vectors, without a further run."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np

from contin import errors as checks
from contin.arrays import Array
from contin.core.differences import derivative
from contin.core.labels import Label
from contin.core.system import System
from contin.core.trial import Linearization, Trial
from contin.errors import ProblemError
from contin.events.branch_point import BorderedMatrix
from contin.events.hopf import critical_real_part
from contin.events.labelled import frequency_of
from contin.problems.angles import winding_names
from contin.problems.statement import ROUNDS, declared
from contin.results.record import Record, system_of


def sensitivities(
    point: Record, by: Sequence[str] | None, held: str | Callable[[Trial], float] | None
) -> dict[str, dict[str, float]]:
    """Return the derivatives of the free parameters at a special point; see `contin.Point.sensitivities`."""
    system = system_of(point, "point")
    others = [name for name in system.problem.parameters if name not in system.free]
    whole = (ROUNDS, *winding_names(declared(system.problem, "angles")))  # numbers of rounds, which cannot change a little
    by = [name for name in others if name not in whole] if by is None else list(checks.names("by", by))
    for name in by:
        if name not in others:
            raise ProblemError(f"by: {name!r} must be one of the parameters that are not free ({', '.join(others)})")
    if not by:
        return {}
    if len(system.free) != system.problem.free_size:
        raise ProblemError("point: must be one of a branch, with the free parameters of a curve")
    wide, x = system.with_free((*system.free, *by), point.x)
    if point.label == Label.FOLD:
        return _of_fold(point, wide, x, by)
    if point.is_simple_branch_point:
        return {name: _of_branch_point(point, name) for name in by}
    fixed = _fixed(point, held)
    return {name: _held(point, name, fixed) for name in by}


def _fixed(point: Record, held: str | Callable[[Trial], float] | None) -> str | Callable[[Trial], float]:
    """Return the quantity that stays fixed: a column, or a function of a trial."""
    if callable(held):
        return held
    system = system_of(point, "point")
    columns = (*system.problem.parameters, *system.problem.functionals, *system.named_states)
    if held is None and point.label == Label.HOPF and frequency_of(point) is not None and not system.is_cycle:
        return critical_real_part(point.details["frequency"])
    if held is None:
        held = point.column or (system.free[0] if point.label in (Label.REGULAR, Label.END) else None)
    if held is None:
        raise ProblemError(f"held: must be given at a point {point.label} {point.name!r}: a column, or a function of a trial")
    if held not in columns:
        raise ProblemError(f"held: {checks.shown(held)} is no column of this problem ({checks.listed(columns)})")
    return held


def _of_fold(point: Record, wide: System, x: Array, by: Sequence[str]) -> dict[str, dict[str, float]]:
    """Return -(w.F_mu) / (w.F_lambda) for all mu at once."""
    system, primary = point.system, point.column
    unit = np.zeros(system.size)
    unit[system.parameter_index(primary)] = 1.0
    # F_x^T w = 0 but for the primary parameter: w from the transposed matrix bordered by that parameter's row and the tangent's
    _, factors = system.linearize(point.x, (system.weights * point.tangent,))
    slopes = wide.transposed_product(x, factors.solve_transposed(unit)[: system.equations])
    sizes = dict(zip(wide.free, wide.free_scales))
    at = {name: slopes[wide.parameter_index(name)] / sizes[name] for name in (primary, *by)}
    return {name: {primary: float(-at[name] / at[primary])} for name in by}


def _with(point: Record, name: str) -> tuple[System, Array, Array, float]:
    """Return the system with one more free parameter, x for it, the derivative of F by it as it is in x, and its size there."""
    system = system_of(point, "point")
    wide, x = system.with_free((*system.free, name), point.x)
    return wide, x, system.parameter_columns(point.x, (name,))[:, 0], float(wide.free_scales[-1])


def _held(point: Record, name: str, held: str | Callable[[Trial], float]) -> dict[str, float]:
    """Return the response, moved along the branch until the held quantity is what it was."""
    system, (wide, x, column, size) = system_of(point, "point"), _with(point, name)
    _, factors = system.linearize(point.x, (system.weights * point.tangent,))
    response = factors.solve(np.append(-column, 0.0))  # at a fixed place along the tangent
    gradient = None if callable(held) else wide.column_gradient(x, held)
    if gradient is not None:
        across, along = (float(gradient @ np.append(v, end)) for v, end in ((response, 1.0), (point.tangent, 0.0)))
    else:
        across, along = (_slope_of(point, name, held, v, by) for v, by in ((response, size), (point.tangent, 0.0)))
    moved = (response - (across / along) * point.tangent) / size
    return dict(zip(system.free, map(float, moved[system.state_size :] * system.free_scales)))


def _slope_of(point: Record, name: str, held: str | Callable[[Trial], float], v: Array, change: float) -> float:
    """Return the derivative of a quantity along v and a change of a parameter, by differences: it may be any function."""
    system = system_of(point, "point")
    value, linear = system.parameter(point.x, name), Linearization(point.tangent, np.nan)

    def measured(s: float) -> float:
        trial = Trial(system.with_parameters({name: value + s * change}) if change else system, point.x + s * v, linear)
        return held(trial) if callable(held) else trial[held]

    return float(derivative(measured)[0])


def _of_branch_point(point: Record, name: str) -> dict[str, float]:
    """Return the response with both g of the locating equations zero: a particular one, corrected along the kernel.

    Both g change by -w.F_xx v along the response and the parameter.
    """
    system, found, (wide, x, column, size) = system_of(point, "point"), point.details, _with(point, name)
    matrix = BorderedMatrix(system, point.x, found.kernel, found.left)
    response = matrix.factors.solve(np.concatenate([-column, [0.0, 0.0]]))[:-1]
    w, across = matrix.multipliers(), np.append(response, 1.0)
    slopes = -matrix.kernel @ wide.bent(x, w, across)[:-1]
    moved = (response - np.linalg.solve(matrix.hessian(), slopes) @ matrix.kernel) / size
    return dict(zip(system.free, map(float, moved[system.state_size :] * system.free_scales)))
