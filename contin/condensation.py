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

Vectors of unknowns are [mesh and interior values in order | parameters]; vectors of equations are
[collocation | boundary | border rows].
"""

from __future__ import annotations

from typing import Any

import numpy as np

from contin._kernels import njit
from contin.interface import Array

_OPTIONS: dict[str, Any] = {"cache": True, "error_model": "numpy", "nogil": True, "fastmath": {"contract", "reassoc"}}


# Loops instead of numpy assignments: numba compiles them ten times faster, and they run as fast.


@njit(inline="never", **_OPTIONS)
def _copy(target, source):
    """target[...] = source for two matrices."""
    for i in range(target.shape[0]):
        for j in range(target.shape[1]):
            target[i, j] = source[i, j]


@njit(inline="never", **_OPTIONS)
def _copy_vector(target, source):
    """target[...] = source for two vectors."""
    for i in range(target.size):
        target[i] = source[i]


#: Pivots that are applied together to the rows below: each number loaded from memory then serves so many multiplications.
_PANEL = 4


@njit(inline="never", **_OPTIONS)
def _eliminate(block, columns, pivots, border, border_pivot):
    """Eliminate the first ``columns`` columns of ``block`` (rows, width) by partial pivoting, in place.

    ``border`` (r, width) holds rows that are reduced but never chosen as pivots. Multipliers stay where they are made.
    Returns the sign of the product of pivots, swaps included.
    """
    rows, width = block.shape
    sign = 1.0
    start = 0
    while start < columns:
        end = min(start + _PANEL, columns)
        for c in range(start, end):
            best, at = abs(block[c, c]), c
            for i in range(c + 1, rows):
                if abs(block[i, c]) > best:
                    best, at = abs(block[i, c]), i
            pivots[c] = at
            if at != c:
                sign = -sign
                _swap(block[c], block[at])
            pivot = block[c, c]
            if pivot < 0:
                sign = -sign
            border_pivot[0] = min(border_pivot[0], abs(pivot))
            inverse = 1 / pivot
            for i in range(c + 1, rows):
                _subtract(block, i, block, c, block[i, c] * inverse, c + 1, end)
            for i in range(border.shape[0]):
                _subtract(border, i, block, c, border[i, c] * inverse, c + 1, end)
            for above in range(start, c):
                _add_multiple(block[c, end:], -block[c, above], block[above, end:])
        _apply_panel(block, end, block, start, end)
        _apply_panel(border, 0, block, start, end)
        start = end
    return sign


# A loop from 0 over a slice is compiled to vector instructions; one from c + 1 over a row is not, because numba must allow for
# negative indices.


@njit(inline="always", **_OPTIONS)
def _swap(a, b):
    for j in range(a.size):
        a[j], b[j] = b[j], a[j]


@njit(inline="always", **_OPTIONS)
def _add_multiple(a, factor, b):
    for j in range(a.size):
        a[j] += factor * b[j]


@njit(inline="always", **_OPTIONS)
def _dot(a, b):
    total = 0.0
    for j in range(a.size):
        total += a[j] * b[j]
    return total


@njit(inline="always", **_OPTIONS)
def _subtract(rows, i, block, c, factor, first, last):
    """Keep the multiplier of row i, and subtract its multiple of pivot row c within the panel."""
    rows[i, c] = factor
    for j in range(first, last):
        rows[i, j] -= factor * block[c, j]


@njit(inline="never", **_OPTIONS)
def _apply_panel(rows, first, block, start, end):
    """Subtract the pivot rows start ... end of ``block`` from the rows from ``first`` on, right of the panel."""
    count, width = rows.shape
    if end - start < _PANEL:
        for i in range(first, count):
            for c in range(start, end):
                _add_multiple(rows[i, end:], -rows[i, c], block[c, end:])
        return
    p0, p1, p2, p3 = block[start, end:], block[start + 1, end:], block[start + 2, end:], block[start + 3, end:]
    i = first
    while i + 1 < count:  # two rows at a time share what is loaded of the pivot rows
        a, b = rows[i, end:], rows[i + 1, end:]
        a0, a1, a2, a3 = rows[i, start], rows[i, start + 1], rows[i, start + 2], rows[i, start + 3]
        b0, b1, b2, b3 = rows[i + 1, start], rows[i + 1, start + 1], rows[i + 1, start + 2], rows[i + 1, start + 3]
        for j in range(width - end):
            u0, u1, u2, u3 = p0[j], p1[j], p2[j], p3[j]
            a[j] -= a0 * u0 + a1 * u1 + a2 * u2 + a3 * u3
            b[j] -= b0 * u0 + b1 * u1 + b2 * u2 + b3 * u3
        i += 2
    if i < count:
        a = rows[i, end:]
        a0, a1, a2, a3 = rows[i, start], rows[i, start + 1], rows[i, start + 2], rows[i, start + 3]
        for j in range(width - end):
            a[j] -= a0 * p0[j] + a1 * p1[j] + a2 * p2[j] + a3 * p3[j]


@njit(
    "f8(i8, f8[:,:,::1], f8[:,:,::1], f8[:,::1], f8[:,:,::1], f8[:,:,::1], f8[:,::1], f8[:,::1], f8[:,::1],"
    "i8[:,::1], i8[:,::1], i8[::1])",
    **_OPTIONS,
)
def factorize(n, local, border, border_corner, chain, chain_border, first, last, dense, piv_local, piv_chain, piv_dense):
    """Factor in place; the arrays are described in `Factorization`. Returns the sign of the determinant."""
    intervals, rows, width = local.shape
    inner = rows - n
    r, k = border_corner.shape
    left, right, rest = inner, inner + n, inner + 2 * n
    smallest = np.full(1, np.inf)
    sign = 1.0
    for j in range(intervals):
        _copy(border[j, :, rest:], border_corner)
        sign *= _eliminate(local[j], inner, piv_local[j], border[j], smallest)
        _copy(border_corner, border[j, :, rest:])
    # rows left over from interval 0: coefficients of the first mesh point, of the current one, of the parameters
    current = np.zeros((n, 2 * n + k))
    _copy(current, local[0, inner:, left:])
    border_first, border_right = np.empty((r, n)), np.empty((r, n))
    _copy(border_first, border[0, :, left:right])
    _copy(border_right, border[0, :, right:rest])
    for j in range(1, intervals):
        block, edge = chain[j - 1], chain_border[j - 1]
        for i in range(2 * n):
            for b in range(3 * n + k):
                block[i, b] = 0.0
        _copy(block[:n, :n], current[:, n : 2 * n])
        _copy(block[:n, n : 2 * n], current[:, :n])
        _copy(block[:n, 3 * n :], current[:, 2 * n :])
        _copy(block[n:, :n], local[j, inner:, left:right])
        _copy(block[n:, 2 * n :], local[j, inner:, right:])
        for i in range(r):
            for b in range(n):
                edge[i, b] = border_right[i, b] + border[j, i, left + b]
        _copy(edge[:, n : 2 * n], border_first)
        _copy(edge[:, 2 * n : 3 * n], border[j, :, right:rest])
        _copy(edge[:, 3 * n :], border_corner)
        sign *= _eliminate(block, n, piv_chain[j - 1], edge, smallest)
        _copy(current, block[n:, n:])
        _copy(border_first, edge[:, n : 2 * n])
        _copy(border_right, edge[:, 2 * n : 3 * n])
        _copy(border_corner, edge[:, 3 * n :])
    bc = first.shape[0]
    _copy(dense[:n], current)
    _copy(dense[n : n + bc, :n], first)
    _copy(dense[n : n + bc, n:], last)
    _copy(dense[n + bc :, :n], border_first)
    _copy(dense[n + bc :, n : 2 * n], border_right)
    _copy(dense[n + bc :, 2 * n :], border_corner)
    return sign * _eliminate(dense, dense.shape[0], piv_dense, np.empty((0, dense.shape[0])), smallest)


#: Right-hand sides that are taken through the factors together: each number loaded from memory then serves so many.
_TOGETHER = 3


@njit(inline="always", **_OPTIONS)
def _dots(row, a, b, c):
    """Products of one row with three vectors."""
    p, q, r = 0.0, 0.0, 0.0
    for j in range(row.size):
        value = row[j]
        p += value * a[j]
        q += value * b[j]
        r += value * c[j]
    return p, q, r


@njit(inline="always", **_OPTIONS)
def _add_multiples(a, b, c, p, q, r, row):
    """Multiples of one row added to three vectors."""
    for j in range(row.size):
        value = row[j]
        a[j] += p * value
        b[j] += q * value
        c[j] += r * value


@njit(inline="never", **_OPTIONS)
def _forward(block, columns, pivots, border, X, Y):
    """Apply the elimination of ``block`` to right-hand sides: rows of X those of its rows, of Y those of the border."""
    count = X.shape[0]
    together = count - count % _TOGETHER
    for k in range(count):
        x = X[k]
        for c in range(columns):
            x[c], x[pivots[c]] = x[pivots[c]], x[c]
    for k in range(0, together, _TOGETHER):
        a, b, c = X[k], X[k + 1], X[k + 2]
        for i in range(1, block.shape[0]):
            upto = min(i, columns)
            p, q, r = _dots(block[i, :upto], a[:upto], b[:upto], c[:upto])
            a[i], b[i], c[i] = a[i] - p, b[i] - q, c[i] - r
        for i in range(border.shape[0]):
            p, q, r = _dots(border[i, :columns], a[:columns], b[:columns], c[:columns])
            Y[k, i], Y[k + 1, i], Y[k + 2, i] = Y[k, i] - p, Y[k + 1, i] - q, Y[k + 2, i] - r
    for k in range(together, count):
        x = X[k]
        for i in range(1, block.shape[0]):
            upto = min(i, columns)
            x[i] -= _dot(block[i, :upto], x[:upto])
        for i in range(border.shape[0]):
            Y[k, i] -= _dot(border[i, :columns], x[:columns])


@njit(inline="never", **_OPTIONS)
def _backward(block, columns, X, known):
    """Solve the upper triangle of the eliminated ``columns`` for X[:, :columns]; ``known`` are the unknowns after them."""
    count = X.shape[0]
    together = count - count % _TOGETHER
    for k in range(0, together, _TOGETHER):
        a, b, c = X[k], X[k + 1], X[k + 2]
        u, v, w = known[k], known[k + 1], known[k + 2]
        for i in range(columns - 1, -1, -1):
            p, q, r = _dots(block[i, i + 1 : columns], a[i + 1 : columns], b[i + 1 : columns], c[i + 1 : columns])
            s, t, o = _dots(block[i, columns:], u, v, w)
            inverse = 1 / block[i, i]
            a[i], b[i], c[i] = (a[i] - p - s) * inverse, (b[i] - q - t) * inverse, (c[i] - r - o) * inverse
    for k in range(together, count):
        x = X[k]
        for i in range(columns - 1, -1, -1):
            total = _dot(block[i, i + 1 : columns], x[i + 1 : columns]) + _dot(block[i, columns:], known[k])
            x[i] = (x[i] - total) / block[i, i]


@njit(
    "void(i8, f8[:,:,::1], f8[:,:,::1], f8[:,:,::1], f8[:,:,::1], f8[:,::1],i8[:,::1], i8[:,::1], i8[::1], f8[:,::1],"
    "f8[:,::1])",
    **_OPTIONS,
)
def solve(n, local, border, chain, chain_border, dense, piv_local, piv_chain, piv_dense, b, x):
    """Solve J x = b with the factors for rows of b (m, equations), which are overwritten, and of x (m, unknowns)."""
    intervals, rows, width = local.shape
    inner = rows - n
    r, k = border.shape[1], width - inner - 2 * n
    size, count = dense.shape[0], b.shape[0]
    here, edge = np.empty((count, rows)), np.empty((count, r))
    _copy(edge, b[:, b.shape[1] - r :])
    for j in range(intervals):
        _copy(here, b[:, j * rows : (j + 1) * rows])
        _forward(local[j], inner, piv_local[j], border[j], here, edge)
        _copy(b[:, j * rows : (j + 1) * rows], here)
    pair = np.empty((max(intervals - 1, 1), count, 2 * n))
    current = np.empty((count, n))
    _copy(current, b[:, inner:rows])
    for j in range(1, intervals):
        _copy(pair[j - 1, :, :n], current)
        _copy(pair[j - 1, :, n:], b[:, j * rows + inner : (j + 1) * rows])
        _forward(chain[j - 1], n, piv_chain[j - 1], chain_border[j - 1], pair[j - 1], edge)
        _copy(current, pair[j - 1, :, n:])
    z = np.empty((count, size))
    _copy(z[:, :n], current)
    _copy(z[:, n : size - r], b[:, intervals * rows : b.shape[1] - r])
    _copy(z[:, size - r :], edge)
    _forward(dense, size, piv_dense, np.empty((0, size)), z, edge)
    _backward(dense, size, z, np.empty((count, 0)))
    _copy(x[:, :n], z[:, :n])
    _copy(x[:, x.shape[1] - k - n :], z[:, n:])
    known = np.empty((count, 2 * n + k))
    _copy(known[:, :n], z[:, :n])
    _copy(known[:, 2 * n :], z[:, 2 * n :])
    for j in range(intervals - 1, 0, -1):
        _copy(known[:, n : 2 * n], x[:, (j + 1) * rows : (j + 1) * rows + n])
        _backward(chain[j - 1], n, pair[j - 1], known)
        _copy(x[:, j * rows : j * rows + n], pair[j - 1, :, :n])
    for j in range(intervals):
        _copy(known[:, :n], x[:, j * rows : j * rows + n])
        _copy(known[:, n : 2 * n], x[:, (j + 1) * rows : (j + 1) * rows + n])
        _copy(here[:, :inner], b[:, j * rows : j * rows + inner])
        _backward(local[j], inner, here, known)
        _copy(x[:, j * rows + n : (j + 1) * rows], here[:, :inner])


@njit(inline="never", **_OPTIONS)
def _forward_transposed(block, columns, X, rest):
    """Solve U^T z = x for the eliminated columns, in place; subtract what z contributes to the columns after them."""
    count, after = X.shape[0], block.shape[1] - columns
    together = count - count % _TOGETHER
    for k in range(0, together, _TOGETHER):
        a, b, c = X[k], X[k + 1], X[k + 2]
        u, v, w = rest[k, :after], rest[k + 1, :after], rest[k + 2, :after]
        for i in range(columns):
            inverse = 1 / block[i, i]
            p, q, r = a[i] * inverse, b[i] * inverse, c[i] * inverse
            a[i], b[i], c[i] = p, q, r
            _add_multiples(a[i + 1 : columns], b[i + 1 : columns], c[i + 1 : columns], -p, -q, -r, block[i, i + 1 : columns])
            _add_multiples(u, v, w, -p, -q, -r, block[i, columns:])
    for k in range(together, count):
        x, others = X[k], rest[k, :after]
        for i in range(columns):
            value = x[i] / block[i, i]
            x[i] = value
            if value != 0.0:
                _add_multiple(x[i + 1 : columns], -value, block[i, i + 1 : columns])
                _add_multiple(others, -value, block[i, columns:])


@njit(inline="never", **_OPTIONS)
def _backward_transposed(block, columns, pivots, border, X, Y):
    """Apply the transpose of the elimination of ``block`` to the multipliers X of its rows and Y of the border."""
    count = X.shape[0]
    together = count - count % _TOGETHER
    for k in range(0, together, _TOGETHER):
        a, b, c = X[k], X[k + 1], X[k + 2]
        for i in range(border.shape[0]):
            row = border[i, :columns]
            _add_multiples(a[:columns], b[:columns], c[:columns], -Y[k, i], -Y[k + 1, i], -Y[k + 2, i], row)
        for i in range(block.shape[0] - 1, 0, -1):
            upto = min(i, columns)
            _add_multiples(a[:upto], b[:upto], c[:upto], -a[i], -b[i], -c[i], block[i, :upto])
    for k in range(together, count):
        x = X[k]
        for i in range(border.shape[0]):
            _add_multiple(x[:columns], -Y[k, i], border[i, :columns])
        for i in range(block.shape[0] - 1, 0, -1):
            upto = min(i, columns)
            _add_multiple(x[:upto], -x[i], block[i, :upto])
    for k in range(count):
        x = X[k]
        for c in range(columns - 1, -1, -1):
            x[c], x[pivots[c]] = x[pivots[c]], x[c]


@njit(
    "void(i8, f8[:,:,::1], f8[:,:,::1], f8[:,:,::1], f8[:,:,::1], f8[:,::1],i8[:,::1], i8[:,::1], i8[::1], f8[:,::1],"
    "f8[:,::1])",
    **_OPTIONS,
)
def solve_transposed(n, local, border, chain, chain_border, dense, piv_local, piv_chain, piv_dense, c, y):
    """Solve J^T y = c with the factors for rows of c (m, unknowns), which are overwritten, and of y (m, equations)."""
    intervals, rows, width = local.shape
    inner = rows - n
    r, k = border.shape[1], width - inner - 2 * n
    size, count = dense.shape[0], c.shape[0]
    parameters = c.shape[1] - k
    rest, here = np.empty((count, 2 * n + k)), np.empty((count, rows))
    for j in range(intervals):
        _copy(rest[:, :n], c[:, j * rows : j * rows + n])
        _copy(rest[:, n : 2 * n], c[:, (j + 1) * rows : (j + 1) * rows + n])
        _copy(rest[:, 2 * n :], c[:, parameters:])
        _copy(here[:, :inner], c[:, j * rows + n : (j + 1) * rows])
        _forward_transposed(local[j], inner, here, rest)
        _copy(c[:, j * rows + n : (j + 1) * rows], here[:, :inner])
        _copy(c[:, j * rows : j * rows + n], rest[:, :n])
        _copy(c[:, (j + 1) * rows : (j + 1) * rows + n], rest[:, n : 2 * n])
        _copy(c[:, parameters:], rest[:, 2 * n :])
    for j in range(1, intervals):
        _copy(rest[:, :n], c[:, :n])
        _copy(rest[:, n : 2 * n], c[:, (j + 1) * rows : (j + 1) * rows + n])
        _copy(rest[:, 2 * n :], c[:, parameters:])
        _copy(here[:, :n], c[:, j * rows : j * rows + n])
        _forward_transposed(chain[j - 1], n, here, rest)
        _copy(c[:, j * rows : j * rows + n], here[:, :n])
        _copy(c[:, :n], rest[:, :n])
        _copy(c[:, (j + 1) * rows : (j + 1) * rows + n], rest[:, n : 2 * n])
        _copy(c[:, parameters:], rest[:, 2 * n :])
    z = np.empty((count, size))
    _copy(z[:, :n], c[:, :n])
    _copy(z[:, n:], c[:, parameters - n :])
    edge = np.empty((count, r))
    _forward_transposed(dense, size, z, rest)
    _backward_transposed(dense, size, piv_dense, np.empty((0, size)), z, edge)
    _copy(y[:, intervals * rows :], z[:, n:])
    _copy(edge, z[:, size - r :])
    current = np.empty((count, n))
    _copy(current, z[:, :n])
    pair = np.empty((count, 2 * n))
    for j in range(intervals - 1, 0, -1):
        _copy(pair[:, :n], c[:, j * rows : j * rows + n])
        _copy(pair[:, n:], current)
        _backward_transposed(chain[j - 1], n, piv_chain[j - 1], chain_border[j - 1], pair, edge)
        _copy(current, pair[:, :n])
        _copy(y[:, j * rows + inner : (j + 1) * rows], pair[:, n:])
    _copy(y[:, inner:rows], current)
    for j in range(intervals):
        _copy(here[:, :inner], c[:, j * rows + n : (j + 1) * rows])
        _copy(here[:, inner:], y[:, j * rows + inner : (j + 1) * rows])
        _backward_transposed(local[j], inner, piv_local[j], border[j], here, edge)
        _copy(y[:, j * rows : (j + 1) * rows], here)


class Factorization:
    """A factored bordered almost-block-diagonal matrix: solves, transposed solves, sign of the determinant.

    Parameters
    ----------
    local : ndarray, shape (intervals, n d, n (d + 1) + k)
        Collocation rows; columns [interior n (d - 1) | left n | right n | parameters k]. Overwritten.
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

    def __init__(self, local: Array, border: Array, corner: Array, first: Array, last: Array) -> None:
        intervals, rows, width = local.shape
        r, k = corner.shape
        n = first.shape[1]
        size = 2 * n + k
        if n + len(first) + r != size:
            raise ValueError(f"{len(first)} boundary conditions and {r} border rows for {n} states and {k} parameters")
        self._n = n
        self._unknowns = intervals * rows + n + k
        chain = np.empty((max(intervals - 1, 0), 2 * n, 3 * n + k))
        edge = np.empty((max(intervals - 1, 0), r, 3 * n + k))
        dense = np.empty((size, size))
        pivots = (
            np.empty((intervals, rows - n), np.int64),
            np.empty((max(intervals - 1, 0), n), np.int64),
            np.empty(size, np.int64),
        )
        sign = factorize(n, local, border, corner, chain, edge, first, last, dense, *pivots)
        self._factors = (n, local, border, chain, edge, dense, *pivots)
        #: Sign of the determinant up to a factor that depends on the shape only.
        self.sign = sign if np.isfinite(dense[-1, -1]) else np.nan

    def solve(self, b: Array) -> Array:
        """The x (unknowns,) with J x = b (equations,); for several, rows of x and b (m, ...)."""
        return self._solved(solve, b)

    def solve_transposed(self, c: Array) -> Array:
        """The y (equations,) with J^T y = c (unknowns,); for several, rows of y and c (m, ...)."""
        return self._solved(solve_transposed, c)

    def _solved(self, how: Any, given: Array) -> Array:
        given = np.array(given, dtype=float)
        result = np.empty((*given.shape[:-1], self._unknowns))
        how(*self._factors, given.reshape(-1, given.shape[-1]), result.reshape(-1, self._unknowns))
        return result
