"""Beyond the paper: folds and a secondary bifurcation followed in Poisson's ratio, and what the width changes.

The curves show where the folds are born, and thresholds and the fold of (1, 2) against Gamma; Fig. 12a goes from rod to ribbon.
"""

from __future__ import annotations

import dataclasses
import json
from pathlib import Path

import numpy as np
from scipy.interpolate import CubicSpline
from scipy.optimize import brentq

from branches.draw.style import CONJUGATE, NATURAL, colour_of
from branches.graph.picture import conjugate, legend
from branches.graph.stored import read
from branches.paper.page import STABLE, Row, Section, keep, new_figure
from branches.run.display import Display
from branches.run.many import run_many
from branches.scene.index import LABEL, SymmetryWatch
from branches.scene.parse import parse
from contin import Point, Settings, curve, trace
from contin.lowlevel import Label, locate_branch_point, point_of
from ribbon_model import exact
from ribbon_model.domains import HALF_LOOP
from ribbon_model.law import Law
from ribbon_model.laws import FINITE_WIDTH, FLAT_ROD, RIBBON
from ribbon_model.linear import thresholds
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
        known = [(kappa_n, exact.folds(m, n, nu, kappa_limits=(-300, 300))) for nu, kappa_n in line[::3]]
        worst = max(worst, *(min(abs(point.kappa_n - kappa_n) for point in folds) for kappa_n, folds in known))
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


def _first_fold(law: Law, m: int, n: int, parameters, intervals: int) -> Point:
    system, x, tangent = primary_branch(law, m, n, parameters, intervals, 7)
    settings = Settings(trivial="M2", limits={"kappa_n": (-100, 100)})
    return trace(point_of(system, x), settings, tangent=tangent, progress=False).labelled(Label.FOLD)[0]


def fold_curve(m: int, n: int) -> tuple[np.ndarray, dict[float, float], float]:
    """(nu, kappa_n) of the first fold of (m, n), shape (K, 2), nu ascending; kappa_n at NUS; nu at which the fold is born.

    A fold is born with amplitude zero, and with M2 = 0: there nu is an even function of M2, extrapolated as a polynomial.
    """
    fold = _first_fold(RIBBON, m, n, NU, 8)
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


def _draw(lines, secondary, last, folder: Path) -> str:
    figure = new_figure(11, 4.5)
    panels = figure.subplots(1, 2)
    for (m, n), line in lines.items():
        colour = colour_of(n)
        fine = np.linspace(line[0, 0], line[-1, 0], 300)
        panels[0].plot(fine, CubicSpline(*line.T)(fine), color=colour, label=f"fold of ({m}, {n})")
        starts = [exact.bifurcation(m, n, nu) for nu in fine]
        panels[0].plot(fine, starts, color=colour, ls=":", lw=1, label=f"threshold of ({m}, {n})")
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


# --- strips of finite width ------------------------------------------------------------------------------------------


MODES = ((1, 2), (1, 3), (1, 4), (3, 2), (3, 4), (5, 6))
GAMMAS = (1.0, 10.0, 100.0)
#: Where the curve of folds begins, and the other values of Gamma at which it is compared with the exact quadrature.
CHECKED = (10.0, 100.0, 1000.0)
WINDOW = (-8.0, 14.0)
SCENE = (
    f"{{title: Fig. 12a at several widths, law: [ribbon, finite width], Gamma: [{', '.join(map(str, GAMMAS))}], nu: {NU}, "
    "m: [1, 3, 5, 7], n: [1, 2, 3, 4, 5, 6, 7], limits: {kappa_n: [-30, 40]}, stability: true, stride: 50}"
)


def finite_width(folder: Path) -> Section:
    """Curves against Gamma = w**2/(h L/2pi), and the diagrams side by side."""
    fold, birth = fold_over_width()
    rows = [Row(f"threshold of ({m}, {n}) at Γ = {G:g}: κₙL/2π =", "", threshold(m, n, G)) for m, n in MODES for G in GAMMAS]
    worst = 0.0
    for Gamma in CHECKED:
        (known,) = exact.folds(1, 2, {"nu": NU, "Gamma": Gamma}, (-100, 100), "finite width")
        found = next(kappa_n for G, kappa_n in fold if abs(G / Gamma - 1) < 1e-9)
        worst = max(worst, abs(found - known.kappa_n))
        rows.append(Row(f"fold of (1, 2) at Γ = {Gamma:g}: κₙL/2π =", "", f"{found:.10f}"))
    least, target = fold[np.argmin(fold[:, 1])], 1.1 * thresholds(RIBBON, 1, 2, NU)[0]
    near_ribbon = brentq(lambda Gamma: threshold(1, 2, Gamma) - target, 1.0, 1e4)
    rows += [
        Row("fold of (1, 2) exists for Γ above", "", f"{birth[0]:.4f}", f"born at κₙL/2π = {birth[1]:.4f} on the single loop"),
        Row("fold of (1, 2): least κₙL/2π", "", f"{least[1]:.4f}", f"near Γ = {least[0]:.3g}"),
        Row("first threshold within 10 % of the ribbon's, Γ above", "", f"{near_ribbon:.4g}", "single loop, (1, 2)"),
    ]
    notes = [
        f"The folds at Γ = {', '.join(f'{G:g}' for G in CHECKED)} by collocation, on the curve in two parameters, are "
        f"{worst:.0e} from those of the exact quadrature.",
        "Below its birth (1, 2) leaves the single loop downwards, as a rod's branch does; above upwards, as the ribbon's.",
        "A cross marks where a line ends inside the picture: the strain energy is no longer convex there, so the law ends (see "
        "docs/finite-width.md). Thick lines are stable.",
    ]
    run_many(parse(SCENE, "finite-width"), folder / "finite_width", Display(quiet=True))
    graph = read(folder / "finite_width")
    missing = [*json.loads(graph.graph["failed"]), *json.loads(graph.graph["absent"])]
    if missing:
        notes.append(f"Not in the picture, because they failed or begin outside its limits: {'; '.join(missing)}.")
    pictures = [_draw_curves(fold, birth, folder), _draw_diagrams(graph, folder)]
    return Section("From rod to ribbon: strips of finite width, ν = .3", rows, pictures, notes)


def threshold(m: int, n: int, Gamma: float) -> float:
    """kappa_n where (m, n) leaves the m-covered circle; nan where it does not."""
    try:
        return thresholds(FINITE_WIDTH, m, n, {"nu": NU, "Gamma": Gamma})[0]
    except ValueError:
        return float("nan")


def fold_over_width() -> tuple[np.ndarray, tuple[float, float]]:
    """(Gamma, kappa_n) of the fold of (1, 2), shape (K, 2), Gamma ascending; and of the place where it is born."""
    fold = _first_fold(FINITE_WIDTH, 1, 2, {"nu": NU, "Gamma": 10.0}, 10)
    options = {"limits": {"Gamma": (4.0, 2000.0), "M2": (-1e-3, 50.0)}, "zeros": {"Gamma": CHECKED[1:]}, "progress": False}
    up, down = (curve(fold, "Gamma", direction=sense, **options) for sense in (1, -1))
    (birth,) = down.labelled(Label.BRANCH_POINT)  # the last point
    fold = np.array([(point["Gamma"], point["kappa_n"]) for point in [*reversed(down.points), *up.points[1:]]])
    return fold, (birth["Gamma"], birth["kappa_n"])


# --- pictures ---------------------------------------------------------------------------------------------------------


def _draw_curves(fold, birth, folder: Path) -> str:
    figure = new_figure(9.5, 5.5)
    axes = figure.subplots()
    Gammas = np.geomspace(0.05, 1000, 400)
    for m, n in MODES:
        colour, values = colour_of(n), np.array([threshold(m, n, Gamma) for Gamma in Gammas])
        axes.plot(Gammas, values, color=colour)
        first = int(np.argmax(values < WINDOW[1] - 1))
        axes.annotate(f"({m}, {n})", (Gammas[first], values[first]), (8, 5), textcoords="offset points", color=colour)
        for law, at, marker in ((FLAT_ROD, 0.05, "<"), (RIBBON, 1000, ">")):
            limit = thresholds(law, m, n, NU)[0]
            if limit < WINDOW[1]:
                axes.plot(at, limit, marker, color=colour, clip_on=False, ms=6)
    logs = np.column_stack([np.log(fold[:, 0]), fold[:, 1]])  # drawn as a spline over the length in (log Gamma, kappa_n)
    length = np.append(0, np.cumsum(np.linalg.norm(np.diff(logs, axis=0), axis=1)))
    found = CubicSpline(length, logs)(np.linspace(0, length[-1], 400))
    axes.plot(np.exp(found[:, 0]), found[:, 1], color="k", lw=2, label="fold of (1, 2)")
    axes.plot(*birth, "o", color="k", label=f"its birth, Γ = {birth[0]:.3f}")
    axes.plot([], [], color="0.4", label="threshold of (m, n)")
    axes.plot([], [], "<", color="0.4", label="flat rod")
    axes.plot([], [], ">", color="0.4", label="ribbon")
    axes.set(
        xscale="log", xlim=(0.05, 1000), ylim=(-1, WINDOW[1]), xlabel=r"$\Gamma = w^2/(h L/2\pi)$", ylabel=r"$\kappa_n L/2\pi$"
    )
    axes.legend(frameon=False, ncols=2, fontsize=9)
    axes.grid(alpha=0.2)
    return keep(figure, folder, "finite_width_curves")


def _draw_diagrams(graph, folder: Path) -> str:
    figure = new_figure(15, 6)
    panels = figure.subplots(1, len(GAMMAS) + 1, sharex=True, sharey=True)
    names = [*(f"{FINITE_WIDTH.name}, Gamma = {Gamma:.12g}" for Gamma in GAMMAS), RIBBON.name]
    for axes, name, Gamma in zip(panels, names, (*GAMMAS, None)):
        conjugate(axes, graph, name, NU, WINDOW)
        axes.set(title="ribbon, Γ = ∞" if Gamma is None else f"Γ = {Gamma:g}", xlabel=NATURAL)
        axes.label_outer()
    panels[0].set_ylabel(CONJUGATE)
    handles = {handle.get_label(): handle for name in names for handle in legend(graph, name, NU, WINDOW)}
    figure.legend(handles=list(handles.values()), loc="outside lower center", ncols=8, frameon=False)
    return keep(figure, folder, "finite_width_fig12a")
