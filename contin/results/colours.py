"""The colours of all pictures: those of Okabe and Ito (2008), which people with any kind of colour vision tell apart."""

from __future__ import annotations

import enum


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
