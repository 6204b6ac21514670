"""What the eigenvalues at both ends of a step say inside kernels: may something pass between them?

The rules are those of `contin.events.hopf`, which asks `find_moves`, too, and of `contin.cycles.floquet`. Where round-off
would decide whether eigenvalues lie on the axis, or multipliers on the circle, these ask.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from contin.arrays import Array
from contin.core.small import Equations, evaluate
from contin.events.dips import CIRCLE, DEEPER, LOOKS, MINUS_ONE, NO_MULTIPLIER, ONE, comes_near, parabola
from contin.kernels.kernel import kernel
from contin.kernels.kernel_parts import IndexVector, Matrix, Stack, Vector, helper
from contin.levels import APART, LOCATED
from contin.linalg.periodic import Product, fill_logarithms, product_of
from contin.linalg.small import fill_eigenvalues

#: Parts of a step at which multipliers are known: both ends, and `LOOKS` between them.
_PLACES = np.array([0.0, *LOOKS, 1.0])
#: Rows of `Spectra` that hold both ends, and what is between them.
FIRST, LAST, _COUNT = 0, len(LOOKS) + 1, len(LOOKS) + 2
#: Those among them at which pairs of multipliers are followed: a quarter of the step apart.
_QUARTERS = tuple(place for place, part in enumerate([0.0, *LOOKS, 1.0]) if (4 * part) % 1 == 0)

#: Least distance of multipliers from the circle, as logarithms, for a step that is not looked at inside since they stand still.
#: Ten times smaller, doublings may be passed between which that distance is passed and regained; ten times larger, none stand.
_OFF = 0.3
#: They stand still where they move by less than the distance over this, in the step and in the one before: what passes -1, or
#: the circle, inside a step and comes back moves as far as that beside it. Ten times smaller is too near to that.
_STILL = 30.0


class Moves(NamedTuple):
    """Between which of some places a pair may move to the imaginary axis.

    ``rows`` (P,) are the places among all. ``far`` (P - 1, n) is how far each eigenvalue moves, ``passes`` (P - 1,) whether a
    pair may move to the axis, ``unclear`` (P - 1,) whether it is not clear how often.
    """

    rows: IndexVector
    far: Matrix
    passes: IndexVector
    unclear: IndexVector


def moves_of(rows: Sequence[int], n: int) -> Moves:
    """Return the room for moves of n eigenvalues between rows."""
    count = len(rows) - 1
    passes, unclear = np.empty((2, count), dtype=np.int64)
    return Moves(np.array(rows, dtype=np.int64), np.empty((count, n)), passes, unclear)


class Spectra(NamedTuple):
    """Eigenvalues, or logarithms of multipliers, at places of a step: sorted rows of ``real`` and ``imaginary``.

    ``values`` are those of the test function of period doublings, ``cubic`` (4, size) the coefficients of the cubic between
    both ends, ``place`` a point of it, ``parts`` the places as parts of the step, ``ends`` and ``quarters`` room for moves.
    ``moved`` (1,) is how far they moved in the step before, as parts of their distances from the circle. ``square``
    (rounds, n, n) are matrices, whose ``product`` multipliers of maps belong to.
    """

    square: Stack
    product: Product
    ones: Matrix
    others: Matrix
    real: Matrix
    imaginary: Matrix
    values: Vector
    cubic: Matrix
    place: Vector
    parts: Vector
    moved: Vector
    ends: Moves
    quarters: Moves


def spectra_of(n: int, size: int, rounds: int = 1) -> Spectra:
    """Return the room for n eigenvalues of a problem with so many unknowns, or of so many matrices."""
    ones, others = np.empty((2, 1, n))
    return Spectra(
        np.empty((rounds, n, n)), product_of(rounds, n), ones, others, np.empty((_COUNT, n)), np.empty((_COUNT, n)),
        np.empty(_COUNT), np.empty((4, size)), np.empty(size), _PLACES, np.full(1, np.inf),
        moves_of((FIRST, LAST), n), moves_of(_QUARTERS, n),
    )  # fmt: skip


@helper
def insert(real: Vector, imaginary: Vector, count: int, x: float, y: float) -> None:
    """Insert an eigenvalue among so many that are sorted."""
    at = count
    while at > 0 and (real[at - 1] > x or (real[at - 1] == x and imaginary[at - 1] > y)):
        real[at], imaginary[at] = real[at - 1], imaginary[at - 1]
        at -= 1
    real[at], imaginary[at] = x, y


@helper
def fill_spectrum(equations: Equations, spectra: Spectra, number: int) -> bool:
    """Fill in a row from the derivatives that were evaluated; return whether round-off decides on the side of one of them."""
    (rounds, n, _), doubt = spectra.square.shape, False
    for k in range(rounds):
        for i in range(n):
            for j in range(n):
                spectra.square[k, i, j] = equations.slopes_found[k, i, j] * equations.rates[i]
    one, other, largest = spectra.ones[0], spectra.others[0], 0.0
    if equations.is_map:
        fill_logarithms(spectra.square, spectra.product, one, other)
    else:
        fill_eigenvalues(spectra.square, n, spectra.ones, spectra.others)
    for i in range(n):
        if equations.is_map:
            one[i] = max(one[i], math.log(NO_MULTIPLIER))
            doubt = doubt or not abs(one[i]) >= APART
        else:
            largest = max(largest, math.hypot(one[i], other[i]))
    real, imaginary = spectra.real[number], spectra.imaginary[number]
    for i in range(n):
        x, y = one[i], other[i]
        if not equations.is_map:
            doubt = doubt or not (abs(x) >= LOCATED * largest or y == 0.0 or x == 0.0)
        insert(real, imaginary, i, x, y)
    return doubt


@helper
def _rate(real: Matrix, imaginary: Matrix, at: Vector, rows: IndexVector, k: int, i: int) -> float:
    """Return how fast an eigenvalue moves behind a place, or behind the nearest one that has another behind it."""
    k = min(max(k, 0), rows.size - 2)
    one, other = rows[k], rows[k + 1]
    return math.hypot(real[other, i] - real[one, i], imaginary[other, i] - imaginary[one, i]) / (at[other] - at[one])


@helper
def _keeps_on(real: Matrix, imaginary: Matrix, moves: Moves, k: int, i: int) -> bool:
    """Return whether an eigenvalue is on one side behind a place, keeps its direction there and beside, and meets no other."""
    rows, n, furthest = moves.rows, real.shape[1], 0.0
    one, other, sense = rows[k], rows[k + 1], real[rows[k + 1], i] - real[rows[k], i]
    if not real[one, i] * real[other, i] > 0:
        return False
    for beside in range(max(k - 1, 0), min(k + 2, rows.size - 1)):
        if not sense * (real[rows[beside + 1], i] - real[rows[beside], i]) > 0:
            return False
    for j in range(n):
        furthest = max(furthest, moves.far[k, j])
    for j in range(n):
        if j != i:
            before = math.hypot(real[one, j] - real[one, i], imaginary[one, j] - imaginary[one, i])
            behind = math.hypot(real[other, j] - real[other, i], imaginary[other, j] - imaginary[other, i])
            if not min(before, behind) > moves.far[k, i] + furthest:
                return False
    return True


@kernel(reorder=False, last=True)
def find_moves(real: Matrix, imaginary: Matrix, at: Vector, moves: Moves) -> int:
    """Find between which places a pair may move to the imaginary axis; return between how many.

    ``real`` and ``imaginary`` (all places, n) hold sorted eigenvalues, ``at`` the places. An eigenvalue that moves less than it
    is from the axis does not change the side. Those on the axis at both places do not count, and one alone is no pair. They are
    taken to move as fast as beside the two places too: ones that go to the axis and come back look as if they stood. One that
    keeps on does not come back. Where no others come near the axis than two that pass, one pair passes once.
    """
    rows, far, n, found = moves.rows, moves.far, real.shape[1], 0
    for k in range(rows.size - 1):
        length = at[rows[k + 1]] - at[rows[k]]
        for i in range(n):
            far[k, i] = _rate(real, imaginary, at, rows, k, i)
            for beside in (k - 1, k + 1):
                rate = _rate(real, imaginary, at, rows, beside, i)
                if rate > far[k, i] or rate != rate:  # noqa: PLR0124
                    far[k, i] = rate
            far[k, i] *= length
        near, passed = 0, 0
        for i in range(n):
            first, last = real[rows[k], i], real[rows[k + 1], i]
            passed += int(last > 0) - int(first > 0)
            distance = math.inf if first == 0.0 and last == 0.0 else min(abs(first), abs(last))
            if not far[k, i] < distance and not (rows.size > 2 and _keeps_on(real, imaginary, moves, k, i)):
                near += 1
        moves.passes[k] = int(near > 1)
        moves.unclear[k] = int(near > 1 and not (near == 2 and abs(passed) == 2))
        found += int(near > 1)
    return found


@helper
def may_pass_axis(equations: Equations, spectra: Spectra) -> bool:
    """Return whether a pair may pass the axis, by how far eigenvalues move between both ends and, then, places inside."""
    if find_moves(spectra.real, spectra.imaginary, spectra.parts, spectra.ends) == 0:
        return False
    for k in range(1, len(_QUARTERS) - 1):
        if _look(equations, spectra, _QUARTERS[k]):
            return True
    return find_moves(spectra.real, spectra.imaginary, spectra.parts, spectra.quarters) > 0


@helper
def may_cross_between(spectra: Spectra, longer: float, before: float) -> bool:
    """Return whether multipliers may pass -1, or the circle as a pair, and back, by both ends of a step and moves before."""
    if _STILL * max(spectra.moved[0], before) < 1:
        return False
    real, imaginary = spectra.real, spectra.imaginary
    return bool(comes_near(real, imaginary, MINUS_ONE, 0, longer) or comes_near(real, imaginary, CIRCLE, 0, longer))


@helper
def crosses(spectra: Spectra) -> bool:
    """Return whether multipliers have passed -1 or the circle from one end of a step to the other; note how far they moved."""
    spectra.moved[0] = _moved(spectra)
    return _crosses(spectra)


@helper
def passes_inside(spectra: Spectra, doubles: bool, twists: bool) -> bool:
    """Return whether multipliers may pass -1 or, as a pair, the circle by all places of a step."""
    for number in range(1, LAST):
        _fill_values(spectra, number)
    real, imaginary = spectra.real, spectra.imaginary
    return (doubles and _dips(spectra)) or (twists and find_moves(real, imaginary, spectra.parts, spectra.quarters) > 0)


@helper
def _moved(spectra: Spectra) -> float:
    """Return how far a multiplier moves in a step, as a part of its distance from the circle; infinity if one is near it."""
    n, largest = spectra.real.shape[1], 0.0
    for each in range(2 * n):
        here, there, i = (FIRST, LAST, each) if each < n else (LAST, FIRST, each - n)
        x, y, move = spectra.real[here, i], spectra.imaginary[here, i], math.inf
        for j in range(n):
            turn = abs(y - spectra.imaginary[there, j])
            move = min(move, math.hypot(x - spectra.real[there, j], min(turn, 2 * math.pi - turn)))
        largest = max(largest, move / abs(x) if abs(x) > _OFF else math.inf)
    return largest


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
    return passes_inside(spectra, doubles, twists)


@helper
def _crosses(spectra: Spectra) -> bool:
    """Return whether multipliers have passed -1 or the circle from one end of a step to the other."""
    _fill_values(spectra, FIRST)
    _fill_values(spectra, LAST)
    return not spectra.values[FIRST] * spectra.values[LAST] > 0 or _outside(spectra, FIRST) != _outside(spectra, LAST)


@helper
def _look(equations: Equations, spectra: Spectra, number: int) -> bool:
    """Fill in the eigenvalues at a place of the cubic; return whether round-off decides on the side of one of them."""
    fill_place(spectra, number)
    evaluate(equations, spectra.place, equations.slopes, equations.slopes_found)
    return fill_spectrum(equations, spectra, number)


@helper
def fill_place(spectra: Spectra, number: int) -> None:
    """Fill in a place of the cubic."""
    s = spectra.parts[number]
    for i in range(spectra.place.size):
        one, two, three, four = spectra.cubic[0, i], spectra.cubic[1, i], spectra.cubic[2, i], spectra.cubic[3, i]
        spectra.place[i] = one + s * (two + s * (three + s * four))


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
        at, _, lowest = parabola(a, b, c, first, middle, last)
        if a < at < c and lowest < DEEPER * min(first, middle, last):
            return True
    return False
