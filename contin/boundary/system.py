"""Boundary value problems on a mesh: unknowns, equations, conditions, and what is known of their branches.

On each of N intervals the solution is a polynomial of degree d through d + 1 Lobatto nodes, the end nodes shared. It satisfies
the equation at the d Gauss points of each interval: error O(h^(2 d)) at the mesh points (superconvergence, de Boor & Swartz
1973). Integrals use the same Gauss points, so they converge as fast.
"""

from __future__ import annotations

import functools
import threading
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from typing import Any, Self

import numpy as np

from contin import draws
from contin.arrays import Array, Indices, Places
from contin.boundary.crossings import Crossing, crossing_places, crossings, frozen, next_places, outcomes, stepped
from contin.boundary.grazing import contradiction, grazing, jumping, touch_ahead, with_sides_near
from contin.collocation.assembly import Bordering, Tables, assemble, at_points, collocate, fill_phase_row, interpolate, to_nodes
from contin.collocation.corners import NOWHERE, Selections, Switching, breaks_of, joined, selections, switching
from contin.collocation.defect import Defect
from contin.collocation.mesh import MeshControl, adapted_mesh, basis, halved, interpolation, moved_to_breaks, near
from contin.collocation.newton import Codes, Values, Workspace, codes_of, linearize_on_mesh, workspace
from contin.collocation.projection import Projections, no_projections
from contin.core.protocol import Carrier, Discretization
from contin.core.step import State, Stop
from contin.core.system import Composed, Inputs, Scales, Term
from contin.core.trial import Event, Trial
from contin.errors import Grazing, ProblemError
from contin.events.arc import SpecialPoint
from contin.events.labelled import Stability
from contin.functions.batch import Batch, Columns
from contin.levels import APART, CORRECTED
from contin.linalg.blocks import Blocks, Factors, Layout, Share, is_large, layout, run, share
from contin.linalg.border import random_rows
from contin.linalg.components import Around, Component, ComponentFactors, Part, components
from contin.linalg.condensation import Factorization
from contin.problems.statement import Statement

#: What is computed when it is first asked for, and depends on the mesh.
_ON_A_MESH = ("defect", "_workspaces", "_known", "_monodromies", "_in_pieces", "_last_crossings")


#: States from which on components are eliminated one by one, in Python. Of rods (14 states each), two take a tenth longer so
#: than by one kernel, three the same, ten a twentieth of the time.
_APART = 30
#: The t of boundary conditions, which do not take it.
_TIME = np.zeros(1)


@functools.cache
def _NONE(n: int) -> Array:
    """Return the absent second state of a function of one point."""
    return np.empty((0, n))


class Collocation(Composed):
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

    Attributes
    ----------
    mesh, nodes : ndarray, shapes (N + 1,) and (N d + 1,)
        Mesh points and nodes.
    gauss_times, gauss_weights : ndarray, shape (N d,)
        Gauss points and weights of their quadrature.

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
    #: The vector of unknowns that conditions beyond those of the problem refer to; empty without one.
    reference: Array = np.empty(0)
    #: The times at which they change, and those of each piece between these times; None where they are not frozen.
    _pieces: tuple[Array, Array] | None = None
    #: Those of the solution at which functions were evaluated last: derivatives by points become derivatives by x with them.
    _last_crossings: Sequence[Crossing] = ()
    #: 2: with crossings and their derivatives; 1: these as at mesh points; 0: outcomes change at mesh points themselves.
    _crosses: int = 2

    def __init__(
        self, problem: Statement, mesh: Places, degree: int, free: Sequence[str], parameters: Mapping[str, float],
        scales: Scales | None = None,
    ) -> None:  # fmt: skip
        super().__init__(problem, free, parameters, scales)
        self.degree = self._d = degree
        self.basis = basis(degree)
        self.tables = Tables(self.basis.value, self.basis.slope, self.basis.weights)
        self._n = len(self.problem.state_names)
        self._take_mesh(np.array(mesh, dtype=float))
        self._complete()

    def _take_mesh(self, mesh: Array) -> None:
        """Set all that depends on the mesh, and forget what was computed on another one."""
        for name in _ON_A_MESH:
            vars(self).pop(name, None)
        problem, degree, h = self.problem, self.degree, mesh[1:] - mesh[:-1]
        a, b = problem.domain
        if mesh.ndim != 1 or mesh.size < 2 or not h.min() > 0 or mesh[0] != a or mesh[-1] != b:
            raise ProblemError(f"mesh: must increase from {a} to {b}, with at least one interval")
        self._take_pieces(mesh)
        self.mesh, self._h, self.intervals, self._grid = mesh, h, h.size, (mesh, degree)
        self.gauss_times: Array = (mesh[:-1, None] + h[:, None] * self.basis.points).ravel()
        self.gauss_weights: Array = (h[:, None] * self.basis.weights).ravel()
        self._h_points = h.repeat(degree)[:, None]
        self.state_size = (self.intervals * degree + 1) * self._n
        self.size = self.state_size + len(self.free)
        self.equations = self._conditions = h.size * degree * self._n + problem.boundary_size + problem.integral_size
        node_weights = np.empty(h.size * degree + 1)
        to_nodes(self.basis.value, self.gauss_weights[:, None] / (b - a), node_weights)
        #: Weights of the inner product: the mean over the domain of u.v, plus p.q of the free parameters.
        self.weights = np.ones(self.size)
        self.weights[: self.state_size].reshape(-1, self._n)[:] = node_weights[:, None]

    @property
    def states_count(self) -> int:
        """Number of states, n."""
        return self._n

    @property
    def by_interval(self) -> Indices:
        """Places of the nodes of each interval among all nodes, shape (N, d + 1)."""
        return self._d * np.arange(self.intervals)[:, None] + np.arange(self._d + 1)

    # --- values --------------------------------------------------------------------------------------------------

    @property
    def nodes(self) -> Array:
        """Values of t at all nodes, shape (N d + 1,)."""
        return np.concatenate([(self.mesh[:-1, None] + self._h[:, None] * self.basis.nodes[:-1]).ravel(), self.mesh[-1:]])

    def states(self, x: Array) -> Array:
        return self._scaled_states(x) * self.scales.states

    def at_gauss_points(self, x: Array) -> Array:
        """Return the states divided by their sizes at the Gauss points, shape (N d, n)."""
        points = np.empty((self.gauss_times.size, self._n))
        at_points(self.basis.value, np.ascontiguousarray(x), points)
        return points

    def states_at_gauss_points(self, x: Array) -> Array:
        """Return the states at the Gauss points in the user's units, shape (N d, n)."""
        return self.at_gauss_points(x) * self.scales.states

    def evaluate(self, x: Array, times: Array) -> Array:
        """Return the states at ``times`` (m,), shape (m, n), by the piecewise polynomial."""
        return self._interpolated(x, times) * self.scales.states

    def _interpolated(self, x: Array, times: Array) -> Array:
        """Return the piecewise polynomial of the values in x."""
        at, given = np.ascontiguousarray(times, dtype=float), (self.basis.nodes, self.basis.barycentric, self.mesh)
        values = np.empty((at.size, self._n))
        interpolate(*given, at, np.ascontiguousarray(x, dtype=float), values)
        return values

    def evaluate_scaled_in(self, x: Array, interval: int, places: Array) -> Array:
        """Return the states divided by their sizes at ``places`` (K,) of an interval, between 0 and 1, shape (K, n)."""
        first = interval * self._d
        matrix = interpolation(self.basis.nodes, self.basis.barycentric, places)
        return matrix @ self._scaled_states(x)[first : first + self._d + 1]

    def phase_row(self, reference: Array) -> Array:
        """Return the row of the integral of u . v' over that of v' . v', shape (size,), for scaled states v at the nodes.

        The integrals are taken at the Gauss points, with v' of the piecewise polynomial v; zero where v is constant.
        """
        row = np.zeros(self.size)
        row /= fill_phase_row(self._n, self.tables, self._h, np.ascontiguousarray(reference).ravel(), row) or 1.0
        return row

    # --- the same on other meshes, with other parameters and sizes ------------------------------------------------

    def carrier(self, other: Discretization) -> Carrier:
        """Return the function that carries vectors of unknowns from this mesh to the mesh of another system."""
        given = self.basis.nodes, self.basis.barycentric, self.mesh, other.nodes
        size, last = len(given[-1]) * self._n, self.state_size

        def carry(x: Array) -> Array:
            carried = np.empty(size + len(x) - last)
            interpolate(*given, np.ascontiguousarray(x), carried[:size].reshape(-1, self._n))
            carried[size:] = x[last:]
            return carried

        return self._between_scales(carry, other)

    def _copied(self) -> Self:
        """Return a copy with all that was computed, which ``copy.copy`` leaves out."""
        other = object.__new__(type(self))
        vars(other).update(vars(self))
        vars(other).pop("_thawed", None)
        return other

    def on_mesh(self, mesh: Places, reference: Array | None = None) -> tuple[Self, Carrier]:
        """Return the same problem on another mesh, and the function that carries vectors of unknowns over to it.

        With a ``reference`` on this mesh in place of its own, where it has one.
        """
        other = self._copied()
        other._take_mesh(np.array(mesh, dtype=float))
        carry = self.carrier(other)
        if self.reference.size:
            other._refer(carry(self.reference if reference is None else reference))
        return other, carry

    def refined(self) -> tuple[Self, Carrier]:
        """Return the same problem with every interval halved, and the carrier."""
        return self.on_mesh(halved(self.mesh))

    def with_reference(self, x: Array) -> Self:
        """Return the same with x as the reference, where a kind of problem has one."""
        return self

    def _refer(self, x: Array) -> None:
        """Take x as the reference."""

    def _referring_to(self, x: Array) -> Self:
        other = self._copied()
        other._refer(x)
        return other

    def _with(self, **changes: object) -> Self:
        """Return the same with other free parameters, parameters or scales, and with the same reference."""
        other, known = super()._with(**changes).with_pieces(self._pieces), self.reference
        if known.size:
            other._refer(other.pack(self.states(known), dict(zip(self.problem.parameters, self.all_parameters(known)))))
        return other

    @property
    def _rows(self) -> tuple[tuple[str, int], ...]:
        """Those of boundary and integral conditions."""
        return ("boundary", self.problem.boundary_size), ("integrals", self.problem.integral_size)

    # --- the functions of the statement ---------------------------------------------------------------------------

    @functools.cached_property
    def _layout(self) -> Layout:
        depends = self.problem.batch("field").depends[: self._n, : self._n]
        return layout(depends if not self.outcomes.size else np.full_like(depends, True), self.degree)

    @property
    def order_of_states(self) -> Indices:
        """The states in the order of the columns of a linearized system, shape (n,)."""
        return self._layout.order

    @functools.cached_property
    def _columns(self) -> tuple[Columns, Columns]:
        """Columns of field, by states in the layout's order, and of boundary; each by the free parameters, too."""
        field, boundary = self.problem.batch("field"), self.problem.batch("boundary")
        field = field if not self.outcomes.size else self._in_pieces
        return field.columns(self._free, self._layout.order), boundary.columns(self._free)

    @functools.cached_property
    def _field(self) -> Batch:
        """Right-hand side and integrands, compiled."""
        return self._frozen("field", self._batch("field", ("states", "integrals")))

    @functools.cached_property
    def _in_pieces(self) -> Any:
        """The same with frozen outcomes at the Gauss points, where the equations jump."""
        return frozen(self._field, self.outcomes, self._d) if self.outcomes.size else self._field

    def crossings(self, x: Array) -> Sequence[Crossing]:
        """Return the mesh points at which a solution crosses jumps; none where outcomes are not frozen."""
        if self.outcomes.size and self._crosses:
            self._last_crossings = self._once("crossings", x, lambda: crossings(self, self._field, x))
        return self._last_crossings

    def with_pieces(self, pieces: tuple[Array, Array] | None, crosses: int = 2) -> Self:
        """Return the same with other frozen outcomes; ``crosses`` 0: they change at mesh points, wherever the crossings are.

        With 1 derivatives are those of crossings at the mesh points. From far away Newton's method finds more with these.
        """
        if pieces is None and self._pieces is None:
            return self
        other = self._copied()
        for name in (*_ON_A_MESH, "_layout", "_columns", "_codes", "_components", "outcomes"):
            vars(other).pop(name, None)
        other._pieces, other._crosses = pieces, crosses
        other._take_pieces(self.mesh)
        return other

    def _take_pieces(self, mesh: Array) -> None:
        """Set the outcomes on the intervals of a mesh, where they are frozen."""
        if self._pieces is not None:
            self.outcomes = self._pieces[1][np.searchsorted(self._pieces[0], (mesh[1:] + mesh[:-1]) / 2)]

    def crossed(self, x: Array, corners: bool = False) -> tuple[Self, Array]:
        """Return the same with mesh points and frozen outcomes where the equations jump along x, and x; else itself.

        With ``corners`` also where they have corners: so crossings move with a solution, and second derivatives are known.
        """
        if self.outcomes.size and not self.contradicts(x):
            return self, x
        system = self.with_pieces(None)
        found = system.switching(x)
        if not (found.places.size if corners else found.jumps.any()) or not self._switches_inside:
            return system, x
        system, carry = system.on_switches(x) or (system, np.array)
        other = with_sides_near(system, x := carry(x))
        return (other if len(other._pieces[0]) else system), x

    def check_jumps(self, x: Array, state: State, settled: bool = True) -> None:
        """Raise Grazing where x, the end of a step from a state, crosses more or fewer jumps of the equations.

        It is ``settled`` where mesh points have moved to the crossings; if they are late, Newton's method failed meanwhile.
        """
        if settled and any(np.abs(each.shift).max() > APART for each in self.crossings(x)):
            raise Grazing("met grazing: no solution with these jumps is found there")
        found = self.switching(x)
        if why := contradiction(self, x):
            raise Grazing(f"met grazing: {why}")
        if not (self.outcomes.size or state.singular) and found.jumps.any():
            at = int(np.argmax(found.jumps))
            told = f"{found.names[at]}, where the equations jump, changes its sign at t = {found.places[at]:.6g}"
            raise Grazing(f"met grazing: {told}")

    def stepped(self, x: Array, change: Array) -> tuple[Self, Array]:
        """Return the same with mesh points that move with the crossings in a step of Newton's method, and x behind it."""
        mesh, at, after = stepped(self, x, change)
        assert self._pieces is not None
        other = self.with_pieces((at, self._pieces[1]), self._crosses)
        return other.on_mesh(mesh)[0], after

    def contradicts(self, x: Array) -> bool:
        """Return whether a solution has other outcomes at a Gauss point than those that are frozen there."""
        if not self.outcomes.size:
            return False
        t = self.gauss_times
        there = outcomes(self.problem.batch("field"), t, self.evaluate(x, t), self.all_parameters(x))
        return bool((there != self.outcomes.repeat(self._d, axis=0)).any())

    @functools.cached_property
    def _boundary(self) -> Batch:
        return self._frozen("boundary", self._batch("boundary", ("boundary",)))

    _functions = "field", "boundary"

    @property
    def _terms(self) -> tuple[Term, Term]:
        """Those of the Gauss points, and of both ends."""
        n, first, problem = self._n, self._inner, self.problem
        last = first + problem.boundary_size

        def rows(f: Array) -> Array:
            conditions, further = np.zeros(problem.boundary_size), np.zeros(self._further)
            return np.concatenate([-(self._h_points * f[:, :n]).ravel(), conditions, self.gauss_weights @ f[:, n:], further])

        def weights(w: Array) -> Array:
            integrals = self.gauss_weights[:, None] * w[last : self._conditions]
            return np.concatenate([-self._h_points * w[:first].reshape(-1, n), integrals], axis=1)

        def rows_at_ends(f: Array) -> Array:
            return np.concatenate([np.zeros(first), f[0], np.zeros(self.equations - last)])

        def by_x(slopes: Array) -> Array:
            return np.concatenate([slopes[0, :n], np.zeros(self.state_size - 2 * n), slopes[0, n:]])

        moved = functools.partial(self._inside, along=True)
        inside = Term(self, self._in_pieces, self._inside, rows, weights, self._to_nodes, moved)
        return inside, Term(self, self._boundary, self._at_ends, rows_at_ends, lambda w: w[None, first:last], by_x)

    @property
    def _column_term(self) -> Term:
        """Integrals of the functionals."""
        widths = self.gauss_weights
        return Term(self, self._functionals, self._inside, lambda f: widths @ f, lambda w: widths[:, None] * w, self._to_nodes)

    def _inside(self, x: Array, along: bool = False) -> Inputs:
        """Return where functions of t are evaluated: at the Gauss points; or how these change ``along`` a direction x."""
        points = self.at_gauss_points(x)
        for each in self._last_crossings if along else self.crossings(x):
            shift = each.shift_by_x @ x[self._beside(each)] if along else each.shift
            points.reshape(self.intervals, self._d, -1)[each.node] += self.basis.value[:, :1] * shift
        return self.gauss_times, points, _NONE(self._n), self.scaled_parameters(x)

    def _beside(self, at: Crossing) -> Indices:
        """Return the places of the states at a crossing and of the free parameters among the unknowns."""
        first = self._n * self._d * at.node
        return np.r_[first : first + self._n, self.state_size : self.size]

    def along(self, x: Array, directions: Sequence[Array]) -> Array:
        """Return the derivative of F along several directions; two of them move the crossings."""
        found: Array = super().along(x, directions)
        for each, by_shift in self._of_shifts(x) if self.outcomes.size and len(directions) == 2 else ():
            a, b = (v[self._beside(each)] for v in directions)
            found += by_shift @ each.shift_bent(a) @ b
        return found

    def bent(self, x: Array, w: Array, v: Array) -> Array:
        """Return the gradient of w.(F_x v) by x."""
        found: Array = super().bent(x, w, v)
        for each, by_shift in self._of_shifts(x) if self.outcomes.size else ():
            at = self._beside(each)
            found[at] += w @ by_shift @ each.shift_bent(v[at])
        return found

    def _of_shifts(self, x: Array) -> Iterator[tuple[Crossing, Array]]:
        """Yield the crossings, and the derivatives of F by the states with which the intervals behind them begin."""
        inside, both = self._terms[0], [self.basis.value[:, 0], self.basis.slope[:, 0]]
        units = np.eye(self._n, self._n + self.problem.integral_size)
        slopes = inside.slopes(x, inside.columns)[:, :, : self._n].transpose(2, 0, 1)
        for each in self.crossings(x):
            value, slope = np.kron(np.arange(self.intervals) == each.node, both)[:, :, None]
            yield each, np.transpose([inside.rows(f * value - e * slope / self._h_points) for f, e in zip(slopes, units)])

    def _at_ends(self, x: Array) -> Inputs:
        """Return where boundary conditions are evaluated."""
        u = self._scaled_states(x)
        return _TIME, u[:1], u[-1:], self.scaled_parameters(x)

    # --- F and F_x -----------------------------------------------------------------------------------------------

    def _residual(self, x: Array, field: Array, boundary: Array) -> Array:
        residual = np.empty(self._conditions)
        collocate(self._n, self.basis.slope, self.basis.weights, self._h, x, field, boundary, residual)
        for each in self.crossings(x):
            inside = residual[: self._inner].reshape(self.intervals, self._d, -1)
            inside[each.node] += self.basis.slope[:, :1] * each.shift
        return residual

    def residual(self, x: Array) -> Array:
        """Return the residual of the discrete equations at x, shape (equations,); further conditions come last."""
        inside = self._residual(x, self._in_pieces.values(*self._inside(x)), self._boundary.values(*self._at_ends(x)))
        return np.concatenate([inside, self.condition_values(x)]) if self._further else inside

    # --- conditions beyond those of the problem: each is a row of its own, and may depend on all unknowns ----------

    @property
    def _further(self) -> int:
        """Their number, q."""
        return self.equations - self._conditions

    def condition_values(self, x: Array) -> Array:
        """Return what vanishes besides, shape (q,)."""
        return self.conditions_with_rows(x)[0]

    def conditions_with_rows(self, x: Array) -> tuple[Array, Array]:
        """Return what vanishes besides, shape (q,), and its derivatives by x, shape (q, size)."""
        return np.empty(0), np.empty((0, self.size))

    # --- F_x -----------------------------------------------------------------------------------------------------

    def _linearized(self, x: Array, rows: Array, columns: Array) -> tuple[Array, Factors]:
        """Return the residual at x, and [[F_x, columns^T], [rows]] factored."""
        if self._components:
            return self._factored_apart(x, Bordering(columns, rows))
        work = self.workspace
        if work is None or work.values.projections.total:
            residual, blocks = self._assembled(x, rows, columns)
            return residual, Factorization(self._layout, blocks, self._segments(blocks.local.size))
        factors = Factorization.unfilled(self._layout, self._empty_blocks(len(rows), len(columns)), work.mesh.whole)
        residual, given = np.empty(self._conditions), (Bordering(columns, rows), np.array(x))
        factors.sign = linearize_on_mesh(work, factors.room, *given, residual)
        return residual, factors

    def _segments(self, numbers: int) -> Share:
        """Return the segments of a matrix with so many ``numbers`` in the blocks of all intervals."""
        return share(self.intervals, numbers)

    def _assembled(self, x: Array, rows: Array, columns: Array) -> tuple[Array, Blocks]:
        """Return the residual at x, and the blocks of that matrix."""
        boundary, ends = self._boundary.jacobian(*self._at_ends(x), self._columns[1])
        field, jacobian = self._in_pieces.jacobian(*self._inside(x), self._columns[0])
        blocks = self._empty_blocks(len(rows), len(columns))
        given = self._layout, self.tables, self._h, jacobian, ends, Bordering(columns, rows), blocks
        run(assemble, given, self._segments(blocks.local.size), (True, False))
        k, q = len(self.free), self.problem.integral_size
        for each in self.crossings(x):
            local, border, by_x = blocks.local[each.node], blocks.border[each.node, :q], each.shift_by_x
            for block, free in (local, local[:, self._n * (self._d + 1) :]), (border, blocks.corner[:q]):
                free[:, :k] += block[:, self._left] @ by_x[:, self._n :]
                block[:, self._left] += block[:, self._left] @ by_x[:, : self._n]
        return self._residual(x, field, boundary), blocks

    @property
    def _left(self) -> Indices:
        """Places of the left end's states among the columns of an interval, in the order of the states."""
        ends = self._layout.ends
        return (self._n * (self._d - 1) + np.argsort(ends)[: self._n]).astype(np.int64)

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
        if self._n < _APART or self.outcomes.size:
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
        if not self._further:
            return self._linearized(x, rows, columns)
        values, own = self.conditions_with_rows(x)
        own = np.concatenate([own, columns[:, self._conditions :].T], axis=1)
        inside = np.ascontiguousarray(columns[:, : self._conditions])
        residual, factors = self._linearized(x, np.concatenate([own, rows]), inside)
        return np.concatenate([residual, values]), factors

    def transposed_product(self, x: Array, w: Array) -> Array:
        """Return F_x^T w, shape (size,), for w (equations,)."""
        inside, ends = self._terms
        result = inside.transposed(x, w) + ends.transposed(x, w)
        rates = np.hstack([w[: self._inner].reshape(-1, self._n), np.zeros((self.gauss_times.size, len(self.free)))])
        result = result + self._to_nodes(rates, self.basis.slope)
        return result + w[self._conditions :] @ self.conditions_with_rows(x)[1] if self._further else result

    @property
    def _inner(self) -> int:
        """Number of collocation conditions."""
        return self.gauss_times.size * self._n

    def _row_sizes(self, x: Array) -> dict[str, Array]:
        """Return the largest entries of the rows of boundary and integral conditions."""
        of_field, of_boundary = self._columns
        ends = self._boundary.jacobian(*self._at_ends(x), of_boundary)[1][0]
        field = self._in_pieces.jacobian(*self._inside(x), of_field)[1][:, self._n :]
        return {"boundary": np.abs(ends).max(axis=1, initial=0.0), "integrals": np.abs(field).max(axis=(0, 2), initial=0.0)}

    def slopes(self, x: Array) -> Array:
        """Return the gradients of a few random combinations of the equations, which show what outcomes change."""
        return np.array([self.transposed_product(x, w) for w in random_rows(draws.DRAWS, self.equations)])

    def _to_nodes(self, slopes: Array, values: Array | None = None) -> Array:
        """Return derivatives by x from those at Gauss points, (N d, n + k), by nodes' ``values`` (d, d + 1) there."""
        found, values = np.empty(self.state_size - self._n + slopes.shape[1]), self.basis.value if values is None else values
        to_nodes(values, np.ascontiguousarray(slopes), found)
        for each in self._last_crossings:
            of_points = slopes[self._d * each.node :][: self._d, : self._n]
            found[self._beside(each)] += values[:, 0] @ of_points @ each.shift_by_x
        return found

    # --- functionals ---------------------------------------------------------------------------------------------

    def integrands(self, x: Array, times: Array, points: Array) -> Array:
        """Return the integrands of the functionals, with the parameters of x, for states (K, n) divided by their sizes."""
        batch: Batch = self.problem.batch("functionals")
        return batch.values(times, points * self.scales.states, _NONE(self._n), self.all_parameters(x))

    # --- errors --------------------------------------------------------------------------------------------------

    @functools.cached_property
    def defect(self) -> Defect:
        """What the estimates of errors on this mesh share."""
        return Defect(self)

    def discretization_error(self, x: Array, factors: Factors, columns: Any) -> float:
        """Return the estimated error of a solution that is due to the mesh, relative to 1 + size; see `Defect`."""
        return self.defect.error(x, factors, columns)

    def newton_error(self, x: Array, factors: Factors) -> float:
        return self.defect.left_by_newton(x, self.residual(x), factors)

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
        return no_projections()

    def holds(self, x: Array, tolerance: float) -> bool:
        """Return whether a solution with another reference is one with this one: it meets the linear conditions."""
        known = self.linear_conditions
        return known is not None and bool(np.abs(known[0] @ x - known[1]).max(initial=0.0) <= tolerance)

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
            self._workspaces[thread] = self._made_workspace(thread)
        return self._workspaces[thread]

    @functools.cached_property
    def _workspaces(self) -> dict[int, Workspace | None]:
        return {}

    @functools.cached_property
    def _codes(self) -> dict[int, tuple[Codes, Projections]]:
        """By thread; copies on other meshes have the same: each call of a kernel fills in its own spaces."""
        return {}

    def _made_workspace(self, thread: int) -> Workspace | None:
        own = self.linear_conditions
        recorded = thread in self._codes or all(batch.interpreted is None for batch in self._evaluated)
        if own is None or not recorded or self._components or self.outcomes.size or self.size < self.equations:
            return None
        rows = len(own[0]) + self.size - self.equations
        numbers = self.intervals * self._d * self._n * (self._n * (self._d + 1) + len(self.free))
        if is_large(numbers):
            return None
        shared = self._codes[thread] = self._codes.get(thread) or (codes_of(self), self.projections)
        return workspace(self, *shared, rows)

    def unfilled_factors(self) -> Factorization:
        """Return factors of the matrix of `workspace`, to be filled by a kernel."""
        work = self.workspace
        assert work is not None
        return Factorization.unfilled(self._layout, self._empty_blocks(len(work.values.rows), 0), work.mesh.whole)

    # --- meshes that suit a solution -----------------------------------------------------------------------------

    def adapted(self, x: Array, control: MeshControl) -> tuple[Self, Carrier] | None:
        """Return the same on a better mesh for x and with x as the reference, and the carrier; None where there is no need."""
        mesh, known = None, self.reference
        if control.every:
            mesh = adapted_mesh(self.basis, self.mesh, self._scaled_states(x), control, self._all_breaks(x, closely=False))
        if mesh is None and (not known.size or np.abs(x - known).max() <= APART * np.abs(x).max()):
            return None
        return (self._referring_to(x), np.array) if mesh is None else self.on_mesh(mesh, x)

    def on_switches(self, x: Array, closely: bool = False) -> tuple[Self, Carrier] | None:
        """Return the same on a mesh with the places of `switching` among its points; None where they are already.

        ``closely``: up to round-off, as what depends on the place itself needs. A solution depends on its square only.
        """
        breaks = self._all_breaks(x, closely)
        if not breaks.size or near(breaks, self.mesh, self.mesh[-1] - self.mesh[0]).all():
            return None
        system = self
        if self._pieces is not None:
            system = self.with_pieces((next_places(self, x), self._pieces[1]))
        return system.on_mesh(moved_to_breaks(self.mesh, breaks))

    def _all_breaks(self, x: Array, closely: bool) -> Array:
        """Return the places where the equations are not smooth; those on mesh points, as far as it matters, are these."""
        moving = self.switching(x)
        if not moving.places.size:
            return self.breaks
        nearest = self.mesh[np.abs(self.mesh - moving.places[:, None]).argmin(axis=1)]
        off = np.abs(nearest - moving.places) > CORRECTED * (self.mesh[-1] - self.mesh[0])
        places = np.where(off if closely else ~moving.settled, moving.places, nearest)
        places = places[(places > self.mesh[0]) & (places < self.mesh[-1])]
        return np.unique(np.concatenate([self.breaks, places]))

    @property
    def _of_the_mesh(self) -> Sequence[str]:
        """Names of the functions that the mesh matters for."""
        return ("field", "functionals") if self.integrated else ("field",)

    @functools.cached_property
    def breaks(self) -> Array:
        """Places where the equations have jumps or corners in t, whatever the states are: points of a good mesh."""
        given = self.problem.domain, self.parameters, self._free
        found = np.concatenate([breaks_of(self.problem.batch(name), *given) for name in self._of_the_mesh])
        return np.unique(found) if found.size else found  # the first call loads numpy.ma

    @functools.cached_property
    def _selections(self) -> list[tuple[str, Selections]]:
        """Conditions of these functions, by the name of the function."""
        found = [(name, selections(self.problem.batch(name), self._free)) for name in self._of_the_mesh]
        return [(name, each) for name, each in found if each is not None]

    @property
    def has_selections(self) -> bool:
        """Conditions on states or free parameters switch the equations."""
        return bool(self._selections)

    def switching(self, x: Array) -> Switching:
        """Return where conditions on states or free parameters switch along a solution, and the equations are not smooth."""
        if not self._selections:
            return NOWHERE

        def made() -> Switching:
            sizes = functools.partial(self._sizes_of, x=x)
            frozen = [crossing_places(self, x)] if self.outcomes.size else []
            given = [(name, each) for name, each in self._selections if not frozen or name != "field"]
            return joined([*frozen, *(switching(self, each, functools.partial(sizes, name), x) for name, each in given)])

        return self._once("switching", x, made)

    def _sizes_of(self, name: str, x: Array) -> Array:
        """Return the sizes of what the values of a function are integrated to."""
        with np.errstate(all="ignore"):
            values = np.abs(self._batch(name).values(*self._inside(x))).max(axis=0)
        largest: Array = (self.mesh[-1] - self.mesh[0]) * np.nan_to_num(values)
        largest[largest == 0] = 1.0
        if name == "field":
            largest[: self._n] = (self.largest(x)[: self._n] + 1) * self.scales.states
        return largest

    # --- what the statement knows of its branches ----------------------------------------------------------------

    @property
    def is_function_of_t(self) -> bool:
        """Yes."""
        return True

    @property
    def stored(self) -> dict[str, Array]:
        """Mesh, parameters and sizes, and frozen outcomes."""
        pieces = {} if self._pieces is None else dict(zip(("jumps", "outcomes"), self._pieces))
        return {"mesh": self.mesh, **self._own_arrays, **pieces}

    def referring_to(self, x: Array, tangent: Array) -> Self:
        """Return the same with a solution as the reference, where the kind has one."""
        return self.with_reference(x)

    def explained(self, stop: Stop, trial: Trial) -> Stop:
        """Return the end of a run at a jump, with the conditions and times."""
        if not self.outcomes.size or stop.message not in ("met grazing", "met sliding"):
            return stop
        found = crossing_places(self, trial.x)
        places = ", ".join(f"{name} at t = {place:.6g}" for name, place in zip(found.names, found.places))
        return replace(stop, message=f"{stop.message}: jumps at {places}")

    def events(self) -> list[Event]:
        """Return those of the statement and, where the equations jump, of crossings that end."""
        return [*self.problem.events(), *self._of_conditions()]

    def home_ahead(self, state: State, step: float) -> SpecialPoint | None:
        """Return the grazing point to which the tangent leads within a step."""
        return touch_ahead(state, step) if self._switches_inside else None

    @property
    def _switches_inside(self) -> bool:
        """Conditions along the solution decide the right-hand side."""
        return any(name == "field" for name, _ in self._selections)

    def _of_conditions(self) -> list[Event]:
        """Return the test functions of conditions along the solution."""
        touches = [grazing()] * self._switches_inside
        return [*touches, *(jumping() if self.outcomes.size else ())]

    def stability(self, point: SpecialPoint) -> Stability:
        """Return what the statement says."""
        return self.problem.stability(point)

    def degenerate(self, x: Array) -> str:
        """Return what the statement says."""
        return self.problem.degenerate(self, x)

    def undetermined(self, x: Array) -> str:
        """Return what the statement says."""
        return self.problem.undetermined(self, x)

    @property
    def index(self) -> Event | None:
        """That of the statement."""
        return self.problem.index
