"""Diagrams as files: JSON in the node-link form of networkx, and GraphML."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np

from branches.store import interrupt
from branches.store.files import DIAGRAM, StoreError, no_diagram, write_bytes

#: The diagram in another format.
GRAPHML = "diagram.graphml"
#: Names of the formats of diagrams: of closed strips, and of open ones.
CLOSED_FORMAT, OPEN_FORMAT = "ribbon bifurcation diagram", "open strip diagram"
#: Columns of a branch that an edge carries in a diagram of closed strips.
COLUMNS = ("arclength", "kappa_n", "kappa_star", "energy")


def new_graph(title: str = "", kind: str = CLOSED_FORMAT):
    """Return an empty diagram."""
    import networkx

    return networkx.MultiGraph(title=title, format=kind, format_version=1)


def save(graph, folder: Path) -> tuple[Path, Path]:
    """Write ``diagram.json`` (networkx node-link form, columns as lists) and ``diagram.graphml`` (columns as JSON text)."""
    import networkx

    folder = Path(folder)
    data = networkx.node_link_data(graph, edges="edges")  # `json.dumps` with ``indent`` takes four times as long:
    rows = {name: ",\n".join(map(json.dumps, data.pop(name))) for name in ("nodes", "edges")}
    lists = ", ".join(f'"{name}": [\n{lines}\n]' for name, lines in rows.items())
    text = f"{json.dumps(data)[:-1]}, {lists}}}\n"
    plain = networkx.MultiGraph(**graph.graph)
    for one, data in graph.nodes(data=True):
        plain.add_node(one, **_plain(data))
    for a, b, data in graph.edges(data=True):
        plain.add_edge(a, b, **_plain(data))
    paths = folder / DIAGRAM, folder / GRAPHML
    with interrupt.held():  # both or none
        write_bytes(paths[0], text.encode())
        write_bytes(paths[1], "\n".join(networkx.generate_graphml(plain)).encode())
    return paths


def _plain(data: dict) -> dict:
    """Return attributes with lists and mappings as JSON text, which is all that GraphML can hold."""
    return {name: json.dumps(value) if isinstance(value, (list, dict)) else value for name, value in data.items()}


def read(folder: str | Path):
    """Return the diagram in a folder or ``diagram.json``; raise StoreError where there is none, or it is of open strips."""
    graph = read_any(folder)
    if graph.graph["format"] != CLOSED_FORMAT:
        raise StoreError(f"{str(folder)!r} is the diagram of open strips; branches.graph and branches.explore show it")
    return graph


def read_any(folder: str | Path):
    """Return the diagram in a folder; it may also be of open strips. Raises StoreError where there is none."""
    import networkx

    path = Path(folder)
    path = path / DIAGRAM if path.is_dir() else path
    try:
        graph = networkx.node_link_graph(json.loads(path.read_text(encoding="utf-8")), edges="edges")
        if graph.graph["format"] == CLOSED_FORMAT:
            _check(graph)
        elif graph.graph["format"] != OPEN_FORMAT:
            raise KeyError("format")
        return graph
    except (
        OSError, ValueError, KeyError, TypeError, AttributeError, RecursionError, networkx.NetworkXException
    ) as error:  # fmt: skip
        told = error.strerror if isinstance(error, OSError) and path.exists() else no_diagram(path)
        raise StoreError(f"cannot read {str(folder)!r}: {told}") from error


def _check(graph) -> None:
    """Raise ValueError, KeyError or TypeError unless nodes and edges have the data for the queries."""
    for _, data in graph.nodes(data=True):
        if not (isinstance(data["kind"], str) and isinstance(data["law"], str)):
            raise TypeError("kind and law are texts")
        for name in ("nu", "kappa_n", "kappa_star", *(("covering",) if data["kind"] == "circle" else ())):
            float(data[name])
    for *_, data in graph.edges(data=True):
        if not all(isinstance(data[name], kind) for name, kind in (("law", str), ("m", int), ("n", int))):
            raise TypeError("a branch is known by its law, m and n")
        columns = np.array([data[name] for name in COLUMNS], dtype=float)
        if columns.ndim != 2 or not columns.shape[1] or not np.isfinite(columns).all():
            raise ValueError("columns are as long as each other, and numbers")
        float(data["nu"])
