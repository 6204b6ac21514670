"""Equilibria of published models, with their folds, branch points and Hopf points.

Every branch is known in closed form (parameter and states as functions of one number). Special points are the zeros of one
function on it (``bank.known``). Published values, where there are some, stand beside the problem.
"""

import functools

import numpy as np

from bank.case import Case, Special
from bank.known import ERROR, equilibria, zeros
from contin import AlgebraicProblem, solve, trace


def follow(problem, start, free, limits, **more):
    """The branch through ``start`` (states), with the default settings."""
    return trace(solve(problem, start, more.pop("at", None)), free=[free], limits=limits, **more)


def switch(trunk, which, free, limits, state=0, sign=1):
    """The half of a branch that leaves branch point number ``which`` of a run with this sign of a state's change."""
    point = trunk().labelled("BP")[which]
    change = point.details.tangents[1][state]
    return trace(point, branch=1, direction=1 if change * sign > 0 else -1, free=[free], limits=limits)


# --- FitzHugh & Nagumo (AUTO demo ``fhn``): a = x (1 - b) ... Hopf points where the trace vanishes ---------------------

FITZHUGH = AlgebraicProblem(
    lambda u, p: (p.c * (u.x - u.x**3 / 3 + u.y), -(u.x - p.a + p.b * u.y) / p.c),
    ["x", "y"],
    {"a": 0.0, "b": 0.8, "c": 3.0},
    functionals={"x": lambda u, p: u.x},
)


def fitzhugh(x):
    y = x**3 / 3 - x
    return (x, y), x + 0.8 * y


# --- Hodgkin & Huxley (1952): Hopf points at 9.78 and 154.5 microamperes per square centimetre (Rinzel & Miller 1980) ----


def alpha_n(v):
    return 0.01 * (10 - v) / (np.exp((10 - v) / 10) - 1)


def beta_n(v):
    return 0.125 * np.exp(-v / 80)


def alpha_m(v):
    return 0.1 * (25 - v) / (np.exp((25 - v) / 10) - 1)


def beta_m(v):
    return 4 * np.exp(-v / 18)


def alpha_h(v):
    return 0.07 * np.exp(-v / 20)


def beta_h(v):
    return 1 / (np.exp((30 - v) / 10) + 1)


def hodgkin_residual(u, p):
    return (
        p.current - 120 * u.m**3 * u.h * (u.v - 115) - 36 * u.n**4 * (u.v + 12) - 0.3 * (u.v - 10.599),
        alpha_m(u.v) * (1 - u.m) - beta_m(u.v) * u.m,
        alpha_h(u.v) * (1 - u.h) - beta_h(u.v) * u.h,
        alpha_n(u.v) * (1 - u.n) - beta_n(u.v) * u.n,
    )


HODGKIN = AlgebraicProblem(hodgkin_residual, ["v", "m", "h", "n"], {"current": 0.0}, functionals={"v": lambda u, p: u.v})


def hodgkin(v):
    pairs = (alpha_m(v), beta_m(v)), (alpha_h(v), beta_h(v)), (alpha_n(v), beta_n(v))
    m, h, n = (a / (a + b) for a, b in pairs)
    return (v, m, h, n), 120 * m**3 * h * (v - 115) + 36 * n**4 * (v + 12) + 0.3 * (v - 10.599)


def at_current(current, low, high):
    return zeros(lambda v: hodgkin(v)[1] - current, low, high)[0]


# --- Morris & Lecar (1981), the constants of Rinzel & Ermentrout (1989), Hopf regime: 93.86 and 212 --------------------


def lecar_residual(u, p):
    m = 0.5 * (1 + np.tanh((u.v + 1.2) / 18))
    w = 0.5 * (1 + np.tanh((u.v - 2) / 30))
    rate = 0.04 * np.cosh((u.v - 2) / 60)
    return (
        (p.current - 4.4 * m * (u.v - 120) - 8 * u.w * (u.v + 84) - 2 * (u.v + 60)) / 20,
        rate * (w - u.w),
    )


LECAR = AlgebraicProblem(lecar_residual, ["v", "w"], {"current": 0.0}, functionals={"v": lambda u, p: u.v})


def lecar(v):
    m, w = 0.5 * (1 + np.tanh((v + 1.2) / 18)), 0.5 * (1 + np.tanh((v - 2) / 30))
    return (v, w), 4.4 * m * (v - 120) + 8 * w * (v + 84) + 2 * (v + 60)


# --- Lorenz's model of the atmosphere (1984), G = 0.25: with w = y + i z, w (1 - x - i b x) = G --------------------------

LORENZ84 = AlgebraicProblem(
    lambda u, p: (
        -(u.y**2) - u.z**2 - 0.25 * u.x + 0.25 * p.F,
        u.x * u.y - 4 * u.x * u.z - u.y + p.G,
        4 * u.x * u.y + u.x * u.z - u.z,
    ),
    ["x", "y", "z"],
    {"F": 0.0, "G": 0.25},
    functionals={"x": lambda u, p: u.x},
)


def lorenz84(x, g=0.25):
    size = (1 - x) ** 2 + 16 * x**2
    y, z = g * (1 - x) / size, g * 4 * x / size
    return (x, y, z), x + 4 * g**2 / size


# --- Roessler (1976): x = a y', fold at c^2 = 4 a b; with a = b a Hopf point lies right there ----------

ROESSLER = AlgebraicProblem(
    lambda u, p: (-u.y - u.z, u.x + p.a * u.y, p.b + u.z * (u.x - p.c)),
    ["x", "y", "z"],
    {"a": 0.2, "b": 0.3, "c": 5.0},
    functionals={"x": lambda u, p: u.x},
)


def roessler(z):
    return (0.2 * z, -z, z), 0.2 * z + 0.3 / z


# --- glycolysis (Sel'kov 1968; Strogatz, section 7.3): Hopf points at b^2 = (1 - 2 a -+ sqrt(1 - 8 a)) / 2 ---------------

SELKOV = AlgebraicProblem(
    lambda u, p: (-u.x + p.a * u.y + u.x**2 * u.y, p.b - p.a * u.y - u.x**2 * u.y),
    ["x", "y"],
    {"a": 0.06, "b": 0.1},
    functionals={"y": lambda u, p: u.y},
)


def selkov(b):
    return (b, b / (0.06 + b**2)), b


# --- autocatalysis in a stirred tank (Gray & Scott 1983): x' = -x y^2 + f (1 - x), y' = x y^2 - (f + k) y -----------------

GRAY = AlgebraicProblem(
    lambda u, p: (-u.x * u.y**2 + p.f * (1 - u.x), u.x * u.y**2 - (p.f + p.k) * u.y),
    ["x", "y"],
    {"f": 0.03, "k": 0.0},
    functionals={"y": lambda u, p: u.y},
)


def gray(y, f=0.03):
    """y (1 - x) ...: f (1 - x) = (f + k) y and x y = f + k."""
    x = f / (f + y**2)
    return (x, y), x * y - f


# --- oxidation of CO (Bykov, Yablonskii & Kim 1978; the tutorial example of MatCont) ------------------------------------


def bykov_residual(u, p):
    free = 1 - u.x - u.y - u.s
    return (
        2 * 2.5 * free**2 - 2 * 1.0 * u.x**2 - 10 * u.x * u.y,
        p.q2 * free - 0.1 * u.y - 10 * u.x * u.y,
        0.0675 * free - 0.0675 * 0.4 * u.s,
    )


BYKOV = AlgebraicProblem(bykov_residual, ["x", "y", "s"], {"q2": 0.5}, functionals={"x": lambda u, p: u.x})


def bykov(x):
    """z: the free sites; s = z / 0.4, y = (5 z^2 - 2 x^2) / (10 x) and x + y + 3.5 z = 1, quadratic in z."""
    a, b, c = 0.5 / x, 3.5, 0.8 * x - 1
    z = (-b + np.sqrt(b**2 - 4 * a * c)) / (2 * a)
    y = (5 * z**2 - 2 * x**2) / (10 * x)
    return (x, y, z / 0.4), (0.1 * y + 10 * x * y) / z


# --- predator and prey (Rosenzweig & MacArthur 1963) --------------------------------------------------------------------

ROSENZWEIG = AlgebraicProblem(
    lambda u, p: (u.x * (1 - u.x / p.K) - u.x * u.y / (1 + u.x), u.y * (2 * u.x / (1 + u.x) - 1)),
    ["x", "y"],
    {"K": 0.5},
    functionals={"x": lambda u, p: u.x, "y": lambda u, p: u.y},
)


@functools.cache
def prey():
    return follow(ROSENZWEIG, [0.5, 0.0], "K", {"K": (0.2, 5)})


# --- a food chain (AUTO demo ``pp3``) -----------------------------------------------------------------------------------

CHAIN = AlgebraicProblem(
    lambda u, p: (
        u.x * (1 - u.x) - 4 * u.x * u.y,
        -0.25 * u.y + 4 * u.x * u.y - 3 * u.y * u.z - p.p1 * (1 - np.exp(-5 * u.y)),
        -0.5 * u.z + 3 * u.y * u.z,
    ),
    ["x", "y", "z"],
    {"p1": 0.0},
    functionals={"x": lambda u, p: u.x, "z": lambda u, p: u.z},
)


@functools.cache
def first_of_chain():
    return follow(CHAIN, [1.0, 0.0, 0.0], "p1", {"p1": (-0.1, 1)})


@functools.cache
def second_of_chain():
    return switch(first_of_chain, 0, "p1", {"p1": (0, 1.2)}, sign=-1)


def two_of_chain(y):
    x = 1 - 4 * y
    return (x, y, 0 * y), (4 * x - 0.25) * y / (1 - np.exp(-5 * y))


def three_of_chain(z):
    x, y = 1 / 3, 1 / 6
    return (x, y, z), (4 * x - 0.25 - 3 * z) * y / (1 - np.exp(-5 * y))


# --- a harvested lake (Scheffer; AUTO demo ``mtn``), K = 6: the predator z gives the prey's growth ----------------------

LAKE = AlgebraicProblem(
    lambda u, p: (
        0.5 * u.x * (1 - u.x / 6) - u.y * 0.4 * u.x / (0.6 + u.x) + 0.06,
        0.24 * u.x / (0.6 + u.x) * u.y - 0.15 * u.y - p.gf * u.y**2 / (u.y**2 + 0.25),
    ),
    ["x", "y"],
    {"gf": 0.06},
    functionals={"x": lambda u, p: u.x},
)


def lake(x):
    y = (0.5 * x * (1 - x / 6) + 0.06) * (0.6 + x) / (0.4 * x)
    return (x, y), (0.24 * x / (0.6 + x) - 0.15) * (y**2 + 0.25) / y


# --- Chua's circuit (AUTO demo ``chu``), smooth diode: at alpha = 0 every x is an equilibrium --------------------------------


def diode(x):
    steps = (x + 1) * np.arctan(10 * (x + 1)) - (x - 1) * np.arctan(10 * (x - 1))
    return 2 * x / 7 + 0.5 * (-1 / 7 - 2 / 7) * 2 / np.pi * steps


CHUA = AlgebraicProblem(
    lambda u, p: (p.alpha * (u.y - diode(u.x)), u.x - u.y + u.z, -p.beta * u.y), ["x", "y", "z"], {"alpha": -1.0, "beta": 14.3}
)


def origin_of_chua(alpha):
    return (0.0, 0.0, 0.0), alpha


# --- an electronic oscillator (AUTO demo ``tor``): the origin loses stability to a pitchfork and to oscillations -----------

OSCILLATOR = AlgebraicProblem(
    lambda u, p: (
        (-(p.beta + p.nu) * u.x + p.beta * u.y - 0.328578 * u.x**3 + 0.933578 * (u.y - u.x) ** 3) / 0.6,
        p.beta * u.x - (p.beta - 0.6) * u.y - u.z - 0.933578 * (u.y - u.x) ** 3,
        u.y,
    ),
    ["x", "y", "z"],
    {"nu": -0.95, "beta": 0.5},
)


def origin_of_oscillator(nu):
    return (0.0, 0.0, 0.0), nu


# --- control of a vibration (AUTO demo ``ops``): a Hopf point at p3 where the cubic's roots are imaginary ----------------

CONTROL = AlgebraicProblem(
    lambda u, p: ((-2 * (u.x**3 / 3 - u.x) + (u.z - u.x) / 4 - u.y) / 0.5, u.x - p.p3, -(u.z - u.x) / 4),
    ["x", "y", "z"],
    {"p3": 1.5},
    functionals={"y": lambda u, p: u.y},
)


def control(x):
    return (x, -2 * (x**3 / 3 - x), x), x


# --- oxygen and substrate in a layer with an enzyme (AUTO demo ``plp``) -------------------------------------------------

LAYER = AlgebraicProblem(
    lambda u, p: (
        p.s0 - u.s - p.rho * u.s * u.a / (1 + u.s + u.s**2),
        0.2 * (500 - u.a) - p.rho * u.s * u.a / (1 + u.s + u.s**2),
    ),
    ["s", "a"],
    {"s0": 0.0, "rho": 0.5},
    functionals={"s": lambda u, p: u.s},
)


def layer(s, rho=0.5):
    rate = rho * s / (1 + s + s**2)
    a = 100 / (0.2 + rate)
    return (s, a), s + rate * a


# --- a genetic switch (Gardner, Cantor & Collins 2000): pitchfork at alpha = 2 -----------------------------------------

SWITCH = AlgebraicProblem(
    lambda u, p: (p.alpha / (1 + u.v**2) - u.u, p.alpha / (1 + u.u**2) - u.v),
    ["u", "v"],
    {"alpha": 0.5},
    functionals={"u": lambda u, p: u.u},
)


@functools.cache
def even():
    return follow(SWITCH, [0.4, 0.4], "alpha", {"alpha": (0, 5)})


# --- two coupled Brusselators (Prigogine & Lefever 1968; exchange 0.02 and 0.2): uniform state x = 2, y = b / 2 ----------

CELLS = AlgebraicProblem(
    lambda u, p: (
        2 - (p.b + 1) * u.x + u.x**2 * u.y + p.dx * (u.X - u.x),
        p.b * u.x - u.x**2 * u.y + p.dy * (u.Y - u.y),
        2 - (p.b + 1) * u.X + u.X**2 * u.Y + p.dx * (u.x - u.X),
        p.b * u.X - u.X**2 * u.Y + p.dy * (u.y - u.Y),
    ),
    ["x", "y", "X", "Y"],
    {"b": 2.0, "dx": 0.1, "dy": 0.4},
)


def uniform(b):
    return (2.0, b / 2, 2.0, b / 2), b


# --- Ziegler's column under a follower force with damping 1, 1 (Herrmann & Jong 1965): flutter at 41 / 28 + 1 / 2 ----------


def ziegler_residual(u, p):
    """Masses 2 and 1, unit lengths and springs: 3 a'' + b'' = m1, a'' + b'' = m2 (small angles, cubic springs)."""
    m1 = -2 * u.a + u.b - u.a**3 + p.force * (u.a - u.b) - p.c * (2 * u.va - u.vb)
    m2 = u.a - u.b - (u.b - u.a) ** 3 - p.c * (u.vb - u.va)
    return u.va, u.vb, (m1 - m2) / 2, (3 * m2 - m1) / 2


ZIEGLER = AlgebraicProblem(ziegler_residual, ["a", "b", "va", "vb"], {"force": 0.0, "c": 1.0})


def straight(force):
    return (0.0, 0.0, 0.0, 0.0), force


# --- Bogdanov & Takens: x' = y, y' = mu + nu y - x^2 + x y (n. f.); fold at mu = 0, Hopf at mu = nu^2 -------------------

BOGDANOV = AlgebraicProblem(
    lambda u, p: (u.y, p.mu + p.nu * u.y - u.x**2 + u.x * u.y), ["x", "y"], {"mu": 4.0, "nu": 1.0},
    functionals={"x": lambda u, p: u.x},
)  # fmt: skip


def bogdanov(x):
    return (x, 0 * x), x**2


# --- Langford's interaction of Hopf and steady bifurcation: the axis x = y = 0, lam = z^3 / 3 - ... ------------------------

LANGFORD = AlgebraicProblem(
    lambda u, p: (
        (u.z - 0.7) * u.x - 3.5 * u.y,
        3.5 * u.x + (u.z - 0.7) * u.y,
        p.lam + u.z - u.z**3 / 3 - (u.x**2 + u.y**2) * (1 + 0.25 * u.z),
    ),
    ["x", "y", "z"],
    {"lam": -3.0},
    functionals={"z": lambda u, p: u.z},
)


def langford(z):
    return (0 * z, 0 * z, z), z**3 / 3 - z


CASES = [
    Case("FitzHugh-Nagumo", lambda: follow(FITZHUGH, [0.0, 0.0], "a", {"a": (-1, 2)}),
         lambda: equilibria(FITZHUGH, "a", fitzhugh, 0.0, zeros(lambda x: fitzhugh(x)[1] - 2, 0, 4)[0])),
    Case("Hodgkin-Huxley", lambda: follow(HODGKIN, [0.0, 0.05, 0.6, 0.3], "current", {"current": (-1, 200)}),
         lambda: equilibria(HODGKIN, "current", hodgkin, at_current(0, -1.1, 1), at_current(200, 20.1, 41))),
    Case("Morris-Lecar", lambda: follow(LECAR, [-60.0, 0.0], "current", {"current": (-10, 300)}),
         lambda: equilibria(LECAR, "current", lecar, *(zeros(lambda v, c=c: lecar(v)[1] - c, -70, 60)[0] for c in (0, 300)))),
    Case("Lorenz 1984", lambda: follow(LORENZ84, [0.0, 0.25, 0.0], "F", {"F": (-1, 3), "x": (-1, 3)}),
         lambda: equilibria(LORENZ84, "F", lorenz84, zeros(lambda x: lorenz84(x)[1], -0.5, 0.1)[-1],
                    zeros(lambda x: lorenz84(x)[1] - 3, 0, 4)[0])),
    Case("Roessler", lambda: follow(ROESSLER, [0.01, -0.06, 0.06], "c", {"c": (-1, 10)}, direction=-1),
         lambda: equilibria(ROESSLER, "c", roessler, *(zeros(lambda z, c=c: roessler(z)[1] - c, *ends)[0]
                                               for c, ends in ((5, (0.01, 0.9)), (10, (2, 60)))))),
    Case("Selkov", lambda: follow(SELKOV, [0.1, 1.0], "b", {"b": (0, 2)}), lambda: equilibria(SELKOV, "b", selkov, 0.1, 2.0)),
    Case("Gray-Scott", lambda: follow(GRAY, [0.03, 0.97], "k", {"k": (-0.02, 0.1)}),
         lambda: equilibria(GRAY, "k", gray, *(zeros(lambda y, k=k: gray(y)[1] - k, *ends)[0]
                                       for k, ends in ((0, (0.5, 1)), (-0.02, (0.001, 0.1)))))),
    Case("CO oxidation", lambda: follow(BYKOV, [0.23, 0.05, 0.52], "q2", {"q2": (0.4, 2)}),
         lambda: equilibria(BYKOV, "q2", bykov, *(zeros(lambda x, q=q: bykov(x)[1] - q, *ends)[0]
                                          for q, ends in ((0.5, (0.2, 0.3)), (2, (0.001, 0.01)))))),
    Case("prey alone", prey, [Special("BP", {"K": 1.0, "x": 1.0, "y": 0.0}), Special("EP", {"K": 5.0, "x": 5.0, "y": 0.0})]),
    Case("prey and predator", lambda: switch(prey, 0, "K", {"K": (0.2, 5), "y": (-0.5, 3)}, state=1),
         [Special("HB", {"K": 3.0, "x": 1.0, "y": 4 / 3, "frequency": 3 ** -0.5}, ERROR),
          Special("EP", {"K": 5.0, "x": 1.0, "y": 1.6}, ERROR)]),
    Case("food chain: 1", first_of_chain, [Special("BP", {"p1": 0.75, "x": 1.0, "z": 0.0}), Special("EP", {"p1": 1.0})]),
    Case("food chain: 2", second_of_chain,
         lambda: equilibria(CHAIN, "p1", two_of_chain, 1e-9, zeros(lambda y: two_of_chain(y)[1], 0.2, 0.25)[0])),
    Case("food chain: 3", lambda: switch(second_of_chain, 0, "p1", {"p1": (0, 1.2), "z": (-0.1, 1)}, state=2),
         lambda: equilibria(CHAIN, "p1", three_of_chain, 1e-9, 13 / 36)),
    Case("lake", lambda: follow(LAKE, [6.0, 0.17], "gf", {"gf": (-0.1, 0.2)}, direction=-1, at={"gf": 0.11}),
         lambda: equilibria(LAKE, "gf", lake, *(zeros(lambda x, g=g: lake(x)[1] - g, *ends)[0]
                                        for g, ends in ((0.11, (5.9, 6)), (-0.1, (0.3, 0.6)))))),
    Case("Chua's origin", lambda: follow(CHUA, [0.0, 0.0, 0.0], "alpha", {"alpha": (-2, 5)}),
         lambda: equilibria(CHUA, "alpha", origin_of_chua, -1.0, 5.0)),
    Case("tor's origin", lambda: follow(OSCILLATOR, [0.0, 0.0, 0.0], "nu", {"nu": (-1, 1)}),
         lambda: equilibria(OSCILLATOR, "nu", origin_of_oscillator, -0.95, 1.0)),
    Case("vibration control", lambda: follow(CONTROL, [1.5, 0.75, 1.5], "p3", {"p3": (0, 2)}, direction=-1),
         lambda: equilibria(CONTROL, "p3", control, 1.5, 0.0)),
    Case("substrate and oxygen", lambda: follow(LAYER, [0.0, 500.0], "s0", {"s0": (-10, 80)}),
         lambda: equilibria(LAYER, "s0", layer, 0.0, zeros(lambda s: layer(s)[1] - 80, 0, 80)[0])),
    Case("genetic switch", even, [Special("BP", {"alpha": 2.0, "u": 1.0}), Special("EP", {"alpha": 5.0}, ERROR)]),
    Case("genetic switch: on", lambda: switch(even, 0, "alpha", {"alpha": (0, 5), "u": (0.01, 10)}),
         [Special("EP", {"alpha": 5.0, "u": (5 + 21**0.5) / 2}, ERROR)]),
    Case("two Brusselators", lambda: follow(CELLS, [2.0, 1.0, 2.0, 1.0], "b", {"b": (0, 12)}),
         lambda: equilibria(CELLS, "b", uniform, 2.0, 12.0)),
    Case("Ziegler's column", lambda: follow(ZIEGLER, [0.0, 0.0, 0.0, 0.0], "force", {"force": (-1, 3)}),
         lambda: equilibria(ZIEGLER, "force", straight, 0.0, 3.0)),
    Case("Bogdanov-Takens", lambda: follow(BOGDANOV, [2.0, 0.0], "mu", {"mu": (-1, 5)}, direction=-1),
         lambda: equilibria(BOGDANOV, "mu", bogdanov, 2.0, -(5**0.5))),
    Case("Langford", lambda: follow(LANGFORD, [0.0, 0.0, -2.5], "lam", {"lam": (-4, 4), "z": (-4, 4)}),
         lambda: equilibria(LANGFORD, "lam", langford, zeros(lambda z: langford(z)[1] + 3, -4, -2)[0],
                    zeros(lambda z: langford(z)[1] - 4, 2, 4)[0])),
]  # fmt: skip
