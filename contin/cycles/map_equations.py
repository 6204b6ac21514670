"""Fixed points and cycles of maps, as the continuation sees them."""

from __future__ import annotations

import functools
from collections.abc import Mapping, Sequence
from typing import Any, Self

import numpy as np

from contin.arrays import Array, ComplexArray, Mask
from contin.core.spectral import Eigenvalues, on_circle
from contin.cycles.equations import OfCycles, is_pair
from contin.cycles.normal_forms import MOST, MapForm
from contin.equilibria.equations import Algebraic
from contin.events.arc import SpecialPoint
from contin.events.dips import NO_MULTIPLIER
from contin.events.normal_forms import Coefficient, at_special_point
from contin.functions.batch import Batch, Piecewise
from contin.levels import DOUBLED
from contin.linalg.blocks import MANY
from contin.linalg.periodic import log_eigenvalues
from contin.problems.angles import check_windings, gain, whole_rounds, windings
from contin.problems.statement import ROUNDS, rounds_of


class MapSystem(OfCycles, Algebraic):
    """Cycles u_1 ... u_k of a map: f(u_j, p) - u_(j+1) = 0, with u_(k+1) = u_1. There are no scales.

    All points are unknowns, so that the equations are as nonlinear as f, and not as f applied k times: other cycles, which may
    come as near to one point of a cycle as there are numbers, are apart in some of the others, and round-off of the residual is
    that of f. The matrix is

                             u_1    u_2    ...    u_k     p
                          [  A_1    -1                   B_1  ]
                          [         A_2    -1            B_2  ]        A_j, B_j: derivatives of f at u_j by u and p
                          [               ...    -1      ...  ]
                          [  -1                  A_k     B_k  ]

    Angles gain whole rounds, u_(k+1) = u_1 + `gain`. Columns are those of u_1; the norm is the root mean square over the cycle.
    Raises ProblemError where ``rounds`` is no whole number, or free.
    """

    problem: Any
    gain: Array
    #: As of cycles: no symmetry is declared, and the multipliers are those of all rounds; none of them is always 1.
    order, autonomous = 1, False

    def _complete(self) -> None:
        problem, values = self.problem, self._values
        self.rounds = rounds_of(self.free, values)
        check_windings(problem.angles, self.free, values)
        #: What the angles gain over the cycle, shape (n,).
        self.gain = gain(problem.angles, problem.state_names, values)
        self._n = self.state_size
        self.state_size = self.equations = self._n * self.rounds
        self.size = self.state_size + len(self.free)
        self.weights = np.append(np.full(self.state_size, 1 / self.rounds), np.ones(len(self.free)))

    @property
    def nodes(self) -> Array:
        """The number of each point of the cycle over that of all, shape (rounds,)."""
        return np.arange(self.rounds) / self.rounds

    @property
    def is_sparse(self) -> bool:
        """The matrix is kept sparse: the cycle is long, and few of the entries are not zero."""
        return self.state_size >= MANY and self.rounds >= MANY // self._n

    # --- states --------------------------------------------------------------------------------------------------

    def states(self, x: Array) -> Array:
        """Return the points of the cycle, shape (rounds, n), a view of x."""
        return self._scaled_states(x)

    def pack(self, states: object, values: Mapping[str, float]) -> Array:
        """Return a vector of unknowns from all points of a cycle, or from one of them, to which the map is applied."""
        states = np.asarray(states, dtype=float).reshape(-1, self._n)
        if len(states) == self.rounds:
            return super().pack(states, values)
        x = np.concatenate([np.tile(states[0], self.rounds), [float(values[name]) for name in self.free]])
        with np.errstate(all="ignore"):
            for at in range(1, self.rounds):
                following = self._images(x, self.states(x)[at - 1 : at])
                if not np.isfinite(following).all():
                    break  # it runs away: the rest stays where it began
                self.states(x)[at] = following
        return x

    # --- the equations -------------------------------------------------------------------------------------------

    _functions = ("map",)

    @functools.cached_property
    def _residual(self) -> Any:
        """The map; where outcomes are frozen, those of each point."""
        return self._frozen("map", self.problem.batch("map"))

    def _frozen(self, name: str, batch: Batch, which: int = 0) -> Any:
        if not self.sides.size:
            return batch
        every = [batch.frozen(self._free, sides)[which] for sides in self.sides.reshape(self.rounds, -1)]
        return every[0] if self.rounds == 1 else Piecewise(every, range(self.rounds))

    @functools.cached_property
    def _decided(self) -> list[tuple[str, int]]:
        """Those of the map at each point."""
        return [("map", at) for at in self.problem.batch("map").conditions(self._free)] * self.rounds

    def written(self, k: int, side: float) -> str:
        """Return what the user has written for a condition and, where there are several points, at which it is."""
        return super().written(k, side) + (f" at point {k * self.rounds // self.conditions + 1}" if self.rounds > 1 else "")

    def numbers(self, x: Array) -> tuple[Array, Array]:
        """Return the numbers that decide at all points, and their derivatives by x."""
        ((_, deciding),) = self._deciding
        values, slopes = deciding.jacobian(*self._terms[0].inputs(x), deciding.columns(self._free))
        found, n = np.zeros((*values.shape, self.size)), self._n
        found[..., self.state_size :] = slopes[:, :, n:]
        for at, each in enumerate(slopes):
            found[at, :, at * n : (at + 1) * n] = each[:, :n]
        return values.ravel(), found.reshape(-1, self.size)

    def _by_x(self, slopes: Array) -> Array:
        first, last = slopes[:, : self._n].ravel(), np.add.reduce(slopes[:, self._n :])
        return np.concatenate([first, np.zeros(self.state_size - first.size), last])

    def _images(self, x: Array, states: Array) -> Array:
        """Return f at states (K, n), shape (K, n)."""
        return self.problem.batch("map").values(np.zeros(len(states)), states, self._none, self.all_parameters(x))

    def _missed(self, x: Array, images: Array) -> Array:
        """Return f(u_j) - u_(j+1), shape (equations,), of the images f(u_j); the last one gains whole rounds of angles."""
        gaps = images - np.roll(self.states(x), -1, axis=0)
        gaps[-1] -= self.gain
        return gaps.ravel()

    def lifted(self, x: Array, reference: Array) -> Array:
        """Return x with angles moved by whole rounds, so that those of the first point are nearest to those of a reference."""
        if not self.circles.any():
            return x
        moved = x.copy()
        self.states(moved)[0] += whole_rounds(self.states(reference)[0] - self.states(x)[0], self.circles)
        moved = self.continuous(moved)
        # y' = y + ..., x' = x + y' of a standard map: one round more of y changes what x gains, and is another cycle here
        return x if whole_rounds(self.gained(moved) - self.gain, self.circles).any() else moved

    def moved(self, x: Array, shift: int) -> Array:
        """Return a cycle that begins with a later point."""
        moved = x.copy()
        states = self.states(x)
        self.states(moved)[:] = np.concatenate([states[shift:], states[:shift] + self.gain])
        return moved

    def continuous(self, x: Array) -> Array:
        """Return x with angles moved by whole rounds, so that each point is nearest to the image of the one before."""
        x = x.copy()
        states = self.states(x)
        for at in range(1, self.rounds):
            states[at] += whole_rounds(self._images(x, states[at - 1 : at])[0] - states[at], self.circles)
        return x

    def with_rounds_of(self, x: Array, given: Mapping[str, float]) -> tuple[Self, Array]:
        """Return the system with the winding numbers that x has, unless they are given, and a continuous x."""
        if not self.circles.any():
            return self, x
        x = self.continuous(x)
        read = windings(self.problem.angles, self.problem.state_names, self.gained(x))
        other: Any = self.with_parameters({name: given.get(name, value) for name, value in read.items()})
        return other, x

    def gained(self, x: Array) -> Array:
        """Return the image of the last point less the first one, shape (n,)."""
        states = self.states(x)
        return np.asarray(self._images(x, states[-1:])[0] - states[0])

    def residual(self, x: Array) -> Array:
        """Return f(u_j) - u_(j+1), shape (equations,)."""
        return self._missed(x, self._terms[0].batch.values(*self._terms[0].inputs(x)))

    def _derivatives(self, x: Array, names: Sequence[str]) -> tuple[Array, Array]:
        """Return f at all points, (rounds, n), and its derivatives by states and these parameters."""
        return self._residual.jacobian(*self._terms[0].inputs(x), self._residual.columns(self._indices(names)))

    def _jacobian(self, x: Array) -> tuple[Array, Any]:
        """Return the residual and F_x, a sparse array where `is_sparse`."""
        return self.differentiated(x, self.free)

    def differentiated(self, x: Array, names: Sequence[str]) -> tuple[Array, Any]:
        """Return the residual, and its derivatives by the states and by these parameters."""
        n, k, size = self._n, self.rounds, self.state_size
        values, jacobians = self._derivatives(x, names)
        residual = self._missed(x, values)
        at = np.arange(size).reshape(k, n)
        following = np.roll(at, -1, axis=0)
        if not self.is_sparse:
            matrix = np.zeros((size, size + len(names)))
            matrix[at[:, :, None], at[:, None, :]] = jacobians[:, :, :n]
            matrix[at, following] -= 1.0
            matrix[:, size:] = jacobians[:, :, n:].reshape(size, -1)
            return residual, matrix
        from scipy.sparse import csr_array  # type: ignore[import-untyped]  # .1 s; only long cycles need it

        rows = np.broadcast_to(at[:, :, None], jacobians.shape)
        of_parameters = np.broadcast_to(size + np.arange(len(names)), (k, n, len(names)))
        columns = np.concatenate([np.broadcast_to(at[:, None, :], (k, n, n)), of_parameters], axis=2)
        entries = np.append(jacobians.ravel(), np.full(size, -1.0))
        places = np.append(rows.ravel(), at.ravel()), np.append(columns.ravel(), following.ravel())
        return residual, csr_array((entries, places), shape=(size, size + len(names)))

    def stack_along(self, x: Array, directions: Sequence[Array]) -> Array:
        """Return the derivative of F along several stacks of directions: f at every point; the rest is linear."""
        found = super().stack_along(x, directions)
        return found - np.roll(directions[0][:, : self.state_size], -self._n, axis=1) if len(directions) == 1 else found

    def transitions(self, x: Array) -> Array:
        """Return the derivatives of f by the states at all points, shape (rounds, n, n)."""
        return self._derivatives(x, ())[1]

    def jacobian(self, x: Array) -> Array:
        """Return F_u, shape (equations, equations)."""
        matrix = self.differentiated(x, ())[1]
        return matrix.toarray() if self.is_sparse else matrix

    # --- stability -----------------------------------------------------------------------------------------------

    def spectra(self, places: Sequence[Array]) -> list[Eigenvalues]:
        """Return the logarithms of the multipliers at places: those with a positive real part are unstable."""

        def settled(x: Array, values: ComplexArray) -> ComplexArray:
            return np.where(on_circle(self._logarithms, x, values) & is_pair(values), 1j * values.imag, values)

        found = [(x, self._logarithms(x)) for x in places]
        return [Eigenvalues(values, functools.partial(settled, x, values)) for x, values in found]

    def neutral(self, x: Array) -> Mask:
        """Return which multipliers lie on the unit circle up to round-off, shape (n,)."""
        return on_circle(self._logarithms, x, self.computed_eigenvalues(x))

    def _logarithms(self, x: Array) -> ComplexArray:
        """Return the logarithms of the multipliers as they are computed."""
        values = log_eigenvalues(self.transitions(x))
        values.real = np.maximum(values.real, np.log(NO_MULTIPLIER))
        return values

    def is_symmetric(self, x: Array) -> bool:
        """Return False: F_u couples the points of a cycle."""
        return False

    def is_doubled(self, x: Array) -> bool:
        """Return whether a cycle goes twice round one of half its rounds, up to the square root of round-off."""
        if self.rounds % 2:
            return False
        first, second = np.split(self.states(x), 2)
        apart = second - first
        apart = apart - whole_rounds(apart, self.circles)
        return bool(np.all(np.abs(apart) <= DOUBLED * (1 + np.abs(first))))

    def doubled(self, x: Array) -> tuple[Self, Array]:
        """Return the same problem with twice the rounds, and x for it."""
        values = dict(zip(self.problem.parameters, self.all_parameters(x)))
        other: Any = self.with_parameters({ROUNDS: 2.0 * self.rounds})
        states = self.states(x)
        return other.with_rounds_of(other.pack(np.concatenate([states, states + self.gain]), values), {})

    def with_scales(self, x: Array, states: Array, parameters: Array) -> tuple[Self, Array]:
        """Return the same."""
        return self, x

    # --- what is known of its branches --------------------------------------------------------------------------

    @property
    def small_equations(self) -> Any:
        """The map, where it is one at all points."""
        return self._residual if type(self) is MapSystem and isinstance(self._residual, Batch) else None

    def form(self, x: Array) -> MapForm:
        """Return that of a cycle of the map."""
        return MapForm(self, x)

    def coefficient(self, point: SpecialPoint) -> Coefficient | None:
        """Return those of folds, period doublings and torus bifurcations; None of very long cycles."""
        return None if self.state_size > MOST else at_special_point(self, point)

    def in_phase(self, x: Array, vectors: Sequence[Array], reference: Array) -> tuple[Array, list[Array]]:
        """Return a cycle of a map, which may begin with any of its points, and vectors at it, to lie closest to another one."""

        def apart(shift: int) -> float:
            return float(self.weights @ (self.lifted(self.moved(x, shift), reference) - reference) ** 2)

        nearest = min(range(self.rounds), key=apart) if self.rounds > 1 else 0
        turned = [vector.copy() for vector in vectors]
        for vector in turned:
            self.states(vector)[:] = np.roll(self.states(vector), -nearest, axis=0)
        return self.lifted(self.moved(x, nearest), reference), turned
