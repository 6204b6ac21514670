"""Run a scene of many branches: in parallel, each to its own file, and assembled as a graph."""

from __future__ import annotations

import collections
import json
import time
from pathlib import Path

from branches import diagram_graph
from branches.config import Config, ConfigError, DiagramConfig, difference, dump, parse
from branches.diagram_graph import Course
from branches.executor import WAIT, executor, run_jobs, trouble
from branches.files import ANOTHER_DIAGRAM, StoreError, another_scene, only_run, prepare, write_bytes
from branches.names import DIAGRAM, primary_file
from branches.read import read_branch

#: Combinations without a branch that the summary names; the diagram names all. A sweep over nu has a thousand.
_MOST_NAMED = 10
#: Places in the order of branches are multiples of this, modulo 1 (the golden ratio): the branches so far are a fair sample.
_SPREAD = (5**0.5 - 1) / 2


def compute(config: Config) -> tuple[bytes, str, Course]:
    """Compute one branch, in any process; return the image of its file, the reason of a failure or '', and its course."""
    from branches.display import Display
    from branches.job import compute_branch

    branch = compute_branch(config, Display(silent=True))
    return branch.image, "" if branch.status == "complete" else branch.stop, diagram_graph.course_of(branch)


class _Plan:
    """The order of the branches, in which none is computed twice from its two ends.

    A branch (m, n) may end on the (2n - m)-covered circle, where it is the branch (2n - m, n). The second branch of such a pair
    follows the first and waits for it, and is left out if the first one ends at its start. Otherwise the order mixes long and
    short branches, so that the time left can be estimated from the branches so far.
    """

    def __init__(self, configs: tuple[Config, ...], missing: list[Config], graph):
        self._graph = graph
        keys = {self._key(config) for config in configs}
        self._later = {key: other for key in keys if (other := self._partner(key)) in keys and other[2] < key[2]}
        places = {self._key(config): number * _SPREAD % 1 for number, config in enumerate(configs)}
        self._open = collections.deque(sorted(missing, key=lambda config: self._place(self._key(config), places)))
        self.left_out: list[Config] = []

    def _place(self, key, places) -> tuple[float, bool]:
        return places[self._later.get(key, key)], key in self._later

    @staticmethod
    def _key(config):
        return config.material, config.nu, config.m, config.n

    @staticmethod
    def _partner(key):
        law, nu, m, n = key
        return law, nu, 2 * n - m, n

    def next(self, running):
        """Return the next branch, `WAIT`, or None."""
        busy, waiting, found = {self._key(config) for config in running}, [], None
        while self._open and found is None:
            config = self._open.popleft()
            other = self._later.get(self._key(config))
            if other in busy:
                waiting.append(config)
            elif other and diagram_graph.holds_circle(self._graph, config.material, config.nu, config.m, config.n):
                self.left_out.append(config)
            else:
                found = config
        self._open.extendleft(reversed(waiting))
        return found or (WAIT if waiting else None)


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
    began, folder = time.perf_counter(), Path(folder)
    prepare(folder / DIAGRAM)
    with only_run(folder / DIAGRAM):
        kept = {} if overwrite else _kept(config, folder)
        run = executor(scheduler, workers, time_limit)
        courses, failed, left_out = _compute_missing(config, folder, display, run, kept)
        graph = diagram_graph.new_graph(config.title)
        for name, course in courses.items():
            diagram_graph.add_course(graph, course, name)
        graph.graph.update({"config": dump(config), "failed": json.dumps(failed), "absent": json.dumps(config.absent)})
        diagram_graph.save(graph, folder)
    display.diagram_summary(_summary(config, graph, failed, left_out, time.perf_counter() - began, folder))
    return "lost" if failed else "complete"


def _kept(config: DiagramConfig, folder: Path) -> dict[str, Course]:
    """Return the complete branches in the folder, by file name.

    Raises
    ------
    StoreError
        A branch in the folder would be replaced, or would no longer be in a diagram. (A scene with the same branches and
        further ones is accepted.)
    """
    ours, kept = {primary_file(one): one for one in config.branches}, {}
    for name, scene in _stored_scenes(config, folder).items():
        if name not in ours:
            raise another_scene(folder, f"{name} is not a branch of this one")
        if differs := difference(scene, ours[name]):
            raise another_scene(folder, f"{name}: {differs}")
    for name, one in ours.items():
        try:
            branch = read_branch(folder / name)
        except StoreError:  # there is none, or it cannot be read: it is computed
            continue
        if differs := difference(Config.model_validate(branch.config), one):
            raise another_scene(folder, f"{name}: {differs}")
        if branch.status == "complete":
            kept[name] = diagram_graph.course_of(branch)
    return kept


def _stored_scenes(config: DiagramConfig, folder: Path) -> dict[str, Config]:
    """Return the scenes of the branches of a folder's diagram by file name; none if it has no diagram, or one of this scene."""
    if not (folder / DIAGRAM).exists():
        return {}
    try:
        text = diagram_graph.read(folder).graph["config"]
        if text == dump(config):
            return {}
        scene = parse(text, DIAGRAM)
        return {primary_file(one): one for one in scene.branches}
    except (StoreError, ConfigError, KeyError) as error:
        raise StoreError(f"{str(folder)!r} holds a diagram that is not a result of branches.run; {ANOTHER_DIAGRAM}") from error


def _compute_missing(config, folder, display, run, kept) -> tuple[dict[str, Course], dict[str, str], list[Config]]:
    """Compute the missing branches.

    Returns
    -------
    courses, failed
        Of all branches, and the reasons of those that failed, by file name; both in the order of the scene, whatever the order
        in which processes were done.
    left_out
        Branches that are there from their other ends.
    """
    courses, graph = dict(kept), diagram_graph.new_graph()
    for name, course in kept.items():
        diagram_graph.add_course(graph, course, name)
    fresh = [one for one in config.branches if primary_file(one) not in kept]
    plan, failed = _Plan(config.branches, fresh, graph), {}
    _load_kernels(fresh)
    display.begin_diagram(config, len(config.branches), len(kept))
    done = len(kept)
    if fresh:
        with run as (submit, wait, limit):
            for one, result in run_jobs(plan.next, compute, submit, limit, wait):
                name, done = primary_file(one), done + 1
                problem = _take(folder, name, result, graph)
                if problem:
                    failed[name] = problem
                if not isinstance(result, BaseException):
                    courses[name] = result[2]
                nodes = [] if problem else [attributes for _, attributes in result[2].nodes]
                display.branch_done(one, problem, nodes, done + len(plan.left_out))
    order = [primary_file(one) for one in config.branches]
    in_order = [{name: found[name] for name in order if name in found} for found in (courses, failed)]
    return in_order[0], in_order[1], plan.left_out


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
    lines += [f"  left out: {name}: {reason}" for name, reason in list(config.absent.items())[:_MOST_NAMED]]
    if len(config.absent) > _MOST_NAMED:
        lines.append(f"  left out: {len(config.absent) - _MOST_NAMED} more, which diagram.json names (absent)")
    lines += [f"  failed: {name}: {reason}" for name, reason in failed.items()]
    return [*lines, f"  written to {folder} (diagram.json, diagram.graphml, one file per branch)"]


def _load_kernels(configs):
    """Load the compiled functions of the branches (or compile them), once before processes are forked."""
    from branches.job import seed

    for law in {config.law: config for config in configs}.values():
        system, x, _ = seed(law)
        system.functionals(x)


def _take(folder: Path, name: str, result, graph) -> str:
    """Write a finished branch to its file and add it to the diagram; return the reason of a failure, or ''."""
    if isinstance(result, BaseException):
        return trouble(result)
    image, problem, course = result
    write_bytes(folder / name, image)
    diagram_graph.add_course(graph, course, name)
    return problem
