"""Colouring: inputs that no value has in common are perturbed together (Curtis, Powell & Reid 1974)."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np

from contin.arrays import Indices, Pattern

#: With more columns than this, and this part of all entries or more, each input has a colour of its own: the search takes the
#: number of columns times that of colours times that of values.
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


def colouring(depends: Pattern, columns: Sequence[int] | Indices) -> Colouring:
    """Return a colouring for derivatives by the inputs ``columns``, by first fit.

    Parameters
    ----------
    depends : ndarray of bool, shape (values, inputs)
        Sparsity pattern.
    columns : sequence of int
        The inputs to differentiate by, one for each column of the Jacobian.
    """
    search = len(columns) <= _MOST_COLUMNS or depends.mean() < _DENSE
    together: list[list[int]] = []
    taken: list[Any] = []
    for column, slot in enumerate(columns):
        mine = depends[:, slot]
        if not mine.any():
            continue
        at = len(taken)
        if search:
            at = next((c for c, others in enumerate(taken) if not (others & mine).any()), at)
        if at == len(taken):
            together.append([])
            taken.append(np.zeros_like(mine))
        together[at].append(column)
        taken[at] = taken[at] | mine
    owner = np.full((len(together), len(depends)), -1, dtype=np.int64)
    for c, group in enumerate(together):
        for column in group:
            owner[c, depends[:, columns[column]]] = column
    starts = len(together) + 1 + np.cumsum([0, *map(len, together)])
    inputs = np.array([*starts, *(columns[column] for group in together for column in group)], dtype=np.int64)
    return Colouring(inputs, owner, np.array(columns, dtype=np.int64))
