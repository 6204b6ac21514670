"""A law: the energy of a strip as a function of its strains, the parameters of that energy, and all that follows from both.

A law states one scalar function: the complementary energy H(M1, M2, M3, kappa_n, ...), or the strain energy U(omega_1, omega_2,
omega_3, kappa_n, ...). The one is the Legendre transform of the other, H = max over omega of M.omega - U. Strains, moments,
tangent moduli, circles, the conjugate curvature kappa* and every Jacobian are derivatives of these functions, which `contin`
takes exactly. What is known in closed form may be stated in a method of a law; a test compares it with the derivatives.

Units: bending modulus B = 1; for closed strips the total length is L = 2 pi (so kappa_n stands for the paper's kappa_n L/2 pi),
for open ones it is 1. A law holds in every unit of length: `Parameter.power` says how its parameters change with the unit. A
constant kappa_n^2/2 is left out of U in all laws, as in equation (7) of Audoly & Seffen (2015), so that kappa* = dH/dkappa_n is
omega_1 on a planar circle of the laws of the paper.
"""

from __future__ import annotations

import functools
import inspect
import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import ClassVar, NamedTuple

from contin.lowlevel import levels, shown
from ribbon_model.older import takes_parameters

#: Names that strips have already; a law's parameter of such a name would take their place, or they its.
RESERVED = frozenset((
    "kappa_n", "kappa_2", "tau_n", "softness", "kappa_star", "energy", "length", "turn", "sense", "axes", "unfold", "M1", "M2",
    "M3", "R1", "R2", "R3", "q0", "q1", "q2", "q3", "x1", "x2", "x3", "support", "roller", "shear", "rise", "distance", "bend",
    "swing", "force_width", "force_normal", "force_tangent", "moment", "weight", "foundation", "stroke", "width", "thickness",
    "s", "pi",
))  # fmt: skip


class NoThreshold(ValueError):
    """A mode without a bifurcation on a circle on which the law is regular."""


class TwoBendings(ValueError):
    """A circle whose moment belongs to two bendings; the law takes the other one."""


class Parameter(NamedTuple):
    """A parameter of a law.

    Attributes
    ----------
    power : int
        Its power of length: 1 for a length, 0 for a pure number (B = 1 has none).
    fits : callable
        ``fits(value)``: whether a finite value is allowed.
    allowed : str
        The allowed values in words, after "must be".
    default : float
        The value in the statement of a problem. Every run gives its own, so it has no effect.
    width, thickness : int
        Its powers of the width and thickness of the section, where these vary along the strip.
    stiffness : bool
        True for a positive stiffness, in units of which moments are measured.

    Examples
    --------
    >>> Parameter(1, lambda value: value > 0, "positive").power
    1
    """

    power: int = 0
    fits: Callable[[float], bool] = math.isfinite
    allowed: str = "finite"
    default: float = 1.0
    width: int = 0
    thickness: int = 0
    stiffness: bool = False

    def __repr__(self) -> str:
        return shown(self)


def _poisson(value: float) -> bool:
    return -1 < value <= 0.5


#: Poisson's ratio, which most laws have. What it fits is a function with a name: a law is sent to other processes.
NU = Parameter(0, _poisson, "greater than -1 and at most 0.5", 0.3)


class Circle(NamedTuple):
    """A planar circle: moment M1, energy and kappa* per length, and the tangent moduli, over B.

    ``bending`` is dM1/domega_1; ``contrast`` is dM2/domega_2, infinite where omega_2 = 0; ``twisting`` is dM3/domega_3.
    """

    moment: float
    energy: float
    kappa_star: float
    bending: float
    contrast: float
    twisting: float


@dataclass(frozen=True, repr=False)
class Law:
    """A material law.

    Attributes
    ----------
    name : str
    hamiltonian : callable
        H(M1, M2, M3, kappa_n, *parameters), of numbers: arithmetic, ``math``, decisions, `contin.least`.
    constrained : bool
        True if omega_2 = 0 (then H does not depend on M2, which is a reaction).
    parameters : mapping of str to Parameter
        The law's own parameters, in the order in which they are passed.
    energy : callable, optional
        U(omega_1, omega_2, omega_3, kappa_n, *parameters) in the same manner, without the constant kappa_n**2/2. By default it
        is the Legendre transform of H. A law that states U alone is made by `of_energy`.
    additive : bool
        True if U depends on the differences of the strains from their natural values, so that a natural twist (and a natural
        omega_2) add M3 tau_n (and M2 kappa_2) to H.
    plate : bool
        True if the law is that of a strip of a plate, whose modulus is proportional to width thickness**3.
    ends_with_convexity : bool
        True if the law ends where U loses convexity, since H is found as the Legendre transform of U.
    ends : str
        Why a strip cannot go beyond the end of the law, behind its name; '' for a law that is regular everywhere.
    forms : tuple of Law
        Statements of the same law by other parameters.

    Raises
    ------
    ValueError
        Parameters that are not `Parameter`, or have a name of `RESERVED`; a function with another number of arguments.

    Examples
    --------
    A law with a quartic energy of bending and a length of its own:

    >>> def energy(w1, w2, w3, kappa_n, core):
    ...     bent = w1 - kappa_n
    ...     return bent**2 / 2 + core**2 * bent**4 / 4 + w3**2 / 2 - kappa_n**2 / 2
    >>> law = Law.of_energy("stiffening", energy, {"core": Parameter(1)})
    >>> round(law.circle(1, 0.5, {"core": 2.0})["M1"], 12)
    1.0
    """

    name: str
    hamiltonian: Callable[..., float]
    constrained: bool = True
    parameters: Mapping[str, Parameter] = field(default_factory=lambda: {"nu": NU}, hash=False)
    energy: Callable[..., float] | None = None
    additive: bool = False
    plate: bool = False
    ends_with_convexity: bool = False
    ends: str = ""
    forms: tuple[Law, ...] = ()

    #: True if the surface is ruled along d1 + eta d3, eta = omega_3/omega_1 (6a).
    has_rulings: ClassVar[bool] = False

    def __post_init__(self) -> None:
        known = self.parameters
        if not (isinstance(known, Mapping) and all(isinstance(each, Parameter) for each in known.values())):
            raise ValueError(f"parameters: {self.parameters!r} must be a mapping of names to Parameter(...)")
        for name in known:
            if name in RESERVED or not name.isidentifier():
                raise ValueError(f"parameters: {name!r} is a name of every strip, or not usable as a name; take another one")
        for what in ("energy", "hamiltonian"):
            function = getattr(self, what)
            if not (callable(function) or (what == "energy" and function is None)):
                raise ValueError(f"{what}: {function!r} must be a function")
            if function is not None and len(inspect.signature(function).parameters) != 4 + len(known):
                named = ", ".join(["three moments" if what == "hamiltonian" else "three strains", "kappa_n", *known])
                raise ValueError(f"{what}: must take {4 + len(known)} arguments: {named}")

    @classmethod
    def of_energy(
        cls, name: str, energy: Callable[..., float], parameters: Mapping[str, Parameter], constrained: bool = True, **options
    ) -> Law:
        """Return the law of a strain energy, which is convex around the natural state; H is its Legendre transform."""
        hamiltonian = _transformed(energy, constrained, lambda kappa_n: (kappa_n, 0.0, 0.0))
        options = {"ends_with_convexity": True, "ends": "beyond which its energy is not convex", **options}
        return cls(name, hamiltonian, constrained, parameters, energy, **options)

    def __repr__(self) -> str:
        return f"<law {self.name!r}>"

    # --- parameters -------------------------------------------------------------------------------------------------------

    @property
    def defaults(self) -> dict[str, float]:
        """The parameters and their default values."""
        return {name: parameter.default for name, parameter in self.parameters.items()}

    @property
    def has_width(self) -> bool:
        """True if a parameter depends on the width of the section."""
        return any(parameter.width for parameter in self.parameters.values())

    @property
    def free(self) -> list[int]:
        """The components of the strains that may change."""
        return [0, 2] if self.constrained else [0, 1, 2]

    def named(self, parameters: float | Mapping[str, float]) -> dict[str, float]:
        """Return the parameters by name, in the law's order; see `values`, which also checks their ranges."""
        given = parameters if isinstance(parameters, Mapping) else dict(zip(self.parameters, [parameters]))
        needs = f"the law {self.name!r} needs {', '.join(self.parameters) or 'none'}"
        for name, value in given.items():
            if name not in self.parameters and value is not None:
                raise ValueError(f"{name}: is not a number of the law {self.name!r}; {needs}")
        for name in self.parameters:
            if given.get(name) is None:
                raise ValueError(f"{name}: is missing; {needs}")
        return {name: given[name] for name in self.parameters}

    @takes_parameters
    def values(self, parameters: float | Mapping[str, float]) -> dict[str, float]:
        """Return the law's parameters by name, in its order.

        Parameters
        ----------
        parameters : mapping of str to float, or float
            Values by name (None: not given), or the value of the first parameter.

        Raises
        ------
        ValueError
            A parameter is missing, out of its range, or none of this law.

        Examples
        --------
        >>> from ribbon_model.laws import RIBBON
        >>> RIBBON.values(0.3)
        {'nu': 0.3}
        """
        found = self.named(parameters)
        self.check(found)
        return found

    def check(self, numbers: Mapping[str, float]) -> None:
        """Raise ValueError for a parameter out of its range; other numbers must be finite."""
        for name, value in numbers.items():
            known = self.parameters.get(name, Parameter())
            if not (math.isfinite(value) and known.fits(value)):
                raise ValueError(f"{name}: {value:g} must be {known.allowed}")

    def scaled(self, parameters: Mapping[str, float], unit: float) -> dict[str, float]:
        """Return the parameters in another unit of length, of this many of the present ones.

        Examples
        --------
        >>> from ribbon_model.laws import FINITE_WIDTH
        >>> FINITE_WIDTH.scaled({"nu": 0.3, "Gamma": 10.0}, 0.5)  # Gamma is a length
        {'nu': 0.3, 'Gamma': 20.0}
        """
        return {name: parameters[name] / unit**known.power for name, known in self.parameters.items()}

    def form(self, numbers: Mapping[str, float]) -> Law:
        """Return the form that has one of these numbers where this law does not, or lacks one that is infinite."""
        own = set(self.parameters)
        infinite = {name for name, value in numbers.items() if value == math.inf}
        for form in self.forms:
            if (set(form.parameters) - own) & set(numbers) or infinite & (own - set(form.parameters)):
                return form
        return self

    # --- strains ----------------------------------------------------------------------------------------------------------

    @functools.cached_property
    def response(self) -> Callable[..., tuple]:
        """``response(M1, M2, M3, kappa_n, *parameters)`` = (H, omega_1, omega_2, omega_3, dH/dkappa_n), of numbers."""
        return _with_slopes(self.hamiltonian)

    def at_points(self, moment: Callable[..., tuple], function: Callable) -> Callable:
        """Return f(t, u, p) = ``function(u, p, M, response)`` for `contin`, with M = ``moment(u, p)`` on the directors.

        p, a named tuple, has kappa_n and the law's parameters.
        """
        response, names = self.response, tuple(self.parameters)

        def value(t, u, p):
            M = moment(u, p)
            return function(u, p, M, response(M[0], M[1], M[2], p.kappa_n, *[getattr(p, name) for name in names]))

        return value

    def linearized(self, moments, kappa_n: float, *values: float):
        """Return strains (K, 3) and compliance D2H (K, 3, 3) at moments on the directors (K, 3)."""
        found, slopes = _responses(self, moments, kappa_n, values)
        return found[:, 1:4], slopes[:, 1:4]

    def complementary(self, moments, kappa_n: float, *values: float):
        """Return H (K,) at moments on the directors (K, 3)."""
        return _responses(self, moments, kappa_n, values)[0][:, 0]

    def derivatives(self, strain, kappa_n, *values) -> tuple:
        """Return U, its derivatives by the strains and kappa_n, and theirs.

        Parameters
        ----------
        strain : array, shape (..., 3)
            If the law has omega_2 = 0, omega_2 is ignored and its moment is 0.
        kappa_n, *values : float, or arrays that broadcast to (...)

        Returns
        -------
        U, slopes, curvatures : ndarray, shapes (...), (..., 4), (..., 4, 4)
        """
        import numpy as np

        batch, columns = _energy_at_points(self)
        shape = np.broadcast_shapes(np.shape(strain)[:-1], *(np.shape(value) for value in (kappa_n, *values)))
        points = np.empty((*shape, 4 + len(values)))
        points[..., :3] = strain
        for place, value in enumerate((kappa_n, *values), start=3):
            points[..., place] = value
        points = points.reshape(-1, points.shape[-1])
        found, slopes = batch.jacobian(np.zeros(len(points)), points, points[:0], np.empty(0), columns)
        return found[:, 0].reshape(shape), found[:, 1:].reshape(*shape, 4), slopes[:, 1:].reshape(*shape, 4, 4)

    def strain_energy(self, strain, kappa_n, *values) -> tuple:
        """Return U (...), the moment dU/d(omega) (..., 3) and the stiffness D2U (..., 3, 3) at strains (..., 3).

        If the law has omega_2 = 0, omega_2 is ignored and its moment is 0.
        """
        U, slopes, curvatures = self.derivatives(strain, kappa_n, *values)
        return U, slopes[..., :3], curvatures[..., :3, :3]

    def conjugate(self, strain, kappa_n: float, *values: float):
        """Return -dU/dkappa_n at strains (K, 3), with U as in `strain_energy`."""
        return -self.derivatives(strain, kappa_n, *values)[1][:, 3]

    def margin(self, moment, strain, kappa_n, *values):
        """Return a number (K,) that is positive where the law holds, of order 1, at moments and strains (K, 3).

        It is det D2U over the product of its diagonal, -1 where a modulus is not positive.
        """
        import numpy as np

        stiffness = self.strain_energy(strain, kappa_n, *values)[2][:, self.free][:, :, self.free]
        moduli = np.diagonal(stiffness, axis1=1, axis2=2)
        with np.errstate(divide="ignore", invalid="ignore"):
            ratio = np.linalg.det(np.nan_to_num(stiffness)) / np.prod(moduli, axis=1)
        return np.where(np.all(moduli > 0, axis=1) & np.isfinite(ratio), ratio, -1.0)

    # --- circles ----------------------------------------------------------------------------------------------------------

    def on_circle(self, bending, kappa_n, *values) -> Circle:
        """Return the planar circle with omega_1 = ``bending``; arrays broadcast.

        Raises
        ------
        ValueError
            A law that couples bending and twisting there: the linear theory (section 6 of the paper) is for laws without.
        """
        import numpy as np

        strain = np.stack([bending, np.zeros_like(bending), np.zeros_like(bending)], axis=-1)
        U, slopes, curvatures = self.derivatives(strain, kappa_n, *values)
        sizes = np.abs(np.diagonal(curvatures, axis1=-2, axis2=-1)[..., :3]).sum(axis=-1)
        mixed = (curvatures[..., i, j] for i, j in ((0, 1), (0, 2), (1, 2)))
        if np.any(np.abs(np.stack([slopes[..., 1], slopes[..., 2], *mixed])) > levels.LOCATED * sizes):
            raise ValueError(f"the law {self.name!r} couples bending and twisting on a circle: it has no linear theory")
        moduli = np.diagonal(curvatures, axis1=-2, axis2=-1)
        found = (slopes[..., 0], U, -slopes[..., 3], moduli[..., 0], moduli[..., 1], moduli[..., 2])
        circle = Circle(*(value if np.ndim(value) else float(value) for value in found))
        return circle._replace(contrast=math.inf) if self.constrained else circle

    @takes_parameters
    def circle(self, m: int, kappa_n: float, parameters: float | Mapping[str, float]) -> dict[str, float]:
        """M1, kappa_star (28) and energy (over 2 pi B / L, without the constant kappa_n**2/2) of the m-covered circle."""
        found = self.on_circle(m, kappa_n, *self.values(parameters).values())
        return {"M1": found.moment, "kappa_star": found.kappa_star, "energy": found.energy}

    @takes_parameters
    def tangent_moduli(self, ratio, parameters) -> tuple:
        """Contrast g of the bending moduli and twisting modulus t of (15), over B: Table 2 of the paper.

        Lengths are in units of the radius r0 of the circle: ``ratio`` is kappa_n r0. It may be an array, and so may the
        parameters; g is infinite where the law has omega_2 = 0.
        """
        found = self.on_circle(1.0, ratio, *self.named(parameters).values())
        return found.contrast, found.twisting

    def closed_thresholds(self, m: int, n: int, *values: float) -> tuple[float, ...] | None:
        """Return the values of `ribbon_model.linear.thresholds` where a closed formula is known, else None."""
        return None

    def closed_limits(self, m: int, *values: float) -> tuple[float, float] | None:
        """Return the values of `ribbon_model.linear.convex_limits` where a closed formula is known, else None."""
        return None


def _transformed(function: Callable[..., float], constrained: bool, start: Callable[[float], Sequence[float]]):
    """Return the Legendre transform max over y of x.y - f(y, kappa_n, ...), found from y = ``start(kappa_n)``."""

    @functools.wraps(function)  # with its names of parameters
    def transform(x1, x2, x3, kappa_n, *values):
        from contin.lowlevel import least  # loads compiled code (.3 s), which circles do not need

        first = start(kappa_n)
        if constrained:
            return -least(lambda y: function(y[0], 0.0, y[1], kappa_n, *values) - x1 * y[0] - x3 * y[1], first[::2])
        return -least(lambda y: function(*y, kappa_n, *values) - x1 * y[0] - x2 * y[1] - x3 * y[2], first)

    return transform


def _with_slopes(function: Callable[..., float]) -> Callable[..., tuple]:
    """Return a function and its derivatives by its first four arguments."""
    from contin.lowlevel import gradient  # loads compiled code (.3 s), which a law without its derivatives does not need

    return gradient(function, list(inspect.signature(function).parameters)[:4])


@functools.cache
def _response_at_points(law: Law):
    """Return the response of a law, to be evaluated at many points, and the columns of its derivatives by the moment."""
    from contin.lowlevel import Batch

    response = law.response
    names = ("kappa_n", *law.parameters)
    batch = Batch([lambda M, p: response(*M, *p)], [5], ("M1", "M2", "M3"), names, times=False)
    return batch, batch.columns([])


def _responses(law: Law, moments, kappa_n: float, values: tuple):
    """Return the response (K, 5) and its derivatives (K, 5, 3) at moments (K, 3)."""
    import numpy as np

    batch, columns = _response_at_points(law)
    u = np.ascontiguousarray(moments, dtype=float)
    return batch.jacobian(np.zeros(len(u)), u, u[:0], np.array([kappa_n, *values], dtype=float), columns)


@functools.cache
def _energy_at_points(law: Law):
    """Return U and its slopes, which may have other parameters at each point, and the columns of their derivatives."""
    from contin.lowlevel import Batch

    energy = law.energy or _transformed(law.hamiltonian, law.constrained, lambda kappa_n: (0.0, 0.0, 0.0))
    slopes = _with_slopes(energy)
    names = ("w1", "w2", "w3", "kappa_n", *law.parameters)
    batch = Batch([lambda w, p: slopes(*w)], [5], names, (), times=False)
    return batch, batch.columns([], [0, 1, 2, 3])
