"""Recorded functions, evaluated at many points: the programs for what a `Batch` is asked, and their runs."""

from __future__ import annotations

import copy
import time
from collections.abc import Callable, Hashable, Sequence
from typing import Any, NamedTuple

import numpy as np

from contin import threads
from contin.arrays import Array, Indices
from contin.functions import derivatives
from contin.functions.interpreter import LANES, Loaded, load, run
from contin.functions.program import Inputs, Program, Slope, program
from contin.functions.recording import checked, record, sized
from contin.functions.signature import Signature, UserFunction
from contin.functions.tape import Number, Unrecordable
from contin.threads import PARTS


class Request(NamedTuple):
    """Derivatives of functions that a batch is asked for.

    Attributes
    ----------
    inputs : tuple of int, optional
        The inputs that the Jacobian has columns for; None asks for no Jacobian.
    order : int
        Number of directions that the values or, where it is asked for, the Jacobian is differentiated along.
    weighted : bool
        The Jacobian is that of one value, the sum of the derivatives along one direction with weights.
    packed : bool
        The Jacobian is a row of the entries that may differ from zero.
    """

    inputs: tuple[int, ...] | None = None
    order: int = 0
    weighted: bool = False
    packed: bool = False


#: A program, the number of its values, and the shape of its Jacobian at one point; empty without one.
_Made = tuple[Program, int, tuple[int, ...]]


class Recorded:
    """Functions that are recorded, for `contin.functions.batch.Batch`.

    Attributes
    ----------
    recording : Recording
    kept : dict
        Everything that has been made for these functions, whatever the sizes are.

    Raises
    ------
    Unrecordable
    """

    def __init__(self, functions: Sequence[UserFunction], signature: Signature) -> None:
        self.recording = checked(functions, signature)
        self.kept: dict[Hashable, Any] = {}
        self._functions, self._signature = functions, signature
        self._seconds: dict[int, float] = {}  # a point takes, by the number of instructions
        self._sizes: Array | None = None  # by which inputs and values are divided, if they are

    def sized(self, inputs: Array, values: Array) -> Recorded:
        """Return the same functions of inputs divided by sizes, with their values divided by theirs."""
        found: Recorded = copy.copy(self._once("divided", self._divided))
        found._sizes = np.concatenate([inputs, values])
        return found

    def _divided(self) -> Recorded:
        """Return what functions with sizes share."""
        found = copy.copy(self)
        found.recording, found.kept, found._seconds = sized(self.recording), {}, {}
        return found

    def is_current(self) -> bool:
        """Return whether all constants that the functions read still have the values that were recorded."""
        try:
            return self.recording.same(record(self._functions, self._signature))
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
        if self._sizes is not None:
            p = np.concatenate([p, self._sizes])
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
        sizes = np.empty(0) if self._sizes is None else self._sizes
        return load(self._made(request)[0], len(self._signature.parameters), sizes)

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
        tape, inputs = self.recording.tape, self.recording.inputs
        for number in range(order):
            along = {place: tape.input(("direction", number, slot)).place for slot, place in enumerate(inputs)}
            places = derivatives.tangents(tape, places, along)
        return places

    def _inputs(self, directions: int = 0, weights: bool = False) -> Inputs:
        """Return where inputs are found: directions and weights stand behind v, sizes behind p."""
        signature, count = self._signature, len(self.recording.results)
        states, parameters = len(signature.states), len(signature.parameters)
        ends = states if signature.ends else 0
        slots: list[Hashable] = list(range(states, states + ends))
        slots += [("direction", number, slot) for number in range(directions) for slot in range(signature.inputs)]
        slots += [("weight", row) for row in range(count if weights else 0)]
        fixed: list[Hashable] = list(range(states + ends, states + ends + parameters))
        fixed += [("size", number) for number in range(signature.inputs + count)]
        u, v, p = ({slot: place for place, slot in enumerate(group)} for group in (range(states), slots, fixed))
        return Inputs(u, v, p)


#: Stands for a Jacobian that is not asked for.
_NO_JACOBIAN = np.empty((0, 0, 0))
#: Fewer points are evaluated by one thread, and not timed. Ten times fewer would hardly ever take long.
_MANY = 256
#: So are those that take fewer seconds. Ten times fewer would be the time that it takes to wake another thread.
_LONG = 0.5e-3
