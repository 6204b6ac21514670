"""Results on one line: numbers and names as they are, arrays by their shapes."""

from __future__ import annotations

import dataclasses
import types
from typing import Any

import numpy as np

#: Longest text of a field that is not left out. A screen has 80 to 130 characters a line.
_LONGEST = 80


class Shown:
    """A dataclass, made with ``repr=False``, whose fields are shown shortly.

    Examples
    --------
    >>> from ribbon_model.shape import Shape
    >>> Shape(np.zeros(5), np.zeros((5, 3)), np.zeros((5, 3, 3)), np.zeros(5))
    Shape(arclength: array (5,), centreline: array (5, 3), directors: array (5, 3, 3), eta: array (5,), breadth=1.0, depth=1.0)
    """

    def __repr__(self) -> str:
        made: Any = self
        fields = [f"{field.name}{_text(getattr(self, field.name))}" for field in dataclasses.fields(made)]
        return f"{type(self).__name__}({', '.join(fields)})"


def _text(value) -> str:
    """Return a value behind the name of its field."""
    if isinstance(value, np.ndarray):
        return f": array {value.shape}"
    if isinstance(value, types.FunctionType):
        return ": function"
    text = repr(value)
    return f"={text}" if len(text) <= _LONGEST else f": {type(value).__name__}"
