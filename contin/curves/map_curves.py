"""The extended systems of curves of period doublings and of torus bifurcations of cycles of maps in two parameters.

A perturbation v_1, ..., v_k of a cycle of k points u_j+1 = f(u_j) is multiplied by an eigenvalue of P in each round, where P is
-1, or the matrix with the eigenvalues exp(-+ i theta) that `contin.curves.cycle_curves` has. One copy of it for k = 3, with A_j
the derivative of f at u_j:

                     [ A_1  -1       ]  [ v_1 ]
                     [      A_2  -1  ]  [ v_2 ]  = 0
                     [ -P        A_3 ]  [ v_3 ]
"""

from __future__ import annotations

import math
from abc import abstractmethod
from collections.abc import Callable
from typing import cast

import numpy as np

from contin.arrays import Array
from contin.curves.critical_curve import CriticalCurve
from contin.curves.cycle_curves import RESONANCES, by_kappa, pair_of
from contin.curves.extended import Borders
from contin.curves.fold_curve import normal_product
from contin.detection.test_functions import own_test_functions
from contin.discretization.maps import MapSystem
from contin.discretization.system import System
from contin.linalg.dense import DenseFactors
from contin.stepping.trial import TestFunction, Trial


class MapCurve(CriticalCurve):
    """Cycles of a map with a critical multiplier, on a `MapSystem`."""

    @property
    def cycles(self) -> MapSystem:
        """The underlying system."""
        return cast(MapSystem, self.base)

    @abstractmethod
    def coupling(self, x: Array) -> Array:
        """Return P, shape (copies, copies)."""

    @property
    def copy_shape(self) -> tuple[int, Array]:
        """Number of equations of one copy of L, and the weights of its unknowns."""
        return self.base.state_size, self.base.weights[: self.base.state_size]

    def bordered(self, x: Array, b: Array, c: Array) -> tuple[Callable[[Array], Array], Callable[[Array], Array]]:
        """Return functions that solve with the bordered matrix and with its transpose."""
        n, size, every = self._count, self.base.state_size, np.eye(self.copies)
        matrix = self.cycles.jacobian(x[: self.base.size])
        closing = np.zeros_like(matrix)
        closing[size - n :, :n] = np.eye(n)
        coupled = np.kron(every, matrix + closing) - np.kron(self.coupling(x), closing)
        rows, columns = np.kron(every, c[None, :]), np.kron(every, b[:, None])
        factors = DenseFactors(np.block([[coupled, columns], [rows, np.zeros((self.copies, self.copies))]]))
        return factors.solve, factors.solve_transposed

    @property
    def _count(self) -> int:
        return len(self.cycles.problem.state_names)

    def ends(self, left: Array) -> Array:
        """Return the part of left null vectors that belongs to the last point of the round."""
        return left[..., self.base.state_size - self._count :]

    def starts(self, right: Array) -> Array:
        """Return right null vectors at the first point: what P multiplies."""
        return right[..., : self._count]


class MapDoublingCurve(MapCurve):
    """Period doublings: the multiplier -1."""

    kind, copies = "PD", 1

    def __init__(self, base: System, borders: Borders | None = None, size: float = 1.0) -> None:
        super().__init__(base, borders, size)

    def coupling(self, x: Array) -> Array:
        """Return -1."""
        return -np.eye(1)

    def imaginary_part(self, x: Array) -> float:
        """Return 0: the multiplier is real."""
        return 0.0

    def by_kappa(self, x: Array, right: Array, left: Array) -> Array:
        """Return nothing: there is no kappa."""
        return np.zeros(1)


class MapTorusCurve(MapCurve):
    """Torus bifurcations: the multipliers exp(-+ i theta); column ``angle``, theta."""

    kind, copies = "TR", 2

    def __init__(self, base: System, borders: Borders | None = None, size: float = 1.0) -> None:
        super().__init__(base, borders, size, ("angle",))

    def coupling(self, x: Array) -> Array:
        """Return the real matrix with the eigenvalues exp(-+ i theta)."""
        return pair_of(self.kappa(x))

    def imaginary_part(self, x: Array) -> float:
        """Return sin(theta); 0 where the multipliers are real."""
        return math.sqrt(max(1 - self.kappa(x) ** 2, 0.0))

    def by_kappa(self, x: Array, right: Array, left: Array) -> Array:
        """Return -w.(dP/dkappa v_1)."""
        return by_kappa(self.kappa(x), self.starts(right), self.ends(left))

    def functionals(self, x: Array) -> Array:
        """Return those of the underlying problem, and the angle."""
        return np.append(super().functionals(x), math.acos(min(max(self.kappa(x), -1.0), 1.0)))


def _resonance(label: str, kappa: float) -> TestFunction:
    """Return the test function of the angle with this cosine: a strong resonance; the curve ends where the angle is 0 or pi."""
    sign = -1 if kappa == 1 else 1  # a test function that ends a run is positive on it

    def distance(trial: Trial) -> float:
        return sign * (cast(MapTorusCurve, trial.system).kappa(trial.x) - kappa)

    return TestFunction(label, f"resonance 1:{label[1]}", distance, terminal=abs(kappa) == 1)


@own_test_functions.register
def _of_torus_curve(system: MapTorusCurve) -> list[TestFunction]:
    """Strong resonances."""
    return [_resonance(label, kappa) for label, kappa in RESONANCES.items()]


@own_test_functions.register
def _of_doubling_curve(system: MapDoublingCurve) -> list[TestFunction]:
    """A second multiplier -1 (R2: the derivative of g by the multiplier vanishes)."""

    def double(trial: Trial) -> float:
        curve = cast(MapDoublingCurve, trial.system)
        right, _, left = curve.null_vectors(trial.x)
        return normal_product(curve.starts(right[0]), curve.ends(left[0, 0]))

    return [TestFunction("R2", "resonance 1:2", double)]
