"""Linear stability of the m-covered circle (section 6.2 of Audoly & Seffen 2015): bifurcations, intervals, index of the energy.

kappa_n is in units of L = 2 pi, so kappa_n r0 = kappa_n / m on the m-covered circle. There are two notions of stability,
which differ for the isotropic rod:

- as published: every root (26b), b k**2 (1 - k**2) / c, is positive;
- of the energy: its second variation has no negative direction. The balance (16c) has no rotational inertia, so where gc, the
  stiffness of a pure twist, is negative the published root can come out positive although the energy is not a minimum.

For laws with omega_2 = 0 g is infinite, c = 1, and both agree. All numbers follow from the moment and the tangent moduli of
circles, `ribbon_model.law.Law.on_circle`, by closed formulas where the law has them, else by a search along kappa_n. The
argument ``parameters`` has those of the law, by name; a number is the first one.
"""

from __future__ import annotations

import contextlib
import functools
import math
from collections.abc import Callable, Mapping

from ribbon_model.dispersion import coefficients
from ribbon_model.law import Circle, Law, NoThreshold
from ribbon_model.older import takes_parameters

#: Smallest distance of kappa_n from the natural state, over m, at which zeros are looked for.
_NEAREST = 1e-5
#: Largest one: a law without an end up to there counts as regular.
_FARTHEST = 1e4
#: Places in a decade at which a zero is looked for: two nearer to each other than 0.6 % of their distance from the natural
#: state are missed; with ten times fewer places, 6 %.
_PLACES = 400
#: Largest covering index that a circle is compared with; scenes allow 1000 and wavenumbers up to 1000.
_MOST_COVERED = 3000


def places_between(low, high):
    """Return places from ``low`` to ``high``, evenly spaced in the logarithm, at which zeros are looked for."""
    import numpy as np

    return np.geomspace(low, high, math.ceil(_PLACES * abs(math.log10(high / low))) + 1)


@takes_parameters
def thresholds(law: Law, m: int, n: int, parameters: float | Mapping[str, float]) -> tuple[float, ...]:
    """Return the values of kappa_n (L = 2 pi) where the mode of wavenumber n leaves the m-covered circle: m K, b = 0 in (25b).

    One value for the ribbon (equation (27)) and the flat rod, two for the isotropic rod; the law 'finite width' may have a
    second one, far from the natural state. The nearest to kappa_n = m comes first. With k = n/m, M = 1 - K and g infinite,
    b = 0 reads 1 - K = t (1 - k^2); nu -> 0 is a removable singularity of (27).

    Parameters
    ----------
    parameters : mapping of str to float, or float
        The law's parameters by name, or its first one.

    Raises
    ------
    ValueError
        n = m, a rigid rotation; or `NoThreshold`: none where the tangent moduli of the circle are positive. For nu < 0 the
        ribbon's modulus t = 2 (1 - nu K) vanishes at kappa_n = m / nu. See `Law.values` for the parameters.

    Examples
    --------
    >>> from ribbon_model.laws import RIBBON
    >>> [round(thresholds(RIBBON, 1, n, 0.3)[0], 6) for n in (2, 3)]
    [2.5, 2.931034]
    """
    values = tuple(law.values(parameters).values())
    if n == m:
        raise ValueError(f"n = m = {m} is a rigid rotation, not a bifurcation")
    known = law.closed_thresholds(m, n, *values)
    if known is not None:
        return known
    found = []
    for places, _ in _sides(law, m, values):
        found += _zeros(lambda circle: _coefficients(circle, m, n / m)[0], law, m, values, places)
    if not found:
        names = "".join(f", {name} = {value:g}" for name, value in zip(law.parameters, values))
        raise NoThreshold(f"m = {m}, n = {n}{names}: no threshold where the strain energy of a circle is convex")
    return tuple(sorted(found, key=lambda kappa_n: abs(kappa_n - m)))


def _coefficients(circle: Circle, m: int, k: float) -> tuple:
    """Return b and c of (25b), (25c) of a circle."""
    return coefficients(circle.moment / m, circle.contrast, circle.twisting, k)


def _zeros(function: Callable[[Circle], float], law: Law, m: int, values: tuple, places) -> list[float]:
    """Return the kappa_n at which a function of a circle changes sign between neighbouring places (K,), in their order."""
    import numpy as np

    def at(kappa_n):
        return function(law.on_circle(m, kappa_n, *values))

    positive = at(places) > 0
    return [_root(at, places[i], places[i + 1]) for i in np.flatnonzero(positive[:-1] != positive[1:])]


def _root(function: Callable, a: float, b: float) -> float:
    """Return a zero between two places where a function of arrays has different signs, to round-off, on its positive side.

    Each round divides their distance by 16. SciPy's ``brentq`` finds the same within two units in the last place, but takes
    .2 s to load, as long as the check of a scene.
    """
    import numpy as np

    places = np.linspace(a, b, 17)
    while len(places) == 17:  # fewer where no further numbers lie between
        values = function(places)
        if np.any(values == 0):
            return float(places[values == 0][0])
        i = np.flatnonzero((values[:-1] > 0) != (values[1:] > 0))[0]
        places = np.unique(np.linspace(places[i], places[i + 1], 17))
    return float(places[function(places) > 0][0])


@functools.lru_cache(maxsize=1000)
def _sides(law: Law, m: int, values: tuple) -> tuple:
    """Return places of kappa_n at which modes are looked for, below and above, and where a modulus vanishes, or infinity."""
    import numpy as np

    def least(kappa_n):
        circle = law.on_circle(m, kappa_n, *values)
        value = np.minimum(circle.bending, circle.twisting + 0 * kappa_n)
        return np.where(value > 0, value, -1.0)  # it may be zero beyond the limit (a convex envelope), or not a number

    found = []
    for sign in (-1, 1):
        places = m + sign * abs(m) * np.append(0.0, places_between(_NEAREST, _FARTHEST))
        beyond, limit = np.flatnonzero(~(least(places) > 0)), sign * math.inf
        if beyond.size:
            first = beyond[0]
            limit = _root(least, places[first - 1], places[first]) if first else float(m)
            places = np.append(places[:first], limit)
        found.append((places, limit))
    return tuple(found)


@takes_parameters
def convex_limits(law: Law, m: int, parameters: float | Mapping[str, float]) -> tuple[float, float]:
    """Return the kappa_n below and above m at which a tangent modulus of bending or twisting of the m-covered circle vanishes.

    They are infinite where none vanishes.

    Examples
    --------
    >>> from ribbon_model.laws import RIBBON
    >>> convex_limits(RIBBON, 1, 0.25)
    (-inf, 4.0)
    """
    values = tuple(law.values(parameters).values())
    known = law.closed_limits(m, *values)
    return tuple(limit for _, limit in _sides(law, m, values)) if known is None else known


@takes_parameters
def circle(law: Law, m: int, kappa_n: float, parameters: float | Mapping[str, float]) -> dict[str, float]:
    """M1, kappa_star (28) and energy (over 2 pi B / L, without the constant kappa_n**2/2) of the planar m-covered circle.

    Examples
    --------
    >>> from ribbon_model.laws import RIBBON
    >>> circle(RIBBON, 1, 2.5, 0.3)
    {'M1': -1.5, 'kappa_star': 1, 'energy': -2.0}
    """
    return law.circle(m, kappa_n, parameters)


def covering(law: Law, parameters: float | Mapping[str, float], kappa_n: float, kappa_star: float, energy: float) -> int:
    """Return the covering index of the circle that has these values, negative if it is curled against its natural curvature.

    It is the whole number whose circle has the nearest ones. (The energy alone is that of two circles.)

    Examples
    --------
    >>> from ribbon_model.laws import RIBBON
    >>> values = circle(RIBBON, 3, 2.5, 0.3)
    >>> covering(RIBBON, 0.3, 2.5, values["kappa_star"], values["energy"])
    3
    """
    import numpy as np

    m = np.delete(np.arange(-_MOST_COVERED, _MOST_COVERED + 1.0), _MOST_COVERED)
    known = law.on_circle(m, kappa_n, *law.values(parameters).values())
    return round(m[np.nanargmin(abs(known.kappa_star - kappa_star) + abs(known.energy - energy))])


@takes_parameters
def stability_interval(law: Law, m: int, parameters: float | Mapping[str, float]) -> tuple[float, float]:
    """Return the kappa_n r0 around the natural state 1 for which the m-covered circle is linearly stable (Fig. 10).

    On either side it ends at the threshold of n = m - 1 or m + 1: thresholds move away from 1 as n moves away from m; or at
    `convex_limits`, where all high wavenumbers become unstable together. The ribbon's, 1/nu, comes first only for nu < 0,
    m = 1. An end may be infinite. The boundary c = 0 of the isotropic rod is never an end: where c = 0,
    b (1 - k**2) = -(t k (1 - k**2))**2 / g, so the mode is unstable already. (Beyond c = 0 all published roots may become
    positive again, for example at m = 2, nu = -.3: these are not minima of the energy.)

    For the isotropic rod the energy of this interval need not be a minimum: see `energy_interval`.

    Raises
    ------
    ValueError
        m < 1, or parameters that the law does not allow.

    Examples
    --------
    >>> from ribbon_model.laws import RIBBON
    >>> stability_interval(RIBBON, 1, 0.3)
    (-inf, 2.5)
    """
    _check(m)
    ends = list(convex_limits(law, m, parameters))
    for n in (m - 1, m + 1):
        if n == 0:
            continue
        with contextlib.suppress(NoThreshold):  # nu away from 0, beyond the modes that have one: a limit of the law comes first
            ends += thresholds(law, m, n, parameters)
    return max([-math.inf, *(end / m for end in ends if end < m)]), min([math.inf, *(end / m for end in ends if end > m)])


@takes_parameters
def energy_interval(law: Law, m: int, parameters: float | Mapping[str, float]) -> tuple[float, float]:
    """Return the kappa_n r0 around 1 for which the energy of the m-covered circle is a minimum; raises as `stability_interval`.

    It is `stability_interval`, cut where the moment of the circle (1 - kappa_n r0, in units of B/r0) exceeds g: beyond that
    turning the strip about its own centreline lowers the energy (n = 0, not among the modes of (26): it moves no mass). This
    affects the isotropic rod, g = 1, at m = 1: a ring cannot be stable inside out.

    Examples
    --------
    >>> from ribbon_model.laws import ISOTROPIC_ROD
    >>> round(energy_interval(ISOTROPIC_ROD, 1, 0.3)[0], 6), round(stability_interval(ISOTROPIC_ROD, 1, 0.3)[0], 6)
    (0.0, -1.642522)
    """
    low, high = stability_interval(law, m, parameters)
    if law.constrained:
        return low, high
    values = tuple(law.values(parameters).values())
    turning = _zeros(lambda circle: circle.moment / m - circle.contrast, law, m, values, _sides(law, m, values)[0][0])
    return max([low, *(kappa_n / m for kappa_n in turning[:1])]), high


@takes_parameters
def index(law: Law, m: int, kappa_n: float, parameters: float | Mapping[str, float]) -> float:
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
    _check(m)
    circle = law.on_circle(m, kappa_n, *law.values(parameters).values())
    if circle.twisting < 0 or (circle.twisting == 0 and circle.moment < 0) or circle.bending < 0:
        return math.inf
    count = 0 if circle.moment / m <= circle.contrast else 1
    n = 0
    # modes beyond m are stable from the first one for which b < 0 and c > 0: b falls and c grows with n
    while True:
        n += 1
        b, c = _coefficients(circle, m, n / m)
        if n == m:
            count += 2 if c < 0 else 0
            continue
        if b * (m - n) < 0:
            count += 2
        elif c < 0:
            count += 4
        elif n > m:
            return count


def _check(m):
    if m != int(m) or m < 1:
        raise ValueError(f"m = {m}: the covering index is a whole number from 1")
