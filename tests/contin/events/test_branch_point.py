"""Branch points: where they are, their tangents and kernels, against closed forms."""

import contextlib
import math

import numpy as np
import pytest

from bank.closed_forms import bratu, buckling_loads, elastica, parabola, pitchfork, two_elasticas
from contin import AlgebraicProblem, BoundaryValueProblem, ConvergenceError, MeshControl, Newton, solve, trace
from contin.lowlevel import Algebraic, Collocation, MultiplePoint, locate_branch_point


def test_branch_points_of_the_elastica():
    """Buckling at lam = (j pi)^2; the kernel holds cos(j pi t), and the equations are exactly symmetric."""
    branch = trace(solve(elastica(), [0, 0], intervals=12, degree=6), free=["lam"], limits={"lam": (1, 100)}, step=1)
    points = branch.labelled("BP")
    assert [point["lam"] for point in points] == pytest.approx(buckling_loads(3), abs=1e-8)
    for j, point in enumerate(points, 1):
        found, system = point.details, point.system
        assert len(found.tangents) == 2 and found.imperfection < 1e-12
        away = max(found.tangents, key=lambda tangent: abs(tangent[0]))
        angle = system.states(away)[:, 0]
        assert angle == pytest.approx(angle[0] * np.cos(j * math.pi * system.nodes), abs=1e-5)


@pytest.mark.parametrize(("degree", "intervals"), [(4, 20), (4, 80), (7, 32), (7, 64)])
def test_round_off_of_factors_is_no_error(degree, intervals):
    """Buckling of a clamped column at lam = (pi / 2)^2. Factors are off by 1e-16 for each of the mesh's intervals and more."""
    column = BoundaryValueProblem(
        lambda t, u, p: (u.v, -p.lam * np.sin(u.u)), lambda a, b, p: (a.u, b.v), ["u", "v"], {"lam": 1.0}
    )
    control = MeshControl(every=0)
    start = solve(column, [0.0, 0.0], degree=degree, intervals=intervals, mesh=control)
    (point,) = trace(start, free=["lam"], limits={"lam": (1, 4)}, mesh=control).labelled("BP")
    off = abs(point["lam"] - math.pi**2 / 4)
    assert off <= point.errors["lam"] < 5e-14 and off < 5e-15


def test_transcritical_point_has_the_two_tangents_of_the_algebraic_equation():
    """u (mu - u) = 0 for a constant state: at the origin the tangents are (0, 1) and (1, 1) / sqrt 2."""
    problem = BoundaryValueProblem(lambda t, u, p: (0.0 * u.u,), lambda a, b, p: (a.u * (p.mu - a.u),), ["u"], {"mu": 0.0})
    system = Collocation(problem, [0, 1], 2, ["mu"], {})
    found = locate_branch_point(system, np.array([0.02, 0.02, 0.02, -0.03]))
    assert np.abs(found.x).max() < 1e-12
    slopes = sorted(abs(tangent[0] / tangent[-1]) for tangent in found.tangents)
    assert slopes == pytest.approx([0, 1], abs=1e-7)


def test_pitchfork_with_cubic_terms_exactly():
    """mu x - x^3: tangents (0, 1) and (1, 0) at the origin, branch x^2 = mu."""
    branch = trace(solve(pitchfork(), [0.0]), free=["mu"], limits={"mu": (-2, 2)})
    (point,) = branch.labelled("BP")
    assert abs(point["mu"]) < 1e-14
    assert np.abs(point.details.tangents[0]) == pytest.approx([0, 1], abs=1e-12)
    assert np.abs(point.details.tangents[1]) == pytest.approx([1, 0], abs=1e-12)
    fork = trace(point, branch=1, limits={"mu": (-2, 2)})
    assert len(fork) > 5
    assert all(p.x[0] ** 2 == pytest.approx(p["mu"], abs=1e-11) for p in fork)


def test_isolated_centre_is_no_branch_point_with_tangents():
    """x^2 + mu^2 = 0: the Hessian is definite, no branch leaves."""
    problem = AlgebraicProblem(lambda u, p: (u.x**2 + p.mu**2,), ["x"], {"mu": 0.0})
    found = locate_branch_point(Algebraic(problem, ["mu"]), np.array([0.01, -0.02]))
    assert found.tangents == () and np.abs(found.x).max() < 1e-12


def regular_curves():
    """Systems on whose curves there is no branch point: a straight line, a parabola, Bratu's problem."""
    yield Algebraic(AlgebraicProblem(lambda u, p: (u.x - p.mu,), ["x"], {"mu": 0.0}), ["mu"])
    yield Algebraic(parabola(), ["mu"])
    yield Collocation(bratu(), np.linspace(0, 1, 11), 6, ["lam"], {})


@pytest.mark.parametrize("system", [*regular_curves()], ids=["straight line", "fold", "Bratu's problem"])
def test_no_branch_point_on_a_regular_curve(system):
    with pytest.raises(ConvergenceError, match="no branch point"):
        locate_branch_point(system, np.full(system.size, 0.1))


def test_first_huge_update_ends_the_search():
    """Where the gradient hardly changes along the kernel Newton's method leaps; each further step would be computed in vain."""
    problem = AlgebraicProblem(lambda u, p: (u.x + 1e-7 * (u.x * p.a) ** 2 + p.a,), ["x"], {"a": 0.3})
    system, places = Algebraic(problem, ["a"]), []
    linearize = system.linearize
    system.linearize = lambda x, *more: places.append(x) or linearize(x, *more)
    with pytest.raises(ConvergenceError, match="no branch point"):
        locate_branch_point(system, np.array([-0.3, 0.3]))
    assert np.abs(places).max() < 10


def test_large_steps_pass_no_branch_point_silently():
    """Many buckling loads inside one step of 100: the count of singular values cuts the step down."""
    start = solve(elastica(), [0, 0], intervals=12, degree=6)
    branch = trace(start, free=["lam"], limits={"lam": (1, 1000)}, step=100.0)
    assert [p["lam"] for p in branch.labelled("BP")] == pytest.approx(buckling_loads(10), rel=1e-6)


def test_two_modes_at_once_are_reported():
    """A kernel of dimension two at every load, whose determinant does not change sign."""
    start = solve(two_elasticas(), [0, 0, 0, 0], intervals=12, degree=6)
    points = trace(start, free=["lam"], limits={"lam": (1, 50)}, step=1.0).labelled("BP")
    assert [point["lam"] for point in points] == pytest.approx(buckling_loads(2), rel=1e-6)
    for point in points:
        assert isinstance(point.details, MultiplePoint) and point.details.dimension == 2
        assert point.name == "kernel of dimension 2"


@pytest.mark.parametrize("step", [0.05, 1.0, 2.0, 3.0])
def test_branches_that_pass_each_other_at_a_distance_do_not_cross(step):
    """(1 - p) x - 3/2 x^2 = p / 100 (Koiter): a fold at 0.783, and another branch beyond; a step of 2 lands on that one."""
    problem = AlgebraicProblem(lambda u, p: ((1 - p.load) * u.x - 1.5 * u.x**2 - 0.01 * p.load,), ["x"], {"load": 0.0})
    branch = trace(solve(problem, [0.0]), free=["load"], limits={"load": (-1, 2)}, step=step)
    assert [point.label for point in branch.points[1:] if point.label] == ["LP", "EP"]


def random_crossing(seed):
    """Two curves that cross at the origin, in other coordinates; the random numbers that follow."""
    random = np.random.default_rng(seed)
    linear, quadratic = np.eye(3) + 0.4 * random.standard_normal((3, 3)), 0.5 * random.standard_normal((3, 3, 3))
    bend, mixed = random.standard_normal(2)

    def equations(u, p):
        v = (u.x, u.y, p.a)
        w = [
            sum(linear[i, j] * v[j] for j in range(3))
            + sum(quadratic[i, j, k] * v[j] * v[k] for j in range(3) for k in range(3))
            for i in range(3)
        ]
        return w[0] * (w[2] - bend * w[0] - w[0] ** 2), w[1] + mixed * w[0] * w[2]

    return Algebraic(AlgebraicProblem(equations, ["x", "y"], {"a": 0.0}), ["a"]), random


@pytest.mark.full
@pytest.mark.parametrize("tolerance", [1e-4, 1e-6])
def test_what_is_left_is_below_the_tolerance_be_it_large(tolerance):
    """At the origin; other crossings are further away. After one update the next says little of what is left."""
    left = []
    for seed in range(60):
        system, random = random_crossing(seed)
        with contextlib.suppress(ConvergenceError):
            found = locate_branch_point(system, 0.03 * random.standard_normal(3), Newton(tolerance))
            left.append(np.abs(found.x).max())
    left = [distance for distance in left if distance < 1e-2]
    assert len(left) > 50 and max(left) < 3 * tolerance
