"""First Lyapunov coefficients of Hopf points, and normal forms of bifurcations of cycles, against closed forms."""

import math
import tracemalloc
from typing import NamedTuple

import numpy as np
import pytest

import contin
from contin import AlgebraicProblem, CycleProblem
from contin.events.normal_forms import coefficient, pair


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


def once_round(t):
    return math.cos(2 * math.pi * t), math.sin(2 * math.pi * t), 0, 0


def moebius(u, p):
    """A cycle r = 1 with a direction that turns by half a turn in a round: w = (p + i q) exp(i theta / 2).

    p' = (mu - s p**2 + k (r**2 - 1) / 2) p, q' = -q, theta' = 1 + g p**2 and r' = r (1 - r**2 + h p**2), but for the factor r
    that stands before (1 + mu) / 2 of the linear terms.
    """
    square, size = u.x**2 + u.y**2, u.a**2 + u.b**2
    part = ((u.a**2 - u.b**2) * u.x + 2 * u.a * u.b * u.y + size) / 2  # p**2, where r = 1
    mirrored = u.x * u.a + u.y * u.b, u.y * u.a - u.x * u.b  # exp(i theta) times the conjugate of w
    turn, growth, both, other = 1 + p.g * part, 1 - square + p.h * part, (p.mu - 1) / 2, (p.mu + 1) / 2
    cubic = -p.s * part + p.k * (square - 1) / 2
    return (
        growth * u.x - turn * u.y, turn * u.x + growth * u.y,
        -turn * u.b / 2 + both * u.a + other * mirrored[0] + cubic * (u.a + mirrored[0]) / 2,
        turn * u.a / 2 + both * u.b + other * mirrored[1] + cubic * (u.b + mirrored[1]) / 2,
    )  # fmt: skip


def spiral(u, p):
    """A cycle r = 1, and w' = (mu + .3 i + (.4 i - s) |w|**2 + k (r**2 - 1) / 2) w; r and theta as in ``moebius``."""
    square, size = u.x**2 + u.y**2, u.a**2 + u.b**2
    turn, growth = 1 + p.g * size, 1 - square + p.h * size
    rate, angle = p.mu - p.s * size + p.k * (square - 1) / 2, 0.3 + 0.4 * size
    return growth * u.x - turn * u.y, turn * u.x + growth * u.y, rate * u.a - angle * u.b, angle * u.a + rate * u.b


class Straight(NamedTuple):
    x: float
    y: float
    a: float
    b: float


def bent(field):
    """The same field with a + .6 b**2 in place of a: the coefficient is the same, but other terms contribute to it."""

    def other(u, p):
        a = u.a - 0.6 * u.b**2
        rates = field(Straight(u.x, u.y, a, u.b), p)
        return rates[0], rates[1], rates[2] + 1.2 * u.b * rates[3], rates[3]

    return other


def bifurcation_of(field, label, **parameters):
    problem = CycleProblem(field, ["x", "y", "a", "b"], {"mu": -0.1, "s": 1.0, **parameters})
    orbit = contin.solve(problem, once_round, {"period": 6.0}, degree=7)
    (point,) = contin.trace(orbit, free=["mu"], limits={"mu": (-0.1, 0.1)}).labelled(label)
    return point


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
    assert abs(point.normal_form - coefficient) <= point.details["normal_form_error"] < 1e-9
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


# --- cycles ---------------------------------------------------------------------------------------------------------

#: The rate of theta, the coupling to r, and the rate of r.
COUPLINGS = [{"g": 0.0, "k": 0.0, "h": 0.0}, {"g": 0.7, "k": 1.3, "h": 0.8}, {"g": 0.7, "k": 1.3, "h": 2.8}]


@pytest.mark.sample(2)
@pytest.mark.parametrize("coordinates", [lambda field: field, bent])
@pytest.mark.parametrize("given", COUPLINGS)
def test_of_a_period_doubling(given, coordinates):
    """On the centre manifold r**2 = 1 + h p**2, so p' = (-s + k h / 2 + h / 4) p**3: the last term from the factor r."""
    point = bifurcation_of(coordinates(moebius), "PD", **given)
    expected = -1 + given["k"] * given["h"] / 2 + given["h"] / 4
    assert point["mu"] == pytest.approx(0, abs=1e-11)
    assert abs(point.normal_form - expected) <= point.details["normal_form_error"] < 1e-9
    assert point.name == f"period doubling, {'super' if expected < 0 else 'sub'}critical"


@pytest.mark.sample(2)
@pytest.mark.parametrize("coordinates", [lambda field: field, bent])
@pytest.mark.parametrize("given", COUPLINGS)
def test_of_a_torus_bifurcation(given, coordinates):
    """r**2 = 1 + h |w|**2, and |w|**2 = 2 |xi|**2 for an eigenvector of length one: Re d = 2 (-s + k h / 2)."""
    point = bifurcation_of(coordinates(spiral), "TR", **given)
    expected = 2 * (-1 + given["k"] * given["h"] / 2)
    assert abs(point.normal_form - expected) <= point.details["normal_form_error"] < 1e-9
    assert point.name == f"torus, {'super' if expected < 0 else 'sub'}critical"


@pytest.mark.full
def test_of_a_torus_bifurcation_of_sixteen_states():
    """``spiral`` with twelve states that decay, all mixed by a reflection: it changes no length, and so not Re d.

    The linearized equations of all intervals take 1.8 MB. Their copies, factors and derivatives take 6 MB together; the indices
    of a sparse matrix with dense borders took 28, without its factors.
    """
    given, names = {"mu": -0.1, "s": 1.0, **COUPLINGS[1]}, [f"z{i}" for i in range(16)]
    mirror = np.eye(16) - 2 / np.dot(np.arange(1, 17), np.arange(1, 17)) * np.outer(np.arange(1, 17), np.arange(1, 17))

    def field(u, p):
        v = mirror @ np.array(u)
        rates = [*spiral(Straight(*v[:4]), p), *(-(1 + 0.2 * i) * v[4 + i] + 0.3 * v[2] * v[3] for i in range(12))]
        return tuple(mirror @ np.array(rates))

    orbit = contin.solve(
        CycleProblem(field, names, given), lambda t: mirror @ np.array([*once_round(t), *[0.0] * 12]), {"period": 6.0}, degree=7
    )
    (point,) = contin.trace(orbit, free=["mu"], limits={"mu": (-0.1, 0.1)}).labelled("TR")
    expected = 2 * (-1 + given["k"] * given["h"] / 2)
    assert abs(point.normal_form - expected) <= point.details["normal_form_error"] < 1e-9
    tracemalloc.start()
    coefficient(point.system, point.x, pair, point.details["frequency"])
    assert tracemalloc.get_traced_memory()[1] < 15e6
    tracemalloc.stop()


@pytest.mark.parametrize("shear", [0.0, 0.7])
def test_of_a_fold_of_cycles(shear):
    """r' = mu r + r**3 - r**5: half the second derivative at mu = -1/4, r**2 = 1/2 is -2 r, of absolute value sqrt(2)."""

    def field(u, p):
        s = u.x**2 + u.y**2
        growth, turn = p.mu + s - s * s, 1 + p.g * (s - 0.5)
        return growth * u.x - turn * u.y, turn * u.x + growth * u.y

    problem = CycleProblem(field, ["x", "y"], {"mu": 0.5, "g": shear})
    orbit = contin.solve(problem, lambda t: np.array(once_round(t)[:2]) * 1.2, {"period": 6.0}, degree=6)
    limits = {"mu": (-1, 0.6), "max_x": (0.5, 2)}
    (fold,) = contin.trace(orbit, free=["mu"], limits=limits, direction=-1).labelled("LP")
    assert fold.normal_form == pytest.approx(math.sqrt(2), abs=1e-9) and fold.name == "mu"


@pytest.mark.sample(1)
@pytest.mark.parametrize(("field", "label", "name", "s"), [(moebius, "PD", "GPD", 0.72), (spiral, "TR", "CH", 0.52)])
def test_where_the_coefficient_vanishes_on_a_curve(field, label, name, s):
    """At s = k h / 2 + h / 4 and s = k h / 2, from the two tests above."""
    point = bifurcation_of(field, label, **COUPLINGS[1])
    found = contin.curve(point, free=["mu", "s"], direction=-1, limits={"s": (0, 1.5)})
    (special,) = found.labelled(name)
    assert special["s"] == pytest.approx(s, abs=1e-9) and special["normal_form"] == pytest.approx(0, abs=1e-9)
    slope = {"PD": -1.0, "TR": -2.0}[label]
    for other in found:
        assert other["normal_form"] == pytest.approx(slope * (other["s"] - s), abs=1e-8)


def test_of_roessler():
    """Beside the point the doubled cycles u0 -+ xi v have xi**2 = -rate / c, with the rate log|mu| / T of the cycle itself."""
    problem = CycleProblem(lambda u, p: (-u.y - u.z, u.x + 0.2 * u.y, 0.2 + u.z * (u.x - p.c)), ["x", "y", "z"], {"c": 2.0})
    orbit = contin.cycle(problem, [1.0, 1.0, 0.0])
    zeros = {"c": [2.835]}
    single = contin.trace(orbit, free=["c"], limits={"c": (1.5, 3)}, zeros=zeros)
    (point,), (beside,) = single.labelled("PD"), single.labelled("UZ")
    (double,) = contin.trace(point, branch=1, limits={"c": (1.5, 2.84)}, zeros=zeros).labelled("UZ")
    assert point.name == "period doubling, supercritical" and double.system.eigenvalues(double.x).real.max() < 1e-8
    exponents = beside.system.eigenvalues(beside.x)
    rate = exponents[np.abs(exponents.imag) > 3].real.max() / beside["period"]
    t = np.linspace(0, 0.5, 2001)[:-1]
    change = double.system.evaluate(double.x, t) - double.system.evaluate(double.x, t + 0.5)
    square = np.mean(np.sum((change / 2) ** 2, axis=1))
    assert point.normal_form == pytest.approx(-rate / square, rel=0.01)
