"""Branch points, switching and whole diagrams, against closed forms."""

import math

import numpy as np
import pytest
from scipy.special import ellipk

from contin import (
    AlgebraicProblem,
    BoundaryValueProblem,
    ConvergenceError,
    MultiplePoint,
    ProblemError,
    diagram,
    locate_branch_point,
    solve,
    trace,
)


def elastica():
    """theta'' + lam sin(theta) + k theta = 0 with theta' = 0 at both ends: buckling at lam = (j pi)^2 - k."""
    return BoundaryValueProblem(
        lambda t, u, p: (u.v, -p.lam * math.sin(u.theta) - p.k * u.theta), lambda a, b, p: (a.v, b.v), ["theta", "v"],
        {"lam": 5.0, "k": 0.0}, functionals={"mode1": lambda t, u, p: u.theta * math.cos(math.pi * t)},
    )  # fmt: skip


def straight():
    return solve(elastica(), [0, 0], intervals=12, degree=6)


def test_switching_to_the_other_branch_of_a_stored_point():
    """lam = (2 K(sin(a/2)))^2 on the first branch, a = theta(0) (Euler)."""
    branch = trace(straight(), free=["lam"], limits={"lam": (1, 50)})
    first = branch.labelled("BP")[0]
    for way in (1, -1):
        buckled = trace(first, branch=1, direction=way, limits={"lam": (1, 20)})
        assert buckled.points[-1]["lam"] == pytest.approx(20, abs=1e-10)
        for point in buckled.points[1:]:
            angle = abs(point.system.states(point.x)[0, 0])
            assert point["lam"] == pytest.approx((2 * ellipk(math.sin(angle / 2) ** 2)) ** 2, rel=1e-10)
    with pytest.raises(ProblemError, match="between 0 and 1"):
        trace(first, branch=2)
    with pytest.raises(ProblemError, match="not a branch point"):
        trace(branch.points[0], branch=0)


def test_large_steps_pass_no_branch_point_silently():
    """Many buckling loads inside one step of 100: the count of singular values cuts the step down."""
    branch = trace(straight(), free=["lam"], limits={"lam": (1, 1000)}, step=100.0)
    expected = [(j * math.pi) ** 2 for j in range(1, 11)]
    assert [p["lam"] for p in branch.labelled("BP")] == pytest.approx(expected, rel=1e-6)


def test_diagram_of_the_elastica():
    """Every buckled branch once, both halves; the graph joins them at the three buckling loads."""
    result = diagram(straight(), free=["lam"], limits={"lam": (1, 95)}, depth=2, step=0.5)
    loads = [junction.point["lam"] for junction in result.junctions]
    assert loads == pytest.approx([(j * math.pi) ** 2 for j in (1, 2, 3)], rel=1e-8)
    assert len(result.branches) == 2 + 2 * 3
    graph = result.graph()
    assert all(graph.degree(f"BP{i}") == 4 for i in range(3))
    assert {data["label"] for _, data in graph.nodes(data=True)} == {"BP", "EP"}


def test_diagram_modulo_symmetry():
    """theta -> -theta and reversal map buckled halves to each other: each is followed once."""
    symmetries = [lambda t, u: -u, lambda t, u: u[::-1] * [1, -1]]
    result = diagram(straight(), free=["lam"], limits={"lam": (1, 95)}, depth=2, step=0.5, symmetries=symmetries)
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


def test_two_modes_at_once_are_reported():
    """Two uncoupled elasticas: a kernel of dimension two at every load, whose determinant does not change sign."""
    problem = BoundaryValueProblem(
        lambda t, u, p: (u.b, -p.lam * math.sin(u.a), u.d, -p.lam * math.sin(u.c)),
        lambda a, b, p: (a.b, b.b, a.d, b.d), ["a", "b", "c", "d"], {"lam": 5.0},
    )  # fmt: skip
    branch = trace(solve(problem, [0, 0, 0, 0], intervals=12, degree=6), free=["lam"], limits={"lam": (1, 50)}, step=1.0)
    points = branch.labelled("BP")
    assert [point["lam"] for point in points] == pytest.approx([math.pi**2, 4 * math.pi**2], rel=1e-6)
    for point in points:
        assert isinstance(point.details, MultiplePoint) and point.details.dimension == 2
        assert point.name == "kernel of dimension 2"


def test_pitchfork_with_cubic_terms_exactly():
    """mu x - x^3: tangents (0, 1) and (1, 0) at the origin, branch x^2 = mu."""
    problem = AlgebraicProblem(lambda u, p: (p.mu * u.x - u.x**3,), ["x"], {"mu": -1.0})
    branch = trace(solve(problem, [0.0]), free=["mu"], limits={"mu": (-2, 2)})
    (point,) = branch.labelled("BP")
    assert abs(point["mu"]) < 1e-14
    assert np.abs(point.details.tangents[1]) == pytest.approx([1, 0], abs=1e-12)
    fork = trace(point, branch=1, limits={"mu": (-2, 2)})
    assert all(p.x[0] ** 2 == pytest.approx(p["mu"], abs=1e-11) for p in fork)


def test_isolated_centre_is_no_branch_point_with_tangents():
    """x^2 + mu^2 = 0: the Hessian is definite, no branch leaves."""
    problem = AlgebraicProblem(lambda u, p: (u.x**2 + p.mu**2,), ["x"], {"mu": 0.0})
    system = solve_system(problem)
    found = locate_branch_point(system, np.array([0.01, -0.02]))
    assert found.tangents == () and np.abs(found.x).max() < 1e-12


def solve_system(problem):
    from contin import Algebraic

    return Algebraic(problem, ["mu"])


def test_no_branch_point_on_a_regular_curve():
    problem = AlgebraicProblem(lambda u, p: (u.x - p.mu,), ["x"], {"mu": 0.0})
    with pytest.raises(ConvergenceError):
        locate_branch_point(solve_system(problem), np.array([0.5, 0.5]))
