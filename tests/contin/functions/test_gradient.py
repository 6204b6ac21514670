"""Derivatives of a law: symbolic, so exact to round-off."""

import math

import pytest

from contin.lowlevel import gradient


def test_gradient_is_symbolic():
    def energy(x, y, k):
        return math.sqrt(x * x + k * y) + x**3 * y

    value, by_x, by_y = gradient(energy, ("x", "y"))(0.6, 0.8, 0.5)
    root = math.sqrt(0.36 + 0.4)
    assert math.isclose(value, root + 0.216 * 0.8, rel_tol=1e-15)
    assert math.isclose(by_x, 0.6 / root + 3 * 0.36 * 0.8, rel_tol=1e-15)
    assert math.isclose(by_y, 0.25 / root + 0.216, rel_tol=1e-15)


def test_gradient_knows_functions_that_sympy_has_not():
    value, slope = gradient(lambda x: math.hypot(3.0, x) + math.expm1(x) + math.log1p(x), ["x"])(4.0)
    assert math.isclose(value, 5 + math.expm1(4) + math.log(5), rel_tol=1e-14)
    assert math.isclose(slope, 4 / 5 + math.exp(4) + 1 / 5, rel_tol=1e-14)


def test_the_side_that_is_not_taken_may_have_no_derivatives():
    """(1 - sqrt(x))/x has none at 0; second derivatives of a selection between it and 1 + x**2 are those of the latter
    there."""

    def chosen(x):
        return 1 + x**2 if x < 1 else (1 - x**0.5) / x

    first = gradient(chosen, ["x"])
    second = gradient(lambda x: first(x)[1], ["x"])
    assert first(0.0) == (1.0, 0.0) and second(0.0) == (0.0, 2.0)
    assert second(4.0) == pytest.approx((-1 / 16 + 1 / 16, 2 / 64 - 3 / 4 / 32), rel=1e-14)  # -1/x**2 + 1/(2 x**1.5)
