"""Orthogonal collocation at Gauss points on a mesh: the discrete problem, its residual and its Jacobian.

On each of N intervals the solution is a polynomial of degree d through d + 1 Lobatto nodes (the end nodes shared), and
satisfies the equation at the d Gauss points: error O(h^(2 d)) at the mesh points (superconvergence, de Boor & Swartz
1973). Integrals use the same Gauss points, so they converge as fast.
"""

from __future__ import annotations

import functools
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from contin._kernels import KERNEL, njit
from contin._vector import scale_into
from contin.condensation import Factorization
from contin.errors import ProblemError
from contin.interface import Array, Carrier, Discretization, Factors
from contin.mesh import MeshControl, adapted_mesh
from contin.problem import BoundaryValueProblem
from contin.structure import Layout, Seeds
from contin.system import System

if TYPE_CHECKING:
    from contin.events import Monitor

DEGREES = range(2, 9)


@dataclass(frozen=True)
class Basis:
    """Tables of one degree d on the unit interval.

    ``nodes`` (d + 1,) Lobatto points and ``node_weights`` their quadrature; ``points`` (d,) Gauss points and
    ``weights`` theirs; ``value`` and ``slope`` (d, d + 1) take nodal values to the Gauss points; ``highest`` (d + 1,)
    gives the d-th derivative; ``barycentric`` (d + 1,) for interpolation; ``constant`` is max |prod (x - node)| / (d + 1)!.
    """

    degree: int
    nodes: Array
    node_weights: Array
    points: Array
    weights: Array
    value: Array
    slope: Array
    highest: Array
    barycentric: Array
    constant: float


@functools.cache
def basis(degree: int) -> Basis:
    """The tables of a degree from 2 to 8."""
    if degree not in DEGREES:
        raise ProblemError(f"degree: {degree!r} must be a whole number from 2 to 8")
    legendre = np.polynomial.legendre
    points, weights = legendre.leggauss(degree)
    top = np.zeros(degree + 1)
    top[-1] = 1.0
    nodes = np.concatenate([[-1.0], np.sort(legendre.legroots(legendre.legder(top)).real), [1.0]])
    node_weights = 2 / (degree * (degree + 1) * legendre.legval(nodes, top) ** 2)
    nodes, points = (nodes + 1) / 2, (points + 1) / 2
    differences = nodes[:, None] - nodes + np.eye(degree + 1)
    barycentric = 1 / differences.prod(axis=1)
    value = interpolation(nodes, barycentric, points)
    nodal_slope = barycentric / barycentric[:, None] / differences
    np.fill_diagonal(nodal_slope, 0.0)
    np.fill_diagonal(nodal_slope, -nodal_slope.sum(axis=1))
    factorial = np.prod(np.arange(1.0, degree + 1))
    fine = np.linspace(0, 1, 2001)
    constant = np.abs((fine[:, None] - nodes).prod(axis=1)).max() / (factorial * (degree + 1))
    tables = (nodes, node_weights / 2, points, weights / 2, value, value @ nodal_slope, factorial * barycentric, barycentric)
    return Basis(degree, *tables, constant)


def interpolation(nodes: Array, barycentric: Array, at: Array) -> Array:
    """Matrix (len(at), len(nodes)) that evaluates the polynomial through the nodes ``at`` points (barycentric form)."""
    distance = at[:, None] - nodes
    exact = distance == 0
    terms = barycentric / np.where(exact, 1.0, distance)
    matrix = terms / terms.sum(axis=1, keepdims=True)
    result: Array = np.where(exact.any(axis=1, keepdims=True), exact, matrix)
    return result


@njit("void(f8[:,::1], Array(f8, 1, 'C', readonly=True), f8[:,::1])", **KERNEL)
def at_points(value: Array, x: Array, points: Array) -> None:
    """Fill ``points`` (N d, n) with the states at the Gauss points, from the nodal values in x."""
    d = value.shape[0]
    count, n = points.shape
    for j in range(count // d):
        for i in range(d):
            row = points[j * d + i]
            for a in range(n):
                row[a] = 0.0
            for node in range(d + 1):
                factor, start = value[i, node], (j * d + node) * n
                for a in range(n):
                    row[a] += factor * x[start + a]


@njit("void(i8, f8[:,::1], f8[::1], f8[::1], Array(f8, 1, 'C', readonly=True), f8[:,::1], f8[:,::1], f8[::1])", **KERNEL)
def collocate(n: int, slope: Array, weights: Array, h: Array, x: Array, field: Array, boundary: Array, residual: Array) -> None:
    """Fill the ``residual`` from values of rhs and integrands at the Gauss points (N d, n + n_int) and boundary (1, n_bc)."""
    d, conditions, integrals = weights.size, boundary.shape[1], field.shape[1] - n
    last = residual[residual.size - integrals :]
    for q in range(integrals):
        last[q] = 0.0
    for j in range(h.size):
        for i in range(d):
            values, start = field[j * d + i], (j * d + i) * n
            for a in range(n):
                residual[start + a] = -h[j] * values[a]
            for node in range(d + 1):
                factor, first = slope[i, node], (j * d + node) * n
                for a in range(n):
                    residual[start + a] += factor * x[first + a]
            for q in range(integrals):
                last[q] += weights[i] * h[j] * values[n + q]
    for q in range(conditions):
        residual[field.shape[0] * n + q] = boundary[0, q]


@njit(
    "void(UniTuple(i8[::1], 9), f8[:,::1], f8[:,::1], f8[::1], f8[::1], f8[:,:,::1], f8[:,:,::1], f8[:,::1], f8[:,::1],"
    "f8[:,:,::1], f8[:,:,::1], f8[:,::1], f8[:,::1], f8[:,::1])",
    cache=True, error_model="numpy", nogil=True,
)  # fmt: skip
def assemble(
    layout: Any,
    value: Array,
    slope: Array,
    weights: Array,
    h: Array,
    jacobian: Array,
    at_ends: Array,
    columns: Array,
    rows: Array,
    local: Array,
    border: Array,
    corner: Array,
    start: Array,
    end: Array,
) -> None:
    """Fill the blocks that `contin.condensation.Factorization` takes.

    ``jacobian`` (points, n + n_int, n + k) of rhs and integrands is by the states in the layout's order, ``at_ends`` (1,
    n_bc, 2 n + k) of the boundary conditions by those at both ends as they are. ``columns`` (c, equations) and ``rows`` (r,
    unknowns) are the extra ones; ``start`` and ``end`` are filled with the coefficients of the boundary conditions.
    Equations are scaled by h. Interior columns of states that do not occur in a row are left as they are: nobody looks at
    them.
    """
    order, offsets, follows, equations, inside, ends, left, right, remaining = layout
    d, n, groups = weights.size, order.size, offsets.size - 1
    intervals = h.size
    n_int = jacobian.shape[1] - n
    k = jacobian.shape[2] - n
    c, r = columns.shape[0], rows.shape[0]
    inner = n * (d - 1)
    rest = inner + 2 * n
    size = (intervals * d + 1) * n
    starts = np.empty((groups, d + 1), np.int64)  # where a group's states at a node begin
    for g in range(groups):
        first = offsets[g]
        for node in range(d + 1):
            starts[g, node] = (d - 1) * first + (node - 1) * (offsets[g + 1] - first)
        starts[g, 0], starts[g, d] = left[order[first]], right[order[first]]
    for q in range(n_int + r):
        for b in range(k + c):
            corner[q, b] = rows[q - n_int, size + b] if q >= n_int else 0.0
    for j in range(intervals):
        for g in range(groups):
            first, last = offsets[g], offsets[g + 1]
            for place in range(d * first, d * last):
                row, equation = local[j, place], equations[place]
                i, a = equation // n, equation % n
                point, target, source = jacobian[j * d + i, a], row.ctypes.data, jacobian[j * d + i, a].ctypes.data
                if place >= d * first + (d - 1) * (last - first):  # a row that remains: its zeros are looked at, too
                    for b in range(inner, rest):
                        row[b] = 0.0
                for f in range(g + 1):
                    low, number = offsets[f], offsets[f + 1] - offsets[f]
                    if follows[f * groups + g] == 1:
                        for node in range(d + 1):
                            scale_into(target + 8 * starts[f, node], -h[j] * value[i, node], source + 8 * low, number)
                    else:
                        for b in range(number):
                            row[starts[f, 0] + b] = row[starts[f, d] + b] = 0.0
                if follows[g * groups + g] == 0:
                    for node in range(1, d):
                        for b in range(last - first):
                            row[starts[g, node] + b] = 0.0
                own = (place - d * first) % (last - first)
                for node in range(d + 1):
                    row[starts[g, node] + own] += slope[i, node]
                for b in range(k):
                    row[rest + b] = -h[j] * point[n + b]
                for b in range(c):
                    row[rest + k + b] = columns[b, j * d * n + equation]
        for q in range(n_int):
            for b in range(border.shape[2]):
                border[j, q, b] = 0.0
            for i in range(d):
                point, share = jacobian[j * d + i, n + q], weights[i] * h[j]
                for node in range(d + 1):
                    for g in range(groups):
                        first = starts[g, node]
                        for b in range(offsets[g + 1] - offsets[g]):
                            border[j, q, first + b] += share * value[i, node] * point[offsets[g] + b]
                for b in range(k):
                    corner[q, b] += share * point[n + b]
        for q in range(r):
            target, source = border[j, n_int + q], rows[q, j * d * n :]
            for b in range(inner):
                target[b] = source[inside[b]]
            for b in range(2 * n):
                at_end = ends[b] >= n * d
                target[inner + b] = source[ends[b]] if not at_end or j == intervals - 1 else 0.0
            for b in range(k + c):
                target[rest + b] = 0.0
    conditions = start.shape[0]
    for q in range(conditions):
        for b in range(n):
            start[q, b], end[q, b] = at_ends[0, q, b], at_ends[0, q, n + b]
        for b in range(k):
            end[q, n + b] = at_ends[0, q, 2 * n + b]
        for b in range(c):
            end[q, n + k + b] = columns[b, intervals * d * n + q]
    for b in range(c):
        for q in range(n_int):
            corner[q, k + b] = columns[b, intervals * d * n + conditions + q]


class Collocation(System):
    """A problem discretized on a mesh: what the continuation loop works on.

    A vector ``x`` of unknowns, shape (size,), holds the states at the mesh's nodes in order, (N d + 1, n) flattened,
    then the free parameters. A residual, shape (size - 1,) on a curve, holds collocation (scaled by h), boundary and
    integral conditions.

    Parameters
    ----------
    problem : BoundaryValueProblem
    mesh : ndarray, shape (N + 1,)
        Mesh points, increasing, from one end of the domain to the other.
    degree : int
        Polynomial degree d, 2 to 8 (AUTO's NCOL; N is its NTST).
    free : sequence of str
        The free parameters.
    parameters : mapping of str to float
        Values of all parameters; those of the free ones are ignored.

    Raises
    ------
    ProblemError
        An unknown parameter, a bad mesh or degree.
    """

    problem: BoundaryValueProblem

    def __init__(
        self,
        problem: BoundaryValueProblem,
        mesh: Sequence[float] | Array,
        degree: int,
        free: Sequence[str],
        parameters: Mapping[str, float],
    ) -> None:
        super().__init__(problem, free, parameters)
        self.degree = degree
        self.basis = basis(degree)
        self.mesh = np.array(mesh, dtype=float)
        self._h = np.diff(self.mesh)
        a, b = problem.domain
        if self.mesh.ndim != 1 or self.mesh.size < 2 or not np.all(self._h > 0) or self.mesh[0] != a or self.mesh[-1] != b:
            raise ProblemError(f"mesh: must increase from {a} to {b}, with at least one interval")
        self._n, self._d, self.intervals = len(problem.state_names), degree, self._h.size
        self._times = (self.mesh[:-1, None] + self._h[:, None] * self.basis.points).ravel()
        self._h_points = np.repeat(self._h, degree)[:, None]
        self._quadrature = np.tile(self.basis.weights, self.intervals) * self._h_points[:, 0]
        self._by_interval = degree * np.arange(self.intervals)[:, None] + np.arange(degree + 1)
        self.state_size = (self.intervals * degree + 1) * self._n
        self.size = self.state_size + len(self.free)
        self.equations = self.intervals * degree * self._n + problem.boundary_size + problem.integral_size
        node_weights = np.zeros(self.intervals * degree + 1)
        shares = (self._h[:, None] * self.basis.node_weights) / (b - a)
        for node in range(degree + 1):
            node_weights[node : node + self.intervals * degree : degree] += shares[:, node]
        #: Weights of the inner product: the mean over the domain of u.v, plus p.q of the free parameters.
        self.weights = np.concatenate([np.repeat(node_weights, self._n), np.ones(len(self.free))])

    @functools.cached_property
    def _layout(self) -> Layout:
        return self.problem.layout(self.degree)

    @functools.cached_property
    def _seeds(self) -> tuple[Seeds, Seeds]:
        return self.problem.seeds(self._free, self._layout.order)

    # --- vectors of unknowns -------------------------------------------------------------------------------------

    @property
    def nodes(self) -> Array:
        """All nodes, shape (N d + 1,)."""
        inner = (self.mesh[:-1, None] + self._h[:, None] * self.basis.nodes[:-1]).ravel()
        return np.append(inner, self.mesh[-1])

    def states(self, x: Array) -> Array:
        """States at the nodes, a view of shape (N d + 1, n)."""
        return x[: self.state_size].reshape(-1, self._n)

    def _local(self, states: Array) -> Array:
        """States by interval, shape (N, d + 1, n)."""
        local: Array = states[self._by_interval]
        return local

    def at_gauss_points(self, x: Array) -> Array:
        """States at the Gauss points, shape (N d, n)."""
        points = np.empty((self._times.size, self._n))
        at_points(self.basis.value, x, points)
        return points

    def evaluate(self, x: Array, times: Array) -> Array:
        """States at ``times`` (m,), shape (m, n), by the piecewise polynomial."""
        j = np.clip(np.searchsorted(self.mesh, times, side="right") - 1, 0, self.intervals - 1)
        matrix = interpolation(self.basis.nodes, self.basis.barycentric, (times - self.mesh[j]) / self._h[j])
        states: Array = np.einsum("ij,ijk->ik", matrix, self._local(self.states(x))[j])
        return states

    # --- the discrete equations ----------------------------------------------------------------------------------

    def _residual(self, x: Array, field: Array, boundary: Array) -> Array:
        residual = np.empty(self.equations)
        collocate(self._n, self.basis.slope, self.basis.weights, self._h, x, field, boundary, residual)
        return residual

    def residual(self, x: Array) -> Array:
        """Residual of the discrete equations at x, shape (equations,)."""
        p, u = self.all_parameters(x), self.states(x)
        field = self.problem.batch("field").values(self._times, self.at_gauss_points(x), _NONE(self._n), p)
        boundary = self.problem.batch("boundary").values(_TIME, u[:1], u[-1:], p)
        return self._residual(x, field, boundary)

    def _blocks(
        self, x: Array, rows: Array, columns: Array, new: Callable[[tuple[int, ...]], Array] = np.empty
    ) -> tuple[Array, tuple[Array, Array, Array, Array, Array]]:
        """Residual at x, and the blocks of [[F_x, columns^T], [rows]] as `Factorization` takes them."""
        problem, n, d, k = self.problem, self._n, self._d, len(self.free)
        p, u = self.all_parameters(x), self.states(x)
        points = self.at_gauss_points(x)
        of_field, of_boundary = self._seeds
        field, jacobian = problem.batch("field").jacobian(self._times, points, _NONE(n), p, of_field)
        boundary, ends = problem.batch("boundary").jacobian(_TIME, u[:1], u[-1:], p, of_boundary)
        c, r = len(columns), len(rows) + problem.integral_size
        conditions, width = problem.boundary_size, n * (d + 1) + k + c
        blocks = (
            new((self.intervals, n * d, width)), np.empty((self.intervals, r, width)), np.empty((r, k + c)),
            np.empty((conditions, n)), np.empty((conditions, n + k + c)),
        )  # fmt: skip
        tables = (self.basis.value, self.basis.slope, self.basis.weights)
        assemble(tuple(self._layout), *tables, self._h, jacobian, ends, columns, rows, *blocks)
        return self._residual(x, field, boundary), blocks

    def linearize(
        self, x: Array, rows: Sequence[Array] | Array = (), columns: Sequence[Array] | Array = ()
    ) -> tuple[Array, Factors]:
        """Residual at x, and the factored matrix [[F_x, columns^T], [rows]].

        ``rows`` (r, size + c) and ``columns`` (c, equations) make it square: size + c = equations + r. Equations of
        the result are ordered [residual | rows], unknowns [x | multipliers of the columns].
        """
        rows = np.array(rows, dtype=float).reshape(-1, self.size + len(columns))
        columns = np.array(columns, dtype=float).reshape(-1, self.equations)
        residual, blocks = self._blocks(x, rows, columns)
        return residual, Factorization(self._layout, *blocks)

    def parameter_columns(self, x: Array, names: Sequence[str]) -> Array:
        """Derivatives of the residual by any parameters, free or not, shape (equations, len(names))."""
        n, p, u = self._n, self.all_parameters(x), self.states(x)
        of_field, of_boundary = self.problem.seeds(self._indices(names), self._layout.order)
        field = self.problem.batch("field").jacobian(self._times, self.at_gauss_points(x), _NONE(n), p, of_field)[1][:, :, n:]
        ends = self.problem.batch("boundary").jacobian(_TIME, u[:1], u[-1:], p, of_boundary)[1][0, :, 2 * n :]
        collocation = -(self._h_points[:, :, None] * field[:, :n]).reshape(-1, len(names))
        return np.concatenate([collocation, ends, np.einsum("p,pqk->qk", self._quadrature, field[:, n:])])

    def transposed_product(self, x: Array, w: Array) -> Array:
        """F_x^T w, shape (size,), for w (equations,)."""
        n = self._n
        _, (local, border, corner, first, last) = self._blocks(
            x, np.empty((0, self.size)), np.empty((0, self.equations)), np.zeros
        )
        layout, collocation = self._layout, self.intervals * self._d * n
        conditions, inner = collocation + len(first), n * (self._d - 1)
        by_interval = w[:collocation].reshape(self.intervals, -1)[:, layout.rows]
        inside = np.einsum("jr,jrc->jc", by_interval, local)
        inside[:, : inner + 2 * n] += np.einsum("q,jqc->jc", w[conditions:], border[:, :, : inner + 2 * n])
        result = np.zeros(self.size)
        at = self._d * n * np.arange(self.intervals)[:, None]
        np.add.at(result, at + layout.inside, inside[:, :inner])
        np.add.at(result, at + layout.ends, inside[:, inner : inner + 2 * n])
        result[:n] += first.T @ w[collocation:conditions]
        result[self.state_size - n :] += last.T @ w[collocation:conditions]
        result[self.state_size :] += inside[:, inner + 2 * n :].sum(axis=0) + corner.T @ w[conditions:]
        return result

    def monitors(self) -> list[Monitor]:
        """Events of this kind of problem beyond folds and branch points: none."""
        return []

    def functionals(self, x: Array) -> Array:
        """Values of the problem's functionals, in their order, by the same quadrature."""
        if not self.problem.functionals:
            return np.empty(0)
        batch = self.problem.batch("functionals")
        values = batch.values(self._times, self.at_gauss_points(x), _NONE(self._n), self.all_parameters(x))
        integrals: Array = self._quadrature @ values
        return integrals

    # --- meshes --------------------------------------------------------------------------------------------------

    def carrier(self, other: Discretization) -> Carrier:
        """The function that carries vectors of unknowns from this mesh to the mesh of another system."""
        nodes = other.nodes
        return lambda x: np.concatenate([self.evaluate(x, nodes).ravel(), x[self.state_size :]])

    def on_mesh(self, mesh: Array) -> tuple[Collocation, Carrier]:
        """The same problem on another mesh, and the function that carries vectors of unknowns over to it."""
        values = dict(zip(self.problem.parameters, self.parameters))
        other = Collocation(self.problem, mesh, self.degree, self.free, values)
        return other, self.carrier(other)

    def refined(self) -> tuple[Collocation, Carrier]:
        """The same problem with every interval halved, and the carrier."""
        return self.on_mesh(np.sort(np.append(self.mesh, (self.mesh[1:] + self.mesh[:-1]) / 2)))

    def adapted(self, x: Array, control: MeshControl) -> tuple[Collocation, Carrier] | None:
        """The same problem on a better mesh for x, and the carrier; None where this mesh is good enough."""
        mesh = adapted_mesh(self, x, control) if control.every else None
        return None if mesh is None else self.on_mesh(mesh)

    def with_parameters(self, values: Mapping[str, float]) -> Collocation:
        """The same problem with other values of parameters that are not free."""
        names = dict(zip(self.problem.parameters, self.parameters)) | dict(values)
        return Collocation(self.problem, self.mesh, self.degree, self.free, names)

    def with_free(self, free: Sequence[str], x: Array) -> tuple[Collocation, Array]:
        """The same problem with other free parameters (values from x), on the same mesh, and x for it."""
        values = dict(zip(self.problem.parameters, self.all_parameters(x)))
        other = Collocation(self.problem, self.mesh, self.degree, free, values)
        return other, other.pack(self.states(x), values)


_TIME = np.zeros(1)


@functools.cache
def _NONE(n: int) -> Array:
    """The absent second state of a function of one point."""
    return np.empty((0, n))
