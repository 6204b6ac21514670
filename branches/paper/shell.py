"""Fig. 7 of Audoly & Seffen (2015): the unfolding semicircle by finite elements, beside the one-dimensional laws."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from branches.paper.page import STABLE, UNSTABLE, Row, Section, keep, new_figure
from branches.paper.shell_run import DEFAULT, Outcome, ShellError, compute, describe, read
from branches.store.command import write_output
from contin.lowlevel import Colour
from ribbon_model.laws import FINITE_WIDTH, FLAT_ROD, RIBBON
from ribbon_model.unfolding import FLAT, first_root

#: Where the results are kept, in the folder of the page.
FILE = "shell.h5"
COLOURS = {0.1: UNSTABLE, 0.2: Colour.GREEN, 0.3: STABLE}
MARKERS = {4.0: "o", 8.0: "s", 16.0: "^"}
NUS = (0.1, 0.3)
#: The least w**2/(R h) drawn; below it the law is a flat rod.
_NARROWEST = 0.1


def fig7(folder: Path) -> Section:
    """First instabilities at the paper's dimensions and from rod to ribbon; what ``shell.h5`` holds is not computed again."""
    notes, path = [], folder / FILE
    try:
        compute(DEFAULT, path, lambda outcome, left: write_output(f"  {describe(outcome)}, {left} to go\n"))
    except ShellError as error:
        notes.append(f"No finite elements were computed: {error}.")
    outcomes = read(path)
    direct, thermal = ([o for o in outcomes if o.case.way == way] for way in ("direct", "thermal"))
    rows = []
    for law, limit in ((RIBBON, "wide"), (FLAT_ROD, "narrow")):
        rows += [
            Row(f"{law.name}, ν = {nu:g}: first root ξ", "", first_root(law, nu), f"limit of {limit} strips") for nu in NUS
        ]
    rows += [_direct(outcome) for outcome in sorted(direct, key=_order)]
    rows += [_thermal(outcome) for outcome in sorted(thermal, key=_order)]
    figure = new_figure(12.5, 5.4)
    left, right = figure.subplots(1, 2, width_ratios=(1.5, 1))
    _draw_laws(left)
    _draw_roots(left, outcomes)
    _draw_paper(right, direct)
    pictures = [keep(figure, folder, "fig7")]
    return Section("Fig. 7: the unfolding semicircle by finite elements", rows, pictures, notes + _notes(outcomes))


def law_root(nu: float, number: float, largest: float = 1 - FLAT) -> float | None:
    """The first root of the law 'finite width'; beyond the flat state only if ``largest`` is."""
    return first_root(FINITE_WIDTH, {"nu": nu, "Gamma": number}, largest=largest)


def _order(outcome: Outcome):
    case = outcome.case
    return case.last > 1, case.nu, case.slenderness, case.number, case.along * case.across


def _direct(outcome: Outcome) -> Row:
    case = outcome.case
    law = law_root(case.nu, case.number, 6.0)
    what = f"w/h = {case.thinness:g}, R/w = {case.slenderness:g}, ν = {case.nu:g}: first instability up to ξ = {case.last:g}"
    published = "near 1 − ν (plotted)" if case.last < 1 else ""
    predicted = f"finite width, w²/(Rh) = {case.number:g}: {'none' if law is None else f'{law:.4f}'}"
    return Row(what, published, _found(outcome), predicted)


def _thermal(outcome: Outcome) -> Row:
    case = outcome.case
    law = law_root(case.nu, case.number)
    strip = f"w²/(Rh) = {case.number:g}, R/w = {case.slenderness:g}, ν = {case.nu:g}"
    predicted = "none" if law is None else f"{law:.4f}"
    if law and outcome.root:
        predicted += f", difference {100 * (outcome.root / law - 1):+.2f} %"
    return Row(f"{strip}, {case.along} × {case.across}", "", _found(outcome), f"finite width: {predicted}")


def _found(outcome: Outcome) -> str:
    if outcome.problem:
        return f"failed: {outcome.problem}"
    return "none" if outcome.root is None else f"{outcome.root:.4f}"


# --- remarks ----------------------------------------------------------------------------------------------------------


def _notes(outcomes: list[Outcome]) -> list[str]:
    notes = [
        "The paper plots its finite elements without digits; its text says that they agree with the ribbon, and that "
        "R = 100 mm, w = 5 mm, w/h = 5, 20 and 50. That is w²/(Rh) = .25, 1 and 2.5: by the law of finite width nearly a flat "
        "rod, without an instability before ξ = 1."
    ]
    paper = [o for o in outcomes if o.case.way == "direct" and not o.problem and o.case.last < 1]
    if paper and all(outcome.root is None for outcome in paper):
        least = min(value for outcome in paper for _, value in outcome.samples)
        notes.append(
            f"We and the paper disagree. At the dimensions it states, all {len(paper)} strips computed here stay stable up to "
            f"ξ = {paper[0].case.last:g}: ω² of the lowest out-of-plane vibration is never below {least:.0f} D/(ρhR⁴). "
            "Here: CalculiX, solid elements, rigid ends that turn and approach; there: ABAQUS, S4R5 shells. We know of no "
            "reason in the mechanics; at R/w = 20 a strip with w/h above 1000 would lose stability."
        )
    wide = [o for o in outcomes if o.case.way == "thermal" and o.root and law_root(o.case.nu, o.case.number)]
    for slenderness in sorted({o.case.slenderness for o in wide}):
        own = [o for o in wide if o.case.slenderness == slenderness]
        differences = [100 * (o.root / law_root(o.case.nu, o.case.number) - 1) for o in own]
        notes.append(
            f"R/w = {slenderness:g}: ξ by finite elements less that of the law of finite width, {min(differences):+.2f} % to "
            f"{max(differences):+.2f} % ({len(own)} roots). The law is the first term in w/R."
        )
    return notes + _convergence(wide) + _means(outcomes)


def _convergence(wide: list[Outcome]) -> list[str]:
    """Strips that were computed on several meshes."""
    groups: dict[tuple, list[Outcome]] = {}
    for outcome in wide:
        groups.setdefault((outcome.case.nu, outcome.case.slenderness, outcome.case.number), []).append(outcome)
    lines = []
    for (nu, slenderness, number), group in groups.items():
        if len(group) > 1:
            roots = ", ".join(f"{o.root:.4f} ({o.case.along} × {o.case.across})" for o in sorted(group, key=_order))
            lines.append(f"Mesh, w²/(Rh) = {number:g}, R/w = {slenderness:g}, ν = {nu:g}: ξ = {roots}.")
    return lines


def _means(outcomes: list[Outcome]) -> list[str]:
    if not outcomes:
        return []
    versions = ", ".join(sorted({outcome.version for outcome in outcomes}))
    return [
        f"CalculiX {versions}, C3D20R bricks, one through the thickness; ω², with its sign, of the lowest out-of-plane "
        "vibration about the planar state; roots by false position to ±.0005. The paper's strips are unbent step by step; the "
        "others are meshed as they are and get their natural curvature by expansion, linear through the thickness. The "
        "search begins at ξ = .3.",
        "Finer meshes and more strips: python -m branches.shell --full --out DIR/shell.h5, then this item again.",
    ]


# --- the picture ------------------------------------------------------------------------------------------------------


def _draw_laws(axes):
    """First roots by the law of finite width, each curve to its ribbon; dotted where t vanishes for the ribbon."""
    for nu in NUS:
        least = _narrowest_unstable(nu)
        numbers = least * (1000 / least) ** (np.linspace(0, 1, 80) ** 3)  # the curve is steep where it begins
        roots = [law_root(nu, number) for number in numbers]
        axes.plot(numbers, roots, color=COLOURS[nu], lw=1.8, label=f"finite width, ν = {nu:g}")
        axes.axhline(first_root(RIBBON, nu), color=COLOURS[nu], lw=1, ls="--", label=f"ribbon, ν = {nu:g}")
    axes.axhline(1, color="0.35", lw=1, ls=":")
    axes.text(_NARROWEST * 1.15, 1.004, "flat: rods are stable up to here and beyond", color="0.25", fontsize=9)
    axes.set(xscale="log", xlim=(_NARROWEST, 1000), ylim=(0.66, 1.03))
    axes.set(xlabel=r"$w^2/(Rh)$", ylabel=r"first instability $\xi$", title="from rod to ribbon")


def _narrowest_unstable(nu: float) -> float:
    """The least w**2/(R h) with an instability before the flat state."""
    low, high = 1.0, 1000.0
    while high > 1.002 * low:
        middle = (low * high) ** 0.5
        low, high = (middle, high) if law_root(nu, middle) is None else (low, middle)
    return high


def _draw_roots(axes, outcomes):
    """Roots as symbols, of the coarsest mesh where there are several; arrows where there is none."""
    coarsest = {}
    for outcome in sorted(outcomes, key=_order, reverse=True):
        case = outcome.case
        if not outcome.problem and case.last < 1:
            coarsest[case.way, case.nu, case.slenderness, case.number] = outcome
    for (way, nu, slenderness, number), outcome in coarsest.items():
        colour = COLOURS.get(nu, "k")
        if outcome.root:
            axes.plot(number, outcome.root, MARKERS.get(slenderness, "D"), ms=7, mew=1.6, mfc="none", color=colour, zorder=3)
        else:  # the two values of nu side by side
            x = number * (1 if way == "thermal" else 1.06 if nu == 0.1 else 0.94)
            arrow = {"arrowstyle": "->", "color": colour, "lw": 1.6}
            axes.annotate("", (x, outcome.case.last + 0.035), (x, outcome.case.last - 0.004), arrowprops=arrow)
            axes.plot(x, outcome.case.last, "_", color=colour, ms=8, mew=1.6)
    for nu in NUS:
        axes.plot((0.25, 1.0, 2.5), [first_root(RIBBON, nu)] * 3, "P", ms=7, color="0.75", mec="0.35", zorder=2)
    _legend(axes, coarsest)


def _legend(axes, drawn):
    from matplotlib.lines import Line2D

    handles, _ = axes.get_legend_handles_labels()
    for slenderness in sorted({key[2] for key, outcome in drawn.items() if outcome.root}):
        label = f"finite elements, R/w = {slenderness:g}"
        handles.append(Line2D([], [], color="k", marker=MARKERS.get(slenderness, "D"), ls="", mfc="none", label=label))
    if any(outcome.root is None for outcome in drawn.values()):
        label = "finite elements: no instability up to here"
        handles.append(Line2D([], [], color="k", marker=r"$\uparrow$", ms=9, ls="", label=label))
    label = "the paper's strips, where its text has them"
    handles.append(Line2D([], [], color="0.75", marker="P", mec="0.35", ls="", label=label))
    axes.legend(handles=handles, loc="lower left", bbox_to_anchor=(0, 0.17), frameon=False, fontsize=9)


def _draw_paper(axes, direct):
    """omega**2 of the paper's own strips, along the longest path that was computed."""
    longest = {(o.case.nu, o.case.thinness): o for o in sorted(direct, key=_order) if o.samples}
    for (nu, thinness), outcome in longest.items():
        xi, value = np.array(outcome.samples).T
        style = {5.0: "-", 20.0: "--", 50.0: ":"}.get(thinness, "-.")
        axes.plot(xi, value, style, marker=".", color=COLOURS.get(nu, "k"), label=f"w/h = {thinness:g}, ν = {nu:g}")
    axes.set(
        xlabel=r"$\xi$", ylabel=r"$\omega^2$ in $D/(\rho h R^4)$", title="the paper's strips: lowest out-of-plane vibration"
    )
    if longest:
        if min(value for outcome in longest.values() for _, value in outcome.samples) > 0:
            axes.set_yscale("log")  # all are stable: nothing is below
        else:
            axes.set_yscale("symlog", linthresh=10)
            axes.axhline(0, color="0.2", lw=0.9)
        axes.legend(frameon=False, fontsize=9, ncols=2)
    else:
        axes.text(0.5, 0.5, "not computed: no CalculiX", transform=axes.transAxes, ha="center")
