"""Vibrations of a circular strip: roots of the dispersion relation ((25), (26) of Audoly & Seffen 2015).

Lengths are in units of the radius r0 of the circle and moments in units of B / r0, so that the prestress is
moment = 1 - kappa_n r0 (17a) for the laws of the paper, and the tangent bending modulus, ``bending``, is 1 for these. A mode of
wavenumber n on the m-covered circle has k = n / m (22). Everything is plain arithmetic: floats, or numpy arrays that
broadcast.

Two misprints are corrected here, both without effect on the roots: det A is MINUS the product (25a); and the
scale of Omega in (17b) is sqrt(B / rho) / r0**2 (rho is a mass per length; with the printed E its units do not match).
"""

from __future__ import annotations

import numpy as np


def coefficients(moment, g, t, k) -> tuple:
    """Return b and c of (25b), (25c); arrays broadcast. For g infinite, b = t (1 - k**2) - moment and c = 1.

    Examples
    --------
    >>> coefficients(-1.5, np.inf, 2.0, 2.0)
    (-4.5, 1.0)
    """
    if np.all(np.isinf(g)):
        return t * (1 - k**2) - moment, 1 + 0 * moment * k
    return moment**2 / g - (1 + t / g) * moment + t * (1 - k**2), 1 + (k**2 * t - moment) / g


def squared_frequencies(moment, g, t, k, bending=1.0) -> tuple:
    """Return the roots Omega**2 of (26): the in-plane root, never negative, and the root that determines stability.

    If c = 0, the second one is infinite: a pure twist has no inertia in the model (with floats: ZeroDivisionError).

    Examples
    --------
    >>> squared_frequencies(0.0, np.inf, 2.0, 2.0)  # a naturally circular loop
    (7.2, 72.0)
    """
    b, c = coefficients(moment, g, t, k)
    return bending * k**2 * (1 - k**2) ** 2 / (1 + k**2), b * k**2 * (1 - k**2) / c
