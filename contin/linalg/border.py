"""Null vectors of nearly singular matrices, from bordered ones, and factors of a matrix with other last rows.

Null vectors of a nearly singular matrix A, from columns b and rows c that make it regular (Griewank & Reddien 1984):

                            x      beta
                         [  A      b  ]  [ v_i ]   [ 0   ]
                         [  c      0  ]  [ g_i ] = [ e_i ]           and w_i, the same of the transposed matrix.

The numbers g vanish where A v = 0; dg_i = -w.dA v_i. Borders of the null vectors themselves are the best conditioned. Random
ones come first, then those that their solutions make, which is inverse iteration. Where they follow null vectors that turn,
the determinant of the bordered matrix keeps its sign, and so do v, w and g. Rows about a whole space are renewed at accepted
points of a run only: made at an iterate of Newton's method that is far away they may point the other way.

Factors of a matrix from those of another one, which has other last rows, and further columns beside:

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
import math
from collections.abc import Callable
from typing import Any, Protocol

import numpy as np

from contin.arrays import Array, Numbers
from contin.draws import generator
from contin.kernels.kernel import kernel
from contin.kernels.kernel_parts import Matrix, helper
from contin.linalg.blocks import Factors
from contin.linalg.matrices import DenseFactors

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

    - ``factors`` (Solves): Of the bordered matrix. Other equations may stand between those of A and the rows c: their right
      sides are zero.
    - ``shape`` (tuple of int): Numbers of equations and of unknowns of A.
    - ``columns``, ``rows``, ``held`` (int): Numbers of columns b and rows c, and of other rows before these.

    Examples
    --------
    >>> from contin.linalg.matrices import DenseFactors
    >>> found = Bordered(DenseFactors(np.array([[0.0, 0.0, 1.0], [2.0, 0.0, 0.0], [0.0, 1.0, 0.0]])), (2, 2))
    >>> found.right.tolist(), found.g.tolist(), found.left.tolist()
    ([[0.0, 1.0]], [[0.0]], [[1.0, 0.0]])
    """

    def __init__(self, factors: Any, shape: tuple[int, int], columns: int = 1, rows: int = 1, held: int = 0) -> None:
        self.factors, self._shape, self._columns, self._rows, self._held = factors, shape, columns, rows, held

    @functools.cached_property
    def solutions(self) -> Array:
        """Those for the unit vectors of all rows besides A, shape (held + rows, unknowns + columns)."""
        return np.asarray(self.factors.solve(last_units(self._shape[1] + self._columns, self._held + self._rows)))

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
        return np.asarray(self.factors.solve_transposed(last_units(self._shape[1] + self._columns, self._columns)))

    @property
    def left(self) -> Array:
        """w, shape (columns, equations)."""
        return self.transposed[:, : self._shape[0]]


@functools.lru_cache(maxsize=8)
def last_units(size: int, count: int) -> Array:
    """Return the last unit vectors as rows: not to be written to."""
    units = np.eye(count, size, size - count)
    units.flags.writeable = False
    return units


def null_vectors(
    bordered: Callable[[Array, Array], Bordered], shape: tuple[int, int], borders: Borders | None = None,
    weights: Array | float = 1.0, single: Callable[[Bordered], tuple[Any, Any]] = lambda found: (found.left[0], found.right[0]),
) -> tuple[Bordered, Borders]:  # fmt: skip
    """Return the bordered matrix with borders that fit its null vectors, and these borders.

    - ``bordered`` (callable): ``bordered(b, c)`` returns the matrix with these borders.
    - ``shape`` (tuple of int): Lengths of b and c.
    - ``borders`` (pair of ndarray, optional): Those to begin with; random ones by default.
    - ``weights`` (ndarray, shape (unknowns,)): Of the inner product in which c is a vector.
    - ``single`` (callable): Returns the left and the right null vector, which may be complex.
    """
    if borders is None:
        random = generator("border")
        borders = random.standard_normal(shape[0]), random.standard_normal(shape[1])
    found = bordered(*borders)
    for _ in range(_ROUNDS):
        (b, c), (left, right) = borders, single(found)  # their products are one
        lengths = (b @ b) * np.vdot(left, left).real, (c / weights @ c) * np.vdot(right * weights, right).real
        if not 1 < FITS**2 * max(lengths) < math.inf:
            break
        borders = _largest_part(left), _largest_part(right * np.sqrt(weights)) * np.sqrt(weights)
        found = bordered(*borders)
    return found, borders


def rows_fit(tangents: Array, weights: Array) -> bool:
    """Return whether tangents have not turned away from orthonormal rows that have the product 1 with them."""
    return not 1 / np.sqrt((weights * tangents**2).sum(axis=1).max()) < FITS  # the root is 1 where each lies along its row


def cosine(a: Array, b: Numbers) -> float:
    """Return the absolute cosine between a real vector and a real or complex one; 0 where one has no length."""
    return float(abs(a @ b) / (math.sqrt(float(a @ a) * float(np.vdot(b, b).real)) or 1.0))


def orthonormal(vectors: Array, weights: Array | float = 1.0) -> Array:
    """Return an orthonormal basis of the space of vectors (k, size), in a weighted inner product and with their orientation.

    Determinants of equations that are stated on the basis keep their sign when borders are renewed.
    """
    basis: Array = np.multiply(vectors, root := np.sqrt(weights), order="C")
    orthonormalize(basis, 0)
    return basis / root


def _largest_part(vector: Numbers) -> Array:
    """Return the real part, of unit length, of a vector: of a complex one, turned so that its real part is the largest."""
    if np.iscomplexobj(vector):
        vector = (vector * np.exp(-0.5j * np.angle(vector @ vector))).real
    return vector / np.linalg.norm(vector)


@functools.lru_cache(maxsize=8)
def random_rows(count: int, size: int) -> Array:
    """Return rows to start an iteration from, shape (count, size), always the same: not to be written to."""
    block = generator("singular").standard_normal((count, size))
    block.flags.writeable = False
    return block


@helper
def orthonormalize_row(rows, i):
    """Make a row orthonormal to those before, which are orthonormal: Gram-Schmidt, twice where little of the row is left."""
    size = rows.shape[1]
    largest, square = 0.0, 0.0
    for k in range(size):
        largest = max(largest, abs(rows[i, k]))
    for k in range(size):  # near a bifurcation solutions are huge
        rows[i, k] /= largest
        square += rows[i, k] * rows[i, k]
    for _ in range(2):
        before, square = square, 0.0
        for j in range(i):
            product = 0.0
            for k in range(size):
                product += rows[j, k] * rows[i, k]
            for k in range(size):
                rows[i, k] -= product * rows[j, k]
        for k in range(size):
            square += rows[i, k] * rows[i, k]
        if square >= 0.5 * before:  # otherwise what is left is partly round-off
            break
    for k in range(size):
        rows[i, k] /= np.sqrt(square)


@kernel
def orthonormalize(rows: Matrix, first: int) -> None:
    """Make the rows from ``first`` on orthonormal, and orthogonal to those before, which are: in place."""
    for i in range(first, rows.shape[0]):
        orthonormalize_row(rows, i)


@kernel
def fill_products(one: Matrix, other: Matrix, known: int, count: int, products: Matrix) -> None:
    """Fill one[i].other[j] for i, j < ``count``, in place, where not both are less than ``known``; both are multiples of four.

    BLAS gives products of this size to several threads: on a busy machine they wait for each other, a thousand times as long as
    the products take.
    """
    size = one.shape[1]
    for i in range(count):
        row = one[i]
        for j in range(known if i < known else 0, count, 4):
            a, b, c, d = 0.0, 0.0, 0.0, 0.0
            for k in range(size):
                a += row[k] * other[j, k]
                b += row[k] * other[j + 1, k]
                c += row[k] * other[j + 2, k]
                d += row[k] * other[j + 3, k]
            products[i, j], products[i, j + 1], products[i, j + 2], products[i, j + 3] = a, b, c, d


def smallest_directions(factors: Factors, size: int, count: int, rounds: int = 2) -> tuple[Array, Array, Array]:
    """Return right and left singular vectors of the ``count`` smallest singular values, as rows, by block inverse iteration.

    It starts from random vectors, not from those of the point before: a resumed run must decide as one that was never
    interrupted. Third is right J^-1 left^T, shape (count, count): about the reciprocals of the singular values.
    """
    right = random_rows(min(count, size), size)
    for _ in range(rounds):
        left = factors.solve_transposed(right)
        orthonormalize(left, 0)
        solved = factors.solve(left)
        right = solved.copy()
        orthonormalize(right, 0)
    return right, left, right @ solved.T


class ReplacedRows:
    """Solves with the wanted matrix, and with its transpose.

    - ``factors`` (Factors): Of M.
    - ``solutions`` (ndarray, shape (m, size + columns)): Those for the last m unit vectors: D and E, as rows.
    - ``rows`` (ndarray, shape (m - columns, size)): T.

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
        self.small = np.concatenate([rows @ self._added.T, solutions[:, self.size :].T])

    @functools.cached_property
    def _small(self) -> DenseFactors:
        return DenseFactors(self.small)

    @property
    def sign(self) -> float:
        """Sign of the determinant."""
        return self.factors.sign * self._small.sign

    def solve(self, b: Array) -> Array:
        """Return the x with J x = b, or for rows of b the rows x."""
        count, others = len(self.rows), self.others
        given, right = np.zeros((*b.shape[:-1], others + len(self.small))), np.zeros((*b.shape[:-1], len(self.small)))
        right[..., :count], given[..., :others] = b[..., others:], b[..., :others]
        if not given.any():
            return np.asarray(self._small.solve(right) @ self._added)
        first = self.factors.solve(given)
        right[..., :count] -= first[..., : self.size] @ self.rows.T
        right[..., count:] -= first[..., self.size :]
        return np.asarray(first[..., : self.size] + self._small.solve(right) @ self._added)

    def solve_transposed(self, c: Array) -> Array:
        """Return the y with J^T y = c, likewise."""
        last = self._small.solve_transposed(c @ self._added.T)
        own, beside = last[..., : len(self.rows)], last[..., len(self.rows) :]
        y = self.factors.solve_transposed(np.concatenate([c - own @ self.rows, -beside], axis=-1))
        return np.concatenate([y[..., : self.others], own], axis=-1)
