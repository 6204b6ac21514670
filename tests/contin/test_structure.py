"""Which states depend on which: read off the recording, used by the elimination and by the Jacobian, which must not change by
it."""

import math

import numpy as np
import pytest

import contin
from contin.functions.batch import Batch
from contin.linalg.blocks import coupled_groups


def rod(t, u, p):
    """A planar elastica: the moment alone, the angle from it, the position from the angle."""
    return p.stiffness * u.m + t, u.m + 0.1 * math.sin(u.angle), math.cos(u.angle), math.sin(u.angle)


ROD = (["m", "angle", "x", "y"], ["stiffness"])


def pattern(function, states, parameters, **options):
    plain = Batch([function], [options.pop("count", len(states))], states, parameters, **options)
    return plain.depends.astype(int).tolist()


def test_what_depends_on_what():
    assert pattern(rod, *ROD) == [[1, 0, 0, 0, 1], [1, 1, 0, 0, 0], [0, 1, 0, 0, 0], [0, 1, 0, 0, 0]]


def test_functions_of_functions_and_arrays_are_followed():
    def square(x):
        return x * x

    def filled(t, u, p, out):
        out[0] = square(u[1])
        out[1] = np.exp(u[0]) * p[0]
        out[2] = 3.0

    assert pattern(filled, ["a", "b", "c"], ["k"]) == [[0, 1, 0, 0], [1, 0, 0, 1], [0, 0, 0, 0]]


DECIDES = {
    "a state": (lambda t, u, p: (u.a if u.b > 0 else u.c, u.a, u.b), [1, 0, 1, 0]),
    "an absolute value": (lambda t, u, p: (abs(u.a), u.a, u.b), [1, 0, 0, 0]),
    "the larger": (lambda t, u, p: (max(u.a, u.b), u.a, u.b), [1, 1, 0, 0]),
    "time": (lambda t, u, p: (u.a if t > 0.5 else u.b, u.a, u.b), [1, 1, 0, 0]),
    "a parameter": (lambda t, u, p: (u.a * p.k if p.k == 1 else u.b, u.a, u.b), [1, 1, 0, 1]),
    "truth": (lambda t, u, p: (u.a if u.b else u.c, u.a, u.b), [1, 0, 1, 0]),
    "float": (lambda t, u, p: (u.a * float(u.b), u.a, u.b), [1, 1, 0, 0]),
}


@pytest.mark.parametrize("case", DECIDES)
def test_a_function_that_decides_depends_on_what_any_path_reads(case):
    """All paths are recorded; the derivative by what decides is zero, or does not exist."""
    function, expected = DECIDES[case]
    assert pattern(function, ["a", "b", "c"], ["k"], count=3) == [expected, [1, 0, 0, 0], [0, 1, 0, 0]]


def test_of_a_function_evaluated_in_python_nothing_is_claimed():
    def catching(t, u, p):
        try:
            return u.a, u.b
        except ValueError:
            return u.b, u.a

    assert np.all(pattern(catching, ["a", "b"], ["k"]))


def problem():
    def rhs(t, u, p):
        return p.load * math.sin(u.b), u.a + 0.1 * u.c, u.a * u.b - u.c, math.cos(u.b) * p.load, u.d * u.c

    def boundary(u, v, p):
        return u.a - 0.2, v.b, u.c - 0.1, v.d - u.e, u.e - 0.3, v.e - p.target

    def integrals(t, u, p):
        return (u.c * u.d - p.mean,)

    parameters = {"load": 1.3, "target": 0.4, "mean": 0.2}
    return contin.BoundaryValueProblem(rhs, boundary, ["a", "b", "c", "d", "e"], parameters, integrals=integrals)


def test_jacobian_of_a_problem_in_groups_against_differences():
    """Solves with the factored matrix undo central differences of the residual (error of these about 1e-9)."""
    stated = problem()
    assert [len(group) for group in coupled_groups(stated.batch("field").depends[:5, :5])] == [3, 1, 1]
    assert stated.batch("field").columns([0]).rows.size == 13  # of 36
    random = np.random.default_rng(1)
    system = contin.lowlevel.Collocation(stated, np.array([0, 0.2, 0.5, 1.0]), 4, ["target", "load", "mean"], {})
    x, direction, row = random.standard_normal((3, system.size))
    left = random.standard_normal(system.equations)
    _, factors = system.linearize(x, (row,))
    change = (system.residual(x + 1e-6 * direction) - system.residual(x - 1e-6 * direction)) / 2e-6
    found = factors.solve(np.append(change, row @ direction))
    assert np.allclose(found, direction, atol=1e-6)
    product = system.transposed_product(x, left)
    assert product @ direction == pytest.approx(left @ change, rel=1e-8)
    assert np.allclose(factors.solve_transposed(product + 2 * row), [*left, 2], atol=1e-8)


def test_groups_change_nothing_but_round_off():
    """The same linearization with all states as one group, and with every input perturbed by itself."""
    random = np.random.default_rng(2)
    apart, together = problem(), problem()
    together.batch("field").__dict__["depends"] = np.ones((6, 8), bool)
    x, b = None, None
    solutions = []
    for stated in (apart, together):
        system = contin.lowlevel.Collocation(stated, np.linspace(0, 1, 6), 5, ["target", "load", "mean"], {})
        x = random.standard_normal(system.size) if x is None else x
        b = random.standard_normal((5, system.size)) if b is None else b
        _, factors = system.linearize(x, (np.ones(system.size),))
        solutions.append((factors.solve(b), factors.solve_transposed(b)))
    assert system._layout.offsets.tolist() == [0, 5]
    for one, other in zip(*solutions):
        assert np.allclose(one, other, rtol=0, atol=1e-11 * np.abs(one).max())
