"""The second variation of the energy at an equilibrium: the equilibrium along the whole loop, and the form itself.

The frame is perturbed by a rotation theta(S), with components on the lab axes. It is periodic because a closed frame is; the
sign of the quaternion after one loop has no effect. With u = theta', the strains change by u on the directors, so
omega_2 = 0 requires u . d2 = 0; x changes by theta x x - w with w' = u x x, so the loop stays closed if the means of u and w'
vanish. With K = D2H = C C^T, u = sum of d_a (C v)_a, E = (theta, w) in R^6, and the constant

    N = [[mu x, -R x], [-R x, 0]],   mu = M + x x R,

twice the second variation of the energy under closure is

    Q = int |v|^2 + E . N E' dS,     E' = G v = (u, u x x),     int E' dS = 0,

see docs/stability.md. v is free: two functions (three for a law without omega_2 = 0), six conditions on their means.
"""

from __future__ import annotations

import functools
import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass

import numpy as np

from contin.lowlevel import Shown, basis, interpolation, levels
from ribbon_model.domains import CELL, HALF_LOOP, HALF_LOOP_BETWEEN_AXES, LOOP, Domain
from ribbon_model.equilibrium import LENGTH
from ribbon_model.law import Law
from ribbon_model.older import takes_parameters
from ribbon_model.shape import frames

_HALF_TURN = np.array([1.0, -1.0, -1.0])  # about d1
#: Degree on the mesh of a circle, and the phase in radians by which the highest wave of interest turns on an interval: there
#: the error of 8 Gauss points is (8! / 16!)^2 2^17 / 17 = 3e-14. With ten times the phase the wave would not be resolved.
_CIRCLE_DEGREE, _PHASE = 8, 2.0
#: The winding may be off by this much. A guess near a branch has some defect; half a turn more would be another winding number.
_WINDING_DEFECT = 0.25


@dataclass(frozen=True)
class Symmetry:
    """Symmetry of a loop: its lab axes have e3 along the axis of rotation and e1 = d3(0) with a mirror, d2(0) with an axis.

    Attributes
    ----------
    order : int
        Number of equal parts of the loop, of length L / order.
    winding : int
        From one part to the next the frame turns by 2 pi winding / order about e3.
    flip : bool
        True if d2 and d3 also change sign (on the frame this is a half turn about d1; in space, a rotary reflection).
    mirror : bool
        Mirror symmetry at S = 0: d_i(-S) is the image of d_i(S), -d3(S) for i = 3.
    axis : bool
        Two-fold axis along d2 at S = 0 instead of a mirror: d_i(-S) is the image of -d_i(S), d2(S) for i = 2.
    """

    order: int = 1
    winding: int = 0
    flip: bool = False
    mirror: bool = False
    axis: bool = False

    @property
    def reverses(self) -> bool:
        """True if there is a symmetry that takes S to -S."""
        return self.mirror or self.axis


@dataclass(frozen=True, eq=False, repr=False)
class Equilibrium(Shown):
    """A closed equilibrium, B = 1, L = 2 pi.

    Attributes
    ----------
    parameters : mapping of str to float
        The law's, by name.
    directors : callable
        directors(S) for S (K,) gives (K, 3, 3), rows d1, d2, d3 on the lab axes; periodic.
    moment, force : ndarray, shape (3,)
        M and R at S = 0 on the lab axes.
    symmetry : Symmetry
    mesh : ndarray, shape (N + 1,)
        S at the mesh points of the collocation that the equilibrium comes from, on the piece [0, mesh[-1]] that the symmetry
        repeats: half a part of the loop where there is a mirror or an axis, else a part.
    degree : int
        Of that collocation, which is the discretization of the second variation, too.
    inside : ndarray, shape (N, degree, 3, 3), optional
        The directors at its Gauss points, where they are known.
    """

    law: Law
    parameters: Mapping[str, float]
    kappa_n: float
    directors: Callable[[np.ndarray], np.ndarray]
    moment: np.ndarray
    force: np.ndarray
    symmetry: Symmetry
    mesh: np.ndarray
    degree: int
    inside: np.ndarray | None = None

    def response(self, moment):
        """Return the strains (K, 3) and compliance D2H (K, 3, 3) from body components of the moment (K, 3)."""
        return self.law.linearized(moment, self.kappa_n, *self.parameters.values())


def coupling(moment, force) -> np.ndarray:
    """Return the antisymmetric matrix N (6, 6) of the constants mu and R (3,)."""
    matrix = np.zeros((6, 6))
    matrix[:3, :3], matrix[:3, 3:], matrix[3:, :3] = cross_matrix(moment), -cross_matrix(force), -cross_matrix(force)
    return matrix


def cross_matrix(a) -> np.ndarray:
    """Return the matrix (3, 3) of a x."""
    return np.array([[0.0, -a[2], a[1]], [a[2], 0.0, -a[0]], [-a[1], a[0], 0.0]])


@takes_parameters
def circle(law: Law, parameters: float | Mapping[str, float], m: int, kappa_n: float) -> Equilibrium:
    """Return the planar m-covered circle, on a uniform mesh that resolves the highest wavenumber that can lower the energy.

    A wave of wavenumber l has theta ~ u / l. The moment M, along d1, contributes |M| m |K| / l^2 of the stiffness and, where
    omega_2 is free, |M| |K| / l: above l^2 = m^2 + |M| m |K| (+ |M|^2 |K|^2) nothing is unstable. Raises ValueError where the
    law does not give the strain omega_1 = m there: the ribbon at kappa_n >= m / nu, nu > 0.
    """

    def directors(stations):
        angle, zero, one = m * np.asarray(stations), np.zeros(len(stations)), np.ones(len(stations))
        tangent = np.array([np.cos(angle), np.sin(angle), zero])
        normal = np.array([np.sin(angle), -np.cos(angle), zero])  # d2 = d3 x d1
        return np.array([[zero, zero, one], normal, tangent]).transpose(2, 0, 1)

    moment = np.array([0.0, 0.0, law.circle(m, kappa_n, parameters)["M1"]])
    piece, symmetry = LENGTH / (2 * m), Symmetry(order=m, mirror=True)
    known, start = law.values(parameters), directors(np.zeros(1))
    strain, compliance = (values[0] for values in law.linearized(start @ moment, kappa_n, *known.values()))
    if not np.abs(strain - [m, 0, 0]).max() < 1e-9 * m:
        raise ValueError(f"{law.name}: no {m}-covered circle at kappa_n = {kappa_n:g} on the root that the law takes")
    softened = abs(moment[2]) * np.linalg.norm(compliance)
    highest = math.sqrt(m * m + m * softened + (0 if law.constrained else softened**2))
    intervals = math.ceil(piece * highest / _PHASE) + 1
    mesh = np.linspace(0, piece, intervals + 1)
    return Equilibrium(law, known, kappa_n, directors, moment, np.zeros(3), symmetry, mesh, _CIRCLE_DEGREE)


def from_solution(law: Law, domain: Domain, t, states, degree: int, parameters: Mapping[str, float]) -> Equilibrium:
    """Return the equilibrium from the solution on a domain; arguments as for `solution.Solution`, whose method calls this.

    Raises ValueError on the cell, where quarter waves do not close.
    """
    tables = basis(degree)
    mesh = np.asarray(t)[::degree]
    quaternions = np.asarray(states)[:, :4]
    local = quaternions[np.arange(len(mesh) - 1)[:, None] * degree + np.arange(degree + 1)]

    def sample(at):
        j = np.clip(np.searchsorted(mesh, at, side="right") - 1, 0, len(mesh) - 2)
        weights = interpolation(tables.nodes, tables.barycentric, (at - mesh[j]) / (mesh[j + 1] - mesh[j]))
        return frames(np.einsum("ij,ijk->ik", weights, local[j]))

    p = parameters
    moment = np.array([p["M1"], p["M2"], p.get("M3", 0.0)])
    force = np.array([p.get(name, 0.0) for name in ("R1", "R2", "R3")])
    there = frames(np.concatenate([quaternions[[0, -1]], (tables.value @ local).reshape(-1, 4)]))
    axes, directors, symmetry = _UNFOLDED[domain](sample, there[0], there[1], p["length"])
    loads, inside = (axes @ moment, axes @ force), there[2:].reshape(*local.shape[:1], degree, 3, 3) @ axes.T
    known = {name: p[name] for name in law.parameters}
    return Equilibrium(law, known, p["kappa_n"], directors, *loads, symmetry, p["length"] * mesh, degree, inside)


def _whole(sample, first, last, length):
    """Return the lab axes (rows), directors and symmetry of a loop of which no symmetry is known."""
    return np.eye(3), lambda stations: sample(np.mod(stations, LENGTH) / LENGTH), Symmetry()


def _unfolded_half(between_axes: bool, sample, first, last, length):
    """Return lab axes, directors and symmetry of a half loop between mirrors, or between two-fold axes."""
    axes = np.array([first[1], first[2], first[0]] if between_axes else [first[2], -first[1], first[0]])
    image = np.diag([1.0, -1.0, -1.0]) if between_axes else np.diag([-1.0, 1.0, 1.0])
    signs = np.array([-1.0, 1.0, -1.0] if between_axes else [1.0, 1.0, -1.0])

    def directors(stations):
        s = np.mod(stations, LENGTH)
        beyond = s > LENGTH / 2
        d = sample(np.where(beyond, LENGTH - s, s) / (LENGTH / 2)) @ axes.T
        d[beyond] = d[beyond] @ image * signs[:, None]
        return d

    return axes, directors, Symmetry(mirror=not between_axes, axis=between_axes)


def _unfolded_cell(sample, first, last, length):
    """Return lab axes, directors and symmetry of a quarter wave: its image under the axis d2 at its end, then half waves."""
    normal = cross_matrix(first[2]) @ last[1]
    if np.linalg.norm(normal) < levels.APART:  # no rotation from part to part, so any axis in the mirror plane can be taken
        normal = first[0]
    normal /= np.linalg.norm(normal)
    axes = np.array([first[2], cross_matrix(normal) @ first[2], normal])
    axis = axes @ last[1]
    part, order = 2 * length, round(LENGTH / (2 * length))
    winding = math.atan2(2 * axis[0] * axis[1], 2 * axis[0] ** 2 - 1) * order / (2 * math.pi)
    if abs(order * part / LENGTH - 1) > levels.APART or abs(winding - round(winding)) > _WINDING_DEFECT:
        raise ValueError(f"a part of the loop turns by {winding:.9g} times 2 pi / {order}: it does not close")

    def directors(stations):
        half_turn = 2 * np.outer(axis, axis) - np.eye(3)
        turn = half_turn @ np.diag([1.0, -1.0, -1.0])  # after the half turn about e1 = d3(0)
        turns, signs = [np.linalg.matrix_power(turn, k).T for k in range(order)], np.array([np.ones(3), _HALF_TURN])[:, :, None]
        s = np.mod(stations, LENGTH)
        number = np.minimum((s / part).astype(int), order - 1)
        s = np.clip(s - number * part, 0, part)
        beyond = s > length
        d = sample(np.where(beyond, part - s, s) / length) @ axes.T
        d[beyond] = d[beyond] @ half_turn * np.array([-1.0, 1.0, -1.0])[:, None]
        return d @ np.array(turns)[number] * signs[number % 2]

    return axes, directors, Symmetry(order, round(winding) % order, flip=True, mirror=True)


#: Functions that unfold a solution on a domain: ``(axes, directors, symmetry)`` from its directors, those at both its ends, and
#: its length.
_UNFOLDED: dict[Domain, Callable] = {
    CELL: _unfolded_cell, HALF_LOOP: functools.partial(_unfolded_half, False),
    HALF_LOOP_BETWEEN_AXES: functools.partial(_unfolded_half, True), LOOP: _whole,
}  # fmt: skip
