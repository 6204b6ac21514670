"""The end of a law that is given by its strain energy: U must be convex at every strain along the strip.

Beyond that, H = max(M.omega - U) has several values or none. A branch reaches the end smoothly, with strains that grow like a
square root, or through a jump: two neighbouring places of the strip take different minima of U - M.omega.
"""

from __future__ import annotations

import functools
from collections.abc import Callable

import numpy as np

from contin import Event
from contin.lowlevel import Batch
from ribbon_model.domains import StripProblem
from ribbon_model.equilibrium import moment_with_force, moment_without_force
from ribbon_model.law import Law

#: Parts of a line between strains at neighbouring nodes. U is concave on a tenth of a jump at least (measured on (3, 1)).
_PARTS = 16
NAME = "the end of the convex strain energy"


def margin(law: Law) -> Callable | None:
    """``margin(system, x)``: the least det D2U / (U_11 U_33) along the strip, 1 on planar circles, -1 without a response.

    It is computed for the strains at the nodes and on straight lines between neighbouring nodes, which detects jumps. None
    for a law whose H is a closed expression, because its domain is known.
    """
    return _least if law.ends_with_convexity else None


def _least(system, x):
    problem, p, u = system.problem, system.all_parameters(x), system.states(x)
    names = tuple(problem.parameters)
    w = _strains(problem).values(system.nodes, np.ascontiguousarray(u), u[:0], p)
    w = np.concatenate([w[:-1] + part * np.diff(w, axis=0) for part in np.arange(_PARTS) / _PARTS] + [w[-1:]])
    known = dict(zip(names, p))
    values = [known[name] for name in ("kappa_n", *problem.law.parameters)]
    return float(problem.law.margin(np.empty((len(w), 0)), w, *values).min())


@functools.cache
def _strains(problem: StripProblem) -> Batch:
    """Return the strains from the states of a problem."""
    moment = moment_with_force if "x1" in problem.state_names else moment_without_force

    def strains(u, p, M, response):
        H, w1, w2, w3, conjugate = response
        return w1, w2, w3

    return Batch([problem.law.at_points(moment, strains)], [3], problem.state_names, tuple(problem.parameters))


def test_functions(law: Law) -> list[Event]:
    """Return the test function that ends a run where the law ends; none for a law with a closed expression for H."""
    least = margin(law)
    return [Event("EP", NAME, lambda trial: least(trial.system, trial.x), terminal=True)] if least else []
