"""Columns of a branch at its points, and on smooth curves between them, by cubics with its tangents."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from contin.arrays import Array
from contin.core.differences import derivative
from contin.core.labels import Label
from contin.core.protocol import Discretization
from contin.core.trial import Trial
from contin.events.labelled import finding_of
from contin.results.point import Point

#: Straight pieces in which a cubic is drawn. Tangents turn by about 20 degrees in a step at most, so the corners of the polygon
#: turn by one or two; with a quarter as many, corners are seen.
PARTS = 16


def hermite(first: Array, slope: Array, last_slope: Array, last: Array, u: Array) -> Array:
    """Return cubics at places u of the unit interval, from values and slopes at both ends.

    Examples
    --------
    >>> one = np.ones(1)
    >>> hermite(0 * one, 0 * one, 3 * one, one, np.array([0.5])).tolist()  # u**3
    [0.125]
    """
    chord = last - first
    return first + u * (slope + u * (3 * chord - 2 * slope - last_slope + u * (slope + last_slope - 2 * chord)))


def through(s: Array, values: Array, rates: Array, parts: int = PARTS) -> Array:
    """Return columns on cubics from each point to the next one, shape (c, (K - 1) parts + 1).

    A step with a tangent at one end only is a parabola, one with none a straight line: nothing is made up.

    Parameters
    ----------
    s : ndarray, shape (K,)
        Arclengths.
    values, rates : ndarray, shape (c, K)
        Columns, and their derivatives by the arclength; NaN where a derivative is not known.
    parts : int
        Pieces of a step.

    Examples
    --------
    >>> through(np.array([0.0, 1.0]), np.array([[0.0, 1.0]]), np.array([[0.0, np.nan]]), 2).tolist()  # s**2
    [[0.0, 0.25, 1.0]]
    """
    step, chord = np.diff(s), np.diff(values)
    first, last = rates[:, :-1] * step, rates[:, 1:] * step
    first = np.where(np.isnan(first), 2 * chord - last, first)
    last = np.where(np.isnan(last), 2 * chord - first, last)
    first, last = (np.where(np.isnan(slope), chord, slope)[..., None] for slope in (first, last))
    inside = hermite(values[:, :-1, None], first, last, values[:, 1:, None], np.arange(parts) / parts)
    return np.concatenate([inside.reshape(len(values), -1), values[:, -1:]], axis=1)


#: Labels of points at which a branch of cycles begins or ends with cycles that have shrunk onto others.
_SHRUNK = (Label.HOPF, Label.PERIOD_DOUBLING)


def column(points: Sequence[Point], name: str) -> Array:
    """Return a parameter, functional, state of equilibria, ``"arclength"``, ``"norm"`` or ``"discretization_error"``.

    The norm is the root mean square of the states over the nodes.
    """
    if points and name in (*points[0].parameters, *points[0].functionals, *points[0].system.named_states):
        return np.array([point[name] for point in points])
    if name in ("arclength", "discretization_error"):
        return np.array([getattr(point, name) for point in points])
    return np.array([norm(point.system, point.x) for point in points])


def norm(system: Discretization, x: Array) -> float:
    """Return the root mean square of the states over the nodes."""
    return float(np.sqrt(np.mean(np.sum(system.states(x) ** 2, axis=1))))


def curve(points: Sequence[Point], names: Sequence[str], parts: int = PARTS) -> Array:
    """Return columns of a branch on a smooth curve through its points, shape (c, (K - 1) parts + 1)."""
    s, values = column(points, "arclength"), np.array([column(points, name) for name in names])
    if len(points) < 2:
        return values
    rates = np.array([_rates(point, names) for point in points]).T
    for end in (0, -1):  # extremes of cycles have a corner where these shrink: their size is the distance, not negative behind
        if points[end].label in _SHRUNK and points[end].system.is_cycle:
            rates[:, end] = np.nan
    return through(s, values, rates, parts)


def _rates(point: Point, names: Sequence[str]) -> Array:
    """Return the derivatives of columns by the arclength of the branch at a point, NaN where they are not known."""
    tangent = next(iter(finding_of(point.details).leaving), point.tangent) if np.isnan(point.tangent).any() else point.tangent
    found = np.full(len(names), np.nan)
    if np.isnan(tangent).any():
        return found
    moving = [i for i, name in enumerate(names) if name not in ("arclength", "discretization_error")]

    def values(distance: float) -> Array:
        trial = Trial.without_tangent(point.system, point.x + distance * tangent)
        return np.array([_value(trial, names[i]) for i in moving])

    if moving:
        found[moving] = derivative(values)[0]
    found[[i for i, name in enumerate(names) if name == "arclength"]] = 1.0
    return found


def _value(trial: Trial, name: str) -> float:
    """Return a column at a point that has not been made a record; see `column`."""
    system = trial.system
    if name in (*system.problem.parameters, *system.problem.functionals, *system.named_states):
        return trial[name]
    return norm(system, trial.x)
