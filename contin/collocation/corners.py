"""Corners and jumps of functions: the conditions, where a solution meets them, and what they cost on its mesh.

A condition on time alone (``t < 0.4``, ``max(0, t - 1)``, a table of time) switches at known times. A condition on states or on
free parameters (``u.x > 0.3``, ``abs(u.x)``) is a selection: it switches where the solution goes.

A condition switches at a time tau in an interval [a, b] of the mesh. The equations with either outcome are smooth; the gap is
the difference of the two. A polynomial that follows one outcome over the whole interval misses the integral of the gap over the
part on the other side of tau. So the cost of a switch is the smaller one of these two integrals:

    a ------- tau --- b
      gap dt     gap dt

It is zero where tau is a mesh point, and it is zero for selections that are smooth, as a series near 0 that is joined to a
closed form.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np

from contin.arrays import Array, Indices
from contin.collocation.mesh import halved
from contin.functions.batch import Batch, Recorded
from contin.functions.tape import Tape
from contin.levels import CORRECTED


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
    States and free parameters are given by their places.
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

    - ``names`` (tuple of str): The number whose sign decides, as text.
    - ``sides`` (callable): ``sides(t, u, p)`` tells on which side of each switch points are, shape (points, selections): whole
      numbers, of other sides others.
    - ``gaps`` (callable): ``gaps(t, u, p)`` returns the values with one outcome less those with the other, shape (points,
      gaps).
    - ``of_gaps`` (ndarray of int, shape (gaps, 2)): Number of the selection, and of the value of the functions, of each gap.
    - ``known`` (ndarray of bool, shape (selections,)): The other outcome has values to compare with; it has none at the knots
      of a table.
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


#: Places on each side of a switch where the gap is looked at, as parts of the distance to the end.
_PARTS = np.array([0.1, 0.4, 0.7, 1.0])
#: Cost of a switch, relative to the size of the state, below which it lies on a mesh point; half an interval's cost, below
#: which a selection is smooth. Ten times larger is seen in the estimated discretization error, and corners in the fourth
#: derivative on 100 intervals are left inside intervals; ten times smaller would be round-off on solutions of slope 10.
_SETTLED = 1e-13
#: Distance from a switch, as a part of half an interval, at which a gap that does not vanish there is told from one that does,
#: and the part of the largest gap nearby that it has there at least. At a corner it has 1e-5 of that.
_AT_ONCE, _JUMP = 1e-5, 1e-2


class Switching(NamedTuple):
    """Places of a solution where its equations have corners or jumps, increasing.

    - ``places`` (ndarray, shape (K,))
    - ``costs`` (ndarray, shape (K,)): The error that a switch inside an interval makes, relative to the sizes of the states.
    - ``jumps`` (ndarray of bool, shape (K,)): The equations jump: the derivatives do not tell how the solution moves with the
      place.
    - ``names`` (tuple of str): The numbers whose sign decides.
    """

    places: Array
    costs: Array
    jumps: Any
    names: tuple[str, ...]

    @property
    def settled(self) -> Any:
        """Which places are mesh points, as far as that matters."""
        return self.costs <= _SETTLED


#: No places.
NOWHERE = Switching(np.empty(0), np.empty(0), np.empty(0, dtype=bool), ())


def switching(system: Any, selections: Selections, sizes: Callable[[], Array], x: Array) -> Switching:
    """Return the places of a solution x where conditions switch, without those of smooth selections.

    ``sizes()`` are those of what the values of the functions are integrated to, shape (values,).
    """
    p = system.all_parameters(x)

    def sides(t: Array) -> Array:
        return selections.sides(t, system.evaluate(x, t), p)

    mesh = system.mesh

    def largest(times: Array, places: Array, which: Indices) -> Array:
        """Return the largest gap of each switch at its times (K, parts), shape (K, parts).

        Where it is not known, as at the knots of a table, it is that of a corner: the distance, as a part of the domain.
        """
        gaps = np.abs(selections.gaps(times.ravel(), system.evaluate(x, times.ravel()), p) / units)
        found, number, parts = np.abs(times - places[:, None]) / (mesh[-1] - mesh[0]), selections.of_gaps[:, 0], times.shape[1]
        for k, selection in enumerate(which.tolist()):
            if selections.known[selection]:
                found[k] = gaps[k * parts : (k + 1) * parts, number == selection].max(axis=1, initial=0.0)
        return found

    def worst(places: Array, ends: Array, which: Indices) -> Array:
        """Return the largest gap of each switch between its place and an end, shape (K,)."""
        return largest(places[:, None] + (ends - places)[:, None] * _PARTS, places, which).max(axis=1)

    with np.errstate(all="ignore"):
        times = halved(system.nodes)
        a, b, which = brackets(times, sides(times))
        if not a.size:
            return NOWHERE
        units = sizes()[selections.of_gaps[:, 1]]
        at = np.clip(np.searchsorted(mesh, (a + b) / 2, side="right") - 1, 0, mesh.size - 2)
        half = (mesh[at + 1] - mesh[at]) / 2
        ends = np.array([np.maximum(a - half, mesh[0]), np.minimum(b + half, mesh[-1])])
        # a selection that is smooth so far out needs no place: to find places costs most
        rough = np.fmin(worst(a, ends[0], which), worst(b, ends[1], which)) * half > _SETTLED
        if not rough.any():
            return NOWHERE
        which, at, half = which[rough], at[rough], half[rough]
        places = narrowed(sides, a[rough], b[rough], which)
        ends = np.array([np.maximum(places - half, mesh[0]), np.minimum(places + half, mesh[-1])])
        inside = np.array([mesh[at], mesh[at + 1]])
        for each in np.unique(which):  # a polynomial misses no more than what lies between two switches of one condition
            (mine,) = np.nonzero(which == each)
            inside[0, mine[1:]] = np.maximum(inside[0, mine[1:]], places[mine[:-1]])
            inside[1, mine[:-1]] = np.minimum(inside[1, mine[:-1]], places[mine[1:]])
        gap = np.fmin(*[worst(places, end, which) for end in ends])
        missed = [worst(places, end, which) for end in inside]
        beside = [largest((places + (end - places) * _AT_ONCE)[:, None], places, which)[:, 0] for end in ends]
        kept = gap * half > _SETTLED
        costs = np.fmin(missed[0] * (places - inside[0]), missed[1] * (inside[1] - places))
        jumps = np.fmin(*beside) > _JUMP * gap
    edge = CORRECTED * (mesh[-1] - mesh[0])
    known = np.concatenate([[mesh[0], mesh[-1]], system.breaks])
    kept &= (np.abs(places[:, None] - known) > edge).all(axis=1)
    return _merged(Switching(places[kept], costs[kept], jumps[kept], tuple(selections.names[k] for k in which[kept])), system)


def _merged(found: Switching, system: Any) -> Switching:
    """Return the places in order, those closer than round-off made one."""
    if not found.places.size or found.places.size > MOST_SWITCHES:
        return NOWHERE
    order = np.argsort(found.places, kind="stable")
    places, costs, jumps = found.places[order], found.costs[order], found.jumps[order].astype(bool)
    names = [found.names[k] for k in order]
    apart = CORRECTED * (system.mesh[-1] - system.mesh[0])
    group = np.cumsum(np.append(0, np.diff(places) > apart))
    first = np.searchsorted(group, np.arange(group[-1] + 1))
    largest, any_jump = np.maximum.reduceat(costs, first), np.logical_or.reduceat(jumps, first)
    merged = tuple(" and ".join(dict.fromkeys(np.array(names, dtype=object)[group == k])) for k in range(first.size))
    return Switching(places[first], largest, any_jump, merged)


def joined(several: list[Switching]) -> Switching:
    """Return the places of several functions."""
    if len(several) == 1:
        return several[0]
    names = sum((each.names for each in several), ())
    places, costs, jumps = (np.concatenate([each[column] for each in several]) for column in range(3))
    order = np.argsort(places, kind="stable")
    return Switching(places[order], costs[order], jumps[order].astype(bool), tuple(names[k] for k in order))
