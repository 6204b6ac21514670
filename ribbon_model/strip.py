"""A real strip, in SI units, and the dimensionless numbers of this package: nu, Gamma, kappa_n, with B = 1 and L = 2 pi.

B is the bending modulus of the plate times the width, E h**3 w/(12 (1 - nu**2)), as in the laws 'ribbon' and 'finite width'.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, fields


@dataclass(frozen=True)
class Strip:
    """A strip of rectangular section, its ends joined.

    Attributes
    ----------
    width, thickness, length, natural_radius : float
        m; the natural radius is that of the open, unloaded strip, infinite if it is straight.
    poisson_ratio : float
    youngs_modulus : float
        Pa.

    Raises
    ------
    ValueError
        A field that is not positive and finite, or a strip that is not thinner than wide and narrower than long.

    Examples
    --------
    >>> steel = Strip(0.016, 0.00012, 0.6, 0.03, 0.3, 200e9)
    >>> round(steel.kappa_n, 4), round(steel.Gamma, 2)
    (3.1831, 22.34)
    """

    width: float
    thickness: float
    length: float
    natural_radius: float
    poisson_ratio: float
    youngs_modulus: float

    def __post_init__(self):
        for name in NAMES:
            value = getattr(self, name)
            if type(value) not in (int, float):
                raise ValueError(f"{name}: must be a number, not {value!r}")
            if name == "poisson_ratio":
                if not -1 < value <= 0.5:
                    raise ValueError(f"poisson_ratio: {value:g} must be greater than -1 and at most 0.5")
            elif not (value > 0 and (value < math.inf or name == "natural_radius")):
                allowed = "positive, .inf for a straight strip" if name == "natural_radius" else "positive and finite"
                raise ValueError(f"{name}: {value:g} must be {allowed}")
        if self.thickness > self.width:
            raise ValueError(f"thickness: {self.thickness:g} m must not exceed the width, {self.width:g} m")
        if self.width > self.length:
            raise ValueError(f"width: {self.width:g} m must not exceed the length, {self.length:g} m")
        if not all(0 < value < math.inf for value in (self.Gamma, self.moment_unit)):
            raise ValueError(f"length: {self.length:g} m and the others differ so much in size that numbers overflow")

    @property
    def Gamma(self) -> float:
        """w**2/(h L/2 pi)."""
        return self.width**2 / (self.thickness * self.radius(1.0))

    @property
    def parameters(self) -> dict[str, float]:
        """The parameters of the law 'finite width', by name."""
        return {"nu": self.poisson_ratio, "Gamma": self.Gamma}

    @property
    def kappa_n(self) -> float:
        """Natural curvature over 2 pi/L."""
        return self.radius(1.0) / self.natural_radius

    @property
    def moment_unit(self) -> float:
        """B 2 pi/L in N m: a moment of 1."""
        plate = self.youngs_modulus * self.thickness**3 / (12 * (1 - self.poisson_ratio**2))
        return plate * self.width / self.radius(1.0)

    @property
    def energy_unit(self) -> float:
        """An energy of 1 in J (the energies of this package are means over the loop)."""
        return 2 * math.pi * self.moment_unit

    def radius(self, curvature: float) -> float:
        """Return the radius in m of a curvature over 2 pi/L; with its sign, infinite for 0."""
        return self.length / (2 * math.pi * curvature) if curvature else math.inf

    def strain(self, bending, twist=0.0):
        """Return the largest principal strain at the surface for a change of curvature and a twist, both over 2 pi/L.

        It is h/2 times the larger principal value of [[bending, twist], [twist, 0]], without the bending of the section.
        Arguments are numbers or arrays.
        """
        return self.thickness / 2 / self.radius(1.0) * (abs(bending) / 2 + (bending**2 / 4 + twist**2) ** 0.5)

    @property
    def torsion_excess(self) -> float:
        """Relative excess of a plate's torsional stiffness over that of the section: .63 h/w, Saint-Venant's first term."""
        return 0.63 * self.thickness / self.width


#: Names of the dimensions of a strip.
NAMES = tuple(field.name for field in fields(Strip))
