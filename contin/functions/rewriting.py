"""Users' functions made ready for a compiler, or for anything else: what they refer to made ready too, all fingerprinted.

Functions that the complex step cannot differentiate as numpy defines them are replaced on the way.
"""

from __future__ import annotations

import builtins
import dis
import hashlib
import math
import types
from typing import Any

import numba
import numpy as np
from numba.core.dispatcher import Dispatcher

from contin import checks
from contin.arrays import Function
from contin.errors import ProblemError
from contin.functions.complex_step import AnalyticCompiler


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


class Prepared:
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
            raise ProblemError(f"{checks.shown(function)} must be a plain Python function (def or lambda)")
        if function in self._open:
            raise ProblemError(f"function {function.__name__!r} calls itself; write a loop instead")
        if function not in self._done:
            self._open.add(function)
            self._hashes.append(hashlib.sha256())
            copy = self._copy(function)
            digest = self._hashes.pop().hexdigest()
            copy.__name__ = copy.__qualname__ = f"user_{digest[:32]}"
            self._done[function] = self._made(copy), digest
            self._open.discard(function)
        kept, digest = self._done[function]
        self.note(digest)
        return kept

    def _made(self, copy: types.FunctionType) -> Any:
        """What a function becomes: a compiled one."""
        return numba.njit(copy, error_model="numpy", pipeline_class=AnalyticCompiler)

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
