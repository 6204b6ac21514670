"""Statement of a problem: the protocol that every kind of problem follows, and checks of names and values."""

from __future__ import annotations

import keyword
import math
from collections.abc import Mapping, Sequence
from typing import Any, Protocol

import numpy as np

from contin import checks
from contin.arrays import Function
from contin.errors import ProblemError
from contin.functions.batch import Batch

#: More states than any mesh has room for.
_MOST_STATES = 10_000


def check_names(kind: str, names: Sequence[str]) -> tuple[str, ...]:
    """``names`` as a tuple, or a `ProblemError` that says which one cannot be used."""
    names = tuple(checks.sequence(kind, names, "names"))
    for name in names:
        if not isinstance(name, str) or not name.isidentifier() or keyword.iskeyword(name) or name.startswith("_"):
            raise ProblemError(
                f"{kind}: {checks.shown(name)} is not usable as a name (a Python identifier, no keyword, no leading _)"
            )
        if names.count(name) > 1:
            raise ProblemError(f"{kind}: the name {name!r} stands twice")
    return names


def check_statement(
    states: Sequence[str] | int, parameters: Mapping[str, float], functionals: Mapping[str, Function]
) -> tuple[str, ...]:
    """The names of states (u0, u1, ... for a number), after names and values of a problem were checked."""
    if isinstance(states, (int, np.integer)):
        checks.whole("states", states, 1, _MOST_STATES)
        states = [f"u{i}" for i in range(states)]
    names = check_names("states", states)
    if not 1 <= len(names) <= _MOST_STATES:
        raise ProblemError(f"states: there must be at least one, and at most {_MOST_STATES}")
    check_names("parameters", tuple(checks.mapping("parameters", parameters, "numbers")))
    check_names("functionals", [*checks.mapping("functionals", functionals, "functions"), *parameters])
    for name, value in parameters.items():
        if not checks.is_number(value) or not math.isfinite(value):
            raise ProblemError(f"parameters: {name} = {checks.shown(value)} must be a finite number")
    for name, function in functionals.items():
        checks.function(f"functionals: {name}", function)
    return names


class Statement(Protocol):
    """A problem as the user states it."""

    @property
    def states(self) -> Any:
        """Names of the states, a tuple."""

    @property
    def parameters(self) -> Mapping[str, float]:
        """Names and default values of the parameters."""

    @property
    def functionals(self) -> Mapping[str, Function]:
        """Names and functions of further columns."""

    @property
    def free_size(self) -> int:
        """Number of free parameters on a curve of solutions."""

    def batch(self, name: str) -> Batch:
        """Some of the functions, compiled."""
