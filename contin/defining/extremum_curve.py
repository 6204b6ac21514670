"""The defining system of a curve of extrema: successive continuation, as in AUTO's demos ``opt``, ``ops`` and ``obv``.

An extremum of a column G along a branch in one parameter is followed in two, an extremum along that curve in three, and so on.
With j parameters beyond those that fix a solution, and one parameter more, which is held, the solutions of F = 0 are a manifold
of dimension j. The system is F = 0, g = 0 with the j derivatives g of G on it (`contin.events.extrema`).
"""

from __future__ import annotations

from typing import cast

from contin.arrays import Array
from contin.core.labels import Label
from contin.core.system import System
from contin.core.trial import Event, Trial
from contin.defining.system import Defining, Known
from contin.events.extrema import Stationarity, curvatures


class ExtremumCurve(Defining):
    """F = 0 and g = 0; the last free parameter of ``base`` is the one that is held in the extrema.

    Parameters
    ----------
    base : System
    objective : str
        The column G.
    """

    def __init__(self, base: System, objective: str) -> None:
        self.objective, self.own_equations = objective, base.size - base.equations - 1
        super().__init__(base)

    def on(self, base: System) -> ExtremumCurve:
        """Return the defining system of another underlying one."""
        return ExtremumCurve(base, self.objective)

    def computed(self, x: Array) -> Stationarity:
        """Return the derivatives of G."""
        held = [self.base.size - 1]
        if self.borders is None:
            self.borders = Stationarity(self.base, x, self.objective, held).orthonormal() * self.base.weights
        return Stationarity(self.base, x, self.objective, held, self.borders)

    def known(self, x: Array) -> Known:
        """Return the matrix M."""
        found: Stationarity = self.at(x)
        return Known(found.residual, found.factors, found.solutions)

    def borders_fit(self, x: Array) -> bool:
        """Return whether the tangents have not turned away from the rows Phi."""
        found: Stationarity = self.at(x)
        return found.fits

    def own_values(self, x: Array) -> Array:
        """Return g."""
        found: Stationarity = self.at(x)
        return found.g

    def own_gradients(self, x: Array) -> Array:
        """Return dg/dx."""
        found: Stationarity = self.at(x)
        return found.gradients()

    def events(self) -> list[Event]:
        """Return those of extrema in one parameter more: the derivative by the held parameter vanishes, too.

        That along the curve vanishes where the curve turns, as well.
        """

        def slope(trial: Trial) -> float:
            return float(cast(ExtremumCurve, trial.system).at(trial.x).by_held[0])

        name = self.objective
        return [
            Event(Label.EXTREMUM, name, slope, describe=lambda trial: curvatures(trial, name), column=name), *super().events()
        ]  # fmt: skip
