"""Numbers in names of points, files and nodes of graphs: two different numbers never give the same text."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable

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
        typed = float(f"{value:.{_TYPED}g}") == value
        names[value] = exact_text(value) if typed else f"{value:.{_FEWEST}g}"
    count = Counter(names.values())
    return {value: name if count[name] == 1 else exact_text(value) for value, name in names.items()}
