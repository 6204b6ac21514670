"""Second and third derivatives of a vector field along a direction, by differences of its exact Jacobian.

With J the Jacobian at u, the derivatives of J along v are B(v, .) = J'(u) v and C(v, v, .) = J''(u) v v. Both come from central
differences of J at u -+ h v, u -+ 2 h v and u -+ 3 h v: of sixth order, exact for polynomial fields up to degree seven, and of
fourth order, from the inner places alone. The difference between the two is an error estimate. The length h is the one of
several at which that is smallest.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from contin.arrays import Array

#: Lengths that are tried, as parts of 1 + the largest state: a long one is best for polynomials, where only round-off counts,
#: which is divided by its square; a short one for fields that bend on a small scale. Of the Hopf points of AUTO's demos ``ab``
#: and ``abc``, the first Lyapunov coefficient is wrong by up to 6 % with 1e-1 alone, and by less than 1e-7 with 1e-2 alone.
_LENGTHS = (1e-1, 1e-2, 3e-3, 1e-3, 3e-4)
#: Weights of J at h, 2 h and 3 h, for sixth and for fourth order: of the first derivative, odd, ...
_FIRST = np.array([[45.0, -9.0, 1.0], [40.0, -5.0, 0.0]]) / 60
#: ... and of the second, even; J at the middle has minus twice their sum.
_SECOND = np.array([[270.0, -27.0, 2.0], [240.0, -15.0, 0.0]]) / 180


def bends(jacobian: Callable[[Array], Array], u: Array, v: Array) -> tuple[Array, Array]:
    """Return B(v, .) and C(v, v, .) at several places, each of shape (2, K, n, n): of sixth order, then of fourth.

    Parameters
    ----------
    jacobian : callable
        Takes states (K, n) and returns the derivatives there, (K, n, n).
    u, v : ndarray, shape (K, n)
        States and directions.

    Examples
    --------
    >>> first, second = bends(lambda u: np.array([np.diag(4 * row**3) for row in u]), np.array([[1.0]]), np.array([[2.0]]))
    >>> print(first[0].round(9).item(), second[0].round(8).item())
    24.0 96.0
    """
    here, longest = jacobian(u), np.abs(v).max(initial=0.0)
    best, least = (np.zeros((2, *here.shape)), np.zeros((2, *here.shape))), np.inf
    if longest == 0:
        return best
    for length in _LENGTHS:
        h = length * (1 + np.abs(u).max()) / longest
        with np.errstate(all="ignore"):
            sides = [(jacobian(u + k * h * v), jacobian(u - k * h * v)) for k in (1, 2, 3)]
            first = np.einsum("ok,kijl->oijl", _FIRST, np.array([a - b for a, b in sides])) / h
            second = np.einsum("ok,kijl->oijl", _SECOND, np.array([a + b - 2 * here for a, b in sides])) / h**2
        error = float(np.abs(second[0] - second[1]).max() + np.abs(first[0] - first[1]).max())
        if error < least:  # not where values are not finite
            best, least = (first, second), error
    return best
