"""Parts of kernels: the types of their arguments, and the functions that they call. See `contin.kernels.kernel`."""

from __future__ import annotations

import functools
import sys
from collections.abc import Callable, Iterable, Mapping
from types import BuiltinFunctionType, CodeType, ModuleType
from typing import TYPE_CHECKING, Annotated, Any, Concatenate, NamedTuple, ParamSpec, TypeAlias, TypeVar, overload

from contin.arrays import Array, Indices

if TYPE_CHECKING:
    from llvmlite import ir

    Builder: TypeAlias = ir.IRBuilder
    Type: TypeAlias = ir.Type
    Value: TypeAlias = ir.Value
else:  # the annotations of instructions are evaluated, and only the compiler imports LLVM's language
    Builder = Type = Value = object


class Kind(NamedTuple):
    """Arrays as kernels see them: contiguous, of one kind of number, with so many dimensions."""

    number: str
    dimensions: int
    writable: bool = True


Vector = Annotated[Array, Kind("float64", 1)]
Matrix = Annotated[Array, Kind("float64", 2)]
Stack = Annotated[Array, Kind("float64", 3)]
IndexVector = Annotated[Indices, Kind("int64", 1)]
IndexMatrix = Annotated[Indices, Kind("int64", 2)]
ReadOnlyVector = Annotated[Array, Kind("float64", 1, writable=False)]
ReadOnlyMatrix = Annotated[Array, Kind("float64", 2, writable=False)]

_Function = TypeVar("_Function", bound=Callable[..., Any])


class Helper:
    """A function that kernels call; ``inline``: as in `helper`."""

    def __init__(self, function: Callable[..., Any], inline: bool) -> None:
        functools.update_wrapper(self, function)
        self.function, self.inline = function, inline

    def __call__(self, *arguments: object) -> Any:
        """Run the Python function."""
        return self.function(*arguments)


@functools.cache
def names_in(code: CodeType) -> frozenset[str]:
    """Return the names that a code object, and those inside it, may use: global ones and attributes."""
    inner = (constant for constant in code.co_consts if isinstance(constant, CodeType))
    return frozenset(code.co_names).union(*map(names_in, inner))


def parts(function: Callable[..., Any]) -> list[Any]:
    """Return what a kernel is made of besides its own code.

    These are helpers, instructions, named tuples, enumerations and numbers, and those that they use; and kernels, without what
    they use.
    """
    found: dict[tuple[int, str], Any] = {}

    def add(scope: Mapping[str, Any], names: Iterable[str]) -> None:
        for name in sorted(scope.keys() & set(names)):
            value = scope[name]
            if (id(scope), name) in found:
                continue
            if isinstance(value, ModuleType):
                found[id(scope), name] = None
                add(vars(value), names)
            elif isinstance(value, int | float):
                found[id(scope), name] = value
            elif isinstance(value, Helper | Instruction):
                found[id(scope), name] = value
                add(value.function.__globals__, _names(value.function))
            elif isinstance(value, type) and (hasattr(value, "_fields") or hasattr(value, "__members__")):
                found[id(scope), name] = value
                add(vars(sys.modules[value.__module__]), _hints(value))
            elif getattr(kernel_of(value), "function", function) is not function:
                found[id(scope), name] = kernel_of(value)

    add(function.__globals__, _names(function))
    return [value for value in found.values() if value is not None]


def _names(function: Any) -> set[str]:
    """Return the names in a function and in its annotations."""
    return {*names_in(function.__code__), *_hints(function)}


def _hints(item: object) -> list[str]:
    """Return the annotations of a function or a named tuple, as they are written."""
    return [str(getattr(hint, "__forward_arg__", hint)) for hint in getattr(item, "__annotations__", {}).values()]


def length(function: Callable[..., Any]) -> int:
    """Return the bytes of a function's code and of the helpers that it calls; kernels that it calls are compiled apart."""
    helpers = dict.fromkeys(part for part in parts(function) if isinstance(part, Helper))
    return sum(len(each.__code__.co_code) for each in (function, *(helper.function for helper in helpers)))


def kernel_of(value: Any) -> Any:
    """Return the `contin.kernels.kernel.Kernel` that a global value stands for; None where it is none."""
    return getattr(value.__self__, "kernel", None) if isinstance(value, BuiltinFunctionType) else None


class Instruction:
    """A function that kernels call, whose body ``function`` appends; see `instruction`."""

    def __init__(self, write: Callable[..., Any]) -> None:
        functools.update_wrapper(self, write)
        self.function = write

    def __call__(self, *arguments: object) -> Any:
        """Raise TypeError: there is no Python function."""
        raise TypeError(f"{self.function.__name__} is an instruction, only kernels can call it")


@overload
def helper(function: _Function) -> _Function: ...


@overload
def helper(*, inline: bool = False) -> Callable[[_Function], _Function]: ...


def helper(function: Any = None, *, inline: bool = False) -> Any:
    """Let kernels call a function; with ``inline`` its statements are put in place of every call."""
    return functools.partial(helper, inline=inline) if function is None else Helper(function, inline)


_Parameters = ParamSpec("_Parameters")
_Result = TypeVar("_Result")


def instruction(write: Callable[Concatenate[Builder, _Parameters], _Result]) -> Callable[_Parameters, _Result]:
    """Let kernels call a function that writes its own machine code, in LLVM's language.

    ``write(builder, *arguments)`` appends the body of the function with an ``llvmlite.ir.IRBuilder`` and returns its value. Its
    annotations (``int``, ``float``, named tuples of them, ``None``) are the types that kernels see; the ``arguments`` are LLVM
    values, and named tuples of LLVM values. An array of any kind, annotated as ``Any``, is
    a `Place`. For example, a rounded sum of two numbers::

        @instruction
        def sum(builder: Builder, x: float, y: float) -> float:
            return builder.fadd(x, y)

    The body is written once, as a function that all calls share.
    """
    written: Any = Instruction(write)
    return written


def llvm() -> Any:
    """Return LLVM's language, in which instructions are written; only the compiler needs it."""
    from llvmlite import ir

    return ir


def double() -> Type:
    """Return LLVM's type of floating-point numbers."""
    return llvm().DoubleType()


def whole(bits: int = 64) -> Type:
    """Return LLVM's type of whole numbers."""
    return llvm().IntType(bits)


def constant(kind: Type, value: object) -> Value:
    """Return a constant of LLVM's language."""
    return llvm().Constant(kind, value)


class Place:
    """An array of any kind, as an instruction sees it: the address of its first entry, and the bytes from one to the next."""

    def __init__(self, address: Value, *strides: Value) -> None:
        self.address, self.strides = address, strides


def for_range(builder: Builder, count: Value) -> Any:
    """In an instruction: ``with for_range(builder, count) as loop`` writes a loop, with ``loop.index``."""
    from numba.core import cgutils  # only the compiler calls instructions

    return cgutils.for_range(builder, count)


def variable(builder: Builder, value: Value) -> Value:
    """In an instruction: return a place on the stack that holds a value."""
    from numba.core import cgutils

    place: Any = cgutils.alloca_once_value
    return place(builder, value)
