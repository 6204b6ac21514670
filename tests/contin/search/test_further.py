"""Disconnected solutions: what a search finds, against closed forms, polynomial roots and shooting; and what it says."""

import functools
import math

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.optimize import brentq

import contin
from contin import AlgebraicProblem, BoundaryValueProblem, ProblemError, Search, diagram, solve


def at(found, name, value, column):
    """Values of a column where branches of a diagram pass a value of the parameter, each solution once, in order."""
    values = sorted(point[column] for branch in found.branches for point in branch if abs(point[name] - value) < 1e-9)
    return [each for number, each in enumerate(values) if number == 0 or each - values[number - 1] > 1e-6]


def line_and_circle():
    """x = a, and a circle about (1, 4) of radius 1/2: an isola with folds at a = 1/2 and 3/2."""
    return AlgebraicProblem(lambda u, p: ((u.x - p.a) * ((u.x - 4) ** 2 + (p.a - 1) ** 2 - 0.25),), ["x"], {"a": 0.0})


@pytest.mark.sample(1)
@pytest.mark.parametrize("values", [[1.0], [0.6, 1.2], [0.0, 0.7, 1.0, 1.4, 2.0]])
def test_an_isola_is_found_and_closed(values):
    found = diagram(solve(line_and_circle(), [0.0]), free=["a"], limits={"a": (0, 2)}, search=Search(values))
    _, _, isola = found.branches  # the line both ways, and the circle once
    assert isola.stop.reason == contin.Reason.CLOSED
    assert sorted(point["a"] for point in isola.labelled("LP")) == pytest.approx([0.5, 1.5], abs=1e-9)
    assert [tried.value for tried in found.searches] == values
    assert sum(len(tried.found) for tried in found.searches) == 1
    for tried in found.searches:
        there = at(found, "a", tried.value, "x")
        assert len(there) == 1 + 2 * (0.5 < tried.value < 1.5)
        attempts = tried.known_again + tried.lost + len(tried.found)
        assert attempts == tried.guesses.total() + len(tried.found)


@pytest.mark.full
def test_the_isola_of_a_reactor():
    """Cubic autocatalysis with decay (Gray and Scott 1983): k^2 t^2 + (2 k - 1/4) t + 1 = 0 at its folds; washout is apart."""
    k = 0.05
    reactor = AlgebraicProblem(
        lambda u, p: ((1 - u.a) / p.time - u.a * u.b**2, u.a * u.b**2 - u.b / p.time - p.k * u.b),
        ["a", "b"], {"time": 1.0, "k": k},
    )  # fmt: skip
    search = Search([10.0, 30.0])
    washout = solve(reactor, [1.0, 0.0])
    found = diagram(washout, free=["time"], limits={"time": (1, 100)}, depth=0, max_step=1.0, search=search)
    folds = sorted(point["time"] for branch in found.branches for point in branch.labelled("LP"))
    assert folds == pytest.approx(np.sort(np.roots([k**2, 2 * k - 0.25, 1])), rel=1e-8)
    assert [branch.stop.reason for branch in found.branches] == ["limit", "limit", "closed"]


def cubic():
    """a x - x^3 + e: the pitchfork with an imperfection; its other branch has a fold at a = 3 (e / 2)^(2/3)."""
    return AlgebraicProblem(lambda u, p: (p.a * u.x - u.x**3 + p.e,), ["x"], {"a": -1.0, "e": 0.1})


@pytest.mark.full  # each imperfection, each seed
@pytest.mark.parametrize("e, seed", [((0.3, 0.1, 1e-3)[(seed + k) % 3], seed) for seed in range(3) for k in range(3)])
def test_the_other_branch_of_an_imperfect_pitchfork(e, seed):
    values = [-0.5, 0.0, 1.0, 1.7]
    start = solve(cubic(), [0.0], {"e": e})
    found = diagram(start, free=["a"], limits={"a": (-1, 2)}, search=Search(values, seed=seed))
    (fold,) = (point for branch in found.branches for point in branch.labelled("LP"))
    assert fold["a"] == pytest.approx(3 * (e / 2) ** (2 / 3), rel=1e-8)
    for value in values:
        roots = np.roots([-1, 0, value, e])
        assert at(found, "a", value, "x") == pytest.approx(np.sort(roots[np.abs(roots.imag) < 1e-9].real), abs=1e-8)


@pytest.mark.full
def test_the_same_seed_finds_the_same():
    start = solve(cubic(), [0.0])
    found, again = (diagram(start, free=["a"], limits={"a": (-1, 2)}, search=Search([0.0, 1.7], seed=1)) for _ in range(2))
    assert [each.guesses for each in again.searches] == [each.guesses for each in found.searches]
    assert len(again.branches) == len(found.branches) > 2


@pytest.mark.full
def test_no_solution_twice():
    """Nine roots on nine lines, of which the start reaches one; each line is followed once, both ways."""
    lines = AlgebraicProblem(lambda u, p: (math.prod(u.x - 0.1 * p.a - k for k in range(9)),), ["x"], {"a": 0.0})
    found = diagram(solve(lines, [0.0]), free=["a"], limits={"a": (-1, 1)}, search=Search([-0.5, 0.5], sizes=[1.0, 3.0]))
    assert at(found, "a", 0.5, "x") == pytest.approx(0.05 + np.arange(9), abs=1e-8)
    assert sum(len(tried.found) for tried in found.searches) == 8
    assert len(found.branches) == 2 * 9


@pytest.mark.full
def test_a_solution_that_belongs_to_a_known_branch_is_connected_with_it():
    """Branches beyond the depth: a search finds one, and the diagram knows where it meets the others."""
    fork = AlgebraicProblem(lambda u, p: (u.x * (p.a - u.x**2),), ["x"], {"a": 0.0})
    start = solve(fork, [0.0], {"a": -1.0})
    for symmetries, stop in ((), "limit"), ([lambda t, u: -u], "known branch"):
        found = diagram(start, free=["a"], limits={"a": (-1, 1)}, depth=0, symmetries=symmetries, search=Search([0.5]))
        (junction,) = found.junctions
        assert len(junction.also) >= 1
        (tried,) = found.searches
        assert len(tried.found) == 1  # the other one lies on the branch of the first, or is its image
        assert at(found, "a", 0.5, "x") == pytest.approx([-math.sqrt(0.5), 0, math.sqrt(0.5)], abs=1e-9)
        assert [branch.stop.reason for branch in found.branches] == ["limit", "limit", "limit", stop]


# --- boundary value problems -----------------------------------------------------------------------------------------


@functools.cache
def shot(lam, load, most=12.0):
    """Slopes at t = 0 and means of all solutions of u'' + lam sin u = load, u(0) = u(1) = 0, with slopes up to ``most``."""

    def ends(slope, tolerance=1e-11):
        def rhs(t, y):
            return y[1], load - lam * math.sin(y[0]), y[0]

        return solve_ivp(rhs, (0, 1), [0, slope, 0], method="DOP853", rtol=tolerance, atol=tolerance / 10).y[:, -1]

    slopes = np.linspace(-most, most, 241)
    values = [ends(slope, 1e-6)[0] for slope in slopes]  # signs
    brackets = [(a, b) for a, b, x, y in zip(slopes, slopes[1:], values, values[1:]) if x * y < 0]
    roots = [brentq(lambda slope: ends(slope)[0], *bracket, xtol=1e-12) for bracket in brackets]
    return roots, sorted(ends(root)[2] for root in roots)


@pytest.mark.full
def test_a_disconnected_branch_of_a_boundary_value_problem():
    """A loaded beam: the branch from lam = 0 never meets the other one; shooting finds as many solutions."""
    beam = BoundaryValueProblem(
        lambda t, u, p: (u.v, p.load - p.lam * math.sin(u.u)), lambda a, b, p: (a.u, b.u), ["u", "v"],
        {"lam": 1.0, "load": 0.3}, functionals={"mean": lambda t, u, p: u.u},
    )  # fmt: skip
    found = diagram(solve(beam, [0, 0]), free=["lam"], limits={"lam": (0.5, 20)}, search=Search([5.0, 15.0]))
    assert len(found.branches) == 4 and not found.junctions
    for lam in (5.0, 15.0):
        points = [point for branch in found.branches for point in branch if abs(point["lam"] - lam) < 1e-9]
        slopes = sorted({round(float(point.system.states(point.x)[0, 1]), 7) for point in points})
        assert slopes == pytest.approx(shot(lam, 0.3)[0], abs=1e-6)


@pytest.mark.full
def test_the_upper_solution_that_the_limits_part_from_the_lower_one():
    """Bratu's problem on two segments; u is 2 log cosh(theta / 4) in the middle, with theta = sqrt(2 lam) cosh(theta / 4)."""
    walls = [contin.Segment(lambda s, u, p: (u.v, -p.lam * math.exp(u.u) / 4), ["u", "v"])] * 2
    problem = contin.SegmentedProblem(
        walls, lambda a, b, p: (a[0].u, b[0].u - a[1].u, b[0].v - a[1].v, b[1].u), {"lam": 1.0}
    )  # fmt: skip
    for seed in (0, 1):
        search = Search([1.0], seed=seed)
        found = diagram(solve(problem, [0, 0, 0, 0]), free=["lam"], limits={"lam": (0.5, 2)}, search=search)
        points = [point for branch in found.branches for point in branch if abs(point["lam"] - 1) < 1e-9]
        middles = sorted({round(float(point.segment(0)(1.0)[0, 0]), 7) for point in points})
        thetas = [brentq(lambda x: x - math.sqrt(2) * math.cosh(x / 4), *ends) for ends in ((0, 4), (4, 20))]
        assert middles == pytest.approx([2 * math.log(math.cosh(theta / 4)) for theta in thetas], abs=1e-6)


def carrier():
    """Carrier's equation: eight solutions at eps = 1/5 (3000 shots: tests/test_gallery.py counts as many)."""
    return BoundaryValueProblem(
        lambda t, u, p: (u.v, (1 - u.u**2 - 2 * (1 - t**2) * u.u) / p.eps**2),
        lambda a, b, p: (a.u, b.u), ["u", "v"], {"eps": 0.2}, domain=(-1, 1), functionals={"mean": lambda t, u, p: u.u},
    )  # fmt: skip


@pytest.mark.full
def test_all_solutions_of_carriers_equation():
    """Also modulo the reflection of t, of which the means are invariants: six, two of which are those of a pair."""
    start = solve(carrier(), [0, 0])
    options = {"free": ["eps"], "depth": 1, "limits": {"eps": (0.19, 0.6)}, "search": Search([0.2])}
    everything = diagram(start, **options)
    reflected = diagram(start, **options, symmetries=[lambda t, u: u[::-1] * [1, -1]])
    points = [point for branch in everything.branches for point in branch if abs(point["eps"] - 0.2) < 1e-9]
    slopes = {tuple(np.round(point.system.states(point.x)[[0, -1], 1], 5)) for point in points}
    assert len(slopes) == 8 and {(-b, -a) for a, b in slopes} == slopes
    assert len(at(everything, "eps", 0.2, "mean")) == 6
    assert at(reflected, "eps", 0.2, "mean") == pytest.approx(at(everything, "eps", 0.2, "mean"), abs=1e-8)
    assert len(reflected.branches) < len(everything.branches)


@pytest.mark.full
def test_states_of_an_energy():
    """The loaded beam by its energy: multipliers are unknowns, too; the state of the other side is a minimum as well."""
    beam = contin.VariationalProblem(
        lambda t, x, w, p: w.u**2 / 2 + p.lam * math.cos(x.u) + p.load * x.u, ["u"], {"lam": 5.0, "load": 0.3},
        ends=lambda a, b, p: (a.u, b.u), functionals={"mean": lambda t, x, w, p: x.u},
    )  # fmt: skip
    found = diagram(solve(beam, [0]), free=["lam"], limits={"lam": (0.5, 20)}, search=Search([15.0]))
    points = [point for branch in found.branches for point in branch if abs(point["lam"] - 15) < 1e-9]
    assert at(found, "lam", 15.0, "mean") == pytest.approx(shot(15.0, 0.3)[1], abs=1e-7)
    assert sorted({point.index for point in points}) == [0, 1]


@pytest.mark.full
def test_the_order_of_values_changes_nothing():
    """What is found at one value is a guess at those beside it, before and after it."""
    told = [repr(diagram(solve(line_and_circle(), [0.0]), free=["a"], limits={"a": (0, 2)}, search=Search(values, draws=1)))
            for values in ([0.8, 1.0], [1.0, 0.8, 1.0])]  # fmt: skip
    assert told[0] == told[1] and "search at a = 0.8: 1 known, 1 more found (branch 2)" in told[0]


# --- the account, and wrong input ------------------------------------------------------------------------------------


def test_what_was_tried_is_said():
    found = diagram(solve(line_and_circle(), [0.0]), free=["a"], limits={"a": (0, 2)}, search=Search([1.0], draws=1))
    told = repr(found).splitlines()
    assert told[-2].startswith("  search at a = 1: 1 known, 1 more found (branch 2) from 9 guesses (3 reversed, 6 random); ")
    assert told[-1] == "  What no guess leads to is not found: there may be further solutions."
    assert "1 more found (branch 2)" in found._repr_html_()
    assert "search" not in repr(diagram(solve(line_and_circle(), [0.0]), free=["a"], limits={"a": (0, 2)}))


def test_where_nothing_is_known_at_a_value_the_nearest_states_lead():
    """The branch ends at a = 1: at a = 2 there is another one, and nothing that is known."""
    apart = AlgebraicProblem(lambda u, p: ((u.x**2 + p.a - 1) * (p.a - 1.5 - u.x**2),), ["x"], {"a": 0.0})
    found = diagram(solve(apart, [1.0]), free=["a"], limits={"a": (0, 3)}, search=Search([2.0]))
    assert found.searches[0].known == 0 and len(found.searches[0].found) == 1
    assert at(found, "a", 2.0, "x") == pytest.approx([-math.sqrt(0.5), math.sqrt(0.5)], abs=1e-9)


def test_solutions_outside_the_limits_are_counted_and_not_followed():
    found = diagram(solve(line_and_circle(), [0.0]), free=["a"], limits={"a": (0, 2), "x": (-1, 3)}, search=Search([1.0]))
    assert len(found.branches) == 2 and found.searches[0].outside == len(found.searches[0].found) == 2
    assert "2 of them outside the limits" in repr(found)


def test_guesses_of_the_user_and_the_largest_number():
    waves = AlgebraicProblem(lambda u, p: (math.sin(u.x) - p.a,), ["x"], {"a": 0.0}, dynamics=False)
    start = solve(waves, [0.0])
    search = Search([0.0], sizes=[], guesses=[[50.0]], most=3)
    found = diagram(start, free=["a"], limits={"a": (-0.5, 0.5)}, search=search)
    assert len(found.searches[0].found) == 3 and "ended at most = 3" in repr(found)


def test_maps_lead_to_what_a_broken_symmetry_has_moved():
    """x -> 6 - x takes the one root near the other; without it and without random guesses neither is found."""
    apart = AlgebraicProblem(
        lambda u, p: ((u.x - 1) * ((u.x - 5.1) ** 2 + 1e-4 * p.a - 1e-4) / (1 + u.x**4),), ["x"], {"a": 0.5}
    )  # fmt: skip
    start = solve(apart, [1.0])
    options = {"free": ["a"], "limits": {"a": (0, 0.9)}}
    found = diagram(start, **options, search=Search([0.5], draws=0, maps=[lambda t, u: 6.1 - u]))
    assert found.searches[0].guesses["mapped"] >= 1 and len(at(found, "a", 0.5, "x")) == 3


@pytest.mark.parametrize("search, said", [
    (lambda: Search([3.0]), "search: value 3 must lie within the limits of a, 0 to 2"),
    (lambda: Search(["1"]), "values: '1' must be a finite number"),
    (lambda: Search([1.0], sizes=[-1.0]), "sizes: -1.0 must be a number between 0 and inf"),
    (lambda: Search([1.0], draws=1.5), "draws: 1.5 must be a whole number"),
    (lambda: Search([1.0], maps=[3]), "maps: 3 must be a function"),
])  # fmt: skip
def test_wrong_searches(search, said):
    with pytest.raises(ProblemError) as told:
        diagram(solve(line_and_circle(), [0.0]), free=["a"], limits={"a": (0, 2)}, search=search())
    assert said in str(told.value)


@pytest.mark.full
def test_cycles_are_not_searched():
    circles = contin.CycleProblem(
        lambda u, p: (p.mu * u.x - u.y - u.x * (u.x**2 + u.y**2), u.x + p.mu * u.y - u.y * (u.x**2 + u.y**2)),
        ["x", "y"], {"mu": 1.0},
    )  # fmt: skip
    orbit = solve(circles, lambda t: (math.cos(2 * math.pi * t), math.sin(2 * math.pi * t)), {"period": 6.0}, intervals=4)
    with pytest.raises(ProblemError, match="search: not of cycles"):
        diagram(orbit, free=["mu"], limits={"mu": (0.5, 2)}, search=Search([1.0]))
