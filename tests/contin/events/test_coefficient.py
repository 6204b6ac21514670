"""Coefficients of normal forms: when they are computed, and those that are round-off."""

import dataclasses
import pickle

import pytest

import contin
from contin.events.normal_forms import Coefficient
from contin.lowlevel import Algebraic


@pytest.mark.parametrize("value, size, error, known", [
    (1e-33, 2e-33, 5e-33, 0.0),  # linear equations: all terms are round-off, and do not cancel
    (1e-12, 2e-12, 1e-15, 1e-12),  # small, but known
    (0.3, 0.5, 1.0, 0.3),  # no error is asked for
    (1e7, 2e7, 1e8, 0.0),  # near where it is infinite
    (1e-5, 1.0, 1e-4, 0.0),  # the terms cancel
])  # fmt: skip
def test_a_coefficient_that_is_smaller_than_its_error_has_no_sign(value, size, error, known):
    assert Coefficient(value, size, lambda: error).signed(0.0) == known


def test_a_normal_form_is_computed_when_it_is_asked_for(monkeypatch):
    asked, coefficient = [], Algebraic.coefficient
    monkeypatch.setattr(Algebraic, "coefficient", lambda *given: asked.append(0) or coefficient(*given))

    def field(u, p):
        square = u.x**2 + u.y**2
        return p.mu * u.x - u.y - u.x * square, u.x + p.mu * u.y - u.y * square

    stuart_landau = contin.AlgebraicProblem(field, ["x", "y"], {"mu": -1.0})
    (hopf,) = contin.trace(contin.solve(stuart_landau, [0.0, 0.0]), free=["mu"], limits={"mu": (-2, 1)}).labelled("HB")
    assert not asked
    elsewhere = pickle.loads(pickle.dumps(hopf))
    assert asked and hopf.name == "Hopf, supercritical"
    often = len(asked)
    for each in (hopf, elsewhere, dataclasses.replace(hopf, arclength=0.0)):  # r' = mu r - r^3, and r^2 is 2 |xi|^2
        assert each.normal_form == pytest.approx(-2, abs=1e-12) and each.name == hopf.name
    assert len(asked) == often
