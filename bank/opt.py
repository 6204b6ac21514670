"""A constrained maximum by continuation (AUTO demo ``opt``): the sum omega of the coordinates of a point on the unit sphere.

Folds with respect to omega are stationary: with x3 = x4 = x5 = 0, omega = -+sqrt(2); the fold followed in x3, with
omega = x3 + sqrt(2 (1 - x3^2)), turns at sqrt(3), all three coordinates equal. It goes through x1 = x2 = 0 at x3 = 1, where
the circle of solutions shrinks to a point, and on down to omega = 0.
"""

import functools
import math

import numpy as np

from bank.case import Case, Special
from contin import AlgebraicProblem, curve, solve, trace


def residual(u, p):
    squares = u.x1**2 + p.x2**2 + p.x3**2 + p.x4**2 + p.x5**2
    return squares - 1, u.x1 + p.x2 + p.x3 + p.x4 + p.x5 - p.omega


@functools.cache
def problem():
    return AlgebraicProblem(residual, ["x1"], {"omega": 1.0, "x2": 0.0, "x3": 0.0, "x4": 0.0, "x5": 0.0})


@functools.cache
def circle():
    start = solve(problem(), np.array([1.0]), {"omega": 1.0, "x2": 0.0}, free=["omega"])
    return trace(start, free=["omega", "x2"], limits={"omega": (-3, 3)})


def folds():
    return curve(circle().labelled("LP")[0], "x3", primary="omega", limits={"omega": (0, 3)})


CASES = [
    Case("opt", circle, [
        Special("LP", {"omega": math.sqrt(2), "x2": math.sqrt(0.5)}),
        Special("LP", {"omega": -math.sqrt(2), "x2": -math.sqrt(0.5)}),
        Special("EP", {"omega": 1.0, "x2": 0.0}),
    ]),
    Case("opt: folds", folds, [
        Special("LP", {"omega": math.sqrt(3), "x2": 1 / math.sqrt(3), "x3": 1 / math.sqrt(3)}),
        Special("BP", {"omega": 1.0, "x2": 0.0, "x3": 1.0}),
        Special("EP", {"omega": 0.0, "x2": -1 / math.sqrt(6), "x3": math.sqrt(2 / 3)}),
    ]),
]  # fmt: skip
