"""Diagrams that begin with equilibria and go on with cycles: what is switched at, and what is recognized."""

import math

import pytest
from cycles.noted import NOTES

import contin
from contin import AlgebraicProblem, CycleProblem, ProblemError


def between(u, p):
    """Growth mu (1 - mu) - r**2: Hopf points at 0 and 1."""
    growth = p.mu * (1 - p.mu) - u.x**2 - u.y**2
    return growth * u.x - u.y - 0.3 * u.x * u.y, u.x + growth * u.y


def roessler(u, p):
    return -u.y - u.z, u.x + 0.2 * u.y, 0.2 + u.z * (u.x - p.c)


def test_cycles_between_two_hopf_points_are_followed_once():
    rest = contin.solve(AlgebraicProblem(between, ["x", "y"], {"mu": -0.5}), [0, 0])
    found = contin.diagram(rest, free=["mu"], depth=1, limits={"mu": (-0.6, 2), "period": (0, 20)})
    assert [junction.point.label for junction in found.junctions] == ["HB", "HB"]
    cycles = [branch for branch in found.branches if branch.points[0].label == "HB"]
    assert len(cycles) == 1 and cycles[0].stop.reason == "Hopf"
    graph = found.graph()
    assert {data["branch"] for data in graph.get_edge_data("HB0", "HB1").values()} == {0, 2}  # equilibria, and cycles
    assert not any(junction.failed for junction in found.junctions)


def test_a_depth_of_zero_leaves_no_hopf_point():
    rest = contin.solve(AlgebraicProblem(between, ["x", "y"], {"mu": -0.5}), [0, 0])
    found = contin.diagram(rest, free=["mu"], depth=0, limits={"mu": (-0.6, 2)})
    assert len(found.branches) == 2 and [junction.taken[1] for junction in found.junctions] == [{}, {}]


def test_columns_of_neither_kind_are_refused():
    rest = contin.solve(AlgebraicProblem(between, ["x", "y"], {"mu": -0.5}), [0, 0])
    with pytest.raises(ProblemError, match="'amplitude' is no column of this problem"):
        contin.diagram(rest, free=["mu"], limits={"mu": (-0.6, 2), "amplitude": (0, 1)})


def moebius(u, p):
    """The circle r = 1, and beside it w, whose components along axes that turn by half a turn a round grow by g and -1.

    Multipliers -exp(2 pi g) and -exp(-2 pi); with the term -|w|^2 w the doubled cycle has |w| = sqrt(g), g = mu (1 - mu).
    """
    square, size, g = u.x**2 + u.y**2, u.a**2 + u.b**2, p.mu * (1 - p.mu)
    mean, half = (g - 1) / 2 - size, (g + 1) / 2
    return (
        u.x - u.y - u.x * square, u.x + u.y - u.y * square,
        mean * u.a + half * (u.x * u.a + u.y * u.b) - u.b / 2, mean * u.b + half * (u.y * u.a - u.x * u.b) + u.a / 2,
    )  # fmt: skip


def test_a_doubled_branch_comes_back_to_the_cycles_it_left():
    """Period doublings at mu = 0 and 1; the branch between them is found once."""
    problem = CycleProblem(moebius, ["x", "y", "a", "b"], {"mu": -0.5})
    orbit = contin.solve(
        problem, lambda t: (math.cos(2 * math.pi * t), math.sin(2 * math.pi * t), 0, 0), {"period": 6.2}, degree=6
    )
    found = contin.diagram(orbit, free=["mu"], depth=1, limits={"mu": (-0.6, 1.5)}, zeros={"mu": [0.5]})
    assert [junction.point.label for junction in found.junctions] == ["PD", "PD"]
    assert [junction.point["mu"] for junction in found.junctions] == pytest.approx([0, 1], abs=1e-9)
    (doubled,) = [branch for branch in found.branches if branch.points[0].label == "BP"]
    assert [point.label for point in doubled if point.label] == ["BP", "UZ", "PD"]
    assert doubled.stop.reason == "period doubling" and doubled.points[-1]["mu"] == pytest.approx(1, abs=1e-9)
    (middle,) = doubled.labelled("UZ")
    assert middle["period"] == pytest.approx(4 * math.pi, abs=1e-9) and middle["max_a"] == pytest.approx(0.5, abs=1e-9)
    assert [found.graph().degree(name) for name in ("PD0", "PD1")] == [3, 3]


@pytest.mark.full
def test_five_doublings_by_one_command():
    """Roessler's equations from their equilibria: each doubling is a step deeper. AUTO-07p has the same five to 1e-8."""
    z = (1 - math.sqrt(1 - 0.16)) / 0.4
    rest = contin.solve(AlgebraicProblem(roessler, ["x", "y", "z"], {"c": 1.0}), [0.2 * z, -z, z])
    found = contin.diagram(rest, free=["c"], depth=5, limits={"c": (0.2, 4.3), "period": (0, 300)})
    doublings = [junction.point for junction in found.junctions if junction.point.label == "PD"]
    assert [junction.depth for junction in found.junctions] == [0, 1, 2, 3, 4, 5]
    for point, rounds in zip(doublings, (1, 2, 4, 8, 16), strict=True):
        (known,) = [row for row in NOTES["roessler"][str(rounds)] if row["label"] == "PD"]
        assert point["c"] == pytest.approx(known["parameter"], rel=1e-8)
        assert point["period"] == pytest.approx(known["period"], rel=1e-8)
    graph = found.graph()
    for deeper in range(1, 5):
        assert graph.has_edge(f"PD{deeper}", f"PD{deeper + 1}")


@pytest.mark.full
def test_images_under_a_symmetry_count_once():
    """Two branches leave where the symmetry of AUTO's demo ``tor`` breaks: each is the other's image, half a period later."""
    from cycles.test_demos import tor

    rest = contin.solve(AlgebraicProblem(tor, ["x", "y", "z"], {"rn": -0.9}), [0, 0, 0])
    for symmetries, count in (([], 5), ([lambda t, u: -u], 4)):
        found = contin.diagram(
            rest, free=["rn"], depth=2, limits={"rn": (-0.91, -0.52), "period": (0, 12)}, symmetries=symmetries
        )
        assert len(found.branches) == count
