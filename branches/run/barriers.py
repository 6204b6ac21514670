"""Barriers of open strips: the energy by which a stable state must be pushed before it leaves, and what it falls into.

Stable states are looked at where a stage ends, and at the values that the scene labels. All states of the result with the same
ends and the same numbers count: each is corrected between two points of the file. From a saddle of index 1 the strip, cut into
segments, goes downhill to both sides (`ribbon_model.barriers`). Only saddles in the result are considered: another one may be
lower.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from branches.run.progress import Progress
from branches.scene.labels import begins
from branches.store.open_branch import OpenBranch
from contin import ContinError, Point
from contin.lowlevel import exact_text
from ribbon_model.barriers import KICK_OPEN, Barrier, apart, barriers, ways_down
from ribbon_model.changed_ends import corrected
from ribbon_model.descent import descend
from ribbon_model.open_segments import OpenChain, cut, unsupported
from ribbon_model.open_strip import OpenStrip

#: Two states whose places differ by less than this are one: they were corrected from two sides, on two meshes.
_SAME = 1e-6
#: Energies of two strips of segments at rest that differ by less, relative to 1 + their size, are those of images.
_EQUAL = 1e-6


@dataclass(frozen=True, eq=False)
class State:
    """A state of a result at some numbers: its name, what holds it, the corrected point, its index and its potential."""

    name: str
    strip: OpenStrip
    point: Point
    index: int
    potential: float

    def chain(self, segments: int) -> OpenChain:
        """Return the state cut into segments."""
        return cut(self.strip, self.point.system, self.point.x, segments)


@dataclass(frozen=True)
class Place:
    """All states of a result at the numbers of a labelled point, and the way out of each stable one that has one, by name."""

    stage: int
    column: str
    value: float
    states: list[State]
    ways: dict[str, Barrier]


def places(branch: OpenBranch, quiet: bool = True) -> list[Place]:
    """Return the places of a result at which a stable state and a saddle are; unless ``quiet``, a line of progress is shown."""
    found = []
    rows = list(chosen_rows(branch, stable=True))
    with Progress("places with barriers", len(rows), quiet) as progress:
        for row in rows:
            stage = int(branch.points["stage"][row])
            column = branch.followed(stage)
            place = Place(stage, column, float(branch.points[column][row]), states_at(branch, row), {})
            progress.part(_words(branch, place))
            if {0, 1} <= {state.index for state in place.states} and not unsupported(branch.scene.strip(stage)):
                place.ways.update(_ways(place.states))
                found.append(place)
            progress.part_done()
    return found


def chosen_rows(branch: OpenBranch, stable: bool = False) -> Iterator[int]:
    """Yield the points at ends of stages and labelled values, those that are ``stable`` or all, each set of numbers once."""
    seen: list[int] = []
    for event in branch.events:
        row = int(event["point"])
        if begins(event) or event["label"] not in (b"EP", b"UZ") or (stable and event["index"] != 0):
            continue
        if not any(branch.same_strip(row, other) for other in seen):
            seen.append(row)
            yield row


def states_at(branch: OpenBranch, row: int) -> list[State]:
    """Return all states of a result that have the ends and the numbers of one of its points."""
    found: list[State] = []
    for piece in branch.pieces():
        name = branch.followed(piece.stage)
        if not branch.same_strip(piece.rows[0], row, name):
            continue
        x, value = branch.points[name][piece.rows], float(branch.points[name][row])
        for i in np.flatnonzero((x[:-1] - value) * (x[1:] - value) <= 0):
            pair = piece.rows[i], piece.rows[i + 1]
            part = 0.0 if x[i] == x[i + 1] else float((value - x[i]) / (x[i + 1] - x[i]))
            state = _between(branch, pair, part, row)
            if state is not None and not any(_same(state, other) for other in found):
                found.append(state)
    return found


def _between(branch: OpenBranch, pair, part: float, row: int) -> State | None:
    """Return the state at the numbers of a point, from two neighbouring points of the file; None if there is none nearby."""
    strip = branch.scene.strip(int(branch.points["stage"][row]))
    kept = set(branch.kept().tolist())
    if not kept >= set(map(int, pair)):
        return None
    (near, x), (far, beyond) = (branch.discretized(int(one)) for one in (pair if part < 0.5 else pair[::-1]))
    weight = part if part < 0.5 else 1 - part
    states = (1 - weight) * near.states(x) + weight * far.evaluate(beyond, near.nodes)
    values = {name: float(branch.points[name][row]) for name in strip.parameters}
    try:
        point = corrected(strip, near, states, values)
        index = point.second_variation().index()
    except ContinError:
        return None
    number = int(pair[0] if part < 0.5 else pair[1])
    return State(f"point {number}", strip, point, index, strip.potential(point))


def _same(one: State, other: State) -> bool:
    t = np.linspace(0, 1, 21)
    places = [state.point.system.evaluate(state.point.x, t)[:, 4:7] for state in (one, other)]
    return bool(np.abs(places[0] - places[1]).max() < _SAME)


def _ways(states: Sequence[State]) -> dict[str, Barrier]:
    """Return the lowest way out of each stable state, by name."""
    stable, found = [state for state in states if state.index == 0], []
    for saddle in states:
        if saddle.index != 1:
            continue
        try:
            sides = ways_down(saddle.chain, apart, KICK_OPEN)
        except ValueError:  # it cannot be cut into so few segments
            continue
        if sides is not None:
            found.append((saddle.name, saddle.potential, *(_name(end, stable) for end in sides)))
    return barriers([(state.name, state.potential) for state in stable], found)


def _name(end: OpenChain, stable: Sequence[State]) -> str | None:
    """Return the name of the stable state in which a strip rests, or of one that it is an image of; None for another one."""
    rests = [(state.name, descend(state.chain(len(end.strains))).end) for state in stable]
    for name, rest in rests:
        if not apart(end, rest):
            return name
    equal = (name for name, rest in rests if abs(end.energy - rest.energy) < _EQUAL * (1 + abs(rest.energy)))
    return next((f"an image of {name}" for name in equal), None)


# --- in words ---------------------------------------------------------------------------------------------------------


def report(branch: OpenBranch, quiet: bool = True) -> list[str]:
    """Return what a run prints of the barriers of its result: nothing without a stable state and a saddle at one place."""
    found = places(branch, quiet)
    factor, unit = branch.scene.factor("potential"), branch.scene.unit("potential")
    lines = [f"to leave stable states{f', energies in {unit}' if unit else ''}:"] if found else []
    for place in found:
        energies = {state.name: state.potential for state in place.states}
        lines.append(f"  {_words(branch, place)}:")
        for state in place.states:
            if state.index != 0:
                continue
            way = place.ways.get(state.name)
            head = f"    {state.name}, energy {state.potential * factor:.6g}"
            lines.append(f"{head}: {_way(way, energies, factor)}")
    return lines


def _words(branch: OpenBranch, place: Place) -> str:
    value = exact_text(float(f"{place.value * branch.scene.factor(place.column):.6g}"))
    return f"{place.column} = {value} {branch.scene.unit(place.column)}".rstrip() + f" of stage {place.stage}"


def _way(way: Barrier | None, energies: dict[str, float], factor: float) -> str:
    """Return the way out of a stable state in words."""
    if way is None:
        return "no saddle beside it is in the result"
    behind = "a state that is not in the result" if way.behind is None else way.behind
    below = energies.get((way.behind or "").removeprefix("an image of "))
    released = "" if below is None else f", which releases {(energies[way.saddle] - below) * factor:.6g}"
    return f"push {way.height * factor:.6g} over the saddle at {way.saddle}, falls into {behind}{released}"
