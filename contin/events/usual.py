"""The test functions of every run: special points, limits, values of columns, and their extreme values.

At an extremum of a column G (a parameter or functional) on the manifold F = 0 of dimension j the derivatives of G along a basis
V of its tangents vanish. With j rows Phi that make the matrix regular,

                              [ F_x ]                        T  [ lambda ]
                          M = [     ],    M V = [0; I],     M   [        ] = G_x^T,
                              [ Phi ]                           [   g    ]

the numbers g = G_x V are these derivatives, and lambda are Lagrange's multipliers: F_x^T lambda + Phi^T g = G_x^T. The second
derivatives are V^T (G_xx - lambda.F_xx) V.
"""

from __future__ import annotations

import dataclasses
import functools
from collections.abc import Mapping, Sequence

import numpy as np

from contin.arrays import Array
from contin.core.differences import derivative
from contin.core.labels import Label
from contin.core.system import System
from contin.core.trial import Event, Trial
from contin.draws import generator
from contin.errors import ProblemError
from contin.events import normal_forms
from contin.events.arc import Arc, Place, SpecialPoint
from contin.events.normal_forms import Coefficient
from contin.levels import APART, LOCATED
from contin.linalg.border import last_units, orthonormal, rows_fit
from contin.text import value_names


def user_zeros(zeros: Mapping[str, Sequence[float]]) -> list[Event]:
    """Return the test functions of points where a parameter or functional takes given values (AUTO's UZ).

    A value that is given twice counts once. Different values have different names.
    """
    return [_user_zero(name, value, text) for name, values in zeros.items() for value, text in value_names(values).items()]


@functools.lru_cache(maxsize=256)  # runs of one diagram have the same ones
def _user_zero(name: str, value: float, text: str) -> Event:
    return Event(Label.USER_ZERO, f"{name} = {text}", lambda trial: trial[name] - value, column=name, value=value)


def limits(intervals: Mapping[str, Sequence[float]]) -> list[Event]:
    """Return the test functions that end a run where a parameter or functional reaches an end of its interval."""
    ends = [(name, end, side) for name, (low, high) in intervals.items() for end, side in ((low, -1), (high, 1))]
    texts = {name: value_names(both) for name, both in intervals.items()}
    return [_limit(name, end, texts[name][end], side) for name, end, side in ends]


@functools.lru_cache(maxsize=256)
def _limit(name: str, value: float, text: str, side: int) -> Event:
    """Return the one of the upper (``side`` +1) or lower (-1) end."""
    what = f"{name} = {text}"
    return Event(Label.END, what, lambda trial: side * (trial[name] - value), True, limit=True, column=name, value=value)


def within_limits(arc: Arc, points: list[SpecialPoint], ends: Sequence[Event]) -> list[SpecialPoint]:
    """Return the special points of a step up to where it first leaves the limits, which may have been seen at a point only.

    A quantity that passes its limit and comes back in one step has the same sign at both ends of the step.
    """
    last: Place = (arc.low, arc.before)
    for number, point in enumerate(points):
        if point.stop is not None:
            break
        for test in ends:
            value, before = test.function(point.trial), last[1].value(test)
            if before < 0 and value > APART * (abs(before) + value):
                return [*points[:number], arc.locate(test, last, (point.at, point.trial))]
        last = (point.at, point.trial)
    return points


@functools.lru_cache(maxsize=64)
def fold(name: str) -> Event:
    """Return the test function of folds with respect to a free parameter: its component of the tangent (AUTO's LP)."""
    return Event(Label.FOLD, name, lambda trial: trial.tangent[trial.system.parameter_index(name)], column=name,
                 normal_form=normal_forms.fold)  # fmt: skip


def with_normal_form(point: SpecialPoint, found: Coefficient, coarse: Coefficient) -> SpecialPoint:
    """Return a special point with the coefficient in its details and, but for folds, what it means in its name.

    The error is that of the derivatives, and what the coefficient differs from that on the mesh of the run. A coefficient that
    is nothing but error is left out, and its error is stated. Where those of the point are not wanted, and none could change
    the sign, it is not estimated.
    """
    if found is normal_forms.NOT_SMOOTH:
        return dataclasses.replace(point, name=f"{point.name}, not smooth")
    unknown = point.errors is None and found.is_certain
    error = 0.0 if unknown else found.error + abs(found.value - coarse.value)
    means = error < found.size or error < LOCATED  # it is less than the terms, or round-off of terms that are zero
    value = {"normal_form": found.value} if means else {}
    details = {**(point.details or {}), **value, **({} if unknown else {"normal_form_error": error})}
    attracts, repels = found.side * found.value < -error, found.side * found.value > error
    is_fold = point.test is not None and point.test.normal_form is normal_forms.fold
    kind = "" if is_fold else ", supercritical" if attracts else ", subcritical" if repels else ""
    return dataclasses.replace(point, name=point.name + kind, details=details)


class Stationarity:
    """Derivatives of a column on the manifold F = 0 at x, with some unknowns held.

    - ``system`` (System)
    - ``x`` (ndarray, shape (size,))
    - ``column`` (str)
    - ``held`` (sequence of int): Places of the unknowns that do not move.
    - ``phi`` (ndarray, shape (j, size), optional): The rows Phi; random ones by default.

    - ``kernel`` (ndarray, shape (j, size)): V, as rows.
    - ``g`` (ndarray, shape (j,))
    - ``residual``, ``factors``, ``solutions``: F, the factors of M, with rows of what is held, and the solutions for units of
      all rows besides F_x.
    - ``by_held`` (ndarray): At an extremum, the derivatives of G by the unknowns that are held, the extremum staying one.
    """

    def __init__(self, system: System, x: Array, column: str, held: Sequence[int] = (), phi: Array | None = None) -> None:
        count = system.size - system.equations - len(held)
        phi = generator("extrema").standard_normal((count, system.size)) if phi is None else phi
        rows = np.zeros((len(held) + count, system.size))
        rows[np.arange(len(held)), list(held)] = 1.0
        rows[len(held) :] = phi
        self._system, self._x, self._column = system, x, column
        self.residual, self.factors = system.linearize(x, rows)
        self.solutions = self.factors.solve(last_units(system.size, len(rows)))
        self.kernel: Array = self.solutions[len(held) :]
        gradient = system.column_gradient(x, column)
        if gradient is None:
            raise ProblemError(f"start: extrema of {column!r} are labelled on branches, but not followed: it is no integral")
        solution = self.factors.solve_transposed(gradient)
        self.multipliers: Array = solution[: system.equations]
        self.by_held: Array = solution[system.equations : system.size - count]
        self.g: Array = solution[system.size - count :]

    def gradients(self) -> Array:
        """Return dg/dx, shape (j, size): the derivatives of G_x - F_x^T lambda along V."""
        system, x = self._system, self._x
        return np.array([system.column_bent(x, self._column, v) - system.bent(x, self.multipliers, v) for v in self.kernel])

    @property
    def fits(self) -> bool:
        """Whether the tangents have not turned away from the rows Phi."""
        return rows_fit(self.kernel, self._system.weights)

    def orthonormal(self) -> Array:
        """Return an orthonormal basis of the tangents, shape (j, size), in the inner product of the system."""
        return orthonormal(self.kernel, self._system.weights)

    def curvatures(self) -> Array:
        """Return the eigenvalues of the second derivatives on orthonormal tangents, shape (j,)."""
        change = np.linalg.lstsq(self.kernel.T, self.orthonormal().T)[0]
        hessian = change.T @ (self.gradients() @ self.kernel.T) @ change
        return np.asarray(np.linalg.eigvalsh((hessian + hessian.T) / 2), dtype=float)


def extremum(column: str) -> Event:
    """Return the test function of extrema of a column along a curve: its derivative along the tangent."""

    def slope(trial: Trial) -> float:
        system, x, tangent = trial.system, trial.x, trial.tangent
        gradient = system.column_gradient(x, column)
        if gradient is None:
            return float(derivative(lambda s: Trial(system, x + s * tangent, trial.linear)[column])[0])
        return float(gradient @ tangent)

    return Event(Label.EXTREMUM, column, slope, describe=lambda trial: curvatures(trial, column), column=column)


def curvatures(trial: Trial, column: str) -> dict[str, float] | None:
    """Return the least and the largest second derivative at an extremum; None where first ones are not known.

    An extremum is compared with solutions of its own system; on a curve of extrema of the same column with those of the
    underlying one, with all its free parameters. None on other curves.
    """
    system, x = trial.system, trial.x
    if system.on_curve and system.objective != column:
        return None
    if system.on_curve:
        system, x = system.base, x[: system.base.size]
    if system.column_gradient(x, column) is None:
        return None
    values = Stationarity(system, x, column).curvatures()
    return {"least_curvature": float(values[0]), "largest_curvature": float(values[-1])}
