"""An independent solver for reference values: Gauss collocation in extended precision (80-bit, 64 bits of mantissa).

It shares no code with the engine. Residuals are evaluated in ``numpy.longdouble`` with tables made by mpmath; Newton's
corrections come from a sparse LU in double precision, which is iterative refinement: the solution is that of the extended
precision equations. Folds and branch points are stated as boundary value problems of their own, with the null vector among
the states, so one solver serves for all.
"""

from __future__ import annotations

import mpmath
import numpy as np
from scipy.sparse import csc_matrix
from scipy.sparse.linalg import splu

LD = np.longdouble


def _longdouble(value) -> np.longdouble:
    return LD(mpmath.nstr(value, 30))


def tables(degree: int):
    """Lobatto nodes and Gauss points on (0, 1), Gauss weights, and the matrices from nodal values to value and slope there."""
    with mpmath.workdps(40):
        legendre = [mpmath.mpf(c) for c in mpmath.taylor(lambda x: mpmath.legendre(degree, x), 0, degree)][::-1]
        slope = [c * (degree - i) for i, c in enumerate(legendre[:-1])]
        points = sorted(mpmath.re(root) for root in mpmath.polyroots(legendre, maxsteps=200, extraprec=200))
        inner = sorted(mpmath.re(root) for root in mpmath.polyroots(slope, maxsteps=200, extraprec=200))
        nodes = [-mpmath.mpf(1), *inner, mpmath.mpf(1)]
        weights = [2 / ((1 - x**2) * mpmath.polyval(slope, x) ** 2) for x in points]
        value, derivative = [], []
        for x in points:
            row, rate = [], []
            for j, node in enumerate(nodes):
                others = [other for i, other in enumerate(nodes) if i != j]
                scale = mpmath.fprod(node - other for other in others)
                product = mpmath.fprod(x - other for other in others)
                row.append(product / scale)
                rate.append(product / scale * mpmath.fsum(1 / (x - other) for other in others) * 2)
            value.append([_longdouble(v) for v in row])
            derivative.append([_longdouble(v) for v in rate])
        half = [[_longdouble((x + 1) / 2) for x in xs] for xs in (nodes, points)]
        weights = [_longdouble(w / 2) for w in weights]
        return tuple(np.array(table) for table in (*half, weights, value, derivative))


class Problem:
    """u' = f(t, u, p), b(u0, u1, p) = 0, integral of g(t, u, p) = 0 on a mesh; every function takes and returns arrays.

    ``u`` has shape (n, points), ``p`` holds the unknown parameters, ``b`` gets the columns u0, u1 of shape (n, 1).
    """

    def __init__(self, rhs, boundary, mesh, degree=8, integrals=None):
        self.rhs, self.boundary, self.integrals = rhs, boundary, integrals
        self.mesh, self.degree = np.asarray(mesh, dtype=LD), degree
        self.h = np.diff(self.mesh)
        self.basis = tables(degree)
        nodes, points = self.basis[:2]
        self.nodes = np.append((self.mesh[:-1, None] + self.h[:, None] * nodes[:-1]).ravel(), self.mesh[-1])
        self.times = (self.mesh[:-1, None] + self.h[:, None] * points).ravel()

    def _at_points(self, u):
        """Values and slopes at the Gauss points, shape (n, intervals d)."""
        d = self.degree
        local = np.stack([u[:, i : u.shape[1] - d + i : d] for i in range(d + 1)], axis=-1)  # (n, N, d + 1)
        value = np.einsum("ij,nkj->nki", self.basis[3], local).reshape(len(u), -1)
        slope = np.einsum("ij,nkj->nki", self.basis[4], local).reshape(len(u), -1)
        return value, slope

    def residual(self, u, p):
        value, slope = self._at_points(u)
        h = np.repeat(self.h, self.degree)
        parts = [(slope - h * np.array(self.rhs(self.times, value, p))).T.ravel()]
        parts.append(np.array(self.boundary(u[:, :1], u[:, -1:], p)).ravel())
        if self.integrals is not None:
            weights = np.tile(self.basis[2], len(self.h)) * h
            parts.append((np.array(self.integrals(self.times, value, p)) * weights).sum(axis=1))
        return np.concatenate(parts)

    def _matrix(self, u, p):
        """The Jacobian in double precision, by complex steps of the users' functions."""
        n, k, d, N = len(u), len(p), self.degree, len(self.h)
        value = np.asarray(self._at_points(u)[0], dtype=complex)
        times, p, u = self.times.astype(float), np.asarray(p, dtype=complex), np.asarray(u, dtype=complex)
        step = 1e-200
        h, weights = np.repeat(self.h, d).astype(float), np.tile(self.basis[2], N).astype(float)
        V, D = self.basis[3].astype(float), self.basis[4].astype(float)

        def derivative(function, slot, *states):
            states, q = [s.copy() for s in states], p.copy()
            if slot < n * len(states):
                states[slot // n][slot % n] += 1j * step
            else:
                q[slot - n * len(states)] += 1j * step
            args = (times, *states, q) if len(states) == 1 else (*states, q)
            return np.array([np.broadcast_to(r, states[0].shape[1]) for r in function(*args)]).imag / step

        rows, columns, entries = [], [], []

        def put(r, c, e):
            shape = np.broadcast_shapes(np.shape(r), np.shape(c), np.shape(e))
            for target, what in ((rows, r), (columns, c), (entries, e)):
                target.append(np.broadcast_to(what, shape).ravel())

        size = (N * d + 1) * n
        point = np.arange(N * d)
        interval, inner = point // d, point % d
        first_bc = N * d * n
        first_int = first_bc + len(self.boundary(u[:, :1], u[:, -1:], p))
        for b in range(n + k):
            J = derivative(self.rhs, b, value)
            G = derivative(self.integrals, b, value) * (weights * h) if self.integrals is not None else np.zeros((0, 1))
            E = [derivative(self.boundary, slot, u[:, :1], u[:, -1:]) for slot in ((b, b + n) if b < n else (b + n,))]
            if b >= n:
                for a in range(n):
                    put(point * n + a, size + b - n, -h * J[a])
                put(np.arange(first_bc, first_int), size + b - n, E[0][:, 0])
                put(first_int + np.arange(len(G)), size + b - n, G.sum(axis=1))
                continue
            for node in range(d + 1):
                column = (interval * d + node) * n + b
                for a in range(n):
                    put(point * n + a, column, -h * J[a] * V[inner, node] + (D[inner, node] if a == b else 0.0))
                for q in range(len(G)):
                    put(first_int + q, column, G[q] * V[inner, node])
            put(np.arange(first_bc, first_int), b, E[0][:, 0])
            put(np.arange(first_bc, first_int), N * d * n + b, E[1][:, 0])
        entries, rows, columns = (np.concatenate(part) for part in (entries, rows, columns))
        entries = entries.astype(float)
        return csc_matrix((entries, (rows, columns)), shape=(first_int + self._count(u, p, value), size + k))

    def _count(self, u, p, value):
        return 0 if self.integrals is None else len(self.integrals(self.times.astype(float), value, p))

    def solve(self, u, p, tolerance=1e-18, say=False):
        """Newton from u (n, nodes), p (k,): the solution, its parameters, and the size of the last correction."""
        u, p = np.asarray(u, dtype=LD).copy(), np.asarray(p, dtype=LD).copy()
        last = np.inf
        for _ in range(40):
            residual = self.residual(u, p)
            if last > 1e-6:
                matrix = self._matrix(u, p)
                if matrix.shape[0] != matrix.shape[1]:
                    raise ValueError(f"{matrix.shape[0]} equations for {matrix.shape[1]} unknowns")
                factors = splu(matrix)
            scale = np.abs(residual).max()
            update = factors.solve((residual / scale).astype(float)).astype(LD) * scale
            u -= update[: u.size].reshape(u.shape[1], -1).T
            p -= update[u.size :]
            size = float(np.max(np.abs(update) / (1 + np.concatenate([np.abs(u).T.ravel(), np.abs(p)]))))
            if say:
                print(f"   update {size:.1e}")
            if size < tolerance or (size < 1e-13 and size > 0.3 * last):
                return u, p, size
            last = size
        raise ArithmeticError(f"no convergence, last update {size:.1e}")
