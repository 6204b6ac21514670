"""Read a branch file: of a closed strip, or of an open one."""

from __future__ import annotations

from pathlib import Path

from branches.config import Config, ConfigError, dump, parse
from branches.files import StoreError
from branches.open_config import OpenConfig
from branches.read_closed import StoredBranch
from branches.store import open_branch

__all__ = ["StoredBranch", "complete_run", "read_branch"]


def read_branch(path: str | Path) -> StoredBranch:
    """Return the branch in a file.

    Raises
    ------
    StoreError
        See `branches.store.open_branch`; or this version does not know its scene.
    """
    with open_branch(Path(path)) as file:
        solutions, attributes = file["solutions"], file.attrs
        try:
            scene = parse(attributes["config"], str(path))
            config = scene.model_dump()
        except ConfigError as error:
            raise StoreError(f"cannot read {str(path)!r}: its scene is unknown ({error})") from error
        return _class_of(scene)(
            config, attributes["status"], attributes["stop"], attributes["stop_reason"], file["points"][:],
            file["events"][:], solutions["index"][:], solutions["t"][:], solutions["states"][:],
            tuple(str(attributes.get("notes", "")).splitlines()),
        )  # fmt: skip


def _class_of(scene: Config | OpenConfig) -> type[StoredBranch]:
    """Return the class of a result."""
    if not isinstance(scene, OpenConfig):
        return StoredBranch
    from branches.open_branch import OpenBranch  # needs the mechanics of open strips, which closed ones do not

    return OpenBranch


def complete_run(path: Path, config: Config) -> StoredBranch | None:
    """Return the branch of a scene in a file if it exists and is complete, otherwise None."""
    try:
        branch = read_branch(path)
    except StoreError:
        return None
    same = parse(dump(config), "scene").model_dump() == branch.config
    return branch if branch.status == "complete" and same else None
