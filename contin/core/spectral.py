"""Eigenvalues of the linearization in time, kept for the places that were asked for last."""

from __future__ import annotations

import functools
from abc import abstractmethod
from collections.abc import Sequence

from contin.arrays import Array, ComplexArray

#: Results at points, as sets of eigenvalues, that are kept: more than a search for Hopf points compares.
KEPT = 64


class Spectral:
    """A system whose states move in time: a solution is steady, and perturbations of it grow as exp(z t), z its eigenvalues.

    This is what `contin.events.hopf` asks for; kinds say in `spectra` what the eigenvalues are.
    """

    #: `eigenvalue_near` takes less time than all eigenvalues that are wanted: a search then follows one by it.
    finds_nearest = False

    @abstractmethod
    def spectra(self, places: Sequence[Array]) -> list[tuple[ComplexArray, ComplexArray]]:
        """Return the eigenvalues at places: those of pairs on the axis up to round-off with the real part 0, and as computed.

        This is the notion of stability of the kind of problem: whatever asks for eigenvalues asks this.
        """

    def eigenvalues(self, x: Array) -> ComplexArray:
        """Return the eigenvalues, complex.

        All of them or, of large problems, those right of the imaginary axis or near to it.
        """
        return self._eigenvalues(x)[0]

    def computed_eigenvalues(self, x: Array) -> ComplexArray:
        """Return the eigenvalues with their round-off, where a zero of a real part is located."""
        return self._eigenvalues(x)[1]

    def eigenvalues_at(self, places: Sequence[Array]) -> list[ComplexArray]:
        """Return the eigenvalues at several places, found together."""
        new = [x for x in places if x.tobytes() not in self._spectra_found]
        for x, found in zip(new, self.spectra(new) if new else ()):
            self._keep(x.tobytes(), found)
        return [self.eigenvalues(x) for x in places]

    def crossing(self, x: Array, frequency: float) -> tuple[str, str] | None:
        """Return label and name of a point where a pair of eigenvalues with this frequency crosses the imaginary axis."""
        return "HB", "Hopf"

    @functools.cached_property
    def _spectra_found(self) -> dict[bytes, tuple[ComplexArray, ComplexArray]]:
        return {}

    def _keep(self, key: bytes, found: tuple[ComplexArray, ComplexArray]) -> None:
        if len(self._spectra_found) > KEPT:
            del self._spectra_found[next(iter(self._spectra_found))]
        self._spectra_found[key] = found

    def _eigenvalues(self, x: Array) -> tuple[ComplexArray, ComplexArray]:
        """Return the eigenvalues, and as computed, once: the ends of a step and of its parts are asked for several times."""
        key = x.tobytes()
        if key not in self._spectra_found:
            self._keep(key, self.spectra([x])[0])
        return self._spectra_found[key]
