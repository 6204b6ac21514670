"""Cost laws of contin: time and memory against intervals, components and degree; error against intervals and degree."""

from __future__ import annotations

import math
import time
import tracemalloc

import numpy as np

import contin
from benchmarks.measure import median
from contin.collocation.mesh import equidistributed
from contin.core.trial import Trial
from ribbon_model import exact
from ribbon_model.laws import RIBBON
from ribbon_model.seeds import primary_branch

NU = 0.3
DEGREES = range(2, 9)


def run(quick: bool) -> dict:
    """Return all cost laws."""
    repeats = 5 if quick else 15
    counts = (5, 10, 20, 40, 80) if quick else (5, 8, 12, 20, 32, 50, 80, 125, 200)
    return {
        "intervals": _sweep([(n, 7, 4) for n in (10, 20, 40, 80, 160, 320, 640)], repeats),
        "components": _sweep([(20, n, 4) for n in (2, 4, 7, 13, 20, 26, 40)], repeats),
        "degree": _sweep([(40, 7, d) for d in DEGREES], repeats),
        "blas": [_blas(size) for size in (8, 16, 28, 52, 80, 104, 160)],
        "errors": [_errors(*case, counts, DEGREES) for case in CASES],
    }


# --- time and memory ------------------------------------------------------------------------------------------------


def chain(n: int) -> contin.BoundaryValueProblem:
    """Return a problem of n coupled states on a ring, with one free parameter: its right-hand side costs little."""

    def rhs(t, u, p, out):
        for i in range(n):
            out[i] = p[0] * math.sin(u[(i + 1) % n]) - u[i] + 0.1 * u[i] * u[i - 1]

    def boundary(u0, u1, p, out):
        for i in range(n):
            out[i] = u0[i] + 0.5 * u1[i] - 1

    return contin.BoundaryValueProblem(rhs, boundary, n, {"lam": 1.0}, boundary_count=n)


def flops(intervals: int, n: int, degree: int, extra: int = 1) -> float:
    """Return the leading terms of the operations of `contin.linalg.condensation`, with its border row."""
    rows, width, inner = n * degree, n * (degree + 1) + extra, n * (degree - 1)
    local = sum(2 * (rows - c + extra - 1) * (width - c - 1) for c in range(inner))
    link = sum(2 * (2 * n - c + extra - 1) * (3 * n + extra - c - 1) for c in range(n))
    return float(intervals * (local + link))


def _sweep(shapes, repeats) -> list[dict]:
    return [_one(*shape, repeats) for shape in shapes]


def _one(intervals, n, degree, repeats) -> dict:
    """Measure one Newton iteration (rhs, Jacobian, assembly, factorization, one solve) and the share of factorization."""
    problem = chain(n)
    system = contin.lowlevel.Collocation(problem, np.linspace(0, 1, intervals + 1), degree, ["lam"], {})
    x = np.full(system.size, 0.5)
    row = np.ones(system.size)
    right = np.ones(system.equations + 1)
    _, factors = system.linearize(x, (row,))
    factors.solve(right)
    times, solves = [], []
    for _ in range(repeats):
        began = time.perf_counter()
        _, factors = system.linearize(x, (row,))
        middle = time.perf_counter()
        factors.solve(right)
        times.append(middle - began)
        solves.append(time.perf_counter() - middle)
    tracemalloc.start()
    kept = system.linearize(x, (row,))
    held, peak = tracemalloc.get_traced_memory()
    tracemalloc.stop()
    del kept
    work = flops(intervals, n, degree)
    return {
        "intervals": intervals, "n": n, "degree": degree, "linearize": median(times), "solve": median(solves), "flops": work,
        "gflops": work / median(times) / 1e9, "bytes_held": held, "bytes_peak": peak,
    }  # fmt: skip


def _blas(size: int) -> dict:
    """Return the speed of the machine's LAPACK on one dense block of this size, and of its matrix product."""
    from scipy.linalg.lapack import dgetrf

    matrix = np.asfortranarray(np.random.default_rng(1).standard_normal((size, size)) + size * np.eye(size))
    loops = max(3, int(2e7 / size**3))
    began = time.perf_counter()
    for _ in range(loops):
        dgetrf(matrix)
    factor = (time.perf_counter() - began) / loops
    began = time.perf_counter()
    for _ in range(loops):
        matrix @ matrix
    product = (time.perf_counter() - began) / loops
    return {"size": size, "dgetrf_gflops": 2 * size**3 / 3 / factor / 1e9, "dgemm_gflops": 2 * size**3 / product / 1e9}


# --- error ----------------------------------------------------------------------------------------------------------

#: Branch, a test that selects a point on it, and the name of that point.
CASES = (
    (1, 2, (-100, 100), lambda p: p.kappa_n >= 3.0, "(1, 2) at κₙ = 3"),
    (1, 4, (-1e3, 1e3), lambda p: p.eta_max_squared >= 9.5, "(1, 4) at η²max ≈ 9.5"),
    (5, 6, (-100, 100), lambda p: p.kappa_star >= 6.0, "(5, 6) halfway"),
    (3, 1, (-1e4, 100), lambda p: p.label == "EP", "(3, 1) at κₙ = −10⁴"),
)


def _errors(m, n, limits, chosen, name, counts, degrees) -> dict:
    """Return the error of kappa* at a point of the exact branch, by degree and intervals, on uniform and adapted meshes."""
    truth = next(point for point in exact.curve(m, n, NU, kappa_limits=limits) if chosen(point))
    system, x = _reference(m, n, truth)
    truth = exact.solve(m, n, NU, truth, kappa_n=system.parameter(x, "kappa_n"))
    rows = []
    for degree in degrees:
        for intervals in counts:
            for adapted in (False, True):
                try:
                    value = _kappa_star(system, x, intervals, degree, adapted)
                except contin.ConvergenceError:
                    continue
                rows.append(
                    {"degree": degree, "intervals": intervals, "adapted": adapted, "error": abs(value - truth.kappa_star)}
                )
    return {"name": name, "kappa_n": truth.kappa_n, "eta_max_squared": truth.eta_max_squared, "rows": rows}


def _reference(m, n, truth):
    """Return a well resolved solution of contin at the exact point's kappa_n: system and unknowns."""
    system, x, tangent = primary_branch(RIBBON, m, n, NU, 20, 6)
    settings = contin.Settings(
        limits={"kappa_n": (-2e4, 2e3)}, errors=False, branch_points=False, trivial="M2", max_points=5000
    )
    there = contin.Event("UZ", "there", lambda trial: trial["kappa_n"] - truth.kappa_n)
    settings = contin.Settings(**{**vars(settings), "events": (there,)})
    for point in contin.lowlevel.Continuation(system, x, settings, tangent):
        if point.label == "UZ" and abs(point["kappa_star"] - truth.kappa_star) < 1e-4 * (1 + abs(truth.kappa_star)):
            return point.system, point.x
    raise RuntimeError(f"({m}, {n}): contin did not come by kappa_n = {truth.kappa_n:g}, kappa* = {truth.kappa_star:g}")


def _kappa_star(reference, x, intervals, degree, adapted) -> float:
    """Return kappa* at the reference's kappa_n on another mesh."""
    names = dict(zip(reference.problem.parameters, reference.all_parameters(x)))

    def on(mesh):
        return contin.lowlevel.Collocation(reference.problem, mesh, degree, reference.free, names)

    mesh = np.linspace(0, 1, intervals + 1)
    if adapted:
        fine = on(reference.mesh)
        mesh = equidistributed(fine.basis, fine.mesh, fine.states(reference.carrier(fine)(x)), intervals)
    system = on(mesh)
    guess = reference.carrier(system)(x)
    row = np.zeros(system.size)
    row[system.parameter_index("kappa_n")] = 1.0
    done = contin.lowlevel.correct(system, guess, row, row @ guess)
    return Trial.without_tangent(system, done.x)["kappa_star"]


def slope(x, y) -> float:
    """Return the exponent of the power law through the points, by least squares on the upper half of x."""
    x, y = np.log(np.array(x, dtype=float)), np.log(np.array(y, dtype=float))
    upper = len(x) // 2
    return float(np.polyfit(x[upper:], y[upper:], 1)[0])


def table(results: dict) -> str:
    """Return the results as Markdown."""
    laws = [
        f"- time against intervals: exponent {_law(results['intervals'], 'intervals', 'linearize'):.2f}, memory "
        f"{_law(results['intervals'], 'intervals', 'bytes_held'):.2f} (1 is linear)",
        f"- time against components n: exponent {_law(results['components'], 'n', 'linearize'):.2f} (3 is cubic)",
        f"- time against degree: exponent {_law(results['degree'], 'degree', 'linearize'):.2f} (3 is cubic)",
    ]
    lines = [
        "| n | n × degree | time of one linearization, 20 intervals | GFlop/s of it | LAPACK on a block of that size |",
        "|---|---|---|---|---|",
    ]
    sizes = [row["size"] for row in results["blas"]]
    rates = [row["dgetrf_gflops"] for row in results["blas"]]
    for row in results["components"]:
        size = row["n"] * row["degree"]
        lines.append(
            f"| {row['n']} | {size} | {1e3 * row['linearize']:.2f} ms | {row['gflops']:.2f} | "
            f"{np.interp(size, sizes, rates):.2f} |"
        )
    return "\n".join([*laws, "", *lines])


def _law(rows, x, y) -> float:
    return slope([row[x] for row in rows], [row[y] for row in rows])
