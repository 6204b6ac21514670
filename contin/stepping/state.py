"""State of a run between two steps, and why a run stopped."""

from __future__ import annotations

from dataclasses import dataclass

from contin.arrays import Array
from contin.discretization.protocol import Discretization


@dataclass(frozen=True, eq=False)
class State:
    """Everything that the next step depends on; with it a run continues as if never interrupted.

    ``x``, ``tangent`` and ``previous_tangent`` live on ``system``; ``sign`` is that of the determinant on this mesh;
    ``accepted`` counts the regular points; ``singular`` says that x is a branch point.
    """

    system: Discretization
    x: Array
    tangent: Array
    previous_tangent: Array | None
    previous_step: float
    step: float
    sign: float
    arclength: float
    accepted: int
    singular: bool


@dataclass(frozen=True)
class Stop:
    """Why a run ended: a short ``reason``, a sentence, and what could be changed."""

    reason: str
    message: str
    advice: str = ""

    def __str__(self) -> str:
        return f"{self.message}; {self.advice}" if self.advice else self.message
