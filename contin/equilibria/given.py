"""A Jacobian that a user gives, compared once with differences of the residual."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, Protocol

import numpy as np

from contin.arrays import Array
from contin.core.differences import derivative
from contin.draws import ASIDE, generator, signs
from contin.errors import ProblemError
from contin.functions.batch import Batch
from contin.levels import CERTAIN, LOCATED


class _Given(Protocol):
    """A problem with a Jacobian."""

    jacobian: Any

    @property
    def compared(self) -> list[bool]: ...
    @property
    def state_names(self) -> Sequence[str]: ...
    def batch(self, name: str) -> Batch: ...
    def jacobian_at(self, u: Array, p: Array) -> Any: ...


def check_given(problem: _Given, u: Array, p: Array) -> None:
    """Compare a given Jacobian with differences of the residual along a random direction, the first time.

    Raises
    ------
    ProblemError
        An entry is wrong; the message names it.
    """
    if problem.jacobian is None or problem.compared:
        return
    problem.compared.append(True)
    batch, none = problem.batch("residual"), np.empty((0, u.size))
    random, size = generator("given"), 1 + np.abs(u)
    place = u + ASIDE * size * random.uniform(-1, 1, u.size)
    direction = size * random.uniform(0.5, 1.0, u.size) * signs(random, u)

    def slope(along: Array) -> tuple[Any, float]:
        return derivative(lambda s: batch.values(np.zeros(1), (place + s * along)[None], none, p)[0])

    for place in (place, u):  # noqa: B020  `slope` is taken there
        with np.errstate(all="ignore"):
            matrix = problem.jacobian_at(place, p)
            wanted, error = slope(direction)
        terms = abs(matrix) @ np.abs(direction)
        if np.isfinite(wanted).all() and np.isfinite(terms).all():
            break
    else:
        return  # nothing to compare with: Newton's method will say that there are no values
    excess = np.abs(matrix @ direction - wanted) - CERTAIN * error - LOCATED * (terms + np.abs(wanted))
    if np.any(excess > 0):
        row = int(np.argmax(excess))
        given = matrix[[row]].toarray()[0] if hasattr(matrix, "toarray") else matrix[row]
        known = np.array([slope(along)[0][row] for along in np.diag(size)]) / size
        column = int(np.argmax(np.abs(known - given) * size))
        what = f"the derivative of equation {row} by {problem.state_names[column]}"
        numbers = f"{given[column]:.6g}, must be {known[column]:.6g}"
        raise ProblemError(f"jacobian: {what} is {numbers} (by differences of the residual)")
