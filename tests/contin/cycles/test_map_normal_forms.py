"""Normal forms of maps, against Kuznetsov's formulas by hand, derivatives of polynomials, and maps in normal form."""

import math

import numpy as np
import pytest
from numpy.polynomial import Polynomial

import contin

X = Polynomial([0, 1])


def logistic(u, p):
    return (p.r * u.x * (1 - u.x),)


def of_logistic(rounds, x, limits):
    problem = contin.MapProblem(logistic, ["x"], {"r": sum(limits) / 2})
    start = contin.solve(problem, [x], {"rounds": rounds})
    runs = [contin.trace(start, free=["r"], direction=way, limits={"r": limits}, max_points=60) for way in (1, -1)]
    return [point for run in runs for point in run.points if point.label in ("LP", "PD")]


def iterate(r, rounds):
    """The logistic map applied several times, a polynomial."""
    found = X
    for _ in range(rounds):
        found = r * found * (1 - found)
    return found


def test_first_doubling_of_the_logistic_map():
    """c = (f'')^2 / 4 + f''' / 6 = 9 at r = 3."""
    (point,) = of_logistic(1, 0.6, (2.5, 3.2))
    assert point.name == "period doubling, supercritical"
    assert abs(point.normal_form - 9) < 1e-9 and abs(point.normal_form - 9) <= point.details["normal_form_error"]


@pytest.mark.parametrize(("rounds", "x", "limits"), [(2, 0.85, (3.4, 3.5)), (3, 0.149, (3.82, 3.85))])
def test_longer_cycles_of_the_logistic_map(rounds, x, limits):
    """The same formulas for the derivatives of the polynomial f(f(...)), at the first point."""
    points = of_logistic(rounds, x, limits)
    assert {point.label for point in points} == ({"PD"} if rounds == 2 else {"LP", "PD"})
    for point in points:
        slopes = [iterate(point["r"], rounds).deriv(order)(point["x"]) for order in (1, 2, 3)]
        at_fold = point.label == "LP"
        assert abs(slopes[0] - (1 if at_fold else -1)) < 1e-7
        wanted = abs(slopes[1]) / 2 if at_fold else slopes[1] ** 2 / 4 + slopes[2] / 6
        assert abs(point.normal_form / wanted - 1) < 1e-7


def test_delayed_logistic_map():
    """Kuznetsov's example 4.2: the torus bifurcation at r = 2 with the angle pi / 3 is supercritical, Re d = -1 for |q| = 1."""
    problem = contin.MapProblem(lambda u, p: (p.r * u.x * (1 - u.y), u.x), ["x", "y"], {"r": 1.5})
    branch = contin.trace(contin.solve(problem, [1 / 3, 1 / 3]), free=["r"], limits={"r": (1.2, 2.5)})
    (point,) = branch.labelled("TR")
    assert point.name == "torus, supercritical" and abs(point["r"] - 2) < 1e-10
    assert abs(point.details["frequency"] - math.pi / 3) < 1e-10
    assert abs(point.normal_form + 1) < 1e-10


@pytest.mark.full
def test_henon_map():
    """Fold at a = -(1 - b)^2 / 4 and flip at a = 3 (1 - b)^2 / 4, coefficients by Kuznetsov's formulas in two dimensions."""
    b = 0.3
    problem = contin.MapProblem(lambda u, p: (1 - p.a * u.x**2 + u.y, p.b * u.x), ["x", "y"], {"a": 0.1, "b": b})
    start = contin.solve(problem, [0.8, 0.24])
    flip = contin.trace(start, free=["a"], limits={"a": (-1, 1)}).labelled("PD")[0]
    fold = contin.trace(start, free=["a"], limits={"a": (-1, 1)}, direction=-1).labelled("LP")[0]
    for point, multiplier, a in ((fold, 1.0, -((1 - b) ** 2) / 4), (flip, -1.0, 3 * (1 - b) ** 2 / 4)):
        assert abs(point["a"] - a) < 1e-12
        x = ((b - 1) + math.sqrt((1 - b) ** 2 + 4 * a)) / (2 * a)
        matrix = np.array([[-2 * a * x, 1], [b, 0]])
        q = np.array([multiplier, b]) / math.hypot(multiplier, b)
        p = np.array([multiplier, 1.0])  # p A = multiplier p
        assert np.abs(matrix @ q - multiplier * q).max() < 1e-7 and np.abs(p @ matrix - multiplier * p).max() < 1e-7
        p /= p @ q
        bent = np.array([-2 * a * q[0] ** 2, 0])
        if multiplier == 1:
            wanted = abs(p @ bent) / 2
        else:
            h = np.linalg.solve(np.eye(2) - matrix, bent)
            wanted = p @ np.array([-2 * a * q[0] * h[0], 0]) / 2
        assert abs(point.normal_form - wanted) < 1e-7


def rotation(u, p):
    """z -> e^(i theta) z (1 + m + (p.d + i) |z|^2), in coordinates in which a critical eigenvector has unit length."""
    square, turn, rate = u.x**2 + u.y**2, math.cos(p.theta), math.sin(p.theta)
    x, y = u.x * (1 + p.m + p.d * square) - u.y * square, u.y * (1 + p.m + p.d * square) + u.x * square
    return turn * x - rate * y, rate * x + turn * y


def test_a_map_in_normal_form_and_its_chenciner_point():
    """z = xi v_1 + ... with the vector (1, -i) / sqrt(2) of unit length: |z|^2 is 2 |xi|^2, so that Re d is 2 p.d."""
    problem = contin.MapProblem(rotation, ["x", "y"], {"m": -0.1, "d": 0.3, "theta": 1.0})
    branch = contin.trace(contin.solve(problem, [0.0, 0.0]), free=["m"], limits={"m": (-0.1, 0.1)})
    (point,) = branch.labelled("TR")
    assert point.name == "torus, subcritical" and abs(abs(point.normal_form) - 0.6) < 1e-10
    curve = contin.curve(point, "d", limits={"d": (-1, 1)}, direction=-1)
    (degenerate,) = curve.labelled("CH")
    assert abs(degenerate["d"]) < 1e-10 and abs(degenerate["m"]) < 1e-10


def test_generalized_period_doubling():
    """x -> -(1 + m) x + x^2 + p x^3: c = 1 + p."""
    problem = contin.MapProblem(lambda u, p: (-(1 + p.m) * u.x + u.x**2 + p.p * u.x**3,), ["x"], {"m": -0.1, "p": 0.5})
    branch = contin.trace(contin.solve(problem, [0.0]), free=["m"], limits={"m": (-0.1, 0.1)})
    (point,) = branch.labelled("PD")
    assert abs(point.normal_form - 1.5) < 1e-12
    curve = contin.curve(point, "p", limits={"p": (-3, 1)}, direction=-1)
    (degenerate,) = curve.labelled("GPD")
    assert abs(degenerate["p"] + 1) < 1e-10
    assert max(abs(at["normal_form"] - 1 - at["p"]) for at in curve.points) < 1e-10


def test_area_preserving_maps_have_no_coefficient_at_doublings():
    """Both multipliers are -1 there."""

    def standard(u, p):
        y = u.y - p.k * math.sin(u.x)
        return u.x + y, y

    problem = contin.MapProblem(standard, ["x", "y"], {"k": 3.5})
    branch = contin.trace(contin.solve(problem, [0.0, 0.0]), free=["k"], limits={"k": (3.5, 4.5)})
    for point in branch.labelled("PD"):
        assert abs(point["k"] - 4) < 1e-6 and point.normal_form is None


@pytest.mark.sample(2)
@pytest.mark.parametrize("direction", [1, -1])
@pytest.mark.parametrize("a", [0.3, 0.45, 0.5, 0.55, 0.8, 1.0])
def test_maps_that_keep_areas_have_no_chenciner_points(a, direction):
    """Henon's map at b = -1: Re d = 0 all along, though the complex terms of d are of order one."""
    problem = contin.MapProblem(lambda u, p: (1 - p.a * u.x**2 + u.y, p.b * u.x), ["x", "y"], {"a": a, "b": -0.9})
    x = (-1.9 + math.sqrt(1.9**2 + 4 * a)) / (2 * a)
    start = contin.solve(problem, [x, -0.9 * x])
    (torus,) = contin.trace(start, free=["b"], direction=-1, limits={"b": (-1.5, 0.5)}).labelled("TR")
    curve = contin.curve(torus, free=["b", "a"], direction=direction, limits={"a": (-2, 5)})
    assert not curve.labelled("CH") and max(abs(point["b"] + 1) for point in curve) < 1e-11
    assert {"R2", "R1"} & {point.label for point in curve}
