"""Errors of forces, moments and energies at labelled points of open strips, which are found again on a mesh twice as fine."""

from __future__ import annotations

from collections.abc import Callable, Mapping

import numpy as np

from contin import ContinError, ConvergenceError, Point
from contin.lowlevel import Collocation, correct, locate_branch_point, point_of

#: First step of the secant method for a fold, in the norm of the run; located points lie within 1e-6 of it. Ten times larger:
#: one more step.
_FIRST = 1e-3
#: Step at which the secant method ends: a fold's columns are then off by 1e-9 of their rate.
_LAST = 1e-9
#: Largest number of its steps. It takes three to six.
_SECANTS = 12
#: Step along the tangent for rates of columns, which are then right to about this part. Errors need less: .1 would do.
_ALONG = 1e-5
#: The finer mesh has an error, too: 1/16 of the coarser one's at degree 2, and less at higher degrees. A difference times this
#: covers both, also where the meshes are so coarse that it is a third.
_FINER = 1.5
#: An error is given as no less than this multiple of round-off of the largest value of its kind.
_UNITS = 16

Columns = Callable[[Point], Mapping[str, float]]


def errors_of(point: Point, columns: Columns) -> dict[str, float]:
    """Return the estimated errors of columns at a labelled point, nan where it is not found again.

    The point is located again on a mesh with every interval halved: a fold where the rate of the followed number vanishes, a
    branch point as such, any other point at its value of the followed number. The error is the difference of the columns. At a
    given value of another column the followed number has an error of its own, times the column's rate; what Newton's method
    left is added.
    """
    here = dict(columns(point))
    unknown = dict.fromkeys(here, np.nan)
    if point.label == "MX" or (point.label in ("LP", "BP") and not np.isfinite(point.errors.get(_followed(point), np.nan))):
        return unknown
    fine, carry = point.system.refined()
    try:
        if point.label == "BP" and point.is_simple_branch_point:
            x = locate_branch_point(fine, carry(point.x), kernel=np.array([carry(vector) for vector in point.details.kernel])).x
        elif point.label == "BP":
            return unknown
        elif point.label == "LP":
            x = _fold(fine, carry(point.x), carry(point.tangent))
        else:
            x = _at_the_value(fine, carry(point.x), _followed(point))
    except ContinError:
        return unknown
    there = columns(point_of(fine, x))
    moved = _moved(point, columns, here) if point.label not in ("LP", "BP") else dict.fromkeys(here, 0.0)
    return {name: float(_FINER * abs(there[name] - here[name]) + moved[name] + _round_off(point, name, here)) for name in here}


def _moved(point: Point, columns: Columns, here: Mapping[str, float]) -> dict[str, float]:
    """Return how far the error of the followed number's place moves the columns, along the tangent."""
    located, name = point.errors.get(_followed(point), 0.0), _followed(point)
    beside = point_of(point.system, point.x + _ALONG * point.tangent)
    step, values = abs(beside.parameters[name] - point.parameters[name]), columns(beside)
    return {column: abs(values[column] - here[column]) * located / step if step else np.nan for column in here}


def _round_off(point: Point, name: str, here: Mapping[str, float]) -> float:
    """Return what Newton's method and round-off leave, relative to 1, the column, the largest force or moment."""
    kind = [abs(value) for other, value in here.items() if _kind(other) == _kind(name)]
    return (point.newton_error + _UNITS * float(np.finfo(float).eps)) * max(1.0, *kind)


def _kind(name: str) -> str:
    bare = name.removeprefix("start_")
    return bare[0] if bare[0] in "FM" else name


def _followed(point: Point) -> str:
    return point.system.free[0]


def _at_the_value(system: Collocation, x: np.ndarray, name: str) -> np.ndarray:
    """Return x corrected at fixed value of a free parameter."""
    row = np.zeros(system.size)
    row[system.parameter_index(name)] = 1.0
    return correct(system, x, row, row @ x).x


def _fold(system: Collocation, x: np.ndarray, tangent: np.ndarray) -> np.ndarray:
    """Return the fold near x, by the secant method along the tangent for the rate of the followed number.

    Raises
    ------
    ConvergenceError
    """
    row, primary = system.weights * tangent, system.parameter_index(system.free[0])
    row = row / (row @ tangent)
    unit = np.append(np.zeros(system.size - 1), 1.0)

    def at(s: float) -> tuple[np.ndarray, float]:
        found = correct(system, x + s * tangent, row, row @ x + s).x
        return found, float(system.linearize(found, (row,))[1].solve(unit)[primary])

    (found, rate), last, s = at(0.0), 0.0, _FIRST
    for _ in range(_SECANTS):
        before, (found, rate) = rate, at(s)
        if rate == before:
            break
        s, last = s - rate * (s - last) / (rate - before), s
        if abs(s - last) < _LAST:
            return found
    raise ConvergenceError("the fold was not found again on the finer mesh")
