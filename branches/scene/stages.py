"""The stages of a scene with their mechanics."""

from __future__ import annotations

from branches.scene.fields import Scene
from branches.scene.stage import Stage


def stages_of(scene: Scene) -> list[Stage]:
    """Return the stages of a scene, in order; each kind of strip needs mechanics that the others do not."""
    if scene.KIND == "closed strip":
        from branches.scene.closed_stage import ClosedStage

        return [ClosedStage(scene)]
    if scene.KIND == "open strip":
        from branches.scene.open_stage import OpenStage as Kind
    else:
        from branches.scene.network_stage import NetworkStage as Kind
    return [Kind(scene, number) for number in range(1, scene.stage_count + 1)]
