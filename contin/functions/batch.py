"""A user's functions evaluated at many points in one call, with exact derivatives.

The functions are recorded (`contin.functions.recording`), differentiated on the recording, and run by the interpreter
(`contin.functions.recorded`). What cannot be recorded is evaluated in Python (`contin.functions.interpreted`), with a
warning. Both answer the same `Request`.
"""

from __future__ import annotations

import copy
import functools
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from contin import checks
from contin.arrays import Array, Function, Indices, Pattern
from contin.errors import ProblemError
from contin.functions.interpreted import Interpreted
from contin.functions.interpreter import Loaded
from contin.functions.recorded import Recorded, Request
from contin.functions.signature import Signature, UserFunction
from contin.functions.tape import Unrecordable


@dataclass(frozen=True, eq=False)
class Columns:
    """The inputs to differentiate by, in order, and the entries of that Jacobian that may differ from zero.

    Attributes
    ----------
    inputs : ndarray of int, shape (columns,)
        Their numbers among u, v and p.
    rows, places : ndarray of int
        Values and columns of the entries.
    """

    inputs: Indices
    rows: Indices
    places: Indices

    @property
    def width(self) -> int:
        """Number of columns of the Jacobian."""
        return self.inputs.size

    def block(self, entries: Array, rows: Indices, places: Indices) -> Array:
        """Return the derivatives of some values by some columns, shape (points, rows, places), from the entries of `Batch`.

        ``entries`` (points, entries) are in the order of ``rows`` and ``places``.
        """
        row = np.full(1 + max(self.rows.max(initial=-1), rows.max(initial=-1)), -1)
        column = np.full(self.width, -1)
        row[rows], column[places] = np.arange(len(rows)), np.arange(len(places))
        at_row, at_column = row[self.rows], column[self.places]
        kept = (at_row >= 0) & (at_column >= 0)
        found = np.zeros((len(entries), len(rows), len(places)))
        found[:, at_row[kept], at_column[kept]] = entries[:, kept]
        return found

    @functools.cached_property
    def request(self) -> Request:
        """What a batch is asked for values and derivatives by these inputs."""
        return Request(tuple(self.inputs.tolist()))

    @functools.cached_property
    def packed(self) -> Request:
        """The same, the entries of the Jacobian alone."""
        return self.request._replace(packed=True)


class Batch:
    """Functions of a point, prepared together: values and exact Jacobian at many points in one call.

    Parameters
    ----------
    functions : sequence of callable
        Each ``f(t, u, p)`` of a time and two named tuples, or with ``ends=True`` ``f(u, v, p)`` of the states at both
        ends. It returns a number or a tuple of numbers; with one argument more it fills that array instead, and
        gets arrays in place of named tuples.
    counts : sequence of int
        Number of values of each function; 0 stands for one number that is no tuple.
    states, parameters : tuple of str
        Names, in order.
    times : bool
        The functions take t; ``f(u, p)`` without.

    Warns
    -----
    InterpretedWarning
        A function that cannot be recorded, when derivatives are first asked for; the message says which and why.

    Raises
    ------
    ProblemError
        No functions, or not a count for each.

    Examples
    --------
    >>> batch = Batch([lambda u, p: (u.x * u.y, p.a * u.x)], [2], ["x", "y"], ["a"], times=False)
    >>> none = np.empty((0, 2))
    >>> batch.values(np.zeros(1), np.array([[2.0, 3.0]]), none, np.array([5.0]))
    array([[ 6., 10.]])
    >>> batch.jacobian(np.zeros(1), np.array([[2.0, 3.0]]), none, np.array([5.0]), batch.columns([0]))[1]
    array([[[3., 2., 0.],
            [5., 0., 2.]]])
    """

    def __init__(
        self,
        functions: Sequence[Function],
        counts: Sequence[int],
        states: Sequence[str],
        parameters: Sequence[str],
        *,
        ends: bool = False,
        times: bool = True,
    ) -> None:
        self.signature = Signature(tuple(states), tuple(parameters), times and not ends, ends)
        self.count = sum(max(count, 1) for count in counts)
        arguments = self.signature.arguments
        self.functions = given = [UserFunction(function, arguments, count) for function, count in zip(functions, counts)]
        if not given or len(functions) != len(counts):
            raise ProblemError("functions: there must be at least one, with a count for each")
        self._own: Recorded | Interpreted
        try:
            self._own = Recorded(given, self.signature)
        except Unrecordable as reason:
            self._own = Interpreted(given, self.signature, str(reason))

    def __repr__(self) -> str:
        states, parameters = (checks.listed(names) or "none" for names in (self.signature.states, self.signature.parameters))
        return f"Batch({self.count} value{'s' * (self.count != 1)}; states {states}; parameters {parameters})"

    @property
    def interpreted(self) -> Interpreted | None:
        """The functions as Python evaluates them; None if they are recorded."""
        return self._own if isinstance(self._own, Interpreted) else None

    @property
    def recorded(self) -> Recorded | None:
        """The functions as they are recorded; None if they cannot be."""
        return self._own if isinstance(self._own, Recorded) else None

    def sized(self, inputs: Array, values: Array) -> Batch:
        """Return the same functions of inputs u, v (with ``ends``) and p that are divided by sizes, as are the values.

        ``inputs`` and ``values`` (count,) are the sizes, powers of two. Programs are made once for all of them.
        """
        if np.all(inputs == 1) and np.all(values == 1):
            return self
        found = copy.copy(self)
        found._own = self._own.sized(inputs, values)
        return found

    def is_current(self) -> bool:
        """Return whether all constants that the functions read still have the values that were recorded."""
        return self._own.is_current()

    def describe(self) -> str:
        """Return one line: how the functions are evaluated, and how many operations they have."""
        return self._own.describe()

    def text(self, labels: Sequence[str], time: str = "t") -> list[str]:
        """Return the recorded operations as lines: what is used several times as ``z1 = ...``, then each value.

        ``labels`` are those of u, v and p in order.

        Raises
        ------
        ProblemError
            The functions are evaluated in Python.
        """
        return self._own.text(labels, time)

    def values(self, t: Array, u: Array, v: Array, p: Array) -> Array:
        """Return the values, shape (points, count), at ``t`` (points,), ``u`` (points, n), ``v`` likewise or (0, n), ``p``."""
        return self._own.evaluate(_VALUES, t, u, v, p)[0]

    def jacobian(self, t: Array, u: Array, v: Array, p: Array, columns: Columns) -> tuple[Array, Array]:
        """Return values and derivatives, shape (points, count, columns.width)."""
        return self._own.evaluate(columns.request, t, u, v, p)

    def entries(self, t: Array, u: Array, v: Array, p: Array, columns: Columns) -> tuple[Array, Array]:
        """Return values (points, count), and the entries of the Jacobian (points, entries) in the order of `Columns`."""
        values, entries = self._own.evaluate(columns.packed, t, u, v, p)
        return values, entries[:, 0]

    def columns(self, free: Sequence[int] | Indices, order: Sequence[int] | Indices | None = None) -> Columns:
        """Return the columns of derivatives by u, in this ``order``, by v (with ``ends``), and by ``free`` parameters."""
        states, kept = len(self.signature.states) * (1 + self.signature.ends), self._own.kept
        inputs = (*(range(states) if order is None else map(int, order)), *(states + int(slot) for slot in free))
        if ("columns", inputs) not in kept:
            kept["columns", inputs] = Columns(np.array(inputs, dtype=np.int64), *self._own.entries(inputs))
        return kept["columns", inputs]

    @functools.cached_property
    def depends(self) -> Pattern:
        """Sparsity pattern: which values depend on which of u, v (with ``ends``), p; shape (count, inputs)."""
        pattern = np.zeros((self.count, self.signature.inputs), dtype=bool)
        every = self.columns(range(len(self.signature.parameters)))
        pattern[every.rows, every.places] = True
        return pattern

    def along(self, t: Array, u: Array, v: Array, p: Array, directions: Sequence[Array]) -> Array:
        """Return the derivative of the values along directions, D^k f [d_1, ..., d_k], shape (points, count).

        Parameters
        ----------
        directions : sequence of ndarray, shape (points, inputs)
            Directions in the space of u, v (with ``ends``) and p.
        """
        return self._own.evaluate(Request(order=len(directions)), t, u, v, p, directions)[0]

    def jacobian_along(self, t: Array, u: Array, v: Array, p: Array, columns: Columns, directions: Sequence[Array]) -> Array:
        """Return the derivative of the Jacobian along directions (as in `along`), shape (points, count, columns.width)."""
        return self._own.evaluate(Request(columns.request.inputs, len(directions)), t, u, v, p, directions)[1]

    def bent(self, t: Array, u: Array, v: Array, p: Array, weights: Array, direction: Array, columns: Columns) -> Array:
        """Return the gradient of w.(J d), the Hessian of w.f times d, for weights w and a direction d.

        Parameters
        ----------
        weights : ndarray, shape (points, count)
        direction : ndarray, shape (points, inputs)

        Returns
        -------
        ndarray, shape (points, columns.width)
        """
        request = Request(columns.request.inputs, 1, weighted=True)
        return self._own.evaluate(request, t, u, v, p, [direction, weights])[1][:, 0]

    def load(self, columns: Columns | None = None, order: int = 0) -> Loaded:
        """Return the program of the values or, with ``columns``, of values and derivatives, as kernels run it.

        With an ``order``, it is that of the derivatives of the Jacobian along so many directions, as in `jacobian_along`.

        Raises
        ------
        ProblemError
            The functions are evaluated in Python.
        """
        return self._own.load(_VALUES if columns is None else columns.request._replace(order=order))


#: The values.
_VALUES = Request()
