"""Checks of what users hand over: each raises a `ProblemError` that names the field, the value and what is allowed."""

from __future__ import annotations

import math
import sys
from collections.abc import Callable, Iterable, Mapping, Sequence
from typing import Any

import numpy as np

from contin.arrays import Array
from contin.errors import ProblemError
from contin.names import exact_text

#: Characters of a value that a message shows: with the rest of the sentence it fits on one line.
_SHOWN = 60


def listed(names: Iterable[str]) -> str:
    """Return names as a message shows them: the first of many."""
    found = list(names)
    more = f" and {len(found) - _LISTED} more" if len(found) > _LISTED else ""
    return ", ".join(found[:_LISTED]) + more


#: So many names stand in a message. Ten times more would hide what the message says.
_LISTED = 20


def shown(value: object) -> str:
    """Return the value in one short line."""
    try:
        text = " ".join(repr(value).split())
    except Exception:  # an integer of too many digits, or an object whose repr is broken
        text = f"a value of type {type(value).__name__}"
    return text if len(text) <= _SHOWN else text[: _SHOWN - 3] + "..."


def plain(name: str) -> str:
    """Return a name that may be any text: as it is, or in quotes."""
    return name if name.isidentifier() else shown(name)


def is_number(value: object) -> bool:
    """Return whether a value is a real number; NaN and infinity are, True, False and integers beyond all floats are not."""
    if isinstance(value, int):
        return not isinstance(value, bool) and abs(value) <= sys.float_info.max
    return isinstance(value, (float, np.integer, np.floating))


def number(what: str, value: Any, low: float = -math.inf, high: float = math.inf) -> None:
    """Require a number strictly between ``low`` and ``high``."""
    if not (is_number(value) and low < value < high):
        bounds = "a finite number" if math.inf == high == -low else f"a number between {exact_text(low)} and {exact_text(high)}"
        raise ProblemError(f"{what}: {shown(value)} must be {bounds}")


def whole(what: str, value: Any, low: int, high: int) -> None:
    """Require a whole number from ``low`` to ``high``."""
    if isinstance(value, bool) or not isinstance(value, (int, np.integer)) or not low <= value <= high:
        raise ProblemError(f"{what}: {shown(value)} must be a whole number from {low} to {high}")


def truth(what: str, value: Any) -> None:
    """Require True or False."""
    if not isinstance(value, (bool, np.bool_)):
        raise ProblemError(f"{what}: {shown(value)} must be True or False")


def instance(what: str, value: Any, kind: type | tuple[type, ...], called: str) -> None:
    """Require an object of a class; ``called`` names it in the message."""
    if not isinstance(value, kind):
        raise ProblemError(f"{what}: {shown(value)} must be {called}")


def function(what: str, value: Any) -> Callable[..., Any]:
    """Require something that can be called, and return it."""
    if not callable(value):
        raise ProblemError(f"{what}: {shown(value)} must be a function")
    found: Callable[..., Any] = value
    return found


def mapping(what: str, value: Any, holds: str) -> Mapping[str, Any]:
    """Require a mapping from names to what it ``holds``, and return it."""
    if not isinstance(value, Mapping) or not all(isinstance(name, str) for name in value):
        raise ProblemError(f"{what}: {shown(value)} must be a dict from names to {holds}")
    return value


def sequence(what: str, value: Any, holds: str) -> Sequence[Any]:
    """Require a list, a tuple or an array of one dimension, and return it; text is none of them."""
    array = isinstance(value, np.ndarray) and value.ndim == 1
    if not array and (not isinstance(value, Sequence) or isinstance(value, (str, bytes))):
        raise ProblemError(f"{what}: {shown(value)} must be a list of {holds}")
    found: Sequence[Any] = value
    return found


def names(what: str, value: Any) -> tuple[str, ...]:
    """Require a list of names, and return it as a tuple."""
    found = tuple(sequence(what, value, "names"))
    if not all(isinstance(name, str) for name in found):
        raise ProblemError(f"{what}: {shown(value)} must be a list of names")
    return found


def chosen(what: str, value: Any, known: Sequence[str]) -> tuple[str, ...]:
    """Require different names among those that are known, and return them."""
    found = names(what, value)
    for name in found:
        if name not in known:
            raise ProblemError(f"{what}: {shown(name)} must be one of {listed(known) or 'none, as there are none here'}")
        if found.count(name) > 1:
            raise ProblemError(f"{what}: {plain(name)} is given twice")
    return found


def array(what: str, value: Any, shape: tuple[int, ...]) -> Array:
    """Require finite numbers of a shape, and return them as an array."""
    try:
        found = np.asarray(value, dtype=float)
    except (TypeError, ValueError, OverflowError):
        raise ProblemError(f"{what}: {shown(value)} must be numbers") from None
    if found.shape != shape or not np.isfinite(found).all():
        raise ProblemError(f"{what}: {shown(value)} must be {' x '.join(map(str, shape))} finite numbers")
    return found
