"""Branch files of closed strips for the page: branches and circles with their columns, and a shape for every point.

A shape is kept as the states at a few nodes of the domain that was solved (a quarter wave of most branches), compressed along
the branch; the browser unfolds it by the symmetries of `ribbon_model.shape`.
"""

from __future__ import annotations

import functools
import math
from pathlib import Path

import numpy as np
from threadpoolctl import ThreadpoolController

from branches.explore.packing import column, compressed
from branches.explore.snaps import way_down
from branches.explore.solutions import filled, solutions
from branches.scene.closed import ClosedScene, and_nu, law_of
from branches.scene.labels import ON_PAGE, kind_of
from branches.store.branch import StoredBranch
from branches.store.files import StoreError
from branches.store.layout import CLOSED
from branches.store.read import read_kind
from contin.lowlevel import Label
from ribbon_model import exact
from ribbon_model.domains import DOMAINS
from ribbon_model.equilibrium import strains_of
from ribbon_model.laws import FINITE_WIDTH, LAWS, PAPER_LAWS
from ribbon_model.linear import circle, covering, energy_interval, index
from ribbon_model.shape import shape_of
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
    a law that the page does not know.

    Raises
    ------
    StoreError
        The file cannot be read, or it holds fewer than two points.
    """
    with _blas().limit(limits=1, user_api="blas"):  # more threads only slow down matrices this small
        return _branch(path, read_kind(path, CLOSED), slow)


@functools.cache
def _blas() -> ThreadpoolController:
    return ThreadpoolController()


def _branch(path: Path, branch: StoredBranch, slow: bool) -> dict:
    config, points = branch.config, branch.points
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
        "axes": branch.columns.axes([*branch.columns.mapped("kappa_n"), "elastic"]), "family": _family(branch.scene),
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


def _family(scene: ClosedScene) -> tuple:
    """Return what the branches of one family share: the place of their law, its parameters, nu, and the law in words."""
    return list(LAWS).index(scene.law), -1.0 if scene.Gamma is None else scene.Gamma, scene.nu, scene.material


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


# --- branches -----------------------------------------------------------------------------------------------------


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
