"""What a branch file must hold to be read, looked at before anything is used: files may be damaged, foreign, or hostile."""

from __future__ import annotations

import contextlib
from collections.abc import Iterator
from pathlib import Path

import h5py
import numpy as np

from branches.store.files import StoreError

FORMAT = "ribbon continuation branch"
FORMAT_VERSION = 1
#: Kinds of strips: the attribute ``kind`` of a file. Files without it are of closed strips.
CLOSED, OPEN, NETWORK = "closed strip", "open strip", "network"
#: Columns that every reader may count on, whatever the version that wrote them.
_COLUMNS = {
    CLOSED: {
        "points": ("point", "label", "arclength", "kappa_n", "kappa_star", "energy", "M1", "M2", "length"),
        "events": ("point", "label", "name", "kappa_n", "kappa_star", "energy", "error_kappa_n"),
    },
    OPEN: {
        "points": ("point", "label", "arclength", "energy", "stage", "index", "F_tangent"),
        "events": ("point", "label", "name", "energy", "stage", "index", "index_before", "index_after"),
    },
    NETWORK: {
        "points": ("point", "label", "arclength", "energy", "stage", "index", "potential"),
        "events": ("point", "label", "name", "energy", "stage", "index", "index_before", "index_after"),
    },
}
_TEXTS = {"points": ("label",), "events": ("label", "name")}
#: A compressed file holds at most so many times its size.
_MOST_EXPANSION = 1100


@contextlib.contextmanager
def damage_told(path: Path | None) -> Iterator[None]:
    """What h5py raises for parts of a file that are missing or garbled, as a sentence."""
    try:
        yield
    except (KeyError, OSError, RuntimeError) as error:
        raise StoreError(f"cannot read {str(path)!r}: the file is damaged") from error


def _require(fact: object, what: str) -> None:
    if not fact:
        raise ValueError(what)


def check(file: h5py.File, path: Path) -> None:
    """See that a file is a branch that can be read; raise StoreError where it is none, of another version, or damaged."""
    if file.attrs.get("format") != FORMAT:
        raise StoreError(f"cannot read {str(path)!r}: it is not a branch written by this program")
    found = file.attrs["format_version"]
    if np.ndim(found) or found != FORMAT_VERSION:
        raise StoreError(
            f"cannot read {str(path)!r}: its format version is {' '.join(str(found).split())}, not {FORMAT_VERSION}"
        )
    try:
        for name in ("config", "status", "stop", "stop_reason"):
            _require(isinstance(file.attrs[name], str), f"its attribute {name} is no text")
        kind = file.attrs.get("kind", CLOSED)
        _require(isinstance(kind, str) and kind in _COLUMNS, f"it is of the kind {kind}")
        rows = {name: len(_table(file, name, columns)) for name, columns in _COLUMNS[kind].items()}
        _require(rows["points"] and rows["events"], "it holds no points")
        _check_solutions(file, rows["points"])
    except Exception as error:  # there is nothing that h5py may not raise for a file that is garbled
        reason = " ".join(str(error).split())[:100]
        raise StoreError(f"cannot read {str(path)!r}: the file is damaged ({reason})") from error


def _table(file: h5py.File, name: str, columns: tuple[str, ...]) -> h5py.Dataset:
    """One of the two tables."""
    table = dataset(file, name, 1, "V")
    kinds = {column: table.dtype[column] for column in table.dtype.names or ()}
    for column in columns:
        _require(column in kinds, f"no column {column} in /{name}")
    for column, kind in kinds.items():
        texts = column in ("label", "name", "breaks")
        _require(kind.kind in ("S" if texts else "if") and not kind.shape, f"column {column} of /{name} is of type {kind}")
    for column in _TEXTS[name]:
        np.char.decode(table[column], "utf-8")
    places = table["point"]
    _require(np.all(np.diff(places) > 0) and np.all(places >= 0), f"the points of /{name} are not in order")
    _require(not len(places) or places[-1] < len(file["points"]), f"/{name} names points that are not there")
    return table


def _check_solutions(file: h5py.File, points: int) -> None:
    """The kept solutions lie within their tables, and belong to points."""
    index, group = dataset(file, "solutions/index", 1, "V")[:], file["solutions"]
    nodes = len(dataset(group, "t", 1, "f"))
    states = dataset(group, "states", 2, "f")
    _require(states.shape == (nodes, len(file.attrs["states"])), f"/solutions/states has the shape {states.shape}")
    start, count, degree = (index[name].astype(np.int64) for name in ("start", "count", "degree"))
    _require(np.all(start >= 0) and np.all(count > 1) and np.all(start + count <= nodes), "solutions beyond their table")
    _require(np.all((degree >= 1) & (degree <= 100)) and np.all((count - 1) % degree == 0), "solutions of no polynomial degree")
    _require(np.all(np.diff(index["point"]) > 0) and np.all(index["point"] >= 0), "solutions are not in order")
    _require(len(index) and index["point"][0] == 0, "no solution of the first point")
    _require(index["point"][-1] < points, "solutions of points that are not there")


def dataset(group: h5py.Group, name: str, dimensions: int, kinds: str) -> h5py.Dataset:
    """A dataset of a file, of so many dimensions, of a kind of numbers (letters of numpy), no larger than the file can hold.

    Raises KeyError or ValueError where there is none, or it is another.
    """
    found = group[name]
    _require(isinstance(found, h5py.Dataset) and not found.external and not found.is_virtual, f"/{name} is no plain dataset")
    _require(found.file == group.file, f"/{name} is in another file")
    _require(found.ndim == dimensions and found.dtype.kind in kinds, f"/{name} has {found.ndim} dimensions of {found.dtype}")
    largest = _MOST_EXPANSION * group.file.id.get_filesize()
    _require(found.size * found.dtype.itemsize <= largest, f"/{name} claims the shape {found.shape}")
    return found


def vector(group: h5py.Group, name: str) -> np.ndarray:
    """Finite numbers of a file, shape (K,); errors as of `dataset`."""
    values = dataset(group, name, 1, "f")[:]
    _require(np.all(np.isfinite(values)), f"/{name} has numbers that are not finite")
    return values
