"""Functions made from those of users; checks of vector fields u' = F(u, p), for orbits of all kinds."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from contin import checks
from contin.arrays import Function, Named
from contin.errors import ProblemError
from contin.functions.recording import result_count
from contin.functions.signature import Signature, argument_count, named_values, takes_arrays


def returning(field: Function, signature: Signature) -> Function:
    """Return a field that fills an array, or takes states as arrays only, as one of named values that returns the rates."""
    counted, wanted = argument_count(checks.function("field", field)), len(signature.arguments)
    if counted == wanted + 1:
        known, count = len(signature.parameters), len(signature.states)

        def rates(times: tuple[float, ...], u: Named, p: Named) -> Any:
            out = np.zeros(count)
            field(*times, np.array(list(u)), np.array(list(p)[:known]), out)
            return [out[i] for i in range(count)]

    elif counted == wanted and takes_arrays(field, signature.arguments):

        def rates(times: tuple[float, ...], u: Named, p: Named) -> Any:
            return field(*times, np.array(list(u)), p)

    elif counted == wanted and _unpacks(field, signature):
        own, known = named_values(signature.parameters), len(signature.parameters)

        def rates(times: tuple[float, ...], u: Named, p: Named) -> Any:
            return field(*times, u, own(*list(p)[:known]))

    else:
        return field
    returned: Function = (lambda t, u, p: rates((t,), u, p)) if signature.times else (lambda u, p: rates((), u, p))
    try:
        result_count(returned, signature.arguments, "field")
    except ProblemError:
        return field  # one of (t, u, p) in place of (u, p, out): `check_field` says so
    return returned


def _unpacks(field: Function, signature: Signature) -> bool:
    """Return whether a field takes its own parameters only, as `a, b = p` does, and not those that a kind of problem adds."""
    more = Signature(signature.states, (*signature.parameters, "one_more_"), times=signature.times)
    try:
        result_count(field, signature.arguments, "field")
    except ProblemError:
        return False
    try:
        result_count(field, more.arguments, "field")
    except ProblemError:
        return True
    return False


def check_field(field: Function, signature: Signature, wrong: str) -> None:
    """Check that a field takes these arguments and returns a value for each state; ``wrong`` is said of other arguments.

    Raises
    ------
    ProblemError
    """
    if argument_count(checks.function("field", field)) != len(signature.arguments):
        raise ProblemError(f"field: {wrong}")
    names, count = signature.states, result_count(field, signature.arguments, "field")
    if count != len(names):
        raise ProblemError(f"field returns {count} values for the {len(names)} states {', '.join(names)}")


def of_parameters(
    what: str, value: float | str | Function, parameters: Mapping[str, float], positive: bool = False
) -> Function:
    """Return a number, parameter or function of the parameters as a function of these; ``what`` names it in messages.

    Raises
    ------
    ProblemError
        It is none of these, or a number that is not positive where it must be.
    """
    if isinstance(value, str):
        if value not in parameters:
            raise ProblemError(f"{what}: {checks.shown(value)} is no parameter; there are {', '.join(parameters) or 'none'}")
        return _named(value)
    if callable(value):
        if argument_count(value) != 1:
            raise ProblemError(f"{what}: must be a function of p alone")
        return value
    checks.number(what, value, *([0] if positive else []))
    return _constant(float(value))


def _named(name: str) -> Function:
    return lambda p: getattr(p, name)


def _constant(value: float) -> Function:
    return lambda p: value


def scaled(field: Function, by: str, parts: int = 1) -> Function:
    """Return the right-hand side that is the field times a parameter, divided by a number of parts."""

    def rhs(t: float, u: Named, p: Named) -> Any:
        factor = getattr(p, by) / parts if parts > 1 else getattr(p, by)
        return [factor * rate for rate in field(u, p)]

    return rhs


def found_elsewhere(u: Named, p: Named) -> float:
    """Stand for a column that the discretized problem computes: it is no integral, and never called."""
    raise NotImplementedError


def combined(rows: Sequence[Sequence[float]], values: Sequence[Any]) -> list[Any]:
    """Return the products of rows and values; zeros and ones are not multiplied."""
    results = []
    for row in rows:
        terms = [value if factor == 1 else factor * value for factor, value in zip(row, values) if factor]
        results.append(sum(terms[1:], terms[0]))
    return results
