"""Which outputs of a user's function depend on which inputs: it is called with numbers that remember where they come from.

What it finds holds for all values, or nothing is claimed: a number that remembers cannot be compared, nor made an index or an
ordinary number, so that a function which decides by its arguments cannot be called, and counts as depending on everything.
"""

from __future__ import annotations

import math
import numbers
import types
from collections import namedtuple
from collections.abc import Sequence
from typing import Any

import numpy as np

from contin.arrays import Function, Pattern
from contin.functions.rewriting import Prepared

#: With more inputs than this it is not worth the time.
_MOST = 500


class _Trace:
    """A number of unknown value that remembers which inputs it was made from, as the bits of ``sources``."""

    __slots__ = ("sources",)

    def __init__(self, sources: int) -> None:
        self.sources = sources

    def _with(self, other: Any) -> Any:
        if isinstance(other, _Trace):
            return _Trace(self.sources | other.sources)
        return self if isinstance(other, numbers.Number) else NotImplemented

    def _alone(self) -> _Trace:
        return self

    def _refuse(self, *_: object) -> Any:
        raise TypeError("a number of unknown value")

    __add__ = __radd__ = __sub__ = __rsub__ = __mul__ = __rmul__ = __truediv__ = __rtruediv__ = __pow__ = __rpow__ = _with
    arctan2 = hypot = _with
    __neg__ = __pos__ = _alone
    sqrt = exp = expm1 = log = log1p = log10 = sin = cos = tan = sinh = cosh = tanh = _alone
    arcsin = arccos = arctan = arcsinh = arccosh = arctanh = _alone
    __eq__ = __ne__ = __lt__ = __le__ = __gt__ = __ge__ = __bool__ = __hash__ = _refuse


class _Plain(Prepared):
    """Functions left as they are, for a call in Python."""

    def _made(self, copy: types.FunctionType) -> Any:
        if getattr(copy.__code__, "co_exceptiontable", b""):
            raise TypeError("a function that catches exceptions may go on after one of ours")
        return copy


def dependencies(
    functions: Sequence[Function],
    counts: Sequence[int],
    states: Sequence[str],
    parameters: Sequence[str],
    ends: bool,
    times: bool,
) -> Pattern:
    """Which values depend on which inputs, shape (sum of counts, states [twice with ``ends``] + parameters).

    The arguments are those of `contin.compilation.Batch`. All true where a function cannot be traced.
    """
    n, k = len(states), len(parameters)
    inputs = n * (2 if ends else 1) + k
    total = sum(max(count, 1) for count in counts)
    everything = np.ones((total, inputs), dtype=bool)
    if inputs > _MOST:
        return everything
    marks = [_Trace(1 << slot) for slot in range(inputs)]
    given: list[tuple[Any, list[_Trace]]] = [
        (namedtuple("U", states), marks[:n]),
        (namedtuple("P", parameters), marks[inputs - k :]),
    ]  # noqa: PYI024
    if ends:
        given.insert(1, (given[0][0], marks[n : 2 * n]))
    rows: list[int] = []
    try:
        for function, count in zip(functions, counts):
            plain = _Plain().function(function)
            filled = plain.__code__.co_argcount == len(given) + times + 1
            arguments: list[Any] = [_Trace(0)] if times else []
            arguments += [np.array(values, dtype=object) if filled else kind(*values) for kind, values in given]
            if filled:
                result = np.zeros(count, dtype=object)
                plain(*arguments, result)
            else:
                result = plain(*arguments)
            values = list(result) if count else [result]
            if len(values) != max(count, 1):
                return everything
            rows += [_sources(value) for value in values]
    except Exception:  # whatever a function does that needs to know its arguments
        return everything
    return np.array([[bool(row >> slot & 1) for slot in range(inputs)] for row in rows]).reshape(total, inputs)


def _sources(value: Any) -> int:
    if isinstance(value, _Trace):
        return value.sources
    if isinstance(value, numbers.Number) and math.isfinite(abs(value)):  # type: ignore[arg-type]
        return 0
    raise TypeError(f"{value!r} is not a number")
