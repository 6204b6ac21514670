"""A branch as a picture: kappa* against kappa_n with folds and ends, and the strip along the branch (Fig. 11)."""

from __future__ import annotations

from itertools import pairwise

import numpy as np

from branches.diagram_graph import common_index
from branches.draw_diagram import colour_of, smooth
from branches.labels import SPECIAL, kind_of, label_of
from contin import exact_text
from ribbon_model.laws import label as name_law

SHAPE, BACK = "#E8A33D", "#7A5195"
#: Dashes and legend of pieces, by whether they are stable; None: not known.
_LINES = {True: ("-", "stable"), False: ((0, (4, 2)), "unstable"), None: ("-", None)}
#: Kinds of `branches.labels` that the legend says in other words.
_WORDS = {"leaves": "limit of the scene", "circle": "bifurcation of a circle"}


def figure(branch, shapes: int = 6, width: float = 0.3):
    """The figure of a branch.

    Parameters
    ----------
    branch : branches.read.StoredBranch
    shapes : int
        Number of strips, at equal distances along the branch; labelled points are among them where they fit.
    width : float
        Width of the drawn strip, in units of L / 2 pi.
    """
    from matplotlib.figure import Figure

    chosen = choose(branch, shapes)
    columns = max(len(chosen), 1)
    result = Figure(figsize=(9, 6.2 if chosen else 4.2), layout="constrained")
    grid = result.add_gridspec(2 if chosen else 1, columns, height_ratios=[1, 2.2] if chosen else [1])
    for column, point in enumerate(chosen):
        axes = result.add_subplot(grid[0, column], projection="3d")
        draw_strip(axes, branch.shape(point), width)
        axes.set_title(chr(ord("a") + column), fontsize=10, y=0.98)
    curve(result.add_subplot(grid[-1, :]), branch, chosen)
    return result


def choose(branch, count: int) -> list[int]:
    """Numbers of the points whose strip is drawn: nearest to equal distances along the branch, labelled ones preferred."""
    kept = branch.kept()
    if not count or not len(kept):
        return []
    s = branch.points["arclength"][kept]
    labelled = branch.points["label"][kept] != b""
    spacing = (s[-1] - s[0]) / max(count - 1, 1) or 1.0
    chosen = []
    for target in np.linspace(s[0], s[-1], count):
        distance = np.abs(s - target) - 0.45 * spacing * labelled
        best = int(kept[np.argmin(distance)])
        if best not in chosen:
            chosen.append(best)
    return sorted(chosen)


def curve(axes, branch, chosen) -> None:
    """kappa* against kappa_n, with marks at labelled points and letters at the strips drawn."""
    points, config = branch.points, branch.config
    seen = {None, "branch point"}
    for stable, kappa_n, kappa_star in lines(branch):
        dashes, name = _LINES[stable]
        axes.plot(kappa_n, kappa_star, color=colour_of(config["n"]), ls=dashes, lw=1.6, zorder=1, label=_once(name, seen))
    for event in branch.events:
        mark, name = label_of(event["label"].decode()), event["name"].decode()
        kind = kind_of(event["label"].decode(), name, branch.reason, bool(config["origin"]))
        label = _once(_WORDS.get(kind, kind), seen)
        place = event["kappa_n"], event["kappa_star"]
        fill = "white" if kind == "leaves" else mark.colour  # open: the branch goes on there
        colours = {"color": mark.colour} if mark.marker == "x" else {"facecolor": fill, "edgecolor": mark.colour}
        axes.scatter(*place, marker=mark.marker, s=mark.size, zorder=3, label=label, **colours)
        if event["label"] == b"LP":
            axes.annotate(f"{event['kappa_n']:.4f}", place, (9, -3), textcoords="offset points", fontsize=9)
    axes.set_xlabel(r"natural curvature $\kappa_n L/2\pi$")
    axes.set_ylabel(r"conjugate curvature $\bar\kappa^*$")
    material = name_law(config["law"], config["Gamma"])
    axes.set_title(f"{material}, (m, n) = ({config['m']}, {config['n']}), $\\nu$ = {exact_text(config['nu'])}", fontsize=11)
    axes.grid(alpha=0.25)
    axes.margins(0.1)
    axes.legend(frameon=False)
    letters(axes, points, chosen, colour_of(config["n"]))


def _once(name, seen: set):
    """A name for the legend, or None if it has that already."""
    label = None if name in seen else name
    seen.add(name)
    return label


def lines(branch) -> list[tuple]:
    """The pieces of a branch between special points, smooth: (stable, kappa_n, kappa_star); stable is None if not known.

    A branch without the index is one piece.
    """
    points = branch.points
    s, kappa_n, kappa_star = smooth(points["arclength"], points["arclength"], points["kappa_n"], points["kappa_star"])
    if "index" not in points.dtype.names:
        return [(None, kappa_n, kappa_star)]
    special = [int(event["point"]) for event in branch.events if event["label"].decode() in SPECIAL]
    ends = sorted({0, *special, len(points) - 1})
    found = []
    for first, last in pairwise(ends):
        index = common_index(points["index"][first : last + 1])
        low, high = points["arclength"][[first, last]]
        here = (s >= low) & (s <= high)
        found.append((None if index < 0 else index == 0, kappa_n[here], kappa_star[here]))
    return found


def letters(axes, points, chosen, colour) -> None:
    """Letters of the strips drawn, to the right of the curve as it goes; at a fold, which has a number there, to its left."""
    axes.autoscale_view()
    place = axes.transData.transform(np.column_stack([points["kappa_n"], points["kappa_star"]]))
    for column, number in enumerate(chosen):
        label, here = points["label"][number], (points["kappa_n"][number], points["kappa_star"][number])
        if label == b"":
            axes.scatter(*here, s=14, color=colour, zorder=2)
        way = place[min(number + 1, len(place) - 1)] - place[max(number - 1, 0)]
        right = np.array([way[1], -way[0]]) / (np.hypot(*way) or 1.0) * (-13 if label == b"LP" else 13)
        axes.annotate(
            chr(ord("a") + column), here, tuple(right), textcoords="offset points", ha="center", va="center", fontsize=10
        )


def draw_strip(axes, shape, width: float) -> None:
    """A closed strip as a lit surface, one colour a side, seen from above at an angle, at equal scale."""
    from mpl_toolkits.mplot3d.art3d import Poly3DCollection

    step = max(1, len(shape.arclength) // 400)
    keep = np.unique(np.append(np.arange(0, len(shape.arclength), step), len(shape.arclength) - 1))
    # the axis of the moment points up, and the strip is looked at from the same side at every point
    surface = (shape.surface(width)[keep] - shape.centreline.mean(axis=0)) @ shape.upright().T
    a, b = surface[:, 0], surface[:, -1]
    quads = np.stack([a[:-1], a[1:], b[1:], b[:-1]], axis=1)
    normals = np.cross(a[1:] - a[:-1], b[:-1] - a[:-1])
    normals /= np.linalg.norm(normals, axis=1)[:, None] + 1e-300
    light, eye = np.array([0.3, -0.4, 0.85]), np.array([0.55, -0.55, 0.63])
    light /= np.linalg.norm(light)
    from matplotlib.colors import to_rgb

    front = (normals @ eye > 0)[:, None]
    shade = (0.45 + 0.55 * np.abs(normals @ light))[:, None]
    colours = np.where(front, to_rgb(SHAPE), to_rgb(BACK)) * shade
    axes.add_collection3d(Poly3DCollection(quads, facecolors=colours, edgecolors=colours, linewidths=0.2))
    reach = 0.8  # the same for all: the m-covered circle has radius 1 / m
    axes.set(xlim=(-reach, reach), ylim=(-reach, reach), zlim=(-reach, reach))
    axes.set_box_aspect((1, 1, 1), zoom=1.25)
    axes.view_init(elev=32, azim=-45)
    axes.set_axis_off()
