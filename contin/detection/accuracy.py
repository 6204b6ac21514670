"""The estimated discretization error of a corrected point, and whether a finer mesh would make it smaller."""

from __future__ import annotations

from dataclasses import dataclass

from contin.stepping.trial import Trial

#: An error up to this many times what Newton's method has left, measured alike, is round-off. On 146 to 328 intervals of the
#: bank's stiffest problem it is 0.5 to 3 times that. Ten times larger, an error of 1e-10 would stay where Newton leaves 1e-12.
_UNITS = 10.0


@dataclass(frozen=True)
class Accuracy:
    """The estimated discretization error of a point, relative to 1 + size; NaN where it is not known, 0 without a mesh.

    ``is_round_off``: a finer mesh would not make it smaller. It is looked at only where the error is larger than wanted.
    """

    error: float
    is_round_off: bool = False


def accuracy_of(trial: Trial, wanted: float) -> Accuracy:
    """Return the estimated discretization error of a point of a curve."""
    error = trial.discretization_error
    if not error > wanted:
        return Accuracy(error)
    return Accuracy(error, is_round_off=error <= _UNITS * trial.system.newton_error(trial.x, trial.factors))
