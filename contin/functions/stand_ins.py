"""Copies of users' functions that take recorded numbers, and functions that stand for a recording.

Functions of ``math`` take ordinary numbers only, and arrays that NumPy makes hold no recorded ones. In the copies, their names
stand for functions that take both. Everything else is what it was: globals, closures, defaults, objects with their methods.
"""

from __future__ import annotations

import builtins
import cmath
import dis
import functools
import inspect
import math
import types
from collections.abc import Callable, Iterable, Iterator, Sequence
from typing import Any

import numpy as np

from contin.functions import recorded_arrays
from contin.functions.interpreter import of_columns
from contin.functions.primitives import TABLE
from contin.functions.recorded_arrays import FUNCTIONS, UFUNCS, largest, numbers, operation, recorded, scalar_product, smallest
from contin.functions.recorded_complex import ComplexNumber, complex_number, function_of_complex
from contin.functions.signature import Arguments
from contin.functions.tape import Number, Table, Tape, Unrecordable


class RecordedFunction:
    """A function given by operations on a tape.

    - ``name`` (str)
    - ``names`` (sequence of str): Of its arguments.
    - ``arguments`` (sequence of tuple of str, list of them, or None): Names of the components of each argument; a list stands
      for a tuple of named tuples, None for a number.
    - ``tape`` (Tape)
    - ``inputs`` (sequence of int): Places of all components of the arguments, in order.
    - ``results`` (sequence of int): Places of the values.
    - ``single`` (bool): It returns a number, not a tuple.
    """

    def __init__(
        self, name: str, names: Sequence[str], arguments: Arguments, tape: Tape, inputs: Sequence[int], results: Sequence[int],
        single: bool = False,
    ) -> None:  # fmt: skip
        self.__name__, self._names, self._arguments = name, tuple(names), tuple(arguments)
        self._tape, self._inputs, self._results, self._single = tape, tuple(inputs), tuple(results), single

    @property
    def __signature__(self) -> inspect.Signature:
        kind = inspect.Parameter.POSITIONAL_OR_KEYWORD
        return inspect.Signature([inspect.Parameter(name, kind) for name in self._names])

    def __repr__(self) -> str:
        return f"RecordedFunction({self.__name__}({', '.join(self._names)}))"

    @property
    def count(self) -> int:
        """Number of values; 0 for one number that is no tuple."""
        return 0 if self._single else len(self._results)

    def __call__(self, *arguments: object) -> Any:
        """Return the value: recorded for recorded numbers, else computed in Python."""
        values = _flat(arguments)
        known = recorded(*values)
        if known is None:
            found: list[Any] = self._tape.evaluate(self._results, dict(zip(self._slots(), map(float, values))))
        else:
            found = known.tape.replay(self._tape, self._results, dict(zip(self._inputs, values)))
        return found[0] if self._single else tuple(found)

    def arrays(self, *arguments: object) -> tuple[Any, ...]:
        """Return the values for arrays of numbers, broadcast: shape of the arguments for each."""
        columns = [np.asarray(value, dtype=float) for value in np.broadcast_arrays(*_flat(arguments))]
        u = np.ascontiguousarray(np.stack([column.ravel() for column in columns], axis=1))
        out = of_columns(self._tape, self._results, self._slots())(u)
        return tuple(np.ascontiguousarray(out.T).reshape(-1, *columns[0].shape))

    def _slots(self) -> list[Any]:
        return [self._tape.operations[place].data for place in self._inputs]

    def text(self) -> str:
        """Return the operations as lines of Python."""
        both = zip(self._names, self._arguments)
        labels = [label for name, each in both for label in ([name] if each is None else [f"{name}.{own}" for own in each])]
        return "\n".join(self._tape.lines(self._results, dict(zip(self._inputs, labels))))

    def compact(self) -> RecordedFunction:
        """Return the same function on a tape of its own, which has what it needs and nothing else."""
        tape = Tape(recorded_arrays.NUMPY)
        inputs = {place: tape.input(self._tape.operations[place].data) for place in self._inputs}
        results = [number.place for number in tape.replay(self._tape, self._results, inputs)]
        places = [inputs[place].place for place in self._inputs]
        return RecordedFunction(self.__name__, self._names, self._arguments, tape, places, results, self._single)

    def __getstate__(self) -> dict[str, Any]:
        return dict(vars(self.compact()))

    def _data(self) -> tuple[Any, ...]:
        own = self.compact()
        return own._names, own._arguments, own._inputs, own._results, own._single, own._tape.operations

    def __eq__(self, other: object) -> bool:
        if not isinstance(other, RecordedFunction):
            return NotImplemented
        return self is other or self._data() == other._data()

    def __hash__(self) -> int:
        return hash((self._names, self._arguments, self._single))


def _flat(argument: object) -> list[Any]:
    """Return the numbers of an argument: of a number, a tuple, or a tuple of tuples."""
    if isinstance(argument, tuple):
        return [number for part in argument for number in _flat(part)]
    return list(argument) if isinstance(argument, (list, np.ndarray)) and np.ndim(argument) else [argument]


def prepared(function: object) -> Any:
    """Return a copy of a function for recorded numbers; raise Unrecordable if it is no plain Python, or catches exceptions."""
    return _Copies().function(function)


def constants_of(functions: Iterable[object]) -> list[object] | None:
    """Return all objects that functions read besides their arguments, in order; None where one may change and stay the same."""
    copies = _Copies()
    for function in functions:
        copies.function(function)
    return copies.read if all(map(_is_fixed, copies.read)) else None


class _Copies:
    """Copies of functions, each made once; ``read`` are the objects that they read."""

    def __init__(self) -> None:
        self.read: list[object] = []
        self._done: dict[int, Any] = {}
        self._kept: list[Any] = []  # what is known by its address stays alive

    def function(self, function: object) -> Any:
        """Return the copy of a function, method, partial function, or object that can be called."""
        function = getattr(function, "py_func", function)
        if isinstance(function, RecordedFunction):
            return function
        if isinstance(function, functools.partial):
            arguments = [self.value(value) for value in function.args]
            named = {name: self.value(value) for name, value in function.keywords.items()}
            return functools.partial(self.function(function.func), *arguments, **named)
        if isinstance(function, types.MethodType):
            return types.MethodType(self.function(function.__func__), self.value(function.__self__))
        if isinstance(function, types.FunctionType):
            return self._copy(function)
        found = self.value(function)
        if found is function and not isinstance(function, type):
            call = vars(type(function)).get("__call__")
            if isinstance(call, types.FunctionType):
                return types.MethodType(self.function(call), self._object(function))
            raise Unrecordable(f"{getattr(function, '__name__', type(function).__name__)} is no plain Python function")
        return found

    def _copy(self, function: types.FunctionType) -> Any:
        if id(function) in self._done:
            return self._done[id(function)]
        if _has(function.__code__, "PUSH_EXC_INFO"):  # not those of generators, which pass exceptions on
            raise Unrecordable(f"{function.__name__} catches exceptions (try, with)")
        scope: dict[str, Any] = {"__name__": function.__module__, "__builtins__": builtins}
        cells = tuple(types.CellType() for _ in function.__closure__ or ())
        copy = types.FunctionType(function.__code__, scope, function.__name__, None, cells or None)
        self._done[id(function)] = copy
        self._kept.append(function)
        self.read += function, function.__code__
        copy.__defaults__ = None if function.__defaults__ is None else tuple(map(self.value, function.__defaults__))
        copy.__kwdefaults__ = {name: self.value(value) for name, value in (function.__kwdefaults__ or {}).items()} or None
        for name in _globals_in(function.__code__):
            if name in function.__globals__:
                scope[name] = self.value(function.__globals__[name])
            elif name in _BUILTINS:
                scope[name] = _BUILTINS[name]
        for cell, given in zip(cells, function.__closure__ or ()):
            try:
                cell.cell_contents = self.value(given.cell_contents)
            except ValueError:  # a name that has no value yet
                continue
        return copy

    def value(self, value: object) -> Any:
        """Return what stands for a value."""
        self.read.append(value)
        if isinstance(value, (Number, ComplexNumber, recorded_arrays.Numbers, RecordedFunction, _Module, _Object)):
            return value
        own = _own(value)
        if own is not None:
            return own
        value = getattr(value, "py_func", value)
        if isinstance(value, functools._lru_cache_wrapper) and value.__module__ not in _READY:
            value = value.__wrapped__  # recorded numbers are no keys
        if isinstance(value, (types.FunctionType, functools._lru_cache_wrapper)) and value.__module__ in _READY:
            return value  # it takes recorded numbers
        if isinstance(value, (types.FunctionType, types.MethodType, functools.partial)):
            return self.function(value)
        if isinstance(value, types.ModuleType):
            return _Module(value, self)
        if isinstance(value, (list, tuple)) and any(map(_may_hold_functions, value)):
            parts = [self.value(part) for part in value]
            return type(value)(*parts) if hasattr(value, "_fields") else type(value)(parts)
        if isinstance(value, dict) and any(map(_may_hold_functions, value.values())):
            return {name: self.value(part) for name, part in value.items()}
        return self._object(value) if _is_object(value) else value

    def _object(self, value: object) -> Any:
        if id(value) not in self._done:
            self._kept.append(value)
            self._done[id(value)] = _Object(value, self)
        return self._done[id(value)]


class _Module:
    """A module whose functions take recorded numbers."""

    def __init__(self, module: types.ModuleType, copies: _Copies) -> None:
        self._module, self._copies = module, copies

    def __getattr__(self, name: str) -> Any:
        value = getattr(self._module, name)
        if self._module.__name__.partition(".")[0] not in _FOREIGN or isinstance(value, types.ModuleType):
            return self._copies.value(value)
        own = _own(value)
        return value if own is None else own


#: The package whose objects are no user's.
_HERE = __name__.rpartition(".")[0]
#: Modules whose functions take recorded numbers as they are.
_READY = tuple(f"{_HERE}.{name}" for name in ("gradient", "iteration", "recorded_arrays", "signature", "stand_ins"))
#: Libraries whose functions stay what they are, if there is no stand-in for them.
_FOREIGN = ("math", "numpy", "scipy", "cmath", "builtins")


class _Object:
    """An object of a user's class whose methods take recorded numbers."""

    def __init__(self, value: object, copies: _Copies) -> None:
        vars(self).update(_value=value, _copies=copies)

    def __getattr__(self, name: str) -> Any:
        found = getattr(self._value, name)
        if isinstance(found, types.MethodType) and found.__self__ is self._value:
            return types.MethodType(self._copies.function(found.__func__), self)
        return self._copies.value(found)

    def __setattr__(self, name: str, value: object) -> None:
        raise Unrecordable("it changes an object")

    def __call__(self, *arguments: object, **named: object) -> Any:
        return self._copies.function(type(self._value).__call__)(self, *arguments, **named)

    def __getitem__(self, key: object) -> Any:
        return self._copies.value(self._value[key])

    def __iter__(self) -> Iterator[Any]:
        return map(self._copies.value, self._value)

    def __len__(self) -> int:
        return len(self._value)


@functools.lru_cache(maxsize=1024)
def _has(code: types.CodeType, name: str) -> bool:
    """Return whether a function has an instruction of this name, but for what is defined in it."""
    return any(instruction.opname == name for instruction in dis.get_instructions(code))


@functools.lru_cache(maxsize=1024)
def _globals_in(code: types.CodeType) -> set[str]:
    """Return the names of global values that a code object, and those inside it, read; attributes may have the same names."""
    inner = [constant for constant in code.co_consts if isinstance(constant, types.CodeType)]
    own = {str(each.argval) for each in dis.get_instructions(code) if each.opname in ("LOAD_GLOBAL", "LOAD_NAME")}
    return own.union(*map(_globals_in, inner))


def _is_fixed(value: object) -> bool:
    """Return whether a value cannot change: what a function reads is looked at by itself."""
    if isinstance(value, (types.ModuleType, types.BuiltinFunctionType)):
        return str(getattr(value, "__module__", None) or value.__name__).partition(".")[0] in _FOREIGN
    if isinstance(value, types.CodeType):  # what it imports when it is called may be any module
        return not _has(value, "IMPORT_NAME") and all(map(_is_fixed, value.co_consts))
    if isinstance(value, (tuple, frozenset)):
        return all(map(_is_fixed, value))
    return value is None or isinstance(value, (types.FunctionType, float, int, str, bytes, complex, np.ufunc))


def _may_hold_functions(value: object) -> bool:
    return callable(value) or isinstance(value, (list, tuple, dict)) or _is_object(value) or hasattr(value, "tocsr")


def _is_object(value: object) -> bool:
    """Return whether a value is an object of a user's class."""
    module = type(value).__module__
    if module.partition(".")[0] in ("numpy", "scipy") or module.startswith(_HERE):
        return False
    if isinstance(value, (tuple, list, dict, type, float, int, str)):
        return False
    return isinstance(value, types.SimpleNamespace) or bool(type(value).__flags__ & _HEAP_TYPE)


#: The flag of classes that a class statement made (CPython: Py_TPFLAGS_HEAPTYPE).
_HEAP_TYPE = 1 << 9


def _own(value: object) -> Any:
    """Return the stand-in of a function, sparse matrix or spline; None of everything else."""
    if isinstance(value, np.ufunc):
        function = UFUNCS.get(value.__name__)
        return None if function is None else _Either(value, functools.partial(recorded_arrays.elementwise, function))
    if type(value).__module__.startswith("scipy."):
        return _of_scipy(value)
    try:
        return _STAND_INS.get(value) if callable(value) else None
    except TypeError:  # it cannot be a key
        return None


def _of_scipy(value: Any) -> Any:
    """Return the stand-in of a sparse matrix, or of a spline."""
    if hasattr(value, "tocsr"):
        return recorded_arrays.SparseConstant(value)
    kind, extrapolates = type(value).__name__, getattr(value, "extrapolate", False) is True
    if kind in ("CubicSpline", "PPoly", "PchipInterpolator", "Akima1DInterpolator", "CubicHermiteSpline"):
        if np.ndim(value.c) == 2 and extrapolates:
            return _Either(value, recorded_arrays.tabulated(Table.piecewise(value.x, value.c)))
    elif kind == "BSpline" and np.ndim(value.c) == 1 and extrapolates:
        from scipy.interpolate import PPoly  # type: ignore[import-untyped]

        pieces = PPoly.from_spline(value)
        inside = [i for i, (a, b) in enumerate(zip(pieces.x, pieces.x[1:])) if b > a]
        knots = [*(pieces.x[i] for i in inside), pieces.x[inside[-1] + 1]]
        return _Either(value, recorded_arrays.tabulated(Table.piecewise(knots, pieces.c[:, inside])))
    return None


class _Either:
    """A function that records for recorded numbers, and is the original one for all others."""

    def __init__(self, original: Callable[..., Any], function: Callable[..., Any]) -> None:
        self._original, self._function = original, function

    def __call__(self, *inputs: object, **options: object) -> Any:
        if recorded(*inputs) is None:
            return self._original(*inputs, **options)
        if options.get("out") is not None or options.get("where") is not None:
            raise Unrecordable("it calls a function of NumPy with out= or where=")
        return self._function(*inputs)

    def __getattr__(self, name: str) -> Any:
        return getattr(self._original, name)


def _most(choose: Callable[[Any, Any], Any], original: Callable[..., Any]) -> Callable[..., Any]:
    """Return ``max`` or ``min`` of recorded numbers: a selection, no decision."""

    def chosen(*values: Any, **options: Any) -> Any:
        listed = list(values[0]) if len(values) == 1 else list(values)
        if recorded(*listed) is None or options:
            return original(listed, **options)
        return functools.reduce(choose, listed)

    return chosen


def _maker(original: Callable[..., Any]) -> Callable[..., Any]:
    """Return a function of NumPy that makes arrays of floating-point numbers; they can hold recorded ones."""
    converts = original in _CONVERTERS

    def make(*given: Any, **options: Any) -> Any:
        if recorded(*given) is not None:
            if converts:
                return numbers(np.array(given[0], dtype=object))
            if original in FUNCTIONS:
                return FUNCTIONS[original](*given, **options)
            return numbers(np.broadcast_to(np.array(given[1], dtype=object), given[0]).copy())  # np.full of a recorded number
        made = original(*given, **options)
        wide = options.get("dtype") in (None, float, np.float64, complex, np.complex128)
        return numbers(made) if made.dtype.kind in "fc" and wide and not converts else made

    return make


class _Kind(type):
    """The class of the stand-ins of ``float`` and ``complex``: recorded numbers are among their ``kinds``."""

    kinds: tuple[type, ...]
    of: Callable[..., Any]

    def __call__(cls, *values: object) -> Any:
        return cls.of(*values)

    def __instancecheck__(cls, value: object) -> bool:
        return isinstance(value, cls.kinds)


class _Float(metaclass=_Kind):
    kinds = float, Number
    of = staticmethod(lambda value=0.0: value if recorded(value) is not None else float(value))


class _Complex(metaclass=_Kind):
    kinds = complex, ComplexNumber
    of = staticmethod(lambda x=0.0, y=0.0: complex(x, y) if recorded(x, y) is None else x + 1j * y)


#: Functions of recorded numbers by the functions that they stand for: operations under their own names, and others.
_OF_NUMBERS: dict[Any, Callable[..., Any]] = {getattr(math, name): operation(name) for name in TABLE if hasattr(math, name)}
_OF_NUMBERS |= {
    math.log: lambda x, base=math.e: operation("log")(x) if base == math.e else operation("log")(x) / operation("log")(base),
    math.hypot: lambda *xs: operation("hypot")(*xs) if len(xs) == 2 else operation("sqrt")(scalar_product(xs, xs)),
    math.dist: lambda p, q: FUNCTIONS[np.linalg.norm]([a - b for a, b in zip(p, q)]), math.pow: UFUNCS["power"], math.fabs: abs,
    math.copysign: lambda x, y: abs(x) * operation("sign")(operation("sign")(y) + 0.5),
    math.radians: UFUNCS["radians"], math.degrees: UFUNCS["degrees"], math.ldexp: lambda x, n: x * 2.0**n,
    math.isfinite: UFUNCS["isfinite"], math.isnan: UFUNCS["isnan"],
    math.fmod: lambda x, y: x - y * operation("trunc")(x / y), cmath.phase: FUNCTIONS[np.angle],
    cmath.rect: lambda r, phi: r * (operation("cos")(phi) + 1j * operation("sin")(phi)),
}  # fmt: skip
_OF_NUMBERS |= {getattr(cmath, name): lambda z, name=name: function_of_complex(name, complex_number(z.tape, z))
                for name, each in TABLE.items() if each.pair}  # fmt: skip
#: Functions of NumPy that make an array of what they are given, and those that make a new one.
_CONVERTERS = (np.array, np.asarray, np.asanyarray, np.ascontiguousarray)
_MAKERS = (np.zeros, np.empty, np.ones, np.full, np.zeros_like, np.empty_like, np.ones_like, np.full_like, *_CONVERTERS)
#: What stands for functions that take ordinary numbers only.
_STAND_INS: dict[Any, Any] = {
    **FUNCTIONS, **{original: _Either(original, own) for original, own in _OF_NUMBERS.items()},
    **{each: _maker(each) for each in _MAKERS}, max: _most(largest, max), min: _most(smallest, min),
    float: _Float, np.float64: _Float, complex: _Complex, np.complex128: _Complex,
}  # fmt: skip
#: Built-in functions that have a stand-in, by name.
_BUILTINS = {each.__name__: _STAND_INS[each] for each in (max, min, float, complex)}
