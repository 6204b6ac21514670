"""The extended systems of curves of period doublings and of torus bifurcations of cycles in two parameters.

A perturbation of the Poincare map (`contin.discretization.round`) that is multiplied by -1, or by exp(i theta), in a round:
v(1) = -v(0), or, with v = v_1 + i sin(theta) v_2 and kappa = cos(theta),

    [ v_1 ]       [ kappa   kappa^2 - 1 ]  [ v_1 ]
    [     ] (1) = [                     ]  [     ] (0).
    [ v_2 ]       [   1        kappa    ]  [ v_2 ]

The equations are regular at the strong resonances theta = 0 (R1) and theta = pi (R2), where the curve ends: beyond, with
|kappa| > 1, two real multipliers have the product 1, which is no bifurcation.
"""

from __future__ import annotations

import functools
import math
from abc import abstractmethod
from collections.abc import Callable
from typing import cast

import numpy as np

from contin.arrays import Array
from contin.curves.critical_curve import CriticalCurve
from contin.curves.extended import Borders
from contin.curves.fold_curve import FoldCurve, normal_product, shrinking, turns_back
from contin.detection.cycle_normal_forms import NormalForms
from contin.detection.interpolated import interpolated_zero
from contin.detection.lyapunov import Coefficient
from contin.detection.segment import Segment, SpecialPoint
from contin.detection.test_functions import own_test_functions
from contin.discretization.cycles import PeriodicCollocation
from contin.discretization.round import Round
from contin.discretization.system import System
from contin.problems.cycle import PERIOD
from contin.stepping.state import Stop
from contin.stepping.trial import TestFunction, Trial

#: Logarithms of two multipliers that are one at a fold differ by less: the square root of their error.
_DOUBLE = 1e-3
#: Cosines of the angles at strong resonances.
RESONANCES = {"R1": 1.0, "R2": -1.0, "R3": -0.5, "R4": 0.0}
#: With a smaller imaginary part of the multiplier the curve is at its end, with a smaller difference of kappa at a resonance:
#: they are located more exactly than that.
_REAL = 1e-6
#: Where kappa has an extremum, a value this close to that of a resonance is worth a search.
_NEAR = 0.05


def pair_of(kappa: float) -> Array:
    """Return the real matrix P with the eigenvalues exp(-+ i theta), for kappa = cos(theta)."""
    return np.array([[kappa, kappa**2 - 1], [1.0, kappa]])


def by_kappa(kappa: float, starts: Array, ends: Array) -> Array:
    """Return -w.(dP/dkappa v(0)), shape (2,), of v(0) (2, n) and of the parts of two w for the ends (2, 2, n)."""
    change = np.array([[1.0, 2 * kappa], [0.0, 1.0]])
    result: Array = -np.einsum("ija,jk,ka->i", ends, change, starts)
    return result


class CycleCurve(CriticalCurve):
    """Cycles with a critical multiplier, on a `PeriodicCollocation`."""

    @property
    def cycles(self) -> PeriodicCollocation:
        """The underlying system."""
        return cast(PeriodicCollocation, self.base)

    @functools.cached_property
    def _folds(self) -> FoldCurve:
        return FoldCurve(self.base)

    def fold(self, x: Array) -> float:
        """Return a number that vanishes where the cycle is at a fold, too."""
        y = x[: self.base.size]
        if self._folds.borders is not None and not self._folds.borders_fit(y):
            self._folds.borders = None
        return float(self._folds.null_vectors(y)[2])

    @abstractmethod
    def coupling(self, x: Array) -> Array:
        """Return P, shape (copies, copies)."""

    def angle(self, x: Array) -> float:
        """Return the angle of the pair of multipliers."""
        return math.acos(min(max(self.kappa(x), -1.0), 1.0))

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

    @abstractmethod
    def normal_form(self, x: Array) -> Coefficient:
        """Return the coefficient of the normal form."""

    def functionals(self, x: Array) -> Array:
        """Return those of the underlying problem, and the coefficient of the normal form."""
        return np.append(super().functionals(x), self.normal_form(x).value)

    def starts(self, right: Array) -> Array:
        """Return right null vectors at t = 0, turned by the symmetry: what P multiplies."""
        found: Array = right[..., : len(self.cycles.problem.state_names)] @ self.cycles.turn.T
        return found


class DoublingCurve(CycleCurve):
    """Period doublings: the multiplier -1; the column ``normal_form`` is its coefficient c."""

    kind, copies = "PD", 1

    def __init__(self, base: System, borders: Borders | None = None, size: float = 1.0) -> None:
        super().__init__(base, borders, size, ("normal_form",))

    def normal_form(self, x: Array) -> Coefficient:
        """Return c."""
        return NormalForms(self.cycles, x).period_doubling()

    def coupling(self, x: Array) -> Array:
        """Return -1."""
        return -np.eye(1)

    def imaginary_part(self, x: Array) -> float:
        """Return 0: the multiplier is real."""
        return 0.0

    def by_kappa(self, x: Array, right: Array, left: Array) -> Array:
        """Return nothing: there is no kappa."""
        return np.zeros(1)


class TorusCurve(CycleCurve):
    """Torus bifurcations: the multipliers exp(-+ i theta); columns ``normal_form``, Re d, and ``angle``, theta."""

    kind, copies = "TR", 2

    def __init__(self, base: System, borders: Borders | None = None, size: float = 1.0) -> None:
        super().__init__(base, borders, size, ("normal_form", "angle"))

    def coupling(self, x: Array) -> Array:
        """Return the real matrix with the eigenvalues exp(-+ i theta)."""
        return pair_of(self.kappa(x))

    def imaginary_part(self, x: Array) -> float:
        """Return sin(theta); 0 where the multipliers are real."""
        return math.sqrt(max(1 - self.kappa(x) ** 2, 0.0))

    def by_kappa(self, x: Array, right: Array, left: Array) -> Array:
        """Return -w.(dP/dkappa v(0))."""
        return by_kappa(self.kappa(x), self.starts(right), self.ends(left))

    def functionals(self, x: Array) -> Array:
        """Return those of the underlying problem, and the angle."""
        return np.append(super().functionals(x), self.angle(x))

    def normal_form(self, x: Array) -> Coefficient:
        """Return the real part of d; NaN at the ends of the curve and at the resonance 1:3, where it is infinite."""
        if self.imaginary_part(x) < _REAL or abs(self.kappa(x) - RESONANCES["R3"]) < _REAL:
            return Coefficient(math.nan, math.nan, math.nan)
        return NormalForms(self.cycles, x[: self.base.size]).torus(self.angle(x))


def _curve(trial: Trial) -> CycleCurve:
    return cast(CycleCurve, trial.system)


def _resonance(label: str, kappa: float) -> TestFunction:
    """Return the test function of the angle with this cosine: a strong resonance; the curve ends where the angle is 0 or pi.

    A test function that ends a run is positive on it. With a symmetry the angle may come to 0 or pi and go back: `_touched`.
    """
    sign, name = (-1 if kappa == 1 else 1), f"resonance 1:{label[1]}"

    def distance(trial: Trial) -> float:
        return sign * (_curve(trial).kappa(trial.x) - kappa)

    def search(segment: Segment, _: object) -> list[SpecialPoint] | None:
        return _touched(segment, test, distance)

    at_end = abs(kappa) == 1
    test = TestFunction(label, name, distance, terminal=at_end, search=search if at_end else None)
    return test


def _touched(segment: Segment, test: TestFunction, distance: Callable[[Trial], float]) -> list[SpecialPoint] | None:
    """Return the resonance where the angle has an extremum; None where there is none in a step.

    A symmetry makes a round of equal parts. Where the pair of half a round passes i and -i, that of the round comes to -1 and
    goes back: both vectors are eigenvectors, and the equations of the curve singular. They are, too, where cycles that have an
    image become their own image: there the pair comes to 1, and the curve goes back on itself.
    """
    a, b = (_change(trial) for trial in (segment.before, segment.trial))
    if not a * b < 0:
        return None
    near = segment.low + (segment.step - segment.low) * a / (a - b)
    if abs(distance(segment.guessed(near))) > _NEAR:
        return None
    found = interpolated_zero(segment, (_change, distance), near)
    if found is None:
        return None
    stop = None
    if turns_back(found.trial, slice(segment.state.system.state_size, None)):
        stop = Stop("pitchfork", f"met {test.name} on a symmetric cycle: beyond it the curve is its own mirror image")
    return [SpecialPoint(found.at, test.label, test.name, found.trial, stop, found, test)]


def _change(trial: Trial) -> float:
    """Return how fast kappa changes along the curve."""
    return float(trial.tangent[-1])


def _at_fold(label: str, name: str) -> TestFunction:
    """Return the test function of points where the cycle is at a fold, too: two multipliers are one, up to a square root."""

    def confirm(trial: Trial) -> bool:
        curve = _curve(trial)
        exponents = curve.cycles.eigenvalues(trial.x[: curve.base.size])
        own = 2 * (curve.copies == 2 and curve.angle(trial.x) < _DOUBLE)  # the pair itself is one at R1
        known = int(curve.cycles.autonomous) + own
        return len(exponents) > known and bool(np.sort(np.abs(exponents))[known] < _DOUBLE)

    return TestFunction(label, name, lambda trial: _curve(trial).fold(trial.x), confirm=confirm)


def _degenerate(label: str, name: str) -> TestFunction:
    """Return the test function of points where the coefficient of the normal form is zero."""
    return TestFunction(
        label, name, lambda trial: _curve(trial).normal_form(trial.x).signed,
        confirm=lambda trial: _curve(trial).normal_form(trial.x).vanishes,
    )  # fmt: skip


@own_test_functions.register
def _of_torus_curve(system: TorusCurve) -> list[TestFunction]:
    """Strong resonances, Chenciner points, and folds."""
    resonances = [_resonance(label, kappa) for label, kappa in RESONANCES.items()]
    return [*shrinking(system.cycles), *resonances, _degenerate("CH", "Chenciner"), _at_fold("LPTR", "fold-torus")]


@own_test_functions.register
def _of_doubling_curve(system: DoublingCurve) -> list[TestFunction]:
    """A second multiplier -1 (R2: the derivative of g by the multiplier vanishes), generalized period doublings, and folds."""

    def double(trial: Trial) -> float:
        curve = _curve(trial)
        right, _, left = curve.null_vectors(trial.x)
        return normal_product(curve.starts(right[0]), curve.ends(left[0, 0]))

    return [
        *shrinking(system.cycles),
        TestFunction("R2", "resonance 1:2", double),
        _degenerate("GPD", "generalized period doubling"),
        _at_fold("LPPD", "fold-flip"),
    ]
