"""How results of a kind of strip make a diagram.

A kind is a module with the name of its ``FORMAT``, a ``TITLE`` for diagrams without one, ``EXACT`` if there are quadratures
for a preview, and these functions:

- ``part(branch, file, numbers)``: the part of a diagram that a result is; it can be sent to another process;
- ``add(graph, part)``: add it to a diagram;
- ``lines(part)``: the part in words;
- ``holds(graph, scene)``: whether a diagram has the branch of a scene, from its other end;
- ``counts(graph, title)``: how many branches and special points a diagram has, in two lines.
"""

from __future__ import annotations

from types import ModuleType

from branches.graph import closed, open_strips
from branches.scene.fields import Scene
from branches.scene.sweep import Sweep
from branches.store.layout import CLOSED, OPEN


def graph_kind(scene: Scene | Sweep) -> ModuleType:
    """Return the kind of diagram that results of a scene make."""
    return {CLOSED: closed, OPEN: open_strips}[next(iter(scene.scenes.values())).KIND]
