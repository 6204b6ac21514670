"""The bordered matrix that is regular at a simple branch point, and what its solutions say (Griewank & Reddien 1984).

At a simple branch point F_x, of shape (N, N + 1), has a two-dimensional kernel. One column psi and two rows Phi make the matrix
regular:

                                     x     beta
                                  [ F_x    psi ]   N equations F
                            M =   [ Phi     0  ]   2 coordinates s = Phi.x along the kernel

Its solutions M [v_i; g_i] = [0; e_i] are the kernel, and two numbers g that vanish exactly at the branch point.
Lyapunov-Schmidt reduction makes this plain: on the manifold F(x) + beta psi = 0, g is the gradient of the scalar beta over the
coordinates s. The branch point is where the gradient vanishes, and the Hessian of beta is the algebraic bifurcation equation.
"""

from __future__ import annotations

import numpy as np

from contin.arrays import Array
from contin.core.protocol import Discretization
from contin.draws import generator
from contin.errors import ConvergenceError
from contin.linalg.border import FITS, Bordered, cosine, orthonormal, rows_fit
from contin.linalg.singular import smallest_directions

#: Smallest singular value of M, relative to the second smallest, below which M counts as singular. At double points of random
#: 3 x 3 problems it was 1e-14 and less, at one of two simple points at a distance d it was about d. Ten times larger, branch
#: points whose parameters differ by less than 1e-7 would not be located one by one.
_REGULAR = 1e-8


class BorderedMatrix:
    """M at x for given borders, factored.

    Parameters
    ----------
    system : Discretization
    x : ndarray, shape (size,)
    phi : ndarray, shape (2, size)
        The rows Phi, without the weights of the inner product.
    psi : ndarray, shape (equations,)
        The column.

    Attributes
    ----------
    borders : pair of ndarray
        Phi and psi.
    residual : ndarray, shape (equations,)
        F(x).
    kernel : ndarray, shape (2, size)
        v_1, v_2.
    g : ndarray, shape (2,)
        Gradient of beta.
    factors : Factors
    """

    def __init__(self, system: Discretization, x: Array, phi: Array, psi: Array) -> None:
        rows = np.zeros((2, system.size + 1))
        rows[:, :-1] = phi * system.weights
        self._system, self.borders = system, (phi, psi)
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

    def left(self) -> Array:
        """Return the multipliers with unit length."""
        left = self.multipliers()
        return left / np.linalg.norm(left)

    def hessian(self, x: Array) -> Array:
        """Return the Hessian of beta, -w.F_xx v_i v_j, shape (2, 2), at the x that the matrix was made at.

        F(x(s)) + beta(s) psi = 0 with Phi.x = s is differentiated twice and multiplied by w.
        """
        w, (a, b) = self.multipliers(), self.kernel
        aa, ab, bb = (float(-w @ self._system.along(x, pair)) for pair in ((a, a), (a, b), (b, b)))
        return np.array([[aa, ab], [ab, bb]])


def borders_at(system: Discretization, x: Array, kernel: Array | None = None) -> tuple[Array, Array]:
    """Return borders made of null vectors at x: those that random borders give, improved once, or rows about the ``kernel``.

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
