"""Factorization of the matrix of a collocation step by condensation, with partial pivoting throughout.

The matrix is drawn in `contin.linalg.layout.Blocks`. It is eliminated in three stages:

1. in each interval, the interior unknowns, group by group (`Layout`); the border rows are reduced along with it;
2. in each segment, the mesh points inside, one after the other, each from the 2 n rows that contain it; border rows as before;
3. the dense rest: the mesh points where segments begin or end, and the parameters; n rows are left of each segment.

A matrix that is not large is one segment (`contin.linalg.segments`): the rest has the first and the last mesh point.

This is the scheme of de Boor & Weiss (1980) in the order that AUTO uses. It takes N (n d)^3 operations and N (n d)^2 numbers;
solves with the matrix and with its transpose only substitute, in `contin.linalg.substitution`.
"""

from __future__ import annotations

import functools
import math
from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from contin.arrays import Array
from contin.functions.kernel_parts import Matrix, Stack
from contin.linalg.elimination import Eliminated, factorize
from contin.linalg.ends import Relations, relations_of
from contin.linalg.layout import Blocks, Layout
from contin.linalg.segments import Share, is_large, run, share
from contin.linalg.substitution import solve, solve_transposed, work_size
from contin.linalg.vector import LANES


class Factored(NamedTuple):
    """Where a factored matrix stands. ``corners`` (S, r, k) and ``carried`` (S, n + r, 2 n + k) are those of `factorize`.

    ``first`` and ``last`` are the boundary conditions of the `Blocks`, ``work`` is that of solves, one at a time.
    """

    factors: Eliminated
    corners: Stack
    first: Matrix
    last: Matrix
    carried: Stack
    work: Matrix


class Factorization:
    """A factored bordered almost-block-diagonal matrix: solves, transposed solves, sign of the determinant.

    Vectors of unknowns are [mesh and interior values in order | parameters]; vectors of equations are
    [collocation | boundary | border rows].

    Parameters
    ----------
    layout : Layout
        Order of rows and columns in an interval's block.
    blocks : Blocks
        The matrix; ``local``, ``border`` and ``corner`` are overwritten.
    whole : Share, optional
        Its segments; by default as many as suit its size.

    Raises
    ------
    ValueError
        If the matrix is not square.
    """

    def __repr__(self) -> str:
        return f"{type(self).__name__}(sign of the determinant {self.sign:g})"

    def __init__(self, layout: Layout, blocks: Blocks, whole: Share | None = None) -> None:
        self._take(layout, blocks, whole)
        factors, corners, first, last, carried, _ = self.room
        given = layout, factors, corners, first, last, carried
        self.sign = math.prod(run(factorize, given, self._whole, (True, False)))

    @classmethod
    def unfilled(cls, layout: Layout, blocks: Blocks, whole: Share | None = None) -> Factorization:
        """Return one of this shape, with ``room`` in which a kernel factors a matrix; it then sets the ``sign``."""
        found = cls.__new__(cls)
        found._take(layout, blocks, whole)
        return found

    def _take(self, layout: Layout, blocks: Blocks, whole: Share | None = None) -> None:
        local, border, corner, first, last = blocks
        intervals, rows, _ = local.shape
        (r, k), (conditions, n) = corner.shape, first.shape
        if conditions + r != n + k:
            raise ValueError(f"{conditions} boundary conditions and {r} border rows for {n} states and {k} parameters")
        self._layout, self._whole = layout, whole or share(intervals, local.size)
        segments = self._whole.last
        size = (segments + 1) * n + k
        eliminated = Eliminated(
            local, border, np.empty((max(intervals - 1, 0), 2 * n + r, 3 * n + k)), np.empty((size, size)),
            np.empty((intervals, rows), np.int64), np.empty(size, np.int64),
        )  # fmt: skip
        corners = corner[None] if segments == 1 else np.concatenate([corner[None], np.empty((segments - 1, r, k))])
        work = np.empty((work_size(segments, intervals, rows, n, r, k), LANES))
        self.unknowns = intervals * rows + n + k
        self.room = Factored(eliminated, corners, first, last, np.empty((segments, n + r, 2 * n + k)), work)
        #: Sign of the determinant up to a factor that depends on the shape only.
        self.sign = math.nan

    @functools.cached_property
    def ends(self) -> Relations | None:
        """What is left between both ends of the mesh; None for a single interval, and for large matrices."""
        factors, _, first, last, carried, _ = self.room
        if len(factors.local) == 1 or is_large(factors.local.size):
            return None
        return relations_of(self._layout.offsets, factors, carried, first, last, self._whole.starts)

    def solve(self, b: Array) -> Array:
        """Return the x (unknowns,) with J x = b (equations,); for several, rows of x and b (m, ...)."""
        return self._solved(solve, b)

    def solve_transposed(self, c: Array) -> Array:
        """Return the y (equations,) with J^T y = c (unknowns,); for several, rows of y and c (m, ...)."""
        return self._solved(solve_transposed, c)

    def _solved(self, kernel: Callable[[Layout, Eliminated, Array, Array, Array, Share], None], given: Array) -> Array:
        """Return the solutions that a kernel finds for one or several right-hand sides."""
        given = np.ascontiguousarray(given, dtype=float)
        rows = given.reshape(-1, self.unknowns)
        result = np.empty(rows.shape)
        if self._whole.last == 1:
            kernel(self._layout, self.room.factors, rows, result, self.room.work, self._whole)
        else:
            for first in range(0, len(rows), LANES):
                these = slice(first, first + LANES)
                run(
                    kernel,
                    (self._layout, self.room.factors, rows[these], result[these], self.room.work),
                    self._whole,
                    (True, False, True),
                )
        return result.reshape(given.shape)
