"""The name that was probably meant where an unknown one is given: of a command, an option, a field, a file."""

from __future__ import annotations

import difflib
from collections.abc import Iterable

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
    names = {one.lower(): one for one in known}
    found = difflib.get_close_matches(name.lower(), names, 1, _ALIKE)
    return f" (did you mean {names[found[0]]!r}?)" if found else ""
