"""Problems on several intervals, against closed forms and against the same problem on one interval."""

import functools
import math
import pickle

import numpy as np
import pytest
from scipy.optimize import brentq
from scipy.special import erf

from bank.closed_forms import bratu_fold
from contin import ProblemError, Segment, SegmentedProblem, solve, trace


def bratu_rhs(s, u, p):
    return u.v, -p.lam * math.exp(u.u)


def joined(a, b, p):
    return a[0].u, b[0].u - a[1].u, b[0].v - a[1].v, b[1].u


def rest(p):
    return 1 - p.cut


@functools.cache
def cut_bratu():
    mean = {"mean": lambda s, u, p: u.u}
    segments = [Segment(bratu_rhs, ["u", "v"], "cut", functionals=mean), Segment(bratu_rhs, ["u", "v"], rest, functionals=mean)]
    return SegmentedProblem(segments, joined, {"lam": 0.0, "cut": 0.3})


@pytest.mark.parametrize("cut", [0.5, 0.3, 0.07])
def test_bratu_cut_in_two(cut):
    """The fold of Bratu's problem (closed form) does not depend on the cut, nor do the columns."""
    branch = trace(solve(cut_bratu(), [0, 0, 0, 0], {"cut": cut}), free=["lam"], limits={"lam": (0, 4), "mean": (-1, 3)})
    (fold,) = branch.labelled("LP")
    assert fold["lam"] == pytest.approx(bratu_fold(), abs=1e-11)
    first, second = fold.segment(0), fold.segment(1)
    assert (first.s[0], first.s[-1], second.s[0], second.s[-1]) == pytest.approx((0, cut, cut, 1), abs=1e-15)
    assert first["u"][-1] == pytest.approx(second["u"][0], abs=1e-12)
    if cut >= 0.5:  # the solution is even about the middle
        assert np.allclose(first(1 - second.s)[:, 0], second["u"], atol=1e-9)


def elastica(s, u, p):
    return u.curvature, -p.load * math.sin(u.angle)


def hinged(a, b, p):
    return (
        a[0].curvature,
        b[0].curvature - a[1].curvature,
        a[1].curvature - p.spring * (a[1].angle - b[0].angle),
        b[1].curvature,
    )


@functools.cache
def chain():
    names = ["angle", "curvature"]
    return SegmentedProblem(
        [Segment(elastica, names, 0.5), Segment(elastica, names, 0.5)], hinged, {"load": 1.0, "spring": 3.0}
    )


def test_buckling_of_two_elasticas_with_a_hinge_between_them():
    """Pinned ends, rods of length 1/2, a hinge with a spring c. Symmetric: k tan(k / 2) = 2 c, load k^2; else k = 2 pi."""
    branch = trace(solve(chain(), [0, 0, 0, 0]), free=["load"], limits={"load": (1, 45)})
    k = brentq(lambda k: k * math.sin(k / 2) - 6 * math.cos(k / 2), 0.5, 3)
    assert [point["load"] for point in branch.labelled("BP")] == pytest.approx([k**2, 4 * math.pi**2], abs=1e-9)
    buckled = trace(branch.labelled("BP")[0], branch=1, limits={"load": (1, 20)}).points[-1]
    first, second = buckled.segment(0), buckled.segment(1)
    assert np.allclose(first["angle"][[0, -1]], -second["angle"][[-1, 0]], atol=1e-9)  # mirror images
    assert abs(second["angle"][0] - first["angle"][-1]) > 0.1


def melt(s, u, p):
    return u.slope, -2 * s * u.slope


def front(a, b, p):
    """Two phases: +1 at s = 0, 0 at the front, -cold at s = 5; the front moves with the difference of fluxes."""
    return a[0].heat - 1, b[0].heat, a[1].heat, b[1].heat + p.cold, 2 * p.front + p.stefan * (b[0].slope - a[1].slope)


def test_a_melting_front_with_unknown_place():
    """Neumann's similarity solution with erf on both sides of the front; the place of the front is free."""

    def flux(x, cold, stefan):
        return x * math.sqrt(math.pi) - stefan * math.exp(-(x**2)) * (1 / erf(x) - cold / (erf(5) - erf(x)))

    problem = SegmentedProblem(
        [Segment(melt, ["heat", "slope"], "front"), Segment(melt, ["heat", "slope"], lambda p: 5 - p.front)], front,
        {"front": 0.5, "stefan": 1.0, "cold": 0.5},
    )  # fmt: skip
    start = solve(problem, [lambda s: (1 - s / 0.5, -2.0), [-0.2, -0.2]], free=["front"], degree=6)
    known = brentq(flux, 0.1, 2, (0.5, 1.0))
    assert start["front"] == pytest.approx(known, abs=1e-10)
    inside = np.linspace(0, known, 7)
    assert np.allclose(start.segment(0)(inside)[:, 0], 1 - erf(inside) / erf(known), atol=1e-8)
    branch = trace(start, free=["stefan", "front"], limits={"stefan": (0.5, 2)})
    assert branch.points[-1]["front"] == pytest.approx(brentq(flux, 0.1, 2, (0.5, 2.0)), abs=1e-10)


def test_segments_with_different_numbers_of_states_and_begins_of_their_own():
    """u'' = -1 on [0, 1], then x' = u(1) on [0, 2] from x = 0: u = s (b - s) / 2 with u'(1) = 0 is s - s^2 / 2, and x = 1."""
    problem = SegmentedProblem(
        [
            Segment(lambda s, u, p: (u.v, -1.0), ["u", "v"]),
            Segment(lambda s, u, p: (p.rate,), ["x"], 2.0, begin=0.0, functionals={"area": lambda s, u, p: u.x}),
        ],
        lambda a, b, p: (a[0].u, b[0].v, a[1].x, b[0].u - p.rate), {"rate": 0.0},
    )  # fmt: skip
    found = solve(problem, [[0, 0], [0]], free=["rate"])
    assert problem.state_names == ("u", "v", "x")
    profile = found.segment(1)
    assert (profile.s[-1], profile["x"][-1], found["area"]) == pytest.approx((2, 1, 1), abs=1e-12)


def test_pictures_over_the_coordinates_of_the_segments():
    pytest.importorskip("matplotlib").use("Agg")
    start = solve(cut_bratu(), [0, 0, 0, 0], {"lam": 1.0})
    portrait, series = start.plot()
    ends = [(line.get_xdata()[0], line.get_xdata()[-1]) for line in series.lines if len(line.get_xdata()) > 2]
    assert sorted(set(ends)) == [(0.0, 0.3), (0.3, 1.0)]
    assert [text.get_text() for text in series.get_legend().get_texts()] == ["u", "v"]
    assert len(portrait.lines) == 2 and start.plot("series", states=["v", "u"]).lines


def test_pickling():
    names = ["u", "v"]
    problem = SegmentedProblem(
        [Segment(bratu_rhs, names, "cut"), Segment(bratu_rhs, names, rest)], joined, {"lam": 1.0, "cut": 0.3}
    )
    again = pickle.loads(pickle.dumps(problem))
    assert again.state_names == ("u_0", "v_0", "u_1", "v_1")
    assert np.array_equal(solve(again, [0, 0, 0, 0]).x, solve(problem, [0, 0, 0, 0]).x)


def test_refusals():
    segment = Segment(bratu_rhs, ["u", "v"])
    with pytest.raises(ProblemError, match="segments: there must be at least one"):
        SegmentedProblem([], joined, {"lam": 0.0})
    with pytest.raises(ProblemError, match="segments: 1: length: 'cut' is no parameter; there are lam"):
        SegmentedProblem([segment, Segment(bratu_rhs, ["u", "v"], "cut")], joined, {"lam": 0.0})
    with pytest.raises(ProblemError, match="segments: 0: length: -1 must be a number between 0 and"):
        SegmentedProblem([Segment(bratu_rhs, ["u", "v"], -1)], joined, {"lam": 0.0})
    with pytest.raises(ProblemError, match="segments: 0: rhs returns 2 values, must return 3 for the states u, v, w"):
        SegmentedProblem([Segment(bratu_rhs, ["u", "v", "w"])], joined, {"lam": 0.0})
    with pytest.raises(ProblemError, match="guess: 3 guesses, must be one for each of the 2 segments"):
        solve(cut_bratu(), [[0, 0], [0, 0], [0, 0]])
    with pytest.raises(ProblemError, match="guess: 3 numbers for segment 1, must be its 2 states"):
        solve(cut_bratu(), [[0, 0], [0, 0, 0]])
    with pytest.raises(ProblemError, match="segment: 2 must be a whole number from 0 to 1"):
        solve(cut_bratu(), [0, 0, 0, 0]).segment(2)


def test_no_coordinate_outside_a_segment():
    line = Segment(lambda s, u, p: (p.slope,), ["u"], length=0.3)
    problem = SegmentedProblem([line, line], lambda a, b, p: (a[0].u, a[1].u - b[0].u), {"slope": 2.0})
    second = solve(problem, [[0.0], [0.0]]).segment(1)
    assert second([0.3, 0.6]) == pytest.approx(np.array([[0.6], [1.2]]))
    for place in (0.2, 0.7, float("nan")):
        with pytest.raises(ProblemError, match=f"s: {place:g} must lie on the segment, from 0.3 to 0.6"):
            second([0.4, place])
