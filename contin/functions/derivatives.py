"""Derivatives of recorded operations, as operations on the same tape: exact, of any order.

The Jacobian comes from vertex elimination on the graph of operations (Griewank & Walther 2008, chapter 9). Each edge from an
operand to its operation carries a partial derivative. An intermediate operation v is removed by joining each of its operands u
to each of its users w, with the product of the two edges, added to what is there::

      u --a--> v --b--> w        becomes        u --c + a b--> w        (c: the edge from u to w, if there is one)

What is left are edges from inputs to results. The operation with the fewest products goes first (Markowitz). Removal from the
end is reverse mode, from the beginning forward mode; this order is at most as expensive on the functions of the test bank.
"""

from __future__ import annotations

import heapq
from collections.abc import Mapping, Sequence

from contin.functions.primitives import TABLE
from contin.functions.tape import Number, Tape


def jacobian(tape: Tape, results: Sequence[int], inputs: Sequence[int]) -> dict[tuple[int, int], int]:
    """Return the derivatives of ``results`` by ``inputs`` (places on the tape) that are not zero everywhere.

    Returns
    -------
    dict
        Places of the derivatives by (number of the result, number of the input), in order.

    Examples
    --------
    >>> tape = Tape()
    >>> x, y = tape.input(0), tape.input(1)
    >>> found = jacobian(tape, [(x * y).place, (x + 1).place], [x.place, y.place])
    >>> [(entry, tape.operations[place].name) for entry, place in found.items()]
    [((0, 0), 'input'), ((0, 1), 'input'), ((1, 0), 'constant')]
    """
    graph = _Graph(tape, results, inputs)
    graph.eliminate()
    return graph.entries()


class _Graph:
    """The graph of operations between inputs and results; results are sinks of their own, numbered -1, -2, ..."""

    def __init__(self, tape: Tape, results: Sequence[int], inputs: Sequence[int]) -> None:
        self.tape, self.results, self.inputs = tape, results, inputs
        self.into: dict[int, dict[int, int]] = {}  # by operation: place of the partial derivative by each operand
        self.out: dict[int, dict[int, None]] = {place: {} for place in inputs}
        self.guarded: set[int] = set()  # derivatives that may have to hide a nan
        reads, sources = tape.reading(results, inputs), set(inputs)
        for place in tape.needed(results):
            if reads[place] and place not in sources:
                self._add(place, reads)
        for number, place in enumerate(results):
            if place < len(reads) and reads[place]:
                self._edge(place, -1 - number, tape.constant(1.0))

    def _add(self, place: int, reads: list[bool]) -> None:
        """Add the edges into an operation."""
        tape, operation = self.tape, self.tape.operations[place]
        self.out.setdefault(place, {})
        if not any(reads[operand] for operand in operation.operands):
            return
        guarded = TABLE[operation.name].selects
        for operand, derivative in zip(operation.operands, partials_of(tape, place)):
            if reads[operand] and derivative is not None:
                if guarded and tape.value(derivative) is None:
                    self.guarded.add(derivative)
                self._edge(operand, place, derivative)

    def _edge(self, start: int, end: int, derivative: int) -> None:
        if self.tape.value(derivative) == 0:
            return
        into = self.into.setdefault(end, {})
        if start in into:
            total = self.tape.at("add", (into[start], derivative))
            if into[start] in self.guarded or derivative in self.guarded:
                self.guarded.add(total)
            derivative = total
        into[start] = derivative
        self.out.setdefault(start, {})[end] = None

    def _product(self, first: int, second: int) -> int:
        """Return the place of a product of derivatives."""
        if first in self.guarded or second in self.guarded:
            found = self.tape.at("product", (first, second))
            if self.tape.value(found) is None:
                self.guarded.add(found)
            return found
        return self.tape.at("mul", (first, second))

    def _cost(self, place: int) -> int:
        return len(self.into.get(place, ())) * len(self.out[place])

    def eliminate(self) -> None:
        """Remove all intermediate operations."""
        sources = set(self.inputs)
        inner = [place for place in self.out if place not in sources]
        heap = [(self._cost(place), -place) for place in inner]
        heapq.heapify(heap)
        left = set(inner)
        while heap:
            cost, negative = heapq.heappop(heap)
            place = -negative
            if place not in left:
                continue
            now = self._cost(place)
            if now > cost:
                heapq.heappush(heap, (now, negative))
                continue
            left.discard(place)
            into, out = self.into.pop(place, {}), self.out.pop(place)
            for end in out:
                after = self.into[end].pop(place)
                for start, before in into.items():
                    self._edge(start, end, self._product(before, after))
            for start in into:
                del self.out[start][place]

    def entries(self) -> dict[tuple[int, int], int]:
        """Return what is left."""
        numbers = {place: number for number, place in enumerate(self.inputs)}
        found = {}
        for number in range(len(self.results)):
            row = self.into.get(-1 - number, {})
            for start in sorted(row, key=numbers.__getitem__):
                if self.tape.value(row[start]) != 0:
                    found[number, numbers[start]] = row[start]
        return found


def partials_of(tape: Tape, place: int) -> list[int | None]:
    """Return the places of the derivatives of an operation by its operands; None where one is zero everywhere."""

    def made() -> list[int | None]:
        name, operands, data = tape.operations[place]
        found = TABLE[name].partials(tape, data, [Number(tape, operand) for operand in operands], Number(tape, place))
        return [None if each is None else tape.number(each).place for each in found]

    return tape.kept(("partials", place, tape.decide is None), made)


def tangents(tape: Tape, results: Sequence[int], along: Mapping[int, int]) -> list[int]:
    """Return the derivatives of ``results`` along a direction: forward mode, an operation or two for each on the tape.

    - ``along`` (mapping of int to int): The places of the inputs, and of the components of the direction (operations that
      depend on no input of these).

    Examples
    --------
    >>> tape = Tape()
    >>> x, v = tape.input(0), tape.input(1)
    >>> found = tangents(tape, [(x * x).place], {x.place: v.place})
    >>> tape.evaluate(found, {0: 3.0, 1: 1.0})
    [6.0]
    """
    reads, found = tape.reading(results, along), dict(along)
    zero = tape.constant(0.0)
    for place in tape.needed(results):
        if not reads[place] or place in found:
            continue
        operation = tape.operations[place]
        if operation.name == "select":
            condition, a, b = operation.operands
            found[place] = tape.at("select", (condition, found.get(a, zero), found.get(b, zero)))
            continue
        guarded = TABLE[operation.name].selects
        total = zero
        for operand, partial in zip(operation.operands, partials_of(tape, place)):
            tangent = found.get(operand, zero)
            if partial is None or tangent == zero:
                continue
            term = tape.at("product" if guarded else "mul", (partial, tangent))
            total = term if total == zero else tape.at("add", (total, term))
        found[place] = total
    return [found.get(place, zero) for place in results]
