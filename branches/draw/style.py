"""What all pictures share: colours, dashes, words and smooth curves."""

from __future__ import annotations

import numpy as np

from contin.lowlevel import exact_text

#: A colour for each wavenumber, of Okabe-Ito's and Tol's sets: told apart by the colour-blind.
_COLOURS = {1: "#CC79A7", 2: "#0072B2", 3: "#009E73", 4: "#D55E00", 5: "#56B4E9", 6: "#E69F00", 7: "#882255"}
OTHER = "#444444"
#: Dashes and legend of pieces in all pictures, by whether they are stable; None: not known.
LINES = {True: ("-", "stable"), False: ((0, (4, 2)), "unstable"), None: ("-", None)}
NATURAL, CONJUGATE = r"natural curvature $\kappa_n L/2\pi$", r"conjugate curvature $\bar\kappa^*$"


def colour_of(n: int) -> str:
    """The colour of a wavenumber."""
    return _COLOURS.get(n, OTHER)


def in_words(number: float | str) -> str:
    """A number as text in a picture, with a minus sign."""
    return (number if isinstance(number, str) else exact_text(number)).replace("-", "\u2212")


def smooth(s, *columns) -> list[np.ndarray]:
    """Smooth curves through computed points: cubic splines over the arclength of the continuation, ten steps a point."""
    from scipy.interpolate import CubicSpline

    s, keep = np.unique(s, return_index=True)
    columns = np.array([np.asarray(column)[keep] for column in columns])
    if len(s) < 4:
        return list(columns)
    fine = np.interp(np.arange(0, len(s) - 0.9, 0.1), np.arange(len(s)), s)
    return list(CubicSpline(s, columns, axis=1)(fine))
