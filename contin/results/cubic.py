"""Cubics that have given values and slopes at both ends of every step, by which all pictures draw curves."""

from __future__ import annotations

import numpy as np

from contin.arrays import Array

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
    u = np.arange(parts) / parts
    inside = hermite(values[:, :-1, None], first, last, values[:, 1:, None], u)
    return np.concatenate([inside.reshape(len(values), -1), values[:, -1:]], axis=1)
