"""Branches that go to infinity end where numbers are round-off of those at their start."""

import math

import pytest

from contin import AlgebraicProblem, BoundaryValueProblem, MapProblem, diagram, solve, trace

BRANCHES = {"pole": lambda u, p: (u.x * p.a - 1,), "line": lambda u, p: (u.x - p.a,), "parabola": lambda u, p: (u.x**2 - p.a,)}


@pytest.mark.parametrize("name", BRANCHES)
def test_a_branch_ends_where_it_goes_to_infinity(name):
    start = solve(AlgebraicProblem(BRANCHES[name], ["x"], {"a": 1.0}), [1.0])
    branch = trace(start, free=["a"], direction=-1 if name == "pole" else 1)
    assert branch.stop.reason == "infinity" and len(branch) < 200
    assert str(branch.stop).startswith("the branch goes to infinity: a = ")
    held = trace(start, free=["a"], direction=-1 if name == "pole" else 1, limits={"a": (1e-18, 1e18)})
    assert held.stop.reason == "limit"


def test_limits_that_are_not_reached_end_no_run():
    """x = 1 - 1/r goes to minus infinity at r = 0, S = D/(1 - D) of a chemostat to infinity at D = 1."""
    logistic = AlgebraicProblem(lambda u, p: (p.r * u.x * (1 - u.x) - u.x,), ["x"], {"r": 0.5})
    found = diagram(solve(logistic, [0.0]), free=["r"], limits={"r": (0, 4)})
    last = found.branches[-1]
    assert last.stop.reason == "infinity" and len(last) < 100 and abs(last["r"] * (1 - last["x"]) - 1).max() < 1e-9
    assert str(last.stop).endswith("it comes no nearer to a limit of r")
    chemostat = AlgebraicProblem(lambda u, p: (u.S / (1 + u.S) - p.D,), ["S"], {"D": 0.5})
    washed = trace(solve(chemostat, [1.0]), free=["D"], limits={"D": (0.2, 2)})
    assert washed.stop.reason == "infinity" and len(washed) < 100 and abs(washed[-1]["D"] - 1) < 1e-12


def test_a_fixed_point_of_a_map_that_goes_to_infinity():
    """x = 1 - 1/r again, of the logistic map: its unknowns have no sizes."""
    logistic = MapProblem(lambda u, p: (p.r * u.x * (1 - u.x),), ["x"], {"r": 2.0})
    branch = trace(solve(logistic, [0.5]), free=["r"], limits={"r": (-5, 5)}, direction=-1)
    assert branch.stop.reason == "infinity" and len(branch) < 100 and abs(branch[-1]["r"] * (1 - branch[-1]["x"]) - 1) < 1e-4


@pytest.mark.parametrize("unit", [1.0, 1e-9, 1e9])
def test_a_limit_to_which_a_branch_tends_ends_it(unit):
    """Bratu's problem tends to lambda = 0 while u grows as a logarithm: it went on to 5e-303, in ten times as many points."""
    bratu = BoundaryValueProblem(
        lambda t, u, p: (u.v, -p.lam / unit * math.exp(u.u)), lambda a, b, p: (a.u, b.u), ["u", "v"], {"lam": 0.0}
    )
    branch = trace(solve(bratu, [0.0, 0.0]), free=["lam"], limits={"lam": (0, 4 * unit)})
    assert str(branch.stop) == "reached lam = 0 up to round-off" and len(branch) < 50
    assert branch.labelled("LP")[0]["lam"] == pytest.approx(3.513830719125161 * unit) and 0 < branch[-1]["lam"] < 1e-15 * unit
    rest = AlgebraicProblem(lambda u, p: (math.exp(-u.x) - p.a + 1,), ["x"], {"a": 2.0})
    for low, last in ((1.0, 1.0), (1.0 + 1e-9, 1.0 + 1e-9)):  # the second one is reached
        branch = trace(solve(rest, [0.0]), free=["a"], direction=-1, limits={"a": (low, 3)})
        assert branch.stop.reason == "limit" and len(branch) < 30 and branch[-1]["a"] == pytest.approx(last, abs=1e-13)
