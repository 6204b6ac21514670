"""Curves of cycles, or of cycles of maps, with a critical multiplier: -1, or a complex pair exp(-+ i theta).

A perturbation is multiplied in a round by an eigenvalue of P. It is -1 at a period doubling. At a torus bifurcation, with
kappa = cos(theta) and the perturbation v_1 + i sin(theta) v_2,

        [ kappa   kappa^2 - 1 ]
    P = [                     ].
        [   1        kappa    ]

The equations are regular at the strong resonances theta = 0 (R1) and theta = pi (R2), where the curve ends: beyond, with
|kappa| > 1, two real multipliers have the product 1, which is no bifurcation.
"""

from __future__ import annotations

import math
from abc import abstractmethod
from collections.abc import Callable
from typing import cast

import numpy as np

from contin.arrays import Array
from contin.core.state import Reason, Stop
from contin.core.trial import Event, Trial
from contin.defining.critical_curve import CriticalCurve
from contin.defining.fold_curve import normal_product, turns_back
from contin.events.arc import Arc, SpecialPoint
from contin.events.coefficient import Coefficient
from contin.events.interpolated import interpolated_zero

#: Cosines of the angles at strong resonances.
RESONANCES = {"R1": 1.0, "R2": -1.0, "R3": -0.5, "R4": 0.0}
#: With a smaller imaginary part of the multiplier the curve is at its end, with a smaller difference of kappa at a resonance:
#: they are located more exactly than that.
_REAL = 1e-6
#: Where kappa has an extremum, a value this close to that of a resonance is worth a search.
_NEAR = 0.05


class MultiplierCurve(CriticalCurve):
    """Cycles with a critical multiplier."""

    @abstractmethod
    def starts(self, right: Array) -> Array:
        """Return the part of right null vectors at the beginning of a round: what P multiplies."""

    @abstractmethod
    def ends(self, left: Array) -> Array:
        """Return the part of left null vectors that belongs to the condition between the ends of a round."""

    @abstractmethod
    def coupling(self, x: Array) -> Array:
        """Return P, shape (copies, copies)."""

    @abstractmethod
    def normal_form(self, x: Array) -> Coefficient:
        """Return the coefficient of the normal form."""

    def angle(self, x: Array) -> float:
        """Return the angle of the pair of multipliers."""
        return math.acos(min(max(self.kappa(x), -1.0), 1.0))


class Doubling(MultiplierCurve):
    """The multiplier -1."""

    kind, copies = "PD", 1

    def coupling(self, x: Array) -> Array:
        """Return -1."""
        return -np.eye(1)

    def imaginary_part(self, x: Array) -> float:
        """Return 0: the multiplier is real."""
        return 0.0

    def by_kappa(self, x: Array, right: Array, left: Array) -> Array:
        """Return nothing: there is no kappa."""
        return np.zeros(1)


class Pair(MultiplierCurve):
    """The multipliers exp(-+ i theta); the last column is ``angle``, theta."""

    kind, copies = "TR", 2

    def coupling(self, x: Array) -> Array:
        """Return the real matrix with the eigenvalues exp(-+ i theta)."""
        kappa = self.kappa(x)
        return np.array([[kappa, kappa**2 - 1], [1.0, kappa]])

    def imaginary_part(self, x: Array) -> float:
        """Return sin(theta); 0 where the multipliers are real."""
        return math.sqrt(max(1 - self.kappa(x) ** 2, 0.0))

    def by_kappa(self, x: Array, right: Array, left: Array) -> Array:
        """Return -w.(dP/dkappa v(0))."""
        change = np.array([[1.0, 2 * self.kappa(x)], [0.0, 1.0]])
        result: Array = -np.einsum("ija,jk,ka->i", self.ends(left), change, self.starts(right))
        return result

    def is_infinite(self, x: Array) -> bool:
        """Return whether the coefficient of the normal form has a pole: at the ends of the curve, and at the resonance 1:3."""
        return self.imaginary_part(x) < _REAL or abs(self.kappa(x) - RESONANCES["R3"]) < _REAL

    def functionals(self, x: Array) -> Array:
        """Return those of the underlying problem, and the angle."""
        return np.append(super().functionals(x), self.angle(x))


def resonances() -> list[Event]:
    """Return the test functions of strong resonances on curves of a `Pair`."""
    return [_resonance(label, kappa) for label, kappa in RESONANCES.items()]


def second_doubling() -> Event:
    """Return the test function of a second multiplier -1: the derivative of g by the multiplier vanishes."""

    def double(trial: Trial) -> float:
        curve = _curve(trial)
        right, _, left = curve.null_vectors(trial.x)
        return normal_product(curve.starts(right[0]), curve.ends(left[0, 0]))

    return Event("R2", "resonance 1:2", double)


def degenerate(label: str, name: str) -> Event:
    """Return the test function of points where the coefficient of the normal form is zero."""
    return Event(
        label, name, lambda trial: _curve(trial).normal_form(trial.x).signed,
        confirm=lambda trial: _curve(trial).normal_form(trial.x).vanishes,
    )  # fmt: skip


def _curve(trial: Trial) -> MultiplierCurve:
    return cast(MultiplierCurve, trial.system)


def _resonance(label: str, kappa: float) -> Event:
    """Return the test function of the angle with this cosine: a strong resonance; the curve ends where the angle is 0 or pi.

    A test function that ends a run is positive on it. With a symmetry the angle may come to 0 or pi and go back: `_touched`.
    """
    sign, name = (-1 if kappa == 1 else 1), f"resonance 1:{label[1]}"

    def distance(trial: Trial) -> float:
        return sign * (_curve(trial).kappa(trial.x) - kappa)

    def search(arc: Arc, _: object) -> list[SpecialPoint] | None:
        return _touched(arc, test, distance)

    at_end = abs(kappa) == 1
    test = Event(label, name, distance, terminal=at_end, search=search if at_end else None)
    return test


def _touched(arc: Arc, test: Event, distance: Callable[[Trial], float]) -> list[SpecialPoint] | None:
    """Return the resonance where the angle has an extremum; None where there is none in a step.

    A symmetry makes a round of equal parts. Where the pair of half a round passes i and -i, that of the round comes to -1 and
    goes back: both vectors are eigenvectors, and the equations of the curve singular. They are, too, where cycles that have an
    image become their own image: there the pair comes to 1, and the curve goes back on itself.
    """
    a, b = (_change(trial) for trial in (arc.before, arc.trial))
    if not a * b < 0:
        return None
    near = arc.low + (arc.step - arc.low) * a / (a - b)
    if abs(distance(arc.guessed(near))) > _NEAR:
        return None
    found = interpolated_zero(arc, (_change, distance), near)
    if found is None:
        return None
    stop = None
    if turns_back(found.trial, slice(arc.state.system.state_size, None)):
        stop = Stop(Reason.PITCHFORK, f"met {test.name} on a symmetric cycle: beyond it the curve is its own mirror image")
    return [SpecialPoint(found.at, test.label, test.name, found.trial, stop, found, test)]


def _change(trial: Trial) -> float:
    """Return how fast kappa changes along the curve."""
    return float(trial.tangent[-1])
