"""Calls of version 0.2, in which the parameters of a law were two arguments, nu and Gamma: they work for one version."""

from __future__ import annotations

import functools
import inspect
import warnings
from collections.abc import Callable
from typing import TypeVar

Function = TypeVar("Function", bound=Callable)


def takes_parameters(function: Function) -> Function:
    """Return a function with an argument ``parameters`` that also takes nu there, and Gamma (or ``width``) at the end."""
    names = list(inspect.signature(function).parameters)
    place, count = names.index("parameters"), len(names)

    @functools.wraps(function)
    def called(*given, **options):
        old = {"nu", "Gamma", "width"} & set(options)
        if not old and len(given) <= count:
            return function(*given, **options)
        warnings.warn(f"{function.__name__}: nu and Gamma are parameters={{...}} now", DeprecationWarning, stacklevel=2)
        values = {"Gamma": options.pop("Gamma", options.pop("width", None)), "nu": options.pop("nu", None)}
        if len(given) > count:
            *given, values["Gamma"] = given
        before, after = given[:place], given[place:]
        if "nu" not in old:
            values["nu"], *after = after
        return function(*before, values, *after, **options)

    return called
