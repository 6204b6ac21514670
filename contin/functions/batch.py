"""A user's functions evaluated at many points in one call, with exact derivatives.

The functions are recorded (`contin.functions.recording`), differentiated on the recording, and run by the interpreter. What
cannot be recorded is evaluated in Python (`contin.functions.interpreted`); a warning says so once.
"""

from __future__ import annotations

import copy
import functools
import time
from collections.abc import Callable, Hashable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from contin import threads
from contin.arrays import Array, Function, Indices, Pattern
from contin.errors import ProblemError
from contin.functions import derivatives
from contin.functions.interpreted import Interpreted
from contin.functions.interpreter import LANES, Loaded, load, run
from contin.functions.program import Inputs, Program, Slope, program
from contin.functions.recording import Recording, checked, record, sized
from contin.functions.signature import Signature, named_values, takes_arrays
from contin.functions.switches import Selection, selections, switches, zeros
from contin.functions.tape import Number, Tape, Unrecordable


@dataclass(frozen=True, eq=False)
class Columns:
    """The inputs to differentiate by, in order, and the entries of that Jacobian that may differ from zero.

    Attributes
    ----------
    inputs : ndarray of int, shape (columns,)
        Their numbers among u, v and p.
    rows, places : ndarray of int
        Values and columns of the entries.
    """

    inputs: Indices
    rows: Indices
    places: Indices

    @property
    def width(self) -> int:
        """Number of columns of the Jacobian."""
        return self.inputs.size

    @functools.cached_property
    def key(self) -> tuple[int, ...]:
        """The inputs as whole numbers of Python."""
        return tuple(self.inputs.tolist())


@dataclass(frozen=True, eq=False)
class Selections:
    """Conditions of functions that states or free parameters decide.

    Attributes
    ----------
    found : tuple of Selection
    names : tuple of str
        The number whose sign decides, as text.
    values_program, gaps_program : Program
    of_gaps : ndarray of int, shape (gaps, 2)
        Number of the selection, and of the value of the functions, of each gap.
    """

    found: tuple[Selection, ...]
    names: tuple[str, ...]
    values_program: Program
    gaps_program: Program
    of_gaps: Indices

    def sides(self, t: Array, u: Array, p: Array) -> Array:
        """Return on which side of each switch points are, shape (points, selections): whole numbers, of other sides others."""
        out = np.empty((len(u), len(self.found)))
        run(self.values_program, (t, u, u[:0]), p, out, _NO_JACOBIAN)
        out -= np.array([each.switch.level for each in self.found])
        whole = np.array([each.switch.whole for each in self.found])
        return np.asarray(np.where(whole, np.floor(out), np.sign(out)))

    def gaps(self, t: Array, u: Array, p: Array) -> Array:
        """Return the values with one outcome less those with the other, shape (points, gaps)."""
        out = np.empty((len(u), len(self.of_gaps)))
        if out.size:
            run(self.gaps_program, (t, u, u[:0]), p, out, _NO_JACOBIAN)
        return out


def _switch_text(tape: Tape, selection: Selection, labels: Mapping[int, str]) -> str:
    """Return the number that decides, as text."""
    place, level = selection.switch.place, selection.switch.level
    operation = tape.operations[place]
    lines = tape.lines([operation.operands[0] if operation.name == "neg" else place], labels)
    text = lines[-1] + (f" - {level:g}" if level else "")
    return f"{text} with {', '.join(lines[:-1])}" if lines[:-1] else text


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
        self,
        functions: Sequence[Function],
        counts: Sequence[int],
        states: Sequence[str],
        parameters: Sequence[str],
        *,
        ends: bool = False,
        times: bool = True,
    ) -> None:
        self.signature = Signature(tuple(states), tuple(parameters), times and not ends, ends)
        self.count = sum(max(count, 1) for count in counts)
        self._functions = tuple(_filling(function, count, self.signature) for function, count in zip(functions, counts))
        self._counts = tuple(counts)
        if not self._functions or len(functions) != len(counts):
            raise ProblemError("functions: there must be at least one, with a count for each")
        self._programs: dict[Hashable, Any] = {}
        self._seconds: dict[int, float] = {}  # a point takes, by the number of instructions
        self._sizes: Array = np.empty(0)  # by which inputs and values are divided, if they are
        self._divided: Batch | None = None  # what all batches with sizes share
        self.interpreted: Interpreted | None = None
        self.recording: Recording | None = None
        try:
            self.recording = checked(self._functions, self._counts, self.signature)
        except Unrecordable as reason:
            self.interpreted = Interpreted(self._functions, self._counts, self.signature, str(reason))

    def sized(self, inputs: Array, values: Array) -> Batch:
        """Return the same functions of inputs u, v (with ``ends``) and p that are divided by sizes, as are the values.

        ``inputs`` and ``values`` (count,) are the sizes, powers of two. Programs are made once for all of them.
        """
        sizes = np.concatenate([inputs, values])
        if np.all(sizes == 1):
            return self
        if self._divided is None:
            self._divided = copy.copy(self)
            vars(self._divided).pop("depends", None)
            self._divided._programs, self._divided._seconds = {}, {}
            self._divided.recording = None if self.recording is None else sized(self.recording)
        found = copy.copy(self._divided)
        found._sizes = sizes
        if self.interpreted is not None:
            found.interpreted = self.interpreted.sized(inputs, values)
        return found

    def is_current(self) -> bool:
        """Return whether all constants that the functions read still have the values that were recorded."""
        if self.recording is None:
            return True  # functions evaluated in Python read them at each call
        try:
            return self.recording.same(record(self._functions, self._counts, self.signature))
        except Unrecordable:
            return False

    def describe(self) -> str:
        """Return one line: how the functions are evaluated, and how many operations they have."""
        if self.interpreted is not None:
            return f"evaluated in Python, because {self.interpreted.reason}"
        every = self.columns(range(len(self.signature.parameters)))
        both = self._slopes(every.key)[0].operations
        return f"recorded, {self._values_program().operations} operations, {both} with all first derivatives"

    def text(self, labels: Sequence[str], time: str = "t") -> list[str]:
        """Return the recorded operations as lines: what is used several times as ``z1 = ...``, then each value.

        ``labels`` are those of u, v and p in order.

        Raises
        ------
        ProblemError
            The functions are evaluated in Python.
        """
        if self.recording is None:
            raise ProblemError(f"there is no text: {self.describe()}")
        recording = self.recording
        places = {recording.time: time, **dict(zip(recording.inputs, labels))}
        return recording.tape.lines(recording.results, places)

    # --- values and first derivatives --------------------------------------------------------------------------------

    def values(self, t: Array, u: Array, v: Array, p: Array) -> Array:
        """Return the values, shape (points, count), at ``t`` (points,), ``u`` (points, n), ``v`` likewise or (0, n), ``p``."""
        if self.interpreted is not None:
            return self.interpreted.values(t, u, v, p)
        out = np.empty((len(u), self.count))
        self._run(self._programs.get("values") or self._values_program(), t, u, v, p, out, _NO_JACOBIAN)
        return out

    def jacobian(self, t: Array, u: Array, v: Array, p: Array, columns: Columns) -> tuple[Array, Array]:
        """Return values and derivatives, shape (points, count, columns.width)."""
        if self.interpreted is not None:
            return self.interpreted.jacobian(t, u, v, p, columns.inputs)
        out, jac = np.empty((len(u), self.count)), np.zeros((len(u), self.count, columns.inputs.size))
        self._run(self._slopes(columns.key)[0], t, u, v, p, out, jac)
        return out, jac

    def entries(self, t: Array, u: Array, v: Array, p: Array, columns: Columns) -> tuple[Array, Array]:
        """Return the values at one point, shape (count,), and the entries of the Jacobian in the order of `Columns`."""
        if self.interpreted is not None:
            return self.interpreted.entries(t, u, v, p, columns.inputs, columns.rows, columns.places)
        out, jac = np.empty((1, self.count)), np.empty((1, 1, columns.rows.size))
        self._run(self._slopes(columns.key, packed=True)[0], t, u, v, p, out, jac)
        return out[0], jac[0, 0]

    def columns(self, free: Sequence[int] | Indices, order: Sequence[int] | Indices | None = None) -> Columns:
        """Return the columns of derivatives by u, in this ``order``, by v (with ``ends``), and by ``free`` parameters."""
        states = len(self.signature.states) * (1 + self.signature.ends)
        inputs = (*(range(states) if order is None else map(int, order)), *(states + int(slot) for slot in free))
        if ("columns", inputs) not in self._programs:
            self._programs["columns", inputs] = self._columns(inputs)
        found: Columns = self._programs["columns", inputs]
        return found

    def _columns(self, inputs: tuple[int, ...]) -> Columns:
        if self.interpreted is not None:
            rows, places = self.interpreted.entries_of(inputs)
        else:
            entries = list(self._jacobian_entries(inputs))
            rows, places = (np.array([entry[side] for entry in entries], dtype=np.int64) for side in (0, 1))
        return Columns(np.array(inputs, dtype=np.int64), rows, places)

    @functools.cached_property
    def depends(self) -> Pattern:
        """Sparsity pattern: which values depend on which of u, v (with ``ends``), p; shape (count, inputs)."""
        pattern = np.zeros((self.count, self.signature.inputs), dtype=bool)
        every = self.columns(range(len(self.signature.parameters)))
        pattern[every.rows, every.places] = True
        return pattern

    def switches(self, low: float, high: float, p: Array, free: Sequence[int] | Indices = ()) -> Array:
        """Return the times between ``low`` and ``high`` at which a condition on time alone changes, increasing.

        ``free`` are parameters that may change: conditions on them move, and do not count. Empty for functions evaluated in
        Python.
        """
        if self.recording is None or not self.signature.times:
            return np.empty(0)
        states, recording = len(self.signature.states), self.recording
        tape, slots = recording.tape, (*range(states), *(states + int(slot) for slot in free))
        moving = [recording.inputs[slot] for slot in slots]
        found = self._kept(("switches", slots), lambda: switches(tape, recording.results, recording.time, moving))
        if not found:
            return np.empty(0)
        run_at = self._kept(
            ("switches of", slots),
            lambda: program(tape, [(each.place, column) for column, each in enumerate(found)], self._inputs()),
        )

        def values(t: Array) -> Array:
            out = np.empty((len(t), len(found)))
            run(run_at, (t, np.zeros((len(t), states)), np.empty((0, states))), p, out, _NO_JACOBIAN)
            return out

        return zeros(found, values, low, high)

    def selections(self, free: Sequence[int] | Indices = ()) -> Selections | None:
        """Return the conditions that states or ``free`` parameters decide; None without any, and for functions in Python."""
        if self.recording is None:
            return None
        found: Selections | None = self._kept(("selections", *map(int, free)), lambda: self._selections(list(map(int, free))))
        return found

    def _selections(self, free: Sequence[int]) -> Selections | None:
        recording, states = self._known(), len(self.signature.states)
        tape, inputs = recording.tape, recording.inputs
        moved = [inputs[states + slot] for slot in free]
        found = selections(tape, recording.results, recording.time, inputs[:states], moved)
        if not found:
            return None
        gaps = [(number, row, place) for number, each in enumerate(found) for row, place in (each.gaps or {}).items()]
        labels = {recording.time: "t", **dict(zip(inputs, (*self.signature.states, *self.signature.parameters)))}
        names = tuple(_switch_text(tape, each, labels) for each in found)
        values = program(tape, [(each.switch.place, column) for column, each in enumerate(found)], self._inputs())
        differences = program(tape, [(place, column) for column, (_, _, place) in enumerate(gaps)], self._inputs())
        of_gaps = np.array([(number, row) for number, row, _ in gaps], dtype=np.int64).reshape(-1, 2)
        return Selections(found, names, values, differences, of_gaps)

    # --- higher derivatives ------------------------------------------------------------------------------------------

    def along(self, t: Array, u: Array, v: Array, p: Array, directions: Sequence[Array]) -> Array:
        """Return the derivative of the values along directions, D^k f [d_1, ..., d_k], shape (points, count).

        Parameters
        ----------
        directions : sequence of ndarray, shape (points, inputs)
            Directions in the space of u, v (with ``ends``) and p.
        """
        if self.interpreted is not None:
            return self.interpreted.along(t, u, v, p, directions)
        out = np.empty((len(u), self.count))
        given = np.hstack([v[: len(u)] if self.signature.ends else u[:, :0], *directions])
        self._run(self._along(len(directions)), t, u, given, p, out, _NO_JACOBIAN)
        return out

    def jacobian_along(self, t: Array, u: Array, v: Array, p: Array, columns: Columns, directions: Sequence[Array]) -> Array:
        """Return the derivative of the Jacobian along directions (as in `along`), shape (points, count, columns.width)."""
        inputs = columns.key
        if self.interpreted is not None:
            return self.interpreted.jacobian_along(t, u, v, p, columns.inputs, directions)
        jac = np.zeros((len(u), self.count, columns.width))
        given = np.hstack([v[: len(u)] if self.signature.ends else u[:, :0], *directions])
        self._run(self._jacobian_along(inputs, len(directions)), t, u, given, p, np.empty((len(u), 0)), jac)
        return jac

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
        if self.interpreted is not None:
            along = self.interpreted.jacobian_along(t, u, v, p, columns.inputs, [direction])
            contracted: Array = np.einsum("ka,kaj->kj", weights, along)
            return contracted
        inputs = columns.key
        given = np.hstack([v[: len(u)] if self.signature.ends else u[:, :0], direction, weights])
        jac = np.zeros((len(u), 1, columns.width))
        self._run(self._bent(inputs), t, u, given, p, np.empty((len(u), 0)), jac)
        return jac[:, 0]

    # --- programs ----------------------------------------------------------------------------------------------------

    def _kept(self, key: Hashable, make: Callable[[], Any]) -> Any:
        if key not in self._programs:
            self._programs[key] = make()
        return self._programs[key]

    def _known(self) -> Recording:
        assert self.recording is not None
        return self.recording

    def _values_program(self) -> Program:
        stores = list(zip(self._known().results, range(self.count)))
        found: Program = self._kept("values", lambda: program(self._known().tape, stores, self._inputs()))
        return found

    def _slopes(self, inputs: tuple[int, ...], packed: bool = False) -> tuple[Program, list[tuple[int, int]]]:
        """Return the program of values and derivatives by these inputs, and the entries that it fills, by value and column."""
        found: tuple[Program, list[tuple[int, int]]] | None = self._programs.get(("slopes", inputs, packed))
        if found is None:
            self._programs["slopes", inputs, packed] = found = self._slopes_program(inputs, packed)
        return found

    def _slopes_program(self, inputs: tuple[int, ...], packed: bool) -> tuple[Program, list[tuple[int, int]]]:
        recording, entries = self._known(), self._jacobian_entries(inputs)
        at = {entry: number if packed else entry[0] * len(inputs) + entry[1] for number, entry in enumerate(entries)}
        stores: list[tuple[int, int | Slope]] = list(zip(recording.results, range(self.count)))
        stores += [(place, Slope(at[entry])) for entry, place in entries.items()]
        return program(recording.tape, stores, self._inputs()), list(entries)

    def _jacobian_entries(self, inputs: tuple[int, ...]) -> dict[tuple[int, int], int]:
        """Return the places of the derivatives that are not zero everywhere."""
        recording = self._known()
        distinct = sorted(set(inputs))
        found: dict[tuple[int, int], int] = self._kept(
            ("entries", tuple(distinct)),
            lambda: derivatives.jacobian(recording.tape, recording.results, [recording.inputs[slot] for slot in distinct]),
        )
        columns: dict[int, list[int]] = {}
        for column, slot in enumerate(inputs):
            columns.setdefault(distinct.index(slot), []).append(column)
        entries = {(row, column): place for (row, slot), place in found.items() for column in columns[slot]}
        return dict(sorted(entries.items()))

    def _tangents(self, places: Sequence[int], number: int) -> list[int]:
        """Return the derivatives of operations along the direction of a number."""
        recording = self._known()
        along = {place: recording.tape.input(("direction", number, slot)).place for slot, place in enumerate(recording.inputs)}
        return derivatives.tangents(recording.tape, places, along)

    def _along(self, order: int) -> Program:
        def make() -> Program:
            places = list(self._known().results)
            for number in range(order):
                places = self._tangents(places, number)
            return program(self._known().tape, list(zip(places, range(self.count))), self._inputs(order))

        found: Program = self._kept(("along", order), make)
        return found

    def _jacobian_along(self, inputs: tuple[int, ...], order: int) -> Program:
        def make() -> Program:
            entries = self._jacobian_entries(inputs)
            places = list(entries.values())
            for number in range(order):
                places = self._tangents(places, number)
            stores = [(place, Slope(row * len(inputs) + column)) for (row, column), place in zip(entries, places)]
            return program(self._known().tape, stores, self._inputs(order))

        found: Program = self._kept(("jacobian along", inputs, order), make)
        return found

    def _bent(self, inputs: tuple[int, ...]) -> Program:
        def make() -> Program:
            recording = self._known()
            tape = recording.tape
            first = self._tangents(recording.results, 0)
            weights = [tape.input(("weight", row)) for row in range(self.count)]
            total = tape.number(0.0)
            for weight, place in zip(weights, first):
                total = total + weight * Number(tape, place)
            entries = derivatives.jacobian(tape, [total.place], [recording.inputs[slot] for slot in inputs])
            stores = [(place, Slope(column)) for (_, column), place in entries.items()]
            return program(tape, stores, self._inputs(1, weights=True))

        found: Program = self._kept(("bent", inputs), make)
        return found

    def _inputs(self, directions: int = 0, weights: bool = False) -> Inputs:
        """Return where inputs are found: directions and weights stand behind v."""
        states, signature = len(self.signature.states), self.signature
        ends = states if signature.ends else 0
        v: dict[Hashable, int] = {states + column: column for column in range(ends)}
        for number in range(directions):
            for slot in range(signature.inputs):
                v["direction", number, slot] = len(v)
        if weights:
            v |= {("weight", row): len(v) + row for row in range(self.count)}
        p: dict[Hashable, int] = {states + ends + slot: slot for slot in range(len(signature.parameters))}
        p |= {("size", number): len(signature.parameters) + number for number in range(signature.inputs + self.count)}
        return Inputs({column: column for column in range(states)}, v, p)

    def load(self, columns: Columns | None = None) -> Loaded:
        """Return the program of the values or, with ``columns``, of values and derivatives, as kernels run it."""
        found = self._values_program() if columns is None else self._slopes(columns.key)[0]
        return load(found, len(self.signature.parameters), self._sizes)

    # --- the interpreter ---------------------------------------------------------------------------------------------

    def _run(self, found: Program, t: Array, u: Array, v: Array, p: Array, out: Array, jac: Array) -> None:
        """Run a program for all points, in several threads where one took long before."""
        count = len(u)
        if self._sizes.size:
            p = np.concatenate([p, self._sizes])
        if count < _MANY:
            run(found, (t, u, v), p, out, jac)
            return
        kind = len(found.code)
        if count * self._seconds.get(kind, 0.0) > _LONG and threads.count() > 1:
            threads.each(lambda part: run(*part), _divided(found, t, u, v, p, out, jac))
            return
        began = time.perf_counter()
        run(found, (t, u, v), p, out, jac)
        self._seconds[kind] = (time.perf_counter() - began) / count


def _divided(found: Program, t: Array, u: Array, v: Array, p: Array, out: Array, jac: Array) -> list[tuple[Any, ...]]:
    """Return the arguments of `run` for all points, in parts that begin with a block."""
    blocks = -(-len(u) // LANES)
    ends = [min(len(u), LANES * (blocks * part // _PARTS)) for part in range(_PARTS)] + [len(u)]
    return [(found, (t[a:b], u[a:b], v[a:b]), p, out[a:b], jac[a:b]) for a, b in zip(ends, ends[1:])]


def _filling(function: Function, count: int, signature: Signature) -> Function:
    """Return a function that takes states as arrays only as one that fills an array; any other one as it is."""
    if signature.fills(function) or not takes_arrays(function, signature.arguments):
        return function
    named, arity = named_values(signature.parameters), len(signature.arguments)

    def fill(given: Sequence[Any], out: Any) -> None:
        result = function(*given[:-1], named(*given[-1]))
        if count:
            out[:] = result
        else:
            out[0] = result

    if arity == 3:
        return _named(lambda t, u, p, out: fill((t, u, p), out), function)
    return _named(lambda u, p, out: fill((u, p), out), function)


def _named(function: Any, like: Function) -> Function:
    function.__name__ = getattr(like, "__name__", "function")
    return function  # type: ignore[no-any-return]


#: Stands for a Jacobian that is not asked for.
_NO_JACOBIAN = np.empty((0, 0, 0))
#: Fewer points are evaluated by one thread, and not timed. Ten times fewer would hardly ever take long.
_MANY = 256
#: So are those that take fewer seconds. Ten times fewer would be the time that it takes to wake another thread.
_LONG = 0.5e-3
#: Parts that several threads share: more than cores usually, so that a core that is busy with something else gets fewer.
_PARTS = 16
