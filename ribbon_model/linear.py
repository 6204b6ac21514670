"""Linear stability of the m-covered circle (section 6.2 of Audoly & Seffen 2015): bifurcations, intervals, index of the energy.

kappa_n is in units of L = 2 pi, so kappa_n r0 = kappa_n / m on the m-covered circle. There are two notions of stability,
which differ for the isotropic rod:

- as published: every root (26b), b k**2 (1 - k**2) / c, is positive;
- of the energy: its second variation has no negative direction. The balance (16c) has no rotational inertia, so where gc, the
  stiffness of a pure twist, is negative the published root can come out positive although the energy is not a minimum.

For the ribbon, the flat rod and the law 'finite width' g is infinite, c = 1, and both agree. Gamma, the last argument of
the functions here, is for the law 'finite width' only.
"""

from __future__ import annotations

import contextlib
import math

from ribbon_model.dispersion import coefficients
from ribbon_model.laws import Law, NoThreshold


def thresholds(law: Law, m: int, n: int, nu: float, Gamma: float | None = None) -> tuple[float, ...]:
    """Return the values of kappa_n (L = 2 pi) where the mode of wavenumber n leaves the m-covered circle: m K, b = 0 in (25b).

    One value for the ribbon (equation (27)), the flat rod and the law 'finite width', two for the isotropic rod (nearer to
    kappa_n = m first).
    With k = n/m, M = 1 - K and g infinite, b = 0 reads 1 - K = t (1 - k^2); nu -> 0 is a removable singularity of (27).

    Raises
    ------
    ValueError
        n = m, a rigid rotation; or, for nu < 0, a mode whose threshold lies beyond kappa_n = m / nu, where the ribbon's
        tangent twisting modulus t = 2 (1 - nu K) is not positive and the law's regular root ends. Finite width: no threshold
        where the law is convex. Gamma: see `Law.values`.

    Examples
    --------
    >>> from ribbon_model.laws import RIBBON
    >>> [round(thresholds(RIBBON, 1, n, 0.3)[0], 6) for n in (2, 3)]
    [2.5, 2.931034]
    """
    law.values(nu, Gamma)
    if n == m:
        raise ValueError(f"n = m = {m} is a rigid rotation, not a bifurcation")
    return law.thresholds(m, n, nu, Gamma)


def circle(law: Law, m: int, kappa_n: float, nu: float, Gamma: float | None = None) -> dict[str, float]:
    """M1, kappa_star (28) and energy (over 2 pi B / L, without the constant kappa_n**2/2) of the planar m-covered circle.

    Examples
    --------
    >>> from ribbon_model.laws import RIBBON
    >>> circle(RIBBON, 1, 2.5, 0.3)
    {'M1': -1.5, 'kappa_star': 1, 'energy': -2.0}
    """
    return law.circle(m, kappa_n, nu, Gamma)


def covering(kappa_n: float, kappa_star: float, energy: float) -> int:
    """Return the covering index of the circle that has these values, of any law.

    The energy of a planar circle is a multiple of (omega_1 - kappa_n)**2, without kappa_n**2 / 2, so kappa_n**2 + 2 energy is
    (m - kappa_n) (kappa_star - kappa_n). Negative where the circle is curled against its natural curvature.

    Examples
    --------
    >>> from ribbon_model.laws import RIBBON
    >>> values = circle(RIBBON, 3, 2.5, 0.3)
    >>> covering(2.5, values["kappa_star"], values["energy"])
    3
    """
    if kappa_star == kappa_n:  # the natural state
        return round(kappa_n)
    return round(kappa_n + (kappa_n * kappa_n + 2 * energy) / (kappa_star - kappa_n))


def stability_interval(law: Law, m: int, nu: float, Gamma: float | None = None) -> tuple[float, float]:
    """Return the kappa_n r0 around the natural state 1 for which the m-covered circle is linearly stable (Fig. 10).

    On either side it ends at the threshold of n = m - 1 or m + 1: thresholds move away from 1 as n moves away from m.
    The ribbon also has the limit 1/nu, where t = 0 and all high wavenumbers become unstable together; it comes first only
    for nu < 0, m = 1. An end may be infinite. The boundary c = 0 of the isotropic rod is never an end: where c = 0,
    b (1 - k**2) = -(t k (1 - k**2))**2 / g, so the mode is unstable already. (Beyond c = 0 all published roots may become
    positive again, for example at m = 2, nu = -.3: these are not minima of the energy.)

    For the isotropic rod the energy of this interval need not be a minimum: see `energy_interval`.

    Raises
    ------
    ValueError
        m < 1, nu outside (-1, 1), or a law without closed formulas.

    Examples
    --------
    >>> from ribbon_model.laws import RIBBON
    >>> stability_interval(RIBBON, 1, 0.3)
    (-inf, 2.5)
    """
    _check(m, nu)
    ends = []
    for n in (m - 1, m + 1):
        if n == 0:
            continue
        with contextlib.suppress(NoThreshold):  # nu away from 0, beyond the modes that have one: a limit of the law comes first
            ends += [value / m for value in thresholds(law, m, n, nu, Gamma)]
    ends += law.convex_limits(m, nu, Gamma)
    return max([-math.inf, *(end for end in ends if end < 1)]), min([math.inf, *(end for end in ends if end > 1)])


def energy_interval(law: Law, m: int, nu: float, Gamma: float | None = None) -> tuple[float, float]:
    """Return the kappa_n r0 around 1 for which the energy of the m-covered circle is a minimum; raises as `stability_interval`.

    It is `stability_interval`, cut at kappa_n r0 = 1 - g: below that the moment of the circle, 1 - kappa_n r0, exceeds g, and
    turning the strip about its own centreline lowers the energy (n = 0, not among the modes of (26): it moves no mass). This
    affects the isotropic rod, g = 1, at m = 1: a ring cannot be stable inside out.

    Examples
    --------
    >>> from ribbon_model.laws import ISOTROPIC_ROD
    >>> round(energy_interval(ISOTROPIC_ROD, 1, 0.3)[0], 6), round(stability_interval(ISOTROPIC_ROD, 1, 0.3)[0], 6)
    (0.0, -1.642522)
    """
    low, high = stability_interval(law, m, nu, Gamma)
    g, _ = law.tangent_moduli(1.0, nu, _width(law, m, nu, Gamma))
    return max(low, 1 - g), high


def index(law: Law, m: int, kappa_n: float, nu: float, Gamma: float | None = None) -> float:
    """Return the number of negative directions of the energy of the m-covered circle, closed loops only; kappa_n for L = 2 pi.

    Each wavenumber n counts twice, cosine and sine. With b, c of (25) the quadratic form of (psi_2, psi_3) has the determinant
    g b (1 - k**2) and the diagonal term g c, so it has

    - one negative direction where b (1 - k**2) < 0; two where c < 0 instead; none otherwise;
    - n = m: one where c < 0 (the other is the rigid rotation);
    - n = 0: one, once, where c < 0: turning about the centreline (uniform psi_2 would open the loop).

    For g infinite c = 1 and only the sign of b (1 - k**2) counts. In-plane perturbations never lower the energy while the
    tangent bending modulus is positive, which it is for the laws of the paper.

    Returns
    -------
    int or float
        ``math.inf`` where a tangent modulus of twisting (zero too, if kappa_n > m) or of bending is negative: all high n are
        unstable.

    Raises
    ------
    ValueError
        See `stability_interval`. On a bifurcation the zero directions are not counted.

    Examples
    --------
    >>> from ribbon_model.laws import RIBBON
    >>> [index(RIBBON, 1, kappa_n, 0.3) for kappa_n in (1.0, 3.0, 6.0)]
    [0, 4, inf]
    """
    _check(m, nu)
    ratio, width = kappa_n / m, _width(law, m, nu, Gamma)
    moment = law.prestress(ratio, nu, width)
    g, t = law.tangent_moduli(ratio, nu, width)
    if t < 0 or (t == 0 and moment < 0):
        return math.inf
    if law.tangent_bending(ratio, nu, width) < 0:
        return math.inf
    count = 0 if moment <= g else 1
    n = 0
    # modes beyond m are stable from the first one for which b < 0 and c > 0: b falls and c grows with n
    while True:
        n += 1
        k = n / m
        b, c = coefficients(moment, g, t, k)
        if n == m:
            count += 2 if c < 0 else 0
            continue
        if b * (1 - k * k) < 0:
            count += 2
        elif c < 0:
            count += 4
        elif n > m:
            return count


def _width(law: Law, m: int, nu: float, Gamma: float | None) -> float:
    """w**2/(h r0) of the m-covered circle; 0 for a law without a width."""
    return m * law.values(nu, Gamma).get("Gamma", 0.0)


def _check(m, nu):
    if m != int(m) or m < 1:
        raise ValueError(f"m = {m}: the covering index is a whole number from 1")
    if not -1 < nu < 1:
        raise ValueError(f"nu = {nu:g} is outside (-1, 1)")
