"""A result file in memory: the scene, the tables, the kept solutions; pieces, places and axes of all kinds of strips."""

from __future__ import annotations

import functools
import html
import io
from abc import ABC, abstractmethod
from collections.abc import Iterator
from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path
from typing import TYPE_CHECKING, Any, ClassVar

import numpy as np

from branches.draw.strip import OBLIQUE, View
from branches.draw.style import smooth
from branches.scene.columns import Columns
from branches.scene.fields import Scene
from branches.scene.labels import SPECIAL, Label, begins, label_of
from branches.scene.parse import dump
from branches.scene.stages import stages_of
from branches.store.files import StoreError
from contin.lowlevel import meant

if TYPE_CHECKING:
    from branches.scene.stage import Stage
    from contin.lowlevel import Collocation
    from ribbon_model.shape import Shape

#: Labelled points that the table in a notebook lists: about a screen. The others are counted.
MOST_ROWS = 20


@dataclass(frozen=True)
class Piece:
    """A part of a stage between special points: rows of the table of points, and whether it is stable (None: not known)."""

    stage: int
    rows: np.ndarray
    stable: bool | None


@dataclass(frozen=True)
class Snap:
    """A fold at which a stable piece ends: its row, the place (column, value) where it snaps to, and the energy released."""

    row: int
    column: str
    value: float
    to: dict[str, float]
    released: float


@dataclass(frozen=True)
class Mark:
    """A labelled point in a picture: its row, its label, whether the branch goes on there, its word in the legend."""

    row: int
    label: Label
    open: bool
    word: str | None


@dataclass(frozen=True, repr=False)
class StoredBranch(ABC):
    """A branch file in memory: the scene, the tables of points and of labelled points (structured arrays), the kept solutions.

    ``stop`` is a sentence with the reason why the run ended, ``reason`` a key word ("trivial branch", "limit", ...). ``notes``
    are those of `contin.Branch`.
    """

    scene: Scene
    status: str
    stop: str
    reason: str
    points: np.ndarray
    events: np.ndarray
    index: np.ndarray
    t: np.ndarray
    states: np.ndarray
    notes: tuple[str, ...] = ()

    def __repr__(self) -> str:
        lines = [f"{type(self).__name__}({self.about}: {len(self.points)} points, {self.status}; {self.stop or 'not ended'})"]
        for row, event in enumerate(self.events[:MOST_ROWS]):
            label, name = event["label"].decode(), event["name"].decode()
            lines.append(f"  point {event['point']:5d}  {label}  {self.place(row)}{f': {name}' if name else ''}")
        more = len(self.events) - MOST_ROWS
        return "\n".join([*lines, *([f"  ... {more} more in events"] if more > 0 else [])])

    # --- the scene ------------------------------------------------------------------------------------------------------

    @functools.cached_property
    def config(self) -> dict:
        """The fields of the scene."""
        return self.scene.model_dump()

    def scene_text(self) -> str:
        """Return the scene as YAML."""
        return dump(self.scene)

    @functools.cached_property
    def stages(self) -> list[Stage]:
        """The stages of the scene."""
        return stages_of(self.scene)

    @functools.cached_property
    def columns(self) -> Columns:
        """The columns of the scene that the file has: one of another version may lack some."""
        return self.stages[0].columns().among(self.points.dtype.names)

    @property
    def about(self) -> str:
        """The branch in words."""
        return self.scene.title_or_name

    @property
    @abstractmethod
    def shown(self) -> tuple[str, ...]:
        """Columns of labelled points that a notebook shows."""

    # --- points ---------------------------------------------------------------------------------------------------------

    @functools.cached_property
    def stage_of(self) -> np.ndarray:
        """The stage of each point, from 1."""
        return self.points["stage"] if "stage" in self.points.dtype.names else np.ones(len(self.points), int)

    @functools.cached_property
    def way(self) -> np.ndarray:
        """The arclength of each point, that of all stages in a row."""
        s, offset = self.points["arclength"].copy(), 0.0
        for stage in np.unique(self.stage_of):
            s[self.stage_of == stage] += offset
            offset = s[self.stage_of == stage][-1]
        return s

    def column(self, name: str) -> np.ndarray:
        """Return a column of the table of points, or one that follows from others.

        Raises
        ------
        StoreError
            There is none.
        """
        if name in self.points.dtype.names and self.points.dtype[name].kind in "if":
            return self.points[name]
        known = self.columns.all.get(name)
        if known is None or known.derived is None:
            near, there = meant(name, self._named), ", ".join(self._named)
            raise StoreError(f"there is no column {name!r} of numbers{near}; there are {there}")
        return known.derived(self.points)

    @property
    def _named(self) -> list[str]:
        """The columns that people name."""
        return [*self.columns.shown(), *(one.name for one in self.columns.all.values() if one.derived)]

    @abstractmethod
    def place(self, row: int) -> str:
        """Return where a labelled point is, in words; ``row`` counts labelled points from 0."""

    def followed(self, stage: int) -> str:
        """Return the number that a stage follows."""
        return self.stages[stage - 1].follow

    def stage_at(self, row: int) -> Any:
        """Return the stage of a point."""
        return self.stages[int(self.stage_of[row]) - 1]

    def conjugate(self, name: str) -> str:
        """Return the column that is shown where a number is followed."""
        return next((stage.conjugate for stage in self.stages if stage.follow == name), "energy")

    def pieces(self) -> list[Piece]:
        """Return the parts of all stages between special points."""
        found = []
        special = {int(event["point"]) for event in self.events if event["label"].decode() in SPECIAL}
        for stage in np.unique(self.stage_of):
            rows = np.flatnonzero(self.stage_of == stage)
            for first, last in pairwise(sorted({rows[0], rows[-1], *(row for row in rows if row in special)})):
                index = self.index_on(np.arange(first, last + 1))
                found.append(Piece(int(stage), np.arange(first, last + 1), None if index < 0 else index == 0))
        return found

    def curves(self, *names: str) -> list[tuple[Piece, np.ndarray]]:
        """Return all pieces with columns, in their units, on smooth curves through the points, shape (names, many).

        See `branches.draw.style.smooth`. Raises StoreError for a column that there is not.
        """
        columns, found = [self.measured(name)[0] for name in names], []
        corners = self.events["point"][self.events["label"] == b"BC"]
        for piece in self.pieces():
            own = np.flatnonzero(self.stage_of == piece.stage)
            before, behind = corners[corners <= piece.rows[0]], corners[corners >= piece.rows[-1]]
            between = (own >= before.max(initial=0)) & (own <= behind.min(initial=len(self.points)))
            own = own[between]  # a curve bends at a corner
            s = self.points["arclength"][own]
            fine, *curve = smooth(s, s, *(column[own] for column in columns))
            first, last = s[piece.rows[[0, -1]] - own[0]]
            found.append((piece, np.array(curve)[:, (fine >= first) & (fine <= last)]))
        return found

    def index_on(self, rows: np.ndarray) -> int:
        """Return the index on a piece; -1 if it is not the same everywhere, or not known.

        It is that of the points which are not special, or, without any, what was computed just after and before the ends.
        """
        if "index" not in self.points.dtype.names:
            return -1
        inside = rows[1:-1] if len(rows) > 2 else rows
        regular = [row for row in inside if not label_of(self.points["label"][row].decode()).singular]
        values = {value for value in self.points["index"][regular].tolist() if value >= 0}
        if not regular and "index_before" in self.events.dtype.names:
            sides = ((rows[0], "index_after"), (rows[-1], "index_before"))
            values = {int(event[side]) for row, side in sides for event in self.events if event["point"] == row} - {-1}
        return int(values.pop()) if len(values) == 1 else -1

    def snaps(self) -> list[Snap]:
        """Return the folds at which a stable piece ends, with the stable state below that the file has, if any."""
        return []

    # --- solutions ------------------------------------------------------------------------------------------------------

    def kept(self) -> np.ndarray:
        """Return the numbers of the points whose full solution is kept."""
        return self.index["point"]

    def states_at(self, point: int) -> tuple[np.ndarray, np.ndarray]:
        """Return places t (K,) and states (K, n) of a kept point.

        Raises
        ------
        StoreError
            The solution of this point is not kept.
        """
        row = self._kept(point)
        here = slice(row["start"], row["start"] + row["count"])
        return self.t[here], self.states[here]

    def degree(self, point: int) -> int:
        """Return the polynomial degree of the solution of a kept point."""
        return int(self._kept(point)["degree"])

    def _kept(self, point: int) -> np.void:
        found = np.flatnonzero(self.index["point"] == point)
        if not found.size:
            raise StoreError(f"the solution of point {point} is not kept; a smaller stride keeps more")
        return self.index[found[0]]

    @abstractmethod
    def solution(self, point: int) -> Any:
        """Return the solution of a kept point of a closed strip; see `states_at` for its errors."""

    @abstractmethod
    def discretized(self, point: int) -> tuple[Collocation, np.ndarray]:
        """Return the system on the mesh of a kept solution, and its unknowns (system.size,)."""

    @abstractmethod
    def shape(self, point: int) -> Shape:
        """Return the strip at a kept point."""

    @abstractmethod
    def placed(self, point: int, length: float, cells: int = 0) -> tuple[Shape, np.ndarray]:
        """Return the strip of a point at a length, upright, and its strains (K, 3) in radians per unit of that length.

        It has at least so many ``cells`` between nodes.
        """

    #: The length of `shape`.
    shape_length: ClassVar[float] = 1.0

    @property
    @abstractmethod
    def length(self) -> float:
        """The length of the scene's strip; 1 without dimensions."""

    @property
    def length_unit(self) -> str:
        """What lengths of pictures are given in: m where the scene has dimensions, otherwise the length of the strip."""
        return "L" if self.length == 1.0 else "m"

    @abstractmethod
    def width_at(self, length: float, thickness: float | None) -> float | None:
        """Return the width of the scene's strip at a length, or that from a thickness and the law's Gamma, or None."""

    # --- pictures -------------------------------------------------------------------------------------------------------

    @property
    def caption(self) -> str:
        """What a picture shows, in words."""
        return self.about

    @functools.cached_property
    def panels(self) -> list[tuple[str, str]]:
        """The columns that pictures show against each other: each number that is followed, and what is conjugate to it."""
        names = dict.fromkeys(self.followed(int(stage)) for stage in np.unique(self.stage_of))
        return [(name, self.conjugate(name)) for name in names]

    def axis(self, name: str) -> tuple[np.ndarray, str]:
        """Return a column in its unit, and the words of its axis."""
        values, unit = self.measured(name)
        words = self.axis_words(name)
        return values, f"{words} in {unit}" if unit else words

    def axis_words(self, name: str) -> str:
        """Return the words of an axis, without a unit."""
        column = self.columns.all.get(name)
        return name if column is None else column.axis or name

    def measured(self, name: str) -> tuple[np.ndarray, str]:
        """Return a column in its unit, and the unit: that of the scene or, without dimensions, what it is divided by."""
        return self.column(name) * self.scene.factor(name), self._unit(name)

    def _unit(self, name: str) -> str:
        """Return the unit of a column: that of the scene or, without dimensions, what it is divided by."""
        return self.scene.unit(name) or self.scene.natural_unit(name)

    def words_of(self, name: str, value: float) -> str:
        """Return a value of a column with three digits and its unit."""
        return f"{value * self.scene.factor(name):.3g} {self._unit(name)}".strip()

    def marks(self) -> Iterator[Mark]:
        """Yield the marks of labelled points."""
        for event in self.events:
            if not begins(event):
                label = label_of(event["label"].decode())
                yield Mark(int(event["point"]), label, event["label"] == b"EP", label.word)

    @abstractmethod
    def colour(self, stage: int) -> str:
        """Return the colour of a stage."""

    @property
    def view(self) -> View:
        """The side from which pictures show strips."""
        return OBLIQUE

    @property
    def is_heavy(self) -> bool:
        """Whether the strip has weight, which pulls downwards in pictures."""
        return False

    @abstractmethod
    def posed(self, points: list[int]) -> dict[int, Shape]:
        """Return the strips at kept points as pictures show them, all from one side."""

    @abstractmethod
    def drawn_width(self, strips: list[Shape], asked: float | None) -> float:
        """Return the width of drawn strips: the one asked for, or that of the scene; narrower where generators would cross."""

    def plot(
        self, shapes: int = 6, width: float | None = None, x: str | None = None, y: str | None = None,
        view: tuple[float, float] | None = None, size: float | None = None, points: str | Path | None = None,
    ):  # fmt: skip
        """Return the result as a matplotlib figure; see `branches.draw.picture.figure`.

        ``points`` is a file of measured points, which are drawn too (`branches.store.measured.read_points`).
        """
        from branches.draw.picture import figure
        from branches.store.measured import read_points

        measured = points and read_points(points, {name: self._unit(name) for name in self._named})
        return figure(self, shapes, width, x, y, view, size, measured)

    def _repr_html_(self) -> str:
        """Return the branch as HTML, for a notebook: name, reason of its end, picture, labelled points."""
        picture = io.StringIO()
        self.plot(shapes=0).savefig(picture, format="svg")
        svg = picture.getvalue()[picture.getvalue().index("<svg") :]
        stop = html.escape(self.stop or self.status)
        table = {key: values[self.events["point"]].tolist() for key, values in self.in_units().items()}
        titles = {key.partition(" [")[0]: key for key in table}  # with units
        columns = {}
        for name in self.shown:
            columns[titles.get(name, name)] = table[titles[name]] if name in titles else self.events[name].tolist()
        head = "".join(f"<th>{html.escape(title)}</th>" for title in columns)
        events = [*zip(*columns.values())]
        rows = "".join(f"<tr>{''.join(map(_cell, event))}</tr>" for event in events[:MOST_ROWS])
        more = f"<p>and {len(events) - MOST_ROWS} more labelled points</p>" if len(events) > MOST_ROWS else ""
        return (
            f"<div><p><b>{html.escape(self.about)}</b>: {len(self.points)} points; {stop}</p>{svg}"
            f"<table><thead><tr>{head}</tr></thead><tbody>{rows}</tbody></table>{more}</div>"
        )

    # --- tables ---------------------------------------------------------------------------------------------------------

    def in_units(self) -> dict[str, np.ndarray]:
        """Return the table of points in its units: those of the scene's dimensions, SI; names are as in ``distance [m]``."""
        found = {}
        for name in self.points.dtype.names:
            kind = self.points.dtype[name].kind
            values, title = (self.measured(name)[0], self.titled(name)) if kind == "f" else (self.points[name], name)
            found[title] = np.char.decode(values, "utf-8") if kind == "S" else values
        return found

    def titled(self, name: str) -> str:
        """Return the name of a column with its unit, as in ``distance [m]``."""
        return f"{name} [{unit}]" if (unit := self._unit(name)) else name

    def to_pandas(self, units: bool = False):
        """Return the table of points as a ``pandas.DataFrame``, as it is stored or in its units (`in_units`).

        ImportError says what to install if pandas is missing.
        """
        try:
            import pandas
        except ImportError as error:
            raise ImportError("to_pandas needs pandas, which is not installed: pip install pandas") from error
        if units:
            return pandas.DataFrame(self.in_units())
        return pandas.DataFrame(self.points).assign(label=[label.decode() for label in self.points["label"]])

    def to_xarray(self):
        """Return the table of points as an ``xarray.Dataset`` along ``point``, with the meaning of each column.

        Each variable has its meaning as ``long_name``; the attributes of the dataset are the scene as YAML, ``status`` and
        ``stop``. ImportError says what to install if xarray is missing.
        """
        try:
            import xarray
        except ImportError as error:
            raise ImportError("to_xarray needs xarray, which is not installed: pip install xarray") from error
        columns = {name: self.points[name] for name in self.points.dtype.names if name not in ("point", "label")}
        columns["label"] = np.array([label.decode() for label in self.points["label"]])
        words = self.columns.all
        variables = {
            name: ("point", values, {"long_name": words[name].words if name in words else name})
            for name, values in columns.items()
        }
        about = {"config": self.scene_text(), "status": self.status, "stop": self.stop}
        return xarray.Dataset(variables, {"point": self.points["point"]}, about)


def _cell(value) -> str:
    text = value.decode() if isinstance(value, bytes) else str(value)
    return f"<td>{value:.10g}</td>" if isinstance(value, float) else f"<td>{html.escape(text)}</td>"
