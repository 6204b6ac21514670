"""Labels of special points: their words, what they are in diagrams and on pages, and their marks in pictures. The one place."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from contin.lowlevel import Colour, levels

#: Colours of marks, all with black edges. Those of folds and bifurcations are of no wavenumber (`branches.draw.style`);
#: yellow is Okabe & Ito's, too pale for lines.
FOLD, END, USER, SECONDARY = Colour.YELLOW, Colour.BLACK, Colour.GREEN, "#BBBBBB"


@dataclass(frozen=True)
class Label:
    """One of AUTO's labels, or ours.

    Attributes
    ----------
    word : str
        In summaries.
    kind : str
        Of a point that no name tells more of; see `kind_of`.
    marker, colour, size :
        In pictures of one branch, as matplotlib takes them.
    told : bool
        Whether pictures write the value of the number that is followed beside it.
    singular : bool
        Whether the index is undecided there, and the place is found, not given: it has an error.
    """

    word: str
    kind: str
    marker: str
    colour: str
    size: int
    told: bool = False
    singular: bool = False


LABELS = {
    "LP": Label("fold", "fold", "*", FOLD, 170, told=True, singular=True),
    "BP": Label("branch point", "branch point", "o", END, 45, singular=True),
    "SB": Label("secondary bifurcation", "secondary bifurcation", "D", SECONDARY, 40, singular=True),
    "BC": Label("contact", "contact", "v", USER, 40, singular=True),
    "UZ": Label("user value", "user value", "D", USER, 40),
    "EP": Label("end", "end", "o", END, 45),
    "MX": Label("end", "lost", "x", END, 40),
}
#: The name of the first point of a run.
START = "start"
#: The name of an end on a circle.
TRIVIAL = "trivial branch"
#: The name of an end where a secondary branch meets a primary one.
PRIMARY = "primary branch"
#: Labels of points at which the pieces of a branch begin and end.
SPECIAL = ("LP", "BP", "SB", "BC", "EP", "MX")
#: Marks of kinds in diagrams: marker, colour, size, words; the words of an end are those of its point.
MARKS = {
    "circle": ("o", END, 16, "bifurcation of a circle"), "fold": ("*", FOLD, 110, "fold"),
    "secondary bifurcation": ("D", SECONDARY, 26, "secondary bifurcation"), "end": ("x", END, 36, "a line ends: {}"),
}  # fmt: skip
#: Kinds as the explorer page knows them; the others are 'end'.
ON_PAGE = {
    "circle": "circle", "fold": "fold", "secondary bifurcation": "secondary", PRIMARY: "secondary",
    "user value": "user", "lost": "lost", "leaves": "limit",
}  # fmt: skip


def label_of(text: str) -> Label:
    """The label of these letters; that of an end for letters of another version."""
    return LABELS.get(text, LABELS["EP"])


def begins(event: np.void) -> bool:
    """Return whether a row of the table of labelled points is that of the first point of a run."""
    return bool(event["name"] == START.encode())


def kind_of(label: str, name: str, reason: str, secondary: bool) -> str:
    """Return what a labelled point is in a diagram; ``reason`` says why its run stopped."""
    if name == START:
        return "secondary bifurcation" if secondary else "circle"
    if name == TRIVIAL:
        return "circle"
    if name == PRIMARY:
        return name
    kind = label_of(label).kind
    return "leaves" if kind == "end" and reason == "limit" else kind


def without_round_off(value: float, largest: float) -> float:
    """Return a value of a stage, 0 where it is round-off; ``largest`` is the largest one of the stage."""
    return 0.0 if abs(value) <= levels.CORRECTED * abs(largest) else value
