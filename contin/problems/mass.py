"""Mass matrices: M u' = F with a constant M becomes u' = f.

A regular M is inverted. A singular one has columns of zeros, those of states z that are found from equations without rates.
With L1 M = 1 for the other states y, and rows L2 that span what M maps nothing to,

    y' = L1 F(y, z),        0 = L2 F(y, z),

where z is found for given y by Newton's method, as an operation of the tape (`contin.functions.iteration`). That takes an index
of one: the derivative of L2 F by z is regular.
"""

from __future__ import annotations

import dataclasses
from collections import namedtuple
from collections.abc import Callable, Sequence
from typing import Any

import numpy as np

from contin import checks
from contin.arrays import Array, Function
from contin.errors import ProblemError
from contin.functions.iteration import MOST, root
from contin.levels import CORRECTED
from contin.problems.vector_field import combined


@dataclasses.dataclass(frozen=True)
class Mass:
    """A mass matrix, analysed.

    Attributes
    ----------
    matrix : ndarray, shape (n, n)
    kept, found : list of int
        Places of the states with rates, y, and of those that are found, z.
    rates, algebraic : list of list of float
        Rows L1 and L2.
    """

    matrix: Array
    kept: list[int]
    found: list[int]
    rates: list[list[float]]
    algebraic: list[list[float]]

    @classmethod
    def of(cls, mass: Any, names: Sequence[str]) -> Mass:
        """Return a matrix, or its diagonal, analysed.

        Raises
        ------
        ProblemError
            It is neither, or has a column that is not zero and depends on the others.
        """
        n = len(names)
        given = mass.toarray() if hasattr(mass, "toarray") else mass
        try:
            diagonal = np.ndim(given) == 1
        except ValueError:
            diagonal = False
        matrix = checks.array("mass", given, (n,) if diagonal else (n, n))
        matrix = np.diag(matrix) if diagonal else matrix
        kept = [int(i) for i in np.flatnonzero(matrix.any(axis=0))]
        found = [i for i in range(n) if i not in kept]
        if not kept:
            raise ProblemError("mass: it is zero; leave it out and state dynamics=False")
        left, sizes, right = np.linalg.svd(matrix[:, kept])
        if sizes[-1] <= CORRECTED * sizes[0]:
            states = checks.listed(names[i] for i in kept)
            raise ProblemError(f"mass: its columns of {states} depend on each other; take states of which some have no rates")
        if len(found) > MOST:
            raise ProblemError(f"mass: {len(found)} states have no rates, at most {MOST} can be found")
        rates = right.T @ (left[:, : len(kept)] / sizes).T
        zero_rows = np.flatnonzero(~matrix.any(axis=1))
        algebraic = np.eye(n)[zero_rows] if len(zero_rows) == len(found) else left[:, len(kept) :].T
        exact = np.where(np.abs(rates) > CORRECTED * np.abs(rates).max(axis=1, keepdims=True), rates, 0.0)
        return cls(matrix, kept, found, exact.tolist(), algebraic.tolist())

    @property
    def is_regular(self) -> bool:
        """All states have rates."""
        return not self.found

    def rates_of(self, field: Function, arguments: int) -> Function:
        """Return the rates of the states that have some, as a function of ``arguments`` arguments: (u, p) or (t, u, p)."""
        rows = self.rates
        return _of(lambda *given: combined(rows, field(*given)), arguments)

    def jacobian_of(self, jacobian: Function, arrays: bool) -> Function:
        """Return the derivatives of `rates_of` a field with these, which may take arrays."""
        rows = np.array(self.rates)

        def of_rates(u: Any, p: Any) -> Any:
            found = jacobian(np.array(list(u)), np.array(list(p))) if arrays else jacobian(u, p)
            return (type(found)(rows) if hasattr(found, "tocsr") else rows) @ found

        return of_rates

    def of_kept(
        self, function: Function, field: Function, names: Sequence[str], start: Sequence[float], arguments: int
    ) -> Function:
        """Return a function of all states as one of y: z is found from a start such that L2 F = 0, with the field F."""
        state: Any = namedtuple("State", tuple(names))  # type: ignore[misc]  # noqa: PYI024
        kept, found, algebraic, starts = self.kept, self.found, self.algebraic, [float(value) for value in start]

        def of_kept(*given: Any) -> Any:
            *times, u, p = given

            def whole(z: Sequence[Any]) -> Any:
                known = {**dict(zip(kept, u)), **dict(zip(found, z))}
                return state(*(known[i] for i in range(len(names))))

            z = root(lambda w: combined(algebraic, field(*times, whole(w), p)), starts)
            return function(*times, whole(z), p)

        return _of(of_kept, arguments)

    def check_index(self, jacobian: Array, names: Sequence[str]) -> None:
        """Check that z is determined at a place, by F_u there (n, n).

        Raises
        ------
        ProblemError
            The derivative of L2 F by z is singular.
        """
        by_found = np.array(self.algebraic) @ jacobian[:, self.found]
        if not np.isfinite(by_found).all():
            return
        sizes = np.abs(by_found).max(axis=1, keepdims=True)
        by_found = by_found / np.where(sizes > 0, sizes, 1.0)
        values = np.linalg.svd(by_found, compute_uv=False)
        if not values[-1] > CORRECTED * values[0]:
            states = checks.listed(names[i] for i in self.found)
            raise ProblemError(
                f"mass: the equations without rates do not determine {states} at the guess, as their derivatives by these are "
                "singular: the index is larger than one; differentiate them by the time until they do, or take another guess"
            )


def _of(function: Callable[..., Any], count: int) -> Function:
    """Return a function of any arguments as one of two, (u, p), or of three, (t, u, p)."""
    if count == 2:
        return lambda u, p: function(u, p)
    return lambda t, u, p: function(t, u, p)
