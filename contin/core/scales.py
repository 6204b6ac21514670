"""Scales: sizes of states and parameters, by which the unknowns of a discretized problem are divided.

All tolerances, steps and norms of the engine are made for unknowns of order one. A system with scales works on x = (u / s_u, p
/ s_p), and on equations divided by sizes of their own, so that a problem in newtons and one in giganewtons are the same
problem. Scales are powers of two: multiplication by them is exact.
"""

from __future__ import annotations

import functools
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from contin.arrays import Array
from contin.draws import ASIDE

#: Sizes between these bounds count as one: problems of everyday sizes are not scaled. Tolerances relative to 1 + |x| suit large
#: numbers, and small ones less.
USUAL = 1e-2, 1e3


@dataclass(frozen=True, eq=False)
class Scales:
    """Sizes of the states (n,), of all parameters, and of the equations that have a number of their own.

    ``rows`` are those of boundary conditions and integral conditions, or of the residual of an algebraic problem.
    """

    states: Array
    parameters: Array
    rows: dict[str, Array]

    def arrays(self) -> dict[str, Array]:
        """Return all sizes by name, for a file."""
        return {"states": self.states, "parameters": self.parameters, **self.rows}

    @functools.cached_property
    def are_one(self) -> bool:
        """Whether nothing is scaled."""
        return all(np.all(sizes == 1) for sizes in self.arrays().values())

    @classmethod
    def of_arrays(cls, arrays: dict[str, Array]) -> Scales:
        """Return the scales that `arrays` gave."""
        rows = {name: sizes for name, sizes in arrays.items() if name not in ("states", "parameters")}
        return cls(arrays["states"], arrays["parameters"], rows)


@functools.cache  # systems with the same sizes have the same object
def nothing_scaled(states: int, parameters: int, rows: tuple[tuple[str, int], ...]) -> Scales:
    """Return sizes that are all one; ``rows`` are names and numbers of equations."""
    return Scales(np.ones(states), np.ones(parameters), {name: np.ones(count) for name, count in rows})


def largest_entries(entries: Callable[[Array], Array], x: Array) -> Array:
    """Return the larger of ``entries(x)`` and of those beside x, where these are finite."""
    here = entries(x)
    with np.errstate(all="ignore"):
        beside = entries(x + ASIDE * (1 + np.abs(x)))
    return np.maximum(here, np.where(np.isfinite(beside), beside, 0.0))


def usual(sizes: Array | float) -> Array:
    """Return sizes as powers of two; 1 for those of everyday size, and for zero, infinity and NaN."""
    sizes = np.abs(sizes)
    odd = np.isfinite(sizes) & (sizes > 0) & ((sizes < USUAL[0]) | (sizes > USUAL[1]))
    return np.where(odd, np.exp2(np.round(np.log2(np.where(odd, sizes, 1.0)))), 1.0)
