"""First states of networks that Newton's method does not reach: the energy of the network of segments is minimised.

The state that the drawing without stress was brought to is cut into segments (`ribbon_model.network_segments`), joined, and
follows its energy downhill until it rests (`ribbon_model.descent`). From there Newton's method leads to the state. It is a
minimum, if not always the nearest one.
"""

from __future__ import annotations

import functools
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from contin import ContinError, Point
from ribbon_model.descent import SEGMENTS
from ribbon_model.network import ASSEMBLY, Network, OutOfReach
from ribbon_model.shape import quaternions

if TYPE_CHECKING:
    from ribbon_model.network_segments import Piece


def first_state(network: Network, intervals: int = 10, degree: int = 6, **options) -> tuple[Point, str]:
    """Return a first state as `Network.first_point` does or, where it has none, by descent; and how it was found, in words.

    Raises
    ------
    ProblemError
        No state was found, or nothing determines it.
    """
    try:
        return network.first_point(None, None, intervals, degree, **options)
    except OutOfReach as error:
        try:
            point = network.state_near(downhill(network, error.nearest), intervals=intervals, degree=degree, **options)
        except (ContinError, ValueError):
            raise error from None
        return point, "from the drawing, by descent of its energy"


def downhill(network: Network, point: Point) -> list:
    """Return a guess, one function of s for each member: where the network of segments rests that begins at a point.

    Raises
    ------
    ValueError
        It cannot be joined, or does not come to rest.
    """
    from ribbon_model import descent, network_segments  # SciPy, which other first states do not need

    drawing = network_segments.cut(network, point.system, point.x, SEGMENTS)
    chain = replace(drawing, numbers={**drawing.numbers, ASSEMBLY: 1.0}).moved(np.zeros(drawing.size))
    way = descent.descend(chain, longest=descent.LONGEST / network.longest)
    if not way.rests:
        raise ValueError("the network of segments does not come to rest")
    return [functools.partial(_at, piece.segment, _states(piece)) for piece in way.end.pieces]


def _states(piece: Piece) -> np.ndarray:
    """Return quaternions, continuous along the strip, and places (N + 1, 7) of the ends of segments."""
    return np.hstack([quaternions(piece.axes.swapaxes(1, 2)), piece.place + piece.centreline])


def _at(segment: float, states: np.ndarray, s: float) -> np.ndarray:
    """Return quaternion and place (7,) at a distance from the beginning, on straight lines between ends of segments."""
    number = min(int(s / segment), len(states) - 2)
    part = s / segment - number
    state = (1 - part) * states[number] + part * states[number + 1]
    state[:4] /= np.linalg.norm(state[:4])
    return state
