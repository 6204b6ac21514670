"""From a linear mode of the circle to the first point of its branch."""

from __future__ import annotations

import math

import numpy as np

from contin import Collocation, locate_branch_point
from ribbon_model.equilibrium import LENGTH, cell, half_loop
from ribbon_model.laws import Law
from ribbon_model.linear import thresholds


def primary_branch(law: Law, m: int, n: int, nu: float, intervals: int = 10, degree: int = 4, root: int = 0):
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
        n = m, or a threshold that does not exist.
    """
    kappa_n = thresholds(law, m, n, nu)[root]
    sense = math.copysign(1.0, m - kappa_n)
    values = {"nu": nu, "length": LENGTH / (4 * n), "turn": math.pi * m / (2 * n), "sense": sense}
    domain = cell(law)
    system = domain.discretize(intervals, degree, values)
    return _leave(system, domain.circle(system, m, kappa_n))


def half_loop_branch(law: Law, m: int, n: int, nu: float, intervals: int = 40, degree: int = 4, root: int = 0):
    """Like :func:`primary_branch`, on the half loop, where all wavenumbers live together."""
    domain = half_loop(law)
    system = domain.discretize(intervals, degree, {"nu": nu})
    return _leave(system, domain.circle(system, m, thresholds(law, m, n, nu)[root]))


def _leave(system: Collocation, circle: np.ndarray):
    """The branch point at a circle, and the tangent that is not the circle's own."""
    found = locate_branch_point(system, circle)
    at = system.parameter_index("M2")
    tangent = max(found.tangents, key=lambda vector: abs(vector[at]))
    return system, found.x, tangent * np.sign(tangent[at])
