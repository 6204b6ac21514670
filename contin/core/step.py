"""The parts of one step of pseudo-arclength continuation: predictor, corrector, and how far a corrected point is believed.

With the tangent t of the last point x the corrector solves F(z) = 0 together with t.(z - x) = step, in the weighted inner
product. The bordered matrix [F_x; row], row.v = t.v, is regular along the curve, folds included, and gives the next tangent.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import NamedTuple

import numpy as np

from contin.arrays import Array
from contin.core.newton import Corrected, Newton, correct
from contin.core.protocol import Discretization
from contin.core.settings import Settings
from contin.core.small import corrected_small
from contin.core.state import State
from contin.core.trial import Linearization, Trial, linearization, linearization_of
from contin.errors import ConvergenceError
from contin.functions.kernel import kernel
from contin.functions.kernel_parts import ReadOnlyVector, Vector, helper
from contin.levels import APART, CORRECTED, TINY
from contin.linalg.dense import DenseFactors
from contin.linalg.factors import Factors

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
#: Rates of the primary parameter above this are significant without a closer look (`contin.events.significance`). Ten times
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
    done = correct(state.system, guess, row, row @ state.x + step, newton, linearize=True)
    return trial_of(state.system, done, row)


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
