"""Sensitivities: derivatives of special points by further parameters, from null vectors, without a further run."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np

from contin import checks
from contin.arrays import Array
from contin.detection.bordered import BorderedMatrix
from contin.detection.branch_point import BranchPoint
from contin.discretization.system import System
from contin.errors import ProblemError
from contin.results.point import Point, system_of
from contin.stepping.trial import Linearization, Trial

#: Step of the central differences of fourth order: the fifth root of round-off, where their error and round-off are equal.
_STEP = 1e-3


def sensitivities(
    point: Point, by: Sequence[str] | None = None, held: str | Callable[[Trial], float] | None = None
) -> dict[str, dict[str, float]]:
    """Return the derivatives of the free parameters at a special point with respect to every other parameter.

    Parameters
    ----------
    point : Point
        A fold: the derivative of its primary parameter is -(w.F_mu) / (w.F_lambda), w the left null vector (one back-solve);
        only that one is given. A branch point: of all free parameters, the point staying one (of the two branches that cross
        on F + beta psi = 0 where the bifurcation is imperfect). Any other point: at a fixed value of ``held``.
    by : sequence of str, optional
        The other parameters; all that are not free by default.
    held : str or callable, optional
        For points that are neither, the quantity that stays fixed: a parameter, a functional, or ``held(trial)``; the column
        that the point is about by default, else the first free parameter.

    Returns
    -------
    dict
        ``result[mu][lambda]`` is dlambda/dmu.

    Raises
    ------
    ProblemError
        A name that is not a parameter that is held fixed on the branch.

    Examples
    --------
    >>> from contin import AlgebraicProblem, solve, trace
    >>> cubic = AlgebraicProblem(lambda u, p: (p.a - p.b * u.x + u.x**3,), ["x"], {"a": 0.0, "b": 3.0})
    >>> fold = trace(solve(cubic, [0.0]), free=["a"], limits={"a": (-3, 3)}).labelled("LP")[0]  # a = 2, x = 1
    >>> {name: round(value["a"], 6) for name, value in sensitivities(fold).items()}
    {'b': 1.0}
    """
    checks.instance("point", point, Point, "a Point")
    system = system_of(point, "point")
    others = [name for name in system.problem.parameters if name not in system.free]
    by = others if by is None else list(checks.names("by", by))
    for name in by:
        if name not in others:
            raise ProblemError(f"by: {name!r} must be one of the parameters that are not free ({', '.join(others)})")
    if not by:
        return {}
    if len(system.free) != system.problem.free_size:
        raise ProblemError("point: must be one of a branch, with the free parameters of a curve")
    wide, x = system.with_free((*system.free, *by), point.x)
    if point.label == "LP":
        return _of_fold(point, wide, x, by)
    if isinstance(point.details, BranchPoint):
        return {name: _of_branch_point(point, name) for name in by}
    return {name: _held(point, name, held) for name in by}


def _of_fold(point: Point, wide: System, x: Array, by: Sequence[str]) -> dict[str, dict[str, float]]:
    """Return -(w.F_mu) / (w.F_lambda) for all mu at once."""
    system, primary = point.system, point.column
    unit = np.zeros(system.size)
    unit[system.parameter_index(primary)] = 1.0
    # F_x^T w = 0 but for the primary parameter: w from the transposed matrix bordered by that parameter's row and the tangent's
    _, factors = system.linearize(point.x, (system.weights * point.tangent,))
    w = factors.solve_transposed(unit)[: system.equations]
    slopes = wide.transposed_product(x, w)
    sizes = dict(zip(wide.free, wide.free_scales))
    at = {name: slopes[wide.parameter_index(name)] / sizes[name] for name in (primary, *by)}
    return {name: {primary: float(-at[name] / at[primary])} for name in by}


def _response(point: Point, name: str) -> Array:
    """Return the derivative of x by a parameter at a fixed place along the tangent, shape (size,)."""
    system = system_of(point, "point")
    column = system.parameter_columns(point.x, (name,))[:, 0]
    _, factors = system.linearize(point.x, (system.weights * point.tangent,))
    return factors.solve(np.append(-column, 0.0))


def _slope(function: Callable[[float], Any]) -> Any:
    """Return the derivative at 0 of a function of one number, by central differences of fourth order."""
    h = _STEP
    return (8 * (function(h) - function(-h)) - (function(2 * h) - function(-2 * h))) / (12 * h)


def _held(point: Point, name: str, held: str | Callable[[Trial], float] | None) -> dict[str, float]:
    """Return the response, moved along the branch until the held quantity is what it was."""
    system = system_of(point, "point")
    if held is None:
        held = point.column or system.free[0]
    measure = held if callable(held) else (lambda trial: trial[held])
    value = system.parameter(point.x, name)
    response = _response(point, name)

    def measured(x: Array, change: float = 0.0) -> float:
        return measure(Trial(system.with_parameters({name: value + change}), x, Linearization(point.tangent, np.nan)))

    across = _slope(lambda s: measured(point.x + s * response, s))
    along = _slope(lambda s: measured(point.x + s * point.tangent))
    moved = response - (across / along) * point.tangent
    return dict(zip(system.free, map(float, moved[system.state_size :] * system.free_scales)))


def _of_branch_point(point: Point, name: str) -> dict[str, float]:
    """Return the response with both g of the locating equations zero: a particular one, corrected along the kernel."""
    system, found = system_of(point, "point"), point.details
    matrix = BorderedMatrix(system, point.x, found.kernel, found.left)
    column = system.parameter_columns(point.x, (name,))[:, 0]
    response = matrix.factors.solve(np.concatenate([-column, [0.0, 0.0]]))[:-1]
    value = system.parameter(point.x, name)

    def gradient(s: float) -> Array:
        changed = system.with_parameters({name: value + s})
        return BorderedMatrix(changed, point.x + s * response, found.kernel, found.left).g

    hessian = matrix.hessian(point.x)
    moved = response - np.linalg.solve(hessian, _slope(gradient)) @ matrix.kernel
    return dict(zip(system.free, map(float, moved[system.state_size :] * system.free_scales)))
