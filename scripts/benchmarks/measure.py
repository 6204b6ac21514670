"""Timing: tools are run in turns, each in its own processes, on one thread; and a description of the machine."""

from __future__ import annotations

import json
import os
import platform
import statistics
import subprocess
import sys
import time
from collections.abc import Callable, Mapping
from pathlib import Path

SCRIPTS = Path(__file__).resolve().parent.parent
ONE_THREAD = dict.fromkeys(
    (
        "OMP_NUM_THREADS",
        "OPENBLAS_NUM_THREADS",
        "MKL_NUM_THREADS",
        "NUMBA_NUM_THREADS",
        "VECLIB_MAXIMUM_THREADS",
        "CONTIN_THREADS",
    ),
    "1",
)


def environment(**changes: str) -> dict[str, str]:
    """Return the environment of a child process: one thread, this project importable."""
    paths = [str(SCRIPTS), str(SCRIPTS.parent), os.environ.get("PYTHONPATH", "")]
    return os.environ | ONE_THREAD | {"PYTHONPATH": os.pathsep.join(filter(None, paths))} | changes


def child(*command: str, timeout: float = 900, **changes: str) -> dict:
    """Run ``command``; return the JSON of its last line, with ``process_seconds``, the time of the whole process.

    Raises
    ------
    RuntimeError
        It failed; the message holds the end of what it said.
    """
    began = time.perf_counter()
    done = subprocess.run(command, env=environment(**changes), capture_output=True, text=True, timeout=timeout)
    elapsed = time.perf_counter() - began
    if done.returncode:
        raise RuntimeError(f"{' '.join(command)} failed:\n{done.stderr[-3000:]}")
    return json.loads(done.stdout.splitlines()[-1]) | {"process_seconds": elapsed}


def task(name: str, repeats: int = 1, **arguments) -> dict:
    """One of the functions of `benchmarks.tasks`, ``repeats`` times after a first time, in a process of its own."""
    return child(sys.executable, "-m", "benchmarks.tasks", name, json.dumps(arguments), str(repeats))


def in_turn(contestants: Mapping[str, Callable[[], dict]], repeats: int) -> dict[str, list[dict]]:
    """Return the results of every tool, run in turns (A B A B ...), so that a change of the machine's load affects all."""
    results = {name: [] for name in contestants}
    for _ in range(repeats):
        for name, run in contestants.items():
            results[name].append(run())
    return results


def median(values) -> float:
    return float(statistics.median(values))


def machine() -> dict:
    """Return a description of the machine."""
    import numba
    import numpy
    import scipy

    name = platform.processor() or platform.machine()
    if Path("/proc/cpuinfo").exists():
        lines = [line for line in Path("/proc/cpuinfo").read_text().splitlines() if line.startswith("model name")]
        name = lines[0].split(":", 1)[1].strip() if lines else name
    load = os.getloadavg()[0] if hasattr(os, "getloadavg") else None
    return {
        "processor": name, "cores": os.cpu_count(), "load_at_start": load, "system": platform.platform(),
        "python": platform.python_version(), "numpy": numpy.__version__, "scipy": scipy.__version__, "numba": numba.__version__,
        "date": time.strftime("%Y-%m-%d"),
    }  # fmt: skip
