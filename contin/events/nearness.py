"""Whether multipliers can have passed 1, -1 or the unit circle inside a step, and back, by those at both ends of it."""

from __future__ import annotations

import math

from contin.functions.kernel import kernel
from contin.functions.kernel_parts import Matrix

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
