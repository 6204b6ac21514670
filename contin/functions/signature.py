"""Arguments and results of a user's functions: their names, and their numbers."""

from __future__ import annotations

import inspect
import math
from collections import namedtuple
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from contin import checks
from contin.arrays import Function
from contin.errors import ProblemError

#: Names of the arguments of a function that are named tuples; None for one that is a number.
Arguments = Sequence[tuple[str, ...] | None]


@dataclass(frozen=True)
class Signature:
    """Arguments of a function of a point: f(t, u, p), f(u, p), or f(u, v, p) of the states at both ends.

    Attributes
    ----------
    states, parameters : tuple of str
        Names of the components of u (and v), and of p.
    times : bool
        t is the first argument.
    ends : bool
        v follows u; there is no t then.
    """

    states: tuple[str, ...]
    parameters: tuple[str, ...]
    times: bool = True
    ends: bool = False

    @property
    def arguments(self) -> list[tuple[str, ...] | None]:
        """Names of the components of each argument; None for t."""
        before: list[tuple[str, ...] | None] = [None] if self.times else []
        return [*before, *[self.states] * (1 + self.ends), self.parameters]

    @property
    def inputs(self) -> int:
        """Number of components of u, v and p."""
        return len(self.states) * (1 + self.ends) + len(self.parameters)

    def fills(self, function: Function) -> bool:
        """Return whether a function has one argument more: an array that it fills."""
        return argument_count(function) == len(self.arguments) + 1


def argument_count(function: Function) -> int:
    """Return the number of positional arguments of a user's function.

    Raises
    ------
    ProblemError
        It is no function, or one that does not say.
    """
    try:
        return len(inspect.signature(getattr(function, "py_func", function)).parameters)
    except (TypeError, ValueError):
        raise ProblemError(f"{checks.shown(function)} must be a plain Python function (def or lambda)") from None


def result_count(function: Function, arguments: Arguments, what: str) -> int:
    """Return how many values a function returns (0: a bare number), from one call in Python with NaN for every number.

    Raises
    ------
    ProblemError
        The call fails; ``what`` names the function.
    """
    plain = getattr(function, "py_func", function)
    tuples: list[Any] = [None if names is None else namedtuple("Values", names) for names in arguments]
    values = [math.nan if kind is None else kind(*[math.nan] * len(kind._fields)) for kind in tuples]
    try:
        with np.errstate(all="ignore"):
            result = plain(*values)
    except Exception as error:  # a user's function may raise anything
        reason = " ".join(str(error).split())
        raise ProblemError(f"{what} cannot be called: {type(error).__name__}: {reason}") from error
    return len(result) if isinstance(result, (tuple, list, np.ndarray)) else 0
