"""Energies of several segments that meet at their ends, against closed forms and against the same structure in one piece."""

import math
import pickle
from dataclasses import replace

import numpy as np
import pytest

from contin import ProblemError, SegmentedVariationalProblem, VariationalProblem, VariationalSegment, solve, trace

PLANE = {"states": ["angle", "x", "y"], "controls": ["bend"]}


def _bends(s, x, w, p):
    return w.bend**2 / 2


def _moves(s, x, w, p):
    return w.bend, math.cos(x.angle), math.sin(x.angle)


ROD = VariationalSegment(_bends, kinematics=_moves, **PLANE)


def _labels(branch, name):
    return [(point[name], point.label, point.index_change) for point in branch if point.label not in ("", "EP")]


# --- one structure, cut ---------------------------------------------------------------------------------------------------


def _clamped(cuts):
    """A rod of length 1, clamped at both ends and compressed, cut at some places by rigid joints."""
    ends = [0.0, *cuts, 1.0]
    rods = [replace(ROD, begin=a, length=b - a) for a, b in zip(ends, ends[1:])]

    def joined(a, b, p):
        between = [each for i in range(len(cuts)) for each in (s - e for s, e in zip(a[i + 1], b[i]))]
        return (*a[0], *between, b[-1].angle, b[-1].y)

    return SegmentedVariationalProblem(rods, {"load": 30.0}, ends=joined, end_energy=lambda a, b, p: p.load * b[-1].x)


@pytest.mark.sample(1)
@pytest.mark.parametrize("cuts", [(), (0.3,), (0.11, 0.5, 0.83)])
def test_a_cut_changes_nothing(cuts):
    """Euler's loads 4 pi^2, 4 (4.4934...)^2, the root of tan z = z; 16 pi^2; index from 0 to 3."""
    problem = _clamped(cuts)
    straight = solve(problem, [lambda s: (0, s, 0)] * (len(cuts) + 1))
    found = _labels(trace(straight, free=["load"], limits={"load": (30, 160)}), "load")
    loads = [4 * math.pi**2, 4 * 4.493409457909064**2, 16 * math.pi**2]
    assert [round(load / known, 10) for (load, _, _), known in zip(found, loads)] == [1, 1, 1]
    assert [change for _, _, change in found] == [(0, 1), (1, 2), (2, 3)]


@pytest.mark.full
def test_a_buckled_rod_is_the_same_in_pieces():
    """Energy and places of the post-buckled clamped rod, in one piece and in three of different lengths."""
    states = []
    for cuts in ((), (0.3, 0.42)):
        problem = _clamped(cuts)
        straight = solve(problem, [lambda s: (0, s, 0)] * (len(cuts) + 1), {"load": 38.0}, intervals=20)
        first = trace(straight, free=["load"], limits={"load": (38, 41)}).labelled("BP")[0]
        branch = trace(first, branch=1, limits={"load": (30, 60)})
        assert branch[-1]["load"] == pytest.approx(60)
        assert branch[-1].index == 0
        states.append(branch[-1])
    whole, pieces = states
    assert pieces["energy"] == pytest.approx(whole["energy"], abs=1e-9)
    for index, s in ((0, 0.2), (1, 0.35), (2, 0.9)):
        np.testing.assert_allclose(np.abs(pieces.segment(index)(s)[0, :3]), np.abs(whole.segment(0)(s)[0, :3]), atol=1e-9)


def test_an_energy_that_is_not_quadratic():
    """The catenoid between rings at a gap of 2 d: fold at d / radius = .6627434193 (u tanh u = 1), index 0 to 1 there."""
    film = VariationalSegment(lambda s, x, w, p: x.r * math.sqrt(1 + w.r**2), ["r"], length=lambda p: 0.7 * p.gap)
    rest = replace(film, length=lambda p: 0.3 * p.gap, begin=lambda p: 0.7 * p.gap)
    problem = SegmentedVariationalProblem(
        [film, rest], {"gap": 0.8}, ends=lambda a, b, p: (a[0].r - 1, a[1].r - b[0].r, b[1].r - 1)
    )
    branch = trace(solve(problem, [[1.0], [1.0]]), free=["gap"], limits={"gap": (0.5, 1.4)})
    (fold,) = branch.labelled("LP")
    u = 1.1996786402577338  # u tanh u = 1
    assert fold["gap"] == pytest.approx(2 * u / math.cosh(u), abs=1e-9)
    assert fold.index_change == (0, 1)


# --- frames ---------------------------------------------------------------------------------------------------------------


@pytest.mark.full
@pytest.mark.parametrize(
    "clamped, length",
    [(True, 2.71645974768613), (False, 1.34955282371664)],  # k l cot(k l) = -6, k l tan(k l) = 6
)
def test_a_portal_frame_sways(clamped, length):
    """Dead loads on both corners; beam and columns equal, inextensible; P l^2 / B = (k l)^2."""
    column = ROD

    def joined(a, b, p):
        left, beam, right = zip(a, b)
        held = [(left[0].x, left[0].y), (right[0].x - 1, right[0].y)]
        if clamped:
            held += [(left[0].angle - math.pi / 2, right[0].angle - math.pi / 2)]
        first = (beam[0].angle - left[1].angle + math.pi / 2, beam[0].x - left[1].x, beam[0].y - left[1].y)
        second = (beam[1].angle - right[1].angle + math.pi / 2, beam[1].x - right[1].x, beam[1].y - right[1].y)
        return [each for part in (*held, first, second) for each in part]

    frame = SegmentedVariationalProblem(
        [column] * 3, {"load": 0.5}, ends=joined, end_energy=lambda a, b, p: p.load * (b[0].y + b[2].y)
    )
    upright = solve(frame, [lambda s: (math.pi / 2, 0, s), lambda s: (0, s, 1), lambda s: (math.pi / 2, 1, s)])
    branch = trace(upright, free=["load"], limits={"load": (0.5, 9)})
    first = branch.labelled("BP")[0]
    assert math.sqrt(first["load"]) == pytest.approx(length, abs=1e-10)
    assert first.index_change == (0, 1)
    swaying = trace(first, branch=1, max_points=4)
    assert swaying[-1]["load"] > first["load"]  # the pitchfork opens towards larger loads: the swaying frame is stable
    assert swaying[-1].index == 0


# --- statements -----------------------------------------------------------------------------------------------------------


def test_it_is_data():
    problem = _clamped((0.3,))
    again = pickle.loads(pickle.dumps(problem))
    assert again == problem
    assert problem != _clamped((0.4,))
    assert solve(again, [lambda s: (0, s, 0)] * 2)["energy"] == pytest.approx(0, abs=1e-12)


def test_equal_segments_are_derived_once(monkeypatch):
    made = []
    plain = VariationalProblem.__init__
    monkeypatch.setattr(VariationalProblem, "__init__", lambda self, *a, **k: (made.append(self), plain(self, *a, **k))[1])
    _clamped((0.2, 0.4, 0.6))
    assert len(made) == 1


@pytest.mark.parametrize(
    "segments, ends, message",
    [
        ([], None, "segments: there must be at least one"),
        ([1.0], None, "segments: 1.0 must be a VariationalSegment"),
        ([replace(ROD, length=-1.0)], None, "segments: 0: length: -1.0 must be a number between 0 and inf"),
        ([replace(ROD, length="size")], None, "segments: 0: length: 'size' is no parameter; there are load"),
        ([replace(ROD, energy=lambda x: x)], None, "segments: 0: energy must take 4 arguments"),
        ([ROD], lambda a, b: a[0], "ends must take 3 arguments, (a, b, p)"),
        ([ROD], lambda a, b, p: (a[0].x, 2 * a[0].x), "ends: condition 2 repeats or contradicts those before it"),
        ([ROD, VariationalSegment(None, ["q"], hamiltonian=lambda s, x, y, p: y.q**2)], None, "all must have an energy"),
    ],
)
def test_what_cannot_be_used_is_one_sentence(segments, ends, message):
    with pytest.raises(ProblemError) as raised:
        SegmentedVariationalProblem(segments, {"load": 1.0}, ends=ends)
    assert message in str(raised.value)


def test_a_guess_is_for_all_segments():
    with pytest.raises(ProblemError, match="1 guesses, must be one for each of the 2 segments"):
        solve(_clamped((0.5,)), [lambda s: (0, s, 0)])
    with pytest.raises(ProblemError, match="2 numbers for segment 1, must be its 3 states"):
        solve(_clamped((0.5,)), [lambda s: (0, s, 0), [0, 0]])
