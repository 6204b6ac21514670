"""Extrema of a column G (a parameter or functional) on the solutions of F = 0: first and second derivatives.

On the manifold F = 0 of dimension j the derivatives of G along a basis V of its tangents vanish at an extremum. With j rows Phi
that make the matrix regular,

                              [ F_x ]                        T  [ lambda ]
                          M = [     ],    M V = [0; I],     M   [        ] = G_x^T,
                              [ Phi ]                           [   g    ]

the numbers g = G_x V are these derivatives, and lambda are Lagrange's multipliers: F_x^T lambda + Phi^T g = G_x^T. The second
derivatives are V^T (G_xx - lambda.F_xx) V.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from contin.arrays import Array
from contin.core.differences import derivative
from contin.core.labels import Label
from contin.core.protocol import Discretization
from contin.core.system import System
from contin.core.trial import Event, Trial
from contin.draws import generator
from contin.errors import ProblemError
from contin.linalg.border import orthonormal, rows_fit


class Stationarity:
    """Derivatives of a column on the manifold F = 0 at x, with some unknowns held.

    Parameters
    ----------
    system : System
    x : ndarray, shape (size,)
    column : str
    held : sequence of int
        Places of the unknowns that do not move.
    phi : ndarray, shape (j, size), optional
        The rows Phi; random ones by default.

    Attributes
    ----------
    kernel : ndarray, shape (j, size)
        V, as rows.
    g : ndarray, shape (j,)
    residual, factors, solutions
        F, the factors of M, with rows of what is held, and the solutions for units of all rows besides F_x.
    by_held : ndarray
        At an extremum, the derivatives of G by the unknowns that are held, the extremum staying one.
    """

    def __init__(self, system: System, x: Array, column: str, held: Sequence[int] = (), phi: Array | None = None) -> None:
        count = system.size - system.equations - len(held)
        if phi is None:
            phi = generator("extrema").standard_normal((count, system.size))
        rows = np.zeros((len(held) + count, system.size))
        rows[np.arange(len(held)), list(held)] = 1.0
        rows[len(held) :] = phi
        self._system, self._x, self._column = system, x, column
        self.residual, self.factors = system.linearize(x, rows)
        self.solutions = self.factors.solve(np.eye(len(rows), system.size, system.equations))
        self.kernel: Array = self.solutions[len(held) :]
        solution = self.factors.solve_transposed(gradient_of(system, x, column))
        self.multipliers: Array = solution[: system.equations]
        self.by_held: Array = solution[system.equations : system.size - count]
        self.g: Array = solution[system.size - count :]

    def gradients(self) -> Array:
        """Return dg/dx, shape (j, size)."""
        return np.array([self._bent(v) for v in self.kernel])

    def _bent(self, v: Array) -> Array:
        """Return the derivative of G_x - F_x^T lambda along v, shape (size,)."""
        return self._system.column_bent(self._x, self._column, v) - self._system.bent(self._x, self.multipliers, v)

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


def gradient_of(system: System, x: Array, column: str) -> Array:
    """Return the derivatives of a column by x.

    Raises
    ------
    ProblemError
        They are not known.
    """
    found = system.column_gradient(x, column)
    if found is None:
        raise ProblemError(f"start: extrema of {column!r} are labelled on branches, but not followed: it is no integral")
    return found


def extremum(column: str) -> Event:
    """Return the test function of extrema of a column along a curve: its derivative along the tangent."""

    def slope(trial: Trial) -> float:
        system: Any = trial.system
        gradient = system.column_gradient(trial.x, column)
        return _difference(trial, column) if gradient is None else float(gradient @ trial.tangent)

    return Event(Label.EXTREMUM, column, slope, describe=lambda trial: curvatures(trial, column), column=column)


def _difference(trial: Trial, column: str) -> float:
    """Return the derivative of a column along the tangent by differences: it has none that is known."""
    tangent = trial.tangent
    return float(derivative(lambda s: Trial(trial.system, trial.x + s * tangent, trial.linear)[column])[0])


def curvatures(trial: Trial, column: str) -> dict[str, float] | None:
    """Return the least and the largest second derivative at an extremum; None where first ones are not known."""
    base, x = solutions_of(trial.system, trial.x, column)
    if base is None or base.column_gradient(x, column) is None:
        return None
    values = Stationarity(base, x, column).curvatures()
    return {"least_curvature": float(values[0]), "largest_curvature": float(values[-1])}


def solutions_of(system: Discretization, x: Array, column: str) -> tuple[System | None, Array]:
    """Return the system whose solutions an extremum of a column is compared with, and its unknowns.

    On a branch, that is its own system; on a curve of extrema of the same column, the underlying one, with all its free
    parameters. None on other curves.
    """
    curve: Any = system
    if not system.on_curve:
        return curve, x
    if curve.objective == column:
        return curve.base, x[: curve.base.size]
    return None, x
