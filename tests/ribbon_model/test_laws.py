"""The material laws: one scalar function each, and all that follows from it."""

import math
import pickle

import numpy as np
import pytest

from ribbon_model.domains import DOMAINS
from ribbon_model.ends import ANGLES, PLACE
from ribbon_model.equilibrium import CENTRELINE, FRAME, LOADS
from ribbon_model.law import RESERVED, Law, Parameter
from ribbon_model.laws import OPEN_LAWS, PAPER_LAWS, RIBBON
from ribbon_model.loads import LOADS as DEAD
from ribbon_model.loads import STROKE
from ribbon_model.section import DIMENSIONS, NATURAL, SOFTNESS

NU = 0.3


def states(count=50):
    """Random (omega_1, eta, kappa_n) with a = c - nu kappa_n > 0, where the ribbon's law is regular."""
    random = np.random.default_rng(7)
    while count:
        omega, eta, kappa = random.uniform(0.05, 4), random.uniform(-3, 3), random.uniform(-8, 8)
        if omega * (1 + eta**2) - NU * kappa > 0.05:
            count -= 1
            yield omega, eta, kappa


def test_ribbon_inverts_equation_9():
    """M1 and M3 as printed in (9), from strains; the response must give the strains back."""
    for w1, eta, kappa in states():
        w3 = eta * w1
        M1 = w1 - w3**4 / w1**3 - kappa * (1 - NU * w3**2 / w1**2)
        M3 = 2 * (w3 + w3**3 / w1**2 - kappa * NU * w3 / w1)
        H, v1, v2, v3, star = RIBBON.response(M1, 0.7, M3, kappa, NU)
        assert (v1, v3) == pytest.approx((w1, w3), rel=1e-9, abs=1e-12)
        assert v2 == 0
        # (28): the integrand of kappa*, and the energy density of (7) by Legendre's transform
        assert star == pytest.approx(w1 * (1 + NU * eta**2), rel=1e-9)
        energy = (w1**2 * (1 + eta**2) ** 2 - 2 * kappa * w1 * (1 + NU * eta**2)) / 2
        assert M1 * v1 + M3 * v3 - H == pytest.approx(energy, rel=1e-8, abs=1e-10)


@pytest.mark.parametrize("law", PAPER_LAWS.values(), ids=list(PAPER_LAWS))
def test_the_response_is_the_gradient(law):
    """Against differences of the Hamiltonian itself."""
    random, h = np.random.default_rng(8), 1e-4
    for _ in range(20):
        M1, M2, M3, kappa = random.uniform(0.5, 3, 4) * [1, 1, random.choice([-1, 1]), 1]
        value, *slopes = law.response(M1, M2, M3, kappa, NU)
        assert value == pytest.approx(law.hamiltonian(M1, M2, M3, kappa, NU), rel=1e-14)
        for i, slope in enumerate(slopes):
            step = h * np.eye(4)[i]
            ends = [law.hamiltonian(*(np.array([M1, M2, M3, kappa]) + k * step), NU) for k in (2, 1, -1, -2)]
            assert slope == pytest.approx((-ends[0] + 8 * ends[1] - 8 * ends[2] + ends[3]) / (12 * h), abs=1e-10)


@pytest.mark.parametrize("law", PAPER_LAWS.values(), ids=list(PAPER_LAWS))
def test_moduli_on_a_circle(law):
    """Table 2: dM3/domega_3 = B t at M3 = 0, and kappa* = m on the planar circle (28)."""
    m, kappa = 3.0, 1.4
    t = {"ribbon": 2 * (1 - NU * kappa / m), "flat rod": 2 / (1 + NU), "isotropic rod": 1 / (1 + NU)}[law.name]
    h = 1e-6
    _, w1, w2, w3, star = law.response(m - kappa, 0.0, h, kappa, NU)
    assert w3 / h == pytest.approx(1 / t, rel=1e-9)
    assert (w1, star) == pytest.approx((m, m), rel=1e-9)
    assert math.isclose(law.response(m - kappa, h, 0.0, kappa, NU)[2], 0.0 if law.constrained else h, abs_tol=1e-15)


def test_statements_that_are_refused():
    def energy(w1, w2, w3, kappa_n, core):
        return w1 * w1 / 2 - kappa_n * w1 + w3 * w3 + core * w1**4

    for parameters, sentence in (
        (("core",), r"parameters: \('core',\) must be a mapping of names to Parameter"),
        ({"core": 1}, "parameters: {'core': 1} must be a mapping"),
        (3, "parameters: 3 must be a mapping"),
        ({"length": Parameter(1)}, "parameters: 'length' is a name of every strip"),
        ({"core": Parameter(1), "more": Parameter()}, "energy: must take 6 arguments: three strains, kappa_n, core, more"),
    ):
        with pytest.raises(ValueError, match=sentence):
            Law.of_energy("own", energy, parameters)
    with pytest.raises(ValueError, match="hamiltonian: 3 must be a function"):
        Law("own", 3)


@pytest.mark.parametrize("law", OPEN_LAWS.values(), ids=lambda law: law.name)
def test_laws_are_sent_to_other_processes(law):
    assert law.response and pickle.loads(pickle.dumps(law)) == law


def test_reserved_names_are_those_of_strips():
    names = {
        *LOADS,
        *FRAME,
        *CENTRELINE,
        *PLACE,
        *ANGLES,
        *DEAD,
        STROKE,
        *NATURAL,
        *DIMENSIONS,
        SOFTNESS,
        "kappa_star",
        "energy",
    }
    for domain in DOMAINS.values():
        names |= {*domain.parameters, *domain.free}
    assert names <= RESERVED
