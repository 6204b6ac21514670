"""Branch files of strips for the page: branches, stages and circles with their columns, and a shape for every point.

A shape of a closed strip is kept as the states at a few nodes of the domain that was solved (a quarter wave of most branches),
compressed along the branch; the browser unfolds it by the symmetries of `ribbon_model.shape`.
"""

from __future__ import annotations

import collections
import contextlib
import itertools
import math
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np

from branches.draw.strip import steady
from branches.draw.structure import Fixture, Structure, parts_of
from branches.explore.packing import column, compressed
from branches.explore.profiles import MOST_NODES, marked
from branches.run.barriers import falls, told
from branches.run.blas import one_thread
from branches.scene.closed import ClosedScene, and_nu, law_of
from branches.scene.columns import NUMBER
from branches.scene.labels import ON_PAGE, START, kind_of, label_of
from branches.store.branch import StoredBranch
from branches.store.files import StoreError
from branches.store.layout import CLOSED
from branches.store.open_branch import OPEN_WIDTH
from branches.store.read import read_branch, read_kind
from contin import ConvergenceError, Newton
from contin.lowlevel import Collocation, Label, correct, levels, point_of
from ribbon_model import exact
from ribbon_model.descent import METRICS, SEGMENTS, let_go, past
from ribbon_model.domains import DOMAINS
from ribbon_model.equilibrium import strains_of
from ribbon_model.laws import FINITE_WIDTH, LAWS, PAPER_LAWS
from ribbon_model.linear import circle, covering, energy_interval, index
from ribbon_model.segments import discretized
from ribbon_model.shape import Shape, quaternions, shape_of
from ribbon_model.solution import Solution

#: What is kept of a shape at each node, in this order.
CHANNELS = ("q0", "q1", "q2", "q3", "eta", "x1", "x2", "x3")
#: Columns of a circle, which the linear theory gives; the page makes the elastic energy, energy + kappa_n^2 / 2.
_MAP = ("kappa_n", "kappa_star", "energy")
CIRCLE_COLUMNS = (*_MAP, "index")
#: Laws whose exact solutions the page computes itself, at any nu (``exact.js``, ``exact_width.js``).
_ON_PAGE = (*PAPER_LAWS, FINITE_WIDTH.name)
#: Largest distance between points of the exact solution of another law, as for `ribbon_model.exact.curve`. Lines through them
#: are splines; half of it takes twice as long, and the page shows no difference.
_EXACT_STEP = 0.2
#: The index where a whole band of wavenumbers is unstable, which no number counts; and where it is not known.
INFINITE, UNKNOWN = -2, -1
#: About so many nodes make a closed strip; a quarter wave has no fewer than the second number.
_LOOP_NODES, _FEWEST = 384, 16
#: Circles reach a little farther in kappa_n than the branches do, so that they are there at the outermost fold (ten times more
#: would leave a fifth of the map to them).
_BEYOND = 0.02
#: Steps of a circle. All columns of laws that the page knows are parabolas there, which the page makes finer; others are not.
_CIRCLE_STEPS, _CURVED_STEPS = 6, 60


def branch_of(path: Path, slow: bool = True) -> dict:
    """Return what the page holds of a branch file; ``family`` and ``reach`` are for `family_of` alone.

    With ``slow``, it holds what takes seconds: the ways down from folds that a stable strip reaches, and the exact solution of
    a law that the page does not know. Raises StoreError where the file cannot be read, or it holds fewer than two points.
    """
    with one_thread():
        return _branch(path, read_kind(path, CLOSED), slow)


def _branch(path: Path, branch: StoredBranch, slow: bool) -> dict:
    config, points, scene = branch.config, branch.points, branch.scene
    if len(points) < 2:
        raise StoreError(f"{str(path)!r} holds {len(points)} points; a branch has two at least")
    if bad := [name for name in ("arclength", *_MAP) if not np.isfinite(points[name]).all()]:
        raise StoreError(f"{str(path)!r}: the column {bad[0]!r} holds values that are no numbers")
    names = [name for name in points.dtype.names if points.dtype[name].kind in "if" and name not in ("point", "length")]
    marks = [_mark(event, branch.reason, branch.scene) for event in branch.events]
    for mark, event in zip(marks, branch.events):
        if slow and mark["kind"] == "fold" and (way := way_down(branch, event)):
            mark["way"] = way
        if "index_after" in event.dtype.names and event["index_after"] >= 0:
            mark["index_after"] = int(event["index_after"])
    about = {
        "axes": branch.columns.axes([*branch.columns.mapped("kappa_n"), "elastic"]),
        "family": (list(LAWS).index(scene.law), -1.0 if scene.Gamma is None else scene.Gamma, scene.nu, scene.material),
        "reach": (float(points["kappa_n"].min()), float(points["kappa_n"].max())),
        "title": config["title"], "m": config["m"], "n": config["n"], "to": marks[-1].get("covering"),
        "domain": config["domain"], "stop": branch.stop, "file": path.name, "config": branch.scene_text(),
        "marks": marks, "labels": {int(event["point"]): event["label"].decode() for event in branch.events},
        "columns": {name: column(points[name]) for name in names}, "shapes": compressed(shapes(branch)),
    }  # fmt: skip
    if config["origin"]:
        return about | {"origin": config["origin"]["kappa_n"], "mode": config["origin"]["mode"]}
    return about | ({"exact": _exact(branch.scene)} if slow and config["law"] not in _ON_PAGE else {})


def _exact(scene: ClosedScene) -> dict:
    """Return the exact solution of a primary branch, its columns and its folds; or ``none``, the reason why there is none."""
    limits = scene.limits.get("kappa_n", (-100.0, 100.0))
    try:
        points = exact.curve(scene.m, scene.n, scene.law_parameters, limits, _EXACT_STEP, LAWS[scene.law])
    except (ArithmeticError, RuntimeError, ValueError) as error:
        return {"none": str(error)}
    places = [{name: getattr(point, name) for name in _MAP} for point in points]
    return {"points": places, "folds": [place for place, point in zip(places, points) if point.label == Label.FOLD]}


def family_of(branches: list[dict]) -> dict:
    """Return the branches of one law and nu, as of `branch_of`, and the circles that they meet."""
    *_, nu, law = branches[0]["family"]
    branches = sorted(branches, key=lambda branch: (branch["m"] * branch["n"], branch["m"], "origin" in branch))
    ends = [end for branch in branches for end in branch["reach"]]
    coverings = {branch["m"] for branch in branches} | {branch["to"] for branch in branches if branch["to"] is not None}
    bifurcations = [mark for branch in branches for mark in branch["marks"] if mark["kind"] == "circle"]
    beyond = _BEYOND * (max(ends) - min(ends))
    reach = min(ends) - beyond, max(ends) + beyond
    circles = [_circle(law, nu, m, reach, bifurcations) for m in sorted(coverings)]
    for branch in branches:
        for name in ("axes", "family", "reach", "title", *(["path"] if branch["shapes"] else [])):
            del branch[name]
    ruled = law_of(law, nu)[0].has_rulings
    about = {"name": f"{law}{and_nu(law, nu, 'ν')}", "law": law, "nu": nu, "parameter": "kappa_n", "ruled": ruled}
    return about | {"branches": branches, "circles": circles}


# --- branches of closed strips ----------------------------------------------------------------------------------------


def _mark(event, reason: str, scene: ClosedScene) -> dict:
    """A labelled point: its number, kind, and what it is called; kappa_n where it is on a circle."""
    name, place = event["name"].decode(), {"point": int(event["point"])}
    values = {column: float(event[column]) for column in _MAP}
    if not all(map(math.isfinite, values.values())):
        raise StoreError(f"the labelled point {event['point']} has columns that are no numbers")
    kind = kind_of(event["label"].decode(), name, reason, bool(scene.origin))
    if kind == "circle":
        index = covering(LAWS[scene.law], scene.law_parameters, **values)
        return place | {"kind": kind, "covering": index, "kappa_n": values["kappa_n"]}
    return place | {"kind": ON_PAGE.get(kind, "end"), "name": name}


def shapes(branch: StoredBranch) -> np.ndarray:
    """Return every point's states at equidistant nodes of the domain, shape (points, nodes, len(CHANNELS)); see `solutions`.

    Where no solution is found, states are interpolated linearly over arclength between the neighbours.
    """
    domain = DOMAINS[branch.config["domain"]]
    t = np.linspace(0, 1, max(_FEWEST, math.ceil(_LOOP_NODES / domain.parts(branch.config["n"]))) + 1)
    problem = domain.problem(LAWS[branch.config["law"]])
    found = [(number, Solution.at(*one)) for number, one in enumerate(solutions(branch)) if one is not None]
    values = np.array([_channels(problem, solution, t) for _, solution in found])
    return filled(branch, [number for number, _ in found], values)


def _channels(problem, solution: Solution, t: np.ndarray) -> np.ndarray:
    """Return the states of one solution at t, shape (K, len(CHANNELS))."""
    states, size, none = solution.sampled(t), len(problem.states), np.empty((0, len(problem.states)))
    parameters = np.array([solution.parameters[name] for name in problem.parameters])
    rates = problem.batch("field").values(t, np.ascontiguousarray(states[:, :size]), none, parameters)
    eta = shape_of(t, states, strains_of(states[:, :4], rates[:, :4])).eta
    return np.column_stack([states[:, :4], eta, states[:, 4:]])


# --- circles ------------------------------------------------------------------------------------------------------


def _circle(law: str, nu: float, m: int, ends: tuple[float, float], bifurcations: list[dict]) -> dict:
    """The planar m-covered circle, with its bifurcations among its points."""
    material, parameters = law_of(law, nu)
    neutral = [mark["kappa_n"] for mark in bifurcations if mark["covering"] == m]
    if m >= 1:
        neutral += [m * end for end in energy_interval(material, m, parameters) if ends[0] < m * end < ends[1]]
    steps = _CIRCLE_STEPS if material.name in _ON_PAGE else _CURVED_STEPS
    kappa_n = np.unique(np.round(np.append(np.linspace(*ends, steps + 1), neutral), 9))
    kappa_n = np.sort(np.append(kappa_n, (kappa_n[1:] + kappa_n[:-1]) / 2))  # one between any two neutral ones
    values = [circle(material, m, k, parameters) for k in kappa_n]
    columns = {"kappa_n": kappa_n, "index": [_circle_index(material, m, k, parameters, neutral) for k in kappa_n]}
    columns |= {name: [value[name] for value in values] for name in ("kappa_star", "energy")}
    return {"m": m, "columns": {name: column(np.array(columns[name])) for name in CIRCLE_COLUMNS}}


def _circle_index(law, m, kappa_n, parameters, neutral) -> int:
    # curled against its natural curvature (m < 1) the linear theory at hand does not count
    if m < 1 or np.isclose(kappa_n, neutral, rtol=0, atol=1e-8).any():
        return UNKNOWN
    count = index(law, m, kappa_n, parameters)
    return INFINITE if math.isinf(count) else int(count)


# --- ways down from folds --------------------------------------------------------------------------------------------

#: Strips on the way that the page holds. With half as many the film of the longest way (1, 2) stutters.
_FRAMES = 40


def way_down(branch: StoredBranch, event: np.void) -> dict | None:
    """Return what a strip does that is pushed past a fold, for the page; None unless it is stable on one side of the fold.

    ``kappa_n`` is where it is let go; ``ends`` are the states in which it comes to rest, of both metrics and both signs of the
    kick, each once; ``columns`` and ``shapes`` are on the first of these ways. Or ``failed`` is a sentence.
    """
    if "index_before" not in event.dtype.names or 0 not in (event["index_before"], event["index_after"]):
        return None
    point, limit = int(event["point"]), float(event["kappa_n"])
    kappa_n = past(limit, 1 if branch.points["kappa_n"][point - 1] < limit else -1)
    try:
        strip = replace(discretized(branch.solution(point).equilibrium(), SEGMENTS), kappa_n=kappa_n)
        ways = [let_go(strip, metric, sign) for metric in METRICS for sign in (1, -1)]
    except (ArithmeticError, ConvergenceError, ValueError) as error:
        return {"kappa_n": kappa_n, "failed": str(error)}
    ends = {str(rest): rest for _, rest in ways}
    told = [{"name": name, "kind": one.kind, "m": one.m, "n": one.n, "energy": one.energy} for name, one in ends.items()]
    way = ways[0][0]  # strips at equal distances along it, each turned so that it moves least
    strips = list(dict.fromkeys(way.frames(_FRAMES)))
    shapes = steady({number: strip.shape(MOST_NODES).placed(2 * math.pi) for number, strip in enumerate(strips)})
    columns = {"arclength": np.arange(len(strips)), "kappa_n": way.end.kappa_n, "energy": [one.energy for one in strips]}
    packed = {name: column(np.broadcast_to(numbers, len(strips)).astype(float)) for name, numbers in columns.items()}
    return {"kappa_n": kappa_n, "ends": told, "columns": packed, "shapes": compressed(states_of(shapes.values()))}


def states_of(shapes: Iterable[Shape]) -> np.ndarray:
    """Return the states of shapes at their nodes, shape (shapes, nodes, len(CHANNELS))."""
    values = np.array([np.column_stack([quaternions(shape.directors), shape.eta, shape.centreline]) for shape in shapes])
    for before, here in zip(values, values[1:]):  # a quaternion and its negative are the same frame
        here[:, :4] *= math.copysign(1, np.vdot(before[:, :4], here[:, :4]))
    return values


# --- stages of open strips and networks ------------------------------------------------------------------------------

#: Nodes of a strip. Twice as many make pages twice as large; a quarter of them shows corners where a strip bends most.
_NODES = 97
#: A read-out has room for so many columns, without a need to scroll; of more, it has the numbers and what is conjugate to them.
_ROOM = 24
#: Decimals of values on the page, of a unit of the strip. Those from the ninth on are of round-off.
_DIGITS = 8
#: Distance of the eye from the middle of a state, in units of half the frame, and the part of it that a state fills.
_FAR, _FILLED = 1.1, 0.92


def stages_gathered(files: list[Path], title: str, slow: bool = True) -> dict:
    """Return the data of a page of open strips or networks, each stage as a branch; see `branches.explore.gather.gather`.

    With ``slow``, it says what strips do past folds, which takes seconds for each. Raises StoreError for a file of another kind
    or in other units, or without a column in common with the others.
    """
    kind = read_branch(files[0]).scene.KIND
    branches = [(path, read_kind(path, kind)) for path in files]
    first = branches[0][1]
    if len(units := {branch.titled("energy") for _, branch in branches}) > 1:
        raise StoreError(f"the results are in several units: {', '.join(sorted(units))}; a page shows results in the same ones")
    parameter = first.followed(int(first.points["stage"][-1]))
    common = set.intersection(*(set(branch.points.dtype.names) for _, branch in branches))
    columns = [name for name in first.columns.shown() if name in common]
    values = {name: [branch.points[name] for _, branch in branches] for name in columns}
    varying = [name for name in columns if any(np.ptp(x) > levels.LOCATED * (1 + np.abs(x).max()) for x in values[name])]
    if parameter not in varying:
        raise StoreError(f"the results have no column in common that is followed; that of the first one is {parameter!r}")
    shown = [parameter, first.conjugate(parameter)]
    brief = {"energy", "potential", *(first.conjugate(stage.follow) for stage in first.stages)}
    brief |= {name for name in varying if first.columns.all[name].role == NUMBER}
    stages, reach = [], 0.0
    kept = [*dict.fromkeys([*varying, *shown])]
    for path, branch in branches:
        snaps = {fall.row: f"Let go past it, the strip {told(branch, fall)}." for fall in falls(branch)} if slow else {}
        at, scale = np.linspace(0, 1, _NODES), 2 * np.pi / branch.shape_length
        found = {number: one for number, one in enumerate(solutions(branch)) if one is not None}
        drawn = [branch.shape_at(number, at, system.evaluate(x, at))[0] for number, (system, x) in found.items()]
        shapes = dict(zip(found, branch.stood(drawn)))
        reach = max(reach, scale * max(np.linalg.norm(shape.centreline, axis=1).max() for shape in shapes.values()))
        about = "" if len(branches) == 1 else f"{path.stem}, "
        stages += [one | {"name": about + one["name"]} for one in _stages(path, branch, kept, shapes, snaps)]
    return {
        "title": title or first.config["title"] or first.scene.name, "kind": "open",
        "axes": [
            (name, brief if words == name else f"{words} ({brief})", brief, max(0, _DIGITS - math.floor(math.log10(factor))))
            for name, words, _ in first.columns.axes(varying)
            for brief, factor in [(first.titled(name), first.scene.factor(name))]
        ],
        "width": 100 * (first.width_at(1.0, None) or OPEN_WIDTH),
        "shown": shown, "told": [name for name in varying if len(varying) <= _ROOM or name in brief], "scale": _FILLED / reach,
        "eye": (_FAR * first.view.axes[2]).tolist(),
        "families": [{"name": "stages", "parameter": parameter, "branches": stages, "circles": []}],
    }  # fmt: skip


def _stages(
    path: Path, branch: StoredBranch, columns: list[str], shapes: dict, snaps: Mapping[int, str]
) -> Iterator[dict]:  # fmt: skip
    unit, strips = 2 * np.pi / branch.shape_length, [states_of(one) for one in zip(*map(parts_of, shapes.values()))]
    for values in strips:
        values[..., -3:] *= unit  # lengths are up to 2 pi
    states = filled(branch, list(shapes), np.concatenate(strips, axis=-1))  # those of the strips side by side
    for number in np.unique(branch.stage_of):
        first = next(shape for point, shape in shapes.items() if branch.stage_of[point] == number)
        about = _stage(path, branch, int(number), columns, snaps) | {"shapes": compressed(states[branch.stage_of == number])}
        fixtures = first.fixtures if isinstance(first, Structure) else ()  # a strip alone has none
        yield about | {"fixtures": [_fixture(branch, int(number), one, unit) for one in fixtures]}


def _fixture(branch: StoredBranch, stage: int, one: Fixture, unit: float) -> dict:
    """Return a joint, support or force: its place, the profile around its first axis, the signs of a force at the points."""
    about = {
        "part": one.part, "last": one.last, "held": one.held, "inSpace": one.in_space, "arm": [unit * x for x in one.arm],
        "axes": one.axes.tolist(), "sides": one.turned[0], "profile": one.turned[1].tolist(),
    }  # fmt: skip
    if not one.number:
        return about
    return about | {"signs": column(np.sign(branch.force(one.number)[branch.stage_of == stage]).astype(int))}


def _stage(path: Path, branch: StoredBranch, number: int, columns: list[str], snaps: Mapping[int, str]) -> dict:
    rows = np.flatnonzero(branch.stage_of == number)
    labels = [branch.points["label"][row].decode() for row in rows]
    names = {int(event["point"]): event["name"].decode() for event in branch.events}
    last, singular = number == branch.points["stage"][-1], [bool(label) and label_of(label).singular for label in labels]
    table = {name: branch.measured(name)[0][rows] for name in columns}
    table |= {name: branch.points[name][rows] for name in ("arclength", "index")}
    table["index"] = np.where(singular, UNKNOWN, table["index"])  # there, that of one side is as good as that of the other
    if (table["index"] == UNKNOWN).all():  # as under loads without an energy
        del table["index"]
    after = {int(event["point"]): int(event["index_after"]) for event in branch.events}
    about = marked(labels, [names.get(int(row), "") for row in rows])
    count: collections.Counter = collections.Counter()
    for mark in about["marks"]:  # as `start_at` of a scene names them
        label, row = labels[mark["point"]], int(rows[mark["point"]])
        if row in snaps:
            mark["fall"] = snaps[row]
        if after[row] >= 0:
            mark["index_after"] = after[row]
        if names.get(row) != START:
            count[label] += 1
            mark["tag"] = f"{label} {count[label]}"
    return {
        "profile": True, "domain": "open", "name": f"stage {number}: {branch.followed(number)}",
        "file": f"{path.stem}_{number}.h5", "stop": branch.stop if last else "", **about,
        "columns": {name: column(values) for name, values in table.items()}, "components": [],
    }  # fmt: skip


# --- the solution of every point: read where the file keeps it, otherwise computed from the one before ---------------

#: Newton's tolerance, and the largest difference from the columns, relative to 1 + their size: shapes need four
#: digits, and the mesh is that of a kept solution from before, which may be too coarse here for more.
_TOLERANCE, _SAME = 1e-8, 1e-4

#: A discretized problem and its unknowns.
Discretized = tuple[Collocation, np.ndarray]


def solutions(branch: StoredBranch) -> list[Discretized | None]:
    """Return the solution of every point, in order; None for a point at which Newton's method does not find it.

    The parameters of a point are columns, so solutions between two that the file keeps are found as on the branch itself, by a
    secant and Newton's method: from the first of the two on its mesh, and where that fails from the second on its mesh. Raises
    StoreError where a solution that the file keeps does not belong to the columns of its point.
    """
    kept = {number: _kept(branch, number) for number in branch.kept().tolist()}
    found: list[Discretized | None] = [kept.get(number) for number in range(len(branch.points))]
    numbers = list(kept)
    for first, last in itertools.pairwise(numbers):
        for number, solution in _walk(branch, kept, range(first, last), last):
            found[number] = solution
        for number, solution in _walk(branch, kept, range(last, first, -1), first):
            if found[number] is not None:
                break
            found[number] = solution
    other, last = numbers[-2:][0], numbers[-1]
    other = other if branch.stage_of[other] == branch.stage_of[last] else last
    for number, solution in _walk(branch, kept, range(last, len(found)), other):  # an interrupted run
        found[number] = solution
    return found


def filled(branch: StoredBranch, known: Sequence[int], values: np.ndarray) -> np.ndarray:
    """Return values (points, ...) of all points from those of the ``known`` ones: linear over arclength between neighbours."""
    if len(known) == len(branch.points):
        return values
    place = np.interp(branch.way, branch.way[known], np.arange(len(known)))
    low = np.minimum(place.astype(int), len(known) - 2)
    part = (place - low)[:, None, None]
    return (1 - part) * values[low] + part * values[low + 1]


def _kept(branch: StoredBranch, number: int) -> Discretized:
    """Return a solution that the file keeps; raise StoreError unless it solves the equations with the columns of its point."""
    system, x = branch.discretized(number)
    residual = np.abs(system.residual(x)).max()
    if not residual <= levels.APART * (1 + np.abs(system.parameters).max()):
        raise StoreError(f"{branch.about}: point {number}: its columns are not those of its solution")
    return system, x


def _walk(
    branch: StoredBranch, kept: dict[int, Discretized], numbers: range, other: int
) -> Iterator[tuple[int, Discretized]]:  # fmt: skip
    """Yield the later points of ``numbers`` with their solutions on its mesh; the first step is the secant from ``other``."""
    system, x = kept[numbers[0]]
    if len(numbers) == 1:
        return
    there, arclength = kept[other], branch.points["arclength"]
    known = [name for name in system.free if name in branch.points.dtype.names]
    before = arclength[other], there[0].evaluate(there[1], system.nodes)
    here = arclength[numbers[0]], system.states(x)
    for number in numbers[1:]:
        row = branch.points[number]
        values = {name: system.parameter(x, name) for name in system.free} | {name: float(row[name]) for name in known}
        ratio = (row["arclength"] - here[0]) / (here[0] - before[0]) if here[0] != before[0] else 0.0
        guess = system.pack(here[1] + ratio * (here[1] - before[1]), values)
        found = next((one for one in _corrected(system, x, guess, known) if _fits(branch, number, system, one)), None)
        if found is None:
            return
        before, here, x = here, (row["arclength"], system.states(found)), found
        yield number, (system, x)


def _fits(branch: StoredBranch, number: int, system: Collocation, x: np.ndarray) -> bool:
    """Return whether a solution has the columns of a point: beside a fold, another one has the same parameter."""
    names, row = branch.columns.shown(), branch.points[number]
    values = branch.stage_at(number).values(point_of(system, x), names)
    return all(abs(values[name] - row[name]) <= _SAME * (1 + abs(row[name])) for name in names)


def _corrected(system: Collocation, last: np.ndarray, guess: np.ndarray, known: Sequence[str]) -> Iterator[np.ndarray]:
    """Yield solutions near a guess; each holds one of the ``known`` numbers, first the one that has changed most."""
    places = np.array([system.parameter_index(name) for name in known])
    order = np.argsort(np.abs(guess[places] - last[places]) / (1 + np.abs(guess[places])))[::-1]
    for steps, held in itertools.product((1, 4), places[order]):
        row, x, past = np.eye(1, system.size, held)[0], last, last - (guess - last) / steps
        with contextlib.suppress(ConvergenceError):
            for step in range(1, steps + 1):
                target = last[held] + (guess[held] - last[held]) * step / steps
                past, x = x, correct(system, 2 * x - past, row, target, Newton(_TOLERANCE)).x
            yield x
