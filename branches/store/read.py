"""Read result files."""

from __future__ import annotations

from pathlib import Path

import h5py

from branches.scene.fields import ConfigError, Scene
from branches.scene.parse import parse
from branches.store.branch import StoredBranch
from branches.store.files import StoreError
from branches.store.layout import CLOSED
from branches.store.writer import open_branch


def read_branch(path: str | Path) -> StoredBranch:
    """Return the branch in a file.

    Raises
    ------
    StoreError
        See `branches.store.writer.open_branch`; or this version does not know its scene.
    """
    with open_branch(Path(path)) as file:
        return _branch(file, str(path))


def read_kind(path: str | Path, kind: str) -> StoredBranch:
    """Return the branch in a file; raise StoreError also if it is of another kind of strip."""
    branch = read_branch(path)
    if kind != branch.scene.KIND:
        raise StoreError(f"{str(path)!r}: {branch.scene.KIND}, others: {kind}; a page shows one kind of result")
    return branch


def _branch(file: h5py.File, name: str) -> StoredBranch:
    solutions, attributes = file["solutions"], file.attrs
    try:
        scene = parse(attributes["config"], name)
    except ConfigError as error:
        raise StoreError(f"cannot read {name!r}: its scene is unknown ({error})") from error
    return class_of(scene)(
        scene, attributes["status"], attributes["stop"], attributes["stop_reason"], file["points"][:],
        file["events"][:], solutions["index"][:], solutions["t"][:], solutions["states"][:],
        tuple(str(attributes.get("notes", "")).splitlines()),
    )  # fmt: skip


def class_of(scene: Scene) -> type[StoredBranch]:
    """Return the class of results of a kind of strip; open and closed strips need mechanics that the others do not."""
    if scene.KIND == CLOSED:
        from branches.store.closed_branch import ClosedBranch

        return ClosedBranch
    from branches.store.open_branch import OpenBranch

    return OpenBranch


def complete_run(path: Path, scene: Scene) -> StoredBranch | None:
    """Return the branch of a scene in a file if it exists and is complete, otherwise None."""
    try:
        branch = read_branch(path)
    except StoreError:
        return None
    return branch if branch.status == "complete" and branch.scene == scene else None
