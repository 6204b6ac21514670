"""A recording in place of the function that was recorded: it is called like one, can be pickled, and compares by value."""

from __future__ import annotations

import inspect
from collections.abc import Sequence
from typing import Any

import numpy as np

from contin.functions.interpreter import of_columns
from contin.functions.recorded_arrays import NUMPY, recorded
from contin.functions.signature import Arguments
from contin.functions.tape import Tape


class RecordedFunction:
    """A function given by operations on a tape.

    Parameters
    ----------
    name : str
    names : sequence of str
        Of its arguments.
    arguments : sequence of tuple of str, list of them, or None
        Names of the components of each argument; a list stands for a tuple of named tuples, None for a number.
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

    def __repr__(self) -> str:
        return f"RecordedFunction({self.__name__}({', '.join(self._names)}))"

    @property
    def count(self) -> int:
        """Number of values; 0 for one number that is no tuple."""
        return 0 if self._single else len(self._results)

    def __call__(self, *arguments: object) -> Any:
        """Return the value: recorded for recorded numbers, else computed in Python."""
        values = _flat(arguments)
        known = recorded(*values)
        if known is None:
            found: list[Any] = self._tape.evaluate(self._results, dict(zip(self._slots(), map(float, values))))
        else:
            found = known.tape.replay(self._tape, self._results, dict(zip(self._inputs, values)))
        return found[0] if self._single else tuple(found)

    def arrays(self, *arguments: object) -> tuple[Any, ...]:
        """Return the values for arrays of numbers, broadcast: shape of the arguments for each."""
        columns = [np.asarray(value, dtype=float) for value in np.broadcast_arrays(*_flat(arguments))]
        u = np.ascontiguousarray(np.stack([column.ravel() for column in columns], axis=1))
        out = of_columns(self._tape, self._results, self._slots())(u)
        return tuple(np.ascontiguousarray(out.T).reshape(-1, *columns[0].shape))

    def _slots(self) -> list[Any]:
        return [self._tape.operations[place].data for place in self._inputs]

    def text(self) -> str:
        """Return the operations as lines of Python."""
        labels = [
            label
            for name, names in zip(self._names, self._arguments)
            for label in ([name] if names is None else [f"{name}.{each}" for each in names])
        ]
        return "\n".join(self._tape.lines(self._results, dict(zip(self._inputs, labels))))

    def compact(self) -> RecordedFunction:
        """Return the same function on a tape of its own, which has what it needs and nothing else."""
        tape = Tape(NUMPY)
        inputs = {place: tape.input(self._tape.operations[place].data) for place in self._inputs}
        results = [number.place for number in tape.replay(self._tape, self._results, inputs)]
        places = [inputs[place].place for place in self._inputs]
        return RecordedFunction(self.__name__, self._names, self._arguments, tape, places, results, self._single)

    def __getstate__(self) -> dict[str, Any]:
        return dict(vars(self.compact()))

    def _data(self) -> tuple[Any, ...]:
        own = self.compact()
        return own._names, own._arguments, own._inputs, own._results, own._single, own._tape.operations

    def __eq__(self, other: object) -> bool:
        if not isinstance(other, RecordedFunction):
            return NotImplemented
        return self is other or self._data() == other._data()

    def __hash__(self) -> int:
        return hash((self._names, self._arguments, self._single))


def _flat(argument: object) -> list[Any]:
    """Return the numbers of an argument: of a number, a tuple, or a tuple of tuples."""
    if isinstance(argument, tuple):
        return [number for part in argument for number in _flat(part)]
    return list(argument) if isinstance(argument, (list, np.ndarray)) and np.ndim(argument) else [argument]
