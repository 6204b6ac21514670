"""Branches that begin at any point of a curve in two parameters, compared with those from the labelled point of a branch."""

import dataclasses
import math

import numpy as np
import pytest

import contin
from contin import ProblemError


def brusselator(u, p):
    return p.a - (p.b + 1) * u.x + u.x**2 * u.y, p.b * u.x - u.x**2 * u.y


def brusselator_hopf_points():
    problem = contin.AlgebraicProblem(brusselator, ["x", "y"], {"a": 1.0, "b": 1.0})
    (hopf,) = contin.trace(contin.solve(problem, [1, 1]), free=["b"], limits={"b": (0.5, 3)}).labelled("HB")
    return contin.curve(hopf, free=["b", "a"], limits={"a": (0.5, 2)})


def test_cycles_of_the_brusselator():
    """The period 2 pi / a at birth, and the amplitude |z|^2 = (b - 1 - a^2) / (-2 omega l1) of the normal form.

    Frequency a and l1 as in `test_hopf_curve`; x - a = 2 Re(z q_x exp(i omega t)) with |q|^2 = |q_x|^2 (2 + 1 / a^2).
    """
    for point in brusselator_hopf_points():
        a = point["a"]
        branch = contin.trace(point, branch=1, limits={"b": (0.5, 1 + a * a + 1e-3)})
        assert branch[0].label == "HB" and branch.stop.reason == "limit"
        assert branch[0]["period"] == pytest.approx(2 * math.pi / a, rel=1e-10)
        square = 1e-3 / (2 * a * (2 + a * a) / (2 * a * (1 + 2 * a * a))) / (2 + 1 / a**2)
        # the next term of the square is of the relative size of b - b_H, times a factor of the order of 10
        assert (branch[-1]["max_x"] - branch[-1]["min_x"]) ** 2 == pytest.approx(16 * square, rel=2e-2)


def test_free_parameters_of_the_cycles():
    """By default the first of the curve; any others as from the labelled point. The direction stays that of the growth."""
    point = brusselator_hopf_points()[3]
    again = contin.solve(point.system.solution.problem, point, {"b": 1 + point["a"] ** 2 - 0.1})
    (labelled,) = contin.trace(again, free=["b"], limits={"b": (0.5, 6)}).labelled("HB")
    for free in (None, ["b"], ["a"], ["b", "period"]):
        ours, theirs = (contin.trace(start, branch=1, free=free, max_points=5) for start in (point, labelled))
        assert ours[-1].system.free == theirs[-1].system.free
        for name in ("a", "b", "period", "max_x"):
            assert ours[-1][name] == pytest.approx(theirs[-1][name], rel=1e-8)


def test_where_no_cycles_begin():
    """At a Bogdanov-Takens point, the end of a curve of Hopf points, the period would be infinite.

    What round-off leaves of the frequency there is none.
    """
    problem = contin.AlgebraicProblem(
        lambda u, p: (u.y, p.m + p.n * u.y + u.x**2 + u.x * u.y), ["x", "y"], {"m": -1.0, "n": 0.5}
    )
    (hopf,) = contin.trace(contin.solve(problem, [-1, 0]), free=["n"], limits={"n": (0, 2)}).labelled("HB")
    curve = contin.curve(hopf, free=["n", "m"], limits={"m": (-2, 1)})
    assert curve[-1].label == "BT"
    for noise in (0, 1e-16, 1e-14, -1e-14):
        last = dataclasses.replace(curve[-1], x=curve[-1].x + noise)
        assert last["frequency"] == 0 and math.isnan(last["lyapunov"])
        with pytest.raises(ProblemError, match="no pair on the imaginary axis"):
            contin.trace(last, branch=1)
    assert contin.trace(curve[3], branch=1, max_points=3)[0]["period"] == pytest.approx(2 * math.pi / curve[3]["frequency"])


def roessler(u, p):
    return -u.y - u.z, u.x + p.a * u.y, 0.2 + u.z * (u.x - p.c)


@pytest.mark.full
def test_doubled_cycles(tmp_path):
    """From any point of a curve of period doublings: the doubled cycles, and the simple ones. From a file, too."""
    problem = contin.CycleProblem(roessler, ["x", "y", "z"], {"c": 2.0, "a": 0.2})
    orbit = contin.cycle(problem, [1.0, 1.0, 0.0])
    (first,) = contin.trace(orbit, free=["c"], limits={"c": (2, 3)}).labelled("PD")
    curve = contin.curve(first, free=["c", "a"], limits={"a": (0.15, 0.25)}, max_points=6)
    contin.save(curve, tmp_path / "doublings.npz")
    for point in (curve[2], contin.load(problem, tmp_path / "doublings.npz")[2]):
        double = contin.trace(point, branch=1, max_points=4)
        assert double[0]["period"] == pytest.approx(2 * point["period"], rel=1e-9)
        assert double[0]["c"] == pytest.approx(point["c"], abs=1e-8) and double[-1]["a"] == point["a"]
        half = double[-1].system.evaluate(double[-1].x, np.array([0.0, 0.5]))
        assert np.abs(half[1] - half[0]).max() > 1e-2
        simple = contin.trace(point, branch=0, max_points=4)
        assert simple[0]["period"] == pytest.approx(point["period"], rel=1e-8) and simple[-1]["a"] == point["a"]
    with pytest.raises(ProblemError, match="branch: 2 must be 0 or 1 at a point labelled 'PD'"):
        contin.trace(curve[2], branch=2)


def driven(u, p):
    """A cycle of radius sqrt(mu) in x, y, its frequency 1, beside a pair with the rates nu and the frequency w."""
    square = u.x**2 + u.y**2
    grows, turns = p.nu * u.z - p.w * u.v, p.w * u.z + p.nu * u.v
    return u.x * (p.mu - square) - u.y, u.y * (p.mu - square) + u.x, grows - u.z**3, turns - u.v**3


def test_cycles_at_torus_bifurcations():
    """The cycles themselves go on in one parameter, and no others begin there."""

    def circle(t):
        return math.cos(2 * math.pi * t), math.sin(2 * math.pi * t), 0.0, 0.0

    problem = contin.CycleProblem(driven, ["x", "y", "z", "v"], {"mu": 1.0, "nu": -0.2, "w": 0.3})
    orbit = contin.solve(problem, circle, {"period": 2 * math.pi})
    (torus,) = contin.trace(orbit, free=["nu"], limits={"nu": (-1, 1)}).labelled("TR")
    point = contin.curve(torus, free=["nu", "mu"], limits={"mu": (0.5, 2)})[3]
    for branch in (contin.trace(point, branch=0, max_points=3), contin.trace(point, free=["nu"], max_points=3)):
        assert branch[0]["max_x"] == pytest.approx(math.sqrt(point["mu"]), rel=1e-8)
        assert branch[-1]["mu"] == point["mu"] and branch[-1]["nu"] > 1e-3
    with pytest.raises(ProblemError, match="branch: 1 must be 0 at a point labelled 'TR'"):
        contin.trace(point, branch=1)


def test_branches_at_a_curve_of_branch_points():
    """x (b a - x^2) = 0: another branch begins at a = 0 for every b."""
    problem = contin.AlgebraicProblem(lambda u, p: (u.x * (p.b * p.a - u.x**2),), ["x"], {"a": -1.0, "b": 1.0})
    (fork,) = contin.trace(contin.solve(problem, [0.0]), free=["a"], limits={"a": (-1, 1)}).labelled("BP")
    for point in contin.curve(fork, free=["a", "b"], limits={"b": (0.5, 3)}):
        ends = [contin.trace(point, branch=branch, limits={"a": (-1, 1)})[-1].x[0] for branch in (0, 1)]
        assert sorted(map(abs, ends)) == pytest.approx([0, math.sqrt(point["b"])], abs=1e-9)


def test_doubled_cycles_of_a_map():
    """The fixed point 1 - 1/r of the logistic map x -> r x (1 - x) times s: the doubling at r s = 3."""
    problem = contin.MapProblem(lambda u, p: (p.s * p.r * u.x * (1 - u.x),), ["x"], {"r": 2.5, "s": 1.0})
    (flip,) = contin.trace(contin.solve(problem, [0.6]), free=["r"], limits={"r": (2, 3.5)}).labelled("PD")
    point = contin.curve(flip, free=["r", "s"], limits={"s": (0.8, 1.2)})[3]
    double = contin.trace(point, branch=1, limits={"r": (1, 3.3 / point["s"])})
    k = 3.3
    places = sorted((1 + k + sign * math.sqrt((k - 3) * (k + 1))) / (2 * k) for sign in (-1, 1))
    assert sorted(double[-1].system.states(double[-1].x).ravel()) == pytest.approx(places, abs=1e-10)


@pytest.mark.sample(1)
@pytest.mark.parametrize("b, way", [(-0.5, 1), (0.5, -1)])
def test_the_direction_is_that_of_the_normal_form(b, way):
    """r' = r (m + b r^2 - r^4): cycles with m = r^4 - b r^2 on both sides of the generalized Hopf point at b = 0."""

    def bautin(u, p):
        growth = p.m + p.b * (u.x**2 + u.y**2) - (u.x**2 + u.y**2) ** 2
        return growth * u.x - u.y, u.x + growth * u.y

    problem = contin.AlgebraicProblem(bautin, ["x", "y"], {"m": -1.0, "b": b})
    (hopf,) = contin.trace(contin.solve(problem, [0, 0]), free=["m"], limits={"m": (-2, 2)}).labelled("HB")
    curve = contin.curve(hopf, free=["m", "b"], direction=way, limits={"b": (-1, 1)})
    assert curve.labelled("GH")
    for point in curve:
        cycles = contin.trace(point, branch=1, limits={"max_x": (-1, 0.3)})
        assert cycles[0].label == "HB" and len(cycles) > 2
        for cycle in cycles[1:]:
            square = cycle["max_x"] ** 2
            assert cycle["m"] == pytest.approx(square**2 - point["b"] * square, abs=1e-9)
        if point.label != "GH":
            assert np.sign(cycles[1]["m"]) == -np.sign(point["lyapunov"])
