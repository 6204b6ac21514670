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
    """Return the number of arguments of a user's function that have no default.

    Raises
    ------
    ProblemError
        It is no function, or one that does not say.
    """
    try:
        given = inspect.signature(getattr(function, "py_func", function)).parameters.values()
    except (TypeError, ValueError):
        raise ProblemError(f"{checks.shown(function)} must be a Python function that says which arguments it takes") from None
    return sum(each.default is each.empty and each.kind not in (each.VAR_POSITIONAL, each.VAR_KEYWORD) for each in given)


def result_count(function: Function, arguments: Arguments, what: str) -> int:
    """Return how many values a function returns (0: a bare number), from calls in Python with numbers.

    Raises
    ------
    ProblemError
        The call fails, for each of some numbers; ``what`` names the function.
    """
    plain = getattr(function, "py_func", function)
    kinds: list[Any] = [None if names is None else namedtuple("Values", names) for names in arguments]
    first: Exception | None = None
    for number in _PROBES:
        values = [number if kind is None else kind(*[number + 0.01 * i for i in range(len(kind._fields))]) for kind in kinds]
        try:
            with np.errstate(all="ignore"):
                result = plain(*values)
        except (ArithmeticError, ValueError) as error:  # it may have values elsewhere
            first = first or error
            continue
        except Exception as error:  # a user's function may raise anything
            first = error
            break
        return len(result) if isinstance(result, (tuple, list, np.ndarray)) else 0
    assert first is not None
    reason = " ".join(str(first).split())
    if isinstance(first, AttributeError):
        reason += "; the states and parameters are " + ", ".join(name for names in arguments for name in names or ())
    raise ProblemError(f"{what} cannot be called: {type(first).__name__}: {reason}") from first


#: Numbers with which functions are called to see what they return: in the domain of most functions. NaN, the last, is in the
#: domain of all, but a search may not end for it.
_PROBES = (0.5, 1.5, -0.5, 0.0, 10.0, math.nan)
