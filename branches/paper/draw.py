"""What the pictures of `branches.paper` share: colours that survive colour blindness and a grey printer, and saving."""

from __future__ import annotations

from pathlib import Path

from branches.store.files import write_picture
from contin.lowlevel import Colour

STABLE, UNSTABLE, MODES, RIGID = Colour.BLUE, Colour.VERMILION, "#8a6d3b", Colour.BLACK
UNSTABLE_FILL = "#F3B48B"
#: Stable states that are buckled, beside stable circles.
BUCKLED = Colour.SKY


def keep(figure, folder: Path, name: str) -> str:
    """Write a figure of no display as name.png and name.svg; the name. Raises `branches.store.files.StoreError`."""
    for suffix in (".png", ".svg"):
        write_picture(figure, folder / f"{name}{suffix}")
    return name
