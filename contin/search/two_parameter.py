"""Curves of special points in two parameters, and in more."""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence
from functools import partial
from typing import Any, Unpack

import numpy as np

from contin import checks
from contin.arrays import Array
from contin.continuation.progress import Progress, follow_until_interrupted
from contin.continuation.run import Continuation
from contin.core.labels import Label
from contin.core.settings import Options, Settings, settings_with
from contin.core.system import System
from contin.core.trial import Event, Trial
from contin.defining.branch_point_curve import BranchPointCurve
from contin.defining.event_curve import EventCurve
from contin.defining.extremum_curve import ExtremumCurve
from contin.defining.fold_curve import FoldCurve
from contin.defining.system import Defining
from contin.errors import ProblemError
from contin.levels import APART
from contin.results.branch import Branch
from contin.results.point import Point
from contin.search.codimension_two import leaving


@checks.arguments
def curve(start: Point, second: str | None = None, settings: Settings | None = None, *, free: Sequence[str] | None = None,
          event: Event | None = None, hold: str | None = None, kind: str | None = None, branch: int = 0,
          progress: bool | None = None, **options: Unpack[Options]) -> Branch:  # fmt: skip
    """Follow the curve of special points of one kind through one of them, in two parameters or more.

    From a point of such a curve, without a further parameter, it goes on; ``kind`` takes another one that leaves there.

    Parameters
    ----------
    start : Point
        A labelled point of a branch: LP, BP, HB (of equilibria), PD, TR, an extremum (EX), or where a column has a value (UZ,
        EP); of homoclinic orbits IFS, OFS, NCH, ..., too. Or one of a curve, followed with one parameter more: an extremum of
        its own column, the fold of a curve of folds with respect to its first parameter, a user zero, or of codimension two.
    second : str, optional
        The parameter that is free beside those of the branch.
    settings : Settings, optional
        Or any of its fields by name. Defaults: ``primary``, of which folds are labelled, is ``second``; no ``branch_points``.
    free : pair of str, optional
        Both parameters, in place of ``second``; the first one replaces that in which the start was found.
    event : Event, optional
        The one of yours (``events``) that labelled the start.
    hold : str, optional
        A column that keeps the value of any start, such as ``"period"``; ``branch_points=True`` labels where curves cross.
    kind : str, optional
        From BT, GH, ZH, HH: ``"LP"``, ``"HB"``, ``"TR"`` or ``"homoclinic"``, as in `Point.curves`; some begin a little beside.
    branch : int
        With ``kind="TR"`` at a double Hopf point: 0 for the cycles of the pair on whose curve it was found, 1 for the other.
    progress : bool, optional
        As in `trace`.

    Returns
    -------
    Branch
        Labels: LP (the curve turns); CP, BP, BT, GH, ZH and HH of equilibria; CP, GPD, CH, R1 to R4, LPPD and LPTR of cycles;
        EX, an extremum in one parameter more. Columns: ``frequency`` and ``lyapunov`` of Hopf points, ``normal_form`` of period
        doublings and torus bifurcations, ``angle`` of the latter. The last entry of x on curves of BP is their imperfection.

    Raises
    ------
    ProblemError
        The start is none of these, or a name is no parameter.

    Examples
    --------
    >>> from contin import AlgebraicProblem, solve, trace
    >>> cusp = AlgebraicProblem(lambda u, p: (u.x**3 - p.b * u.x + p.a,), ["x"], {"a": 2.0, "b": 1.0})
    >>> fold = trace(solve(cusp, [-1.5]), free=["a"], direction=-1, limits={"a": (-2, 3)}).labelled("LP")[0]
    >>> folds = curve(fold, "b", direction=-1, limits={"b": (-1, 2)})
    >>> [(point.label, abs(point["b"]) < 1e-9) for point in folds.labelled("CP")]
    [('CP', True)]
    """
    shown, new = Progress(progress), any(each is not None for each in (second, free, event, hold))
    goes_on = start.system.on_curve and not new
    _check(event, hold, kind, branch, goes_on)
    names = start.system.free if goes_on else _free_parameters(start, second, free)
    settings = settings_with(settings, {"branch_points": False, "primary": names[-1], **options})
    if goes_on:
        return _from_curve(start, kind, branch, settings, shown)
    return follow_until_interrupted(Continuation(*_first_of_curve(start, names, event, hold), settings), shown)


def _check(event: Event | None, hold: str | None, kind: str | None, branch: int, goes_on: bool) -> None:
    checks.whole("branch", branch, 0, 1)
    if kind is not None and not goes_on:
        raise ProblemError("kind: is for points of codimension two of a curve, without a further parameter or event")
    if hold is not None and event is not None:
        raise ProblemError("hold: must be left out where event is given")


def _from_curve(start: Point, kind: str | None, branch: int, settings: Settings, shown: Progress) -> Branch:
    """Follow the curve of a point further, or another one that leaves there. The first point has the label of the start."""
    if kind is None:
        return follow_until_interrupted(Continuation(start.system, start.x, settings), shown)
    system, x, tangent = leaving(start, kind, branch)
    beside = tangent is not None and kind != Label.HOPF
    found = follow_until_interrupted(Continuation(system, x, settings, tangent, singular=False), shown)
    if not beside:
        found.points[0] = dataclasses.replace(found.points[0], label=start.label, name=start.name)
    return found


def _free_parameters(start: Point, second: str | None, free: Sequence[str] | None) -> tuple[str, ...]:
    """Return the free parameters of a curve: that in which the start was found first, the second parameter last."""
    system: Any = start.system
    if len(system.free) != system.problem.free_size:
        raise ProblemError("start: must be a point of a branch, with the free parameters of a curve")
    known = tuple(system.problem.parameters)
    branch = not system.on_curve
    found_in = start.column if start.label == Label.FOLD and start.column and branch else system.free[0]
    if (second is None) == (free is None):
        raise ProblemError("curve: give the second parameter, or free=[first, second]")
    if free is None:
        assert second is not None
        if second in system.free or second not in known:
            raise ProblemError(f"second: {second!r} must be a parameter that is not free ({', '.join(known)})")
        pair: tuple[str, ...] = (found_in, second)
    else:
        pair = tuple(checks.names("free", free))
    others = [name for name in system.free if name != found_in]
    allowed = [name for name in known if name not in others] if branch else list(known)
    if len(pair) != 2 or len({*pair} & {*allowed}) != 2:
        raise ProblemError(f"free: {', '.join(pair)} must be two of the parameters {', '.join(allowed)}")
    return (pair[0], *others, pair[1])


#: A defining system, and its first vector of unknowns.
_First = tuple[Defining, Array]


def _first_of_curve(start: Point, names: Sequence[str], event: Event | None, hold: str | None) -> _First:
    """Return the defining system of the kind of a point.

    Raises
    ------
    ProblemError
        It is of no kind that can be followed.
    """
    base, x = start.system.with_free(names, start.x)  # type: ignore[attr-defined]
    if event is not None:
        return _event(start, base, x, event)
    if hold is not None:
        return _value(_holding(start, hold), base, x)
    found = (_on_curve if start.system.on_curve else _on_branch)(start, base, x)
    if found is None and _is_at_a_value(start):
        found = _value(start, base, x)
    if found is None:
        raise ProblemError(f"start: a point labelled {start.label or 'nothing'!r} must be {_STARTS}")
    return found


def _on_branch(start: Point, base: System, x: Array) -> _First | None:
    """Return the defining system of special points of a branch, and its first x."""
    if start.is_simple_branch_point:
        return BranchPointCurve(base), np.append(x, 0.0)
    if start.label == Label.FOLD and start.column:
        return FoldCurve(base), x
    if start.label == Label.EXTREMUM and start.column:
        return ExtremumCurve(base, start.column), x
    return base.defining(start, x)


def _on_curve(start: Point, base: Any, x: Array) -> _First | None:
    """Return that of special points of a curve: extrema of its own column, and points of codimension two.

    A fold with respect to the parameter of a curve of folds is an extremum, too.
    """
    objective = base.stationary
    if objective and start.label in (Label.EXTREMUM, Label.FOLD) and start.column == objective:
        return ExtremumCurve(base.base, objective), x[: base.base.size]
    if _is_at_a_value(start):
        return None
    tests = (test for test in start.system.events() if (test.label, test.name) == (start.label, start.name))
    return next(((EventCurve(base, test), x) for test in tests), None)


def _is_at_a_value(start: Point) -> bool:
    """Return whether a column has the value that the point was located for."""
    return start.value is not None and abs(start[start.column] - start.value) <= APART * (1 + abs(start.value))


def _holding(start: Point, column: str) -> Point:
    """Return the point as one where a column has a given value, the one that it has.

    Raises
    ------
    ProblemError
        There is no such column.
    """
    known = (*start.parameters, *start.functionals, *start.system.named_states)
    if column not in known:
        raise ProblemError(f"hold: {checks.shown(column)} is no column; there are {checks.listed(known)}")
    return dataclasses.replace(start, column=column, value=start[column])


def _value(start: Point, base: System, x: Array) -> _First:
    """The value of a column."""
    column, value = start.column, start.value
    assert value is not None
    known = base.column_gradient(x, column) is not None
    event = Event(start.label, column, partial(_off, column, value))
    return EventCurve(base, event, partial(_slope, column) if known else None), x


def _off(column: str, value: float, trial: Trial) -> float:
    """Return by how much a column is off a value."""
    return trial[column] - value


def _slope(column: str, system: System, x: Array) -> Array:
    found = system.column_gradient(x, column)
    assert found is not None
    return found


def _event(start: Point, base: System, x: Array, event: Event) -> _First:
    """A zero of a user's test function.

    Raises
    ------
    ProblemError
        It is no zero of that.
    """
    found = EventCurve(base, event)
    here, slope = found.value(x), found.own_gradients(x)[0]
    if not abs(here) <= APART * (1 + float(np.abs(slope) @ (1 + np.abs(x)))):
        raise ProblemError(f"event: {event.name!r} is {here:.6g} at the start; it must be the function that labelled it")
    if not found.is_confirmed(x):
        raise ProblemError(f"event: confirm of {event.name!r} returns False at the start; it must be the one that labelled it")
    return found, x


#: What a start may be, in words.
_STARTS = (
    "one of LP, BP, HB (of equilibria), PD, TR, EX, a special point of homoclinic orbits, or one where a column has a value "
    "(UZ, EP); "
    "for one of your own events, give it as event"
)
