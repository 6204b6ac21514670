"""Numerical stability: hard branches, extreme settings and invalid modes, compared with the exact quadrature.

The result of a case is the reason of its end, the largest error of kappa_n and kappa* at folds and ends (relative to
1 + |value|), the drift of the quaternion's length, and the condition of the discrete equations (1 / smallest singular value, at
regular points).
"""

from __future__ import annotations

import time

import numpy as np

#: (name, m, n, nu, changes of the setting): limits of kappa_n, mesh, Newton's tolerance, steps.
CASES = (
    ("as scenes do it", 1, 2, 0.3, {}),
    ("tolerance 1e-14", 1, 2, 0.3, {"tolerance": 1e-14}),
    ("one interval of degree 8", 1, 2, 0.3, {"intervals": 1, "degree": 8, "fixed": True}),
    ("2000 intervals of degree 4", 1, 2, 0.3, {"intervals": 2000, "degree": 4, "fixed": True}),
    ("first step 1e-6", 1, 2, 0.3, {"step": 1e-6, "min_step": 1e-9}),
    ("first step 10", 1, 2, 0.3, {"step": 10.0}),
    ("start rounded to 3 digits", 1, 2, 0.3, {"digits": 3}),
    ("ν = −.9", 3, 2, -0.9, {"limits": (-200, 200)}),
    ("ν = −.1", 1, 2, -0.1, {"limits": (-200, 200)}),
    ("ν = 0", 1, 2, 0.0, {}),
    ("ν = .5", 1, 2, 0.5, {}),
    ("κₙ near m/ν: (1, 7)", 1, 7, 0.3, {}),
    ("n = 20", 1, 20, 0.3, {"limits": (-200, 200)}),
    ("n = 60", 1, 60, 0.3, {"limits": (-200, 200)}),
    ("n = 60, m = 59", 59, 60, 0.3, {"limits": (-2000, 2000)}),
    ("steep: (1, 4)", 1, 4, 0.3, {}),
    ("κₙ → −10⁴", 3, 1, 0.3, {"limits": (-1e4, 100)}),
    ("κₙ → −10⁶, a branch a million long", 3, 1, 0.3, {"limits": (-1e6, 100)}),
)
#: Modes that are rejected: (name, m, n, nu).
REFUSED = (("no threshold: n = m", 3, 3, 0.3), ("a loop that does not close: m/n even", 2, 1, 0.3))


def run(quick: bool) -> dict:
    """Run every case once."""
    rows = [_case(*case) for case in (CASES[:7] if quick else CASES)]
    return {"rows": rows, "refused": [(what, _refusal(m, n, nu)) for what, m, n, nu in REFUSED]}


def _case(what, m, n, nu, changes) -> dict:
    import contin
    from ribbon_model import exact
    from ribbon_model.laws import RIBBON
    from ribbon_model.seeds import leave_circle, primary_branch

    given = {"limits": (-100, 100), "intervals": 8, "degree": 7, "tolerance": 1e-12, "step": 0.05, "min_step": 1e-6} | changes
    limits, count = given["limits"], given["intervals"]
    mesh = contin.MeshControl(every=0, min_intervals=count, max_intervals=count) if given.get("fixed") else contin.MeshControl()
    settings = contin.Settings(
        newton=contin.Newton(given["tolerance"]), mesh=mesh, trivial="M2", limits={"kappa_n": limits}, step=given["step"],
        min_step=given["min_step"], errors=not given.get("fixed"), max_points=20_000,
    )  # fmt: skip
    began = time.perf_counter()
    try:
        system, x, tangent = primary_branch(RIBBON, m, n, nu, count, given["degree"])
        if "digits" in given:
            x = np.array([float(f"{value:.{given['digits']}g}") for value in x])
            _, x, tangent = leave_circle(system, x)
        branch = contin.trace(contin.lowlevel.point_of(system, x), settings, tangent=tangent)
    except (contin.ContinError, ValueError) as error:
        return {"what": what, "mode": (m, n), "stop": f"refused: {error}", "points": 0, "seconds": time.perf_counter() - began}
    seconds = time.perf_counter() - began
    known = [point for point in exact.curve(m, n, nu, limits) if point.label][1:]
    ours = [point for point in branch if point.label in ("LP", "EP")]
    lost = any("possible" in point.name for point in ours)
    same = len(known) == len(ours) and not lost
    pairs = zip(ours, known) if same else ()
    errors = [
        abs(a[name] - getattr(b, name)) / (1 + abs(getattr(b, name))) for a, b in pairs for name in ("kappa_n", "kappa_star")
    ]
    return {
        "what": what, "mode": (m, n), "stop": branch.stop.reason + ", not located" * lost, "points": len(branch),
        "seconds": seconds,
        "special": (len(ours), len(known)), "error": max(errors, default=None), "drift": max(map(_drift, branch)),
        "singular": max(map(_singular, branch.points[1 : -1 : max(1, len(branch) // 20)]), default=np.nan),
        "intervals": max(point.system.intervals for point in branch), "length": branch.points[-1].arclength,
    }  # fmt: skip


def _drift(point) -> float:
    """Return the largest deviation of the quaternion's length from one at mesh points."""
    states = point.system.states(point.x)[:: point.system.degree, :4]
    return float(np.abs((states**2).sum(axis=1) - 1).max())


def _singular(point) -> float:
    """Return 1 / the smallest singular value of the equations with the arclength condition."""
    from contin.linalg.border import smallest_directions

    system = point.system
    factors = system.linearize(point.x, (system.weights * point.tangent,))[1]
    return float(np.linalg.norm(smallest_directions(factors, system.size, 2)[2], 2))


def _refusal(m, n, nu) -> str:
    from ribbon_model.laws import RIBBON
    from ribbon_model.seeds import primary_branch

    try:
        primary_branch(RIBBON, m, n, nu)
    except ValueError as error:
        return str(error)
    return "not refused"


def table(results: dict) -> str:
    """Return the results as Markdown."""
    lines = ["| case | (m, n) | ends by | points | intervals | folds and ends | largest error | drift of |q|² | 1/σ | time |"]
    lines.append("|" + "---|" * 10)
    lines[0] = lines[0].replace("|q|²", "q·q")
    for row in results["rows"]:
        head = f"| {row['what']} | {row['mode']} | {row['stop']} | {row['points']} |"
        if not row["points"]:
            lines.append(f"{head} | | | | | {row['seconds']:.2f} s |")
            continue
        ours, known = row["special"]
        error = "–" if row["error"] is None else f"{row['error']:.0e}"
        singular = "–" if np.isnan(row["singular"]) else f"{row['singular']:.0e}"
        found = f"{ours} of {known}" if ours != known else f"{ours}"
        lines.append(
            f"{head} {row['intervals']} | {found} | {error} | {row['drift']:.0e} | {singular} | {row['seconds']:.2f} s |"
        )
    return "\n".join([*lines, "", *(f"- refused, {what}: “{why}”" for what, why in results["refused"])])
