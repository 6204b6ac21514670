"""The characteristic matrices of cycles, and of cycles of maps, and their forms (`contin.events.normal_forms`).

Time is measured in periods, s = t / T, so that the field is G = T F; J, B and C are its derivatives of first, second and third
order along the cycle. L(mu) v = v' - J v, with v(1) = mu v(0) (`contin.cycles.round`; with a symmetry of order n, over one n-th
of the period, with S v(0) for v(0)). Near a bifurcation time goes on by ds/dt = (1 - stretch) / T, but evenly with a forcing.
The mean of |v|^2 over the period is one, and at folds v is normal to u0' in the mean. Products with w are those of the discrete
equations, so that the coefficients converge with the cycle.

With the derivatives A_j, B and C of a map f at the points of a cycle, L(mu) v = r stands for the cyclic linear equations

                     [ A_1  -1       ]  [ v_1 ]     [ r_1 ]
                     [      A_2  -1  ]  [ v_2 ] = - [ r_2 ],     |v_1| = 1 and w_k.v_1 = 1.
                     [ -mu       A_3 ]  [ v_3 ]     [ r_3 ]

For one point the coefficients are Kuznetsov's (sections 4.5, 4.7 and 5.4); for several they are those of f applied k times, at
the first point.
"""

from __future__ import annotations

import functools
from typing import Any

import numpy as np

from contin.arrays import Array, Numbers
from contin.core.multilinear import of_complex
from contin.cycles.equations import PeriodicEquations
from contin.cycles.map_equations import MapEquations
from contin.cycles.round import Round, Solver
from contin.events.normal_forms import DenseForm, Direction, Form
from contin.linalg.border import Borders
from contin.problems.own_names import PERIOD

#: Largest number of unknown states of a map: with twice as many, dense factors take eight times as long, a minute.
MOST = 2000


def multiplier(rate: complex) -> Any:
    """Return exp(rate); a real number where it is real but for round-off."""
    return np.real_if_close(np.exp(rate))[()]


class MapForm(DenseForm):
    """That of a cycle of a map.

    Parameters
    ----------
    system : MapEquations
    x : ndarray, shape (size,)
    """

    doubled_side = -1

    def __init__(self, system: MapEquations, x: Array) -> None:
        size, n = system.state_size, len(system.problem.state_names)
        matrix = system.jacobian(x)
        matrix[np.arange(size - n, size), np.arange(n)] += 1.0  # of the first point itself: P stands there
        super().__init__(matrix, n, lambda stacks: system.stack_along(x, stacks), system.weights[:size])

    def coupling(self, rate: complex) -> Any:
        """Return the multiplier."""
        return multiplier(rate)

    def unit(self, rate: complex) -> complex:
        """Return one over the multiplier."""
        return complex(np.exp(-rate))


class CycleForm(Form):
    """That of a cycle of a vector field.

    Parameters
    ----------
    system : PeriodicEquations
    x : ndarray, shape (size,)
    """

    def __init__(self, system: PeriodicEquations, x: Array) -> None:
        self.system, self.x = system, x
        self._around = Round(system, x, phased=False)
        self._period = float(x[system.parameter_index(PERIOD)]) if system.autonomous else 1.0  # as it stands in x
        self.places, self.equations = np.arange(system.state_size), self._around.size
        self.weights = system.weights[self.places]

    @functools.cached_property
    def reduced(self) -> CycleForm:
        """The same with a change of the period, and a condition at t = 0, of autonomous cycles."""
        if not self.system.autonomous:
            return self
        other = CycleForm.__new__(CycleForm)
        other.__dict__.update(self.__dict__)
        other._around = self._around.with_period()
        other.places, other.equations = np.append(self.places, self.system.parameter_index(PERIOD)), other._around.size
        other.weights = self.system.weights[other.places]
        return other

    def solver(self, coupling: complex | Numbers, border: Borders | None = None) -> Solver:
        """Return the solver of a round."""
        return self._around.solver(coupling, border)

    def coupled_parts(self, left: Numbers, right: Numbers) -> tuple[Numbers, Numbers]:
        """Return the part of w that belongs to the condition between the ends of the round, and S v(0)."""
        n, size = self.system.states_count, self.system.state_size
        return left[..., size - n : size], right[..., :n] @ self.system.turn.T

    def coupling(self, rate: complex) -> Any:
        """Return the multiplier."""
        return multiplier(rate)

    def unit(self, rate: complex) -> complex:
        """Return one over the unit of time."""
        return 1 / self.system.unit_time(self.x)

    def normalized(self, left: Numbers, right: Numbers) -> tuple[Any, Direction]:
        """Return w and v, normal to u0' where a multiplier is one."""
        size, system = self.system.state_size, self.system
        if len(right) > size:
            cycles: Any = system  # an autonomous one
            along = cycles.rates(self.x, np.ascontiguousarray(self.x[:size].reshape(system.nodes.size, -1))).ravel()
            right = right.copy()
            right[:size] -= self._mean(right, along) / self._mean(along, along) * along
        v = self._direction(right / np.sqrt(self._mean(right, right.conj()).real))
        return left / self.product(left, v.states), v

    def solve(self, rate: complex, values: Numbers) -> Direction:
        """Return the h with L h = values."""
        right: Any = np.zeros(self.equations, dtype=values.dtype)
        right[: values.size] = (self._widths * values).ravel()
        return self._direction(self.solver(self.coupling(rate)).solve(right))

    def along(self, *directions: object) -> Any:
        """Return B or C along directions at the Gauss points, real or complex."""
        along = self.system.rates_along
        return of_complex(lambda stacks: np.array([along(self.x, parts) for parts in zip(*stacks)]), directions)

    def product(self, left: Numbers, values: Numbers) -> complex:
        """Return w.values."""
        return complex(left[: values.size] @ (self._widths * values).ravel())

    def along_time(self, states: Numbers) -> Any:
        """Return J v at the Gauss points."""
        return np.einsum("kij,kj->ki", self._jacobian, states)

    @functools.cached_property
    def _jacobian(self) -> Array:
        return self.system.rates_by_states(self.x, self._points)

    @functools.cached_property
    def _points(self) -> Array:
        return self.system.at_gauss_points(self.x)

    @property
    def _widths(self) -> Array:
        return np.repeat(np.diff(self.system.mesh), self.system.degree)[:, None]

    def _mean(self, v: Numbers, w: Numbers) -> Any:
        """Return the mean of v.w over the period, in the user's units."""
        size = self.system.state_size
        weights = self.system.weights[:size] * self.system.unscaled_factors[:size] ** 2
        return weights @ (v[:size] * w[:size])

    def _direction(self, v: Numbers) -> Direction:
        """Return the states at the nodes, interpolated to the Gauss points, and the change of the period."""
        system, n, size = self.system, self.system.states_count, self.system.state_size
        local = v[:size].reshape(-1, n)[system.by_interval]
        states = np.einsum("qm,jma->jqa", system.basis.value, local).reshape(-1, n)
        return Direction(states, float(v[size]) / self._period if len(v) > size else 0.0)
