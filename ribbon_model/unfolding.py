"""The unfolding arc: linear stability of a naturally circular strip whose ends are rotated (section 5 of Audoly & Seffen).

The strip has the natural curvature kappa_n and spans theta_n = L kappa_n; turning its ends by xi theta_n gives it the curvature
(1 - xi) kappa_n. Out-of-plane perturbations obey (20a)-(20f) on [0, theta_n (1 - xi)] with x_1 = psi_2 = psi_3 = 0 at both ends
(20g). Here two methods solve the same equations:

- `shooting_determinant` integrates (20) as printed, lengths in units of the actual radius;
- `factors` is its closed form. By symmetry about the middle it is a product, of a factor for the modes with psi_2 even
  and one for those with psi_2 odd: det S = -8 (1 - xi)**4 even odd / t. It is written in units of the natural radius 1/kappa_n,
  where only the law becomes singular.

The argument ``parameters`` has those of the law by name, in units of the natural radius R (the Gamma of the law 'finite width'
is w**2/(R h)); a number is the first one. Its t may vanish twice in 0 < xi < 1, or not at all; for small widths it never does.

xi = 1, the flat strip, is a singular point of the scaling in (20): the interval shrinks to nothing and both forms vanish there
with a power of 1 - xi, for any kind of strip. It is not a root. `first_root` leaves |1 - xi| < `FLAT` out.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping

import numpy as np

from ribbon_model import linear
from ribbon_model.law import Law
from ribbon_model.older import takes_parameters

#: Half width in xi of the interval around the flat state that is left out; the flat state is not a root.
FLAT = 0.01
#: Smallest 1 - xi at which a zero of t is looked for; it is of the order of 1/Gamma of the law 'finite width'.
_FLATTEST = 1e-7
#: Conditions at both ends, by the number of the state in (x_1, psi_2, psi_3, M_2, M_3, R_1) that vanishes there.
CLAMPED = (0, 1, 2)
HINGED = (0, 2, 3)


@takes_parameters
def system_matrix(law: Law, parameters, xi) -> np.ndarray:
    """Return the matrix of (20), y' = matrix y with y = (x_1, psi_2, psi_3, M_2, M_3, R_1); shape (..., 6, 6).

    For g infinite (20b) is psi_2' = psi_3: M_2 is then a reaction, determined by (20d) to (20f).

    Raises
    ------
    ValueError
        xi = 1 (no radius), or t = 0 (the ribbon at xi = 1 - nu).

    Examples
    --------
    >>> from ribbon_model.laws import RIBBON
    >>> system_matrix(RIBBON, 0.3, 0.5).shape
    (6, 6)
    """
    values = law.named(parameters)
    xi, *_ = np.broadcast_arrays(np.asarray(xi, float), *values.values())
    if np.any(xi == 1):
        raise ValueError("xi = 1 is the flat strip: it has no radius to scale lengths with")
    radius = 1 / (1 - xi)
    circle = law.on_circle(1.0, radius, *law.scaled(values, radius).values())
    moment, g, t = circle.moment, circle.contrast, circle.twisting  # the moment: (17a)
    if np.any(t == 0):
        raise ValueError("the tangent twisting modulus vanishes: (20c) cannot be solved for psi_3'")
    matrix = np.zeros((*xi.shape, 6, 6))
    matrix[..., 0, 1] = 1  # (20a)
    matrix[..., 1, 2], matrix[..., 1, 3] = 1 - moment / g, 1 / g  # (20b)
    matrix[..., 2, 1], matrix[..., 2, 4] = moment / t - 1, 1 / t  # (20c)
    matrix[..., 3, 4], matrix[..., 3, 5], matrix[..., 4, 3] = 1, -1, -1  # (20d), (20e)
    return matrix


@takes_parameters
def shooting_determinant(law: Law, parameters, xi, theta_n: float = math.pi, ends=CLAMPED) -> np.ndarray:
    """Return det S(theta_n, nu, xi) of section 5.3, by the matrix exponential; shape of xi and parameters broadcast.

    Parameters
    ----------
    ends : tuple
        `CLAMPED`, (20g), or `HINGED`: M_2 = 0 instead of psi_2 = 0, ends free to turn about the normal of the strip.

    Raises
    ------
    ValueError
        As `system_matrix`.

    Examples
    --------
    >>> from ribbon_model.laws import RIBBON
    >>> closed, shot = (first_root(RIBBON, 0.3, method=method) for method in ("closed form", "shooting"))
    >>> abs(closed - shot) < 1e-9
    True
    """
    from scipy.linalg import expm

    xi = np.asarray(xi, float)
    transfer = expm(system_matrix(law, parameters, xi) * (theta_n * (1 - xi))[..., None, None])
    free = [i for i in range(6) if i not in ends]
    return np.linalg.det(transfer[..., np.array(ends)[:, None], np.array(free)])


@takes_parameters
def factors(law: Law, parameters, xi, theta_n: float = math.pi) -> tuple[np.ndarray, np.ndarray]:
    """Return the factors (even, odd) of the determinant with (20g), in closed form; shape of xi and parameters broadcast.

    With curvature kappa = 1 - xi, moment M = kappa - 1 (times B kappa_n), torsional stiffness T = t kappa, half length H and

        w**2 = (kappa - M/g) (T - M) kappa / T,   s = sin(kappa H)/kappa,   S = sin(w H)/w,   C = cos(w H),
        Q = (S - H C)/w**2,

    psi_2 = const + a cos(kappa s) + A cos(w s) (even modes) or the same with sines (odd ones); the conditions at one end are

        even = s (M (kappa - M/g) kappa Q / T - H C) + H cos(kappa H) S,   odd = kappa s C - cos(kappa H) (kappa - M/g) S.

    Both are divided by M, which cancels the coincidence w = kappa at xi = 0; that removes no root (and in `even`, T - M, the
    coincidence w = 0, has been divided out). At the flat state they vanish with a power of kappa.

    Raises
    ------
    ValueError
        xi = 0. Where T = 0 (the ribbon at xi = 1 - nu) the result is not a number.

    Examples
    --------
    >>> from ribbon_model.laws import RIBBON
    >>> root = first_root(RIBBON, 0.3)
    >>> min(abs(float(factor)) for factor in factors(RIBBON, 0.3, root)) < 1e-9
    True
    """
    values = law.named(parameters)
    xi, *_ = np.broadcast_arrays(np.asarray(xi, float), *values.values())
    if np.any(xi == 0):
        raise ValueError("xi = 0 is the natural state: nothing to divide by")
    kappa, half = 1 - xi, theta_n / 2
    with np.errstate(divide="ignore", invalid="ignore"):
        circle = law.on_circle(kappa, 1.0, *values.values())
        moment, g, torsion, compliance = circle.moment, circle.contrast, circle.twisting * kappa, 1 / circle.twisting
    bending = kappa - moment / g
    with np.errstate(divide="ignore", invalid="ignore"):
        w_squared = bending * (torsion - moment) * compliance
        cosine, sine, difference = _trigonometric(w_squared, half)
    s, c = half * np.sinc(kappa * half / np.pi), np.cos(kappa * half)
    even = s * (moment * bending * compliance * difference - half * cosine) + half * c * sine
    odd = kappa * s * cosine - c * bending * sine
    return even / moment, odd / moment


def _trigonometric(w_squared, half):
    """Return C = cos(w H), S = sin(w H)/w and Q = (S - H C)/w**2, for w**2 of either sign: entire functions of w**2."""
    w = np.sqrt(np.abs(w_squared))
    phase, positive = w * half, w_squared >= 0
    bounded = np.minimum(phase, 700.0)  # where cosh would overflow
    cosine = np.where(positive, np.cos(phase), np.cosh(bounded))
    with np.errstate(divide="ignore", invalid="ignore"):
        sine = np.where(positive, half * np.sinc(phase / np.pi), np.where(w == 0, half, np.sinh(bounded) / w))
        direct = (sine - half * cosine) / w_squared
    z = w_squared * half**2
    series = half**3 * (1 / 3 - z / 30 + z**2 / 840 - z**3 / 45360)
    return cosine, sine, np.where(np.abs(z) < 0.02, series, direct)


@takes_parameters
def first_root(
    law: Law, parameters: float | Mapping[str, float], theta_n: float = math.pi, ends: tuple[int, int, int] = CLAMPED,
    largest: float = 6.0, method: str = "closed form",
) -> float | None:  # fmt: skip
    """Return the smallest xi > 0 with a marginal out-of-plane mode of the arc, to about 1e-12, or None below ``largest``.

    Sign changes are bracketed on a fixed grid and closed in by Brent's method, in each factor separately or in the determinant.

    - The flat state xi = 1 is left out.
    - Roots accumulate below the first zero of t in 0 < xi < 1, if there is one (ribbon, nu > 0: xi = 1 - nu); the grid gets
      finer towards it and ends there. Beyond, t < 0 and every high wavenumber is unstable.
    - The search ends at the flat state if t < 0 beyond it (ribbon, nu < 0: there is no root, None).

    Parameters
    ----------
    ends : tuple
        `CLAMPED`, (20g), or `HINGED`, for the shooting method only.
    method : str
        'closed form' (`factors`) or 'shooting' (`shooting_determinant`).

    Raises
    ------
    ValueError
        See `Law.values`; theta_n or ``largest`` not positive, an unknown method, `HINGED` with the closed form, or a
        determinant that is zero throughout (isotropic rod with `HINGED` ends, nu = 0, where t = g).

    Examples
    --------
    >>> from ribbon_model.laws import RIBBON
    >>> round(first_root(RIBBON, 0.3), 6)
    0.696057
    """
    from scipy.optimize import brentq

    if not (theta_n > 0 and largest > 0):
        raise ValueError(f"theta_n = {theta_n:g}, largest = {largest:g}: must be positive")
    known = law.values(parameters)
    found, end = [], _zero_of_t(law, known)
    for low, high in _pieces(law, known, largest, end):
        for function in _functions(law, known, theta_n, ends, method):
            grid = _grid(low, high, end)
            values = function(grid)
            if not np.max(np.abs(values)) > 1e-12:
                raise ValueError(f"{law.name}: the determinant vanishes for every xi, these ends leave a mechanism")
            for i in np.flatnonzero(np.sign(values[:-1]) * np.sign(values[1:]) <= 0)[:1]:
                found.append(brentq(lambda xi, f=function: float(f(xi)), grid[i], grid[i + 1], xtol=1e-14, rtol=1e-14))
        if found:
            return min(found)
    return None


def _functions(law: Law, values, theta_n, ends, method) -> list[Callable]:
    """Return the functions of xi whose zeros are the modes."""
    if method == "shooting":  # det S has the factor (1 - xi)**4 / t
        return [lambda xi: shooting_determinant(law, values, xi, theta_n, ends) / (1 - np.asarray(xi)) ** 4]
    if method != "closed form":
        raise ValueError(f"method {method!r}: 'closed form' or 'shooting'")
    if ends != CLAMPED:
        raise ValueError("the closed form is for the ends (20g); use the method 'shooting'")
    return [lambda xi, i=i: factors(law, values, xi, theta_n)[i] for i in (0, 1)]


def _zero_of_t(law: Law, values) -> float | None:
    """Return the smallest xi in (0, 1) where t vanishes, or None."""
    from scipy.optimize import brentq

    def t(xi):
        return law.on_circle(1 - xi, 1.0, *values.values()).twisting

    grid = 1 - linear.places_between(1.0, _FLATTEST)
    below = np.flatnonzero(t(grid) + 0 * grid < 0)
    return float(brentq(t, grid[below[0] - 1], grid[below[0]], xtol=1e-15)) if below.size else None


def _pieces(law: Law, values, largest, singular):
    """Return the intervals of xi without a singular point inside."""
    if singular is not None:
        return [(0.0, min(largest, singular))]
    pieces = [(0.0, min(largest, 1 - FLAT))]
    if largest > 1 + FLAT and law.on_circle(-FLAT, 1.0, *values.values()).twisting > 0:
        pieces.append((1 + FLAT, largest))
    return pieces


def _grid(low, high, singular):
    """Return the points from ``low`` to ``high``, both left out if singular; denser towards the zero of t."""
    start = max(low, 1e-3 * (high - low))
    uniform = np.linspace(start, high, 2 + int((high - start) / 0.01))
    if singular is None:
        return uniform
    points = np.union1d(uniform, singular - singular * np.geomspace(1.0, 1e-9, 1200))
    return points[(points >= start) & (points <= high) & (points < singular)]
