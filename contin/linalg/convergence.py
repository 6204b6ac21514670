"""What the sizes of Newton's updates say of the error that is left: rules that Python and kernels share."""

from __future__ import annotations

import math

from contin.functions.kernel import kernel
from contin.functions.kernel_parts import Vector, helper
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


@helper
def has_converged(size: float, rate: float, updates: int, tolerance: float) -> bool:
    """Return whether the error after so many updates is below the tolerance, and another update has confirmed that."""
    return (updates > 1 or size <= tolerance) and size * rate <= tolerance


@helper
def stagnates(size: float, rate: float, updates: int) -> bool:
    """Return whether small updates no longer shrink."""
    return size < LOCATED and updates > 1 and rate >= 0.5


@helper
def diverges(size: float, before: float) -> bool:
    """Return whether an update is more than twice the one before."""
    return size > 2 * before > LOCATED


@helper
def wants_jacobian(size: float, rate: float, tolerance: float) -> bool:
    """Return whether the next update is better made with a new Jacobian."""
    far = size > FAR or not rate < 0.5
    return far or (rate > 0 and math.log(tolerance / size) < CHORDS * math.log(rate))


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
