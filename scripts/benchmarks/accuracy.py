"""Error against time: Bratu's fold, and a cycle of Lorenz's equations, by three programs at many settings.

Bratu's problem is followed from u = 0 to its fold (closed form), cycles from the Hopf point to the period 2 (against shooting
with SciPy's DOP853). Times are those of the processor, as in `benchmarks.cycles`: all that leads to the number, in a process
that has started. ``solve_bvp`` is driven as `peers.scipy_small` says.
"""

from __future__ import annotations

import math
import time
from collections.abc import Callable
from types import SimpleNamespace

import numpy as np
from peers import auto_07p, scipy_small
from scipy.integrate import solve_ivp
from scipy.optimize import brentq, fsolve

import contin
from benchmarks import cycles
from benchmarks.fold import best
from benchmarks.measure import in_turn, median
from contin.levels import ROUND_OFF

CONTIN, AUTO, SCIPY = "contin", "AUTO-07p", "SciPy solve_bvp"
BRATU, LORENZ = "Bratu's fold", "a cycle of Lorenz's equations"
PERIOD = cycles.BRANCHES["lorenz"][-1]


def run(quick: bool) -> dict:
    """Return all measurements by problem, the fastest settings by program and error, and the programs left out."""
    reason = auto_07p.missing()
    programs: dict[str, tuple[float, dict[tuple[str, str], Callable[[], dict]]]] = {
        BRATU: (_exact_fold(), _bratu(reason is None)), LORENZ: (_exact_cycle(), _lorenz(reason is None)),
    }  # fmt: skip
    found = {}
    for problem, (exact, contestants) in programs.items():
        runs = in_turn(contestants, 3 if quick else 9)
        rows = [
            {"tool": tool, "setting": setting, "seconds": median(row["seconds"] for row in some),
             "error": max(abs(some[-1]["value"] / exact - 1), ROUND_OFF / 10)}
            for (tool, setting), some in runs.items()
        ]  # fmt: skip
        found[problem] = {"rows": rows, "best": best(rows), "exact": exact}
    return {"problems": found, "skipped": {} if reason is None else {AUTO: reason}}


def _exact_fold() -> float:
    """Return lambda = 8 (theta / cosh theta)^2 with theta tanh theta = 1."""
    theta = brentq(lambda theta: theta * math.tanh(theta) - 1, 1, 2, xtol=1e-15)
    return float(8 * (theta / math.cosh(theta)) ** 2)


def _exact_cycle() -> float:
    """Return r where the cycle has the period, by shooting from z = r - 1."""
    field = cycles.BRANCHES["lorenz"][0]

    def missed(unknowns):
        x, y, r = unknowns

        def rates(t, u):
            return field(SimpleNamespace(**dict(zip("xyz", u))), SimpleNamespace(r=r))

        end = solve_ivp(rates, (0, PERIOD), [x, y, r - 1], method="DOP853", rtol=1e-13, atol=1e-13).y[:, -1]
        return end - [x, y, r - 1]

    return float(fsolve(missed, [10.504787, 13.783083, 14.25866], xtol=1e-13)[-1])


def _timed(value: Callable[[], float]) -> Callable[[], dict]:
    def run() -> dict:
        began = time.process_time()
        found = value()
        return {"seconds": time.process_time() - began, "value": found}

    return run


def _fixed(intervals: int) -> contin.MeshControl:
    return contin.MeshControl(min_intervals=intervals, max_intervals=intervals)


def _bratu(auto: bool) -> dict[tuple[str, str], Callable[[], dict]]:
    """Return what computes the fold, by program and setting: intervals, degree, tolerance."""
    problem = contin.BoundaryValueProblem(
        lambda t, u, p: (u.v, -p.lam * math.exp(u.u)), lambda a, b, p: (a.u, b.u), ["u", "v"], {"lam": 0.0}
    )

    def ours(n: int, degree: int, tolerance: float) -> float:
        options = {"mesh": _fixed(n), "newton": contin.Newton(tolerance)}
        start = contin.solve(problem, [0.0, 0.0], degree=degree, intervals=n, **options)
        settings = contin.Settings(step=0.5, errors=False, branch_points=False, **options)
        system, x = start.system.with_free(["lam"], start.x)
        return next(p for p in contin.lowlevel.Continuation(system, x, settings) if p.label == "LP")["lam"]

    def theirs(n: int, degree: int, tolerance: float) -> dict:
        found = auto_07p.bratu(n, degree, tolerance, longest_step=2.0)
        return {"seconds": min(found["seconds"], found["processor_seconds"]), "value": found["fold"]}

    meshes = [(3, 3), (3, 4), (4, 4), (3, 5), (5, 4), (4, 5), (5, 5), (4, 6), (10, 4), (5, 6), (5, 7), (20, 4)]
    tolerances = (1e-6, 1e-10)
    found = {}
    for n, d, t in ((*mesh, t) for mesh in meshes for t in tolerances):
        found[CONTIN, f"{n} × {d}, {t:.0e}"] = _timed(lambda n=n, d=d, t=t: ours(n, d, t))
        if auto:
            found[AUTO, f"{n} × {d}, {t:.0e}"] = lambda n=n, d=d, t=t: theirs(n, d, t)
    return found | {(SCIPY, f"{t:.0e}"): _timed(lambda t=t: scipy_small.bratu(t)) for t in 10.0 ** -np.arange(3, 11)}


def _lorenz(auto: bool) -> dict[tuple[str, str], Callable[[], dict]]:
    """Return what computes r, by program and setting."""
    hopf, found = cycles._hopf("lorenz"), {}

    def ours(mesh: contin.MeshControl, tolerance: float) -> dict:
        done = cycles._followed("lorenz", hopf, mesh, contin.Newton(tolerance))
        return {"seconds": done["seconds"], "value": done["parameter"]}

    def theirs(n: int, degree: int, tolerance: float) -> dict:
        done = cycles._by_auto("lorenz", PERIOD, 0.1, {"intervals": n, "degree": degree, "tolerance": tolerance})
        return {"seconds": done["seconds"], "value": done["parameter"]}

    for t in (1e-4, 1e-5, 1e-6, 1e-7, 1e-8, 1e-9, 1e-10, 1e-11, 1e-12):
        mesh = contin.MeshControl(tolerance=t)
        found[CONTIN, f"tolerance {t:.0e}"] = lambda mesh=mesh, t=t: ours(mesh, max(t / 10, 1e-12))
    for n, degree in ((12, 4), (20, 4), (40, 4), (80, 4), (160, 4), (15, 6), (27, 6), (40, 6), (30, 7), (50, 7)):
        for t in (1e-7, 1e-10):
            if auto:
                found[AUTO, f"{n} × {degree}, {t:.0e}"] = lambda n=n, degree=degree, t=t: theirs(n, degree, t)
    return found | {(SCIPY, f"{t:.0e}"): _timed(lambda t=t: scipy_small.lorenz(t)) for t in 10.0 ** -np.arange(3, 10)}


def table(results: dict) -> str:
    """Return the times to relative errors as Markdown."""
    heads = list(next(iter(next(iter(results["problems"].values()))["best"].values())))
    lines = ["| | program | " + " | ".join(f"to {head}" for head in heads) + " |", "|---|---|" + "---|" * len(heads)]
    for problem, found in results["problems"].items():
        for tool, cells in found["best"].items():
            texts = ["not reached" if row is None else f"{1e3 * row['seconds']:.1f} ms" for row in cells.values()]
            lines.append(f"| {problem} | {tool} | {' | '.join(texts)} |")
    return "\n".join(lines)
