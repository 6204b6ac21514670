"""Recording: a user's functions are called once with recorded numbers, and become a tape.

A function that decides by a number (``if u.x > 0``) is called again for each outcome, and the results are joined by selections,
the last decision first. A function is recorded twice, and compared with its values in Python at a few places: the tape is used
only where a function does the same each time.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from contin.arrays import Function
from contin.errors import ProblemError
from contin.functions.program import TIME
from contin.functions.recorded_arrays import NUMPY, _plain, numbers
from contin.functions.recorded_complex import ComplexNumber
from contin.functions.recorded_function import RecordedFunction
from contin.functions.signature import Arguments, Signature, argument_count, named_values, takes_arrays
from contin.functions.stand_ins import prepared
from contin.functions.tape import Number, Tape, Unrecordable

#: Largest number of paths through the decisions of one function. Each doubles its operations at most.
_PATHS = 64
#: Relative difference of a tape's value from Python's beyond which a function is not recorded: the order of sums and the last
#: bits of the C library's functions make 1e-13, cancellation ten times that.
_AGREES = 1e-9


@dataclass(frozen=True, eq=False)
class Recording:
    """Recorded functions.

    Attributes
    ----------
    tape : Tape
    results : tuple of int
        Places of all values, in order.
    time, inputs : int and tuple of int
        Places of t, and of u, v and p.
    """

    tape: Tape
    results: tuple[int, ...]
    time: int
    inputs: tuple[int, ...]

    def same(self, other: Recording) -> bool:
        """Return whether two recordings have the same operations."""
        if self.results != other.results or len(self.tape.operations) < len(other.tape.operations):
            return False
        return self.tape.operations[: len(other.tape.operations)] == other.tape.operations


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


def record(functions: Sequence[Function], counts: Sequence[int], signature: Signature) -> Recording:
    """Return the recording of functions; ``counts`` are their numbers of values, 0 for a bare number.

    Raises
    ------
    Unrecordable
    """
    tape = Tape(NUMPY)
    time = tape.input(TIME)
    inputs = [tape.input(slot) for slot in range(signature.inputs)]
    results: list[int] = []
    for function, count in zip(functions, counts):
        results += _recorded(tape, function, count, signature, time, inputs)
    return Recording(tape, tuple(results), time.place, tuple(each.place for each in inputs))


def checked(functions: Sequence[Function], counts: Sequence[int], signature: Signature) -> Recording:
    """Return the recording, made twice and compared with values in Python.

    Raises
    ------
    Unrecordable
    """
    found = record(functions, counts, signature)
    if not record(functions, counts, signature).same(found):
        raise Unrecordable("it is not the same when it is called again")
    row = 0
    for function, count in zip(functions, counts):
        size = max(count, 1)
        _compare(function, count, signature, found, found.results[row : row + size])
        row += size
    return found


def _recorded(
    tape: Tape, function: Function, count: int, signature: Signature, time: Number, inputs: Sequence[Number]
) -> list[int]:
    """Return the places of the values of one function."""
    size, fills = max(count, 1), signature.fills(function)

    def call(copy: Any) -> Sequence[Any]:
        found = _called(copy, fills, size, signature, time, inputs)
        return list(found) if count or fills else [found]

    places = recorded_paths(tape, function, call)
    if len(places) != size:
        raise Unrecordable(f"it returns {len(places)} values, not {size}")
    return places


def recorded_paths(tape: Tape, function: Function, call: Callable[[Any], Sequence[Any]]) -> list[int]:
    """Return the places of a function's values, joined over all outcomes of its decisions.

    Parameters
    ----------
    call : callable
        ``call(copy)`` calls a copy of the function that takes recorded numbers, and returns its values.

    Raises
    ------
    Unrecordable
    """
    copy = prepared(function)
    calls, searches = 0, tape.searches

    def explore(before: list[tuple[int, bool]]) -> list[int]:
        nonlocal calls
        calls += 1
        if calls > _PATHS:
            raise Unrecordable(f"it has more than {_PATHS} paths through its decisions, or a loop that ends by a comparison")
        taken: list[tuple[int, bool]] = []

        def decide(condition: int) -> bool:
            known = dict(taken)
            if condition not in known:
                place = len(taken)
                if place < len(before) and before[place][0] != condition:
                    raise Unrecordable("its decisions are not the same when it is called again")
                known[condition] = before[place][1] if place < len(before) else True
                taken.append((condition, known[condition]))
                if len(taken) > _DEPTH:
                    raise Unrecordable("it has a loop that ends by a comparison")
            return known[condition]

        tape.decide, tape.searches = decide, searches
        values = _places(tape, call, copy)
        for place in range(len(taken) - 1, len(before) - 1, -1):
            condition = taken[place][0]
            values = _joined(tape, condition, values, explore([*taken[:place], (condition, False)]))
        if not values:
            raise Unrecordable("it has no value on any path")
        return values

    before = tape.decide
    try:
        return explore([])
    finally:
        tape.decide = before


def _joined(tape: Tape, condition: int, values: list[int], others: list[int]) -> list[int]:
    """Return the values of two paths, joined; nan where one has none."""
    size = max(len(values), len(others))
    if values and others and len(values) != len(others):
        raise Unrecordable("it does not always return the same number of values")
    none = [tape.constant(math.nan)] * size
    return [tape.at("select", (condition, a, b)) for a, b in zip(values or none, others or none)]


def _places(tape: Tape, call: Callable[[Any], Sequence[Any]], copy: Any) -> list[int]:
    """Return the places of a function's values on one path; none where Python raises an error of arithmetic."""
    try:
        return [tape.number(_real(value)).place for value in call(copy)]
    except ProblemError:
        raise
    except (ArithmeticError, ValueError) as error:
        if isinstance(error, ValueError) and "domain" not in str(error):
            raise Unrecordable(_sentence(error)) from error
        return []
    except Exception as error:  # a user's function may raise anything when it is not given floating-point numbers
        raise Unrecordable(_sentence(error)) from error


def _real(value: Any) -> Any:
    """Return a value that a function returns; of a complex number without an imaginary part, the real one."""
    if not isinstance(value, ComplexNumber):
        return value
    if value.imag.known == 0:
        return value.real
    raise ProblemError("a function returns a complex number; it must return its real and its imaginary part as two numbers")


#: Most decisions on one path.
_DEPTH = 40


def _sentence(error: Exception) -> str:
    return " ".join(str(error).split()) or type(error).__name__


def _called(function: Any, fills: bool, size: int, signature: Signature, time: Any, inputs: Sequence[Any]) -> Any:
    """Call a function with numbers, as named tuples or, if it fills an array, as arrays."""
    arguments: list[Any] = []
    place = 0
    for names in signature.arguments:
        if names is None:
            arguments.append(time)
            continue
        group = list(inputs[place : place + len(names)])
        place += len(names)
        arguments.append(numbers(group) if fills else named_values(tuple(names))(*group))
    if not fills:
        result = function(*arguments)
        return (_plain(result).ravel().tolist() if result.ndim else result.item()) if isinstance(result, np.ndarray) else result
    filled = numbers([0.0] * size)
    function(*arguments, filled)
    return filled.tolist()


def _compare(function: Function, count: int, signature: Signature, recording: Recording, places: Sequence[int]) -> None:
    """Compare values of the tape with those of Python, at a few places where Python has some.

    Raises
    ------
    Unrecordable
        They differ.
    """
    random = np.random.default_rng(11)
    size = max(count, 1)
    for center in _CENTERS:
        inputs = (center + 0.1 * random.uniform(-1, 1, signature.inputs)).tolist()
        time = center + 0.1
        try:
            with np.errstate(all="ignore"):
                if signature.fills(function):
                    expected = _filled(function, size, signature, time, inputs)
                else:
                    found = _called(function, False, size, signature, time, inputs)
                    expected = np.array(found if count else [found], dtype=float)
        except Exception:  # it has no value there; whatever it raises
            continue
        values: dict[Any, float] = {TIME: time, **dict(enumerate(inputs))}
        computed = np.array(recording.tape.evaluate(places, values))
        known = np.isfinite(expected)
        scale = 1 + np.abs(expected[known]).max(initial=0.0)
        if np.any(np.abs(computed[known] - expected[known]) > _AGREES * scale):
            raise Unrecordable("its values are not those of its recording")


def _filled(function: Function, size: int, signature: Signature, time: float, inputs: Sequence[float]) -> Any:
    """Return the values of a function that fills an array."""
    arguments: list[Any] = []
    place = 0
    for names in signature.arguments:
        if names is None:
            arguments.append(time)
            continue
        arguments.append(np.array(inputs[place : place + len(names)]))
        place += len(names)
    result = np.zeros(size)
    function(*arguments, result)
    return result


#: Places around which functions are compared: positive and negative numbers.
_CENTERS = (0.5, 1.5, -0.5)


def function_of(function: Function, arguments: Arguments, count: int | None = None) -> RecordedFunction:
    """Return a user's function as a recording, which can be pickled and compared.

    Parameters
    ----------
    arguments : sequence of tuple of str or None
        Names of the components of each argument; None for a number.
    count : int, optional
        Number of values of a function that fills an array, its last argument.

    Raises
    ------
    Unrecordable
    """
    tape, single = Tape(NUMPY), True
    places: list[int] = []

    def inputs(names: Any) -> Any:
        if isinstance(names, list):
            return tuple(inputs(each) for each in names)
        group = [tape.input(("argument", len(places) + number)) for number in range(1 if names is None else len(names))]
        places.extend(each.place for each in group)
        return group[0] if names is None else named_values(tuple(names))(*group)

    groups = [inputs(names) for names in arguments]
    fills = argument_count(function) == len(arguments) + 1
    arrays = not fills and takes_arrays(function, arguments)

    def call(copy: Any) -> Sequence[Any]:
        nonlocal single
        last = len(groups) - (not fills)
        given = [numbers(list(group)) if isinstance(group, tuple) and (fills or arrays) and number < last else group
                 for number, group in enumerate(groups)]  # fmt: skip
        if fills:
            filled = numbers([0.0] * (count or len(groups[0])))
            copy(*given, filled)
            single = False
            return list(filled.tolist())
        result = copy(*given)
        single = not isinstance(result, (tuple, list)) and np.ndim(result) == 0
        return [result] if single else (_plain(result).ravel().tolist() if isinstance(result, np.ndarray) else list(result))

    results = recorded_paths(tape, function, call)
    letters = [f"a{number}" for number in range(len(groups))]
    name = getattr(function, "__name__", "function")
    return RecordedFunction(name, letters, list(arguments), tape, places, results, single)
