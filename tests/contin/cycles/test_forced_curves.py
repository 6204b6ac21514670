"""Curves and normal forms of forced cycles, against Mathieu's numbers and the same systems driven by an oscillator."""

import math

import numpy as np
import pytest
from cycles.test_forced import around, duffing, mathieu, two_wells, van_der_pol
from scipy.integrate import solve_ivp
from scipy.optimize import root
from scipy.special import mathieu_a, mathieu_b

import contin
from contin import CycleProblem, MeshControl


def labels(branch):
    return [point.label for point in branch if point.label]


@pytest.mark.full
def test_edges_of_stability_of_mathieu():
    """a_n(q) and b_n(q), from SciPy: one call each from q = 1 to q = 5. Both multipliers are -1 or 1 all along."""
    problem = CycleProblem(mathieu, ["x", "v"], {"a": -3.0, "q": 1.0}, period=math.pi)
    mesh = MeshControl(min_intervals=20)
    branch = contin.trace(contin.solve(problem, [0, 0], degree=7), free=["a"], limits={"a": (-3, 6)}, mesh=mesh)
    starts = [point for point in branch if point.label in ("PD", "BP")]
    known = [(mathieu_a, 0), (mathieu_b, 1), (mathieu_a, 1), (mathieu_b, 2), (mathieu_a, 2)]
    assert len(starts) == len(known)
    for start, (number, order) in zip(starts, known):
        edge = contin.curve(start, free=["a", "q"], limits={"q": (0.5, 5)}, mesh=mesh)
        assert labels(edge) == ["EP", "EP"] and edge.points[-1]["q"] == pytest.approx(5, abs=1e-12)
        for point in edge:
            assert point["a"] == pytest.approx(float(number(order, point["q"])), abs=1e-10)


def test_folds_of_duffing():
    """The folds of the resonance at g = .4, on the curve and on a branch of cycles."""
    problem = CycleProblem(duffing, ["x", "v"], {"w": 4.0, "g": 0.5}, period=around)
    branch = contin.trace(contin.solve(problem, [0, 0]), free=["w"], direction=-1, limits={"w": (0.9, 15)})
    other = contin.trace(contin.solve(problem, [0, 0], {"g": 0.4}), free=["w"], direction=-1, limits={"w": (0.9, 15)})
    assert len(branch.labelled("LP")) == len(other.labelled("LP")) == 2
    for fold, known in zip(branch.labelled("LP"), other.labelled("LP")):
        folds = contin.curve(fold, "g", direction=-1, limits={"g": (0.4, 1)})
        assert folds.points[-1]["w"] == pytest.approx(known["w"], abs=1e-9)


def driven(field, rate):
    """A forced field with the forcing cos(w t) from an oscillator on the circle r = 1."""

    def autonomous(u, p):
        s = u.c**2 + u.s**2
        x, v = field(u, p)
        return x, v + p.g * u.c, rate * u.c * (1 - s) - p.w * u.s, rate * u.s * (1 - s) + p.w * u.c

    return autonomous


@pytest.mark.full
def test_normal_forms_are_those_of_a_driven_system():
    """Two wells: the first period doubling, forced and driven."""

    def field(u, p):
        return u.v, -0.25 * u.v + u.x - u.x**3

    problem = CycleProblem(two_wells, ["x", "v"], {"w": 1.0, "g": 0.0}, period=around)
    branch = contin.trace(contin.solve(problem, [1.0, 0]), free=["g"], limits={"g": (0, 0.3)})
    (doubling,) = branch.labelled("PD")
    extended = CycleProblem(driven(field, 1.0), ["x", "v", "c", "s"], {"w": 1.0, "g": 0.0})
    orbit = contin.solve(
        extended, lambda t: (1, 0, math.cos(2 * math.pi * t), math.sin(2 * math.pi * t)), {"period": 2 * math.pi}, degree=5
    )
    (known,) = contin.trace(orbit, free=["g"], limits={"g": (0, 0.3)}).labelled("PD")
    assert doubling["g"] == pytest.approx(known["g"], abs=1e-10)
    assert doubling.name == known.name == "period doubling, supercritical"
    assert doubling.normal_form == pytest.approx(known.normal_form, rel=1e-7)


def test_a_fold_has_a_normal_form():
    """x' = b + x^2 averaged: x' = mu + x^2 + cos(t) x^2 / 2 has at mu = x = 0 a fold with b = 1, the mean of 1 + cos(t) / 2."""
    problem = CycleProblem(
        lambda t, u, p: (p.mu + u.x**2 * (1 + math.cos(t) / 2), -u.y), ["x", "y"], {"mu": -1.0}, period=2 * math.pi
    )
    branch = contin.trace(contin.solve(problem, [-1, 0]), free=["mu"], limits={"mu": (-2, 1), "max_x": (-2, 0.5)})
    (fold,) = branch.labelled("LP")
    assert (fold["mu"], fold.normal_form) == pytest.approx((0, 1), abs=1e-8)


@pytest.mark.full
def test_torus_bifurcations_of_van_der_pol():
    """At g = 1.1, on the curve and on a branch of cycles."""
    problem = CycleProblem(van_der_pol, ["x", "v"], {"w": 4.0, "g": 0.5}, period=around)
    first, second = (
        contin.trace(contin.solve(problem, [0, 0], {"g": g}), free=["w"], direction=-1, limits={"w": (0.3, 15)})
        for g in (1.0, 1.1)
    )
    found = contin.curve(first.labelled("TR")[0], "g", limits={"g": (0.9, 1.1)})
    assert found.points[-1]["g"] == pytest.approx(1.1, abs=1e-12)
    assert found.points[-1]["w"] == pytest.approx(second.labelled("TR")[0]["w"], abs=1e-9)


@pytest.mark.full
def test_period_doublings_of_two_wells():
    """At w = 1.05, on the curve and on a branch of cycles."""
    problem = CycleProblem(two_wells, ["x", "v"], {"w": 1.0, "g": 0.0}, period=around)
    first, second = (
        contin.trace(contin.solve(problem, [1.0, 0], {"w": w}), free=["g"], limits={"g": (0, 0.3)}) for w in (1.0, 1.05)
    )
    found = contin.curve(first.labelled("PD")[0], "w", limits={"w": (0.9, 1.05)})
    assert found.points[-1]["g"] == pytest.approx(second.labelled("PD")[0]["g"], abs=1e-9)


def half_a_round(rates, slopes, time, x, v):
    """Return the state after half a round and the derivative by the first one: by SciPy's solver."""

    def field(t, y):
        return [*rates(t, y[0], y[1]), *(np.array(slopes(y[0], y[1])) @ y[2:].reshape(2, 2)).ravel()]

    end = solve_ivp(field, (0, time), [x, v, 1, 0, 0, 1], method="DOP853", rtol=1e-12, atol=1e-13).y[:, -1]
    return end[:2], end[2:].reshape(2, 2)


def symmetric(point, function, names):
    """Return the values of two parameters at which ``function(x, v, a, b)`` vanishes, from a point that contin found."""
    base = point.system.base
    start = base.states(point.x[: base.size])[0]
    known = root(function, [*start, *(point[name] for name in names)], options={"xtol": 1e-14})
    assert np.abs(known.fun).max() < 1e-11
    return known.x[2:]


@pytest.mark.full
def test_a_resonance_that_a_symmetry_makes_touch():
    """A pair of half a round passes i and -i: that of the round comes to -1 and goes back, kappa + 1 has no change of sign."""

    def field(t, u, p):
        return u.v, (1 - u.x**2) * u.v - u.x + p.g * math.cos(p.w * t)

    problem = CycleProblem(field, ["x", "v"], {"w": 2.0, "g": 10.0}, period=around)
    branch = contin.trace(contin.solve(problem, [0, 0]), free=["g"], direction=-1, limits={"g": (3, 12)})
    (torus,) = branch.labelled("TR")
    curve = contin.curve(torus, "w", limits={"w": (1, 2.2)})
    assert labels(curve) == ["EP", "R2", "EP"] and curve.stop.reason == "limit"
    (point,) = curve.labelled("R2")

    def half(unknowns):  # vanishes where half a round, turned by -1, has the multipliers i and -i
        x, v, g, w = unknowns
        end, turn = half_a_round(
            lambda t, x, v: (v, (1 - x**2) * v - x + g * math.cos(w * t)),
            lambda x, v: ((0, 1), (-2 * x * v - 1, 1 - x**2)), math.pi / w, x, v,
        )  # fmt: skip
        return [*(end + (x, v)), np.trace(turn), np.linalg.det(turn) - 1]

    for name, value in zip(("g", "w"), symmetric(point, half, ("g", "w"))):
        assert point[name] == pytest.approx(value, abs=1e-10) and point.errors[name] < 1e-10


@pytest.mark.full
@pytest.mark.parametrize("m1", [0.01, 0.5])
def test_torus_bifurcations_end_on_a_symmetric_cycle(m1):
    """Cycles that have an image become their own: the curve would go back as its mirror image from a point where it is R1."""

    def rates(x, v, m1, m2):
        return v, m1 * x + m2 * v - x**3 - x**2 * v

    def field(t, u, p):
        x, v = rates(u.x, u.v, p.m1, p.m2)
        return x, v + 0.2 * math.cos(3 * t)

    problem = CycleProblem(field, ["x", "v"], {"m1": m1, "m2": -0.3}, period=2 * math.pi / 3)
    branch = contin.trace(contin.solve(problem, [math.sqrt(m1), 0]), free=["m2"], limits={"m2": (-1, 2)})
    curve = contin.curve(branch.labelled("TR")[0], "m1", direction=-1, limits={"m1": (-1, 1)}, max_points=60)
    assert set(labels(curve)) == {"EP", "R1"} | ({"R4"} if m1 > 0.1 else set())
    assert curve.stop.reason == "pitchfork" and not curve.notes
    point = curve.points[-1]

    def half(unknowns):  # vanishes where half a round, turned by -1, has the multiplier -1 twice
        x, v, m1, m2 = unknowns
        end, turn = half_a_round(
            lambda t, x, v: (v, rates(x, v, m1, m2)[1] + 0.2 * math.cos(3 * t)),
            lambda x, v: ((0, 1), (m1 - 3 * x**2 - 2 * x * v, m2 - x**2)), math.pi / 3, x, v,
        )  # fmt: skip
        return [*(end + (x, v)), np.trace(turn) - 2, np.linalg.det(turn) - 1]

    for name, value in zip(("m1", "m2"), symmetric(point, half, ("m1", "m2"))):
        assert point[name] == pytest.approx(value, abs=1e-10) and point.errors[name] < 1e-10


@pytest.mark.full
def test_folds_go_through_a_forcing_that_vanishes():
    """Van der Pol's oscillator, locked 1:1: at g = 0 the phase is free, and the curve goes on as its image u(t + T / 2) at -g.

    Four cusps, two at each sign of g, and none at 0, where w.F_zz v v changes its sign, too.
    """
    field = lambda t, u, p: (u.v, 0.3 * (1 - u.x**2) * u.v - u.x + p.g * math.cos(p.w * t))  # noqa: E731
    problem = contin.CycleProblem(field, ["x", "v"], {"g": 0.3, "w": 1.0}, period=around)
    locked = contin.solve(problem, lambda t: (2 * math.sin(2 * math.pi * t), 2 * math.cos(2 * math.pi * t)))
    fold = contin.trace(locked, free=["w"], limits={"w": (0.3, 1.5)}).labelled("LP")[0]
    curve = contin.curve(fold, free=["w", "g"], limits={"w": (0.5, 2), "g": (-0.5, 2)})
    assert str(curve.stop) == "the branch closed on its first point" and not curve.notes
    cusps = sorted((point["g"], point["w"]) for point in curve.labelled("CP"))
    (low, first), (higher, second), (third_g, third), (high, last) = cusps
    assert (low, higher) == pytest.approx((-high, -third_g), abs=1e-9) and third_g > 0.3
    assert (first, second) == pytest.approx((last, third), abs=1e-9)
