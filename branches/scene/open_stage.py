"""A stage of an open strip or a network: from a labelled point of an earlier one to a value of the followed number."""

from __future__ import annotations

import dataclasses
import functools
import math
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING

import numpy as np

from branches.scene.columns import BOOK, FOUND, NUMBER, Change, Column, Columns, error_of
from branches.scene.fields import ConfigError
from branches.scene.labels import START, begins, label_of, without_round_off
from branches.scene.open_strip import StagedScene
from branches.scene.stage import Stage, Watch, errors_of, no_state, reached
from branches.scene.words import words_of
from contin import ContinError, ConvergenceError, Event, MeshControl, Newton, Point, ProblemError, Reason, Settings
from contin.lowlevel import Collocation, Continuation, Label, State, Stop, exact_text, levels, point_of
from ribbon_model.changed_supports import held_at, with_supports

if TYPE_CHECKING:
    from ribbon_model.network import Network


class SymmetriesWatch(Watch):
    """Index and broken symmetries of points, as contin found them."""

    def __init__(self, strip: Network):
        self._symmetries = strip.problem.symmetries

    def index(self, point: Point) -> int:
        return -1 if point.index is None else point.index

    def change(self, point: Point) -> Change:
        before, after = point.index_change or (None, None)
        states = point.system.states(point.x)[:, : point.system.problem.dimension]
        kept = [name for name, image in self._symmetries.items() if np.abs(image(None, states) - states).max() < levels.APART]
        broken = ", ".join(name for name in point.breaks if name in kept)
        return Change(-1 if before is None else before, -1 if after is None else after, point.nullity, broken)


class OpenStage(Stage):
    """A stage of a scene of an open strip or a network."""

    starts_others = has_barriers = True

    def __init__(self, scene: StagedScene, number: int):
        self.scene, self.number, self.stage, self.strip = scene, number, scene.stages[number - 1], scene.strip(number)
        self.follow, self.problem = self.stage.follow, self.strip.problem
        self.free, self.watch = (self.follow, *self.problem.multipliers), SymmetriesWatch(scene.strip())
        felt = self.strip.conjugate(self.follow)
        self.conjugate = felt if felt in self.columns().all else "energy"
        beside, self.units, unit = scene.BESIDE or self.conjugate, scene.units, scene.unit(self.follow)
        self._shown_in_rows = tuple(dict.fromkeys(("energy", beside)))
        self.title = f"stage {number}: {self.follow}{f' in {unit}' if unit else ''}\n"
        self.head = f"{self.follow:>14s}{''.join(f'  {name:>12s}' for name in self._shown_in_rows)}  index   N  it"
        self._how = ""
        self._largest = abs(self.stage.to)
        self._stiffness = min(section.stiffness for section in self.strip.sections.values())  # what round-off is compared with
        self._missed: list[str] = []

    # --- the run --------------------------------------------------------------------------------------------------------

    def start(self, earlier: Sequence[Sequence[Point]] = ()) -> Continuation:
        return self._run(self.first() if self.number == 1 else self._origin(earlier))

    def first(self) -> Point:
        """Return the state from which the first stage starts; raise ConfigError where there is none."""
        options = {"degree": self.scene.mesh.degree, "mesh": self.mesh_control(), "newton": newton_of(self.scene)}
        point, self._how = self.scene.first({self.follow: self.stage.to / self.scene.factor(self.follow)}, options)
        return point

    def restated(self, origin: Point, numbers: Mapping[str, float]) -> tuple[Collocation, np.ndarray]:
        """Return the system of this stage and the unknowns of a state of another one, with other numbers."""
        return with_supports(self.strip, origin, self.follow, self.scene.replacing(self.number), numbers)

    def mesh_control(self) -> MeshControl:
        """Return how the mesh adapts; a mesh point stays at a roller."""
        mesh = self.scene.mesh
        every = mesh.adapt_every if self.strip.roller is None else 0
        return MeshControl(mesh.tolerance, min(8, mesh.max_intervals), mesh.max_intervals, every)

    def resume(self, state: State, first: tuple[Collocation, np.ndarray, np.ndarray], earlier) -> Continuation:
        settings = self.start(earlier).settings  # those of the stage's start, to the last bit
        return Continuation(state.system, state.x, settings, state=state, start=first)

    def judge(self, point: Point, run: Continuation) -> Point | None:
        """A point at a value of a column has that value in the units of the scene."""
        name, equals, _ = point.name.partition(" = ")
        if not equals or self.scene.dimensions is None or name not in (*point.parameters, *point.functionals):
            return point
        return dataclasses.replace(
            point, name=f"{name} = {point[name] * self.scene.factor(name):.6g} {self.scene.unit(name)}".rstrip()
        )

    def told(self, run: Continuation, last: Point) -> Stop:
        if run.stop.reason not in (Reason.NO_CONVERGENCE, Reason.EVENT):
            self._missed = self._came_back(run, last)
            return reached(run.stop, last, run, self._shown)
        law = self.strip.explained(run)
        if law is not None:
            stop = Stop(run.stop.reason, law)
        elif run.stop.reason == Reason.NO_CONVERGENCE:
            here = run.state.system.parameter(run.state.x, self.follow)
            here = without_round_off(here, max(map(abs, run.settings.limits[self.follow])))
            stop = no_state(run, self._shown(self.follow, here))
        else:
            stop = run.stop
        return dataclasses.replace(stop, message=f"stage {self.number}: {stop.message}")

    def notes(self, run: Continuation) -> list[str]:
        units = " (numbers in units of L and B)" if self.scene.dimensions is not None else ""
        notes = [f"the first state was found {self._how}"] if self._how else []
        if self._how:
            unit, metre = self.scene.size("length"), " m" if self.scene.dimensions else ""
            gaps = [(name, f"{gap * unit:.4g}{metre}") for name, gap in self.strip.gaps.items()]
            notes += [f"the drawing has a gap of {gap} at {name}, which was closed" for name, gap in gaps]
        notes = [f"stage {self.number}: {note}" for note in (*notes, *self.scene.told_axes(self.number))]
        if self.number == 1 and not self.problem.has_index:
            notes.append("loads that follow the strips have no energy: there is no index, and flutter is not looked for")
        return notes + [f"stage {self.number}: {note}{units}" for note in run.notes] + self._missed

    def _came_back(self, run: Continuation, last: Point) -> list[str]:
        """Return a note if the stage turned back at a fold, and ended on the other side of its start."""
        ends = run.settings.limits[self.follow]
        to = self.stage.to / self.scene.factor(self.follow)
        other = max(ends, key=lambda end: abs(end - to))
        if abs(last[self.follow] - other) > levels.LOCATED * (ends[1] - ends[0]):
            return []
        there, here = (self._shown(self.follow, value) for value in (to, other))
        return [f"stage {self.number}: {there} was not reached: the strip came back, to {here}"]

    def _shown(self, name: str, value: float) -> str:
        """Return a number as a scene states it, with its unit."""
        return f"{name} = {value * self.scene.factor(name):.10g} {self.scene.unit(name)}".rstrip()

    def _origin(self, labelled: Sequence[Sequence[Point]]) -> Point:
        """Return the labelled point from which a stage starts; raise ConfigError where there is none."""
        stage = self.stage
        source = stage.stage or self.number - 1
        points = labelled[source - 1]
        place = stage.place_among([(point.label, point.name) for point in points])
        if place is None:
            there = ", ".join(point.label for point in points)
            raise ConfigError(f"start_at: {stage.start_at!r} is not among the points of stage {source}: {there}")
        return points[place]

    def _run(self, origin: Point) -> Continuation:
        """Return the run of a stage; raise ConfigError where the stage starts outside its limits, or not from this point."""
        try:
            run = self._begun(origin)
        except ConvergenceError as error:
            followed = self.stage.follow
            raise ConfigError(
                f"follow: {followed!r}: the state at the start of the stage was not found again with this number free; follow "
                "another one first, or refine the mesh (mesh.intervals, mesh.tolerance)"
            ) from error
        except ProblemError as error:
            raise ConfigError(str(error)) from error
        start = point_of(run.state.system, run.state.x)
        values = {**start.parameters, **start.functionals, **self.found(start)}
        for name, (low, high) in {**run.settings.limits, **self._limits}.items():
            slack = levels.LOCATED * max(abs(low), abs(high), high - low)
            if not low - slack <= values[name] <= high + slack:
                here, *ends = (f"{self.scene.factor(name) * value:.10g}" for value in (values[name], low, high))
                words, unit = " to ".join(ends), f" {self.scene.unit(name)}".rstrip()
                first = "stage 1: " if self.number == 1 else ""  # later ones are named by the caller
                where = f"limits: {name} = {here}{unit} at the start of the stage is outside its limits, {words}{unit}"
                raise ConfigError(f"{first}{where}; widen them, or start at another point")
        return run

    def _begun(self, origin: Point) -> Continuation:
        stage, strip, waves = self.stage, self.strip, getattr(self.stage, "phase", None)
        if waves is not None and origin.system.problem is not self.problem:
            try:
                origin = strip.restated(origin)
            except ContinError as error:
                raise ConfigError(
                    f"phase: with {waves} waves held, no single branch leaves; try another number of waves"
                ) from error
        changed = origin.system.problem is not strip.problem or bool(stage.numbers)
        if stage.start_at is not None and stage.start_at.startswith(Label.BRANCH_POINT):
            return Continuation(origin.system, origin.x, *self._switched(origin, changed))
        if not changed:
            system, x = origin.system.with_free((stage.follow, *strip.problem.multipliers), origin.x)
            return Continuation(system, x, self._settings(system, x))
        numbers = {name: value / self.scene.factor(name) for name, value in stage.numbers.items()}
        try:
            system, x = self.restated(origin, numbers)
            return Continuation(system, x, self._settings(system, x))
        except ValueError as error:
            raise ConfigError(f"{self.scene.SUPPORTS}: {error}") from error
        except ConvergenceError as error:
            given = ", ".join(f"{name} = {exact_text(value)}" for name, value in stage.numbers.items())
            where = f"near the one before{f' with {given}' if given else ' with these ends'}"
            raise ConfigError(f"numbers: no state was found {where}; follow the changes in stages") from error
        except ContinError as error:
            raise ConfigError(f"numbers: {error}") from error

    def _switched(self, origin: Point, changed: bool) -> tuple[Settings, np.ndarray]:
        """Return settings and first tangent at a branch point; raise ConfigError if no single branch leaves in this stage."""
        stage = self.stage
        if not origin.is_simple_branch_point:
            raise ConfigError(
                f"start_at: {stage.start_at!r}: {origin.nullity} modes are neutral there, and no single branch leaves it; a "
                "phase or an imperfection tells the modes apart"
            )
        if changed:
            raise ConfigError(
                f"start_at: {stage.start_at!r}: a branch point is left with the ends and the numbers that led to it"
            )
        if origin.system.free[0] != stage.follow:
            raise ConfigError(
                f"follow: {stage.follow!r}: a branch point is left with the number that led to it, {origin.system.free[0]}"
            )
        way = 1 if stage.way == "forward" else -1
        settings = dataclasses.replace(self._settings(origin.system, origin.x), direction=way)
        return settings, way * origin.details.tangents[1]

    @property
    def _limits(self) -> dict[str, tuple[float, ...]]:
        return {name: tuple(end / self.scene.factor(name) for end in ends) for name, ends in self.stage.limits.items()}

    def _settings(self, system: Collocation, x: np.ndarray) -> Settings:
        stage, steps = self.stage, self.scene.steps
        here = system.parameter(x, stage.follow)
        to = stage.to / self.scene.factor(stage.follow)
        reach = abs(to - here) or 1.0
        limits = {stage.follow: (min(to, here - reach), max(to, here + reach))}
        limits |= self._limits
        zeros = {name: [value / self.scene.factor(name) for value in values] for name, values in stage.label.items()}
        events = self.strip.domain_tests()
        for name in [name for name in zeros if name in self.scene.found_names]:
            events += [self._test(Label.USER_ZERO, name, value) for value in zeros.pop(name)]
        for name in [name for name in limits if name in self.scene.found_names]:
            events += [self._test(Label.END, name, end, side, True) for side, end in zip((-1, 1), limits.pop(name))]
        return Settings(
            primary=stage.follow, direction=int(np.sign(to - here)) or 1, step=steps.first_step, min_step=steps.smallest,
            max_step=steps.largest, max_points=stage.max_points or steps.max_points, angle=steps.angle, limits=limits,
            zeros=zeros, mesh=self.mesh_control(), newton=newton_of(self.scene), events=events,
            scales=self.strip.sizes(system, x),
        )  # fmt: skip

    def _test(self, label: Label, name: str, value: float, side: int = 1, ends: bool = False) -> Event:
        """Return the test function of a value of what is found in states; one that ``ends`` the run is positive outside."""

        def beyond(trial) -> float:
            return side * without_round_off(self.found(point_of(trial.system, trial.x))[name] - value, self._stiffness)

        return Event(label, self._shown(name, value), beyond, terminal=ends, limit=ends)

    # --- columns --------------------------------------------------------------------------------------------------------

    @functools.cache  # noqa: B019 - a stage lives as long as its run
    def columns(self) -> Columns:
        """Return the columns of all stages together: each has the numbers of every stage."""
        problems = [self.scene.strip(number).problem for number in range(1, len(self.scene.stages) + 1)]
        hidden = {name for problem in problems for name in problem.multipliers}
        numbers = dict.fromkeys(name for problem in problems for name in problem.parameters if name not in hidden)
        found = dict.fromkeys(name for problem in problems for name in problem.functionals if name not in numbers)
        followed = {stage.follow for stage in self.scene.stages}
        columns = [self._column(name, error_of(name) if name in followed else None) for name in numbers]
        columns += [self._column(name, error_of(name), role=FOUND) for name in found]
        columns.append(Column("stage", "stage of the scene, from 1", lambda row: row.stage.number, None, "i4", BOOK))
        return Columns((*columns, *(self._column(name, error_of(name), role=FOUND) for name in self.scene.found_names)), True)

    def _column(self, name: str, error, role: str = NUMBER) -> Column:
        words, axis = words_of(self.scene, name)
        return Column(name, words, error=error, role=role, axis=axis)

    def values(self, point: Point, names: Sequence[str]) -> Mapping[str, float]:
        """Loads and reactions that do not act are zero; displacements and rotations that are not prescribed are those found."""
        found = {**point.parameters, **point.functionals, **self.found(point)}
        absent = {name: 0.0 for name in names if name not in found}
        for joint in self.strip.joints:
            if any(name in absent for name in self.strip.names_at(joint)):
                absent |= held_at(self.strip, point, joint)
        return absent | found

    def errors(self, point: Point) -> Mapping[str, float]:
        return errors_of(point, lambda at: {**at.functionals, **self.found(at)}) | point.errors

    def found(self, point: Point) -> dict[str, float]:
        """Return the potential, and what the mechanics find: places of joints, reactions."""
        return {"potential": self.strip.potential(point), **self.strip.found(point)}

    # --- words ----------------------------------------------------------------------------------------------------------

    def row(self, point: Point, step: float) -> str:
        factor, told = self.scene.factor, {"energy": point["energy"], **point.functionals, **self.found(point)}
        self._largest = max(self._largest, abs(point[self.follow] * factor(self.follow)))
        others = (without_round_off(told[name], self._stiffness) * factor(name) for name in self._shown_in_rows)
        value = without_round_off(point[self.follow] * factor(self.follow), self._largest)
        return (
            f"{value:14.8g}{''.join(f'  {other:12.6g}' for other in others)}"
            f"  {'-' if point.index is None else point.index:>5}  {point.system.intervals:4d} {point.iterations:3d}"
        )

    def describe(self, event: np.void, largest: float) -> str:
        name, factor = self.follow, self.scene.factor(self.follow)
        label, error = event["label"].decode(), event[f"error_{name}"] * factor
        shown = dict.fromkeys(("energy", self.strip.conjugate(name)))  # and what is conjugate to the followed number
        others = "".join(f", {text}" for text in (self._with_error(event, column) for column in shown) if text)
        singular = label_of(label).singular
        found = f" (± {error:.0e})" if singular and not math.isnan(error) else ""
        value = _rounded(without_round_off(event[name], largest) * factor, error)
        place = f"{name} = {value} {self.scene.unit(name)}".rstrip() + found
        what = event["name"].decode()
        change = f", index {event['index_before']} -> {event['index_after']}" if event["index_before"] >= 0 else ""
        broken = f", breaks {event['breaks'].decode()}" if event["breaks"] else ""
        tells = not singular or "kernel" in what or label == Label.CORNER
        told = what if "=" not in what and tells else ""  # not the value once more
        kind = f" ({told})" if told else ""
        return f"stage {self.number}: {label_of(label).word}{kind} at {place}{others}{change}{broken}"

    def described(self, events: np.ndarray) -> list[str]:
        """Return all labelled points in words, up to where nothing moves, and where stability ended last."""
        lines, own = super().described(events), [event for event in events if event["stage"] == self.number]
        lines += self._at_rest(own)
        names = [(event["label"].decode(), event["name"].decode()) for event in own]
        later = [stage for number, stage in enumerate(self.scene.stages) if (stage.stage or number) == self.number]
        ends = [at for at, event in enumerate(own) if event["index_before"] == 0 < event["index_after"]]
        if not ends or (at := ends[-1]) in [stage.place_among(names) for stage in later]:
            return lines
        tag = f"{names[at][0]} {sum(label == names[at][0] for label, name in names[: at + 1] if name != START)}"
        before = f"stage: {self.number} and " if self.number < len(self.scene.stages) else ""
        way = f"a stage with {before}start_at: {tag} follows the branch that leaves there"
        if names[at][0] == Label.FOLD or names[at][1].endswith("fold"):
            way = "the branch turns back there, and what is pushed further snaps"
        elif names[at][0] == Label.CORNER:
            way = "other contacts hold there"
        elif own[at]["kernel"] != 1:
            way = "several modes are neutral there; a phase or an imperfection tells them apart"
        name, shown = self.follow, [event for event in own[at:] if event is own[at] or event["index_after"] == 0]
        here, *again = (self._shown(name, event[name] * (not abs(event[name]) < event[f"error_{name}"])) for event in shown)
        until = f", stable again from {again[0]} on" if again else ""
        return [*lines, f"stage {self.number}: unstable beyond {here} ({tag}){until}: {way}"]

    def _at_rest(self, own: Sequence[np.void]) -> list[str]:
        """Return up to where nothing moves, as straight strips: there energy and conjugate differ by their errors only."""
        felt, last = self.strip.conjugate(self.follow), None
        if not own or f"error_{felt}" not in own[0].dtype.names:
            return []
        for event in own:
            bent, moved = event["energy"], event[felt] - own[0][felt]
            if not (abs(bent) <= event["error_energy"] and abs(moved) <= 2 * event[f"error_{felt}"]):
                break
            last = event
            if event["label"] == Label.BRANCH_POINT.encode() and not begins(event):
                break
        if last is None or begins(last):
            return []
        word = "before" if last["label"] == Label.BRANCH_POINT.encode() else "up to"
        return [f"stage {self.number}: nothing moves {word} {self._shown(self.follow, last[self.follow])}"]

    def _with_error(self, event: np.void, column: str) -> str:
        """Return a column of a labelled point with its error, '' where it has none."""
        if f"error_{column}" not in event.dtype.names or math.isnan(event[f"error_{column}"]):
            return ""
        value, error = (event[field] * self.scene.factor(column) for field in (column, f"error_{column}"))
        return f"{column} = {_rounded(value, error)} {self.scene.unit(column)}".rstrip() + f" (± {error:.0e})"


def _rounded(value: float, error: float) -> str:
    """Return a number with ten digits; 0 where it is smaller than its error."""
    return "0" if abs(value) < error else f"{value:.10g}"


def first_state(scene: StagedScene) -> Point:
    """Return the state from which the first stage starts; raise ConfigError where there is none."""
    return OpenStage(scene, 1).first()


def newton_of(scene: StagedScene) -> Newton:
    return Newton(scene.steps.newton_tolerance or Newton.tolerance)
