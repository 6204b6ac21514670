"""Orbits from integrations in time: a cycle on which a motion has settled, and a homoclinic orbit from its saddle or a cycle.

With one unstable eigenvalue of the saddle, and its right and left eigenvectors q and p,

1. Integrate from e + d q, or e - d q, to where the orbit comes closest to the saddle e again; m = p.(u - e) there.
2. Do so for values of the parameter, from the one at hand outwards, until m changes its sign between two of them: the orbit
   passes the stable manifold on one side, and then on the other.
3. Halve this interval until the orbit comes back close enough, for Newton's method to find the homoclinic orbit.

With one stable eigenvalue, time runs backwards. (AUTO-07p begins likewise, ISTART = 3, and grows the orbit by continuation.)
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from contin import errors as checks
from contin.arrays import Array
from contin.collocation.mesh import MeshControl, usual_degree
from contin.connections.equations import ConnectionCollocation
from contin.connections.statement import ConnectionProblem
from contin.core.newton import Newton, nearest_zero
from contin.cycles.ends import equilibrium_beside
from contin.cycles.equations import CycleCollocation
from contin.cycles.statement import CycleProblem
from contin.equilibria.equations import Algebraic
from contin.errors import ConvergenceError, Positive, ProblemError
from contin.functions.signature import named_values
from contin.levels import DOUBLED, LOCATED, MOST_HALVINGS, ROUGH
from contin.linalg.orientation import first_least, oriented
from contin.problems.angles import periods_of, whole_rounds, winding_names, windings
from contin.problems.statement import PERIOD, ROUNDS, TIME, declared
from contin.results.point import Point
from contin.search.guess import restated
from contin.search.motions import SAMPLES, SETTLES, Field, integrated, passages, state_after
from contin.search.solving import solve, solved
from contin.search.two_parameter import INTERVALS

#: Distance from its start, as a part of the size of the motion, within which it has come back: Newton's method finds the cycle.
_CLOSED = 1e-2
#: Parts of the time in which it settles, in which it must come back: the first ones are enough for most.
_PARTS = (1 / 64, 1 / 16, 1 / 4, 1)
#: Looks at a motion in each round of an angle: at three or less, a whole round could look like none.
_PER_ROUND = 8
#: Largest number of periods of the forcing after which a motion is looked for to close: four period doublings.
_MOST_ROUNDS = 16
#: Longest time, in units of 1 / the eigenvalue: an orbit that takes longer has gone elsewhere. It takes 16 to leave.
_LONGEST = 500.0
#: The orbit has turned back where it is closest for the first time, if it is closer than this part of its largest distance.
_BACK = 0.95
#: Values of the parameter on each side that are looked at, closer to each other near the start, as the saddle may end there.
_VALUES = 24
#: Where the interval cannot be halved any more, an orbit further off than this part of its largest distance shows a jump of m.
_JUMP = 0.05
#: The orbit is cut off at the start where it is this close to the saddle, as a part of its largest distance.
_CUT = 1e-4


@dataclass(frozen=True, eq=False)
class GrownOrbit:
    """An orbit that comes back to its saddle.

    Attributes
    ----------
    value : float
        Of the parameter.
    rest : ndarray, shape (n,)
        The saddle.
    times, states : ndarray, shape (K,), (K, n)
        From where the orbit leaves to where it is closest again, in the sense of time.
    missed : float
        m, as a part of the largest distance; its sign is the side on which the orbit passes.
    closest : float
        Least distance after the return, as a part of the largest.
    """

    value: float
    rest: Array
    times: Array
    states: Array
    missed: float
    closest: float


class _Saddle:
    """The saddle of a point and its single unstable or stable direction, for orbits; raise ProblemError where it has none."""

    def __init__(self, point: Point, name: str) -> None:
        system: Any = point.system
        self.problem, self.name = system.problem, name
        self.values, self.periods = dict(point.parameters), periods_of(system.problem)
        self.first: Array = system.states(point.x)[0]
        rates = np.linalg.eigvals(self._algebraic(self.values).jacobian(self.first)).real
        unstable, stable = int(np.count_nonzero(rates > 0)), int(np.count_nonzero(rates < 0))
        if unstable == 0 or stable == 0:
            raise ProblemError(f"start: the equilibrium is {'stable' if unstable == 0 else 'a source'}, no saddle")
        if 1 not in (unstable, stable):
            raise ProblemError(
                f"start: the equilibrium has {unstable} unstable and {stable} stable eigenvalues; an orbit is grown from one "
                "with a single unstable, or a single stable one"
            )
        self.unstable, self.sense = unstable, 1.0 if unstable == 1 else -1.0

    def apart(self, states: Array, rest: Array) -> Array:
        """Return by how much states (..., n) differ from the saddle, or from the same one whole rounds of its angles on."""
        gap = states - rest
        return gap - whole_rounds(gap, self.periods)

    def _algebraic(self, values: dict[str, float]) -> Algebraic:
        return Algebraic(self.problem, (), values)

    def at(self, value: float, guess: Array) -> tuple[Array, Array, Array, float]:
        """Return the saddle at a value of the parameter, q and p with p.q = 1, the eigenvalue; or raise ConvergenceError."""
        system = self._algebraic({**self.values, self.name: value})
        rest = nearest_zero(lambda u: (system.residual(u), system.jacobian(u)), guess)
        if rest is None:
            raise ConvergenceError(f"the equilibrium is not found at {self.name} = {value:.6g}")
        found, vectors = np.linalg.eig(self.sense * system.jacobian(rest))
        at = int(np.argmax(found.real))
        right = oriented(vectors[:, at].real)
        left = np.linalg.inv(vectors)[at].real
        return rest, right, left / (left @ right), float(found[at].real)

    def field(self, value: float) -> Field:
        """Return the field at a value of the parameter."""
        system = self._algebraic({**self.values, self.name: value})
        batch, sense = self.problem.batch("residual"), self.sense
        return Field(lambda t, u: sense * system.residual(u), batch, system.parameters, sense)


def grown_orbit(start: Point, name: str, interval: tuple[float, float], direction: int) -> tuple[GrownOrbit, int]:
    """Return an orbit that comes back to the saddle ``start`` for some value of a parameter, and the number of unstable
    eigenvalues.

    Raises ProblemError where the start is no saddle with a single unstable or stable eigenvalue; ConvergenceError where no
    value in the interval has such an orbit.
    """
    saddle = _Saddle(start, name)
    for first, second in _neighbours(saddle, interval, direction):
        if first.missed * second.missed < 0:
            found = _bisected(saddle, first, second, direction)
            if found is not None:
                return found, saddle.unstable
    raise ConvergenceError(
        f"no orbit from the equilibrium comes back to it for {name} from {interval[0]:.6g} to {interval[1]:.6g}; try other "
        "limits, or another direction"
    )


def _neighbours(saddle: _Saddle, interval: tuple[float, float], direction: int) -> Iterator[tuple[GrownOrbit, GrownOrbit]]:
    """Yield orbits at neighbouring values of the parameter, from that of the start outwards, on both sides in turn."""
    here = saddle.values[saddle.name]
    first = _followed(saddle, here, saddle.first, direction)
    last: Any = dict.fromkeys(interval, (first, saddle.first))
    for step in range(1, _VALUES + 1):
        for end in interval:
            before, rest = last[end]
            value = here + (end - here) * (step / _VALUES) ** 3
            if value == here or rest is None:
                continue
            try:
                now = _followed(saddle, value, rest, direction)
                rest = saddle.at(value, rest)[0]
            except (ConvergenceError, np.linalg.LinAlgError):
                last[end] = None, None  # the equilibrium ends there
                continue
            if before is not None and now is not None:
                yield before, now
            last[end] = now, rest


def _bisected(saddle: _Saddle, first: GrownOrbit, second: GrownOrbit, direction: int) -> GrownOrbit | None:
    """Return an orbit between two, on different sides, that comes back close to the saddle; None where m jumps there."""
    for _ in range(MOST_HALVINGS):
        best = min(first, second, key=lambda orbit: orbit.closest)
        if best.closest < ROUGH:
            return best
        middle = (first.value + second.value) / 2
        if middle in (first.value, second.value):
            break
        now = _followed(saddle, middle, best.rest, direction)
        if now is None:
            return None
        first, second = (now, second) if now.missed * second.missed < 0 else (first, now)
    best = min(first, second, key=lambda orbit: orbit.closest)
    return best if best.closest < _JUMP else None


def _followed(saddle: _Saddle, value: float, guess: Array, direction: int) -> GrownOrbit | None:
    """Return the orbit at a value of the parameter up to its return; None where it does not come back."""
    rest, right, left, rate = saddle.at(value, guess)
    start = rest + direction * DOUBLED * (1 + np.abs(rest).max()) * right / np.abs(right).max()
    found = _until_return(saddle, value, rest, start, _LONGEST / rate)
    if found is None:
        return None
    times, states = found
    far = np.linalg.norm(saddle.apart(states, rest), axis=1)
    away = int(np.argmax(far > _CUT * far.max()))
    times, states = times[away:] - times[away], states[away:]
    missed = float(left @ saddle.apart(states[-1], rest) / (np.linalg.norm(left) * far.max()))
    if saddle.sense < 0:
        times, states = times[-1] - times[::-1], states[::-1]
    return GrownOrbit(value, rest, times, states, missed, float(far[-1] / far.max()))


def _until_return(saddle: _Saddle, value: float, rest: Array, start: Array, longest: float) -> tuple[Array, Array] | None:
    """Return times (K,) and states (K, n) of an orbit up to where it is closest to the saddle again; None without a return."""
    field = saddle.field(value)
    for part in _PARTS:
        try:
            done = integrated(field, start, part * longest, LOCATED)
        except ProblemError:  # it goes to infinity
            return None

        def approach(t: Array, sol: Callable[[Array], Array] = done.sol) -> Array:
            u = sol(t).T
            return np.sum(saddle.apart(u, rest) * field.batch.values(t, u, u[:0], field.p), axis=1) * saddle.sense

        far = np.linalg.norm(saddle.apart(done.y.T, rest), axis=1)
        for t in passages(done.t, approach):
            there, before = done.sol(t), done.t < t
            if np.linalg.norm(saddle.apart(there, rest)) < _BACK * far[before].max():
                return np.append(done.t[before], t), np.concatenate([done.y.T[before], there[None]])
    return None


@checks.arguments
def homoclinic(
    start: Point, free: Sequence[str], *, limits: Mapping[str, tuple[float, float]] | None = None, direction: int = 1,
    mesh: MeshControl | None = None, newton: Newton = Newton(),
) -> Point:  # fmt: skip
    """Return the homoclinic orbit near a cycle that spends most of its period beside a saddle, or one of a saddle itself.

    The cycle is cut where it comes closest to the saddle, and corrected as a `ConnectionProblem`. Its time is the period of
    the cycle. Follow the result with two free parameters, or with ``time`` and one to make the column ``gap`` smaller.

    From a saddle with a single unstable (or stable) eigenvalue, orbits that leave (or enter) along its eigenvector are followed
    to where they come back, for values of the parameter from the present one on.

    Parameters
    ----------
    start : Point
        Of a `CycleProblem`; or an equilibrium, of an `AlgebraicProblem`.
    free : sequence of str
        The parameter to be found.
    limits : mapping of str to pair of float
        From an equilibrium: the least and the largest value of that parameter.
    direction : int
        From an equilibrium: the orbit leaves along the eigenvector whose largest component is positive (1) or negative (-1).
    mesh, newton : optional
        As in `solve`.

    Raises
    ------
    ProblemError
        The start is no cycle and no saddle, or a saddle with several unstable and several stable eigenvalues.
    ConvergenceError
        No homoclinic orbit is found near the cycle, or within the limits.

    Examples
    --------
    >>> import contin
    >>> def field(u, p):
    ...     return u.y, u.x - u.x**2 + u.y * (p.mu + u.x) / 2
    >>> rest = contin.solve(contin.AlgebraicProblem(field, ["x", "y"], {"mu": -1.1}), [1.0, 0.0])
    >>> (hopf,) = contin.trace(rest, free=["mu"], limits={"mu": (-1.1, -0.9)}).labelled("HB")
    >>> cycles = contin.trace(hopf, branch=1, limits={"period": (0, 20)}, errors=False)
    >>> orbit = homoclinic(cycles.points[-1], free=["mu"])
    >>> abs(orbit["mu"] - cycles.points[-1]["mu"]) < 1e-4 and orbit["gap"] < 1e-3
    True

    The same from the saddle at the origin:

    >>> saddle = contin.solve(contin.AlgebraicProblem(field, ["x", "y"], {"mu": -0.9}), [0.0, 0.0])
    >>> grown = homoclinic(saddle, free=["mu"], limits={"mu": (-1, -0.8)})
    >>> abs(grown["mu"] - orbit["mu"]) < 1e-6
    True
    """
    control = MeshControl() if mesh is None else mesh
    system: Any = start.system
    if not system.on_curve and not system.intervals and declared(system.problem, "dynamics"):
        return _from_saddle(start, free, limits, direction, (control, newton))
    if limits is not None and system.size_of_solutions is not None:
        raise ProblemError("limits: are for a start at an equilibrium; the orbit is looked for near the cycle")
    return _from_cycle(start, free, (control, newton))


def _from_saddle(
    start: Point, free: Sequence[str], limits: Mapping[str, tuple[float, float]] | None, direction: int,
    options: tuple[MeshControl, Newton],
) -> Point:  # fmt: skip
    """Return the homoclinic orbit that an orbit grown from a saddle leads to."""
    system: Any = start.system
    names = checks.names("free", free)
    if len(names) != 1 or names[0] not in system.problem.parameters:
        raise ProblemError(f"free: {', '.join(names)} must be one of the parameters {', '.join(system.problem.parameters)}")
    (name,) = names
    known = checks.mapping("limits", limits or {}, "pairs of numbers")
    if set(known) != {name}:
        raise ProblemError(f"limits: must hold the least and the largest value of {name}, as in limits={{{name!r}: (0, 1)}}")
    ends = tuple(checks.sequence(f"limits: {name}", known[name], "two numbers, the first the smaller"))
    if len(ends) != 2 or not all(checks.is_number(end) for end in ends):
        raise ProblemError(f"limits: {name}: {checks.shown(ends)} must be two numbers, the first the smaller")
    low, high = ends
    if not low <= start[name] <= high:
        raise ProblemError(f"limits: {name} = {start[name]:.6g} at the start must lie between {low:.6g} and {high:.6g}")
    if direction not in (1, -1):
        raise ProblemError(f"direction: {checks.shown(direction)} must be 1 or -1")
    orbit, unstable = grown_orbit(start, name, (low, high), direction)
    states, angles = system.problem.state_names, system.problem.angles
    problem = ConnectionProblem(system.problem.residual, states, start.parameters, unstable=unstable, angles=angles)
    rounds = windings(angles, states, orbit.states[-1] - orbit.states[0])
    rest = orbit.rest + whole_rounds(orbit.states[0] - orbit.rest, periods_of(system.problem))
    values = {**start.parameters, name: orbit.value, TIME: float(orbit.times[-1]), **rounds}
    values |= dict(zip(problem.multipliers, rest))
    times = orbit.times / orbit.times[-1]
    degree = usual_degree(len(states), options[0].tolerance)
    points = np.append(times[: -1 : max(1, len(times) // INTERVALS)], 1.0)
    started = ConnectionCollocation(problem, points, degree, names, values)
    x = started.pack(np.stack([np.interp(started.nodes, times, column) for column in orbit.states.T], axis=1), values)
    return solved(started.with_reference(x), x, *options)


def _from_cycle(cycle: Point, free: Sequence[str], options: tuple[MeshControl, Newton]) -> Point:
    """Return the homoclinic orbit near a cycle."""
    system: Any = cycle.system
    names = checks.names("free", free)
    if len(names) != 1 or names[0] not in system.problem.parameters or names[0] == PERIOD:
        raise ProblemError(f"free: {', '.join(names) or 'none'} must be one parameter, in which the orbit is looked for")
    if system.size_of_solutions is None:
        raise ProblemError("start: must be a point of a CycleProblem, or an equilibrium of an AlgebraicProblem")
    if system.order > 1:
        raise ProblemError("start: must be a cycle without a symmetry; solve takes it as a guess of such a CycleProblem")
    states, names = system.states(cycle.x), system.problem.state_names
    rest, unstable = _saddle(system, cycle.x)
    angles, periods = system.problem.angles, periods_of(system.problem)
    parameters = {name: value for name, value in cycle.parameters.items() if name not in (PERIOD, *winding_names(angles))}
    problem = ConnectionProblem(system.problem.field, names, parameters, unstable=unstable, angles=angles)
    degree = system.degree
    apart = states[::degree] - rest
    cut = first_least(np.abs(apart - whole_rounds(apart, periods)).max(axis=1)[:-1])  # at a mesh point
    rest = rest + whole_rounds(apart[cut], periods)
    mesh_points = np.concatenate([system.mesh[cut:], 1 + system.mesh[1 : cut + 1]]) - system.mesh[cut]
    mesh_points[-1] = 1.0
    turned = np.concatenate([states[cut * degree :], states[1 : cut * degree + 1] + system.gains[-1]])
    rounds = {name: cycle.parameters[name] for name in winding_names(angles)}
    values = {**parameters, **rounds, TIME: cycle.parameters[PERIOD], **dict(zip(problem.multipliers, rest))}
    started = ConnectionCollocation(problem, mesh_points, degree, tuple(free), values)
    x = started.pack(turned, values)
    return solved(started.with_reference(x), x, *options)


def _saddle(system: CycleCollocation, x: Array) -> tuple[Array, int]:
    """Return the equilibrium beside a cycle, shape (n,), and the number of its unstable eigenvalues."""
    found = equilibrium_beside(system, x)
    if found is None:
        raise ProblemError("start: no equilibrium is found from where it is slowest; take a cycle of longer period")
    states, eigenvalues = found
    unstable = int(np.count_nonzero(eigenvalues.real > 0))
    if unstable in (0, len(eigenvalues)):
        kind = "stable" if unstable == 0 else "a source"
        raise ProblemError(f"start: the equilibrium where it is slowest is {kind}, no saddle; take a cycle of longer period")
    return states * system.scales.states, unstable


@checks.arguments
def cycle(
    problem: CycleProblem, start: Sequence[float], parameters: Mapping[str, float] | None = None, *, settle: Positive = 100.0,
    intervals: int = 40, degree: int | None = None,
) -> Point:  # fmt: skip
    """Return the stable cycle that a time integration from ``start`` settles on.

    Parameters
    ----------
    problem : CycleProblem
    start : sequence of float
        Initial states.
    parameters : mapping of str to float, optional
        Values that differ from the defaults.
    settle : float
        Time after which the motion is taken to be periodic.
    intervals, degree : int
        First mesh and degree of the collocation, as in `solve`.

    Raises
    ------
    ProblemError
        The motion does not come back: it rests, goes to infinity, or has not settled.
    ConvergenceError
        No cycle is found near the motion.

    Examples
    --------
    >>> import math, contin
    >>> def van_der_pol(u, p):
    ...     return u.v, p.mu * (1 - u.x**2) * u.v - u.x
    >>> problem = contin.CycleProblem(van_der_pol, ["x", "v"], {"mu": 1.0})
    >>> round(cycle(problem, [1.0, 0.0])["period"], 6)
    6.663287
    """
    first = checks.array("start", start, (len(problem.state_names),))
    found = restated(problem, first, dict(parameters or {}))
    problem, first, values = found[0], found[1].at(found[1].places)[0], found[2]
    values = {**problem.parameters, **values}
    field = _field(problem, values)
    if problem.period is None:
        settled = state_after(field, first, settle)
        times, states = _one_round(field, settled, settle, periods_of(problem))
        values[PERIOD] = float(times[-1])
    else:
        (times, states), values[ROUNDS] = _forced_rounds(problem, field, (first, settle), values)
    states = states - whole_rounds(states[0], periods_of(problem))  # begins in the first round
    given = {name: value for name, value in values.items() if name not in winding_names(problem.angles)}  # as the motion has
    return solve(problem, (times / times[-1], states), given, intervals=intervals, degree=degree)


def _field(problem: CycleProblem, values: Mapping[str, float]) -> Field:
    """Return the field of a problem."""
    of_state, p, field = named_values(problem.state_names), named_values(tuple(values))(**values), problem.field
    own = {**values, PERIOD: float(problem.order), ROUNDS: 1.0}
    given = problem.batch("field"), np.array([own[name] for name in problem.parameters])
    if problem.period is None:
        return Field(lambda t, u: field(of_state(*u), p), *given, 1.0)
    return Field(lambda t, u: field(t, of_state(*u), p), *given, problem.duration(own))


def _looks(times: Array, states: Array, periods: Array) -> Array:
    """Return the steps (K,) of a motion (n, K), divided where an angle goes round by more than a part of its period."""
    advance = np.abs(np.diff(states, axis=1)) / np.where(periods > 0, periods, np.inf)[:, None]
    pieces = np.ceil(_PER_ROUND * advance.max(axis=0)).astype(int).clip(1)
    starts = np.repeat(times[:-1], pieces)
    within = np.concatenate([np.arange(count) / count for count in pieces])
    return np.append(starts + within * np.repeat(np.diff(times), pieces), times[-1])


def _forced_rounds(
    problem: CycleProblem, field: Field, start: tuple[Array, float], values: Mapping[str, float]
) -> tuple[tuple[Array, Array], int]:
    """Return times (K,), from 0, and states (K, n) of a forced motion that has settled, and after how many periods it closes.

    ``start`` holds the states and the time in which the motion settles, which is made a whole number of periods.
    """
    period = problem.duration({**values, ROUNDS: 1.0})
    settled = state_after(field, start[0], period * math.ceil(start[1] / period))
    done = integrated(field, settled, period * _MOST_ROUNDS, LOCATED)
    periods = periods_of(problem)
    size = _size(done.y, periods) or 1.0
    for rounds in range(1, _MOST_ROUNDS + 1):
        if np.abs(_apart(done.sol(rounds * period), settled, periods)).max() <= ROUGH * size:
            times = np.linspace(0.0, rounds * period, SAMPLES)
            return (times, done.sol(times).T), rounds
    raise ProblemError(
        f"start: the motion does not close within {_MOST_ROUNDS} periods of the forcing; give a larger settle, or a start "
        "nearer to the cycle (it may be unstable, or the motion not periodic)"
    )


def _size(states: Array, periods: Array) -> float:
    """Return the size of a motion (n, K): an angle that goes round has its period."""
    return float(np.minimum(np.ptp(states, axis=1), np.where(periods > 0, periods, np.inf)).max())


def _apart(states: Array, start: Array, periods: Array) -> Array:
    """Return differences of states (..., n) from the start, those of angles up to whole rounds."""
    apart = states - start
    return apart - whole_rounds(apart, periods)


def _one_round(field: Field, start: Array, longest: float, periods: Array) -> tuple[Array, Array]:
    """Return times (K,), from 0, and states (K, n) of one round of a motion that has settled.

    A round ends where the motion comes back through the plane normal to it at its start, close to the start; angles come back
    up to whole rounds.
    """
    across = np.asarray(field.rates(0.0, start), dtype=float)
    for part in _PARTS:
        done = integrated(field, start, part * longest, LOCATED)
        size = _size(done.y, periods)
        rests = size <= SETTLES * (1 + np.abs(start).max())

        def height(t: Array, sol: Callable[[Array], Array] = done.sol) -> Array:
            return across @ _apart(sol(t).T, start, periods).T

        for t in () if rests else passages(_looks(done.t, done.y, periods), height):
            if np.abs(_apart(done.sol(t), start, periods)).max() <= _CLOSED * size:
                times = np.linspace(0.0, t, SAMPLES)
                return times, done.sol(times).T
    if rests:
        raise ProblemError(f"start: the motion from there comes to rest near {', '.join(f'{value:.6g}' for value in start)}")
    raise ProblemError(
        f"start: the motion does not come back to where it was within t = {longest:g}; give a larger settle, or a start nearer "
        "to the cycle (it may be unstable, or the motion not periodic)"
    )
