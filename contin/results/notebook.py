"""What a notebook shows of a point, and tables in HTML."""

from __future__ import annotations

import html
from collections.abc import Sequence

from contin.results.marks import heading
from contin.results.record import Record
from contin.text import ROWS


def point_to_html(point: Record) -> str:
    """Return a point for a notebook: its label, and its columns with the errors that are known."""
    states = point.system.named_states
    columns = {**point.parameters, **point.functionals}
    columns |= dict(zip(states, map(float, point.system.states(point.x)[0]))) if states else {}
    rows = [
        (name, f"{value:.10g}", f"{point.errors[name]:.0e}" if name in point.errors else "") for name, value in columns.items()
    ]
    index = f"; index {point.index}" if point.index is not None else ""
    head = html.escape(f"{': ' * bool(point.label)}{heading(point)}{index}")
    return f"<div><p><b>Point</b>{head}</p>{html_table(('column', 'value', 'error'), rows)}</div>"


def html_table(head: Sequence[str], rows: Sequence[Sequence[str]], what: str = "rows") -> str:
    """Return a table that fits on a screen; rows beyond it are counted."""
    names = "".join(f"<th>{html.escape(name)}</th>" for name in head)
    body = "".join(f"<tr>{''.join(f'<td>{html.escape(cell)}</td>' for cell in row)}</tr>" for row in rows[:ROWS])
    more = f"<p>and {len(rows) - ROWS} more {what}</p>" if len(rows) > ROWS else ""
    return f"<table><thead><tr>{names}</tr></thead><tbody>{body}</tbody></table>{more}"
