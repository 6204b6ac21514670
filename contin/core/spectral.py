"""Eigenvalues of the linearization in time, and which lie on the imaginary axis or the unit circle up to round-off.

In a conservative system pairs stay there, and a second multiplier of cycles is one. Round-off moves them to either side. How
far is seen by rounding what they are computed from once more, up or down by chance: they change by their round-off.
"""

from __future__ import annotations

import math
from abc import abstractmethod
from collections.abc import Callable, Sequence
from typing import Any, NamedTuple

import numpy as np

from contin import draws
from contin.arrays import Array, ComplexArray, Mask
from contin.levels import APART, CERTAIN, CORRECTED, LOCATED


class Eigenvalues(NamedTuple):
    """Eigenvalues with their round-off, and what returns those of pairs on the axis up to round-off with the real part 0.

    ``settled`` is None where they are the same. It takes several spectra, and a zero of a real part is located without.
    """

    values: ComplexArray
    settled: Callable[[], ComplexArray] | None = None


class Spectral:
    """A system whose states move in time: a solution is steady, and perturbations of it grow as exp(z t), z its eigenvalues.

    This is what `contin.events.hopf` asks for; kinds say in `spectra` what the eigenvalues are.
    """

    #: `eigenvalue_near` takes less time than all eigenvalues that are wanted: a search then follows one by it.
    finds_nearest = False
    #: Those of `contin.core.system.System`.
    _known: Any
    _once: Any

    @abstractmethod
    def spectra(self, places: Sequence[Array]) -> list[Eigenvalues]:
        """Return the eigenvalues at places.

        This is the notion of stability of the kind of problem: whatever asks for eigenvalues asks this.
        """

    def eigenvalues(self, x: Array) -> ComplexArray:
        """Return the eigenvalues, complex.

        All of them or, of large problems, those right of the imaginary axis or near to it.
        """
        values, settled = self._spectrum(x)
        return values if settled is None else self._once("settled", x, settled)

    def computed_eigenvalues(self, x: Array) -> ComplexArray:
        """Return the eigenvalues with their round-off, where a zero of a real part is located."""
        return self._spectrum(x)[0]

    def eigenvalues_at(self, places: Sequence[Array]) -> list[ComplexArray]:
        """Return the eigenvalues at several places, found together."""
        new = [x for x in places if ("spectrum", x.tobytes()) not in self._known]
        for x, found in zip(new, self.spectra(new) if new else ()):
            self._once("spectrum", x, lambda: found)  # noqa: B023  called at once
        return [self.eigenvalues(x) for x in places]

    def crossing(self, x: Array, frequency: float) -> tuple[str, str] | None:
        """Return label and name of a point where a pair of eigenvalues with this frequency crosses the imaginary axis."""
        return "HB", "Hopf"

    def _spectrum(self, x: Array) -> Eigenvalues:
        """Return the eigenvalues, found once: the ends of a step and of its parts are asked for several times."""
        return self._once("spectrum", x, lambda: self.spectra([x])[0])


def changes(again: Callable[[Callable[[Array], Array]], ComplexArray], values: ComplexArray, full: float = math.inf) -> Array:
    """Return the largest change of each of some eigenvalues when what they are computed from is rounded, up or down.

    ``again(signs)`` computes them again; ``signs(array)`` are random signs of the shape of an array. Imaginary parts are alike
    up to multiples of ``full``.
    """

    def change(random: np.random.Generator) -> Array:
        gaps = values[:, None] - again(lambda array: draws.signs(random, array))
        imaginary = gaps.imag if full == math.inf else (gaps.imag + full / 2) % full - full / 2
        return np.hypot(gaps.real, imaginary).min(axis=1)

    return draws.spread("rounding", change)


def changes_of_multipliers(eigenvalues: Callable[[Array], ComplexArray], x: Array, values: ComplexArray) -> Array:
    """Return the largest change of the logarithms of multipliers at x when x is rounded."""
    return changes(lambda signs: eigenvalues(x + np.finfo(float).eps * (1 + np.abs(x)) * signs(x)), values, full=2 * math.pi)


def on_circle(eigenvalues: Callable[[Array], ComplexArray], x: Array, values: ComplexArray, expected: int = 0) -> Mask:
    """Return which multipliers lie on the unit circle, up to round-off, from their logarithms ``values`` at x.

    Where no more than ``expected`` come near it, these are not looked at.
    """
    near = np.abs(values.real) < APART
    if np.count_nonzero(near) <= expected:
        return np.zeros(len(values), dtype=bool)
    bound = np.full(len(values), CORRECTED)
    if np.any(near & (np.abs(values.real) > CORRECTED)):
        bound = np.maximum(bound, CERTAIN * changes_of_multipliers(eigenvalues, x, values))
    return near & (np.abs(values.real) <= bound)


def may_be_on_axis(values: ComplexArray) -> Mask:
    """Return which eigenvalues are complex and so near to the axis that round-off decides; of matrices, shape (..., n)."""
    sizes = np.abs(values).max(axis=-1, initial=0.0, keepdims=True)
    return (np.abs(values.real) < LOCATED * sizes) & (values.imag != 0) & (values.real != 0)


def off_axis(eigenvalues: Callable[[Array], ComplexArray], matrix: Array, values: ComplexArray) -> ComplexArray:
    """Return the eigenvalues ``values`` of a matrix, with the real part 0 for pairs on the axis up to round-off."""
    near = may_be_on_axis(values)
    if not near.any():
        return values
    error = changes(lambda signs: eigenvalues(matrix * (1 + np.finfo(float).eps * signs(matrix))), values)
    return np.where(near & (np.abs(values.real) <= CERTAIN * error), 1j * values.imag, values)
