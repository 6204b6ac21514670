"""What labelled points hold: findings, and the number of unstable directions on both sides."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from typing import Any, ClassVar

import numpy as np

from contin.arrays import Array
from contin.core.labels import SINGULAR
from contin.core.newton import Newton
from contin.core.protocol import Carrier, Discretization
from contin.core.trial import Event, Linearization, Trial
from contin.errors import ConvergenceError
from contin.events.arc import Arc, SpecialPoint


class Elsewhere(ConvergenceError):
    """What was found again is another point, or nothing: the one that was looked for is not there."""


class Finding:
    """What the location of a special point has found besides its place. Each kind of finding states what it knows."""

    #: Branches cross there.
    is_branch_point: ClassVar[bool] = False
    #: It was not located.
    is_lost: ClassVar[bool] = False
    #: Dimension of the kernel beyond the tangent of the branch.
    nullity = 1

    @property
    def leaving(self) -> tuple[Array, ...]:
        """Unit tangents of the branches that meet there, first that of the branch it was found on."""
        return getattr(self, "tangents", ())

    #: Whether equations of its own locate it again, and not those of a test function.
    has_equations: ClassVar[bool] = False

    def again(self, system: Discretization, carry: Carrier, x: Array, newton: Newton) -> Any:
        """Return the same finding on another mesh, to which ``carry`` takes x.

        Raises ConvergenceError where it was not found, or another one was.
        """
        raise NotImplementedError(f"a {type(self).__name__} has no equations")

    def there(self: Any, system: Discretization, tangent: Array) -> Trial:
        """Return the point that was found, with a tangent."""
        return Trial(system, self.x, Linearization(tangent, np.nan))

    def round_off(self, system: Discretization) -> Array | float:
        """Return by how much free parameters are off where Newton's method ends by round-off, shape (further unknowns,)."""
        return 0.0

    def split(self, system: Discretization) -> Array | float:
        """Return by how much free parameters differ between the finding and what it may consist of, (further unknowns,)."""
        return 0.0

    @property
    def is_simple_branch_point(self) -> bool:
        """Two branches cross there."""
        return self.is_branch_point and self.nullity == 1

    @property
    def arrays(self) -> dict[str, Array]:
        """What is stored, by name."""
        return {}

    @property
    def numbers(self) -> dict[str, Any]:
        """What is stored besides."""
        return {}


#: Of special points that were found by a change of sign alone.
_NOTHING = Finding()


def finding_of(details: object) -> Finding:
    """Return what a location has found, of the details of a point; these may be numbers, or whatever a user's function says."""
    return details if isinstance(details, Finding) else _NOTHING


def located_details(point: Any) -> Any:
    """Return the details of a point as its location has found them: a normal form is computed when these are first read."""
    told = vars(point).get("_told")
    return point.details if told is None else told[0]


def frequency_of(point: Any) -> float | None:
    """Return the frequency of a Hopf or torus bifurcation; None where it was stored without it."""
    details = located_details(point)
    return float(details["frequency"]) if isinstance(details, dict) and "frequency" in details else None


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
    return 0 if not (point.label in SINGULAR or point.is_trivial) else finding_of(point.details).nullity
