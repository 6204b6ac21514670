"""Equilibria of a harvested predator-prey system (AUTO demo ``pp2``): branch points, a fold, a Hopf point.

x' = p2 x (1 - x) - x y - p1 (1 - exp(-p3 x)), y' = -y + p4 x y; p2 = p4 = 3, p3 = 5. Prey alone: p1 = 3 x (1 - x) / (1
- exp(-5 x)), from the origin at p1 = 3/5; with predators x = 1/3, on a line in p1. Values by mpmath with 30 digits.
"""

import functools
import math

from bank.case import Case, Special
from contin import AlgebraicProblem, solve, trace

LIMITS = {"p1": (-0.1, 1), "X": (-2, 2)}


def residual(u, p):
    return p.p2 * u.x * (1 - u.x) - u.x * u.y - p.p1 * (1 - math.exp(-p.p3 * u.x)), -u.y + p.p4 * u.x * u.y


@functools.cache
def problem():
    functionals = {"X": lambda u, p: u.x, "Y": lambda u, p: u.y}
    return AlgebraicProblem(residual, ["x", "y"], {"p1": 0.0, "p2": 3.0, "p3": 5.0, "p4": 3.0}, functionals=functionals)


@functools.cache
def nobody():
    return trace(solve(problem(), [0.0, 0.0]), free=["p1"], limits=LIMITS)


@functools.cache
def prey(sign):
    """The branch of prey alone, x of this sign."""
    point = nobody().labelled("BP")[0]
    return trace(point, branch=1, direction=1 if point.details.tangents[1][0] * sign > 0 else -1, limits=LIMITS)


def predators(sign):
    point = prey(1).labelled("BP")[0]
    return trace(point, branch=1, direction=1 if point.details.tangents[1][1] * sign > 0 else -1, limits=LIMITS)


def at(label, p1, x, y, **more):
    return Special(label, {"p1": p1, "X": x, "Y": y, **more})


CASES = [
    Case("pp2", nobody, [at("BP", 0.6, 0.0, 0.0), at("EP", 1.0, 0.0, 0.0)]),
    Case("pp2: prey +", functools.partial(prey, 1), [
        at("BP", 0.821904345373990811, 1 / 3, 0.0), at("LP", 0.83292932223415686, 0.411161560751072491, 0.0),
        at("EP", -0.1, 1.03211093718858164, 0.0),
    ]),
    Case("pp2: prey -", functools.partial(prey, -1), [at("EP", 0.00081723583817437983, -2.0, 0.0)]),
    Case("pp2: predators +", functools.partial(predators, 1), [
        at("HB", 0.671593847478831752, 1 / 3, 0.365761535977190465, frequency=0.604782221942072686),
        at("EP", -0.1, 1 / 3, 2.24333731914873145),
    ]),
    Case("pp2: predators -", functools.partial(predators, -1), [at("EP", 1.0, 1 / 3, -0.433373191487314485)]),
]  # fmt: skip
