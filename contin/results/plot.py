"""Columns of a branch against each other, drawn by matplotlib (which is imported when it is asked for)."""

from __future__ import annotations

import io
from collections.abc import Iterator, Sequence
from itertools import groupby, pairwise
from typing import Any

import numpy as np

from contin import checks
from contin.arrays import Array
from contin.core.labels import Label
from contin.errors import ProblemError
from contin.results.axes import Axes, new_axes
from contin.results.point import Point

#: Marks of labelled points: matplotlib's symbol and colour (Okabe-Ito: told apart by the colour-blind).
_MARKS = {
    "LP": ("*", "#D55E00"), "BP": ("o", "#000000"), "HB": ("s", "#009E73"), "UZ": ("D", "#CC79A7"), "CP": ("^", "#D55E00"),
    "PD": ("X", "#0072B2"), "TR": ("h", "#56B4E9"), "BT": ("v", "#000000"), "ZH": ("<", "#E69F00"), "HH": (">", "#56B4E9"),
    "GH": ("P", "#009E73"), "GPD": ("P", "#0072B2"), "CH": ("P", "#56B4E9"), "LPPD": ("d", "#D55E00"), "LPTR": ("d", "#56B4E9"),
    "EX": ("s", "#D55E00"), "R1": ("p", "#E69F00"), "R2": ("p", "#CC79A7"), "R3": ("p", "#0072B2"), "R4": ("p", "#009E73"),
}  # fmt: skip
_OTHER_MARK = (".", "#000000")
#: Labels of points where a multiplier of a cycle lies on the unit circle: what is next to them says which side is stable.
_CRITICAL = (Label.FOLD, Label.BRANCH_POINT, Label.PERIOD_DOUBLING, Label.TORUS, Label.HOPF)
#: Dashes and legend of pieces, by whether they are stable; None: not known.
_LINES = {True: ("-", "stable"), False: ((0, (3, 2)), "unstable"), None: ("-", None)}
#: A point with a larger estimated discretization error, relative to 1 + size, is crossed out: it would be seen in the picture.
_VISIBLE = 1e-3
#: Areas of the marks in points squared: a star needs a larger one to look as large.
_AREA = {"*": 90, "": 30}


def plot(points: Sequence[Point], x: str | None = None, y: str | None = None, axes: Axes | None = None) -> Any:
    """Draw one column against another, with marks at labelled points; see `contin.Branch.plot`."""
    x, columns, name = _columns(points, x, y)
    axes = new_axes() if axes is None else axes
    pieces = list(_pieces(points))
    named: set[str | None] = set(axes.get_legend_handles_labels()[1])
    for column_name in columns:
        named |= _draw(points, (x, column_name), pieces, named, axes)
    axes.set(xlabel=x, ylabel=name)
    if any(point.label for point in points) or named - {None}:
        axes.legend(frameon=False)
    return axes


def _draw(
    points: Sequence[Point], names: tuple[str, str], pieces: Sequence[tuple[bool | None, slice]], known: set[str | None],
    axes: Axes,
) -> set[str | None]:  # fmt: skip
    """Draw one column over another, and return the names for the legend; those that are ``known`` are not given again."""
    across, up = column(points, names[0]), column(points, names[1])
    named: set[str | None] = set()
    for stable, piece in pieces:
        dashes, name = _LINES[stable]
        label = None if name in known | named else name
        named.add(name)
        axes.plot(across[piece], up[piece], lw=1.5, color="#0072B2", ls=dashes, label=label, zorder=1)
    labels = [point.label for point in points]
    for label in dict.fromkeys(filter(None, labels)):
        here = [i for i, other in enumerate(labels) if other == label]
        marker, colour = _MARKS.get(label, _OTHER_MARK)
        area, again = _AREA.get(marker, _AREA[""]), label in known
        axes.scatter(across[here], up[here], s=area, marker=marker, color=colour, label=None if again else label, zorder=2)
        named.add(label)
    doubtful = [i for i, point in enumerate(points) if point.discretization_error > _VISIBLE]
    if doubtful:
        meaning = f"discretization error above {_VISIBLE:g}"
        shown = None if meaning in known else meaning
        axes.scatter(across[doubtful], up[doubtful], s=30, marker="x", color="#999999", label=shown, zorder=3)
        named.add(meaning)
    return named


def _pieces(points: Sequence[Point]) -> Iterator[tuple[bool | None, slice]]:
    """Cut a branch where its stability changes; without any index, there is one piece.

    Yields
    ------
    stable : bool or None
        Whether the energy has a minimum on the piece; None where no point has an index, or the ends of a step disagree.
    piece : slice
        Points of the piece; its ends belong to the pieces beside it too.
    """
    moving = bool(points) and points[0].system.unstable(points[0].x) is not None
    if len(points) < 2 or (not moving and all(point.index is None for point in points)):
        yield None, slice(None)
        return
    first = 0
    for stable, steps in groupby(_of_motions(points) if moving else map(_stable, *zip(*pairwise(points)))):
        last = first + len(list(steps))
        yield stable, slice(first, last + 1)
        first = last


def _of_motions(points: Sequence[Point]) -> list[bool | None]:
    """Return whether the cycles, or the equilibria, between two points are stable, for each step.

    The regular point at one end decides; between two special points, the step before.
    """
    counts = [None if point.label in _CRITICAL else point.system.unstable(point.x) for point in points]
    found: list[bool | None] = []
    for a, b in pairwise(counts):
        count = b if a is None else a
        found.append((found[-1] if found else None) if count is None else count == 0)
    return found


def _stable(a: Point, b: Point) -> bool | None:
    """Return whether the states between two points are stable; at special points, the index beside them counts."""
    beside = [point.index for point in (a, b) if not point.nullity]
    beside += [a.index_change[1]] if a.nullity and a.index_change else []
    beside += [b.index_change[0]] if b.nullity and b.index_change else []
    found = {index == 0 for index in beside if index is not None}
    return found.pop() if len(found) == 1 else None


def picture(points: Sequence[Point]) -> str:
    """Return the plot as SVG, or nothing where matplotlib is not installed."""
    try:
        from matplotlib import rc_context
        from matplotlib.figure import Figure
    except ImportError:
        return ""
    text = io.StringIO()
    with rc_context({"svg.hashsalt": "contin"}):  # the same branch gives the same file
        figure = Figure(figsize=(4.5, 2.8), layout="constrained")
        plot(points, axes=figure.subplots())
        figure.savefig(text, format="svg", metadata={"Date": None})
    return text.getvalue()[text.getvalue().index("<svg") :]


def column(points: Sequence[Point], name: str) -> Array:
    """Return a parameter, functional, state of equilibria, ``"arclength"``, ``"norm"`` or ``"discretization_error"``.

    The norm is the root mean square of the states over the nodes.
    """
    if points and name in (*points[0].parameters, *points[0].functionals, *points[0].system.named_states):
        return np.array([point[name] for point in points])
    if name in ("arclength", "discretization_error"):
        return np.array([getattr(point, name) for point in points])
    return np.array([np.sqrt(np.mean(np.sum(point.system.states(point.x) ** 2, axis=1))) for point in points])


def _columns(points: Sequence[Point], x: str | None, y: str | None) -> tuple[str, list[str], str]:
    """Return the names of the columns to draw and of the second axis, with the defaults of `plot`."""
    if not points:
        raise ProblemError("the branch has no points to draw")
    first = points[0]
    known = [*first.parameters, *first.functionals, "arclength", "norm", "discretization_error", *first.system.named_states]
    x = first.system.free[0] if x is None else x
    states = first.system.problem.states if first.system.is_cycle and first.system.intervals else ()
    y = (states[0] if states else next(iter(first.functionals), "norm")) if y is None else y
    if x in known and y in states:
        return x, [f"max_{y}", f"min_{y}"], f"{y}, largest and smallest"
    for argument, name in (("x", x), ("y", y)):
        if name not in known:
            raise ProblemError(f"{argument}: {checks.shown(name)} is no column; there are {', '.join((*known, *states))}")
    return x, [y], y
