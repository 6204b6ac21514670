"""Multiple points: seen, located, passed, and left along every branch.

Three Bratu cells in a ring, u_i'' = -lam exp(u_i) - (u_{i-1} + u_{i+1} - 2 u_i) / 2 with zero ends. On the branch of equal
cells u = 2 log(cosh q / cosh(q (1 - 2 x))), lam = 8 q^2 / cosh^2 q. A mode that sums to zero obeys v'' + (8 q^2 sech^2 - 3/2)
v = 0, whose even solution (Pöschl & Teller 1933) vanishes at the ends where q tanh q = s / tanh s, s = sqrt(3/2) / 2: a double
branch point.
"""

import itertools
import math

import numpy as np
import pytest
from scipy.optimize import brentq

import contin

S = math.sqrt(1.5) / 2
Q = brentq(lambda q: q * math.tanh(q) - S / math.tanh(S), 1.0, 2.0, xtol=1e-15)
DOUBLE = 8 * Q**2 / math.cosh(Q) ** 2
LIMITS = {"lam": (0, 4), "mean": (-1, 15)}


def rhs(t, u, p):
    a, b, c = u.u1, u.u2, u.u3
    return (
        u.v1, u.v2, u.v3,
        -p.lam * math.exp(a) - (c + b - 2 * a) / 2,
        -p.lam * math.exp(b) - (a + c - 2 * b) / 2,
        -p.lam * math.exp(c) - (b + a - 2 * c) / 2,
    )  # fmt: skip


RING = contin.BoundaryValueProblem(
    rhs, lambda a, b, p: (a.u1, a.u2, a.u3, b.u1, b.u2, b.u3), ["u1", "u2", "u3", "v1", "v2", "v3"], {"lam": 0.0},
    functionals={"mean": lambda t, u, p: u.u1 + u.u2 + u.u3, "one": lambda t, u, p: u.u1, "two": lambda t, u, p: u.u2,
                 "three": lambda t, u, p: u.u3},
)  # fmt: skip


@pytest.fixture(scope="module")
def equal():
    return contin.trace(contin.solve(RING, [0] * 6), free=["lam"], limits=LIMITS)


def test_the_run_passes_a_double_branch_point(equal):
    assert [point.label for point in equal if point.label] == ["EP", "LP", "BP", "EP"]
    (point,) = equal.labelled("BP")
    assert point.details.dimension == 2 and not point.details.continuum
    assert abs(point["lam"] - DOUBLE) < max(10 * point.errors["lam"], 1e-12) < 1e-9


@pytest.mark.full
def test_every_branch_is_left_both_ways(equal):
    """Four lines meet: equal cells, and for each cell two others that stay equal to each other (the triangle's reflections)."""
    (point,) = equal.labelled("BP")
    assert len(point.details.tangents) == 4
    apart = set()
    for branch, direction in itertools.product(range(4), (1, -1)):
        ahead = contin.trace(point, branch=branch, direction=direction, limits=LIMITS, max_points=8)
        assert ahead.stop.reason == "max points"
        one, two, three = (ahead.points[-1][name] for name in ("one", "two", "three"))
        pairs = [abs(a - b) < 1e-9 for a, b in ((one, two), (two, three), (three, one))]
        assert sum(pairs) == (3 if branch == 0 else 1)
        apart.add((branch == 0, pairs.index(True), min(one, two, three) < max(one, two, three) - 1e-9))
    assert len({which for first, which, _ in apart if not first}) == 3


@pytest.mark.full
def test_a_diagram_follows_one_branch_of_each_conjugacy_class(equal):
    """The triangle's rotations and reflections turn the three lines into each other: two half-branches are left to follow."""

    def rotated(t, states):
        return states[:, [1, 2, 0, 4, 5, 3]]

    def reflected(t, states):
        return states[:, [1, 0, 2, 4, 3, 5]]

    def twice(t, states):
        return rotated(t, rotated(t, states))

    symmetries = [rotated, twice, reflected, lambda t, u: rotated(t, reflected(t, u)), lambda t, u: twice(t, reflected(t, u))]
    result = contin.diagram(equal.points[0], limits={"lam": (0, 4), "mean": (-1, 4)}, depth=1, symmetries=symmetries)
    (junction,) = [
        junction for junction in result.junctions if isinstance(junction.point.details, contin.lowlevel.MultiplePoint)
    ]
    assert all(set(taken) == {1, -1} for taken in junction.taken)
    assert len({number for taken in junction.taken[1:] for number in taken.values()}) == 2


def test_a_stored_multiple_point_is_left_after_reading(equal, tmp_path):
    contin.save(equal, tmp_path / "equal.npz")
    (point,) = contin.load(RING, tmp_path / "equal.npz").labelled("BP")
    ahead = contin.trace(point, branch=1, limits=LIMITS, max_points=4)
    assert len({round(ahead.points[-1][name], 6) for name in ("one", "two", "three")}) == 2


def test_two_close_branch_points_are_no_double_one():
    """x and y leave zero at a = 0 and a = 1e-3, in one default step."""
    problem = contin.AlgebraicProblem(
        lambda u, p: (u.x * (p.a - u.x**2), u.y * (p.a - 1e-3 - u.y**2)), ["x", "y"], {"a": -1.0}, dynamics=False
    )
    branch = contin.trace(contin.solve(problem, [0.0, 0.0]), free=["a"], limits={"a": (-1, 1)})
    assert [point["a"] for point in branch.labelled("BP")] == pytest.approx([0, 1e-3], abs=1e-12)


def test_cubic_bifurcation_equations():
    """x (a - x^2 - 2 y^2) = y (a - y^2 - 2 x^2) = 0, the square's symmetry: trivial, two axes, two diagonals."""
    problem = contin.AlgebraicProblem(
        lambda u, p: (u.x * (p.a - u.x**2 - 2 * u.y**2), u.y * (p.a - u.y**2 - 2 * u.x**2)),
        ["x", "y"],
        {"a": -1.0},
        dynamics=False,
    )
    branch = contin.trace(contin.solve(problem, [0.0, 0.0]), free=["a"], limits={"a": (-1, 1)})
    (point,) = branch.labelled("BP")
    assert abs(point["a"]) < 1e-9 and len(point.details.tangents) == 5
    ends = [contin.trace(point, branch=i, limits={"a": (-1, 0.5)}).points[-1] for i in range(1, 5)]
    squares = sorted((round(end.x[0] ** 2, 9), round(end.x[1] ** 2, 9)) for end in ends)
    sixth = round(1 / 6, 9)
    assert squares == [(0, 0.5), (sixth, sixth), (sixth, sixth), (0.5, 0)]


def test_a_circle_of_branches_is_said_to_be_one():
    """(x, y) (a - x^2 - y^2) = 0: every direction is a branch."""
    problem = contin.AlgebraicProblem(
        lambda u, p: (u.x * (p.a - u.x**2 - u.y**2), u.y * (p.a - u.x**2 - u.y**2)), ["x", "y"], {"a": -1.0}, dynamics=False
    )
    branch = contin.trace(contin.solve(problem, [0.0, 0.0]), free=["a"], limits={"a": (-1, 1)})
    (point,) = branch.labelled("BP")
    assert abs(point["a"]) < 1e-9 and point.details.continuum and branch.stop.reason == "limit"


@pytest.mark.sample(1)
@pytest.mark.parametrize("seed", range(3))
def test_the_error_of_a_cluster_reaches_its_ends(seed):
    """Eigenvalues that differ by 3e-6 are found as one point, moved off the branch by Gauss-Newton: both are within its ±."""
    random, gap = np.random.default_rng(seed), 3e-6
    basis = np.eye(4) + 0.15 * random.standard_normal((4, 4))
    matrix = basis @ np.diag([1, 1 + gap, 2, 3]) @ np.linalg.inv(basis)
    problem = contin.AlgebraicProblem(lambda u, p: p.lam * u + u * u - u**3 - matrix @ u, 4, {"lam": 0.0})
    branch = contin.trace(contin.solve(problem, [0.0] * 4), free=["lam"], limits={"lam": (-1, 1.5)}, step=0.5)
    (point,) = branch.labelled("BP")
    assert point.details.dimension == 2
    furthest = max(abs(point["lam"] - 1), abs(point["lam"] - 1 - gap))
    assert furthest < 1.001 * point.errors["lam"] < 3e-6
