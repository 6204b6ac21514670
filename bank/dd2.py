"""Fixed points of a discrete predator-prey system (AUTO demo ``dd2``).

x = p1 x (1 - x) - p2 x y, y = (1 - p3) y + p2 x y; p2 = 0.2, p3 = 0.1. From the origin the prey's branch x = 1 - 1 / p1 leaves
at p1 = 1; from it, at x = p3 / p2 = 1/2 and p1 = 2, that of both, y = (p1 / 2 - 1) / p2. (AUTO also finds period doublings, of
the map.)
"""

import functools

from bank.case import Case, Special
from contin import AlgebraicProblem, solve, trace

LIMITS = {"p1": (-5, 5), "X": (-9, 9), "Y": (-20, 20)}


def residual(u, p):
    return p.p1 * u.x * (1 - u.x) - p.p2 * u.x * u.y - u.x, p.p2 * u.x * u.y - p.p3 * u.y


@functools.cache
def problem():
    functionals = {"X": lambda u, p: u.x, "Y": lambda u, p: u.y}
    parameters = {"p1": 0.0, "p2": 0.2, "p3": 0.1}
    return AlgebraicProblem(residual, ["x", "y"], parameters, functionals=functionals, dynamics=False)


@functools.cache
def nobody():
    return trace(solve(problem(), [0.0, 0.0]), free=["p1"], limits=LIMITS)


@functools.cache
def prey(sign):
    """The prey's branch, to larger or smaller p1."""
    point = nobody().labelled("BP")[0]
    return trace(point, branch=1, direction=1 if point.details.tangents[1][2] * sign > 0 else -1, limits=LIMITS)


def together(sign):
    point = prey(1).labelled("BP")[0]
    return trace(point, branch=1, direction=1 if point.details.tangents[1][2] * sign > 0 else -1, limits=LIMITS)


def at(label, p1, x, y):
    return Special(label, {"p1": p1, "X": x, "Y": y})


CASES = [
    Case("dd2", nobody, [at("BP", 1.0, 0.0, 0.0), at("EP", 5.0, 0.0, 0.0)]),
    Case("dd2: prey +", functools.partial(prey, 1), [at("BP", 2.0, 0.5, 0.0), at("EP", 5.0, 0.8, 0.0)]),
    Case("dd2: prey -", functools.partial(prey, -1), [at("EP", 0.1, -9.0, 0.0)]),
    Case("dd2: both +", functools.partial(together, 1), [at("EP", 5.0, 0.5, 7.5)]),
    Case("dd2: both -", functools.partial(together, -1), [at("EP", -5.0, 0.5, -17.5)]),
]  # fmt: skip
