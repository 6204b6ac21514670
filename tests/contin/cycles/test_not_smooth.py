"""Hopf points where the field has terms like v |v|: the parameter changes like the size of the cycles, from the start."""

import math

import numpy as np
import pytest

import contin


def drag(u, p):
    return u.y, p.m * u.y - abs(u.y) * u.y - u.x


def push(u, p):
    return u.y, p.m * u.y + abs(u.y) * u.y - u.x


def soft(u, p):
    return u.y, p.m * u.y - abs(u.x) * u.y - u.x


def cone(u, p):
    r = math.hypot(u.x, u.y)
    return (p.m - r) * u.x - u.y, u.x + (p.m - r) * u.y


def root(u, p):
    r = (u.x**2 + u.y**2) ** 0.5
    return (p.m - r) * u.x - u.y, u.x + (p.m - r) * u.y


def followed(u, p):
    return *drag(u, p), u.x - u.z - abs(u.z) * u.z


#: Size of max_y over m, from the work of a sinusoidal cycle: the means of |sin|^3, |cos| sin^2 are 4 / (3 pi), 2 / (3 pi).
RATES = {drag: 3 * math.pi / 8, push: -3 * math.pi / 8, soft: 3 * math.pi / 4, cone: 1, root: 1, followed: 3 * math.pi / 8}


def hopf_of(field, names="xyz", m=-0.1, limits=(-0.5, 0.5)):
    names = list(names[: 3 if field is followed else 2])
    rest = contin.solve(contin.AlgebraicProblem(field, names, {"m": m}), [0.0] * len(names))
    (point,) = contin.trace(rest, free=["m"], limits={"m": limits}).labelled("HB")
    return point


@pytest.mark.parametrize("field", RATES)
def test_cycles_begin_and_end_at_the_hopf_point(field):
    point = hopf_of(field)
    assert point.name == "Hopf, not smooth" and point.normal_form is None
    for direction in (1, -1):  # half a period later
        cycles = contin.trace(point, branch=1, direction=direction, limits={"m": (-0.1, 0.1)})
        assert cycles.stop.reason == "limit" and not cycles.notes
        first = cycles[1]
        assert first["max_y"] / first["m"] == pytest.approx(RATES[field], rel=abs(first["m"]))
        assert abs(cycles[-1]["m"]) == 0.1
    (end,) = contin.trace(cycles[-1], direction=-int(math.copysign(1, RATES[field]))).labelled("HB")
    assert abs(end["m"]) <= end.errors["m"] < 1e-12
    assert abs(end["period"] - 2 * math.pi) <= end.errors["period"] < 1e-12


def test_of_cones_the_size_is_the_parameter():
    cycles = contin.trace(hopf_of(root), branch=1, limits={"m": (0, 0.5)})
    assert np.allclose(cycles["max_x"][1:], cycles["m"][1:], rtol=0, atol=1e-11)
    assert np.allclose(cycles["period"], 2 * math.pi, rtol=0, atol=1e-11)


def test_switches_near_the_ends_of_the_period_are_no_places_of_the_mesh():
    """|v| switches 1e-4 of a period behind its beginning."""
    cycles = contin.trace(hopf_of(drag), branch=1, step=0.01, limits={"m": (0, 0.1)})
    assert cycles.stop.reason == "limit" and not cycles.notes


def test_another_free_parameter():
    """The damping is m + n; with n in place of m the rate is that of n."""
    field = lambda u, p: (u.y, (p.m + p.n) * u.y - abs(u.y) * u.y - u.x)  # noqa: E731
    rest = contin.solve(contin.AlgebraicProblem(field, ["x", "y"], {"m": -0.1, "n": 0.0}), [0.0, 0.0])
    (point,) = contin.trace(rest, free=["m"], limits={"m": (-0.5, 0.5)}).labelled("HB")
    first = contin.trace(point, branch=1, free=["n", "period"], limits={"n": (0, 0.1)})[1]
    assert first["max_y"] / first["n"] == pytest.approx(3 * math.pi / 8, rel=1e-2) and abs(first["m"]) < 1e-12


@pytest.mark.parametrize("term", [lambda u: abs(u.x * u.y), lambda u: 9 * abs(u.x * u.y) * u.x, lambda u: max(0, u.x) ** 2])
def test_terms_that_leave_the_rate_zero_are_not_smooth(term):
    field = lambda u, p: (p.m * u.x - u.y + term(u) - u.x**3, u.x + p.m * u.y)  # noqa: E731
    assert hopf_of(field).name == "Hopf, not smooth"


@pytest.mark.parametrize(
    "term",
    [
        lambda u: math.cos(3 * u.x) - 1 + u.y**4,  # round-off of 1
        lambda u: 1e4 * (math.exp(1e-2 * u.x) - 1 - 1e-2 * u.x),
        lambda u: u.x**2 / (1 + 1e4 * u.y**2),  # poles at .01 i
        lambda u: max(0, u.x) ** 4 + max(0, u.x - 0.2),  # kinks of a high order, or elsewhere
    ],
)
def test_smooth_terms_keep_their_normal_form(term):
    field = lambda u, p: (p.m * u.x - u.y - u.x**3, u.x + p.m * u.y + term(u))  # noqa: E731
    point = hopf_of(field, m=-0.04, limits=(-0.05, 0.05))
    assert "not smooth" not in point.name and point.normal_form is not None


def test_analytic_operations_are_smooth_without_a_look(monkeypatch):
    """Neither the normal form nor third derivatives are computed for the cycles: the frequency is known from the location."""
    from contin.lowlevel import Algebraic

    point = hopf_of(lambda u, p: (p.m * u.x - math.sin(u.y), u.x + p.m * u.y - u.y**3 / (2 + u.x)))
    monkeypatch.setattr(Algebraic, "stack_along", lambda *given: pytest.fail("a derivative was taken"))
    assert contin.trace(point, branch=1, limits={"m": (-0.1, 0.1)}, max_points=3)[0].label == "HB"


def test_derivatives_of_roots_of_squares_are_finite_at_zero():
    from contin.lowlevel import Algebraic

    def jacobian(field, x):
        return Algebraic(contin.AlgebraicProblem(field, ["x", "y"], {"m": 0.0}), ["m"]).jacobian(np.array([*x, 0.0]))

    for field in (cone, root):
        for x in ([0, 0], [1e-170, 0], [1e-160, -1e-160], [1e-200, 1e-155]):
            assert np.allclose(jacobian(field, x), [[0, -1], [1, 0]], rtol=0, atol=1e-15)
    with np.errstate(divide="ignore"):
        assert np.isinf(jacobian(lambda u, p: (u.x**0.5, u.y), [0, 0])[0, 0])
