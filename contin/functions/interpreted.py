"""Users' functions that cannot be recorded, evaluated in Python: values and derivatives in the place of a recording.

A function that takes arrays of places instead of numbers is called once for all of them. Derivatives are differences with an
estimated error.
"""

from __future__ import annotations

import contextlib
import copy
import warnings
from collections.abc import Hashable, Sequence
from typing import Any, NamedTuple

import numpy as np

from contin import checks
from contin.arrays import Array, Indices
from contin.errors import InterpretedWarning, ProblemError, warn
from contin.functions import round_off
from contin.functions.interpreter import Loaded
from contin.functions.recorded import Request
from contin.functions.signature import ABSENT, Signature, UserFunction

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
#: Distances from the first place of the places where the ways to evaluate a function are compared, relative to 1 + |x|. Nearer
#: ones would be the same for a function of their mean.
_ASIDE = np.array([0.0, 0.02, 0.05, 0.1])


class _Estimated(NamedTuple):
    """Values of functions, or derivatives, shape (places, count), and their round-off at each place."""

    values: Array
    errors: Array


class Interpreted:
    """Functions evaluated in Python, for `contin.functions.batch.Batch`.

    Attributes
    ----------
    reason : str
        Why the functions are not recorded.
    kept : dict
        What a batch has made for these functions.
    error : float
        Largest estimated error of a derivative so far, relative to the largest derivative at its place and to the values over
        the sizes of the inputs.
    """

    def __init__(self, functions: Sequence[UserFunction], signature: Signature, reason: str) -> None:
        self._functions, self._signature, self.reason = functions, signature, reason
        self._count = sum(function.size for function in functions)
        self._for_arrays: dict[UserFunction, bool] = {}
        self._said = False
        self._sizes: tuple[Array, Array] | None = None
        self.kept: dict[Hashable, Any] = {}
        self.error = 0.0

    def sized(self, inputs: Array, values: Array) -> Interpreted:
        """Return the same functions of inputs divided by sizes, with their values divided by theirs."""
        found = copy.copy(self)
        found._sizes = inputs, values
        return found

    def is_current(self) -> bool:
        """Return whether constants are those that the functions read: they are read at each call."""
        return True

    def describe(self) -> str:
        """Return one line: why the functions are evaluated in Python."""
        return f"evaluated in Python, because {self.reason}"

    def text(self, labels: Sequence[str], time: str) -> list[str]:
        """Raise ProblemError: there is no recording."""
        raise ProblemError(f"there is no text: {self.describe()}")

    def load(self, request: Request) -> Loaded:
        """Raise ProblemError: there is no program."""
        raise ProblemError(f"there is no program: {self.describe()}")

    def entries(self, inputs: tuple[int, ...]) -> tuple[Indices, Indices]:
        """Return values and columns of the entries of the Jacobian, all of which may differ from zero."""
        rows, columns = np.indices((self._count, len(inputs))).reshape(2, -1)
        return rows, columns

    def evaluate(
        self, request: Request, t: Array, u: Array, v: Array, p: Array, given: Sequence[Array] = ()
    ) -> tuple[Array, Array]:
        """Return values (places, count) and Jacobian, as `contin.functions.recorded.Recorded.evaluate`."""
        inputs, order, weighted, packed = request
        x = np.hstack([*([u, v] if self._signature.ends else [u]), np.tile(p, (len(u), 1))])
        directions = [np.broadcast_to(direction, x.shape) for direction in given[:order]]

        def along(*more: Array) -> Array:
            return self._along(t, x, [*(np.broadcast_to(unit, x.shape) for unit in more), *directions]).values

        values = along() if inputs is None or not order else np.empty((len(x), 0))
        if inputs is None:
            return values, np.empty((0, 0, 0))
        slopes = [along((np.arange(x.shape[1]) == number).astype(float)) for number in inputs]
        jacobian = np.stack(slopes, axis=2) if slopes else np.zeros((len(x), self._count, 0))
        if slopes and not order and not self._said:
            self._said = True
            self._say()
        if weighted:
            jacobian = np.einsum("ka,kaj->kj", given[order], jacobian)[:, None]
        return values, jacobian.reshape(len(x), 1, -1) if packed else jacobian

    def _say(self) -> None:
        names = " and ".join(function.name for function in self._functions)
        how = f"differences (an estimated error of {self.error:.0e})"
        text = f"{names} is evaluated in Python, 10 to 1000 times as slow as recorded, with derivatives by {how}: {self.reason}"
        warn(f"{text}; corners and jumps in it are not seen, and errors beside them are larger than stated", InterpretedWarning)

    # --- derivatives ---------------------------------------------------------------------------------------------

    def _along(self, t: Array, x: Array, directions: Sequence[Array]) -> _Estimated:
        """Return the derivative along directions, by differences as long as its error estimate allows.

        That along several is the difference of those along the others. A shorter length is not tried where the differences
        of second and of fourth order agree within the round-off of the values.
        """
        if not directions:
            values = self._values(t, x)
            return _Estimated(values, np.finfo(float).eps * np.abs(values).max(axis=1, initial=0.0))
        *others, direction = directions
        nested = bool(others)
        moving, at, first = direction != 0, np.abs(np.where(np.isfinite(x), x, 0.0)), _NESTED if nested else _DIFFERENCE
        sizes = np.maximum(at, 1.0) if nested else np.where(at < _LEAST, 1.0, at)
        length = first * np.where(moving, sizes / np.where(moving, np.abs(direction), 1.0), np.inf).min(axis=1)
        length = np.where(np.isfinite(length), length, first)
        best, errors, least = np.zeros((len(x), self._count)), np.zeros(len(x)), np.full(len(x), np.inf)
        known, size, left = np.full(len(x), np.inf), length / first, np.arange(len(x))
        for _ in range(_TIMES + 1):
            h = length[left, None]
            step = h * direction[left]
            ends = [self._along(t[left], x[left] + k * step, [other[left] for other in others]) for k in (1, -1, 2, -2)]
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

    # --- values --------------------------------------------------------------------------------------------------

    def _values(self, t: Array, x: Array) -> Array:
        """Return the values, shape (places, count), for inputs x (places, inputs)."""
        if self._sizes is not None:
            x = x * self._sizes[0]
        with np.errstate(all="ignore"), warnings.catch_warnings():
            warnings.simplefilter("ignore", np.exceptions.ComplexWarning)
            columns = [self._function_values(function, t, x) for function in self._functions]
        found = np.hstack([column.reshape(len(x), each.size) for column, each in zip(columns, self._functions)])
        if np.iscomplexobj(found):  # Python's (-1.0) ** 0.5 is complex: it has no real value
            found = np.where(found.imag == 0, found.real, np.nan)
        if self._sizes is not None:
            found = found / self._sizes[1]
        if round_off.SEED:
            found = np.array(found, dtype=float)
            round_off.move(found)
        return found

    def _function_values(self, function: UserFunction, t: Array, x: Array) -> Array:
        if len(x) > 1 and self._takes_arrays(function, t, x):
            with contextlib.suppress(*ABSENT):  # it has no value at one of the places
                return self._at_all(function, t, x)
        return np.array([self._at_one(function, time, place) for time, place in zip(t.tolist(), x)])

    def _takes_arrays(self, function: UserFunction, t: Array, x: Array) -> bool:
        """Return whether a function gives the same for arrays of places as for one after the other."""
        if function not in self._for_arrays:
            here = np.nan_to_num(x[0])
            places = here + np.outer(_ASIDE, 1 + np.abs(here))
            times = np.repeat(t[:1], len(places))
            try:
                together = self._at_all(function, times, places)
                single = np.array([self._at_one(function, time, place) for time, place in zip(times.tolist(), places)])
                self._for_arrays[function] = bool(np.allclose(together, single, rtol=1e-12, atol=0, equal_nan=True))
            except Exception:  # a function of numbers may raise anything
                self._for_arrays[function] = False
        return self._for_arrays[function]

    def _given(self, t: Any, x: Any) -> list[Any]:
        return [t, *x] if self._signature.times else list(x)

    def _at_all(self, function: UserFunction, t: Array, x: Array) -> Array:
        """Return the values of a function called once with arrays of places, shape (places, count)."""
        result = function.call(self._given(t, np.ascontiguousarray(x.T)), np.array, shape=(len(x),))
        rows = result if function.count or function.fills else (result,)
        return np.stack([np.broadcast_to(np.asarray(row), (len(x),)) for row in rows], axis=1)

    def _at_one(self, function: UserFunction, t: float, x: Array) -> Array:
        """Return the values of a function at one place; NaN where they are not defined."""
        try:
            result = np.asarray(function.call(self._given(t, x.tolist()), np.array)).reshape(-1)
            if result.size != function.size or result.dtype.kind not in "iufcb":
                raise ProblemError(f"{function.name} returned {checks.shown(result)}, must be {function.size} numbers")
            return result
        except ABSENT:
            return np.full(function.size, np.nan)
