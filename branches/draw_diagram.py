"""The bifurcation diagram (Fig. 12a of Audoly & Seffen 2015) as a picture: in (kappa_n, kappa*), and disentangled."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from branches.diagram_graph import families, pieces, secondaries
from branches.labels import END, FOLD, MARKS, SECONDARY
from contin import exact_text

STABLE, UNSTABLE = "#000000", "#9a9a9a"
#: Okabe-Ito colours and a line style for each wavenumber: told apart without colour too.
STYLES = {
    1: ("#CC79A7", (0, (1, 1))), 2: ("#0072B2", "-"), 3: ("#009E73", "-"), 4: ("#D55E00", (0, (6, 1.5))),
    5: ("#56B4E9", (0, (6, 1.5))), 6: ("#E69F00", (0, (4, 1, 1, 1))), 7: ("#882255", (0, (4, 1, 1, 1))),
}  # fmt: skip
_OTHER = ("#444444", ":")
_SECONDARY_STYLE = (SECONDARY, (0, (3, 1)))
#: Shapes of the way of a branch from one circle to the other in the disentangled picture, sigma -> sigma ** power.
_POWERS = (1.0, 1.7, 0.6, 3.0, 0.35)


def colour_of(n: int) -> str:
    """The colour of a wavenumber."""
    return STYLES.get(n, _OTHER)[0]


@dataclass(frozen=True)
class Line:
    """A branch to draw.

    Attributes
    ----------
    n : int
        Wavenumber; 0 for a secondary branch.
    kappa_n, kappa_star : ndarray, shape (K,)
        From end to end.
    stable : ndarray of bool, shape (K,)
        Where the index is known to be 0.
    marks : list
        Its special points (kappa_n, kappa_star, kind).
    returns : bool
        Whether both ends are circles.
    """

    n: int
    kappa_n: np.ndarray
    kappa_star: np.ndarray
    stable: np.ndarray
    marks: list[tuple[float, float, str]]
    returns: bool


def figure(graph, law: str, nu: float, window=(-8.0, 14.0), disentangle: bool = True):
    """The diagram of one law and nu.

    Parameters
    ----------
    graph : networkx.MultiGraph
        As of `branches.diagram_graph`.
    window : (float, float)
        Of kappa_n.
    disentangle : bool
        Add the schematic panel.

    Returns
    -------
    matplotlib.figure.Figure
    """
    from matplotlib.figure import Figure

    result = Figure(figsize=(13 if disentangle else 7.5, 7), layout="constrained")
    panels = result.subplots(1, 2 if disentangle else 1, sharex=True, squeeze=False)[0]
    conjugate(panels[0], graph, law, nu, window)
    panels[0].set(xlabel=r"natural curvature $\kappa_n L/2\pi$", ylabel=r"conjugate curvature $\bar\kappa^*$")
    if disentangle:
        panels[0].set_title("in conjugate coordinates")
        schematic(panels[1], graph, law, nu, window)
        panels[1].set(
            xlabel=r"natural curvature $\kappa_n L/2\pi$", ylabel="covering index of the circles (heights between: free)"
        )
        panels[1].set_title("disentangled")
    result.legend(handles=legend(graph, law, nu), loc="outside lower center", ncols=6 if disentangle else 4, frameon=False)
    result.suptitle(f"Equilibria of a closed strip: {law}, $\\nu$ = {exact_text(nu)}{note(graph)}", fontsize=13)
    return result


def note(graph) -> str:
    """What a title must say of where the diagram comes from; nothing if it is the computed one."""
    source = graph.graph.get("source", "")
    return f" ({source})" if source else ""


def conjugate(axes, graph, law: str, nu: float, window) -> None:
    """Draw the branches in (kappa_n, kappa*)."""
    found = lines(graph, law, nu)
    circles(axes, graph, law, nu, window)
    for line in found:
        _draw(axes, line, line.kappa_star, [height for _, height, _ in line.marks])
    _frame(axes, graph, law, nu, window)


def schematic(axes, graph, law: str, nu: float, window) -> None:
    """Draw the branches with free heights, chosen so that they cross as little as they can."""
    found = lines(graph, law, nu)
    circles(axes, graph, law, nu, window)
    for line, height in zip(found, heights(found, window)):
        at = [height[np.argmin((line.kappa_n - x) ** 2 + (line.kappa_star - y) ** 2)] for x, y, _ in line.marks]
        _draw(axes, line, height, at)
    _frame(axes, graph, law, nu, window)
    axes.set_yticks(_coverings(graph, law, nu))


def _draw(axes, line, height, at):
    colour, dashes = STYLES.get(line.n, _OTHER) if line.n else _SECONDARY_STYLE
    axes.plot(line.kappa_n, height, color=colour, linestyle=dashes, lw=1.3, zorder=2)
    if line.stable.any():
        axes.plot(line.kappa_n, np.where(line.stable, height, np.nan), color=colour, lw=4, zorder=2, solid_capstyle="butt")
    for (x, _, kind), y in zip(line.marks, at):
        if kind in MARKS:
            marker, colour, size = MARKS[kind]
            axes.scatter(x, y, marker=marker, color=colour, s=size, zorder=3, linewidths=0)


def _frame(axes, graph, law, nu, window):
    there = _coverings(graph, law, nu) or [1]
    axes.set(xlim=window, ylim=(there[0] - 0.6, there[-1] + 0.8))
    axes.yaxis.get_major_locator().set_params(integer=True)
    axes.grid(alpha=0.2)


def _coverings(graph, law, nu):
    nodes = (data for _, data in graph.nodes(data=True) if (data["law"], data["nu"]) == (law, nu))
    return sorted({data["covering"] for data in nodes if data["kind"] == "circle"})


def circles(axes, graph, law: str, nu: float, window) -> None:
    """The planar circles: thick where the published linear theory has them stable, thin elsewhere."""
    from ribbon_model.laws import from_label
    from ribbon_model.linear import circle, stability_interval

    material, Gamma = from_label(law)

    def plot(m, ends, **style):
        axes.plot(ends, [circle(material, m, kappa_n, nu, Gamma)["kappa_star"] for kappa_n in ends], zorder=1, **style)

    for m in _coverings(graph, law, nu):
        plot(m, window, color=UNSTABLE, lw=0.8)
        if m < 1:  # curled against its natural curvature: the published intervals do not speak of these
            continue
        low, high = stability_interval(material, m, nu, Gamma)
        ends = [max(window[0], m * low), min(window[1], m * high)]
        plot(m, ends, color=STABLE, lw=2.6, solid_capstyle="butt")


def legend(graph, law: str, nu: float) -> list:
    """Handles for the wavenumbers and the marks that the diagram has."""
    from matplotlib.lines import Line2D

    waves = sorted({family[3] for family in families(graph) if family[:2] == (law, nu)})
    styles = [(n, *STYLES.get(n, _OTHER)) for n in waves]
    handles = [Line2D([], [], color=colour, ls=dashes, label=f"n = {n}") for n, colour, dashes in styles]
    handles += [
        Line2D([], [], color=STABLE, lw=2.5, label="circle, stable"),
        Line2D([], [], color=UNSTABLE, lw=1, label="circle, unstable"),
        Line2D([], [], marker="o", color=END, ls="", ms=5, label="bifurcation of a circle"),
    ]
    if secondaries(graph, law, nu):
        colour, dashes = _SECONDARY_STYLE
        handles.append(Line2D([], [], color=colour, ls=dashes, label="secondary branch"))
    kinds = {data["kind"] for _, data in graph.nodes(data=True) if (data["law"], data["nu"]) == (law, nu)}
    if any(data.get("index") == 0 for _, _, data in graph.edges(data=True) if (data["law"], data["nu"]) == (law, nu)):
        handles.append(Line2D([], [], color="#666666", lw=4, label="buckled, stable (index 0)"))
    if "fold" in kinds:
        handles.append(Line2D([], [], marker="*", color=FOLD, ls="", ms=11, label="fold"))
    if "secondary bifurcation" in kinds:
        handles.append(Line2D([], [], marker="D", color=SECONDARY, ls="", ms=6, label="secondary bifurcation"))
    return handles


# --- from the graph to lines --------------------------------------------------------------------------------------


def lines(graph, law: str, nu: float) -> list[Line]:
    """The branches of one law and nu, smooth from end to end: the primary ones, then the secondary ones."""
    branches = [(family[3], pieces(graph, family)) for family in families(graph) if family[:2] == (law, nu)]
    branches += [(0, branch["edges"]) for branch in secondaries(graph, law, nu)]
    result = []
    for n, edges in branches:
        curves = [smooth(d["arclength"], d["kappa_n"], d["kappa_star"]) for _, _, d in edges]
        names = dict.fromkeys(node for a, b, _ in edges for node in (a, b))
        nodes = [graph.nodes[name] for name in names]
        marks = [(node["kappa_n"], node["kappa_star"], node["kind"]) for node in nodes]
        kappa_n, kappa_star = (np.concatenate([curve[i] for curve in curves]) for i in (0, 1))
        stable = np.concatenate([np.full(len(c[0]), d.get("index") == 0) for c, (_, _, d) in zip(curves, edges)])
        returns = sum(node["kind"] == "circle" for node in nodes) > 1
        result.append(Line(n, kappa_n, kappa_star, stable, marks, returns))
    return result


def smooth(s, *columns) -> list[np.ndarray]:
    """Smooth curves through computed points: cubic splines over the arclength of the continuation, ten steps a point."""
    from scipy.interpolate import CubicSpline

    s, keep = np.unique(s, return_index=True)
    columns = np.array([np.asarray(column)[keep] for column in columns])
    if len(s) < 4:
        return list(columns)
    fine = np.interp(np.arange(0, len(s) - 0.9, 0.1), np.arange(len(s)), s)
    return list(CubicSpline(s, columns, axis=1)(fine))


# --- disentangling ------------------------------------------------------------------------------------------------


def heights(found: list[Line], window) -> list[np.ndarray]:
    """Heights (K,) for each line: from its first circle to its last, monotone, with few crossings; kappa_n is untouched.

    Each line takes one of a few shapes, at first kappa* itself; lines change theirs in turn as long as the number of crossings
    in the window falls.
    """
    shapes = [_shapes(line, window) for line in found]
    polylines = [_thin(line, options, window) for line, options in zip(found, shapes)]
    cost = {}
    for i, ours in enumerate(polylines):
        for j, theirs in enumerate(polylines[:i]):
            cost[i, j] = crossings(ours, theirs)
            cost[j, i] = cost[i, j].T
    chosen = [0] * len(found)
    for _ in range(20):
        before = list(chosen)
        for i in range(len(found)):
            total = [sum(cost[i, j][a, chosen[j]] for j in range(len(found)) if j != i) for a in range(len(shapes[i]))]
            chosen[i] = int(np.argmin(total))
        if chosen == before:
            break
    return [options[i] for options, i in zip(shapes, chosen)]


def _shapes(line, window):
    start, end = line.kappa_star[0], line.kappa_star[-1]
    result = [line.kappa_star]
    for weight in (1.0, 0.2):  # of what is seen, against what is not: a line may climb out of sight
        sigma = _way(line, window, weight)
        if line.returns:
            result += [start + (end - start) * sigma**power for power in _POWERS]
        else:
            result += [start + (np.sign(end - start) or 1.0) * goal * sigma for goal in (0.5, 0.8, 0.25)]
    return result


def _way(line, window, weight):
    """The part of the way that lies behind, 0 ... 1, at the points of a line."""
    margin = 0.02 * (window[1] - window[0])
    low, high = window[0] - margin, window[1] + margin
    seen = np.hypot(np.diff(np.clip(line.kappa_n, low, high)) / (high - low), np.diff(line.kappa_star) / 8)
    outside = (line.kappa_n < low) | (line.kappa_n > high)
    way = np.append(0, np.cumsum(seen * np.where(outside[:-1] & outside[1:], 1.0, weight)))
    return way / way[-1]


def _thin(line, options, window):
    """The shapes (A, K) of a line at few points, those inside the window (where crossings matter): (A, K, 2)."""
    inside = (line.kappa_n > window[0]) & (line.kappa_n < window[1])
    kept = np.flatnonzero(inside | np.roll(inside, 1) | np.roll(inside, -1))
    kept = kept[np.unique(np.linspace(0, len(kept) - 1, 40).astype(int))] if len(kept) else kept
    x = np.clip(line.kappa_n[kept], window[0] - 1, window[1] + 1)
    return np.array([np.column_stack([x, shape[kept]]) for shape in options])


def crossings(first, second):
    """How often each of the polylines first (A, K, 2) crosses each of the polylines second (B, J, 2): (A, B)."""
    p, r = first[:, None, :-1, None], np.diff(first, axis=1)[:, None, :, None]
    q, s = second[None, :, None, :-1], np.diff(second, axis=1)[None, :, None, :]

    def cross(u, v):
        return u[..., 0] * v[..., 1] - u[..., 1] * v[..., 0]

    with np.errstate(divide="ignore", invalid="ignore"):
        gap, across = q - p, cross(r, s)
        t, u = cross(gap, s) / across, cross(gap, r) / across
    return np.sum((t > 0) & (t < 1) & (u > 0) & (u < 1), axis=(2, 3))
