"""A solution knows its law and its domain, and goes from domain to domain."""

import math

import numpy as np
import pytest

from contin import Settings, trace
from contin.lowlevel import point_of
from ribbon_model.domains import CELL, DOMAINS, HALF_LOOP, HALF_LOOP_BETWEEN_AXES, HALF_LOOPS, LOOP
from ribbon_model.equilibrium import LENGTH
from ribbon_model.laws import FLAT_ROD, ISOTROPIC_ROD, LAWS, Law
from ribbon_model.linear import thresholds
from ribbon_model.modes import Mode
from ribbon_model.seeds import primary_branch
from ribbon_model.solution import Solution


@pytest.fixture(scope="module")
def point():
    system, x, tangent = primary_branch(FLAT_ROD, 3, 2, 0.3, 8, 7)
    return trace(point_of(system, x), Settings(max_points=5), tangent=tangent).points[-1]


def test_a_point_is_all_that_it_takes(point):
    solution = Solution.of(point)
    assert (solution.law, solution.domain) == (FLAT_ROD, CELL)
    assert solution.parameters == dict(point.parameters)
    assert CELL.wavenumber(solution.parameters) == 2
    assert np.ptp(solution.invariants()["hamiltonian"]) < 1e-9


@pytest.mark.parametrize("domain", DOMAINS.values(), ids=list(DOMAINS))
def test_the_same_strip_on_every_domain(point, domain):
    """Equilibrium holds there, functionals are the same, and it unfolds to a closed strip of the length L."""
    here = Solution.of(point).on(domain)
    system, x = here.discretized()
    assert np.abs(system.residual(x)).max() < 1e-9
    assert here.functionals() == pytest.approx(dict(point.functionals), abs=1e-9)
    again = Solution.at(system, x)
    assert (again.law, again.domain) == (FLAT_ROD, domain)
    shape = again.shape()
    assert shape.closure() < 1e-9 and shape.arclength[-1] == pytest.approx(LENGTH, rel=1e-12)
    assert domain.parts(2) * here.parameters["length"] == pytest.approx(LENGTH, rel=1e-12)


def test_what_is_not_carried_over(point):
    half = Solution.of(point).on(HALF_LOOP)
    assert half.on(HALF_LOOP) is half
    for other in (CELL, HALF_LOOP_BETWEEN_AXES):
        with pytest.raises(ValueError, match="half loop cannot be transferred"):
            half.on(other)
    system, x = half.on(LOOP).discretized()
    assert np.abs(system.residual(x)).max() < 1e-8


def test_names_of_modes_are_read_back():
    modes = [Mode(3, 0, "odd"), Mode(3, 1, ""), Mode(3, 2, ""), Mode(3, 3, "even"), Mode(3, 3, "odd")]
    assert [Mode.parse(3, str(mode)) for mode in modes] == modes
    assert {reversal for mode in modes for reversal in mode.keeps} == set(HALF_LOOPS)


def test_a_law_of_ones_own_says_what_it_does_not_know():
    """All but a second parameter: its strain energy is the Legendre transform of H."""
    law = Law("soft", lambda M1, M2, M3, kappa_n, nu: (M1 + kappa_n) ** 2 / 2 + M3**2, constrained=True)
    with pytest.raises(ValueError, match="Gamma: is not a number of the law 'soft'"):
        law.values({"nu": 0.3, "Gamma": 1.0})
    assert law.tangent_moduli(1.0, 0.3) == (math.inf, pytest.approx(0.5, rel=1e-14))
    assert thresholds(law, 1, 2, 0.3) == pytest.approx([1 + 3 / 2], rel=1e-14)
    assert law.strain_energy(np.ones((1, 3)), 0.0, 0.3)[0] == pytest.approx([0.5 + 1 / 4], rel=1e-14)
    assert law.circle(2, 0.5, 0.3)["M1"] == pytest.approx(1.5, rel=1e-14) and not law.has_width
    assert [law.name for law in LAWS.values() if law.has_width] == ["finite width"]
    assert [law.constrained for law in (FLAT_ROD, ISOTROPIC_ROD)] == [True, False]
