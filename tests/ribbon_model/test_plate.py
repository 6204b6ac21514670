"""Strips of an orthotropic plate: against the isotropic laws, and against independent minimisation over the section."""

import math

import numpy as np
import pytest
from scipy.optimize import brentq, minimize
from scipy.special import jv

import contin
from ribbon_model import plate
from ribbon_model.ends import FREE_END
from ribbon_model.laws import LAWS
from ribbon_model.open_strip import OpenStrip
from ribbon_model.section import section_of

#: Stiff along, stiff across, and with little twisting stiffness: D11, D12, D22, D66.
PLATES = [(3.0, 0.4, 1.0, 0.5), (1.0, 0.3, 2.5, 0.2), (1.5, -0.2, 0.8, 0.9)]
MOMENTS = [(0.9, 0.5, 0.0), (0.6, -0.8, 0.4), (1.3, 0.0, -0.3), (2.0, 3.0, 0.5)]


BY = ("M1", "M2", "M3", "kappa_n")
RIBBON_RESPONSE, WIDE_RESPONSE = contin.lowlevel.gradient(plate.ribbon, BY), contin.lowlevel.gradient(plate.finite_width, BY)


def isotropic(nu):
    return 1.0, nu, 1.0, (1 - nu) / 2


@pytest.mark.parametrize("nu", [-0.3, 0.0, 0.3, 0.5])
@pytest.mark.parametrize(("M1", "M3", "kappa_n"), MOMENTS)
def test_isotropic_constants_give_the_isotropic_laws(nu, M1, M3, kappa_n):
    """To round-off, with their strains; the flat rod's modulus is that of the plate, 1 - nu**2 times that of the beam."""
    known = LAWS["ribbon"].response(M1, 0.0, M3, kappa_n, nu)
    np.testing.assert_allclose(
        RIBBON_RESPONSE(M1, 0.0, M3, kappa_n, *isotropic(nu)), known,
        rtol=1e-13, atol=1e-13,
    )  # fmt: skip
    known = LAWS["finite width"].response(M1, 0.0, M3, kappa_n, nu, 2.0)
    np.testing.assert_allclose(
        WIDE_RESPONSE(M1, 0.0, M3, kappa_n, *isotropic(nu), 2.0),
        known, rtol=1e-13, atol=1e-13,
    )  # fmt: skip
    f = 1 - nu**2
    known = f * LAWS["flat rod"].hamiltonian(M1 / f, 0.0, M3 / f, kappa_n, nu) + nu**2 * kappa_n**2 / 2
    assert plate.flat_rod(M1, 0.0, M3, kappa_n, *isotropic(nu)) == pytest.approx(known, rel=1e-13)


def plate_energy(k1, k2, k12, D):
    return (D[0] * k1**2 + 2 * D[1] * k1 * k2 + D[2] * k2**2 + 4 * D[3] * k12**2) / 2


@pytest.mark.sample(3)
@pytest.mark.parametrize("D", PLATES)
@pytest.mark.parametrize(("M1", "M3", "kappa_n"), [moment for moment in MOMENTS if moment[2] >= 0])
def test_the_ribbon_is_the_plate_of_vanishing_gaussian_curvature(D, M1, M3, kappa_n):
    """H is the largest M.omega - plate energy over a and b, with curvatures a**2 and b**2 and twist a b."""

    def less(x):
        a, b = x
        return plate_energy(a * a - kappa_n, b * b, a * b, D) - M1 * a * a - M3 * a * b

    starts = [(a, b) for a in (0.5, 1.5) for b in (-1, 0.1, 1)]
    found = min((minimize(less, start, method="BFGS", options={"gtol": 1e-12}) for start in starts), key=lambda one: one.fun)
    H, w1, _, w3, _ = RIBBON_RESPONSE(M1, 0.0, M3, kappa_n, *D)
    assert -found.fun + kappa_n**2 / 2 == pytest.approx(H, rel=1e-9)
    assert (found.x[0] ** 2, found.x[0] * found.x[1]) == pytest.approx((w1, w3), rel=1e-5, abs=1e-6)


def least_of_section(w1, w3, kappa_n, D, Gamma):
    """The least energy over the profile of the section (an even polynomial of y of degree 28) and the mean stretching: linear
    equations. The width is 1 and the thickness 1/Gamma, the stretching modulus that of a plate of one material.
    """
    y, weights = np.polynomial.legendre.leggauss(80)
    y, weights = y / 2, weights / 2
    A = 12 * (D[0] - D[1] ** 2 / D[2]) * Gamma**2
    basis = [np.polynomial.chebyshev.Chebyshev.basis(2 * k, domain=[-0.5, 0.5]) for k in range(15)]
    values = np.array([np.ones_like(y), *(-w1 * one(y) for one in basis[1:])])  # of stretching, by its unknowns
    bending = np.array([np.zeros_like(y), *(one.deriv(2)(y) for one in basis[1:])])
    given = w3**2 * y**2 / 2
    matrix = (A * values * weights) @ values.T + (D[2] * bending * weights) @ bending.T
    right = -(A * values * weights) @ given - (D[1] * (w1 - kappa_n) * bending) @ weights
    c = np.linalg.lstsq(matrix, right, rcond=1e-15)[0]
    density = plate_energy(w1 - kappa_n, c @ bending, w3, D) + A * (c @ values + given) ** 2 / 2
    return float(weights @ density)


@pytest.mark.sample(1)
@pytest.mark.parametrize("D", PLATES)
@pytest.mark.parametrize("Gamma", [0.3, 2.0, 6.0])
def test_finite_width_is_the_least_over_profiles(D, Gamma):
    """H = M.omega - U at the strains of its response, and U is the least energy there; measured 1e-15 of U."""
    for M1, M3, kappa_n in MOMENTS:
        H, w1, _, w3, slope = WIDE_RESPONSE(M1, 0.0, M3, kappa_n, *D, Gamma)
        assert M1 * w1 + M3 * w3 - H + kappa_n**2 / 2 == pytest.approx(least_of_section(w1, w3, kappa_n, D, Gamma), rel=1e-8)
        step = 1e-5
        for place, known in ((0, w1), (2, w3), (3, slope)):
            moved = [np.array([M1, 0.0, M3, kappa_n]) + sign * step * np.eye(4)[place] for sign in (1, -1)]
            values = [plate.finite_width(*arguments, *D, Gamma) for arguments in moved]
            assert (values[0] - values[1]) / (2 * step) == pytest.approx(known, rel=1e-6, abs=1e-7)


@pytest.mark.full
@pytest.mark.parametrize("law", ["flat rod", "finite width"])
def test_an_orthotropic_cantilever_buckles_sideways(law):
    """P L**2 = 4.0126 sqrt(B1 C), the first zero of J_(-1/4) (Michell 1899), with B1 = D11 - D12**2/D22 and C = 4 D66."""
    D = PLATES[0]
    numbers = dict(zip(plate.RIGIDITIES, D)) | ({"Gamma": 1.0} if law == "finite width" else {})
    strip = OpenStrip(section_of(law, numbers), finish=FREE_END, numbers={"force_width": 0.0})
    zero = 2 * brentq(lambda z: jv(-0.25, z), 1.5, 2.5, xtol=1e-15)
    critical = zero * math.sqrt((D[0] - D[1] ** 2 / D[2]) * 4 * D[3])
    branch = contin.trace(strip.first_point(), free=["force_width"], limits={"force_width": (-1, 1.2 * critical)})
    (point, *_) = branch.labelled("BP")
    assert point["force_width"] == pytest.approx(critical, rel=1e-8) and point.index_change == (0, 1)


@pytest.mark.full
def test_an_isotropic_strip_stated_as_a_plate_has_the_same_states():
    """A ribbon arc that is bent open: energies, forces and indices of both statements agree."""
    found = []
    for numbers in ({"nu": 0.3}, dict(zip(plate.RIGIDITIES, isotropic(0.3)))):
        strip = OpenStrip(section_of("ribbon", {**numbers, "kappa_n": 3.0}))
        branch = contin.trace(
            strip.first_point(), free=["bend"], limits={"bend": (2.5, 3.5)}, events=strip.domain_tests(),
            zeros={"bend": [2.8]}, direction=-1,
        )  # fmt: skip
        found += [(point["energy"], point.index, *strip.reactions(point).values()) for point in branch.labelled("UZ")]
    np.testing.assert_allclose(found[0], found[1], rtol=1e-8, atol=1e-8)


@pytest.mark.parametrize(
    ("law", "numbers", "sentence"),
    [
        ("ribbon", {"D11": 1.0, "D12": 0.3, "D22": 1.0}, "D66: is missing; the law 'ribbon' needs D11, D12, D22, D66"),
        ("ribbon", {"nu": 0.3, **dict(zip(plate.RIGIDITIES, PLATES[0]))}, "nu: is not a number of"),
        ("finite width", dict(zip(plate.RIGIDITIES, PLATES[0])), "Gamma: is missing"),
        ("flat rod", {"D11": 1.0, "D12": 1.3, "D22": 1.0, "D66": 1.0}, "D12: 1.3 must be smaller"),
        ("flat rod", {"D11": -1.0, "D12": 1.3, "D22": 1.0, "D66": 1.0}, "D11: -1 must be positive"),
        ("isotropic rod", {"nu": 0.3, "D11": 1.0}, "D11: is not a number of the law 'isotropic rod'"),
    ],
)
def test_mistakes_are_told_in_one_sentence(law, numbers, sentence):
    with pytest.raises(ValueError) as caught:
        section_of(law, numbers)
    assert sentence in str(caught.value)
