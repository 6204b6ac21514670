"""Run a scene of many open strips: in parallel, each combination to its own file, and all of them as one graph."""

from __future__ import annotations

import json
import time
from pathlib import Path

from branches import diagram_graph, open_graph
from branches.config import ConfigError, difference, dump, parse
from branches.display import Display
from branches.executor import executor, run_jobs, trouble
from branches.files import StoreError, another_scene, only_run, prepare, write_bytes
from branches.names import DIAGRAM
from branches.open_branch import OpenBranch
from branches.open_config import OpenConfig
from branches.open_job import compute_stages, first_state
from branches.read import read_branch
from branches.sweep_config import OpenSweep


def compute(job: tuple[str, str]) -> tuple[bytes, str]:
    """Compute one combination, in any process: its file and its scene as text.

    Returns
    -------
    image, problem
        The image of its file, and the reason of a failure or ''.
    """
    return compute_stages(parse(job[1], job[0]), Display(silent=True))


def run_sweep(
    config: OpenSweep, folder: Path, display, *, scheduler=None, workers=None, time_limit=None, overwrite=False
) -> str:
    """Compute the combinations that ``folder`` does not hold yet, and the graph of all; as `branches.diagram.run_diagram`.

    Raises
    ------
    StoreError
        The folder cannot be written to, another run is writing to it, or it holds another scene and ``overwrite`` is not set.
    ExecutorError
        The scheduler cannot be used.
    """
    began, folder = time.perf_counter(), Path(folder)
    prepare(folder / DIAGRAM)
    with only_run(folder / DIAGRAM):
        kept = set() if overwrite else _kept(config, folder)
        run = executor(scheduler, workers, time_limit)
        failed = _compute_missing(config, folder, display, run, kept)
        graph = _graph(config, folder)
        graph.graph.update({"config": dump(config), "failed": json.dumps(failed), "absent": json.dumps(config.absent)})
        diagram_graph.save(graph, folder)
    kinds = [kind for _, kind in graph.nodes(data="kind")]
    lines = [
        f"{config.title or 'open strips'}: {len(config.branches)} branches in {time.perf_counter() - began:.2f} s",
        f"  {kinds.count('fold')} folds, {kinds.count('branch point')} branch points",
        *(f"  left out: {name}: {reason}" for name, reason in config.absent.items()),
        *(f"  failed: {name}: {reason}" for name, reason in failed.items()),
        f"  written to {folder} (diagram.json, diagram.graphml, one file per branch)",
    ]
    display.diagram_summary(lines)
    return "lost" if failed else "complete"


def _kept(config: OpenSweep, folder: Path) -> set[str]:
    """Return the names of the complete results in the folder.

    Raises
    ------
    StoreError
        A file in the folder would be replaced, or would no longer be in its diagram.
    """
    if (folder / DIAGRAM).exists():
        for _, data in diagram_graph.read_any(folder).nodes(data=True):
            if data.get("file") not in config.branches:
                raise another_scene(folder, f"{data.get('file')} is not a branch of this one")
    kept = set()
    for name, one in config.branches.items():
        try:
            branch = read_branch(folder / name)
        except StoreError:  # there is none, or it cannot be read: it is computed
            continue
        different = difference(branch.scene, one) if isinstance(branch, OpenBranch) else "it is of a closed strip"
        if different:
            raise another_scene(folder, f"{name}: {different}")
        if branch.status == "complete":
            kept.add(name)
    return kept


def _compute_missing(config: OpenSweep, folder: Path, display, run, kept: set[str]) -> dict[str, str]:
    """Compute the missing results; return the failed ones, by file name with the reason."""
    missing, failed = [(name, one) for name, one in config.branches.items() if name not in kept], {}
    display.begin_diagram(config, len(config.branches), len(kept))
    _load_kernels([one for _, one in missing])
    jobs, settled = ((name, dump(one)) for name, one in missing), len(kept)
    if missing:
        with run as (submit, wait, limit):
            for (name, _), result in run_jobs(lambda running: next(jobs, None), compute, submit, limit, wait):
                problem = trouble(result) if isinstance(result, BaseException) else result[1]
                if not isinstance(result, BaseException):
                    write_bytes(folder / name, result[0])
                if problem:
                    failed[name] = problem
                settled += 1
                display.sweep_done(_told(config, folder, name, problem), problem, settled)
    return {name: failed[name] for name in config.branches if name in failed}


def _told(config: OpenSweep, folder: Path, name: str, problem: str) -> list[str]:
    """Return a combination in words, and its stages unless it failed."""
    if problem:
        return [open_graph.words_of(config.numbers[name])]
    graph, branch = open_graph.new_graph(""), read_branch(folder / name)
    open_graph.add_result(graph, branch, name, config.numbers[name])
    return [*open_graph.listed(graph), *branch.notes]


def _load_kernels(configs: list[OpenConfig]) -> None:
    """Load the compiled functions (or compile them), once for each law before processes are forked."""
    for config in {config.strip().section.law.name: config for config in configs}.values():
        try:
            first_state(config)
        except ConfigError:  # its own run says so
            continue


def _graph(config: OpenSweep, folder: Path):
    """Return the graph of all results in the folder."""
    graph = open_graph.new_graph(config.title)
    for name, numbers in config.numbers.items():
        if (folder / name).exists():
            open_graph.add_result(graph, read_branch(folder / name), name, numbers)
    return graph
