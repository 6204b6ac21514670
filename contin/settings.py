"""What to follow, how carefully, and where to stop."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

from contin.corrector import Newton
from contin.errors import ProblemError
from contin.events import Monitor
from contin.mesh import MeshControl


@dataclass(frozen=True)
class Settings:
    """What to follow, how carefully, and where to stop. Frozen, checked when made.

    Attributes
    ----------
    primary : str, optional
        The parameter of folds and of the printed columns; the first free one by default.
    direction : int
        +1 or -1: the way to go from the first point, by the sign of the primary parameter's change.
    step, min_step, max_step : float
        First, smallest and largest step of arclength.
    max_points : int
        Regular points after which the run ends.
    limits : mapping of str to pair of float
        The run ends where a parameter or functional leaves its interval.
    zeros : mapping of str to sequence of float
        Values of parameters or functionals to label (UZ).
    trivial : str, optional
        A parameter or functional that vanishes on a known trivial branch only: the run ends where it changes sign.
    monitors : sequence of Monitor
        Events of one's own.
    folds, branch_points, errors : bool
        Whether to look for folds, for branch points, and to solve labelled points again on the mesh halved, until that
        changes them by less than the mesh tolerance: the last change is their error estimate.
    angle : float
        Largest angle between the tangents of consecutive points, radians.
    change : float
        Largest change of any free parameter p in one step, as a fraction of 1 + |p|.
    accuracy : float
        Distance between predicted and corrected point that the step aims at, as a fraction of the step.
    newton, mesh :
        See :class:`Newton`, :class:`MeshControl`.
    """

    primary: str | None = None
    direction: int = 1
    step: float = 0.05
    min_step: float = 1e-6
    max_step: float = 1e6
    max_points: int = 2000
    limits: Mapping[str, Sequence[float]] = field(default_factory=dict)
    zeros: Mapping[str, Sequence[float]] = field(default_factory=dict)
    trivial: str | None = None
    monitors: Sequence[Monitor] = ()
    folds: bool = True
    branch_points: bool = True
    errors: bool = True
    angle: float = 0.35
    change: float = 0.4
    accuracy: float = 0.02
    newton: Newton = field(default_factory=Newton)
    mesh: MeshControl = field(default_factory=MeshControl)

    def __post_init__(self):
        if self.direction not in (1, -1):
            raise ProblemError(f"direction: {self.direction} must be +1 or -1")
        if not 0 < self.min_step <= self.step <= self.max_step:
            raise ProblemError(
                f"step: {self.step} must be positive and lie between min_step {self.min_step} and max_step {self.max_step}"
            )
        if self.max_points < 1:
            raise ProblemError(f"max_points: {self.max_points} must be at least 1")
        for name in ("angle", "accuracy", "change"):
            if not 0 < getattr(self, name) < 1.5:
                raise ProblemError(f"{name}: {getattr(self, name)} must lie between 0 and 1.5")
        for name, ends in self.limits.items():
            if len(ends) != 2 or not ends[0] < ends[1]:
                raise ProblemError(f"limits: {name}: {ends} must be two numbers, the first the smaller")
