"""Users' functions compiled: operators that are not analytic are replaced by a pass of the compiler.

See `contin.functions.complex_step`, which says what is replaced and why.
"""

from __future__ import annotations

import operator
import types as python_types
from collections.abc import Sequence
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
from contin.errors import CompilationError
from contin.functions.array_makers import ARRAYS, COMPLEX, REAL
from contin.functions.complex_step import REPLACED, ComplexStep, stand_in_of
from contin.functions.kernel import Kernel
from contin.functions.pointwise import parts, searches
from contin.functions.signature import argument_count

#: Starts of messages of numba that say what is wrong with a user's function; the lines before them are about numba itself.
_REASONS = ("No implementation", "Untyped", "Unknown", "Invalid")


class _Compiled(ComplexStep):
    """Rewrite functions for numbers of one kind, real or for the complex step, and let numba compile them."""

    def __init__(self, kind: str) -> None:
        super().__init__()
        self.flavour = kind

    def finished(self, copy: python_types.FunctionType) -> Any:
        """Return the function as compiled code calls it, with operators replaced."""
        inside: Any = {"no_cpython_wrapper": True, "no_cfunc_wrapper": True}  # only compiled code calls it
        return numba.njit(copy, error_model="numpy", pipeline_class=AnalyticCompiler, **inside)

    def finished_method(self, copy: python_types.FunctionType, owner: python_types.ModuleType) -> Any:
        """Return a function that calls the method with a number in place of its object, which the compiler replaces."""
        copy.__dict__["contin_owner"] = owner
        names = [f"a{i}" for i in range(argument_count(copy) - 1)]
        method = f"def {copy.__name__}_of({', '.join(names)}):\n    return method({', '.join(['0', *names])})"
        scope: dict[str, Any] = {"method": self.finished(copy), "__name__": __name__}
        exec(method, scope)
        return self.finished(scope[copy.__name__ + "_of"])

    def finished_dictionary(self, copy: dict[str, Any]) -> Any:
        """Return a module with the entries: the compiler replaces ``values["a"]`` by ``values.a``."""
        module = python_types.ModuleType("dictionary")
        module.__dict__.update(copy)
        return module

    def stand_in(self, value: Any) -> Any:
        """Return the stand-in as compiled code calls it."""
        arrays = stand_in_of(value, ARRAYS[self.flavour])
        if arrays is not None:
            return arrays
        found = super().stand_in(value)
        return numba.njit(_with_helpers(found)) if found in REPLACED.values() else found


def _with_helpers(function: Function) -> Function:
    """Return a copy of a stand-in that calls compiled code in place of its helpers."""
    plain: Any = function
    helpers = {name: plain.__globals__.get(name) for name in plain.__code__.co_names}
    compiled = {name: numba.njit(helper) for name, helper in helpers.items() if isinstance(helper, python_types.FunctionType)}
    return python_types.FunctionType(plain.__code__, plain.__globals__ | compiled, plain.__name__)


def compile_batch(kernel: Kernel, functions: Sequence[Function]) -> Any:
    """Return the compiled kernel, which calls users' functions as function0, function1, ...

    Raises
    ------
    CompilationError
        The message says which function cannot be compiled, and why.
    """
    try:
        for name, kind in (("function", REAL), ("step", COMPLEX)):
            rewriter = _Compiled(kind)
            compiled = {f"{name}{i}": rewriter.function(parts(function)[0]) for i, function in enumerate(functions)}
            if kind == REAL:
                compiled |= {f"solve{k}": rewriter.function(solve) for k, solve in enumerate(searches(functions))}
            kernel.function.__globals__.update(compiled)
        return kernel.compiled
    except Exception as error:  # besides its own exceptions, numba lets others through where it meets what it does not expect
        names = " and ".join(function.__name__ for function in functions)
        raise CompilationError(_explanation(names, error)) from error


def _explanation(name: str, error: Exception) -> str:
    lines = [line.strip() for line in str(error).splitlines() if line.strip()]
    reason = next((line for line in lines if line.startswith(_REASONS)), None)
    reason = reason or (lines[0] if lines else "numba fails (a list of whole and other numbers? write 0.0, not 0)")
    return (
        f"function {name!r} cannot be compiled for real and complex numbers ({reason}); arithmetic, comparisons, and functions "
        "of numbers from math or numpy can"
    )


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


def remainder(a, b):
    """a % b, with the quotient of the real parts."""
    return a - b * np.floor(a.real / b.real)


def quotient(a, b):
    """a // b of the real parts."""
    return np.floor(a.real / b.real)


def _plain_remainder(a, b):
    return a % b


def _plain_quotient(a, b):
    return a // b


def _divide(function, plain):
    def choose(a, b):
        return function if isinstance(a, types.Complex) or isinstance(b, types.Complex) else plain

    overload(function)(choose)
    return function


#: Operators whose meaning for complex numbers spoils the complex step, and the functions called in their place.
_STAND_INS = {
    operator.pow: power,
    operator.ipow: power,
    operator.mod: _divide(remainder, _plain_remainder),
    operator.imod: remainder,
    operator.floordiv: _divide(quotient, _plain_quotient),
    operator.ifloordiv: quotient,
    operator.gt: _compare(greater, _plain_greater),
    operator.lt: _compare(less, _plain_less),
    operator.ge: _compare(greater_equal, _plain_greater_equal),
    operator.le: _compare(less_equal, _plain_less_equal),
}


@register_pass(mutates_CFG=False, analysis_only=False)
class _UsePlainForms(FunctionPass):
    """Replace what numba does not know by what it knows.

    ========================================  ==========================================
    ``values["a"]``                           ``values.a``
    ``np.concatenate([u, v])`` and alike      ``np.concatenate((u, v))``
    the first argument of a method            a module with the attributes of its object
    ========================================  ==========================================
    """

    _name = "contin_use_plain_forms"

    def __init__(self):
        FunctionPass.__init__(self)

    def run_pass(self, state):
        code, owner, changed = state.func_ir, getattr(state.func_id.func, "contin_owner", None), False
        lists = _joined_lists(code)
        for block in code.blocks.values():
            for statement in block.body:
                value: Any = getattr(statement, "value", None)
                if not isinstance(statement, ir.Assign):
                    continue
                if owner is not None and isinstance(value, ir.Arg) and value.index == 0:
                    statement.value = ir.Global("owner", owner, value.loc)
                elif isinstance(value, ir.Expr) and value.op == "getitem" and _defined(code, value.index, ir.Const, str):
                    name = code.get_definition(value.index).value
                    statement.value = ir.Expr.getattr(value.value, name, value.loc)
                elif statement.target.name in lists:
                    statement.value = ir.Expr.build_tuple(value.items, value.loc)
                else:
                    continue
                changed = True
        if changed:
            code._definitions = build_definitions(code.blocks)
        return changed


def _defined(code, variable, kind, of):
    """Return whether a variable has one definition, of this kind and with a value of this type."""
    try:
        found = code.get_definition(variable)
    except KeyError:
        return False
    return isinstance(found, kind) and isinstance(getattr(found, "value", None), of)


def _joined_lists(code):
    """Return the names of lists that are written as the first argument of a function that joins arrays."""
    found = set()
    for block in code.blocks.values():
        for statement in block.body:
            call: Any = getattr(statement, "value", None)
            if not (isinstance(call, ir.Expr) and call.op == "call" and call.args):
                continue
            try:
                function, first = code.get_definition(call.func), code.get_definition(call.args[0])
            except KeyError:
                continue
            joins = isinstance(function, ir.Expr) and function.op == "getattr" and function.attr in _JOINING
            if joins and isinstance(first, ir.Expr) and first.op == "build_list":
                found.add(call.args[0].name)
    return found


#: Functions of numpy that join arrays.
_JOINING = ("concatenate", "stack", "hstack", "vstack", "column_stack")


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
        manager.add_pass_after(_UsePlainForms, IRProcessing)
        manager.finalize()
        return [manager]
