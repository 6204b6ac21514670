"""What pictures and notebooks show of a point: axes, colours, marks, the words for labels, and tables in HTML."""

from __future__ import annotations

import enum
import html
from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

from contin.results.record import Record
from contin.text import ROWS

if TYPE_CHECKING:  # matplotlib is imported where it draws only
    from matplotlib.axes import Axes as Axes
else:
    Axes = object


def new_axes(count: int = 1) -> Any:
    """Return the axes of a new figure, one or an array side by side; raise ImportError where matplotlib is not installed."""
    try:
        from matplotlib import pyplot
    except ImportError as error:
        raise ImportError("plot needs matplotlib, which is not installed: pip install matplotlib") from error
    if count == 1:
        return pyplot.subplots(layout="constrained")[1]
    return pyplot.subplots(1, count, layout="constrained", figsize=(4.2 * count, 3.8))[1]


class Colour(enum.StrEnum):
    """A colour of a picture; each is a string that matplotlib takes. Grey is for what is beside the point.

    Examples
    --------
    >>> str(Colour.BLUE)
    '#0072B2'
    """

    BLUE = "#0072B2"
    VERMILION = "#D55E00"
    GREEN = "#009E73"
    PURPLE = "#CC79A7"
    ORANGE = "#E69F00"
    SKY = "#56B4E9"
    YELLOW = "#F0E442"
    BLACK = "#000000"
    GREY = "#767676"


#: Colours of lines, in the order in which pictures take them. A line of yellow is hard to see on white paper.
PALETTE = (
    Colour.BLUE, Colour.VERMILION, Colour.GREEN, Colour.PURPLE, Colour.ORANGE, Colour.SKY, Colour.BLACK,
)  # fmt: skip


#: Labelled points: matplotlib's symbol, colour, and the words of the legend.
_MARKS = {
    "EP": (".", Colour.BLACK, "end"), "LP": ("*", Colour.VERMILION, "fold"), "BC": ("v", Colour.VERMILION, "corner"),
    "GR": ("v", Colour.PURPLE, "grazing"), "SL": ("v", Colour.GREEN, "sliding"), "BP": ("o", Colour.BLACK, "branch point"),
    "HB": ("s", Colour.GREEN, "Hopf point"), "UZ": ("D", Colour.PURPLE, "given value"),
    "EX": ("s", Colour.VERMILION, "extremum"), "PD": ("X", Colour.BLUE, "period doubling"),
    "TR": ("h", Colour.SKY, "torus bifurcation"), "MX": ("x", Colour.BLACK, "Newton's method failed"),
    "CP": ("^", Colour.VERMILION, "cusp"), "BT": ("v", Colour.BLACK, "Bogdanov-Takens point"),
    "ZH": ("<", Colour.ORANGE, "zero-Hopf point"), "HH": (">", Colour.SKY, "double Hopf point"),
    "GH": ("P", Colour.GREEN, "generalized Hopf point"), "GPD": ("P", Colour.BLUE, "generalized period doubling"),
    "CH": ("P", Colour.SKY, "Chenciner point"), "LPPD": ("d", Colour.VERMILION, "fold-flip point"),
    "LPTR": ("d", Colour.SKY, "fold-torus point"), "R1": ("p", Colour.ORANGE, "resonance 1:1"),
    "R2": ("p", Colour.PURPLE, "resonance 1:2"), "R3": ("p", Colour.BLUE, "resonance 1:3"),
    "R4": ("p", Colour.GREEN, "resonance 1:4"),
}  # fmt: skip
_OTHER = (".", Colour.BLACK, "")


def mark_of(label: str) -> tuple[str, Colour, str]:
    """Return the symbol, the colour and the word of a label; "" for a word that there is not."""
    return _MARKS.get(label, _OTHER)


def heading(point: Record) -> str:
    """Return the label of a point with its word, and the name; "" for a regular point."""
    word = mark_of(point.label)[2]
    return " ".join(filter(None, (point.label, f"({word})" if word else "", point.name)))


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
