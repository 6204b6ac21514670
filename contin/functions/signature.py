"""Numbers of arguments and results of a user's function."""

from __future__ import annotations

import inspect
import math
from collections import namedtuple
from collections.abc import Sequence
from typing import Any

import numpy as np

from contin import checks
from contin.arrays import Function
from contin.errors import ProblemError


def outputs(function: Function, arguments: Sequence[tuple[str, ...] | None], what: str) -> int:
    """How many values ``function`` returns (0: a single number), found by one call in Python with NaN everywhere."""
    plain = getattr(function, "py_func", function)
    tuples: list[Any] = [None if names is None else namedtuple("Values", names) for names in arguments]
    values = [math.nan if kind is None else kind(*[math.nan] * len(kind._fields)) for kind in tuples]
    try:
        with np.errstate(all="ignore"):
            result = plain(*values)
    except Exception as error:
        reason = " ".join(str(error).split())
        raise ProblemError(f"{what} cannot be called: {type(error).__name__}: {reason}") from error
    return len(result) if isinstance(result, (tuple, list, np.ndarray)) else 0


def argument_count(function: Function) -> int:
    """Number of positional arguments of a user's function.

    Raises
    ------
    ProblemError
        It is no function, or one that does not say.
    """
    try:
        return len(inspect.signature(getattr(function, "py_func", function)).parameters)
    except (TypeError, ValueError):
        raise ProblemError(f"{checks.shown(function)} must be a plain Python function (def or lambda)") from None
