"""What the pictures of `branches.paper` share: colours that survive colour blindness and a grey printer, and saving."""

from __future__ import annotations

import io
from pathlib import Path

from branches.files import write_bytes, write_picture

STABLE, UNSTABLE, MODES, RIGID = "#0072B2", "#D55E00", "#8a6d3b", "#000000"
UNSTABLE_FILL = "#F3B48B"


def pyplot():
    """matplotlib.pyplot without a display, with SVG text as text and the same bytes from the same numbers."""
    import matplotlib

    matplotlib.use("Agg")
    matplotlib.rcParams.update({"svg.fonttype": "none", "svg.hashsalt": "branches.paper", "font.size": 10})
    import matplotlib.pyplot as plt

    return plt


def keep(figure, folder: Path, name: str) -> str:
    """Write a figure of no display as name.png and name.svg; the name. Raises `branches.files.StoreError`."""
    for suffix in (".png", ".svg"):
        write_picture(figure, folder / f"{name}{suffix}")
    return name


def save(figure, folder: Path, name: str) -> str:
    """Write name.png and name.svg; the name. Raises `branches.files.StoreError`."""
    for suffix, more in ((".png", {"dpi": 150}), (".svg", {"dpi": 200, "metadata": {"Date": None}})):
        picture = io.BytesIO()
        figure.savefig(picture, format=suffix[1:], **more)
        write_bytes(folder / f"{name}{suffix}", picture.getvalue())
    pyplot().close(figure)
    return name
