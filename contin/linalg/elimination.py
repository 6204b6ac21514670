"""Elimination of the matrix of a collocation step, with partial pivoting: the stages that `contin.linalg.condensation` lists.

Rows are exchanged, columns are not. Triangles and multipliers are kept in place of what was eliminated. Of the diagonal blocks
of `PANEL` columns the inverse triangles are kept, so that substitution only multiplies.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from contin.kernels.kernel import kernel
from contin.kernels.kernel_parts import IndexMatrix, IndexVector, Matrix, Stack, helper
from contin.linalg import vector
from contin.linalg.blocks import Layout, Share
from contin.linalg.vector import PANEL, Rows, at, copy_rows


class Eliminated(NamedTuple):
    """The eliminated matrix: triangles, multipliers and pivots of the three stages, for the sizes of `Blocks`.

    - ``local``, ``border`` (ndarray): Stage 1: those of the `Blocks`, eliminated in place; drawn in `_eliminate_interiors`.
    - ``chain`` (ndarray, shape (N - 1, 2 n + r, 3 n + k)): Stage 2: the rows that contain a mesh point, drawn in
      `_eliminate_point`; not used where segments meet.
    - ``dense`` (ndarray, shape ((S + 1) n + k, (S + 1) n + k)): Stage 3: what is left of S segments, drawn in
      `_eliminate_dense`.
    - ``pivots`` (ndarray of int, shape (N, n d)): For each eliminated column the row in which its pivot was found, counted in
      the block: the interior columns of interval j, then the n columns of mesh point j (not used where segments begin).
    - ``pivots_dense`` (ndarray of int, shape ((S + 1) n + k,)): The same for the columns of ``dense``.
    """

    local: Stack
    border: Stack
    chain: Stack
    dense: Matrix
    pivots: IndexMatrix
    pivots_dense: IndexVector


class Step(NamedTuple):
    """One elimination in a block: its rows and columns.

    Pivots of the columns ``left`` to ``right`` are chosen among the rows ``top`` to ``bottom``. Columns from ``tail`` to
    ``width`` are updated; those between ``right`` and ``tail`` are zero in these rows, and neither read nor written.
    """

    top: int
    bottom: int
    left: int
    right: int
    tail: int
    width: int


class Range(NamedTuple):
    """The numbers ``first`` to ``last``, without ``last``."""

    first: int
    last: int


@helper(inline=True)
def group_step(offsets, g, degree, width):
    """Return the elimination of the interior unknowns of group g in an interval's block."""
    first, last, n = offsets[g], offsets[g + 1], offsets[offsets.size - 1]
    top, bottom, left, right = degree * first, degree * last, (degree - 1) * first, (degree - 1) * last
    return Step(top, bottom, left, right, (degree + 1) * n - 2 * last, width)


@helper(inline=True)
def point_step(n, width):
    """Return the elimination of a mesh point."""
    return Step(0, 2 * n, 0, n, n, width)


@helper(inline=True)
def whole_step(size):
    """Return the elimination of a whole square matrix."""
    return Step(0, size, 0, size, size, size)


# --- elimination of columns from rows --------------------------------------------------------------------------------


@helper
def _largest(block, rows, column):
    """Return the row with the largest entry in a column."""
    largest, row = -1.0, rows.first
    for i in range(rows.first, rows.last):
        size = abs(block[i, column])
        if size > largest:
            largest, row = size, i
    return row


@helper(inline=True)
def _ranges(step):
    """Return the end of the first and the beginning of the second range of columns that are updated; adjacent ones are one."""
    return (step.width, step.width) if step.tail == step.right else (step.right, step.tail)


@helper
def eliminate(block, step, pivots):
    """Factor the columns of a step by blocked LU with partial pivoting, in place, a panel of `PANEL` columns at a time.

    Return the sign of the product of the pivots, times -1 for each exchange of rows; NaN if a pivot is not finite. The result,
    with the triangle U and multipliers M (dots are neither read nor written)::

                   left      right   tail    width
        top     [  U  U  U  U  .  .  x  x  x  ]
                [  M  U  U  U  .  .  x  x  x  ]
                [  M  M  U  U  .  .  x  x  x  ]
                [  M  M  M  U  .  .  x  x  x  ]
        bottom  [  M  M  M  M  .  .  x  x  x  ]
    """
    top, bottom, left, right, tail, width = step
    finish, tail = _ranges(step)
    sign = 1.0
    for start in range(left, right, PANEL):
        end, first = min(start + PANEL, right), top + start - left
        size, below = end - start, first + end - start
        largest = _largest(block, Range(first, bottom), start)
        for k in range(size):
            row, column = first + k, start + k
            pivots[column] = largest
            if largest != row:
                sign = -sign
                vector.exchange(at(block, row, left).address, at(block, largest, left).address, finish - left)
                vector.exchange(at(block, row, tail).address, at(block, largest, tail).address, width - tail)
            pivot = block[row, column]
            if pivot < 0:
                sign = -sign
            if not abs(pivot) < np.inf:
                sign = np.nan
            if start + PANEL <= width:
                largest = row + 1 + vector.reduce_column(at(block, row, start), bottom - row - 1, k, size)
                continue
            for i in range(row + 1, bottom):
                factor = block[i, column] / pivot
                block[i, column] = factor
                for j in range(column + 1, end):
                    block[i, j] -= factor * block[row, j]
            if k + 1 < size:
                largest = _largest(block, Range(row + 1, bottom), column + 1)
        panel = at(block, first, start)
        vector.solve_triangle(at(block, first, end), panel, finish - end, size)
        vector.solve_triangle(at(block, first, tail), panel, width - tail, size)
        _subtract_panel(at(block, below, 0), bottom - below, at(block, first, 0), start, size, finish, tail, width)
        vector.invert_triangles(panel, size)
    return sign


@helper
def _reduce(matrix, rows, block, step):
    """Eliminate the columns of a step from ``rows`` of a matrix that are never pivots, by the rows of the factored block."""
    finish, tail = _ranges(step)
    for start in range(step.left, step.right, PANEL):
        size, first = min(PANEL, step.right - start), step.top + start - step.left
        _multiply(matrix, rows, start, block, first, size)
        _subtract_panel(
            at(matrix, rows.first, 0), rows.last - rows.first, at(block, first, 0), start, size, finish, tail, step.width
        )


@helper
def _multiply(matrix, rows, start, block, first, size):
    """Turn a panel of ``rows`` of a matrix into multipliers of the block's rows from ``first`` on, by the inverse triangle."""
    if start + PANEL <= matrix.shape[1]:
        vector.multiply_rows(at(matrix, rows.first, start), rows.last - rows.first, at(block, first, start), size)
        return
    for r in range(rows.first, rows.last):
        for k in range(size - 1, -1, -1):
            value = 0.0
            for above in range(k + 1):
                value += matrix[r, start + above] * block[first + above, start + k]
            matrix[r, start + k] = value


@helper(inline=True)
def _subtract_panel(rows, count, pivots, start, size, finish, tail, width):
    """Subtract multiples of ``size`` pivot rows from ``count`` rows; the factors stand in the columns from ``start`` on."""
    end, factors = start + size, Rows(rows.address + 8 * start, rows.stride)
    target, source = Rows(rows.address + 8 * end, rows.stride), Rows(pivots.address + 8 * end, pivots.stride)
    if end < finish:
        vector.subtract_products(target, factors, source, finish - end, count, size)
    target, source = Rows(rows.address + 8 * tail, rows.stride), Rows(pivots.address + 8 * tail, pivots.stride)
    if tail < width:
        vector.subtract_products(target, factors, source, width - tail, count, size)


# --- the three stages ------------------------------------------------------------------------------------------------


@helper(inline=True)
def _eliminate_interiors(layout, work, part, corner):
    """Eliminate the interior unknowns of the intervals of a segment (stage 1); return the sign of the product of pivots.

    An interval's block and its border rows, before and after, for one group of states::

                       interior   ends   parameters         interior   ends   parameters
        n (d - 1)   [  x  x  x    x  x   x  ]            [  U  U  U    x  x   x  ]
                    [  x  x  x    x  x   x  ]            [  M  U  U    x  x   x  ]
                    [  x  x  x    x  x   x  ]     ->     [  M  M  U    x  x   x  ]
        n           [  x  x  x    x  x   x  ]            [  M  M  M    x  x   x  ]   rows that remain
        r (border)  [  x  x  x    x  x   x  ]            [  M  M  M    x  x   x  ]

    With several groups each eliminates its own interior columns: from its own rows, from the rows of those later groups that
    contain its states, and from the border. The last columns of the border are the sum over the intervals so far.
    """
    local, border, offsets, follows = work.local, work.border, layout.offsets, layout.follows
    _, rows, width = local.shape
    r, k = corner.shape
    degree, groups = rows // offsets[offsets.size - 1], offsets.size - 1
    sign = 1.0
    for j in range(part.first, part.last):
        block, edge = local[j], border[j]
        copy_rows(at(edge, 0, width - k), at(corner, 0, 0), k, r)
        for g in range(groups):
            step = group_step(offsets, g, degree, width)
            sign *= eliminate(block, step, work.pivots[j])
            h = g + 1
            while h < groups:  # neighbours among the later groups are reduced together
                begin = h
                while h < groups and follows[g * groups + h]:
                    h += 1
                if h > begin:
                    _reduce(block, Range(degree * offsets[begin], degree * offsets[h]), block, step)
                h += 1
            _reduce(edge, Range(0, r), block, step)
        copy_rows(at(corner, 0, 0), at(edge, 0, width - k), k, r)
    return sign


@helper
def _place_interval(target, block, border, offsets, ends, right):
    """Fill the last n + r rows of ``target`` with the rows of an interval that remain and its border rows.

    The left end goes to the first columns, the right end to those from ``right`` on, parameters to the last ones.
    """
    n, r, rows, width = ends.size // 2, border.shape[0], block.shape[0], block.shape[1]
    inner, top, k = rows - n, target.shape[0] - r - n, width - rows - n
    group = 0
    for i in range(n + r):
        if i == offsets[group + 1] and i < n:
            group += 1
        source = block[(rows // n - 1) * offsets[group + 1] + i] if i < n else border[i - n]
        for b in range(2 * n):
            column = ends[b] if ends[b] < n else ends[b] - rows + right
            target[top + i, column] = source[inner + b]
        for b in range(k):
            target[top + i, target.shape[1] - k + b] = source[inner + 2 * n + b]


@helper
def _eliminate_point(block, carried, pivots):
    """Eliminate a mesh point from the rows that contain it; return the sign of the product of pivots.

    These rows are the ``carried`` ones, those of the interval that follows, which stand in the last n + r rows of
    the ``block``, and the border, where both are added; before and after::

                       this point  first  next  parameters         this point  first  next  parameters
        carried     [  x  x        x  x   0  0  x  ]            [  U  U        x  x   x  x  x  ]
                    [  x  x        x  x   0  0  x  ]            [  M  U        x  x   x  x  x  ]
        following   [  x  x        0  0   x  x  x  ]     ->     [  M  M        x  x   x  x  x  ]   n rows, carried on
                    [  x  x        0  0   x  x  x  ]            [  M  M        x  x   x  x  x  ]
        border      [  x  x        x  x   x  x  x  ]            [  M  M        x  x   x  x  x  ]   r rows, carried on

    Pivots are chosen among the first 2 n rows. ``carried`` (n + r, 2 n + k) holds [first | this point | parameters]. The border
    by the parameters is carried only: the sum so far.
    """
    n = block.shape[1] - carried.shape[1]
    k, r = carried.shape[1] - 2 * n, carried.shape[0] - n
    for i in range(n):
        for b in range(n):
            block[i, 2 * n + b] = block[n + i, n + b] = 0.0
    copy_rows(at(block, 0, 0), at(carried, 0, n), n, n)
    copy_rows(at(block, 0, n), at(carried, 0, 0), n, n)
    copy_rows(at(block, 0, 3 * n), at(carried, 0, 2 * n), k, n)
    for i in range(r):
        for b in range(n):
            block[2 * n + i, b] += carried[n + i, n + b]
    copy_rows(at(block, 2 * n, n), at(carried, n, 0), n, r)
    copy_rows(at(block, 2 * n, 3 * n), at(carried, n, 2 * n), k, r)
    step = point_step(n, block.shape[1])
    sign = eliminate(block, step, pivots)
    _reduce(block, Range(2 * n, 2 * n + r), block, step)
    copy_rows(at(carried, 0, 0), at(block, n, n), 2 * n + k, n + r)
    return sign


@helper(inline=True)
def _condense_points(layout, work, part, corner, carried):
    """Eliminate the mesh points inside a segment (stage 2); return the sign of the product of pivots.

    Each is eliminated from the rows that remain of the interval on its right, and those carried over from the points before.
    ``carried`` takes what is left: n rows and the border, by [first | last point of the segment | parameters].
    """
    n, (r, k), rows = layout.order.size, corner.shape, work.local.shape[1]
    _place_interval(carried, work.local[part.first], work.border[part.first], layout.offsets, layout.ends, n)
    copy_rows(at(carried, n, 2 * n), at(corner, 0, 0), k, r)  # the border by the parameters: the sum over all intervals
    sign = 1.0
    for j in range(part.first + 1, part.last):
        block = work.chain[j - 1]
        _place_interval(block, work.local[j], work.border[j], layout.offsets, layout.ends, 2 * n)
        sign *= _eliminate_point(block, carried, work.pivots[j, rows - n :])
    return sign


@helper
def _eliminate_dense(carried, first, last, dense, pivots):
    """Eliminate the rest of the matrix (stage 3); return the sign of the product of pivots.

    Its rows, square together, for two segments between the mesh points p0, p1 and p2::

                     p0      p1   p2     parameters
        carried   [  x       x           x     ]   n rows
        carried   [          x    x      x     ]   n rows
        boundary  [  first        last   last  ]   n_bc rows
        border    [  x       x    x      x     ]   r rows, the sum over the segments
    """
    (conditions, n), (segments, height, width), size = first.shape, carried.shape, dense.shape[0]
    end, k = segments * n, width - 2 * n
    border = end + conditions
    for i in range(size):
        for b in range(size):
            dense[i, b] = 0.0
    for s in range(segments):
        these, left = carried[s], s * n
        copy_rows(at(dense, left, left), at(these, 0, 0), 2 * n, n)
        copy_rows(at(dense, left, end + n), at(these, 0, 2 * n), k, n)
        for i in range(height - n):
            for b in range(2 * n):
                dense[border + i, left + b] += these[n + i, b]
            for b in range(k):
                dense[border + i, end + n + b] += these[n + i, 2 * n + b]
    copy_rows(at(dense, end, 0), at(first, 0, 0), n, conditions)
    copy_rows(at(dense, end, end), at(last, 0, 0), n + k, conditions)
    return eliminate(dense, whole_step(size), pivots)


@kernel
def factorize(
    layout: Layout, work: Eliminated, corners: Stack, first: Matrix, last: Matrix, carried: Stack, share: Share
) -> float:
    """Factor a matrix and return the sign of its determinant, up to a factor that depends on the shape only.

    ``work`` holds the local and the border blocks and takes the result; ``first`` and ``last`` are those of the `Blocks`.
    ``corners`` (S, r, k) begin with the corner of the `Blocks`, and have room for the other segments; they are overwritten.
    ``carried`` (S, n + r, 2 n + k) takes what is left of the segments. The first stage of a `Share` condenses them, the second
    eliminates the rest.
    The sign is that of the share; the product of all is the sign of the determinant.
    """
    sign = 1.0
    if share.stage != 1:
        for s in range(share.first, share.last):
            part = Range(share.starts[s], share.starts[s + 1])
            if s > 0:
                corners[s, :, :] = 0.0
            sign *= _eliminate_interiors(layout, work, part, corners[s])
            sign *= _condense_points(layout, work, part, corners[s], carried[s])
    if share.stage != 0:
        sign *= _eliminate_dense(carried, first, last, work.dense, work.pivots_dense)
    return sign
