"""Multiple points: where F_x loses rank by d > 1 at once, located, with the tangents of all branches that meet there.

With d columns Psi and 1 + d rows Phi the matrix M of `contin.events.branch_point` is regular there, too. It defines the
manifold F(x) + Psi beta = 0 over the coordinates s = Phi.(x - x0): beta(s), of d components, with derivatives G from M. At the
point beta and G vanish (d + d (1 + d) equations for 1 + d unknowns: Gauss-Newton, which converges where a symmetry makes them
agree). Branches are the zeros of beta. With v_i the derivatives of x, those of second and third order follow from

    M [x_ij; beta_ij] = -[F_xx v_i v_j; 0],
    M [x_ijk; beta_ijk] = -[F_xxx v_i v_j v_k + F_xx x_ij v_k + F_xx x_ik v_j + F_xx x_jk v_i; 0].

The zeros of these terms on two small spheres are found from many directions; where they converge as the sphere shrinks they
are tangents.
"""

from __future__ import annotations

import functools
import itertools
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, ClassVar

import numpy as np

from contin.arrays import Array
from contin.core.newton import Newton
from contin.core.protocol import Carrier, Discretization, inner
from contin.draws import generator
from contin.errors import ConvergenceError
from contin.events.labelled import Finding
from contin.levels import APART, CORRECTED, DEPENDENT, DOUBLED, LOCATED, MOST_STEPS, MOST_UPDATES, ROUGH, ROUND_OFF, TINY
from contin.linalg.border import orthonormal, smallest_directions
from contin.linalg.orientation import canonical_basis, ordered, oriented, oriented_along

#: Directions from which zeros on a sphere are sought: each of the at most 3^d lines is found many times.
_DIRECTIONS = 300
#: Radii of the spheres; the directions of zeros on them are extrapolated to radius zero.
_SPHERES = 0.02, 0.01
#: Longest step of Newton's method on a sphere.
_LONGEST = 0.5
#: Distances beyond a cluster at which the branch is looked at: the first, and the least. Where a branch with a double point is
#: curved, G gives it a length of the square of that, up to 200 times as large.
_AWAY, _NEAREST = 1e-3, 1e-5
#: The branch is looked at so many times further off than a cluster is long, at so many distances at most.
_BEYOND, _LOOKS = 10.0, 5


@dataclass(frozen=True, eq=False)
class MultiplePoint(Finding):
    """A point where F_x loses rank by two or more at once.

    Attributes
    ----------
    dimension : int
        Dimension of the kernel beyond the tangent of the branch.
    kernel : ndarray, shape (dimension, size)
        Unit vectors that span it.
    x : ndarray, shape (size,), or None
        The point, where it was located.
    tangents : tuple of ndarray
        Unit tangents of the branches that meet there, first that of the branch it was found on; only that one where the branch
        ends, none where the point was not located.
    continuum : bool
        The branches are not isolated: a continuous symmetry turns each into a whole family.
    spread : float
        Largest distance along the branch between this point and the places where single singular values vanish: round-off at a
        point that is really multiple, else half the length of a cluster of branch points, or what the mesh has split. It is a
        part of the point's errors.

    Examples
    --------
    >>> from contin import AlgebraicProblem, solve, trace
    >>> pair = AlgebraicProblem(lambda u, p: (u.x * (p.a - u.x**2), u.y * (p.a - u.y**2)), ["x", "y"], {"a": -1.0})
    >>> branch = trace(solve(pair, [0.0, 0.0]), free=["a"], limits={"a": (-1, 1)})
    >>> (point,) = branch.labelled("BP")
    >>> point.details.dimension, len(point.details.tangents)  # the trivial branch, x, y, and x = y, x = -y
    (2, 5)
    """

    dimension: int
    kernel: Array
    x: Array | None = None
    leave: Callable[[], tuple[tuple[Array, ...], bool]] = lambda: ((), False)  # both of these are computed when asked for
    spread: float = 0.0
    is_branch_point: ClassVar[bool] = True
    has_equations: ClassVar[bool] = True

    _left = functools.cached_property(lambda self: self.leave())
    tangents, continuum = property(lambda self: self._left[0]), property(lambda self: self._left[1])

    def __getstate__(self) -> dict[str, Any]:
        """Return what is pickled: all is computed."""
        return {**vars(self), "leave": None, "_left": self._left}

    @property
    def is_lost(self) -> bool:  # type: ignore[override]
        """It was bracketed only."""
        return self.x is None

    def again(self, system: Discretization, carry: Carrier, x: Array, newton: Newton) -> MultiplePoint:
        """Return the point with a kernel of the same dimension on another mesh."""
        return locate_multiple_point(system, carry(x), system.weights * carry(self.tangents[0]), self.dimension, newton)

    def split(self, system: Discretization) -> Array:
        """Return by how much free parameters differ between it and the simple branch points that it may consist of."""
        return self.spread * np.abs(self.tangents[0][system.state_size :])

    @property
    def nullity(self) -> int:  # type: ignore[override]
        """Its dimension."""
        return self.dimension

    @property
    def arrays(self) -> dict[str, Array]:
        return {"kernel": self.kernel, "tangents": np.array(self.tangents)}

    @property
    def numbers(self) -> dict[str, Any]:
        return {"dimension": self.dimension, "continuum": self.continuum, "spread": self.spread}

    def __repr__(self) -> str:
        count = len(self.tangents)
        meet = ", families of branches meet" if self.continuum else f", {count} branch{'es' * (count != 1)}" * bool(count)
        return f"MultiplePoint(kernel of dimension {self.dimension}{meet})"


class _Manifold:
    """F(x) + Psi beta = 0 over coordinates s, around x0."""

    def __init__(self, system: Discretization, x0: Array, phi: Array, psi: Array, newton: Newton) -> None:
        self.system, self.x0, self.psi, self.newton = system, x0, psi, newton
        self.d = len(psi)
        self.phi = phi
        self.rows = np.zeros((len(phi), system.size + self.d))
        self.rows[:, : system.size] = phi * system.weights

    def at(self, s: Array) -> tuple[Array, Array, Array]:
        """Return x (size,), beta (d,) and G (d, 1 + d) at coordinates s; raise ConvergenceError where there is none."""
        system, size = self.system, self.system.size
        z = np.append(self.x0 + s @ self.phi, np.zeros(self.d))
        last = np.inf
        for _ in range(self.newton.max_iterations):
            residual, factors = system.linearize(z[:size], self.rows, self.psi)
            held = self.rows[:, :size] @ (z[:size] - self.x0) - s
            update = factors.solve(np.concatenate([residual + z[size:] @ self.psi, held]))
            z = z - update
            change = float(np.max(np.abs(update) / (1 + np.abs(z))))
            if not np.isfinite(change) or (change > last and change > DOUBLED):
                break
            if change <= max(self.newton.tolerance, ROUND_OFF) or (change >= last / 2 and change < DOUBLED):
                _, factors = system.linearize(z[:size], self.rows, self.psi)
                unit = np.hstack([np.zeros((len(self.phi), system.equations)), np.eye(len(self.phi))])
                self.factors, self.x = factors, z[:size]
                solutions = factors.solve(unit)
                self.vectors = solutions[:, :size]
                return z[:size], z[size:], solutions[:, size:].T
            last = change
        raise ConvergenceError("the manifold around a multiple point was not found")

    def _bent(self, right_side: Array) -> tuple[Array, Array]:
        """Return the terms of x and of beta for derivatives of F of higher order, (equations,)."""
        solution = self.factors.solve(np.append(-right_side, np.zeros(len(self.phi))))
        return solution[: self.system.size], solution[self.system.size :]

    def second(self) -> tuple[Array, Array]:
        """Return x_ij and beta_ij at the last place, shapes (1 + d, 1 + d, size) and (d, 1 + d, 1 + d)."""
        count = len(self.phi)
        x, beta = np.empty((count, count, self.system.size)), np.empty((self.d, count, count))
        for i, j in itertools.combinations_with_replacement(range(count), 2):
            of_x, of_beta = self._bent(self.system.along(self.x, [self.vectors[i], self.vectors[j]]))
            x[i, j] = x[j, i] = of_x
            beta[:, i, j] = beta[:, j, i] = of_beta
        return x, beta

    def third(self, second: Array) -> Array:
        """Return beta_ijk at the last place, shape (d, 1 + d, 1 + d, 1 + d), from x_ij."""
        count, v, along = len(self.phi), self.vectors, self.system.along
        beta = np.empty((self.d, count, count, count))
        for places in itertools.combinations_with_replacement(range(count), 3):
            right_side = along(self.x, [v[place] for place in places])
            for one in range(3):
                i, j = (place for at, place in enumerate(places) if at != one)
                right_side = right_side + along(self.x, [second[i, j], v[places[one]]])
            found = self._bent(right_side)[1]
            for i, j, k in set(itertools.permutations(places)):
                beta[:, i, j, k] = found
        return beta


def locate_multiple_point(
    system: Discretization, x: Array, row: Array, dimension: int, newton: Newton = Newton()
) -> MultiplePoint:
    """Return the multiple point near x, with the tangents of its branches; raise ConvergenceError where none was found.

    - ``system`` (Collocation or alike)
    - ``x`` (ndarray, shape (size,))
    - ``row`` (ndarray, shape (size,)): Borders F_x: the tangent of the branch times the weights.
    - ``dimension`` (int): d, the number of singular values that vanish.
    """
    with np.errstate(all="ignore"):
        manifold, s = _bordered(system, x, row, dimension, newton), np.zeros(1 + dimension)
        for _ in range(MOST_UPDATES):
            _, beta, G = manifold.at(s)
            slopes = manifold.second()[1]
            residual = np.append(beta, G.ravel())
            update = np.linalg.lstsq(np.vstack([G, slopes.reshape(-1, 1 + dimension)]), residual, rcond=DOUBLED)[0]
            s = s - update
            if not np.isfinite(s).all() or np.max(np.abs(s)) > 1:
                break
            if np.max(np.abs(update)) < DOUBLED:
                if np.max(np.abs(residual)) > APART:
                    break
                return _described(manifold, s, row, slopes)
    raise ConvergenceError(f"no multiple point of dimension {dimension} near by")


def _bordered(system: Discretization, x: Array, row: Array, dimension: int, newton: Newton) -> _Manifold:
    """Return the manifold with borders made of the null vectors at x; right beside x where the matrix is exactly singular."""
    for at in (x, x + APART * row / system.weights):
        right, left, response = smallest_directions(system.linearize(at, (row,))[1], system.size, dimension + 1, 3)
        if np.isfinite(response).all():
            break
    if len(right) < dimension or not np.isfinite(response).all():
        raise ConvergenceError("the matrix is singular")
    u, _, vh = np.linalg.svd(response)
    phi = [row / system.weights, *canonical_basis(u[:, :dimension].T @ right, system.weights)]
    psi = canonical_basis((vh[:dimension] @ left)[:, : system.equations])
    return _Manifold(system, x, orthonormal(np.array(phi), system.weights), psi, newton)


def _described(manifold: _Manifold, s: Array, row: Array, slopes: Array) -> MultiplePoint:
    """Return the point at coordinates s with its kernel and tangents; ``slopes`` are the derivatives of G."""
    system = manifold.system
    x, _, G = manifold.at(s)
    vectors = manifold.vectors
    basis = orthonormal(vectors, system.weights)
    home = row / system.weights
    along = np.array([inner(system, vector, home) for vector in basis])
    ours = along @ basis / np.linalg.norm(along)
    across = canonical_basis(np.linalg.svd(along[None])[2][1:] @ basis, system.weights)
    a = manifold.phi @ (system.weights * ours)
    spread = max(_spread(G, slopes, a), _spread_on_branch(manifold, s, a))
    return MultiplePoint(manifold.d, across, x, functools.partial(_branches, manifold, s, vectors, ours), spread)


def _branches(manifold: _Manifold, s: Array, vectors: Array, ours: Array) -> tuple[tuple[Array, ...], bool]:
    """Return the tangents of the branches, first ``ours``, with the derivatives of x; and whether they form a continuum."""
    system, tangents = manifold.system, []
    with np.errstate(all="ignore"):
        may_branch = system.may_branch(manifold.at(s)[0])
        directions, continuum = _branch_directions(manifold, s) if may_branch else ([], False)
    for a in [] if continuum else directions:
        tangent = a @ vectors
        tangents.append(oriented(tangent / np.sqrt(inner(system, tangent, tangent))))
    cosines = [inner(system, tangent, ours) for tangent in tangents]
    return tuple(oriented_along(tangents[i], cosines[i]) for i in ordered(tangents, cosines)) or (ours,), continuum


def _spread(G: Array, slopes: Array, a: Array) -> float:
    """Return about the largest distance along a direction a from a point to where G, across a, is singular.

    It is singular at the zeros of det(G + distance (slopes a)). Gauss-Newton has moved the point across a, too, which makes G
    smaller than it is on the branch; the distance is not less than that at which G changes by as much as is left of it.
    """
    across = np.linalg.svd(a[None])[2][1:].T
    here, change = G @ across, (slopes @ a) @ across
    least = float(np.linalg.norm(G)) / max(float(np.linalg.norm(change)), np.finfo(float).tiny)
    try:
        distances = np.abs(np.linalg.eigvals(np.linalg.solve(change, here)))
    except np.linalg.LinAlgError:
        return least
    return max(least, float(distances.max()))


def _spread_on_branch(manifold: _Manifold, s: Array, a: Array) -> float:
    """Return the same, from the branch: the largest distance from s to the zeros of G on it; 0 where they are not resolved.

    It is looked at a little beyond them: there it is a zero of beta that Newton's method finds, and G is nearly linear.
    """
    across, away, found = np.linalg.svd(a[None])[2][1:].T, _AWAY, 0.0
    here = (s @ a) * a
    for _ in range(_LOOKS):
        here = here - (here @ a) * a + (s @ a + away) * a
        try:
            for _ in range(MOST_UPDATES):
                _, beta, G = manifold.at(here)
                update = np.linalg.solve(G @ across, beta)
                here = here - across @ update
                if np.max(np.abs(update)) < DOUBLED * away:
                    break
            else:
                return found
            change = manifold.second()[1] @ a @ across
            places = away - np.linalg.eigvals(np.linalg.solve(change, G @ across))
        except (ConvergenceError, np.linalg.LinAlgError):
            return found
        distance = float(np.abs(places).max())
        if _BEYOND * distance < _NEAREST:
            return 0.0
        found, before, away = distance, away, _BEYOND * distance
        if 0.5 < away / before < 2:
            return found
    return found


def _branch_directions(manifold: _Manifold, s: Array) -> tuple[list[Array], bool]:
    """Return the directions in s of the branches, one of each line, and whether they form a continuum."""
    count = len(s)
    manifold.at(s)
    second, linear = manifold.second()
    quadratic = manifold.third(second) / 2
    starts = generator("multiple point").standard_normal((_DIRECTIONS, count))
    starts = np.vstack([np.eye(count), starts / np.linalg.norm(starts, axis=1)[:, None]])
    inside = _zeros(linear, quadratic, _SPHERES[1], starts)
    if len(inside) > 2 * 3**manifold.d or not all(_is_isolated(manifold, s, a) for a in inside):
        return [], True
    outer, result = _zeros(linear, quadratic, _SPHERES[0], np.reshape(inside, (-1, count))), list[Array]()
    for a in inside:
        nearest = max(outer, key=lambda other: float(other @ a), default=None)
        if nearest is None or nearest @ a < np.cos(10 * _SPHERES[0]):
            continue
        direction = 2 * a - nearest
        direction = direction / np.linalg.norm(direction)
        if all(abs(direction @ other) < 1 - 1e-2 * ROUGH for other in result):
            result.append(direction)
    return result, False


def _is_isolated(manifold: _Manifold, s: Array, direction: Array) -> bool:
    """Return whether the branch that leaves along a direction is a line: G has rank d on it. Without a branch, True."""
    radius, a = _SPHERES[0], direction
    try:
        for _ in range(MOST_UPDATES):
            _, beta, G = manifold.at(s + radius * a)
            value = np.append(beta, (a @ a - 1) / 2)
            step = np.linalg.lstsq(np.vstack([radius * G, a]), value, rcond=DOUBLED)[0]
            a = a - step
            if np.max(np.abs(step)) < DOUBLED:
                singular = np.linalg.svd(G, compute_uv=False)
                return bool(singular[-1] > DOUBLED * singular[0])
    except ConvergenceError:
        pass
    return True


def _zeros(linear: Array, quadratic: Array, radius: float, starts: Array) -> list[Array]:
    """Return the unit vectors a with beta(radius a) = 0, from Newton's method with many starts.

    beta = 1/2 G_1(s).s + 1/3 G_2(s, s).s, with the terms of G of first and second order.
    """
    scale = max(np.abs(linear).max(), radius * np.abs(quadratic).max(), TINY)
    ends, errors = starts.copy(), np.full(len(starts), np.inf)
    moving = np.arange(len(starts))
    for _ in range(MOST_STEPS):
        a = ends[moving]
        first = np.einsum("kij,sj->ski", linear, a)
        second = np.einsum("kijl,sj,sl->ski", quadratic, a, a) * radius
        on_branch = np.einsum("ski,si->sk", first / 2 + second / 3, a) / scale
        value = np.column_stack([on_branch, (np.sum(a * a, axis=1) - 1) / 2])
        slope = np.concatenate([(first + second) / scale, a[:, None]], axis=1)
        step = np.einsum("sij,sj->si", np.linalg.pinv(slope, rcond=DEPENDENT), value)
        length = np.linalg.norm(step, axis=1)
        ends[moving] = a - step * np.minimum(1.0, _LONGEST / np.maximum(length, _LONGEST))[:, None]
        settled = length < CORRECTED
        errors[moving[settled]] = np.abs(value[settled]).max(axis=1)
        moving = moving[~settled]
        if not moving.size:
            break
    found: list[Array] = []
    for end in ends[errors < LOCATED]:
        if not found or np.linalg.norm(np.array(found) - end, axis=1).min() > ROUGH:
            found.append(end)
    return found
