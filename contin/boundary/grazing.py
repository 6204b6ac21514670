"""Grazing: a number that decides a condition touches zero inside the interval, and two switching times appear or vanish.

The excess is the number at a maximum over t, and minus the number at a minimum: it is positive where the number crosses zero on
both sides. Between the ends of a step on which a number has more and fewer zeros over t, an excess is zero. Where the equations
have a corner and do not jump the solution there is smooth; with g the number and t the time of its extremum it solves

    F(x) = 0,   g(t, u(t), p) = 0,    matrix  [ F_x              ]
                                              [ g_u phi(t) | g_p ],

phi the interpolation of the states: g does not change with t to first order. Behind it the equations are other ones for a time
that grows as the square root of the excess, and some branches bend sharply.
"""

from __future__ import annotations

import functools
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any, NamedTuple, cast

import numpy as np

from contin.arrays import Array, Indices
from contin.boundary.crossings import changes, deciding, ends_of, highest, outcomes
from contin.collocation.mesh import halved, interpolation, moved_to_breaks
from contin.core.labels import Label
from contin.core.newton import Newton, correct
from contin.core.protocol import Carrier, inner
from contin.core.step import ROUNDS, State, settled
from contin.core.trial import Event, Linearization, Trial, linearization
from contin.errors import ConvergenceError
from contin.events.arc import Arc, SpecialPoint
from contin.events.labelled import Finding
from contin.functions.origin import source
from contin.levels import APART, BESIDE, DOUBLED, LOCATED, MOST_UPDATES, ROUGH, TINY

#: Half the time, as a part of the domain, for which the equations are other ones at the first point behind a grazing point: the
#: largest for which Newton's method converges is taken. At the last one the excess is round-off.
_LASTS = (1e-3, 1e-4, 1e-5, 1e-6)
#: Solutions with given times between crossings behind a jump: each shrinks the error of their middle by the time between them.
_WINDOWS = 4


class Extremum(NamedTuple):
    """An extremum over t of the number that decides a condition: ``side`` 1 of a maximum, -1 of a minimum."""

    condition: int
    time: float
    side: float
    excess: float = 0.0

    def at(self, system: Any, x: Array) -> Extremum:
        """Return the one near it of another solution."""
        near, wide = [np.array([each]) for each in (self.time, self.side, self.condition)], np.diff(system.nodes).mean()
        (time,), (excess,) = highest(_there(system, x), near[0], wide, *near[1:])
        return self._replace(time=float(time), excess=float(excess))

    def nearest(self, system: Any, others: list[Extremum]) -> Extremum | None:
        """Return the one of the same kind that is nearest in time; None without any."""
        rounds = system.order if system.is_cycle else np.inf
        apart = [(min(abs(self.time - each.time), rounds - abs(self.time - each.time)), each) for each in others]
        return min((each for each in apart if each[1][::2] == self[::2]), default=(0.0, None))[1]


class Numbers(NamedTuple):
    """The numbers that decide, over t.

    - ``zeros`` (ndarray of int, shape (conditions,)): Numbers of their zeros.
    - ``ends`` (ndarray, shape (2, conditions)): Their signs at both ends; zero for a cycle, which has none.
    - ``sizes`` (ndarray, shape (conditions,)): From their least to their largest values.
    - ``extrema`` (list of Extremum): Those whose values are not near zero are known at points of the mesh only.
    """

    zeros: Indices
    ends: Array
    sizes: Array
    extrema: list[Extremum]


def _there(system: Any, x: Array) -> Any:
    """Return the function that gives the numbers that decide at times, shape (times, conditions)."""
    batch, p = system.problem.batch("field"), system.all_parameters(x)
    return lambda times: deciding(batch, times, system.evaluate(x, times), p)


def numbers(system: Any, x: Array) -> Numbers:
    """Return the numbers that decide the conditions of a solution, over a whole round of a cycle."""

    def made() -> Numbers:
        there, cyclic, t = _there(system, x), system.is_cycle, halved(system.nodes)
        t = t[np.unique(np.round((t - t[0]) / np.ptp(t) / BESIDE), return_index=True)[1]]  # closer ones differ by round-off
        t[-1] = system.mesh[-1]
        if cyclic:
            t = (t[:-1] + np.arange(system.order)[:, None]).ravel()
            t = np.concatenate([[t[-1] - system.order], t, [t[0] + system.order]])
        h = there(t)
        change, sides, sizes = np.diff(h, axis=0), np.where(h >= 0, 1.0, -1.0), np.ptp(h, axis=0)
        zeros = (sides[1:] != sides[:-1])[int(cyclic) :].sum(axis=0)
        i, k = np.nonzero(np.sign(change[:-1]) * np.sign(change[1:]) < 0)
        times, side = t[i + 1], np.sign(change[i, k])
        values = side * h[i + 1, k]
        near = np.abs(values) <= 2 * np.maximum(np.abs(change[i, k]), np.abs(change[i + 1, k]))
        times[near], peaks = highest(there, times[near], (t[i + 2] - t[i])[near] / 2, side[near], k[near])
        crosses = peaks > LOCATED * sizes[k[near]]  # one that touches does not cross
        np.add.at(zeros, k[near], 2 * crosses - 2 * (values[near] > 0))
        values[near] = peaks
        extrema = [Extremum(*each) for each in zip(*(each.tolist() for each in (k, times, side, values)))]
        return Numbers(zeros, sides[[0, -1]] * (not cyclic), sizes, extrema)

    found: Numbers = system._once("numbers over t", x, made)
    return found


@dataclass(frozen=True, eq=False)
class Touch(Finding):
    """A grazing point.

    - ``names`` (tuple of str): The conditions, as they are written.
    - ``extrema`` (tuple of Extremum): Of the numbers that touch zero.
    - ``folds`` (bool): The primary parameter turns there.
    - ``jumps`` (float): 1 where the equations jump and the branch leads to the crossings, -1 where it comes from them, else 0.
    """

    names: tuple[str, ...]
    extrema: tuple[Extremum, ...]
    x: Array
    folds: bool = False
    jumps: float = 0.0
    nullity = 0
    has_equations = True

    @property
    def times(self) -> tuple[float, ...]:
        """When the numbers touch zero: values of t; of a cycle, parts of the period or of what a symmetry leaves of it."""
        return tuple(each.time for each in self.extrema)

    @property
    def text(self) -> str:
        """What touches, and when."""
        places = (f"{name}, at t = {time:.6g}" for name, time in zip(self.names, self.times))
        return " and ".join(places) + ": fold" * self.folds

    @property
    def numbers(self) -> dict[str, Any]:
        """What is stored."""
        return {"touch": [self.names, self.extrema, self.folds]}

    def again(self, system: Any, carry: Carrier, x: Array, newton: Newton) -> Touch:
        """Return the same on another mesh."""
        x = _touching(system, carry(x), self.extrema[0], newton)
        return replace(self, x=x, extrema=tuple(each.at(system, x) for each in self.extrema))

    def beyond(self, trial: Trial, newton: Newton) -> tuple[Any, Array, Array]:
        """Return system, x and tangent of a point behind this one; raise ConvergenceError where none is found.

        The excess of the first number is held, and mesh points lie where the numbers change their signs. Where it falls there
        is no need: the solution becomes smooth.
        """
        first, length, problem = self.extrema[0], np.ptp(trial.system.mesh), ConvergenceError("no point is found behind it")
        there, around = _there(trial.system, trial.x), first.time + ROUGH * length * np.array([-1.0, 0.0, 1.0])
        bend = -first.side * (there(around)[:, first.condition] @ [1, -2, 1]) / (ROUGH * length) ** 2
        rate = first.side * _number(trial.system, trial.x, first)[1] @ trial.tangent
        for half in np.array(_LASTS) * length if rate > 0 or self.jumps else ():
            try:
                other, x, start = self._across(trial, half, bend, newton)
                for _ in range(ROUNDS):
                    row = _number(other, x, first)[1]
                    x = correct(other, x, row, row @ x, newton).x
                    moved = other.on_switches(x)
                    if moved is None and any(min(each.rates) <= 0 for each in other.crossings(x)):
                        raise ConvergenceError("a solution there would slide")
                    if moved is None:
                        row = other.weights * (x - start) if self.jumps else first.side * row
                        return *other.crossed(x), linearization(other, x, row).tangent
                    other, x, start = moved[0], moved[1](x), moved[1](start)
            except ConvergenceError as error:
                problem = error
        raise problem

    def _across(self, trial: Trial, half: float, bend: float, newton: Newton) -> tuple[Any, Array, Array]:
        """Return system, x and the grazing solution on a mesh with points around extrema; raise ConvergenceError without any.

        With crossings of jumps the solution changes with the time 2 ``half`` between them, and their middle with it, but the
        excess with its square. So times and excess follow from solutions with given times at which outcomes change.
        """
        system, extrema, height = trial.system, self.extrema, (self.jumps or 1.0) * bend * half**2 / 2
        for _ in range(_WINDOWS if self.jumps > 0 else 1):
            places = np.add.outer([each.time for each in extrema], [-half, half]).ravel()
            places = places % 1.0 if system.is_cycle else places
            breaks = np.append(system._all_breaks(trial.x, closely=False), places)
            other, carry = system.on_mesh(moved_to_breaks(system.mesh, np.unique(breaks)))
            x = start = carry(trial.x)
            other = with_sides_near(other, x, extrema, half) if self.jumps > 0 else other
            held = other.with_pieces(other._pieces, crosses=0)
            value, row, _ = _number(held, x, extrema[0])
            x = correct(held, x, row, row @ x - value + extrema[0].side * height, newton).x
            ends = [each.side * _there(held, x)(each.time + half * np.array([-1, 1]))[:, each.condition] for each in extrema]
            extrema = tuple(each._replace(time=each.time + (b - a) / (2 * half * bend)) for each, (a, b) in zip(extrema, ends))
            height -= ends[0].mean() * (self.jumps > 0)
        if self.jumps * height < 0:
            raise ConvergenceError("the number does not come back to zero")
        return other, x, start


def with_sides_near(system: Any, x: Array, extrema: Sequence[Extremum] = (), away: float = 0.0) -> Any:
    """Return the same with frozen outcomes: those of x but, of the numbers of extrema, within a time ``away`` their own.

    With ``away`` zero it is the other outcome, as long as they have their own.
    """
    t, h, sides = (system.mesh[1:] + system.mesh[:-1]) / 2, np.diff(system.mesh), system.outcomes.copy()
    if not sides.size:
        sides = outcomes(system.problem.batch("field"), t, system.evaluate(x, t), system.all_parameters(x))
    for each in extrema:
        apart = (t - each.time + 0.5) % 1 - 0.5 if system.is_cycle else t - each.time
        order, own = np.argsort(apart), sides[:, each.condition] == each.side
        pieces = np.cumsum(np.diff(own[order], prepend=False))[np.argsort(order)]
        first = int(np.where(own, np.abs(apart), np.inf).argmin())
        if away:
            sides[np.abs(apart) < away, each.condition] = each.side
        elif own.any() and abs(apart[first]) < h[first]:
            sides[pieces == pieces[first], each.condition] = -each.side
    at = changes(sides)
    return system.with_pieces((system.mesh[at], sides[[0, *at]]))


def _number(system: Any, x: Array, at: Extremum) -> tuple[float, Array, float]:
    """Return a number that decides, its derivatives by x, and by how much the equations' derivatives jump where it is zero.

    The last is relative to the largest; it is NaN where the equations jump themselves.
    """
    n, k, rounds = system.states_count, at.condition, int(np.floor(at.time)) if system.is_cycle else 0
    times, every, time = np.array([at.time]), range(len(system.parameters)), at.time - rounds
    side = outcomes(system.problem.batch("field"), times, system.evaluate(x, times), system.all_parameters(x))[0]
    given = times, system.evaluate(x, times) / system.scales.states, np.empty((0, n)), system.scaled_parameters(x)
    (f, number), (g, _) = (
        system._field.frozen(every, each) for each in (side, np.where(np.arange(side.size) == k, -side, side))
    )
    columns = number.columns(system._free)
    (value,), (slope,) = (each[0, [k]] for each in number.jacobian(*given, columns))
    by_state = slope[:n] @ np.linalg.matrix_power(system.turn, rounds) if rounds else slope[:n]
    j = min(max(int(np.searchsorted(system.mesh, time, side="right")) - 1, 0), system.intervals - 1)
    within = np.array([(time - system.mesh[j]) / (system.mesh[j + 1] - system.mesh[j])])
    row = np.append(np.zeros(system.state_size), slope[n:])
    weights = interpolation(system.basis.nodes, system.basis.barycentric, within)[0]
    row[: system.state_size].reshape(-1, n)[system.by_interval[j]] = np.outer(weights, by_state)
    (one, by_one), (two, by_two) = (each.jacobian(*given, columns) for each in (f, g))
    change, gap = np.abs(by_one - by_two).max(), np.abs(one - two).max()  # of a corner the gap is in proportion to the number
    jumps = gap > ROUGH * np.abs(one).max() + 2 * abs(value) * change / max(np.abs(slope).max(), TINY)
    return float(value), row, np.nan if jumps else float(change / np.abs(by_one).max())


def _touching(system: Any, x: Array, near: Extremum, newton: Newton) -> Array:
    """Return the solution near x at which a number touches zero; raise ConvergenceError where none is found."""
    last = np.inf
    for _ in range(MOST_UPDATES):
        near = near.at(system, x)
        value, row, _ = _number(system, x, near)
        residual, factors = system.linearize(x, (row,))
        change = factors.solve(np.append(residual, value))
        x, size = x - change, float(np.abs(change / (1 + np.abs(x))).max())
        if size <= newton.tolerance or LOCATED > size > last / 2:
            return x
        last = size
    raise ConvergenceError("the grazing point is not found")


def _changes(arc: Arc) -> Indices:
    """Return by how much the numbers of zeros change in a step, but for those that pass an end of the domain."""
    first, last = (numbers(end.settled.system, end.settled.x) for end in (arc.before, arc.trial))
    change = last.zeros - first.zeros
    return np.where(np.abs(change) > (first.ends != last.ends).sum(axis=0), change, 0)


def _is_alike(one: Extremum, other: Extremum, known: Numbers, part: float) -> bool:
    """Return whether two numbers touch zero at once."""
    return abs(one.excess - other.excess) <= part * abs(other.excess) + DOUBLED * known.sizes[one.condition]


def _located(arc: Arc, pending: list[Extremum], ahead: bool) -> tuple[SpecialPoint | None, list[Extremum]]:
    """Return the point of a step at which the first of some numbers touches zero, and those that do not touch there.

    There is no point where the number has no corner. Where the equations jump it is a point ``ahead``, with the outcomes of the
    solution that does not cross: no step passes it.
    """
    system, first = cast(Any, arc.state.system), pending[0]
    before, after = (first.at(system, end.x).excess for end in (arc.before, arc.trial))
    part = float(np.clip(before / (before - after), 0, 1)) if before != after else 1.0
    batch, x = system.problem.batch("field"), arc.guess(arc.low + (arc.step - arc.low) * part)
    names = [source(batch, place) or "a condition" for place in batch.conditions(range(len(system.parameters)))]
    try:
        known = numbers(system, x)
        near, jumps = first.nearest(system, known.extrema) or first, 0.0
        if np.isnan(_number(system, x, near)[2]) or (ahead and before > 0 and system.outcomes.size):
            if not ahead:
                return None, pending[1:]
            jumps = 1.0 if before < 0 else -1.0
            alike = [each for each in known.extrema if _is_alike(each, near, known, ROUGH)]
            system = with_sides_near(system, x, alike)
        x = _touching(system, x, near, arc.newton)
        at = inner(system, arc.state.tangent, x - arc.state.x)
        if not arc.low - APART * arc.step <= at <= (1 + APART) * arc.step or not arc.passes_by(x, at):
            raise ConvergenceError("it is no point of the step")
        there = Trial(system, x, lambda: linearization(system, x, arc.state.row))
        if jumps < 0:  # the other tangent
            gone = (x - arc.state.x) / np.sqrt(inner(system, x - arc.state.x, x - arc.state.x))
            there = Trial(system, x, Linearization(gone, arc.state.sign))
        end = settled(there, arc.state.tangent, arc.newton).settled  # where the equations' other corners are at mesh points
    except ConvergenceError:
        name = f"grazing: {names[first.condition]}"
        return SpecialPoint(arc.step, Label.GRAZING, name, arc.trial, is_located=False), pending[1:]
    known, one = numbers(end.system, end.x), near.at(end.system, end.x)
    one = one.nearest(system, known.extrema) or one
    every = [each for each in known.extrema if _is_alike(each, one, known, 0.0)]
    every = sorted({one, *every}, key=lambda each: each != one)
    met = [first, *(each.nearest(system, pending) for each in every)]
    matters = [each for each in every if not _number(system, x, each)[2] <= LOCATED]
    touch = Touch(tuple(names[each.condition] for each in matters), tuple(matters), x, jumps=jumps)
    point = SpecialPoint(at, Label.GRAZING, touch.text, there, details=touch) if matters else None
    return point, [each for each in pending if each not in met]


def _search(arc: Arc, _: object, ahead: bool = False) -> list[SpecialPoint]:
    """Return the grazing points inside a step, those at which several numbers touch zero once."""
    change, pending, found = _changes(arc), list[Extremum](), list[SpecialPoint]()
    for k in np.flatnonzero(change).tolist():
        more = (arc.trial if change[k] > 0 else arc.before).settled
        new = [each for each in numbers(more.system, more.x).extrema if each.condition == k and each.excess > 0]
        pending += sorted(new, key=lambda each: each.excess)[: abs(change[k]) // 2]
    while pending:
        point, pending = _located(arc, pending, ahead)
        found += [] if point is None else [point]
    return found


def touch_ahead(state: State, step: float) -> SpecialPoint | None:
    """Return the first grazing point to which the tangent leads within a step, or None.

    No step passes one behind which the branch bends too sharply.
    """
    here = Linearization(state.tangent, state.sign)
    ends = [Trial(state.system, state.x + way * state.tangent, here) for way in (0.0, step)]
    arc = Arc(state, (0.0, ends[0]), ends[1], step, Newton())
    slides = any(each.rates[0] > 0 > each.rates[1] for each in cast(Any, state.system).crossings(ends[1].x))
    points = _search(arc, None, ahead=True) if not (state.singular or slides) else []
    return min((point for point in points if point.is_located), key=lambda point: point.at, default=None)


@functools.cache
def grazing() -> Event:
    """Return the test function of grazing points of equations that do not jump."""
    return Event(Label.GRAZING, "grazing", lambda _: 1.0, asks=lambda arc: bool(_changes(arc).any()), search=_search)


@functools.cache
def jumping() -> list[Event]:
    """Return the test functions that end a run: where a piece vanishes, or a solution would slide."""

    def of(trial: Trial) -> Any:
        return trial.settled.system.crossings(trial.settled.x)

    def shortest(trial: Trial) -> float:
        ends = ends_of(trial.settled.system, of(trial)) + [0.0, *(each.delay for each in of(trial)), 0.0]
        return float(np.diff(ends).min() / (ends[-1] - ends[0]) - DOUBLED)

    def slides(trial: Trial) -> float:
        return min((each.rates[1] for each in of(trial)), default=1.0)

    return [
        Event(Label.GRAZING, "grazing", shortest, terminal=True),
        Event(Label.SLIDING, "sliding", slides, terminal=True),
    ]


def contradiction(system: Any, x: Array) -> str:
    """Return where a number crosses zero at which the equations jump, and the outcome is frozen; "" where none does."""
    for each in numbers(system, x).extrema if system.outcomes.size else ():
        k, t, batch = each.condition, each.time, system.problem.batch("field")
        at = np.searchsorted(system.mesh, t % 1.0 if system.is_cycle else t, side="right") - 1
        inside = system.outcomes[np.clip(at, 0, system.intervals - 1), k] == each.side
        if each.excess > 0 and not inside and np.isnan(_number(system, x, each)[2]):
            name = source(batch, batch.conditions(range(len(system.parameters)))[k])
            return f"{name}, where the equations jump, changes its sign at t = {t:.6g}"
    return ""
