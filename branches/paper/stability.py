"""Fig. 12b of Audoly & Seffen (2015): where stable planar and stable buckled states exist; the paper guessed, this computes."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np

from branches.graph import closed as diagram
from branches.paper.diagram import LAWS, NU, computed
from branches.paper.draw import BUCKLED, STABLE, keep
from branches.paper.page import Row, Section
from ribbon_model.laws import LAWS as LAW_OBJECTS
from ribbon_model.linear import energy_interval
from ribbon_model.linear import index as index_of_circle

COVERINGS = (1, 3, 5, 7)
WINDOW = (-8.0, 14.0)


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
            remark = "agrees" if _same(guess, ours) else "the generic scenario of section 6.3 does not hold here"
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


def _same(guess, ours) -> bool:
    return len(guess) == len(ours) and np.allclose(guess, ours, atol=1e-6)


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
    from matplotlib.figure import Figure
    from matplotlib.patches import Patch

    figure = Figure(figsize=(11, 6), layout="constrained")
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
