"""Cycles: branches from a Hopf point to a given period, with multipliers at every orbit, by contin and AUTO-07p.

Both have 27 intervals of degree 6, adapted every third step, and the same tolerance. AUTO-07p has analytic Jacobians. The error
is that of the parameter at the last orbit, against contin with as many intervals as the tolerance 1e-12 takes. Times are those
of the processor, so that other programs hardly change them: of contin's process, and of AUTO-07p's, or the time that AUTO-07p
prints if that is less.
"""

from __future__ import annotations

import math
import time

from peers import auto_07p, auto_cycles

import contin
from benchmarks.measure import in_turn, median
from contin.collocation.mesh import CYCLE_DEGREE

INTERVALS, DEGREE, TOLERANCE = 27, CYCLE_DEGREE, 1e-8


def _lorenz(u, p):
    return 10 * (u.y - u.x), p.r * u.x - u.y - u.x * u.z, u.x * u.y - 8 / 3 * u.z


def _predator(u, p):
    return 3 * u.x * (1 - u.x) - u.x * u.y - p.m * (1 - math.exp(-5 * u.x)), 3 * u.x * u.y - u.y


_X = math.sqrt(8 / 3 * 19)
#: Vector field, parameter with its first value, equilibrium there, the way to the Hopf point, and the last period. The second
#: is AUTO-07p's demo ``pp2``.
BRANCHES = {
    "lorenz": (_lorenz, {"r": 20.0}, {"x": _X, "y": _X, "z": 19.0}, 1, 2.0),
    "predator": (_predator, {"m": 0.5}, {"x": 1 / 3, "y": 2 - 1.5 * (1 - math.exp(-5 / 3))}, 1, 20.0),
}


def run(quick: bool) -> dict:
    """Return times by branch and program."""
    results, skipped = {}, {}
    if (reason := auto_07p.missing()) is not None:
        skipped["AUTO-07p"] = reason
    for name, (*_, way, last) in BRANCHES.items():
        hopf = _hopf(name)
        exact = _followed(name, hopf, contin.MeshControl(), contin.Newton())["parameter"]
        mesh = contin.MeshControl(min_intervals=INTERVALS, max_intervals=INTERVALS)
        contestants = {"contin": lambda: _followed(name, hopf, mesh, contin.Newton(TOLERANCE))}  # noqa: B023
        if not skipped:
            settings = {"intervals": INTERVALS, "degree": DEGREE, "tolerance": TOLERANCE}
            contestants["AUTO-07p"] = lambda: _by_auto(name, last, 0.1 * way, settings)  # noqa: B023
        runs = in_turn(contestants, 3 if quick else 15)
        results[name] = {program: _summary(some, exact) for program, some in runs.items()}
    return {"results": results, "skipped": skipped}


def _hopf(name: str) -> contin.Point:
    field, values, rest, way, _ = BRANCHES[name]
    point = contin.solve(contin.AlgebraicProblem(field, list(rest), values), list(rest.values()))
    return contin.trace(point, free=list(values), direction=way, max_points=200).labelled("HB")[0]


def _followed(name: str, hopf: contin.Point, mesh: contin.MeshControl, newton: contin.Newton) -> dict:
    """Return the processor time of contin."""
    _, values, *_, last = BRANCHES[name]
    (parameter,) = values
    began = time.process_time()
    branch = contin.trace(hopf, branch=1, limits={"period": (0, last)}, mesh=mesh, newton=newton, errors=False)
    return {"seconds": time.process_time() - began, "points": len(branch), "parameter": branch.points[-1][parameter]}


def _by_auto(name: str, last: float, step: float, settings: dict) -> dict:
    found = auto_cycles.study(name, last, step, **settings)
    seconds = min(found["seconds"], found["processor_seconds"])  # the second one includes the start of the process
    return {"seconds": seconds, "points": found["points"], "parameter": found["parameter"]}


def _summary(runs: list[dict], exact: float) -> dict:
    row = runs[-1]
    seconds = median(each["seconds"] for each in runs)
    error = abs(row["parameter"] - exact)
    return {"seconds": seconds, "points": row["points"], "per_orbit": seconds / row["points"], "error": error}


def ratio(results: dict) -> float | None:
    """Return the least time per orbit of AUTO-07p over that of contin; None without AUTO-07p."""
    return min(_ratios(results, "per_orbit").values(), default=None)


def _ratios(results: dict, what: str) -> dict[str, float]:
    """Return one of the times of AUTO-07p over that of contin, by branch."""
    known = {name: row for name, row in results["results"].items() if "AUTO-07p" in row}
    return {name: row["AUTO-07p"][what] / row["contin"][what] for name, row in known.items()}


def table(results: dict) -> str:
    """Return the results as a Markdown table."""
    heads = ["cycles of", "program", "processor time, branch", "orbits", "time an orbit", "error at the end"]
    lines = [f"| {' | '.join(heads)} |", "|---" * len(heads) + "|"]
    for name, rows in results["results"].items():
        for program, row in rows.items():
            times = f"{1e3 * row['seconds']:.0f} ms | {row['points']} | {1e3 * row['per_orbit']:.2f} ms"
            lines.append(f"| {name} | {program} | {times} | {row['error']:.0e} |")
    for what, words in (("per_orbit", "an orbit"), ("seconds", "a branch")):
        ratios = ", ".join(f"{value:.2f} ({name})" for name, value in _ratios(results, what).items())
        lines += ["", f"Ratio for {words}, AUTO-07p / contin: {ratios}."] * bool(ratios)
    return "\n".join(lines)
