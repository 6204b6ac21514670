"""The gate to the compiler: kernels of the engine, compiled by numba and kept on disk.

Nothing outside contin/functions imports numba. A kernel is a Python function whose annotations are its signature:

    @kernel
    def scale(factor: float, x: Vector) -> None:
        for i in range(x.size):
            x[i] *= factor

It is compiled where it is defined, or read from the cache. A `helper` is compiled when the first kernel that calls it is. An
`instruction` is a function for kernels to call that is written in LLVM's language.
The cache can only help: a file that cannot be read, written or trusted costs time, never an answer.
"""

from __future__ import annotations

import contextlib
import functools
import itertools
import os
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Annotated, Any, Concatenate, ParamSpec, TypeVar, get_args, get_origin, get_type_hints, overload

import numba
from llvmlite import ir
from numba.core import cgutils, sigutils
from numba.core.caching import FunctionCache, IndexDataCacheFile

from contin.arrays import Array, Indices
from contin.errors import ContinError
from contin.functions.cache import cache_directory
from contin.functions.fingerprint import contents

# Arrays as kernels see them: contiguous, of one kind of number, with so many dimensions.
Vector = Annotated[Array, "f8[::1]"]
Matrix = Annotated[Array, "f8[:,::1]"]
Stack = Annotated[Array, "f8[:,:,::1]"]
IndexVector = Annotated[Indices, "i8[::1]"]
IndexMatrix = Annotated[Indices, "i8[:,::1]"]
ReadOnlyVector = Annotated[Array, "Array(f8, 1, 'C', readonly=True)"]
ReadOnlyMatrix = Annotated[Array, "Array(f8, 2, 'C', readonly=True)"]

#: Options of all kernels: division by zero gives inf; sums in any order, so that loops become vector instructions.
_OPTIONS: dict[str, Any] = {"error_model": "numpy", "nogil": True, "fastmath": {"contract", "reassoc"}}

_Function = TypeVar("_Function", bound=Callable[..., Any])


@overload
def kernel(function: _Function) -> _Function: ...


@overload
def kernel(*, reorder: bool = True) -> Callable[[_Function], _Function]: ...


def kernel(function: Any = None, *, reorder: bool = True) -> Any:
    """Compile a function for the types in its annotations.

    These are ``int``, ``float``, ``None``, the arrays above, and named tuples of them. Without ``reorder`` sums and products
    are evaluated one by one as they stand.

    Raises
    ------
    TypeError
        An annotation of another kind.
    """
    if function is None:
        return functools.partial(kernel, reorder=reorder)
    hints = get_type_hints(function, include_extras=True)
    result = _compiler_type(hints.pop("return"))
    options = _OPTIONS if reorder else {**_OPTIONS, "fastmath": False}
    return njit(result(*map(_compiler_type, hints.values())), cache=True, **options)(function)


@overload
def helper(function: _Function) -> _Function: ...


@overload
def helper(*, inline: bool = False) -> Callable[[_Function], _Function]: ...


def helper(function: Any = None, *, inline: bool = False) -> Any:
    """Let kernels call a function; with ``inline`` its statements are put in place of every call."""
    if function is None:
        return functools.partial(helper, inline=inline)
    return njit(cache=True, inline="always" if inline else "never", **_OPTIONS)(function)


_Parameters = ParamSpec("_Parameters")
_Result = TypeVar("_Result")

# For the bodies of instructions: a loop, ``with for_range(builder, count) as loop``, and a place on the stack.
for_range = cgutils.for_range
variable = cgutils.alloca_once_value


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
    hints = get_type_hints(write)
    hints.pop("builder", None)
    result, parameters = _compiler_type(hints.pop("return")), list(hints.values())
    signature, nothing = result(*map(_compiler_type, parameters)), result is numba.types.void
    body: Any = write

    def call(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        values: list[Any] = []
        for argument, parameter in zip(arguments, parameters):
            values += cgutils.unpack_tuple(builder, argument) if hasattr(parameter, "_fields") else [argument]
        value = builder.call(_function(context, builder.module, values), values)
        return context.get_dummy_value() if nothing else value

    def _function(context: Any, module: Any, values: list[Any]) -> Any:
        options = sorted(getattr(context.fastmath, "flags", ()))  # numba gives them to all sums and products of the module
        name = ".".join([write.__module__, write.__qualname__, *options])
        if name in module.globals:
            return module.globals[name]
        returned = ir.VoidType() if nothing else context.get_value_type(result)
        function = ir.Function(module, ir.FunctionType(returned, [value.type for value in values]), name)
        function.linkage = "linkonce_odr"  # one copy where modules are linked
        builder, given = ir.IRBuilder(function.append_basic_block()), iter(function.args)
        arguments = [
            kind(*itertools.islice(given, len(kind._fields))) if hasattr(kind, "_fields") else next(given)
            for kind in parameters
        ]
        value = body(builder, *arguments)
        builder.ret_void() if nothing else builder.ret(value)
        return function

    def typed(context: Any, *types: Any) -> Any:
        return signature, call

    intrinsic: Any = numba.extending.intrinsic
    compiled: Callable[_Parameters, _Result] = intrinsic(functools.wraps(write)(typed))
    return compiled


def _compiler_type(hint: Any) -> Any:
    """Return numba's type for an annotation."""
    if get_origin(hint) is Annotated:
        return eval(get_args(hint)[1], dict(vars(numba.types)))
    if isinstance(hint, type) and hasattr(hint, "_fields"):
        fields = get_type_hints(hint, include_extras=True)
        return numba.types.BaseTuple.from_types([_compiler_type(field) for field in fields.values()], hint)
    try:
        return {int: numba.types.int64, float: numba.types.float64, type(None): numba.types.void}[hint]
    except (KeyError, TypeError):
        raise TypeError(f"{hint!r} is no type of a kernel's argument") from None


@overload
def njit(signature: _Function, **options: Any) -> _Function: ...


@overload
def njit(signature: Any = None, *, cache: bool = False, **options: Any) -> Callable[[_Function], _Function]: ...


def njit(signature: Any = None, *, cache: bool = False, **options: Any) -> Any:
    """``numba.njit`` with the cache on disk described above where ``cache`` is asked for."""
    if callable(signature) and not isinstance(signature, numba.core.typing.templates.Signature):
        return numba.njit(signature, **options)

    def compiled(function: Callable[..., Any]) -> Any:
        dispatcher = numba.njit(function, **options)
        if cache:
            try:
                dispatcher._cache = _DiskCache(function)
            except RuntimeError as error:  # numba found no folder that it may write to
                _warn_not_kept("any folder", str(error).splitlines()[0])
        if signature is not None:
            dispatcher.compile(signature)
            dispatcher.disable_compile()
        return dispatcher

    return compiled


class _DiskCache(FunctionCache):
    """Machine code of one function on disk.

    Numba's own cache raises where a power cut left half a file or a quota is used up. Processes that compile at the same
    time may take the same name for the code of two signatures (its index has no lock), so the signature of loaded code is
    checked. And numba looks at the modification time of the function's own file only, while a kernel also consists of the
    functions that it calls: here the contents of all files that kernels are made of count.
    """

    def __init__(self, function: Callable[..., Any]) -> None:
        super().__init__(function)
        stamp = contents(Path(function.__code__.co_filename)), _engine()
        self._cache_file = IndexDataCacheFile(self._cache_path, self._impl.filename_base, stamp)

    def load_overload(self, sig: Any, target_context: Any) -> Any:
        """Return the compiled function, or None where there is none that can be used."""
        try:
            found = super().load_overload(sig, target_context)
        except Exception:  # unpickling a damaged file can raise anything
            with contextlib.suppress(OSError):
                self.flush()
            return None
        args, _ = sigutils.normalize_signature(sig)
        return found if found is not None and tuple(found.signature.args) == tuple(args) else None

    def save_overload(self, sig: Any, data: Any) -> None:
        """Keep a compiled function; a line on stderr says so where that fails."""
        try:
            super().save_overload(sig, data)
        except OSError as error:
            _warn_not_kept(str(self.cache_path), error.strerror or str(error))


@functools.cache
def _engine() -> str:
    """Return a fingerprint of the files that hold what kernels call: the room linalg, and this file."""
    return contents(Path(__file__), *sorted((Path(__file__).parent.parent / "linalg").glob("*.py")))


@functools.cache
def _warn_not_kept(folder: str, reason: str) -> None:
    """Say once why compiled code is not kept."""
    print(
        f"contin: compiled code is not kept in {folder} ({reason}); set CONTIN_CACHE_DIR and NUMBA_CACHE_DIR", file=sys.stderr
    )


def _place_cache() -> None:
    """Choose a folder for the engine's kernels where the package's own cannot be written."""
    if os.environ.get("NUMBA_CACHE_DIR"):
        return
    package = Path(__file__).resolve().parent
    beside = package / "__pycache__"
    if os.access(beside if beside.exists() else package, os.W_OK):
        return
    with contextlib.suppress(ContinError):  # without any folder nothing is kept; what needs one says so
        folder = str(cache_directory() / "engine")
        os.environ["NUMBA_CACHE_DIR"] = folder
        vars(numba.config)["CACHE_DIR"] = folder


_place_cache()
