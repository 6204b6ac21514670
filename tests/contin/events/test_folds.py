"""Folds inside a step: two of them that leave no sign change at its ends are found, and no fold is invented."""

import math

import numpy as np
import pytest

from contin import AlgebraicProblem, Newton, solve, trace
from contin.continuation.rules import predict
from contin.core.step import corrected, standing_at
from contin.core.trial import linearization
from contin.events.arc import Arc
from contin.events.folds import FoldSearch
from contin.events.usual import fold
from contin.lowlevel import Algebraic


def cubic(square):
    """mu = x^3 / 3 - square x: folds at x = -+ sqrt(square), none where that is not real."""
    problem = AlgebraicProblem(lambda u, p: (u.x**3 / 3 - p.square * u.x - p.mu,), ["x"], {"mu": 0.0, "square": 0.0})
    return Algebraic(problem, ["mu"], {"square": square})


def search(square, start, step):
    """The search for folds in one step along the cubic, from x = start in the direction of growing x; and the two ends."""
    system = cubic(square)
    x = np.array([start, start**3 / 3 - square * start])
    tangent = linearization(system, x, np.array([1.0, 0.0])).tangent
    state = standing_at(system, x, tangent, step)
    before = corrected(state, x, 0.0, Newton())
    trial = corrected(state, predict(state, step), step, Newton())
    arc = Arc(state, (0.0, before), trial, step, Newton())
    return FoldSearch(arc, fold("mu"), lambda: None), (0.0, before), (step, trial)


@pytest.mark.parametrize("half", [0.3, 0.1, 1e-2, 1e-3])
@pytest.mark.parametrize(("start", "step"), [(-0.5, 1.0), (-0.4, 0.9), (-0.45, 1.2)])
def test_two_folds_in_one_step(half, start, step):
    """At x = -+ half, in order, although the tangent's component has the same sign at both ends of the step."""
    folds, left, right = search(half**2, start, step)
    assert left[1].value(folds.fold) > 0 and right[1].value(folds.fold) > 0
    found = folds.between(left, right)
    assert [point.label for point in found] == ["LP", "LP"]
    assert [point.trial.x[0] for point in found] == pytest.approx([-half, half], abs=1e-9)
    assert 0 < found[0].at < found[1].at < step


def test_one_fold_in_a_step():
    folds, left, right = search(0.25, -0.7, 0.7)
    (found,) = folds.between(left, right)
    assert found.trial.x == pytest.approx([-0.5, 1 / 12], abs=1e-10)
    assert folds.estimate(left, right) == pytest.approx(found.at, abs=0.05)


@pytest.mark.parametrize("square", [-1e-10, -1e-4, -0.01, -0.3])
def test_a_rate_that_dips_without_passing_zero_is_no_fold(square):
    """mu' = x^2 - square is smallest at x = 0, and positive there."""
    folds, left, right = search(square, -0.5, 1.0)
    assert folds.between(left, right) == []


def test_a_parameter_that_does_not_move_has_no_folds():
    """On x = anything at mu = 0 both rates are zero: their signs are round-off."""
    problem = AlgebraicProblem(lambda u, p: (p.mu * (1 + u.x**2),), ["x"], {"mu": 0.0})
    system = Algebraic(problem, ["mu"])
    state = standing_at(system, np.zeros(2), np.array([1.0, 0.0]), 0.5)
    before, trial = (corrected(state, predict(state, s), s, Newton()) for s in (0.0, 0.5))
    search = FoldSearch(Arc(state, (0.0, before), trial, 0.5, Newton()), fold("mu"), lambda: None)
    assert search.between((0.0, before), (0.5, trial)) == []


# --- the same in a run ----------------------------------------------------------------------------------------------


def labels(branch):
    return [point.label for point in branch.points[1:] if point.label]


def close_folds(x, square):
    """mu(x) with mu' = (x^2 - square) (2 + sin x), integrated by hand from 0."""
    s, c = math.sin(x), math.cos(x)
    return 2 * x**3 / 3 - 2 * square * x + 2 * x * s - (x**2 - 2 - square) * c - (2 + square)


@pytest.mark.sample(8)
@pytest.mark.parametrize("apart", [1e-1, 1e-3, 1e-5])
@pytest.mark.parametrize("start", np.linspace(-1, -0.4, 13))
def test_two_folds_close_together(apart, start):
    """The tangent's sign is the same at both ends of a step over both folds.

    Further off the slope is no parabola, so the place between the folds has to be found.
    """

    def residual(u, p):
        x, s, c = u.x, math.sin(u.x), math.cos(u.x)
        return (2 * x**3 / 3 - 2 * p.square * x + 2 * x * s - (x**2 - 2 - p.square) * c - (2 + p.square) - p.mu,)

    square = apart**2 / 4
    problem = AlgebraicProblem(residual, ["x"], {"mu": 0.0, "square": 0.0})
    point = solve(problem, [start], {"mu": close_folds(start, square), "square": square})
    branch = trace(point, free=["mu"], limits={"mu": (-3, 0.5)}, step=0.1)
    assert labels(branch) == ["LP", "LP", "EP"]
    assert [float(fold.x[0]) for fold in branch.labelled("LP")] == pytest.approx([-apart / 2, apart / 2], abs=1e-9)


def test_one_cubic_inflection_is_no_fold():
    """mu' = x^2 + 1e-10: the slope nearly vanishes, but does not."""
    system = cubic(-1e-10)
    start = solve(system.problem, [-1.0], {"mu": -1 / 3 - 1e-10, "square": -1e-10})
    assert labels(trace(start, free=["mu"], limits={"mu": (-1, 1)})) == ["EP"]


@pytest.mark.sample(5)
@pytest.mark.parametrize("apart", [0.003, 0.01, 0.026, 0.0485, 0.1, 0.3])
@pytest.mark.parametrize("step", [0.05, 0.3, 1.0])
def test_folds_on_both_sides_of_a_pitchfork(apart, step):
    """a = 2 d^2 x^2 - x^4 crosses x = 0 between folds at x = -+d: all three turning points may lie in one step."""
    problem = AlgebraicProblem(
        lambda u, p: (u.x * (p.a - 2 * p.d**2 * u.x**2 + u.x**4),), ["x"], {"a": 0.0, "d": 0.1},
        functionals={"X": lambda u, p: u.x}, dynamics=False,
    )  # fmt: skip
    start = solve(problem, [1.0], {"a": 2 * apart**2 - 1, "d": apart})
    through = trace(start, free=["a"], step=step, limits={"X": (-1.01, 2)})
    assert labels(through) == ["LP", "BP", "LP", "EP"]
    ended = trace(start, free=["a"], step=step, trivial="X")
    assert labels(ended) == ["LP", "EP"]
    for point in (*through.labelled("LP"), *ended.labelled("LP")):
        assert point["a"] == pytest.approx(apart**4, abs=1e-12)
        assert abs(point["X"]) == pytest.approx(apart, abs=1e-7)


@pytest.mark.full
@pytest.mark.parametrize("factor", [lambda u, s: 1, lambda u, s: 1 + u**2, lambda u, s: 1 + s])
def test_a_vertical_branch_of_a_discretized_column_has_no_folds(factor):
    """(u'''' + lam u'') f(u) = 0 by differences: at a load all amplitudes solve it. Round-off of the load is 1e-11 and more.

    With 30 places the load is (2 - 2 cos(pi h)) / h^2, h = 1 / 31.
    """
    count, h = 30, 1 / 31

    def column(u, p):
        values = [-u[0], 0, *(u[i] for i in range(count)), 0, -u[count - 1]]
        square = h * sum(each**2 for each in values[2:-2])
        bent = [(values[i - 1] - 2 * values[i] + values[i + 1]) / h**2 for i in range(1, count + 3)]
        return tuple(
            ((bent[i] - 2 * bent[i + 1] + bent[i + 2]) / h**2 + p.lam * bent[i + 1]) * factor(values[i + 2], square)
            for i in range(count)
        )

    problem = AlgebraicProblem(column, [f"u{i}" for i in range(count)], {"lam": 8.0})
    (buckling,) = trace(solve(problem, [0] * count), free=["lam"], limits={"lam": (8, 11)}).labelled("BP")
    branch = trace(buckling, branch=1, limits={"lam": (5, 15)}, max_points=60)
    assert [point.label for point in branch if point.label] == ["BP", "EP"]
    assert branch.column("lam") == pytest.approx((2 - 2 * math.cos(math.pi * h)) / h**2, abs=1e-9)
    assert max(branch.points[-1].x[:count]) > 100
    (note,) = branch.notes
    assert note.startswith("lam stays at 9.86116") and "a vertical family" in note


@pytest.mark.sample(4)
@pytest.mark.parametrize("steps", range(12))
def test_a_hysteresis_point_is_no_fold(steps):
    """A stirred tank, p2 = 16, p3 = 3: both folds meet at x = 1/2, y = 2, p1 = exp(-2), where p1 stands still and goes on.

    p1 = x exp(-4 x) / (1 - x) on equilibria, whose derivative (1 - 2 x)^2 exp(-4 x) / (1 - x)^2 has one sign.
    """

    def tank(u, p):
        rate = p.p1 * (1 - u.x) * math.exp(u.y)
        return -u.x + rate, -u.y + p.p2 * rate - p.p3 * u.y

    problem = AlgebraicProblem(tank, ["x", "y"], {"p1": 0.0, "p2": 16.0, "p3": 3.0})
    step = 0.02 * (1 + 0.185 * steps)
    branch = trace(solve(problem, [0.0, 0.0]), free=["p1"], limits={"p1": (-1, 0.25)}, step=step, max_step=0.1 * (1 + steps))
    assert not branch.labelled("LP") and branch[-1]["p1"] == pytest.approx(0.25)
