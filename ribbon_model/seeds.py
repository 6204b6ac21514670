"""From a linear mode of the circle to the first point of its branch."""

from __future__ import annotations

import math
from collections.abc import Mapping

import numpy as np

from contin import Collocation, locate_branch_point
from ribbon_model.equilibrium import LENGTH, cell, half_loop, loop
from ribbon_model.laws import Law
from ribbon_model.linear import circle, thresholds
from ribbon_model.shape import closed_strip, quaternions


def primary_branch(law: Law, m: int, n: int, nu: float, intervals: int = 10, degree: int = 4, root: int = 0, Gamma=None):
    """Where the branch (m, n) leaves the m-covered circle, on the cell.

    The linear theory gives kappa_n; the discrete equations then give their own branch point there, and the tangent of the
    branch that leaves.

    Returns
    -------
    system : Collocation
    x : ndarray, shape (system.size,)
        The circle at the bifurcation.
    tangent : ndarray, shape (system.size,)
        Along the branch, towards M2 > 0.

    Raises
    ------
    ValueError
        n = m, a threshold that does not exist, or m / n even.
    """
    if m % n == 0 and (m // n) % 2 == 0:
        raise ValueError(f"m = {m}, n = {n}: with m / n even the symmetry of the mode does not close the loop")
    kappa_n = thresholds(law, m, n, nu, Gamma)[root]
    sense = math.copysign(1.0, m - kappa_n)
    values = {**law.values(nu, Gamma), "length": LENGTH / (4 * n), "turn": math.pi * m / (2 * n), "sense": sense}
    domain = cell(law)
    system = domain.discretize(intervals, degree, values)
    return leave_circle(system, domain.circle(system, m, kappa_n, circle(law, m, kappa_n, nu, Gamma)["M1"]))


def half_loop_branch(law: Law, m: int, n: int, nu: float, intervals: int = 40, degree: int = 4, root: int = 0, Gamma=None):
    """Like `primary_branch`, on the half loop, where all wavenumbers live together."""
    domain = half_loop(law)
    system = domain.discretize(intervals, degree, law.values(nu, Gamma))
    kappa_n = thresholds(law, m, n, nu, Gamma)[root]
    return leave_circle(system, domain.circle(system, m, kappa_n, circle(law, m, kappa_n, nu, Gamma)["M1"]))


def whole_loop(law: Law, t, states, degree: int, parameters: Mapping[str, float]):
    """The full loop, gauge and phase fixed, from a solution on the cell or the half loop.

    Returns
    -------
    system : Collocation
        On the unfolded mesh, free parameters kappa_n, M1, M2, R1, R2, R3, unfold.
    x : ndarray, shape (system.size,)
        The unfolded solution, a guess to be corrected at fixed kappa_n.
    """
    shape = closed_strip(law, t, states, degree, parameters)
    first, origin = shape.directors[0], shape.centreline[0]
    force = np.array([parameters.get(name, 0.0) for name in ("R1", "R2", "R3")])
    moment = np.array([parameters["M1"], parameters["M2"], parameters.get("M3", 0.0)]) - np.cross(origin, force)
    q = quaternions(shape.directors @ first.T)
    x = (shape.centreline - origin) @ first.T
    values = dict(zip(("M1", "M2", "M3", "R1", "R2", "R3"), (*(first @ moment), *(first @ force))))
    values |= {"kappa_n": parameters["kappa_n"], "unfold": 0.0, **{name: parameters[name] for name in law.parameters}}
    domain, mesh = loop(law), shape.arclength[::degree] / shape.arclength[-1]
    system = Collocation(domain.problem, mesh, degree, domain.free, values)
    return system, system.pack(np.hstack([q, x]), values)


def leave_circle(system: Collocation, circle: np.ndarray):
    """The branch point at a circle, and the tangent that is not the circle's own."""
    found = locate_branch_point(system, circle)
    if not found.tangents:
        raise ValueError("no branch leaves the circle there")
    at = system.parameter_index("M2")
    tangent = max(found.tangents, key=lambda vector: abs(vector[at]))
    return system, found.x, tangent * np.sign(tangent[at])
