"""Functions made fit for the complex step: with h tiny, the imaginary part of f(x + i h) / h is f'(x) to round-off.

Python and numpy define some operations for complex numbers in a way that spoils this. They are replaced, in users' functions
only, by ones that are analytic in the real part's branch:

- comparisons, ``abs``, ``sign``, ``max`` and ``min`` decide on real parts;
- integer powers become products (the polar form of a complex power loses the tiny imaginary part of a negative base);
- ``atan2`` is turned by its real angle;
- functions of ``math``, which exist for real numbers only, become those of numpy.

Functions are replaced where a `Rewriter` meets them (`ComplexStep`), operators by a pass of the compiler.
"""

from __future__ import annotations

import math
import operator
import types as python_types
from typing import Any

import numba
import numpy as np
from numba import types
from numba.core import ir
from numba.core.compiler import CompilerBase, DefaultPassBuilder
from numba.core.compiler_machinery import FunctionPass, register_pass
from numba.core.ir_utils import build_definitions
from numba.core.untyped_passes import IRProcessing
from numba.extending import overload

from contin.arrays import Function
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


#: Functions that are not analytic, and what replaces them.
_REPLACED: dict[Any, Function] = {
    abs: _analytic_abs, math.fabs: _analytic_abs, np.absolute: _analytic_abs, np.fabs: _analytic_abs, np.sign: _analytic_sign,
    max: _analytic_max, np.maximum: _analytic_max, np.fmax: _analytic_max,
    min: _analytic_min, np.minimum: _analytic_min, np.fmin: _analytic_min,
    math.atan2: _analytic_atan2, np.arctan2: _analytic_atan2,
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


class ComplexStep(Rewriter):
    """Rewrite functions for the complex step, and let numba compile them."""

    def finished(self, copy: python_types.FunctionType) -> Any:
        """Return the function compiled, with operators replaced."""
        return numba.njit(copy, error_model="numpy", pipeline_class=AnalyticCompiler)

    def stand_in(self, value: Any) -> Any:
        """Return the analytic function for one that is not; None for all other values."""
        return analytic(value)


def analytic(value: Any) -> Any:
    """Return what stands for a function that is not analytic, or exists for real numbers only; None for all others."""
    try:
        if value in _OF_NUMPY:
            return _OF_NUMPY[value]
        if value in _REPLACED:
            return numba.njit(_REPLACED[value])
    except TypeError:  # unhashable: an array or a list, never one of these functions
        pass
    return None


# Every implementation has a name of its own: numba tells compiled functions apart by name and types, and machine code of
# several cached modules shares one space of names.


def power(x, y):
    """x ** y."""
    return x**y


def _one(x, y):
    return 1.0 + 0.0 * x


def _itself(x, y):
    return x


def _square(x, y):
    return x * x


def _cube(x, y):
    return x * x * x


def _fourth(x, y):
    return (x * x) * (x * x)


def _by_products(x, y):
    result, factor, left = 1.0 + 0.0 * x, x, abs(y)
    while left:
        if left & 1:
            result = result * factor
        factor = factor * factor
        left >>= 1
    return result if y >= 0 else 1.0 / result


def _by_products_if_whole(x, y):
    if y.imag != 0 or y.real != int(y.real):
        return x**y
    result, factor, left = 1.0 + 0.0 * x, x, abs(int(y.real))
    while left:
        if left & 1:
            result = result * factor
        factor = factor * factor
        left >>= 1
    return result if y.real >= 0 else 1.0 / result


def _plain_power(x, y):
    return x**y


@overload(power, prefer_literal=True)
def _choose_power(x, y):
    if isinstance(y, types.IntegerLiteral) and 0 <= y.literal_value <= 4:
        return (_one, _itself, _square, _cube, _fourth)[y.literal_value]
    if isinstance(y, types.Integer):
        return _by_products
    if isinstance(x, types.Complex) and isinstance(y, (types.Float, types.Complex)):
        return _by_products_if_whole
    return _plain_power


def greater(a, b):
    """a > b of the real parts."""
    return a.real > b.real


def less(a, b):
    """a < b of the real parts."""
    return a.real < b.real


def greater_equal(a, b):
    """a >= b of the real parts."""
    return a.real >= b.real


def less_equal(a, b):
    """a <= b of the real parts."""
    return a.real <= b.real


def _plain_greater(a, b):
    return a > b


def _plain_less(a, b):
    return a < b


def _plain_greater_equal(a, b):
    return a >= b


def _plain_less_equal(a, b):
    return a <= b


def _compare(function, plain):
    def choose(a, b):
        return function if isinstance(a, types.Number) and isinstance(b, types.Number) else plain

    overload(function)(choose)
    return function


#: Operators whose meaning for complex numbers spoils the complex step, and the functions called in their place.
_STAND_INS = {
    operator.pow: power,
    operator.ipow: power,
    operator.gt: _compare(greater, _plain_greater),
    operator.lt: _compare(less, _plain_less),
    operator.ge: _compare(greater_equal, _plain_greater_equal),
    operator.le: _compare(less_equal, _plain_less_equal),
}


@register_pass(mutates_CFG=False, analysis_only=False)
class _UseStandIns(FunctionPass):
    """Replace binary operators by calls of their stand-ins."""

    _name = "contin_use_stand_ins"

    def __init__(self):
        FunctionPass.__init__(self)

    def run_pass(self, state):
        blocks, changed = state.func_ir.blocks, False
        for block in blocks.values():
            body = []
            for statement in block.body:
                value: Any = getattr(statement, "value", None)
                binary = isinstance(statement, ir.Assign) and isinstance(value, ir.Expr)
                if binary and value.op in ("binop", "inplace_binop") and value.fn in _STAND_INS:
                    function = block.scope.redefine("$stand_in", value.loc)
                    body.append(ir.Assign(ir.Global("stand_in", _STAND_INS[value.fn], value.loc), function, value.loc))
                    call = ir.Expr.call(function, (value.lhs, value.rhs), (), value.loc)
                    statement = ir.Assign(call, statement.target, statement.loc)
                    changed = True
                body.append(statement)
            block.body = body
        if changed:
            state.func_ir._definitions = build_definitions(blocks)
        return changed


class AnalyticCompiler(CompilerBase):
    """Numba's pipeline with the stand-ins put in."""

    def define_pipelines(self):
        manager = DefaultPassBuilder.define_nopython_pipeline(self.state)
        manager.add_pass_after(_UseStandIns, IRProcessing)
        manager.finalize()
        return [manager]
