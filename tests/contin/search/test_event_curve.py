"""Curves along which a function keeps its value, through labelled points of branches and of curves in two parameters."""

import functools

import numpy as np
import pytest

from bank.gelfand import perturbed_gelfand
from contin import (
    AlgebraicProblem,
    Event,
    ProblemError,
    curve,
    load,
    save,
    solve,
    trace,
)


def middle(trial):
    return float(trial.system.evaluate(trial.x, np.array([0.5]))[0, 0]) - 2.0


HOT = Event("UZ", "hot", middle)


@functools.cache
def branch():
    return trace(
        solve(perturbed_gelfand(), [0, 0]), free=["lam"], limits={"lam": (0, 6), "mean": (-1, 3)}, zeros={"mean": [1.0]},
        events=[HOT],
    )  # fmt: skip


@pytest.mark.parametrize("name", ["mean = 1", "mean = 3", "hot"])
def test_user_zeros_in_two_parameters(name):
    """At eps = .22 the curve is where the branch at that eps has the same label."""
    start = next(point for point in branch() if point.name == name)
    event = HOT if name == "hot" else None
    followed = curve(start, "eps", event=event, limits={"eps": (0.15, 0.25)}, zeros={"eps": [0.22]})
    assert followed.points[-1].name == "eps = 0.25"
    there = trace(
        solve(perturbed_gelfand(), [0, 0], {"eps": 0.22}), free=["lam"], limits={"lam": (0, 6), "mean": (-1, 3)},
        zeros={"mean": [1.0]}, events=[HOT],
    )  # fmt: skip
    known = next(point for point in there if point.name == name)
    (found,) = followed.labelled("UZ")
    assert (found["lam"], found["mean"]) == pytest.approx((known["lam"], known["mean"]), abs=1e-9)
    assert found.errors["lam"] < 1e-8
    for point in followed:
        assert (
            HOT.function(point) == pytest.approx(0, abs=1e-9)
            if event
            else point["mean"] == pytest.approx(float(name[-1]), abs=1e-9)
        )


#: More digits than a name holds.
EXACT = 1.2345678912345


@pytest.mark.parametrize("label", ["UZ", "EP"])
def test_a_curve_keeps_the_value_that_was_given(label, tmp_path):
    """The mean is held at the number that was given, to round-off, not at that of the point's name; from a file, too."""
    problem = perturbed_gelfand()
    given = {"zeros": {"mean": [EXACT]}} if label == "UZ" else {"limits": {"mean": (-1, EXACT)}}
    run = trace(solve(problem, [0, 0]), free=["lam"], **{"limits": {"mean": (-1, 2)}, **given})
    save(run, tmp_path / "run.npz")
    for found in (run, load(problem, tmp_path / "run.npz")):
        start = found.labelled(label)[-1]
        assert (start.name, start.column, start.value) == ("mean = 1.23457", "mean", EXACT)
        assert np.abs(curve(start, "eps", max_points=5).column("mean") - EXACT).max() < 1e-13


def test_the_value_of_a_state_is_kept():
    """x^3 - b x + a = 0 at x = -1 / 7: a = 1 / 343 - b / 7."""
    problem = AlgebraicProblem(lambda u, p: (u.x**3 - p.b * u.x + p.a,), ["x"], {"a": 2.0, "b": 1.0})
    run = trace(solve(problem, [-1.5]), free=["a"], direction=-1, limits={"a": (-2, 3)}, zeros={"x": [-1 / 7]})
    (start,) = run.labelled("UZ")
    assert start.value == -1 / 7
    for point in curve(start, "b", limits={"b": (1, 3)}):
        assert point["a"] == pytest.approx(1 / 343 - point["b"] / 7, abs=1e-13)


def test_what_is_held_is_no_word():
    """Sensitivities at a start, or at a point without a column, hold the first free parameter: nothing changes then."""
    problem = AlgebraicProblem(lambda u, p: (u.x**3 - p.b * u.x + p.a,), ["x"], {"a": 2.0, "b": 1.0})
    run = trace(solve(problem, [-1.5]), free=["a"], direction=-1, limits={"a": (-2, 3)})
    assert run.points[0].name == "start"
    assert run.points[0].sensitivities()["b"]["a"] == pytest.approx(0, abs=1e-12)


@functools.cache
def swallowtail():
    """x^4 + a x^2 + b x + c; its fold curve at a = -6 from one cusp to the other."""
    problem = AlgebraicProblem(lambda u, p: (u.x**4 + p.a * u.x**2 + p.b * u.x + p.c,), ["x"], {"a": -6.0, "b": 0.0, "c": 0.0})
    fold = trace(solve(problem, [2.4]), free=["c"], limits={"c": (-10, 10)}).labelled("LP")[0]
    return curve(fold, "b", limits={"b": (-20, 20)}, zeros={"b": [1.0]})


@pytest.mark.full
def test_cusps_in_three_parameters():
    """a = -6 x^2, b = 8 x^3, c = -3 x^4, which come together in the swallowtail at the origin."""
    cusp = swallowtail().labelled("CP")[0]
    assert abs(cusp["b"]) == pytest.approx(8, abs=1e-9)
    cusps = curve(cusp, "a", limits={"a": (-10, 1), "b": (-20, 20)})
    for point in cusps:
        x = point.x[0]
        assert (point["a"], point["b"], point["c"]) == pytest.approx((-6 * x**2, 8 * x**3, -3 * x**4), abs=1e-7)
    assert min(point["b"] for point in cusps) < 0 < max(point["b"] for point in cusps)


def test_a_user_zero_of_a_curve_in_three_parameters():
    """Folds with b = 1: 4 x^3 + 2 a x + 1 = 0."""
    found = curve(swallowtail().labelled("UZ")[0], "a", limits={"a": (-8, -5)})
    for point in found:
        x = point.x[0]
        assert point["b"] == pytest.approx(1, abs=1e-10)
        assert 4 * x**3 + 2 * point["a"] * x + 1 == pytest.approx(0, abs=1e-8)


def test_wrong_events():
    start = next(point for point in branch() if point.name == "hot")
    with pytest.raises(ProblemError, match="for one of your own events, give it as event"):
        curve(start, "eps")
    with pytest.raises(ProblemError, match="event: 'cold' is 1 at the start; it must be the function that labelled it"):
        curve(start, "eps", event=Event("UZ", "cold", lambda trial: middle(trial) + 1.0))


@pytest.mark.full
def test_a_curve_ends_where_its_event_is_not_confirmed():
    """x = a b = 0.3 counts below b = 0.7 only."""
    plane = AlgebraicProblem(lambda u, p: (u.x - p.a * p.b,), ["x"], {"a": 1.0, "b": 0.5})
    event = Event("UZ", "low", lambda trial: trial["x"] - 0.3, confirm=lambda trial: trial["b"] < 0.7)
    (start,) = trace(solve(plane, [0.5]), free=["a"], direction=-1, limits={"a": (0, 2)}, events=[event]).labelled("UZ")
    found = curve(start, "b", event=event, limits={"b": (0.1, 2)})
    assert "the end of 'low'" in str(found.stop) and found[-1]["b"] == pytest.approx(0.7, abs=1e-6)
    assert max(abs(point["a"] * point["b"] - 0.3) for point in found) < 1e-9
    other = Event("UZ", "high", event.function, confirm=lambda trial: trial["b"] > 0.7)
    with pytest.raises(ProblemError, match="confirm of 'high' returns False at the start"):
        curve(start, "b", event=other)
