"""Users' functions that cannot be recorded, evaluated in Python: values and derivatives in the place of a recording.

A function that takes arrays of places instead of numbers is called once for all of them. Derivatives are differences with an
estimated error.
"""

from __future__ import annotations

import contextlib
import copy
import warnings
from collections.abc import Callable, Sequence
from typing import Any, NamedTuple

import numpy as np

from contin import checks
from contin.arrays import Array, Function, Indices
from contin.errors import InterpretedWarning, ProblemError, warn
from contin.functions import round_off
from contin.functions.signature import Signature, named_values

#: First length of differences, relative to the size of an input, of first and of higher derivatives, which are differences of
#: differences. Errors of fourth order and of round-off are below 1e-11, or 1e-8, where a function changes over such a size.
_DIFFERENCE, _NESTED = 2e-4, 2e-3
#: Least size of an input that counts for first derivatives: nearer to zero its size is not known, and one is tried. For higher
#: derivatives it is one at least: a shorter length may hide them behind the round-off of the lower ones, and all is zero.
_LEAST = 1e-4
#: Differences of second and of fourth order that differ by a larger part of the derivative are taken again over a shorter
#: length. Ten times larger, the error of fourth order may be 1e-8.
_ROUGH = 1e-5
#: Factor of that length, and how often. Nine times an eighth reach features 1e-9 times as wide as their input.
_SHORTER = 1 / 8
_TIMES = 9
#: Differences of second and of fourth order agree within the round-off of the values where they differ by this multiple of it.
#: A derivative that is zero, of a function that rounds once, gives 1.
_WITHIN = 4.0
#: Weights of f(x + k h), k = 1, 2, less those of f(x - k h), in the derivative of fourth order.
_WEIGHTS = (8 / 12, -1 / 12)
#: Places beside the first one where the ways to evaluate a function are compared.
_PLACES = 3
#: Their distance, relative to 1 + |x|.
_ASIDE = 0.1


class _Estimated(NamedTuple):
    """Values of functions, or derivatives, shape (places, count), and their round-off at each place."""

    values: Array
    errors: Array


def _rounded(values: Array) -> _Estimated:
    """Return values with their round-off."""
    return _Estimated(values, np.finfo(float).eps * np.abs(values).max(axis=1, initial=0.0))


class Interpreted:
    """Functions evaluated in Python, for `contin.functions.batch.Batch`.

    Attributes
    ----------
    reason : str
        Why the functions are not recorded.
    error : float
        Largest estimated error of a derivative so far, relative to the largest derivative at its place and to the values over
        the sizes of the inputs.
    """

    def __init__(self, functions: Sequence[Function], counts: Sequence[int], signature: Signature, reason: str) -> None:
        self._functions, self._counts, self._signature, self.reason = tuple(functions), tuple(counts), signature, reason
        self._tuples = [None if names is None else named_values(tuple(names)) for names in signature.arguments]
        self._fills = [signature.fills(function) for function in self._functions]
        self._for_arrays: dict[int, bool] = {}
        self._said = False
        self._sizes: tuple[Array, Array] | None = None
        self.error = 0.0

    def sized(self, inputs: Array, values: Array) -> Interpreted:
        """Return the same functions of inputs divided by sizes, with their values divided by theirs."""
        found = copy.copy(self)
        found._sizes = inputs, values
        return found

    def values(self, t: Array, u: Array, v: Array, p: Array) -> Array:
        """Return the values, shape (places, count)."""
        return self._values(t, self._joined(u, v, p))

    def jacobian(self, t: Array, u: Array, v: Array, p: Array, inputs: Indices) -> tuple[Array, Array]:
        """Return values and derivatives by ``inputs``, shape (places, count, inputs)."""
        x = self._joined(u, v, p)
        slopes = [self._along(t, x, [np.broadcast_to(unit, x.shape)]).values for unit in np.eye(x.shape[1])[inputs]]
        if slopes and not self._said:
            self._said = True
            self._say()
        return self._values(t, x), np.stack(slopes, axis=2) if slopes else np.zeros((len(x), self._count, 0))

    def entries(
        self, t: Array, u: Array, v: Array, p: Array, inputs: Indices, rows: Indices, places: Indices
    ) -> tuple[Array, Array]:
        """Return the values at one place, and the derivatives of the values ``rows`` by the inputs in the columns
        ``places``."""
        values, jacobian = self.jacobian(t, u, v, p, inputs)
        return values[0], jacobian[0, rows, places]

    def entries_of(self, inputs: Sequence[int]) -> tuple[Indices, Indices]:
        """Return values and columns of the entries of the Jacobian, all of which may differ from zero."""
        rows, columns = np.indices((self._count, len(inputs))).reshape(2, -1)
        return rows, columns

    def along(self, t: Array, u: Array, v: Array, p: Array, directions: Sequence[Array]) -> Array:
        """Return the derivative of the values along directions, shape (places, count)."""
        x = self._joined(u, v, p)
        return self._along(t, x, [np.broadcast_to(direction, x.shape) for direction in directions]).values

    def jacobian_along(self, t: Array, u: Array, v: Array, p: Array, inputs: Indices, directions: Sequence[Array]) -> Array:
        """Return the derivative of the Jacobian along directions, shape (places, count, inputs)."""
        x = self._joined(u, v, p)
        given = [np.broadcast_to(direction, x.shape) for direction in directions]
        found = [self._along(t, x, [np.broadcast_to(unit, x.shape), *given]).values for unit in np.eye(x.shape[1])[inputs]]
        return np.stack(found, axis=2) if found else np.zeros((len(x), self._count, 0))

    def _joined(self, u: Array, v: Array, p: Array) -> Array:
        return np.hstack([*([u, v] if self._signature.ends else [u]), np.tile(p, (len(u), 1))])

    def _say(self) -> None:
        names = " and ".join(self._name(index) for index in range(len(self._functions)))
        how = f"differences (an estimated error of {self.error:.0e})"
        text = f"{names} is evaluated in Python, 10 to 1000 times as slow as recorded, with derivatives by {how}: {self.reason}"
        warn(text, InterpretedWarning)

    # --- derivatives ---------------------------------------------------------------------------------------------

    def _along(self, t: Array, x: Array, directions: Sequence[Array]) -> _Estimated:
        """Return derivatives along directions."""
        if not directions:
            return _rounded(self._values(t, x))
        *others, last = directions

        def inner(t: Array, x: Array, places: Indices) -> _Estimated:
            return self._along(t, x, [direction[places] for direction in others])

        return self._difference(inner, t, x, last, nested=bool(others))

    def _difference(
        self,
        function: Callable[[Array, Array, Indices], _Estimated],
        t: Array,
        x: Array,
        direction: Array,
        nested: bool = False,
    ) -> _Estimated:
        """Return the derivative of a function along a direction, by differences as long as its error estimate allows.

        ``function`` takes times and inputs of some places, and the numbers of these places. A shorter length is not tried where
        the differences of second and of fourth order agree within the round-off of the values.
        """
        moving, at, first = direction != 0, np.abs(np.where(np.isfinite(x), x, 0.0)), _NESTED if nested else _DIFFERENCE
        sizes = np.maximum(at, 1.0) if nested else np.where(at < _LEAST, 1.0, at)
        length = first * np.where(moving, sizes / np.where(moving, np.abs(direction), 1.0), np.inf).min(axis=1)
        length = np.where(np.isfinite(length), length, first)
        best, errors, least = np.zeros((len(x), self._count)), np.zeros(len(x)), np.full(len(x), np.inf)
        known, size, left = np.full(len(x), np.inf), length / first, np.arange(len(x))
        for _ in range(_TIMES + 1):
            h = length[left, None]
            step = h * direction[left]
            ends = [function(t[left], x[left] + k * step, left) for k in (1, -1, 2, -2)]
            with np.errstate(all="ignore"):
                sides = ends[0].values - ends[1].values, ends[2].values - ends[3].values
                fourth = sum(weight * side for weight, side in zip(_WEIGHTS, sides)) / h
                noise = np.max([end.errors for end in ends], axis=0, initial=0.0) / h[:, 0]
                scale = np.abs(fourth).max(axis=1, initial=0.0) + 1e-300
                gap = np.abs(fourth - sides[0] / (2 * h)).max(axis=1, initial=0.0)
                rough = (gap + noise) / scale
                done = (rough <= _ROUGH) | (gap <= _WITHIN * noise)
                usual = np.max([np.abs(end.values).max(axis=1, initial=0.0) for end in ends], axis=0, initial=0.0) / size[left]
            better = rough < least[left]
            chosen = left[better]
            best[chosen], errors[chosen], least[chosen] = fourth[better], noise[better], rough[better]
            gap, noise = (gap / (scale + usual))[better], (noise / (scale + usual))[better]  # a derivative may be zero
            known[chosen] = np.minimum(gap, gap**2 / _ROUGH) + noise
            best[left[~np.isfinite(rough) & ~np.isfinite(least[left])]] = np.nan
            left = left[~done]
            if not left.size:
                break
            length = length * _SHORTER
        if len(x):
            self.error = max(self.error, float(known[np.isfinite(known)].max(initial=0.0)))
        return _Estimated(best, errors)

    @property
    def _count(self) -> int:
        return sum(max(count, 1) for count in self._counts)

    # --- values --------------------------------------------------------------------------------------------------

    def _values(self, t: Array, x: Array) -> Array:
        """Return the values, shape (places, count), for inputs x (places, inputs)."""
        columns = []
        if self._sizes is not None:
            x = x * self._sizes[0]
        with np.errstate(all="ignore"), warnings.catch_warnings():
            warnings.simplefilter("ignore", np.exceptions.ComplexWarning)
            for index in range(len(self._functions)):
                columns.append(self._function_values(index, t, x))
        shapes = [(len(x), max(count, 1)) for count in self._counts]
        found = np.hstack([column.reshape(shape) for column, shape in zip(columns, shapes)])
        if np.iscomplexobj(found):  # Python's (-1.0) ** 0.5 is complex: it has no real value
            found = np.where(found.imag == 0, found.real, np.nan)
        if self._sizes is not None:
            found = found / self._sizes[1]
        if round_off.SEED:
            found = np.array(found, dtype=float)
            round_off.move(found)
        return found

    def _function_values(self, index: int, t: Array, x: Array) -> Array:
        if len(x) > 1 and self._takes_arrays(index, t, x):
            with contextlib.suppress(ArithmeticError, ValueError):  # it has no value at one of the places
                return self._at_all(index, t, x)
        return np.array([self._at_one(index, time, place) for time, place in zip(t, x)])

    def _takes_arrays(self, index: int, t: Array, x: Array) -> bool:
        """Return whether a function gives the same for arrays of places as for one after the other."""
        if index not in self._for_arrays:
            places = _beside(x[:1])
            times = np.repeat(t[:1], len(places))
            try:
                together = self._at_all(index, times, places)
                single = np.array([self._at_one(index, time, place) for time, place in zip(times, places)])
                self._for_arrays[index] = bool(np.allclose(together, single, rtol=1e-12, atol=0, equal_nan=True))
            except Exception:  # a function of numbers may raise anything
                self._for_arrays[index] = False
        return self._for_arrays[index]

    def _at_all(self, index: int, t: Array, x: Array) -> Array:
        """Return the values of a function called once with arrays of places, shape (places, count)."""
        count = max(self._counts[index], 1)
        result = self._called(index, t, np.ascontiguousarray(x.T), (count, len(x)))
        rows = result if self._counts[index] or self._fills[index] else (result,)
        return np.stack([np.broadcast_to(np.asarray(row), (len(x),)) for row in rows], axis=1)

    def _at_one(self, index: int, t: Any, x: Array) -> Array:
        """Return the values of a function at one place; NaN where they are not defined."""
        count = max(self._counts[index], 1)
        numbers = x if self._fills[index] else x.tolist()
        try:
            result = np.asarray(self._called(index, float(t), numbers, (count,))).reshape(-1)
            if result.size != count or result.dtype.kind not in "iufcb":
                raise ProblemError(f"{self._name(index)} returned {checks.shown(result)}, must be {count} numbers")
            return result
        except ArithmeticError:
            return np.full(count, np.nan)
        except ValueError as error:
            if "domain" in str(error):  # that of Python's math
                return np.full(count, np.nan)
            raise

    def _name(self, index: int) -> str:
        function = self._functions[index]
        return str(getattr(function, "__name__", None) or checks.shown(function))

    def _called(self, index: int, t: Any, x: Any, shape: tuple[int, ...]) -> Any:
        """Call a function with t, and groups of the inputs x as named tuples; or as arrays, if it fills one."""
        function, place, arguments = self._functions[index], 0, []
        fills = self._fills[index]
        for kind in self._tuples:
            if kind is None:
                arguments.append(t)
                continue
            group = x[place : place + len(kind._fields)]
            place += len(kind._fields)
            arguments.append(group if fills else kind(*group))
        if not fills:
            return function(*arguments)
        result = np.zeros(shape, dtype=np.asarray(x).dtype)
        function(*arguments, result)
        return result


def _beside(x: Array) -> Array:
    """Return the place x (1, inputs) and some beside it."""
    random = np.random.default_rng(7)
    x = np.nan_to_num(x)
    aside = _ASIDE * (1 + np.abs(x)) * random.uniform(0.2, 1.0, (_PLACES, x.shape[1]))
    return np.vstack([x, x + aside])
