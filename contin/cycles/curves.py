"""Curves of folds, period doublings and torus bifurcations of cycles, and of cycles of maps, in two parameters.

A perturbation is multiplied in a round by an eigenvalue of P. It is -1 at a period doubling. At a torus bifurcation, with
kappa = cos(theta) and the perturbation v_1 + i sin(theta) v_2,

        [ kappa   kappa^2 - 1 ]
    P = [                     ].
        [   1        kappa    ]

The equations are regular at the strong resonances theta = 0 (R1) and theta = pi (R2), where the curve ends: beyond, with
|kappa| > 1, two real multipliers have the product 1, which is no bifurcation.
"""

from __future__ import annotations

import functools
import math
from typing import TYPE_CHECKING, Any, cast

import numpy as np

from contin.arrays import Array
from contin.core.labels import Label
from contin.core.trial import Event, Trial
from contin.cycles.normal_forms import MOST
from contin.defining.critical import CriticalCurve, degenerate, signed_smallest
from contin.defining.special_points import FoldCurve
from contin.events.arc import Arc, SpecialPoint
from contin.events.interpolated import meeting
from contin.events.normal_forms import UNKNOWN, Coefficient, flip, pair
from contin.levels import APART, CORRECTED, ROUGH, ROUND_OFF

if TYPE_CHECKING:
    from contin.cycles.equations import PeriodicCollocation
    from contin.cycles.map_equations import MapSystem

#: Cosines of the angles at strong resonances.
RESONANCES = {"R1": 1.0, "R2": -1.0, "R3": -0.5, "R4": 0.0}
#: Where kappa has an extremum, a value this close to that of a resonance is worth a search.
_NEAR = 0.05
#: Vectors are normal to each other where the cosine between them is smaller: their round-off.
NORMAL = 1e-10


class MultiplierCurve(CriticalCurve):
    """Cycles with a critical multiplier."""

    @property
    def is_long(self) -> bool:
        """It is a cycle of a map that is too long for a normal form."""
        return not self.base.intervals and self.base.state_size > MOST

    @functools.cached_property
    def _folds(self) -> FoldCurve:
        return FoldCurve(self.base)

    def fold(self, x: Array) -> float:
        """Return a number that vanishes where the cycle is at a fold, too."""
        return float(self._folds.own_values(self.inside(x))[0])


class DoublingCurve(MultiplierCurve):
    """Period doublings: the multiplier -1; the column ``normal_form`` is its coefficient c."""

    kind = Label.PERIOD_DOUBLING

    def coupling(self, kappa: float) -> Array:
        """Return -1."""
        return -np.eye(1)

    def frequency(self, x: Array) -> float:
        """Return the angle of the multiplier -1."""
        return math.pi

    def normal_form(self, x: Array) -> Coefficient:
        """Return c."""
        return UNKNOWN if self.is_long else self.of(flip, x)

    def events(self) -> list[Event]:
        """Return those of a second multiplier -1, of generalized period doublings, and of folds."""
        own = [_second_doubling(), degenerate("GPD", "generalized period doubling")]
        return [*super().events(), *own, *_at_fold(self, "LPPD", "fold-flip")]


class TorusCurve(MultiplierCurve):
    """Torus bifurcations: the multipliers exp(-+ i theta); columns ``normal_form``, Re d, and ``angle``, theta."""

    kind = Label.TORUS
    own_equations, own_unknowns = 2, 1
    own_columns = ("normal_form", "angle")

    def coupling(self, kappa: float) -> Array:
        """Return the real matrix with the eigenvalues exp(-+ i theta)."""
        return np.array([[kappa, kappa**2 - 1], [1.0, kappa]])

    def coupling_slope(self, kappa: float) -> Array:
        """Return its derivative."""
        return np.array([[1.0, 2 * kappa], [0.0, 1.0]])

    def imaginary_part(self, x: Array) -> float:
        """Return sin(theta); 0 where the multipliers are real."""
        return math.sqrt(max(1 - self.kappa(x) ** 2, 0.0))

    def frequency(self, x: Array) -> float:
        """Return the angle of the pair of multipliers."""
        return math.acos(min(max(self.kappa(x), -1.0), 1.0))

    def normal_form(self, x: Array) -> Coefficient:
        """Return the real part of d; NaN at the ends of the curve and at the resonance 1:3, where it is infinite."""
        if self.is_long or self.imaginary_part(x) < APART or abs(self.kappa(x) - RESONANCES["R3"]) < APART:
            return UNKNOWN
        return self.of(pair, x, self.frequency(x))

    def functionals(self, x: Array) -> Array:
        """Return those of the underlying problem, Re d, and the angle."""
        return np.append(super().functionals(x), self.frequency(x))

    def events(self) -> list[Event]:
        """Return those of strong resonances, Chenciner points, and folds."""
        own = [*(_resonance(label, kappa) for label, kappa in RESONANCES.items()), degenerate("CH", "Chenciner")]
        return [*super().events(), *own, *_at_fold(self, "LPTR", "fold-torus")]


def normal_product(v: Array, w: Array, noise: float = NORMAL) -> float:
    """Return the cosine between two vectors; 0 where it is round-off, as all along a curve of a conservative system."""
    cosine = float(v @ w) / float(np.linalg.norm(v) * np.linalg.norm(w))
    return cosine if abs(cosine) > noise else 0.0


def _second_doubling() -> Event:
    """Return the test function of a second multiplier -1: the derivative of g by the multiplier vanishes."""

    def double(trial: Trial) -> float:
        curve = cast(DoublingCurve, trial.system)
        right, left = curve.null_vectors(trial.x)
        return normal_product(*curve.at(trial.x)[0].coupled_parts(left[0, 0], right[0]))

    return Event("R2", "resonance 1:2", double)


def _at_fold(curve: Any, label: str, name: str) -> list[Event]:
    """Return the test function of points at a fold, too: two multipliers are one, up to a square root. None if none is left."""

    def confirm(trial: Trial) -> bool:
        curve = trial.system
        exponents = curve.base.eigenvalues(curve.inside(trial.x))
        own = 2 * (curve.own_unknowns and curve.frequency(trial.x) < ROUGH)  # the pair itself is one at R1
        known = int(curve.base.autonomous) + own
        return len(exponents) > known and bool(np.sort(np.abs(exponents))[known] < ROUGH)

    left = curve.base.intervals and len(curve.problem.states) > curve.own_equations + curve.base.autonomous
    return [Event(label, name, lambda trial: trial.system.fold(trial.x), confirm=confirm)] if left else []


def _resonance(label: str, kappa: float) -> Event:
    """Return the test function of the angle with this cosine: a strong resonance; the curve ends where the angle is 0 or pi.

    A test function that ends a run is positive on it. With a symmetry the angle may come to 0 or pi, where it has an extremum,
    and go back. A symmetry makes a round of equal parts. Where the pair of half a round passes i and -i, that of the round
    comes to -1 and goes back: both vectors are eigenvectors, and the equations of the curve singular. They are, too, where
    cycles that have an image become their own image: there the pair comes to 1, and the curve goes back on itself.
    """
    sign, name, at_end = (-1 if kappa == 1 else 1), f"resonance 1:{label[1]}", abs(kappa) == 1
    stops = f"met {name} on a symmetric cycle: beyond it the curve is its own mirror image"

    def distance(trial: Trial) -> float:
        return sign * (cast(TorusCurve, trial.system).kappa(trial.x) - kappa)

    def search(arc: Arc, _: object) -> list[SpecialPoint] | None:
        return meeting(arc, test, (_change, distance), _NEAR, stops)

    def asks(arc: Arc) -> bool:
        return arc.passes(test) or _change(arc.before) * _change(arc.trial) < 0

    test = Event(label, name, distance, terminal=at_end, search=search if at_end else None, asks=asks if at_end else None)
    return test


def _change(trial: Trial) -> float:
    """Return how fast kappa changes along the curve."""
    return float(trial.tangent[-1])


def events_on_folds(cycles: PeriodicCollocation | MapSystem) -> list[Event]:
    """Return the test functions of points where a further multiplier is one, or another is -1.

    The change of g with the multiplier vanishes where a further one is one. None where there are no others.
    """
    autonomous, noise = cycles.autonomous, NORMAL if cycles.intervals else ROUND_OFF
    critical = 1 + autonomous

    def further(trial: Trial) -> float:
        v, w = trial.system.null_vectors(trial.x)
        n = len(trial.system.problem.states)
        return normal_product(v[:n], w[-1 - n : -1] if autonomous else w[-n:], noise)

    def flip(trial: Trial) -> float:
        exponents = trial.system.base.computed_eigenvalues(trial.x)  # round-off of a pair changes no sign
        others = exponents[np.argsort(np.abs(exponents))[critical:]]
        size = np.maximum(others.real, 0.0)  # multipliers may be larger than any number
        multipliers = np.exp(others - size)
        multipliers.imag[np.abs(multipliers.imag) <= CORRECTED * np.abs(multipliers)] = 0.0
        return signed_smallest(np.exp(-size) + multipliers)

    found = [Event("R1", "resonance 1:1", further), Event("LPPD", "fold-flip", flip)]
    return found if len(cycles.problem.states) > critical else []
