"""Collocation of periodic orbits: Floquet multipliers, and without forcing a phase condition with a moving reference."""

from __future__ import annotations

import functools
import itertools
import math
import threading
from collections.abc import Mapping, Sequence
from typing import Any, Self

import numpy as np

from contin.arrays import Array, ComplexArray, Indices, Mask
from contin.boundary.system import Collocation
from contin.collocation.assembly import Bordering, assemble
from contin.collocation.corners import breaks_of
from contin.collocation.mesh import moved_to_breaks
from contin.collocation.round import DRIFTED, FULL, Monodromy, ends_of_parts, extremes, fill_multipliers, larger, monodromy_of
from contin.core.labels import Label
from contin.core.protocol import Carrier, Discretization
from contin.core.spectral import on_circle
from contin.core.step import COLLAPSED, Reason, State, Stop
from contin.core.trial import Event, Trial
from contin.cycles.curves import DoublingCurve, TorusCurve, events_on_folds
from contin.cycles.ends import AMPLITUDE, explained, homoclinic, hopf_point_ahead, hopf_point_inside, shrunk
from contin.cycles.floquet import critical_angle, doubled, doubles, doubling, has_double_one, keep_off_one, torus, unstable
from contin.cycles.normal_forms import CycleForm
from contin.draws import ASIDE
from contin.errors import ConvergenceError, ProblemError
from contin.events.arc import Arc, SpecialPoint
from contin.events.error import Solution
from contin.events.normal_forms import Coefficient, at_special_point
from contin.levels import APART, DOUBLED, LOCATED, ROUGH
from contin.linalg.blocks import Blocks, Factors, share
from contin.linalg.condensation import Factorization
from contin.linalg.periodic import log_eigenvalues
from contin.problems.angles import check_windings, gain, periods_of, whole_rounds
from contin.problems.statement import PERIOD, rounds_of

#: A pair at an angle whose square is below so many times the error of the multiplier 1 may be a double one.
_SPLIT = 100.0
#: Share of the period's relative change in the length of a step: weight of (change of T)^2 / (1 + T)^2. With 1 in place of it
#: and of 1 + T, steps beside a Hopf point whose cycles change T by c a^2, c large, are as long as 1 / c, and some cycles lost
#: their end. 1 takes a tenth more orbits, 0.01 as many; 0 would leave nothing to hold where cycles change their period only.
_PERIOD_SHARE = 0.1
#: Places at which two cycles are compared: a power of two for the Fourier transform, more than any cycle needs.
_PLACES = 2048
#: Newton's steps from the best of these places to the best shift; the distance between places is small, three would do.
_STEPS = 5


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

    def is_drifted(self, x: Array) -> bool:
        """Return whether round-off has moved a multiplier that is known, so that those on this mesh are in doubt."""
        return False

    def crossing(self, x: Array, frequency: float) -> tuple[str, str] | None:
        """Return label and name of a point where multipliers exp(+- i frequency) cross the unit circle; None near -1."""
        return None if abs(frequency - math.pi) < APART else ("TR", "torus")

    def unstable(self: Any, x: Array) -> int:
        """Return the number of unstable multipliers, without one that is always 1."""
        return unstable(self, x)

    @property
    def curves(self) -> Mapping[str, type]:
        """Those of period doublings and torus bifurcations."""
        return {kind.kind: kind for kind in (DoublingCurve, TorusCurve)}

    def defining(self: Any, point: Solution, x: Array) -> tuple[Any, Array] | None:
        """Return those of period doublings (or a symmetry that breaks) and torus bifurcations."""
        if doubles(point):
            return DoublingCurve(self), x
        if point.label == Label.TORUS:
            return TorusCurve(self), np.append(x, math.cos(critical_angle(self, point, x)))
        return None

    def events(self) -> list[Event]:
        """Return those of period doublings (or a symmetry that breaks) and torus bifurcations."""
        return [doubling(self.order), torus()]

    def events_on_folds(self: Any) -> list[Event]:
        """Return those of a further multiplier 1, or another one -1, and of the end where cycles shrink."""
        return events_on_folds(self)

    def judged(self: Any, point: SpecialPoint) -> SpecialPoint:
        """Return a special point, as the end where cycles go twice round ones of half the length."""
        return doubled(self, point)


class PeriodicCollocation(OfCycles, Collocation):
    """A `CycleProblem` on a mesh: what forced and autonomous ones share.

    - ``autonomous`` (bool): There is no forcing: the period is unknown, and an orbit may be shifted in time.
    """

    problem: Any
    autonomous = True
    #: Twice those of other problems: with these, branches of Lorenz's cycles and of AUTO's pp2 take 15 orbits for 19, and 10
    #: for 15, and all special points of the tests' cycles are found.
    aims = 0.7, 0.05

    def _complete(self) -> None:
        problem, values = self.problem, self._values
        self.order = problem.order
        #: The matrix S of the symmetry u(1) = S u(0), of states divided by their sizes; the identity where there is none.
        self.turn: Array = problem.symmetry * self.scales.states / self.scales.states[:, None]
        check_windings(problem.angles, self.free, values)
        once = gain(problem.angles, problem.state_names, values)  # u(1) = S u(0) + once
        gained = itertools.accumulate([once] * self.order, lambda before, more: problem.symmetry @ before + more)
        #: What angles have gained after 0, 1, ... of the parts that a symmetry divides the cycle into, shape (order + 1, n).
        self.gains: Array = np.array([np.zeros(once.size), *gained])

    def events(self) -> list[Event]:
        """Return also those of conditions along the cycle."""
        return [*super().events(), *self._of_conditions()]

    def duration(self, x: Array) -> float:
        """Return the period."""
        return float(self.problem.duration(dict(zip(self.problem.parameters, map(float, self.all_parameters(x))))))

    def unit_time(self, x: Array) -> float:
        """Return the time that the unit interval stands for: the period divided by the order of the symmetry."""
        return self.duration(x) / self.order

    def is_doubled(self, x: Array) -> bool:
        """Return whether a cycle goes twice round one of half its period, up to the square root of round-off.

        With a symmetry S of odd order the part computed is then twice one with the symmetry S^((n + 1) / 2), whose square is
        S; with one of even order, it never is.
        """
        if self.order % 2 == 0:
            return False
        states = self.states(x)
        half = np.linalg.matrix_power(self.problem.symmetry, (self.order + 1) // 2) if self.order > 1 else None
        later = self.evaluate(x, (self.nodes + 0.5) % self.order)
        states = states if half is None else states @ half.T
        apart = states - later
        apart = apart - whole_rounds(apart, periods_of(self.problem))
        return bool(np.all(np.abs(apart).max(axis=0) <= DOUBLED * (1 + np.abs(states).max(axis=0))))

    def _interpolated(self, x: Array, times: Array) -> Array:
        """Return the piecewise polynomial of the values in x, beyond the unit interval by the symmetry, without gains."""
        turns = _turns(times)
        values = super()._interpolated(x, times - turns)
        if self.order == 1 or not turns.any():
            return values
        powers = np.array([np.linalg.matrix_power(self.turn, k) for k in range(self.order)])
        return np.einsum("mab,mb->ma", powers[turns % self.order], values)

    def evaluate(self, x: Array, times: Array) -> Array:
        """Return the states at ``times`` (m,), any number of rounds on, shape (m, n)."""
        states, turns = super().evaluate(x, times), _turns(times)
        if not self.rotates or not turns.any():
            return states
        rounds, parts = np.divmod(turns, self.order)
        return states + rounds[:, None] * self.gains[-1] + self.gains[parts]

    def perturbation(self, v: Array, times: Array) -> Array:
        """Return the states of a perturbation, divided by their sizes, at ``times`` (m,), shape (m, n): angles gain nothing."""
        return self._interpolated(v, times)

    def evaluate_scaled(self, x: Array, times: Array) -> Array:
        """Return the states divided by their sizes at ``times`` (m,), any number of rounds on, shape (m, n)."""
        return self.evaluate(x, times) / self.scales.states

    def moved(self, x: Array, shift: float) -> Array:
        """Return a cycle that begins later by ``shift``, in units of the part that is computed."""
        if shift == 0:
            return x.copy()
        return np.concatenate([self.evaluate_scaled(x, self.nodes + shift).ravel(), x[self.state_size :]])

    @property
    def rotates(self) -> bool:
        """An angle goes round."""
        return bool(self.gains.any())

    def lifted(self, x: Array, reference: Array) -> Array:
        """Return x with angles moved by whole rounds, so that they are nearest to those of a reference in the mean."""
        if not self.circles.any():
            return x
        apart = self._scaled_states(reference) - self._scaled_states(x)
        moved = x.copy()
        self._scaled_states(moved)[:] += whole_rounds(self.weights[: self.state_size : self._n] @ apart, self.circles)
        return moved

    # --- columns -------------------------------------------------------------------------------------------------

    @property
    def integrated(self) -> tuple[str, ...]:
        """Names of the functionals that are means over a period."""
        return tuple(self.problem.means)

    def functionals(self, x: Array) -> Array:
        """Return the largest and smallest values of each state, and of those that follow, and the means of functionals.

        An angle that rotates takes all values: the largest is half a period, the smallest minus that.
        """
        found = extremes(self.degree, *self._whole(x), self._n)
        round_ = self.gains[-1] != 0
        found[round_] = self.circles[round_, None] * [0.5, -0.5]
        found *= self.scales.states[:, None]
        own = [] if PERIOD in self.problem.parameters else [self.duration(x)]
        if count := len(self.problem.following):  # those of the polynomials through their values at the nodes
            values = np.ascontiguousarray(self.following(x, self.nodes)).ravel()
            own = [*extremes(self.degree, self.mesh, values, count).ravel(), *own]
        return np.concatenate([found.ravel(), own, super().functionals(x)])

    def following(self, x: Array, times: Array) -> Array:
        """Return the states that follow from others at ``times`` (m,), shape (m, their number)."""
        at = [self.integrated.index(name) for name in self.problem.following]
        return self.integrands(x, times % 1.0, self.evaluate_scaled(x, times))[:, at]

    def _whole(self, x: Array) -> tuple[Array, Array]:
        """Return the mesh and the values at the nodes over the whole orbit, on the unit interval."""
        if self.order == 1:
            return self.mesh, x
        states = x[: len(self.nodes) * self._n].reshape(-1, self._n)
        gains = self.gains / self.scales.states
        parts = [states @ np.linalg.matrix_power(self.turn, k).T + gains[k] for k in range(self.order)]
        values = np.concatenate([*(part[:-1] for part in parts), parts[-1][-1:]])
        return np.append((np.arange(self.order)[:, None] + self.mesh[:-1]).ravel() / self.order, 1.0), values.ravel()

    # --- stability -----------------------------------------------------------------------------------------------

    def rates_by_states(self, x: Array, points: Array) -> Array:
        """Return the derivatives of T F by the states at states (K, n) divided by their sizes, shape (K, n, n).

        Of an autonomous field the states may be any, of a forced one they are those at the Gauss points.
        """
        n, times = self._n, np.zeros(len(points)) if self.autonomous else self.gauss_times
        given = times, points, np.empty((0, n)), self.scaled_parameters(x)
        return self._field.jacobian(*given, self._field.columns([]))[1][:, :n]

    def rates_along(self, x: Array, directions: Sequence[Array]) -> Array:
        """Return the derivative of T F at the Gauss points along directions of the states there, all scaled, (N d, n) each."""
        wide = [self._wide(np.zeros(self.state_size), states) for states in directions]
        return self._field.along(*self._inside(x), wide)[:, : self._n]

    def _jacobian_of_field(self, x: Array) -> Array:
        """Return the derivatives of T F by the states at the Gauss points, scaled, shape (N d, n, n)."""
        return self.rates_by_states(x, self.at_gauss_points(x))

    def with_conditions(self, x: Array, rows: Array) -> Factors:
        """Return the factored linearized collocation equations with n conditions on the states at both ends: rows (n, 2 n)."""
        n, width = self._n, self._n * (self.degree + 1)
        jacobian = np.ascontiguousarray(self._jacobian_of_field(x)[:, :, self._layout.order])
        local, border = np.empty((self.intervals, width - n, width)), np.empty((self.intervals, 0, width))
        around = Bordering(np.empty((0, self.state_size)), np.empty((0, self.state_size)))
        blocks = Blocks(local, border, np.empty((0, 0)), *np.empty((2, n, n)))
        given = self._layout, self.tables, self._h, jacobian, np.ascontiguousarray(rows)[None], around, blocks
        assemble(*given, share(self.intervals, 0))
        for each in self.crossings(x):
            local[each.node][:, self._left] = local[each.node][:, self._left] @ each.by_states
        return Factorization(self._layout, blocks)

    def eigenvalues(self, x: Array) -> ComplexArray:
        """Return the logarithms of the Floquet multipliers, shape (n,): those with a positive real part are unstable.

        That of a pair on the unit circle, to round-off, has the real part zero. With a symmetry of order n they are those of
        the map over one n-th of the period, S^-1 times its monodromy matrix; see `whole_round`.
        """
        return self._compared(x)[0]

    def eigenvalues_at(self, places: Sequence[Array]) -> list[ComplexArray]:
        """Return the logarithms of the multipliers at several places, but for the one that is 1: it moves by errors only."""
        found = [self.eigenvalues(x) for x in places]
        return [np.delete(values, np.abs(values).argmin()) for values in found] if self.autonomous else found

    def neutral(self, x: Array) -> Mask:
        """Return which multipliers lie on the unit circle up to round-off, shape (n,), but for the one that always is 1."""
        return self._compared(x)[1]

    def computed_eigenvalues(self, x: Array) -> ComplexArray:
        """Return the logarithms of the multipliers with their round-off, where a zero of a real part is located."""
        return self._once("computed", x, lambda: self._computed(x))

    def _compared(self, x: Array) -> tuple[ComplexArray, Mask]:
        """Return the logarithms of the multipliers, and which lie on the unit circle."""

        def made() -> tuple[ComplexArray, Mask]:  # takes several of them: a zero is located without
            values = self.computed_eigenvalues(x)
            neutral = on_circle(self._computed, x, values, expected=int(self.autonomous))
            return np.where(neutral & is_pair(values), 1j * values.imag, values), neutral

        return self._once("compared", x, made)

    @functools.cached_property
    def _monodromies(self) -> dict[int, Monodromy]:
        """Where multipliers are computed, by thread."""
        return {}

    def _filled(self, x: Array) -> tuple[Monodromy, int]:
        """Return where a kernel has computed the logarithms of the multipliers, and what came of it."""
        thread = threading.get_ident()
        if thread not in self._monodromies:
            self._monodromies[thread] = monodromy_of(self)
        room = self._monodromies[thread]
        room.jacobian[:] = self._jacobian_of_field(x)
        outcome = fill_multipliers(room, 0)
        if outcome != FULL:
            return room, outcome
        self._monodromies[thread] = larger(self, room)
        return self._filled(x)

    def _computed(self, x: Array) -> ComplexArray:
        """Return the logarithms of the multipliers as they are computed."""
        return self._across_jumps(x, self._filled(x)[0])

    def _across_jumps(self, x: Array, room: Monodromy) -> ComplexArray:
        """Return the logarithms of the multipliers of what a kernel has filled in, where the field may jump."""
        if not self.outcomes.size:
            return room.real + 1j * room.imaginary
        matrices = room.matrices[: room.starts[-1] + len(room.turn)].copy()
        for each in self.crossings(x):
            matrices[room.starts[each.node]] = matrices[room.starts[each.node]] @ each.by_states
        return log_eigenvalues(matrices)

    def whole_round(self, values: ComplexArray) -> ComplexArray:
        """Return the logarithms of the multipliers over the whole period, n times those over one n-th of it."""
        if self.order == 1:
            return values
        angles = self.order * values.imag
        return self.order * values.real + 1j * (math.pi - (math.pi - angles) % (2 * math.pi))

    # --- what is known of its branches --------------------------------------------------------------------------

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

    def round_end(self, x: Array, error: Any) -> tuple[Self, Carrier] | None:
        """Return the same with a crossing that leaves at an end of the period and comes in at the other, and the carrier."""
        if not error.at_end or self.order > 1 or self._pieces is None:
            return None
        (at, sides), (first, last) = self._pieces, self.mesh[[0, -1]]
        edge = 0 if at[0] - first < last - at[-1] else -1
        if abs(at[edge] - self.mesh[edge]) > ROUGH * (last - first) or (sides[0] != sides[-1]).any():
            return None
        places, ring = np.sort([*np.delete(at, edge), first + last - at[edge]]), np.roll(sides[1:], -1 - 2 * edge, axis=0)
        system = self.with_pieces((places, np.concatenate([ring[-1:], ring])))
        return system.on_mesh(moved_to_breaks(self.mesh, np.union1d(places, self.breaks)))


class ForcedCollocation(PeriodicCollocation):
    """A `CycleProblem` with a forcing, on a mesh. There is no phase condition, and no multiplier is 1 by itself.

    Raises ProblemError where ``rounds`` is no whole number, or free; the period is no positive number.
    """

    autonomous = False

    def _complete(self) -> None:
        super()._complete()
        self.rounds = rounds_of(self.free, self._values)
        self.problem.duration(self._values)

    def is_doubled(self, x: Array) -> bool:
        """Return whether a cycle goes twice round one of half its period, and that is a number of periods of the forcing."""
        return self.rounds % 2 == 0 and super().is_doubled(x)

    @functools.cached_property
    def breaks(self) -> Array:
        """Places on the unit interval where the forcing has jumps or corners that no free parameter moves: t = s T(p)."""
        moved = self.parameters.copy()
        moved[self._free] *= 1 + ASIDE
        here, there = (breaks_of(self.problem.batch("field"), self.problem.domain, p) for p in (self.parameters, moved))
        still = np.abs(here[:, None] - there) <= LOCATED if there.size else np.zeros((here.size, 1), dtype=bool)
        return here[still.any(axis=1)]

    # --- what is known of its branches --------------------------------------------------------------------------

    def in_phase(self, x: Array, vectors: Sequence[Array], reference: Array) -> tuple[Array, list[Array]]:
        """Return a forced cycle, and vectors at it, so that it lies closest to another one.

        One of several rounds may begin with any of them; one of a field that is odd after half a period has an image.
        """
        size, rounds = self.state_size, self.rounds
        places = [(number / rounds, 1.0) for number in range(rounds)]
        if self._is_odd(x):
            places += [((number + 0.5) / rounds, -1.0) for number in range(rounds)]

        def moved(vector: Array, place: tuple[float, float]) -> Array:
            shift, sign = place
            if shift == 0:
                return vector.copy()
            return np.concatenate([sign * self.perturbation(vector, (self.nodes + shift) % 1).ravel(), vector[size:]])

        def orbit(place: tuple[float, float]) -> Array:
            shift, sign = place
            later = self.moved(x, shift)
            later[:size] *= sign
            return self.lifted(later, reference)

        def apart(place: tuple[float, float]) -> float:
            return float(self.weights @ (orbit(place) - reference) ** 2)

        nearest = min(places, key=apart)
        return orbit(nearest), [moved(vector, nearest) for vector in vectors]

    def _is_odd(self, x: Array) -> bool:
        """Return whether -u(t + T / 2) is a solution where u is one, T the period of the forcing; it never goes round as u."""
        if self.rotates:
            return False
        image = self.moved(x, 0.5 / self.rounds)
        image[: self.state_size] *= -1
        size = np.abs(self.residual(np.where(np.arange(x.size) < self.state_size, -x, x))).max()
        return bool(np.abs(self.residual(image)).max() <= ROUGH * size)


class CycleCollocation(PeriodicCollocation):
    """An autonomous `CycleProblem` on a mesh.

    The phase condition, the integral of u . v' over that of v' . v', is linear: one row beside the collocation equations,

        [ collocation   ]        the integral is taken at the Gauss points, with v' of the piecewise polynomial v, the reference
        [ u(0) - u(1)   ]
        [ phase row . x ]

    An angle that rotates gains whole rounds, which u(0) - u(1) contains; the phase row is then applied to u - v.

    - ``reference`` (ndarray, shape (size,)): The cycle v; zero where `with_reference` has not set it.
    """

    def _complete(self) -> None:
        super()._complete()
        self._refer(np.zeros(self.size))

    def _take_mesh(self, mesh: Array) -> None:
        super()._take_mesh(mesh)
        self.equations = self._conditions + 1
        if PERIOD in self.free:
            at = self.free.index(PERIOD)
            known = self.parameters[self._free[at]] / self.free_scales[at]
            self.weights[self.state_size + at] = _PERIOD_SHARE / (1 + known) ** 2
        self._drifted: set[bytes] = set()

    def _refer(self, x: Array) -> None:
        """Take the phase row from an orbit."""
        self.reference = x.copy()
        self._amplitude: Array | None = None
        scaled = self._scaled_states(x)
        self._phase = self.phase_row(scaled)
        self._target = float(self._phase[: self.state_size] @ scaled.ravel()) if self.rotates else 0.0

    # --- the discrete equations ----------------------------------------------------------------------------------

    @property
    def linear_conditions(self) -> tuple[Array, Array]:
        """The row of the phase condition, and its value."""
        return self._phase[None], np.array([self._target])

    def conditions_with_rows(self, x: Array) -> tuple[Array, Array]:
        """Return the phase condition and its row."""
        return np.array([self._phase @ x - self._target]), self._phase[None]

    # --- stability -----------------------------------------------------------------------------------------------

    @property
    def start_direction(self) -> Array:
        """The direction in which the reference leaves t = 0, scaled, shape (n,)."""
        states = self._scaled_states(self.reference)
        first = states[1] - states[0]
        return np.asarray(first / np.linalg.norm(first), dtype=float)

    def _computed(self, x: Array) -> ComplexArray:
        """Return the logarithms of the multipliers; where the one that is 1 has drifted, the flow's direction is split off.

        After a repelling stretch, as of a canard, round-off in that direction hides all other multipliers.
        """
        room, outcome = self._filled(x)
        if outcome == DRIFTED and not self.outcomes.size:
            self._drifted.add(x.tobytes())
            count = room.starts[-1] + len(room.turn)
            ends = self._scaled_states(x)[:: self.degree].copy()  # of the intervals
            if room.starts[-1] > self.intervals:
                ends = self._interpolated(x, ends_of_parts(self.mesh, room))
            room.flow[:count, : self._n] = self.rates(x, ends)[:count]
            fill_multipliers(room, 1)
        return self._across_jumps(x, room)

    def is_drifted(self, x: Array) -> bool:
        """Return whether the multiplier that is 1 is off before the direction of the flow is split off."""
        self.eigenvalues(x)
        return x.tobytes() in self._drifted

    def crossing(self, x: Array, frequency: float) -> tuple[str, str] | None:
        """Return label and name of a torus bifurcation; None near a double multiplier -1.

        None, too, where the pair may be a double multiplier 1 (at a fold): an error e of the one that is 1 splits it by
        sqrt(e).
        """
        trivial = float(np.abs(np.expm1(self.eigenvalues(x))).min())
        return None if frequency**2 < _SPLIT * trivial else super().crossing(x, frequency)

    def rates(self, x: Array, points: Array) -> Array:
        """Return T F at any states (K, n) divided by their sizes, likewise scaled, shape (K, n)."""
        return self.field_values(np.zeros(len(points)), points, self.scaled_parameters(x))[:, : self._n]

    def has_shrunk(self, x: Array) -> bool:
        """Return whether an orbit is an equilibrium, up to the square root of round-off."""
        states = self._scaled_states(x)
        return bool(np.all(np.ptp(states, axis=0) <= DOUBLED * (1 + np.abs(states).max(axis=0))))

    def amplitude(self, x: Array) -> float:
        """Return the size of an orbit: the root mean square without its mean, as far as it lies along the reference.

        It is negative where the orbit is half a period later.
        """
        return float(self.amplitude_row @ x[: self.state_size])

    @property
    def reference_size(self) -> float:
        """The `amplitude` of the reference."""
        weights, varying = self._varying
        return float(np.sqrt(weights @ np.sum(varying**2, axis=1)))

    @property
    def _varying(self) -> tuple[Array, Array]:
        """The weights of the nodes, and the reference without its mean."""
        weights, states = self.weights[: self.state_size : self._n], self.states(self.reference)
        return weights, states - self._mean_turn @ (weights @ states)

    @functools.cached_property
    def _mean_turn(self) -> Array:
        """The mean of the powers of the symmetry."""
        return np.mean([np.linalg.matrix_power(self.problem.symmetry, k) for k in range(self.order)], axis=0)

    @property
    def amplitude_row(self) -> Array:
        """The row that takes the states in x to `amplitude`, shape (state_size,)."""
        if self._amplitude is None:
            weights, varying = self._varying
            size = np.sqrt(weights @ np.einsum("ka,ka->k", varying, varying))
            row = weights[:, None] * (varying - (weights @ varying) @ self._mean_turn) / size
            self._amplitude = (row * self.scales.states).ravel()
        return self._amplitude

    def crossed(self, x: Array, corners: bool = False) -> tuple[CycleCollocation, Array]:
        """Return the same with frozen outcomes where a cycle crosses jumps, and the cycle begun far from all of them."""
        if not self.outcomes.size and self.switching(x).jumps.any():
            places = np.append(0.0, self.switching(x).places)  # one at the ends is not seen
            gaps = np.diff(places, append=places[0] + 1)
            shift = float((places + gaps / 2)[gaps.argmax()])
            return super(CycleCollocation, self.with_reference(self.moved(x, shift))).crossed(self.moved(x, shift))
        return super().crossed(x, corners)

    # --- the reference -----------------------------------------------------------------------------------

    def with_reference(self, x: Array) -> Self:
        """Return the same with the orbit x as the reference; raise ProblemError where it is constant."""
        if not np.ptp(self.states(x), axis=0).any():
            raise ProblemError("guess: it is constant; a cycle needs a guess that goes round")
        return self._referring_to(x)

    # --- what is known of its branches --------------------------------------------------------------------------

    def events(self) -> list[Event]:
        """Return also that of homoclinic orbits; in the plane that alone: beside 1 there is one positive multiplier."""
        is_planar = self.states_count == 2 and self.order == 1 and not self.outcomes.size
        return [homoclinic(), *(self._of_conditions() if is_planar else super().events())]

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

    def home_ahead(self, state: State, step: float) -> SpecialPoint | None:
        """Return the Hopf point to which the tangent leads within a step, or a grazing point."""
        return hopf_point_ahead(self, state, step) or super().home_ahead(state, step)

    def collapsed(self, x: Array, z: Array) -> bool:
        """Return whether z is an equilibrium, which solves the equations with any period, and curves of them with some."""
        return abs(self.amplitude(z)) < COLLAPSED * abs(self.amplitude(x))

    def check_solution(self, x: Array) -> None:
        """Check that a cycle that was looked for is none of no size; raise ConvergenceError otherwise."""
        if self.has_shrunk(x):
            place = self.states(x)[0]
            where = ", ".join(f"{name} = {value + 0.0:.6g}" for name, value in zip(self.problem.state_names, place))
            raise ConvergenceError(f"the guess leads to the equilibrium {where}: give one closer to a cycle, or a larger one")

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
        return explained(self, super().explained(stop, trial), trial.x)

    def lasting(self, x: Array) -> Array:
        """Return free parameters, means of the states that are no angles, and the norm of the cycle without its mean."""
        size, n = self.state_size, len(self.problem.state_names)
        states = x[:size].reshape(-1, n)[:, self.circles == 0]
        weights = self.weights[:size:n]
        means = weights @ states
        square = weights @ np.einsum("ka,ka->k", states, states) - means @ means
        return np.concatenate([x[size:], means, [np.sqrt(max(square, 0.0))]])

    def in_phase(self, x: Array, vectors: Sequence[Array], reference: Array) -> tuple[Array, list[Array]]:
        """Return a cycle, and vectors at it, shifted in time to lie closest to another one."""
        shift, size = self._shift(x, reference), self.state_size
        times = (self.nodes + shift) % self.order

        def moved(vector: Array) -> Array:
            return np.concatenate([self.perturbation(vector, times).ravel(), vector[size:]])

        return self.lifted(self.moved(x, shift), reference), [moved(vector) for vector in vectors]

    def _shift(self, x: Array, reference: Array) -> float:
        """Return the s at which the integral of |u(t + s) - v(t)|^2 is least, v the reference; angles up to whole rounds.

        With u = a t + w, where angles gain a in the whole cycle, and w periodic, it is the integral of w(t + s) . w_v(t), both
        without their means, less half the square of a s + the mean of u - v, up to whole rounds, that is largest.
        """
        part = np.arange(_PLACES) / _PLACES
        gained = self.gains[-1] / self.scales.states
        orbits = [self.evaluate_scaled(z, self.order * part) - part[:, None] * gained for z in (x, reference)]
        means = orbits[0].mean(axis=0) - orbits[1].mean(axis=0)
        ours, theirs = (np.fft.fft(orbit, axis=0) for orbit in orbits)
        products = np.sum(ours * theirs.conj(), axis=1)
        frequencies = 2 * np.pi * np.fft.fftfreq(_PLACES, 1 / _PLACES)

        def drift(s: Any) -> Array:
            """Return a s + the mean of u - v, of angles that rotate, up to whole rounds."""
            apart = np.where(gained != 0, np.multiply.outer(s, gained) + means, 0.0)
            return apart - whole_rounds(apart, self.circles)

        s = float((np.fft.ifft(products).real / _PLACES - (drift(part) ** 2).sum(axis=1) / 2).argmax()) / _PLACES
        for _ in range(_STEPS):
            waves = products * np.exp(1j * frequencies * s) / _PLACES**2
            slope = float((1j * frequencies * waves).sum().real - gained @ drift(s))
            bend = float((-(frequencies**2) * waves).sum().real - gained @ gained)
            if not bend < 0:
                break
            s -= slope / bend
        return self.order * s


def _turns(times: Array) -> Indices:
    """Return how many parts lie between times and the unit interval, whose both ends belong to it."""
    inside = not times.size or (times.min() >= 0 and times.max() <= 1)
    return np.zeros(times.shape, dtype=int) if inside else np.floor(times).astype(int)


def is_pair(values: ComplexArray) -> Mask:
    """Return which logarithms belong to multipliers that are not real."""
    return (values.imag != 0) & (np.abs(values.imag) != math.pi)
