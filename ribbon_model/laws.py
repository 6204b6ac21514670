"""Material laws: each is one scalar function, the complementary energy H(M1, M2, M3; kappa_n, nu); the strains, the
conjugate curvature kappa*, the tangent moduli and every Jacobian follow from its derivatives. (Or one that is given by its
strain energy, with H as Legendre transform: `ribbon_model.finite_width`. Nothing else need know which.)

Units: bending modulus B = 1, total length L = 2 pi (so kappa_n stands for the paper's kappa_n L / 2 pi). The strain
energy is U(omega) = max over M of M.omega - H; a constant kappa_n^2/2 is left out of U in all laws, as in equation (7) of
Audoly & Seffen (2015), so that kappa* = dH/dkappa_n is omega_1 on a planar circle.
"""

from __future__ import annotations

import functools
import math
import types
from collections.abc import Callable
from dataclasses import dataclass

from ribbon_model import finite_width


@dataclass(frozen=True)
class Law:
    """A material law.

    Attributes
    ----------
    name : str
    hamiltonian : callable
        H(M1, M2, M3, kappa_n, *parameters), with arithmetic and ``math`` only, unless ``gradient`` is given.
    constrained : bool
        Whether omega_2 = 0 (then H does not depend on M2, which is a reaction).
    parameters : tuple of str
        The law's own parameters, in the order in which they are passed: ``nu``, and for some laws more.
    gradient : callable, optional
        The response, where H is no expression that can be differentiated; made for compilation by `contin`.
    """

    name: str
    hamiltonian: Callable[..., float]
    constrained: bool
    parameters: tuple[str, ...] = ("nu",)
    gradient: Callable[..., tuple] | None = None

    @functools.cached_property
    def response(self) -> Callable[..., tuple]:
        """``response(M1, M2, M3, kappa_n, *parameters)`` = (H, omega_1, omega_2, omega_3, dH/dkappa_n), plain Python."""
        if self.gradient:
            return self.gradient
        from contin import gradient  # loads numba (.3 s): a law can be had without its derivatives

        return gradient(self.hamiltonian, ("M1", "M2", "M3", "kappa_n"))

    @functools.cached_property
    def response_at(self) -> Callable[..., tuple]:
        """``response_at(M1, M2, M3, p)``: the response, kappa_n and the law's parameters looked up in p, a named tuple."""
        response = self.response
        if "Gamma" in self.parameters:
            return lambda M1, M2, M3, p: response(M1, M2, M3, p.kappa_n, p.nu, p.Gamma)
        return lambda M1, M2, M3, p: response(M1, M2, M3, p.kappa_n, p.nu)

    def linearized(self, moments, kappa_n: float, *parameters: float):
        """Strains (K, 3) and compliance D2H (K, 3, 3) at components of the moment on the directors (K, 3), by complex steps."""
        import numpy as np

        step = 1e-30
        arguments = np.repeat(np.asarray(moments).T[:, None].astype(complex), 3, axis=1)  # component, direction, place
        arguments[range(3), range(3)] += 1j * step
        shape = arguments.shape[1:]
        if self.gradient:  # has loops and decisions: a place at a time
            places = [self.response(*moment, kappa_n, *parameters)[1:4] for moment in arguments.reshape(3, -1).T]
            strain = np.array(places, dtype=complex).T.reshape(3, *shape)
        else:  # the same code as plain Python's, on arrays
            response = types.FunctionType(self.response.__code__, {"math": np})
            strain = np.array([np.broadcast_to(w, shape) for w in response(*arguments, kappa_n, *parameters)[1:4]])
        return strain[:, 0].real.T, strain.imag.transpose(2, 0, 1) / step

    def values(self, nu: float, Gamma: float | None = None) -> dict[str, float]:
        """The law's parameters by name.

        Raises
        ------
        ValueError
            Gamma is missing, negative, or given to a law that has none.
        """
        if ("Gamma" in self.parameters) != (Gamma is not None):
            there = "is missing" if Gamma is None else f"= {Gamma:g} stands beside a law without it"
            raise ValueError(f"Gamma {there}: it is a parameter of the law 'finite width', and of no other")
        if Gamma is None:
            return {"nu": nu}
        if not 0 <= Gamma < math.inf:
            raise ValueError(f"Gamma = {Gamma:g} must be a finite number from 0; the limit of a wide strip is the law 'ribbon'")
        return {"nu": nu, "Gamma": Gamma}


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
FINITE_WIDTH = Law("finite width", finite_width.hamiltonian, True, parameters=("nu", "Gamma"), gradient=finite_width.response)

#: The laws of the paper by name, each a closed expression for H in which nu is the one parameter.
PAPER_LAWS = {law.name: law for law in (RIBBON, FLAT_ROD, ISOTROPIC_ROD)}
#: All laws by name.
LAWS = PAPER_LAWS | {FINITE_WIDTH.name: FINITE_WIDTH}


def label(law: str, Gamma: float | None = None) -> str:
    """A law with its Gamma, if it has one, as one name."""
    return law if Gamma is None else f"{law}, Gamma = {Gamma:.12g}"


def from_label(name: str) -> tuple[Law, float | None]:
    """The law and the Gamma of a `label`."""
    law, _, Gamma = name.partition(", Gamma = ")
    return LAWS[law], float(Gamma) if Gamma else None
