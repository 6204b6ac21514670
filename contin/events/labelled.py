"""What the label and the details of a special point say, whether it was just found or read from a file."""

from __future__ import annotations

from typing import Any, ClassVar

from contin.arrays import Array


class Finding:
    """What the location of a special point has found besides its place. Each kind of finding states what it knows."""

    #: Branches cross there.
    is_branch_point: ClassVar[bool] = False
    #: Dimension of the kernel beyond the tangent of the branch.
    nullity = 1

    @property
    def leaving(self) -> tuple[Array, ...]:
        """Unit tangents of the branches that meet there, first that of the branch it was found on."""
        return ()

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


def finding_of(details: Any) -> Finding:
    """Return what a location has found, of the details of a point; these may be numbers, or whatever a user's function says."""
    return details if isinstance(details, Finding) else _NOTHING


def frequency_of(point: Any) -> float | None:
    """Return the frequency of a Hopf or torus bifurcation; None where it was stored without it."""
    known = isinstance(point.details, dict) and "frequency" in point.details
    return float(point.details["frequency"]) if known else None


def doubles(point: Any) -> bool:
    """Return whether `doubled` orbits leave a point: a period doubling, or a branch point at which a symmetry breaks."""
    return point.label == "PD" or (point.label == "BP" and isinstance(point.details, dict))
