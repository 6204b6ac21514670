"""Multipliers of cycles of long periods, which have long intervals beside their saddle."""

import math

import numpy as np
import pytest

import contin


@pytest.mark.full
@pytest.mark.parametrize("period", [pytest.param(250, marks=pytest.mark.full), 400])
def test_they_grow_and_decay_with_the_period(period):
    """A driven pendulum: the mean of v is 2 pi / T, so that the logarithms are 0, -1.15 T and -5 T + .4 pi."""

    def field(u, p):
        return u.v, p.torque - 1.15 * u.v - np.sin(u.phi), (0.2 * u.v - 5) * u.z

    problem = contin.CycleProblem(field, ["phi", "v", "z"], {"torque": 1.3}, angles=["phi"])
    first = contin.cycle(problem, [0.0, 1.0, 0.0])
    branch = contin.trace(first, free=["torque"], direction=-1, limits={"torque": (0, 2), "period": (0, period)})
    end = branch.points[-1]
    logarithms = end.system.eigenvalues(end.x).real
    assert logarithms == pytest.approx([0, -1.15 * period, -5 * period + 0.4 * math.pi], rel=1e-5, abs=0.002)
    assert not [point for point in branch.points[1:-1] if point.label]
