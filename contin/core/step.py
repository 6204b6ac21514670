"""One step: the state before it, predictor and corrector, points on a mesh with switches, and why a run stops.

The parts of one step of pseudo-arclength continuation: predictor, corrector, and how far a corrected point is believed.

With the tangent t of the last point x the corrector solves F(z) = 0 together with t.(z - x) = step, in the weighted inner
product. The bordered matrix [F_x; row], row.v = t.v, is regular along the curve, folds included, and gives the next tangent.

A point of a curve on a mesh with points where conditions that the solution decides switch.

Where such a condition switches inside an interval, the discrete equations have errors of their own that jump from place to
place. So each point of a curve is corrected again on a mesh with points there. As mesh points move with the solution, two
points of a step are on two meshes; what is searched between them sees each as carried back to the mesh of the step.
"""

from __future__ import annotations

import dataclasses
import enum
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np

from contin.arrays import Array
from contin.core.newton import Corrected, Newton, correct
from contin.core.protocol import Discretization, inner
from contin.core.settings import Settings
from contin.core.small import corrected_small
from contin.core.trial import Linearization, Trial, linearization, linearization_of
from contin.errors import ConvergenceError
from contin.functions.kernel import kernel
from contin.functions.kernel_parts import ReadOnlyVector, Vector, helper
from contin.levels import APART, CORRECTED, TINY
from contin.linalg.blocks import Factors
from contin.linalg.matrices import DenseFactors


@dataclass(frozen=True, eq=False)
class State:
    """Everything that the next step depends on; with it a run continues as if never interrupted.

    Attributes
    ----------
    system : Discretization
    x, tangent : ndarray, shape (size,)
        The last point and its unit tangent.
    previous_tangent : ndarray, shape (size,), or None
        That of the point before, on the same system.
    previous_step, step : float
        The last step and the next one to try.
    sign : float
        Sign of the determinant of [F_x; row] at x.
    arclength : float
        Distance from the first point of the branch.
    accepted : int
        Number of regular points.
    singular : bool
        x is a branch point.
    sense : float
        The sign in which the primary parameter went where that could be told last; zero where it never could.
    sensed : ndarray, or None
        The free parameters there, in the user's units.
    discretization_error : float
        Estimated error of the point that is due to the mesh; NaN where it is not known.

    Examples
    --------
    >>> from contin import AlgebraicProblem, Settings
    >>> from contin.lowlevel import Algebraic, Continuation
    >>> parabola = AlgebraicProblem(lambda u, p: (p.a - u.x**2,), ["x"], {"a": 1.0})
    >>> system, settings = Algebraic(parabola, ["a"]), Settings(direction=-1, limits={"a": (-1, 4)})
    >>> run = Continuation(system, np.array([1.0, 1.0]), settings)
    >>> for point in run:
    ...     if run.state.accepted == 3:
    ...         break
    >>> rest = Continuation(system, np.array([1.0, 1.0]), settings, state=run.state)  # goes on where the other one is
    >>> rest.state.accepted == run.state.accepted
    True
    """

    system: Discretization
    x: Array
    tangent: Array
    previous_tangent: Array | None
    previous_step: float
    step: float
    sign: float
    arclength: float
    accepted: int
    singular: bool
    sense: float = 0.0
    sensed: Array | None = None
    discretization_error: float = np.nan

    def __repr__(self) -> str:
        return f"State({self.system!r}, {self.accepted} points, arclength {self.arclength:.6g}, step {self.step:.3g})"

    @property
    def row(self) -> Array:
        """The row that borders F_x: its product with a vector is the inner product with the tangent."""
        return self.system.weights * self.tangent


def standing_at(system: Discretization, x: Array, tangent: Array, step: float) -> State:
    """Return the state of a run that stands at x and has not made a step yet."""
    return State(system, x, tangent, None, 1.0, step, np.nan, 0.0, 0, False)


class Reason(enum.StrEnum):
    """Why a run ended, in short; each is a string, too. Whoever steers runs may have others.

    Examples
    --------
    >>> from contin import AlgebraicProblem, solve, trace
    >>> circle = AlgebraicProblem(lambda u, p: (u.x**2 + p.a**2 - 1,), ["x"], {"a": 0.0})
    >>> trace(solve(circle, [1.0]), free=["a"]).stop.reason == Reason.CLOSED
    True
    """

    LIMIT = "limit"
    EVENT = "event"
    CLOSED = "closed"
    MAX_POINTS = "max points"
    INFINITY = "infinity"
    NO_CONVERGENCE = "no convergence"
    STANDSTILL = "standstill"
    TRIVIAL_BRANCH = "trivial branch"
    KNOWN_BRANCH = "known branch"
    PITCHFORK = "pitchfork"
    PERIOD_DOUBLING = "period doubling"
    HOPF = "Hopf"
    INTERRUPTED = "interrupted"

    __repr__ = str.__repr__


@dataclass(frozen=True)
class Stop:
    """Why a run ended: a short ``reason``, a sentence, what could be changed, and numbers for the details of the last point.

    ``event`` is the name of what was met, if the reason is an event.

    Examples
    --------
    >>> from contin import AlgebraicProblem, solve, trace
    >>> parabola = AlgebraicProblem(lambda u, p: (p.a - u.x**2,), ["x"], {"a": 1.0})
    >>> branch = trace(solve(parabola, [1.0]), free=["a"], direction=-1, limits={"a": (-1, 4)})
    >>> branch.stop.reason, str(branch.stop)
    ('limit', 'reached a = 4')
    """

    reason: Reason | str
    message: str
    advice: str = ""
    details: Mapping[str, float] = field(default_factory=dict)
    event: str = ""

    def __str__(self) -> str:
        return f"{self.message}; {self.advice}" if self.advice else self.message


#: Smallest size of a cycle as a part of that before the step. A branch that ends at a Hopf point is this near to it at the end
#: of a step by chance only, and the step is halved then; Newton's method that falls onto an equilibrium is nearer by far.
COLLAPSED = 1e-3
#: Share of the states in a unit tangent below which their direction is not compared: the states hardly take part in the step.
_STILL = 0.01
#: A step ends at this many times the distance to a limit, along the tangent, at most: beyond it, and not much. Ten times
#: larger, a parameter that the equations divide by went through zero, and three branch points before it were lost.
_BEYOND = 1.25
#: A corrected point this many times further from its prediction than aimed at is not believed: it may lie on another branch.
ASTRAY = 2.5
#: Rates of the primary parameter above this are significant without a closer look (`contin.events.folds`). Ten times
#: larger, more steps on a mesh take twice as long.
CLEAR = 1e-6
#: Bounds on the factor from one step to the next, and the part of the largest angle that a step aims at.
_SHORTER, _LONGER, _AIM = 0.3, 2.0, 0.8
#: Part of its change in a step by which the primary parameter may miss its prediction. From a fold, where nothing is known of
#: the curvature, it is one half.
_MISSED = 0.75
#: Part of their own change by which states alone may miss their prediction, over that of the whole step. Where a large
#: parameter makes the norm they could miss it by all of their size: of 600 runs of a reactor whose residence time goes to 500,
#: 152 jumped over a fold to another branch, 11 with this; 17 with 5, with 4 % fewer points.
_LOOSE = 4.0
#: Numbers that `fill_sums` fills.
SUMS = 7


def aims(settings: Settings, system: Discretization) -> tuple[float, float]:
    """Return the largest angle between tangents, and the part of a step by which it aims to miss its prediction."""
    angle, accuracy = system.aims
    return settings.angle or angle, settings.accuracy or accuracy


def predict(state: State, step: float) -> Array:
    """Return the guess at a distance ``step``: along the tangent, with the curvature known from the last step."""
    guess = state.x + step * state.tangent
    if state.previous_tangent is not None:
        guess += (step**2 / (2 * state.previous_step)) * (state.tangent - state.previous_tangent)
    return guess


def up_to_limits(state: State, limits: Mapping[str, Sequence[float]], least: float) -> float:
    """Return the state's step, shortened where it leads far beyond the limit of a free parameter, but not below ``least``.

    The equations may have no meaning there, and what lies between the limit and the end of the step is not looked for. The
    parameter is extrapolated as in `predict`: a fold may come before the limit, and then no step is shortened.
    """
    system, step = state.system, state.step
    for name in set(system.free) & set(limits):
        at = system.parameter_index(name)
        size = system.free_scales[at - system.state_size]
        rate, value = state.tangent[at] * size, state.x[at] * size
        earlier = state.previous_tangent
        bend = 0.0 if earlier is None else (rate - earlier[at] * size) / (2 * state.previous_step)
        with np.errstate(over="ignore"):  # a limit may be the largest number
            step = up_to(step, rate, bend, limits[name][int(rate > 0)] - value)
    return max(step, least)


@helper
def up_to(step: float, rate: float, bend: float, room: float) -> float:
    """Return a step, shortened where it leads far beyond the limit of a parameter, which has so much room."""
    square = rate * rate + 4 * bend * room
    if rate * room > 0 and square >= 0:
        return min(step, _BEYOND * 2 * room / (rate + math.copysign(math.sqrt(square), rate)))
    return step


def corrected(state: State, guess: Array, step: float, newton: Newton) -> Trial:
    """Return the point of the curve at ``step`` along the state's tangent, linearized right there.

    Raises
    ------
    ConvergenceError
        It is not found, or the equations are not finite there.
    """
    row = state.row
    small = corrected_small(state.system, guess, row, row @ state.x + step, newton)
    if small is not None:
        linear = Linearization(small.tangent, small.sign, DenseFactors(small.matrix))
        return Trial(state.system, small.x, linear, small.iterations, small.error)
    return trial_of(state.system, correct(state.system, guess, row, row @ state.x + step, newton, linearize=True), row)


def trial_of(system: Discretization, done: Corrected, row: Array) -> Trial:
    """Return the trial of a corrected point, linearized right there: Newton's last factors are those of an iterate before.

    Raises
    ------
    ConvergenceError
        The equations are not finite there.
    """
    if done.tangent is not None:
        linear = Linearization(done.tangent, done.factors.sign, done.factors)
        return Trial(system, done.x, linear, done.iterations, done.error)
    residual, factors = system.linearize(done.x, (row,))
    if not np.isfinite(residual).all():
        raise ConvergenceError("the equations are not finite at the corrected point")
    return Trial(system, done.x, linearization_of(system, factors), done.iterations, done.error)


def located(state: State, guess: Array, step: float, newton: Newton, factors: Factors | None = None) -> Trial:
    """Return the point of the curve at ``step``, linearized right there: when that is first asked for, if it takes long.

    ``factors`` from near by save Newton's method its own.

    Raises
    ------
    ConvergenceError
    """
    row = state.row
    small = corrected_small(state.system, guess, row, row @ state.x + step, newton)
    if small is not None:
        return Trial(state.system, small.x, Linearization(small.tangent, small.sign), small.iterations, small.error)
    system = state.system
    done = correct(system, guess, row, row @ state.x + step, newton, factors)
    return Trial(system, done.x, lambda: linearization(system, done.x, row), done.iterations, done.error)


class Judgement(NamedTuple):
    """What a step is judged by.

    Attributes
    ----------
    missed : float
        Distance from the prediction to the corrected point; that of the states alone, as `missed_of` compares it, where larger.
    turn : float
        Angle between the tangents at both ends: the larger of the whole one and half that of the states alone. Where parameters
        are large they dominate the norm, and tangents of different branches can look parallel.
    length : float
        Distance between both ends.
    """

    missed: float
    turn: float
    length: float


def judged(state: State, guess: Array, trial: Trial) -> Judgement:
    """Return what the step from a state to a corrected point is judged by."""
    system, sums = state.system, np.empty(SUMS)
    fill_sums(BothEnds(state.x, state.tangent, trial.x, trial.tangent, guess), system.weights, system.state_size, sums)
    missed, whole, part, first, last, chord, of_states = sums.tolist()
    return Judgement(missed_of(missed, of_states, first, last), turned(whole, part, first, last), math.sqrt(chord))


@helper
def turned(whole: float, part: float, first: float, last: float) -> float:
    """Return the angle between tangents, as `Judgement` describes it, from what `fill_sums` gives."""
    sizes = math.sqrt(first), math.sqrt(last)
    cosine = part / (sizes[0] * sizes[1]) if min(sizes[0], sizes[1]) > _STILL else 1.0
    return max(_angle(whole), _angle(cosine) / 2)


@helper
def missed_of(missed: float, of_states: float, first: float, last: float) -> float:
    """Return the distance from the prediction to the corrected point, from what `fill_sums` gives.

    States that go slowly beside a parameter are compared with their own rate, at the end of the step where it is larger.
    """
    if of_states <= APART * APART:
        return math.sqrt(missed)
    return math.sqrt(max(missed, of_states / (_LOOSE * _LOOSE * max(first, last) + TINY)))


@helper
def is_astray(missed: float, change: float, error: float, value: float) -> bool:
    """Return whether a parameter misses its prediction by much of what it changes at all, and by more than round-off.

    ``error`` is that of Newton's method, ``value`` the parameter.
    """
    return missed > _MISSED * change and missed > (CORRECTED + 2 * error) * (1 + abs(value))


@helper
def longest_step(longest: float, change: float, value: float, rate: float) -> float:
    """Return the longest step, shortened so that a parameter changes by no more than this part of 1 + its size."""
    return min(longest, change * (1 + abs(value)) / (abs(rate) + TINY))


@helper
def following_step(
    step: float, missed: float, turn: float, order: int, accuracy: float, angle: float, shortest: float, longest: float
) -> float:
    """Return the next step: one whose prediction, with an error of this order, misses ``accuracy`` of it."""
    factor = _LONGER if missed == 0 else (accuracy * step / missed) ** (1 / order)
    factor = min(factor, _AIM * angle / max(turn, CORRECTED))
    return min(max(step * min(max(factor, _SHORTER), _LONGER), shortest), max(longest, shortest))


class BothEnds(NamedTuple):
    """Both ends of a step with their unit tangents, and the prediction of the second."""

    x: ReadOnlyVector
    tangent: ReadOnlyVector
    last: ReadOnlyVector
    last_tangent: ReadOnlyVector
    guess: ReadOnlyVector


@kernel
def fill_sums(ends: BothEnds, weights: ReadOnlyVector, states: int, sums: Vector) -> None:
    """Fill the weighted inner products that `judged` uses.

    |guess - last|^2, t.T of the tangents, and of the states alone t.T, |t|^2, |T|^2; |c|^2 of the chord;
    |guess - last|^2 of the states alone.
    """
    fill_sums_of(ends.x, ends.tangent, ends.last, ends.last_tangent, ends.guess, weights, states, sums)


@helper
def fill_sums_of(
    x: Array, tangent: Array, last: Array, last_tangent: Array, guess: Array, weights: Array, states: int, sums: Array
) -> None:
    """Fill what `fill_sums` fills."""
    missed, whole, chord, of_states = 0.0, 0.0, 0.0, 0.0
    part, first_size, last_size = 0.0, 0.0, 0.0
    for i in range(x.size):
        weight, one, other = weights[i], tangent[i], last_tangent[i]
        gap, gone = guess[i] - last[i], last[i] - x[i]
        missed += weight * gap * gap
        whole += weight * one * other
        chord += weight * gone * gone
    for i in range(states):
        weight, one, other = weights[i], tangent[i], last_tangent[i]
        part += weight * one * other
        first_size += weight * one * one
        last_size += weight * other * other
        of_states += weight * (guess[i] - last[i]) ** 2
    sums[0], sums[1], sums[2], sums[3] = missed, whole, part, first_size
    sums[4], sums[5], sums[6] = last_size, chord, of_states


@helper
def _angle(cosine: float) -> float:
    return math.acos(min(1.0, max(-1.0, cosine))) if cosine == cosine else math.nan  # noqa: PLR0124


#: Times that mesh points are moved to where conditions switch, at one point. At a corner the distance left is squared each
#: time, 1e-2, 1e-4, 1e-8 of the domain, so that three do. At a jump it falls by a factor of 10 to 30: twelve reach round-off.
ROUNDS = 12


def settled(trial: Trial, along: Array, newton: Newton) -> Trial:
    """Return a point as corrected on a mesh with points where conditions switch, and carried back to its own mesh.

    The same trial is returned where there is no need, and the last one that is found where Newton's method fails.

    Parameters
    ----------
    along : ndarray, shape (size,)
        The direction in which the point keeps its place: a tangent of the curve on the trial's mesh.
    """
    found = trial
    for _ in range(ROUNDS):
        moved = found.system.on_switches(found.x)
        if moved is None or moved[0].intervals != trial.system.intervals:  # more places than the mesh has points
            break
        system, carry = moved
        x, tangent = carry(found.x), trial.system.carrier(system)(along)
        row = system.weights * tangent / np.sqrt(inner(system, tangent, tangent))
        try:
            done = correct(system, x, row, row @ x, newton)
            found = trial_of(system, dataclasses.replace(done, iterations=trial.iterations, error=trial.newton_error), row)
        except ConvergenceError:
            break
    return trial if found is trial else _carried_back(trial, found)


def _carried_back(trial: Trial, found: Trial) -> Trial:
    """Return a point of another mesh on that of a trial."""
    system = trial.system
    carry = found.system.carrier(system)
    tangent = carry(found.tangent)
    tangent /= np.sqrt(inner(system, tangent, tangent))
    linear = Linearization(tangent, found.sign, found.factors)
    result = Trial(system, carry(found.x), linear, trial.iterations, trial.newton_error)
    result.settled = found
    return result
