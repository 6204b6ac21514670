"""The coefficient of a normal form, with an estimate of its error."""

from __future__ import annotations

import functools
import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np

from contin import draws
from contin.arrays import Array, Numbers
from contin.levels import APART, CERTAIN, LOCATED, ROUGH, ROUND_OFF

#: A value that is not small beside its terms is no error, with terms below this size: that is not estimated. Near where it is
#: infinite the terms are large: 2e7 at the doubling of Hénon's map with a Jacobian of -1 + 1e-7.
_MODERATE = 1e6


@dataclass(frozen=True)
class Coefficient:
    """A coefficient of a normal form, its estimated error, and the sum of the absolute values of its terms.

    The bifurcation is supercritical where ``side * value`` is negative. ``estimate`` returns the error, when that is asked for.
    """

    value: float
    size: float
    estimate: Callable[[], float]
    side: int = 1

    @functools.cached_property
    def error(self) -> float:
        """The estimated error."""
        return self.estimate()

    @classmethod
    def of(cls, terms: Callable[[Array], Numbers], x: Array, system: Any) -> Coefficient:
        """Return the coefficient at a point x from its terms there: the real part of their sum.

        The relative error of the derivatives of ``system`` is part of the error, and so is what an error of x
        changes. At centres of conservative systems the coefficient is zero, and not larger than its error.
        """
        best, of_derivatives = system.with_derivative_error(lambda: terms(x))
        value, size = float(best.sum().real), float(np.abs(best).sum())

        def estimate() -> float:
            random, changes = draws.generator("coefficient"), []
            for _ in range(draws.DRAWS):
                moved = x + ROUND_OFF * (1 + np.abs(x)) * draws.signs(random, x)
                changes.append(abs(value - float(terms(moved).sum().real)))
            return float(CERTAIN * max(changes) + of_derivatives * size)

        return cls(value, size, estimate)

    def is_meaningless(self, error: float) -> bool:
        """Return whether an error is as large as the terms, and not just round-off of terms that are zero."""
        return not (error < self.size or error < LOCATED)

    def signed(self, known: float) -> float:
        """Return the value for a test function: 0 where it is smaller than its error, as all along a curve of linear equations.

        ``known`` is the error of the point, relative to 1 + |x|: what Newton's method left may be more than at located ones.
        """
        error = self.error * max(1.0, CERTAIN * known / ROUND_OFF) if not self.is_certain else 0.0
        return self.value if not abs(self.value) <= error else 0.0

    @property
    def is_certain(self) -> bool:
        """Its terms do not cancel, and are neither so large nor so small that it can be an error."""
        return abs(self.value) > ROUGH * self.size and LOCATED < self.size < _MODERATE

    @property
    def vanishes(self) -> bool:
        """The terms cancel, or are round-off of derivatives of order one, or no larger than their error: it is 1e18 at 1e-9.

        Where a coefficient is round-off of large terms, or infinite, its sign changes without a zero.
        """
        small = abs(self.value) < APART * self.size + LOCATED
        return small or (self.size < _MODERATE and abs(self.value) <= self.error)


#: Where nothing is known: at the ends of curves, and where it is infinite.
UNKNOWN = Coefficient(math.nan, math.nan, lambda: math.nan)
