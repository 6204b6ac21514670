"""Kernels that call kernels: what is called is compiled once, apart, and keeps its options."""

import os
import subprocess
import sys
from types import BuiltinFunctionType
from typing import NamedTuple

import numpy as np
import pytest

from contin.kernels import kernel_parts
from contin.kernels.kernel import Kernel, kernel
from contin.kernels.kernel_parts import Matrix, ReadOnlyVector, Vector, helper
from contin.linalg import vector


class Pair(NamedTuple):
    x: Vector
    factor: float


class Pairs(NamedTuple):
    one: Pair
    other: Pair


@kernel(reorder=False)
def total(x: ReadOnlyVector) -> float:
    found = 0.0
    for i in range(x.size):
        found += x[i]
    return found


@kernel
def total_in_any_order(x: ReadOnlyVector) -> float:
    found = 0.0
    for i in range(x.size):
        found += x[i]
    return found


@kernel
def scale(pair: Pair, times: int) -> None:
    for i in range(pair.x.size):
        pair.x[i] *= pair.factor * times


@helper
def scale_both(pairs):
    scale(pairs.one, 2)
    scale(pairs.other, 3)


@kernel
def scaled_total(pairs: Pairs, table: Matrix) -> float:
    """Call kernels with named tuples that are given and made here, with a row of a matrix, and from a helper."""
    scale_both(pairs)
    scale(Pair(table[1], 0.5), 1)
    return total(pairs.one.x) + total(pairs.other.x) + total(table[1, 1:])


@kernel
def in_order(x: Vector) -> float:
    return total(x)


@kernel
def exchange(a: Matrix) -> None:
    """Exchange two rows; the name is that of what is called."""
    vector.exchange(vector.at(a, 0, 0).address, vector.at(a, 1, 0).address, a.shape[1])


@kernel
def wrong(x: Matrix) -> float:
    return total(x)


def test_kernels_take_named_tuples_of_kernels():
    one, other, table = np.arange(3.0), np.ones(2), np.arange(6.0).reshape(2, 3)
    assert scaled_total(Pairs(Pair(one, 10.0), Pair(other, 1.0)), table) == 60 + 6 + 4.5
    assert one.tolist() == [0, 20, 40] and other.tolist() == [3, 3] and table[1].tolist() == [1.5, 2, 2.5]


def test_a_kernel_keeps_its_options_where_another_calls_it():
    x = np.random.default_rng(1).normal(size=1000) * 10.0 ** np.random.default_rng(2).integers(-9, 9, 1000)
    assert in_order(x) == total(x) == sum(x.tolist()) != total_in_any_order(x)


def test_a_kernel_may_have_the_name_of_what_it_calls():
    matrix = np.arange(4.0).reshape(2, 2)
    exchange(matrix)
    assert matrix.tolist() == [[2, 3], [0, 1]]


def test_arguments_of_another_type_are_refused_when_it_is_compiled():
    with pytest.raises(Exception, match=r"total takes \(Array\(float64, 1.*not \(Array\(float64, 2"):
        wrong(np.ones((2, 2)))


def test_what_is_called_is_not_part_of_the_length():
    """Kernels are made in the order of their length: helpers are compiled with them, kernels are not."""
    made = kernel_parts.kernel_of(scaled_total)
    assert isinstance(made, Kernel) and Kernel in set(map(type, kernel_parts.parts(made.function)))
    own = len(made.function.__code__.co_code) + len(scale_both.function.__code__.co_code)
    assert kernel_parts.length(made.function) == own


INNER = """
from contin.kernels.kernel import kernel
from factors import FACTOR

@kernel
def inner(x: int) -> int:
    return FACTOR * x

@kernel
def other(x: int) -> int:
    return 3 * x
"""
OUTER = """
from contin.kernels.kernel import kernel
from contin.kernels.kernel_parts import helper
import inner_kernels
from inner_kernels import inner

@helper
def both(x):
    return inner(x) + inner_kernels.other(x)

@kernel
def outer(x: int) -> int:
    return both(x) + 1

@kernel
def last(x: int) -> int:
    return outer(x)
"""
PROGRAM = """
import sys
import outer_kernels as kernels
print(kernels.last(10), "numba" in sys.modules)
"""
MADE, LOADED = True, False


@pytest.fixture
def run(tmp_path):
    """Return a function that runs `PROGRAM` in a new process."""
    (tmp_path / "factors.py").write_text("FACTOR = 2")
    (tmp_path / "inner_kernels.py").write_text(INNER)
    (tmp_path / "outer_kernels.py").write_text(OUTER)
    paths = os.pathsep.join([str(tmp_path), *sys.path])
    environment = {
        **os.environ,
        "CONTIN_CACHE_DIR": str(tmp_path / "cache"),
        "PYTHONPATH": paths,
        "PYTHONDONTWRITEBYTECODE": "1",
    }

    def run():
        done = subprocess.run([sys.executable, "-c", PROGRAM], env=environment, capture_output=True, text=True, check=True)
        value, kinds = done.stdout.split(" ", 1)
        return int(value), eval(kinds)

    return run


@pytest.mark.full
def test_kernels_from_the_cache_call_kernels(run, tmp_path):
    """Whatever is in the cache: nothing, all, or some. A change of what is called reaches the callers."""
    assert run() == (51, MADE)
    files = [path.name for path in (tmp_path / "cache").glob("k*.bin")]
    assert len(files) == 4 and run() == (51, LOADED)
    for name in (files[0], files[-1]):
        (tmp_path / "cache" / name).unlink()
        assert run()[0] == 51 and run() == (51, LOADED)
    (tmp_path / "inner_kernels.py").write_text(INNER.replace("3 * x", "6 * x"))
    assert run() == (81, MADE)
    assert run() == (81, LOADED)
    (tmp_path / "factors.py").write_text("FACTOR = 5")  # a number that only what is called reads
    assert run() == (111, MADE)
    assert run() == (111, LOADED)


def test_loaded_kernels_are_functions_of_python():
    found = kernel_parts.kernel_of(in_order).compiled
    for each in (in_order, found):
        assert isinstance(each, BuiltinFunctionType) and each(np.ones(2)) == 2.0
    with pytest.raises(TypeError, match="not of the type in its annotations"):
        in_order(1)
