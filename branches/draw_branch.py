"""A branch as a picture: kappa* against kappa_n with folds and ends, and the strip along the branch (Fig. 11)."""

from __future__ import annotations

import math
from itertools import pairwise

import numpy as np

from branches.diagram_graph import common_index
from branches.draw_diagram import CONJUGATE, LINES, NATURAL, colour_of, in_words, smooth
from branches.draw_strip import draw_strip, reach_of, steady, strip_of, width_of
from branches.labels import SPECIAL, kind_of, label_of
from ribbon_model.laws import label as name_law
from ribbon_model.strip import Strip

#: Strips that are compared to see from which side to look; a tenth of them may miss how a strip turns over.
_BETWEEN = 60
#: Kinds of `branches.labels` that the legend says in other words.
_WORDS = {"leaves": "limit of the scene", "circle": "bifurcation of a circle"}


def figure(branch, shapes: int = 6, width: float | None = None):
    """The figure of a branch.

    Parameters
    ----------
    branch : branches.read.StoredBranch
    shapes : int
        Number of strips, at equal distances along the branch; labelled points are among them where they fit.
    width : float, optional
        Width of the drawn strip, in units of L / 2 pi; see `branches.draw_strip.width_of`.
    """
    from matplotlib.figure import Figure

    chosen = choose(branch, shapes)
    columns = max(len(chosen), 1)
    result = Figure(figsize=(9, 5.9 if chosen else 4.2), layout="constrained")
    grid = result.add_gridspec(2 if chosen else 1, columns, height_ratios=[1, 2.6] if chosen else [1])
    strips = _strips(branch, chosen)
    width = width_of(branch.config, strips, width)
    reach = reach_of(strips, width) if strips else 1.0
    for column, strip in enumerate(strips):
        axes = result.add_subplot(grid[0, column])
        draw_strip(axes, strip, width, reach)
        axes.set_title(chr(ord("a") + column), fontsize=12, y=0.95)
    curve(result.add_subplot(grid[-1, :]), branch, chosen)
    return result


def _strips(branch, chosen) -> list:
    """The strips of these points, looked at from one side: each is turned onto the one before, along points between them."""
    kept = branch.kept().tolist() if chosen else []
    between = sorted({*kept[:: max(1, len(kept) // _BETWEEN)], *chosen})
    turned = steady({point: strip_of(branch, point) for point in between})
    return [turned[point] for point in chosen]


def choose(branch, count: int, arclength=None) -> list[int]:
    """Numbers of the points whose strip is drawn: nearest to equal distances along the branch, labelled ones preferred.

    ``arclength`` of all points stands in for the column of that name.
    """
    kept = branch.kept()
    if not count or not len(kept):
        return []
    s = (branch.points["arclength"] if arclength is None else arclength)[kept]
    labelled = branch.points["label"][kept] != b""
    spacing = (s[-1] - s[0]) / max(count - 1, 1) or 1.0
    chosen = []
    for target in np.linspace(s[0], s[-1], count):
        distance = np.abs(s - target) - 0.45 * spacing * labelled
        best = int(kept[np.argmin(distance)])
        if best not in chosen:
            chosen.append(best)
    return sorted(chosen)


def title_of(config: dict) -> str:
    """What the branch is, in words: the strip with its dimensions or the law, the mode and Poisson's ratio."""
    what, strip = name_law(config["law"], config["Gamma"]).replace("Gamma", "Γ"), config["strip"]
    if strip:
        sizes = " × ".join(f"{1e3 * strip[name]:.4g}" for name in ("width", "thickness", "length"))
        what = f"strip of {sizes} mm"
    secondary = "secondary branch of " if config["origin"] else ""
    return f"{what}, {secondary}(m, n) = ({config['m']}, {config['n']}), $\\nu$ = {in_words(config['nu'])}"


def unit_of(config: dict) -> float:
    """The unit of curvature on the axes: 2 pi/L in 1/m if the dimensions of the strip are known, otherwise 1."""
    return 2 * math.pi / config["strip"]["length"] if config["strip"] else 1.0


def curve(axes, branch, chosen) -> None:
    """kappa* against kappa_n, with marks at labelled points and letters at the strips drawn; in 1/m for a strip with sizes."""
    points, config = branch.points, branch.config
    colour, unit = colour_of(config["n"]), unit_of(config)
    seen = {None, "branch point"}
    for stable, kappa_n, kappa_star in lines(branch):
        dashes, name = LINES[stable]
        axes.plot(unit * kappa_n, unit * kappa_star, color=colour, ls=dashes, lw=1.8, zorder=1, label=_once(name, seen))
    for event in branch.events:
        _mark(axes, event, unit, branch, seen)
    si = " in 1/m" if config["strip"] else ""
    axes.set_xlabel(r"natural curvature $\kappa_n$" + si if si else NATURAL, fontsize=12)
    axes.set_ylabel(r"conjugate curvature $\kappa^*$" + si if si else CONJUGATE, fontsize=12)
    axes.set_title(title_of(config), fontsize=12)
    axes.tick_params(labelsize=11)
    axes.grid(alpha=0.25)
    axes.margins(0.16, 0.1)
    axes.legend(frameon=False, fontsize=11)
    place = np.column_stack([unit * points["kappa_n"], unit * points["kappa_star"]])
    letters(axes, place, points["label"], chosen, colour)


def _mark(axes, event, unit: float, branch, seen: set) -> None:
    """The mark of a labelled point, with kappa_n at a fold, and a word for the legend where the mark has none yet."""
    letters, name = event["label"].decode(), event["name"].decode()
    mark, kind = label_of(letters), kind_of(letters, name, branch.reason, bool(branch.config["origin"]))
    label = _once(_word(kind, event, branch.config), seen)
    place = unit * event["kappa_n"], unit * event["kappa_star"]
    fill = "white" if kind == "leaves" else mark.colour  # open: the branch goes on there
    colours = {"color": mark.colour} if mark.marker == "x" else {"facecolor": fill, "edgecolor": mark.colour}
    axes.scatter(*place, marker=mark.marker, s=mark.size, zorder=3, label=label, **colours)
    if letters == "LP":
        axes.annotate(in_words(f"{place[0]:.4f}"), place, (9, -3), textcoords="offset points", fontsize=11)


def _word(kind: str, event, config: dict) -> str:
    """What the legend calls a labelled point."""
    if kind == "user value" and config["strip"] and math.isclose(event["kappa_n"], Strip(**config["strip"]).kappa_n):
        return "natural curvature of the strip"
    return _WORDS.get(kind, kind)


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


def letters(axes, points, labels, chosen, colour, names=None) -> None:
    """Letters of the strips drawn (a, b, ... or those given), to the right of the curve as it goes.

    At a fold, which has a number there, to its left.
    """
    axes.autoscale_view()
    place = axes.transData.transform(points)
    for column, number in enumerate(chosen):
        if labels[number] == b"":
            axes.scatter(*points[number], s=18, color=colour, zorder=2)
        way = place[min(number + 1, len(place) - 1)] - place[max(number - 1, 0)]
        right = np.array([way[1], -way[0]]) / (np.hypot(*way) or 1.0) * (-13 if labels[number] == b"LP" else 13)
        letter, style = names[column] if names else chr(ord("a") + column), {"ha": "center", "va": "center", "fontsize": 12}
        axes.annotate(letter, points[number], tuple(right), textcoords="offset points", **style)
