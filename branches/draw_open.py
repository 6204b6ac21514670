"""The stages of an open strip as a picture: the strip along the way, and what a person feels against what is followed."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from branches.draw_branch import choose, letters
from branches.draw_diagram import LINES, in_words, smooth
from branches.draw_strip import draw_strip, reach_of, standing
from branches.labels import label_of
from branches.solid import widest
from ribbon_model.shape import Shape

#: Width of a strip of unknown dimensions, over its length, and the part of the largest possible one that it stays below.
WIDTH, ROOM = 0.06, 0.8
#: Diagrams in a row, at most: with more, their letters are too small to read in a page of text.
_PANELS = 4
#: Colours of stages (Okabe and Ito), told apart by the colour-blind.
_COLOURS = ("#0072B2", "#D55E00", "#009E73", "#CC79A7", "#E69F00", "#56B4E9")
#: Numbers and columns in words.
WORDS = {
    "distance": "distance of the ends", "rise": "displacement along the normal", "shear": "displacement along the width",
    "turn": "turn of the end", "bend": "bend of the end", "swing": "swing of the end", "stroke": "displacement of the end",
    "force_tangent": "force along the tangent", "force_width": "force along the width",
    "force_normal": "force along the normal", "moment": "moment at the hinge", "weight": "weight per length",
    "foundation": "stiffness of the foundation", "kappa_n": "natural curvature", "tau_n": "natural twist",
    "roller": "place at the roller", "F_roller": "force of the roller", "softness": "softness in the plane",
    "F_tangent": "force along the tangent", "F_width": "force along the width",
    "F_normal": "force along the normal", "M_tangent": "moment about the tangent", "M_width": "moment about the width",
    "M_normal": "moment about the normal", "energy": "energy",
}  # fmt: skip


def figure(branch, shapes: int = 6, width: float | None = None):
    """Return the figure of a result: strips at equal distances along the way, and one diagram for each number followed.

    Parameters
    ----------
    branch : branches.open_branch.OpenBranch
    shapes : int
        Number of strips; labelled points are among them where they fit.
    width : float, optional
        Width of the drawn strip, over its length.
    """
    from matplotlib.figure import Figure

    chosen = chosen_points(branch, shapes)
    names = list(dict.fromkeys(branch.followed(int(stage)) for stage in np.unique(branch.points["stage"])))
    panels = min(len(names), _PANELS)
    columns = max(len(chosen), 1)
    result = Figure(figsize=(max(9, 3.6 * panels), 5.9 if chosen else 4.2), layout="constrained")
    rows = result.subfigures(2 if chosen else 1, 1, height_ratios=[1, 2.4] if chosen else [1], squeeze=False)[:, 0]
    strips = [centred(branch.shape(point), branch.up) for point in chosen]
    if strips:
        wide = width_of(branch, strips, width)
        reach = reach_of(strips, wide)
        for column, strip in enumerate(strips):
            axes = rows[0].add_subplot(1, columns, column + 1)
            draw_strip(axes, strip, wide, reach)
            axes.set_title(chr(ord("a") + column), fontsize=12, y=0.95)
    seen: set = set()
    for place, name in enumerate(names[:panels]):
        panel(rows[-1].add_subplot(1, panels, place + 1), branch, name, chosen, seen)
    result.suptitle(branch.config["title"] or branch.scene.name, fontsize=12)
    return result


def chosen_points(branch, count: int) -> list[int]:
    """Return the points whose strip is drawn: as `draw_branch.choose`, the arclength of all stages in a row."""
    s, offset = branch.points["arclength"].copy(), 0.0
    for stage in np.unique(branch.points["stage"]):
        rows = branch.points["stage"] == stage
        s[rows] += offset
        offset = s[rows][-1]
    again = {int(event["point"]) for event in branch.events if event["name"] == b"start" and event["point"]}  # drawn before
    return [point for point in choose(branch, count, s) if point not in again]


def centred(shape: Shape, up) -> Shape:
    """Return the shape with this direction upwards, in the middle of the picture."""
    shape = standing(shape, up)
    middle = (shape.centreline.max(axis=0) + shape.centreline.min(axis=0)) / 2
    return replace(shape, centreline=shape.centreline - middle)


def width_of(branch, strips, asked: float | None) -> float:
    """Return the width of the drawn strips over the length: that of the scene's dimensions, or the one asked for."""
    sizes = branch.config["dimensions"]
    if asked is None:
        asked = sizes["width"] / sizes["length"] if sizes else WIDTH
    return min([asked, *(ROOM * widest(strip) for strip in strips)])


def panel(axes, branch, name: str, chosen, seen: set) -> None:
    """Draw all stages that follow a number: solid where stable, with marks at labelled points and arrows at snaps."""
    scene, conjugate = branch.scene, branch.conjugate(name)
    across, up = branch.points[name] * scene.factor(name), branch.points[conjugate] * scene.factor(conjugate)
    for piece in branch.pieces():
        if branch.followed(piece.stage) != name:
            continue
        s = branch.points["arclength"][piece.rows]
        _, x, y = smooth(s, s, across[piece.rows], up[piece.rows])
        dashes, words = LINES[piece.stable]
        colour = _COLOURS[(piece.stage - 1) % len(_COLOURS)]
        axes.plot(x, y, color=colour, ls=dashes, lw=2.2 if piece.stable else 1.4, zorder=1, label=_once(words, seen))
    for event in branch.events:
        if branch.followed(int(event["stage"])) == name and event["name"] != b"start":
            _mark(axes, event, (across, up), seen)
    for snap in branch.snaps():
        if snap.column == name:
            _arrow(axes, snap, branch, (across, up))
    _label(axes, scene, name, conjugate)
    here = [point for point in chosen if branch.followed(int(branch.points["stage"][point])) == name]
    rows = np.flatnonzero([branch.followed(int(stage)) == name for stage in branch.points["stage"]])
    kept = [int(np.flatnonzero(rows == point)[0]) for point in here]
    names = [chr(ord("a") + chosen.index(point)) for point in here]
    letters(axes, np.column_stack([across, up])[rows], branch.points["label"][rows], kept, "#000000", names)
    if axes.get_legend_handles_labels()[1]:
        axes.legend(frameon=False, fontsize=10)


def _label(axes, scene, name: str, conjugate: str) -> None:
    for column, place in ((name, axes.set_xlabel), (conjugate, axes.set_ylabel)):
        unit = scene.unit(column)
        place(f"{WORDS.get(column, column)}{f' in {unit}' if unit else ''}", fontsize=11)
    axes.tick_params(labelsize=10)
    axes.grid(alpha=0.25)
    axes.margins(0.12, 0.12)


def _mark(axes, event, columns, seen: set) -> None:
    """Draw the mark of a labelled point, with the value at a fold or branch point."""
    across, up = columns
    mark, row = label_of(event["label"].decode()), int(event["point"])
    place = across[row], up[row]
    colours = {"color": mark.colour} if mark.marker == "x" else {"facecolor": mark.colour, "edgecolor": mark.colour}
    if event["label"] == b"EP":
        colours = {"facecolor": "white", "edgecolor": mark.colour}
    axes.scatter(*place, marker=mark.marker, s=mark.size, zorder=3, label=_once(mark.word, seen), **colours)


def _arrow(axes, snap, branch, columns) -> None:
    """Draw where a fold snaps to, with the energy that it releases."""
    across, up = columns
    conjugate, scene = branch.conjugate(snap.column), branch.scene
    target = snap.to[conjugate] * scene.factor(conjugate)
    released = f"{snap.released * scene.factor('energy'):.3g} {scene.unit('energy')}".strip()
    style = {"arrowstyle": "->", "color": "#000000", "lw": 1.2}
    axes.annotate("", (across[snap.row], target), (across[snap.row], up[snap.row]), arrowprops=style, zorder=2)
    words = f"snap, releases {in_words(released)}"
    axes.plot([], [], color="#000000", ls="", marker=r"$\downarrow$", ms=12, label=words)  # in the legend: no curve is hidden


def _once(name, seen: set):
    label = None if name in seen else name
    seen.add(name)
    return label
