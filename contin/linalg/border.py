"""Null vectors of a nearly singular matrix A, from columns b and rows c that make it regular (Griewank & Reddien 1984):

                            x      beta
                         [  A      b  ]  [ v_i ]   [ 0   ]
                         [  c      0  ]  [ g_i ] = [ e_i ]           and w_i, the same of the transposed matrix.

The numbers g vanish where A v = 0; dg_i = -w.dA v_i. Borders of the null vectors themselves are the best conditioned. Random
ones come first, then those that their solutions make, which is inverse iteration. Where they follow null vectors that turn,
the determinant of the bordered matrix keeps its sign, and so do v, w and g. Rows about a whole space are renewed at accepted
points of a run only: made at an iterate of Newton's method that is far away they may point the other way.
"""

from __future__ import annotations

import functools
from collections.abc import Callable
from typing import Any, Protocol

import numpy as np

from contin.arrays import Array, Numbers
from contin.draws import generator

#: Rounds of inverse iteration from random borders; each divides the error by the ratio of the smallest singular values. With
#: ten, the curves of the tests are the same.
_ROUNDS = 3
#: Least cosine between a border and the null vector that it stands for: .7 of a complex vector, of which a border is the
#: largest real part, 0 where the bordered matrix is singular. Ten times smaller, the curves of the tests are the same.
FITS = 0.5

#: A column b and a row c.
Borders = tuple[Array, Array]


class Solves(Protocol):
    """Solves with a matrix and with its transpose, for right-hand sides as rows."""

    def solve(self, b: Array) -> Array:
        """Return the x with A x = b."""

    def solve_transposed(self, c: Array) -> Array:
        """Return the y with A^T y = c."""


class Bordered:
    """A bordered matrix, factored.

    Parameters
    ----------
    factors : Solves
        Of the bordered matrix. Other equations may stand between those of A and the rows c: their right sides are zero.
    shape : tuple of int
        Numbers of equations and of unknowns of A.
    columns, rows, held : int
        Numbers of columns b and rows c, and of other rows before these.

    Examples
    --------
    >>> from contin.linalg.dense import DenseFactors
    >>> found = Bordered(DenseFactors(np.array([[0.0, 0.0, 1.0], [2.0, 0.0, 0.0], [0.0, 1.0, 0.0]])), (2, 2))
    >>> found.right.tolist(), found.g.tolist(), found.left.tolist()
    ([[0.0, 1.0]], [[0.0]], [[1.0, 0.0]])
    """

    def __init__(self, factors: Any, shape: tuple[int, int], columns: int = 1, rows: int = 1, held: int = 0) -> None:
        self.factors, self._shape, self._columns, self._rows, self._held = factors, shape, columns, rows, held

    @functools.cached_property
    def solutions(self) -> Array:
        """Those for the unit vectors of all rows besides A, shape (held + rows, unknowns + columns)."""
        return np.asarray(self.factors.solve(_units(self._shape[1] + self._columns, self._held + self._rows)))

    @property
    def right(self) -> Array:
        """v, shape (rows, unknowns)."""
        return self.solutions[self._held :, : self._shape[1]]

    @property
    def g(self) -> Array:
        """g, shape (rows, columns)."""
        return self.solutions[self._held :, self._shape[1] :]

    @functools.cached_property
    def transposed(self) -> Array:
        """w and what belongs to the other rows, shape (columns, all equations)."""
        return np.asarray(self.factors.solve_transposed(_units(self._shape[1] + self._columns, self._columns)))

    @property
    def left(self) -> Array:
        """w, shape (columns, equations)."""
        return self.transposed[:, : self._shape[0]]


def _units(size: int, count: int) -> Array:
    """Return the last unit vectors as rows."""
    units = np.zeros((count, size))
    units[:, size - count :] = np.eye(count)
    return units


def null_vectors(
    bordered: Callable[[Array, Array], Bordered],
    shape: tuple[int, int],
    borders: Borders | None = None,
    weights: Array | float = 1.0,
    single: Callable[[Bordered], tuple[Any, Any]] = lambda found: (found.left[0], found.right[0]),
) -> tuple[Bordered, Borders]:
    """Return the bordered matrix with borders that fit its null vectors, and these borders.

    Parameters
    ----------
    bordered : callable
        ``bordered(b, c)`` returns the matrix with these borders.
    shape : tuple of int
        Lengths of b and c.
    borders : pair of ndarray, optional
        Those to begin with; random ones by default.
    weights : ndarray, shape (unknowns,)
        Of the inner product in which c is a vector.
    single : callable
        Returns the left and the right null vector, which may be complex.
    """
    if borders is None:
        random = generator("border")
        borders = random.standard_normal(shape[0]), random.standard_normal(shape[1])
    found, root = bordered(*borders), np.sqrt(weights)
    for _ in range(_ROUNDS):
        left, right = single(found)
        if not min(cosine(borders[0], left), cosine(borders[1] / root, right * root)) < FITS:
            break
        borders = _largest_part(left), _largest_part(right * root) * root
        found = bordered(*borders)
    return found, borders


def rows_fit(tangents: Array, weights: Array) -> bool:
    """Return whether tangents have not turned away from orthonormal rows that have the product 1 with them."""
    longest = np.sqrt((weights * tangents**2).sum(axis=1).max())  # 1 where each lies along its row
    return not 1 / longest < FITS


def cosine(a: Array, b: Numbers) -> float:
    """Return the absolute cosine between a real vector and a real or complex one."""
    return float(abs(a @ b) / np.sqrt((a @ a) * float(np.vdot(b, b).real)))


def orthonormal(vectors: Array, weights: Array | float = 1.0) -> Array:
    """Return an orthonormal basis of the space of some vectors, in a weighted inner product and with their orientation.

    Determinants of equations that are stated on the basis keep their sign when borders are renewed.

    Parameters
    ----------
    vectors : ndarray, shape (k, size)
    weights : ndarray, shape (size,)
    """
    root = np.sqrt(weights)
    columns, triangle = np.linalg.qr((vectors * root).T)
    basis: Array = (columns * np.copysign(1.0, np.diag(triangle))).T / root
    return np.ascontiguousarray(basis)


def _largest_part(vector: Numbers) -> Array:
    """Return the real part, of unit length, of a vector: of a complex one, turned so that its real part is the largest."""
    if np.iscomplexobj(vector):
        vector = (vector * np.exp(-0.5j * np.angle(vector @ vector))).real
    return vector / np.linalg.norm(vector)
