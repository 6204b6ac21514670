"""The perturbed Gelfand problem, which has a cusp."""

import functools
import math

from contin import BoundaryValueProblem


@functools.cache
def perturbed_gelfand():
    """u'' + lam exp(u / (1 + eps u)) = 0, u(0) = u(1) = 0."""
    return BoundaryValueProblem(
        lambda t, u, p: (u.v, -p.lam * math.exp(u.u / (1 + p.eps * u.u))), lambda a, b, p: (a.u, b.u), ["u", "v"],
        {"lam": 0.0, "eps": 0.2}, functionals={"mean": lambda t, u, p: u.u},
    )  # fmt: skip
