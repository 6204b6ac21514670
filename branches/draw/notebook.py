"""The display of a stored branch in a notebook: its curve and its labelled points."""

from __future__ import annotations

import html
import io

#: Labelled points that the table lists: about a screen. The others are counted.
MOST_ROWS = 20


def to_html(branch) -> str:
    """Return a `branches.read.StoredBranch` as HTML: name, reason of its end, picture, labelled points."""
    picture = io.StringIO()
    branch.plot(shapes=0).savefig(picture, format="svg")
    svg = picture.getvalue()[picture.getvalue().index("<svg") :]
    stop = html.escape(branch.stop or branch.status)
    table = {key: values[branch.events["point"]].tolist() for key, values in branch.in_units().items()}
    titles = {key.partition(" [")[0]: key for key in table}  # with units
    columns = {}
    for name in branch.shown:
        columns[titles.get(name, name)] = table[titles[name]] if name in titles else branch.events[name].tolist()
    head = "".join(f"<th>{html.escape(title)}</th>" for title in columns)
    events = [*zip(*columns.values())]
    rows = "".join(f"<tr>{''.join(map(_cell, event))}</tr>" for event in events[:MOST_ROWS])
    more = f"<p>and {len(events) - MOST_ROWS} more labelled points</p>" if len(events) > MOST_ROWS else ""
    return (
        f"<div><p><b>{html.escape(branch.about)}</b>: {len(branch.points)} points; {stop}</p>{svg}"
        f"<table><thead><tr>{head}</tr></thead><tbody>{rows}</tbody></table>{more}</div>"
    )


def _cell(value) -> str:
    text = value.decode() if isinstance(value, bytes) else str(value)
    return f"<td>{value:.10g}</td>" if isinstance(value, float) else f"<td>{html.escape(text)}</td>"
