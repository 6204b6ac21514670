"""Collocation of periodic orbits: a phase condition with a moving reference, and Floquet multipliers."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from contin.arrays import Array, ComplexArray, Indices
from contin.discretization.collocation import Collocation
from contin.discretization.mesh import MeshControl, adapted_mesh
from contin.discretization.protocol import Carrier
from contin.discretization.scales import Scales
from contin.errors import ProblemError
from contin.linalg.condensation import Factorization
from contin.linalg.factors import Factors
from contin.linalg.periodic import log_eigenvalues
from contin.problems.cycle import CycleProblem

#: A multiplier on the unit circle that is this near to -1, as an angle, is -1: round-off of a double one is its square root.
_OPPOSITE = 1e-6
#: A pair at an angle whose square is below so many times the error of the multiplier 1 may be a double one.
_SPLIT = 100.0
#: Logarithms of multipliers that differ by less are those of a pair; multipliers of so many orbits are kept.
_EQUAL, _KEPT = 1e-9, 50
#: An orbit of a smaller size, relative to 1 + its states, is an equilibrium: at a branch point less is round-off.
_SHRUNK = 1e-7
#: The reference is renewed where an orbit differs from it by more than this part of its size.
_MOVED = 1e-6


class CycleCollocation(Collocation):
    """A `CycleProblem` on a mesh.

    The phase condition, the integral of u . v' over that of v' . v', is linear: one row beside the collocation equations,

        [ collocation   ]        the integral is taken at the Gauss points, with v' of the piecewise polynomial v, the reference
        [ u(0) - u(1)   ]
        [ phase row . x ]

    Attributes
    ----------
    reference : ndarray, shape (K, n)
        The states of v at the nodes, in the user's units; zero where `with_reference` has not set it.
    """

    problem: CycleProblem

    def __init__(
        self, problem: CycleProblem, mesh: Sequence[float] | Array, degree: int, free: Sequence[str],
        parameters: Mapping[str, float], scales: Scales | None = None,
    ) -> None:  # fmt: skip
        super().__init__(problem, mesh, degree, free, parameters, scales)
        self.equations = self._conditions + 1
        self._known: dict[bytes, ComplexArray] = {}
        self._set_reference(np.zeros((self.nodes.size, self._n)))

    def _set_reference(self, reference: Array) -> None:
        """Take the phase row from an orbit, states at the nodes."""
        self.reference = reference
        states = reference if self.scales is None else reference / self.scales.states
        rates = np.einsum("qm,jma->jqa", self.basis.slope, self._local(states))  # h v' at the Gauss points
        size = float(np.sum(self.basis.weights[:, None] * rates**2 / self._h[:, None, None]))
        shares = np.einsum("q,qm,jqa->jma", self.basis.weights, self.basis.value, rates)
        row = np.zeros((self.nodes.size, self._n))
        np.add.at(row, self._by_interval, shares)
        self._phase = np.zeros(self.size)
        self._phase[: self.state_size] = row.ravel() / (size or 1.0)

    # --- the discrete equations ----------------------------------------------------------------------------------

    def residual(self, x: Array) -> Array:
        """Return the residual of the discrete equations at x, the phase condition last."""
        return np.append(super().residual(x), self._phase @ x)

    def linearize(
        self, x: Array, rows: Sequence[Array] | Array = (), columns: Sequence[Array] | Array = ()
    ) -> tuple[Array, Factors]:
        """Return the residual at x, and the factored matrix [[F_x, columns^T], [rows]]; see ``Collocation.linearize``."""
        rows = np.array(rows, dtype=float).reshape(-1, self.size + len(columns))
        columns = np.array(columns, dtype=float).reshape(-1, self.equations)
        phase = np.concatenate([self._phase, columns[:, -1]])
        residual, blocks = self._blocks(x, np.vstack([phase, rows]), np.ascontiguousarray(columns[:, :-1]))
        return np.append(residual, self._phase @ x), Factorization(self._layout, blocks)

    def parameter_columns(self, x: Array, names: Sequence[str]) -> Array:
        """Return the derivatives of the residual by any parameters, shape (equations, len(names))."""
        columns = super().parameter_columns(x, names)
        return np.vstack([columns, np.zeros(columns.shape[1])])

    def transposed_product(self, x: Array, w: Array) -> Array:
        """Return F_x^T w, shape (size,)."""
        product: Array = super().transposed_product(x, w[:-1]) + w[-1] * self._phase
        return product

    # --- columns -------------------------------------------------------------------------------------------------

    def functionals(self, x: Array) -> Array:
        """Return the largest and smallest values of each state, then the means of the user's functionals."""
        states = self._dense(x)
        extremes = np.stack([states.max(axis=0), states.min(axis=0)], axis=1).ravel()
        return np.concatenate([extremes, super().functionals(x)]) if self.problem.means else extremes

    def _dense(self, x: Array) -> Array:
        """Return the states at places close to each other."""
        parts = 4 * self.degree
        t = (self.mesh[:-1, None] + self._h[:, None] * np.linspace(0, 1, parts, endpoint=False)).ravel()
        return self.evaluate(x, t)

    # --- stability -----------------------------------------------------------------------------------------------

    def jacobians_of_field(self, x: Array, states: Array) -> Array:
        """Return the derivatives of T F by the states, at scaled states (K, n) with the parameters of x; shape (K, n, n)."""
        n, colours = self._n, self.problem.batch("field").colouring([])
        times, p = np.zeros(len(states)), self._scaled_parameters(x)
        jacobians: Array = self._field.jacobian(times, states, np.empty((0, n)), p, colours)[1][:, :n, :n]
        return jacobians

    def _jacobian_of_field(self, x: Array) -> Array:
        """Return the same at the Gauss points, shape (N, d, n, n)."""
        return self.jacobians_of_field(x, self.at_gauss_points(x)).reshape(self.intervals, self._d, self._n, self._n)

    def rates(self, x: Array) -> Array:
        """Return u' at the nodes, scaled, shape (state_size,): the field there, which the collocated u' follows."""
        p, states = self._scaled_parameters(x), np.ascontiguousarray(self._scaled_states(x))
        values = self._field.values(np.zeros(len(states)), states, np.empty((0, self._n)), p)[:, : self._n]
        return np.asarray(values.ravel(), dtype=float)

    @property
    def by_interval(self) -> Indices:
        """Places of the nodes of each interval among all nodes, shape (N, d + 1)."""
        return self._by_interval

    @property
    def start_direction(self) -> Array:
        """The direction in which the reference leaves t = 0, scaled, shape (n,)."""
        first: Array = self.reference[1] - self.reference[0]
        if self.scales is not None:
            first /= self.scales.states
        return np.asarray(first / np.linalg.norm(first), dtype=float)

    def interval_matrices(self, x: Array) -> Array:
        """Return the linearized collocation equations of each interval, shape (N, d n, (d + 1) n)."""
        return self._interval_matrices(self._jacobian_of_field(x))

    def _interval_matrices(self, jacobian: Array) -> Array:
        n, d, N = self._n, self._d, self.intervals
        matrix: Array = np.einsum("qm,ab->qamb", self.basis.slope, np.eye(n))[None] - np.einsum(
            "j,qm,jqab->jqamb", self._h, self.basis.value, jacobian
        )
        return matrix.reshape(N, d * n, (d + 1) * n)

    def _transitions(self, jacobian: Array) -> Array:
        """Return the matrix that takes a perturbation over each interval, shape (N, n, n), from `_jacobian_of_field`."""
        n = self._n
        matrix: Any = self._interval_matrices(jacobian)
        result: Array = np.linalg.solve(matrix[:, :, n:], -matrix[:, :, :n])[:, -n:]
        return result

    def eigenvalues(self, x: Array) -> ComplexArray:
        """Return the logarithms of the Floquet multipliers, shape (n,): those with a positive real part are unstable."""
        key = x.tobytes()
        if key not in self._known:
            if len(self._known) > _KEPT:
                self._known.clear()
            jacobian = self._jacobian_of_field(x)
            values = log_eigenvalues(self._transitions(jacobian))
            total = float(self._quadrature @ np.trace(jacobian, axis1=2, axis2=3).ravel())
            least = values.real <= values.real.min() + _EQUAL
            if not least[np.abs(values).argmin()]:  # where the smallest is 1, its error shall show
                # by Liouville's formula: over one interval a Gauss method takes e^-1000 for a number near one
                values[least] += (total - values.real.sum()) / np.count_nonzero(least)
            self._known[key] = values
        return self._known[key]

    def crossing(self, x: Array, frequency: float) -> tuple[str, str] | None:
        """Return label and name of a point where multipliers exp(+- i frequency) cross the unit circle.

        None where the pair may be a double multiplier 1 (at a fold): an error e of the one that is 1 splits it by sqrt(e).
        """
        trivial = float(np.abs(np.expm1(self.eigenvalues(x))).min())
        if frequency**2 < _SPLIT * trivial:
            return None
        return ("PD", "period doubling") if abs(frequency - math.pi) < _OPPOSITE else ("TR", "torus")

    def has_shrunk(self, x: Array) -> bool:
        """Return whether an orbit is an equilibrium, up to the square root of round-off."""
        states = self._scaled_states(x)
        return bool(np.all(np.ptp(states, axis=0) <= _SHRUNK * (1 + np.abs(states).max(axis=0))))

    def amplitude(self, x: Array) -> float:
        """Return the size of an orbit as a part of that of the reference; negative where the orbit is half a period later.

        It is the product of both, without their means, over that of the reference with itself.
        """
        weights = self.weights[: self.state_size : self._n]
        reference = self.reference - weights @ self.reference
        states = self.states(x)
        product = np.einsum("k,ka,ka->", weights, reference, states - weights @ states)
        return float(product / np.einsum("k,ka,ka->", weights, reference, reference))

    # --- meshes and references -----------------------------------------------------------------------------------

    def _with(self, **changes: Any) -> CycleCollocation:
        other: Any = super()._with(**changes)
        same = np.array_equal(other.mesh, self.mesh)
        other._set_reference(self.reference if same else self._between(self.reference, other.nodes))
        found: CycleCollocation = other
        return found

    def _between(self, states: Array, times: Array) -> Array:
        """Return states at the nodes, in the user's units, carried to other times."""
        x = np.concatenate([(states if self.scales is None else states / self.scales.states).ravel(), np.zeros(len(self.free))])
        return self.evaluate(x, times)

    def with_reference(self, x: Array) -> CycleCollocation:
        """Return the same with the orbit x as the reference.

        Raises
        ------
        ProblemError
            It is constant.
        """
        states = self.states(x)
        if not np.ptp(states, axis=0).any():
            raise ProblemError("guess: it is constant; a cycle needs a guess that goes round")
        other = self._with()
        other._set_reference(states)
        return other

    def adapted(self, x: Array, control: MeshControl) -> tuple[Collocation, Carrier] | None:
        """Return the same on a better mesh for x and with x as the reference; None where there is no need."""
        mesh = adapted_mesh(self.basis, self.mesh, self._scaled_states(x), control) if control.every else None
        if mesh is None:
            states = self.states(x)
            if np.abs(states - self.reference).max() <= _MOVED * np.abs(states).max():
                return None
        other = self._with(mesh=self.mesh if mesh is None else mesh)
        other._set_reference(self._between(self.states(x), other.nodes))
        return other, self.carrier(other)
