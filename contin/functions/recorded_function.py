"""A recording in place of the function that was recorded: it is called like one, can be pickled, and compares by value."""

from __future__ import annotations

import inspect
from collections.abc import Sequence
from typing import Any

import numpy as np

from contin.functions.recorded_arrays import recorded
from contin.functions.signature import Arguments
from contin.functions.tape import Tape


class RecordedFunction:
    """A function given by operations on a tape.

    Parameters
    ----------
    name : str
    names : sequence of str
        Of its arguments.
    arguments : sequence of tuple of str or None
        Names of the components of each argument; None for a number.
    tape : Tape
    inputs : sequence of int
        Places of all components of the arguments, in order.
    results : sequence of int
        Places of the values.
    single : bool
        It returns a number, not a tuple.
    """

    def __init__(
        self, name: str, names: Sequence[str], arguments: Arguments, tape: Tape, inputs: Sequence[int], results: Sequence[int],
        single: bool = False,
    ) -> None:  # fmt: skip
        self.__name__, self._names, self._arguments = name, tuple(names), tuple(arguments)
        self._tape, self._inputs, self._results, self._single = tape, tuple(inputs), tuple(results), single

    @property
    def __signature__(self) -> inspect.Signature:
        kind = inspect.Parameter.POSITIONAL_OR_KEYWORD
        return inspect.Signature([inspect.Parameter(name, kind) for name in self._names])

    def __call__(self, *arguments: Any) -> Any:
        """Return the value: recorded for recorded numbers, else computed in Python."""
        values: list[Any] = []
        for names, argument in zip(self._arguments, arguments):
            values += [argument] if names is None else list(argument)
        known = recorded(*values)
        if known is None:
            slots = [self._tape.operations[place].data for place in self._inputs]
            found: list[Any] = self._tape.evaluate(self._results, dict(zip(slots, map(float, values))))
        else:
            found = known.tape.replay(self._tape, self._results, dict(zip(self._inputs, values)))
        return found[0] if self._single else tuple(found)

    def arrays(self, *arguments: Any) -> tuple[Any, ...]:
        """Return the values for arrays of numbers, broadcast: shape of the arguments for each."""
        values: list[Any] = []
        for names, argument in zip(self._arguments, arguments):
            values += [argument] if names is None else list(argument)
        slots = [self._tape.operations[place].data for place in self._inputs]
        return tuple(self._tape.evaluate_arrays(self._results, dict(zip(slots, np.broadcast_arrays(*values)))))

    def text(self) -> str:
        """Return the operations as lines of Python."""
        return "\n".join(self._tape.lines(self._results, {place: name for place, name in zip(self._inputs, self._labels())}))

    def _labels(self) -> list[str]:
        labels: list[str] = []
        for name, names in zip(self._names, self._arguments):
            labels += [name] if names is None else [f"{name}.{each}" for each in names]
        return labels

    def __eq__(self, other: object) -> bool:
        if not isinstance(other, RecordedFunction):
            return NotImplemented
        return self._data() == other._data()

    def __hash__(self) -> int:
        return hash((self._names, self._arguments, self._results))

    def _data(self) -> tuple[Any, ...]:
        needed = self._tape.needed([*self._inputs, *self._results])
        operations = [(place, self._tape.operations[place]) for place in needed]
        return self._names, self._arguments, self._inputs, self._results, self._single, operations
