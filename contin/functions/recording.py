"""Recording: a user's functions are called once with recorded numbers, and become a tape.

A function that decides by a number (``if u.x > 0``) is called again for each outcome, and the results are joined by selections,
the last decision first. A function is recorded twice, and compared with its values in Python at a few places: the tape is used
only where a function does the same each time.
"""

from __future__ import annotations

import contextlib
import dis
import functools
import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from contin import checks
from contin.arrays import Function
from contin.draws import generator
from contin.errors import ProblemError
from contin.functions.program import TIME
from contin.functions.recorded_arrays import NUMPY, numbers
from contin.functions.recorded_complex import ComplexNumber
from contin.functions.recorded_function import RecordedFunction
from contin.functions.signature import ABSENT, PROBES, Arguments, Signature, UserFunction, component_count, flat, returned
from contin.functions.stand_ins import prepared
from contin.functions.tape import Tape, Unrecordable
from contin.levels import LOCATED

#: Largest number of paths through the decisions of one function, and of decisions on a path. A path doubles the operations at
#: most; with ten times as many, a function of 100 operations could become one of 64,000.
_PATHS = 64


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


def record(functions: Sequence[UserFunction], signature: Signature, tape: Tape | None = None) -> Recording:
    """Return the recording of functions, on a new tape or on an empty one.

    Raises
    ------
    Unrecordable
    """
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
    """Return the recording, made twice and compared with values in Python.

    Raises
    ------
    Unrecordable
    """
    found = record(functions, signature)
    if not record(functions, signature).same(found):
        raise Unrecordable("it is not the same when it is called again")
    row = 0
    for function in functions:
        _compare(function, signature, found, found.results[row : row + function.size])
        row += function.size
    return found


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
                if len(taken) > _PATHS:
                    raise Unrecordable("it has a loop that ends by a comparison")
            return known[condition]

        tape.decide, tape.searches = decide, searches
        values = _places(tape, call, copy)
        for place in range(len(taken) - 1, len(before) - 1, -1):
            condition = taken[place][0]
            values = _joined(tape, condition, values, explore([*taken[:place], (condition, False)]))
        return values

    before = tape.decide
    try:
        if values := explore([]):
            return values
        raise Unrecordable("it has no value on any path")
    finally:
        tape.decide = before


def _joined(tape: Tape, condition: int, values: list[int], others: list[int]) -> list[int]:
    """Return the values of two paths, joined; nan where one has none."""
    size = max(len(values), len(others))
    if values and others and len(values) != len(others):
        raise Unrecordable("it does not always return the same number of values")
    none = [tape.constant(math.nan)] * size  # of size 0 without a value on both paths
    return [tape.at("select", (condition, a, b)) for a, b in zip(values or none, others or none)]


def _places(tape: Tape, call: Callable[[Any], Sequence[Any]], copy: object) -> list[int]:
    """Return the places of a function's values on one path; none where Python raises an error of arithmetic."""
    try:
        return [tape.number(_real(value)).place for value in call(copy)]
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
    """Compare values of the tape with those of Python, at a few places where Python has some.

    Raises
    ------
    Unrecordable
        They differ.
    """
    random = generator("recording")
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
        scale = 1 + np.abs(expected[known]).max(initial=0.0)
        if np.any(np.abs(computed[known] - expected[known]) > LOCATED * scale):
            raise Unrecordable("its values are not those of its recording")


def result_count(function: Function, arguments: Arguments, what: str) -> int:
    """Return how many values a function returns (0: a bare number), from calls in Python with numbers, or from a recording.

    Raises
    ------
    ProblemError
        The call fails, for each of some numbers, with named tuples and with arrays; ``what`` names the function.
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
    """Return a user's function as a recording, which can be pickled and compared.

    Parameters
    ----------
    arguments : sequence of tuple of str, list of them, or None
        Names of the components of each argument; None for a number, a list for a tuple of named tuples. A function that fills
        an array fills one like the first of them with names.

    Raises
    ------
    Unrecordable
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
