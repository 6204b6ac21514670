"""The interpreter: one kernel runs the programs of all users' functions over blocks of points.

Registers hold one number for each of the `LANES` points of a block::

    registers   | r0: x x x ... x | r1: x x x ... x | ...        32 numbers each, in groups of 8
    scalars     | constants | parameters | what the first stretch computes |

An instruction is a row of a program (`contin.functions.program`). `_interpret` is written in LLVM's language as one function
with a jump by the instruction's code. Arithmetic takes eight numbers at a time; the C library's functions take one. A product
and a sum are rounded one after the other, so results do not depend on the width of the machine's vectors. Three operations are
left to compiled Python: piecewise polynomials, polygamma functions, and unknowns that are found by iteration.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Hashable, Sequence
from typing import Any, NamedTuple

import numpy as np

from contin.arrays import Array
from contin.functions import round_off
from contin.functions.primitives import OF_TWO, TABLE, polygamma
from contin.functions.program import CODES, TIME, Inputs, Program, program
from contin.functions.tape import Tape
from contin.kernels import kernel_parts as parts
from contin.kernels.kernel import kernel
from contin.kernels.kernel_parts import Builder, IndexMatrix, IndexVector, Matrix, Stack, Value, Vector, helper, instruction

#: Points of a block. With 64 registers of many functions no longer fit into the first cache; with 16 instructions are read
#: twice as often.
LANES = 32
#: Numbers that arithmetic takes together: a vector register of AVX-512.
GROUP = 8

#: Bytes of a register.
_REGISTER = 8 * LANES
#: Bytes of a group.
_BYTES = 8 * GROUP
#: Bytes of an instruction.
_ROW = 8 * 5


class Memory(NamedTuple):
    """Addresses of what instructions read and write, the last five at the first point of a block."""

    code: int
    registers: int
    scalars: int
    lists: int
    t: int
    u: int
    v: int
    out: int
    jac: int


class Widths(NamedTuple):
    """Bytes from one point to the next."""

    u: int
    v: int
    out: int
    jac: int


# --- one instruction in LLVM's language
# -----------------------------------------------------------------------------------------


class _Writer:
    """Writes the body of one case: ``d``, ``a``, ``b``, ``c`` are the numbers in the instruction's row."""

    def __init__(self, builder: Builder, memory: Memory, widths: Widths, lanes: Value) -> None:
        self.builder, self.memory, self.widths, self.lanes = builder, memory, widths, lanes
        self.groups = builder.udiv(builder.add(lanes, _number(GROUP - 1)), _number(GROUP))
        self.d = self.a = self.b = self.c = None

    def register(self, number: Value) -> Value:
        return self.builder.add(self.memory.registers, self.builder.mul(number, _number(_REGISTER)))

    def entry(self, base: Value, number: Value) -> Value:
        return self.builder.add(base, self.builder.mul(number, _number(8)))

    def load(self, address: Value, kind: parts.Type | None = None) -> Value:
        value = self.builder.load(self.builder.inttoptr(address, (kind or parts.double()).as_pointer()))
        value.align = 8
        return value

    def store(self, value: Value, address: Value) -> None:
        self.builder.store(value, self.builder.inttoptr(address, value.type.as_pointer())).align = 8

    def scalar(self, number: Value) -> Value:
        return self.load(self.entry(self.memory.scalars, number))

    def splat(self, value: Value) -> Value:
        none = parts.constant(_group(), parts.llvm().Undefined)
        first = self.builder.insert_element(none, value, parts.constant(parts.whole(32), 0))
        everywhere = parts.constant(parts.llvm().VectorType(parts.whole(32), GROUP), [0] * GROUP)
        return self.builder.shuffle_vector(first, none, everywhere)

    def vector(self, value: Callable[..., Value], operands: list[Value], scalars: list[Value]) -> None:
        """d = value(operands, scalars), eight lanes at a time; scalars are the same in all."""
        builder = self.builder
        target, sources = self.register(self.d), [self.register(operand) for operand in operands]
        wide = [self.splat(self.scalar(number)) for number in scalars]
        with parts.for_range(builder, self.groups) as loop:
            offset = builder.mul(loop.index, _number(_BYTES))
            values = [self.load(builder.add(source, offset), _group()) for source in sources]
            self.store(value(*values, *wide), builder.add(target, offset))

    def each(self, value: Callable[..., Value], operands: list[Value]) -> None:
        """d = value(operands), lane by lane."""
        builder = self.builder
        target, sources = self.register(self.d), [self.register(operand) for operand in operands]
        with parts.for_range(builder, self.lanes) as loop:
            values = [self.load(self.entry(source, loop.index)) for source in sources]
            self.store(value(*values), self.entry(target, loop.index))

    def gather(self, base: Value, width: Value) -> None:
        """d = a column of an array, point by point."""
        builder = self.builder
        target = self.register(self.d)
        with parts.for_range(builder, self.lanes) as loop:
            self.store(self.load(builder.add(base, builder.mul(loop.index, width))), self.entry(target, loop.index))

    def scatter(self, base: Value, width: Value, scalar: bool) -> None:
        """Store register or scalar a in column d of an array."""
        builder = self.builder
        base = self.entry(base, self.d)
        value = self.scalar(self.a) if scalar else None
        source = None if scalar else self.register(self.a)
        with parts.for_range(builder, self.lanes) as loop:
            found = value if scalar else self.load(self.entry(source, loop.index))
            self.store(found, builder.add(base, builder.mul(loop.index, width)))

    def many(self, term: Callable[[Value, Value], Value]) -> None:
        """d = sum of b terms; ``term(number, offset)`` returns one of them, for eight lanes."""
        builder = self.builder
        target = self.register(self.d)
        with parts.for_range(builder, self.groups) as outer:
            offset = builder.mul(outer.index, _number(_BYTES))
            total = parts.variable(builder, term(_number(0), offset))
            with parts.for_range(builder, builder.sub(self.b, _number(1))) as inner:
                following = term(builder.add(inner.index, _number(1)), offset)
                builder.store(builder.fadd(builder.load(total), following), total)
            self.store(builder.load(total), builder.add(target, offset))

    def listed(self, number: Value) -> Value:
        """Return a number of the list that begins at a."""
        return self.load(self.entry(self.memory.lists, self.builder.add(self.a, number)), parts.whole())

    def lane(self, register: Value, offset: Value) -> Value:
        """Return eight lanes of a register."""
        return self.load(self.builder.add(self.register(register), offset), _group())


def _group() -> parts.Type:
    """Return LLVM's type of a group."""
    return parts.llvm().VectorType(parts.double(), GROUP)


def _number(value: int) -> Value:
    return parts.constant(parts.whole(), value)


def _intrinsic(builder: Builder, name: str) -> Callable[[Value], Value]:
    full = f"llvm.{name}.v{GROUP}f64"
    kind = parts.llvm().FunctionType(_group(), [_group()])
    function = builder.module.globals.get(full) or parts.llvm().Function(builder.module, kind, full)
    return lambda x: builder.call(function, [x])


def _truth(builder: Builder, condition: Value) -> Value:
    return builder.uitofp(condition, _group())


def _zeros() -> Value:
    return parts.constant(_group(), [0.0] * GROUP)


def _sign(builder: Builder, x: Value) -> Value:
    one, minus = (parts.constant(_group(), [value] * GROUP) for value in (1.0, -1.0))
    below = builder.select(builder.fcmp_ordered("<", x, _zeros()), minus, x)
    return builder.select(builder.fcmp_ordered(">", x, _zeros()), one, below)


def _chosen(builder: Builder, condition: Value, a: Value, b: Value) -> Value:
    return builder.select(builder.fcmp_unordered("!=", condition, _zeros()), a, b)


def _product(builder: Builder, x: Value, y: Value) -> Value:
    zero = builder.or_(builder.fcmp_ordered("==", x, _zeros()), builder.fcmp_ordered("==", y, _zeros()))
    return builder.select(zero, _zeros(), builder.fmul(x, y))


def _arithmetic(builder: Builder) -> dict[str, tuple[Callable[..., Value], int, int]]:
    """Return by name: the value for eight lanes, and how many operands are registers and how many scalars."""
    add, sub, mul, div = builder.fadd, builder.fsub, builder.fmul, builder.fdiv
    found = {
        "add": (add, 2, 0), "sub": (sub, 2, 0), "mul": (mul, 2, 0), "div": (div, 2, 0), "add s": (add, 1, 1),
        "sub s": (sub, 1, 1), "s sub": (lambda x, s: sub(s, x), 1, 1), "mul s": (mul, 1, 1), "div s": (div, 1, 1),
        "s div": (lambda x, s: div(s, x), 1, 1), "mul add": (lambda x, y, z: add(mul(x, y), z), 3, 0),
        "mul sub": (lambda x, y, z: sub(mul(x, y), z), 3, 0), "sub mul": (lambda x, y, z: sub(z, mul(x, y)), 3, 0),
        "neg": (builder.fneg, 1, 0), "sign": (lambda x: _sign(builder, x), 1, 0),
        "product": (lambda x, y: _product(builder, x, y), 2, 0),
        "select": (lambda c, x, y: _chosen(builder, c, x, y), 3, 0),
        "lt": (lambda x, y: _truth(builder, builder.fcmp_ordered("<", x, y)), 2, 0),
        "le": (lambda x, y: _truth(builder, builder.fcmp_ordered("<=", x, y)), 2, 0),
        "eq": (lambda x, y: _truth(builder, builder.fcmp_ordered("==", x, y)), 2, 0),
    }  # fmt: skip
    intrinsics = {"abs": "fabs", **{name: name for name in ("sqrt", "floor", "ceil", "trunc", "rint")}}
    return {**found, **{name: (_intrinsic(builder, intrinsic), 1, 0) for name, intrinsic in intrinsics.items()}}


def _library(builder: Builder, name: str) -> tuple[Callable[..., Value], int]:
    """Return the value of a function of the C library for one lane, and the number of its operands."""
    external, count = TABLE[name].external, 2 if name in OF_TWO else 1
    kind = parts.llvm().FunctionType(parts.double(), [parts.double()] * count)
    function = builder.module.globals.get(external) or parts.llvm().Function(builder.module, kind, external)

    def value(*given: Value) -> Value:
        found = builder.call(function, given)
        if name != "mod":
            return found
        x, y = found, given[1]  # C's remainder has the sign of the dividend, Python's that of the divisor
        other = builder.fcmp_ordered("<", builder.fmul(x, y), parts.constant(parts.double(), 0.0))
        return builder.select(other, builder.fadd(x, y), x)

    return value, count


def _cases(write: _Writer) -> dict[str, Callable[[], None]]:
    """Return what writes each case, by name."""
    builder, memory, widths = write.builder, write.memory, write.widths

    def registers(value: Callable[..., Value], count: int, scalars: int) -> None:
        if count == 1 and scalars:
            write.vector(value, [write.a], [write.b])
        else:
            write.vector(value, [write.a, write.b, write.c][:count], [])

    def fused_scalar() -> None:
        write.vector(lambda x, z, s: builder.fadd(builder.fmul(x, s), z), [write.a, write.c], [write.b])

    def linear(number: Value, offset: Value) -> Value:
        factor = write.splat(write.scalar(write.listed(builder.add(number, write.b))))
        return builder.fmul(factor, write.lane(write.listed(number), offset))

    def dot(number: Value, offset: Value) -> Value:
        other = write.lane(write.listed(builder.add(number, write.b)), offset)
        return builder.fmul(write.lane(write.listed(number), offset), other)

    found: dict[str, Callable[[], None]] = {
        "load u": lambda: write.gather(write.entry(memory.u, write.a), widths.u),
        "load v": lambda: write.gather(write.entry(memory.v, write.a), widths.v),
        "load t": lambda: write.gather(memory.t, _number(8)),
        "copy": lambda: write.vector(lambda x: x, [write.a], []),
        "fill": lambda: write.vector(lambda s: s, [], [write.a]),
        "keep": lambda: write.store(write.load(write.register(write.a)), write.entry(memory.scalars, write.d)),
        "store": lambda: write.scatter(memory.out, widths.out, False),
        "store scalar": lambda: write.scatter(memory.out, widths.out, True),
        "store slope": lambda: write.scatter(memory.jac, widths.jac, False),
        "store scalar slope": lambda: write.scatter(memory.jac, widths.jac, True),
        "mul s add": fused_scalar,
        "sum": lambda: write.many(lambda number, offset: write.lane(write.listed(number), offset)),
        "linear": lambda: write.many(linear),
        "dot": lambda: write.many(dot),
    }
    for name, (value, count, scalars) in _arithmetic(builder).items():
        found[name] = lambda value=value, count=count, scalars=scalars: registers(value, count, scalars)  # type: ignore[misc]
    for name, primitive in TABLE.items():
        if primitive.external:
            value, count = _library(builder, name)
            found[name] = lambda value=value, count=count: write.each(value, [write.a, write.b][:count])  # type: ignore[misc]
    return found


@instruction
def interpret(builder: Builder, memory: Memory, widths: Widths, lanes: int, first: int, last: int) -> int:
    """Run the instructions from ``first`` to ``last``; return the number of one that is none of these, or ``last``."""
    write = _Writer(builder, memory, widths, lanes)
    place = parts.variable(builder, first)
    head, body, end = (builder.append_basic_block() for _ in range(3))
    builder.branch(head)
    builder.position_at_end(head)
    now = builder.load(place)
    builder.cbranch(builder.icmp_signed("<", now, last), body, end)
    builder.position_at_end(body)
    row = builder.add(memory.code, builder.mul(now, _number(_ROW)))
    code, write.d, write.a, write.b, write.c = (
        write.load(builder.add(row, _number(8 * column)), parts.whole()) for column in range(5)
    )
    following = builder.append_basic_block()
    choice = builder.switch(code, end)
    for name, case in _cases(write).items():
        block = builder.append_basic_block()
        choice.add_case(_number(CODES[name]), block)
        builder.position_at_end(block)
        case()
        builder.branch(following)
    builder.position_at_end(following)
    builder.store(builder.add(now, _number(1)), place)
    builder.branch(head)
    builder.position_at_end(end)
    return builder.load(place)


# --- the rest of the kernel, and the kernel
# -------------------------------------------------------------------------------------


@helper
def _table(tables, at, x):
    """Return a piecewise polynomial: (breaks, order, the breaks, the origin of each piece, coefficients, highest first)."""
    breaks, order = int(tables[at]), int(tables[at + 1])
    low, high = 0, breaks  # the piece is the number of breaks that are not above x
    while low < high:
        middle = (low + high) // 2
        if tables[at + 2 + middle] <= x:
            low = middle + 1
        else:
            high = middle
    origins = at + 2 + breaks
    inside, place = x - tables[origins + low], origins + breaks + 1 + low * order
    total = tables[place]
    for k in range(1, order):
        total = total * inside + tables[place + k]
    return total


@helper
def _direction(work, at, k, minimum, lane, scratch):
    """Solve for Newton's step in one lane, and return its slope: of the potential, or of half the squared residual.

    ``at`` is the register of [unknowns (k) | value | G (k) | A | before (k) | step (k) | ...]: A is the lower triangle of the
    Hessian by rows, or the Jacobian. Pivots of a Hessian that are not positive are replaced, so that the step leads downhill;
    the lower left entry of ``scratch`` is 0 where there was one, else 1.
    """
    first, matrix = at + k + 1, at + 2 * k + 1
    for i in range(k):
        for j in range(k):
            if not minimum:
                entry = matrix + i * k + j
            elif j <= i:
                entry = matrix + i * (i + 1) // 2 + j
            else:
                entry = matrix + j * (j + 1) // 2 + i
            scratch[i, j] = work[entry * LANES + lane]
        scratch[i, k] = -work[(first + i) * LANES + lane]
    convex = 1.0
    for i in range(k):
        if minimum:
            diagonal = abs(work[(matrix + i * (i + 3) // 2) * LANES + lane])
            if not scratch[i, i] > POSITIVE * diagonal:
                convex = 0.0
                scratch[i, i] = max(abs(scratch[i, i]), LEAST_PIVOT * (1.0 + diagonal))
        else:
            largest = i
            for j in range(i + 1, k):
                if abs(scratch[j, i]) > abs(scratch[largest, i]):
                    largest = j
            for j in range(k + 1):
                scratch[i, j], scratch[largest, j] = scratch[largest, j], scratch[i, j]
        for j in range(i + 1, k):
            factor = scratch[j, i] / scratch[i, i]
            for m in range(i, k + 1):
                scratch[j, m] -= factor * scratch[i, m]
    for i in range(k - 1, -1, -1):
        for j in range(i + 1, k):
            scratch[i, k] -= scratch[i, j] * scratch[j, k]
        scratch[i, k] /= scratch[i, i]
    slope = 0.0
    for i in range(k):
        G = work[(first + i) * LANES + lane]
        slope += G * scratch[i, k] if minimum else -G * G
    scratch[k - 1, 0] = convex
    return slope


@helper
def _value(work, at, k, minimum, lane):
    """Return the potential, or half the squared residual."""
    if minimum:
        return work[(at + k) * LANES + lane]
    total = 0.0
    for i in range(k):
        total += work[(at + k + 1 + i) * LANES + lane] ** 2 / 2
    return total


@helper
def _begin(work, lists, row, lanes):
    """Put the unknowns of all lanes where their search starts.

    ``lists`` has from ``row`` on: k, 0 for a root, 1 for a minimum, 2 for one that may be a saddle, the first instruction of
    the program for value, gradient and matrix, its end, the register described in `_direction` (behind the step: value before,
    slope, part of the step that is tried: -1 at the start, 0 where the search has arrived), and the registers of the starts.
    """
    k, at = lists[row], lists[row + 4]
    size = k * (k + 1) // 2 if lists[row + 1] else k * k
    part = at + 4 * k + 3 + size
    for lane in range(lanes):
        work[part * LANES + lane] = -1.0
        for i in range(k):
            work[(at + i) * LANES + lane] = work[lists[row + 5 + i] * LANES + lane]


@helper
def _advance(work, lists, row, lanes, scratch):
    """Judge the place that each lane has tried, and choose its next; return whether any search goes on.

    A step of Newton's method is halved until it lowers the potential, or the residual, enough.
    """
    k, minimum, at = lists[row], lists[row + 1], lists[row + 4]
    size = k * (k + 1) // 2 if minimum else k * k
    before = at + 2 * k + 1 + size
    step = before + k
    value, slope, part = step + k, step + k + 1, step + k + 2
    moving = False
    for lane in range(lanes):
        length = work[part * LANES + lane]
        if length == 0.0:
            continue
        now, old = _value(work, at, k, minimum, lane), work[value * LANES + lane]
        rounding = ROUNDING * (math.sqrt(1.0 + old * old) if minimum else abs(old))
        low = now <= old + 1e-4 * length * work[slope * LANES + lane] + rounding
        if minimum and not low and now <= old + CANCELLED * math.sqrt(1.0 + old * old):  # the slope says more than the value
            rate = 0.0
            for i in range(k):
                rate += work[(at + k + 1 + i) * LANES + lane] * work[(step + i) * LANES + lane]
            low = rate <= -FLATTER * work[slope * LANES + lane]
        if length > SHORTEST and not low:
            work[part * LANES + lane] = length / 2
            for i in range(k):
                change = work[(step + i) * LANES + lane] * length / 2
                work[(at + i) * LANES + lane] = work[(before + i) * LANES + lane] + change
            moving = True
            continue
        work[slope * LANES + lane] = _direction(work, at, k, minimum, lane, scratch)
        work[value * LANES + lane] = now
        arrived = True
        for i in range(k):
            x, change = work[(at + i) * LANES + lane], scratch[i, k]
            work[(before + i) * LANES + lane] = x
            work[(step + i) * LANES + lane] = change
            work[(at + i) * LANES + lane] = x + change
            arrived = arrived and change * change <= SETTLED * SETTLED * (SMALLEST + x * x)
        if arrived and minimum == 1 and scratch[k - 1, 0] == 0.0:  # a saddle or a maximum
            for i in range(k):
                work[(at + i) * LANES + lane] = math.nan
        work[part * LANES + lane] = 0.0 if arrived else 1.0
        moving = moving or not arrived
    return moving


@helper
def _give_up(work, lists, row, lanes):
    """Put nan where a search has not arrived."""
    k, at = lists[row], lists[row + 4]
    part = at + 4 * k + 3 + (k * (k + 1) // 2 if lists[row + 1] else k * k)
    for lane in range(lanes):
        if work[part * LANES + lane] != 0.0:
            for i in range(k):
                work[(at + i) * LANES + lane] = math.nan


@instruction
def _address(builder: Builder, array: Any, offset: int) -> int:
    return builder.add(array.address, offset)


class Instructions(NamedTuple):
    """A program as the kernel takes it; see `contin.functions.program.Program`. ``seed``: of `contin.functions.round_off`."""

    code: IndexMatrix
    lists: IndexVector
    scalars: Vector
    tables: Vector
    seed: int


class Points(NamedTuple):
    """Points: ``t`` (K,), ``u`` (K, n), ``v`` (K, m), or (0, m) if no instruction reads it."""

    t: Vector
    u: Matrix
    v: Matrix


class Room(NamedTuple):
    """The registers, and a small linear system."""

    work: Vector
    scratch: Matrix


@kernel(reorder=False)
def evaluate(instructions: Instructions, first: int, last: int, points: Points, room: Room, out: Matrix, jac: Stack) -> None:
    """Run a program: its first stretch once, its second, up to the instruction ``last``, for each block of points.

    ``out`` (K, values) and ``jac`` (K, values, columns) are filled where instructions store something.
    """
    code, lists, scalars, tables = instructions.code, instructions.lists, instructions.scalars, instructions.tables
    t, u, v = points.t, points.u, points.v
    work, scratch = room.work, room.scratch
    widths = Widths(8 * u.shape[1], 8 * v.shape[1], 8 * out.shape[1], 8 * jac.shape[1] * jac.shape[2])
    count = u.shape[0]
    for block in range(-1, (count + LANES - 1) // LANES):
        point = max(block, 0) * LANES
        lanes = min(LANES, count - point) if block >= 0 else 1
        memory = Memory(
            _address(code, 0), _address(work, 0), _address(scalars, 0), _address(lists, 0), _address(t, 8 * point),
            _address(u, widths.u * point), _address(v, widths.v * point), _address(out, widths.out * point),
            _address(jac, widths.jac * point),
        )  # fmt: skip
        now, end = (0, first) if block < 0 else (first, last)
        while True:
            now = interpret(memory, widths, lanes, now, end)
            if now >= end:
                break
            if code[now, 0] == POLYGAMMA:
                for lane in range(lanes):
                    work[code[now, 1] * LANES + lane] = polygamma(code[now, 3], work[code[now, 2] * LANES + lane])
            elif code[now, 0] == TABLE_OF:
                for lane in range(lanes):
                    work[code[now, 1] * LANES + lane] = _table(tables, code[now, 3], work[code[now, 2] * LANES + lane])
            else:
                row, moving = code[now, 2], True
                _begin(work, lists, row, lanes)
                for _ in range(EVALUATIONS):
                    interpret(memory, widths, lanes, lists[row + 2], lists[row + 3])
                    moving = _advance(work, lists, row, lanes, scratch)
                    if not moving:
                        break
                if moving:
                    _give_up(work, lists, row, lanes)
            now += 1
    if instructions.seed:
        for i in range(out.shape[0]):
            for a in range(out.shape[1]):
                out[i, a] = _moved(out[i, a], instructions.seed)
        for i in range(jac.shape[0]):
            for a in range(jac.shape[1]):
                for b in range(jac.shape[2]):
                    jac[i, a, b] = _moved(jac[i, a, b], instructions.seed)


@instruction
def _bits(builder: Builder, value: float) -> int:
    return builder.bitcast(value, parts.whole())


@instruction
def _number_of(builder: Builder, bits: int) -> float:
    return builder.bitcast(bits, parts.double())


@helper
def _moved(value, seed):
    """Return a value moved as `contin.functions.round_off.move` does."""
    if not SMALLEST_NORMAL <= abs(value) < math.inf:
        return value
    bits = _bits(value)
    mixed = (bits ^ (seed * GOLDEN)) * FIRST_FACTOR
    mixed = (mixed ^ ((mixed >> 27) & 0x1FFFFFFFFF)) * SECOND_FACTOR
    return _number_of(bits + ((mixed >> 33) & 0x7FFFFFFF) % 3 - 1)


class Loaded(NamedTuple):
    """A program with registers of its own, as kernels run it; ``parameters`` is where these stand among its scalars."""

    instructions: Instructions
    first: int
    last: int
    room: Room
    parameters: int


#: No values.
_NONE = np.empty(0)


def load(program: Program, first: int = 0, values: Array = _NONE) -> Loaded:
    """Return a program with registers of its own; ``values`` are those of parameters from the ``first`` on."""
    instructions = Instructions(program.code, program.lists, program.scalars.copy(), program.tables, round_off.SEED)
    at = program.parameters + first
    instructions.scalars[at : at + len(values)] = values
    room = Room(np.empty(program.registers * LANES), np.empty((max(program.unknowns, 1), program.unknowns + 1)))
    return Loaded(instructions, program.first, program.last, room, program.parameters)


@helper
def run_loaded(loaded: Loaded, p: Array, points: Points, out: Array, jac: Array) -> None:
    """Run a program in a kernel, with parameters p; see `evaluate`."""
    for i in range(p.size):
        loaded.instructions.scalars[loaded.parameters + i] = p[i]
    evaluate(loaded.instructions, loaded.first, loaded.last, points, loaded.room, out, jac)


def run(program: Program, points: Any, p: Array, out: Array, jac: Array) -> None:
    """Run a program at points (t, u, v) with parameters p; see `evaluate`. To name them, as `Points`, would take a tenth."""
    try:
        kept = program.rooms.pop()  # another thread has its own
    except IndexError:
        loaded = load(program)
        kept = loaded.instructions.scalars[loaded.parameters : loaded.parameters + p.size], *loaded[:4]
    given, instructions, first, last, room = kept
    given[:] = p
    evaluate(instructions, first, last, points, room, out, jac)
    program.rooms.append(kept)


def of_columns(tape: Tape, places: Sequence[int], slots: Sequence[Hashable]) -> Callable[[Array], Array]:
    """Return the function that takes inputs as columns (points, slots) to the values of operations (points, places)."""
    found = program(tape, list(zip(places, range(len(places)))), Inputs({slot: k for k, slot in enumerate(slots)}, {}, {}))

    def values(u: Array) -> Array:
        out, none = np.empty((len(u), len(places))), np.empty((0, 0))
        times = u[:, list(slots).index(TIME)].copy() if TIME in slots else np.zeros(len(u))
        run(found, (times, u, none), none.ravel(), out, np.empty((0, 0, 0)))
        return out

    return values


#: Factors of the hash, as in `contin.functions.round_off.move`, as signed numbers; the smallest number of full precision.
GOLDEN, FIRST_FACTOR, SECOND_FACTOR = (factor - 2**64 for factor in round_off.FACTORS)
SMALLEST_NORMAL = 2.2250738585072014e-308
#: Codes of the operations that are written in Python.
POLYGAMMA, TABLE_OF = CODES["polygamma"], CODES["table"]
#: Places that a search for unknowns tries, halved steps included. Damped steps on a convex function arrive in 5 to 20.
EVALUATIONS = 200
#: A step is not halved below this part of itself.
SHORTEST = 1e-12
#: A step below this part of the unknown is the last: the next would be its square. Ten times larger, 1e-16 would be lost.
SETTLED = 1e-9
#: Square of the size below which an unknown counts as this large. Smaller unknowns are found to 1e-9 of this size squared.
SMALLEST = 1.0
#: A potential that rises by less than this part of 1 + itself may have fallen: large terms of it cancel. The step is accepted
#: if the slope along it is at most `FLATTER` times the former one uphill (approximate Wolfe condition, Hager & Zhang 2005).
CANCELLED = 1e-10
FLATTER = 0.9
#: Pivots of a Hessian below this part of its diagonal are round-off of its elimination, which makes 1e-16 to 1e-14. Ten times
#: larger, minima of that condition would be called saddles.
POSITIVE = 1e-13
#: Where a potential is not convex, a pivot is at least this part of 1 + the diagonal: Newton's step is then long, and damped.
LEAST_PIVOT = 1e-3
#: A potential that does not decrease by more than its round-off is accepted.
ROUNDING = 1e-14
