"""One scene from config to file: the run between the command line and the engine."""

from __future__ import annotations

import signal
import time
from pathlib import Path

import yaml

from branches.config import Config, ConfigError, parse
from branches.store import BranchWriter, StoreError, open_branch, read_state
from contin import Branch, Continuation, MeshControl, Settings
from ribbon_model.laws import LAWS
from ribbon_model.seeds import half_loop_branch, primary_branch

#: Fields that a resumed run may change: where to stop and what to label, nothing that alters the points.
_CHANGEABLE = ("title", "limits", "zeros", "stride")


def settings_of(config: Config) -> Settings:
    """The engine's settings for a scene."""
    mesh, steps = config.mesh, config.steps
    return Settings(
        primary="kappa_n", step=steps.first, min_step=steps.smallest, max_step=steps.largest, max_points=steps.max_points,
        angle=steps.angle, limits=config.limits, zeros=config.zeros, trivial="M2", errors=True,
        mesh=MeshControl(mesh.tolerance, min(8, mesh.max_intervals), mesh.max_intervals, mesh.adapt_every),
    )  # fmt: skip


def seed(config: Config):
    """System, first point and tangent of a scene's branch."""
    start = primary_branch if config.domain == "cell" else half_loop_branch
    return start(LAWS[config.law], config.m, config.n, config.nu, config.mesh.intervals, config.mesh.degree)


def run_branch(config: Config, path: Path, display, *, resume=False, overwrite=False) -> str:
    """Follow the branch of ``config`` into the file ``path``, telling ``display`` about it.

    Returns
    -------
    str
        "complete", "interrupted" (Ctrl-C or SIGTERM; the file can be resumed), or "lost" (Newton failed).

    Raises
    ------
    StoreError, ConfigError
        A result file that cannot be written, or that is not this scene's.
    """
    began = time.perf_counter()
    text = yaml.safe_dump(config.model_dump(mode="json", exclude_defaults=True), sort_keys=False)
    done = _look_at(path, config, resume, overwrite)
    if done is not None:
        display.note(f"{path} is complete already ({done}); nothing to do")
        return "complete"
    system, x, tangent = seed(config)
    image = None
    run = Continuation(system, x, settings_of(config), tangent)
    if resume:
        state, start, image = read_state(path, system.problem, system.free)
        run = Continuation(state.system, state.x, settings_of(config), state=state, start=start)
    writer = BranchWriter(path, text, system.problem, system.free, config.stride, image)
    display.begin(config, run, writer.count)
    branch, interrupted = Branch(), False
    with _Interruption() as interruption:
        for point in run:
            number = writer.count
            writer.append(point)
            display.point(point, number, run.state.step)
            if point.label:
                branch.points.append(point)
            if not point.label and (interruption.asked or writer.due()):
                writer.checkpoint(run.state, run.start)
            if not point.label and interruption.asked:
                interrupted = True
                break
        outcome = "interrupted" if interrupted else ("lost" if run.stop.reason == "no convergence" else "complete")
        writer.checkpoint(run.state, run.start, run.stop, outcome)
    writer.close()
    branch.stop = run.stop
    display.summary(config, branch, writer.count, time.perf_counter() - began, path, outcome)
    return outcome


def _look_at(path: Path, config: Config, resume: bool, overwrite: bool) -> str | None:
    """Whether what lies at ``path`` may be replaced or resumed; the stop of a run that needs no resuming."""
    if not path.exists():
        if resume:
            raise StoreError(f"--resume: there is no file {str(path)!r}")
        return None
    if overwrite and not resume:
        return None
    try:
        with open_branch(path) as file:
            status, stop, text = file.attrs["status"], file.attrs["stop"], file.attrs["config"]
            reason = file.attrs["stop_reason"]
    except StoreError as error:
        if resume:
            raise
        raise StoreError(f"{str(path)!r} exists and is no result of this program; --overwrite replaces it") from error
    stored = parse(text, str(path))
    different = _different(stored, config, resume)
    if different:
        advice = "resume with the same config" if resume else "--overwrite replaces it, --out writes elsewhere"
        raise StoreError(f"{str(path)!r} holds another scene ({different}); {advice}")
    if not resume:
        if status != "complete":
            raise StoreError(f"{str(path)!r} holds an unfinished run of this scene; --resume goes on, --overwrite starts again")
        return None
    goes_on = reason in ("limit", "max points") and stored != config
    return stop if status == "complete" and not goes_on else None


def _different(stored: Config, config: Config, resume: bool) -> str:
    """The first field in which two scenes differ, among those that matter."""
    a, b = stored.model_dump(), config.model_dump()
    if resume:
        a["steps"].pop("max_points"), b["steps"].pop("max_points")
    for name in a:
        if a[name] != b[name] and not (resume and name in _CHANGEABLE):
            return f"{name} = {a[name]!r} there, {b[name]!r} here"
    return ""


class _Interruption:
    """Ctrl-C and SIGTERM ask the run to stop after the current point; a second one stops it at once."""

    def __init__(self):
        self.asked = False
        self._before = {}

    def __enter__(self):
        for number in (signal.SIGINT, signal.SIGTERM):
            try:
                self._before[number] = signal.signal(number, self._ask)
            except ValueError:  # not in the main thread: nothing to catch there
                break
        return self

    def _ask(self, number, frame):
        if self.asked:
            raise KeyboardInterrupt
        self.asked = True

    def __exit__(self, *exception):
        for number, handler in self._before.items():
            signal.signal(number, handler)


__all__ = ["ConfigError", "run_branch", "seed", "settings_of"]
