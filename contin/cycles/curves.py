"""The extended systems of curves of period doublings and of torus bifurcations of cycles in two parameters.

A perturbation of the Poincare map (`contin.cycles.round`) that is multiplied by -1, or by exp(i theta), in a round:
v(1) = P v(0), P that of `contin.cycles.multiplier_curves`.
"""

from __future__ import annotations

import functools
import math
from collections.abc import Callable
from typing import cast

import numpy as np

from contin.arrays import Array
from contin.core.system import System
from contin.core.trial import Event, Trial
from contin.cycles.equations import PeriodicEquations
from contin.cycles.multiplier_curves import Doubling, MultiplierCurve, Pair, degenerate, resonances, second_doubling
from contin.cycles.normal_forms import NormalForms
from contin.cycles.round import Round
from contin.defining.extended import Borders
from contin.defining.fold_curve import FoldCurve, shrinking
from contin.events.coefficient import Coefficient
from contin.problems.own_names import PERIOD

#: Logarithms of two multipliers that are one at a fold differ by less: the square root of their error.
_DOUBLE = 1e-3


class CycleCurve(MultiplierCurve):
    """Cycles with a critical multiplier, on a `PeriodicEquations`."""

    @property
    def cycles(self) -> PeriodicEquations:
        """The underlying system."""
        return cast(PeriodicEquations, self.base)

    @functools.cached_property
    def _folds(self) -> FoldCurve:
        return FoldCurve(self.base)

    def fold(self, x: Array) -> float:
        """Return a number that vanishes where the cycle is at a fold, too."""
        y = x[: self.base.size]
        if self._folds.borders is not None and not self._folds.borders_fit(y):
            self._folds.borders = None
        return float(self._folds.null_vectors(y)[2])

    @property
    def copy_shape(self) -> tuple[int, Array]:
        """Number of equations of one copy of L, and the weights of its unknowns."""
        weights = np.append(self.base.weights[: self.base.state_size], np.ones(int(self.cycles.autonomous)))
        return len(weights), weights

    def bordered(self, x: Array, b: Array, c: Array) -> tuple[Callable[[Array], Array], Callable[[Array], Array]]:
        """Return functions that solve with the bordered matrix and with its transpose."""
        solver = self.round(x).solver(self.coupling(x), (b, c))
        return solver.solve, solver.solve_transposed

    def round(self, x: Array) -> Round:
        """Return the linearization without the multiplier that is one along every autonomous cycle."""
        return Round(self.cycles, x[: self.base.size], phased=self.cycles.autonomous)

    def _place(self, wide: Array, v: Array) -> None:
        wide[: self.base.state_size] = v[: self.base.state_size]
        if self.cycles.autonomous:
            wide[self.base.parameter_index(PERIOD)] = v[-1]

    def ends(self, left: Array) -> Array:
        """Return the part of left null vectors that belongs to the condition between the ends."""
        n = len(self.cycles.problem.state_names)
        return left[..., self.base.state_size - n : self.base.state_size]

    def functionals(self, x: Array) -> Array:
        """Return those of the underlying problem, and the coefficient of the normal form."""
        return np.append(super().functionals(x), self.normal_form(x).value)

    def starts(self, right: Array) -> Array:
        """Return right null vectors at t = 0, turned by the symmetry: what P multiplies."""
        found: Array = right[..., : len(self.cycles.problem.state_names)] @ self.cycles.turn.T
        return found


class DoublingCurve(Doubling, CycleCurve):
    """Period doublings: the multiplier -1; the column ``normal_form`` is its coefficient c."""

    def __init__(self, base: System, borders: Borders | None = None, size: float = 1.0) -> None:
        super().__init__(base, borders, size, ("normal_form",))

    def normal_form(self, x: Array) -> Coefficient:
        """Return c."""
        return NormalForms(self.cycles, x).period_doubling()

    def events(self) -> list[Event]:
        """Return those of a second multiplier -1, of generalized period doublings, and of folds."""
        return [
            *shrinking(self.cycles), second_doubling(), degenerate("GPD", "generalized period doubling"),
            _at_fold("LPPD", "fold-flip"),
        ]  # fmt: skip


class TorusCurve(Pair, CycleCurve):
    """Torus bifurcations: the multipliers exp(-+ i theta); columns ``normal_form``, Re d, and ``angle``, theta."""

    def __init__(self, base: System, borders: Borders | None = None, size: float = 1.0) -> None:
        super().__init__(base, borders, size, ("normal_form", "angle"))

    def normal_form(self, x: Array) -> Coefficient:
        """Return the real part of d; NaN at the ends of the curve and at the resonance 1:3, where it is infinite."""
        if self.is_infinite(x):
            return Coefficient(math.nan, math.nan, math.nan)
        return NormalForms(self.cycles, x[: self.base.size]).torus(self.angle(x))

    def events(self) -> list[Event]:
        """Return those of strong resonances, Chenciner points, and folds."""
        return [*shrinking(self.cycles), *resonances(), degenerate("CH", "Chenciner"), _at_fold("LPTR", "fold-torus")]


def _curve(trial: Trial) -> CycleCurve:
    return cast(CycleCurve, trial.system)


def _at_fold(label: str, name: str) -> Event:
    """Return the test function of points where the cycle is at a fold, too: two multipliers are one, up to a square root."""

    def confirm(trial: Trial) -> bool:
        curve = _curve(trial)
        exponents = curve.cycles.eigenvalues(trial.x[: curve.base.size])
        own = 2 * (curve.copies == 2 and curve.angle(trial.x) < _DOUBLE)  # the pair itself is one at R1
        known = int(curve.cycles.autonomous) + own
        return len(exponents) > known and bool(np.sort(np.abs(exponents))[known] < _DOUBLE)

    return Event(label, name, lambda trial: _curve(trial).fold(trial.x), confirm=confirm)
