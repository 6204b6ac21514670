"""The linearization of a cycle over one round, with any condition between its ends.

With a symmetry S of the cycle a round is one n-th of the period, and E0 in the conditions stands for S E0.

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
"""

from __future__ import annotations

import functools
from typing import Any

import numpy as np

from contin.arrays import Array, Indices
from contin.discretization.cycles import CycleCollocation, PeriodicCollocation
from contin.problems.cycle import PERIOD


class Solver:
    """Solves with a sparse square matrix, real or complex, and with its transpose; solutions are NaN where it is singular."""

    def __init__(self, matrix: Any) -> None:
        from scipy.sparse.linalg import splu  # type: ignore[import-untyped]  # takes .6 s to load

        self.size = matrix.shape[0]
        try:
            self._factors: Any = splu(matrix)
        except (RuntimeError, ValueError):  # exactly singular, or not finite
            self._factors = None

    def solve(self, b: Array) -> Array:
        """Return the x with A x = b."""
        return self._solved(b, "N")

    def solve_transposed(self, c: Array) -> Array:
        """Return the y with A^T y = c."""
        return self._solved(c, "T")

    def _solved(self, b: Array, transposed: str) -> Array:
        if self._factors is None:
            return np.full(self.size, np.nan)
        solution: Array = self._factors.solve(b, transposed)
        return solution


class Round:
    """The linearization of a cycle x over one round.

    Parameters
    ----------
    system : PeriodicCollocation
    x : ndarray, shape (size,)
    phased : bool
        With a change of the period and the condition at t = 0, so that the trivial multiplier is left out; of autonomous
        systems only.

    Attributes
    ----------
    size : int
        Number of equations, and of unknowns, of one copy.
    """

    def __init__(self, system: PeriodicCollocation, x: Array, phased: bool) -> None:
        self.system, self.phased = system, phased
        self.states = system.state_size
        self.size = self.states + phased
        self._matrices = system.interval_matrices(x)
        if phased:
            assert isinstance(system, CycleCollocation)
            self._period, self._direction = system.parameter_columns(x, (PERIOD,))[:, 0], system.start_direction

    @property
    def ends(self) -> slice:
        """Place of the condition between the ends among the equations of one copy."""
        n = len(self.system.problem.state_names)
        return slice(self.states - n, self.states)

    def solver(self, coupling: Array, b: Array | None = None, c: Array | None = None) -> Solver:
        """Return the solver of the matrix for P (k, k), bordered in each copy by a column b and a row c if these are given."""
        from scipy import sparse  # type: ignore[import-untyped]  # as above

        coupling, size = np.atleast_2d(coupling), self.size
        copies, turn = len(coupling), sparse.coo_array(self.system.turn)
        values, rows, columns = [], [], []

        def put(entries: Array, i: Indices, j: Indices) -> None:
            values.append(entries)
            rows.append(i)
            columns.append(j)

        (ends, starts), every = turn.coords, np.arange(size)
        for copy in range(copies):
            at = copy * size
            entries, i, j = self._collocation
            put(entries, i + at, j + at)
            for other in range(copies):
                put(-coupling[copy, other] * turn.data, at + self.ends.start + ends, other * size + starts)
            if b is not None and c is not None:
                last = np.full(size, copies * size + copy)
                put(b, at + every, last)
                put(c, last, at + every)
        total = copies * (size + (b is not None))
        where = np.concatenate(rows), np.concatenate(columns)
        return Solver(sparse.csc_array((np.concatenate(values), where), (total, total)))

    @functools.cached_property
    def _collocation(self) -> tuple[Array, Indices, Indices]:
        """Entries of the matrix of one copy but for what P multiplies, with their rows and columns."""
        count, rows, columns = self._matrices.shape
        at = rows * np.arange(count)[:, None, None]
        n, end = len(self.system.problem.state_names), self.states
        i = np.broadcast_to(at + np.arange(rows)[None, :, None], self._matrices.shape).ravel()
        j = np.broadcast_to(at + np.arange(columns)[None, None, :], self._matrices.shape).ravel()
        last = np.arange(end - n, end)
        values, places = [self._matrices.ravel(), np.ones(n)], [(i, j), (last, last)]
        if self.phased:
            values += [self._period, self._direction]
            places += [(np.arange(end + 1), np.full(end + 1, end)), (np.full(n, end), np.arange(n))]
        return np.concatenate(values), np.concatenate([row for row, _ in places]), np.concatenate([j for _, j in places])
