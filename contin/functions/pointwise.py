"""Functions of a point that need numbers found by iteration there: the iteration runs once, not for each derivative."""

from __future__ import annotations

import inspect
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

from contin import checks
from contin.arrays import Function


@dataclass(frozen=True)
class Pointwise:
    """A function ``f(t, u, p)`` made of ``function(t, u, p, w)`` and ``w = solve(t, u, p)``, which iterates.

    Use it for an implicit law: w solves g(w; t, u, p) = 0 at each point. Value and derivatives of a point share one w. They
    are exact if ``function`` begins with one step of Newton's method from w, because derivatives are taken with complex
    numbers: t, u and p of ``solve`` are real, those of ``function`` have imaginary parts, which the step carries along
    (implicit function theorem).

    Attributes
    ----------
    function : callable
        Plain Python, with the arguments of the function that it stands for and w, the tuple that ``solve`` returns.
    solve : callable
        Plain Python; returns a tuple of real numbers.

    Raises
    ------
    ProblemError
        One of them is no function.

    Examples
    --------
    The rate w of w + w**3 = u:

    >>> import numpy as np
    >>> from contin import Batch
    >>> def solve(t, u, p):
    ...     w = 0.0
    ...     for _ in range(50):
    ...         w = w - (w + w**3 - u.u) / (1 + 3 * w * w)
    ...     return (w,)
    >>> def rate(t, u, p, w):
    ...     return (w[0] - (w[0] + w[0] ** 3 - u.u) / (1 + 3 * w[0] * w[0]),)
    >>> batch = Batch([Pointwise(rate, solve)], [1], ["u"], [])
    >>> values, jacobian = batch.jacobian(np.zeros(1), np.array([[10.0]]), np.empty((0, 1)), np.empty(0), batch.colouring([]))
    >>> print(values[0, 0], 1 / jacobian[0, 0, 0])  # 2 + 2**3 = 10, and 1 + 3 * 2**2
    2.0 13.0
    """

    function: Function
    solve: Function

    def __post_init__(self) -> None:
        checks.function("function", self.function)
        checks.function("solve", self.solve)

    def __call__(self, *arguments: Any) -> Any:
        """Return the value at one point, in plain Python."""
        return self.function(*arguments, self.solve(*map(_real, arguments)))

    @property
    def __name__(self) -> str:
        return str(getattr(self.function, "__name__", self.function))

    @property
    def __signature__(self) -> inspect.Signature:
        return inspect.Signature(list(inspect.signature(self.function).parameters.values())[:-1])


def parts(function: Function) -> tuple[Function, Function | None]:
    """Return the function that is evaluated for each derivative, and the one that is evaluated once a point, or None."""
    return (function.function, function.solve) if isinstance(function, Pointwise) else (function, None)


def searches(functions: Sequence[Function]) -> list[Function]:
    """Return the functions that are evaluated once a point, each once."""
    found = (parts(function)[1] for function in functions)
    return list(dict.fromkeys(solve for solve in found if solve is not None))


def _real(argument: Any) -> Any:
    return type(argument)(*(number.real for number in argument)) if isinstance(argument, tuple) else argument.real
