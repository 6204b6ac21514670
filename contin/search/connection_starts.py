"""First points of curves of homoclinic orbits that begin where others end: at non-central orbits to saddle-nodes."""

from __future__ import annotations

from typing import Any

import numpy as np

from contin.arrays import Array
from contin.connections.events import crossing, ending
from contin.connections.statement import ConnectionProblem
from contin.connections.system import ConnectionCollocation
from contin.core.labels import Label
from contin.core.trial import Trial, linearization
from contin.errors import ProblemError
from contin.levels import BESIDE
from contin.problems.angles import winding_names
from contin.problems.own_names import TIME
from contin.results.point import Point


def leaves_saddle_node(point: Point) -> bool:
    """Return whether a point is a non-central homoclinic orbit to a saddle-node, where two curves meet."""
    return point.label == Label.NON_CENTRAL and not point.system.on_curve


def from_non_central(point: Point) -> tuple[ConnectionCollocation, Array, Array]:
    """Return the system of the other curve that meets a non-central orbit, the orbit in it, and the tangent there.

    From a curve of orbits to a saddle it is that of central orbits to the saddle-node, and the other way round. The orbit
    solves the equations of both: its component along the eigenvector is zero at one end. The tangent leads to central orbits,
    or to those of a saddle.

    Raises
    ------
    ProblemError
        The curve has other than two free parameters.
    """
    system: Any = point.system
    old = system.problem
    if len(system.free) != old.free_size:
        raise ProblemError("start: must be a point of a curve of homoclinic orbits in two parameters")
    to_saddle, side = crossing(point)
    unstable = old.unstable - side if to_saddle else old.unstable + side
    values = dict(point.parameters)
    own = (*old.multipliers, TIME, *winding_names(old.angles))
    given = {name: value for name, value in values.items() if name not in own}
    problem = ConnectionProblem(old.field, old.state_names, given, unstable=unstable, angles=old.angles, saddle_node=to_saddle)
    other = ConnectionCollocation(problem, system.mesh, system.degree, system.free, values, system.scales)
    other = other.with_reference(point.x)
    row = np.zeros(other.size)
    row[other.parameter_index(system.free[0])] = 1.0
    tangent = linearization(other, point.x, row).tangent
    inside = ending(other, side).function
    beside = [inside(Trial.without_tangent(other, point.x + way * BESIDE * tangent)) for way in (1, -1)]
    return other, point.x, tangent if beside[0] > beside[1] else -tangent
