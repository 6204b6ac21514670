"""The characteristic matrix A - z B of a steady state of fields, and its forms: Re d / omega is the first Lyapunov coefficient.

A and B are those of `contin.boundary.fields`: on the mesh B x' = F(x), so that w.B v = 1 of the critical vectors
(`contin.events.normal_forms`). The mean of |v|^2 over the domain is one, of the states whose rates occur.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from contin.arrays import Array, Numbers
from contin.events.normal_forms import DenseForm
from contin.linalg.border import Borders
from contin.linalg.sparse import SparseFactors


class FieldForm(DenseForm):
    """That of a steady state of fields.

    Parameters
    ----------
    system : Fields
    x : ndarray, shape (size,)
    """

    def __init__(self, system: Any, x: Array) -> None:
        pencil, held = system.pencil(x), system.size - system.equations
        self._system, self._x, self._matrix, self._rates = system, x, pencil.matrix, pencil.into @ pencil.rates
        self.places = np.append(np.arange(system.state_size), np.arange(system.state_size + held, system.size))
        self.equations, self.weights = system.equations, system.weights[self.places]

    def solver(self, coupling: complex | Numbers, border: Borders | None = None) -> Any:
        """Return LU factors of L(P)."""
        from scipy.sparse import block_array, csc_array, kron  # type: ignore[import-untyped]  # .1 s

        small = np.atleast_2d(coupling)
        one = np.eye(len(small))
        matrix = kron(one, self._matrix) - kron(small, self._rates)
        if border is None:
            return SparseFactors(csc_array(matrix))
        columns, rows = (kron(one, csc_array(each[:, None])) for each in border)
        return SparseFactors(csc_array(block_array([[matrix, columns], [rows.T, None]])), borders=len(small))

    def coupled_parts(self, left: Numbers, right: Numbers) -> tuple[Numbers, Numbers]:
        """Return w and B v."""
        return left, (self._rates @ right.T).T

    def coupled_gradient(self, left: Array, right: Array) -> Array:
        """Return the derivatives of the sum of w.B v over the copies by x: coefficients of rates depend on parameters."""
        system, wide = self._system, np.zeros(self._system.size)
        found = np.zeros(system.size)
        for w, v in zip(left, right):
            wide[self.places] = v
            found += system.rates_gradient(self._x, w, wide)
        return found

    def _along(self, stacks: Any) -> Array:
        system = self._system
        wide = [np.zeros((len(stack), system.size)) for stack in stacks]
        for each, stack in zip(wide, stacks):
            each[:, self.places] = stack
        return np.array([system.along(self._x, parts) for parts in zip(*wide)])

    def coupling(self, rate: complex) -> Any:
        """Return the rate itself."""
        return rate if rate.imag else rate.real

    def unit(self, rate: complex) -> complex:
        """Return one over the frequency."""
        return 1j / rate

    def length(self, right: Numbers) -> float:
        """Return the root of the mean of |v|^2 over the states with rates, in the user's units."""
        system, count = self._system, self._system.state_size
        moving = np.tile(system.moving_states, count // len(system.moving_states))
        squares = np.abs(right[:count] * system.unscaled_factors[:count]) ** 2
        return float(np.sqrt((system.weights[:count] * squares) @ moving))
