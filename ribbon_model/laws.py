"""Material laws. All that depends on the law is in this module; the rest of the package calls the law's methods.

A law is one scalar function, the complementary energy H(M1, M2, M3; kappa_n, nu); the strains, the conjugate curvature kappa*,
the tangent moduli and every Jacobian follow from its derivatives. (A law can also be given by its strain energy, with H as
Legendre transform: `ribbon_model.finite_width`.) `Law` is enough for branches of any such function; the
classes below it add what is known in closed form: circles, their thresholds, the unfolding arc, the strain energy.

Units: bending modulus B = 1, total length L = 2 pi (so kappa_n stands for the paper's kappa_n L / 2 pi). The strain
energy is U(omega) = max over M of M.omega - H; a constant kappa_n^2/2 is left out of U in all laws, as in equation (7) of
Audoly & Seffen (2015), so that kappa* = dH/dkappa_n is omega_1 on a planar circle.

On circles, and on the unfolding arc, lengths are in units of the radius r0: ``ratio`` is kappa_n r0, ``width`` is w**2/(h r0).
"""

from __future__ import annotations

import functools
import math
import types
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


@dataclass(frozen=True)
class Law:
    """A material law.

    Attributes
    ----------
    name : str
    hamiltonian : callable
        H(M1, M2, M3, kappa_n, *parameters), with arithmetic and ``math`` only, unless ``gradient`` is given.
    constrained : bool
        True if omega_2 = 0 (then H does not depend on M2, which is a reaction).
    parameters : tuple of str
        The law's own parameters, in the order in which they are passed: ``nu``, and for some laws more.
    gradient : callable, optional
        The response, if H cannot be differentiated symbolically; prepared for compilation by `contin`.

    Examples
    --------
    >>> RIBBON.thresholds(1, 2, 0.3)[0]  # where (1, 2) leaves the single loop
    2.5
    """

    name: str
    hamiltonian: Callable[..., float]
    constrained: bool
    parameters: tuple[str, ...] = ("nu",)
    gradient: Callable[..., tuple] | None = None

    #: True if Gamma is a parameter.
    has_width: ClassVar[bool] = False
    #: True if the surface is ruled along d1 + eta d3, eta = omega_3/omega_1 (6a).
    has_rulings: ClassVar[bool] = False
    #: ``curvatures_at(omega_1, omega_3, p)`` = (U_11, U_13, U_33) for a law that ends where U loses convexity; None for
    #: a law whose H is a closed expression, because its domain is known.
    curvatures_at: ClassVar[Callable[..., tuple] | None] = None

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
        """``response(M1, M2, M3, kappa_n, *parameters)`` = (H, omega_1, omega_2, omega_3, dH/dkappa_n), plain Python."""
        if self.gradient:
            return self.gradient
        from contin import gradient  # loads numba (.3 s), which a law without its derivatives does not need

        return gradient(self.hamiltonian, ("M1", "M2", "M3", "kappa_n"))

    def at_points(self, moment: Callable[..., tuple], function: Callable[..., Any]) -> Callable[..., Any]:
        """Return f(t, u, p) = ``function(u, p, M, response)`` for `contin`, with M = ``moment(u, p)`` on the directors.

        p, a named tuple, has kappa_n and the law's parameters.
        """
        response = self.response

        def value(t, u, p):
            M = moment(u, p)
            return function(u, p, M, response(M[0], M[1], M[2], p.kappa_n, p.nu))

        return value

    def linearized(self, moments, kappa_n: float, *parameters: float):
        """Return strains (K, 3) and compliance D2H (K, 3, 3) at moments on the directors (K, 3), by complex steps."""
        import numpy as np

        step = 1e-30
        arguments = np.repeat(np.asarray(moments).T[:, None].astype(complex), 3, axis=1)  # component, direction, place
        arguments[range(3), range(3)] += 1j * step
        shape = arguments.shape[1:]
        if self.gradient:  # it has loops and decisions: one place at a time
            places = [self.response(*moment, kappa_n, *parameters)[1:4] for moment in arguments.reshape(3, -1).T]
            strain = np.array(places, dtype=complex).T.reshape(3, *shape)
        else:  # the same code as plain Python's, on arrays
            response = types.FunctionType(self.response.__code__, {"math": np})
            strain = np.array([np.broadcast_to(w, shape) for w in response(*arguments, kappa_n, *parameters)[1:4]])
        return strain[:, 0].real.T, strain.imag.transpose(2, 0, 1) / step

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
        raise ValueError(f"law {self.name!r} has no strain energy for descents")

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


class Ribbon(Law):
    """The inextensible ribbon: developable, omega_2 = 0."""

    has_rulings = True

    def strain_energy(self, strain, kappa_n: float, nu: float) -> tuple:
        """With c = (omega_1**2 + omega_3**2)/omega_1 and a = c - nu kappa_n where that is positive, else 0,

            U = a**2/2 - (1 - nu) kappa_n omega_1 - (nu kappa_n)**2/2,

        which is (7) of Audoly & Seffen (2015) where a > 0, and its convex envelope elsewhere; U = inf for omega_1 <= 0. Where
        a = 0 the stiffness is singular.
        """
        import numpy as np

        strain = np.asarray(strain)
        w1, w3 = strain[..., 0], strain[..., 2]
        kind = np.result_type(strain, kappa_n)
        moment, stiffness = np.zeros(strain.shape, kind), np.zeros((*strain.shape, 3), kind)
        safe = np.where(w1.real > 0, w1, 1.0)
        eta = w3 / safe
        a = safe * (1 + eta * eta) - nu * kappa_n
        convex = a.real > 0
        a = np.where(convex, a, 0.0)
        slope = np.stack([1 - eta * eta, 2 * eta], axis=-1)  # of c, by omega_1 and omega_3
        ratio = np.stack([-eta, np.ones_like(eta)], axis=-1)
        bend = (2 / safe)[..., None, None] * ratio[..., None] * ratio[..., None, :]
        moment[..., ::2] = a[..., None] * slope
        moment[..., 0] -= (1 - nu) * kappa_n
        stiffness[..., ::2, ::2] = convex[..., None, None] * slope[..., None] * slope[..., None, :] + a[..., None, None] * bend
        U = a * a / 2 - (1 - nu) * kappa_n * w1 - (nu * kappa_n) ** 2 / 2
        return np.where(w1.real > 0, U, np.inf), moment, stiffness

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


class Rod(Law):
    """A rod: U is quadratic, with constant moduli."""

    def strain_energy(self, strain, kappa_n: float, nu: float) -> tuple:
        """Return the inverse of the compliances, which are those at any moment."""
        import numpy as np

        strain = np.asarray(strain)
        compliance = np.diag(self.linearized(np.zeros((1, 3)), 0.0, nu)[1][0])
        moduli = np.array([0.0 if value == 0 else 1 / value for value in compliance])
        moment = moduli * strain - kappa_n * np.array([1.0, 0.0, 0.0])
        U = np.sum(moduli * strain * strain, axis=-1) / 2 - kappa_n * strain[..., 0]
        return U, moment, np.broadcast_to(np.diag(moduli), (*strain.shape, 3))


class FlatRod(Rod):
    """The flat rod: omega_2 = 0."""

    def tangent_moduli(self, ratio, nu, width=None) -> tuple:
        return math.inf, 2 / (1 + nu)

    def thresholds(self, m: int, n: int, nu: float, Gamma: float | None = None) -> tuple[float, ...]:
        s = (n / m) ** 2 - 1
        return (m * (1 + 2 * s / (1 + nu)),)


class IsotropicRod(Rod):
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

    def values(self, nu: float, Gamma: float | None = None) -> dict[str, float]:
        if Gamma is None:
            raise ValueError(f"Gamma is missing: {_WHOSE}")
        if not 0 <= Gamma < math.inf:
            raise ValueError(f"Gamma = {Gamma:g} must be a finite number from 0; the limit of a wide strip is the law 'ribbon'")
        return {"nu": nu, "Gamma": Gamma}

    def at_points(self, moment: Callable[..., tuple], function: Callable[..., Any]) -> Callable[..., Any]:
        """As for all laws; the search for the strains runs once a point."""
        search, response = finite_width.search, finite_width.response_from

        def solve(t, u, p):
            M = moment(u, p)
            return search(M[0], M[2], p.kappa_n, p.nu, p.Gamma)

        def value(t, u, p, w):
            M = moment(u, p)
            return function(u, p, M, response(M[0], M[1], M[2], p.kappa_n, p.nu, p.Gamma, w))

        from contin import Pointwise

        return Pointwise(value, solve)

    def strain_energy(self, strain, kappa_n: float, nu: float, Gamma: float) -> tuple:
        """As `finite_width.strain_energy`, with the constant that all laws leave out; a strain at a time."""
        import numpy as np

        strain = np.asarray(strain)
        energy = np.frompyfunc(finite_width.strain_energy, 5, 9)
        kind = np.result_type(strain, kappa_n)
        values = energy(strain[..., 0], strain[..., 2], kappa_n, nu, Gamma)
        U, U1, U3, U11, U13, U33 = (np.asarray(value, dtype=kind) for value in values[:6])
        moment, stiffness = np.zeros(strain.shape, kind), np.zeros((*strain.shape, 3), kind)
        moment[..., 0], moment[..., 2] = U1, U3
        stiffness[..., 0, 0], stiffness[..., 2, 2] = U11, U33
        stiffness[..., 0, 2] = stiffness[..., 2, 0] = U13
        return U - kappa_n * kappa_n / 2, moment, stiffness

    @staticmethod
    def curvatures_at(w1, w3, p) -> tuple:
        U, U1, U3, U11, U13, U33, Uk, U1k, U3k = finite_width.strain_energy(w1, w3, p.kappa_n, p.nu, p.Gamma)
        return U11, U13, U33

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
        energy = np.vectorize(finite_width.strain_energy, otypes=[float] * 9)(kappa, 0.0, 1.0, nu, width)
        moment, t = energy[1], energy[5]
        return math.inf, moment, t * kappa, 1 / t + 0 * kappa

    def arc_end(self, nu: float, width: float | None = None) -> float | None:
        return finite_width.first_zero_of_t(nu, width)


RIBBON = Ribbon("ribbon", ribbon_hamiltonian, constrained=True)
FLAT_ROD = FlatRod("flat rod", flat_rod_hamiltonian, constrained=True)
ISOTROPIC_ROD = IsotropicRod("isotropic rod", isotropic_rod_hamiltonian, constrained=False)
FINITE_WIDTH = FiniteWidth(
    "finite width", finite_width.hamiltonian, True, parameters=("nu", "Gamma"), gradient=finite_width.response
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
