"""The bifurcation diagram (Fig. 12a of Audoly & Seffen 2015) as a picture: in (kappa_n, kappa*), and disentangled."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import groupby

import numpy as np

from branches.draw.style import CONJUGATE, LINES, NATURAL, OTHER, colour_of, in_words, smooth
from branches.graph import disentangle as layered
from branches.graph.closed import families, pieces, secondaries
from branches.scene.labels import END, FOLD, MARKS, SECONDARY

STABLE, UNSTABLE = "#000000", "#8a8a8a"
#: Colour of secondary branches, which have no wavenumber.
_NO_WAVE = "#000000"
#: Largest step in kappa_n of what is drawn, far less than the diagrams' 22; and into how many parts a step is cut at most.
_STEP, _MOST_PARTS = 0.05, 200
#: Marks closer than this to a branch, in (kappa_n, kappa*), are on it: branches are drawn by splines through their points.
_SAME_PLACE = 1e-3
#: Widths of branches in a diagram, by the same.
_WIDTHS = {True: 3.4, False: 1.4, None: 1.4}


@dataclass(frozen=True)
class Mark:
    """A special point of a branch: where it is in (kappa_n, kappa*), its kind, and the covering index if it is a circle."""

    kappa_n: float
    kappa_star: float
    kind: str
    covering: int | None


@dataclass(frozen=True)
class Line:
    """A branch to draw; one between two circles begins at that of the lower covering index.

    Attributes
    ----------
    n : int
        Wavenumber; 0 for a secondary branch.
    kappa_n, kappa_star : ndarray, shape (K,)
        From end to end.
    index : ndarray of int, shape (K,)
        -1 where it is not known.
    marks : list of Mark
        Its special points, from end to end.
    """

    n: int
    kappa_n: np.ndarray
    kappa_star: np.ndarray
    index: np.ndarray
    marks: list[Mark]

    def place(self, mark: Mark) -> int:
        """The number of the point that is nearest to a mark."""
        return int(np.argmin((self.kappa_n - mark.kappa_n) ** 2 + (self.kappa_star - mark.kappa_star) ** 2))

    def parts(self):
        """Where it is stable, unstable and unknown: True, False or None, and the points, which neighbours share an end of."""
        known = [None if index < 0 else index == 0 for index in self.index.tolist()]
        first = 0
        for stable, run in groupby(known):
            last = first + len(list(run))
            yield stable, slice(first, last + 1)
            first = last


def figure(graph, law: str, nu: float, window=(-8.0, 14.0), disentangle: bool = True):
    """The diagram of one law and nu.

    Parameters
    ----------
    graph : networkx.MultiGraph
        As of `branches.diagram_graph`.
    window : (float, float)
        Of kappa_n.
    disentangle : bool
        Add the panel where the heights between the circles are free (`branches.disentangle`).

    Returns
    -------
    matplotlib.figure.Figure
    """
    from matplotlib.figure import Figure

    result = Figure(figsize=(13 if disentangle else 7.5, 7), layout="constrained")
    panels = result.subplots(1, 2 if disentangle else 1, sharex=True, squeeze=False)[0]
    conjugate(panels[0], graph, law, nu, window)
    panels[0].set_ylabel(CONJUGATE, fontsize=13)
    if disentangle:
        panels[0].set_title("in conjugate coordinates", fontsize=13)
        schematic(panels[1], graph, law, nu, window)
        panels[1].set_ylabel("covering index of the circles (heights between: free)", fontsize=13)
        panels[1].set_title("disentangled", fontsize=13)
    for axes in panels:
        axes.set_xlabel(NATURAL, fontsize=13)
        axes.tick_params(labelsize=12)
    handles, columns = legend(graph, law, nu), 3
    if disentangle:
        columns = 4 if secondaries(graph, law, nu) else 6  # their words are longer
    result.legend(handles=handles, loc="outside lower center", ncols=columns, frameon=False, fontsize=12)
    result.suptitle(f"Equilibria of a closed strip: {law}, $\\nu$ = {in_words(nu)}{note(graph)}", fontsize=15)
    return result


def note(graph) -> str:
    """What a title must say of where the diagram comes from; nothing if it is the computed one."""
    source = graph.graph.get("source", "")
    return f" ({source})" if source else ""


def conjugate(axes, graph, law: str, nu: float, window) -> None:
    """Draw the branches in (kappa_n, kappa*)."""
    circles(axes, graph, law, nu, window)
    for line in lines(graph, law, nu):
        _draw(axes, line, line.kappa_star)
    _frame(axes, graph, law, nu, window)


def schematic(axes, graph, law: str, nu: float, window) -> None:
    """Draw the branches with free heights, chosen so that few cross, and the circles at their covering indices."""
    circles(axes, graph, law, nu, window, level=True)
    found = lines(graph, law, nu)
    for line, height in zip(found, heights(found, window)):
        _draw(axes, line, height)
    _frame(axes, graph, law, nu, window)
    axes.set_yticks(_coverings(graph, law, nu))


def heights(found: list[Line], window) -> list[np.ndarray]:
    """Heights of all lines in the disentangled picture, of shape (K,) each.

    A secondary branch goes straight from the height of the point where it leaves to that of the one where it arrives.
    """
    primary = [line for line in found if line.n]
    ends = []
    for line in primary:
        rises = 1 if line.kappa_star[-1] >= line.kappa_star[0] else -1
        ends.append((line.marks[0].covering, line.marks[-1].covering, rises))
    result = layered.heights([line.kappa_n for line in primary], ends, window)
    for line in found[len(primary) :]:
        a, b = (_height_at(mark, zip(primary, result)) for mark in (line.marks[0], line.marks[-1]))
        climbed = line.kappa_star - line.kappa_star[0]
        if b is not None:
            climbed = climbed + (b - a - climbed[-1]) * np.linspace(0, 1, len(climbed))
        result.append(a + climbed)
    return result


def _height_at(mark: Mark, placed) -> float | None:
    """The height of a mark on one of the lines that have theirs; that of a mark that no line has is kappa*, or free."""
    for line, height in placed:
        number = line.place(mark)
        if np.hypot(line.kappa_n[number] - mark.kappa_n, line.kappa_star[number] - mark.kappa_star) < _SAME_PLACE:
            return float(height[number])
    return None if mark.kind == "leaves" else mark.kappa_star


def _draw(axes, line: Line, height) -> None:
    colour = colour_of(line.n) if line.n else _NO_WAVE
    for stable, part in line.parts():
        style = {"ls": LINES[stable][0], "lw": _WIDTHS[stable], "solid_capstyle": "butt"}
        axes.plot(line.kappa_n[part], height[part], color=colour, zorder=2, **style)
    for mark in line.marks:
        if mark.kind in MARKS:
            marker, colour, size = MARKS[mark.kind]
            axes.scatter(mark.kappa_n, height[line.place(mark)], marker=marker, color=colour, s=size, zorder=3, linewidths=0)


def _frame(axes, graph, law, nu, window):
    there = _coverings(graph, law, nu) or [1]
    axes.set(xlim=window, ylim=(there[0] - 0.6, there[-1] + 0.8))
    axes.yaxis.get_major_locator().set_params(integer=True)
    axes.grid(alpha=0.2)


def _coverings(graph, law, nu):
    nodes = (data for _, data in graph.nodes(data=True) if (data["law"], data["nu"]) == (law, nu))
    return sorted({data["covering"] for data in nodes if data["kind"] == "circle"})


def circles(axes, graph, law: str, nu: float, window, level: bool = False) -> None:
    """The planar circles, solid where the published linear theory has them stable, dashed elsewhere; all level if asked for."""
    from branches.scene.closed import law_of
    from ribbon_model.linear import circle, stability_interval

    material, parameters = law_of(law, nu)

    def plot(m, ends, **style):
        height = [m if level else circle(material, m, kappa_n, parameters)["kappa_star"] for kappa_n in ends]
        axes.plot(ends, height, zorder=1, **style)

    for m in _coverings(graph, law, nu):
        plot(m, window, color=UNSTABLE, lw=0.9, ls=LINES[False][0])
        if m < 1:  # curled against its natural curvature: the published intervals do not speak of these
            continue
        low, high = stability_interval(material, m, parameters)
        ends = [max(window[0], m * low), min(window[1], m * high)]
        plot(m, ends, color=STABLE, lw=2.6, solid_capstyle="butt")


def legend(graph, law: str, nu: float) -> list:
    """Handles for the wavenumbers, the stability and the marks that the diagram has."""
    from matplotlib.lines import Line2D

    waves = sorted({family[3] for family in families(graph) if family[:2] == (law, nu)})
    handles = [Line2D([], [], color=colour_of(n), lw=2, label=f"n = {n}") for n in waves]
    handles += [
        Line2D([], [], color=STABLE, lw=2.6, label="circle, stable"),
        Line2D([], [], color=UNSTABLE, lw=0.9, ls=LINES[False][0], label="circle, unstable"),
    ]
    found = lines(graph, law, nu)
    known = {stable for line in found for stable, _ in line.parts()}
    words = {True: "branch, stable", False: "branch, unstable", None: "branch, stability not computed"}
    handles += [
        Line2D([], [], color=OTHER, ls=LINES[stable][0], lw=_WIDTHS[stable], label=text)
        for stable, text in words.items()
        if stable in known
    ]
    if any(not line.n for line in found):
        handles.append(Line2D([], [], color=_NO_WAVE, lw=2, label="secondary branch"))
    kinds = {mark.kind for line in found for mark in line.marks}
    marks = (("circle", "o", END, 5, "bifurcation of a circle"), ("fold", "*", FOLD, 11, "fold"),
             ("secondary bifurcation", "D", SECONDARY, 6, "secondary bifurcation"))  # fmt: skip
    handles += [Line2D([], [], marker=m, color=c, ls="", ms=size, label=text) for k, m, c, size, text in marks if k in kinds]
    return handles


# --- from the graph to lines --------------------------------------------------------------------------------------


def lines(graph, law: str, nu: float) -> list[Line]:
    """The branches of one law and nu, smooth from end to end: the primary ones by wavenumber, then the secondary ones."""
    primary = [_line(graph, family[3], pieces(graph, family)) for family in families(graph) if family[:2] == (law, nu)]
    secondary = [_line(graph, 0, branch["edges"]) for branch in secondaries(graph, law, nu)]
    return sorted(primary, key=lambda line: (line.n, line.marks[0].covering, line.marks[0].kappa_n)) + secondary


def _line(graph, n: int, edges) -> Line:
    """The branch that these edges make up, end to end."""
    s, *columns = (np.concatenate([data[name] for _, _, data in edges]) for name in ("arclength", "kappa_n", "kappa_star"))
    s, kappa_n, kappa_star = smooth(s, s, *columns)
    piece = np.searchsorted([data["arclength"][-1] for _, _, data in edges[:-1]], s)
    index = np.array([data.get("index", -1) for _, _, data in edges])[piece]
    kappa_n, kappa_star, index = _refined(kappa_n, kappa_star, index)
    nodes = (graph.nodes[name] for name in dict.fromkeys(node for a, b, _ in edges for node in (a, b)))
    marks = [Mark(node["kappa_n"], node["kappa_star"], node["kind"], node.get("covering")) for node in nodes]
    line = Line(n, kappa_n, kappa_star, index, marks)
    line.marks.sort(key=line.place)
    first, last = line.marks[0].covering, line.marks[-1].covering
    if first is None or (last is not None and last < first):
        return Line(n, kappa_n[::-1], kappa_star[::-1], index[::-1], marks[::-1])
    return line


def _refined(kappa_n, kappa_star, index) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """The same polyline with more points: steps in kappa_n are at most `_STEP`, so that heights can change between them."""
    parts = np.clip(np.ceil(np.abs(np.diff(kappa_n)) / _STEP), 1, _MOST_PARTS).astype(int)
    number = np.arange(len(kappa_n))
    within = np.arange(parts.sum()) - np.repeat(np.cumsum(parts) - parts, parts)
    fine = np.append(np.repeat(number[:-1], parts) + within / np.repeat(parts, parts), number[-1])
    fine = np.repeat(fine, 2) if len(fine) == 1 else fine  # a branch that ends where it begins
    return np.interp(fine, number, kappa_n), np.interp(fine, number, kappa_star), index[np.ceil(fine).astype(int)]
