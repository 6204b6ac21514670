"""Corners of a branch: where a number that decides a condition on states or parameters is zero, and the ways that leave.

Along a step outcomes are frozen (`contin.functions.outcomes`): Newton's method and the tangent see smooth equations that go on
beyond the corner, and each number that decides is a test function of them. At its zero every outcome of what is zero there is
tried: with sides s, a direction d of the null space of that F_x is a way on where s_k dg_k.d >= 0 for all numbers g_k that are
zero. Of continuous functions there is an even number of ways in all, so that one, three or five lead on: the branch goes on, or
turns, or several leave. Where no way does, the equations jump, and the branch ends.
"""

from __future__ import annotations

import functools
import itertools
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from types import MappingProxyType
from typing import Any, NamedTuple

import numpy as np

from contin import draws
from contin.arrays import Array
from contin.core.labels import Label
from contin.core.protocol import inner
from contin.core.trial import Event, Linearization, Trial, linearization
from contin.errors import ConvergenceError
from contin.events.arc import Arc, SpecialPoint
from contin.events.branch_point import locate_branch_point
from contin.events.labelled import Finding
from contin.levels import APART, CERTAIN, CORRECTED, DOUBLED, LOCATED, ROUGH, TINY
from contin.linalg.border import random_rows

#: So many conditions that meet in one point are tried with all outcomes: 64. Of more, as of equal machines, one or all change.
_MOST = 6
#: Parts of a step at which numbers are looked at between its ends, and below which part of the larger one there they may pass
#: zero twice; so many places are tried then.
_PARTS, _NEAR, _LOOKS = (0.25, 0.5, 0.75), 0.1, 4


@dataclass(frozen=True, eq=False)
class Corner(Finding):
    """A point at which conditions change their outcomes.

    - ``kind`` (str): "goes on", "fold" (the primary parameter turns), "several" (ways lead on) or "end", with the reason.
    - ``ways`` (tuple of ndarray): Unit tangents of the ways that lead on, the one nearest to the branch first.
    - ``unstable`` (tuple of int or None): Numbers of unstable eigenvalues before and, on the first way, behind it.
    """

    kind: str
    ways: tuple[Array, ...]
    unstable: tuple[int | None, int | None]
    nullity = 0

    def __repr__(self) -> str:
        return f"Corner({self.kind!r}, {len(self.ways)} way{'s' * (len(self.ways) != 1)}, unstable {self.unstable})"

    @property
    def is_branch_point(self) -> bool:  # type: ignore[override]
        """Several ways lead on."""
        return len(self.ways) > 1

    @property
    def leaving(self) -> tuple[Array, ...]:
        """The ways."""
        return self.ways

    @property
    def arrays(self) -> dict[str, Array]:
        return {"tangents": np.array(self.ways)}

    @property
    def numbers(self) -> dict[str, Any]:
        return {"corner": self.kind, "unstable": self.unstable}


class Way(NamedTuple):
    """A way that leaves a corner: the system with its outcomes, and the unit tangent."""

    system: Any
    tangent: Array


def conditions(system: Any) -> list[Event]:
    """Return the test functions of conditions that unknowns decide: positive beyond the frozen outcome; one for all knots."""
    knots = list(system.knots) if system.conditions else []
    groups = [[k] for k in range(system.conditions) if k not in set(knots)] + [knots] * bool(knots)
    return [_condition(group) for group in groups]


def hit_of(test: Event, trial: Trial) -> int:
    """Return the condition whose number is zero at a point that a test function has found."""
    return max(map(int, test.name.split()), key=lambda k: _beyond(trial)[k])


def _condition(group: list[int]) -> Event:
    def between(arc: Arc, _: object) -> list[SpecialPoint] | None:
        if arc.passes(test):
            return [] if refrozen(arc.trial) is not None else None
        part, looks = comes_near(test, arc.before, arc.trial), 0
        while ROUGH < part < 1 - ROUGH and looks < _LOOKS:
            there = arc.low + part * (arc.step - arc.low), arc.near(arc.low + part * (arc.step - arc.low))
            if there[1].value(test) >= 0:
                return [arc.locate(test, (arc.low, arc.before), there)]
            first, middle, last = (end.value(test) for end in (arc.before, there[1], arc.trial))
            slope = (middle - first) / part
            bend = (last - first - slope) / (1 - part)  # of the parabola through all three
            part, looks = (part - slope / bend) / 2 if bend < 0 else 0.0, looks + 1
        return []

    given: Any = {"function": lambda trial: float(_beyond(trial)[group].max()), "search": between}
    test = Event(Label.CORNER, " ".join(map(str, group)), terminal=True, limit=True, **given)
    return test


@functools.lru_cache(maxsize=8)
def _beyond(trial: Trial) -> Array:
    """Return how far a point lies beyond each outcome, less what Newton's method leaves: a number that stays zero is none."""
    values, slopes = trial.system.numbers(trial.x)
    return np.asarray(-trial.system.sides * values - _level(slopes, trial.x, CERTAIN * CORRECTED))


def comes_near(test: Event, before: Trial, trial: Trial) -> float:
    """Return the part of a step at which a test function is largest, by the cubic through both ends; 0 if it is not near zero.

    It may be positive inside where both ends are negative.
    """
    ahead = trial.x - before.x
    length = np.sqrt(inner(trial.system, ahead, ahead))
    a, b = length * before.tangent, length * trial.tangent
    cubic = (before.x + s * (a + s * (3 * ahead - 2 * a - b + s * (a + b - 2 * ahead))) for s in _PARTS)
    values = [test.function(Trial.without_tangent(trial.system, x)) for x in cubic]
    best = int(np.argmax(values))
    return _PARTS[best] if values[best] > -_NEAR * max(abs(before.value(test)), abs(trial.value(test))) else 0.0


def _level(slopes: Array, x: Array, part: float, least: float | None = None) -> Any:
    """Return by how much numbers change where the unknowns change by a ``part`` of their size, and by ``least`` (the same)."""
    return np.abs(slopes) @ (part * np.abs(x) + (part if least is None else least)) + TINY


def with_outcomes(system: Any, x: Array, forced: Mapping[int, float] = MappingProxyType({})) -> Any:
    """Return a system with the outcomes at x, some of them forced; later ones may depend on those before."""
    sides = np.array(system.sides) if system.sides.size else np.ones(system.conditions)
    sides[list(forced)] = list(forced.values())
    for _ in sides:  # one round more of conditions is right each time
        found = system.with_sides(sides)
        before, sides = sides, np.where(found.numbers(x)[0] >= 0, 1.0, -1.0)
        sides[list(forced)] = list(forced.values())
        if np.array_equal(sides, before):
            break
    return system.with_sides(sides)


def changed_between(before: Trial, behind: Trial) -> list[str]:
    """Return the conditions that change between two points of a curve in two parameters, as they are written."""
    base = before.system.solution
    if not (before.system.on_curve and base.conditions):
        return []
    sides = [with_outcomes(at.system.solution, at.x[: at.system.solution.size]).sides for at in (before, behind)]
    return [base.written(int(k), 0.0) for k in np.flatnonzero(sides[0] != sides[1])]


@functools.lru_cache(maxsize=2)
def refrozen(trial: Trial) -> Any:
    """Return the system with the outcomes at a point beyond some; None where the equations have other values with them.

    They have the same where two formulas for one function are joined, as a quotient and a series where it is 0 / 0.
    """
    system, x = trial.system, trial.x
    there = with_outcomes(system, x)
    ours, theirs = system.slopes(x), there.slopes(x)
    level = _level(np.abs(theirs).max(axis=0), x, CERTAIN * CORRECTED)
    gap = np.abs(there.residual(x) - system.residual(x)).max()
    same = gap <= level and np.abs(theirs - ours).max() <= LOCATED * np.abs(theirs).max()
    return there if same else None


def zeros(system: Any, x: Array) -> list[int]:
    """Return the conditions whose numbers are zero at x, and change beside it."""
    values, slopes = system.numbers(x)
    return np.flatnonzero((np.abs(values) <= _level(slopes, x, LOCATED, CERTAIN * CORRECTED)) & slopes.any(axis=1)).tolist()


def ways(system: Any, x: Array, zero: Sequence[int]) -> tuple[list[Way], str, bool]:
    """Return the ways that leave x with any outcomes of conditions, why some have none, and whether slopes jump."""
    found, missing, slopes, noise, residual = list[Way](), "", list[Array](), np.zeros(1), system.residual(x)
    held, few = system.sides[list(zero)], len(zero) <= _MOST
    for sides in (
        itertools.product((1.0, -1.0), repeat=len(zero)) if few else (held, -held, *held * (1 - 2 * np.eye(len(zero))))
    ):
        there = with_outcomes(system, x, dict(zip(zero, sides)))
        with np.errstate(all="ignore"):
            jacobian = there.slopes(x)
            if not all(np.isfinite(each).all() for each in (jacobian, *map(there.slopes, _beside(x, LOCATED)))):
                missing = "derivatives are not finite"  # as those of a root that begins there
                continue
            if np.abs(there.residual(x) - residual).max() > _level(np.abs(jacobian).max(axis=0), x, DOUBLED):
                missing = "the equations jump"
                continue
            slopes.append(jacobian)
            changes = draws.spread("corner", lambda random: there.slopes(draws.rounded(random, x)) - jacobian)  # noqa: B023
            noise = np.maximum(noise, changes)
            tangents = _tangents(there, x)
        rates = np.array(sides)[:, None] * there.numbers(x)[1][list(zero)]
        for tangent in tangents:
            known = any(np.abs(tangent - way.tangent).max() < DOUBLED for way in found)
            if not known and np.all(rates @ tangent >= -_level(rates, tangent, LOCATED, CORRECTED)):
                found.append(Way(there, tangent))
    bends = any(np.any(np.abs(each - slopes[0]) > CERTAIN * noise + LOCATED * np.abs(each).max()) for each in slopes[1:])
    return found, missing, bends


def _beside(x: Array, part: float) -> Array:
    """Return two places on both sides of x, shape (2, size)."""
    return x + np.outer([1, -1], part * (1 + np.abs(x)) * np.sign(random_rows(1, x.size)[0]))


def _tangents(system: Any, x: Array) -> list[Array]:
    """Return the unit tangents at x, both ways; where two branches cross with these outcomes, those of both."""
    slopes = [each for each in map(system.slopes, (x, *_beside(x, ROUGH))) if np.isfinite(each).all()]
    row, any_way = random_rows(2, system.size) * np.sqrt(system.weights)
    with np.errstate(all="ignore"):
        linear = linearization(system, x, row)
        response: Any = linear.factors and np.abs(linear.factors.solve(any_way)).max()
    if response * LOCATED * max(np.linalg.norm(each) for each in slopes) < np.linalg.norm(any_way):
        found = [linear.tangent]
    else:
        try:
            point = locate_branch_point(system, x)
        except ConvergenceError:
            return []
        found = list(point.tangents) if np.abs(point.x - x).max() < APART * (1 + np.abs(x).max()) else []
    return [sign * each for each in found for sign in (1, -1)]


def corner_at(point: SpecialPoint, came: Array, hit: int, primary: str) -> tuple[SpecialPoint | None, list[Way]]:
    """Return the corner where the condition ``hit`` is zero, None where all is smooth there, and the ways that lead on.

    ``came`` is the tangent of the branch before it.
    """
    system = point.trial.system
    x = _polished(system, point.trial.x, hit)
    zero = sorted({hit, *zeros(system, x)})
    every, missing, bends = ways(system, x, zero)
    on = {number: inner(system, way.tangent, came) for number, way in enumerate(every)}
    leading = [every[number] for number in sorted(on, key=lambda number: -on[number]) if on[number] > APART - 1]
    if len(leading) == 1 and not (missing or bends):
        return None, leading
    turns = len(leading) == 1 and (leading[0].tangent * came)[system.parameter_index(primary)] < 0
    kind = "fold" if turns else "goes on" if leading else f"end, {missing or 'no way leads on'}"
    kind = "several" if len(leading) > 1 else kind
    unstable = [each.unstable(x) for each in (system, *(way.system for way in leading[:1]))]
    found = Corner(kind, tuple(way.tangent for way in leading), (unstable[0], unstable[-1]))
    behind = leading[0].system.sides if leading else -system.sides
    changed = [k for k in zero if behind[k] != system.sides[k]] or zero  # a contact that stays is none of it
    name = f"{' and '.join(system.written(k, behind[k]) for k in changed)}: {kind}"
    return replace(
        point, trial=Trial(system, x, Linearization(came, point.trial.sign)), name=name, stop=None, details=found
    ), leading


def on_mesh_of(system: Any, way: Way, x: Array, hit: int) -> tuple[Any, Array, Array]:
    """Return the system of a way from the corner x on the mesh of a system, and the corner and the unit tangent there."""
    if not system.intervals:
        return way.system, x, way.tangent
    there = system.with_sides(way.system.sides)
    carry = way.system.carrier(there)
    x = _polished(there, carry(x), hit)
    return there, x, linearization(there, x, there.weights * carry(way.tangent)).tangent


def _polished(system: Any, x: Array, hit: int) -> Array:
    """Return the point at which a number is zero."""
    for _ in range(3):
        values, slopes = system.numbers(x)
        with np.errstate(all="ignore"):
            residual, factors = system.linearize(x, (slopes[hit],))
            moved = x - factors.solve(np.append(residual, values[hit]))
        if not np.abs(moved - x).max() < ROUGH * (1 + np.abs(x).max()):
            return x  # beside it the equations are singular
        x = moved
    return x
