"""Corners and jumps that a solution decides, as ``max(0, u.x)`` does: where they are on it, and what they cost on its mesh.

A condition switches at a time tau in an interval [a, b] of the mesh. The equations with either outcome are smooth; the gap is
the difference of the two. A polynomial that follows one outcome over the whole interval misses the integral of the gap over the
part on the other side of tau. So the cost of a switch is the smaller one of these two integrals:

    a ------- tau --- b
      gap dt     gap dt

It is zero where tau is a mesh point, and it is zero for selections that are smooth, as a series near 0 that is joined to a
closed form.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np

from contin.arrays import Array, Indices
from contin.collocation.corners import MOST_SWITCHES, Selections, brackets, narrowed
from contin.levels import CORRECTED

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

    Attributes
    ----------
    places : ndarray, shape (K,)
    costs : ndarray, shape (K,)
        The error that a switch inside an interval makes, relative to the sizes of the states.
    jumps : ndarray of bool, shape (K,)
        The equations jump: the derivatives do not tell how the solution moves with the place.
    names : tuple of str
        The numbers whose sign decides.
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
    """Return the places of a solution where conditions switch, without those of smooth selections.

    Parameters
    ----------
    system : Collocation
    selections : Selections
    sizes : callable
        ``sizes()`` are those of what the values of the functions are integrated to, shape (values,).
    x : ndarray
        A solution.
    """
    p = system.all_parameters(x)

    def sides(t: Array) -> Array:
        return selections.sides(t, system.evaluate(x, t), p)

    mesh = system.mesh

    def largest(times: Array, places: Array, which: Indices) -> Array:
        """Return the largest gap of each switch at its times (K, parts), shape (K, parts)."""
        gaps = selections.gaps(times.ravel(), system.evaluate(x, times.ravel()), p)
        away = np.abs(times - places[:, None]) / (mesh[-1] - mesh[0])
        return _of_selection(selections, gaps / units, which, away)

    def worst(places: Array, ends: Array, which: Indices) -> Array:
        """Return the largest gap of each switch between its place and an end, shape (K,)."""
        return largest(places[:, None] + (ends - places)[:, None] * _PARTS, places, which).max(axis=1)

    with np.errstate(all="ignore"):
        a, b, which = brackets(*_sampled(system, selections, x, p))
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


def _sampled(system: Any, selections: Selections, x: Array, p: Array) -> tuple[Array, Array]:
    """Return the times of the nodes and of the middles between them, and the sides there."""
    nodes = system.nodes
    times = np.empty(2 * nodes.size - 1)
    times[::2], times[1::2] = nodes, (nodes[1:] + nodes[:-1]) / 2
    return times, selections.sides(times, system.evaluate(x, times), p)


def _of_selection(selections: Selections, gaps: Array, which: Indices, away: Array) -> Array:
    """Return the largest gap of each switch at its own times, shape (K, parts); gaps (K parts, gaps) are those of all.

    Where it is not known, as at the knots of a table, it is that of a corner: the distance ``away``, as a part of the domain.
    """
    sizes, number, parts = np.abs(gaps), selections.of_gaps[:, 0], away.shape[1]
    found = away.copy()
    for k, selection in enumerate(which.tolist()):
        if selections.known[selection]:
            found[k] = sizes[k * parts : (k + 1) * parts, number == selection].max(axis=1, initial=0.0)
    return found


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
