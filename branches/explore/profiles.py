"""Branches that contin stored, of any problem, for the page: their columns, and the states at every point."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np

from branches.explore.packing import column, compressed
from branches.store.files import StoreError
from contin.lowlevel import Label, StoredColumns, read_columns

#: The column of the size of the states, their root mean square over the nodes.
NORM = "norm"
#: Nodes of a profile, at most. Twice as many make pages twice as large; a quarter of them shows corners at steep layers.
MOST_NODES = 161
#: Kinds of labelled points, as the page knows them.
KINDS = {Label.FOLD: "fold", Label.BRANCH_POINT: "secondary", Label.HOPF: "hopf", Label.USER_ZERO: "user"}


def gathered(files: list[Path]) -> dict:
    """Return the data of a page of stored branches; see `branches.explore.gather.gather`.

    Raises
    ------
    StoreError
        A file cannot be read or has fewer than two points, or the files have no free parameter in common.
    """
    stored = {path: _read(path) for path in files}
    first = next(iter(stored.values()))
    common = [name for name in first.columns if all(name in one.columns for one in stored.values())]
    free = [name for name in first.free if all(name in one.free for one in stored.values())]
    if not free:
        raise StoreError(f"the branches have no free parameter in common; that of {str(files[0])!r} is {', '.join(first.free)}")
    axes = [name for name in common if name != "index" and _varies(name, stored)]
    beside = ("arclength", "discretization_error", NORM)  # not what a branch is drawn by at first
    upwards = [name for name in axes if name not in (*free, *beside)] + [NORM]
    branches = [_branch(path, one, axes) for path, one in stored.items()]
    family = {"name": "branches", "parameter": free[0], "branches": branches, "circles": []}
    return {
        "title": ", ".join(path.stem for path in files[:3]) + (" …" if len(files) > 3 else ""), "kind": "branches",
        "axes": [(name, name, name) for name in axes], "shown": [free[0], upwards[0]], "families": [family],
    }  # fmt: skip


def _varies(name: str, stored: dict[Path, StoredColumns]) -> bool:
    values = np.concatenate([one.columns[name] for one in stored.values()])
    return bool(np.ptp(values) > 0) or any(name in one.free for one in stored.values())


def _read(path: Path) -> StoredColumns:
    try:
        stored = read_columns(path)
    except OSError as error:
        raise StoreError(f"cannot read {str(path)!r}: {error.strerror}") from error
    if len(stored.labels) < 2:
        raise StoreError(f"{str(path)!r} holds {len(stored.labels)} point; a branch has two at least")
    more = {NORM: np.array([np.sqrt(np.mean(states**2)) for _, states in stored.profiles])}
    if all(len(times) == 1 for times, _ in stored.profiles):  # an algebraic problem: its states are columns, too
        more |= dict(zip(stored.states, np.array([states[0] for _, states in stored.profiles]).T))
    columns = stored.columns | {name: values for name, values in more.items() if name not in stored.columns}
    if bad := [name for name, values in columns.items() if not np.isfinite(values).all()]:
        raise StoreError(f"{str(path)!r}: the column {bad[0]!r} holds values that are no numbers")
    return replace(stored, columns=columns)


def _branch(path: Path, stored: StoredColumns, axes: list[str]) -> dict:
    kept = [*axes, *(name for name in ("arclength", "index") if name in stored.columns and name not in axes)]
    count = min(max(len(times) for times, _ in stored.profiles), MOST_NODES)
    values = np.array([_sampled(times, states, count) for times, states in stored.profiles])
    return {
        "profile": True, "name": path.stem, "file": path.name, "stop": stored.stop,
        **marked(stored.labels, stored.names),
        "columns": {name: column(stored.columns[name]) for name in kept}, "components": stored.states,
        "shapes": compressed(values, each=True),
    }  # fmt: skip


def marked(labels: Sequence[str], names: Sequence[str]) -> dict:
    """Return the marks and the labels of a branch from label and name of each point, '' for those without."""
    there = {number: label for number, label in enumerate(labels) if label}
    marks = [
        {"point": number, "kind": KINDS.get(label, "end"), "name": f"{label} {names[number]}".rstrip()}
        for number, label in there.items()
    ]
    return {"marks": marks, "labels": there}


def _sampled(times: np.ndarray, states: np.ndarray, count: int) -> np.ndarray:
    """Return the time and the states at ``count`` of the nodes, shape (count, 1 + states); they are dense where the mesh is."""
    at, table = np.linspace(0, len(times) - 1, count), np.column_stack([times, states])
    return np.array([np.interp(at, np.arange(len(times)), column) for column in table.T]).T
