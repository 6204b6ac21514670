"""Functions with frozen outcomes: what a condition decides becomes an input, and the number that decides it a further value.

``abs(x)`` becomes ``side * x`` and ``a < b`` becomes ``side < 0``, where ``side`` is 1 or -1: one program serves all outcomes,
and with held sides the functions are smooth where they were not. A table of `numpy.interp` becomes its first line and, at each
knot that is on the left, the change from one line to the next.
"""

from __future__ import annotations

from collections.abc import Collection, Sequence
from typing import Any, NamedTuple

from contin.functions.tape import Number, Tape

#: Operations that a number's sign decides.
_DECIDED = ("lt", "le", "abs", "sign", "table")


class Outcomes(NamedTuple):
    """Functions with outcomes as inputs ``("side", k)``, by places on their tape.

    - ``results`` (tuple of int): The functions.
    - ``numbers`` (tuple of int): The numbers whose signs decide: they may depend on the outcomes before them. g and -g are one.
    - ``origins`` (tuple of int): The conditions as they are recorded.
    """

    results: tuple[int, ...]
    numbers: tuple[int, ...]
    origins: tuple[int, ...]


def frozen(tape: Tape, results: Sequence[int], moving: Collection[int], along: Collection[int] = ()) -> Outcomes:
    """Return functions in which every ``abs``, ``sign`` and comparison that depends on ``moving`` inputs is decided by a side.

    But for those that depend on inputs ``along`` t: they have an outcome at each place.

    Conditions inside of what is found by iteration stay as they are.

    Examples
    --------
    >>> tape = Tape()
    >>> x = tape.input(0)
    >>> found = frozen(tape, [abs(x - 1).place], [x.place])
    >>> tape.lines([*found.results, *found.numbers], {x.place: "x", tape.input(("side", 0)).place: "side"})
    ['(x - 1) * side', 'x - 1']
    """
    if not any(operation.name in _DECIDED for operation in tape.operations):
        return Outcomes(tuple(results), (), ())
    moves, zero = tape.reading([*results, *moving], moving), tape.constant(0.0)
    varies = tape.reading([*results, *along], along)
    moved: dict[Any, Any] = {}
    known: dict[int, int] = {}
    numbers, origins = list[int](), list[int]()

    def side(number: int, origin: int) -> int:
        name, operands, _ = tape.operations[number]
        opposite = {tape.at("neg", (number,)), tape.at("sub", operands[::-1]) if name == "sub" else number}
        for other in opposite & known.keys():
            return known[other] if other == number else tape.at("neg", (known[other],))
        if number not in known:
            known[number] = tape.input(("side", len(numbers))).place
            numbers.append(number)
            origins.append(origin)
        return known[number]

    for place in tape.needed(results):
        name, operands, data = tape.operations[place]
        new = tuple(moved[operand] for operand in operands)
        if name in ("root", "least") and new != operands:  # what is found by iteration reads other numbers then
            data = (tape.moved_search(tape, data[0], moved), *data[1:])
        if varies[place] or not moves[place]:
            moved[place] = place if new == operands else tape.at(name, new, data)
        elif name in ("lt", "le"):
            moved[place] = tape.at("lt", (side(tape.at("sub", new), place), zero))
        elif name in ("abs", "sign"):
            held = side(new[0], place)
            moved[place] = tape.at("mul", (held, new[0])) if name == "abs" else held
        elif name == "table" and len(data.coefficients[0]) == 2:
            x = Number(tape, new[0])
            lines = [(a, b - a * at) for at, (a, b) in zip(data.origins, data.coefficients)]
            value = lines[0][0] * x + lines[0][1]
            for knot, (a, b), (c, d) in zip(data.breaks, lines, lines[1:]):
                right = Number(tape, side((x - knot).place, place))
                value = value + (right + 1) / 2 * ((c - a) * (x - knot) + ((c - a) * knot + d - b))
            moved[place] = tape.number(value).place
        else:
            moved[place] = place if new == operands else tape.at(name, new, data)
    return Outcomes(tuple(moved[place] for place in results), tuple(numbers), tuple(origins))
