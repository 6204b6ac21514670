"""The first Lyapunov coefficient of a Hopf point (Kuznetsov, Elements of Applied Bifurcation Theory, section 5.4).

With A the Jacobian of the field, A q = i omega q, w.A = i omega w., |q| = 1 and w.q = 1, and B and C the derivatives of second
and third order,

    l1 = Re w.[ C(q, q, q*) - 2 B(q, A^-1 B(q, q*)) + B(q*, (2 i omega - A)^-1 B(q, q)) ] / (2 omega).

Where it is negative the bifurcation is supercritical: cycles are on the side where the equilibrium is unstable, and attract on
the centre manifold. Where it is positive the bifurcation is subcritical.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np

from contin.arrays import Array, ComplexArray
from contin.discretization.algebraic import Algebraic
from contin.discretization.multilinear import of_complex
from contin.linalg.orientation import oriented

#: Critical vectors are moved by this part of their largest component for an error estimate: ten times their round-off, since
#: one draw may hardly count. Ten times larger, errors are ten times as large.
_MOVED = 1e-14
#: A coefficient is zero below this part of its terms, or below this number. Ten times larger or smaller, the points of the
#: tests are the same.
_CANCELLED, _ZERO = 1e-6, 1e-9


class CriticalPair(NamedTuple):
    """A pair of eigenvalues -+ i omega: its frequency, and the right and left eigenvector, |q| = 1 and w.q = 1."""

    frequency: float
    right: ComplexArray
    left: ComplexArray


def critical_pair(jacobian: Array, frequency: float | None = None) -> CriticalPair:
    """Return the pair of eigenvalues that is nearest to -+ i ``frequency``.

    Without a frequency, it is the complex pair nearest to the imaginary axis.
    """
    if frequency is not None and len(jacobian) >= _MANY:
        return _by_iteration(jacobian, frequency)
    values, vectors = np.linalg.eig(jacobian)
    if frequency is None:
        off_axis = np.where(values.imag > 0, np.abs(values.real), np.inf)
        frequency = float(values[np.argmin(off_axis)].imag)
    right = vectors[:, np.argmin(np.abs(values - 1j * frequency))].astype(complex)
    right = oriented(right / np.linalg.norm(right))
    values, vectors = np.linalg.eig(jacobian.T)
    left = vectors[:, np.argmin(np.abs(values - 1j * frequency))]
    with np.errstate(all="ignore"):
        return CriticalPair(frequency, right, left / (left @ right))


def _by_iteration(jacobian: Array, frequency: float) -> CriticalPair:
    """Return the pair nearest to -+ i ``frequency`` by inverse iteration: all eigenvectors of a large matrix take long."""
    from scipy.linalg import lu_factor, lu_solve  # type: ignore[import-untyped]  # only large problems need it

    aside = 1j * frequency * (1 + _ASIDE)
    factors = lu_factor(jacobian - aside * np.eye(len(jacobian)))
    right = left = np.random.default_rng(13).standard_normal(len(jacobian)).astype(complex)
    for _ in range(_ITERATIONS):
        right, left = lu_solve(factors, right), lu_solve(factors, left, trans=1)
        right, left = right / np.linalg.norm(right), left / np.linalg.norm(left)
    right = oriented(right)
    with np.errstate(all="ignore"):
        return CriticalPair(frequency, right, left / (left @ right))


#: From so many states on the critical pair is found by iteration: with a thousand states, all eigenvectors take ten seconds.
_MANY = 200
#: Distance of the shift from the eigenvalue, relative to it, and the number of iterations: each gains eight digits.
_ASIDE, _ITERATIONS = 1e-8, 4


class Coefficient(NamedTuple):
    """A coefficient of a normal form, its estimated error, and the sum of the absolute values of its terms."""

    value: float
    error: float
    size: float

    @classmethod
    def of(cls, terms: Callable[[float], Array], system: Any) -> Coefficient:
        """Return the coefficient of terms; ``terms(s)`` are those of critical vectors that are moved by the part s of their
        size.

        The relative error of the derivatives of ``system`` is part of the error. The vectors are known to round-off only, which
        may be more than some of their components, so the terms are computed again with moved ones.
        """
        (best, moved), error = system.with_derivative_error(lambda: (terms(0.0), terms(_MOVED)))
        size = float(np.abs(best).sum())
        return cls(float(best.sum()), float(abs(best.sum() - moved.sum())) + error * size, size)

    @property
    def signed(self) -> float:
        """The value for a test function: 0 where it is smaller than its error, as all along a curve of linear equations."""
        return 0.0 if abs(self.value) <= self.error else self.value

    @property
    def vanishes(self) -> bool:
        """The terms cancel, or are round-off of derivatives of order one.

        Where a coefficient is round-off of large terms, or infinite, its sign changes without a zero.
        """
        return abs(self.value) < _CANCELLED * self.size + _ZERO


def first_lyapunov(system: Algebraic, x: Array, pair: CriticalPair) -> Coefficient:
    """Return the first Lyapunov coefficient at a Hopf point; NaN where another eigenvalue is zero."""
    size = np.ones(system.state_size) if system.scales is None else system.scales.states
    field, omega, q, w = system.as_field(), pair.frequency, pair.right / size, pair.left * size
    matrix = system.jacobian(x) * size / size[:, None]

    still, one = np.zeros(len(x) - len(q)), np.eye(len(q))

    def along(*vectors: Any) -> Any:
        """Return B or C along directions of the states, of unknowns divided by their sizes."""
        return of_complex(lambda parts: field.along(x, [np.append(part, still) for part in parts]), vectors)

    def terms(s: float) -> Array:
        v = moved(q, s)
        constant = np.linalg.solve(matrix, along(v, v.conj()).real)
        twice = np.linalg.solve(2j * omega * one - matrix, along(v, v))
        vectors = np.array([along(v, v, v.conj()), -2 * along(v, constant), along(v.conj(), twice)])
        found: Array = (vectors @ w).real / (2 * omega)
        return found

    try:
        return Coefficient.of(terms, system)
    except np.linalg.LinAlgError:
        return Coefficient(float("nan"), float("nan"), float("nan"))


def moved(vector: Any, s: float) -> Any:
    """Return a vector moved by s times its largest component in a random direction."""
    return vector + s * np.abs(vector).max() * np.random.default_rng(5).uniform(-1, 1, vector.shape) if s else vector
