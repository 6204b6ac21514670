"""Collocation of connecting orbits: projection conditions at the ends, and a phase condition."""

from __future__ import annotations

import dataclasses
import functools
import math
from collections.abc import Callable, Sequence
from typing import Any, NamedTuple, Self

import numpy as np

from contin.arrays import Array, ComplexArray, Indices
from contin.boundary.system import Collocation
from contin.collocation.newton import Values
from contin.collocation.projection import Projections, projections
from contin.connections.branches import homoclinic_points, named, own_test_of
from contin.core.differences import Numbers, alike, classes, shares, subsets
from contin.core.trial import Event, Trial
from contin.defining.special_points import EventCurve
from contin.draws import generator
from contin.errors import ConvergenceError, ProblemError
from contin.events.arc import SpecialPoint
from contin.events.error import Solution
from contin.functions.origin import Place, not_finite
from contin.levels import APART
from contin.linalg.blocks import Factors, Share, share
from contin.linalg.orientation import oriented
from contin.problems.angles import WINDING, check_windings
from contin.problems.statement import TIME

#: What is computed when it is first asked for, and depends on the reference.
_OF_A_REFERENCE = ("_known", "_borders", "leading_pairs")


class SaddleSpectrum(NamedTuple):
    """Eigenvalues at the first equilibrium, the largest real part first, and both kinds of eigenvectors as columns."""

    values: ComplexArray
    right: ComplexArray
    left: ComplexArray

    def pair(self, at: int) -> tuple[ComplexArray, ComplexArray]:
        """Return the right and the left eigenvector of an eigenvalue, whose product is one."""
        right, left = self.right[:, at], self.left[:, at].conj()
        return right, left / (left @ right)


class ConnectionCollocation(Collocation):
    """A `ConnectionProblem` on a mesh.

    The conditions beyond collocation are rows of their own,

        [ collocation              ]        L spans the left eigenvectors of the first equilibrium e whose eigenvalues are
        [ F(e) = 0, F(e') = 0      ]        stable, so u(0) - e lies in the tangent plane of its unstable manifold; L' spans
        [ L (u(0) - e)             ]        those of the last equilibrium e' whose eigenvalues are unstable.
        [ L' (u(1) - e')           ]
        [ g(e)                     ]        of orbits to a saddle-node only; L and L' leave out its eigenvalue zero
        [ integral of (u - v) . v' ]        v is an earlier orbit of the run.

    L is normalized to L Q^T = I, with an orthonormal basis Q of an earlier L, so that it changes smoothly. With the Jacobian A
    at e, and the singular vectors b, c of the smallest singular value of an earlier one,

        [ A    b ] [ y ]   [ 0 ]
        [ c^T  0 ] [ g ] = [ 1 ],        which makes g zero where A is singular.

    - ``reference`` (ndarray, shape (size,)): The vector of unknowns at which v and Q were taken; empty where `with_reference`
      was not called.
    """

    problem: Any

    def _complete(self) -> None:
        check_windings(self.problem.angles, self.free, self._values)

    def _take_mesh(self, mesh: Array) -> None:
        super()._take_mesh(mesh)
        self.equations = self._conditions + int(sum(self.problem.conditions) + self.problem.saddle_node + 1)

    def _segments(self, numbers: int) -> Share:
        """Return two segments or more: what both ends tell of a long orbit does not say how far it is moved along itself.

        The point between them does.
        """
        return share(self.intervals, numbers, 2)

    def with_reference(self, x: Array) -> Self:
        """Return the same with v and Q of the orbit x."""
        return self._referring_to(x)

    def _refer(self, x: Array) -> None:
        for name in _OF_A_REFERENCE:
            vars(self).pop(name, None)
        self.reference = x.copy()
        self._phase = self.phase_row(self._scaled_states(x))
        self._target = float(self._phase @ x)
        p = self.all_parameters(x)
        if self._bases_at != (at := p.tobytes()):  # other meshes have the same
            both = [(len(left), *_singular(left)) for left in self._left_vectors(p)]  # the closest bases, orthonormal
            self._bases, self._bases_at = tuple(u @ v[:count] for count, u, v in both), at
            self._complements = [v[count:].T for count, _, v in both]  # orthonormal, too

    _phase: Array
    _target: float
    _bases: Any
    _bases_at = b""
    _complements: list[Array]

    @functools.cached_property
    def _borders(self) -> tuple[Array, Array]:
        """The singular vectors b and c at the reference."""
        left, right = _singular(self.saddle_jacobian(self.reference))
        return left[:, -1], right[-1]

    # --- the conditions at the ends ------------------------------------------------------------------------------

    @property
    def _ends_alike(self) -> bool:
        """Whether both ends have the same coordinates."""
        return bool(self.problem.homoclinic and not self.problem.angles)

    def _places(self, p: Array) -> list[Array]:
        """Return the coordinates of the first and of the last equilibrium in the user's units, shape (m, n) each."""
        n, first = self._n, list(self.problem.parameters).index(self.problem.multipliers[0])
        if not self.problem.homoclinic:
            return [p[:, place : place + n] for place in (first, first + n)]
        here = p[:, first : first + n]
        if self._ends_alike:
            return [here, here]
        gained, names = np.zeros((len(p), n)), list(self.problem.parameters)
        for name, period in self.problem.angles.items():
            gained[:, self.problem.state_names.index(name)] = period * p[:, names.index(WINDING + name)]
        return [here, here + gained]

    def _jacobians_at(self, places: Array, p: Array, directions: Sequence[Array] = ()) -> Array:
        """Return the derivatives of the field by the states at places, scaled, or theirs along directions of all inputs."""
        batch, n, sizes = self.problem.batch("vector field"), self._n, self.scales.states
        given = np.zeros(len(places)), places, np.empty((0, n)), p, batch.columns([])
        return batch.jacobian_along(*given, directions)[:, :n] * sizes / sizes[:, None]

    def _linear_at_ends(self, p: Array) -> list[_Linear]:
        """Return the linearized fields at both ends, once for values of all parameters; or raise ConvergenceError."""

        def made(place: Array) -> _Linear:
            (jacobian,) = self._jacobians_at(place, p)
            if not np.isfinite(jacobian).all():
                where = not_finite(Place(self.problem.batch("vector field"), 0.0, [*place[0], *p]))
                raise ConvergenceError(f"the Jacobian of the vector field at the equilibrium is not finite: {where}")
            return _Linear(jacobian)

        def both() -> list[_Linear]:
            first, last = self._places(p[None])
            known = made(first)
            return [known, known if last is first else made(last)]

        return self._once("linear", p, both)

    def _left_vectors(self, p: Array) -> list[Array]:
        """Return bases of the spaces of L and L' for values of all parameters, not normalized."""
        ends = enumerate(zip(self._linear_at_ends(p), self.problem.conditions))
        return [_left_subspace(linear.schur, count, stable=end == 0) for end, (linear, count) in ends]

    def _subspaces_along(self, p: Array, directions: Sequence[Array]) -> list[dict[Numbers, Array]]:
        """Return L, and then L', with their derivatives along directions of all parameters, for all subsets of the directions.

        L is where R = L A P vanishes, with P = I - Q^T L. The derivatives of the three factors are shared out in all ways. The
        unknown one, X, comes twice, X A P - L A Q^T X, and X Q^T = 0: X = Y N^T with the orthonormal N of the complement of Q
        leaves Sylvester's equation for Y.
        """
        found: list[dict[Numbers, Array]] = []
        numbers, same, field = subsets(len(directions)), classes(directions), dict[Numbers, Array]()
        for end, (Q, L, solve) in enumerate(self._subspaces(p)):
            if not (len(Q) and directions):
                found.append(dict.fromkeys(numbers, L))
                continue
            known: dict[Numbers, Array] = {(): L}
            field = field if field and self._ends_alike else self._jacobians_along(p, directions, end)
            for chosen in numbers[1:]:
                if alike(same, chosen) in known:
                    continue
                right: Any = sum(count * known[u] @ field[v] for count, (u, v) in shares(same, chosen, 2) if u != chosen)
                for count, (u, v, w) in shares(same, chosen, 3):
                    if chosen not in (u, w):
                        right = right - count * known[u] @ field[v] @ Q.T @ known[w]
                known[chosen] = solve(right)
            found.append({chosen: known[alike(same, chosen)] for chosen in numbers})
        return found

    def _subspaces(self, p: Array) -> list[tuple[Array, Array, Callable[[Array], Array]]]:
        """Return Q and L of both ends, and what solves X A P - L A Q^T X = -right for X, once for values of all parameters."""
        return self._once("subspaces", p, lambda: [self._subspace(p, end) for end in (0, 1)])

    def _subspace(self, p: Array, end: int) -> tuple[Array, Array, Callable[[Array], Array]]:
        linear, Q, N = self._linear_at_ends(p)[end], self._bases[end], self._complements[end]
        A, L = linear.jacobian, _normalized(_left_subspace(linear.schur, self.problem.conditions[end], stable=end == 0), Q)
        made = functools.cache(lambda: _sylvester(-(L @ A @ Q.T), N.T @ (A - A @ Q.T @ L) @ N))  # residuals need none
        return Q, L, lambda right: made()(-right @ N) @ N.T

    def _jacobians_along(self, p: Array, directions: Sequence[Array], end: int) -> dict[Numbers, Array]:
        """Return the Jacobian at the equilibrium of an end, and its derivatives along subsets of the directions.

        Of subsets that stand for the same directions only the first is there (`contin.core.differences.alike`).
        """
        place, same = self._places(p[None])[end], classes(directions)
        moves = [np.append(self._places(v[None])[end][0], v)[None] for v in directions]
        found = {
            chosen: self._jacobians_at(place, p, [moves[i] for i in chosen])[0]
            for chosen in subsets(len(directions))[1:]
            if alike(same, chosen) == chosen
        }
        return {(): self._linear_at_ends(p)[end].jacobian, **found}

    def _fold_along(self, p: Array, directions: Sequence[Array]) -> dict[Numbers, Array]:
        """Return g, shape (1,), with its derivatives along all subsets of the directions; of a saddle, shape (0,)."""
        numbers = subsets(len(directions))
        if not self.problem.saddle_node:
            return dict.fromkeys(numbers, np.empty(0))
        same = classes(directions)
        known = self._fold_vectors(self._jacobians_along(p, directions, 0), same)
        return {chosen: known[alike(same, chosen)][-1:] for chosen in numbers}

    def _fold_vectors(self, field: dict[Numbers, Array], same: Numbers) -> dict[Numbers, Array]:
        """Return (y, g), shape (n + 1,), with the derivatives that the Jacobian is given with."""
        n, (b, c) = self._n, self._borders
        matrix = np.block([[field[()], b[:, None]], [c[None], np.zeros((1, 1))]])
        known: dict[Numbers, Array] = {}
        for chosen in field:
            right: Array = np.zeros(n + 1)
            right[n] = not chosen
            for count, (u, v) in shares(same, chosen, 2):
                right[:n] -= count * field[u] @ known[v][:n] if u else 0.0
            known[chosen] = np.linalg.solve(matrix, right)
        return known

    def _conditions_at_ends(self, x: Array, names: Sequence[str]) -> tuple[Array, Array, Array]:
        """Return the projection, fold and phase conditions, their derivatives by the states, and by parameters."""
        p, places = self.all_parameters(x), self._indices(names)
        values, by_states = [], np.zeros((self._further, self.state_size))
        by_parameters = np.zeros((self._further, len(names)))
        if len(names):
            by_parameters[:-1] = self._by_parameters(x, p, self._unit_directions(places))
        for end, (here, at, L) in enumerate(self._end_places(self._subspaces_along(p, []))):
            values.append(L[()] @ self.apart(x)[end])
            by_states[here, at : at + self._n] = L[()]
        values.append(self._fold_along(p, [])[()])
        values.append(np.array([self._phase @ x - self._target]))
        by_states[-1] = self._phase[: self.state_size]
        return np.concatenate(values), by_states, by_parameters

    def _by_parameters(self, x: Array, p: Array, directions: Array) -> Array:
        """Return the derivatives of projection and fold conditions along directions (m, all parameters), as columns."""
        sizes, count, found = self.scales.states, len(directions), list[Array]()
        places, moves, same = self._places(p[None]), self._places(directions), self._ends_alike
        for end, ((Q, L, solve), apart) in enumerate(zip(self._subspaces(p), self.apart(x))):
            if not (end and same):
                fields = self._jacobians_at(np.repeat(places[end], count, axis=0), p, [np.hstack([moves[end], directions])])
            turned = [solve(each) for each in L @ fields @ (np.eye(self._n) - Q.T @ L)]
            found.append(np.column_stack([each @ apart for each in turned]) - L @ (moves[end] / sizes).T)
        if self.problem.saddle_node:
            found.append(np.column_stack([self._fold_along(p, [each])[0,] for each in directions]))
        return np.vstack(found)

    def _unit_directions(self, places: Indices) -> Array:
        """Return directions of all parameters, one for each of some of them, shape (m, number of names)."""
        return np.eye(len(self.parameters))[places]

    def _end_places(self, subspaces: list[dict[Numbers, Array]]) -> list[tuple[slice, int, dict[Numbers, Array]]]:
        """Return of both ends the rows of the projection conditions, the place of the states in x, and L with derivatives."""
        first, last = (len(known[()]) for known in subspaces)
        rows = slice(0, first), slice(first, first + last)
        return list(zip(rows, (0, self.state_size - self._n), subspaces))

    def _end_rows(
        self, x: Array, subspaces: list[dict[Numbers, Array]], states: Sequence[Array], parameters: Sequence[Array]
    ) -> Array:
        """Return the derivative of the projection conditions L (u - e) along directions of the states and of all parameters."""
        every, result = tuple(range(len(states))), []
        for end, (_, at, L) in enumerate(self._end_places(subspaces)):
            value = L[every] @ self.apart(x)[end]
            for i in every:
                change = states[i][at : at + self._n] - self._places(parameters[i][None])[end][0] / self.scales.states
                value = value + L[every[:i] + every[i + 1 :]] @ change
            result.append(value)
        return np.concatenate(result)

    def _directions_of(self, v: Array) -> tuple[Array, Array]:
        """Return a direction of x as one of the states and one of all parameters, in the user's units."""
        parameters = np.zeros(len(self.parameters))
        parameters[self._free] = v[self.state_size :] * self.free_scales
        return v[: self.state_size], parameters

    def along(self, x: Array, directions: Sequence[Array]) -> Array:
        """Return the derivative of F along several directions; the phase condition is linear."""
        states, parameters = zip(*(self._directions_of(v) for v in directions))
        p, every = self.all_parameters(x), tuple(range(len(directions)))
        rows = self._end_rows(x, self._subspaces_along(p, parameters), states, parameters)
        found = super().along(x, directions)
        found[self._conditions : -1] = np.append(rows, self._fold_along(p, parameters)[every])
        return found

    def bent(self, x: Array, w: Array, v: Array) -> Array:
        """Return the gradient of w.(F_x v); that of the conditions by the states at the ends, and by each free parameter."""
        result, w, p = super().bent(x, w, v), w[self._conditions :], self.all_parameters(x)
        states, along = self._directions_of(v)
        for here, at, L in self._end_places(self._subspaces_along(p, [along])):
            result[at : at + self._n] += w[here] @ L[0,]
        still = np.zeros(self.state_size)
        for place, unit in enumerate(self._unit_directions(self._free)):
            own = unit * self.free_scales[place]
            rows = self._end_rows(x, self._subspaces_along(p, [along, own]), [states, still], [along, own])
            result[self.state_size + place] += w[:-1] @ np.append(rows, self._fold_along(p, [along, own])[0, 1])
        return result

    def condition_values(self, x: Array) -> Array:
        """Return the projection, fold and phase conditions."""
        return self._conditions_at_ends(x, ())[0]

    def conditions_with_rows(self, x: Array) -> tuple[Array, Array]:
        """Return these conditions, and their derivatives by x."""
        values, by_states, by_parameters = self._conditions_at_ends(x, self.free)
        return values, np.hstack([by_states, by_parameters * self.free_scales])

    def parameter_columns(self, x: Array, names: Sequence[str]) -> Array:
        found = super().parameter_columns(x, names)
        found[self._conditions :] = self._conditions_at_ends(x, names)[2] * self.scales.parameters[self._indices(names)]
        return found

    # --- in one call of a kernel -----------------------------------------------------------------------------------

    @property
    def linear_conditions(self) -> tuple[Array, Array] | None:
        """The row of the phase condition, and its value, behind zeros for the projections; None for orbits to saddle-nodes."""
        if self.problem.saddle_node:
            return None
        rows, targets = np.zeros((self._further, self.size)), np.zeros(self._further)
        rows[-1], targets[-1] = self._phase, self._target
        return rows, targets

    @property
    def projections(self) -> Projections:
        """The room in which a kernel evaluates them."""
        field, every = self._batch("vector field", ("states",)), np.diag(self.scales.parameters)
        columns, places = field.columns([]), [(place / self.scales.states).T for place in self._places(every)]
        return projections(field.load(columns), field.load(columns, 1), self.problem.conditions, places, self._free)

    def fill_conditions(self, values: Values) -> int:
        """Fill in also the spaces near which those of the projections are."""
        for end, basis, complement in zip(values.projections[1:3], self._bases, self._complements):
            end.frame[:] = np.vstack([basis, complement.T])
        return super().fill_conditions(values)

    # --- for special points of homoclinic orbits -----------------------------------------------------------------

    def saddle_jacobian(self, x: Array) -> Array:
        """Return the derivatives of the field by the states at the first equilibrium, scaled, shape (n, n)."""
        return self._linear_at_ends(self.all_parameters(x))[0].jacobian

    def saddle(self, x: Array) -> SaddleSpectrum:
        """Return eigenvalues and eigenvectors at the first equilibrium."""
        return self._once("saddle", self.all_parameters(x), lambda: _spectrum(self.saddle_jacobian(x)))

    @functools.cached_property
    def leading_pairs(self) -> list[list[ComplexArray]]:
        """The eigenvectors, right and left, of the leading stable and unstable eigenvalue at the reference, with one sign."""
        spectrum, unstable = self.saddle(self.reference), self.problem.unstable
        return [[oriented(vector) for vector in spectrum.pair(at)] for at in (unstable, unstable - 1)]

    def left_null_vector(self, x: Array, factors: Factors | None = None) -> Array:
        """Return w with w F_z = 0, of unit length, z all unknowns but the user's parameters, with the sign of the reference.

        ``factors`` are those of [F_x; row] at x, with any row, where they are at hand. For the reference those near it do: its
        vector gives the sign.
        """
        return self._once("left", x, lambda: self._left_null_vector(x, factors))

    def _left_null_vector(self, x: Array, factors: Factors | None) -> Array:
        """Return it from solutions of F_x^T y + rows^T m = e for the user's parameters, combined so that no row is left."""
        if factors is None:
            _, factors = self.linearize(x, generator("null").standard_normal((self.size - self.equations, self.size)))
        own = [name for name in self.free if name not in self.problem.multipliers]
        units = np.zeros((len(own), self.size))
        units[range(len(own)), [self.parameter_index(name) for name in own]] = 1.0
        found = factors.solve_transposed(units)
        left = _singular(found[:, self.equations :])[0][:, -1]
        w: Array = left @ found[:, : self.equations]
        is_reference = x is self.reference
        near = generator("null").standard_normal(w.size) if is_reference else self.left_null_vector(self.reference, factors)
        return w * (math.copysign(1.0, w @ near) / np.linalg.norm(w))

    def slow_motion(self, x: Array) -> tuple[Array, float]:
        """Return p and a of a saddle-node: its slow motion is c' = a c^2, with c = p.(u - e) and p.q = 1, |q| = 1.

        p and q are the left and right eigenvectors of the eigenvalue zero.
        """
        values, (b, c) = self.all_parameters(x), self._borders
        bordered = np.block([[self.saddle_jacobian(x), b[:, None]], [c[None], np.zeros((1, 1))]])
        unit = np.append(np.zeros(self._n), 1.0)
        q, p = (np.linalg.solve(matrix, unit)[:-1] for matrix in (bordered, bordered.T))
        q /= np.linalg.norm(q)
        bent = self._bent_jacobians(values, q[None], 0)[0] @ q
        return p / (p @ q), float(p @ bent / (p @ q)) / 2

    def cut_off_errors(self, x: Array, factors: Factors) -> Array:
        """Return what the ends on tangent planes, in place of the manifolds, change, a row for each projection condition.

        In the plane N z at an end the manifold is L (u - e) = H (z, z) + ..., with

            H (K x I + I x K) - M H = L B(N, N) / 2,        A N = N K,  L A = M L,

        B the second derivatives, z = C^T (u - e) for C normal to the space of the reference. Each condition is changed by that,
        and by an estimate of the next term: the third power of the distance over the square of the orbit's size.
        """
        p, size = self.all_parameters(x), float(np.ptp(self._scaled_states(x), axis=0).max()) or 1.0
        amounts: list[float] = []
        for end, ((Q, L, _), C, apart) in enumerate(zip(self._subspaces(p), self._complements, self.apart(x))):
            if not len(L):
                continue
            A, N, z = self._linear_at_ends(p)[end].jacobian, C - Q.T @ (L @ C), C.T @ apart
            sums, bent = (C.T @ A @ N)[:, None, :, None] * np.eye(len(z))[:, None], L @ self._bent_jacobians(p, N.T, end) @ N
            sums = (sums + sums.transpose(1, 0, 3, 2)).reshape(z.size**2, -1)  # as of np.kron, in a third of the time
            H = _sylvester(-L @ A @ Q.T, sums)(np.hstack([*bent]) / 2)
            amounts += [*(np.abs(H @ np.outer(z, z).ravel()) + float(np.linalg.norm(apart)) ** 3 / size**2)]
        right_sides = np.zeros((len(amounts), self.equations + 1))
        right_sides[range(len(amounts)), range(self._conditions, self._conditions + len(amounts))] = amounts
        return factors.solve(right_sides)

    def _bent_jacobians(self, p: Array, directions: Array, end: int) -> Array:
        """Return the derivatives of the Jacobian at an equilibrium along directions (k, n) of the states, all scaled."""
        moved, names = np.zeros((len(directions), len(self.parameters))), self.problem.multipliers
        own = names[: self._n] if end == 0 or self.problem.homoclinic else names[self._n :]
        moved[:, self._indices(own)] = directions * self.scales.states
        places = np.repeat(self._places(p[None])[end], len(directions), axis=0)
        return self._jacobians_at(places, p, [np.hstack([self._places(moved)[end], moved])])

    def apart(self, x: Array) -> tuple[Array, Array]:
        """Return u(0) - e and u(1) - e', scaled."""
        first, last = (place[0] / self.scales.states for place in self._places(self.all_parameters(x)[None]))
        states = self._scaled_states(x)
        return states[0] - first, states[-1] - last

    def adjoint_at_ends(self, x: Array, w: Array) -> tuple[Array, Array]:
        """Return L^T w and L'^T w, of the entries of a left vector that belong to the projection conditions."""
        (_, first, _), (_, last, _) = self._subspaces(self.all_parameters(x))
        own = w[-self._further :]
        return first.T @ own[: len(first)], last.T @ own[len(first) : len(first) + len(last)]

    # --- columns -------------------------------------------------------------------------------------------------

    @property
    def integrated(self) -> tuple[str, ...]:
        """No functional is an integral."""
        return ()

    def functionals(self, x: Array) -> Array:
        """Return the gap: the largest distance of an end from its equilibrium, over the size of the orbit."""
        states, places = self.states(x), self._places(self.all_parameters(x)[None])
        apart = [float(np.abs(states[-end] - place[0]).max()) for end, place in enumerate(places)]
        return np.array([max(apart) / (float(np.ptp(states, axis=0).max()) or 1.0)])

    # --- what is known of its branches --------------------------------------------------------------------------

    def events(self) -> list[Event]:
        """Return those of special homoclinic orbits; those of a given time, and orbits between two equilibria, have none."""
        return homoclinic_points(self) if self.problem.homoclinic and TIME not in self.free else []

    def check_solution(self, x: Array) -> None:
        """Check that an orbit between two equilibria does not return to the first one; raise ProblemError otherwise."""
        problem = self.problem
        if problem.homoclinic:
            return
        count, names = len(problem.state_names), problem.multipliers
        first, last = (np.array([self.parameter(x, name) for name in part]) for part in (names[:count], names[count:]))
        if np.abs(first - last).max() <= APART * float(np.ptp(self.states(x), axis=0).max()):
            place = ", ".join(f"{name} = {value + 0.0:.6g}" for name, value in zip(problem.state_names, first))
            raise ProblemError(
                f"stable: both ends of the orbit are at the equilibrium {place}; leave out stable for a homoclinic orbit, or "
                f"give a guess of the last equilibrium ({', '.join(names[count:])})"
            )

    def defining(self, point: Solution, x: Array) -> tuple[EventCurve, Array] | None:
        """Return that of special homoclinic orbits."""
        test = own_test_of(point.label, self, x) if self.problem.homoclinic else None
        return None if test is None else (EventCurve(self, test), x)

    def events_on_curves(self) -> list[Event]:
        """Return those of homoclinic orbits that are special in another way, too."""
        return homoclinic_points(self)

    def judged_on_curve(self, point: SpecialPoint, solution: Trial) -> SpecialPoint:
        """Return neutral saddles and the like, by which of the leading eigenvalues are complex."""
        return named(point, solution)

    def judged(self, point: SpecialPoint) -> SpecialPoint:
        """Return neutral saddles, and the end of a curve, by which of the leading eigenvalues are complex."""
        return named(point)


def _spectrum(jacobian: Array) -> SaddleSpectrum:
    from scipy.linalg.lapack import dgeev  # type: ignore[import-untyped]  # .1 s; only this needs it

    real, imaginary, left, right, _ = dgeev(jacobian)
    order, both = np.argsort(-real), np.array([left, right], dtype=complex)
    for at in np.flatnonzero(imaginary > 0):  # the real and the imaginary part are two columns
        both[:, :, at] += 1j * both[:, :, at + 1]
        both[:, :, at + 1] = both[:, :, at].conj()
    return SaddleSpectrum((real + 1j * imaginary)[order], both[1][:, order], both[0][:, order])


def _singular(matrix: Array) -> tuple[Array, Array]:
    """Return the left singular vectors of a small matrix as columns, and the right ones as rows."""
    from scipy.linalg.lapack import dgesdd

    u, _, v, _ = dgesdd(matrix) if matrix.size else (np.eye(len(matrix)), None, np.eye(matrix.shape[1]), 0)
    return u, v


@dataclasses.dataclass(frozen=True, eq=False)
class _Linear:
    """The Jacobian at an equilibrium, and the Schur form of its transpose, made when first needed."""

    jacobian: Array

    @functools.cached_property
    def schur(self) -> _Schur:
        """v t v^T with orthogonal v and quasi-triangular t."""
        return _schur(self.jacobian.T)


class _Schur(NamedTuple):
    """A matrix as v t v^T, with orthogonal v and quasi-triangular t, and the real parts of its eigenvalues in their order."""

    t: Array
    v: Array
    rates: Array


def _schur(matrix: Array) -> _Schur:
    from scipy.linalg.lapack import dgees

    t, _, rates, _, v, _, _ = dgees(lambda *_: 0, matrix, sort_t=0)
    return _Schur(t, v, rates)


def _left_subspace(transposed: _Schur, count: int, stable: bool) -> Array:
    """Return a basis (count, n) of left eigenvectors of least (stable) or largest real parts; ConvergenceError for too few."""
    from scipy.linalg.lapack import dtrsen

    t, v, rates = transposed
    order = np.argsort(rates if stable else -rates, kind="stable")
    if count == 0:
        return np.empty((0, len(v)))
    if count < len(v) and rates[order[count - 1]] == rates[order[count]]:
        raise ConvergenceError(f"the equilibrium has not {count} eigenvalues of one kind")
    chosen = np.zeros(len(v), dtype=np.int32)
    chosen[order[:count]] = 1
    return np.ascontiguousarray(dtrsen(chosen, t, v, job="N")[1][:, :count].T)


def _sylvester(a: Array, b: Array) -> Callable[[Array], Array]:
    """Return what solves a X + X b = right for X, as SciPy's ``solve_sylvester`` does, with the Schur forms made once."""
    from scipy.linalg.lapack import dtrsyl

    if not (a.size and b.size):
        return lambda right: np.zeros((len(a), len(b)))
    (r, u, _), (s, v, _) = _schur(a), _schur(b.T)

    def solve(right: Array) -> Array:
        found, scale, _ = dtrsyl(r, s, u.T @ right @ v, tranb="C")
        return u @ (scale * found) @ v.T

    return solve


def _normalized(left: Array, basis: Array) -> Array:
    """Return the basis L of the space of ``left`` with L Q^T = I, for the basis Q of a space near by.

    Raises ConvergenceError where a direction of one space is orthogonal to the other one: L has no finite entries.
    """
    from scipy.linalg.lapack import dgesv

    if not len(left):
        return left
    *_, found, singular = dgesv(left @ basis.T, left)
    if singular:
        raise ConvergenceError("the eigenvectors of the equilibrium have turned by 90 degrees within one step")
    return np.ascontiguousarray(found)
