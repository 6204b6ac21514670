"""Run a scene of many branches: in parallel, each to its own file, and assembled as a graph."""

from __future__ import annotations

import contextlib
import json
import time
from pathlib import Path

from branches import diagram_graph
from branches.config import Config, ConfigError, DiagramConfig, difference, dump, parse
from branches.executor import WAIT, executor, run_jobs, trouble
from branches.files import StoreError, only_run, prepare, write_bytes
from branches.names import DIAGRAM, primary_file
from branches.read import complete_run, read_branch


def compute(text: str) -> tuple[bytes, str]:
    """Compute one branch from the text of its scene, in any process: return the image of its file, and the outcome."""
    from branches.display import Display
    from branches.job import compute_branch

    return compute_branch(parse(text, "scene"), Display(silent=True))


class _Plan:
    """The order of the branches, in which none is computed twice from its two ends.

    A branch (m, n) may end on the (2n - m)-covered circle, where it is the branch (2n - m, n). The second branch of such a pair
    waits for the first, and is left out if the first one ends at its start.
    """

    def __init__(self, configs: list[Config], missing: list[Config], graph):
        self._graph = graph
        keys = {self._key(config) for config in configs}
        self._later = {key: other for key in keys if (other := self._partner(key)) in keys and other[2] < key[2]}
        self._open = sorted(missing, key=lambda config: (self._key(config) in self._later, config.n * config.m))
        self.left_out: list[Config] = []

    @staticmethod
    def _key(config):
        return config.material, config.nu, config.m, config.n

    @staticmethod
    def _partner(key):
        law, nu, m, n = key
        return law, nu, 2 * n - m, n

    def next(self, running):
        """Return the next branch, `WAIT`, or None."""
        busy = {self._key(config) for config in running}
        for config in list(self._open):
            other = self._later.get(self._key(config))
            if other in busy:
                continue
            self._open.remove(config)
            if other and diagram_graph.holds_circle(self._graph, config.material, config.nu, config.m, config.n):
                self.left_out.append(config)
                continue
            return config
        return WAIT if self._open else None


def run_diagram(
    config: DiagramConfig, folder: Path, display, *, scheduler=None, workers=None, time_limit=None, overwrite=False
) -> str:
    """Compute the branches of a scene that ``folder`` does not hold yet, and the graph of all.

    Parameters
    ----------
    time_limit : float, optional
        Largest time in seconds of a branch in a process of this machine.

    Returns
    -------
    str
        "complete", or "lost" if a branch failed or was lost on the way (the others are there).

    Raises
    ------
    StoreError
        The folder cannot be written to, another run is writing to it, or it holds another scene and ``overwrite`` is not set.
    ExecutorError
        The scheduler cannot be used.
    """
    began, folder, graph = time.perf_counter(), Path(folder), diagram_graph.new_graph(config.title)
    prepare(folder / DIAGRAM)
    with only_run(folder / DIAGRAM):
        if not overwrite:
            _refuse_another_scene(config, folder)
        run = executor(scheduler, workers, time_limit)
        failed, left_out = _compute_missing(config, folder, graph, display, run, overwrite)
        graph.graph.update({"config": dump(config), "failed": json.dumps(failed), "absent": json.dumps(config.absent)})
        diagram_graph.save(graph, folder)
    display.diagram_summary(_summary(config, graph, failed, left_out, time.perf_counter() - began, folder))
    return "lost" if failed else "complete"


def _refuse_another_scene(config: DiagramConfig, folder: Path) -> None:
    """Raise StoreError if a branch in the folder would be replaced, or would no longer be in a diagram.

    A scene with the same branches and further ones is accepted.
    """
    advice = "--overwrite replaces its diagram, --out writes elsewhere"
    ours = {primary_file(one): one for one in config.branches}
    stored = _stored_scenes(folder, ours, advice)
    for name, scene in stored.items():
        differs = difference(scene, ours[name]) if name in ours else ""
        if differs:
            raise StoreError(f"{str(folder)!r} holds another scene ({name}: {differs}); {advice}")
        if name not in ours:
            raise StoreError(f"{str(folder)!r} holds another scene ({name} is not a branch of this one); {advice}")


def _stored_scenes(folder: Path, names, advice: str) -> dict[str, Config]:
    """Return the scenes of the branches in a folder: those of its diagram, and those of its files with one of the names."""
    found = {}
    if (folder / DIAGRAM).exists():
        try:
            text = diagram_graph.read(folder).graph["config"]
            scene = parse(text, DIAGRAM)
        except (StoreError, ConfigError, KeyError) as error:
            raise StoreError(f"{str(folder)!r} holds a diagram that is not a result of branches.run; {advice}") from error
        found = {primary_file(one): one for one in scene.branches}
    for name in names:
        with contextlib.suppress(StoreError, ConfigError):  # an unreadable branch is computed again
            found[name] = Config.model_validate(read_branch(folder / name).config)
    return found


def _compute_missing(config, folder, graph, display, run, overwrite) -> tuple[dict[str, str], list[Config]]:
    """Compute the missing branches; return the failed ones, by file name with the reason, and those left out as duplicates."""
    configs = config.branches
    fresh = []
    for one in configs:
        stored = None if overwrite else complete_run(folder / primary_file(one), one)
        if stored is None:
            fresh.append(one)
        else:
            diagram_graph.add_branch(graph, stored, primary_file(one))
    plan, failed = _Plan(configs, fresh, graph), {}
    _load_kernels(fresh)
    display.begin_diagram(config, len(configs), len(configs) - len(fresh))
    if fresh:
        with run as (submit, wait, limit):
            for one, result in run_jobs(plan.next, _compute_one, submit, limit, wait):
                problem = _take(folder, one, result, graph)
                if problem:
                    failed[primary_file(one)] = problem
                place = "" if problem else diagram_graph.describe(graph, one.m, one.n, one.material, one.nu)
                display.branch_done(one, problem, place)
    return failed, plan.left_out


def _summary(config, graph, failed, left_out, seconds, folder) -> list[str]:
    """Return the lines of the summary."""
    nodes = [data["kind"] for _, data in graph.nodes(data=True)]
    lines = [
        f"{config.title or 'diagram'}: {len(diagram_graph.families(graph))} branches in {seconds:.2f} s",
        f"  {nodes.count('circle')} bifurcations of circles, {nodes.count('fold')} folds, "
        f"{nodes.count('leaves')} branches that end at the scene's own limits",
    ]
    if left_out:
        lines.append(f"  {len(left_out)} duplicates (the same branches from their other ends) are merged")
    lines += [f"  left out: {name}: {reason}" for name, reason in config.absent.items()]
    lines += [f"  failed: {name}: {reason}" for name, reason in failed.items()]
    return [*lines, f"  written to {folder} (diagram.json, diagram.graphml, one file per branch)"]


def _compute_one(config: Config):
    return compute(dump(config))


def _load_kernels(configs):
    """Load the compiled functions of the branches (or compile them), once before processes are forked."""
    from branches.job import seed

    for law in {config.law: config for config in configs}.values():
        system, x, _ = seed(law)
        system.functionals(x)


def _take(folder: Path, config: Config, result, graph) -> str:
    """Write a finished branch to its file and add it to the diagram; return the reason of a failure, or ''."""
    if isinstance(result, BaseException):
        return trouble(result)
    image, outcome = result
    path = folder / primary_file(config)
    write_bytes(path, image)
    branch = read_branch(path)
    diagram_graph.add_branch(graph, branch, path.name)
    return "" if outcome == "complete" else branch.stop
