"""Branches of equilibria: their test functions, Hopf points and folds, and the first Lyapunov coefficient.

The characteristic matrix A - lambda of an equilibrium, and its forms: the first Lyapunov coefficient is Re d / omega.

With A the Jacobian of the field, perturbations are v exp(lambda t), and B and C the derivatives of second and third order, with
|q| = 1 of the critical eigenvector (`contin.events.normal_forms`; Kuznetsov, section 5.4).
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any, NamedTuple

import numpy as np

from contin.arrays import Array, ComplexArray, Numbers
from contin.core.labels import Label
from contin.core.trial import Event, Trial
from contin.defining.critical import HopfCurve, other_pairs
from contin.equilibria.dependence import dependence
from contin.equilibria.equations import AlgebraicEquations
from contin.events.arc import SpecialPoint
from contin.events.hopf import hopf
from contin.events.labelled import frequency_of
from contin.events.normal_forms import Coefficient, DenseForm, at_special_point, fold
from contin.functions.batch import Batch
from contin.linalg.matrices import eigenvalues


class EquilibriumForm(DenseForm):
    """That of an equilibrium, in unknowns divided by their sizes.

    Parameters
    ----------
    jacobian : ndarray, shape (n, n)
        In the user's units.
    sizes : ndarray, shape (n,)
    along : callable
        As in `DenseForm`.
    """

    def __init__(self, jacobian: Array, sizes: Array, along: Callable[[Any], Array]) -> None:
        super().__init__(jacobian * sizes / sizes[:, None], len(jacobian), along, np.ones(len(jacobian)))
        self._sizes = sizes

    def coupling(self, rate: complex) -> Any:
        """Return the rate itself."""
        return rate if rate.imag else rate.real

    def unit(self, rate: complex) -> complex:
        """Return one over the frequency."""
        return 1j / rate

    def length(self, right: Numbers) -> float:
        """Return the length of v in the user's units."""
        return float(np.linalg.norm(right * self._sizes))


def form_of(system: AlgebraicEquations, x: Array) -> EquilibriumForm:
    """Return the characteristic matrix and the forms at an equilibrium."""
    field = system.as_field()
    return EquilibriumForm(system.jacobian(x), system.scales.states, lambda stacks: field.stack_along(x, stacks))


class CriticalPair(NamedTuple):
    """A pair of eigenvalues -+ i omega: its frequency, and the right and left eigenvector, |q| = 1 and w.q = 1.

    ``off`` is |A q - i omega q|, relative to omega.
    """

    frequency: float
    right: ComplexArray
    left: ComplexArray
    off: float

    @property
    def is_critical(self) -> bool:
        """The pair belongs to the matrix: not so at Hopf points of a kind whose stability is not that of its Jacobian."""
        return self.off < _CRITICAL


#: Largest distance of a critical eigenvalue from i omega, relative to omega: Hopf points are located to 1e-9. Where it is ten
#: times larger, a kind of problem with another stability is taken for a field if an eigenvalue lies so near by chance.
_CRITICAL = 1e-4


def has_pair(jacobian: Array, frequency: float) -> bool:
    """Return whether a matrix has the eigenvalue i ``frequency``, as at a Hopf point."""
    return bool(np.abs(eigenvalues(jacobian) - 1j * frequency).min() < _CRITICAL * abs(frequency))


def critical_pair(jacobian: Array, frequency: float | None = None) -> CriticalPair:
    """Return the pair of eigenvalues that is nearest to -+ i ``frequency``.

    Without a frequency, it is the complex pair nearest to the imaginary axis.
    """
    if frequency is None:
        values = np.linalg.eigvals(jacobian)
        frequency = float(values[np.argmin(np.where(values.imag > 0, np.abs(values.real), np.inf))].imag)
    with np.errstate(all="ignore"):
        left, (right, _) = EquilibriumForm(jacobian, np.ones(len(jacobian)), lambda _: jacobian).critical(1j * frequency)
        off = np.linalg.norm(jacobian @ right - 1j * frequency * right) / abs(frequency)
        return CriticalPair(frequency, np.asarray(right, complex), np.asarray(left, complex), float(off))


#: The kind of curves of homoclinic orbits, which leave from the first.
HOMOCLINIC = "homoclinic"


def events_on_folds() -> list[Event]:
    """Return those of a second eigenvalue zero (Bogdanov-Takens), and of a pair on the imaginary axis (zero-Hopf)."""

    def double_zero(trial: Trial) -> float:
        system: Any = trial.system
        v, w = system.null_vectors(trial.x)
        base, scales = system.base, system.base.scales
        v, w = v[: base.state_size] * scales.states, w / scales.rows["residual"]
        return float(w @ v) / float(np.linalg.norm(v) * np.linalg.norm(w))

    def others(trial: Trial) -> tuple[float, bool]:
        system: Any = trial.system
        values = system.base.eigenvalues(trial.x)
        return other_pairs(np.delete(values, np.argmin(np.abs(values))))

    return [
        Event(Label.BOGDANOV_TAKENS, "Bogdanov-Takens", double_zero),
        Event(Label.ZERO_HOPF, "zero-Hopf", lambda trial: others(trial)[0], confirm=lambda trial: others(trial)[1]),
    ]


class Algebraic(AlgebraicEquations):
    """An algebraic problem with chosen free parameters, as the continuation sees it.

    Unknowns ``x`` are the states, then the free parameters. The interface is that of
    `contin.lowlevel.Collocation`; there is no mesh to adapt.

    Raises
    ------
    ProblemError
        An unknown parameter.

    Examples
    --------
    >>> from contin import AlgebraicProblem
    >>> system = Algebraic(AlgebraicProblem(lambda u, p: (p.a - u.x**2,), ["x"], {"a": 1.0}), ["a"])
    >>> system.size, system.residual(np.array([2.0, 1.0])).tolist()  # x = 2, a = 1
    (2, [-3.0])
    """

    #: Kinds of curves in two parameters that begin at, or pass, points of codimension two.
    leaving = {
        Label.BOGDANOV_TAKENS: (Label.FOLD, Label.HOPF, HOMOCLINIC),
        Label.GENERALIZED_HOPF: (Label.FOLD,),
        Label.ZERO_HOPF: (Label.FOLD, Label.HOPF, Label.TORUS),
        Label.DOUBLE_HOPF: (Label.HOPF, Label.TORUS),
    }

    def events(self) -> list[Event]:
        """Return the test function of Hopf points, where the states move in time."""
        return [hopf()] if self.problem.dynamics and self.state_size > 1 else []

    @property
    def small_equations(self) -> Batch | None:
        """The residual; None of kinds that are made of this one, whose equations may be others, and with a given Jacobian."""
        known: Batch = self._residual
        return known if type(self) is Algebraic and self.problem.jacobian is None else None

    @property
    def starts_cycles(self) -> bool:
        """Where the states move in time."""
        return bool(self.problem.dynamics)

    @property
    def stored(self) -> dict[str, Array]:
        """Parameters and sizes."""
        return self._own_arrays

    def unstable(self, x: Array) -> int | None:
        """Return the number of unstable eigenvalues; None of large problems, and where nothing moves in time."""
        return None if self.is_sparse or not self.problem.dynamics else int(np.count_nonzero(self.eigenvalues(x).real > 0))

    def undetermined(self, x: Array) -> str:
        """Return which equations are dependent."""
        return dependence(self, x)

    def check_solution(self, x: Array) -> None:
        """Check that totals which were found to be conserved are so at a solution, too."""
        self.problem.check_totals(self.states(x)[0], self.all_parameters(x))

    @property
    def curves(self) -> Mapping[str, type]:
        """That of Hopf points."""
        return {HopfCurve.kind: HopfCurve}

    def defining(self, point: Any, x: Array) -> tuple[HopfCurve, Array] | None:
        """Return that of Hopf points."""
        if point.label != HopfCurve.kind:
            return None
        pair = critical_pair(self.jacobian(x), frequency_of(point))
        return (HopfCurve(self.as_field(), size=pair.frequency**2), np.append(x, 1.0)) if pair.is_critical else None

    def events_on_folds(self) -> list[Event]:
        """Return those of a second eigenvalue zero, or a pair on the imaginary axis."""
        return events_on_folds() if self.problem.dynamics else []

    def form(self, x: Array) -> DenseForm:
        """Return that of an equilibrium."""
        return form_of(self, x)

    def coefficient(self, point: SpecialPoint) -> Coefficient | None:
        """Return the first Lyapunov coefficient at a Hopf point; of folds, which take .3 ms, nothing."""
        if point.test is None or point.test.normal_form is fold:
            return None
        frequency = frequency_of(point)
        is_of_the_field = frequency is None or has_pair(self.jacobian(point.trial.x), frequency)
        return at_special_point(self, point) if is_of_the_field else None
