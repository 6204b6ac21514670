"""Colouring: inputs that no value has in common are perturbed together (Curtis, Powell & Reid 1974)."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from contin.arrays import Indices, Pattern

#: With more columns than this, and this part of all entries or more, each input has a colour of its own: the search takes the
#: number of entries times that of colours.
_MOST_COLUMNS, _DENSE = 500, 0.1


class Colouring(NamedTuple):
    """Inputs by colour, and where their derivatives go.

    Colour c has the inputs ``inputs[inputs[c]:inputs[c + 1]]``: the vector begins with the places of its own parts. When they
    are perturbed together, the change of value a is the derivative in column ``owner[c, a]`` of the Jacobian; there is none
    where that is -1. ``columns`` are the inputs that the columns of the Jacobian belong to.
    """

    inputs: Indices
    owner: Indices
    columns: Indices

    @property
    def width(self) -> int:
        """Number of columns of the Jacobian."""
        return self.columns.size

    @property
    def entries(self) -> tuple[Indices, Indices, Indices]:
        """Values, columns and colours of the entries of the Jacobian that may differ from zero, a vector each."""
        colours, values = np.nonzero(self.owner >= 0)
        return values, self.owner[colours, values], colours

    def compressed(self) -> Colouring:
        """Return the colouring whose Jacobian has a column for each colour: the entries next to each other."""
        owner = np.where(self.owner >= 0, np.arange(len(self.owner))[:, None], -1)
        return Colouring(self.inputs, owner, np.arange(len(owner)))


class SparsePattern(NamedTuple):
    """A sparsity pattern by inputs: ``values[starts[j]:starts[j + 1]]`` are those that depend on input j, of ``height``."""

    starts: Indices
    values: Indices
    height: int

    @classmethod
    def of_entries(cls, values: Indices, inputs: Indices, shape: tuple[int, int]) -> SparsePattern:
        """Return the pattern with these entries; ``shape`` is the number of values, and of inputs."""
        order = np.lexsort((values, inputs))
        starts = np.searchsorted(inputs[order], np.arange(shape[1] + 1))
        return cls(starts.astype(np.int64), values[order].astype(np.int64), shape[0])

    def of_input(self, slot: int) -> Indices:
        """Return the values that depend on an input."""
        return self.values[self.starts[slot] : self.starts[slot + 1]]


def colouring(depends: Pattern | SparsePattern, columns: Sequence[int] | Indices) -> Colouring:
    """Return a colouring for derivatives by the inputs ``columns``, by first fit.

    Parameters
    ----------
    depends : ndarray of bool, shape (values, inputs), or SparsePattern
        Sparsity pattern.
    columns : sequence of int
        The inputs to differentiate by, one for each column of the Jacobian.
    """
    if isinstance(depends, SparsePattern):
        count, search = depends.height, True
    else:
        count, search = len(depends), len(columns) <= _MOST_COLUMNS or bool(depends.mean() < _DENSE)
    together: list[list[int]] = []
    owner = np.full((_ROOM, count), -1, dtype=np.int64)
    for column, slot in enumerate(columns):
        mine = depends.of_input(slot) if isinstance(depends, SparsePattern) else np.flatnonzero(depends[:, slot])
        if not mine.size:
            continue
        at = len(together)
        if search and at:
            free = np.flatnonzero((owner[:at, mine] < 0).all(axis=1))
            at = int(free[0]) if free.size else at
        if at == len(together):
            together.append([])
            if at == len(owner):
                owner = np.concatenate([owner, np.full_like(owner, -1)])
        together[at].append(column)
        owner[at, mine] = column
    starts = len(together) + 1 + np.cumsum([0, *map(len, together)])
    inputs = np.array([*starts, *(columns[column] for group in together for column in group)], dtype=np.int64)
    return Colouring(inputs, owner[: len(together)].copy(), np.array(columns, dtype=np.int64))


#: Colours that there is room for at first; the room is doubled where they do not suffice.
_ROOM = 8
