"""Branch points: located through their own regular equations, with the tangents of all branches that meet there.

At a simple branch point F_x (N x (N + 1)) has a two-dimensional kernel. With one column psi and two rows Phi added, the
matrix M = [[F_x, psi], [Phi, 0]] is regular, and M [v_i; g_i] = [0; e_i] defines the kernel v and two numbers g that vanish
exactly there (Griewank & Reddien 1984). Lyapunov-Schmidt makes it plain: on the manifold F(x) + beta psi = 0, g is the
gradient of the scalar beta over the two coordinates s = Phi.x; the branch point is where the gradient vanishes, and the
Hessian of beta is the algebraic bifurcation equation.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Iterable
from dataclasses import dataclass
from typing import Any

import numpy as np

from contin.arrays import Array
from contin.discretization.protocol import Discretization, inner
from contin.errors import ConvergenceError
from contin.stepping.newton import Newton


@dataclass(frozen=True, eq=False)
class BranchPoint:
    """A simple branch point.

    Attributes
    ----------
    x : ndarray, shape (size,)
    tangents : tuple of ndarray
        Unit tangents of the two branches; empty where none is real (an isolated point).
    kernel : ndarray, shape (2, size)
        Orthonormal basis of the kernel of F_x.
    left : ndarray, shape (equations,)
        Left null vector.
    hessian : ndarray, shape (2, 2)
        Coefficients of the algebraic bifurcation equation a.H.a = 0 of the tangents a.kernel.
    imperfection : float
        The residual beta by which the discrete equations miss a perfect bifurcation.
    """

    x: Array
    tangents: tuple[Array, ...]
    kernel: Array
    left: Array
    hessian: Array
    imperfection: float


def _orthonormal(system: Discretization, vectors: Iterable[Array]) -> Array:
    result: list[Array] = []
    for vector in vectors:
        for _ in range(2):
            for other in result:
                vector = vector - inner(system, vector, other) * other
        result.append(vector / np.sqrt(inner(system, vector, vector)))
    return np.array(result)


class _Bordered:
    """M at x for given borders: its kernel vectors, the numbers g, corrections."""

    def __init__(self, system: Discretization, x: Array, phi: Array, psi: Array) -> None:
        self.rows = np.zeros((2, system.size + 1))
        self.rows[:, :-1] = phi * system.weights
        self.residual, self.factors = system.linearize(x, self.rows, psi[None, :])
        solutions = self.factors.solve(np.hstack([np.zeros((2, system.equations)), np.eye(2)]))
        self.kernel, self.g = solutions[:, :-1], solutions[:, -1]

    def multipliers(self, system: Discretization) -> Array:
        """The row of the inverse that belongs to psi: w with w.psi = 1, about the left null vector of F_x."""
        unit = np.zeros(system.size + 1)
        unit[-1] = 1.0
        return self.factors.solve_transposed(unit)[: system.equations]

    def left(self, system: Discretization) -> Array:
        """The same with unit length."""
        left = self.multipliers(system)
        return left / np.linalg.norm(left)


def along(system: Discretization, found: BranchPoint, direction: Array) -> BranchPoint:
    """The same branch point, its tangents in order: first the one nearest to ``direction``, with its sense."""
    cosines = [inner(system, tangent, direction) for tangent in found.tangents]
    order = sorted(range(len(cosines)), key=lambda i: -abs(cosines[i]))
    tangents = [found.tangents[i] * (np.sign(cosines[i]) or 1.0) for i in order]
    return dataclasses.replace(found, tangents=tuple(tangents))


@dataclass(frozen=True, eq=False)
class MultiplePoint:
    """A point where F_x loses rank by two or more at once: reported, its branches are not computed.

    Attributes
    ----------
    dimension : int
        Dimension of the kernel beyond the tangent of the branch.
    kernel : ndarray, shape (dimension, size)
        Unit vectors that span it.
    """

    dimension: int
    kernel: Array


#: An update at least this part of the one before is expected to follow: between new Hessians convergence is linear.
_LINEAR = 0.1


def locate_branch_point(
    system: Discretization, x: Array, newton: Newton = Newton(), kernel: Array | None = None, max_iterations: int = 12
) -> BranchPoint:
    """The branch point near x.

    Parameters
    ----------
    system : Collocation or alike
    x : ndarray, shape (size,)
    newton : Newton
    kernel : ndarray, shape (2, size), optional
        About the kernel that it has, where several branch points are near by.
    max_iterations : int

    Raises
    ------
    ConvergenceError
        None was found near x.
    """
    random = np.random.default_rng(20240501)
    phi = _orthonormal(system, random.standard_normal((2, system.size)) if kernel is None else kernel)
    psi = random.standard_normal(system.equations) / np.sqrt(system.equations)
    x, beta, hessian, last = np.array(x, dtype=float), 0.0, None, np.inf
    slope: Any = np.empty((2, 2))
    drop: Array = np.zeros(2)
    before: Array = np.zeros(2)
    with np.errstate(all="ignore"):
        for iteration in range(max_iterations):
            matrix = _Bordered(system, x, phi, psi)
            if iteration == 0:  # borders of random numbers first, then of the kernel itself: the best conditioned
                if not np.all(np.isfinite(matrix.kernel)):
                    raise ConvergenceError("no branch point near by: the bordered matrix is singular")
                phi, psi = _orthonormal(system, matrix.kernel), matrix.left(system)
                continue
            if hessian is None:
                hessian, origin = _hessian(system, x, matrix), x
                slope = hessian
            elif np.any(drop):  # Broyden's update: how the gradient has really changed in the last step
                missed = before - matrix.g - slope @ drop
                slope = slope + np.outer(missed, drop / (drop @ drop))
            if not (np.all(np.isfinite(hessian)) and np.all(np.isfinite(matrix.g))):
                break
            # one Newton step for F + beta psi = 0 and, through its gradient g, for grad beta = 0
            correction = matrix.factors.solve(np.concatenate([matrix.residual + beta * psi, [0.0, 0.0]]))
            drop, *_ = np.linalg.lstsq(slope, matrix.g, rcond=1e-9)
            before = matrix.g
            if np.abs(slope @ drop - matrix.g).max() > 0.5 * np.abs(matrix.g).max():
                break  # a gradient that does not change along the kernel: no branch point here
            update = correction[:-1] + drop @ matrix.kernel
            beta -= correction[-1]
            x = x - update
            size = float(np.max(np.abs(update) / (1 + np.abs(x))))
            if not np.isfinite(size) or size > 10:
                break
            rate = min(1.0, max(_LINEAR, size / last)) if np.isfinite(last) else 1.0
            if size * rate <= newton.tolerance or (size < 1e-9 and rate > 0.3):
                if np.max(np.abs(x - origin)) > 1e-3:  # the tangents are wanted as they are right there
                    matrix = _Bordered(system, x, phi, psi)
                    hessian = _hessian(system, x, matrix)
                return _finish(system, x, matrix, hessian, beta)
            if size > 0.05 * last:
                hessian = None
            last = size
    raise ConvergenceError(f"no branch point near by (last update {last:.1e})")


def _hessian(system: Discretization, x: Array, matrix: _Bordered, scale: float = 5e-3) -> Array:
    """The Hessian of beta, shape (2, 2): -w.F_xx v_i v_j, by second differences of fourth order along v_1, v_2 and v_1 + v_2.

    F(x(s)) + beta(s) psi = 0 with Phi.x = s, differentiated twice, times the row w of the inverse of M that belongs to psi.
    """
    w = matrix.multipliers(system)
    here = w @ system.residual(x)

    def bend(v: Array) -> Any:
        h = scale / np.abs(v).max()
        near, far = (sum(w @ system.residual(x + sign * length * h * v) for sign in (1, -1)) for length in (1, 2))
        return (far - 16 * near + 30 * here) / (12 * h**2)

    a, b = matrix.kernel
    aa, bb = bend(a), bend(b)
    ab = (bend(a + b) - aa - bb) / 2
    return np.array([[aa, ab], [ab, bb]])


def _finish(system: Discretization, x: Array, matrix: _Bordered, hessian: Array, beta: float) -> BranchPoint:
    """Tangents from the algebraic bifurcation equation; kernel made orthonormal, the Hessian along with it."""
    tangents = [a @ matrix.kernel for a in _null_directions(hessian)]
    tangents = [tangent / np.sqrt(inner(system, tangent, tangent)) for tangent in tangents]
    kernel = _orthonormal(system, matrix.kernel)
    change = np.array([[inner(system, new, old) for old in matrix.kernel] for new in kernel])
    gram = np.array([[inner(system, a, b) for b in matrix.kernel] for a in matrix.kernel])
    change = np.linalg.solve(gram, change.T).T  # new = change @ old
    return BranchPoint(x, tuple(tangents), kernel, matrix.left(system), change @ hessian @ change.T, float(abs(beta)))


def _null_directions(hessian: Array) -> list[Array]:
    """Unit vectors a with a.H.a = 0: two where det H < 0, none otherwise."""
    values, vectors = np.linalg.eigh(hessian)
    if not values[0] < 0 < values[1]:
        return []
    ratio = np.sqrt(-values[0] / values[1])
    directions = [vectors[:, 0] + sign * ratio * vectors[:, 1] for sign in (1, -1)]
    return [direction / np.linalg.norm(direction) for direction in directions]
