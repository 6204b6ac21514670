"""What users hand over, looked at before it is used: each function raises one sentence that names the field and the value."""

from __future__ import annotations

import math
import sys
from collections.abc import Callable, Mapping, Sequence
from typing import Any

import numpy as np

from contin.errors import ProblemError


def shown(value: object) -> str:
    """The value in one short line."""
    try:
        text = " ".join(repr(value).split())
    except Exception:  # an integer of too many digits, or an object whose repr is broken
        text = f"a value of type {type(value).__name__}"
    return text if len(text) <= 60 else text[:57] + "..."


def plain(name: str) -> str:
    """A name that may be any text, as it is or in quotes."""
    return name if name.isidentifier() else shown(name)


def is_number(value: object) -> bool:
    """Whether it is a real number, NaN and infinity included; a truth value is none, nor an integer beyond all floats."""
    if isinstance(value, int):
        return not isinstance(value, bool) and abs(value) <= sys.float_info.max
    return isinstance(value, (float, np.integer, np.floating))


def number(what: str, value: Any, low: float = -math.inf, high: float = math.inf) -> None:
    """A number strictly between ``low`` and ``high``."""
    if not (is_number(value) and low < value < high):
        bounds = "a finite number" if math.inf == high == -low else f"a number between {low:g} and {high:g}"
        raise ProblemError(f"{what}: {shown(value)} must be {bounds}")


def whole(what: str, value: Any, low: int, high: int) -> None:
    """A whole number from ``low`` to ``high``."""
    if isinstance(value, bool) or not isinstance(value, (int, np.integer)) or not low <= value <= high:
        raise ProblemError(f"{what}: {shown(value)} must be a whole number from {low} to {high}")


def truth(what: str, value: Any) -> None:
    """True or False."""
    if not isinstance(value, (bool, np.bool_)):
        raise ProblemError(f"{what}: {shown(value)} must be True or False")


def instance(what: str, value: Any, kind: type | tuple[type, ...], called: str) -> None:
    """An object of a class, ``called`` so."""
    if not isinstance(value, kind):
        raise ProblemError(f"{what}: {shown(value)} must be {called}")


def function(what: str, value: Any) -> Callable[..., Any]:
    """Something that can be called."""
    if not callable(value):
        raise ProblemError(f"{what}: {shown(value)} must be a function")
    found: Callable[..., Any] = value
    return found


def mapping(what: str, value: Any, holds: str) -> Mapping[str, Any]:
    """A mapping from names to what it ``holds``."""
    if not isinstance(value, Mapping) or not all(isinstance(name, str) for name in value):
        raise ProblemError(f"{what}: {shown(value)} must be a dict from names to {holds}")
    return value


def sequence(what: str, value: Any, holds: str) -> Sequence[Any]:
    """A list, a tuple or an array of one dimension; text is none."""
    array = isinstance(value, np.ndarray) and value.ndim == 1
    if not array and (not isinstance(value, Sequence) or isinstance(value, (str, bytes))):
        raise ProblemError(f"{what}: {shown(value)} must be a list of {holds}")
    found: Sequence[Any] = value
    return found


def names(what: str, value: Any) -> tuple[str, ...]:
    """A list of names, as a tuple."""
    found = tuple(sequence(what, value, "names"))
    if not all(isinstance(name, str) for name in found):
        raise ProblemError(f"{what}: {shown(value)} must be a list of names")
    return found
