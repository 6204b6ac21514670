"""What makes a user's function fit for the complex step: powers and comparisons that numba or Python define otherwise.

Integer powers become products (the polar form of a complex power loses the tiny imaginary part of a negative base), and
comparisons decide on real parts. Both are put in place by a compiler pass that applies to users' functions only.
"""

from __future__ import annotations

import operator
from typing import Any

from numba import types
from numba.core import ir
from numba.core.compiler import CompilerBase, DefaultPassBuilder
from numba.core.compiler_machinery import FunctionPass, register_pass
from numba.core.ir_utils import build_definitions
from numba.core.untyped_passes import IRProcessing
from numba.extending import overload

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
