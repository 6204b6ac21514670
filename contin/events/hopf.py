"""Hopf points: pairs of complex eigenvalues of F_u that cross the imaginary axis, for u' = F (AUTO's HB).

Eigenvalues at both ends of a piece are matched, nearest to nearest. Each complex one that changed the side of the axis is
followed to the place where its real part vanishes. Where one was real at an end, or two were located at one place where only
one pair lies on the axis, the piece is halved. Real eigenvalues that cross (folds, branch points), and two opposite real ones
(neutral saddles), are no Hopf points.
"""

from __future__ import annotations

import functools
import itertools
import math
from collections.abc import Callable
from typing import Any

import numpy as np

from contin.arrays import Array, ComplexArray, Indices
from contin.core.labels import Label
from contin.core.small import SMALL
from contin.core.trial import Event, Trial
from contin.errors import ConvergenceError
from contin.events.arc import Arc, Place, SpecialPoint, find_zero
from contin.events.normal_forms import pair
from contin.events.spectra import find_moves, moves_of
from contin.levels import BESIDE, DOUBLED

#: Into how many parts a step is divided to look inside it, on the cubic, ...
_PARTS = 4
#: ... how often these parts are halved, where eigenvalues move far: peaks of a hundredth of a step are seen. Without, two of
#: 187 Hopf points of random problems are passed, in a step of 30 times their distance, ...
_CLOSER = 5
#: ... and how often a piece is halved: crossings closer than 2^-20 of it are not told apart.
_CUTS = 20


@functools.cache
def hopf() -> Event:
    """Return the test function of Hopf points: the largest real part of a complex eigenvalue. Several pairs are told apart."""

    def function(trial: Trial) -> float:
        values = _upper(trial)
        parts = values[_is_complex(values)].real
        return float(parts.max()) if parts.size else float("nan")

    return Event(Label.HOPF, "Hopf", function, search=hopf_points, asks=may_pass, normal_form=pair)


def may_pass(arc: Arc) -> bool:
    """Return whether a pair may pass the axis inside a step, by how far eigenvalues move between its ends."""
    return _moving([(arc.low, arc.before), (arc.step, arc.trial)])[0][0]


def critical_real_part(frequency: float) -> Callable[[Trial], float]:
    """Return the function of a trial that vanishes at a Hopf point of this frequency: the real part of the critical pair."""
    return lambda trial: _real_part(trial, 1j * frequency)


def _real_part(trial: Trial, value: complex) -> float:
    """Return the real part of the eigenvalue that is nearest to a value."""
    if getattr(trial.system, "finds_nearest", False):
        return float(trial.system.eigenvalue_near(trial.x, value).real)
    values = _upper(trial)
    return float(values[np.argmin(np.abs(values - value))].real) if values.size else float("nan")


def _upper(trial: Trial) -> ComplexArray:
    """Return the eigenvalues with a positive imaginary part, and real ones."""
    values: ComplexArray = trial.system.computed_eigenvalues(trial.x)
    return values[values.imag > -DOUBLED * (1 + np.abs(values))]


def _is_complex(values: ComplexArray) -> Any:
    return values.imag > DOUBLED * (1 + np.abs(values))


def _half_plane(values: ComplexArray) -> Any:
    """Return 1 for an eigenvalue above the real axis, -1 below it, 0 on it."""
    return np.where(np.abs(values.imag) > DOUBLED * (1 + np.abs(values)), np.sign(values.imag), 0.0)


def hopf_points(arc: Arc, knots: list[Place]) -> list[SpecialPoint]:
    """Return the Hopf points between places of a step, in order."""
    symmetric: Any = getattr(arc.trial.system, "is_symmetric", None)
    if symmetric is not None and symmetric(arc.state.x) and symmetric(arc.trial.x):
        return []  # all eigenvalues are real
    inside = sorted({arc.step * part / _PARTS for part in range(1, _PARTS)} - {s for s, _ in knots})
    looked = sorted([*knots, *((s, arc.guessed(s)) for s in inside)], key=lambda knot: knot[0])
    moves, unclear = _moving(looked)
    if not any(moves):
        return []
    if arc.trial.system.size <= SMALL:  # otherwise each place takes long
        for _ in range(_CLOSER):  # where two pairs nearly meet, real parts have narrow peaks: one may pass and come back
            between = [(a[0] + b[0]) / 2 for (a, b), doubtful in zip(itertools.pairwise(looked), unclear) if doubtful]
            if not between:
                break
            looked = sorted([*looked, *((s, arc.guessed(s)) for s in between)], key=lambda knot: knot[0])
            moves, unclear = _moving(looked)
    pieces = zip(itertools.pairwise(looked), moves)  # none passes where eigenvalues do not move so far
    passed = [(left[0], right[0]) for (left, right), far in pieces if far and _passes_as_pair(left[1], right[1])]
    ends = {s for pair in passed for s in pair}
    if len(passed) > 1 or (passed and not any(_passes_as_pair(a[1], b[1]) for a, b in itertools.pairwise(knots))):
        ends.update(inside)
    elif len(looked) == len(knots) + len(inside):  # no other pair comes near the axis
        ends.clear()
    knots = sorted([*knots, *((s, arc.near(s)) for s in sorted(ends - {s for s, _ in knots}))], key=lambda knot: knot[0])
    found: list[SpecialPoint] = []
    for left, right in itertools.pairwise(knots):
        found += _between(arc, left, right, 0)
    return _joined(sorted(found, key=lambda point: point.at), arc)


def _moving(places: list[Place]) -> tuple[list[bool], list[bool]]:
    """Return between which of some places a pair may move to the imaginary axis, and where it is not clear how often."""
    system: Any = places[0][1].system
    values, count = system.eigenvalues_at([trial.x for _, trial in places]), len(places)
    if not values[0].size or any(len(each) != len(values[0]) for each in values):
        return [True] * (count - 1), [True] * (count - 1)
    along = np.sort(np.array(values), axis=1)
    moves = moves_of(range(count), along.shape[1])
    find_moves(along.real.copy(), along.imag.copy(), np.array([s for s, _ in places]), moves)
    return moves.passes.astype(bool).tolist(), moves.unclear.astype(bool).tolist()


def _passes_as_pair(left: Trial, right: Trial) -> bool:
    """Return whether an eigenvalue that is complex at one of two places changed the side of the imaginary axis."""
    first, last = _changes(left, right)
    return bool(np.any(_half_plane(first)) or np.any(_half_plane(last)))


def _changes(left: Trial, right: Trial) -> tuple[ComplexArray, ComplexArray]:
    """Return the eigenvalues at both ends that changed the side of the imaginary axis."""
    system = left.system
    if not (np.any(system.eigenvalues(left.x).real > 0) or np.any(system.eigenvalues(right.x).real > 0)):
        return np.empty(0, complex), np.empty(0, complex)  # as where all is stable
    first, last = _matched(left, right)
    changed = (first.real > 0) != (last.real > 0)
    if hasattr(system, "autonomous"):  # logarithms of multipliers: a negative one is real, and alone
        apart = np.abs(np.abs([first.imag, last.imag]) - math.pi)
        changed &= (apart >= DOUBLED).any(axis=0)
    upper = (first.imag > -DOUBLED * (1 + np.abs(first))) | (last.imag > -DOUBLED * (1 + np.abs(last)))
    return first[changed & upper], last[changed & upper]


def _matched(left: Trial, right: Trial) -> tuple[ComplexArray, ComplexArray]:
    """Return the eigenvalues at two places, each beside the one that it becomes; none where they are not finite.

    Of a large matrix only those right of the axis or near to it are known, and their number differs from place to place. One
    right of the axis that is left over at one place has gone far to the left at the other: it is looked for there.
    """
    system = left.system
    first, last = system.eigenvalues(left.x), system.eigenvalues(right.x)
    if not (np.isfinite(first).all() and np.isfinite(last).all()):
        return np.empty(0, complex), np.empty(0, complex)
    rows, columns = _nearest_pairs(np.abs(first[:, None] - last))
    ahead = [z for i, z in enumerate(first) if i not in rows and z.real > 0]
    behind = [z for j, z in enumerate(last) if j not in columns and z.real > 0]
    if not ahead and not behind:
        return first[rows], last[columns]
    gone = [system.eigenvalue_near(right.x, z) for z in ahead]
    came = [system.eigenvalue_near(left.x, z) for z in behind]
    return np.concatenate([first[rows], ahead, came]), np.concatenate([last[columns], gone, behind])


def _nearest_pairs(gaps: Array) -> tuple[Indices, Indices]:
    """Return rows and columns of a matrix that belong together, as many as the shorter side has: their sum is the least."""
    nearest: Indices = gaps.argmin(axis=1) if gaps.size else np.empty(0, dtype=np.int64)
    if len(set(nearest.tolist())) == len(gaps):
        return np.arange(len(gaps)), nearest
    from scipy.optimize import linear_sum_assignment  # type: ignore[import-untyped]  # takes .1 s; most steps do without

    rows, columns = linear_sum_assignment(gaps)
    return rows, columns


def _between(arc: Arc, left: Place, right: Place, depth: int) -> list[SpecialPoint]:
    first, last = _changes(left[1], right[1])
    one, other = _half_plane(first), _half_plane(last)
    if not (np.any(one) or np.any(other)):
        return []
    if np.all(one == other):
        located = [_located(arc, left, right, both) for both in zip(first[one > 0], last[one > 0])]
        found = [point for point in located if point is not None]
        if all(_pairs_at(here) >= sum(abs(here.at - other.at) <= DOUBLED * arc.step for other in found) for here in found):
            return found
    if depth == _CUTS:
        return []
    middle = (left[0] + right[0]) / 2
    there = middle, arc.near(middle)
    return _between(arc, left, there, depth + 1) + _between(arc, there, right, depth + 1)


def _located(arc: Arc, left: Place, right: Place, both: tuple[complex, complex]) -> SpecialPoint | None:
    """Return the place where the real part of an eigenvalue vanishes that has these values at two places.

    The second place, not located, where that fails; None where the pair turns out to be real.
    """
    (a, b), (first, last) = (left[0], right[0]), both

    def real_part(s: float) -> float:
        found = _real_part(arc.at(s), first + (last - first) * (s - a) / (b - a))
        if not math.isfinite(found):
            raise ConvergenceError("no eigenvalue is known there")
        return found

    is_located = True
    try:
        at = find_zero(real_part, (a, first.real), (b, last.real), arc.precision)
        there = arc.at(at)
    except ConvergenceError:
        (at, there), is_located = right, False
    values = _upper(there)
    if not values.size:
        return None
    here = first + (last - first) * (at - a) / (b - a)
    frequency = float(values[np.argmin(np.abs(values - here))].imag)
    system = there.system
    crossing = system.crossing(there.x, frequency)
    if crossing is None:
        return None
    label, name = crossing
    test = Event(Label.HOPF, "Hopf", critical_real_part(frequency), search=hopf_points, normal_form=pair)
    if is_located and 0.0 in (first.real, last.real) and not passes(arc, at, frequency):
        return None  # the pair lies on the axis before
    return SpecialPoint(at, label, name, there, None, {"frequency": frequency, "pairs": 1}, test, is_located=is_located)


def passes(arc: Arc, at: float, frequency: float) -> bool:
    """Return whether the pair of this frequency lies on different sides of the axis before and behind a place.

    One that is on the axis up to round-off at either place does not.
    """
    sides = []
    for s in (at - BESIDE * arc.step, at + BESIDE * arc.step):
        trial = arc.near(s)
        system = trial.system
        values = system.eigenvalues(trial.x)
        sides.append(values[np.argmin(np.abs(values - 1j * frequency))].real)
    return bool(sides[0] * sides[1] < 0)


def _pairs_at(point: SpecialPoint) -> int:
    """Return how many pairs lie on the imaginary axis at a Hopf point."""
    values = _upper(point.trial)
    return int(np.count_nonzero(_is_complex(values) & (np.abs(values.real) < DOUBLED * (1 + np.abs(values)))))


def _joined(found: list[SpecialPoint], arc: Arc) -> list[SpecialPoint]:
    """Return the points, those at one place joined."""
    result: list[SpecialPoint] = []
    for point in found:
        if result and point.at - result[-1].at <= DOUBLED * arc.step:
            if _pairs_at(point) > result[-1].details["pairs"]:
                result[-1].details["pairs"] += 1
        else:
            result.append(point)
    return result
