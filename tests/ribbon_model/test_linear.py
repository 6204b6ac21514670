"""Circle bifurcations against the paper's table and limits."""

import math

import pytest

from ribbon_model import exact
from ribbon_model.laws import FLAT_ROD, ISOTROPIC_ROD, RIBBON
from ribbon_model.linear import stability_interval, thresholds

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
