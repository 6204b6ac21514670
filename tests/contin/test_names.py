"""Numbers in names: exact, short where they were typed, never the same for two values."""

import math

import numpy as np
import pytest

from contin import AlgebraicProblem, solve, trace
from contin.lowlevel import exact_text
from contin.text import value_names

TEXTS = {3.0: "3", -100.0: "-100", 0.3: "0.3", 0.3000001: "0.3000001", 1e6: "1e+06", 1234567.0: "1234567", 1e-300: "1e-300"}


@pytest.mark.parametrize(("value", "text"), TEXTS.items())
def test_a_text_is_short(value, text):
    assert exact_text(value) == text and float(text) == value


def test_a_text_is_read_back_as_the_same_number():
    rng = np.random.default_rng(1)
    numbers = [*rng.standard_normal(200), *np.exp(rng.uniform(-700, 700, 200)), math.nextafter(0.3, 1), math.inf, 5e-324]
    for number in numbers:
        assert float(exact_text(number)) == number
    assert exact_text(math.nan) == "nan"


def test_values_that_agree_in_six_digits_have_names_of_their_own():
    values = [1 / 3, 0.333333, math.nextafter(1 / 3, 1), 0.3333333, 2 / 3, 1 / 3]
    names = value_names(values)
    assert list(names) == values[:-1] and len(set(names.values())) == 5
    assert names[0.333333] == "0.333333" and names[2 / 3] == "0.666667"


def test_zeros_and_limits_that_agree_in_six_digits_are_labelled_each():
    """The line x = p, down from p = 1; a value that stands twice is one."""
    line = AlgebraicProblem(lambda u, p: (u.x - p.p,), ["x"], {"p": 1.0})
    settings = {"zeros": {"p": [0.6, 0.6000001, 0.6]}, "limits": {"p": (0.2000001, 2.0)}, "direction": -1}
    branch = trace(solve(line, [1.0]), free=["p"], **settings)
    found = [(point.label, point.name, point["p"]) for point in branch.points if point.label][1:]
    assert [entry[:2] for entry in found] == [("UZ", "p = 0.6000001"), ("UZ", "p = 0.6"), ("EP", "p = 0.2000001")]
    assert [p for *_, p in found] == pytest.approx([0.6000001, 0.6, 0.2000001], abs=1e-11)
    assert "p = 0.2000001" in str(branch.stop)
