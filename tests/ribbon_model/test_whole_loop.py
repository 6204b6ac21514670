"""The whole closed loop as one domain, without a phase: each primary bifurcation is a circle of solutions."""

import numpy as np
import pytest

import contin
from ribbon_model import exact
from ribbon_model.domains import LOOP
from ribbon_model.laws import RIBBON
from ribbon_model.linear import thresholds

NU = 0.3
#: Without a phase M3 is free, and nothing need be unfolded on a circle.
FREE = ("kappa_n", "M1", "M2", "M3", "R1", "R2", "R3")


@pytest.fixture(scope="module")
def circle():
    system = contin.lowlevel.Collocation(LOOP.problem(RIBBON), np.linspace(0, 1, 13), 7, FREE, {"nu": NU})
    values = {"kappa_n": 2.0, "M1": 1 - 2.0}
    half = np.pi * system.nodes
    zero = 0 * half
    states = [np.cos(half), np.sin(half), zero, zero, zero, np.cos(2 * half) - 1, np.sin(2 * half)]
    start = contin.lowlevel.point_of(system, system.pack(np.array(states).T, dict.fromkeys(FREE, 0.0) | values))
    return contin.trace(start, free=FREE, limits={"kappa_n": (0, 3.15)})


@pytest.mark.full
def test_every_primary_bifurcation_is_passed_and_reported(circle):
    found = [point for point in circle if point.label == "BP"]
    expected = [thresholds(RIBBON, 1, n, NU)[0] for n in (2, 3, 4)]  # the linear theory
    assert [point["kappa_n"] for point in found] == pytest.approx(expected, rel=1e-10)
    assert [point.details.dimension for point in found] == [2] * 3
    assert all(point.details.continuum and len(point.details.tangents) == 1 for point in found)
    assert circle.stop.reason == "limit"


@pytest.mark.full
def test_with_a_phase_the_branch_is_followed_from_there(circle):
    """M3 = 0 at S = 0 and ``unfold`` take one solution of each circle: its fold is that of the cell (quadrature)."""
    point = next(point for point in circle if point.label == "BP")
    first, second = point.details.kernel
    third = point.system.parameter_index("M3")
    tangent = second[third] * first - first[third] * second  # no M3
    system, x = point.system.with_free(LOOP.free, point.x)
    size = point.system.state_size
    parts = dict(zip(FREE, tangent[size:]))
    tangent = np.append(tangent[:size], [parts.get(name, 0.0) for name in LOOP.free])
    run = contin.lowlevel.Continuation(
        system, x, contin.Settings(limits={"kappa_n": (0, 4.5), "kappa_star": (0.5, 2)}), tangent
    )
    labels = {p.label: p["kappa_n"] for p in run}
    (fold,) = exact.folds(1, 2, NU)
    assert labels["LP"] == pytest.approx(fold.kappa_n, abs=1e-10)
