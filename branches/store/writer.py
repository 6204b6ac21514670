"""Branches in HDF5: a run appends rows; the file on disk is replaced as a whole, so that it is valid at any time.

The layout is described in docs/file-format.md. The file grows in memory; a checkpoint writes its image beside the final name
and renames it. After a kill, a full disk or a power cut, the last checkpoint remains.
"""

from __future__ import annotations

import contextlib
import functools
import io
import json
import platform
import re
import time
from collections.abc import Callable, Iterable
from importlib.metadata import PackageNotFoundError, distribution
from pathlib import Path

import h5py
import numpy as np

from branches.scene.columns import NUMBER, Row
from branches.scene.parse import dump
from branches.scene.stage import Stage
from branches.store.files import StoreError, no_branch, write_bytes
from branches.store.layout import FORMAT, FORMAT_VERSION, check, damage_told, vector
from contin import Point
from contin.lowlevel import Collocation, State, Stop

#: HDF5's format since version 1.10, which has checksums.
_LIBRARY = "v110"
#: A row of the index of kept solutions.
_SOLUTIONS = np.dtype([("point", "i4"), ("start", "i8"), ("count", "i4"), ("degree", "i4")])


@functools.cache
def _versions() -> str:
    """Return the versions of everything that a result depends on, as JSON."""
    result = {"python": platform.python_version()}
    for package in ("ribbon-continuation", "numpy", "scipy", "numba", "llvmlite", "h5py"):
        with contextlib.suppress(PackageNotFoundError):
            found = distribution(package)  # its `version` reads all its text, which takes ten times as long
            stated = re.search(r"^Version: (.*)$", found.read_text("METADATA") or "", re.MULTILINE)
            result[package] = stated[1] if stated else found.version
    return json.dumps(result)


@functools.lru_cache(maxsize=32)  # making it takes 8 ms; the branches of a sweep differ in their text only
def _empty_file(kind: str, units: str, states: tuple[str, ...], free: tuple[str, ...], tables: tuple) -> bytes:
    """Return the image of a file without points, and without its scene; ``tables`` hold name, type and words of columns."""
    memory = io.BytesIO()
    with h5py.File(memory, "w", libver=_LIBRARY) as file:
        file.attrs.update({
            "format": FORMAT, "format_version": FORMAT_VERSION, "status": "running", "stop": "", "stop_reason": "",
            "kind": kind, "units": units, "platform": platform.platform(),
            "versions": _versions(), "states": list(states), "free_parameters": list(free),
        })  # fmt: skip
        for table, columns in tables:
            types = np.dtype([(name, of) for name, of, _ in columns])
            data = file.create_dataset(table, (0,), types, maxshape=(None,), chunks=(256,), fletcher32=True)
            data.attrs.update({name: words for name, _, words in columns})
        group = file.create_group("solutions")
        index = group.create_dataset("index", (0,), _SOLUTIONS, maxshape=(None,), chunks=(256,), fletcher32=True)
        index.attrs["meaning"] = "rows start:start+count of t and states are the nodes of this point's solution"
        t = group.create_dataset("t", (0,), "f8", maxshape=(None,), chunks=(1024,), fletcher32=True)
        t.attrs["meaning"] = "nodes on the unit interval, arc length S = length * t; every degree-th is a mesh point"
        n = len(states)
        table = group.create_dataset("states", (0, n), "f8", maxshape=(None, n), chunks=(1024, n), fletcher32=True)
        table.attrs["meaning"] = "unit quaternion of the directors (q0 scalar), then the centreline where it is a state"
        table.attrs["columns"] = list(states)
    return memory.getvalue()


def _image_of(first: Stage, tables: dict) -> bytes:
    """Return the image of the empty file of a scene."""
    free = tuple(column.name for column in first.columns().values if column.error and column.role == NUMBER)
    named = tuple((table, tuple((name, *told[:2]) for name, told in one.items())) for table, one in tables.items())
    return _empty_file(first.scene.KIND, first.units, tuple(first.problem.states), free, named)


class BranchWriter:
    """Write one branch to disk while it is computed.

    Parameters
    ----------
    path : Path or None
        The final name. It is replaced at every checkpoint. None keeps the file in memory, for `image`.
    first : Stage
        The first stage of the scene; it states the columns of all.
    image : bytes, optional
        An unfinished file to continue: it keeps the columns that it has.
    """

    #: Seconds between checkpoints of a run. A kill loses the points of this time; ten times less would slow short steps.
    INTERVAL = 0.5

    def __init__(self, path: Path | None, first: Stage, image: bytes | None = None):
        self.path = path and Path(path)
        columns, self._stride = first.columns(), first.scene.stride
        self._tables = {table: columns.table(table) for table in ("points", "events")}
        self._names = [column.name for column in columns.values]
        self._buffer: list[Row] = []
        self._mark: tuple[State, int] | None = None
        #: What the run saw and did not understand, in order; a resumed run adds to it.
        self.notes: list[str] = []
        #: Further data for a resumed run, by name: called at every checkpoint that writes the state.
        self.kept: Callable[[], dict[str, bytes]] = dict
        with damage_told(path):
            self._memory = io.BytesIO(image or _image_of(first, self._tables))
            self._file = h5py.File(self._memory, "r+", libver=_LIBRARY)
            self.count = 0 if image is None else self._rewind()
        self._file.attrs["config"] = dump(first.scene)
        self.note(str(self._file.attrs.get("notes", "")).splitlines())
        empty = {table: np.empty(0, [(name, told[0]) for name, told in one.items()]) for table, one in self._tables.items()}
        #: What is written so far of "points" and "events", the labelled ones.
        self.rows = empty if image is None else {table: self._file[table][:] for table in empty}
        self._saved = time.monotonic()
        self._spent = 0.0

    # --- during the run ------------------------------------------------------------------------------------------

    def append(self, point: Point, stage: Stage) -> None:
        """Append a point of a stage; it reaches the disk with the next checkpoint."""
        self._buffer.append(Row(point, self.count, stage, self._names))
        self.count += 1

    def mark(self, state: State) -> None:
        """Record that the run can be resumed from ``state``, which follows the last point."""
        self._mark = (state, self.count)

    def note(self, texts: Iterable[str]) -> None:
        """Add the notes that are not there yet; they reach the disk with the next checkpoint."""
        self.notes = list(dict.fromkeys([*self.notes, *texts]))

    def due(self) -> bool:
        """Return whether a checkpoint is due: on a disk, and they take at most a tenth of the run's time."""
        return self.path is not None and time.monotonic() - self._saved > max(self.INTERVAL, 10 * self._spent)

    def checkpoint(self, start, status: str, stop: Stop | None = None) -> None:
        """Write all points so far, and the state for a resumed run, whose first point ``start`` is (system, x, tangent).

        ``status`` is "running", "complete", "interrupted" or "lost", ``stop`` the reason why it ended. Raises StoreError where
        the file cannot be written; the file on disk is unchanged.
        """
        began = time.monotonic()
        self.flush()
        self._file.attrs["status"] = status
        self._file.attrs["stop"] = str(stop or "")
        self._file.attrs["stop_reason"] = str(stop.reason) if stop else ""
        self._file.attrs["notes"] = "\n".join(self.notes)
        if self._mark is not None:
            self._write_state(*self._mark, start)
        self._file.flush()
        if self.path is not None:
            write_bytes(self.path, self.image())
        self._saved = time.monotonic()
        self._spent = self._saved - began

    def image(self) -> bytes:
        """Return the content of the file at the last checkpoint."""
        return self._memory.getvalue()

    def flush(self) -> None:
        """Move all points so far into the tables, in memory."""
        labelled = [row for row in self._buffer if row.point.label]
        for table, rows in (("points", self._buffer), ("events", labelled)):
            made = np.empty(len(rows), self.rows[table].dtype)
            for name in made.dtype.names:
                value = self._tables[table][name][2]
                made[name] = [value(row) for row in rows]
            _extend(self._file, table, made)
            self.rows[table] = np.concatenate([self.rows[table], made])
        kept = [(row.point, row.number) for row in self._buffer if row.point.label or row.number % self._stride == 0]
        if kept:
            group, counts = self._file["solutions"], [len(point.system.nodes) for point, _ in kept]
            starts = len(group["t"]) + np.cumsum([0, *counts[:-1]])
            rows = [(number, *place, point.system.degree) for (point, number), *place in zip(kept, starts, counts)]
            _extend(group, "index", np.array(rows, _SOLUTIONS))
            _extend(group, "t", np.concatenate([point.system.nodes for point, _ in kept]))
            _extend(group, "states", np.concatenate([point.system.states(point.x) for point, _ in kept]))
        self._buffer.clear()

    # --- the state of a resumed run ------------------------------------------------------------------------------

    def _write_state(self, state: State, points: int, start):
        if "resume" in self._file:
            del self._file["resume"]
        group = self._file.create_group("resume")
        group.attrs["meaning"] = "the state of the run after its first `points` points, for --resume"
        group.attrs["points"] = points
        for name in ("previous_step", "step", "sign", "arclength", "accepted", "singular", "sense", "discretization_error"):
            group.attrs[name] = getattr(state, name)
        if state.sensed is not None:
            group.attrs["sensed"] = state.sensed
        here = {"x": state.x, "tangent": state.tangent, "previous": state.previous_tangent}
        _write_vectors(group.create_group("here"), state.system, **here)
        _write_vectors(group.create_group("start"), start[0], x=start[1], tangent=start[2])
        for name, data in self.kept().items():
            values = np.frombuffer(data, "u1")
            group.create_dataset(f"kept/{name}", data=values, chunks=values.shape, fletcher32=True)

    def _rewind(self) -> int:
        """Truncate the tables to the points before the saved state; return their number.

        Later points are computed again: a limit that ended the run need not end the resumed run.
        """
        for table, columns in self._tables.items():
            if not set(self._file[table].dtype.names) <= set(columns):
                raise StoreError(
                    f"cannot resume {str(self.path)!r}: this version or scene has other columns; run it again without --resume"
                )
        points, solutions = int(self._file["resume"].attrs["points"]), self._file["solutions"]
        index = solutions["index"][:]
        index = index[index["point"] < points]
        nodes = int(index["start"][-1] + index["count"][-1])
        events = int(np.count_nonzero(self._file["events"]["point"] < points))
        self._file["points"].resize(points, axis=0)
        self._file["events"].resize(events, axis=0)
        for name, rows in (("index", len(index)), ("t", nodes), ("states", nodes)):
            solutions[name].resize(rows, axis=0)
        return points

    def close(self) -> None:
        """Close the file in memory."""
        self._file.close()


def _write_vectors(group, system, **vectors):
    group.attrs["degree"] = system.degree
    for name, values in {"mesh": system.mesh, "parameters": system.parameters, **vectors}.items():
        if values is not None:
            group.create_dataset(name, data=values, chunks=values.shape, fletcher32=True)


def _read_vectors(group, problem, free):
    parameters = dict(zip(problem.parameters, vector(group, "parameters"), strict=True))
    system = Collocation(problem, vector(group, "mesh"), int(group.attrs["degree"]), free, parameters)
    vectors = {name: vector(group, name) for name in ("x", "tangent", "previous") if name in group or name != "previous"}
    if any(values.size != system.size for values in vectors.values()):
        raise ValueError("vectors that do not fit their mesh")
    return system, vectors


def _extend(group, name: str, rows):
    if len(rows):  # by HDF5's own functions: h5py's take four times as long, which is a fifteenth of a short branch
        data = h5py.h5d.open(group.id, name.encode())
        start, *width = data.shape
        data.set_extent((start + len(rows), *width))
        place = data.get_space()
        place.select_hyperslab((start, *(0 for _ in width)), rows.shape)
        data.write(h5py.h5s.create_simple(rows.shape), place, np.ascontiguousarray(rows))


@contextlib.contextmanager
def open_branch(path: Path):
    """Open the file of a branch; raise StoreError where it does not exist, is not HDF5, or no branch this version reads."""
    try:
        file = h5py.File(path, "r")
    except OSError as error:
        raise StoreError(f"cannot read {str(path)!r}: {no_branch(Path(path))}") from error
    with file, damage_told(path):
        check(file, path)
        yield file


def read_state(path: Path, problem, free):
    """Return the saved state of a run, its first point (system, x, tangent), the row before the state, and the file's image.

    Raises StoreError where the file holds no saved state.
    """
    with open_branch(path) as file:
        if "resume" not in file:
            raise StoreError(f"{str(path)!r} holds nothing to resume; run it again without --resume")
        try:
            return *_read_state(file, problem, free), Path(path).read_bytes()
        except (KeyError, TypeError, ValueError, IndexError, OverflowError) as error:
            raise StoreError(f"cannot resume {str(path)!r}: the file is damaged") from error


def read_kept(path: Path) -> tuple[np.ndarray, dict[str, bytes]]:
    """Return the rows before the saved state of a run, none without a state, and its further data (`BranchWriter.kept`)."""
    with open_branch(path) as file:
        if "resume" not in file:
            return file["points"][:0], {}
        kept = file["resume"].get("kept", {})
        return file["points"][: int(file["resume"].attrs["points"])], {name: kept[name][:].tobytes() for name in kept}


def _read_state(file, problem, free):
    """Return state, first point and last row."""
    group = file["resume"]
    system, here = _read_vectors(group["here"], problem, free)
    first, start = _read_vectors(group["start"], problem, free)
    a, last = group.attrs, file["points"][int(group.attrs["points"]) - 1]
    numbers = {name: float(a[name]) for name in ("previous_step", "step", "arclength")}
    if not all(map(np.isfinite, numbers.values())) or not 0 <= int(a["accepted"]) < int(a["points"]) <= len(file["points"]):
        raise ValueError("an impossible state of a run")
    state = State(
        system, here["x"], here["tangent"], here.get("previous"), numbers["previous_step"], numbers["step"], float(a["sign"]),
        numbers["arclength"], int(a["accepted"]), bool(a["singular"]),
        float(a["sense"]), None if "sensed" not in a else np.array(a["sensed"]), float(a["discretization_error"]),
    )  # fmt: skip
    return state, (first, start["x"], start["tangent"]), last
