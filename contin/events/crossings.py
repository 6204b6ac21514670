"""The number of singular values of [F_x; row] that pass zero in a step.

The determinant sees the parity only: two modes that cross together, or two branch points in one step, leave its sign as it
was. They are seen in the quotient of the matrices at both ends: each passage of a singular value through zero turns one of its
eigenvalues negative.

1. Of a small matrix all eigenvalues are computed.
2. On a mesh the small matrix that condensation leaves (`contin.linalg.ends`) takes its place, as long as the relations between
   mesh points turn little from one point of the curve to the other, all along the mesh, and stay on the same side. The
   condensed matrix cannot tell solutions that have gained a half-wave from those that have not; this is what turn and sides
   tell. Where they turn more, places between are looked at, too, on the cubic: over a piece of the step they turn less. Where
   more than one singular value seems to pass, the whole matrix is asked.
3. Otherwise the eigenvalues are computed in the directions in which the inverses differ most, by a block Krylov method.
   Directions in which the matrix is nearest to singular are not the same: small singular values that stay as they are would
   hide those that pass.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from typing import Any

import numpy as np

from contin.arrays import Array, ComplexArray, Mask
from contin.linalg.blocks import Factors
from contin.linalg.border import ReplacedRows, fill_products, orthonormalize, random_rows
from contin.linalg.condensation import Factorization
from contin.linalg.ends import compared, is_near_one
from contin.linalg.matrices import DenseFactors, eigenvalues

#: Size of the largest matrix of which all eigenvalues are computed at once (some 5 ms). The iteration takes a tenth of that;
#: it went wrong where eigenvectors were nearly parallel (inverses of size 1e6): with 24, one of 60 random problems lost 7
#: double points.
_SMALL = 64
#: Size of the largest matrix of which all are computed where the iteration does not decide.
_MEDIUM = 128
#: Sum of the squared sines of the angles by which relations may turn: then the condensed matrix decides. Below 1 no direction
#: turns by a right angle, so that it can be told on which side it is. With half of it, three times as many steps of the demo
#: ``kar`` are looked at closely; no test sees a difference.
TURN = 0.9
#: How often a step is halved where relations turn more over it: over half of it, they turn a quarter as much. With three, 31
#: steps of AUTO's demo ``ab`` stay undecided, 4 of ``kar`` and 8 of ``lin``, with four 24, 0 and 4; five take as long.
_HALVINGS = 4
#: A condensed matrix that differs from the identity by less has no eigenvalue near zero.
NEAR_ONE = 0.9
#: Directions added in a round, and the largest number of them: where more change, the step is divided, which takes as long as
#: 16 directions do. With 64 the half loop of the benchmarks took 1.7 times as long, with 24 a fifth more.
_ADDED, _MOST = 4, 16
#: Residual of an eigenvalue, relative to the size of its terms, below which it has converged: its sign is then certain.
_CONVERGED = 0.1
#: Part of the inverse at the end in the difference of the inverses that the power method takes: a little less than all of it,
#: so that the difference is regular where nothing changes.
_KEPT = 0.999
#: A singular value that changes by less than this factor stays about as it is. Those that change less than it need not be
#: watched: where all singular values move by the same amount, those that pass zero change at least three times as much.
_STEADY = 3.0
#: Factor by which a watched singular value may shrink in one step without passing zero: one that ends close to zero may pass
#: it in the next step twice, and come back. Without this, two branch points of the test bank are lost.
_SHRINKS = 20.0
#: One that passes zero and ends this many times smaller vanishes at the very end of the step, on neither side for certain.
_VANISHES = 1e4
#: Up to this change no singular value comes near zero, and factors of an iterate close by do as well. A fifth of it costs 10 %
#: more factorizations on the test bank, twice as much saves 0.5 %.
CALM = 10.0
#: Rounds with such factors. With one, twice as many steps take factors at both ends.
_GLANCES = 2


def quotients(before: Factors, after: Factors, size: int) -> ComplexArray:
    """Return how the singular values that change most do so between two points, from the factors of [F_x; row] there.

    They are eigenvalues of the quotient of the matrices (size, size), shape (watched,), complex; NaN where a matrix is exactly
    singular, or where too many change.
    """
    condensed = _condensed(before, after)
    found = np.full(1, np.nan, dtype=complex) if condensed is None else _finite_eigenvalues(condensed)
    if crossings(found) in ((0, True), (1, True)):
        return found
    if size > _SMALL:  # two that pass may be one mode that no end feels, as that of a front between saddles: it turns
        values = _watched(before, after, size)
        if values is not None:
            return values
    return _all(before, after, size) if size <= _MEDIUM else found


def known_quotients(before: Any, after: Any, size: int) -> ComplexArray | None:
    """Return the same where all of them are at hand, of small or condensed matrices; None elsewhere.

    They are ones where the quotient is so near to the identity that nothing comes near zero.
    """
    dense = isinstance(before, DenseFactors) and isinstance(after, DenseFactors)
    quotient = after.solve(before.matrix.T) if dense and size <= _SMALL else _condensed(before, after)
    if quotient is None:
        return _all(before, after, size) if size <= _SMALL else None
    quotient = np.ascontiguousarray(quotient)
    near = is_near_one(quotient, NEAR_ONE, CALM, np.empty(quotient.shape))
    return np.ones(1, complex) if near else _finite_eigenvalues(quotient)


def quotients_along(factors: Callable[[float], Factors]) -> tuple[ComplexArray, Array] | None:
    """Return how singular values change from each of some places of a step to the next, where condensed matrices decide.

    They are eigenvalues of the quotients, NaN where relations turn too much, and the parts of the step at which those that pass
    zero do so; None where matrices are not condensed. ``factors`` returns those of [F_x; row] at a part of the step.
    """
    if not _is_condensed(factors(1.0)):
        return None
    values, places = [], []
    for start, end, found in _along(factors, 0.0, 1.0, _HALVINGS):
        values.append(np.full(1, np.nan, complex) if found is None else _finite_eigenvalues(found))
        places.append(start + (end - start) * shares(values[-1]))
    return np.concatenate(values), np.concatenate(places)


def shares(values: ComplexArray) -> Array:
    """Return at which part of the step singular values pass zero that change evenly, from their `quotients`."""
    return 1 - 1 / (1 + np.abs(values))  # an infinite one, too


def _along(
    factors: Callable[[float], Factors], start: float, end: float, halvings: int
) -> Iterator[tuple[float, float, Array | None]]:
    """Yield pieces of a step, halved where condensed matrices do not decide, and their quotients; None, last, in the end."""
    quotient = _condensed(factors(start), factors(end))
    if quotient is not None or not halvings:
        yield start, end, quotient
        return
    middle = (start + end) / 2
    for piece in _along(factors, start, middle, halvings - 1):
        yield piece
        if piece[2] is None:
            return
    yield from _along(factors, middle, end, halvings - 1)


def _is_condensed(factors: object) -> bool:
    return isinstance(factors, Factorization) and factors.ends is not None


def _condensed(before: Any, after: Any) -> Array | None:
    """Return the quotient of the condensed matrices; None where there are none, and where they do not decide."""
    if isinstance(before, ReplacedRows) and isinstance(after, ReplacedRows):  # what is not small is regular all along
        quotient = DenseFactors(after.small).solve(before.small.T)
        return quotient if before.factors.sign == after.factors.sign and np.isfinite(quotient).all() else None
    if not (_is_condensed(before) and _is_condensed(after)):
        return None
    quotient, turn = compared(before.ends, after.ends)
    return quotient if turn < TURN and np.isfinite(quotient).all() else None


def _finite_eigenvalues(matrix: Array) -> ComplexArray:
    try:
        return eigenvalues(matrix)
    except np.linalg.LinAlgError:
        return np.full(len(matrix), np.nan, dtype=complex)


def _all(before: Factors, after: Factors, size: int) -> ComplexArray:
    """Return all eigenvalues of the quotient."""
    if isinstance(before, DenseFactors) and isinstance(after, DenseFactors):
        return _finite_eigenvalues(after.solve(before.matrix.T))
    with np.errstate(all="ignore"):
        unit = np.eye(size)
        return _finite_eigenvalues(DenseFactors(before.solve(unit).T).solve(after.solve(unit)))


def _watched(before: Factors, after: Factors, size: int) -> ComplexArray | None:
    """Return the eigenvalues in those directions in which the inverses differ most; None where these are too many."""
    watch = _Watch(before, after, size)
    while watch.grows():
        if not np.isfinite(watch.values).all():
            return watch.values
        decided = watch.decided()
        if decided is not None:
            return decided
    return None


class _Watch:
    """The quotient of two inverses on a growing space: eigenvalues in the directions in which the inverses differ most.

    A block of directions is added to both bases in each round, as by Golub and Kahan.
    """

    def __init__(self, before: Factors, after: Factors, size: int) -> None:
        self.before, self.after = before, after
        self.most, self.count, self._compared = min(_MOST, _ADDED * (size // (2 * _ADDED))), 0, 0
        #: Bases, and the images of the left one under both inverses, as rows.
        self._left, self._right, self._earlier, self._later = np.empty((4, self.most, size))
        #: Products of right basis and images; products of the images.
        self._quotient, self._gram = np.empty((2, self.most, self.most)), np.empty((3, self.most, self.most))
        self._block = random_rows(_ADDED, size)
        self.values = np.empty(0, dtype=complex)

    def grows(self) -> bool:
        """Add a block of directions, unless there are too many, and compute the ``values``."""
        known, count = self.count, self.count + _ADDED
        if count > self.most:
            return False
        left, right, earlier, later = self._left, self._right, self._earlier, self._later
        new = slice(known, count)
        with np.errstate(all="ignore"):
            left[new] = self.before.solve_transposed(self._block) - _KEPT * self.after.solve_transposed(self._block)
            orthonormalize(left[:count], known)
            earlier[new], later[new] = self.before.solve(left[new]), self.after.solve(left[new])
            right[new] = earlier[new] - _KEPT * later[new]
            orthonormalize(right[:count], known)
            for images, products in zip((earlier, later), self._quotient):
                fill_products(right, images, known, count, products)
            self.values, self._vectors = _eigenvalues(*self._quotient[:, :count, :count])
        self._block, self.count = right[new], count
        return True

    def decided(self) -> ComplexArray | None:
        """Return the eigenvalues that change most, where they are known and all others are steady; None where they are not.

        The directions suffice where one of them is steady, and it and all that change more have converged.
        """
        earlier, later, values = self._earlier, self._later, self.values
        with np.errstate(all="ignore"):
            for one, other, products in zip((earlier, earlier, later), (earlier, later, later), self._gram):
                fill_products(one, other, self._compared, self.count, products)
            self._compared = self.count
            vectors, sizes = self._vectors, np.abs(values)
            images = self._gram[:, : self.count, : self.count] @ vectors
            first, mixed, last = np.sum(vectors.conj() * images, axis=1)
            missed = last.real - 2 * (values.conj() * mixed).real + sizes**2 * first.real
            changes = _KEPT**2 * last.real - 2 * _KEPT * mixed.real + first.real
            converged = missed < (_CONVERGED * (np.sqrt(last.real) + sizes * np.sqrt(first.real))) ** 2
            steady = converged & (values.real > 1 / _STEADY) & (sizes < _STEADY)  # those stay about as they are
            if not np.any(steady):
                return None
            decided = changes >= changes[steady].max()
            if np.all(converged[decided]) and np.all(decided | (values.real > 0)):
                return values[decided]
        return None


def _eigenvalues(earlier: Array, later: Array) -> tuple[ComplexArray, ComplexArray]:
    """Return the eigenvalues of earlier^-1 later, and its eigenvectors as columns of unit length; NaN where it is singular."""
    if np.isfinite(later).all() and np.isfinite(earlier).all():
        try:
            values, vectors = np.linalg.eig(np.linalg.solve(earlier, later))
            return values.astype(complex, copy=False), vectors.astype(complex, copy=False)
        except np.linalg.LinAlgError:
            pass
    return np.full(len(later), np.nan, dtype=complex), np.full(later.shape, np.nan, dtype=complex)


def changes_little(before: Factors, after: Factors, size: int) -> bool:
    """Return whether no singular value comes anywhere near zero between two points, be it from approximate factors.

    The directions in which the inverses differ most tell it, where nothing condensed decides.
    """
    if size <= _SMALL:
        return _is_calm(_all(before, after, size))
    watch = _Watch(before, after, size)
    for number in range(_GLANCES):
        if not watch.grows() or not np.isfinite(watch.values).all():
            return False
        if number == 0 and _is_calm(watch.values):
            return True
        decided = watch.decided()
        if decided is not None:
            return _is_calm(decided)
    return False


def _is_calm(values: ComplexArray) -> bool:
    sizes = np.abs(values)
    return bool(np.all((values.real > 0) & (sizes < CALM) & (sizes > 1 / CALM)))


def crossings(values: ComplexArray) -> tuple[int, bool]:
    """Return how many singular values pass zero, from `quotients`, and whether that is clear.

    It is not where one of them is close to zero at the end.
    """
    passing = (values.real < 0) & (np.abs(values.imag) < np.abs(values.real))
    clear = np.abs(values) < np.where(passing, _VANISHES, _SHRINKS)
    return int(np.count_nonzero(passing)), bool(np.all(clear))


def passed(values: ComplexArray) -> tuple[Mask, Mask]:
    """Return which singular values pass zero before the second point, and which vanish right there, from `quotients`.

    Of those that vanish, round-off decides on the sign.
    """
    vanishing = np.abs(values) > _VANISHES
    passing = (values.real < 0) & (np.abs(values.imag) < np.abs(values.real)) & ~vanishing
    return passing, vanishing
