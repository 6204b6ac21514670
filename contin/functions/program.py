"""Lowering: recorded operations become a program for the interpreter, `contin.functions.interpreter`.

A program has two stretches. The first computes, once a call, what depends on parameters and constants only: the scalars. The
second runs over blocks of points; its registers hold one number for each point of a block. Operands of the second stretch are
registers or scalars. Registers are used again after the last use of what they hold.

Each instruction is a row of five whole numbers: code, target, and up to three operands (registers, scalars or places in
``lists``).
"""

from __future__ import annotations

import itertools
from collections import Counter
from collections.abc import Container, Hashable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any, NamedTuple

import numpy as np

from contin.arrays import Array, Indices
from contin.functions.primitives import TABLE
from contin.functions.tape import Operation, Tape

#: The slot of t.
TIME = "t"

#: Codes of instructions that are not operations of a tape, or have another form where an operand is a scalar.
_OWN = (
    "load u", "load v", "load t", "fill", "copy", "keep", "store", "store scalar", "store slope", "store scalar slope",
    "add s", "sub s", "s sub", "mul s", "div s", "s div", "mul add", "mul sub", "sub mul", "mul s add",
)  # fmt: skip
#: Operations of which a register and a scalar make one instruction: its name with the scalar on the right, and on the left.
_WITH_SCALAR = {"add": ("add s", "add s"), "sub": ("sub s", "s sub"), "mul": ("mul s", "mul s"), "div": ("div s", "s div")}
CODES: dict[str, int] = {
    name: code for code, name in enumerate([*_OWN, *(name for name in TABLE if name not in ("input", "constant", "least"))])
}


@dataclass(frozen=True, eq=False)
class Inputs:
    """Where the inputs of a program are found: by slot, the column of u, of v, or of p. The slot of t is `TIME`."""

    u: Mapping[Hashable, int]
    v: Mapping[Hashable, int]
    p: Mapping[Hashable, int]


@dataclass(frozen=True, eq=False)
class Program:
    """Instructions, and what they need.

    - ``code`` (ndarray of int, shape (instructions, 5))
    - ``first``, ``last`` (int): Ends of the first and of the second stretch. Behind are the instructions of searches, which
      both may use.
    - ``lists`` (ndarray of int): Operands of instructions that take any number.
    - ``scalars`` (ndarray): The constants, then room for the parameters and for what the first stretch computes.
    - ``parameters`` (int): Where the parameters stand among the scalars.
    - ``registers`` (int): Number of registers.
    - ``operations`` (int): Number of arithmetic instructions of the second stretch.
    - ``tables`` (ndarray): Piecewise polynomials.
    - ``unknowns`` (int): Largest number of unknowns that are found together.
    - ``rooms`` (list): What the interpreter works in: one for each thread that has run the program.
    """

    code: Indices
    first: int
    last: int
    lists: Indices
    scalars: Array
    parameters: int
    registers: int
    operations: int
    tables: Array
    unknowns: int
    rooms: list[Any] = field(default_factory=list, compare=False, repr=False)


class Slope(NamedTuple):
    """Where a derivative is stored: its place in the flattened Jacobian of one point."""

    at: int


def program(tape: Tape, results: Sequence[tuple[int, int | Slope]], inputs: Inputs) -> Program:
    """Return the program that computes operations and stores each in a column of the values, or at a `Slope`."""
    return _Lowering(tape, results, inputs).program()


class _Lowering:
    """What both stretches share: the tape, the scalars, lists of operands, tables, and the instructions of searches."""

    def __init__(self, tape: Tape, results: Sequence[tuple[int, int | Slope]], inputs: Inputs) -> None:
        self.tape, self.results, self.inputs = tape, results, inputs
        self.lists: list[int] = []
        self.tables: list[float] = []
        self.searches: list[list[int]] = []
        self.begins: list[int] = []  # places in lists that count instructions of searches from their first one
        self.unknowns = 0
        places = [place for place, _ in results]
        self.needed = tape.needed(places)
        given = [(place, *tape.operations[place]) for place in self.needed]
        self.varies = tape.reading(places, [at for at, name, _, slot in given if name == "input" and slot not in inputs.p])
        self._number_scalars()

    def _number_scalars(self) -> None:
        """Give a scalar to every constant and parameter."""
        operations, inputs = self.tape.operations, self.inputs
        fixed = [place for place in self.needed if not self.varies[place]]
        self.once = [place for place in fixed if operations[place].name not in ("constant", "input")]
        searches = [operations[place].data[0] for place in self.needed if operations[place].name == "root"]
        inside = [place for search in dict.fromkeys(searches) for place in self.tape.needed((*search.results, *search.starts))]
        constants = dict.fromkeys(place for place in [*fixed, *inside] if operations[place].name == "constant")
        self.scalar = {place: number for number, place in enumerate(constants)}
        self.constants = [operations[place].data for place in constants]
        sums = [place for place in [*self.needed, *inside] if operations[place].name == "linear"]
        factors = sorted({factor for place in sums for factor in operations[place].data})
        self.factor = {factor: len(self.constants) + number for number, factor in enumerate(factors)}
        self.constants += factors
        for place in fixed:
            if operations[place].name == "input":
                self.scalar[place] = len(self.constants) + inputs.p[operations[place].data]
        self.scalars = len(self.constants) + len(inputs.p)

    def program(self) -> Program:
        """Return the program."""
        wanted = {place for place, _ in self.results}
        for place in filter(self.varies.__getitem__, self.needed):
            wanted.update(self.tape.operations[place].operands)
        kept = [place for place in self.once if place in wanted]
        first = _Stretch(self, self.once, {place: [("keep", self.scalars + k)] for k, place in enumerate(kept)})
        self.scalars += len(kept)
        moves, fixed = dict[int, Moves](), list[tuple[str, int, int]]()
        for place, where in self.results:
            name, at = ("store slope", where.at) if isinstance(where, Slope) else ("store", where)
            if self.varies[place]:
                moves.setdefault(place, []).append((name, at))
            else:
                fixed.append((name.replace("store", "store scalar"), at, self.scalar[place]))
        second = _Stretch(self, self._ordered(), moves)
        for row in fixed:
            second.write(*row)
        last = len(first.code) + len(second.code)
        for at in self.begins:
            self.lists[at] += last
        silent = {CODES[name] for name in _SILENT}
        return Program(
            np.array([*first.code, *second.code, *self.searches], dtype=np.int64).reshape(-1, 5), len(first.code), last,
            np.array(self.lists or [0], dtype=np.int64),
            np.array([*self.constants, *[0.0] * (self.scalars - len(self.constants))]), len(self.constants),
            max(first.most, second.most, 1), sum(row[0] not in silent for row in [*second.code, *self.searches]),
            np.array(self.tables or [0.0]), self.unknowns,
        )  # fmt: skip

    def _ordered(self) -> list[int]:
        """Return the operations that vary, each result's just before it: what is needed late is computed late."""
        found: list[int] = []
        left, operations = [bool(each) for each in self.varies], self.tape.operations
        for result, _ in self.results:
            stack = [result]
            while stack:
                place = stack.pop()
                if place < 0:
                    found.append(~place)
                elif left[place]:
                    left[place] = False
                    stack.append(~place)
                    stack += operations[place].operands[::-1]
        return found


#: Where a result goes: instructions that move it, and their targets.
Moves = list[tuple[str, int]]
#: No registers.
_NONE: Mapping[int, int] = {}
#: Instructions that move numbers.
_SILENT = ("load u", "load v", "load t", "fill", "keep", "store", "store scalar", "store slope", "store scalar slope")


class _Stretch:
    """Instructions in a row, and their registers.

    - ``shared`` (_Lowering)
    - ``places`` (sequence of int): The operations, in order.
    - ``moves`` (mapping of int to list): Where results go, by operation: the instruction that moves each (store, keep, copy),
      and its target.
    - ``given`` (mapping of int to int): Registers of operations that are computed elsewhere.
    - ``first`` (int): The first register that may be used.
    """

    def __init__(
        self, shared: _Lowering, places: Sequence[int], moves: Mapping[int, Moves], given: Mapping[int, int] = _NONE,
        first: int = 0,
    ) -> None:  # fmt: skip
        self.shared, self.operations, self.scalar = shared, shared.tape.operations, shared.scalar
        self.registers, self.given, self.inside = dict(given), set(given), {*places, *given}
        self.code: list[list[int]] = []
        self.free: list[int] = []
        self.most = first
        self.fused = self._fusible(places, moves)
        self.product = {place: operand for operand, place in self.fused.items()}
        self.taken = {place: self._operands(place) for place in places if place not in self.fused}
        self.left = Counter(itertools.chain.from_iterable(self.taken.values()))
        for place in places:
            if place in self.fused:
                continue
            self._instruct(place)
            for name, target in moves.get(place, ()):
                self.write(name, target, self.registers[place])
                if name == "keep":
                    self.scalar[place] = target
            if not self.left[place]:
                self._release(place)

    def write(self, name: str, *numbers: int) -> None:
        """Append an instruction."""
        self.code.append([CODES[name], *numbers, *[0] * (4 - len(numbers))])

    def _fusible(self, places: Sequence[int], moves: Container[int]) -> dict[int, int]:
        """Return products that are used once, by a sum or difference that takes them in; by product, that operation."""
        uses: Counter[int] = Counter(operand for place in places for operand in self.operations[place].operands)
        fused: dict[int, int] = {}
        for place in places:
            name, operands = self.operations[place].name, self.operations[place].operands
            if name not in ("add", "sub") or not all(operand in self.inside for operand in operands):
                continue
            for operand in reversed(operands):
                factor = self.operations[operand]
                if factor.name != "mul" or uses[operand] != 1 or operand in self.given or operand in moves:
                    continue
                registers = [each in self.inside and each not in self.scalar for each in factor.operands]
                if all(registers) or (name == "add" and any(registers)):
                    fused[operand] = place
                    break
        return fused

    def _operands(self, place: int) -> Sequence[int]:
        """Return the operands of an operation, those of a product that it takes in included."""
        product, operands = self.product.get(place), self.operations[place].operands
        if product is None:
            return operands
        at = operands.index(product)
        return *operands[:at], *self.operations[product].operands, *operands[at + 1 :]

    # --- registers -----------------------------------------------------------------------------------------------------

    def _take(self) -> int:
        """Return a register that is not in use."""
        if self.free:
            return self.free.pop()
        self.most += 1
        return self.most - 1

    def _register(self, place: int) -> int:
        """Return the register of an operand; a scalar is filled into one."""
        if place not in self.registers:
            register = self.registers[place] = self._take()
            self.write("fill", register, self.scalar[place])
        return self.registers[place]

    def _release(self, place: int) -> None:
        if place not in self.given:
            register = self.registers.pop(place, None)
            if register is not None:
                self.free.append(register)

    # --- one instruction -----------------------------------------------------------------------------------------------

    def _instruct(self, place: int) -> None:
        """Write the instruction of an operation, and free the registers that no later one needs."""
        operation = self.operations[place]
        if place in self.registers:  # found with another unknown
            name, given = "", list[int]()
        elif operation.name == "input":
            name, given = self._load(operation.data)
        elif operation.name == "root":
            self._root(place)
            name, given = "", []
        else:
            product = self.product.get(place)
            name, given = self._plain(operation) if product is None else self._fused(operation, product)
        for operand in self.taken[place]:
            self.left[operand] -= 1
            if self.left[operand] <= 0:
                self._release(operand)
        if name:
            target = self.registers[place] = self._take()
            self.write(name, target, *given)

    def _load(self, slot: Hashable) -> tuple[str, list[int]]:
        inputs = self.shared.inputs
        if slot == TIME:
            return "load t", []
        return ("load u", [inputs.u[slot]]) if slot in inputs.u else ("load v", [inputs.v[slot]])

    def _plain(self, operation: Operation) -> tuple[str, list[int]]:
        """Return name and operands of an instruction that stands for one operation."""
        name, operands, _ = operation
        if name in _WITH_SCALAR:
            a, b = operands
            if b in self.scalar and a not in self.scalar:
                return _WITH_SCALAR[name][0], [self._register(a), self.scalar[b]]
            if a in self.scalar and b not in self.scalar:
                return _WITH_SCALAR[name][1], [self._register(b), self.scalar[a]]
            return name, [self._register(a), self._register(b)]
        if name in ("sum", "dot", "linear"):
            return name, self._list(operation)
        if name == "table":
            tables = self.shared.tables
            tables.extend(operation.data.numbers())
            return name, [self._register(operands[0]), len(tables) - operation.data.numbers().size]
        if name == "polygamma":
            return name, [self._register(operands[0]), operation.data]
        if name == "least":
            return "copy", [self._register(operands[0])]
        return name, [self._register(operand) for operand in operands]

    def _list(self, operation: Operation) -> list[int]:
        """Return where the registers of many operands stand, and how many; the factors of a sum follow as scalars."""
        count = len(operation.operands) // 2 if operation.name == "dot" else len(operation.operands)
        listed = [self._register(operand) for operand in operation.operands]
        if operation.name == "linear":
            listed += [self.shared.factor[factor] for factor in operation.data]
        start = len(self.shared.lists)
        self.shared.lists += listed
        return [start, count]

    def _fused(self, operation: Operation, product: int) -> tuple[str, list[int]]:
        """Return name and operands of a sum or difference with a product in it."""
        operands = operation.operands
        other = operands[1] if operands[0] == product else operands[0]
        a, b = self.operations[product].operands
        if operation.name == "add" and (a in self.scalar) != (b in self.scalar):
            factor, scalar = (b, a) if a in self.scalar else (a, b)
            return "mul s add", [self._register(factor), self.scalar[scalar], self._register(other)]
        kind = "mul add" if operation.name == "add" else ("mul sub" if operands[0] == product else "sub mul")
        return kind, [self._register(a), self._register(b), self._register(other)]

    def _root(self, place: int) -> None:
        """Write the search for unknowns: registers as `contin.functions.interpreter` describes them, kept to the end."""
        shared, operation = self.shared, self.operations[place]
        search, k = operation.data[0], len(operation.data[0].unknowns)
        registers = {operand: self._register(operand) for operand in operation.operands}
        starts = [self._register(start) for start in search.starts]
        at = self.most
        self.most += 5 * k + 4 + len(search.matrix)
        results = [search.potential, *search.slopes, *search.matrix]
        moves: dict[int, Moves] = {}
        for number, result in enumerate(results):
            moves.setdefault(result, []).append(("copy", at + k + number))
        depends = shared.tape.reading(results, search.unknowns)
        inner = [each for each in shared.tape.needed(results) if depends[each] and each not in search.unknowns]
        unknowns = {unknown: at + number for number, unknown in enumerate(search.unknowns)}
        given = {operand: register for operand, register in registers.items() if operand not in self.scalar} | unknowns
        sub = _Stretch(shared, inner, moves, given, self.most)
        for result, targets in moves.items():
            for _, target in targets if not depends[result] or result in unknowns else ():
                scalar = result in self.scalar
                sub.write("fill" if scalar else "copy", target, self.scalar[result] if scalar else given[result])
        self.most = sub.most
        start, begin = len(shared.lists), len(shared.searches)
        shared.searches += sub.code
        shared.lists += [k, int(search.minimum) + int(search.saddles), begin, len(shared.searches), at, *starts]
        shared.begins += [start + 2, start + 3]
        shared.unknowns = max(shared.unknowns, k)
        self.write("root", at, start)
        for each in self.inside:
            other = self.operations[each]
            if other.name == "root" and other.data[0] == search and other.operands == operation.operands:
                self.registers[each] = at + other.data[1]
                self.given.add(each)  # its register is not used again
