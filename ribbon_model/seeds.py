"""The first point of a branch, from a linear mode of the circle."""

from __future__ import annotations

import numpy as np

from contin import Collocation, locate_branch_point
from ribbon_model.domains import CELL, HALF_LOOP
from ribbon_model.laws import Law
from ribbon_model.linear import circle, thresholds


def primary_branch(law: Law, m: int, n: int, nu: float, intervals: int = 10, degree: int = 4, root: int = 0, Gamma=None):
    """Return the point where the branch (m, n) leaves the m-covered circle, on the cell.

    The linear theory gives kappa_n; the discrete equations then give their own branch point there, and the tangent of the
    branch that leaves.

    Returns
    -------
    system : Collocation
    x : ndarray, shape (system.size,)
        The circle at the bifurcation.
    tangent : ndarray, shape (system.size,)
        Tangent of the branch, towards M2 > 0.

    Raises
    ------
    ValueError
        n = m, a threshold that does not exist, or m / n even.

    Examples
    --------
    >>> from ribbon_model.laws import RIBBON
    >>> system, x, tangent = primary_branch(RIBBON, 1, 2, 0.3)
    >>> round(float(x[system.parameter_index("kappa_n")]), 9)
    2.5
    """
    if m % n == 0 and (m // n) % 2 == 0:
        raise ValueError(f"m = {m}, n = {n}: with m / n even the symmetry of the mode does not close the loop")
    kappa_n = thresholds(law, m, n, nu, Gamma)[root]
    system = CELL.discretize(law, intervals, degree, law.values(nu, Gamma) | CELL.wave(m, n, kappa_n))
    return leave_circle(system, CELL.circle(system, m, kappa_n, circle(law, m, kappa_n, nu, Gamma)["M1"]))


def half_loop_branch(law: Law, m: int, n: int, nu: float, intervals: int = 40, degree: int = 4, root: int = 0, Gamma=None):
    """Return the same as `primary_branch` on the half loop, which has all wavenumbers.

    Examples
    --------
    >>> from ribbon_model.laws import RIBBON
    >>> system, x, tangent = half_loop_branch(RIBBON, 1, 2, 0.3)
    >>> round(float(x[system.parameter_index("kappa_n")]), 9)
    2.5
    """
    kappa_n = thresholds(law, m, n, nu, Gamma)[root]
    system = HALF_LOOP.discretize(law, intervals, degree, law.values(nu, Gamma))
    return leave_circle(system, HALF_LOOP.circle(system, m, kappa_n, circle(law, m, kappa_n, nu, Gamma)["M1"]))


def leave_circle(system: Collocation, circle: np.ndarray):
    """Return the branch point at a circle, and the tangent that is not the circle's own."""
    found = locate_branch_point(system, circle)
    if not found.tangents:
        raise ValueError("no branch leaves the circle there")
    at = system.parameter_index("M2")
    tangent = max(found.tangents, key=lambda vector: abs(vector[at]))
    return system, found.x, tangent * np.sign(tangent[at])
