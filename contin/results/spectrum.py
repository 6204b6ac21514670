"""The eigenvalues of a steady state, which decide on its stability in time, with errors."""

from __future__ import annotations

from typing import Any

import numpy as np

from contin.arrays import Array, ComplexArray
from contin.core.spectral import Spectral, changes
from contin.core.trial import Trial
from contin.errors import ProblemError
from contin.events.error import error
from contin.levels import ROUND_OFF
from contin.linalg.matrices import eigenvalues


class Spectrum:
    """Eigenvalues of a steady state: perturbations grow as exp(z t).

    Attributes
    ----------
    values : ndarray of complex, shape (k,)
        The eigenvalues, those with the largest real parts first. Of fields, and of large problems, those that decide on
        stability: all that are unstable, and the next ones.
    errors : ndarray, shape (k,)
        Their estimated errors: of fields what halving the mesh changes, of equilibria round-off of the Jacobian; at a special
        point with what they change over the distance that its place is known to. NaN where the point was not found again, and
        for round-off of large problems.
    unstable : int
        Number of eigenvalues with a positive real part.
    stable : bool
        There are none.

    Examples
    --------
    >>> import contin
    >>> heat = contin.BoundaryValueProblem(lambda t, u, p: (u.v, 0.0), lambda a, b, p: (a.u, b.u), ["u", "v"], {},
    ...                                    rates={"v": lambda t, u, w, p: w.u})
    >>> spectrum = contin.solve(heat, [0.0, 0.0]).spectrum()
    >>> bool(abs(spectrum.values[0] + np.pi**2) < spectrum.errors[0] < 1e-9), spectrum.stable
    (True, True)
    """

    def __init__(self, point: Any) -> None:
        system, knows = point.system.solution, isinstance(point.system.solution, Spectral)
        if not knows or system.is_cycle or not system.problem.dynamics:
            raise ProblemError(
                "spectrum: the states must move in time, as those of an AlgebraicProblem with dynamics, or of a "
                "BoundaryValueProblem that says with rates= which equations contain rates"
            )
        self.values: ComplexArray = _values(Trial.without_tangent(point.system, point.x))
        self.errors: Array = error(point, _values, _apart)
        if system.intervals:  # they come from solutions of linear equations
            self.errors = self.errors + ROUND_OFF * (1 + np.abs(self.values))
        else:
            x = point.x[: system.size]
            self.errors = self.errors + (np.nan if system.is_sparse else changes(_rounded(system.jacobian(x)), self.values))
        self.unstable = int(np.count_nonzero(self.values.real > 0))

    @property
    def stable(self) -> bool:
        """No perturbation grows."""
        return not self.unstable

    def __repr__(self) -> str:
        return f"Spectrum({len(self.values)} eigenvalues, {self.unstable} unstable; the first {self.values[0]:.6g})"


def _values(trial: Any) -> ComplexArray:
    """Return the eigenvalues of a solution, or of that of a point of a curve, in order."""
    system = trial.system.solution
    values: ComplexArray = system.eigenvalues(trial.x[: system.size])
    return values[np.lexsort((-values.imag, -values.real))]


def _apart(others: ComplexArray, values: ComplexArray) -> Array:
    """Return how far each value is from the nearest of the others."""
    return np.abs(others[:, None] - values).min(axis=0)


def _rounded(matrix: Array) -> Any:
    """Return the function of random signs that returns the eigenvalues of a matrix that is rounded by them."""
    return lambda signs: eigenvalues(matrix * (1 + np.finfo(float).eps * signs(matrix)))
