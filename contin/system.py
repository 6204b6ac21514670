"""What discretized problems of both kinds share: names, values and places of parameters."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from contin.errors import ProblemError


class System:
    """A problem with chosen free parameters; ``x`` holds the states, flattened, then the free parameters.

    Attributes
    ----------
    problem : object
    free : tuple of str
        The free parameters.
    parameters : ndarray
        Values of all parameters; those of the free ones are not used.
    state_size : int
        Where the free parameters begin in x; set by the kinds of system.

    Raises
    ------
    ProblemError
        An unknown parameter.
    """

    state_size: int

    def __init__(self, problem, free: Sequence[str], parameters: Mapping[str, float]):
        self.problem, self.free = problem, tuple(free)
        names = tuple(problem.parameters)
        for name in (*self.free, *parameters):
            if name not in names:
                raise ProblemError(f"parameter {name!r} is not one of {', '.join(names)}")
        self.parameters = np.array([float(parameters.get(name, problem.parameters[name])) for name in names])
        self._free = self._indices(self.free)

    def _indices(self, names) -> np.ndarray:
        """Where parameters stand among all of them."""
        return np.array([list(self.problem.parameters).index(name) for name in names], dtype=np.int64)

    def pack(self, states, values: Mapping[str, float]):
        """A vector of unknowns from states and the mapping of free parameters."""
        return np.concatenate([np.asarray(states, dtype=float).ravel(), [float(values[name]) for name in self.free]])

    def all_parameters(self, x):
        """Values of all parameters, shape (number of names,), the free ones from x."""
        p = self.parameters.copy()
        p[self._free] = x[self.state_size :]
        return p

    def parameter(self, x, name: str) -> float:
        """The value of one parameter by name."""
        return float(self.all_parameters(x)[list(self.problem.parameters).index(name)])

    def parameter_index(self, name: str) -> int:
        """Where the free parameter ``name`` stands in x."""
        return self.state_size + self.free.index(name)
