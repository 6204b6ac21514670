"""A result file of a network in memory: the strips at its points, with their joints and supports."""

from __future__ import annotations

import functools
from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from branches.draw.strip import View
from branches.draw.structure import ARROW, BALL, BLOCK, PIN, Fixture, Structure, flat_across
from branches.store.open_branch import OpenBranch
from contin.lowlevel import levels
from ribbon_model.ends import CLAMPED, HINGED, unit
from ribbon_model.members import HINGE, RIGID, START, Joint, JointEnd
from ribbon_model.network import Network

#: Networks are drawn flat, often, with strips across their plane: seen from ahead, those that stand upright would be lines.
_VIEW = View(-70.0, 20.0)


class NetworkBranch(OpenBranch):
    """The result file of a network; as `branches.read.StoredBranch`, with lengths in the unit of the scene.

    Strains and tables have the strips one after the other, in the order of the network's members.
    """

    def shape_at(self, point: int, t: np.ndarray, states: np.ndarray) -> tuple[Structure, np.ndarray]:
        """Return the strips, on the axes of the drawing, and their strains (strips K, 3), of states (K, n) at places t (K,)."""
        network, values = self._strip(point), np.array([*self._numbers(point).values()])
        laws = [network.sections[member.section].form for member in network.members.values()]
        shapes = tuple(map(flat_across, network.shapes_at(t, states, values).values(), laws))
        strains = np.concatenate([*network.strains_at(t, states, values).values()])
        found = [replace(one, force=self.force(one.number)[point]) if one.number else one for one in fixtures(network)]
        return Structure(shapes, tuple(found)), strains

    def force(self, number: str) -> np.ndarray:
        """Return a dead force at all points, 0 where it is round-off of the largest one in the file."""
        values = self.points[number]
        return np.where(np.abs(values) > levels.LOCATED * self._largest, values, 0.0)

    @functools.cached_property
    def _largest(self) -> float:
        """The largest dead force in the file."""
        names = {one.number for stage in self.stages for one in fixtures(stage.strip) if one.number}
        return max((float(np.abs(self.points[name]).max()) for name in names), default=0.0)

    def placed(self, point: int, length: float, cells: int = 0):
        """Return the strips scaled so that the longest one has this length, and their strains, with so many cells in all."""
        return super().placed(point, length, -(-cells // len(self._strip(point).members)))

    def width_at(self, length: float, thickness: float | None) -> float | None:
        return None

    @property
    def length(self) -> float:
        """The length of the longest strip."""
        return self.scene.longest

    shape_length = length

    length_unit = ""

    @property
    def up(self) -> tuple[float, float, float]:
        return tuple(-x for x in self.scene.strip().weight_direction)

    @property
    def view(self) -> View:
        return _VIEW


# --- joints and supports ------------------------------------------------------------------------------------------------


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
