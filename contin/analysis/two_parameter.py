"""Curves of special points in two parameters."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from contin import checks
from contin.analysis.branch_point_curve import BranchPointCurve
from contin.analysis.cycle_curves import DoublingCurve, TorusCurve
from contin.analysis.extended import Extended
from contin.analysis.fold_curve import FoldCurve
from contin.analysis.hopf_curve import HopfCurve
from contin.arrays import Array
from contin.continuation.cycle_starts import doubled, frequency_of, start_at
from contin.continuation.progress import Progress, follow_until_interrupted
from contin.continuation.run import Continuation
from contin.detection.branch_point import BranchPoint
from contin.detection.lyapunov import critical_pair
from contin.discretization.algebraic import Algebraic
from contin.discretization.cycles import CycleCollocation
from contin.discretization.system import System
from contin.errors import ProblemError
from contin.results.branch import Branch
from contin.results.point import Point, system_of
from contin.stepping.settings import Settings, settings_with


def curve(start: Point, second: str | None = None, settings: Settings | None = None, *, free: Sequence[str] | None = None,
          progress: bool | None = None, **options: Any) -> Branch:  # fmt: skip
    """Follow the curve of special points of one kind through one of them, in two parameters.

    Parameters
    ----------
    start : Point
        A fold (LP), branch point (BP), Hopf point of equilibria (HB), or a period doubling (PD) or torus bifurcation (TR) of
        cycles, found on a branch.
    second : str, optional
        The parameter that is free beside those of the branch.
    settings : Settings, optional
        Or any of its fields by name. Folds of the curve are with respect to ``primary`` (the second parameter by default).
    free : pair of str, optional
        Both parameters, in place of ``second``: the first takes the place of the one in which the start was found.
    progress : bool, optional
        As in `trace`.

    Returns
    -------
    Branch
        Points with labels LP (the curve turns) and, on curves of folds: CP (cusp), BP (fold meets a branch point) and, of
        equilibria, BT (Bogdanov-Takens), ZH (zero-Hopf). On curves of Hopf points: GH (generalized Hopf: the first Lyapunov
        coefficient is zero), ZH, HH (double Hopf), and BT, where the curve ends; columns ``frequency`` and ``lyapunov``. On
        curves of period doublings: R2 (a second multiplier -1), GPD (the coefficient of the normal form is zero), LPPD
        (fold-flip). On curves of torus bifurcations, with the column ``angle``: the strong resonances R3 and R4, and R1 and R2,
        where the curve ends; CH (Chenciner: the coefficient is zero), LPTR (fold-torus). Both have the column ``normal_form``.
        On curves of folds of cycles: R1, LPPD. Points of a curve of branch points carry their imperfection beta as the last
        entry of x.

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
    system = system_of(start, "start")
    names = _free_parameters(start, system, second, free)
    options.setdefault("primary", names[-1])
    options.setdefault("branch_points", False)
    settings, shown = settings_with(settings, options), Progress(progress)
    base, x = system.with_free(names, start.x)
    for kind in _KINDS:
        found = kind(start, base, x)
        if found is not None:
            return follow_until_interrupted(Continuation(*found, settings), shown)
    raise ProblemError(f"start: a point labelled {start.label or 'nothing'!r} must be one of {_STARTS}")


def _free_parameters(start: Point, system: System, second: str | None, free: Sequence[str] | None) -> tuple[str, ...]:
    """Return the free parameters of a curve: that in which the start was found first, the second parameter last."""
    if len(system.free) != system.problem.free_size:
        raise ProblemError("start: must be a point of a branch, with the free parameters of a curve")
    known = tuple(system.problem.parameters)
    found_in = start.name if start.label == "LP" else system.free[0]
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
    allowed = [name for name in known if name not in others]
    if len(pair) != 2 or len({*pair} & {*allowed}) != 2:
        raise ProblemError(f"free: {', '.join(pair)} must be two of the parameters {', '.join(allowed)}")
    return (pair[0], *others, pair[1])


#: An extended system, and its first vector of unknowns.
_First = tuple[Extended, Array]


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
    return (DoublingCurve(base), x) if start_at(start) is doubled and isinstance(base, CycleCollocation) else None


def _tori(start: Point, base: System, x: Array) -> _First | None:
    if start.label != "TR" or not isinstance(base, CycleCollocation):
        return None
    angle = frequency_of(start)
    if angle is None:
        values = base.eigenvalues(x)
        angle = abs(values[np.argmin(np.where(values.imag > 0, np.abs(values.real), np.inf))].imag)
    return TorusCurve(base), np.append(x, np.cos(angle))


#: What a start may be, in words, and in the order in which it is asked.
_STARTS = "LP, BP, HB (of equilibria), PD and TR"
_KINDS = (_branch_points, _folds, _hopf_points, _doublings, _tori)
