"""First guesses of an open strip: functions of the arclength that return quaternion and centreline, seven numbers."""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np
from scipy.optimize import brentq  # type: ignore[import-untyped]

from ribbon_model import ends
from ribbon_model.ends import FREE, HINGED, JOINT, LOOSE, End

Guess = Callable[[float], list[float]]

#: Largest angle of an arch that is a first guess: beyond it the strip passes through itself.
_STEEPEST = 2.4


def arch(start: End, finish: End, distance: float, side: float = 1.0) -> Guess:
    """Return a guess of a planar state whose ends are nearer than its length: an Euler mode of these ends.

    Parameters
    ----------
    start, finish : End
    distance : float
        That of the ends; the length is 1.
    side : float
        +1 to the side of the normal, -1 to the other one.

    Raises
    ------
    ValueError
        The ends are too near or too far.
    """
    mode = _euler_mode(start, finish)
    s = np.linspace(0, 1, 2001)
    mode_values = mode(s) / np.abs(mode(s)).max()
    least = float(np.mean(np.cos(_STEEPEST * mode_values)))
    if not least < distance <= 1:
        raise ValueError(f"distance = {distance:g} must be above {least:.3g}, and at most 1")
    amplitude = brentq(lambda a: np.mean(np.cos(a * mode_values)) - distance, 0.0, _STEEPEST)  # it falls
    angle = side * amplitude * mode_values
    steps = np.diff(s)[:, None] * (np.column_stack([np.sin(angle), np.cos(angle)])[1:] + 0)
    place = np.concatenate([np.zeros((1, 2)), np.cumsum(steps, axis=0)])

    def guess(t):
        a, y, z = (np.interp(t, s, column) for column in (angle, *place.T))
        return [math.cos(a / 2), -math.sin(a / 2), 0, 0, 0, y, z]

    return guess


def twisted(turn: float) -> Guess:
    """Return a guess of a straight strip that is evenly twisted."""
    return lambda t: [math.cos(turn * t / 2), 0, 0, math.sin(turn * t / 2), 0, 0, t]


def twisted_circle(half_twists: float = 0) -> Guess:
    """Return a guess of a closed strip: a circle that bends about d1 at the start, evenly twisted by half twists."""

    def guess(t):
        a, b, r = math.pi * t, math.pi * half_twists * t / 2, 1 / (2 * math.pi)
        q = ends.product((math.cos(a), math.sin(a), 0, 0), (math.cos(b), 0, 0, math.sin(b)))
        return [*q, 0, r * (math.cos(2 * a) - 1), r * math.sin(2 * a)]

    return guess


def _euler_mode(start: End, finish: End) -> Callable[[np.ndarray], np.ndarray]:
    """Return the angle along a column of these ends as it buckles, up to a factor."""
    tangent = 4.493409457909064  # the first zero of tan x = x
    turns_start, turns_finish = (_turns_about_width(end) for end in (start, finish))
    if not finish.held and finish.rotation == FREE:
        return lambda s: 1 - np.cos(math.pi * s / 2)
    if turns_start and turns_finish:
        return lambda s: np.cos(math.pi * s)
    if turns_finish:
        return lambda s: tangent * np.cos(tangent * (1 - s)) - math.sin(tangent)
    if turns_start:
        return lambda s: tangent * np.cos(tangent * s) - math.sin(tangent)
    return lambda s: np.sin(2 * math.pi * s)


def _turns_about_width(end: End) -> bool:
    """Return whether an end can turn about the width."""
    return (end.rotation == HINGED and abs(end.axis[0]) > 1 - LOOSE) or end.rotation in (FREE, JOINT)
