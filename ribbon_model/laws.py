"""The laws by name: those of the paper, the strip of finite width between them, and the general rod.

Each is a scalar function (`ribbon_model.law`). The classes add what is known in closed form. The laws of strips of a plate have
a second form, with the stiffnesses of an orthotropic plate in place of nu (`ribbon_model.plate`).
"""

from __future__ import annotations

import importlib.util
import math
import os
import re
from collections import ChainMap
from collections.abc import Mapping
from pathlib import Path

from contin import ProblemError
from ribbon_model import finite_width, plate
from ribbon_model.law import NU, Circle, Law, NoThreshold, Parameter, TwoBendings

__all__ = [
    "FINITE_WIDTH", "FLAT_ROD", "ISOTROPIC_ROD", "LAWS", "OPEN_LAWS", "PAPER_LAWS", "RIBBON", "ROD", "Law", "NoThreshold",
    "Parameter", "TwoBendings", "laws_of",
]  # fmt: skip

#: The ribbon's twisting modulus counts as lost where M1 + (1 - nu) kappa_n < -_STEEP |M3|, that is at |omega_3/omega_1| > 2
#: _STEEP. Exact in the plane. Round-off in M3 (1e-13 beside branch points) moves the stop by 1e-10; 10 times larger: by 1e-9.
_STEEP = 1e3


def ribbon_hamiltonian(M1, M2, M3, kappa_n, nu):
    """Inextensible ribbon, equations (7) and (9): H = c^2 / 2, in closed form.

    With eta = omega_3 / omega_1: c = omega_1 (1 + eta^2), a = c - nu kappa_n, M1 = c - kappa_n - a eta^2, M3 = 2 a eta; the
    root with a > 0 is the one on every branch that leaves a circle at kappa_n < m / nu.
    """
    p = M1 + (1 - nu) * kappa_n
    a = (p + math.sqrt(p * p + M3 * M3)) / 2
    c = nu * kappa_n + a
    return c * c / 2


def ribbon_energy(w1, w2, w3, kappa_n, nu):
    """Inextensible ribbon. With c = (omega_1**2 + omega_3**2)/omega_1 and a = c - nu kappa_n where that is positive, else 0,

        U = a**2/2 - (1 - nu) kappa_n omega_1 - (nu kappa_n)**2/2,

    which is (7) of Audoly & Seffen (2015) where a > 0, and its convex envelope elsewhere; U = inf for omega_1 <= 0. Where
    a = 0 the stiffness is singular.
    """
    if w1 > 0:
        a = max(w1 + w3 * w3 / w1 - nu * kappa_n, 0.0)
        return a * a / 2 - (1 - nu) * kappa_n * w1 - nu * kappa_n * nu * kappa_n / 2
    return math.inf


def flat_rod_hamiltonian(M1, M2, M3, kappa_n, nu):
    """Flat rod, equation (11): torsional modulus t = 2 / (1 + nu), omega_2 = 0."""
    return (M1 + kappa_n) * (M1 + kappa_n) / 2 + M3 * M3 * (1 + nu) / 4


def flat_rod_energy(w1, w2, w3, kappa_n, nu):
    """Flat rod: the Legendre transform of `flat_rod_hamiltonian`."""
    return w1 * w1 / 2 - kappa_n * w1 + w3 * w3 / (1 + nu)


def isotropic_rod_hamiltonian(M1, M2, M3, kappa_n, nu):
    """Isotropic rod, equation (10): torsional modulus t = 1 / (1 + nu)."""
    return (M1 + kappa_n) * (M1 + kappa_n) / 2 + M2 * M2 / 2 + M3 * M3 * (1 + nu) / 2


def isotropic_rod_energy(w1, w2, w3, kappa_n, nu):
    """Isotropic rod: the Legendre transform of `isotropic_rod_hamiltonian`."""
    return w1 * w1 / 2 - kappa_n * w1 + w2 * w2 / 2 + w3 * w3 / (2 * (1 + nu))


def rod_hamiltonian(M1, M2, M3, kappa_n, B1, B2, C):
    """General rod: stiffnesses of bending about the width and about the normal, and of twisting."""
    return M1 * M1 / (2 * B1) + M1 * kappa_n + M2 * M2 / (2 * B2) + M3 * M3 / (2 * C) + kappa_n * kappa_n / 2


def rigid_rod_hamiltonian(M1, M2, M3, kappa_n, B1, C):
    """General rod that does not bend in its plane."""
    return M1 * M1 / (2 * B1) + M1 * kappa_n + M3 * M3 / (2 * C) + kappa_n * kappa_n / 2


class Ribbon(Law):
    """The inextensible ribbon: developable, omega_2 = 0."""

    has_rulings = True

    def on_circle(self, bending, kappa_n, *values) -> Circle:
        """Return Table 2; t = 2 (1 - nu kappa_n/omega_1) is negative where the convex envelope has 0."""
        (nu,) = values
        twisting = 2 * (1 - nu * kappa_n / bending)
        return Circle(bending - kappa_n, bending * bending / 2 - bending * kappa_n, bending, 1.0, math.inf, twisting)

    def closed_thresholds(self, m: int, n: int, *values: float) -> tuple[float, ...]:
        """(27): 1 - K = -2 (1 - nu K) s, with s = k**2 - 1; nu -> 0 is a removable singularity there."""
        (nu,) = values
        s = (n / m) ** 2 - 1
        if 1 + 2 * nu * s <= 0:  # 1 - nu K = (1 - nu) / (1 + 2 nu s) is the tangent twisting modulus over 2
            raise NoThreshold(f"m = {m}, n = {n}, nu = {nu:g}: no threshold where the ribbon's twisting modulus is positive")
        return (m * (1 + 2 * s) / (1 + 2 * nu * s),)

    def closed_limits(self, m: int, *values: float) -> tuple[float, float]:
        """Return where t = 0."""
        (nu,) = values
        return (m / nu, math.inf) if nu < 0 else (-math.inf, m / nu if nu > 0 else math.inf)

    def sides(self, *values: float) -> tuple[float, float]:
        """Return k of M1 + k kappa_n where a ribbon loses its twisting modulus, and where it bends to the other side."""
        (nu,) = values
        return 1 - nu, 1 + nu

    def margin(self, moment, strain, kappa_n, *values):
        """Return a number that is positive where the law of the ribbon holds: omega_1 > 0, and no other strain is preferred.

        With p, a and c of `ribbon_hamiltonian`, omega_1 = c/(1 + eta**2) and p = a (1 - eta**2). The law ends in two ways
        (nu kappa_n > 0: the first one comes first in the plane; nu kappa_n < 0: the second one):

        - a = 0, where M3 = 0 and p = M1 + (1 - nu) kappa_n = 0: the twisting modulus 2 a/omega_1 vanishes. For smaller p
          with M3 = 0, omega_1 = 0 and the generators run along the strip (eta is infinite).
        - p + 2 nu kappa_n = M1 + (1 + nu) kappa_n = 0, at any M3: the two roots a belong to omega_1 of either sign, and their
          H differ by sqrt(p**2 + M3**2) (p + 2 nu kappa_n)/2. Where that is negative, the strain of the other sign has less
          energy at this moment (Weierstrass' condition).
        """
        import numpy as np

        near, far = self.sides(*values)
        return moment[:, 0] + near * kappa_n + np.minimum(_STEEP * abs(moment[:, 2]), (far - near) * kappa_n)


class PlateLaw(Law):
    """The law of a strip of an orthotropic plate."""

    def check(self, numbers: Mapping[str, float]) -> None:
        super().check(numbers)
        if not numbers["D11"] * numbers["D22"] > numbers["D12"] ** 2:
            raise ValueError(f"D12: {numbers['D12']:g} must be smaller than the square root of D11 D22")


class PlateRibbon(PlateLaw, Ribbon):
    """The inextensible ribbon of an orthotropic plate."""

    on_circle, closed_thresholds, closed_limits = Law.on_circle, Law.closed_thresholds, Law.closed_limits

    def sides(self, *values: float) -> tuple[float, float]:
        """Return `Ribbon.sides`.

        With s = D12 + 2 D66 and r = sqrt(D11 D22): without M3, M1 omega_1 - U is a quadratic function of omega_1 and
        k2 = omega_3**2/omega_1. Its maximum leaves k2 = 0 where t = 0 (s < r), or jumps to omega_1 = 0 before (s > r). (A plate
        with s <= 0 has no end of this kind: it twists however far it is bent.) The second k is exact without kappa_n, or where
        s = r; otherwise it is an estimate.
        """
        import numpy as np

        D11, D12, D22, D66 = values
        root, twisting = np.sqrt(D11 * D22), D12 + 2 * D66
        least = np.where(twisting > 0, np.minimum(twisting, root), root)
        return D11 * (1 - D12 / least), D11 * (1 + D12 / root)


class FlatRod(Law):
    """The flat rod: omega_2 = 0."""

    def on_circle(self, bending, kappa_n, *values) -> Circle:
        (nu,) = values
        return Circle(bending - kappa_n, bending * bending / 2 - bending * kappa_n, bending, 1.0, math.inf, 2 / (1 + nu))

    def closed_thresholds(self, m: int, n: int, *values: float) -> tuple[float, ...]:
        (nu,) = values
        return (m * (1 + 2 * ((n / m) ** 2 - 1) / (1 + nu)),)

    def closed_limits(self, m: int, *values: float) -> tuple[float, float]:
        return -math.inf, math.inf


class IsotropicRod(Law):
    """The isotropic rod: three moduli."""

    def on_circle(self, bending, kappa_n, *values) -> Circle:
        (nu,) = values
        return Circle(bending - kappa_n, bending * bending / 2 - bending * kappa_n, bending, 1.0, 1.0, 1 / (1 + nu))

    def closed_thresholds(self, m: int, n: int, *values: float) -> tuple[float, ...]:
        """Solve M**2 - (1 + t) M - t s = 0."""
        s, t = (n / m) ** 2 - 1, 1 / (1 + values[0])
        root = math.sqrt((1 + t) ** 2 + 4 * t * s)
        found = (m * (1 - (1 + t - root) / 2), m * (1 - (1 + t + root) / 2))
        return tuple(sorted(found, key=lambda value: abs(value - m)))

    def closed_limits(self, m: int, *values: float) -> tuple[float, float]:
        return -math.inf, math.inf


# --- the laws by name -------------------------------------------------------------------------------------------------------


def _positive(value: float) -> bool:
    return value > 0


def _from_zero(value: float) -> bool:
    return value >= 0


#: w**2/(h L/2 pi).
_GAMMA = Parameter(
    1, _from_zero, "a finite number from 0; the limit of a wide strip is the law 'ribbon'", width=2, thickness=-1
)
_STIFFNESS = Parameter(0, _positive, "positive", stiffness=True)
_D12 = Parameter(0, default=0.3)
_PLATE = dict(zip(plate.RIGIDITIES, (_STIFFNESS, _D12, _STIFFNESS, _STIFFNESS)))
_FLAT_END = "whose energy is not convex at larger twist; the law 'flat rod' goes on"
_RIBBON_END = "which has no value where the bending or the twisting modulus vanishes; the law 'finite width' goes on"

RIBBON = Ribbon(
    "ribbon", ribbon_hamiltonian, energy=ribbon_energy, plate=True, ends=_RIBBON_END,
    forms=(PlateRibbon("ribbon", plate.ribbon, True, _PLATE, plate.ribbon_energy, plate=True, ends=_RIBBON_END),),
)  # fmt: skip
FLAT_ROD = FlatRod(
    "flat rod", flat_rod_hamiltonian, energy=flat_rod_energy, additive=True, plate=True,
    forms=(PlateLaw("flat rod", plate.flat_rod, True, _PLATE, additive=True, plate=True),),
)  # fmt: skip
ISOTROPIC_ROD = IsotropicRod("isotropic rod", isotropic_rod_hamiltonian, False, energy=isotropic_rod_energy, additive=True)
FINITE_WIDTH = Law(
    "finite width", finite_width.hamiltonian, True, {"nu": NU, "Gamma": _GAMMA}, finite_width.isotropic_energy,
    plate=True, ends_with_convexity=True, ends=_FLAT_END,
    forms=(PlateLaw("finite width", plate.finite_width, True, {**_PLATE, "Gamma": _GAMMA}, plate.finite_width_energy,
                    plate=True, ends_with_convexity=True, ends=_FLAT_END),),
)  # fmt: skip
#: The general Kirchhoff rod; an infinite B2 is a strip that does not bend in its plane.
ROD = Law(
    "rod", rod_hamiltonian, False, dict.fromkeys(("B1", "B2", "C"), _STIFFNESS), additive=True,
    forms=(Law("rod", rigid_rod_hamiltonian, True, dict.fromkeys(("B1", "C"), _STIFFNESS), additive=True),),
)  # fmt: skip

#: The laws of the paper by name, each a closed expression for H in which nu is the one parameter.
PAPER_LAWS = {law.name: law for law in (RIBBON, FLAT_ROD, ISOTROPIC_ROD)}
#: The laws of scenes of closed strips by name.
LAWS = PAPER_LAWS | {FINITE_WIDTH.name: FINITE_WIDTH}
#: The laws of scenes of open strips by name: those of closed ones, and the rod.
OPEN_LAWS = ChainMap({ROD.name: ROD}, LAWS)


# --- laws of users ----------------------------------------------------------------------------------------------------------

#: The variable of the environment that names files with laws of users, separated as in PATH.
VARIABLE = "RIBBON_LAWS"
#: Names of laws: they stand in names of files, and commas separate them from parameters.
_NAME = re.compile(r"\w[\w -]*")


def laws_of(path: str | Path) -> dict[str, Law]:
    """Return the laws that a Python file states, by name.

    Raises
    ------
    contin.ProblemError
        The file cannot be run, or states no law that can be added; one sentence.
    """
    spec = importlib.util.spec_from_file_location(Path(path).stem, path)
    if spec is None or spec.loader is None or not Path(path).is_file():
        raise ProblemError(f"{VARIABLE}: {str(path)!r} must be a Python file that states laws")
    module = importlib.util.module_from_spec(spec)
    try:
        spec.loader.exec_module(module)
    except Exception as error:  # the file may raise anything
        raise ProblemError(f"{VARIABLE}: {str(path)!r} cannot be run: {error}") from error
    found = [law for law in vars(module).values() if isinstance(law, Law) and OPEN_LAWS.get(law.name) is not law]
    if not found:
        raise ProblemError(f"{VARIABLE}: {str(path)!r} states no law: no name in it is a ribbon_model.Law")
    for law in found:
        if law.name in OPEN_LAWS or not _NAME.fullmatch(law.name):
            others = ", ".join(OPEN_LAWS)
            raise ProblemError(
                f"{VARIABLE}: {str(path)!r}: the name {law.name!r} must be letters, digits, spaces or -, and none of {others}"
            )
    return {law.name: law for law in found}


for _path in filter(None, os.environ.get(VARIABLE, "").split(os.pathsep)):
    LAWS |= laws_of(_path)
