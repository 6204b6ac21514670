"""Figs. 11 and 12 of Audoly & Seffen (2015): the branch from the single to the triple loop, and the whole diagram.

Fig. 12b shows where stable planar and stable buckled states exist; the paper guessed, this computes.
"""

from __future__ import annotations

import math
from collections import Counter
from pathlib import Path

import numpy as np

from branches.draw.picture import figure as draw_branch
from branches.graph import closed as diagram
from branches.graph.closed import preview
from branches.graph.picture import figure as draw_diagram
from branches.graph.stored import read
from branches.paper.page import BUCKLED, STABLE, Row, Section, keep, new_figure
from branches.run.display import Display
from branches.run.many import run_many
from branches.run.runner import run_scene
from branches.scene.parse import parse
from branches.store.read import read_branch
from ribbon_model import exact
from ribbon_model.laws import LAWS as LAW_OBJECTS
from ribbon_model.laws import PAPER_LAWS
from ribbon_model.linear import energy_interval
from ribbon_model.linear import index as index_of_circle

NU = 0.3
LAWS = tuple(PAPER_LAWS)
FIG11 = f"{{title: Fig. 11, law: ribbon, nu: {NU}, m: 1, n: 2}}"
FIG12 = (
    f"{{title: Fig. 12a, law: [{', '.join(LAWS)}], nu: {NU}, m: [1, 3, 5, 7], n: [1, 2, 3, 4, 5, 6, 7], "
    "limits: {kappa_n: [-100, 100]}, stability: true, stride: 20}"
)
#: Section 6.3: how many folds the branch (1, 2) has; none for rods. Where the ribbon's is.
FOLDS_PUBLISHED, FOLD_PUBLISHED = {"ribbon": "1"}, {("ribbon", 1, 2): "4.08"}
#: Circles and natural curvatures of Fig. 12b.
COVERINGS, WINDOW = (1, 3, 5, 7), (-8.0, 14.0)


def fig11(folder: Path) -> Section:
    """The branch (1, 2) by collocation, with shapes along it."""
    path = folder / "fig11.h5"
    if run_scene(parse(FIG11, "fig11"), path, Display(silent=True), overwrite=True) == "interrupted":
        raise KeyboardInterrupt
    branch = read_branch(path)
    start, fold, end = branch.events["kappa_n"]
    star = branch.events["kappa_star"]
    rows = [
        Row("leaves the single loop at κₙL/2π =", "2.5", start, "section 6.3"),
        Row("fold at κₙL/2π =", "4.08", fold, f"section 6.3; κ̄* = {star[1]:.6f}"),
        Row("ends on the triple loop at κₙL/2π =", "-0.5", end, f"section 6.3; κ̄* = {star[2]:.6f}"),
    ]
    exact_fold = exact.folds(1, 2, NU)[0].kappa_n
    notes = [
        f"Collocation, {len(branch.points)} points; the fold is {abs(fold - exact_fold):.0e} from that of the exact "
        f"quadrature, {exact_fold:.15f}.",
        "κₙ first increases from 2.5: the pitchfork of the ribbon is supercritical, as section 6.3 says first; its last "
        "sentence on this bifurcation says the opposite (see Fig. 12).",
    ]
    return Section("Fig. 11: from the single to the triple loop", rows, [keep(draw_branch(branch), folder, "fig11")], notes)


def fig12(folder: Path) -> Section:
    """All primary branches of m = 1, 3, 5, 7 for the three laws, by collocation; and the exact preview."""
    graph = computed(folder)
    pictures = [keep(draw_diagram(graph, law, NU), folder, f"fig12_{law.replace(' ', '_')}") for law in LAWS]
    ahead = preview(parse(FIG12, "fig12", ["law=ribbon"]))
    pictures.insert(1, keep(draw_diagram(ahead, "ribbon", NU), folder, "fig12_preview"))
    count = Counter(family[0] for family in diagram.families(graph))
    rows = [Row(f"{law}: different branches", "", count[law], "m = 1, 3, 5, 7, n ≤ 7, |κₙL/2π| ≤ 100") for law in LAWS]
    for m, printed in ((1, "3.33"), (3, "10.")):
        threshold = diagram.course(graph, m, 7, "ribbon", NU)[0]["nodes"][0]["kappa_n"]
        remark = f"m/ν, (27) for n → ∞; n = 7 is at {threshold:.3f}"
        rows.append(Row(f"ribbon: bifurcations of m = {m} accumulate at κₙL/2π =", printed, m / NU, remark))
    for law in LAWS:
        near = diagram.course(graph, 1, 2, law, NU)[0]["nodes"]
        folds = sum(node["kind"] == "fold" for node in near)
        rows.append(Row(f"{law}: folds on (1, 2)", FOLDS_PUBLISHED.get(law, "0"), folds, "section 6.3"))
        rows.append(Row(f"{law}: (1, 2) ends on covering", "3", near[-1]["covering"], f"at κₙL/2π = {near[-1]['kappa_n']:.6f}"))
    worst, table = _fold_rows(graph)
    notes = [
        f"Collocation; largest difference of a fold from the exact quadrature, all {len(table)} of them: {worst:.0e}.",
        "The second picture is the preview drawn from the exact quadrature alone; nothing in the others comes from it.",
        _rises(graph),
        "Circles are drawn thick where their energy is a minimum, branches where their index is 0. For the isotropic rod the "
        "published linear theory has the single loop stable for negative κₙ, too (grey): there every wave along the strip is "
        "stable, but the strip lowers its energy when it turns about its own centreline, inside out. Circles beyond m = 7 are "
        "drawn where a branch arrives at them.",
        "Beside the published figure: its branches are disentangled by hand, ours by a search for heights with no crossing; it "
        "guesses the stability of branches, here it is computed; it marks folds with orange stars, ours are yellow, as orange "
        "is the colour of n = 4 and 6. Ours has the diagram in conjugate coordinates, too, an inset, and branches that leave "
        "the picture and come back from |κₙL/2π| up to 100.",
    ]
    return Section("Fig. 12: the bifurcation diagram, ν = .3", rows + table, pictures, notes)


def computed(folder: Path):
    """The diagram of all branches, with stability; read if it is in the folder already."""
    run_many(parse(FIG12, "fig12"), folder / "fig12", Display(quiet=True))
    return read(folder / "fig12")


def _rises(graph) -> str:
    """Which kind of pitchfork (1, 2) leaves the single loop by, law by law."""
    kinds = {}
    for law in LAWS:
        (edge,) = [data for _, _, data in graph.edges(data=True) if (data["law"], data["m"], data["n"]) == (law, 1, 2)
                   and math.isclose(data["kappa_star"][0], 1)]  # fmt: skip
        kinds[law] = "supercritical" if edge["kappa_n"][1] > edge["kappa_n"][0] else "subcritical"
    return (
        "κₙ increases on (1, 2) from the single loop where the pitchfork is supercritical, the loop being stable below. Ours: "
        + ", ".join(f"{kind} for the {law}" for law, kind in kinds.items())
        + ". Section 6.3 calls it supercritical for the ribbon at first, and in its last sentence subcritical for the ribbon "
        "and supercritical for rods."
    )


def _fold_rows(graph) -> tuple[float, list[Row]]:
    """The largest difference of a fold from the quadrature, and a row for each fold."""
    rows, worst = [], 0.0
    for law, nu, m, n in diagram.families(graph):
        found = [node for node in diagram.course(graph, m, n, law, nu)[0]["nodes"] if node["kind"] == "fold"]
        known = exact.folds(m, n, nu, law=law)
        if len(found) != len(known):
            raise ArithmeticError(f"{law} ({m}, {n}): {len(found)} folds by collocation, {len(known)} by quadrature")
        for node, point in zip(found, known):
            worst = max(worst, abs(node["kappa_n"] - point.kappa_n))
            published = FOLD_PUBLISHED.get((law, m, n), "")
            remark = f"κ̄* = {node['kappa_star']:.6f}; quadrature {node['kappa_n'] - point.kappa_n:+.0e}"
            rows.append(Row(f"{law}: fold of ({m}, {n}) at κₙL/2π =", published, f"{node['kappa_n']:.10f}", remark))
    return worst, rows


def fig12b(folder: Path) -> Section:
    """Intervals of kappa_n with stable states, for the three laws."""
    graph = computed(folder)
    found = {law: _stable_pieces(graph, law) for law in LAWS}
    rows = []
    for law in LAWS:
        for m in COVERINGS:
            low, high = (m * end for end in energy_interval(LAW_OBJECTS[law], m, NU))
            rows.append(Row(f"{law}: {m}-covered circle stable for κₙL/2π in", "", _interval(low, high)))
        pieces, guesses = found[law], _guesses(graph, law)
        for branch in sorted(set(pieces) | set(guesses)):
            guess, ours = guesses.get(branch, []), pieces.get(branch, [])
            same = len(guess) == len(ours) and np.allclose(guess, ours, atol=1e-6)
            remark = "agrees" if same else "the generic scenario of section 6.3 does not hold here"
            words = [", ".join(_interval(*piece) for piece in pieces) or "none" for pieces in (guess, ours)]
            rows.append(Row(f"{law}: branch {branch} stable for κₙL/2π in", words[0], words[1], remark))
    notes = [
        "The index (negative directions of the energy on closed perturbations) is computed at every point of every branch; it "
        "is 0 on the pieces shown and nowhere else. Their ends are folds, circles, and secondary bifurcations, each located.",
        "'Published' is the paper's rule applied to these branches: stable past a supercritical pitchfork of a stable circle, "
        "up to the first fold; unstable past a subcritical one. The paper draws the result for the ribbon only.",
        "No contact, no friction: a multi-covered circle lies in itself.",
    ]
    return Section("Fig. 12b: where stable states exist, ν = .3", rows, [_draw(found, folder)], notes)


def _interval(low, high) -> str:
    return f"({'−∞' if low == -math.inf else f'{low:.4f}'}, {'∞' if high == math.inf else f'{high:.4f}'})"


def _guesses(graph, law) -> dict[tuple[int, int], list[tuple[float, float]]]:
    """The branches that the paper's rule has stable: from where a circle loses stability to the first fold or the other end."""
    result = {}
    for family in diagram.families(graph):
        if family[0] != law:
            continue
        _, nu, m, n = family[:4]
        (branch,) = diagram.course(graph, m, n, law, nu)
        nodes = branch["nodes"]
        for path in (nodes, nodes[::-1]):
            start, following = path[0], path[1]
            if start["kind"] != "circle" or start["covering"] < 1:
                continue
            side = math.copysign(1e-6, following["kappa_n"] - start["kappa_n"])
            m_here = start["covering"]
            beyond, before = (index_of_circle(LAW_OBJECTS[law], m_here, start["kappa_n"] + s, nu) for s in (side, -side))
            if before == 0 and beyond > 0:
                result[m, n] = [tuple(sorted((start["kappa_n"], following["kappa_n"])))]
    return result


def _stable_pieces(graph, law) -> dict[tuple[int, int], list[tuple[float, float]]]:
    """The pieces between special points on which the index is 0, of branches that have any."""
    result: dict[tuple[int, int], list[tuple[float, float]]] = {}
    for _, _, data in graph.edges(data=True):
        if data["law"] == law and data["index"] == 0:
            piece = data["kappa_n"][0], data["kappa_n"][-1]
            result.setdefault((data["m"], data["n"]), []).append((min(piece), max(piece)))
    return {branch: sorted(pieces) for branch, pieces in result.items()}


def _draw(found, folder: Path) -> str:
    """A bar for each circle, hatched pieces for buckled states above it."""
    from matplotlib.patches import Patch

    figure = new_figure(11, 6)
    panels = figure.subplots(len(LAWS), 1, sharex=True)
    for axes, law in zip(panels, LAWS):
        for row, m in enumerate(COVERINGS):
            low, high = np.clip([m * end for end in energy_interval(LAW_OBJECTS[law], m, NU)], *WINDOW)
            axes.barh(row, high - low, left=low, height=0.36, color=STABLE, lw=0)
        for (m, n), low, high in ((branch, *piece) for branch, pieces in found[law].items() for piece in pieces):
            row = COVERINGS.index(m)
            axes.barh(row + 0.34, high - low, left=low, height=0.24, facecolor=BUCKLED, hatch="////", edgecolor="white", lw=0)
            axes.annotate(f"({m}, {n})", (high, row + 0.34), xytext=(4, 0), textcoords="offset points", va="center", fontsize=9)
        axes.set(yticks=range(len(COVERINGS)), yticklabels=COVERINGS, ylim=(-0.5, len(COVERINGS) - 0.2), xlim=WINDOW)
        axes.set(ylabel="covering index", title=law)
        axes.grid(alpha=0.2, axis="x")
    panels[-1].set_xlabel(r"natural curvature $\kappa_n L/2\pi$")
    handles = [Patch(facecolor=STABLE, label="stable circle"), Patch(facecolor=BUCKLED, hatch="////", edgecolor="white",
               label="stable buckled state of the branch (m, n)")]  # fmt: skip
    figure.legend(handles=handles, loc="outside lower center", ncols=2, frameon=False)
    return keep(figure, folder, "fig12b")
