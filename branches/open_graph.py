"""The results of a scene of many open strips as a graph: labelled points, and the pieces of stages between them.

Nodes have the columns of their points (dimensionless), ``kind``, ``stage``, ``file``, and ``numbers``: what the scene has lists
of. A stage begins at the node of the earlier stage from which it starts. Edges have columns as lists, the ``followed`` number
and the ``factor`` that gives it its unit, the ``index`` along them (-1 where it is not known), and their ``ends``.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np

from branches.diagram_graph import OPEN_FORMAT
from branches.labels import SPECIAL, label_of, without_round_off
from branches.open_branch import OpenBranch
from contin.lowlevel import exact_text

#: Columns that say nothing of a state.
_LEFT_OUT = (
    "point", "stage", "iterations", "newton_error", "discretization_error", "intervals", "index", "index_before", "index_after",
    "kernel",
)  # fmt: skip


def new_graph(title: str):
    """Return an empty graph."""
    import networkx

    return networkx.MultiGraph(title=title, format=OPEN_FORMAT, format_version=1)


def add_result(graph, branch: OpenBranch, file: str, numbers: dict[str, Any]) -> None:
    """Add a result to the graph."""
    nodes: dict[int, str] = {}
    about = {"file": file, "numbers": numbers}
    for event in branch.events:
        if event["label"].decode() not in SPECIAL:
            continue
        row, stage = int(event["point"]), int(event["stage"])
        begins = event["name"] == b"start"
        if begins and stage > 1:
            nodes[row] = nodes[branch.origin(stage)]
            continue
        kind = "start" if begins else label_of(event["label"].decode()).kind
        nodes[row] = f"{file}: stage {stage}, {kind} {row}"
        columns = {name: float(event[name]) for name in _columns(event.dtype)}
        changes = {name: int(event[name]) for name in ("index_before", "index_after")}
        graph.add_node(nodes[row], kind=kind, stage=stage, breaks=event["breaks"].decode(), **changes, **about, **columns)
    for piece in branch.pieces():
        rows = branch.points[piece.rows]
        columns = {name: rows[name].tolist() for name in _columns(rows.dtype)}
        ends = nodes[int(piece.rows[0])], nodes[int(piece.rows[-1])]
        followed, index = branch.followed(piece.stage), branch.index_on(piece.rows)
        own = {"followed": followed, "factor": branch.scene.factor(followed), "index": index, "ends": list(ends)}
        graph.add_edge(*ends, stage=piece.stage, **own, **about, **columns)


def _columns(kind: np.dtype) -> list[str]:
    return [name for name in kind.names if kind[name] == np.float64 and name not in _LEFT_OUT and not name.startswith("error")]


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
