"""The stages of a scene with their mechanics."""

from __future__ import annotations

from branches.scene.fields import Scene
from branches.scene.stage import Stage


def stages_of(scene: Scene) -> list[Stage]:
    """Return the stages of a scene, in order."""
    return _KINDS[scene.KIND](scene)


def _closed(scene: Scene) -> list[Stage]:
    from branches.scene.closed_stage import ClosedStage  # each kind of strip needs mechanics that the other does not

    return [ClosedStage(scene)]


def _open(scene: Scene) -> list[Stage]:
    from branches.scene.open_stage import OpenStage

    return [OpenStage(scene, number) for number in range(1, scene.stage_count + 1)]


def _network(scene: Scene) -> list[Stage]:
    from branches.scene.network_stage import NetworkStage

    return [NetworkStage(scene, number) for number in range(1, scene.stage_count + 1)]


_KINDS = {"closed strip": _closed, "open strip": _open, "network": _network}
