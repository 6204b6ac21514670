"""What a linear equation on a mesh says of both ends of the domain, and how much that differs between two points of a curve.

Condensation leaves n rows that relate both ends and the parameters; they span the boundary values of all solutions of the
differential equation. So do the n rows that it leaves at each mesh point, for the domain up to there. Only the span has a
meaning: which rows they are depends on pivots. Of the span, orthonormal rows R are taken; the border rows, which are reduced by
multiples of the same rows, without their part in it::

                 first point   last point   parameters
    condensed  [  R            R            R     ]   n rows
               [  boundary     boundary     boundary ]
               [  border       border       border   ]

This matrix is singular where the whole one is, with a kernel of the same dimension, and has 2 n + k rows.
"""

from __future__ import annotations

import math

import numpy as np

from contin.arrays import Array
from contin.functions.kernel import kernel
from contin.functions.kernel_parts import Stack
from contin.linalg.singular import orthonormalize_row


@kernel
def orthonormal_rows(chain: Stack, relations: Stack) -> float:
    """Fill the ``relations`` (N - 1, n, 2 n + k) of the first point to each of the others, from the second on.

    ``chain`` is that of `contin.linalg.elimination.Eliminated`. The result is the least pivot of the mesh points, as a part of
    their mean.
    """
    points, n, width = relations.shape
    least, total = math.inf, 0.0
    for j in range(points):
        block, rows = chain[j], relations[j]
        for i in range(n):
            pivot = 1.0 / abs(block[i, i])  # inverse triangles are kept
            least, total = min(least, pivot), total + pivot
            for b in range(width):
                rows[i, b] = block[n + i, n + b]
            orthonormalize_row(rows, i)
    return float(least * points * n / total)


@kernel
def largest_turn(one: Stack, other: Stack) -> float:
    """Return the largest sum, over the mesh points, of the squared sines of the angles between two spans of relations."""
    points, n, width = one.shape
    largest = 0.0
    for j in range(points):
        total = float(n)
        for i in range(n):
            for k in range(n):
                product = 0.0
                for b in range(width):
                    product += one[j, i, b] * other[j, k, b]
                total -= product * product
        if not total <= largest:
            largest = total
    return largest


class Ends:
    """What condensation has left of a matrix.

    Parameters
    ----------
    chain : ndarray
        That of `contin.linalg.elimination.Eliminated`.
    carried : ndarray, shape (n + r, 2 n + k)
        The rows that relate both ends, and the border.
    first, last : ndarray, shape (n_bc, n) and (n_bc, n + k)
        The boundary conditions.

    Attributes
    ----------
    relations : ndarray, shape (N - 1, n, 2 n + k)
        Orthonormal rows that relate the first mesh point to each of the others, from the second on.
    least_pivot : float
        The least pivot of the mesh points, as a part of their mean.
    others : ndarray, shape (n_bc + r, 2 n + k)
        Boundary conditions and border.
    """

    def __init__(self, chain: Array, carried: Array, first: Array, last: Array) -> None:
        conditions, n = first.shape
        self.relations = np.empty((len(chain), n, carried.shape[1]))
        with np.errstate(all="ignore"):
            self.least_pivot = orthonormal_rows(chain, self.relations)
            span, border = self.relations[-1], carried[n:]
            self.others = np.vstack([np.hstack([first, last]), border - (border @ span.T) @ span])


def compared(before: Ends, after: Ends) -> tuple[Array, Array, float]:
    """Return the condensed matrices at two points, with rows that relate the ends in the same way, and the largest turn.

    The rows at the second point are the projections of those at the first one to their span there.
    """
    one, other = before.relations[-1], after.relations[-1]
    first = np.vstack([one, before.others])
    second = np.vstack([(one @ other.T) @ other, after.others])
    return first, second, largest_turn(before.relations, after.relations)
