"""Collocation of connecting orbits: projection conditions at the ends, and a phase condition."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from contin.arrays import Array
from contin.discretization.collocation import Collocation
from contin.discretization.conditions import Conditioned
from contin.discretization.mesh import MeshControl, adapted_mesh
from contin.discretization.protocol import Carrier
from contin.discretization.scales import Scales
from contin.errors import ConvergenceError
from contin.problems.connection import ConnectionProblem

#: The references are renewed where an orbit differs from the one they were taken at by more than this part of its size.
_MOVED = 1e-6
#: Length of a central difference of invariant subspaces by a parameter, relative to 1 + its size. What it multiplies is the
#: small distance of an end from its equilibrium.
_DIFFERENCE = 1e-6


class ConnectionCollocation(Conditioned):
    """A `ConnectionProblem` on a mesh.

    The conditions beyond collocation are rows of their own,

        [ collocation              ]        L spans the left eigenvectors of the first equilibrium e whose eigenvalues are
        [ F(e) = 0, F(e') = 0      ]        stable, so u(0) - e lies in the tangent plane of its unstable manifold; L' spans
        [ L (u(0) - e)             ]        those of the last equilibrium e' whose eigenvalues are unstable.
        [ L' (u(1) - e')           ]
        [ integral of (u - v) . v' ]        v is an earlier orbit of the run.

    L is normalized to L Q^T = I, with an orthonormal basis Q of an earlier L, so that it changes smoothly.

    Attributes
    ----------
    reference : ndarray, shape (size,)
        The vector of unknowns at which v and Q were taken; empty where `with_reference` was not called.
    """

    problem: ConnectionProblem

    def __init__(
        self, problem: ConnectionProblem, mesh: Sequence[float] | Array, degree: int, free: Sequence[str],
        parameters: Mapping[str, float], scales: Scales | None = None,
    ) -> None:  # fmt: skip
        super().__init__(problem, mesh, degree, free, parameters, scales)
        self._further = sum(problem.conditions) + 1
        self.equations = self._conditions + self._further
        self.reference: Array = np.empty(0)

    def with_reference(self, x: Array) -> ConnectionCollocation:
        """Return the same with v and Q of the orbit x."""
        other = self._with()
        other.reference = np.array(x)
        other._phase = other.phase_row(other._scaled_states(x))
        other._target = float(other._phase @ x)
        other._bases = tuple(_orthonormal(left) for left in other._left_vectors(other.all_parameters(x)[None], None)[0])
        return other

    _phase: Array
    _target: float
    _bases: Any

    # --- the conditions at the ends ------------------------------------------------------------------------------

    @property
    def _sizes(self) -> Array:
        return np.ones(self._n) if self.scales is None else self.scales.states

    def _places(self, p: Array) -> list[Array]:
        """Return the coordinates of the first and of the last equilibrium in the user's units, shape (m, n) each."""
        n, names = self._n, list(self.problem.parameters)
        first = names.index(self.problem.multipliers[0])
        last = first if self.problem.homoclinic else first + n
        return [p[:, place : place + n] for place in (first, last)]

    def _jacobian_at(self, place: Array, p: Array) -> Array:
        """Return the derivatives of the field by the states at one place, scaled, for values of all parameters."""
        batch, n, sizes = self.problem.batch("vector field"), self._n, self._sizes
        jacobian: Array = batch.jacobian(np.zeros(1), place[None], np.empty((0, n)), p, batch.columns([]))[1][0, :, :n]
        return jacobian * sizes / sizes[:, None]

    def _left_vectors(self, p: Array, bases: Any) -> list[list[Array]]:
        """Return [L, L'] for each of the values of all parameters, p of shape (m, number of names)."""
        found = []
        for values, *places in zip(p, *self._places(p)):
            both = []
            for end, (place, count) in enumerate(zip(places, self.problem.conditions)):
                left = _left_subspace(self._jacobian_at(place, values), count, stable=end == 0)
                both.append(left if bases is None else np.linalg.solve(left @ bases[end].T, left))
            found.append(both)
        return found

    def _conditions_at_ends(self, x: Array, names: Sequence[str]) -> tuple[Array, Array, Array]:
        """Return the projection and phase conditions, their derivatives by the states, and by parameters."""
        p, n, places = self.all_parameters(x), self._n, self._indices(names)
        sizes = self._sizes
        steps = _DIFFERENCE * (1 + np.abs(p[places]))
        varied = np.repeat(p[None], 1 + 2 * len(names), axis=0)
        varied[1 + np.arange(len(names)), places] += steps
        varied[1 + len(names) + np.arange(len(names)), places] -= steps
        left = self._left_vectors(varied, self._bases)
        rest = [place[0] / sizes for place in self._places(p[None])]
        states = self._scaled_states(x)
        values, by_states = [], np.zeros((self._further, self.state_size))
        by_parameters = np.zeros((self._further, len(names)))
        row = 0
        for end, at in enumerate((0, self.state_size - n)):
            apart = states[-end] - rest[end]
            L = left[0][end]
            here = slice(row, row + len(L))
            values.append(L @ apart)
            by_states[here, at : at + n] = L
            for j, step in enumerate(steps):
                change = (left[1 + j][end] - left[1 + len(names) + j][end]) / (2 * step)
                by_parameters[here, j] = change @ apart
            own = self.problem.multipliers[:n] if end == 0 else self.problem.multipliers[-n:]
            for i, name in enumerate(own):
                if name in names:
                    by_parameters[here, list(names).index(name)] -= L[:, i] / sizes[i]
            row += len(L)
        values.append(np.array([self._phase @ x - self._target]))
        by_states[-1] = self._phase[: self.state_size]
        return np.concatenate(values), by_states, by_parameters

    def condition_values(self, x: Array) -> Array:
        """Return the projection and phase conditions."""
        return self._conditions_at_ends(x, ())[0]

    def conditions_with_rows(self, x: Array) -> tuple[Array, Array]:
        """Return these conditions and their derivatives by x."""
        values, by_states, by_parameters = self._conditions_at_ends(x, self.free)
        return values, np.hstack([by_states, by_parameters * self.free_scales])

    def condition_columns(self, x: Array, names: Sequence[str]) -> Array:
        """Return the derivatives of these conditions by any parameters."""
        return self._conditions_at_ends(x, names)[2]

    # --- for special points of homoclinic orbits -----------------------------------------------------------------

    def saddle_jacobian(self, x: Array) -> Array:
        """Return the derivatives of the field by the states at the first equilibrium, scaled, shape (n, n)."""
        p = self.all_parameters(x)
        return self._jacobian_at(self._places(p[None])[0][0], p)

    def apart(self, x: Array) -> tuple[Array, Array]:
        """Return u(0) - e and u(1) - e', scaled."""
        first, last = (place[0] / self._sizes for place in self._places(self.all_parameters(x)[None]))
        states = self._scaled_states(x)
        return states[0] - first, states[-1] - last

    def adjoint_at_ends(self, x: Array, w: Array) -> tuple[Array, Array]:
        """Return L^T w and L'^T w, of the entries of a left vector that belong to the projection conditions."""
        first, last = self._left_vectors(self.all_parameters(x)[None], self._bases)[0]
        own = w[-self._further :]
        return first.T @ own[: len(first)], last.T @ own[len(first) : len(first) + len(last)]

    # --- columns -------------------------------------------------------------------------------------------------

    @property
    def _integrated(self) -> tuple[str, ...]:
        """No functional is an integral."""
        return ()

    def functionals(self, x: Array) -> Array:
        """Return the gap: the largest distance of an end from its equilibrium, over the size of the orbit."""
        states, places = self.states(x), self._places(self.all_parameters(x)[None])
        apart = [float(np.abs(states[-end] - place[0]).max()) for end, place in enumerate(places)]
        return np.array([max(apart) / (float(np.ptp(states, axis=0).max()) or 1.0)])

    # --- meshes and references -----------------------------------------------------------------------------------

    def _with(self, **changes: Any) -> ConnectionCollocation:
        other: Any = super()._with(**changes)
        if self.reference.size and changes:
            other = other.with_reference(self._carried(other))
        found: ConnectionCollocation = other
        return found

    def _carried(self, other: Any) -> Array:
        """Return the reference as a vector of unknowns of another system of this problem."""
        states = self.evaluate(self.reference, other.nodes)
        names = list(self.problem.parameters)
        carried: Array = other.pack(states, dict(zip(names, self.all_parameters(self.reference))))
        return carried

    def adapted(self, x: Array, control: MeshControl) -> tuple[Collocation, Carrier] | None:
        """Return the same on a better mesh for x and with x as the reference; None where there is no need."""
        mesh = adapted_mesh(self.basis, self.mesh, self._scaled_states(x), control) if control.every else None
        if mesh is None and np.abs(x - self.reference).max() <= _MOVED * np.abs(x).max():
            return None
        renewed = self.with_reference(x)
        if mesh is None:
            return renewed, self.carrier(renewed)
        other = renewed._with(mesh=mesh)
        return other, self.carrier(other)


def _left_subspace(jacobian: Array, count: int, stable: bool) -> Array:
    """Return a basis (count, n) of the left eigenvectors with the ``count`` least (stable) or largest real parts.

    Raises
    ------
    ConvergenceError
        The equilibrium has not so many.
    """
    from scipy.linalg import schur  # type: ignore[import-untyped]  # .1 s; only this needs it

    if not np.all(np.isfinite(jacobian)):
        raise ConvergenceError("the Jacobian of the vector field at the equilibrium is not finite")
    rates = np.sort(np.linalg.eigvals(jacobian).real)
    n = len(rates)
    if count == 0:
        return np.empty((0, n))
    sign = 1.0 if stable else -1.0
    rates = rates if stable else -rates[::-1]
    bound = sign * (rates[count - 1] + rates[count]) / 2 if count < n else sign * np.inf
    chosen = (lambda re, im: re < bound) if stable else (lambda re, im: re > bound)
    _, vectors, found = schur(jacobian.T, sort=chosen)
    if found != count:
        raise ConvergenceError(f"the equilibrium has not {count} eigenvalues of one kind")
    return np.ascontiguousarray(vectors[:, :count].T)


def _orthonormal(left: Array) -> Array:
    """Return the orthonormal basis of the same space that is closest to a basis."""
    u, _, v = np.linalg.svd(left, full_matrices=False)
    found: Array = u @ v
    return found
