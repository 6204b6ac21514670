"""Curves of special points in two parameters, and in more."""

from __future__ import annotations

import contextlib
from collections.abc import Sequence
from typing import Any

import numpy as np

from contin import checks
from contin.analysis.branch_point_curve import BranchPointCurve
from contin.analysis.cycle_curves import DoublingCurve, TorusCurve
from contin.analysis.event_curve import EventCurve
from contin.analysis.extended import Extended
from contin.analysis.extremum_curve import ExtremumCurve
from contin.analysis.fold_curve import FoldCurve
from contin.analysis.hopf_curve import HopfCurve
from contin.arrays import Array
from contin.continuation.cycle_starts import frequency_of
from contin.continuation.run import follow
from contin.detection.branch_point import BranchPoint
from contin.detection.lyapunov import critical_pair
from contin.detection.test_functions import own_test_functions
from contin.discretization.algebraic import Algebraic
from contin.discretization.cycles import CycleCollocation
from contin.discretization.system import System
from contin.errors import ProblemError
from contin.results.branch import Branch
from contin.results.point import Point
from contin.stepping.settings import Settings, settings_with
from contin.stepping.trial import TestFunction


def curve(start: Point, second: str | None = None, settings: Settings | None = None, *, free: Sequence[str] | None = None,
          event: TestFunction | None = None, **options: Any) -> Branch:  # fmt: skip
    """Follow the curve of special points of one kind through one of them, in two parameters or more.

    Parameters
    ----------
    start : Point
        A labelled point of a branch: a fold (LP), branch point (BP), Hopf point of equilibria (HB), period doubling (PD) or
        torus bifurcation (TR) of cycles, an extremum (EX), or a point where a column reaches a value (UZ, EP). Or a labelled
        point of a curve, which is then followed with one parameter more: an extremum of the column whose extrema the curve
        consists of, the fold of a curve of folds with respect to its first parameter (both are again extrema, now in one
        parameter more), a user zero, or a point of codimension two.
    second : str, optional
        The parameter that is free beside those of the branch.
    settings : Settings, optional
        Or any of its fields by name. Folds of the curve are with respect to ``primary`` (the second parameter by default).
        ``branch_points`` is False by default.
    free : pair of str, optional
        Both parameters, in place of ``second``: the first takes the place of the one in which the start was found.
    event : TestFunction, optional
        The one that labelled the start, where that is one of yours (``test_functions``).

    Returns
    -------
    Branch
        Points with labels LP (the curve turns) and, on curves of folds: CP (cusp), BP (fold meets a branch point) and, of
        equilibria, BT (Bogdanov-Takens), ZH (zero-Hopf). On curves of Hopf points: GH (generalized Hopf: the first Lyapunov
        coefficient is zero), ZH, HH (double Hopf), and BT, where the curve ends; columns ``frequency`` and ``lyapunov``. On
        curves of period doublings: R2 (a second multiplier -1), GPD (the coefficient of the normal form is zero), LPPD
        (fold-flip). On curves of torus bifurcations, with the column ``angle``: the strong resonances R3 and R4, and R1 and R2,
        where the curve ends; CH (Chenciner: the coefficient is zero), LPTR (fold-torus). Both have the column ``normal_form``.
        On curves of folds of cycles: R1, LPPD. On curves of extrema: EX, an extremum in one parameter more. Points of a curve
        of branch points carry their imperfection beta as the last entry of x.

    Raises
    ------
    ProblemError
        The start is none of these, or a name is no parameter.

    Examples
    --------
    The folds of x^3 - b x + a = 0 lie on 27 a^2 = 4 b^3, with a cusp at the origin:

    >>> from contin import AlgebraicProblem, solve, trace
    >>> cusp = AlgebraicProblem(lambda u, p: (u.x**3 - p.b * u.x + p.a,), ["x"], {"a": 2.0, "b": 1.0})
    >>> fold = trace(solve(cusp, [-1.5]), free=["a"], direction=-1, limits={"a": (-2, 3)}).labelled("LP")[0]
    >>> folds = curve(fold, "b", direction=-1, limits={"b": (-1, 2)})
    >>> [(point.label, abs(point["b"]) < 1e-9) for point in folds.labelled("CP")]
    [('CP', True)]
    """
    checks.instance("start", start, Point, "a Point")
    checks.instance("event", event, (TestFunction, type(None)), "a TestFunction")
    names = _free_parameters(start, second, free)
    options.setdefault("primary", names[-1])
    options.setdefault("branch_points", False)
    base, x = start.system.with_free(names, start.x)  # type: ignore[attr-defined]
    found = _event(start, base, x, event) if event is not None else _first_of_curve(start, base, x)
    if found is None:
        raise ProblemError(f"start: a point labelled {start.label or 'nothing'!r} must be {_STARTS}")
    return follow(*found, settings_with(settings, options))


def _free_parameters(start: Point, second: str | None, free: Sequence[str] | None) -> tuple[str, ...]:
    """Return the free parameters of a curve: that in which the start was found first, the second parameter last."""
    system: Any = start.system
    if len(system.free) != system.problem.free_size:
        raise ProblemError("start: must be a point of a branch, with the free parameters of a curve")
    known = tuple(system.problem.parameters)
    branch = isinstance(system, System)
    found_in = start.name if start.label == "LP" and branch else system.free[0]
    if (second is None) == (free is None):
        raise ProblemError("curve: give the second parameter, or free=[first, second]")
    if free is None:
        assert second is not None
        checks.instance("second", second, str, "a name")
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


#: An extended system, and its first vector of unknowns.
_First = tuple[Extended, Array]


def _first_of_curve(start: Point, base: Any, x: Array) -> _First | None:
    """Return the extended system of the kind of a point."""
    kinds = _KINDS if isinstance(start.system, System) else _KINDS_ON_CURVES
    return next((found for kind in kinds if (found := kind(start, base, x)) is not None), None)


def _branch_points(start: Point, base: System, x: Array) -> _First | None:
    return (BranchPointCurve(base), np.append(x, 0.0)) if isinstance(start.details, BranchPoint) else None


def _folds(start: Point, base: System, x: Array) -> _First | None:
    return (FoldCurve(base), x) if start.label == "LP" else None


def _hopf_points(start: Point, base: System, x: Array) -> _First | None:
    if start.label != "HB" or not isinstance(base, Algebraic):
        return None
    frequency = critical_pair(base.jacobian(x), frequency_of(start)).frequency
    return HopfCurve(base.as_field(), size=frequency**2), np.append(x, 1.0)


def _doublings(start: Point, base: System, x: Array) -> _First | None:
    return (DoublingCurve(base), x) if start.label == "PD" and isinstance(base, CycleCollocation) else None


def _tori(start: Point, base: System, x: Array) -> _First | None:
    if start.label != "TR" or not isinstance(base, CycleCollocation):
        return None
    angle = frequency_of(start)
    if angle is None:
        values = base.eigenvalues(x)
        angle = abs(values[np.argmin(np.where(values.imag > 0, np.abs(values.real), np.inf))].imag)
    return TorusCurve(base), np.append(x, np.cos(angle))


def _extrema(start: Point, base: System, x: Array) -> _First | None:
    return (ExtremumCurve(base, start.name), x) if start.label == "EX" else None


def _extrema_of_extrema(start: Point, base: Any, x: Array) -> _First | None:
    """An extremum along a curve of extrema; a fold with respect to the parameter of a curve of folds is one, too."""
    if isinstance(base, ExtremumCurve):
        objective = base.objective
    elif isinstance(base, FoldCurve) and isinstance(base.base, System):
        objective = base.free[0]
    else:
        return None
    if start.label not in ("EX", "LP") or start.name != objective:
        return None
    return ExtremumCurve(base.base, objective), x[: base.base.size]


def _values(start: Point, base: Any, x: Array) -> _First | None:
    """A point whose name says that a column has a value."""
    column, _, text = start.name.partition(" = ")
    if column not in start.parameters and column not in start.functionals:
        return None
    value = start[column]
    with contextlib.suppress(ValueError):
        value = float(text) if abs(float(text) - value) <= _LOCATED * (1 + abs(value)) else value
    known = base.column_gradient(x, column) is not None
    gradient = (lambda system, x: system.column_gradient(x, column)) if known else None
    return EventCurve(base, lambda trial: trial[column] - value, gradient), x


def _of_codimension_two(start: Point, base: Any, x: Array) -> _First | None:
    """A point that a test function of its curve has labelled."""
    for test in own_test_functions(start.system):
        if (test.label, test.name) == (start.label, start.name):
            return EventCurve(base, test.function), x
    return None


def _event(start: Point, base: Any, x: Array, event: TestFunction) -> _First:
    """A zero of a user's test function.

    Raises
    ------
    ProblemError
        It is no zero of that.
    """
    found = EventCurve(base, event.function)
    here, slope = found.value(x), found.gradient(x)
    if not abs(here) <= _LOCATED * (1 + float(np.abs(slope) @ (1 + np.abs(x)))):
        raise ProblemError(f"event: {event.name!r} is {here:.6g} at the start; it must be the function that labelled it")
    return found, x


#: A value at a located point differs from the one that was looked for by less than this, relative to 1 + its size.
_LOCATED = 1e-6
#: What a start may be, in words, and in the order in which it is asked.
_STARTS = (
    "one of LP, BP, HB (of equilibria), PD, TR, EX, or one where a column has a value (UZ, EP); "
    "for one of your own test functions, give it as event"
)
_KINDS = (_branch_points, _folds, _hopf_points, _doublings, _tori, _extrema, _values)
_KINDS_ON_CURVES = (_extrema_of_extrema, _values, _of_codimension_two)
