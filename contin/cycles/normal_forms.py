"""Normal forms of cycles, and of cycles of maps: the linearization over one round, and their characteristic matrices.

A cycle is linearized over one round with any condition between its ends. With a symmetry S of the cycle a round is one n-th of
the period, and E0 in the conditions stands for S E0.

Collocated, v' = T F_u v has the rows C v = 0. With v(1) = P v(0) for several copies of v that the small matrix P couples (or
one copy with the number P), a perturbation is multiplied by an eigenvalue of P in each round:

                        v_1      a_1      v_2      a_2
                     [ C        -h F                      ]    collocation; a_i is a change of the period
                     [ E1 - P11 E0       -P12 E0          ]    v_1(1) = P11 v_1(0) + P12 v_2(0)
                     [ e                                  ]    e.v_1(0) = 0, with e along the cycle at t = 0
                     [                    C       -h F    ]
                     [ -P21 E0            E1 - P22 E0     ]
                     [                    e               ]

With the columns a and the rows e the trivial multiplier is left out: the matrix is singular where an eigenvalue of P is a
multiplier of the Poincare map. Without them it is singular where one is a multiplier of the cycle. (A phase condition under an
integral would not do in place of e: with u' of constant length, (t - 1/2) u' would satisfy it and all equations for P = -1.)

All of these matrices have C in common. With n rows H more, on the states at both ends, it is regular whatever P is, and is
factored once by condensation: A = [C; H]^-1. With a column b and a row c that may border each copy, v = A [r; 0] + K [y; a; g],
where r is the right side of C and y = H v. The columns of K solve C v = 0, C v = h F and C v = -b_C. The conditions remain,

                     [ E1 K - P E0 K + b_E ]
                     [ e K           + b_e ]  [y; a; g] = their right side - the same rows of A [r; 0]
                     [ c_v K         + c_a ]

with b_E, b_e and c_a in the columns of g, g and a: a dense matrix of n + 2 rows for each copy. The transposed matrix has the
same parts.

In the characteristic matrices and their forms (`contin.events.normal_forms`) time is measured in periods, s = t / T, so that
the field is G = T F; J, B and C are its derivatives of first, second and third order along the cycle. L(mu) v = v' - J v, with
v(1) = mu v(0) (with a symmetry of order n, over one n-th of the period, with S v(0) for v(0)). Near a bifurcation time goes on
by ds/dt = (1 - stretch) / T, but evenly with a forcing. The mean of |v|^2 over the period is one, and at folds v is normal to
u0' in the mean. Products with w are those of the discrete equations, so that the coefficients converge with the cycle.

With the derivatives A_j, B and C of a map f at the points of a cycle, L(mu) v = r stands for the cyclic linear equations

                     [ A_1  -1       ]  [ v_1 ]     [ r_1 ]
                     [      A_2  -1  ]  [ v_2 ] = - [ r_2 ],     |v_1| = 1 and w_k.v_1 = 1.
                     [ -mu       A_3 ]  [ v_3 ]     [ r_3 ]

For one point the coefficients are Kuznetsov's (sections 4.5, 4.7 and 5.4); for several they are those of f applied k times, at
the first point.
"""

from __future__ import annotations

import functools
from collections.abc import Callable
from typing import TYPE_CHECKING, Any

import numpy as np

from contin.arrays import Array, Numbers
from contin.core.differences import of_complex
from contin.draws import generator
from contin.events.normal_forms import DenseForm, Direction, Form
from contin.linalg.border import Borders
from contin.linalg.matrices import DenseFactors
from contin.problems.statement import PERIOD

if TYPE_CHECKING:
    from contin.cycles.equations import PeriodicCollocation
    from contin.cycles.map_equations import MapSystem


@functools.cache
def _rows(n: int) -> Array:
    """Return the rows H (n, 2 n) of states at both ends: in general position to those that the equations admit.

    With ten seeds, a normal form at 16 states changes by 1e-13 of its value.
    """
    return np.linalg.qr(generator("round").standard_normal((2 * n, n)))[0].T


class Collocated:
    """The collocation equations C of a cycle with the rows H: solves with the matrix [C; H].

    - ``free`` (ndarray, shape (n, states)): Solutions of C v = 0: the first has H v = (1, 0, ...).
    - ``inside`` (int): Number of rows of C.
    """

    def __init__(self, system: PeriodicCollocation, x: Array) -> None:
        n = system.states_count
        self._factors = system.with_conditions(x, _rows(n))
        self.inside = system.state_size - n
        right = np.zeros((n, system.state_size))
        right[:, self.inside :] = np.eye(n)
        self.free: Array = self._factors.solve(right)

    def solve(self, values: Array) -> Array:
        """Return the v (m, states) with C v = values (m, inside) and H v = 0."""
        right = np.zeros((len(values), self.inside + len(self.free)), dtype=values.dtype)
        right[:, : self.inside] = values
        return _by_parts(self._factors.solve, right)

    def solve_transposed(self, values: Array) -> Array:
        """Return the w (m, inside) with C^T w = values (m, states), for values that are normal to the solutions of C v = 0."""
        return _by_parts(self._factors.solve_transposed, values)[:, : self.inside]


def _by_parts(solve: Callable[[Array], Array], values: Array) -> Array:
    """Return the solutions of real equations with right-hand sides that may be complex."""
    if values.dtype.kind != "c":
        return solve(values)
    real, imaginary = solve(np.stack([values.real, values.imag]))
    return real + 1j * imaginary


class Solver:
    """Solves with the matrix of a round, bordered or not, and with its transpose; solutions are NaN where it is singular.

    Unknowns are [v_1, a_1, v_2, a_2, ... | g_1, g_2, ...]; equations are [those of each copy | the rows c of each copy].

    - ``around`` (Round)
    - ``coupling`` (ndarray, shape (copies, copies)): P.
    - ``border`` (pair of ndarray, shape (size,), optional): b and c of each copy.
    """

    def __init__(self, around: Round, coupling: Array, border: tuple[Array, Array] | None = None) -> None:
        self._round, self._collocated, self._coupling = around, around.collocated, coupling
        self._row = None if border is None else border[1][: around.states]
        inside, copies, n = self._collocated.inside, len(coupling), around.n
        columns = [self._collocated.free, *([around.free_by_period] if around.phased else [])]
        if border is not None:
            columns.append(-self._collocated.solve(border[0][None, :inside]))
        self._basis = np.concatenate(columns)  # K, its columns as rows
        every, traces = np.eye(copies), self._traces(self._basis)
        matrix = self._conditions(every[:, None, :, None] * traces[:, None]).transpose(2, 3, 0, 1).copy()
        if border is not None:
            for copy in range(copies):
                matrix[copy, : around.size - inside, copy, -1] += border[0][inside:]
                matrix[copy, -1, copy, n : n + around.phased] += border[1][around.states :]
        self._factors = DenseFactors(matrix.reshape(copies * matrix.shape[1], -1))

    def _traces(self, v: Array) -> Array:
        """Return what the conditions need of v (..., states): [v(0), v(1), c.v]."""
        n = self._round.n
        products = [] if self._row is None else [(v @ self._row)[..., None]]
        return np.concatenate([v[..., :n], v[..., -n:], *products], axis=-1)

    def _conditions(self, traces: Array) -> Array:
        """Return the left sides of the conditions of each copy, of traces (..., copies, :): at the ends, of e, of c."""
        n, around = self._round.n, self._round
        first, last = traces[..., :n], traces[..., n : 2 * n]
        values = [last - self._coupling @ (first @ around.system.turn.T)]
        if around.phased:
            values.append((first @ around.direction)[..., None])
        return np.concatenate([*values, traces[..., 2 * n :]], axis=-1)

    def solve(self, b: Array) -> Array:
        """Return the x with A x = b, or for rows of b the rows x."""
        if b.ndim == 2:
            return np.array([self.solve(row) for row in b])
        copies, size, inside, n = len(self._coupling), self._round.size, self._collocated.inside, self._round.n
        own, borders = b[: copies * size].reshape(copies, size), b[copies * size :].reshape(copies, -1)
        v, last, right = np.zeros(1), n + self._round.phased, np.concatenate([own[:, inside:], borders], axis=1)
        if own.any():
            v = self._collocated.solve(own[:, :inside])
            right = right - self._conditions(self._traces(v))
        y = self._factors.solve(right.ravel()).reshape(right.shape)
        return _joined(v + y @ self._basis, y[:, n:last], y[:, last:])

    def solve_transposed(self, c: Array) -> Array:
        """Return the y with A^T y = c, likewise."""
        if c.ndim == 2:
            return np.array([self.solve_transposed(row) for row in c])
        copies, around, n = len(self._coupling), self._round, self._round.n
        own, borders = c[: copies * around.size].reshape(copies, around.size), c[copies * around.size :].reshape(copies, -1)
        v, of_period = own[:, : around.states], own[:, around.states :]
        right = np.concatenate([np.zeros((copies, n)), of_period, borders], axis=1) + v @ self._basis.T
        y = self._factors.solve_transposed(right.ravel()).reshape(right.shape)
        rest = v.astype(y.dtype)
        rest[:, -n:] -= y[:, :n]
        rest[:, :n] += self._coupling.T @ y[:, :n] @ around.system.turn
        if around.phased:
            rest[:, :n] -= y[:, n, None] * around.direction
        if self._row is not None:
            rest = rest - y[:, -1:] * self._row
        ends = n + around.phased
        return _joined(self._collocated.solve_transposed(rest), y[:, :ends], y[:, ends:])


def _joined(one: Array, other: Array, last: Array) -> Array:
    """Return the rows of two arrays, each joined, and then those of a third."""
    return np.concatenate([np.concatenate([one, other], axis=1).ravel(), last.ravel()])


class Round:
    """The linearization of a cycle x over one round.

    - ``system`` (PeriodicCollocation)
    - ``x`` (ndarray, shape (size,))
    - ``phased`` (bool): With a change of the period and the condition at t = 0, so that the trivial multiplier is left out; of
      autonomous systems only.

    - ``size`` (int): Number of equations, and of unknowns, of one copy.
    """

    states: int
    n: int
    size: int
    collocated: Collocated

    def __init__(self, system: PeriodicCollocation, x: Array, phased: bool, collocated: Collocated | None = None) -> None:
        self.system, self.phased, self._x = system, phased, x
        self.states, self.n = system.state_size, system.states_count
        self.size = self.states + phased
        #: The factored collocation equations.
        self.collocated = collocated or Collocated(system, x)

    def with_period(self) -> Round:
        """Return the same with a change of the period and the condition at t = 0."""
        return Round(self.system, self._x, True, self.collocated)

    @functools.cached_property
    def direction(self) -> Array:
        """The row e, by the states at t = 0."""
        system: Any = self.system
        return system.start_direction

    @functools.cached_property
    def free_by_period(self) -> Array:
        """The v with C v = h F and H v = 0, shape (1, states)."""
        system: Any = self.system  # an autonomous one: F is proportional to the period
        rates = system.rates(self._x, system.at_gauss_points(self._x)) / self._x[system.parameter_index(PERIOD)]
        return self.collocated.solve((np.repeat(np.diff(system.mesh), system.degree)[:, None] * rates).reshape(1, -1))

    def solver(self, coupling: complex | Numbers, border: tuple[Array, Array] | None = None) -> Solver:
        """Return the solver of the matrix for P (k, k), bordered in each copy by a column b and a row c if these are given."""
        return Solver(self, np.array(coupling, ndmin=2), border)


#: Largest number of unknown states of a map: with twice as many, dense factors take eight times as long, a minute.
MOST = 2000


class RoundForm(Form):
    """The form of a cycle, of vector fields or maps: perturbations are multiplied in a round."""

    def coupling(self, rate: complex) -> Any:
        """Return the multiplier exp(rate); a real number where it is real but for round-off."""
        return np.real_if_close(np.exp(rate))[()]


class MapForm(RoundForm, DenseForm):
    """That of a cycle of a map.

    - ``system`` (MapSystem)
    - ``x`` (ndarray, shape (size,))
    """

    doubled_side = -1

    def __init__(self, system: MapSystem, x: Array) -> None:
        size, n = system.state_size, len(system.problem.state_names)
        matrix = system.jacobian(x)
        matrix[np.arange(size - n, size), np.arange(n)] += 1.0  # of the first point itself: P stands there
        super().__init__(matrix, n, lambda stacks: system.stack_along(x, stacks), system.weights[:size])

    def unit(self, rate: complex) -> complex:
        """Return one over the multiplier."""
        return complex(np.exp(-rate))


class CycleForm(RoundForm):
    """That of a cycle of a vector field.

    - ``system`` (PeriodicCollocation)
    - ``x`` (ndarray, shape (size,))
    """

    def __init__(self, system: PeriodicCollocation, x: Array) -> None:
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
        return (self.system.weights[:size] * self.system.unscaled_factors[:size] ** 2) @ (v[:size] * w[:size])

    def _direction(self, v: Numbers) -> Direction:
        """Return the states at the nodes, interpolated to the Gauss points, and the change of the period."""
        system, n, size = self.system, self.system.states_count, self.system.state_size
        local = v[:size].reshape(-1, n)[system.by_interval]
        states = np.einsum("qm,jma->jqa", system.basis.value, local).reshape(-1, n)
        return Direction(states, float(v[size]) / self._period if len(v) > size else 0.0)
