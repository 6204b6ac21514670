"""The parts of one step: the state of a run, predicting, correcting, judging."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from contin.arrays import Array
from contin.discretization.protocol import Discretization, inner
from contin.linalg.factors import Factors
from contin.stepping.newton import Corrected, Newton, correct
from contin.stepping.state import State
from contin.stepping.trial import Trial

#: Share of the states in a tangent below which their direction says nothing.
_STILL = 0.01
#: Distance over which a difference of residuals stands for the product of Jacobian and tangent.
_NEAR = 1e-6


def unit_tangent(system: Discretization, factors: Factors, along: Array | None = None) -> Array:
    """The unit vector along the curve, from factors of [F_x; row], with row.tangent > 0; ``along``: the solution for it."""
    tangent = factors.solve(np.append(np.zeros(system.equations), 1.0)) if along is None else along
    unit: Array = tangent / np.sqrt(inner(system, tangent, tangent))
    return unit


def predict(state: State, step: float) -> Array:
    """Along the tangent, with the curvature known from the last step."""
    guess = state.x + step * state.tangent
    if state.previous_tangent is not None:
        guess += (step**2 / (2 * state.previous_step)) * (state.tangent - state.previous_tangent)
    return guess


class Located(Trial):
    """A point of the curve inside a step: tangent, sign and factors are taken right there, when first asked for."""

    def __init__(self, state: State, done: Corrected) -> None:
        super().__init__(state.system, done.x, done.x, np.nan, done.iterations, done.error, exact=True)
        self._row = state.system.weights * state.tangent
        del self.tangent, self.sign, self.factors

    def __getattr__(self, name: str) -> Any:
        if name not in ("tangent", "sign", "factors"):
            raise AttributeError(name)
        self.factors = self.system.linearize(self.x, (self._row,))[1]
        self.sign, self.tangent = self.factors.sign, unit_tangent(self.system, self.factors)
        return self.__dict__[name]

    @property
    def sharp(self) -> bool:
        """Whether they were asked for."""
        return "factors" in self.__dict__


def corrected(state: State, guess: Array, step: float, newton: Newton) -> Trial:
    """The point of the curve at ``step`` along the state's tangent, its tangent from Newton's last factors.

    Raises
    ------
    ConvergenceError
    """
    done = _corrected(state, guess, step, newton)
    tangent = unit_tangent(state.system, done.factors, done.along)
    return Trial(state.system, done.x, tangent, done.factors.sign, done.iterations, done.error, done.factors)


def located(state: State, guess: Array, step: float, newton: Newton, factors: Factors | None = None) -> Located:
    """The same point with its own tangent; ``factors`` from near by save Newton's method its own.

    Raises
    ------
    ConvergenceError
    """
    return Located(state, _corrected(state, guess, step, newton, factors))


def _corrected(state: State, guess: Array, step: float, newton: Newton, factors: Factors | None = None) -> Corrected:
    row = state.system.weights * state.tangent
    return correct(state.system, guess, row, row @ state.x + step, newton, factors)


def sharpened(state: State, trial: Trial) -> Trial:
    """The same point with factors and tangent taken right there (Newton leaves those of an iterate before)."""
    system = state.system
    factors = system.linearize(trial.x, (system.weights * state.tangent,))[1]
    tangent = unit_tangent(system, factors)
    return Trial(system, trial.x, tangent, factors.sign, trial.iterations, trial.newton_error, factors, exact=True)


def tangent_error(trial: Trial, residual: Array) -> Array:
    """About by how much a trial's tangent misses the one right at its x, where the residual is this: shape (size,).

    One step of iterative refinement, with the product of Jacobian and tangent by a difference.
    """
    system = trial.system
    bent = (system.residual(trial.x + _NEAR * trial.tangent) - residual) / _NEAR
    error: Array = trial.factors.solve(np.append(bent, 0.0))
    return error


def hidden_turn(state: State, trial: Trial) -> float:
    """The angle by which the cubic through both ends of a step, along their tangents, turns away from them in its middle."""
    system = state.system
    chord, mean = trial.x - state.x, state.tangent + trial.tangent
    across = chord - (inner(system, chord, mean) / inner(system, mean, mean)) * mean
    return float(1.5 * np.sqrt(inner(system, across, across) / inner(system, chord, chord)))


def turn(state: State, trial: Trial) -> float:
    """The angle between the tangents at both ends: of the whole and, at half weight, of the states alone.

    Where parameters are large they dominate the norm, and two branches can look parallel that are not.
    """
    system = state.system
    whole = inner(system, trial.tangent, state.tangent)
    weights = system.weights[: system.state_size]
    a, b = trial.tangent[: system.state_size], state.tangent[: system.state_size]
    sizes = math.sqrt((weights * a) @ a), math.sqrt((weights * b) @ b)
    part = float((weights * a) @ b) / (sizes[0] * sizes[1]) if min(sizes) > _STILL else 1.0
    return max(_angle(whole), _angle(part) / 2)


def _angle(cosine: float) -> float:
    return math.acos(min(1.0, max(-1.0, cosine))) if cosine == cosine else math.nan  # noqa: PLR0124
