"""The record of one solution: its numbers, the system that they belong to, and the solution over its coordinate."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from contin import errors as checks
from contin.arrays import Array
from contin.boundary.system import Collocation
from contin.core.protocol import Discretization
from contin.core.system import System
from contin.core.trial import Trial
from contin.errors import ProblemError
from contin.events.labelled import finding_of, located_details
from contin.levels import LOCATED
from contin.problems.statement import declared
from contin.text import exact_text


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
    details: Any = field(default_factory=lambda: None)  # no value of the class, which would hide what is made later
    index: int | None = None
    nullity: int = 0
    index_change: tuple[int | None, int | None] | None = None
    breaks: tuple[str, ...] = ()
    column: str = ""
    value: float | None = None
    discretization_error: float = np.nan

    def __getattr__(self, name: str) -> Any:
        """Return what is computed when first asked for: functionals, a name or details with a normal form."""
        known = vars(self)
        if name == "functionals" and "system" in known:
            known[name] = Trial.without_tangent(self.system, self.x).functionals
        elif name in ("name", "details") and "_told" in known:
            known["name"], known["details"] = known.pop("_told")[1]()
        else:
            raise AttributeError(f"{type(self).__name__!r} object has no attribute {name!r}")
        return known[name]

    def __getstate__(self) -> dict[str, Any]:
        """Return what is pickled, the name and details among it."""
        return {"name": self.name, **vars(self)}

    @property
    def is_simple_branch_point(self) -> bool:
        """Two branches cross there, and their tangents are known."""
        return finding_of(located_details(self)).is_simple_branch_point


def system_of(point: Record, what: str) -> System:
    """Return the system of a point, where other parameters of its problem may become free.

    Raises ProblemError for a point of a curve in two parameters; ``what`` names the argument.
    """
    system: Any = point.system
    if system.on_curve:
        raise ProblemError(f"{what}: must not be a point of a curve in two parameters")
    return system


def over_t(point: Record, otherwise: str) -> Collocation:
    """Return the system of a solution over t; raise ProblemError, which says ``otherwise``, where it is no function of t."""
    system: Any = point.system
    if not system.is_function_of_t:
        raise ProblemError(otherwise)
    return system


class Profile:
    """States on one segment of a `SegmentedProblem`.

    Attributes
    ----------
    names : tuple of str
        Of the states.
    s : ndarray, shape (K,)
        Coordinates of the nodes, from the beginning of the segment to its end.
    states : ndarray, shape (K, n)
        States there; ``profile["theta"]`` is one of them.
    """

    def __init__(self, point: Record, index: int) -> None:
        nothing = "segment: the problem has no segments; state it as a SegmentedProblem"
        self._system, self._x = over_t(point, nothing), point.x
        problem = self._system.problem
        if not declared(problem, "pieces"):
            raise ProblemError(nothing)
        checks.whole("segment", index, 0, len(problem.pieces) - 1)
        self._at = list(problem.pieces[index].at)
        self.names = problem.pieces[index].names
        self.begin, self.end = problem.pieces[index].extent(point.parameters)
        self.s: Array = self.begin + (self.end - self.begin) * self._system.nodes
        self.states: Array = self._system.states(point.x)[:, self._at]

    def __getitem__(self, name: str) -> Array:
        """Return one state at the nodes, shape (K,); raise KeyError where there is none of this name."""
        if name not in self.names:
            raise KeyError(f"{name!r} is none of {', '.join(self.names)}")
        return self.states[:, self.names.index(name)]

    def __call__(self, s: Array) -> Array:
        """Return the states at coordinates (m,) between the ends of the segment, shape (m, n); raise ProblemError outside."""
        places = np.atleast_1d(np.asarray(s, dtype=float))
        t = (places - self.begin) / (self.end - self.begin)
        outside = ~((t >= -LOCATED) & (t <= 1 + LOCATED))
        if outside.any():
            ends = f"{exact_text(self.begin)} to {exact_text(self.end)}"
            raise ProblemError(f"s: {exact_text(float(places[outside][0]))} must lie on the segment, from {ends}")
        return self._system.evaluate(self._x, t)[:, self._at]
