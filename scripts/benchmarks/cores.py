"""One thread and two: a problem of 1000 intervals and 13 states, its stages and a whole branch.

The problem is the half loop, whose fold is known (`ribbon_model.exact`). Both numbers of threads take turns in one process.
"""

from __future__ import annotations

import hashlib
import os
import time

import numpy as np

import contin
from benchmarks.measure import in_turn, median
from benchmarks.tasks import circle_in_full, half_loop, half_loop_in_full
from contin.linalg.condensation import Factorization

INTERVALS = 1000
#: The default of `contin.solve`, and that of scenes.
DEGREES = (4, 7)
STAGES = {
    "assembly": "residual and Jacobian", "factorization": "factorization", "solve": "solve",
    "transposed": "transposed solve", "branch": "from the circle to the fold",
}  # fmt: skip


def run(quick: bool, exact_fold: float) -> dict:
    """Return times by degree, stage and number of threads, the error of the fold, and whether all bits are equal."""
    return {f"{degree}": _one(degree, 3 if quick else 9, exact_fold) for degree in DEGREES}


def _one(degree: int, repeats: int, exact_fold: float) -> dict:
    """Return the results for a degree."""
    system, x = circle(degree)
    half_loop(40, degree, stop="LP")  # loads compiled code
    steps = in_turn({1: lambda: _threads(1, stages, system, x), 2: lambda: _threads(2, stages, system, x)}, 5 * repeats)
    branches = in_turn({1: lambda: _threads(1, _branch, degree), 2: lambda: _threads(2, _branch, degree)}, repeats)
    rows = [*steps[1], *steps[2]], [*branches[1], *branches[2]]
    medians = {
        stage: {count: median(row[stage] for row in (branches if stage == "branch" else steps)[count]) for count in (1, 2)}
        for stage in STAGES
    }
    return {
        "seconds": medians, "ratio": {stage: times[1] / times[2] for stage, times in medians.items()},
        "spread": [[f([row["branch"] for row in branches[count]]) for f in (min, max)] for count in (1, 2)],
        "fold_error": abs(branches[2][0]["fold"] - exact_fold),
        "equal": all(len({row["bits"] for row in some}) == 1 for some in rows),
    }  # fmt: skip


def circle(degree: int, intervals: int = INTERVALS) -> tuple[contin.lowlevel.Collocation, np.ndarray]:
    """Return the half loop on a uniform mesh, and the circle as its unknowns."""
    system = contin.lowlevel.Collocation(half_loop_in_full(), np.linspace(0, 1, intervals + 1), degree, ["kappa_n"], {})
    states = np.array([circle_in_full(t) for t in system.nodes])
    return system, system.pack(states, {"kappa_n": 2.3, "nu": 0.3})


def _threads(count: int, function, *arguments) -> dict:
    """Return the result of a function with this number of threads."""
    before = os.environ.get("CONTIN_THREADS")
    os.environ["CONTIN_THREADS"] = str(count)
    try:
        return function(*arguments)
    finally:
        os.environ.pop("CONTIN_THREADS") if before is None else os.environ.update(CONTIN_THREADS=before)


def stages(system: contin.lowlevel.Collocation, x: np.ndarray) -> dict:
    """Return the times of all stages of one Newton iteration, and a hash of all that they give."""
    row, right = np.ones((1, system.size)), np.ones(system.size)
    times = [time.perf_counter()]
    residual, blocks = system._assembled(x, row, np.empty((0, system.equations)))
    times.append(time.perf_counter())
    factors = Factorization(system._layout, blocks)
    times.append(time.perf_counter())
    solution = factors.solve(right)
    times.append(time.perf_counter())
    transposed = factors.solve_transposed(right)
    times.append(time.perf_counter())
    bits = hashlib.sha256(b"".join(array.tobytes() for array in (residual, solution, transposed))).hexdigest()
    return dict(zip(STAGES, np.diff(times).tolist())) | {"bits": bits}


def _branch(degree: int) -> dict:
    """Return the time of the branch with its start, its fold, and a hash of both special points."""
    done = half_loop(INTERVALS, degree, stop="LP")
    bits = f"{done['fold'].hex()} {done['circle'].hex()} {done['points']} {done['iterations']}"
    return {"branch": done["seconds"] + done["circle_seconds"], "fold": done["fold"], "bits": bits}


def ratio(results: dict) -> float:
    """Return the time of the branch by one thread over that by two, at the first degree."""
    return results[f"{DEGREES[0]}"]["ratio"]["branch"]


def table(results: dict) -> str:
    """Return the results as Markdown."""
    lines = ["| degree | stage | one thread | two threads | ratio |", "|---|---|---|---|---|"]
    for degree, row in results.items():
        for stage, name in STAGES.items():
            one, two = (1e3 * row["seconds"][stage][count] for count in (1, 2))
            lines.append(f"| {degree} | {name} | {one:.1f} ms | {two:.1f} ms | {row['ratio'][stage]:.2f} |")
    errors = ", ".join(f"{row['fold_error']:.0e} (degree {degree})" for degree, row in results.items())
    equal = "All bits are equal" if all(row["equal"] for row in results.values()) else "Bits differ"
    lines.append(f"\nError of the fold: {errors}. {equal}; one thread takes {ratio(results):.2f} times as long for the branch.")
    return "\n".join(lines)
