"""Equilibrium of a closed strip: one right-hand side, three domains that differ in their end conditions.

The force R and the moment about the origin M + x × R are constant in space, so the state is the frame (a unit quaternion)
and, where R may differ from zero, the centreline x. Lengths run over the unit interval: S = length * t. The lab axes are the
directors at S = 0, the origin is x(0): M1, M2, M3 and R1, R2, R3 are the moment and force there (equations (1)-(4) of Audoly
& Seffen 2015).

- ``cell``: a quarter wave [0, L/4n] of a primary branch, between a mirror at S = 0 (normal to d3) and a two-fold axis along
  d2 at the other end; R = 0. The smallest, and the default.
- ``half_loop``: [0, L/2] between two mirrors: every wavenumber at once, each as a simple bifurcation.
- ``half_loop_between_axes``: [0, L/2] between two-fold axes along d2: what breaks the mirrors and keeps an axis.
- ``loop``: [0, L] closed, gauge and phase fixed, the redundancy of closure unfolded by a parameter that stays zero.
"""

from __future__ import annotations

import functools
import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass

import numpy as np

from contin import BoundaryValueProblem, Collocation
from ribbon_model.laws import Law

LENGTH = 2 * math.pi
FRAME = ("q0", "q1", "q2", "q3")
CENTRELINE = ("x1", "x2", "x3")


@dataclass(frozen=True)
class Domain:
    """A problem on one of the domains, with the parameters that are free on a branch (kappa_n first).

    There is one for each law: what is compiled for it is found again.
    """

    problem: BoundaryValueProblem
    free: tuple[str, ...]

    def discretize(self, intervals: int, degree: int, parameters: Mapping[str, float]) -> Collocation:
        """The collocation system on a uniform mesh."""
        return Collocation(self.problem, np.linspace(0, 1, intervals + 1), degree, self.free, parameters)

    def circle(self, system: Collocation, m: int, kappa_n: float, moment: float | None = None) -> np.ndarray:
        """The unknowns of the planar m-covered circle, shape (system.size,); its moment is m - kappa_n if it is not given."""
        half_angle = m * system.parameters[list(self.problem.parameters).index("length")] * system.nodes / 2
        zero = np.zeros_like(half_angle)
        states = [np.cos(half_angle), np.sin(half_angle), zero, zero]
        if "x1" in self.problem.states:
            states += [zero, (np.cos(2 * half_angle) - 1) / m, np.sin(2 * half_angle) / m]
        values = dict.fromkeys(self.free, 0.0) | {"kappa_n": kappa_n, "M1": m - kappa_n if moment is None else moment}
        return system.pack(np.array(states).T, values)


def directors(q0, q1, q2, q3):
    """Components of d1, d2, d3 on the lab axes (nine numbers, director by director) from the quaternion."""
    return (
        q0 * q0 + q1 * q1 - q2 * q2 - q3 * q3, 2 * (q1 * q2 + q0 * q3), 2 * (q1 * q3 - q0 * q2),
        2 * (q1 * q2 - q0 * q3), q0 * q0 - q1 * q1 + q2 * q2 - q3 * q3, 2 * (q2 * q3 + q0 * q1),
        2 * (q1 * q3 + q0 * q2), 2 * (q2 * q3 - q0 * q1), q0 * q0 - q1 * q1 - q2 * q2 + q3 * q3,
    )  # fmt: skip


def spin(q0, q1, q2, q3, w1, w2, w3, length):
    """Rate of the quaternion of a frame that turns with the body components w of the rotation gradient (3)."""
    h = length / 2
    return (
        -h * (q1 * w1 + q2 * w2 + q3 * w3), h * (q0 * w1 + q2 * w3 - q3 * w2),
        h * (q0 * w2 + q3 * w1 - q1 * w3), h * (q0 * w3 + q1 * w2 - q2 * w1),
    )  # fmt: skip


def on_directors(q0, q1, q2, q3, a1, a2, a3):
    """Components on the directors of the vector that has components a on the lab axes."""
    d11, d12, d13, d21, d22, d23, d31, d32, d33 = directors(q0, q1, q2, q3)
    return (
        d11 * a1 + d12 * a2 + d13 * a3, d21 * a1 + d22 * a2 + d23 * a3, d31 * a1 + d32 * a2 + d33 * a3,
    )  # fmt: skip


@functools.cache
def cell(law: Law) -> Domain:
    """Quarter wave with R = 0; parameters ``turn`` (2 pi m / 4n) and ``sense`` (the sign of the moment on the circle)."""
    response = law.response_at

    def local(u, p):
        q0, q1, q2, q3 = u
        M1, M2, M3 = on_directors(q0, q1, q2, q3, p.M1, p.M2, 0.0)
        return response(M1, M2, M3, p)

    def rhs(t, u, p):
        q0, q1, q2, q3 = u
        H, w1, w2, w3, conjugate = local(u, p)
        return spin(q0, q1, q2, q3, w1, w2, w3, p.length)

    def boundary(u0, u1, p):
        d11, d12, d13, d21, d22, d23, d31, d32, d33 = directors(u1.q0, u1.q1, u1.q2, u1.q3)
        moment = p.sense * math.sqrt(p.M1 * p.M1 + p.M2 * p.M2)
        return (
            u0.q0 - 1, u0.q1, u0.q2, u0.q3,
            d21 * p.M1 + d22 * p.M2,
            math.cos(p.turn) * d23 * moment - math.sin(p.turn) * (d22 * p.M1 - d21 * p.M2),
        )  # fmt: skip

    problem = BoundaryValueProblem(
        rhs, boundary, FRAME, {**_material(law), "M1": 0.0, "M2": 0.0, "length": 1.0, "turn": 1.0, "sense": 1.0},
        functionals=_functionals(response, lambda u, p: on_directors(u.q0, u.q1, u.q2, u.q3, p.M1, p.M2, 0.0)),
    )  # fmt: skip
    return Domain(problem, ("kappa_n", "M1", "M2"))


@functools.cache
def half_loop(law: Law) -> Domain:
    """[0, L/2] between mirrors normal to d3: M3 = R1 = R2 = 0 at both ends follows from d3 being parallel there."""

    def boundary(u0, u1, p):
        d11, d12, d13, d21, d22, d23, d31, d32, d33 = directors(u1.q0, u1.q1, u1.q2, u1.q3)
        return u0.q0 - 1, u0.q1, u0.q2, u0.q3, u0.x1, u0.x2, u0.x3, d31, d32, u1.x3

    return Domain(_with_force(law, boundary, LENGTH / 2), ("kappa_n", "M1", "M2", "R3"))


@functools.cache
def half_loop_between_axes(law: Law) -> Domain:
    """[0, L/2] between two-fold axes along d2: M2 = R2 = 0 at both ends follows from both axes being one line.

    ``axes`` = 1, which the equations do not use, tells a solution from one between mirrors.
    """

    def boundary(u0, u1, p):
        d11, d12, d13, d21, d22, d23, d31, d32, d33 = directors(u1.q0, u1.q1, u1.q2, u1.q3)
        return u0.q0 - 1, u0.q1, u0.q2, u0.q3, u0.x1, u0.x2, u0.x3, d21, d23, u1.x1, u1.x3

    return Domain(_with_force(law, boundary, LENGTH / 2, axes=1.0), ("kappa_n", "M1", "M3", "R1", "R3"))


@functools.cache
def loop(law: Law) -> Domain:
    """[0, L] closed. M3 at S = 0, a parameter, fixes the phase; ``unfold`` is zero on every closed solution.

    H(M) + R3 is constant along the strip, so one of the six conditions of closure follows from the others; a dissipative term
    ``unfold`` (M × omega + R × e3), which would change that constant, makes the count regular.
    """

    def boundary(u0, u1, p):
        return (
            u0.q0 - 1, u0.q1, u0.q2, u0.q3, u0.x1, u0.x2, u0.x3, u1.q1, u1.q2, u1.q3, u1.x1, u1.x2, u1.x3,
        )  # fmt: skip

    return Domain(_with_force(law, boundary, LENGTH), ("kappa_n", "M1", "M2", "R1", "R2", "R3", "unfold"))


def _material(law: Law) -> dict[str, float]:
    """kappa_n and the law's parameters, at default values."""
    return {"kappa_n": 0.0, **{name: {"nu": 0.3, "Gamma": 1.0}[name] for name in law.parameters}}


def _with_force(law: Law, boundary: Callable, length: float, **marks: float) -> BoundaryValueProblem:
    """Frame and centreline as states, moment and force at S = 0 as parameters; ``marks`` are parameters besides."""
    response = law.response_at

    def moment(u, p):
        return on_directors(
            u.q0, u.q1, u.q2, u.q3,
            p.M1 - u.x2 * p.R3 + u.x3 * p.R2, p.M2 - u.x3 * p.R1 + u.x1 * p.R3, p.M3 - u.x1 * p.R2 + u.x2 * p.R1,
        )  # fmt: skip

    def rhs(t, u, p):
        M1, M2, M3 = moment(u, p)
        R1, R2, R3 = on_directors(u.q0, u.q1, u.q2, u.q3, p.R1, p.R2, p.R3)
        H, w1, w2, w3, conjugate = response(M1, M2, M3, p)
        v1 = w1 + p.unfold * (M2 * w3 - M3 * w2 + R2)
        v2 = w2 + p.unfold * (M3 * w1 - M1 * w3 - R1)
        v3 = w3 + p.unfold * (M1 * w2 - M2 * w1)
        rates = spin(u.q0, u.q1, u.q2, u.q3, v1, v2, v3, p.length)
        d11, d12, d13, d21, d22, d23, d31, d32, d33 = directors(u.q0, u.q1, u.q2, u.q3)
        return (*rates, p.length * d31, p.length * d32, p.length * d33)

    values = dict.fromkeys(("M1", "M2", "M3", "R1", "R2", "R3", "unfold"), 0.0)
    return BoundaryValueProblem(
        rhs, boundary, (*FRAME, *CENTRELINE), {**_material(law), **values, "length": length, **marks},
        functionals=_functionals(response, moment),
    )  # fmt: skip


def _functionals(response, moment):
    """kappa* of equation (28) and the energy (1/2 pi) * (integral of U), as means over the domain."""

    def kappa_star(t, u, p):
        M1, M2, M3 = moment(u, p)
        H, w1, w2, w3, conjugate = response(M1, M2, M3, p)
        return conjugate

    def energy(t, u, p):
        M1, M2, M3 = moment(u, p)
        H, w1, w2, w3, conjugate = response(M1, M2, M3, p)
        return M1 * w1 + M2 * w2 + M3 * w3 - H

    return {"kappa_star": kappa_star, "energy": energy}
