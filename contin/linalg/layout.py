"""Which states couple to which: groups of states to be eliminated one after the other, and their order in a block.

An interval's block of the collocation matrix holds, for states in the order of elimination (each group together), rows and
interior columns group by group, then the columns of both ends of the interval, the last group's first, then the parameters:

    [ interior of group 1 | ... | interior of group G | ends of group G | ... | ends of group 1 | parameters ]

so that a group's rows, once freed of the groups before, fill its interior columns and one range at the end of the row.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from contin.arrays import Indices, Pattern

#: Larger problems are taken as one group.
_MOST = 500


class Layout(NamedTuple):
    """The places in an interval's block, for n states and degree d.

    ``order`` (n,): states in the order of elimination. ``offsets`` (G + 1,): where groups begin in it. ``follows`` (G G,):
    entry g G + h says whether the equations of group h contain states of group g. ``rows`` (n d,): the equation in each row,
    i n + a for Gauss point i and state a. ``inside`` (n (d - 1),): the unknown in each interior column, i n + a for node i.
    ``ends`` (2 n,): the same for the columns of both ends, nodes 0 and d. ``left``, ``right`` (n,): the columns of a state's
    values at both ends. ``remaining`` (n,): the rows that no interior unknown is eliminated by.
    """

    order: Indices
    offsets: Indices
    follows: Indices
    rows: Indices
    inside: Indices
    ends: Indices
    left: Indices
    right: Indices
    remaining: Indices


def layout(depends: Pattern, degree: int) -> Layout:
    """The layout for a degree where ``depends`` (n, n) says which state's equation contains which states."""
    groups, d = coupled_groups(depends), degree
    order = np.concatenate([np.array(group, dtype=np.int64) for group in groups])
    n, offsets = order.size, np.cumsum([0, *map(len, groups)])
    parts = [order[a:b] for a, b in zip(offsets, offsets[1:])]
    rows = np.concatenate([(n * np.arange(d)[:, None] + part).ravel() for part in parts])
    inside = np.concatenate([(n * np.arange(1, d)[:, None] + part).ravel() for part in parts])
    ends = np.concatenate([np.concatenate([part, n * d + part]) for part in parts[::-1]])
    remaining = np.concatenate([np.arange(d * b - (b - a), d * b) for a, b in zip(offsets, offsets[1:])])
    column = np.empty(n * (d + 1), dtype=np.int64)
    column[ends] = n * (d - 1) + np.arange(2 * n)
    member = np.zeros((len(parts), n), dtype=bool)
    member[np.repeat(np.arange(len(parts)), np.diff(offsets)), order] = True
    follows = _product(_product(member, depends), member.T).T
    return Layout(*(np.array(a, dtype=np.int64) for a in (
        order, offsets, follows.ravel(), rows, inside, ends, column[:n], column[n * d :], remaining,
    )))  # fmt: skip


def _product(a: Pattern, b: Pattern) -> Pattern:
    """a @ b of truth values, by the fast product of numbers."""
    product: Pattern = a.astype(np.float32) @ b.astype(np.float32) > 0
    return product


def coupled_groups(depends: Pattern) -> list[list[int]]:
    """The smallest groups of states that depend on each other mutually, each after those that it depends on."""
    n = len(depends)
    if n > _MOST or np.all(depends):
        return [list(range(n))]
    reach = np.eye(n, dtype=bool) | depends
    for _ in range(n.bit_length()):
        reach = _product(reach, reach)
    mutual = reach & reach.T
    groups = {tuple(map(int, np.flatnonzero(row))) for row in mutual}
    return [list(group) for group in sorted(groups, key=lambda group: (np.count_nonzero(reach[group[0]]), group))]
