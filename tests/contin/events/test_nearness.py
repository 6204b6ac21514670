"""Whether multipliers can have passed 1, -1 or the circle between two places and come back, by where they are at both."""

import math

import numpy as np
import pytest

import contin
from contin.events.dips import CIRCLE, MINUS_ONE, ONE, comes_near


def near(first, last, what, map_=0, longer=1.0):
    ends = np.array([first, last], dtype=complex)
    return bool(comes_near(np.ascontiguousarray(ends.real), np.ascontiguousarray(ends.imag), what, map_, longer))


def test_a_real_multiplier_by_itself_keeps_its_sign():
    """It would have to be zero, as only those of maps can be, or to meet another one of its sign."""
    assert not near([-20], [-80], MINUS_ONE) and near([-20], [-80], MINUS_ONE, map_=1)
    assert near([-20, -3], [-80, -20], MINUS_ONE)
    assert not near([-30, 0.7], [-30, 1.9], MINUS_ONE) and near([-30, 0.7], [-30, 1.9], MINUS_ONE, map_=1)
    assert not near([-20, -4 + math.pi * 1j], [-80, -4.5 + math.pi * 1j], MINUS_ONE)


@pytest.mark.parametrize("what", [ONE, MINUS_ONE, CIRCLE])
def test_what_is_not_known_may_be_anything(what):
    assert near([math.nan], [-4], what) and near([-4], [math.nan], what)


def test_multipliers_far_from_everything():
    for what in (ONE, MINUS_ONE, CIRCLE):
        assert not near([5 + 0.1j, 5 - 0.1j, -9], [5.1 + 0.1j, 5.1 - 0.1j, -9.5], what)
    assert near([0.5], [0.6], ONE) and near([0.1 + 2j, 0.1 - 2j], [0.2 + 2j, 0.2 - 2j], CIRCLE)


def test_multipliers_of_a_longer_round():
    """Their logarithms grow with the time that it takes, and not towards anything."""
    for what in (ONE, MINUS_ONE, CIRCLE):
        assert near([5, -20], [15, -60], what) and not near([5, -20], [15, -60], what, longer=3.0)
        assert not near([15, -60], [5, -20], what, longer=1 / 3)


@pytest.mark.full
def test_multipliers_of_a_cycle_that_rests():
    """In the plane one is 1 and the other exp of the integrated divergence, however long the cycle rests at a saddle.

    Between two periods its logarithm changes by the divergence at the saddle, the parameter, times the difference.
    """
    problem = contin.AlgebraicProblem(lambda u, p: (u.y, u.x - u.x**2 + p.a * u.y + u.x * u.y), ["x", "y"], {"a": -1.2})
    hopf = contin.trace(contin.solve(problem, [1.0, 0.0]), free=["a"], limits={"a": (-1.5, 0)}).labelled("HB")[0]
    branch = contin.trace(hopf, branch=1, limits={"period": (0, 1000)}, zeros={"period": [300]}, errors=False)
    one, other = branch.labelled("UZ")[0], branch[-1]
    values = [point.system.eigenvalues(point.x) for point in (one, other)]
    assert all(abs(each[0]) < 1e-6 for each in values)
    rate = (values[1][1] - values[0][1]).real / (other["period"] - one["period"])
    assert rate == pytest.approx(other["a"], abs=1e-9)
