"""Reaction, diffusion, patterns and flow: boundary value problems with published or computable special points.

Closed forms by scipy's elliptic and Mathieu functions; radial problems by shooting (``bank.shooting``, good to 1e-11).
"""

import functools
import math

from scipy.special import ellipe, ellipj, ellipk, mathieu_a

from bank.case import Case, Special
from bank.known import ERROR, zeros
from contin import BoundaryValueProblem, solve, trace

#: What values of ``bank.shooting`` are good to (the strip has a closed form, which agrees).
SHOT = 1e-11


def flat(problem, limits, states, free=("lam",), **more):
    """The trivial branch with the default settings."""
    return trace(solve(problem, states, free=free[1:]), free=free, limits=limits, **more)


def branch_points(name, *values, end):
    return [*(Special("BP", {name: float(value)}, ERROR) for value in values), Special("EP", {name: float(end)})]


# --- Chafee & Infante (1974): n^2 pi^2, and the first branch by elliptic functions ---------------------------------------

CHAFEE = BoundaryValueProblem(
    lambda t, u, p: (u.v, -p.lam * (u.u - u.u**3)), lambda a, b, p: (a.u, b.u), ["u", "v"], {"lam": 1.0},
    functionals={"square": lambda t, u, p: u.u**2},
)  # fmt: skip


@functools.cache
def rest():
    return flat(CHAFEE, {"lam": (0, 100)}, [0.0, 0.0])


def first_mode():
    return trace(rest().labelled("BP")[0], branch=1, limits={"lam": (0, 80)}, zeros={"lam": [20.0, 40.0]})


def square(lam):
    """lam = 4 (1 + m) K^2 and u = sqrt(2 m / (1 + m)) sn."""
    (m,) = zeros(lambda m: 4 * (1 + m) * ellipk(m) ** 2 - lam, 1e-6, 0.9999)
    return float(2 / (1 + m) * (1 - ellipe(m) / ellipk(m)))


# --- Swift & Hohenberg (1977) on a length of 10: r = (1 - (n pi / 10)^2)^2 --------------------------------------------------

SWIFT = BoundaryValueProblem(
    lambda t, u, p: (u.b, u.c, u.d, (p.r - 1) * u.a - 2 * u.c - u.a**3),
    lambda a, b, p: (a.a, a.c, b.a, b.c),
    ["a", "b", "c", "d"],
    {"r": -0.5},
    domain=(0.0, 10.0),
)
SWIFT_POINTS = sorted((1 - (n * math.pi / 10) ** 2) ** 2 for n in (1, 2, 3, 4))

# --- Cahn & Hilliard (1958): eps^2 u'' = u^3 - u - mu with mean m; 1 - 3 m^2 = (n pi eps)^2, eps = 0.15 --------------------

CAHN = BoundaryValueProblem(
    lambda t, u, p: (u.v, (u.u**3 - u.u - p.mu) / 0.15**2),
    lambda a, b, p: (a.v, b.v),
    ["u", "v"],
    {"m": -1.0, "mu": 0.0},
    integrals=lambda t, u, p: (u.u - p.m,),
)
CAHN_POINTS = sorted(sign * ((1 - (n * math.pi * 0.15) ** 2) / 3) ** 0.5 for n in (1, 2) for sign in (1, -1))


def mixed(m):
    return {"m": m, "mu": m**3 - m}


# --- Kuramoto & Sivashinsky, odd solutions (Hyman & Nicolaenko 1986): alpha = 4 n^2 ----------------------------------------

KURAMOTO = BoundaryValueProblem(
    lambda t, u, p: (u.b, u.c, u.d, -p.alpha / 4 * (u.c + u.a * u.b)),
    lambda a, b, p: (a.a, a.c, b.a, b.c),
    ["a", "b", "c", "d"],
    {"alpha": 1.0},
    domain=(0.0, math.pi),
)

# --- radial problems, by the value at the centre ----------------------------------------------------------------------


def radial(k, rate, top, wall=0.0):
    """u'' + k u' / t + lam rate(u) = 0, u' = 0 at the centre, where u = top."""
    if k == 0:
        return BoundaryValueProblem(
            lambda t, u, p: (u.v, -p.lam * rate(u.u)), lambda a, b, p: (a.v, b.u - wall, a.u - p.top),
            ["u", "v"], {"lam": 0.0, "top": top},
        )  # fmt: skip
    return BoundaryValueProblem(
        lambda t, u, p: (u.v, -p.lam * rate(u.u) - k * u.v / t), lambda a, b, p: (a.v, b.u - wall, a.u - p.top),
        ["u", "v"], {"lam": 0.0, "top": top},
    )  # fmt: skip


def from_zero(problem, start, limits, **more):
    return flat(problem, {"lam": (-0.1, 4), "top": limits}, [start, 0.0], ("lam", "top"), **more)


def pull_in(u):
    return 1 / (1 - u) ** 2


def arrhenius(u):
    return math.exp(u / (1 + 0.2 * u))


def effective(c):
    return -c * math.exp(12 * (1 - c) / (1 + 0.6 * (1 - c)))


DISK, BALL = radial(1, math.exp, 0.0), radial(2, math.exp, 0.0)
HEAT, PELLET = radial(0, arrhenius, 0.0), radial(2, effective, 1.0, 1.0)
STRIP, MEMBRANE = radial(0, pull_in, 0.0), radial(1, pull_in, 0.0)


def shot(label, top, lam):
    return Special(label, {"top": top, "lam": lam}, SHOT)


# --- Troesch's problem (1960): u'' = mu sinh(mu u); u'(0) = 0.0457504614 for mu = 5 ----------------------------------------

TROESCH = BoundaryValueProblem(
    lambda t, u, p: (u.v, p.mu * math.sinh(p.mu * u.u)),
    lambda a, b, p: (a.u, b.u - 1, a.v - p.slope),
    ["u", "v"],
    {"mu": 0.0, "slope": 1.0},
)


def troesch():
    start = solve(TROESCH, lambda t: (t, 1.0), free=["slope"])
    return trace(start, free=["mu", "slope"], limits={"mu": (-0.1, 8)}, zeros={"mu": [1.0, 5.0]})


def troesch_slope(mu):
    """u'(0) = 2 q where sinh(mu / 2) / q = sc(mu | 1 - q^2) (Roberts & Shipman 1972)."""

    def excess(log_q):
        q = math.exp(log_q)
        sn, cn, _, _ = ellipj(mu, 1 - q**2)
        return math.sinh(mu / 2) * cn - q * sn

    return 2 * math.exp(zeros(excess, -mu - 3, min(math.log(4) - mu, -1e-6))[-1])


# --- Mathieu's equation: the lowest characteristic value a(q); -5.80004602 for q = 5 (Abramowitz & Stegun, 20.1) ----------

MATHIEU = BoundaryValueProblem(
    lambda t, u, p: (u.v, -(p.a - 2 * p.q * math.cos(2 * t)) * u.u),
    lambda a, b, p: (a.v, b.v),
    ["u", "v"],
    {"q": 0.0, "a": 0.0},
    integrals=lambda t, u, p: (u.u**2 - 1 / math.pi,),
    domain=(0.0, math.pi),
)


def mathieu():
    start = solve(MATHIEU, [math.pi**-0.5, 0.0], free=["a"])
    return trace(start, free=["q", "a"], limits={"q": (-1, 25)}, zeros={"q": [5.0]})


# --- flow past a wedge (Falkner & Skan 1931; Stewartson 1954): separation at beta = -0.198837735 ---------------------------

WEDGE = BoundaryValueProblem(
    lambda t, u, p: (u.g, u.h, -u.f * u.h - p.beta * (1 - u.g**2)),
    lambda a, b, p: (a.f, a.g, b.g - 1, a.h - p.shear),
    ["f", "g", "h"],
    {"beta": 1.0, "shear": 1.2},
    domain=(0.0, 12.0),
)


def wedge():
    start = solve(WEDGE, lambda t: (t - 0.6 * math.tanh(t), math.tanh(t), math.exp(-t)), free=["shear"])
    limits = {"beta": (-1, 2), "shear": (-0.05, 2)}
    return trace(start, free=["beta", "shear"], direction=-1, limits=limits, zeros={"beta": [0.5, 0.0]})


# --- flow between inclined walls (Jeffery 1915, Hamel 1917), half angle 5 degrees: the shear at the wall vanishes ----------
# With a = 2 angle re / 3 and b = 4 angle^2: 2 K(-a / (a + b)) = sqrt(a + b).

ANGLE = math.radians(5)
HAMEL = BoundaryValueProblem(
    lambda t, u, p: (u.g, u.h, -2 * ANGLE * p.re * u.f * u.g - 4 * ANGLE**2 * u.g),
    lambda a, b, p: (a.f - 1, a.g, b.f, b.g - p.shear),
    ["f", "g", "h"],
    {"re": 0.0, "shear": -2.0},
)


def hamel():
    start = solve(HAMEL, lambda t: (1 - t**2, -2 * t, -2.0), free=["shear"])
    return trace(start, free=["re", "shear"], limits={"re": (-1, 300), "shear": (-5, 0)})


def separated():
    b = 4 * ANGLE**2
    (a,) = zeros(lambda a: 2 * ellipk(-a / (a + b)) - math.sqrt(a + b), 1, 50)
    return float(3 * a / (2 * ANGLE))


SQUARE = math.pi**2
CASES = [
    Case("Chafee-Infante", rest, branch_points("lam", SQUARE, 4 * SQUARE, 9 * SQUARE, end=100)),
    Case("Chafee-Infante: mode 1", first_mode, [
        *(Special("UZ", {"lam": x, "square": square(x)}, ERROR) for x in (20.0, 40.0)),
        Special("EP", {"lam": 80.0, "square": square(80.0)}, ERROR),
    ]),
    Case("Swift-Hohenberg", lambda: flat(SWIFT, {"r": (-1, 1)}, [0.0] * 4, ["r"]), branch_points("r", *SWIFT_POINTS, end=1)),
    Case("Cahn-Hilliard", lambda: flat(CAHN, {"m": (-1.1, 1)}, [-1.0, 0.0], ["m", "mu"]), [
        *(Special("BP", mixed(m), ERROR) for m in CAHN_POINTS), Special("EP", mixed(1.0)),
    ]),
    Case("Kuramoto-Sivashinsky", lambda: flat(KURAMOTO, {"alpha": (0, 70)}, [0.0] * 4, ["alpha"]),
         branch_points("alpha", 4, 16, 36, 64, end=70)),
    Case("Gelfand, disk", lambda: from_zero(DISK, 0.0, (-1, 6)), [
        Special("LP", {"lam": 2.0, "top": 2 * math.log(2)}),
        Special("EP", {"lam": 8 * (math.exp(3) - 1) / math.exp(6), "top": 6.0}),
    ]),
    Case("Gelfand, ball", lambda: from_zero(BALL, 0.0, (-1, 10)), [
        shot("LP", 1.6074567750838384, 3.3219921183398187), shot("LP", 6.740792419561775, 1.664156189756799),
        shot("EP", 10.0, 2.0431818069143697),
    ]),
    Case("Frank-Kamenetskii", lambda: from_zero(HEAT, 0.0, (-1, 40)), [
        shot("LP", 2.3541260392688192, 1.1619795022822488), shot("LP", 15.414097530472159, 0.877482235378639),
        shot("EP", 40.0, 1.0749292822746492),
    ]),
    Case("electrostatic strip", lambda: from_zero(STRIP, 0.0, (-1, 0.9)), [
        shot("LP", 0.388346718912782, 0.35000411934274955), shot("EP", 0.9, 0.06390467160527132),
    ]),
    Case("electrostatic membrane", lambda: from_zero(MEMBRANE, 0.0, (-1, 0.95)), [
        shot("LP", 0.4442922847813729, 0.789229267864562), shot("LP", 0.9422340673565702, 0.41533025488006253),
        shot("EP", 0.95, 0.4161081616388071),
    ]),
    Case("catalyst pellet", lambda: from_zero(PELLET, 1.0, (0.001, 1.1)), [
        shot("LP", 0.8267526582666574, 0.32702220159762596), shot("LP", 0.02199888948477267, 0.08839975780154867),
        shot("EP", 0.001, 0.11126530786909235),
    ]),
    Case("Troesch", troesch, [
        *(Special("UZ", {"mu": x, "slope": troesch_slope(x)}, ERROR) for x in (1.0, 5.0)),
        Special("EP", {"mu": 8.0, "slope": troesch_slope(8.0)}, ERROR),
    ]),
    Case("Mathieu", mathieu, [
        Special("UZ", {"q": 5.0, "a": float(mathieu_a(0, 5.0))}, 1e-12),
        Special("EP", {"q": 25.0, "a": float(mathieu_a(0, 25.0))}, 1e-12),
    ]),
    Case("Falkner-Skan", wedge, [
        Special("UZ", {"beta": 0.5, "shear": 0.9276800398}, 1e-10), Special("UZ", {"beta": 0.0, "shear": 0.46959998836}, 1e-11),
        Special("LP", {"beta": -0.198837735, "shear": 0.0}, 5e-10), Special("EP", {"shear": -0.05}),
    ]),
    Case("Jeffery-Hamel", hamel, [Special("EP", {"re": separated(), "shear": 0.0}, ERROR)]),
]  # fmt: skip
