"""Curves of folds and of branch points in two parameters."""

from __future__ import annotations

from typing import Any

import numpy as np

from contin import checks
from contin.analysis.branch_point_curve import BranchPointCurve
from contin.analysis.extended import Extended
from contin.analysis.fold_curve import FoldCurve
from contin.continuation.run import follow
from contin.detection.branch_point import BranchPoint
from contin.errors import ProblemError
from contin.results.branch import Branch
from contin.results.point import Point, system_of
from contin.stepping.settings import Settings, settings_with


def curve(start: Point, second: str, settings: Settings | None = None, **options: Any) -> Branch:
    """Follow the curve of folds, or of branch points, through one, in its primary parameter and a second one.

    Parameters
    ----------
    start : Point
        A fold (LP) or branch point (BP) found on a branch.
    second : str
        The further parameter.
    settings : Settings, optional
        Or any of its fields by name. Folds of the curve are with respect to ``primary`` (``second`` by default).

    Returns
    -------
    Branch
        Points with labels LP (the curve turns), CP (cusp of folds), BP (fold meets a branch point). Points of a curve of branch
        points carry their imperfection beta as the last entry of x.

    Raises
    ------
    ProblemError
        The start is neither, or the name is no further parameter.

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
    checks.instance("second", second, str, "a name")
    system = system_of(start, "start")
    if second in system.free or second not in system.problem.parameters:
        raise ProblemError(f"second: {second!r} must be a parameter that is not free ({', '.join(system.problem.parameters)})")
    options.setdefault("primary", second)
    options.setdefault("branch_points", False)
    settings = settings_with(settings, options)
    base, x = system.with_free((*system.free, second), start.x)
    if isinstance(start.details, BranchPoint):
        extended: Extended = BranchPointCurve(base)
        x = np.append(x, 0.0)
    elif start.label == "LP":
        extended = FoldCurve(base, primary=system.free.index(start.name))
    else:
        raise ProblemError(f"start: a point labelled {start.label or 'nothing'!r} is neither a fold nor a branch point")
    return follow(extended, x, settings)
