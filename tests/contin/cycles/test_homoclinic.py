"""Cycles whose period runs away: the end of the branch names the equilibrium beside and its eigenvalues."""

import math

import numpy as np
import pytest

import contin
from contin import AlgebraicProblem, CycleProblem
from contin.cycles.ends import resting_place


def lorenz(u, p):
    return 10 * (u.y - u.x), p.r * u.x - u.y - u.x * u.z, u.x * u.y - 8 / 3 * u.z


@pytest.mark.full
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


@pytest.mark.sample(1)
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


def _of_a_curve(ratio):
    """Sandstede (1997): x^2 (1 - x) = y^2 is homoclinic at mu = 0 to the origin, with the eigenvalues 1 - ratio, -1 - ratio."""

    def field(u, p):
        a, turn = -ratio, p.mu * (2 - 3 * u.x)
        return a * u.x + u.y - a * u.x**2 + turn * u.x, u.x + a * u.y - 1.5 * u.x**2 - 1.5 * a * u.x * u.y - 2 * p.mu * u.y

    return field


def _of_an_energy(potential, force, a):
    """On H = 0, through the saddle, the orbit of mu = 0 is that without damping; eigenvalues 1 and -1."""
    return lambda u, p: (u.y, force(u.x) + u.y * (p.mu - a * (u.y**2 / 2 + potential(u.x))))


def _driven(friction):
    return lambda u, p: (u.y, p.mu - friction * u.y - np.sin(u.x))


def _beside(eigenvalue):
    """One more state, of which the orbit has no part, with the eigenvalue nearest to the axis."""
    plane = _of_a_curve(0.5)
    return lambda u, p: (*plane(u, p), eigenvalue * u.z)


def _morris_lecar(u, p):
    current = 2 * (1 + np.tanh((u.x + 1.2) / 18)) * (u.x - 120) + 8 * u.y * (u.x + 84) + 2 * (u.x + 60)
    return (p.mu - current) / 20, 0.2 * (0.5 * (1 + np.tanh((u.x - 12) / 17.4)) - u.y) * np.cosh((u.x - 12) / 34.8)


def _yamada(u, p):
    """Dubbeldam and Krauskopf (1999): the laser is off at a branch point, 6.8; the saddle of the orbit lies beside it."""
    return 0.04 * (p.mu - u.x - u.x * u.z), 0.04 * (5.8 - u.y - 1.8 * u.y * u.z), (u.x - u.y - 1) * u.z


#: Pairs of a potential and its force.
WELL = (lambda x: x**3 / 3 - x**2 / 2, lambda x: x - x**2)
WELLS = (lambda x: x**4 / 4 - x**2 / 2, lambda x: x - x**3)
PENDULUM = (lambda x: -np.cos(x) - 1, lambda x: -np.sin(x))
LONG = pytest.mark.full
#: Field, start, first mu, limit, the longest periods, and those from which the limit is known. Limits of driven pendulums are
#: from the unstable manifold of the saddle, integrated (DOP853, 1e-13), that of the neuron from cycles five times as long.
FAMILIES = [
    pytest.param(_of_a_curve(0.5), [0.67, 0.1], 0.02, 0.0, (10, 15, 25, 60), 25, id="curve"),
    pytest.param(_of_a_curve(0.9), [0.67, 0.1], 0.05, 0.0, (10, 25, 60), 60, id="curve, weak", marks=LONG),
    pytest.param(_of_a_curve(0.99), [0.67, 0.1], 0.05, 0.0, (60, 300), 300, id="curve, near a fold", marks=LONG),
    pytest.param(_beside(-0.1), [0.67, 0.1, 0.0], 0.02, 0.0, (15, 25, 60), 25, id="no part"),
    pytest.param(_of_an_energy(*WELL, 0.5), [1.2, 0.1], -0.025, 0.0, (10, 25), 25, id="well"),
    pytest.param(_of_an_energy(*WELLS, 2.0), [1.2, 1.1], 0.1, 0.0, (12, 25), 25, id="two wells", marks=LONG),
    pytest.param(_of_an_energy(*WELLS, 2.0), [1.2, 0.1], -0.1, 0.0, (12, 15, 25), 12, id="one of two wells", marks=LONG),
    pytest.param(_of_an_energy(*PENDULUM, 2.0), [0.0, 2.3], 0.2, 0.0, (8, 15, 25), 15, id="rotations", marks=LONG),
    pytest.param(_driven(0.3), [0.0, 4.0], 1.3, 0.37347438584338, (12, 20, 40), 20, id="driven", marks=LONG),
    pytest.param(_driven(1.15), [0.0, 1.0], 1.3, 0.99816726979542, (40, 80, 160, 300), 160, id="driven, near a fold"),
    pytest.param(_driven(1.19), [0.0, 1.0], 1.3, 0.99999074748448, (160, 1000), 2000, id="driven, nearer", marks=LONG),
    pytest.param(_driven(1.5), [0.0, 1.0], 1.3, 1.0, (20, 200, 2000), math.inf, id="fold", marks=LONG),
    pytest.param(_morris_lecar, [0.0, 0.1], 45.0, 39.814496882499, (200, 300, 400, 700), 400, id="neuron", marks=LONG),
    pytest.param(_yamada, [3.0, 2.0, 5.0], 7.2, 6.7999913, (500, 5000), math.inf, id="laser"),
]


@pytest.mark.sample(1)
@pytest.mark.parametrize(("field", "start", "mu", "limit", "longest", "known"), FAMILIES)
def test_a_limit_lies_within_its_error_or_is_not_given(field, start, mu, limit, longest, known, request):
    angles = ["x"] if request.node.callspec.id.startswith(("rotations", "driven", "fold")) else []
    problem = CycleProblem(field, ["x", "y", "z"][: len(start)], {"mu": mu}, angles=angles)
    first = contin.cycle(problem, start, settle=1000.0 if field is _yamada else 100.0)
    for period in longest:
        limits = {"mu": (-1, 60), "period": (0, period)}
        branch = contin.trace(first, free=["mu"], direction=int(np.sign(limit - mu)), limits=limits)
        assert str(branch.stop).startswith(f"reached period = {period}")
        found = branch.points[-1].details or {}
        assert ("limit_mu" in found) == (period >= known)
        if found:
            assert abs(found["limit_mu"] - limit) <= found["limit_mu_error"] <= 0.002
