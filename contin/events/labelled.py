"""What the label and the details of a special point say, whether it was just found or read from a file."""

from __future__ import annotations

from typing import Any, ClassVar

import numpy as np

from contin.arrays import Array
from contin.core.newton import Newton
from contin.core.protocol import Carrier, Discretization
from contin.core.trial import Linearization, Trial
from contin.errors import ConvergenceError


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
        return ()

    #: Whether equations of its own locate it again, and not those of a test function.
    has_equations: ClassVar[bool] = False

    def again(self, system: Discretization, carry: Carrier, x: Array, newton: Newton) -> Any:
        """Return the same finding on another mesh, to which ``carry`` takes x.

        Raises
        ------
        ConvergenceError
            It was not found, or another one was.
        """
        raise NotImplementedError(f"a {type(self).__name__} has no equations")

    def there(self, system: Discretization, tangent: Array) -> Trial:
        """Return the point that was found, with a tangent."""
        own: Any = self
        return Trial(system, own.x, Linearization(tangent, np.nan))

    def round_off(self, system: Discretization, newton: Newton) -> Array | float:
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


def frequency_of(point: Any) -> float | None:
    """Return the frequency of a Hopf or torus bifurcation; None where it was stored without it."""
    known = isinstance(point.details, dict) and "frequency" in point.details
    return float(point.details["frequency"]) if known else None
