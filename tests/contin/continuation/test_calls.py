"""Python functions that a plain step calls: kernels make the step, and what is asked in Python is asked seldom.

The time of a step cannot be tested on machines that do other work; the calls can. Before kernels made whole steps there were
344 (boundary value problems) to 715 (maps).
"""

import math
import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

import contin
from contin import AlgebraicProblem, BoundaryValueProblem, MapProblem, solve, trace

#: Most calls a plain step, renewed meshes and phase conditions included.
MOST = 60


def lorenz(u, p):
    return 10 * (u.y - u.x), p.r * u.x - u.y - u.x * u.z, u.x * u.y - 8 / 3 * u.z


def equilibria():
    return solve(AlgebraicProblem(lorenz, ["x", "y", "z"], {"r": 10.0}), [4.9, 4.9, 9]), "r", 0.01


def henon():
    problem = MapProblem(lambda u, p: (1 - p.a * u.x**2 + u.y, 0.3 * u.x), ["x", "y"], {"a": 0.1})
    return solve(problem, [0.8, 0.2]), "a", 0.002


def bratu():
    problem = BoundaryValueProblem(
        lambda t, u, p: (u.v, -p.lam * np.exp(u.u)), lambda a, b, p: (a.u, b.u), ["u", "v"], {"lam": 0.5}
    )
    return solve(problem, lambda t: (0.1 * math.sin(math.pi * t), 0.1 * math.pi * math.cos(math.pi * t))), "lam", 0.01


def cycles():
    rest = solve(AlgebraicProblem(lorenz, ["x", "y", "z"], {"r": 24.0}), [math.sqrt(8 / 3 * 23)] * 2 + [23.0])
    (hopf,) = trace(rest, free=["r"], limits={"r": (20, 26)}).labelled("HB")
    return trace(hopf, branch=1, limits={"r": (15, 25)}, max_points=10).points[-1], "r", 0.05


def stable_states():
    """A circle of radius 1 that drives three states with multipliers exp(-1.9) to exp(-2.5): near enough to 1 to be watched."""

    def field(u, p):
        size = p.mu - u.x**2 - u.y**2
        return u.x * size - u.y, u.y * size + u.x, u.x - 0.3 * u.a, u.a - 0.35 * u.b, u.b - 0.4 * u.c

    problem = contin.CycleProblem(field, ["x", "y", "a", "b", "c"], {"mu": 1.0})
    guess = solve(problem, lambda t: (math.cos(2 * math.pi * t), math.sin(2 * math.pi * t), 0, 0, 0), {"period": 6.0})
    return guess, "mu", 0.002


def calls(point, name, step, count):
    """How many Python functions a run of so many points calls."""
    found = 0

    def profile(frame, event, argument):
        nonlocal found
        found += event == "call"

    before = sys.getprofile()
    sys.setprofile(profile)
    try:
        branch = trace(point, free=[name], step=step, max_step=step, max_points=count)
    finally:
        sys.setprofile(before)
    assert len(branch.points) == count + 1
    return found


KINDS = {kind.__name__: kind for kind in (equilibria, henon, bratu, cycles, stable_states)}


@pytest.mark.sample(1)
@pytest.mark.parametrize("kind", KINDS)
def test_a_plain_step_calls_few_python_functions(kind):
    """In a process that finds all kernels compiled: where one was compiled, a function in Python stays before it.

    The first process compiles what is not; if nothing was, its number is that of a second one.
    """
    environment = {**os.environ, "PYTHONPATH": str(Path(contin.__file__).parent.parent)}
    for _ in range(2):
        words = [sys.executable, __file__, kind]
        done = subprocess.run(words, capture_output=True, text=True, check=True, env=environment)
        if float(done.stdout) <= MOST:
            break
    assert float(done.stdout) <= MOST


if __name__ == "__main__":
    given = KINDS[sys.argv[1]]()
    calls(*given, 60)  # functions are recorded, kernels loaded
    print((calls(*given, 60) - calls(*given, 20)) / 40)
