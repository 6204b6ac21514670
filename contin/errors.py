"""The exceptions of contin: one sentence each, fit to be shown to a user as it is."""

from __future__ import annotations

import sys
import warnings

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


def warn(text: str, category: type[Warning]) -> None:
    """Warn at the line outside the package from which it was called, however deep inside it this is."""
    frame, level = sys._getframe(1), 2
    while frame.f_back is not None and f"{frame.f_globals.get('__name__', '')}.".startswith((_PACKAGE, "functools.")):
        frame, level = frame.f_back, level + 1
    warnings.warn(text, category, stacklevel=level)
