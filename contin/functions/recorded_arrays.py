"""NumPy on recorded numbers: arrays of them, and the functions of NumPy that become operations of a tape.

`Numbers` is an array of objects, so that indexing, slices, `np.concatenate`, `np.roll` and their like work as they are.
Universal functions become operations for each element. Sums, scalar products, and products with constant matrices (dense, or
sparse ones of SciPy) become one operation for each result.
"""

from __future__ import annotations

import functools
import math
import operator
from collections.abc import Callable, Sequence
from typing import Any

import numpy as np

from contin.functions.primitives import TABLE
from contin.functions.recorded_complex import ComplexNumber, complex_number, function_of_complex, is_complex, part
from contin.functions.tables import Table
from contin.functions.tape import Number, Tape, Unrecordable, power


class Numbers(np.ndarray):
    """An array of recorded and ordinary numbers."""

    def __array_ufunc__(self, ufunc: Any, method: str, *inputs: Any, **options: Any) -> Any:
        return ufunc_of_numbers(ufunc, method, inputs, options)

    def __array_function__(self, function: Any, types: Any, inputs: Any, options: Any) -> Any:
        return function_of_numbers(function, inputs, options)

    def dot(self, other: Any, out: Any = None) -> Any:
        """Return the product with a vector or matrix."""
        return matrix_product(self, other)

    @property  # type: ignore[misc]
    def real(self) -> Any:
        """The real parts."""
        return _parts(self, "real")

    @property  # type: ignore[misc]
    def imag(self) -> Any:
        """The imaginary parts."""
        return _parts(self, "imag")

    def conj(self) -> Any:
        """Return the conjugate numbers."""
        return _parts(self, "conjugate")

    conjugate = conj


def numbers(values: Any) -> Any:
    """Return an array of objects as `Numbers`."""
    if isinstance(values, np.ndarray) and values.dtype == object:
        return values.view(Numbers)
    array = np.empty(np.shape(values), dtype=object)
    array[...] = values
    return array.view(Numbers)


def recorded(*values: Any) -> Number | ComplexNumber | None:
    """Return the first recorded number among values and the elements of arrays, lists and tuples; None without any."""
    for value in values:
        if isinstance(value, (Number, ComplexNumber)):
            return value
        if isinstance(value, (list, tuple)):
            found = recorded(*value)
        elif isinstance(value, np.ndarray) and value.dtype == object:
            found = next((each for each in value.flat if isinstance(each, (Number, ComplexNumber))), None)
        else:
            continue
        if found is not None:
            return found
    return None


def elementwise(function: Callable[..., Any], *inputs: Any) -> Any:
    """Return a function of numbers applied to arrays, broadcast; a number for numbers."""
    if not any(isinstance(value, (np.ndarray, list, tuple)) for value in inputs):
        return function(*(value.item() if isinstance(value, np.generic) else value for value in inputs))
    arrays = np.broadcast_arrays(*(_plain(value) for value in inputs))
    result = np.empty(arrays[0].shape, dtype=object)
    flat = [array.ravel() for array in arrays]
    result.ravel()[:] = [function(*values) for values in zip(*(each.tolist() for each in flat))] or np.empty(0, dtype=object)
    return result.view(Numbers) if result.ndim else result.item()


def _plain(value: Any) -> Any:
    """Return an array without our own class, so that NumPy's functions act on it as they are."""
    if isinstance(value, (Number, ComplexNumber)):
        array = np.empty((), dtype=object)
        array[()] = value
        return array
    if isinstance(value, Numbers):
        return value.view(np.ndarray)
    if isinstance(value, (list, tuple)) and recorded(value) is not None:
        return numbers(_nested(value)).view(np.ndarray)
    return np.asarray(value)


def _nested(value: Any) -> Any:
    """Return a list of lists of numbers as an array of objects."""
    if isinstance(value, (list, tuple)):
        parts = [_nested(part) for part in value]
        shapes = {np.shape(part) for part in parts}
        if len(shapes) != 1:
            raise Unrecordable("it makes an array of lists of different lengths")
        result = np.empty((len(parts), *shapes.pop()), dtype=object)
        for place, part in enumerate(parts):
            result[place] = part
        return result
    return value.view(np.ndarray) if isinstance(value, Numbers) else value


# --- functions of numbers -----------------------------------------------------------------------------------------------


def operation(name: str) -> Callable[..., Any]:
    """Return the function of numbers that records an operation, and computes it for ordinary numbers."""

    def apply(*values: Any) -> Any:
        if any(map(is_complex, values)):
            return function_of_complex(name, *values[:1])
        tape = _tape(values)
        if tape is None:
            scratch = Tape()
            return scratch.apply(name, *values).known
        return tape.apply(name, *values)

    return apply


def _tape(values: Sequence[Any]) -> Tape | None:
    found = recorded(*values)
    return None if found is None else found.tape


def select(condition: Any, a: Any, b: Any) -> Any:
    """Return a where a condition holds, else b."""
    tape = _tape((condition, a, b))
    if tape is None or not isinstance(condition, Number):
        return a if condition else b
    if is_complex(a) or is_complex(b):
        a, b = complex_number(tape, a), complex_number(tape, b)
        return ComplexNumber(tape, select(condition, a.real, b.real), select(condition, a.imag, b.imag))
    return tape.apply("select", condition, a, b)


def largest(a: Any, b: Any) -> Any:
    """Return the larger of two numbers, the first of equal ones."""
    return select(a < b, b, a)


def smallest(a: Any, b: Any) -> Any:
    """Return the smaller of two numbers, the first of equal ones."""
    return select(b < a, b, a)


def _parts(values: Any, name: str) -> Any:
    """Return a part of every number, or its conjugate."""
    return elementwise(lambda value: part(value, name), values)


def _power(a: Any, b: Any) -> Any:
    if is_complex(a) or is_complex(b):
        return a**b
    if isinstance(a, Number):
        return power(a, b)
    return power(b.tape.number(a), b) if isinstance(b, Number) else a**b


def _scaled(factor: float) -> Callable[[Any], Any]:
    return lambda a: a * factor


#: Universal functions of NumPy and SciPy by name, as functions of numbers: those of the tape, and what is made of others.
UFUNCS: dict[str, Callable[..., Any]] = {each.ufunc: operation(name) for name, each in TABLE.items() if each.ufunc}
UFUNCS |= {
    "add": operator.add, "subtract": operator.sub, "multiply": operator.mul, "divide": operator.truediv,
    "floor_divide": operator.floordiv, "remainder": operator.mod, "power": _power, "float_power": _power,
    "negative": operator.neg, "positive": operator.pos, "absolute": abs, "fabs": abs, "square": lambda a: a * a,
    "reciprocal": lambda a: 1.0 / a, "maximum": largest, "fmax": largest, "minimum": smallest, "fmin": smallest,
    "less": operator.lt, "less_equal": operator.le, "greater": operator.gt, "greater_equal": operator.ge,
    "equal": operator.eq, "not_equal": operator.ne, "logical_not": lambda a: select(a == 0, 1.0, 0.0),
    "logical_and": lambda a, b: select(a, select(b, 1.0, 0.0), 0.0),
    "logical_or": lambda a, b: select(a, 1.0, select(b, 1.0, 0.0)),
    "bitwise_and": operator.and_, "bitwise_or": operator.or_, "invert": operator.invert,
    "conjugate": lambda a: part(a, "conjugate"),
    "heaviside": lambda a, b: select(a < 0, 0.0, select(a == 0, b, 1.0)), "clip": lambda a, low, high: clip(a, low, high),
    "deg2rad": _scaled(math.pi / 180), "radians": _scaled(math.pi / 180),
    "rad2deg": _scaled(180 / math.pi), "degrees": _scaled(180 / math.pi),
    "isfinite": lambda a: abs(a) < math.inf, "isnan": lambda a: a != a,
    "logaddexp": lambda a, b: largest(a, b) + operation("log1p")(operation("exp")(-abs(a - b))),
    "psi": lambda a: a.tape.apply("polygamma", a, data=0), "expit": lambda a: 1.0 / (1.0 + operation("exp")(-a)),
}  # fmt: skip


def clip(a: Any, low: Any = None, high: Any = None) -> Any:
    """Return a number within bounds."""
    a = a if low is None else largest(a, low)
    return a if high is None else smallest(a, high)


def ufunc_of_numbers(ufunc: Any, method: str, inputs: Sequence[Any], options: dict[str, Any]) -> Any:
    """Return a universal function of recorded numbers.

    Raises
    ------
    Unrecordable
        A function that the tape does not know.
    """
    if ufunc.__name__ in ("matmul", "vecdot") and method == "__call__":
        return _stored(matrix_product(*inputs), options)
    function = UFUNCS.get(ufunc.__name__)
    if function is None:
        raise Unrecordable(f"it calls {ufunc.__name__}, which cannot be differentiated")
    if method == "__call__":
        return _stored(elementwise(function, *inputs), options)
    if method == "reduce":
        return _reduced(ufunc.__name__, function, inputs[0], options)
    if method == "outer":
        a, b = (_plain(value) for value in inputs)
        return elementwise(function, a.reshape(a.shape + (1,) * b.ndim), b)
    if method == "accumulate":
        values = _plain(inputs[0]).tolist()
        for place in range(1, len(values)):
            values[place] = function(values[place - 1], values[place])
        return numbers(values)
    raise Unrecordable(f"it calls {ufunc.__name__}.{method}")


def _stored(result: Any, options: dict[str, Any]) -> Any:
    """Return the result, in the array ``out`` where one is given."""
    out = options.get("out")
    if not out:
        return result
    target = out[0]
    if target.dtype != object:
        raise Unrecordable("it stores recorded numbers in an array of another kind")
    target.view(np.ndarray)[...] = _plain(result)
    return target


def _reduced(name: str, function: Callable[..., Any], array: Any, options: dict[str, Any]) -> Any:
    """Return the reduction of an array along one axis, or of all of it."""
    array, axis = _plain(array), options.get("axis", 0)
    if axis is None:
        array, axis = array.ravel(), 0
    if isinstance(axis, tuple):
        kept = [place for place in range(array.ndim) if place not in {each % array.ndim for each in axis}]
        array = np.transpose(array, [*kept, *axis]).reshape([array.shape[place] for place in kept] + [-1])
        axis = -1
    moved = np.moveaxis(array, axis, -1)
    result = np.empty(moved.shape[:-1], dtype=object)
    initial = options.get("initial", np._NoValue)
    for place in np.ndindex(result.shape):
        values = moved[place].tolist() + ([] if initial is np._NoValue or initial is None else [initial])
        result[place] = total(values) if name == "add" else functools.reduce(function, values)
    if options.get("keepdims"):
        result = np.expand_dims(result, axis)
    return _stored(result.view(Numbers) if result.ndim else result.item(), options)


def total(values: Sequence[Any]) -> Any:
    """Return a sum as one operation."""
    tape = _tape(values)
    if tape is None:
        return sum(values)
    if any(map(is_complex, values)):
        return functools.reduce(operator.add, values)
    known = [value for value in values if not isinstance(value, Number)]
    terms = [value for value in values if isinstance(value, Number)]
    constant = math.fsum(map(float, known))
    terms += [tape.number(constant)] if constant else []
    return terms[0] if len(terms) == 1 else tape.apply("sum", *terms)


# --- products with matrices ---------------------------------------------------------------------------------------------


def matrix_product(a: Any, b: Any) -> Any:
    """Return the product of two arrays, of one or two dimensions, at least one of recorded numbers."""
    a, b = _plain(a), _plain(b)
    if a.ndim == 1 and b.ndim == 1:
        return scalar_product(a.tolist(), b.tolist())
    if a.ndim > 2 or b.ndim > 2 or not a.ndim or not b.ndim:
        raise Unrecordable("it multiplies arrays of more than two dimensions")
    rows, columns = (a if a.ndim == 2 else a[None]), (b if b.ndim == 2 else b[:, None])
    found = np.empty((len(rows), columns.shape[1]), dtype=object)
    listed, others = rows.tolist(), columns.T.tolist()
    for i, row in enumerate(listed):
        for j, column in enumerate(others):
            found[i, j] = scalar_product(row, column)
    found = found if a.ndim == 2 else found[0]
    return (found if b.ndim == 2 else found[..., 0]).view(Numbers)


def scalar_product(a: Sequence[Any], b: Sequence[Any]) -> Any:
    """Return the scalar product of two lists as one operation."""
    if len(a) != len(b):
        raise ValueError(f"vectors of {len(a)} and {len(b)} numbers have no product")
    tape = _tape([*a, *b])
    if tape is None or any(map(is_complex, [*a, *b])):
        return sum(x * y for x, y in zip(a, b))
    if any(isinstance(x, Number) and isinstance(y, Number) for x, y in zip(a, b)):
        return tape.number(0.0) if not a else (a[0] * b[0] if len(a) == 1 else tape.apply("dot", *a, *b))
    pairs = [(x, y) if isinstance(y, Number) else (y, x) for x, y in zip(a, b)]
    return linear(tape, [(float(factor), value) for factor, value in pairs])


def linear(tape: Tape, terms: Sequence[tuple[float, Any]]) -> Number:
    """Return a sum with constant factors as one operation."""
    constant = math.fsum(factor * float(value) for factor, value in terms if not isinstance(value, Number))
    terms = [(factor, value) for factor, value in terms if factor != 0 and isinstance(value, Number)]
    if not terms:
        return tape.number(constant)
    factors, values = tuple(factor for factor, _ in terms), [value for _, value in terms]
    result = terms[0][1] * terms[0][0] if len(terms) == 1 else tape.apply("linear", *values, data=factors)
    return result + constant if constant else result


class SparseConstant:
    """A constant sparse matrix that is multiplied by recorded numbers."""

    def __init__(self, matrix: Any) -> None:
        self._matrix = matrix
        self._rows = matrix.tocsr()

    def __getattr__(self, name: str) -> Any:
        return getattr(self._matrix, name)

    @property
    def T(self) -> SparseConstant:  # noqa: N802  the name that NumPy has
        """The transposed matrix."""
        return SparseConstant(self._matrix.T)

    def __matmul__(self, vector: Any) -> Any:
        tape = _tape((vector,))
        if tape is None:
            return self._matrix @ vector
        given, rows = _plain(vector), self._rows
        if given.ndim != 1 or given.size != rows.shape[1]:
            raise ValueError(f"a matrix of shape {rows.shape} times an array of shape {given.shape}")
        values, result = given.tolist(), np.empty(rows.shape[0], dtype=object)
        mixed = rows.dtype.kind == "c" or any(map(is_complex, values))
        for i, (first, last) in enumerate(zip(rows.indptr, rows.indptr[1:])):
            terms = list(zip(rows.data[first:last].tolist(), rows.indices[first:last].tolist()))
            result[i] = (
                sum(factor * values[j] for factor, j in terms)
                if mixed
                else linear(tape, [(factor, values[j]) for factor, j in terms])
            )
        return result.view(Numbers)

    def dot(self, vector: Any) -> Any:
        """Return the product with a vector."""
        return self @ vector

    def __rmatmul__(self, vector: Any) -> Any:
        return self.T @ vector

    def __mul__(self, factor: Any) -> Any:
        return self.dot(factor) if recorded(factor) is not None and np.ndim(factor) else NotImplemented


# --- functions of NumPy -------------------------------------------------------------------------------------------------


def function_of_numbers(function: Any, inputs: Any, options: dict[str, Any]) -> Any:
    """Return a function of NumPy of recorded numbers: one of `FUNCTIONS`, or NumPy's own on arrays of objects."""
    own = FUNCTIONS.get(function)
    if own is not None:
        return own(*inputs, **options)
    inputs, options = _without_class(inputs), {name: _without_class(value) for name, value in options.items()}
    result = function(*inputs, **options)
    return _with_class(result)


def _without_class(value: Any) -> Any:
    if isinstance(value, (Number, ComplexNumber, Numbers)):
        return _plain(value)
    if type(value) in (list, tuple):
        return type(value)(_without_class(part) for part in value)
    return value


def _with_class(value: Any) -> Any:
    if isinstance(value, np.ndarray) and value.dtype == object:
        return value.view(Numbers) if value.ndim else value.item()
    if isinstance(value, (list, tuple)):
        return type(value)(_with_class(part) for part in value) if type(value) in (list, tuple) else value
    return value


def _where(condition: Any, a: Any = None, b: Any = None) -> Any:
    if a is None or b is None:
        raise Unrecordable("it asks where a condition holds")
    return elementwise(select, condition, a, b)


def _norm(x: Any, ord: Any = None, axis: Any = None, keepdims: bool = False) -> Any:  # noqa: A002  NumPy's name
    values = _plain(x)
    if axis is not None or keepdims or (ord not in (None, 2) or (ord == 2 and values.ndim != 1)):
        raise Unrecordable("it calls np.linalg.norm with an order or an axis")
    listed = values.ravel().tolist()
    if any(map(is_complex, listed)):
        listed = [each for value in listed for each in (value.real, value.imag)]
    return operation("sqrt")(scalar_product(listed, listed))


def _interp(x: Any, xp: Any, fp: Any, left: Any = None, right: Any = None, period: Any = None) -> Any:
    if period is not None or recorded(xp, fp) is not None:
        raise Unrecordable("np.interp has a period, or knots that are no constants")
    table = Table.linear(xp, fp, left, right)
    return elementwise(lambda value: _tabulated(table, value), x)


def _tabulated(table: Table, value: Any) -> Any:
    return value.tape.apply("table", value, data=table) if isinstance(value, Number) else table.evaluate(value)


def tabulated(table: Table) -> Callable[[Any], Any]:
    """Return a piecewise polynomial as a function of numbers and arrays."""
    return lambda x: elementwise(lambda value: _tabulated(table, value), x)


def _clip(a: Any, a_min: Any = None, a_max: Any = None, **options: Any) -> Any:
    low, high = options.get("min", a_min), options.get("max", a_max)
    return elementwise(lambda value: clip(value, low, high), a)


def _cross(a: Any, b: Any) -> Any:
    x, y = _plain(a).tolist(), _plain(b).tolist()
    if len(x) != 3 or len(y) != 3:
        raise Unrecordable("it calls np.cross for arrays that are no vectors of three numbers")
    return numbers([x[1] * y[2] - x[2] * y[1], x[2] * y[0] - x[0] * y[2], x[0] * y[1] - x[1] * y[0]])


def _polyval(p: Any, x: Any) -> Any:
    x = numbers(_plain(x)) if isinstance(x, (list, tuple)) else x
    result = 0.0 * x
    for coefficient in list(p):
        result = result * x + coefficient
    return result


def _reduction(name: str) -> Callable[..., Any]:
    """Return a function of NumPy that reduces an array by a universal function, along an axis or all of it."""
    return lambda a, axis=None, **options: _reduced(name, UFUNCS[name], a, {"axis": axis, **options})


def _mean(a: Any, axis: Any = None, **options: Any) -> Any:
    array = _plain(a)
    axes = range(array.ndim) if axis is None else ([axis] if isinstance(axis, int) else axis)
    return _reduced("add", UFUNCS["add"], array, {"axis": axis, **options}) / math.prod(array.shape[each] for each in axes)


def _like(value: Any) -> Callable[..., Any]:
    def make(a: Any, *given: Any, **options: Any) -> Any:
        array = np.empty(np.shape(_plain(a)), dtype=object)
        array[...] = given[0] if given else value
        return array.view(Numbers)

    return make


#: Functions of NumPy that are not universal, and are written for recorded numbers here.
FUNCTIONS: dict[Any, Callable[..., Any]] = {
    np.where: _where, np.linalg.norm: _norm, np.interp: _interp, np.clip: _clip, np.cross: _cross, np.dot: matrix_product,
    np.vdot: lambda a, b: scalar_product(np.ravel(_plain(_parts(a, "conjugate"))).tolist(), _plain(b).ravel().tolist()),
    np.inner: matrix_product, np.polyval: _polyval, np.zeros_like: _like(0.0), np.ones_like: _like(1.0),
    np.empty_like: _like(0.0), np.full_like: _like(0.0),
    np.sum: _reduction("add"), np.prod: _reduction("multiply"), np.mean: _mean, np.max: _reduction("maximum"),
    np.min: _reduction("minimum"), np.amax: _reduction("maximum"), np.amin: _reduction("minimum"),
    np.any: _reduction("logical_or"), np.all: _reduction("logical_and"),
    np.real: lambda a: _parts(a, "real"), np.imag: lambda a: _parts(a, "imag"),
    np.angle: lambda z: elementwise(lambda value: operation("atan2")(value.imag, value.real), z),
    np.asarray: lambda a, *_, **__: numbers(_plain(a)),
}  # fmt: skip


#: Operations of complex numbers by the names of those of real ones.
_OPERATORS: dict[str, Callable[[Any, Any], Any]] = {
    "add": operator.add, "sub": operator.sub, "mul": operator.mul, "div": operator.truediv, "pow": operator.pow,
    "eq": operator.eq,
}  # fmt: skip


class NumPy:
    """NumPy for recorded numbers, as a `Tape` has it."""

    universal = staticmethod(ufunc_of_numbers)
    function = staticmethod(function_of_numbers)

    @staticmethod
    def complex_operation(name: str, a: Any, b: Any) -> Any:
        """Return an operation of a recorded and a complex number."""
        function = _OPERATORS.get(name)
        if function is None:
            raise Unrecordable("it orders complex numbers")
        tape = _tape((a, b))
        assert tape is not None
        return function(complex_number(tape, a), complex_number(tape, b))


NUMPY = NumPy()
