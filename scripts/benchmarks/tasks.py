"""The timed tasks of contin and SciPy, each in its own process: ``python -m benchmarks.tasks NAME ARGUMENTS REPEATS``.

Prints one line of JSON: ``first`` (the run that also loads compiled code), ``runs`` (repeats in the same process), ``imported``
(seconds that the imports took).
"""

from __future__ import annotations

import functools
import json
import math
import sys
import time


@functools.cache
def half_loop_in_full():
    """Return the half loop in the thirteen components (M, R, q, x), the statement of ``peers/auto/half.f90``."""
    import contin
    from ribbon_model.equilibrium import directors, spin
    from ribbon_model.laws import RIBBON

    response, length = RIBBON.response, math.pi

    def rhs(t, u, p):
        H, w1, w2, w3, conjugate = response(u.M1, u.M2, u.M3, p.kappa_n, p.nu)
        d11, d12, d13, d21, d22, d23, d31, d32, d33 = directors(u.q0, u.q1, u.q2, u.q3)
        return (
            length * (u.M2 * w3 + u.R2), length * (u.M3 * w1 - u.M1 * w3 - u.R1), -length * u.M2 * w1,
            length * u.R2 * w3, length * (u.R3 * w1 - u.R1 * w3), -length * u.R2 * w1,
            *spin(u.q0, u.q1, u.q2, u.q3, w1, 0.0, w3, length),
            length * d31, length * d32, length * d33,
        )  # fmt: skip

    def boundary(a, b, p):
        d11, d12, d13, d21, d22, d23, d31, d32, d33 = directors(b.q0, b.q1, b.q2, b.q3)
        return a.M3, a.R1, a.R2, a.q0 - 1, a.q1, a.q2, a.q3, a.x1, a.x2, a.x3, d31, d32, b.x3

    states = ["M1", "M2", "M3", "R1", "R2", "R3", "q0", "q1", "q2", "q3", "x1", "x2", "x3"]
    return contin.BoundaryValueProblem(rhs, boundary, states, {"kappa_n": 2.3, "nu": 0.3})


def circle_in_full(t):
    """Return the thirteen components of the circle at kappa_n = 2.3."""
    a = math.pi * t
    return (-1.3, 0, 0, 0, 0, 0, math.cos(a / 2), math.sin(a / 2), 0, 0, 0, math.cos(a) - 1, math.sin(a))


def half_loop(intervals=40, degree=4, tolerance=1e-10, stop="BP") -> dict:
    """Follow the circle to its bifurcation, and the branch to its fold (LP) or end (BP), in AUTO's formulation."""
    import contin

    newton, mesh = contin.Newton(tolerance), contin.MeshControl(min_intervals=intervals, max_intervals=intervals, every=3)
    options = {"newton": newton, "mesh": mesh, "errors": False}
    began = time.perf_counter()
    start = contin.solve(half_loop_in_full(), circle_in_full, intervals=intervals, degree=degree, mesh=mesh, newton=newton)
    circle = contin.trace(start, free=["kappa_n"], limits={"kappa_n": (2, 2.6)}, **options)
    bifurcation = circle.labelled("BP")[0]
    switched = time.perf_counter()
    settings = contin.Settings(branch_points=stop == "BP", **options)
    run = contin.lowlevel.Continuation(bifurcation.system, bifurcation.x, settings, bifurcation.details.tangents[1])
    points = _until(run, stop)
    return {"seconds": time.perf_counter() - switched, "circle_seconds": switched - began, **_summary(points)}


def cell(intervals=8, degree=6, tolerance=1e-12, angle=0.35, accuracy=0.02, step=0.05, stop="LP", m=1, n=2) -> dict:
    """Follow the branch (m, n) on its quarter wave to its fold (LP) or end (BP), on a fixed number of intervals.

    ``angle``, ``accuracy`` and the first ``step`` are settings of contin that determine its steps.
    """
    import contin
    from ribbon_model.laws import RIBBON
    from ribbon_model.seeds import primary_branch

    mesh = contin.MeshControl(every=3 if stop == "BP" else 0, min_intervals=intervals, max_intervals=intervals)
    settings = contin.Settings(
        newton=contin.Newton(tolerance), mesh=mesh, errors=False, branch_points=stop == "BP",
        angle=angle, accuracy=accuracy, step=step,
    )  # fmt: skip
    began = time.perf_counter()
    system, x, tangent = primary_branch(RIBBON, m, n, 0.3, intervals, degree)
    switched = time.perf_counter()
    points = _until(contin.lowlevel.Continuation(system, x, settings, tangent), stop)
    return {"seconds": time.perf_counter() - switched, "circle_seconds": switched - began, **_summary(points)}


def scipy_fold(tolerance=1e-8) -> dict:
    """Return the fold of (1, 2) by ``solve_bvp``."""
    from peers import scipy_bvp

    return scipy_bvp.fold(tolerance) | {"circle_seconds": 0.0}


def _until(run, label):
    """Return the points of a run up to the first with a label, after the start."""
    points = []
    for point in run:
        points.append(point)
        if point.label == label and len(points) > 1:
            return points
    raise RuntimeError(f"no {label} was met: {run.stop}")


def _summary(points) -> dict:
    """Return counts and special values of a branch; ``iterations`` are those of its points."""
    folds = [point["kappa_n"] for point in points if point.label == "LP"]
    return {
        "points": len(points), "iterations": sum(point.iterations for point in points), "fold": folds[0] if folds else None,
        "end": points[-1]["kappa_n"] if points[-1].label == "BP" else None,
        "circle": points[0]["kappa_n"], "intervals": max(point.system.intervals for point in points),
    }  # fmt: skip


TASKS = {function.__name__: function for function in (half_loop, cell, scipy_fold)}


def main(name: str, arguments: str, repeats: str) -> None:
    given, began = json.loads(arguments), time.perf_counter()
    if name == "scipy_fold":
        import peers.scipy_bvp  # noqa: F401
    else:
        import contin  # noqa: F401
        from ribbon_model import seeds  # noqa: F401
    imported = time.perf_counter() - began
    runs = []
    for _ in range(1 + int(repeats)):
        began = time.perf_counter()
        runs.append(TASKS[name](**given))
        runs[-1]["task_seconds"] = time.perf_counter() - began
    print(json.dumps({"first": runs[0], "runs": runs[1:], "imported": imported}))


if __name__ == "__main__":
    main(*sys.argv[1:])
