"""Columns of a branch against each other, drawn by matplotlib (which is imported when it is asked for)."""

from __future__ import annotations

import io
from collections.abc import Iterator, Sequence
from itertools import groupby, pairwise
from typing import Any

import numpy as np

from contin import checks
from contin.arrays import Array
from contin.errors import ProblemError
from contin.results.point import Point

#: Marks of labelled points: matplotlib's symbol and colour (Okabe-Ito: told apart by the colour-blind).
_MARKS = {
    "LP": ("*", "#D55E00"), "BP": ("o", "#000000"), "HB": ("s", "#009E73"), "UZ": ("D", "#CC79A7"), "CP": ("^", "#D55E00"),
    "PD": ("X", "#0072B2"), "TR": ("h", "#56B4E9"), "BT": ("v", "#000000"), "ZH": ("<", "#E69F00"), "HH": (">", "#56B4E9"),
    "GH": ("P", "#009E73"), "GPD": ("P", "#0072B2"), "CH": ("P", "#56B4E9"), "LPPD": ("d", "#D55E00"), "LPTR": ("d", "#56B4E9"),
    "R1": ("p", "#E69F00"), "R2": ("p", "#CC79A7"), "R3": ("p", "#0072B2"), "R4": ("p", "#009E73"),
}  # fmt: skip
_OTHER_MARK = (".", "#000000")
#: Dashes and legend of pieces, by whether they are stable; None: not known.
_LINES = {True: ("-", "stable"), False: ((0, (3, 2)), "unstable"), None: ("-", None)}
#: Areas of the marks in points squared: a star needs a larger one to look as large.
_AREA = {"*": 90, "": 30}


def plot(points: Sequence[Point], x: str | None = None, y: str | None = None, axes: Any = None) -> Any:
    """Draw one column against another, with marks at labelled points; see `contin.Branch.plot`."""
    x, y = _columns(points, x, y)
    across, up = column(points, x), column(points, y)
    if axes is None:
        try:
            from matplotlib import pyplot
        except ImportError as error:
            raise ImportError("plot needs matplotlib, which is not installed: pip install matplotlib") from error
        axes = pyplot.subplots(layout="constrained")[1]
    named = set()
    for stable, piece in _pieces(points):
        dashes, name = _LINES[stable]
        label = None if name in named else name
        named.add(name)
        axes.plot(across[piece], up[piece], lw=1.5, color="#0072B2", ls=dashes, label=label, zorder=1)
    labels = [point.label for point in points]
    for label in dict.fromkeys(filter(None, labels)):
        here = [i for i, other in enumerate(labels) if other == label]
        marker, colour = _MARKS.get(label, _OTHER_MARK)
        area = _AREA.get(marker, _AREA[""])
        axes.scatter(across[here], up[here], s=area, marker=marker, color=colour, label=label, zorder=2)
    axes.set(xlabel=x, ylabel=y)
    if any(labels) or named - {None}:
        axes.legend(frameon=False)
    return axes


def _pieces(points: Sequence[Point]) -> Iterator[tuple[bool | None, slice]]:
    """Cut a branch where its stability changes; without any index, there is one piece.

    Yields
    ------
    stable : bool or None
        Whether the energy has a minimum on the piece; None where no point has an index, or the ends of a step disagree.
    piece : slice
        Points of the piece; its ends belong to the pieces beside it too.
    """
    if len(points) < 2 or all(point.index is None for point in points):
        yield None, slice(None)
        return
    first = 0
    for stable, steps in groupby(map(_stable, *zip(*pairwise(points)))):
        last = first + len(list(steps))
        yield stable, slice(first, last + 1)
        first = last


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
    """Return a parameter, a functional, ``"arclength"`` or ``"norm"`` over all points.

    The norm is the root mean square of the states over the nodes.
    """
    if points and (name in points[0].parameters or name in points[0].functionals):
        return np.array([point[name] for point in points])
    if name == "arclength":
        return np.array([point.arclength for point in points])
    return np.array([np.sqrt(np.mean(np.sum(point.system.states(point.x) ** 2, axis=1))) for point in points])


def _columns(points: Sequence[Point], x: str | None, y: str | None) -> tuple[str, str]:
    """Return the names of the two columns to draw, with the defaults of `plot`."""
    if not points:
        raise ProblemError("the branch has no points to draw")
    first = points[0]
    known = [*first.parameters, *first.functionals, "arclength", "norm"]
    x = first.system.free[0] if x is None else x
    y = next(iter(first.functionals), "norm") if y is None else y
    for argument, name in (("x", x), ("y", y)):
        if name not in known:
            raise ProblemError(f"{argument}: {checks.shown(name)} is no column; there are {', '.join(known)}")
    return x, y
