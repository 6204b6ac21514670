"""Symmetries of cycles: u(t + T/n) = S u(t) with a matrix S that the field commutes with, F(S u) = S F(u), and S^n = 1."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from contin import checks
from contin.arrays import Array, Function
from contin.draws import PLACES, generator
from contin.errors import ProblemError
from contin.functions.signature import named_values
from contin.levels import LOCATED
from contin.problems.angles import whole_rounds

#: The largest order of a symmetry: rings of more oscillators are rare, and one n-th of a cycle should be worth a mesh.
_MOST = 60


def symmetry_matrix(symmetry: object, count: int) -> Array:
    """Return the matrix of a symmetry that is given as a matrix or as its diagonal.

    Raises
    ------
    ProblemError
        It is neither, the identity, or of no order up to 60.
    """
    try:
        given = np.array(symmetry, dtype=float)
    except (TypeError, ValueError, OverflowError):
        given = np.empty(0)
    if given.shape not in ((count,), (count, count)) or not np.isfinite(given).all():
        raise ProblemError(f"symmetry: {checks.shown(symmetry)} must be {count} signs, or a matrix of {count} rows and columns")
    matrix = np.diag(given) if given.ndim == 1 else given
    if order_of(matrix) == 1:
        raise ProblemError("symmetry: the identity is none; leave it out")
    return matrix


def order_of(matrix: Array) -> int:
    """Return the smallest n with S^n = 1.

    Raises
    ------
    ProblemError
        There is none up to 60.
    """
    one, power = np.eye(len(matrix)), matrix
    for order in range(1, _MOST + 1):
        if np.abs(power - one).max(initial=0.0) <= LOCATED:
            return order
        power = power @ matrix
    raise ProblemError(f"symmetry: no power of the matrix up to {_MOST} is the identity")


def check_equivariance(field: Function, matrix: Array, names: Sequence[str], parameters: Mapping[str, float]) -> None:
    """Check F(S u) = S F(u) at some places, with the default parameters; where the field has no value nothing is checked.

    Raises
    ------
    ProblemError
    """
    if order_of(matrix) == 1:
        return
    of_state, of_parameters = named_values(tuple(names)), named_values(tuple(parameters))
    p = of_parameters(**parameters)
    for u in generator("symmetry").uniform(-1, 1, (PLACES, len(names))):
        try:
            first, turned = (np.array(field(of_state(*map(float, v)), p), dtype=float) for v in (u, matrix @ u))
        except (ArithmeticError, ValueError):
            continue  # a root or logarithm of a negative number
        gap = np.abs(turned - matrix @ first)
        if np.any(gap > LOCATED * (1 + np.abs(first).max())):
            raise ProblemError(
                f"symmetry: the field does not have it; the rate of {names[int(gap.argmax())]} at S u differs by "
                f"{gap.max():.3g} from that of S F(u) for u = {', '.join(f'{value:.3g}' for value in u)}"
            )


def check_lattice(matrix: Array, names: Sequence[str], angles: Mapping[str, float]) -> None:
    """Check that S changes states by whole rounds of angles where an angle goes round once.

    Raises
    ------
    ProblemError
    """
    periods = np.array([angles.get(name, 0.0) for name in names])
    for name, period in angles.items():
        moved = period * matrix[:, names.index(name)]
        if np.any(np.abs(moved - whole_rounds(moved, periods)) > LOCATED):
            raise ProblemError(f"symmetry: where {name} goes round once, S u must change by whole rounds of angles")


def image(matrix: Sequence[Sequence[float]], u: Sequence[Any]) -> list[Any]:
    """Return the product of a matrix, as a list of rows, and a vector; zeros and ones are not multiplied."""
    return [_product(row, u) for row in matrix]


def _product(row: Sequence[float], u: Sequence[Any]) -> Any:
    terms = [value if factor == 1 else factor * value for factor, value in zip(row, u) if factor]
    return sum(terms[1:], terms[0])


def averaged(function: Function, matrix: Array, names: Sequence[str], order: int) -> Function:
    """Return the mean of a functional over u, S u, ..., S^(n-1) u, as a function of (t, u, p)."""
    state = named_values(tuple(names))
    powers = [np.linalg.matrix_power(matrix, k).tolist() for k in range(order)]

    def mean(t: Any, u: Any, p: Any) -> Any:
        values = [function(state(*image(power, u)), p) for power in powers]
        return sum(values[1:], values[0]) / order

    return mean
