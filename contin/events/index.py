"""The index along a branch: what a change of it says of the special points in a step, and what is left of it at these."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

from contin.core.labels import SINGULAR
from contin.core.trial import Event
from contin.events.arc import Arc, SpecialPoint
from contin.events.labelled import finding_of


def contradiction(index: Event | None, arc: Arc, special: Iterable[SpecialPoint]) -> str:
    """Return how the index over a step contradicts its special points, as a clause; "" where it does not.

    It changes at special points only, by no more than the dimension of what vanishes there. A larger change means that
    something was passed in silence. The index knows nothing of how special points are found.
    """
    if index is None:
        return ""
    before, after = arc.before.value(index), arc.trial.value(index)
    if not abs(after - before) > sum(map(nullity_of, special)):
        return ""
    return f"the {index.name} goes from {before:g} to {after:g}"


@dataclass(frozen=True)
class Stability:
    """Index, nullity and broken symmetries of a point, as in `contin.Point`."""

    index: int | None = None
    nullity: int = 0
    breaks: tuple[str, ...] = ()


def nullity_of(point: SpecialPoint) -> int:
    """Return the dimension of the kernel at a point: 1 at a fold, 1 or more at a branch point, else 0."""
    if not (point.label in SINGULAR or point.is_trivial):
        return 0
    return finding_of(point.details).nullity
