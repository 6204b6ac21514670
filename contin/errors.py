"""Exceptions, one sentence each, and checks of what users hand over, which raise them."""

from __future__ import annotations

import collections.abc
import functools
import inspect
import math
import os
import sys
import types
import typing
import warnings
from collections.abc import Callable, Iterable, Mapping, Sequence
from pathlib import Path
from typing import Annotated, Any, NamedTuple, ParamSpec, TypeGuard, TypeVar, cast

import numpy as np

from contin.arrays import Array
from contin.text import ROWS, exact_text, meant

#: Names of modules of the package begin with this.
_PACKAGE = __name__.partition(".")[0] + "."


class ContinError(Exception):
    """Base of all errors raised on purpose.

    Examples
    --------
    >>> import contin
    >>> try:
    ...     contin.Settings(step=-1)
    ... except contin.ContinError as error:
    ...     print(error)
    step: -1 must be a number between 0 and inf
    """


class ProblemError(ContinError, ValueError):
    """The statement of a problem is not usable; the message names the field, the value and what is allowed.

    Examples
    --------
    >>> import contin
    >>> try:
    ...     contin.Settings(limits={"a": 3})
    ... except contin.ProblemError as error:
    ...     print(error)
    limits: a: 3 must be a list of two numbers, the first the smaller
    """


class InterpretedWarning(UserWarning):
    """A function cannot be recorded and is evaluated in Python; the message says why, and what it costs."""


class ConvergenceError(ContinError, ArithmeticError):
    """Newton's method did not converge; the message holds the last residuals and what to change.

    Examples
    --------
    >>> import contin
    >>> nowhere = contin.AlgebraicProblem(lambda u, p: (p.a + u.x**2,), ["x"], {"a": 1.0})
    >>> try:
    ...     contin.solve(nowhere, [0.5])
    ... except contin.ConvergenceError:
    ...     print("there is no solution near by")
    there is no solution near by
    """


class Grazing(ConvergenceError):
    """A step has come to a solution that crosses more or fewer jumps; ``at_end``: its first or last piece vanishes."""

    at_end = False


def warn(text: str, category: type[Warning]) -> None:
    """Warn at the line outside the package from which it was called, however deep inside it this is."""
    frame, level = sys._getframe(1), 2
    while frame.f_back is not None and f"{frame.f_globals.get('__name__', '')}.".startswith((_PACKAGE, "functools.")):
        frame, level = frame.f_back, level + 1
    warnings.warn(text, category, stacklevel=level)


_Given = ParamSpec("_Given")
_Result = TypeVar("_Result")
#: Characters of a value that a message shows: with the rest of the sentence it fits on one line.
_SHOWN = 60


def listed(names: Iterable[str]) -> str:
    """Return names as a message shows them: the first of many."""
    found = list(names)
    more = f" and {len(found) - ROWS} more" if len(found) > ROWS else ""
    return ", ".join(found[:ROWS]) + more


def shown(value: object) -> str:
    """Return the value in one short line."""
    try:
        with np.printoptions(threshold=_SHOWN, edgeitems=_SHOWN // 4):  # all of a large array takes 10 ms
            text = " ".join(repr(value).split())
    except Exception:  # an integer of too many digits, or an object whose repr is broken
        text = f"a value of type {type(value).__name__}"
    return text if len(text) <= _SHOWN else text[: _SHOWN - 3] + "..."


def plain(name: str) -> str:
    """Return a name that may be any text: as it is, or in quotes."""
    return name if name.isidentifier() else shown(name)


def is_number(value: object) -> TypeGuard[float]:
    """Return whether a value is a real number; NaN and infinity are, True, False and integers beyond all floats are not."""
    if isinstance(value, int):
        return not isinstance(value, bool) and abs(value) <= sys.float_info.max
    return isinstance(value, (float, np.integer, np.floating))


def number(what: str, value: object, low: float = -math.inf, high: float = math.inf) -> None:
    """Require a number strictly between ``low`` and ``high``."""
    if not (is_number(value) and low < value < high):
        bounds = "a finite number" if math.inf == high == -low else f"a number between {exact_text(low)} and {exact_text(high)}"
        raise ProblemError(f"{what}: {shown(value)} must be {bounds}")


def whole(what: str, value: object, low: int, high: int) -> None:
    """Require a whole number from ``low`` to ``high``."""
    if isinstance(value, bool) or not isinstance(value, (int, np.integer)) or not low <= value <= high:
        raise ProblemError(f"{what}: {shown(value)} must be a whole number from {low} to {high}")


def truth(what: str, value: object) -> None:
    """Require True or False."""
    if not isinstance(value, (bool, np.bool_)):
        raise ProblemError(f"{what}: {shown(value)} must be True or False")


def instance(what: str, value: object, kind: type | tuple[type, ...], called: str) -> None:
    """Require an object of a class; ``called`` names it in the message."""
    if not isinstance(value, kind):
        raise ProblemError(f"{what}: {shown(value)} must be {called}")


def function(what: str, value: object) -> Callable[..., Any]:
    """Require something that can be called, and return it."""
    if not callable(value):
        raise ProblemError(f"{what}: {shown(value)} must be a function")
    return value


def mapping(what: str, value: object, holds: str) -> Mapping[str, Any]:
    """Require a mapping from names to what it ``holds``, and return it."""
    if not isinstance(value, Mapping) or not all(isinstance(name, str) for name in value):
        raise ProblemError(f"{what}: {shown(value)} must be a dict from names to {holds}")
    return value


def sequence(what: str, value: object, holds: str) -> Sequence[Any]:
    """Require a list, a tuple or an array of one dimension, and return it; text is none of them."""
    array = isinstance(value, np.ndarray) and value.ndim == 1
    if not array and (not isinstance(value, Sequence) or isinstance(value, (str, bytes))):
        raise ProblemError(f"{what}: {shown(value)} must be a list of {holds}")
    return cast(Sequence[Any], value)


def names(what: str, value: object) -> tuple[str, ...]:
    """Require a list of names, and return it as a tuple."""
    found = tuple(sequence(what, value, "names"))
    if not all(isinstance(name, str) for name in found):
        raise ProblemError(f"{what}: {shown(value)} must be a list of names")
    return found


def chosen(what: str, value: object, known: Sequence[str]) -> tuple[str, ...]:
    """Require different names among those that are known, and return them."""
    found = names(what, value)
    for name in found:
        if name not in known:
            near = meant(name, known)
            raise ProblemError(f"{what}: {shown(name)} must be one of {listed(known) or 'none, as there are none here'}{near}")
        if found.count(name) > 1:
            raise ProblemError(f"{what}: {plain(name)} is given twice")
    return found


def array(what: str, value: object, shape: tuple[int, ...]) -> Array:
    """Require finite numbers of a shape, and return them as an array."""
    try:
        found = np.asarray(value, dtype=float)
    except (TypeError, ValueError, OverflowError):
        raise ProblemError(f"{what}: {shown(value)} must be numbers") from None
    if found.shape != shape or not np.isfinite(found).all():
        raise ProblemError(f"{what}: {shown(value)} must be {' x '.join(map(str, shape))} finite numbers")
    return found


# --- the arguments of a public function ---------------------------------------------------------------------------------------


class Within(NamedTuple):
    """Bounds in an annotation, as ``Annotated[int, Within(1, 8)]``: as of `number` and, of an int, `whole`."""

    low: float = -math.inf
    high: float = math.inf


Positive = Annotated[float, Within(0)]


def arguments(function: Callable[_Given, _Result]) -> Callable[_Given, _Result]:
    """Return a public function that compares its arguments with its annotations before it runs.

    A wrong one is a `ProblemError` that names it; so is a keyword that there is not, with the one that was probably meant. What
    annotations do not say, the function itself checks.

    Examples
    --------
    >>> @arguments
    ... def half(number: float, times: int = 1) -> float:
    ...     return number / 2**times
    >>> half("three")
    Traceback (most recent call last):
    contin.errors.ProblemError: number: 'three' must be a number
    """

    @functools.wraps(function)
    def checked(*given: _Given.args, **named: _Given.kwargs) -> _Result:
        hints, names = _annotations(function)
        refuse_unknown(function, named)
        for name, value in (*zip(names, given), *named.items()):
            if name in hints and not hints[name][0](value):
                raise ProblemError(_refusal(name, value, hints[name][1]))
        return function(*given, **named)

    return checked


@functools.cache
def _keywords(function: Callable[..., Any]) -> list[str] | None:
    """Return the names of the arguments of a function, with those of a TypedDict behind ``**``; None where these may be any."""
    found: list[str] = []
    for name, one in inspect.signature(function).parameters.items():
        more = typing.get_args(typing.get_type_hints(function).get(name)) if one.kind is one.VAR_KEYWORD else ()
        if one.kind is one.VAR_KEYWORD and not more:
            return None
        found += more[0].__annotations__ if more else [name]
    return [name for name in found if name != "self"]


def refuse_unknown(function: Callable[..., Any], named: Iterable[str]) -> None:
    """Require that keywords are arguments of a function."""
    known = _keywords(function)
    for name in named:
        if known is not None and name not in known:
            raise ProblemError(f"there is no argument {name!r}{meant(name, known)}; known are {listed(known)}")


class Named:
    """A class whose keywords are compared with the arguments of its constructor, as `arguments` does."""

    def __new__(cls, *given: object, **named: object) -> Any:
        """Compare the keywords."""
        refuse_unknown(cls.__init__, named)
        return super().__new__(cls)


def fields(record: object) -> None:
    """Require that the fields of a dataclass that were given are what their annotations say."""
    hints, _ = _annotations(cast(Any, type(record)))
    defaults = vars(type(record))
    for name, value in vars(record).items():
        if (name not in defaults or value is not defaults[name]) and name in hints and not hints[name][0](value):
            raise ProblemError(_refusal(name, value, hints[name][1]))


@functools.cache
def _annotations(annotated: object) -> tuple[dict[str, tuple[Callable[[Any], bool], Any]], Sequence[str]]:
    """Return by name what `_fits` says of an argument or a field of a class, and its type; names of those given by place."""
    code, hints = getattr(annotated, "__code__", None), typing.get_type_hints(annotated, include_extras=True)
    return {name: (_fits(kind), kind) for name, kind in hints.items()}, code.co_varnames[: code.co_argcount] if code else ()


#: What a value of a plain type is called, and whether a value is one.
_PLAIN: dict[Any, tuple[str, Callable[[Any], bool]]] = {
    float: ("a number", is_number),
    int: ("a whole number", lambda value: isinstance(value, (int, np.integer)) and not isinstance(value, bool)),
    bool: ("True or False", lambda value: isinstance(value, (bool, np.bool_))),
    str: ("a name", lambda value: isinstance(value, str)),
    Path: ("a path", lambda value: isinstance(value, os.PathLike)),
    **dict.fromkeys((Any, object), ("anything", lambda value: True)),
}


def _is_list(value: object) -> bool:
    array = isinstance(value, np.ndarray) and value.ndim == 1
    return array or (isinstance(value, Sequence) and not isinstance(value, (str, bytes)))


@functools.cache
def _fits(kind: Any) -> Callable[[Any], bool]:
    """Return the function that says whether a value may stand where an annotation is; an array is a list."""
    outer, inner = typing.get_origin(kind), typing.get_args(kind)
    if hasattr(kind, "__metadata__"):
        (low, high), is_real, plain = kind.__metadata__[0], kind.__origin__ is float, _PLAIN[kind.__origin__][1]
        return lambda value: plain(value) and (low < value < high if is_real else low <= value <= high)
    if kind in _PLAIN:
        return _PLAIN[kind][1]
    if outer is collections.abc.Callable:
        return callable
    if outer is np.ndarray:
        return lambda value: isinstance(value, (np.ndarray, list, tuple))
    if outer not in (typing.Union, types.UnionType, collections.abc.Mapping, collections.abc.Sequence, tuple):
        return lambda value: isinstance(value, outer or kind)
    each = [*map(_fits, inner)]
    if outer in (typing.Union, types.UnionType):
        return lambda value: any(fits(value) for fits in each)
    if outer is collections.abc.Mapping:
        return lambda value: isinstance(value, Mapping) and all(map(each[0], value)) and all(map(each[1], value.values()))
    if outer is tuple and inner[-1] is not ...:
        return lambda value: _is_list(value) and len(value) == len(each) and all(fits(one) for fits, one in zip(each, value))
    return lambda value: _is_list(value) and all(map(each[0], value))


def _refusal(what: str, value: Any, kind: Any) -> str:
    """Return why a value may not stand where an annotation is, "" if it may: the first entry that is wrong, or all of it."""
    if _fits(kind)(value):
        return ""
    outer, inner = typing.get_origin(kind), typing.get_args(kind)
    inside, others = iter(list[str]()), [each for each in inner if each is not types.NoneType]
    if hasattr(kind, "__metadata__"):
        (number if kind.__origin__ is float else whole)(what, value, *kind.__metadata__[0])
    elif outer in (typing.Union, types.UnionType) and value is not None and len(others) == 1:
        inside = iter([_refusal(what, value, others[0])])
    elif outer is collections.abc.Mapping and isinstance(value, Mapping) and all(map(_fits(inner[0]), value)):
        inside = (_refusal(f"{what}: {name}", each, inner[1]) for name, each in value.items())
    elif outer in (collections.abc.Sequence, tuple) and _is_list(value):
        kinds = inner if outer is tuple and inner[-1] is not ... else [inner[0]] * len(value)
        inside = (_refusal(what, *pair) for pair in zip(value, kinds) if len(value) == len(kinds))
    return next(filter(None, inside), f"{what}: {shown(value)} must be {_words(kind)}")


def _words(kind: Any) -> str:
    """Return what may stand where an annotation is."""
    kind = getattr(kind, "__origin__", kind) if hasattr(kind, "__metadata__") else kind  # a number within bounds
    outer, inner = typing.get_origin(kind), typing.get_args(kind)
    if kind in _PLAIN:
        return _PLAIN[kind][0]
    if outer in (typing.Union, types.UnionType):
        return " or ".join(dict.fromkeys(_words(each) for each in inner if each is not type(None)))
    if outer is collections.abc.Callable:
        return "a function"
    if outer is collections.abc.Mapping:
        return f"a dict from {_several(inner[0])} to {_several(inner[1])}"
    if outer is np.ndarray:
        return "an array"
    if outer in (collections.abc.Sequence, tuple):
        count = f"{len(inner)} " * (outer is tuple and inner[-1] is not ...)
        return "a list" if inner[0] is Any else f"a list of {count}{_several(inner[0])}"
    name = (outer or kind).__name__
    return f"{'an' if name[0] in 'AEIOU' else 'a'} {name}"


def _several(kind: object) -> str:
    return f"{_words(kind).partition(' ')[2]}s"
