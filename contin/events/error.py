"""The whole error of a number that is computed from a solution: of the mesh, of Newton's method, and of the place.

1. The mesh: the solution is found again on the mesh with every interval halved, or as it is without one, and the number
   computed there, too. Branch points and folds are found as such, any other point where the first free parameter has its value.
2. Newton's method and round-off: what the last update left, relative to 1 + the number.
3. The place: a special point is known up to the errors of its free parameters. The number changes over that distance along the
   branch. At folds and branch points step 1 has found the place again.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any, Protocol

import numpy as np

from contin.arrays import Array
from contin.core.labels import Label
from contin.core.newton import Newton, correct
from contin.core.protocol import Carrier, Discretization
from contin.core.trial import Trial
from contin.errors import ConvergenceError
from contin.events.labelled import finding_of
from contin.events.refinement import ASIDE, zero_again
from contin.events.usual import fold
from contin.levels import LAST_PLACES

#: The change from one mesh to the next is multiplied by this: the finer one has an error, too, 1/16 of the coarser one's at
#: degree 2 and less at higher degrees. It covers both also where the meshes are so coarse that it is a third.
_FINER = 1.5


class Solution(Protocol):
    """What is asked of a point, as `contin.Point` documents it."""

    @property
    def system(self) -> Discretization: ...
    @property
    def x(self) -> Array: ...
    @property
    def tangent(self) -> Array: ...
    @property
    def label(self) -> str: ...
    @property
    def column(self) -> str: ...
    @property
    def details(self) -> Any: ...
    @property
    def errors(self) -> Mapping[str, float]: ...
    @property
    def newton_error(self) -> float: ...


#: A number, or numbers (k,), of a solution.
Functional = Callable[[Trial], Any]
#: The distance of numbers from others.
Apart = Callable[[Any, Any], Any]


def error(point: Solution, functional: Functional, apart: Apart = lambda a, b: np.abs(a - b)) -> Array:
    """Return the estimated error of what a functional gives at a solution, shape () or (k,).

    NaN where the point is not found again. ``apart(a, b)`` returns the distance of values, (k,), where it is not that of
    numbers.

    Examples
    --------
    >>> import math
    >>> from contin import BoundaryValueProblem, solve
    >>> growth = BoundaryValueProblem(lambda t, u, p: (u.u,), lambda a, b, p: (a.u - 1,), ["u"], {})
    >>> point = solve(growth, [1.0], intervals=2, degree=2)
    >>> found = error(point, lambda trial: trial.system.states(trial.x)[-1, 0])
    >>> print(abs(point.system.states(point.x)[-1, 0] - math.e) < found < 1e-6)
    True
    """
    here = np.asarray(functional(Trial.without_tangent(point.system, point.x)))
    left = (point.newton_error + LAST_PLACES) * (1 + np.abs(here))
    try:
        system, carry = point.system.refined() or (point.system, np.array)
        change = _FINER * apart(np.asarray(functional(Trial.without_tangent(system, _again(point, system, carry)))), here)
    except ConvergenceError:
        return np.full(here.shape, np.nan)
    return np.asarray(change + _of_place(point, functional, here, apart) + left)


def _again(point: Solution, system: Discretization, carry: Carrier) -> Array:
    """Return the unknowns of a point on another mesh."""
    x, known = carry(point.x), finding_of(point.details)
    if known.has_equations:
        return known.again(system, carry, point.x, Newton()).there(system, carry(point.tangent)).x
    if _is_fold(point):
        return zero_again(system, x, carry(point.tangent), fold(point.column), Newton())[0].x
    if system.size == system.equations:
        return correct(system, x).x
    row = np.zeros(system.size)
    row[system.parameter_index(system.free[0])] = 1.0
    return correct(system, x, row, row @ x).x


def _is_fold(point: Solution) -> bool:
    """Return whether a point is found again as a fold of a free parameter."""
    return point.label == Label.FOLD and point.column in point.system.free and bool(np.isfinite(point.tangent).all())


def _of_place(point: Solution, functional: Functional, here: Array, apart: Apart) -> Any:
    """Return what the numbers change over the distance that the place of a special point is known to."""
    system, name = point.system, next(iter(point.system.free), "")
    located = point.errors.get(name, 0.0)
    if not located or finding_of(point.details).has_equations or _is_fold(point) or not np.isfinite(point.tangent).all():
        return 0.0
    beside = Trial.without_tangent(system, point.x + ASIDE * point.tangent)
    moved = abs(beside[name] - Trial.without_tangent(system, point.x)[name])
    return apart(np.asarray(functional(beside)), here) / moved * located if moved else np.nan
