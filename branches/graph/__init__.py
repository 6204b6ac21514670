"""``python -m branches.graph DIR``: bifurcation diagrams as graphs: special points, and the pieces of branches between them."""

from __future__ import annotations

from pathlib import Path


def read(path: str | Path):
    """Return the diagram in a folder (or in a ``diagram.json``) as a networkx graph; for a scene, ``.yaml``, its preview.

    Raises StoreError where there is none, or the scene is none.
    """
    from branches.graph.kinds import graph_kind  # nothing is imported before it is known what to do
    from branches.graph.stored import read_any
    from branches.scene.fields import ConfigError
    from branches.scene.parse import load
    from branches.store.files import StoreError

    if Path(path).suffix not in (".yaml", ".yml"):
        return read_any(path)
    try:
        scene = load(path)
    except ConfigError as error:
        raise StoreError(str(error)) from error
    kind = graph_kind(scene)
    if not kind.EXACT:
        raise StoreError(f"{str(path)!r} is a scene of an open strip, for which there is no exact solution; run it")
    return kind.preview(scene)
