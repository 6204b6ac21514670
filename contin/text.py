"""Numbers and objects as text: names that tell numbers apart, and objects with many numbers on one screen."""

from __future__ import annotations

import dataclasses
from collections import Counter
from collections.abc import Iterable
from typing import Any

import numpy as np

#: Digits that a name begins with: three is "3", not "3.0".
_FEWEST = 6
#: Digits that tell any two floats apart.
_MOST = 17
#: A number that needs more digits than this was computed, not typed: 16 of them in a label are noise, 13 are hard to read.
_TYPED = 12


def exact_text(value: float) -> str:
    """Return the shortest text, of six digits or more, that is read back as the same number.

    Examples
    --------
    >>> exact_text(3.0), exact_text(0.3000001), exact_text(0.1 + 0.2)
    ('3', '0.3000001', '0.30000000000000004')
    """
    number = float(value)
    texts = (f"{number:.{digits}g}" for digits in range(_FEWEST, _MOST + 1))
    return next((text for text in texts if float(text) == number), repr(number))


def value_names(values: Iterable[float]) -> dict[float, str]:
    """Return the different values in order, each with a text of its own.

    The text is exact for a number of up to twelve digits. One that needs more has six, or all where six are the text of another
    value.

    Examples
    --------
    >>> value_names([3.0, 3.0000001, 2 / 3, 3.0])
    {3.0: '3', 3.0000001: '3.0000001', 0.6666666666666666: '0.666667'}
    >>> list(value_names([2 / 3, 0.666667]).values())
    ['0.6666666666666666', '0.666667']
    """
    names = {}
    for value in values:
        names[value] = exact_text(value) if float(f"{value:.{_TYPED}g}") == value else f"{value:.{_FEWEST}g}"
    count = Counter(names.values())
    return {value: name if count[name] == 1 else exact_text(value) for value, name in names.items()}


#: Least similarity of two names, as difflib measures it, from 0 to 1. At 0.5 'mesh' is offered for 'm5'; at 0.8 nothing is
#: offered for 'rum', which is close to 'run' (0.67).
_ALIKE = 0.65


def meant(name: str, known: Iterable[str]) -> str:
    """Return `` (did you mean ...?)`` with the known name that is most like this one, '' if none is.

    Examples
    --------
    >>> meant("degre", ["degree", "intervals"]), meant("colour", ["degree", "intervals"])
    (" (did you mean 'degree'?)", '')
    """
    import difflib  # 5 ms, which only a mistake needs

    names = {one.lower(): one for one in known}
    found = difflib.get_close_matches(name.lower(), names, 1, _ALIKE)
    return f" (did you mean {names[found[0]]!r}?)" if found else ""


def one_of(name: object, known: Iterable[str], what: str = "") -> str:
    """Return that a name must be one of the known ones, with the one that is most like it; ``what`` stands before them.

    Examples
    --------
    >>> one_of("degre", ["degree", "intervals"])
    "'degre' (did you mean 'degree'?) must be one of degree, intervals"
    """
    return f"{name!r}{meant(str(name), known)} must be one of {what}{', '.join(known) or 'none: there are none'}"


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


class Shown:
    """What shows itself so: a base class of dataclasses with ``repr=False``."""

    __repr__ = shown


def _text(value: object) -> str:
    """Return a value behind the name of its field."""
    if isinstance(value, np.ndarray):
        return f": array {value.shape}"
    if callable(value) and not hasattr(type(value), "_fields"):
        return f": {getattr(value, '__name__', type(value).__name__).strip('<>')}"
    text = repr(value)
    return f"={text}" if len(text) <= WIDTH and " at 0x" not in text else f": {type(value).__name__}"
