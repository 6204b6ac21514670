"""Branches that contin stored, of any problem, for the page: their columns, and the states at every point."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from branches.explore.packing import column, compressed
from branches.store.files import StoreError
from contin.lowlevel import Label, StoredColumns, read_branches

#: Nodes of a profile, at most. Twice as many make pages twice as large; a quarter of them shows corners at steep layers.
MOST_NODES = 161
#: Kinds of labelled points, as the page knows them.
KINDS = {Label.FOLD: "fold", Label.BRANCH_POINT: "secondary", Label.HOPF: "hopf", Label.USER_ZERO: "user"}


def gathered(files: list[Path]) -> dict:
    """Return the data of a page of stored branches; see `branches.explore.gather.gather`.

    Raises StoreError where a file cannot be read or has fewer than two points, or the files have no free parameter in common.
    """
    stored = [each for path in files for each in _read(path)]
    columns, first = [one.columns for *_, one in stored], stored[0][2]
    common = [name for name in first.columns if all(name in one for one in columns)]
    common = [
        name for name in common  # the largest value of an equilibrium is the state itself
        if name[4:] not in common or not all(np.array_equal(one[name], one[name[4:]]) for one in columns)
    ]  # fmt: skip
    free = [name for name in first.free if all(name in one.free for *_, one in stored)]
    if not free:
        raise StoreError(f"the branches have no free parameter in common; that of {str(files[0])!r} is {', '.join(first.free)}")
    varying = [name for name in common if name != "index" and np.ptp(np.concatenate([one[name] for one in columns]))]
    axes = [name for name in common if name in (*free, *varying)]
    beside = ("arclength", "discretization_error", "rounds", "norm")  # not what a branch is drawn by at first
    upwards = [name for name in axes if name not in (*free, *beside)] + ["norm"]
    branches = [_branch(*each, axes) for each in stored]
    family = {"name": "branches", "parameter": free[0], "branches": branches, "circles": []}
    return {
        "title": ", ".join(path.stem for path in files[:3]) + (" …" if len(files) > 3 else ""), "kind": "branches",
        "axes": [(name, name, name) for name in axes], "shown": [free[0], upwards[0]], "families": [family],
    }  # fmt: skip


def _read(path: Path) -> list[tuple[str, str, StoredColumns]]:
    """Return name, file and columns of the branches of a file."""
    try:
        stored = read_branches(path)
    except OSError as error:
        raise StoreError(f"cannot read {str(path)!r}: {error.strerror}") from error
    for one in stored:
        if len(one.labels) < 2:
            raise StoreError(f"{str(path)!r} holds {len(one.labels)} point; a branch has two at least")
        if bad := [name for name, values in one.columns.items() if not np.isfinite(values).all()]:
            raise StoreError(f"{str(path)!r}: the column {bad[0]!r} holds values that are no numbers")
    names = [path.stem] if len(stored) == 1 else [f"{path.stem} {number}" for number in range(len(stored))]
    return [(name, f"{name}{path.suffix}", one) for name, one in zip(names, stored)]


def _branch(name: str, file: str, stored: StoredColumns, axes: list[str]) -> dict:
    kept = dict.fromkeys([*axes, *(one for one in ("arclength", "index") if one in stored.columns)])
    count = min(max(len(times) for times, _ in stored.profiles), MOST_NODES)
    values = []
    for times, states in stored.profiles:  # at ``count`` of the nodes; of a map, at the first point of a cycle
        at, table = np.linspace(0, len(times) - 1, count), np.column_stack([times, states[: len(times)]])
        values.append(np.array([np.interp(at, np.arange(len(times)), column) for column in table.T]).T)
    return {
        "profile": True, "name": name, "file": file, "stop": stored.stop,
        **marked(stored.labels, stored.names),
        "columns": {one: column(stored.columns[one]) for one in kept}, "components": stored.states,
        "shapes": compressed(np.array(values), each=True),
    }  # fmt: skip


def marked(labels: Sequence[str], names: Sequence[str]) -> dict:
    """Return the marks and the labels of a branch from label and name of each point, '' for those without."""
    there = {number: label for number, label in enumerate(labels) if label}
    marks = [
        {"point": number, "kind": KINDS.get(label, "end"), "name": f"{label} {names[number]}".rstrip()}
        for number, label in there.items()
    ]
    return {"marks": marks, "labels": there}
