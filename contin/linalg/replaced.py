"""Factors of a matrix from those of another one, which has other last rows, and further columns beside:

                    [ A    B ]                      [ A ]
                M = [        ],          wanted:    [   ]         M^-1 [ 0; I ] = [ D; E ],
                    [ R    0 ]                      [ T ]

The solutions of A x = a, T x = t are x = x_0 + D y, with M [x_0; s_0] = [a; 0], and the small system

                [ T D ]       [ t - T x_0 ]
                [  E  ] y  =  [   - s_0   ]          whose determinant times that of M is the one that is wanted.

Where M is regular everywhere, it is the small matrix that becomes singular.
"""

from __future__ import annotations

import functools

import numpy as np

from contin.arrays import Array
from contin.linalg.dense import DenseFactors
from contin.linalg.factors import Factors


class ReplacedRows:
    """Solves with the wanted matrix, and with its transpose.

    Parameters
    ----------
    factors : Factors
        Of M.
    solutions : ndarray, shape (m, size + columns)
        Those for the last m unit vectors: D and E, as rows.
    rows : ndarray, shape (m - columns, size)
        T.

    Examples
    --------
    >>> other = DenseFactors(np.array([[1.0, 2.0], [0.0, 1.0]]))
    >>> found = ReplacedRows(other, other.solve(np.array([[0.0, 1.0]])), np.array([[3.0, 4.0]]))
    >>> found.solve(np.array([5.0, 11.0])).round(12).tolist(), found.sign
    ([1.0, 2.0], -1.0)
    """

    def __init__(self, factors: Factors, solutions: Array, rows: Array) -> None:
        self.size, self.others = rows.shape[1], solutions.shape[1] - len(solutions)
        self.factors, self.rows, self._added = factors, rows, solutions[:, : self.size]
        self.small = np.vstack([rows @ self._added.T, solutions[:, self.size :].T])

    @functools.cached_property
    def _small(self) -> DenseFactors:
        return DenseFactors(self.small)

    @property
    def sign(self) -> float:
        """Sign of the determinant."""
        return self.factors.sign * self._small.sign

    def solve(self, b: Array) -> Array:
        """Return the x with J x = b, or for rows of b the rows x."""
        right = np.concatenate([b[..., self.others :], np.zeros((*b.shape[:-1], len(self.small) - len(self.rows)))], axis=-1)
        if not b[..., : self.others].any():
            return np.asarray(self._small.solve(right) @ self._added)
        first = self.factors.solve(np.concatenate([b[..., : self.others], np.zeros_like(right)], axis=-1))
        right -= np.concatenate([first[..., : self.size] @ self.rows.T, first[..., self.size :]], axis=-1)
        return np.asarray(first[..., : self.size] + self._small.solve(right) @ self._added)

    def solve_transposed(self, c: Array) -> Array:
        """Return the y with J^T y = c, likewise."""
        last = self._small.solve_transposed(c @ self._added.T)
        own, beside = last[..., : len(self.rows)], last[..., len(self.rows) :]
        y = self.factors.solve_transposed(np.concatenate([c - own @ self.rows, -beside], axis=-1))
        return np.concatenate([y[..., : self.others], own], axis=-1)
