"""Arguments and results of a user's functions: their names, their numbers, and the ways in which functions take them."""

from __future__ import annotations

import functools
import inspect
import math
from collections import namedtuple
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from contin import errors as checks
from contin.arrays import Function
from contin.errors import ProblemError

#: Names of the arguments of a function that are named tuples; None for one that is a number, a list for a tuple of them.
Arguments = Sequence[tuple[str, ...] | list[Any] | None]
#: Makes an array of a list of numbers.
Maker = Callable[[Any], Any]


@dataclass(frozen=True)
class Signature:
    """Arguments of a function of a point: f(t, u, p), f(u, p), or f(u, v, p) of the states at both ends.

    - ``states``, ``parameters`` (tuple of str): Names of the components of u (and v), and of p.
    - ``times`` (bool): t is the first argument.
    - ``ends`` (bool): v follows u; there is no t then.
    """

    states: tuple[str, ...]
    parameters: tuple[str, ...]
    times: bool = True
    ends: bool = False

    @property
    def arguments(self) -> list[tuple[str, ...] | None]:
        """Names of the components of each argument; None for t."""
        before: list[tuple[str, ...] | None] = [None] if self.times else []
        return [*before, *[self.states] * (1 + self.ends), self.parameters]

    @property
    def inputs(self) -> int:
        """Number of components of u, v and p."""
        return len(self.states) * (1 + self.ends) + len(self.parameters)

    def fills(self, function: Function) -> bool:
        """Return whether a function has one argument more: an array that it fills."""
        return argument_count(function) == len(self.arguments) + 1


class UserFunction:
    """A user's function with the way in which it takes its arguments.

    - ``function`` (callable): It takes named tuples; or arrays of states, and parameters as a named tuple; or arrays, and one
      more that it fills.
    - ``arguments`` (sequence): Names of the components of each argument.
    - ``count`` (int): Number of values; 0 for one number that is no tuple.
    """

    def __init__(self, function: Function, arguments: Arguments, count: int) -> None:
        self.function, self.arguments, self.count, self.size = function, arguments, count, max(count, 1)
        self.fills = argument_count(function) == len(arguments) + 1
        self._arrays = len(arguments) if self.fills else len(arguments) - 1 if takes_arrays(function, arguments) else 0

    def __repr__(self) -> str:
        return f"{type(self).__name__}({self.name})"

    @property
    def name(self) -> str:
        """How messages name it."""
        return str(getattr(self.function, "__name__", None) or checks.shown(self.function))

    def call(self, numbers: Sequence[Any], array: Maker, copy: Function | None = None, shape: tuple[int, ...] = ()) -> Any:
        """Return what the function, or a copy of it, returns for the components of its arguments one after the other.

        ``array`` makes the arrays that it takes; ``shape`` is that of a component.
        """
        given = _grouped(self.arguments, iter(numbers), array, self._arrays)
        function = self.function if copy is None else copy
        if not self.fills:
            return function(*given)
        filled = array(np.zeros((self.size, *shape)))
        function(*given, filled)
        return filled

    def values(self, numbers: Sequence[Any], array: Maker, copy: Function | None = None) -> list[Any]:
        """Return the values for plain or recorded numbers, as `call`."""
        found = flat(self.call(numbers, array, copy))
        return list(found) if self.count or self.fills else [found]


def flat(result: object) -> Any:
    """Return what a function returns, an array as a list or a number."""
    if isinstance(result, np.ndarray):
        return result.ravel().tolist() if result.ndim else result.item()
    return result


def _grouped(arguments: Arguments, numbers: Iterator[Any], array: Maker, arrays: int) -> list[Any]:
    """Return arguments made of their components, the first ``arrays`` of them as arrays."""
    given: list[Any] = []
    for place, names in enumerate(arguments):
        if names is None:
            given.append(next(numbers))
        elif isinstance(names, list):
            given.append(tuple(_grouped(names, numbers, array, 0)))
        elif place < arrays:
            given.append(array([next(numbers) for _ in names]))
        else:
            given.append(named_values(tuple(names))(*[next(numbers) for _ in names]))
    return given


def component_count(names: Any) -> int:
    """Return the number of components of an argument, or of several."""
    return 1 if names is None else sum(map(component_count, names)) if isinstance(names, list) else len(names)


def argument_count(function: Function) -> int:
    """Return how many arguments of a user's function have no default; raise ProblemError if it is none, or does not say."""
    try:
        given = inspect.signature(getattr(function, "py_func", function)).parameters.values()
    except (TypeError, ValueError):
        raise ProblemError(f"{checks.shown(function)} must be a Python function that says which arguments it takes") from None
    return sum(each.default is each.empty and each.kind not in (each.VAR_POSITIONAL, each.VAR_KEYWORD) for each in given)


@functools.lru_cache(256)
def named_values(names: tuple[str, ...]) -> Any:
    """Return the class of the named tuples that users' functions get: ``u.x``, ``u["x"]``, ``u[0]`` and ``x, y = u``.

    They are no arrays: ``2 * u`` and ``u + v`` would repeat and append a tuple, so they are errors.

    Examples
    --------
    >>> u = named_values(("x", "y"))(1.0, 2.0)
    >>> u.y, u["y"], u[1], u[:1]
    (2.0, 2.0, 2.0, (1.0,))
    """
    fields: Any = namedtuple("Values", list(names))  # type: ignore[misc]  # noqa: PYI024

    class Values(_NoArray, fields):
        __slots__ = ()

        def __getitem__(self, key: Any) -> Any:
            if isinstance(key, str):
                if key in self._fields:
                    return getattr(self, key)
                raise KeyError(key)
            found = tuple.__getitem__(self, key)
            return _NoArray(found) if isinstance(key, slice) else found

    return Values


class _NoArray(tuple[Any, ...]):
    """A tuple that refuses what means something else for an array."""

    __slots__ = ()

    def _refuse(self, *_: object) -> Any:
        raise TypeError("a tuple is no array")

    __add__ = __radd__ = __mul__ = __rmul__ = _refuse


def takes_arrays(function: Function, arguments: Arguments) -> bool:
    """Return whether a function has no value for states as named tuples, and has one for states as arrays."""
    for arrays in (False, True):
        try:
            returned(function, arguments, arrays, "")
        except Exception:  # noqa: S112  # a user's function may raise anything
            continue
        return arrays
    return False


def returned(function: Function, arguments: Arguments, arrays: bool, what: str) -> int:
    """Return how many values a call returns, with states as named tuples or as arrays; parameters, the last, are named."""
    plain = getattr(function, "py_func", function)
    first: Exception | None = None
    for number in PROBES:
        numbers = [number + 0.01 * i for names in arguments for i in range(component_count(names))]
        try:
            with np.errstate(all="ignore"):
                result = plain(*_grouped(arguments, iter(numbers), np.array, len(arguments) - 1 if arrays else 0))
        except ABSENT as error:  # it may have values elsewhere
            first = first or error
            continue
        if isinstance(result, (dict, set, str)):
            raise ProblemError(f"{what} returns a {type(result).__name__}, must return numbers in the order of their equations")
        found = flat(result)
        return len(found) if isinstance(found, (tuple, list)) else 0
    assert first is not None
    raise first


#: Numbers with which functions are called to see what they return: in the domain of most functions, and of tables. NaN, the
#: last, is in the domain of all, but a search may not end for it.
PROBES = (0.5, 1.5, -0.5, 0.0, 10.0, 3.0, 30.0, 100.0, 300.0, 1e3, 0.1, 1e4, 1e5, math.nan)
#: Errors that a function raises where it has no value, such as outside a table.
ABSENT = (ArithmeticError, ValueError, RuntimeError)
