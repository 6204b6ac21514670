"""The first Lyapunov coefficient of a Hopf point (Kuznetsov, Elements of Applied Bifurcation Theory, section 5.4).

With A the Jacobian of the field, A q = i omega q, w.A = i omega w., |q| = 1 and w.q = 1, and B and C the derivatives of second
and third order,

    l1 = Re w.[ C(q, q, q*) - 2 B(q, A^-1 B(q, q*)) + B(q*, (2 i omega - A)^-1 B(q, q)) ] / (2 omega).

Where it is negative the bifurcation is supercritical: cycles are on the side where the equilibrium is unstable, and attract on
the centre manifold. Where it is positive the bifurcation is subcritical.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from contin.arrays import Array, ComplexArray
from contin.core.multilinear import of_complex
from contin.equilibria.equations import AlgebraicEquations
from contin.events.arc import SpecialPoint
from contin.events.coefficient import Coefficient
from contin.linalg.orientation import oriented


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


def at_hopf_point(system: AlgebraicEquations, point: SpecialPoint) -> Coefficient | None:
    """Return the first Lyapunov coefficient where one pair crosses the axis; None at other special points."""
    if point.label != "HB" or not point.is_simple:
        return None
    pair = critical_pair(system.jacobian(point.trial.x), point.details["frequency"])
    return first_lyapunov(system, point.trial.x, pair)


def first_lyapunov(system: AlgebraicEquations, x: Array, pair: CriticalPair) -> Coefficient:
    """Return the first Lyapunov coefficient at a Hopf point; NaN where another eigenvalue is zero."""
    size, field, one = system.scales.states, system.as_field(), np.eye(system.state_size)

    def terms(point: Array) -> Array:
        jacobian = system.jacobian(point)
        omega, right, left = pair if point is x else critical_pair(jacobian, pair.frequency)
        q, w, matrix = right / size, left * size, jacobian * size / size[:, None]

        def along(*vectors: Any) -> Any:
            """Return B or C along directions of the states, of unknowns divided by their sizes."""
            return of_complex(lambda stacks: field.stack_along(point, stacks), vectors)

        constant = np.linalg.solve(matrix, along(q, q.conj()).real)
        twice = np.linalg.solve(2j * omega * one - matrix, along(q, q))
        vectors = np.array([along(q, q, q.conj()), -2 * along(q, constant), along(q.conj(), twice)])
        found: Array = (vectors @ w).real / (2 * omega)
        return found

    try:
        return Coefficient.of(terms, x, system)
    except np.linalg.LinAlgError:
        return Coefficient(float("nan"), float("nan"), float("nan"))
