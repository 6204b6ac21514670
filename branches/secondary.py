"""``python -m branches.secondary RESULT``: follow the branches that leave primary branches where the index changes.

A secondary branch has its own scene, with an ``origin``; `branches.run` computes it like any other. This command makes
these scenes from the labelled points SB of a result, runs them, and adds the branches to the diagram.
"""

from __future__ import annotations

from branches.store import interrupt

if __name__ == "__main__":  # before the imports below, which take a second
    interrupt.begin(interrupt.BRANCHES_KEPT)

import json
import sys
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from branches.graph import closed as diagram
from branches.graph.stored import DIAGRAM, new_graph, read, save
from branches.run.display import Progress
from branches.run.runner import compute_scene
from branches.scene.closed import ClosedScene
from branches.scene.fields import ConfigError
from branches.scene.labels import PRIMARY
from branches.scene.parse import dump, parse
from branches.store.branch import StoredBranch
from branches.store.command import Parser, answered, write_output
from branches.store.files import StoreError, check_folder_name, prepare, write_bytes
from branches.store.read import complete_run, read_branch
from contin import ContinError
from ribbon_model.domains import CELL, HALF_LOOPS
from ribbon_model.modes import Mode

# --- all secondary branches of a result -----------------------------------------------------------------------------


def follow_all(result: Path, folder: Path, settings: list[str], progress: Progress) -> list[dict]:
    """Follow every secondary branch of a result, in the same folder as a diagram with the primary ones.

    The result is a branch file or the folder of a diagram. ``settings`` are ``key=value`` changes of the scenes of secondary
    branches, whose other fields are those of the primary ones; ``progress`` shows a line of text for every attempt. Return the
    attempts, as the diagram keeps them under ``switches`` (JSON). Raises StoreError or ConfigError for a result or a setting
    that cannot be used.
    """
    primaries = _primaries(result)
    prepare(folder / DIAGRAM)
    graph = read(folder) if (folder / DIAGRAM).exists() else new_graph()
    old = json.loads(graph.graph.get("switches", "[]"))
    files = {switch["file"] for switch in old if switch["primary"] in primaries and "file" in switch}
    edges = graph.edges(keys=True, data=True)
    graph.remove_edges_from([(a, b, key) for a, b, key, data in edges if data["file"] in files])
    graph.remove_nodes_from([name for name, degree in list(graph.degree) if degree == 0])
    old = [switch for switch in old if switch["primary"] not in primaries]
    there = {data["file"] for _, _, data in graph.edges(data=True)}
    for name, branch in primaries.items():
        write_bytes(folder / name, (result if result.is_file() else result / name).read_bytes())
        if name not in there:
            diagram.add_branch(graph, branch, name)
    switches, events = [], [(name, event) for name, one in primaries.items() for event in one.events if event["label"] == b"SB"]
    progress.expect(len(events))
    for name, event in events:
        for switch in _attempts(graph, primaries[name], name, event, _Place(folder, settings, progress)):
            switches.append(switch)
            progress.tell(_line(switch) + "\n")
        progress.part_done()
    graph.graph["switches"] = json.dumps(old + switches)
    save(graph, folder)
    return switches


def _primaries(result: Path) -> dict[str, StoredBranch]:
    """Return the primary branches of a result that have an index, by file name; raise StoreError where there is none."""
    if result.is_dir():
        names = sorted({data["file"] for _, _, data in read(result).edges(data=True) if "origin" not in data})
        found = {name: read_branch(result / name) for name in names}
    else:
        found = {result.name: read_branch(result)}
    found = {name: one for name, one in found.items() if one.config.get("stability") and one.config["domain"] == CELL.name}
    if not found:
        raise StoreError(f"{str(result)!r} holds no branch with its index on the cell; run its scene with stability: true")
    return found


@dataclass(frozen=True)
class _Place:
    """The folder of secondary branches, the changes of their scenes, and the line of progress."""

    folder: Path
    settings: list[str]
    progress: Progress


def _attempts(graph, branch: StoredBranch, name: str, event, place: _Place):
    """Follow every kind of branch that leaves one bifurcation; yield a record of each attempt."""
    config = branch.config
    where = {column: float(event[column]) for column in ("kappa_n", "kappa_star")}
    about = {key: config[key] for key in ("law", "Gamma", "nu", "m", "n")} | where | {"mode": event["name"].decode()}
    record = {"primary": name, **about}
    try:
        how = Mode.parse(config["n"], about["mode"])
    except ValueError as error:
        yield record | {"outcome": "failed", "reason": str(error)}
        return
    record["dimension"] = how.dimension
    if not how.keeps:
        yield record | {"outcome": "failed", "reason": "its modes keep no mirror and no axis: they need the whole loop"}
    for reversal in how.keeps:
        this = record | {"keeps": how.kept(reversal), "breaks": how.broken(reversal), "domain": HALF_LOOPS[reversal].name}
        place.progress.part(f"({this['m']}, {this['n']}) at {where['kappa_n']:.6f}, {this['mode']}, keeps {this['keeps']}")
        yield this | _attempt(graph, branch, event, reversal, place)


def _attempt(graph, branch: StoredBranch, event, reversal: str, place: _Place) -> dict:
    """Follow one branch and add it to the diagram; return the outcome."""
    config = _scene(branch.config, event, reversal, place.settings)
    file = config.secondary_file({data["file"] for _, _, data in graph.edges(data=True)})
    known = _arrived_before(graph, config)
    if known:
        return {"outcome": "known", "reason": f"the other end of {known}", "file": known}
    try:
        stored = complete_run(place.folder / file, config)
        if stored is None:
            write_bytes(place.folder / file, compute_scene(config, place.progress).image)
            stored = read_branch(place.folder / file)
    except (ConfigError, ContinError) as error:
        return {"outcome": "failed", "reason": str(error)}
    diagram.add_branch(graph, stored, file)
    points = stored.points
    strength = np.sqrt(points["R1"] ** 2 + points["R2"] ** 2 + points["R3"] ** 2)
    found = {"file": file, "force": [float(strength.min()), float(strength.max())], "goes": _goes(graph, file)}
    if "index" in points.dtype.names:
        found["index"] = [int(i) for i, last in zip(points["index"], [-1, *points["index"]]) if i >= 0 and i != last]
        found["index"] = [i for k, i in enumerate(found["index"]) if k == 0 or i != found["index"][k - 1]]
    return found | {"outcome": "failed" if stored.status == "lost" else "followed", "reason": stored.stop}


def _scene(primary: dict, event, reversal: str, settings: list[str]) -> ClosedScene:
    """Return the scene of a secondary branch: the fields of the primary one that are valid on another domain."""
    kept = {name: primary[name] for name in ("law", "nu", "Gamma", "parameters", "m", "n", "steps", "stability", "stride")}
    kept["mesh"] = primary["mesh"]
    kept["limits"] = {name: list(ends) for name, ends in primary["limits"].items() if name not in ("M1", "M2")}
    origin = {name: float(event[name]) for name in ("kappa_n", "kappa_star")} | {"mode": event["name"].decode()}
    text = dump(ClosedScene.model_validate(kept | {"domain": HALF_LOOPS[reversal].name, "origin": origin}))
    return parse(text, "scene", settings)


def _arrived_before(graph, config: ClosedScene) -> str:
    """Return the file of a branch on this domain that begins or ends at the origin, if the diagram has one."""
    origin = config.origin.model_dump(exclude={"mode"})
    for branch in diagram.secondaries(graph, config.material, config.nu):
        ends = branch["nodes"][0], branch["nodes"][-1]
        if branch["domain"] == config.domain and any(diagram.same_place(end, origin) for end in ends):
            return branch["file"]
    return ""


def _goes(graph, file: str) -> str:
    """Return the end of a branch of the diagram in words."""
    (branch,) = (branch for branch in diagram.secondaries(graph) if branch["file"] == file)
    end = branch["nodes"][-1]
    if end["kind"] == "secondary bifurcation":
        return f"the branch ({end['m']}, {end['n']}) at {end['kappa_n']:.8f}"
    if end["kind"] == PRIMARY:
        return f"a primary branch that the diagram does not hold, at {end['kappa_n']:.8f}"
    if end["kind"] == "leaves":
        return f"the scene's own limit, {end['what']}"
    return f"its end, {end['what']}, at {end['kappa_n']:.6f}"


# --- command line ---------------------------------------------------------------------------------------------------


def _line(switch: dict) -> str:
    """Return an attempt in words."""
    start = f"({switch['m']}, {switch['n']}) at {switch['kappa_n']:.8f}, {switch['mode']}"
    if "keeps" not in switch:
        return f"{start}: {switch['outcome']}: {switch['reason']}"
    start += f", kernel of dimension {switch['dimension']}, keeps {switch['keeps']}"
    if "goes" not in switch:
        return f"{start}: {switch['outcome']}: {switch['reason']}"
    index = f", index {', '.join(map(str, switch['index']))}" if "index" in switch else ""
    lost = f" (lost: {switch['reason']})" if switch["outcome"] == "failed" else ""
    return f"{start}: goes to {switch['goes']}, |R| up to {switch['force'][1]:.4f}{index}{lost}"


def parser() -> Parser:
    """Return the command line."""
    parser = Parser(
        "secondary",
        "Follow the branches that leave a primary branch at its secondary bifurcations, and add them to a diagram.",
        "Exit code: 0 done, 1 some branch could not be followed to its end (the diagram says why), 2 bad input, "
        "130 interrupted.",
    )
    parser.add_argument("result", help="file of a primary branch with its index (stability: true), or a diagram's folder")
    parser.add_argument(
        "-o", "--out", metavar="DIR",
        help="folder for the results (default: the folder of the diagram; for a file NAME_secondary)",
    )  # fmt: skip
    parser.add_argument(
        "--set", metavar="KEY=VALUE", action="append", default=[], help="change a field of the scenes of secondary branches"
    )
    parser.add_argument("--quiet", action="store_true", help="print only the last line")
    return parser


@answered()
def main(argv=None) -> int:
    """Run the command; return the exit code."""
    options = parser().parse_args(argv)
    result = Path(options.result)
    folder = Path(options.out) if options.out else result if result.is_dir() else result.with_name(f"{result.stem}_secondary")
    check_folder_name(folder)
    with Progress("secondary bifurcations", quiet=options.quiet) as progress:
        switches = follow_all(result, folder, options.set, progress)
    counts = {outcome: sum(switch["outcome"] == outcome for switch in switches) for outcome in ("followed", "known", "failed")}
    write_output(
        f"{counts['followed']} secondary branches, {counts['known']} other ends of them, {counts['failed']} not followed; "
        f"written to {folder}\n"
    )
    return 1 if counts["failed"] else 0


if __name__ == "__main__":
    sys.exit(interrupt.run(main))
