"""The results of a scene of many open strips as a graph: labelled points, and the pieces of stages between them.

Nodes have the columns of their points (dimensionless), ``kind``, ``stage``, ``file``, and ``numbers``: what the scene has lists
of. A stage begins at the node of the earlier stage from which it starts. Edges have columns as lists, the ``followed`` number
and the ``factor`` that gives it its unit, the ``index`` along them (-1 where it is not known), and their ``ends``.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

from branches.graph.stored import OPEN_FORMAT, new_graph
from branches.scene.labels import SPECIAL, label_of, without_round_off
from branches.store.open_branch import OpenBranch
from contin.lowlevel import exact_text

#: The format of diagrams of open strips, the title of one without, and whether there is an exact solution.
FORMAT, TITLE, EXACT = OPEN_FORMAT, "open strips", False


@dataclass(frozen=True)
class Part:
    """A result as a diagram holds it: nodes with their attributes, edges with their ends and attributes; and its notes."""

    nodes: dict[str, dict]
    edges: list[tuple[str, str, dict]]
    notes: tuple[str, ...]


def part(branch: OpenBranch, file: str, numbers: dict[str, Any]) -> Part:
    """Return the part of a diagram that a result is."""
    names: dict[int, str] = {}
    found, about = Part({}, [], branch.notes), {"file": file, "numbers": numbers}
    for event in branch.events:
        if event["label"].decode() not in SPECIAL:
            continue
        row, stage = int(event["point"]), int(event["stage"])
        begins = event["name"] == b"start"
        if begins and stage > 1:
            names[row] = names[branch.origin(stage)]
            continue
        kind = "start" if begins else label_of(event["label"].decode()).kind
        names[row] = f"{file}: stage {stage}, {kind} {row}"
        columns = {name: float(event[name]) for name in branch.columns.shown()}
        changes = {name: int(event[name]) for name in ("index_before", "index_after")}
        found.nodes[names[row]] = {
            "kind": kind, "stage": stage, "breaks": event["breaks"].decode(), **changes, **about,
            "arclength": float(event["arclength"]), **columns,
        }  # fmt: skip
    for piece in branch.pieces():
        rows = branch.points[piece.rows]
        columns = {name: rows[name].tolist() for name in ("arclength", *branch.columns.shown())}
        ends = names[int(piece.rows[0])], names[int(piece.rows[-1])]
        followed = branch.followed(piece.stage)
        own = {"followed": followed, "factor": branch.scene.factor(followed), "index": branch.index_on(piece.rows)}
        found.edges.append((*ends, {"stage": piece.stage, **own, "ends": list(ends), **about, **columns}))
    return found


def add(graph, found: Part) -> None:
    """Add a result to the graph."""
    graph.add_nodes_from(found.nodes.items())
    graph.add_edges_from(found.edges)


def holds(graph, scene) -> bool:
    """Return that each combination is computed."""
    return False


def lines(found: Part) -> list[str]:
    """Return a result in words: its stages with their special points, and its notes."""
    graph = new_graph("", FORMAT)
    add(graph, found)
    return [*listed(graph), *found.notes]


def counts(graph, title: str) -> tuple[str, str]:
    """Return how many branches and special points a diagram has, in two lines."""
    kinds, files = [kind for _, kind in graph.nodes(data="kind")], {file for *_, file in graph.edges(data="file")}
    return (
        f"{title or TITLE}: {len(files)} branches",
        f"{kinds.count('fold')} folds, {kinds.count('branch point')} branch points",
    )


def listed(graph) -> Iterator[str]:
    """Yield each result of a graph in words: its numbers, then each stage with the special points along it."""
    files = {data["file"]: data["numbers"] for *_, data in graph.edges(data=True)}
    for file, numbers in files.items():
        yield words_of(numbers)
        edges = [data for *_, data in graph.edges(data=True) if data["file"] == file]
        for stage in sorted({data["stage"] for data in edges}):
            pieces = sorted((data for data in edges if data["stage"] == stage), key=lambda data: data["arclength"][0])
            name, factor = pieces[0]["followed"], pieces[0]["factor"]
            largest = max(abs(value) for data in pieces for value in data[name])
            points = [_number(without_round_off(pieces[0][name][0], largest) * factor)]
            ends = [(data["ends"][1], without_round_off(data[name][-1], largest) * factor) for data in pieces]
            points += [_point(graph.nodes[end], value) for end, value in ends]
            yield f"  stage {stage}, {name}: {' -> '.join(points)}"


def _point(node: dict, value: float) -> str:
    """Return the end of a piece in words."""
    change = f" (index {node['index_before']} -> {node['index_after']})" if node["index_before"] >= 0 else ""
    return f"{'' if node['kind'] == 'end' else node['kind'] + ' at '}{_number(value)}{change}"


def _number(value: float) -> str:
    return f"{value:.8g}"


def words_of(numbers: dict[str, Any]) -> str:
    """Return the numbers of a combination in words."""
    return ", ".join(f"{name} = {value if isinstance(value, str) else exact_text(value)}" for name, value in numbers.items())
