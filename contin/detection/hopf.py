"""Test function of Hopf points."""

from __future__ import annotations

from typing import Any

import numpy as np

from contin.arrays import ComplexArray, Indices
from contin.stepping.trial import Monitor, Trial


def hopf() -> Monitor:
    """The event that a pair of complex eigenvalues of F_u crosses the imaginary axis (AUTO's HB), for u' = F.

    The product of all sums of two eigenvalues changes sign there, and where two real ones are opposite (a neutral saddle, which
    is not confirmed). The number of unstable eigenvalues tells more than a sign: a pair changes it by two, a real eigenvalue
    that passes zero by one. Details are the frequency of the pair.
    """

    def sums(trial: Trial) -> tuple[ComplexArray, ComplexArray, Indices]:
        system: Any = trial.system  # one with eigenvalues
        values = system.eigenvalues(trial.x)
        i, j = np.triu_indices(len(values), 1)
        return values, values[i] + values[j], i

    def function(trial: Trial) -> float:
        values, pairs, _ = sums(trial)
        if not pairs.size:
            return 1.0
        negative = np.count_nonzero((pairs.imag == 0) & (pairs.real < 0))
        return float((-1.0) ** negative * np.abs(pairs).min())

    def frequency(trial: Trial) -> float:
        values, pairs, i = sums(trial)
        return float(abs(values[i[np.argmin(np.abs(pairs))]].imag))

    def complex_pair(trial: Trial) -> bool:
        return frequency(trial) > 1e-8

    def unstable(trial: Trial) -> int:
        return int(np.count_nonzero(sums(trial)[0].real > 0))

    def several(before: Trial, after: Trial) -> bool:
        change = abs(unstable(after) - unstable(before))
        return change > 3 or (change > 1 and function(before) * function(after) > 0)

    def describe(trial: Trial) -> dict[str, float]:
        return {"frequency": frequency(trial)}

    return Monitor("HB", "Hopf", function, confirm=complex_pair, describe=describe, several=several)
