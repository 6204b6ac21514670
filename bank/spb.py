"""A singularly perturbed problem (AUTO demo ``spb``; Lorenz 1982): eps u'' = lam (u (u^2 - 1) u' + u), u(0) = 3/2, u(1) = gam.

Three runs: lam from 0, where u is linear, to 1; eps down to 0.001, where layers are thin; gam from 1.2 to -2.2 at eps = 0.01,
through which the layer wanders across. No special points but the ends and the values asked for: none may be invented.
Values by collocation of degree 8 in extended precision (``bank.longdouble``); meshes of N and 2 N intervals agree to 3e-18.
"""

import functools

from bank.case import Case, Special
from contin import BoundaryValueProblem, solve, trace


def rhs(t, u, p):
    return u.v, p.lam * (u.u * (u.u**2 - 1) * u.v + u.u) / p.eps


def boundary(a, b, p):
    return a.u - 1.5, b.u - p.gam


@functools.cache
def problem():
    parameters = {"gam": 1.2, "eps": 0.1, "lam": 0.0}
    return BoundaryValueProblem(rhs, boundary, ["u", "v"], parameters, functionals={"mean": lambda t, u, p: u.u})


@functools.cache
def homotopy():
    start = solve(problem(), lambda t: (1.5 - 0.3 * t, -0.3))
    return trace(start, free=["lam"], limits={"lam": (-0.1, 1)})


@functools.cache
def thinner():
    return trace(homotopy().points[-1], free=["eps"], direction=-1, limits={"eps": (0.001, 1)}, zeros={"eps": [0.01]})


def across():
    start = thinner().labelled("UZ")[0]
    return trace(start, free=["gam"], direction=-1, limits={"gam": (-2.2, 2)}, zeros={"gam": [0.0]})


CASES = [
    Case("spb: lam", homotopy, [Special("EP", {"lam": 1.0, "mean": 0.8403307434769933939})]),
    Case("spb: eps", thinner, [
        Special("UZ", {"eps": 0.01, "mean": 0.4755593927032651942}),
        Special("EP", {"eps": 0.001, "mean": 0.4107748967427174257}),
    ]),
    Case("spb: gam", across, [
        Special("UZ", {"gam": 0.0, "mean": 0.1487147137276404677}),
        Special("EP", {"gam": -2.2, "mean": -2.0153959724818358613}),
    ]),
]  # fmt: skip
