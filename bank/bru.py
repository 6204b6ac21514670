"""Steady states of the Brusselator with diffusion (the reaction of AUTO demo ``bru``; Holodniok, Klic & Kubicek).

dx / L^2 x'' + x^2 y - (b + 1) x + a = 0, dy / L^2 y'' - x^2 y + b x = 0, x = a and y = b / a at both ends; a = 2, b =
4.6, dx = 0.0016, dy = 0.008, and the length L grows. The uniform state loses stability to mode n where 0.0016 k^2 - 2.8
k + 500 = 0 with k = (n pi / L)^2, at two lengths for every n. Both branches of mode 1 are one closed loop, with folds
and with branch points at which the reflection symmetry breaks; so are both ends of mode 2's, through one of these
points. Folds and points of broken symmetry by collocation of degree 8 in extended precision (``bank.longdouble``; the
latter on half the domain, with an antisymmetric null vector); meshes of N and 2 N intervals agree to 1e-17.
"""

import functools
import math

from bank.case import Case, Special
from contin import BoundaryValueProblem, solve, trace


def rhs(t, u, p):
    s, rate = p.L**2, u.x**2 * u.y
    return u.dx, -s / p.diffx * (rate - (p.b + 1) * u.x + p.a), u.dy, -s / p.diffy * (p.b * u.x - rate)


def boundary(a, b, p):
    return a.x - p.a, b.x - p.a, a.y - p.b / p.a, b.y - p.b / p.a


@functools.cache
def problem():
    return BoundaryValueProblem(
        rhs, boundary, ["x", "dx", "y", "dy"], {"L": 0.05, "diffx": 0.0016, "diffy": 0.008, "a": 2.0, "b": 4.6},
        functionals={"x_mean": lambda t, u, p: u.x, "y_mean": lambda t, u, p: u.y},
    )  # fmt: skip


@functools.cache
def uniform():
    return trace(solve(problem(), [2, 0, 2.3, 0]), free=["L"], limits={"L": (0.01, 0.45)})


def half_branch(which, sign):
    """The half of the branch of this branch point that leaves with x'(0) of this sign."""
    point = uniform().labelled("BP")[which - 1]
    slope = point.system.states(point.details.tangents[1])[0, 1]
    return trace(point, branch=1, direction=1 if slope * sign > 0 else -1, limits={"L": (0.01, 0.45)})


def mode(n, large):
    """Length at which mode n sets in: the smaller, or the larger, of two."""
    k = (2.8 + (-1 if large else 1) * math.sqrt(2.8**2 - 3.2)) / 0.0032
    return n * math.pi / math.sqrt(k)


def bp(length, **means):
    return Special("BP", {"L": length, **(means or {"x_mean": 2.0, "y_mean": 2.3})})


SHORT, LONG = mode(1, False), mode(1, True)
BROKEN = bp(0.2499576311305638082, x_mean=1.1869089650376463268, y_mean=3.1016003835867505858)
OTHER = bp(0.16983251063125062, x_mean=2.95924155117216802, y_mean=1.770115969921228645)
TOP = Special("LP", {"L": 0.2526678456449982341, "x_mean": 1.2748308481360879456, "y_mean": 3.0360195824914727584})
BOTTOM = Special("LP", {"L": 0.0606398300488063578, "x_mean": 3.91492271034126339, "y_mean": 1.8277262907566724917})
HOME = Special("EP", {"L": SHORT, "x_mean": 2.0, "y_mean": 2.3})
LOOP = [BROKEN, TOP, bp(LONG), OTHER, BOTTOM]
PAIR = [BROKEN, Special("EP", {"L": 2 * SHORT, "x_mean": 2.0, "y_mean": 2.3})]

CASES = [
    Case("bru", uniform, [
        *(bp(length) for length in sorted([*(mode(n, False) for n in range(1, 6)), mode(1, True), mode(2, True)])),
        Special("EP", {"L": 0.45}),
    ]),
    Case("bru: loop", functools.partial(half_branch, 1, -1), [*LOOP, HOME]),
    Case("bru: loop, other way", functools.partial(half_branch, 1, 1), [*LOOP[::-1], HOME]),
    *(Case(f"bru: mode 2{'+' if sign > 0 else '-'}", functools.partial(half_branch, 2, sign), PAIR) for sign in (1, -1)),
]  # fmt: skip
