"""The end of a law that is given by its strain energy: U must be convex at every strain along the strip.

Beyond that, H = max(M.omega - U) has several values or none. A branch reaches the end smoothly, with strains that grow like a
square root, or through a jump: two neighbouring places of the strip take different minima of U - M.omega.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from contin import Batch, TestFunction
from ribbon_model.laws import Law
from ribbon_model.shape import frames
from ribbon_model.solution import Solution

NAME = "the end of the convex strain energy"


def margin(law: Law) -> Callable | None:
    """``margin(system, x)``: the least det D2U / (U_11 U_33) along the strip, 1 on planar circles, -1 without a response.

    It is computed for the strains at the nodes and halfway between neighbouring nodes, which detects jumps. None for a law
    whose H is a closed expression, because its domain is known.
    """
    response, curvatures = law.response_at, law.curvatures_at
    if curvatures is None:
        return None

    def strains(u, p):
        H, w1, w2, w3, conjugate = response(u.M1, u.M2, u.M3, p)
        return w1, w3

    def second_derivatives(u, p):
        return curvatures(u.w1, u.w3, p)

    names = ("kappa_n", *law.parameters)
    at, second = (
        Batch([function], [count], states, names, times=False)
        for function, count, states in ((strains, 2, ("M1", "M2", "M3")), (second_derivatives, 3, ("w1", "w3")))
    )

    def least(system, x):
        solution = Solution.at(system, x)
        p = np.array([solution.parameters[name] for name in names])
        w = _values(at, _moments(solution), p)
        U11, U13, U33 = _values(second, np.concatenate([w, (w[1:] + w[:-1]) / 2]), p).T
        ratio = np.where((U11 > 0) & (U33 > 0), (U11 * U33 - U13**2) / (U11 * U33), -1.0)
        return float(np.nan_to_num(ratio, nan=-1.0).min())

    return least


def _values(batch, u, p):
    return batch.values(np.zeros(len(u)), np.ascontiguousarray(u), np.empty((0, u.shape[1])), p)


def _moments(solution: Solution):
    """Return the components of M on the directors at the nodes, shape (K, 3)."""
    states, moment = solution.states, solution.moment
    if states.shape[1] > 4:
        moment = moment - np.cross(states[:, 4:7], solution.force)
    return np.einsum("kij,kj->ki", frames(states), np.broadcast_to(moment, (len(states), 3)))


def test_functions(law: Law) -> list[TestFunction]:
    """Return the test function that ends a run where the law ends; none for a law with a closed expression for H."""
    least = margin(law)
    return [TestFunction("EP", NAME, lambda trial: least(trial.system, trial.x), terminal=True)] if least else []
