"""Result files of open strips and networks for the page: each stage is a branch, with columns and a shape at every point."""

from __future__ import annotations

import collections
from collections.abc import Iterator, Mapping
from pathlib import Path

import numpy as np

from branches.draw.structure import Fixture, fixtures_of, parts_of
from branches.explore.packing import column, compressed
from branches.explore.profiles import marked
from branches.explore.snaps import states_of
from branches.explore.solutions import filled, solutions
from branches.explore.strips import UNKNOWN
from branches.run.barriers import falls, told
from branches.scene.columns import NUMBER
from branches.scene.labels import START, label_of
from branches.store.branch import StoredBranch
from branches.store.files import StoreError
from branches.store.read import read_branch, read_kind
from contin.lowlevel import levels

#: Nodes of a strip. Twice as many make pages twice as large; a quarter of them shows corners where a strip bends most.
_NODES = 97
#: A read-out has room for so many columns, without a need to scroll; of more, it has the numbers and what is conjugate to them.
_ROOM = 24
#: Distance of the eye from the middle of a state, in units of half the frame, and the part of it that a state fills.
_FAR, _FILLED = 1.1, 0.92


def gathered(files: list[Path], title: str, slow: bool = True) -> dict:
    """Return the data of a page; see `branches.explore.gather.gather`.

    With ``slow``, it says what strips do past folds, which takes seconds for each.

    Raises
    ------
    StoreError
        A file of another kind, or without a column in common with the others.
    """
    kind = read_branch(files[0]).scene.KIND
    branches = [(path, read_kind(path, kind)) for path in files]
    first = branches[0][1]
    parameter = first.followed(int(first.points["stage"][-1]))
    common = set.intersection(*(set(branch.points.dtype.names) for _, branch in branches))
    columns = [name for name in first.columns.shown() if name in common]
    varying = [name for name in columns if any(_varies(branch.points[name]) for _, branch in branches)]
    if parameter not in varying:
        raise StoreError(f"the results have no column in common that is followed; that of the first one is {parameter!r}")
    shown = [parameter, first.conjugate(parameter)]
    brief = {"energy", "potential", *(first.conjugate(stage.follow) for stage in first.stages)}
    brief |= {name for name in varying if first.columns.all[name].role == NUMBER}
    stages, reach = [], 0.0
    kept = [*dict.fromkeys([*varying, *shown])]
    for path, branch in branches:
        snaps = {fall.row: f"Let go past it, the strip {told(branch, fall)}." for fall in falls(branch)} if slow else {}
        shapes, scale = _shapes(branch), 2 * np.pi / branch.shape_length
        reach = max(reach, scale * max(np.linalg.norm(shape.centreline, axis=1).max() for shape in shapes.values()))
        about = "" if len(branches) == 1 else f"{path.stem}, "
        stages += [one | {"name": about + one["name"]} for one in _stages(path, branch, kept, shapes, snaps)]
    return {
        "title": title or first.config["title"] or first.scene.name, "kind": "open",
        "axes": [
            (name, name if words == name else f"{words} ({name})", name) for name, words, _ in first.columns.axes(varying)
        ],
        "shown": shown, "told": [name for name in varying if len(varying) <= _ROOM or name in brief], "scale": _FILLED / reach,
        "eye": (_FAR * first.view.axes[2]).tolist(),
        "families": [{"name": "stages", "parameter": parameter, "branches": stages, "circles": []}],
    }  # fmt: skip


def _varies(values: np.ndarray) -> bool:
    return bool(np.ptp(values) > levels.LOCATED * (1 + np.abs(values).max()))


def _shapes(branch: StoredBranch) -> dict:
    """Return the shapes of all points whose solution is found, with equidistant nodes, as pictures show them."""
    at = np.linspace(0, 1, _NODES)
    found = {number: one for number, one in enumerate(solutions(branch)) if one is not None}
    shapes = [branch.shape_at(number, at, system.evaluate(x, at))[0] for number, (system, x) in found.items()]
    return dict(zip(found, branch.stood(shapes)))


def _states(branch: StoredBranch, shapes: dict) -> np.ndarray:
    """Return every point's states (points, _NODES, strips * 8): those of the strips side by side; lengths are up to 2 pi."""
    strips = [states_of(one) for one in zip(*(parts_of(shape) for shape in shapes.values()))]
    for values in strips:
        values[..., -3:] *= 2 * np.pi / branch.shape_length
    return filled(branch, list(shapes), np.concatenate(strips, axis=-1))


def _stages(
    path: Path, branch: StoredBranch, columns: list[str], shapes: dict, snaps: Mapping[int, str]
) -> Iterator[dict]:  # fmt: skip
    states, unit = _states(branch, shapes), 2 * np.pi / branch.shape_length
    for number in np.unique(branch.stage_of):
        first = next(shape for point, shape in shapes.items() if branch.stage_of[point] == number)
        about = _stage(path, branch, int(number), columns, snaps) | {"shapes": compressed(states[branch.stage_of == number])}
        yield about | {"fixtures": [_fixture(branch, int(number), one, unit) for one in fixtures_of(first)]}


def _fixture(branch: StoredBranch, stage: int, one: Fixture, unit: float) -> dict:
    """Return a joint, a support or a force: where it is fixed, and the profile that is turned around the first axis.

    ``signs`` are those of a force at the points of the stage.
    """
    about = {
        "part": one.part, "last": one.last, "held": one.held, "inSpace": one.in_space, "arm": [unit * x for x in one.arm],
        "axes": one.axes.tolist(), "sides": one.turned[0], "profile": one.turned[1].tolist(),
    }  # fmt: skip
    if not one.number:
        return about
    return about | {"signs": column(np.sign(branch.force(one.number)[branch.stage_of == stage]).astype(int))}


def _stage(path: Path, branch: StoredBranch, number: int, columns: list[str], snaps: Mapping[int, str]) -> dict:
    rows = np.flatnonzero(branch.stage_of == number)
    labels = [branch.points["label"][row].decode() for row in rows]
    names = {int(event["point"]): event["name"].decode() for event in branch.events}
    last, singular = number == branch.points["stage"][-1], [bool(label) and label_of(label).singular for label in labels]
    table = {name: branch.points[name][rows] for name in (*columns, "arclength", "index")}
    table["index"] = np.where(singular, UNKNOWN, table["index"])  # there, that of one side is as good as that of the other
    if (table["index"] == UNKNOWN).all():  # as under loads without an energy
        del table["index"]
    after = {int(event["point"]): int(event["index_after"]) for event in branch.events}
    about = marked(labels, [names.get(int(row), "") for row in rows])
    count: collections.Counter = collections.Counter()
    for mark in about["marks"]:  # as `start_at` of a scene names them
        label, row = labels[mark["point"]], int(rows[mark["point"]])
        if row in snaps:
            mark["fall"] = snaps[row]
        if after[row] >= 0:
            mark["index_after"] = after[row]
        if names.get(row) != START:
            count[label] += 1
            mark["tag"] = f"{label} {count[label]}"
    return {
        "profile": True, "domain": "open", "name": f"stage {number}: {branch.followed(number)}",
        "file": f"{path.stem}_{number}.h5", "stop": branch.stop if last else "", **about,
        "columns": {name: column(values) for name, values in table.items()}, "components": [],
    }  # fmt: skip
