"""Users' functions that cannot be compiled, evaluated in Python: values and derivatives in the place of a compiled kernel.

A function that takes arrays of places instead of numbers is called once for all of them. Derivatives are taken with the complex
step where that agrees with differences at a few places, else with differences of fourth order.
"""

from __future__ import annotations

import contextlib
import sys
import warnings
from collections.abc import Sequence
from typing import Any

import numpy as np

from contin import checks
from contin.arrays import Array, Function, Indices
from contin.errors import InterpretedWarning, ProblemError
from contin.functions.signature import Signature, named_values

#: What names of this package's modules begin with.
_PACKAGE = __name__.partition(".")[0] + "."
#: The complex step: small enough that its square is nothing.
_STEP = 1e-30
#: Length of differences relative to the largest value of an input so far, and the least of these values that counts: at a zero
#: of an input its size is not known. Errors of fourth order and of round-off are below 1e-11.
_DIFFERENCE, _LEAST = 2e-4, 1e-4
#: Weights of f(x + k h), k = 1, 2, less those of f(x - k h), in the derivative of fourth order.
_WEIGHTS = (8 / 12, -1 / 12)
#: Places beside the first one where the ways to evaluate a function are compared, their distance, and how well they must agree.
_PLACES, _ASIDE, _AGREES = 3, 0.1, 1e-6


class Interpreted:
    """What is called in place of the kernel of a `Batch`, with the same arguments."""

    def __init__(self, functions: Sequence[Function], counts: Sequence[int], signature: Signature, reason: str) -> None:
        self._functions, self._counts, self._signature, self._reason = tuple(functions), tuple(counts), signature, reason
        self._tuples = [None if names is None else named_values(tuple(names)) for names in signature.arguments]
        self._for_arrays: dict[int, bool] = {}
        self._complex: bool | None = None
        self._sizes = np.zeros(signature.inputs)

    def __call__(self, *given: Any) -> None:
        """Fill the last two of (t, u, v, p, inputs, owner, work, out, jac): values and, where it has room, the Jacobian."""
        t, u, v, p, inputs, owner, _, out, jac = given
        groups = [u, v] if self._signature.ends else [u]
        x = np.hstack([*groups, np.tile(p, (len(u), 1))])
        self._sizes = np.maximum(self._sizes, np.where(np.isfinite(x), np.abs(x), 0.0).max(axis=0, initial=0.0))
        out[:] = self._values(t, x)
        if not jac.size:
            return
        if self._complex is None:
            self._complex = self._takes_complex(t[:1], x[:1])
            self._say()
        jac[:] = 0.0
        rows = np.arange(out.shape[1])
        for colour in range(len(owner)):
            mine = owner[colour] >= 0
            slots = inputs[inputs[colour] : inputs[colour + 1]]
            for together in [slots] if self._complex else slots[:, None]:  # differences have a length for each input
                change = self._derivative(t, x, together, self._complex)
                jac[:, rows[mine], owner[colour][mine]] += change[:, mine]

    def _say(self) -> None:
        names = " and ".join(self._name(index) for index in range(len(self._functions)))
        how = "the complex step" if self._complex else "differences (an error of about 1e-11)"
        text = (
            f"{names} is evaluated in Python, 10 to 1000 times as slow as compiled, with derivatives by {how}: {self._reason}"
        )
        warnings.warn(text, InterpretedWarning, stacklevel=_users_level())

    # --- derivatives ---------------------------------------------------------------------------------------------

    def _derivative(self, t: Array, x: Array, slot: Indices, by_complex_step: bool) -> Array:
        """Return the derivatives of all values by one input, shape (places, count), or by several that share no value."""
        if by_complex_step:
            z = x.astype(complex)
            z[:, slot] += 1j * _STEP
            return self._values(t, z).imag / _STEP
        h = _DIFFERENCE * max(float(self._sizes[slot].max()), _LEAST)
        change = np.zeros((len(x), self._count))
        for k, weight in enumerate(_WEIGHTS, start=1):
            for sign in (1, -1):
                moved = x.copy()
                moved[:, slot] += sign * k * h
                change += sign * weight * self._values(t, moved)
        return change / h

    @property
    def _count(self) -> int:
        return sum(max(count, 1) for count in self._counts)

    def _takes_complex(self, t: Array, x: Array) -> bool:
        """Return whether the complex step agrees with differences at this place and some beside it."""
        places, agreed = _beside(x), 0
        times = np.repeat(t, len(places))
        try:
            for slot in np.arange(x.shape[1])[:, None]:
                difference = self._derivative(times, places, slot, False)
                known = np.all(np.isfinite(difference), axis=1)
                step = self._derivative(times[known], places[known], slot, True)
                scale = 1 + np.abs(difference[known])
                if not np.all(np.abs(step - difference[known]) <= _AGREES * scale):
                    return False
                agreed += int(known.sum())
        except Exception:  # a function for real numbers may raise anything
            return False
        return agreed > 0

    # --- values --------------------------------------------------------------------------------------------------

    def _values(self, t: Array, x: Array) -> Array:
        """Return the values, shape (places, count), for real or complex inputs x (places, inputs)."""
        columns = []
        with np.errstate(all="ignore"), warnings.catch_warnings():
            warnings.simplefilter("ignore", np.exceptions.ComplexWarning)
            for index in range(len(self._functions)):
                columns.append(self._function_values(index, t, x))
        shapes = [(len(x), max(count, 1)) for count in self._counts]
        return np.hstack([column.reshape(shape) for column, shape in zip(columns, shapes)])

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
        rows = result if self._counts[index] or self._signature.fills(self._functions[index]) else (result,)
        return np.stack([np.broadcast_to(np.asarray(row), (len(x),)) for row in rows], axis=1)

    def _at_one(self, index: int, t: Any, x: Array) -> Array:
        """Return the values of a function at one place; NaN where they are not defined."""
        count = max(self._counts[index], 1)
        numbers = x if self._signature.fills(self._functions[index]) else x.tolist()
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
        fills = self._signature.fills(function)
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


def _users_level() -> int:
    """Return the number of calls from here up to code outside the package."""
    frame, level = sys._getframe(1), 1
    while frame.f_back is not None and frame.f_globals.get("__name__", "").startswith(_PACKAGE):
        frame, level = frame.f_back, level + 1
    return level


def _beside(x: Array) -> Array:
    """Return the place x (1, inputs) and some beside it, of the real parts."""
    random = np.random.default_rng(7)
    x = np.nan_to_num(x.real)
    aside = _ASIDE * (1 + np.abs(x)) * random.uniform(0.2, 1.0, (_PLACES, x.shape[1]))
    return np.vstack([x, x + aside])
