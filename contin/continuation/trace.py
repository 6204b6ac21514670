"""A run from a point of a branch."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from contin import checks
from contin.continuation.cycle_starts import doubled, from_hopf
from contin.continuation.run import follow_until_interrupted
from contin.detection.branch_point import BranchPoint
from contin.detection.multiple_point import MultiplePoint
from contin.discretization.system import System
from contin.errors import ProblemError
from contin.problems.statement import forget_changed
from contin.results.branch import Branch
from contin.results.point import Point, system_of
from contin.stepping.settings import Settings, settings_with


def trace(start: Point, settings: Settings | None = None, *, free: Sequence[str] | None = None, branch: int | None = None,
          **options: Any) -> Branch:  # fmt: skip
    """Follow the branch through a point, or away from a branch point, to its end.

    Ctrl-C ends the run: the branch so far is returned.

    Parameters
    ----------
    start : Point
        Of `solve`, of another branch, or read back.
    settings : Settings, optional
        Or any of its fields by name.
    free : sequence of str, optional
        Free parameters, if they shall differ from those of ``start``; the first is the primary one.
    branch : int, optional
        Which branch to take from a branch point: 0 the one that ``start`` was found on, 1 the other one. ``direction=-1`` takes
        the opposite way.

    Raises
    ------
    ProblemError, ConvergenceError

    Examples
    --------
    >>> from contin import AlgebraicProblem, solve
    >>> pitchfork = AlgebraicProblem(lambda u, p: (u.x * (p.a - u.x**2),), ["x"], {"a": -1.0})
    >>> trivial = trace(solve(pitchfork, [0.0]), free=["a"], limits={"a": (-1, 1)})
    >>> forked = trace(trivial.labelled("BP")[0], branch=1, limits={"a": (-1, 1)})
    >>> print(round(abs(forked.points[-1].x[0]), 9))
    1.0
    """
    checks.instance("start", start, Point, "a Point")
    settings = settings_with(settings, options)
    system, x = start.system, start.x
    if isinstance(system, System) and forget_changed(system.problem):
        system = system.with_parameters({})
    if free is not None and checks.names("free", free) != system.free:
        own = system if isinstance(system, System) else system_of(start, "start")
        system, x = own.with_free(free, x)
    if branch is None:
        return follow_until_interrupted(system, x, settings)
    checks.whole("branch", branch, 0, 10)
    if start.label in ("HB", "PD") and branch == 1:
        cycles, x, tangent = from_hopf(start) if start.label == "HB" else doubled(start)
        return follow_until_interrupted(cycles, x, settings, settings.direction * tangent)
    if not isinstance(start.details, (BranchPoint, MultiplePoint)):
        raise ProblemError("branch: the start is not a branch point")
    if not 0 <= branch < len(start.details.tangents):
        raise ProblemError(f"branch: {branch} must lie between 0 and {len(start.details.tangents) - 1}")
    return follow_until_interrupted(system, x, settings, settings.direction * start.details.tangents[branch])
