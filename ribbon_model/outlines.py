"""The area that a pressure acts on: strips in a row, which go around it; where it has a potential, and which.

The potential of a pressure p from outside on a curve in a plane with the normal N is p times the area of the fan from a place
c, p int N.((x - c) x x')/2 ds. Its variation is the work of the pressure, and N.((x - c) x dx)/2 at both ends: zero on a
closed curve, and at an end that is held. At an end that slides along a line through x0, it is the variation of
N.((x0 - c) x (x - c))/2, which is subtracted. Elsewhere such a pressure has no potential.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, Protocol

import numpy as np

from ribbon_model.ends import LOOSE, Vector
from ribbon_model.members import FINISH, START, JointEnd, numbers_of


class Drawn(Protocol):
    """What is asked of a network: its strips as drawn, its joints and how these are held."""

    members: Mapping[str, Any]
    joints: Mapping[str, Any]
    held: Mapping[str, Any]
    pressure_normal: Vector

    def joint_at(self, end: JointEnd) -> str:
        """Return the joint at an end."""

    def said(self, end: JointEnd) -> str:
        """Return what messages call an end."""


#: The side on which a member is pressed, +1 where it is drawn around the area and -1 against that; and the place c.
Fan = tuple[int, Vector]
#: What to do where a pressure in a plane has no potential.
_ADVICE = "so a pressure in a plane has no potential; follow follower_pressure, which acts against the normal of each strip"


def fans(network: Drawn) -> tuple[dict[str, Fan], list[tuple[JointEnd, str, Fan]]]:
    """Return the fan of each member; and the ends that slide, with their joint, and +1 in a fan where a row ends, else -1.

    Raises ValueError where a pressure on the network has no potential.
    """
    found: dict[str, Fan] = {}
    slides: list[tuple[JointEnd, str, Fan]] = []
    for name in network.members:
        if name not in found:
            row, closed = _row(network, name)
            curves = [network.members[other].drawn(np.linspace(0, network.members[other].length, 101)) for other, _ in row]
            places = np.concatenate([curve[::sign, 4:] for curve, (_, sign) in zip(curves, row)])
            arms = places - places[0]  # a straight line between both ends closes the area
            area = float(np.cross(arms[:-1], arms[1:]).sum(axis=0) @ network.pressure_normal)
            turn = -1 if area < -LOOSE * np.ptp(places, axis=0).max() ** 2 else 1
            outer = [JointEnd(other, FINISH if way == sign else START) for way, (other, sign) in ((-1, row[0]), (1, row[-1]))]
            sliding = [not closed and _slides(network, each) for each in outer]
            fixed = [place for place, slide in zip(places[[0, -1]], sliding) if not slide] or places[[0, -1]]
            centre = (0.0, 0.0, 0.0) if closed else numbers_of(np.mean(fixed, axis=0))
            found |= {other: (turn * sign, centre) for other, sign in row}
            ends = zip(outer, (-1, 1), sliding)
            slides += [(each, network.joint_at(each), (turn * way, centre)) for each, way, slide in ends if slide]
    return found, slides


def _row(network: Drawn, first: str) -> tuple[list[tuple[str, int]], bool]:
    """Return strips that follow each other, 1 where one is passed from start to finish, else -1; and whether they close."""
    row = [(first, 1)]
    for way in (1, -1):
        each = JointEnd(first, FINISH if way > 0 else START)
        while name := network.joint_at(each):
            there = network.joints[name].members
            if len(there) > 2 or any(any(one.arm) for one in there):
                what = f"{len(there)} strips meet" if len(there) > 2 else "arms are"
                raise ValueError(f"pressure: {what} at {network.said(each)!r}, {_ADVICE}")
            others = [one for one in there if (one.member, one.end) != (each.member, each.end)]
            if not others:
                break
            other = others[0].member
            if other == first:
                return row, True
            sign = way if others[0].end == START else -way
            row.insert(len(row) if way > 0 else 0, (other, sign))
            each = JointEnd(other, START if others[0].end == FINISH else FINISH)
    return row, False


def _slides(network: Drawn, each: JointEnd) -> bool:
    """Return whether the last end of a row slides in the plane; raise ValueError if it is free there."""
    end = network.held.get(network.joint_at(each))
    fixed = np.array([*(end.held if end else ()), network.pressure_normal])
    free = 3 - np.linalg.matrix_rank(fixed, tol=LOOSE)
    if free > 1:
        raise ValueError(f"pressure: {network.said(each)!r} can move freely in the plane, {_ADVICE}")
    return free == 1
