"""The canonical equations of a variational problem, derived symbolically once and kept as text.

With the Hamiltonian H = lambda.f - L - mu.g at the controls w that maximize it,

    x' = dH/dlambda,   lambda' = -dH/dx,   0 = dH/dw,

and at the ends lambda(t0) = d(Phi + sigma.e)/dx(t0), lambda(t1) = -d(Phi + sigma.e)/dx(t1). Where H is quadratic in w, the
controls come in closed form; else from Newton's method at each point, on the convex function -H of w: with real numbers first,
then one step with complex ones, which gives the complex step its derivative (implicit function theorem).

A function that sympy cannot differentiate may state its gradient (see `stated_gradient`). Only its first derivatives are known,
which is enough in a Hamiltonian.
"""

from __future__ import annotations

import functools
import importlib.metadata
import math
import re
import types
from collections import namedtuple
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from contin import checks
from contin.arrays import Function
from contin.errors import ProblemError
from contin.functions import gradient
from contin.functions.cache import run_kept_source
from contin.functions.fingerprint import contents
from contin.functions.pointwise import Pointwise
from contin.functions.signature import argument_count

#: Newton steps for the controls, and halvings of a step that does not lower -H. Damped steps on a convex function arrive.
_NEWTON, _HALVINGS = 60, 40
#: What a user's function may contain after sympy has read it: what can be differentiated twice, and compiled.
_FUNCTIONS = (
    "exp", "log", "sin", "cos", "tan", "asin", "acos", "atan", "atan2", "sinh", "cosh", "tanh", "asinh", "acosh", "atanh",
    "Abs", "sign",
)  # fmt: skip
#: A step below this, relative to 1 + the control, is the last: the next would be its square.
_SETTLED = 1e-9
#: Where the energy is not convex, a pivot is at least this part of 1 + the diagonal: Newton's step is then long, and damped.
_LEAST_PIVOT = 1e-3


@dataclass(frozen=True)
class Variation:
    """What a variational problem is made of; as in `contin.VariationalProblem`.

    ``hamiltonian`` stands instead of ``energy`` and ``kinematics``, or is None.
    """

    energy: Function | None
    kinematics: Function | None
    ends: Function | None
    end_energy: Function | None
    hamiltonian: Function | None
    integrals: Mapping[str, Function]
    functionals: Mapping[str, Function]
    states: tuple[str, ...]
    controls: tuple[str, ...]
    parameters: tuple[str, ...]
    starts: tuple[float, ...]


@dataclass(frozen=True)
class Canonical:
    """The derived functions, plain Python, and how many multipliers of end conditions there are.

    ``rhs(t, u, p)``, ``boundary(u0, u1, p)``, ``integrals(t, u, p)`` or None, and ``functionals[name](t, u, p)`` take u = (x,
    lambda) and p = (parameters, mu, sigma). ``legendre(t, u, p)`` are the pivots of -d2H/dw2 (None where H is given).
    ``fixed`` are the states that end conditions fix, at the first and at the last end.
    """

    rhs: Function
    boundary: Function
    integrals: Function | None
    functionals: Mapping[str, Function]
    legendre: Function | None
    sigmas: int
    fixed: tuple[tuple[int, ...], tuple[int, ...]]


def stated_gradient(value: Any) -> Function | None:
    """Return the attribute ``gradient`` of a plain Python function, None without one.

    ``f.gradient(*arguments)`` returns f and its derivatives by its first arguments, as `contin.gradient` does.
    """
    return getattr(value, "gradient", None) if isinstance(value, types.FunctionType) else None


class _Noted(gradient.Fingerprinted):
    """Take the fingerprint, and list the functions that state their gradients, in the order in which they are met."""

    def __init__(self) -> None:
        super().__init__()
        self.stated: dict[Function, str] = {}

    def function(self, function: Function) -> Any:
        """Note the function, and its gradient where it states one."""
        stated = stated_gradient(function)
        if stated is not None and function not in self.stated:
            self.stated[function] = f"stated{len(self.stated)}"
            super().function(stated)
        return super().function(function)


class _Symbols(gradient.Symbolic):
    """Call functions with symbols; those that state their gradients stay functions of these names."""

    def __init__(self, stated: Mapping[Function, str]) -> None:
        super().__init__()
        self._stated = stated

    def stand_in(self, value: Any) -> Any:
        """Return the function as sympy knows it."""
        if stated_gradient(value) is None:
            return super().stand_in(value)
        return _opaque(self._stated[value], 0)


@functools.cache
def _opaque(name: str, number: int) -> Any:
    """Return the sympy function that stands for a value (number 0) or a first derivative (from 1) of a stated function."""
    import sympy

    def fdiff(self: Any, argindex: int = 1) -> Any:
        if number:
            raise ProblemError(f"{name}: its second derivatives are not known; use it in a hamiltonian")
        return _opaque(name, argindex)(*self.args)

    return type(f"{name}_{number}", (sympy.Function,), {"fdiff": fdiff, "is_real": True, "stated": (name, number)})


def canonical(variation: Variation) -> Canonical:
    """Return the canonical equations of a variational problem.

    Raises
    ------
    ProblemError
        A function that cannot be differentiated symbolically, an energy that does not depend on a control, or end conditions
        that repeat each other.
    """
    rewriter = _Noted()
    functions = [variation.energy, variation.kinematics, variation.ends, variation.end_energy, variation.hamiltonian]
    functions += [*variation.integrals.values(), *variation.functionals.values()]
    for function in functions:
        rewriter.note(function is None)
        if function is not None:
            rewriter.function(function)
    rewriter.note(list(variation.integrals), list(variation.functionals), variation.states, variation.controls)
    rewriter.note(variation.parameters, variation.starts, importlib.metadata.version("sympy"))
    rewriter.note(contents(Path(__file__), Path(str(gradient.__file__))))
    scope: dict[str, Any] = {"math": math, "numpy": np, "__name__": __name__}
    scope |= {name: stated_gradient(function) for function, name in rewriter.stated.items()}
    run_kept_source(f"v{rewriter.fingerprint()[:32]}.py", lambda: _Derivation(variation, rewriter.stated).text(), scope)
    if "pointwise" in scope:
        _check_starts(scope["pointwise"], variation)
    functionals = {name: _of_point(scope, f"functional{i}") for i, name in enumerate(_columns(variation))}
    return Canonical(
        _of_point(scope, "rhs"), scope["boundary"], _of_point(scope, "integrals"), functionals,
        _of_point(scope, "legendre"), scope["SIGMAS"], scope["FIXED"],
    )  # fmt: skip


def _of_point(scope: Mapping[str, Any], name: str) -> Any:
    """Return a derived function of (t, u, p), with its search for the controls if it needs them; None if there is none."""
    function = scope.get(name)
    if function is None or argument_count(function) == 3:
        return function
    return Pointwise(function, scope["solve"])


def _check_starts(pointwise: Any, variation: Variation) -> None:
    """Raise ProblemError where the energy has no value at the controls at which the search for them starts."""
    others = pointwise.__code__.co_argcount - len(variation.starts)
    try:
        pointwise(*[math.nan] * others, *variation.starts)
    except (ValueError, ZeroDivisionError, OverflowError) as error:
        places = ", ".join(f"{name} = {value:g}" for name, value in zip(variation.controls, variation.starts))
        raise ProblemError(f"starts: the energy has no value at the controls {places} ({error})") from error


def _columns(variation: Variation) -> list[str]:
    """Return the names of the functionals: the energy first, unless the user states one of that name."""
    own = list(variation.functionals)
    return own if "energy" in own else ["energy", *own]


class _Derivation:
    """One derivation: symbols, expressions, and the text of the functions."""

    def __init__(self, variation: Variation, stated: Mapping[Function, str]) -> None:
        import sympy  # takes .3 s, and is needed the first time only

        self.sympy, self.variation, self.stated = sympy, variation, stated
        v = variation
        self.t = sympy.Symbol("T", real=True)
        self.x, self.y = self._symbols("X", v.states), self._symbols("Y", v.states)
        self.lam, self.w = self._symbols("L", v.states), self._symbols("W", v.controls)
        # named, so that functions that read the same parameters are the same whatever others there are
        self.p = [sympy.Symbol(f"P_{name}", real=True) for name in v.parameters]
        self.mu = self._symbols("M", tuple(v.integrals))
        self.helpers: list[str] = []
        if v.hamiltonian is not None:
            self._from_hamiltonian()
        else:
            self._from_energy()

    def _symbols(self, letter: str, names: Sequence[str]) -> list[Any]:
        return [self.sympy.Symbol(f"{letter}{i}", real=True) for i in range(len(names))]

    # --- the functions with symbols ------------------------------------------------------------------------------

    def _called(self, what: str, function: Function, *arguments: Any) -> list[Any]:
        """Return the values of a user's function at symbols."""
        try:
            result = _Symbols(self.stated).function(function)(*arguments)
        except ProblemError as error:
            raise ProblemError(f"{what}: {error}") from error
        except Exception as error:  # sympy and a user's function may raise anything
            reason = " ".join(str(error).split())
            if "truth value" in reason:
                reason = "it decides by a comparison (if, max, min), and must be one formula"
            raise ProblemError(
                f"{what} cannot be differentiated: {reason} (write it with arithmetic and functions of math)"
            ) from error
        values = list(result) if isinstance(result, (tuple, list, np.ndarray)) else [result]
        return [self._number(what, value) for value in values]

    def _number(self, what: str, value: Any) -> Any:
        """Return a value of a user's function as an expression.

        Raises
        ------
        ProblemError
            It is no real number, or contains a function that has no derivative here.
        """
        sympy = self.sympy
        term = None if isinstance(value, (str, bool, np.bool_)) or value is None else sympy.sympify(value)
        if not isinstance(term, sympy.Expr):
            raise ProblemError(f"{what} returns {checks.shown(value)}, must return numbers")
        if term.has(sympy.nan, sympy.zoo, sympy.oo, -sympy.oo, sympy.I):
            raise ProblemError(f"{what} has no finite real value: {checks.shown(value)}")
        for function in term.atoms(sympy.Function):
            if function.func.__name__ not in _FUNCTIONS and not hasattr(function, "stated"):
                raise ProblemError(f"{what}: {function.func.__name__} cannot be used here, but {', '.join(_FUNCTIONS)} can")
        return term

    def _named(self, names: Sequence[str], values: Sequence[Any]) -> Any:
        kind: Any = namedtuple("Values", list(names))  # type: ignore[misc]  # noqa: PYI024
        return kind(*values)

    def _at(self, what: str, function: Function, count: int = 1) -> list[Any]:
        """Return the values of a function of (t, x, w, p); ``count`` many of them."""
        v = self.variation
        values = self._called(
            what,
            function,
            self.t,
            self._named(v.states, self.x),
            self._named(v.controls, self.w),
            self._named(v.parameters, self.p),
        )
        if len(values) != count:
            raise ProblemError(f"{what} returns {len(values)} values, must return {count}")
        return values

    # --- H and the controls --------------------------------------------------------------------------------------

    def _from_hamiltonian(self) -> None:
        v, sympy = self.variation, self.sympy
        named = self._named(v.states, self.x), self._named(v.states, self.lam), self._named(v.parameters, self.p)
        assert v.hamiltonian is not None
        (H,) = self._called("hamiltonian", v.hamiltonian, self.t, *named)
        self.rates = [sympy.diff(H, momentum) for momentum in self.lam]
        self.forces = [-sympy.diff(H, state) for state in self.x]
        self.density = sum(momentum * rate for momentum, rate in zip(self.lam, self.rates)) - H
        self.load: list[Any] = []
        self.known = dict(zip(self.w, self.rates))  # without kinematics the controls are the rates

    def _from_energy(self) -> None:
        v, sympy = self.variation, self.sympy
        assert v.energy is not None
        (self.density,) = self._at("energy", v.energy)
        rates = self.w if v.kinematics is None else self._at("kinematics", v.kinematics, len(v.states))
        self.rates = list(rates)
        if not set().union(*(rate.free_symbols for rate in self.rates)) & set(self.w):
            raise ProblemError("kinematics: no rate depends on a control, so nothing can vary")
        self.load = [self._at(f"integrals: {name}", g)[0] for name, g in v.integrals.items()]
        for name, value in zip(v.integrals, self.load):
            if not value.free_symbols & {*self.x, *self.w}:
                raise ProblemError(f"integrals: {name} depends on no state and no control, so nothing makes its integral zero")
        convex = (
            self.density - sum(a * b for a, b in zip(self.lam, self.rates)) + sum(a * b for a, b in zip(self.mu, self.load))
        )
        self.forces = [sympy.diff(convex, state) for state in self.x]
        slopes = [sympy.diff(convex, control) for control in self.w]
        second = sympy.Matrix([[sympy.diff(slope, control) for control in self.w] for slope in slopes])
        for name, row in zip(v.controls, second.tolist()):
            if not any(row):
                raise ProblemError(f"energy: its second derivative by the control {name} is zero, it must be convex in it")
        if not second.free_symbols & set(self.w) and second.det() == 0:
            raise ProblemError(
                f"energy: it does not determine the controls {', '.join(v.controls)}: its second derivative is singular"
            )
        concave = [name for i, name in enumerate(v.controls) if second[i, i].is_nonpositive]
        if concave or (not second.free_symbols and not second.is_positive_definite):
            raise ProblemError(f"energy: it is not convex in the controls {', '.join(concave or v.controls)}")
        self.pivots = self._pivots(second)
        self.known = {}
        if not second.free_symbols & set(self.w):
            at_zero = sympy.Matrix(slopes).subs(dict.fromkeys(self.w, 0))
            self.known = dict(zip(self.w, -second.LUsolve(at_zero)))
        else:
            self._newton(convex, slopes, second)

    def _pivots(self, second: Any) -> list[Any]:
        """Return the pivots of a symmetric matrix, as expressions."""
        a, pivots = second.copy(), []
        for i in range(a.rows):
            pivots.append(a[i, i])
            for j in range(i + 1, a.rows):
                for k in range(i + 1, a.rows):
                    a[j, k] = a[j, k] - a[j, i] * a[i, k] / a[i, i]
        return pivots

    def _newton(self, convex: Any, slopes: list[Any], second: Any) -> None:
        """Write the helpers that find the controls."""
        k = len(self.w)
        pairs = [(i, j) for i in range(k) for j in range(i + 1)]
        given = [self.t, *self.x, *self.lam, *self.p, *self.mu]
        names = ", ".join(map(str, given))
        values = [convex, *slopes, *(second[i, j] for i, j in pairs)]
        self.helpers.append(self._function("pointwise", [*given, *self.w], [], values))
        outputs = ", ".join(["E", *(f"G{i}" for i in range(k)), *(f"A{i}_{j}" for i, j in pairs)])
        solve, exact = _elimination(k, True), _elimination(k, False)
        trial = ", ".join(f"V{i}" for i in range(k))
        own = ", ".join(map(str, self.w))
        lines = [f"def search({names}):"]
        lines += [f"    W{i} = {start!r}" for i, start in enumerate(self.variation.starts)]
        call = f"pointwise({names}, {own})"
        lines += [f"    {outputs} = {call}", f"    for iteration in range({_NEWTON}):", *("        " + line for line in solve)]
        lines += [f"        slope = {' + '.join(f'G{i} * D{i}' for i in range(k))}", "        part = 1.0"]
        lines += [f"        for halving in range({_HALVINGS}):"]
        lines += [f"            V{i} = W{i} + part * D{i}" for i in range(k)]
        lines += [
            f"            F = pointwise({names}, {trial})[0]",
            "            if F <= E + 1e-4 * part * slope + 1e-14 * (1.0 + E * E) ** 0.5:",
            "                break",
            "            part = part * 0.5",
        ]
        lines += [f"        W{i} = W{i} + part * D{i}" for i in range(k)]
        settled = " and ".join(f"D{i} * D{i} <= {_SETTLED**2!r} * (1.0 + W{i} * W{i})" for i in range(k))
        lines += [f"        {outputs} = {call}", f"        if {settled}:", "            break"]
        lines += [f"    return ({own},)", "", f"def controls({names}, {own}):"]
        lines += [f"    {outputs} = {call}", *("    " + line for line in exact)]
        lines += [f"    return ({', '.join(f'W{i} + D{i}' for i in range(k))},)", ""]
        self.helpers.append("\n".join(lines))
        head = ["    " + line for line in self._arguments()]
        self.helpers.append("\n".join(["def solve(t, u, p):", *head, f"    return search({names})", ""]))
        self.given = names

    # --- text ----------------------------------------------------------------------------------------------------

    def _function(
        self, name: str, arguments: Sequence[Any], head: Sequence[str], values: Sequence[Any], single: bool = False
    ) -> str:
        """Return the text of a function of these values, common subexpressions shared."""
        sympy = self.sympy
        sign = sympy.Function("sgn")  # sympy would write copysign, which has no complex values
        terms = [sympy.sympify(value).replace(sympy.DiracDelta, lambda *_: sympy.S.Zero) for value in values]
        terms = [term.replace(sympy.sign, sign) for term in terms]

        def code(term: Any) -> str:
            return str(sympy.pycode(term, user_functions={"sgn": "numpy.sign"}))

        lines: list[str] = []
        terms = self._called_once(terms, lines, code)
        shared, reduced = sympy.cse(terms, symbols=sympy.numbered_symbols("Z"), optimizations="basic")
        lines += [f"    {symbol} = {code(term)}" for symbol, term in shared]
        result = code(reduced[0]) if single else "(" + ", ".join(map(code, reduced)) + ",)"
        lines = [*_read(head, "\n".join([*lines, result])), *lines]
        return "\n".join([f"def {name}({', '.join(map(str, arguments))}):", *lines, f"    return {result}", ""])

    def _called_once(self, terms: list[Any], lines: list[str], code: Function) -> list[Any]:
        """Return the terms with symbols for the values of functions that state their gradients; append their calls to lines."""
        sympy = self.sympy
        found = {atom for term in terms for atom in term.atoms(sympy.Function) if hasattr(atom, "stated")}
        calls = sorted({(atom.stated[0], atom.args) for atom in found}, key=str)
        symbols = {}
        for number, (function, given) in enumerate(calls):
            shared, reduced = sympy.cse(given, symbols=sympy.numbered_symbols(f"A{number}_"), optimizations="basic")
            lines += [f"    {symbol} = {code(term)}" for symbol, term in shared]
            lines.append(f"    R{number} = {function}({', '.join(map(code, reduced))})")
            for atom in sorted((atom for atom in found if (atom.stated[0], atom.args) == (function, given)), key=str):
                symbols[atom] = sympy.Symbol(f"R{number}_{atom.stated[1]}", real=True)
                lines.append(f"    {symbols[atom]} = R{number}[{atom.stated[1]}]")
        return [term.xreplace(symbols) for term in terms]

    def _of_point(self, name: str, values: Sequence[Any], single: bool = False) -> str:
        """Return the text of a function of (t, u, p), with the controls where the values need them."""
        values = [value.subs(self.known, simultaneous=True) for value in map(self.sympy.sympify, values)]
        if single and not values[0].free_symbols:
            values[0] = values[0] + 0.0
        head, arguments = self._arguments(), ["t", "u", "p"]
        if any(value.free_symbols & set(self.w) for value in values):
            found = ", ".join(f"w[{i}]" for i in range(len(self.w)))
            head.append(f"{', '.join(map(str, self.w))}, = controls({self.given}, {found})")
            arguments.append("w")
        return self._function(name, arguments, head, values, single)

    def _arguments(self) -> list[str]:
        """Return the lines that take t, u and p apart."""
        v = self.variation
        lines = ["T = t"]
        lines += [f"{symbol} = u.{state}" for symbol, state in zip(self.x, v.states)]
        lines += [f"{symbol} = u.lam_{state}" for symbol, state in zip(self.lam, v.states)]
        return lines + self._parameters()

    def _parameters(self) -> list[str]:
        v = self.variation
        lines = [f"{symbol} = p.{name}" for symbol, name in zip(self.p, v.parameters)]
        return lines + [f"{symbol} = p.mu_{name}" for symbol, name in zip(self.mu, v.integrals)]

    def text(self) -> str:
        """Return the module."""
        v = self.variation
        parts = ['"""Generated by contin; safe to delete."""', "import math", "", "import numpy", "", "", *self.helpers]
        parts.append(self._of_point("rhs", [*self.rates, *self.forces]))
        if self.load:
            parts.append(self._of_point("integrals", self.load, len(self.load) == 1))
        columns = {"energy": self.density} | {name: self._at(f"functionals: {name}", f)[0] for name, f in v.functionals.items()}
        parts += [self._of_point(f"functional{i}", [columns[name]], single=True) for i, name in enumerate(_columns(v))]
        if v.hamiltonian is None:
            parts.append(self._of_point("legendre", self.pivots))
        parts.append(self._boundary())
        return "\n".join(parts)

    # --- the ends ------------------------------------------------------------------------------------------------

    def _boundary(self) -> str:
        """Return the text of the boundary conditions, with the numbers that say how they were made."""
        v, sympy = self.variation, self.sympy
        first, last = self._named(v.states, self.x), self._named(v.states, self.y)
        p = self._named(v.parameters, self.p)
        ends = [] if v.ends is None else self._called("ends", v.ends, first, last, p)
        phi = [] if v.end_energy is None else self._called("end_energy", v.end_energy, first, last, p)
        if len(phi) > 1:
            raise ProblemError(f"end_energy returns {len(phi)} values, must return 1")
        self._check_ends(ends)
        fixed: tuple[list[int], list[int]] = ([], [])
        sigmas: list[Any] = []
        potential = sum(phi, sympy.S.Zero)
        for number, value in enumerate(ends):
            place = self._fixes(value)
            if place is None:
                sigma = sympy.Symbol(f"S{len(sigmas)}", real=True)
                sigmas.append(sigma)
                potential = potential + sigma * value
            elif place[1] in fixed[place[0]]:
                end, state = ("first", "last")[place[0]], v.states[place[1]]
                raise ProblemError(f"ends: condition {number + 1} fixes {state} at the {end} end, which another one does")
            else:
                fixed[place[0]].append(place[1])
        starting = [sympy.Symbol(f"K{i}", real=True) for i in range(len(v.states))]
        ending = [sympy.Symbol(f"N{i}", real=True) for i in range(len(v.states))]
        values = list(ends)
        values += [starting[i] - sympy.diff(potential, x) for i, x in enumerate(self.x) if i not in fixed[0]]
        values += [ending[i] + sympy.diff(potential, y) for i, y in enumerate(self.y) if i not in fixed[1]]
        head = []
        for state, a, b, k, n in zip(v.states, self.x, self.y, starting, ending):
            head += [f"{a} = a.{state}", f"{b} = b.{state}", f"{k} = a.lam_{state}", f"{n} = b.lam_{state}"]
        head += [*self._parameters(), *(f"{sigma} = p.sigma_{i + 1}" for i, sigma in enumerate(sigmas))]
        facts = [f"SIGMAS = {len(sigmas)}", f"FIXED = {tuple(map(tuple, fixed))!r}", ""]
        return "\n".join([self._function("boundary", ["a", "b", "p"], head, values), *facts])

    def _check_ends(self, ends: list[Any]) -> None:
        """Raise ProblemError for end conditions without a state, and for those linear ones that depend on others."""
        places = [*self.x, *self.y]
        if len(ends) > len(places):
            raise ProblemError(f"ends returns {len(ends)} conditions, {len(places)} fix all states at both ends")
        independent: list[list[float]] = []
        for number, value in enumerate(ends):
            slopes = [self.sympy.diff(value, place) for place in places]
            if not any(slopes):
                raise ProblemError(f"ends: condition {number + 1} depends on no state")
            if all(slope.is_number for slope in slopes):
                independent.append([float(slope) for slope in slopes])
                if np.linalg.matrix_rank(np.array(independent)) < len(independent):
                    raise ProblemError(f"ends: condition {number + 1} repeats or contradicts those before it")

    def _fixes(self, value: Any) -> tuple[int, int] | None:
        """Return the end and the state that a condition fixes: it has a constant slope in that one, and none in the others."""
        own = [(end, i) for end, group in enumerate((self.x, self.y)) for i, x in enumerate(group) if value.has(x)]
        if len(own) != 1:
            return None
        end, i = own[0]
        slope = self.sympy.diff(value, (self.x, self.y)[end][i])
        return own[0] if slope.is_number and slope != 0 else None


def _read(head: Sequence[str], body: str) -> list[str]:
    """Return the lines of a head, ``name = value``, that the rest of the head or the body reads."""
    kept: list[str] = []
    for line in reversed(head):
        target, _, value = line.partition(" = ")
        if "," in target or re.search(rf"\b{target}\b", body):
            kept.insert(0, "    " + line)
            body += "\n" + value
    return kept


def _elimination(k: int, guarded: bool) -> list[str]:
    """Return the lines that solve A D = -G, for a symmetric positive definite A of size k, without pivoting.

    ``guarded`` makes pivots positive that are not: then D still leads downhill.
    """
    lines = []
    for i in range(k):
        lines += [f"B{i}_{j} = A{i}_{j}" for j in range(i + 1)]
        lines.append(f"D{i} = -G{i}")
    for i in range(k):
        if guarded:
            lines.append(f"B{i}_{i} = max(abs(B{i}_{i}), {_LEAST_PIVOT!r} * (1.0 + abs(A{i}_{i})))")
        for j in range(i + 1, k):
            lines.append(f"Q = B{j}_{i} / B{i}_{i}")
            lines += [f"B{m}_{j} = B{m}_{j} - Q * B{m}_{i}" for m in range(j, k)]
            lines.append(f"D{j} = D{j} - Q * D{i}")
    for i in reversed(range(k)):
        lines += [f"D{i} = D{i} - B{j}_{i} * D{j}" for j in range(i + 1, k)]
        lines.append(f"D{i} = D{i} / B{i}_{i}")
    return lines
