"""The display of a stored branch in a notebook: its curve and its labelled points."""

from __future__ import annotations

import html
import io


def to_html(branch) -> str:
    """Return a `branches.read.StoredBranch` as HTML: name, reason of its end, picture, labelled points."""
    picture = io.StringIO()
    branch.plot(shapes=0).savefig(picture, format="svg")
    svg = picture.getvalue()[picture.getvalue().index("<svg") :]
    stop = html.escape(branch.stop or branch.status)
    head = "".join(f"<th>{name}</th>" for name in branch.shown)
    rows = "".join(f"<tr>{''.join(map(_cell, event))}</tr>" for event in branch.events[list(branch.shown)].tolist())
    return (
        f"<div><p><b>{html.escape(branch.about)}</b>: {len(branch.points)} points; {stop}</p>{svg}"
        f"<table><thead><tr>{head}</tr></thead><tbody>{rows}</tbody></table></div>"
    )


def _cell(value) -> str:
    if isinstance(value, bytes):
        return f"<td>{html.escape(value.decode())}</td>"
    return f"<td>{value:.10f}</td>" if isinstance(value, float) else f"<td>{value}</td>"
