"""Problems of the textbooks whose branches are known in closed form: Bratu, the elastica, and a pitchfork."""

import functools
import math

from scipy.integrate import quad
from scipy.optimize import brentq
from scipy.special import ellipk

from contin import AlgebraicProblem, BoundaryValueProblem


@functools.cache
def bratu():
    """u'' + lam exp(u) = 0, u(0) = u(1) = 0; the functional "mean" is the mean of u.

    In closed form u = 2 log(cosh(s) / cosh(s (1 - 2 t))) with lam = 8 s^2 / cosh(s)^2 and u(1/2) = 2 log(cosh(s)).
    """
    return BoundaryValueProblem(
        lambda t, u, p: (u.v, -p.lam * math.exp(u.u)), lambda a, b, p: (a.u, b.u), ["u", "v"], {"lam": 0.0},
        functionals={"mean": lambda t, u, p: u.u},
    )  # fmt: skip


def bratu_load(s):
    """lam on the branch of Bratu's problem, by the parameter s of the closed form."""
    return 8 * s**2 / math.cosh(s) ** 2


def bratu_load_of(middle):
    """lam where u(1/2) has a value."""
    return bratu_load(math.acosh(math.exp(middle / 2)))


def bratu_mean(s):
    """The mean of u: 2 log(cosh(s)) minus twice the mean of log(cosh(s y)) over 0 < y < 1."""
    return 2 * math.log(math.cosh(s)) - 2 * quad(lambda y: math.log(math.cosh(s * y)), 0, 1, epsabs=1e-13, epsrel=1e-13)[0]


def bratu_fold():
    """lam at the fold: the largest, where s tanh(s) = 1; 3.513830719125 in the literature."""
    return bratu_load(brentq(lambda s: s * math.tanh(s) - 1, 1, 2, xtol=1e-15))


def bratu_middles(lam):
    """Both values of u(1/2) at a lam below the fold, the smaller one first."""
    ends = (0.01, 1.19), (1.2, 20)  # s = 1.1997 at the fold
    return [2 * math.log(math.cosh(brentq(lambda s: bratu_load(s) - lam, *pair, xtol=1e-15))) for pair in ends]


@functools.cache
def elastica(lam=5.0):
    """theta'' + lam sin(theta) + k theta = 0 with theta' = 0 at both ends; k is zero unless it is set.

    The straight elastica buckles at lam = (j pi)^2 - k. The functional "mode" is the projection on the first mode.
    """
    return BoundaryValueProblem(
        lambda t, u, p: (u.v, -p.lam * math.sin(u.theta) - p.k * u.theta), lambda a, b, p: (a.v, b.v), ["theta", "v"],
        {"lam": lam, "k": 0.0}, functionals={"mode": lambda t, u, p: u.theta * math.cos(math.pi * t)},
    )  # fmt: skip


def buckling_loads(count):
    """lam at the first branch points of the straight elastica (Euler)."""
    return [(j * math.pi) ** 2 for j in range(1, count + 1)]


def elastica_load(angle):
    """lam on the first buckled branch, by theta(0): (2 K(sin(theta(0) / 2)))^2 (Euler)."""
    return (2 * ellipk(math.sin(angle / 2) ** 2)) ** 2


@functools.cache
def two_elasticas():
    """Two elasticas that know nothing of each other: every branch point of one is one of the other too."""
    return BoundaryValueProblem(
        lambda t, u, p: (u.b, -p.lam * math.sin(u.a), u.d, -p.lam * math.sin(u.c)),
        lambda a, b, p: (a.b, b.b, a.d, b.d), ["a", "b", "c", "d"], {"lam": 5.0},
    )  # fmt: skip


@functools.cache
def pitchfork(mu=-1.0):
    """x (mu - x^2) = 0: the branches x = 0 and mu = x^2; the functional "X" is x."""
    return AlgebraicProblem(lambda u, p: (u.x * (p.mu - u.x**2),), ["x"], {"mu": mu}, functionals={"X": lambda u, p: u.x})


@functools.cache
def parabola(mu=1.0):
    """mu - x^2 = 0: a fold at the origin."""
    return AlgebraicProblem(lambda u, p: (p.mu - u.x**2,), ["x"], {"mu": mu})


@functools.cache
def cusp():
    """mu + lam x - x^3 = 0: folds at mu = -+ 2 (lam / 3)^(3/2), a cusp at the origin."""
    return AlgebraicProblem(lambda u, p: (p.mu + p.lam * u.x - u.x**3,), ["x"], {"mu": -3.0, "lam": 1.0})
