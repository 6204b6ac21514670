"""Where recorded functions have jumps and corners: places that belong to the mesh.

A condition on time alone (``t < 0.4``, ``max(0, t - 1)``, a table of time) switches at the zeros of a function of time and of
parameters that stand still: `switches`. A condition on states (``u.x > 0.3``, ``abs(u.x)``) switches where the solution goes:
`selections` are looked at along each solution, by `contin.collocation.switching`. Whether the equations are smooth there
is told by the values that they would have with the other outcome of the condition.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import NamedTuple

import numpy as np

from contin.arrays import Array
from contin.functions.tape import Tape

#: Places at which the sign of a switch is looked at first. Two switches closer than this part of the domain are missed unless
#: one of them is known from another condition.
_SAMPLES = 1000
#: Halvings of an interval with a switch: down to the last digit of its ends.
_HALVINGS = 60
#: More switches than this are no corners but a curve: tables of so many knots.
_MOST = 200
#: Operations of one number with a corner or a jump at its zero, and those with one at every whole number.
_AT_ZERO, _AT_WHOLE = ("abs", "sign"), ("floor", "ceil", "trunc")
#: Conditions: they switch where their operands are equal.
_CONDITIONS = ("lt", "le", "eq")


class Switch(NamedTuple):
    """A function of time whose sign matters: ``place`` on the tape, less the number ``level``; or its ``whole`` part."""

    place: int
    level: float = 0.0
    whole: bool = False


def switches(tape: Tape, results: Sequence[int], time: int, moving: Sequence[int]) -> list[Switch]:
    """Return the switches of time alone that operations depend on; ``moving`` are inputs other than it that may change."""
    needed = tape.needed(results)
    every = [*results, time, *moving]
    timely, changed = tape.reading(every, [time]), tape.reading(every, moving)
    found: list[Switch] = []

    def alone(*places: int) -> bool:
        return any(timely[place] for place in places) and not any(changed[place] for place in places)

    for place in needed:
        name, operands, data = tape.operations[place]
        if not operands or not alone(*operands):
            continue
        if name in _CONDITIONS:
            found.append(Switch(tape.at("sub", (operands[0], operands[1]))))
        elif name in _AT_ZERO:
            found.append(Switch(operands[0]))
        elif name in _AT_WHOLE:
            found.append(Switch(operands[0], whole=True))
        elif name == "mod":
            found.append(Switch(tape.at("div", (operands[0], operands[1])), whole=True))
        elif name == "table":
            found += [Switch(operands[0], knot) for knot in data.breaks]
    return list(dict.fromkeys(found)) if len(found) <= _MOST else []


class Selection(NamedTuple):
    """A switch that a solution decides.

    ``gaps`` are the values of the functions with one outcome less those with the other one, by the number of the value, and
    places on the tape; None where the other outcome has no value to compare with.
    """

    switch: Switch
    gaps: dict[int, int] | None


def selections(
    tape: Tape, results: Sequence[int], time: int, states: Sequence[int], free: Sequence[int]
) -> tuple[Selection, ...]:
    """Return the switches along a solution, in time, that states or free parameters move.

    Those that unknowns found by iteration depend on are left out.

    Parameters
    ----------
    states, free : sequence of int
        Places of the states, and of parameters that may change.
    """
    every = [*results, time, *states, *free]
    varies, moves = tape.reading(every, [time, *states]), tape.reading(every, [*states, *free])
    found: dict[Switch, Selection] = {}

    needed = tape.needed(results)
    searches = [place for place in needed if tape.operations[place].name in ("root", "least")]

    def append(switch: Switch, place: int, one: int, other: int) -> None:
        reads = tape.reading(results, [place])
        if any(reads[search] for search in searches):
            return  # unknowns that are found by iteration depend on it: there is no other outcome to compare with
        sides = [tape.substitute(results, {place: side}) for side in (one, other)]
        gaps = {row: tape.at("sub", pair) for row, pair in enumerate(zip(*sides)) if pair[0] != pair[1]}
        found.setdefault(switch, Selection(switch, gaps))

    for place in needed:
        name, operands, data = tape.operations[place]
        if not any(varies[each] for each in operands) or not any(moves[each] for each in operands):
            continue
        if name in ("lt", "le"):
            append(Switch(tape.at("sub", (operands[0], operands[1]))), place, tape.constant(1.0), tape.constant(0.0))
        elif name == "abs":
            append(Switch(operands[0]), place, operands[0], tape.at("neg", operands))
        elif name == "sign":
            append(Switch(operands[0]), place, tape.constant(1.0), tape.constant(-1.0))
        elif name in _AT_WHOLE:
            append(Switch(operands[0], whole=True), place, tape.at("add", (place, tape.constant(1.0))), place)
        elif name == "mod":
            quotient = tape.at("div", (operands[0], operands[1]))
            append(Switch(quotient, whole=True), place, tape.at("add", (place, operands[1])), place)
        elif name == "table":
            found |= {Switch(operands[0], knot): Selection(Switch(operands[0], knot), None) for knot in data.breaks}
    return tuple(found.values())


def zeros(found: Sequence[Switch], values: Callable[[Array], Array], low: float, high: float) -> Array:
    """Return where switches happen inside a domain, increasing.

    Parameters
    ----------
    values : callable
        ``values(t)`` returns the values of all switches' places at times (K,), shape (K, switches).
    """
    levels, whole = np.array([each.level for each in found]), np.array([each.whole for each in found])

    def signs(t: Array) -> Array:
        value = values(t) - levels
        return np.asarray(np.where(whole, np.floor(value), np.sign(value)))

    places, edge = np.linspace(low, high, _SAMPLES + 1), 1e-12 * (high - low)
    known = np.empty(0)
    for _ in range(3):  # a switch may lie close to another one: looked for again beside those that are known
        sampled = np.unique(np.concatenate([places, known, (known[1:] + known[:-1]) / 2]))
        there = signs(sampled)
        at, which = np.nonzero(there[1:] != there[:-1])
        a, b, first = sampled[at], sampled[at + 1], there[at, which]
        for _ in range(_HALVINGS):
            middle = (a + b) / 2
            same = signs(middle)[np.arange(len(middle)), which] == first if len(middle) else np.zeros(0, dtype=bool)
            a, b = np.where(same, middle, a), np.where(same, b, middle)
        merged = np.unique(np.concatenate([known, b]))
        merged = merged[(merged > low + edge) & (merged < high - edge)]
        merged = merged[np.append(True, np.diff(merged) > edge)] if merged.size else merged
        if merged.size == known.size:
            break
        known = merged
    return known if known.size <= _MOST else np.empty(0)
