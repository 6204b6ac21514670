"""The statement of a problem: the protocol that every kind of problem follows, and checks of names and values."""

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

#: Bounds on numbers that a user gives, so that a slip of the keyboard is a sentence and not a full memory.
_MOST_STATES = 10_000
MOST_CONDITIONS = 100_000


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
        """Return some of the functions, compiled."""


class Restated:
    """A statement that survives pickling: it is stated again with its arguments, and compiled code comes from the cache."""

    _stated: tuple[tuple[Any, ...], dict[str, Any]]

    def __new__(cls, *arguments: Any, **options: Any) -> Any:
        """Note the arguments."""
        made = super().__new__(cls)
        object.__setattr__(made, "_stated", (arguments, options))
        return made

    def __reduce__(self) -> Any:
        return _restated, (type(self), *self._stated)


def _restated(kind: Any, arguments: tuple[Any, ...], options: dict[str, Any]) -> Any:
    return kind(*arguments, **options)


def forget_changed(problem: Any) -> bool:
    """Forget compiled functions that read constants which have changed since; return whether there were any.

    A program may assign a global constant, an attribute of an object or an entry of a dictionary between two runs.
    """
    batches: dict[str, Batch] = getattr(problem, "_batches", {})
    changed = [name for name, batch in batches.items() if not batch.is_current()]
    for name in changed:
        del batches[name]
    return bool(changed)


def with_multipliers(problem: Statement, free: Sequence[str]) -> tuple[str, ...]:
    """Return the free parameters with those that a problem adds by itself: its ``multipliers``, if it has any."""
    names = checks.names("free", free)
    return (*names, *(name for name in multipliers_of(problem) if name not in names))


def multipliers_of(problem: Statement) -> tuple[str, ...]:
    """Return the parameters that are free on every curve of a problem, and need not be named."""
    names: tuple[str, ...] = getattr(problem, "multipliers", ())
    return names


def check_statement(
    states: Sequence[str] | int, parameters: Mapping[str, float], functionals: Mapping[str, Function]
) -> tuple[str, ...]:
    """Check names and values of a problem, and return the names of its states (u0, u1, ... for a number of states).

    Raises
    ------
    ProblemError
    """
    if isinstance(states, (int, np.integer)):
        checks.whole("states", states, 1, _MOST_STATES)
        states = [f"u{i}" for i in range(states)]
    names = _usable("states", states)
    if not 1 <= len(names) <= _MOST_STATES:
        raise ProblemError(f"states: there must be at least one, and at most {_MOST_STATES}")
    _usable("parameters", tuple(checks.mapping("parameters", parameters, "numbers")))
    _usable("functionals", [*checks.mapping("functionals", functionals, "functions"), *parameters])
    for name, value in parameters.items():
        if not checks.is_number(value) or not math.isfinite(value):
            raise ProblemError(f"parameters: {name} = {checks.shown(value)} must be a finite number")
    for name, function in functionals.items():
        checks.function(f"functionals: {name}", function)
    return names


def _usable(kind: str, names: Sequence[str]) -> tuple[str, ...]:
    """Return names as a tuple.

    Raises
    ------
    ProblemError
        One cannot be a field of a named tuple, or stands twice.
    """
    names = tuple(checks.sequence(kind, names, "names"))
    for name in names:
        if not isinstance(name, str) or not name.isidentifier() or keyword.iskeyword(name) or name.startswith("_"):
            raise ProblemError(
                f"{kind}: {checks.shown(name)} is not usable as a name (a Python identifier, no keyword, no leading _)"
            )
        if names.count(name) > 1:
            raise ProblemError(f"{kind}: the name {name!r} stands twice")
    return names
