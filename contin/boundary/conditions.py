"""Collocation with conditions beyond those of the problem: each is a row of its own, and may depend on all unknowns."""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Sequence

import numpy as np

from contin.arrays import Array
from contin.boundary.system import Collocation
from contin.linalg.factors import Factors


class Conditioned(Collocation):
    """A boundary value problem on a mesh, and further conditions, which come last in the residual.

    Subclasses add the number of them to ``equations`` and say what they are.
    """

    @abstractmethod
    def condition_values(self, x: Array) -> Array:
        """Return the quantities that vanish besides, shape (q,)."""

    @abstractmethod
    def conditions_with_rows(self, x: Array) -> tuple[Array, Array]:
        """Return them, and their derivatives by x, shape (q, size)."""

    @abstractmethod
    def condition_columns(self, x: Array, names: Sequence[str]) -> Array:
        """Return their derivatives by any parameters, shape (q, len(names))."""

    @property
    def linear_conditions(self) -> tuple[Array, Array] | None:
        """None: they may depend on the unknowns in any way."""
        return None

    def conditions_along(self, x: Array, directions: Sequence[Array]) -> Array:
        """Return their derivative along two or three directions, shape (q,); 0 where they are linear."""
        return np.zeros(self.equations - self._conditions)

    def conditions_bent(self, x: Array, w: Array, v: Array) -> Array:
        """Return the gradient of their derivative along v, multiplied by w (q,), shape (size,); 0 where they are linear."""
        return np.zeros(self.size)

    def residual(self, x: Array) -> Array:
        """Return the residual of the discrete equations at x, the further conditions last."""
        return np.concatenate([super().residual(x), self.condition_values(x)])

    def linearize(
        self, x: Array, rows: Sequence[Array] | Array = (), columns: Sequence[Array] | Array = ()
    ) -> tuple[Array, Factors]:
        """Return the residual at x, and the factored matrix [[F_x, columns^T], [rows]]; see ``Collocation.linearize``."""
        rows = np.array(rows, dtype=float).reshape(-1, self.size + len(columns))
        columns = np.array(columns, dtype=float).reshape(-1, self.equations)
        values, own = self.conditions_with_rows(x)
        if len(columns):
            own = np.concatenate([own, columns[:, self._conditions :].T], axis=1)
        inside = np.ascontiguousarray(columns[:, : self._conditions])
        residual, factors = self._linearized(x, np.concatenate([own, rows]), inside)
        return np.concatenate([residual, values]), factors

    def parameter_columns(self, x: Array, names: Sequence[str]) -> Array:
        """Return the derivatives of the residual by any parameters, shape (equations, len(names))."""
        return np.vstack([super().parameter_columns(x, names), self.condition_columns(x, names)])

    def transposed_product(self, x: Array, w: Array) -> Array:
        """Return F_x^T w, shape (size,)."""
        own = self.conditions_with_rows(x)[1]
        return super().transposed_product(x, w[: self._conditions]) + own.T @ w[self._conditions :]

    def along(self, x: Array, directions: Sequence[Array]) -> Array:
        """Return the derivative of F along several directions, shape (equations,)."""
        return np.concatenate([super().along(x, directions), self.conditions_along(x, directions)])

    def bent(self, x: Array, w: Array, v: Array) -> Array:
        """Return the gradient of w.(F_x v), shape (size,)."""
        return super().bent(x, w, v) + self.conditions_bent(x, w[self._conditions :], v)
