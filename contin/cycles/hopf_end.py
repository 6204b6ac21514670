"""The end of a branch of cycles that shrink onto an equilibrium, at a Hopf point.

The amplitude, the projection of a cycle on an earlier one of the run, passes zero along the branch: beyond the Hopf point is
the same branch again, half a period on. The equations of cycles are singular at the equilibrium (the period is arbitrary
there), and their solutions are known the less exactly the smaller the cycle is. So the place is taken from the amplitude on the
cubic through both ends of a step, and the point from its own equations, which are regular:

1. Find the zero of the amplitude on the cubic. The cycle there, but for its mean, is left out.
2. Find the equilibrium F(u, p) = 0 by Newton's method, for the value of the parameter.
3. Change the parameter, by the secant method, until the pair of eigenvalues nearest to +-2 pi i / T is imaginary; go to 2.
"""

from __future__ import annotations

import dataclasses
import math

import numpy as np

from contin.arrays import Array
from contin.core.labels import Label
from contin.core.newton import nearest_zero
from contin.core.state import Reason, Stop
from contin.core.trial import Event, Trial
from contin.cycles.equations import CycleEquations
from contin.errors import ConvergenceError
from contin.events.arc import Arc, SpecialPoint
from contin.events.root import find_zero
from contin.levels import DOUBLED, LOCATED, MOST_UPDATES, ROUND_OFF
from contin.problems.own_names import PERIOD

#: The size of a cycle as a part of an earlier one of the run, with a sign.
AMPLITUDE = Event(Label.HOPF, "Hopf", lambda trial: trial.system.amplitude(trial.x))  # type: ignore[attr-defined]  # of cycles


def hopf_point_inside(system: CycleEquations, arc: Arc) -> SpecialPoint | None:
    """Return the Hopf point inside a step of a branch of cycles, or None."""
    before, trial = arc.before.value(AMPLITUDE), arc.trial.value(AMPLITUDE)
    if not before > 0 > trial:
        return None
    try:
        at = find_zero(lambda s: system.amplitude(arc.guess(s)), (arc.low, before), (arc.step, trial), arc.precision)
        x, frequency, error = _hopf_point(system, arc.guess(at))
    except ConvergenceError:
        return None
    if not arc.passes_by(x, at):
        return None
    stop = Stop(Reason.HOPF, "the cycles shrink onto an equilibrium, a Hopf point")
    there, details = Trial.without_tangent(system, x), {"frequency": frequency, "pairs": 1}
    sizes = dict(zip(system.free, map(float, error * system.free_scales)))
    return SpecialPoint(at, Label.HOPF, "Hopf", there, stop, details, errors=sizes)


def shrunk(system: CycleEquations, point: SpecialPoint) -> SpecialPoint:
    """Return a special point, as the end of the branch where cycles have shrunk onto an equilibrium.

    Beyond the Hopf point the branch is itself, half a period later.
    """
    if not system.has_shrunk(point.trial.x):
        return point
    stop = Stop(Reason.HOPF, "the cycles shrink onto an equilibrium, a Hopf point")
    return dataclasses.replace(point, label=Label.HOPF, name="Hopf", stop=stop)


def _hopf_point(system: CycleEquations, guess: Array) -> tuple[Array, float, Array]:
    """Return the unknowns of the Hopf point near a small cycle, its frequency, and the errors of the free parameters.

    Raises
    ------
    ConvergenceError
    """
    n, size = len(system.problem.state_names), system.state_size
    at, period = (
        next(i for i in range(size, system.size) if i != system.parameter_index(PERIOD)),
        system.parameter_index(PERIOD),
    )
    x = guess.copy()
    states = x[:size].reshape(-1, n)
    states[:] = system.weights[:size:n] @ states
    expected = 2j * math.pi / system.order

    def critical(value: float) -> complex:
        x[at] = value
        return _critical(system, x, states, expected)

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


def _critical(system: CycleEquations, x: Array, states: Array, expected: complex) -> complex:
    """Return the eigenvalue, nearest to an expected one, at the equilibrium that is put into ``states``, a view of x.

    Raises
    ------
    ConvergenceError
    """
    here = nearest_zero(lambda u: (system.rates(x, u[None])[0], system.rates_by_states(x, u[None])[0]), states[0])
    if here is None:
        raise ConvergenceError("no equilibrium is found near the cycle")
    states[:] = here
    values = np.linalg.eigvals(system.rates_by_states(x, here[None])[0])
    return complex(values[np.abs(values - expected).argmin()])
