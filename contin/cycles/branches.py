"""What cycles, of vector fields and of maps, know of their branches."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

import numpy as np

from contin.arrays import Array
from contin.core.labels import Label
from contin.core.protocol import Discretization
from contin.core.trial import Event
from contin.cycles.curves import DoublingCurve, TorusCurve
from contin.cycles.floquet import critical_angle, doubled, doubles, doubling, torus, unstable
from contin.cycles.folds import events_on_folds
from contin.events.arc import SpecialPoint


class OfCycles(Discretization):
    """Hooks that both kinds of system answer alike: multipliers say all of it."""

    @property
    def starts_cycles(self) -> bool:
        """Yes: of twice the length."""
        return True

    @property
    def is_cycle(self) -> bool:
        """Yes."""
        return True

    def unstable(self, x: Array) -> int:
        """Return the number of unstable multipliers, without one that is always 1."""
        system: Any = self
        return unstable(system, x)

    @property
    def curves(self) -> Mapping[str, type]:
        """Those of period doublings and torus bifurcations."""
        return {kind.kind: kind for kind in (DoublingCurve, TorusCurve)}

    def defining(self, point: Any, x: Array) -> tuple[Any, Array] | None:
        """Return those of period doublings (or a symmetry that breaks) and torus bifurcations."""
        system: Any = self
        if doubles(point):
            return DoublingCurve(system), x
        if point.label == Label.TORUS:
            return TorusCurve(system), np.append(x, math.cos(critical_angle(system, point, x)))
        return None

    def events(self) -> list[Event]:
        """Return those of period doublings (or a symmetry that breaks) and torus bifurcations."""
        return [doubling(self.order), torus()]

    def events_on_folds(self) -> list[Event]:
        """Return those of a further multiplier 1, or another one -1, and of the end where cycles shrink."""
        system: Any = self
        return events_on_folds(system)

    def judged(self, point: SpecialPoint) -> SpecialPoint:
        """Return a special point, as the end where cycles go twice round ones of half the length."""
        system: Any = self
        return doubled(system, point)
