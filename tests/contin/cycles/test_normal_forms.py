"""First Lyapunov coefficients of Hopf points, and normal forms of bifurcations of cycles, against closed forms."""

import math

import numpy as np
import pytest

import contin
from contin import AlgebraicProblem


def circle(u, p):
    square = u.x**2 + u.y**2
    return p.mu * u.x - u.y - u.x * square, u.x + p.mu * u.y - u.y * square


def outside(u, p):
    square = u.x**2 + u.y**2
    return p.mu * u.x - u.y + u.x * square, u.x + p.mu * u.y + u.y * square


def brusselator(u, p):
    return p.a - (p.b + 1) * u.x + u.x**2 * u.y, p.b * u.x - u.x**2 * u.y


def lorenz(u, p):
    return 10 * (u.y - u.x), p.r * u.x - u.y - u.x * u.z, u.x * u.y - 8 / 3 * u.z


def waves(u, p):
    """Planar, with omega = 2 and functions that are no polynomials."""
    f = 0.3 * u.x * u.y + math.sin(u.x) - u.x + 0.5 * (math.exp(u.y) - 1 - u.y)
    g = math.cos(u.x + u.y) - 1 + 0.2 * u.x**2 * u.y
    return p.mu * u.x - 2 * u.y + f, 2 * u.x + p.mu * u.y + g


def hopf_of(field, states, parameter, first, **limits):
    problem = AlgebraicProblem(field, ["x", "y", "z"][: len(states)], {parameter: first, **limits.pop("parameters", {})})
    branch = contin.trace(contin.solve(problem, states), free=[parameter], limits={parameter: limits["limits"]})
    (point,) = branch.labelled("HB")
    return problem, branch, point


@pytest.mark.parametrize(("field", "coefficient", "kind"), [(circle, -2.0, "supercritical"), (outside, 2.0, "subcritical")])
def test_of_the_normal_form(field, coefficient, kind):
    """With |q| = 1 the radius is sqrt(2) |z|, so z' = (mu + i) z -+ 2 z |z|**2 and l1 = -+ 2."""
    _, _, point = hopf_of(field, [0, 0], "mu", -1.0, limits=(-1, 1))
    assert point.normal_form == pytest.approx(coefficient, abs=1e-9)
    assert abs(point.normal_form - coefficient) <= point.details["normal_form_error"] + 1e-12
    assert point.name == f"Hopf, {kind}"


@pytest.mark.parametrize("a", [0.5, 1.0, 2.0])
def test_of_the_brusselator(a):
    """From the definition, by sympy: l1 = -(2 + a**2) / (2 a (1 + 2 a**2)), with q = (a, -a + i) / sqrt(1 + 2 a**2)."""

    _, _, point = hopf_of(brusselator, [a, (0.5 + a * a) / a], "b", 0.5 + a * a, parameters={"a": a}, limits=(0.5, 8))
    assert point["b"] == pytest.approx(1 + a * a, abs=1e-10)
    assert point.normal_form == pytest.approx(-(2 + a * a) / (2 * a * (1 + 2 * a * a)), abs=1e-10)


def test_against_the_formula_for_planar_fields():
    """Guckenheimer & Holmes, equation (3.4.11), with the derivatives of ``waves`` by hand; r' = a r**3, so l1 = 2 a / omega."""
    _, _, point = hopf_of(waves, [0, 0], "mu", -1.0, limits=(-1, 1))
    third = -1 + 0 + 0.4 + 0  # f_xxx + f_xyy + g_xxy + g_yyy; the cosine is even
    f_xx, f_xy, f_yy, g_xx, g_xy, g_yy = 0.0, 0.3, 0.5, -1.0, -1.0, -1.0
    mixed = f_xy * (f_xx + f_yy) - g_xy * (g_xx + g_yy) - f_xx * g_xx + f_yy * g_yy
    assert point.normal_form == pytest.approx(2 / 2 * (third + mixed / 2) / 16, abs=1e-9)
    assert point.details["normal_form_error"] < 1e-9


def test_of_lorenz():
    """Subcritical (Marsden & McCracken 1976): the unstable cycles are at smaller r, where the equilibrium is stable."""
    rest = math.sqrt(8 / 3 * 19)
    _, _, point = hopf_of(lorenz, [rest, rest, 19.0], "r", 20.0, limits=(15, 30))
    cycles = contin.trace(point, branch=1, limits={"r": (20, 30)}, max_points=5)
    assert point.normal_form > 0 and cycles.points[-1]["r"] < point["r"]


def test_a_stored_hopf_point_starts_cycles(tmp_path):
    problem, branch, point = hopf_of(circle, [0, 0], "mu", -1.0, limits=(-1, 1))
    contin.save(branch, tmp_path / "line.npz")
    (loaded,) = contin.load(problem, tmp_path / "line.npz").labelled("HB")
    assert loaded.details == point.details and loaded.name == point.name
    object.__setattr__(loaded, "details", None)  # as in a file of an earlier version
    for start in (point, loaded):
        cycles = contin.trace(start, branch=1, limits={"mu": (-1, 0.25)})
        assert cycles.points[-1]["max_x"] == pytest.approx(0.5, abs=1e-10)


def test_the_coefficient_is_a_column():
    pytest.importorskip("pandas")
    _, branch, point = hopf_of(circle, [0, 0], "mu", -1.0, limits=(-1, 1))
    assert np.nanmin(branch.to_pandas()["normal_form"]) == point.normal_form
