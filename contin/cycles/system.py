"""Cycles of vector fields as the continuation sees them: their equations, and what they know of their branches."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from contin.arrays import Array
from contin.collocation.monodromy import Monodromy, monodromy_of
from contin.core.state import Reason, Stop
from contin.core.step import COLLAPSED
from contin.core.trial import Event, Trial
from contin.cycles.branches import OfCycles
from contin.cycles.equations import CycleEquations, ForcedEquations, PeriodicEquations
from contin.cycles.floquet import has_double_one, keep_off_one
from contin.cycles.homoclinic import explained, homoclinic
from contin.cycles.hopf_end import AMPLITUDE, hopf_point_inside, shrunk
from contin.cycles.normal_forms import CycleForm
from contin.cycles.phase import cycle_in_phase, forced_cycle_in_phase, lasting
from contin.events.arc import Arc, SpecialPoint
from contin.events.coefficient import Coefficient
from contin.events.normal_forms import at_special_point
from contin.levels import LOCATED
from contin.problems.own_names import PERIOD


class PeriodicCollocation(OfCycles, PeriodicEquations):
    """A `CycleProblem` on a mesh: what forced and autonomous ones know of their branches."""

    @property
    def monodromy(self) -> Monodromy:
        """Where a kernel computes the multipliers."""
        return monodromy_of(self)

    def cannot_branch(self, arc: Arc) -> bool:
        """Return whether no multiplier but the one that is 1 comes near 1: that is where cycles branch."""
        return keep_off_one(arc)

    def form(self, x: Array) -> CycleForm:
        """Return that of a cycle."""
        return CycleForm(self, x)

    def coefficient(self, point: SpecialPoint) -> Coefficient | None:
        """Return those of folds, period doublings and torus bifurcations.

        These have none where a multiplier is 1, too: the cycle is not isolated, as in conservative systems.
        """
        if point.is_simple and has_double_one(self, point.trial.x):
            return None
        return at_special_point(self, point)


class ForcedCollocation(PeriodicCollocation, ForcedEquations):
    """A `CycleProblem` with a forcing, on a mesh."""

    def in_phase(self, x: Array, vectors: Sequence[Array], reference: Array) -> tuple[Array, list[Array]]:
        """Return a cycle of several rounds, or one with an image, and vectors at it, to lie closest to another one."""
        return forced_cycle_in_phase(self, x, vectors, reference)


class CycleCollocation(PeriodicCollocation, CycleEquations):
    """An autonomous `CycleProblem` on a mesh."""

    def events(self) -> list[Event]:
        """Return also that of homoclinic orbits; in the plane that alone: beside 1 there is one positive multiplier."""
        is_planar = self.states_count == 2 and self.order == 1
        return [homoclinic()] if is_planar else [*super().events(), homoclinic()]

    @property
    def size_of_solutions(self) -> Event:
        """The amplitude: cycles can shrink onto an equilibrium."""
        return AMPLITUDE

    def referring_to(self, x: Array, tangent: Array) -> CycleCollocation:
        """Return the same with a cycle as the reference; in place of one of no size, the one beside it along the tangent."""
        if np.ptp(self.states(x), axis=0).any():
            return self.with_reference(x)
        return self.with_reference(x + tangent / np.abs(tangent).max()) if np.isfinite(tangent).all() else self

    def home(self, arc: Arc) -> SpecialPoint | None:
        """Return the Hopf point inside a step."""
        return hopf_point_inside(self, arc)

    def collapsed(self, x: Array, z: Array) -> bool:
        """Return whether z is an equilibrium, which solves the equations with any period, and curves of them with some."""
        return abs(self.amplitude(z)) < COLLAPSED * abs(self.amplitude(x))

    def may_branch(self, x: Array) -> bool:
        """Return False where cycles shrink onto an equilibrium: there the branch ends, and the search takes long."""
        return not self.has_shrunk(x)

    def judged(self, point: SpecialPoint) -> SpecialPoint:
        """Return a special point, as the end where cycles shrink, or go twice round ones of half the period."""
        found = shrunk(self, point)
        return super().judged(point) if found is point else found

    def standstill(self, trial: Trial, primary: str) -> Stop:
        """Return the end of a family at one value of the parameter: cycles of a Hamiltonian or linear system fill an area."""
        value = LOCATED * round(trial[primary] / LOCATED) + 0.0
        message = f"{primary} stays at {value:.10g}, up to errors of the mesh: a vertical family, as of a conservative system"
        if primary == PERIOD:
            return Stop(Reason.STANDSTILL, message, "all its cycles have this period; follow another parameter")
        unfolds = f"where {primary} must be a parameter that breaks the conservation (unfolds it)"
        return Stop(Reason.STANDSTILL, message, f'follow it with primary="{PERIOD}", {unfolds}')

    def explained(self, stop: Stop, trial: Trial) -> Stop:
        """Return the end where the period runs away with the equilibrium, and with the limit of the parameter."""
        return explained(self, stop, trial.x)

    def lasting(self, x: Array) -> Array:
        """Return free parameters, means of the states that are no angles, and the norm of the cycle without its mean."""
        return lasting(self, x)

    def in_phase(self, x: Array, vectors: Sequence[Array], reference: Array) -> tuple[Array, list[Array]]:
        """Return a cycle, and vectors at it, shifted in time to lie closest to another one."""
        return cycle_in_phase(self, x, vectors, reference)
