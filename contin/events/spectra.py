"""What the eigenvalues at both ends of a step say inside kernels: may something pass between them?

The rules are those of `contin.events.hopf` and `contin.cycles.floquet`. Where round-off would decide whether eigenvalues
lie on the axis, or multipliers on the circle, these ask.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from contin.arrays import Array
from contin.core.rounding import NEAR_AXIS, NEAR_CIRCLE
from contin.core.small import Equations, evaluate_slopes
from contin.events.nearness import CIRCLE, DEEPER, LOOKS, MINUS_ONE, NO_MULTIPLIER, ONE, comes_near
from contin.functions.kernel_parts import Matrix, Stack, Vector, helper
from contin.linalg.spectrum import fill_eigenvalues

#: Parts of a step at which multipliers are known: both ends, and `LOOKS` between them.
_PLACES = np.array([0.0, *LOOKS, 1.0])
#: Rows of `Spectra` that hold both ends, and what is between them.
FIRST, LAST, _COUNT = 0, len(LOOKS) + 1, len(LOOKS) + 2
#: Those among them at which pairs of multipliers are followed: a quarter of the step apart.
_QUARTERS = tuple(place for place, part in enumerate([0.0, *LOOKS, 1.0]) if (4 * part) % 1 == 0)


class Spectra(NamedTuple):
    """Eigenvalues, or logarithms of multipliers, at places of a step: sorted rows of ``real`` and ``imaginary``.

    ``values`` are those of the test function of period doublings, ``cubic`` (4, size) the coefficients of the cubic between
    both ends, ``place`` a point of it, ``parts`` the places as parts of the step.
    """

    square: Stack
    ones: Matrix
    others: Matrix
    real: Matrix
    imaginary: Matrix
    values: Vector
    cubic: Matrix
    place: Vector
    parts: Vector


def spectra_of(n: int, size: int) -> Spectra:
    """Return the room for n eigenvalues of a problem with so many unknowns."""
    return Spectra(
        np.empty((1, n, n)), np.empty((1, n)), np.empty((1, n)), np.empty((_COUNT, n)), np.empty((_COUNT, n)),
        np.empty(_COUNT), np.empty((4, size)), np.empty(size), _PLACES,
    )  # fmt: skip


@helper
def fill_spectrum(equations: Equations, spectra: Spectra, number: int) -> bool:
    """Fill in a row from the derivatives that were evaluated; return whether round-off decides on the side of one of them."""
    n, doubt = spectra.real.shape[1], False
    for i in range(n):
        for j in range(n):
            spectra.square[0, i, j] = equations.slopes_found[0, i, j] * equations.rates[i]
    fill_eigenvalues(spectra.square, n, spectra.ones, spectra.others)
    one, other = spectra.ones[0], spectra.others[0]
    largest = 0.0
    for i in range(n):
        x, y = one[i], other[i]
        size = math.hypot(x, y)
        if equations.is_map:
            one[i], other[i] = math.log(max(size, NO_MULTIPLIER)), math.atan2(y, x)
            doubt = doubt or not abs(one[i]) >= NEAR_CIRCLE
        else:
            largest = max(largest, size)
    real, imaginary = spectra.real[number], spectra.imaginary[number]
    for i in range(n):
        x, y = one[i], other[i]
        if not equations.is_map:
            doubt = doubt or not (abs(x) >= NEAR_AXIS * largest or y == 0.0 or x == 0.0)
        at = i
        while at > 0 and (real[at - 1] > x or (real[at - 1] == x and imaginary[at - 1] > y)):
            real[at], imaginary[at] = real[at - 1], imaginary[at - 1]
            at -= 1
        real[at], imaginary[at] = x, y
    return doubt


@helper
def moved(spectra: Spectra, one: int, other: int) -> float:
    """Return the largest distance by which an eigenvalue moves between two places; NaN where one is not known."""
    largest = 0.0
    for i in range(spectra.real.shape[1]):
        apart = math.hypot(
            spectra.real[other, i] - spectra.real[one, i], spectra.imaginary[other, i] - spectra.imaginary[one, i]
        )
        if not apart <= largest:
            largest = apart
    return largest


@helper
def room(spectra: Spectra, one: int, other: int) -> float:
    """Return the second smallest distance of an eigenvalue to the axis at two places, without those on it at both."""
    least, second = math.inf, math.inf
    for i in range(spectra.real.shape[1]):
        first, last = abs(spectra.real[one, i]), abs(spectra.real[other, i])
        distance = math.inf if first == 0.0 and last == 0.0 else min(first, last)
        if distance < least:
            least, second = distance, least
        elif distance < second:
            second = distance
    return second


@helper
def may_pass_axis(equations: Equations, spectra: Spectra) -> bool:
    """Return whether a pair may pass the axis, by how far eigenvalues move between both ends and, then, places inside."""
    if moved(spectra, FIRST, LAST) < room(spectra, FIRST, LAST):
        return False
    for k in range(1, len(_QUARTERS) - 1):
        if _look(equations, spectra, _QUARTERS[k]):
            return True
    return _moves_far(spectra)


@helper
def may_cross_between(spectra: Spectra, longer: float) -> bool:
    """Return whether multipliers may pass -1, or the unit circle as a pair, by both ends of a step alone."""
    if _crosses(spectra):
        return True
    real, imaginary = spectra.real, spectra.imaginary
    return bool(comes_near(real, imaginary, MINUS_ONE, 0, longer) or comes_near(real, imaginary, CIRCLE, 0, longer))


@helper
def keep_off_one(spectra: Spectra, longer: float) -> bool:
    """Return whether no multiplier comes near 1, by both ends of a step alone."""
    return not comes_near(spectra.real, spectra.imaginary, ONE, 0, longer)


@helper
def may_double_or_twist(equations: Equations, spectra: Spectra) -> bool:
    """Return whether multipliers may pass -1, or the unit circle as a pair; inside the step where they come near either."""
    if _crosses(spectra):
        return True
    real, imaginary, map_ = spectra.real, spectra.imaginary, equations.is_map
    doubles = comes_near(real, imaginary, MINUS_ONE, map_, 1.0) > 0
    twists = comes_near(real, imaginary, CIRCLE, map_, 1.0) > 0
    if not (doubles or twists):
        return False
    for number in range(1, LAST):
        if _look(equations, spectra, number):
            return True
        _fill_values(spectra, number)
    return (doubles and _dips(spectra)) or (twists and _moves_far(spectra))


@helper
def _crosses(spectra: Spectra) -> bool:
    """Return whether multipliers have passed -1 or the circle from one end of a step to the other."""
    _fill_values(spectra, FIRST)
    _fill_values(spectra, LAST)
    return not spectra.values[FIRST] * spectra.values[LAST] > 0 or _outside(spectra, FIRST) != _outside(spectra, LAST)


@helper
def _look(equations: Equations, spectra: Spectra, number: int) -> bool:
    """Fill in the eigenvalues at a place of the cubic; return whether round-off decides on the side of one of them."""
    s = spectra.parts[number]
    for i in range(spectra.place.size):
        one, two, three, four = spectra.cubic[0, i], spectra.cubic[1, i], spectra.cubic[2, i], spectra.cubic[3, i]
        spectra.place[i] = one + s * (two + s * (three + s * four))
    evaluate_slopes(equations, spectra.place)
    return fill_spectrum(equations, spectra, number)


@helper
def fill_cubic(spectra: Spectra, x: Array, tangent: Array, new: Array, new_tangent: Array, step: float, rate: float) -> None:
    """Fill in the cubic through both ends of a step, by parts of it; ``rate`` is the length of the tangent at its end."""
    for i in range(x.size):
        ahead, a, b = new[i] - x[i], tangent[i] * step, new_tangent[i] * rate
        spectra.cubic[0, i], spectra.cubic[1, i] = x[i], a
        spectra.cubic[2, i], spectra.cubic[3, i] = 3 * ahead - 2 * a - b, a + b - 2 * ahead


@helper
def _fill_values(spectra: Spectra, number: int) -> None:
    """Fill in det(M + I), each factor divided by 1 + |multiplier|."""
    real, imaginary = 1.0, 0.0
    for i in range(spectra.real.shape[1]):
        x, y = spectra.real[number, i], spectra.imaginary[number, i]
        size = math.exp(-abs(x))
        one, other = (size, 1.0) if x > 0 else (1.0, size)
        c, s = (one + other * math.cos(y)) / (1 + size), other * math.sin(y) / (1 + size)
        real, imaginary = real * c - imaginary * s, real * s + imaginary * c
    spectra.values[number] = real


@helper
def _outside(spectra: Spectra, number: int) -> int:
    """Return the number of multipliers outside the circle."""
    count = 0
    for i in range(spectra.real.shape[1]):
        if spectra.real[number, i] > 0:
            count += 1
    return count


@helper
def _dips(spectra: Spectra) -> bool:
    """Return whether the test function of period doublings changes its sign inside the step, or comes near zero."""
    values, parts = spectra.values, spectra.parts
    for k in range(1, LAST):
        if not values[k] * values[FIRST] > 0:
            return True
        a, b, c = parts[k - 1], parts[k], parts[k + 1]
        first, middle, last = abs(values[k - 1]), abs(values[k]), abs(values[k + 1])
        before, behind = (middle - first) / (b - a), (last - middle) / (c - b)
        square = (behind - before) / (c - a)
        linear = before + square * (b - a)
        if square > 0:
            at, lowest = b - linear / (2 * square), middle - linear * linear / (4 * square)
            if a < at < c and lowest < DEEPER * min(first, middle, last):
                return True
    return False


@helper
def _moves_far(spectra: Spectra) -> bool:
    """Return whether multipliers move, in a quarter of the step or beside it, as far as a pair is from the circle."""
    for k in range(1, len(_QUARTERS)):
        far = moved(spectra, _QUARTERS[k - 1], _QUARTERS[k])
        if k > 1:
            far = max(far, moved(spectra, _QUARTERS[k - 2], _QUARTERS[k - 1]))
        if k + 1 < len(_QUARTERS):
            far = max(far, moved(spectra, _QUARTERS[k], _QUARTERS[k + 1]))
        if not far < room(spectra, _QUARTERS[k - 1], _QUARTERS[k]):
            return True
    return False
