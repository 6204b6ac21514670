"""Least values over unknowns that are found by iteration: values, derivatives, and decisions inside the potential."""

import numpy as np
import pytest
from scipy.optimize import brentq

from contin.lowlevel import Batch, gradient, least, minimum


def state(M, a):
    """The minimum of w**4/4 + a w**2/2 - M w by bracketing: w, the value, and the derivatives of the value by M."""
    w = brentq(lambda w: w**3 + a * w - M, -9, 9, xtol=1e-15)
    return w**4 / 4 + a * w * w / 2 - M * w, -w, -1 / (3 * w * w + a), 6 * w / (3 * w * w + a) ** 3


def potential(w, M, a):
    if w > 1:
        return w**4 / 4 + a * w * w / 2 - M * w
    return (w * w + a) ** 2 / 4 - a * a / 4 - M * w  # the same


def test_values_and_derivatives_of_a_least_value():
    """To third order, with a potential that decides by its unknown."""

    def value(u, p):
        return least(lambda w: potential(w[0], u.M, p.a), [u.M])

    batch = Batch([value], [0], ["M"], ["a"], times=False)
    assert batch.interpreted is None
    M, none, p = np.array([[8.0], [0.3], [-2.0]]), np.empty((0, 1)), np.array([0.7])
    found, slope = batch.jacobian(np.zeros(3), M, none, p, batch.columns([0]))
    along = np.zeros((3, 2))
    along[:, 0] = 1
    higher = [batch.along(np.zeros(3), M, none, p, [along] * order)[:, 0] for order in (2, 3)]
    known = np.array([state(each, 0.7) for each in M[:, 0]]).T
    np.testing.assert_allclose([found[:, 0], slope[:, 0, 0], *higher], known, rtol=1e-12, atol=1e-13)
    np.testing.assert_allclose(slope[:, 0, 1], known[1] ** 2 / 2, rtol=1e-12)  # by a


def test_least_values_of_ordinary_numbers():
    assert least(lambda w: potential(w[0], 8.0, 0.7), [8.0]) == pytest.approx(state(8.0, 0.7)[0], rel=1e-14)
    assert minimum(lambda w: potential(w[0], 8.0, 0.7), [8.0])[0] == pytest.approx(-state(8.0, 0.7)[1], rel=1e-14)
    assert np.isnan(least(lambda w: -(w[0] ** 2), [1.0]))


def test_a_saddle_is_no_minimum():
    """x**2 - y**2 + y**4 is stationary at 0, where Newton's method starts; and where the start is off the axis, y**2 = 1/2."""

    def saddle(w):
        return w[0] ** 2 - w[1] ** 2 + w[1] ** 4

    assert np.isnan(minimum(saddle, [1.0, 0.0])).all()
    assert minimum(saddle, [1.0, 0.1]) == pytest.approx((0.0, np.sqrt(0.5)), abs=1e-14)


def test_a_minimum_in_a_narrow_valley():
    """The curvature along the valley is 1e-6 of that across it: (x - y)**2/2 + 1e-6 y**4/4 - 1e-6 y, at x = y = 1."""
    found = minimum(lambda w: (w[1] - w[0]) ** 2 / 2 + 1e-6 * (w[0] ** 4 / 4 - w[0]), [3.0, 0.0])
    assert found == pytest.approx((1.0, 1.0), abs=1e-8)


def test_terms_of_a_potential_may_cancel():
    """(x - 3)**2/2 as a difference of terms of 1e8: its round-off, 1e-8, is that of the value at 1e-4 from the minimum."""
    found = minimum(lambda w: (1e8 + (w[0] - 3) ** 2 / 2 + (w[0] - 3) ** 4) - 1e8, [5.0])
    assert found[0] == pytest.approx(3.0, abs=1e-8)


def test_a_least_value_may_read_an_argument_named_t():
    """An argument's slot is not that of the time: H of U = (w - t)**2/2 is M**2/2 + M t."""
    value, strain = gradient(lambda M, t: -least(lambda w: (w[0] - t) ** 2 / 2 - M * w[0], [0.0]), ["M"])(0.5, 1.0)
    assert (value, strain) == pytest.approx((0.625, 1.5), abs=1e-14)


def test_a_start_may_be_an_array_without_dimensions():
    """As np.where gives of plain numbers."""
    assert least(lambda w: (w[0] - 2) ** 2, [np.where(1.0 > 0, 1.0, 0.0)]) == pytest.approx(0.0, abs=1e-14)
