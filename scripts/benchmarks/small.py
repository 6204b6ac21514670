"""Small problems: the time of a plain point, and of what is located, by differences of runs.

A plain point is the difference of two runs with steps of one length, over the points between them. What is located is the
difference of two runs over the same stretch, one of which is not asked for it. Processor time, errors off, in turns.
"""

from __future__ import annotations

import math
import time
from collections.abc import Callable

import contin
from benchmarks.measure import in_turn, median

#: Points of the shorter and of the longer run.
FEW, MANY = 20, 180


def run(quick: bool) -> dict:
    """Return the microseconds of each."""
    repeats = 5 if quick else 25
    plain = {name: _plain(trace, repeats) for name, trace in _runs().items()}
    return {"plain": plain, "located": {name: _difference(pair, repeats) for name, pair in _located().items()}}


def _runs() -> dict[str, Callable[[int], object]]:
    """Return functions that follow a branch for a number of points, by what they are called on the page."""
    lorenz = contin.AlgebraicProblem(
        lambda u, p: (10 * (u.y - u.x), p.r * u.x - u.y - u.x * u.z, u.x * u.y - 8 / 3 * u.z), ["x", "y", "z"], {"r": 5.0}
    )
    rest = contin.solve(lorenz, [3.2, 3.2, 4.0])
    henon = contin.MapProblem(lambda u, p: (1 - p.a * u.x**2 + u.y, 0.3 * u.x), ["x", "y"], {"a": 0.1})
    fixed = contin.solve(henon, [0.9, 0.3])
    bratu = contin.BoundaryValueProblem(
        lambda t, u, p: (u.v, -p.lam * math.exp(u.u)), lambda a, b, p: (a.u, b.u), ["u", "v"], {"lam": 0.1}
    )
    bent = contin.solve(bratu, [0.0, 0.0])
    hopf = contin.trace(rest, free=["r"], limits={"r": (5, 30)}).labelled("HB")[0]
    cycles = contin.MeshControl(min_intervals=40, max_intervals=40)

    def steps(length: float, count: int) -> dict:
        return {"step": length, "max_step": length, "max_points": count, "errors": False}

    return {
        "equilibria of Lorenz's equations, with all eigenvalues": lambda n: contin.trace(rest, free=["r"], **steps(0.02, n)),
        "fixed points of Hénon's map, with all multipliers": lambda n: contin.trace(fixed, free=["a"], **steps(0.001, n)),
        "Bratu's problem": lambda n: contin.trace(bent, free=["lam"], **steps(0.002, n)),
        "cycles of Lorenz's equations, 40 intervals, with all multipliers": lambda n: contin.trace(
            hopf, branch=1, mesh=cycles, newton=contin.Newton(1e-8), **steps(0.02, n)
        ),
    }


def _located() -> dict[str, tuple[Callable[[], object], Callable[[], object]]]:
    """Return pairs of functions: with something to locate, and without."""
    parabola = contin.AlgebraicProblem(lambda u, p: (p.a - u.x**2,), ["x"], {"a": 1.0}, dynamics=False)
    start = contin.solve(parabola, [1.0])
    over = {"free": ["a"], "direction": -1, "max_points": 12, "errors": False, "branch_points": False}

    def brusselator(dynamics: bool) -> contin.Point:
        problem = contin.AlgebraicProblem(
            lambda u, p: (1 - (p.b + 1) * u.x + u.x**2 * u.y, p.b * u.x - u.x**2 * u.y), ["x", "y"], {"b": 1.5},
            dynamics=dynamics,
        )  # fmt: skip
        return contin.solve(problem, [1.0, 1.5])

    moving, still = brusselator(True), brusselator(False)
    through = {"free": ["b"], "step": 0.1, "max_step": 0.1, "max_points": 12, "errors": False}
    ends = {"free": ["a"], "step": 0.1, "max_step": 0.1, "errors": False}
    return {
        "a fold": (lambda: contin.trace(start, **over), lambda: contin.trace(start, folds=False, **over)),
        "a Hopf point, with its normal form": (
            lambda: contin.trace(moving, **through).labelled("HB")[0].normal_form,
            lambda: contin.trace(still, **through),
        ),
        "an end at a limit": (
            lambda: contin.trace(start, limits={"a": (0, 1.55)}, max_points=50, **ends),
            lambda: contin.trace(start, max_points=8, **ends),
        ),
    }


def _seconds(function: Callable[[], object]) -> float:
    began = time.process_time()
    function()
    return time.process_time() - began


def _plain(trace: Callable[[int], object], repeats: int) -> float:
    """Return the microseconds of a point: the median of differences."""
    runs = in_turn({"few": lambda: _seconds(lambda: trace(FEW)), "many": lambda: _seconds(lambda: trace(MANY))}, repeats)
    return 1e6 * median(b - a for a, b in zip(runs["few"], runs["many"])) / (MANY - FEW)


def _difference(pair: tuple[Callable[[], object], Callable[[], object]], repeats: int) -> float:
    runs = in_turn({"with": lambda: _seconds(pair[0]), "without": lambda: _seconds(pair[1])}, repeats)
    return 1e6 * median(a - b for a, b in zip(runs["with"], runs["without"]))


def table(results: dict) -> str:
    """Return the results as Markdown tables."""
    lines = ["| a plain point of | processor time |", "|---|---|"]
    lines += [f"| {name} | {value:.0f} us |" for name, value in results["plain"].items()]
    lines += ["", "| located | processor time |", "|---|---|"]
    return "\n".join([*lines, *(f"| {name} | {value / 1e3:.1f} ms |" for name, value in results["located"].items())])
