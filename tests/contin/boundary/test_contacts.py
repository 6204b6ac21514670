"""Contacts, which push and cannot pull: columns and walls, tips and stops, an arch and a roller, against closed forms."""

import math

import numpy as np
import pytest
from scipy.optimize import brentq
from scipy.special import ellipk

import contin
from contin import ProblemError, SegmentedVariationalProblem, VariationalProblem, VariationalSegment, solve, trace

#: A rod of length 1 and stiffness 1 that bends in a plane: x is across its first direction.
PLANE = {
    "kinematics": lambda t, x, w, p: (math.sin(x.th), w.th),
    "controls": ["th"],
}


def met(branch):
    return [(point.label, point.name, point.index_change) for point in branch if point.label not in ("", "EP")]


def half_column(**contacts):
    """Half of a pinned column, its middle at t = 1."""
    return VariationalProblem(
        lambda t, x, w, p: w.th**2 / 2 + p.P * math.cos(x.th), ["y", "th"], {"P": 2.0}, **PLANE, **contacts
    )


def buckled(problem, guess, direction, high=30):
    straight = trace(solve(problem, guess), free=["P"], limits={"P": (1, high)})
    return trace(straight.labelled("BP")[0], branch=1, direction=direction, limits={"P": (1, high)})


def load_at_depth(depth):
    """Half a pinned column has its middle at 2 k / K(k) and P = K(k)^2 (Euler's elastica)."""
    m = brentq(lambda m: 2 * math.sqrt(m) / ellipk(m) - depth, 1e-6, 0.5, xtol=1e-15)
    return ellipk(m) ** 2


def test_the_middle_of_a_column_meets_a_wall_and_lies_flat_there():
    """Euler's load; the wall; the curvature at the wall vanishes: from there on a line would touch."""
    problem = half_column(ends=lambda a, b, p: (a.y, b.th, 0.2 - b.y), pushes=[2])
    straight = trace(solve(problem, [0.0, 0.0]), free=["P"], limits={"P": (1, 30)})
    assert straight.labelled("BP")[0]["P"] == pytest.approx(math.pi**2 / 4, rel=1e-11)
    assert straight.notes == ["contacts at P = 2: 0.2 - b.y is open"] and straight[-1].contacts == ()
    branches = [trace(straight.labelled("BP")[0], branch=1, direction=way, limits={"P": (1, 30)}) for way in (1, -1)]
    assert met(branches[0])[1:] == [] and branches[0][-1]["P"] == 30  # to the other side
    (touch,) = branches[1].labelled("BC")
    assert touch.name == "0.2 - b.y touches: goes on" and abs(touch["P"] - load_at_depth(0.2)) < touch.errors["P"] + 1e-13
    assert touch.index_change == (0, 0)
    end = branches[1][-1]
    assert "flat contact at 0.2 - b.y" in str(branches[1].stop) and end.contacts == ("0.2 - b.y",) and end["sigma_1"] < 0
    moments = end.system.evaluate(end.x, np.array([0.9, 1.0]))[:, 3]
    assert moments[1] == pytest.approx(0, abs=1e-9) and abs(moments[0]) > 0.01


def test_a_point_in_the_place_of_a_wall():
    """The column goes on to bend around it, up to the fold of one that is held to both sides, behind which it is unstable."""
    problem = half_column(ends=lambda a, b, p: (a.y, b.th, 0.2 - b.y), pushes={2: "bar"}, points=[2])
    branch = buckled(problem, [0.0, 0.0], -1)
    assert met(branch)[1:] == [("BC", "bar touches: goes on", (0, 0)), ("LP", "P", (0, 1))]
    held = half_column(ends=lambda a, b, p: (a.y, b.th, b.y - 0.2))  # to both sides: the same fold
    fold = branch.labelled("LP")[0]
    again = solve(held, lambda t: fold.system.evaluate(fold.x, np.array([t]))[0, :2], {"P": fold["P"] - 0.1})
    assert trace(again, free=["P"], limits={"P": (1, 30)}).labelled("LP")[0]["P"] == pytest.approx(fold["P"], rel=1e-11)


def test_a_wall_that_is_touched_without_force_counts_as_one_that_holds_and_a_run_says_so():
    """The straight column buckles as one that is held in its middle: tan k = k, P = k^2."""
    problem = half_column(ends=lambda a, b, p: (a.y, b.th, -b.y), pushes={2: "wall"})
    branch = trace(solve(problem, [0.0, 0.0]), free=["P"], limits={"P": (1, 30)})
    assert branch.notes == ["contacts at P = 2: wall holds, wall touches without force"]
    k = brentq(lambda k: math.sin(k) - k * math.cos(k), 4, 4.7)
    assert branch.labelled("BP")[0]["P"] == pytest.approx(k**2, rel=1e-11)


@pytest.mark.parametrize(["way", "name", "depth"], [(-1, "upper", 0.2), (1, "lower", 0.3)])
def test_walls_on_both_sides_at_the_first_end(way, name, depth):
    problem = half_column(ends=lambda a, b, p: (b.y, a.th, 0.2 - a.y, a.y + 0.3), pushes={2: "upper", 3: "lower"})
    branches = [buckled(problem, [0.0, 0.0], each) for each in (1, -1)]
    (branch,) = [each for each in branches if name in each.labelled("BC")[0].name]
    assert branch.labelled("BC")[0]["P"] == pytest.approx(load_at_depth(depth), rel=1e-12) and name in str(branch.stop)


def test_the_joint_of_two_segments_meets_a_wall():
    """As the half column does: all loads are four times as large, and the depth is half of it."""
    half = VariationalSegment(lambda t, x, w, p: w.th**2 / 2 + p.P * math.cos(x.th), ["y", "th"], 0.5, **PLANE)
    problem = SegmentedVariationalProblem(
        [half, half], {"P": 5.0}, pushes={4: "wall"},
        ends=lambda a, b, p: (a[0].y, b[1].y, b[0].y - a[1].y, b[0].th - a[1].th, 0.1 - b[0].y),
    )  # fmt: skip
    ends = [buckled(problem, [[0.0, 0.0]] * 2, way, 60) for way in (1, -1)]
    (branch,) = [each for each in ends if each.labelled("BC")]
    assert branch.labelled("BC")[0]["P"] == pytest.approx(4 * load_at_depth(0.2), rel=1e-12)
    assert "flat contact at wall" in str(branch.stop)


@pytest.mark.parametrize(["length", "force"], [(1, 1), (1e3, 1e-3), (1e-3, 1e3)])
def test_a_tip_meets_a_stop_and_lifts_off(length, force):
    """At .6258923107865 (the load of the free tip, Bisshopp & Drucker 1945); and there on the way back."""
    problem = VariationalProblem(
        lambda t, x, w, p: force * length * w.th**2 / 2, ["y", "th"], {"P": 0.0}, controls=["th"],
        kinematics=lambda t, x, w, p: (length * math.sin(x.th), w.th), end_energy=lambda a, b, p: p.P * b.y,
        ends=lambda a, b, p: (a.y, a.th, b.y + 0.2 * length), pushes={2: "stop"},
    )  # fmt: skip
    branch = trace(solve(problem, [0.0, 0.0]), free=["P"], limits={"P": (0, 5 * force)})
    assert met(branch) == [("BC", "stop touches: goes on", (0, 0))]
    touch = branch.labelled("BC")[0]
    assert touch["P"] == pytest.approx(0.6258923107865 * force, rel=1e-12)
    assert branch[-1]["sigma_1"] == pytest.approx(touch["P"] - 5 * force, rel=1e-10)
    back = trace(branch[-1], free=["P"], limits={"P": (-force, 5 * force)}, direction=-1)
    assert back.notes == [f"contacts at P = {5 * force:.10g}: stop holds"]
    assert met(back) == [("BC", "stop lifts off: goes on", (0, 0))]
    assert back.labelled("BC")[0]["P"] == pytest.approx(touch["P"], rel=1e-12)


def test_a_roller_presses_an_arch_and_does_not_pull_it(tmp_path):
    """It touches at the height of the free arch and lets go at that of the free arch that snaps, whose index is one more."""
    clamped = {"ends": lambda a, b, p: (a.x, a.y, a.th, b.th, b.x - 0.95)}
    rod = {"kinematics": lambda t, x, w, p: (math.cos(x.th), math.sin(x.th), w.th), "controls": ["th"]}
    free = VariationalProblem(lambda t, x, w, p: w.th**2 / 2, ["x", "y", "th"], {"d": 0.5}, **rod, **clamped)
    pressed = VariationalProblem(
        lambda t, x, w, p: w.th**2 / 2, ["x", "y", "th"], {"d": 0.5}, pushes={5: "roller"}, points=[5], **rod,
        ends=lambda a, b, p: (a.x, a.y, a.th, b.th, b.x - 0.95, p.d - b.y),
    )  # fmt: skip

    def arch(t):
        return 0.95 * t, 0.13 * (1 - math.cos(math.pi * t)), 0.45 * math.sin(math.pi * t)

    branch = trace(solve(pressed, arch), free=["d"], limits={"d": (-0.5, 0.6)}, direction=-1)
    touch, leave = branch.labelled("BC")
    assert touch.name == "roller touches: goes on" and leave.name == "roller lifts off: fold" and leave.index_change == (1, 2)
    top = solve(free, arch)
    assert touch["d"] == pytest.approx(float(top.system.states(top.x)[-1, 1]), abs=1e-11)
    snapped = solve(free, lambda t: leave.system.evaluate(leave.x, np.array([t]))[0, :3])
    assert leave["d"] == pytest.approx(float(snapped.system.states(snapped.x)[-1, 1]), abs=1e-11)
    assert snapped.second_variation().index() == 2
    contin.save(branch, tmp_path / "arch.npz")
    kept = contin.load(pressed, tmp_path / "arch.npz").labelled("BC")
    assert [point.index_change for point in kept] == [(0, 0), (1, 2)] and kept[0].contacts == touch.contacts


def test_both_ends_rest_on_supports():
    """A beam on a soft ground: with its weight turned round, the end that carries less lifts off first, then the other one."""
    beam = VariationalProblem(
        lambda t, x, w, p: w.s**2 / 2 + x.y**2 / 4 + p.q * x.y * (1 + t / 2), ["y", "s"], {"q": 1.0}, controls=["s"],
        kinematics=lambda t, x, w, p: (x.s, w.s), ends=lambda a, b, p: (a.y, b.y + 0.1), pushes={0: "left", 1: "right"},
    )  # fmt: skip
    first = solve(beam, [0.0, 0.0])
    assert first.contacts == ("left", "right") and min(-first["sigma_1"], -first["sigma_2"]) > 0
    branch = trace(first, free=["q"], limits={"q": (-2, 2)}, direction=-1)
    assert [name for _, name, _ in met(branch)] == ["right lifts off: goes on", "left lifts off: goes on"]
    assert branch.labelled("BC")[1]["q"] == pytest.approx(0, abs=1e-13) and branch[-1]["q"] == -2


def test_contacts_that_do_not_fit_are_told_in_one_sentence():
    with pytest.raises(ProblemError, match="pushes: 7 is not the number of an end condition, 0 to 2"):
        half_column(ends=lambda a, b, p: (a.y, b.th, 0.2 - b.y), pushes=[7])
    with pytest.raises(ProblemError, match="points: 1 must be one of the pushes: 2"):
        half_column(ends=lambda a, b, p: (a.y, b.th, 0.2 - b.y), pushes=[2], points=[1])
