"""Material laws. All that depends on the law is in this module; the rest of the package calls the law's methods.

A law is one scalar function, the complementary energy H(M1, M2, M3; kappa_n, nu); the strains, the conjugate curvature kappa*,
the tangent moduli and every Jacobian follow from its derivatives. (H may be a Legendre transform, found at each point:
`ribbon_model.finite_width`.) `Law` is enough for branches of any such function; the
classes below it add what is known in closed form: circles, their thresholds, the unfolding arc, the strain energy.

Units: bending modulus B = 1, total length L = 2 pi (so kappa_n stands for the paper's kappa_n L / 2 pi). The strain
energy is U(omega) = max over M of M.omega - H; a constant kappa_n^2/2 is left out of U in all laws, as in equation (7) of
Audoly & Seffen (2015), so that kappa* = dH/dkappa_n is omega_1 on a planar circle.

On circles, and on the unfolding arc, lengths are in units of the radius r0: ``ratio`` is kappa_n r0, ``width`` is w**2/(h r0).
"""

from __future__ import annotations

import functools
import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, ClassVar

from ribbon_model import finite_width

#: Defaults of parameters in a problem's statement. Every run gives its own values, so these have no effect.
_DEFAULTS = {"nu": 0.3, "Gamma": 1.0}
#: The end of messages about Gamma.
_WHOSE = "it is a parameter of the law 'finite width', and of no other"


class NoThreshold(ValueError):
    """A mode without a bifurcation on a circle on which the law is regular."""


class TwoBendings(ValueError):
    """A circle whose moment belongs to two bendings; the law takes the other one."""


@dataclass(frozen=True)
class Law:
    """A material law.

    Attributes
    ----------
    name : str
    hamiltonian : callable
        H(M1, M2, M3, kappa_n, *parameters), of numbers: arithmetic, ``math``, decisions, `contin.lowlevel.least`.
    constrained : bool
        True if omega_2 = 0 (then H does not depend on M2, which is a reaction).
    parameters : tuple of str
        The law's own parameters, in the order in which they are passed: ``nu``, and for some laws more.
    energy : callable, optional
        U(omega_1, omega_2, omega_3, kappa_n, *parameters) in the same manner, without the constant kappa_n**2/2, for the
        descents of `ribbon_model.descent`.

    Examples
    --------
    >>> RIBBON.thresholds(1, 2, 0.3)[0]  # where (1, 2) leaves the single loop
    2.5
    """

    name: str
    hamiltonian: Callable[..., float]
    constrained: bool
    parameters: tuple[str, ...] = ("nu",)
    energy: Callable[..., float] | None = None

    def __repr__(self) -> str:
        return f"<law {self.name!r}>"

    #: True if Gamma is a parameter.
    has_width: ClassVar[bool] = False
    #: True if the surface is ruled along d1 + eta d3, eta = omega_3/omega_1 (6a).
    has_rulings: ClassVar[bool] = False
    #: True if the law ends where U loses convexity; the domain of a law whose H is a closed expression is known.
    ends_with_convexity: ClassVar[bool] = False

    # --- parameters -------------------------------------------------------------------------------------------------------

    @property
    def defaults(self) -> dict[str, float]:
        """The parameters and their default values."""
        return {name: _DEFAULTS[name] for name in self.parameters}

    def values(self, nu: float, Gamma: float | None = None) -> dict[str, float]:
        """Return the law's parameters by name.

        Raises
        ------
        ValueError
            Gamma is missing, negative, or given to a law that has none.
        """
        if Gamma is not None:
            raise ValueError(f"Gamma = {Gamma:g} is given to a law without it: {_WHOSE}")
        return {"nu": nu}

    # --- strains ----------------------------------------------------------------------------------------------------------

    @functools.cached_property
    def response(self) -> Callable[..., tuple]:
        """``response(M1, M2, M3, kappa_n, *parameters)`` = (H, omega_1, omega_2, omega_3, dH/dkappa_n), of numbers."""
        from contin.lowlevel import gradient  # loads compiled code (.3 s), which a law without its derivatives does not need

        return gradient(self.hamiltonian, ("M1", "M2", "M3", "kappa_n"))

    def at_points(self, moment: Callable[..., tuple], function: Callable[..., Any]) -> Callable[..., Any]:
        """Return f(t, u, p) = ``function(u, p, M, response)`` for `contin`, with M = ``moment(u, p)`` on the directors.

        p, a named tuple, has kappa_n and the law's parameters.
        """
        response, names = self.response, self.parameters

        def value(t, u, p):
            M = moment(u, p)
            return function(u, p, M, response(M[0], M[1], M[2], p.kappa_n, *[getattr(p, name) for name in names]))

        return value

    def linearized(self, moments, kappa_n: float, *parameters: float):
        """Return strains (K, 3) and compliance D2H (K, 3, 3) at moments on the directors (K, 3)."""
        values, slopes = _evaluated(_response_at_points, self, moments, kappa_n, parameters)
        return values[:, 1:4], slopes[:, 1:4]

    def complementary(self, moments, kappa_n: float, *parameters: float):
        """Return H (K,) at moments on the directors (K, 3)."""
        return _evaluated(_response_at_points, self, moments, kappa_n, parameters)[0][:, 0]

    def strain_energy(self, strain, kappa_n: float, *parameters: float) -> tuple:
        """U, the moment dU/d(omega) and the stiffness D2U at strains (..., 3), for the descents of `ribbon_model.descent`.

        If the law has omega_2 = 0, omega_2 is ignored and its moment is 0.

        Returns
        -------
        U, moment, stiffness : ndarray, shapes (...), (..., 3), (..., 3, 3)

        Raises
        ------
        ValueError
            A law without a strain energy.
        """
        import numpy as np

        shape = np.shape(strain)[:-1]
        value, slope = _evaluated(_energy_at_points, self, np.reshape(strain, (-1, 3)), kappa_n, parameters)
        return value[:, 0].reshape(shape), value[:, 1:4].reshape(*shape, 3), slope[:, 1:4].reshape(*shape, 3, 3)

    def conjugate(self, strain, kappa_n: float, *parameters: float):
        """Return -dU/dkappa_n at strains (K, 3), with U as in `strain_energy`."""
        return -_evaluated(_energy_at_points, self, strain, kappa_n, parameters)[0][:, 4]

    # --- circles ----------------------------------------------------------------------------------------------------------

    def circle(self, m: int, kappa_n: float, nu: float, Gamma: float | None = None) -> dict[str, float]:
        """M1, kappa_star (28) and energy (over 2 pi B / L, without the constant kappa_n**2/2) of the m-covered circle."""
        return {"M1": m - kappa_n, "kappa_star": m, "energy": m * m / 2 - m * kappa_n}

    def prestress(self, ratio, nu, width=None):
        """Return the moment of the circle in units of B / r0: 1 - kappa_n r0 (17a)."""
        return 1 - ratio

    def tangent_moduli(self, ratio, nu, width=None) -> tuple:
        """Contrast g of the bending moduli and twisting modulus t of (15), over B: Table 2 of the paper.

        ``ratio`` and ``nu`` may be arrays; g is a number, infinite where the law has omega_2 = 0.

        Raises
        ------
        ValueError
            A law that is not in Table 2, and not that of finite width.
        """
        raise ValueError(f"the law {self.name!r} is not in Table 2: no closed formula for its tangent moduli")

    def tangent_bending(self, ratio, nu, width=None):
        """Tangent bending modulus over B."""
        return 1.0

    def thresholds(self, m: int, n: int, nu: float, Gamma: float | None = None) -> tuple[float, ...]:
        """See `ribbon_model.linear.thresholds`, which checks the arguments."""
        raise ValueError(f"the law {self.name!r} has no closed formula here")

    def convex_limits(self, m: int, nu: float, Gamma: float | None = None) -> list[float]:
        """Return the kappa_n r0 of m-covered circles at the limits where the law is regular, in any order."""
        return []

    # --- the unfolding arc ------------------------------------------------------------------------------------------------

    def arc(self, xi, nu, width=None) -> tuple:
        """g, moment, torsion t kappa and compliance 1/t of the arc unfolded by xi, for `ribbon_model.unfolding.factors`.

        In units of the natural radius, where the curvature is kappa = 1 - xi; arrays broadcast.
        """
        g, t = self.tangent_moduli(1.0, nu)
        kappa = 1 - xi
        return g, -xi, t * kappa, 1 / t + 0 * kappa

    def arc_end(self, nu: float, width: float | None = None) -> float | None:
        """Return the smallest xi in (0, 1) where t vanishes, or None."""
        return None

    def passes_flat(self, nu: float) -> bool:
        """Return whether t is positive beyond the flat state, xi > 1."""
        return True


@functools.cache
def _response_at_points(law: Law):
    """Return the response of a law, to be evaluated at many points, and the columns of its derivatives by the moment."""
    from contin.lowlevel import Batch

    response = law.response
    names = ("kappa_n", *law.parameters)
    batch = Batch([lambda M, p: response(*M, *p)], [5], ("M1", "M2", "M3"), names, times=False)
    return batch, batch.columns([])


@functools.cache
def _energy_at_points(law: Law):
    """Return U and its slopes by the strains and kappa_n in the same manner."""
    from contin.lowlevel import Batch, gradient

    if law.energy is None:
        raise ValueError(f"law {law.name!r} has no strain energy for descents")
    slopes = gradient(law.energy, ("w1", "w2", "w3", "kappa_n"))
    batch = Batch([lambda w, p: slopes(*w, *p)], [5], ("w1", "w2", "w3"), ("kappa_n", *law.parameters), times=False)
    return batch, batch.columns([])


def _evaluated(function: Callable[[Law], tuple], law: Law, points, kappa_n: float, parameters: tuple):
    """Return values (K, 5) and derivatives (K, 5, 3) of one of these at points (K, 3)."""
    import numpy as np

    batch, columns = function(law)
    u = np.ascontiguousarray(points, dtype=float)
    return batch.jacobian(np.zeros(len(u)), u, u[:0], np.array([kappa_n, *parameters], dtype=float), columns)


# --- the laws of the paper --------------------------------------------------------------------------------------------------


def ribbon_hamiltonian(M1, M2, M3, kappa_n, nu):
    """Inextensible ribbon, equations (7) and (9): H = c^2 / 2, in closed form.

    With eta = omega_3 / omega_1: c = omega_1 (1 + eta^2), a = c - nu kappa_n, M1 = c - kappa_n - a eta^2, M3 = 2 a eta; the
    root with a > 0 is the one on every branch that leaves a circle at kappa_n < m / nu.
    """
    p = M1 + (1 - nu) * kappa_n
    a = (p + math.sqrt(p * p + M3 * M3)) / 2
    c = nu * kappa_n + a
    return c * c / 2


def flat_rod_hamiltonian(M1, M2, M3, kappa_n, nu):
    """Flat rod, equation (11): torsional modulus t = 2 / (1 + nu), omega_2 = 0."""
    return (M1 + kappa_n) * (M1 + kappa_n) / 2 + M3 * M3 * (1 + nu) / 4


def isotropic_rod_hamiltonian(M1, M2, M3, kappa_n, nu):
    """Isotropic rod, equation (10): torsional modulus t = 1 / (1 + nu)."""
    return (M1 + kappa_n) * (M1 + kappa_n) / 2 + M2 * M2 / 2 + M3 * M3 * (1 + nu) / 2


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


def flat_rod_energy(w1, w2, w3, kappa_n, nu):
    """Flat rod: the Legendre transform of `flat_rod_hamiltonian`."""
    return w1 * w1 / 2 - kappa_n * w1 + w3 * w3 / (1 + nu)


def isotropic_rod_energy(w1, w2, w3, kappa_n, nu):
    """Isotropic rod: the Legendre transform of `isotropic_rod_hamiltonian`."""
    return w1 * w1 / 2 - kappa_n * w1 + w2 * w2 / 2 + w3 * w3 / (2 * (1 + nu))


def finite_width_energy(w1, w2, w3, kappa_n, nu, Gamma):
    """Strip of finite width."""
    return finite_width.energy(w1, w3, kappa_n, nu, Gamma) - kappa_n * kappa_n / 2


class Ribbon(Law):
    """The inextensible ribbon: developable, omega_2 = 0."""

    has_rulings = True

    def tangent_moduli(self, ratio, nu, width=None) -> tuple:
        return math.inf, 2 * (1 - nu * ratio)

    def thresholds(self, m: int, n: int, nu: float, Gamma: float | None = None) -> tuple[float, ...]:
        """(27): 1 - K = -2 (1 - nu K) s, with s = k**2 - 1; nu -> 0 is a removable singularity there."""
        s = (n / m) ** 2 - 1
        if 1 + 2 * nu * s <= 0:  # 1 - nu K = (1 - nu) / (1 + 2 nu s) is the tangent twisting modulus over 2
            raise NoThreshold(f"m = {m}, n = {n}, nu = {nu:g}: no threshold where the ribbon's twisting modulus is positive")
        return (m * (1 + 2 * s) / (1 + 2 * nu * s),)

    def convex_limits(self, m: int, nu: float, Gamma: float | None = None) -> list[float]:
        """Return the ratio with t = 0."""
        return [1 / nu] if nu != 0 else []

    def arc(self, xi, nu, width=None) -> tuple:
        kappa = 1 - xi
        torsion = 2 * (kappa - nu)  # t kappa without the division
        return math.inf, -xi, torsion, kappa / torsion

    def arc_end(self, nu: float, width: float | None = None) -> float | None:
        return 1 - nu if nu > 0 else None

    def passes_flat(self, nu: float) -> bool:
        return nu >= 0


class FlatRod(Law):
    """The flat rod: omega_2 = 0."""

    def tangent_moduli(self, ratio, nu, width=None) -> tuple:
        return math.inf, 2 / (1 + nu)

    def thresholds(self, m: int, n: int, nu: float, Gamma: float | None = None) -> tuple[float, ...]:
        s = (n / m) ** 2 - 1
        return (m * (1 + 2 * s / (1 + nu)),)


class IsotropicRod(Law):
    """The isotropic rod: three moduli."""

    def tangent_moduli(self, ratio, nu, width=None) -> tuple:
        return 1.0, 1 / (1 + nu)

    def thresholds(self, m: int, n: int, nu: float, Gamma: float | None = None) -> tuple[float, ...]:
        """Solve M**2 - (1 + t) M - t s = 0."""
        s, t = (n / m) ** 2 - 1, 1 / (1 + nu)
        root = math.sqrt((1 + t) ** 2 + 4 * t * s)
        values = (m * (1 - (1 + t - root) / 2), m * (1 - (1 + t + root) / 2))
        return tuple(sorted(values, key=lambda value: abs(value - m)))


# --- between flat rod and ribbon --------------------------------------------------------------------------------------------


class FiniteWidth(Law):
    """The strip of finite width: `ribbon_model.finite_width`."""

    has_width = True
    ends_with_convexity = True

    def values(self, nu: float, Gamma: float | None = None) -> dict[str, float]:
        if Gamma is None:
            raise ValueError(f"Gamma is missing: {_WHOSE}")
        if not 0 <= Gamma < math.inf:
            raise ValueError(f"Gamma = {Gamma:g} must be a finite number from 0; the limit of a wide strip is the law 'ribbon'")
        return {"nu": nu, "Gamma": Gamma}

    def circle(self, m: int, kappa_n: float, nu: float, Gamma: float | None = None) -> dict[str, float]:
        U, U1, _, _, _, _, Uk, _, _ = finite_width.strain_energy(m, 0.0, kappa_n, nu, Gamma)
        return {"M1": U1, "kappa_star": kappa_n - Uk, "energy": U - kappa_n * kappa_n / 2}

    def prestress(self, ratio, nu, width=None):
        return finite_width.on_circle(ratio, nu, width)[0]

    def tangent_moduli(self, ratio, nu, width=None) -> tuple:
        return math.inf, finite_width.on_circle(ratio, nu, width)[1]

    def tangent_bending(self, ratio, nu, width=None):
        return finite_width.on_circle(ratio, nu, width)[2]

    def thresholds(self, m: int, n: int, nu: float, Gamma: float | None = None) -> tuple[float, ...]:
        """kappa_n = m (1 - y): with M and t of `finite_width.on_circle`, M = t (1 - k**2) is quadratic in y.

        A y**2 + B y + C = 0 with A = -nu**2 G'/4 >= 0, which vanishes in both limits: the threshold is the root that stays.
        """
        s = (n / m) ** 2 - 1
        straight, bent = (finite_width.on_circle(ratio, nu, m * Gamma) for ratio in (1.0, 0.0))  # y = 0 and y = 1
        opposite = finite_width.on_circle(2.0, nu, m * Gamma)[0]  # y = -1
        A = (bent[0] + opposite) / 2
        B, C = (bent[0] - opposite) / 2 + s * (bent[1] - straight[1]), s * straight[1]
        radicand = B * B - 4 * A * C
        if radicand >= 0 and B > 0:
            y = -2 * C / (B + math.sqrt(radicand))
            _, t, bending = finite_width.on_circle(1 - y, nu, m * Gamma)
            if t > 0 and bending > 0:
                return (float(m * (1 - y)),)
        raise NoThreshold(
            f"m = {m}, n = {n}, nu = {nu:g}, Gamma = {Gamma:g}: no threshold where the strain energy of a circle is convex"
        )

    def convex_limits(self, m: int, nu: float, Gamma: float | None = None) -> list[float]:
        return finite_width.convex_limits(nu, m * Gamma)

    def arc(self, xi, nu, width=None) -> tuple:
        """Return the values of a circle of curvature kappa whose natural curvature is 1."""
        import numpy as np

        kappa = 1 - xi
        energy = finite_width.strain_energy(kappa, np.zeros_like(kappa), 1.0, nu, width)
        moment, t = energy[1], energy[5]
        return math.inf, moment, t * kappa, 1 / t + 0 * kappa

    def arc_end(self, nu: float, width: float | None = None) -> float | None:
        return finite_width.first_zero_of_t(nu, width)


RIBBON = Ribbon("ribbon", ribbon_hamiltonian, constrained=True, energy=ribbon_energy)
FLAT_ROD = FlatRod("flat rod", flat_rod_hamiltonian, constrained=True, energy=flat_rod_energy)
ISOTROPIC_ROD = IsotropicRod("isotropic rod", isotropic_rod_hamiltonian, constrained=False, energy=isotropic_rod_energy)
FINITE_WIDTH = FiniteWidth(
    "finite width", finite_width.hamiltonian, constrained=True, parameters=("nu", "Gamma"), energy=finite_width_energy
)

#: The laws of the paper by name, each a closed expression for H in which nu is the one parameter.
PAPER_LAWS = {law.name: law for law in (RIBBON, FLAT_ROD, ISOTROPIC_ROD)}
#: All laws by name.
LAWS = PAPER_LAWS | {FINITE_WIDTH.name: FINITE_WIDTH}


def label(law: str, Gamma: float | None = None) -> str:
    """Return a law with its Gamma, if it has one, as one name.

    Examples
    --------
    >>> label("ribbon"), label("finite width", 30.0)
    ('ribbon', 'finite width, Gamma = 30')
    """
    return law if Gamma is None else f"{law}, Gamma = {Gamma:.12g}"


def from_label(name: str) -> tuple[Law, float | None]:
    """Return the law and the Gamma of a `label`.

    Examples
    --------
    >>> law, Gamma = from_label(label("finite width", 30.0))
    >>> law.name, Gamma
    ('finite width', 30.0)
    """
    law, _, Gamma = name.partition(", Gamma = ")
    return LAWS[law], float(Gamma) if Gamma else None
