"""Points and branches: plain data, and looking things up in it."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from contin.arrays import Array
from contin.results.point import Point
from contin.stepping.state import Stop


@dataclass
class Branch:
    """The points of one branch in order, and why it stopped."""

    points: list[Point] = field(default_factory=list)
    stop: Stop | None = None

    def __len__(self) -> int:
        return len(self.points)

    def __iter__(self) -> Iterator[Point]:
        return iter(self.points)

    def column(self, name: str) -> Array:
        """A parameter or functional over all points."""
        return np.array([point[name] for point in self.points])

    def labelled(self, label: str) -> list[Point]:
        """The points that carry a label, in order."""
        return [point for point in self.points if point.label == label]

    def to_pandas(self) -> Any:
        """All points as a ``pandas.DataFrame``; see `contin.notebook.to_pandas`."""
        from contin.results import notebook

        return notebook.to_pandas(self)

    def plot(self, x: str | None = None, y: str | None = None, axes: Any = None) -> Any:
        """One column against another, by matplotlib; see `contin.notebook.plot`."""
        from contin.results import notebook

        return notebook.plot(self, x, y, axes)

    def _repr_html_(self) -> str:
        from contin.results import notebook

        return notebook.to_html(self)
