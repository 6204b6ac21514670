"""New axes to draw on, by matplotlib (which is imported when it is asked for)."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

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
