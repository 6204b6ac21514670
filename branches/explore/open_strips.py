"""Result files of open strips for the page: each stage is a branch, with its columns and a shape at every point."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import numpy as np

from branches.explore.packing import column, compressed
from branches.explore.profiles import marked
from branches.explore.snaps import states_of
from branches.explore.solutions import filled, solutions
from branches.store.branch import StoredBranch
from branches.store.files import StoreError
from branches.store.layout import OPEN
from branches.store.read import read_kind

#: Nodes of a shape. Twice as many make pages twice as large; a quarter of them shows corners where a strip bends most.
_NODES = 97


def gathered(files: list[Path], title: str) -> dict:
    """Return the data of a page; see `branches.explore.gather.gather`.

    Raises
    ------
    StoreError
        A file of another kind, or without a column in common with the others.
    """
    branches = [(path, read_kind(path, OPEN)) for path in files]
    first = branches[0][1]
    parameter = first.followed(int(first.points["stage"][-1]))
    common = set.intersection(*(set(branch.points.dtype.names) for _, branch in branches))
    columns = [name for name in first.columns.shown() if name in common]
    varying = [name for name in columns if any(np.ptp(branch.points[name]) > 0 for _, branch in branches)]
    if parameter not in varying:
        raise StoreError(f"the results have no column in common that is followed; that of the first one is {parameter!r}")
    stages = [stage for path, branch in branches for stage in _stages(path, branch, varying)]
    family = {"name": "stages", "parameter": parameter, "branches": stages, "circles": []}
    return {
        "title": title or first.config["title"] or first.scene.name, "kind": "open",
        "axes": [(name, f"{words} ({name})", name) for name, words, _ in first.columns.axes(varying)],
        "shown": [parameter, first.conjugate(parameter)], "families": [family],
    }  # fmt: skip


def _stages(path: Path, branch: StoredBranch, columns: list[str]) -> Iterator[dict]:
    shapes = _shapes(branch)
    for number in np.unique(branch.stage_of):
        yield _stage(path, branch, int(number), columns, shapes[branch.stage_of == number])


def _shapes(branch: StoredBranch) -> np.ndarray:
    """Return every point's states at equidistant nodes (points, _NODES, 8); the length is 2 pi, as that of closed strips."""
    at, found = np.linspace(0, 1, _NODES), solutions(branch)
    known = [number for number, one in enumerate(found) if one is not None]
    values = states_of(branch.shape_at(number, at, found[number][0].evaluate(found[number][1], at))[0] for number in known)
    values[..., -3:] *= 2 * np.pi
    return filled(branch, known, values)


def _stage(path: Path, branch: StoredBranch, number: int, columns: list[str], shapes: np.ndarray) -> dict:
    rows = np.flatnonzero(branch.stage_of == number)
    labels = [branch.points["label"][row].decode() for row in rows]
    names = {int(event["point"]): event["name"].decode() for event in branch.events}
    kept, last = [*columns, "arclength", "index"], number == branch.points["stage"][-1]
    return {
        "profile": True, "domain": "open", "name": f"{path.stem}, stage {number}: {branch.followed(number)}",
        "file": f"{path.stem}_{number}.h5", "stop": branch.stop if last else "",
        **marked(labels, [names.get(int(row), "") for row in rows]),
        "columns": {name: column(branch.points[name][rows]) for name in kept}, "components": [],
        "shapes": compressed(shapes),
    }  # fmt: skip
