"""Families of cycles of conservative systems: the parameter stands still along the branch and unfolds the family."""

import math

import pytest
from scipy.special import ellipk

import contin
from contin import AlgebraicProblem, CycleProblem


def pendulum(u, p):
    return u.v, -math.sin(u.x) - p.damping * u.v


def swing(t):
    return math.cos(2 * math.pi * t), -math.sin(2 * math.pi * t)


@pytest.fixture(scope="module")
def orbit():
    problem = CycleProblem(pendulum, ["x", "v"], {"damping": 0.1})
    return contin.solve(problem, swing, {"period": 6.7}, free=["damping"])


def exact(point):
    """Return the period 4 K(sin(A/2)) of the amplitude A."""
    return 4 * ellipk(math.sin(point["max_x"] / 2) ** 2)


def test_the_period_of_a_pendulum(orbit):
    """The period is held and the damping found, which is zero. Both multipliers are 1 in a Jordan block: +- about 1e-7."""
    assert orbit["period"] == pytest.approx(6.7, abs=1e-12) and orbit["damping"] == pytest.approx(0, abs=1e-12)
    assert exact(orbit) == pytest.approx(orbit["period"], abs=1e-10)
    found = orbit.floquet()
    assert abs(found.logarithms) == pytest.approx(0, abs=1e-5) and (found.errors > abs(found.logarithms) / 10).all()


def test_the_family_is_followed_in_the_period(orbit):
    family = contin.trace(orbit, free=["damping", "period"], primary="period", limits={"max_x": (0.1, 2.5)})
    assert str(family.stop) == "reached max_x = 2.5"
    assert [point["period"] for point in family] == pytest.approx([exact(point) for point in family], abs=1e-10)
    assert family.column("damping") == pytest.approx(0, abs=1e-11)


def hopf(field, parameter, guess):
    line = contin.trace(contin.solve(AlgebraicProblem(field, ["x", "y"], {parameter: 0.5}), guess), direction=-1,
                        free=[parameter], limits={parameter: (-0.5, 0.5)})  # fmt: skip
    return line.labelled("HB")[0]


def van_der_pol(u, p):
    return u.y, p.mu * (1 - u.x**2) * u.y - u.x


def lotka_volterra(u, p):
    return u.x * (1 - u.y) - p.e * u.x**2, u.y * (u.x - 1)


@pytest.mark.parametrize(("field", "name", "guess"), [(van_der_pol, "mu", [0, 0]), (lotka_volterra, "e", [1, 0.5])])
def test_a_parameter_that_stands_still_is_said(field, name, guess):
    """At mu = 0 all cycles are those of a linear oscillator, at e = 0 Lotka and Volterra's."""
    branch = contin.trace(hopf(field, name, guess), branch=1, limits={name: (-1, 1)})
    assert branch.stop.reason == "standstill" and len(branch) < 10
    assert str(branch.stop).startswith(f"{name} stays at 0, up to errors of the mesh: a vertical family")
    assert 'primary="period"' in branch.stop.advice


def test_one_period_for_all():
    branch = contin.trace(hopf(van_der_pol, "mu", [0, 0]), branch=1, primary="period", limits={"mu": (-1, 1)})
    assert str(branch.stop).startswith("period stays at 6.283185307, up to errors")


@pytest.mark.full
def test_lotka_and_volterra():
    """The invariant x - log x + y - log y takes one value at the extremes of x and of y, where the other is 1."""
    branch = contin.trace(hopf(lotka_volterra, "e", [1, 0.5]), branch=1, primary="period", limits={"period": (6, 10)})
    last = branch.points[-1]
    assert last["period"] == pytest.approx(10, abs=1e-9) and last["e"] == pytest.approx(0, abs=1e-11)
    heights = [last[f"{kind}_{name}"] - math.log(last[f"{kind}_{name}"]) for kind in ("max", "min") for name in "xy"]
    assert heights == pytest.approx([heights[0]] * 4, abs=1e-8)
