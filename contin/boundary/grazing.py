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
from dataclasses import dataclass, replace
from typing import Any, NamedTuple

import numpy as np

from contin.arrays import Array, Indices
from contin.boundary.crossings import deciding, highest, outcomes
from contin.collocation.mesh import interpolation, moved_to_breaks
from contin.core.labels import Label
from contin.core.newton import Newton, correct
from contin.core.protocol import Carrier, inner
from contin.core.step import ROUNDS, State, settled
from contin.core.trial import Event, Linearization, Trial, linearization
from contin.errors import ConvergenceError
from contin.events.arc import Arc, SpecialPoint
from contin.events.labelled import Finding
from contin.functions.origin import source
from contin.levels import APART, BESIDE, DOUBLED, LOCATED, MOST_UPDATES, ROUGH

#: Half the time, as a part of the domain, for which the equations are other ones at the first point behind a grazing point: the
#: largest for which Newton's method converges is taken. At the last one the excess is round-off.
_LASTS = (1e-3, 1e-4, 1e-5, 1e-6)


class Extremum(NamedTuple):
    """An extremum over t of the number that decides a condition: ``side`` 1 of a maximum, -1 of a minimum."""

    condition: int
    time: float
    side: float
    excess: float


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


def numbers(trial: Trial) -> Numbers:
    """Return the numbers that decide the conditions of a solution, over a whole round of a cycle."""
    system, x = trial.settled.system, trial.settled.x
    found: Numbers = system._once("numbers over t", x, lambda: _numbers(system, x))
    return found


def _there(system: Any, x: Array) -> Any:
    """Return the function that gives the numbers that decide at times, shape (times, conditions)."""
    batch, p = system.problem.batch("field"), system.all_parameters(x)
    return lambda times: deciding(batch, times, system.evaluate(x, times), p)


def _numbers(system: Any, x: Array) -> Numbers:
    nodes, there = system.nodes, _there(system, x)
    t = np.sort(np.append(nodes, (nodes[1:] + nodes[:-1]) / 2))
    t = t[np.unique(np.round((t - t[0]) / (t[-1] - t[0]) / BESIDE), return_index=True)[1]]  # closer ones differ by round-off
    t[-1] = nodes[-1]
    if system.is_cycle:
        t = (t[:-1] + np.arange(system.order)[:, None]).ravel()
        t = np.concatenate([[t[-1] - system.order], t, [t[0] + system.order]])
    h = there(t)
    change, sides = np.diff(h, axis=0), np.where(h >= 0, 1.0, -1.0)
    zeros, ends = (sides[1:] != sides[:-1])[int(system.is_cycle) :].sum(axis=0), sides[[0, -1]] * (not system.is_cycle)
    turn, spread = np.sign(change[:-1]) - np.sign(change[1:]), np.maximum(np.abs(change[:-1]), np.abs(change[1:]))
    i, k = np.nonzero(np.abs(turn) == 2)
    times, side = t[i + 1], turn[i, k] / 2
    values = side * h[i + 1, k]
    near = np.abs(values) <= 2 * spread[i, k]
    if near.any():
        times[near], peaks = highest(there, times[near], (t[i + 2] - t[i])[near] / 2, side[near], k[near])
        crosses = peaks > LOCATED * np.ptp(h, axis=0)[k[near]]  # one that touches does not cross
        np.add.at(zeros, k[near], 2 * crosses - 2 * (values[near] > 0))
        values[near] = peaks
    extrema = [Extremum(*each) for each in zip(k.tolist(), times.tolist(), side.tolist(), values.tolist())]
    return Numbers(zeros, ends, np.ptp(h, axis=0), extrema)


@dataclass(frozen=True, eq=False)
class Touch(Finding):
    """A grazing point.

    - ``times`` (tuple of float): When the numbers touch zero, as parts of the domain or of the part of a cycle.
    - ``folds`` (bool): The primary parameter turns there.
    """

    times: tuple[float, ...]
    folds: bool
    conditions: tuple[int, ...]
    sides: tuple[float, ...]
    names: tuple[str, ...]
    x: Array
    nullity = 0
    has_equations = True

    @property
    def text(self) -> str:
        """What touches, and when."""
        places = " and ".join(f"{name}, at t = {time:.6g}" for name, time in zip(self.names, self.times))
        return f"{places}: fold" if self.folds else places

    @property
    def numbers(self) -> dict[str, Any]:
        """What is stored."""
        return {"touch": [self.times, self.folds, self.conditions, self.sides, self.names]}

    def again(self, system: Any, carry: Carrier, x: Array, newton: Newton) -> Touch:
        """Return the same on another mesh."""
        x, _ = _touching(system, carry(x), self.conditions[0], self.times[0], self.sides[0], newton)
        times = [_excess(system, x, Extremum(*each, 0.0))[0] for each in zip(self.conditions, self.times, self.sides)]
        return replace(self, x=x, times=tuple(times))

    def beyond(self, trial: Trial, newton: Newton) -> tuple[Any, Array, Array]:
        """Return system, x and tangent of a point behind this one; raise ConvergenceError where none is found.

        The excess of the first number is held, and mesh points lie where the numbers change their signs. Where it falls there
        is no need: the solution becomes smooth.
        """
        system, there, problem = trial.system, _there(trial.system, trial.x), ConvergenceError("no point is found behind it")
        length, close = system.mesh[-1] - system.mesh[0], ROUGH * (system.mesh[-1] - system.mesh[0])
        rows = [side * _number(system, trial.x, k, t)[1] for k, t, side in zip(self.conditions, self.times, self.sides)]
        rates = np.array(rows) @ trial.tangent
        if rates[0] < 0:
            raise problem
        bends = np.array([
            -side * (there(t + close * np.array([-1.0, 0.0, 1.0]))[:, k] @ [1, -2, 1]) / close**2
            for k, t, side in zip(self.conditions, self.times, self.sides)
        ])  # fmt: skip
        for last in _LASTS:
            ahead = bends[0] * (last * length) ** 2 / 2 / rates[0]
            lasts = np.sqrt(np.maximum(2 * rates * ahead / bends, 0))
            places = np.array(self.times)[:, None] + lasts[:, None] * [-1, 1]
            if system.is_cycle:
                places = places % 1.0
            breaks = np.unique(np.append(system._all_breaks(trial.x, closely=False), places))
            other, carry = system.on_mesh(moved_to_breaks(system.mesh, breaks))
            x = carry(trial.x + ahead * trial.tangent)
            try:
                for _ in range(ROUNDS):
                    row = _number(other, x, self.conditions[0], self.times[0])[1]
                    x = correct(other, x, row, row @ x, newton).x
                    moved = other.on_switches(x)
                    if moved is None:
                        return other, x, linearization(other, x, self.sides[0] * row).tangent
                    other, x = moved[0], moved[1](x)
            except ConvergenceError as error:
                problem = error
        raise problem


def _number(system: Any, x: Array, k: int, time: float) -> tuple[float, Array, float]:
    """Return a number that decides, its derivatives by x, and by how much the equations' derivatives jump where it is zero.

    The last is relative to the largest; it is NaN where the equations jump themselves.
    """
    n, batch, every, rounds = system.states_count, system._field, range(len(system.parameters)), 0
    if system.is_cycle:
        rounds, time = int(np.floor(time)), time % 1.0
    times = np.array([time + rounds])
    side = outcomes(system.problem.batch("field"), times, system.evaluate(x, times), system.all_parameters(x))[0]
    given = times, system.evaluate(x, times) / system.scales.states, np.empty((0, n)), system.scaled_parameters(x)
    (f, number), (g, _) = batch.frozen(every, side), batch.frozen(every, np.where(np.arange(side.size) == k, -side, side))
    columns = number.columns(system._free)
    values, slopes = number.jacobian(*given, columns)
    by_state = slopes[0, k, :n] @ np.linalg.matrix_power(system.turn, rounds) if rounds else slopes[0, k, :n]
    j = min(max(int(np.searchsorted(system.mesh, time, side="right")) - 1, 0), system.intervals - 1)
    within = np.array([(time - system.mesh[j]) / (system.mesh[j + 1] - system.mesh[j])])
    row = np.append(np.zeros(system.state_size), slopes[0, k, n:])
    weights = interpolation(system.basis.nodes, system.basis.barycentric, within)[0]
    row[: system.state_size].reshape(-1, n)[system.by_interval[j]] = np.outer(weights, by_state)
    (one, by_one), (two, by_two) = (each.jacobian(*given, columns) for each in (f, g))
    jumps = np.abs(one - two).max() > ROUGH * np.abs(one).max() + abs(values[0, k]) * np.abs(by_one - by_two).max()
    return float(values[0, k]), row, np.nan if jumps else float(np.abs(by_one - by_two).max() / np.abs(by_one).max())


def _touching(system: Any, x: Array, k: int, time: float, side: float, newton: Newton) -> tuple[Array, float]:
    """Return the solution near x at which a number touches zero near a time, and the time; raise ConvergenceError without."""
    last = np.inf
    for _ in range(MOST_UPDATES):
        time, _ = _excess(system, x, Extremum(k, time, side, 0.0))
        value, row, _ = _number(system, x, k, time)
        residual, factors = system.linearize(x, (row,))
        change = factors.solve(np.append(residual, value))
        x, size = x - change, float(np.abs(change / (1 + np.abs(x))).max())
        if size <= newton.tolerance or LOCATED > size > last / 2:
            return x, time
        last = size
    raise ConvergenceError("the grazing point is not found")


def _changes(arc: Arc) -> Indices:
    """Return by how much the numbers of zeros change in a step, but for those that pass an end of the domain."""
    first, last = numbers(arc.before), numbers(arc.trial)
    change = last.zeros - first.zeros
    return np.where(np.abs(change) > (first.ends != last.ends).sum(axis=0), change, 0)


def _excess(system: Any, x: Array, each: Extremum) -> tuple[float, float]:
    """Return time and excess of an extremum that is near a known one of another solution."""
    wide = np.array([np.diff(system.nodes).mean()])
    time, value = highest(_there(system, x), np.array([each.time]), wide, np.array([each.side]), np.array([each.condition]))
    return float(time[0]), float(value[0])


def _located(arc: Arc, pending: list[Extremum]) -> tuple[SpecialPoint | None, list[Extremum]]:
    """Return the point of a step at which the first of some numbers touches zero, and those that do not touch there.

    There is no point where the number has no corner.
    """
    system: Any = arc.state.system
    first, k = pending[0], pending[0].condition
    batch, before, after = system.problem.batch("field"), *(_excess(system, end.x, first)[1] for end in (arc.before, arc.trial))
    middle = arc.low + (arc.step - arc.low) * float(np.clip(before / (before - after), 0, 1)) if before != after else arc.step
    names = [source(batch, place) for place in batch.conditions(range(len(system.parameters)))]
    try:
        x = arc.guess(middle)
        near = _nearest(first, _numbers(system, x).extrema, system) or first
        if np.isnan(_number(system, x, k, near.time)[2]):
            return None, pending[1:]  # the equations jump
        x, time = _touching(system, x, k, near.time, first.side, arc.newton)
        at = inner(system, arc.state.tangent, x - arc.state.x)
        if not arc.low - APART * arc.step <= at <= (1 + APART) * arc.step or not arc.passes_by(x, at):
            raise ConvergenceError("it is no point of the step")
    except ConvergenceError:
        return SpecialPoint(arc.step, Label.GRAZING, f"grazing: {names[k]}", arc.trial, is_located=False), pending[1:]
    there = Trial(system, x, lambda: linearization(system, x, arc.state.row))
    known = numbers(settled(there, arc.state.tangent, arc.newton))  # where the equations' other corners are at mesh points
    one = _nearest(first._replace(time=time), known.extrema, system)
    every = [each for each in known.extrema if one and abs(each.excess - one.excess) < DOUBLED * known.sizes[each.condition]]
    every = sorted(every, key=lambda each: each is not one) or [first._replace(time=time)]
    left = [other for other in pending if other is not first]
    left = [other for other in left if all(other is not _nearest(each, pending, system) for each in every)]
    matters = [each for each in every if _number(system, x, each.condition, each.time)[2] > LOCATED]
    if not matters:
        return None, left
    conditions, times, sides, _ = zip(*matters)
    touch = Touch(times, False, conditions, sides, tuple(names[k] for k in conditions), x)
    return SpecialPoint(at, Label.GRAZING, touch.text, there, details=touch), left


def _nearest(one: Extremum, others: list[Extremum], system: Any) -> Extremum | None:
    """Return the extremum of the same kind that is nearest in time to one; None without any."""
    round_ = system.order if system.is_cycle else np.inf

    def apart(other: Extremum) -> float:
        return min(abs(one.time - other.time), round_ - abs(one.time - other.time))

    return min((each for each in others if each[::2] == one[::2]), key=apart, default=None)


def _search(arc: Arc, _: object) -> list[SpecialPoint]:
    """Return the grazing points inside a step, those at which several numbers touch zero once."""
    change, pending, found = _changes(arc), list[Extremum](), list[SpecialPoint]()
    for k in np.flatnonzero(change).tolist():
        more = numbers(arc.trial if change[k] > 0 else arc.before).extrema
        new = [each for each in more if each.condition == k and each.excess > 0]
        pending += sorted(new, key=lambda each: each.excess)[: abs(change[k]) // 2]
    while pending:
        point, pending = _located(arc, pending)
        found += [] if point is None else [point]
    return found


def touch_ahead(state: State, step: float) -> SpecialPoint | None:
    """Return the first grazing point to which the tangent leads within a step, or None.

    No step passes one behind which the branch bends too sharply.
    """
    here, guess = Linearization(state.tangent, state.sign), state.x + step * state.tangent
    arc = Arc(state, (0.0, Trial(state.system, state.x, here)), Trial(state.system, guess, here), step, Newton())
    if state.singular or not _changes(arc).any():
        return None
    return min((point for point in _search(arc, None) if point.is_located), key=lambda point: point.at, default=None)


@functools.cache
def grazing() -> Event:
    """Return the test function of grazing points of equations that do not jump."""
    asks = lambda arc: bool(_changes(arc).any())  # noqa: E731
    return Event(Label.GRAZING, "grazing", lambda _: 1.0, asks=asks, search=_search)
