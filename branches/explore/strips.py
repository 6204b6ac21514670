"""Branch files of closed strips for the page: branches and circles with their columns, and a shape for every point.

A shape is kept as the states at a few equidistant nodes of the domain that was solved (a quarter wave of most branches), in 16
bits a number; the browser unfolds it by the symmetries of `ribbon_model.shape`.
"""

from __future__ import annotations

import itertools
import math
from pathlib import Path

import numpy as np

from branches.config import Config, dump
from branches.explore.packing import packed, quantised
from branches.files import StoreError
from branches.labels import ON_PAGE, kind_of
from branches.read import StoredBranch
from contin import exact_text
from ribbon_model.domains import DOMAINS
from ribbon_model.equilibrium import directors
from ribbon_model.laws import LAWS, from_label, label
from ribbon_model.linear import circle, covering, energy_interval, index

#: What is kept of a shape at each node, in this order.
CHANNELS = ("q0", "q1", "q2", "q3", "eta", "x1", "x2", "x3")
#: Columns that the map can draw: name, title, and a short name, in HTML. The page makes the last one, energy + kappa_n^2 / 2.
AXES = (
    ("kappa_n", "natural curvature κ<sub>n</sub>L/2π", "κ<sub>n</sub> L/2π"),
    ("kappa_star", "conjugate curvature κ*", "κ*"),
    ("energy", "energy, in units 2πB/L", "energy"),
    ("elastic", "elastic energy (energy + κ<sub>n</sub>²/2), in units 2πB/L", "elastic energy"),
)
#: Columns of a circle: those of every law that the page reads.
CIRCLE_COLUMNS = ("kappa_n", "kappa_star", "energy", "index")
#: The index where a whole band of wavenumbers is unstable, which no number counts; and where it is not known.
INFINITE, UNKNOWN = -2, -1
#: About so many nodes make a closed strip; a quarter wave has no fewer than the second number.
_LOOP_NODES, _FEWEST = 384, 16
#: Circles reach a little farther in kappa_n than the branches do, so that they are there at the outermost fold (ten times more
#: would leave a fifth of the map to them), in about twice so many steps. (On a circle all columns are parabolas.)
_BEYOND, _CIRCLE_STEPS = 0.02, 50
#: An integration takes a few hundred evaluations; the end conditions, which hold moments, are met to about 1e-6 of those.
_MOST_EVALUATIONS, _OPEN = 50_000, 1e-3


def material(branch: StoredBranch) -> tuple:
    """Return what the branches of one family share: the place of their law, Gamma (-1 without) and nu."""
    Gamma = branch.config["Gamma"]
    return list(LAWS).index(branch.config["law"]), -1.0 if Gamma is None else Gamma, branch.config["nu"]


def family(found: list[tuple[Path, StoredBranch]]) -> dict:
    """Return the branches of one law and nu, and the circles that they meet.

    Raises
    ------
    StoreError
        A branch has fewer than two points, or columns that are not those of a closed strip.
    """
    for path, branch in found:
        if len(branch.points) < 2:
            raise StoreError(f"{str(path)!r} holds {len(branch.points)} points; a branch has two at least")
    config = found[0][1].config
    law, nu = label(config["law"], config["Gamma"]), config["nu"]
    branches = [_branch(path, branch) for path, branch in found]
    branches.sort(key=lambda branch: (branch["m"] * branch["n"], branch["m"], "origin" in branch))
    ends = [end for _, branch in found for end in (branch.points["kappa_n"].min(), branch.points["kappa_n"].max())]
    coverings = {branch["m"] for branch in branches} | {branch["to"] for branch in branches if branch["to"] is not None}
    bifurcations = [mark for branch in branches for mark in branch["marks"] if mark["kind"] == "circle"]
    beyond = _BEYOND * (max(ends) - min(ends))
    reach = float(min(ends) - beyond), float(max(ends) + beyond)
    circles = [_circle(law, nu, m, reach, bifurcations) for m in sorted(coverings)]
    about = {"name": f"{law}, ν = {exact_text(nu)}", "law": law, "nu": nu, "parameter": "kappa_n"}
    return about | {"branches": branches, "circles": circles}


# --- branches -----------------------------------------------------------------------------------------------------


def _branch(path: Path, branch: StoredBranch) -> dict:
    config, points = branch.config, branch.points
    names = [name for name in points.dtype.names if points.dtype[name].kind in "if" and name != "length"]
    marks = [_mark(event, branch.reason, bool(config["origin"])) for event in branch.events]
    values, scale = quantised(shapes(branch))
    about = {
        "m": config["m"], "n": config["n"], "to": marks[-1].get("covering"), "domain": config["domain"], "stop": branch.stop,
        "file": path.name, "config": dump(Config.model_validate(config)), "marks": marks,
        "labels": [name.decode() for name in points["label"]],
        "columns": {name: packed(points[name], "<f8") for name in names},
        "nodes": values.shape[1], "shapes": packed(values, "<i2"), "scale": packed(scale, "<f8"),
    }  # fmt: skip
    return about | ({"origin": config["origin"]["kappa_n"], "mode": config["origin"]["mode"]} if config["origin"] else {})


def _mark(event, reason: str, secondary: bool) -> dict:
    """A labelled point: its number, kind, and what it is called."""
    name, place = event["name"].decode(), {"point": int(event["point"])}
    values = {column: float(event[column]) for column in ("kappa_n", "kappa_star", "energy")}
    if not all(map(math.isfinite, values.values())):
        raise StoreError(f"the labelled point {event['point']} has columns that are no numbers")
    kind = kind_of(event["label"].decode(), name, reason, secondary)
    if kind == "circle":
        return place | {"kind": kind, "covering": covering(**values)} | values
    return place | {"kind": ON_PAGE.get(kind, "end"), "name": name} | values


def shapes(branch: StoredBranch) -> np.ndarray:
    """Every point's states at equidistant nodes of the domain, shape (points, nodes, len(CHANNELS)).

    All of a solution follows from the moment and force at S = 0, which are columns: the equations of the domain are integrated
    from there, whether the file keeps the solution or not.

    Raises
    ------
    StoreError
        The columns of a point are not those of a closed strip.
    """
    config = branch.config
    domain = DOMAINS[config["domain"]]
    problem = domain.problem(LAWS[config["law"]])
    t = np.linspace(0, 1, max(_FEWEST, math.ceil(_LOOP_NODES / domain.parts(config["n"]))) + 1)
    name = f"branch ({config['m']}, {config['n']})"
    return np.array([_integrated(problem, row, t, f"{name}, point {row['point']}") for row in branch.points])


def _integrated(problem, row, t, name: str) -> np.ndarray:
    """The states of one point at t, shape (len(t), len(CHANNELS)); it is called ``name`` in messages."""
    from scipy.integrate import solve_ivp

    wrong = StoreError(f"{name}: its columns are not those of a closed strip")
    parameters = np.array([row[name] if name in row.dtype.names else value for name, value in problem.parameters.items()])
    field, none, size = problem.batch("field"), np.empty((0, len(problem.states))), len(problem.states)
    evaluations = itertools.count()

    def rates(s, u):
        frame = field.values(np.array([s]), u[None, :size], none, parameters)[0]
        if next(evaluations) > _MOST_EVALUATIONS or not np.isfinite(frame).all():
            raise wrong
        return frame if size > 4 else np.append(frame, row["length"] * np.array(directors(*u[:4])[6:]))

    start = np.array([1.0, 0, 0, 0, 0, 0, 0])
    states = solve_ivp(rates, (0, 1), start, method="DOP853", t_eval=t, rtol=1e-9, atol=1e-10).y.T
    frames = np.ascontiguousarray(states[:, :size])
    open_ends = problem.batch("boundary").values(t[:1], frames[:1], frames[-1:], parameters)
    if len(states) < len(t) or np.abs(open_ends).max() > _OPEN * (1 + np.abs(parameters).max()):
        raise wrong
    q0, q1, q2, q3 = states[:, :4].T
    p0, p1, p2, p3 = field.values(t, frames, none, parameters)[:, :4].T
    omega_1 = q0 * p1 - q1 * p0 - q2 * p3 + q3 * p2  # times length / 2: `spin` of the equations, inverted
    omega_3 = q0 * p3 - q3 * p0 - q1 * p2 + q2 * p1
    eta = np.divide(omega_3, omega_1, out=np.zeros_like(t), where=omega_1 != 0)
    return np.column_stack([states[:, :4], eta, states[:, 4:]])


# --- circles ------------------------------------------------------------------------------------------------------


def _circle(law: str, nu: float, m: int, ends: tuple[float, float], bifurcations: list[dict]) -> dict:
    """The planar m-covered circle, with its bifurcations among its points."""
    material, Gamma = from_label(law)
    neutral = [mark["kappa_n"] for mark in bifurcations if mark["covering"] == m]
    if m >= 1:
        neutral += [m * end for end in energy_interval(material, m, nu, Gamma) if ends[0] < m * end < ends[1]]
    kappa_n = np.unique(np.round(np.append(np.linspace(*ends, _CIRCLE_STEPS + 1), neutral), 9))
    kappa_n = np.sort(np.append(kappa_n, (kappa_n[1:] + kappa_n[:-1]) / 2))  # one between any two neutral ones
    values = [circle(material, m, k, nu, Gamma) for k in kappa_n]
    columns = {"kappa_n": kappa_n, "index": [_circle_index(material, m, k, nu, Gamma, neutral) for k in kappa_n]}
    columns |= {name: [value[name] for value in values] for name in ("kappa_star", "energy")}
    return {"m": m, "columns": {name: packed(columns[name], "<f8") for name in CIRCLE_COLUMNS}}


def _circle_index(law, m, kappa_n, nu, Gamma, neutral) -> int:
    # curled against its natural curvature (m < 1) the linear theory at hand does not count
    if m < 1 or np.isclose(kappa_n, neutral, rtol=0, atol=1e-8).any():
        return UNKNOWN
    count = index(law, m, kappa_n, nu, Gamma)
    return INFINITE if math.isinf(count) else int(count)
