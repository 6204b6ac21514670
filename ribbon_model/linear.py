"""Linear stability of the m-covered circle: the circle bifurcations (section 6.2 of Audoly & Seffen 2015)."""

from __future__ import annotations

import math

from ribbon_model.laws import FLAT_ROD, ISOTROPIC_ROD, RIBBON, Law


def thresholds(law: Law, m: int, n: int, nu: float) -> tuple[float, ...]:
    """The values of kappa_n (L = 2 pi) where the mode of wavenumber n leaves the m-covered circle: m K, b = 0 in (25b).

    One value for the ribbon (equation (27)) and the flat rod, two for the isotropic rod (nearer to kappa_n = m first).
    With k = n/m, M = 1 - K and g infinite, b = 0 reads 1 - K = t (1 - k^2); nu -> 0 is a removable singularity of (27).

    Raises
    ------
    ValueError
        n = m, a rigid rotation; or, for nu < 0, a mode whose threshold lies beyond kappa_n = m / nu, where the ribbon's
        tangent twisting modulus t = 2 (1 - nu K) is not positive and the law's regular root ends.
    """
    if n == m:
        raise ValueError(f"n = m = {m} is a rigid rotation, not a bifurcation")
    s = (n / m) ** 2 - 1
    if law is RIBBON:  # 1 - K = -2 (1 - nu K) s
        if 1 + 2 * nu * s <= 0:  # 1 - nu K = (1 - nu) / (1 + 2 nu s) is the tangent twisting modulus over 2
            raise ValueError(f"m = {m}, n = {n}, nu = {nu:g}: no threshold where the ribbon's twisting modulus is positive")
        return (m * (1 + 2 * s) / (1 + 2 * nu * s),)
    if law is FLAT_ROD:
        return (m * (1 + 2 * s / (1 + nu)),)
    if law is ISOTROPIC_ROD:  # M^2 - (1 + t) M - t s = 0
        t = 1 / (1 + nu)
        root = math.sqrt((1 + t) ** 2 + 4 * t * s)
        values = (m * (1 - (1 + t - root) / 2), m * (1 - (1 + t + root) / 2))
        return tuple(sorted(values, key=lambda value: abs(value - m)))
    raise ValueError(f"the law {law.name!r} has no closed formula here")


def stability_interval(law: Law, m: int, nu: float) -> tuple[float, float]:
    """The kappa_n r0 around the natural state 1 for which the m-covered circle is linearly stable, as published (Fig. 10).

    Its ends are where the second root (26b), b k^2 (1 - k^2) / c, first changes sign for some wavenumber n other than m: b = 0,
    or c = 0 for the isotropic rod. (Where c < 0 the energy has a negative direction even if (26b) comes out positive, so in
    this interval around 1 the energy is a minimum too.) Infinite where no mode ends it: m = 1, below.
    """
    low, high = -math.inf, math.inf
    for n in range(1, 8 * m + 8):  # thresholds move away from 1 as n moves away from m
        if n == m:
            continue
        try:
            ends = [value / m for value in thresholds(law, m, n, nu)]
        except ValueError:  # no such threshold for this nu < 0
            continue
        if law is ISOTROPIC_ROD:
            ends.append(-((n / m) ** 2) / (1 + nu))  # c = 0: M = 1 + k^2 t
        low = max([low, *(end for end in ends if end < 1)])
        high = min([high, *(end for end in ends if end > 1)])
    return low, high
