"""Loads on an open strip: their names, what they can act on, and their potentials."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from ribbon_model import ends
from ribbon_model.ends import DIRECTIONS, HINGED, JOINT, LOOSE, End

#: Numbers of loads: dead force at the last end along the three directions, dead moment about its hinge, weight per length
#: (along ``weight_direction``), stiffness per length of a foundation.
FORCES = ("force_width", "force_normal", "force_tangent")
LOADS = (*FORCES, "moment", "weight", "foundation")
#: Those that replace reactions of the last end.
REPLACING = (*FORCES, "moment")
#: A further displacement of the last end, along ``stroke_direction``.
STROKE = "stroke"


def forces_of(finish: End) -> tuple[str, ...]:
    """Return the names of the dead forces that can act on the last end: along directions in which its place is not held."""
    return tuple(name for name, axis in zip(FORCES, DIRECTIONS.values()) if not _spanned(axis, finish.held))


def replacing_loads(finish: End) -> tuple[str, ...]:
    """Return the names of the dead loads that can replace reactions of the last end: forces, and the moment of a hinge."""
    return (*forces_of(finish), *(("moment",) if finish.rotation in (HINGED, JOINT) else ()))


def _spanned(axis, held) -> bool:
    """Return whether a direction lies in the span of those that are held: a force along it would do nothing."""
    if not held:
        return False
    rest = np.array(axis) - np.linalg.pinv(np.array(held)) @ np.array(held) @ np.array(axis)
    return bool(np.linalg.norm(rest) < LOOSE)


def distributed(weight: ends.Vector | None, foundation: ends.Vector | None, ground: float = 0.0) -> Callable:
    """Return the potential of distributed loads per length, as a function of (x, p). None: there is no such load.

    ``ground`` is where the plane of the foundation is along its direction.
    """

    def potential(x, p):
        value = 0.0
        if weight is not None:
            value = value - p.weight * (weight[0] * x.x1 + weight[1] * x.x2 + weight[2] * x.x3)
        if foundation is not None:
            offset = foundation[0] * x.x1 + foundation[1] * x.x2 + foundation[2] * x.x3 - ground
            value = value + p.foundation * offset * offset / 2
        return value

    return potential
