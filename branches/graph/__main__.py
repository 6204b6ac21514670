"""``python -m branches.graph DIR``: list branches, states and folds of a bifurcation diagram (`branches.graph.closed`)."""

from __future__ import annotations

from branches.store import interrupt

if __name__ == "__main__":  # before the imports below, which take a second
    interrupt.begin(interrupt.NO_FILES)

import sys
from collections.abc import Iterable
from pathlib import Path

from branches.graph import closed as diagram
from branches.graph import read
from branches.graph.stored import CLOSED_FORMAT, OPEN_FORMAT
from branches.scene.closed import and_nu
from branches.store.command import Parser, answered, write_output
from branches.store.files import StoreError


def parser() -> Parser:
    """Return the command line."""
    parser = Parser("graph", "List branches, states and folds of a bifurcation diagram.")
    parser.add_argument(
        "folder", help="folder of a diagram, or its diagram.json; or a scene (.yaml), for the exact solution without a run"
    )
    parser.add_argument("--where", nargs=2, type=int, metavar=("M", "N"), help="list the special points of the branch (M, N)")
    parser.add_argument("--at", type=float, metavar="KAPPA_N", help="list the states at this natural curvature")
    parser.add_argument(
        "--folds", nargs=2, type=float, metavar=("LOW", "HIGH"), help="list the folds between these natural curvatures"
    )
    return parser


@answered(KeyError)
def main(argv=None) -> int:
    """Answer the queries; return the exit code."""
    options = parser().parse_args(argv)
    graph = read(options.folder)
    lines = list({CLOSED_FORMAT: _of_closed_strips, OPEN_FORMAT: _of_open_strips}[graph.graph["format"]](graph, options))
    write_output("\n".join(lines) + "\n")
    return 0


def _of_closed_strips(graph, options) -> Iterable[str]:
    if "source" in graph.graph:
        yield graph.graph["source"]
    if options.where:
        for branch in diagram.course(graph, *options.where):
            yield f"{branch['law']}{and_nu(branch['law'], branch['nu'])}: {diagram.describe(branch['nodes'])}"
        for branch in diagram.secondaries(graph):
            if branch["family"][2:] == tuple(options.where):
                yield f"  {branch['mode']}, {branch['domain']}: {diagram.describe(branch['nodes'])}"
    if options.at is not None:
        yield from _states(graph, options)
    if options.folds:
        yield from _folds(graph, *options.folds)
    if not options.where and options.at is None and not options.folds:
        found = list(diagram.courses(graph))
        yield f"{len(found)} branches, {graph.number_of_nodes()} special points"
        for (law, nu, m, n), nodes in found:
            yield f"  {law}{and_nu(law, nu)}, ({m}, {n}): {diagram.describe(nodes)}"


def _folds(graph, low: float, high: float) -> Iterable[str]:
    """Yield the folds between two natural curvatures, each with its branch."""
    if not low < high:
        raise StoreError(f"--folds {low:g} {high:g}: the first number must be the smaller")
    found = diagram.folds(graph, low, high)
    if not found:
        yield f"no folds between {low:g} and {high:g}"
    for data in found:
        branch = f"{'secondary ' * data['secondary']}branch ({data['m']}, {data['n']})"
        place = f"kappa_n = {data['kappa_n']:.10f}, kappa* = {data['kappa_star']:.8f}"
        yield f"{data['law']}{and_nu(data['law'], data['nu'])}: fold of {branch} at {place}"


def _states(graph, options) -> Iterable[str]:
    from branches.graph.at_value import states_at  # Newton's method: not for other questions

    folder = Path(options.folder)
    for state in states_at(graph, options.at, folder if folder.is_dir() else folder.parent):
        about = state.about
        what = f"{about['circle']}-covered circle" if "circle" in about else f"branch {about['branch']}"
        what = f"secondary {what}, from {about['origin']:.6f}" if "origin" in about else what
        values = f"kappa* = {state.words('kappa_star')}, energy = {state.words('energy')}"
        yield f"{about['law']}{and_nu(about['law'], about['nu'])}: {what}, {values}"


def _of_open_strips(graph, options) -> Iterable[str]:
    """Yield the labelled points of open strips, stage by stage; raise StoreError on a question for closed strips."""
    from branches.graph.open_strips import listed

    if options.where or options.at is not None or options.folds:
        raise StoreError(f"{options.folder!r} is the diagram of open strips: it is listed without --where, --at and --folds")
    yield from listed(graph)


if __name__ == "__main__":
    sys.exit(interrupt.run(main))
