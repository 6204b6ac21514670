"""CPU time and memory of a large equilibrium problem, by what is known of its Jacobian.

``python scripts/given_jacobian.py [N ...]``: Bratu's problem by finite differences with N unknowns, with the derivatives
found by recording, and with a given Jacobian. Each run is a process of its own, after a small run that loads what all need.
The first solution includes the pattern and the comparison; compiled kernels are there from a run before. A
linearization is the residual, the Jacobian and its factors.
"""

from __future__ import annotations

import json
import resource
import subprocess
import sys
import time

import numpy as np
from scipy import sparse

import contin

KINDS = ("recorded", "given")
#: Linearizations of which the fastest counts.
REPEATS = 5


def bratu(u, p, out):
    h = 1.0 / (len(u) + 1)
    out[:] = -2 * u + h**2 * p[0] * np.exp(u)
    out[1:] += u[:-1]
    out[:-1] += u[1:]


def derivatives(u, p):
    off = np.ones(len(u) - 1)
    return sparse.diags_array([off, -2 + p[0] * np.exp(u) / (len(u) + 1) ** 2, off], offsets=[-1, 0, 1])


def measure(count: int, kind: str) -> dict[str, float]:
    """Return CPU seconds to the first solution and of a linearization, and megabytes at most."""
    before = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    given = {"given": {"jacobian": derivatives}, "recorded": {}}
    problem = contin.AlgebraicProblem(bratu, count, {"lam": 1.0}, count=count, dynamics=False, **given[kind])
    began = time.process_time()
    start = contin.solve(problem, np.zeros(count))
    first = time.process_time() - began
    system, x = start.system.with_free(["lam"], start.x)
    border, times = np.ones((1, system.size)), []
    for _ in range(REPEATS + 1):
        began = time.process_time()
        system.linearize(x, border)
        times.append(time.process_time() - began)
    most = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    return {"first": first, "linearization": min(times[1:]), "memory": (most - before) / 1024}


def main(counts: list[int]) -> None:
    """Print the table."""
    print("| unknowns | Jacobian | first solution | linearization | memory |\n|---|---|---|---|---|")
    for count in counts:
        for kind in KINDS:
            for _ in range(1 + (kind == KINDS[0])):  # the first one compiles
                done = subprocess.run(
                    [sys.executable, __file__, "--one", str(count), kind], capture_output=True, text=True, check=True
                )
            found = json.loads(done.stdout)
            times = f"{1e3 * found['first']:.0f} ms | {1e3 * found['linearization']:.2f} ms"
            print(f"| {count} | {kind} | {times} | {found['memory']:.0f} MB |", flush=True)


if __name__ == "__main__":
    if sys.argv[1:2] == ["--one"]:
        measure(12, sys.argv[3])
        print(json.dumps(measure(int(sys.argv[2]), sys.argv[3])))
    else:
        main([int(word) for word in sys.argv[1:]] or [10, 100, 1000, 10_000])
