"""What pictures show of a network beside its strips: forces, supports and joints."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from branches.draw.structure import ARROW, BALL, BLOCK, PIN, Fixture
from contin.lowlevel import levels
from ribbon_model.ends import CLAMPED, HINGED, unit
from ribbon_model.members import HINGE, RIGID, START, Joint, JointEnd
from ribbon_model.network import Network


def fixtures(network: Network) -> Iterator[Fixture]:
    """Yield what is drawn of a network beside its strips: forces, supports, and joints but where a strip just goes on."""
    for number, load in network.loads.items():
        for follows, forces in ((False, load.forces), (True, load.followers)):
            for name, direction, arm in forces:
                first = network.joints[name].members[0]
                frame, at = network.drawn_axes(first), (list(network.members).index(first.member), first.end != START)
                there = tuple(map(float, np.array(first.arm) + frame @ np.array(arm)))
                axis = unit("force", frame @ np.array(direction) if follows else direction)
                yield Fixture(*at, there, axis, ARROW, number=number, in_space=not follows)
    for name, joint in network.joints.items():
        held = network.held.get(name)
        if held is not None and (held.held or held.rotation == CLAMPED):
            form = {CLAMPED: BLOCK, HINGED: PIN}.get(held.rotation, BALL)
            yield _fixture(network, joint.members[0], form, held.axis if form == PIN else None, True)
        if joint.kind != RIGID or not (held is not None or _goes_on(network, joint)):
            # the axis of a hinge is the same on all of its ends, but on those that are turned about another axis
            first = min(joint.members, key=lambda each: each.angle != 0)
            form = {RIGID: BLOCK, HINGE: PIN}.get(joint.kind, BALL)
            yield _fixture(network, first, form, joint.axis if form == PIN else None, False)


def _fixture(network: Network, each: JointEnd, form: str, axis, held: bool) -> Fixture:
    """Return a fixture at an end; ``axis`` is on the axes of the drawing, by default that along the width."""
    own = (1.0, 0.0, 0.0) if axis is None else unit("axis", network.drawn_axes(each) @ np.array(axis))
    return Fixture(list(network.members).index(each.member), each.end != START, each.arm, own, form, held)


def _goes_on(network: Network, joint: Joint) -> bool:
    """Return whether there is one end only, or two of one strip that goes on, with its section and without a corner."""
    if len(joint.members) != 2:
        return len(joint.members) == 1
    if any(each.angle != 0 or any(each.arm) for each in joint.members):
        return False
    one, other = (network.drawn_axes(each)[2] * (1 if each.end == START else -1) for each in joint.members)
    return len({network.members[each.member].section for each in joint.members}) == 1 and -one @ other > 1 - levels.LOCATED
