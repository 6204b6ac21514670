"""Beyond the paper: what the width changes. Thresholds and the fold of (1, 2) against Gamma; Fig. 12a from rod to ribbon."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
from scipy.interpolate import CubicSpline
from scipy.optimize import brentq

from branches.draw.style import CONJUGATE, NATURAL, colour_of
from branches.graph.picture import conjugate, legend
from branches.graph.stored import read
from branches.paper.page import Row, Section, keep
from branches.run.display import Display
from branches.run.many import run_many
from branches.scene.parse import parse
from contin import Settings, curve, trace
from contin.lowlevel import Label, point_of
from ribbon_model import exact
from ribbon_model.laws import FINITE_WIDTH, FLAT_ROD, RIBBON
from ribbon_model.linear import thresholds
from ribbon_model.seeds import primary_branch

NU = 0.3
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
    fold, birth = fold_curve()
    rows = [Row(f"threshold of ({m}, {n}) at Γ = {G:g}: κₙL/2π =", "", threshold(m, n, G)) for m, n in MODES for G in GAMMAS]
    worst = 0.0
    for Gamma in CHECKED:
        (known,) = exact.folds(1, 2, {"nu": NU, "Gamma": Gamma}, (-100, 100), "finite width")
        found = next(kappa_n for G, kappa_n in fold if abs(G / Gamma - 1) < 1e-9)
        worst = max(worst, abs(found - known.kappa_n))
        rows.append(Row(f"fold of (1, 2) at Γ = {Gamma:g}: κₙL/2π =", "", f"{found:.10f}"))
    least = fold[np.argmin(fold[:, 1])]
    rows += [
        Row("fold of (1, 2) exists for Γ above", "", f"{birth[0]:.4f}", f"born at κₙL/2π = {birth[1]:.4f} on the single loop"),
        Row("fold of (1, 2): least κₙL/2π", "", f"{least[1]:.4f}", f"near Γ = {least[0]:.3g}"),
        Row("first threshold within 10 % of the ribbon's, Γ above", "", f"{_near_ribbon():.4g}", "single loop, (1, 2)"),
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


def _near_ribbon() -> float:
    """Gamma above which the first threshold of the single loop is within 10 % of the ribbon's."""
    target = 1.1 * thresholds(RIBBON, 1, 2, NU)[0]
    return brentq(lambda Gamma: threshold(1, 2, Gamma) - target, 1.0, 1e4)


def fold_curve() -> tuple[np.ndarray, tuple[float, float]]:
    """(Gamma, kappa_n) of the fold of (1, 2), shape (K, 2), Gamma ascending; and of the place where it is born."""
    system, x, tangent = primary_branch(FINITE_WIDTH, 1, 2, {"nu": NU, "Gamma": 10.0}, 10, 7)
    settings = Settings(trivial="M2", limits={"kappa_n": (-100, 100)})
    fold = trace(point_of(system, x), settings, tangent=tangent, progress=False).labelled(Label.FOLD)[0]
    options = {"limits": {"Gamma": (4.0, 2000.0), "M2": (-1e-3, 50.0)}, "zeros": {"Gamma": CHECKED[1:]}, "progress": False}
    up, down = (curve(fold, "Gamma", direction=sense, **options) for sense in (1, -1))
    (birth,) = down.labelled(Label.BRANCH_POINT)  # the last point
    fold = np.array([(point["Gamma"], point["kappa_n"]) for point in [*reversed(down.points), *up.points[1:]]])
    return fold, (birth["Gamma"], birth["kappa_n"])


# --- pictures ---------------------------------------------------------------------------------------------------------


def _draw_curves(fold, birth, folder: Path) -> str:
    from matplotlib.figure import Figure

    figure = Figure(figsize=(9.5, 5.5), layout="constrained")
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
    axes.plot(*_fine(fold).T, color="k", lw=2, label="fold of (1, 2)")
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


def _fine(points: np.ndarray) -> np.ndarray:
    """A smooth curve through the points of a curve, by a spline over the length along it in (log Gamma, kappa_n)."""
    logs = np.column_stack([np.log(points[:, 0]), points[:, 1]])
    length = np.append(0, np.cumsum(np.linalg.norm(np.diff(logs, axis=0), axis=1)))
    found = CubicSpline(length, logs)(np.linspace(0, length[-1], 400))
    return np.column_stack([np.exp(found[:, 0]), found[:, 1]])


def _draw_diagrams(graph, folder: Path) -> str:
    from matplotlib.figure import Figure

    figure = Figure(figsize=(15, 6), layout="constrained")
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
