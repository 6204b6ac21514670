"""The extended system of a curve of extrema: successive continuation, as in AUTO's demos ``opt``, ``ops`` and ``obv``.

An extremum of a column G along a branch in one parameter is followed in two, an extremum along that curve in three, and so on.
With j parameters beyond those that fix a solution, and one parameter more, which is held, the solutions of F = 0 are a manifold
of dimension j. The extended system is F = 0, g = 0 with the j derivatives g of G on it (`contin.events.extrema`).
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from contin.arrays import Array
from contin.core.system import System
from contin.core.trial import Event, Trial
from contin.defining.extended import FITS, Borders, Extended
from contin.defining.fold_curve import shrinking
from contin.events.extrema import Stationarity, curvatures
from contin.linalg.factors import Factors


class ExtremumCurve(Extended):
    """F = 0 and g = 0; the last free parameter of ``base`` is the one that is held in the extrema.

    Parameters
    ----------
    base : System
    objective : str
        The column G.
    borders : pair of ndarray, optional
        Of which only the second is used: the rows Phi.
    """

    base: System

    def __init__(self, base: System, objective: str, borders: Borders | None = None) -> None:
        super().__init__(base, borders)
        self.objective = objective
        self.count = base.size - base.equations - 1
        self.equations = base.equations + self.count
        self._known: tuple[bytes, Stationarity] | None = None

    def on(self, base: System) -> ExtremumCurve:
        """Return the extended system of another underlying one, with borders of its own."""
        return ExtremumCurve(base, self.objective)

    def stationarity(self, x: Array) -> Stationarity:
        """Return the derivatives of G at x; rows Phi are made where there are none."""
        key = x.tobytes()
        if self._known is None or self._known[0] != key:
            held = [self.base.size - 1]
            if self.borders is None:
                first = Stationarity(self.base, x, self.objective, held)
                self.borders = (np.empty(0), first.orthonormal() * self.base.weights)
            self._known = key, Stationarity(self.base, x, self.objective, held, self.borders[1])
        return self._known[1]

    def borders_fit(self, x: Array) -> bool:
        """Return whether the tangents have not turned away from the borders."""
        weights = self.base.weights
        longest = max(np.sqrt((weights * v) @ v) for v in self.stationarity(x).kernel)  # 1 where it lies along its border
        return not 1 / longest < FITS

    def residual(self, x: Array) -> Array:
        """Return F and g."""
        return np.append(self.base.residual(x), self.stationarity(x).g)

    def linearize(
        self, x: Array, rows: Sequence[Array] | Array = (), columns: Sequence[Array] | Array = ()
    ) -> tuple[Array, Factors]:
        """Return F and g, and the factored bordered matrix; the rows of g come first among the border rows."""
        found = self.stationarity(x)
        return self.with_own_rows(x, (found.gradients(), found.g), rows, columns)

    def events(self) -> list[Event]:
        """Return those of extrema in one parameter more: the derivative by the held parameter vanishes, too.

        That along the curve vanishes where the curve turns, as well.
        """

        def slope(trial: Trial) -> float:
            system: Any = trial.system
            return float(system.stationarity(trial.x).by_held[0])

        name = self.objective
        found = Event("EX", name, slope, describe=lambda trial: curvatures(trial, name), column=name)
        return [found, *shrinking(self.base)]
