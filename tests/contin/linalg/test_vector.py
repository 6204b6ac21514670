"""Every vector instruction against loops of numpy, for all sizes and lengths; nothing outside the target is written."""

import itertools
import re

import numpy as np
import pytest

from contin.kernels.kernel import kernel
from contin.kernels.kernel_parts import IndexVector, Matrix, Stack, Vector
from contin.linalg import vector
from contin.linalg.vector import LANES, PANEL, at

LENGTHS = range(41)
SIZES = range(1, PANEL + 1)
#: Widths of the matrices that instructions work inside: the smallest that holds all lengths, and others.
WIDTHS = (LENGTHS[-1] + 3, 47, 64)
#: Entries of the vectors whose entries are LANES numbers.
ENTRIES = LENGTHS[-1] + 4


def numbers(*shape, seed=0):
    return np.random.default_rng([seed, *shape]).standard_normal(shape)


def check(found, known, before, *part):
    """The part of an array is as known, and the rest of it as before."""
    expected = before.copy()
    expected[part] = known
    inside = np.zeros(before.shape, bool)
    inside[part] = True
    assert np.array_equal(found[~inside], before[~inside])
    assert np.allclose(found[inside], expected[inside], rtol=1e-12, atol=1e-12)


# --- elimination: matrices begin at entry (1, 2) of larger ones -------------------------------------------------------


@kernel
def subtract_products(target: Matrix, factors: Matrix, pivots: Matrix, length: int, rows: int, count: int) -> None:
    vector.subtract_products(at(target, 1, 2), at(factors, 1, 2), at(pivots, 1, 2), length, rows, count)


@pytest.mark.sample(4)
@pytest.mark.parametrize(("width", "size"), [*itertools.product(WIDTHS, SIZES)])
def test_subtract_products(width, size):
    target, factors, pivots = numbers(13, width), numbers(13, 9, seed=1), numbers(PANEL + 2, width + 5, seed=2)
    for length, rows in itertools.product(LENGTHS, range(11)):
        found = target.copy()
        subtract_products(found, factors, pivots, length, rows, size)
        part = slice(1, 1 + rows), slice(2, 2 + length)
        change = factors[1 : 1 + rows, 2 : 2 + size] @ pivots[1 : 1 + size, 2 : 2 + length]
        check(found, target[part] - change, target, *part)


@pytest.mark.parametrize("size", [0, PANEL + 1])
def test_other_sizes_do_nothing(size):
    target = numbers(13, 50)
    found = target.copy()
    subtract_products(found, numbers(13, 9), numbers(PANEL + 3, 50), 40, 10, size)
    assert np.array_equal(found, target)


@kernel
def solve_triangle(rows: Matrix, factors: Matrix, length: int, count: int) -> None:
    vector.solve_triangle(at(rows, 1, 2), at(factors, 1, 2), length, count)


@pytest.mark.parametrize(("width", "size"), [*itertools.product(WIDTHS, SIZES)])
def test_solve_triangle(width, size):
    rows, factors = numbers(PANEL + 2, width), numbers(PANEL + 2, 9, seed=1)
    for length in LENGTHS:
        found, known = rows.copy(), rows[1 : 1 + size, 2 : 2 + length].copy()
        solve_triangle(found, factors, length, size)
        for k in range(size):
            known[k] -= factors[1 + k, 2 : 2 + k] @ known[:k]
        check(found, known, rows, slice(1, 1 + size), slice(2, 2 + length))


@kernel
def reduce_column(block: Matrix, count: int, column: int, size: int) -> int:
    return vector.reduce_column(at(block, 1, 2), count, column, size)


@pytest.mark.parametrize(("width", "size"), [*itertools.product((PANEL + 2, 11), SIZES)])
def test_reduce_column(width, size):
    block = numbers(14, width)
    for count, column in itertools.product(range(12), range(size)):
        found = block.copy()
        largest = reduce_column(found, count, column, size)
        pivot, below = block[1, 2 : 2 + size], block[2 : 2 + count, 2 : 2 + size].copy()
        below[:, column] /= pivot[column]
        below[:, column + 1 :] -= np.outer(below[:, column], pivot[column + 1 :])
        check(found, below, block, slice(2, 2 + count), slice(2, 2 + size))
        if count and column + 1 < size:
            assert largest == np.argmax(np.abs(below[:, column + 1]))


@kernel
def invert_triangles(block: Matrix, count: int) -> None:
    vector.invert_triangles(at(block, 1, 2), count)


@pytest.mark.parametrize(("width", "size"), [*itertools.product((PANEL + 2, 11), SIZES)])
def test_invert_triangles(width, size):
    block = numbers(PANEL + 2, width) + 3 * np.eye(PANEL + 2, width, 1)
    part = slice(1, 1 + size), slice(2, 2 + size)
    found = block.copy()
    invert_triangles(found, size)
    upper, lower = np.linalg.inv(np.triu(block[part])), np.linalg.inv(np.tril(block[part], -1) + np.eye(size))
    check(found, upper + np.tril(lower, -1), block, *part)


@kernel
def multiply_rows(rows: Matrix, number: int, block: Matrix, count: int) -> None:
    vector.multiply_rows(at(rows, 1, 2), number, at(block, 1, 2), count)


@pytest.mark.parametrize(("width", "size"), [*itertools.product((PANEL + 2, 11), SIZES)])
def test_multiply_rows(width, size):
    rows, block = numbers(14, width), numbers(PANEL + 2, width + 1, seed=1)
    for number in range(12):
        found, part = rows.copy(), (slice(1, 1 + number), slice(2, 2 + size))
        multiply_rows(found, number, block, size)
        check(found, rows[part] @ np.triu(block[1 : 1 + size, 2 : 2 + size]), rows, *part)


@kernel
def exchange(block: Matrix, length: int) -> None:
    vector.exchange(at(block, 1, 2).address, at(block, 3, 1).address, length)


@pytest.mark.parametrize("length", LENGTHS)
def test_exchange(length):
    block = numbers(5, LENGTHS[-1] + 4)
    found, known = block.copy(), block.copy()
    exchange(found, length)
    known[1, 2 : 2 + length], known[3, 1 : 1 + length] = block[3, 1 : 1 + length], block[1, 2 : 2 + length]
    assert np.array_equal(found, known)


@kernel
def copy_rows(target: Matrix, source: Matrix, length: int, rows: int) -> None:
    vector.copy_rows(at(target, 1, 2), at(source, 2, 1), length, rows)


@pytest.mark.parametrize("width", WIDTHS)
def test_copy_rows(width):
    target, source = numbers(9, width), numbers(9, width + 3, seed=1)
    for length, rows in itertools.product(LENGTHS, range(7)):
        found, known = target.copy(), target.copy()
        copy_rows(found, source, length, rows)
        known[1 : 1 + rows, 2 : 2 + length] = source[2 : 2 + rows, 1 : 1 + length]
        assert np.array_equal(found, known)


@kernel
def spread(target: Vector, places: IndexVector, values: Vector, scale: float, source: Vector, length: int) -> None:
    vector.spread(
        target.ctypes.data + 16, places.ctypes.data, values.ctypes.data, scale, source.ctypes.data + 8, length, places.size
    )


@pytest.mark.parametrize("length", LENGTHS)
def test_spread(length):
    places, values = np.array([length + 1, 0, 2 * length + 5]), numbers(3, seed=2)
    target, source = numbers(3 * LENGTHS[-1] + 8), numbers(LENGTHS[-1] + 3, seed=1)
    found, known = target.copy(), target.copy()
    spread(found, places, values, -1.7, source, length)
    for place, value in zip(places, values):
        known[2 + place : 2 + place + length] = value * -1.7 * source[1 : 1 + length]
    assert found == pytest.approx(known, rel=1e-14)


@kernel
def combine(target: Vector, factors: Vector, rows: Matrix, length: int, count: int) -> None:
    vector.combine(target.ctypes.data + 16, factors.ctypes.data + 8, at(rows, 1, 2), length, count)


@pytest.mark.parametrize("width", WIDTHS)
def test_combine(width):
    target, factors, rows = numbers(width + 4), numbers(9, seed=2), numbers(9, width + 3, seed=1)
    for length, count in itertools.product([each for each in LENGTHS if each <= width], range(7)):
        found, known = target.copy(), target.copy()
        combine(found, factors, rows, length, count)
        known[2 : 2 + length] = factors[1 : 1 + count] @ rows[1 : 1 + count, 2 : 2 + length]
        assert found == pytest.approx(known, rel=1e-14, abs=1e-14)


# --- substitution: vectors begin at entry 1 of longer ones ------------------------------------------------------------


@kernel
def subtract_rows(target: Matrix, matrix: Matrix, vectors: Matrix, length: int, rows: int) -> None:
    vector.subtract_rows(at(target, 1, 0).address, at(matrix, 1, 2), at(vectors, 1, 0).address, length, rows)


@kernel
def subtract_columns(target: Matrix, matrix: Matrix, vectors: Matrix, length: int, rows: int) -> None:
    vector.subtract_columns(at(target, 1, 0).address, at(matrix, 1, 2), at(vectors, 1, 0).address, length, rows)


@pytest.mark.sample(2)
@pytest.mark.parametrize("width", WIDTHS)
def test_subtract_rows_and_columns(width):
    target, vectors, matrix = numbers(ENTRIES, LANES), numbers(ENTRIES, LANES, seed=1), numbers(14, width, seed=2)
    for length, rows in itertools.product(LENGTHS, range(12)):
        part = matrix[1 : 1 + rows, 2 : 2 + length]
        found = target.copy()
        subtract_rows(found, matrix, vectors, length, rows)
        check(found, target[1 : 1 + rows] - part @ vectors[1 : 1 + length], target, slice(1, 1 + rows))
        found = target.copy()
        subtract_columns(found, matrix, vectors, length, rows)
        check(found, target[1 : 1 + length] - part.T @ vectors[1 : 1 + rows], target, slice(1, 1 + length))


@kernel
def apply_triangle(vectors: Matrix, block: Matrix, count: int, lower: int, transposed: int) -> None:
    first, triangle = at(vectors, 1, 0).address, at(block, 1, 2)
    if lower and transposed:
        vector.apply_lower_transposed(first, triangle, count)
    elif lower:
        vector.apply_lower(first, triangle, count)
    elif transposed:
        vector.apply_upper_transposed(first, triangle, count)
    else:
        vector.apply_upper(first, triangle, count)


@pytest.mark.parametrize(("size", "lower", "transposed"), [*itertools.product(SIZES, (0, 1), (0, 1))])
def test_apply_triangle(size, lower, transposed):
    for width in (PANEL + 2, 11):
        vectors, block = numbers(PANEL + 3, LANES), numbers(PANEL + 2, width, seed=1)
        part = block[1 : 1 + size, 2 : 2 + size]
        triangle = np.tril(part, -1) + np.eye(size) if lower else np.triu(part)
        found = vectors.copy()
        apply_triangle(found, block, size, lower, transposed)
        known = (triangle.T if transposed else triangle) @ vectors[1 : 1 + size]
        check(found, known, vectors, slice(1, 1 + size))


@kernel
def move(target: Matrix, source: Matrix, i: int, j: int) -> None:
    vector.move(at(target, i, 0).address, at(source, j, 0).address)


def test_move():
    target, source = numbers(5, LANES), numbers(6, LANES, seed=1)
    found, known = target.copy(), target.copy()
    move(found, source, 2, 4)
    known[2] = source[4]
    assert np.array_equal(found, known)


@kernel
def add(target: Matrix, source: Matrix, i: int, j: int) -> None:
    vector.add(at(target, i, 0).address, at(source, j, 0).address)


@kernel
def clear(target: Matrix, i: int) -> None:
    vector.clear(at(target, i, 0).address)


def test_add_and_clear():
    target, source = numbers(5, LANES), numbers(6, LANES, seed=1)
    found, known = target.copy(), target.copy()
    add(found, source, 2, 4)
    clear(found, 3)
    known[2], known[3] = target[2] + source[4], 0.0
    assert np.array_equal(found, known)


@kernel
def side_by_side(target: Matrix, source: Matrix, length: int, rows: int) -> None:
    vector.side_by_side(at(target, 1, 0).address, at(source, 1, 2), length, rows)


@kernel
def apart(target: Matrix, source: Matrix, length: int, rows: int) -> None:
    vector.apart(at(target, 1, 2), at(source, 1, 0).address, length, rows)


@pytest.mark.parametrize(("width", "rows"), [*itertools.product(WIDTHS, range(1, LANES + 3))])
def test_side_by_side_and_apart(width, rows):
    """Rows beyond the LANES are left; where there are fewer, the last of them stands again."""
    matrix, entries = numbers(LANES + 4, width), numbers(ENTRIES, LANES, seed=1)
    for length in LENGTHS:
        found, known = entries.copy(), entries.copy()
        side_by_side(found, matrix, length, rows)
        known[1 : 1 + length] = matrix[1 + np.minimum(range(LANES), rows - 1), 2 : 2 + length].T
        assert np.array_equal(found, known)
        found, known = matrix.copy(), matrix.copy()
        apart(found, entries, length, rows)
        known[1 : 1 + min(rows, LANES), 2 : 2 + length] = entries[1 : 1 + length, : min(rows, LANES)].T
        assert np.array_equal(found, known)


# --- addresses --------------------------------------------------------------------------------------------------------


@kernel
def address(array: Stack, offset: int) -> int:
    return vector.address(array, offset)


@kernel
def page(stack: Stack, j: int) -> int:
    return vector.page(stack, j).address + 1000 * vector.page(stack, j).stride


@kernel
def within(matrix: Matrix, i: int, j: int) -> int:
    return vector.within(at(matrix, i, j), 2, 3).address


@kernel
def entry(array: Matrix, i: int) -> int:
    return vector.entry(vector.address(array, 0), i)


def test_addresses():
    stack = np.zeros((3, 4, 5))
    matrix, first = stack[1], stack.ctypes.data
    assert address(stack, 24) == first + 24
    assert page(stack, 2) == stack[2].ctypes.data + 1000 * 40
    assert within(matrix, 1, 1) == matrix[3, 4:].ctypes.data
    assert entry(matrix, 3) == matrix.ctypes.data + 3 * LANES * 8


def test_every_instruction_has_a_kernel_here():
    """Of the same name; one kernel applies all four triangles."""
    decorated = {name for name, value in vars(vector).items() if hasattr(value, "__wrapped__")}
    instructions = {name for name in decorated if getattr(vector, name).__module__ == vector.__name__}
    assert len(instructions) == 25
    assert {re.sub("apply_.*", "apply_triangle", name) for name in instructions} <= globals().keys()
