"""The same problem for all: the half loop in thirteen components, 40 intervals, degree 4, one tolerance, the same branch."""

from __future__ import annotations

from peers import auto_07p

from benchmarks.measure import in_turn, median, task

#: The tolerance that both are given: AUTO's EPSL and EPSU, contin's Newton tolerance. The first is the one of the summary.
TOLERANCES = (1e-10, 1e-8, 1e-6)
END = -0.5


def run(quick: bool, exact_fold: float) -> dict:
    """Return results by program and tolerance, and the programs left out."""
    results, skipped = {}, {}
    if (reason := auto_07p.missing()) is not None:
        skipped["AUTO-07p"] = reason
    else:
        auto_07p.build("half")
    for tolerance in TOLERANCES:
        contestants = {"contin": lambda tolerance=tolerance: second_run("half_loop", tolerance=tolerance)}
        if "AUTO-07p" not in skipped:
            contestants["AUTO-07p"] = lambda tolerance=tolerance: auto_07p.study("half", tolerance=tolerance)
        runs = in_turn(contestants, 3 if quick else 15)
        results[f"{tolerance:.0e}"] = {name: _summary(name, some, tolerance, exact_fold) for name, some in runs.items()}
    return {"results": results, "skipped": skipped, "exact_fold": exact_fold, "exact_end": END}


def second_run(name: str, **arguments) -> dict:
    """Return a task's second run in one process (the first one loads compiled code), and the time of a process with one."""
    done = task(name, 1, **arguments)
    again = done["runs"][0]
    return again | {"process_seconds": done["process_seconds"] - again["task_seconds"]}


def _summary(name, runs, tolerance, exact_fold) -> dict:
    """Return medians over the repeats; AUTO-07p counts in a separate run. Of contin they are those of the points."""
    last, seconds = runs[-1], [run["seconds"] for run in runs]
    row = {
        "seconds": median(seconds), "spread": [min(seconds), max(seconds)], "points": last["points"],
        "per_point": median(seconds) / last["points"], "process_seconds": median(run["process_seconds"] for run in runs),
        "fold_error": abs(last["fold"] - exact_fold), "end_error": abs(last["end"] - END),
    }  # fmt: skip
    if name == "AUTO-07p":
        row["newton"] = auto_07p.study("half", tolerance=tolerance, count=True)["iterations"]
    elif name == "contin":
        row["newton"] = last["iterations"]
    if "circle_seconds" in last:
        row["circle_seconds"] = median(run["circle_seconds"] for run in runs)
    if "newton" in row:
        row["per_newton"] = row["seconds"] / row["newton"]
    return row


def ratio(results: dict) -> float | None:
    """Return the time per point of AUTO-07p over that of contin, at the first tolerance."""
    rows = results["results"][f"{TOLERANCES[0]:.0e}"]
    return rows["AUTO-07p"]["per_point"] / rows["contin"]["per_point"] if "AUTO-07p" in rows else None


def table(results: dict) -> str:
    """Return the results as Markdown."""
    lines = [
        "| tolerance | program | time, branch | points | time a point | Newton iterations | time each | "
        "whole process | error of the fold | error of the end |",
        "|---|---|---|---|---|---|---|---|---|---|",
    ]
    for tolerance, rows in results["results"].items():
        for name, row in rows.items():
            each = f"{1e3 * row['per_newton']:.2f} ms" if "newton" in row else "–"
            lines.append(
                f"| {tolerance} | {name} | {row['seconds']:.3f} s | {row['points']} | {1e3 * row['per_point']:.2f} ms | "
                f"{row.get('newton', '–')} | {each} | {row['process_seconds']:.2f} s | {row['fold_error']:.0e} | "
                f"{row['end_error']:.0e} |"
            )
    return "\n".join(lines)
