"""Derivatives of a law: symbolic, so exact to round-off."""

import math

from contin import gradient


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
