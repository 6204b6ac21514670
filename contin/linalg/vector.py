"""The inner loops of elimination and substitution as vector instructions, written in LLVM's language.

numba compiles a loop over two slices with tests of their ends, of whether they overlap, and a loop for what is left over. On
rows of ten to fifty numbers that takes longer than the arithmetic.

Each function here writes the body of one instruction: its ``builder`` appends LLVM operations, its other arguments stand for
the numbers that a kernel passes. A Python loop is unrolled in the machine code; a loop of the machine is a `for_range`.
Addresses and strides are in bytes. Sums and products have the options of the kernel that calls the instruction: by default a
product and a sum may be rounded together, and sums evaluated in any order.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, NamedTuple

from contin.functions.interpreter import GROUP
from contin.kernels.kernel_parts import Builder, Value, constant, double, for_range, instruction, llvm, variable, whole

#: Columns that are eliminated together, and rows that are updated together. With 2 elimination takes 1.2 times as long, with 8
#: 1.1 times. Code for each size up to it is written: with 16 kernels take 2.7 times as long to compile.
PANEL = 4
#: Right-hand sides that are solved for together, side by side, so that matrices of all shapes make full vectors. With 2 three
#: right-hand sides take 1.5 times as long; with 8 a single one takes 1.3 times as long, with 32 four times.
LANES = 4


class Rows(NamedTuple):
    """Rows of a matrix from an entry on: the entry's address, and the distance between rows."""

    address: int
    stride: int


# --- addresses -------------------------------------------------------------------------------------------------------


@instruction
def address(builder: Builder, array: Any, offset: int) -> int:
    """Return an address in an array."""
    return builder.add(array.address, offset)


@instruction
def at(builder: Builder, matrix: Any, i: int, j: int) -> Rows:
    """Return the rows of a matrix from entry (i, j) on."""
    return _within(builder, Rows(matrix.address, matrix.strides[0]), i, j)


@instruction
def page(builder: Builder, stack: Any, j: int) -> Rows:
    """Return the rows of a stack's matrix j."""
    return Rows(builder.add(stack.address, builder.mul(j, stack.strides[0])), stack.strides[1])


@instruction
def within(builder: Builder, rows: Rows, i: int, j: int) -> Rows:
    """Return the rows of a block from entry (i, j) on."""
    return _within(builder, rows, i, j)


@instruction
def entry(builder: Builder, vector: int, i: int) -> int:
    """Return the address of an entry of a vector whose entries are `LANES` numbers."""
    return _entry(builder, vector, i)


# --- elimination -----------------------------------------------------------------------------------------------------


@instruction
def subtract_products(builder: Builder, target: Rows, factors: Rows, pivots: Rows, length: int, rows: int, count: int) -> None:
    """target[r, :length] -= sum over k of factors[r, k] * pivots[k, :length], for r < ``rows`` and k < ``count`` <= `PANEL`."""

    def subtract(first: Value, together: int, size: int) -> None:
        targets, sources = _rows(builder, _below(builder, target, first), together), _rows(builder, pivots, size)
        multipliers = [
            [builder.fneg(_load(builder, _right(builder, row, k))) for k in range(size)]
            for row in _rows(builder, _below(builder, factors, first), together)
        ]

        def tile(offset: Value, width: int) -> None:
            above = [_load(builder, builder.add(source, offset), width) for source in sources]
            for row, multiplier in zip(targets, multipliers):
                there = builder.add(row, offset)
                total = _load(builder, there, width)
                for vector, factor in zip(above, multiplier):
                    total = _plus(builder, total, factor, vector)
                _store(builder, total, there)

        _for_tiles(builder, length, tile)

    def write(size: int) -> None:
        whole = builder.udiv(rows, _number(PANEL))
        with for_range(builder, whole) as loop:
            subtract(builder.mul(loop.index, _number(PANEL)), PANEL, size)
        done = builder.mul(whole, _number(PANEL))
        with for_range(builder, builder.sub(rows, done)) as loop:
            subtract(builder.add(done, loop.index), 1, size)

    _for_size(builder, count, write)


@instruction
def solve_triangle(builder: Builder, rows: Rows, factors: Rows, length: int, count: int) -> None:
    """rows[k, :length] -= sum over l < k of factors[k, l] * rows[l, :length], for k = 1 ... ``count`` - 1 < `PANEL`."""

    def write(size: int) -> None:
        places = _rows(builder, rows, size)
        multipliers = [
            [builder.fneg(_load(builder, _right(builder, row, k))) for k in range(r)]
            for r, row in enumerate(_rows(builder, factors, size))
        ]

        def tile(offset: Value, width: int) -> None:
            done: list[Value] = []
            for place, multiplier in zip(places, multipliers):
                there = builder.add(place, offset)
                total = _load(builder, there, width)
                for vector, factor in zip(done, multiplier):
                    total = _plus(builder, total, factor, vector)
                done.append(total)
                _store(builder, total, there)

        _for_tiles(builder, length, tile)

    _for_size(builder, count, write, smallest=2)


@instruction
def reduce_column(builder: Builder, pivot: Rows, count: int, column: int, size: int) -> int:
    """Eliminate one column of a panel from the ``count`` rows below its pivot row, within the panel.

    ``pivot`` is the panel from the pivot row on: `PANEL` columns that must exist, of which ``size`` belong to it. Multipliers
    take the place of the ``column``. Return the index, from 0, of the row below the pivot row that has the largest entry in
    the next column.
    """
    vector = llvm().VectorType(double(), PANEL)
    lanes = constant(llvm().VectorType(whole(), PANEL), list(range(PANEL)))
    here = builder.icmp_signed("==", lanes, _splat(builder, column, PANEL))
    right = builder.icmp_signed(">", lanes, _splat(builder, column, PANEL))
    right = builder.and_(right, builder.icmp_signed("<", lanes, _splat(builder, size, PANEL)))
    upper = builder.select(right, _load(builder, pivot.address, PANEL), constant(vector, [0.0] * PANEL))
    at_column = builder.mul(column, _number(8))
    last = builder.icmp_signed(">=", builder.add(column, _number(1)), size)
    at_next = builder.select(last, at_column, builder.add(at_column, _number(8)))
    divisor = _load(builder, builder.add(pivot.address, at_column))
    following = _load(builder, builder.add(pivot.address, at_next))
    absolute = builder.module.declare_intrinsic("llvm.fabs", [double()])
    best, where = variable(builder, constant(double(), -1.0)), variable(builder, _number(0))
    row = variable(builder, builder.add(pivot.address, pivot.stride))
    with for_range(builder, count) as loop:
        address = builder.load(row)
        factor = builder.fdiv(_load(builder, builder.add(address, at_column)), divisor)
        ahead = _load(builder, builder.add(address, at_next))
        ahead = builder.call(absolute, [builder.fsub(ahead, builder.fmul(factor, following))])
        wide = _splat(builder, factor, PANEL)
        value = _load(builder, address, PANEL)
        value = builder.fsub(value, builder.fmul(wide, upper))
        _store(builder, builder.select(here, wide, value), address)
        larger = builder.fcmp_ordered(">", ahead, builder.load(best))
        builder.store(builder.select(larger, ahead, builder.load(best)), best)
        builder.store(builder.select(larger, loop.index, builder.load(where)), where)
        builder.store(builder.add(address, pivot.stride), row)
    return builder.load(where)


@instruction
def invert_triangles(builder: Builder, block: Rows, count: int) -> None:
    """Put the inverses in place of both triangles of a block (count, count), the lower with unit diagonal; count <= `PANEL`."""

    def write(size: int) -> None:
        places = [[_right(builder, row, c) for c in range(size)] for row in _rows(builder, block, size)]
        old = [[_load(builder, place) for place in row] for row in places]
        new: dict[tuple[int, int], Value] = {}

        def product(r: int, c: int, between: range, total: Value) -> Value:
            for k in between:
                term = builder.fmul(new[r, k], old[k][c]) if r < c else builder.fmul(old[r][k], new[k, c])
                total = term if total is None else builder.fadd(total, term)
            return total

        for c in range(size):
            new[c, c] = builder.fdiv(constant(double(), 1.0), old[c][c])
            for r in range(c):
                new[r, c] = builder.fneg(builder.fmul(product(r, c, range(r, c), None), new[c, c]))
        for c in range(size):
            for r in range(c + 1, size):
                new[r, c] = builder.fneg(product(r, c, range(c + 1, r), old[r][c]))
        for (r, c), value in new.items():
            _store(builder, value, places[r][c])

    _for_size(builder, count, write)


@instruction
def multiply_rows(builder: Builder, rows: Rows, number: int, block: Rows, count: int) -> None:
    """rows[i, :count] = rows[i, :count] @ the upper triangle of the block (count, count), for i < ``number``; count <= `PANEL`.

    Rows and block must reach to `PANEL` columns.
    """

    def write(size: int) -> None:
        vector, bits = llvm().VectorType(double(), PANEL), llvm().VectorType(whole(1), PANEL)
        zero = constant(vector, [0.0] * PANEL)
        upper = []
        for r, address in enumerate(_rows(builder, block, size)):
            mask = constant(bits, [int(r <= c < size) for c in range(PANEL)])
            upper.append(builder.select(mask, _load(builder, address, PANEL), zero))
        inside = constant(bits, [int(c < size) for c in range(PANEL)])
        with for_range(builder, number) as loop:
            row = _below(builder, rows, loop.index).address
            old, total = _load(builder, row, PANEL), None
            for k, values in enumerate(upper):
                total = _plus(builder, total, _load(builder, _right(builder, row, k)), values)
            _store(builder, builder.select(inside, total, old), row)

    _for_size(builder, count, write)


@instruction
def exchange(builder: Builder, a: int, b: int, length: int) -> None:
    """Exchange ``length`` numbers at two addresses."""

    def tile(offset: Value, width: int) -> None:
        places = [builder.add(address, offset) for address in (a, b)]
        values = [_load(builder, place, width) for place in places]
        for value, place in zip(values, places[::-1]):
            _store(builder, value, place)

    _for_tiles(builder, length, tile)


@instruction
def copy_rows(builder: Builder, target: Rows, source: Rows, length: int, rows: int) -> None:
    """target[r, :length] = source[r, :length] for r < ``rows``."""
    with for_range(builder, rows) as loop:
        there, here = (_below(builder, matrix, loop.index).address for matrix in (target, source))

        def tile(offset: Value, width: int) -> None:
            _store(builder, _load(builder, builder.add(here, offset), width), builder.add(there, offset))

        _for_tiles(builder, length, tile)


@instruction
def spread(builder: Builder, target: int, places: int, values: int, scale: float, source: int, length: int, count: int) -> None:
    """target[places[k] :][:length] = scale * values[k] * source[:length] for k < ``count``; all others are addresses."""

    def tile(offset: Value, width: int) -> None:
        row, first = _load(builder, builder.add(source, offset), width), builder.add(target, offset)
        row = builder.fmul(_splat(builder, scale, width), row)
        with for_range(builder, count) as loop:
            at = builder.mul(loop.index, _number(8))
            place = builder.load(builder.inttoptr(builder.add(places, at), whole().as_pointer()))
            value = _splat(builder, _load(builder, builder.add(values, at)), width)
            _store(builder, builder.fmul(value, row), builder.add(first, builder.mul(place, _number(8))))

    _for_tiles(builder, length, tile)


@instruction
def combine(builder: Builder, target: int, factors: int, rows: Rows, length: int, count: int) -> None:
    """target[:length] = sum over k < ``count`` of factors[k] * rows[k, :length], for two addresses."""

    def tile(offset: Value, width: int) -> None:
        total = variable(builder, constant(llvm().VectorType(double(), width), [0.0] * width))
        with for_range(builder, count) as loop:
            factor = _load(builder, builder.add(factors, builder.mul(loop.index, _number(8))))
            row = _load(builder, builder.add(_below(builder, rows, loop.index).address, offset), width)
            builder.store(_plus(builder, builder.load(total), factor, row), total)
        _store(builder, builder.load(total), builder.add(target, offset))

    _for_tiles(builder, length, tile)


# --- substitution: each entry of a vector is LANES numbers side by side ----------------------------------------------


@instruction
def subtract_rows(builder: Builder, target: int, matrix: Rows, vectors: int, length: int, rows: int) -> None:
    """target[r] -= sum over j < ``length`` of matrix[r, j] * vectors[j], for r < ``rows``."""

    def subtract(first: Value, together: int) -> None:
        ours = _rows(builder, _below(builder, matrix, first), together)
        zero = constant(llvm().VectorType(double(), LANES), [0.0] * LANES)
        totals = [[variable(builder, zero) for _ in ours] for _ in range(2)]  # two sums, so that one need not wait

        def add(j: Value, places: list[Value]) -> None:
            value = _load(builder, _entry(builder, vectors, j), LANES)
            for row, place in zip(ours, places):
                factor = _load(builder, builder.add(row, builder.mul(j, _number(8))))
                builder.store(_plus(builder, builder.load(place), factor, value), place)

        half = builder.lshr(length, _number(1))
        with for_range(builder, half) as loop:
            even = builder.shl(loop.index, _number(1))
            add(even, totals[0])
            add(builder.add(even, _number(1)), totals[1])
        last = builder.shl(half, _number(1))
        with builder.if_then(builder.icmp_unsigned("<", last, length)):
            add(last, totals[0])
        for r, (one, two) in enumerate(zip(*totals)):
            place = _entry(builder, target, builder.add(first, _number(r)))
            total = builder.fadd(builder.load(one), builder.load(two))
            _store(builder, builder.fsub(_load(builder, place, LANES), total), place)

    _for_panels(builder, rows, subtract)


@instruction
def subtract_columns(builder: Builder, target: int, matrix: Rows, vectors: int, length: int, rows: int) -> None:
    """target[j] -= sum over r < ``rows`` of matrix[r, j] * vectors[r], for j < ``length``."""

    def subtract(first: Value, together: int) -> None:
        ours = _rows(builder, _below(builder, matrix, first), together)
        places = [_entry(builder, vectors, builder.add(first, _number(r))) for r in range(together)]
        values = [builder.fneg(_load(builder, place, LANES)) for place in places]
        with for_range(builder, length) as loop:
            place = _entry(builder, target, loop.index)
            total = _load(builder, place, LANES)
            for row, value in zip(ours, values):
                factor = _load(builder, builder.add(row, builder.mul(loop.index, _number(8))))
                total = _plus(builder, total, factor, value)
            _store(builder, total, place)

    _for_panels(builder, rows, subtract)


@instruction
def apply_lower(builder: Builder, vectors: int, block: Rows, count: int) -> None:
    """vectors = L vectors, with the lower triangle L of the block (count, count), ones on its diagonal; count <= `PANEL`."""
    _apply(builder, vectors, block, count, lower=True, transposed=False)


@instruction
def apply_upper(builder: Builder, vectors: int, block: Rows, count: int) -> None:
    """vectors = U vectors, with the upper triangle U of the block (count, count); count <= `PANEL`."""
    _apply(builder, vectors, block, count, lower=False, transposed=False)


@instruction
def apply_lower_transposed(builder: Builder, vectors: int, block: Rows, count: int) -> None:
    """vectors = L^T vectors, with the L of `apply_lower`."""
    _apply(builder, vectors, block, count, lower=True, transposed=True)


@instruction
def apply_upper_transposed(builder: Builder, vectors: int, block: Rows, count: int) -> None:
    """vectors = U^T vectors, with the U of `apply_upper`."""
    _apply(builder, vectors, block, count, lower=False, transposed=True)


def _apply(builder: Builder, vectors: Value, block: Rows, count: Value, lower: bool, transposed: bool) -> None:
    """Write the product of a triangle and ``count`` vectors."""

    def write(size: int) -> None:
        rows = _rows(builder, block, size)
        places = [_entry(builder, vectors, _number(k)) for k in range(size)]
        old = [_load(builder, place, LANES) for place in places]
        for i, place in enumerate(places):
            total = old[i] if lower else None
            for j in range(size):
                r, c = (j, i) if transposed else (i, j)
                if (c < r) if lower else (c >= r):
                    total = _plus(builder, total, _load(builder, _right(builder, rows[r], c)), old[j])
            _store(builder, total, place)

    _for_size(builder, count, write)


@instruction
def move(builder: Builder, target: int, source: int) -> None:
    """Copy one entry, `LANES` numbers, from an address to another."""
    _store(builder, _load(builder, source, LANES), target)


@instruction
def add(builder: Builder, target: int, source: int) -> None:
    """Add one entry at an address to that at another."""
    _store(builder, builder.fadd(_load(builder, target, LANES), _load(builder, source, LANES)), target)


@instruction
def clear(builder: Builder, target: int) -> None:
    """Make one entry zero."""
    _store(builder, constant(llvm().VectorType(double(), LANES), [0.0] * LANES), target)


@instruction
def side_by_side(builder: Builder, target: int, source: Rows, length: int, rows: int) -> None:
    """target[i] = source[:LANES, i] for i < ``length``; where there are fewer ``rows``, the last of them again."""
    places = [source.address]
    for lane in range(1, LANES):
        there = builder.icmp_unsigned("<", _number(lane), rows)
        places.append(builder.select(there, builder.add(places[-1], source.stride), places[-1]))
    with for_range(builder, length) as loop:
        entry = constant(llvm().VectorType(double(), LANES), llvm().Undefined)
        for lane, place in enumerate(places):
            value = _load(builder, builder.add(place, builder.mul(loop.index, _number(8))))
            entry = builder.insert_element(entry, value, constant(whole(32), lane))
        _store(builder, entry, _entry(builder, target, loop.index))


@instruction
def apart(builder: Builder, target: Rows, source: int, length: int, rows: int) -> None:
    """target[r, i] = source[i, r] for i < ``length`` and r < min(``rows``, `LANES`)."""

    def write(size: int) -> None:
        places = _rows(builder, target, size)
        with for_range(builder, length) as loop:
            entry = _load(builder, _entry(builder, source, loop.index), LANES)
            for lane, place in enumerate(places):
                value = builder.extract_element(entry, constant(whole(32), lane))
                _store(builder, value, builder.add(place, builder.mul(loop.index, _number(8))))

    fewer = builder.icmp_unsigned("<", rows, _number(LANES))
    _for_size(builder, builder.select(fewer, rows, _number(LANES)), write, largest=LANES)


# --- parts of the bodies ---------------------------------------------------------------------------------------------


def _number(value: int) -> Value:
    return constant(whole(), value)


def _below(builder: Builder, rows: Rows, first: Value) -> Rows:
    """Return the rows from the ``first`` on."""
    return Rows(builder.add(rows.address, builder.mul(rows.stride, first)), rows.stride)


def _within(builder: Builder, rows: Rows, i: Value, j: Value) -> Rows:
    """Return the rows from entry (i, j) on."""
    below = _below(builder, rows, i)
    return Rows(builder.add(below.address, builder.mul(j, _number(8))), below.stride)


def _rows(builder: Builder, rows: Rows, count: int) -> list[Value]:
    """Return the addresses of the first ``count`` rows."""
    return [_below(builder, rows, _number(r)).address for r in range(count)]


def _right(builder: Builder, row: Value, column: int) -> Value:
    """Return the address of an entry of a row."""
    return builder.add(row, _number(8 * column))


def _entry(builder: Builder, vectors: Value, index: Value) -> Value:
    """Return the address of an entry of a vector whose entries are `LANES` numbers."""
    return builder.add(vectors, builder.mul(index, _number(8 * LANES)))


def _load(builder: Builder, address: Value, width: int = 0) -> Value:
    """Return the number at an address, or the vector of ``width`` numbers."""
    kind = llvm().VectorType(double(), width) if width else double()
    value = builder.load(builder.inttoptr(address, kind.as_pointer()))
    value.align = 8
    return value


def _store(builder: Builder, value: Value, address: Value) -> None:
    builder.store(value, builder.inttoptr(address, value.type.as_pointer())).align = 8


def _splat(builder: Builder, value: Value, width: int) -> Value:
    """Return a vector with the same value in all places."""
    none = constant(llvm().VectorType(value.type, width), llvm().Undefined)
    first = builder.insert_element(none, value, constant(whole(32), 0))
    return builder.shuffle_vector(first, none, constant(llvm().VectorType(whole(32), width), [0] * width))


def _plus(builder: Builder, total: Value, factor: Value, vector: Value) -> Value:
    """Return total + factor * vector, for a number and two vectors; the product alone if there is no total."""
    product = builder.fmul(_splat(builder, factor, vector.type.count), vector)
    return product if total is None else builder.fadd(total, product)


def _for_tiles(builder: Builder, length: Value, tile: Callable[[Value, int], None]) -> None:
    """Write ``tile(offset in bytes, width)`` for ``length`` numbers: `GROUP` at a time, then half as many, and so on."""
    whole = builder.udiv(length, _number(GROUP))
    with for_range(builder, whole) as loop:
        tile(builder.mul(loop.index, _number(8 * GROUP)), GROUP)
    offset, width = builder.mul(whole, _number(8 * GROUP)), GROUP // 2
    while width:
        there = builder.icmp_unsigned("!=", builder.and_(length, _number(width)), _number(0))
        with builder.if_then(there):
            tile(offset, width)
        offset = builder.select(there, builder.add(offset, _number(8 * width)), offset)
        width //= 2


def _for_size(builder: Builder, size: Value, write: Callable[[int], None], smallest: int = 1, largest: int = PANEL) -> None:
    """Write ``write(case)`` for each size in a range, and the choice among them by ``size``; other sizes do nothing."""
    end = builder.append_basic_block()
    choice = builder.switch(size, end)
    for case in range(smallest, largest + 1):
        block = builder.append_basic_block()
        choice.add_case(case, block)
        builder.position_at_end(block)
        write(case)
        builder.branch(end)
    builder.position_at_end(end)


def _for_panels(builder: Builder, rows: Value, write: Callable[[Value, int], None]) -> None:
    """Write ``write(first row, number of rows)`` for all rows: `PANEL` at a time, then for the rest at once."""
    whole = builder.udiv(rows, _number(PANEL))
    with for_range(builder, whole) as loop:
        write(builder.mul(loop.index, _number(PANEL)), PANEL)
    first = builder.mul(whole, _number(PANEL))
    _for_size(builder, builder.sub(rows, first), lambda size: write(first, size), largest=PANEL - 1)
