"""Extended systems of curves along which a pair of eigenvalues, or a multiplier other than one, is critical.

The linearized problem has the eigenvalue lambda where L v = 0 has a solution, with lambda in the equations of L. As for folds
(`contin.defining.fold_curve`) a column b and a row c make the matrix regular, and a number g vanishes exactly where lambda is
an eigenvalue. A complex pair makes g complex. With real borders v = v_1 + i r v_2 and g = g_1 + i r g_2, where r is the
imaginary part of lambda, and real equations for the four of them contain lambda through one real number, ``kappa`` (omega^2 at
Hopf points, the cosine of the angle at torus bifurcations):

                                 v_1        v_2
                              [ L_11       L_12      b     ]  [ v_1 ]   [ 0 ]
                              [ L_21       L_22         b  ]  [ v_2 ]   [ 0 ]
                              [  c                         ]  [ g_1 ] = [ 1 ]
                              [             c              ]  [ g_2 ]   [ 0 ]

They stay regular where r passes zero and the pair becomes real (Bogdanov-Takens points, strong resonances). A curve has the
unknowns [x | kappa] and the equations F = 0, g = 0. Where the critical multiplier is real, there is one copy of L and no
kappa. The gradient of g_i is -w_i.(dL v), with w_i from the transposed matrix.
"""

from __future__ import annotations

import math
from abc import abstractmethod
from collections.abc import Callable, Sequence
from typing import NamedTuple

import numpy as np

from contin.arrays import Array, ComplexArray
from contin.core.system import System
from contin.defining.extended import Borders, Extended, cosine
from contin.linalg.factors import Factors

#: Rounds that make borders, as in `contin.defining.fold_curve`.
_ROUNDS = 3
#: Cosine between a border and the complex vector that it stands for, below which it is renewed: it is .7 at least when it is
#: made, and 0 where the bordered matrix is singular. Ten times smaller, the curves of the tests are the same.
_FITS = 0.5
#: The imaginary parts of null vectors count where that of the eigenvalue is larger than this; they vanish with it, and are
#: divided by it. Ten times larger or smaller, the curves of the tests are the same.
_ALMOST_REAL = 1e-2


class NullVectors(NamedTuple):
    """Solutions with the bordered matrix: v (copies, m), g (copies,), and w_i of each g_i, (copies, copies, m)."""

    right: Array
    g: Array
    left: Array


class CriticalCurve(Extended):
    """F = 0 and g = 0, in the free parameters of ``base``: the last one is the second parameter of the curve.

    Parameters
    ----------
    base : System
        With one free parameter more than a curve of solutions needs.
    borders : pair of ndarray, optional
        b and c, of the equations and unknowns of one copy of L.
    size : float
        Of kappa, by which it is divided in x.
    columns : sequence of str
        Names of columns of the curve, beyond those of ``base``.
    """

    copies: int

    def __init__(self, base: System, borders: Borders | None = None, size: float = 1.0, columns: Sequence[str] = ()) -> None:
        super().__init__(base, borders, columns)
        extra = self.copies - 1
        self.size, self.equations, self.kappa_size = base.size + extra, base.equations + self.copies, size
        self.weights = np.append(base.weights, np.ones(extra))
        self._known: tuple[bytes, NullVectors] | None = None

    @classmethod
    def of_size(cls, base: System, size: float) -> CriticalCurve:
        """Return the extended system with this size of kappa."""
        return cls(base, None, size)

    def on(self, base: System) -> CriticalCurve:
        """Return the extended system of another underlying one, with borders of its own."""
        return type(self)(base, None, self.kappa_size)

    def kappa(self, x: Array) -> float:
        """Return the real number through which the equations contain the complex pair; 0 where there is none."""
        return float(x[-1]) * self.kappa_size if self.copies == 2 else 0.0

    # --- what the kinds of curves state --------------------------------------------------------------------------

    @abstractmethod
    def bordered(self, x: Array, b: Array, c: Array) -> tuple[Callable[[Array], Array], Callable[[Array], Array]]:
        """Return functions that solve with the bordered matrix and with its transpose."""

    @abstractmethod
    def imaginary_part(self, x: Array) -> float:
        """Return r; 0 where the pair is real."""

    @abstractmethod
    def by_kappa(self, x: Array, right: Array, left: Array) -> Array:
        """Return w.(dL/dkappa) v, of several w (copies, copies, m) and one v (copies, m); shape (copies,)."""

    @property
    @abstractmethod
    def copy_shape(self) -> tuple[int, Array]:
        """Number of equations of one copy of L, and the weights of its unknowns, which come first in x (m,)."""

    # --- null vectors --------------------------------------------------------------------------------------------

    def null_vectors(self, x: Array) -> NullVectors:
        """Return v, g and w; borders are made, or renewed, where they do not fit."""
        key = x.tobytes()
        if self._known is not None and self._known[0] == key:
            return self._known[1]
        equations, weights = self.copy_shape
        if self.borders is None:
            random = np.random.default_rng(11)
            self.borders = random.standard_normal(equations), random.standard_normal(len(weights))
        found = self._solved(x)
        for _ in range(_ROUNDS):
            v, w = self.complex_vectors(x, found)
            if self._fit(v, w):
                break
            self.borders = _largest_part(w), _largest_part(v) * weights
            found = self._solved(x)
        self._known = key, found
        return found

    def _fit(self, v: ComplexArray, w: ComplexArray) -> bool:
        """Return whether the borders are close to the null vectors, or these are not finite."""
        (b, c), root = self.borders, np.sqrt(self.copy_shape[1])
        return not min(cosine(c / root, v * root), cosine(b, w)) < _FITS

    def _solved(self, x: Array) -> NullVectors:
        (equations, weights), copies = self.copy_shape, self.copies
        solve, solve_transposed = self.bordered(x, *self.borders)
        unit = np.zeros(copies * (equations + 1))
        unit[copies * equations] = 1.0
        solution = solve(unit)
        lefts = []
        for i in range(copies):
            row = np.zeros(copies * (len(weights) + 1))
            row[copies * len(weights) + i] = 1.0
            lefts.append(solve_transposed(row)[: copies * equations].reshape(copies, equations))
        inside = copies * len(weights)
        return NullVectors(solution[:inside].reshape(copies, -1), solution[inside:], np.array(lefts))

    def complex_vectors(self, x: Array, found: NullVectors) -> tuple[ComplexArray, ComplexArray]:
        """Return the right and the left null vector of one copy; where the pair is almost real, their real parts."""
        v, w = found.right[0].astype(complex), found.left[0, 0].astype(complex)
        r = self.imaginary_part(x)
        if r > _ALMOST_REAL * math.sqrt(self.kappa_size):
            v, w = v + 1j * r * found.right[1], w + 1j / r * found.left[0, 1]
        return v, w

    def borders_fit(self, x: Array) -> bool:
        """Return True: borders are renewed where they do not fit."""
        return True

    # --- the equations -------------------------------------------------------------------------------------------

    def residual(self, x: Array) -> Array:
        """Return F and g."""
        return np.append(self.base.residual(x[: self.base.size]), self.null_vectors(x).g)

    def gradients(self, x: Array) -> Array:
        """Return dg/dx, shape (copies, size)."""
        right, _, left = self.null_vectors(x)
        base, y = self.base, x[: self.base.size]
        result = np.zeros((self.copies, self.size))
        for copy, v in enumerate(right):
            wide = np.zeros(base.size)
            self._place(wide, v)
            for i in range(self.copies):
                w = np.zeros(base.equations)
                w[: len(left[i, copy])] = left[i, copy]
                result[i, : base.size] -= base.bent(y, w, wide)
        if self.copies == 2:
            result[:, -1] = -self.by_kappa(x, right, left) * self.kappa_size
        return result

    def _place(self, wide: Array, v: Array) -> None:
        """Put the unknowns of one copy of L to their places in x."""
        wide[: len(v)] = v

    def linearize(
        self, x: Array, rows: Sequence[Array] | Array = (), columns: Sequence[Array] | Array = ()
    ) -> tuple[Array, Factors]:
        """Return F and g, and the factored bordered matrix; the gradients of g come first among the border rows."""
        copies = self.copies
        rows, columns = self.shaped(rows, columns)
        top = np.hstack([self.gradients(x), columns[:, -copies:].T])
        of_kappa = np.zeros((copies - 1, self.base.equations))  # F does not depend on it
        inside = np.vstack([of_kappa, columns[:, :-copies]])
        residual, factors = self.base.linearize(x[: self.base.size], np.vstack([top, rows]), inside)
        return np.append(residual, self.null_vectors(x).g), factors


def signed_smallest(factors: ComplexArray) -> float:
    """Return the smallest absolute value of some numbers, with the sign of the product of all: it would underflow.

    Complex ones stand there with their conjugates.
    """
    signs = np.sign(factors.real[factors.imag == 0])
    return float(np.abs(factors).min(initial=1.0) * np.prod(signs))


def other_pairs(values: ComplexArray) -> tuple[float, bool]:
    """Return a number that vanishes where two of the eigenvalues have the sum zero, and whether these are a complex pair."""
    i, j = np.triu_indices(len(values), 1)
    on_axis = (np.abs(values.real) < _ON_AXIS * np.abs(values)) & (values.imag > 0)
    return signed_smallest(values[i] + values[j]), bool(on_axis.any())


#: An eigenvalue with a real part below this part of its size is on the axis: it is at a located zero of the product.
_ON_AXIS = 1e-5


def _largest_part(vector: ComplexArray) -> Array:
    """Return the real part, of unit length, of a complex vector turned so that it is as large as it can be."""
    turned = vector * np.exp(-0.5j * np.angle(vector @ vector))
    part: Array = turned.real
    return part / np.linalg.norm(part)
