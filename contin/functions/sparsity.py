"""Sparsity pattern: the inputs that each value of a user's function depends on, found by calling it with tracing numbers.

A tracing number has no value; it knows the inputs that it was made from. The pattern holds for all values of the inputs: a
tracing number cannot be compared, nor become an index or an ordinary number, so a function that decides by its arguments
fails and counts as depending on everything.
"""

from __future__ import annotations

import math
import numbers
import types
from collections.abc import Sequence
from typing import Any

import numpy as np

from contin.arrays import Function, Pattern
from contin.functions.complex_step import RealFunctions, analytic, makers, stand_in_of
from contin.functions.pointwise import parts
from contin.functions.signature import Signature, named_values, result_count

#: With more inputs the pattern is not looked for: it would take a gigabyte.
_MOST_INPUTS = 30_000


class _TracingNumber:
    """A number of unknown value; ``sources`` has a bit for each input that it was made from."""

    __slots__ = ("sources",)

    def __init__(self, sources: int) -> None:
        self.sources = sources

    def _with(self, other: Any) -> Any:
        if isinstance(other, _TracingNumber):
            return _TracingNumber(self.sources | other.sources)
        return self if isinstance(other, numbers.Number) else NotImplemented

    def _alone(self) -> _TracingNumber:
        return self

    def _refuse(self, *_: object) -> Any:
        raise TypeError("a tracing number has no value")

    __add__ = __radd__ = __sub__ = __rsub__ = __mul__ = __rmul__ = __truediv__ = __rtruediv__ = __pow__ = __rpow__ = _with
    arctan2 = hypot = _with
    __neg__ = __pos__ = _alone
    sqrt = exp = expm1 = log = log1p = log10 = sin = cos = tan = sinh = cosh = tanh = _alone
    arcsin = arccos = arctan = arcsinh = arccosh = arctanh = _alone
    __eq__ = __ne__ = __lt__ = __le__ = __gt__ = __ge__ = __bool__ = __hash__ = _refuse


#: What functions call to make an array that they fill.
_OBJECT_MAKERS = makers(object)


class _TracedMatrix:
    """A sparse matrix that is multiplied by tracing numbers: each product has the sources of its row's entries."""

    def __init__(self, matrix: Any) -> None:
        self._rows = matrix.tocsr()

    def __matmul__(self, vector: Any) -> Any:
        given, rows = np.asarray(vector, dtype=object), self._rows
        if given.ndim != 1:
            raise TypeError("a traced matrix is multiplied by vectors only")
        result = np.empty(rows.shape[0], dtype=object)
        for i, (first, last) in enumerate(zip(rows.indptr, rows.indptr[1:])):
            result[i] = _TracingNumber(0)
            for j in rows.indices[first:last]:
                result[i] = result[i] + given[j]
        return result

    dot = __matmul__


class _Traceable(RealFunctions):
    """Functions for a call in Python: with numpy's functions in place of those of ``math``, which want ordinary numbers."""

    def finished(self, copy: types.FunctionType) -> Any:
        """Return the function, unless it could catch what a tracing number raises and go on."""
        if getattr(copy.__code__, "co_exceptiontable", b""):
            raise TypeError("a function that catches exceptions cannot be traced")
        return copy

    def stand_in(self, value: Any) -> Any:
        """Return the stand-in that compiled code has, too; arrays that the function fills hold tracing numbers."""
        if type(value).__module__.startswith("scipy.sparse") and hasattr(value, "tocsr"):
            return _TracedMatrix(value)
        return analytic(value) or stand_in_of(value, _OBJECT_MAKERS)


def sparsity_pattern(functions: Sequence[Function], counts: Sequence[int], signature: Signature) -> Pattern:
    """Return which values depend on which inputs, shape (sum of counts, inputs); all true where a function cannot be traced.

    ``counts`` are the numbers of values of the functions, 0 for a bare number, as in `contin.functions.batch.Batch`.
    """
    inputs, total = signature.inputs, sum(max(count, 1) for count in counts)
    everything = np.ones((total, inputs), dtype=bool)
    if inputs > _MOST_INPUTS:
        return everything
    rows: list[int] = []
    try:
        for function, count in zip(functions, counts):
            values = _traced(function, count, signature)
            if len(values) != max(count, 1):
                return everything
            rows += [_sources(value) for value in values]
    except Exception:  # the function needed to know a value; it may have raised anything
        return everything
    length = inputs // 8 + 1
    bits = np.frombuffer(b"".join(row.to_bytes(length, "little") for row in rows), dtype=np.uint8).reshape(total, length)
    pattern: Pattern = np.unpackbits(bits, axis=1, count=inputs, bitorder="little").astype(bool)
    return pattern


def _traced(function: Function, count: int, signature: Signature) -> list[Any]:
    """Return the values of a function called with tracing numbers."""
    marks = iter([_TracingNumber(1 << slot) for slot in range(signature.inputs)])
    fills = signature.fills(function)
    arguments: list[Any] = []
    for names in signature.arguments:
        if names is None:
            arguments.append(_TracingNumber(0))
            continue
        values = [next(marks) for _ in names]
        arguments.append(np.array(values, dtype=object) if fills else named_values(tuple(names))(*values))
    function, solve = parts(function)
    if solve is not None:  # it decides by the numbers that it is given: what it finds depends on all of them
        found = result_count(solve, signature.arguments, "a search at a point")
        arguments.append((_TracingNumber((1 << signature.inputs) - 1),) * found)
    traceable = _Traceable().function(function)
    if fills:
        result = np.zeros(count, dtype=object)
        traceable(*arguments, result)
        return list(result)
    result = traceable(*arguments)
    return list(result) if count else [result]


def _sources(value: Any) -> int:
    if isinstance(value, _TracingNumber):
        return value.sources
    if isinstance(value, numbers.Number) and math.isfinite(abs(value)):  # type: ignore[arg-type]
        return 0
    raise TypeError(f"{value!r} is not a number")
