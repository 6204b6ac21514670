"""Vibrations of a circular strip: matrix and dispersion relation ((23)-(26) of Audoly & Seffen 2015).

Lengths are in units of the radius r0 of the circle and moments in units of B / r0, so that the prestress is
moment = 1 - kappa_n r0 (17a) for the laws of the paper, and the tangent bending modulus, ``bending``, is 1 for these. A mode of
wavenumber n on the m-covered circle has k = n / m (22). Everything but the matrix is plain arithmetic: floats, or numpy arrays
that broadcast.

Two misprints are corrected here, both without effect on the roots: det A is MINUS the product (25a); and the
scale of Omega in (17b) is sqrt(B / rho) / r0**2 (rho is a mass per length; with the printed E its units do not match).
"""

from __future__ import annotations

import math

import numpy as np


def mode_matrix(moment: float, g: float, t: float, k: float, omega_squared: float, bending: float = 1.0) -> np.ndarray:
    """Return the matrix A of (24), shape (12, 12), complex; unknowns x, psi, R, M, each by its components on d1, d2, d3.

    Row 11 is the law of M_2. For g infinite it is divided by g, which leaves the constraint omega_2 = 0, i k psi_2 = psi_3;
    det A is then the limit of det A / g.

    Examples
    --------
    >>> in_plane, out_of_plane = squared_frequencies(0.0, math.inf, 2.0, 2.0)
    >>> bool(abs(np.linalg.det(mode_matrix(0.0, math.inf, 2.0, 2.0, out_of_plane))) < 1e-10)
    True
    """
    matrix = np.zeros((12, 12), dtype=complex)
    derivative = np.array([[1j * k, 0, 0], [0, 1j * k, -1], [0, 1, 1j * k]])  # (19)
    x, psi, force, torque = slice(0, 3), slice(3, 6), slice(6, 9), slice(9, 12)
    matrix[0:3, x], matrix[0:3, psi] = derivative, [[0, -1, 0], [1, 0, 0], [0, 0, 0]]  # (16a)
    matrix[3:6, x], matrix[3:6, force] = omega_squared * np.eye(3), derivative  # (16b)
    matrix[6:9, force], matrix[6:9, torque] = [[0, -1, 0], [1, 0, 0], [0, 0, 0]], derivative  # (16c)
    matrix[9:12, torque] = np.eye(3)  # (16d)
    matrix[9, 3] = -1j * k * bending
    matrix[10, 4:6] = -1j * k * g, g - moment
    matrix[11, 4:6] = moment - t, -1j * k * t
    if math.isinf(g):
        matrix[10] = 0
        matrix[10, 4:6] = -1j * k, 1
    return matrix


def coefficients(moment, g, t, k) -> tuple:
    """Return b and c of (25b), (25c); arrays broadcast. For g infinite, b = t (1 - k**2) - moment and c = 1.

    Examples
    --------
    >>> coefficients(-1.5, math.inf, 2.0, 2.0)
    (-4.5, 1.0)
    """
    if np.all(np.isinf(g)):
        return t * (1 - k**2) - moment, 1 + 0 * moment * k
    return moment**2 / g - (1 + t / g) * moment + t * (1 - k**2), 1 + (k**2 * t - moment) / g


def determinant(moment, g, t, k, omega_squared, bending=1.0):
    """Return det A from its factors, (25a) with the sign corrected; for g infinite the limit of det A / g, as `mode_matrix`.

    Examples
    --------
    >>> in_plane, out_of_plane = squared_frequencies(0.0, math.inf, 2.0, 2.0)
    >>> abs(determinant(0.0, math.inf, 2.0, 2.0, in_plane)) < 1e-12
    True
    """
    b, c = coefficients(moment, g, t, k)
    in_plane = (1 + k**2) * omega_squared - bending * k**2 * (1 - k**2) ** 2
    out_of_plane = c * omega_squared - b * k**2 * (1 - k**2)
    return -(1.0 if math.isinf(g) else g) * in_plane * out_of_plane


def squared_frequencies(moment, g, t, k, bending=1.0) -> tuple:
    """Return the roots Omega**2 of (26): the in-plane root, never negative, and the root that determines stability.

    If c = 0, the second one is infinite: a pure twist has no inertia in the model (with floats: ZeroDivisionError).

    Examples
    --------
    >>> squared_frequencies(0.0, math.inf, 2.0, 2.0)  # a naturally circular loop
    (7.2, 72.0)
    """
    b, c = coefficients(moment, g, t, k)
    return bending * k**2 * (1 - k**2) ** 2 / (1 + k**2), b * k**2 * (1 - k**2) / c
