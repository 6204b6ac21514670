"""Many branches: Fig. 12 at many values of nu, in processes of this machine and on a Dask cluster; questions, and the page.

And many parameter sets of one small problem: `contin.batch` beside a plain loop.
"""

from __future__ import annotations

import functools
import math
import resource
import subprocess
import sys
import tempfile
import time
from pathlib import Path

from benchmarks.measure import environment, median

#: The pairs (m, n) of Fig. 12 of Audoly & Seffen (2015), at values of nu from -0.9 to 0.45.
SCENE = "nu: {nus}\nm: [1, 3, 5, 7]\nn: [1, 2, 3, 4, 5, 6, 7]\nlimits: {{kappa_n: [-100, 100]}}\nstride: 10\n"
LOW, HIGH = -0.9, 0.45
#: Questions to `branches.graph`: all branches, the states at a natural curvature, one branch.
QUESTIONS = ((), ("--at", 3.2), ("--where", 1, 2))
#: Values of nu, and repeats.
COUNT, REPEATS = 17, 3
#: Parameter sets of a small problem.
SETS = 200


def run(quick: bool) -> dict:
    """Return the times in seconds of a scene with one process and with two, on a Dask cluster, of questions and of the page."""
    count, repeats = (5, 2) if quick else (COUNT, REPEATS)
    with tempfile.TemporaryDirectory(prefix="bench-many-") as name:
        folder = Path(name)
        nus = [round(LOW + (HIGH - LOW) * number / (count - 1), 6) for number in range(count)]
        (folder / "scene.yaml").write_text(SCENE.format(nus=nus))
        results = _measured(folder, repeats) | {"batch": _batch(repeats)}
        try:
            return results | {"cluster": _cluster(folder, repeats)}
        except ImportError:
            return results | {"skipped": {"Dask": "not installed"}}


def _measured(folder: Path, repeats: int) -> dict:
    """Measure the run on this machine, questions about its result, and the page of it."""
    times, cpu = {1: [], 2: []}, []
    for number in range(repeats):
        for workers, found in times.items():
            run = _timed("branches.run", folder / "scene.yaml", "--out", folder / f"{workers}-{number}", "--workers", workers)
            found.append(run["seconds"])
            cpu.append(run["cpu"])
    result = folder / "2-0"
    questions = [_timed("branches.graph", result, *words)["seconds"] for words in QUESTIONS * repeats]
    page = _timed("branches.explore", result, "--out", folder / "page.html", "--quiet")
    return {
        "branches": len(list(result.glob("*.h5"))), "one": median(times[1]), "two": median(times[2]), "cpu": median(cpu),
        "question": median(questions), "page": page["seconds"], "megabytes": (folder / "page.html").stat().st_size / 1e6,
    }  # fmt: skip


def _fold(problem, values) -> float:
    """Return the fold of Bratu's problem with saturation."""
    import contin

    start = contin.solve(problem, [0, 0], values)
    return contin.trace(start, free=["lam"], limits={"lam": (0, 8), "mean": (-1, 3)}).labelled("LP")[0]["lam"]


def _batch(repeats: int) -> dict:
    """Return rates (sets a second) and processor times (s a set) of a loop, of `contin.batch` here and with two processes."""
    import contin

    problem = contin.BoundaryValueProblem(
        lambda t, u, p: (u.v, -p.lam * math.exp(u.u / (1 + p.a * u.u))), lambda a, b, p: (a.u, b.u), ["u", "v"],
        {"lam": 0.0, "a": 0.0}, functionals={"mean": lambda t, u, p: u.u},
    )  # fmt: skip
    sets = [{"a": 0.1 * number / SETS} for number in range(SETS)]
    ways = {
        "loop": lambda: [_fold(problem, values) for values in sets],
        "one": functools.partial(contin.batch, _fold, problem, sets),
        "two": functools.partial(contin.batch, _fold, problem, sets, workers=2),
    }
    _fold(problem, sets[0])
    times = {name: [] for name in ways}
    for _ in range(repeats):
        for name, run in ways.items():
            began, before = time.perf_counter(), _processor_time()
            run()
            times[name].append((time.perf_counter() - began, _processor_time() - before))
    return {name: {"rate": SETS / median(t for t, _ in found), "cpu": median(t for _, t in found) / SETS}
            for name, found in times.items()}  # fmt: skip


def _processor_time() -> float:
    """Return the processor time of this process and of those that it started and that have ended."""
    usages = resource.getrusage(resource.RUSAGE_SELF), resource.getrusage(resource.RUSAGE_CHILDREN)
    return sum(usage.ru_utime + usage.ru_stime for usage in usages)


def _cluster(folder: Path, repeats: int) -> float:
    """Measure the run on a Dask cluster of two workers, processes of this machine that have imported everything."""
    from distributed import LocalCluster

    with LocalCluster(n_workers=2, threads_per_worker=1, processes=True, dashboard_address=None) as cluster:
        scene, address = folder / "scene.yaml", ("--scheduler", cluster.scheduler_address)
        runs = [_timed("branches.run", scene, "--out", folder / f"cluster-{i}", *address) for i in range(repeats + 1)]
    return median(run["seconds"] for run in runs[1:])


def _timed(module: str, *words) -> dict:
    """Run a command as a process; return its time, and the processor time of it and of its processes."""
    began, before = time.perf_counter(), resource.getrusage(resource.RUSAGE_CHILDREN)
    command = [sys.executable, "-m", module, *map(str, words)]
    done = subprocess.run(command, env=environment(), capture_output=True, text=True)
    if done.returncode:
        raise RuntimeError(f"{' '.join(command)} failed:\n{done.stderr[-3000:]}")
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    return {"seconds": time.perf_counter() - began, "cpu": after.ru_utime - before.ru_utime + after.ru_stime - before.ru_stime}


def table(results: dict) -> str:
    """Return the results as Markdown."""
    count = results["branches"]
    kinds = {"one process": "one", "two processes": "two", "Dask cluster of two workers": "cluster"}
    lines = [f"| {count} branches | time | branches a second |", "|---|---|---|"]
    lines += [
        f"| {name} | {results[key]:.1f} s | {count / results[key]:.1f} |" for name, key in kinds.items() if key in results
    ]
    return "\n".join([
        *lines, "",
        f"Processor time of all processes: {1e3 * results['cpu'] / count:.0f} ms a branch. A question takes "
        f"{results['question']:.2f} s, the page {results['page']:.0f} s; it has {results['megabytes']:.1f} MB.",
        *(["", *_batch_table(results["batch"])] if "batch" in results else []),
    ])  # fmt: skip


def _batch_table(rates: dict) -> list[str]:
    """Return the throughput of `contin.batch` as a table."""
    names = {"loop": "a loop", "one": "`contin.batch`", "two": "`contin.batch`, two processes"}
    return [
        f"| {SETS} folds of a boundary value problem | folds a second | processor time each |", "|---|---|---|",
        *(f"| {name} | {rates[key]['rate']:.0f} | {1e3 * rates[key]['cpu']:.0f} ms |" for key, name in names.items()),
    ]  # fmt: skip
