"""Fixed points and cycles of maps as the continuation sees them: their equations, and what they know of their branches."""

from __future__ import annotations

from collections.abc import Sequence

from contin.arrays import Array
from contin.cycles.branches import OfCycles
from contin.cycles.map_equations import MapEquations
from contin.cycles.normal_forms import MOST, MapForm
from contin.cycles.phase import map_in_phase
from contin.equilibria.system import Algebraic
from contin.events.arc import SpecialPoint
from contin.events.coefficient import Coefficient
from contin.events.normal_forms import at_special_point
from contin.functions.batch import Batch


class MapSystem(OfCycles, MapEquations, Algebraic):
    """A `MapProblem` with chosen free parameters."""

    @property
    def small_equations(self) -> Batch | None:
        """The map, of fixed points."""
        known: Batch = self.problem.batch("map")
        return known if type(self) is MapSystem and self.rounds == 1 else None

    def form(self, x: Array) -> MapForm:
        """Return that of a cycle of the map."""
        return MapForm(self, x)

    def coefficient(self, point: SpecialPoint) -> Coefficient | None:
        """Return those of folds, period doublings and torus bifurcations; None of very long cycles."""
        return None if self.state_size > MOST else at_special_point(self, point)

    def in_phase(self, x: Array, vectors: Sequence[Array], reference: Array) -> tuple[Array, list[Array]]:
        """Return a cycle, which may begin with any of its points, and vectors at it, to lie closest to another one."""
        return map_in_phase(self, x, vectors, reference)
