"""Numbers of eigenvalues on one side of zero, counted at both ends of a step: they tell what a step has passed.

The index of a variational problem and the number of unstable eigenvalues of an equilibrium change at special points only, by no
more than the dimension of what vanishes there. A larger change means that something was passed in silence. The counts know
nothing of how special points are found.
"""

from __future__ import annotations

import functools
from collections.abc import Iterable
from typing import Any

import numpy as np

from contin.detection.second_variation import index_of, nullity_of
from contin.detection.segment import Segment, SpecialPoint
from contin.discretization.algebraic import Algebraic
from contin.discretization.maps import MapSystem
from contin.discretization.protocol import Discretization
from contin.stepping.trial import TestFunction, Trial

#: Real part of an eigenvalue, relative to the largest eigenvalue, below which its side of zero is not known, and nothing is
#: counted. At 1e-12, round-off of a zero eigenvalue of a conservation law counted as a change.
_UNDECIDED = 1e-9
#: Difference of a matrix and its transpose, relative to its largest entry, up to which it is symmetric.
_SYMMETRIC = 1e-10


@functools.singledispatch
def census_of(system: Discretization) -> TestFunction | None:
    """Return the test function whose value is a number of eigenvalues; None where nothing is counted. NaN: not known."""
    return index_of(system)


@census_of.register
def _of_equilibria(system: Algebraic) -> TestFunction | None:
    """That of eigenvalues of F_u with a positive real part, where all are known: of u' = F(u, p), or of a symmetric matrix."""
    return None if system.equations != system.state_size or system.is_sparse else _COUNT


@census_of.register
def _of_maps(system: MapSystem) -> None:
    """The functions that look for period doublings and torus bifurcations compare multipliers themselves."""


def _count(trial: Trial) -> float:
    system: Any = trial.system
    if system.problem.dynamics:
        values = system.computed_eigenvalues(trial.x)
    else:
        matrix = system.jacobian(trial.x)
        if not (np.abs(matrix - matrix.T).max() <= _SYMMETRIC * np.abs(matrix).max() < np.inf):
            return np.nan
        values = np.linalg.eigvalsh(matrix)
    decided = np.abs(values.real).min() > _UNDECIDED * np.abs(values).max()
    return float(np.count_nonzero(values.real > 0)) if decided else np.nan


#: One object, so that a trial counts once.
_COUNT = TestFunction("", "number of unstable eigenvalues", _count)


def contradiction(census: TestFunction | None, segment: Segment, special: Iterable[SpecialPoint]) -> str:
    """Return how the count over a step contradicts its special points, as a clause; "" where it does not."""
    if census is None:
        return ""
    before, after = segment.before.value(census), segment.trial.value(census)
    if not abs(after - before) > sum(map(_most, special)):
        return ""
    return f"the {census.name} goes from {before:g} to {after:g}"


def _most(point: SpecialPoint) -> int:
    """Return by how much a count can change at a special point."""
    pairs = point.details.get("pairs", 1) if isinstance(point.details, dict) else 1
    return 2 * pairs if point.label == "HB" else nullity_of(point)
