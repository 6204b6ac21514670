"""Solves with the bordered matrix of a cycle's round, against the whole matrix, filled entry by entry."""

import functools
import math
from fractions import Fraction

import numpy as np
import pytest

import contin
from contin import CycleProblem
from contin.collocation.round import monodromy_of
from contin.cycles.normal_forms import Round


def spread(u, p):
    """A circle with transverse rates -60 and 40: a round multiplies by 1e-164 and 1e109."""
    s = u.x**2 + u.y**2
    return u.x - u.y - u.x * s, u.x + u.y - u.y * s, -60 * u.a + u.x * u.b, 40 * u.b + u.a * u.y


def forced(t, u, p):
    return u.v, -0.1 * u.v - u.x - u.x**3 + p.f * math.cos(t)


def lorenz(u, p):
    return 10 * (u.y - u.x), p.r * u.x - u.y - u.x * u.z, u.x * u.y - 8 / 3 * u.z


def once_round(t):
    return math.cos(2 * math.pi * t), math.sin(2 * math.pi * t), 0, 0


@functools.cache
def cycle_of(name):
    if name == "spread":
        problem = CycleProblem(spread, ["x", "y", "a", "b"], {})
        return contin.solve(problem, once_round, {"period": 6.0}, degree=4)
    if name == "forced":
        problem = CycleProblem(forced, ["x", "v"], {"f": 0.3}, period=lambda p: 2 * math.pi)
        return contin.solve(problem, lambda t: (0.1, 0.0), degree=4)
    problem = CycleProblem(lorenz, ["x", "y", "z"], {"r": 330.0}, symmetry=[-1, -1, 1])
    return contin.solve(problem, contin.cycle(CycleProblem(lorenz, ["x", "y", "z"], {"r": 330.0}), [1.0, 1.0, 300.0]), degree=4)


@pytest.mark.parametrize("degree", range(2, 9))
def test_an_interval_is_as_long_as_the_growth_over_it_is_known(degree):
    """A Gauss method takes the Pade approximant of exp(z), which is off by 2e-5 of it: z is .4 for degree 2, 6.6 for 8."""
    problem = CycleProblem(lambda u, p: (-u.y, u.x), ["x", "y"], {})
    z = monodromy_of(problem.discretized(["period"], {"period": 6.0}, mesh=[0, 0.5, 1], degree=degree)).length
    d, whole = degree, Fraction(z)
    terms = [Fraction(math.comb(d, k) * math.factorial(2 * d - k), math.factorial(2 * d)) for k in range(d + 1)]
    above, below = (sum(term * (sign * whole) ** k for k, term in enumerate(terms)) for sign in (1, -1))
    assert 1e-5 < abs(math.log(above / below) - z) < 4e-5


def whole_matrix(system, x, phased, coupling, b, c):
    """The matrix that `contin.cycles.normal_forms` draws, dense."""
    states, n = system.state_size, system.states_count
    jacobian = system.rates_by_states(x, system.at_gauss_points(x))
    tables, h, by_point = system.basis, np.diff(system.mesh), jacobian.reshape(system.intervals, -1, n, n)
    local = np.einsum("qm,ab->qamb", tables.slope, np.eye(n)) - np.einsum("j,qm,jqab->jqamb", h, tables.value, by_point)
    matrices = local.reshape(len(h), -1, (system.degree + 1) * n)
    count, rows, columns = matrices.shape
    size, copies = states + phased, len(coupling)
    whole = np.zeros((copies * (size + 1), copies * (size + 1)), dtype=np.result_type(coupling, b, c))
    for i in range(copies):
        own = whole[i * size : (i + 1) * size, i * size : (i + 1) * size]
        for j in range(count):
            own[j * rows : (j + 1) * rows, j * rows : j * rows + columns] = matrices[j]
        own[states - n : states, states - n : states] = np.eye(n)
        for j in range(copies):
            whole[i * size + states - n : i * size + states, j * size : j * size + n] -= coupling[i, j] * system.turn
        if phased:
            own[: states - n, states] = system.parameter_columns(x, ("period",))[: states - n, 0]
            own[states, :n] = system.start_direction
        whole[i * size : (i + 1) * size, copies * size + i] = b
        whole[copies * size + i, i * size : (i + 1) * size] = c
    return whole


ANGLE = 0.7
COUPLINGS = {
    "doubling": -np.eye(1), "complex": np.array([[np.exp(1j * ANGLE)]]),
    "pair": np.array([[math.cos(ANGLE), math.cos(ANGLE) ** 2 - 1], [1.0, math.cos(ANGLE)]]),
}  # fmt: skip


@pytest.mark.sample(1)
@pytest.mark.parametrize("coupling", COUPLINGS)
@pytest.mark.parametrize(("name", "phased"), [("spread", False), ("spread", True), ("symmetric", True), ("forced", False)])
def test_against_the_whole_matrix(name, phased, coupling):
    point, coupling = cycle_of(name), COUPLINGS[coupling]
    around, random = Round(point.system, point.x, phased), np.random.default_rng(3)
    b, c = random.standard_normal((2, around.size))
    if np.iscomplexobj(coupling):
        b, c = b + 1j * random.standard_normal(around.size), c - 2j * random.standard_normal(around.size)
    whole = whole_matrix(point.system, point.x, phased, coupling, b, c)
    solver, right = around.solver(coupling, (b, c)), random.standard_normal(len(whole))
    for found, matrix in [(solver.solve(right), whole), (solver.solve_transposed(right), whole.T)]:
        expected = np.linalg.solve(matrix, right)
        assert np.abs(found - expected).max() < 1e-9 * np.abs(expected).max()
        size = np.abs(matrix).max() * np.abs(found).max()
        assert np.abs(matrix @ found - right).max() < 1e-12 * size


def test_without_border():
    point = cycle_of("spread")
    around = Round(point.system, point.x, phased=False).with_period()
    whole = whole_matrix(point.system, point.x, True, np.eye(1), 0.0, 0.0)[:-1, :-1]
    right = np.random.default_rng(4).standard_normal(len(whole))
    for found, matrix in [(around.solver(np.eye(1)).solve(right), whole),
                          (around.solver(np.eye(1)).solve_transposed(right), whole.T)]:  # fmt: skip
        assert np.abs(matrix @ found - right).max() < 1e-12 * np.abs(matrix).max() * np.abs(found).max()
