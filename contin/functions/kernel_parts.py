"""Parts of kernels: the types of their arguments, and the functions that they call. See `contin.functions.kernel`."""

from __future__ import annotations

import functools
from collections.abc import Callable
from types import CodeType
from typing import Annotated, Any, Concatenate, NamedTuple, ParamSpec, TypeVar, overload

from contin.arrays import Array, Indices


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

    def __call__(self, *arguments: Any) -> Any:
        """Run the Python function."""
        return self.function(*arguments)


def names_in(code: CodeType) -> set[str]:
    """Return the global names that a code object, and those inside it, may use."""
    inner = (constant for constant in code.co_consts if isinstance(constant, CodeType))
    return set(code.co_names).union(*map(names_in, inner))


def length(function: Callable[..., Any]) -> int:
    """Return the bytes of a function's code and of the helpers that it calls, each counted once."""
    found: dict[Any, int] = {}

    def add(function: Any) -> None:
        if function in found:
            return
        found[function] = len(function.__code__.co_code)
        for name in names_in(function.__code__):
            value = function.__globals__.get(name)
            if isinstance(value, Helper):
                add(value.function)

    add(function)
    return sum(found.values())


class Instruction:
    """A function that kernels call, whose body `write` appends; see `instruction`."""

    def __init__(self, write: Callable[..., Any]) -> None:
        functools.update_wrapper(self, write)
        self.write = write

    def __call__(self, *arguments: Any) -> Any:
        """Raise TypeError: there is no Python function."""
        raise TypeError(f"{self.write.__name__} is an instruction, only kernels can call it")


@overload
def helper(function: _Function) -> _Function: ...


@overload
def helper(*, inline: bool = False) -> Callable[[_Function], _Function]: ...


def helper(function: Any = None, *, inline: bool = False) -> Any:
    """Let kernels call a function; with ``inline`` its statements are put in place of every call."""
    if function is None:
        return functools.partial(helper, inline=inline)
    return Helper(function, inline)


_Parameters = ParamSpec("_Parameters")
_Result = TypeVar("_Result")


def instruction(write: Callable[Concatenate[Any, _Parameters], _Result]) -> Callable[_Parameters, _Result]:
    """Let kernels call a function that writes its own machine code, in LLVM's language.

    ``write(builder, *arguments)`` appends the body of the function with an ``llvmlite.ir.IRBuilder`` and returns its value. Its
    annotations (``int``, ``float``, named tuples of them, ``None``) are the types that kernels see; the ``arguments`` are LLVM
    values, and named tuples of LLVM values. For example, a rounded sum of two numbers::

        @instruction
        def sum(builder: Any, x: float, y: float) -> float:
            return builder.fadd(x, y)

    The body is written once in each module of machine code, as a function that all calls in it share.
    """
    written: Any = Instruction(write)
    return written  # type: ignore[no-any-return]


def for_range(builder: Any, count: Any) -> Any:
    """In an instruction: ``with for_range(builder, count) as loop`` writes a loop, with ``loop.index``."""
    from numba.core import cgutils  # only the compiler calls instructions

    return cgutils.for_range(builder, count)


def variable(builder: Any, value: Any) -> Any:
    """In an instruction: return a place on the stack that holds a value."""
    from numba.core import cgutils

    place: Any = cgutils.alloca_once_value
    return place(builder, value)
