"""Branches that go to infinity end where numbers are round-off of those at their start."""

import pytest

from contin import AlgebraicProblem, solve, trace

BRANCHES = {"pole": lambda u, p: (u.x * p.a - 1,), "line": lambda u, p: (u.x - p.a,), "parabola": lambda u, p: (u.x**2 - p.a,)}


@pytest.mark.parametrize("name", BRANCHES)
def test_a_branch_ends_where_it_goes_to_infinity(name):
    start = solve(AlgebraicProblem(BRANCHES[name], ["x"], {"a": 1.0}), [1.0])
    branch = trace(start, free=["a"], direction=-1 if name == "pole" else 1)
    assert branch.stop.reason == "infinity" and len(branch) < 200
    assert str(branch.stop).startswith("the branch goes to infinity: a = ")
    held = trace(start, free=["a"], direction=-1 if name == "pole" else 1, limits={"a": (1e-18, 1e18)})
    assert held.stop.reason == "limit"
