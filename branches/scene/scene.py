"""A scene: what the strip is made of, what holds its ends, and the stages in which numbers are followed."""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Sequence
from typing import Any, ClassVar

from branches.scene.fields import Strict


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
    def words_of(cls, fields: dict, numbers: dict[str, Any]) -> str:
        """Return a combination in words."""
        raise NotImplementedError

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
