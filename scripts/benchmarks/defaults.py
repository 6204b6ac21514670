"""The default degree and tolerance against other settings, on the problems of the test bank and on larger ones.

Every boundary value problem of the bank is run at the defaults, and at other degrees with the tolerances 1e-12 (the default)
and 1e-8. A setting counts if it finds all special points with errors below 1e-9. Times are processor times, medians of several
runs in turns where the first runs show that another setting may be faster.
"""

from __future__ import annotations

import functools
import importlib
import math
import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from types import ModuleType

import contin
from benchmarks.measure import median

#: Degrees and tolerances besides the defaults.
SETTINGS = (*((degree, 1e-12) for degree in range(4, 9)), *((degree, 1e-8) for degree in (5, 6, 7)))
#: The defaults, and what they were before the degree was chosen.
DEFAULT, FIXED = (None, 1e-12), (4, 1e-12)
#: Largest error of a setting that counts, relative to max(1, |value|): that of the tests on the bank.
ACCURATE = 1e-9
#: All settings are run again where the defaults took so many times the best one: so often if a run is shorter than 1 s, or not.
CLOSE, AGAIN = 1.25, (6, 2)
#: So many rows of the bank stand in the table: those in which the defaults are furthest from the best.
ROWS = 12


@dataclass(frozen=True)
class Task:
    """A run: ``run(degree, tolerance)`` returns its branch. ``exact`` lists its special points: label, values, uncertainty."""

    name: str
    run: Callable[[int | None, float], contin.Branch]
    exact: list[tuple[str, dict[str, float], float]]
    of_bank: bool = True


# --- the bank ---------------------------------------------------------------------------------------------------------------


class _Bank:
    """The modules of the bank, run at other settings than they state."""

    def __init__(self) -> None:
        table = importlib.import_module("bank.table")
        self.modules = [importlib.import_module(f"bank.{name}") for name in (*table.BANK, *table.OUTSIDE)]
        self.options: dict = {}
        for module in self.modules:
            for name in ("solve", "trace", "run_until"):
                if name in vars(module):
                    setattr(module, name, self._at_settings(getattr(module, name), name == "solve"))

    def _at_settings(self, function, solves: bool):
        def call(*arguments, **given):
            kept = {name: value for name, value in given.items() if name not in ("degree", "mesh")}
            own = self.options if solves else {name: self.options[name] for name in ("mesh",)}
            return function(*arguments, **kept, **own)

        return call

    def tasks(self) -> Iterator[Task]:
        for module in self.modules:
            for case in module.CASES:
                exact = [(special.label, dict(special.values), special.error) for special in case.specials]
                yield Task(case.name, functools.partial(self._run, module, case), exact)

    def _run(self, module: ModuleType, case, degree: int | None, tolerance: float) -> contin.Branch:
        for name, function in vars(module).items():
            if hasattr(function, "cache_clear") and name != "problem":
                function.cache_clear()
        self.options = {"mesh": contin.MeshControl(tolerance=tolerance), "degree": degree}
        return case.run()


# --- larger problems --------------------------------------------------------------------------------------------------------


def _snake(length: float, degree: int | None, tolerance: float) -> contin.Branch:
    """Localized states of the Swift-Hohenberg equation with quadratic and cubic terms (Burke & Knobloch 2006), nu = 1.6."""
    mesh, r = contin.MeshControl(tolerance=tolerance), -0.04
    height = 2 * math.sqrt(-2 * r / (38 * 1.6**2 / 9 - 3))  # of the weakly nonlinear pulse

    def pulse(x):
        wave = height / math.cosh(math.sqrt(-r) / 2 * x)
        return wave * math.cos(x), -wave * math.sin(x), -wave * math.cos(x), wave * math.sin(x)

    start = contin.solve(_swift_hohenberg(length), pulse, intervals=60, degree=degree, mesh=mesh)
    return contin.trace(start, free=["r"], direction=-1, limits={"r": (-0.6, 0.0), "square": (0.01, 40)}, mesh=mesh)


@functools.cache
def _swift_hohenberg(length: float) -> contin.BoundaryValueProblem:
    return contin.BoundaryValueProblem(
        lambda t, u, p: (u.b, u.c, u.d, (p.r - 1) * u.a - 2 * u.c + 1.6 * u.a**2 - u.a**3),
        lambda a, b, p: (a.b, a.d, b.b, b.d),
        ["a", "b", "c", "d"], {"r": -0.04}, domain=(0.0, length), functionals={"square": lambda t, u, p: u.a**2},
    )  # fmt: skip


def _ring(n: int, steepness: float, degree: int | None, tolerance: float) -> contin.Branch:
    """n / 2 pendula on a ring, each driven and coupled to its neighbours; the steeper, the more intervals they need."""
    mesh = contin.MeshControl(tolerance=tolerance)
    start = contin.solve(_pendula(n, steepness), [0.0] * n, degree=degree, mesh=mesh)
    return contin.trace(start, free=["lam"], limits={"lam": (-0.1, 0.4)}, mesh=mesh)


@functools.cache
def _pendula(n: int, steepness: float) -> contin.BoundaryValueProblem:
    count = n // 2

    def rhs(t, u, p, out):
        for i in range(count):
            angle = u[2 * i]
            coupling = 0.3 * (u[2 * ((i + 1) % count)] - 2 * angle + u[2 * i - 2])
            out[2 * i] = steepness * u[2 * i + 1]
            out[2 * i + 1] = steepness * (coupling - p[0] * math.sin(angle) + 0.2 * math.cos(3 * t + i))

    def boundary(a, b, p, out):
        for i in range(count):
            out[2 * i], out[2 * i + 1] = a[2 * i], b[2 * i] - 0.1

    return contin.BoundaryValueProblem(rhs, boundary, n, {"lam": 0.0}, boundary_count=n)


def _larger(quick: bool) -> Iterator[Task]:
    runs = {"ring of 20 states, smooth": (_ring, 20, 1.0), "ring of 20 states, steep": (_ring, 20, 8.0)}
    if not quick:
        runs |= {
            "ring of 40 states, smooth": (_ring, 40, 1.0), "ring of 40 states, steep": (_ring, 40, 8.0),
            "snake, length 60": (_snake, 60.0),
        }  # fmt: skip
    for name, (function, *arguments) in runs.items():
        run = functools.partial(function, *arguments)
        finest = run(8, 1e-13)
        exact = [(p.label, {name: p[name] for name in p.system.free}, 0.0) for p in _labelled(finest)]
        yield Task(name, run, exact, of_bank=False)


# --- measurement ------------------------------------------------------------------------------------------------------------


def run(quick: bool) -> dict:
    """Return a row for every problem."""
    tasks = list(_Bank().tasks())
    rows = [_row(task) for task in [*(tasks[::8] if quick else tasks), *_larger(quick)]]
    return {"rows": [row for row in rows if row]}


def _row(task: Task) -> dict | None:
    """Measure a problem at all settings; None where it has no mesh."""
    first = task.run(*DEFAULT)  # loads compiled code
    system = first.points[0].system
    if not system.intervals:
        return None
    runs: dict = {setting: [_timed(task, setting)] for setting in (DEFAULT, *SETTINGS)}
    times, best, _ = _best(runs)
    if times[DEFAULT] > CLOSE * times[best]:
        for _ in range(AGAIN[times[DEFAULT] > 1]):
            for setting, some in runs.items():
                some.append(_timed(task, setting))
    times, best, equal = _best(runs)
    return {
        "name": task.name, "of_bank": task.of_bank, "states": len(system.problem.states), "degree": system.degree,
        "intervals": max(point.system.intervals for point in first), "error": runs[DEFAULT][0]["error"],
        "times": {f"{degree or 'default'}, {tolerance:.0e}": time for (degree, tolerance), time in times.items()},
        "best": best, "ratio": times[DEFAULT] / times[best], "ratio_equal": times[DEFAULT] / times[equal],
        "ratio_fixed": times[FIXED] / times[best],
    }  # fmt: skip


def _best(runs: dict) -> tuple[dict, tuple, tuple]:
    """Return the times of all settings, the fastest of those that are accurate, and that of the defaults' tolerance."""
    times = {setting: median(one["seconds"] for one in some) for setting, some in runs.items()}
    counting = {setting: times[setting] for setting, some in runs.items() if some[0]["error"] < ACCURATE}
    equal = {setting: time for setting, time in counting.items() if setting[1] == DEFAULT[1]}
    return times, min(counting, key=counting.__getitem__, default=DEFAULT), min(equal, key=equal.__getitem__, default=DEFAULT)


def _timed(task: Task, setting: tuple[int | None, float]) -> dict:
    began = time.process_time()
    try:
        branch = task.run(*setting)
    except (contin.ContinError, LookupError):
        branch = contin.Branch()
    return {"seconds": time.process_time() - began, "error": _error(branch, task)}


def _labelled(branch: contin.Branch) -> list[contin.Point]:
    return [point for point in branch.points[1:] if point.label]


def _error(branch: contin.Branch, task: Task) -> float:
    """Return the largest error beyond the uncertainty of the reference; infinity where the special points are others."""
    found = _labelled(branch)
    if [point.label for point in found] != [label for label, *_ in task.exact]:
        return math.inf
    return max(
        (
            max(0.0, abs(point[name] - value) / max(1.0, abs(value)) - uncertainty)
            for point, (_, values, uncertainty) in zip(found, task.exact)
            for name, value in values.items()
        ),
        default=0.0,
    )


def worst(results: dict, key: str = "ratio", of_bank: bool = True) -> float:
    """Return the largest time of the defaults, in terms of that of the best setting, over the bank or the larger problems."""
    return max((row[key] for row in results["rows"] if row["of_bank"] == of_bank), default=math.nan)


def table(results: dict) -> str:
    """Return the results as Markdown."""
    equal = "default / best at 1e-12"
    rows = sorted(results["rows"], key=lambda row: (row["of_bank"], -row["ratio"]))
    larger = sum(not row["of_bank"] for row in rows)
    lines = [
        f"| problem | states | degree | intervals | time | error | best setting | default / best | {equal} | degree 4 / best |",
        "|---|---|---|---|---|---|---|---|---|---|",
    ]
    for row in rows[: larger + ROWS]:
        degree, tolerance = row["best"]
        best = f"{degree or row['degree']}, {tolerance:.0e}"
        time_and_error = f"{1e3 * row['times']['default, 1e-12']:.0f} ms | {row['error']:.0e}"
        ratios = f"{row['ratio']:.2f} | {row['ratio_equal']:.2f} | {row['ratio_fixed']:.2f}"
        lines.append(
            f"| {row['name']} | {row['states']} | {row['degree']} | {row['intervals']} | {time_and_error} | {best} | {ratios} |"
        )
    others = [row["ratio"] for row in rows[larger + ROWS :]]
    if others:
        lines.append(f"| {len(others)} others of the bank | | | | | | | up to {max(others):.2f} | | |")
    larger_problems = f"{worst(results, of_bank=False):.2f} ({worst(results, 'ratio_equal', of_bank=False):.2f} at 1e-12)"
    lines += ["", f"worst degree 4 / best: {worst(results, 'ratio_fixed'):.2f}", ""]
    lines += [f"worst default / best, larger problems: {larger_problems}", ""]
    return "\n".join([*lines, f"worst default / best: {worst(results):.2f}"])
