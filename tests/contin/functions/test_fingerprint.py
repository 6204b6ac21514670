"""Keys of compiled and derived code: whatever a function reads, an edit of it gives another answer at once."""

import importlib.util
import itertools
import math
import sys
from collections import namedtuple

import numpy as np
import pytest

from contin import Batch, gradient
from contin.functions.fingerprint import Fingerprint
from contin.functions.rewriting import Rewriter

#: A law of one argument that reads a constant, a closure, a default, an array in a tuple, and helpers here and in another file.
LAW = """
import math
import other_file

CONSTANT = 2.0

def helper(x):
    return 3.0 * x

def make(closed):
    def law(x, extra=5.0):
        here = CONSTANT * x + helper(x) + closed * x + extra * x
        return here + other_file.FACTOR * x + other_file.helper(x) + 0 * math.sin(x)
    return law

law = make(7.0)
"""
OTHER = """
FACTOR = 11.0

def helper(x):
    return 13.0 * x
"""
EDITS = {
    "constant": (LAW, "CONSTANT = 2.0", "CONSTANT = 2.5"),
    "helper": (LAW, "3.0 * x", "3.5 * x"),
    "closure": (LAW, "make(7.0)", "make(7.5)"),
    "default": (LAW, "extra=5.0", "extra=5.5"),
    "constant in another file": (OTHER, "FACTOR = 11.0", "FACTOR = 11.5"),
    "helper in another file": (OTHER, "13.0 * x", "13.5 * x"),
}
numbers = itertools.count()


@pytest.fixture
def law(tmp_path, monkeypatch):
    """A function that imports the law from two files as a new process would."""

    def load(text, other):
        for name, source in (("other_file", other), (f"law_{next(numbers)}", text)):
            path = tmp_path / f"{name}.py"
            path.write_text(source)
            spec = importlib.util.spec_from_file_location(name, path)
            module = importlib.util.module_from_spec(spec)
            monkeypatch.setitem(sys.modules, name, module)
            exec(compile(source, str(path), "exec"), module.__dict__)
        return module.law

    return load


@pytest.mark.parametrize("what", EDITS)
def test_an_edit_changes_gradient_and_compiled_code(law, what):
    """41 = 2 + 3 + 7 + 5 + 11 + 13, and each edit adds one half."""
    source, old, new = EDITS[what]
    edited = source.replace(old, new)
    assert edited != source
    for function, slope in (
        (law(LAW, OTHER), 41.0),
        (law(edited if source is LAW else LAW, edited if source is OTHER else OTHER), 41.5),
    ):
        assert gradient(function, ["x"])(2.0, *function.__defaults__) == (2 * slope, slope)
        compiled = Batch([_of_state(function)], [0], ["x"], [], times=False)
        assert compiled.values(np.zeros(1), np.array([[2.0]]), np.empty((0, 1)), np.empty(0))[0, 0] == 2 * slope


def _of_state(function):
    return lambda u, p: function(u.x)


def _fingerprint(function):
    rewriter = Rewriter()
    rewriter.function(function)
    return rewriter.fingerprint()


def test_fingerprint_follows_what_a_function_refers_to():
    def make(factor, inner):
        return lambda t, u, p: (factor * inner(u.x),)

    one = _fingerprint(make(2.0, lambda x: x * x))
    assert one == _fingerprint(make(2.0, lambda x: x * x))
    assert one != _fingerprint(make(2.5, lambda x: x * x))
    assert one != _fingerprint(make(2.0, lambda x: x + x))
    assert _fingerprint(make(2.0, math.sin)) != _fingerprint(make(2.0, math.cos))


def test_large_arrays_inside_a_tuple_are_told_apart():
    """The text of an array of more than a thousand numbers leaves out those in the middle."""
    one, two = np.zeros(5000), np.zeros(5000)
    two[2500] = 1.0
    made = [(lambda pair: lambda u, p: (u.x * pair[0][2500] + pair[1],))((array, 1.0)) for array in (one, two, one.copy())]
    first, second, third = map(_fingerprint, made)
    assert first != second and first == third


def test_values_that_look_alike_are_told_apart():
    alike = [
        0, 0.0, -0.0, False, 0j, "0", b"0", None, (), [], {}, (0,), [0], ("0",), (0, 0), ((0,), 0), (0, (0,)),
        namedtuple("Pair", "a b"), namedtuple("Pair", "b a"),
        np.float64(0), np.float32(0), np.zeros(1), np.zeros((1, 1)), np.zeros(1, np.int64), {0: 0}, {0}, range(0), slice(0),
    ]  # fmt: skip

    def text(*values):
        fingerprint = Fingerprint()
        fingerprint.note(*values)
        return fingerprint.text()

    assert len({text(value) for value in alike}) == len(alike)
    assert text("ab", "c") != text("a", "bc")
