"""Run the stages of an open strip, one after the other, into one result file.

A stage starts from a labelled point of an earlier one, by default from its end. An interrupted run goes on from its last point:
the file keeps the state of its stage, and the labelled points of all stages with everything that a later stage needs of them.
"""

from __future__ import annotations

import contextlib
import dataclasses
import functools
import itertools
import math
import tempfile
import time
from pathlib import Path

import numpy as np

from branches.advice import no_state, reached
from branches.config import ConfigError, dump
from branches.job import Interruption, is_done, writing
from branches.labels import without_round_off
from branches.layout import OPEN
from branches.open_config import MEANINGS, OpenConfig, StageConfig
from branches.open_errors import errors_of
from branches.store import BranchWriter, Kind, read_kept, read_state
from contin import Branch, ContinError, ConvergenceError, MeshControl, Point, ProblemError, Reason, Settings, load, save
from contin.lowlevel import Collocation, Continuation, Stop, exact_text, point_of  # fmt: skip
from ribbon_model.changed_ends import with_ends
from ribbon_model.ends import ANGLES, angles_of
from ribbon_model.open_strip import REACTIONS, OpenStrip

#: A stage may start outside its limits by this part of them: it may start where another one has stopped. Points at limits are
#: located to 1e-12; ten times larger, starts that are outside by that are taken for starts at the limit.
_SLACK = 1e-9
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
    run, labelled, image = _resumed(config, path) if resume else (_run(config, 1, first_state(config)), [[]], None)
    with contextlib.closing(writer_of(config, path, image)) as writer:
        display.begin_stages(config, writer.count, len(writer.events()))
        outcome, stop = _followed(config, (run, labelled), writer, display)
        display.stages_summary(config, writer.events(), writer.count, time.perf_counter() - began, path, (outcome, stop))
        for note in writer.notes:
            display.note(note)
    return outcome


def compute_stages(config: OpenConfig, display) -> tuple[bytes, str]:
    """Return the image of the result file of a scene that is followed in memory, and the reason of a failure or ''.

    Raises
    ------
    ConfigError
    """
    begun = _run(config, 1, first_state(config)), [[]]
    with contextlib.closing(writer_of(config, None)) as writer:
        outcome, stop = _followed(config, begun, writer, display)
        return writer.image(), "" if outcome == "complete" else str(stop or outcome)


def _resumed(config: OpenConfig, path: Path) -> tuple[Continuation, list[list[Point]], bytes | None]:
    """Return the run that continues the file, the labelled points so far by stage, and the image of the file."""
    rows, kept = read_kept(path)
    if not len(rows):  # it was interrupted before its first step
        return _run(config, 1, first_state(config)), [[]], None
    number, labelled = int(rows["stage"][-1]), []
    for stage in range(1, number + 1):
        count = np.count_nonzero((rows["stage"] == stage) & (rows["label"] != b""))
        labelled.append(_points(config.strip(stage).problem, kept[f"stage {stage}"])[:count])
    strip, stage = config.strip(number), config.stages[number - 1]
    state, start, _, image = read_state(path, strip.problem, (stage.follow, *strip.problem.multipliers))
    run = Continuation(state.system, state.x, _settings(config, number, *start[:2]), state=state, start=start)
    return run, labelled, image


def _image(points: list[Point]) -> bytes:
    """Return labelled points of a stage as a file of `contin.save`."""
    with tempfile.TemporaryDirectory() as folder:
        save(Branch(points), Path(folder, "points.npz"))
        return Path(folder, "points.npz").read_bytes()


def _points(problem, image: bytes) -> list[Point]:
    """Return the points of an `_image`."""
    with tempfile.TemporaryDirectory() as folder:
        Path(folder, "points.npz").write_bytes(image)
        return load(problem, Path(folder, "points.npz")).points


def writer_of(config: OpenConfig, path: Path | None, image: bytes | None = None) -> BranchWriter:
    """Return the writer of the result file; ``image`` is that of an unfinished one."""
    meaning = {
        name: f"{_WORDS[name.removeprefix('start_')[0]]} on the strip at its {'first' if name[0] == 's' else 'last'} end, "
        f"along the {name.rpartition('_')[2]} of the first one" for name in REACTIONS
    }  # fmt: skip
    columns = (("stage", "i4", MEANINGS["stage"]), ("potential", "f8", MEANINGS["potential"]))
    columns += tuple((name, "f8", text) for name, text in meaning.items())
    columns += (("F_roller", "f8", "force of the roller on the strip"),) if config.roller else ()
    length = "1" if config.dimensions is None else f"1 ({exact_text(config.dimensions.length)} m)"
    modulus = "1" if config.dimensions is None else f"1 ({config.modulus:.12g} N m^2)"
    table = Table.of(config)
    row, units = _Row(config, table), f"bending modulus B = {modulus}, length L = {length}"
    uncertain = (*table.functionals, "potential", *REACTIONS, *(("F_roller",) if config.roller else ()))
    kind = Kind(OPEN, units, columns, row, uncertain, row.errors)
    followed = list(dict.fromkeys(stage.follow for stage in config.stages))
    return BranchWriter(path, dump(config), table, followed, config.stride, image, Watch(config.strip()), kind)


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

    def errors(self, point: Point) -> dict[str, float]:
        """Return the errors of forces, moments, energies and places at a labelled point."""
        return errors_of(point, self._found)

    def _found(self, point: Point) -> dict[str, float]:
        """Return the columns that are found, not prescribed."""
        strip = self._config.strip(self.stage)
        reactions = strip.reactions_of(point.system.states(point.x))
        return {**point.functionals, "potential": strip.potential(point), **reactions}


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
        guess, values, intervals = guesses[config.begin](), None, mesh.intervals
        if strip.roller is not None:
            intervals = strip.roller.intervals(mesh.intervals)
            if guess is not None and "roller" not in config.numbers:  # it touches the strip where it is
                values = {"roller": float(np.dot(guess(strip.roller.at)[4:7], strip.roller.direction))}
        return strip.first_point(guess, values, intervals, mesh.degree, mesh=_mesh_control(config))
    except (ProblemError, ValueError) as error:
        raise ConfigError(f"begin: {config.begin}: {error}") from error


def _mesh_control(config: OpenConfig) -> MeshControl:
    mesh = config.mesh
    every = 0 if config.roller else mesh.adapt_every  # a mesh point stays at the roller
    return MeshControl(mesh.tolerance, min(8, mesh.max_intervals), mesh.max_intervals, every)


def _followed(config: OpenConfig, begun, writer: BranchWriter, display) -> tuple[str, Stop | None]:
    """Follow a stage that has begun (its run, and the labelled points so far by stage), and all later ones.

    Returns
    -------
    outcome, stop
        The outcome, and the reason why the last stage stopped.
    """
    run, labelled = begun
    writer.kept = _Kept(labelled)
    with Interruption() as interruption:
        for number in range(len(labelled), len(config.stages) + 1):
            if number > len(labelled):
                try:
                    run = _run(config, number, _origin(config.stages[number - 1], labelled))
                except ConfigError as error:
                    stop = Stop("scene", f"stage {number}: {error}")
                    writer.checkpoint(run.start, "lost", stop)
                    return "lost", stop
                labelled.append([])
            ended = _through(config, run, labelled, writer, (display, interruption))
            if ended is not None:
                return ended
        writer.checkpoint(run.start, "complete", run.stop)
    return "complete", run.stop


class _Kept:
    """The labelled points of all stages as the file keeps them for a resumed run; made anew where there are more."""

    def __init__(self, labelled: list[list[Point]]):
        self._labelled = labelled
        self._images: dict[tuple[int, int], bytes] = {}

    def __call__(self) -> dict[str, bytes]:
        keys = [(number, len(points)) for number, points in enumerate(self._labelled, 1) if points]
        self._images = {key: self._images.get(key) or _image(self._labelled[key[0] - 1]) for key in keys}
        return {f"stage {number}": self._images[number, count] for number, count in keys}


def _through(config: OpenConfig, run: Continuation, labelled, writer: BranchWriter, others) -> tuple[str, Stop | None] | None:
    """Follow the last of the stages that have begun; return outcome and reason if that ends the run, otherwise None."""
    (display, interruption), number = others, len(labelled)
    writer.kind.values.stage = number
    display.stage(config, number)
    for point in (_named(config, point) for point in run):
        display.stage_point(config, config.stages[number - 1], point, writer.count)
        writer.append(point)
        writer.note(_notes(config, number, run))
        labelled[-1] += [point] if point.label else []
        if point.label and point.name != "start":
            continue  # inside a step: a run cannot be resumed from here
        if run.state.system.scales.are_one:  # states with scales are not stored; such a stage begins again
            writer.mark(run.state)
        if interruption.asked:
            writer.checkpoint(run.start, "interrupted")
            return "interrupted", None
        if writer.due():
            writer.checkpoint(run.start, "running")
    writer.flush()
    writer.note(_notes(config, number, run))
    stop = _told(config, number, run, labelled[-1][-1])
    if stop.reason in (Reason.NO_CONVERGENCE, Reason.EVENT):
        stop = dataclasses.replace(stop, message=f"stage {number}: {stop.message}")
        writer.checkpoint(run.start, "lost", stop)
        return "lost", stop
    run.stop = stop
    return None


def _told(config: OpenConfig, number: int, run: Continuation, last: Point) -> Stop:
    """Return why a stage ended, in the fields and units of the scene."""
    name = config.stages[number - 1].follow
    law = config.strip(number).explained(run) if run.stop.reason in (Reason.NO_CONVERGENCE, Reason.EVENT) else None
    if law is not None:
        return Stop(run.stop.reason, law)
    if run.stop.reason == Reason.NO_CONVERGENCE:
        here = run.state.system.parameter(run.state.x, name)
        here = without_round_off(here, max(map(abs, run.settings.limits[name])))
        return no_state(run, _shown(config, name, here))
    return reached(run.stop, last, run, functools.partial(_shown, config))


def _notes(config: OpenConfig, number: int, run: Continuation) -> list[str]:
    """Return the notes of a stage so far."""
    units = " (numbers in units of L and B)" if config.dimensions is not None else ""
    return [f"stage {number}: {note}{units}" for note in run.notes]


def _shown(config: OpenConfig, name: str, value: float) -> str:
    """Return a number as a scene states it, with its unit."""
    return f"{name} = {value * config.factor(name):.10g} {config.unit(name)}".rstrip()


def _named(config: OpenConfig, point: Point) -> Point:
    """Return a point at a value of a column with the value in the units of the scene."""
    name, equals, _ = point.name.partition(" = ")
    if not equals or config.dimensions is None or name not in (*point.parameters, *point.functionals):
        return point
    return dataclasses.replace(point, name=f"{name} = {point[name] * config.factor(name):.6g} {config.unit(name)}".rstrip())


def _origin(stage: StageConfig, labelled: list[list[Point]]) -> Point:
    """Return the labelled point from which a stage starts.

    Raises
    ------
    ConfigError
        There is none.
    """
    source = stage.stage or len(labelled)
    points = labelled[source - 1]
    place = stage.place_among([(point.label, point.name) for point in points])
    if place is None:
        there = ", ".join(point.label for point in points)
        raise ConfigError(f"start_at: {stage.start_at!r} is not among the points of stage {source}: {there}")
    return points[place]


def _run(config: OpenConfig, number: int, origin: Point) -> Continuation:
    """Return the run of a stage.

    Raises
    ------
    ConfigError
        The stage starts outside its limits, or not from this point.
    """
    try:
        run = _begun(config, number, origin)
    except ConvergenceError as error:
        followed = config.stages[number - 1].follow
        raise ConfigError(
            f"follow: {followed!r}: the state at the start of the stage was not found again with this number free; follow "
            "another one first, or refine the mesh (mesh.intervals, mesh.tolerance)"
        ) from error
    start = point_of(run.state.system, run.state.x)
    for name, (low, high) in run.settings.limits.items():
        slack = _SLACK * max(abs(low), abs(high), high - low)
        if not low - slack <= start[name] <= high + slack:
            here, *ends = (f"{config.factor(name) * value:.10g}" for value in (start[name], low, high))
            words, unit = " to ".join(ends), f" {config.unit(name)}".rstrip()
            first = "stage 1: " if number == 1 else ""  # later ones are named by the caller
            where = f"limits: {name} = {here}{unit} at the start of the stage is outside its limits, {words}{unit}"
            raise ConfigError(f"{first}{where}; widen them, or start at another point")
    return run


def _begun(config: OpenConfig, number: int, origin: Point) -> Continuation:
    """Return the run of a stage from a point."""
    stage, strip = config.stages[number - 1], config.strip(number)
    changed = origin.system.problem is not strip.problem or bool(stage.numbers)
    if stage.start_at is not None and stage.start_at.startswith("BP"):
        return Continuation(origin.system, origin.x, *_switched(config, number, origin, changed))
    if not changed:
        system, x = origin.system.with_free((stage.follow, *strip.problem.multipliers), origin.x)
        return Continuation(system, x, _settings(config, number, system, x))
    numbers = {name: value / config.factor(name) for name, value in stage.numbers.items()}
    try:
        system, x = with_ends(strip, origin, stage.follow, numbers)
        return Continuation(system, x, _settings(config, number, system, x))
    except ValueError as error:
        raise ConfigError(f"start, finish: {error}") from error
    except ConvergenceError as error:
        given = ", ".join(f"{name} = {exact_text(value)}" for name, value in stage.numbers.items())
        where = f"near the one before{f' with {given}' if given else ' with these ends'}"
        raise ConfigError(f"numbers: no state was found {where}; follow the changes in stages") from error
    except ContinError as error:
        raise ConfigError(f"numbers: {error}") from error


def _switched(config: OpenConfig, number: int, origin: Point, changed: bool) -> tuple[Settings, np.ndarray]:
    """Return the settings and the first tangent of a stage that leaves a branch point.

    Raises
    ------
    ConfigError
        No single branch leaves it, or not in this stage.
    """
    stage = config.stages[number - 1]
    if not origin.is_simple_branch_point:
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
    settings = dataclasses.replace(_settings(config, number, origin.system, origin.x), direction=way)
    return settings, way * origin.details.tangents[1]


def _settings(config: OpenConfig, number: int, system: Collocation, x: np.ndarray) -> Settings:
    """Return the settings of a stage that starts at a state."""
    stage, steps = config.stages[number - 1], config.steps
    here = system.parameter(x, stage.follow)
    to = stage.to / config.factor(stage.follow)
    reach = abs(to - here) or 1.0
    limits = {stage.follow: (min(to, here - reach), max(to, here + reach))}
    limits |= {name: tuple(end / config.factor(name) for end in ends) for name, ends in stage.limits.items()}
    zeros = {name: [value / config.factor(name) for value in values] for name, values in stage.label.items()}
    return Settings(
        primary=stage.follow, direction=int(np.sign(to - here)) or 1, step=steps.first_step, min_step=steps.smallest,
        max_step=steps.largest, max_points=stage.max_points or steps.max_points, angle=steps.angle, limits=limits, zeros=zeros,
        mesh=_mesh_control(config), events=config.strip(number).domain_tests(),
        scales=config.strip(number).sizes(system, x),
    )  # fmt: skip
