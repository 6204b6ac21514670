"""Axes, colours and marks of pictures, and the words for labels."""

from __future__ import annotations

import enum
from typing import TYPE_CHECKING, Any

from contin.results.record import Record

if TYPE_CHECKING:  # matplotlib is imported where it draws only
    from matplotlib.axes import Axes as Axes
else:
    Axes = object


def new_axes(count: int = 1) -> Any:
    """Return the axes of a new figure: one, or an array of some, side by side.

    Raises
    ------
    ImportError
        matplotlib is not installed.
    """
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
    "EP": (".", Colour.BLACK, "end"),
    "LP": ("*", Colour.VERMILION, "fold"),
    "BP": ("o", Colour.BLACK, "branch point"),
    "HB": ("s", Colour.GREEN, "Hopf point"),
    "UZ": ("D", Colour.PURPLE, "given value"),
    "EX": ("s", Colour.VERMILION, "extremum"),
    "PD": ("X", Colour.BLUE, "period doubling"),
    "TR": ("h", Colour.SKY, "torus bifurcation"),
    "MX": ("x", Colour.BLACK, "Newton's method failed"),
    "CP": ("^", Colour.VERMILION, "cusp"),
    "BT": ("v", Colour.BLACK, "Bogdanov-Takens point"),
    "ZH": ("<", Colour.ORANGE, "zero-Hopf point"),
    "HH": (">", Colour.SKY, "double Hopf point"),
    "GH": ("P", Colour.GREEN, "generalized Hopf point"),
    "GPD": ("P", Colour.BLUE, "generalized period doubling"),
    "CH": ("P", Colour.SKY, "Chenciner point"),
    "LPPD": ("d", Colour.VERMILION, "fold-flip point"),
    "LPTR": ("d", Colour.SKY, "fold-torus point"),
    "R1": ("p", Colour.ORANGE, "resonance 1:1"),
    "R2": ("p", Colour.PURPLE, "resonance 1:2"),
    "R3": ("p", Colour.BLUE, "resonance 1:3"),
    "R4": ("p", Colour.GREEN, "resonance 1:4"),
}
_OTHER = (".", Colour.BLACK, "")


def mark_of(label: str) -> tuple[str, Colour, str]:
    """Return the symbol, the colour and the word of a label; "" for a word that there is not."""
    return _MARKS.get(label, _OTHER)


def heading(point: Record) -> str:
    """Return the label of a point with its word, and the name; "" for a regular point."""
    word = mark_of(point.label)[2]
    return " ".join(filter(None, (point.label, f"({word})" if word else "", point.name)))
