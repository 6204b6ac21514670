"""The bordered matrix that is regular at a simple branch point, and the point that it locates (Griewank & Reddien 1984).

At a simple branch point F_x, of shape (N, N + 1), has a two-dimensional kernel. One column psi and two rows Phi make the matrix
regular:

                                     x     beta
                                  [ F_x    psi ]   N equations F
                            M =   [ Phi     0  ]   2 coordinates s = Phi.x along the kernel

Its solutions M [v_i; g_i] = [0; e_i] are the kernel, and two numbers g that vanish exactly at the branch point.
Lyapunov-Schmidt reduction makes this plain: on the manifold F(x) + beta psi = 0, g is the gradient of the scalar beta over the
coordinates s. The branch point is where the gradient vanishes, and the Hessian of beta is the algebraic bifurcation equation.

Branch points are located through their own regular equations, with the tangents of all branches that meet there: by Newton's
method for F + beta psi = 0 together with grad beta = 0. Linearize with the borders; one update solves the first equations, one
along the kernel, by the Hessian, brings the gradient to zero. Between new Hessians the change of the gradient updates it
(Broyden's rule).
"""

from __future__ import annotations

import dataclasses
from dataclasses import dataclass
from typing import Any, ClassVar

import numpy as np

from contin import draws
from contin.arrays import Array
from contin.core.newton import Newton
from contin.core.protocol import Carrier, Discretization, inner
from contin.draws import generator
from contin.errors import ConvergenceError
from contin.events.labelled import Elsewhere, Finding
from contin.levels import APART, DEPENDENT, LOCATED
from contin.linalg.border import FITS, Bordered, cosine, orthonormal, rows_fit, smallest_directions
from contin.linalg.orientation import ordered, oriented, oriented_along

#: Smallest singular value of M, relative to the second smallest, below which M counts as singular. At double points of random
#: 3 x 3 problems it was 1e-14 and less, at one of two simple points at a distance d it was about d. Ten times larger, branch
#: points whose parameters differ by less than 1e-7 would not be located one by one.
_REGULAR = 1e-8


class BorderedMatrix:
    """M at x for given borders, factored.

    - ``system`` (Discretization)
    - ``x`` (ndarray, shape (size,))
    - ``phi`` (ndarray, shape (2, size)): The rows Phi, without the weights of the inner product.
    - ``psi`` (ndarray, shape (equations,)): The column.

    - ``borders`` (pair of ndarray): Phi and psi.
    - ``residual`` (ndarray, shape (equations,)): F(x).
    - ``kernel`` (ndarray, shape (2, size)): v_1, v_2.
    - ``g`` (ndarray, shape (2,)): Gradient of beta.
    - ``factors`` (Factors)
    """

    def __init__(self, system: Discretization, x: Array, phi: Array, psi: Array) -> None:
        rows = np.zeros((2, system.size + 1))
        rows[:, :-1] = phi * system.weights
        self._system, self.x, self.borders = system, x, (phi, psi)
        self.residual, self.factors = system.linearize(x, rows, psi[None, :])
        self._bordered = Bordered(self.factors, (system.equations, system.size), rows=2)
        self.kernel, self.g = self._bordered.right, self._bordered.g[:, 0]

    def is_regular(self) -> bool:
        """Return whether M is regular. It is singular where the kernel of F_x has more than two dimensions."""
        response = smallest_directions(self.factors, self._system.size + 1, 2)[2]
        if not np.isfinite(response).all():
            return False
        largest, second = np.linalg.svd(response, compute_uv=False)
        return bool(second > _REGULAR * largest)

    def multipliers(self) -> Array:
        """Return w, the row of the inverse that belongs to psi: w.psi = 1, dg = -w.F_xy v; about the left null vector."""
        return self._bordered.left[0]

    @property
    def fits(self) -> bool:
        """Whether the kernel and its multipliers have not turned away from the borders."""
        return rows_fit(self.kernel, self._system.weights) and not cosine(self.borders[1], self.multipliers()) < FITS

    def gradient(self, x: Array) -> Array:
        """Return g at x, or right beside it, as -w.F_x v, shape (2,), which round-off of the factors enters as a square."""
        return -self.kernel @ self._system.transposed_product(x, self.multipliers())

    def left(self) -> Array:
        """Return the multipliers with unit length."""
        left = self.multipliers()
        return left / np.linalg.norm(left)

    def hessian(self) -> Array:
        """Return the Hessian of beta, -w.F_xx v_i v_j, shape (2, 2).

        F(x(s)) + beta(s) psi = 0 with Phi.x = s is differentiated twice and multiplied by w.
        """
        w = self.multipliers()
        return -np.array([self._system.bent(self.x, w, v) for v in self.kernel]) @ self.kernel.T


def borders_at(system: Discretization, x: Array, kernel: Array | None = None) -> tuple[Array, Array]:
    """Return borders made of null vectors at x: those that rows about the ``kernel`` give, or random ones, improved once.

    Where x is not at a branch point, the second null vector depends on the borders: random ones may be nearly normal to it.
    """
    random = generator("bordered")
    rows, left = kernel, random.standard_normal(system.equations) / np.sqrt(system.equations)
    for _ in range(2 if kernel is None else 1):
        rows = random.standard_normal((2, system.size)) if rows is None else rows
        matrix = BorderedMatrix(system, x, orthonormal(rows, system.weights), left)
        if not np.isfinite(matrix.kernel).all():
            raise ConvergenceError("no branch point near by: the bordered matrix is singular")
        rows, left = matrix.kernel, matrix.left()
    return orthonormal(matrix.kernel, system.weights), left


#: Cosine between the kernels of a branch point on two meshes, below which they are two points.
_SAME_KERNEL = 0.9
#: An update at least this part of the one before is expected to follow, with a new Hessian: between new Hessians convergence is
#: linear.
_LINEAR = 0.1
#: Small updates that shrink by less than this factor are round-off.
_SHRINKING = 0.3
#: An update larger than this, relative to 1 + |x|, leaves the neighbourhood for good.
_GONE = 10
#: Where the Hessian explains less of the gradient than one half it does not lead to a zero.
_UNEXPLAINED = 0.5


@dataclass(frozen=True, eq=False)
class BranchPoint(Finding):
    """A simple branch point.

    Attributes
    ----------
    x : ndarray, shape (size,)
    tangents : tuple of ndarray
        Unit tangents of the two branches, `contin.linalg.orientation.oriented`; empty where none is real (an isolated point).
    kernel : ndarray, shape (2, size)
        Orthonormal basis of the kernel of F_x.
    left : ndarray, shape (equations,)
        Left null vector.
    hessian : ndarray, shape (2, 2)
        Coefficients of the algebraic bifurcation equation a.H.a = 0 of the tangents a.kernel.
    imperfection : float
        The residual beta by which the discrete equations miss a perfect bifurcation.

    Examples
    --------
    >>> from contin import AlgebraicProblem
    >>> from contin.lowlevel import Algebraic
    >>> transcritical = AlgebraicProblem(lambda u, p: (u.x * (p.a - u.x),), ["x"], {"a": 0.0})
    >>> found = locate_branch_point(Algebraic(transcritical, ["a"]), np.array([0.1, 0.1]))
    >>> sorted(abs(round(float(tangent[0]), 6)) for tangent in found.tangents)  # x = 0 and x = a
    [0.0, 0.707107]
    """

    x: Array
    tangents: tuple[Array, ...]
    kernel: Array
    left: Array
    hessian: Array
    imperfection: float
    is_branch_point: ClassVar[bool] = True
    has_equations: ClassVar[bool] = True

    def again(self, system: Discretization, carry: Carrier, x: Array, newton: Newton) -> BranchPoint:
        """Return the branch point with the same kernel on another mesh.

        Examples
        --------
        >>> from contin import AlgebraicProblem
        >>> from contin.lowlevel import Algebraic
        >>> system = Algebraic(AlgebraicProblem(lambda u, p: (u.x * (p.a - u.x),), ["x"], {"a": 0.0}), ["a"])
        >>> found = locate_branch_point(system, np.array([0.1, 0.1]))
        >>> bool(np.abs(found.again(system, np.array, found.x, Newton()).x).max() < 1e-12)  # there is no other mesh
        True
        """
        kernel = np.array([carry(vector) for vector in self.kernel])
        found = locate_branch_point(system, carry(x), newton, kernel)
        overlap = found.kernel @ (system.weights * kernel[:, : system.size]).T
        if np.linalg.svd(overlap, compute_uv=False)[-1] < _SAME_KERNEL:
            raise Elsewhere("another branch point was found on the finer mesh")
        return found.along(system, carry(self.tangents[0])) if self.tangents else found

    def round_off(self, system: Discretization) -> Array:
        """Return by how much free parameters change by round-off, shape (free parameters,).

        Newton steps from the point, rounded anew each time, lead back to it but for that.

        Examples
        --------
        >>> from contin import AlgebraicProblem
        >>> from contin.lowlevel import Algebraic
        >>> pitchfork = AlgebraicProblem(lambda u, p: (u.x * (p.a - u.x**2 - 1),), ["x"], {"a": 1.0})
        >>> system = Algebraic(pitchfork, ["a"])
        >>> bool(locate_branch_point(system, np.array([0.1, 1.1])).round_off(system).max() < 1e-15)
        True
        """
        random, noise = generator("branch point"), np.zeros_like(self.x)
        with np.errstate(all="ignore"):
            matrix = BorderedMatrix(system, self.x, self.kernel, self.left)
            for _ in range(draws.DRAWS):
                x = draws.rounded(random, self.x)
                update = matrix.factors.solve(np.concatenate([system.residual(x), [0.0, 0.0]]))[:-1]
                update = update + _drop(self.hessian, matrix.gradient(x)) @ matrix.kernel
                noise = np.maximum(noise, np.abs(x - update - self.x))
        return noise[system.state_size :]

    @property
    def arrays(self) -> dict[str, Array]:
        return {
            "kernel": self.kernel, "left": self.left, "hessian": self.hessian, "tangents": np.array(self.tangents),
        }  # fmt: skip

    @property
    def numbers(self) -> dict[str, Any]:
        return {"imperfection": self.imperfection}

    def __repr__(self) -> str:
        branches = f"{len(self.tangents)} branches cross" if self.tangents else "isolated"
        return f"BranchPoint({branches}; imperfection {self.imperfection:.1e})"

    @property
    def gap(self) -> float:
        """Distance at which the curve beta = 0, a hyperbola near by, passes the branch point: zero where it is perfect."""
        largest = float(np.max(np.abs(np.linalg.eigvalsh(self.hessian))))
        return float(np.sqrt(2 * self.imperfection / largest)) if largest > 0 else 0.0

    def along(self, system: Discretization, direction: Array) -> BranchPoint:
        """Return the same branch point with its tangents in order: first the one nearest to ``direction``, with its sense.

        A tangent orthogonal to it, as of a symmetric pitchfork's arms, is oriented by its largest component.

        Examples
        --------
        >>> from contin import AlgebraicProblem
        >>> from contin.lowlevel import Algebraic
        >>> transcritical = AlgebraicProblem(lambda u, p: (u.x * (p.a - u.x),), ["x"], {"a": 0.0})
        >>> system = Algebraic(transcritical, ["a"])
        >>> found = locate_branch_point(system, np.array([0.1, 0.1])).along(system, np.array([-1.0, -1.0]))
        >>> found.tangents[0].round(6).tolist()
        [-0.707107, -0.707107]
        """
        unit = direction / np.sqrt(inner(system, direction, direction))
        cosines = [inner(system, tangent, unit) for tangent in self.tangents]
        order = ordered(self.tangents, cosines)
        tangents = [oriented_along(self.tangents[i], cosines[i]) for i in order]
        return dataclasses.replace(self, tangents=tuple(tangents))


def locate_branch_point(
    system: Discretization, x: Array, newton: Newton = Newton(), kernel: Array | None = None, max_iterations: int = 12
) -> BranchPoint:
    """Return the branch point near x.

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

    Examples
    --------
    >>> from contin import AlgebraicProblem
    >>> from contin.lowlevel import Algebraic
    >>> pitchfork = AlgebraicProblem(lambda u, p: (u.x * (p.a - u.x**2),), ["x"], {"a": 0.0})
    >>> found = locate_branch_point(Algebraic(pitchfork, ["a"]), np.array([0.1, 0.1]))
    >>> bool(np.all(np.abs(found.x) < 1e-8)), len(found.tangents)
    (True, 2)
    """
    with np.errstate(all="ignore"):
        search = _Search(system, np.array(x, dtype=float), newton, borders_at(system, x, kernel))
        for _ in range(max_iterations - 1):  # the first linearization made the borders
            if not search.advance():
                break
            if search.converged:
                search.refine()
                return search.result()
            search.prepare()
    raise ConvergenceError(f"no branch point near by (last update {search.before:.1e})")


class _Search:
    """The iteration of `locate_branch_point`: x, beta, and the Hessian, if known, with what is known of its change."""

    def __init__(self, system: Discretization, x: Array, newton: Newton, borders: tuple[Array, Array]) -> None:
        self.system, self.x, self.newton = system, x, newton
        self.beta = 0.0
        self.size, self.before = np.inf, np.inf  # of the last update, and of the one before
        self._rate_before = 1.0
        self._borders = borders
        self._hessian: Array | None = None
        self._slope: Any = None  # the Hessian, corrected by how the gradient has really changed
        self._drop: Array = np.zeros(2)  # the last update along the kernel
        self._gradient: Array = np.zeros(2)  # g before it

    def advance(self) -> bool:
        """Make one Newton step; return False where it leads nowhere."""
        matrix = self._matrix = BorderedMatrix(self.system, self.x, *self._borders)
        if self._hessian is None:
            self._hessian, self._origin = matrix.hessian(), self.x
            self._slope = self._hessian
        elif np.any(self._drop):  # Broyden's update
            missed = self._gradient - matrix.g - self._slope @ self._drop
            self._slope = self._slope + np.outer(missed, self._drop / (self._drop @ self._drop))
        if not (np.isfinite(self._hessian).all() and np.isfinite(matrix.g).all()):
            return False
        correction = matrix.factors.solve(np.concatenate([matrix.residual + self.beta * self._borders[1], [0.0, 0.0]]))
        self._drop = _drop(self._slope, matrix.g)
        self._gradient = matrix.g
        if np.abs(self._slope @ self._drop - matrix.g).max() > _UNEXPLAINED * np.abs(matrix.g).max():
            return False  # a gradient that does not change along the kernel: no branch point here
        update = correction[:-1] + self._drop @ matrix.kernel
        self.beta -= correction[-1]
        self.size = float(np.max(np.abs(update) / (1 + np.abs(self.x))))  # the x before: a huge update makes a huge x
        self.x = self.x - update
        return bool(np.isfinite(self.size) and self.size <= _GONE)

    def refine(self) -> None:
        """Take out of the last step what round-off of the factors has put into it."""
        self.x = self.x - _drop(self._slope, self._matrix.gradient(self._matrix.x) - self._matrix.g) @ self._matrix.kernel

    @property
    def converged(self) -> bool:
        """The estimated error is below the tolerance, or the updates are round-off."""
        rate = self._rate
        error = self.size * max(_LINEAR, rate, self._rate_before)  # what Broyden's first update explains is one direction
        return error <= self.newton.tolerance or (self.size < LOCATED and rate > _SHRINKING)

    @property
    def _rate(self) -> float:
        """How much smaller the last update was than the one before; 1 where none was before, and where it was larger."""
        return min(1.0, self.size / self.before) if np.isfinite(self.before) else 1.0

    def prepare(self) -> None:
        """Drop the Hessian where the last update was not much smaller than the one before."""
        if self.size > _LINEAR * self.before:
            self._hessian = None
        self._rate_before, self.before = self._rate, self.size

    def result(self) -> BranchPoint:
        """Return the branch point: tangents from the algebraic bifurcation equation, the kernel made orthonormal."""
        assert self._hessian is not None
        system, matrix, hessian = self.system, self._matrix, self._hessian
        if np.max(np.abs(self.x - self._origin)) > APART:
            matrix = BorderedMatrix(system, self.x, *self._borders)
            hessian = matrix.hessian()
        if not (np.isfinite(matrix.kernel).all() and np.isfinite(hessian).all() and matrix.is_regular()):
            raise ConvergenceError("no simple branch point near by: the kernel has more than two dimensions")
        tangents = [a @ matrix.kernel for a in _null_directions(hessian)]
        tangents = [oriented(tangent / np.sqrt(inner(system, tangent, tangent))) for tangent in tangents]
        tangents = [tangents[i] for i in ordered(tangents, [0.0] * len(tangents))]
        kernel = orthonormal(matrix.kernel, system.weights)
        change = np.linalg.inv([[inner(system, old, new) for new in kernel] for old in matrix.kernel])  # new = change @ old
        hessian = change @ hessian @ change.T
        return BranchPoint(self.x, tuple(tangents), kernel, matrix.left(), hessian, float(abs(self.beta)))


def _drop(slope: Array, gradient: Array) -> Array:
    """Return by how much to go back along the kernel for a gradient to vanish."""
    return np.asarray(np.linalg.lstsq(slope, gradient, rcond=DEPENDENT)[0])


def _null_directions(hessian: Array) -> list[Array]:
    """Return unit vectors a with a.H.a = 0: two where det H < 0, none otherwise."""
    values, vectors = np.linalg.eigh(hessian)
    if not values[0] < 0 < values[1]:
        return []
    ratio = np.sqrt(-values[0] / values[1])
    directions = [vectors[:, 0] + sign * ratio * vectors[:, 1] for sign in (1, -1)]
    return [direction / np.linalg.norm(direction) for direction in directions]
