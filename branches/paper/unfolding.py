"""Fig. 6 of Audoly & Seffen (2015): the unfolding semicircle."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from branches.paper.page import STABLE, UNSTABLE_FILL, Row, Section, keep, new_figure
from ribbon_model.laws import FLAT_ROD, ISOTROPIC_ROD, RIBBON
from ribbon_model.unfolding import HINGED, factors, first_root

NU = 0.3
TOP = 4.5


def fig6(folder: Path) -> Section:
    """Sign of the shooting determinant over (nu, xi), and the first roots at nu = .3."""
    ribbon, flat, isotropic = (first_root(law, NU) for law in (RIBBON, FLAT_ROD, ISOTROPIC_ROD))
    shot = max(abs(first_root(law, NU, method="shooting") - root) for law, root in (
        (RIBBON, ribbon), (FLAT_ROD, flat), (ISOTROPIC_ROD, isotropic)))  # fmt: skip
    rows = [
        Row("ribbon: 1 − ν minus the first root ξ", ".004", 1 - NU - ribbon, "caption and section 5.3"),
        Row("ribbon: first root ξ", "", f"{ribbon:.12f}"),
        Row("flat rod: first root ξ", "not before ≈ 2", f"{flat:.12f}", "ends as in (20g)"),
        Row("isotropic rod: first root ξ", "not before ≈ 2", f"{isotropic:.12f}", "ends as in (20g)"),
    ]
    for law in (FLAT_ROD, ISOTROPIC_ROD):
        free = first_root(law, NU, ends=HINGED, method="shooting")
        rows.append(Row(f"{law.name}: first root ξ, M₂ = 0 at the ends", "≈ 2", free, "ends free to turn about d₂"))
    notes = [
        f"ν = .3, θₙ = π. Closed form and shooting agree to {shot:.0e}.",
        "The paper's 'does not typically take place before ξ ≈ 2' is not what its conditions (20g) give for the isotropic rod: "
        "1.72. With ψ₂ free instead (M₂ = 0) every rod has a root at exactly 2, a rigid rotation about the chord.",
        "ξ = 1 (flat): the interval of (20) shrinks to a point and its determinant vanishes with an odd power of 1 − ξ for "
        "every rod. It is no mode; that change of sign is taken out of the pictures.",
        "Ribbon: the roots accumulate at ξ = 1 − ν from below. Between 1 − ν and 1 the tangent twisting modulus is negative; "
        "the flat state, ω₁ = 0, is a singular point of the law.",
        "White beyond the first mode (black line) means an even number of unstable directions, not stability.",
    ]
    return Section("Fig. 6: unfolding of a semicircle", rows, [_draw(folder)], notes)


def sign(law, nu, xi):
    """+1 where det S has the sign that it has near xi = 0, -1 elsewhere: that of -8 (1 - xi)^4 even odd / t.

    Without the change of sign at xi = 1 that belongs to the scaling (shape of nu and xi broadcast).
    """
    even, odd = factors(law, nu, xi)
    _, t = law.tangent_moduli(1 / (1 - xi), nu)
    near_natural = np.sign(np.prod(factors(law, nu, np.float64(1e-3)), axis=0))
    return np.sign(even * odd * t) * near_natural * np.where(xi > 1, -1, 1)


def _draw(folder: Path) -> str:
    figure = new_figure(14, 5)
    panels = figure.subplots(1, 4)
    for axes, law, letter in ((panels[0], RIBBON, "a"), (panels[2], FLAT_ROD, "b"), (panels[3], ISOTROPIC_ROD, "c")):
        nu, xi = np.meshgrid(np.linspace(0.001, 0.5, 300), np.linspace(0.0025, TOP, 1000))
        _shade(axes, nu, xi, sign(law, nu, xi))
        axes.axhline(1, color="0.35", lw=1, ls=":")
        axes.text(0.49, 1.03, "flat", ha="right", va="bottom", color="0.25", fontsize=8)
        axes.set(ylim=(0, TOP), title=f"({letter}) {law.name}", ylabel=r"unfolding parameter $\xi$")
        values = np.linspace(0.005, 0.5, 60)
        roots = [first_root(law, value, largest=TOP + 1) for value in values]
        axes.plot(values, [np.nan if root is None else root for root in roots], color="k", lw=1.8)
    nu = np.linspace(0, 0.5, 100)  # hatched where the twisting modulus is negative: the determinant's sign says nothing there
    panels[0].fill_between(nu, 1 - nu, 1, facecolor="0.85", edgecolor="0.45", hatch="////", linewidth=0)
    panels[0].plot(nu, 1 - nu, color=STABLE, lw=1.5, ls="--")
    _zoom(panels[1])
    for axes in panels:
        axes.set(xlim=(0, 0.5), xlabel=r"Poisson's ratio $\nu$")
    _legend(figure)
    return keep(figure, folder, "fig6")


def _shade(axes, x, y, values):
    from matplotlib.colors import ListedColormap

    axes.pcolormesh(
        x, y, values, cmap=ListedColormap([UNSTABLE_FILL, "white"]), vmin=-1, vmax=1, rasterized=True, shading="nearest"
    )


def _zoom(axes):
    """Panel a': the distance to xi = 1 - nu."""
    nu, gap = np.meshgrid(np.linspace(0.001, 0.5, 400), np.linspace(-0.009, -2e-5, 800))
    _shade(axes, nu, gap, sign(RIBBON, nu, 1 - nu + gap))
    values = np.linspace(0.005, 0.5, 100)
    axes.plot(values, [first_root(RIBBON, value) - 1 + value for value in values], color="k", lw=1.8)
    axes.fill_between([0, 0.5], 0, 0.002, facecolor="0.85", edgecolor="0.45", hatch="////", linewidth=0)
    axes.axhline(0, color=STABLE, lw=1.5, ls="--")
    root = first_root(RIBBON, NU)
    axes.plot([NU, NU], [root - 1 + NU, 0], color="k", lw=1, marker="_", ms=9)
    axes.annotate(f"{1 - NU - root:.4f}", (NU, (root - 1 + NU) * 0.97), xytext=(-14, -26), textcoords="offset points",
                  ha="right", arrowprops={"arrowstyle": "-", "lw": 0.7})  # fmt: skip
    axes.set(ylim=(-0.009, 0.002), title="(a') ribbon, near $\\xi = 1 - \\nu$", ylabel=r"$\xi - (1 - \nu)$")


def _legend(figure):
    from matplotlib.lines import Line2D
    from matplotlib.patches import Patch

    handles = [
        Patch(facecolor="white", edgecolor="0.4", label="determinant: sign of the natural state"),
        Patch(facecolor=UNSTABLE_FILL, edgecolor="0.4", label="opposite sign"),
        Line2D([], [], color="k", lw=1.8, label="first marginal mode"),
        Line2D([], [], color=STABLE, ls="--", lw=1.5, label=r"ribbon: $t = 0$, $\xi = 1 - \nu$"),
        Patch(facecolor="0.85", edgecolor="0.45", hatch="////", label=r"ribbon: $t < 0$"),
    ]
    figure.legend(handles=handles, loc="outside lower center", ncols=5, frameon=False)
