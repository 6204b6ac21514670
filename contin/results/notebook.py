"""What a notebook shows of a branch: its curve, its labelled points, and all points as a table.

matplotlib and pandas are imported when they are asked for, never with `contin`.
"""

from __future__ import annotations

import html
import io
from typing import Any

import numpy as np

from contin import checks
from contin.arrays import Array
from contin.errors import ProblemError
from contin.results.branch import Branch

#: Marks of labelled points: matplotlib's symbol and colour (Okabe-Ito: told apart by the colour-blind).
_MARKS = {
    "LP": ("*", "#D55E00"), "BP": ("o", "#000000"), "HB": ("s", "#009E73"), "UZ": ("D", "#CC79A7"), "CP": ("^", "#D55E00"),
}  # fmt: skip
_OTHER_MARK = (".", "#000000")
#: More labelled points than this are counted in the table of a notebook, not listed.
_MOST_ROWS = 20


def to_pandas(branch: Branch) -> Any:
    """All points as a ``pandas.DataFrame``, a row a point, in order.

    Columns: ``label``, ``name``, ``arclength``, ``intervals``, ``iterations``, all parameters, all functionals, and ``norm``.

    Raises
    ------
    ImportError
        pandas is not installed.
    """
    try:
        import pandas
    except ImportError as error:
        raise ImportError("to_pandas needs pandas, which is not installed: pip install pandas") from error
    rows = [
        {
            "label": point.label, "name": point.name, "arclength": point.arclength, "intervals": point.system.intervals,
            "iterations": point.iterations, **point.parameters, **point.functionals,
        }
        for point in branch.points
    ]  # fmt: skip
    return pandas.DataFrame(rows).assign(norm=_column(branch, "norm"))


def plot(branch: Branch, x: str | None = None, y: str | None = None, axes: Any = None) -> Any:
    """Draw one column against another, with marks at labelled points.

    Parameters
    ----------
    x, y : str, optional
        A parameter, a functional, ``"arclength"`` or ``"norm"`` (root mean square of the states over the nodes). By default the
        first free parameter, and the first functional (``"norm"`` where there is none).
    axes : matplotlib.axes.Axes, optional
        Where to draw; a figure of its own without.

    Returns
    -------
    matplotlib.axes.Axes

    Raises
    ------
    ProblemError
        A column that the branch does not have, or no points.
    ImportError
        matplotlib is not installed.
    """
    x, y = _columns(branch, x, y)
    across, up = _column(branch, x), _column(branch, y)
    if axes is None:
        try:
            from matplotlib import pyplot
        except ImportError as error:
            raise ImportError("plot needs matplotlib, which is not installed: pip install matplotlib") from error
        axes = pyplot.subplots(layout="constrained")[1]
    axes.plot(across, up, lw=1.5, color="#0072B2", zorder=1)
    labels = [point.label for point in branch.points]
    for label in dict.fromkeys(filter(None, labels)):
        here = [i for i, other in enumerate(labels) if other == label]
        marker, colour = _MARKS.get(label, _OTHER_MARK)
        axes.scatter(across[here], up[here], s=90 if marker == "*" else 30, marker=marker, color=colour, label=label, zorder=2)
    axes.set(xlabel=x, ylabel=y)
    if any(labels):
        axes.legend(frameon=False)
    return axes


def to_html(branch: Branch) -> str:
    """The branch in a notebook: where it can be drawn a picture, then the labelled points, and why the run ended."""
    count, stop = len(branch.points), f"; {html.escape(str(branch.stop))}" if branch.stop else ""
    parts = [f"<p><b>Branch</b> of {count} point{'s' * (count != 1)}{stop}</p>"]
    if branch.points:
        parts += [_picture(branch), _table(branch)]
    return f"<div>{''.join(parts)}</div>"


def _picture(branch: Branch) -> str:
    """The plot as SVG, or nothing where matplotlib is not installed."""
    try:
        from matplotlib import rc_context
        from matplotlib.figure import Figure
    except ImportError:
        return ""
    text = io.StringIO()
    with rc_context({"svg.hashsalt": "contin"}):
        figure = Figure(figsize=(4.5, 2.8), layout="constrained")
        plot(branch, axes=figure.subplots())
        figure.savefig(text, format="svg", metadata={"Date": None})
    return text.getvalue()[text.getvalue().index("<svg") :]


def _table(branch: Branch) -> str:
    first = branch.points[0]
    columns = list(dict.fromkeys([*first.system.free, *first.functionals]))
    special = [(number, point) for number, point in enumerate(branch.points) if point.label]
    rows = "".join(
        f"<tr><td>{number}</td><td>{html.escape(point.label)}</td><td>{html.escape(point.name)}</td>"
        + "".join(f"<td>{point[name]:.8g}</td>" for name in columns)
        + "</tr>"
        for number, point in special[:_MOST_ROWS]
    )
    head = "".join(f"<th>{html.escape(name)}</th>" for name in ("point", "label", "name", *columns))
    more = f"<p>and {len(special) - _MOST_ROWS} more labelled points</p>" if len(special) > _MOST_ROWS else ""
    return f"<table><thead><tr>{head}</tr></thead><tbody>{rows}</tbody></table>{more}"


def _columns(branch: Branch, x: str | None, y: str | None) -> tuple[str, str]:
    """The two columns to draw, with the defaults of `plot`."""
    if not branch.points:
        raise ProblemError("the branch has no points to draw")
    first = branch.points[0]
    known = [*first.parameters, *first.functionals, "arclength", "norm"]
    x = first.system.free[0] if x is None else x
    y = next(iter(first.functionals), "norm") if y is None else y
    for argument, name in (("x", x), ("y", y)):
        if name not in known:
            raise ProblemError(f"{argument}: {checks.shown(name)} is no column; there are {', '.join(known)}")
    return x, y


def _column(branch: Branch, name: str) -> Array:
    points = branch.points
    if points and (name in points[0].parameters or name in points[0].functionals):
        return branch.column(name)
    if name == "arclength":
        return np.array([point.arclength for point in points])
    return np.array([np.sqrt(np.mean(np.sum(point.system.states(point.x) ** 2, axis=1))) for point in points])
