"""Ends of branches of cycles: at homoclinic orbits, where the period runs away, and at Hopf points.

Near an equilibrium a cycle is slow. On its way to a homoclinic orbit, or to a saddle-node on it, the least speed falls without
bound; where its square is round-off, the parameter no longer tells the cycle from the homoclinic orbit, and special points of
longer cycles mean nothing.

Where cycles shrink onto an equilibrium, at a Hopf point, the amplitude, the projection of a cycle on an earlier one of the run,
passes zero along the branch: beyond the Hopf point is the same branch again, half a period on. The equations of cycles are
singular at the equilibrium (the period is arbitrary there), and their solutions are known the less exactly the smaller the
cycle is. So the place is taken from the amplitude on the cubic through both ends of a step, and the point from its own
equations, which are regular:

1. Find the zero of the amplitude on the cubic. The cycle there, but for its mean, is left out.
2. Find the equilibrium F(u, p) = 0 by Newton's method, for the value of the parameter.
3. Change the parameter, by the secant method, until the pair of eigenvalues nearest to +-2 pi i / T is imaginary; go to 2.
"""

from __future__ import annotations

import dataclasses
import functools
import math
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from contin.arrays import Array, ComplexArray
from contin.core.labels import Label
from contin.core.newton import correct, nearest_zero
from contin.core.protocol import inner
from contin.core.step import Reason, State, Stop
from contin.core.trial import Event, Trial, linearization
from contin.errors import ConvergenceError
from contin.events.arc import OFF, Arc, SpecialPoint, find_zero
from contin.levels import APART, CORRECTED, DOUBLED, LOCATED, MOST_UPDATES, ROUND_OFF, TINY
from contin.linalg.matrices import eigenvalues
from contin.linalg.orientation import first_least
from contin.problems.angles import whole_rounds
from contin.problems.statement import PERIOD

if TYPE_CHECKING:
    from contin.cycles.equations import CycleCollocation

#: A branch ends where the least speed of a cycle is below this part of the largest: the square root of round-off. Ten times
#: larger, homoclinic points are known to 1e-14 and not to the last digit.
STILL = 1e-8
#: A cycle is looked at where its least speed is below this part of the largest, ...
_SLOW = 0.05
#: ... and is near an equilibrium while it is closer than this part of its size, ...
_NEAR = 0.1
#: ... which counts where that takes at least this part of the period.
_MOSTLY = 0.5
#: The rate at which the parameter approaches its limit is measured over this part of the period, ...
_PART = 0.01
#: ... and must fit an eigenvalue: dp/dT changes by 2 to the power 1 +- this where exp(-k T) does by 2.
_MISFIT = 0.25


@dataclass(frozen=True, eq=False)
class RestingPlace:
    """The equilibrium near which a cycle spends most of its time.

    - ``states`` (ndarray, shape (n,))
    - ``eigenvalues`` (ndarray of complex, shape (n,)): Those of the equilibrium, the largest real part first.
    - ``share`` (float): Part of the period that the cycle is near.
    - ``passes`` (int): How often it comes near in a period: twice where two saddles are one, as at the angles -pi and pi.
    - ``fold`` (bool): The equilibrium is that of a saddle-node, beside the value of the parameter.
    """

    states: Array
    eigenvalues: ComplexArray
    share: float
    passes: int = 1
    fold: bool = False

    def describe(self, names: tuple[str, ...]) -> str:
        """Return all that as a sentence."""
        place = ", ".join(f"{name} = {value:.6g}" for name, value in zip(names, self.states))
        upper = [value for value in self.eigenvalues if value.imag >= 0]
        values = ", ".join(f"{value.real:.6g}" + (f" +- {value.imag:.6g} i" if value.imag else "") for value in upper)
        kind = ", at a fold of equilibria" if self.fold else ""
        return f"the cycle spends {100 * self.share:.3g} % of its time near the equilibrium {place}{kind}, eigenvalues {values}"


@functools.cache  # one for all runs
def homoclinic() -> Event:
    """Return the test function that ends a branch of cycles at a homoclinic orbit, unless the user has limited the period."""
    return Event(Label.END, "homoclinic orbit", _liveliness, terminal=True, unless=PERIOD, still=STILL)


def _liveliness(trial: Trial) -> float:
    """Return a number that is positive where the least speed of a cycle can be told from zero.

    The slow stretches of relaxation oscillations are beside no equilibrium, and end nothing.
    """
    system: Any = trial.system
    speeds = _speeds(system, trial.x)
    if not speeds.min() > 0:
        return 1.0
    value = float(np.log10(speeds.min() / speeds.max() / STILL))
    return value if value > 0 or resting_place(system, trial.x) is not None else 1.0


def is_still(trial: Trial) -> bool:
    """Return whether an autonomous cycle cannot be told from a homoclinic orbit, so that its multipliers mean nothing."""
    return bool(trial.system.autonomous and trial.system.intervals) and _liveliness(trial) <= 0


def _speeds(system: Any, x: Array) -> Array:
    """Return the speeds of a cycle at the Gauss points, scaled, shape (N d,)."""
    return np.linalg.norm(system.rates(x, system.at_gauss_points(x)), axis=1)


def equilibrium_beside(system: CycleCollocation, x: Array) -> tuple[Array, ComplexArray] | None:
    """Return the equilibrium that Newton's method finds from where a cycle is slowest; None where it finds none.

    That is its states (n,), divided by their sizes, and its eigenvalues (n,), the largest real part first.
    """
    points = system.at_gauss_points(x)
    size = np.ptp(points, axis=0)
    slowest = points[first_least(_speeds(system, x))]
    states = nearest_zero(lambda u: (system.rates(x, u[None])[0], system.rates_by_states(x, u[None])[0]), slowest)
    if states is None:
        return None
    return np.where(np.abs(states) > CORRECTED * np.where(size > 0, size, 1.0), states, 0.0), _spectrum(system, x, states)


def _spectrum(system: CycleCollocation, x: Array, states: Array) -> ComplexArray:
    """Return the eigenvalues of an equilibrium, the largest real part first."""
    values = eigenvalues(system.rates_by_states(x, states[None])[0]) / system.unit_time(x)
    return values[np.argsort(-values.real)]


def _fold_beside(system: CycleCollocation, x: Array) -> tuple[Array, ComplexArray] | None:
    """Return the equilibrium of a saddle-node beside a cycle, as `equilibrium_beside` does; None where there is none.

    Beyond a saddle-node there is no equilibrium. That of the nearest value of the parameter p comes from Newton's method for
    F(u, p) = 0 with the smallest updates of u and p. On slow stretches of relaxation oscillations it is far away.
    """
    at = next(system.parameter_index(name) for name in system.free if name != PERIOD)
    slowest = system.at_gauss_points(x)[first_least(_speeds(system, x))]
    step = np.sqrt(np.finfo(float).eps) * (1 + abs(x[at]))

    def with_parameter(value: float) -> Array:
        y = x.copy()
        y[at] = value
        return y

    def linearized(z: Array) -> tuple[Array, Array]:
        here, ahead, states = with_parameter(z[-1]), with_parameter(z[-1] + step), z[None, :-1]
        rates = system.rates(here, states)[0]
        slope = (system.rates(ahead, states)[0] - rates) / step
        return rates, np.column_stack([system.rates_by_states(here, states)[0], slope])

    found = nearest_zero(linearized, np.append(slowest, x[at]))
    if found is None or not abs(found[-1] - x[at]) <= APART * (1 + abs(x[at])):
        return None
    return found[:-1], _spectrum(system, with_parameter(found[-1]), found[:-1])


def resting_place(system: CycleCollocation, x: Array) -> RestingPlace | None:
    """Return the equilibrium near which a cycle spends most of its time; None where there is none."""
    points, speeds = system.at_gauss_points(x), _speeds(system, x)
    if not speeds.min() < _SLOW * speeds.max():
        return None
    found = equilibrium_beside(system, x)
    fold = found is None
    found = _fold_beside(system, x) if found is None else found
    if found is None:
        return None
    states, eigenvalues = found
    size = np.ptp(points, axis=0)
    apart = points - states
    apart = apart - whole_rounds(apart, system.circles)
    near = np.abs(apart / np.where(size > 0, size, 1.0)).max(axis=1) < _NEAR
    share = float(system.gauss_weights @ near)
    if share < _MOSTLY:
        return None
    passes = max(int(np.count_nonzero(near & ~np.roll(near, 1))), 1)
    return RestingPlace(states * system.scales.states, eigenvalues, share, passes, fold)


@dataclass(frozen=True)
class Limit:
    """The value that a parameter tends to as the period grows without bound, with an estimate of its error."""

    name: str
    value: float
    error: float

    def describe(self) -> str:
        """Return it as a clause."""
        places = int(np.clip(1 - np.floor(np.log10(max(self.error, 1e-15))), 0, 15))
        return f"as the period grows, {self.name} tends to {self.value:.{places}f} +- {self.error:.1g}"


def limit_of_parameter(system: CycleCollocation, x: Array, place: RestingPlace) -> Limit | None:
    """Return the limit of the free parameter p on a branch that tends to a homoclinic orbit; None where it is not known.

    Near a saddle p - limit = A exp(-k T), so that the limit is p + (dp/dT) / k; k is an eigenvalue's real part, up to its sign,
    over the number of passes in a period. It is the eigenvalue nearest to the imaginary axis, unless the orbit has no part in
    its direction: the one is taken that fits how dp/dT changes with T. Near a fold or a branch point of equilibria, k goes to
    zero with the distance, and p tends to its limit like a power of T. There is no extrapolation where no k fits, nor where k
    at the limit is so different that exp(-k T) is, too. The error is what the misfit, the mesh, halved, and Newton's method
    leave. Of a complex leading eigenvalue p oscillates, and is not extrapolated.
    """
    if place.fold:
        return None
    eigenvalues, name = place.eigenvalues, next(name for name in system.free if name != PERIOD)
    rates, period = np.abs(eigenvalues.real) / (system.order * place.passes), system.duration(x)
    if eigenvalues[rates.argmin()].imag or not rates.min() > 0 or len(set(np.sign(eigenvalues.real))) < 2:
        return None
    at, size = system.parameter_index(name), system.free_scales[system.free.index(name)]
    finer, carry = system.refined()
    try:
        here, slope = _at_period(system, x, at, 0.0)
        fitted = np.log(max(_at_period(system, x, at, _PART * period)[1] / slope, TINY)) / (_PART * period)
        which = np.argmin(np.where(eigenvalues.imag == 0, np.abs(rates - fitted), np.inf))
        k = rates[which]
        steeper = _at_period(system, x, at, np.log(2) / k)[1]
        better, flat = _at_period(finer, carry(x), finer.parameter_index(name), 0.0)
    except ConvergenceError:
        return None
    limit, there = better + flat / k, x.copy()
    there[at] = limit / size
    found = equilibrium_beside(system, there)
    if found is None:
        return None
    drift = period * abs(abs(found[1][which].real) / (system.order * place.passes) - k)
    misfit, reach = abs(np.log2(max(steeper / slope, TINY)) - 1) + drift, abs(slope) / k
    if misfit > _MISFIT and reach > CORRECTED * size:
        return None
    error = misfit * reach + abs(here + slope / k - limit) + CORRECTED * size
    return Limit(name, float(limit), float(error)) if np.isfinite(error) else None


def explained(system: CycleCollocation, stop: Stop, x: Array) -> Stop:
    """Return the end of a branch, where the period runs away with the equilibrium near which the cycle spends its time.

    With the limit of the parameter, if it is known.
    """
    place = None if system.has_shrunk(x) else resting_place(system, x)
    if place is None:
        return stop
    message = f"{stop.message}; {place.describe(system.problem.state_names)}"
    limit = limit_of_parameter(system, x, place)
    if limit is None:
        return dataclasses.replace(stop, message=message)
    details = {f"limit_{limit.name}": limit.value, f"limit_{limit.name}_error": limit.error}
    return dataclasses.replace(stop, message=f"{message}; {limit.describe()}", details=details)


def _at_period(system: CycleCollocation, x: Array, at: int, less: float) -> tuple[float, float]:
    """Return the parameter p at a place of the unknowns, and dp/dT, at a period that is shorter by ``less``.

    Raises ConvergenceError where there is none.
    """
    row, of_period = np.zeros(system.size), system.parameter_index(PERIOD)
    p_size, size = system.free_scales[[i - system.state_size for i in (at, of_period)]]
    row[of_period] = 1.0
    tangent = linearization(system, x, row).tangent
    guess = x - tangent / tangent[of_period] * less / size
    found = correct(system, guess, row, guess[of_period]).x
    tangent = linearization(system, found, row).tangent
    return float(p_size * found[at]), float(p_size / size * tangent[at] / tangent[of_period])


#: The size of a cycle as a part of an earlier one of the run, with a sign.
AMPLITUDE = Event(Label.HOPF, "Hopf", lambda trial: trial.system.amplitude(trial.x))  # of cycles


def hopf_point_inside(system: CycleCollocation, arc: Arc) -> SpecialPoint | None:
    """Return the Hopf point inside a step of a branch of cycles, or None."""
    before, trial = arc.before.value(AMPLITUDE), arc.trial.value(AMPLITUDE)
    if not before > 0 > trial:
        return None
    try:
        at = find_zero(lambda s: system.amplitude(arc.guess(s)), (arc.low, before), (arc.step, trial), arc.precision)
        x, frequency, error = _hopf_point(system, arc.guess(at))
    except ConvergenceError:
        return None
    return _end(system, at, x, frequency, error) if arc.passes_by(x, at) else None


def hopf_point_ahead(system: CycleCollocation, state: State, step: float) -> SpecialPoint | None:
    """Return the Hopf point to which the tangent leads within a step, or None.

    No step passes it where the parameter changes like the size of the cycles: beyond, the branch comes back.
    """
    size, rate = system.amplitude(state.x), system.amplitude(state.tangent)
    at = -size / rate if rate < 0 else np.inf
    if not 0 < at <= step:
        return None
    guess = state.x + at * state.tangent
    try:
        x, frequency, error = _hopf_point(system, guess)
    except ConvergenceError:
        return None
    is_near = inner(system, x - guess, x - guess) <= (OFF * at) ** 2
    return _end(system, at, x, frequency, error) if is_near else None


def _end(system: CycleCollocation, at: float, x: Array, frequency: float, error: Array) -> SpecialPoint:
    stop = Stop(Reason.HOPF, "the cycles shrink onto an equilibrium, a Hopf point")
    there, details = Trial.without_tangent(system, x), {"frequency": frequency, "pairs": 1}
    sizes = dict(zip(system.free, map(float, error * system.free_scales)))
    return SpecialPoint(at, Label.HOPF, "Hopf", there, stop, details, errors=sizes)


def shrunk(system: CycleCollocation, point: SpecialPoint) -> SpecialPoint:
    """Return a special point, as the end of the branch where cycles have shrunk onto an equilibrium.

    Beyond the Hopf point the branch is itself, half a period later.
    """
    if not system.has_shrunk(point.trial.x):
        return point
    stop = Stop(Reason.HOPF, "the cycles shrink onto an equilibrium, a Hopf point")
    return dataclasses.replace(point, label=Label.HOPF, name="Hopf", stop=stop)


def _hopf_point(system: CycleCollocation, guess: Array) -> tuple[Array, float, Array]:
    """Return the unknowns of the Hopf point near a small cycle, its frequency, and the errors of the free parameters.

    Raises ConvergenceError where there is none.
    """
    n, size, period = len(system.problem.state_names), system.state_size, system.parameter_index(PERIOD)
    at = next(i for i in range(size, system.size) if i != period)
    x = guess.copy()
    states = x[:size].reshape(-1, n)
    states[:] = system.weights[:size:n] @ states
    expected = 2j * math.pi / system.order

    def critical(value: float) -> complex:
        """Put the equilibrium for a value of the parameter into ``states``; return the eigenvalue nearest to the expected."""
        x[at] = value
        here = nearest_zero(lambda u: (system.rates(x, u[None])[0], system.rates_by_states(x, u[None])[0]), states[0])
        if here is None:
            raise ConvergenceError("no equilibrium is found near the cycle")
        states[:] = here
        values = np.linalg.eigvals(system.rates_by_states(x, here[None])[0])
        return complex(values[np.abs(values - expected).argmin()])

    first = float(x[at])
    last, step = critical(first), DOUBLED * (1 + abs(first))
    for _ in range(MOST_UPDATES):
        found = critical(float(x[at]) + step)
        change = found.real - last.real
        if abs(step) <= ROUND_OFF * (1 + abs(x[at])) or change == 0:
            break
        step, last = -found.real * step / change, found
    if not abs(found.real) < LOCATED * abs(found.imag):
        raise ConvergenceError("no Hopf point is found near the cycle")
    x[period] *= expected.imag / found.imag
    frequency = 2 * math.pi / float(system.all_parameters(x)[list(system.problem.parameters).index(PERIOD)])
    errors = np.zeros(len(system.free))
    errors[at - size] = abs(step) + np.finfo(float).eps * (1 + abs(x[at]))
    errors[period - size] = np.finfo(float).eps * abs(x[period]) * (1 + abs(found))
    return x, frequency, errors
