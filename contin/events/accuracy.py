"""The estimated discretization error of a corrected point, and whether a finer mesh would make it smaller."""

from __future__ import annotations

import functools
from dataclasses import dataclass
from typing import Any

import numpy as np

from contin.arrays import Array
from contin.core.trial import Trial
from contin.draws import generator
from contin.levels import CERTAIN


@dataclass(frozen=True)
class Accuracy:
    """The estimated discretization error of a point, relative to 1 + size; NaN where it is not known, 0 without a mesh."""

    error: float
    trial: Trial | None = None

    @functools.cached_property
    def is_round_off(self) -> bool:
        """A finer mesh would not make it smaller."""
        trial = self.trial
        return trial is not None and self.error <= CERTAIN * trial.system.newton_error(trial.x, trial.factors)


def accuracy_of(trial: Trial) -> Accuracy:
    """Return the estimated discretization error of a point of a curve."""
    return Accuracy(trial.discretization_error, trial)


class _Bordered:
    """Factors of [[F_x, c], [row, 0], [r, 0]] at a simple branch point, for right-hand sides of [F_x; row]."""

    def __init__(self, trial: Trial) -> None:
        system, random = trial.system, generator("accuracy")
        self._size = system.size
        rows = np.zeros((2, system.size + 1))
        rows[0, :-1] = system.weights * trial.tangent
        rows[1, :-1] = system.weights * random.standard_normal(system.size)
        column = random.standard_normal((1, system.equations)) / np.sqrt(system.equations)
        self._factors = system.linearize(trial.x, rows, column)[1]

    def solve(self, b: Array) -> Array:
        """Return the unknowns."""
        return self._factors.solve(np.append(b, 0.0))[: self._size]


def at_branch_point(trial: Trial) -> Accuracy:
    """Return the estimated error of a branch point from which a run starts, without the part in the kernel of F_x.

    A cycle of no size, as that at a Hopf point, is the same on every mesh.
    """
    system = trial.system
    if not system.intervals or (system.size_of_solutions is not None and not np.ptp(system.states(trial.x), axis=0).any()):
        return Accuracy(0.0)
    factors: Any = _Bordered(trial)
    return Accuracy(system.discretization_error(trial.x, factors, trial.functionals))
