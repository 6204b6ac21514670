"""Angles: states that are the same after whole rounds, as that of a pendulum; their periods, and how often orbits go round."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Any, Protocol

import numpy as np

from contin import errors as checks
from contin.arrays import Array
from contin.draws import PLACES, generator
from contin.errors import ProblemError
from contin.functions.batch import Batch
from contin.levels import LOCATED

#: An angle's number of rounds is a parameter with this and the name of the angle for a name.
WINDING = "winding_"

#: Names of angles, which have the period 2 pi, or names with periods.
Angles = Sequence[str] | Mapping[str, float]


class Angular(Protocol):
    """A statement of which the angles are asked, if it has any."""

    @property
    def states(self) -> Any:
        """Names of the states."""


def angle_periods(angles: Angles, states: Sequence[str]) -> dict[str, float]:
    """Return the period of each angle by its name.

    Raises ProblemError where one is no state, or its period is no positive number.

    Examples
    --------
    >>> angle_periods({"x": 1}, ["x", "y"])
    {'x': 1.0}
    """
    if not isinstance(angles, Mapping):
        angles = dict.fromkeys(checks.names("angles", angles), 2 * math.pi)
    for name, period in angles.items():
        if name not in states:
            raise ProblemError(f"angles: {checks.shown(name)} is no state; there are {checks.listed(tuple(states))}")
        if not checks.is_number(period) or not 0 < period < math.inf:
            raise ProblemError(f"angles: the period {checks.shown(period)} of {name} must be a positive number")
    return {name: float(angles[name]) for name in states if name in angles}


def periods_of(problem: Angular) -> Array:
    """Return the period of each state that is an angle and zero for the others, shape (n,)."""
    angles: Mapping[str, float] = getattr(problem, "angles", {})
    return np.array([angles.get(name, 0.0) for name in problem.states])


def whole_rounds(apart: Array, periods: Array) -> Array:
    """Return the multiples of the periods (n,) that are nearest to differences of states (..., n); zero for other states."""
    return periods * np.round(apart / np.where(periods > 0, periods, 1.0))


def winding_names(angles: Mapping[str, float]) -> list[str]:
    """Return the names of the parameters that say how many rounds the angles make."""
    return [WINDING + name for name in angles]


def gain(angles: Mapping[str, float], states: Sequence[str], parameters: Mapping[str, float]) -> Array:
    """Return what each state gains over one round of an orbit, shape (n,): its period times its number of rounds."""
    return np.array([angles[name] * parameters[WINDING + name] if name in angles else 0.0 for name in states])


def windings(angles: Mapping[str, float], states: Sequence[str], gained: Array) -> dict[str, float]:
    """Return the parameters of `gain` for what states gain over one round, shape (n,): the nearest whole numbers of rounds."""
    return {WINDING + name: float(np.round(gained[states.index(name)] / period)) + 0.0 for name, period in angles.items()}


def check_windings(angles: Mapping[str, float], free: Sequence[str], parameters: Mapping[str, float]) -> None:
    """Check that all numbers of rounds are whole, and that none is free; raise ProblemError otherwise."""
    for name in winding_names(angles):
        if name in free:
            raise ProblemError(f"free: {name} must not be free, as it is a whole number")
        if parameters[name] != round(parameters[name]):
            raise ProblemError(f"parameters: {name} = {checks.shown(parameters[name])} must be a whole number")


def check_periodic(
    what: str, batch: Batch, angles: Mapping[str, float], parameters: Mapping[str, float], lifts: bool = False
) -> None:
    """Check at some places that a function of the states is periodic in each angle; where it has no value nothing is checked.

    A map (``lifts``) may gain whole rounds of the angles that it returns. Raises ProblemError otherwise.
    """
    names, random = batch.signature.states, generator("angles")
    u = random.uniform(-1, 1, (PLACES, len(names)))
    t, none = random.uniform(0, 1, PLACES), np.empty((0, len(names)))
    defaults = np.array(list(parameters.values()), dtype=float)
    periods = np.array([angles.get(name, 0.0) for name in names])
    for p in (defaults, defaults + (1 + np.abs(defaults)) * random.uniform(-0.5, 0.5, defaults.size)):
        with np.errstate(all="ignore"):
            here = batch.values(t, u, none, p)
            for name, period in angles.items():
                gap = batch.values(t, u + period * np.eye(len(names))[names.index(name)], none, p) - here
                gap = gap - whole_rounds(gap, periods) if lifts else gap
                wrong = np.abs(gap) > LOCATED * (1 + np.abs(here).max(axis=1, keepdims=True))
                if np.any(wrong):
                    place, value = np.argwhere(wrong)[0]
                    of_state = f"that of {names[value]}" if gap.shape[1] == len(names) else f"number {value + 1}"
                    raise ProblemError(
                        f"angles: the {what} is not periodic in {name}; of its values, {of_state} changes by "
                        f"{abs(gap[place, value]):.3g} from {name} = {u[place, names.index(name)]:.3g} to {name} + {period:.6g}"
                    )
