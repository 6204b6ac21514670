"""A boundary and an integral condition (AUTO demo ``int``): u'' + p1 exp(u) = 0, u(0) - u(1) = p2, mean of u = p3.

Only one boundary condition: the integral condition makes up for the other. With p2 = p3 = 0 the solution is Bratu's less its
mean, so p1 = lam(s) exp(mean(s)) in the closed form of Bratu's problem. For p2 != 0, u = c - 2 log cosh(s x + d), x = 2 t - 1:
p1 and p2 are functions of s and d, and the folds in two parameters lie where the determinant of their derivatives vanishes.
Values by mpmath with 30 to 40 digits.
"""

import functools
import math

from bank.case import Case, Special
from contin import BoundaryValueProblem, curve, solve, trace


def rhs(t, u, p):
    return u.v, -p.p1 * math.exp(u.u)


def boundary(a, b, p):
    return (a.u - b.u - p.p2,)


def integrals(t, u, p):
    return (u.u - p.p3,)


@functools.cache
def problem():
    return BoundaryValueProblem(
        rhs, boundary, ["u", "v"], {"p1": 0.0, "p2": 0.0, "p3": 0.0}, integrals=integrals,
        functionals={"square": lambda t, u, p: u.u**2},
    )  # fmt: skip


@functools.cache
def branch():
    start = solve(problem(), [0, 0], {"p1": 0.1})
    return trace(start, free=["p1"], limits={"p1": (-1, 20), "square": (-1, 10)}, zeros={"p1": [1.0, 3.0]})


def folds():
    return curve(branch().labelled("LP")[0], "p2", limits={"p2": (-0.5, 4)}, zeros={"p2": [1.0, 2.0]})


CASES = [
    Case("int", branch, [
        Special("UZ", {"p1": 1.0, "square": 0.0014591406250313773078}),
        Special("UZ", {"p1": 3.0, "square": 0.014670697056887819011}),
        Special("LP", {"p1": 11.923790200647665659, "square": 1.0478148759733777654}),
        Special("UZ", {"p1": 3.0, "square": 9.6085344557225151238}),
        Special("EP", {"p1": 2.8108172733878122791, "square": 10.0}),
    ]),
    Case("int: folds", folds, [
        Special("UZ", {"p1": 11.603854053727492769, "p2": 1.0, "square": 1.1909770458524951019}),
        Special("UZ", {"p1": 10.711490673098759178, "p2": 2.0, "square": 1.6168646185743372522}),
        Special("EP", {"p1": 7.934950202765485837, "p2": 4.0, "square": 3.2749564256387403564}),
    ]),
]  # fmt: skip
