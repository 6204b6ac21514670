"""The section of an open strip: a law with its numbers, natural strains, and data along the strip.

Units: the length of the strip is 1, and so is a bending modulus: B of the law, or that unit in which the stiffnesses of a rod
are given. Curvatures and twist are those of a strip of length 1, and Gamma is w**2/(h L). (The laws hold in every unit of
length; closed loops take L/2 pi.)

Everything follows from the law: H(M) = max over the strains of M.omega - U(omega), zero in the natural state. A natural twist,
and a natural curvature about the normal, add M3 tau_n + M2 kappa_2. A section whose modulus is f times that of the first one
has f H(M/f).
"""

from __future__ import annotations

import ast
import functools
import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from types import MappingProxyType, SimpleNamespace

import numpy as np

from contin.lowlevel import one_of
from ribbon_model.ends import ANGLES, LOOSE, PLACE, angles_of, check_known
from ribbon_model.equilibrium import directors, spin
from ribbon_model.law import Law
from ribbon_model.laws import FLAT_ROD, OPEN_LAWS

#: Natural strains: curvature about the width, curvature about the normal, twist.
NATURAL = ("kappa_n", "kappa_2", "tau_n")
#: Kinds of numbers that have the same name in every network; others are ratios (`ribbon_model.network_states.States`).
KINDS = {
    **dict.fromkeys(("weight", "pressure", "follower_pressure"), "force per length"), "field": "couple per length",
    "foundation": "stiffness per length", **dict.fromkeys(NATURAL, "curvature"), "energy": "energy", "potential": "energy",
}  # fmt: skip
#: Relative dimensions of the section along the strip.
DIMENSIONS = ("width", "thickness")
#: A compliance about the normal of the laws with omega_2 = 0, to find a first state; 0 is the law.
SOFTNESS = "softness"
#: Functions in expressions along the strip; all can be differentiated.
_FUNCTIONS = ("sin", "cos", "tan", "exp", "log", "sqrt", "sinh", "cosh", "tanh", "atan")
#: Longest expression. A longer one is a table that should be shorter: each is compiled as one formula.
_LONGEST = 2000
#: Places at which data along the strip are checked, less one.
_STEPS = 40
#: Names that are not free for numbers of expressions.
_RESERVED = {*NATURAL, SOFTNESS} | {
    name for law in OPEN_LAWS.values() for form in (law, *law.forms) for name in form.parameters
}  # fmt: skip

#: A datum along the strip: ``f(t, p)``.
Datum = Callable[..., float]


@dataclass(frozen=True)
class Section:
    """What a strip is made of.

    Attributes
    ----------
    law : Law
    numbers : mapping of str to float
        Values by name: the parameters of the law, or of one of its forms (``B1``, ``B2``, ``C`` of a rod; for a strip of an
        orthotropic plate ``D11``, ``D12``, ``D22``, ``D66`` instead of ``nu``); natural strains ``kappa_n``, ``kappa_2``,
        ``tau_n``, and further names that expressions use. An infinite ``B2`` is a strip that does not bend in its plane.
        Natural strains that are not named are zero; so is ``softness``.
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
    >>> Section(FLAT_ROD, {"nu": 0.3}).parameters
    {'nu': 0.3, 'kappa_n': 0.0, 'tau_n': 0.0, 'softness': 0.0}
    """

    law: Law = FLAT_ROD
    numbers: Mapping[str, float] = field(default_factory=dict)
    along: Mapping[str, str] = field(default_factory=dict)

    def __post_init__(self) -> None:
        numbers, law, name = self.numbers, self.form, self.law.name
        for needed in law.parameters:
            if needed not in numbers:
                raise ValueError(f"{needed}: is missing; the law {name!r} needs {', '.join(law.parameters)}")
        softness, finite = (SOFTNESS,) if law.constrained else (), {}
        for number, value in numbers.items():
            infinite = value == math.inf and number in self.law.parameters and number not in law.parameters
            if infinite:
                continue
            finite[number] = value
            if number in _RESERVED and number not in (*law.parameters, *self.natural, *softness):
                raise ValueError(f"{number}: is not a number of the law {name!r}")
            if number == SOFTNESS and not 0 <= value < math.inf:
                raise ValueError(f"softness: {value:g} must be a finite number from 0")
        law.check(finite)
        for datum, text in self.along.items():
            if datum not in (*self.natural, *DIMENSIONS):
                allowed = ", ".join((*self.natural, *DIMENSIONS))
                raise ValueError(f"along: {datum}: the law {name!r} has no such datum; it has {allowed}")
            check_expression(f"along: {datum}", text, set(numbers) | set(self.natural))
        if not law.plate and set(DIMENSIONS) & set(self.along):
            raise ValueError(f"along: width, thickness: are for flat strips, not for the law {name!r}")
        for datum in self.along:
            self._check_datum(datum)
        used = {name for text in self.along.values() for name in _names(ast.parse(text, mode="eval"))}
        check_known(numbers, (*self.law.parameters, *law.parameters, *self.natural, *softness, *used), "")

    def _check_datum(self, name: str) -> None:
        """Raise ValueError for an expression without a finite value along the strip, or a width or thickness that vanishes."""
        datum, p = self.datum(name), SimpleNamespace(**self.parameters)
        for step in range(_STEPS + 1):
            try:
                value = float(datum(step / _STEPS, p))
            except (ArithmeticError, ValueError, TypeError):
                value = math.nan
            if not math.isfinite(value) or (name in DIMENSIONS and not value > 0):
                allowed = "positive and finite" if name in DIMENSIONS else "finite"
                raise ValueError(f"along: {name}: its value at s = {step / _STEPS:g} must be {allowed}")

    @functools.cached_property
    def form(self) -> Law:
        """The form of the law whose parameters are given."""
        return self.law.form(self.numbers)

    @property
    def natural(self) -> tuple[str, ...]:
        """Names of the natural strains that this law may have."""
        law = self.form
        more = ("tau_n",) if law.constrained else ("tau_n", "kappa_2")
        return ("kappa_n", *(more if law.additive else ()))

    @property
    def constrained(self) -> bool:
        """True if omega_2 = 0: the strip does not bend in its plane."""
        return self.form.constrained

    @functools.cached_property
    def parameters(self) -> dict[str, float]:
        """Names and values of the parameters of the problem."""
        finite = {name: float(value) for name, value in self.numbers.items() if math.isfinite(value)}
        rest = (*self.natural, *((SOFTNESS,) if self.constrained else ()))
        return finite | {name: 0.0 for name in rest if name not in finite}

    @property
    def stiffnesses(self) -> tuple[str, ...]:
        """Names of the parameters that are stiffnesses; none where the bending modulus is one."""
        return tuple(name for name, parameter in self.form.parameters.items() if parameter.stiffness)

    @property
    def stiffness(self) -> float:
        """The smallest stiffness."""
        return min((self.parameters[name] for name in self.stiffnesses), default=1.0)

    @property
    def homogeneous(self) -> bool:
        """True if nothing varies along the strip."""
        return not self.along

    # --- data along the strip ---------------------------------------------------------------------------------------------

    def datum(self, name: str) -> Datum:
        """Return a natural strain, or the relative width or thickness, as a function of (t, p)."""
        if name in self.along:
            return compiled(self.along[name], tuple(self.parameters))
        if name in DIMENSIONS:
            return _one
        return compiled(name, tuple(self.parameters)) if name in self.natural else _zero

    def _values(self) -> Callable[..., list]:
        """Return the parameters of the law, in its order, as a function of (t, p)."""
        width, thickness = self.datum("width"), self.datum("thickness")
        varies = bool(set(DIMENSIONS) & set(self.along))

        def value(name, parameter, t, p):
            number = getattr(p, name)
            if varies and (parameter.width or parameter.thickness):
                return number * width(t, p) ** parameter.width * thickness(t, p) ** parameter.thickness
            return number

        given = tuple(self.form.parameters.items())
        return lambda t, p: [value(name, parameter, t, p) for name, parameter in given]

    def _factor(self) -> Datum:
        """Return the modulus of the section relative to that at s = 0: w h**3."""
        width, thickness = self.datum("width"), self.datum("thickness")
        if not set(DIMENSIONS) & set(self.along):
            return _one
        return lambda t, p: width(t, p) * thickness(t, p) ** 3

    def _at(self, t: np.ndarray, p) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Return modulus (K,), natural strains (3, K) and the parameters of the law (n, K) at places t (K,)."""
        factor, values, natural = self._factor(), self._values(), [self.datum(name) for name in NATURAL]
        if self.homogeneous:
            row = np.array([factor(0.0, p), *(datum(0.0, p) for datum in natural), *values(0.0, p)], dtype=float)
            table = np.broadcast_to(row[:, None], (len(row), len(t)))
        else:
            table = np.array([[factor(s, p), *(datum(s, p) for datum in natural), *values(s, p)] for s in t], dtype=float).T
        return table[0], table[1:4], table[4:]

    # --- the law along the strip ------------------------------------------------------------------------------------------

    def hamiltonian(self) -> Callable[..., float]:
        """Return H(t, M1, M2, M3, p), zero without moments and natural strains: the energy of the natural state is zero."""
        natural_curvature, kappa_2, tau_n = (self.datum(name) for name in NATURAL)
        law, factor, values, soft = self.form.hamiltonian, self._factor(), self._values(), self.constrained

        def hamiltonian(t, M1, M2, M3, p):
            f, kappa_n = factor(t, p), natural_curvature(t, p)
            value = f * (law(M1 / f, M2 / f, M3 / f, kappa_n, *values(t, p)) - kappa_n * kappa_n / 2)
            value = value + M2 * kappa_2(t, p) + M3 * tau_n(t, p)
            return value + p.softness * M2 * M2 / 2 if soft else value

        return hamiltonian

    def strain_energy(self, t: np.ndarray, strains: np.ndarray, p) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Return U, zero in the natural state, the moment dU/d(omega) and the stiffness D2U at places t (K,).

        Components of the strains (K, 3) that cannot change are ignored, and have no moment.
        """
        modulus, (kappa_n, *others), values = self._at(t, p)
        change = strains - np.array([0 * kappa_n, *others]).T
        U, moment, stiffness = self.form.strain_energy(change, kappa_n, *values)
        U = U + kappa_n * kappa_n / 2
        if self.constrained and p.softness > 0:
            bent = change[:, 1]
            U, moment[:, 1] = U + bent * bent / (2 * p.softness), bent / p.softness
            stiffness[:, 1, 1] = 1 / p.softness
        return modulus * U, modulus[:, None] * moment, modulus[:, None, None] * stiffness

    def margin(self, t: np.ndarray, moment: np.ndarray, strains: np.ndarray, p) -> np.ndarray:
        """Return `Law.margin` (K,) at places t (K,) with moments and strains (K, 3)."""
        modulus, (kappa_n, *_), values = self._at(t, p)
        return self.form.margin(moment / modulus[:, None], strains, kappa_n, *values)


def section_of(law: str, numbers: Mapping[str, float], along: Mapping[str, str] = MappingProxyType({})) -> Section:
    """Return the section of a law that is named, as in scenes; raises as `Section`."""
    if law not in OPEN_LAWS:
        raise ValueError(f"law: {one_of(law, OPEN_LAWS)}")
    return Section(OPEN_LAWS[law], numbers, along)


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


def _names(tree: ast.AST) -> set[str]:
    return {node.id for node in ast.walk(tree) if isinstance(node, ast.Name)}


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


# --- the natural state, without loads --------------------------------------------------------------------------------


def natural_states(section: Section, t) -> np.ndarray:
    """Return quaternion and centreline (K, 7) of the natural state at places t (K,) in [0, 1], from the first frame."""
    data = [section.datum(name) for name in NATURAL]
    p, t = SimpleNamespace(**section.parameters), np.atleast_1d(np.asarray(t, dtype=float))
    if not set(NATURAL) & set(section.along):
        return helix(np.array([datum(0.0, p) for datum in data]), t)
    from scipy.integrate import solve_ivp  # takes .5 s, and is needed where natural strains vary only

    def rates(s, x):
        return [*spin(*x[:4], *(datum(s, p) for datum in data), 1), *directors(*x[:4])[6:]]

    order = np.argsort(t)
    found = solve_ivp(rates, (0, 1), [1.0, 0, 0, 0, 0, 0, 0], "DOP853", t[order], rtol=1e-12, atol=1e-12).y.T
    states = np.empty_like(found)
    states[order] = found
    return states


def natural_end(section: Section) -> dict[str, float]:
    """Return place and angles of the last end in the natural state."""
    if all(section.parameters.get(name, 0) == 0 and name not in section.along for name in NATURAL):
        return {**dict.fromkeys(PLACE + ANGLES, 0.0), "distance": 1.0}
    state = natural_states(section, [1.0])[0]
    planar = abs(directors(*state[:4])[0] - 1) < LOOSE
    if not planar:
        angles = angles_of(state[:4])
    else:  # the whole angle by which it turns about the width, the integral of kappa_n
        datum, p = section.datum("kappa_n"), SimpleNamespace(**section.parameters)
        s, weights = np.polynomial.legendre.leggauss(60)
        angles = 0.0, float(sum(w / 2 * datum((x + 1) / 2, p) for x, w in zip(s, weights))), 0.0
    return dict(zip(PLACE + ANGLES, (*map(float, state[4:]), *angles)))


def helix(strains: np.ndarray, t: np.ndarray) -> np.ndarray:
    """Return quaternion and centreline (K, 7) at places t (K,) of a strip whose strains are constant."""
    size = float(np.linalg.norm(strains))
    axis, tangent = strains / (size or 1.0), np.array([0.0, 0.0, 1.0])
    half, angle = size * t[:, None] / 2, size * t[:, None]
    sine = np.sin(angle) / size if size else t[:, None]
    cosine = 2 * np.sin(half) ** 2 / (size or 1.0)  # (1 - cos)/size without cancellation
    place = axis * axis[2] * (t[:, None] - sine) + tangent * sine + np.cross(axis, tangent) * cosine
    return np.hstack([np.cos(half), np.sin(half) * axis, place])
