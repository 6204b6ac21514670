"""A result as a picture: the strip along the way, and columns against each other."""

from __future__ import annotations

import math
import textwrap
from collections.abc import Mapping
from types import MappingProxyType
from typing import Any

import numpy as np

from branches.draw.strip import View, draw_strip, reach_of
from branches.draw.style import LINES, OTHER, UNKNOWN, area, in_words, narrowed, points
from branches.scene.labels import END, begins

#: Diagrams in a row, at most: with more, their letters are too small to read in a page of text.
_PANELS = 4
#: Largest length of the scale bar, as a part of the picture.
_BAR = 0.45
#: Area of the dots at computed points; those of unstable pieces are open.
_DOT = 8
#: Half the width of a letter and half the height of a line, in points of a text of 11 points.
_WIDE, _HIGH = 3.4, 6.0
#: Distance of a text from its place in points, beside half its size; and ways in which it is looked for.
_AWAY, _WAYS = 8.0, 16
_BLACK = "#000000"


def figure(
    branch, shapes: int = 6, width: float | None = None, x: str | None = None, y: str | None = None,
    view: tuple[float, float] | None = None, size: float | None = None, measured: Mapping[str, np.ndarray] | None = None,
):  # fmt: skip
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
    view : (float, float), optional
        The side from which strips are seen, azimuth and elevation in degrees; see `branches.draw.strip.View`.
    size : float, optional
        Width in inches; by default 9, or more for several diagrams.
    measured : mapping of str to ndarray, optional
        Measured points, by columns, which are drawn in the diagrams of two of them; see `measured_points`.

    Raises
    ------
    ValueError
        Measured points of other columns.
    """
    panels = [(x or branch.panels[0][0], y or branch.panels[0][1])] if x or y else branch.panels[:_PANELS]
    chosen = choose(branch, shapes, {stage for columns in panels for stage in _stages(branch, columns[0])})
    usual = max(9, 3.6 * len(panels))
    with narrowed((size or usual) / usual):
        view = branch.view if view is None else View(*view)
        return _figure(branch, panels, chosen, width, view, size or usual, check_measured(measured or {}, panels))


def _figure(branch, panels, chosen: list[int], width: float | None, view: View, wide: float, measured):
    from matplotlib.figure import Figure

    result = Figure(figsize=(wide, points(6.2 if chosen else 4.5)), layout="constrained")
    rows = result.subfigures(2 if chosen else 1, 1, height_ratios=[1, 2.6] if chosen else [1], squeeze=False)[:, 0]
    if chosen:
        _strips(rows[0], branch, chosen, width, view)
    handles: dict[str, Any] = {}
    for number, columns in enumerate(panels):
        axes = rows[-1].add_subplot(1, len(panels), number + 1)
        panel(axes, branch, columns, chosen, measured=measured)
        for handle, word in zip(*axes.get_legend_handles_labels()):
            handles.setdefault(word, handle)
        axes.get_legend().remove()
    if narrow := 2 * max(map(len, handles), default=0) > 16 * wide:  # letters of two columns, and those of a line
        result.set_figheight(result.get_figheight() + points(0.12) * len(handles))
    style = {"loc": "outside lower center", "ncols": 1 if narrow else 4 if wide > points(7) else 2, "frameon": False}
    rows[-1].legend(handles.values(), handles.keys(), fontsize=points(11), **style)
    result.suptitle(branch.caption, fontsize=points(12))
    return result


def _strips(row, branch, chosen: list[int], width: float | None, view: View) -> None:
    """Draw the strips at some points side by side, all to one scale, which the first one shows, with the weight."""
    strips = [*branch.posed(chosen).values()]
    wide = branch.drawn_width(strips, width)
    reach = reach_of(strips, wide, view)
    for number, strip in enumerate(strips):
        axes = row.add_subplot(1, len(strips), number + 1)
        draw_strip(axes, strip, wide, reach, view)
        axes.set_title(chr(ord("a") + number), fontsize=points(12), y=0.95)
        if number == 0:
            scale_bar(axes, branch, reach)
            if branch.is_heavy:
                weight_arrow(axes, reach, view)


def scale_bar(axes, branch, reach: float) -> None:
    """Draw a bar of a round length, in m where the scene has dimensions, otherwise in lengths of the strip."""
    unit = branch.length / branch.shape_length
    longest = _BAR * 2 * reach * unit
    decade = 10.0 ** math.floor(math.log10(longest))
    size = max(step * decade for step in (1, 2, 5) if step * decade <= longest)
    x, y = -0.97 * reach, -0.9 * reach
    axes.plot([x, x + size / unit], [y, y], color=OTHER, lw=points(2), solid_capstyle="butt")
    words = f"{size:g} {branch.length_unit}".rstrip()
    axes.annotate(words, (x, y), (0, 3), textcoords="offset points", fontsize=points(9), color=OTHER)


def weight_arrow(axes, reach: float, view: View) -> None:
    """Draw where the weight pulls to."""
    down = -view.axes[:2, 2]
    tail = np.array([-0.9, -0.2]) * reach
    style = {"arrowstyle": "-|>", "color": OTHER, "lw": points(1.4), "shrinkA": 0, "shrinkB": 0}
    axes.annotate("", tail + 0.4 * reach * down, tail, arrowprops=style)
    axes.annotate("weight", tail, (0, 2), textcoords="offset points", fontsize=points(9), color=OTHER)


def _stages(branch, followed: str) -> list[int]:
    """Return the stages that follow a number or, where none does, all."""
    return [stage.number for stage in branch.stages if stage.follow == followed] or [one.number for one in branch.stages]


def choose(branch, count: int, stages: set[int]) -> list[int]:
    """Return the points whose strip is drawn: nearest to equal distances along stages in a row, labelled ones preferred."""
    kept = branch.kept()
    kept = kept[np.isin(branch.stage_of[kept], list(stages))]
    if not count or not len(kept):
        return []
    s = branch.way[kept]
    labelled = branch.points["label"][kept] != b""
    spacing = (s[-1] - s[0]) / max(count - 1, 1) or 1.0
    again = {int(event["point"]) for event in branch.events if begins(event) and event["point"]}  # drawn before
    distances = np.abs(s - np.linspace(s[0], s[-1], count)[:, None]) - 0.45 * spacing * labelled
    return sorted({*kept[np.argmin(distances, axis=1)].tolist()} - again)


def panel(axes, branch, columns: tuple[str, str], chosen, dots: bool = True, measured=MappingProxyType({})) -> None:
    """Draw a column against another: solid where stable, with marks at labelled points and letters at the strips drawn.

    ``dots`` are drawn at all computed points.

    Of several stages, those that follow the column across are drawn, or all if none does; each has its colour.
    """
    seen: set = set()
    (across, *_), (up, *_) = axis = [branch.axis(column) for column in columns]
    stages = _stages(branch, columns[0])
    rows = np.flatnonzero(np.isin(branch.stage_of, stages))
    drawn = [(piece, curve) for piece, curve in branch.curves(*columns) if piece.stage in stages]
    texts: list = []
    unknown = LINES[None][0] if all(piece.stable is None for piece in branch.pieces()) else UNKNOWN
    for piece, (x, y) in drawn:
        dashes, words = LINES[piece.stable] if piece.stable is not None else (unknown, LINES[None][1])
        axes.plot(x, y, color=branch.colour(piece.stage), ls=dashes, lw=points(1.8), zorder=1)
        fill = "white" if piece.stable is False else branch.colour(piece.stage)
        places = across[piece.rows], up[piece.rows]
        if dots:
            style = {"facecolors": fill, "edgecolors": branch.colour(piece.stage), "lw": points(0.8), "zorder": 0.9}
            axes.scatter(*places, s=area(_DOT), **style)
        index = branch.index_on(piece.rows)
        if index > 0:
            words = f"{words}, with the index"
            texts.append(((x[len(x) // 2], y[len(y) // 2]), str(index), branch.colour(piece.stage)))
        if words not in seen:
            axes.plot([], [], color=OTHER, ls=dashes, lw=points(1.8), label=_once(words, seen))
    if len(branch.stages) > 1:
        for stage in np.intersect1d(stages, branch.stage_of).tolist():
            axes.plot([], [], color=branch.colour(stage), lw=points(1.8), label=f"stage {stage}")
    for mark in branch.marks():
        if branch.stage_of[mark.row] in stages:
            place = across[mark.row], up[mark.row]
            _mark(axes, mark, place, seen)
            texts.insert(0, (place, in_words(f"{place[0]:.4f}") if mark.label.told else "", _BLACK))
    for snap in branch.snaps():
        if snap.column == columns[0] and columns[1] in snap.to:
            target = snap.to[columns[1]] * branch.scene.factor(columns[1])
            _arrow(axes, (across[snap.row], up[snap.row]), target, branch.words_of("energy", snap.released))
    letters = np.array(axes.get_window_extent().size) / (axes.figure.dpi / 72 * points(2 * _WIDE))
    for (_, words), place, most in zip(axis, (axes.set_xlabel, axes.set_ylabel), letters):
        place(textwrap.fill(words, len(words) // math.ceil(len(words) / most) + 4), fontsize=points(12))
    axes.tick_params(labelsize=points(11))
    axes.grid(alpha=0.25)
    axes.margins(0.16, 0.12)
    here = [point for point in chosen if branch.stage_of[point] in stages]
    with_points = draw_measured(axes, measured, *columns)
    plain = [point for point in here if branch.points["label"][point] == b""]
    axes.scatter(across[plain], up[plain], s=area(18), color=_BLACK, zorder=2)
    texts += [((across[point], up[point]), chr(ord("a") + chosen.index(point)), _BLACK) for point in here]
    axes.autoscale_view()
    for column, values, limit in zip(columns, (across, up), (axes.set_xlim, axes.set_ylim)):
        points_of = branch.points[rows]
        size, error = np.abs(values[rows]).max(), (points_of["newton_error"] + points_of["discretization_error"]).max()
        error *= size + branch.scene.factor(column)
        if np.ptp(values[rows]) <= 10 * error and not with_points:  # what differs by its error only is a straight line
            half = (size if size > 10 * error else branch.scene.factor(column)) / 2
            limit(values[rows].mean() - half, values[rows].mean() + half)
    put(axes, texts, np.concatenate([*(curve.T for _, curve in drawn), np.column_stack([across, up])[rows]]))
    axes.legend(frameon=False, fontsize=points(11))


def check_measured(measured: Mapping[str, np.ndarray], panels) -> Mapping[str, np.ndarray]:
    """Return measured points; raise ValueError if they fit none of the panels, which are of two columns each."""
    if measured and not any(x in measured and y in measured for x, y in panels):
        there = ", ".join(name for name in measured if not name.startswith("error_"))
        drawn = "; ".join(f"{x} and {y}" for x, y in panels)
        raise ValueError(f"--points: must hold both columns of a picture, {drawn}, and holds {there}")
    return measured


def draw_measured(axes, measured: Mapping[str, np.ndarray], x: str, y: str) -> bool:
    """Draw measured points with their errors in a panel of two columns; return whether both were measured."""
    if x not in measured or y not in measured:
        return False
    bars = {f"{axis}err": measured.get(f"error_{name}") for axis, name in (("x", x), ("y", y))}
    style = {"fmt": "s", "ms": points(4.5), "mfc": "white", "mec": _BLACK, "mew": points(1), "ecolor": _BLACK}
    axes.errorbar(measured[x], measured[y], **bars, **style, elinewidth=points(1), label="measured", zorder=4)
    return True


def _mark(axes, mark, place, seen: set) -> None:
    """Draw the mark of a labelled point, with a word for the legend where it has none yet, and its text."""
    fill = "white" if mark.open else mark.label.colour  # open: the branch goes on there
    colours = {"color": fill} if mark.label.marker == "x" else {"facecolor": fill, "edgecolor": END}
    size, word = area(mark.label.size), _once(mark.word, seen)
    axes.scatter(*place, marker=mark.label.marker, s=size, zorder=3, label=word, **colours)


def _arrow(axes, place, target: float, released: str) -> None:
    """Draw an arrow from a fold that snaps to the stable state of least energy, and say how much lower that is."""
    style = {"arrowstyle": "->", "color": _BLACK, "lw": points(1.2)}
    axes.annotate("", (place[0], target), place, arrowprops=style, zorder=2)
    words = f"snap: a stable state lies {in_words(released)} lower"
    axes.plot([], [], color=_BLACK, ls="", marker=r"$\downarrow$", ms=points(12), label=words)  # in the legend: hides no curve


def _once(name, seen: set):
    """A name for the legend, or None if it has that already."""
    label = None if name in seen else name
    seen.add(name)
    return label


def put(axes, texts, curves: np.ndarray) -> None:
    """Write texts beside their places, each on the side of it where it hides least of curves (K, 2), marks and other texts."""
    to_screen = axes.transData.transform
    dot = axes.figure.dpi / 72
    fine, number = np.arange(0, len(curves) - 1, 0.1), np.arange(len(curves))  # a text may lie between two points of a curve
    hidden = to_screen(np.column_stack([np.interp(fine, number, column) for column in curves.T])) / dot
    marks = [to_screen(place) / dot for place, *_ in texts]
    frame = axes.get_window_extent().padded(-2 * dot)
    low, high = np.array(frame.min) / dot, np.array(frame.max) / dot
    boxes: list[np.ndarray] = []
    for (place, text, colour), at in zip(texts, marks):
        if not text:
            continue
        half = points(1) * np.array([_WIDE * len(text), _HIGH])
        best = None
        for way in range(2 * _WAYS):  # near, then twice as far away
            ahead = np.array([math.cos(2 * math.pi * way / _WAYS), math.sin(2 * math.pi * way / _WAYS)])
            middle = at + ahead * (points(_AWAY) * (1 + way // _WAYS) + np.abs(ahead) @ half)
            cost = np.count_nonzero((np.abs(hidden - middle) < half).all(axis=1))
            cost += 100 * sum((np.abs(other - middle) < half + 6).all() for other in marks)
            cost += 200 * any(np.hypot(*(other - middle)) < np.hypot(*(at - middle)) - 1 for other in marks)
            cost += 1000 * sum((np.abs(box[0] - middle) < half + box[1]).all() for box in boxes)
            cost += 1000 * bool((middle - half < low).any() or (middle + half > high).any())
            if best is None or cost < best[0]:
                best = cost, middle
        boxes.append(np.array([best[1], half]))
        axes.annotate(
            text, place, best[1] - at, textcoords="offset points", ha="center", va="center", fontsize=points(11), color=colour
        )
