"""The display of a stored branch in a notebook: its curve and its labelled points."""

from __future__ import annotations

import html
import io

from contin import exact_text
from ribbon_model.laws import label

_COLUMNS = ("point", "label", "name", "kappa_n", "kappa_star", "energy")


def to_html(branch) -> str:
    """Return a `branches.read.StoredBranch` as HTML: name, reason of its end, picture, labelled points."""
    config, picture = branch.config, io.StringIO()
    branch.plot(shapes=0).savefig(picture, format="svg")
    svg = picture.getvalue()[picture.getvalue().index("<svg") :]
    about = f"{label(config['law'], config['Gamma'])}, (m, n) = ({config['m']}, {config['n']}), nu = {exact_text(config['nu'])}"
    stop = html.escape(branch.stop or branch.status)
    head = "".join(f"<th>{name}</th>" for name in _COLUMNS)
    rows = "".join(f"<tr>{''.join(map(_cell, event))}</tr>" for event in branch.events[list(_COLUMNS)].tolist())
    return (
        f"<div><p><b>{about}</b>: {len(branch.points)} points; {stop}</p>{svg}"
        f"<table><thead><tr>{head}</tr></thead><tbody>{rows}</tbody></table></div>"
    )


def _cell(value) -> str:
    if isinstance(value, bytes):
        return f"<td>{html.escape(value.decode())}</td>"
    return f"<td>{value:.10f}</td>" if isinstance(value, float) else f"<td>{value}</td>"
