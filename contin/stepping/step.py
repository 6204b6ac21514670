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
from contin.discretization.protocol import Discretization
from contin.errors import ConvergenceError
from contin.functions.kernel import kernel
from contin.functions.kernel_parts import ReadOnlyVector, Vector
from contin.linalg.factors import Factors
from contin.stepping.newton import Corrected, Newton, correct
from contin.stepping.settings import Settings
from contin.stepping.state import State
from contin.stepping.trial import Linearization, Trial, linearization, linearization_of

#: Share of the states in a unit tangent below which their direction is not compared: the states hardly take part in the step.
_STILL = 0.01
#: A step ends at this many times the distance to a limit, along the tangent, at most: beyond it, and not much. Ten times
#: larger, a parameter that the equations divide by went through zero, and three branch points before it were lost.
_BEYOND = 1.25


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
            room = limits[name][int(rate > 0)] - value
            square = rate * rate + 4 * bend * room
            if rate * room > 0 and square >= 0:
                step = min(step, _BEYOND * 2 * room / (rate + math.copysign(math.sqrt(square), rate)))
    return max(step, least)


def corrected(state: State, guess: Array, step: float, newton: Newton) -> Trial:
    """Return the point of the curve at ``step`` along the state's tangent, linearized right there.

    Raises
    ------
    ConvergenceError
        It is not found, or the equations are not finite there.
    """
    row = state.row
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
    """Return the point of the curve at ``step``, linearized right there when its tangent is first asked for.

    ``factors`` from near by save Newton's method its own.

    Raises
    ------
    ConvergenceError
    """
    system, row = state.system, state.row
    done = correct(system, guess, row, row @ state.x + step, newton, factors)
    return Trial(system, done.x, lambda: linearization(system, done.x, row), done.iterations, done.error)


class Judgement(NamedTuple):
    """What a step is judged by.

    Attributes
    ----------
    missed : float
        Distance from the prediction to the corrected point.
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
    system, sums = state.system, np.empty(6)
    fill_sums(Arc(state.x, state.tangent, trial.x, trial.tangent, guess), system.weights, system.state_size, sums)
    missed, whole, part, first, last, chord = sums.tolist()
    sizes = math.sqrt(first), math.sqrt(last)
    cosine = part / (sizes[0] * sizes[1]) if min(sizes) > _STILL else 1.0
    return Judgement(math.sqrt(missed), max(_angle(whole), _angle(cosine) / 2), math.sqrt(chord))


class Arc(NamedTuple):
    """Both ends of a step with their unit tangents, and the prediction of the second."""

    x: ReadOnlyVector
    tangent: ReadOnlyVector
    last: ReadOnlyVector
    last_tangent: ReadOnlyVector
    guess: ReadOnlyVector


@kernel
def fill_sums(arc: Arc, weights: ReadOnlyVector, states: int, sums: Vector) -> None:
    """Fill the weighted inner products that `judged` uses.

    |guess - last|^2, t.T of the tangents, and of the states alone t.T, |t|^2, |T|^2; |c|^2 of the chord.
    """
    x, tangent, last, last_tangent, guess = arc
    missed, whole, chord = 0.0, 0.0, 0.0
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
    sums[0], sums[1], sums[2], sums[3] = missed, whole, part, first_size
    sums[4], sums[5] = last_size, chord


def _angle(cosine: float) -> float:
    return math.acos(min(1.0, max(-1.0, cosine))) if cosine == cosine else math.nan  # noqa: PLR0124
