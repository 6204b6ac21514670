"""Beyond the paper: folds and a secondary bifurcation followed in Poisson's ratio, and where the folds are born."""

from __future__ import annotations

import dataclasses
from pathlib import Path

import numpy as np
from scipy.optimize import brentq

from branches.draw.style import colour_of
from branches.paper.page import STABLE, Row, Section, keep
from branches.scene.index import LABEL, SymmetryWatch
from contin import Settings, curve, trace
from contin.lowlevel import Label, locate_branch_point, point_of
from ribbon_model import exact
from ribbon_model.domains import HALF_LOOP
from ribbon_model.laws import RIBBON
from ribbon_model.seeds import primary_branch
from ribbon_model.solution import Solution

NU, LOWEST, HIGHEST = 0.3, -0.9, 0.5
FOLDS = ((1, 2), (3, 4))
NUS = (-0.05, 0.0, 0.1, 0.2, 0.4)
NUS_SECONDARY = (-0.5, 0.0, 0.1, 0.2, 0.3)
LEFT = -150.0
#: Folds with these parts of the moment M2 at NU tell where the fold is born; the first ends the curve.
PARTS = (0.06, 0.12, 0.18, 0.24)


def curves(folder: Path) -> Section:
    """kappa_n of the first folds of (1, 2) and (3, 4), and of the secondary bifurcations of (3, 1), against nu; ribbon."""
    rows, lines, worst = [], {}, 0.0
    for m, n in FOLDS:
        line, values, near = fold_curve(m, n)
        worst = max(worst, _difference(m, n, line))
        rows += [Row(f"fold of ({m}, {n}) at ν = {nu:g}: κₙL/2π =", "", f"{values[nu]:.8f}") for nu in sorted(values)]
        born = brentq(lambda nu, m=m, n=n: exact.initial_slope(m, n, nu), near - 0.02, near + 0.02, xtol=1e-14)
        remark = f"by quadrature: dκₙ/dA = 0 on the circle, at κₙL/2π = {exact.bifurcation(m, n, born):.6f}"
        lines[m, n] = np.vstack([(born, exact.bifurcation(m, n, born)), line])
        rows.append(Row(f"fold of ({m}, {n}) exists for ν above", "", f"{born:.10f}", remark))
        rows.append(Row("", "", f"{near:.8f}", "by collocation: the curve of folds, extrapolated to amplitude zero"))
    line, found = secondary_curve(3, 1)
    rows += [
        Row(f"secondary bifurcation of (3, 1) at ν = {nu:.2g}: κₙL/2π =", "", f"{kappa_n:.8f}")
        for label, nu, kappa_n in found
        if label == Label.USER_ZERO
    ]
    last = next((nu, kappa_n) for label, nu, kappa_n in found if label == Label.FOLD)
    text = f"the two meet there, at κₙL/2π = {last[1]:.1f}; the equations of branch points are nearly singular there"
    rows.append(Row("secondary bifurcations of (3, 1) exist for ν below", "", f"{last[0]:.9f}", text))
    notes = [
        "Folds: collocation, followed in (κₙ, ν); largest difference from the exact quadrature at the points of these runs "
        f"{worst:.0e}.",
        "At its birth the fold comes out of the pitchfork, which is subcritical for smaller ν: the amplitude there is zero, "
        "and κₙ is the threshold (27).",
        "Secondary bifurcations: branch points of the half loop, followed in (κₙ, ν) from the one that the index finds at "
        f"ν = {NU:g}.",
        "Rods: no fold on any primary branch (m, n ≤ 7) at ν = .3. Between rod and ribbon see the finite-width law.",
    ]
    return Section("Folds and a secondary bifurcation against ν, ribbon", rows, [_draw(lines, line, last, folder)], notes)


def fold_curve(m: int, n: int) -> tuple[np.ndarray, dict[float, float], float]:
    """(nu, kappa_n) of the first fold of (m, n), shape (K, 2), nu ascending; kappa_n at NUS; nu at which the fold is born.

    A fold is born with amplitude zero, and with M2 = 0: there nu is an even function of M2, extrapolated as a polynomial.
    """
    system, x, tangent = primary_branch(RIBBON, m, n, NU, 8, 7)
    settings = Settings(trivial="M2", limits={"kappa_n": (-100, 100)})
    fold = trace(point_of(system, x), settings, tangent=tangent, progress=False).labelled(Label.FOLD)[0]
    moments = [part * fold["M2"] for part in PARTS]
    limits = {"nu": (LOWEST, HIGHEST), "kappa_n": (-200, 200), "M2": (moments[0], 100)}
    options = {"limits": limits, "zeros": {"nu": NUS, "M2": moments[1:]}, "progress": False}
    up, down = (curve(fold, "nu", direction=sense, **options) for sense in (1, -1))
    points = [*reversed(down.points), *up.points[1:]]
    zeros = [(p["nu"], p["kappa_n"]) for p in points if p.name.startswith("nu = ") and p.label == Label.USER_ZERO]
    values = {min(NUS, key=lambda asked: abs(asked - nu)): kappa_n for nu, kappa_n in zeros}
    near = [(p["M2"], p["nu"]) for p in down.points if p.name.startswith("M2 = ")]
    assert len(near) == len(PARTS)
    birth = np.polynomial.Polynomial.fit(np.square([at for at, _ in near]), [nu for _, nu in near], len(PARTS) - 1)(0.0)
    return np.array([(p["nu"], p["kappa_n"]) for p in points]), values, float(birth)


def secondary_curve(m: int, n: int) -> tuple[np.ndarray, list[tuple[str, float, float]]]:
    """Where the branch that breaks all but one mirror leaves (m, n): (nu, kappa_n), shape (K, 2); its labelled points."""
    system, x, tangent = primary_branch(RIBBON, m, n, NU, 8, 7)
    settings = Settings(trivial="M2", limits={"kappa_n": (LEFT, 100)}, events=SymmetryWatch(RIBBON, system, x).monitors)
    points = trace(point_of(system, x), settings, tangent=tangent, progress=False)
    first = next(point for point in points if point.label == LABEL)
    system, x = Solution.of(first).on(HALF_LOOP).discretized()
    found = locate_branch_point(system, x)
    start = dataclasses.replace(first, label=Label.BRANCH_POINT, system=system, x=found.x, details=found)
    limits = {"nu": (LOWEST, HIGHEST), "kappa_n": (LEFT, 100)}
    options = {"limits": limits, "zeros": {"nu": NUS_SECONDARY}, "max_step": 10.0, "progress": False}
    down, up = (curve(start, "nu", direction=sense, **options) for sense in (-1, 1))
    points = [*reversed(down.points), *up.points[1:]]
    found = [(Label.USER_ZERO if p.name == "start" else p.label, round(p["nu"], 13) + 0.0, p["kappa_n"]) for p in points]
    return np.array([(p["nu"], p["kappa_n"]) for p in points]), found


def _difference(m, n, line) -> float:
    """The largest difference from the quadrature, at every third point."""
    known = [(kappa_n, exact.folds(m, n, nu, kappa_limits=(-300, 300))) for nu, kappa_n in line[::3]]
    return max(min(abs(point.kappa_n - kappa_n) for point in folds) for kappa_n, folds in known)


def _draw(lines, secondary, last, folder: Path) -> str:
    from matplotlib.figure import Figure
    from scipy.interpolate import CubicSpline

    figure = Figure(figsize=(11, 4.5), layout="constrained")
    panels = figure.subplots(1, 2)
    for (m, n), line in lines.items():
        colour = colour_of(n)
        fine = np.linspace(line[0, 0], line[-1, 0], 300)
        panels[0].plot(fine, CubicSpline(*line.T)(fine), color=colour, label=f"fold of ({m}, {n})")
        panels[0].plot(
            fine, [exact.bifurcation(m, n, nu) for nu in fine], color=colour, ls=":", lw=1, label=f"threshold of ({m}, {n})"
        )
        panels[0].plot(*line[0], "o", color=colour)
    panels[0].set(xlabel=r"Poisson's ratio $\nu$", ylabel=r"$\kappa_n L/2\pi$", title="folds, and where they are born (dots)")
    smooth = np.column_stack([secondary[:, 0], np.log(-secondary[:, 1])])
    along = np.append(0.0, np.hypot(*np.diff(smooth, axis=0).T).cumsum())
    apart = np.append(True, np.diff(along) > 1e-6)
    nu, logarithm = CubicSpline(along[apart], smooth[apart])(np.linspace(0, along[-1], 300)).T
    panels[1].semilogy(nu, np.exp(logarithm), color=STABLE)
    panels[1].plot(last[0], -last[1], "D", color=STABLE, ms=5)
    title = "secondary bifurcations of (3, 1), and where they meet"
    panels[1].set(xlabel=r"Poisson's ratio $\nu$", ylabel=r"$-\kappa_n L/2\pi$", title=title, xlim=(-0.92, 0.4))
    panels[0].legend(frameon=False)
    for axes in panels:
        axes.grid(alpha=0.2)
    return keep(figure, folder, "curves")
