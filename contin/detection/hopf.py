"""Hopf points: pairs of complex eigenvalues of F_u that cross the imaginary axis, for u' = F (AUTO's HB).

Eigenvalues are counted, not multiplied: those at both ends of a piece are matched, nearest to nearest. Where just as many
complex ones changed the side as the numbers of unstable ones differ by, the k-th largest real part vanishes in the piece for
each k in between. Otherwise the piece is halved: one pair comes as another goes, or two real eigenvalues meet near the axis.
Real eigenvalues that cross (folds, branch points), and two opposite real ones (neutral saddles), are no Hopf points.
"""

from __future__ import annotations

import itertools
from typing import Any

import numpy as np

from contin.arrays import Array, ComplexArray
from contin.detection.root import find_zero
from contin.detection.segment import Place, Segment, SpecialPoint
from contin.errors import ConvergenceError
from contin.stepping.trial import TestFunction, Trial

#: An eigenvalue with a smaller imaginary part, relative to 1 + its size, is real: a double real one splits by the square root
#: of round-off.
_REAL = 1e-8
#: Into how many parts a step is divided to look inside it, on the cubic, ...
_PARTS = 4
#: ... and how often a piece is halved: crossings closer than 2^-20 of it are not told apart.
_CUTS = 20
#: Hopf points closer than this part of the step are one point with several pairs: round-off of eigenvalues of multiplicity two.
_TOGETHER = 1e-7


def hopf() -> TestFunction:
    """Return the test function of Hopf points: the largest real part of a complex eigenvalue. Several pairs are told apart."""
    return _kth(1)


def _kth(k: int) -> TestFunction:
    """Return the test function of the Hopf point of the pair with the k-th largest real part."""

    def function(trial: Trial) -> float:
        parts = _real_parts(trial)
        return float(parts[k - 1]) if len(parts) >= k else float("nan")

    return TestFunction("HB", "Hopf", function, search=hopf_points)


def _upper(trial: Trial) -> ComplexArray:
    """Return the eigenvalues with a positive imaginary part, and real ones."""
    system: Any = trial.system  # one with eigenvalues
    values: ComplexArray = system.eigenvalues(trial.x)
    return values[values.imag > -_REAL * (1 + np.abs(values))]


def _is_complex(values: ComplexArray) -> Any:
    return values.imag > _REAL * (1 + np.abs(values))


def _real_parts(trial: Trial) -> Array:
    """Return the real parts of the complex eigenvalues, one of each pair, the largest first."""
    values = _upper(trial)
    parts: Array = np.sort(values[_is_complex(values)].real)[::-1]
    return parts


def hopf_points(segment: Segment, knots: list[Place]) -> list[SpecialPoint]:
    """Return the Hopf points between places of a step, in order."""
    inside = [segment.step * part / _PARTS for part in range(1, _PARTS)]
    looked = sorted([*knots, *((s, segment.guessed(s)) for s in inside)], key=lambda knot: knot[0])
    if any(len(_changes(left[1], right[1])[0]) for left, right in itertools.pairwise(looked)):
        knots = sorted([*knots, *((s, segment.near(s)) for s in inside)], key=lambda knot: knot[0])
    found: list[SpecialPoint] = []
    for left, right in itertools.pairwise(knots):
        found += _between(segment, left, right, 0)
    return _joined(sorted(found, key=lambda point: point.at), segment)


def _changes(left: Trial, right: Trial) -> tuple[ComplexArray, ComplexArray]:
    """Return the eigenvalues at both ends that changed the side of the imaginary axis."""
    from scipy.optimize import linear_sum_assignment  # type: ignore[import-untyped]  # takes .1 s; only equilibria need it

    system: Any = left.system
    first, last = system.eigenvalues(left.x), system.eigenvalues(right.x)
    if not (np.all(np.isfinite(first)) and np.all(np.isfinite(last))):
        return np.empty(0, complex), np.empty(0, complex)
    ours, theirs = linear_sum_assignment(np.abs(first[:, None] - last))
    first, last = first[ours], last[theirs]
    changed = (first.real > 0) != (last.real > 0)
    upper = (first.imag > -_REAL * (1 + np.abs(first))) | (last.imag > -_REAL * (1 + np.abs(last)))
    return first[changed & upper], last[changed & upper]


def _between(segment: Segment, left: Place, right: Place, depth: int) -> list[SpecialPoint]:
    """Return the Hopf points between two places."""
    first, last = _changes(left[1], right[1])
    complex_ones = _is_complex(first) & _is_complex(last)
    if not np.any(_is_complex(first) | _is_complex(last)):
        return []
    ends = [_real_parts(trial) for _, trial in (left, right)]
    before, after = (int(np.count_nonzero(parts > 0)) for parts in ends)
    plain = np.all(complex_ones | ~(_is_complex(first) | _is_complex(last)))
    if plain and abs(after - before) == np.count_nonzero(complex_ones):
        return [_located(segment, left, right, k) for k in range(min(before, after) + 1, max(before, after) + 1)]
    if depth == _CUTS:
        return []
    middle = (left[0] + right[0]) / 2
    there = middle, segment.near(middle)
    return _between(segment, left, there, depth + 1) + _between(segment, there, right, depth + 1)


def _located(segment: Segment, left: Place, right: Place, k: int) -> SpecialPoint:
    """Return the place where the k-th largest real part vanishes; the second place, named "possible", where that fails."""
    test = _kth(k)
    ends = [test.function(trial) for _, trial in (left, right)]
    try:
        at = find_zero(lambda s: test.function(segment.at(s)), (left[0], ends[0]), (right[0], ends[1]), segment.precision)
        there, name = segment.at(at), test.name
    except ConvergenceError:
        at, there, name = *right, f"possible {test.name}"
    return SpecialPoint(at, test.label, name, there, None, _details(there, k), test)


def _details(trial: Trial, k: int) -> dict[str, float]:
    """Return the frequency of the pair with the k-th largest real part, and how many pairs cross."""
    values = _upper(trial)
    values = values[_is_complex(values)]
    order = np.argsort(-values.real)
    return {"frequency": float(values[order[k - 1]].imag) if len(order) >= k else float("nan"), "pairs": 1}


def _joined(found: list[SpecialPoint], segment: Segment) -> list[SpecialPoint]:
    """Return the points, those at one place joined."""
    result: list[SpecialPoint] = []
    for point in found:
        if result and point.at - result[-1].at <= _TOGETHER * segment.step:
            result[-1].details["pairs"] += 1
        else:
            result.append(point)
    return result
