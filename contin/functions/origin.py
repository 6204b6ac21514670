"""Where in users' functions a number comes from that is not finite, or a jump: the operation, its line, and the values."""

from __future__ import annotations

import linecache
import math
from collections.abc import Sequence
from pathlib import Path
from types import CodeType
from typing import Any, NamedTuple

import numpy as np

from contin import errors as checks
from contin.functions.batch import Batch
from contin.functions.primitives import TABLE
from contin.functions.recorded_arrays import NUMPY
from contin.functions.tape import LIBRARIES, Number, Tape
from contin.text import COLUMNS

#: Operations that jump. Their derivatives are zero, so Newton's method does not see what they depend on.
_JUMPS = ("lt", "le", "eq", "sign", "floor", "ceil", "trunc", "rint")
#: Operations as they are written.
_WRITTEN = {"div": "{} / {}", "pow": "{} ** {}", "mul": "{} * {}", "sub": "{} - {}", "add": "{} + {}"}


class Place(NamedTuple):
    """Users' functions, and what they are called with: t where they take it, and the components of u, v and p in order."""

    batch: Batch
    time: float
    values: Sequence[float]


def not_finite(place: Place) -> str:
    """Return where a function raises an error or has no finite value or derivative, as a sentence; "" if not found."""
    return _raised(place) or _from_tape(place)


def jump(batch: Batch, inputs: Sequence[int]) -> str:
    """Return the first operation that jumps where one of some inputs changes, with its line; "" where there is none."""
    if batch.recorded is None:
        return ""
    recording = batch.recorded.recording
    tape, places = recording.tape, recording.tape.needed(recording.results)
    reads = tape.reading(places, [recording.inputs[i] for i in inputs])
    jumps = [at for at in places if tape.operations[at].name in _JUMPS and reads[at]]
    return source(batch, jumps[0]) if jumps else ""


def _raised(place: Place) -> str:
    """Return the error that a function raises; of one that cannot be recorded that of arithmetic, too."""
    batch, time, values = place
    how: Any = "ignore" if batch.interpreted is None else "raise"
    for function in batch.functions:
        numbers = [np.float64(value) for value in ([time] if batch.signature.times else []) + list(values)]
        try:
            with np.errstate(divide=how, invalid=how, over=how, under="ignore"):
                function.call(numbers, np.array)
        except Exception as error:  # a user's function may raise anything
            reason = " ".join(str(error).split()) or type(error).__name__
            return f"{function.name} raises {reason!r} at {_named(place)} ({_written(error)})"
    return ""


def _from_tape(place: Place) -> str:
    """Return the first operation, of those that are chosen there, without a finite value or derivative."""
    batch = place.batch
    if batch.recorded is None:
        return ""
    recording, local = batch.recorded.recording, Tape(NUMPY)
    tape, given = recording.tape, {recording.time: place.time, **dict(zip(recording.inputs, place.values))}
    found: dict[int, Number] = {}
    for at in tape.needed(recording.results):
        name, operands, data = tape.operations[at]
        known = [found[operand] for operand in operands]
        value = given.get(at, data if name == "constant" else None)
        found[at] = local.apply(name, *known, data=data) if value is None else local.number(value)
    reads, chosen = tape.reading([*found], recording.inputs), _chosen(tape, recording.results, found)
    has_values = all(_finite(found[at]) for at in chosen)
    for at in chosen:
        name, operands, data = tape.operations[at]
        numbers = [found[operand] for operand in operands]
        if has_values:
            with np.errstate(all="ignore"):
                partials = TABLE[name].partials(local, data, tuple(numbers), found[at])
            if all(_finite(p) for operand, p in zip(operands, partials) if p is not None and reads[operand]):
                continue
        if not has_values and _finite(found[at]):
            continue
        what = "has no finite derivative" if has_values else "is not finite"
        shown = [f"{number.known:.6g}" for number in numbers]
        written = _WRITTEN.get(name, name + "({})").format(*shown) if len(shown) < 3 else name
        where = source(batch, at)
        return f"{written} {what} at {_named(place)}" + f" ({where})" * bool(where)
    return ""


def _chosen(tape: Tape, results: Sequence[int], found: dict[int, Number]) -> list[int]:
    """Return the operations that values are made of, in order: of selections those that are chosen."""
    reached, stack = set[int](), list(results)
    while stack:
        at = stack.pop()
        name, operands, _ = tape.operations[at]
        reached.add(at)
        if name == "select":
            operands = (operands[1] if found[operands[0]].known else operands[2],)
        stack += [operand for operand in operands if operand not in reached]
    return sorted(reached)


def _finite(number: Any) -> bool:
    """Return whether a number is finite; one whose value is not known counts as such."""
    value = number.known if isinstance(number, Number) else number
    return value is None or math.isfinite(value)


def condition(batch: Batch, place: int, others: Sequence[int]) -> str:
    """Return what the user has written for a condition, and where it is one of ``others``, as in a loop, its equations."""
    assert batch.recorded is not None
    found, recording, names = source(batch, place), batch.recorded.recording, batch.signature.states
    if not found or len(recording.results) < 2 or [source(batch, other) for other in {*others}].count(found) < 2:
        return found
    reads = recording.tape.reading(recording.results, [place])
    rows = [row for row, result in enumerate(recording.results) if reads[result]]
    alike = len(recording.results) == len(names)
    return f"{found}, equation {checks.listed(f'{row + 1}' + f' ({names[row]})' * alike for row in rows)}"


def source(batch: Batch, place: int) -> str:
    """Return what the user has written for an operation, with its line; "" where that is not known."""
    assert batch.recorded is not None
    known = batch.recorded.recording.tape.written.get(place)
    return _line(*known) if known else ""


def _written(error: BaseException) -> str:
    """Return what the user has written where an error is raised, with its line; "" where that is not known."""
    trace, text = error.__traceback__, ""
    while trace is not None:
        code = trace.tb_frame.f_code
        text = text if code.co_filename.startswith(LIBRARIES) else _line(code, trace.tb_lasti, trace.tb_lineno)
        trace = trace.tb_next
    return text


def _line(code: CodeType, instruction: int, number: int) -> str:
    line, end, first, last = list(code.co_positions())[instruction // 2]
    written = linecache.getline(code.co_filename, number).strip()
    if line == end and first is not None and written:
        written = linecache.getline(code.co_filename, number).encode()[first:last].decode()
    return f"{written}, ".lstrip(", ") + f"line {number} of {Path(code.co_filename).name}"


def _named(place: Place) -> str:
    """Return the values that functions are called with, by name."""
    names = place.batch.signature
    ends = [f"{name} at the second end" for name in names.states] if names.ends else []
    labels = [*(f"{name} at the first end" if names.ends else name for name in names.states), *ends, *names.parameters]
    known = ([("t", place.time)] if names.times else []) + list(zip(labels, place.values))
    return ", ".join(f"{name} = {value:.6g}" for name, value in known[:COLUMNS]) + ", ..." * (len(known) > COLUMNS)
