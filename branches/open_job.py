"""Run the stages of an open strip, one after the other, into one result file.

A stage starts from a labelled point of an earlier one, by default from its end. An interrupted run is computed again from its
beginning by ``--resume``: a scene takes seconds, and later stages need branch points of earlier ones with all that was found
there.
"""

from __future__ import annotations

import contextlib
import dataclasses
import itertools
import math
import time
from pathlib import Path

import numpy as np

from branches.config import ConfigError, dump
from branches.job import Interruption, is_done, writing
from branches.layout import OPEN
from branches.open_config import MEANINGS, OpenConfig, StageConfig
from branches.store import BranchWriter, Kind
from contin import BranchPoint, ContinError, Continuation, MeshControl, Point, ProblemError, Settings, Stop, exact_text
from ribbon_model.changed_ends import with_ends
from ribbon_model.ends import ANGLES, angles_of
from ribbon_model.open_strip import REACTIONS, OpenStrip

#: A state keeps a symmetry that moves it by less than this.
_KEEPS = 1e-6
#: Directions of reactions and their ends, in words.
_WORDS = {"F": "force", "M": "moment"}


class Watch:
    """Index and broken symmetries of points, as contin found them; see `branches.stability.Watch`."""

    def __init__(self, strip: OpenStrip):
        self._symmetries = strip.problem.symmetries

    def index(self, point: Point) -> int:
        """Return the index of a point, -1 where it has none."""
        return -1 if point.index is None else point.index

    def change(self, point: Point) -> Change:
        """Return the index on both sides of a special point, its nullity, and what its modes break."""
        before, after = point.index_change or (None, None)
        states = point.system.states(point.x)[:, : point.system.problem.dimension]
        kept = [name for name, image in self._symmetries.items() if np.abs(image(None, states) - states).max() < _KEEPS]
        broken = ", ".join(name for name in point.breaks if name in kept)
        return Change(-1 if before is None else before, -1 if after is None else after, point.nullity, broken)


@dataclasses.dataclass(frozen=True)
class Change:
    """As `branches.stability.Change`."""

    before: int
    after: int
    kernel: int
    breaks: str


def run_stages(config: OpenConfig, path: Path, display, *, resume: bool = False, overwrite: bool = False) -> str:
    """Follow the stages of ``config`` into the file ``path``; return the outcome, as `branches.job.run_branch`.

    Raises
    ------
    StoreError, ConfigError
    """
    with writing(Path(path), display, resume) as resume:
        return _run_stages(config, Path(path), display, resume, overwrite)


def _run_stages(config: OpenConfig, path: Path, display, resume: bool, overwrite: bool) -> str:
    began = time.perf_counter()
    if is_done(path, config, display, resume, overwrite):
        return "complete"
    start = first_state(config)
    with contextlib.closing(writer_of(config, path)) as writer:
        display.begin_stages(config)
        outcome, stop = _followed(config, start, writer, display)
        display.stages_summary(config, writer.events(), writer.count, time.perf_counter() - began, path, (outcome, stop))
    return outcome


def writer_of(config: OpenConfig, path: Path | None) -> BranchWriter:
    """Return the writer of the result file."""
    meaning = {
        name: f"{_WORDS[name.removeprefix('start_')[0]]} on the strip at its {'first' if name[0] == 's' else 'last'} end, "
        f"along the {name.rpartition('_')[2]} of the first one" for name in REACTIONS
    }  # fmt: skip
    columns = (("stage", "i4", MEANINGS["stage"]), ("potential", "f8", MEANINGS["potential"]))
    columns += tuple((name, "f8", text) for name, text in meaning.items())
    length = "1" if config.dimensions is None else f"1 ({exact_text(config.dimensions.length)} m)"
    modulus = "1" if config.dimensions is None else f"1 ({config.dimensions.modulus:.12g} N m^2)"
    table = Table.of(config)
    kind = Kind(OPEN, f"bending modulus B = {modulus}, length L = {length}", columns, _Row(config, table))
    followed = list(dict.fromkeys(stage.follow for stage in config.stages))
    return BranchWriter(path, dump(config), table, followed, config.stride, watch=Watch(config.strip()), kind=kind)


@dataclasses.dataclass(frozen=True)
class Table:
    """Names of states and columns of all stages together, as `branches.store.BranchWriter` takes those of a problem."""

    states: tuple[str, ...]
    parameters: tuple[str, ...]
    functionals: tuple[str, ...]
    multipliers: tuple[str, ...]

    @classmethod
    def of(cls, config: OpenConfig) -> Table:
        """Return those of a scene."""
        problems = [config.strip(number).problem for number in range(1, len(config.stages) + 1)]
        parameters, functionals, multipliers = (
            tuple(dict.fromkeys(itertools.chain.from_iterable(getattr(problem, kind) for problem in problems)))
            for kind in ("parameters", "functionals", "multipliers")
        )
        functionals = tuple(name for name in functionals if name not in parameters)
        return cls(tuple(problems[0].states), parameters, functionals, multipliers)


class _Row:
    """The further columns of a point: its stage, the reactions, and numbers that its stage does not have.

    Loads that do not act are zero; angles that are not prescribed are those of the last end. ``stage`` is set by the run.
    """

    def __init__(self, config: OpenConfig, table: Table):
        self._config, self._names, self.stage = config, (*table.parameters, *table.functionals), 1

    def __call__(self, point: Point) -> dict:
        strip, states = self._config.strip(self.stage), point.system.states(point.x)
        absent = {name: 0.0 for name in self._names if name not in point.parameters and name not in point.functionals}
        if set(ANGLES) & set(absent):
            absent |= dict(zip(ANGLES, angles_of(states[-1, :4])))
        own = {"stage": self.stage, "potential": strip.potential(point), **strip.reactions_of(states)}
        return absent | own


def first_state(config: OpenConfig) -> Point:
    """Return the state from which the first stage starts.

    Raises
    ------
    ConfigError
        It was not found, or nothing determines it.
    """
    strip, mesh = config.strip(), config.mesh
    turn = strip.parameters.get("turn", 0.0)
    half_twists = turn / math.pi
    guesses = {
        "natural": lambda: None, "arch": lambda: strip.arch(), "arch, other side": lambda: strip.arch(side=-1.0),
        "circle": lambda: strip.twisted_circle(half_twists), "twisted": lambda: strip.twisted(turn),
    }  # fmt: skip
    try:
        return strip.first_point(
            guesses[config.begin](), intervals=mesh.intervals, degree=mesh.degree, mesh=_mesh_control(config)
        )
    except (ProblemError, ValueError) as error:
        raise ConfigError(f"begin: {config.begin}: {error}") from error


def _mesh_control(config: OpenConfig) -> MeshControl:
    mesh = config.mesh
    return MeshControl(mesh.tolerance, min(8, mesh.max_intervals), mesh.max_intervals, mesh.adapt_every)


def _followed(config, start: Point, writer: BranchWriter, display) -> tuple[str, Stop | None]:
    """Follow all stages; return the outcome and the reason why the last one stopped."""
    labelled: list[list[Point]] = []
    run = None
    with Interruption() as interruption:
        for number, stage in enumerate(config.stages, 1):
            try:
                following = _run(config, number, start if number == 1 else _origin(stage, labelled))
            except ConfigError as error:
                if run is None:
                    raise
                stop = Stop("scene", f"stage {number}: {error}")
                writer.checkpoint(run.start, "lost", stop)
                return "lost", stop
            run = following
            labelled.append([])
            writer.kind.values.stage = number
            display.stage(config, number)
            for point in run:
                display.stage_point(config, stage, point, writer.count)
                writer.append(point)
                labelled[-1] += [point] if point.label else []
                if writer.due():
                    writer.checkpoint(run.start, "running")
                if interruption.asked:
                    writer.checkpoint(run.start, "interrupted")
                    return "interrupted", None
            writer.flush()
            if run.stop.reason == "no convergence" or run.stop.message.startswith("met "):
                why = config.strip(number).explained(run)
                stop = dataclasses.replace(run.stop, message=f"stage {number}: {why}", advice="")
                writer.checkpoint(run.start, "lost", stop)
                return "lost", stop
        writer.checkpoint(run.start, "complete", run.stop)
    return "complete", run.stop


def _origin(stage: StageConfig, labelled: list[list[Point]]) -> Point:
    """Return the labelled point from which a stage starts.

    Raises
    ------
    ConfigError
        There is none.
    """
    source = stage.stage or len(labelled)
    points = labelled[source - 1]
    if stage.start_at is None:
        return points[-1]
    label, _, count = stage.start_at.partition(" ")
    found = [point for point in points if point.label == label and point.name != "start"]
    place = int(count or 1)
    if place > len(found):
        there = ", ".join(point.label for point in points)
        raise ConfigError(f"start_at: {stage.start_at!r} is not among the points of stage {source}: {there}")
    return found[place - 1]


def _run(config: OpenConfig, number: int, origin: Point) -> Continuation:
    """Return the run of a stage."""
    stage, strip = config.stages[number - 1], config.strip(number)
    changed = origin.system.problem is not strip.problem or bool(stage.numbers)
    if stage.start_at is not None and stage.start_at.startswith("BP"):
        return Continuation(origin.system, origin.x, *_switched(config, number, origin, changed))
    if not changed:
        system, x = origin.system.with_free((stage.follow, *strip.problem.multipliers), origin.x)
        return Continuation(system, x, _settings(config, number, origin[stage.follow]))
    numbers = {name: value / config.factor(name) for name, value in stage.numbers.items()}
    try:
        system, x = with_ends(strip, origin, stage.follow, numbers)
        return Continuation(system, x, _settings(config, number, system.parameter(x, stage.follow)))
    except ValueError as error:
        raise ConfigError(f"start, finish: {error}") from error
    except ContinError as error:
        raise ConfigError(f"numbers: no state was found near the one before ({error}); follow them in a stage") from error


def _switched(config: OpenConfig, number: int, origin: Point, changed: bool) -> tuple[Settings, np.ndarray]:
    """Return the settings and the first tangent of a stage that leaves a branch point.

    Raises
    ------
    ConfigError
        No single branch leaves it, or not in this stage.
    """
    stage = config.stages[number - 1]
    if not isinstance(origin.details, BranchPoint):
        raise ConfigError(
            f"start_at: {stage.start_at!r}: {origin.nullity} modes are neutral there, and no single branch leaves it; a phase "
            "or an imperfection tells the modes apart"
        )
    if changed:
        raise ConfigError(f"start_at: {stage.start_at!r}: a branch point is left with the ends and the numbers that led to it")
    if origin.system.free[0] != stage.follow:
        raise ConfigError(
            f"follow: {stage.follow!r}: a branch point is left with the number that led to it, {origin.system.free[0]}"
        )
    way = 1 if stage.way == "forward" else -1
    settings = dataclasses.replace(_settings(config, number, origin[stage.follow]), direction=way)
    return settings, way * origin.details.tangents[1]


def _settings(config: OpenConfig, number: int, here: float) -> Settings:
    """Return the settings of a stage that starts where its number has the value ``here``."""
    stage, steps = config.stages[number - 1], config.steps
    to = stage.to / config.factor(stage.follow)
    reach = abs(to - here) or 1.0
    limits = {stage.follow: (min(to, here - reach), max(to, here + reach))}
    limits |= {name: tuple(end / config.factor(name) for end in ends) for name, ends in stage.limits.items()}
    zeros = {name: [value / config.factor(name) for value in values] for name, values in stage.label.items()}
    return Settings(
        primary=stage.follow, direction=int(np.sign(to - here)) or 1, step=steps.first_step, min_step=steps.smallest,
        max_step=steps.largest, max_points=stage.max_points or steps.max_points, angle=steps.angle, limits=limits, zeros=zeros,
        mesh=_mesh_control(config), test_functions=config.strip(number).domain_tests(),
    )  # fmt: skip
