"""A stage of a scene with its mechanics: what the runner asks of it, its columns and its words.

What all kinds of stages use: errors of what is found at points, and why a run found no further state.
"""

from __future__ import annotations

import contextlib
import dataclasses
from abc import ABC, abstractmethod
from collections.abc import Callable, Iterator, Mapping, Sequence
from typing import Any

import numpy as np

from branches.scene.columns import Change, Columns
from branches.scene.fields import Scene
from branches.scene.labels import label_of
from contin import ContinError, Point, Reason, Settings
from contin.lowlevel import Collocation, Continuation, Label, State, Stop, error, exact_text, levels, point_of

#: An error is given as no less than this part of the largest value of its kind: 16 units in the last place.
_ROUND_OFF = 16 * float(np.finfo(float).eps)
#: Points that a run must find with a changed field before that change is advised. With 1, changes were advised that help for
#: one step only; with 100, a failed run takes as long again as a stage.
_POINTS = 10
#: The smallest step is divided by this, then by its square; the tolerance of the mesh is divided by it once.
_SHORTER = 100.0


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

        Raises ConfigError where it has no first point.
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


def errors_of(point: Point, found: Callable[[Point], Mapping[str, float]]) -> dict[str, float]:
    """Return the estimated errors of what is found at a point, by name; NaN where it is not found again.

    The point is located again on a mesh twice as fine. To what contin says of a number (`contin.Point.error`) round-off of the
    largest force or moment is added, which the others were computed with.
    """
    here = found(point)
    place = point.errors.get(point.system.free[0], np.nan)
    if point.label == Label.FAILED or (label_of(point.label).singular and np.isnan(place)):
        return dict.fromkeys(here, np.nan)
    errors = error(point, lambda trial: np.array([*found(point_of(trial.system, trial.x)).values()]))
    largest: dict[str, float] = {}
    for name, value in here.items():
        largest[_kind(name)] = max(largest.get(_kind(name), 0.0), abs(value))
    left = point.newton_error + _ROUND_OFF
    return {name: float(one + left * largest[_kind(name)]) for name, one in zip(here, errors)}


def _kind(name: str) -> str:
    bare = name.removeprefix("start_")
    return bare[0] if bare[0] in "FM" else name


# --- why a run found no further state: an advice is tried before it is given -----------------------------------------


def no_state(run: Continuation, place: str) -> Stop:
    """Return why a run ended without convergence, and the first change of a field of the scene with which it goes on.

    It has stopped with the reason "no convergence" at a ``place`` as in "turn = 3.1".
    """
    step = exact_text(run.settings.min_step)
    if _goes_on(run.state, run.settings):
        assert run.stop is not None
        return run.stop  # steps succeed: it stopped for something that it met
    for field, state, settings in _changes(run):
        if _goes_on(state, settings):
            message = f"no state was found beyond {place} with steps down to {step}"
            return Stop(Reason.NO_CONVERGENCE, message, f"the run goes on with {field}")
    return Stop(
        Reason.NO_CONVERGENCE, f"no state was found beyond {place}: neither smaller steps nor a finer mesh go on from there",
        "its last state shows where the strip bends or twists most; another law may go on",
    )  # fmt: skip


def _changes(run: Continuation) -> Iterator[tuple[str, State, Settings]]:
    """Yield changed fields of the scene in words, with the state and the settings of a run that has them."""
    state, settings = run.state, run.settings
    for smallest in (settings.min_step / _SHORTER, settings.min_step / _SHORTER**2):
        if smallest > 0:  # the least number there is cannot be divided
            yield f"steps.smallest: {smallest:g}", state, dataclasses.replace(settings, min_step=smallest)
    if not state.system.intervals:
        return
    finer = state.carried(*state.system.refined())
    system = finer.system
    if system.intervals <= settings.mesh.max_intervals and settings.mesh.every:
        mesh = dataclasses.replace(settings.mesh, tolerance=settings.mesh.tolerance / _SHORTER)
        yield f"mesh.tolerance: {mesh.tolerance:g}", finer, dataclasses.replace(settings, mesh=mesh)
    mesh = dataclasses.replace(settings.mesh, every=0)
    fixed = f"mesh.intervals: {system.intervals} and mesh.adapt_every: 0"
    yield fixed, finer, dataclasses.replace(settings, mesh=mesh)


def _goes_on(state: State, settings: Settings) -> bool:
    """Return whether a run from a state finds further points, or comes to an end of another kind."""
    state = dataclasses.replace(state, step=min(settings.min_step * _SHORTER, settings.max_step))
    start = (state.system, state.x, state.tangent)
    with contextlib.suppress(ContinError):
        trial = dataclasses.replace(settings, max_points=state.accepted + _POINTS, errors=False)
        run = Continuation(state.system, state.x, trial, state=state, start=start)
        count = sum(not point.label for point in run)
        return run.stop is not None and run.stop.reason != Reason.NO_CONVERGENCE and count > 0
    return False


def reached(stop: Stop, last: Point, run: Continuation, shown: Callable[[str, float], str]) -> Stop:
    """Return the stop of a run at a limit, with the value in the words of ``shown(name, value)``; others as they are."""
    if stop.reason != Reason.LIMIT:
        return stop
    for name, ends in run.settings.limits.items():
        end = min(ends, key=lambda end: abs(end - last[name]))
        if abs(end - last[name]) <= levels.LOCATED * (ends[1] - ends[0] + abs(end)):
            return dataclasses.replace(stop, message=f"reached {shown(name, end)}")
    return stop
