"""Newton's method on a mesh in one call, against the same in Python: the equations are the same, and the rules."""

import math

import numpy as np
import pytest

import contin
from contin import BoundaryValueProblem, CycleProblem
from contin.core import newton as newton_module
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


def system_of(make):
    point, free = make()
    system, x = point.system.with_free([*free, *([] if "period" not in point.system.free else ["period"])], point.x)
    return system, x


@pytest.mark.parametrize("make", [bratu, with_an_integral, scaled, cycles])
@pytest.mark.parametrize("off", [1e-3, 3e-2])
def test_the_same_as_in_python(make, off, monkeypatch):
    system, x = system_of(make)
    assert system.workspace is not None
    random = np.random.default_rng(1)
    row = system.weights * random.standard_normal(system.size)
    guess = x * (1 + off * random.standard_normal(x.size))
    found = correct(system, guess, row, row @ x, Newton(1e-10), linearize=True)
    again = correct(system, found.x * (1 + 1e-6), row, row @ x, Newton(1e-10), found.factors)
    monkeypatch.setattr(newton_module, "_in_one_call", lambda *_: None)
    expected = correct(system, guess, row, row @ x, Newton(1e-10))
    assert found.x == pytest.approx(expected.x, rel=1e-9, abs=1e-9) and found.iterations == expected.iterations
    assert again.x == pytest.approx(expected.x, rel=1e-9, abs=1e-9)
    tangent = system.linearize(found.x, (row,))[1].solve(np.append(np.zeros(system.equations), 1.0))
    assert found.tangent == pytest.approx(tangent / np.sqrt(system.weights @ tangent**2), abs=1e-9)
    assert found.factors.sign == system.linearize(found.x, (row,))[1].sign


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
