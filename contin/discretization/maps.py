"""Fixed points and cycles of maps, as the continuation sees them."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from contin.arrays import Array, ComplexArray
from contin.discretization.algebraic import Algebraic
from contin.discretization.cycles import is_opposite
from contin.discretization.multilinear import partitions, subsets
from contin.discretization.scales import Scales
from contin.functions.batch import Batch
from contin.problems.cycle import ROUNDS, rounds_of
from contin.problems.map import MapProblem

#: A fixed point of half of the rounds misses itself by less, relative to 1 + its states: the square root of round-off.
_SHRUNK = 1e-7
#: A multiplier of zero, of which the logarithm is taken.
_NO_MULTIPLIER = 1e-300


class MapSystem(Algebraic):
    """f(... f(u, p) ..., p) - u = 0; the derivatives are products of those of f. There are no scales.

    Raises
    ------
    ProblemError
        ``rounds`` is no whole number, or free.
    """

    problem: MapProblem
    #: As of cycles: no symmetry is declared, and the multipliers are those of all rounds.
    order = 1

    def __init__(
        self, problem: MapProblem, free: Sequence[str], parameters: Mapping[str, float] | None = None,
        scales: Scales | None = None,
    ) -> None:  # fmt: skip
        super().__init__(problem, free, parameters)
        self.rounds = rounds_of(self.free, dict(zip(problem.parameters, map(float, self.parameters))))

    @property
    def is_sparse(self) -> bool:
        """Never: products of sparse matrices are not."""
        return False

    def is_drifted(self, x: Array) -> bool:
        """Return whether the multipliers are in doubt: they never are."""
        return False

    def residual(self, x: Array) -> Array:
        """Return f(... f(u)) - u, shape (n,)."""
        return self._applied(x, self.rounds) - x[: self.state_size]

    def _applied(self, x: Array, rounds: int) -> Array:
        batch, p, none = self.problem.batch("map"), self.all_parameters(x), np.empty((0, self.state_size))
        states = x[None, : self.state_size]
        for _ in range(rounds):
            states = batch.values(np.zeros(1), states, none, p)
        found: Array = states[0]
        return found

    def _jacobian(self, x: Array) -> tuple[Array, Any]:
        """Return the residual and F_x, shape (n, size)."""
        return self.differentiated(x, self.free)

    def differentiated(self, x: Array, names: Sequence[str]) -> tuple[Array, Array]:
        """Return the residual, and its derivatives by the states and by these parameters."""
        batch, p, n = self.problem.batch("map"), self.all_parameters(x), self.state_size
        columns, none = batch.columns(self._indices(names)), np.empty((0, n))
        states, total = x[None, :n], np.eye(n, n + len(names))
        for _ in range(self.rounds):
            states, (jacobian,) = batch.jacobian(np.zeros(1), states, none, p, columns)
            total = jacobian[:, :n] @ total
            total[:, n:] += jacobian[:, n:]
        total[:, :n] -= np.eye(n)
        return states[0] - x[:n], total

    def along(self, x: Array, directions: Sequence[Array]) -> Array:
        """Return the derivative of F along several directions, shape (n,): the chain rule for every round.

        The derivative of f(u) along some of them is the sum over all ways to divide them into groups, of the derivative of f
        along those of u along each group.
        """
        batch, p, n = self.problem.batch("map"), self.all_parameters(x), self.state_size
        time, none, numbers = np.zeros(1), np.empty((0, n)), subsets(len(directions))
        of_states = {chosen: np.zeros((1, n)) for chosen in numbers}
        of_states[()] = x[None, :n]
        of_states |= {(i,): v[None, :n] for i, v in enumerate(directions)}
        for _ in range(self.rounds):
            still = np.zeros(self.size)
            wide = {
                chosen: self._wide(directions[chosen[0]] if len(chosen) == 1 else still, of_states[chosen])
                for chosen in numbers[1:]
            }
            of_states = {
                chosen: np.sum(
                    [
                        batch.along(time, of_states[()], none, p, [wide[group] for group in groups])
                        for groups in partitions(chosen)
                    ],
                    axis=0,
                )
                for chosen in numbers
            }
        found: Array = of_states[numbers[-1]][0]
        return found

    def bent(self, x: Array, w: Array, v: Array) -> Array:
        """Return the gradient of w.(F_x v), shape (size,): all rounds forwards, then back with multipliers of u and of v."""
        batch, p, n = self.problem.batch("map"), self.all_parameters(x), self.state_size
        columns, time, none = batch.columns(self._free), np.zeros(1), np.empty((0, n))
        states, tangent, rounds = x[None, :n], np.array(v), []
        for _ in range(self.rounds):
            after, (jacobian,) = batch.jacobian(time, states, none, p, columns)
            rounds.append((states, self._wide(tangent, tangent[None, :n]), jacobian))
            states, tangent = after, np.append(jacobian @ tangent, tangent[n:])
        of_state, of_tangent, by_parameters = np.zeros(n), np.array(w), np.zeros(self.size - n)
        for here, wide, jacobian in reversed(rounds):
            change = of_state @ jacobian + batch.bent(time, here, none, p, of_tangent[None], wide, columns)[0]
            of_state, of_tangent = change[:n], of_tangent @ jacobian[:, :n]
            by_parameters += change[n:]
        return np.append(of_state, by_parameters)

    @property
    def _evaluated(self) -> Sequence[Batch]:
        """The map."""
        return (self.problem.batch("map"),)

    def parameter_columns(self, x: Array, names: Sequence[str]) -> Array:
        """Return the derivatives of F by any parameters, free or not, shape (n, len(names))."""
        return self.differentiated(x, names)[1][:, self.state_size :]

    def jacobian(self, x: Array) -> Array:
        """Return F_u, shape (n, n)."""
        return self.differentiated(x, ())[1]

    def eigenvalues(self, x: Array) -> ComplexArray:
        """Return the logarithms of the multipliers, shape (n,): those with a positive real part are unstable."""
        values = np.linalg.eigvals(self.jacobian(x) + np.eye(self.state_size)).astype(complex)
        return np.log(np.where(np.abs(values) > _NO_MULTIPLIER, values, _NO_MULTIPLIER))

    def crossing(self, x: Array, frequency: float) -> tuple[str, str] | None:
        """Return label and name of a torus bifurcation; None near a double multiplier -1."""
        return None if is_opposite(frequency) else ("TR", "torus")

    def is_doubled(self, x: Array) -> bool:
        """Return whether a cycle goes twice round one of half its rounds, up to the square root of round-off."""
        states = x[: self.state_size]
        if self.rounds % 2:
            return False
        return bool(np.all(np.abs(self._applied(x, self.rounds // 2) - states) <= _SHRUNK * (1 + np.abs(states))))

    def doubled(self, x: Array) -> tuple[MapSystem, Array]:
        """Return the same problem with twice the rounds, and x for it."""
        other = self.with_parameters({ROUNDS: 2.0 * self.rounds})
        assert isinstance(other, MapSystem)
        return other, x

    def with_scales(self, x: Array, states: Array, parameters: Array) -> tuple[MapSystem, Array]:
        """Return the same."""
        return self, x
