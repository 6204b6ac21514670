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
from contin.linalg.segments import ALL, Share
from contin.linalg.vector import (
    LANES,
    PANEL,
    Rows,
    add,
    apart,
    apply_lower,
    apply_lower_transposed,
    apply_upper,
    apply_upper_transposed,
    clear,
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
    """Vectors of a segment in a solve, for m intervals and the sizes of `Blocks`; those of a transposed solve are in brackets.

    ``given`` (m n d + n,) is the segment's part of the right-hand side, ``found`` (m n d + n,) of the solution [the other way
    round]: in both a vector of unknowns has the last mesh point. ``inner`` (m, n d) are entries of the rows of each interval,
    ``pair`` (m, 2 n) of the first 2 n rows of each mesh point, ``border`` (r,) of the border rows. ``known`` (2 n + k,) are the
    unknowns that a block's unknowns depend on [what is left of the right-hand sides for them].
    """

    given: int
    found: int
    inner: int
    pair: int
    border: int
    known: int


class Joint(NamedTuple):
    """The vectors that all segments share.

    ``rest`` (n + k,) is the right-hand side behind the collocation rows, and then the solution there. ``dense`` (2 n + k,) are
    entries of the dense rest, ``known`` and ``border`` as in `Vectors`. ``pair`` (S + 1, 2 n) belongs to the mesh points on the
    left of the segments, and its last entries to the last mesh point.
    """

    rest: int
    dense: int
    known: int
    border: int
    pair: int


def work_size(segments: int, intervals: int, rows: int, n: int, r: int, size: int) -> int:
    """Return the number of entries of `Joint` and `Vectors`, for blocks of n d ``rows`` and a dense rest of ``size`` rows."""
    return 3 * size - n + r + (segments + 1) * 2 * n + intervals * (3 * rows + 2 * n) + segments * (2 * n + r + size)


@helper(inline=True)
def _joint(factors, n, work, segments):
    """Return places of the joint vectors in work space of `work_size` entries."""
    size = factors.dense.shape[0]
    rest = _entry(work.ctypes.data, 0)
    dense = _entry(rest, size - n)
    known = _entry(dense, size)
    border = _entry(known, size)
    return Joint(rest, dense, known, border, _entry(border, factors.border.shape[1]))


@helper(inline=True)
def _vectors(factors, n, work, starts, s):
    """Return places of the vectors of segment s in work space of `work_size` entries."""
    rows, r, size, segments = factors.local.shape[1], factors.border.shape[1], factors.dense.shape[0], starts.size - 1
    first, count = starts[s], starts[s + 1] - starts[s]
    before = 3 * size - n + r + (segments + 1) * 2 * n + first * (3 * rows + 2 * n) + s * (2 * n + r + size)
    given = _entry(work.ctypes.data, before)
    found = _entry(given, count * rows + n)
    inner = _entry(found, count * rows + n)
    pair = _entry(inner, count * rows)
    border = _entry(pair, count * 2 * n)
    return Vectors(given, found, inner, pair, border, _entry(border, r))


@helper
def _move(target, source, count):
    """Copy ``count`` entries."""
    for k in range(count):
        move(_entry(target, k), _entry(source, k))


@helper
def _clear(target, count):
    """Fill ``count`` entries with zeros."""
    for k in range(count):
        clear(_entry(target, k))


@helper
def _add(target, source, count):
    """Add ``count`` entries."""
    for k in range(count):
        add(_entry(target, k), _entry(source, k))


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
def _forward_interiors(layout, factors, part, vectors):
    """Apply stage 1: fill ``inner``, the second half of each ``pair``, and reduce the ``border``."""
    offsets, follows = layout.offsets, layout.follows
    n, groups, (_, rows, width) = layout.order.size, layout.offsets.size - 1, factors.local.shape
    r, degree = factors.border.shape[1], rows // n
    for j in range(part.first, part.last):
        block, edge, pivots, i = _page(factors.local, j), _page(factors.border, j), factors.pivots[j], j - part.first
        inner, remaining = _entry(vectors.inner, i * rows), _entry(vectors.pair, (2 * i + 1) * n)
        _take(inner, _entry(vectors.given, i * rows), layout.rows, Range(0, rows))
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
def _forward_point(factors, n, j, pair, border):
    """Apply the elimination of mesh point j to the ``pair`` of its rows, and reduce the ``border``."""
    block, (_, rows, width) = _page(factors.chain, j - 1), factors.chain.shape
    step = point_step(n, width)
    _forward(block, step, factors.pivots[j, factors.pivots.shape[1] - n :], pair)
    _subtract(_part(block, 2 * n, 0), Range(0, rows - 2 * n), step, pair, border)


@helper(inline=True)
def _forward_points(factors, n, part, vectors):
    """Apply stage 2: fill the first half of each ``pair``, and reduce the ``border``."""
    for j in range(part.first + 1, part.last):
        pair = _entry(vectors.pair, 2 * n * (j - part.first))
        _move(pair, _entry(pair, -n), n)
        _forward_point(factors, n, j, pair, vectors.border)


@helper(inline=True)
def _solve_dense(factors, x):
    """Solve stage 4: replace the right-hand sides by [first point | last point | parameters]."""
    block, step = at(factors.dense, 0, 0), whole_step(factors.dense.shape[0])
    _forward(block, step, factors.pivots_dense, x)
    _backward(block, step, x, x)


@helper(inline=True)
def _backward_point(factors, n, j, pair, known):
    """Solve for mesh point j, with [first point | next point | parameters] ``known``."""
    _backward(_page(factors.chain, j - 1), point_step(n, factors.chain.shape[2]), pair, known)


@helper(inline=True)
def _backward_points(factors, n, part, vectors):
    """Solve for the mesh points inside a segment, the last one first."""
    rows = factors.local.shape[1]
    for j in range(part.last - 1, part.first, -1):
        pair, point = _entry(vectors.pair, 2 * n * (j - part.first)), _entry(vectors.found, (j - part.first) * rows)
        _move(_entry(vectors.known, n), _entry(point, rows), n)
        _backward_point(factors, n, j, pair, vectors.known)
        _move(point, pair, n)


@helper(inline=True)
def _backward_interiors(layout, factors, part, vectors):
    """Solve for the interior unknowns of each interval, with [both ends | parameters] ``known``."""
    offsets, n, (_, rows, width) = layout.offsets, layout.order.size, factors.local.shape
    for j in range(part.first, part.last):
        block, i = _page(factors.local, j), j - part.first
        inner, found = _entry(vectors.inner, i * rows), _entry(vectors.found, i * rows)
        _take(vectors.known, found, layout.ends, Range(0, 2 * n))
        for g in range(offsets.size - 1):
            step = group_step(offsets, g, rows // n, width)
            _backward(block, step, inner, _entry(vectors.known, 2 * (n - offsets[g + 1])))
            _put(found, layout.inside, Range(step.left, step.right), _entry(inner, step.top))


@helper(inline=True)
def _solve_joint(factors, n, starts, work):
    """Apply stage 3 and solve stages 4 and 3: the mesh points between segments, both ends, and the parameters.

    Each segment gives what it carries, the second half of its last ``pair``, and its ``border``; it gets both its ends, the
    first mesh point of the segment in ``known``, and the parameters there.
    """
    rows, r, size, segments = factors.local.shape[1], factors.border.shape[1], factors.dense.shape[0], starts.size - 1
    joint = _joint(factors, n, work, segments)
    for s in range(segments):
        vectors, pair = _vectors(factors, n, work, starts, s), _entry(joint.pair, 2 * n * s)
        _move(_entry(pair, n), _entry(vectors.pair, (2 * (starts[s + 1] - starts[s]) - 1) * n), n)
        if s == 0:
            _move(joint.border, vectors.border, r)
        else:
            _add(joint.border, vectors.border, r)
    for s in range(1, segments):
        pair = _entry(joint.pair, 2 * n * s)
        _move(pair, _entry(pair, -n), n)
        _forward_point(factors, n, starts[s], pair, joint.border)
    _move(joint.dense, _entry(joint.pair, (2 * segments - 1) * n), n)
    _move(_entry(joint.dense, n), joint.rest, size - n - r)
    _move(_entry(joint.dense, size - r), joint.border, r)
    _solve_dense(factors, joint.dense)
    _move(joint.rest, _entry(joint.dense, n), size - n)
    _move(joint.known, joint.dense, size)
    for s in range(segments - 1, -1, -1):
        vectors, pair = _vectors(factors, n, work, starts, s), _entry(joint.pair, 2 * n * s)
        _move(_entry(vectors.found, (starts[s + 1] - starts[s]) * rows), _entry(joint.known, n), n)
        if s > 0:
            _backward_point(factors, n, starts[s], pair, joint.known)
            _move(_entry(joint.known, n), pair, n)
        else:
            _move(_entry(joint.known, n), joint.known, n)
        _move(vectors.found, _entry(joint.known, n), n)
        _move(vectors.known, vectors.found, n)
        _move(_entry(vectors.known, 2 * n), _entry(joint.known, 2 * n), size - 2 * n)


@kernel
def solve(layout: Layout, factors: Eliminated, b: ReadOnlyMatrix, x: Matrix, work: Matrix, share: Share) -> None:
    """Solve J x = b for rows of b (m, equations) and of x (m, unknowns), with ``work`` (`work_size`, LANES).

    The stages of a `Share` are: elimination in segments, what joins them, substitution in segments. A share that is not the
    whole takes at most `LANES` rows.
    """
    n, rows, r, size = layout.order.size, factors.local.shape[1], factors.border.shape[1], factors.dense.shape[0]
    starts, tail = share.starts, size - n
    collocation, segments = factors.local.shape[0] * rows, starts.size - 1
    joint = _joint(factors, n, work, segments)
    for first in range(0, b.shape[0], LANES):
        given, found, count = at(b, first, 0), at(x, first, 0), b.shape[0] - first
        if share.stage == 0 or share.stage == ALL:
            for s in range(share.first, share.last):
                part, vectors = Range(starts[s], starts[s + 1]), _vectors(factors, n, work, starts, s)
                side_by_side(vectors.given, _part(given, 0, part.first * rows), (part.last - part.first) * rows, count)
                if s == 0:
                    side_by_side(joint.rest, _part(given, 0, collocation), tail, count)
                    _move(vectors.border, _entry(joint.rest, tail - r), r)
                else:
                    _clear(vectors.border, r)
                _forward_interiors(layout, factors, part, vectors)
                _forward_points(factors, n, part, vectors)
        if share.stage == 1 or share.stage == ALL:
            _solve_joint(factors, n, starts, work)
            apart(_part(found, 0, collocation), joint.rest, tail, count)
        if share.stage == 2 or share.stage == ALL:
            for s in range(share.first, share.last):
                part, vectors = Range(starts[s], starts[s + 1]), _vectors(factors, n, work, starts, s)
                _backward_points(factors, n, part, vectors)
                _backward_interiors(layout, factors, part, vectors)
                apart(_part(found, 0, part.first * rows), vectors.found, (part.last - part.first) * rows, count)


# --- transposed solve: triangles in the order of the stages, and multipliers in the reverse order --------------------


@helper(inline=True)
def _interiors_transposed(layout, factors, part, vectors):
    """Solve the triangles of stage 1: fill ``inner``; subtract what it contributes to both ends and to the parameters."""
    offsets, n, (_, rows, width) = layout.offsets, layout.order.size, factors.local.shape
    for j in range(part.first, part.last):
        block, i = _page(factors.local, j), j - part.first
        inner, given = _entry(vectors.inner, i * rows), _entry(vectors.given, i * rows)
        _take(vectors.known, given, layout.ends, Range(0, 2 * n))
        for g in range(offsets.size - 1):
            step = group_step(offsets, g, rows // n, width)
            _take(_entry(inner, step.top), given, layout.inside, Range(step.left, step.right))
            _forward_transposed(block, step, inner, _entry(vectors.known, 2 * (n - offsets[g + 1])))
        _put(given, layout.ends, Range(0, 2 * n), vectors.known)


@helper(inline=True)
def _point_transposed(factors, n, j, point, after, known):
    """Solve the triangle of mesh point j; subtract what it contributes to the first one, the one ``after``, and parameters."""
    _move(_entry(known, n), after, n)
    _forward_transposed(_page(factors.chain, j - 1), point_step(n, factors.chain.shape[2]), point, known)
    _move(after, _entry(known, n), n)


@helper(inline=True)
def _points_transposed(factors, n, part, vectors):
    """Solve the triangles of stage 2."""
    rows = factors.local.shape[1]
    _move(vectors.known, vectors.given, n)
    for j in range(part.first + 1, part.last):
        point = _entry(vectors.given, (j - part.first) * rows)
        _point_transposed(factors, n, j, point, _entry(point, rows), vectors.known)
    _move(vectors.given, vectors.known, n)


@helper(inline=True)
def _solve_dense_transposed(factors, x):
    """Solve the transpose of stage 4: replace [first point | last point | parameters] by multipliers of its rows."""
    block, step = at(factors.dense, 0, 0), whole_step(factors.dense.shape[0])
    _forward_transposed(block, step, x, x)
    _backward_transposed(block, step, factors.pivots_dense, x)


@helper(inline=True)
def _multipliers_of_point(factors, n, j, pair, border):
    """Apply the transpose of the elimination of mesh point j: turn its ``pair`` into the multipliers of its rows."""
    block, (_, height, width) = _page(factors.chain, j - 1), factors.chain.shape
    step = point_step(n, width)
    _subtract_transposed(_part(block, 2 * n, 0), Range(0, height - 2 * n), step, border, pair)
    _backward_transposed(block, step, factors.pivots[j, factors.pivots.shape[1] - n :], pair)


@helper(inline=True)
def _multipliers_of_points(factors, n, part, vectors):
    """Apply the transpose of stage 2: fill each ``pair`` with the multipliers of its rows."""
    rows = factors.local.shape[1]
    for j in range(part.last - 1, part.first, -1):
        pair = _entry(vectors.pair, 2 * n * (j - part.first))
        _move(pair, _entry(vectors.given, (j - part.first) * rows), n)
        _multipliers_of_point(factors, n, j, pair, vectors.border)
        _move(_entry(pair, -n), pair, n)


@helper(inline=True)
def _multipliers_of_interiors(layout, factors, part, vectors):
    """Apply the transpose of stage 1: fill the collocation rows of ``found`` with their multipliers."""
    offsets, follows = layout.offsets, layout.follows
    n, groups, (_, rows, width) = layout.order.size, layout.offsets.size - 1, factors.local.shape
    r, degree = factors.border.shape[1], rows // n
    for j in range(part.first, part.last):
        block, edge, pivots, i = _page(factors.local, j), _page(factors.border, j), factors.pivots[j], j - part.first
        inner, remaining = _entry(vectors.inner, i * rows), _entry(vectors.pair, (2 * i + 1) * n)
        for g in range(groups - 1, -1, -1):
            step, size = group_step(offsets, g, degree, width), offsets[g + 1] - offsets[g]
            _move(_entry(inner, step.bottom - size), _entry(remaining, offsets[g]), size)
            _subtract_transposed(edge, Range(0, r), step, vectors.border, inner)
            for h in range(g + 1, groups):
                if follows[g * groups + h]:
                    _subtract_transposed(block, Range(degree * offsets[h], degree * offsets[h + 1]), step, inner, inner)
            _backward_transposed(block, step, pivots, inner)
        _put(_entry(vectors.found, i * rows), layout.rows, Range(0, rows), inner)


@helper(inline=True)
def _solve_joint_transposed(factors, n, starts, work):
    """Solve the triangles of stage 3 and stage 4, and apply the transpose of stage 3.

    Each segment gives what is left for both its ends and for the parameters; it gets the multipliers of the rows that it
    carries, in the second half of its last ``pair``, and of the ``border``.
    """
    rows, r, size, segments = factors.local.shape[1], factors.border.shape[1], factors.dense.shape[0], starts.size - 1
    joint = _joint(factors, n, work, segments)
    for s in range(segments):
        vectors, pair = _vectors(factors, n, work, starts, s), _entry(joint.pair, 2 * n * s)
        if s == 0:
            _move(_entry(joint.known, 2 * n), _entry(vectors.known, 2 * n), size - 2 * n)
            _move(joint.known, vectors.given, n)
        else:
            _add(_entry(joint.known, 2 * n), _entry(vectors.known, 2 * n), size - 2 * n)
            _add(pair, vectors.given, n)
        _move(_entry(pair, 2 * n), _entry(vectors.given, (starts[s + 1] - starts[s]) * rows), n)
    for s in range(1, segments):
        pair = _entry(joint.pair, 2 * n * s)
        _point_transposed(factors, n, starts[s], pair, _entry(pair, 2 * n), joint.known)
    _move(joint.dense, joint.known, n)
    _move(_entry(joint.dense, n), _entry(joint.pair, 2 * n * segments), n)
    _move(_entry(joint.dense, 2 * n), _entry(joint.known, 2 * n), size - 2 * n)
    _solve_dense_transposed(factors, joint.dense)
    _move(joint.rest, _entry(joint.dense, n), size - n)
    _move(joint.border, _entry(joint.dense, size - r), r)
    _move(_entry(joint.pair, (2 * segments - 1) * n), joint.dense, n)
    for s in range(segments - 1, -1, -1):
        vectors, pair = _vectors(factors, n, work, starts, s), _entry(joint.pair, 2 * n * s)
        if s > 0:
            _multipliers_of_point(factors, n, starts[s], pair, joint.border)
            _move(_entry(pair, -n), pair, n)
        _move(_entry(vectors.pair, (2 * (starts[s + 1] - starts[s]) - 1) * n), _entry(pair, n), n)
        _move(vectors.border, joint.border, r)


@kernel
def solve_transposed(layout: Layout, factors: Eliminated, c: ReadOnlyMatrix, y: Matrix, work: Matrix, share: Share) -> None:
    """Solve J^T y = c for rows of c (m, unknowns) and of y (m, equations), with ``work`` and ``share`` as for `solve`."""
    n, rows, size = layout.order.size, factors.local.shape[1], factors.dense.shape[0]
    starts, tail = share.starts, size - n
    collocation, segments = factors.local.shape[0] * rows, starts.size - 1
    joint = _joint(factors, n, work, segments)
    for first in range(0, c.shape[0], LANES):
        given, found, count = at(c, first, 0), at(y, first, 0), c.shape[0] - first
        if share.stage == 0 or share.stage == ALL:
            for s in range(share.first, share.last):
                part, vectors = Range(starts[s], starts[s + 1]), _vectors(factors, n, work, starts, s)
                own = (part.last - part.first) * rows
                side_by_side(vectors.given, _part(given, 0, part.first * rows), own, count)
                right, parameters = _entry(vectors.given, own), _entry(vectors.known, 2 * n)
                if s == segments - 1:
                    side_by_side(right, _part(given, 0, collocation), n, count)
                else:
                    _clear(right, n)
                if s == 0:
                    side_by_side(parameters, _part(given, 0, collocation + n), size - 2 * n, count)
                else:
                    _clear(parameters, size - 2 * n)
                _interiors_transposed(layout, factors, part, vectors)
                _points_transposed(factors, n, part, vectors)
        if share.stage == 1 or share.stage == ALL:
            _solve_joint_transposed(factors, n, starts, work)
            apart(_part(found, 0, collocation), joint.rest, tail, count)
        if share.stage == 2 or share.stage == ALL:
            for s in range(share.first, share.last):
                part, vectors = Range(starts[s], starts[s + 1]), _vectors(factors, n, work, starts, s)
                _multipliers_of_points(factors, n, part, vectors)
                _multipliers_of_interiors(layout, factors, part, vectors)
                apart(_part(found, 0, part.first * rows), vectors.found, (part.last - part.first) * rows, count)
