"""How results of a kind of strip make a diagram: their parts of it, and what is counted."""

from __future__ import annotations

from abc import ABC, abstractmethod
from typing import Any, ClassVar

from branches.graph import closed, open_strips
from branches.graph.stored import CLOSED_FORMAT, OPEN_FORMAT, new_graph
from branches.scene.fields import Scene
from branches.scene.sweep import Sweep
from branches.store.files import StoreError
from branches.store.layout import CLOSED, OPEN


class GraphKind(ABC):
    """A kind of diagram: its format, and the name of one without a title."""

    FORMAT: ClassVar[str]
    title: ClassVar[str]

    def new(self, title: str = ""):
        """Return an empty diagram."""
        return new_graph(title, self.FORMAT)

    @abstractmethod
    def part(self, branch: Any, file: str, numbers: dict[str, Any]) -> Any:
        """Return the part of a diagram that a result is; it can be sent to another process."""

    @abstractmethod
    def add(self, graph: Any, part: Any) -> None:
        """Add a part to a diagram."""

    @abstractmethod
    def lines(self, part: Any) -> list[str]:
        """Return a part in words."""

    def holds(self, graph: Any, scene: Scene) -> bool:
        """Return whether a diagram has the branch of a scene, from its other end."""
        return False

    def preview(self, scene: Scene | Sweep):
        """Return the diagram of a scene without a run; raise StoreError if there is no exact solution."""
        raise StoreError("it is a scene of an open strip, for which there is no exact solution; run it")

    @abstractmethod
    def counts(self, graph: Any, title: str) -> tuple[str, str]:
        """Return how many branches, and how many special points a diagram has."""


class _Closed(GraphKind):
    FORMAT, title = CLOSED_FORMAT, "diagram"

    def part(self, branch, file, numbers):
        return closed.course_of(branch, file)

    def add(self, graph, part):
        closed.add_course(graph, part)

    def lines(self, part):
        nodes = [attributes for _, attributes in part.nodes]
        return [f"{part.name}: {closed.describe(nodes)}"]

    def holds(self, graph, scene):
        return closed.holds_circle(graph, scene.material, scene.nu, scene.m, scene.n)

    def preview(self, scene):
        from branches.graph.preview import preview  # the quadrature takes 0.15 s

        return preview(scene)

    def counts(self, graph, title):
        kinds = [kind for _, kind in graph.nodes(data="kind")]
        return (
            f"{title or self.title}: {len(closed.families(graph))} branches",
            f"{kinds.count('circle')} bifurcations of circles, {kinds.count('fold')} folds, "
            f"{kinds.count('leaves')} branches that end at the scene's own limits",
        )


class _Open(GraphKind):
    FORMAT, title = OPEN_FORMAT, "open strips"

    def part(self, branch, file, numbers):
        return open_strips.part_of(branch, file, numbers)

    def add(self, graph, part):
        open_strips.add_part(graph, part)

    def lines(self, part):
        graph = self.new()
        self.add(graph, part)
        return [*open_strips.listed(graph), *part.notes]

    def counts(self, graph, title):
        kinds = [kind for _, kind in graph.nodes(data="kind")]
        files = {file for *_, file in graph.edges(data="file")}
        return (
            f"{title or self.title}: {len(files)} branches",
            f"{kinds.count('fold')} folds, {kinds.count('branch point')} branch points",
        )


_KINDS = {CLOSED: _Closed(), OPEN: _Open()}


def graph_kind(scene: Scene | Sweep) -> GraphKind:
    """Return the kind of diagram that results of a scene make."""
    return _KINDS[next(iter(scene.scenes.values())).KIND]
