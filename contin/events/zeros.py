"""All zeros of a function along a step: places between which it changes its sign once at most, as far as is seen.

The sign at both ends tells one zero. Two leave it as it was: between places on the cubic the function changes its sign and
comes back, or a parabola through three places dips towards zero. A dip is followed to its lowest place by further parabolas,
until the function has the other sign there, or its values no longer sink.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence

import numpy as np

from contin.core.trial import Event, Trial
from contin.events.arc import Arc, Place
from contin.events.nearness import DEEPER


def separated(arc: Arc, test: Event, knots: list[Place], parts: Sequence[float], dips: bool = True) -> list[Place]:
    """Return the places of a step, and further ones where a test function has several zeros between two of them.

    Parameters
    ----------
    arc : Arc
    test : Event
    knots : list of (float, Trial)
        Places, in order.
    parts : sequence of float
        Parts of the step at which it is looked at, on the cubic.
    dips : bool
        Dips are followed.
    """
    inside = [arc.step * part for part in parts]
    looked = _in_order([*knots, *((s, arc.guessed(s)) for s in inside)])
    values = [trial.value(test) for _, trial in looked]
    several = np.count_nonzero(np.diff(np.sign(values))) > np.count_nonzero(np.diff(np.sign([t.value(test) for _, t in knots])))
    if not (np.isfinite(values).all() and (several or (dips and _dips(looked, values)))):
        return knots
    knots = _in_order([*knots, *((s, arc.near(s)) for s in inside)])
    lowest = _dips(knots, [trial.value(test) for _, trial in knots]) if dips else []

    def passed(sign: float, dip: tuple[float, float]) -> Place | None:
        return followed(lambda s: (s, arc.near(s)), lambda trial: sign * trial.value(test), dip, (0.0, arc.step))

    found = [passed(sign, dip) for sign, dip in lowest]
    return _in_order([*knots, *(place for place in found if place is not None)])


def _in_order(places: list[Place]) -> list[Place]:
    return sorted(places, key=lambda place: place[0])


def _dips(places: list[Place], values: Sequence[float]) -> list[tuple[float, tuple[float, float]]]:
    """Return where, between three places of the same sign, a parabola through the values comes near zero or passes it.

    With the sign, and half its second derivative.
    """
    found = []
    for three, at_three in zip(zip(places, places[1:], places[2:]), zip(values, values[1:], values[2:])):
        if len(set(np.sign(at_three))) > 1:
            continue
        at, square, lowest = _parabola([s for s, _ in three], at_three)
        if square > 0 and three[0][0] < at < three[2][0] and lowest < DEEPER * min(map(abs, at_three)):
            found.append((float(np.sign(at_three[0])), (at, square)))
    return found


def _parabola(places: Sequence[float], values: Sequence[float]) -> tuple[float, float, float]:
    """Return vertex, half the second derivative and value at the vertex of the parabola through three absolute values."""
    (a, b, c), (first, middle, last) = places, map(abs, values)
    if not a < b < c:
        return math.nan, 0.0, math.nan
    before, behind = (middle - first) / (b - a), (last - middle) / (c - b)
    square = (behind - before) / (c - a)
    linear = before + square * (b - a)  # the slope at b
    if not square > 0:
        return math.nan, square, math.nan
    return b - linear / (2 * square), square, middle - linear**2 / (4 * square)


def followed(
    place: Callable[[float], Place], value: Callable[[Trial], float], dip: tuple[float, float], ends: tuple[float, float],
    flat: float = 0.0,
) -> Place | None:  # fmt: skip
    """Return a place where a function that dips towards zero has passed it; None where it turns before.

    Parameters
    ----------
    place : callable
        Returns the place at a distance.
    value : callable
        Returns the function at a trial; it is positive at the ends.
    dip : tuple of float
        About the lowest place, and half the second derivative there: by that and the value, the lowest place is no further off
        than the places on both sides that are looked at, where the function has doubled.
    ends : tuple of float
        Distances between which it lies.
    flat : float
        A lowest value within this of zero is zero to round-off: an inflection.
    """
    (at, square), lowest = dip, math.inf
    while ends[0] <= at <= ends[1]:
        here = place(at)
        least = value(here[1])
        if least < -flat:
            return here
        if least <= flat or not least < DEEPER * lowest:
            return None
        lowest, apart = least, math.sqrt(least / square)
        for first, last in ((-apart, apart), (apart, 2 * apart), (-2 * apart, -apart)):  # on one side of it at an end
            if ends[0] <= at + first and at + last <= ends[1]:
                break
        else:
            return None
        others = [place(at + first), place(at + last)]
        values = [value(trial) for _, trial in others]
        if min(values) < -flat:
            return others[int(np.argmin(values))]
        at, square, _ = _parabola(*zip(*sorted([(at, least), (others[0][0], values[0]), (others[1][0], values[1])])))
        if not square > 0:
            return None
    return None
