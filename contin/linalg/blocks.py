"""The matrix of a collocation step: its blocks, their order, its segments, and the protocol of its factors.

States that depend on each other mutually form a group. Groups are eliminated one after the other, each after those that its
equations contain, so that the states of a frame that turns at given rates, or of a position that is an integral, cost little.

Segments are parts of a long mesh that are assembled, eliminated and solved for independently, by several threads. Their number
depends on the size of the matrix only, and so does the order of the arithmetic: results have the same bits for any number of
threads. A matrix that is not large is one segment, or as many as its problem wants.
"""

from __future__ import annotations

import functools
from collections.abc import Callable, Sequence
from typing import Any, NamedTuple, Protocol

import numpy as np

from contin import threads
from contin.arrays import Array, Indices, Pattern
from contin.kernels.kernel_parts import IndexMatrix, IndexVector, Matrix, Stack
from contin.threads import PARTS

#: Unknowns that are many: dense factors of 200 take as long as sparse ones, the search for groups of states takes up to .1 s,
#: and what is done for each of them takes longer than a run.
MANY = 200


class Blocks(NamedTuple):
    """The matrix of a collocation step.

    It has N intervals, n states, degree d, k parameters, n_bc boundary conditions and r border rows. For N = 3, with mesh
    points p0 ... p3 (n columns each) and the interior nodes i1 ... i3 between them (n (d - 1) columns each)::

                       p0   i1   p1     i2   p2     i3   p3   parameters
        interval 1  [  L1   L1   L1                           L1  ]   n d rows
        interval 2  [            L2     L2   L2               L2  ]   n d rows
        interval 3  [                        L3     L3   L3   L3  ]   n d rows
        boundary    [  F                                 E    E   ]   n_bc rows
        border      [  B1   B1   B1+B2  B2   B2+B3  B3   B3   C   ]   r rows

    It is square: n + n_bc + r = 2 n + k.

    - ``local`` (ndarray, shape (N, n d, n (d + 1) + k)): L: collocation rows; rows and columns of each block are in the order
      of its `Layout`. Factoring overwrites it.
    - ``border`` (ndarray, shape (N, r, n (d + 1) + k)): B: each interval's share of the border rows (integral conditions,
      arclength, ...), in the same columns. The last k columns are work space. Factoring overwrites it.
    - ``corner`` (ndarray, shape (r, k)): C: border rows, by the parameters. Factoring overwrites it.
    - ``first``, ``last`` (ndarray, shapes (n_bc, n) and (n_bc, n + k)): F and E: boundary conditions, by the first mesh point,
      and by [the last one | parameters].
    """

    local: Stack
    border: Stack
    corner: Matrix
    first: Matrix
    last: Matrix


class Layout(NamedTuple):
    """The order of rows and columns in an interval's block, for n states in G groups and degree d.

    For example, three groups of which the second depends on the first, and the third on the second; a dot is a zero::

                    interior         both ends        parameters
                    1    2    3      3    2    1
        group 1  [  x    .    .      .    .    x      x  ]
        group 2  [  x    x    .      .    x    x      x  ]
        group 3  [  .    x    x      x    x    .      x  ]

    When the groups before it are eliminated, the rows of a group have entries in its own interior columns, and in one range
    of columns that begins with its own ends.

    - ``order`` (ndarray, shape (n,)): States in the order of elimination, group by group.
    - ``offsets`` (ndarray, shape (G + 1,)): First places of the groups in ``order``, and n.
    - ``follows`` (ndarray, shape (G G,)): Entry g G + h is 1 if equations of group h contain states of group g.
    - ``rows`` (ndarray, shape (n d,)): Equation of each row, as i n + a for Gauss point i and state a. The rows of a group
      stand together, by Gauss points. Those of its last Gauss point remain when its interior unknowns are eliminated.
    - ``inside`` (ndarray, shape (n (d - 1),)): Unknown of each interior column, as i n + a for node i and state a.
    - ``ends`` (ndarray, shape (2 n,)): Unknown of each column of the ends (nodes 0 and d), likewise.
    - ``starts`` (ndarray, shape (G, d + 1)): The first column of each group at each node.
    """

    order: IndexVector
    offsets: IndexVector
    follows: IndexVector
    rows: IndexVector
    inside: IndexVector
    ends: IndexVector
    starts: IndexMatrix


def layout(depends: Pattern, degree: int) -> Layout:
    """Return the layout for a degree; ``depends`` (n, n) is true at (a, b) if the equation of state a contains state b."""
    return _layout(np.ascontiguousarray(depends, dtype=bool).tobytes(), len(depends), degree)


@functools.lru_cache(maxsize=32)  # each new mesh of a problem asks for its layout again
def _layout(pattern: bytes, n: int, degree: int) -> Layout:
    depends, d = np.frombuffer(pattern, dtype=bool).reshape(n, n), degree
    groups = coupled_groups(depends)
    order = np.concatenate([np.array(group, dtype=np.int64) for group in groups])
    offsets = np.cumsum([0, *map(len, groups)])
    parts = [order[a:b] for a, b in zip(offsets, offsets[1:])]
    rows = np.concatenate([(n * np.arange(d)[:, None] + part).ravel() for part in parts])
    inside = np.concatenate([(n * np.arange(1, d)[:, None] + part).ravel() for part in parts])
    ends = np.concatenate([np.concatenate([part, n * d + part]) for part in parts[::-1]])
    member = np.zeros((len(parts), n), dtype=np.float32)
    member[np.repeat(np.arange(len(parts)), np.diff(offsets)), order] = 1
    follows = (member @ depends @ member.T).T > 0
    starts = np.empty((len(parts), d + 1), np.int64)
    for g, (first, last) in enumerate(zip(offsets, offsets[1:])):
        starts[g, 1:d] = (d - 1) * first + (last - first) * np.arange(d - 1)
        starts[g, [0, d]] = (d + 1) * n - 2 * last + np.array([0, last - first])
    return Layout(*(np.array(a, dtype=np.int64) for a in (order, offsets, follows.ravel(), rows, inside, ends, starts)))


def coupled_groups(depends: Pattern) -> list[list[int]]:
    """Return the strongly connected components of a dependency graph, each after those that it depends on.

    They are sorted by the number of states that can be reached from them, those of one number by their states.
    """
    n = len(depends)
    if n > MANY or np.all(depends):
        return [list(range(n))]
    paths, known = (depends | np.eye(n, dtype=bool)).astype(np.float32), 0  # of one step at most; then of 2, 4, ...
    while known != (known := int(np.count_nonzero(paths))):
        paths = np.minimum(paths @ paths, 1)
    reach = paths > 0
    mutual = reach & reach.T
    groups = {tuple(np.flatnonzero(row).tolist()): int(count) for row, count in zip(mutual, reach.sum(axis=1))}
    return [list(group) for group in sorted(groups, key=lambda group: (groups[group], group))]


#: Numbers in the blocks of all intervals from which on there are segments. There a Newton iteration takes .7 times as long with
#: two threads as with one (300 intervals, 13 states, degree 4); with four times fewer numbers it takes as long.
_LARGE = 2**20


class Share(NamedTuple):
    """What one call of a kernel does: stage ``stage`` for the segments ``first`` to ``last``, without ``last``; or all of it.

    ``starts`` (S + 1,) are the first intervals of the segments, and N. ``stage`` is `ALL` for all stages.
    """

    starts: IndexVector
    first: int
    last: int
    stage: int


#: All stages, one after the other.
ALL = -1


def is_large(numbers: int) -> bool:
    """Return whether so many numbers in the blocks of all intervals are worth several threads."""
    return numbers >= _LARGE


def share(intervals: int, numbers: int, least: int = 1) -> Share:
    """Return the whole of a matrix with this many intervals and ``numbers`` in their blocks: ``least`` segments or more."""
    return _share(intervals, max(1, min(PARTS if is_large(numbers) else least, intervals // 2)))


@functools.lru_cache(maxsize=32)  # each matrix of a mesh asks for it
def _share(intervals: int, segments: int) -> Share:
    starts: Indices = np.arange(segments + 1) * intervals // segments
    return Share(starts, 0, segments, ALL)


def run(kernel: Callable[..., Any], given: Sequence[Any], whole: Share, stages: Sequence[bool]) -> list[Any]:
    """Return the results of ``kernel(*given, share)``: one call for a matrix of few segments, or else stage by stage.

    ``stages`` says for each stage whether segments are independent in it; then they are calls of their own, in several threads.
    Two segments, which connections have, are one call.
    """
    if whole.last <= 2 or threads.count() == 1:
        return [kernel(*given, whole)]
    results: list[Any] = []
    for stage, independent in enumerate(stages):
        if independent:
            shares = [whole._replace(first=s, last=s + 1, stage=stage) for s in range(whole.last)]
            results += threads.each(lambda part: kernel(*given, part), shares)
        else:
            results.append(kernel(*given, whole._replace(stage=stage)))
    return results


class Factors(Protocol):
    """A factored square matrix J: solves with it and with its transpose, for one right-hand side or for several as rows."""

    @property
    def sign(self) -> float:
        """Sign of the determinant."""

    def solve(self, b: Array) -> Array:
        """Return the x with J x = b."""

    def solve_transposed(self, c: Array) -> Array:
        """Return the y with J^T y = c."""
