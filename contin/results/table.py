"""The points of a branch as a table: for pandas (which is imported when it is asked for), and for a notebook."""

from __future__ import annotations

import html
from collections import Counter
from collections.abc import Callable, Sequence
from typing import Any

from contin.results.marks import html_table
from contin.results.plot import column, picture, plot
from contin.results.point import Point


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
        parts += [picture(lambda axes: plot(points, axes=axes)), _of_labelled(points)]
    return f"<div>{''.join(parts)}{_paragraphs(notes)}</div>"


def diagram_to_html(
    branches: Sequence[tuple[Sequence[Point], object]], junctions: int, draw: Callable[[Any], Any], notes: Sequence[str] = ()
) -> str:  # fmt: skip
    """Return a diagram for a notebook: a picture where it can be drawn, a row a branch (points, why it ends), notes."""
    count = len(branches)
    head = f"<p><b>Diagram</b> of {count} branch{'es' * (count != 1)} and {junctions} junction{'s' * (junctions != 1)}</p>"
    rows = [(f"{i}", f"{len(points)}", _labels(points), str(stop or "not ended")) for i, (points, stop) in enumerate(branches)]
    drawn = picture(draw) if any(points for points, _ in branches) else ""
    return f"<div>{head}{drawn}{html_table(('branch', 'points', 'labels', 'end'), rows)}{_paragraphs(notes)}</div>"


def _paragraphs(notes: Sequence[str]) -> str:
    return "".join(f"<p>{html.escape(note)}</p>" for note in notes)


def _labels(points: Sequence[Point]) -> str:
    """Return how many labelled points of each kind there are, as text."""
    counts = Counter(point.label for point in points if point.label)
    return ", ".join(f"{count} {label}" for label, count in counts.items())


def _of_labelled(points: Sequence[Point]) -> str:
    first = points[0]
    columns = list(dict.fromkeys([*first.system.free, *first.functionals]))
    special = [(number, point) for number, point in enumerate(points) if point.label]
    rows = [(f"{i}", point.label, point.name, *(f"{point[name]:.8g}" for name in columns)) for i, point in special]
    return html_table(("point", "label", "name", *columns), rows, "labelled points")
