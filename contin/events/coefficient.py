"""The coefficient of a normal form, with an estimate of its error."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np

from contin.arrays import Array

#: A coefficient is computed again at a point moved by so much, relative to 1 + |x|: points are located to 1e-14 at best.
#: Ten times larger, errors are ten times as large.
_MOVED = 1e-14
#: It is computed as often as this, with directions from this seed.
_DRAWS, _SEED = 2, 5
#: Its error is so many times the largest change: one draw may hardly count, and a coefficient that is infinite, as at a period
#: doubling in a conservative system, changes by less than a tenth of its value once in 20 draws. Ten times larger, errors are
#: ten times as large.
_CERTAIN = 10.0
#: A coefficient is zero below this part of its terms, or below this number. Ten times larger or smaller, the points of the
#: tests are the same.
_CANCELLED, _ZERO = 1e-6, 1e-9


class Coefficient(NamedTuple):
    """A coefficient of a normal form, its estimated error, and the sum of the absolute values of its terms.

    The bifurcation is supercritical where ``side * value`` is negative.
    """

    value: float
    error: float
    size: float
    side: int = 1

    @classmethod
    def of(cls, terms: Callable[[Array], Array], x: Array, system: Any) -> Coefficient:
        """Return the coefficient at a point x from its terms there.

        The relative error of the derivatives of ``system`` is part of the error, and so is what an error of x
        changes. At centres of conservative systems the coefficient is zero, and not larger than its error.
        """
        random, points = np.random.default_rng(_SEED), [x]
        for _ in range(_DRAWS):
            points.append(x + _MOVED * (1 + np.abs(x)) * random.choice((-1.0, 1.0), x.size))
        (best, *others), error = system.with_derivative_error(lambda: [terms(point) for point in points])
        size, change = float(np.abs(best).sum()), max(abs(float(best.sum() - other.sum())) for other in others)
        return cls(float(best.sum()), _CERTAIN * change + error * size, size)

    @property
    def is_meaningless(self) -> bool:
        """The error is as large as the terms, and not just round-off of terms that are zero."""
        return not (self.error < self.size or self.error < _ZERO)

    @property
    def signed(self) -> float:
        """The value for a test function: 0 where it is smaller than its error, as all along a curve of linear equations."""
        return 0.0 if abs(self.value) <= self.error else self.value

    @property
    def vanishes(self) -> bool:
        """The terms cancel, or are round-off of derivatives of order one.

        Where a coefficient is round-off of large terms, or infinite, its sign changes without a zero.
        """
        return abs(self.value) < _CANCELLED * self.size + _ZERO


#: Where nothing is known: at the ends of curves, and where it is infinite.
UNKNOWN = Coefficient(math.nan, math.nan, math.nan)
