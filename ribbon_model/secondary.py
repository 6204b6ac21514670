"""Secondary branches: the first point of a branch that leaves a primary branch where its index changes.

`ribbon_model.modes` determines the symmetry of the branch. A reversal that it keeps fixes two points half a loop apart, so the
branch is computed on the half loop between mirrors or between axes, where its kernel is simple. Odd modes of j = 0 keep no
reversal, and need the whole loop.

Where R = 0 the equations are integrable and every wave has all symmetries of a primary branch. So the force
distinguishes a secondary branch: for the laws with omega_2 = 0 it vanishes only where it meets a primary branch.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

from contin.lowlevel import levels, locate_branch_point
from ribbon_model.domains import Domain

if TYPE_CHECKING:  # what a caller has it from
    from ribbon_model.solution import Solution


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
