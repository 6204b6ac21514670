"""The columns of results, each stated once: files, tables, graphs, axes of pictures and the page read them here."""

from __future__ import annotations

import functools
from collections.abc import Callable, Collection, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any, Protocol

import numpy as np

from contin.lowlevel import Shown

if TYPE_CHECKING:  # columns of a stored result need no engine
    from contin import Point

#: What a column is: of the run, prescribed or free numbers, found ones, the index, text.
BOOK, NUMBER, FOUND, INDEX, TEXT = "book", "number", "found", "index", "text"


class Source(Protocol):
    """What columns ask of the stage that a point belongs to (`branches.scene.stage.Stage`)."""

    number: int
    watch: Any

    def values(self, point: Point, names: Sequence[str]) -> Mapping[str, float]: ...

    def errors(self, point: Point) -> Mapping[str, float]: ...


class Row:
    """A labelled or unlabelled point on its way into the tables; what columns read of it is computed once.

    ``number`` is the point's place in the table, ``stage`` the one that it belongs to; ``others`` are the names of all values
    of the tables, some of which this stage may lack.
    """

    def __init__(self, point: Point, number: int, stage: Source, others: Sequence[str]):
        self.point, self.number, self.stage, self._others = point, number, stage, others
        self.index = None if stage.watch is None else stage.watch.index(point)  # which the watch knows of the last points

    @functools.cached_property
    def values(self) -> Mapping[str, float]:
        """The numbers and what was found, by name."""
        return self.stage.values(self.point, self._others)

    @functools.cached_property
    def errors(self) -> Mapping[str, float]:
        """Errors of a labelled point, by name."""
        return self.stage.errors(self.point)

    @functools.cached_property
    def change(self) -> Change:
        """How the index changes at a labelled point."""
        return self.stage.watch.change(self.point)


@dataclass(frozen=True)
class Change:
    """The change of the index at a labelled point.

    Attributes
    ----------
    before, after : int
        The index before and after folds and bifurcations, along the run; -1 at other points and where it is undecided.
    kernel : int
        Number of modes that are neutral there.
    breaks : str
        The symmetries of the branch that its neutral modes break, '' at a fold. A branch that leaves there does not have them.
        A pair of modes may have two kinds of branches, separated by 'or'.
    """

    before: int = -1
    after: int = -1
    kernel: int = 0
    breaks: str = ""


@dataclass(frozen=True, repr=False)
class Column(Shown):
    """A column of results.

    Attributes
    ----------
    name, words : str
        In files, and its meaning.
    value, error : callable
        ``value(row)`` of a `Row`; by default the value of this name. ``error(row)``, for labelled points, or None.
    kind : str
        Its type in tables, as NumPy writes it.
    role : str
        What it is: `BOOK`, `NUMBER`, `FOUND`, `INDEX` or `TEXT`. Maps and graphs show numbers and what was found.
    axis, brief : str
        Its words at axes of pictures and on the page, with the unit that it is over; a short form.
    of_labelled : bool
        Whether only the table of labelled points has it.
    derived : callable, optional
        ``derived(points)`` of a table: it follows from other columns and is in no file.
    """

    name: str
    words: str
    value: Callable[[Row], Any] | None = None
    error: Callable[[Row], float] | None = None
    kind: str = "f8"
    role: str = NUMBER
    axis: str = ""
    brief: str = ""
    of_labelled: bool = False
    derived: Callable[[Any], np.ndarray] | None = None

    def of(self, row: Row) -> Any:
        """Return its value at a point."""
        return row.values[self.name] if self.value is None else self.value(row)


def error_of(column: str) -> Callable[[Row], float]:
    """Return the error of a column, NaN where it is not known."""
    return lambda row: row.errors.get(column, np.nan)


def _book(name: str, words: str, value: Callable[[Row], Any], kind: str = "f8") -> Column:
    return Column(name, words, value, kind=kind, role=BOOK)


#: Columns of every result, in the order of its tables.
_BOOK = (
    _book("point", "running number of the point along the branch, labelled points included", lambda row: row.number, "i4"),
    Column(
        "label",
        "AUTO's label: BP branch point, LP fold, SB secondary bifurcation, UZ user value, EP end, MX failed; empty for others",
        lambda row: row.point.label.encode(), kind="S2", role=TEXT,
    ),
    _book("arclength", "distance from the first point in the continuation norm", lambda row: row.point.arclength),
    _book("intervals", "mesh intervals N of this point's solution", lambda row: row.point.system.intervals, "i4"),
    _book("iterations", "Newton iterations", lambda row: row.point.iterations, "i4"),
    _book("newton_error", "estimated relative error left by Newton's method", lambda row: row.point.newton_error),
    _book(
        "discretization_error", "estimated error due to the mesh, relative to 1 + size",
        lambda row: row.point.discretization_error,
    ),
    Column("name", "the subject of the label", lambda row: row.point.name.encode(), None, "S64", TEXT, of_labelled=True),
)  # fmt: skip


def _change(name: str, words: str, value: Callable[[Row], Any], kind: str = "i4", role: str = INDEX) -> Column:
    return Column(name, words, value, kind=kind, role=role, of_labelled=True)


#: The index, and how it changes at labelled points.
_INDEX = (
    Column(
        "index", "number of negative directions of the energy; -1 where one is neutral (undecided)",
        lambda row: row.index, kind="i4", role=INDEX,
    ),
    _change("index_before", "the index just before this point, at LP and SB; otherwise -1", lambda row: row.change.before),
    _change("index_after", "the index just after it", lambda row: row.change.after),
    _change("kernel", "number of neutral modes: 1 at LP, 1 or 2 at SB", lambda row: row.change.kernel),
    _change(
        "breaks", "symmetries that the modes break, and that a branch which leaves here does not have; empty at LP",
        lambda row: row.change.breaks.encode(), "S128", TEXT,
    ),
)  # fmt: skip


#: Names of columns that every staged result has, which no number can have.
OWN = (*(one.name for one in (*_BOOK, *_INDEX)), "energy", "stage")


@dataclass(frozen=True, repr=False)
class Columns(Shown):
    """All columns of a result, in the order of its tables: book-keeping, values, the index."""

    values: tuple[Column, ...]
    watched: bool

    @functools.cached_property
    def all(self) -> dict[str, Column]:
        """The columns by name."""
        return {column.name: column for column in (*_BOOK, *self.values, *(_INDEX if self.watched else ()))}

    def table(self, name: str) -> dict[str, tuple[str, str, Callable[[Row], Any]]]:
        """Return type, words and value of the columns of a table: ``points``, or ``events`` with errors behind the values."""
        events = name == "events"
        stored = [one for one in (*_BOOK, *self.values) if one.derived is None and (events or not one.of_labelled)]
        found = {one.name: (one.kind, one.words, one.of) for one in stored}
        for one in sorted((one for one in self.values if one.error and events), key=lambda one: one.role == FOUND):
            found[f"error_{one.name}"] = "f8", f"estimated error of {one.name}", one.error
        watch = _INDEX if self.watched else ()
        return found | {one.name: (one.kind, one.words, one.of) for one in watch if events or not one.of_labelled}

    def among(self, names: Collection[str]) -> Columns:
        """Return those that a table with these names has, and those that follow from others."""
        return replace(self, values=tuple(one for one in self.values if one.derived or one.name in names))

    def shown(self) -> list[str]:
        """Return the names of numbers and of what was found, which maps and graphs show."""
        return [one.name for one in self.values if one.role in (NUMBER, FOUND) and one.derived is None]

    def mapped(self, follow: str) -> list[str]:
        """Return the columns of maps and diagrams: the number that is followed, and what was found."""
        return [follow, *(one.name for one in self.values if one.role == FOUND and one.derived is None)]

    def axes(self, names: Sequence[str]) -> list[tuple[str, str, str]]:
        """Return name, words and short form of columns."""
        return [(name, self.all[name].axis or name, self.all[name].brief or name) for name in names]
