"""Functions made fit for the complex step: with h tiny, the imaginary part of f(x + i h) / h is f'(x) to round-off.

Python and numpy define some operations for complex numbers in a way that spoils this. They are replaced, in users' functions
only, by ones that are analytic in the real part's branch:

- comparisons, ``abs``, ``sign``, ``max`` and ``min`` decide on real parts;
- integer powers become products (the polar form of a complex power loses the tiny imaginary part of a negative base);
- ``atan2`` is turned by its real angle;
- ``floor``, ``ceil`` and ``trunc`` are of the real part, and so is the quotient in ``%`` and ``//``;
- ``erf``, ``erfc``, ``gamma`` and ``lgamma`` are the value at the real part and the exact first derivative;
- functions of ``math``, which exist for real numbers only, become those of numpy;
- arrays that a function makes and fills (``np.zeros``, ``np.empty_like``, ...) hold complex numbers.

Functions are replaced where a `Rewriter` meets them (`ComplexStep`), operators by a pass of the compiler
(`contin.functions.analytic`).
"""

from __future__ import annotations

import math
import types
from typing import Any

import numpy as np

from contin.arrays import Function
from contin.errors import CompilationError
from contin.functions.rewriting import Rewriter


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


def _analytic_hypot(a: Any, b: Any) -> Any:
    return np.sqrt(a * a + b * b)


def _analytic_floor(z: Any) -> Any:
    return np.floor(z.real)


def _analytic_ceil(z: Any) -> Any:
    return np.ceil(z.real)


def _analytic_trunc(z: Any) -> Any:
    return np.trunc(z.real)


def _analytic_erf(z: Any) -> Any:
    return math.erf(z.real) + (z - z.real) * _OF_ERF * math.exp(-z.real * z.real)


def _analytic_erfc(z: Any) -> Any:
    return math.erfc(z.real) - (z - z.real) * _OF_ERF * math.exp(-z.real * z.real)


def _analytic_gamma(z: Any) -> Any:
    return math.gamma(z.real) * (1.0 + (z - z.real) * _digamma(z.real))


def _analytic_lgamma(z: Any) -> Any:
    return math.lgamma(z.real) + (z - z.real) * _digamma(z.real)


#: Slope of the error function at 0.
_OF_ERF = 2 / math.sqrt(math.pi)


def _digamma(x: Any) -> Any:
    """Return the derivative of log gamma: reflected, raised to 10 by recurrence, then the asymptotic series (DLMF 5.11.2)."""
    reflected, total = x < 0.5, 0.0
    if reflected:
        total, x = -math.pi / math.tan(math.pi * x), 1 - x
    while x < 10:
        total -= 1 / x
        x += 1
    y = 1 / (x * x)
    series = y * (1 / 12 - y * (1 / 120 - y * (1 / 252 - y * (1 / 240 - y * (1 / 132 - y * (691 / 32760 - y / 12))))))
    return total + math.log(x) - 0.5 / x - series


#: Functions that are not analytic, and what replaces them.
REPLACED: dict[Any, Function] = {
    abs: _analytic_abs, math.fabs: _analytic_abs, np.absolute: _analytic_abs, np.fabs: _analytic_abs, np.sign: _analytic_sign,
    max: _analytic_max, np.maximum: _analytic_max, np.fmax: _analytic_max,
    min: _analytic_min, np.minimum: _analytic_min, np.fmin: _analytic_min,
    math.atan2: _analytic_atan2, np.arctan2: _analytic_atan2, math.hypot: _analytic_hypot, np.hypot: _analytic_hypot,
    math.floor: _analytic_floor, np.floor: _analytic_floor, math.ceil: _analytic_ceil, np.ceil: _analytic_ceil,
    math.trunc: _analytic_trunc, np.trunc: _analytic_trunc, math.erf: _analytic_erf, math.erfc: _analytic_erfc,
    math.gamma: _analytic_gamma, math.lgamma: _analytic_lgamma,
}  # fmt: skip
#: Functions of ``math`` that numpy has under the same name, ...
_SAME_NAMES = ("sqrt", "exp", "expm1", "log", "log1p", "log10", "sin", "cos", "tan", "sinh", "cosh", "tanh")
#: ... and under another one.
_OTHER_NAMES = {
    "asin": np.arcsin, "acos": np.arccos, "atan": np.arctan, "asinh": np.arcsinh, "acosh": np.arccosh,
    "atanh": np.arctanh, "pow": np.power,
}  # fmt: skip
_OF_NUMPY: dict[Any, Function] = {getattr(math, name): getattr(np, name) for name in _SAME_NAMES}
_OF_NUMPY |= {getattr(math, name): function for name, function in _OTHER_NAMES.items()}


#: Why a function with complex numbers is not compiled.
_OWN_COMPLEX = "it computes with complex numbers, which compiled code needs for derivatives"
#: Functions that make an array of a shape, and of the shape of another one; ``full`` has a value, too.
MAKERS: tuple[Any, ...] = (np.zeros, np.empty, np.ones, np.full)
MAKERS_LIKE: tuple[Any, ...] = (np.zeros_like, np.empty_like, np.ones_like, np.full_like)


def makers(kind: type) -> dict[Any, Function]:
    """Return functions that take the place of `MAKERS` and `MAKERS_LIKE`: arrays of real numbers become those of a kind."""

    def replaced(maker: Any) -> Function:
        def make(*given: Any, **options: Any) -> Any:
            made = maker(*given, **options)
            return made.astype(kind) if made.dtype.kind == "f" or maker in MAKERS_LIKE else made

        return make

    return {maker: replaced(maker) for maker in MAKERS + MAKERS_LIKE}


class RealFunctions(Rewriter):
    """Rewrite functions of real numbers.

    A function that computes with complex numbers of its own is refused: their real parts, conjugates and absolute values are
    not analytic, and values, derivatives and sparsity pattern would be wrong.
    """

    def _names(self, code: types.CodeType) -> tuple[set[str], set[str]]:
        attributes, loaded = super()._names(code)
        if "complex" in loaded or any(isinstance(constant, complex) for constant in code.co_consts):
            raise CompilationError(_OWN_COMPLEX)
        return attributes, loaded

    def _value(self, value: Any, attributes: set[str]) -> object:
        if isinstance(value, (complex, np.complexfloating)) or (isinstance(value, np.ndarray) and value.dtype.kind == "c"):
            raise CompilationError(_OWN_COMPLEX)
        return super()._value(value, attributes)


class ComplexStep(RealFunctions):
    """Rewrite functions for the complex step."""

    def stand_in(self, value: Any) -> Any:
        """Return the function that takes the place of one that is not analytic; None for all other values."""
        return analytic(value)


def analytic(value: Any) -> Function | None:
    """Return what stands for a function that is not analytic, or exists for real numbers only; None for all others."""
    return stand_in_of(value, _OF_NUMPY) or stand_in_of(value, REPLACED)


def stand_in_of(value: Any, stand_ins: dict[Any, Function]) -> Function | None:
    """Return what stands for a function; None for all other values."""
    try:
        return stand_ins.get(value)
    except TypeError:  # unhashable: an array or a list, never a function
        return None
