"""Homoclinic orbits beside a Bogdanov-Takens point: a first guess from the normal form.

On the centre manifold u = u0 + w q0 + z q1 + ... with the normal form (Kuznetsov, Elements of Applied Bifurcation Theory, 8.4)

    w' = z,    z' = b1 + b2 z + a w^2 + b w z.

With a size e, b1 = -4 e^4 / a, b2 = (10 / 7) (b / a) e^2 and s = e t its homoclinic orbit is, up to terms smaller by e,

    w = (e^2 / a) (2 - 6 / cosh(s)^2),    z = (12 e^3 / a) sinh(s) / cosh(s)^3.

A is the Jacobian at u0, A q0 = 0, A q1 = q0, and p1, p0 the same for its transpose. The equations for the rest, u0 + h1 b1 +
h2 b2 and the parameters k1 b1 + k2 b2 + k b2^2 / 2, are those of Al-Hdaibat, Govaerts, Kuznetsov and Meijer (2016): both
sides of u' = F(u, p) are expanded in w, z, b1 and b2; p1 times the terms with w b_i, p0 times them and p1 times those with
z b_i determine h_i and k_i, and p1 times those with b2^2 determines k.
"""

from __future__ import annotations

import numpy as np

from contin.arrays import Array
from contin.collocation.degree import CYCLE_DEGREE
from contin.connections.statement import ConnectionProblem
from contin.connections.system import ConnectionCollocation
from contin.equilibria.system import Algebraic
from contin.errors import ProblemError
from contin.problems.own_names import TIME

#: Intervals of the first mesh; it is adapted in any case.
INTERVALS = 60
#: Half of the time, in units of 1 / size: cut off there, the orbit ends at a distance of 2e-5 of its size from the saddle.
_HALF = 7.0


class Takens:
    """The normal form of a Bogdanov-Takens point.

    Parameters
    ----------
    base : Algebraic
        In the user's units, with two free parameters.
    x : ndarray, shape (size,)

    Raises
    ------
    ProblemError
        The normal form is degenerate.
    """

    def __init__(self, base: Algebraic, x: Array) -> None:
        self.base, self.x, self.n = base, x, base.state_size
        self.matrix = base.jacobian(x)
        self._vectors()
        self._coefficients()
        self._unfolding()

    def _vectors(self) -> None:
        """Find q0, q1, p0 and p1, with p0.q0 = p1.q1 = 1 and p0.q1 = p1.q0 = 0."""
        left, _, right = np.linalg.svd(self.matrix)
        q0, p1 = right[-1], left[:, -1]
        self._bordered = np.block([[self.matrix, p1[:, None]], [q0[None], np.zeros((1, 1))]])
        q1 = self._solved(q0)
        p0 = np.linalg.solve(self._bordered.T, np.append(p1, 0.0))[:-1]
        p0, p1 = p0 / (p1 @ q1), p1 / (p1 @ q1)
        self.q, self.p = (q0, q1), (p0 - (p0 @ q1) * p1, p1)

    def _solved(self, right_side: Array) -> Array:
        """Return the v with A v = r and q0.v = 0."""
        return np.linalg.solve(self._bordered, np.append(right_side, 0.0))[:-1]

    def _along(self, v: Array, w: Array) -> Array:
        """Return B(v, w), of directions of the states."""
        return self.base.along(self.x, [np.append(direction, np.zeros(2)) for direction in (v, w)])

    def _coefficients(self) -> None:
        """Find a, b, and the terms of second order of the centre manifold, of w^2, w z and z^2."""
        (q0, q1), (p0, p1) = self.q, self.p
        of_ww, of_wz, of_zz = self._along(q0, q0), self._along(q0, q1), self._along(q1, q1)
        self.a, self.b = float(p1 @ of_ww) / 2, float(p0 @ of_ww + p1 @ of_wz)
        if not self.a or not self.b:
            raise ProblemError("kind: no homoclinic orbits are known to leave from a degenerate Bogdanov-Takens point")
        ww = self._solved(2 * self.a * q1 - of_ww)
        wz = self._solved(self.b * q1 + ww - of_wz)
        self.second = ww, wz, self._solved(2 * wz - of_zz)

    def _unfolding(self) -> None:
        """Find the columns h_i and k_i, and k."""
        (p0, p1), n, base, x = self.p, self.n, self.base, self.x
        q0, q1 = (np.asarray(np.append(q, np.zeros(2)), dtype=float) for q in self.q)
        matrix = np.zeros((n + 2, n + 2))  # A and the columns of both parameters; p1.B(q0, .), and of w z
        matrix[:n] = np.column_stack([self.matrix, base.parameter_columns(x, base.free)])
        matrix[n] = base.bent(x, p1, q0)
        matrix[n + 1] = base.bent(x, p0, q0) + base.bent(x, p1, q1)
        _, wz, zz = self.second
        right_side = np.zeros((n + 2, 2))
        right_side[:, 0] = np.concatenate([self.q[1], [p1 @ wz, p0 @ wz + p1 @ zz]])
        right_side[-1, 1] = 1.0
        self.linear = np.linalg.solve(matrix, right_side)
        second = np.asarray(self.linear[:, 1], dtype=float)
        square = float(p1 @ base.along(x, [second, second]))
        normal = p1 @ matrix[:n, n:]
        self.bent = -square * normal / (normal @ normal)

    @property
    def rate(self) -> float:
        """A size at which what the first guess leaves out is no longer small: of a / b, and of the other eigenvalues."""
        return min(abs(self.a / self.b), float(np.linalg.norm(self.matrix, 2)))

    def orbit(self, size: float) -> tuple[Array, Array, Array]:
        """Return times from 0 to 1, the states of the homoclinic orbit there (K, n), and the two parameters."""
        s = np.linspace(-_HALF, _HALF, INTERVALS * CYCLE_DEGREE + 1)
        w = size**2 / self.a * (2 - 6 / np.cosh(s) ** 2)
        z = 12 * size**3 / self.a * np.sinh(s) / np.cosh(s) ** 3
        states = self._states(size, w, z)
        by_second = 10 / 7 * self.b / self.a * size**2
        return (s + _HALF) / (2 * _HALF), states, self._at(size)[self.n :] + self.bent * by_second**2 / 2

    def _at(self, size: float) -> Array:
        """Return the point w = z = 0 of the centre manifold: states and parameters."""
        unfolded = np.array([-4 * size**4, 10 / 7 * self.b * size**2]) / self.a
        return self.x + self.linear @ unfolded

    def _states(self, size: float, w: Array, z: Array) -> Array:
        """Return states on the centre manifold, shape (K, n)."""
        terms = zip((w, z, w * w / 2, w * z, z * z / 2), (*self.q, *self.second))
        return self._at(size)[: self.n] + sum(np.outer(factor, vector) for factor, vector in terms)

    def guess(self, size: float) -> tuple[ConnectionCollocation, Array, float]:
        """Return the system of homoclinic orbits, that of this size as unknowns, and its distance from the point."""
        times, states, values = self.orbit(size)
        names, free = self.base.problem.state_names, self.base.free
        known = dict(zip(self.base.problem.parameters, map(float, self.base.all_parameters(self.x))))
        eigenvalues = np.linalg.eigvals(self.matrix)
        hyperbolic = eigenvalues[np.argsort(np.abs(eigenvalues))[2:]]
        problem = ConnectionProblem(
            self.base.problem.residual, names, known, unstable=1 + int(np.count_nonzero(hyperbolic.real > 0))
        )
        saddle = self._states(size, np.array([2 * size**2 / self.a]), np.zeros(1))[0]
        parameters = {**known, **dict(zip(free, values)), TIME: 2 * _HALF / size, **dict(zip(problem.multipliers, saddle))}
        system = ConnectionCollocation(problem, times[::CYCLE_DEGREE], CYCLE_DEGREE, (*free, *problem.multipliers), parameters)
        evenly = np.stack([np.interp(system.nodes, times, column) for column in states.T], axis=1)
        x = system.pack(evenly, parameters)
        rest = {**parameters, **known, **dict(zip(problem.multipliers, self.x[: self.n]))}
        far = x - system.pack(np.tile(self.x[: self.n], (len(evenly), 1)), rest)
        return system.with_reference(x), x, float(np.sqrt(system.weights @ far**2))
