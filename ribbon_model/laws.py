"""Material laws: each is one scalar function, the complementary energy H(M1, M2, M3; kappa_n, nu); the strains, the
conjugate curvature kappa*, the tangent moduli and every Jacobian follow from its derivatives.

Units: bending modulus B = 1, total length L = 2 pi (so kappa_n stands for the paper's kappa_n L / 2 pi). The strain
energy is U(omega) = max over M of M.omega - H; a constant kappa_n^2/2 is left out of U in all laws, as in equation (7) of
Audoly & Seffen (2015), so that kappa* = dH/dkappa_n is omega_1 on a planar circle.
"""

from __future__ import annotations

import functools
import math
from collections.abc import Callable
from dataclasses import dataclass


@dataclass(frozen=True)
class Law:
    """A material law.

    Attributes
    ----------
    name : str
    hamiltonian : callable
        H(M1, M2, M3, kappa_n, nu), with arithmetic and ``math`` only.
    constrained : bool
        Whether omega_2 = 0 (then H does not depend on M2, which is a reaction).
    """

    name: str
    hamiltonian: Callable[..., float]
    constrained: bool

    @functools.cached_property
    def response(self) -> Callable[..., tuple]:
        """``response(M1, M2, M3, kappa_n, nu)`` = (H, omega_1, omega_2, omega_3, dH/dkappa_n), plain Python."""
        from contin.derivatives import gradient  # the engine is slow to load, and a law can be had without

        return gradient(self.hamiltonian, ("M1", "M2", "M3", "kappa_n"))


def ribbon_hamiltonian(M1, M2, M3, kappa_n, nu):
    """Inextensible ribbon, equations (7) and (9): H = c^2 / 2, in closed form.

    With eta = omega_3 / omega_1: c = omega_1 (1 + eta^2), a = c - nu kappa_n, M1 = c - kappa_n - a eta^2, M3 = 2 a eta; the
    root with a > 0 is the one on every branch that leaves a circle at kappa_n < m / nu.
    """
    p = M1 + (1 - nu) * kappa_n
    a = (p + math.sqrt(p * p + M3 * M3)) / 2
    c = nu * kappa_n + a
    return c * c / 2


def flat_rod_hamiltonian(M1, M2, M3, kappa_n, nu):
    """Flat rod, equation (11): torsional modulus t = 2 / (1 + nu), omega_2 = 0."""
    return (M1 + kappa_n) * (M1 + kappa_n) / 2 + M3 * M3 * (1 + nu) / 4


def isotropic_rod_hamiltonian(M1, M2, M3, kappa_n, nu):
    """Isotropic rod, equation (10): torsional modulus t = 1 / (1 + nu)."""
    return (M1 + kappa_n) * (M1 + kappa_n) / 2 + M2 * M2 / 2 + M3 * M3 * (1 + nu) / 2


RIBBON = Law("ribbon", ribbon_hamiltonian, constrained=True)
FLAT_ROD = Law("flat rod", flat_rod_hamiltonian, constrained=True)
ISOTROPIC_ROD = Law("isotropic rod", isotropic_rod_hamiltonian, constrained=False)

#: All laws by name.
LAWS = {law.name: law for law in (RIBBON, FLAT_ROD, ISOTROPIC_ROD)}
