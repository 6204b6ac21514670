"""What makes a user's function fit for the complex step: powers and comparisons that numba or Python define otherwise.

Integer powers become products (the polar form of a complex power loses the tiny imaginary part of a negative base), and
comparisons decide on real parts. Both are put in place by a compiler pass that applies to users' functions only.
"""

from __future__ import annotations

import operator

from numba import types
from numba.core import ir
from numba.core.compiler import CompilerBase, DefaultPassBuilder
from numba.core.compiler_machinery import FunctionPass, register_pass
from numba.core.ir_utils import build_definitions
from numba.core.untyped_passes import IRProcessing
from numba.extending import overload


def power(x, y):
    """x ** y."""
    return x**y


@overload(power, prefer_literal=True)
def _power(x, y):
    if isinstance(y, types.IntegerLiteral) and 0 <= y.literal_value <= 4:
        return (
            lambda x, y: 1.0 + 0.0 * x,
            lambda x, y: x,
            lambda x, y: x * x,
            lambda x, y: x * x * x,
            lambda x, y: (x * x) * (x * x),
        )[y.literal_value]
    if isinstance(y, types.Integer):

        def integer(x, y):
            result, factor, left = 1.0 + 0.0 * x, x, abs(y)
            while left:
                if left & 1:
                    result = result * factor
                factor = factor * factor
                left >>= 1
            return result if y >= 0 else 1.0 / result

        return integer
    if isinstance(x, types.Complex) and isinstance(y, (types.Float, types.Complex)):

        def whole_or_not(x, y):
            if y.imag != 0 or y.real != int(y.real):
                return x**y
            result, factor, left = 1.0 + 0.0 * x, x, abs(int(y.real))
            while left:
                if left & 1:
                    result = result * factor
                factor = factor * factor
                left >>= 1
            return result if y.real >= 0 else 1.0 / result

        return whole_or_not
    return lambda x, y: x**y


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


def _compare(function, compare):
    def choose(a, b):
        if all(isinstance(kind, types.Number) for kind in (a, b)):
            return function
        return lambda a, b: compare(a, b)

    overload(function)(choose)


_STAND_INS = {operator.pow: power, operator.ipow: power}
for _function, _plain in (
    (greater, operator.gt), (less, operator.lt), (greater_equal, operator.ge), (less_equal, operator.le),
):  # fmt: skip
    _compare(_function, _plain)
    _STAND_INS[_plain] = _function


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
                value = getattr(statement, "value", None)
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
