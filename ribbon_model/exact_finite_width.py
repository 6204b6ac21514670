"""The exact (quadrature) solution of the primary branches of a law with omega_2 = 0, as of finite width, without collocation.

With R = 0, |M| = mu and H = omega.grad U - U are constant along the strip: omega = rho (cos phi, sin phi) runs along a level
curve of H, which meets every ray once where U is convex (dH/drho = omega.D2U.omega/rho). A quarter wave runs from the mirror,
phi = 0, to the two-fold axis, where M_2 = 0. With
tan(phi/2) = sqrt(A) sin(theta), 0 < theta < pi/2, J a quarter turn and D2U J D2U = det(D2U) J,

    M_2**2 = mu**2 - M_1**2 - M_3**2,    dS/dtheta = (dphi/dtheta) rho**2 det(D2U) / (|M_2| omega.D2U.omega),
    precession of d_1 about M            = mu omega_3 M_3 / (M_2**2 + M_3**2) dS,

and the loop closes if the length is pi/2n and the precession pi |m - n|/2n, as for the flat rod (`ribbon_model.exact_rods`).
The integrands are even and pi-periodic in theta: the midpoint rule converges exponentially. rho comes from Newton's method
at each node, M_2**2 from its own derivative, which does not cancel. Two equations for kappa_n,
omega = rho(0) and sqrt(A): one curve.

U must be even in omega_3. Units: B = 1 (of the law 'finite width' the plate's modulus times the width), L = 2 pi. Source of
every number: quadrature of the R = 0 equilibrium.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from contin.lowlevel import Label
from ribbon_model import linear
from ribbon_model.law import Law
from ribbon_model.laws import FINITE_WIDTH
from ribbon_model.older import takes_parameters

_FEWEST, _MOST = 32, 512  # nodes of a quarter wave
_DIFFERENCE = 1e-5
_FIRST, _SHORTEST = 0.02, 1e-3  # steps; the first is sqrt(A) of the first point, and off the circle


@dataclass(frozen=True)
class FiniteWidthPoint:
    """One equilibrium on the primary branch (m, n) (B = 1, L = 2 pi).

    ``omega`` is omega_1 at the mirror, ``amplitude`` A above, ``kappa_star`` (28), ``energy`` the mean of U, without
    kappa_n**2/2; ``label`` is 'BP' on a circle, 'LP' at a fold, 'EP' at a limit of kappa_n, 'MX' where the branch is lost, ''
    elsewhere.
    """

    law: Law
    parameters: Mapping[str, float]
    m: int
    n: int
    kappa_n: float
    omega: float
    amplitude: float
    kappa_star: float
    energy: float
    label: str = ""

    @property
    def coordinates(self) -> np.ndarray:
        """The point in the space of the unknowns, shape (3,), with kappa_n divided by five."""
        return np.array([self.kappa_n / 5, self.omega, math.sqrt(self.amplitude)])


def _derivatives(w, kappa_n, law, values):
    """Return (U, U_1, U_3, U_11, U_13, U_33, U_k), shape (7, nodes), at strains (nodes, 2)."""
    U, slope, curvature = law.derivatives(np.insert(w, 1, 0.0, axis=1), kappa_n, *values)
    return np.array([U, slope[:, 0], slope[:, 2], curvature[:, 0, 0], curvature[:, 0, 2], curvature[:, 2, 2], slope[:, 3]])


def _level(direction, omega, kappa_n, law, values):
    """Return strains (nodes, 2) on rays (nodes, 2), on the level curve of H through (omega, 0), and derivatives; or nan."""
    U, U1 = _derivatives(np.array([[omega, 0.0]]), kappa_n, law, values)[:2, 0]
    level, rho = omega * U1 - U, np.full(len(direction), float(omega))
    for _ in range(60):
        w = rho[:, None] * direction
        d = _derivatives(w, kappa_n, law, values)
        slope = w[:, 0] ** 2 * d[3] + 2 * w[:, 0] * w[:, 1] * d[4] + w[:, 1] ** 2 * d[5]  # rho dH/drho
        change = (level - (w[:, 0] * d[1] + w[:, 1] * d[2] - d[0])) / slope
        if np.abs(change).max() < 1e-13:
            return w, d, slope
        rho = rho * (1 + np.clip(change, -0.5, 1.0))
    return w * np.nan, d * np.nan, slope * np.nan


def quadratures(kappa_n, omega, root_A, law, values) -> np.ndarray:
    """Return length, precession of d_1, kappa* and U (both integrated over S) of a quarter wave, shape (4,).

    Not a number outside the convex domain. The number of nodes is doubled until the result stays the same.
    """
    nodes, before = _FEWEST, None
    while nodes <= _MOST:
        now = _quadratures(kappa_n, omega, root_A, law, values, nodes)
        if not np.isfinite(now).all():
            return now
        if before is not None and np.abs(now - before).max() < 1e-13 * (1 + np.abs(now).max()):
            return now
        nodes, before = 2 * nodes, now
    return before


def _quadratures(kappa_n, omega, root_A, law, values, nodes):
    theta = np.append((np.arange(nodes) + 0.5) * math.pi / (2 * nodes), math.pi / 2)
    tangent = root_A * np.sin(theta)  # of phi/2
    direction = np.array([1 - tangent**2, 2 * tangent]).T / (1 + tangent**2)[:, None]
    w, d, slope = _level(direction, omega, kappa_n, law, values)
    mu = math.hypot(d[1, -1], d[2, -1])
    w, d, slope, theta, tangent = w[:-1], d[:, :-1], slope[:-1], theta[:-1], tangent[:-1]
    _, M1, M3, U11, U13, U33 = d[:6]
    convex = np.where((U11 > 0) & (U11 * U33 > U13**2), 1.0, np.nan)
    rate = convex * 2 * abs(root_A) * np.cos(theta) / (1 + tangent**2)  # of phi
    rate *= (w**2).sum(1) * (U11 * U33 - U13**2) / slope  # |M_2| dS/dtheta
    fall = 2 * (w[:, 1] * M1 - w[:, 0] * M3) * rate  # of M_2**2, by theta, up to the sign
    k = np.arange(1, nodes)
    coefficients = 2 / nodes * (np.sin(2 * np.outer(k, theta)) @ fall)  # a series of sin(2 k theta), given at midpoints
    sines = np.sin(np.outer(math.pi / 2 - theta, k)) ** 2 / k  # its integral to pi/2, accurate near there as well
    M2 = np.sqrt(np.abs(sines @ (coefficients * (-1.0) ** (k + 1))))
    precession = mu * w[:, 1] * M3 / (M2**2 + M3**2)
    integrands = np.array([np.ones_like(M2), precession, -d[6], d[0]])
    return integrands @ (rate / M2) * (math.pi / (2 * nodes))


class _Branch:
    """The curve of one branch in v = (kappa_n, omega, sqrt(A))."""

    def __init__(self, law, parameters, m, n):
        self.law, self.parameters, self.m, self.n = law, law.values(parameters), m, n

    def defects(self, v):
        length, precession, _, _ = quadratures(*v, self.law, tuple(self.parameters.values()))
        return np.array([length * 2 * self.n / math.pi - 1, precession * 2 / math.pi - abs(self.m - self.n) / self.n])

    def slopes(self, v):
        """Return the derivatives of the defects, shape (2, 3)."""
        steps = _DIFFERENCE * np.eye(3)
        return np.array([(self.defects(v + e) - self.defects(v - e)) / (2 * _DIFFERENCE) for e in steps]).T

    def tangent(self, v):
        slopes = self.slopes(v)
        tangent = np.cross(slopes[0], slopes[1])
        return tangent / np.linalg.norm(tangent)

    def correct(self, v, normal):
        """Return the curve's point in the plane through v with this normal, or None."""
        start = v
        for _ in range(12):
            matrix = np.vstack([self.slopes(v), normal])
            defects = np.append(self.defects(v), normal @ (v - start))
            if not np.isfinite(matrix).all():
                return None
            update = -np.linalg.solve(matrix, defects)
            if not np.abs(update).max() < 0.5:
                return None
            v = v + update
            if np.abs(update).max() < 1e-11:
                return v
        return None

    def point(self, v, label=""):
        length, _, star, energy = quadratures(*v, self.law, tuple(self.parameters.values()))
        values = (v[0], v[1], v[2] ** 2, star / length, energy / length)
        return FiniteWidthPoint(self.law, self.parameters, self.m, self.n, *map(float, values), label)

    def circle(self, index):
        """Return the circle where the branch begins or ends."""
        kappa_n = linear.thresholds(self.law, index, self.n, self.parameters)[0]
        values = linear.circle(self.law, index, kappa_n, self.parameters)
        place = (kappa_n, float(index), 0.0, float(values["kappa_star"]), float(values["energy"]))
        return FiniteWidthPoint(self.law, self.parameters, self.m, self.n, *place, Label.BRANCH_POINT)

    def first(self):
        """Return the first point after the circle, with the smallest sqrt(A)."""
        begin = self.circle(self.m)
        return self.correct(np.array([begin.kappa_n, begin.omega, _FIRST]), np.array([0.0, 0.0, 1.0]))


@takes_parameters
def curve(m, n, parameters, kappa_limits=(-100.0, 100.0), step=0.1, law=FINITE_WIDTH) -> list[FiniteWidthPoint]:
    """Return the branch from the m-covered circle to the one where it ends, to a limit of kappa_n, or to where it is lost.

    Parameters
    ----------
    parameters : mapping of str to float
        Those of the law, by name.
    step : float
        Largest distance between points in (kappa_n / 5, omega, sqrt(A)).

    Raises
    ------
    ValueError
        See `linear.thresholds`; a law that has an omega_2; a first point outside the limits; or m is a multiple of 2n (the
        centreline does not close).
    RuntimeError
        No point beside the circle is found.
    """
    if m % (2 * n) == 0:
        raise ValueError(f"branch ({m}, {n}) does not close with R = 0, because m is a multiple of 2n")
    if not law.constrained:
        raise ValueError(f"the law {law.name!r} has an omega_2: there is no such quadrature")
    branch = _Branch(law, parameters, m, n)
    points, v = [branch.circle(m)], branch.first()
    if not kappa_limits[0] <= points[0].kappa_n <= kappa_limits[1]:
        raise ValueError(f"branch ({m}, {n}) starts at kappa_n = {points[0].kappa_n:.6g}, outside {tuple(kappa_limits)}")
    if v is None:
        raise RuntimeError(f"branch ({m}, {n}) could not be left from its circle")
    points.append(branch.point(v))
    tangent = branch.tangent(v)
    tangent, length = tangent * np.sign(tangent[2]), _FIRST
    while length > _SHORTEST:
        ahead = branch.correct(v + length * tangent / math.hypot(tangent[0] / 5, tangent[1], tangent[2]), tangent)
        turned = None if ahead is None or ahead[2] < _FIRST / 2 else branch.tangent(ahead)
        if ahead is not None and turned is None:  # the circle at the other end
            return [*points, branch.circle(round(v[1]))]
        if ahead is None or abs(turned @ tangent) < 0.98:
            length /= 2
            continue
        turned = turned * np.sign(turned @ tangent)
        if tangent[0] * turned[0] < 0:
            points.append(branch.point(_fold(branch, v, tangent, ahead), Label.FOLD))
        if not kappa_limits[0] < ahead[0] < kappa_limits[1]:
            bound = kappa_limits[0] if ahead[0] <= kappa_limits[0] else kappa_limits[1]
            at = v + (ahead - v) * (bound - v[0]) / (ahead[0] - v[0])
            return [*points, branch.point(branch.correct(at, np.array([1.0, 0.0, 0.0])), Label.END)]
        points.append(branch.point(ahead))
        v, tangent, length = ahead, turned, min(1.5 * length, step)
    return [*points, branch.point(v, Label.FAILED)]


def solve(guess: FiniteWidthPoint, *, kappa_n: float | None = None, amplitude: float | None = None) -> FiniteWidthPoint:
    """Return the point of a branch with given kappa_n, or given amplitude, nearest a point of it; see `exact.solve`.

    Raises
    ------
    RuntimeError
        If Newton does not converge.
    """
    branch = _Branch(guess.law, guess.parameters, guess.m, guess.n)
    v = np.array([guess.kappa_n, guess.omega, math.sqrt(guess.amplitude)])
    if kappa_n is not None:
        v[0], normal = kappa_n, np.array([1.0, 0.0, 0.0])
    else:
        v[2], normal = math.sqrt(amplitude), np.array([0.0, 0.0, 1.0])
    found = branch.correct(v, normal)
    if found is None:
        raise RuntimeError(f"no convergence on branch ({guess.m}, {guess.n}): start nearer, or prescribe the other quantity")
    return branch.point(found)


def _fold(branch, v, tangent, ahead):
    """Return the point between two others where kappa_n is stationary; the error of kappa_n is the square of the point's."""
    from scipy.optimize import brentq

    def place(s):
        return branch.correct(v + s * (ahead - v), tangent)

    s = brentq(lambda s: branch.tangent(place(s))[0] * np.sign(branch.tangent(place(s)) @ tangent), 0.0, 1.0, xtol=1e-9)
    return place(s)
