"""The record of one solution: its numbers, and the system that they belong to."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from contin.arrays import Array
from contin.boundary.system import Collocation
from contin.core.protocol import Discretization
from contin.core.system import System
from contin.core.trial import Trial
from contin.errors import ProblemError
from contin.events.labelled import finding_of


@dataclass(frozen=True, eq=False)
class Record:
    """The numbers of one solution; see `contin.Point` for the fields."""

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
    index: int | None = None
    nullity: int = 0
    index_change: tuple[int | None, int | None] | None = None
    breaks: tuple[str, ...] = ()
    column: str = ""
    value: float | None = None
    discretization_error: float = np.nan

    def __getattr__(self, name: str) -> Any:
        """Return the functionals of a point of plain steps, which are computed when they are first asked for."""
        if name != "functionals" or "system" not in vars(self):
            raise AttributeError(f"{type(self).__name__!r} object has no attribute {name!r}")
        found: Any = Trial.without_tangent(self.system, self.x).functionals
        vars(self)["functionals"] = found
        return found

    @property
    def is_simple_branch_point(self) -> bool:
        """Two branches cross there, and their tangents are known."""
        return finding_of(self.details).is_simple_branch_point


def system_of(point: Record, what: str) -> System:
    """Return the system of a point, where other parameters of its problem may become free.

    Raises
    ------
    ProblemError
        A point of a curve in two parameters; ``what`` names the argument.
    """
    system: Any = point.system
    if system.on_curve:
        raise ProblemError(f"{what}: must not be a point of a curve in two parameters")
    return system


def over_t(point: Record, otherwise: str) -> Collocation:
    """Return the system of a solution over t.

    Raises
    ------
    ProblemError
        It is no function of t; the sentence says ``otherwise``.
    """
    system: Any = point.system
    if not system.is_function_of_t:
        raise ProblemError(otherwise)
    return system
