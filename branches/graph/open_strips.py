"""The results of a scene of many open strips as a graph: labelled points, and the pieces of stages between them.

Nodes have the columns of their points (dimensionless), ``kind``, ``stage``, ``file``, and ``numbers``: what the scene has lists
of. A stage begins at the node of the earlier stage from which it starts. Edges have columns as lists, the ``followed`` number
and the ``factor`` that gives it its unit, the ``index`` along them (-1 where it is not known), and their ``ends``.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from typing import Any

from branches.graph.parts import Part, add, edges_of, special
from branches.graph.stored import OPEN_FORMAT, new_graph
from branches.scene.labels import START, begins, label_of, without_round_off
from branches.store.branch import Piece
from branches.store.open_branch import OpenBranch
from contin.lowlevel import exact_text

#: The format of diagrams of open strips, the title of one without, and whether there is an exact solution.
FORMAT, TITLE, EXACT = OPEN_FORMAT, "open strips", False
#: The kinds of special points that a summary counts, in words.
COUNTED = {"fold": "folds", "branch point": "branch points"}


def part(branch: OpenBranch, file: str, numbers: dict[str, Any]) -> Part:
    """Return the part of a diagram that a result is."""
    names: dict[int, str] = {}
    nodes, own = [], {"file": file, "numbers": numbers}
    for event in special(branch):
        row, stage = int(event["point"]), int(event["stage"])
        if begins(event) and stage > 1:
            names[row] = names[branch.origin(stage)]
            continue
        kind = START if begins(event) else label_of(event["label"].decode()).kind
        names[row] = f"{file}: stage {stage}, {kind} {row}"
        columns = {name: float(event[name]) for name in ("arclength", *branch.columns.shown())}
        changes = {name: int(event[name]) for name in ("index_before", "index_after")}
        about = {"kind": kind, "stage": stage, "breaks": event["breaks"].decode()}
        nodes.append((names[row], about | changes | own | columns))

    def about(piece: Piece) -> dict:
        ends, followed = [names[int(piece.rows[end])] for end in (0, -1)], branch.followed(piece.stage)
        return {
            "stage": piece.stage, "followed": followed, "factor": branch.scene.factor(followed),
            "index": branch.index_on(piece.rows), "ends": ends, **own,
        }  # fmt: skip

    found = Part(nodes, edges_of(branch, names, branch.columns.shown(), about))
    graph = new_graph("", FORMAT)
    add(graph, found)
    return replace(found, words=(*listed(graph), *branch.notes))


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
