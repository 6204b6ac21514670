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

from ribbon_model.finite_width import section_response, section_search

#: Bending stiffnesses of the plate times the width: along the strip, coupling, across it, twisting.
RIGIDITIES = ("D11", "D12", "D22", "D66")


def section_of(D11, D12, D22, D66):
    """Return the section of a ribbon; see `finite_width.isotropic`."""
    nu = D12 / D22
    return nu, D11 / D22 - nu * nu, 2 * D66 / D22, math.sqrt(D11.real / D22.real), 1.0, 0.0


def wide_section_of(D11, D12, D22, D66, Gamma):
    """Return the section of a strip of finite width."""
    nu, plane, twist, stiff, _, _ = section_of(D11, D12, D22, D66)
    return nu, plane, twist, stiff, 3 * plane * Gamma * Gamma, 1 / (math.sqrt(3 * plane.real) * Gamma.real + 1e-100)


def flat_rod(M1, M2, M3, kappa_n, D11, D12, D22, D66):
    """Return H of a flat rod, zero without moments."""
    return M1 * M1 / (2 * (D11 - D12 * D12 / D22)) + M1 * kappa_n + M3 * M3 / (8 * D66)


def ribbon(M1, M2, M3, kappa_n, D11, D12, D22, D66):
    """Return H of a ribbon, zero without moments."""
    return ribbon_response(M1, M2, M3, kappa_n, D11, D12, D22, D66)[0]


def ribbon_response(M1, M2, M3, kappa_n, D11, D12, D22, D66):
    """Return H, omega_1, omega_2, omega_3 and dH/dkappa_n of a ribbon."""
    real = section_of(D11.real, D12.real, D22.real, D66.real)
    return _response(M1, M2, M3, kappa_n, D22, section_of(D11, D12, D22, D66), real)


def finite_width(M1, M2, M3, kappa_n, D11, D12, D22, D66, Gamma):
    """Return H of a strip of finite width, zero without moments."""
    return finite_width_response(M1, M2, M3, kappa_n, D11, D12, D22, D66, Gamma)[0]


def finite_width_response(M1, M2, M3, kappa_n, D11, D12, D22, D66, Gamma):
    """Return H, omega_1, omega_2, omega_3 and dH/dkappa_n of a strip of finite width."""
    real = wide_section_of(D11.real, D12.real, D22.real, D66.real, Gamma.real)
    return _response(M1, M2, M3, kappa_n, D22, wide_section_of(D11, D12, D22, D66, Gamma), real)


def _response(M1, M2, M3, kappa_n, D22, section, real):
    """Return the response of a section, also of the real parts of its numbers; that of `finite_width` is in units of D22."""
    found = section_search(M1.real / D22.real, M3.real / D22.real, kappa_n.real, real)
    H, w1, w2, w3, slope = section_response(M1 / D22, M2 / D22, M3 / D22, kappa_n, section, found)
    return D22 * (H - kappa_n * kappa_n / 2), w1, w2, w3, D22 * (slope - kappa_n)


ribbon.gradient = ribbon_response
finite_width.gradient = finite_width_response
