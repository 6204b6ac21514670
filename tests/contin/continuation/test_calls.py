"""How many functions are called from Python in a step without special points: most of the time of small problems.

Counts depend on the versions of Python and NumPy, not on the speed of the machine. Each bound is a tenth above what was counted
when it was set: whatever exceeds it makes every run slower.
"""

import math
import os
import sys

import pytest

import contin


def lorenz(u, p):
    return 10 * (u.y - u.x), p.r * u.x - u.y - u.x * u.z, u.x * u.y - 8 / 3 * u.z


def equilibria():
    """Hopf points are looked for."""
    problem = contin.AlgebraicProblem(lorenz, ["x", "y", "z"], {"r": 10.0})
    return contin.solve(problem, [math.sqrt(24), math.sqrt(24), 9.0]), ["r"]


def bratu():
    problem = contin.BoundaryValueProblem(
        lambda t, u, p: (u.v, -p.lam * math.exp(u.u)), lambda a, b, p: (a.u, b.u), ["u", "v"], {"lam": 0.5}
    )
    return contin.solve(problem, (0.1, 0.0), intervals=10), ["lam"]


def cycles():
    """Period doublings and tori are looked for."""
    problem = contin.CycleProblem(lambda u, p: (u.y, p.a * (1 - u.x**2) * u.y - u.x, -u.z), ["x", "y", "z"], {"a": 0.5})
    guess = lambda t: (2 * math.cos(2 * math.pi * t), -2 * math.sin(2 * math.pi * t), 0.0)  # noqa: E731
    return contin.solve(problem, guess, {"period": 6.4}, free=[]), ["a", "period"]


def calls_a_point(run):
    """Return the calls a point from the fourth to the fourteenth of a run, none of them special."""
    points, calls = iter(run), 0

    def count(frame, event, argument):
        nonlocal calls
        calls += event in ("call", "c_call")

    for _ in range(4):
        next(points)
    sys.setprofile(count)
    try:
        found = [next(points) for _ in range(10)]
    finally:
        sys.setprofile(None)
    assert not any(point.label for point in found)
    return calls / len(found)


@pytest.mark.skipif("CONTIN_ROUND_OFF" in os.environ, reason="moving values takes calls of its own")
@pytest.mark.skipif(sys.version_info[:2] != (3, 11), reason="counted with Python 3.11")
@pytest.mark.parametrize(("start", "bound"), [(equilibria, 880), (bratu, 650), (cycles, 1120)])
def test_calls_a_step(start, bound):
    point, free = start()
    system, x = point.system.with_free(free, point.x)
    settings = contin.Settings(max_step=0.1, mesh=contin.MeshControl(every=0))
    assert calls_a_point(contin.Continuation(system, x, settings)) < bound
