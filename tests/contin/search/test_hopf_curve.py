"""Curves of Hopf points in two parameters, and points of codimension two on them and on folds, against closed forms."""

import math
import pickle

import numpy as np
import pytest

import contin
from bank import abc
from bank.ab import problem as reactor
from contin import AlgebraicProblem, ProblemError


def first_hopf(problem, states, parameter, parameters=None, **options):
    start = contin.solve(problem, states, parameters or {})
    return contin.trace(start, free=[parameter], **options).labelled("HB")[0]


def labels(branch):
    return [point.label for point in branch if point.label]


def brusselator(u, p):
    return p.a - (p.b + 1) * u.x + u.x**2 * u.y, p.b * u.x - u.x**2 * u.y


def test_of_the_brusselator():
    """b = 1 + a**2 with the frequency a, and l1 as in test_normal_forms."""
    problem = AlgebraicProblem(brusselator, ["x", "y"], {"a": 1.0, "b": 1.0})
    hopf = first_hopf(problem, [1, 1], "b", limits={"b": (0.5, 3)})
    for direction, end in ((1, 3.0), (-1, 0.1)):
        found = contin.curve(hopf, free=["b", "a"], direction=direction, limits={"a": (0.1, 3)})
        assert labels(found) == ["EP", "EP"] and found.points[-1]["a"] == pytest.approx(end, abs=1e-10)
        for point in found:
            a = point["a"]
            assert point["b"] == pytest.approx(1 + a * a, abs=1e-10)
            assert point["frequency"] == pytest.approx(a, abs=1e-10)
            assert point["lyapunov"] == pytest.approx(-(2 + a * a) / (2 * a * (1 + 2 * a * a)), abs=1e-8)


def test_it_is_pickled():
    """Points keep their system, and the system what it has computed last: the error of a coefficient is a function."""
    problem = AlgebraicProblem(brusselator, ["x", "y"], {"a": 1.0, "b": 1.0})
    found = contin.curve(first_hopf(problem, [1, 1], "b", limits={"b": (0.5, 3)}), free=["b", "a"], max_points=5)
    again = pickle.loads(pickle.dumps(found))
    assert [point["lyapunov"] for point in again] == [point["lyapunov"] for point in found]


def test_in_odd_units():
    """The Brusselator in units of a million, of states and of time: frequencies, and l1 for the unit eigenvector, are those."""

    def small(u, p):
        x, y = u.x * 1e6, u.y * 1e6
        return 1e-9 * (p.a - (p.b + 1) * x + x**2 * y), 1e-9 * (p.b * x - x**2 * y)

    problem = AlgebraicProblem(small, ["x", "y"], {"a": 1.0, "b": 1.0})
    hopf = first_hopf(problem, [1e-6, 1e-6], "b", limits={"b": (0.5, 3)})
    found = contin.curve(hopf, free=["b", "a"], limits={"a": (0.1, 3)})
    assert labels(found) == ["EP", "EP"]
    for point in found:
        a = point["a"]
        assert point["b"] == pytest.approx(1 + a * a, rel=1e-9)
        assert point["frequency"] == pytest.approx(1e-3 * a, rel=1e-9)
        assert point["lyapunov"] == pytest.approx(-1e12 * (2 + a * a) / (2 * a * (1 + 2 * a * a)), rel=1e-7)


def takens(u, p):
    return u.y, p.m + p.n * u.y - u.x**2 + u.x * u.y


def test_a_hopf_curve_ends_at_a_bogdanov_takens_point():
    """Equilibria at x**2 = m; trace n + x and determinant 2 x: Hopf points at m = n**2 with frequency sqrt(-2 n), n < 0."""
    problem = AlgebraicProblem(takens, ["x", "y"], {"m": 4.0, "n": -1.0})
    hopf = first_hopf(problem, [2, 0], "m", direction=-1, limits={"m": (0.1, 5)})
    found = contin.curve(hopf, "n", limits={"n": (-3, 3)})
    end = found.points[-1]
    assert labels(found) == ["EP", "BT"] and found.stop.message == "met Bogdanov-Takens"
    assert (end["m"], end["n"], end["frequency"]) == pytest.approx((0, 0, 0), abs=1e-6)
    for point in found:
        assert point["m"] == pytest.approx(point["n"] ** 2, abs=1e-11)
        assert point["frequency"] ** 2 == pytest.approx(-2 * point["n"], abs=1e-11)


def test_generalized_hopf():
    """Growth mu + b r**2 - r**4: l1 = 2 b / omega, with omega = 2 (the radius is sqrt(2) |z| for |q| = 1)."""

    def field(u, p):
        s = u.x**2 + u.y**2
        growth = p.mu + p.b * s - s * s
        return growth * u.x - 2 * u.y, 2 * u.x + growth * u.y

    problem = AlgebraicProblem(field, ["x", "y"], {"mu": -1.0, "b": -0.5})
    hopf = first_hopf(problem, [0, 0], "mu", limits={"mu": (-2, 2)})
    found = contin.curve(hopf, free=["mu", "b"], limits={"b": (-1, 1)})
    assert labels(found) == ["EP", "GH", "EP"]
    assert found.labelled("GH")[0]["b"] == pytest.approx(0, abs=1e-10)
    for point in found:
        assert point["lyapunov"] == pytest.approx(point["b"], abs=1e-10)


@pytest.mark.sample(2)
@pytest.mark.parametrize("size", [1e-9, 1e-6, 1e-4, 1e9])
@pytest.mark.parametrize("b", [-0.37, -0.51])
def test_generalized_hopf_in_other_units(size, b):
    """l1 = b / size**2: its only term vanishes with it, and 1e-16 of 1e18 is no small number."""

    def field(u, p):
        x, y = u.x / size, u.y / size
        s = x * x + y * y
        growth = p.mu + p.b * s - s * s
        return size * (growth * x - 2 * y), size * (2 * x + growth * y)

    problem = AlgebraicProblem(field, ["x", "y"], {"mu": -1.0, "b": b})
    hopf = first_hopf(problem, [0, 0], "mu", limits={"mu": (-2, 2)})
    found = contin.curve(hopf, free=["mu", "b"], limits={"b": (-1, 1)})
    assert labels(found) == ["EP", "GH", "EP"]
    assert found.labelled("GH")[0]["b"] == pytest.approx(0, abs=1e-10)


def fold_hopf(u, p):
    growth = p.b + u.z
    return growth * u.x - 2 * u.y - u.x * u.z, 2 * u.x + growth * u.y, p.a - u.z**2 - u.x**2 - u.y**2


def test_zero_hopf_on_both_curves():
    """x = y = 0, z**2 = a: an eigenvalue -2 z, and a pair with the sum 2 b + z, imaginary at b = -z / 2."""
    problem = AlgebraicProblem(fold_hopf, ["x", "y", "z"], {"a": 2.0, "b": -0.5})
    options = {"direction": -1, "limits": {"a": (-1, 3)}}
    start = contin.trace(contin.solve(problem, [0, 0, math.sqrt(2)]), free=["a"], **options)
    (fold,) = start.labelled("LP")
    folds = contin.curve(fold, "b", limits={"b": (-1, 1)})
    assert labels(folds) == ["EP", "ZH", "EP"]
    assert folds.labelled("ZH")[0]["b"] == pytest.approx(0, abs=1e-9)
    hopf = start.labelled("HB")[0]
    hopfs = contin.curve(hopf, "b", limits={"b": (-1, 1)})
    (meeting,) = hopfs.labelled("ZH")
    assert (meeting["a"], meeting["b"]) == pytest.approx((0, 0), abs=1e-10)
    for point in hopfs:
        assert point["a"] == pytest.approx(point.x[2] ** 2, abs=1e-10)
        assert point["b"] == pytest.approx(-point.x[2] / 2, abs=1e-10)


def test_double_hopf_and_an_opposite_pair_of_real_eigenvalues():
    """Eigenvalues a -+ i, b -+ 2.5 i, -1 and .7 + b: on a = 0 the second pair crosses at b = 0; -1 + .7 + b = 0 is none."""

    def field(u, p):
        return (
            p.a * u.x - u.y, u.x + p.a * u.y, p.b * u.v - 2.5 * u.w, 2.5 * u.v + p.b * u.w, -u.r, (0.7 + p.b) * u.s,
        )  # fmt: skip

    problem = AlgebraicProblem(field, ["x", "y", "v", "w", "r", "s"], {"a": -1.0, "b": -0.5})
    hopf = first_hopf(problem, [0] * 6, "a", limits={"a": (-1, 1)})
    found = contin.curve(hopf, "b", limits={"b": (-0.6, 0.6)})
    assert labels(found) == ["EP", "HH", "EP"]
    assert found.labelled("HH")[0]["b"] == pytest.approx(0, abs=1e-10)


def bazykin(u, p):
    eaten = u.x * u.y / (1 + p.alpha * u.x)
    return u.x - eaten - 0.01 * u.x**2, -u.y + eaten - p.delta * u.y**2


def equilibrium(x, alpha):
    """y and delta at an equilibrium with this x, and trace and determinant of the Jacobian there."""
    s = 1 + alpha * x
    y = (1 - 0.01 * x) * s
    delta = (x / s - 1) / y
    a, b, c, d = 1 - y / s**2 - 0.02 * x, -x / s, y / s**2, -1 + x / s - 2 * delta * y
    return delta, a + d, a * d - b * c


@pytest.mark.full
def test_of_bazykin():
    """Predators and prey (Bazykin 1985; Kuznetsov, section 8.4): BT points by another solver, from formulas of x and alpha."""
    from scipy.optimize import fsolve

    problem = AlgebraicProblem(bazykin, ["x", "y"], {"alpha": 0.3, "delta": 0.1})
    hopf = first_hopf(problem, [2, 2], "alpha", direction=-1, limits={"alpha": (0, 1)})
    found = contin.curve(hopf, "delta", limits={"delta": (0, 2)})
    (end,) = found.labelled("BT")
    for point in found:
        delta, trace, _ = equilibrium(point.x[0], point["alpha"])
        assert (delta, trace) == pytest.approx((point["delta"], 0), abs=1e-9)
    start = contin.solve(problem, [2, 2])
    fold = contin.trace(start, free=["alpha"], limits={"alpha": (0.3, 1)}).labelled("LP")[0]
    folds = contin.curve(fold, "delta", direction=-1, limits={"delta": (0, 1)}, max_points=500)
    other = contin.curve(fold, "delta", limits={"delta": (0, 1)}, max_points=500)
    special = [point for branch in (folds, other) for point in branch if point.label in ("BT", "CP")]
    assert sorted(point.label for point in special) == ["BT", "BT", "CP"]
    for point in [*special, end]:
        if point.label == "BT":
            x, alpha = fsolve(lambda z: equilibrium(*z)[1:], [point.x[0], point["alpha"]], xtol=1e-13)
            assert (point["alpha"], point["delta"]) == pytest.approx((alpha, equilibrium(x, alpha)[0]), abs=1e-9)
    assert min(abs(point["alpha"] - end["alpha"]) for point in special) < 1e-9


def test_of_the_reactor_of_the_ab_demo():
    """Equilibria at p1 = x exp(-y) / (1 - x) with y = p2 x / (1 + p3), and Hopf points where the trace vanishes."""
    start = contin.solve(reactor(), [0, 0], {"p1": 0.0, "p2": 14.0})
    hopf = contin.trace(start, free=["p1"], limits={"p1": (0, 0.15)}, direction=1).labelled("HB")[0]
    for direction in (1, -1):
        found = contin.curve(hopf, "p2", direction=direction, limits={"p2": (5, 18), "p1": (0.01, 0.4)})
        assert len(found) > 5
        for point in found:
            x, p2, p3 = point.x[0], point["p2"], point["p3"]
            assert p2 * x - 1 / (1 - x) - 1 - p3 == pytest.approx(0, abs=1e-8)


@pytest.mark.full
def test_of_the_reactor_of_the_abc_demo():
    """From Hopf points at beta = 1.55 to those at 1.57 and 1.21, which the bank knows to 30 digits; BT on both curves."""
    zeros = {"beta": [1.21, 1.57]}
    known = {beta: [case.values for case in specials.specials if case.label == "HB"] for beta, specials in
             ((1.21, abc.CASES[0]), (1.57, abc.CASES[2]))}  # fmt: skip
    first, *_, last = abc.run(1.55).labelled("HB")
    limits = {"beta": (1.1, 1.6)}
    curves = [
        contin.curve(start, free=["d", "beta"], direction=way, limits=limits, zeros=zeros)
        for start in (first, last) for way in (1, -1)
    ]  # fmt: skip
    passed = [point for branch in curves for point in branch.labelled("UZ")]
    assert sorted(point.name for point in passed) == ["beta = 1.21", "beta = 1.57", "beta = 1.57"]
    for point in passed:
        values = known[round(point["beta"], 6)]
        assert min(abs(point["d"] - value["d"]) + abs(point["frequency"] - value["frequency"]) for value in values) < 1e-9
    (end,) = [point for branch in curves for point in branch.labelled("BT")]
    fold = abc.run(1.21).labelled("LP")[0]
    ends = contin.curve(fold, free=["d", "beta"], limits={"beta": (1.1, 1.4)}).labelled("BT")
    assert min(abs(point["d"] - end["d"]) + abs(point["beta"] - end["beta"]) for point in ends) < 1e-9


def test_both_parameters_may_be_others():
    """The Hopf point is found in p1; the curve is in p2 and p3, with p1 as it was."""
    start = contin.solve(reactor(), [0, 0], {"p1": 0.0, "p2": 14.0})
    hopf = contin.trace(start, free=["p1"], limits={"p1": (0, 0.15)}).labelled("HB")[0]
    for point in contin.curve(hopf, free=["p2", "p3"], limits={"p3": (1.5, 3)}):
        x, p2, p3 = point.x[0], point["p2"], point["p3"]
        assert p2 * x - 1 / (1 - x) - 1 - p3 == pytest.approx(0, abs=1e-8)
        assert point["p1"] == pytest.approx(hopf["p1"], abs=1e-14)


def test_what_is_refused():
    problem = AlgebraicProblem(takens, ["x", "y"], {"m": 4.0, "n": -1.0})
    hopf = first_hopf(problem, [2, 0], "m", direction=-1, limits={"m": (0.1, 5)})
    with pytest.raises(ProblemError, match=r"give the second parameter, or free=\[first, second\]"):
        contin.curve(hopf)
    with pytest.raises(ProblemError, match="free: m, m must be two of the parameters m, n"):
        contin.curve(hopf, free=["m", "m"])
    with pytest.raises(ProblemError, match="free: m, k must be two of the parameters m, n"):
        contin.curve(hopf, free=["m", "k"])
    named = AlgebraicProblem(takens, ["x", "y"], {"m": 4.0, "n": -1.0}, {"frequency": lambda u, p: u.x})
    hopf = first_hopf(named, [2, 0], "m", direction=-1, limits={"m": (0.1, 5)})
    with pytest.raises(ProblemError, match="its problem has a column 'frequency'"):
        contin.curve(hopf, "n")


def test_neutral_saddles_are_not_followed():
    """From an array of eigenvalues: the two critical ones of every point are -+ i frequency."""
    problem = AlgebraicProblem(takens, ["x", "y"], {"m": 4.0, "n": -1.0})
    hopf = first_hopf(problem, [2, 0], "m", direction=-1, limits={"m": (0.1, 5)})
    for point in contin.curve(hopf, "n", direction=-1, limits={"n": (-3, 3)}):
        values = point.system.base.eigenvalues(point.x[:-1])
        assert np.sort_complex(values) == pytest.approx([-1j * point["frequency"], 1j * point["frequency"]], abs=1e-10)
