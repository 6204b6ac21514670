"""A stage of a scene with its mechanics: what the runner asks of it, its columns and its words."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from branches.scene.columns import Change, Columns
from branches.scene.fields import Scene
from contin import Point, Reason
from contin.lowlevel import Collocation, Continuation, State, Stop


class Watch(ABC):
    """The index along a stage."""

    def __repr__(self) -> str:
        return f"{type(self).__name__}()"

    @abstractmethod
    def index(self, point: Point) -> int:
        """Return the index of a point, -1 where it is undecided."""

    @abstractmethod
    def change(self, point: Point) -> Change:
        """Return how the index changes at a labelled point."""


class Stage(ABC):
    """A stage of a scene.

    Attributes
    ----------
    scene : Scene
    number : int
        From 1.
    follow : str
        The number that is followed.
    problem : contin.BoundaryValueProblem
    free : tuple of str
        Unknown numbers, the followed one first.
    watch : Watch or None
        None where the index is not asked for. It is there once the stage has begun.
    conjugate : str
        What a person feels or sees where the number is followed; pictures show it.
    units : str
        What lengths and moduli are measured in, for the file.
    fails : tuple of contin.Reason
        Reasons to stop with which a result is incomplete.
    starts_others : bool
        Whether later stages may start from labelled points of this one.
    has_barriers : bool
        Whether a run tells the barriers around its stable states.
    title, head : str
        A line before the table that a run shows, and the names of the columns that `row` shows.
    """

    scene: Scene
    number: int
    follow: str
    problem: Any
    free: tuple[str, ...]
    conjugate: str
    watch: Watch | None = None
    units: str
    fails: tuple[Reason, ...] = (Reason.NO_CONVERGENCE,)
    starts_others: bool = False
    has_barriers: bool = False
    title: str = ""
    head: str

    def __repr__(self) -> str:
        return f"{type(self).__name__}({self.number}: follows {self.follow})"

    # --- the run --------------------------------------------------------------------------------------------------------

    @abstractmethod
    def start(self, earlier: Sequence[Sequence[Point]]) -> Continuation:
        """Return the run from its first point; ``earlier`` are the labelled points of the stages before.

        Raises
        ------
        ConfigError
            It has no first point.
        """

    @abstractmethod
    def resume(self, state: State, first: tuple[Collocation, np.ndarray, np.ndarray], earlier) -> Continuation:
        """Return the run that goes on from a state; ``first`` is its first point."""

    def outside(self, last: Mapping[str, float]) -> str:
        """Return which limit of the scene does not contain the last point of a file, in words; '' if all do."""
        return ""

    def judge(self, point: Point, run: Continuation) -> Point | None:
        """Return a point as people see it, None for one that is none; the run's ``stop`` may be set."""
        return point

    @abstractmethod
    def told(self, run: Continuation, last: Point) -> Stop:
        """Return why the stage ended, in the fields and units of the scene."""

    def notes(self, run: Continuation) -> list[str]:
        """Return what the run saw and did not understand."""
        return list(run.notes)

    # --- columns --------------------------------------------------------------------------------------------------------

    @abstractmethod
    def columns(self) -> Columns:
        """Return the columns of the whole scene."""

    @abstractmethod
    def values(self, point: Point, names: Sequence[str]) -> Mapping[str, float]:
        """Return the values of a point, by name: all of ``names`` and perhaps more."""

    @abstractmethod
    def errors(self, point: Point) -> Mapping[str, float]:
        """Return the errors of a labelled point, by name."""

    # --- words ----------------------------------------------------------------------------------------------------------

    @abstractmethod
    def row(self, point: Point, step: float) -> str:
        """Return a line of the table that a run shows."""

    @abstractmethod
    def describe(self, event: np.void, largest: float) -> str:
        """Return a labelled point in words; ``largest`` is the largest value of the followed number in the stage."""

    def described(self, events: np.ndarray) -> list[str]:
        """Return all labelled points of this stage in words; ``events`` are those of the result."""
        own = [event for event in events if "stage" not in event.dtype.names or event["stage"] == self.number]
        largest = max((abs(event[self.follow]) for event in own), default=0.0)
        return [self.describe(event, largest) for event in own]

    def ending(self, stop: Stop, outcome: str) -> Stop | None:
        """Return the reason to stop as a summary tells it, None where the last labelled point says it."""
        return stop if outcome == "lost" or stop.reason == Reason.EVENT else None
