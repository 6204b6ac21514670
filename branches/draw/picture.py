"""A result as a picture: the strip along the way, and columns against each other."""

from __future__ import annotations

import numpy as np

from branches.draw.strip import draw_strip, reach_of
from branches.draw.style import LINES, in_words, smooth

#: Diagrams in a row, at most: with more, their letters are too small to read in a page of text.
_PANELS = 4


def figure(branch, shapes: int = 6, width: float | None = None, x: str | None = None, y: str | None = None):
    """Return the picture of a result as a matplotlib figure.

    Parameters
    ----------
    branch : branches.store.branch.StoredBranch
    shapes : int
        Number of strips, at equal distances along the way; labelled points are among them where they fit.
    width : float, optional
        Width of the drawn strip, in the unit of length of the scene.
    x, y : str, optional
        Columns across and upwards; by default each number that is followed, and what is conjugate to it.
    """
    from matplotlib.figure import Figure

    chosen = choose(branch, shapes)
    panels = [(x or branch.panels[0][0], y or branch.panels[0][1])] if x or y else branch.panels[:_PANELS]
    result = Figure(figsize=(max(9, 3.6 * len(panels)), 5.9 if chosen else 4.2), layout="constrained")
    rows = result.subfigures(2 if chosen else 1, 1, height_ratios=[1, 2.6] if chosen else [1], squeeze=False)[:, 0]
    if chosen:
        strips = [*branch.posed(chosen).values()]
        wide = branch.drawn_width(strips, width)
        reach = reach_of(strips, wide)
        for number, strip in enumerate(strips):
            axes = rows[0].add_subplot(1, len(strips), number + 1)
            draw_strip(axes, strip, wide, reach)
            axes.set_title(chr(ord("a") + number), fontsize=12, y=0.95)
    seen: set = set()
    for number, columns in enumerate(panels):
        axes = rows[-1].add_subplot(1, len(panels), number + 1)
        panel(axes, branch, columns, chosen, seen)
        if len(panels) == 1:
            axes.set_title(branch.caption, fontsize=12)
    if len(panels) > 1:
        result.suptitle(branch.caption, fontsize=12)
    return result


def choose(branch, count: int) -> list[int]:
    """Return the points whose strip is drawn: nearest to equal distances along all stages in a row, labelled ones preferred."""
    kept = branch.kept()
    if not count or not len(kept):
        return []
    s = branch.way[kept]
    labelled = branch.points["label"][kept] != b""
    spacing = (s[-1] - s[0]) / max(count - 1, 1) or 1.0
    again = {int(event["point"]) for event in branch.events if event["name"] == b"start" and event["point"]}  # drawn before
    chosen = []
    for target in np.linspace(s[0], s[-1], count):
        distance = np.abs(s - target) - 0.45 * spacing * labelled
        best = int(kept[np.argmin(distance)])
        if best not in chosen:
            chosen.append(best)
    return sorted(set(chosen) - again)


def panel(axes, branch, columns: tuple[str, str], chosen, seen: set | None = None) -> None:
    """Draw a column against another: solid where stable, with marks at labelled points and letters at the strips drawn.

    Of several stages, those that follow the column across are drawn, or all if none does. ``seen`` are words of the legend so
    far.
    """
    seen = set() if seen is None else seen
    (across, *_), (up, *_) = axis = [branch.axis(column) for column in columns]
    stages = [stage.number for stage in branch.stages if stage.follow == columns[0]] or [one.number for one in branch.stages]
    rows = np.flatnonzero(np.isin(branch.stage_of, stages))
    for piece in branch.pieces():
        if piece.stage in stages:
            s = branch.points["arclength"][branch.stage_of == piece.stage]
            own = np.flatnonzero(branch.stage_of == piece.stage)
            fine, x, y = smooth(s, s, across[own], up[own])
            here = (fine >= s[piece.rows[0] - own[0]]) & (fine <= s[piece.rows[-1] - own[0]])
            dashes, words = LINES[piece.stable]
            axes.plot(x[here], y[here], color=branch.colour(piece.stage), ls=dashes, lw=1.8, zorder=1, label=_once(words, seen))
    for mark in branch.marks():
        if branch.stage_of[mark.row] in stages:
            _mark(axes, mark, (across[mark.row], up[mark.row]), seen)
    for snap in branch.snaps():
        if snap.column == columns[0] and columns[1] in snap.to:
            target = snap.to[columns[1]] * branch.scene.factor(columns[1])
            _arrow(axes, (across[snap.row], up[snap.row]), target, branch.words_of("energy", snap.released))
    for (_, words), place in zip(axis, (axes.set_xlabel, axes.set_ylabel)):
        place(words, fontsize=12)
    axes.tick_params(labelsize=11)
    axes.grid(alpha=0.25)
    axes.margins(0.16, 0.12)
    here = [point for point in chosen if branch.stage_of[point] in stages]
    kept = [int(np.flatnonzero(rows == point)[0]) for point in here]
    names = [chr(ord("a") + chosen.index(point)) for point in here]
    _letters(axes, np.column_stack([across, up])[rows], branch.points["label"][rows], kept, names)
    if axes.get_legend_handles_labels()[1]:
        axes.legend(frameon=False, fontsize=11)


def _mark(axes, mark, place, seen: set) -> None:
    """Draw the mark of a labelled point, with a word for the legend where it has none yet, and its text."""
    fill = "white" if mark.open else mark.label.colour  # open: the branch goes on there
    colours = {"color": fill} if mark.label.marker == "x" else {"facecolor": fill, "edgecolor": mark.label.colour}
    axes.scatter(*place, marker=mark.label.marker, s=mark.label.size, zorder=3, label=_once(mark.word, seen), **colours)
    if mark.label.told:
        axes.annotate(in_words(f"{place[0]:.4f}"), place, (9, -3), textcoords="offset points", fontsize=11)


def _arrow(axes, place, target: float, released: str) -> None:
    """Draw where a fold snaps to, with the energy that it releases."""
    style = {"arrowstyle": "->", "color": "#000000", "lw": 1.2}
    axes.annotate("", (place[0], target), place, arrowprops=style, zorder=2)
    words = f"snap, releases {in_words(released)}"
    axes.plot([], [], color="#000000", ls="", marker=r"$\downarrow$", ms=12, label=words)  # in the legend: no curve is hidden


def _once(name, seen: set):
    """A name for the legend, or None if it has that already."""
    label = None if name in seen else name
    seen.add(name)
    return label


def _letters(axes, points, labels, chosen, names) -> None:
    """Letters of the strips drawn, to the right of the curve as it goes; at a fold, which has a number there, to its left."""
    axes.autoscale_view()
    place = axes.transData.transform(points)
    for number, letter in zip(chosen, names):
        if labels[number] == b"":
            axes.scatter(*points[number], s=18, color="#000000", zorder=2)
        way = place[min(number + 1, len(place) - 1)] - place[max(number - 1, 0)]
        right = np.array([way[1], -way[0]]) / (np.hypot(*way) or 1.0) * (-13 if labels[number] == b"LP" else 13)
        style = {"ha": "center", "va": "center", "fontsize": 12}
        axes.annotate(letter, points[number], tuple(right), textcoords="offset points", **style)
