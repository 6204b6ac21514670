"""Colouring: inputs that no value has in common are perturbed together (Curtis, Powell & Reid 1974)."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np

from contin.arrays import Indices, Pattern

#: With more columns each input has a colour of its own: the search takes the number of columns squared times the values.
_MOST_COLUMNS = 500


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


def colouring(depends: Pattern, columns: Sequence[int] | Indices) -> Colouring:
    """Return a colouring for derivatives by the inputs ``columns``, by first fit.

    Parameters
    ----------
    depends : ndarray of bool, shape (values, inputs)
        Sparsity pattern.
    columns : sequence of int
        The inputs to differentiate by, one for each column of the Jacobian.
    """
    together: list[list[int]] = []
    taken: list[Any] = []
    for column, slot in enumerate(columns):
        mine = depends[:, slot]
        if not mine.any():
            continue
        at = len(taken)
        if len(columns) <= _MOST_COLUMNS:
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
