"""A Jacobian that a user gives, compared once with differences of the residual."""

from __future__ import annotations

from typing import Any

import numpy as np

from contin.arrays import Array
from contin.errors import ProblemError

#: Length of differences of fourth order, relative to 1 + |u|; half of it serves the error estimate. Errors are below 1e-10 of
#: the sizes of the terms.
_LENGTH = 1e-3
#: The place of the comparison lies this far, relative to 1 + |u|, beside the first one, where terms may vanish.
_ASIDE = 0.05
#: Differences of two lengths tell their error up to this factor; nothing smaller than this part of the terms is compared.
_SAFE, _LEAST = 20.0, 1e-9


def check_given(problem: Any, u: Array, p: Array) -> None:
    """Compare a given Jacobian with differences of the residual along a random direction, the first time.

    Raises
    ------
    ProblemError
        An entry is wrong; the message names it.
    """
    if problem.jacobian is None or problem.compared:
        return
    problem.compared.append(True)
    random = np.random.default_rng(3)
    size = 1 + np.abs(u)
    place = u + _ASIDE * size * random.uniform(-1, 1, u.size)
    direction = size * random.uniform(0.5, 1.0, u.size) * random.choice([-1.0, 1.0], u.size)
    for here in (place, u):
        with np.errstate(all="ignore"):
            matrix = problem.jacobian_at(here, p)
            wanted, error = _slope(problem, here, p, direction)
        terms = abs(matrix) @ np.abs(direction)
        if np.isfinite(wanted).all() and np.isfinite(terms).all():
            break
    else:
        return  # nothing to compare with: Newton's method will say that there are no values
    excess = np.abs(matrix @ direction - wanted) - _SAFE * error - _LEAST * (terms + np.abs(wanted))
    if np.any(excess > 0):
        raise ProblemError(_wrong_entry(problem, (here, p), matrix, int(np.argmax(excess))))


def _slope(problem: Any, u: Array, p: Array, direction: Array) -> tuple[Array, Array]:
    """Return the derivative of the residual along a direction, by differences of fourth order, and an estimate of its error."""
    batch, none = problem.batch("residual"), np.empty((0, u.size))

    def at(s: float) -> Array:
        values: Array = batch.values(np.zeros(1), (u + s * direction)[None], none, p)[0]
        return values

    found = [(8 * (at(h) - at(-h)) - (at(2 * h) - at(-2 * h))) / (12 * h) for h in (_LENGTH, _LENGTH / 2)]
    return found[1], np.abs(found[1] - found[0])


def _wrong_entry(problem: Any, place: tuple[Array, Array], matrix: Any, row: int) -> str:
    """Return the sentence that names the entry of a row that differs most."""
    u, p = place
    given = matrix[[row]].toarray()[0] if hasattr(matrix, "toarray") else matrix[row]
    known, size = np.empty(u.size), 1 + np.abs(u)
    for column in range(u.size):
        along = np.zeros(u.size)
        along[column] = size[column]
        known[column] = _slope(problem, u, p, along)[0][row] / size[column]
    differs = np.abs(known - given) * size
    column = int(np.argmax(differs))
    name = problem.state_names[column]
    numbers = f"{given[column]:.6g}, must be {known[column]:.6g}"
    return f"jacobian: the derivative of equation {row} by {name} is {numbers} (by differences of the residual)"
