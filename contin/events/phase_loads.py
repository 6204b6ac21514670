"""Phase conditions that load what they should only hold.

A phase condition picks one of the solutions that a continuous symmetry turns into each other. Its multiplier (the unfolding
number that makes its equations as many as the unknowns) then vanishes, at the solution and along every mode: with the gradient
g of the condition, the second variation Q and the direction z of the symmetry, Q v = mu g and Q z = 0 give mu (z.g) = 0. Where
no symmetry moves the solution along g, mu is a load, and solutions, branch points and the index are those of another problem.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np

from contin.arrays import Array, Indices
from contin.core.protocol import Discretization
from contin.levels import CERTAIN, LOCATED
from contin.problems.statement import phases_of


def phase_loads(system: Discretization, x: Array, kernel: Sequence[Array], error: float) -> Iterator[tuple[str, float, bool]]:
    """Yield the phases that load a solution x or one of the modes ``kernel``: name, multiplier, whether it is a mode.

    The multiplier of a solution is in the user's units, that of a mode relative to its largest unknown. ``error`` is that of x,
    relative to 1 + size.
    """
    zero = max(LOCATED, CERTAIN * error)
    for name in phases_of(system.problem):
        at, shown = _places(system, name, x)
        modes = [mode[at] / np.abs(mode).max() for mode in kernel]
        if np.abs(x[at]).max(initial=0.0) > zero * (1 + np.abs(x).max()):
            yield name, float(max(shown, key=abs)), False
        elif (load := max((float(np.abs(mode).max(initial=0.0)) for mode in modes), default=0.0)) > zero:
            yield name, load, True


def _places(system: Discretization, name: str, x: Array) -> tuple[Indices, Array]:
    """Return the places of a parameter or a state among the unknowns, none of a parameter that is not free; and its values."""
    names, parameters = list(system.problem.states), list(system.problem.parameters)
    if name in names:
        at = names.index(name)
        return np.arange(at, system.state_size, len(names)), system.states(x)[:, at]
    places = [system.parameter_index(name)] if name in system.free else []
    return np.array(places, dtype=np.int64), system.all_parameters(x)[[parameters.index(name)]]
