"""The unknowns of a problem on a mesh: piecewise polynomials, the places where they are taken, and other meshes.

On each of N intervals the solution is a polynomial of degree d through d + 1 Lobatto nodes, the end nodes shared.
"""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Mapping, Sequence
from typing import Any, Self

import numpy as np

from contin.arrays import Array, Places
from contin.collocation.assembly import Tables, at_points, fill_phase_row
from contin.collocation.basis import basis, interpolation
from contin.core.protocol import Carrier, Discretization
from contin.core.scales import Scales, largest_entries, usual
from contin.core.system import System
from contin.errors import ProblemError
from contin.problems.statement import Statement

#: What is computed when it is first asked for, and depends on the mesh.
_ON_A_MESH = ("defect", "_workspaces", "_switchings", "_monodromies", "_spectra_found")


class OnMesh(System):
    """Unknowns on a mesh, and the free parameters behind them.

    Attributes
    ----------
    mesh, nodes : ndarray, shapes (N + 1,) and (N d + 1,)
        Mesh points and nodes.
    gauss_times, gauss_weights : ndarray, shape (N d,)
        Gauss points and weights of their quadrature.
    """

    problem: Any
    plain = True

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

    def _take_mesh(self, mesh: Array) -> None:
        """Set all that depends on the mesh, and forget what was computed on another one."""
        for name in _ON_A_MESH:
            vars(self).pop(name, None)
        problem, degree, h = self.problem, self.degree, mesh[1:] - mesh[:-1]
        a, b = problem.domain
        if mesh.ndim != 1 or mesh.size < 2 or not np.all(h > 0) or mesh[0] != a or mesh[-1] != b:
            raise ProblemError(f"mesh: must increase from {a} to {b}, with at least one interval")
        self.mesh, self._h, self.intervals = mesh, h, h.size
        self.gauss_times: Array = (mesh[:-1, None] + h[:, None] * self.basis.points).ravel()
        self.gauss_weights: Array = (h[:, None] * self.basis.weights).ravel()
        self._h_points = np.repeat(h, degree)[:, None]
        self._by_interval = degree * np.arange(self.intervals)[:, None] + np.arange(degree + 1)
        self.state_size = (self.intervals * degree + 1) * self._n
        self.size = self.state_size + len(self.free)
        self._conditions = self.intervals * degree * self._n + problem.boundary_size + problem.integral_size
        self.equations = self._conditions
        node_weights = np.zeros(self.intervals * degree + 1)
        np.add.at(node_weights, self._by_interval, (h[:, None] * self.basis.node_weights) / (b - a))
        #: Weights of the inner product: the mean over the domain of u.v, plus p.q of the free parameters.
        self.weights = np.concatenate([np.repeat(node_weights, self._n), np.ones(len(self.free))])

    @property
    def states_count(self) -> int:
        """Number of states, n."""
        return self._n

    # --- values --------------------------------------------------------------------------------------------------

    @property
    def nodes(self) -> Array:
        """Values of t at all nodes, shape (N d + 1,)."""
        inner = (self.mesh[:-1, None] + self._h[:, None] * self.basis.nodes[:-1]).ravel()
        return np.append(inner, self.mesh[-1])

    def states(self, x: Array) -> Array:
        """Return the states at the nodes, shape (N d + 1, n)."""
        return self._scaled_states(x) * self.scales.states

    def _scaled_states(self, x: Array) -> Array:
        """Return the states divided by their sizes, a view of x."""
        return x[: self.state_size].reshape(-1, self._n)

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
        states = self._interpolator(other.nodes)
        return self._between_scales(lambda x: np.concatenate([states(x).ravel(), x[self.state_size :]]), other)

    def _copied(self, without: Sequence[str] = ()) -> Self:
        """Return a copy with all that was computed, which ``copy.copy`` leaves out, but for what is to change."""
        other = object.__new__(type(self))
        vars(other).update({name: value for name, value in vars(self).items() if name not in without})
        return other

    def on_mesh(self, mesh: Places) -> tuple[Self, Carrier]:
        """Return the same problem on another mesh, and the function that carries vectors of unknowns over to it."""
        other = self._copied()
        other._take_mesh(np.array(mesh, dtype=float))
        return other, self.carrier(other)

    def refined(self) -> tuple[Self, Carrier]:
        """Return the same problem with every interval halved, and the carrier."""
        return self.on_mesh(np.sort(np.append(self.mesh, (self.mesh[1:] + self.mesh[:-1]) / 2)))

    def with_reference(self, x: Array) -> Self:
        """Return the same with x as the orbit that a phase condition refers to, where a kind of problem has one."""
        return self

    def _with(self, **changes: object) -> Self:
        """Return the same with other free parameters, parameters or scales."""
        values = dict(zip(self.problem.parameters, self.parameters))
        given: dict[str, Any] = {"free": self.free, "parameters": values, "scales": self.scales, **changes}
        return type(self)(self.problem, self.mesh, self.degree, **given)

    def with_parameters(self, values: Mapping[str, float]) -> Self:
        """Return the same problem with other values of parameters that are not free."""
        return self._with(parameters=dict(zip(self.problem.parameters, self.parameters)) | dict(values))

    def with_free(self, free: Sequence[str], x: Array) -> tuple[Self, Array]:
        """Return the same problem with other free parameters (values from x), on the same mesh, and x for it."""
        values = dict(zip(self.problem.parameters, self.all_parameters(x)))
        other = self._with(free=free, parameters=values)
        return other, other.pack(self.states(x), values)

    def with_scales(self, x: Array, states: Array, parameters: Array) -> tuple[Self, Array]:
        """Return the same problem with these sizes of states and parameters, sizes of rows found at x, and x for it."""
        rows = {name: np.ones(count) for name, count in self._rows}
        scaled = self._with(scales=Scales(states, parameters, rows))
        z = self.carrier(scaled)(x)
        found = {name: usual(largest_entries(lambda at: scaled._row_sizes(at)[name], z)) for name in rows}  # noqa: B023
        return self._with(scales=Scales(states, parameters, found)), z

    def without_scales(self, x: Array) -> tuple[Self, Array]:
        """Return the same problem in the user's units, and x for it."""
        other = self._with(scales=None)
        return other, self.carrier(other)(x)

    @property
    def _rows(self) -> tuple[tuple[str, int], ...]:
        """Those of boundary and integral conditions."""
        return ("boundary", self.problem.boundary_size), ("integrals", self.problem.integral_size)

    @abstractmethod
    def _row_sizes(self, x: Array) -> dict[str, Array]:
        """Return the largest entries of those rows."""
