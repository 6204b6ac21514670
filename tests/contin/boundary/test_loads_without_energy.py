"""Loads without an energy, beside those with one, against closed forms."""

import math
from math import cos, sin

import numpy as np
import pytest

import contin
from contin import ProblemError, SegmentedVariationalProblem, VariationalProblem, VariationalSegment


def _half_ring(kind: str) -> VariationalProblem:
    """Half of an inextensible ring of radius 1 and stiffness 1 in its plane, between mirrors, under a pressure from outside."""

    def energy(t, x, w, p):
        value = (w.turn - 1) ** 2 / 2
        if kind == "dead":
            return value - p.pressure * (cos(t) * x.y - sin(t) * x.x)
        return value + p.pressure * math.sqrt(x.x**2 + (x.y - 1) ** 2) if kind == "central" else value

    def ends(a, b, p):
        return (a.angle, a.x, b.angle - math.pi, b.x, *([] if kind == "central" else [a.y]))

    def work(t, x, y, p):
        return p.pressure * (y.y * cos(x.angle) - y.x * sin(x.angle))

    return VariationalProblem(
        energy, ["angle", "x", "y"], {"pressure": 0.5}, kinematics=lambda t, x, w, p: (w.turn, cos(x.angle), sin(x.angle)),
        controls=["turn"], ends=ends, domain=(0, math.pi), work=work if kind == "follower" else None,
    )  # fmt: skip


@pytest.mark.sample(1)
@pytest.mark.parametrize("kind", ["follower", "dead", "central"])
def test_a_ring_under_three_kinds_of_pressure(kind):
    """p R^3 / B = n^2 - 1 where it follows the ring, n^2 where it does not turn, (n^2 - 1)^2 / (n^2 - 2) to the centre."""
    known = {
        "follower": lambda n: n**2 - 1, "dead": lambda n: n**2, "central": lambda n: (n**2 - 1) ** 2 / (n**2 - 2)
    }[kind]  # fmt: skip
    start = contin.solve(_half_ring(kind), lambda t: [t, sin(t), 1 - cos(t)])
    branch = contin.trace(start, free=["pressure"], limits={"pressure": (0, 10)}, progress=False)
    places = [point["pressure"] for point in branch.labelled("BP")]
    assert places == pytest.approx([known(2), known(3)], abs=1e-10)
    changes = [point.index_change for point in branch.labelled("BP")]
    assert changes == ([None, None] if kind == "follower" else [(0, 1), (1, 2)])
    assert branch[-1].index == (None if kind == "follower" else 2)


def _column(part: float, pieces: int = 1) -> SegmentedVariationalProblem:
    """A clamped column of length 1 under a force at its free end, a part of which follows the tangent there."""
    piece = VariationalSegment(
        lambda s, x, w, p: w.turn**2 / 2, ["angle", "x", "y"], 1 / pieces, controls=["turn"],
        kinematics=lambda s, x, w, p: (w.turn, cos(x.angle), sin(x.angle)),
    )  # fmt: skip

    def ends(a, b, p):
        joined = [u - v for i in range(pieces - 1) for u, v in zip(b[i], a[i + 1])]
        return (a[0].angle, a[0].x, a[0].y, *joined)

    def follows(a, b, y_a, y_b, p):
        return -part * p.load * (cos(b[-1].angle) * y_b[-1].x + sin(b[-1].angle) * y_b[-1].y)

    return SegmentedVariationalProblem(
        [piece] * pieces, {"load": 0.1}, ends=ends, end_energy=lambda a, b, p: (1 - part) * p.load * b[-1].x, end_work=follows
    )


def _straight(problem):
    pieces = len(problem.segments)
    guess = [lambda s, i=i: [0.0, s + i / pieces, 0.0] for i in range(pieces)]
    return contin.trace(contin.solve(problem, guess), free=["load"], limits={"load": (0, 60)}, progress=False)


@pytest.mark.sample(1)
@pytest.mark.parametrize(("part", "pieces"), [(0.3, 1), (0.45, 2), (-1.0, 1)])
def test_a_column_whose_load_follows_in_part(part, pieces):
    """cos k = -a / (1 - a) with k^2 = P, for the part a that follows, from w'''' + k^2 w'' = 0, w''' + (1 - a) k^2 w' = 0."""
    first = math.acos(-part / (1 - part))
    known = [k**2 for k in (first, 2 * math.pi - first, first + 2 * math.pi) if k**2 < 60]
    branch = _straight(_column(part, pieces))
    assert [point["load"] for point in branch.labelled("BP")] == pytest.approx(known, abs=1e-10)


def test_becks_column_has_no_other_state():
    """A load that follows altogether: the straight column flutters at P = 20.05, which is no equilibrium."""
    branch = _straight(_column(1.0))
    assert not branch.labelled("BP")
    assert branch[-1]["load"] == pytest.approx(60)


@pytest.mark.full
def test_the_buckled_column_is_an_equilibrium():
    """What the load does along the branch is the energy of the column."""
    start = _straight(_column(0.3)).labelled("BP")[0]
    branch = contin.trace(start, branch=1, limits={"load": (0, 12)}, progress=False, max_step=0.02)
    tips = np.array([point.system.states(point.x)[-1, :3] for point in branch])
    loads, energies = (np.array([point[name] for point in branch]) for name in ("load", "energy"))
    pulls = -loads[:, None] * (0.3 * np.stack([np.cos(tips[:, 0]), np.sin(tips[:, 0])], axis=1) + [0.7, 0.0])
    work = np.concatenate([[0], np.cumsum(np.sum((pulls[1:] + pulls[:-1]) / 2 * np.diff(tips[:, 1:3], axis=0), axis=1))])
    assert energies[-1] > 1
    assert energies == pytest.approx(work, abs=2e-3)  # the trapezoidal rule on steps of 0.02


def test_what_has_no_index_says_so():
    point = contin.solve(_half_ring("follower"), lambda t: [t, sin(t), 1 - cos(t)])
    with pytest.raises(ProblemError, match="its loads have no energy, so there is no index"):
        point.second_variation()


def test_wrong_functions_are_one_sentence():
    given = {"energy": lambda t, x, w, p: w.y**2, "states": ["y"], "parameters": {}}
    for name, count in (("work", 4), ("end_work", 5)):
        with pytest.raises(ProblemError, match=f"{name} must take {count} arguments"):
            VariationalProblem(**given, **{name: lambda x: x})
    with pytest.raises(ProblemError, match="work returns 2 values, must return 1"):
        VariationalProblem(**given, work=lambda t, x, y, p: (y.y, 1.0))
