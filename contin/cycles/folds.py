"""Special points on curves of folds of cycles, and of cycles of maps."""

from __future__ import annotations

from typing import Any

import numpy as np

from contin.core.trial import Event, Trial
from contin.cycles.curves import NORMAL, normal_product
from contin.cycles.equations import PeriodicEquations
from contin.cycles.map_equations import MapEquations
from contin.defining.critical_curve import signed_smallest
from contin.levels import CORRECTED, ROUND_OFF


def events_on_folds(cycles: PeriodicEquations | MapEquations) -> list[Event]:
    """Return the test functions of points where a further multiplier is one, or another is -1.

    The change of g with the multiplier vanishes where a further one is one.
    """
    autonomous, noise = cycles.autonomous, NORMAL if cycles.intervals else ROUND_OFF
    critical = 1 + autonomous

    def further(trial: Trial) -> float:
        system: Any = trial.system
        v, w = system.null_vectors(trial.x)
        n = len(system.problem.states)
        return normal_product(v[:n], w[-1 - n : -1] if autonomous else w[-n:], noise)

    def flip(trial: Trial) -> float:
        system: Any = trial.system
        exponents = system.base.eigenvalues(trial.x)
        others = exponents[np.argsort(np.abs(exponents))[critical:]]
        size = np.maximum(others.real, 0.0)  # multipliers may be larger than any number
        multipliers = np.exp(others - size)
        multipliers.imag[np.abs(multipliers.imag) <= CORRECTED * np.abs(multipliers)] = 0.0
        return signed_smallest(np.exp(-size) + multipliers)

    return [Event("R1", "resonance 1:1", further), Event("LPPD", "fold-flip", flip)]
