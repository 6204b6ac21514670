"""The defining system of a curve of Hopf points, of equilibria and of fields, in two parameters.

With A the Jacobian and v = v_1 + i omega v_2, the equations A v = i omega v are A v_1 = -kappa v_2 and A v_2 = v_1: kappa is
omega^2, and

                                                        [ 0   -kappa ]
                                                    P = [            ].
                                                        [ 1      0   ]

They are regular at a Bogdanov-Takens point, where omega vanishes. Beyond it kappa is negative, and two real eigenvalues are
opposite (a neutral saddle, no bifurcation).
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import TypeVar, cast

import numpy as np

from contin.arrays import Array, ComplexArray
from contin.core.labels import Label
from contin.core.spectral import Spectral
from contin.core.trial import Event, Trial
from contin.defining.critical_curve import CriticalCurve, degenerate, other_pairs, signed_smallest
from contin.events.coefficient import UNKNOWN, Coefficient
from contin.events.normal_forms import coefficient, pair
from contin.levels import DEPENDENT

T = TypeVar("T")


class HopfCurve(CriticalCurve):
    """Hopf points of a `Fields` system, or of an `Algebraic` one made by `as_field`.

    Columns ``frequency`` and ``lyapunov`` (l1).
    """

    kind = Label.HOPF
    own_equations, own_unknowns = 2, 1
    own_columns = ("frequency", "lyapunov")

    def coupling(self, kappa: float) -> Array:
        """Return the real matrix with the eigenvalues -+ i omega."""
        return np.array([[0.0, -kappa], [1.0, 0.0]])

    def coupling_slope(self, kappa: float) -> Array:
        """Return its derivative."""
        return np.array([[0.0, -1.0], [0.0, 0.0]])

    def imaginary_part(self, x: Array) -> float:
        """Return the frequency."""
        return self.frequency(x)

    def frequency(self, x: Array) -> float:
        """Return the frequency; 0 at a neutral saddle and where it is not known from 0, as at a Bogdanov-Takens point."""
        kappa = self.kappa(x)
        return math.sqrt(kappa) if kappa > DEPENDENT * self.kappa_size else 0.0

    def normal_form(self, x: Array) -> Coefficient:
        """Return the first Lyapunov coefficient; NaN at Bogdanov-Takens points and neutral saddles."""
        frequency = self.frequency(x)
        return coefficient(self.base, self.inside(x), pair, frequency) if frequency else UNKNOWN

    def functionals(self, x: Array) -> Array:
        """Return those of the underlying problem, the frequency, and the first Lyapunov coefficient."""
        *known, lyapunov = super().functionals(x)
        return np.array([*known, self.imaginary_part(x), lyapunov])

    def others(self, x: Array) -> ComplexArray:
        """Return the eigenvalues but the two that are critical, times -1: not all stable ones of a field are known."""
        values = cast(Spectral, self.base).computed_eigenvalues(self.inside(x))
        return -values[np.argsort(np.abs(values**2 + self.kappa(x)))[2:]]

    def events(self) -> list[Event]:
        """Return those of Bogdanov-Takens, generalized Hopf (Bautin), zero-Hopf (fold-Hopf) and double Hopf points."""

        def of_curve(function: Callable[[HopfCurve, Array], T]) -> Callable[[Trial], T]:
            return lambda trial: function(cast(HopfCurve, trial.system), trial.x)

        found = [
            Event(Label.BOGDANOV_TAKENS, "Bogdanov-Takens", of_curve(HopfCurve.kappa), terminal=True),
            degenerate(Label.GENERALIZED_HOPF, "generalized Hopf"),
        ]
        if self.base.state_size > 2:
            found += [
                Event(Label.ZERO_HOPF, "zero-Hopf", of_curve(lambda curve, x: signed_smallest(curve.others(x)))),
                Event(Label.DOUBLE_HOPF, "double Hopf", of_curve(lambda curve, x: other_pairs(curve.others(x))[0]),
                      confirm=of_curve(lambda curve, x: other_pairs(curve.others(x))[1])),
            ]  # fmt: skip
        return found
