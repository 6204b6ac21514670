"""``python -m branches.graph DIR``: bifurcation diagrams as graphs: special points, and the pieces of branches between them."""

from __future__ import annotations


def read(path):
    """Return the diagram in a folder (or in a ``diagram.json``) as a networkx graph; for a scene, ``.yaml``, its preview.

    Raises branches.store.files.StoreError where there is none, or the scene is none.
    """
    from branches.graph.__main__ import read as found  # nothing is imported before it is known what to do

    return found(path)
