"""The gradient of a scalar function as a function of the same arguments."""

from __future__ import annotations

import inspect
from collections.abc import Callable, Sequence

from contin import errors as checks
from contin.errors import ProblemError
from contin.functions import derivatives
from contin.functions.recorded_arrays import NUMPY
from contin.functions.recording import recorded_paths
from contin.functions.stand_ins import RecordedFunction
from contin.functions.tape import Tape, Unrecordable


@checks.arguments
def gradient(function: Callable[..., float], by: Sequence[str]) -> Callable[..., tuple[float, ...]]:
    """Return the function of (value, derivatives by some arguments), with the arguments of ``function``.

    The derivatives are exact: the function is recorded and differentiated. The result can be used inside functions of a
    problem.

    Parameters
    ----------
    function : callable
        A plain Python function of numbers; it may call others that are.
    by : sequence of str
        The arguments to differentiate by.

    Raises
    ------
    ProblemError
        It cannot be recorded.

    Examples
    --------
    >>> gradient(lambda x, y: x**2 * y, ["x", "y"])(3.0, 2.0)
    (18.0, 12.0, 9.0)
    """
    arguments = list(inspect.signature(function).parameters)
    by = checks.chosen("by", by, arguments)
    tape = Tape(NUMPY)
    inputs = [tape.input(("argument", name)) for name in arguments]  # apart from "t", the slot of the time
    try:
        (value,) = recorded_paths(tape, function, lambda copy: [copy(*inputs)])
    except Unrecordable as reason:
        raise ProblemError(f"{getattr(function, '__name__', 'function')} cannot be differentiated: {reason}") from None
    found = derivatives.jacobian(tape, [value], [inputs[arguments.index(name)].place for name in by])
    results = [value, *(found.get((0, number), tape.constant(0.0)) for number in range(len(by)))]
    return RecordedFunction("gradient", arguments, [None] * len(arguments), tape, [each.place for each in inputs], results)
