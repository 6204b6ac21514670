"""The extended system of a curve along which a function of the solution keeps the value zero: F = 0 and e = 0.

The function may be a column less a value, or any test function: of a user, or of a curve in two parameters.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np

from contin.arrays import Array
from contin.curves.extended import Extended
from contin.linalg.factors import Factors
from contin.stepping.trial import Trial

#: Length of central differences, relative to 1 + |x|: the cube root of round-off, where their error and round-off are equal.
_DIFFERENCE = 6e-6


class EventCurve(Extended):
    """F = 0 and e = 0, in the free parameters of ``base``.

    Parameters
    ----------
    base : System or Extended
        With one free parameter more than its curves need.
    function : callable
        ``function(trial)``, as in `TestFunction`.
    gradient : callable, optional
        ``gradient(system, x)`` returns the derivatives by x, shape (size,); central differences by default, two calls of the
        function for each unknown.
    """

    def __init__(
        self, base: Any, function: Callable[[Trial], float], gradient: Callable[[Any, Array], Array] | None = None
    ) -> None:
        super().__init__(base, None)
        self.function, self._gradient = function, gradient
        self.equations = base.equations + 1

    def on(self, base: Any) -> EventCurve:
        """Return the extended system of another underlying one."""
        return EventCurve(base, self.function, self._gradient)

    def borders_fit(self, x: Array) -> bool:
        """Return whether those of the underlying curve fit, if it has any."""
        return not isinstance(self.base, Extended) or self.base.borders_fit(x)

    def value(self, x: Array) -> float:
        """Return e at x."""
        return float(self.function(Trial.without_tangent(self.base, x)))

    def gradient(self, x: Array) -> Array:
        """Return the derivatives of e by x, shape (size,)."""
        if self._gradient is not None:
            return self._gradient(self.base, x)
        result = np.empty(self.size)
        for at, size in enumerate(_DIFFERENCE * (1 + np.abs(x))):
            moved = x.copy()
            moved[at] = x[at] + size
            ahead, wide = self.value(moved), moved[at]
            moved[at] = x[at] - size
            result[at] = (ahead - self.value(moved)) / (wide - moved[at])
        return result

    def residual(self, x: Array) -> Array:
        """Return F and e."""
        return np.append(self.base.residual(x), self.value(x))

    def linearize(
        self, x: Array, rows: Sequence[Array] | Array = (), columns: Sequence[Array] | Array = ()
    ) -> tuple[Array, Factors]:
        """Return F and e, and the factored bordered matrix; the row of e comes first among the border rows."""
        return self.with_own_rows(x, (self.gradient(x)[None], np.array([self.value(x)])), rows, columns)
