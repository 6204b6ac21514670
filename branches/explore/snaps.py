"""Ways down of closed strips that are let go past a fold, for the page: those of `ribbon_model.descent.let_go`."""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import replace

import numpy as np

from branches.draw.strip import steady
from branches.explore.packing import column, compressed
from branches.explore.profiles import MOST_NODES
from branches.store.branch import StoredBranch
from contin import ConvergenceError
from ribbon_model.descent import METRICS, SEGMENTS, Descent, Rest, let_go, past
from ribbon_model.segments import discretized
from ribbon_model.shape import Shape, quaternions

#: Strips on the way that the page holds. With half as many the film of the longest way (1, 2) stutters.
_FRAMES = 40


def way_down(branch: StoredBranch, event: np.void) -> dict | None:
    """Return what a strip does that is pushed past a fold, for the page; None unless it is stable on one side of the fold.

    Returns
    -------
    dict
        ``kappa_n`` where it is let go; ``ends``: the states in which it comes to rest, of both metrics and both signs of the
        kick, each once; ``columns`` and ``shapes`` on the first of these ways. Or ``failed``, a sentence.
    """
    if "index_before" not in event.dtype.names or 0 not in (event["index_before"], event["index_after"]):
        return None
    point, limit = int(event["point"]), float(event["kappa_n"])
    kappa_n = past(limit, 1 if branch.points["kappa_n"][point - 1] < limit else -1)
    try:
        strip = replace(discretized(branch.solution(point).equilibrium(), SEGMENTS), kappa_n=kappa_n)
        ways = [let_go(strip, metric, sign) for metric in METRICS for sign in (1, -1)]
    except (ArithmeticError, ConvergenceError, ValueError) as error:
        return {"kappa_n": kappa_n, "failed": str(error)}
    ends = {str(rest): _end(rest) for _, rest in ways}
    return {"kappa_n": kappa_n, "ends": list(ends.values())} | _film(ways[0][0])


def _end(rest: Rest) -> dict:
    return {"name": str(rest), "kind": rest.kind, "m": rest.m, "n": rest.n, "energy": rest.energy}


def _film(descent: Descent) -> dict:
    """Return columns and shapes of strips at equal distances along the way, each turned so that it moves least."""
    strips = list(dict.fromkeys(descent.frames(_FRAMES)))
    shapes = steady({number: strip.shape(MOST_NODES).placed(2 * math.pi) for number, strip in enumerate(strips)})
    values = states_of(shapes.values())
    columns = {"arclength": np.arange(len(strips)), "kappa_n": descent.end.kappa_n, "energy": [one.energy for one in strips]}
    packed = {name: column(np.broadcast_to(numbers, len(strips)).astype(float)) for name, numbers in columns.items()}
    return {"columns": packed, "shapes": compressed(values)}


def states_of(shapes: Iterable[Shape]) -> np.ndarray:
    """Return the states of shapes at their nodes, shape (shapes, nodes, len(branches.explore.strips.CHANNELS))."""
    values = np.array([np.column_stack([quaternions(shape.directors), shape.eta, shape.centreline]) for shape in shapes])
    for before, here in zip(values, values[1:]):  # a quaternion and its negative are the same frame
        here[:, :4] *= math.copysign(1, np.vdot(before[:, :4], here[:, :4]))
    return values
