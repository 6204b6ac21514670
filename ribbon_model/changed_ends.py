"""A state of an open strip as a state of the same strip with other ends: the reactions become loads.

The strip does not move. What the new ends prescribe (place, angles) has the values of the state. The dead force in each
direction that is let go, the dead moment about the axis of a new hinge, and the multipliers of the new conditions follow from
the conditions at the ends, which are linear in them (`contin.VariationalProblem`):

    lambda(t0) = d(Phi + sigma.e)/dx(t0),    lambda(t1) = -d(Phi + sigma.e)/dx(t1).

What is left over is a reaction that no load replaces: then the state is no equilibrium with the new ends.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING

import numpy as np

from contin import Point
from contin.lowlevel import Collocation, correct, levels, point_of
from ribbon_model import ends
from ribbon_model.ends import ANGLES, FREE, PLACE, End
from ribbon_model.loads import FORCES, STROKE
from ribbon_model.open_strip import OpenStrip

if TYPE_CHECKING:
    from ribbon_model.network import Network


def with_ends(strip: OpenStrip, point: Point, follow: str, numbers: Mapping[str, float] | None = None):
    """Return the system of a strip in which ``follow`` is free, and the unknowns of a state that another one has.

    Parameters
    ----------
    strip : OpenStrip
        The strip with the new ends.
    point : Point
        A state of the same strip with other ends.
    follow : str
    numbers : mapping of str to float, optional
        Values that differ from those of the state, for a following correction.

    Raises
    ------
    ValueError
        The state is no equilibrium with the new ends; one sentence.
    """
    states = point.system.states(point.x)
    replacing = [name for name in (*FORCES, "moment") if name in strip.numbers]
    values = _values(strip, point.parameters, states[-1, :7])
    values = balanced(strip, states, values, replacing, _unbalanced(strip, states)) | dict(numbers or {})
    free = (follow, *strip.problem.multipliers)
    system = Collocation(strip.problem, point.system.mesh, point.system.degree, free, values)
    return system, system.pack(states, values)


def _values(strip: OpenStrip, before: Mapping[str, float], last: np.ndarray) -> dict[str, float]:
    """Return the numbers of a strip whose last end has this quaternion and place; ``before`` are those of the state."""
    q, finish = last[:4], strip.finish
    values = {name: before.get(name, value) for name, value in strip.parameters.items()}
    place = dict(zip(PLACE, last[4:7] - values.get(STROKE, 0.0) * np.array(strip.stroke_direction)))
    values |= {
        name: before[name] if abs(before.get(name, math.inf) - x) < levels.LOCATED else float(x)
        for name, x in place.items() if name in values
    }  # fmt: skip
    if finish.rotation == FREE:
        return values
    known = [before.get(name, 0.0) for name in ANGLES] if ANGLES[0] in before else None
    return values | dict(zip(ANGLES, held_angles(finish, q, known)))


def held_angles(end: End, q, known: Sequence[float] | None) -> tuple[float, ...]:
    """Return turn, bend and swing that an end with a quaternion has: the known ones where they hold it so, or next to them."""
    if known is not None:
        missed = ends.rotation_conditions(end)(q, ends.prescribed(*known))
        if max(map(abs, missed), default=0.0) < levels.LOCATED:
            return tuple(known)
    return angles_near(q, known or (0.0, 0.0, 0.0))


def angles_near(q, near) -> tuple[float, float, float]:
    """Return turn, bend and swing of a quaternion; of all that stand for its rotation, those next to the given ones."""
    turn, bend, swing = ends.angles_of(q)
    both = (turn, bend, swing), (turn + math.pi, math.pi - bend, swing + math.pi)
    found = [[a + 2 * math.pi * round((b - a) / (2 * math.pi)) for a, b in zip(angles, near)] for angles in both]
    best = min(found, key=lambda angles: math.dist(angles, near))
    return best[0], best[1], best[2]


def corrected(strip: OpenStrip, near: Collocation, states: np.ndarray, values: Mapping[str, float]) -> Point:
    """Return the state of a strip with these numbers next to given states (K, 2n) at the nodes of a system.

    Raises
    ------
    ConvergenceError
        There is none nearby.
    """
    multipliers = strip.problem.multipliers
    values = fitted(strip, states, dict(values), multipliers)[0]
    system = Collocation(strip.problem, near.mesh, near.degree, multipliers, values)
    return point_of(system, correct(system, system.pack(states, values)).x)


def balanced(
    strip: OpenStrip | Network, states: np.ndarray, values: dict[str, float], replacing: Sequence[str], unbalanced: str
) -> dict[str, float]:  # fmt: skip
    """Return the values with the loads and multipliers that replace the reactions.

    Raises
    ------
    ValueError
        A condition does not hold, or a reaction is replaced by nothing: ``unbalanced``.
    """
    problem = strip.problem
    values, left = fitted(strip, states, values, [*replacing, *problem.multipliers])
    conditions = len(problem.canonical.fixed[0]) + len(problem.canonical.fixed[1]) + problem.canonical.sigmas
    if left[:conditions].max(initial=0.0) > levels.APART:
        raise ValueError("they hold a place or a rotation that the state does not have (the first end has moved or turned)")
    if left[conditions:].max(initial=0.0) > levels.APART * (1 + np.abs(states[[0, -1], states.shape[1] // 2 :]).max()):
        raise ValueError(unbalanced)
    return values


def fitted(
    strip: OpenStrip | Network, states: np.ndarray, values: dict[str, float], unknown
) -> tuple[dict[str, float], np.ndarray]:
    """Return the values with those of the unknown numbers that fit the conditions at the ends best, and what is left."""
    problem, order = strip.problem, list(strip.problem.parameters)
    p = np.array([values.get(name, problem.parameters[name]) for name in order])
    places = np.array([order.index(name) for name in unknown], dtype=np.int64)
    batch = problem.batch("boundary")
    missed, slopes = batch.jacobian(np.zeros(1), states[:1], states[-1:], p, batch.columns(places))
    missed, by_unknown = missed[0], slopes[0][:, 2 * states.shape[1] :]
    change = np.linalg.lstsq(by_unknown, -missed, rcond=None)[0]
    return values | dict(zip(unknown, (p[places] + change).tolist())), np.abs(missed + by_unknown @ change)


def _unbalanced(strip: OpenStrip, states: np.ndarray) -> str:
    """Return what is wrong where no load replaces a reaction."""
    carried = list(strip.reactions_of(states).values())
    reactions = [", ".join(f"{value:.4g}" for value in carried[i : i + 3]) for i in range(0, 12, 3)]
    return (
        "they let go of what no load replaces; along width, normal and tangent the last end carries the force "
        f"({reactions[0]}) and the moment ({reactions[1]}), the first one ({reactions[2]}) and ({reactions[3]}); a dead force "
        "replaces that at the last end, a dead moment the one about the axis of its hinge: bring the others to zero first"
    )
