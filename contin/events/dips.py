"""Several zeros inside a step: dips of a test function, and whether multipliers can have passed and come back.

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
from contin.kernels.kernel import kernel
from contin.kernels.kernel_parts import Matrix, helper

#: A step is looked at inside where the logarithm of a multiplier comes nearer than this to one at which something happens: a
#: little less than the distance pi of 1 from -1, or nearer than so many times its change over the step. A pair can reach -1 and
#: come back, and be at the ends where it was nearly: with 0.5, and 1.5 changes, two period doublings of Mathieu's equation in
#: one step are passed. Ten times larger, nearly all steps are looked at inside, and multipliers are computed up to three times
#: as often.
_NEAR = 3.0

#: Where a step is looked at inside, on the cubic, as parts of it: also beside its ends, where a dip towards zero would show at
#: no other place. Without those two of Mathieu's doublings, a part of .03 and .04 behind the beginning of a step, are passed.
LOOKS = (1 / 64, 1 / 4, 1 / 2, 3 / 4, 63 / 64)
#: A dip is followed where a parabola goes below this part of the values around it, and as long as each place lowers the value
#: to this part. Ten times smaller, two period doublings that nearly meet are passed.
DEEPER = 0.5
#: The logarithm of a multiplier is no smaller than that of this number: a superstable cycle has the multiplier zero.
NO_MULTIPLIER = 1e-300
#: A multiplier is told from 1 where its logarithm is larger than so many times that of the one that is 1. The two of a double
#: one differ by 1e-7 of it. Ten times larger, a cycle beside a fold may count as stable.
AS_FAR = 2.0
#: What multipliers pass.
ONE, MINUS_ONE, CIRCLE = range(3)


@kernel(last=True)
def comes_near(real: Matrix, imaginary: Matrix, what: int, map_: int, longer: float) -> int:
    """Return whether a multiplier may have passed 1 or -1, or as one of a pair the circle, and back.

    The first and the last row of ``real`` and ``imaginary`` hold the logarithms at both ends, those that are not known as NaN.
    A real multiplier becomes one of a pair only where it meets another one of its sign, and one of both moves half of the way.
    It leaves its sign only in that way, unless it may be zero, as those of a ``map_`` may.

    A logarithm is a rate times the time of a round, which becomes ``longer`` by this factor: towards a homoclinic orbit all
    logarithms grow with it, and nothing passes. So rates are compared, over the time at either end.
    """
    last, n = real.shape
    last -= 1
    for side in range(2):
        here, there, scale = (0, last, 1 / longer) if side == 0 else (last, 0, longer)
        for i in range(n):
            x, y = real[here, i], imaginary[here, i]
            move, partner, half_way = math.inf, math.inf, math.inf
            for j in range(n):
                turn = y - imaginary[there, j]
                turn -= 2 * math.pi * math.floor(turn / (2 * math.pi) + 0.5)
                move = min(move, math.hypot(x - scale * real[there, j], turn))
                if j != i and abs(imaginary[here, j]) == abs(y):
                    partner, half_way = min(partner, abs(real[here, j])), min(half_way, abs(x - real[here, j]) / 2)
            distance = math.hypot(x, y)
            if what == CIRCLE:
                distance = max(abs(x), partner)
            elif what == MINUS_ONE:
                distance = math.hypot(x, math.pi - abs(y))
                if y == 0.0 and not map_:
                    distance = max(distance, half_way)
            if not (distance > _NEAR and _NEAR * move < distance):
                return 1
    return 0


def separated(arc: Arc, test: Event, knots: list[Place], parts: Sequence[float], dips: bool = True) -> list[Place]:
    """Return the places of a step, and further ones where a test function has several zeros between two of them.

    - ``arc`` (Arc)
    - ``test`` (Event)
    - ``knots`` (list of (float, Trial)): Places, in order.
    - ``parts`` (sequence of float): Parts of the step at which it is looked at, on the cubic.
    - ``dips`` (bool): Dips are followed.
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
        at, square, lowest = parabola(*(s for s, _ in three), *map(abs, at_three))
        if three[0][0] < at < three[2][0] and lowest < DEEPER * min(map(abs, at_three)):
            found.append((float(np.sign(at_three[0])), (at, square)))
    return found


@helper
def parabola(a: float, b: float, c: float, first: float, middle: float, last: float) -> tuple[float, float, float]:
    """Return the lowest place of the parabola through values at a, b and c, half its second derivative, and its value there.

    The place is NaN where there is none.
    """
    if not a < b < c:
        return math.nan, 0.0, math.nan
    before, behind = (middle - first) / (b - a), (last - middle) / (c - b)
    square = (behind - before) / (c - a)
    linear = before + square * (b - a)  # the slope at b
    if not square > 0:
        return math.nan, square, math.nan
    return b - linear / (2 * square), square, middle - linear * linear / (4 * square)


def followed(
    place: Callable[[float], Place], value: Callable[[Trial], float], dip: tuple[float, float], ends: tuple[float, float],
    flat: float = 0.0,
) -> Place | None:  # fmt: skip
    """Return a place where a function that dips towards zero has passed it; None where it turns before.

    - ``place`` (callable): Returns the place at a distance.
    - ``value`` (callable): Returns the function at a trial; it is positive at the ends.
    - ``dip`` (tuple of float): About the lowest place, and half the second derivative there: by that and the value, the lowest
      place is no further off than the places on both sides that are looked at, where the function has doubled.
    - ``ends`` (tuple of float): Distances between which it lies.
    - ``flat`` (float): A lowest value within this of zero is zero to round-off: an inflection.
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
        places, sizes = zip(*sorted([(at, least), (others[0][0], values[0]), (others[1][0], values[1])]))
        at, square, _ = parabola(*places, *map(abs, sizes))
        if not square > 0:
            return None
    return None
