"""A homoclinic orbit from its saddle: an orbit that leaves along the unstable direction is followed until it comes back.

With one unstable eigenvalue, and its right and left eigenvectors q and p,

1. Integrate from e + d q, or e - d q, to where the orbit comes closest to the saddle e again; m = p.(u - e) there.
2. Do so for values of the parameter, from the one at hand outwards, until m changes its sign between two of them: the orbit
   passes the stable manifold on one side, and then on the other.
3. Halve this interval until the orbit comes back close enough, for Newton's method to find the homoclinic orbit.

With one stable eigenvalue, time runs backwards. (AUTO-07p begins likewise, ISTART = 3, and grows the orbit by continuation.)
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np

from contin.arrays import Array
from contin.core.newton import nearest_zero
from contin.equilibria.system import Algebraic
from contin.errors import ConvergenceError, ProblemError
from contin.levels import DOUBLED, LOCATED, MOST_HALVINGS, ROUGH
from contin.linalg.orientation import oriented
from contin.problems.angles import periods_of, whole_rounds
from contin.results.point import Point
from contin.search.cycle import FAR

#: Most steps of the integration: orbits take a few hundred.
_STEPS = 10_000
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
    """The saddle of a point, and the single unstable or stable direction that orbits are grown along.

    Raises
    ------
    ProblemError
        It has none.
    """

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
        """Return the saddle at a value of the parameter, q and p with p.q = 1, and the eigenvalue.

        Raises
        ------
        ConvergenceError
            It is not found.
        """
        system = self._algebraic({**self.values, self.name: value})
        rest = nearest_zero(lambda u: (system.residual(u), system.jacobian(u)), guess)
        if rest is None:
            raise ConvergenceError(f"the equilibrium is not found at {self.name} = {value:.6g}")
        matrix = self.sense * system.jacobian(rest)
        found, vectors = np.linalg.eig(matrix)
        at = int(np.argmax(found.real))
        right = oriented(vectors[:, at].real)
        left = np.linalg.inv(vectors)[at].real
        return rest, right, left / (left @ right), float(found[at].real)

    def field(self, value: float) -> Any:
        """Return the rates of the states as an integrator calls them."""
        system = self._algebraic({**self.values, self.name: value})
        return lambda t, u: self.sense * system.residual(u)


def grown_orbit(start: Point, name: str, interval: tuple[float, float], direction: int) -> tuple[GrownOrbit, int]:
    """Return an orbit that comes back to the saddle ``start`` for some value of a parameter, and the number of unstable
    eigenvalues.

    Raises
    ------
    ProblemError
        The start is no saddle with a single unstable or stable eigenvalue.
    ConvergenceError
        No value in the interval has such an orbit.
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
    """Return the orbit at a value of the parameter up to its return; None where it does not come back.

    Raises
    ------
    ConvergenceError
        The saddle is not found.
    """
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
    from scipy.integrate import LSODA  # type: ignore[import-untyped]  # .3 s; only this needs it
    from scipy.optimize import brentq  # type: ignore[import-untyped]

    field = saddle.field(value)

    def approach(t: float, u: Array) -> float:
        return float(saddle.apart(u, rest) @ field(t, u))

    def distance(u: Array) -> float:
        return float(np.linalg.norm(saddle.apart(u, rest)))

    solver = LSODA(field, 0.0, start, longest, rtol=LOCATED, atol=LOCATED)
    times, states, farthest, last = [0.0], [start], 0.0, 1.0
    while solver.status == "running" and len(times) < _STEPS:
        solver.step()
        u, before = solver.y.copy(), last
        if solver.status == "failed" or not np.abs(u - rest).max() < FAR * (1 + np.abs(rest).max()):
            return None
        last, between = approach(solver.t, u), solver.dense_output()
        farthest = max(farthest, distance(u))
        if before < 0 <= last and approach(times[-1], between(times[-1])) < 0 < approach(solver.t, between(solver.t)):
            t = float(brentq(lambda t, between=between: approach(t, between(t)), times[-1], solver.t))
            if distance(between(t)) < _BACK * farthest:
                return np.array([*times, t]), np.array([*states, between(t)])
        times.append(float(solver.t))
        states.append(u)
    return None
