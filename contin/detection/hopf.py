"""The test function of Hopf points."""

from __future__ import annotations

from typing import Any

import numpy as np

from contin.arrays import ComplexArray, Indices
from contin.stepping.trial import TestFunction, Trial

#: A pair of eigenvalues with a smaller imaginary part is real: the double root of a characteristic polynomial splits by the
#: square root of round-off. At 1e-7 slow oscillations would be taken for neutral saddles.
_REAL = 1e-8


def hopf() -> TestFunction:
    """Return the test function of points where a pair of complex eigenvalues of F_u crosses the imaginary axis (AUTO's HB).

    For u' = F. The product of all sums of two eigenvalues changes sign there, and where two real ones are opposite (a neutral
    saddle, which is not confirmed). The number of unstable eigenvalues tells more than a sign: a pair changes it by two, a real
    eigenvalue that passes zero by one. The details are the frequency of the pair.
    """
    return TestFunction("HB", "Hopf", _product, confirm=_complex_pair, describe=_details, several=_several)


def _sums(trial: Trial) -> tuple[ComplexArray, ComplexArray, Indices]:
    """Return the eigenvalues, their sums by pairs, and the first member of each pair."""
    system: Any = trial.system  # one with eigenvalues
    values = system.eigenvalues(trial.x)
    i, j = np.triu_indices(len(values), 1)
    return values, values[i] + values[j], i


def _product(trial: Trial) -> float:
    """Return a value with the sign of the product of all sums, and the size of the smallest."""
    _, pairs, _ = _sums(trial)
    if not pairs.size:
        return 1.0
    negative = np.count_nonzero((pairs.imag == 0) & (pairs.real < 0))
    return float((-1.0) ** negative * np.abs(pairs).min())


def _frequency(trial: Trial) -> float:
    values, pairs, i = _sums(trial)
    return float(abs(values[i[np.argmin(np.abs(pairs))]].imag))


def _complex_pair(trial: Trial) -> bool:
    return _frequency(trial) > _REAL


def _unstable(trial: Trial) -> int:
    return int(np.count_nonzero(_sums(trial)[0].real > 0))


def _several(before: Trial, after: Trial) -> bool:
    change = abs(_unstable(after) - _unstable(before))
    return change > 3 or (change > 1 and _product(before) * _product(after) > 0)


def _details(trial: Trial) -> dict[str, float]:
    return {"frequency": _frequency(trial)}
