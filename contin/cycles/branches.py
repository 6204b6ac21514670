"""Branches of cycles, and of cycles of maps: test functions, phase and amplitude, and ends."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from contin.arrays import Array
from contin.collocation.round import Monodromy, monodromy_of
from contin.core.labels import Label
from contin.core.protocol import Discretization
from contin.core.step import COLLAPSED, Reason, Stop
from contin.core.trial import Event, Trial
from contin.cycles.curves import DoublingCurve, TorusCurve, events_on_folds
from contin.cycles.ends import AMPLITUDE, explained, homoclinic, hopf_point_inside, shrunk
from contin.cycles.equations import CycleEquations, ForcedEquations, PeriodicEquations
from contin.cycles.floquet import critical_angle, doubled, doubles, doubling, has_double_one, keep_off_one, torus, unstable
from contin.cycles.map_equations import MapEquations
from contin.cycles.normal_forms import MOST, CycleForm, MapForm
from contin.equilibria.branches import Algebraic
from contin.events.arc import Arc, SpecialPoint
from contin.events.normal_forms import Coefficient, at_special_point
from contin.functions.batch import Batch
from contin.levels import LOCATED, ROUGH
from contin.problems.angles import whole_rounds
from contin.problems.statement import PERIOD


class OfCycles(Discretization):
    """Hooks that both kinds of system answer alike: multipliers say all of it."""

    @property
    def starts_cycles(self) -> bool:
        """Yes: of twice the length."""
        return True

    @property
    def is_cycle(self) -> bool:
        """Yes."""
        return True

    def unstable(self, x: Array) -> int:
        """Return the number of unstable multipliers, without one that is always 1."""
        system: Any = self
        return unstable(system, x)

    @property
    def curves(self) -> Mapping[str, type]:
        """Those of period doublings and torus bifurcations."""
        return {kind.kind: kind for kind in (DoublingCurve, TorusCurve)}

    def defining(self, point: Any, x: Array) -> tuple[Any, Array] | None:
        """Return those of period doublings (or a symmetry that breaks) and torus bifurcations."""
        system: Any = self
        if doubles(point):
            return DoublingCurve(system), x
        if point.label == Label.TORUS:
            return TorusCurve(system), np.append(x, math.cos(critical_angle(system, point, x)))
        return None

    def events(self) -> list[Event]:
        """Return those of period doublings (or a symmetry that breaks) and torus bifurcations."""
        return [doubling(self.order), torus()]

    def events_on_folds(self) -> list[Event]:
        """Return those of a further multiplier 1, or another one -1, and of the end where cycles shrink."""
        system: Any = self
        return events_on_folds(system)

    def judged(self, point: SpecialPoint) -> SpecialPoint:
        """Return a special point, as the end where cycles go twice round ones of half the length."""
        system: Any = self
        return doubled(system, point)


#: Places at which two cycles are compared: a power of two for the Fourier transform, more than any cycle needs.
_PLACES = 2048
#: Newton's steps from the best of these places to the best shift; the distance between places is small, three would do.
_STEPS = 5


def lasting(system: CycleEquations, x: Array) -> Array:
    """Return what a shift in time leaves as it is, as `CycleEquations.lasting` does."""
    size, n = system.state_size, len(system.problem.state_names)
    states = x[:size].reshape(-1, n)[:, system.circles == 0]
    weights = system.weights[:size:n]
    means = weights @ states
    square = weights @ np.einsum("ka,ka->k", states, states) - means @ means
    return np.concatenate([x[size:], means, [np.sqrt(max(square, 0.0))]])


def cycle_in_phase(system: CycleEquations, x: Array, vectors: Sequence[Array], reference: Array) -> tuple[Array, list[Array]]:
    """Return a cycle, and vectors at it, shifted in time to lie closest to another one."""
    shift, size = _shift(system, x, reference), system.state_size
    times = (system.nodes + shift) % system.order

    def moved(vector: Array) -> Array:
        return np.concatenate([system.perturbation(vector, times).ravel(), vector[size:]])

    return system.lifted(system.moved(x, shift), reference), [moved(vector) for vector in vectors]


def forced_cycle_in_phase(
    system: ForcedEquations, x: Array, vectors: Sequence[Array], reference: Array
) -> tuple[Array, list[Array]]:
    """Return a forced cycle, and vectors at it, so that it lies closest to another one.

    One of several rounds may begin with any of them; one of a field that is odd after half a period has an image.
    """
    size, rounds = system.state_size, system.rounds
    places = [(number / rounds, 1.0) for number in range(rounds)]
    if _is_odd(system, x):
        places += [((number + 0.5) / rounds, -1.0) for number in range(rounds)]

    def moved(vector: Array, place: tuple[float, float]) -> Array:
        shift, sign = place
        if shift == 0:
            return vector.copy()
        return np.concatenate([sign * system.perturbation(vector, (system.nodes + shift) % 1).ravel(), vector[size:]])

    def orbit(place: tuple[float, float]) -> Array:
        shift, sign = place
        later = system.moved(x, shift)
        later[:size] *= sign
        return system.lifted(later, reference)

    def apart(place: tuple[float, float]) -> float:
        return float(system.weights @ (orbit(place) - reference) ** 2)

    nearest = min(places, key=apart)
    return orbit(nearest), [moved(vector, nearest) for vector in vectors]


def map_in_phase(system: MapEquations, x: Array, vectors: Sequence[Array], reference: Array) -> tuple[Array, list[Array]]:
    """Return a cycle of a map, which may begin with any of its points, and vectors at it, to lie closest to another one."""

    def apart(shift: int) -> float:
        return float(system.weights @ (system.lifted(system.moved(x, shift), reference) - reference) ** 2)

    nearest = min(range(system.rounds), key=apart)
    turned = [vector.copy() for vector in vectors]
    for vector in turned:
        system.states(vector)[:] = np.roll(system.states(vector), -nearest, axis=0)
    return system.lifted(system.moved(x, nearest), reference), turned


def _is_odd(system: ForcedEquations, x: Array) -> bool:
    """Return whether -u(t + T / 2) is a solution where u is one, T the period of the forcing; it never goes round as u."""
    if system.rotates:
        return False
    image = system.moved(x, 0.5 / system.rounds)
    image[: system.state_size] *= -1
    size = np.abs(system.residual(np.where(np.arange(x.size) < system.state_size, -x, x))).max()
    return bool(np.abs(system.residual(image)).max() <= ROUGH * size)


def _shift(system: CycleEquations, x: Array, reference: Array) -> float:
    """Return the s at which the integral of |u(t + s) - v(t)|^2 is least, v the reference; angles up to whole rounds.

    With u = a t + w, where angles gain a in the whole cycle, and w periodic, it is the integral of w(t + s) . w_v(t), both
    without their means, less half the square of a s + the mean of u - v, up to whole rounds, that is largest.
    """
    part = np.arange(_PLACES) / _PLACES
    gained = system.gains[-1] / system.scales.states
    orbits = [system.evaluate_scaled(z, system.order * part) - part[:, None] * gained for z in (x, reference)]
    means = orbits[0].mean(axis=0) - orbits[1].mean(axis=0)
    ours, theirs = (np.fft.fft(orbit, axis=0) for orbit in orbits)
    products = np.sum(ours * theirs.conj(), axis=1)
    frequencies = 2 * np.pi * np.fft.fftfreq(_PLACES, 1 / _PLACES)

    def drift(s: Any) -> Array:
        """Return a s + the mean of u - v, of angles that rotate, up to whole rounds."""
        apart = np.where(gained != 0, np.multiply.outer(s, gained) + means, 0.0)
        return apart - whole_rounds(apart, system.circles)

    s = float((np.fft.ifft(products).real / _PLACES - (drift(part) ** 2).sum(axis=1) / 2).argmax()) / _PLACES
    for _ in range(_STEPS):
        waves = products * np.exp(1j * frequencies * s) / _PLACES**2
        slope = float((1j * frequencies * waves).sum().real - gained @ drift(s))
        bend = float((-(frequencies**2) * waves).sum().real - gained @ gained)
        if not bend < 0:
            break
        s -= slope / bend
    return system.order * s


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
