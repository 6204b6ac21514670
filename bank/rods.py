"""Columns, strings and films: boundary value problems whose buckling loads are known in closed form.

Zeros of Bessel functions and elliptic integrals by scipy; no other numerics.
"""

import functools
import math

import numpy as np
from scipy.special import ellipk, j0, jv

from bank.case import Case, Special
from bank.known import ERROR, zeros
from contin import BoundaryValueProblem, solve, trace


def loads(*values, end, error=ERROR):
    """A trivial branch: branch points at these loads, and its end."""
    return [*(Special("BP", {"lam": float(value)}, error) for value in values), Special("EP", {"lam": float(end)})]


def trivial(problem, end, free=("lam",)):
    """The trivial branch from lam = 1 to an end, with the default settings."""
    start = solve(problem, [0.0] * len(problem.states), free=free[1:])
    return trace(start, free=free, limits={"lam": (0, end)})


# --- a heavy column, clamped below (Greenhill 1881): 7.8373 --------------------------------------------------------------

GREENHILL = BoundaryValueProblem(
    lambda t, u, p: (u.v, -p.lam * (1 - t) * math.sin(u.theta)), lambda a, b, p: (a.theta, b.v), ["theta", "v"], {"lam": 1.0}
)
GREENHILL_LOADS = [2.25 * x**2 for x in zeros(lambda x: jv(-1 / 3, x), 0.1, 6.0)]

# --- a rotating chain that hangs from above (Kolodner 1955), u'' + lam u / sqrt(t^2 + u^2) = 0: j0^2 / 4 = 1.4458, ... ------

KOLODNER = BoundaryValueProblem(
    lambda t, u, p: (u.v, -p.lam * u.u / math.sqrt(t**2 + u.u**2)), lambda a, b, p: (a.u, b.v), ["u", "v"], {"lam": 1.0}
)
KOLODNER_LOADS = [x**2 / 4 for x in zeros(j0, 0.1, 9.0)]

# --- a column clamped at one end and pinned at the other: lam = x^2 with tan(x) = x, 20.19, 59.68 -------------------------
# The force across, q, is found with the load: it keeps the pinned end on the axis.

PINNED = BoundaryValueProblem(
    lambda t, u, p: (u.v, -p.lam * math.sin(u.theta) + p.q * math.cos(u.theta)),
    lambda a, b, p: (a.theta, b.v),
    ["theta", "v"],
    {"lam": 1.0, "q": 0.0},
    integrals=lambda t, u, p: (math.sin(u.theta),),
)
PINNED_LOADS = [x**2 for x in zeros(lambda x: math.sin(x) - x * math.cos(x), 1.0, 8.0)]

# --- a beam on a foundation with k = 4 pi^4: modes 1 and 2 buckle at the same load, 5 pi^2; mode 3 at 85 pi^2 / 9 ----------

FOUNDATION = BoundaryValueProblem(
    lambda t, u, p: (u.b, u.c, u.d, -p.lam * u.c - p.k * (u.a - u.a**3)),
    lambda a, b, p: (a.a, a.c, b.a, b.c),
    ["a", "b", "c", "d"],
    {"lam": 30.0, "k": 4 * math.pi**4},
)


def other_foundation():
    """k = 20: one mode at a time, n^2 pi^2 + 20 / (n pi)^2."""
    start = solve(FOUNDATION, [0.0] * 4, {"lam": 1.0, "k": 20.0})
    return trace(start, free=["lam"], limits={"lam": (0, 100)})


# --- an elastica that is compressed as well as bent: lam (1 - lam / 160) = n^2 pi^2, two loads for every mode --------------

SOFT = BoundaryValueProblem(
    lambda t, u, p: (u.v, -p.lam * (1 - p.lam * math.cos(u.theta) / 160) * math.sin(u.theta)),
    lambda a, b, p: (a.v, b.v),
    ["theta", "v"],
    {"lam": 1.0},
)
SOFT_LOADS = sorted(80 + sign * (6400 - 160 * (n * math.pi) ** 2) ** 0.5 for n in (1, 2) for sign in (1, -1))

# --- a skipping rope in space: every plane through the axis is as good as another ----------------------------------------

ROPE = BoundaryValueProblem(
    lambda t, u, p: (u.c, u.d, -p.lam * u.a / (1 + u.a**2 + u.b**2), -p.lam * u.b / (1 + u.a**2 + u.b**2)),
    lambda a, b, p: (a.a, a.b, b.a, b.b),
    ["a", "b", "c", "d"],
    {"lam": 1.0},
)

# --- the elastica, clamped and free, by the angle of its tip: lam = K(sin(tip / 2))^2 (Euler 1744) -------------------------

EULER = BoundaryValueProblem(
    lambda t, u, p: (u.v, -p.lam * math.sin(u.theta)),
    lambda a, b, p: (a.theta, b.v, b.theta - p.tip),
    ["theta", "v"],
    {"lam": 1.0, "tip": 0.0},
)


@functools.cache
def euler():
    return trivial(EULER, 70, free=("lam", "tip"))


def bent():
    """20, 60, 100, 140 degrees."""
    point = euler().labelled("BP")[0]
    tip = point.system.parameter_index("tip")
    direction = 1 if point.details.tangents[1][tip] > 0 else -1
    angles = [math.radians(angle) for angle in (20, 60, 100)]
    return trace(point, branch=1, direction=direction, limits={"tip": (-1, math.radians(140))}, zeros={"tip": angles})


def tip_load(degrees):
    return float(ellipk(math.sin(math.radians(degrees) / 2) ** 2)) ** 2


# --- a soap film between two rings (Euler 1744): r = c cosh(1 / c), fold at tanh(1 / c) = c ---------------------------------

SOAP = BoundaryValueProblem(
    lambda t, u, p: (u.v, (1 + u.v**2) / u.u),
    lambda a, b, p: (a.v, b.u - p.r, a.u - p.waist),
    ["u", "v"],
    {"r": 3.0, "waist": 2.8},
)


def film():
    start = solve(SOAP, [2.8, 0.0], free=["waist"])
    return trace(start, free=["r", "waist"], direction=-1, limits={"r": (0, 3.1)}, zeros={"r": [2.0]})


def radius(waist):
    return waist * np.cosh(1 / waist)


def films():
    (fold,) = zeros(lambda c: np.tanh(1 / c) - c, 0.3, 2.0)
    at_two = [zeros(lambda c: radius(c) - 2, *ends)[0] for ends in ((fold, 2), (0.3, fold))]
    end = zeros(lambda c: radius(c) - 3.1, 0.3, fold)[0]
    points = ("UZ", at_two[0]), ("LP", fold), ("UZ", at_two[1]), ("EP", end)
    return [Special(label, {"r": float(radius(c)), "waist": c}, ERROR) for label, c in points]


SQUARE = math.pi**2
CASES = [
    Case("heavy column", lambda: trivial(GREENHILL, 60), loads(*GREENHILL_LOADS, end=60)),
    Case("rotating chain", lambda: trivial(KOLODNER, 20), loads(*KOLODNER_LOADS, end=20)),
    Case("clamped and pinned", lambda: trivial(PINNED, 70, ("lam", "q")), loads(*PINNED_LOADS, end=70)),
    Case("beam on a foundation, double", lambda: trivial(FOUNDATION, 100),
         loads(5 * SQUARE, 85 * SQUARE / 9, end=100)),
    Case("beam on a foundation", other_foundation,
         loads(*(n**2 * SQUARE + 20 / (n**2 * SQUARE) for n in (1, 2, 3)), end=100)),
    Case("compressible elastica", lambda: trivial(SOFT, 155), loads(*SOFT_LOADS, end=155)),
    Case("skipping rope", lambda: trivial(ROPE, 50), loads(SQUARE, 4 * SQUARE, end=50)),
    Case("elastica, clamped and free", euler, loads(*(n**2 * SQUARE / 4 for n in (1, 3, 5)), end=70)),
    Case("elastica, bent", bent, [
        *(Special("UZ", {"tip": math.radians(x), "lam": tip_load(x)}, ERROR) for x in (20, 60, 100)),
        Special("EP", {"tip": math.radians(140), "lam": tip_load(140)}, ERROR),
    ]),
    Case("soap film", film, films()),
]  # fmt: skip
