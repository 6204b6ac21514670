"""What the label and the details of a special point say, whether it was just found or read from a file."""

from __future__ import annotations

from typing import Any


def frequency_of(point: Any) -> float | None:
    """Return the frequency of a Hopf or torus bifurcation; None where it was stored without it."""
    known = isinstance(point.details, dict) and "frequency" in point.details
    return float(point.details["frequency"]) if known else None


def doubles(point: Any) -> bool:
    """Return whether `doubled` orbits leave a point: a period doubling, or a branch point at which a symmetry breaks."""
    return point.label == "PD" or (point.label == "BP" and isinstance(point.details, dict))
