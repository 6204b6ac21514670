"""Zeros and limits that lie exactly at a fold or branch point: the usual case for values that are typed as round numbers."""

import math

import pytest

import contin

FOLD = 3.513830719125161  # Bratu's, from its closed form
BRATU = contin.BoundaryValueProblem(
    lambda t, u, p: (u.v, -p.lam * math.exp(u.u)), lambda a, b, p: (a.u, b.u), ["u", "v"], {"lam": 0.0},
    functionals={"mean": lambda t, u, p: u.u},
)  # fmt: skip
#: u'' + l^2 u = u^3 between zero ends leaves u = 0 at l = pi.
SOFT = contin.BoundaryValueProblem(
    lambda t, u, p: (u.v, -(p.l**2) * u.u + u.u**3), lambda a, b, p: (a.u, b.u), ["u", "v"], {"l": 1.0}
)
PITCHFORK = contin.AlgebraicProblem(lambda u, p: (u.x * (p.a - u.x**2),), ["x"], {"a": -1.0}, dynamics=False)
#: x^2 = 4 - a: a fold at a round number.
ROUND = contin.AlgebraicProblem(lambda u, p: (p.a - 4 + u.x**2,), ["x"], {"a": 0.0}, dynamics=False)


def labels(branch):
    assert not [point.name for point in branch if "possible" in point.name]
    return [point.label for point in branch if point.label]


def test_a_limit_at_a_branch_point():
    branch = contin.trace(contin.solve(SOFT, [0, 0]), free=["l"], limits={"l": (0, math.pi)})
    assert labels(branch) == ["EP", "BP", "EP"]
    assert [point["l"] for point in branch.points[-2:]] == pytest.approx([math.pi] * 2, abs=1e-11)


def test_a_zero_at_a_branch_point():
    branch = contin.trace(contin.solve(SOFT, [0, 0]), free=["l"], limits={"l": (0, 5)}, zeros={"l": [math.pi]})
    assert labels(branch) == ["EP", "BP", "UZ", "EP"]
    assert branch.labelled("UZ")[0]["l"] == pytest.approx(math.pi, abs=1e-11)


@pytest.mark.parametrize(("name", "given"), [("limits", {"a": (-1, 0)}), ("zeros", {"a": [0.0]})])
def test_round_numbers_at_a_pitchfork(name, given):
    options = {"limits": {"a": (-1, 1)}} | {name: given}
    branch = contin.trace(contin.solve(PITCHFORK, [0.0]), free=["a"], **options)
    expected = ["EP", "BP", "EP"] if name == "limits" else ["EP", "BP", "UZ", "EP"]
    assert labels(branch) == expected
    assert all(abs(point["a"]) < 1e-12 for point in branch.points if point.label in ("BP", "UZ"))


@pytest.mark.sample(1)
@pytest.mark.parametrize("value", [FOLD, FOLD * (1 - 1e-15), FOLD * (1 + 1e-15)])
def test_a_zero_at_a_fold_is_one_point(value):
    """Below the fold's value the branch passes it twice, above never; to round-off it is the fold."""
    limits = {"lam": (0, 4), "mean": (-1, 5)}
    branch = contin.trace(contin.solve(BRATU, [0, 0]), free=["lam"], limits=limits, zeros={"lam": [value]})
    assert labels(branch) == ["EP", "LP", "UZ", "EP"]
    fold, zero = branch.labelled("LP") + branch.labelled("UZ")
    assert zero["mean"] == pytest.approx(fold["mean"], abs=1e-12)


def test_a_limit_at_a_fold_ends_there():
    branch = contin.trace(contin.solve(ROUND, [2.0]), free=["a"], limits={"a": (-1, 4)})
    assert labels(branch) == ["EP", "LP", "EP"] and str(branch.stop) == "reached a = 4"
    assert abs(branch.points[-1].x[0]) < 1e-9


def test_two_zeros_beside_a_fold_stay_two():
    branch = contin.trace(contin.solve(ROUND, [2.0]), free=["a"], limits={"a": (-1, 5)}, zeros={"a": [4 - 1e-6]})
    assert labels(branch) == ["EP", "UZ", "LP", "UZ", "EP"]
    assert [point.x[0] for point in branch.labelled("UZ")] == pytest.approx([1e-3, -1e-3], rel=1e-6)


@pytest.mark.sample(3)
@pytest.mark.parametrize("apart", [1e-1, 1e-2, 1e-3, 1e-4, 1e-5])
@pytest.mark.parametrize("side", [1, -1])
def test_a_fold_close_to_a_branch_point(apart, side):
    """mu = (x - d)^2 with y = 0 has a fold at x = d; y (x - y^2) = 0 crosses it at x = 0, where mu does not turn."""
    d = side * apart
    problem = contin.AlgebraicProblem(
        lambda u, p: (p.mu - (u.x - p.d) ** 2, u.y * (u.x - u.y**2)), ["x", "y"], {"mu": 1.0, "d": d}
    )
    start = contin.solve(problem, [1.0 + d, 0.0])
    branch = contin.trace(start, free=["mu"], direction=-1, limits={"mu": (-1, 1.5)})
    found = [point for point in branch if point.label in ("LP", "BP")]
    assert [point.label for point in found] == (["LP", "BP"] if side > 0 else ["BP", "LP"])
    for point in found:
        x = point.system.states(point.x)[0, 0]
        assert x == pytest.approx(d if point.label == "LP" else 0, abs=1e-8)


def test_a_fold_at_a_branch_point_is_the_branch_point():
    problem = contin.AlgebraicProblem(lambda u, p: (p.mu - u.x**2, u.y * (u.x - u.y**2)), ["x", "y"], {"mu": 1.0})
    branch = contin.trace(contin.solve(problem, [1.0, 0.0]), free=["mu"], direction=-1, limits={"mu": (-1, 1.5)})
    assert [point.label for point in branch if point.label in ("LP", "BP")] == ["BP"]
