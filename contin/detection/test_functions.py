"""Test functions: of user zeros, limits and folds, and those that a kind of problem brings."""

from __future__ import annotations

import dataclasses
import functools
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from contin.detection import map_normal_forms
from contin.detection.cycle_normal_forms import NormalForms
from contin.detection.floquet import doubling, has_double_one, torus
from contin.detection.homoclinic import homoclinic, limit_of_parameter, resting_place
from contin.detection.homoclinic_points import homoclinic_points, own_names
from contin.detection.hopf import hopf
from contin.detection.lyapunov import Coefficient, critical_pair, first_lyapunov
from contin.detection.second_variation import legendre
from contin.detection.segment import Place, Segment, SpecialPoint
from contin.discretization.algebraic import Algebraic
from contin.discretization.collocation import Collocation
from contin.discretization.connections import ConnectionCollocation
from contin.discretization.cycles import CycleCollocation, PeriodicCollocation
from contin.discretization.maps import MapSystem
from contin.discretization.protocol import Discretization
from contin.names import value_names
from contin.problems.connection import TIME
from contin.problems.cycle import PERIOD
from contin.problems.variational import VariationalProblem
from contin.stepping.state import Reason, Stop
from contin.stepping.trial import TestFunction, Trial

#: A point lies outside a limit where it is further off than this part of the way from the point before: it was located there to
#: round-off otherwise.
_OUTSIDE = 1e-6
#: Decimal places of a parameter that stands still: it does up to errors of meshes with the tolerance 1e-12.
_DIGITS = 9


def user_zeros(zeros: Mapping[str, Sequence[float]]) -> list[TestFunction]:
    """Return the test functions of points where a parameter or functional takes given values (AUTO's UZ).

    A value that is given twice counts once. Different values have different names.
    """
    return [_user_zero(name, value, text) for name, values in zeros.items() for value, text in value_names(values).items()]


def _user_zero(name: str, value: float, text: str) -> TestFunction:
    return TestFunction("UZ", f"{name} = {text}", lambda trial: trial[name] - value, column=name, value=value)


def limits(intervals: Mapping[str, Sequence[float]]) -> list[TestFunction]:
    """Return the test functions that end a run where a parameter or functional reaches an end of its interval."""
    result = []
    for name, (low, high) in intervals.items():
        texts = value_names((low, high))
        result += [_limit(name, low, texts[low], -1), _limit(name, high, texts[high], 1)]
    return result


def _limit(name: str, value: float, text: str, side: int) -> TestFunction:
    """Return the one of the upper (``side`` +1) or lower (-1) end."""

    def function(trial: Trial) -> float:
        return side * (trial[name] - value)

    return TestFunction("EP", f"{name} = {text}", function, terminal=True, limit=True, column=name, value=value)


def within_limits(segment: Segment, points: list[SpecialPoint], ends: Sequence[TestFunction]) -> list[SpecialPoint]:
    """Return the special points of a step up to where it first leaves the limits, which may have been seen at a point only.

    A quantity that passes its limit and comes back in one step has the same sign at both ends of the step.
    """
    last: Place = (segment.low, segment.before)
    for number, point in enumerate(points):
        if point.stop is not None:
            break
        for test in ends:
            value, before = test.function(point.trial), last[1].value(test)
            if before < 0 and value > _OUTSIDE * (abs(before) + value):
                return [*points[:number], segment.locate(test, last, (point.at, point.trial))]
        last = (point.at, point.trial)
    return points


def fold(name: str) -> TestFunction:
    """Return the test function of folds with respect to a free parameter: its component of the tangent (AUTO's LP)."""
    return TestFunction("LP", name, lambda trial: trial.tangent[trial.system.parameter_index(name)], column=name)


@functools.singledispatch
def own_test_functions(system: Discretization) -> list[TestFunction]:
    """Return the test functions that a kind of problem brings, beyond folds and branch points. Each kind registers its own.

    Their signs may differ between meshes.
    """
    return []


@own_test_functions.register
def _of_boundary_value(system: Collocation) -> list[TestFunction]:
    return [legendre()] if isinstance(system.problem, VariationalProblem) else []


@own_test_functions.register
def _of_cycles(system: PeriodicCollocation) -> list[TestFunction]:
    own = [doubling(system.order), torus()]
    return [*own, homoclinic()] if isinstance(system, CycleCollocation) else own


@own_test_functions.register
def _of_connections(system: ConnectionCollocation) -> list[TestFunction]:
    return homoclinic_points(system) if system.problem.homoclinic and TIME not in system.free else []


@own_test_functions.register
def _of_maps(system: MapSystem) -> list[TestFunction]:
    return [doubling(), torus()]


@own_test_functions.register
def _of_equilibria(system: Algebraic) -> list[TestFunction]:
    return [hopf()] if system.problem.dynamics and system.state_size > 1 else []


@functools.singledispatch
def own_end(system: Discretization, point: SpecialPoint) -> SpecialPoint:
    """Return a special point, as the end of the branch where a kind of problem knows it as one. Each kind registers its own."""
    return point


@own_end.register
def _of_homoclinic_points(system: ConnectionCollocation, point: SpecialPoint) -> SpecialPoint:
    """Neutral saddles, and the end of a curve, by which of the leading eigenvalues are complex."""
    names = own_names(point)
    return point if names is None else dataclasses.replace(point, label=names[0], name=names[1])


@functools.singledispatch
def own_normal_form(system: Discretization, point: SpecialPoint) -> Coefficient | None:
    """Return the coefficient of the normal form at a special point; None where there is none. Each kind registers its own."""
    return None


@own_normal_form.register
def _of_hopf_points(system: Algebraic, point: SpecialPoint) -> Coefficient | None:
    """The first Lyapunov coefficient, where one pair crosses the axis."""
    if point.label != "HB" or not _is_simple(point):
        return None
    pair = critical_pair(system.jacobian(point.trial.x), point.details["frequency"])
    return first_lyapunov(system, point.trial.x, pair)


@own_normal_form.register
def _of_bifurcations_of_cycles(system: PeriodicCollocation, point: SpecialPoint) -> Coefficient | None:
    """The coefficients of folds, and of period doublings and torus bifurcations where one multiplier or pair crosses.

    These have none where a multiplier is 1, too: the cycle is not isolated, as in conservative systems.
    """
    with np.errstate(all="ignore"):
        if point.label == "LP" and point.details is None and point.is_located:
            return NormalForms(system, point.trial.x).fold()
        if point.label not in ("PD", "BP", "TR") or not _is_simple(point) or has_double_one(system, point.trial.x):
            return None
        if point.label in ("PD", "BP"):
            return NormalForms(system, point.trial.x).period_doubling()
        return NormalForms(system, point.trial.x).torus(point.details["frequency"])


@own_normal_form.register
def _of_bifurcations_of_maps(system: MapSystem, point: SpecialPoint) -> Coefficient | None:
    """The coefficients of folds, and of period doublings and torus bifurcations where one multiplier or pair crosses."""
    x = point.trial.x
    with np.errstate(all="ignore"):
        if point.label == "LP" and point.details is None and point.is_located:
            return map_normal_forms.fold(system, x)
        if point.label not in ("PD", "TR") or not _is_simple(point):
            return None
        if point.label == "PD":
            return map_normal_forms.period_doubling(system, x)
        return map_normal_forms.torus(system, x, point.details["frequency"])


def _is_simple(point: SpecialPoint) -> bool:
    """Return whether one eigenvalue or pair is critical at a located point."""
    simple = isinstance(point.details, dict) and point.details.get("pairs") == 1
    return simple and point.is_located


def with_normal_form(point: SpecialPoint, found: Coefficient, coarse: Coefficient) -> SpecialPoint:
    """Return a special point with the coefficient in its details and, but for folds, what it means in its name.

    The error is that of the derivatives, and what the coefficient differs from that on the mesh of the run. A coefficient that
    is nothing but error is left out, and its error is stated.
    """
    found = found._replace(error=found.error + abs(found.value - coarse.value))
    value, error = ({} if found.is_meaningless else {"normal_form": found.value}), found.error
    details = {**(point.details or {}), **value, "normal_form_error": error}
    side = -1 if point.label == "PD" and isinstance(point.trial.system, MapSystem) else 1
    attracts, repels = side * found.value < -error, side * found.value > error
    kind = ", supercritical" if attracts else ", subcritical" if repels else ""
    return dataclasses.replace(point, name=point.name + kind * (point.label != "LP"), details=details)


@own_end.register
def _of_doubled_cycles(system: PeriodicCollocation | MapSystem, point: SpecialPoint) -> SpecialPoint:
    """Where a cycle comes to go twice round one of half its period the branch ends: beyond it is itself, half a period on."""
    if point.label != "BP" or point.name in ("start", "symmetry breaking") or not system.is_doubled(point.trial.x):
        return point
    stop = Stop(Reason.PERIOD_DOUBLING, "the cycles come to go twice round cycles of half the period, at a period doubling")
    return dataclasses.replace(point, label="PD", name="period doubling", stop=stop)


@own_end.register
def _of_shrunk_cycles(system: CycleCollocation, point: SpecialPoint) -> SpecialPoint:
    """Where cycles shrink onto an equilibrium the branch ends: beyond the Hopf point it is itself, half a period later."""
    if not system.has_shrunk(point.trial.x):
        return _of_doubled_cycles(system, point)
    stop = Stop(Reason.HOPF, "the cycles shrink onto an equilibrium, a Hopf point")
    return dataclasses.replace(point, label="HB", name="Hopf", stop=stop)


@functools.singledispatch
def own_standstill(system: Discretization, trial: Trial, primary: str) -> Stop | None:
    """Return the reason to end a run whose primary parameter has not moved; None to go on. Each kind registers its own."""
    return None


@own_standstill.register
def _of_vertical_families(system: CycleCollocation, trial: Trial, primary: str) -> Stop:
    """The cycles of a Hamiltonian or linear system fill an area at one value of the parameter."""
    value = round(trial[primary], _DIGITS) + 0.0
    message = f"{primary} stays at {value:.10g}, up to errors of the mesh: a vertical family, as of a conservative system"
    if primary == PERIOD:
        return Stop(Reason.STANDSTILL, message, "all its cycles have this period; follow another parameter")
    advice = f'follow it with primary="{PERIOD}", where {primary} must be a parameter that breaks the conservation (unfolds it)'
    return Stop(Reason.STANDSTILL, message, advice)


@functools.singledispatch
def own_stop(system: Discretization, trial: Trial, stop: Stop) -> Stop:
    """Return the reason why a run ends, with what a kind of problem knows of its last point. Each kind registers its own."""
    return stop


@own_stop.register
def _of_slow_cycles(system: CycleCollocation, trial: Trial, stop: Stop) -> Stop:
    """Where the period runs away: the equilibrium near which the cycle spends its time, and the limit of the parameter."""
    cycles: Any = trial.system
    place = None if cycles.has_shrunk(trial.x) else resting_place(cycles, trial.x)
    if place is None:
        return stop
    message = f"{stop.message}; {place.describe(cycles.problem.states)}"
    limit = limit_of_parameter(cycles, trial.x, place)
    if limit is None:
        return dataclasses.replace(stop, message=message)
    details = {f"limit_{limit.name}": limit.value, f"limit_{limit.name}_error": limit.error}
    return dataclasses.replace(stop, message=f"{message}; {limit.describe()}", details=details)
