"""Circle bifurcations against the paper's table and limits."""

import math

import numpy as np
import pytest
from mode_matrix import determinant, mode_matrix

from ribbon_model import exact
from ribbon_model.dispersion import coefficients, squared_frequencies
from ribbon_model.laws import FLAT_ROD, ISOTROPIC_ROD, PAPER_LAWS, RIBBON, Law, NoThreshold
from ribbon_model.linear import convex_limits, energy_interval, index, stability_interval, thresholds

#: Table 3 of Audoly & Seffen (2015): K for nu = .3, n = 1 ... 7; the 1. of n = m are rigid rotations.
TABLE_3 = {
    1: (1.0, 2.50, 2.93, 3.10, 3.18, 3.23, 3.26),
    3: (-1.67, -0.17, 1.0, 1.74, 2.20, 2.50, 2.70),
    5: (-2.17, -1.37, -0.45, 0.36, 1.0, 1.49, 1.85),
    7: (-2.33, -1.86, -1.24, -0.58, 0.03, 0.56, 1.0),
}


@pytest.mark.parametrize("m", TABLE_3)
def test_table_3(m):
    for n, printed in enumerate(TABLE_3[m], start=1):
        if n != m:
            assert abs(thresholds(RIBBON, m, n, 0.3)[0] / m - printed) <= 0.005 + 1e-12


def test_against_the_quadrature():
    for nu in (-0.3, 0.0, 0.3, 0.5):
        for m, n in ((1, 2), (3, 1), (5, 6), (7, 2)):
            try:
                found = thresholds(RIBBON, m, n, nu)[0]
            except ValueError:
                assert 1 + 2 * nu * ((n / m) ** 2 - 1) <= 0
                continue
            assert found == pytest.approx(exact.bifurcation(m, n, nu), rel=1e-14)


def test_published_thresholds_of_the_rods():
    """Flat rod: 5.62 for m = 1 (section 6.2). Isotropic: both roots satisfy b = 0 of (25b) with g = 1."""
    assert round(thresholds(FLAT_ROD, 1, 2, 0.3)[0], 2) == 5.62
    t = 1 / 1.3
    for value in thresholds(ISOTROPIC_ROD, 3, 5, 0.3):
        moment = 1 - value / 3
        assert abs(moment**2 - (1 + t) * moment + t * (1 - (5 / 3) ** 2)) < 1e-13


def test_limits():
    """nu -> 0 is regular, m K -> m / nu as n grows (section 6.3), and what does not exist is refused."""
    assert thresholds(RIBBON, 1, 2, 1e-12)[0] == pytest.approx(thresholds(RIBBON, 1, 2, 0.0)[0], abs=1e-10)
    assert thresholds(RIBBON, 1, 4000, 0.3)[0] == pytest.approx(1 / 0.3, abs=1e-6)
    with pytest.raises(ValueError, match="rigid rotation"):
        thresholds(RIBBON, 3, 3, 0.3)
    with pytest.raises(ValueError, match="twisting modulus"):
        thresholds(RIBBON, 1, 2, -0.9)
    assert math.isfinite(thresholds(RIBBON, 1, 60, 0.5)[0])


def test_published_intervals_of_stability():
    """Section 6.2: -.17 < kappa_n r0 < 1.74 for m = 3, below 2.50 for m = 1; the flat rod up to 5.62 (nu = .3)."""
    assert [round(end, 2) for end in stability_interval(RIBBON, 3, 0.3)] == [-0.17, 1.74]
    low, high = stability_interval(RIBBON, 1, 0.3)
    assert (low, round(high, 2)) == (-math.inf, 2.5)
    assert round(stability_interval(FLAT_ROD, 1, 0.3)[1], 2) == 5.62


def test_naturally_straight_isotropic_rods():
    """Section 6.2: with kappa_n = 0 and nu = .3 an isotropic rod is unstable for all m but 1."""
    assert stability_interval(ISOTROPIC_ROD, 1, 0.3)[0] < 0 < stability_interval(ISOTROPIC_ROD, 1, 0.3)[1]
    assert all(stability_interval(ISOTROPIC_ROD, m, 0.3)[0] > 0 for m in (3, 5, 7))


# --- the dispersion relation (23)-(26) --------------------------------------------------------------------------------


@pytest.mark.parametrize("law", (RIBBON, FLAT_ROD, ISOTROPIC_ROD), ids=lambda law: law.name)
def test_table_2_follows_from_the_laws(law):
    """Table 2 against d omega_i / d M_i of the law itself on a circle of radius 1 (M_3 / omega_3 is even in M_3)."""
    for ratio, nu in ((0.0, 0.3), (1.0, 0.3), (2.0, 0.3), (2.0, -0.3)):
        g, t = law.tangent_moduli(ratio, nu)
        tiny = 1e-5
        _, _, omega_2, omega_3, _ = law.response(1 - ratio, tiny, tiny, ratio, nu)
        assert tiny / omega_3 == pytest.approx(t, rel=1e-8)
        assert math.isinf(g) and omega_2 == 0 if law.constrained else tiny / omega_2 == pytest.approx(g)


def test_a_law_that_couples_bending_and_twisting_is_refused():
    other = Law(
        "other", lambda M1, M2, M3, kappa_n, nu: M1 * M1 / 2 + M1 * kappa_n + M3 * M3 / 2 + M1 * M3 / 4, constrained=True
    )
    for attempt in (lambda: other.tangent_moduli(1.0, 0.3), lambda: index(other, 1, 1.0, 0.3)):
        with pytest.raises(ValueError, match="'other' couples bending and twisting"):
            attempt()


@pytest.mark.parametrize("law", PAPER_LAWS.values(), ids=PAPER_LAWS)
def test_closed_forms_follow_from_the_energy(law):
    """Circles, moduli, thresholds, limits and intervals of the same law without its closed forms: from U, and from H alone."""
    by_energy = Law(law.name, law.hamiltonian, law.constrained, energy=law.energy)
    by_hamiltonian = Law(law.name, law.hamiltonian, law.constrained)
    for other in (by_energy, by_hamiltonian):
        for m, kappa_n in ((1, 0.5), (3, -1.0), (3, 2.5)):
            assert law.on_circle(m, kappa_n, 0.3) == pytest.approx(other.on_circle(m, kappa_n, 0.3), rel=1e-13, abs=1e-14)
        for m, n, nu in ((1, 2, 0.3), (5, 6, 0.3), (1, 30, 0.45), (5, 6, -0.3), (3, 4, 0.0)):
            assert thresholds(other, m, n, nu) == pytest.approx(thresholds(law, m, n, nu), rel=1e-13)
    for m, n, nu in ((3, 1, 0.3), (7, 2, 0.3), (5, 4, -0.2)):  # below kappa_n = m
        assert thresholds(by_energy, m, n, nu) == pytest.approx(thresholds(law, m, n, nu), rel=1e-13)
    for m, nu in ((1, 0.3), (3, 0.3), (1, -0.3)):
        assert convex_limits(by_energy, m, nu) == pytest.approx(convex_limits(law, m, nu), rel=1e-12)
        assert energy_interval(by_energy, m, nu) == pytest.approx(energy_interval(law, m, nu), rel=1e-12, abs=1e-14)
    if law is RIBBON:
        with pytest.raises(NoThreshold, match="nu = -0.3: no threshold"):
            thresholds(by_energy, 1, 2, -0.3)


def test_determinant_factors_with_the_sign_corrected():
    """det of (24) = MINUS the product (25a); for g infinite the limit of det A / g."""
    random = np.random.default_rng(1)
    for moment, g, t, k, omega_squared in random.uniform(-2, 2, (50, 5)):
        for contrast in (abs(g) + 0.1, math.inf):
            direct = np.linalg.det(mode_matrix(moment, contrast, t, k, omega_squared))
            factored = determinant(moment, contrast, t, k, omega_squared)
            assert abs(direct - factored) < 1e-11 * max(1, abs(factored))
        limit = np.linalg.det(mode_matrix(moment, 1e7, t, k, omega_squared)) / 1e7
        assert limit == pytest.approx(determinant(moment, math.inf, t, k, omega_squared), rel=1e-4, abs=1e-4)


def test_roots_of_the_dispersion_relation():
    for moment, t, k in np.random.default_rng(2).uniform(0.1, 2, (20, 3)):
        for g in (1.0, math.inf):
            for root in squared_frequencies(moment, g, t, k):
                assert abs(determinant(moment, g, t, k, root)) < 1e-11 * max(1, abs(root)) ** 2


def test_rigid_modes():
    """k = 0 and k = 1 make both roots vanish (section 6.2)."""
    for k in (0, 1):
        assert squared_frequencies(0.4, math.inf, 1.5, k) == (0, 0)


def test_c_is_no_root_of_the_static_determinant():
    """Section 6.2 says that det A(Omega = 0) vanishes along c = 0. It does not; b = t^2 k^2 (k^2 - 1) / g there."""
    t, k = 1 / 1.3, 2.0
    moment = 1 + k**2 * t
    b, c = coefficients(moment, 1.0, t, k)
    assert c == 0 and b == pytest.approx(t**2 * k**2 * (k**2 - 1))
    assert abs(np.linalg.det(mode_matrix(moment, 1.0, t, k, 0.0))) > 1
    below, above = (squared_frequencies(moment + shift, 1.0, t, k)[1] for shift in (-1e-6, 1e-6))
    assert below < -1e6 and above > 1e6  # (26b) jumps from minus to plus infinity


# --- intervals and index ----------------------------------------------------------------------------------------------


def published_stable(law, m, ratio, nu):
    """Every root (26b) up to n = 12 m is positive, rigid modes left out."""
    k = np.array([n for n in range(1, 12 * m + 12) if n != m]) / m
    g, t = law.tangent_moduli(ratio, nu)
    return bool(np.all(squared_frequencies(1 - ratio, g, t, k)[1] > 0))


@pytest.mark.sample(2)
@pytest.mark.parametrize("nu", (-0.3, 0.0, 1e-9, 0.3, 0.45))
@pytest.mark.parametrize("law", PAPER_LAWS.values(), ids=PAPER_LAWS)
def test_intervals_by_scanning_all_modes(law, nu):
    if law.name not in ("ribbon", "flat rod", "isotropic rod"):
        pytest.skip("no closed formulas")
    for m in (1, 2, 3, 4, 5, 7):
        low, high = stability_interval(law, m, nu)
        for ratio in np.arange(-7.013, 7, 0.05):
            if law is RIBBON and nu < 0 and abs(ratio - 1 / nu) < 0.3:
                continue  # modes accumulate there: no finite number of them decides
            if low < ratio < high:
                assert published_stable(law, m, ratio, nu), (m, ratio)
            elif law is RIBBON or law is FLAT_ROD or (nu == 0.3 and m % 2):
                assert not published_stable(law, m, ratio, nu), (m, ratio)
            else:  # islands beyond c = 0 exist, and are no minima of the energy
                assert not published_stable(law, m, ratio, nu) or index(law, m, m * ratio, nu) > 0


def test_intervals_for_poisson_ratios_about_zero():
    """nu = 0 is the limit; for nu < 0 the modes of the single loop accumulate at 1 / nu, which ends the interval."""
    assert stability_interval(RIBBON, 3, 1e-10) == pytest.approx(stability_interval(RIBBON, 3, 0.0))
    assert stability_interval(RIBBON, 1, -0.3) == (pytest.approx(-1 / 0.3), math.inf)
    assert index(RIBBON, 1, -3.3, -0.3) == 0 and index(RIBBON, 1, -3.34, -0.3) == math.inf
    with pytest.raises(ValueError, match="must be greater than -1"):
        stability_interval(RIBBON, 1, 1.0)
    with pytest.raises(ValueError, match="whole number"):
        index(RIBBON, 0, 1.0, 0.3)


def index_by_assembly(law, m, kappa_n, nu, highest=40):
    """Independent count: the second variation assembled over Fourier modes, its negative eigenvalues.

    Energy of a body-frame rotation field phi, with delta omega = phi' + omega x phi on a circle of radius 1:
    sum over i of stiffness_i delta omega_i^2 - M.(phi x delta omega); closure of the loop takes out uniform phi_2, and phi_1
    of n = m.
    """
    ratio = kappa_n / m
    g, t = law.tangent_moduli(ratio, nu)
    moment = 1 - ratio
    count = 0
    for n in range(highest * m + 1):
        k = n / m
        strain = np.array([[1j * k, 0, 0], [0, 1j * k, -1], [0, 1, 1j * k]])
        cross = np.array([[0, 0, 0], [0, 0, -moment], [0, moment, 0]])
        form = strain.conj().T @ np.diag([1, 0 if math.isinf(g) else g, t]) @ strain
        form = form + (cross @ strain + (cross @ strain).conj().T) / 2
        if math.isinf(g):  # omega_2 = 0: phi_3 = phi_2'
            basis = np.array([[1, 0], [0, 1], [0, 1j * k]], dtype=complex)
        else:
            basis = np.eye(3)
        if n == 0:
            basis = basis[:, [0, 2]] if basis.shape[1] == 3 else basis[:, [0]]
        elif n == m:
            basis = basis[:, 1:]
        values = np.linalg.eigvalsh(basis.conj().T @ form @ basis)
        count += (1 if n == 0 else 2) * int(np.sum(values < -1e-9))
    return count


@pytest.mark.full
def test_index_against_an_assembled_second_variation():
    random = np.random.default_rng(3)
    for law in (RIBBON, FLAT_ROD, ISOTROPIC_ROD):
        for _ in range(60):
            m, nu, ratio = int(random.integers(1, 6)), random.uniform(-0.4, 0.49), random.uniform(-6, 6)
            if law is RIBBON and law.tangent_moduli(ratio, nu)[1] < 0.05:
                continue
            assert index(law, m, m * ratio, nu) == index_by_assembly(law, m, m * ratio, nu), (law.name, m, nu, ratio)


def test_index_of_the_single_ribbon():
    """m = 1, nu = .3: 0, 2, 4 across the thresholds 2.5 and 2.931 of (27), infinite where t < 0."""
    assert [index(RIBBON, 1, kappa_n, 0.3) for kappa_n in (-5, 1, 2.49, 2.51, 2.92, 2.94)] == [0, 0, 0, 2, 2, 4]
    assert index(RIBBON, 1, 3.4, 0.3) == math.inf


def test_isotropic_ring_inside_out():
    """A ring with kappa_n < 0 turns over about its centreline: stable as published down to -1.64, by the energy down to 0."""
    assert stability_interval(ISOTROPIC_ROD, 1, 0.3) == (pytest.approx(-1.6425, abs=1e-4), pytest.approx(1.8733, abs=1e-4))
    assert energy_interval(ISOTROPIC_ROD, 1, 0.3)[0] == 0
    assert index(ISOTROPIC_ROD, 1, 0.01, 0.3) == 0 and index(ISOTROPIC_ROD, 1, -0.01, 0.3) == 1
    for law, m in ((RIBBON, 1), (RIBBON, 3), (FLAT_ROD, 5), (ISOTROPIC_ROD, 3), (ISOTROPIC_ROD, 5)):
        assert energy_interval(law, m, 0.3) == stability_interval(law, m, 0.3)


def test_beyond_c_equal_0_the_published_root_misses_a_negative_direction():
    """m = 3, n = 1, isotropic: for -t/9 > kappa_n r0 > -.199 (26b) is positive, and the energy has a negative direction."""
    g, t = ISOTROPIC_ROD.tangent_moduli(-0.15, 0.3)
    b, c = coefficients(1.15, g, t, 1 / 3)
    assert squared_frequencies(1.15, g, t, 1 / 3)[1] > 0
    assert c < 0 and b * (1 - 1 / 9) < 0
