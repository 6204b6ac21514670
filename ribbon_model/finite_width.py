"""A strip of finite width, between the flat rod and the ribbon: the law "finite width", given by its strain energy.

The paper (Audoly & Seffen 2015) compares two limits. With Gamma = w**2/(h L/2pi), w the width and h the thickness, one law
joins them. A strip that is bent to omega_1 and twisted by omega_3 chooses the profile zeta(y) of its cross-section: plate
bending with the curvatures omega_1 - kappa_n, zeta'' and omega_3, and stretching by epsilon_0 + omega_3**2 y**2/2 - omega_1
zeta along the strip. (Audoly & Neukirch 2021, "A one-dimensional model for elastic ribbons: a little stretching makes a big
difference", here with kappa_n.) The best profile is a beam on an elastic foundation, and leaves, in units of the plate
modulus times w,

    U = (1 - nu**2) (omega_1 - kappa_n)**2 / 2 + (1 - nu) omega_3**2 + C g(C omega_1**2) Q**2 / 2 - kappa_n**2 / 2,
    Q = omega_3**2 + nu omega_1 (omega_1 - kappa_n),    C = 3 (1 - nu**2) Gamma**2,    omega_2 = 0,
    g(x**4) = (1 - G)/x**4,    G = 2 (cosh x - cos x) / (x (sinh x + sin x)):

the flat rod, and a penalty on Q, the Gaussian curvature of the section. U is even in omega_3 and smooth
for every omega_1, zero included. g falls from 1/180 to 1/x**4.

Normalisation: B is the modulus of the PLATE times w, for every Gamma. Then Gamma -> infinity is the ribbon (7) as it stands,
and Gamma = 0 is the flat rod (11) with all moments and energies times 1 - nu**2, the ratio of a beam's to a plate's modulus.
This factor does not change equilibria: kappa_n and the strains are the same. kappa* = -dU/dkappa_n is (1 - nu**2) times the
flat rod's, plus nu**2 kappa_n.

H is the Legendre transform of U. Where D2U is not positive definite it has several values or none: the law ends there, and
H is another minimum's or not a number. U and H are written once, as functions of numbers; `contin` differentiates them.
"""

from __future__ import annotations

import math
from typing import NamedTuple

from contin.lowlevel import levels

#: Below this x**4 the first pole of g and a series are used, of which `_TERMS` terms leave 1e-16 of g and 2e-14 of its fourth
#: derivative. The closed form loses 1e-13 of the fourth derivative there, and ten times more at 16.
SERIES_LIMIT = 64.0
_TERMS = 9
#: Poles of g that are summed for the series: the next is 1e-17 of the sum of the first two terms.
_POLES = 60


def _expansion() -> tuple[float, float, tuple[float, ...]]:
    """Return residue and place of the first pole of g, -lambda_1, and the coefficients of the power series of what is left.

    With z = -4 b**4, g has poles where tan b = -tanh b (the even modes of a free beam), with the residues 4 tanh(b)**2/b**2:
    it is the sum of c_k/(z + lambda_k). The second pole is at -3655, the first at -125. g(0) = 1/180 is their slowest sum.
    """
    roots = []
    for k in range(1, _POLES + 1):
        b = (k - 0.25) * math.pi
        for _ in range(5):
            tanh = math.tanh(b)
            b -= (math.tan(b) + tanh) / (1 + math.tan(b) ** 2 + 1 - tanh * tanh)
        roots.append(b)
    residues = [4 * math.tanh(b) ** 2 / b**2 for b in roots]
    places = [4 * b**4 for b in roots]
    rest = [(-1) ** j * math.fsum(c / place ** (j + 1) for c, place in zip(residues[1:], places[1:])) for j in range(_TERMS)]
    rest[0] = 1 / 180 - residues[0] / places[0]
    return residues[0], places[0], tuple(rest)


_RESIDUE, _POLE, _COEFFICIENTS = _expansion()


def membrane(z):
    """g at z = x**4 >= 0; free of overflow and of cancellation.

    Examples
    --------
    >>> round(membrane(0.0) * 180, 12)
    1.0
    """
    if z < SERIES_LIMIT:
        rest = _COEFFICIENTS[-1]
        for coefficient in _COEFFICIENTS[-2::-1]:
            rest = rest * z + coefficient
        return _RESIDUE / (z + _POLE) + rest
    return (1 - foundation(math.sqrt(math.sqrt(z)))) / z


def nearly_membrane(z):
    """Return g within 7 %, with the right values at 0 and infinity, for first guesses."""
    root = math.sqrt(z)
    return 1 / (z + 2 * root * math.sqrt(root) + 180)


def foundation(x):
    """G, for x of at least about 1; hyperbolic functions divided by exp(x)."""
    e = math.exp(-x)
    return 2 * (1 + e * e - 2 * e * math.cos(x)) / (x * (1 - e * e + 2 * e * math.sin(x)))


# --- the energy -------------------------------------------------------------------------------------------------------------


class Plate(NamedTuple):
    """The numbers on which U of a strip of a plate depends, over the modulus D22 of the plate across; see `ribbon_model.plate`.

    Attributes
    ----------
    nu, plane, twist, stiff : float
        D12/D22, D11/D22 - nu**2, 2 D66/D22, sqrt(D11/D22).
    C : float
        Of the membrane energy; not read of an inextensible ribbon.
    """

    nu: float
    plane: float
    twist: float
    stiff: float
    C: float

    def softened(self, part) -> Plate:
        """Return the section, over D22 times ``part``, of which the plate across has only this part of its stiffness."""
        plane = self.plane / part
        return Plate(self.nu, plane, self.twist / part, (plane + self.nu * self.nu) ** 0.5, self.C)


def isotropic(nu, Gamma) -> Plate:
    """Return the section of an isotropic strip."""
    plane = 1 - nu * nu
    return Plate(nu, plane, 1 - nu, 1.0, 3 * plane * Gamma * Gamma)


def section_energy(w1, w3, kappa_n, section: Plate):
    """Return U of a section, without the term -kappa_n**2/2."""
    nu, plane, twist, _, C = section
    bent = w1 - kappa_n
    Q = w3 * w3 + nu * w1 * bent
    return plane * bent * bent / 2 + twist * w3 * w3 + C * membrane(C * w1 * w1) * Q * Q / 2


def ribbon_energy(w1, w3, kappa_n, section: Plate):
    """Return U of an inextensible ribbon, g = 1/z, without the term -kappa_n**2/2."""
    nu, plane, twist, _, _ = section
    bent = w1 - kappa_n
    curved = w3 * w3 / w1 + nu * bent
    return plane * bent * bent / 2 + twist * w3 * w3 + curved * curved / 2


def isotropic_energy(w1, w2, w3, kappa_n, nu, Gamma):
    """Return U of an isotropic strip."""
    return section_energy(w1, w3, kappa_n, isotropic(nu, Gamma)) - kappa_n * kappa_n / 2


# --- the Legendre transform -------------------------------------------------------------------------------------------------


def hamiltonian(M1, M2, M3, kappa_n, nu, Gamma):
    """Return H of an isotropic strip, the Legendre transform of U; lengths are in units of a single loop's radius."""
    section = isotropic(nu, Gamma)
    return complementary(M1, M3, kappa_n, section, section.C < _NARROW) + kappa_n * kappa_n / 2


def complementary(M1, M3, kappa_n, section: Plate, narrow=False):
    """Return the largest M.omega - U of a section near `start`; nan where U is not convex.

    Where U - M.omega has two minima, a strip stays at the one from which it came. What is bent in the plane, from a circle or
    from an arc, came from the outer one if it is wide, and from the inner one if it is ``narrow``.

    A search that starts like a ribbon does not cross omega_1 = 0 where U is concave there, since another minimum lies beyond.
    """
    import numpy as np

    from contin.lowlevel import least  # loads compiled code, which circles do not need

    nu, plane, _, _, C = section
    w1, w3, wide = start(M1, M3, kappa_n, section, narrow)

    def excess(w):
        squared = w[1] * w[1]
        ridge = C * C * squared * squared / 22680 - C * nu * (nu * kappa_n * kappa_n + 2 * squared) / 180 - plane  # -U_11 there
        beyond = np.where(wide & (w[0] < 0) & (ridge > 0), math.inf, 0.0)
        return section_energy(w[0], w[1], kappa_n, section) - M1 * w[0] - M3 * w[1] + beyond

    return -least(excess, (w1, w3))


def ribbon_complementary(M1, M3, kappa_n, section: Plate):
    """Return the same of a ribbon, with omega_1 > 0 where there is such a minimum."""
    import numpy as np

    from contin.lowlevel import least

    w1, w3, known = ribbon_strains(M1, M3, kappa_n, section)
    side = np.where(known, 1.0, -1.0)

    def excess(w):
        if w[0] * side > 0:
            return ribbon_energy(w[0], w[1], kappa_n, section) - M1 * w[0] - M3 * w[1]
        return math.inf

    flat1, flat3 = flat_rod_strains(M1, M3, kappa_n, section)
    return -least(excess, (np.where(known, w1, flat1), np.where(known, w3, flat3)))


def ribbon_strains(M1, M3, kappa_n, section: Plate):
    """Return omega_1 > 0 and omega_3 of a ribbon, by a closed form, and 1, or 0 where it has none.

    It is exact where D12 + 2 D66 = sqrt(D11 D22), as for isotropic plates: scaled by stiff, U then has their form.
    """
    import numpy as np

    nu, _, _, stiff, _ = section
    m3, p = M3 / np.sqrt(stiff), M1 / stiff + (stiff - nu) * kappa_n
    root = np.sqrt(p * p + m3 * m3)
    a = np.where(p > 0, (p + root) / 2, m3 * m3 / (2 * (root - p) + 1e-300))
    eta, c = m3 / (2 * a + 1e-300), nu * kappa_n + a
    w1 = c / (1 + eta * eta)
    return w1 / stiff, eta * w1 / np.sqrt(stiff), (a > levels.CORRECTED * root) & (c > 0)


def start(M1, M3, kappa_n, section: Plate, narrow=False):
    """Return the strains at which the search for the minimum of U - M.omega starts, and whether they are the ribbon's.

    They are those of the ribbon where it is that wide, so that the search stays on the side omega_1 > 0 of the circles as
    long as there is a minimum. They are the flat rod's where the ribbon has none, and where the ribbon's other root, a < 0, has
    omega_1 > 0 and M1 is negative: that root is no minimum of the ribbon's U, but a strip of finite width, nearly planar there,
    has one. If it is ``narrow`` the flat rod is stiffened there by its membrane.
    """
    import numpy as np

    w1, w3, known = ribbon_strains(M1, M3, kappa_n, section)
    for _ in range(_ROUNDS):
        z = np.maximum(section.C * w1 * w1, _WIDE)
        part = z * nearly_membrane(z)
        w1, w3, _ = ribbon_strains(M1 / part, M3 / part, kappa_n, section.softened(part))
    p, m3 = M1 / section.stiff + (section.stiff - section.nu) * kappa_n, M3 / np.sqrt(section.stiff)
    planar = (p < -abs(m3)) & (np.sqrt(p * p + m3 * m3) - p < 2 * section.nu * kappa_n)
    known = known & (section.C * w1 * w1 > _WIDE) & ~planar
    flat1, flat3 = flat_rod_strains(M1, M3, kappa_n, section)
    stiffer = section.C * (section.nu * kappa_n) ** 2 / (180 * section.plane)
    flat1 = np.where(planar & narrow, flat1 / (1 + stiffer), flat1)
    return np.where(known, w1, flat1), np.where(known, w3, flat3), known


def flat_rod_strains(M1, M3, kappa_n, section: Plate):
    """Return omega_1 and omega_3 of a flat rod."""
    return kappa_n + M1 / section.plane, M3 / (2 * section.twist)


#: Rounds in which the strains of a ribbon are computed with the part of its membrane energy that a strip of this width has.
#: With two, the branches (9, 5) and (1, 5) of the tests are followed; with none they end at jumps to another minimum.
_ROUNDS = 2
#: x**4 of the single loop below which a strip is narrow: with less than 90, (1, 11) of nu = .1 is lost at its circle, with 100
#: (1, 5) of nu = .49.
_NARROW = 92.0
#: x**4 from which the search starts like a ribbon.
_WIDE = 1.0
