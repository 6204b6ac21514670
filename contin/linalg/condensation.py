"""Factorization of the matrix of a collocation step by condensation, and solutions with it and with its transpose.

Right-hand sides stand side by side: each entry of a vector here is `LANES` numbers, one for each right-hand side. A vector is
given by the address of its first entry.

The matrix is drawn in `contin.linalg.blocks.Blocks`. It is eliminated in three stages, with partial pivoting throughout:

1. in each interval, the interior unknowns, group by group (`Layout`); the border rows are reduced along with it;
2. in each segment, the mesh points inside, one after the other, each from the 2 n rows that contain it; border rows as before;
3. the dense rest: the mesh points where segments begin or end, and the parameters; n rows are left of each segment.

A matrix that is not large is one segment (`contin.linalg.blocks`): the rest has the first and the last mesh point.

This is the scheme of de Boor & Weiss (1980) in the order that AUTO uses. It takes N (n d)^3 operations and N (n d)^2 numbers;
solves with the matrix and with its transpose only substitute.
"""

from __future__ import annotations

import functools
import math
from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from contin.arrays import Array
from contin.kernels.kernel import kernel
from contin.kernels.kernel_parts import Matrix, ReadOnlyMatrix, Stack, helper
from contin.linalg import vector
from contin.linalg.blocks import ALL, Blocks, Layout, Share, is_large, run, share
from contin.linalg.elimination import Eliminated, Range, factorize, group_step, point_step, whole_step
from contin.linalg.ends import Relations, relations_of
from contin.linalg.vector import LANES, PANEL, at, entry, page, within


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

    ``rest`` (n + k,) is the right-hand side behind the collocation rows, and then the solution there. ``dense`` are entries of
    the dense rest, (S + 1) n + k, and ``border`` is the sum of those of the segments.
    """

    rest: int
    dense: int
    border: int


def work_size(segments: int, intervals: int, rows: int, n: int, r: int, k: int) -> int:
    """Return the number of entries of `Joint` and `Vectors`, for blocks of n d ``rows``."""
    joint = n + k + (segments + 1) * n + k + r
    return joint + intervals * (3 * rows + 2 * n) + segments * (4 * n + k + r)


class Sizes(NamedTuple):
    """Numbers of segments S, of rows n d of an interval's block, of states n, of border rows r, and of parameters k."""

    segments: int
    rows: int
    n: int
    r: int
    k: int


@helper(inline=True)
def _sizes(factors, n, starts):
    """Return the sizes of a solve."""
    segments, rows, width = starts.size - 1, factors.local.shape[1], factors.local.shape[2]
    return Sizes(segments, rows, n, factors.border.shape[1], width - rows - n)


@helper
def _joint(work, sizes):
    """Return places of the joint vectors in work space at an address."""
    segments, rows, n, r, k = sizes
    dense = entry(work, n + k)
    return Joint(work, dense, entry(dense, (segments + 1) * n + k))


@helper
def _vectors(work, sizes, part, s):
    """Return places of the vectors of segment s, with the intervals of ``part``, in work space at an address."""
    segments, rows, n, r, k = sizes
    count, joint = part.last - part.first, n + k + (segments + 1) * n + k + r
    given = entry(work, joint + part.first * (3 * rows + 2 * n) + s * (4 * n + k + r))
    found = entry(given, count * rows + n)
    inner = entry(found, count * rows + n)
    pair = entry(inner, count * rows)
    border = entry(pair, count * 2 * n)
    return Vectors(given, found, inner, pair, border, entry(border, r))


@helper
def _move(target, source, count):
    for k in range(count):
        vector.move(entry(target, k), entry(source, k))


@helper
def _clear(target, count):
    for k in range(count):
        vector.clear(entry(target, k))


@helper
def _add(target, source, count):
    for k in range(count):
        vector.add(entry(target, k), entry(source, k))


@helper
def _take(target, source, places, part):
    """Fill entries of ``target`` with source[places[part]]."""
    for k in range(part.first, part.last):
        vector.move(entry(target, k - part.first), entry(source, places[k]))


@helper
def _put(target, places, part, source):
    """Put entries of ``source`` at target[places[part]]."""
    for k in range(part.first, part.last):
        vector.move(entry(target, places[k]), entry(source, k - part.first))


# --- substitution with the rows and columns of one elimination -------------------------------------------------------


@helper
def _forward(block, step, pivots, x):
    """Apply an elimination to the right-hand sides x of the rows of a block."""
    top, bottom, left, right, _, _ = step
    for c in range(left, right):
        if pivots[c] != top + c - left:
            vector.exchange(entry(x, top + c - left), entry(x, pivots[c]), LANES)
    for start in range(left, right, PANEL):
        size, row = min(PANEL, right - start), top + start - left
        vector.subtract_rows(entry(x, row), within(block, row, left), entry(x, top), start - left, size)
        vector.apply_lower(entry(x, row), within(block, row, start), size)
    row = top + right - left
    vector.subtract_rows(entry(x, row), within(block, row, left), entry(x, top), right - left, bottom - row)


@helper(inline=True)
def _subtract(matrix, rows, step, x, y):
    """Apply an elimination to the right-hand sides y of reduced ``rows`` of a matrix; x are those of the block."""
    reduced, pivots = within(matrix, rows.first, step.left), entry(x, step.top)
    vector.subtract_rows(entry(y, rows.first), reduced, pivots, step.right - step.left, rows.last - rows.first)


@helper
def _backward(block, step, x, known):
    """Solve the upper triangle of an elimination for x; ``known`` are the unknowns of the columns from the tail on."""
    top, _, left, right, tail, width = step
    if width > tail:
        vector.subtract_rows(entry(x, top), within(block, top, tail), known, width - tail, right - left)
    end = right
    while end > left:
        start = left + (end - left - 1) // PANEL * PANEL
        row, after = top + start - left, top + end - left
        vector.subtract_rows(entry(x, row), within(block, row, end), entry(x, after), right - end, end - start)
        vector.apply_upper(entry(x, row), within(block, row, start), end - start)
        end = start


@helper
def _forward_transposed(block, step, x, rest):
    """Solve U^T z = x for the eliminated columns, in place; subtract from ``rest`` what z contributes from the tail on."""
    top, _, left, right, tail, width = step
    for start in range(left, right, PANEL):
        end, row = min(start + PANEL, right), top + start - left
        size, after = end - start, top + end - left
        vector.apply_upper_transposed(entry(x, row), within(block, row, start), size)
        vector.subtract_columns(entry(x, after), within(block, row, end), entry(x, row), right - end, size)
        if width > tail:
            vector.subtract_columns(rest, within(block, row, tail), entry(x, row), width - tail, size)


@helper(inline=True)
def _subtract_transposed(matrix, rows, step, y, x):
    """Subtract from x what the multipliers y of reduced ``rows`` of a matrix contribute to those of the block."""
    reduced, pivots = within(matrix, rows.first, step.left), entry(x, step.top)
    vector.subtract_columns(pivots, reduced, entry(y, rows.first), step.right - step.left, rows.last - rows.first)


@helper
def _backward_transposed(block, step, pivots, x):
    """Apply the transpose of an elimination to the multipliers x of the rows of a block."""
    top, bottom, left, right, _, _ = step
    row = top + right - left
    vector.subtract_columns(entry(x, top), within(block, row, left), entry(x, row), right - left, bottom - row)
    end = right
    while end > left:
        start = left + (end - left - 1) // PANEL * PANEL
        row = top + start - left
        vector.apply_lower_transposed(entry(x, row), within(block, row, start), end - start)
        vector.subtract_columns(entry(x, top), within(block, row, left), entry(x, row), start - left, end - start)
        end = start
    for c in range(right - 1, left - 1, -1):
        if pivots[c] != top + c - left:
            vector.exchange(entry(x, top + c - left), entry(x, pivots[c]), LANES)


# --- solve: the stages, one after the other, and unknowns in the reverse order ---------------------------------------


@helper(inline=True)
def _forward_interiors(layout, factors, part, vectors):
    """Apply stage 1: fill ``inner``, the second half of each ``pair``, and reduce the ``border``."""
    offsets, follows = layout.offsets, layout.follows
    n, groups, (_, rows, width) = layout.order.size, layout.offsets.size - 1, factors.local.shape
    r, degree = factors.border.shape[1], rows // n
    for j in range(part.first, part.last):
        block, edge, pivots, i = page(factors.local, j), page(factors.border, j), factors.pivots[j], j - part.first
        inner, remaining = entry(vectors.inner, i * rows), entry(vectors.pair, (2 * i + 1) * n)
        _take(inner, entry(vectors.given, i * rows), layout.rows, Range(0, rows))
        for g in range(groups):
            step = group_step(offsets, g, degree, width)
            _forward(block, step, pivots, inner)
            for h in range(g + 1, groups):
                if follows[g * groups + h]:
                    _subtract(block, Range(degree * offsets[h], degree * offsets[h + 1]), step, inner, inner)
            _subtract(edge, Range(0, r), step, inner, vectors.border)
            size = offsets[g + 1] - offsets[g]
            _move(entry(remaining, offsets[g]), entry(inner, step.bottom - size), size)


@helper(inline=True)
def _forward_points(factors, n, part, vectors):
    """Apply stage 2: fill the first half of each ``pair``, and reduce the ``border``."""
    step, r = point_step(n, factors.chain.shape[2]), factors.border.shape[1]
    for j in range(part.first + 1, part.last):
        block, pair = page(factors.chain, j - 1), entry(vectors.pair, 2 * n * (j - part.first))
        _move(pair, entry(pair, -n), n)
        _forward(block, step, factors.pivots[j, factors.local.shape[1] - n :], pair)
        _subtract(within(block, step.bottom, 0), Range(0, r), step, pair, vectors.border)


@helper(inline=True)
def _backward_points(factors, n, part, vectors):
    """Solve for the mesh points inside a segment, the last first, with [first point | next point | parameters] ``known``."""
    rows, step = factors.local.shape[1], point_step(n, factors.chain.shape[2])
    for j in range(part.last - 1, part.first, -1):
        pair, point = entry(vectors.pair, 2 * n * (j - part.first)), entry(vectors.found, (j - part.first) * rows)
        _move(entry(vectors.known, n), entry(point, rows), n)
        _backward(page(factors.chain, j - 1), step, pair, vectors.known)
        _move(point, pair, n)


@helper(inline=True)
def _backward_interiors(layout, factors, part, vectors):
    """Solve for the interior unknowns of each interval, with [both ends | parameters] ``known``."""
    offsets, n, (_, rows, width) = layout.offsets, layout.order.size, factors.local.shape
    for j in range(part.first, part.last):
        block, i = page(factors.local, j), j - part.first
        inner, found = entry(vectors.inner, i * rows), entry(vectors.found, i * rows)
        _take(vectors.known, found, layout.ends, Range(0, 2 * n))
        for g in range(offsets.size - 1):
            step = group_step(offsets, g, rows // n, width)
            _backward(block, step, inner, entry(vectors.known, 2 * (n - offsets[g + 1])))
            _put(found, layout.inside, Range(step.left, step.right), entry(inner, step.top))


@helper(inline=True)
def _solve_joint(factors, sizes, starts, place):
    """Solve stage 3: for the mesh points where segments begin or end, and for the parameters.

    Each segment gives what it carries, the second half of its last ``pair``, and its ``border``; it gets both its ends, the
    first one in ``known`` too, and the parameters there.
    """
    segments, rows, n, r, k = sizes
    joint, end = _joint(place, sizes), segments * n
    _clear(joint.border, r)
    for s in range(segments):
        vectors = _vectors(place, sizes, Range(starts[s], starts[s + 1]), s)
        _move(entry(joint.dense, s * n), entry(vectors.pair, (2 * (starts[s + 1] - starts[s]) - 1) * n), n)
        _add(joint.border, vectors.border, r)
    _move(entry(joint.dense, end), joint.rest, n + k - r)
    _move(entry(joint.dense, end + n + k - r), joint.border, r)
    block, step = at(factors.dense, 0, 0), whole_step(factors.dense.shape[0])
    _forward(block, step, factors.pivots_dense, joint.dense)
    _backward(block, step, joint.dense, joint.dense)
    _move(joint.rest, entry(joint.dense, end), n + k)
    for s in range(segments):
        vectors, begins = _vectors(place, sizes, Range(starts[s], starts[s + 1]), s), entry(joint.dense, s * n)
        _move(vectors.found, begins, n)
        _move(entry(vectors.found, (starts[s + 1] - starts[s]) * rows), entry(begins, n), n)
        _move(vectors.known, begins, n)
        _move(entry(vectors.known, 2 * n), entry(joint.dense, end + n), k)


@kernel
def solve(layout: Layout, factors: Eliminated, b: ReadOnlyMatrix, x: Matrix, work: Matrix, share: Share) -> None:
    """Solve J x = b for rows of b (m, equations) and of x (m, unknowns), with ``work`` (`work_size`, LANES).

    The stages of a `Share` are: elimination in segments, what joins them, substitution in segments. A share that is not the
    whole takes at most `LANES` rows.
    """
    starts, place = share.starts, vector.address(work, 0)
    sizes = _sizes(factors, layout.order.size, starts)
    _, rows, n, r, k = sizes
    collocation, tail = factors.local.shape[0] * rows, n + k
    joint = _joint(place, sizes)
    for first in range(0, b.shape[0], LANES):
        given, found, count = at(b, first, 0), at(x, first, 0), b.shape[0] - first
        if share.stage == 0 or share.stage == ALL:
            for s in range(share.first, share.last):
                part = Range(starts[s], starts[s + 1])
                vectors = _vectors(place, sizes, part, s)
                vector.side_by_side(vectors.given, within(given, 0, part.first * rows), (part.last - part.first) * rows, count)
                if s == 0:
                    vector.side_by_side(joint.rest, within(given, 0, collocation), tail, count)
                    _move(vectors.border, entry(joint.rest, tail - r), r)
                else:
                    _clear(vectors.border, r)
                _forward_interiors(layout, factors, part, vectors)
                _forward_points(factors, n, part, vectors)
        if share.stage == 1 or share.stage == ALL:
            _solve_joint(factors, sizes, starts, place)
            vector.apart(within(found, 0, collocation), joint.rest, tail, count)
        if share.stage == 2 or share.stage == ALL:
            for s in range(share.first, share.last):
                part = Range(starts[s], starts[s + 1])
                vectors = _vectors(place, sizes, part, s)
                _backward_points(factors, n, part, vectors)
                _backward_interiors(layout, factors, part, vectors)
                vector.apart(within(found, 0, part.first * rows), vectors.found, (part.last - part.first) * rows, count)


# --- transposed solve: triangles in the order of the stages, and multipliers in the reverse order --------------------


@helper(inline=True)
def _interiors_transposed(layout, factors, part, vectors):
    """Solve the triangles of stage 1: fill ``inner``; subtract what it contributes to both ends and to the parameters."""
    offsets, n, (_, rows, width) = layout.offsets, layout.order.size, factors.local.shape
    for j in range(part.first, part.last):
        block, i = page(factors.local, j), j - part.first
        inner, given = entry(vectors.inner, i * rows), entry(vectors.given, i * rows)
        _take(vectors.known, given, layout.ends, Range(0, 2 * n))
        for g in range(offsets.size - 1):
            step = group_step(offsets, g, rows // n, width)
            _take(entry(inner, step.top), given, layout.inside, Range(step.left, step.right))
            _forward_transposed(block, step, inner, entry(vectors.known, 2 * (n - offsets[g + 1])))
        _put(given, layout.ends, Range(0, 2 * n), vectors.known)


@helper(inline=True)
def _points_transposed(factors, n, part, vectors):
    """Solve the triangles of stage 2; subtract what a point contributes to the first one, the next one, and the parameters."""
    rows, step = factors.local.shape[1], point_step(n, factors.chain.shape[2])
    _move(vectors.known, vectors.given, n)
    for j in range(part.first + 1, part.last):
        point = entry(vectors.given, (j - part.first) * rows)
        _move(entry(vectors.known, n), entry(point, rows), n)
        _forward_transposed(page(factors.chain, j - 1), step, point, vectors.known)
        _move(entry(point, rows), entry(vectors.known, n), n)
    _move(vectors.given, vectors.known, n)


@helper(inline=True)
def _multipliers_of_points(factors, n, part, vectors):
    """Apply the transpose of stage 2: fill each ``pair`` with the multipliers of its rows."""
    rows, step, r = factors.local.shape[1], point_step(n, factors.chain.shape[2]), factors.border.shape[1]
    for j in range(part.last - 1, part.first, -1):
        block, pair = page(factors.chain, j - 1), entry(vectors.pair, 2 * n * (j - part.first))
        _move(pair, entry(vectors.given, (j - part.first) * rows), n)
        _subtract_transposed(within(block, step.bottom, 0), Range(0, r), step, vectors.border, pair)
        _backward_transposed(block, step, factors.pivots[j, rows - n :], pair)
        _move(entry(pair, -n), pair, n)


@helper(inline=True)
def _multipliers_of_interiors(layout, factors, part, vectors):
    """Apply the transpose of stage 1: fill the collocation rows of ``found`` with their multipliers."""
    offsets, follows = layout.offsets, layout.follows
    n, groups, (_, rows, width) = layout.order.size, layout.offsets.size - 1, factors.local.shape
    r, degree = factors.border.shape[1], rows // n
    for j in range(part.first, part.last):
        block, edge, pivots, i = page(factors.local, j), page(factors.border, j), factors.pivots[j], j - part.first
        inner, remaining = entry(vectors.inner, i * rows), entry(vectors.pair, (2 * i + 1) * n)
        for g in range(groups - 1, -1, -1):
            step, size = group_step(offsets, g, degree, width), offsets[g + 1] - offsets[g]
            _move(entry(inner, step.bottom - size), entry(remaining, offsets[g]), size)
            _subtract_transposed(edge, Range(0, r), step, vectors.border, inner)
            for h in range(g + 1, groups):
                if follows[g * groups + h]:
                    _subtract_transposed(block, Range(degree * offsets[h], degree * offsets[h + 1]), step, inner, inner)
            _backward_transposed(block, step, pivots, inner)
        _put(entry(vectors.found, i * rows), layout.rows, Range(0, rows), inner)


@helper(inline=True)
def _solve_joint_transposed(factors, sizes, starts, place):
    """Solve the transpose of stage 3.

    Each segment gives what is left for both its ends and for the parameters; it gets the multipliers of the rows that it
    carries, in the second half of its last ``pair``, and of the ``border``.
    """
    segments, rows, n, r, k = sizes
    joint, end = _joint(place, sizes), segments * n
    _clear(joint.dense, end + n + k)
    for s in range(segments):
        vectors, begins = _vectors(place, sizes, Range(starts[s], starts[s + 1]), s), entry(joint.dense, s * n)
        _add(begins, vectors.given, n)
        _add(entry(begins, n), entry(vectors.given, (starts[s + 1] - starts[s]) * rows), n)
        _add(entry(joint.dense, end + n), entry(vectors.known, 2 * n), k)
    block, step = at(factors.dense, 0, 0), whole_step(factors.dense.shape[0])
    _forward_transposed(block, step, joint.dense, joint.dense)
    _backward_transposed(block, step, factors.pivots_dense, joint.dense)
    _move(joint.rest, entry(joint.dense, end), n + k)
    for s in range(segments):
        vectors = _vectors(place, sizes, Range(starts[s], starts[s + 1]), s)
        _move(entry(vectors.pair, (2 * (starts[s + 1] - starts[s]) - 1) * n), entry(joint.dense, s * n), n)
        _move(vectors.border, entry(joint.dense, end + n + k - r), r)


@kernel
def solve_transposed(layout: Layout, factors: Eliminated, c: ReadOnlyMatrix, y: Matrix, work: Matrix, share: Share) -> None:
    """Solve J^T y = c for rows of c (m, unknowns) and of y (m, equations), with ``work`` and ``share`` as for `solve`."""
    starts, place = share.starts, vector.address(work, 0)
    sizes = _sizes(factors, layout.order.size, starts)
    segments, rows, n, _, k = sizes
    collocation, tail = factors.local.shape[0] * rows, n + k
    joint = _joint(place, sizes)
    for first in range(0, c.shape[0], LANES):
        given, found, count = at(c, first, 0), at(y, first, 0), c.shape[0] - first
        if share.stage == 0 or share.stage == ALL:
            for s in range(share.first, share.last):
                part = Range(starts[s], starts[s + 1])
                vectors = _vectors(place, sizes, part, s)
                own = (part.last - part.first) * rows
                vector.side_by_side(vectors.given, within(given, 0, part.first * rows), own, count)
                right, parameters = entry(vectors.given, own), entry(vectors.known, 2 * n)
                if s == segments - 1:
                    vector.side_by_side(right, within(given, 0, collocation), n, count)
                else:
                    _clear(right, n)
                if s == 0:
                    vector.side_by_side(parameters, within(given, 0, collocation + n), k, count)
                else:
                    _clear(parameters, k)
                _interiors_transposed(layout, factors, part, vectors)
                _points_transposed(factors, n, part, vectors)
        if share.stage == 1 or share.stage == ALL:
            _solve_joint_transposed(factors, sizes, starts, place)
            vector.apart(within(found, 0, collocation), joint.rest, tail, count)
        if share.stage == 2 or share.stage == ALL:
            for s in range(share.first, share.last):
                part = Range(starts[s], starts[s + 1])
                vectors = _vectors(place, sizes, part, s)
                _multipliers_of_points(factors, n, part, vectors)
                _multipliers_of_interiors(layout, factors, part, vectors)
                vector.apart(within(found, 0, part.first * rows), vectors.found, (part.last - part.first) * rows, count)


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
    [collocation | boundary | border rows]. Raises ValueError if the matrix is not square.

    - ``layout`` (Layout): Order of rows and columns in an interval's block.
    - ``blocks`` (Blocks): The matrix; ``local``, ``border`` and ``corner`` are overwritten.
    - ``whole`` (Share, optional): Its segments; by default as many as suit its size.
    """

    def __repr__(self) -> str:
        return f"{type(self).__name__}(sign of the determinant {self.sign:g})"

    def __init__(self, layout: Layout, blocks: Blocks, whole: Share | None = None) -> None:
        self._take(layout, blocks, whole)
        factors, corners, first, last, carried, _ = self.room
        self.sign = math.prod(run(factorize, (layout, factors, corners, first, last, carried), self._whole, (True, False)))

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
                given_here = (self._layout, self.room.factors, rows[these], result[these], self.room.work)
                run(kernel, given_here, self._whole, (True, False, True))
        return result.reshape(given.shape)
