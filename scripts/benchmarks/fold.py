"""Tool for tool: the time until the fold of (1, 2) is known to 1e-6, 1e-8, 1e-10, 1e-12, each tool at its best setting.

Every tool runs over a range of settings; the time to an error is the fastest setting whose error is at most that. Errors are
measured against the quadrature of `ribbon_model.exact`.
"""

from __future__ import annotations

import time
from collections.abc import Callable

from peers import auto_07p

from benchmarks.like_for_like import second_run
from benchmarks.measure import in_turn, median

ERRORS = (1e-6, 1e-8, 1e-10, 1e-12)
CELL, LOOP = "contin, cell", "AUTO-07p, loop in 13 components"
HALF, AUTO_CELL, SCIPY = "AUTO-07p, half loop in 13 components", "AUTO-07p, cell", "SciPy solve_bvp, cell"


def run(quick: bool, exact_fold: float, budget: float) -> dict:
    """Return all measurements, the fastest settings by tool and error, and the tools left out; ``budget`` is in seconds."""
    skipped, contestants = {}, dict(_contin())
    if (reason := auto_07p.missing()) is not None:
        skipped |= {LOOP: reason, HALF: reason, AUTO_CELL: reason}
    else:
        for statement in ("loop", "half", "cell"):
            auto_07p.build(statement)
        contestants |= _auto()
    contestants |= _scipy()
    began, runs = time.perf_counter(), {key: [] for key in contestants}
    for repeat in range(2 if quick else 5):
        if repeat and time.perf_counter() - began > budget * repeat / (repeat + 1):
            break
        for key, some in in_turn(contestants, 1).items():
            runs[key] += some
    rows = [
        {
            "tool": tool, "setting": setting, "seconds": median(row["seconds"] + row.get("circle_seconds", 0) for row in some),
            "process_seconds": median(row["process_seconds"] for row in some), "error": abs(some[-1]["fold"] - exact_fold),
            "repeats": len(some),
        }
        for (tool, setting), some in runs.items()
    ]  # fmt: skip
    return {"rows": rows, "best": best(rows), "skipped": skipped, "exact_fold": exact_fold}


#: First steps of the runs.
FIRST_STEPS = {"contin": (0.05, 0.5, 2.0), "AUTO-07p": (0.05, 0.2)}  # AUTO-07p does not stay on the branch with 0.5


def _contin() -> dict[tuple[str, str], Callable]:
    """Intervals, degree, Newton's tolerance; the first step."""
    settings = [(4, 5, 1e-6), (3, 6, 1e-6), (3, 8, 1e-6), (4, 8, 1e-6), (6, 8, 1e-6), (6, 8, 1e-9), (8, 7, 1e-12)]
    return {
        (CELL, f"{n} × {d}, tolerance {t:.0e}, first step {s:g}"): lambda n=n, d=d, t=t, s=s: second_run(
            "cell", intervals=n, degree=d, tolerance=t, angle=1.2, accuracy=0.3, step=s
        )
        for n, d, t in settings
        for s in FIRST_STEPS["contin"]
    }


def _auto() -> dict[tuple[str, str], Callable]:
    """Intervals, degree and tolerance; the first step."""
    settings = {
        LOOP: [(15, 4, 1e-6), (30, 4, 1e-6), (60, 4, 1e-6), (90, 4, 1e-7), (160, 4, 1e-8), (30, 7, 1e-8)],
        HALF: [(10, 4, 1e-6), (15, 4, 1e-6), (30, 4, 1e-6), (45, 4, 1e-7), (80, 4, 1e-8), (15, 7, 1e-8)],
        AUTO_CELL: [(4, 4, 1e-6), (10, 4, 1e-6), (5, 6, 1e-7), (5, 7, 1e-8), (8, 7, 1e-9)],
    }
    statements = {LOOP: "loop", HALF: "half", AUTO_CELL: "cell"}
    return {
        (tool, f"{n} × {d}, tolerance {t:.0e}, first step {s:g}"): lambda tool=tool, n=n, d=d, t=t, s=s: auto_07p.study(
            statements[tool], "LP", n, d, t, longest_step=2.0, first_step=s
        )
        for tool, some in settings.items()
        for n, d, t in some
        for s in FIRST_STEPS["AUTO-07p"]
    }


def _scipy() -> dict[tuple[str, str], Callable]:
    """Return the tolerance of solve_bvp."""
    tolerances = (1e-5, 1e-6, 1e-7, 1e-8, 1e-9)
    return {(SCIPY, f"tol {t:.0e}"): lambda t=t: second_run("scipy_fold", tolerance=t) for t in tolerances}


def best(rows: list[dict]) -> dict[str, dict[str, dict | None]]:
    """Return, by tool and error, the row with the least time, or None."""
    found = {}
    for tool in dict.fromkeys(row["tool"] for row in rows):
        found[tool] = {}
        for error in ERRORS:
            good = [row for row in rows if row["tool"] == tool and row["error"] <= error]
            found[tool][f"{error:.0e}"] = min(good, key=lambda row: row["seconds"]) if good else None
    return found


def table(results: dict) -> str:
    """Return the times as Markdown, with their ratios to that of contin."""
    errors = [f"{error:.0e}" for error in ERRORS]
    lines = ["| tool | " + " | ".join(f"to {error}" for error in errors) + " |", "|---|" + "---|" * len(errors)]
    for tool, cells in results["best"].items():
        texts = []
        for error in errors:
            row, ours = cells[error], results["best"][CELL][error]
            if row is None:
                texts.append("not reached")
                continue
            times = "" if ours is None or tool == CELL else f" ({row['seconds'] / ours['seconds']:.1f}×)"
            texts.append(f"{1e3 * row['seconds']:.1f} ms{times}")
        lines.append(f"| {tool} | " + " | ".join(texts) + " |")
    return "\n".join(lines)
