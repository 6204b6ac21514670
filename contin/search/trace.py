"""A run from a point of a branch."""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence
from typing import Any, Unpack

import numpy as np

from contin import checks
from contin.arrays import Array
from contin.continuation.progress import Progress, follow_until_interrupted
from contin.continuation.run import Continuation
from contin.core.labels import Label
from contin.core.protocol import Discretization
from contin.core.settings import Options, Settings, settings_with
from contin.errors import ConvergenceError, ProblemError, warn
from contin.events.branch_point import locate_branch_point
from contin.events.labelled import finding_of
from contin.levels import APART
from contin.linalg.orientation import oriented_along
from contin.problems.statement import forget_changed
from contin.results.branch import Branch
from contin.results.point import Point, underlying
from contin.search.connection_starts import from_non_central, leaves_saddle_node
from contin.search.cycle_starts import switched, switches
from contin.search.field_starts import begins_oscillations, oscillation


@checks.arguments
def trace(start: Point, settings: Settings | None = None, *, free: Sequence[str] | None = None, branch: int | None = None,
          tangent: Array | None = None, progress: bool | None = None, **options: Unpack[Options]) -> Branch:  # fmt: skip
    """Follow the branch through a point, or away from a branch point, to its end.

    Ctrl-C ends the run: the branch so far is returned.

    Parameters
    ----------
    start : Point
        Of `solve`, of another branch, or read back.
    settings : Settings, optional
        Or any of its fields by name.
    free : sequence of str, optional
        Free parameters, if they shall differ from those of ``start``; the first is the primary one. From a point of a curve in
        two parameters they lead to the branch of solutions through it (where folds meet a branch point, to those that cross
        there). With ``branch=1`` at HB and PD, those of the new branch: by default that in which the point was found, of a
        point of a curve the first of the curve.
    branch : int, optional
        Which branch to take from a branch point: 0 the one that ``start`` was found on, 1 the other one. ``direction=-1`` takes
        the opposite way. Every point of a curve of HB, PD or BP is such a point (of BP either may be 0). 0 is the only one
        where no other begins. At NCH, 1 is the curve of homoclinic orbits to the saddle-node or, from there, to the saddle. By
        default the one that it was found on, with ``direction`` that of the primary parameter.
    tangent : ndarray, shape (size,), optional
        Where branches cross and ``start`` does not know their tangents, as a solution that is known in closed form does
        (`contin.lowlevel.point_of`): the one to leave along, in the unknowns of ``start.system``.
    progress : bool, optional
        Show one line on standard error while the run is under way: by default where standard error is a terminal.

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
    settings, shown = settings_with(settings, options), Progress(progress)
    system, x, along, singular = _first(start, settings, free, branch, tangent)
    return follow_until_interrupted(Continuation(system, x, settings, along, singular=singular), shown)


def _first(
    start: Point, settings: Settings, free: Sequence[str] | None, branch: int | None, tangent: Array | None
) -> tuple[Discretization, Array, Array | None, bool]:
    """Return the system of a run, its first x, the tangent there where Newton's method shall not find it, and whether branches
    cross there.
    """
    if start.system.on_curve and (free is not None or branch is not None and not finding_of(start.details).is_branch_point):
        start, free = _solution(start, free)
    system: Any = start.system
    x, way = start.x, settings.direction
    if not system.on_curve and forget_changed(system.problem):
        system = system.with_parameters({})
    if tangent is not None:
        if branch is not None or free is not None:
            raise ProblemError("tangent: must be left out where branch or free is given")
        return system, x, way * checks.array("tangent", tangent, (system.size,)), True
    if branch is not None:
        checks.whole("branch", branch, 0, 10)
    if branch == 1 and switches(start):
        cycles, x, along = switched(start, settings.mesh.min_intervals, free)
        return cycles, x, way * along, True
    if branch == 1 and begins_oscillations(start):
        first, along = oscillation(start)
        oscillations: Any = first.system
        if free is not None and checks.names("free", free) != oscillations.free:
            raise ProblemError(f"free: must be left out, or {', '.join(oscillations.free)}, with which oscillations begin")
        return oscillations, first.x, way * along, True
    if branch == 1 and leaves_saddle_node(start):
        if free is not None:
            raise ProblemError("free: the curve that leaves at NCH has the parameters of the one it was found on; leave it out")
        orbits, x, along = from_non_central(start)
        return orbits, x, way * along, False
    if free is not None and checks.names("free", free) != system.free:
        system, x = system.with_free(free, x)
    if start.label == Label.BRANCH_POINT and start.details is None:  # of `solve`
        start = _as_branch_point(dataclasses.replace(start, system=system, x=x))
        x = start.x
    if branch is None or (branch == 0 and not finding_of(start.details).is_branch_point):
        return system, x, _own_tangent(start, system, settings), True
    return system, x, way * _tangent(start, system, branch), True


def follow(
    system: Discretization, x: Array, settings: Settings = Settings(), tangent: Array | None = None, singular: bool = True
) -> Branch:
    """Return `contin.trace` of a first point, under the name and with the arguments of version 0.2.

    Examples
    --------
    >>> from contin import AlgebraicProblem
    >>> from contin.lowlevel import Algebraic, point_of
    >>> parabola = Algebraic(AlgebraicProblem(lambda u, p: (p.a - u.x**2,), ["x"], {"a": 1.0}), ["a"])
    >>> branch = trace(point_of(parabola, np.array([1.0, 1.0])), direction=-1, limits={"a": (-1, 4)})  # in place of it
    >>> [point.label for point in branch if point.label]
    ['EP', 'LP', 'EP']
    """
    warn(
        "contin.lowlevel.follow(system, x, ...) is contin.trace(contin.lowlevel.point_of(system, x), ...) now",
        DeprecationWarning,
    )
    run = Continuation(system, x, settings, tangent, singular=singular)
    return Branch(list(run), run.stop, run.notes)


def _solution(start: Point, free: Sequence[str] | None) -> tuple[Point, tuple[str, ...]]:
    """Return the solution itself of a point of a curve, as a point of its branch, and the free parameters of that branch.

    These are the first ones of the curve where none are given. Branch points, and points where folds meet one, are located.
    """
    found, curve = underlying(start), start.system
    solution: Any = curve.solution
    names = checks.names("free", curve.free[: solution.problem.free_size] if free is None else free)
    if found.label == Label.HOPF:  # of equilibria: the parameters are those of cycles
        return found, names
    system, x = found.system.with_free(names, found.x)  # type: ignore[attr-defined]
    found = dataclasses.replace(found, x=x, tangent=np.full(x.size, np.nan), system=system)
    if Label.BRANCH_POINT not in (start.label, found.label):
        return found, names
    return _as_branch_point(found), names


def _as_branch_point(found: Point) -> Point:
    """Return a solution as the branch point that it is, with the branches that leave; itself where it is none."""
    try:
        point = locate_branch_point(found.system, found.x)
    except ConvergenceError:
        return found
    if not np.abs(point.x - found.x).max() < APART * (1 + np.abs(found.x).max()):
        return found  # as at a fold in the other parameter
    return dataclasses.replace(found, label=Label.BRANCH_POINT, x=point.x, details=point)


def _own_tangent(start: Point, system: Discretization, settings: Settings) -> Array | None:
    """Return the tangent of the branch that a branch point was found on, oriented; None at other points."""
    known = finding_of(start.details)
    if not known.leaving or system is not start.system:
        return None  # elsewhere the equations tell it
    tangent: Array = known.leaving[0]
    rate = tangent[system.parameter_index(settings.primary or system.free[0])]
    return settings.direction * oriented_along(tangent, rate)


def _tangent(start: Point, system: Discretization, branch: int) -> Array:
    """Return a tangent of a branch point, in the free parameters of a system: those of the point, in any order.

    Raises
    ------
    ProblemError
        The start is no branch point, or one in other parameters, or has fewer branches.
    """
    known = finding_of(start.details)
    if not known.is_branch_point:
        first = "0 or 1" if switches(start) else "0"
        labelled = f"a point labelled {start.label or 'nothing'!r}"
        raise ProblemError(f"branch: {branch} must be {first} at {labelled}; other branches begin at BP, HB and PD")
    if set(system.free) != set(start.system.free):
        own = ", ".join(start.system.free)
        raise ProblemError(f"free: {', '.join(system.free)} must be {own}, with which the branch point was found")
    if not 0 <= branch < len(known.leaving):
        raise ProblemError(f"branch: {branch} must lie between 0 and {len(known.leaving) - 1}")
    tangent: Array = known.leaving[branch]
    if not start.system.on_curve:
        at = [start.system.parameter_index(name) for name in system.free]
        tangent = np.concatenate([tangent[: system.state_size], tangent[at]])
    return tangent
