"""The gradient of a scalar function as plain Python, derived symbolically once and kept as text."""

from __future__ import annotations

import importlib.metadata
import inspect
import math
import types
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from contin.errors import ProblemError
from contin.functions.cache import run_kept_source
from contin.functions.fingerprint import contents
from contin.functions.rewriting import Rewriter

#: Names in ``math`` and numpy of what sympy has under another name; all others are the same in sympy.
_OTHER_NAMES = {
    "fabs": "Abs", "absolute": "Abs", "pow": "Pow", "e": "E", "inf": "oo", "arcsin": "asin", "arccos": "acos",
    "arctan": "atan", "arctan2": "atan2", "arcsinh": "asinh", "arccosh": "acosh", "arctanh": "atanh",
}  # fmt: skip


class Fingerprinted(Rewriter):
    """Functions left as they are: what counts is the fingerprint."""

    def stand_in(self, value: Any) -> Any:
        """Return functions of ``math`` and numpy themselves: they are the same in every process."""
        return value if _sympy_name(value) else None


class Symbolic(Rewriter):
    """Functions for a call with symbols: with sympy's functions in place of those of ``math`` and numpy."""

    def stand_in(self, value: Any) -> Any:
        """Return sympy's function of this name."""
        import sympy  # takes .3 s, and is needed the first time only

        name = _sympy_name(value)
        formulas = {
            "hypot": lambda *x: sympy.sqrt(sum(a**2 for a in x)), "square": lambda x: x**2, "expm1": lambda x: sympy.exp(x) - 1,
            "log1p": lambda x: sympy.log(1 + x), "log2": lambda x: sympy.log(x, 2), "log10": lambda x: sympy.log(x, 10),
        }  # fmt: skip
        if name and name not in formulas and not hasattr(sympy, name):
            raise ProblemError(f"{name} cannot be differentiated; write it with arithmetic, exp, log, sqrt, sin, cos, ...")
        return formulas.get(name) or (getattr(sympy, name) if name else None)

    def _attribute(self, module: types.ModuleType, value: Any, attributes: set[str]) -> object:
        import sympy

        constants = {math.pi: sympy.pi, math.e: sympy.E}
        if module.__name__ in ("math", "numpy") and isinstance(value, float) and value in constants:
            return constants[value]
        return super()._attribute(module, value, attributes)


def _sympy_name(value: Any) -> str:
    """Return the name in sympy of a function of ``math`` or numpy, nothing for all other values."""
    of_math = isinstance(value, types.BuiltinFunctionType) and value.__module__ == "math"
    if not of_math and not isinstance(value, np.ufunc):
        return ""
    name: str = value.__name__
    return _OTHER_NAMES.get(name, name)


def gradient(function: Callable[..., float], by: Sequence[str]) -> Callable[..., tuple[float, ...]]:
    """Return the function of (value, derivatives by some arguments), with the arguments of ``function``.

    Sympy differentiates it, and common subexpressions are shared. The text of the result is kept in the cache directory under a
    fingerprint of everything that the function reads, so sympy is loaded only the first time.

    Parameters
    ----------
    function : callable
        A plain Python function of numbers, written with arithmetic and functions of ``math``; it may call others that are.
    by : sequence of str
        The arguments to differentiate by.

    Raises
    ------
    ProblemError
        It is no plain Python function.

    Examples
    --------
    >>> gradient(lambda x, y: x**2 * y, ["x", "y"])(3.0, 2.0)
    (18.0, 12.0, 9.0)
    """
    arguments = list(inspect.signature(function).parameters)
    rewriter = Fingerprinted()
    rewriter.function(function)
    rewriter.note(arguments, list(by), importlib.metadata.version("sympy"), contents(Path(__file__)))
    scope: dict[str, Any] = {"math": math, "__name__": function.__module__}
    run_kept_source(f"g{rewriter.fingerprint()[:32]}.py", lambda: _derived(function, arguments, by), scope)
    result: Callable[..., tuple[float, ...]] = scope["derived"]
    return result


def _derived(function: Callable[..., Any], arguments: Sequence[str], by: Sequence[str]) -> str:
    """Return the text of the function ``derived``."""
    import sympy  # takes .3 s, and is needed the first time only

    symbols = {name: sympy.Symbol(name, real=True) for name in arguments}
    value = Symbolic().function(function)(**symbols)
    expressions = [value, *(sympy.diff(value, symbols[name]) for name in by)]
    shared, reduced = sympy.cse(expressions, optimizations="basic")
    lines = [f"    {name} = {sympy.pycode(term)}" for name, term in shared]
    result = ", ".join(sympy.pycode(term) for term in reduced)
    return "\n".join([f"def derived({', '.join(arguments)}):", *lines, f"    return {result}", ""])
