"""Jumps of the equations that the solution decides: outcomes of conditions frozen on each interval, crossings at mesh points.

A crossing lies at a mesh point but for what a solution moves it by. With g the number that decides, f- and f+ the right sides
before and behind it, u the states at the mesh point, and dots for derivatives along the solution before, it happens later by

    delay T:   g + g' T + g'' T^2 / 2 = 0,   g' = g_t + g_u f-,   g'' = g_u f-',

and the interval behind begins with other states, to second order in the delay:

    u+ = u + (f- - f+) T + c T^2,   du+/du = 1 + (f+ - f-) g_u / g'   (the saltation matrix, where T is zero).

Mesh points are moved by the delays until these are round-off. So no polynomial crosses a jump, and derivatives by states and
parameters, tangents and multipliers are those of the solution with its jumps.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np

from contin import errors as checks
from contin.arrays import Array
from contin.collocation.corners import Switching
from contin.collocation.mesh import interpolation
from contin.errors import ConvergenceError, Grazing
from contin.functions.batch import Batch, Piecewise
from contin.functions.origin import source
from contin.levels import CORRECTED, ROUGH

#: Largest part of its length that a piece between crossings loses in a step of Newton's method.
_SHRINKS = 0.8
#: Largest growth of such a piece in a step, as a multiple: behind a grazing point the square of its length grows evenly, and 4
#: times to first order is 2.6 times. Ten times larger, points inside such steps are not found.
_GROWS = 4
#: Parabolas with which a minimum of a number over t is found.
_PARABOLAS = 4
#: Part of the domain over which g_t is taken by a difference.
_LATER = 1e-6


class Crossing(NamedTuple):
    """A mesh point at which outcomes change.

    - ``node`` (int): Number of the mesh point.
    - ``condition`` (int)
    - ``delay`` (float)
    - ``by_x`` (ndarray, shape (n + k,)): Derivatives of the delay by the states and the free parameters, scaled.
    - ``gap`` (ndarray, shape (n,)): f- - f+, scaled.
    - ``gap_by_x`` (ndarray, shape (n, n + k)): Its derivatives.
    - ``rate_by_x`` (ndarray, shape (n + k,)): Those of g' before, relative to it.
    - ``curved`` (ndarray, shape (n,)): c.
    - ``bend`` (float): g'' / g'.
    - ``rates`` (tuple of float): g' before and behind, positive where g goes to the side behind.
    """

    node: int
    condition: int
    delay: float
    by_x: Array
    gap: Array
    gap_by_x: Array
    rate_by_x: Array
    curved: Array
    bend: float
    rates: tuple[float, float]

    @property
    def shift(self) -> Array:
        """The change of the states with which the interval behind begins, u+ - u."""
        return (self.gap + self.curved * self.delay) * self.delay

    @property
    def shift_by_x(self) -> Array:
        """Its derivatives, shape (n, n + k)."""
        return np.outer(self.gap + 2 * self.curved * self.delay, self.by_x) + self.delay * self.gap_by_x

    def shift_bent(self, v: Array) -> Array:
        """Return the derivatives of these along v (n + k,), where the delay is zero: shape (n, n + k)."""
        delayed = self.by_x @ v
        bent = delayed * self.rate_by_x + (self.rate_by_x @ v + self.bend * delayed) * self.by_x
        curved = self.gap_by_x @ v + 2 * delayed * self.curved
        return np.outer(curved, self.by_x) + delayed * self.gap_by_x - np.outer(self.gap, bent)

    @property
    def by_states(self) -> Array:
        """The saltation matrix, with the first order in the delay."""
        return np.eye(self.gap.size) + self.shift_by_x[:, : self.gap.size]


def deciding(batch: Batch, t: Array, u: Array, p: Array) -> Array:
    """Return the numbers whose signs decide all conditions, shape (points, conditions), in the user's units."""
    recorded = batch.recorded
    assert recorded is not None
    every = tuple(range(len(batch.signature.parameters)))

    def made() -> Any:
        tape, places = recorded.recording.tape, recorded.outcomes(every).origins
        operations = [tape.operations[place] for place in places]
        return recorded.function([tape.at("sub", each[1]) if each[0] in ("lt", "le") else each[1][0] for each in operations])

    found: Array = recorded._once(("deciding", every), made)(t, u, p)
    return found


def outcomes(*given: Any) -> Array:
    """Return on which side of all conditions points are, 1 or -1."""
    return np.where(deciding(*given) >= 0, 1.0, -1.0)


def changes(sides: Array) -> list[int]:
    """Return the intervals, by number, that have other outcomes (N, K) than the one before."""
    found: list[int] = (np.flatnonzero((sides[1:] != sides[:-1]).any(axis=1)) + 1).tolist()
    return found


def frozen(batch: Batch, sides: Array, degree: int) -> Piecewise:
    """Return functions at Gauss points with the outcomes ``sides`` (N, K) on the intervals."""
    starts = [0, *changes(sides)]
    every = range(len(batch.signature.parameters))
    return Piecewise([batch.frozen(every, sides[j])[0] for j in starts], [degree * j for j in starts])


def crossings(system: Any, batch: Batch, x: Array) -> list[Crossing]:
    """Return the crossings of a solution; ``batch`` is the field in scaled units."""
    n, sides, found, known = system.states_count, system.outcomes, list[Crossing](), float(system._crosses > 1)
    every, later = range(len(system.parameters)), _LATER * (system.mesh[-1] - system.mesh[0])
    for j in changes(sides):
        (first, numbers), (last, _) = (batch.frozen(every, sides[i]) for i in (j - 1, j))
        k = int(np.flatnonzero(sides[j] != sides[j - 1])[0])
        t, u = system.mesh[j : j + 1], system._scaled_states(x)[[system.degree * j]]
        rest = u, np.empty((0, n)), system.scaled_parameters(x)
        values, slopes = numbers.jacobian(t, *rest, numbers.columns(system._free))
        both = [each.jacobian(t, *rest, each.columns(system._free)) for each in (first, last)]
        (before, behind), (of_before, of_behind) = zip(*((each[0, :n], known * by_x[0, :n]) for each, by_x in both))
        in_time, of_times = 0.0, [np.zeros(n)] * 2
        if batch.signature.times:
            ends = [[each.values(t + part, *rest)[0] for part in (later, -later)] for each in (numbers, first, last)]
            in_time, *of_times = (np.subtract(*each)[at] / (2 * later) for each, at in zip(ends, (k, slice(n), slice(n))))
        slope = slopes[0, k]
        rate, after = (float(in_time + slope[:n] @ each) for each in (before, behind))
        signs = sides[j, k] * rate, sides[j, k] * after
        onward = of_before[:, :n] @ before + known * of_times[0]  # f-'
        value, bend = float(values[0, k]), float(slope[:n] @ onward) / rate
        root = np.sqrt(max(1 - 2 * value * bend / rate, (1 - _SHRINKS) ** 2))
        delay, rate_by_x = -2 * value / rate / (1 + root), slope[:n] @ of_before / rate
        by_x = -(slope / rate + delay * rate_by_x) / root
        curved = (onward - known * of_times[1] - of_behind[:, :n] @ (2 * before - behind)) / 2
        found.append(Crossing(j, k, delay, by_x, before - behind, of_before - of_behind, rate_by_x, curved, bend, signs))
    return found


def ends_of(system: Any, found: Sequence[Crossing]) -> Array:
    """Return the mesh points at the ends of the pieces between crossings."""
    ends: Array = system.mesh[[0, *(each.node for each in found), -1]]
    return ends


def crossing_places(system: Any, x: Array) -> Switching:
    """Return where crossings are, as places of a mesh; those up to round-off cost nothing."""
    found, mesh, batch = system.crossings(x), system.mesh, system.problem.batch("field")
    origins = batch.conditions(range(len(batch.signature.parameters)))
    names = tuple(source(batch, origins[each.condition]) for each in found)
    ends, delays = ends_of(system, found), np.array([each.delay for each in found])
    moved = [(np.abs(each.gap) + ROUGH * np.abs(each.curved)) * abs(each.delay) for each in found]
    costs = [(each / (1 + system.largest(x)[: each.size])).max() for each in moved]
    known = np.where(np.abs(delays) > CORRECTED * (mesh[-1] - mesh[0]), costs, 0.0)
    return Switching(ends[1:-1] + delays, known, np.full(len(found), True), names)


def next_places(system: Any, x: Array) -> Array:
    """Return where crossings are; raise Grazing where a piece loses most of its length, ConvergenceError if it grows much."""
    found = crossing_places(system, x)
    ends = ends_of(system, system.crossings(x))
    lengths, known = np.diff([ends[0], *found.places, ends[-1]]), np.diff(ends)
    if (lengths > _GROWS * known).any():
        raise ConvergenceError("a piece between jumps grows too fast to be known to first order")
    lost = lengths < (1 - _SHRINKS) * known
    if lost.any():
        at = int(np.argmax(lost))
        which = checks.listed(dict.fromkeys(found.names[max(at - 1, 0) : at + 1]))
        error = Grazing(f"met grazing: {which}, the piece between jumps at t = {ends[at]:.6g} and {ends[at + 1]:.6g} vanishes")
        error.at_end = at in (0, len(found.places))
        raise error
    return found.places


def highest(there: Any, at: Array, step: Any, side: Any, k: Any) -> tuple[Array, Array]:
    """Return times near ``at`` (m,) at which the numbers k, times their ``side``, have a maximum over t, and these maxima.

    ``there(times)`` gives all numbers; a maximum is no further off than the ``step``.
    """

    def values(times: Array) -> Array:
        return np.asarray(side * there(times)[np.arange(times.size), k])

    for _ in range(_PARABOLAS):
        before, value, behind = (values(at + part * step) for part in (-1.0, 0.0, 1.0))
        bend, slope = before - 2 * value + behind, before - behind
        with np.errstate(all="ignore"):
            at = at + step * np.where(bend < 0, np.clip(slope / (2 * bend), -1, 1), 0.0)
        step = step / 10
    return at, values(at)


def stepped(system: Any, x: Array, change: Array) -> tuple[Array, Array, Array]:
    """Return mesh, times of the crossings and x behind a step of Newton's method, in which mesh points move with the crossings.

    The step is shortened where a piece between crossings would lose most of its length.
    """
    n, d, k, found, mesh = system.states_count, system.degree, system.state_size, system.crossings(x), system.mesh
    at = [each.node for each in found]
    moves = np.array(
        [each.delay + each.by_x @ np.append(change[:k].reshape(-1, n)[d * each.node], change[k:]) for each in found]
    )
    ends, shorter = ends_of(system, found), -np.diff(moves, prepend=0, append=0)
    part = min(1.0, _SHRINKS / max((shorter / np.diff(ends)).max(), _SHRINKS))
    blocks = (x + part * change)[:k].reshape(-1, n)[system.by_interval]
    blocks[at, 0] += part * np.array([each.gap for each in found]) * moves[:, None]
    tables, moved = system.basis, ends + part * np.concatenate([[0.0], moves, [0.0]])
    lagrange = 1 / np.prod(tables.points[:, None] - tables.points + np.eye(d), axis=1)
    slopes = interpolation(tables.points, lagrange, tables.nodes) @ tables.slope @ blocks / np.diff(mesh)[:, None, None]
    blocks += slopes * (np.interp(system.nodes, ends, moved) - system.nodes)[system.by_interval][..., None]
    states = np.append(blocks[0, :1], blocks[:, 1:].reshape(-1, n), axis=0)
    return np.interp(mesh, ends, moved), moved[1:-1], np.append(states.ravel(), x[k:] + part * change[k:])
