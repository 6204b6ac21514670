"""Orthogonal collocation at Gauss points on a mesh: the discrete problem, its residual and its Jacobian.

On each of N intervals the solution is a polynomial of degree d through d + 1 Lobatto nodes (the end nodes shared), and
satisfies the equation at the d Gauss points: error O(h^(2 d)) at the mesh points (superconvergence, de Boor & Swartz
1973). Integrals use the same Gauss points, so they converge as fast.
"""

from __future__ import annotations

import functools
import threading
from collections.abc import Callable, Mapping, Sequence
from typing import Any, Self

import numpy as np

from contin.arrays import Array, Indices
from contin.collocation.assembly import Bordering, Tables, assemble, at_points, collocate, fill_phase_row
from contin.collocation.basis import basis, interpolation
from contin.collocation.defect import Defect
from contin.collocation.mesh import MeshControl, adapted_mesh, moved_to_breaks, near, with_breaks
from contin.collocation.switching import NOWHERE, Switching, joined, switching
from contin.collocation.workspace import Workspace, workspace
from contin.core.protocol import Carrier, Discretization
from contin.core.scales import Scales, usual
from contin.core.system import System
from contin.core.trial import Event
from contin.errors import ProblemError
from contin.events.arc import SpecialPoint
from contin.events.index import Stability
from contin.functions.batch import Batch, Columns, Selections
from contin.linalg.condensation import Factorization
from contin.linalg.factors import Factors
from contin.linalg.layout import Blocks, Layout, layout
from contin.linalg.segments import run, share


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

    Examples
    --------
    >>> from contin import BoundaryValueProblem
    >>> heat = BoundaryValueProblem(lambda t, u, p: (u.v, -p.q), lambda a, b, p: (a.u, b.u), ["u", "v"], {"q": 8.0})
    >>> system = Collocation(heat, [0.0, 0.5, 1.0], 4, ["q"], {})
    >>> system.size, system.nodes.tolist()[::4]  # two states at nine nodes, and q
    (19, [0.0, 0.5, 1.0])
    """

    problem: Any
    plain = True
    #: Multipliers in a kernel, of cycles.
    monodromy: Any = None

    def __init__(
        self,
        problem: Any,
        mesh: Sequence[float] | Array,
        degree: int,
        free: Sequence[str],
        parameters: Mapping[str, float],
        scales: Scales | None = None,
    ) -> None:
        super().__init__(problem, free, parameters, scales)
        self.degree = self._d = degree
        self.basis = basis(degree)
        self._n = len(problem.state_names)
        self._take_mesh(np.array(mesh, dtype=float))

    def _take_mesh(self, mesh: Array) -> None:
        """Set all that depends on the mesh, and forget what was computed on another one."""
        for name in _ON_A_MESH:
            vars(self).pop(name, None)
        problem, degree, h = self.problem, self.degree, mesh[1:] - mesh[:-1]
        a, b = problem.domain
        if mesh.ndim != 1 or mesh.size < 2 or not np.all(h > 0) or mesh[0] != a or mesh[-1] != b:
            raise ProblemError(f"mesh: must increase from {a} to {b}, with at least one interval")
        self.mesh, self._h, self.intervals = mesh, h, h.size
        self._times = (mesh[:-1, None] + h[:, None] * self.basis.points).ravel()
        self._h_points = np.repeat(h, degree)[:, None]
        self._quadrature = (h[:, None] * self.basis.weights).ravel()
        self._by_interval = degree * np.arange(self.intervals)[:, None] + np.arange(degree + 1)
        self.state_size = (self.intervals * degree + 1) * self._n
        self.size = self.state_size + len(self.free)
        self._conditions = self.intervals * degree * self._n + problem.boundary_size + problem.integral_size
        self.equations = self._conditions
        node_weights = np.zeros(self.intervals * degree + 1)
        shares = (h[:, None] * self.basis.node_weights) / (b - a)
        for node in range(degree + 1):
            node_weights[node : node + self.intervals * degree : degree] += shares[:, node]
        #: Weights of the inner product: the mean over the domain of u.v, plus p.q of the free parameters.
        self.weights = np.concatenate([np.repeat(node_weights, self._n), np.ones(len(self.free))])

    @functools.cached_property
    def _layout(self) -> Layout:
        n = self._n
        return layout(self.problem.batch("field").depends[:n, :n], self.degree)

    @functools.cached_property
    def _columns(self) -> tuple[Columns, Columns]:
        return self._columns_for(self._free)

    @functools.cached_property
    def _field(self) -> Any:
        """Right-hand side and integrands, compiled."""
        return self._batch("field", ("states", "integrals"))

    @functools.cached_property
    def _boundary(self) -> Any:
        """Boundary conditions, compiled."""
        return self._batch("boundary", ("boundary",))

    def _columns_for(self, parameters: Indices) -> tuple[Columns, Columns]:
        """Columns of field, by states in the layout's order, and of boundary; each by these parameters, too."""
        problem = self.problem
        return problem.batch("field").columns(parameters, self._layout.order), problem.batch("boundary").columns(parameters)

    @property
    def _rows(self) -> tuple[tuple[str, int], ...]:
        """Those of boundary and integral conditions."""
        return ("boundary", self.problem.boundary_size), ("integrals", self.problem.integral_size)

    # --- vectors of unknowns -------------------------------------------------------------------------------------

    @property
    def nodes(self) -> Array:
        """Values of t at all nodes, shape (N d + 1,)."""
        inner = (self.mesh[:-1, None] + self._h[:, None] * self.basis.nodes[:-1]).ravel()
        return np.append(inner, self.mesh[-1])

    @property
    def gauss_times(self) -> Array:
        """Values of t at all Gauss points, shape (N d,)."""
        return self._times

    @property
    def gauss_weights(self) -> Array:
        """Weights of the quadrature at the Gauss points, shape (N d,)."""
        weights: Array = self._quadrature
        return weights

    def states(self, x: Array) -> Array:
        """Return the states at the nodes, shape (N d + 1, n)."""
        states = self._scaled_states(x)
        return states * self.scales.states

    def _scaled_states(self, x: Array) -> Array:
        """Return the states divided by their sizes, a view of x."""
        return x[: self.state_size].reshape(-1, self._n)

    def _local(self, states: Array) -> Array:
        """Return the states by interval, shape (N, d + 1, n)."""
        local: Array = states[self._by_interval]
        return local

    def at_gauss_points(self, x: Array) -> Array:
        """Return the states divided by their sizes at the Gauss points, shape (N d, n)."""
        points = np.empty((self._times.size, self._n))
        at_points(self.basis.value, np.ascontiguousarray(x), points)
        return points

    def states_at_gauss_points(self, x: Array) -> Array:
        """Return the states at the Gauss points in the user's units, shape (N d, n)."""
        points = self.at_gauss_points(x)
        return points * self.scales.states

    def evaluate(self, x: Array, times: Array) -> Array:
        """Return the states at ``times`` (m,), shape (m, n), by the piecewise polynomial."""
        states = self._interpolated(x, times)
        return states * self.scales.states

    def _interpolated(self, x: Array, times: Array) -> Array:
        """Return the piecewise polynomial of the values in x."""
        return self._interpolator(times)(x)

    def _interpolator(self, times: Array) -> Carrier:
        """Return the function that evaluates the piecewise polynomial of values at times in the domain."""
        j = np.minimum(np.maximum(np.searchsorted(self.mesh, times, side="right") - 1, 0), self.intervals - 1)
        matrix = interpolation(self.basis.nodes, self.basis.barycentric, (times - self.mesh[j]) / self._h[j])
        places = self._by_interval[j]
        return lambda x: np.einsum("ij,ijk->ik", matrix, self._scaled_states(x)[places])

    def evaluate_scaled_in(self, x: Array, interval: int, places: Array) -> Array:
        """Return the states divided by their sizes at ``places`` (K,) of an interval, between 0 and 1, shape (K, n)."""
        first = interval * self._d
        matrix = interpolation(self.basis.nodes, self.basis.barycentric, places)
        states: Array = matrix @ self._scaled_states(x)[first : first + self._d + 1]
        return states

    # --- the discretization error --------------------------------------------------------------------------------

    @functools.cached_property
    def defect(self) -> Defect:
        """What the estimates of errors on this mesh share."""
        return Defect(self)

    def discretization_error(self, x: Array, factors: Factors, columns: Mapping[str, float]) -> float:
        """Return the estimated error of a solution that is due to the mesh, relative to 1 + size; see `Defect`."""
        return self.defect.error(x, factors, columns)

    def newton_error(self, x: Array, factors: Factors) -> float:
        """Return what Newton's method or round-off has left, measured in the same way."""
        return self.defect.left_by_newton(x, self.residual(x), factors)

    @property
    def states_count(self) -> int:
        """Number of states, n."""
        return self._n

    @property
    def order_of_states(self) -> Indices:
        """The states in the order of the columns of a linearized system, shape (n,)."""
        return self._layout.order

    @property
    def integrated(self) -> tuple[str, ...]:
        """Names of the functionals that are integrals."""
        return self._integrated

    def scaled_parameters(self, x: Array) -> Array:
        """Return all parameters divided by their sizes."""
        return self._scaled_parameters(x)

    def field_values(self, times: Array, points: Array, p: Array) -> Array:
        """Return right-hand side and integrands of conditions, shape (K, n + their number).

        ``points`` (K, n) are states at ``times`` (K,), ``p`` all parameters; all are divided by their sizes, as are the values.
        """
        values: Array = self._field.values(times, points, _NONE(self._n), p)
        return values

    def integrands(self, x: Array, times: Array, points: Array) -> Array:
        """Return the integrands of the functionals, with the parameters of x, for states (K, n) divided by their sizes."""
        batch = self.problem.batch("functionals")
        values: Array = batch.values(times, points * self.scales.states, _NONE(self._n), self.all_parameters(x))
        return values

    # --- the discrete equations ----------------------------------------------------------------------------------

    def _residual(self, x: Array, field: Array, boundary: Array) -> Array:
        residual = np.empty(self._conditions)
        collocate(self._n, self.basis.slope, self.basis.weights, self._h, x, field, boundary, residual)
        return residual

    def residual(self, x: Array) -> Array:
        """Return the residual of the discrete equations at x, shape (equations,)."""
        p, u = self._scaled_parameters(x), self._scaled_states(x)
        field = self._field.values(self._times, self.at_gauss_points(x), _NONE(self._n), p)
        boundary = self._boundary.values(_TIME, u[:1], u[-1:], p)
        return self._residual(x, field, boundary)

    def _blocks(
        self, x: Array, rows: Array, columns: Array, new: Callable[[tuple[int, ...]], Array] = np.empty
    ) -> tuple[Array, Blocks]:
        """Residual at x, and the blocks of [[F_x, columns^T], [rows]] as `Factorization` takes them."""
        n, p, u = self._n, self._scaled_parameters(x), self._scaled_states(x)
        points = self.at_gauss_points(x)
        of_field, of_boundary = self._columns
        field, jacobian = self._field.jacobian(self._times, points, _NONE(n), p, of_field)
        boundary, ends = self._boundary.jacobian(_TIME, u[:1], u[-1:], p, of_boundary)
        blocks = self._empty_blocks(len(rows), len(columns), new)
        tables = Tables(self.basis.value, self.basis.slope, self.basis.weights)
        given = self._layout, tables, self._h, jacobian, ends, Bordering(columns, rows), blocks
        run(assemble, given, share(self.intervals, blocks.local.size), (True, False))
        return self._residual(x, field, boundary), blocks

    def _empty_blocks(self, rows: int, columns: int, new: Callable[[tuple[int, ...]], Array] = np.empty) -> Blocks:
        """Return blocks for so many rows and columns around F_x."""
        problem, n, d, k = self.problem, self._n, self._d, len(self.free) + columns
        r, conditions, width = rows + problem.integral_size, problem.boundary_size, n * (d + 1) + k
        return Blocks(
            new((self.intervals, n * d, width)), np.empty((self.intervals, r, width)), np.empty((r, k)),
            np.empty((conditions, n)), np.empty((conditions, n + k)),
        )  # fmt: skip

    # --- in one call of a kernel ---------------------------------------------------------------------------------

    @property
    def linear_conditions(self) -> tuple[Array, Array] | None:
        """Rows (q, size) and values (q,) of conditions beyond those of the problem; None where these are not linear."""
        return np.empty((0, self.size)), np.empty(0)

    @property
    def workspace(self) -> Workspace | None:
        """The arrays in which a kernel corrects points; None where Python evaluates functions, and on very long meshes."""
        thread = threading.get_ident()
        if thread not in self._workspaces:  # kernels of two threads run side by side
            self._workspaces[thread] = self._made_workspace()
        return self._workspaces[thread]

    @functools.cached_property
    def _workspaces(self) -> dict[int, Workspace | None]:
        return {}

    def _made_workspace(self) -> Workspace | None:
        own, recorded = self.linear_conditions, all(batch.interpreted is None for batch in self._evaluated)
        if own is None or not recorded or not 0 <= self.size - self.equations <= 1:
            return None
        rows = len(own[0]) + self.size - self.equations
        numbers = self.intervals * self._d * self._n * (self._n * (self._d + 1) + len(self.free))
        return workspace(self, rows) if share(self.intervals, numbers).last == 1 else None

    def unfilled_factors(self) -> Factorization:
        """Return factors of the matrix of `workspace`, to be filled by a kernel."""
        work = self.workspace
        assert work is not None
        return Factorization.unfilled(self._layout, self._empty_blocks(len(work.values.rows), 0))

    def linearize(
        self, x: Array, rows: Sequence[Array] | Array = (), columns: Sequence[Array] | Array = ()
    ) -> tuple[Array, Factors]:
        """Return the residual at x, and the factored matrix [[F_x, columns^T], [rows]].

        ``rows`` (r, size + c) and ``columns`` (c, equations) make it square: size + c = equations + r. Equations of
        the result are ordered [residual | rows], unknowns [x | multipliers of the columns].
        """
        rows = np.array(rows, dtype=float).reshape(-1, self.size + len(columns))
        columns = np.array(columns, dtype=float).reshape(-1, self.equations)
        residual, blocks = self._blocks(x, rows, columns)
        return residual, Factorization(self._layout, blocks)

    def parameter_columns(self, x: Array, names: Sequence[str]) -> Array:
        """Return the derivatives of the residual by any parameters, free or not, shape (equations, len(names))."""
        n, p, u = self._n, self._scaled_parameters(x), self._scaled_states(x)
        of_field, of_boundary = self._columns_for(self._indices(names))
        field = self._field.jacobian(self._times, self.at_gauss_points(x), _NONE(n), p, of_field)[1][:, :, n:]
        ends = self._boundary.jacobian(_TIME, u[:1], u[-1:], p, of_boundary)[1][0, :, 2 * n :]
        collocation = -(self._h_points[:, :, None] * field[:, :n]).reshape(-1, len(names))
        return np.concatenate([collocation, ends, np.einsum("p,pqk->qk", self._quadrature, field[:, n:])])

    def transposed_product(self, x: Array, w: Array) -> Array:
        """Return F_x^T w, shape (size,), for w (equations,)."""
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

    def along(self, x: Array, directions: Sequence[Array]) -> Array:
        """Return the derivative of F along several directions, shape (equations,); the part with u' is linear."""
        n, p, u = self._n, self._scaled_parameters(x), self._scaled_states(x)
        inside = [self._wide(v, self.at_gauss_points(v)) for v in directions]
        field = self._field.along(self._times, self.at_gauss_points(x), _NONE(n), p, inside)
        ends = [self._wide(v, self._both_ends(v)) for v in directions]
        boundary = self._boundary.along(_TIME, u[:1], u[-1:], p, ends)[0]
        collocation = -(self._h_points * field[:, :n]).ravel()
        return np.concatenate([collocation, boundary, self._quadrature @ field[:, n:]])

    def bent(self, x: Array, w: Array, v: Array) -> Array:
        """Return the gradient of w.(F_x v), shape (size,): that of each function at its place, taken back to the nodes."""
        n, p, u = self._n, self._scaled_parameters(x), self._scaled_states(x)
        inner = self._times.size * n
        conditions = inner + self.problem.boundary_size
        weights = np.empty((self._times.size, n + self.problem.integral_size))
        weights[:, :n] = -self._h_points * w[:inner].reshape(-1, n)
        weights[:, n:] = self._quadrature[:, None] * w[conditions : self._conditions]
        given = self._times, self.at_gauss_points(x), _NONE(n), p, weights, self._wide(v, self.at_gauss_points(v))
        result = self._to_nodes(self._field.bent(*given, self.problem.batch("field").columns(self._free)))
        ends = self._wide(v, self._both_ends(v))
        columns = self.problem.batch("boundary").columns(self._free)
        at_ends = self._boundary.bent(_TIME, u[:1], u[-1:], p, w[None, inner:conditions], ends, columns)[0]
        result[:n] += at_ends[:n]
        result[self.state_size - n : self.state_size] += at_ends[n : 2 * n]
        result[self.state_size :] += at_ends[2 * n :]
        return result

    @property
    def _evaluated(self) -> Sequence[Batch]:
        """Right-hand side with integrands, and boundary conditions; in the user's units, too."""
        return self._field, self._boundary, self.problem.batch("field"), self.problem.batch("boundary")

    def _both_ends(self, v: Array) -> Array:
        """Return the states at both ends side by side, shape (1, 2 n)."""
        return np.concatenate([v[: self._n], v[self.state_size - self._n : self.state_size]])[None]

    def _to_nodes(self, slopes: Array) -> Array:
        """Return derivatives by x, shape (size,), from those by states and free parameters at Gauss points, (N d, n + k)."""
        by_points = slopes[:, : self._n].reshape(self.intervals, self._d, self._n)
        by_node = np.zeros((self.nodes.size, self._n))
        np.add.at(by_node, self._by_interval, np.einsum("qm,jqa->jma", self.basis.value, by_points))
        return np.append(by_node.ravel(), slopes[:, self._n :].sum(axis=0))

    def functionals(self, x: Array) -> Array:
        """Return the values of the problem's functionals, in their order, by the same quadrature."""
        if not self.problem.functionals:
            return np.empty(0)
        batch = self.problem.batch("functionals")
        values = batch.values(self._times, self.states_at_gauss_points(x), _NONE(self._n), self.all_parameters(x))
        integrals: Array = self._quadrature @ values
        return integrals

    @property
    def _integrated(self) -> tuple[str, ...]:
        """Names of the functionals that are integrals, in the order of the compiled functions."""
        return tuple(self.problem.functionals)

    def column_gradient(self, x: Array, name: str) -> Array | None:
        """Return the derivatives of a parameter or functional by x, shape (size,); None where they are not known."""
        if name not in self._integrated:
            return super().column_gradient(x, name)
        batch, at = self._functional_derivatives, self._integrated.index(name)
        given = self._times, self.at_gauss_points(x), _NONE(self._n), self._scaled_parameters(x)
        slopes = self._quadrature[:, None] * batch.jacobian(*given, batch.columns(self._free))[1][:, at]
        return self._to_nodes(slopes)

    def column_bent(self, x: Array, name: str, v: Array) -> Array:
        """Return the derivative of `column_gradient` along v, shape (size,), of a column where that is known."""
        if name not in self._integrated:
            return super().column_bent(x, name, v)
        batch = self._functional_derivatives
        weights = np.zeros((self._times.size, len(self._integrated)))
        weights[:, self._integrated.index(name)] = self._quadrature
        given = self._times, self.at_gauss_points(x), _NONE(self._n), self._scaled_parameters(x)
        slopes = batch.bent(*given, weights, self._wide(v, self.at_gauss_points(v)), batch.columns(self._free))
        return self._to_nodes(slopes)

    @functools.cached_property
    def _functional_derivatives(self) -> Any:
        """Functionals, with scaled inputs."""
        return self._batch("functionals")

    # --- meshes --------------------------------------------------------------------------------------------------

    def carrier(self, other: Discretization) -> Carrier:
        """Return the function that carries vectors of unknowns from this mesh to the mesh of another system."""
        states = self._interpolator(other.nodes)
        return self._between_scales(lambda x: np.concatenate([states(x).ravel(), x[self.state_size :]]), other)

    def with_scales(self, x: Array, states: Array, parameters: Array) -> tuple[Collocation, Array]:
        """Return the same problem with these sizes of states and parameters, sizes of rows found at x, and x for it."""
        rows = {"boundary": np.ones(self.problem.boundary_size), "integrals": np.ones(self.problem.integral_size)}
        scaled = self._with(scales=Scales(states, parameters, rows))
        z = self.carrier(scaled)(x)
        rows["boundary"], rows["integrals"] = scaled._row_sizes(z)
        other = self._with(scales=Scales(states, parameters, rows))
        return other, z

    def _row_sizes(self, x: Array) -> tuple[Array, Array]:
        """Return the largest entries of the rows of boundary and integral conditions, as powers of two."""
        n, p, u = self._n, self._scaled_parameters(x), self._scaled_states(x)
        of_field, of_boundary = self._columns
        ends = self._boundary.jacobian(_TIME, u[:1], u[-1:], p, of_boundary)[1][0]
        field = self._field.jacobian(self._times, self.at_gauss_points(x), _NONE(n), p, of_field)[1][:, n:]
        return usual(np.abs(ends).max(axis=1, initial=0.0)), usual(np.abs(field).max(axis=(0, 2), initial=0.0))

    def without_scales(self, x: Array) -> tuple[Collocation, Array]:
        """Return the same problem in the user's units, and x for it."""
        other = self._with(scales=None)
        return other, self.carrier(other)(x)

    def _with(self, **changes: Any) -> Collocation:
        """Return the same with other free parameters, parameters or scales."""
        values = dict(zip(self.problem.parameters, self.parameters))
        kept = {"free": self.free, "parameters": values, "scales": self.scales}
        return type(self)(self.problem, self.mesh, self.degree, **{**kept, **changes})

    def _copied(self, without: Sequence[str] = ()) -> Self:
        """Return a copy with all that was computed, which ``copy.copy`` leaves out, but for what is to change."""
        other = object.__new__(type(self))
        vars(other).update({name: value for name, value in vars(self).items() if name not in without})
        return other

    def on_mesh(self, mesh: Sequence[float] | Array) -> tuple[Self, Carrier]:
        """Return the same problem on another mesh, and the function that carries vectors of unknowns over to it."""
        other = self._copied()
        other._take_mesh(np.array(mesh, dtype=float))
        return other, self.carrier(other)

    def refined(self) -> tuple[Collocation, Carrier]:
        """Return the same problem with every interval halved, and the carrier."""
        return self.on_mesh(np.sort(np.append(self.mesh, (self.mesh[1:] + self.mesh[:-1]) / 2)))

    def phase_row(self, reference: Array) -> Array:
        """Return the row of the integral of u . v' over that of v' . v', shape (size,), for scaled states v at the nodes.

        The integrals are taken at the Gauss points, with v' of the piecewise polynomial v; zero where v is constant.
        """
        row = np.zeros(self.size)
        tables = Tables(self.basis.value, self.basis.slope, self.basis.weights)
        size = fill_phase_row(self._n, tables, self._h, np.ascontiguousarray(reference).ravel(), row)
        row /= size or 1.0
        return row

    def with_reference(self, x: Array) -> Self:
        """Return the same with x as the orbit that a phase condition refers to, where a kind of problem has one."""
        return self

    def adapted(self, x: Array, control: MeshControl) -> tuple[Collocation, Carrier] | None:
        """Return the same problem on a better mesh for x, and the carrier; None where this mesh is good enough."""
        mesh = self._better_mesh(x, control)
        return None if mesh is None else self.on_mesh(mesh)

    def _better_mesh(self, x: Array, control: MeshControl) -> Array | None:
        if not control.every:
            return None
        return adapted_mesh(self.basis, self.mesh, self._scaled_states(x), control, self._all_breaks(x, closely=False))

    @functools.cached_property
    def breaks(self) -> Array:
        """Places where the equations have jumps or corners in t, whatever the states are: points of a good mesh."""
        names = ["field", *(["functionals"] if self._integrated else [])]
        found = [self.problem.batch(name).switches(*self.problem.domain, self.parameters, self._free) for name in names]
        return np.unique(np.concatenate(found))

    def switching(self, x: Array) -> Switching:
        """Return where conditions on states or free parameters switch along a solution, and the equations are not smooth."""
        if not self._selections:
            return NOWHERE
        if not any(np.array_equal(x, known) for known, _ in self._switchings):
            parts = [switching(self, each, functools.partial(self._sizes_of, name, x), x) for name, each in self._selections]
            found = joined(parts)
            self._switchings[:] = [(x.copy(), found)]
        return self._switchings[0][1]

    @functools.cached_property
    def _switchings(self) -> list[tuple[Array, Switching]]:
        """The solution that was looked at last, and where conditions switch along it: a point is asked for several times."""
        return []

    def bends(self, x: Array) -> Array | None:
        """Return by how much the second derivatives of the states jump at the inner mesh points, relative to the largest ones.

        Where a solution is smooth these errors fall with the intervals; at a corner or jump of the equations they do not. None
        where all conditions are known (`switching`): such errors tell of those in functions that are evaluated in Python only.
        """
        if self.problem.batch("field").interpreted is None or self.intervals < 2:
            return None
        matrix, local = self.basis.bends / self._h[:, None, None] ** 2, self._local(self._scaled_states(x))
        first, last = (np.einsum("jl,jla->ja", matrix[:, end], local) for end in (0, 1))
        least = (1 + self.largest(x)[: self._n]) / (self.mesh[-1] - self.mesh[0]) ** 2  # a trivial branch is round-off
        sizes = np.maximum(np.maximum(np.abs(first).max(axis=0), np.abs(last).max(axis=0)), least)
        found: Array = (np.abs(first[1:] - last[:-1]) / sizes).max(axis=1)
        return found

    def on_switches(self, x: Array, closely: bool = False) -> tuple[Collocation, Carrier] | None:
        """Return the same on a mesh with the places of `switching` among its points; None where they are already.

        ``closely``: up to round-off, as what depends on the place itself needs. A solution depends on its square only.
        """
        breaks = self._all_breaks(x, closely)
        if not breaks.size or near(breaks, self.mesh, self.mesh[-1] - self.mesh[0]).all():
            return None
        return self.on_mesh(moved_to_breaks(self.mesh, breaks))

    def _all_breaks(self, x: Array, closely: bool) -> Array:
        """Return the places where the equations are not smooth; those on mesh points, as far as it matters, are these."""
        moving = self.switching(x)
        if not moving.places.size:
            return self.breaks
        nearest = self.mesh[np.abs(self.mesh - moving.places[:, None]).argmin(axis=1)]
        off = np.abs(nearest - moving.places) > _CLOSE * (self.mesh[-1] - self.mesh[0])
        places = np.where(off if closely else ~moving.settled, moving.places, nearest)
        return np.unique(np.concatenate([self.breaks, places]))

    @property
    def has_selections(self) -> bool:
        """Conditions on states or free parameters switch the equations."""
        return bool(self._selections)

    @functools.cached_property
    def _selections(self) -> list[tuple[str, Selections]]:
        """Conditions of the functions that the mesh matters for, by the name of these."""
        names = ["field", *(["functionals"] if self._integrated else [])]
        found = [(name, self.problem.batch(name).selections(self._free)) for name in names]
        return [(name, each) for name, each in found if each is not None]

    def _sizes_of(self, name: str, x: Array) -> Array:
        """Return the sizes of what the values of a function are integrated to."""
        sizes = self.largest(x)[: self._n] + 1
        with np.errstate(all="ignore"):
            given = self._times, self.states_at_gauss_points(x), _NONE(self._n), self.all_parameters(x)
            values = np.abs(self.problem.batch(name).values(*given)).max(axis=0)
        largest: Array = (self.mesh[-1] - self.mesh[0]) * np.nan_to_num(values)
        largest[largest == 0] = 1.0
        if name == "field":
            largest[: self._n] = sizes * self.scales.states
        return largest

    def on_breaks(self) -> Collocation:
        """Return the same problem on a mesh of as many intervals, with the breaks among its points."""
        return self.on_mesh(with_breaks(self.mesh, self.breaks))[0] if len(self.breaks) else self

    def with_parameters(self, values: Mapping[str, float]) -> Collocation:
        """Return the same problem with other values of parameters that are not free."""
        names = dict(zip(self.problem.parameters, self.parameters)) | dict(values)
        return self._with(parameters=names)

    def with_free(self, free: Sequence[str], x: Array) -> tuple[Collocation, Array]:
        """Return the same problem with other free parameters (values from x), on the same mesh, and x for it."""
        values = dict(zip(self.problem.parameters, self.all_parameters(x)))
        other = self._with(free=free, parameters=values)
        return other, other.pack(self.states(x), values)

    # --- what the kind knows of its branches --------------------------------------------------------------------------

    def events(self) -> list[Event]:
        """Return those of the statement."""
        found: list[Event] = self.problem.events()
        return found

    @property
    def is_function_of_t(self) -> bool:
        """Yes."""
        return True

    @property
    def stored(self) -> dict[str, Array]:
        """Mesh, parameters and sizes."""
        return {"mesh": self.mesh, **self._own_arrays}

    def referring_to(self, x: Array, tangent: Array) -> Collocation:
        """Return the same with a solution as the reference, where the kind has one."""
        return self.with_reference(x)

    def stability(self, point: SpecialPoint) -> Stability:
        """Return what the statement says."""
        found: Stability = self.problem.stability(point)
        return found

    def degenerate(self, x: Array) -> str:
        """Return what the statement says."""
        found: str = self.problem.degenerate(self, x)
        return found

    def undetermined(self, x: Array) -> str:
        """Return what the statement says."""
        found: str = self.problem.undetermined(self, x)
        return found

    @property
    def index(self) -> Event | None:
        """That of the statement."""
        found: Event | None = self.problem.index
        return found


#: Distance of a switch from a mesh point, as a part of the domain, up to which it lies there. Special points are off by about
#: that: ten times smaller is round-off of the place itself.
_CLOSE = 1e-12
#: What is computed when it is first asked for, and depends on the mesh.
_ON_A_MESH = ("defect", "_workspaces", "_switchings", "_monodromies")
#: The t of boundary conditions, which do not take it.
_TIME = np.zeros(1)


@functools.cache
def _NONE(n: int) -> Array:
    """Return the absent second state of a function of one point."""
    return np.empty((0, n))
