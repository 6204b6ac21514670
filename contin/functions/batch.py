"""A user's functions evaluated at many points in one call, with exact derivatives, recorded or in Python.

The functions are recorded (`contin.functions.recording`), differentiated on the recording, and run by the interpreter. What
cannot be recorded is evaluated in Python, with a warning: a function that takes arrays of places is called once for all of
them, and derivatives are differences with an estimated error. Both answer the same `Request`.
"""

from __future__ import annotations

import contextlib
import copy
import functools
import operator
import time
import warnings
from collections.abc import Callable, Hashable, Sequence
from dataclasses import dataclass, replace
from typing import Any, NamedTuple

import numpy as np

from contin import errors as checks
from contin import threads
from contin.arrays import Array, Function, Indices, Pattern
from contin.errors import InterpretedWarning, ProblemError, warn
from contin.functions import derivatives, round_off
from contin.functions.interpreter import LANES, Loaded, load, run
from contin.functions.outcomes import Outcomes, frozen
from contin.functions.primitives import ANALYTIC
from contin.functions.program import Inputs, Program, Slope, program
from contin.functions.recording import Recording, checked, sized
from contin.functions.signature import ABSENT, Signature, UserFunction
from contin.functions.stand_ins import constants_of
from contin.functions.tape import Number, Unrecordable
from contin.threads import PARTS


class Request(NamedTuple):
    """Derivatives of functions that a batch is asked for.

    - ``inputs`` (tuple of int, optional): The inputs that the Jacobian has columns for; None asks for no Jacobian.
    - ``order`` (int): Number of directions that the values or, where it is asked for, the Jacobian is differentiated along.
    - ``weighted`` (bool): The Jacobian is that of one value, the sum of the derivatives along one direction with weights.
    - ``packed`` (bool): The Jacobian is a row of the entries that may differ from zero.
    """

    inputs: tuple[int, ...] | None = None
    order: int = 0
    weighted: bool = False
    packed: bool = False


#: A program, the number of its values, and the shape of its Jacobian at one point; empty without one.
_Made = tuple[Program, int, tuple[int, ...]]


class Recorded:
    """Functions that are recorded, for `contin.functions.batch.Batch`; raise Unrecordable where they cannot be.

    ``kept`` is everything that has been made for these functions, whatever the sizes are.
    """

    def __init__(self, functions: Sequence[UserFunction], signature: Signature) -> None:
        self.recording = checked(functions, signature)
        self.kept: dict[Hashable, Any] = {}
        self._functions, self._signature = functions, signature
        self._constants = constants_of(each.function for each in functions)
        self._seconds: dict[int, float] = {}  # a point takes, by the number of instructions
        self._values, self._sides = len(self.recording.results), 0  # numbers of values that have sizes, and of frozen outcomes
        self._behind: Array = np.empty(0)  # p: frozen outcomes, and sizes that inputs and values are divided by

    def sized(self, inputs: Array, values: Array) -> Recorded:
        """Return the same functions of inputs divided by sizes, with their values divided by theirs."""
        found: Recorded = copy.copy(self._once("divided", lambda: self._of(sized(self.recording))))  # what all sizes share
        found._behind = np.concatenate([inputs, values])
        return found

    def _of(self, recording: Recording, sides: int = 0) -> Recorded:
        found = copy.copy(self)
        found.recording, found.kept, found._seconds, found._sides = recording, {}, {}, sides
        return found

    def outcomes(self, free: tuple[int, ...], along: bool = False) -> Outcomes:
        """Return the functions with frozen outcomes of what states or ``free`` parameters decide, ``along`` t these alone."""
        recording, states = self.recording, len(self._signature.states) * (1 + self._signature.ends)
        own, moving = recording.inputs[:states], [recording.inputs[states + slot] for slot in free]
        both = (moving, [recording.time, *own]) if along else ([*own, *moving], [])
        return self._once(("outcomes", free, along), lambda: frozen(recording.tape, recording.results, *both))

    def frozen(self, free: tuple[int, ...], sides: Array, along: bool = False) -> tuple[Recorded, Recorded]:
        """Return the same functions with these outcomes, and the numbers that decide."""

        def both() -> list[Recorded]:
            found = self.outcomes(free, along)
            recordings = [replace(self.recording, results=places) for places in (found.results, found.numbers)]
            return [self._of(recording, len(found.numbers)) for recording in recordings]

        functions, numbers = map(copy.copy, self._once(("frozen", free, along), both))
        functions._behind = numbers._behind = np.concatenate([sides, self._behind])
        return functions, numbers

    def is_current(self) -> bool:
        """Return whether all constants that the functions read still have the values that were recorded."""
        try:
            known, now = self._constants, constants_of(each.function for each in self._functions)
            if known is not None and now is not None and len(now) == len(known) and all(map(operator.is_, now, known)):
                return True
            return self.recording.is_same(self._functions, self._signature)
        except Unrecordable:
            return False

    def describe(self) -> str:
        """Return one line: how many operations there are."""
        every = Request(tuple(range(self._signature.inputs)))
        values, both = (self._made(request)[0].operations for request in (Request(), every))
        return f"recorded, {values} operations, {both} with all first derivatives"

    def text(self, labels: Sequence[str], time: str) -> list[str]:
        """Return the operations as lines of text."""
        places = {self.recording.time: time, **dict(zip(self.recording.inputs, labels))}
        return self.recording.tape.lines(self.recording.results, places)

    def bends(self, inputs: tuple[int, ...]) -> bool:
        """Return whether derivatives by these inputs may change."""
        tape, every = self.recording.tape, set(self.recording.inputs)
        return bool(self._once(("bends", inputs), lambda: not every.isdisjoint(tape.needed(self._slopes(inputs).values()))))

    @property
    def is_analytic(self) -> bool:
        """Values are analytic functions wherever they are finite: no operation is one that is not."""
        tape = self.recording.tape
        return {tape.operations[place].name for place in tape.needed(self.recording.results)} <= ANALYTIC

    def entries(self, inputs: tuple[int, ...]) -> tuple[Indices, Indices]:
        """Return values and columns of the entries of the Jacobian that may differ from zero."""
        rows, columns = np.array(list(self._slopes(inputs)), dtype=np.int64).reshape(-1, 2).T
        return rows, columns

    # --- runs ----------------------------------------------------------------------------------------------------------

    def evaluate(
        self, request: Request, t: Array, u: Array, v: Array, p: Array, given: Sequence[Array] = ()
    ) -> tuple[Array, Array]:
        """Return values (points, count), and the Jacobian (points, rows, columns).

        ``given`` are directions, shape (points, inputs) each, and the weights (points, count) of a request with weights.
        """
        found, values, shape = self.kept.get(request) or self._made(request)
        count = len(u)
        out, jac = np.empty((count, values)), np.zeros((count, *shape)) if shape else _NO_JACOBIAN
        if request.order:
            v = np.concatenate([v[:count] if self._signature.ends else u[:, :0], *given], axis=1)
        if self._behind.size:
            p = np.concatenate([p, self._behind])
        if count < _MANY:
            run(found, (t, u, v), p, out, jac)
        else:
            self._run_many(found, t, u, v, p, out, jac)
        return out, jac

    def _run_many(self, found: Program, t: Array, u: Array, v: Array, p: Array, out: Array, jac: Array) -> None:
        """Run a program for all points, in several threads where one took long before."""
        count, kind = len(u), len(found.code)
        if count * self._seconds.get(kind, 0.0) > _LONG and threads.count() > 1:
            blocks = -(-count // LANES)
            ends = [min(count, LANES * (blocks * part // PARTS)) for part in range(PARTS)] + [count]
            parts = [(found, (t[a:b], u[a:b], v[a:b]), p, out[a:b], jac[a:b]) for a, b in zip(ends, ends[1:])]
            threads.each(lambda part: run(*part), parts)
            return
        began = time.perf_counter()
        run(found, (t, u, v), p, out, jac)
        self._seconds[kind] = (time.perf_counter() - began) / count

    def load(self, request: Request) -> Loaded:
        """Return the program as kernels run it."""
        return load(self._made(request)[0], len(self._signature.parameters), self._behind)

    def function(self, places: Sequence[int]) -> Callable[[Array, Array, Array], Array]:
        """Return the function ``(t, u, p)`` of the values of operations on the tape, shape (points, places)."""
        found = program(self.recording.tape, list(zip(places, range(len(places)))), self._inputs())

        def values(t: Array, u: Array, p: Array) -> Array:
            out = np.empty((len(t), len(places)))
            run(found, (t, u, u[:0]), p, out, _NO_JACOBIAN)
            return out

        return values

    # --- programs ------------------------------------------------------------------------------------------------------

    def _once(self, key: Hashable, make: Callable[[], Any]) -> Any:
        if key not in self.kept:
            self.kept[key] = make()
        return self.kept[key]

    def _made(self, request: Request) -> _Made:
        return self._once(request, lambda: self._make(request))

    def _make(self, request: Request) -> _Made:
        """Return the program: values, or their derivatives along directions, and slopes."""
        inputs, order, weighted, packed = request
        results = self.recording.results
        stores: list[tuple[int, int | Slope]] = []
        if inputs is None or not order:
            stores += zip(self._along(results, order), range(len(results)))
        count, shape = len(stores), tuple[int, ...]()
        if inputs is not None:
            found = self._weighted_slopes(inputs) if weighted else self._slopes(inputs)
            places = found.values() if weighted else self._along(list(found.values()), order)
            at = range(len(found)) if packed else [row * len(inputs) + column for row, column in found]
            stores += [(place, Slope(number)) for place, number in zip(places, at)]
            shape = (1, len(found)) if packed else (1 if weighted else len(results), len(inputs))
        return program(self.recording.tape, stores, self._inputs(order, weighted)), count, shape

    def _slopes(self, inputs: tuple[int, ...]) -> dict[tuple[int, int], int]:
        """Return the places of the derivatives that are not zero everywhere, by value and column."""
        distinct = tuple(sorted(set(inputs)))
        found = self._once(("slopes", distinct), lambda: self._by(self.recording.results, distinct))
        columns = {slot: [column for column, each in enumerate(inputs) if each == slot] for slot in distinct}
        entries = {(row, column): place for (row, slot), place in found.items() for column in columns[distinct[slot]]}
        return dict(sorted(entries.items()))

    def _by(self, places: Sequence[int], inputs: Sequence[int]) -> dict[tuple[int, int], int]:
        return derivatives.jacobian(self.recording.tape, places, [self.recording.inputs[slot] for slot in inputs])

    def _weighted_slopes(self, inputs: tuple[int, ...]) -> dict[tuple[int, int], int]:
        """Return the derivatives of the sum with weights of the derivatives of all values along a direction."""
        tape = self.recording.tape
        total = tape.number(0.0)
        for row, place in enumerate(self._along(self.recording.results, 1)):
            total = total + tape.input(("weight", row)) * Number(tape, place)
        return self._by([total.place], inputs)

    def _along(self, places: Sequence[int], order: int) -> Sequence[int]:
        """Return the derivatives of operations along directions."""
        if not order:
            return places
        tape, before = self.recording.tape, self._along(places, order - 1)
        along = {place: tape.input(("direction", order - 1, slot)).place for slot, place in enumerate(self.recording.inputs)}
        return self._once(("along", order, *before), lambda: derivatives.tangents(tape, before, along))

    def _inputs(self, directions: int = 0, weights: bool = False) -> Inputs:
        """Return where inputs are found: directions and weights stand behind v, outcomes and sizes behind p."""
        signature, count = self._signature, len(self.recording.results)
        states, parameters = len(signature.states), len(signature.parameters)
        ends = states if signature.ends else 0
        slots: list[Hashable] = list(range(states, states + ends))
        slots += [("direction", number, slot) for number in range(directions) for slot in range(signature.inputs)]
        slots += [("weight", row) for row in range(count if weights else 0)]
        fixed: list[Hashable] = list(range(states + ends, states + ends + parameters))
        fixed += [("side", number) for number in range(self._sides)]
        fixed += [("size", number) for number in range(signature.inputs + self._values)]
        u, v, p = ({slot: place for place, slot in enumerate(group)} for group in (range(states), slots, fixed))
        return Inputs(u, v, p)


#: Stands for a Jacobian that is not asked for.
_NO_JACOBIAN = np.empty((0, 0, 0))
#: Fewer points are evaluated by one thread, and not timed. Ten times fewer would hardly ever take long.
_MANY = 256
#: So are those that take fewer seconds. Ten times fewer would be the time that it takes to wake another thread.
_LONG = 0.5e-3


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

    - ``reason`` (str): Why the functions are not recorded.
    - ``kept`` (dict): What a batch has made for these functions.
    - ``error`` (float): Largest estimated error of a derivative so far, relative to the largest derivative at its place and to
      the values over the sizes of the inputs.
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
        """Return values (places, count) and Jacobian, as `contin.functions.batch.Recorded.evaluate`."""
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


@dataclass(frozen=True, eq=False)
class Columns:
    """The inputs to differentiate by, in order, and the entries of that Jacobian that may differ from zero.

    - ``inputs`` (ndarray of int, shape (columns,)): Their numbers among u, v and p.
    - ``rows``, ``places`` (ndarray of int): Values and columns of the entries.
    """

    inputs: Indices
    rows: Indices
    places: Indices

    @property
    def width(self) -> int:
        """Number of columns of the Jacobian."""
        return self.inputs.size

    def block(self, entries: Array, rows: Indices, places: Indices) -> Array:
        """Return the derivatives of some values by some columns, shape (points, rows, places), from the entries of `Batch`.

        ``entries`` (points, entries) are in the order of ``rows`` and ``places``.
        """
        row = np.full(1 + max(self.rows.max(initial=-1), rows.max(initial=-1)), -1)
        column = np.full(self.width, -1)
        row[rows], column[places] = np.arange(len(rows)), np.arange(len(places))
        at_row, at_column = row[self.rows], column[self.places]
        kept = (at_row >= 0) & (at_column >= 0)
        found = np.zeros((len(entries), len(rows), len(places)))
        found[:, at_row[kept], at_column[kept]] = entries[:, kept]
        return found

    @functools.cached_property
    def request(self) -> Request:
        """What a batch is asked for values and derivatives by these inputs."""
        return Request(tuple(self.inputs.tolist()))

    @functools.cached_property
    def packed(self) -> Request:
        """The same, the entries of the Jacobian alone."""
        return self.request._replace(packed=True)

    @functools.cached_property
    def bent(self) -> Request:
        """Gradients by these inputs of the derivatives along a direction, with weights."""
        return self.request._replace(order=1, weighted=True)


class Batch:
    """Functions of a point, prepared together: values and exact Jacobian at many points in one call.

    Parameters
    ----------
    functions : sequence of callable
        Each ``f(t, u, p)`` of a time and two named tuples, or with ``ends=True`` ``f(u, v, p)`` of the states at both
        ends. It returns a number or a tuple of numbers; with one argument more it fills that array instead, and
        gets arrays in place of named tuples.
    counts : sequence of int
        Number of values of each function; 0 stands for one number that is no tuple.
    states, parameters : tuple of str
        Names, in order.
    times : bool
        The functions take t; ``f(u, p)`` without.

    Warns
    -----
    InterpretedWarning
        A function that cannot be recorded, when derivatives are first asked for; the message says which and why.

    Raises
    ------
    ProblemError
        No functions, or not a count for each.

    Examples
    --------
    >>> batch = Batch([lambda u, p: (u.x * u.y, p.a * u.x)], [2], ["x", "y"], ["a"], times=False)
    >>> none = np.empty((0, 2))
    >>> batch.values(np.zeros(1), np.array([[2.0, 3.0]]), none, np.array([5.0]))
    array([[ 6., 10.]])
    >>> batch.jacobian(np.zeros(1), np.array([[2.0, 3.0]]), none, np.array([5.0]), batch.columns([0]))[1]
    array([[[3., 2., 0.],
            [5., 0., 2.]]])
    """

    def __init__(
        self, functions: Sequence[Function], counts: Sequence[int], states: Sequence[str], parameters: Sequence[str], *,
        ends: bool = False, times: bool = True,
    ) -> None:  # fmt: skip
        self.signature = Signature(tuple(states), tuple(parameters), times and not ends, ends)
        self.count = sum(max(count, 1) for count in counts)
        arguments = self.signature.arguments
        self.functions = given = [UserFunction(function, arguments, count) for function, count in zip(functions, counts)]
        if not given or len(functions) != len(counts):
            raise ProblemError("functions: there must be at least one, with a count for each")
        self._own: Recorded | Interpreted
        try:
            self._own = Recorded(given, self.signature)
        except Unrecordable as reason:
            self._own = Interpreted(given, self.signature, str(reason))

    def __repr__(self) -> str:
        states, parameters = (checks.listed(names) or "none" for names in (self.signature.states, self.signature.parameters))
        return f"Batch({self.count} value{'s' * (self.count != 1)}; states {states}; parameters {parameters})"

    @property
    def interpreted(self) -> Interpreted | None:
        """The functions as Python evaluates them; None if they are recorded."""
        return self._own if isinstance(self._own, Interpreted) else None

    @property
    def recorded(self) -> Recorded | None:
        """The functions as they are recorded; None if they cannot be."""
        return self._own if isinstance(self._own, Recorded) else None

    def sized(self, inputs: Array, values: Array) -> Batch:
        """Return the same functions of inputs u, v (with ``ends``) and p that are divided by sizes, as are the values.

        ``inputs`` and ``values`` (count,) are the sizes, powers of two. Programs are made once for all of them.
        """
        if np.all(inputs == 1) and np.all(values == 1):
            return self
        found = copy.copy(self)
        found._own = self._own.sized(inputs, values)
        return found

    def conditions(self, free: Sequence[int] | Indices, along: bool = False) -> tuple[int, ...]:
        """Return the places on the tape of the conditions that states or ``free`` parameters decide.

        ``along`` t, those that parameters alone decide: others have an outcome at each place.
        """
        return self.recorded.outcomes(tuple(map(int, free)), along).origins if self.recorded is not None else ()

    def frozen(self, free: Sequence[int] | Indices, sides: Array, along: bool = False) -> tuple[Batch, Batch]:
        """Return the functions with ``sides``, 1 or -1 each, as outcomes of these conditions, and the numbers that decide."""
        assert self.recorded is not None
        made = copy.copy(self), copy.copy(self)
        for batch, own in zip(made, self.recorded.frozen(tuple(map(int, free)), sides, along)):
            batch._own, batch.count = own, len(own.recording.results)
            vars(batch).pop("depends", None)
        return made

    def is_current(self) -> bool:
        """Return whether all constants that the functions read still have the values that were recorded, if they were."""
        return self.recorded is None or self.recorded.is_current()

    def describe(self) -> str:
        """Return one line: how the functions are evaluated, and how many operations they have."""
        return self._own.describe()

    def text(self, labels: Sequence[str], time: str = "t") -> list[str]:
        """Return the recorded operations as lines: what is used several times as ``z1 = ...``, then each value.

        ``labels`` are those of u, v and p in order.

        Raises
        ------
        ProblemError
            The functions are evaluated in Python.
        """
        return self._own.text(labels, time)

    def values(self, t: Array, u: Array, v: Array, p: Array) -> Array:
        """Return the values, shape (points, count), at ``t`` (points,), ``u`` (points, n), ``v`` likewise or (0, n), ``p``."""
        return self._own.evaluate(_VALUES, t, u, v, p)[0]

    def jacobian(self, t: Array, u: Array, v: Array, p: Array, columns: Columns) -> tuple[Array, Array]:
        """Return values and derivatives, shape (points, count, columns.width)."""
        return self._own.evaluate(columns.request, t, u, v, p)

    def entries(self, t: Array, u: Array, v: Array, p: Array, columns: Columns) -> tuple[Array, Array]:
        """Return values (points, count), and the entries of the Jacobian (points, entries) in the order of `Columns`."""
        values, entries = self._own.evaluate(columns.packed, t, u, v, p)
        return values, entries[:, 0]

    def columns(self, free: Sequence[int] | Indices, order: Sequence[int] | Indices | None = None) -> Columns:
        """Return the columns of derivatives by u, in this ``order``, by v (with ``ends``), and by ``free`` parameters."""
        kept, key = self._own.kept, ("columns", np.asarray(free, np.int64).tobytes(), None if order is None else tuple(order))
        if key not in kept:
            states = len(self.signature.states) * (1 + self.signature.ends)
            inputs = (*(range(states) if order is None else map(int, order)), *(states + int(slot) for slot in free))
            kept[key] = Columns(np.array(inputs, dtype=np.int64), *self._own.entries(inputs))
        return kept[key]

    def bends(self, columns: Columns) -> bool:
        """Return whether derivatives by these columns may change: functions are not linear, or not recorded."""
        inputs = columns.request.inputs
        return inputs is None or isinstance(self._own, Interpreted) or self._own.bends(inputs)

    @functools.cached_property
    def depends(self) -> Pattern:
        """Sparsity pattern: which values depend on which of u, v (with ``ends``), p; shape (count, inputs)."""
        pattern = np.zeros((self.count, self.signature.inputs), dtype=bool)
        every = self.columns(range(len(self.signature.parameters)))
        pattern[every.rows, every.places] = True
        return pattern

    def along(self, t: Array, u: Array, v: Array, p: Array, directions: Sequence[Array]) -> Array:
        """Return the derivative of the values along directions, D^k f [d_1, ..., d_k], shape (points, count).

        Parameters
        ----------
        directions : sequence of ndarray, shape (points, inputs)
            Directions in the space of u, v (with ``ends``) and p.
        """
        return self._own.evaluate(Request(order=len(directions)), t, u, v, p, directions)[0]

    def jacobian_along(self, t: Array, u: Array, v: Array, p: Array, columns: Columns, directions: Sequence[Array]) -> Array:
        """Return the derivative of the Jacobian along directions (as in `along`), shape (points, count, columns.width)."""
        return self._own.evaluate(Request(columns.request.inputs, len(directions)), t, u, v, p, directions)[1]

    def bent(self, t: Array, u: Array, v: Array, p: Array, weights: Array, direction: Array, columns: Columns) -> Array:
        """Return the gradient of w.(J d), the Hessian of w.f times d, for weights w and a direction d.

        Parameters
        ----------
        weights : ndarray, shape (points, count)
        direction : ndarray, shape (points, inputs)

        Returns
        -------
        ndarray, shape (points, columns.width)
        """
        return self._own.evaluate(columns.bent, t, u, v, p, [direction, weights])[1][:, 0]

    def load(self, columns: Columns | None = None, order: int = 0) -> Loaded:
        """Return the program of the values or, with ``columns``, of values and derivatives, as kernels run it.

        With an ``order``, it is that of the derivatives of the Jacobian along so many directions, as in `jacobian_along`.

        Raises
        ------
        ProblemError
            The functions are evaluated in Python.
        """
        return self._own.load(_VALUES if columns is None else columns.request._replace(order=order))


class Piecewise:
    """Recorded functions, other ones for each piece of the points: ``starts`` are the numbers of the first points."""

    interpreted = None

    def __init__(self, batches: Sequence[Any], starts: Sequence[int]) -> None:
        self.batches, self.count, self.columns = batches, batches[0].count, batches[0].columns
        self._pieces = [slice(*ends) for ends in zip(starts, [*starts[1:], None])]

    def bends(self, columns: Columns) -> bool:
        return any(batch.bends(columns) for batch in self.batches)

    def _each(self, name: str, *given: Any) -> Any:
        """Return values at all points; the others, as of a `Batch`, likewise."""
        t, u, v, p, *rest = given

        def at(item: Any, piece: slice) -> Any:
            if isinstance(item, list):
                return [at(each, piece) for each in item]
            return item[piece] if isinstance(item, np.ndarray) else item

        found = [
            getattr(batch, name)(t[piece], u[piece], v, p, *(at(item, piece) for item in rest))
            for batch, piece in zip(self.batches, self._pieces)
        ]
        return np.concatenate(found) if isinstance(found[0], np.ndarray) else [np.concatenate(parts) for parts in zip(*found)]

    values, along, bent, jacobian, entries = map(
        functools.partial(functools.partialmethod, _each), ("values", "along", "bent", "jacobian", "entries")
    )


#: The values.
_VALUES = Request()
