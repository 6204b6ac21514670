"""Equilibria of Lorenz's equations (AUTO demo ``lrz``): pitchfork at rho = 1, Hopf points on both branches at rho = 470 / 19.

sigma = 10, beta = 8 / 3: rho = sigma (sigma + beta + 3) / (sigma - beta - 1), x = y = -+sqrt(beta (rho - 1)), z = rho - 1,
frequency sqrt(beta (sigma + rho)).
"""

import functools
import math

from bank.case import Case, Special
from contin import AlgebraicProblem, solve, trace


def residual(u, p):
    return p.sigma * (u.y - u.x), p.rho * u.x - u.y - u.x * u.z, u.x * u.y - p.beta * u.z


@functools.cache
def problem():
    parameters = {"rho": 0.0, "beta": 8 / 3, "sigma": 10.0}
    return AlgebraicProblem(residual, ["x", "y", "z"], parameters, functionals={"X": lambda u, p: u.x})


@functools.cache
def origin():
    return trace(solve(problem(), [0.0, 0.0, 0.0]), free=["rho"], limits={"rho": (-1, 30)})


def side(sign):
    point = origin().labelled("BP")[0]
    return trace(point, branch=1, direction=1 if point.details.tangents[1][0] * sign > 0 else -1, limits={"rho": (-1, 30)})


CASES = [
    Case("lrz", origin, [Special("BP", {"rho": 1.0, "X": 0.0}), Special("EP", {"rho": 30.0, "X": 0.0})]),
    *(
        Case(f"lrz: side {'+' if sign > 0 else '-'}", functools.partial(side, sign), [
            Special("HB", {"rho": 470 / 19, "X": sign * math.sqrt(8 / 3 * 451 / 19), "frequency": math.sqrt(8 / 3 * 660 / 19)}),
            Special("EP", {"rho": 30.0, "X": sign * math.sqrt(8 / 3 * 29)}),
        ])
        for sign in (1, -1)
    ),
]  # fmt: skip
