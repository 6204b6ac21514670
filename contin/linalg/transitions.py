"""Transition matrices of a linearized collocation: each takes a perturbation at the left end of an interval to its right end.

The collocation equations of an interval, for degree 3 and n states, in blocks of n rows and n columns:

                   left   interior   right
    Gauss point 1 [ S-A   S-A  S-A   S-A ]
    Gauss point 2 [ S-A   S-A  S-A   S-A ]     S: slope of the node on the diagonal, A: h times value of the node times J
    Gauss point 3 [ S-A   S-A  S-A   S-A ]

With the interior eliminated n rows [A B] are left, and the transition matrix is -B^-1 A.
"""

from __future__ import annotations

import numpy as np

from contin.arrays import Array
from contin.functions.kernel import kernel
from contin.functions.kernel_parts import IndexVector, Matrix, Stack, Vector, helper
from contin.linalg.elimination import Step, eliminate
from contin.linalg.vector import PANEL


def interval_matrices(value: Array, slope: Array, h: Array, jacobian: Array) -> Array:
    """Return the collocation equations of each interval, shape (N, d n, (d + 1) n), by its nodes in order.

    Parameters
    ----------
    value, slope : ndarray, shape (d, d + 1)
        Tables of the `Basis`.
    h : ndarray, shape (N,)
    jacobian : ndarray, shape (N d, n, n)
        Derivatives of the right-hand side at the Gauss points.
    """
    d, n = len(value), jacobian.shape[1]
    matrices = np.empty((len(h), d * n, (d + 1) * n))
    fill(value, slope, h, jacobian, matrices)
    return matrices


@kernel(reorder=False, last=True)
def fill(value: Matrix, slope: Matrix, h: Vector, jacobian: Stack, matrices: Stack) -> None:
    """Fill the equations of the intervals."""
    for j in range(h.size):
        _fill_block(value, slope, h[j], jacobian, j * value.shape[0], 0, matrices[j])


@helper
def _fill_block(value, slope, h, jacobian, first, turn, block):
    """Fill the equations of one interval, with the Gauss points from ``first`` on, by its nodes turned by so many places."""
    d, n = value.shape[0], jacobian.shape[1]
    for q in range(d):
        point = jacobian[first + q]
        for a in range(n):
            row = block[q * n + a]
            for m in range(d + 1):
                factor, start = -h * value[q, m], (m + turn) % (d + 1) * n
                for b in range(n):
                    row[start + b] = factor * point[a, b]
                row[start + a] += slope[q, m]


@kernel(last=True)
def condense(
    value: Matrix, slope: Matrix, h: Vector, jacobian: Stack, block: Matrix, pivots: IndexVector, result: Stack
) -> None:
    """Fill the transition matrices; ``block`` (d n, (d + 1) n) is work space for equations by [interior | right | left]."""
    rows, width = block.shape
    n = width - rows
    inner = rows - n
    for j in range(h.size):
        found = result[j]
        _fill_block(value, slope, h[j], jacobian, j * value.shape[0], value.shape[0], block)
        eliminate(block, Step(0, rows, 0, inner, inner, width), pivots)
        eliminate(block, Step(inner, rows, inner, rows, rows, width), pivots)
        for start in range((n - 1) // PANEL * PANEL, -1, -PANEL):  # of each panel the inverse triangle is kept
            end = min(start + PANEL, n)
            for a in range(start, end):
                for b in range(n):
                    found[a, b] = -block[inner + a, rows + b]
                    for c in range(end, n):
                        found[a, b] -= block[inner + a, inner + c] * found[c, b]
            for a in range(start, end):  # row a needs the rows below it as they were
                for b in range(n):
                    total = 0.0
                    for c in range(a, end):
                        total += block[inner + a, inner + c] * found[c, b]
                    found[a, b] = total
