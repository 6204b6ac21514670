"""Run a scene of many branches: in parallel, each to its own file, and all of them as one graph."""

from __future__ import annotations

import collections
import json
import time
from collections.abc import Callable, Mapping
from pathlib import Path
from types import ModuleType
from typing import Any

from branches.graph.kinds import graph_kind
from branches.graph.parts import add, counts
from branches.graph.stored import DIAGRAM, new_graph, read_any, save
from branches.run.display import Display
from branches.run.executor import WAIT, executor, run_jobs, trouble
from branches.run.runner import compute_scene
from branches.scene.fields import ConfigError, Scene
from branches.scene.parse import difference, dump, parse
from branches.scene.stages import stages_of
from branches.scene.sweep import Sweep
from branches.store.branch import MOST_ROWS
from branches.store.files import ANOTHER_DIAGRAM, StoreError, another_scene, only_run, prepare, write_bytes
from branches.store.read import read_branch

#: Places in the order of branches are multiples of this, modulo 1 (the golden ratio): the branches so far are a fair sample.
_SPREAD = (5**0.5 - 1) / 2


Job = tuple[str, str, dict[str, Any]]


def compute(job: Job) -> tuple[bytes, str, Any]:
    """Compute one branch, in any process: its file, its scene as text, and the values of what varies.

    Return the image of its file, the reason of a failure or '', and its part of the graph.
    """
    file, text, numbers = job
    found = compute_scene(parse(text, file), Display(silent=True))
    problem = "" if found.status == "complete" else found.stop or found.status
    return found.image, problem, graph_kind(found.scene).part(found.branch(), file, numbers)


class _Plan:
    """The order of the branches, in which none is computed twice from its two ends.

    A branch that another one may be from its other end follows that one and waits for it, and is left out if the other one ends
    at its start. Otherwise the order mixes long and short branches, so that the time left can be estimated from those so far.
    """

    def __init__(self, sweep: Sweep, missing: list[str], there: Callable[[Scene], bool]):
        scenes = sweep.scenes
        self._sweep, self._there = sweep, there
        self._later = {file: scene.other_end for file, scene in scenes.items() if scene.other_end in scenes}
        places = {file: number * _SPREAD % 1 for number, file in enumerate(scenes)}
        missing = sorted(missing, key=lambda file: (places[self._later.get(file, file)], file in self._later))
        self._open = collections.deque(missing)
        self.left_out: list[str] = []

    def next(self, running: list[Job]):
        """Return the job of the next branch, `WAIT`, or None."""
        waiting, found, busy = [], None, {job[0] for job in running}
        while self._open and found is None:
            file = self._open.popleft()
            other = self._later.get(file)
            if other in busy:
                waiting.append(file)
            elif other and self._there(self._sweep.scenes[file]):
                self.left_out.append(file)
            else:
                found = file
        self._open.extendleft(reversed(waiting))
        if found is None:
            return WAIT if waiting else None
        return found, dump(self._sweep.scenes[found]), self._sweep.numbers[found]


def run_many(
    sweep: Sweep, folder: Path, display: Display, *, scheduler=None, workers=None, time_limit=None, overwrite=False
) -> str:
    """Compute the branches of a scene that ``folder`` does not hold yet, and the graph of all.

    Return "complete", or "lost" if a branch failed or was lost on the way (the others are there). A branch in a process of this
    machine may take ``time_limit`` seconds. Raises StoreError where the folder cannot be written to, another run is writing to
    it, or it holds another scene and ``overwrite`` is not set; ExecutorError where the scheduler cannot be used.
    """
    began, folder = time.perf_counter(), Path(folder)
    kind = graph_kind(sweep)
    prepare(folder / DIAGRAM)
    with only_run(folder / DIAGRAM):
        parts = {} if overwrite else _kept(sweep, folder, kind)
        failed, left_out = _compute_missing(sweep, folder, display, executor(scheduler, workers, time_limit), (kind, parts))
        graph = new_graph(sweep.title, kind.FORMAT)
        for file in sweep.scenes:
            if file in parts:
                add(graph, parts[file])
        graph.graph.update({"config": dump(sweep), "failed": json.dumps(failed), "absent": json.dumps(sweep.absent)})
        save(graph, folder)
    branches, special = counts(graph, kind, sweep.title)
    told = [f"{branches} in {time.perf_counter() - began:.2f} s", f"  {special}", *_left_out(sweep, failed, left_out)]
    display.many_summary([*told, f"  written to {folder} (diagram.json, diagram.graphml, one file per branch)"])
    return "lost" if failed else "complete"


def _kept(sweep: Sweep, folder: Path, kind: ModuleType) -> dict[str, Any]:
    """Return the parts of complete branches in the folder by file; raise StoreError if one would be replaced or left out."""
    kept = {}
    for file, scene in _stored_scenes(sweep, folder).items():
        if file not in sweep.scenes:
            raise another_scene(folder, f"{file} is not a branch of this one")
        if differs := difference(scene, sweep.scenes[file]):
            raise another_scene(folder, f"{file}: {differs}")
    for file, scene in sweep.scenes.items():
        try:
            branch = read_branch(folder / file)
        except StoreError:  # there is none, or it cannot be read: it is computed
            continue
        if differs := difference(branch.scene, scene):
            raise another_scene(folder, f"{file}: {differs}")
        if branch.status == "complete":
            kept[file] = kind.part(branch, file, sweep.numbers[file])
    return kept


def _stored_scenes(sweep: Sweep, folder: Path) -> Mapping[str, Scene]:
    """Return the scenes of the branches of a folder's diagram by file; none if it has no diagram."""
    if not (folder / DIAGRAM).exists():
        return {}
    try:
        return parse(read_any(folder).graph["config"], DIAGRAM).scenes
    except (StoreError, ConfigError, KeyError) as error:
        raise StoreError(f"{str(folder)!r} holds a diagram that is not a result of branches.run; {ANOTHER_DIAGRAM}") from error


def _compute_missing(sweep: Sweep, folder: Path, display: Display, run, found) -> tuple[dict[str, str], int]:
    """Compute the missing branches and add their parts; return the reasons of failed ones by file, and the number left out."""
    kind, parts = found
    graph = new_graph("", kind.FORMAT)
    for part in parts.values():
        add(graph, part)
    fresh, kept = [file for file in sweep.scenes if file not in parts], len(parts)
    plan, failed = _Plan(sweep, fresh, lambda scene: kind.holds(graph, scene)), {}
    _load_kernels([sweep.scenes[file] for file in fresh])
    display.begin_many(sweep.title or kind.TITLE, len(sweep.scenes), kept)
    if fresh:
        with run as (submit, wait, limit):
            for done, ((file, *_), result) in enumerate(run_jobs(plan.next, compute, submit, limit, wait), 1):
                image, problem, part = (None, trouble(result), None) if isinstance(result, BaseException) else result
                if part is not None:
                    write_bytes(folder / file, image)
                    parts[file] = part
                    add(graph, part)
                if problem:
                    failed[file] = problem
                lines = [sweep.scenes[file].words(sweep.numbers[file])] if problem else part.words
                display.branch_done(lines, problem, kept + done + len(plan.left_out))
    return {file: failed[file] for file in sweep.scenes if file in failed}, len(plan.left_out)


def _left_out(sweep: Sweep, failed: dict[str, str], merged: int) -> list[str]:
    """Return the lines of the summary about what is not in the diagram as a branch of its own."""
    lines = [f"  {merged} duplicates (the same branches from their other ends) are merged"] if merged else []
    lines += [f"  left out: {name}: {reason}" for name, reason in list(sweep.absent.items())[:MOST_ROWS]]
    if len(sweep.absent) > MOST_ROWS:
        lines.append(f"  left out: {len(sweep.absent) - MOST_ROWS} more, which diagram.json names (absent)")
    return lines + [f"  failed: {name}: {reason}" for name, reason in failed.items()]


def _load_kernels(scenes: list[Scene]) -> None:
    """Load the compiled functions of the branches (or compile them), once for each law before processes are forked."""
    for scene in {scene.law_name: scene for scene in scenes}.values():
        try:
            run = stages_of(scene)[0].start()
            run.state.system.functionals(run.state.x)
        except ConfigError:  # its own run says so
            continue
