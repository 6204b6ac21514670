"""Vector fields that fill an array: cycles from their Hopf points, diagrams, connections. Closed forms."""

import math

import numpy as np
import pytest

from contin import AlgebraicProblem, ConnectionProblem, CycleProblem, curve, diagram, solve, trace


def circle(u, p, out):
    """Cycles of radius sqrt(mu) and period 2 pi."""
    square = u[0] ** 2 + u[1] ** 2
    out[0] = p[0] * u[0] - u[1] - u[0] * square
    out[1] = u[0] + p[0] * u[1] - u[1] * square


def circle_of_arrays(u, p, out):
    out[:] = p[0] * u - (u @ u) * u
    out[0] -= u[1]
    out[1] += u[0]


def circle_without_out(u, p):
    turned = np.array([-u[1], u[0]])
    return p.mu * u - (u @ u) * u + turned


@pytest.mark.parametrize("field", [circle, circle_of_arrays, circle_without_out])
def test_cycles_from_a_hopf_point(field):
    problem = AlgebraicProblem(field, ["x", "y"], {"mu": -1.0})
    rest = trace(solve(problem, [0.0, 0.0]), free=["mu"], limits={"mu": (-1, 1)})
    cycles = trace(rest.labelled("HB")[0], branch=1, limits={"mu": (-1, 0.5)})
    assert cycles.points[-1]["max_x"] == pytest.approx(math.sqrt(0.5), rel=1e-9)
    assert cycles.points[-1]["period"] == pytest.approx(2 * math.pi, rel=1e-9)


def test_a_diagram_with_cycles():
    problem = AlgebraicProblem(circle, ["x", "y"], {"mu": -1.0})
    found = diagram(solve(problem, [0.0, 0.0]), free=["mu"], limits={"mu": (-1, 1)})
    assert max(branch.points[-1].parameters.get("period", 0.0) for branch in found.branches) == pytest.approx(2 * math.pi)


def test_a_stated_cycle_and_its_symmetry():
    for options in ({}, {"symmetry": [-1, -1]}):
        problem = CycleProblem(circle, ["x", "y"], {"mu": 0.25}, **options)
        orbit = solve(problem, lambda t: (0.6 * math.cos(2 * math.pi * t), 0.6 * math.sin(2 * math.pi * t)), {"period": 6})
        assert orbit["max_x"] == pytest.approx(0.5, rel=1e-9) and orbit["period"] == pytest.approx(2 * math.pi, rel=1e-9)


def test_a_forced_field():
    """x" + x = a cos(w t): x = a cos(w t) / (1 - w^2)."""

    def forced(t, u, p, out):
        out[0] = u[1]
        out[1] = -u[0] + p[0] * np.cos(p[1] * t)

    problem = CycleProblem(forced, ["x", "v"], {"a": 3.0, "w": 2.0}, period=lambda p: 2 * math.pi / p.w)
    assert solve(problem, [0.0, 0.0], degree=7)["max_x"] == pytest.approx(1.0, rel=1e-10)


def test_a_travelling_front():
    """The speed of Nagumo's front is (1 - 2 a) / sqrt(2)."""

    def field(u, p, out):
        out[0] = u[1]
        out[1] = p[1] * u[1] - u[0] * (1 - u[0]) * (u[0] - p[0])

    def guess(t):
        s = math.tanh(20 * (t - 0.5) / math.sqrt(8))
        return (1 + s) / 2, (1 - s**2) / math.sqrt(32)

    problem = ConnectionProblem(field, ["u", "v"], {"a": 0.25, "c": 0.3}, unstable=1, stable=1)
    assert solve(problem, guess, {"time": 40, "to_u": 1}, free=["c"])["c"] == pytest.approx(0.5 / math.sqrt(2), rel=1e-8)


def test_homoclinic_orbits_from_a_takens_bogdanov_point():
    """x' = y, y' = a + b y + x^2 + x y: folds at a = 0, the Takens-Bogdanov point at b = 0."""

    def field(u, p, out):
        out[0] = u[1]
        out[1] = p[0] + p[1] * u[1] + u[0] ** 2 + u[0] * u[1]

    fold = trace(solve(AlgebraicProblem(field, ["x", "y"], {"a": -1.0, "b": 2.0}), [1.0, 0.0]), free=["a"],
                 limits={"a": (-2, 1)}).labelled("LP")[0]  # fmt: skip
    (point,) = curve(fold, "b", direction=-1, limits={"b": (-1, 3)}).labelled("BT")
    assert abs(point["a"]) < 1e-10 and abs(point["b"]) < 1e-10
    assert len(curve(point, kind="homoclinic", limits={"b": (-1, 3)}, max_points=5)) > 4
