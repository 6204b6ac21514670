"""Colouring: inputs that no value has in common are perturbed together (Curtis, Powell & Reid 1974)."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np

from contin.arrays import Indices, Pattern

#: With more columns than this each is perturbed alone: the search for common ones takes their number squared.
_MOST = 500


class Seeds(NamedTuple):
    """Which inputs the complex step perturbs at the same time, and where the derivatives go.

    Perturbation c is of the inputs ``slots[starts[c]:starts[c + 1]]``; what it does to value a is the derivative in column
    ``owner[c, a]`` of the Jacobian, none where that is -1. ``width`` columns in all.
    """

    slots: Indices
    starts: Indices
    owner: Indices
    width: int


def seeds(depends: Pattern, columns: Sequence[int] | Indices) -> Seeds:
    """Perturbations for derivatives by the inputs ``columns``, where ``depends`` (values, inputs) says which matter for what.

    Inputs that no value has in common are perturbed together (Curtis, Powell & Reid 1974).
    """
    together: list[list[int]] = []
    taken: list[Any] = []
    for column, slot in enumerate(columns):
        mine = depends[:, slot]
        if not mine.any():
            continue
        at = len(taken)
        if len(columns) <= _MOST:
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
    slots = np.array([columns[column] for group in together for column in group], dtype=np.int64)
    starts = np.cumsum([0, *map(len, together)], dtype=np.int64)
    return Seeds(slots, starts, owner, len(columns))
