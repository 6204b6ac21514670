"""What the sizes of Newton's updates say of the error that is left: rules that Python and kernels share."""

from __future__ import annotations

import math

from contin.kernels.kernel import kernel
from contin.kernels.kernel_parts import Vector, helper
from contin.levels import LOCATED

#: After a larger update the Jacobian is taken anew, and a first update is trusted no further than this: from there chord steps
#: converge slowly. Ten times larger changes nothing on the test bank: the estimated rate decides.
FAR = 0.1
#: Chord steps that cost about as much as one factorization. Ten times as many save 7 % of the factorizations on the test bank,
#: and take more solves; ten times fewer take 49 % more factorizations.
CHORDS = 4


@helper
def estimated_rate(size: float, before: float, moved: float, fresh: bool) -> float:
    """Return the estimated ratio of the error after an update to its size.

    ``before`` is the size of the update before, infinite without one; ``moved`` the distance from where the Jacobian was taken,
    which is ``fresh`` where it is the one of this update.
    """
    if before == math.inf:  # nothing is known of how nonlinear the equations are
        return min(moved, FAR) if fresh else 1.0
    ratio = size / before
    if fresh:  # quadratic: with a fresh Jacobian the next update is about the square of this one
        return min(1.0, max(size, ratio * min(1.0, ratio)))
    return max(min(moved, 1.0), ratio / (1 - ratio)) if ratio < 0.5 else 1.0


#: What an update says: the error left is below the tolerance; updates that are small no longer shrink; they grow, or are not
#: finite; the next one is better made with a new Jacobian; or with the one at hand.
CONVERGED, STAGNATES, DIVERGES, FRESH, CHORD = range(5)


@helper
def judge_update(
    size: float, before: float, moved: float, number: int, fresh: bool, tolerance: float
) -> tuple[int, float, float]:
    """Return what an update says, the estimated error that it leaves, and the distance from where the Jacobian was taken.

    ``size`` is that of the update, ``before`` that of the one before, infinite without one, and ``number`` counts updates. The
    Jacobian was taken ``moved`` before this update, or is its own, ``fresh``.
    """
    moved = size if fresh else moved + size
    if not size < math.inf:
        return DIVERGES, size, moved
    rate = estimated_rate(size, before, moved, fresh)
    if (number > 1 or size <= tolerance) and size * rate <= tolerance:  # another update has confirmed it
        return CONVERGED, size * rate, moved
    if size < LOCATED and number > 1 and rate >= 0.5:
        return STAGNATES, size * rate, moved
    if number > 2 and size > 2 * before > LOCATED:
        return DIVERGES, size * rate, moved
    slow = size > FAR or not rate < 0.5 or (rate > 0 and math.log(tolerance / size) < CHORDS * math.log(rate))
    return FRESH if slow else CHORD, size * rate, moved


@kernel(reorder=False)
def subtract(x: Vector, update: Vector) -> float:
    """Subtract the update from x, in place; return its largest component relative to 1 + |x|, NaN if one is NaN."""
    largest = 0.0
    for i in range(x.size):
        size = abs(update[i]) / (1 + abs(x[i]))
        if size > largest or size != size:  # noqa: PLR0124
            largest = size
        x[i] -= update[i]
    return largest
