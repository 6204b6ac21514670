"""Branch switching and whole diagrams, against closed forms."""

import pytest

from bank.closed_forms import buckling_loads, elastica, elastica_load
from contin import AlgebraicProblem, ProblemError, diagram, solve, trace


def straight():
    return solve(elastica(), [0, 0], intervals=12, degree=6)


def test_switching_to_the_other_branch():
    """Both ways along the first buckled branch of the elastica; lam from the closed form at every point."""
    branch = trace(straight(), free=["lam"], limits={"lam": (1, 20)})
    (first,) = branch.labelled("BP")
    for way in (1, -1):
        buckled = trace(first, branch=1, direction=way, limits={"lam": (1, 20)})
        assert buckled.points[-1]["lam"] == pytest.approx(20, abs=1e-10) and len(buckled) > 5
        for point in buckled.points[1:]:
            angle = abs(point.system.states(point.x)[0, 0])
            assert point["lam"] == pytest.approx(elastica_load(angle), rel=1e-10)
    with pytest.raises(ProblemError, match="between 0 and 1"):
        trace(first, branch=2)
    with pytest.raises(ProblemError, match="branch: 1 must be 0 at a point labelled 'EP'"):
        trace(branch.points[0], branch=1)


def test_diagram_of_the_elastica():
    """Every buckled branch once, both halves; the graph joins them at the three buckling loads."""
    result = diagram(straight(), free=["lam"], limits={"lam": (1, 95)}, depth=2, step=0.5)
    assert [junction.point["lam"] for junction in result.junctions] == pytest.approx(buckling_loads(3), rel=1e-8)
    assert len(result.branches) == 2 + 2 * 3
    graph = result.graph()
    assert all(graph.degree(f"BP{i}") == 4 for i in range(3))
    assert {data["label"] for _, data in graph.nodes(data=True)} == {"BP", "EP"}


def test_diagram_modulo_symmetry():
    """theta -> -theta and reversal map buckled halves to each other: each is followed once."""
    symmetries = [lambda t, u: -u, lambda t, u: u[::-1] * [1, -1]]
    result = diagram(straight(), free=["lam"], limits={"lam": (1, 95)}, depth=2, step=0.5, symmetries=symmetries)
    assert [junction.point["lam"] for junction in result.junctions] == pytest.approx(buckling_loads(3), rel=1e-8)
    assert len(result.branches) == 2 + 3


def three_lines():
    """u (mu - u) (mu + u - 1) = 0: three lines that meet at (0, 0), (1, 0) and (1/2, 1/2)."""
    return AlgebraicProblem(lambda u, p: (u.x * (p.mu - u.x) * (p.mu + u.x - 1),), ["x"], {"mu": 0.5})


def test_a_branch_is_recognised_when_it_is_met_again():
    result = diagram(solve(three_lines(), [0.0]), free=["mu"], limits={"mu": (-2, 2)}, depth=3)
    found = sorted((round(j.point["mu"], 9) + 0.0, round(float(j.point.x[0]), 9) + 0.0) for j in result.junctions)
    assert found == [(0.0, 0.0), (0.5, 0.5), (1.0, 0.0)]
    assert len(result.branches) == 6  # every line once: two ways from the start, two half-lines from each junction on it
    assert all(len(taken) == 2 for junction in result.junctions for taken in junction.taken)
