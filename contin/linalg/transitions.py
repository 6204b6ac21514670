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
from contin.functions.kernel_parts import IndexVector, Matrix, Stack, Vector
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
    return _filled(value, slope, h, jacobian, 0)


def transitions(value: Array, slope: Array, h: Array, jacobian: Array) -> Array:
    """Return the transition matrix of each interval, shape (N, n, n); not finite where there is none."""
    matrices, n = _filled(value, slope, h, jacobian, len(value)), jacobian.shape[1]
    result = np.empty((len(h), n, n))
    condense(matrices, np.empty(matrices.shape[2], np.int64), result)
    return result


def _filled(value: Array, slope: Array, h: Array, jacobian: Array, turn: int) -> Array:
    """Return the equations by the nodes in order, turned by so many places."""
    d, n = len(value), jacobian.shape[1]
    matrices = np.empty((len(h), d * n, (d + 1) * n))
    fill(value, slope, h, jacobian, turn, matrices)
    return matrices


@kernel(reorder=False)
def fill(value: Matrix, slope: Matrix, h: Vector, jacobian: Stack, turn: int, matrices: Stack) -> None:
    """Fill the equations of the intervals."""
    d, n = value.shape[0], jacobian.shape[1]
    for m in range(d + 1):
        start = (m + turn) % (d + 1) * n
        for j in range(h.size):
            for q in range(d):
                factor, point = -h[j] * value[q, m], jacobian[j * d + q]
                for a in range(n):
                    row = matrices[j, q * n + a]
                    for b in range(n):
                        row[start + b] = factor * point[a, b]
                    row[start + a] += slope[q, m]


@kernel
def condense(matrices: Stack, pivots: IndexVector, result: Stack) -> None:
    """Fill the transition matrices from the equations by [interior | right | left], which are overwritten."""
    rows, width = matrices.shape[1], matrices.shape[2]
    n = width - rows
    inner = rows - n
    for j in range(result.shape[0]):
        block, found = matrices[j], result[j]
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
