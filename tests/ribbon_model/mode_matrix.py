"""The matrix of the vibrations of a circular strip, (24) of Audoly & Seffen 2015, and its determinant from factors, (25a).

Units and misprints: see `ribbon_model.dispersion`.
"""

import math

import numpy as np

from ribbon_model.dispersion import coefficients


def mode_matrix(moment: float, g: float, t: float, k: float, omega_squared: float, bending: float = 1.0) -> np.ndarray:
    """Return the matrix A of (24), shape (12, 12), complex; unknowns x, psi, R, M, each by its components on d1, d2, d3.

    Row 11 is the law of M_2. For g infinite it is divided by g, which leaves the constraint omega_2 = 0, i k psi_2 = psi_3;
    det A is then the limit of det A / g.
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


def determinant(moment, g, t, k, omega_squared, bending=1.0):
    """Return det A from its factors, (25a) with the sign corrected; for g infinite the limit of det A / g, as `mode_matrix`."""
    b, c = coefficients(moment, g, t, k)
    in_plane = (1 + k**2) * omega_squared - bending * k**2 * (1 - k**2) ** 2
    out_of_plane = c * omega_squared - b * k**2 * (1 - k**2)
    return -(1.0 if math.isinf(g) else g) * in_plane * out_of_plane
