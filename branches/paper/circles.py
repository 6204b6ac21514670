"""Tables 1 to 3, and Figs. 9 and 10, of Audoly & Seffen (2015): linear stability of the m-covered circles."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np

from branches.draw.style import in_words
from branches.paper.page import MODES, RIGID, STABLE, UNSTABLE, UNSTABLE_FILL, Row, Section, keep, new_figure
from ribbon_model import exact
from ribbon_model.dispersion import coefficients, squared_frequencies
from ribbon_model.laws import FLAT_ROD, ISOTROPIC_ROD, RIBBON
from ribbon_model.linear import convex_limits, energy_interval, stability_interval, thresholds

NU = 0.3
COVERINGS = (1, 3, 5, 7)
#: Printed ends of the intervals: (law, m) -> (low, high). Section 6.2 and the bold entries of Table 3.
PRINTED = {
    ("ribbon", 1): ("none", "2.50"),
    ("ribbon", 3): ("-0.17", "1.74"),
    ("ribbon", 5): ("0.36", "1.49"),
    ("ribbon", 7): ("0.56", ""),
    ("flat rod", 1): ("none", "5.62"),
}
LOAD = r"$\kappa_n r_0$"
WAVE = r"wavenumber $\bar k = n/m$"
#: Table 3, as printed: K for n = 1 ... 7.
TABLE_3 = {
    1: ("1.", "2.50", "2.93", "3.10", "3.18", "3.23", "3.26"),
    3: ("-1.67", "-0.17", "1.", "1.74", "2.20", "2.50", "2.70"),
    5: ("-2.17", "-1.37", "-0.45", "0.36", "1.", "1.49", "1.85"),
    7: ("-2.33", "-1.86", "-1.24", "-0.58", "0.03", "0.56", "1."),
}


def table1(folder: Path) -> Section:
    """Experiments on a steel blade, beside the thresholds of the models."""
    bound = {m: stability_interval(RIBBON, m, NU) for m in (1, 3, 5)}
    fold = exact.folds(1, 2, NU)[0].kappa_n
    rows = [
        Row("m = 1, κₙr₀ below", "3.50", bound[1][1], "ribbon: the planar loop loses stability (linear theory)", True),
        Row("", "3.50", fold, "ribbon: fold that ends the buckled branch (1, 2)", True),
        Row("", "3.50", stability_interval(FLAT_ROD, 1, NU)[1], "flat rod, linear theory", True),
        Row("", "3.50", stability_interval(ISOTROPIC_ROD, 1, NU)[1], "isotropic rod, linear theory", True),
        Row("m = 3, κₙr₀ above", "0.28", bound[3][0], "ribbon, linear theory", True),
        Row("m = 3, κₙr₀ below", "beyond elastic limit", bound[3][1], "ribbon, linear theory"),
        Row("m = 5, κₙr₀ above", "0.42", bound[5][0], "ribbon, linear theory", True),
        Row("m = 5, κₙr₀ below", "beyond elastic limit", bound[5][1], "ribbon, linear theory"),
        Row("fold of (1, 2), as computed in the paper", "4.08", fold, "section 6.4"),
    ]
    notes = [
        "The published values are measured, except in the last line: the differences are no errors. ν = .3 is assumed.",
        "m = 1: between 2.50 and 4.076 the ribbon has a stable buckled loop, and the measured 3.5 lies between the two; it is "
        "no confirmation of either. m = 3 and 5: the measured bounds are the narrower ones. Contact, friction and gravity "
        "were present and are in none of the models.",
        "The ribbon law is the limit of large w²/(h r₀). For this blade, 5.65 × .65 mm and L ≈ 3 m, it is about "
        f"{5.65**2 / (0.65 * 3000 / (2 * math.pi)):.2f} at m = 1: the blade is not in that limit.",
    ]
    return Section("Table 1: measured regions of stability", rows, notes=notes)


def table2(folder: Path) -> Section:
    """Tangent moduli, from the derivatives of the laws themselves at two circles."""
    rows = []
    for law, formula in ((RIBBON, "2(1 − νκₙr₀)"), (FLAT_ROD, "2/(1 + ν)"), (ISOTROPIC_ROD, "1/(1 + ν)")):
        for ratio in (0.0, 2.0):
            g, t = law.tangent_moduli(ratio, NU)
            _, _, omega_2, omega_3, _ = law.response(1 - ratio, 1e-5, 1e-5, ratio, NU)  # omega_3 is odd in M_3
            where = f"ν = .3, κₙr₀ = {ratio:g}"
            rows.append(Row(f"{law.name}, t at {where}", f"{t:.6f}", 1e-5 / omega_3, f"published: t = {formula}"))
            infinite = omega_2 == 0
            rows.append(Row(f"{law.name}, g at {where}", "∞" if math.isinf(g) else "1", "∞" if infinite else 1e-5 / omega_2))
    notes = ["Ours: M₃/ω₃ and M₂/ω₂ for a small moment, from the complementary energy of each law; not the formula once more."]
    return Section("Table 2: tangent moduli on a circle", rows, notes=notes)


def table3(folder: Path) -> Section:
    """The bifurcations of m-covered circles, ribbon, nu = .3."""
    rows = []
    for m, printed in TABLE_3.items():
        for n, value in enumerate(printed, start=1):
            if n == m:
                rows.append(Row(f"m = {m}, n = {n}", value, "none", "a rigid rotation; (27) gives 1"))
                continue
            bold = "ends the interval of stability" if abs(n - m) == 1 else ""
            rows.append(Row(f"m = {m}, n = {n}", value, thresholds(RIBBON, m, n, NU)[0] / m, bold))
    notes = ["The text after (27) calls the first of these K^{1,1}; it is K^{1,2} = 2.5."]
    return Section("Table 3: thresholds κₙr₀ of the ribbon, ν = .3", rows, notes=notes)


def fig9(folder: Path) -> Section:
    """How the stability of the 3-covered ribbon is read from the dispersion relation."""
    low, high = stability_interval(RIBBON, 3, NU)
    rows = [
        Row("m = 3: stable above κₙr₀ =", "-.17", low, "section 6.2; threshold of n = 2"),
        Row("m = 3: stable below κₙr₀ =", "1.74", high, "section 6.2; threshold of n = 4"),
    ]
    note = "k = 0 and k = 1 (n = 0 and n = m) are rigid motions."
    return Section("Fig. 9: linear stability of the 3-covered ribbon, ν = .3", rows, [_draw_fig9(folder)], [note])


def fig10(folder: Path) -> Section:
    """The intervals of stability of the three models; for the isotropic rod also those of the energy."""
    rows = []
    for law in (RIBBON, FLAT_ROD, ISOTROPIC_ROD):
        for m in COVERINGS:
            printed = PRINTED.get((law.name, m), ("", ""))
            for side, published, value in zip(("above", "below"), printed, stability_interval(law, m, NU)):
                ours = value if math.isfinite(value) else "none"
                rows.append(Row(f"{law.name}, m = {m}: stable {side} κₙr₀ =", published, ours))
    low, _ = energy_interval(ISOTROPIC_ROD, 1, NU)
    rows.append(Row("isotropic rod, m = 1: minimum of the energy above κₙr₀ =", "", low, "see below"))
    straight = [m for m in range(1, 40, 2) if np.prod(np.sign(stability_interval(ISOTROPIC_ROD, m, NU))) < 0]
    rows.append(Row("isotropic rod, κₙ = 0: stable for m =", "1", ", ".join(map(str, straight)), "section 6.2; odd m up to 39"))
    notes = [
        "The boundary c = 0 of the isotropic rod is reproduced as published. It is not a loss of stability of the energy: "
        "beyond it (26b) is positive although the energy still has a negative direction, a twist to which (16c) gives no "
        "inertia. It ends none of the intervals.",
        "Isotropic rod, m = 1: the published interval goes down to -1.64. A ring with κₙ < 0 lowers its energy by turning over "
        "about its centreline (n = 0; the paper counts it among the rigid modes), so the energy is a minimum only above 0.",
        "For the ribbon and the flat rod both notions agree.",
    ]
    return Section("Fig. 10: intervals of stability of m-covered circles, ν = .3", rows, [_draw_fig10(folder)], notes)


# --- Fig. 9 -----------------------------------------------------------------------------------------------------------


def _draw_fig9(folder: Path) -> str:
    figure = new_figure(12, 6)
    grid = figure.add_gridspec(2, 4, width_ratios=(1, 1, 1, 3), height_ratios=(1, 0.09))
    first = None
    for column, ratio in enumerate((0.0, 1.0, 2.0)):
        axes = figure.add_subplot(grid[0, column], sharey=first)
        first = first or axes
        _frequencies(axes, ratio)
        axes.set(title=f"{'(a)   ' if column == 0 else ''}{LOAD} = {ratio:g}")
        axes.tick_params(labelleft=column == 0)
    first.set(ylabel=WAVE, ylim=(-0.06, 2.06))
    region = figure.add_subplot(grid[0, 3])
    _region(region, RIBBON, (-3, 4), 2.06)
    _modes(region, RIBBON, 3, (-3, 4), 2.06)
    for ratio in (0, 1, 2):
        region.axvline(ratio, color="0.3", lw=0.9, ls=":")
    region.set(title="(b) modes with $(\\bar\\Omega^2)_2 < 0$", ylabel=WAVE, ylim=(-0.06, 2.06))
    region.tick_params(labelbottom=False)
    below = figure.add_subplot(grid[1, 3], sharex=region)
    _bars(below, [(RIBBON, 3)], (-3, 4))
    below.set(xlabel=f"natural over actual curvature {LOAD}", yticks=[], ylabel="(b')")
    _legend9(figure)
    return keep(figure, folder, "fig9")


def _frequencies(axes, ratio):
    """The second root (26b) as a function of k, blue and solid where positive, orange and dashed where negative."""
    k = np.linspace(0, 2.06, 2000)
    g, t = RIBBON.tangent_moduli(ratio, NU)
    root = squared_frequencies(1 - ratio, g, t, k)[1]
    _quantized(axes, 3, 2.06)
    axes.axvline(0, color="0.4", lw=0.8)
    axes.plot(np.where(root >= 0, root, np.nan), k, color=STABLE, lw=1.8)
    axes.plot(np.where(root <= 0, root, np.nan), k, color=UNSTABLE, lw=1.8, ls=(0, (3, 1)))
    for n in range(1, 7):
        if n != 3:
            value = squared_frequencies(1 - ratio, g, t, n / 3)[1]
            stable = value > 0
            axes.plot(value, n / 3, "o" if stable else "X", color=STABLE if stable else UNSTABLE, ms=6, clip_on=True)
    axes.set(xlim=(-0.75, 1.5), xlabel=r"$(\bar\Omega^2)_2$")


def _quantized(axes, m, top):
    for n in range(int(top * m) + 1):
        rigid = n in (0, m)
        axes.axhline(n / m, color=RIGID if rigid else MODES, lw=1.8 if rigid else 0.7, zorder=1)


def _legend9(figure):
    from matplotlib.lines import Line2D
    from matplotlib.patches import Patch

    handles = [
        Line2D([], [], color=STABLE, marker="o", lw=1.8, label="stable"),
        Line2D([], [], color=UNSTABLE, marker="X", lw=1.8, ls=(0, (3, 1)), label="unstable"),
        Line2D([], [], color=UNSTABLE, lw=4, label="unstable mode (in b)"),
        Line2D([], [], color=MODES, lw=0.8, label="$\\bar k = n/3$"),
        Line2D([], [], color=RIGID, lw=1.8, label="rigid motion"),
        Patch(facecolor=UNSTABLE_FILL, label="$(\\bar\\Omega^2)_2 < 0$"),
        Line2D([], [], color="k", lw=1.6, ls="--", label=r"$t = 0$, $\kappa_n r_0 = 1/\nu$"),
    ]
    figure.legend(handles=handles, loc="outside lower center", ncols=7, frameon=False)


# --- the plane (kappa_n r0, k) ------------------------------------------------------------------------------------------


def _region(axes, law, window, top):
    """Shade (26b) < 0, draw b = 0 and c = 0, and t = 0 for the ribbon."""
    from matplotlib.colors import ListedColormap

    ratio, k = np.meshgrid(np.linspace(*window, 900), np.linspace(-0.06, top, 700))
    g, t = law.tangent_moduli(ratio, NU)
    b, c = coefficients(1 - ratio, g, t, k)
    unstable = b * (1 - k**2) / c < 0  # the factor k**2 of (26b) left out: it changes no sign
    axes.pcolormesh(ratio, k, np.where(unstable & (k > 0), 1.0, np.nan), cmap=ListedColormap([UNSTABLE_FILL]), rasterized=True)
    axes.contour(ratio, k, np.where(k > 0, b, np.nan), [0], colors="k", linewidths=1.3)
    if not law.constrained:
        axes.contour(ratio, k, np.where(k > 0, c, np.nan), [0], colors="k", linewidths=1.6, linestyles=":")
        hidden = np.where((c < 0) & ~unstable & (k > 0), 1.0, np.nan)
        axes.contourf(ratio, k, np.nan_to_num(hidden), [0.5, 1.5], colors="none", hatches=["xxxx"])
    for limit in filter(math.isfinite, convex_limits(law, 1, NU)):
        axes.axvline(limit, color="k", lw=1.6, ls="--")
    axes.set(xlim=window)


def _modes(axes, law, m, window, top):
    """Lines k = n/m; thick where the mode is unstable as published."""
    _quantized(axes, m, top)
    ratio = np.linspace(*window, 4000)
    for n in range(1, int(top * m) + 1):
        if n != m:
            g, t = law.tangent_moduli(ratio, NU)
            unstable = squared_frequencies(1 - ratio, g, t, n / m)[1] < 0
            axes.plot(ratio, np.where(unstable, n / m, np.nan), color=UNSTABLE, lw=3.5, solid_capstyle="butt", zorder=2)


def _bars(axes, cases, window, energy=False):
    """A bar for each (law, m): blue where stable as published, orange elsewhere; black where the ``energy`` says so, too."""
    for row, (law, m) in enumerate(cases):
        low, high = np.clip(stability_interval(law, m, NU), *window)
        axes.barh(
            row, window[1] - window[0], left=window[0], height=0.5, color=UNSTABLE_FILL, hatch="...", edgecolor="white", lw=0
        )
        axes.barh(row, high - low, left=low, height=0.5, color=STABLE, lw=0)
        if energy:
            low, high = np.clip(energy_interval(law, m, NU), *window)
            axes.plot([low, high], [row + 0.36] * 2, color="k", lw=2.5, solid_capstyle="butt")
    axes.axvline(1, color="0.2", lw=0.9, ls=":")
    axes.set(ylim=(-0.5, len(cases) - 0.5), xlim=window)


# --- Fig. 10 ----------------------------------------------------------------------------------------------------------


def _draw_fig10(folder: Path) -> str:
    window, top = (-4.0, 7.0), 2.3
    figure = new_figure(14, 8)
    panels = figure.subplots(2, 3, sharex=True, height_ratios=(1.6, 1))
    for column, (law, letter) in enumerate(((RIBBON, "a"), (FLAT_ROD, "b"), (ISOTROPIC_ROD, "c"))):
        region, bars = panels[0, column], panels[1, column]
        _region(region, law, window, top)
        for k in (0, 1):
            region.axhline(k, color=RIGID, lw=1.8)
        region.axvline(1, color="0.2", lw=0.9, ls=":")
        region.set(title=f"({letter}) {law.name}", ylim=(-0.06, top), ylabel=WAVE)
        _bars(bars, [(law, m) for m in COVERINGS], window, energy=not law.constrained)
        bars.set(yticks=range(len(COVERINGS)), yticklabels=COVERINGS, ylabel="covering index $m$", title=f"({letter}')")
        bars.set_xlabel(f"natural over actual curvature {LOAD}")
        for row, m in enumerate(COVERINGS):
            _write_ends(bars, row, stability_interval(law, m, NU), window)
    _legend10(figure)
    return keep(figure, folder, "fig10")


def _write_ends(axes, row, interval, window):
    """The ends of a bar in numbers, just outside it."""
    for end, side in zip(interval, (-1, 1)):
        if window[0] < end < window[1]:
            style = {"ha": "right" if side < 0 else "left", "va": "center", "fontsize": 9}
            box = {"facecolor": "white", "edgecolor": "none", "pad": 1}
            axes.text(end + 0.12 * side, row, in_words(f"{end:.2f}"), bbox=box, **style)


def _legend10(figure):
    from matplotlib.lines import Line2D
    from matplotlib.patches import Patch

    handles = [
        Patch(facecolor=UNSTABLE_FILL, label=r"unstable: $(\bar\Omega^2)_2 < 0$"),
        Patch(facecolor=STABLE, label="stable as published"),
        Line2D([], [], color="k", lw=2.5, label="energy is a minimum (c')"),
        Patch(facecolor="white", edgecolor="k", hatch="xxxx", label=r"$(\bar\Omega^2)_2 > 0$, but energy not a minimum"),
        Line2D([], [], color="k", lw=1.3, label="$b = 0$"),
        Line2D([], [], color="k", lw=1.6, ls=":", label="$c = 0$"),
        Line2D([], [], color="k", lw=1.6, ls="--", label=r"$t = 0$"),
        Line2D([], [], color=RIGID, lw=1.8, label=r"$\bar k = 0, 1$: rigid"),
    ]
    figure.legend(handles=handles, loc="outside lower center", ncols=4, frameon=False)
