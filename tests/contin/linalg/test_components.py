"""States that fall into components are eliminated one by one; the matrix is the same as that of all together."""

import math

import numpy as np
import pytest

import contin.boundary.system
from contin import BoundaryValueProblem
from contin.boundary.system import Collocation


def _problem() -> BoundaryValueProblem:
    """Two pendulums and a heat equation that meet at the ends; ``c`` occurs between the ends, ``s`` at them, ``m`` in both."""

    def rhs(t, u, p):
        return u.b, -p.c * math.sin(u.a) + t, u.e, u.d * u.d - p.m, u.g * u.f, math.cos(u.f) + u.g

    def boundary(a, b, p):
        return a.a - p.s, b.a - a.d, b.b + a.e - p.m, b.d * b.d + a.f - 1, b.e - a.g, b.g + b.f - 0.3, a.b - 0.5

    return BoundaryValueProblem(
        rhs, boundary, ["a", "b", "d", "e", "f", "g"], {"c": 1.2, "s": 0.1, "m": 0.2},
        integrals=lambda t, u, p: (u.a * u.d + p.c * u.f, u.g * t - p.s),
    )  # fmt: skip


@pytest.fixture
def system():
    mesh = np.linspace(0, 1, 7) ** 1.2
    return Collocation(_problem(), mesh, 4, ["c", "s", "m"], {})


def _linearized(system, x, monkeypatch, apart):
    monkeypatch.setattr(contin.boundary.system, "_APART", 1 if apart else 1000)
    vars(system).pop("_components", None)
    rng = np.random.default_rng(3)
    columns = rng.standard_normal((2, system.equations))
    rows = rng.standard_normal((2 + system.size - system.equations, system.size + 2))
    return system.linearize(x, rows, columns)


def _away(system, seed):
    return 0.4 * np.random.default_rng(seed).standard_normal(system.size)


def test_it_is_the_matrix_of_all_states(system, monkeypatch):
    signs = []
    for seed in (1, 2, 4, 5, 7):
        x = _away(system, seed)
        residual, together = _linearized(system, x, monkeypatch, apart=False)
        same, apart = _linearized(system, x, monkeypatch, apart=True)
        assert [len(states) for states in system.separate_states] == [2, 2, 2]
        np.testing.assert_allclose(same, residual, atol=1e-14)
        right = np.random.default_rng(seed).standard_normal((3, system.size + 2))
        for solve in ("solve", "solve_transposed"):
            known = getattr(together, solve)(right)
            np.testing.assert_allclose(getattr(apart, solve)(right), known, atol=1e-9 * np.abs(known).max())
        np.testing.assert_allclose(apart.solve(right[0]), apart.solve(right)[0], atol=1e-10 * np.abs(known).max())
        signs.append(apart.sign * together.sign)
    assert set(signs) in ({1.0}, {-1.0})  # up to a factor that depends on the shape only


def test_the_transposed_product_belongs_to_the_matrix(system):
    """F_x^T w against differences of w.F, which are exact to h^2."""
    x, w = _away(system, 1), np.random.default_rng(9).standard_normal(system.equations)
    h, product = 1e-5, system.transposed_product(x, w)
    for i in range(0, system.size, 7):
        unit = np.zeros(system.size)
        unit[i] = h
        slope = w @ (system.residual(x + unit) - system.residual(x - unit)) / (2 * h)
        assert product[i] == pytest.approx(slope, abs=1e-7)


def test_what_is_not_finite_has_no_sign(system, monkeypatch):
    x = _away(system, 1)
    x[0] = np.nan
    _, factors = _linearized(system, x, monkeypatch, apart=True)
    assert not factors.sign > 0
    assert not factors.sign < 0
