"""The gradient of a scalar function as plain Python, derived symbolically once and kept as text."""

from __future__ import annotations

import hashlib
import inspect
import math
import types
from collections.abc import Callable, Sequence
from typing import Any

from contin.functions.cache import cache_directory, write_source


def gradient(function: Callable[..., float], by: Sequence[str]) -> Callable[..., tuple[float, ...]]:
    """The function that returns (value, derivatives ``by`` these arguments), with the arguments of ``function``.

    ``function`` is written with arithmetic and functions of ``math``; sympy differentiates it, and common subexpressions
    are shared. The text is kept in the cache directory under a fingerprint of the function, so sympy is loaded only the
    first time.
    """
    arguments = list(inspect.signature(function).parameters)
    code = function.__code__
    what = repr((code.co_code, code.co_consts, code.co_names, code.co_varnames, arguments, list(by), 1))
    path = cache_directory() / f"g{hashlib.sha256(what.encode()).hexdigest()[:32]}.py"
    try:
        source = path.read_text(encoding="utf-8")
    except OSError:
        source = _derive(function, arguments, by)
        write_source(path.name, source)
    scope: dict[str, Any] = {"math": math, "__name__": function.__module__}
    exec(compile(source, f"<gradient of {function.__qualname__}>", "exec"), scope)
    derived: Callable[..., tuple[float, ...]] = scope["derived"]
    return derived


def _derive(function: Callable[..., Any], arguments: Sequence[str], by: Sequence[str]) -> str:
    import sympy

    scope = {**function.__globals__, "math": sympy, **{n: getattr(sympy, n) for n in ("sqrt", "exp", "log", "sin", "cos")}}
    symbols = {name: sympy.Symbol(name, real=True) for name in arguments}
    value = types.FunctionType(function.__code__, scope)(**symbols)
    expressions = [value, *(sympy.diff(value, symbols[name]) for name in by)]
    shared, reduced = sympy.cse(expressions, optimizations="basic")
    lines = [f"    {name} = {sympy.pycode(term)}" for name, term in shared]
    result = ", ".join(sympy.pycode(term) for term in reduced)
    return "\n".join([f"def derived({', '.join(arguments)}):", *lines, f"    return {result}", ""])
