"""Conditions of functions, evaluated: when time alone switches them, and on which side points are of those on states."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from contin.arrays import Array, Indices
from contin.functions.batch import Batch
from contin.functions.recorded import Recorded
from contin.functions.switches import Gaps, Switch, switches
from contin.functions.tape import Tape

#: Places at which the sign of a switch is looked at first. Two switches closer than this part of the domain are missed unless
#: one of them is known from another condition.
_SAMPLES = 1000
#: More switches than this are no corners but a curve: tables of so many knots.
MOST_SWITCHES = 200
#: Divisions of an interval in which a switch happens into 32, down to the last digit of its ends. The 31 places between are one
#: block of the interpreter: they take as long as one.
_DIVISIONS, _DIVIDED = 10, np.arange(33) / 32

#: Values of operations at times, states and parameters, shape (points, operations).
_Values = Callable[[Array, Array, Array], Array]


@dataclass(frozen=True, eq=False)
class Selections:
    """Conditions of functions that states or free parameters decide.

    Attributes
    ----------
    names : tuple of str
        The number whose sign decides, as text.
    sides : callable
        ``sides(t, u, p)`` tells on which side of each switch points are, shape (points, selections): whole numbers, of other
        sides others.
    gaps : callable
        ``gaps(t, u, p)`` returns the values with one outcome less those with the other, shape (points, gaps).
    of_gaps : ndarray of int, shape (gaps, 2)
        Number of the selection, and of the value of the functions, of each gap.
    known : ndarray of bool, shape (selections,)
        The other outcome has values to compare with; it has none at the knots of a table.
    """

    names: tuple[str, ...]
    sides: _Values
    gaps: _Values
    of_gaps: Indices
    known: Indices


def breaks_of(batch: Batch, domain: tuple[float, float], p: Array, free: Sequence[int] | Indices = ()) -> Array:
    """Return the times inside a domain at which a condition on time alone changes, increasing.

    ``free`` are parameters that may change: conditions on them move, and do not count. Empty for functions evaluated in Python.
    """
    recorded = batch.recorded
    if recorded is None or not batch.signature.times:
        return np.empty(0)
    sides = _switches(recorded, batch, free)[0]
    if sides is None:
        return np.empty(0)
    low, high = domain
    states, edge, known = len(batch.signature.states), 1e-12 * (high - low), np.empty(0)

    def there(t: Array) -> Array:
        return sides(t, np.zeros((len(t), states)), p)

    places = np.linspace(low, high, _SAMPLES + 1)
    for _ in range(3):  # a switch may lie close to another one: looked for again beside those that are known
        sampled = np.unique(np.concatenate([places, known, (known[1:] + known[:-1]) / 2]))
        merged = np.unique(np.concatenate([known, narrowed(there, *brackets(sampled, there(sampled)))]))
        merged = merged[(merged > low + edge) & (merged < high - edge)]
        merged = merged[np.append(True, np.diff(merged) > edge)] if merged.size else merged
        if merged.size == known.size:
            break
        known = merged
    return known if known.size <= MOST_SWITCHES else np.empty(0)


def selections(batch: Batch, free: Sequence[int] | Indices = ()) -> Selections | None:
    """Return the conditions that states or ``free`` parameters decide; None without any, and for functions in Python."""
    return None if batch.recorded is None else _switches(batch.recorded, batch, free)[1]


def _switches(recorded: Recorded, batch: Batch, free: Sequence[int] | Indices) -> tuple[_Values | None, Selections | None]:
    """Return the sides of conditions on time alone, and the selections; None for none."""
    key = ("switches", *map(int, free))
    if key not in recorded.kept:
        recording, states = recorded.recording, len(batch.signature.states)
        moved = [recording.inputs[states + int(slot)] for slot in free]
        timely, moving = switches(recording.tape, recording.results, recording.time, recording.inputs[:states], moved)
        of_time = _sides(recorded, timely) if 0 < len(timely) <= MOST_SWITCHES else None
        recorded.kept[key] = of_time, _selections(recorded, batch, moving) if moving else None
    return recorded.kept[key]


def _selections(recorded: Recorded, batch: Batch, found: dict[Switch, Gaps]) -> Selections:
    tape, inputs, signature = recorded.recording.tape, recorded.recording.inputs, batch.signature
    labels = {recorded.recording.time: "t", **dict(zip(inputs, (*signature.states, *signature.parameters)))}
    gaps = [(number, row, place) for number, each in enumerate(found.values()) for row, place in (each or {}).items()]
    return Selections(
        tuple(_text(tape, each, labels) for each in found), _sides(recorded, list(found)),
        recorded.function([place for _, _, place in gaps]),
        np.array([(number, row) for number, row, _ in gaps], dtype=np.int64).reshape(-1, 2),
        np.array([each is not None for each in found.values()]),
    )  # fmt: skip


def _sides(recorded: Recorded, found: Sequence[Switch]) -> _Values:
    """Return the function that tells on which side of switches points are."""
    levels, whole = np.array([each.level for each in found]), np.array([each.whole for each in found])
    values = recorded.function([each.place for each in found])

    def sides(t: Array, u: Array, p: Array) -> Array:
        out = values(t, u, p) - levels
        return np.asarray(np.where(whole, np.floor(out), np.sign(out)))

    return sides


def _text(tape: Tape, switch: Switch, labels: dict[int, str]) -> str:
    """Return the number that decides, as text."""
    operation = tape.operations[switch.place]
    lines = tape.lines([operation.operands[0] if operation.name == "neg" else switch.place], labels)
    text = lines[-1] + (f" - {switch.level:g}" if switch.level else "")
    return f"{text} with {', '.join(lines[:-1])}" if lines[:-1] else text


def brackets(times: Array, there: Array) -> tuple[Array, Array, Indices]:
    """Return the times before and behind each switch of a condition, and the numbers of the conditions."""
    at, which = np.nonzero(there[1:] != there[:-1])
    return times[at], times[at + 1], which


def narrowed(sides: Callable[[Array], Array], a: Array, b: Array, which: Indices) -> Array:
    """Return the times between a and b at which conditions switch."""
    each = np.arange(a.size)
    if not a.size:
        return a
    first = sides(a)[each, which]
    for _ in range(_DIVISIONS):
        times = a[:, None] + (b - a)[:, None] * _DIVIDED
        there = sides(times[:, 1:-1].ravel()).reshape(a.size, _DIVIDED.size - 2, -1)[each, :, which]
        switched = np.column_stack([there != first[:, None], np.full(a.size, True)])
        at = switched.argmax(axis=1)
        a, b = times[each, at], times[each, at + 1]
    return b
