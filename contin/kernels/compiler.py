"""The compiler: numba makes the machine code of kernels. Nothing outside contin/kernels imports numba.

The Python function that an object file holds is written here, in LLVM's language: see `_Entry`.
"""

from __future__ import annotations

import contextlib
import functools
import gc
import inspect
import itertools
import types as python_types
from collections.abc import Callable, Iterator
from typing import Annotated, Any, get_args, get_origin, get_type_hints

import llvmlite.binding as llvm
import numba
import numpy as np
from llvmlite import ir
from numba.core import cgutils, compiler, types
from numba.core.codegen import JITCodeLibrary
from numba.core.compiler_lock import global_compiler_lock
from numba.core.datamodel.models import ArrayModel
from numba.core.funcdesc import default_mangler
from numba.core.registry import cpu_target
from numba.core.targetconfig import ConfigStack
from numba.core.typeconv.castgraph import Conversion
from numba.core.typing.templates import Signature

from contin.kernels.kernel_parts import Helper, Instruction, Place, kernel_of, names_in
from contin.kernels.machine_code import INNER, Code, machine

#: Options of all kernels: division by zero gives inf; sums in any order, so that loops become vector instructions.
#: Only compiled code calls what numba makes. Kernels make no arrays, so nothing counts who uses one (``_nrt``).
_OPTIONS: dict[str, Any] = {
    "error_model": "numpy", "nogil": True, "fastmath": {"contract", "reassoc"},
    "no_cpython_wrapper": True, "no_cfunc_wrapper": True, "_nrt": False,
}  # fmt: skip

# LLVM's types.
_BYTE, _INT, _WORD, _DOUBLE = ir.IntType(8), ir.IntType(32), ir.IntType(64), ir.DoubleType()
_POINTER, _WORDS = _BYTE.as_pointer(), _WORD.as_pointer()

#: Size of the head of a Python object; its type is the last word of it. The fields of an array follow (PyArrayObject_fields):
#: data, number of dimensions, shape, strides, owner, type of numbers, flags.
_HEAD = object.__basicsize__
_TYPE, _DATA, _DIMENSIONS, _SHAPE, _NUMBERS, _FLAGS = _HEAD - 8, _HEAD, _HEAD + 8, _HEAD + 16, _HEAD + 40, _HEAD + 48
#: In a type of numbers (PyArray_Descr), behind its head: the class, three letters of which the last is the order of bytes, a
#: letter, and the number of the type.
_ORDER, _NUMBER = _HEAD + 10, _HEAD + 12
#: In a type, behind its head and its length and the address of its name: the size of its objects. The entries of a tuple begin
#: behind that, which versions of Python have in several places.
_BASIC_SIZE = _HEAD + 16
#: Flags of an array: contiguous rows, aligned; and writable.
_CONTIGUOUS, _WRITABLE = 0x0001 | 0x0100, 0x0400


def machine_code(function: Callable[..., Any], reorder: bool, entry: str) -> Code:
    """Return the machine code of a kernel, as `contin.kernels.kernel.kernel` describes it, with the name of its entry.

    Raises TypeError for an annotation that is no type of a kernel's argument, or a call of a function of numba;
    numba.core.errors.NumbaError where it cannot be compiled.
    """
    result, parameters = _signature(function)
    hints = list(get_type_hints(function, include_extras=True).values())[:-1]
    context = cpu_target.target_context
    with global_compiler_lock:
        _refresh()
        with _own_options(context.codegen()):
            done = _compiled(function, tuple(parameters), result, reorder)
            return _Entry(context, done, hints, entry).code()


class _Passes(compiler.Compiler):
    """What numba does to a kernel or a helper, without what changes nothing there."""

    def define_pipelines(self) -> list[Any]:
        """Return numba's lists of passes."""
        found: list[Any] = super().define_pipelines()
        for each in found:
            each.passes = [step for step in each.passes if step[0].__name__ not in _SKIPPED]
        return found


#: Passes that look for expressions of arrays, closures, `with` and other things that kernels have not. Without them kernels are
#: the same, and compiled in nine tenths of the time.
_SKIPPED = (
    "IRProcessing", "WithLifting", "InlineClosureLikes", "RewriteSemanticConstants", "DeadBranchPrune",
    "MakeFunctionToJitFunction", "FindLiterallyCalls", "LiteralUnroll", "LiteralPropagationSubPipelinePass", "InlineOverloads",
    "NopythonRewrites", "AnnotateTypes", "NoPythonSupportedFeatureValidation",
)  # fmt: skip


def _compiled(function: Callable[..., Any], parameters: tuple[Any, ...], result: types.Type | None, reorder: bool) -> Any:
    """Return what numba makes of a function for types of its parameters; it finds the type of the result where that is None."""
    options = _OPTIONS if reorder else {**_OPTIONS, "fastmath": False}
    flags: Any = compiler.Flags()
    cpu_target.options.parse_as_flags(flags, {**options, "nopython": True, "boundscheck": None})
    flags.no_compile, flags.enable_pyobject = True, False  # what numba runs itself is not wanted
    typing, context = cpu_target.typing_context, cpu_target.target_context
    library = _Part(context.codegen(), function.__qualname__)
    return compiler.compile_extra(typing, context, _ready(function), parameters, result, flags, {}, library, _Passes)


@functools.cache
def _refresh() -> None:
    """Let numba load what it knows, which it does not do on its own account before the first function."""
    cpu_target.target_context.refresh()


@contextlib.contextmanager
def _own_options(codegen: Any) -> Iterator[None]:
    """Let what is compiled meanwhile be for `contin.kernels.machine_code.machine`, in place of this processor.

    It is optimized once, as a whole, and no garbage is collected, neither meanwhile nor later. That saves a quarter of the
    time; where one process makes all kernels, it takes 180 MB.
    """
    collects, libraries, target = gc.isenabled(), codegen._library_class, codegen._tm
    functions: Any = types.BaseFunction
    context, models = cpu_target.target_context, cpu_target.target_context.data_model_manager
    codegen._library_class, codegen._tm, functions.get_call_type = _Library, _target(), _resolved
    context.data_model_manager, context.mangler = _models(), _named
    gc.disable()
    try:
        yield
    finally:
        codegen._library_class, codegen._tm, functions.get_call_type = libraries, target, _RESOLVE
        context.data_model_manager = models
        del context.mangler
        gc.freeze()
        if collects:
            gc.enable()


#: numba's search for what a function is for types of its arguments.
_RESOLVE: Any = types.BaseFunction.get_call_type
#: What it has found.
_RESOLVED: dict[Any, Any] = {}


def _resolved(function: Any, context: Any, arguments: Any, names: Any) -> Any:
    """Return what `_RESOLVE` finds, which is asked once for a function, types, and options of who calls.

    There are thousands of sums of two whole numbers, and for each numba tries all that it knows of sums.
    """
    if names:
        return _RESOLVE(function, context, arguments, names)
    options: Any = ConfigStack.top_or_none()
    key = function, tuple(arguments), bool(options.fastmath)
    if key not in _RESOLVED:
        _RESOLVED[key] = _RESOLVE(function, context, arguments, names)
    return _RESOLVED[key]


@functools.cache
def _target() -> Any:
    """Return LLVM's description of the processor that machine code is made for."""
    triple, processor = llvm.get_default_triple(), machine()[1]
    return llvm.Target.from_triple(triple).create_target_machine(cpu=processor, opt=3, reloc="pic", codemodel="default")


class _Array(ArrayModel):
    """Arrays as numba has them, passed to functions as address and shape; where these are not contiguous, with strides.

    numba passes nine numbers for a matrix. A function takes each field of a named tuple as an argument, and some of these have
    more than a hundred.
    """

    def get_argument_type(self) -> Any:
        """Return LLVM's types of what is passed of an array."""
        data, shape, strides = (self._models[self.get_field_position(name)] for name in ("data", "shape", "strides"))
        passed = [data, shape] if self._fe_type.layout == "C" else [data, shape, strides]
        return tuple(model.get_argument_type() for model in passed)

    def as_argument(self, builder: ir.IRBuilder, value: ir.Value) -> Any:
        """Return what is passed of an array."""
        data, shape, *strides = super().as_argument(builder, value)[4:]
        return (data, shape) if self._fe_type.layout == "C" else (data, shape, *strides)

    def from_argument(self, builder: ir.IRBuilder, value: Any) -> Any:
        """Return the array."""
        data, shape, *strides = value
        size = ir.Constant(_WORD, self._fe_type.dtype.bitwidth // 8)
        *steps, _ = itertools.accumulate([size, *reversed(shape)], builder.mul)
        count = functools.reduce(builder.mul, shape)
        owner = [ir.Constant(model.get_value_type(), None) for model in self._models[:2]]
        return super().from_argument(builder, (*owner, count, size, data, shape, *(strides or [steps[::-1]])))


def _named(name: str, types: Any, *, abi_tags: Any = (), uid: int | None = None) -> Any:
    """Return the name of a function in LLVM's language, with its number. Types of its arguments are thousands of letters."""
    return default_mangler(name, (), uid=uid)


@functools.cache
def _models() -> Any:
    """Return how values of numba's types are kept and passed."""
    models = cpu_target.target_context.data_model_manager.copy()
    models.register(types.Array, _Array)
    return models


class _Library(JITCodeLibrary):
    """A module that numba makes. It is not optimized with all that it calls before that is part of a kernel."""

    def _optimize_functions(self, ll_module: Any) -> None:
        ll_module.data_layout = self._codegen._data_layout
        passes, builder = self._codegen._function_pass_manager()
        for function in ll_module.functions:
            if not function.is_declaration:
                passes.run(function, builder)

    def _optimize_final_module(self) -> None:
        """Do nothing."""


class _Part(_Library):
    """What numba makes of a kernel or a helper: there is no machine code of it before it is part of a kernel."""

    def _finalize_final_module(self) -> None:
        self._finalized = True


def _type(hint: Any) -> Any:
    """Return numba's type for an annotation."""
    if get_origin(hint) is Annotated:
        kind = get_args(hint)[1]
        return types.Array(getattr(types, kind.number), kind.dimensions, "C", readonly=not kind.writable)
    if isinstance(hint, type) and hasattr(hint, "_fields"):
        return types.BaseTuple.from_types(list(map(_type, _fields(hint))), hint)
    try:
        return {int: types.int64, float: types.float64, type(None): types.void}[hint]
    except (KeyError, TypeError):
        raise TypeError(f"{hint!r} is no type of a kernel's argument") from None


def _fields(hint: object) -> list[Any]:
    """Return the annotations of a named tuple's fields."""
    return list(get_type_hints(hint, include_extras=True).values())


# --- what kernels call -----------------------------------------------------------------------------------------------


def _ready(function: Callable[..., Any]) -> Any:
    """Return a function that calls what numba knows in place of kernels, helpers and instructions."""
    scope, names = function.__globals__, names_in(function.__code__)
    known = {name: _known(scope[name], names) for name in names & scope.keys()}
    copy = python_types.FunctionType(
        function.__code__, scope | known, function.__name__, function.__defaults__, function.__closure__
    )
    copy.__qualname__ = function.__qualname__
    return copy


def _known(value: object, names: frozenset[str]) -> Any:
    """Return what numba knows a global value as, or for a module its members of these ``names``; others stay as they are."""
    if isinstance(value, python_types.ModuleType):
        members = {name: vars(value)[name] for name in names & vars(value).keys()}
        known = {name: _known(member, frozenset()) for name, member in members.items()}
        if all(known[name] is member for name, member in members.items()):
            return value
        copy = python_types.ModuleType(value.__name__)
        vars(copy).update(vars(value) | known)
        return copy
    part: Any = value if isinstance(value, Helper | Instruction) else kernel_of(value)
    if part is None:
        return value
    if part not in _KNOWN:
        make = _helper if isinstance(part, Helper) else _intrinsic if isinstance(part, Instruction) else _outer
        _KNOWN[part] = make(part)
    return _KNOWN[part]


#: Kernels, helpers and instructions that numba knows.
_KNOWN: dict[Any, Any] = {}


def _helper(helper: Helper) -> Any:
    """Return a helper as numba knows it: it is compiled once for each kind of arguments."""
    if helper.inline:
        return numba.njit(inline="always", **_OPTIONS)(_ready(helper.function))
    made: dict[Any, Any] = {}

    def typed(context: Any, *given: types.Type) -> Any:
        if given not in made:
            made[given] = _compiled(helper.function, given, None, reorder=True)
        done = made[given]

        def call(context: Any, builder: ir.IRBuilder, signature: Signature, arguments: list[ir.Value]) -> Any:
            context.active_code_library.add_linking_library(done.library)
            return context.call_internal_no_propagate(builder, done.fndesc, signature, arguments)[1]

        return done.signature, call

    return _callable(helper.function, typed)


def _outer(kernel: Any) -> Any:
    """Return a kernel as numba knows it where another one calls it: a function of this signature in other machine code."""
    result, parameters = _signature(kernel.function)
    signature = result(*parameters)

    def typed(context: Any, *given: types.Type) -> Any:
        fits = [context.can_convert(kind, wanted) for kind, wanted in zip(given, parameters)]
        if len(given) != len(parameters) or any(fit is None or fit > Conversion.safe for fit in fits):
            raise numba.errors.TypingError(f"{kernel.name} takes {signature.args}, not {given}")
        return signature, call

    def call(context: Any, builder: ir.IRBuilder, signature: Signature, arguments: list[ir.Value]) -> Any:
        kind = context.call_conv.get_function_type(result, signature.args)
        function = cgutils.get_or_insert_function(builder.module, kind, kernel.entry + INNER)
        _, value = context.call_conv.call_function(builder, function, result, signature.args, arguments)
        return context.get_dummy_value() if result is types.void else value

    return _callable(kernel.function, typed)


def _callable(function: Callable[..., Any], typed: Callable[..., Any]) -> Any:
    """Return a function as numba knows it where ``typed`` gives its signature, and what writes a call of it."""
    known: Any = functools.wraps(function)(typed)
    first, own = inspect.Parameter("context", inspect.Parameter.POSITIONAL_OR_KEYWORD), inspect.signature(function)
    known.__signature__ = own.replace(parameters=[first, *own.parameters.values()])
    return numba.extending.intrinsic(known)


def _signature(function: Callable[..., Any]) -> tuple[Any, list[Any]]:
    """Return numba's types of the result and the parameters of a kernel."""
    hints = get_type_hints(function, include_extras=True)
    return _type(hints.pop("return")), list(map(_type, hints.values()))


def _intrinsic(instruction: Instruction) -> Any:
    """Return an instruction as numba knows it."""
    write = instruction.function
    hints = get_type_hints(write)
    hints.pop("builder", None)
    result, parameters = _type(hints.pop("return")), list(hints.values())
    nothing = result is types.void
    written: dict[str, JITCodeLibrary] = {}

    def call(context: Any, builder: ir.IRBuilder, signature: Signature, arguments: list[ir.Value]) -> Any:
        parts = [_taken_apart(context, builder, *each) for each in zip(signature.args, arguments)]
        options = sorted(getattr(context.fastmath, "flags", ()))  # numba gives them to all sums and products of a module
        name = ".".join([write.__module__, write.__qualname__, *options, *(str(len(part)) for part in parts)])
        values = list(itertools.chain.from_iterable(parts))
        returned = ir.VoidType() if nothing else context.get_value_type(result)
        kind = ir.FunctionType(returned, [value.type for value in values])
        if name not in written:
            written[name] = _Part(context.codegen(), name)
            module = written[name].create_ir_module(name)
            _write(context, ir.Function(module, kind, name), parts)
            context.post_lowering(module, written[name])
            written[name].add_ir_module(module)
        context.active_code_library.add_linking_library(written[name])
        value = builder.call(cgutils.get_or_insert_function(builder.module, kind, name), values)
        return context.get_dummy_value() if nothing else value

    def _write(context: Any, function: ir.Function, parts: list[list[ir.Value]]) -> None:
        if write.__name__ in _SMALL:
            function.attributes.add("optsize")
        builder, given = ir.IRBuilder(function.append_basic_block()), iter(function.args)
        arguments = [
            (Place if kind is Any else kind)(*taken) if kind is Any or hasattr(kind, "_fields") else taken[0]
            for kind, part in zip(parameters, parts)
            for taken in [list(itertools.islice(given, len(part)))]
        ]
        value = write(builder, *arguments)
        if isinstance(value, tuple):
            value = context.make_tuple(builder, result, value)
        builder.ret_void() if nothing else builder.ret(value)

    def typed(context: object, *given: types.Type) -> Any:
        return result(*(kind if hint is Any else _type(hint) for hint, kind in zip(parameters, given))), call

    return numba.extending.intrinsic(functools.wraps(write)(typed))


def _taken_apart(context: Any, builder: ir.IRBuilder, kind: types.Type, argument: ir.Value) -> list[Any]:
    """Return what an instruction takes for an argument: the values of a named tuple, the address and strides of an array."""
    if isinstance(kind, types.Array):
        array = context.make_array(kind)(context, builder, argument)
        return [builder.ptrtoint(array.data, _WORD), *cgutils.unpack_tuple(builder, array.strides)]
    return list(cgutils.unpack_tuple(builder, argument)) if isinstance(kind, types.BaseTuple) else [argument]


# --- the function that Python calls ----------------------------------------------------------------------------------


class _Entry:
    """The function that Python calls: its arguments become those of the compiled one, and its result a Python object.

        PyObject *entry(PyObject *self, PyObject *const *arguments, Py_ssize_t count)

    ``self`` is the tuple (numpy.ndarray, None, TypeError). An argument of another kind raises TypeError. Kernels raise nothing.
    """

    def __init__(self, context: Any, done: Any, parameters: list[Any], name: str) -> None:
        self.context, self.done, self.parameters, self.name = context, done, parameters, name
        self.module = ir.Module(name)
        self.module.triple, self.module.data_layout = llvm.get_default_triple(), context.codegen()._data_layout
        self.function = ir.Function(self.module, ir.FunctionType(_POINTER, [_POINTER, _POINTER.as_pointer(), _WORD]), name)
        self.builder, self.shape = ir.IRBuilder(self.function.append_basic_block()), self._shape()
        self.wrong = self.function.append_basic_block("wrong")
        self.failed = self.function.append_basic_block("failed")

    def code(self) -> Code:
        """Return entry and kernel as one object file."""
        self._write()
        module = _linked(self.done.library)
        entry = llvm.parse_assembly(cgutils.normalize_ir_text(str(self.module)))
        entry.verify()
        module.link_in(entry)
        module.get_function(self.done.fndesc.llvm_func_name).name = self.name + INNER
        for function in module.functions:
            if not function.is_declaration and function.name not in (self.name, self.name + INNER):
                function.linkage = "internal"
        for variable in module.global_variables:
            if not variable.is_declaration:
                variable.linkage = "internal"
        foreign = [f.name for f in module.functions if f.is_declaration and not f.name.startswith("llvm.")]
        foreign += [v.name for v in module.global_variables if v.is_declaration]
        own = next((name for name in foreign if name.startswith(_NUMBAS)), None)
        if own is not None:  # each process would make the code anew
            name = self.done.fndesc.qualname
            raise TypeError(f"{name}: its machine code calls {own}, which is there only where numba is loaded")
        return Code(self.name, tuple(foreign), _target().emit_object(module))

    def _write(self) -> None:
        builder, conventions, described = self.builder, self.context.call_conv, self.done.fndesc
        _, arguments, count = self.function.args
        self._require(builder.icmp_signed("==", count, ir.Constant(_WORD, len(self.parameters))), self.wrong)
        values = [self._values(hint, builder.load(_step(builder, arguments, i))) for i, hint in enumerate(self.parameters)]
        kind = conventions.get_function_type(described.restype, described.argtypes)
        kernel = ir.Function(self.module, kind, described.llvm_func_name)
        places = [builder.alloca(argument.type.pointee) for argument in kernel.args[:2]]  # of the result, and an error
        thread = self._call("PyEval_SaveThread", _POINTER)
        builder.call(kernel, [*places, *itertools.chain.from_iterable(values)])
        self._call("PyEval_RestoreThread", ir.VoidType(), thread)
        builder.ret(self._result(described.restype, builder.load(places[0])))
        builder.position_at_end(self.wrong)
        text = cgutils.global_constant(builder.module, "wrong", cgutils.make_bytearray(_WRONG_ARGUMENTS))
        self._call("PyErr_SetString", ir.VoidType(), self._own(_WRONG), builder.bitcast(text, _POINTER))
        builder.branch(self.failed)
        builder.position_at_end(self.failed)
        builder.ret(ir.Constant(_POINTER, None))

    def _values(self, hint: object, given: ir.Value) -> list[ir.Value]:
        """Return what the compiled function takes for a Python object: numbers, and of arrays address and shape."""
        builder, kind = self.builder, _type(hint)
        if isinstance(kind, types.Array):
            flags = _CONTIGUOUS | (_WRITABLE if kind.mutable else 0)
            wanted = [ir.Constant(_INT, value) for value in (kind.ndim, flags, np.dtype(str(kind.dtype)).num)]
            shape = builder.call(self.shape, [given, self._own(_ARRAY), *wanted])
            self._require(builder.icmp_unsigned("!=", shape, ir.Constant(_WORDS, None)), self.wrong)
            data = _field(builder, given, _DATA, self.context.get_data_type(kind.dtype).as_pointer())
            return [data, *(builder.load(_step(builder, shape, i)) for i in range(kind.ndim))]
        if isinstance(kind, types.BaseTuple):
            entries = self._entries(given)
            fields = [self._values(field, builder.load(_step(builder, entries, i))) for i, field in enumerate(_fields(hint))]
            return list(itertools.chain.from_iterable(fields))
        whole = isinstance(kind, types.Integer)
        value = self._call("PyLong_AsLongLong", _WORD, given) if whole else self._call("PyFloat_AsDouble", _DOUBLE, given)
        error = self._call("PyErr_Occurred", _POINTER)
        self._require(builder.icmp_unsigned("==", error, ir.Constant(_POINTER, None)), self.failed)
        return [value]

    def _shape(self) -> Any:
        """Write the function that returns the address of an array's shape; null where it is not of the wanted kind.

        int64 *shape(PyObject *given, PyObject *ndarray, int dimensions, int flags, int number)
        """
        function = ir.Function(self.module, ir.FunctionType(_WORDS, [_POINTER, _POINTER, _INT, _INT, _INT]), "shape")
        given, array, dimensions, flags, number = function.args
        builder = ir.IRBuilder(function.append_basic_block())
        none = ir.Constant(_WORDS, None)
        with builder.if_then(builder.icmp_unsigned("!=", _field(builder, given, _TYPE, _POINTER), array)):
            builder.ret(none)
        numbers = _field(builder, given, _NUMBERS, _POINTER)
        pairs = [
            (_field(builder, given, _DIMENSIONS, _INT), dimensions),
            (builder.and_(_field(builder, given, _FLAGS, _INT), flags), flags),
            (_field(builder, numbers, _NUMBER, _INT), number),
            (_field(builder, numbers, _ORDER, _BYTE), ir.Constant(_BYTE, ord("="))),
        ]
        fits = functools.reduce(builder.and_, (builder.icmp_unsigned("==", *pair) for pair in pairs))
        builder.ret(builder.select(fits, _field(builder, given, _SHAPE, _WORDS), none))
        return function

    def _result(self, kind: types.Type, value: ir.Value) -> Any:
        """Return a result as a Python object."""
        if kind is types.void:
            none = self._own(_NONE)
            self._call("Py_IncRef", ir.VoidType(), none)
            return none
        make = "PyLong_FromLongLong" if isinstance(kind, types.Integer) else "PyFloat_FromDouble"
        return self._call(make, _POINTER, value)

    def _own(self, place: int) -> Any:
        """Return an entry of the tuple ``self``."""
        return self.builder.load(_step(self.builder, self._entries(self.function.args[0]), place))

    def _entries(self, given: ir.Value) -> Any:
        """Return the address of the entries of a tuple."""
        builder = self.builder
        size = _field(builder, _field(builder, given, _TYPE, _POINTER), _BASIC_SIZE, _WORD)
        return builder.bitcast(builder.gep(given, [size]), _POINTER.as_pointer())

    def _require(self, condition: ir.Value, otherwise: Any) -> None:
        """Go on where a condition holds, else in another block."""
        follows = self.function.append_basic_block()
        self.builder.cbranch(condition, follows, otherwise)
        self.builder.position_at_end(follows)

    def _call(self, name: str, returned: ir.Type, *arguments: ir.Value) -> Any:
        """Call a function of Python's library."""
        kind = ir.FunctionType(returned, [argument.type for argument in arguments])
        return self.builder.call(cgutils.get_or_insert_function(self.module, kind, name), arguments)


def _linked(library: JITCodeLibrary) -> Any:
    """Return the module of a library with all that it calls, optimized: `library.finalize()` would also make machine code."""
    for other in dict.fromkeys(library._linking_libraries):
        library._final_module.link_in(other._get_module_for_linking(), preserve=True)
    for function in library._final_module.functions:
        if sum(1 for block in function.blocks for _ in block.instructions) > _LONG:
            function.add_function_attribute("noinline")  # it stands in the machine code once
    passes, builder = library._codegen._module_pass_manager()
    passes.run(library._final_module, builder)
    return library._final_module


#: Helpers of more instructions are called, not copied to where they are called: kernels run as fast, and are compiled in three
#: quarters of the time (a limit of 150 saves a tenth).
_LONG = 30
#: Instructions whose loops are not unrolled: long ones with many short loops. It takes a third of the time to compile.
_SMALL = ("interpret",)
#: What names of numba's own functions in C begin with.
_NUMBAS = ("numba_", "NRT_")
#: Places in the tuple ``self``, see `contin.kernels.machine_code.loaded`.
_ARRAY, _NONE, _WRONG = range(3)
#: What TypeError says.
_WRONG_ARGUMENTS = b"an argument of a kernel is not of the type in its annotations\0"


def _step(builder: ir.IRBuilder, pointer: ir.Value, count: int) -> Any:
    return builder.gep(pointer, [ir.Constant(_WORD, count)])


def _field(builder: ir.IRBuilder, item: ir.Value, offset: int, kind: ir.Type) -> Any:
    return builder.load(builder.bitcast(_step(builder, item, offset), kind.as_pointer()))
