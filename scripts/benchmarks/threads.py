"""Processor time of small problems with the threads that BLAS takes by itself, and with one thread."""

from __future__ import annotations

import resource
import subprocess
import sys

from benchmarks.measure import ONE_THREAD, SCRIPTS, environment, in_turn, median

#: Demos of AUTO-07p with few states, where a solution takes microseconds and a thread of BLAS milliseconds.
DEMOS = "hen", "log", "cusp", "opt", "plp"


def run(quick: bool) -> dict:
    """Return the processor time in seconds of each demo: ``free`` with the threads of BLAS, ``one`` with one thread."""
    one, free = environment(), {name: value for name, value in environment().items() if name not in ONE_THREAD}
    found = {}
    for name in DEMOS:
        sides = {"free": lambda name=name: _processor_time(name, free), "one": lambda name=name: _processor_time(name, one)}
        rows = in_turn(sides, 3 if quick else 7)
        found[name] = {side: median(row["seconds"] for row in rows[side]) for side in sides}
    return found


def _processor_time(name: str, variables: dict[str, str]) -> dict:
    """Run a demo in a process of its own; return the processor time of its threads, start included."""
    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    subprocess.run([sys.executable, str(SCRIPTS / "demos.py"), "--alone", name], env=variables, check=True, capture_output=True)
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    return {"seconds": after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime}


def table(results: dict) -> str:
    """Return the results as Markdown."""
    lines = ["| demo | BLAS's own threads | one thread | ratio |", "|---|---|---|---|"]
    lines += [f"| {name} | {row['free']:.2f} s | {row['one']:.2f} s | {row['free'] / row['one']:.2f} |"
              for name, row in results.items()]  # fmt: skip
    return "\n".join(lines)
