"""Cycles whose period runs away: the end of the branch names the equilibrium beside and its eigenvalues."""

import math

import numpy as np
import pytest

import contin
from contin import AlgebraicProblem, CycleProblem
from contin.cycles.homoclinic import resting_place


def lorenz(u, p):
    return 10 * (u.y - u.x), p.r * u.x - u.y - u.x * u.z, u.x * u.y - 8 / 3 * u.z


def test_lorenz_ends_beside_the_origin():
    """The homoclinic orbit lies at r = 13.926557 (published). The origin has -8/3 and (-11 +- sqrt(81 + 40 r)) / 2."""
    side = math.sqrt(8 / 3 * 19)
    equilibria = AlgebraicProblem(lorenz, ["x", "y", "z"], {"r": 20.0})
    line = contin.trace(contin.solve(equilibria, [side, side, 19.0]), free=["r"], limits={"r": (15, 30)})
    branch = contin.trace(line.labelled("HB")[0], branch=1, limits={"r": (10, 30)})
    end = branch.points[-1]
    assert (end.label, end.name) == ("EP", "homoclinic orbit") and end["r"] == pytest.approx(13.926557, abs=1e-6)
    assert not [point for point in branch.points[1:-1] if point.label]
    place = resting_place(end.system, end.x)
    root = math.sqrt(81 + 40 * end["r"])
    assert np.abs(place.states).max() < 1e-9 and place.share > 0.8
    assert place.eigenvalues.real == pytest.approx([(-11 + root) / 2, -8 / 3, (-11 - root) / 2], abs=1e-9)
    assert "of its time near the equilibrium x = 0, y = 0, z = 0, eigenvalues 7.12995, -2.66667, " in str(branch.stop)


def test_a_saddle_node_on_the_cycle():
    """r' = r - r^3, angle' = 1 + mu - sin(angle): at small mu the cycle is slow at (0, 1), where no equilibrium is left."""

    def field(u, p):
        s = u.x**2 + u.y**2
        turn = (1 + p.mu) * s - u.y * s**0.5
        return u.x * (1 - s) - u.y * turn, u.y * (1 - s) + u.x * turn

    problem = CycleProblem(field, ["x", "y"], {"mu": 1.0})
    orbit = contin.cycle(problem, [1.0, 0.0])
    branch = contin.trace(orbit, free=["mu"], direction=-1, limits={"mu": (0.01, 2)})
    assert branch.points[-1]["period"] == pytest.approx(2 * math.pi / math.sqrt(1.01**2 - 1), rel=1e-9)
    assert str(branch.stop) == "reached mu = 0.01"


def test_a_fast_cycle_is_near_nothing():
    problem = CycleProblem(lambda u, p: (u.v, p.mu * (1 - u.x**2) * u.v - u.x), ["x", "v"], {"mu": 1.0})
    orbit = contin.cycle(problem, [0.1, 0.0])
    assert resting_place(orbit.system, orbit.x) is None


@pytest.mark.parametrize("longest", [4, 7])
def test_the_parameter_is_extrapolated(longest):
    """r = 13.926557407520 where the period is infinite, to 14 digits; the error covers the difference."""
    side = math.sqrt(8 / 3 * 19)
    equilibria = AlgebraicProblem(lorenz, ["x", "y", "z"], {"r": 20.0})
    line = contin.trace(contin.solve(equilibria, [side, side, 19.0]), free=["r"], limits={"r": (15, 30)})
    branch = contin.trace(line.labelled("HB")[0], branch=1, limits={"r": (10, 30), "period": (0, longest)})
    found = branch.points[-1].details
    assert abs(found["limit_r"] - 13.926557407520) <= found["limit_r_error"] + 5e-13 < 1e-6
    assert "; as the period grows, r tends to 13.926557" in str(branch.stop)
