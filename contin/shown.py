"""Text of objects with many numbers in them: numbers and names as they are, arrays by their shapes."""

from __future__ import annotations

import dataclasses
from typing import Any

import numpy as np

#: Characters of a line: a screen has 80 to 130.
WIDTH = 80
#: Lines that a text has at most, and names that a message lists: a screen has 24 lines or more. The others are counted.
ROWS = 20
#: Numbers in one line, at most.
COLUMNS = 8


def shown(made: Any) -> str:
    """Return a dataclass or a named tuple as text that fits on a screen: ``__repr__ = shown`` in its class.

    Examples
    --------
    >>> from dataclasses import dataclass
    >>> @dataclass
    ... class Curve:
    ...     name: str
    ...     places: np.ndarray
    ...     __repr__ = shown
    >>> Curve("arc", np.zeros((5, 3)))
    Curve(name='arc', places: array (5, 3))
    """
    names = getattr(made, "_fields", None) or [field.name for field in dataclasses.fields(made)]
    fields: list[str] = []
    for name in names:
        fields.append(f"{name}{_text(getattr(made, name))}")
        if sum(map(len, fields)) > ROWS * WIDTH:
            fields.append(f"and {len(names) - len(fields)} more")
            break
    return f"{type(made).__name__}({', '.join(fields)})"


def _text(value: object) -> str:
    """Return a value behind the name of its field."""
    if isinstance(value, np.ndarray):
        return f": array {value.shape}"
    if callable(value) and not hasattr(type(value), "_fields"):
        return f": {getattr(value, '__name__', type(value).__name__).strip('<>')}"
    text = repr(value)
    return f"={text}" if len(text) <= WIDTH and " at 0x" not in text else f": {type(value).__name__}"
