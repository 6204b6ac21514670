"""Adaptation of the mesh: error density, equidistribution, number of intervals."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from contin import checks
from contin.arrays import Array
from contin.collocation.basis import Basis
from contin.errors import ProblemError
from contin.levels import CORRECTED

#: More intervals than any machine has room for: a bound for what users give.
MOST_INTERVALS = 1_000_000

#: Error wanted between the mesh points where that at them is to be one, as a factor; below one for a margin. Ten times larger
#: moves no special point of the test bank by more than 1e-9.
_BETWEEN = 0.03
#: Part of its mean that the density is raised to: an interval grows to ten times the mean at most.
_LEAST_DENSITY = 0.1
#: Intervals between two breaks, on average: some are left for breaks that the solution meets on its way.
_A_PIECE = 2
#: A mesh stays with up to so many times the intervals that it needs, ...
_TOO_MANY = 1.6
#: ... and with an interval that has up to so many times its share of the error.
_TOO_LARGE = 1.5


@dataclass(frozen=True)
class MeshControl:
    """How the mesh adapts.

    Attributes
    ----------
    tolerance : float
        Wanted error at the mesh points. Collocation is superconvergent there, h^(2 d), while the density is about the error
        h^(d+1) between them: that one is kept below 0.03 tolerance^((d+1)/(2 d)).
    min_intervals, max_intervals : int
        Bounds on the number of intervals N.
    every : int
        Number of steps after which the mesh is looked at again; 0 keeps it as it is.

    Examples
    --------
    >>> MeshControl(tolerance=1e-8, min_intervals=20).max_intervals
    2000
    """

    tolerance: float = 1e-12
    min_intervals: int = 8
    max_intervals: int = 2000
    every: int = 3

    def __post_init__(self) -> None:
        checks.number("mesh tolerance", self.tolerance, 0, 1)
        checks.whole("min_intervals", self.min_intervals, 1, MOST_INTERVALS)
        checks.whole("max_intervals", self.max_intervals, 1, MOST_INTERVALS)
        if self.min_intervals > self.max_intervals:
            raise ProblemError(f"intervals: {self.min_intervals} to {self.max_intervals} must be in order")
        checks.whole("every", self.every, 0, 1_000_000)


#: No breaks.
_NOWHERE = np.empty(0)


def density(basis: Basis, mesh: Array, states: Array, breaks: Array = _NOWHERE) -> Array:
    """Return the (d+1)-th root of the size of the (d+1)-th derivative, by interval, shape (N,).

    The derivative comes from differences of the d-th ones of neighbouring intervals (de Boor 1973, as in AUTO and COLSYS),
    each component scaled by max(1, max |u|).

    Parameters
    ----------
    basis : Basis
    mesh : ndarray, shape (N + 1,)
    states : ndarray, shape (N d + 1, n)
        At the nodes.
    breaks : ndarray, optional
        Places where the equations have jumps or corners: differences across them are no errors.
    """
    d, h = basis.degree, mesh[1:] - mesh[:-1]
    if h.size < 2:
        return np.ones(1)
    local = states[d * np.arange(h.size)[:, None] + np.arange(d + 1)]
    derivative = np.einsum("l,jla->ja", basis.highest, local) / h[:, None] ** d
    jumps = np.abs(derivative[1:] - derivative[:-1]) / ((h[1:] + h[:-1]) / 2)[:, None]
    jumps = (jumps / np.maximum(1.0, np.abs(states).max(axis=0))).max(axis=1)
    if len(breaks):
        jumps = _without_breaks(jumps, mesh, breaks)
    both = np.empty((2, h.size))
    both[0, 1:], both[1, :-1] = jumps, jumps
    both[0, 0], both[1, -1] = jumps[0], jumps[-1]
    return both.max(axis=0) ** (1 / (d + 1))


def _without_breaks(jumps: Array, mesh: Array, breaks: Array) -> Array:
    """Return the jumps at inner mesh points, that at a break no larger than the next ones on both sides."""
    inside = near(mesh[1:-1], breaks, mesh[-1] - mesh[0])
    beside = np.concatenate([[-1.0], np.where(inside, -1.0, jumps), [-1.0]])
    largest = np.maximum(beside[:-2], beside[2:])  # -1 where there is none
    return np.where(inside & (largest >= 0), np.minimum(jumps, largest), jumps)


def near(places: Array, breaks: Array, length: float) -> Array:
    """Return which places lie on a break."""
    found: Any = (np.abs(places[:, None] - breaks) <= CORRECTED * length).any(axis=1)
    return np.asarray(found)


def with_breaks(mesh: Array, breaks: Array) -> Array:
    """Return a mesh of as many intervals whose points hold the breaks, as far as there are points for them."""
    mesh, length = mesh.copy(), mesh[-1] - mesh[0]
    taken = np.zeros(mesh.size, dtype=bool)
    taken[[0, -1]] = True
    for place in breaks:
        at = int(np.searchsorted(mesh, place))
        for j in sorted((at - 1, at), key=lambda j: abs(mesh[j] - place)):
            if not taken[j]:
                mesh[j], taken[j] = place, True
                break
            if abs(mesh[j] - place) <= CORRECTED * length:
                break
    return mesh


def moved_to_breaks(mesh: Array, breaks: Array) -> Array:
    """Return a mesh with the breaks among its points whose intervals are those of a mesh, stretched between the breaks.

    Examples
    --------
    >>> moved_to_breaks(np.array([0.0, 0.25, 0.5, 0.75, 1.0]), np.array([0.6])).round(3).tolist()
    [0.0, 0.3, 0.6, 0.8, 1.0]
    """
    return _equidistributed(mesh, 1 / np.diff(mesh), max(mesh.size - 1, len(breaks) + 1), breaks)


def adapted_mesh(basis: Basis, mesh: Array, states: Array, control: MeshControl, breaks: Array = _NOWHERE) -> Array | None:
    """Return a better mesh for a solution, given by its states at the nodes, or None where the present one is good enough.

    It equidistributes the density (smoothed, and raised to at least a tenth of its mean so that no interval grows without
    bound) over as many intervals as ``control.tolerance`` takes.
    """
    h = np.diff(mesh)
    phi = _raised(density(basis, mesh, states, breaks), h)
    total = float(phi @ h)
    allowed = share(basis, control.tolerance)
    fewest = max(control.min_intervals, _A_PIECE * (len(breaks) + 1) if len(breaks) else 0)
    wanted = int(min(max(np.ceil(total / allowed), fewest), control.max_intervals))
    enough = wanted <= h.size <= max(_TOO_MANY * wanted, control.min_intervals)
    there = breaks[near(breaks, mesh, mesh[-1] - mesh[0])] if len(breaks) else breaks
    enough = enough and len(there) == len(breaks)
    if enough and (phi * h).max() <= _TOO_LARGE * max(total / h.size, allowed * wanted / h.size):
        return None
    return _equidistributed(mesh, phi, max(h.size if enough else wanted, len(breaks) + 1), breaks)


def share(basis: Basis, tolerance: float) -> float:
    """Return the density times length that an interval may have for a tolerance, by the interpolation error of degree d."""
    d = basis.degree
    return float((_BETWEEN * tolerance ** ((d + 1) / (2 * d)) / basis.constant) ** (1 / (d + 1)))


def equidistributed(basis: Basis, mesh: Array, states: Array, intervals: int) -> Array:
    """Return a mesh of so many intervals for a solution that is given on another mesh."""
    return _equidistributed(mesh, _raised(density(basis, mesh, states), np.diff(mesh)), intervals)


def _raised(phi: Array, h: Array) -> Array:
    """Return the density, smoothed and not far below its mean."""
    padded = np.concatenate([phi[:1], phi, phi[-1:]])
    phi = np.maximum(phi, (padded[:-2] + 2 * phi + padded[2:]) / 4)
    return np.maximum(phi, _LEAST_DENSITY * (phi @ h) / h.sum())


def _equidistributed(mesh: Array, phi: Array, intervals: int, breaks: Array = _NOWHERE) -> Array:
    """Return a mesh whose intervals have equal shares of the density; between breaks, which are mesh points, about equal."""
    h = np.diff(mesh)
    total = phi @ h
    if not total > 0:
        return with_breaks(np.linspace(mesh[0], mesh[-1], intervals + 1), breaks)
    share = np.concatenate([[0.0], np.cumsum(phi * h)]) / total
    places = np.linspace(0, 1, intervals + 1)
    if len(breaks):
        ends = np.concatenate([[0.0], np.interp(breaks, mesh, share), [1.0]])
        counts = _shared_out(np.diff(ends), max(intervals, len(breaks) + 1))
        pieces = [np.linspace(a, b, count, endpoint=False) for a, b, count in zip(ends, ends[1:], counts)]
        places = np.append(np.concatenate(pieces), 1.0)
    new: Array = np.interp(places, share, mesh)
    if len(breaks):
        new[np.cumsum(counts)[:-1]] = breaks
    new[0], new[-1] = mesh[0], mesh[-1]
    return new


def _shared_out(parts: Array, total: int) -> Any:
    """Return whole numbers, one at least for each part, that sum up to a total and are near the parts of it.

    Examples
    --------
    >>> _shared_out(np.array([0.01, 0.44, 0.55]), 5).tolist()
    [1, 2, 2]
    """
    wanted = parts / parts.sum() * total
    counts = np.maximum(np.floor(wanted).astype(int), 1)
    while counts.sum() != total:
        missing = np.where(counts > 1, wanted - counts, np.inf) if counts.sum() > total else wanted - counts
        if counts.sum() > total:
            counts[np.argmin(missing)] -= 1
        else:
            counts[np.argmax(missing)] += 1
    return counts
