"""The extended systems of curves of period doublings and of torus bifurcations of cycles of maps in two parameters.

A perturbation v_1, ..., v_k of a cycle of k points u_j+1 = f(u_j) is multiplied by an eigenvalue of P in each round, where P is
that of `contin.cycles.multiplier_curves`. One copy of it for k = 3, with A_j the derivative of f at u_j:

                     [ A_1  -1       ]  [ v_1 ]
                     [      A_2  -1  ]  [ v_2 ]  = 0
                     [ -P        A_3 ]  [ v_3 ]
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import cast

import numpy as np

from contin.arrays import Array
from contin.core.system import System
from contin.core.trial import Event
from contin.cycles.map_equations import MapEquations
from contin.cycles.map_normal_forms import period_doubling, torus
from contin.cycles.multiplier_curves import Doubling, MultiplierCurve, Pair, degenerate, resonances, second_doubling
from contin.defining.extended import Borders
from contin.events.coefficient import Coefficient
from contin.linalg.dense import DenseFactors


class MapCurve(MultiplierCurve):
    """Cycles of a map with a critical multiplier, on a `MapEquations`."""

    @property
    def cycles(self) -> MapEquations:
        """The underlying system."""
        return cast(MapEquations, self.base)

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


class MapDoublingCurve(Doubling, MapCurve):
    """Period doublings; the column ``normal_form`` is their coefficient c."""

    def __init__(self, base: System, borders: Borders | None = None, size: float = 1.0) -> None:
        super().__init__(base, borders, size, ("normal_form",))

    def normal_form(self, x: Array) -> Coefficient:
        """Return c."""
        return period_doubling(self.cycles, x[: self.base.size]) or _UNKNOWN

    def functionals(self, x: Array) -> Array:
        """Return those of the underlying problem, and c."""
        return np.append(super().functionals(x), self.normal_form(x).value)

    def events(self) -> list[Event]:
        """Return those of a second multiplier -1, and of generalized period doublings."""
        return [second_doubling(), degenerate("GPD", "generalized period doubling")]


class MapTorusCurve(Pair, MapCurve):
    """Torus bifurcations; columns ``normal_form``, Re d, and ``angle``, theta."""

    def __init__(self, base: System, borders: Borders | None = None, size: float = 1.0) -> None:
        super().__init__(base, borders, size, ("normal_form", "angle"))

    def normal_form(self, x: Array) -> Coefficient:
        """Return the real part of d; NaN at the ends of the curve and at the resonance 1:3, where it is infinite."""
        found = None if self.is_infinite(x) else torus(self.cycles, x[: self.base.size], self.angle(x))
        return found or _UNKNOWN

    def functionals(self, x: Array) -> Array:
        """Return those of the underlying problem, Re d, and the angle."""
        *known, angle = super().functionals(x)
        return np.array([*known, self.normal_form(x).value, angle])

    def events(self) -> list[Event]:
        """Return those of strong resonances and Chenciner points."""
        return [*resonances(), degenerate("CH", "Chenciner")]


#: Of long cycles, and where it is infinite.
_UNKNOWN = Coefficient(math.nan, math.nan, math.nan)
