"""Substitution: solves with an eliminated matrix and with its transpose.

Right-hand sides stand side by side: each entry of a vector here is `LANES` numbers, one for each right-hand side. A vector is
given by the address of its first entry.
"""

from __future__ import annotations

from typing import NamedTuple

from contin.functions.kernel import kernel
from contin.functions.kernel_parts import Matrix, ReadOnlyMatrix, helper
from contin.linalg.elimination import Eliminated, Range, at, group_step, point_step, whole_step
from contin.linalg.layout import Layout
from contin.linalg.vector import (
    LANES,
    PANEL,
    Rows,
    apart,
    apply_lower,
    apply_lower_transposed,
    apply_upper,
    apply_upper_transposed,
    exchange,
    move,
    side_by_side,
    subtract_columns,
    subtract_rows,
)

# --- addresses -------------------------------------------------------------------------------------------------------


@helper(inline=True)
def _entry(vector, i):
    """Return the address of an entry of a vector."""
    return vector + 8 * LANES * i


@helper(inline=True)
def _part(block, i, j):
    """Return the rows of a block from entry (i, j) on."""
    return Rows(block.address + i * block.stride + 8 * j, block.stride)


@helper(inline=True)
def _page(stack, j):
    """Return the rows of a stack's matrix j."""
    return Rows(stack.ctypes.data + j * stack.strides[0], stack.strides[1])


class Vectors(NamedTuple):
    """Vectors of a solve, for the sizes of `Blocks`; those of a transposed solve are in brackets.

    ``given`` (equations,) is the right-hand side, ``found`` (unknowns,) the solution [the other way round]. ``inner`` (N, n d)
    are entries of the rows of each interval, ``pair`` (N, 2 n) of the first 2 n rows of each mesh point, ``border`` (r,) of
    the border rows, ``dense`` (2 n + k,) of the dense rest. ``known`` (2 n + k,) are the unknowns that a block's unknowns
    depend on [what is left of the right-hand sides for them].
    """

    given: int
    found: int
    inner: int
    pair: int
    border: int
    dense: int
    known: int


def work_size(intervals: int, rows: int, n: int, r: int, size: int) -> int:
    """Return the number of entries of the `Vectors`, for blocks of n d ``rows`` and a dense rest of 2 n + k = ``size`` rows."""
    return 2 * (intervals * rows + size - n) + intervals * (rows + 2 * n) + r + 2 * size


@helper(inline=True)
def _vectors(factors, n, work):
    """Return places of the vectors in work space of `work_size` entries."""
    (intervals, rows, _), size = factors.local.shape, factors.dense.shape[0]
    unknowns = intervals * rows + size - n
    given = _entry(work.ctypes.data, 0)
    found = _entry(given, unknowns)
    inner = _entry(found, unknowns)
    pair = _entry(inner, intervals * rows)
    border = _entry(pair, intervals * 2 * n)
    dense = _entry(border, factors.border.shape[1])
    return Vectors(given, found, inner, pair, border, dense, _entry(dense, size))


@helper
def _move(target, source, count):
    """Copy ``count`` entries."""
    for k in range(count):
        move(_entry(target, k), _entry(source, k))


@helper
def _take(target, source, places, part):
    """Fill entries of ``target`` with source[places[part]]."""
    for k in range(part.first, part.last):
        move(_entry(target, k - part.first), _entry(source, places[k]))


@helper
def _put(target, places, part, source):
    """Put entries of ``source`` at target[places[part]]."""
    for k in range(part.first, part.last):
        move(_entry(target, places[k]), _entry(source, k - part.first))


# --- substitution with the rows and columns of one elimination -------------------------------------------------------


@helper
def _forward(block, step, pivots, x):
    """Apply an elimination to the right-hand sides x of the rows of a block."""
    top, bottom, left, right, _, _ = step
    for c in range(left, right):
        if pivots[c] != top + c - left:
            exchange(_entry(x, top + c - left), _entry(x, pivots[c]), LANES)
    for start in range(left, right, PANEL):
        size, row = min(PANEL, right - start), top + start - left
        subtract_rows(_entry(x, row), _part(block, row, left), _entry(x, top), start - left, size)
        apply_lower(_entry(x, row), _part(block, row, start), size)
    row = top + right - left
    subtract_rows(_entry(x, row), _part(block, row, left), _entry(x, top), right - left, bottom - row)


@helper(inline=True)
def _subtract(matrix, rows, step, x, y):
    """Apply an elimination to the right-hand sides y of reduced ``rows`` of a matrix; x are those of the block."""
    reduced, pivots = _part(matrix, rows.first, step.left), _entry(x, step.top)
    subtract_rows(_entry(y, rows.first), reduced, pivots, step.right - step.left, rows.last - rows.first)


@helper
def _backward(block, step, x, known):
    """Solve the upper triangle of an elimination for x; ``known`` are the unknowns of the columns from the tail on."""
    top, _, left, right, tail, width = step
    if width > tail:
        subtract_rows(_entry(x, top), _part(block, top, tail), known, width - tail, right - left)
    end = right
    while end > left:
        start = left + (end - left - 1) // PANEL * PANEL
        row, after = top + start - left, top + end - left
        subtract_rows(_entry(x, row), _part(block, row, end), _entry(x, after), right - end, end - start)
        apply_upper(_entry(x, row), _part(block, row, start), end - start)
        end = start


@helper
def _forward_transposed(block, step, x, rest):
    """Solve U^T z = x for the eliminated columns, in place; subtract from ``rest`` what z contributes from the tail on."""
    top, _, left, right, tail, width = step
    for start in range(left, right, PANEL):
        end, row = min(start + PANEL, right), top + start - left
        size, after = end - start, top + end - left
        apply_upper_transposed(_entry(x, row), _part(block, row, start), size)
        subtract_columns(_entry(x, after), _part(block, row, end), _entry(x, row), right - end, size)
        if width > tail:
            subtract_columns(rest, _part(block, row, tail), _entry(x, row), width - tail, size)


@helper(inline=True)
def _subtract_transposed(matrix, rows, step, y, x):
    """Subtract from x what the multipliers y of reduced ``rows`` of a matrix contribute to those of the block."""
    reduced, pivots = _part(matrix, rows.first, step.left), _entry(x, step.top)
    subtract_columns(pivots, reduced, _entry(y, rows.first), step.right - step.left, rows.last - rows.first)


@helper
def _backward_transposed(block, step, pivots, x):
    """Apply the transpose of an elimination to the multipliers x of the rows of a block."""
    top, bottom, left, right, _, _ = step
    row = top + right - left
    subtract_columns(_entry(x, top), _part(block, row, left), _entry(x, row), right - left, bottom - row)
    end = right
    while end > left:
        start = left + (end - left - 1) // PANEL * PANEL
        row = top + start - left
        apply_lower_transposed(_entry(x, row), _part(block, row, start), end - start)
        subtract_columns(_entry(x, top), _part(block, row, left), _entry(x, row), start - left, end - start)
        end = start
    for c in range(right - 1, left - 1, -1):
        if pivots[c] != top + c - left:
            exchange(_entry(x, top + c - left), _entry(x, pivots[c]), LANES)


# --- solve: the stages, one after the other, and unknowns in the reverse order ---------------------------------------


@helper(inline=True)
def _forward_interiors(layout, factors, vectors):
    """Apply stage 1: fill ``inner``, the second half of each ``pair``, and reduce the ``border``."""
    offsets, follows = layout.offsets, layout.follows
    n, groups, (intervals, rows, width) = layout.order.size, layout.offsets.size - 1, factors.local.shape
    r, degree = factors.border.shape[1], rows // n
    for j in range(intervals):
        block, edge, pivots = _page(factors.local, j), _page(factors.border, j), factors.pivots[j]
        inner, remaining = _entry(vectors.inner, j * rows), _entry(vectors.pair, (2 * j + 1) * n)
        _take(inner, _entry(vectors.given, j * rows), layout.rows, Range(0, rows))
        for g in range(groups):
            step = group_step(offsets, g, degree, width)
            _forward(block, step, pivots, inner)
            for h in range(g + 1, groups):
                if follows[g * groups + h]:
                    _subtract(block, Range(degree * offsets[h], degree * offsets[h + 1]), step, inner, inner)
            _subtract(edge, Range(0, r), step, inner, vectors.border)
            size = offsets[g + 1] - offsets[g]
            _move(_entry(remaining, offsets[g]), _entry(inner, step.bottom - size), size)


@helper(inline=True)
def _forward_points(factors, n, vectors):
    """Apply stage 2: fill the first half of each ``pair``, and reduce the ``border``."""
    points, rows, width = factors.chain.shape
    step = point_step(n, width)
    for j in range(points):
        block, pair = _page(factors.chain, j), _entry(vectors.pair, 2 * n * (j + 1))
        _move(pair, _entry(pair, -n), n)
        _forward(block, step, factors.pivots[j + 1, factors.pivots.shape[1] - n :], pair)
        _subtract(_part(block, 2 * n, 0), Range(0, rows - 2 * n), step, pair, vectors.border)


@helper(inline=True)
def _solve_dense(factors, x):
    """Solve stage 3: replace the right-hand sides by [first point | last point | parameters]."""
    block, step = at(factors.dense, 0, 0), whole_step(factors.dense.shape[0])
    _forward(block, step, factors.pivots_dense, x)
    _backward(block, step, x, x)


@helper(inline=True)
def _backward_points(factors, n, vectors):
    """Solve for the mesh points N - 1 ... 1, with [first point | next point | parameters] ``known``."""
    rows, (points, _, width) = factors.local.shape[1], factors.chain.shape
    step = point_step(n, width)
    for j in range(points - 1, -1, -1):
        pair, point = _entry(vectors.pair, 2 * n * (j + 1)), _entry(vectors.found, (j + 1) * rows)
        _move(_entry(vectors.known, n), _entry(point, rows), n)
        _backward(_page(factors.chain, j), step, pair, vectors.known)
        _move(point, pair, n)


@helper(inline=True)
def _backward_interiors(layout, factors, vectors):
    """Solve for the interior unknowns of each interval, with [both ends | parameters] ``known``."""
    offsets, n, (intervals, rows, width) = layout.offsets, layout.order.size, factors.local.shape
    for j in range(intervals):
        block, inner, found = _page(factors.local, j), _entry(vectors.inner, j * rows), _entry(vectors.found, j * rows)
        _take(vectors.known, found, layout.ends, Range(0, 2 * n))
        for g in range(offsets.size - 1):
            step = group_step(offsets, g, rows // n, width)
            _backward(block, step, inner, _entry(vectors.known, 2 * (n - offsets[g + 1])))
            _put(found, layout.inside, Range(step.left, step.right), _entry(inner, step.top))


@kernel
def solve(layout: Layout, factors: Eliminated, b: ReadOnlyMatrix, x: Matrix, work: Matrix) -> None:
    """Solve J x = b for rows of b (m, equations) and of x (m, unknowns), with ``work`` (`work_size`, LANES)."""
    n, intervals, rows, r = layout.order.size, factors.local.shape[0], factors.local.shape[1], factors.border.shape[1]
    size, unknowns, vectors = factors.dense.shape[0], x.shape[1], _vectors(factors, n, work)
    _, _, _, pair, border, dense, known = vectors
    for first in range(0, b.shape[0], LANES):
        side_by_side(vectors.given, at(b, first, 0), unknowns, b.shape[0] - first)
        _move(border, _entry(vectors.given, unknowns - r), r)
        _forward_interiors(layout, factors, vectors)
        _forward_points(factors, n, vectors)
        _move(dense, _entry(pair, (2 * intervals - 1) * n), n)
        _move(_entry(dense, n), _entry(vectors.given, intervals * rows), size - n - r)
        _move(_entry(dense, size - r), border, r)
        _solve_dense(factors, dense)
        _move(vectors.found, dense, n)
        _move(_entry(vectors.found, intervals * rows), _entry(dense, n), size - n)
        _move(known, dense, size)
        _backward_points(factors, n, vectors)
        _backward_interiors(layout, factors, vectors)
        apart(at(x, first, 0), vectors.found, unknowns, x.shape[0] - first)


# --- transposed solve: triangles in the order of the stages, and multipliers in the reverse order --------------------


@helper(inline=True)
def _interiors_transposed(layout, factors, vectors):
    """Solve the triangles of stage 1: fill ``inner``; subtract what it contributes to both ends and to the parameters."""
    offsets, n, (intervals, rows, width) = layout.offsets, layout.order.size, factors.local.shape
    for j in range(intervals):
        block, inner, given = _page(factors.local, j), _entry(vectors.inner, j * rows), _entry(vectors.given, j * rows)
        _take(vectors.known, given, layout.ends, Range(0, 2 * n))
        for g in range(offsets.size - 1):
            step = group_step(offsets, g, rows // n, width)
            _take(_entry(inner, step.top), given, layout.inside, Range(step.left, step.right))
            _forward_transposed(block, step, inner, _entry(vectors.known, 2 * (n - offsets[g + 1])))
        _put(given, layout.ends, Range(0, 2 * n), vectors.known)


@helper(inline=True)
def _points_transposed(factors, n, vectors):
    """Solve the triangles of stage 2; subtract what they contribute to the first and the next point and the parameters."""
    rows, (points, _, width) = factors.local.shape[1], factors.chain.shape
    step, first, known = point_step(n, width), vectors.given, vectors.known
    _move(known, first, n)
    for j in range(points):
        point = _entry(vectors.given, (j + 1) * rows)
        _move(_entry(known, n), _entry(point, rows), n)
        _forward_transposed(_page(factors.chain, j), step, point, known)
        _move(_entry(point, rows), _entry(known, n), n)
    _move(first, known, n)


@helper(inline=True)
def _solve_dense_transposed(factors, x):
    """Solve the transpose of stage 3: replace [first point | last point | parameters] by multipliers of its rows."""
    block, step = at(factors.dense, 0, 0), whole_step(factors.dense.shape[0])
    _forward_transposed(block, step, x, x)
    _backward_transposed(block, step, factors.pivots_dense, x)


@helper(inline=True)
def _multipliers_of_points(factors, n, vectors):
    """Apply the transpose of stage 2: fill each ``pair`` with the multipliers of its rows."""
    rows, (points, height, width) = factors.local.shape[1], factors.chain.shape
    step = point_step(n, width)
    for j in range(points - 1, -1, -1):
        block, pair = _page(factors.chain, j), _entry(vectors.pair, 2 * n * (j + 1))
        _move(pair, _entry(vectors.given, (j + 1) * rows), n)
        _subtract_transposed(_part(block, 2 * n, 0), Range(0, height - 2 * n), step, vectors.border, pair)
        _backward_transposed(block, step, factors.pivots[j + 1, factors.pivots.shape[1] - n :], pair)
        _move(_entry(pair, -n), pair, n)


@helper(inline=True)
def _multipliers_of_interiors(layout, factors, vectors):
    """Apply the transpose of stage 1: fill the collocation rows of ``found`` with their multipliers."""
    offsets, follows = layout.offsets, layout.follows
    n, groups, (intervals, rows, width) = layout.order.size, layout.offsets.size - 1, factors.local.shape
    r, degree = factors.border.shape[1], rows // n
    for j in range(intervals):
        block, edge, pivots = _page(factors.local, j), _page(factors.border, j), factors.pivots[j]
        inner, remaining = _entry(vectors.inner, j * rows), _entry(vectors.pair, (2 * j + 1) * n)
        for g in range(groups - 1, -1, -1):
            step, size = group_step(offsets, g, degree, width), offsets[g + 1] - offsets[g]
            _move(_entry(inner, step.bottom - size), _entry(remaining, offsets[g]), size)
            _subtract_transposed(edge, Range(0, r), step, vectors.border, inner)
            for h in range(g + 1, groups):
                if follows[g * groups + h]:
                    _subtract_transposed(block, Range(degree * offsets[h], degree * offsets[h + 1]), step, inner, inner)
            _backward_transposed(block, step, pivots, inner)
        _put(_entry(vectors.found, j * rows), layout.rows, Range(0, rows), inner)


@kernel
def solve_transposed(layout: Layout, factors: Eliminated, c: ReadOnlyMatrix, y: Matrix, work: Matrix) -> None:
    """Solve J^T y = c for rows of c (m, unknowns) and of y (m, equations), with ``work`` (`work_size`, LANES)."""
    n, intervals, rows, r = layout.order.size, factors.local.shape[0], factors.local.shape[1], factors.border.shape[1]
    size, unknowns, vectors = factors.dense.shape[0], y.shape[1], _vectors(factors, n, work)
    _, _, _, pair, border, dense, known = vectors
    for first in range(0, c.shape[0], LANES):
        side_by_side(vectors.given, at(c, first, 0), unknowns, c.shape[0] - first)
        parameters = _entry(vectors.given, intervals * rows + n)
        _move(_entry(known, 2 * n), parameters, size - 2 * n)
        _interiors_transposed(layout, factors, vectors)
        _points_transposed(factors, n, vectors)
        _move(dense, vectors.given, n)
        _move(_entry(dense, n), _entry(parameters, -n), n)
        _move(_entry(dense, 2 * n), _entry(known, 2 * n), size - 2 * n)
        _solve_dense_transposed(factors, dense)
        _move(_entry(vectors.found, intervals * rows), _entry(dense, n), size - n)
        _move(border, _entry(dense, size - r), r)
        _move(_entry(pair, (2 * intervals - 1) * n), dense, n)
        _multipliers_of_points(factors, n, vectors)
        _multipliers_of_interiors(layout, factors, vectors)
        apart(at(y, first, 0), vectors.found, unknowns, y.shape[0] - first)
