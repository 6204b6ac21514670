"""Barriers: the states that the energy passes on its lowest way out of a stable state of a strip.

On the lowest way from one minimum of the energy to another, the highest state is an equilibrium of index 1, a saddle. From a
saddle the energy falls to two sides, along its one unstable direction; `sides` follows it down on both
(`ribbon_model.descent`). The barrier of a stable state is the energy of the lowest saddle that has the state on one side, less
its own. Only saddles that are given are considered: another one may be lower.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Generic, TypeVar

import numpy as np

from contin import Settings, trace
from contin.lowlevel import Collocation, Label, Shown, levels, point_of
from ribbon_model.descent import KICK, LONGEST, SEGMENTS, descend, modes
from ribbon_model.domains import HALF_LOOP_BETWEEN_AXES
from ribbon_model.equilibrium import directors
from ribbon_model.law import Law
from ribbon_model.older import takes_parameters
from ribbon_model.second_variation import Equilibrium
from ribbon_model.segments import Chain, Strip, discretized

#: The kick of open strips: root mean square change of the strains, over one over the length.
KICK_OPEN = 2 * math.pi * KICK
#: Times that a strip which rests in a saddle is kicked out of it.
_KICKS = 5
#: Relative difference of the energies of a state at rest and of the continuous state cut into segments, which are not quite at
#: rest.
_CUT = 1e-4

Name = TypeVar("Name")
Segmented = TypeVar("Segmented", bound=Chain)


@dataclass(frozen=True)
class Barrier(Generic[Name]):
    """The way out of a stable state.

    Attributes
    ----------
    height : float
        Energy of the saddle less that of the stable state.
    saddle, behind
        The saddle, and the state on its other side (None if that is none of the given ones).
    """

    height: float
    saddle: Name
    behind: Name | None


def sides(saddle: Equilibrium) -> tuple[Strip, Strip] | None:
    """Return the strips at rest on both sides of a state of index 1; None where they cannot be told apart."""

    def apart(first: Strip, last: Strip) -> bool:
        return abs(first.energy - last.energy) > levels.APART * (1 + abs(first.energy))

    return ways_down(lambda segments: discretized(saddle, segments), apart, KICK)


def ways_down(
    cut: Callable[[int], Segmented], apart: Callable[[Segmented, Segmented], bool], kick: float, longest: float = LONGEST
) -> tuple[Segmented, Segmented] | None:
    """Return the strips at rest on both sides of a state of index 1; None where they cannot be told apart.

    Parameters
    ----------
    cut : callable
        ``cut(N)`` returns the state as a strip of N segments.
    apart : callable
        ``apart(first, last)`` returns whether two strips at rest are two states.
    kick, longest : float
        Root mean square change of the strains by which the state is left, and the largest one in a step.
    """
    # Both ways down lead to the same state where the saddle of the segments lies further from that of the continuous strip than
    # the kick leads.
    for segments in (SEGMENTS, 2 * SEGMENTS, 4 * SEGMENTS):
        strip = cut(segments)
        mode = modes(strip, 1)[1][:, 0]
        ways = [descend(strip.moved(sign * kick * mode), longest=longest) for sign in (1, -1)]
        first, last = (way.end for way in ways)
        if all(way.rests for way in ways) and apart(first, last):
            return first, last
    return None


def at_rest(strip: Segmented, kick: float, longest: float = LONGEST) -> Segmented | None:
    """Return the strip at rest, at a minimum of the energy, into which one falls; None where it comes to none.

    Where it rests at a saddle, as one with a symmetry may, it is kicked and falls on.
    """
    for _ in range(_KICKS):
        way = descend(strip, longest=longest)
        lowest, mode = modes(way.end, 1)
        if not way.rests or lowest[0] > 0:
            return way.end if way.rests else None
        strip = way.end.moved(kick * mode[:, 0])
    return None


def apart(first: Chain, last: Chain) -> bool:
    """Return whether two open strips at rest, on the same segments, are two states."""
    size = float(np.sqrt(np.mean(first.strains**2)))
    return float(np.sqrt(np.mean((first.strains - last.strains) ** 2))) > levels.ROUGH * (1 + size)


def covering_index(strip: Strip) -> int | None:
    """Return the covering index of a strip that is a planar circle (negative if turned inside out), None for all others."""
    mean = float(strip.strains[:, 0].mean())
    return round(mean) if np.abs(strip.strains - [mean, 0, 0]).max() < levels.APART else None


def is_at(strip: Strip, state: Equilibrium) -> bool:
    """Return whether a strip at rest is a buckled state, by their energies on the same segments."""
    energy = discretized(state, len(strip.strains)).energy
    return abs(strip.energy - energy) < _CUT * (1 + abs(energy))


def barriers(
    energies: Sequence[tuple[Name, float]], saddles: Iterable[tuple[Name, float, Name | None, Name | None]]
) -> dict[Name, Barrier[Name]]:
    """Return the lowest way out of each stable state that has one.

    Parameters
    ----------
    energies : sequence of (name, energy)
        The stable states.
    saddles : iterable of (name, energy, side, side)
        Saddles, with the names of the stable states on both sides (None: none of the given ones).

    Examples
    --------
    >>> found = barriers([("low", 0.0), ("high", 1.0)], [("pass", 1.5, "low", "high"), ("peak", 3.0, "low", None)])
    >>> found["high"]
    Barrier(height=0.5, saddle='pass', behind='low')
    """
    known, lowest = dict(energies), {}
    for name, energy, *ends in saddles:
        for here, there in (ends, ends[::-1]):
            if here in known and here != there:
                way = Barrier(energy - known[here], name, there)
                lowest[here] = min((way, lowest.get(here, way)), key=lambda barrier: barrier.height)
    return lowest


# --- circles folded by hand ------------------------------------------------------------------------------------------


#: The free parameters with couples, at fixed kappa_n.
_FREE = ("M2", "M1", "M3", "R1", "R3")
_INTERVALS, _DEGREE = 8, 7
#: Largest couple over twice B 2 pi/L, and most points, up to which the first free state is looked for.
_LARGEST, _MOST = 100.0, 200


@dataclass(frozen=True, repr=False)
class Folding(Shown):
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

    @property
    def peak(self) -> int:
        """The place of the largest couple."""
        return int(np.argmax(self.couples))


@takes_parameters
def folding(law: Law, m: int, kappa_n: float, parameters: float | Mapping[str, float]) -> Folding | None:
    """Return the path that folds the m-fold circle, m odd; None where it reaches no free state.

    Two opposite points are held and turned against each other about the line between them. The couples C at the two points
    S = 0 and S = L/2 are opposite and lie along the line between the points. The strip keeps the two-fold axes along d2 at both
    points (`domains.HALF_LOOP_BETWEEN_AXES`), and the moment jumps by C there: M2 = C/2 at S = 0, where a free loop has M2 = 0.
    With M2 as the parameter that is followed, the branch begins on the circle, C = 0; C grows with the angle between the
    points, has its largest value at a fold, and falls to zero at a state that needs no hand: an equilibrium of the free strip.
    If that is a saddle, the strip goes on by itself from there. C is dE/d(angle), so the work up to that state is the barrier.
    Raises ConvergenceError where the circle itself is singular: kappa_n is a bifurcation.
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
