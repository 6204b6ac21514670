"""Scales: sizes of states and parameters, by which the unknowns of a discretized problem are divided.

All tolerances, steps and norms of the engine are made for unknowns of order one. A system with scales works on x = (u / s_u, p
/ s_p), and on equations divided by sizes of their own, so that a problem in newtons and one in giganewtons are the same
problem. Scales are powers of two: multiplication by them is exact.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from contin.arrays import Array, Indices, Pattern
from contin.functions.batch import Batch, Columns

#: Sizes between these bounds count as one: problems of everyday sizes are not scaled. Tolerances relative to 1 + |x| suit large
#: numbers, and small ones less.
USUAL = 1e-2, 1e3


@dataclass(frozen=True, eq=False)
class Scales:
    """Sizes of the states (n,), of all parameters, and of the equations that have a number of their own.

    ``rows`` are those of boundary conditions and integral conditions, or of the residual of an algebraic problem.
    """

    states: Array
    parameters: Array
    rows: dict[str, Array]

    def arrays(self) -> dict[str, Array]:
        """Return all sizes by name, for a file."""
        return {"states": self.states, "parameters": self.parameters, **self.rows}

    @classmethod
    def of_arrays(cls, arrays: dict[str, Array]) -> Scales:
        """Return the scales that `arrays` gave."""
        rows = {name: sizes for name, sizes in arrays.items() if name not in ("states", "parameters")}
        return cls(arrays["states"], arrays["parameters"], rows)


def usual(sizes: Array | float) -> Array:
    """Return sizes as powers of two; 1 for those of everyday size, and for zero, infinity and NaN."""
    sizes = np.abs(sizes)
    odd = np.isfinite(sizes) & (sizes > 0) & ((sizes < USUAL[0]) | (sizes > USUAL[1]))
    result: Array = np.where(odd, np.exp2(np.round(np.log2(np.where(odd, sizes, 1.0)))), 1.0)
    return result


class ScaledBatch:
    """A batch whose inputs and values are divided by their sizes.

    Parameters
    ----------
    batch : Batch
    states, parameters : ndarray
        Sizes of the inputs.
    values : ndarray, shape (count,)
        Sizes of the values.
    """

    def __init__(self, batch: Batch, states: Array, parameters: Array, values: Array) -> None:
        self._batch, self._states, self._parameters, self._values = batch, states, parameters, values

    @property
    def depends(self) -> Pattern:
        """Sparsity pattern."""
        return self._batch.depends

    def columns(self, free: Sequence[int] | Indices, order: Sequence[int] | Indices | None = None) -> Columns:
        """Return the columns of derivatives, as `Batch.columns`."""
        return self._batch.columns(free, order)

    def values(self, t: Array, u: Array, v: Array, p: Array) -> Array:
        """Return the values, shape (points, count)."""
        return self._batch.values(*self._given(t, u, v, p)) / self._values

    def jacobian(self, t: Array, u: Array, v: Array, p: Array, columns: Columns) -> tuple[Array, Array]:
        """Return values and derivatives, shape (points, count, columns.width)."""
        values, jacobian = self._batch.jacobian(*self._given(t, u, v, p), columns)
        return values / self._values, jacobian * self._inputs[columns.inputs] / self._values[:, None]

    def entries(self, t: Array, u: Array, v: Array, p: Array, columns: Columns) -> tuple[Array, Array]:
        """Return the values at one place and the entries of the Jacobian, as `Batch.entries`."""
        values, entries = self._batch.entries(*self._given(t, u, v, p), columns)
        return values / self._values, entries * self._inputs[columns.inputs[columns.places]] / self._values[columns.rows]

    def along(self, t: Array, u: Array, v: Array, p: Array, directions: Sequence[Array]) -> Array:
        """Return the derivative of the values along directions, as `Batch.along`."""
        along = [direction * self._inputs for direction in directions]
        return self._batch.along(*self._given(t, u, v, p), along) / self._values

    def jacobian_along(self, t: Array, u: Array, v: Array, p: Array, columns: Columns, directions: Sequence[Array]) -> Array:
        """Return the derivative of the Jacobian along directions, as `Batch.jacobian_along`."""
        along = [direction * self._inputs for direction in directions]
        jacobian = self._batch.jacobian_along(*self._given(t, u, v, p), columns, along)
        return jacobian * self._inputs[columns.inputs] / self._values[:, None]

    def bent(self, t: Array, u: Array, v: Array, p: Array, weights: Array, direction: Array, columns: Columns) -> Array:
        """Return the gradient of w.(J d), as `Batch.bent`."""
        found = self._batch.bent(*self._given(t, u, v, p), weights / self._values, direction * self._inputs, columns)
        return found * self._inputs[columns.inputs]

    def _given(self, t: Array, u: Array, v: Array, p: Array) -> tuple[Array, Array, Array, Array]:
        """Return the arguments of the batch in the user's units."""
        return t, u * self._states, v * self._states, p * self._parameters

    @property
    def _inputs(self) -> Array:
        """Sizes of all inputs."""
        return np.concatenate([self._states, *([self._states] if self._batch.signature.ends else []), self._parameters])
