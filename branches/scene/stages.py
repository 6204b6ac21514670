"""The stages of a scene with their mechanics."""

from __future__ import annotations

from branches.scene.fields import Scene
from branches.scene.stage import Stage


def stages_of(scene: Scene) -> list[Stage]:
    """Return the stages of a scene, in order; open and closed strips need mechanics that the others do not."""
    if scene.KIND == "closed strip":
        from branches.scene.closed_stage import ClosedStage

        return [ClosedStage(scene)]
    from branches.scene.open_stage import OpenStage

    return [OpenStage(scene, number) for number in range(1, scene.stage_count + 1)]
