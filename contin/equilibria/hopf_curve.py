"""The extended system of a curve of Hopf points of equilibria in two parameters.

With A the Jacobian and v = v_1 + i omega v_2, the equations A v = i omega v are A v_1 = -kappa v_2 and A v_2 = v_1; kappa is
omega^2. They are regular at a Bogdanov-Takens point, where omega vanishes. Beyond it kappa is negative, and two
real eigenvalues are opposite (a neutral saddle, no bifurcation).
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any, cast

import numpy as np

from contin.arrays import Array, ComplexArray
from contin.core.system import System
from contin.core.trial import Event, Trial
from contin.defining.critical_curve import CriticalCurve, other_pairs, signed_smallest
from contin.defining.extended import Borders
from contin.equilibria.lyapunov import critical_pair, first_lyapunov
from contin.events.coefficient import Coefficient
from contin.linalg.dense import DenseFactors, eigenvalues

#: A kappa below this part of its first value is zero: Bogdanov-Takens points are located more exactly than that.
_NO_FREQUENCY = 1e-10


class HopfCurve(CriticalCurve):
    """Hopf points of an `Algebraic` system made by `as_field`; columns ``frequency`` and ``lyapunov`` (l1)."""

    kind, copies = "HB", 2

    def __init__(self, base: System, borders: Borders | None = None, size: float = 1.0) -> None:
        super().__init__(base, borders, size, ("frequency", "lyapunov"))

    @property
    def copy_shape(self) -> tuple[int, Array]:
        """Number of equations of one copy of L, and the weights of its unknowns."""
        return self.base.state_size, self.base.weights[: self.base.state_size]

    def matrix(self, x: Array) -> Array:
        """Return the Jacobian of the vector field, with the states divided by their sizes, shape (n, n)."""
        system: Any = self.base
        jacobian: Array = system.field_jacobian(x[: self.base.size])
        return jacobian

    def imaginary_part(self, x: Array) -> float:
        """Return the frequency; 0 at a neutral saddle."""
        return math.sqrt(max(self.kappa(x), 0.0))

    def bordered(self, x: Array, b: Array, c: Array) -> tuple[Callable[[Array], Array], Callable[[Array], Array]]:
        """Return functions that solve with the bordered matrix and with its transpose."""
        one, two = np.eye(self.base.state_size), np.eye(2)
        coupled = np.kron(two, self.matrix(x)) + np.kron([[0.0, self.kappa(x)], [-1.0, 0.0]], one)
        rows, columns = np.kron(two, c[None, :]), np.kron(two, b[:, None])
        factors = DenseFactors(np.block([[coupled, columns], [rows, np.zeros((2, 2))]]))
        return factors.solve, factors.solve_transposed

    def by_kappa(self, x: Array, right: Array, left: Array) -> Array:
        """Return w_1.v_2."""
        result: Array = left[:, 0] @ right[1]
        return result

    def functionals(self, x: Array) -> Array:
        """Return those of the underlying problem, the frequency, and the first Lyapunov coefficient."""
        return np.append(super().functionals(x), [self.imaginary_part(x), self.lyapunov(x).value])

    def lyapunov(self, x: Array) -> Coefficient:
        """Return the first Lyapunov coefficient; NaN at Bogdanov-Takens points and neutral saddles."""
        if self.kappa(x) <= _NO_FREQUENCY * self.kappa_size:
            return Coefficient(math.nan, math.nan, math.nan)
        system: Any = self.base
        y = x[: self.base.size]
        return first_lyapunov(system, y, critical_pair(system.jacobian(y), self.imaginary_part(x)))

    def others(self, x: Array) -> ComplexArray:
        """Return the eigenvalues but the two that are critical."""
        values = eigenvalues(self.matrix(x))
        return values[np.argsort(np.abs(values**2 + self.kappa(x)))[2:]]

    def events(self) -> list[Event]:
        """Return those of Bogdanov-Takens, generalized Hopf (Bautin), zero-Hopf (fold-Hopf) and double Hopf points."""

        def curve(trial: Trial) -> HopfCurve:
            return cast(HopfCurve, trial.system)

        def kappa(trial: Trial) -> float:
            return curve(trial).kappa(trial.x) / curve(trial).kappa_size

        def lyapunov(trial: Trial) -> float:
            return curve(trial).lyapunov(trial.x).signed

        def is_zero(trial: Trial) -> bool:
            return curve(trial).lyapunov(trial.x).vanishes

        def zero(trial: Trial) -> float:
            return signed_smallest(curve(trial).others(trial.x))

        def pairs(trial: Trial) -> float:
            return other_pairs(curve(trial).others(trial.x))[0]

        def has_pair(trial: Trial) -> bool:
            return other_pairs(curve(trial).others(trial.x))[1]

        found = [
            Event("BT", "Bogdanov-Takens", kappa, terminal=True),
            Event("GH", "generalized Hopf", lyapunov, confirm=is_zero),
        ]
        if self.base.state_size > 2:
            found += [Event("ZH", "zero-Hopf", zero), Event("HH", "double Hopf", pairs, confirm=has_pair)]
        return found
