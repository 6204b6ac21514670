"""The material of an open strip: a law of the paper or a rod, with natural strains and data along the strip.

Units: the length of the strip is 1, and so is a bending modulus: B of the law, or that unit in which B1, B2 and C of a rod are
given. Curvatures and twist are those of a strip of length 1, and Gamma is w**2/(h L). (The laws hold in every unit of length;
closed loops take L/2 pi.)

The Hamiltonian of a strip is that of its section, H(M) = max over the strains of M.omega - U(omega). Natural strains omega_n of
a rod add M.omega_n. A section whose modulus is f times that of the first one has f H(M/f).
"""

from __future__ import annotations

import ast
import functools
import math
import types
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field

import numpy as np

from ribbon_model import finite_width, plate
from ribbon_model.finite_width import Section, ribbon_energy, section_derivatives, section_energy
from ribbon_model.laws import FINITE_WIDTH, FLAT_ROD, ISOTROPIC_ROD, LAWS, RIBBON, Law
from ribbon_model.plate import RIGIDITIES

#: The general Kirchhoff rod, which is no law of the paper.
ROD = "rod"
#: Numbers of a rod: stiffnesses of bending about the width and about the normal, and of twisting.
STIFFNESSES = ("B1", "B2", "C")
#: Natural strains: curvature about the width, curvature about the normal, twist.
NATURAL = ("kappa_n", "kappa_2", "tau_n")
#: Laws that may have a natural twist: quadratic ones. For the others the energy with one is another function.
_TWISTED = (ROD, FLAT_ROD.name, ISOTROPIC_ROD.name)
#: Laws of strips of a plate, which may be orthotropic, with their Hamiltonians then.
_ORTHOTROPIC = {FLAT_ROD.name: plate.flat_rod, RIBBON.name: plate.ribbon, FINITE_WIDTH.name: plate.finite_width}
#: Functions in expressions along the strip; all can be differentiated.
_FUNCTIONS = ("sin", "cos", "tan", "exp", "log", "sqrt", "sinh", "cosh", "tanh", "atan")
#: Longest expression. A longer one is a table that should be shorter: each is compiled as one formula.
_LONGEST = 2000

#: The ribbon's twisting modulus counts as lost where M1 + (1 - nu) kappa_n < -_STEEP |M3|, that is at |omega_3/omega_1| > 2
#: _STEEP. Exact in the plane. Round-off in M3 (1e-13 beside branch points) moves the stop by 1e-10; 10 times larger: by 1e-9.
_STEEP = 1e3
#: Places at which data along the strip are checked, less one.
_STEPS = 40

#: A datum along the strip: ``f(t, p)``.
Datum = Callable[..., float]


@dataclass(frozen=True)
class Material:
    """What a strip is made of.

    Attributes
    ----------
    law : str
        A law of the paper ('ribbon', 'flat rod', 'isotropic rod', 'finite width'), or 'rod'.
    numbers : mapping of str to float
        Values by name: ``nu``, ``Gamma``, or ``B1``, ``B2``, ``C``; for a strip of an orthotropic plate ``D11``, ``D12``,
        ``D22``, ``D66`` instead of ``nu`` (`ribbon_model.plate`); natural strains ``kappa_n``, ``kappa_2``, ``tau_n``, and
        further names that expressions use. An infinite ``B2`` is a strip that does not bend in its plane.
    along : mapping of str to str
        Expressions in s (from 0 to 1) and numbers, for a natural strain, ``width`` or ``thickness`` (relative to s = 0).

    Notes
    -----
    ``softness`` is a number of the laws with omega_2 = 0: a compliance about the normal, to find a first state; 0 is the law.

    Raises
    ------
    ValueError
        A field that does not fit; one sentence.

    Examples
    --------
    >>> Material("flat rod", {"nu": 0.3}).numbers
    {'nu': 0.3, 'kappa_n': 0.0, 'tau_n': 0.0, 'softness': 0.0}
    """

    law: str = FLAT_ROD.name
    numbers: Mapping[str, float] = field(default_factory=dict)
    along: Mapping[str, str] = field(default_factory=dict)

    def __post_init__(self) -> None:
        if self.law != ROD and self.law not in LAWS:
            raise ValueError(f"law: {self.law!r} must be one of {', '.join([*LAWS, ROD])}")
        numbers = {name: float(value) for name, value in self.numbers.items()}
        for name in self.needed:
            if name not in numbers:
                raise ValueError(f"{name}: is missing; the law {self.law!r} needs {', '.join(self.needed)}")
        self._check(numbers)
        for name, text in self.along.items():
            if name not in (*self.natural, "width", "thickness"):
                allowed = ", ".join((*self.natural, "width", "thickness"))
                raise ValueError(f"along: {name}: the law {self.law!r} has no such datum; it has {allowed}")
            check_expression(f"along: {name}", text, set(numbers) | set(self.natural))
        if self.law in (ROD, ISOTROPIC_ROD.name) and {"width", "thickness"} & set(self.along):
            raise ValueError(f"along: width, thickness: are for flat strips, not for the law {self.law!r}")
        rest = dict.fromkeys((*self.natural, *(["softness"] if self.constrained else [])), 0.0)
        object.__setattr__(self, "numbers", {**numbers, **{name: 0.0 for name in rest if name not in numbers}})
        for name in self.along:
            self._check_datum(name)

    def _check_datum(self, name: str) -> None:
        """Raise ValueError for an expression without a finite value along the strip, or a width or thickness that vanishes."""
        datum, p = self.datum(name), types.SimpleNamespace(**self.parameters)
        for step in range(_STEPS + 1):
            try:
                value = float(datum(step / _STEPS, p))
            except (ArithmeticError, ValueError, TypeError):
                value = math.nan
            if not math.isfinite(value) or (name in ("width", "thickness") and not value > 0):
                allowed = "positive and finite" if name in ("width", "thickness") else "finite"
                raise ValueError(f"along: {name}: its value at s = {step / _STEPS:g} must be {allowed}")

    def _check(self, numbers: Mapping[str, float]) -> None:
        own = (*self.needed, *NATURAL, "softness", "Gamma", "nu", *STIFFNESSES, *RIGIDITIES)
        for name, value in numbers.items():
            infinite = name == "B2" and value == math.inf
            if name in own and name not in (*self.needed, *self.natural, "softness"):
                raise ValueError(f"{name}: is not a number of the law {self.law!r}")
            if not (math.isfinite(value) or infinite):
                raise ValueError(f"{name}: {value:g} must be finite")
            if name in (*STIFFNESSES, "D11", "D22", "D66") and not value > 0:
                raise ValueError(f"{name}: {value:g} must be positive")
            if name == "nu" and not -1 < value <= 0.5:
                raise ValueError(f"nu: {value:g} must be greater than -1 and at most 0.5")
            if name in ("Gamma", "softness") and not value >= 0:
                raise ValueError(f"{name}: {value:g} must not be negative")
        if self.orthotropic and not numbers["D11"] * numbers["D22"] > numbers["D12"] ** 2:
            raise ValueError(f"D12: {numbers['D12']:g} must be smaller than the square root of D11 D22")

    @property
    def needed(self) -> tuple[str, ...]:
        """Names of the numbers that must be given."""
        if self.law == ROD:
            return STIFFNESSES
        own = LAWS[self.law].parameters
        return (*RIGIDITIES, *(name for name in own if name != "nu")) if self.orthotropic else own

    @property
    def orthotropic(self) -> bool:
        """True if the stiffnesses of a plate stand in place of nu."""
        return self.law in _ORTHOTROPIC and any(name in self.numbers for name in RIGIDITIES)

    @property
    def natural(self) -> tuple[str, ...]:
        """Names of the natural strains that this law may have."""
        names = ["kappa_n"]
        if self.law in _TWISTED:
            names.append("tau_n")
        if not self.constrained:
            names.append("kappa_2")
        return tuple(names)

    @property
    def constrained(self) -> bool:
        """True if omega_2 = 0: the strip does not bend in its plane."""
        return self.numbers.get("B2") == math.inf if self.law == ROD else LAWS[self.law].constrained

    @property
    def parameters(self) -> dict[str, float]:
        """Names and values of the parameters of the problem."""
        return {name: value for name, value in self.numbers.items() if math.isfinite(value)}

    @property
    def stiffnesses(self) -> tuple[str, ...]:
        """Names of the parameters that are stiffnesses; none where the bending modulus is one."""
        return tuple(name for name in (*STIFFNESSES, "D11", "D22", "D66") if name in self.parameters)

    @property
    def stiffness(self) -> float:
        """The smallest stiffness."""
        return min((self.parameters[name] for name in self.stiffnesses), default=1.0)

    @property
    def of_paper(self) -> Law | None:
        """The law of the paper; None for a rod."""
        return LAWS.get(self.law)

    @property
    def ruled(self) -> bool:
        """True if the surface has generators."""
        return self.of_paper is not None and self.of_paper.has_rulings

    @property
    def homogeneous(self) -> bool:
        """True if nothing varies along the strip."""
        return not self.along

    def datum(self, name: str) -> Datum:
        """Return a natural strain, or the relative width or thickness, as a function of (t, p)."""
        if name in self.along:
            return compiled(self.along[name], tuple(self.parameters))
        if name in ("width", "thickness"):
            return _one
        return compiled(name, tuple(self.parameters)) if name in self.natural else _zero

    def hamiltonian(self) -> Callable[..., float]:
        """Return H(t, M1, M2, M3, p), zero without moments and natural strains: the energy of the natural state is zero."""
        kappa_n, kappa_2, tau_n = (self.datum(name) for name in NATURAL)
        section, factor, soft = self._section(), self._factor(), self.constrained

        def hamiltonian(t, M1, M2, M3, p):
            f = factor(t, p)
            value = f * section(t, M1 / f, M2 / f, M3 / f, kappa_n(t, p), p) + M2 * kappa_2(t, p) + M3 * tau_n(t, p)
            return value + p.softness * M2 * M2 / 2 if soft else value

        return hamiltonian

    def _factor(self) -> Datum:
        """Return the modulus of the section relative to that at s = 0: w h**3."""
        width, thickness = self.datum("width"), self.datum("thickness")
        if not {"width", "thickness"} & set(self.along):
            return _one
        return lambda t, p: width(t, p) * thickness(t, p) ** 3

    def _section(self) -> Callable[..., float]:
        """Return H(t, M1, M2, M3, kappa_n, p) of a section of modulus one."""
        law = self.of_paper
        if law is None:
            rigid = self.constrained

            def rod(t, M1, M2, M3, kappa_n, p):
                value = M1 * M1 / (2 * p.B1) + M3 * M3 / (2 * p.C) + M1 * kappa_n
                return value if rigid else value + M2 * M2 / (2 * p.B2)

            return rod
        complementary, width, thickness = law.hamiltonian, self.datum("width"), self.datum("thickness")
        if self.orthotropic:
            return self._orthotropic_section()
        if law.has_width:
            return lambda t, M1, M2, M3, kappa_n, p: finite_width.complementary(
                M1, M3, kappa_n, finite_width.isotropic(p.nu, p.Gamma * width(t, p) ** 2 / thickness(t, p))
            )
        return lambda t, M1, M2, M3, kappa_n, p: complementary(M1, M2, M3, kappa_n, p.nu) - kappa_n * kappa_n / 2

    def _orthotropic_section(self) -> Callable[..., float]:
        """Return the same for a strip of an orthotropic plate."""
        section, width, thickness = _ORTHOTROPIC[self.law], self.datum("width"), self.datum("thickness")
        if self.law == FINITE_WIDTH.name:
            return lambda t, M1, M2, M3, kappa_n, p: section(
                M1, M2, M3, kappa_n, p.D11, p.D12, p.D22, p.D66, p.Gamma * width(t, p) ** 2 / thickness(t, p)
            )
        return lambda t, M1, M2, M3, kappa_n, p: section(M1, M2, M3, kappa_n, p.D11, p.D12, p.D22, p.D66)

    def strain_energy(self, t: np.ndarray, strains: np.ndarray, p) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Return U, zero in the natural state, the moment dU/d(omega) and the stiffness D2U at places t (K,).

        Components of the strains (K, 3) that cannot change are ignored, and have no moment.
        """
        data, factor = [self.datum(name) for name in NATURAL], self._factor()
        natural = np.array([[datum(s, p) for datum in data] for s in t])
        modulus = np.array([factor(s, p) for s in t])
        if self.law in (RIBBON.name, FINITE_WIDTH.name):
            U, moment, stiffness = self._wide_energy(t, strains, natural[:, 0], p)
        else:
            moduli, change = self._moduli(p), strains - natural
            U, moment = (moduli * change * change).sum(axis=1) / 2, moduli * change
            stiffness = np.broadcast_to(np.diag(moduli), (len(t), 3, 3)).copy()
        if self.constrained and p.softness > 0:
            bent = strains[:, 1] - natural[:, 1]
            U, moment[:, 1] = U + bent * bent / (2 * p.softness), bent / p.softness
            stiffness[:, 1, 1] = 1 / p.softness
        return modulus * U, modulus[:, None] * moment, modulus[:, None, None] * stiffness

    def _moduli(self, p) -> np.ndarray:
        """Return the three stiffnesses of a quadratic law; zero where omega_2 = 0."""
        if self.law == ROD:
            return np.array([p.B1, 0.0 if self.constrained else p.B2, p.C])
        if self.orthotropic:
            return np.array([p.D11 - p.D12**2 / p.D22, 0.0, 4 * p.D66])
        twisting = 1 / (1 + p.nu)
        return np.array([1.0, 1.0, twisting] if self.law == ISOTROPIC_ROD.name else [1.0, 0.0, 2 * twisting])

    def _wide_energy(self, t: np.ndarray, strains: np.ndarray, kappa_n: np.ndarray, p) -> tuple[np.ndarray, ...]:
        """Return `strain_energy` of a ribbon (infinite unless omega_1 > 0) or a strip of finite width."""
        moment, stiffness = np.zeros((len(t), 3)), np.zeros((len(t), 3, 3))
        modulus = p.D22 if self.orthotropic else 1.0
        U, U1, U3, U11, U13, U33 = self._wide_derivatives(t, strains, kappa_n, p)[:6]
        valid = strains[:, 0] > 0 if self.law == RIBBON.name else np.full(len(t), True)
        moment[:, 0], moment[:, 2] = np.where(valid, U1, 0.0), np.where(valid, U3, 0.0)
        stiffness[valid, ::2, ::2] = np.array([[U11, U13], [U13, U33]])[:, :, valid].transpose(2, 0, 1)
        return np.where(valid, modulus * U, math.inf), modulus * moment, modulus * stiffness

    def _wide_derivatives(self, t: np.ndarray, strains: np.ndarray, kappa_n: np.ndarray, p) -> tuple[np.ndarray, ...]:
        """Return `finite_width.section_derivatives` at places t (K,) with strains (K, 3)."""
        sections = np.array([self._section_at(s, p) for s in t], dtype=float).reshape(-1, len(Section._fields))
        function = ribbon_energy if self.law == RIBBON.name else section_energy
        return section_derivatives(strains[:, 0], strains[:, 2], kappa_n, Section(*sections.T), function)

    def _section_at(self, t: float, p) -> Section:
        """Return the section of a ribbon or a strip of finite width at a place."""
        rigidities = (p.D11, p.D12, p.D22, p.D66) if self.orthotropic else (1.0, p.nu, 1.0, (1 - p.nu) / 2)
        if self.law == RIBBON.name:
            return plate.section_of(*rigidities, math.inf)
        return plate.section_of(*rigidities, p.Gamma * self.datum("width")(t, p) ** 2 / self.datum("thickness")(t, p))

    def ribbon_margin(self, t: float, M1: float, M3: float, p) -> float:
        """Return a number that is positive where the law of the ribbon holds: omega_1 > 0, and no other strain is preferred.

        With p, a and c of `ribbon_model.laws.ribbon_hamiltonian`, omega_1 = c/(1 + eta**2) and p = a (1 - eta**2). The law
        ends in two ways (nu kappa_n > 0: the first one comes first in the plane; nu kappa_n < 0: the second one):

        - a = 0, where M3 = 0 and p = M1 + (1 - nu) kappa_n = 0: the twisting modulus 2 a/omega_1 vanishes. For smaller p
          with M3 = 0, omega_1 = 0 and the generators run along the strip (eta is infinite).
        - p + 2 nu kappa_n = M1 + (1 + nu) kappa_n = 0, at any M3: the two roots a belong to omega_1 of either sign, and their
          H differ by sqrt(p**2 + M3**2) (p + 2 nu kappa_n)/2. Where that is negative, the strain of the other sign has less
          energy at this moment (Weierstrass' condition).
        """
        f, kappa_n, (near, far) = self._factor()(t, p), self.datum("kappa_n")(t, p), self._sides(p)
        return M1 / f + near * kappa_n + min(_STEEP * abs(M3 / f), (far - near) * kappa_n)

    def _sides(self, p) -> tuple[float, float]:
        """Return k of M1 + k kappa_n where a ribbon loses its twisting modulus, and where it bends to the other side.

        For an orthotropic plate, with s = D12 + 2 D66 and r = sqrt(D11 D22): without M3, M1 omega_1 - U is a quadratic function
        of omega_1 and k2 = omega_3**2/omega_1. Its maximum leaves k2 = 0 where t = 0 (s < r), or jumps to omega_1 = 0 before
        (s > r). (A plate with s <= 0 has no end of this kind: it twists however far it is bent.) The second k is exact without
        kappa_n, or where s = r; otherwise it is an estimate.
        """
        if not self.orthotropic:
            return 1 - p.nu, 1 + p.nu
        root = math.sqrt(p.D11 * p.D22)
        twisting = p.D12 + 2 * p.D66
        least = min(twisting, root) if twisting > 0 else root
        return p.D11 * (1 - p.D12 / least), p.D11 * (1 + p.D12 / root)

    def curvatures(self, t: np.ndarray, strains: np.ndarray, p) -> tuple[np.ndarray, ...]:
        """Return U_11, U_13 and U_33 of the law of finite width at places t (K,) with strains (K, 3), up to a factor."""
        natural = self.datum("kappa_n")
        return self._wide_derivatives(t, strains, np.array([natural(s, p) for s in t]), p)[3:6]


# --- expressions ------------------------------------------------------------------------------------------------------------


def _one(t, p):
    return 1.0


def _zero(t, p):
    return 0.0


@functools.lru_cache(maxsize=1000)  # a strip of segments asks for its data at every step downhill
def compiled(text: str, names: tuple[str, ...]) -> Datum:
    """Return an expression in s, pi, functions and these names as a function of (t, p), with the names as fields of p.

    Raises
    ------
    ValueError
        See `check_expression`.
    """
    tree = ast.parse(text, mode="eval")
    check_expression("expression", text, set(names))
    scope = {"math": math}
    exec(compile(f"def datum(t, p):\n    return {ast.unparse(_Fields(names).visit(tree))}", "<along>", "exec"), scope)
    return scope["datum"]


class _Fields(ast.NodeTransformer):
    """Names of an expression as a function of (t, p) reads them."""

    def __init__(self, names: tuple[str, ...]):
        self._names = names

    def visit_Name(self, node: ast.Name) -> ast.AST:
        if node.id in self._names:
            return ast.parse(f"p.{node.id}", mode="eval").body
        return ast.parse({"s": "t"}.get(node.id, f"math.{node.id}"), mode="eval").body


def check_expression(what: str, text: str, names: set[str]) -> None:
    """Raise ValueError unless the text is an expression in s, pi, functions and names.

    Raises
    ------
    ValueError
        One sentence that says what is allowed.
    """
    allowed = f"arithmetic with s, pi, {', '.join(_FUNCTIONS)}" + "".join(f", {name}" for name in sorted(names))
    if not isinstance(text, str) or len(text) > _LONGEST:
        raise ValueError(f"{what}: must be an expression of at most {_LONGEST} letters ({allowed})")
    try:
        tree = ast.parse(text, mode="eval")
    except (SyntaxError, ValueError, RecursionError, MemoryError):
        raise ValueError(f"{what}: {text!r} is not an expression ({allowed})") from None
    called = {node.func for node in ast.walk(tree) if isinstance(node, ast.Call)}
    kinds = (ast.Expression, ast.BinOp, ast.UnaryOp, ast.operator, ast.unaryop, ast.Load, ast.Name, ast.Constant, ast.Call)
    for node in ast.walk(tree):
        good = isinstance(node, kinds) and not isinstance(node, (ast.Not, ast.FloorDiv, ast.Mod, ast.BitOr, ast.BitAnd))
        if isinstance(node, ast.Name):
            good = node.id in _FUNCTIONS if node in called else node.id in names | {"s", "pi"}
        if isinstance(node, ast.Constant):
            good = type(node.value) in (int, float) and abs(node.value) < 1e12
        if isinstance(node, ast.Call):
            good = isinstance(node.func, ast.Name) and len(node.args) == 1 and not node.keywords
        if not good:
            raise ValueError(f"{what}: {text!r}: {ast.unparse(node) or 'this'!r} is not allowed ({allowed})")
