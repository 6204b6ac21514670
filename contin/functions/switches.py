"""Where recorded functions have jumps and corners: conditions, and what the functions would be with their other outcome.

A condition on time alone (``t < 0.4``, ``max(0, t - 1)``, a table of time) switches at known times. A condition on states or on
free parameters (``u.x > 0.3``, ``abs(u.x)``) is a selection: it switches where the solution goes. `contin.collocation.corners`
finds the places of both.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import NamedTuple

from contin.functions.tape import Tape


class Switch(NamedTuple):
    """An operation whose sign matters: ``place`` on the tape, less the number ``level``; or its ``whole`` part."""

    place: int
    level: float = 0.0
    whole: bool = False


#: Gaps of a selection: the values of the functions with one outcome less those with the other one, by the number of the value,
#: and places on the tape; None where the other outcome has no value to compare with.
Gaps = dict[int, int] | None


def switches(
    tape: Tape, results: Sequence[int], time: int, states: Sequence[int], free: Sequence[int]
) -> tuple[list[Switch], dict[Switch, Gaps]]:
    """Return the switches of time alone that operations depend on, and those that states or free parameters move.

    Of the latter, those that unknowns found by iteration depend on are left out: there is no other outcome to compare with.

    Parameters
    ----------
    states, free : sequence of int
        Places of the states, and of parameters that may change.
    """
    every, needed = [*results, time, *states, *free], tape.needed(results)
    varies, moves = tape.reading(every, [time, *states]), tape.reading(every, [*states, *free])
    searches = [place for place in needed if tape.operations[place].name in ("root", "least")]
    timely: dict[Switch, None] = {}
    selections: dict[Switch, Gaps] = {}
    for place in needed:
        operands = tape.operations[place].operands
        if not any(varies[each] for each in operands):
            continue
        moving = any(moves[each] for each in operands)
        for switch, outcomes in _conditions(tape, place):
            if not moving:
                timely[switch] = None
            elif not outcomes:
                selections[switch] = None
            else:
                reads = tape.reading(results, [place])
                if not any(reads[search] for search in searches):
                    sides = [tape.substitute(results, {place: side}) for side in outcomes]
                    gaps = {row: tape.at("sub", pair) for row, pair in enumerate(zip(*sides)) if pair[0] != pair[1]}
                    selections.setdefault(switch, gaps)
    return list(timely), selections


def _conditions(tape: Tape, place: int) -> Iterator[tuple[Switch, tuple[int, int] | None]]:
    """Yield the switches of an operation, with the places of its value on both sides; None at the knots of a table."""
    name, operands, data = tape.operations[place]
    if name in ("lt", "le"):
        yield Switch(tape.at("sub", operands)), (tape.constant(1.0), tape.constant(0.0))
    elif name == "abs":
        yield Switch(operands[0]), (operands[0], tape.at("neg", operands))
    elif name == "sign":
        yield Switch(operands[0]), (tape.constant(1.0), tape.constant(-1.0))
    elif name in ("floor", "ceil", "trunc"):
        yield Switch(operands[0], whole=True), (tape.at("add", (place, tape.constant(1.0))), place)
    elif name == "mod":
        yield Switch(tape.at("div", operands), whole=True), (tape.at("add", (place, operands[1])), place)
    elif name == "table":
        for knot in data.breaks:
            yield Switch(operands[0], knot), None
