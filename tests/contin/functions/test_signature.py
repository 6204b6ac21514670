"""The number of results of a user's function, found before it is compiled."""

import numpy as np
import pytest

from contin.functions.batch import Batch
from contin.functions.recording import result_count


def test_result_count_is_found_without_compiling():
    assert result_count(lambda t, u, p: (u.a, u.b, 1), (None, ("a", "b"), ()), "f") == 3
    assert result_count(lambda t, u, p: u.a, (None, ("a", "b"), ()), "f") == 0


def test_a_function_that_raises_outside_of_its_range():
    """It is recorded by its other paths, whatever numbers it is called with; nan stands for what it raises."""

    def table(x):
        if not 280.5 <= x <= 290.25:
            raise ValueError("no entry")
        return x * x

    assert result_count(lambda u, p: table(u.T), (("T",), ()), "f") == 0
    assert result_count(lambda u, p: (table(u.T), u.T), (("T",), ()), "f") == 2
    batch = Batch([lambda u, p: table(u.T)], [0], ["T"], [], times=False)
    values = batch.values(np.zeros(2), np.array([[285.0], [300.0]]), np.empty((0, 1)), np.empty(0))
    assert batch.recorded is not None and values[0, 0] == pytest.approx(285**2, rel=1e-15) and np.isnan(values[1, 0])
