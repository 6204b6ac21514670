"""From a user's plain Python function to a compiled batch evaluation with its exact Jacobian.

A function of a point, ``f(t, u, p)``, is wrapped in a loop over many points that also differentiates it by the
complex step: with h = 2^-300 the imaginary part of ``f(u + i h e_j)`` divided by h is the derivative to round-off.
The wrapper is written as a small module into a cache directory named after a fingerprint of the user's code
(bytecode, constants, closures, everything it calls), so a second process compiles nothing and an edit of a helper in
another file is never missed.
"""

from __future__ import annotations

import builtins
import dis
import hashlib
import importlib.util
import inspect
import keyword
import math
import sys
import types
from collections import namedtuple
from collections.abc import Callable, Mapping, Sequence
from typing import Any

import numba
import numpy as np
from numba.core.dispatcher import Dispatcher

from contin import _checks
from contin._analytic import AnalyticCompiler
from contin._cache import cache_directory, write_source
from contin.errors import ProblemError
from contin.interface import Array, Function, Indices

#: More states than any mesh has room for.
_MOST_STATES = 10_000
#: Part of every fingerprint: changes when functions are compiled by other rules (the template has its own part).
_RULES = 5

_TEMPLATE = '''"""Generated; safe to delete."""
from collections import namedtuple
import numpy as np
from contin._kernels import njit

U = namedtuple("U", {states})
V = namedtuple("V", {states})
P = namedtuple("P", {parameters})
STEP = 2.0 ** -300


@njit("void(f8[::1], f8[:,::1], f8[:,::1], f8[::1], i8[::1], f8[:,::1], f8[:,:,::1])",
      cache=True, error_model="numpy", nogil=True)
def evaluate(t, u, v, p, free, out, jac):
    for i in range(u.shape[0]):
{real}
    if jac.size == 0:
        return
    seed = np.zeros({n} + {nv} + {k})
    for i in range(u.shape[0]):
        for column in range(jac.shape[2]):
            slot = column if column < {n} + {nv} else {n} + {nv} + free[column - {n} - {nv}]
            seed[slot] = STEP
{complex}
            seed[slot] = 0.0
'''


def _analytic_abs(z: Any) -> Any:
    return z if z.real >= 0 else -z


def _analytic_sign(z: Any) -> Any:
    return 1.0 if z.real > 0 else (-1.0 if z.real < 0 else 0.0)


def _analytic_max(a: Any, b: Any) -> Any:
    return a + 0 * b if a.real >= b.real else b + 0 * a


def _analytic_min(a: Any, b: Any) -> Any:
    return a + 0 * b if a.real <= b.real else b + 0 * a


def _analytic_atan2(y: Any, x: Any) -> Any:
    a, b = x.real, y.real  # turned by the real angle, what is left is analytic
    return np.arctan2(b, a) + np.arctan((y * a - x * b) / (x * a + y * b))


#: What cannot be differentiated by a complex step as numpy defines it, and what replaces it.
_REPLACED = {
    "abs": _analytic_abs, "absolute": _analytic_abs, "fabs": _analytic_abs, "sign": _analytic_sign,
    "maximum": _analytic_max, "fmax": _analytic_max, "minimum": _analytic_min, "fmin": _analytic_min,
    "max": _analytic_max, "min": _analytic_min,
}  # fmt: skip
#: Functions that exist in ``math`` under another name than in numpy.
_MATH_NAMES = {
    "asin": np.arcsin, "acos": np.arccos, "atan": np.arctan, "asinh": np.arcsinh, "acosh": np.arccosh,
    "atanh": np.arctanh, "pow": np.power,
}  # fmt: skip
_MATH_SAME = ("sqrt", "exp", "expm1", "log", "log1p", "log10", "sin", "cos", "tan", "sinh", "cosh", "tanh")
_MATH: dict[Any, Function] = {getattr(math, name): getattr(np, name) for name in _MATH_SAME}
_MATH |= {getattr(math, name): function for name, function in _MATH_NAMES.items()}
_SCALARS: dict[Any, Function] = {math.fabs: _analytic_abs, abs: _analytic_abs, max: _analytic_max, min: _analytic_min}
_SCALARS |= {getattr(np, name): f for name, f in _REPLACED.items() if name not in ("max", "min")}
_SCALARS |= {math.atan2: _analytic_atan2}
_SCALARS |= {np.arctan2: _analytic_atan2}


class _Prepared:
    """Users' functions made ready for numba: what they call compiled too, ``math`` made complex-aware, fingerprinted."""

    def __init__(self) -> None:
        self._done: dict[object, tuple[Any, str]] = {}
        self._open: set[object] = set()
        self._hashes = [hashlib.sha256()]  # of the whole, and of each function being looked at

    def fingerprint(self) -> str:
        return self._hashes[0].hexdigest()

    def note(self, *what: object) -> None:
        for item in what:
            self._hashes[-1].update(repr(item).encode() + b"\0")

    def function(self, function: Function) -> Any:
        """Compile ``function`` and all plain Python functions that it refers to.

        The compiled function is named after its own fingerprint: numba tells machine code apart by names, and two functions
        that share a name, cached by two processes, would be taken for one another in a third.
        """
        function = getattr(function, "py_func", function)
        if not isinstance(function, types.FunctionType):
            raise ProblemError(f"{_checks.shown(function)} must be a plain Python function (def or lambda)")
        if function in self._open:
            raise ProblemError(f"function {function.__name__!r} calls itself; write a loop instead")
        if function not in self._done:
            self._open.add(function)
            self._hashes.append(hashlib.sha256())
            copy = self._copy(function)
            digest = self._hashes.pop().hexdigest()
            copy.__name__ = copy.__qualname__ = f"user_{digest[:32]}"
            compiled: Any = numba.njit(copy, error_model="numpy", pipeline_class=AnalyticCompiler)
            self._done[function] = compiled, digest
            self._open.discard(function)
        kept, digest = self._done[function]
        self.note(digest)
        return kept

    def _copy(self, function: types.FunctionType) -> types.FunctionType:
        """The function with everything that it refers to made ready, its fingerprint taken on the way."""
        code = function.__code__
        names, loaded = self._code(code)
        self.note(function.__defaults__, function.__kwdefaults__)
        globals_ = {"__name__": __name__, "__builtins__": __builtins__}  # numba imports the module of that name
        for name in sorted(loaded):
            if name in function.__globals__:
                globals_[name] = self._value(function.__globals__[name], names)
            elif name in ("abs", "max", "min"):
                globals_[name] = self._value(getattr(builtins, name), names)
        cells = [types.CellType(self._value(cell.cell_contents, names)) for cell in function.__closure__ or ()]
        copy = types.FunctionType(code, globals_, function.__name__, function.__defaults__, tuple(cells) or None)
        copy.__kwdefaults__ = function.__kwdefaults__
        return copy

    def _code(self, code: types.CodeType) -> tuple[set[str], set[str]]:
        """Take the fingerprint of a code object and of those inside it; the attributes and the globals that they use.

        A state may have the name of a global (``u.f`` in a function ``f``): the instructions tell the two apart. Attributes of
        local variables are states and parameters and do not count.
        """
        self.note(code.co_code, code.co_names, code.co_varnames)
        names, loaded, before = set(), set(), ""
        for step in dis.get_instructions(code):
            if step.opname in ("LOAD_GLOBAL", "LOAD_NAME"):
                loaded.add(step.argval)
            elif step.opname in ("LOAD_ATTR", "LOAD_METHOD") and not before.startswith("LOAD_FAST"):
                names.add(step.argval)
            before = step.opname
        for constant in code.co_consts:
            if isinstance(constant, types.CodeType):
                inner_names, inner_loaded = self._code(constant)
                names, loaded = names | inner_names, loaded | inner_loaded
            else:
                self.note(constant)
        return names, loaded

    def _value(self, value: object, names: set[str]) -> object:
        """The stand-in for a global or closure value inside the compiled code."""
        replaced = _replacement(value)
        if replaced is not None:
            self.note(value)
            return replaced
        if isinstance(value, (types.FunctionType, Dispatcher)):
            return self.function(value)
        if isinstance(value, types.ModuleType):
            return self._module(value, names)
        if isinstance(value, np.ndarray):
            self.note(value.shape, value.dtype, value.tobytes())
        else:
            self.note(value)
        return value

    def _module(self, module: types.ModuleType, names: set[str]) -> types.ModuleType:
        """A copy of a module that holds just the ``names`` used, made complex-aware."""
        stand_in = types.ModuleType(module.__name__)
        self.note(module.__name__)
        for name in sorted(names & set(dir(module))):
            value = getattr(module, name)
            if module is np or module is math:
                value = value if (replaced := _replacement(value)) is None else replaced
            else:
                value = self._value(value, names)
            setattr(stand_in, name, value)
        return stand_in


def _replacement(value: Any) -> Any:
    """What stands for a function that is not analytic, or that exists for real numbers only; None for all others."""
    try:
        if value in _MATH:
            return _MATH[value]
        if value in _SCALARS:
            return numba.njit(_SCALARS[value])
    except TypeError:  # unhashable: an array or a list, never one of these functions
        pass
    return None


def check_names(kind: str, names: Sequence[str]) -> tuple[str, ...]:
    """``names`` as a tuple, or a `ProblemError` that says which one cannot be used."""
    names = tuple(_checks.sequence(kind, names, "names"))
    for name in names:
        if not isinstance(name, str) or not name.isidentifier() or keyword.iskeyword(name) or name.startswith("_"):
            raise ProblemError(
                f"{kind}: {_checks.shown(name)} is not usable as a name (a Python identifier, no keyword, no leading _)"
            )
        if names.count(name) > 1:
            raise ProblemError(f"{kind}: the name {name!r} stands twice")
    return names


def check_statement(
    states: Sequence[str] | int, parameters: Mapping[str, float], functionals: Mapping[str, Function]
) -> tuple[str, ...]:
    """The names of states (u0, u1, ... for a number), after names and values of a problem were checked."""
    if isinstance(states, (int, np.integer)):
        _checks.whole("states", states, 1, _MOST_STATES)
        states = [f"u{i}" for i in range(states)]
    names = check_names("states", states)
    if not 1 <= len(names) <= _MOST_STATES:
        raise ProblemError(f"states: there must be at least one, and at most {_MOST_STATES}")
    check_names("parameters", tuple(_checks.mapping("parameters", parameters, "numbers")))
    check_names("functionals", [*_checks.mapping("functionals", functionals, "functions"), *parameters])
    for name, value in parameters.items():
        if not _checks.is_number(value) or not math.isfinite(value):
            raise ProblemError(f"parameters: {name} = {_checks.shown(value)} must be a finite number")
    for name, function in functionals.items():
        _checks.function(f"functionals: {name}", function)
    return names


def outputs(function: Function, arguments: Sequence[tuple[str, ...] | None], what: str) -> int:
    """How many values ``function`` returns (0: a single number), found by one call in Python with NaN everywhere."""
    plain = getattr(function, "py_func", function)
    tuples: list[Any] = [None if names is None else namedtuple("Values", names) for names in arguments]
    values = [math.nan if kind is None else kind(*[math.nan] * len(kind._fields)) for kind in tuples]
    try:
        with np.errstate(all="ignore"):
            result = plain(*values)
    except Exception as error:
        reason = " ".join(str(error).split())
        raise ProblemError(f"{what} cannot be called: {type(error).__name__}: {reason}") from error
    return len(result) if isinstance(result, (tuple, list, np.ndarray)) else 0


class Batch:
    """Functions of a point, compiled together: values and exact Jacobian at many points in one call.

    Parameters
    ----------
    functions : sequence of callable
        Each ``f(t, u, p)`` of a time and two named tuples, or with ``ends=True`` ``f(u, v, p)`` of the states at both
        ends. It returns a number or a tuple of numbers; with one argument more it fills that array instead, and
        gets arrays in place of named tuples.
    counts : sequence of int
        Number of values of each function; 0 stands for one number that is no tuple.
    states, parameters : tuple of str
        Names, in order.
    times : bool
        Whether the functions take t; ``f(u, p)`` without.
    """

    def __init__(
        self,
        functions: Sequence[Function],
        counts: Sequence[int],
        states: Sequence[str],
        parameters: Sequence[str],
        *,
        ends: bool = False,
        times: bool = True,
    ) -> None:
        self.states, self.parameters, self.ends, self.times = tuple(states), tuple(parameters), ends, times and not ends
        self.count = sum(max(count, 1) for count in counts)
        expected = 2 + self.ends + self.times
        fills = [argument_count(function) == expected + 1 for function in functions]
        prepared = _Prepared()
        prepared.note(_RULES, numba.__version__, np.__version__, sys.version)
        dispatchers = {f"function{i}": prepared.function(function) for i, function in enumerate(functions)}
        source = self._source(counts, fills)
        prepared.note(source)
        names = " and ".join(function.__name__ for function in functions)
        self._evaluate = _module(prepared.fingerprint(), dispatchers, names, source).evaluate

    def _source(self, counts: Sequence[int], fills: Sequence[bool]) -> str:
        n, k = len(self.states), len(self.parameters)
        nv = n if self.ends else 0

        def calls(indent: int, dtype: str, number: Callable[[str, int], str], result: Callable[[int, str], str]) -> str:
            """Lines that call every function at point i and store the results."""
            u, v, p = (
                "".join(number(f"{letter}{j}]", slot + j) + ", " for j in range(size))
                for letter, size, slot in (("u[i, ", n, 0), ("v[i, ", nv, n), ("p[", k, n + nv))
            )
            lines, row = [], 0
            for index, (count, fill) in enumerate(zip(counts, fills)):
                wrap: Callable[[str, str], str]
                wrap = (lambda name, text: f"np.array([{text}])") if fill else (lambda name, text: f"{name}({text})")
                first = ("t[i], " if self.times else "") + wrap("U", u) + (f", {wrap('V', v)}" if self.ends else "")
                if fill:
                    lines.append(f"r = np.zeros({count}, np.{dtype})")
                    lines.append(f"function{index}({first}, {wrap('P', p)}, r)")
                else:
                    lines.append(f"r = function{index}({first}, {wrap('P', p)})")
                for j in range(max(count, 1)):
                    lines.append(result(row, f"r[{j}]" if count else "r"))
                    row += 1
            return "".join(" " * indent + line + "\n" for line in lines)

        real = calls(8, "float64", lambda text, slot: text, lambda row, r: f"out[i, {row}] = {r}")
        step = calls(
            12, "complex128", lambda text, slot: f"complex({text}, seed[{slot}])",
            lambda row, r: f"jac[i, {row}, column] = complex({r}).imag / STEP",
        )  # fmt: skip
        return _TEMPLATE.format(states=self.states, parameters=self.parameters, n=n, nv=nv, k=k, real=real, complex=step)

    def values(self, t: Array, u: Array, v: Array, p: Array) -> Array:
        """Values, shape (points, count), at ``t`` (points,), ``u`` (points, n), ``v`` likewise or (0, n), ``p``."""
        out = np.empty((len(u), self.count))
        self._evaluate(t, u, v, p, _NOTHING, out, _NO_JACOBIAN)
        return out

    def jacobian(self, t: Array, u: Array, v: Array, p: Array, free: Indices) -> tuple[Array, Array]:
        """Values and derivatives, shape (points, count, n [+ n] + len(free)): by u, by v, by the free parameters."""
        width = u.shape[1] * (2 if self.ends else 1) + free.size
        out, jac = np.empty((len(u), self.count)), np.empty((len(u), self.count, width))
        self._evaluate(t, u, v, p, free, out, jac)
        return out, jac


_NOTHING = np.empty(0, np.int64)
_NO_JACOBIAN = np.empty((0, 0, 0))


def _module(key: str, dispatchers: dict[str, Dispatcher], name: str, source: str) -> types.ModuleType:
    """The generated module of this key, loaded once (compiled machine code from the cache where it is there)."""
    path = cache_directory() / f"f{key[:32]}.py"
    known = sys.modules.get(f"contin_{path.stem}")
    if known is not None:
        return known
    if not path.exists() or path.read_text(encoding="utf-8") != source:
        path = write_source(path.name, source)
    spec: Any = importlib.util.spec_from_file_location(f"contin_{path.stem}", path)
    module = importlib.util.module_from_spec(spec)
    vars(module).update(dispatchers)
    sys.modules[spec.name] = module  # numba looks it up by name when it loads the compiled code
    try:
        spec.loader.exec_module(module)
    except BaseException as error:
        del sys.modules[spec.name]
        if isinstance(error, numba.core.errors.NumbaError):
            raise ProblemError(_explain(name, error)) from error
        raise
    return module


def _explain(name: str, error: Exception) -> str:
    lines = [line.strip() for line in str(error).splitlines() if line.strip()]
    reason = next((line for line in lines if line.startswith(("No implementation", "Untyped", "Unknown", "Invalid"))), None)
    return (
        f"function {name!r} cannot be compiled for real and complex numbers: {reason or lines[0]} "
        "(use arithmetic, comparisons, and functions of numbers from math or numpy)"
    )


def argument_count(function: Function) -> int:
    """Number of positional arguments of a user's function.

    Raises
    ------
    ProblemError
        It is no function, or one that does not say.
    """
    try:
        return len(inspect.signature(getattr(function, "py_func", function)).parameters)
    except (TypeError, ValueError):
        raise ProblemError(f"{_checks.shown(function)} must be a plain Python function (def or lambda)") from None
