"""What all pictures share: colours, dashes, words and smooth curves."""

from __future__ import annotations

from typing import Any

import numpy as np

from contin.lowlevel import Colour, exact_text, through

#: A colour for each wavenumber. The seventh is of Tol's set: Okabe and Ito's seventh is yellow.
_COLOURS = {
    1: Colour.PURPLE, 2: Colour.BLUE, 3: Colour.GREEN, 4: Colour.VERMILION, 5: Colour.SKY, 6: Colour.ORANGE, 7: "#882255",
}  # fmt: skip
OTHER = "#444444"
#: Smallest texts and lines of narrow pictures, as a part of the usual ones: text of 11 points has 7, which journals allow.
_SMALLEST = 0.65
#: Dashes and legend of pieces in all pictures, by whether they are stable; None: not known.
LINES: dict[bool | None, tuple[Any, str]] = {
    True: ("-", "stable"), False: ((0, (4, 2)), "unstable"), None: ("-", "stability not computed"),
}  # fmt: skip
#: Dashes of pieces of unknown stability beside others of which it is known: solid would say that they are stable.
UNKNOWN = (0, (6, 2, 1, 2))
NU, NATURAL, CONJUGATE = r"$\nu$", r"natural curvature $\kappa_n L/2\pi$", r"conjugate curvature $\kappa^*$"


def colour_of(n: int) -> str:
    """The colour of a wavenumber."""
    return _COLOURS.get(n, OTHER)


def points(size: float) -> float:
    """Return the size of a text, or the width of a line, in the picture that is drawn: the given one where font.size is 10."""
    from matplotlib import rcParams

    return size * rcParams["font.size"] / 10


def area(size: float) -> float:
    """Return the area of a mark in the picture that is drawn."""
    return size * points(1) ** 2


def narrowed(part: float):
    """Return the context in which a picture of this part of its usual width is drawn: its texts and lines are smaller."""
    from matplotlib import rc_context

    return rc_context({"font.size": points(10 * min(1.0, max(_SMALLEST, part)))})


def in_words(number: float | str) -> str:
    """A number as text in a picture, with a minus sign."""
    return (number if isinstance(number, str) else exact_text(number)).replace("-", "\u2212")


def smooth(s, *columns) -> list[np.ndarray]:
    """Return smooth curves through computed points, as cubics over the arclength of the continuation.

    Result files hold no tangents: those of cubic splines stand for them. On the branches (1, 2) and (3, 5) and on the stages of
    configs/open_clamped.yaml the curves are off by up to 2e-4 of the range of a column, straight lines by 5e-3.
    """
    from scipy.interpolate import CubicSpline

    s, keep = np.unique(s, return_index=True)
    values = np.array([np.asarray(column)[keep] for column in columns], dtype=float)
    if len(s) < 4:
        return list(through(s, values, np.full_like(values, np.nan)))
    return list(through(s, values, CubicSpline(s, values, axis=1)(s, 1)))
