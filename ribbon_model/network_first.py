"""First states of networks that Newton's method does not reach: the energy of the network of segments is minimised.

The state that the drawing without stress was brought to is cut into segments (`ribbon_model.network_segments`), joined, and
follows its energy downhill until it rests (`ribbon_model.descent`). From there Newton's method leads to the state. It is a
minimum, if not always the nearest one.
"""

from __future__ import annotations

import functools
import itertools
import math
from collections.abc import Mapping
from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np

from contin import ContinError, Point, ProblemError
from contin.lowlevel import levels
from ribbon_model.descent import SEGMENTS
from ribbon_model.ends import product
from ribbon_model.equilibrium import directors
from ribbon_model.members import JointEnd
from ribbon_model.network import ASSEMBLY, Network, OutOfReach
from ribbon_model.shape import quaternions

if TYPE_CHECKING:
    from ribbon_model.network_segments import Piece


def first_state(
    network: Network, intervals: int = 10, degree: int = 6, grows: Mapping[str, float] | None = None, **options
) -> tuple[Point, str]:
    """Return a first state as `Network.first_point` does or, where it has none, by descent; and how it was found, in words.

    Where a network floats and the loads that turn it are zero, that which ``grows``, to a value, is as small as may be.

    Raises
    ------
    ProblemError
        No state was found, or nothing determines it.
    """
    options = {"intervals": intervals, "degree": degree, **options}
    for name, value in (grows or {}).items() if network.is_idle else ():
        if name in network.turning:
            return _turned(network, name, math.copysign(levels.APART * network.force, value), options)
    try:
        return network.first_point(None, None, **options)
    except OutOfReach as error:
        try:
            point = network.state_near(downhill(network, error.nearest), **options)
        except (ContinError, ValueError):
            raise error from None
        return point, "from the drawing, by descent of its energy"


def _turned(network: Network, name: str, value: float, options: Mapping[str, Any]) -> tuple[Point, str]:
    """Return a state of a network that floats under a small load: that without loads, turned as little as the load allows.

    With the moment of forces f at places x, sum of f x^T = A, all turns R for which A R^T is symmetric are in equilibrium.
    """
    bare = replace(network, loads={}, numbers={each: x for each, x in network.numbers.items() if each not in network.turning})
    state, how = first_state(bare, **options)
    at = network.lever(state, name)
    left, sizes, right = np.linalg.svd(at)
    if sizes[0] < levels.LOCATED * network.longest:
        raise ProblemError(f"loads: {name} does not turn the network, which floats; hold a joint")
    if sizes[1] < levels.LOCATED * sizes[0]:  # the line of the load stays as near as it can
        along, line = left[:, 0], right[0] * (np.sign(np.round(left[:, 0] @ right[0], 9)) or 1.0)
        turn = np.array([1 + line @ along, *np.cross(line, along)])
    else:
        turns = [left * np.array(signs) @ right for signs in itertools.product((1, -1), repeat=3)]
        turns = [one for one in turns if np.linalg.det(one) > 0]
        turn = quaternions(max(turns, key=np.trace).T[None])[0]
    turn, origin = turn / np.linalg.norm(turn), network.drawn(JointEnd(next(iter(network.members))))[4:]
    frame = np.array(directors(*turn)).reshape(3, 3)

    def member(number: int, length: float):
        def begun(s):
            row = state.system.evaluate(state.x, np.array([s / length]))[0, bare.places[number]]
            return np.array([*product(tuple(turn), tuple(row[:4])), *(origin + (row[4:7] - origin) @ frame)])

        return begun

    guess = [member(number, one.length) for number, one in enumerate(network.members.values())]
    point = network.state_near(guess, {name: value}, **options)
    return point, f"{how}, at {name} = {value:.3g}: at 0 nothing determines how the network is turned"


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
