"""Run one scene and write its result file."""

from __future__ import annotations

import contextlib
import dataclasses
import signal
import time
from collections.abc import Iterator
from pathlib import Path

import numpy as np

from branches.config import Config, ConfigError, difference, dump, parse
from branches.ends import checked
from branches.files import StoreError, only_run, prepare
from branches.start import UntilPrimary, seed, settings_of
from branches.store import BranchWriter, open_branch, read_state
from contin import Reason
from contin.lowlevel import Continuation, Stop, exact_text
from ribbon_model import convexity
from ribbon_model.laws import LAWS

#: Fields that a resumed run may change: limits and labels, but no field that changes the points.
_CHANGEABLE = ("title", "limits", "zeros", "stride", "steps.max_points")


def run_branch(config: Config, path: Path, display, *, resume=False, overwrite=False) -> str:
    """Follow the branch of ``config`` into the file ``path``, telling ``display`` about it.

    Returns
    -------
    str
        "complete", "interrupted" (Ctrl-C or SIGTERM; the file can be resumed), or "lost" (Newton failed).

    Raises
    ------
    StoreError, ConfigError
        A result file that cannot be written, that another run is writing, or that belongs to another scene.
    """
    with writing(Path(path), display, resume) as resume:
        return _run_branch(config, Path(path), display, resume, overwrite)


@contextlib.contextmanager
def writing(path: Path, display, resume: bool) -> Iterator[bool]:
    """Make the folder of a result file and lock the file for this run; the value is whether there is a run to resume.

    Raises
    ------
    StoreError
        The file cannot be written, or another run is writing it.
    """
    if not path.exists():
        if resume:
            display.note(f"--resume: there is no file {str(path)!r}; the run starts from the beginning")
            resume = False
        prepare(path)  # makes its folder, which will contain the lock file
    with only_run(path):
        yield resume


def whole_branch(config: Config, path: Path, display) -> None:
    """Follow the branch of ``config`` into the file ``path``; an interrupted run raises KeyboardInterrupt.

    Raises
    ------
    KeyboardInterrupt
        The run was interrupted; the file holds the points before.
    StoreError, ConfigError
        See `run_branch`.
    """
    if run_branch(config, path, display, overwrite=True) == "interrupted":
        raise KeyboardInterrupt


def is_done(path: Path, config: Config, display, resume: bool, overwrite: bool) -> bool:
    """Return whether the file is complete already, and say so; if not, prepare it.

    Raises
    ------
    StoreError, ConfigError
        It may not be replaced or resumed.
    """
    done = _look_at(path, config, resume, overwrite)
    if done is None:
        prepare(path)
        return False
    display.note(f"{path} is complete already ({done}); nothing to do")
    return True


def _run_branch(config: Config, path: Path, display, resume: bool, overwrite: bool) -> str:
    began = time.perf_counter()
    if is_done(path, config, display, resume, overwrite):
        return "complete"
    (run, watch), image = _resumed(config, path) if resume else (begun(config), None)
    with contextlib.closing(_writer(path, config, run, watch, image)) as writer:
        display.begin(config, writer.count, len(writer.events()))
        outcome = _follow(config, run, writer, display, Interruption())
        seconds = time.perf_counter() - began
        display.summary(config, writer.events(), writer.count, seconds, path, outcome, _shown(run.stop))
        for note in writer.notes:
            display.note(note)
    return outcome


def _shown(stop: Stop | None) -> Stop | None:
    """Return why a run ended as people are told: a limit is one that the scene sets, not one of the strip."""
    if stop is None or stop.reason != Reason.LIMIT:
        return stop
    return dataclasses.replace(stop, message=f"{stop.message}, the scene's own limit")


@dataclasses.dataclass(frozen=True)
class Computed:
    """A branch that was computed in memory; ``image`` is that of its file, the rest as in `branches.read.StoredBranch`."""

    image: bytes
    status: str
    stop: str
    reason: str
    config: dict
    points: np.ndarray
    events: np.ndarray

    def __repr__(self) -> str:
        return f"Computed({len(self.points)} points, {len(self.events)} of them labelled, {self.status}; {self.stop})"


def compute_branch(config: Config, display) -> Computed:
    """Return the branch of ``config``; no file is written.

    Ctrl-C is not caught here: the points so far would be lost with the memory.
    """
    run, watch = begun(config)
    with contextlib.closing(_writer(None, config, run, watch)) as writer:
        outcome = _follow(config, run, writer, display, Interruption(()))
        stop = str(run.stop.reason) if run.stop else ""
        tables = writer.points(), writer.events()
        return Computed(writer.image(), outcome, str(run.stop or ""), stop, config.model_dump(), *tables)


def _writer(path, config: Config, run: Continuation, watch, image=None) -> BranchWriter:
    system = run.state.system
    return BranchWriter(path, dump(config), system.problem, system.free, config.stride, image, watch)


def _watch(config: Config, system, x):
    """Return the object that computes the index along the branch, or None without ``stability``."""
    if not config.stability:
        return None
    from branches.stability import Watch

    return Watch(LAWS[config.law], system, x, from_circle=config.origin is None)


def _kind(config: Config) -> type[Continuation]:
    """Return the class of the run."""
    return Continuation if config.origin is None else UntilPrimary


def _test_functions(config: Config, watch) -> list:
    """Return the test functions of the index, if it is computed, and of the end of the law, if it has one."""
    return [*(watch.monitors if watch else ()), *convexity.test_functions(LAWS[config.law])]


def begun(config: Config):
    """Return the run from the branch's first point, and its watch; the caller passes its points to `branches.ends.checked`."""
    system, x, tangent = seed(config)
    watch = _watch(config, system, x)
    return _kind(config)(system, x, settings_of(config, _test_functions(config, watch)), tangent), watch


def _resumed(config: Config, path: Path):
    """Return the run that continues the file, with its watch, and the image of the file."""
    system, x, _ = seed(config)
    watch = _watch(config, system, x)
    state, start, last, image = read_state(path, system.problem, system.free)
    if state.accepted >= config.steps.max_points:
        raise ConfigError(f"steps.max_points: {config.steps.max_points} must exceed the {state.accepted} points taken already")
    for name, (low, high) in config.limits.items():
        if state.accepted and not low < last[name] < high:
            raise ConfigError(
                f"limits: {name}: {exact_text(low)}, {exact_text(high)} must contain the last point of the file, "
                f"{name} = {last[name]:.10g}"
            )
    settings = settings_of(config, _test_functions(config, watch))
    return (_kind(config)(state.system, state.x, settings, state=state, start=start), watch), image


def _follow(config: Config, run: Continuation, writer: BranchWriter, display, interruption: Interruption) -> str:
    """Write all points of a run to the file; return the outcome."""
    with interruption:
        for point in run:
            point, number = checked(point, run, config), writer.count
            writer.append(point)
            writer.note(run.notes)
            display.point(point, number, run.state.step)
            if point.label and point.name != "start":
                continue  # inside a step: a run cannot be resumed from here
            writer.mark(run.state)
            if interruption.asked:
                writer.checkpoint(run.start, "interrupted")
                return "interrupted"
            if writer.due():
                writer.checkpoint(run.start, "running")
        writer.note(run.notes)
        outcome = "lost" if run.stop.reason == Reason.NO_CONVERGENCE else "complete"
        writer.checkpoint(run.start, outcome, run.stop)
    return outcome


def _look_at(path: Path, config: Config, resume: bool, overwrite: bool) -> str | None:
    """Raise unless the file at ``path`` may be replaced or resumed; return its reason to stop if it is complete."""
    if not path.exists() or (overwrite and not resume):
        return None
    try:
        with open_branch(path) as file:
            status, stop, reason, text = (file.attrs[name] for name in ("status", "stop", "stop_reason", "config"))
        stored = parse(text, str(path))
    except (StoreError, ConfigError) as error:
        if resume:
            raise
        raise StoreError(
            f"{str(path)!r} exists and is not a readable result of this program; --overwrite replaces it"
        ) from error
    further = len(getattr(config, "stages", ())) > len(getattr(stored, "stages", ()))
    same = config.model_copy(update={"stages": config.stages[: len(stored.stages)]}) if resume and further else config
    different = difference(stored, same, _CHANGEABLE if resume else ())
    if different:
        advice = "resume with the same config" if resume else "--overwrite replaces it, --out writes elsewhere"
        raise StoreError(f"{str(path)!r} holds another scene ({different}); {advice}")
    if not resume:
        if status in ("running", "interrupted"):
            raise StoreError(
                f"{str(path)!r} holds an unfinished run of this scene; --resume continues it, --overwrite starts again"
            )
        return None
    goes_on = further or (reason in ("limit", "max points") and stored != config)
    return stop if status == "complete" and not goes_on else None


class Interruption:
    """Stop the run after the current point on Ctrl-C, SIGTERM or a closed terminal; on the second signal, at once."""

    _SIGNALS = [getattr(signal, name) for name in ("SIGINT", "SIGTERM", "SIGHUP") if hasattr(signal, name)]

    def __init__(self, signals=_SIGNALS):
        self.asked, self._signals = False, signals
        self._before = {}

    def __enter__(self):
        for number in self._signals:
            if signal.getsignal(number) is signal.SIG_IGN:  # nohup, or a job in the background: it stays ignored
                continue
            try:
                self._before[number] = signal.signal(number, self._ask)
            except ValueError:  # signals reach the main thread only
                break
        return self

    def _ask(self, number, frame):
        if self.asked:
            raise KeyboardInterrupt
        self.asked = True

    def __exit__(self, *exception):
        for number, handler in self._before.items():
            signal.signal(number, handler)
