"""Canard explosions: a parameter stays within 1e-10 or less while the cycle grows, and multipliers span 1e100 and more."""

import numpy as np
import pytest

import contin
from contin import AlgebraicProblem
from contin.linalg.periodic import log_eigenvalues, log_eigenvalues_along


def van_der_pol(u, p):
    return u.y - u.x**3 / 3 + u.x, p.e * (p.a - u.x + p.k * u.y)


def cycles(e, k, **settings):
    problem = AlgebraicProblem(van_der_pol, ["x", "y"], {"a": 1.5, "e": e, "k": k})
    line = contin.trace(contin.solve(problem, [1.2, -0.6]), free=["a"], direction=-1, limits={"a": (0, 1.6)})
    (hopf,) = line.labelled("HB")
    return hopf, contin.trace(hopf, branch=1, limits={"a": (0.5, 1.6)}, **settings)


def check_monotone(e):
    """The cycles of van der Pol's equation with a constant force are stable throughout (Krupa & Szmolyan 2001): no labels."""
    hopf, branch = cycles(e, 0.0)
    assert hopf.name == "Hopf, supercritical" and hopf["a"] == pytest.approx(1.0, abs=1e-9)
    assert [point.label for point in branch if point.label] == ["HB", "EP"]
    assert branch.points[-1]["a"] == pytest.approx(0.5, abs=1e-9)
    assert branch.points[-1].floquet().unstable == 0
    return branch


def test_no_fold_in_a_mild_explosion():
    check_monotone(0.1)


@pytest.mark.full
@pytest.mark.parametrize("e", [0.02, 0.01])
def test_no_fold_where_the_parameter_stands_still(e):
    """The explosion lies near a = 1 - e/8 - 3 e^2/32 - 173 e^3/1024 - 0.01 (Zvonkin & Shubin 1984)."""
    branch = check_monotone(e)
    standing = [point["a"] for point in branch if 1.6 < point["max_x"] < 1.9]
    assert np.ptp(standing) < 1e-7
    assert np.median(standing) == pytest.approx(1 - e / 8 - 3 * e**2 / 32 - 173 * e**3 / 1024, abs=3e-7)


@pytest.mark.full
def test_a_fold_in_an_explosion():
    """A subcritical Hopf point, stable relaxation oscillations behind: one fold, the parameter known to 1e-9, the period not.

    The multiplier in the explosion is larger than 1e5: cycles that leave the Hopf point are unstable up to the fold.
    """
    hopf, branch = cycles(0.05, -0.6)
    assert hopf.name == "Hopf, subcritical"
    (fold,) = branch.labelled("LP")
    assert [point.label for point in branch if point.label] == ["HB", "LP", "EP"]
    assert fold.errors["a"] < 1e-8 and 1 < fold.errors["period"] < 60
    before = [point for point in branch if point.arclength < fold.arclength - fold.errors["period"] and not point.label]
    assert {point.floquet().unstable for point in before} == {1}
    assert branch.points[-1].floquet().unstable == 0


def test_eigenvalues_with_a_known_vector_split_off():
    """Random factors: the eigenvalues of their product by numpy, whichever of its real eigenvectors is split off."""
    factors = np.random.default_rng(0).standard_normal((6, 4, 4))
    product = np.linalg.multi_dot(factors[::-1])
    values, vectors = np.linalg.eig(product)
    positive = np.flatnonzero((values.imag == 0) & (values.real > 0))
    assert positive.size
    for i in positive:
        along = [vectors[:, i].real]
        for factor in factors:
            along.append(factor @ along[-1])
        found = log_eigenvalues_along(factors, np.array(along))
        assert np.sort_complex(np.exp(found)) == pytest.approx(np.sort_complex(values), rel=1e-9)
        assert np.exp(found) == pytest.approx(np.exp(log_eigenvalues(factors)), rel=1e-9)
