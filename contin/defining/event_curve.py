"""The extended system of a curve along which a function of the solution keeps the value zero: F = 0 and e = 0.

The function may be a column less a value, or any test function: of a user, or of a curve in two parameters. Where its gradient
is not known, it is taken on the solutions of F = 0 only. With k rows Phi that make the matrix regular, k the unknowns of F = 0
beyond its equations,

                              [ F_x ]                        [ F ]
                          M = [     ],    M V = [0; I],   M y = [   ],
                              [ Phi ]                        [ 0 ]

e is evaluated at x - y, which is on F = 0 up to the square of F. Its gradient there is the sum of the derivatives along the
columns of V, each times its row of Phi: k derivatives by differences, for any number of unknowns.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Callable, Sequence
from functools import partial
from typing import Any

import numpy as np

from contin.arrays import Array
from contin.core.differences import derivative
from contin.core.trial import Event, Trial
from contin.defining.extended import FITS, Borders, Extended
from contin.defining.fold_curve import shrinking
from contin.events.arc import SpecialPoint
from contin.events.extrema import orthonormal
from contin.linalg.factors import Factors


class EventCurve(Extended):
    """F = 0 and e = 0, in the free parameters of ``base``.

    Parameters
    ----------
    base : System or Extended
        With one free parameter more than its curves need.
    function : callable
        ``function(trial)``, as in `Event`.
    gradient : callable, optional
        ``gradient(system, x)`` returns the derivatives by x, shape (size,).
    borders : pair of ndarray, optional
        Of which only the second is used: the rows Phi.
    label : str
        That of the function.
    """

    def __init__(
        self,
        base: Any,
        function: Callable[[Trial], float],
        gradient: Callable[[Any, Array], Array] | None = None,
        borders: Borders | None = None,
        label: str = "",
    ) -> None:
        super().__init__(base, borders)
        self.function, self._gradient, self.label = function, gradient, label
        self.equations = base.equations + 1
        self._known: tuple[bytes, Array, Array] | None = None

    def on(self, base: Any) -> EventCurve:
        """Return the extended system of another underlying one, with borders of its own."""
        return EventCurve(base, self.function, self._gradient, label=self.label)

    def borders_fit(self, x: Array) -> bool:
        """Return whether the tangents, and null vectors of the underlying curve, have not turned away from their borders."""
        base: Any = self.base
        if base.on_curve and not base.borders_fit(x):
            return False
        if self._gradient is not None:
            return True
        longest = max(np.sqrt((self.weights * v) @ v) for v in self._solutions(x)[1])  # 1 where it lies along its border
        return not 1 / longest < FITS

    def _solutions(self, x: Array) -> tuple[Array, Array]:
        """Return x - y and V, as rows (k, size); rows Phi are made where there are none."""
        key = x.tobytes()
        if self._known is None or self._known[0] != key:
            count = self.size - self.base.equations
            if self.borders is None:
                random = np.random.default_rng(11).standard_normal((count, self.size))
                tangents = self._solved(x, random)[1]
                self.borders = (np.empty(0), orthonormal(tangents, self.weights) * self.weights)
            self._known = key, *self._solved(x, self.borders[1])
        return self._known[1:]

    def _solved(self, x: Array, rows: Array) -> tuple[Array, Array]:
        residual, factors = self.base.linearize(x, rows)
        unit = np.zeros((len(rows), self.size))
        unit[:, self.size - len(rows) :] = np.eye(len(rows))
        right_sides = np.vstack([np.append(residual, np.zeros(len(rows))), unit])
        solutions = factors.solve(right_sides)
        return x - solutions[0], solutions[1:]

    def value(self, x: Array) -> float:
        """Return e at x."""
        return float(self.function(Trial.without_tangent(self.base, x)))

    def _own_value(self, x: Array) -> float:
        return self.value(x if self._gradient is not None else self._solutions(x)[0])

    def gradient(self, x: Array) -> Array:
        """Return the derivatives of e by x, shape (size,)."""
        if self._gradient is not None:
            known: Array = self._gradient(self.base, x)
            return known
        there, tangents = self._solutions(x)
        sizes = [1 / np.abs(v).max() for v in tangents]
        slopes = [derivative(lambda s: self.value(there + s * v), 1, size)[0] for v, size in zip(tangents, sizes)]  # noqa: B023
        gradient: Array = np.array(slopes) @ self.borders[1]
        return gradient

    def residual(self, x: Array) -> Array:
        """Return F and e."""
        return np.append(self.base.residual(x), self._own_value(x))

    def linearize(
        self, x: Array, rows: Sequence[Array] | Array = (), columns: Sequence[Array] | Array = ()
    ) -> tuple[Array, Factors]:
        """Return F and e, and the factored bordered matrix; the row of e comes first among the border rows."""
        return self.with_own_rows(x, (self.gradient(x)[None], np.array([self._own_value(x)])), rows, columns)

    def events(self) -> list[Event]:
        """Return that of the end where cycles shrink, and those of solutions that are special in another way, too."""
        others = [test for test in self.base.events_on_curves() if test.label != self.label]
        inside = [
            dataclasses.replace(
                test, function=partial(_inside, test.function), confirm=test.confirm and partial(_inside, test.confirm)
            )
            for test in others
        ]
        return [*shrinking(self.base), *inside]

    def judged(self, point: SpecialPoint) -> SpecialPoint:
        """Return a special point, by the label and name that the kind knows it by."""
        found: SpecialPoint = self.base.judged_on_curve(point, _solution(point.trial))
        return found


def _inside(function: Callable[[Trial], Any], trial: Trial) -> Any:
    """Return a function of the underlying solution of a point of a curve."""
    return function(_solution(trial))


def _solution(trial: Trial) -> Trial:
    system: Any = trial.system
    return Trial.without_tangent(system.base, trial.x[: system.base.size])
