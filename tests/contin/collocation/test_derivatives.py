"""Exact derivatives of discretizations of second and third order, against differences of residual and transposed product."""

import math

import numpy as np
import pytest

from contin import AlgebraicProblem, BoundaryValueProblem, ConnectionProblem, CycleProblem, MapProblem
from contin.core.differences import derivative
from contin.core.protocol import Discretization
from contin.core.system import System

MESH = np.array([0, 0.3, 0.55, 1.0])


def boundary_value():
    problem = BoundaryValueProblem(
        lambda t, u, p: (u.v * p.a + t * u.u**2, math.sin(p.b * u.u) * u.v + math.exp(-u.u)),
        lambda a, b, p: (a.u * b.v + p.a**2 * b.u, a.v**3 - b.u * p.b),
        ["u", "v"], {"a": 0.7, "b": 0.4, "c": 1.1}, integrals=lambda t, u, p: (u.u**2 * u.v - p.c * p.a,),
        functionals={"work": lambda t, u, p: p.a * u.u**2 * u.v},
    )  # fmt: skip
    return problem.discretized(["c", "a"], {}, None, MESH, 3)


def scaled(system):
    x = 0.3 * np.random.default_rng(3).standard_normal(system.size)
    n, names = len(system.problem.states), system.problem.parameters
    return system.with_scales(x, 2.0 ** np.arange(-1, n - 1), 2.0 ** (np.arange(len(names)) - 1.0))[0]


def cycle(**options):
    problem = CycleProblem(
        lambda u, p: (p.mu * u.x - u.y - u.x**3 * p.c, u.x * (1 + u.y**2) + p.mu * u.y - u.y**3), ["x", "y"],
        {"mu": 0.4, "c": 1.2}, functionals={"work": lambda u, p: p.mu * u.x**2 * u.y}, **options,
    )  # fmt: skip
    system = problem.discretized(["mu", "period"], {"period": 3.0}, None, MESH, 3)
    return system.with_reference(
        system.pack(np.random.default_rng(9).standard_normal((system.nodes.size, 2)), problem.parameters)
    )


def forced():
    problem = CycleProblem(
        lambda t, u, p: (u.y, -u.x**3 - p.c * u.y + p.a * math.cos(p.w * t)), ["x", "y"], {"a": 0.4, "c": 1.2, "w": 1.3},
        period=lambda p: 2 * math.pi / p.w,
    )  # fmt: skip
    return problem.discretized(["w"], {}, None, MESH, 3)


def connection(stable):
    """Three states; the equilibria and all parameters are away from a solution, where all terms count."""

    def field(u, p):
        return u.v + p.a * u.w * u.u, p.c * u.v - u.u * (1 - u.u) * (u.u - p.a), -2 * u.w + u.u * u.v * p.c + u.w**2

    problem = ConnectionProblem(field, ["u", "v", "w"], {"a": 0.25, "c": 0.3}, unstable=1, stable=stable)
    ends = dict(zip(problem.multipliers, (0.1, 0.05, -0.1, 1.1, 0.05, 0.1)))  # near saddles
    system = problem.discretized(["a", "c", *problem.multipliers], {"time": 2.0, **ends}, None, MESH, 3)
    x = system.pack(np.random.default_rng(9).standard_normal((system.nodes.size, 3)) / 4, {**problem.parameters, **ends})
    return system.with_reference(x), x


def equations():
    problem = AlgebraicProblem(
        lambda u, p: (u.x**2 * u.y - p.a * math.exp(u.x), math.sin(u.x * u.y) + p.a**2 * u.y), ["x", "y"], {"a": 0.4, "b": 1.0},
        functionals={"work": lambda u, p: p.a * u.x**2 * u.y},
    )  # fmt: skip
    return problem.discretized(["a"], {})


def henon():
    problem = MapProblem(
        lambda u, p: (1 - p.a * u.x**2 + u.y, p.b * math.sin(u.x)), ["x", "y"], {"a": 0.6, "b": 0.3},
        functionals={"work": lambda u, p: p.a * u.x**2 * u.y},
    )  # fmt: skip
    return problem.discretized(["a", "b"], {"rounds": 3})


SYSTEMS = {
    "boundary value": boundary_value, "boundary value, scaled": lambda: scaled(boundary_value()),
    "cycle": cycle, "cycle, scaled": lambda: scaled(cycle()), "symmetric cycle": lambda: cycle(symmetry=[-1, -1]),
    "forced": forced, "homoclinic": lambda: connection(None), "heteroclinic": lambda: connection(2),
    "heteroclinic, scaled": lambda: scaled_connection(),
    "equations": equations, "equations, scaled": lambda: scaled(equations()), "map": henon,
}  # fmt: skip


def scaled_connection():
    system, x = connection(2)
    count = len(system.problem.parameters)
    return system.with_scales(x, np.array([2.0, 0.5, 4.0]), 2.0 ** (np.arange(count) % 3 - 1.0))


def prepared(name):
    made, random = SYSTEMS[name](), np.random.default_rng(17)
    system, x = made if isinstance(made, tuple) else (made, None)
    if x is None:
        x = 0.5 * random.standard_normal(system.size)
    vectors = [0.3 * random.standard_normal(system.size) for _ in range(3)]
    return system, x, vectors, random.standard_normal(system.equations)


@pytest.mark.sample(4)
@pytest.mark.parametrize("name", SYSTEMS)
def test_derivatives_along_directions(name):
    """Differences of the residual, of fourth order, along lines through x."""
    system, x, (a, b, c), _ = prepared(name)
    for directions, error in (((a, b), 1e-7), ((a, b, c), 1e-5)):
        expected = Discretization.along(system, x, directions)
        found = system.along(x, directions)
        assert np.abs(expected).max() > 1e-3
        assert found == pytest.approx(expected, abs=error * np.abs(expected).max())


@pytest.mark.sample(4)
@pytest.mark.parametrize("name", SYSTEMS)
def test_bent_is_the_derivative_of_the_transposed_product(name):
    system, x, (a, b, _), w = prepared(name)
    found, expected = system.bent(x, w, a), Discretization.bent(system, x, w, a)
    assert found == pytest.approx(expected, abs=1e-7 * np.abs(expected).max())  # error of the differences
    assert found @ b == pytest.approx(w @ system.along(x, [a, b]), rel=1e-11)  # exactly the same number


@pytest.mark.parametrize(
    "name", ["boundary value", "boundary value, scaled", "cycle", "cycle, scaled", "equations", "equations, scaled", "map"]
)
def test_second_derivatives_of_columns(name):
    system, x, (a, _, _), _ = prepared(name)
    expected = System.column_bent(system, x, "work", a)
    assert system.column_bent(x, "work", a) == pytest.approx(expected, abs=1e-9 * np.abs(expected).max())
    assert not system.column_bent(x, system.free[0], a).any()


def test_a_column_with_an_infinite_slope_leaves_the_others_alone():
    functionals = {"root": lambda u, p: math.sqrt(u.x), "double": lambda u, p: 2 * u.x}
    system = AlgebraicProblem(lambda u, p: (u.x - p.a,), ["x"], {"a": 0.0}, functionals).discretized(["a"], {})
    with np.errstate(all="ignore"):
        assert system.column_gradient(np.zeros(2), "double") == pytest.approx([2, 0], rel=1e-14)


@pytest.mark.parametrize("order", [1, 2, 3])
@pytest.mark.parametrize("width", [1.0, 1e-3])
def test_differences_know_their_error(order, width):
    """Derivatives of sin((1 + s) / width), by hand."""
    value, error = derivative(lambda s: math.sin(1 + s / width), order)
    exact = [math.cos(1), -math.sin(1), -math.cos(1)][order - 1] / width**order
    assert abs(value - exact) < error < 1e-4 * abs(exact)


@pytest.mark.parametrize("order", [2, 3])
def test_differences_of_a_function_that_is_zero_there(order):
    """Its round-off is that of its terms: lengths are not shortened into it."""
    for a in np.random.default_rng(0).uniform(1, 2, 200):
        value, _ = derivative(lambda s: (a + s) ** (order - 1) - a ** (order - 1), order)  # noqa: B023
        assert abs(value) < 1e-7
