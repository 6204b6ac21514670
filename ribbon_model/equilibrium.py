"""Equilibrium of an elastic strip: the equations along the centreline, the same on every domain.

The force R and the moment about the origin M + x × R are constant in space, so the state is the frame (a unit quaternion)
and, if R may differ from zero, the centreline x. Lengths run over the unit interval: S = length * t. The lab axes are the
directors at S = 0, the origin is x(0): M1, M2, M3 and R1, R2, R3 are the moment and force there (equations (1)-(4) of Audoly
& Seffen 2015). `ribbon_model.domains` adds the conditions at the ends.
"""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np

from ribbon_model.law import Law

LENGTH = 2 * math.pi
FRAME = ("q0", "q1", "q2", "q3")
CENTRELINE = ("x1", "x2", "x3")
LOADS = ("M1", "M2", "M3", "R1", "R2", "R3", "unfold")


def directors(q0, q1, q2, q3):
    """Return the components of d1, d2, d3 on the lab axes (nine numbers, director by director) from the quaternion.

    Examples
    --------
    >>> directors(1.0, 0.0, 0.0, 0.0)
    (1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0)
    """
    return (
        q0 * q0 + q1 * q1 - q2 * q2 - q3 * q3, 2 * (q1 * q2 + q0 * q3), 2 * (q1 * q3 - q0 * q2),
        2 * (q1 * q2 - q0 * q3), q0 * q0 - q1 * q1 + q2 * q2 - q3 * q3, 2 * (q2 * q3 + q0 * q1),
        2 * (q1 * q3 + q0 * q2), 2 * (q2 * q3 - q0 * q1), q0 * q0 - q1 * q1 - q2 * q2 + q3 * q3,
    )  # fmt: skip


def spin(q0, q1, q2, q3, w1, w2, w3, length):
    """Return the rate of the quaternion of a frame that turns with the body components w of the rotation gradient (3)."""
    h = length / 2
    return (
        -h * (q1 * w1 + q2 * w2 + q3 * w3), h * (q0 * w1 + q2 * w3 - q3 * w2),
        h * (q0 * w2 + q3 * w1 - q1 * w3), h * (q0 * w3 + q1 * w2 - q2 * w1),
    )  # fmt: skip


def on_directors(q0, q1, q2, q3, a1, a2, a3):
    """Return the components on the directors of the vector that has components a on the lab axes.

    Examples
    --------
    >>> on_directors(1.0, 0.0, 0.0, 0.0, 2.0, 3.0, 4.0)
    (2.0, 3.0, 4.0)
    """
    d11, d12, d13, d21, d22, d23, d31, d32, d33 = directors(q0, q1, q2, q3)
    return (
        d11 * a1 + d12 * a2 + d13 * a3, d21 * a1 + d22 * a2 + d23 * a3, d31 * a1 + d32 * a2 + d33 * a3,
    )  # fmt: skip


def moment_without_force(u, p):
    """Return the components of M on the directors from the states and parameters of `without_force`."""
    return on_directors(u.q0, u.q1, u.q2, u.q3, p.M1, p.M2, 0.0)


def moment_with_force(u, p):
    """Return the components of M on the directors from the states and parameters of `with_force`."""
    return on_directors(
        u.q0, u.q1, u.q2, u.q3,
        p.M1 - u.x2 * p.R3 + u.x3 * p.R2, p.M2 - u.x3 * p.R1 + u.x1 * p.R3, p.M3 - u.x1 * p.R2 + u.x2 * p.R1,
    )  # fmt: skip


def without_force(law: Law) -> tuple[Callable, tuple[str, ...], dict[str, float], dict[str, Callable]]:
    """Return the right-hand side, states, loads (parameters, zero) and functionals where R = 0, and M3 = 0 at S = 0.

    The equations also have the parameters ``length`` and those of the law.
    """

    def rates(u, p, M, response):
        H, w1, w2, w3, conjugate = response
        return spin(u.q0, u.q1, u.q2, u.q3, w1, w2, w3, p.length)

    moment = moment_without_force
    return law.at_points(moment, rates), FRAME, {"M1": 0.0, "M2": 0.0}, _functionals(law, moment)


def with_force(law: Law) -> tuple[Callable, tuple[str, ...], dict[str, float], dict[str, Callable]]:
    """Return the same with a force: the centreline is a state, moment and force at S = 0 are loads.

    ``unfold`` multiplies the dissipative term M × omega + R × e3, which is zero on a closed solution (see `domains.LOOP`).
    """

    def rates(u, p, M, response):
        M1, M2, M3 = M
        R1, R2, R3 = on_directors(u.q0, u.q1, u.q2, u.q3, p.R1, p.R2, p.R3)
        H, w1, w2, w3, conjugate = response
        v1 = w1 + p.unfold * (M2 * w3 - M3 * w2 + R2)
        v2 = w2 + p.unfold * (M3 * w1 - M1 * w3 - R1)
        v3 = w3 + p.unfold * (M1 * w2 - M2 * w1)
        turning = spin(u.q0, u.q1, u.q2, u.q3, v1, v2, v3, p.length)
        d11, d12, d13, d21, d22, d23, d31, d32, d33 = directors(u.q0, u.q1, u.q2, u.q3)
        return (*turning, p.length * d31, p.length * d32, p.length * d33)

    moment = moment_with_force
    return law.at_points(moment, rates), (*FRAME, *CENTRELINE), dict.fromkeys(LOADS, 0.0), _functionals(law, moment)


def _functionals(law: Law, moment: Callable[..., tuple]) -> dict[str, Callable]:
    """Return kappa* of equation (28) and the energy (1/2 pi) * (integral of U), as means over the domain."""

    def kappa_star(u, p, M, response):
        H, w1, w2, w3, conjugate = response
        return conjugate

    def energy(u, p, M, response):
        H, w1, w2, w3, conjugate = response
        return M[0] * w1 + M[1] * w2 + M[2] * w3 - H

    return {"kappa_star": law.at_points(moment, kappa_star), "energy": law.at_points(moment, energy)}


def strains_of(q: np.ndarray, rates: np.ndarray) -> np.ndarray:
    """Return strains (K, 3) from quaternions (K, 4) and their rates: the inverse of `spin`."""
    q0, q1, q2, q3 = q.T
    r0, r1, r2, r3 = rates[:, :4].T
    return 2 * np.array([
        q0 * r1 - q1 * r0 - q2 * r3 + q3 * r2, q0 * r2 - q2 * r0 - q3 * r1 + q1 * r3, q0 * r3 - q3 * r0 - q1 * r2 + q2 * r1
    ]).T  # fmt: skip


def moment_on_directors(q, lam) -> np.ndarray:
    """Return the moment on the directors (3, ...), 2 M_i = lam . (q e_i), from quaternions and their multipliers (4, ...)."""
    return np.array(moment_of(q, lam))


def moment_of(q, lam) -> list:
    """Return the same as a list of components, of numbers of any kind."""
    rates = spin(*q, 1, 0, 0, 1), spin(*q, 0, 1, 0, 1), spin(*q, 0, 0, 1, 1)  # q e_i / 2
    return [sum(a * b for a, b in zip(lam, rate)) for rate in rates]
