"""Newton's method on a mesh in one call, against the same in Python: the equations are the same, and the rules."""

import math

import numpy as np
import pytest

import contin
from contin import BoundaryValueProblem, ConnectionProblem, CycleProblem
from contin.collocation.newton import CONVERGED, STAGNATES, Control, correct_on_mesh
from contin.core.newton import Newton, correct


def bratu():
    problem = BoundaryValueProblem(
        lambda t, u, p: (u.v, -p.lam * np.exp(u.u)), lambda a, b, p: (a.u, b.u), ["u", "v"], {"lam": 0.5}
    )
    return contin.solve(problem, lambda t: (0.1, 0.0)), ["lam"]


def with_an_integral():
    problem = BoundaryValueProblem(
        lambda t, u, p: (u.v, -p.lam * np.exp(u.u)), lambda a, b, p: (a.u, b.u), ["u", "v"], {"lam": 0.5, "mean": 0.0},
        integrals=lambda t, u, p: (u.u - p.mean,),
    )  # fmt: skip
    return contin.solve(problem, lambda t: (0.1, 0.0), free=["mean"]), ["lam", "mean"]


def scaled():
    problem = BoundaryValueProblem(
        lambda t, u, p: (u.v, -p.q * u.u / 1e10), lambda a, b, p: (a.u - 2e5, b.u + p.q / 1e4), ["u", "v"], {"q": 3e9}
    )
    return contin.solve(problem, lambda t: (2e5, 0.0)), ["q"]


def cycles():
    def rhs(u, p):
        square = u.x**2 + u.y**2
        return u.x - u.y - u.x * square + p.a * u.x**2, u.x + u.y - u.y * square

    problem = CycleProblem(rhs, ["x", "y"], {"a": 0.1})
    return contin.solve(problem, lambda t: (math.cos(2 * math.pi * t), math.sin(2 * math.pi * t)), {"period": 6.3}), ["a"]


def front():
    """Three states and both ends apart: one projection condition at the first end, two at the last; `loop` has two and one."""
    problem = ConnectionProblem(
        lambda u, p: (u.v, p.c * u.v - u.u * (1 - u.u) * (u.u - p.a) + p.b * u.w, u.w + p.b * u.u * (1 - u.u)),
        ["u", "v", "w"], {"a": 0.25, "c": 0.3, "b": 0.0}, unstable=2, stable=1,
    )  # fmt: skip

    def guess(t):
        s = math.tanh(20 * (t - 0.5) / math.sqrt(8))
        return (1 + s) / 2, (1 - s**2) / math.sqrt(32), 0.0

    front = contin.solve(problem, guess, {"time": 40, "to_u": 1}, free=["c"])
    return contin.trace(front, free=["b", "c"], limits={"b": (-1, 0.1)}).points[-1], ["a", "c", *problem.multipliers]


def loop():
    values = {"a": 0.1, "b": 1.0, "alpha": 0.1, "beta": 1.0, "gamma": 0.0, "mu": 0.0, "nu": 0.0}

    def leaf(u, p):
        leaf = p.nu - p.alpha * u.z
        return (
            p.a * u.x + p.b * u.y - p.a * u.x**2 + leaf * u.x * (2 - 3 * u.x),
            p.b * u.x + p.a * u.y - 1.5 * p.b * u.x**2 - 1.5 * p.a * u.x * u.y - 2 * leaf * u.y,
            -2 * u.z + p.mu * u.x + p.gamma * u.x * u.z + p.alpha * p.beta * (u.x**2 * (1 - u.x) - u.y**2),
        )

    def guess(t):
        x = 1 / math.cosh(10 * (t - 0.5)) ** 2
        return x, -x * math.tanh(10 * (t - 0.5)), 0.0

    problem = ConnectionProblem(leaf, ["x", "y", "z"], values, unstable=1)
    return contin.solve(problem, guess, {"time": 20}, free=["nu"]), ["a", "nu", *problem.multipliers]


def system_of(make):
    point, free = make()
    system, x = point.system.with_free([*free, *([] if "period" not in point.system.free else ["period"])], point.x)
    return system, x


@pytest.mark.sample(4)
@pytest.mark.parametrize("make", [bratu, with_an_integral, scaled, cycles, front, loop])
@pytest.mark.parametrize("off", [1e-3, 3e-2])
def test_the_same_as_in_python(make, off, monkeypatch):
    system, x = system_of(make)
    assert system.workspace is not None
    random = np.random.default_rng(1)
    row = system.weights * random.standard_normal(system.size)
    guess = x * (1 + off * random.standard_normal(x.size))
    found = correct(system, guess, row, row @ x, Newton(1e-10), within=np.inf)
    again = correct(system, found.x * (1 + 1e-6), row, row @ x, Newton(1e-10), found.factors)
    monkeypatch.setattr(type(system), "workspace", None)
    expected = correct(system, guess, row, row @ x, Newton(1e-10))
    assert found.x == pytest.approx(expected.x, rel=1e-9, abs=1e-9) and found.iterations == expected.iterations
    assert again.x == pytest.approx(expected.x, rel=1e-9, abs=1e-9)
    tangent = system.linearize(found.x, (row,))[1].solve(np.append(np.zeros(system.equations), 1.0))
    assert found.tangent == pytest.approx(tangent / np.sqrt(system.weights @ tangent**2), abs=1e-9)
    assert found.factors.sign == system.linearize(found.x, (row,))[1].sign


@pytest.mark.parametrize("make", [with_an_integral, scaled, cycles])
def test_a_bordered_matrix_of_one_call(make, monkeypatch):
    """Residual, solutions and the sign of the determinant are those of blocks that Python fills."""
    system, x = system_of(make)
    random = np.random.default_rng(4)
    rows, column = random.standard_normal((2, system.size + 1)), random.standard_normal((1, system.equations))
    residual, factors = system.linearize(x, rows, column)
    monkeypatch.setattr(type(system), "workspace", None)
    wanted, expected = system.linearize(x, rows, column)
    right = random.standard_normal(system.size + 1)
    assert residual == pytest.approx(wanted, abs=1e-13) and factors.sign == expected.sign
    assert factors.solve(right) == pytest.approx(expected.solve(right), rel=1e-9)
    assert factors.solve_transposed(right) == pytest.approx(expected.solve_transposed(right), rel=1e-9)


def test_conditions_of_the_call_count():
    """A system with another reference of the phase shares the work space: each call takes its own row."""
    system, x = system_of(cycles)
    row = np.zeros(system.size)
    row[system.parameter_index("a")] = 1.0
    first = correct(system, x, row, 0.1, Newton(1e-11))
    turned = system.with_reference(np.append(np.roll(system.states(x)[:-1], 5, axis=0).ravel(), x[system.state_size - 2 :]))
    other = correct(turned, x, row, 0.1, Newton(1e-11))
    assert np.abs(turned.residual(other.x)).max() < 1e-9 and np.abs(other.x - first.x).max() > 1e-2
    assert np.abs(system.residual(correct(system, x, row, 0.1, Newton(1e-11)).x)).max() < 1e-9


@pytest.mark.full
@pytest.mark.parametrize("make", [front, loop])
def test_projection_conditions_are_those_of_python(make):
    system, x = system_of(make)
    moved = x + 1e-3 * np.random.default_rng(2).standard_normal(x.size)
    values, rows = system.conditions_with_rows(moved)
    room, own = system.workspace.values, system.fill_conditions(system.workspace.values)
    room.rows[-1] = system.weights
    given = system.unfilled_factors().room, Control(1e-12, 0, 0, 1), moved, system.weights, np.empty(x.size), np.empty(10)
    assert correct_on_mesh(system.workspace, *given) == CONVERGED
    assert room.projections.values == pytest.approx(values[:-1], abs=1e-14) and len(values) == own
    assert np.abs(room.rows[:own] - rows).max() < 1e-12


@pytest.mark.full
def test_python_decides_where_other_eigenvalues_would_be_met():
    """Near a reference that is none, the space that Newton's method finds is not that of the least eigenvalues."""
    system, x = system_of(front)
    room = system.workspace.values
    system.fill_conditions(room)
    room.projections.first.frame[:] = room.projections.first.frame[::-1].copy()
    given = system.unfilled_factors().room, Control(1e-12, 5, 0, 0), x.copy(), system.weights, np.empty(x.size), np.empty(20)
    assert correct_on_mesh(system.workspace, *given) == STAGNATES
