"""Starts of branches of cycles: Hopf points, and time integrations that have settled."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from contin import checks
from contin.arrays import Array
from contin.discretization.algebraic import Algebraic
from contin.discretization.cycles import CycleCollocation
from contin.errors import ProblemError
from contin.problems.cycle import PERIOD, CycleProblem
from contin.results.point import Point

#: First mesh of a branch from a Hopf point.
_INTERVALS, _DEGREE = 20, 4


def from_hopf(point: Point) -> tuple[CycleCollocation, Array, Array]:
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
    frequency = float(point.details["frequency"])
    values, vectors = np.linalg.eig(system.jacobian(point.x))
    vector = vectors[:, np.argmin(np.abs(values - 1j * frequency))]
    problem = CycleProblem.of(system.problem)
    parameters = {**point.parameters, PERIOD: 2 * math.pi / frequency}
    mesh = np.linspace(0, 1, _INTERVALS + 1)
    cycles = CycleCollocation(problem, mesh, _DEGREE, (system.free[0], PERIOD), parameters)
    wave = np.exp(2j * math.pi * cycles.nodes)[:, None]
    ellipse = (wave * vector).real / np.linalg.norm(vector)
    rest = np.tile(system.states(point.x), (cycles.nodes.size, 1))
    x = cycles.pack(rest, parameters)
    tangent = cycles.pack(ellipse, dict.fromkeys(cycles.free, 0.0))
    return cycles.with_reference(cycles.pack(rest + ellipse, parameters)), x, tangent
