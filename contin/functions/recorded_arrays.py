"""NumPy on recorded numbers: arrays of them, and the functions of NumPy that become operations of a tape.

`Numbers` is an array of objects, so that indexing, slices, `np.concatenate`, `np.roll` and their like work as they are.
Universal functions become operations for each element. Sums, scalar products, and products with constant matrices (dense, or
sparse ones of SciPy) become one operation for each result.
"""

from __future__ import annotations

import functools
import itertools
import math
import operator
from collections.abc import Callable, Iterable, Mapping, Sequence
from typing import Any

import numpy as np

from contin.functions.primitives import TABLE
from contin.functions.recorded_complex import ComplexNumber, complex_number, function_of_complex, is_complex, part
from contin.functions.tape import Number, Table, Tape, Unrecordable, power

#: Largest matrix of recorded numbers that is inverted: masses of two or three bodies. Cofactors of four rows are 40 terms.
_LARGEST_INVERSE = 3
#: Operands of operations. Arrays of objects may hold complex numbers as well.
Scalar = Number | float
#: A recorded number of any kind.
_RECORDED = (Number, ComplexNumber)


class Numbers(np.ndarray):
    """An array of recorded and ordinary numbers."""

    def __array_ufunc__(self, ufunc: np.ufunc, method: str, *inputs: object, **options: object) -> Any:
        return ufunc_of_numbers(ufunc, method, inputs, options)

    def __array_function__(
        self, function: Callable[..., Any], types: object, inputs: Iterable[Any], options: Mapping[str, Any]
    ) -> Any:
        return function_of_numbers(function, inputs, options)

    def dot(self, other: object, out: None = None) -> Any:  # type: ignore[override]
        """Return the product with a vector or matrix."""
        return matrix_product(self, other)

    @property  # type: ignore[misc]
    def real(self) -> Any:
        """The real parts."""
        return _parts("real")(self)

    @property  # type: ignore[misc]
    def imag(self) -> Any:
        """The imaginary parts."""
        return _parts("imag")(self)

    def conj(self) -> Any:
        """Return the conjugate numbers."""
        return _parts("conjugate")(self)

    conjugate = conj


def numbers(values: object) -> Any:
    """Return an array of objects as `Numbers`."""
    return np.asarray(values, dtype=object).view(Numbers)


def recorded(*values: object) -> Number | ComplexNumber | None:
    """Return the first recorded number among values and the elements of arrays, lists and tuples; None without any."""
    for value in values:
        if isinstance(value, _RECORDED):
            return value
        if isinstance(value, (list, tuple)):
            found = recorded(*value)
        elif isinstance(value, np.ndarray) and value.dtype == object:
            found = next((each for each in value.flat if isinstance(each, _RECORDED)), None)
        else:
            continue
        if found is not None:
            return found
    return None


def elementwise(function: Callable[..., Any], *inputs: object) -> Any:
    """Return a function of numbers applied to arrays, broadcast; a number for numbers."""
    if not any(isinstance(value, (np.ndarray, list, tuple)) for value in inputs):
        return function(*(value.item() if isinstance(value, np.generic) else value for value in inputs))
    arrays = np.broadcast_arrays(*map(_plain, inputs))
    result = np.empty(arrays[0].shape, dtype=object)
    result.ravel()[:] = [function(*values) for values in zip(*(array.ravel().tolist() for array in arrays))] or result.ravel()
    return _with_class(result)


def _plain(value: object) -> np.ndarray[Any, Any]:
    """Return an array without our own class, so that NumPy's functions act on it as they are."""
    if isinstance(value, Numbers):
        return value.view(np.ndarray)
    return np.array(value, dtype=object) if recorded(value) is not None else np.asarray(value)


def _with_class(value: Any) -> Any:
    """Return arrays of objects as `Numbers`, those of no dimension as a number; lists and tuples of them as well."""
    if isinstance(value, np.ndarray) and value.dtype == object:
        return value.view(Numbers) if value.ndim else value.item()
    return type(value)(map(_with_class, value)) if type(value) in (list, tuple) else value


# --- functions of numbers -----------------------------------------------------------------------------------------------


def operation(name: str) -> Callable[..., Any]:
    """Return the function of numbers that records an operation, and computes it for ordinary numbers."""

    def apply(*values: object) -> Any:
        if any(map(is_complex, values)):
            return function_of_complex(name, *values[:1])
        tape = _tape(values)
        return Tape().apply(name, *values).known if tape is None else tape.apply(name, *values)

    return apply


def _tape(values: Sequence[object]) -> Tape | None:
    found = recorded(*values)
    return None if found is None else found.tape


def select(condition: Scalar, a: object, b: object) -> Any:
    """Return a where a condition holds, else b."""
    tape = _tape((condition, a, b))
    if tape is None or not isinstance(condition, Number):
        return a if condition else b
    if is_complex(a) or is_complex(b):
        a, b = complex_number(tape, a), complex_number(tape, b)
        return ComplexNumber(tape, select(condition, a.real, b.real), select(condition, a.imag, b.imag))
    return tape.apply("select", condition, a, b)


def largest(a: Scalar, b: Scalar) -> Any:
    """Return the larger of two numbers, the first of equal ones."""
    return select(a < b, b, a)


def smallest(a: Scalar, b: Scalar) -> Any:
    """Return the smaller of two numbers, the first of equal ones."""
    return select(b < a, b, a)


def _parts(name: str) -> Callable[[object], Any]:
    """Return the function that takes a part of every number, or its conjugate."""
    return lambda values: elementwise(lambda value: part(value, name), values)


def _power(a: Any, b: Any) -> Any:
    if isinstance(a, Number) and not is_complex(b):
        return power(a, b)
    return power(b.tape.number(a), b) if isinstance(b, Number) and not is_complex(a) else a**b


def _scaled(factor: float) -> Callable[[Scalar], Any]:
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
    "heaviside": lambda a, b: select(a < 0, 0.0, select(a == 0, b, 1.0)),
    "clip": lambda a, low, high: smallest(largest(a, low), high),
    "deg2rad": _scaled(math.pi / 180), "radians": _scaled(math.pi / 180),
    "rad2deg": _scaled(180 / math.pi), "degrees": _scaled(180 / math.pi),
    "isfinite": lambda a: abs(a) < math.inf, "isnan": lambda a: a != a,
    "logaddexp": lambda a, b: largest(a, b) + operation("log1p")(operation("exp")(-abs(a - b))),
    "psi": lambda a: a.tape.apply("polygamma", a, data=0), "expit": lambda a: 1.0 / (1.0 + operation("exp")(-a)),
}  # fmt: skip


def ufunc_of_numbers(ufunc: np.ufunc, method: str, inputs: Sequence[object], options: dict[str, Any]) -> Any:
    """Return a universal function of recorded numbers; raise Unrecordable for a function that the tape does not know."""
    name = ufunc.__name__
    if name in ("matmul", "vecdot") and method == "__call__":
        return _stored(matrix_product(*inputs), **options)
    function = UFUNCS.get(name)
    if function is None:
        raise Unrecordable(f"it calls {name}, which cannot be differentiated")
    if method == "__call__":
        return _stored(elementwise(function, *inputs), **options)
    if method == "reduce":
        return _reduced(name, inputs[0], **{"axis": 0, **options})
    if method == "outer":
        a, b = map(_plain, inputs)
        return elementwise(function, a.reshape(a.shape + (1,) * b.ndim), b)
    if method == "accumulate":
        return numbers(list(itertools.accumulate(_plain(inputs[0]).tolist(), function)))
    raise Unrecordable(f"it calls {name}.{method}")


def _stored(result: object, out: tuple[np.ndarray[Any, Any], ...] | None = None, **_: object) -> Any:
    """Return the result, in the array ``out`` where one is given."""
    if not out:
        return result
    if out[0].dtype != object:
        raise Unrecordable("it stores recorded numbers in an array of another kind")
    out[0].view(np.ndarray)[...] = _plain(result)
    return out[0]


def _reduced(
    name: str, values: object, axis: int | Sequence[int] | None = None, *, keepdims: bool = False, initial: object = None,
    **options: Any,
) -> Any:  # fmt: skip
    """Return the reduction of an array by a universal function, along axes or of all of it."""
    array = _plain(values)
    axes = tuple(range(array.ndim)) if axis is None else tuple(np.atleast_1d(axis) % array.ndim)
    kept = [extent for place, extent in enumerate(array.shape) if place not in axes]
    moved = np.moveaxis(array, axes, range(len(kept), array.ndim)).reshape(*kept, -1)
    result, first = np.empty(kept, dtype=object), [] if initial is np._NoValue or initial is None else [initial]
    for place in np.ndindex(*kept):
        terms = moved[place].tolist() + first
        result[place] = total(terms) if name == "add" else functools.reduce(UFUNCS[name], terms)
    return _stored(_with_class(np.expand_dims(result, axes) if keepdims else result), **options)


def total(values: Sequence[Any]) -> Any:
    """Return a sum as one operation."""
    tape = _tape(values)
    if tape is None:
        return sum(values)
    if any(map(is_complex, values)):
        return functools.reduce(operator.add, values)
    terms = [value for value in values if isinstance(value, Number)]
    constant = math.fsum(float(value) for value in values if not isinstance(value, Number))
    terms += [tape.number(constant)] if constant else []
    return terms[0] if len(terms) == 1 else tape.apply("sum", *terms)


# --- products with matrices ---------------------------------------------------------------------------------------------


def matrix_product(a: object, b: object) -> Any:
    """Return the product of two arrays, of one or two dimensions, at least one of recorded numbers."""
    x, y = _plain(a), _plain(b)
    if x.ndim > 2 or y.ndim > 2 or not x.ndim or not y.ndim:
        raise Unrecordable("it multiplies arrays of more than two dimensions")
    columns = np.atleast_2d(y.T).tolist()
    found = [[scalar_product(row, column) for column in columns] for row in np.atleast_2d(x).tolist()]
    return _with_class(np.array(found, dtype=object).reshape(x.shape[:-1] + y.shape[1:]))


def scalar_product(a: Sequence[Any], b: Sequence[Any]) -> Any:
    """Return the scalar product of two lists as one operation."""
    if len(a) != len(b):
        raise ValueError(f"vectors of {len(a)} and {len(b)} numbers have no product")
    tape = _tape([*a, *b])
    if tape is None or any(map(is_complex, [*a, *b])):
        return sum(x * y for x, y in zip(a, b))
    if any(isinstance(x, Number) and isinstance(y, Number) for x, y in zip(a, b)):
        return a[0] * b[0] if len(a) == 1 else tape.apply("dot", *a, *b)
    pairs = [(x, y) if isinstance(y, Number) else (y, x) for x, y in zip(a, b)]
    return linear(tape, [(float(factor), value) for factor, value in pairs])


def linear(tape: Tape, terms: Sequence[tuple[float, Scalar]]) -> Number:
    """Return a sum with constant factors as one operation."""
    constant = math.fsum(factor * value for factor, value in terms if not isinstance(value, Number))
    moving = [(factor, value) for factor, value in terms if factor != 0 and isinstance(value, Number)]
    if not moving:
        return tape.number(constant)
    factors, values = zip(*moving)
    result: Number = values[0] * factors[0] if len(moving) == 1 else tape.apply("linear", *values, data=factors)
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

    def __matmul__(self, vector: object) -> Any:
        tape = _tape((vector,))
        if tape is None:
            return self._matrix @ vector
        given, rows = _plain(vector), self._rows
        if given.ndim != 1 or given.size != rows.shape[1]:
            raise ValueError(f"a matrix of shape {rows.shape} times an array of shape {given.shape}")
        values, factors, columns = given.tolist(), rows.data.tolist(), rows.indices.tolist()
        mixed = rows.dtype.kind == "c" or any(map(is_complex, values))
        found = []
        for first, last in itertools.pairwise(rows.indptr.tolist()):
            terms = [(factors[k], values[columns[k]]) for k in range(first, last)]
            found.append(sum(factor * value for factor, value in terms) if mixed else linear(tape, terms))
        return numbers(found)

    def dot(self, vector: object) -> Any:
        """Return the product with a vector."""
        return self @ vector

    def __rmatmul__(self, vector: object) -> Any:
        return self.T @ vector

    def __mul__(self, factor: object) -> Any:
        many = isinstance(factor, (np.ndarray, list, tuple)) and recorded(factor) is not None
        return self.dot(factor) if many else NotImplemented


# --- functions of NumPy -------------------------------------------------------------------------------------------------


def function_of_numbers(function: Callable[..., Any], inputs: Iterable[Any], options: Mapping[str, Any]) -> Any:
    """Return a function of NumPy of recorded numbers: one of `FUNCTIONS`, or NumPy's own on arrays of objects."""
    own = FUNCTIONS.get(function)
    if own is not None:
        return own(*inputs, **options)
    return _with_class(function(*map(_without_class, inputs), **{name: _without_class(each) for name, each in options.items()}))


def _without_class(value: Any) -> Any:
    if isinstance(value, (*_RECORDED, Numbers)):
        return _plain(value)
    return type(value)(map(_without_class, value)) if type(value) in (list, tuple) else value


def _where(condition: object, *sides: object) -> Any:
    if not sides:
        raise Unrecordable("it asks where a condition holds")
    return elementwise(select, condition, *sides)


def _norm(x: object, ord: object = None, axis: object = None, keepdims: bool = False) -> Any:  # noqa: A002  NumPy's name
    values = _plain(x)
    if axis is not None or keepdims or (ord not in (None, 2) or (ord == 2 and values.ndim != 1)):
        raise Unrecordable("it calls np.linalg.norm with an order or an axis")
    listed = values.ravel().tolist()
    if any(map(is_complex, listed)):
        listed = [each for value in listed for each in (value.real, value.imag)]
    return operation("sqrt")(scalar_product(listed, listed))


def _determinant(matrix: object) -> Any:
    rows = _square(matrix, "det")
    if len(rows) == 1:
        return rows[0][0]
    minors = ([row[:j] + row[j + 1 :] for row in rows[1:]] for j in range(len(rows)))
    return sum((-1) ** j * rows[0][j] * _determinant(minor) for j, minor in enumerate(minors))


def _inverse(matrix: object) -> Any:
    rows = _square(matrix, "inv")
    if recorded(rows) is None:
        return np.linalg.inv(np.array(rows, dtype=float))
    count, by = len(rows), 1.0 / _determinant(rows)
    found = [[by for _ in rows] for _ in rows]
    for i, j in itertools.product(range(count), range(count)):
        minor = [row[:j] + row[j + 1 :] for k, row in enumerate(rows) if k != i]
        found[j][i] = (-1) ** (i + j) * (_determinant(minor) if minor else 1.0) * by
    return numbers(found)


def _square(matrix: object, name: str) -> list[list[Any]]:
    """Return the rows of a matrix; one of recorded numbers has three at most: the terms of larger determinants cancel."""
    given = _plain(matrix)
    if given.ndim != 2 or given.shape[0] != given.shape[1]:
        raise ValueError(f"np.linalg.{name} of an array of shape {given.shape}")
    if recorded(given) is not None and len(given) > _LARGEST_INVERSE:
        raise Unrecordable(
            f"it calls np.linalg.{name} or np.linalg.solve for a matrix of more than {_LARGEST_INVERSE} rows that varies"
        )
    return given.tolist()


def _solved(a: object, b: object) -> Any:
    return matrix_product(_inverse(a), b)


def _interp(
    x: object, xp: object, fp: object, left: float | None = None, right: float | None = None, period: None = None
) -> Any:
    if period is not None or recorded(xp, fp) is not None:
        raise Unrecordable("np.interp has a period, or knots that are no constants")
    return tabulated(Table.linear(xp, fp, left, right))(x)


def tabulated(table: Table) -> Callable[[object], Any]:
    """Return a piecewise polynomial as a function of numbers and arrays."""

    def at(value: Scalar) -> Scalar:
        return value.tape.apply("table", value, data=table) if isinstance(value, Number) else table.evaluate(value)

    return lambda x: elementwise(at, x)


def _clip(a: object, a_min: object = None, a_max: object = None, **options: Any) -> Any:
    low, high = options.get("min", a_min), options.get("max", a_max)
    a = a if low is None else elementwise(largest, a, low)
    return a if high is None else elementwise(smallest, a, high)


def _cross(a: object, b: object) -> Any:
    x, y = _plain(a).tolist(), _plain(b).tolist()
    if len(x) != 3 or len(y) != 3:
        raise Unrecordable("it calls np.cross for arrays that are no vectors of three numbers")
    return numbers([x[1] * y[2] - x[2] * y[1], x[2] * y[0] - x[0] * y[2], x[0] * y[1] - x[1] * y[0]])


def _polyval(p: Sequence[Any], x: Any) -> Any:
    x = numbers(x) if isinstance(x, (list, tuple)) else x
    return functools.reduce(lambda result, coefficient: result * x + coefficient, list(p), 0.0 * x)


def _reduction(name: str) -> Callable[..., Any]:
    """Return a function of NumPy that reduces an array by a universal function."""
    return functools.partial(_reduced, name)


def _mean(a: object, *axis: Any, **options: Any) -> Any:
    found = _reduced("add", a, *axis, **options)
    return found / (_plain(a).size // max(np.size(found), 1))


def _like(value: float) -> Callable[..., Any]:
    return lambda a, *given, **options: numbers(np.full(_plain(a).shape, given[0] if given else value, dtype=object))


#: Functions of NumPy that are not universal, and are written for recorded numbers here.
FUNCTIONS: dict[Any, Callable[..., Any]] = {
    np.where: _where, np.linalg.norm: _norm, np.linalg.det: _determinant, np.linalg.inv: _inverse, np.linalg.solve: _solved,
    np.select: lambda conditions, choices, default=0.0: functools.reduce(
        lambda other, pair: _where(*pair, other), reversed([*zip(conditions, choices)]), default),
    np.interp: _interp, np.clip: _clip, np.cross: _cross, np.dot: matrix_product,
    np.vdot: lambda a, b: scalar_product(_plain(_parts("conjugate")(a)).ravel().tolist(), _plain(b).ravel().tolist()),
    np.inner: matrix_product, np.polyval: _polyval, np.zeros_like: _like(0.0), np.ones_like: _like(1.0),
    np.empty_like: _like(0.0), np.full_like: _like(0.0),
    np.sum: _reduction("add"), np.prod: _reduction("multiply"), np.mean: _mean, np.any: _reduction("logical_or"),
    np.all: _reduction("logical_and"), **dict.fromkeys((np.max, np.amax), _reduction("maximum")),
    **dict.fromkeys((np.min, np.amin), _reduction("minimum")),
    np.real: _parts("real"), np.imag: _parts("imag"),
    np.angle: lambda z: elementwise(lambda value: operation("atan2")(value.imag, value.real), z),
    np.asarray: lambda a, *_, **__: numbers(_plain(a)),
}  # fmt: skip


#: Operations of complex numbers by the names of those of real ones.
_OPERATORS = {"sub": operator.sub, "div": operator.truediv} | {
    name: vars(operator)[name] for name in ("add", "mul", "pow", "eq")
}


class NumPy:
    """NumPy for recorded numbers, as a `Tape` has it."""

    universal = staticmethod(ufunc_of_numbers)
    function = staticmethod(function_of_numbers)

    @staticmethod
    def complex_operation(name: str, a: object, b: object) -> Any:
        """Return an operation of a recorded and a complex number."""
        function = _OPERATORS.get(name)
        if function is None:
            raise Unrecordable("it orders complex numbers")
        tape = _tape((a, b))
        assert tape is not None
        return function(complex_number(tape, a), complex_number(tape, b))


NUMPY = NumPy()
