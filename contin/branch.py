"""Points and branches: plain data, and looking things up in it."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from contin.interface import Array, Discretization


@dataclass(frozen=True, eq=False)
class Point:
    """One solution on a branch.

    Attributes
    ----------
    label : str
        AUTO's two letters: EP end, LP fold (limit point), BP branch point, UZ user zero, MX failed; "" for a regular point.
    name : str
        What the label refers to (the monitor's name), "" for a regular point.
    parameters, functionals : mapping of str to float
        All parameters; the problem's functionals.
    x, tangent : ndarray, shape (size,)
        Unknowns of ``system``, and the unit tangent (``nan`` at a branch point, which has several).
    system : Discretization
        The discretized problem of this point.
    arclength : float
        Distance travelled from the branch's first point, in the weighted norm.
    iterations, newton_error : int, float
        Newton iterations taken, and the estimated error that they left (the largest, relative to 1 + |x|).
    errors : mapping of str to float
        Estimated error of the free parameters, where it was asked for: of the discretization or, without a mesh, of the
        location alone. NaN where the point was not found again, and at points of higher codimension.
    details : object
        What the location found besides: the `contin.switching.BranchPoint` of a BP.
    """

    label: str
    name: str
    parameters: Mapping[str, float]
    functionals: Mapping[str, float]
    x: Array
    tangent: Array
    system: Discretization
    arclength: float
    iterations: int
    newton_error: float
    errors: Mapping[str, float] = field(default_factory=dict)
    details: Any = None

    def __getitem__(self, name: str) -> float:
        """A parameter or functional by name."""
        return self.parameters[name] if name in self.parameters else self.functionals[name]


@dataclass(frozen=True)
class Stop:
    """Why a run ended: a short ``reason``, a sentence, and what could be changed."""

    reason: str
    message: str
    advice: str = ""

    def __str__(self) -> str:
        return f"{self.message}; {self.advice}" if self.advice else self.message


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
        from contin import notebook

        return notebook.to_pandas(self)

    def plot(self, x: str | None = None, y: str | None = None, axes: Any = None) -> Any:
        """One column against another, by matplotlib; see `contin.notebook.plot`."""
        from contin import notebook

        return notebook.plot(self, x, y, axes)

    def _repr_html_(self) -> str:
        from contin import notebook

        return notebook.to_html(self)
