"""Factorization of a collocation step whose states fall into components: they meet at the ends of the mesh and in parameters.

Equations of one component contain its own states only, as those of several strips that are joined at their ends. Each component
is condensed by itself (`contin.linalg.condensation`), so that the work grows as their number, and what is left is small. With C
the collocation rows of a component, P their slopes by parameters, and N an orthonormal complement of the rows R that
condensation leaves of C between both ends::

        x          beta   parameters
    [   C                 P           ]   [ b ]
    [   N (ends)   -I                 ] = [ 0 ]       x = y + W z,   z = (beta of all components, parameters)
    [   rows              corner      ]   [ c ]

K = [C; N] is as well conditioned as the differential equation allows: it fixes what R leaves open at the ends, and no more.
Then y = K^-1 [b; 0], W has the columns K^-1 [0; I] and -K^-1 [P; 0], and (rows W + corner) z = c - rows y is a dense system
with as many unknowns as there are states and parameters. Rows are boundary and integral conditions, and those around F_x.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from contin.arrays import Array, Indices, Pattern
from contin.linalg.blocks import Blocks, Layout, layout, share
from contin.linalg.condensation import Factorization
from contin.linalg.elimination import factorize
from contin.linalg.matrices import DenseFactors


class Component(NamedTuple):
    """States that depend on each other, in their own order, and how their block is eliminated."""

    states: Indices
    layout: Layout


def components(depends: Pattern, degree: int) -> list[Component]:
    """Return the weakly connected components of a dependency graph of states (see `layout`), in the order of their states.

    Examples
    --------
    >>> pattern = np.array([[1, 0, 1], [0, 1, 0], [0, 0, 1]], dtype=bool)
    >>> [component.states.tolist() for component in components(pattern, 3)]
    [[0, 2], [1]]
    """
    from scipy.sparse.csgraph import connected_components  # type: ignore[import-untyped]

    count, of_state = connected_components(depends, directed=True, connection="weak")
    groups = [np.flatnonzero(of_state == number) for number in range(count)]
    return [Component(group, layout(depends[np.ix_(group, group)], degree)) for group in groups]


class Part(NamedTuple):
    """The rows of one component.

    ``local`` (N, n d, n (d + 1)) are its `Blocks`, which are overwritten; ``slopes`` (n d N, q) those by the unknowns behind
    the states whose numbers are ``places`` (q,).
    """

    component: Component
    local: Array
    slopes: Array
    places: Indices


class Around(NamedTuple):
    """All other rows: r of them, for n states and k unknowns behind those.

    ``first`` and ``last`` (b, n) belong to the first b rows, by the first and the last mesh point; ``rows`` (r - b, states at
    all nodes) to the others; ``corner`` (r, k) to all.
    """

    first: Array
    last: Array
    rows: Array
    corner: Array


class ComponentFactors:
    """A factored bordered matrix of components: `contin.linalg.blocks.Factors`.

    Vectors of unknowns are [states at all nodes | parameters], vectors of equations [collocation | rows around it]. All states
    belong to one of the parts. Raises ValueError if the matrix is not square.
    """

    def __init__(self, parts: Sequence[Part], around: Around) -> None:
        n, (count, k) = around.first.shape[1], around.corner.shape
        if n + k != count:
            raise ValueError(f"{count} rows for {n} states and {k} parameters")
        self._n, self._k, self._around = n, k, around
        self._states = [part.component.states for part in parts]
        self._own = [_complemented(part) for part in parts]
        self._places, self._waves, begin = [], [], 0
        matrix = np.zeros((count, n + k))
        matrix[:, n:] = around.corner
        for part, own in zip(parts, self._own):
            states, places = len(part.component.states), part.places
            given = np.zeros((states + len(places), own.unknowns))
            given[:states, -states:] = np.eye(states)
            given[states:, :-states] = -part.slopes.T
            waves = own.solve(given)
            self._places.append(np.append(np.arange(begin, begin + states), n + places))
            self._waves.append(waves)
            matrix[:, self._places[-1]] += self._products(part.component.states, waves).T
            begin += states
        self._rest = DenseFactors(matrix)
        self.sign = float(np.prod([own.sign for own in self._own])) * self._rest.sign

    def __repr__(self) -> str:
        return f"{type(self).__name__}({len(self._own)} components, sign of the determinant {self.sign:g})"

    def _products(self, states: Indices, x: Array) -> Array:
        """Return the products (m, r) of the rows with vectors (m, nodes n) of the states of a component."""
        around, own = self._around, len(states)
        count = x.shape[1] // own
        nodes = around.rows.reshape(len(around.rows), count, self._n)[:, :, states].reshape(len(around.rows), count * own)
        ends = x[:, :own] @ around.first[:, states].T + x[:, -own:] @ around.last[:, states].T
        return np.concatenate([ends, x @ nodes.T], axis=1)

    def solve(self, b: Array) -> Array:
        """Return the x with J x = b, or for rows of b the rows x."""
        rows = np.asarray(b, dtype=float).reshape(-1, np.shape(b)[-1])
        size = rows.shape[1] - len(self._around.corner)
        collocation, rest = rows[:, :size].reshape(len(rows), -1, self._n), rows[:, size:].copy()
        found = []
        for states, own in zip(self._states, self._own):
            inside = collocation[:, :, states].reshape(len(rows), -1)
            found.append(own.solve(np.concatenate([inside, np.zeros((len(rows), len(states)))], axis=1)))
            rest -= self._products(states, found[-1])
        z = self._rest.solve(rest)
        result = np.empty(rows.shape)
        result[:, rows.shape[1] - self._k :] = z[:, self._n :]
        at_nodes = result[:, : rows.shape[1] - self._k].reshape(len(rows), -1, self._n)
        for states, places, waves, y in zip(self._states, self._places, self._waves, found):
            at_nodes[:, :, states] = (y + z[:, places] @ waves).reshape(len(rows), -1, len(states))
        return result.reshape(np.shape(b))

    def solve_transposed(self, c: Array) -> Array:
        """Return the y with J^T y = c, likewise."""
        rows, around, n = np.asarray(c, dtype=float).reshape(-1, np.shape(c)[-1]), self._around, self._n
        at_nodes = rows[:, : rows.shape[1] - self._k].reshape(len(rows), -1, n)
        given = np.zeros((len(rows), n + self._k))
        given[:, n:] = rows[:, rows.shape[1] - self._k :]
        for states, places, waves in zip(self._states, self._places, self._waves):
            given[:, places] += at_nodes[:, :, states].reshape(len(rows), -1) @ waves.T
        rest = self._rest.solve_transposed(given)
        b = len(around.first)
        right = at_nodes - (rest[:, b:] @ around.rows).reshape(at_nodes.shape)
        right[:, 0] -= rest[:, :b] @ around.first
        right[:, -1] -= rest[:, :b] @ around.last
        result = np.empty(rows.shape)
        result[:, rows.shape[1] - len(around.corner) :] = rest
        collocation = result[:, : rows.shape[1] - len(around.corner)].reshape(len(rows), -1, n)
        for states, own in zip(self._states, self._own):
            y = own.solve_transposed(right[:, :, states].reshape(len(rows), -1))
            collocation[:, :, states] = y[:, : -len(states)].reshape(len(rows), -1, len(states))
        return result.reshape(np.shape(c))


def _complemented(part: Part) -> Factorization:
    """Return the factors of K, with N in the place of boundary conditions."""
    local, n = part.local, len(part.component.states)
    intervals, _, width = local.shape
    whole = share(intervals, 0)  # one segment
    blocks = Blocks(local, np.empty((intervals, 0, width)), np.empty((0, 0)), np.empty((n, n)), np.empty((n, n)))
    found = Factorization.unfilled(part.component.layout, blocks, whole)
    factors, corners, first, last, carried, _ = found.room
    given = part.component.layout, factors, corners, first, last, carried
    found.sign = factorize(*given, whole._replace(stage=0))
    related = carried[0] if np.isfinite(carried[0]).all() else np.eye(n, 2 * n)  # then the sign is NaN
    complement = np.linalg.qr(related.T, mode="complete")[0][:, n:].T
    first[:], last[:] = complement[:, :n], complement[:, n:]
    found.sign *= factorize(*given, whole._replace(stage=1))
    return found
