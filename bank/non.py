"""A problem that depends on t (AUTO demo ``non``): u'' + p1 exp(t^3 u) = 0, u(0) = u(1) = 0.

No closed form. Values by collocation of degree 8 in extended precision (``bank.longdouble``), the fold as a boundary value
problem with its null vector among the states; meshes of 20 and 40 intervals agree to 2e-18.
"""

import functools
import math

from bank.case import Case, Special
from contin import BoundaryValueProblem, solve, trace


def rhs(t, u, p):
    return u.v, -p.p1 * math.exp(t**3 * u.u)


def boundary(a, b, p):
    return a.u, b.u


@functools.cache
def problem():
    return BoundaryValueProblem(rhs, boundary, ["u", "v"], {"p1": 0.0}, functionals={"mean": lambda t, u, p: u.u})


def run():
    start = solve(problem(), [0, 0])
    return trace(start, free=["p1"], limits={"p1": (-1, 20), "mean": (-1, 5)}, zeros={"p1": [1.0, 3.0]})


CASES = [
    Case("non", run, [
        Special("UZ", {"p1": 1.0, "mean": 0.0848775209181342249}),
        Special("UZ", {"p1": 3.0, "mean": 0.26506819984902287}),
        Special("LP", {"p1": 14.074498573460087152, "mean": 2.38395112146221717}),
        Special("EP", {"p1": 4.8014168882637640688, "mean": 5.0}),
    ]),
]  # fmt: skip
