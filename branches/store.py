"""Branches in HDF5: a run appends rows; the file on disk is replaced as a whole, so that it is valid at any time.

The layout is described in docs/file-format.md. The file grows in memory; a checkpoint writes its image beside the final name
and renames it. After a kill, a full disk or a power cut, the last checkpoint remains.
"""

from __future__ import annotations

import contextlib
import functools
import json
import platform
import time
from collections.abc import Callable, Iterable
from dataclasses import dataclass
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path

import h5py
import numpy as np

from branches.files import StoreError, write_bytes
from branches.layout import CLOSED, FORMAT, FORMAT_VERSION, check, damage_told, vector
from contin import Point
from contin.lowlevel import Collocation, State, Stop

#: HDF5's format since version 1.10, which has checksums.
_LIBRARY = "v110"

#: Columns of /points and /events that are not parameters or functionals: name, type, meaning.
_BOOKKEEPING = (
    ("point", "i4", "running number of the point along the branch, labelled points included"),
    (
        "label",
        "S2",
        "AUTO's label: BP branch point, LP fold, SB secondary bifurcation, UZ user value, EP end, MX failed; empty for others",
    ),
    ("arclength", "f8", "distance from the first point in the continuation norm"),
    ("intervals", "i4", "mesh intervals N of this point's solution"),
    ("iterations", "i4", "Newton iterations"),
    ("newton_error", "f8", "estimated relative error left by Newton's method"),
    ("discretization_error", "f8", "estimated error due to the mesh, relative to 1 + size"),
)
MEANINGS = {
    "kappa_n": "natural curvature kappa_n L / 2 pi (dimensionless)",
    "kappa_star": "conjugate curvature of equation (28), mean of dH/dkappa_n (dimensionless)",
    "energy": "strain energy / (2 pi B / L), without the constant kappa_n^2 / 2",
    "nu": "Poisson's ratio",
    "Gamma": "w^2 / (h L / 2 pi) of the law finite width, w the width and h the thickness",
    "M1": "moment about d1 at S = 0, in units of B 2 pi / L",
    "M2": "moment about d2 at S = 0; zero on a planar circle",
    "M3": "moment about d3 at S = 0",
    "R1": "force along d1 at S = 0, in units of B (2 pi / L)^2",
    "R2": "force along d2 at S = 0",
    "R3": "force along d3 at S = 0",
    "length": "length of the domain, in units of L / 2 pi",
    "axes": "1: the ends of the half loop are two-fold axes along d2, not mirrors",
    "turn": "angle by which d2 turns about the moment over the cell",
    "sense": "sign of the moment on the circle",
    "unfold": "unfolding parameter of closure, zero",
}  # fmt: skip


def meaning_of(column: str) -> str:
    """Return the meaning of a column of the table of points; its name if the meaning is not known."""
    told = {name: meaning for name, _, meaning in _BOOKKEEPING} | MEANINGS
    return told.get(column, column)


@functools.cache  # reading them takes 10 ms, a sixth of the time of a branch
def _versions() -> str:
    """Return the versions of everything that a result depends on, as JSON."""
    result = {"python": platform.python_version()}
    for package in ("ribbon-continuation", "numpy", "scipy", "numba", "llvmlite", "h5py"):
        with contextlib.suppress(PackageNotFoundError):
            result[package] = version(package)
    return json.dumps(result)


def _columns(problem, free, watched: bool, more: tuple = (), uncertain: tuple = ()) -> dict[str, tuple]:
    """Return name, type and meaning of the columns of both tables; ``more`` are further ones, ``uncertain`` have errors."""
    watch = [("index", "i4", "number of negative directions of the energy; -1 where one is neutral (undecided)")] * watched
    hidden = getattr(problem, "multipliers", ())
    shown = [name for name in (*problem.parameters, *problem.functionals) if name not in hidden]
    values = [*((name, "f8", MEANINGS.get(name, name)) for name in shown), *more]
    errors = [(f"error_{name}", "f8", f"estimated discretization error of {name}") for name in free]
    errors += [(f"error_{name}", "f8", f"estimated error of {name}") for name in uncertain if name not in free]
    named = [("name", "S64", "the subject of the label")]
    changes = [
        ("index_before", "i4", "the index just before this point, at LP and SB; otherwise -1"),
        ("index_after", "i4", "the index just after it"),
        ("kernel", "i4", "number of neutral modes: 1 at LP, 1 or 2 at SB"),
        ("breaks", "S128", "symmetries that the modes break, and that a branch which leaves here does not have; empty at LP"),
    ] * watched
    events = (*_BOOKKEEPING, *named, *values, *errors, *watch, *changes)
    return {"points": (*_BOOKKEEPING, *values, *watch), "events": events}


def _kind(columns) -> np.dtype:
    return np.dtype([(name, kind) for name, kind, _ in columns])


@dataclass(frozen=True)
class Kind:
    """A kind of strip: its name and units in the file, its own columns (name, type, meaning), and their values at a point.

    ``uncertain`` are the columns whose errors ``errors`` returns for a labelled point, by name.
    """

    name: str
    units: str
    columns: tuple[tuple[str, str, str], ...] = ()
    values: Callable[[Point], dict] = lambda point: {}
    uncertain: tuple[str, ...] = ()
    errors: Callable[[Point], dict] = lambda point: {}


@functools.lru_cache(maxsize=32)  # making it takes 8 ms; the branches of a diagram differ in their text only
def _empty_file(problem, free: tuple[str, ...], watched: bool, kind: Kind) -> bytes:
    """Return the image of a file without points, and without its scene."""
    with h5py.File.in_memory(libver=_LIBRARY) as file:
        file.attrs.update({
            "format": FORMAT, "format_version": FORMAT_VERSION, "status": "running", "stop": "", "stop_reason": "",
            "kind": kind.name, "units": kind.units, "platform": platform.platform(),
            "versions": _versions(), "states": list(problem.states), "free_parameters": list(free),
        })  # fmt: skip
        for table, columns in _columns(problem, free, watched, kind.columns, kind.uncertain).items():
            data = file.create_dataset(table, (0,), _kind(columns), maxshape=(None,), chunks=(256,), fletcher32=True)
            for name, _, meaning in columns:
                data.attrs[name] = meaning
        _create_solutions(file.create_group("solutions"), problem)
        file.flush()
        return file.id.get_file_image()


def _create_solutions(group, problem) -> None:
    """Make the empty tables of the kept solutions."""
    kind = np.dtype([("point", "i4"), ("start", "i8"), ("count", "i4"), ("degree", "i4")])
    index = group.create_dataset("index", (0,), kind, maxshape=(None,), chunks=(256,), fletcher32=True)
    index.attrs["meaning"] = "rows start:start+count of t and states are the nodes of this point's solution"
    t = group.create_dataset("t", (0,), "f8", maxshape=(None,), chunks=(1024,), fletcher32=True)
    t.attrs["meaning"] = "nodes on the unit interval, arc length S = length * t; every degree-th is a mesh point"
    n = len(problem.states)
    states = group.create_dataset("states", (0, n), "f8", maxshape=(None, n), chunks=(1024, n), fletcher32=True)
    states.attrs["meaning"] = "unit quaternion of the directors (q0 scalar), then the centreline where it is a state"
    states.attrs["columns"] = list(problem.states)


class BranchWriter:
    """Write one branch to disk while it is computed.

    Parameters
    ----------
    path : Path or None
        The final name. It is replaced at every checkpoint. None keeps the file in memory, for `image`.
    config_text : str
        The scene, as text. A resumed run may have other limits.
    problem : BoundaryValueProblem
        The problem, for the names of columns.
    free : sequence of str
        Free parameters.
    stride : int
        Full solutions are kept of every stride-th point and of labelled points.
    image : bytes, optional
        An unfinished file to continue.
    watch : optional
        ``watch.index(point)`` is the value of the column of that name, ``watch.change(point)`` holds the further columns of
        labelled points (`branches.stability.Watch`). Without it there are no such columns.
    kind : Kind
        What kind of strip it is, with further columns.
    """

    #: Seconds between checkpoints of a run. A kill loses the points of this time; ten times less would slow short steps.
    INTERVAL = 0.5

    def __init__(
        self, path: Path | None, config_text: str, problem, free, stride: int, image: bytes | None = None, watch=None,
        kind: Kind | None = None,
    ):  # fmt: skip
        self.path, self._stride, self._free, self._watch = path and Path(path), stride, tuple(free), watch
        self.kind = kind or Kind(CLOSED, "bending modulus B = 1, length L = 2 pi")
        self._buffer: list[tuple[Point, int]] = []
        self._mark: tuple[State, int] | None = None
        #: What the run saw and did not understand, in order; a resumed run adds to it.
        self.notes: list[str] = []
        #: Further data for a resumed run, by name: called at every checkpoint that writes the state.
        self.kept: Callable[[], dict[str, bytes]] = dict
        with damage_told(path):
            empty = _empty_file(problem, self._free, watch is not None, self.kind) if image is None else None
            self._file = h5py.File.in_memory(image or empty, libver=_LIBRARY)
            self.count = 0 if empty else self._rewind(problem)
        self._file.attrs["config"] = config_text
        self.note(str(self._file.attrs.get("notes", "")).splitlines())
        # reading the columns from HDF5 for each row would take longer than computing the row
        self._types = {table: self._file[table].dtype for table in ("points", "events")}
        self._saved = time.monotonic()
        self._spent = 0.0

    # --- during the run ------------------------------------------------------------------------------------------

    def append(self, point: Point) -> None:
        """Append a point; it reaches the disk with the next checkpoint."""
        self._buffer.append((point, self.count))
        self.count += 1

    def mark(self, state: State) -> None:
        """Record that the run can be resumed from ``state``, which follows the last point."""
        self._mark = (state, self.count)

    def note(self, texts: Iterable[str]) -> None:
        """Add the notes that are not there yet; they reach the disk with the next checkpoint."""
        self.notes = list(dict.fromkeys([*self.notes, *texts]))

    def due(self) -> bool:
        """Return whether a checkpoint is due: checkpoints take at most a tenth of the run's time."""
        return time.monotonic() - self._saved > max(self.INTERVAL, 10 * self._spent)

    def checkpoint(self, start, status: str, stop: Stop | None = None) -> None:
        """Write all points so far, and the state for a resumed run.

        Parameters
        ----------
        start : tuple (system, x, tangent)
            The first point of the run.
        status : str
            "running", "complete", "interrupted" or "lost".
        stop : Stop, optional
            The reason why it ended.

        Raises
        ------
        StoreError
            The file cannot be written; the file on disk is unchanged.
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
        return self._file.id.get_file_image()

    def points(self) -> np.ndarray:
        """Return the rows of points written so far."""
        return self._file["points"][:]

    def events(self) -> np.ndarray:
        """Return the rows of labelled points written so far."""
        return self._file["events"][:]

    def flush(self) -> None:
        """Move all points so far into the tables, in memory."""
        points = [self._row("points", point, number) for point, number in self._buffer]
        events = [self._row("events", point, number) for point, number in self._buffer if point.label]
        _extend(self._file["points"], np.array(points, self._types["points"]))
        _extend(self._file["events"], np.array(events, self._types["events"]))
        kept = [(p, i) for p, i in self._buffer if p.label or i % self._stride == 0]
        if kept:
            group, rows = self._file["solutions"], []
            start = len(group["t"])
            for point, number in kept:
                count = len(point.system.nodes)
                rows.append((number, start, count, point.system.degree))
                start += count
            _extend(group["index"], np.array(rows, group["index"].dtype))
            _extend(group["t"], np.concatenate([point.system.nodes for point, _ in kept]))
            _extend(group["states"], np.concatenate([point.system.states(point.x) for point, _ in kept]))
        self._buffer.clear()

    def _row(self, table: str, point: Point, number: int) -> tuple:
        values = {
            **point.parameters, **point.functionals, "point": number, "label": point.label.encode(),
            "name": point.name.encode(), "arclength": point.arclength, "intervals": point.system.intervals,
            "iterations": point.iterations, "newton_error": point.newton_error,
            "discretization_error": point.discretization_error,
            **{f"error_{name}": point.errors.get(name, np.nan) for name in self._free}, **self.kind.values(point),
        }  # fmt: skip
        if table == "events" and self.kind.uncertain:
            values = (
                dict.fromkeys((f"error_{name}" for name in self.kind.uncertain), np.nan)
                | {f"error_{name}": error for name, error in self.kind.errors(point).items()}
                | values
            )
        if self._watch is not None:
            values["index"] = self._watch.index(point)
            if table == "events":
                change = self._watch.change(point)
                values |= {"index_before": change.before, "index_after": change.after, "kernel": change.kernel}
                values["breaks"] = change.breaks.encode()
        return tuple(values[name] for name in self._types[table].names)

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

    def _rewind(self, problem) -> int:
        """Truncate the tables to the points before the saved state; return their number.

        Later points are computed again: a limit that ended the run need not end the resumed run.
        """
        kind, watched = self.kind, self._watch is not None
        for table, columns in _columns(problem, self._free, watched, kind.columns, kind.uncertain).items():
            if self._file[table].dtype != _kind(columns):
                raise StoreError(
                    f"cannot resume {str(self.path)!r}: this version or scene has other columns; run it again without --resume"
                )
        points, solutions = int(self._file["resume"].attrs["points"]), self._file["solutions"]
        index = solutions["index"][:]
        index = index[index["point"] < points]
        nodes = int(index["start"][-1] + index["count"][-1])
        events = int(np.count_nonzero(self.events()["point"] < points))
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


def _extend(dataset, rows):
    if len(rows):
        start = len(dataset)
        dataset.resize(start + len(rows), axis=0)
        dataset[start:] = rows


@contextlib.contextmanager
def open_branch(path: Path):
    """Open the HDF5 file of a branch for reading.

    Raises
    ------
    StoreError
        The file does not exist, is not HDF5, or is not a branch that this version reads.
    """
    try:
        file = h5py.File(path, "r")
    except OSError as error:
        reason = "there is no such file" if not Path(path).exists() else "it is not a readable HDF5 file"
        raise StoreError(f"cannot read {str(path)!r}: {reason}") from error
    with file, damage_told(path):
        check(file, path)
        yield file


def read_state(path: Path, problem, free):
    """Return the saved state of a run, its first point (system, x, tangent), the row before the state, and the file's image.

    Raises
    ------
    StoreError
        The file holds no saved state.
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
