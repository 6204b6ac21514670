"""The points of a branch as a table: for pandas (which is imported when it is asked for), and for a notebook."""

from __future__ import annotations

import html
from collections.abc import Sequence
from typing import Any

from contin.results.curve import column
from contin.results.plot import picture
from contin.results.point import Point

#: Labelled points that the table of a notebook lists: about a screen. The others are counted.
_MOST_ROWS = 20


def to_pandas(points: Sequence[Point]) -> Any:
    """Return all points as a ``pandas.DataFrame``; see `contin.Branch.to_pandas`."""
    try:
        import pandas
    except ImportError as error:
        raise ImportError("to_pandas needs pandas, which is not installed: pip install pandas") from error
    rows = [
        {
            "label": point.label, "name": point.name, "arclength": point.arclength, "intervals": point.system.intervals,
            "degree": point.system.degree, "iterations": point.iterations, "discretization_error": point.discretization_error,
            **({} if point.index is None else {"index": point.index}),
            **({} if point.normal_form is None else {"normal_form": point.normal_form}), **point.parameters,
            **point.functionals,
        }
        for point in points
    ]  # fmt: skip
    return pandas.DataFrame(rows).assign(norm=column(points, "norm"))


def meshes(points: Sequence[Point]) -> str:
    """Return the numbers of intervals of a branch and their degree, as text; nothing where there is no mesh."""
    counts = [point.system.intervals for point in points]
    if not any(counts):
        return ""
    fewest, most = min(counts), max(counts)
    between = f"{most}" if fewest == most else f"{fewest} to {most}"
    return f" on {between} interval{'s' * (most != 1)} of degree {points[0].system.degree}"


def to_html(points: Sequence[Point], stop: object, notes: Sequence[str] = ()) -> str:
    """Return a branch for a notebook: a picture where it can be drawn, labelled points, notes, and why the run ended."""
    count, ended = len(points), f"; {html.escape(str(stop))}" if stop else ""
    parts = [f"<p><b>Branch</b> of {count} point{'s' * (count != 1)}{meshes(points)}{ended}</p>"]
    if points:
        parts += [picture(points), _table(points)]
    parts += [f"<p>{html.escape(note)}</p>" for note in notes]
    return f"<div>{''.join(parts)}</div>"


def _table(points: Sequence[Point]) -> str:
    first = points[0]
    columns = list(dict.fromkeys([*first.system.free, *first.functionals]))
    special = [(number, point) for number, point in enumerate(points) if point.label]
    rows = "".join(
        f"<tr><td>{number}</td><td>{html.escape(point.label)}</td><td>{html.escape(point.name)}</td>"
        + "".join(f"<td>{point[name]:.8g}</td>" for name in columns)
        + "</tr>"
        for number, point in special[:_MOST_ROWS]
    )
    head = "".join(f"<th>{html.escape(name)}</th>" for name in ("point", "label", "name", *columns))
    more = f"<p>and {len(special) - _MOST_ROWS} more labelled points</p>" if len(special) > _MOST_ROWS else ""
    return f"<table><thead><tr>{head}</tr></thead><tbody>{rows}</tbody></table>{more}"
