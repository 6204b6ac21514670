"""Labels in pictures and tables: their marks and their words."""

from __future__ import annotations

from contin.results.colours import Colour
from contin.results.record import Record

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
