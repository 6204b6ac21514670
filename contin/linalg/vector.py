"""The inner loops of elimination and back-substitution, as explicit vector instructions.

numba compiles a loop over two slices with tests of their ends, of whether they overlap, and a loop for what is left over; on
rows of ten to fifty numbers that takes longer than the arithmetic. Here the instructions are written out in LLVM's language,
which turns them into those of the machine. Matrices are given by the address of an entry and the distance between rows, both
in bytes.
"""

from __future__ import annotations

from typing import Any

from llvmlite import ir
from numba import extending, types
from numba.core import cgutils

intrinsic: Any = extending.intrinsic
_DOUBLE, _INT32, _BIT = ir.DoubleType(), ir.IntType(32), ir.IntType(1)
#: Products and sums may be fused.
_FUSED = ("contract",)
#: Columns that are updated at a time, and then for what is left over.
_WIDTHS = (8, 4, 2, 1)
#: Columns of a panel that `reduce_column` takes as one vector.
PANEL = 4
#: Right-hand sides that are solved for together, side by side: with them a matrix of any shape makes full vectors.
LANES = 4


def _splat(builder: Any, value: Any, width: int, kind: Any = _DOUBLE) -> Any:
    """A vector with the same value in all places."""
    none = ir.Constant(ir.VectorType(kind, width), ir.Undefined)
    first = builder.insert_element(none, value, ir.Constant(_INT32, 0))
    return builder.shuffle_vector(first, none, ir.Constant(ir.VectorType(_INT32, width), [0] * width))


def _load(builder: Any, address: Any, kind: Any) -> Any:
    value = builder.load(builder.inttoptr(address, kind.as_pointer()))
    value.align = 8
    return value


def _store(builder: Any, value: Any, address: Any) -> None:
    builder.store(value, builder.inttoptr(address, value.type.as_pointer())).align = 8


def _fused(builder: Any, factor: Any, vector: Any, total: Any) -> Any:
    """total + factor * vector, for a number and two vectors; the product alone without a total."""
    product = builder.fmul(_splat(builder, factor, vector.type.count), vector, _FUSED)
    return product if total is None else builder.fadd(total, product, _FUSED)


def _number(word: Any, value: int) -> Any:
    return ir.Constant(word, value)


def _rows(builder: Any, base: Any, stride: Any, count: int) -> list[Any]:
    """Addresses of the first rows of a matrix."""
    return [builder.add(base, builder.mul(stride, _number(base.type, r))) for r in range(count)]


def _for_tiles(builder: Any, length: Any, tile: Any) -> None:
    """Call ``tile(offset in bytes, width)`` for all of ``length`` numbers: eight at a time, then for what is left over."""
    word = length.type
    whole = builder.lshr(length, _number(word, 3))
    with cgutils.for_range(builder, whole) as loop:
        tile(builder.mul(loop.index, _number(word, 64)), 8)
    offset = builder.mul(whole, _number(word, 64))
    for width in _WIDTHS[1:]:
        there = builder.icmp_unsigned("!=", builder.and_(length, _number(word, width)), _number(word, 0))
        with builder.if_then(there):
            tile(offset, width)
        offset = builder.select(there, builder.add(offset, _number(word, 8 * width)), offset)


@intrinsic(prefer_literal=True)
def subtract_products(
    typing: Any, target: Any, stride: Any, factors: Any, step: Any, pivots: Any, apart: Any, length: Any, rows: Any, count: Any
) -> Any:
    """target[r, :length] -= sum over k of factors[r, k] * pivots[k, :length], for r < ``rows`` and k < ``count``.

    Rows of target, factors and pivots are ``stride``, ``step`` and ``apart`` apart; ``rows`` and ``count`` are literal numbers.
    """

    def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        target, stride, factors, step, pivots, apart, length = arguments[:7]
        targets = _rows(builder, target, stride, rows.literal_value)
        above = _rows(builder, pivots, apart, count.literal_value)
        multipliers = [
            [builder.fneg(_load(builder, builder.add(row, _number(row.type, 8 * k)), _DOUBLE)) for k in range(len(above))]
            for row in _rows(builder, factors, step, len(targets))
        ]

        def tile(offset: Any, width: int) -> None:
            vector = ir.VectorType(_DOUBLE, width)
            upper = [_load(builder, builder.add(address, offset), vector) for address in above]
            for address, factor in zip(targets, multipliers):
                there = builder.add(address, offset)
                total = _load(builder, there, vector)
                for value, one in zip(upper, factor):
                    total = _fused(builder, one, value, total)
                _store(builder, total, there)

        _for_tiles(builder, length, tile)
        return context.get_dummy_value()

    return types.void(*[types.intp] * 7, rows, count), generate


@intrinsic(prefer_literal=True)
def subtract_rows(typing: Any, target: Any, matrix: Any, apart: Any, vectors: Any, length: Any, rows: Any) -> Any:
    """target[r] -= sum over j < length of matrix[r, j] * vectors[j], for r < ``rows``, a literal number.

    Each entry of target and vectors is `LANES` numbers side by side.
    """

    def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        target, matrix, apart, vectors, length = arguments[:5]
        word, vector = length.type, ir.VectorType(_DOUBLE, LANES)
        ours = _rows(builder, matrix, apart, rows.literal_value)
        zero = ir.Constant(vector, [0.0] * LANES)
        totals = [[cgutils.alloca_once_value(builder, zero) for _ in ours] for _ in range(2)]  # two, to have more at a time

        def add(j: Any, places: list[Any]) -> None:
            value = _load(builder, builder.add(vectors, builder.mul(j, _number(word, 8 * LANES))), vector)
            for row, place in zip(ours, places):
                factor = _load(builder, builder.add(row, builder.mul(j, _number(word, 8))), _DOUBLE)
                builder.store(_fused(builder, factor, value, builder.load(place)), place)

        half = builder.lshr(length, _number(word, 1))
        with cgutils.for_range(builder, half) as loop:
            first = builder.shl(loop.index, _number(word, 1))
            add(first, totals[0])
            add(builder.add(first, _number(word, 1)), totals[1])
        last = builder.shl(half, _number(word, 1))
        with builder.if_then(builder.icmp_unsigned("<", last, length)):
            add(last, totals[0])
        for r, (one, two) in enumerate(zip(*totals)):
            place = builder.add(target, _number(word, 8 * LANES * r))
            total = builder.fadd(builder.load(one), builder.load(two))
            _store(builder, builder.fsub(_load(builder, place, vector), total), place)
        return context.get_dummy_value()

    return types.void(*[types.intp] * 5, rows), generate


@intrinsic(prefer_literal=True)
def subtract_columns(typing: Any, target: Any, matrix: Any, apart: Any, vectors: Any, length: Any, rows: Any) -> Any:
    """target[j] -= sum over r of matrix[r, j] * vectors[r], for j < length; r < ``rows``, a literal number.

    Each entry of target and vectors is `LANES` numbers side by side.
    """

    def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        target, matrix, apart, vectors, length = arguments[:5]
        word, vector = length.type, ir.VectorType(_DOUBLE, LANES)
        ours = _rows(builder, matrix, apart, rows.literal_value)
        values = [
            builder.fneg(_load(builder, builder.add(vectors, _number(word, 8 * LANES * r)), vector)) for r in range(len(ours))
        ]
        with cgutils.for_range(builder, length) as loop:
            place = builder.add(target, builder.mul(loop.index, _number(word, 8 * LANES)))
            total = _load(builder, place, vector)
            for row, value in zip(ours, values):
                factor = _load(builder, builder.add(row, builder.mul(loop.index, _number(word, 8))), _DOUBLE)
                total = _fused(builder, factor, value, total)
            _store(builder, total, place)
        return context.get_dummy_value()

    return types.void(*[types.intp] * 5, rows), generate


#: Which triangle of a block `apply_triangle` takes: the lower one with ones on its diagonal, the upper one; these transposed.
LOWER, UPPER, LOWER_TRANSPOSED, UPPER_TRANSPOSED = range(4)


@intrinsic(prefer_literal=True)
def apply_triangle(typing: Any, vectors: Any, block: Any, apart: Any, size: Any, kind: Any) -> Any:
    """vectors = T vectors with a triangle T, of the ``kind``, of the block (size, size); both are literal numbers.

    Each entry of vectors is `LANES` numbers side by side.
    """
    count, which = size.literal_value, kind.literal_value

    def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        vectors, block, apart = arguments[:3]
        word, vector = block.type, ir.VectorType(_DOUBLE, LANES)
        rows = _rows(builder, block, apart, count)
        places = [builder.add(vectors, _number(word, 8 * LANES * k)) for k in range(count)]
        old = [_load(builder, place, vector) for place in places]
        for i, place in enumerate(places):
            total = old[i] if which in (LOWER, LOWER_TRANSPOSED) else None
            for j in range(count):
                r, c = (j, i) if which in (LOWER_TRANSPOSED, UPPER_TRANSPOSED) else (i, j)
                if (c < r) if which in (LOWER, LOWER_TRANSPOSED) else (c >= r):
                    factor = _load(builder, builder.add(rows[r], _number(word, 8 * c)), _DOUBLE)
                    total = _fused(builder, factor, old[j], total)
            _store(builder, total, place)
        return context.get_dummy_value()

    return types.void(*[types.intp] * 3, size, kind), generate


@intrinsic(prefer_literal=True)
def solve_triangle(typing: Any, rows: Any, stride: Any, factors: Any, length: Any, count: Any) -> Any:
    """rows[k, :length] -= sum over l < k of factors[k, l] * rows[l, :length], for k = 1 ... count - 1, a literal number."""

    def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        rows, stride, factors, length = arguments[:4]
        places = _rows(builder, rows, stride, count.literal_value)
        multipliers = [
            [builder.fneg(_load(builder, builder.add(row, _number(row.type, 8 * other)), _DOUBLE)) for other in range(k)]
            for k, row in enumerate(_rows(builder, factors, stride, len(places)))
        ]

        def tile(offset: Any, width: int) -> None:
            vector = ir.VectorType(_DOUBLE, width)
            done: list[Any] = []
            for address, factor in zip(places, multipliers):
                there = builder.add(address, offset)
                total = _load(builder, there, vector)
                for value, one in zip(done, factor):
                    total = _fused(builder, one, value, total)
                done.append(total)
                _store(builder, total, there)

        _for_tiles(builder, length, tile)
        return context.get_dummy_value()

    return types.void(*[types.intp] * 4, count), generate


@intrinsic
def exchange(typing: Any, a: Any, b: Any, length: Any) -> Any:
    """Exchange ``length`` numbers at two addresses."""

    def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        a, b, length = arguments

        def tile(offset: Any, width: int) -> None:
            vector = ir.VectorType(_DOUBLE, width)
            places = [builder.add(address, offset) for address in (a, b)]
            values = [_load(builder, place, vector) for place in places]
            for value, place in zip(values, places[::-1]):
                _store(builder, value, place)

        _for_tiles(builder, length, tile)
        return context.get_dummy_value()

    return types.void(*[types.intp] * 3), generate


@intrinsic
def reduce_column(typing: Any, pivot: Any, stride: Any, count: Any, column: Any, size: Any, inverse: Any) -> Any:
    """Eliminate one column of a panel from the ``count`` rows below its pivot row, within the panel.

    ``pivot`` is the address of the panel in the pivot row, four numbers that must exist, of which ``size`` belong to it;
    multipliers, made with the pivot's ``inverse``, take the place of the ``column``. Returns which of the rows has the largest
    entry in the next column.
    """

    def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        pivot, stride, count, column, size, inverse = arguments
        word, vector = pivot.type, ir.VectorType(_DOUBLE, PANEL)
        lanes = ir.Constant(ir.VectorType(word, PANEL), list(range(PANEL)))
        here = builder.icmp_signed("==", lanes, _splat(builder, column, PANEL, word))
        right = builder.icmp_signed(">", lanes, _splat(builder, column, PANEL, word))
        right = builder.and_(right, builder.icmp_signed("<", lanes, _splat(builder, size, PANEL, word)))
        upper = builder.select(right, _load(builder, pivot, vector), ir.Constant(vector, [0.0] * PANEL))
        at_column = builder.mul(column, _number(word, 8))
        last = builder.icmp_signed(">=", builder.add(column, _number(word, 1)), size)
        at_next = builder.select(last, at_column, builder.add(at_column, _number(word, 8)))
        following = _load(builder, builder.add(pivot, at_next), _DOUBLE)
        absolute = builder.module.declare_intrinsic("llvm.fabs", [_DOUBLE])
        best = cgutils.alloca_once_value(builder, ir.Constant(_DOUBLE, -1.0))
        where = cgutils.alloca_once_value(builder, _number(word, 0))
        row = cgutils.alloca_once_value(builder, builder.add(pivot, stride))
        with cgutils.for_range(builder, count) as loop:
            address = builder.load(row)
            factor = builder.fmul(_load(builder, builder.add(address, at_column), _DOUBLE), inverse)
            ahead = _load(builder, builder.add(address, at_next), _DOUBLE)
            ahead = builder.fsub(ahead, builder.fmul(factor, following, _FUSED), _FUSED)
            wide = _splat(builder, factor, PANEL)
            value = _load(builder, address, vector)
            value = builder.fsub(value, builder.fmul(wide, upper, _FUSED), _FUSED)
            _store(builder, builder.select(here, wide, value), address)
            ahead = builder.call(absolute, [ahead])
            larger = builder.fcmp_ordered(">", ahead, builder.load(best))
            builder.store(builder.select(larger, ahead, builder.load(best)), best)
            builder.store(builder.select(larger, loop.index, builder.load(where)), where)
            builder.store(builder.add(address, stride), row)
        return builder.load(where)

    return types.intp(*[types.intp] * 5, types.float64), generate


@intrinsic
def scale_into(typing: Any, target: Any, factor: Any, source: Any, length: Any) -> Any:
    """target[:length] = factor * source[:length], of two addresses."""

    def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        target, factor, source, length = arguments

        def tile(offset: Any, width: int) -> None:
            values = _load(builder, builder.add(source, offset), ir.VectorType(_DOUBLE, width))
            _store(builder, builder.fmul(_splat(builder, factor, width), values), builder.add(target, offset))

        _for_tiles(builder, length, tile)
        return context.get_dummy_value()

    return types.void(types.intp, types.float64, types.intp, types.intp), generate


@intrinsic
def move(typing: Any, target: Any, source: Any) -> Any:
    """Copy `LANES` numbers from one address to another."""

    def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        _store(builder, _load(builder, arguments[1], ir.VectorType(_DOUBLE, LANES)), arguments[0])
        return context.get_dummy_value()

    return types.void(types.intp, types.intp), generate


@intrinsic
def gather(typing: Any, target: Any, source: Any, distances: Any) -> Any:
    """Put numbers side by side at ``target``: those at ``source`` and at the ``distances`` (a tuple) from it."""

    def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        target, source, distances = arguments
        total = ir.Constant(ir.VectorType(_DOUBLE, LANES), ir.Undefined)
        for lane in range(LANES):
            place = builder.add(source, builder.extract_value(distances, lane - 1)) if lane else source
            total = builder.insert_element(total, _load(builder, place, _DOUBLE), ir.Constant(_INT32, lane))
        _store(builder, total, target)
        return context.get_dummy_value()

    return types.void(types.intp, types.intp, types.UniTuple(types.intp, LANES - 1)), generate


@intrinsic(prefer_literal=True)
def invert_triangles(typing: Any, block: Any, apart: Any, size: Any) -> Any:
    """Put the inverses in place of both triangles of a block (size, size), the lower one with ones on its diagonal.

    ``size`` is a literal number.
    """
    count = size.literal_value

    def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        block, apart = arguments[:2]
        places = [
            [builder.add(row, _number(row.type, 8 * c)) for c in range(count)] for row in _rows(builder, block, apart, count)
        ]
        old = [[_load(builder, place, _DOUBLE) for place in row] for row in places]
        new: dict[tuple[int, int], Any] = {}

        def product(r: int, c: int, between: range, total: Any) -> Any:
            for k in between:
                term = builder.fmul(new[r, k], old[k][c], _FUSED) if r < c else builder.fmul(old[r][k], new[k, c], _FUSED)
                total = term if total is None else builder.fadd(total, term, _FUSED)
            return total

        for c in range(count):
            new[c, c] = builder.fdiv(ir.Constant(_DOUBLE, 1.0), old[c][c])
            for r in range(c):
                new[r, c] = builder.fneg(builder.fmul(product(r, c, range(r, c), None), new[c, c]))
        for c in range(count):
            for r in range(c + 1, count):
                new[r, c] = builder.fneg(product(r, c, range(c + 1, r), old[r][c]))
        for (r, c), value in new.items():
            _store(builder, value, places[r][c])
        return context.get_dummy_value()

    return types.void(types.intp, types.intp, size), generate


@intrinsic(prefer_literal=True)
def multiply_rows(typing: Any, rows: Any, stride: Any, number: Any, block: Any, apart: Any, size: Any) -> Any:
    """rows[i, :size] = rows[i, :size] @ the upper triangle of the block (size, size), for i < number; size is a literal number.

    Rows and block must reach to `PANEL` columns.
    """
    count = size.literal_value

    def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        rows, stride, number, block, apart = arguments[:5]
        word, vector, bits = rows.type, ir.VectorType(_DOUBLE, PANEL), ir.VectorType(_BIT, PANEL)
        zero = ir.Constant(vector, [0.0] * PANEL)
        upper = []
        for r, address in enumerate(_rows(builder, block, apart, count)):
            mask = ir.Constant(bits, [int(r <= c < count) for c in range(PANEL)])
            upper.append(builder.select(mask, _load(builder, address, vector), zero))
        inside = ir.Constant(bits, [int(c < count) for c in range(PANEL)])
        with cgutils.for_range(builder, number) as loop:
            row = builder.add(rows, builder.mul(loop.index, stride))
            old, total = _load(builder, row, vector), None
            for k, values in enumerate(upper):
                factor = _load(builder, builder.add(row, _number(word, 8 * k)), _DOUBLE)
                total = _fused(builder, factor, values, total)
            _store(builder, builder.select(inside, total, old), row)
        return context.get_dummy_value()

    return types.void(*[types.intp] * 5, size), generate
