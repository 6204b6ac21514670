"""Errors of what is found at points, which are located again on a mesh twice as fine."""

from __future__ import annotations

from collections.abc import Callable, Mapping

import numpy as np

from branches.scene.labels import label_of
from contin import Point
from contin.lowlevel import Label, error, point_of

#: An error is given as no less than this part of the largest value of its kind: 16 units in the last place.
_ROUND_OFF = 16 * float(np.finfo(float).eps)

Found = Callable[[Point], Mapping[str, float]]


def errors_of(point: Point, found: Found) -> dict[str, float]:
    """Return the estimated errors of what is found at a point, by name; NaN where it is not found again.

    To what contin says of a number (`contin.Point.error`) round-off of the largest force or moment is added, which the others
    were computed with.
    """
    here = found(point)
    place = point.errors.get(point.system.free[0], np.nan)
    if point.label == Label.FAILED or (label_of(point.label).singular and np.isnan(place)):
        return dict.fromkeys(here, np.nan)
    errors = error(point, lambda trial: np.array([*found(point_of(trial.system, trial.x)).values()]))
    largest: dict[str, float] = {}
    for name, value in here.items():
        largest[_kind(name)] = max(largest.get(_kind(name), 0.0), abs(value))
    left = point.newton_error + _ROUND_OFF
    return {name: float(one + left * largest[_kind(name)]) for name, one in zip(here, errors)}


def _kind(name: str) -> str:
    bare = name.removeprefix("start_")
    return bare[0] if bare[0] in "FM" else name
