"""Time-periodic states of fields, beside a closed form and an integration in time."""

import functools
import math

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.optimize import brentq

import contin
from contin.boundary.oscillating import oscillating
from contin.lowlevel import oscillation

DX, DY = 0.008, 0.004


def brusselator(t, u, p):
    grown = u.x**2 * u.y
    return u.dx, -(p.a - (p.b + 1) * u.x + grown) / DX, u.dy, -(p.b * u.x - grown) / DY


FIELD = contin.BoundaryValueProblem(
    brusselator, lambda a, b, p: (a.x - p.a, b.x - p.a, a.y - p.b / p.a, b.y - p.b / p.a), ["x", "dx", "y", "dy"],
    {"a": 2.0, "b": 4.9}, functionals={"mean": lambda t, u, p: u.x},
    rates={"dx": lambda t, u, w, p: w.x / DX, "dy": lambda t, u, w, p: w.y / DY},
)  # fmt: skip


@pytest.fixture(scope="module")
def hopf():
    steady = contin.trace(contin.solve(FIELD, [2.0, 0, 2.45, 0]), free=["b"], limits={"b": (4.9, 5.3)})
    (point,) = steady.labelled("HB")
    return point


@functools.cache
def integrated(b, count=12):
    """Return the period and the mean square of x - its mean, by Chebyshev nodes and an integration in time."""
    s = (1 - np.cos(np.pi * np.arange(count + 1) / count)) / 2
    weights = np.r_[0.5, np.ones(count - 1), 0.5] * (-1.0) ** np.arange(count + 1)
    slope = weights / weights[:, None] / (s[:, None] - s + np.eye(count + 1))
    slope -= np.diag(slope.sum(axis=1))
    second = slope @ slope

    def rates(t, u):
        x, y = np.r_[2.0, u[: count - 1], 2.0], np.r_[b / 2, u[count - 1 :], b / 2]
        grown = x * x * y
        return np.r_[(DX * second @ x + 2 - (b + 1) * x + grown)[1:-1], (DY * second @ y + b * x - grown)[1:-1]]

    middle = count // 2 - 1
    start = np.r_[2 + 0.8 * np.sin(np.pi * s[1:-1]), np.full(count - 1, b / 2)]
    settled = solve_ivp(rates, (0, 150), start, method="BDF", rtol=1e-8, atol=1e-8).y[:, -1]
    found = solve_ivp(rates, (0, 8), settled, method="LSODA", rtol=1e-10, atol=1e-10, dense_output=True).sol
    times = np.linspace(0, 8, 1601)
    values = found(times)[middle] - 2.0
    up = [i for i in range(1600) if values[i] < 0 <= values[i + 1]]
    first, last = (brentq(lambda t: found(t)[middle] - 2.0, times[i], times[i + 1], xtol=1e-12) for i in up[:2])
    through = found(np.linspace(first, last, 201)[:-1])[: count - 1]
    wide = np.vstack([np.full(200, 2.0), through, np.full(200, 2.0)])
    variance = wide.var(axis=1)
    fit = np.polynomial.Polynomial.fit(s, variance, count)
    return last - first, fit.integ()(1.0) - fit.integ()(0.0)


@pytest.mark.full
def test_an_oscillation_of_the_brusselator(hopf):
    branch = contin.trace(hopf, branch=1, limits={"b": (4.9, 5.3)})
    first, last = branch[0], branch[-1]
    assert first["b"] == pytest.approx(5 + (DX + DY) * math.pi**2) and first["swing_x"] < 1e-20
    period, swing = integrated(5.3)
    assert last["b"] == pytest.approx(5.3)
    assert last["period"] == pytest.approx(period, rel=2e-4) and last["swing_x"] == pytest.approx(swing, rel=2e-2)
    assert last["mean"] == pytest.approx(2.0, abs=0.05)


@pytest.mark.full
def test_more_times_have_smaller_errors(hopf):
    start, tangent = oscillation(hopf, 15)
    branch = contin.trace(start, tangent=tangent, limits={"b": (4.9, 5.3)}, errors=False)
    period, swing = integrated(5.3)
    assert branch[-1]["period"] == pytest.approx(period, rel=3e-5) and branch[-1]["swing_x"] == pytest.approx(swing, rel=3e-3)


def test_rotating_waves_in_closed_form():
    """A lambda-omega field: uniform circles of radius sqrt(r), frequency w + r; its wave cos(pi s) begins at r = d pi^2."""
    d = 0.1

    def rhs(t, u, p):
        square = u.a**2 + u.b**2
        return u.da, ((p.w + square) * u.b - u.a * (p.r - square)) / d, u.db, (-(p.w + square) * u.a - u.b * (p.r - square)) / d

    field = contin.BoundaryValueProblem(
        rhs, lambda a, b, p: (a.da, b.da, a.db, b.db), ["a", "da", "b", "db"], {"r": -0.1, "w": 2.0},
        rates={"da": lambda t, u, w, p: w.a / d, "db": lambda t, u, w, p: w.b / d},
    )  # fmt: skip
    steady = contin.trace(contin.solve(field, [0.0] * 4), free=["r"], limits={"r": (-0.1, 1.1)})
    uniform, wave = steady.labelled("HB")
    assert [uniform["r"], wave["r"]] == pytest.approx([0, d * math.pi**2], abs=1e-9)
    circles = contin.trace(uniform, branch=1, limits={"r": (-1, 1)})
    assert circles[-1]["r"] == pytest.approx(1) and circles[-1]["swing_a"] == pytest.approx(0.5, rel=1e-9)
    assert circles[-1]["period"] == pytest.approx(2 * math.pi / 3, rel=1e-9)


def test_what_is_refused(hopf):
    for times, said in ((4, "times: 4 must be"), (8, "times: 8 must be odd")):
        with pytest.raises(contin.ProblemError, match=said):
            oscillation(hopf, times)
    with pytest.raises(contin.ProblemError, match="free: must be left out, or b, period"):
        contin.trace(hopf, branch=1, free=["a"])
    still = contin.trace(contin.solve(FIELD, [2.0, 0, 2.45, 0]), free=["b"], limits={"b": (4.9, 5.0)})[-1]
    with pytest.raises(contin.ProblemError, match="is no Hopf point of a field"):
        oscillation(still)


def test_fields_with_integral_conditions_are_refused():
    """The mass of this field is given, and its multiplier follows: no oscillations are stated for it."""
    held = contin.BoundaryValueProblem(
        lambda t, u, p: (u.da, p.w * u.b - p.r * u.a - p.m, u.db, -p.w * u.a - p.r * u.b),
        lambda a, b, p: (a.da, b.da, a.db, b.db), ["a", "da", "b", "db"], {"r": -0.1, "w": 2.0, "m": 0.0},
        integrals=lambda t, u, p: (u.a,), rates={"da": lambda t, u, w, p: w.a, "db": lambda t, u, w, p: w.b},
    )  # fmt: skip
    with pytest.raises(contin.ProblemError, match="fields without integral conditions"):
        oscillating(held, {})
