"""Barriers and snaps of open strips and networks: what it takes to leave a stable state, and what it falls into.

Stable states are looked at where a stage ends, and at the values that the scene labels. All states of the result with the same
ends and the same numbers count: each is corrected between two points of the file. From a saddle of index 1 the strip, cut into
segments, goes downhill to both sides (`ribbon_model.barriers`). Only saddles in the result are considered: another one may be
lower. A fold at which a stable piece ends is passed by a hundredth, and the strip goes downhill from there.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from functools import partial
from typing import TYPE_CHECKING

import numpy as np

from branches.run.display import Progress
from branches.scene.labels import begins
from branches.store.open_branch import OpenBranch
from contin import ContinError, Point
from contin.lowlevel import exact_text, levels
from ribbon_model.barriers import KICK_OPEN, SEGMENTS, Barrier, apart, at_rest, barriers, ways_down
from ribbon_model.changed_supports import corrected
from ribbon_model.descent import LONGEST, PAST, descend
from ribbon_model.equilibrium import CENTRELINE
from ribbon_model.network_segments import NetworkChain, cut, unsupported

if TYPE_CHECKING:
    from branches.scene.open_stage import OpenStage


@dataclass(frozen=True, eq=False)
class State:
    """A state of a result at some numbers: its name, its stage, the corrected point, its index and its potential."""

    name: str
    stage: OpenStage
    point: Point
    index: int
    potential: float

    def chain(self, segments: int) -> NetworkChain:
        """Return the state cut into segments."""
        return cut(self.stage.strip, self.point.system, self.point.x, segments)


@dataclass(frozen=True)
class Place:
    """All states of a result at the numbers of a labelled point, and the way out of each stable one that has one, by name.

    The point is in the ``row`` of the table of points.
    """

    row: int
    states: list[State]
    ways: dict[str, Barrier]


def places(branch: OpenBranch, quiet: bool = True) -> list[Place]:
    """Return the places of a result at which a stable state and a saddle are; unless ``quiet``, a line of progress is shown."""
    found = []
    rows = list(chosen_rows(branch, stable=True))
    with Progress("places with barriers", len(rows), quiet) as progress:
        for row in progress.each(rows, partial(where, branch)):
            states = states_at(branch, row)
            if {0, 1} <= {state.index for state in states} and not unsupported(branch.stage_at(row).strip):
                found.append(Place(row, states, _ways(states)))
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


def states_at(branch: OpenBranch, row: int, value: float | None = None) -> list[State]:
    """Return all states of a result that have the ends and the numbers of one of its points.

    A ``value`` is that of the number which is followed there, in place of the point's.
    """
    found: list[State] = []
    for piece in branch.pieces():
        name = branch.followed(piece.stage)
        if not branch.same_strip(piece.rows[0], row, name):
            continue
        here = branch.stage_at(row).follow
        if value is not None and name != here:
            continue
        x, at = branch.points[name][piece.rows], float(branch.points[name][row]) if value is None else value
        there = np.abs(x - at) <= levels.APART * (1 + abs(at))  # two ends that are located there may be there
        gaps = np.where(there, 0.0, x - at)
        for i in np.flatnonzero(gaps[:-1] * gaps[1:] <= 0):
            pair = piece.rows[i], piece.rows[i + 1]
            part = 0.0 if x[i] == x[i + 1] else float((at - x[i]) / (x[i + 1] - x[i]))
            state = _between(branch, pair, part, row, {} if value is None else {here: value})
            if state is not None and not any(_same(state, other) for other in found):
                found.append(state)
    return found


def _between(branch: OpenBranch, pair, part: float, row: int, others: dict[str, float]) -> State | None:
    """Return the state at the numbers of a point but for ``others``, from two neighbouring kept points; None without one."""
    stage = branch.stage_at(row)
    strip = stage.strip
    kept = set(branch.kept().tolist())
    if not kept >= set(map(int, pair)):
        return None
    (near, x), (far, beyond) = (branch.discretized(int(one)) for one in (pair if part < 0.5 else pair[::-1]))
    weight = part if part < 0.5 else 1 - part
    states = (1 - weight) * near.states(x) + weight * far.evaluate(beyond, near.nodes)
    values = {name: float(branch.points[name][row]) for name in strip.parameters if name in branch.points.dtype.names} | others
    try:
        point = corrected(strip, near, states, values)
        index = point.second_variation().index()
    except ContinError:
        return None
    number = int(pair[0] if part < 0.5 else pair[1])
    return State(f"point {number}", stage, point, index, strip.potential(point))


def _same(one: State, other: State) -> bool:
    t, problem = np.linspace(0, 1, 21), one.point.system.problem
    where = [at for at, name in enumerate(problem.state_names) if name.startswith(CENTRELINE)]
    places = [state.point.system.evaluate(state.point.x, t)[:, where] for state in (one, other)]
    return bool(np.abs(places[0] - places[1]).max() < levels.APART * one.stage.scene.longest)


def _ways(states: Sequence[State]) -> dict[str, Barrier]:
    """Return the lowest way out of each stable state, by name."""
    stable, found = [state for state in states if state.index == 0], []
    for saddle in states:
        if saddle.index != 1:
            continue
        length = saddle.stage.scene.longest
        try:
            sides = ways_down(saddle.chain, apart, KICK_OPEN / length, LONGEST / length)
        except ValueError:  # it cannot be cut into so few segments
            continue
        if sides is not None:
            found.append((saddle.name, saddle.potential, *(_name(end, stable) for end in sides)))
    return barriers([(state.name, state.potential) for state in stable], found)


def _name(end: NetworkChain, stable: Sequence[State]) -> str | None:
    """Return the name of the stable state in which a strip rests, or of one that it is an image of; None for another one."""
    rests = [(one.name, descend(one.chain(end.asked), longest=LONGEST / one.stage.scene.longest).end) for one in stable]
    if same := next((name for name, rest in rests if not apart(end, rest)), None):
        return same
    equal = (name for name, rest in rests if abs(end.energy - rest.energy) < levels.APART * (1 + abs(rest.energy)))
    return next((f"an image of {name}" for name in equal), None)


# --- snaps ------------------------------------------------------------------------------------------------------------


@dataclass(frozen=True)
class Fall:
    """What a strip does past a fold at which a stable piece ends: the row of the fold, and the released energy.

    ``column`` is the number that is followed, and ``value`` the one at which the strip is let go. ``into`` is the name of the
    state in which it comes to rest, None for one that is not in the result.
    """

    row: int
    column: str
    value: float
    released: float
    into: str | None


def falls(branch: OpenBranch, quiet: bool = True) -> list[Fall]:
    """Return what the strip does past each fold at which a stable piece ends, where it comes to rest."""
    rows = [
        int(event["point"])
        for event in branch.events if event["label"] == b"LP" and 0 in (event["index_before"], event["index_after"])
    ]  # fmt: skip
    with Progress("folds", len(rows), quiet) as progress:
        found = [_fall(branch, row) for row in progress.each(rows, lambda row: branch.stage_at(row).follow)]
    return [fall for fall in found if fall is not None]


def _fall(branch: OpenBranch, row: int) -> Fall | None:
    stage = branch.stage_at(row)
    if row not in branch.kept() or unsupported(stage.strip):
        return None
    column, length = stage.follow, branch.scene.longest
    limit, before = (float(branch.points[column][at]) for at in (row, row - 1))
    size = max(abs(limit), float(np.abs(branch.points[column]).max()) / 10)  # no unit counts
    value = limit + math.copysign(PAST * size, limit - before)
    try:
        chain = cut(stage.strip, *branch.discretized(row), SEGMENTS)
        chain = replace(chain, numbers={**chain.numbers, column: value}).moved(np.zeros(chain.size))
        end = at_rest(chain, KICK_OPEN / length, LONGEST / length)
    except ValueError:  # it cannot be held past the fold, or be cut into so few segments
        return None
    if end is None:
        return None
    stable = [state for state in states_at(branch, row, value) if state.index == 0]
    return Fall(row, column, value, chain.energy - end.energy, _name(end, stable))


# --- in words ---------------------------------------------------------------------------------------------------------


def report(branch: OpenBranch, quiet: bool = True) -> list[str]:
    """Return what a run prints of barriers, at places with a stable state and a saddle, and of folds at which strips snap."""
    found, snaps = places(branch, quiet), falls(branch, quiet)
    factor, unit = branch.scene.factor("potential"), branch.scene.unit("potential")
    energies_in = f", energies in {unit}" if unit else ""
    lines = [f"to leave stable states{energies_in}:"] if found else []
    for place in found:
        energies = {state.name: state.potential for state in place.states}
        lines.append(f"  {where(branch, place.row)}:")
        for state in place.states:
            if state.index != 0:
                continue
            way = place.ways.get(state.name)
            head = f"    {state.name}, energy {state.potential * factor:.6g}"
            lines.append(f"{head}: {_way(way, energies, factor)}")
    lines += [f"past folds at which stable states end{energies_in}:"] if snaps else []
    for fall in snaps:
        lines.append(f"  {where(branch, fall.row)}, point {fall.row}: {told(branch, fall)}")
    return lines


def told(branch: OpenBranch, fall: Fall) -> str:
    """Return into what a strip falls past a fold, and how much energy that releases, in words without a unit."""
    into = fall.into or "a state that is not in the result"
    return f"falls into {into}, which releases {fall.released * branch.scene.factor('potential'):.6g}"


def where(branch: OpenBranch, row: int) -> str:
    """Return the value of the number that is followed at a point, and its stage, in words."""
    stage = branch.stage_at(row)
    column = stage.follow
    number = exact_text(float(f"{branch.points[column][row] * branch.scene.factor(column):.6g}"))
    return f"{column} = {number} {branch.scene.unit(column)}".rstrip() + f" of stage {stage.number}"


def _way(way: Barrier | None, energies: dict[str, float], factor: float) -> str:
    """Return the way out of a stable state in words."""
    if way is None:
        return "no saddle beside it is in the result"
    behind = "a state that is not in the result" if way.behind is None else way.behind
    below = energies.get((way.behind or "").removeprefix("an image of "))
    released = "" if below is None else f", which releases {(energies[way.saddle] - below) * factor:.6g}"
    return f"push {way.height * factor:.6g} over the saddle at {way.saddle}, falls into {behind}{released}"
