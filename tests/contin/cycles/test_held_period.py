"""Cycles of a given period in two parameters, and the points where such curves cross, against closed forms and AUTO-07p."""

import functools
import math

import pytest

import contin

TWO_PI = 2 * math.pi


def field(u, p):
    """Cycles r^2 = m of the period 2 pi / (w + q m) with z = 0; others with z = r^2 - c branch off at m = c."""
    square = u.x**2 + u.y**2
    turn = p.w + p.q * square
    return p.m * u.x - turn * u.y - u.x * square, turn * u.x + p.m * u.y - u.y * square, u.z * (square - p.c - u.z)


@functools.cache
def start():
    problem = contin.CycleProblem(field, ["x", "y", "z"], {"m": 0.25, "w": 0.9, "q": 0.4, "c": 0.49})
    return contin.solve(problem, lambda t: (0.5 * math.cos(TWO_PI * t), 0.5 * math.sin(TWO_PI * t), 0), {"period": 6.3})


def test_a_column_keeps_its_value():
    point = contin.trace(start(), free=["m"], max_points=1).points[0]
    curve = contin.curve(point, free=["m", "w"], hold="period", branch_points=True, limits={"m": (0, 1)}, direction=-1)
    assert all(abs(each["period"] - point["period"]) < 1e-12 for each in curve)
    assert max(abs(each["w"] + 0.4 * each["m"] - 1) for each in curve) < 1e-10
    (crossing,) = curve.labelled("BP")
    assert abs(crossing["m"] - 0.49) < 1e-10 and abs(crossing["w"] - 1 + 0.4 * 0.49) < 1e-10
    other = contin.trace(crossing, branch=1, max_points=3).points[-1]
    assert abs(other["period"] - point["period"]) < 1e-12 and abs(other["max_z"]) > 1e-3
    back = contin.curve(point, free=["m", "w"], hold="period", limits={"m": (-1, 1)})
    assert "Hopf point where the cycles have no size" in back.stop.message and abs(back.points[-1]["m"]) < 1e-2


@pytest.mark.full
def test_curves_of_branch_points_end_at_hopf_points():
    problem = contin.CycleProblem(field, ["x", "y", "z"], {"m": 0.25, "w": 0.9, "q": 0.4, "c": 0.49})
    branch = contin.trace(contin.solve(problem, start()), free=["m"], limits={"m": (0.1, 1)})
    (crossing,) = branch.labelled("BP")
    curve = contin.curve(crossing, "c", limits={"c": (-1, 1)}, direction=-1)
    assert max(abs(each["m"] - each["c"]) for each in curve) < 1e-10
    assert "Hopf point where the cycles have no size" in curve.stop.message


def chain(u, p):
    """AUTO's demo tfc, a food chain in logarithms of the lower two."""
    x, y = math.exp(u.x), math.exp(u.y)
    return (
        1 - x - p.a1 * y / (1 + p.b1 * x),
        p.a1 * x / (1 + p.b1 * x) - p.d1 - p.a2 * u.z / (1 + p.b2 * y),
        u.z * (p.a2 * y / (1 + p.b2 * y) - p.d2),
    )


def test_food_chain():
    """The top invades where its mean rate of growth is zero. AUTO's run 5, with the period fixed, labels a BP there."""
    growth = {"growth": lambda u, p: p.a2 * math.exp(u.y) / (1 + p.b2 * math.exp(u.y)) - p.d2}
    values = {"a1": 5.0, "b1": 3.0, "d1": 0.85, "a2": 0.1, "b2": 2.0, "d2": 0.013}
    rest = contin.AlgebraicProblem(chain, ["x", "y", "z"], values, growth)
    line = contin.trace(contin.solve(rest, [-1.0, -1.4, 0.0]), free=["d1"], direction=-1, limits={"d1": (0.7, 0.9)})
    grown = contin.trace(line.labelled("HB")[0], branch=1, limits={"d1": (0.7, 0.9)}, zeros={"d1": [0.75]})
    curve = contin.curve(
        grown.labelled("UZ")[0], free=["d1", "a1"], hold="period", branch_points=True, limits={"d1": (0.7, 0.9)}
    )
    (crossing,) = curve.labelled("BP")
    assert abs(crossing["growth"]) < 1e-10
    assert crossing["period"] == pytest.approx(12.68461066, abs=2e-8)
    assert crossing["d1"] == pytest.approx(0.77068976441, abs=1e-7)
    assert crossing["a1"] == pytest.approx(5.6610878639, abs=1e-6)


def test_what_is_held_must_be_a_column():
    point = contin.trace(start(), free=["m"], max_points=1).points[0]
    with pytest.raises(contin.ProblemError, match="hold: 'time' is no column; there are m, w, q, c, period, max_x"):
        contin.curve(point, "w", hold="time")
