"""What the pictures of `branches.paper` share: colours that survive colour blindness and a grey printer, and saving."""

from __future__ import annotations

from pathlib import Path

from branches.store.files import write_picture

STABLE, UNSTABLE, MODES, RIGID = "#0072B2", "#D55E00", "#8a6d3b", "#000000"
UNSTABLE_FILL = "#F3B48B"
#: Stable states that are buckled, beside stable circles.
BUCKLED = "#56B4E9"


def keep(figure, folder: Path, name: str) -> str:
    """Write a figure of no display as name.png and name.svg; the name. Raises `branches.files.StoreError`."""
    for suffix in (".png", ".svg"):
        write_picture(figure, folder / f"{name}{suffix}")
    return name
