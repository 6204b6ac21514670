"""The second variation of the energy at a stationary point: how many independent ways there are to lower it.

From the Jacobian of the canonical equations at the Gauss points, f = (H_l, -H_x), with H_ll = C C^T:

    Q = int |v|^2 - dx.H_xx dx dt + ends,     dx' = H_lx dx + C v,     de = 0,     int dg = 0.

What is varied freely is v - K dx, with K = -C^+ H_lx: then dx does not grow by itself where the controls could hold it (with
x' = w, dx' is what is varied).

Gauss collocation commutes with variations: with dx collocated like the states, on their mesh, Q restricted to what the
conditions allow is singular exactly where the collocated equations are. So changes of the index and the special points of a run
agree to round-off.

On an interval v has d k components at the Gauss points. Only n + n_int combinations of them, y, matter to what lies outside;
the rest is eliminated where Q is well positive on it (then the index stays: inertia is additive, Haynsworth 1968). Neighbouring
intervals are joined in the same way, as long as that holds. What is left is a small dense matrix: O(N) work in all.

                 x ──> [ Phi | B ] ──> x of the next interval
    (x, y) of an interval:  Q = [x y] [ Qxx Qxy ] [x]        constraint rows:  [Gx | Gy]
                                      [ Qyx Qyy ] [y]
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from enum import StrEnum
from typing import Any, NamedTuple

import numpy as np

from contin.arrays import Array, Indices
from contin.boundary.system import Collocation
from contin.collocation.mesh import interpolation
from contin.core.differences import derivative
from contin.core.labels import Label
from contin.core.trial import Event, Trial
from contin.errors import ProblemError
from contin.events.arc import SpecialPoint
from contin.events.labelled import Stability, nullity_of
from contin.levels import APART, DEPENDENT, LOCATED, ROUGH, ROUND_OFF
from contin.linalg.orientation import canonical_basis

#: A symmetry: ``map(t, x)`` returns the image of the states x, shape (K, n), at all nodes t, shape (K,).
Symmetry = Callable[[Array, Array], Array]
#: What is eliminated when intervals are joined has no smaller eigenvalue than this, of 1 where dx does not count: far from
#: zero, so that elimination loses no digits.
_POSITIVE = 0.1


@dataclass(frozen=True, eq=False)
class SecondVariation:
    """The second variation at a stationary point, restricted to what the conditions allow.

    - ``eigenvalues`` (ndarray): Of the reduced matrix, ascending, without positive ones that were eliminated. Their signs
      matter, and where they vanish.
    - ``known`` (float): Error of the state, relative to 1 + |x|.
    """

    eigenvalues: Array
    _vectors: Array
    _parts: tuple[_Part, ...]
    _sizes: Array
    known: float = 0.0

    def __repr__(self) -> str:
        return f"SecondVariation({len(self.eigenvalues)} eigenvalues, {self.index()} of them negative)"

    @property
    def is_determined(self) -> bool:
        """Whether no eigenvalue is zero, as far as the state is known: nothing moves without a change of energy."""
        sizes = np.abs(self.eigenvalues)
        return not sizes.size or bool(sizes.min() > max(LOCATED, self.known) * sizes.max())

    def index(self, nullity: int = 0) -> int:
        """Return the number of negative eigenvalues, without the ``nullity`` ones that are nearest to zero."""
        values = self.eigenvalues[np.argsort(np.abs(self.eigenvalues))[nullity:]]
        return int(np.count_nonzero(values < 0))

    def modes(self, count: int, t: Array) -> Array:
        """Return a basis of the modes of the eigenvalues nearest to zero: dx at t (K,), shape (count, K, n).

        The largest number of each is 1. Basis and signs follow from the space (`contin.linalg.orientation.canonical_basis`).
        """
        order = np.argsort(np.abs(self.eigenvalues))[:count]
        modes = np.array([self._at(self._vectors[:, j], np.asarray(t, dtype=float)) for j in order])
        if len(modes):
            modes = canonical_basis(modes.reshape(len(modes), -1)).reshape(modes.shape)
        largest = np.abs(modes).max(axis=(1, 2), keepdims=True, initial=0.0)
        return modes / np.where(largest > 0, largest, 1.0)

    def _at(self, unknowns: Array, t: Array) -> Array:
        """Return dx at t (K,), shape (K, n), from the reduced unknowns."""
        found = np.empty((len(t), sum(len(part.states) for part in self._parts)))
        for part in self._parts:
            found[:, part.states], unknowns = part.profile.at(unknowns[: part.size], t), unknowns[part.size :]
        return found * self._sizes

    def broken(self, count: int, symmetries: Mapping[str, Symmetry]) -> tuple[str, ...]:
        """Return the names of those symmetries that the ``count`` modes nearest to zero break."""
        if not symmetries:
            return ()
        mesh = self._parts[0].profile.mesh
        t = np.linspace(mesh[0], mesh[-1])
        modes = self.modes(count, t)
        return tuple(
            name for name, image in symmetries.items()
            if any(np.abs(np.asarray(image(t, mode)) - mode).max() > ROUGH for mode in modes)
        )  # fmt: skip


def _index(trial: Trial) -> float:
    found = second_variation(trial.system, trial.x)
    return np.nan if found is None else float(found.index())


#: The index of a state with an energy. One object, so that a trial computes it once.
INDEX = Event("", "index", _index)


def stability_of(point: SpecialPoint) -> Stability:
    """Return what the second variation says of a point; at a special one, what vanishes there does not count.

    It says nothing of a special point at which conditions depend on each other, as where a strip is pulled straight.
    """
    trial, nullity = point.trial, nullity_of(point)
    if not nullity:
        index = trial.value(INDEX)
        return Stability() if np.isnan(index) else Stability(int(index))
    system = trial.system
    try:
        found = second_variation(system, trial.x)
    except ProblemError:  # conditions depend on each other
        return Stability()
    if found is None:
        return Stability()
    breaks = found.broken(nullity, system.problem.symmetries) if point.label == Label.BRANCH_POINT else ()
    return Stability(found.index(nullity), nullity, breaks)


def legendre() -> Event:
    """Return the test function that ends a run where the energy ceases to be convex in the controls (Legendre's condition)."""

    def margin(trial: Trial) -> float:
        system = trial.system
        if system.problem.legendre is None:
            parts = _jacobians(system, trial.x)
            value = min(_convexity(jacobian[:, : len(own), len(own) :]) for own, jacobian in parts)
        else:
            points = system.states_at_gauss_points(trial.x)
            value = system.problem.margin(system.gauss_times, points, system.all_parameters(trial.x))
        return value if np.isfinite(value) else 1.0

    return Event("EP", "loss of convexity in the controls (Legendre's condition)", margin, terminal=True)


def lies_flat(number: int, name: str) -> Event:
    """Return the test function that ends a run where a strip lies flat at what it touches along its direction.

    It is the second derivative of the gap along the strip: where it is negative, more than this point would touch.
    """

    def bends_away(trial: Trial) -> float:
        system, n, p = trial.system, trial.system.problem.dimension, trial.system.all_parameters(trial.x)
        ends, batch, field = system.states(trial.x)[[0, -1]], system.unscaled, system.problem.batch("field")
        inside = system.states_at_gauss_points(trial.x)
        rates_inside = field.values(system.gauss_times, inside, inside[:0], p)[:, :n]
        largest = np.abs(rates_inside).max(axis=0)

        def at(s: float, end: int, along: Array) -> tuple[Array, Array]:
            there = ends + s * along
            jacobian = batch.jacobian(np.zeros(1), there[:1], there[1:], p, batch.columns([]))[1][0]
            rates = field.values(system.mesh[[-end]] + s, there[[end]], there[:0], p)[0, : ends.shape[1]]
            return rates, jacobian[number, : 2 * ends.shape[1]].reshape(2, -1)[end, :n]

        for end in (0, 1):
            along = np.zeros_like(ends)
            along[end], row = at(0.0, end, along)
            is_bent = np.ptp(rates_inside @ row) > APART * np.abs(row).max()  # the curvature of a straight strip is round-off
            if is_bent and abs(row @ along[end, :n]) <= APART * np.abs(row) @ largest:
                return float(derivative(lambda s: np.dot(*(each[:n] for each in at(s, end, along))))[0])  # noqa: B023
        return 1.0

    return Event("EP", f"flat contact at {name}: beyond it a line touches, which is not followed", bends_away, terminal=True)


def _convexity(hll: Array) -> float:
    """Return a number that is positive where H_ll (K, n, n) is positive semidefinite everywhere."""
    if not np.isfinite(hll).all():
        return np.nan
    values = np.linalg.eigvalsh((hll + hll.swapaxes(1, 2)) / 2)
    largest = np.abs(values).max(axis=1)
    return float((values[:, 0] / np.where(largest > 0, largest, 1.0)).min()) + DEPENDENT if np.all(largest > 0) else -1.0


class Undetermined(StrEnum):
    """Why nothing determines the state of a problem with an energy, or its multipliers: words of `ProblemError`.

    Examples
    --------
    >>> import contin
    >>> unheld = contin.VariationalProblem(lambda t, x, w, p: w.x**2, ["x"], {})
    >>> try:
    ...     contin.solve(unheld, [0.0])
    ... except contin.ProblemError as error:
    ...     print(Undetermined.MODE in str(error))
    True
    """

    MODE = "energy: its second variation vanishes along a mode there, which nothing determines (hold more, or start elsewhere)"
    CONDITIONS = "ends: the conditions held, with the integral ones, repeat or contradict each other, or have no slope"


def degeneracy(system: Collocation, x: Array, solved: bool = False) -> str:
    """Return what makes the equations of a variational problem singular at x, as a sentence; "" where nothing is found.

    At a solution only conditions can do so that repeat or contradict each other.
    """
    if not solved and not np.isfinite(system.functionals(x)).all():
        return "energy: it has no finite value there"
    try:
        found = second_variation(system, x)
    except ProblemError as error:
        return str(error)
    except np.linalg.LinAlgError:
        return ""
    if solved:
        return ""
    if found is None:
        return "energy: it is not convex in the controls there (Legendre's condition)"
    return "" if found.is_determined else Undetermined.MODE


class _Pieces(NamedTuple):
    """Pieces of the domain, one after the other: arrays with a first axis over pieces, as drawn above."""

    phi: Array  # (K, n, n)
    b: Array  # (K, n, m)
    q: Array  # (K, n + m, n + m)
    g: Array  # (K, c, n + m)


class _Recovery(NamedTuple):
    """How pieces came out of those before: y = turn [kept, rest], rest = -inside (x, kept); ``pairs``: these are two pieces.

    ``phi`` and ``b`` lead from one of the two to the other, ``pieces`` is the number of pieces before.
    """

    turn: Array
    inside: Array
    pieces: int
    phi: Array | None = None
    b: Array | None = None

    def back(self, x: Array, y: Array) -> tuple[Array, Array]:
        """Return x at the beginning, and y, of the pieces before: (K, n) and (K, m) to (2 K, n), (2 K, m / 2) for pairs."""
        rest = -np.einsum("kij,kj->ki", self.inside, np.concatenate([x, y], axis=1))
        whole = np.einsum("kij,kj->ki", self.turn, np.concatenate([y, rest], axis=1))
        if self.phi is None or self.b is None:
            return x, whole
        first, second = np.split(whole, 2, axis=1)
        middle = np.einsum("kij,kj->ki", self.phi, x) + np.einsum("kij,kj->ki", self.b, first)
        starts, ys = np.stack([x, middle], 1), np.stack([first, second], 1)
        return starts.reshape(-1, x.shape[1])[: self.pieces], ys.reshape(-1, first.shape[1])[: self.pieces]


class _Profile(NamedTuple):
    """dx as a function of t from the unknowns (x of the first end, all y)."""

    mesh: Array
    points: Array
    inside: Array  # (N, d, n, n + m): dx at the Gauss points of an interval
    recoveries: tuple[_Recovery, ...]
    starts: Array  # (K, n, size)

    def at(self, unknowns: Array, t: Array) -> Array:
        """Return dx at t (K,), shape (K, n)."""
        n = self.inside.shape[2]
        x, y = self.starts[:-1] @ unknowns, unknowns[n:].reshape(len(self.starts) - 1, -1)
        for recovery in reversed(self.recoveries):
            x, y = recovery.back(x, y)
        count = len(self.inside)
        at_points = np.einsum("eijk,ek->eij", self.inside, np.concatenate([x, y], axis=1))
        nodes = np.append(0.0, self.points)
        weights = 1 / np.prod(nodes[:, None] - nodes + np.eye(len(nodes)), axis=1)
        e = np.clip(np.searchsorted(self.mesh, t, side="right") - 1, 0, count - 1)
        matrix = interpolation(nodes, weights, (t - self.mesh[e]) / np.diff(self.mesh)[e])
        return np.einsum("ij,ijk->ik", matrix, np.concatenate([x[:, None], at_points], axis=1)[e])


class _Part(NamedTuple):
    """States that depend on each other, by number, what is left of their intervals, and the number of unknowns of these."""

    states: Indices
    pieces: _Pieces
    profile: _Profile
    size: int


def second_variation(system: Collocation, x: Array, phases: bool = True) -> SecondVariation | None:
    """Return the second variation at a solution x of a variational problem; None where Legendre's condition fails.

    Without ``phases`` these conditions are not held. Raises ProblemError for end conditions that repeat or contradict each
    other there.
    """
    parts = []
    for own, jacobian in _jacobians(system, x):
        local = _intervals(system, jacobian)
        if local is None:
            return None
        parts.append(_part(system, own, *local))
    values, vectors = _reduced(system, x, parts, phases)
    return SecondVariation(values, vectors, tuple(parts), _sizes(system)[: system.problem.dimension])


def _part(system: Collocation, states: Indices, pieces: _Pieces, inside: Array) -> _Part:
    """Return what is left of the intervals of states that depend on each other."""
    pieces, recoveries = _joined(pieces)
    count, n, m = pieces.b.shape
    at = np.zeros((n, n + count * m))
    at[:, :n] = np.eye(n)
    starts = [at]
    for i in range(count):
        at = pieces.phi[i] @ at
        at[:, n + i * m : n + (i + 1) * m] += pieces.b[i]
        starts.append(at)
    profile = _Profile(system.mesh, system.basis.points, inside, recoveries, np.array(starts))
    return _Part(states, pieces, profile, at.shape[1])


def _intervals(system: Collocation, jacobian: Array) -> tuple[_Pieces, Array] | None:
    """Return the single intervals, with all components of v, and dx at their Gauss points, shape (N, d, n, n + d k).

    ``jacobian`` (N d, 2 n + n_int, 2 n) are the derivatives of the rates of (x, lambda) and of the integrands.
    """
    n, h, d = jacobian.shape[2] // 2, np.diff(system.mesh), system.degree
    jacobian = jacobian.reshape(len(h), d, -1, 2 * n)
    a, hll, hxx = jacobian[:, :, :n, :n], jacobian[:, :, :n, n:], -jacobian[:, :, n : 2 * n, :n]
    roots = _roots((hll + hll.swapaxes(2, 3)) / 2)
    if roots is None:
        return None
    c, inverse = roots
    feedback = -inverse.swapaxes(2, 3) @ a
    a = a + c @ feedback
    k, g = c.shape[-1], jacobian[:, :, 2 * n :]
    basis = system.basis
    weights = h[:, None] * basis.weights
    scaled = c / np.sqrt(weights)[:, :, None, None]  # v times sqrt(weight): Q begins with its square
    step = h[:, None, None, None, None] * basis.runge_kutta[None, :, None, :, None]
    matrix = np.eye(d * n) - (step * a.transpose(0, 2, 1, 3)[:, None]).reshape(len(h), d * n, d * n)
    drive = (step * scaled.transpose(0, 2, 1, 3)[:, None]).reshape(len(h), d * n, d * k)
    start = np.broadcast_to(np.tile(np.eye(n), (d, 1)), (len(h), d * n, n))
    inside = np.linalg.solve(matrix, np.concatenate([start, drive], axis=2)).reshape(len(h), d, n, n + d * k)
    control = np.zeros((len(h), d, k, n + d * k))
    for i in range(d):
        control[:, i, :, n + i * k : n + (i + 1) * k] = np.eye(k) / np.sqrt(weights[:, i])[:, None, None]
    rates = a @ inside + c @ control
    control += feedback @ inside
    last = np.einsum("ei,einj->enj", weights, rates)
    last[:, :, :n] += np.eye(n)
    q = _products(weights, control, control)
    q -= _products(weights, inside, ((hxx + hxx.swapaxes(2, 3)) / 2) @ inside)
    rows = g[:, :, :, :n] @ inside + (g[:, :, :, n:] @ inverse) @ control
    return _Pieces(last[:, :, :n], last[:, :, n:], q, np.einsum("ei,eicj->ecj", weights, rows)), inside


def _products(weights: Array, a: Array, b: Array) -> Array:
    """Return the integrals of a^T b over each interval, (N, j, l), from values at Gauss points: (N, d, k, j), (N, d, k, l)."""
    rows = a.shape[1] * a.shape[2]
    weighted = (weights[:, :, None, None] * a).reshape(len(a), rows, -1)
    return weighted.swapaxes(1, 2) @ b.reshape(len(b), rows, -1)


def _jacobians(system: Collocation, x: Array) -> list[tuple[Indices, Array]]:
    """Return the states x of each part of the problem, n of them, and derivatives at the Gauss points, in units of their sizes.

    They are those of the rates of these x and lambda and of the integrands, by x and lambda: shape (N d, 2 n + n_int, 2 n).
    """
    batch, count = system.problem.batch("field"), system.problem.dimension
    points, columns, found, sizes = system.states_at_gauss_points(x), batch.columns([]), [], _sizes(system)
    entries = batch.entries(system.gauss_times, points, points[:0], system.all_parameters(x), columns)[1]
    for states in system.separate_states:
        own = states[states < count]
        both = np.concatenate([own, count + own])
        rows = np.append(both, np.arange(2 * count, batch.count))  # and the integrands
        of = np.append(sizes[both], np.ones(batch.count - 2 * count))
        found.append((own, columns.block(entries, rows, both) * sizes[both] / of[:, None]))
    return found


def _sizes(system: Collocation) -> Array:
    """Return the sizes of x and lambda (2n,), whose products are all one energy; ones unless the problem states its own."""
    n, stated = system.problem.dimension, system.problem.sizes
    names = list(system.problem.states)
    energy = stated.get(names[0], 1.0) * stated.get(names[n], 1.0)
    own = np.array([stated.get(name, 1.0) for name in names[:n]])
    return np.concatenate([own, energy / own])


def _roots(hll: Array) -> tuple[Array, Array] | None:
    """Return C (N, d, n, k) with C C^T = H_ll, and what takes v to multipliers, (N, d, n, k); None unless H_ll >= 0."""
    if not np.isfinite(hll).all():  # outside the range of the equations; LAPACK may raise an error for such a matrix
        return None
    values, vectors = np.linalg.eigh(hll)
    largest = values.max(axis=2)
    if np.any(values < -DEPENDENT * largest[:, :, None]) or np.any(largest <= 0):
        return None
    k = int(np.max(np.count_nonzero(values > DEPENDENT * largest[:, :, None], axis=2)))
    values, vectors = values[:, :, -k:], vectors[:, :, :, -k:]
    root = np.sqrt(np.maximum(values, DEPENDENT * largest[:, :, None]))
    return vectors * root[:, :, None], vectors / root[:, :, None]


def _joined(pieces: _Pieces) -> tuple[_Pieces, tuple[_Recovery, ...]]:
    """Return the pieces joined in pairs as long as possible, and the way back."""
    pieces, recovery = _condensed(pieces)
    recoveries = [] if recovery is None else [recovery]
    while len(pieces.phi) > 1:
        joined, recovery = _condensed(_pairs(pieces))
        if recovery is None:
            break
        recoveries.append(recovery._replace(phi=pieces.phi[::2], b=pieces.b[::2], pieces=len(pieces.phi)))
        pieces = joined
    return pieces, tuple(recoveries)


def _pairs(pieces: _Pieces) -> _Pieces:
    """Return neighbouring pieces joined; of an odd number, the last is joined with one of length zero."""
    n, m, c = pieces.b.shape[1], pieces.b.shape[2], pieces.g.shape[1]
    if len(pieces.phi) % 2:
        square = np.diag(np.repeat([0.0, 1.0], [n, m]))
        nothing = _Pieces(np.eye(n)[None], np.zeros((1, n, m)), square[None], np.zeros((1, c, n + m)))
        pieces = _Pieces(*map(np.concatenate, zip(pieces, nothing)))
    first, second = (_Pieces(*(array[start::2] for array in pieces)) for start in (0, 1))
    count = len(first.phi)
    middle = np.zeros((count, n + m, n + 2 * m))  # (x, y) of the second piece from (x, y, y) of the joined one
    middle[:, :n, :n], middle[:, :n, n : n + m] = first.phi, first.b
    middle[:, n:, n + m :] = np.eye(m)
    q = middle.swapaxes(1, 2) @ second.q @ middle
    q[:, : n + m, : n + m] += first.q
    g = second.g @ middle
    g[:, :, : n + m] += first.g
    return _Pieces(second.phi @ first.phi, np.concatenate([second.phi @ first.b, second.b], axis=2), q, g)


def _condensed(pieces: _Pieces) -> tuple[_Pieces, _Recovery | None]:
    """Return pieces with those y that matter outside; the same where the others are not well positive, or none."""
    n, m, c = pieces.b.shape[1], pieces.b.shape[2], pieces.g.shape[1]
    kept = n + c
    if m <= kept:
        return pieces, None
    outward = np.concatenate([pieces.b, pieces.g[:, :, n:]], axis=1)
    sizes = np.linalg.norm(outward, axis=2, keepdims=True)
    turn: Any = np.linalg.qr((outward / np.where(sizes > 0, sizes, 1.0)).swapaxes(1, 2), mode="complete")[0]
    whole = np.tile(np.eye(n + m), (len(pieces.phi), 1, 1))
    whole[:, n:, n:] = turn
    q = whole.swapaxes(1, 2) @ pieces.q @ whole
    inner = q[:, n + kept :, n + kept :]
    least = float(np.linalg.eigvalsh(inner).min())
    if least < _POSITIVE:
        return pieces, None
    cross = q[:, n + kept :, : n + kept]
    rest: Any = np.linalg.solve(inner, cross)
    reduced = q[:, : n + kept, : n + kept] - cross.swapaxes(1, 2) @ rest
    turned = _Pieces(
        pieces.phi, pieces.b @ turn[:, :, :kept], (reduced + reduced.swapaxes(1, 2)) / 2,
        np.concatenate([pieces.g[:, :, :n], pieces.g[:, :, n:] @ turn[:, :, :kept]], axis=2),
    )  # fmt: skip
    return turned, _Recovery(turn, rest, len(turn))


def _reduced(system: Collocation, x: Array, parts: Sequence[_Part], phases: bool) -> tuple[Array, Array]:
    """Return eigenvalues and eigenvectors of Q over (x of the first end, all y) of each part, with the conditions held."""
    ends, second = _ends(system, x)
    n, size = system.problem.dimension, sum(part.size for part in parts)
    q, both, held, begin = np.zeros((size, size)), np.zeros((2 * n, size)), np.zeros((parts[0].pieces.g.shape[1], size)), 0
    for states, pieces, profile, count in parts:
        own, each, m = slice(begin, begin + count), len(states), pieces.b.shape[2]
        for i in range(len(pieces.b)):
            at = np.zeros((each + m, count))
            at[:each] = profile.starts[i]
            at[each:, each + i * m : each + (i + 1) * m] = np.eye(m)
            q[own, own] += at.T @ pieces.q[i] @ at
            held[:, own] += pieces.g[i] @ at
        both[states, own], both[n + states, own] = profile.starts[0], profile.starts[-1]
        begin += count
    q += both.T @ second @ both
    if not phases:
        names = system.problem.phases
        held = held[[f"mu_{name}" not in names for name in system.problem.variation.integrals]]
        others = [i for i in range(2 * n) if i < n or f"lam_{system.problem.state_names[i - n]}" not in names]
        ends = ends[np.abs(ends[:, others]).max(axis=1, initial=0.0) > 0]
    rows = np.vstack([ends @ both, held])
    sizes = np.linalg.norm(rows, axis=1, keepdims=True)
    rows = np.where(sizes > ROUND_OFF, rows, 0.0) / np.maximum(sizes, ROUND_OFF)  # without a slope: round-off is none
    free = np.eye(size)
    if len(rows):
        _, singular, vectors = np.linalg.svd(rows)
        if singular[-1] < DEPENDENT * singular[0]:
            raise ProblemError(Undetermined.CONDITIONS)
        free = vectors[len(rows) :].T
    values, modes = np.linalg.eigh(free.T @ ((q + q.T) / 2) @ free)
    return values, free @ modes


def _ends(system: Collocation, x: Array) -> tuple[Array, Array]:
    """Return the derivatives of e by (x0, x1), shape (conditions, 2n), and the second ones of Phi + sigma.e, shape (2n, 2n)."""
    problem: Any = system.problem
    n, batch, states = problem.dimension, system.unscaled, system.states(x)
    columns = batch.columns([])
    jacobian = batch.jacobian(np.zeros(1), states[:1], states[-1:], system.all_parameters(x), columns)[1][0]
    by_ends = np.concatenate([jacobian[:, :n], jacobian[:, 2 * n : 3 * n]], axis=1)
    fixed = problem.canonical.fixed
    free = [[i for i in range(n) if i not in places] for places in fixed]
    sizes = _sizes(system)
    by_ends *= np.tile(sizes[:n], 2)
    conditions = len(jacobian) - len(free[0]) - len(free[1])
    second = np.zeros((2 * n, 2 * n))
    second[free[0]] = -by_ends[conditions : conditions + len(free[0])]
    second[[n + i for i in free[1]]] = by_ends[conditions + len(free[0]) :]
    second /= np.tile(sizes[n:], 2)[:, None]
    held = [i for places, offset in zip(fixed, (0, n)) for i in (offset + place for place in places)]
    second[:, held] = 0.0  # they do not move
    pushes = problem.variation.pushes
    held = [i for i in range(conditions) if i not in pushes or by_ends[i].any()]  # without contacts that are open
    return by_ends[held], (second + second.T) / 2
