"""A point of a curve on a mesh with points where conditions that the solution decides switch.

Where such a condition switches inside an interval, the discrete equations have errors of their own that jump from place to
place. So each point of a curve is corrected again on a mesh with points there. As mesh points move with the solution, two
points of a step are on two meshes; what is searched between them sees each as carried back to the mesh of the step.
"""

from __future__ import annotations

import dataclasses

import numpy as np

from contin.arrays import Array
from contin.core.newton import Newton, correct
from contin.core.protocol import inner
from contin.core.step import trial_of
from contin.core.trial import Linearization, Trial
from contin.errors import ConvergenceError

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
