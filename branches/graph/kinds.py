"""How results of a kind of strip make a diagram.

A kind is a module with the name of its ``FORMAT``, a ``TITLE`` for diagrams without one, ``EXACT`` if there are quadratures
for a preview, the kinds of special points that are ``COUNTED``, and

- ``part(branch, file, numbers)``: the part of a diagram that a result is (`branches.graph.parts.Part`);
- ``holds(graph, scene)``, for scenes with an ``other_end``: whether a diagram has the branch of a scene, from there.
"""

from __future__ import annotations

from types import ModuleType

from branches.graph import closed, open_strips
from branches.scene.fields import Scene
from branches.scene.sweep import Sweep
from branches.store.layout import CLOSED


def graph_kind(scene: Scene | Sweep) -> ModuleType:
    """Return the kind of diagram that results of a scene make."""
    return closed if next(iter(scene.scenes.values())).KIND == CLOSED else open_strips
