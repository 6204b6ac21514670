"""Coefficients of normal forms that are round-off."""

import pytest

from contin.events.normal_forms import Coefficient


@pytest.mark.parametrize("value, size, error, known", [
    (1e-33, 2e-33, 5e-33, 0.0),  # linear equations: all terms are round-off, and do not cancel
    (1e-12, 2e-12, 1e-15, 1e-12),  # small, but known
    (0.3, 0.5, 1.0, 0.3),  # no error is asked for
    (1e7, 2e7, 1e8, 0.0),  # near where it is infinite
    (1e-5, 1.0, 1e-4, 0.0),  # the terms cancel
])  # fmt: skip
def test_a_coefficient_that_is_smaller_than_its_error_has_no_sign(value, size, error, known):
    assert Coefficient(value, size, lambda: error).signed(0.0) == known
