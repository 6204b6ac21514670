"""Bratu's problem (AUTO demo ``exp``): u'' + lam exp(u) = 0, u(0) = u(1) = 0.

Closed form: u = 2 log(cosh(s) / cosh(s (1 - 2 t))), lam = 8 s^2 / cosh(s)^2, with one fold where s tanh(s) = 1. The mean is
2 log cosh s - (2 / s) times the integral of log cosh from 0 to s. Values by mpmath with 40 digits.
"""

import functools
import math

from bank.case import Case, Special
from contin import BoundaryValueProblem, solve, trace


def rhs(t, u, p):
    return u.v, -p.lam * math.exp(u.u)


def boundary(a, b, p):
    return a.u, b.u


@functools.cache
def problem():
    return BoundaryValueProblem(rhs, boundary, ["u", "v"], {"lam": 0.0}, functionals={"mean": lambda t, u, p: u.u})


def run():
    start = solve(problem(), [0, 0])
    return trace(start, free=["lam"], limits={"lam": (-1, 4), "mean": (-1, 6)}, zeros={"lam": [1.0]})


CASES = [
    Case("exp", run, [
        Special("UZ", {"lam": 1.0, "mean": 0.093256877159198371271}),
        Special("LP", {"lam": 3.5138307191251612062, "mean": 0.76190100115600444845}),
        Special("UZ", {"lam": 1.0, "mean": 2.443870361194550053}),
        Special("EP", {"lam": 0.0056579186173961001311, "mean": 6.0}),
    ]),
]  # fmt: skip
