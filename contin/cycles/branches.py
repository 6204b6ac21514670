"""What is known of branches of cycles, and of cycles of maps: curves that begin on them, and cycles shifted in time."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from contin.arrays import Array
from contin.core.labels import Label
from contin.core.protocol import Discretization
from contin.core.trial import Event
from contin.cycles.curves import DoublingCurve, TorusCurve, events_on_folds
from contin.cycles.floquet import critical_angle, doubled, doubles, doubling, torus, unstable
from contin.events.arc import SpecialPoint
from contin.levels import ROUGH
from contin.problems.angles import whole_rounds

if TYPE_CHECKING:
    from contin.cycles.equations import CycleCollocation, ForcedCollocation
    from contin.cycles.map_equations import MapSystem


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


def lasting(system: CycleCollocation, x: Array) -> Array:
    """Return what a shift in time leaves as it is, as `CycleCollocation.lasting` does."""
    size, n = system.state_size, len(system.problem.state_names)
    states = x[:size].reshape(-1, n)[:, system.circles == 0]
    weights = system.weights[:size:n]
    means = weights @ states
    square = weights @ np.einsum("ka,ka->k", states, states) - means @ means
    return np.concatenate([x[size:], means, [np.sqrt(max(square, 0.0))]])


def cycle_in_phase(system: CycleCollocation, x: Array, vectors: Sequence[Array], reference: Array) -> tuple[Array, list[Array]]:
    """Return a cycle, and vectors at it, shifted in time to lie closest to another one."""
    shift, size = _shift(system, x, reference), system.state_size
    times = (system.nodes + shift) % system.order

    def moved(vector: Array) -> Array:
        return np.concatenate([system.perturbation(vector, times).ravel(), vector[size:]])

    return system.lifted(system.moved(x, shift), reference), [moved(vector) for vector in vectors]


def forced_cycle_in_phase(
    system: ForcedCollocation, x: Array, vectors: Sequence[Array], reference: Array
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


def map_in_phase(system: MapSystem, x: Array, vectors: Sequence[Array], reference: Array) -> tuple[Array, list[Array]]:
    """Return a cycle of a map, which may begin with any of its points, and vectors at it, to lie closest to another one."""

    def apart(shift: int) -> float:
        return float(system.weights @ (system.lifted(system.moved(x, shift), reference) - reference) ** 2)

    nearest = min(range(system.rounds), key=apart)
    turned = [vector.copy() for vector in vectors]
    for vector in turned:
        system.states(vector)[:] = np.roll(system.states(vector), -nearest, axis=0)
    return system.lifted(system.moved(x, nearest), reference), turned


def _is_odd(system: ForcedCollocation, x: Array) -> bool:
    """Return whether -u(t + T / 2) is a solution where u is one, T the period of the forcing; it never goes round as u."""
    if system.rotates:
        return False
    image = system.moved(x, 0.5 / system.rounds)
    image[: system.state_size] *= -1
    size = np.abs(system.residual(np.where(np.arange(x.size) < system.state_size, -x, x))).max()
    return bool(np.abs(system.residual(image)).max() <= ROUGH * size)


def _shift(system: CycleCollocation, x: Array, reference: Array) -> float:
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
