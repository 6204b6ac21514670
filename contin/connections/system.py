"""Connecting orbits as the continuation sees them: their equations, and what they know of their branches."""

from __future__ import annotations

import numpy as np

from contin.arrays import Array
from contin.connections.equations import ConnectionEquations
from contin.connections.events import homoclinic_points, named, own_test_of
from contin.core.trial import Event, Trial
from contin.defining.event_curve import EventCurve
from contin.errors import ProblemError
from contin.events.arc import SpecialPoint
from contin.events.error import Solution
from contin.levels import APART
from contin.problems.own_names import TIME


class ConnectionCollocation(ConnectionEquations):
    """A `ConnectionProblem` on a mesh."""

    def events(self) -> list[Event]:
        """Return those of special homoclinic orbits; those of a given time, and orbits between two equilibria, have none."""
        return homoclinic_points(self) if self.problem.homoclinic and TIME not in self.free else []

    def check_solution(self, x: Array) -> None:
        """Check that an orbit between two equilibria does not return to the first one.

        Raises
        ------
        ProblemError
        """
        problem = self.problem
        if problem.homoclinic:
            return
        count, names = len(problem.state_names), problem.multipliers
        first, last = (np.array([self.parameter(x, name) for name in part]) for part in (names[:count], names[count:]))
        if np.abs(first - last).max() <= APART * float(np.ptp(self.states(x), axis=0).max()):
            place = ", ".join(f"{name} = {value + 0.0:.6g}" for name, value in zip(problem.state_names, first))
            raise ProblemError(
                f"stable: both ends of the orbit are at the equilibrium {place}; leave out stable for a homoclinic orbit, or "
                f"give a guess of the last equilibrium ({', '.join(names[count:])})"
            )

    def defining(self, point: Solution, x: Array) -> tuple[EventCurve, Array] | None:
        """Return that of special homoclinic orbits."""
        test = own_test_of(point.label, self, x) if self.problem.homoclinic else None
        return None if test is None else (EventCurve(self, test), x)

    def events_on_curves(self) -> list[Event]:
        """Return those of homoclinic orbits that are special in another way, too."""
        return homoclinic_points(self)

    def judged_on_curve(self, point: SpecialPoint, solution: Trial) -> SpecialPoint:
        """Return neutral saddles and the like, by which of the leading eigenvalues are complex."""
        return named(point, solution)

    def judged(self, point: SpecialPoint) -> SpecialPoint:
        """Return neutral saddles, and the end of a curve, by which of the leading eigenvalues are complex."""
        return named(point)
