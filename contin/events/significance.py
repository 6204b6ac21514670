"""The sense in which the primary parameter goes along a branch, where that is more than an error of the discretization.

In a canard explosion a parameter stays within 1e-10 or less over many steps, while its rate on the mesh is 1e-11 with an
arbitrary sign: that of the error of the mesh. A rate that small is compared with the one on a finer mesh or, without a mesh,
with round-off. Where they differ, or where it is no more than that, the parameter stands still as far as can be told, and no
fold is seen there. A fold lies on such a plateau if the parameter leaves it in the other sense than the one it came in.
"""

from __future__ import annotations

import functools
from typing import Any

import numpy as np

from contin import draws
from contin.arrays import Array
from contin.core.newton import UNITS, Newton, correct
from contin.core.protocol import Discretization
from contin.core.step import CLEAR, trial_of
from contin.core.trial import Event, Trial, linearization
from contin.errors import ConvergenceError
from contin.events.arc import Arc, SpecialPoint
from contin.levels import BESIDE, ROUND_OFF
from contin.linalg.orientation import oriented

#: A change of a parameter below this, relative to 1 + its size, may be round-off of the corrector.
STANDS = 1e-13
#: A rate is significant where that on the finer mesh differs by less than this part of it.
_AGREES = 0.5
#: One up to this is not, on a mesh: one that agrees is round-off, too.
STILL = ROUND_OFF / (1 + _AGREES)


def sense(trial: Trial, fold: Event, newton: Newton) -> float:
    """Return the sign of the primary parameter's rate at a trial, computed once; zero where it is not significant."""
    return trial.value(_sense_function(fold, newton))


@functools.lru_cache(maxsize=8)
def _sense_function(fold: Event, newton: Newton) -> Event:
    return Event(fold.label, f"sense of {fold.name}", lambda trial: _sense(trial, fold, newton))


def _sense(trial: Trial, fold: Event, newton: Newton) -> float:
    rate = trial.value(fold)
    if not abs(rate) < CLEAR:
        return float(np.sign(rate))
    if not trial.system.intervals:  # without a mesh, there is round-off only
        return float(np.sign(rate)) if abs(rate) > _noise(trial, fold) else 0.0
    if not abs(rate) > STILL:
        return 0.0
    finer = on_finer_mesh(trial, newton)
    if finer is None:
        return 0.0
    again = finer.value(fold)
    significant = abs(again) > ROUND_OFF and abs(again - rate) < _AGREES * abs(rate)
    return float(np.sign(rate)) if significant else 0.0


def _noise(trial: Trial, fold: Event) -> float:
    """Return the rate of the primary parameter that is round-off, without a mesh.

    Each equation is evaluated with an error as large as one unit in the last place of x makes, of its own sign: discretized
    derivatives make it large. The equations of the tangent are those of a change of x, with errors in proportion.
    """
    system, x, tangent = trial.system, trial.x, trial.tangent
    size, own = (float(np.linalg.norm(vector[: system.state_size])) for vector in (x, tangent))
    if not size:
        return 0.0
    random, noise, at = draws.generator("significance"), 0.0, system.parameter_index(fold.name)
    residual, factors = system.linearize(x, (system.weights * tangent,))
    for _ in range(draws.DRAWS):
        error = system.residual(draws.rounded(random, x)) - residual
        noise = max(noise, abs(factors.solve(np.append(error * draws.signs(random, error), 0.0))[at]))
    return float(UNITS * noise * own / size)


def growing(system: Discretization, x: Array, tangent: Array, primary: str, newton: Newton) -> Array:
    """Return the unit tangent at x along which the primary parameter grows, or the one `oriented` where it stands still.

    It stands still at x if its rates on both sides of x have opposite signs, as at a fold: the rate at x is round-off then. A
    small rate with one sign on both sides belongs to a parameter of another size.
    """
    at = system.parameter_index(primary)
    if abs(tangent[at]) >= CLEAR:
        return tangent * np.sign(tangent[at])
    row = system.weights * tangent
    try:
        places = [correct(system, x + s * tangent, row, row @ x + s, newton).x for s in (-BESIDE, BESIDE)]
    except ConvergenceError:
        return np.asarray(oriented(tangent))
    before, behind = (linearization(system, place, row).tangent[at] for place in places)
    return np.asarray(tangent * np.sign(before) if before * behind > 0 else oriented(tangent))


def on_finer_mesh(trial: Trial, newton: Newton) -> Trial | None:
    """Return a trial corrected on the mesh halved; None where it is not found there."""
    finer: Any = trial.system.refined()
    system, carry = finer
    x, row = carry(trial.x), system.weights * carry(trial.tangent)
    try:
        return trial_of(system, correct(system, x, row, row @ x, newton, linearize=True), row)
    except ConvergenceError:
        return None


def senses(arc: Arc, fold: Event) -> tuple[float, float]:
    """Return the sense at both ends of a step.

    Beside a branch point or Hopf point tangents are blurred: there the parameter itself must have gone the same way.
    """
    state, before = arc.state, arc.before
    first, last = sense(before, fold, arc.newton), sense(arc.trial, fold, arc.newton)
    at = before.system.parameter_index(fold.name)
    gone = before.x[at] - state.x[at] if state.singular else 0.0
    return (0.0 if gone * first < -STANDS * (1 + abs(before.x[at])) else first), last


def passed_before(arc: Arc, fold: Event) -> list[SpecialPoint]:
    """Return the fold that a step has behind it, where the parameter goes by more than round-off against its last sense.

    A fold on which the parameter changes by less than round-off over a whole step is not seen in that step: it lies on a
    plateau, on which a rate may seem significant by chance. The errors of such a fold are the length of the plateau, in all
    free parameters.
    """
    state, behind = arc.state, sense(arc.trial, fold, arc.newton)
    at = state.system.parameter_index(fold.name)
    gone = arc.trial.x[at] - state.x[at]
    moved = gone * behind > STANDS * (1 + abs(state.x[at]))
    return [_behind_plateau(arc, fold)] if moved and state.sense * behind < 0 and state.sensed is not None else []


def _behind_plateau(arc: Arc, fold: Event) -> SpecialPoint:
    """Return the beginning of a step as a fold; its errors are the way since the parameter's sense was told last."""
    assert arc.state.sensed is not None
    lengths = np.abs(free_values(arc.trial) - arc.state.sensed)
    errors = dict(zip(arc.state.system.free, map(float, lengths)))
    return SpecialPoint(0.0, fold.label, fold.name, arc.before, test=fold, errors=errors)


def free_values(trial: Trial) -> Array:
    """Return the free parameters of a trial in the user's units."""
    return np.array([trial[name] for name in trial.system.free])
