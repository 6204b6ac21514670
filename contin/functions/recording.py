"""Recording: a user's functions are called once with recorded numbers, and become a tape.

A function that decides by a number (``if u.x > 0``) is called again for each outcome, and the results are joined by selections,
the last decision first. Where that takes too many calls, as with twenty guards against 0 / 0, independent decisions are joined
one by one: operations that are others with the other outcome of one become selections. A function is recorded twice, and
compared with its values in Python at a few places: the tape is used only where a function does the same each time.
"""

from __future__ import annotations

import contextlib
import dis
import functools
import math
import sys
import types
from collections.abc import Callable, Collection, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np

from contin import draws
from contin import errors as checks
from contin.arrays import Function
from contin.errors import ProblemError
from contin.functions.program import TIME
from contin.functions.recorded_arrays import NUMPY, numbers
from contin.functions.recorded_complex import ComplexNumber
from contin.functions.signature import ABSENT, PROBES, Arguments, Signature, UserFunction, component_count, flat, returned
from contin.functions.stand_ins import RecordedFunction, prepared
from contin.functions.tape import Tape, Unrecordable
from contin.levels import LOCATED

#: Largest number of paths through the decisions of one function. A path doubles the operations at most; with ten times as many,
#: a function of 100 operations could become one of 64,000. Decisions that are joined one by one are compared with a quarter as
#: many random paths. They are from seven on: 2 ** 6 = 64.
_PATHS = 64
#: Largest number of decisions on a path: a grid of 300 buses has 136. A loop that ends by a comparison is told after as many;
#: ten times more take ten times as long.
_DECISIONS = 512


@dataclass(frozen=True, eq=False)
class Recording:
    """Recorded functions.

    - ``tape`` (Tape)
    - ``results`` (tuple of int): Places of all values, in order.
    - ``time``, ``inputs`` (int and tuple of int): Places of t, and of u, v and p.
    """

    tape: Tape
    results: tuple[int, ...]
    time: int
    inputs: tuple[int, ...]

    def is_same(self, functions: Sequence[UserFunction], signature: Signature) -> bool:
        """Return whether functions are recorded alike once more: on the tape, where equal operations are stored once."""
        self.tape.searches = 0
        return record(functions, signature, self.tape).results == self.results


def sized(recording: Recording) -> Recording:
    """Return the same functions of inputs that are divided by sizes; the values are divided by theirs.

    The sizes are further inputs, ``("size", k)`` of all inputs and then of the values.
    """
    tape, known = Tape(NUMPY), recording.tape.operations
    time, count = tape.input(TIME), len(recording.inputs)
    given = [tape.input(known[place].data) for place in recording.inputs]
    sizes = [tape.input(("size", k)) for k in range(count + len(recording.results))]
    moved = {place: each * size for place, each, size in zip(recording.inputs, given, sizes)}
    values = tape.replay(recording.tape, recording.results, {recording.time: time, **moved})
    results = tuple(tape.number(value / size).place for value, size in zip(values, sizes[count:]))
    return Recording(tape, results, time.place, tuple(each.place for each in given))


def record(functions: Sequence[UserFunction], signature: Signature, tape: Tape | None = None) -> Recording:
    """Return the recording of functions, on a new tape or on a given one; raise Unrecordable where that fails."""
    tape = tape or Tape(NUMPY)
    time = tape.input(TIME)
    inputs = [tape.input(slot) for slot in range(signature.inputs)]
    given, results = _given(signature, time, inputs), list[int]()
    for function in functions:
        places = recorded_paths(tape, function.function, functools.partial(function.values, given, numbers))
        if len(places) != function.size:
            raise Unrecordable(f"it returns {len(places)} values, not {function.size}")
        results += places
    return Recording(tape, tuple(results), time.place, tuple(each.place for each in inputs))


def _given(signature: Signature, time: object, inputs: Sequence[Any]) -> list[Any]:
    """Return what functions of a signature are called with."""
    return [time, *inputs] if signature.times else list(inputs)


def checked(functions: Sequence[UserFunction], signature: Signature) -> Recording:
    """Return the recording, made twice and compared with values in Python; raise Unrecordable where that fails."""
    found = record(functions, signature)
    if not found.is_same(functions, signature):
        raise Unrecordable("it is not the same when it is called again")
    row = 0
    for function in functions:
        _compare(function, signature, found, found.results[row : row + function.size])
        row += function.size
    return found


def recorded_paths(tape: Tape, function: Function, call: Callable[[Any], Sequence[Any]]) -> list[int]:
    """Return the places of a function's values, joined over all outcomes of its decisions; raise Unrecordable where that fails.

    ``call(copy)`` calls a copy of the function that takes recorded numbers, and returns its values.
    """
    paths, before = _Paths(tape, functools.partial(call, prepared(function)), tape.searches), tape.decide
    try:
        first = paths.taken([], {})
        ways = [functools.partial(paths.explored, [], path=first), functools.partial(paths.one_by_one, first)]
        if 2 ** len(first.taken) > _PATHS:
            ways.reverse()
        try:
            values = ways[0]()
        except _ManyPaths:
            paths.calls = 0
            values = ways[1]()
        if values:
            return values
        raise Unrecordable("it has no value on any path")
    except _ManyPaths:
        raise Unrecordable(
            f"it has more than {_PATHS} paths through decisions that depend on each other (write those of values as "
            "np.where(condition, a, b)), or a loop that ends by a comparison"
        ) from None
    finally:
        tape.decide = before


@dataclass(eq=False, repr=False)
class _Paths:
    """The paths through the decisions of a function, of which a ``call`` returns the values."""

    tape: Tape
    call: Callable[[], Sequence[Any]]
    searches: int
    calls: int = 0

    def taken(self, before: list[tuple[int, bool]], outcomes: Mapping[int, bool]) -> _Path:
        """Return the path that begins with some decisions, and then takes the ``outcomes`` of conditions, true if none."""
        taken: list[tuple[int, bool]] = []
        whole: dict[int, dict[tuple[int, str], int]] = {}

        def decide(condition: int) -> bool:
            known = dict(taken)
            if condition not in known:
                place = len(taken)
                if place < len(before) and before[place][0] != condition:
                    raise Unrecordable("its decisions are not the same when it is called again")
                known[condition] = before[place][1] if place < len(before) else outcomes.get(condition, True)
                taken.append((condition, known[condition]))
                whole[condition] = _whole_numbers()
                if len(taken) > _DECISIONS:
                    raise Unrecordable("it has a loop that ends by a comparison")
            return known[condition]

        self.tape.decide, self.tape.searches = decide, self.searches
        return _Path(_places(self.tape, self.call), taken, whole)

    def explored(self, before: list[tuple[int, bool]], apart: Collection[int] = (), path: _Path | None = None) -> list[int]:
        """Return the places of the values, joined over all outcomes of further decisions but for some conditions."""
        self.calls += 1
        if self.calls > _PATHS:
            raise _ManyPaths
        values, taken, _ = path or self.taken(before, {})
        for place in range(len(taken) - 1, len(before) - 1, -1):
            condition = taken[place][0]
            if condition not in apart:
                values = _joined(self.tape, condition, values, self.explored([*taken[:place], (condition, False)], apart))
        return values

    def one_by_one(self, first: _Path) -> list[int]:
        """Return the places of the values with selections where the other outcome of one decision makes a difference.

        They are compared with paths of random outcomes. Raises _ManyPaths where decisions are not independent.
        """
        others, done = dict[int, list[int]](), dict[Any, int]()
        conditions = [condition for condition, _ in first.taken]
        for place, condition in enumerate(conditions):
            self.calls = 0
            others[condition] = self.explored([*first.taken[:place], (condition, False)], conditions)
        if any(len(each) != len(first.values) for each in others.values()):
            raise _ManyPaths
        apart = [{each: found[row] for each, found in others.items()} for row in range(len(first.values))]
        values = [_combined(self.tape, done, *each) for each in zip(first.values, apart)]
        random = draws.generator("independent decisions")
        for draw in range(_PATHS // 4):
            path = self.taken([], {each: draw > 0 and bool(random.integers(2)) for each in conditions})
            known = {each: self.tape.constant(float(outcome)) for each, outcome in path.taken}
            if path.differs(first) or self.tape.substitute(values, known) != path.values:
                raise _ManyPaths
        return values


class _ManyPaths(Exception):
    """There are too many paths through the decisions of a function."""


class _Path(NamedTuple):
    """One call of a function: places of its values, its decisions with their outcomes, and whole numbers known at each."""

    values: list[int]
    taken: list[tuple[int, bool]]
    whole: dict[int, dict[tuple[int, str], int]]

    def differs(self, other: _Path) -> bool:
        """Return whether a variable with a whole number, as a count, depends on outcomes: others may depend on it."""
        return any(
            value != other.whole[condition].get(name, value)
            for condition in self.whole.keys() & other.whole.keys()
            for name, value in self.whole[condition].items()
        )


def _whole_numbers() -> dict[tuple[int, str], int]:
    """Return the variables with whole numbers, or truth values, of a user's functions that wait for a decision."""
    found, depth = dict[tuple[int, str], int](), 0
    frame: types.FrameType | None = sys._getframe(2)
    while frame is not None and frame.f_code is not _places.__code__:
        if not str(frame.f_globals.get("__name__")).startswith("contin.functions."):
            found |= {(depth, name): value for name, value in frame.f_locals.items() if isinstance(value, int)}
        frame, depth = frame.f_back, depth + 1
    return found


def _combined(tape: Tape, done: dict[Any, int], value: int, others: dict[int, int]) -> int:
    """Return the place of a value that is another one where a condition is false: ``others`` by condition, for each alone."""
    others = {condition: other for condition, other in others.items() if other != value}
    key = value, *others.items()
    if others and key not in done:
        name, operands, data = tape.operations[value]
        aligned = {each: _aligned(operands, tape.operations[other].operands) for each, other in others.items()}
        if operands and all(tape.operations[other][::2] == (name, data) for other in others.values()) and name != "select":
            parts = [{each: found[row] for each, found in aligned.items()} for row in range(len(operands))]
            done[key] = tape.at(name, tuple(_combined(tape, done, *each) for each in zip(operands, parts)), data)
        else:
            condition, other = others.popitem()
            done[key] = tape.at("select", (condition, _combined(tape, done, value, others), other))
    return done.get(key, value)


def _aligned(operands: tuple[int, ...], others: tuple[int, ...]) -> tuple[int, ...]:
    """Return the operands of a sum or a product in the order that has one in common with others, if they have."""
    crossed = len(operands) == 2 and (operands[0] == others[-1] or operands[1] == others[0]) and operands[0] != others[0]
    return others[::-1] if crossed and operands[1] != others[-1] else others


def _joined(tape: Tape, condition: int, values: list[int], others: list[int]) -> list[int]:
    """Return the values of two paths, joined; nan where one has none."""
    size = max(len(values), len(others))
    if values and others and len(values) != len(others):
        raise Unrecordable("it does not always return the same number of values")
    none = [tape.constant(math.nan)] * size  # of size 0 without a value on both paths
    return [tape.at("select", (condition, a, b)) for a, b in zip(values or none, others or none)]


def _places(tape: Tape, call: Callable[[], Sequence[Any]]) -> list[int]:
    """Return the places of a function's values on one path; none where Python raises an error of arithmetic."""
    try:
        return [tape.number(_real(value)).place for value in call()]
    except ProblemError:
        raise
    except Exception as error:  # a user's function may raise anything when it is not given floating-point numbers
        if isinstance(error, ArithmeticError) or (isinstance(error, ABSENT) and ("domain" in str(error) or _is_stated(error))):
            return []
        raise Unrecordable(_sentence(error)) from error


def _is_stated(error: Exception) -> bool:
    """Return whether a user's function says itself, by ``raise``, that it has no value: not a library that wants numbers."""
    trace = error.__traceback__
    while trace is not None and trace.tb_next is not None:
        trace = trace.tb_next
    if trace is None or "site-packages" in trace.tb_frame.f_code.co_filename:
        return False
    return trace.tb_frame.f_code.co_code[trace.tb_lasti] == dis.opmap["RAISE_VARARGS"]


def _real(value: object) -> Any:
    """Return a value that a function returns; of a complex number without an imaginary part, the real one."""
    if not isinstance(value, ComplexNumber):
        return value
    if value.imag.known == 0:
        return value.real
    raise ProblemError("a function returns a complex number; it must return its real and its imaginary part as two numbers")


def _sentence(error: Exception) -> str:
    return " ".join(str(error).split()) or type(error).__name__


def _compare(function: UserFunction, signature: Signature, recording: Recording, places: Sequence[int]) -> None:
    """Compare values of the tape with those of Python, at a few places where it has some; raise Unrecordable if they differ."""
    random = draws.generator("recording")
    for center in PROBES[:3]:
        inputs = (center + 0.1 * random.uniform(-1, 1, signature.inputs)).tolist()
        time = center + 0.1
        try:
            with np.errstate(all="ignore"):
                expected = np.array(function.values(_given(signature, time, inputs), np.array), dtype=float)
        except Exception:  # it has no value there; whatever it raises
            continue
        values: dict[Any, float] = {TIME: time, **dict(enumerate(inputs))}
        computed = np.array(recording.tape.evaluate(places, values))
        known = np.isfinite(expected)
        if np.any(np.abs(computed[known] - expected[known]) > LOCATED * (1 + np.abs(expected[known]).max(initial=0.0))):
            raise Unrecordable("its values are not those of its recording")


def result_count(function: Function, arguments: Arguments, what: str) -> int:
    """Return how many values a function returns (0: a bare number), from calls in Python with numbers, or from a recording.

    Raises ProblemError where the call fails, for each of some numbers, with named tuples and with arrays; ``what`` names the
    function.
    """
    errors: list[Exception] = []
    for arrays in (False, True):
        try:
            return returned(function, arguments, arrays, what)
        except ProblemError:
            raise
        except Exception as error:  # a user's function may raise anything
            errors.append(error)
    about_arrays = isinstance(errors[0], TypeError) and not isinstance(errors[1], AttributeError)
    first = errors[about_arrays]
    reason = _sentence(first)
    if isinstance(first, ABSENT):
        with contextlib.suppress(Unrecordable):
            return function_of(function, arguments).count
        tried = checks.listed(f"{number:g}" for number in PROBES[:-1])
        raise ProblemError(f"{what} has no value at any of the numbers tried ({tried}): it raises {reason!r}") from first
    if isinstance(first, (AttributeError, KeyError)):
        reason += "; the states and parameters are " + ", ".join(name for names in arguments for name in names or ())
    raise ProblemError(f"{what} cannot be called: {type(first).__name__}: {reason}") from first


def function_of(function: Function, arguments: Arguments) -> RecordedFunction:
    """Return a user's function as a recording, which can be pickled and compared; raise Unrecordable where that fails.

    ``arguments`` are the names of the components of each; None for a number, a list for a tuple of named tuples. A function
    that fills an array fills one like the first of them with names.
    """
    tape, single = Tape(NUMPY), True
    inputs = [tape.input(("argument", number)) for number in range(component_count(list(arguments)))]
    own = UserFunction(function, arguments, next((component_count(names) for names in arguments if names is not None), 0))

    def call(copy: Function) -> Sequence[Any]:
        nonlocal single
        found = flat(own.call(inputs, numbers, copy))
        single = not isinstance(found, (tuple, list))
        return [found] if single else list(found)

    results = recorded_paths(tape, function, call)
    letters = [f"a{number}" for number in range(len(arguments))]
    name = getattr(function, "__name__", "function")
    return RecordedFunction(name, letters, list(arguments), tape, [each.place for each in inputs], results, single)
