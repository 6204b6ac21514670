"""Orthogonal collocation at Gauss points on a mesh: the discrete equations, their Jacobian and higher derivatives.

The polynomials satisfy the equation at the d Gauss points of each interval: error O(h^(2 d)) at the mesh points
(superconvergence, de Boor & Swartz 1973). Integrals use the same Gauss points, so they converge as fast.
"""

from __future__ import annotations

import functools
import threading
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from contin.arrays import Array, Indices
from contin.boundary.unknowns import OnMesh
from contin.collocation.assembly import Bordering, assemble, collocate
from contin.collocation.defect import Defect
from contin.collocation.projection import Projections, projections
from contin.collocation.workspace import Values, Workspace, workspace
from contin.functions.batch import Batch, Columns
from contin.linalg.components import Around, Component, ComponentFactors, Part, components
from contin.linalg.condensation import Factorization
from contin.linalg.factors import Factors
from contin.linalg.layout import Blocks, Layout, layout
from contin.linalg.segments import Share, is_large, run, share

#: Times, states, states at the other end and parameters at which functions are evaluated.
_At = tuple[Array, Array, Array, Array]


class BoundaryEquations(OnMesh):
    """F(x) = 0 of a boundary value problem: collocation (scaled by h), boundary and integral conditions, in this order."""

    #: Multipliers in a kernel, of cycles.
    monodromy: Any = None

    @functools.cached_property
    def _layout(self) -> Layout:
        return layout(self.problem.batch("field").depends[: self._n, : self._n], self.degree)

    @property
    def order_of_states(self) -> Indices:
        """The states in the order of the columns of a linearized system, shape (n,)."""
        return self._layout.order

    @functools.cached_property
    def _columns(self) -> tuple[Columns, Columns]:
        """Columns of field, by states in the layout's order, and of boundary; each by the free parameters, too."""
        field, boundary = self.problem.batch("field"), self.problem.batch("boundary")
        return field.columns(self._free, self._layout.order), boundary.columns(self._free)

    @functools.cached_property
    def _field(self) -> Batch:
        """Right-hand side and integrands, compiled."""
        return self._batch("field", ("states", "integrals"))

    @functools.cached_property
    def _boundary(self) -> Batch:
        """Boundary conditions, compiled."""
        return self._batch("boundary", ("boundary",))

    @functools.cached_property
    def _functionals(self) -> Batch:
        """Functionals, with scaled inputs."""
        return self._batch("functionals")

    @property
    def _evaluated(self) -> Sequence[Batch]:
        """Right-hand side with integrands, and boundary conditions; in the user's units, too."""
        return self._field, self._boundary, self.problem.batch("field"), self.problem.batch("boundary")

    def _inside(self, x: Array) -> _At:
        """Return where functions of t are evaluated: at the Gauss points."""
        return self.gauss_times, self.at_gauss_points(x), _NONE(self._n), self._scaled_parameters(x)

    def _inside_unscaled(self, x: Array) -> _At:
        """Return the same in the user's units."""
        return self.gauss_times, self.states_at_gauss_points(x), _NONE(self._n), self.all_parameters(x)

    def _at_ends(self, x: Array) -> _At:
        """Return where boundary conditions are evaluated."""
        u = self._scaled_states(x)
        return _TIME, u[:1], u[-1:], self._scaled_parameters(x)

    def evaluations(self, x: Array) -> list[tuple[Batch, Array, Array, Array, Array]]:
        """Return right-hand side with integrands, and boundary conditions, in the user's units."""
        ends = _TIME, self.states(x)[:1], self.states(x)[-1:], self.all_parameters(x)
        return [(self.problem.batch("field"), *self._inside_unscaled(x)), (self.problem.batch("boundary"), *ends)]

    def _both_ends(self, v: Array) -> Array:
        """Return the states at both ends side by side, shape (1, 2 n)."""
        return np.concatenate([v[: self._n], v[self.state_size - self._n : self.state_size]])[None]

    # --- F and F_x -----------------------------------------------------------------------------------------------

    def _residual(self, x: Array, field: Array, boundary: Array) -> Array:
        residual = np.empty(self._conditions)
        collocate(self._n, self.basis.slope, self.basis.weights, self._h, x, field, boundary, residual)
        return residual

    def residual(self, x: Array) -> Array:
        """Return the residual of the discrete equations at x, shape (equations,)."""
        return self._residual(x, self._field.values(*self._inside(x)), self._boundary.values(*self._at_ends(x)))

    def _linearized(self, x: Array, rows: Array, columns: Array) -> tuple[Array, Factors]:
        """Return the residual at x, and [[F_x, columns^T], [rows]] factored."""
        if self._components:
            return self._factored_apart(x, Bordering(columns, rows))
        residual, blocks = self._assembled(x, rows, columns)
        return residual, Factorization(self._layout, blocks, self._segments(blocks.local.size))

    def _segments(self, numbers: int) -> Share:
        """Return the segments of a matrix with so many ``numbers`` in the blocks of all intervals."""
        return share(self.intervals, numbers)

    def _assembled(self, x: Array, rows: Array, columns: Array) -> tuple[Array, Blocks]:
        """Return the residual at x, and the blocks of that matrix."""
        boundary, ends = self._boundary.jacobian(*self._at_ends(x), self._columns[1])
        field, jacobian = self._field.jacobian(*self._inside(x), self._columns[0])
        blocks = self._empty_blocks(len(rows), len(columns))
        given = self._layout, self.tables, self._h, jacobian, ends, Bordering(columns, rows), blocks
        run(assemble, given, self._segments(blocks.local.size), (True, False))
        return self._residual(x, field, boundary), blocks

    def _empty_blocks(self, rows: int, columns: int) -> Blocks:
        """Return blocks for so many rows and columns around F_x."""
        problem, n, d, k = self.problem, self._n, self._d, len(self.free) + columns
        r, conditions, width = rows + problem.integral_size, problem.boundary_size, n * (d + 1) + k
        return Blocks(
            np.empty((self.intervals, n * d, width)), np.empty((self.intervals, r, width)), np.empty((r, k)),
            np.empty((conditions, n)), np.empty((conditions, n + k)),
        )  # fmt: skip

    @functools.cached_property
    def _components(self) -> list[Component]:
        """Parts of the states that meet at the ends only, where they are eliminated one by one; none where all are together."""
        if self._n < _APART:
            return []
        found = components(self.problem.batch("field").depends[: self._n, : self._n], self.degree)
        return found if len(found) > 1 else []

    @property
    def separate_states(self) -> list[Indices]:
        """The states in parts that meet at the ends only, as far as they are eliminated one by one."""
        return [component.states for component in self._components] or [np.arange(self._n)]

    def _factored_apart(self, x: Array, around: Bordering) -> tuple[Array, Factors]:
        """Return the residual at x, and the same matrix factored component by component."""
        n, (columns, rows) = self._n, around
        boundary, (at_ends,) = self._boundary.jacobian(*self._at_ends(x), self.problem.batch("boundary").columns(self._free))
        inside, of_field = self._inner, self.problem.batch("field").columns(self._free)
        field, entries = self._field.entries(*self._inside(x), of_field)
        points = columns[:, :inside].reshape(len(columns), self.gauss_times.size, n)
        parts = [self._part(component, of_field, entries, points) for component in self._components]
        integrals = np.empty((self.problem.integral_size, self.size))
        for q, row in enumerate(integrals):
            slopes = of_field.block(entries, np.array([n + q]), np.arange(of_field.width))[:, 0]
            row[:] = self._to_nodes(self.gauss_weights[:, None] * slopes)
        corner = np.concatenate([at_ends[:, 2 * n :], integrals[:, self.state_size :]])
        corner = np.vstack([np.hstack([corner, columns[:, inside:].T]), rows[:, self.state_size :]])
        states = np.concatenate([integrals[:, : self.state_size], rows[:, : self.state_size]])
        factors = ComponentFactors(parts, Around(at_ends[:, :n], at_ends[:, n : 2 * n], states, corner))
        return self._residual(x, field, boundary), factors

    def _part(self, component: Component, of_field: Columns, entries: Array, columns: Array) -> Part:
        """Return the rows of a component from the ``entries`` of the Jacobian, and ``columns`` (c, points, n) besides."""
        n, states, points, k = self._n, component.states, self.gauss_times.size, len(self.free)
        count = len(states)
        jacobian = of_field.block(entries, states, states[component.layout.order])
        places = np.unique(of_field.places[np.isin(of_field.rows, states) & (of_field.places >= n)])
        by_parameters = -self._h_points[:, :, None] * of_field.block(entries, states, places)
        slopes = np.concatenate([by_parameters, columns[:, :, states].transpose(1, 2, 0)], axis=2)
        local, none = np.empty((self.intervals, count * self._d, count * (self._d + 1))), np.empty((0, 0))
        border, ends = np.empty((self.intervals, 0, local.shape[2])), np.empty((0, count))
        around = Bordering(np.empty((0, points * count)), np.empty((0, (points + 1) * count)))
        given = component.layout, self.tables, self._h, jacobian, np.empty((1, 0, 2 * count)), around
        assemble(*given, Blocks(local, border, none, ends, ends), share(self.intervals, 0))
        return Part(component, local, slopes.reshape(points * count, -1), np.append(places - n, k + np.arange(len(columns))))

    def linearize(
        self, x: Array, rows: Sequence[Array] | Array = (), columns: Sequence[Array] | Array = ()
    ) -> tuple[Array, Factors]:
        """Return the residual at x, and the factored matrix [[F_x, columns^T], [rows]].

        ``rows`` (r, size + c) and ``columns`` (c, equations) make it square: size + c = equations + r. Equations of
        the result are ordered [residual | rows], unknowns [x | multipliers of the columns].
        """
        rows = np.array(rows, dtype=float).reshape(-1, self.size + len(columns))
        columns = np.array(columns, dtype=float).reshape(-1, self.equations)
        return self._linearized(x, rows, columns)

    def parameter_columns(self, x: Array, names: Sequence[str]) -> Array:
        """Return the derivatives of the residual by any parameters, free or not, shape (equations, len(names))."""
        n, which = self._n, self._indices(names)
        of_field, of_boundary = (self.problem.batch(name).columns(which, ()) for name in ("field", "boundary"))
        field = self._field.jacobian(*self._inside(x), of_field)[1]
        ends = self._boundary.jacobian(*self._at_ends(x), of_boundary)[1][0]
        collocation = -(self._h_points[:, :, None] * field[:, :n]).reshape(-1, len(names))
        return np.concatenate([collocation, ends, np.einsum("p,pqk->qk", self.gauss_weights, field[:, n:])])

    def transposed_product(self, x: Array, w: Array) -> Array:
        """Return F_x^T w, shape (size,), for w (equations,)."""
        of_field, of_ends = (self.problem.batch(name).columns(self._free) for name in ("field", "boundary"))
        entries, slopes = self._field.entries(*self._inside(x), of_field)[1], np.zeros((of_field.width, self.gauss_times.size))
        np.add.at(slopes, of_field.places, (self._at_points(w)[:, of_field.rows] * entries).T)
        ends = w[self._inner : self._inner + self.problem.boundary_size]
        result = self._to_nodes(slopes.T, ends @ self._boundary.jacobian(*self._at_ends(x), of_ends)[1][0])
        rates = np.einsum("qm,jqa->jma", self.basis.slope, w[: self._inner].reshape(self.intervals, self._d, self._n))
        np.add.at(result[: self.state_size].reshape(-1, self._n), self._by_interval, rates)
        return result

    @property
    def _inner(self) -> int:
        """Number of collocation conditions."""
        return self.gauss_times.size * self._n

    def _at_points(self, w: Array) -> Array:
        """Return the weights of right-hand side and integrands at the Gauss points in w.F, shape (N d, n + n_int)."""
        n = self._n
        weights = np.empty((self.gauss_times.size, n + self.problem.integral_size))
        weights[:, :n] = -self._h_points * w[: self._inner].reshape(-1, n)
        weights[:, n:] = self.gauss_weights[:, None] * w[self._inner + self.problem.boundary_size : self._conditions]
        return weights

    def _row_sizes(self, x: Array) -> dict[str, Array]:
        """Return the largest entries of the rows of boundary and integral conditions."""
        of_field, of_boundary = self._columns
        ends = self._boundary.jacobian(*self._at_ends(x), of_boundary)[1][0]
        field = self._field.jacobian(*self._inside(x), of_field)[1][:, self._n :]
        return {"boundary": np.abs(ends).max(axis=1, initial=0.0), "integrals": np.abs(field).max(axis=(0, 2), initial=0.0)}

    # --- further derivatives -------------------------------------------------------------------------------------

    def along(self, x: Array, directions: Sequence[Array]) -> Array:
        """Return the derivative of F along several directions, shape (equations,); the part with u' is linear."""
        n = self._n
        field = self._field.along(*self._inside(x), [self._wide(v, self.at_gauss_points(v)) for v in directions])
        boundary = self._boundary.along(*self._at_ends(x), [self._wide(v, self._both_ends(v)) for v in directions])[0]
        return np.concatenate([-(self._h_points * field[:, :n]).ravel(), boundary, self.gauss_weights @ field[:, n:]])

    def bent(self, x: Array, w: Array, v: Array) -> Array:
        """Return the gradient of w.(F_x v), shape (size,): that of each function at its place, taken back to the nodes."""
        of_field, of_ends = (self.problem.batch(name).columns(self._free) for name in ("field", "boundary"))
        inside, both = self._wide(v, self.at_gauss_points(v)), self._wide(v, self._both_ends(v))
        ends = w[None, self._inner : self._inner + self.problem.boundary_size]
        slopes = self._field.bent(*self._inside(x), self._at_points(w), inside, of_field)
        return self._to_nodes(slopes, self._boundary.bent(*self._at_ends(x), ends, both, of_ends)[0])

    def _to_nodes(self, slopes: Array, at_ends: Array | None = None) -> Array:
        """Return derivatives by x, shape (size,), from those by states and free parameters at Gauss points, (N d, n + k).

        ``at_ends`` (2 n + k,) are further ones by the states at both ends and the free parameters.
        """
        n, by_points = self._n, slopes[:, : self._n].reshape(self.intervals, self._d, self._n)
        by_node = np.zeros((self.nodes.size, n))
        np.add.at(by_node, self._by_interval, np.einsum("qm,jqa->jma", self.basis.value, by_points))
        result = np.append(by_node.ravel(), slopes[:, n:].sum(axis=0))
        if at_ends is not None:
            result[:n] += at_ends[:n]
            result[self.state_size - n : self.state_size] += at_ends[n : 2 * n]
            result[self.state_size :] += at_ends[2 * n :]
        return result

    # --- functionals ---------------------------------------------------------------------------------------------

    @property
    def integrated(self) -> tuple[str, ...]:
        """Names of the functionals that are integrals, in the order of the compiled functions."""
        return tuple(self.problem.functionals)

    def functionals(self, x: Array) -> Array:
        """Return the values of the problem's functionals, in their order, by the same quadrature."""
        if not self.problem.functionals:
            return np.empty(0)
        return self.gauss_weights @ self.problem.batch("functionals").values(*self._inside_unscaled(x))

    def integrands(self, x: Array, times: Array, points: Array) -> Array:
        """Return the integrands of the functionals, with the parameters of x, for states (K, n) divided by their sizes."""
        batch: Batch = self.problem.batch("functionals")
        return batch.values(times, points * self.scales.states, _NONE(self._n), self.all_parameters(x))

    def column_gradient(self, x: Array, name: str) -> Array | None:
        """Return the derivatives of a parameter or functional by x, shape (size,); None where they are not known."""
        if name not in self.integrated:
            return super().column_gradient(x, name)
        batch, at = self._functionals, self.integrated.index(name)
        slopes = batch.jacobian(*self._inside(x), batch.columns(self._free))[1][:, at]
        return self._to_nodes(self.gauss_weights[:, None] * slopes)

    def column_bent(self, x: Array, name: str, v: Array) -> Array:
        """Return the derivative of `column_gradient` along v, shape (size,), of a column where that is known."""
        if name not in self.integrated:
            return super().column_bent(x, name, v)
        batch, weights = self._functionals, np.zeros((self.gauss_times.size, len(self.integrated)))
        weights[:, self.integrated.index(name)] = self.gauss_weights
        wide = self._wide(v, self.at_gauss_points(v))
        return self._to_nodes(batch.bent(*self._inside(x), weights, wide, batch.columns(self._free)))

    # --- errors --------------------------------------------------------------------------------------------------

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

    def scaled_parameters(self, x: Array) -> Array:
        """Return all parameters divided by their sizes."""
        return self._scaled_parameters(x)

    def field_values(self, times: Array, points: Array, p: Array) -> Array:
        """Return right-hand side and integrands of conditions, shape (K, n + their number).

        ``points`` (K, n) are states at ``times`` (K,), ``p`` all parameters; all are divided by their sizes, as are the values.
        """
        return self._field.values(times, points, _NONE(self._n), p)

    # --- in one call of a kernel ---------------------------------------------------------------------------------

    @property
    def linear_conditions(self) -> tuple[Array, Array] | None:
        """Rows (q, size) and values (q,) of conditions beyond those of the problem; None where a kernel does not know them.

        Zeros stand for those of `projections`.
        """
        return np.empty((0, self.size)), np.empty(0)

    @property
    def projections(self) -> Projections:
        """The room in which a kernel evaluates projection conditions: here none."""
        none, field = np.zeros((self._n, len(self.parameters))), self._field.load()
        return projections(field, field, (0, 0), (none, none), self._free)

    def fill_conditions(self, values: Values) -> int:
        """Fill in what a kernel must know of the conditions beyond those of the problem; return how many there are."""
        known = self.linear_conditions
        assert known is not None
        own = len(known[1])
        values.rows[:own], values.targets[:own] = known
        return own

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
        if own is None or not recorded or self._components or not 0 <= self.size - self.equations <= 1:
            return None
        rows = len(own[0]) + self.size - self.equations
        numbers = self.intervals * self._d * self._n * (self._n * (self._d + 1) + len(self.free))
        return workspace(self, rows) if not is_large(numbers) else None

    def unfilled_factors(self) -> Factorization:
        """Return factors of the matrix of `workspace`, to be filled by a kernel."""
        work = self.workspace
        assert work is not None
        return Factorization.unfilled(self._layout, self._empty_blocks(len(work.values.rows), 0), work.mesh.whole)


#: States from which on components are eliminated one by one, in Python. Of rods (14 states each), two take a tenth longer so
#: than by one kernel, three the same, ten a twentieth of the time.
_APART = 30
#: The t of boundary conditions, which do not take it.
_TIME = np.zeros(1)


@functools.cache
def _NONE(n: int) -> Array:
    """Return the absent second state of a function of one point."""
    return np.empty((0, n))
