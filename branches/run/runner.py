"""Run one scene: its stages one after the other, into one result file.

A stage starts from its first state or from a labelled point of an earlier one. An interrupted run goes on from its last point:
the file keeps the state of its stage, and the labelled points of the stages before with everything that a later stage needs.
"""

from __future__ import annotations

import _thread
import contextlib
import dataclasses
import signal
import tempfile
import threading
import time
from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from branches.run.blas import one_thread
from branches.run.display import Display
from branches.scene.fields import ConfigError, Scene
from branches.scene.labels import START
from branches.scene.parse import difference, parse
from branches.scene.stage import Stage
from branches.scene.stages import stages_of
from branches.store import interrupt
from branches.store.files import StoreError, only_run, prepare
from branches.store.writer import BranchWriter, open_branch, read_kept, read_state
from contin import Point, Reason
from contin.lowlevel import Continuation, Stop

if TYPE_CHECKING:
    from branches.store.branch import StoredBranch


def run_scene(scene: Scene, path: str | Path, display: Display, *, resume: bool = False, overwrite: bool = False) -> str:
    """Follow the stages of ``scene`` into the file ``path``, telling ``display`` about it.

    Returns
    -------
    str
        "complete", "interrupted" (Ctrl-C or SIGTERM; the file can be resumed), or "lost" (no further state was found).

    Raises
    ------
    StoreError, ConfigError
        A result file that cannot be written, that another run is writing, or that belongs to another scene.
    """
    path = Path(path)
    with _writing(path, display, resume) as resume:
        began, done = time.perf_counter(), _look_at(path, scene, resume, overwrite)
        if done is not None:
            display.note(f"{path} is complete already ({done}); nothing to do")
            return "complete"
        prepare(path)
        with one_thread():
            begun = _begun(scene, path if resume else None)
            outcome, stop, writer = _followed(begun, path, display, Interruption())
        with contextlib.closing(writer):
            display.summary(begun.stages, writer.rows["events"], writer.count, time.perf_counter() - began, path, outcome, stop)
            for note in writer.notes:
                display.note(note)
    return outcome


@dataclasses.dataclass(frozen=True, eq=False, repr=False)
class Computed:
    """A branch that was computed in memory; ``image`` is that of its file, the rest as in `branches.read.StoredBranch`."""

    image: bytes
    status: str
    stop: str
    reason: str
    scene: Scene
    points: np.ndarray
    events: np.ndarray
    notes: list[str]

    def branch(self) -> StoredBranch:
        """Return the branch without its solutions, as its file gives it."""
        from branches.store.read import class_of  # 6 ms, which a run to a file does not need

        ended, none = (self.status, self.stop, self.reason), np.empty(0)  # without solutions
        return class_of(self.scene)(self.scene, *ended, self.points, self.events, none, none, none, tuple(self.notes))

    def __repr__(self) -> str:
        return f"Computed({len(self.points)} points, {len(self.events)} of them labelled, {self.status}; {self.stop})"


def compute_scene(scene: Scene, display: Display) -> Computed:
    """Return the branch of ``scene``; no file is written. Ctrl-C is not caught here: the points so far would be lost."""
    with one_thread():
        outcome, stop, writer = _followed(_begun(scene, None), None, display, Interruption(()))
    with contextlib.closing(writer):
        reason = str(stop.reason) if stop else ""
        return Computed(writer.image(), outcome, str(stop or ""), reason, scene, *writer.rows.values(), writer.notes)


@dataclasses.dataclass(eq=False, repr=False)
class _Begun:
    """A run that has begun: all stages, the run of the present one, labelled points by stage, image of an unfinished file."""

    stages: list[Stage]
    run: Continuation
    labelled: list[list[Point]]
    image: bytes | None = None


def _begun(scene: Scene, path: Path | None) -> _Begun:
    """Return the run of a scene from its first point, or the one that goes on with the unfinished file at ``path``."""
    stages = stages_of(scene)
    rows, kept = (np.empty(0), {}) if path is None else read_kept(path)
    if path is None or not len(rows):  # it was interrupted before its first step
        return _Begun(stages, stages[0].start(), [[]])
    numbers = rows["stage"] if "stage" in rows.dtype.names else np.ones(len(rows), int)
    labelled = []
    for number in range(1, int(numbers[-1]) + 1):
        count = np.count_nonzero((numbers == number) & (rows["label"] != b""))
        image = kept.get(f"stage {number}")
        labelled.append(_points(stages[number - 1].problem, image)[:count] if image else [])
    stage = stages[len(labelled) - 1]
    state, first, last, image = read_state(path, stage.problem, stage.free)
    most = scene.steps.max_points
    if len(stages) == 1 and state.accepted >= most:
        raise ConfigError(f"steps.max_points: {most} must exceed the {state.accepted} points taken already")
    if state.accepted and (outside := stage.outside({name: float(last[name]) for name in rows.dtype.names if name != "label"})):
        raise ConfigError(outside)
    return _Begun(stages, stage.resume(state, first, labelled), labelled, image)


def _followed(begun: _Begun, path: Path | None, display: Display, interruption: Interruption):
    """Follow the stages of a run into a file; return the outcome, the reason to stop, and the writer."""
    stages, run, labelled = begun.stages, begun.run, begun.labelled
    writer = BranchWriter(path, stages[0], begun.image)
    if stages[0].starts_others:
        writer.kept = _Kept(labelled)
    outcome, stop = "complete", None
    display.begin(stages[0].scene, writer.count, len(writer.rows["events"]))
    with interruption:
        for stage in stages[len(labelled) - 1 :]:
            if stage.number > len(labelled):
                try:
                    run = stage.start(labelled)
                except ConfigError as error:
                    outcome, stop = "lost", Stop("scene", f"stage {stage.number}: {error}")
                    break
                labelled.append([])
            display.stage(stage)
            if not _through(stage, run, writer, labelled[-1], (display, interruption)):
                return "interrupted", None, writer
            stop = stage.told(run, labelled[-1][-1])
            writer.note(stage.notes(run))
            if stop.reason in stage.fails:
                outcome = "lost"
                break
            if stop.reason == Reason.EVENT:
                break  # the law ends here: what later stages start from is not reached
        writer.checkpoint(run.start, outcome, stop)
    return outcome, stop, writer


def _through(stage: Stage, run: Continuation, writer: BranchWriter, labelled: list[Point], others) -> bool:
    """Write the points of a stage, and add those that have a label to ``labelled``; return False if it was interrupted."""
    display, interruption = others
    for found in run:
        stop = run.stop
        point = stage.judge(found, run)
        if point is None:
            continue
        display.point(stage, point, writer.count, run.state.step)
        writer.append(point, stage)
        labelled += [point] if point.label else []
        if run.stop is not stop:
            break  # the stage ends here, which its run does not know
        regular = not point.label or point.name == START  # others lie inside a step, which a resumed run makes again
        if regular and run.state.system.scales.are_one:  # states with scales are not stored; such a stage begins again
            writer.mark(run.state)
        if run.stop is None and (interruption.asked or writer.due()):
            writer.note(stage.notes(run))
            writer.checkpoint(run.start, "interrupted" if interruption.asked else "running")
            interrupt.change(f"{writer.path} keeps the points of its last checkpoint; go on with --resume")
            if interruption.asked:
                return False
    writer.flush()
    return True


class _Kept:
    """The labelled points of all stages as the file keeps them for a resumed run; made anew where there are more."""

    def __init__(self, labelled: list[list[Point]]):
        self._labelled = labelled
        self._images: dict[tuple[int, int], bytes] = {}

    def __call__(self) -> dict[str, bytes]:
        keys = [(number, len(points)) for number, points in enumerate(self._labelled, 1) if points]
        self._images = {key: self._images.get(key) or _image(self._labelled[key[0] - 1]) for key in keys}
        return {f"stage {number}": self._images[number, count] for number, count in keys}


def _image(points: list[Point]) -> bytes:
    """Return labelled points of a stage as a file of `contin.save`."""
    from contin import Branch, save  # 30 ms, which runs of one stage do not need

    with tempfile.TemporaryDirectory() as folder:
        save(Branch(points), Path(folder, "points.npz"))
        return Path(folder, "points.npz").read_bytes()


def _points(problem, image: bytes) -> list[Point]:
    from contin import load

    with tempfile.TemporaryDirectory() as folder:
        Path(folder, "points.npz").write_bytes(image)
        return load(problem, Path(folder, "points.npz")).points


# --- the file ---------------------------------------------------------------------------------------------------------


@contextlib.contextmanager
def _writing(path: Path, display: Display, resume: bool) -> Iterator[bool]:
    """Lock a result file for a run, and yield whether there is a run to resume; raise StoreError where it cannot be written."""
    if not path.exists():
        if resume:
            display.note(f"--resume: there is no file {str(path)!r}; the run starts from the beginning")
            resume = False
        prepare(path)  # makes its folder, which will contain the lock file
    with only_run(path):
        yield resume


def _look_at(path: Path, scene: Scene, resume: bool, overwrite: bool) -> str | None:
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
    same = scene.up_to(stored.stage_count) if resume else scene
    if different := difference(stored, same, scene.CHANGEABLE if resume else ()):
        advice = "resume with the same config" if resume else "--overwrite replaces it, --out writes elsewhere"
        raise StoreError(f"{str(path)!r} holds another scene ({different}); {advice}")
    if not resume:
        if status in ("running", "interrupted"):
            raise StoreError(
                f"{str(path)!r} holds an unfinished run of this scene; --resume continues it, --overwrite starts again"
            )
        return None
    goes_on = same != scene or (reason in (Reason.LIMIT, Reason.MAX_POINTS) and stored != scene)
    return stop if status == "complete" and not goes_on else None


class Interruption:
    """Stop the run after the current point on Ctrl-C, SIGTERM or a closed terminal; on the second signal, at once.

    SIGTERM is its own second signal after `GRACE` seconds: whoever sends it kills what does not end soon.
    """

    #: Seconds. A point of a large network takes longer; the last checkpoint has the points up to half a second before.
    GRACE = 0.5
    _SIGNALS = [getattr(signal, name) for name in ("SIGINT", "SIGTERM", "SIGHUP") if hasattr(signal, name)]

    def __init__(self, signals=_SIGNALS):
        self.asked, self._signals = False, signals
        self._before = {}
        self._end = threading.Timer(self.GRACE, _thread.interrupt_main, [signal.SIGTERM])
        self._end.daemon = True

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
        if number == signal.SIGTERM:
            self._end.start()

    def __exit__(self, *exception):
        self._end.cancel()
        for number, handler in self._before.items():
            signal.signal(number, handler)
