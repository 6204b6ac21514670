"""SciPy's ``solve_bvp`` on the cell of the branch (1, 2), driven by a pseudo-arclength loop, with analytic Jacobians.

``solve_bvp`` has no continuation and no folds. Both are here, in the fastest way for it: arclength is measured in the
three parameters (one boundary condition, no further state), each solution starts from the mesh of the last one, the loop runs
at a coarse tolerance beyond the fold, and then the fold is computed to the final tolerance, as the maximum of kappa_n
over M2 by interpolation. States (q0 q1 q2 q3), parameters (kappa_n, M1, M2); the same equations as ``auto/cell.f90``.
"""

from __future__ import annotations

import time
import warnings

import numpy as np
from scipy.integrate import solve_bvp

NU, LENGTH, TURN = 0.3, np.pi / 4, np.pi / 4


def directors(q):
    """Return the lab components of d1 and d2, shape (2, 3, ...), and their derivatives by q, shape (2, 3, 4, ...)."""
    q0, q1, q2, q3 = q
    d = [
        [q0**2 + q1**2 - q2**2 - q3**2, 2 * (q1 * q2 + q0 * q3), 2 * (q1 * q3 - q0 * q2)],
        [2 * (q1 * q2 - q0 * q3), q0**2 - q1**2 + q2**2 - q3**2, 2 * (q2 * q3 + q0 * q1)],
    ]
    slopes = [
        [[q0, q1, -q2, -q3], [q3, q2, q1, q0], [-q2, q3, -q0, q1]],
        [[-q3, q2, q1, -q0], [q0, -q1, q2, -q3], [q1, q0, q3, q2]],
    ]
    return np.array(d), 2 * np.array(slopes)


def strains(M1, M3, kappa):
    """w1, w3 of the law (9), and their derivatives by M1, M3, kappa_n, shape (2, 3, points)."""
    p = M1 + (1 - NU) * kappa
    r = np.hypot(p, M3)
    a = (p + r) / 2
    c, a1, a3 = NU * kappa + a, a / r, M3 / (2 * r)
    a11, a13, a33 = M3**2 / (2 * r**3), -p * M3 / (2 * r**3), p**2 / (2 * r**3)
    ck = NU + a1 * (1 - NU)
    slopes = [
        [a1 * a1 + c * a11, a1 * a3 + c * a13, ck * a1 + c * a11 * (1 - NU)],
        [a1 * a3 + c * a13, a3 * a3 + c * a33, ck * a3 + c * a13 * (1 - NU)],
    ]
    return c * a1, c * a3, np.array(slopes)


def _third(q):
    """Return the components of the lab axes 1 and 2 on d3, shape (2, points), and derivatives by q, shape (2, 4, points)."""
    q0, q1, q2, q3 = q
    return np.array([2 * (q1 * q3 + q0 * q2), 2 * (q2 * q3 - q0 * q1)]), 2 * np.array([[q2, q3, q0, q1], [-q1, -q0, q3, q2]])


def _local(q, p):
    """Return the strains, d(M1, M3)/dq (2, 4, points), d(M1, M3)/d(M1, M2) at S = 0 (2, 2, points)."""
    kappa, m1, m2 = p
    d, slopes = directors(q)
    third, third_slopes = _third(q)
    by_moment = np.array([[d[0, 0], d[0, 1]], third])
    by_q = np.array([slopes[0, 0] * m1 + slopes[0, 1] * m2, third_slopes[0] * m1 + third_slopes[1] * m2])
    M1, M3 = by_moment[0, 0] * m1 + by_moment[0, 1] * m2, third[0] * m1 + third[1] * m2
    return strains(M1, M3, kappa), by_q, by_moment


def _spins(q):
    """dq'/dw1 and dq'/dw3, shape (2, 4, points)."""
    q0, q1, q2, q3 = q
    return LENGTH / 2 * np.array([[-q1, q0, q3, -q2], [-q3, q2, -q1, q0]])


def rhs(t, q, p):
    """dq/dt, shape (4, points)."""
    (w1, w3, _), _, _ = _local(q, p)
    spin = _spins(q)
    return spin[0] * w1 + spin[1] * w3


def rhs_jacobian(t, q, p):
    """Return the derivatives by q (4, 4, points) and by kappa_n, M1, M2 (4, 3, points)."""
    (w1, w3, slopes), by_q, by_moment = _local(q, p)
    spin, h, zero = _spins(q), LENGTH / 2, np.zeros_like(w1)
    gain = np.einsum("sip,stp->itp", spin, slopes)  # dq'/d(M1, M3, kappa_n)
    turned = h * np.array([[zero, -w1, zero, -w3], [w1, zero, w3, zero], [zero, -w3, zero, w1], [w3, zero, -w1, zero]])
    by_state = turned + np.einsum("itp,tjp->ijp", gain[:, :2], by_q)
    by_parameters = np.concatenate([gain[:, 2:], np.einsum("itp,tjp->ijp", gain[:, :2], by_moment)], axis=1)
    return by_state, by_parameters


def _conditions(q, qb, p):
    """Return the six conditions of the cell and their derivatives by q(0), q(1), p: shapes (6,), (6, 4), (6, 4), (6, 3)."""
    _, m1, m2 = p
    (_, d2), (_, s2) = directors(qb)
    mu, c, s = -np.hypot(m1, m2), np.cos(TURN), np.sin(TURN)
    values = [q[0] - 1, q[1], q[2], q[3], d2[0] * m1 + d2[1] * m2, c * d2[2] * mu - s * (d2[1] * m1 - d2[0] * m2)]
    first, last, params = np.zeros((6, 4)), np.zeros((6, 4)), np.zeros((6, 3))
    first[:4] = np.eye(4)
    last[4] = s2[0] * m1 + s2[1] * m2
    last[5] = c * s2[2] * mu - s * (s2[1] * m1 - s2[0] * m2)
    params[4, 1:] = d2[0], d2[1]
    params[5, 1:] = c * d2[2] * m1 / mu - s * d2[1], c * d2[2] * m2 / mu + s * d2[0]
    return np.array(values), first, last, params


class Loop:
    """Solutions along the branch; ``solutions`` and ``nodes`` are counters of the work."""

    def __init__(self):
        self.solutions, self.nodes = 0, 0

    def solve(self, row, target, guess, tolerance):
        """Return the solution with row . (kappa_n, M1, M2) = target, from (t, q, p)."""

        def boundary(q, qb, p):
            return np.append(_conditions(q, qb, p)[0], row @ p - target)

        def boundary_jacobian(q, qb, p):
            _, first, last, params = _conditions(q, qb, p)
            none = np.zeros((1, 4))
            return np.vstack([first, none]), np.vstack([last, none]), np.vstack([params, row])

        t, q, p = guess
        found = solve_bvp(
            rhs, boundary, t, q, p, fun_jac=rhs_jacobian, bc_jac=boundary_jacobian, tol=tolerance, max_nodes=200000,
            bc_tol=max(1e-3 * tolerance, 1e-14),
        )  # fmt: skip
        self.solutions += 1
        self.nodes = max(self.nodes, found.x.size)
        if not found.success:
            raise ArithmeticError(f"solve_bvp: {found.message}")
        return found.x, found.y, found.p

    def branch(self, tolerance, until, first=0.3, step=0.4):
        """Return points from M2 = ``first`` near the bifurcation until ``until(points)``, by pseudo-arclength with secants."""
        t = np.linspace(0, 1, 6)
        circle = np.array([np.cos(LENGTH * t / 2), np.sin(LENGTH * t / 2), 0 * t, 0 * t])
        guess = t, circle, np.array([2.5, -1.5, first])
        points = [self.solve(np.array([0.0, 0.0, 1.0]), first, guess, tolerance)]
        tangent = np.array([0.0, 0.0, 1.0])
        while not until(points):
            t, q, p = points[-1]
            if len(points) > 1:
                old_t, old_q, old_p = points[-2]
                secant = p - old_p
                ratio = step / np.linalg.norm(secant)
                tangent = secant / np.linalg.norm(secant)
                q = q + ratio * (q - [np.interp(t, old_t, row) for row in old_q])
            points.append(self.solve(tangent, tangent @ p + step, (t, q, points[-1][2] + step * tangent), tolerance))
        return points


def fold(tolerance: float) -> dict:
    """Return kappa_n at the fold of (1, 2) with ``tol`` of solve_bvp, and the seconds.

    Near the fold kappa_n is a smooth function of M2: the next point is where the polynomial through the last ones has its
    maximum, until that moves kappa_n by less than the tolerance asks for.
    """
    began = time.perf_counter()
    loop, fixed = Loop(), np.array([0.0, 0.0, 1.0])
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", RuntimeWarning)
        points = loop.branch(1e-3, lambda points: len(points) > 2 and points[-1][2][0] < points[-2][2][0])
        guess = points[-2]
        at = [point[2][2] for point in points[-3:]]
        kappa = [point[2][0] for point in points[-3:]]
        nearest = _maximum(at, kappa)
        at, kappa = [], []
        for place in nearest + np.array([-0.03, 0.03, 0.0]):
            guess = loop.solve(fixed, place, guess, tolerance)
            at.append(place)
            kappa.append(guess[2][0])
        for _ in range(4):
            place = _maximum(at[-4:], kappa[-4:])
            if abs(place - at[-1]) ** 2 < 0.1 * tolerance:
                break
            guess = loop.solve(fixed, place, guess, tolerance)
            at.append(place)
            kappa.append(guess[2][0])
    return {
        "seconds": time.perf_counter() - began, "fold": float(kappa[-1]), "solutions": loop.solutions, "nodes": loop.nodes,
    }  # fmt: skip


def _maximum(x, y):
    """Return the place of the maximum of the polynomial through the points (x, y), next to the largest y."""
    centre = x[int(np.argmax(y))]
    polynomial = np.polynomial.Polynomial(np.linalg.solve(np.vander(np.array(x) - centre, increasing=True), y))
    roots = polynomial.deriv().roots()
    roots = roots[np.abs(roots.imag) < 1e-9].real
    return centre + roots[np.argmin(np.abs(roots))]
