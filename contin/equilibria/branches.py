"""Branches of equilibria: their test functions, Hopf points and folds, and the first Lyapunov coefficient.

The characteristic matrix A - lambda of an equilibrium, and its forms: the first Lyapunov coefficient is Re d / omega.

With A the Jacobian of the field, perturbations are v exp(lambda t), and B and C the derivatives of second and third order, with
|q| = 1 of the critical eigenvector (`contin.events.normal_forms`; Kuznetsov, section 5.4).
"""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from contin.arrays import Array, ComplexArray, Numbers
from contin.core.labels import Label
from contin.core.trial import Event, Trial
from contin.defining.critical import other_pairs
from contin.events.normal_forms import DenseForm
from contin.linalg.matrices import eigenvalues

if TYPE_CHECKING:
    from contin.equilibria.equations import Algebraic


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


def form_of(system: Algebraic, x: Array) -> EquilibriumForm:
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
        system = trial.system
        v, w = system.null_vectors(trial.x)
        base, scales = system.base, system.base.scales
        v, w = v[: base.state_size] * scales.states, w / scales.rows["residual"]
        return float(w @ v) / float(np.linalg.norm(v) * np.linalg.norm(w))

    def others(trial: Trial) -> tuple[float, bool]:
        values = trial.system.base.eigenvalues(trial.x)
        return other_pairs(np.delete(values, np.argmin(np.abs(values))))

    return [
        Event(Label.BOGDANOV_TAKENS, "Bogdanov-Takens", double_zero),
        Event(Label.ZERO_HOPF, "zero-Hopf", lambda trial: others(trial)[0], confirm=lambda trial: others(trial)[1]),
    ]
