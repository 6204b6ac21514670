"""The solution on one segment, over its own coordinate."""

from __future__ import annotations

import numpy as np

from contin import checks
from contin.arrays import Array
from contin.errors import ProblemError
from contin.levels import LOCATED
from contin.names import exact_text
from contin.problems.statement import declared
from contin.results.record import Record, over_t


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
        """Return one state at the nodes, shape (K,).

        Raises
        ------
        KeyError
            There is none of this name.
        """
        if name not in self.names:
            raise KeyError(f"{name!r} is none of {', '.join(self.names)}")
        return self.states[:, self.names.index(name)]

    def __call__(self, s: Array) -> Array:
        """Return the states at coordinates (m,) between the ends of the segment, shape (m, n).

        Raises
        ------
        ProblemError
            A coordinate outside the segment.
        """
        places = np.atleast_1d(np.asarray(s, dtype=float))
        t = (places - self.begin) / (self.end - self.begin)
        outside = ~((t >= -LOCATED) & (t <= 1 + LOCATED))
        if outside.any():
            ends = f"{exact_text(self.begin)} to {exact_text(self.end)}"
            raise ProblemError(f"s: {exact_text(float(places[outside][0]))} must lie on the segment, from {ends}")
        return self._system.evaluate(self._x, t)[:, self._at]
