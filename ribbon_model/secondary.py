"""Secondary branches: from a change of the index of a primary branch to the first point of a branch that leaves there.

`ribbon_model.modes` says what symmetry is left. A reversal that is kept fixes two places half a loop apart, so the branch is an
ordinary one on the half loop between mirrors or between axes, where its kernel is simple. Modes of j = 0 that are odd keep no
reversal, and need the whole loop.

Where R = 0 the equations are integrable and every wave has all symmetries of a primary branch. So the force tells a secondary
branch from a primary one: it vanishes where they meet, and nowhere else for the laws with omega_2 = 0.
"""

from __future__ import annotations

import math

import numpy as np

from contin import locate_branch_point
from ribbon_model.domains import Domain
from ribbon_model.solution import Solution

#: The bifurcation on the half loop lies this near to where it is looked for, relative to 1 + |kappa_n|.
_NEAR = 1e-4


def force(point) -> float:
    """|R| of a point (or alike) of a branch: zero on a primary branch and on a circle."""
    return math.hypot(*(point[name] for name in ("R1", "R2", "R3")))


def secondary_branch(solution: Solution, domain: Domain):
    """Where a secondary branch leaves a primary one, near a solution on the cell, on the half loop that keeps its reversal.

    Returns
    -------
    system : Collocation
    x : ndarray, shape (system.size,)
        The bifurcation, as the discrete equations of the half loop have it.
    tangent : ndarray, shape (system.size,)
        Along the branch that leaves.

    Raises
    ------
    ConvergenceError, ValueError
        Nothing that keeps this reversal leaves near there.
    """
    system, x = solution.on(domain).discretized()
    found = locate_branch_point(system, x)
    at, kappa_n = system.parameter_index("kappa_n"), solution.parameters["kappa_n"]
    near = abs(found.x[at] - kappa_n) < _NEAR * (1 + abs(kappa_n))
    if not (near and found.tangents):
        raise ValueError(f"nothing leaves the half loop with the {domain.reversal} at kappa_n = {kappa_n:.6g}")
    forces = [system.parameter_index(name) for name in system.free if name.startswith("R")]
    tangent = max(found.tangents, key=lambda vector: np.abs(vector[forces]).max())
    return system, found.x, tangent
