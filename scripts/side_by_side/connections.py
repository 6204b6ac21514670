"""Demos with connecting orbits."""

from __future__ import annotations

import functools
import math

import numpy as np
from scipy.integrate import solve_ivp

import contin
from bank import stw as stw_front
from contin import AlgebraicProblem, ConnectionProblem
from side_by_side.record import Demo, Part

# --- fronts -----------------------------------------------------------------------------------------------------------


@functools.cache
def nagumo():
    """Huxley's front at a = 1/2."""

    def field(u, p):
        return u.v, p.c * u.v - u.u * (1 - u.u) * (u.u - p.a)

    def guess(t):
        u = 1 / (1 + math.exp(-40 * (t - 0.5) / math.sqrt(2)))
        return u, u * (1 - u) / math.sqrt(2)

    problem = ConnectionProblem(field, ["u", "v"], {"a": 0.5, "c": 0.0}, unstable=1, stable=1)
    return contin.solve(problem, guess, {"time": 40, "to_u": 1.0}, free=["c"])


def nag(way: int):
    """Fronts with a up to 1, or down to 0."""
    zeros, limits = {"a": [0.75 if way > 0 else 0.25]}, {"a": (0.02, 0.98)}
    return [contin.trace(nagumo(), free=["a", "c"], direction=way, limits=limits, zeros=zeros)]


def stw():
    """A sharp front, on the way from one equation to another."""
    return [contin.trace(stw_front.front(), free=["p", "c"], limits={"p": (0, 1.1446)}, zeros={"p": [1.0]})]


# --- san: Sandstede's equations ---------------------------------------------------------------------------------------


def sandstede(u, p):
    """Sandstede's equations, with a homoclinic orbit on a Cartesian leaf."""
    leaf = p.nu - p.alpha * u.z
    return (
        p.a * u.x + p.b * u.y - p.a * u.x**2 + leaf * u.x * (2 - 3 * u.x),
        p.b * u.x + p.a * u.y - 1.5 * p.b * u.x**2 - 1.5 * p.a * u.x * u.y - 2 * leaf * u.y,
        -2 * u.z + p.mu * u.x + p.gamma * u.x * u.z + p.alpha * p.beta * (u.x**2 * (1 - u.x) - u.y**2),
    )


@functools.cache
def san_first():
    """The orbit of the demo with a from 0 to 1/4."""
    values = {"a": 0.0, "b": 1.0, "alpha": 0.0, "beta": 1.0, "gamma": 0.0, "mu": 0.0, "nu": 0.0}
    problem = ConnectionProblem(sandstede, ["x", "y", "z"], values, unstable=1)

    def guess(t):
        s = 20 * (t - 0.5) / 2
        x = 1 / math.cosh(s) ** 2
        return x, -x * math.tanh(s), 0.0

    orbit = contin.solve(problem, guess, {"time": 20}, free=["nu"], intervals=40)
    return contin.trace(orbit, free=["a", "nu"], limits={"a": (-0.5, 0.25)})


@functools.cache
def san_flips():
    """Then alpha grows, to an inclination flip."""
    start = san_first().points[-1]
    return contin.trace(start, free=["alpha", "nu"], limits={"alpha": (-1, 1.6952)}, zeros={"alpha": [1.0]})


def san_neutral():
    """From the flip a goes down, through a neutral saddle."""
    flip = san_flips().labelled("IFS")[0]
    return [contin.trace(flip, free=["a", "nu"], direction=-1, limits={"a": (-0.46741407, 1)})]


# --- kpr, fhh ---------------------------------------------------------------------------------------------------------


def koper(u, p):
    """Koper's equations."""
    return p.e * (p.k * u.y - u.x**3 + 3 * u.x - p.l), u.x - 2 * u.y + u.z, u.y - u.z


@functools.cache
def kpr_orbit():
    """The homoclinic orbit at k = -0.15, from a long cycle."""
    problem = AlgebraicProblem(koper, ["x", "y", "z"], {"l": -2.3, "k": -0.15, "e": 10.0})
    line = contin.trace(contin.solve(problem, [2, 2, 2]), free=["l"], limits={"l": (-6, 6)})
    cycles = contin.trace(line.labelled("HB")[1], branch=1, limits={"l": (-6, 6), "period": (0, 92)})
    return contin.homoclinic(cycles.points[-1], free=["l"])


def kpr_flips():
    """Curves of homoclinic orbits, both ways."""
    return [
        contin.trace(kpr_orbit(), free=["l", "k"], primary="k", direction=way, limits={"k": (-3, 3)}) for way in (-1, 1)
    ]  # fmt: skip


def pulse(u, p):
    """FitzHugh and Nagumo's equations of a travelling pulse."""
    return u.v, p.c * u.v + u.u * (u.u - p.a) * (u.u - 1) + u.w, p.eps * u.u / p.c


#: Time of the first pulse, which is then made longer: at its end it is exp(-0.075 * 100) of its size away from rest.
FHH_TIME = 130.0


@functools.cache
def fhh_orbit():
    """A pulse at c = 0.21, from an orbit that leaves the origin; after 29 it decays along the slow direction."""
    c, a, eps = 0.21, 0.17928634, 0.0025

    def field(t, u):
        return [u[1], c * u[1] + u[0] * (u[0] - a) * (u[0] - 1) + u[2], eps * u[0] / c]

    values, vectors = np.linalg.eig(np.array([[0, 1, 0], [a, c, 1], [eps / c, 0, 0]]))
    leaving = vectors[:, values.real.argmax()].real
    start = 1e-3 * leaving / leaving[0]
    away, slow = 29.0, sorted(values.real)[1]
    found = solve_ivp(field, (0, away), start, rtol=1e-10, atol=1e-12, dense_output=True)

    def guess(t):
        s = FHH_TIME * t
        return tuple(found.sol(min(s, away)) * math.exp(slow * max(0.0, s - away)))

    problem = ConnectionProblem(pulse, ["u", "v", "w"], {"c": c, "a": a, "eps": eps}, unstable=1)
    orbit = contin.solve(problem, guess, {"time": FHH_TIME}, free=["a"], intervals=60)
    return contin.trace(orbit, free=["a", "time"], primary="time", limits={"time": (0, 250)}).points[-1]


def fhh_curve():
    """The curve of pulses in a and c."""
    zeros = {"a": [0.2, 0.1, 0.05, 0.02, 0.0, -0.01]}
    return [
        contin.trace(fhh_orbit(), free=["a", "c"], direction=way, limits={"a": (-0.02, 0.3), "c": (0.2, 0.7)}, zeros=zeros)
        for way in (-1, 1)
    ]  # fmt: skip


#: What is behind the differences of fhh.
FHH_NOTE = (
    "AUTO's orbits last 1000, contin's 250, to save time: after the first fold they have two pulses, for which 250 is short. "
    "AUTO goes on to c = 0.69; contin's run ends at c = 0.54, as its orbit needs a longer time there (its `stop` says so)."
)


def demos() -> list[Demo]:
    """Return the demos."""

    def speed(a):
        return (1 - 2 * a) / math.sqrt(2)

    return [
        Demo("nag", "Nagumo's fronts", [
            Part([0, 1], lambda: [*nag(1), *nag(-1)], {"PAR(1)": "a", "PAR(2)": "c"},
                 known=[("UZ", {"PAR(1)": a, "PAR(2)": speed(a)}) for a in (0.25, 0.75)]),
        ], note="At a = 0 and 1 an eigenvalue is zero; contin's runs end before."),
        Demo("stw", "a sharp travelling wave", [Part([0], stw, {"PAR(1)": "p", "PAR(10)": "c"})]),
        Demo("san", "Sandstede's homoclinic orbits", [
            Part([2], lambda: [san_flips()], {"PAR(4)": "alpha", "PAR(8)": "nu"}, also={"IFS": "UZ"}),
            Part([4], san_neutral, {"PAR(1)": "a"}, also={"NSS": "UZ"}, known=[("UZ", {"PAR(1)": 0.0})]),
        ]),
        Demo("kpr", "Koper's homoclinic orbits", [
            Part([3, 4], kpr_flips, {"PAR(2)": "k", "PAR(1)": "l"}, also={"IFS": "UZ", "NCH": "UZ"}),
        ]),
        Demo("fhh", "homoclinic orbits of FitzHugh and Nagumo's pulses", [
            Part([3, 4], fhh_curve, {"PAR(2)": "a", "PAR(1)": "c"}, also={"DRS": "UZ"}),
        ], script="fhn.auto", note=FHH_NOTE),
    ]  # fmt: skip
