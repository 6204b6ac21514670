"""Corners of branches: closed forms, and random piecewise-linear systems whose branches are enumerated region by region."""

import itertools
import math
import re

import numpy as np
import pytest
from scipy.optimize import brentq, minimize_scalar, root
from scipy.special import ellipe, ellipeinc, ellipk, ellipkinc

import contin
from contin import AlgebraicProblem, BoundaryValueProblem, Segment, SegmentedProblem, Settings, solve, trace
from contin.lowlevel import Continuation
from contin.lowlevel import root as inner_root


def corners(branch):
    return [(round(point[branch.points[0].system.free[0]], 9) + 0.0, point.details.kind) for point in branch.labelled("BC")]


def followed(residual, states, at, guess, low, high, **more):
    problem = AlgebraicProblem(residual, states, {"a": at}, dynamics=False)
    return trace(solve(problem, guess), free=["a"], limits={"a": (low, high)}, **more)


# --- closed forms ------------------------------------------------------------------------------------------------------


def test_a_branch_turns_or_goes_on_at_a_corner():
    """|x| = a turns at 0; x + max(0, x - 1) = a goes on at 1, with half the slope."""
    branch = followed(lambda u, p: (abs(u.x) - p.a,), ["x"], 1.0, [1.0], -1, 2, direction=-1)
    assert corners(branch) == [(0, "fold")] and branch.points[-1].x == pytest.approx([-2, 2])
    (corner,) = branch.labelled("BC")
    assert corner.name.startswith("abs(u.x), line ") and abs(corner.x[0]) < corner.errors["a"] < 1e-13
    branch = followed(lambda u, p: (u.x + max(0, u.x - 1) - p.a,), ["x"], 0.5, [0.5], -1, 4)
    assert corners(branch) == [(1, "goes on")] and branch.points[-1].x == pytest.approx([2.5, 4])
    assert branch.labelled("BC")[0].details.ways[0] == pytest.approx(np.array([1, 2]) / np.sqrt(5))


# A ring of nine buses, with generators at 1, 2 and 3 and loads at 5, 6 and 8.
LINES = {
    (1, 4): 0.06j, (2, 7): 0.06j, (3, 9): 0.06j, (4, 5): 0.01 + 0.09j, (5, 7): 0.03 + 0.16j, (7, 8): 0.01 + 0.07j,
    (8, 9): 0.01 + 0.1j, (9, 6): 0.04 + 0.17j, (6, 4): 0.02 + 0.09j,
}  # fmt: skip
ADMITTANCE = np.zeros((9, 9), complex)
for (one, two), impedance in LINES.items():
    ADMITTANCE[[one - 1, two - 1], [one - 1, two - 1]] += 1 / impedance + 0.1j * (impedance.real > 0)
    ADMITTANCE[[one - 1, two - 1], [two - 1, one - 1]] -= 1 / impedance
SPENT = np.array([0, -1.6, -0.9, 0, 1.2 + 0.5j, 0.9 + 0.3j, 0, 1.0 + 0.4j, 0])


def powers(angles, volts, more):
    """Return what each bus gives to the grid and its load, at loads 1 + more times those above."""
    E = np.concatenate([[1.0], volts]) * np.exp(1j * np.concatenate([[0.0], angles]))
    return E * np.conj(ADMITTANCE @ E) + (1 + more) * SPENT


def clipped(u, p, most):
    S = powers(u[:8], u[8:], p.a)
    return np.concatenate([S.real[1:], np.clip(S.imag[1:3] + 1 - u[8:10], [-1, -1], most) - S.imag[1:3], S.imag[3:]])


def decided(u, p, most):
    def reactive(voltage, power, limit):
        if 1 - voltage > limit - power:
            return power - limit
        return voltage - 1

    S = powers(u[:8], u[8:], p.a)
    return [*S.real[1:], *(reactive(u[8 + k], S.imag[1 + k], most[k]) for k in (0, 1)), *S.imag[3:]]


def rectangular(u, p, most):
    re, im = np.concatenate([[1.0], u[:8]]), np.concatenate([[0.0], u[8:]])
    e, f = ADMITTANCE.real @ re - ADMITTANCE.imag @ im, ADMITTANCE.real @ im + ADMITTANCE.imag @ re
    active, q = re * e + im * f + (1 + p.a) * SPENT.real, im * e - re * f + (1 + p.a) * SPENT.imag
    return [*active[1:], *(min(1 - re[k] ** 2 - im[k] ** 2, most[k - 1] - q[k]) for k in (1, 2)), *q[3:]]


def by_active_sets(most):
    """Return corners and the turning point: for each set of generators at their limits, smooth equations by SciPy."""

    def found(at_limit, k, voltage=1.0):
        def rows(z):
            S = powers(z[:8], z[8:16], z[16])
            limits = [S.imag[1 + j] - most[j] if j in at_limit else z[8 + j] - 1 for j in (0, 1)]
            return [*S.real[1:], *limits, *S.imag[3:], z[8 + k] - voltage]

        return root(rows, [0.0] * 8 + [1.0] * 8 + [0.3], tol=1e-14).x[16]

    first = min((0, 1), key=lambda k: found({k}, k))
    last, every = 1 - first, {0, 1}
    second = found(every, last)
    if found(every, last, 1 - 1e-3) < second:
        return [(found({first}, first), "goes on"), (second, "fold")]
    top = minimize_scalar(lambda v: -found(every, last, v), bounds=(0.8, 1.0), method="bounded", options={"xatol": 1e-7})
    return [(found({first}, first), "goes on"), (second, "goes on"), (-top.fun, "LP")]


@pytest.mark.parametrize(("residual", "most"), [(clipped, (1.0, 1.0)), (decided, (1.4, 0.6)), (rectangular, (0.9, 0.7))])
def test_a_grid_whose_generators_reach_their_limits(residual, most):
    names = [f"{kind}{bus}" for kind in "aV" for bus in range(2, 10)]
    flat = [1.0] * 8 + [0.0] * 8 if residual is rectangular else [0.0] * 8 + [1.0] * 8
    branch = followed(lambda u, p: residual(u, p, most), names, 0.0, flat, 0, 5)
    met = [(point["a"], getattr(point.details, "kind", "LP")) for point in branch if point.label in ("BC", "LP")]
    expected = by_active_sets(most)
    assert [kind for _, kind in met] == [kind for _, kind in expected] and branch[-1]["a"] == 0
    assert np.abs(np.subtract([a for a, _ in met], [a for a, _ in expected])).max() < 1e-10
    assert all(re.search(r", line \d+ of test_corners.py, equation (9|10) ", point.name) for point in branch.labelled("BC"))


def test_a_run_that_is_resumed_behind_a_corner_does_not_come_to_it_again():
    start = solve(AlgebraicProblem(lambda u, p: (abs(u.x) - p.a,), ["x"], {"a": 1.0}, dynamics=False), [1.0])
    (system, x), settings = start.system.with_free(["a"], start.x), Settings(direction=-1, limits={"a": (-1, 2)})
    run = Continuation(system, x, settings)
    points = list(itertools.takewhile(lambda point: point.label != "BC", run))
    rest = list(Continuation(system, x, settings, state=run.state, start=run.start))
    assert points[-1]["x"] > 0 > rest[0]["x"] and [point.label for point in rest if point.label] == ["EP"]


def test_a_branch_ends_where_the_equations_jump_or_have_no_slope():
    branch = followed(lambda u, p: (u.x + (1.0 if u.x > 1 else 0.0) - p.a,), ["x"], 0.5, [0.5], -1, 4)
    assert corners(branch) == [(1, "end, the equations jump")] and "the equations jump" in str(branch.stop)
    assert branch.stop.event == branch[-1].name
    branch = followed(lambda u, p: (u.x - p.a + max(u.x, 0) ** 0.5,), ["x"], -1.0, [-1.0], -1, 1)
    assert corners(branch) == [(0, "end, derivatives are not finite")]


def test_smooth_conditions_and_conditions_that_stay_zero_are_passed_in_silence():
    """A guarded quotient, max(0, x)^2, and v |v| at rest, where the Hopf point is found."""

    def sinc(x):
        return np.sin(x) / x if abs(x) > 1e-3 else 1 - x**2 / 6 + x**4 / 120

    def rate(x):  # its slope right beside the guard has an error of a hundredth, as terms cancel
        return x / (1 - np.exp(-x / 10)) if abs(x) > 1e-6 else 10 + x / 2

    smooth = [lambda u, p: (sinc(u.x) * u.x - p.a,), lambda u, p: (u.x + max(0, u.x) ** 2 - p.a,)]
    for residual in (*smooth, lambda u, p: (rate(u.x) - 10 + u.x / 2 - p.a,)):
        branch = followed(residual, ["x"], -0.5, [-0.5], -0.6, 0.6)
        assert not branch.labelled("BC") and branch.points[-1]["a"] == 0.6 and not branch.notes
    spring = AlgebraicProblem(lambda u, p: (u.v, p.m * u.v - abs(u.v) * u.v - u.x), ["x", "v"], {"m": -1.0})
    branch = trace(solve(spring, [0.0, 0.0]), free=["m"], limits={"m": (-1, 1)})
    assert [point.label for point in branch if point.label] == ["EP", "HB", "EP"]


def test_where_sides_change_their_branches_several_ways_leave():
    """a x = |x| x: x = 0, and |x| = a for a > 0; from x = a three ways lead on, and each can be taken."""
    branch = followed(lambda u, p: (p.a * u.x - abs(u.x) * u.x,), ["x"], 0.8, [0.8], -1, 1, direction=-1)
    (corner,) = branch.labelled("BC")
    assert corner.details.kind == "several" and len(corner.details.ways) == 3
    ends = [trace(corner, branch=number, limits={"a": (-1, 1)}).points[-1].x.round(12) + 0.0 for number in range(3)]
    assert sorted(map(tuple, ends)) == [(-1, 1), (0, -1), (0, 1)]
    assert len(contin.diagram(branch[0], limits={"a": (-1, 1)}).branches) >= 2


def test_stability_may_change_by_a_jump(tmp_path):
    """The damping has the sign of x: a pair of eigenvalues goes to the other side with no Hopf point. It is kept in a file."""
    field = AlgebraicProblem(lambda u, p: (u.v, p.a - u.x - np.where(u.x > 0, -1.0, 1.0) * u.v), ["x", "v"], {"a": -1.0})
    branch = trace(solve(field, [-1.0, 0.0]), free=["a"], limits={"a": (-1, 1)})
    assert corners(branch) == [(0, "goes on")] and branch.labelled("BC")[0].details.unstable == (0, 2)
    contin.save(branch, tmp_path / "branch.npz")
    kept = contin.load(field, tmp_path / "branch.npz").labelled("BC")[0]
    assert kept.details.kind == "goes on" and kept.details.unstable == (0, 2) and len(kept.details.ways) == 1


def test_a_diamond_closes():
    branch = followed(lambda u, p: (abs(u.x) + abs(p.a) - 1,), ["x"], 0.5, [0.5], -2, 2)
    assert corners(branch) == [(1, "fold"), (0, "goes on"), (-1, "fold"), (0, "goes on")]
    assert branch.stop.reason == "closed"


def test_many_equal_machines_reach_their_limits_together():
    """x_k = min(a, 1) for twelve k, and y their sum: all change at a = 1. A limit of the run may lie there."""
    names = [f"x{k}" for k in range(12)]
    branch = followed(
        lambda u, p: (*(min(p.a, 1.0) - x for x in u[:12]), sum(u[:12]) - u.y), [*names, "y"], 0.5, [0.5] * 13, 0, 2
    )
    assert branch.labelled("BC")[0]["a"] == 1 and branch[-1]["y"] == 12 and branch[-1]["a"] == 2
    branch = followed(lambda u, p: (max(u.x, 1.0) - p.a,), ["x"], 2.0, [2.0], 1, 3, direction=-1)
    assert branch[-1]["a"] == 1


def test_equal_contacts_that_differ():
    """x + 8 springs that touch at x = 1 by numbers of their own, a (1 + k) - a x: eight conditions are zero at one point."""

    def force(u, p):
        return (u.x + sum(max(0, (1 + k) * (u.x - 1)) for k in range(8)) - p.a,)

    branch = followed(force, ["x"], 0.5, [0.5], 0, 10)
    assert corners(branch) == [(1, "goes on")] and branch[-1]["x"] == pytest.approx(1 + 9 / 37, abs=1e-12)


@pytest.mark.parametrize("depth", [1e-1, 1e-3, 1e-5, -1e-3])
def test_numbers_that_pass_zero_twice_in_a_step(depth):
    """x = a^2 - depth: y = |x| has two corners at a = +- sqrt(depth), and none where x stays positive."""
    branch = followed(lambda u, p: (u.x - p.a**2 + depth, u.y - abs(u.x)), ["x", "y"], -1.0, [1.0, 1.0], -1, 1)
    root = round(max(depth, 0) ** 0.5, 9)
    assert corners(branch) == ([(-root, "goes on"), (root, "goes on")] if depth > 0 else [])


def test_border_collisions_of_maps():
    """A skew tent: its fixed point passes the tip, where the multiplier goes from 1/2 to -3/2. Of x -> a - x^2 + .3 |x - .2|
    a cycle of two meets .2 where f(f(.2)) = .2, f(.2) = a - .04: at a = 1.14, (.3 a - .072) - (a - .04)^2 + a = .2."""
    tent = contin.MapProblem(lambda u, p: (p.a + (0.5 * u.x if u.x < 0 else -1.5 * u.x),), ["x"], {"a": -1.0})
    branch = trace(solve(tent, [-2.0]), free=["a"], limits={"a": (-1, 1)})
    assert corners(branch) == [(0, "goes on")] and branch.labelled("BC")[0].details.unstable == (0, 1)
    assert branch[-1]["x"] == pytest.approx(0.4) and branch[-1]["a"] == 1
    bent = contin.MapProblem(lambda u, p: (p.a - u.x**2 + 0.3 * abs(u.x - 0.2),), ["x"], {"a": 1.1})
    branch = trace(solve(bent, [0.25, 1.05], {"rounds": 2.0}), free=["a"], limits={"a": (0.5, 1.2)})
    (corner,) = branch.labelled("BC")
    assert (
        abs(corner["a"] - 1.14) <= corner.errors["a"] + 1e-15 and corner.details.kind == "fold" and "at point 1" in corner.name
    )
    assert abs(corner.x[0] - 0.2) < 1e-12 and [point.label for point in branch if point.label][-2:] == ["LP", "EP"]


@pytest.mark.parametrize("guess", [0.0, 3.0])
def test_a_solution_beyond_a_jump_is_not_made_up(guess):
    """x + 1 for x > 1 jumps over 1.5: Newton's method goes to and fro; from either side the way ends at the jump."""
    problem = AlgebraicProblem(lambda u, p: (u.x + (1.0 if u.x > 1 else 0.0) - p.a,), ["x"], {"a": 1.5}, dynamics=False)
    with pytest.raises(contin.ProblemError, match="no solution lies on the way from it: u.x > 1.*the equations jump"):
        solve(problem, [guess])


# --- tables ------------------------------------------------------------------------------------------------------------


def tabled(knots, values):
    """y = f(x) / 2 and x + y = a, with f of a table: a(x) is known, and turns at the knots where its slope changes its sign."""
    names, start = ["x", "y"], {"a": float(knots[0]) - 1}
    return AlgebraicProblem(
        lambda u, p: (u.x + u.y - p.a, u.y - np.interp(u.x, knots, values) / 2), names, start, dynamics=False,
    )  # fmt: skip


@pytest.mark.parametrize(["count", "size"], [(12, 1.0), (60, 0.3)])
def test_knots_of_tables_are_passed_and_labelled_where_they_are_folds(count, size):
    random = np.random.default_rng(count)
    knots = np.linspace(-2, 2, count)
    values = size * np.cumsum(random.normal(size=count))
    problem, low = tabled(knots, values), knots[0] - 1
    loads = knots + values / 2
    steps = np.diff(np.concatenate([[loads[0] - 1], loads, [loads[-1] + 1]]))
    turns = np.flatnonzero(steps[1:] * steps[:-1] < 0)
    first = solve(problem, [low - values[0] / 2, values[0] / 2], {"a": float(loads[0]) - 0.5})
    options = {"free": ["a"], "limits": {"a": (loads.min() - 2, loads.max() + 1)}}
    branch = trace(first, **options)
    met = branch.labelled("BC")
    assert len(turns) > 2 and [point.details.kind for point in met] == ["fold"] * len(turns)
    np.testing.assert_allclose([point["x"] for point in met], knots[turns], atol=1e-9)
    np.testing.assert_allclose([point["a"] for point in met], loads[turns], atol=1e-9)
    assert branch.stop.reason == "limit" and not branch.notes
    every = trace(first, corners=True, **options)
    np.testing.assert_allclose([point["x"] for point in every.labelled("BC")], knots, atol=1e-9)


# --- conditions at ends ------------------------------------------------------------------------------------------------


def tip_load(depth):
    """Return the load across the tip of a clamped elastica of length 1 that moves it by a depth (Bisshopp & Drucker 1945)."""

    def depth_at(m):
        begin = np.arcsin(1 / np.sqrt(2 * m))
        return 1 - 2 * (ellipe(m) - ellipeinc(begin, m)) / (ellipk(m) - ellipkinc(begin, m)) - depth

    m = brentq(depth_at, 0.5 + 1e-9, 0.9, xtol=1e-15)
    return (ellipk(m) - ellipkinc(np.arcsin(1 / np.sqrt(2 * m)), m)) ** 2


def cantilever(ends, length=1.0, load=1.0, **at):
    """A clamped elastica of this length, in units of load; the tip's load P less the stop's force R, in these units."""

    def rates(t, u, p):
        return length * math.sin(u.th), u.m, (p.P - p.R) / load * math.cos(u.th)

    return BoundaryValueProblem(rates, ends, ["y", "th", "m"], {"P": 0.1 * load, "R": 0.0, **at})


@pytest.mark.parametrize(["length", "load"], [(1, 1), (1e3, 1), (1e-3, 1), (1, 1e3), (1, 1e-3)])
def test_a_tip_meets_a_stop(length, load):
    """At the load of the free tip; behind it the stop carries what is more, and at twice the depth below it none."""
    problem = cantilever(lambda a, b, p: (a.y, a.th, b.m, min(b.y + 0.2 * length, p.R)), length, load)
    branch = trace(solve(problem, [0.0] * 3, free=["R"]), free=["P", "R"], limits={"P": (0, 5 * load)})
    (corner,) = branch.labelled("BC")
    wanted = tip_load(0.2)
    assert abs(corner["P"] - load * wanted) <= corner.errors["P"] + 1e-13 * load
    assert corner.details.kind == "goes on" and corner.name.startswith("min(b.y + 0.2 * length, p.R), line ")
    assert branch[-1]["P"] == 5 * load and branch[-1]["R"] == pytest.approx(load * (5 - wanted), rel=1e-11) and not branch.notes


@pytest.mark.parametrize("sense", [1, -1])
def test_walls_on_both_sides(sense):
    problem = cantilever(lambda a, b, p: (a.y, a.th, b.m, max(min(b.y + 0.2, p.R), b.y - 0.2)), P=0.0)
    first = solve(problem, [0.0] * 3, free=["R"])
    branch = trace(first, free=["P", "R"], limits={"P": (-3, 3)}, direction=sense)
    assert corners(branch) == [(round(sense * tip_load(0.2), 9), "goes on")] and branch[-1]["P"] == 3 * sense


def test_two_tips_meet_their_stops_at_once():
    def rates(t, u, p):
        return math.sin(u.a), u.m, (p.P - p.R) * math.cos(u.a), math.sin(u.b), u.n, (p.P - p.S) * math.cos(u.b)

    def ends(a, b, p):
        return a.y, a.a, b.m, min(b.y + 0.2, p.R), a.z, a.b, b.n, min(b.z + 0.2, p.S)

    problem = BoundaryValueProblem(rates, ends, ["y", "a", "m", "z", "b", "n"], {"P": 0.1, "R": 0.0, "S": 0.0})
    branch = trace(solve(problem, [0.0] * 6, free=["R", "S"]), free=["P", "R", "S"], limits={"P": (0, 5)})
    (corner,) = branch.labelled("BC")
    assert corner["P"] == pytest.approx(tip_load(0.2)) and "p.R" in corner.name and "p.S" in corner.name
    assert branch[-1]["R"] == pytest.approx(branch[-1]["S"]) == pytest.approx(5 - tip_load(0.2))


def test_a_spring_at_a_joint_that_only_pushes():
    """It begins to push where the joint of the rod without it is as low."""

    def ends(a, b, p):
        force = p.k * max(0, -0.05 - b[0].y)
        joint = b[0].y - a[1].y, b[0].th - a[1].th, b[0].m - a[1].m, b[0].q - a[1].q + force
        return a[0].y, a[0].th, b[1].m, b[1].q - p.P, *joint

    half = Segment(lambda s, u, p: (math.sin(u.th), u.m, u.q * math.cos(u.th), 0.0), ["y", "th", "m", "q"], length=0.5)
    problem = SegmentedProblem([half, half], ends, {"P": 0.1, "k": 50.0})
    branch = trace(solve(problem, [0.0] * 8), free=["P"], limits={"P": (0, 5)})
    (corner,) = branch.labelled("BC")
    free = solve(problem, [0.0] * 8, {"P": corner["P"], "k": 0.0}).segment(0)
    assert free["y"][-1] == pytest.approx(-0.05, abs=1e-11) and branch[-1]["P"] == 5


def test_conditions_on_parameters_alone_are_corners_of_solutions_and_of_cycles():
    """The load is |P|: the elastica comes back to where it was. The damping of van der Pol's oscillator begins to grow."""
    problem = BoundaryValueProblem(
        lambda t, u, p: (math.sin(u.th), u.m, abs(p.P) * math.cos(u.th)),
        lambda a, b, p: (a.y, a.th, b.m), ["y", "th", "m"], {"P": 1.0},
    )  # fmt: skip
    branch = trace(solve(problem, [0.0] * 3), free=["P"], limits={"P": (-1, 2)}, direction=-1)
    assert corners(branch) == [(0, "goes on")] and branch[-1].x[-4] == pytest.approx(branch[0].x[-4], abs=1e-11)
    field = contin.CycleProblem(
        lambda u, p: (u.y, max(p.m, 0.5) * (1 - u.x**2) * u.y - u.x), ["x", "y"], {"m": 0.2},
    )  # fmt: skip
    round_ = solve(field, lambda t: (2 * math.cos(2 * math.pi * t), -2 * math.sin(2 * math.pi * t)))
    branch = trace(round_, free=["m"], limits={"m": (0.1, 1)})
    assert corners(branch) == [(0.5, "goes on")] and branch[-1]["m"] == 1
    assert branch[-1]["period"] == pytest.approx(6.6632868593, abs=1e-9)  # mu = 1 (Andersen & Geer 1982)


# --- random piecewise-linear systems -----------------------------------------------------------------------------------

#: The parameter is followed between these ends.
LIMIT = 3.0


class Linear:
    """A z + B |C z + c| + r = 0, and with ``nested`` also the absolute values of others that contain these; z = (x, a)."""

    def __init__(self, seed, meet=0):
        random = np.random.default_rng(seed)
        self.n, first, second = int(random.integers(2, 5)), int(random.integers(max(2, meet), 4)), int(random.integers(0, 3))
        size, self.count = self.n + 1, first + second
        self.A, self.B = random.normal(size=(self.n, size)), 0.7 * random.normal(size=(self.n, self.count))
        self.C, self.c = random.normal(size=(self.count, size)), random.normal(size=self.count)
        self.D = np.zeros((self.count, self.count))  # what the second numbers contain of the first absolute values
        self.D[first:, :first] = random.normal(size=(second, first))
        z = 0.5 * random.normal(size=size)
        self.c[:meet] = -self.C[:meet] @ z  # so many conditions meet there
        self.r = -(self.A @ z + self.B @ self.sizes(z.tolist()))
        self.z, self.first = z, first

    def sizes(self, z):
        found = []
        for row, offset, of in zip(self.C, self.c, self.D):
            inside = sum(float(c) * each for c, each in zip(row, z)) + float(offset)
            found.append(abs(inside + sum(float(d) * each for d, each in zip(of, found))))
        return found

    def residual(self, u, p):
        z = [*u, p.a]
        sizes = self.sizes(z)
        return tuple(
            sum(float(a) * each for a, each in zip(self.A[i], z))
            + sum(float(b) * s for b, s in zip(self.B[i], sizes))
            + self.r[i]
            for i in range(self.n)
        )

    def pieces(self):
        """Return the segments of the branch, region by region: both ends."""
        for signs in itertools.product((1.0, -1.0), repeat=self.count):
            inverse = np.linalg.inv(np.eye(self.count) - self.D * np.array(signs))  # numbers g = C z + c + D s g
            C, c = inverse @ self.C, inverse @ self.c
            signed = self.B * np.array(signs)
            J, r = self.A + signed @ C, self.r + signed @ c
            start, way = np.linalg.lstsq(J, -r, rcond=None)[0], np.linalg.svd(J)[2][-1]
            rates, values = np.array(signs) * (C @ way), np.array(signs) * (C @ start + c)
            ends = sorted((end - start[-1]) / way[-1] for end in (-LIMIT, LIMIT))
            low = max(ends[0], *(-v / a for a, v in zip(rates, values) if a > 0), -np.inf)
            high = min(ends[1], *(-v / a for a, v in zip(rates, values) if a < 0), np.inf)
            if high - low > 1e-11:
                yield start + low * way, start + high * way


def expected(pieces, z, sense):
    """Return the corners that a walk along the segments meets from z on, which lies on one of them, and how many ways leave."""
    at, before = z, next(i for i, ends in enumerate(pieces) if distance(ends, z) < 1e-9)
    end = max(pieces[before], key=lambda each: sense * each[-1])
    found, ways = [], []
    while True:
        came, at = end - at, end
        if abs(abs(at[-1]) - LIMIT) < 1e-9 or (found and np.abs(at - found[0]).max() < 1e-9):
            return found, ways
        following = [
            (i, ends[1 - e] - at)
            for i, ends in enumerate(pieces)
            if i != before
            for e in (0, 1)
            if np.abs(ends[e] - at).max() < 1e-9
        ]
        found.append(at)
        ways.append(len(following))
        before, ahead = max(following, key=lambda each: each[1] @ came / np.linalg.norm(each[1]))
        end = at + ahead


def distance(ends, z):
    along = ends[1] - ends[0]
    part = np.clip((z - ends[0]) @ along / (along @ along), 0, 1)
    return np.abs(ends[0] + part * along - z).max()


def agree(system, at_ends=False):
    """Compare runs both ways from the middle of a segment near z with the walk along segments; ``at_ends`` of a domain."""
    pieces = list(system.pieces())
    if not pieces:
        pytest.skip("the solution is isolated")
    start, end = min(pieces, key=lambda ends: distance(ends, system.z))
    z = start + 0.37 * (end - start)
    problem = AlgebraicProblem(system.residual, [f"x{i}" for i in range(system.n)], {"a": float(z[-1])}, dynamics=False)
    if at_ends:  # states that are constant, of which some are held at one end and some at the other
        problem = BoundaryValueProblem(
            lambda t, u, p: [0.0 * x for x in u],
            lambda a, b, p: system.residual([(a, b)[i % 2][i] for i in range(system.n)], p),
            problem.states, problem.parameters, functionals={f"x{i}": lambda t, u, p, i=i: u[i] for i in range(system.n)},
        )  # fmt: skip
    first = solve(problem, z[:-1])
    assert first.x[: system.n] == pytest.approx(z[:-1], abs=1e-9)
    for sense in (1, -1):
        branch = trace(first, free=["a"], direction=sense, limits={"a": (-LIMIT, LIMIT)})
        places, ways = expected(pieces, z, sense)
        met = branch.labelled("BC")[: len(places)]
        assert [len(point.details.ways) for point in met] == ways
        names = [*(f"x{i}" for i in range(system.n)), "a"]
        assert all([point[name] for name in names] == pytest.approx(place, abs=1e-9) for point, place in zip(met, places))
        assert branch.stop.reason in ("limit", "closed", "known branch") and {point.label for point in branch} <= {
            "",
            "EP",
            "BC",
        }


@pytest.mark.sample(20)
@pytest.mark.parametrize("seed", range(200))
def test_random_systems(seed):
    agree(Linear(seed))


@pytest.mark.sample(2)
@pytest.mark.parametrize("seed", range(40))
def test_random_systems_at_ends(seed):
    agree(Linear(seed, meet=2 * (seed % 2)), at_ends=True)


@pytest.mark.sample(10)
@pytest.mark.parametrize("seed", range(100))
def test_random_systems_in_which_conditions_meet(seed):
    agree(Linear(1000 + seed, meet=2 + seed % 2))


@pytest.mark.parametrize("seed", [3, 5, 6, 44, 68, 122])
def test_solutions_between_which_outcomes_newtons_method_goes_round(seed):
    """From these guesses it does; the way on which F shrinks evenly leads through corners to a solution on a segment."""
    system = Linear(seed)
    names = [f"x{i}" for i in range(system.n)]
    problem = AlgebraicProblem(system.residual, names, {"a": float(system.z[-1])}, dynamics=False)
    found = solve(problem, system.z[:-1] + np.random.default_rng(seed).normal(size=system.n))
    place = np.append(found.x, system.z[-1])
    assert min(distance(ends, place) for ends in system.pieces()) < 1e-9


# --- diagrams, and curves in two parameters -----------------------------------------------------------------------------


def test_a_diagram_leaves_corners_from_which_several_ways_lead():
    """a x = |x| x: x = 0 on both sides of a = 0, and |x| = a on one; each half-branch once."""
    problem = AlgebraicProblem(lambda u, p: (p.a * u.x - abs(u.x) * u.x,), ["x"], {"a": 0.8}, dynamics=False)
    found = contin.diagram(solve(problem, [0.8]), free=["a"], limits={"a": (-1, 1)})
    ends = sorted(tuple(branch[-1].x.round(9) + 0.0) for branch in found.branches)
    assert ends == [(-1, 1), (0, -1), (0, 1), (1, 1)] and len(found.junctions) == 1


@pytest.mark.parametrize("kink", [0.2, 2.0])
def test_curves_in_two_parameters_say_where_they_meet_corners(kink):
    """Folds of a - x^2 + b x + k max(b - 1, 0) x: the curve bends at b = 1, a little or too much to go on."""
    problem = AlgebraicProblem(
        lambda u, p: (p.a - u.x**2 + p.b * u.x + kink * max(p.b - 1, 0) * u.x,), ["x"], {"a": 1.0, "b": 0.2}, dynamics=False
    )
    (fold,) = trace(solve(problem, [1.1]), free=["a"], limits={"a": (-3, 3)}, direction=-1).labelled("LP")
    curve = contin.curve(fold, free=["a", "b"], limits={"b": (-3, 3), "a": (-9, 9)})
    told = [note for note in [*curve.notes, str(curve.stop)] if "a corner: max(p.b - 1, 0), line " in note]
    assert len(told) == 1 and (curve[-1]["b"] == 3 if kink < 1 else curve[-1]["b"] == pytest.approx(1, abs=1e-4))


def test_what_is_found_by_iteration_may_read_a_corner():
    """y + y^3 = max(x, 2 x) and y = a: x = -2 at a = -1, and x = 1 at a = 1."""

    def residual(u, p):
        force = max(u.x, 2 * u.x)
        return (inner_root(lambda y: (y[0] + y[0] ** 3 - force,), [force])[0] - p.a,)

    branch = followed(residual, ["x"], -1.0, [-2.0], -1, 1)
    assert corners(branch) == [(0, "goes on")] and branch[-1]["x"] == pytest.approx(1, abs=1e-12)
