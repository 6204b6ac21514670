"""Motions: integration in time of the field of a problem, in a kernel where its functions are recorded, by SciPy where not."""

from __future__ import annotations

import warnings
from collections.abc import Callable, Iterator
from typing import Any, NamedTuple

import numpy as np

from contin.arrays import Array
from contin.errors import ProblemError
from contin.functions.batch import Batch
from contin.functions.interpreter import Loaded, Points, evaluate
from contin.kernels.kernel import kernel
from contin.kernels.kernel_parts import Matrix, Stack, Vector
from contin.levels import TINY

#: A motion that is further off, relative to 1 + where it began, goes to infinity: towards a pole steps of the integrator shrink
#: without end. Ten times larger, it takes a step or two more.
_FAR = 1e12
#: Tolerance of the integration while the motion settles, relative and absolute. With 1e-9 `cycle` takes twice as long. A motion
#: smaller than this part of 1 + its largest state is at rest.
SETTLES = 1e-6
#: Places of the round that is the guess, and of a step in which it ends.
SAMPLES = 1000
#: Most steps of the integration: orbits take a few hundred, a motion that settles ten thousand. Ten times larger, a stiff field
#: takes 1 s before an implicit method is tried.
_STEPS = 30_000
#: Weights of the stages of a step by Dormand and Prince (1980), and of the difference to the method of order 4.
_TABLE = np.zeros((8, 7))
_TABLE[np.tril_indices(7, -1)] = np.concatenate([
    [1 / 5, 3 / 40, 9 / 40, 44 / 45, -56 / 15, 32 / 9, 19372 / 6561, -25360 / 2187, 64448 / 6561, -212 / 729, 9017 / 3168],
    [-355 / 33, 46732 / 5247, 49 / 176, -5103 / 18656, 35 / 384, 0, 500 / 1113, 125 / 192, -2187 / 6784, 11 / 84],
])  # fmt: skip
_TABLE[7] = -71 / 57600, 0, 71 / 16695, -71 / 1920, 17253 / 339200, -22 / 525, 1 / 40


class Field(NamedTuple):
    """The field of a motion as SciPy's integrators call it, and functions of time in a unit, negative if it runs backwards."""

    rates: Callable[[float, Array], Any]
    batch: Batch
    p: Array
    unit: float


class Motion(NamedTuple):
    """Times (K,) and states (n, K) of the steps of an integrator, and what returns states (n, ...) at times between."""

    t: Array
    y: Array
    sol: Any


@kernel(reorder=False, last=True)
def follow(
    loaded: Loaded, units: float, tolerance: float, table: Matrix, stages: Stack, at: Points, times: Vector, found: Stack
) -> int:
    """Integrate over the unit interval, that is so many units of time, from the first of the states; return how many steps.

    0 where there is no room. ``found`` (2, K, n) are states and rates. Dormand and Prince's method of order 5, with the error
    of a step from that of order 4.
    """
    instructions, begin, end, room, _ = loaded
    states, rates, row, first, step, error = found[0], found[1], 0, 0, 1.0 / times.size, stages.shape[0]
    for _ in range(times.size - 1):
        step = min(step, 1.0 - times[row])
        for i in range(first, error):  # the last stage is the first one of the next step
            at.t[0] = units * times[row]
            for a in range(states.shape[1]):
                at.u[0, a] = states[row, a]
            for j in range(i):
                at.t[0] += units * step * table[i, j]
                for a in range(states.shape[1]):
                    at.u[0, a] += units * step * table[i, j] * stages[j, 0, a]
            evaluate(instructions, begin, end, at, room, stages[i], stages[:0])
        first, factor = 1, 5.0
        for a in range(states.shape[1]):
            gap, rates[row, a] = 0.0, units * stages[0, 0, a]
            for j in range(error):
                gap += units * step * table[error, j] * stages[j, 0, a]
            longer = 0.9 * (tolerance * (1.0 + max(abs(states[row, a]), abs(at.u[0, a]))) / (abs(gap) + TINY)) ** 0.2
            factor = min(factor, longer) if longer > 0.2 else 0.2  # where it is none, too
        if factor >= 0.9:
            row += 1
            times[row] = times[row - 1] + step
            for a in range(states.shape[1]):
                states[row, a], stages[0, 0, a] = at.u[0, a], stages[error - 1, 0, a]
                rates[row, a] = units * stages[0, 0, a]
            if not times[row] < 1.0:
                return row
        step *= factor
    return 0


def explicit(field: Field, start: Array, time: float, tolerance: float) -> Motion | None:
    """Return a motion of recorded functions; None where it goes far, or takes many steps: an implicit method may take few."""
    if field.batch.recorded is None:
        return None
    n, loaded, times, track = start.size, field.batch.load(), np.zeros(_STEPS), np.empty((2, _STEPS, start.size))
    loaded.instructions.scalars[loaded.parameters : loaded.parameters + field.p.size] = field.p
    at, track[0, 0] = Points(np.empty(1), np.empty((1, n)), np.empty((0, n))), start
    last = follow(loaded, time / field.unit, tolerance, _TABLE, np.empty((7, 1, n)), at, times, track)
    times, states, rates = time * times[: last + 1], track[0, : last + 1], track[1, : last + 1] / time

    def between(t: Any) -> Array:
        """Return the cubics through states and rates at both ends of steps."""
        i = np.clip(np.searchsorted(times, t, side="right") - 1, 0, last - 1)
        h, change = (times[i + 1] - times[i])[..., None], states[i + 1] - states[i]
        s, first, second = (t - times[i])[..., None] / h, h * rates[i], h * rates[i + 1]
        return (states[i] + s * (first + s * (3 * change - 2 * first - second + s * (first + second - 2 * change)))).T

    near = last and np.abs(states).max() < _FAR * (1 + np.abs(start).max())
    return Motion(times, states.T, between) if near else None


def state_after(field: Field, start: Array, time: float) -> Array:
    """Return the states (n,) after a time. The integrator's loop in C takes a third of the time of one in Python."""
    found = explicit(field, start, time, SETTLES)
    if found is not None:
        return found.y[:, -1]
    from scipy.integrate import odeint  # type: ignore[import-untyped]

    with warnings.catch_warnings(action="ignore"):  # where it fails, the loop below tells when
        y = odeint(field.rates, start, (0.0, time), rtol=SETTLES, atol=SETTLES, mxstep=2**31 - 1, tfirst=True)[-1]
    return y if np.abs(y).max(initial=0.0) < _FAR else integrated(field, start, time, SETTLES).y[:, -1]


def integrated(field: Field, start: Array, time: float, tolerance: float) -> Motion:
    """Return the motion from a start. SciPy's own loop around its integrator takes longer than the steps."""
    found = explicit(field, start, time, tolerance)
    if found is not None:
        return found
    from scipy.integrate import LSODA, OdeSolution  # .3 s; only this needs it

    steps = LSODA(field.rates, 0.0, start, time, rtol=tolerance, atol=tolerance)
    times, states, pieces = [0.0], [np.array(start)], []
    while steps.status == "running" and np.abs(states[-1]).max(initial=0.0) < _FAR * (1 + np.abs(start).max(initial=0.0)):
        steps.step()
        times.append(float(steps.t))
        states.append(steps.y.copy())
        pieces.append(steps.dense_output())
    if steps.status != "finished" or not np.isfinite(states).all():
        raise ProblemError(f"start: the motion from there has no finite value after t = {times[-1]:.6g}")
    return Motion(np.array(times), np.array(states).T, OdeSolution(times, pieces))


def passages(times: Array, height: Callable[[Array], Array]) -> Iterator[float]:
    """Yield the times between given ones at which a height passes zero upwards. SciPy's events fail at ends of its steps."""
    values = height(times)
    values[0] = 0.0  # where it begins, to the last digit
    for i in np.flatnonzero((values[:-1] < 0) & (values[1:] >= 0)):
        between = np.linspace(times[i], times[i + 1], SAMPLES)
        yield float(between[np.argmax(height(between) >= 0)])
