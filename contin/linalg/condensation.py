"""Factorization of bordered almost-block-diagonal matrices, by condensation, with partial pivoting throughout.

The matrix of one collocation step couples, in interval j, the unknowns [interior_j | left_j | right_j | parameters],
where right_j = left_{j+1}. Below the intervals stand the boundary conditions (first and last mesh point, parameters)
and r border rows (integral conditions, arclength, ...) that touch everything. It is eliminated in three stages:

1. in each interval, the interior unknowns (local pivoting; border rows follow);
2. the mesh points 1 ... N-1, one after the other, each from the 2n rows that contain it (border rows follow);
3. what is left, dense: first and last mesh point and the parameters.

That is the scheme of de Boor & Weiss (1980) in the order that AUTO uses. Cost N (n d)^3, memory N (n d)^2, and nothing of
the size of the whole is ever stored densely. All stages keep their multipliers, so solves with the matrix and with its
transpose cost a back-substitution.

Where some states' equations do not contain others (a frame that turns at rates which do not depend on it, a position that is an
integral), stage 1 goes group by group (`contin.structure`): each group's unknowns are eliminated by its own equations, and
only from those that contain them.

Vectors of unknowns are [mesh and interior values in order | parameters]; vectors of equations are
[collocation | boundary | border rows].
"""

from __future__ import annotations

from typing import Any

import numpy as np

from contin.arrays import Array
from contin.functions.compiler import _OPTIONS, helper, njit
from contin.linalg.layout import Layout
from contin.linalg.vector import (
    LANES,
    LOWER,
    LOWER_TRANSPOSED,
    PANEL,
    UPPER,
    UPPER_TRANSPOSED,
    apply_triangle,
    exchange,
    gather,
    invert_triangles,
    move,
    multiply_rows,
    reduce_column,
    solve_triangle,
    subtract_columns,
    subtract_products,
    subtract_rows,
)

# Loops instead of numpy assignments: numba compiles them ten times faster, and they run as fast.


@helper
def _copy(target, source):
    """target[...] = source for two matrices."""
    for i in range(target.shape[0]):
        for j in range(target.shape[1]):
            target[i, j] = source[i, j]


@helper
def _copy_columns(target, first, source, columns):
    """target[:, first + b] = source[:, columns[b]]."""
    for i in range(source.shape[0]):
        for b in range(columns.size):
            target[i, first + b] = source[i, columns[b]]


@helper(inline=True)
def _address(matrix, i, j):
    return matrix.ctypes.data + i * matrix.strides[0] + 8 * j


@helper
def _subtract(target, stride, rows, factors, step, pivots, apart, length, count):
    """`subtract_products` for any number of rows, four at a time, and up to four pivots."""
    while rows >= 4:
        if count == 4:
            subtract_products(target, stride, factors, step, pivots, apart, length, 4, 4)
        elif count == 3:
            subtract_products(target, stride, factors, step, pivots, apart, length, 4, 3)
        elif count == 2:
            subtract_products(target, stride, factors, step, pivots, apart, length, 4, 2)
        else:
            subtract_products(target, stride, factors, step, pivots, apart, length, 4, 1)
        target, factors, rows = target + 4 * stride, factors + 4 * step, rows - 4
    while rows >= 1:
        if count == 4:
            subtract_products(target, stride, factors, step, pivots, apart, length, 1, 4)
        elif count == 3:
            subtract_products(target, stride, factors, step, pivots, apart, length, 1, 3)
        elif count == 2:
            subtract_products(target, stride, factors, step, pivots, apart, length, 1, 2)
        else:
            subtract_products(target, stride, factors, step, pivots, apart, length, 1, 1)
        target, factors, rows = target + stride, factors + step, rows - 1


@helper
def _finish_pivots(rows, stride, factors, length, count):
    """`solve_triangle` for up to four rows."""
    if count == 4:
        solve_triangle(rows, stride, factors, length, 4)
    elif count == 3:
        solve_triangle(rows, stride, factors, length, 3)
    elif count == 2:
        solve_triangle(rows, stride, factors, length, 2)


@helper(inline=True)
def _subtract_panel(rows, i, count, block, pivot, start, size, right, tail):
    """Subtract multiples of ``size`` rows of ``block`` from ``count`` rows from i on, up to ``right`` and from ``tail`` on.

    The multiples stand in columns from ``start`` on; ``pivot`` is the first of the rows of ``block``.
    """
    stride, apart, end = rows.strides[0], block.strides[0], start + size
    factors, target, pivots = _address(rows, i, start), _address(rows, i, 0), _address(block, pivot, 0)
    if end < right:
        _subtract(target + 8 * end, stride, count, factors, stride, pivots + 8 * end, apart, right - end, size)
    if tail < rows.shape[1]:
        _subtract(target + 8 * tail, stride, count, factors, stride, pivots + 8 * tail, apart, rows.shape[1] - tail, size)


@helper
def _eliminate(block, top, bottom, left, right, tail, pivots):
    """Eliminate columns left ... right of ``block`` (rows, width) by partial pivoting among the rows top ... bottom, in place.

    These rows are used from ``left`` to ``right`` and from ``tail`` on. Multipliers stay where they are made; of
    the diagonal blocks of a panel it is the inverses that stay. Returns the sign of the product of pivots, swaps included.
    """
    width, stride = block.shape[1], block.strides[0]
    sign = 1.0
    finish = right
    if tail == right:  # one range of columns
        finish = tail = width
    start = left
    while start < right:
        end = min(start + PANEL, right)
        first = top + start - left
        at = _largest(block, first, bottom, start)
        for k in range(end - start):
            row, column = first + k, start + k
            pivots[column] = at
            if at != row:
                sign = -sign
                exchange(_address(block, row, left), _address(block, at, left), finish - left)
                exchange(_address(block, row, tail), _address(block, at, tail), width - tail)
            pivot = block[row, column]
            if pivot < 0:
                sign = -sign
            if not abs(pivot) < np.inf:
                sign = np.nan
            if start + PANEL <= width:
                at = row + 1 + reduce_column(_address(block, row, start), stride, bottom - row - 1, k, end - start, 1 / pivot)
            else:
                for i in range(row + 1, bottom):
                    factor = block[i, column] / pivot
                    block[i, column] = factor
                    for j in range(column + 1, end):
                        block[i, j] -= factor * block[row, j]
                if k + 1 < end - start:
                    at = _largest(block, row + 1, bottom, column + 1)
        factors = _address(block, first, start)
        _finish_pivots(_address(block, first, end), stride, factors, finish - end, end - start)
        _finish_pivots(_address(block, first, tail), stride, factors, width - tail, end - start)
        below = first + end - start
        _subtract_panel(block, below, bottom - below, block, first, start, end - start, finish, tail)
        _invert_triangles(factors, stride, end - start)
        start = end
    return sign


@helper
def _invert_triangles(block, apart, size):
    """`invert_triangles` for any size up to that of a panel."""
    if size == 4:
        invert_triangles(block, apart, 4)
    elif size == 3:
        invert_triangles(block, apart, 3)
    elif size == 2:
        invert_triangles(block, apart, 2)
    else:
        invert_triangles(block, apart, 1)


@helper
def _multiply_rows(rows, i, count, start, block, first, size):
    """rows[i : i + count, start : start + size] times the upper triangle of ``block`` at row ``first`` and the same columns."""
    if start + PANEL > rows.shape[1]:
        for r in range(i, i + count):
            for k in range(size - 1, -1, -1):
                value = 0.0
                for above in range(k + 1):
                    value += rows[r, start + above] * block[first + above, start + k]
                rows[r, start + k] = value
        return
    stride, apart = rows.strides[0], block.strides[0]
    there, triangle = _address(rows, i, start), _address(block, first, start)
    if size == 4:
        multiply_rows(there, stride, count, triangle, apart, 4)
    elif size == 3:
        multiply_rows(there, stride, count, triangle, apart, 3)
    elif size == 2:
        multiply_rows(there, stride, count, triangle, apart, 2)
    else:
        multiply_rows(there, stride, count, triangle, apart, 1)


@helper
def _reduce(rows, i, count, block, top, left, right, tail):
    """Take the same columns out of ``count`` rows from i on, never pivots, by the pivot rows of ``block`` from ``top`` on."""
    finish = right
    if tail == right:
        finish = tail = rows.shape[1]
    start = left
    while start < right:
        end = min(start + PANEL, right)
        first = top + start - left
        _multiply_rows(rows, i, count, start, block, first, end - start)
        _subtract_panel(rows, i, count, block, first, start, end - start, finish, tail)
        start = end


@helper
def _largest(block, first, last, column):
    """Which of the rows first ... last has the largest entry in a column."""
    best, at = -1.0, first
    for i in range(first, last):
        size = abs(block[i, column])
        if size > best:
            best, at = size, i
    return at


@njit(
    "f8(UniTuple(i8[::1], 9), f8[:,:,::1], f8[:,:,::1], f8[:,::1], f8[:,:,::1], f8[:,:,::1], f8[:,::1], f8[:,::1], f8[:,::1],"
    "i8[:,::1], i8[:,::1], i8[::1])",
    cache=True,
    **_OPTIONS,
)
def factorize(layout, local, border, border_corner, chain, chain_border, first, last, dense, piv_local, piv_chain, piv_dense):
    """Factor in place; the arrays are described in `Factorization`. Returns the sign of the determinant."""
    _, offsets, follows, order, inside, ends, left, right, remaining = layout
    intervals, rows, width = local.shape
    n, groups = left.size, offsets.size - 1
    inner, degree = rows - n, rows // n
    r, k = border_corner.shape
    rest = inner + 2 * n
    sign = 1.0
    for j in range(intervals):
        block = local[j]
        _copy(border[j, :, rest:], border_corner)
        for g in range(groups):
            top, bottom = degree * offsets[g], degree * offsets[g + 1]
            start, stop, tail = (degree - 1) * offsets[g], (degree - 1) * offsets[g + 1], rest - 2 * offsets[g + 1]
            sign *= _eliminate(block, top, bottom, start, stop, tail, piv_local[j])
            h = g + 1
            while h < groups:
                begin = h
                while h < groups and follows[g * groups + h]:
                    h += 1
                if h > begin:
                    _reduce(
                        block, degree * offsets[begin], degree * (offsets[h] - offsets[begin]), block, top, start, stop, tail
                    )
                h += 1
            _reduce(border[j], 0, r, block, top, start, stop, tail)
        _copy(border_corner, border[j, :, rest:])
    # rows left over from interval 0: coefficients of the first mesh point, of the current one, of the parameters
    current = np.empty((n, 2 * n + k))
    for i in range(n):
        row = local[0, remaining[i]]
        for b in range(n):
            current[i, b], current[i, n + b] = row[left[b]], row[right[b]]
        for b in range(k):
            current[i, 2 * n + b] = row[rest + b]
    border_first, border_right = np.empty((r, n)), np.empty((r, n))
    _copy_columns(border_first, 0, border[0], left)
    _copy_columns(border_right, 0, border[0], right)
    for j in range(1, intervals):
        block, edge = chain[j - 1], chain_border[j - 1]
        _copy(block[:n, :n], current[:, n : 2 * n])
        _copy(block[:n, n : 2 * n], current[:, :n])
        _copy(block[:n, 3 * n :], current[:, 2 * n :])
        for i in range(n):
            row = local[j, remaining[i]]
            for b in range(n):
                block[i, 2 * n + b] = block[n + i, n + b] = 0.0
                block[n + i, b], block[n + i, 2 * n + b] = row[left[b]], row[right[b]]
            for b in range(k):
                block[n + i, 3 * n + b] = row[rest + b]
        for i in range(r):
            for b in range(n):
                edge[i, b] = border_right[i, b] + border[j, i, left[b]]
        _copy(edge[:, n : 2 * n], border_first)
        _copy_columns(edge, 2 * n, border[j], right)
        _copy(edge[:, 3 * n :], border_corner)
        sign *= _eliminate(block, 0, 2 * n, 0, n, n, piv_chain[j - 1])
        _reduce(edge, 0, r, block, 0, 0, n, n)
        _copy(current, block[n:, n:])
        _copy(border_first, edge[:, n : 2 * n])
        _copy(border_right, edge[:, 2 * n : 3 * n])
        _copy(border_corner, edge[:, 3 * n :])
    bc, size = first.shape[0], dense.shape[0]
    _copy(dense[:n], current)
    _copy(dense[n : n + bc, :n], first)
    _copy(dense[n : n + bc, n:], last)
    _copy(dense[n + bc :, :n], border_first)
    _copy(dense[n + bc :, n : 2 * n], border_right)
    _copy(dense[n + bc :, 2 * n :], border_corner)
    return sign * _eliminate(dense, 0, size, 0, size, size, piv_dense)


# Solves: right-hand sides stand side by side, LANES of them, so that vectors X have the shape (rows, LANES).


@helper
def _subtract_rows(target, matrix, apart, vectors, length, rows):
    """`subtract_rows` for any number of rows."""
    while rows >= 4:
        subtract_rows(target, matrix, apart, vectors, length, 4)
        target, matrix, rows = target + 32 * LANES, matrix + 4 * apart, rows - 4
    if rows == 3:
        subtract_rows(target, matrix, apart, vectors, length, 3)
    elif rows == 2:
        subtract_rows(target, matrix, apart, vectors, length, 2)
    elif rows == 1:
        subtract_rows(target, matrix, apart, vectors, length, 1)


@helper
def _subtract_columns(target, matrix, apart, vectors, length, rows):
    """`subtract_columns` for any number of rows."""
    while rows >= 4:
        subtract_columns(target, matrix, apart, vectors, length, 4)
        vectors, matrix, rows = vectors + 32 * LANES, matrix + 4 * apart, rows - 4
    if rows == 3:
        subtract_columns(target, matrix, apart, vectors, length, 3)
    elif rows == 2:
        subtract_columns(target, matrix, apart, vectors, length, 2)
    elif rows == 1:
        subtract_columns(target, matrix, apart, vectors, length, 1)


@helper(inline=True)
def _apply_triangle(vectors, block, apart, size, kind):
    """`apply_triangle` for any size up to that of a panel."""
    if size == 4:
        apply_triangle(vectors, block, apart, 4, kind)
    elif size == 3:
        apply_triangle(vectors, block, apart, 3, kind)
    elif size == 2:
        apply_triangle(vectors, block, apart, 2, kind)
    else:
        apply_triangle(vectors, block, apart, 1, kind)


@helper
def _forward(block, top, bottom, left, right, pivots, X):
    """Apply the elimination of columns left ... right by the rows top ... bottom to right-hand sides X."""
    apart = block.strides[0]
    for c in range(left, right):
        if pivots[c] != top + c - left:
            exchange(_address(X, top + c - left, 0), _address(X, pivots[c], 0), LANES)
    start = left
    while start < right:
        size = min(PANEL, right - start)
        first = top + start - left
        here = _address(X, first, 0)
        _subtract_rows(here, _address(block, first, left), apart, _address(X, top, 0), start - left, size)
        triangle = _address(block, first, start)
        _apply_triangle(here, triangle, apart, size, LOWER)
        start += size
    below = top + right - left
    _carry(block, below, bottom - below, left, right, X, top, X)


@helper(inline=True)
def _carry(rows, i, number, left, right, X, top, Y):
    """The same for ``number`` rows from i on, reduced by those from ``top`` on, with right-hand sides in Y."""
    _subtract_rows(_address(Y, i, 0), _address(rows, i, left), rows.strides[0], _address(X, top, 0), right - left, number)


@helper
def _backward(block, top, left, right, tail, X, known, behind):
    """Solve for X, from ``top`` on, the upper triangle of the columns left ... right.

    ``known``, from ``behind`` on, are the unknowns of the columns from ``tail`` on.
    """
    apart, after = block.strides[0], block.shape[1] - tail
    if after > 0:
        _subtract_rows(_address(X, top, 0), _address(block, top, tail), apart, _address(known, behind, 0), after, right - left)
    end = right
    while end > left:
        start = left + (end - left - 1) // PANEL * PANEL
        first, size = top + start - left, end - start
        here = _address(X, first, 0)
        _subtract_rows(here, _address(block, first, end), apart, _address(X, first + size, 0), right - end, size)
        triangle = _address(block, first, start)
        _apply_triangle(here, triangle, apart, size, UPPER)
        end = start


@helper
def _move(target, source):
    """target[...] = source."""
    there, here = _address(target, 0, 0), _address(source, 0, 0)
    for k in range(source.shape[0]):
        move(there + 8 * LANES * k, here + 8 * LANES * k)


@helper
def _take(target, i, source, rows):
    """target[i + k] = source[rows[k]]."""
    there, here = _address(target, i, 0), _address(source, 0, 0)
    for k in range(rows.size):
        move(there + 8 * LANES * k, here + 8 * LANES * rows[k])


@helper
def _put(target, rows, source, i):
    """target[rows[k]] = source[i + k]."""
    there, here = _address(target, 0, 0), _address(source, i, 0)
    for k in range(rows.size):
        move(there + 8 * LANES * rows[k], here + 8 * LANES * k)


@helper
def _side_by_side(target, source, first):
    """Up to LANES rows of ``source``, from ``first`` on, as columns; the last one again beside them."""
    stride, last = source.strides[0], source.shape[0] - 1 - first
    distances = (min(1, last) * stride, min(2, last) * stride, min(3, last) * stride)
    there, here = _address(target, 0, 0), _address(source, first, 0)
    for i in range(source.shape[1]):
        gather(there + 8 * LANES * i, here + 8 * i, distances)


@helper
def _rows_again(target, first, source):
    """The same the other way round."""
    for lane in range(min(LANES, target.shape[0] - first)):
        row = target[first + lane]
        for i in range(row.size):
            row[i] = source[i, lane]


@njit(
    "void(UniTuple(i8[::1], 9), f8[:,:,::1], f8[:,:,::1], f8[:,:,::1], f8[:,:,::1], f8[:,::1], i8[:,::1], i8[:,::1], i8[::1],"
    "Array(f8, 2, 'C', readonly=True), f8[:,::1])",
    cache=True,
    **_OPTIONS,
)
def solve(layout, local, border, chain, chain_border, dense, piv_local, piv_chain, piv_dense, b, x):
    """Solve J x = b with the factors for rows of b (m, equations) and of x (m, unknowns)."""
    _, offsets, follows, order, inside, ends, left, right, remaining = layout
    intervals, rows, width = local.shape
    n, groups = left.size, offsets.size - 1
    inner, degree = rows - n, rows // n
    r, k = border.shape[1], width - inner - 2 * n
    size, equations, unknowns = dense.shape[0], b.shape[1], x.shape[1]
    B, X = np.empty((equations, LANES)), np.empty((unknowns, LANES))
    here, edge = np.empty((intervals, rows, LANES)), np.empty((r, LANES))
    pair = np.empty((intervals, 2 * n, LANES))  # right-hand sides of a mesh point's rows: from before, and of this interval
    z, known = np.empty((size, LANES)), np.empty((2 * n + k, LANES))
    nothing = np.empty((1, LANES))
    for chunk in range(0, b.shape[0], LANES):
        _side_by_side(B, b, chunk)
        _move(edge, B[equations - r :])
        for j in range(intervals):
            block = local[j]
            _take(here[j], 0, B[j * rows : (j + 1) * rows], order)
            for g in range(groups):
                top, start, stop = degree * offsets[g], (degree - 1) * offsets[g], (degree - 1) * offsets[g + 1]
                _forward(block, top, degree * offsets[g + 1], start, stop, piv_local[j], here[j])
                for h in range(g + 1, groups):
                    if follows[g * groups + h]:
                        number = degree * (offsets[h + 1] - offsets[h])
                        _carry(block, degree * offsets[h], number, start, stop, here[j], top, here[j])
                _carry(border[j], 0, r, start, stop, here[j], top, edge)
            _take(pair[j], n, here[j], remaining)
        for j in range(1, intervals):
            _move(pair[j, :n], pair[j - 1, n:])
            _forward(chain[j - 1], 0, 2 * n, 0, n, piv_chain[j - 1], pair[j])
            _carry(chain_border[j - 1], 0, r, 0, n, pair[j], 0, edge)
        _move(z[:n], pair[intervals - 1, n:])
        _move(z[n : size - r], B[intervals * rows : equations - r])
        _move(z[size - r :], edge)
        _forward(dense, 0, size, 0, size, piv_dense, z)
        _backward(dense, 0, 0, size, size, z, nothing, 0)
        _move(X[:n], z[:n])
        _move(X[unknowns - k - n :], z[n:])
        _move(known[:n], z[:n])
        _move(known[2 * n :], z[2 * n :])
        for j in range(intervals - 1, 0, -1):
            _move(known[n : 2 * n], X[(j + 1) * rows : (j + 1) * rows + n])
            _backward(chain[j - 1], 0, 0, n, n, pair[j], known, 0)
            _move(X[j * rows : j * rows + n], pair[j, :n])
        for j in range(intervals):
            u = X[j * rows : (j + 1) * rows + n]
            _take(known, 0, u, ends)
            for g in range(groups):
                top, start, stop = degree * offsets[g], (degree - 1) * offsets[g], (degree - 1) * offsets[g + 1]
                behind = 2 * (n - offsets[g + 1])
                _backward(local[j], top, start, stop, inner + behind, here[j], known, behind)
                _put(u, inside[start:stop], here[j], top)
        _rows_again(x, chunk, X)


@helper
def _forward_transposed(block, top, left, right, tail, X, rest, behind):
    """Solve U^T z = x for the eliminated columns, in place.

    What z contributes to ``rest``, from ``behind`` on, is subtracted from it.
    """
    apart, after = block.strides[0], block.shape[1] - tail
    start = left
    while start < right:
        size = min(PANEL, right - start)
        first = top + start - left
        here, triangle = _address(X, first, 0), _address(block, first, start)
        _apply_triangle(here, triangle, apart, size, UPPER_TRANSPOSED)
        start += size
        _subtract_columns(_address(X, first + size, 0), _address(block, first, start), apart, here, right - start, size)
        if after > 0:
            _subtract_columns(_address(rest, behind, 0), _address(block, first, tail), apart, here, after, size)


@helper(inline=True)
def _carry_transposed(rows, i, number, left, right, Y, top, X):
    """The transpose of `_carry`: what multipliers Y of rows from i on contribute to those, X, of the rows from ``top`` on."""
    _subtract_columns(_address(X, top, 0), _address(rows, i, left), rows.strides[0], _address(Y, i, 0), right - left, number)


@helper
def _backward_transposed(block, top, bottom, left, right, pivots, X):
    """Apply the transpose of the elimination by the rows top ... bottom to the multipliers X of these rows."""
    apart = block.strides[0]
    below = top + right - left
    _carry_transposed(block, below, bottom - below, left, right, X, top, X)
    end = right
    while end > left:
        start = left + (end - left - 1) // PANEL * PANEL
        first, size = top + start - left, end - start
        here, triangle = _address(X, first, 0), _address(block, first, start)
        _apply_triangle(here, triangle, apart, size, LOWER_TRANSPOSED)
        _subtract_columns(_address(X, top, 0), _address(block, first, left), apart, here, start - left, size)
        end = start
    for c in range(right - 1, left - 1, -1):
        if pivots[c] != top + c - left:
            exchange(_address(X, top + c - left, 0), _address(X, pivots[c], 0), LANES)


@njit(
    "void(UniTuple(i8[::1], 9), f8[:,:,::1], f8[:,:,::1], f8[:,:,::1], f8[:,:,::1], f8[:,::1], i8[:,::1], i8[:,::1], i8[::1],"
    "Array(f8, 2, 'C', readonly=True), f8[:,::1])",
    cache=True,
    **_OPTIONS,
)
def solve_transposed(layout, local, border, chain, chain_border, dense, piv_local, piv_chain, piv_dense, c, y):
    """Solve J^T y = c with the factors for rows of c (m, unknowns) and of y (m, equations)."""
    _, offsets, follows, order, inside, ends, left, right, remaining = layout
    intervals, rows, width = local.shape
    n, groups = left.size, offsets.size - 1
    inner, degree = rows - n, rows // n
    r, k = border.shape[1], width - inner - 2 * n
    size, unknowns, equations = dense.shape[0], c.shape[1], y.shape[1]
    C, Y = np.empty((unknowns, LANES)), np.empty((equations, LANES))
    here, pair = np.empty((intervals, rows, LANES)), np.empty((2 * n, LANES))
    rest, z, edge = np.empty((2 * n + k, LANES)), np.empty((size, LANES)), np.empty((r, LANES))
    nothing = np.empty((1, LANES))
    for chunk in range(0, c.shape[0], LANES):
        _side_by_side(C, c, chunk)
        _move(rest[2 * n :], C[unknowns - k :])
        for j in range(intervals):
            v = C[j * rows : (j + 1) * rows + n]
            _take(rest, 0, v, ends)
            for g in range(groups):
                top, start, stop = degree * offsets[g], (degree - 1) * offsets[g], (degree - 1) * offsets[g + 1]
                behind = 2 * (n - offsets[g + 1])
                _take(here[j], top, v, inside[start:stop])
                _forward_transposed(local[j], top, start, stop, inner + behind, here[j], rest, behind)
            _put(v, ends, rest, 0)
        for j in range(1, intervals):
            _move(rest[:n], C[:n])
            _move(rest[n : 2 * n], C[(j + 1) * rows : (j + 1) * rows + n])
            _forward_transposed(chain[j - 1], 0, 0, n, n, C[j * rows : j * rows + n], rest, 0)
            _move(C[:n], rest[:n])
            _move(C[(j + 1) * rows : (j + 1) * rows + n], rest[n : 2 * n])
        _move(z[:n], C[:n])
        _move(z[n : 2 * n], C[unknowns - k - n : unknowns - k])
        _move(z[2 * n :], rest[2 * n :])
        _forward_transposed(dense, 0, 0, size, size, z, nothing, 0)
        _backward_transposed(dense, 0, size, 0, size, piv_dense, z)
        _move(Y[intervals * rows :], z[n:])
        _move(edge, z[size - r :])
        _move(pair[n:], z[:n])
        for j in range(intervals - 1, -1, -1):
            block = local[j]
            if j:
                _move(pair[:n], C[j * rows : j * rows + n])
                _carry_transposed(chain_border[j - 1], 0, r, 0, n, edge, 0, pair)
                _backward_transposed(chain[j - 1], 0, 2 * n, 0, n, piv_chain[j - 1], pair)
            _put(here[j], remaining, pair, n)
            _move(pair[n:], pair[:n])
            for g in range(groups - 1, -1, -1):
                top, start, stop = degree * offsets[g], (degree - 1) * offsets[g], (degree - 1) * offsets[g + 1]
                _carry_transposed(border[j], 0, r, start, stop, edge, top, here[j])
                for h in range(g + 1, groups):
                    if follows[g * groups + h]:
                        number = degree * (offsets[h + 1] - offsets[h])
                        _carry_transposed(block, degree * offsets[h], number, start, stop, here[j], top, here[j])
                _backward_transposed(block, top, degree * offsets[g + 1], start, stop, piv_local[j], here[j])
            _put(Y[j * rows : (j + 1) * rows], order, here[j], 0)
        _rows_again(y, chunk, Y)


class Factorization:
    """A factored bordered almost-block-diagonal matrix: solves, transposed solves, sign of the determinant.

    Parameters
    ----------
    layout : Layout
        Where the states' unknowns and equations stand in an interval's block, and which of them are coupled.
    local : ndarray, shape (intervals, n d, n (d + 1) + k)
        Collocation rows; columns [interior n (d - 1) | left and right end 2 n | parameters k]. Overwritten.
    border : ndarray, shape (intervals, r, n (d + 1) + k)
        Border rows on the same columns, each interval's share (a row is the sum over intervals); the last k columns
        are work space. Overwritten.
    corner : ndarray, shape (r, k)
        Border rows on the parameters. Overwritten.
    first, last : ndarray, shapes (n_bc, n) and (n_bc, n + k)
        Boundary conditions on the first mesh point, and on [last mesh point | parameters].

    Raises
    ------
    ValueError
        If the matrix is not square.
    """

    def __init__(self, layout: Layout, local: Array, border: Array, corner: Array, first: Array, last: Array) -> None:
        intervals, rows, width = local.shape
        r, k = corner.shape
        n = first.shape[1]
        size = 2 * n + k
        if n + len(first) + r != size:
            raise ValueError(f"{len(first)} boundary conditions and {r} border rows for {n} states and {k} parameters")
        self._unknowns = intervals * rows + n + k
        chain = np.empty((max(intervals - 1, 0), 2 * n, 3 * n + k))
        edge = np.empty((max(intervals - 1, 0), r, 3 * n + k))
        dense = np.empty((size, size))
        pivots = (
            np.empty((intervals, rows - n), np.int64),
            np.empty((max(intervals - 1, 0), n), np.int64),
            np.empty(size, np.int64),
        )
        sign = factorize(tuple(layout), local, border, corner, chain, edge, first, last, dense, *pivots)
        self._factors = (tuple(layout), local, border, chain, edge, dense, *pivots)
        #: Sign of the determinant up to a factor that depends on the shape only.
        self.sign = sign

    def solve(self, b: Array) -> Array:
        """The x (unknowns,) with J x = b (equations,); for several, rows of x and b (m, ...)."""
        return self._solved(solve, b)

    def solve_transposed(self, c: Array) -> Array:
        """The y (equations,) with J^T y = c (unknowns,); for several, rows of y and c (m, ...)."""
        return self._solved(solve_transposed, c)

    def _solved(self, how: Any, given: Array) -> Array:
        given = np.ascontiguousarray(given, dtype=float)
        result = np.empty((*given.shape[:-1], self._unknowns))
        how(*self._factors, given.reshape(-1, given.shape[-1]), result.reshape(-1, self._unknowns))
        return result
