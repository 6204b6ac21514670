"""A Jacobian or sparsity pattern that a user gives, compared once with differences of the residual."""

from __future__ import annotations

from typing import Any

import numpy as np

from contin.arrays import Array
from contin.errors import ProblemError
from contin.problems.algebraic import AlgebraicProblem

#: Length of differences of fourth order, relative to 1 + |u|; half of it serves the error estimate. Errors are below 1e-10 of
#: the sizes of the terms.
_LENGTH = 1e-3
#: The place of the comparison lies this far, relative to 1 + |u|, beside the first one, where terms may vanish.
_ASIDE = 0.05
#: Differences of two lengths tell their error up to this factor; nothing smaller than this part of the terms is compared.
_SAFE, _LEAST = 20.0, 1e-9


def check_given(problem: AlgebraicProblem, u: Array, p: Array) -> None:
    """Compare a given Jacobian, or the pattern, with differences of the residual along a random direction, the first time.

    Raises
    ------
    ProblemError
        An entry is wrong or missing; the message names it.
    """
    if (problem.jacobian is None and problem.pattern is None) or problem.compared:
        return
    problem.compared.append(True)
    random = np.random.default_rng(3)
    size = 1 + np.abs(u)
    place = u + _ASIDE * size * random.uniform(-1, 1, u.size)
    direction = size * random.uniform(0.5, 1.0, u.size) * random.choice([-1.0, 1.0], u.size)
    for here in (place, u):
        with np.errstate(all="ignore"):
            matrix = _matrix(problem, here, p)
            wanted, error = _slope(problem, here, p, direction)
        terms = abs(matrix) @ np.abs(direction)
        if np.isfinite(wanted).all() and np.isfinite(terms).all():
            break
    else:
        return  # nothing to compare with: Newton's method will say that there are no values
    if problem.jacobian is None and problem.batch("residual").recording is not None:
        _check_entries(problem, matrix)
        return
    excess = np.abs(matrix @ direction - wanted) - _SAFE * error - _LEAST * (terms + np.abs(wanted))
    if np.any(excess > 0):
        raise ProblemError(_wrong_entry(problem, (here, p), matrix, int(np.argmax(excess))))


def _check_entries(problem: AlgebraicProblem, matrix: Any) -> None:
    """Compare a pattern with the entries of the exact Jacobian at one place, those of zeros left out.

    Raises
    ------
    ProblemError
        An entry is missing.
    """
    entries = matrix.tocoo()
    given = set(zip(*(side.tolist() for side in problem.entries)))
    for row, column, value in zip(entries.row.tolist(), entries.col.tolist(), entries.data.tolist()):
        if value != 0 and (row, column) not in given:
            raise ProblemError(_missing(problem, row, column))


def _missing(problem: AlgebraicProblem, row: int, column: int) -> str:
    """Return the sentence that names an entry that a pattern lacks."""
    name = problem.state_names[column]
    return f"pattern: equation {row} depends on {name}, so the pattern must have the entry ({row}, {column})"


def _matrix(problem: AlgebraicProblem, u: Array, p: Array) -> Any:
    """Return the derivatives by states as they are given, or found with the given pattern."""
    if problem.jacobian is not None:
        return problem.jacobian_at(u, p)
    from scipy.sparse import csr_array  # type: ignore[import-untyped]  # .1 s; few problems need it

    batch = problem.batch("residual")
    columns = batch.columns([])
    entries = batch.entries(np.zeros(1), u[None], np.empty((0, u.size)), p, columns)[1]
    rows, places = columns.rows, columns.places
    return csr_array((entries, (rows, places)), shape=(problem.equation_size, u.size))


def _slope(problem: AlgebraicProblem, u: Array, p: Array, direction: Array) -> tuple[Array, Array]:
    """Return the derivative of the residual along a direction, by differences of fourth order, and an estimate of its error."""
    batch, none = problem.batch("residual"), np.empty((0, u.size))

    def at(s: float) -> Array:
        values: Array = batch.values(np.zeros(1), (u + s * direction)[None], none, p)[0]
        return values

    found = [(8 * (at(h) - at(-h)) - (at(2 * h) - at(-2 * h))) / (12 * h) for h in (_LENGTH, _LENGTH / 2)]
    return found[1], np.abs(found[1] - found[0])


def _wrong_entry(problem: AlgebraicProblem, place: tuple[Array, Array], matrix: Any, row: int) -> str:
    """Return the sentence that names the entry of a row that differs most, or of a pattern the one that is missing."""
    u, p = place
    given = matrix[[row]].toarray()[0] if hasattr(matrix, "toarray") else matrix[row]
    known, size = np.empty(u.size), 1 + np.abs(u)
    for column in range(u.size):
        along = np.zeros(u.size)
        along[column] = size[column]
        known[column] = _slope(problem, u, p, along)[0][row] / size[column]
    differs = np.abs(known - given) * size
    if problem.jacobian is None:  # what stands beside a missing entry has its derivative, too
        differs[given != 0] = 0.0
    column = int(np.argmax(differs))
    name = problem.state_names[column]
    if problem.jacobian is None:
        return _missing(problem, row, column)
    numbers = f"{given[column]:.6g}, must be {known[column]:.6g}"
    return f"jacobian: the derivative of equation {row} by {name} is {numbers} (by differences of the residual)"
