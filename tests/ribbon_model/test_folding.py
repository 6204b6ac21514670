"""Circles folded by couples at two opposite points."""

import math

import numpy as np
import pytest
from scipy.interpolate import CubicSpline

from ribbon_model.barriers import folding
from ribbon_model.exact_finite_width import curve
from ribbon_model.laws import FINITE_WIDTH, FLAT_ROD

KAPPA, NU, GAMMA = 3.3, 0.3, 0.1


@pytest.mark.full
def test_the_path_ends_on_the_primary_branch():
    """The first state without couples is the one on (1, 2) at this kappa_n, by the quadrature of that branch."""
    path = folding(FINITE_WIDTH, 1, KAPPA, NU, GAMMA)
    saddle = curve(1, 2, {"nu": NU, "Gamma": GAMMA}, kappa_limits=(KAPPA, 100.0))[-1]
    assert path.energies[-1] == pytest.approx(saddle.energy, abs=1e-9)
    assert path.couples[-1] == pytest.approx(0, abs=1e-9) and path.couples[0] == 0


@pytest.mark.full
@pytest.mark.parametrize(("law", "m", "Gamma"), [(FINITE_WIDTH, 1, GAMMA), (FLAT_ROD, 3, None)])
def test_the_couple_is_the_slope_of_the_energy(law, m, Gamma):
    """Work: 2 pi dE = C d(angle). The energy at every point against the integral of a spline through the couples."""
    path = folding(law, m, KAPPA, {"nu": NU, "Gamma": Gamma})
    arc = np.concatenate([[0], np.cumsum(np.hypot(np.diff(path.angles), np.diff(path.couples)))])
    angle, couple = CubicSpline(arc, path.angles), CubicSpline(arc, path.couples)
    nodes, weights = np.polynomial.legendre.leggauss(8)
    work = 0.0
    for i in range(len(arc) - 1):
        at = (arc[i + 1] - arc[i]) / 2 * nodes + (arc[i] + arc[i + 1]) / 2
        work += (arc[i + 1] - arc[i]) / 2 * float(weights @ (couple(at) * angle(at, 1)))
    assert work == pytest.approx(2 * math.pi * (path.energies[-1] - path.energies[0]), rel=2e-3)
    assert path.couples.max() == path.couples[path.peak] > 0
