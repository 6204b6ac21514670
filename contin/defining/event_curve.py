"""The defining system of a curve along which a function of the solution keeps the value zero: F = 0 and e = 0.

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
from collections.abc import Callable
from functools import partial
from typing import Any, NamedTuple

import numpy as np

from contin.arrays import Array
from contin.core.differences import derivative
from contin.core.labels import Label
from contin.core.system import System
from contin.core.trial import Event, Trial
from contin.defining.system import Defining, Known
from contin.draws import generator
from contin.events.arc import SpecialPoint
from contin.linalg.border import orthonormal, rows_fit


class _Solutions(NamedTuple):
    """x - y, V as rows (k, size), and what they come from."""

    x: Array
    tangents: Array
    known: Known


class EventCurve(Defining):
    """F = 0 and e = 0, in the free parameters of ``base``.

    Parameters
    ----------
    base : System or Defining
        With one free parameter more than its curves need.
    event : Event
        Whose function keeps the value zero. Where its ``confirm`` says that a zero is none, the curve ends.
    gradient : callable, optional
        ``gradient(system, x)`` returns the derivatives by x, shape (size,).
    """

    def __init__(
        self,
        base: Any,
        event: Event,
        gradient: Callable[[Any, Array], Array] | None = None,
    ) -> None:
        super().__init__(base)
        self.event, self._gradient = event, gradient

    def on(self, base: System) -> EventCurve:
        """Return the defining system of another underlying one."""
        return EventCurve(base, self.event, self._gradient)

    def computed(self, x: Array) -> _Solutions:
        """Return the solutions of F = 0 around x; rows Phi are those that are kept, as long as they fit."""
        rows = generator("event curve").standard_normal((self.size - self.base.equations, self.size))
        found = self._solved(x, rows if self.borders is None else self.borders)
        if self.borders is None or not rows_fit(found.tangents, self.weights):
            self.borders = orthonormal(found.tangents, self.weights) * self.weights
            found = self._solved(x, self.borders)
        return found

    def _solved(self, x: Array, rows: Array) -> _Solutions:
        residual, factors = self.base.linearize(x, rows)
        right_sides = np.eye(len(rows) + 1, self.size, self.size - len(rows) - 1)
        right_sides[0] = np.append(residual, np.zeros(len(rows)))
        solutions = factors.solve(right_sides)
        return _Solutions(x - solutions[0], solutions[1:], Known(residual, factors, solutions[1:]))

    def known(self, x: Array) -> Known | None:
        """Return the matrix M, where the gradient is taken on the solutions."""
        found: _Solutions | None = self.at(x) if self._gradient is None else None
        return None if found is None else found.known

    def value(self, x: Array) -> float:
        """Return e at x."""
        return float(self.event.function(Trial.without_tangent(self.base, x)))

    def is_confirmed(self, x: Array) -> bool:
        """Return whether a zero of e at x is what the event looks for."""
        return self.event.confirm is None or bool(self.event.confirm(Trial.without_tangent(self.base, x)))

    def own_values(self, x: Array) -> Array:
        """Return e."""
        return np.array([self.value(x if self._gradient is not None else self.at(x).x)])

    def own_gradients(self, x: Array) -> Array:
        """Return the derivatives of e by x."""
        if self._gradient is not None:
            return self._gradient(self.base, x)[None]
        there, tangents, _ = self.at(x)
        slopes = [derivative(lambda s: self.value(there + s * v), 1, 1 / np.abs(v).max())[0] for v in tangents]  # noqa: B023
        gradient: Array = np.array(slopes) @ self.borders
        return gradient[None]

    def events(self) -> list[Event]:
        """Return those of ends, and those of solutions that are special in another way, too.

        The curve ends where cycles shrink, and where zeros are not confirmed any more.
        """
        others = [test for test in self.base.events_on_curves() if test.label != self.event.label]
        inside = [
            dataclasses.replace(
                test, function=partial(_inside, test.function), confirm=test.confirm and partial(_inside, test.confirm)
            )
            for test in others
        ]
        name = f"the end of {self.event.name!r}, whose confirm returns False"
        ends = [Event(Label.END, name, _confirmed, terminal=True)] if self.event.confirm else []
        return [*super().events(), *ends, *inside]

    def judged(self, point: SpecialPoint) -> SpecialPoint:
        """Return a special point, by the label and name that the kind knows it by."""
        return self.base.judged_on_curve(point, _solution(point.trial))


def _confirmed(trial: Trial) -> float:
    system: Any = trial.system
    return 1.0 if system.is_confirmed(trial.x) else -1.0


def _inside(function: Callable[[Trial], Any], trial: Trial) -> Any:
    """Return a function of the underlying solution of a point of a curve."""
    return function(_solution(trial))


def _solution(trial: Trial) -> Trial:
    system: Any = trial.system
    return Trial.without_tangent(system.base, system.inside(trial.x))
