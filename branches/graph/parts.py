"""What a result is in a diagram: its special points, and the pieces of branches between them."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from types import ModuleType

from branches.scene.labels import SPECIAL
from branches.store.branch import Piece, StoredBranch


@dataclass(frozen=True)
class Part:
    """A result as a diagram holds it; it can be sent to another process.

    Attributes
    ----------
    nodes : list of (str, dict)
        Identifiers and attributes of its special points, from end to end.
    edges : list of (str, str, dict)
        Both ends of each piece, and its attributes; columns are lists.
    words : list of str
        The branch and its special points, and what its run noted.
    """

    nodes: list[tuple[str, dict]]
    edges: list[tuple[str, str, dict]]
    words: Sequence[str] = ()


def special(branch: StoredBranch) -> list:
    """Return the labelled points of a result that are nodes of a diagram."""
    return [event for event in branch.events if event["label"].decode() in SPECIAL]


def edges_of(
    branch: StoredBranch, names: dict[int, str], columns: Sequence[str], about: Callable[[Piece], dict]
) -> list[tuple[str, str, dict]]:
    """Return the edges of a result from the identifiers of its special points by row; ``about`` returns further attributes."""
    found = []
    for piece in branch.pieces():
        rows = branch.points[piece.rows]
        values = {name: rows[name].tolist() for name in ("arclength", *columns)}
        found.append((names[int(piece.rows[0])], names[int(piece.rows[-1])], about(piece) | values))
    return found


def add(graph, part: Part) -> bool:
    """Add a result to a diagram; return False if it has the branch from its other end: both circles that the branch joins."""
    if all(values["kind"] == "circle" and name in graph for name, values in (part.nodes[0], part.nodes[-1])):
        return False
    graph.add_nodes_from(part.nodes)
    graph.add_edges_from(part.edges)
    return True


def counts(graph, kind: ModuleType, title: str) -> tuple[str, str]:
    """Return how many branches and special points a diagram has, in two lines."""
    kinds, files = [one for _, one in graph.nodes(data="kind")], {file for *_, file in graph.edges(data="file")}
    special = ", ".join(f"{kinds.count(one)} {words}" for one, words in kind.COUNTED.items())
    return f"{title or kind.TITLE}: {len(files)} branches", special
