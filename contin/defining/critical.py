"""Curves along which a pair of eigenvalues, or a multiplier other than one, stays critical: Hopf points, doublings and tori.

The characteristic matrix L(P) (`contin.events.normal_forms`) is singular where an eigenvalue of the small matrix P is critical:
P is a number where that is real, and else couples two copies of the unknowns. With real borders and v = v_1 + i r v_2, r the
imaginary part of the eigenvalue, P contains the pair through one real number ``kappa`` (omega^2 at Hopf points, the cosine of
the angle at torus bifurcations):

                                 v_1        v_2
                              [ L_11       L_12      b     ]  [ v_1 ]   [ 0 ]
                              [ L_21       L_22         b  ]  [ v_2 ]   [ 0 ]
                              [  c                         ]  [ g_1 ] = [ 1 ]
                              [             c              ]  [ g_2 ]   [ 0 ]

They stay regular where r passes zero and the pair becomes real (Bogdanov-Takens points, strong resonances). A curve has the
unknowns [x | kappa] and the equations F = 0, g = 0. The gradient of g_i is -w_i.(dL v), with w_i from the transposed matrix.

For a curve of Hopf points, of equilibria and of fields, with A the Jacobian and v = v_1 + i omega v_2, the equations A v = i
omega v are A v_1 = -kappa v_2 and A v_2 = v_1: kappa is omega^2, and

                                                        [ 0   -kappa ]
                                                    P = [            ].
                                                        [ 1      0   ]

They are regular at a Bogdanov-Takens point, where omega vanishes. Beyond it kappa is negative, and two real eigenvalues are
opposite (a neutral saddle, no bifurcation).
"""

from __future__ import annotations

import math
from abc import abstractmethod
from collections.abc import Callable
from typing import Any, TypeVar, cast

import numpy as np

from contin.arrays import Array, ComplexArray, Numbers
from contin.core.labels import Label
from contin.core.spectral import Spectral
from contin.core.trial import Event, Trial
from contin.defining.system import Defining
from contin.events.normal_forms import UNKNOWN, Coefficient, Form, coefficient, pair
from contin.levels import APART, DEPENDENT, ROUGH
from contin.linalg.border import Bordered, null_vectors


class CriticalCurve(Defining):
    """F = 0 and g = 0, in the free parameters of ``base``: the last one is the second parameter of the curve.

    - ``base`` (System): With one free parameter more than a curve of solutions needs.
    - ``size`` (float): Of kappa, by which it is divided in x.
    """

    #: That of the coefficient of the normal form, and others.
    own_columns: tuple[str, ...] = ("normal_form",)

    def kappa(self, x: Array) -> float:
        """Return the real number through which the equations contain the complex pair; 0 where there is none."""
        return float(x[-1]) * self.kappa_size if self.own_unknowns else 0.0

    # --- what the kinds of curves state ----------------------------------------------------------------------------------

    @abstractmethod
    def coupling(self, kappa: float) -> Array:
        """Return P, shape (copies, copies)."""

    def imaginary_part(self, x: Array) -> float:
        """Return r; 0 where the pair, or the one multiplier, is real."""
        return 0.0

    @abstractmethod
    def frequency(self, x: Array) -> float:
        """Return the imaginary part of the critical eigenvalue, or of the logarithm of the critical multiplier."""

    def coupling_slope(self, kappa: float) -> Array:
        """Return dP/dkappa; nothing where there is no kappa."""
        return np.empty((0, 1))

    @abstractmethod
    def normal_form(self, x: Array) -> Coefficient:
        """Return the coefficient of the normal form; unknown at the ends of the curve."""

    def on_its_branch(self, x: Array) -> tuple[str, dict[str, float]]:
        """Return the label of the point on its branch, and the frequency of the critical pair."""
        return self.kind, {"frequency": self.frequency(x)}

    # --- null vectors ----------------------------------------------------------------------------------------------------

    def computed(self, x: Array) -> tuple[Form, Bordered]:
        """Return the characteristic matrix, and it bordered without the multiplier that is one along every autonomous cycle."""
        whole, copies, coupling = self.base.form(self.inside(x)), self.own_equations, self.coupling(self.kappa(x))
        form = whole.reduced
        shape = form.equations, len(form.places)

        def bordered(b: Array, c: Array) -> Bordered:
            return Bordered(form.solver(coupling, (b, c)), (copies * shape[0], copies * shape[1]), copies, copies)

        found, self.borders = null_vectors(bordered, shape, self.borders, form.weights, lambda found: self._single(x, found))
        whole.borders = self.borders[0][: whole.equations], self.borders[1][: len(whole.places)]
        return whole, found

    def null_vectors(self, x: Array) -> tuple[Array, Array]:
        """Return v (copies, m), and w_i of each g_i, (copies, copies, n)."""
        return self._by_copies(self.at(x)[1])

    def _by_copies(self, found: Bordered) -> tuple[Array, Array]:
        copies = self.own_equations
        return found.right[0].reshape(copies, -1), found.left.reshape(copies, copies, -1)

    def _single(self, x: Array, found: Bordered) -> tuple[Any, Any]:
        """Return the left and the right null vector of one copy; where the pair is almost real, their real parts."""
        (right, left), r = self._by_copies(found), self.imaginary_part(x)
        if r > ROUGH * math.sqrt(self.kappa_size):
            return left[0, 0] + 1j / r * left[0, 1], right[0] + 1j * r * right[1]
        return left[0, 0], right[0]

    # --- the equations ---------------------------------------------------------------------------------------------------

    def own_values(self, x: Array) -> Array:
        """Return g."""
        return self.at(x)[1].g[0]

    def own_gradients(self, x: Array) -> Array:
        """Return dg/dx."""
        (right, left), base = self.null_vectors(x), self.base
        form, result = self.at(x)[0].reduced, np.zeros((self.own_equations, self.size))
        vs, ws = np.zeros((len(right), base.size)), np.zeros((*left.shape[:2], base.equations))
        vs[:, form.places], ws[..., : form.equations] = right, left
        for row, copies in zip(result, ws):
            for v, w in zip(vs, copies):
                row[: base.size] -= base.bent(self.inside(x), w, v)
        if self.own_unknowns:
            changed, coupled = self.coupling_slope(self.kappa(x)) @ right, self.coupling(self.kappa(x)) @ right
            for row, copies in zip(result, left):
                row[: base.size] += form.coupled_gradient(copies, coupled)
            result[:, -1] = [form.coupled(copies, changed).sum() * self.kappa_size for copies in left]
        return result

    def functionals(self, x: Array) -> Array:
        """Return those of the underlying problem, and the coefficient of the normal form."""
        return np.append(super().functionals(x), self.coefficient_at(x).value)

    def of(self, terms: Callable[..., Numbers], x: Array, *frequency: float) -> Coefficient:
        """Return the coefficient that ``terms`` belong to, from the characteristic matrix that is at hand."""
        return coefficient(self.base, self.inside(x), terms, *frequency, here=self.at(x)[0])

    def coefficient_at(self, x: Array) -> Coefficient:
        """Return `normal_form`, computed once."""
        return self.once(self.normal_form, x)


def degenerate(label: str, name: str) -> Event:
    """Return the test function of points where the coefficient of the normal form is zero."""

    def coefficient(trial: Trial) -> Coefficient:
        return cast(CriticalCurve, trial.system).coefficient_at(trial.x)

    def signed(trial: Trial) -> float:
        return coefficient(trial).signed(trial.newton_error)

    return Event(label, name, signed, confirm=lambda trial: coefficient(trial).vanishes)


def signed_smallest(factors: ComplexArray) -> float:
    """Return the smallest absolute value of some numbers, with the sign of the product of all: it would underflow.

    Complex ones stand there with their conjugates.
    """
    signs = np.sign(factors.real[factors.imag == 0])
    return float(np.abs(factors).min(initial=1.0) * np.prod(signs))


def other_pairs(values: ComplexArray) -> tuple[float, bool]:
    """Return a number that vanishes where two of the eigenvalues have the sum zero, and whether these are a complex pair."""
    i, j = np.triu_indices(len(values), 1)
    on_axis = (np.abs(values.real) < APART * np.abs(values)) & (values.imag > 0)
    return signed_smallest(values[i] + values[j]), bool(on_axis.any())


T = TypeVar("T")


class HopfCurve(CriticalCurve):
    """Hopf points of a `Fields` system, or of an `Algebraic` one made by `as_field`.

    Columns ``frequency`` and ``lyapunov`` (l1).
    """

    kind = Label.HOPF
    own_equations, own_unknowns = 2, 1
    own_columns = ("frequency", "lyapunov")

    def coupling(self, kappa: float) -> Array:
        """Return the real matrix with the eigenvalues -+ i omega."""
        return np.array([[0.0, -kappa], [1.0, 0.0]])

    def coupling_slope(self, kappa: float) -> Array:
        """Return its derivative."""
        return np.array([[0.0, -1.0], [0.0, 0.0]])

    def imaginary_part(self, x: Array) -> float:
        """Return the frequency."""
        return self.frequency(x)

    def frequency(self, x: Array) -> float:
        """Return the frequency; 0 at a neutral saddle and where it is not known from 0, as at a Bogdanov-Takens point."""
        kappa = self.kappa(x)
        return math.sqrt(kappa) if kappa > DEPENDENT * self.kappa_size else 0.0

    def normal_form(self, x: Array) -> Coefficient:
        """Return the first Lyapunov coefficient; NaN at Bogdanov-Takens points and neutral saddles."""
        frequency = self.frequency(x)
        return self.of(pair, x, frequency) if frequency else UNKNOWN

    def functionals(self, x: Array) -> Array:
        """Return those of the underlying problem, the frequency, and the first Lyapunov coefficient."""
        *known, lyapunov = super().functionals(x)
        return np.array([*known, self.imaginary_part(x), lyapunov])

    def others(self, x: Array) -> ComplexArray:
        """Return the eigenvalues but the two that are critical, times -1: not all stable ones of a field are known."""
        values = cast(Spectral, self.base).computed_eigenvalues(self.inside(x))
        return -values[np.argsort(np.abs(values**2 + self.kappa(x)))[2:]]

    def events(self) -> list[Event]:
        """Return those of Bogdanov-Takens, generalized Hopf (Bautin), zero-Hopf (fold-Hopf) and double Hopf points."""

        def of_curve(function: Callable[[HopfCurve, Array], T]) -> Callable[[Trial], T]:
            return lambda trial: function(cast(HopfCurve, trial.system), trial.x)

        found = [
            Event(Label.BOGDANOV_TAKENS, "Bogdanov-Takens", of_curve(HopfCurve.kappa), terminal=True),
            degenerate(Label.GENERALIZED_HOPF, "generalized Hopf"),
        ]
        if self.base.state_size > 2:
            found += [
                Event(Label.ZERO_HOPF, "zero-Hopf", of_curve(lambda curve, x: signed_smallest(curve.others(x)))),
                Event(Label.DOUBLE_HOPF, "double Hopf", of_curve(lambda curve, x: other_pairs(curve.others(x))[0]),
                      confirm=of_curve(lambda curve, x: other_pairs(curve.others(x))[1])),
            ]  # fmt: skip
        return found
