"""Unknowns that are found by iteration at each point, as operations of a tape.

`minimum`, `root` and `least` are called inside a user's function. They record the potential or the residual with unknowns of
their own on the same tape; the interpreter finds the unknowns by Newton's method in all points of a block
(`contin.functions.interpreter`). Derivatives follow from the theorem on implicit functions, with operations on the tape: with
A w = b the linearized equations at the solution, dw/dz = -A^-1 dG/dz. They are exact, and can be differentiated again.
"""

from __future__ import annotations

import inspect
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from contin import errors as checks
from contin.arrays import Array
from contin.errors import ProblemError
from contin.functions import derivatives
from contin.functions.interpreter import of_columns
from contin.functions.recorded_arrays import NUMPY, recorded, select
from contin.functions.recording import recorded_paths
from contin.functions.signature import argument_count, flat
from contin.functions.stand_ins import RecordedFunction, prepared
from contin.functions.tape import Number, Tape, Unrecordable

#: Largest number of unknowns that are found together. Their equations are solved with a dense matrix at every point.
MOST = 16


@dataclass(frozen=True)
class Search:
    """Unknowns w, and what determines them; all are places on a tape.

    Attributes
    ----------
    minimum : bool
        w minimizes the potential; else the slopes are a residual that vanishes.
    unknowns : tuple of int
    potential : int
        The potential, or the constant 0.
    slopes : tuple of int
        Its gradient, or the residual.
    matrix : tuple of int
        Lower triangle of the Hessian by rows, or the Jacobian by rows.
    starts : tuple of int
        Where Newton's method starts.
    saddles : bool
        Places where the potential is stationary and not convex count, too: what calls the search looks at its Hessian.
    """

    minimum: bool
    unknowns: tuple[int, ...]
    potential: int
    slopes: tuple[int, ...]
    matrix: tuple[int, ...]
    starts: tuple[int, ...]
    saddles: bool = False

    @property
    def results(self) -> tuple[int, ...]:
        """Everything that is computed at each step."""
        return (self.potential, *self.slopes, *self.matrix)

    def moved(self, places: Mapping[int, int]) -> Search:
        """Return the same search with other places."""
        groups = (self.unknowns, self.slopes, self.matrix, self.starts)
        unknowns, slopes, matrix, starts = (tuple(places[place] for place in group) for group in groups)
        return Search(self.minimum, unknowns, places[self.potential], slopes, matrix, starts, self.saddles)

    def entry(self, i: int, j: int) -> int:
        """Return the place of an entry of the matrix."""
        if not self.minimum:
            return self.matrix[i * len(self.unknowns) + j]
        i, j = max(i, j), min(i, j)
        return self.matrix[i * (i + 1) // 2 + j]

    def partials(self, tape: Tape, index: int, operands: Sequence[Number]) -> list[Any]:
        """Return the derivatives of one unknown by what the equations read."""
        key = ("implicit", self, tuple(operand.place for operand in operands))
        return [column[index] for column in tape.kept(key, lambda: self._implicit(tape, operands))]

    def _implicit(self, tape: Tape, operands: Sequence[Number]) -> list[list[Any]]:
        """Return the derivatives of all unknowns by each operand."""
        k, places = len(self.unknowns), [operand.place for operand in operands]
        at = self.solution(tape, operands)
        by = derivatives.jacobian(tape, self.slopes, places)
        wanted = [self.entry(i, j) for i in range(k) for j in range(k)] + list(by.values())
        moved = tape.substitute(wanted, at)
        matrix = [[Number(tape, moved[i * k + j]) for j in range(k)] for i in range(k)]
        entries = dict(zip(by, moved[k * k :]))
        columns = []
        for number in range(len(places)):
            if not any((i, number) in entries for i in range(k)):  # a start
                columns.append([None] * k)
                continue
            right = [-Number(tape, entries[i, number]) if (i, number) in entries else 0.0 for i in range(k)]
            columns.append(solved(matrix, right, self.minimum))
        return columns

    def newton(self, tape: Tape, values: Mapping[Any, float]) -> list[float]:
        """Return the unknowns at one point, found by the interpreter, for ``values`` of the inputs by slot; nan where there
        are none."""
        slots, found = tape.kept(("search", self), lambda: self._function(tape))
        return found(np.array([[values[slot] for slot in slots]], dtype=float))[0].tolist()

    def _function(self, tape: Tape) -> tuple[list[Any], Callable[[Array], Array]]:
        """Return the slots of the inputs of the search, and the function that takes their values to the unknowns."""
        places = list(self.solution(tape, operands_of(tape, self)).values())
        slots = [tape.operations[place].data for place in tape.needed(places) if tape.operations[place].name == "input"]
        return slots, of_columns(tape, places, slots)

    def solution(self, tape: Tape, operands: Sequence[Number]) -> dict[int, int]:
        """Return the places of the values found, by the places of the unknowns."""
        return {unknown: number.place for unknown, number in zip(self.unknowns, _unknowns(tape, self, operands))}

    def slopes_of_least(self, tape: Tape, operands: Sequence[Number]) -> list[Any]:
        """Return the derivatives of the least value by what the potential reads, at fixed unknowns, as it is stationary."""
        by = derivatives.jacobian(tape, [self.potential], [operand.place for operand in operands])
        moved = tape.substitute(list(by.values()), self.solution(tape, operands))
        slopes = {number: Number(tape, place) for (_, number), place in zip(by, moved)}
        return [slopes.get(number) for number in range(len(operands))]


def solved(matrix: Sequence[Sequence[Any]], right: Sequence[Any], symmetric: bool) -> list[Any]:
    """Return the solution of a small recorded linear system: elimination, with pivots unless it is symmetric and definite."""
    k = len(right)
    a, b = [list(row) for row in matrix], list(right)
    for i in range(k):
        for j in range(i + 1, k) if not symmetric else ():
            larger = abs(a[j][i]) > abs(a[i][i])
            rows = [(select(larger, y, x), select(larger, x, y)) for x, y in zip([*a[i], b[i]], [*a[j], b[j]])]
            a[i], b[i] = [pair[0] for pair in rows[:-1]], rows[-1][0]
            a[j], b[j] = [pair[1] for pair in rows[:-1]], rows[-1][1]
        for j in range(i + 1, k):
            factor = a[j][i] / a[i][i]
            a[j] = [y - factor * x for x, y in zip(a[i], a[j])]
            b[j] = b[j] - factor * b[i]
    for i in reversed(range(k)):
        for j in range(i + 1, k):
            b[i] = b[i] - a[i][j] * b[j]
        b[i] = b[i] / a[i][i]
    return b


def minimum(potential: Callable[..., Any], start: Sequence[Any]) -> tuple[Any, ...]:
    """Return the unknowns w that minimize ``potential(w)``, found by Newton's method with steps that lower it.

    It is for implicit laws inside a user's function: the potential may use states and parameters, and derivatives are exact.

    Parameters
    ----------
    potential : callable
        ``potential(w)`` of a tuple of numbers returns a number; smooth, and convex between ``start`` and the minimum.
    start : sequence of float
        Where the search starts; numbers that may depend on states and parameters.

    Returns
    -------
    tuple
        The unknowns; nan where there is no minimum.

    Raises
    ------
    ProblemError
        No unknowns, or more than 16.

    Examples
    --------
    >>> from contin.lowlevel import minimum
    >>> (w,) = minimum(lambda w: (w[0] - 3) ** 2 + w[0] ** 4 / 4, [0.0])
    >>> round(w, 14)
    1.45616424613591
    """
    return tuple(_sought(potential, start, True, _unknowns))


def root(residual: Callable[..., Any], start: Sequence[Any]) -> tuple[Any, ...]:
    """Return the unknowns w with ``residual(w) = 0``, found by Newton's method with steps that reduce it.

    Parameters
    ----------
    residual : callable
        ``residual(w)`` of a tuple of numbers returns as many numbers.
    start : sequence of float
        Where the search starts; numbers that may depend on states and parameters.

    Returns
    -------
    tuple
        The unknowns; nan where none are found.

    Raises
    ------
    ProblemError
        No unknowns, more than 16, or another number of residuals.

    Examples
    --------
    The rate w of w + w**3 = u, with its exact derivative 1/(1 + 3 w**2):

    >>> import numpy as np
    >>> from contin.lowlevel import root
    >>> from contin.lowlevel import Batch
    >>> batch = Batch([lambda u, p: root(lambda w: (w[0] + w[0] ** 3 - u.u,), [0.0])[0]], [0], ["u"], [], times=False)
    >>> given = np.zeros(1), np.array([[10.0]]), np.empty((0, 1)), np.empty(0)
    >>> value, slope = batch.jacobian(*given, batch.columns([]))
    >>> round(value.item(), 14), round(1 / slope.item(), 13)
    (2.0, 13.0)
    """
    return tuple(_sought(residual, start, False, _unknowns))


def least(potential: Callable[..., Any], start: Sequence[Any]) -> Any:
    """Return the least value of ``potential(w)``, as `minimum` finds it.

    Its derivatives are those of the potential at fixed w, since it is stationary there: a Legendre transform costs no more than
    its strains. They are exact, and so are second and higher ones.

    Parameters
    ----------
    potential : callable
    start : sequence of float
        As for `minimum`.

    Returns
    -------
    float
        nan where there is no minimum.

    Raises
    ------
    ProblemError
        No unknowns, or more than 16.

    Examples
    --------
    The complementary energy of U = w**4/4 is 3 M**(4/3)/4, and its derivative the strain:

    >>> from contin.lowlevel import gradient, least
    >>> value, strain = gradient(lambda M: -least(lambda w: w[0] ** 4 / 4 - M * w[0], [1.0]), ["M"])(8.0)
    >>> round(value, 13), round(strain, 14)
    (12.0, 2.0)
    """
    return _sought(potential, start, True, _least)[0]


def _sought(
    function: Callable[..., Any], start: Sequence[Any], minimal: bool,
    results: Callable[[Tape, Search, Sequence[Number]], list[Number]],
) -> list[Any]:  # fmt: skip
    """Return ``results`` of the search: recorded where one of the numbers is, else evaluated on a tape of their own."""
    starts = [flat(each) for each in checks.sequence("start", start, "numbers")]  # np.where gives arrays without dimensions
    for each in starts:
        if not (isinstance(each, Number) or checks.is_number(each)):
            raise ProblemError(f"start: {checks.shown(each)} must be a number")
    if not 1 <= len(starts) <= MOST:
        raise ProblemError(f"start: {len(starts)} unknowns, must be 1 to {MOST}")
    if argument_count(checks.function("function", function)) != 1:
        raise ProblemError(f"function: {checks.shown(function)} must take 1 argument, a list of the unknowns")
    function = prepared(function)
    tape = _tape_of(function, starts)
    if tape is not None:
        return results(tape, *recorded_search(tape, function, starts, minimal))
    own = Tape(NUMPY)
    try:
        found = results(own, *recorded_search(own, function, starts, minimal))
    except Unrecordable as reason:
        raise ProblemError(f"{'potential' if minimal else 'residual'} cannot be differentiated: {reason}") from None
    return own.evaluate([each.place for each in found], {})


def _unknowns(tape: Tape, search: Search, operands: Sequence[Number]) -> list[Number]:
    return [tape.apply("root", *operands, data=(search, i)) for i in range(len(search.unknowns))]


def _least(tape: Tape, search: Search, operands: Sequence[Number]) -> list[Number]:
    (value,) = tape.substitute([search.potential], search.solution(tape, operands))
    return [tape.apply("least", Number(tape, value), *operands, data=(search,))]


def _tape_of(function: Callable[..., Any], starts: Sequence[Any]) -> Tape | None:
    """Return the tape on which a function is being recorded; None where all numbers are ordinary ones."""
    known, scratch = recorded(starts), Tape(NUMPY)
    if known is None:
        try:
            known = recorded(function(tuple(scratch.input(("probe", i)) for i in range(len(starts)))))
        except Unrecordable:  # it refers to numbers of another tape
            known = recorded(function(tuple(starts)))
    return None if known is None or known.tape is scratch else known.tape


def recorded_search(
    tape: Tape, function: Callable[..., Any], starts: Sequence[Any], minimal: bool
) -> tuple[Search, list[Number]]:
    """Return a search for unknowns on a tape, and the numbers that it reads; raise Unrecordable for one within a search."""
    k = len(starts)
    unknowns = [tape.input(("unknown", tape.searches, i)) for i in range(k)]
    tape.searches += 1

    def call(copy: Any) -> Sequence[Any]:
        result = copy(tuple(unknowns))
        return list(result) if isinstance(result, (tuple, list, np.ndarray)) else [result]

    values = [Number(tape, place) for place in recorded_paths(tape, function, call)]
    if len(values) != (1 if minimal else k):
        raise ProblemError(
            f"{'potential' if minimal else 'residual'} returns {len(values)} values, must return {1 if minimal else k}"
        )
    search = search_of(tape, [each.place for each in unknowns], [each.place for each in values], starts, minimal)
    return search, operands_of(tape, search)


def search_of(tape: Tape, unknowns: Sequence[int], values: Sequence[int], starts: Sequence[Any], minimal: bool) -> Search:
    """Return the search for places of unknowns, with the potential or the residuals at ``values``."""
    k, zero = len(unknowns), tape.constant(0.0)
    if minimal:
        by = derivatives.jacobian(tape, values, unknowns)
        slopes = [by.get((0, i), zero) for i in range(k)]
    else:
        slopes = list(values)
    second = derivatives.jacobian(tape, slopes, unknowns)
    pairs = [(i, j) for i in range(k) for j in range(i + 1 if minimal else k)]
    matrix = tuple(second.get(pair, zero) for pair in pairs)
    given = tuple(tape.number(value).place for value in starts)
    return Search(minimal, tuple(unknowns), values[0] if minimal else zero, tuple(slopes), matrix, given)


def operands_of(tape: Tape, search: Search) -> list[Number]:
    """Return what a search reads besides its unknowns, and the starts; raise Unrecordable for a search within a search."""
    depends = tape.reading(search.results, search.unknowns)
    operands: dict[int, None] = {}
    for place in tape.needed(search.results):
        operation = tape.operations[place]
        if depends[place] and operation.name == "root":
            raise Unrecordable("it searches for unknowns within a search")
        inside = operation.operands if depends[place] else ()
        operands.update(dict.fromkeys(each for each in inside if not depends[each]))
    operands.update(dict.fromkeys(place for place in search.results if not depends[place]))
    operands.update(dict.fromkeys(search.starts))
    return [Number(tape, place) for place in operands if tape.value(place) is None]


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
