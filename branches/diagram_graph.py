"""The former place of diagrams; it goes with version 0.4."""

import warnings

from branches.graph.closed import add_branch, course, courses, describe, families, folds, pieces, secondaries, states_at
from branches.graph.stored import new_graph, read, read_any, save

__all__ = [
    "add_branch", "course", "courses", "describe", "families", "folds", "new_graph", "pieces", "read", "read_any", "save",
    "secondaries", "states_at",
]  # fmt: skip

warnings.warn(
    "branches.diagram_graph is branches.graph.closed and branches.graph.stored from version 0.3 on",
    DeprecationWarning,
    stacklevel=2,
)
