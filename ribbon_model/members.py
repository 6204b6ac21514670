"""What networks are stated with: strips as they are drawn, joints, loads."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from ribbon_model import ends
from ribbon_model.ends import LOOSE, Vector, product
from ribbon_model.equilibrium import directors
from ribbon_model.section import helix
from ribbon_model.shape import quaternions

#: Kinds of joints.
RIGID, HINGE, BALL = "rigid", "hinge", "ball"
#: Ends of a member.
START, FINISH = "start", "finish"
#: A quaternion, scalar first.
Quaternion = tuple[float, float, float, float]


@dataclass(frozen=True)
class Member:
    """A strip of a network, as it is drawn.

    Attributes
    ----------
    section : str
        The name of its section.
    length : float
    place : tuple of float
        Where it begins.
    frame : tuple of float
        The quaternion of its frame there.
    strains : tuple of float
        Curvature about the width, about the normal, and twist of the drawing; the state begins so.
    span : tuple of float
        The parts of a strip at which it begins and ends, for data along the strip: a member may be a piece of one (`cut`).

    Examples
    --------
    A quarter of a circle of radius 1 that begins upwards:

    >>> quarter = Member("strip", math.pi / 2, strains=(1.0, 0.0, 0.0))
    >>> quarter.drawn([0.0, math.pi / 2])[-1, 4:].round(12).tolist()
    [0.0, -1.0, 1.0]
    """

    section: str = "strip"
    length: float = 1.0
    place: Vector = (0.0, 0.0, 0.0)
    frame: Quaternion = (1.0, 0.0, 0.0, 0.0)
    strains: Vector = (0.0, 0.0, 0.0)
    span: tuple[float, float] = (0.0, 1.0)

    def part(self, t):
        """Return the part of the strip at a part t of the member."""
        return self.span[0] + (self.span[1] - self.span[0]) * t

    def drawn(self, s: float | np.ndarray) -> np.ndarray:
        """Return quaternion and place (K, 7) of the drawing at distances s (K,) from its beginning."""
        own = helix(np.array(self.strains, dtype=float), np.asarray(s, dtype=float))
        q = np.array(product(self.frame, tuple(own[:, :4].T))).T
        return np.hstack([q, np.array(self.place) + own[:, 4:] @ np.array(directors(*self.frame)).reshape(3, 3)])

    def followed_by(self, section: str, length: float, strains: Vector = (0.0, 0.0, 0.0)) -> Member:
        """Return a member that goes on where this one ends."""
        state = self.drawn([self.length])[0]
        return Member(section, length, numbers_of(state[4:]), numbers_of(state[:4]), strains)

    def cut(self, fractions: Sequence[float]) -> list[Member]:
        """Return the pieces of a member that is cut at fractions of its length, which increase between 0 and 1."""
        places = [0.0, *fractions, 1.0]
        if sorted(set(places)) != places:
            raise ValueError(f"cut: {list(fractions)} must increase between 0 and 1")
        begins = self.drawn([part * self.length for part in places[:-1]])
        return [
            Member(
                self.section, (end - begin) * self.length, numbers_of(state[4:]), numbers_of(state[:4]), self.strains,
                (self.part(begin), self.part(end)),
            )
            for begin, end, state in zip(places, places[1:], begins)
        ]  # fmt: skip


def straight(section: str, begin: Vector, end: Vector, normal: Vector) -> Member:
    """Return a straight member between two places, whose normal d2 is as near as possible to a direction.

    Raises ValueError where the places are one, or the normal lies along the member.
    """
    along = np.array(end, dtype=float) - begin
    length = float(np.linalg.norm(along))
    if not 0 < length < math.inf:
        raise ValueError(f"a member from {list(begin)} to {list(end)} has no direction")
    frame = frame_along(along / length, normal, f"the member from {list(begin)} to {list(end)}")
    return Member(section, length, numbers_of(begin), frame)


def frame_along(tangent: Sequence[float], normal: Vector, what: str) -> Quaternion:
    """Return the quaternion of a frame with a tangent, a unit vector, whose normal d2 is as near as possible to a direction.

    Raises ValueError where the normal lies along the tangent of ``what``.
    """
    across = np.array(ends.unit("normal", normal)) @ (np.eye(3) - np.outer(tangent, tangent))
    if np.linalg.norm(across) < LOOSE:
        raise ValueError(f"normal: {list(normal)} lies along {what}")
    across /= np.linalg.norm(across)
    return numbers_of(quaternions(np.array([[np.cross(across, tangent), across, tangent]]))[0])


def numbers_of(values: object) -> Any:
    """Return a vector as a tuple of Python's numbers."""
    return tuple(map(float, values))


@dataclass  # the axis is normalised when it is made, and then left as it is
class JointEnd:
    """An end of a member at a joint.

    Attributes
    ----------
    member : str
    end : str
        'start' or 'finish'.
    angle : float or str
        By which the member is turned at this joint, against the drawing; or the name of a number.
    axis : tuple of float
        About which, on the axes of the drawing.
    arm : tuple of float
        From the end to the joint, on the directors of the end.
    goes_on : bool
        The strip goes on from the end before it: both are rigidly joined, of whatever kind the joint is.
    """

    member: str
    end: str = START
    angle: float | str = 0.0
    axis: Vector = (1.0, 0.0, 0.0)
    arm: Vector = (0.0, 0.0, 0.0)
    goes_on: bool = False

    def __post_init__(self) -> None:
        if self.end not in (START, FINISH):
            raise ValueError(f"joint: end: {self.end!r} must be start or finish")
        self.axis = ends.unit("axis", self.axis)


@dataclass(frozen=True)
class Joint:
    """A joint of any number of ends.

    Attributes
    ----------
    members : sequence of JointEnd
    kind : str
        'rigid', 'hinge' or 'ball'.
    axis : tuple of float
        Of a hinge, on the axes of the drawing; it turns with the first member.
    """

    members: Sequence[JointEnd]
    kind: str = RIGID
    axis: Vector = (1.0, 0.0, 0.0)

    def __post_init__(self) -> None:
        if self.kind not in (RIGID, HINGE, BALL):
            raise ValueError(f"joint: kind: {self.kind!r} must be rigid, hinge or ball")
        if not self.members:
            raise ValueError("joint: members: there must be one at least")


@dataclass(frozen=True)
class Load:
    """Forces and moments with one number.

    Attributes
    ----------
    forces : sequence of (joint, direction, arm)
        The force at a joint is the number times the direction. ``arm`` is on the axes of the drawing, and fixed on the first
        member of the joint.
    moments : sequence of (joint, factor)
        The moment about the axis of a hinge that holds a joint is the number times the factor.
    followers : sequence of (joint, direction, arm)
        Forces that turn with the first member of the joint. They have no energy, so states under them have no index.
    """

    forces: Sequence[tuple[str, Vector, Vector]] = ()
    moments: Sequence[tuple[str, float]] = ()
    followers: Sequence[tuple[str, Vector, Vector]] = ()
