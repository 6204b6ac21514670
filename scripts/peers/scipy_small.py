"""SciPy's ``solve_bvp`` on Bratu's problem and on a cycle of Lorenz's equations, with analytic Jacobians.

It has no continuation. The fold of Bratu's problem is the largest lambda over the slope u'(0): that one is given, and lambda is
an unknown. The cycle is followed from the Hopf point in its amplitude, with r and the period as unknowns, and then in its
period; each solution starts from a secant through the last two, on the mesh of the last one.
"""

from __future__ import annotations

import math

import numpy as np
from scipy.integrate import solve_bvp

from peers.scipy_bvp import _maximum


def _solved(rhs, conditions, guess, tolerance, rhs_jacobian, conditions_jacobian):
    """Return (t, u, p) of a solution, from another one."""
    found = solve_bvp(
        rhs, conditions, *guess, fun_jac=rhs_jacobian, bc_jac=conditions_jacobian, tol=tolerance, max_nodes=200000,
        bc_tol=max(1e-3 * tolerance, 1e-14),
    )  # fmt: skip
    if not found.success:
        raise ArithmeticError(f"solve_bvp: {found.message}")
    return found.x, found.y, found.p


def bratu(tolerance: float) -> float:
    """Return lambda at the fold of u'' + lambda exp(u) = 0, u(0) = u(1) = 0.

    Slopes grow by 1 from 1 on until lambda falls; the fold is then the maximum of the polynomial through the last points.
    """

    def at(slope, guess, tolerance):
        def rhs(t, u, p):
            return np.array([u[1], -p[0] * np.exp(u[0])])

        def rhs_jacobian(t, u, p):
            zero, e = np.zeros_like(t), np.exp(u[0])
            return np.array([[zero, zero + 1], [-p[0] * e, zero]]), np.array([[zero], [-e]])

        def conditions(a, b, p):
            return np.array([a[0], b[0], a[1] - slope])

        def conditions_jacobian(a, b, p):
            first, last = np.zeros((3, 2)), np.zeros((3, 2))
            first[0, 0] = last[1, 0] = first[2, 1] = 1
            return first, last, np.zeros((3, 1))

        return _solved(rhs, conditions, guess, tolerance, rhs_jacobian, conditions_jacobian)

    t = np.linspace(0, 1, 6)
    guess = t, np.array([t * (1 - t), 1 - 2 * t]), np.array([1.0])
    slopes, found = [], []
    while len(found) < 3 or found[-1] > found[-2]:
        slopes.append(len(slopes) + 1.0)
        guess = at(slopes[-1], guess, 1e-3)
        found.append(guess[2][0])
    nearest, slopes, found = _maximum(slopes[-3:], found[-3:]), [], []
    for slope in nearest + np.array([-0.1, 0.1, 0.0]):
        slopes.append(slope)
        guess = at(slope, guess, tolerance)
        found.append(guess[2][0])
    for _ in range(4):
        slope = _maximum(slopes[-4:], found[-4:])
        if abs(slope - slopes[-1]) ** 2 < 0.1 * tolerance:
            break
        slopes.append(slope)
        guess = at(slope, guess, tolerance)
        found.append(guess[2][0])
    return float(found[-1])


def lorenz(tolerance: float, period: float = 2.0) -> float:
    """Return r at the cycle of Lorenz's equations (10, r, 8/3) with a period, from the Hopf point on."""

    def rhs(t, u, p):
        (x, y, z), (r, length) = u, p
        return length * np.array([10 * (y - x), r * x - y - x * z, x * y - 8 / 3 * z])

    def rhs_jacobian(t, u, p):
        (x, y, z), (r, length), zero = u, p, np.zeros_like(t)
        rows = [[zero - 10, zero + 10, zero], [r - z, zero - 1, -x], [y, x, zero - 8 / 3]]
        return length * np.array(rows), np.stack([length * np.array([zero, x, zero]), rhs(t, u, p) / length], axis=1)

    def at(guess, tolerance, amplitude=None, period=period):
        """Return the cycle that passes z = r - 1 at t = 0, at an amplitude or with a period."""

        def conditions(a, b, p):
            last = p[1] - period if amplitude is None else a[0] - math.sqrt(8 / 3 * (p[0] - 1)) - amplitude
            return np.append(b - a, [a[2] - p[0] + 1, last])

        def conditions_jacobian(a, b, p):
            first, last, params = np.vstack([-np.eye(3), np.zeros((2, 3))]), np.eye(5, 3), np.zeros((5, 2))
            first[3, 2], params[3, 0] = 1, -1
            if amplitude is None:
                params[4, 1] = 1
            else:
                first[4, 0], params[4, 0] = 1, -4 / 3 / math.sqrt(8 / 3 * (p[0] - 1))
            return first, last, params

        return _solved(rhs, conditions, guess, tolerance, rhs_jacobian, conditions_jacobian)

    def ahead(before, last, share):
        """Return the secant through two cycles, on the mesh of the last one."""
        (t0, u0, p0), (t, u, p) = before, last
        return t, u + share * (u - np.array([np.interp(t, t0, row) for row in u0])), p + share * (p - p0)

    guesses = list(_waves())
    for amplitude in range(1, 5):
        guesses.append(at(ahead(*guesses[-2:], 1), 1e-3, amplitude=amplitude))
    while (now := guesses[-1][2][1]) < period:  # the amplitude is largest at about 4.75
        then = min(now + 0.25, period)
        guesses.append(at(ahead(*guesses[-2:], (then - now) / (now - guesses[-2][2][1])), 1e-3, period=then))
    return float(at(guesses[-1], tolerance)[2][0])


def _waves():
    """Return the equilibrium of Lorenz's equations at its Hopf point, and a small wave about it."""
    r, t = 470 / 19, np.linspace(0, 1, 21)
    rest = math.sqrt(8 / 3 * (r - 1))
    values, vectors = np.linalg.eig(np.array([[-10.0, 10.0, 0.0], [1.0, -1.0, -rest], [rest, rest, -8 / 3]]))
    mode = vectors[:, np.argmax(values.imag)]
    wave = np.real(-1j * (mode / mode[2])[:, None] * np.exp(2j * math.pi * t))  # z passes r - 1 at t = 0
    still, p = np.array([[rest], [rest], [r - 1]]) + np.zeros_like(t), np.array([r, 2 * math.pi / values.imag.max()])
    return (t, still, p), (t, still + 0.1 * wave / wave[0, 0], p)
