"""The parts of one step of pseudo-arclength continuation: predictor, corrector, and how far a corrected point is believed.

With the tangent t of the last point x the corrector solves F(z) = 0 together with t.(z - x) = step, in the weighted inner
product. The bordered matrix [F_x; row], row.v = t.v, is regular along the curve, folds included, and gives the next tangent.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence

import numpy as np

from contin.arrays import Array
from contin.discretization.protocol import Discretization, inner
from contin.linalg.factors import Factors
from contin.stepping.newton import Corrected, Newton, correct
from contin.stepping.state import State
from contin.stepping.trial import Linearization, Trial, linearization, unit_tangent

#: Share of the states in a unit tangent below which their direction is not compared: the states hardly take part in the step.
_STILL = 0.01
#: Length over which a difference of residuals stands for the product of Jacobian and tangent: the square root of round-off,
#: times a hundred for large states. The curvature over it adds an error as large.
_NEAR = 1e-6

#: A step ends at this many times the distance to a limit, along the tangent, at most: beyond it, and not much. Ten times
#: larger, a parameter that the equations divide by went through zero, and three branch points before it were lost.
_BEYOND = 1.25


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
    """Return the point of the curve at ``step`` along the state's tangent; its tangent comes from Newton's last factors.

    Raises
    ------
    ConvergenceError
    """
    return trial_of(state.system, _corrected(state, guess, step, newton))


def trial_of(system: Discretization, done: Corrected) -> Trial:
    """Return the trial of a corrected point, with Newton's last factors."""
    tangent = unit_tangent(system, done.factors, done.along)
    return Trial(system, done.x, Linearization(tangent, done.factors.sign, done.factors), done.iterations, done.error)


def located(state: State, guess: Array, step: float, newton: Newton, factors: Factors | None = None) -> Trial:
    """Return the point of the curve at ``step``, linearized right there when its tangent is first asked for.

    ``factors`` from near by save Newton's method its own.

    Raises
    ------
    ConvergenceError
    """
    done, system, row = _corrected(state, guess, step, newton, factors), state.system, state.row
    return Trial(system, done.x, lambda: linearization(system, done.x, row), done.iterations, done.error)


def _corrected(state: State, guess: Array, step: float, newton: Newton, factors: Factors | None = None) -> Corrected:
    row = state.row
    return correct(state.system, guess, row, row @ state.x + step, newton, factors)


def sharpened(state: State, trial: Trial) -> Trial:
    """Return the same point linearized right there (Newton leaves the factors of the iterate before)."""
    return trial.sharpened(linearization(state.system, trial.x, state.row))


def tangent_error(trial: Trial, residual: Array) -> Array:
    """Return an estimate of the error of a trial's tangent, shape (size,); ``residual`` is that at its x.

    One step of iterative refinement, with the product of Jacobian and tangent by a difference.
    """
    bent = (trial.system.residual(trial.x + _NEAR * trial.tangent) - residual) / _NEAR
    error: Array = trial.factors.solve(np.append(bent, 0.0))
    return error


def turn(state: State, trial: Trial) -> float:
    """Return the angle between the tangents at both ends: the larger of the whole one and half that of the states alone.

    Where parameters are large they dominate the norm, and tangents of different branches can look parallel.
    """
    system = state.system
    whole = inner(system, trial.tangent, state.tangent)
    weights = system.weights[: system.state_size]
    a, b = trial.tangent[: system.state_size], state.tangent[: system.state_size]
    sizes = math.sqrt((weights * a) @ a), math.sqrt((weights * b) @ b)
    part = float((weights * a) @ b) / (sizes[0] * sizes[1]) if min(sizes) > _STILL else 1.0
    return max(_angle(whole), _angle(part) / 2)


def hidden_turn(state: State, trial: Trial) -> float:
    """Return the angle by which the cubic through both ends, along their tangents, turns away from them in its middle."""
    system = state.system
    chord, mean = trial.x - state.x, state.tangent + trial.tangent
    across = chord - (inner(system, chord, mean) / inner(system, mean, mean)) * mean
    return float(1.5 * np.sqrt(inner(system, across, across) / inner(system, chord, chord)))


def _angle(cosine: float) -> float:
    return math.acos(min(1.0, max(-1.0, cosine))) if cosine == cosine else math.nan  # noqa: PLR0124
