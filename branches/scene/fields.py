"""What all scenes share: `Scene`, and the fields of mesh and steps."""

from __future__ import annotations

import math
import re
from abc import abstractmethod
from collections.abc import Sequence
from typing import Annotated, Any, ClassVar

from pydantic import BaseModel, BeforeValidator, ConfigDict, Field, model_validator

from contin.lowlevel import exact_text, meant


class ConfigError(Exception):
    """A scene or an option that cannot be used; the message is one sentence: the field, the value and what is allowed."""


class Strict(BaseModel):
    """A part of a scene: unknown fields, other types and numbers that are not finite are rejected."""

    model_config = ConfigDict(extra="forbid", frozen=True, strict=True, allow_inf_nan=False)


class MeshConfig(Strict):
    """Fields of the mesh."""

    degree: int = Field(7, ge=2, le=8, description="polynomial degree of the collocation")
    intervals: int = Field(8, ge=1, le=2000, description="intervals of the first mesh")
    max_intervals: int = Field(2000, ge=1, le=2000)
    tolerance: float = Field(
        1e-12, ge=1e-14, le=1e-2, description="tolerance of the discretization error; the number of intervals adapts to it"
    )
    adapt_every: int = Field(3, ge=0, description="steps between adaptations of the mesh, 0 for a fixed mesh")

    @model_validator(mode="after")
    def _order(self):
        if self.intervals > self.max_intervals:
            raise ValueError(f"intervals = {self.intervals} must not exceed max_intervals = {self.max_intervals}")
        return self


class StepConfig(Strict):
    """Fields of the steps along a branch."""

    first: float | None = Field(None, ge=1e-6, le=10, description="first step of arclength; 0.05 if the bounds allow it")
    smallest: float = Field(1e-6, gt=0, le=1)
    largest: float = Field(10.0, gt=0, description="largest step of arclength")
    max_points: int = Field(2000, ge=1, le=1_000_000)
    angle: float = Field(0.35, gt=0.001, le=1.0, description="largest angle between consecutive tangents, radians")
    newton_tolerance: float | None = Field(
        None, ge=1e-14, le=1e-4,
        description="relative error at which Newton's method stops; 1e-12, on secondary branches 1e-8",
    )  # fmt: skip

    @model_validator(mode="after")
    def _order(self):
        if self.smallest > self.largest:
            raise ValueError(f"smallest = {exact_text(self.smallest)} must not exceed largest = {exact_text(self.largest)}")
        if self.first is not None and not self.smallest <= self.first <= self.largest:
            bounds = f"smallest = {exact_text(self.smallest)} and largest = {exact_text(self.largest)}"
            raise ValueError(f"first = {exact_text(self.first)} must lie between {bounds}")
        return self

    @property
    def first_step(self) -> float:
        """The first step of arclength; chosen if ``first`` is not given."""
        return min(max(0.05, self.smallest), self.largest) if self.first is None else self.first


def _two_ordered_numbers(ends: object) -> Any:
    numbers = isinstance(ends, (list, tuple)) and all(type(end) in (int, float) and math.isfinite(end) for end in ends)
    if not (numbers and len(ends) == 2 and ends[0] < ends[1]):
        raise ValueError(f"must be two finite numbers, the smaller first, as in [-100, 100], not {show(ends)}")
    return tuple(ends)


Interval = Annotated[tuple[float, float], BeforeValidator(_two_ordered_numbers)]


def show(value: object) -> str:
    """Return a value for a message, at most 60 letters of it."""
    text = repr(value)
    return text if len(text) <= 60 else text[:57] + "..."


def alone(value: object) -> str:
    """Return what to write in place of a number with a unit, where it has none; '' for other values."""
    has_unit = isinstance(value, str) and re.match(r"\s*[-+]?\.?\d[\d.]*\s*[^\W\d]", value)
    return "; write the number alone, in a scene with dimensions in m, rad, N, N m, N/m, 1/m" if has_unit else ""


def plain(text: str) -> str:
    """Return a text for a message: one line of bounded length."""
    text = text if text.isprintable() else repr(text)[1:-1]
    return text if len(text) <= 200 else text[:197] + "..."


def missing(fields: Sequence[str]) -> str:
    """Return the sentence about fields that are missing.

    Examples
    --------
    >>> missing(["m"]), missing(["m", "n"])
    ("the field 'm' is missing", "the fields 'm' and 'n' are missing")
    """
    *others, last = map(repr, fields)
    return f"the fields {', '.join(others)} and {last} are missing" if others else f"the field {last} is missing"


def unknown(field: str, known: Sequence[str]) -> str:
    """Return the sentence about a field that is none of the known ones; ``mesh.degre`` is one inside another."""
    near = meant(field.rpartition(".")[2], known)
    return f"unknown field {plain(field)!r}{near}; the fields are {', '.join(known)}"


class Scene(Strict):
    """What closed and open scenes have in common; each kind has the fields of its files.

    Attributes
    ----------
    KIND : str
        The kind of strip, as result files name it.
    LISTS : tuple of places
        Where a list may stand in place of a single value, slowest first; ``*`` is any name, ``#`` any stage. A list makes the
        scene a sweep (`branches.scene.sweep`).
    PAIRS : bool
        Whether ``pairs`` are lists of two places at once.
    CHANGEABLE : tuple of str
        Fields that a resumed run may change: none that changes the points.
    """

    many: ClassVar[bool] = False
    KIND: ClassVar[str]
    LISTS: ClassVar[tuple[tuple[str, ...], ...]]
    PAIRS: ClassVar[bool] = False
    CHANGEABLE: ClassVar[tuple[str, ...]] = ()

    @property
    @abstractmethod
    def name(self) -> str:
        """The strip in words."""

    @property
    def heading(self) -> str:
        """The scene in one line."""
        return self.name

    @property
    def scenes(self) -> dict[str, Scene]:
        """This scene, as the scenes of a sweep."""
        return {"": self}

    @property
    def absent(self) -> dict[str, str]:
        """Combinations that cannot be run: none, as in a sweep without such."""
        return {}

    @property
    def title_or_name(self) -> str:
        """What a summary calls the result."""
        return self.name

    @property
    def cautions(self) -> list[str]:
        """Sentences about numbers that are allowed and look wrong."""
        return []

    @property
    def stage_count(self) -> int:
        """The number of stages."""
        return 1

    @abstractmethod
    def file_of(self, numbers: dict[str, Any]) -> str:
        """Return the file of this scene in the folder of a sweep, in which its lists have these values."""

    @classmethod
    def prepared(cls, values: dict) -> dict:
        """Return the fields of a file with those that follow from others; raise ValueError for one that is given twice."""
        return values

    @classmethod
    def as_written(cls, values: dict) -> dict:
        """Return the fields without those that `prepared` adds again."""
        return values

    def fields(self) -> dict:
        """Return the fields of the scene as they are written: those that are not at their defaults."""
        return self.as_written(self.model_dump(mode="json", exclude_defaults=True))

    def factor(self, column: str) -> float:
        """Return what a column is multiplied by to have its unit."""
        return 1.0

    def unit(self, column: str) -> str:
        """Return the unit of a column, '' without one."""
        return ""

    def natural_unit(self, column: str) -> str:
        """Return what a column is divided by where the scene has no units, by the strip's own numbers; '' for ratios."""
        return ""

    def up_to(self, count: int) -> Scene:
        """Return the scene with its first stages alone."""
        return self

    # --- lists in place of single values --------------------------------------------------------------------------------

    @classmethod
    def axes(cls, values: dict, lists: dict[tuple, list]) -> list[tuple[tuple, list[tuple]]]:
        """Return what varies in a sweep: places, and the values that they have together; the slowest first."""
        return [((place,), [(value,) for value in entries]) for place, entries in lists.items()]

    @classmethod
    def combination(cls, fields: dict, lists: Sequence[tuple]) -> dict | None:
        """Return the fields of a combination; None if it is no scene of its own."""
        return fields

    @classmethod
    @abstractmethod
    def words_of(cls, fields: dict, numbers: dict[str, Any]) -> str:
        """Return a combination in words."""

    @classmethod
    def same_name(cls, words: str, a: Scene, b: Scene) -> str:
        """Return what is wrong with two scenes of a sweep that have one file."""
        return f"the branch {words} is listed twice; give each value once"

    def words(self, numbers: dict[str, Any]) -> str:
        """Return this scene of a sweep in words."""
        return self.name

    @property
    def other_end(self) -> str:
        """The file of a branch that may be this one from its other end, and is computed first; '' if there is none."""
        return ""

    @property
    @abstractmethod
    def law_name(self) -> str:
        """The name of the law."""
