"""A state of a network as a state of the same network with other supports: the reactions become loads.

As for the last end of an open strip (`ribbon_model.changed_ends`), the network does not move. What its supports prescribe has
the values of the state. Each joint whose support has changed has dead forces along the axes along which it can move, and a dead
moment about its axis if it is a hinge; their numbers follow from the balance at the ends.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from contin import Point
from contin.lowlevel import Collocation
from ribbon_model import ends
from ribbon_model.changed_ends import balanced, held_angles
from ribbon_model.ends import ANGLES, FREE, FREE_END, HINGED, End
from ribbon_model.loads import FORCES, replacing_loads
from ribbon_model.members import Load
from ribbon_model.network import MOVES, Network

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
        elif now.rotation == HINGED:
            found[f"{joint}_{_NAMES[name]}"] = Load(moments=[(joint, 1.0)])
    return found


def with_supports(
    network: Network, point: Point, follow: str, unknown: Sequence[str], numbers: Mapping[str, float] | None = None
) -> tuple[Collocation, np.ndarray]:  # fmt: skip
    """Return the system of a network in which ``follow`` is free, and the unknowns of a state that another one has.

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

    Raises
    ------
    ValueError
        The state is no equilibrium with the new supports; one sentence.
    """
    states, before = point.system.states(point.x), point.parameters
    values = {name: before.get(name, value) for name, value in network.parameters.items()}
    for name, end in network.held.items():
        values |= {number: x for number, x in held_at(network, point, name, end).items() if number in values}
    values = balanced(network, states, values, unknown, _UNBALANCED) | dict(numbers or {})
    system = Collocation(
        network.problem, point.system.mesh, point.system.degree, (follow, *network.problem.multipliers), values
    )
    return system, system.pack(states, values)


#: Why a state is not one with other supports.
_UNBALANCED = (
    "the supports let go of what no load replaces: a dead force replaces that of a joint which is let go, a dead moment the "
    "one about the axis of its new hinge; bring other reactions to zero first"
)


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
    before, away = point.parameters, network.place(point, joint) - network.drawn_place(joint)
    moves, angles = (tuple(f"{joint}_{name}" for name in names) for names in (MOVES, ANGLES))
    known = [before.get(angle, 0.0) for angle in angles] if angles[0] in before else None
    now = end if end.rotation != FREE else ends.CLAMP
    return dict(zip(moves, map(float, away))) | dict(zip(angles, held_angles(now, network.frame(point, joint), known)))
