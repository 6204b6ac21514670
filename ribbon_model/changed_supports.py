"""A state of a network as a state of the same network with other supports: the reactions become loads.

The network does not move. What its supports prescribe (place, angles) has the values of the state. Each joint whose support has
changed has dead forces along the directions in which it can move, and a dead moment about its axis if it is a hinge. Their
numbers, and the multipliers of the new conditions, follow from the conditions at the ends, which are linear in them
(`contin.VariationalProblem`):

    lambda(t0) = d(Phi + sigma.e)/dx(t0),    lambda(t1) = -d(Phi + sigma.e)/dx(t1).

What is left over is a reaction that no load replaces: then the state is no equilibrium with the new supports.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence

import numpy as np

from contin import Point
from contin.lowlevel import Collocation, correct, levels, point_of
from ribbon_model import ends
from ribbon_model.ends import FREE, FREE_END, End
from ribbon_model.loads import FORCES, replacing_loads
from ribbon_model.members import Load
from ribbon_model.network import Network

#: Behind the name of a joint: its dead forces along the axes of the drawing, and its dead moment.
_NAMES = dict(zip((*FORCES, "moment"), ("force_x", "force_y", "force_z", "moment")))


def replacing(joint: str, end: End | None) -> dict[str, Load]:
    """Return the loads that can replace reactions at a joint that is now held so (None: not at all), by name.

    Examples
    --------
    >>> sorted(replacing("A", ends.hinge((1.0, 0.0, 0.0), held=((0.0, 1.0, 0.0),))))
    ['A_force_x', 'A_force_z', 'A_moment']
    """
    now, axes, found = end or FREE_END, dict(zip(FORCES, ends.DIRECTIONS.values())), {}
    for name in replacing_loads(now):
        if name in axes:
            found[f"{joint}_{_NAMES[name]}"] = Load([(joint, axes[name], (0.0, 0.0, 0.0))])
        else:
            found[f"{joint}_{_NAMES[name]}"] = Load(moments=[(joint, 1.0)])
    return found


def with_supports(
    network: Network, point: Point, follow: str, unknown: Sequence[str], numbers: Mapping[str, float] | None = None
) -> tuple[Collocation, np.ndarray]:  # fmt: skip
    """Return the system of a network in which ``follow`` is free, and the unknowns of a state that another one has.

    Raises ValueError where the state is no equilibrium with the new supports; one sentence.

    Parameters
    ----------
    network : Network
        The network with the new supports.
    point : Point
        A state of the same network with other supports.
    follow : str
    unknown : sequence of str
        Names of the loads that replace reactions; see `replacing`.
    numbers : mapping of str to float, optional
        Values that differ from those of the state, for a following correction.
    """
    states, before = point.system.states(point.x), point.parameters
    values = {name: before.get(name, value) for name, value in network.parameters.items()}
    for name, end in network.held.items():
        values |= {number: x for number, x in held_at(network, point, name, end).items() if number in values}
    values = balanced(network, states, values, unknown, network.unbalanced(point)) | dict(numbers or {})
    free = follow, *network.problem.multipliers
    system = Collocation(network.problem, point.system.mesh, point.system.degree, free, values)
    return system, system.pack(states, values)


def held_at(network: Network, point: Point, joint: str, end: End = FREE_END) -> dict[str, float]:
    """Return displacement and rotation of a joint in a state, in the names of numbers: those of the state if it was so held.

    Examples
    --------
    >>> from ribbon_model.laws import ROD
    >>> from ribbon_model.network import Joint, JointEnd, Member
    >>> from ribbon_model.section import Section
    >>> rod = Section(ROD, {"B1": 1.0, "B2": 1.0, "C": 1.0})
    >>> ends_of = {"A": Joint([JointEnd("beam")]), "B": Joint([JointEnd("beam", "finish")])}
    >>> beam = Network({"strip": rod}, {"beam": Member()}, ends_of, {"A": ends.CLAMP})
    >>> state, how = beam.first_point()
    >>> abs(held_at(beam, state, "B")["B_dz"]) < 1e-12
    True
    """
    before, names = point.parameters, network.names_at(joint)
    known = [before.get(angle, 0.0) for angle in names[3:]] if names[3] in before else None
    angles = held_angles(end if end.rotation != FREE else ends.CLAMP, network.frame(point, joint), known)
    away = [
        before[name] if abs(before.get(name, math.inf) - x) < levels.LOCATED else float(x)
        for name, x in zip(names, network.displacement(point, joint))
    ]  # fmt: skip
    return dict(zip(names, (*away, *angles)))


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


def corrected(network: Network, near: Collocation, states: np.ndarray, values: Mapping[str, float]) -> Point:
    """Return the state with these numbers next to given ones (K, 2n) at the nodes of a system; or raise ConvergenceError."""
    multipliers = network.problem.multipliers
    values = fitted(network, states, dict(values), multipliers)[0]
    system = Collocation(network.problem, near.mesh, near.degree, multipliers, values)
    return point_of(system, correct(system, system.pack(states, values)).x)


def balanced(
    network: Network, states: np.ndarray, values: dict[str, float], replacing: Sequence[str], unbalanced: str
) -> dict[str, float]:  # fmt: skip
    """Return the values with the loads and multipliers that replace the reactions.

    Raises ValueError where a condition does not hold, or a reaction is replaced by nothing: ``unbalanced``.
    """
    problem = network.problem
    values, left = fitted(network, states, values, [*replacing, *problem.multipliers])
    conditions = len(problem.canonical.fixed[0]) + len(problem.canonical.fixed[1]) + problem.canonical.sigmas
    if left[:conditions].max(initial=0.0) > levels.APART:
        raise ValueError("they hold a place or a rotation that the state does not have (the first end has moved or turned)")
    if left[conditions:].max(initial=0.0) > levels.APART * (1 + np.abs(states[[0, -1], states.shape[1] // 2 :]).max()):
        raise ValueError(unbalanced)
    return values


def fitted(network: Network, states: np.ndarray, values: dict[str, float], unknown) -> tuple[dict[str, float], np.ndarray]:
    """Return the values with those of the unknown numbers that fit the conditions at the ends best, and what is left."""
    problem, order = network.problem, list(network.problem.parameters)
    p = np.array([values.get(name, problem.parameters[name]) for name in order])
    p[[order.index(f"sigma_{number + 1}") for number in network.contacts]] = -levels.APART  # what touches is held
    places = np.array([order.index(name) for name in unknown], dtype=np.int64)
    batch = problem.batch("boundary")
    missed, slopes = batch.jacobian(np.zeros(1), states[:1], states[-1:], p, batch.columns(places))
    missed, by_unknown = missed[0], slopes[0][:, 2 * states.shape[1] :]
    change = np.linalg.lstsq(by_unknown, -missed, rcond=None)[0]
    return values | dict(zip(unknown, (p[places] + change).tolist())), np.abs(missed + by_unknown @ change)
