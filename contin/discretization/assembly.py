"""Assembly of residual and Jacobian of the collocation equations."""

from __future__ import annotations

from typing import Any

import numpy as np

from contin.arrays import Array
from contin.functions.compiler import Matrix, ReadOnlyVector, Vector, kernel, njit
from contin.linalg.vector import scale_into


@kernel
def at_points(value: Matrix, x: ReadOnlyVector, points: Matrix) -> None:
    """Fill ``points`` (N d, n) with the states at the Gauss points, from the nodal values in x."""
    d = value.shape[0]
    count, n = points.shape
    for j in range(count // d):
        for i in range(d):
            row = points[j * d + i]
            for a in range(n):
                row[a] = 0.0
            for node in range(d + 1):
                factor, start = value[i, node], (j * d + node) * n
                for a in range(n):
                    row[a] += factor * x[start + a]


@kernel
def collocate(
    n: int, slope: Matrix, weights: Vector, h: Vector, x: ReadOnlyVector, field: Matrix, boundary: Matrix, residual: Vector
) -> None:
    """Fill the ``residual`` from values of rhs and integrands at the Gauss points (N d, n + n_int) and boundary (1, n_bc)."""
    d, conditions, integrals = weights.size, boundary.shape[1], field.shape[1] - n
    last = residual[residual.size - integrals :]
    for q in range(integrals):
        last[q] = 0.0
    for j in range(h.size):
        for i in range(d):
            values, start = field[j * d + i], (j * d + i) * n
            for a in range(n):
                residual[start + a] = -h[j] * values[a]
            for node in range(d + 1):
                factor, first = slope[i, node], (j * d + node) * n
                for a in range(n):
                    residual[start + a] += factor * x[first + a]
            for q in range(integrals):
                last[q] += weights[i] * h[j] * values[n + q]
    for q in range(conditions):
        residual[field.shape[0] * n + q] = boundary[0, q]


@njit(
    "void(UniTuple(i8[::1], 9), f8[:,::1], f8[:,::1], f8[::1], f8[::1], f8[:,:,::1], f8[:,:,::1], f8[:,::1], f8[:,::1],"
    "f8[:,:,::1], f8[:,:,::1], f8[:,::1], f8[:,::1], f8[:,::1])",
    cache=True, error_model="numpy", nogil=True,
)  # fmt: skip
def assemble(
    layout: Any,
    value: Array,
    slope: Array,
    weights: Array,
    h: Array,
    jacobian: Array,
    at_ends: Array,
    columns: Array,
    rows: Array,
    local: Array,
    border: Array,
    corner: Array,
    start: Array,
    end: Array,
) -> None:
    """Fill the blocks that `contin.condensation.Factorization` takes.

    ``jacobian`` (points, n + n_int, n + k) of rhs and integrands is by the states in the layout's order, ``at_ends`` (1,
    n_bc, 2 n + k) of the boundary conditions by those at both ends as they are. ``columns`` (c, equations) and ``rows`` (r,
    unknowns) are the extra ones; ``start`` and ``end`` are filled with the coefficients of the boundary conditions.
    Equations are scaled by h. Interior columns of states that do not occur in a row are left as they are: nobody looks at
    them.
    """
    order, offsets, follows, equations, inside, ends, left, right, remaining = layout
    d, n, groups = weights.size, order.size, offsets.size - 1
    intervals = h.size
    n_int = jacobian.shape[1] - n
    k = jacobian.shape[2] - n
    c, r = columns.shape[0], rows.shape[0]
    inner = n * (d - 1)
    rest = inner + 2 * n
    size = (intervals * d + 1) * n
    starts = np.empty((groups, d + 1), np.int64)  # where a group's states at a node begin
    for g in range(groups):
        first = offsets[g]
        for node in range(d + 1):
            starts[g, node] = (d - 1) * first + (node - 1) * (offsets[g + 1] - first)
        starts[g, 0], starts[g, d] = left[order[first]], right[order[first]]
    for q in range(n_int + r):
        for b in range(k + c):
            corner[q, b] = rows[q - n_int, size + b] if q >= n_int else 0.0
    for j in range(intervals):
        for g in range(groups):
            first, last = offsets[g], offsets[g + 1]
            for place in range(d * first, d * last):
                row, equation = local[j, place], equations[place]
                i, a = equation // n, equation % n
                point, target, source = jacobian[j * d + i, a], row.ctypes.data, jacobian[j * d + i, a].ctypes.data
                if place >= d * first + (d - 1) * (last - first):  # a row that remains: its zeros are looked at, too
                    for b in range(inner, rest):
                        row[b] = 0.0
                for f in range(g + 1):
                    low, number = offsets[f], offsets[f + 1] - offsets[f]
                    if follows[f * groups + g] == 1:
                        for node in range(d + 1):
                            scale_into(target + 8 * starts[f, node], -h[j] * value[i, node], source + 8 * low, number)
                    else:
                        for b in range(number):
                            row[starts[f, 0] + b] = row[starts[f, d] + b] = 0.0
                if follows[g * groups + g] == 0:
                    for node in range(1, d):
                        for b in range(last - first):
                            row[starts[g, node] + b] = 0.0
                own = (place - d * first) % (last - first)
                for node in range(d + 1):
                    row[starts[g, node] + own] += slope[i, node]
                for b in range(k):
                    row[rest + b] = -h[j] * point[n + b]
                for b in range(c):
                    row[rest + k + b] = columns[b, j * d * n + equation]
        for q in range(n_int):
            for b in range(border.shape[2]):
                border[j, q, b] = 0.0
            for i in range(d):
                point, share = jacobian[j * d + i, n + q], weights[i] * h[j]
                for node in range(d + 1):
                    for g in range(groups):
                        first = starts[g, node]
                        for b in range(offsets[g + 1] - offsets[g]):
                            border[j, q, first + b] += share * value[i, node] * point[offsets[g] + b]
                for b in range(k):
                    corner[q, b] += share * point[n + b]
        for q in range(r):
            target, source = border[j, n_int + q], rows[q, j * d * n :]
            for b in range(inner):
                target[b] = source[inside[b]]
            for b in range(2 * n):
                at_end = ends[b] >= n * d
                target[inner + b] = source[ends[b]] if not at_end or j == intervals - 1 else 0.0
            for b in range(k + c):
                target[rest + b] = 0.0
    conditions = start.shape[0]
    for q in range(conditions):
        for b in range(n):
            start[q, b], end[q, b] = at_ends[0, q, b], at_ends[0, q, n + b]
        for b in range(k):
            end[q, n + b] = at_ends[0, q, 2 * n + b]
        for b in range(c):
            end[q, n + k + b] = columns[b, intervals * d * n + q]
    for b in range(c):
        for q in range(n_int):
            corner[q, k + b] = columns[b, intervals * d * n + conditions + q]
