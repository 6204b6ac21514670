"""Normal forms of folds, Hopf points and others, with the errors of their coefficients.

They are those of equilibria, cycles and cycles of maps (Kuznetsov, Elements of Applied Bifurcation Theory).

Perturbations that are multiplied by exp(rate t), or in a round by mu = exp(rate), are the null vectors of a characteristic
matrix L(rate). With the forms B and C, the derivatives of second and third order, a coordinate xi of the centre manifold obeys

    fold      xi' = b xi^2              L(0) v = 0:        b = w.B(v, v) / 2
    flip      -xi + c xi^3              L(pi i) v = 0:     c = w.[ C(v, v, v) + 3 B(v, h) ] / 6,  L(0) h = B(v, v)
    pair      xi' = d xi |xi|^2 + ...   L(i omega) v = 0:  d = w.[ C(v, v, v*) + 2 B(v, h) + B(v*, k) ] / 2,
                                                           L(0) h = B(v, v*),  L(2 i omega) k = B(v, v)

with w L = 0 and w.v = 1, times a number for the unit of time. The first Lyapunov coefficient of a Hopf point is Re d / omega.
What the matrix and the forms are, a `Form` states for each kind of solution. Unknowns of a cycle are its states and its period,
T (1 + stretch): B(v, h) has the terms stretch(h) (J - rate) v and stretch(v) J h besides (Kuznetsov, Govaerts, Doedel & Dhooge
2005), where L(0) leaves out the multiplier that is always one.

Where c or the real part of d is negative, the bifurcation is supercritical: what branches off attracts on the centre manifold;
at period doublings of maps where c is positive. The sign of b depends on that of v, and its absolute value is given; it
vanishes at a cusp.
"""

from __future__ import annotations

import dataclasses
import functools
import itertools
import math
from abc import ABC, abstractmethod
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, NamedTuple, cast

import numpy as np

from contin import draws
from contin.arrays import Array, Indices, Numbers
from contin.core.differences import of_complex
from contin.core.system import System
from contin.events.arc import SpecialPoint
from contin.levels import APART, CERTAIN, LOCATED, ROUGH, ROUND_OFF
from contin.linalg.border import Bordered, Borders, Solves, null_vectors
from contin.linalg.matrices import DenseFactors
from contin.linalg.orientation import oriented

#: A value that is not small beside its terms is no error, with terms below this size: that is not estimated. Near where it is
#: infinite the terms are large: 2e7 at the doubling of Hénon's map with a Jacobian of -1 + 1e-7.
_MODERATE = 1e6


@dataclass(frozen=True)
class Coefficient:
    """A coefficient of a normal form, its estimated error, and the sum of the absolute values of its terms.

    The bifurcation is supercritical where ``side * value`` is negative. ``estimate`` returns the error, when that is asked for.
    """

    value: float
    size: float
    estimate: Callable[[], float]
    side: int = 1

    @functools.cached_property
    def error(self) -> float:
        """The estimated error."""
        return self.estimate()

    @classmethod
    def of(cls, terms: Callable[[Array], Numbers], x: Array, system: Any) -> Coefficient:
        """Return the coefficient at a point x from its terms there: the real part of their sum.

        The relative error of the derivatives of ``system`` is part of the error, and so is what an error of x
        changes. At centres of conservative systems the coefficient is zero, and not larger than its error.
        """
        best, of_derivatives = system.with_derivative_error(lambda: terms(x))
        value, size = float(best.sum().real), float(np.abs(best).sum())

        def change(random: np.random.Generator) -> float:
            return value - float(terms(x + ROUND_OFF * (1 + np.abs(x)) * draws.signs(random, x)).sum().real)

        def estimate() -> float:
            return float(CERTAIN * draws.spread("coefficient", change) + of_derivatives * size)

        return cls(value, size, estimate)

    def signed(self, known: float) -> float:
        """Return the value for a test function: 0 where it is smaller than its error, as all along a curve of linear equations.

        ``known`` is the error of the point, relative to 1 + |x|: what Newton's method left may be more than at located ones.
        """
        error = self.error * max(1.0, CERTAIN * known / ROUND_OFF) if not self.is_certain else 0.0
        return self.value if not abs(self.value) <= error else 0.0

    @property
    def is_certain(self) -> bool:
        """Its terms do not cancel, and are neither so large nor so small that it can be an error."""
        return abs(self.value) > ROUGH * self.size and LOCATED < self.size < _MODERATE

    @property
    def vanishes(self) -> bool:
        """The terms cancel, or are round-off of derivatives of order one, or no larger than their error: it is 1e18 at 1e-9.

        Where a coefficient is round-off of large terms, or infinite, its sign changes without a zero.
        """
        small = abs(self.value) < APART * self.size + LOCATED
        return small or (self.size < _MODERATE and abs(self.value) <= self.error)


#: Where nothing is known: at the ends of curves, and where it is infinite.
UNKNOWN = Coefficient(math.nan, math.nan, lambda: math.nan)


#: That of a point where the equations are not smooth, and no normal form is known.
NOT_SMOOTH = Coefficient(math.nan, math.nan, lambda: math.nan)


class Direction(NamedTuple):
    """A direction at all places where the forms are evaluated, and the change of the period along it, as a part of that."""

    states: Numbers
    stretch: float = 0.0


class Form(ABC):
    """The characteristic matrix at a solution, L(P) for copies of the unknowns that a small matrix P couples, and the forms.

    - ``places`` (ndarray of int): Where the unknowns of one copy stand in x.
    - ``equations`` (int): Number of equations of one copy, which come first in F.
    - ``weights`` (ndarray): Of the unknowns of one copy.
    - ``doubled_side`` (int): Sign of the coefficient of a subcritical period doubling.
    - ``borders`` (pair of ndarray, optional): About the critical null vectors, where these are known.
    """

    places: Indices
    equations: int
    weights: Array
    doubled_side = 1
    borders: Borders | None = None
    _critical: tuple[complex, tuple[Any, Direction]] | None = None

    @property
    def reduced(self) -> Form:
        """The same without the multiplier that is 1 along every autonomous cycle."""
        return self

    @abstractmethod
    def solver(self, coupling: complex | Numbers, border: Borders | None = None) -> Solves:
        """Return the solver of L(P), bordered in each copy where a border is given: [copies | columns of all copies]."""

    @abstractmethod
    def coupled_parts(self, left: Numbers, right: Numbers) -> tuple[Numbers, Numbers]:
        """Return the parts of w and v (..., unknowns) whose product is w.E v, where L(P) depends on P by -P E."""

    def coupled(self, left: Numbers, right: Numbers) -> Any:
        """Return w.E v."""
        one, other = self.coupled_parts(left, right)
        return (one * other).sum(axis=-1)

    def coupled_gradient(self, left: Array, right: Array) -> Array | float:
        """Return the derivatives of the sum of w.E v over the copies by x, shape (size,); 0 where E is constant."""
        return 0.0

    @abstractmethod
    def coupling(self, rate: complex) -> Any:
        """Return the number P of perturbations with this rate."""

    @abstractmethod
    def unit(self, rate: complex) -> complex:
        """Return what the coefficient is multiplied by."""

    @abstractmethod
    def normalized(self, left: Numbers, right: Numbers) -> tuple[Any, Direction]:
        """Return w and v from null vectors, with v of unit length, w.v = 1, and at folds v across the solution itself."""

    @abstractmethod
    def solve(self, rate: complex, values: Numbers) -> Direction:
        """Return the h with L h = values, which are given where the forms are evaluated."""

    @abstractmethod
    def along(self, *directions: object) -> Any:
        """Return B or C along real or complex directions."""

    @abstractmethod
    def product(self, left: Numbers, values: Numbers) -> complex:
        """Return w.values."""

    def along_time(self, states: Numbers) -> Any:
        """Return J v: what B(v, h) grows by with the stretch of h."""
        return np.zeros_like(states)

    def critical(self, rate: complex) -> tuple[Any, Direction]:
        """Return the null vectors w and v of L(rate), found once."""
        if self._critical is not None and self._critical[0] == rate:
            return self._critical[1]
        coupling, size = self.coupling(rate), len(self.places)

        def bordered(b: Array, c: Array) -> Bordered:
            return Bordered(self.solver(coupling, (b, c)), (self.equations, size))

        found, _ = null_vectors(bordered, (self.equations, size), self.borders)
        self._critical = rate, self.normalized(found.left[0], found.right[0])
        return self._critical[1]


class DenseForm(Form):
    """One whose matrix is open - P E, with E one where ``places`` of the last equations meet those of the first unknowns.

    - ``matrix`` (ndarray, shape (size, size)): ``open``.
    - ``count`` (int): Number of rows of E that are not zero.
    - ``along`` (callable): ``along(stacks)`` returns B or C along several stacks of real directions.
    - ``weights`` (ndarray, shape (size,))
    """

    def __init__(self, matrix: Array, count: int, along: Callable[[Any], Array], weights: Array) -> None:
        size = self.equations = len(matrix)
        self._open, self._along, self._count, self.weights, self.places = matrix, along, count, weights, np.arange(size)

    def solver(self, coupling: complex | Numbers, border: Borders | None = None) -> DenseFactors:
        """Return LU factors of L(P)."""
        small, size, n = np.array(coupling, ndmin=2), self.equations, self._count
        copies, rows, columns = len(small), np.arange(size - n, size), np.arange(n)
        matrix: Any = np.zeros([copies * (size + (border is not None))] * 2, small.dtype)
        for i, j in itertools.product(range(copies), repeat=2):
            block = matrix[i * size : (i + 1) * size, j * size : (j + 1) * size]
            if i == j:
                block[:] = self._open
            block[rows, columns] -= small[i, j]
        if border is not None:
            for i, last in enumerate(range(copies * size, len(matrix))):
                matrix[i * size : (i + 1) * size, last], matrix[last, i * size : (i + 1) * size] = border
        return DenseFactors(matrix)

    def coupling(self, rate: complex) -> Any:
        """Return the rate itself."""
        return rate if rate.imag else rate.real

    def unit(self, rate: complex) -> complex:
        """Return one over the frequency."""
        return 1j / rate

    def coupled_parts(self, left: Numbers, right: Numbers) -> tuple[Numbers, Numbers]:
        """Return the last equations of w and the first unknowns of v."""
        return left[..., self.equations - self._count :], right[..., : self._count]

    def solve(self, rate: complex, values: Numbers) -> Direction:
        """Return the h with -L h = values."""
        coupling, right = self.coupling(rate), cast(Array, -values)
        return Direction(self.solver(np.asarray(coupling, np.result_type(coupling, values))).solve(right))

    def along(self, *directions: object) -> Any:
        return of_complex(self._along, directions)

    def product(self, left: Numbers, values: Numbers) -> complex:
        return complex(left @ values)

    def normalized(self, left: Numbers, right: Numbers) -> tuple[Any, Direction]:
        """Return w and v, with v of unit length in the first unknowns, and `oriented`."""
        v = oriented(right / self.length(right))
        return left / self.coupled(left, v), Direction(v)

    def length(self, right: Numbers) -> float:
        """Return the length of v."""
        return float(np.linalg.norm(right[: self._count]))


def fold(form: Form) -> Numbers:
    """Return the terms of b."""
    form = form.reduced
    w, (v, stretch) = form.critical(0.0)
    return _terms(form, 0.0, w, (form.along(v, v), 2 * stretch * form.along_time(v)), 2)


def flip(form: Form) -> Numbers:
    """Return the terms of c."""
    w, (v, _) = form.critical(1j * math.pi)
    h, stretch = form.reduced.solve(0.0, form.along(v, v))
    return _terms(form, 0.0, w, (form.along(v, v, v), 3 * form.along(v, h), 3 * stretch * form.along_time(v)), 6)


def pair(form: Form, frequency: float) -> Numbers:
    """Return the terms of d."""
    rate = 1j * frequency
    w, (v, _) = form.critical(rate)
    h, stretch = form.reduced.solve(0.0, form.along(v, v.conj()).real)
    k, _ = form.solve(2 * rate, form.along(v, v))
    terms = form.along(v, v, v.conj()), 2 * form.along(v, h), form.along(v.conj(), k)
    return _terms(form, rate, w, (*terms, 2 * stretch * (form.along_time(v) - rate * v)), 2)


def _terms(form: Form, rate: complex, w: Numbers, terms: tuple[Any, ...], factor: int) -> Numbers:
    return np.array([form.unit(rate) * form.product(w, term) for term in terms]) / factor


def coefficient(
    system: System, x: Array, terms: Callable[..., Numbers], *frequency: float, here: Form | None = None
) -> Coefficient:
    """Return the coefficient that `fold`, `flip` or `pair` has the terms of, at a solution x; NaN where it is infinite.

    ``here`` is the form at x, if that is at hand. It is not known where a solution crosses jumps or frozen corners.
    """
    if system.outcomes.size:
        return UNKNOWN

    def there(point: Array) -> Numbers:
        with np.errstate(all="ignore"):
            return terms(here if point is x else system.form(point), *frequency)

    here = here or system.form(x)
    found = Coefficient.of(there, x, system)
    if terms is fold:
        return dataclasses.replace(found, value=abs(found.value))
    return dataclasses.replace(found, side=here.doubled_side) if terms is flip else found


def at_special_point(system: System, point: SpecialPoint, here: Form | None = None) -> Coefficient | None:
    """Return the coefficient at a fold, or where one multiplier or pair is critical; None at other special points.

    ``here`` is the form there, if that is at hand.
    """
    terms = None if point.test is None or system.outcomes.size else point.test.normal_form
    if terms is fold:
        return coefficient(system, point.trial.x, fold) if point.details is None and point.is_located else None
    if terms is None or not point.is_simple:
        return None
    return coefficient(system, point.trial.x, terms, *([point.details["frequency"]] if terms is pair else []), here=here)
