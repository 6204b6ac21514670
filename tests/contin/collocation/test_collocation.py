"""The discrete problem: order of convergence, exact Jacobian, quadrature, another mesh."""

import functools
import math

import numpy as np
import pytest

import contin
from contin import AlgebraicProblem, BoundaryValueProblem, ProblemError
from contin.lowlevel import Collocation, correct


@functools.cache
def oscillator():
    """u'' = -w^2 u + nonlinear terms that vanish on u = sin(w t): a solution in closed form for a nonlinear problem."""

    def rhs(t, u, p):
        return u.v, -p.w * p.w * u.u + 3.0 * (u.u**2 + (u.v / p.w) ** 2 - 1) * u.v

    return BoundaryValueProblem(
        rhs, lambda a, b, p: (a.u, a.v - p.w), ["u", "v"], {"w": 3.0}, functionals={"square": lambda t, u, p: u.u**2}
    )


def solved(degree, intervals):
    problem = oscillator()
    system = Collocation(problem, np.linspace(0, 1, intervals + 1), degree, [], {})
    exact = np.stack([np.sin(3 * system.nodes), 3 * np.cos(3 * system.nodes)], axis=1)
    done = correct(system, system.pack(exact, {}))
    return system, done.x, exact


@pytest.mark.parametrize("degree", [2, 3, 4, 5])
def test_superconvergence_at_mesh_points(degree):
    """Error h^(2 degree) down to round-off (de Boor & Swartz 1973), against the closed form sin(3 t) and its derivative."""
    errors, counts = [], {2: (16, 32, 64, 128), 3: (6, 12, 24), 4: (4, 8, 16), 5: (4, 8)}[degree]
    for intervals in counts:
        system, x, exact = solved(degree, intervals)
        errors.append(np.abs(system.states(x) - exact)[::degree].max())
    orders = np.log2(np.array(errors[:-1]) / errors[1:])
    assert np.all(orders > 2 * degree - 0.6), (orders, errors)
    assert errors[-1] < 1e-7
    system, x, exact = solved(degree, {2: 2000, 3: 200, 4: 80, 5: 40}[degree])
    assert np.abs(system.states(x) - exact)[::degree].max() < (3e-12 if degree == 2 else 1e-12)


@pytest.mark.parametrize("degree", [6, 7, 8])
def test_high_degrees_reach_round_off_on_few_intervals(degree):
    system, x, exact = solved(degree, 8)
    assert np.abs(system.states(x) - exact)[::degree].max() < 5e-13


def test_functionals_converge_as_fast():
    """The mean of sin^2(3 t) over [0, 1] is 1/2 - sin(6) / 12."""
    exact = 0.5 - math.sin(6) / 12
    errors = [abs(system.functionals(x)[0] - exact) for system, x, _ in (solved(3, 6), solved(3, 12))]
    assert math.log2(errors[0] / errors[1]) > 5.4


@functools.cache
def bordered():
    """A problem with an integral condition, three free parameters and everything depending on everything."""
    return BoundaryValueProblem(
        lambda t, u, p: (u.v * p.a + t * u.u, -p.b * np.sin(u.u) + p.c * u.v**2),
        lambda a, b, p: (a.u - p.c, b.u * a.v - p.a, b.v * p.b - a.u),
        ["u", "v"], {"fixed": 2.0, "a": 1.0, "b": 1.5, "c": 0.3},
        integrals=lambda t, u, p: (u.u**2 * p.b - t * p.c,),
    )  # fmt: skip


def test_the_linearization_is_the_derivative_of_the_residual():
    problem = bordered()
    mesh = np.sort(np.append(np.random.default_rng(3).uniform(0, 1, 5), [0.0, 1.0]))
    system = Collocation(problem, mesh, 4, ["c", "a", "b"], {"fixed": 2.0})
    random = np.random.default_rng(4)
    x = random.standard_normal(system.size)
    rows, columns = random.standard_normal((2, system.size + 1)), random.standard_normal((1, system.equations))
    residual, factors = system.linearize(x, rows, columns)
    assert np.array_equal(residual, system.residual(x))
    jacobian = np.zeros((system.size + 1, system.size + 1))
    for j in range(system.size):
        step = np.zeros(system.size)
        step[j] = 1e-4
        jacobian[: system.equations, j] = (
            8 * (system.residual(x + step) - system.residual(x - step))
            - (system.residual(x + 2 * step) - system.residual(x - 2 * step))
        ) / 12e-4
    jacobian[: system.equations, system.size :] = columns.T
    jacobian[system.equations :] = rows
    b = random.standard_normal(system.size + 1)
    assert np.allclose(jacobian @ factors.solve(b), b, atol=1e-8)
    assert np.allclose(jacobian.T @ factors.solve_transposed(b), b, atol=1e-8)


def test_carrying_to_another_mesh_is_exact_for_polynomials():
    system, _, _ = solved(4, 6)
    nodes = system.nodes
    x = system.pack(np.stack([nodes**4 - nodes, 2 * nodes**3], axis=1), {})
    other, carry = system.on_mesh([0, 0.013, 0.4, 0.41, 0.9, 1.0])
    expected = np.stack([other.nodes**4 - other.nodes, 2 * other.nodes**3], axis=1)
    assert np.allclose(other.states(carry(x)), expected, atol=1e-14)
    for times in (other.nodes[::2], list(other.nodes[::2])):
        assert np.allclose(system.evaluate(x, times), expected[::2], atol=1e-14)


def test_nothing_that_was_computed_on_a_mesh_is_kept_on_another():
    """All numbers of a system that was used, on another mesh, are those of one that was made there."""
    rest = contin.solve(AlgebraicProblem(_unstable, ["x", "y"], {"a": -0.5}), [0.0, 0.0])
    (hopf,) = contin.trace(rest, free=["a"], limits={"a": (-1, 1)}).labelled("HB")
    used = contin.trace(hopf, branch=1, limits={"a": (-1, 0.2)}).points[-1]
    mesh = np.linspace(0, 1, 13) ** 1.5
    moved, carry = used.system.on_mesh(mesh)
    x, values = carry(used.x), dict(zip(moved.problem.parameters, moved.parameters))
    x.setflags(write=False)
    other = moved.with_reference(x)
    assert other.holds(x, 1e-12) and not other.holds(other.moved(x, 0.1), 1e-3)
    made = type(other)(other.problem, mesh, other.degree, other.free, values, other.scales).with_reference(x)
    row = (made.weights * x,)
    (residual, factors), (expected, there) = (system.linearize(x, row) for system in (other, made))
    assert np.array_equal(residual, expected) and np.array_equal(factors.solve(x), there.solve(x))
    columns = dict.fromkeys(other.problem.functionals, 0.0)
    assert other.discretization_error(x, factors, columns) == made.discretization_error(x, there, columns)
    assert np.array_equal(other.eigenvalues(x), made.eigenvalues(x))
    ends = [correct(system, x, row[0], row[0] @ x, within=np.inf) for system in (other, made)]
    assert np.array_equal(ends[0].x, ends[1].x) and np.array_equal(ends[0].tangent, ends[1].tangent)
    for name, value in vars(made).items():
        assert not isinstance(value, np.ndarray) or np.array_equal(value, getattr(other, name)), name


def _unstable(u, p):
    square = u.x**2 + u.y**2
    return p.a * u.x - u.y - u.x * square, u.x + p.a * u.y - u.y * square


def test_weights_are_those_of_the_mean_square():
    system, _, _ = solved(5, 7)
    x = system.pack(np.stack([system.nodes**2, system.nodes**4], axis=1), {})
    assert math.isclose((system.weights * x) @ x, 1 / 5 + 1 / 9, rel_tol=1e-14)


@pytest.mark.parametrize(
    ("mesh", "degree", "free", "said"),
    [
        ([0, 1], 1, [], "degree: 1"),
        ([0, 1], 9, [], "degree: 9"),
        ([0, 0.5, 0.5, 1], 3, [], "mesh"),
        ([0, 0.5], 3, [], "mesh"),
        ([0, 1], 3, ["nope"], "'nope' is not one of w"),
    ],
)
def test_bad_discretizations(mesh, degree, free, said):
    with pytest.raises(ProblemError, match=said):
        Collocation(oscillator(), mesh, degree, free, {})


def test_transposed_product_is_that_of_the_linearization():
    """w.(F_x v) = (F_x^T w).v, with F_x v from differences of the residual."""
    system = Collocation(bordered(), [0, 0.2, 0.5, 1], 3, ["c", "a", "b"], {"fixed": 2.0})
    random = np.random.default_rng(5)
    x, v, w = random.standard_normal(system.size), random.standard_normal(system.size), random.standard_normal(system.equations)
    h = 1e-4
    slope = (system.residual(x + h * v) - system.residual(x - h * v)) / (2 * h)
    assert system.transposed_product(x, w) @ v == pytest.approx(w @ slope, abs=1e-6)
