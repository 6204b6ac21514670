"""Where branches of cycles begin: at Hopf points of equilibria, and at period doublings of cycles."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from contin.arrays import Array
from contin.detection.branch_point import BranchPoint, locate_branch_point
from contin.detection.lyapunov import critical_pair
from contin.discretization.algebraic import Algebraic
from contin.discretization.cycles import CycleCollocation, PeriodicCollocation
from contin.discretization.degree import usual_degree
from contin.discretization.kinds import discretized
from contin.discretization.mesh import MeshControl
from contin.errors import ProblemError
from contin.problems.cycle import PERIOD, ROUNDS, CycleProblem
from contin.results.point import Point

#: Intervals of the first mesh of a branch from a Hopf point.
_INTERVALS = 20


def switched(point: Point, control: MeshControl) -> tuple[PeriodicCollocation, Array, Array]:
    """Return the system of the cycles that leave a Hopf point or a period doubling, the point in it, and the tangent there.

    Raises
    ------
    ProblemError
        It is neither.
    ConvergenceError
        The branch point of doubled orbits is not found.
    """
    if point.label == "PD":
        return doubled(point)
    return from_hopf(point, usual_degree(len(point.system.problem.states), control.tolerance))


def from_hopf(point: Point, degree: int) -> tuple[CycleCollocation, Array, Array]:
    """Return the system of the cycles that leave a Hopf point, the point as an orbit of no size, and the tangent there.

    The tangent is the ellipse of the critical eigenvector v, Re(v exp(2 pi i t)), with the period 2 pi over the frequency.

    Raises
    ------
    ProblemError
        It is no Hopf point of equilibria.
    """
    system: Any = point.system
    if point.label != "HB" or not isinstance(system, Algebraic):
        raise ProblemError(f"start: a point with the label {point.label!r} is no Hopf point of equilibria")
    frequency, vector, _ = critical_pair(system.jacobian(point.x), frequency_of(point))
    problem = CycleProblem.of(system.problem)
    parameters = {**point.parameters, PERIOD: 2 * math.pi / frequency}
    mesh = np.linspace(0, 1, _INTERVALS + 1)
    cycles = CycleCollocation(problem, mesh, degree, (system.free[0], PERIOD), parameters)
    wave = np.exp(2j * math.pi * cycles.nodes)[:, None]
    ellipse = (wave * vector).real
    rest = np.tile(system.states(point.x), (cycles.nodes.size, 1))
    x = cycles.pack(rest, parameters)
    tangent = cycles.pack(ellipse, dict.fromkeys(cycles.free, 0.0))
    return cycles.with_reference(cycles.pack(rest + ellipse, parameters)), x, tangent


def frequency_of(point: Point) -> float | None:
    """Return the frequency of a Hopf or torus bifurcation; None where it was stored without it."""
    known = isinstance(point.details, dict) and "frequency" in point.details
    return float(point.details["frequency"]) if known else None


def doubled(point: Point) -> tuple[PeriodicCollocation, Array, Array]:
    """Return the system of orbits of twice the period, a period-doubling point as such an orbit, and the tangent there.

    The orbit, traversed twice, is a branch point of that system; the new branch leaves along perturbations that change their
    sign from one round to the next.

    Raises
    ------
    ProblemError
        It is no period-doubling point.
    ConvergenceError
        The branch point is not found.
    """
    system: Any = point.system
    if point.label != "PD":
        raise ProblemError(f"start: a point with the label {point.label!r} is no period doubling")
    adapted = system.adapted(point.x, MeshControl())  # the point is located on a mesh finer than the run needs
    system, x = (system, point.x) if adapted is None else (adapted[0], adapted[1](point.x))
    mesh = np.concatenate([system.mesh, 1 + system.mesh[1:]]) / 2
    longer = PERIOD if system.problem.period is None else ROUNDS
    parameters = {**point.parameters, longer: 2 * point.parameters[longer]}
    twice: Any = discretized(system.problem, mesh, system.degree, system.free, parameters, system.scales)
    states = system.states(x)
    x = twice.pack(np.concatenate([states, states[1:]]), parameters)
    found = locate_branch_point(twice.with_reference(x), x)
    return twice.with_reference(found.x), found.x, _alternating(twice, found)


def _alternating(twice: PeriodicCollocation, found: BranchPoint) -> Array:
    """Return the tangent that changes most from one round to the next."""
    half = twice.nodes.size // 2

    def change(tangent: Array) -> float:
        states = twice.states(tangent)
        return float(np.abs(states[: half + 1] - states[half:]).max() / np.abs(states).max())

    return max(found.tangents, key=change)
