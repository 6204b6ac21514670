"""A cycle from a time integration that has settled on it."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np

from contin import errors as checks
from contin.arrays import Array
from contin.cycles.statement import CycleProblem
from contin.errors import ProblemError
from contin.functions.signature import named_values
from contin.levels import LOCATED, ROUGH
from contin.problems.angles import periods_of, whole_rounds, winding_names
from contin.problems.statement import PERIOD, ROUNDS
from contin.results.point import Point
from contin.search.guess import restated
from contin.search.solving import solve

#: A motion that is further off, relative to 1 + where it began, goes to infinity: towards a pole steps of the integrator shrink
#: without end. Ten times larger, it takes a step or two more.
FAR = 1e12
#: Tolerance of the integration while the motion settles, relative and absolute. With 1e-9 `cycle` takes twice as long. A motion
#: smaller than this part of 1 + its largest state is at rest.
_SETTLES = 1e-6
#: Distance from its start, as a part of the size of the motion, within which it has come back: Newton's method finds the cycle.
_BACK = 1e-2
#: Parts of the time in which it settles, in which it must come back: the first ones are enough for most.
_PARTS = (1 / 16, 1 / 4, 1)
#: Looks at a motion in each round of an angle: at three or less, a whole round could look like none.
_PER_ROUND = 8
#: Places of the round that is the guess.
_SAMPLES = 1000
#: Largest number of periods of the forcing after which a motion is looked for to close: four period doublings.
_MOST_ROUNDS = 16


@checks.arguments
def cycle(
    problem: CycleProblem, start: Sequence[float], parameters: Mapping[str, float] | None = None, *, settle: float = 100.0,
    intervals: int = 40, degree: int | None = None,
) -> Point:  # fmt: skip
    """Return the stable cycle that a time integration from ``start`` settles on.

    Parameters
    ----------
    problem : CycleProblem
    start : sequence of float
        Initial states.
    parameters : mapping of str to float, optional
        Values that differ from the defaults.
    settle : float
        Time after which the motion is taken to be periodic.
    intervals, degree : int
        First mesh and degree of the collocation, as in `solve`.

    Raises
    ------
    ProblemError
        The motion does not come back: it rests, goes to infinity, or has not settled.
    ConvergenceError
        No cycle is found near the motion.

    Examples
    --------
    >>> import math, contin
    >>> def van_der_pol(u, p):
    ...     return u.v, p.mu * (1 - u.x**2) * u.v - u.x
    >>> problem = contin.CycleProblem(van_der_pol, ["x", "v"], {"mu": 1.0})
    >>> round(cycle(problem, [1.0, 0.0])["period"], 6)
    6.663287
    """
    checks.number("settle", settle, 0)
    found = restated(problem, _numbers(start, len(problem.state_names)), dict(parameters or {}))
    problem, first, values = found[0], np.asarray(found[1]), found[2]
    values = {**problem.parameters, **values}
    field = _vector_field(problem, values)
    if problem.period is None:
        settled = _integrated(field, first, settle, _SETTLES).y[:, -1]
        times, states = _one_round(field, settled, settle, periods_of(problem))
        values[PERIOD] = float(times[-1])
    else:
        (times, states), values[ROUNDS] = _forced_rounds(problem, field, (first, settle), values)
    states = states - whole_rounds(states[0], periods_of(problem))  # begins in the first round
    given = {name: value for name, value in values.items() if name not in winding_names(problem.angles)}  # as the motion has
    return solve(problem, (times / times[-1], states), given, intervals=intervals, degree=degree)


def _numbers(start: Sequence[float], count: int) -> Array:
    array = np.asarray(start, dtype=float).ravel()
    if array.size != count or not np.isfinite(array).all():
        raise ProblemError(f"start: {checks.shown(start)} must be {count} finite numbers, the states")
    return array


#: The field as an integrator calls it, f(t, u).
Field = Callable[[float, Array], Any]


def _vector_field(problem: CycleProblem, values: Mapping[str, float]) -> Field:
    """Return the field as an integrator of SciPy calls it."""
    of_state = named_values(problem.state_names)
    p, field = named_values(tuple(values))(**values), problem.field
    if problem.period is None:
        return lambda t, u: field(of_state(*u), p)
    return lambda t, u: field(t, of_state(*u), p)


class _Motion(NamedTuple):
    """Times (K,) and states (n, K) of the steps of an integrator, and what returns states (n, ...) at times between."""

    t: Array
    y: Array
    sol: Any


def _integrated(field: Field, start: Array, time: float, tolerance: float, dense: bool = False) -> _Motion:
    """Return the motion from a start. SciPy's own loop around its integrator takes longer than the steps.

    Raises
    ------
    ProblemError
    """
    from scipy.integrate import LSODA, OdeSolution  # type: ignore[import-untyped]  # .3 s; only this needs it

    far, steps = FAR * (1 + np.abs(start).max(initial=0.0)), LSODA(field, 0.0, start, time, rtol=tolerance, atol=tolerance)
    times, states, pieces = [0.0], [np.array(start)], []
    while steps.status == "running" and np.abs(states[-1]).max(initial=0.0) < far:
        steps.step()
        times.append(float(steps.t))
        states.append(steps.y.copy())
        if dense:
            pieces.append(steps.dense_output())
    if steps.status != "finished" or not np.isfinite(states).all():
        raise ProblemError(f"start: the motion from there has no finite value after t = {times[-1]:.6g}")
    return _Motion(np.array(times), np.array(states).T, OdeSolution(times, pieces) if dense else None)


def _passages(times: Array, height: Callable[[Array], Array]) -> Iterator[float]:
    """Yield the times between given ones at which a height passes zero upwards. SciPy's events fail at ends of its steps."""
    from scipy.optimize import brentq  # type: ignore[import-untyped]  # the integrator has loaded it

    values = height(times)
    values[0] = 0.0  # where it begins, to the last digit
    for i in np.flatnonzero((values[:-1] < 0) & (values[1:] >= 0)):
        yield float(brentq(height, times[i], times[i + 1]))


def _looks(times: Array, states: Array, periods: Array) -> Array:
    """Return the steps (K,) of a motion (n, K), divided where an angle goes round by more than a part of its period."""
    advance = np.abs(np.diff(states, axis=1)) / np.where(periods > 0, periods, np.inf)[:, None]
    pieces = np.ceil(_PER_ROUND * advance.max(axis=0)).astype(int).clip(1)
    starts = np.repeat(times[:-1], pieces)
    within = np.concatenate([np.arange(count) / count for count in pieces])
    return np.append(starts + within * np.repeat(np.diff(times), pieces), times[-1])


def _forced_rounds(
    problem: CycleProblem, field: Field, start: tuple[Array, float], values: Mapping[str, float]
) -> tuple[tuple[Array, Array], int]:
    """Return times (K,), from 0, and states (K, n) of a forced motion that has settled, and after how many periods it closes.

    ``start`` holds the states and the time in which the motion settles, which is made a whole number of periods.
    """
    period = problem.duration({**values, ROUNDS: 1.0})
    settled = _integrated(field, start[0], period * math.ceil(start[1] / period), _SETTLES).y[:, -1]
    done = _integrated(field, settled, period * _MOST_ROUNDS, LOCATED, dense=True)
    periods = periods_of(problem)
    size = _size(done.y, periods) or 1.0
    for rounds in range(1, _MOST_ROUNDS + 1):
        if np.abs(_apart(done.sol(rounds * period), settled, periods)).max() <= ROUGH * size:
            times = np.linspace(0.0, rounds * period, _SAMPLES)
            return (times, done.sol(times).T), rounds
    raise ProblemError(
        f"start: the motion does not close within {_MOST_ROUNDS} periods of the forcing; give a larger settle, or a start "
        "nearer to the cycle (it may be unstable, or the motion not periodic)"
    )


def _size(states: Array, periods: Array) -> float:
    """Return the size of a motion (n, K): an angle that goes round has its period."""
    return float(np.minimum(np.ptp(states, axis=1), np.where(periods > 0, periods, np.inf)).max())


def _apart(states: Array, start: Array, periods: Array) -> Array:
    """Return differences of states (..., n) from the start, those of angles up to whole rounds."""
    apart = states - start
    return apart - whole_rounds(apart, periods)


def _one_round(field: Field, start: Array, longest: float, periods: Array) -> tuple[Array, Array]:
    """Return times (K,), from 0, and states (K, n) of one round of a motion that has settled.

    A round ends where the motion comes back through the plane normal to it at its start, close to the start; angles come back
    up to whole rounds.
    """
    across = np.asarray(field(0.0, start), dtype=float)
    for part in _PARTS:
        done = _integrated(field, start, part * longest, LOCATED, dense=True)
        size = _size(done.y, periods)
        rests = size <= _SETTLES * (1 + np.abs(start).max())

        def height(t: Array, sol: Callable[[Array], Array] = done.sol) -> Array:
            return across @ _apart(sol(t).T, start, periods).T

        for t in () if rests else _passages(_looks(done.t, done.y, periods), height):
            if np.abs(_apart(done.sol(t), start, periods)).max() <= _BACK * size:
                times = np.linspace(0.0, t, _SAMPLES)
                return times, done.sol(times).T
    if rests:
        raise ProblemError(f"start: the motion from there comes to rest near {', '.join(f'{value:.6g}' for value in start)}")
    raise ProblemError(
        f"start: the motion does not come back to where it was within t = {longest:g}; give a larger settle, or a start nearer "
        "to the cycle (it may be unstable, or the motion not periodic)"
    )
