"""The adaptive mesh, for functions whose derivatives are known: density, equidistribution, number of intervals."""

import math

import numpy as np
import pytest

from bank.closed_forms import bratu
from contin import BoundaryValueProblem, MeshControl, Settings, solve, trace
from contin.collocation.mesh import adapted_mesh, density
from contin.lowlevel import Collocation, basis, point_of

DEGREES = range(2, 9)


def nodes(degree, mesh):
    """Return the nodes, at which the states are given."""
    inner = (mesh[:-1, None] + np.diff(mesh)[:, None] * basis(degree).nodes[:-1]).ravel()
    return np.append(inner, mesh[-1])


def sampled(degree, mesh, *functions):
    return np.stack([function(nodes(degree, mesh)) for function in functions], axis=1)


def irregular(intervals):
    """Intervals of which the largest is about three times the smallest."""
    mesh = np.append(0.0, np.cumsum(np.random.default_rng(1).uniform(0.5, 1.5, intervals)))
    return mesh / mesh[-1]


# --- density --------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("degree", DEGREES)
@pytest.mark.parametrize("size", [0.3, 40.0])
def test_density_of_a_polynomial_of_the_next_degree(degree, size):
    """size t^(d+1) on any mesh: the derivative of order d + 1 is size (d + 1)!, scaled by max(1, size)."""
    mesh = irregular(9)
    found = density(basis(degree), mesh, sampled(degree, mesh, lambda t: size * t ** (degree + 1)))
    exact = (math.factorial(degree + 1) * size / max(1, size)) ** (1 / (degree + 1))
    assert found == pytest.approx(np.full(9, exact), rel=1e-4)


@pytest.mark.parametrize("degree", DEGREES)
def test_density_of_a_polynomial_of_the_same_degree(degree):
    """Zero but for round-off, whose root of order d + 1 is not small: the same everywhere, not as round-off happens to be."""
    mesh = np.linspace(0, 1, 5)
    found = density(basis(degree), mesh, sampled(degree, mesh, lambda t: t**degree))
    assert np.ptp(found) == 0
    assert found[0] ** (degree + 1) < 1e-15 * 8**degree * math.factorial(degree + 1) * 100


@pytest.mark.parametrize("degree", [2, 4, 7])
def test_density_against_the_derivative(degree):
    """exp(4 t) / e^4, whose derivative of order d + 1 is 4^(d+1) times itself: first order in the interval, from above."""
    errors = []
    for intervals in (5, 10, 20) if degree == 7 else (20, 40, 80):  # more would be round-off
        mesh = np.linspace(0, 1, intervals + 1)
        found = density(basis(degree), mesh, sampled(degree, mesh, lambda t: np.exp(4 * t - 4)))
        middle = (mesh[1:] + mesh[:-1]) / 2
        errors.append(np.abs(found / (4 * np.exp((4 * middle - 4) / (degree + 1))) - 1).max())
        assert errors[-1] < 4 / intervals
    assert np.divide(errors[:-1], errors[1:]) == pytest.approx([2, 2], rel=0.2)


def test_the_largest_component_counts_each_at_its_own_scale():
    """A component of size 1e6 with the same relative derivative as one of size 1 does not hide that one."""
    mesh = np.linspace(0, 1, 21)
    small, large = (lambda t: np.sin(9 * t)), (lambda t: 1e6 * t)
    alone = density(basis(4), mesh, sampled(4, mesh, small))
    both = density(basis(4), mesh, sampled(4, mesh, large, small))
    assert both == pytest.approx(alone, rel=1e-6)


def test_one_interval_has_no_neighbour():
    assert density(basis(3), np.array([0.0, 1.0]), sampled(3, np.array([0.0, 1.0]), np.exp)).tolist() == [1.0]


# --- the adapted mesh -----------------------------------------------------------------------------------------------


def adapted(degree, mesh, function, **control):
    return adapted_mesh(basis(degree), mesh, sampled(degree, mesh, function), MeshControl(**control))


def test_the_mesh_equidistributes_the_density():
    """exp(15 t) in degree 4: the density goes as exp(3 t), so the mesh points lie at log(1 + share (e^3 - 1)) / 3."""
    mesh = np.linspace(0, 1, 201)
    new = adapted(4, mesh, lambda t: np.exp(15 * t - 15), min_intervals=40, max_intervals=40, tolerance=1e-3)
    exact = np.log(1 + np.linspace(0, 1, 41) * np.expm1(3)) / 3
    assert new == pytest.approx(exact, abs=2e-3)
    assert (new[0], new[-1]) == (0, 1)


def test_no_interval_grows_without_bound():
    """A narrow layer: where nothing happens the density is raised to a tenth of its mean, and the mean by a tenth at most."""
    mesh = np.linspace(0, 1, 1001)
    new = adapted(4, mesh, lambda t: np.tanh((t - 0.5) / 0.01), min_intervals=50, max_intervals=50)
    h = np.diff(new)
    assert 5 / 50 < h.max() < 11 / 50 and h.min() < 0.2 / 50


@pytest.mark.parametrize("degree", [3, 5, 7])
@pytest.mark.parametrize("tolerance", [1e-6, 1e-9, 1e-12])
def test_the_number_of_intervals_gives_the_wanted_error(degree, tolerance):
    """The error of interpolation between the nodes, measured on the new mesh, is the one that the tolerance stands for.

    It is larger by the error of the estimated derivative (20 %), or smaller because a small number of intervals is rounded up.
    """

    def function(t):
        return np.sin(20 * t)

    mesh = np.linspace(0, 1, {3: 4001, 5: 401, 7: 101}[degree])  # several times more than it takes
    new = adapted(degree, mesh, function, tolerance=tolerance)
    system = Collocation(_any_problem(), new, degree, [], {})
    fine = np.linspace(0, 1, 20001)
    error = np.abs(system.evaluate(function(system.nodes), fine)[:, 0] - function(fine)).max()
    wanted = 0.03 * tolerance ** ((degree + 1) / (2 * degree))
    assert wanted / 10 < error < 1.25 * wanted


def _any_problem():
    return BoundaryValueProblem(lambda t, u, p: (0.0 * u.u,), lambda a, b, p: (a.u,), ["u"], {"mu": 0.0})


@pytest.mark.parametrize("bounds", [{"max_intervals": 12}, {"min_intervals": 400}])
def test_bounds_on_the_number_of_intervals(bounds):
    mesh = np.linspace(0, 1, 101)
    (wanted,) = bounds.values()
    assert len(adapted(4, mesh, lambda t: np.sin(20 * t), **bounds)) == wanted + 1


def test_a_solution_without_derivatives_takes_the_fewest_intervals_all_alike():
    new = adapted(4, irregular(40), lambda t: 0 * t, min_intervals=9)
    assert new == pytest.approx(np.linspace(0, 1, 10), abs=1e-15)


def test_a_mesh_that_is_good_enough_stays():
    """An adapted mesh is not adapted again, nor one with half as many intervals again; one with three times as many is."""

    def function(t):
        return np.exp(4 * t - 4)

    new = adapted(5, np.linspace(0, 1, 101), function)

    def denser(factor):
        places = np.arange(len(new))
        return np.interp(np.linspace(0, places[-1], round(factor * places[-1]) + 1), places, new)

    assert adapted(5, new, function) is None
    assert adapted(5, denser(1.5), function) is None
    assert len(adapted(5, denser(3), function)) == pytest.approx(len(new), abs=2)


# --- in a run -------------------------------------------------------------------------------------------------------


def boundary_layer():
    """eps u'' + u u' - u = 0, u(0) = 1, u(1) = 3/2 (COLSYS's shock problem): a layer of width eps as eps shrinks."""
    return BoundaryValueProblem(
        lambda t, u, p: (u.v, (u.u - u.u * u.v) / p.eps), lambda a, b, p: (a.u - 1, b.u - 1.5), ["u", "v"], {"eps": 1.0}
    )


def test_the_mesh_follows_a_layer_and_the_number_of_intervals_the_tolerance():
    """The outer solution is u = t + 1/2 to the right of the layer (matched asymptotics), exact up to exp(-1/eps)."""
    system = Collocation(boundary_layer(), np.linspace(0, 1, 9), 5, ["eps"], {})
    start = np.stack([1 + system.nodes / 2, np.full_like(system.nodes, 0.5)], axis=1)
    x, slopes, counts = system.pack(start, {"eps": 1.0}), [], []
    for tolerance in (1e-9, 1e-12):
        settings = Settings(direction=-1, limits={"eps": (1e-3, 2)}, mesh=MeshControl(tolerance), max_step=0.3)
        end = trace(point_of(system, x), settings).points[-1]
        assert end["eps"] == pytest.approx(1e-3, abs=1e-12)
        h = np.diff(end.system.mesh)
        assert h.max() / h.min() > 10
        assert end.system.evaluate(end.x, np.array([0.5]))[0] == pytest.approx([1.0, 1.0], abs=1e-7)
        slopes.append(end.system.states(end.x)[0, 1])
        counts.append(end.system.intervals)
    assert counts[1] > counts[0]
    assert slopes[0] == pytest.approx(slopes[1], abs=1e-6)  # u'(0), inside the layer


def test_a_fixed_mesh_stays():
    assert solve(bratu(), [0, 0], intervals=3, degree=4, mesh=MeshControl(every=0)).system.intervals == 3
