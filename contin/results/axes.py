"""New axes to draw on, by matplotlib (which is imported when it is asked for)."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, Protocol, runtime_checkable


@runtime_checkable
class Axes(Protocol):
    """What is asked of matplotlib's axes, on which pictures are drawn."""

    @property
    def plot(self) -> Callable[..., Any]:
        """Draw lines."""

    @property
    def scatter(self) -> Callable[..., Any]:
        """Draw marks."""

    @property
    def annotate(self) -> Callable[..., Any]:
        """Write a text, or draw an arrow."""

    @property
    def axvline(self) -> Callable[..., Any]:
        """Draw a vertical line."""

    @property
    def legend(self) -> Callable[..., Any]:
        """Add the legend."""

    @property
    def margins(self) -> Callable[..., Any]:
        """Set margins."""

    @property
    def set(self) -> Callable[..., Any]:
        """Set properties."""

    @property
    def get_legend_handles_labels(self) -> Callable[..., Any]:
        """Return what the legend shows, and its names."""


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
