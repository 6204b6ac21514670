"""Strips of an orthotropic plate, whose axes lie along and across the strip: as a flat rod, a ribbon, or of finite width.

The plate has the energy (D11 k1**2 + 2 D12 k1 k2 + D22 k2**2 + 4 D66 k12**2)/2 per area, where k1 is the curvature along the
strip less kappa_n, k2 that across it, and k12 the twist. All four are given times the width. The strip has k1 = omega_1 -
kappa_n and k12 = omega_3; k2 is what the law says:

- flat rod: the k2 of least energy, so B1 = D11 - D12**2/D22 and C = 4 D66;
- ribbon: the surface is developable, omega_1 k2 = omega_3**2;
- finite width: the profile of the section of least energy, with stretching (`ribbon_model.finite_width`). For a plate of one
  material the stretching modulus along the strip is 12 (D11 - D12**2/D22)/h**2. In units of D22

      U = plane (omega_1 - kappa_n)**2/2 + twist omega_3**2 + C g(C omega_1**2) Q**2/2,    C = 3 plane Gamma**2,
      Q = omega_3**2 + nu omega_1 (omega_1 - kappa_n),    nu = D12/D22,  plane = D11/D22 - nu**2,  twist = 2 D66/D22.

With g = 1/z this is the ribbon: Q/omega_1 = k2 + nu k1. An isotropic plate has D11 = D22 = 1, D12 = nu, D66 = (1 - nu)/2; its
flat rod has the stiffnesses of the law 'flat rod' times 1 - nu**2.
"""

from __future__ import annotations

import math

from ribbon_model import finite_width as wide
from ribbon_model.finite_width import Plate

#: Bending stiffnesses of the plate times the width: along the strip, coupling, across it, twisting.
RIGIDITIES = ("D11", "D12", "D22", "D66")


def plate_of(D11, D12, D22, D66, Gamma=math.inf) -> Plate:
    """Return the plate in units of D22; Gamma is not read of a ribbon."""
    nu = D12 / D22
    plane = D11 / D22 - nu * nu
    return Plate(nu, plane, 2 * D66 / D22, math.sqrt(D11 / D22), 3 * plane * Gamma * Gamma)


def flat_rod(M1, M2, M3, kappa_n, D11, D12, D22, D66):
    """Return H of a flat rod."""
    return M1 * M1 / (2 * (D11 - D12 * D12 / D22)) + M1 * kappa_n + M3 * M3 / (8 * D66) + kappa_n * kappa_n / 2


def ribbon(M1, M2, M3, kappa_n, D11, D12, D22, D66):
    """Return H of a ribbon."""
    plate = plate_of(D11, D12, D22, D66)
    return D22 * wide.ribbon_complementary(M1 / D22, M3 / D22, kappa_n, plate) + kappa_n * kappa_n / 2


def ribbon_energy(w1, w2, w3, kappa_n, D11, D12, D22, D66):
    """Return U of a ribbon, inf for omega_1 <= 0."""
    if w1 > 0:
        return D22 * wide.ribbon_energy(w1, w3, kappa_n, plate_of(D11, D12, D22, D66)) - kappa_n * kappa_n / 2
    return math.inf


def finite_width(M1, M2, M3, kappa_n, D11, D12, D22, D66, Gamma):
    """Return H of a strip of finite width."""
    plate = plate_of(D11, D12, D22, D66, Gamma)
    return D22 * wide.complementary(M1 / D22, M3 / D22, kappa_n, plate) + kappa_n * kappa_n / 2


def finite_width_energy(w1, w2, w3, kappa_n, D11, D12, D22, D66, Gamma):
    """Return U of a strip of finite width."""
    return D22 * wide.section_energy(w1, w3, kappa_n, plate_of(D11, D12, D22, D66, Gamma)) - kappa_n * kappa_n / 2
