"""Folding a circle by hand: two opposite points are held and turned against each other about the line between them.

The couples C at the two points S = 0 and S = L/2 are opposite and lie along the line between the points. The strip keeps the
two-fold axes along d2 at both points (`domains.HALF_LOOP_BETWEEN_AXES`), and the moment jumps by C there: M2 = C/2 at S = 0,
where a free loop has M2 = 0. With M2 as the parameter that is followed, the branch begins on the circle, C = 0; C grows
with the angle between the points, has its largest value at a fold, and falls to zero at a state that needs no hand: an
equilibrium of the free strip. If that is a saddle, the strip goes on by itself from there. C is dE/d(angle), so the work up
to that state is the barrier.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from contin import Settings, trace
from contin.lowlevel import Collocation, Label, point_of, shown
from ribbon_model.domains import HALF_LOOP_BETWEEN_AXES
from ribbon_model.equilibrium import directors
from ribbon_model.law import Law
from ribbon_model.older import takes_parameters

#: The free parameters with couples, at fixed kappa_n.
_FREE = ("M2", "M1", "M3", "R1", "R3")
_INTERVALS, _DEGREE = 8, 7
#: Largest couple over twice B 2 pi/L, and most points, up to which the first free state is looked for.
_LARGEST, _MOST = 100.0, 200


@dataclass(frozen=True)
class Folding:
    """The path from a circle to the first free state, with couples at two opposite points.

    Attributes
    ----------
    couples, angles, energies : ndarray, shape (K,)
        C over B 2 pi/L, the angle between the two points in rad, and the energy as a mean of U (the work is 2 pi times its
        change), from the circle to the free state.
    """

    couples: np.ndarray
    angles: np.ndarray
    energies: np.ndarray

    __repr__ = shown

    @property
    def peak(self) -> int:
        """The place of the largest couple."""
        return int(np.argmax(self.couples))


@takes_parameters
def folding(law: Law, m: int, kappa_n: float, parameters: float | Mapping[str, float]) -> Folding | None:
    """Return the path that folds the m-fold circle, m odd; None where it reaches no free state.

    Raises
    ------
    ConvergenceError
        The circle itself is singular: kappa_n is a bifurcation.
    """
    problem = HALF_LOOP_BETWEEN_AXES.problem(law)
    values = {**problem.parameters, "kappa_n": kappa_n, **law.values(parameters)}
    system = Collocation(problem, np.linspace(0, 1, _INTERVALS + 1), _DEGREE, _FREE, values)
    start = HALF_LOOP_BETWEEN_AXES.circle(system, m, kappa_n)
    settings = Settings(primary="M2", limits={"M2": (-_LARGEST, _LARGEST)}, zeros={"M2": [0.0]}, max_points=_MOST, errors=False)
    points = trace(point_of(system, start), settings, progress=False).points
    ends = [i for i, point in enumerate(points) if point.label == Label.USER_ZERO and i]
    if not ends:
        return None
    points = [point for point in points[: ends[0] + 1] if point.label in ("", Label.END, Label.FOLD, Label.USER_ZERO)]
    frames = np.array([directors(*point.system.states(point.x)[-1, :4]) for point in points])
    angles = np.unwrap(np.arctan2(frames[:, 2], frames[:, 0]))  # of d1, about d2 at S = 0
    couples = 2 * np.array([point["M2"] for point in points])
    sense = math.copysign(1.0, angles[-1] - angles[0])
    return Folding(np.abs(couples), sense * (angles - angles[0]), np.array([point["energy"] for point in points]))
