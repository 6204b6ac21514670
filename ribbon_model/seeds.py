"""The first point of a branch: a primary one from a linear mode of the circle, a secondary one where the index changes.

`ribbon_model.modes` determines the symmetry of a secondary branch. A reversal that it keeps fixes two points half a loop apart,
so the branch is computed on the half loop between mirrors or between axes, where its kernel is simple. Odd modes of j = 0 keep
no reversal, and need the whole loop.

Where R = 0 the equations are integrable and every wave has all symmetries of a primary branch. So the force distinguishes a
secondary branch: for the laws with omega_2 = 0 it vanishes only where it meets a primary branch.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import TYPE_CHECKING

import numpy as np

from contin.lowlevel import Collocation, levels, locate_branch_point
from ribbon_model.domains import CELL, HALF_LOOP, Domain
from ribbon_model.law import Law, TwoBendings
from ribbon_model.linear import circle, thresholds
from ribbon_model.older import takes_parameters

if TYPE_CHECKING:  # what a caller has it from
    from ribbon_model.solution import Solution


@takes_parameters
def primary_branch(
    law: Law, m: int, n: int, parameters: float | Mapping[str, float], intervals: int = 10, degree: int = 4, root: int = 0
):
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
        n = m, a threshold that does not exist, or m / n even; `TwoBendings` where the law has another bending for the circle's
        moment.

    Examples
    --------
    >>> from ribbon_model.laws import RIBBON
    >>> system, x, tangent = primary_branch(RIBBON, 1, 2, 0.3)
    >>> round(float(x[system.parameter_index("kappa_n")]), 9)
    2.5
    """
    if m % n == 0 and (m // n) % 2 == 0:
        raise ValueError(f"m = {m}, n = {n}: with m / n even the symmetry of the mode does not close the loop")
    kappa_n = _start(law, m, n, parameters, root)
    system = CELL.discretize(law, intervals, degree, law.values(parameters) | CELL.wave(m, n, kappa_n))
    return leave_circle(system, CELL.circle(system, m, kappa_n))


@takes_parameters
def half_loop_branch(
    law: Law, m: int, n: int, parameters: float | Mapping[str, float], intervals: int = 40, degree: int = 4, root: int = 0
):
    """Return the same as `primary_branch` on the half loop, which has all wavenumbers.

    Examples
    --------
    >>> from ribbon_model.laws import RIBBON
    >>> system, x, tangent = half_loop_branch(RIBBON, 1, 2, 0.3)
    >>> round(float(x[system.parameter_index("kappa_n")]), 9)
    2.5
    """
    kappa_n = _start(law, m, n, parameters, root)
    system = HALF_LOOP.discretize(law, intervals, degree, law.values(parameters))
    return leave_circle(system, HALF_LOOP.circle(system, m, kappa_n))


def _start(law: Law, m: int, n: int, parameters: float | Mapping[str, float], root: int) -> float:
    """Return kappa_n of the circle where a branch begins; raise TwoBendings if the law has another bending for its moment."""
    kappa_n = thresholds(law, m, n, parameters)[root]
    moment: float = circle(law, m, kappa_n, parameters)["M1"]
    bending = law.linearized(np.array([[moment, 0.0, 0.0]]), kappa_n, *law.values(parameters).values())[0][0, 0]
    if not abs(bending - m) < levels.ROUGH * m:
        raise TwoBendings(
            f"m = {m}, n = {n}: the strain energy of the circle where the branch begins, at kappa_n = {kappa_n:.6g}, has two "
            f"minima, and the law {law.name!r} takes the other one; it holds for smaller n"
        )
    return kappa_n


def leave_circle(system: Collocation, circle: np.ndarray):
    """Return the branch point at a circle, and the tangent that is not the circle's own."""
    found = locate_branch_point(system, circle)
    if not found.tangents:
        raise ValueError("no branch leaves the circle there")
    at = system.parameter_index("M2")
    tangent = max(found.tangents, key=lambda vector: abs(vector[at]))
    return system, found.x, tangent * np.sign(tangent[at])


def force(point) -> float:
    """Return |R| of a point (or similar object) of a branch: zero on a primary branch and on a circle."""
    return math.hypot(*(point[name] for name in ("R1", "R2", "R3")))


def secondary_branch(solution: Solution, domain: Domain):
    """Return the point where a secondary branch leaves a primary one, near a solution on the cell, on a half loop.

    Returns
    -------
    system : Collocation
    x : ndarray, shape (system.size,)
        The bifurcation of the discrete equations of the half loop.
    tangent : ndarray, shape (system.size,)
        Along the branch that leaves.

    Raises
    ------
    ConvergenceError, ValueError
        No branch that keeps this reversal leaves nearby.
    """
    system, x = solution.on(domain).discretized()
    found = locate_branch_point(system, x)
    at, kappa_n = system.parameter_index("kappa_n"), solution.parameters["kappa_n"]
    near = abs(found.x[at] - kappa_n) < levels.ROUGH * (1 + abs(kappa_n))
    if not (near and found.tangents):
        raise ValueError(f"nothing leaves the half loop with the {domain.reversal} at kappa_n = {kappa_n:.6g}")
    forces = [system.parameter_index(name) for name in system.free if name.startswith("R")]
    return system, found.x, max(found.tangents, key=lambda vector: np.abs(vector[forces]).max())
