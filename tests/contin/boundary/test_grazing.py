"""Solutions that come to touch a stop, a flange or a limiter between two other times: GR, and what lies behind."""

import math

import numpy as np
import pytest
from scipy.optimize import brentq
from scipy.special import ellipk

import contin


def forced(c, w, k, force, forms="max"):
    """x'' + c x' + x + k (what of x is above 1) = F cos w t."""

    def rhs(t, u, p):
        over = {"max": lambda: max(u.x - 1, 0), "where": lambda: np.where(abs(u.x) > 1, (abs(u.x) - 1) * np.sign(u.x), 0.0),
                "clip": lambda: u.x - np.clip(u.x, -1, 1), "square": lambda: max(u.x - 1, 0) ** 2}[forms]()  # fmt: skip
        return u.v, -u.x - c * u.v - k * over + p.F * np.cos(w * t)

    problem = contin.CycleProblem(rhs, ["x", "v"], {"F": force}, period=2 * math.pi / w)
    answer = force / (1 - w**2 + 1j * w * c)

    def guess(t):
        turned = answer * np.exp(2j * np.pi * t)
        return turned.real, (1j * w * turned).real

    return contin.solve(problem, guess)


@pytest.mark.parametrize(
    ("c", "w", "k", "forms"), [(0, 0.7, 3, "max"), (0.1, 0.7, 3, "where"), (0.4, 0.9, 5, "clip"), (0.3, 0.8, 800, "max")]
)
def test_the_amplitude_reaches_a_stop(c, w, k, forms):
    """The amplitude is 1 where F^2 = (1 - w^2)^2 + (c w)^2; both sides of a symmetric stop are touched at once."""
    force = math.hypot(1 - w**2, c * w)
    branch = contin.trace(forced(c, w, k, 0.8 * force, forms), free=["F"], limits={"F": (0, 1.1 * force)})
    (touch,) = branch.labelled("GR")
    assert abs(touch["F"] - force) <= touch.errors["F"] + 1e-13 and touch.errors["F"] < 1e-11
    assert len(touch.details.times) == (1 if forms == "max" else 2) and not touch.details.folds
    assert forms in touch.name or "abs(u.x) > 1" in touch.name
    assert branch[-1]["F"] == 1.1 * force and branch[-1]["max_x"] > 1 and branch[-1].discretization_error < 1e-11


def test_period_doublings_right_behind_it_are_not_passed():
    """Multipliers change as the square root of the distance from the grazing point; those of own event integration: -1."""
    branch = contin.trace(forced(0.1, 0.7, 3, 0.4), free=["F"], limits={"F": (0.3, 0.7)})
    assert [point.label for point in branch if point.label] == ["EP", "GR", "PD", "PD", "EP"] and not branch.notes
    places = [point["F"] for point in branch.labelled("PD")]
    assert np.allclose(places, [0.51877331056, 0.57471663885], rtol=0, atol=1e-9)


def test_a_smooth_limiter_is_passed_in_silence():
    branch = contin.trace(forced(0.1, 0.7, 3, 0.4, "square"), free=["F"], limits={"F": (0.3, 0.7)})
    assert not branch.labelled("GR") and branch.stop.reason == "limit"


def test_a_beam_reaches_an_elastic_stop(tmp_path):
    """u'' = -q + k max(u - h, 0) touches in the middle at q = 8 h; a point that is stored keeps what it has found."""
    problem = contin.BoundaryValueProblem(
        lambda t, u, p: (u.v, -p.q + 40 * max(u.u - 0.2, 0)), lambda a, b, p: (a.u, b.u), ["u", "v"], {"q": 1.0}
    )
    branch = contin.trace(contin.solve(problem, [0.1, 0]), free=["q"], limits={"q": (0.5, 4)})
    (touch,) = branch.labelled("GR")
    assert abs(touch["q"] - 1.6) < 1e-12 and abs(touch.details.times[0] - 0.5) < 1e-8
    contin.save(branch, tmp_path / "b.npz")
    again = contin.load(problem, tmp_path / "b.npz").labelled("GR")[0]
    assert again.details.names == touch.details.names and again.details.times == touch.details.times
    back = contin.trace(branch[-1], free=["q"], direction=-1, limits={"q": (0.5, 4)})
    assert abs(back.labelled("GR")[0]["q"] - 1.6) < 1e-12 and back[-1]["q"] == 0.5


def test_a_pendulum_that_goes_round():
    """The sine of the angle is 1 once a round, whatever its speed."""

    def field(u, p):
        return u.y, p.M - np.sin(u.th) - 0.2 * u.y - 2 * max(np.sin(u.th) - p.h, 0)

    problem = contin.CycleProblem(field, ["th", "y"], {"M": 1.0, "h": 1.5}, angles=["th"])
    start = contin.cycle(problem, [0.0, 5.0])
    branch = contin.trace(start, free=["h", "period"], limits={"h": (0.5, 1.5)}, direction=-1)
    assert [point.label for point in branch if point.label] == ["EP", "GR", "EP"] and not branch.notes
    assert abs(branch.labelled("GR")[0]["h"] - 1) < 1e-12


def test_a_column_meets_an_elastic_bed():
    """Its middle touches where Euler's elastica is .3 high: 2 k / sqrt(P) = .3 with sqrt(P) = 2 K(k)."""
    column = contin.VariationalProblem(
        energy=lambda t, x, w, p: w.angle**2 / 2 + p.P * math.cos(x.angle) + 20 * max(x.y - 0.3, 0) ** 2,
        states=["y", "angle"], parameters={"P": 9.0}, kinematics=lambda t, x, w, p: (math.sin(x.angle), w.angle),
        controls=["angle"], ends=lambda a, b, p: (a.y, b.y),
    )  # fmt: skip
    straight = contin.trace(contin.solve(column, [0, 0]), free=["P"], limits={"P": (9, 12)})
    branch = [contin.trace(straight.labelled("BP")[0], branch=1, direction=way, limits={"P": (9, 13)}) for way in (1, -1)]
    (touch,) = [point for each in branch for point in each.labelled("GR")]
    k = brentq(lambda k: k / ellipk(k * k) - 0.3, 0.1, 0.9, xtol=1e-15)
    assert abs(touch["P"] - 4 * ellipk(k * k) ** 2) < 1e-11 and touch.index == 0 and "a condition" in touch.name


def test_a_cycle_in_the_plane_reaches_a_stop():
    """r' = r (m - r^2): the circle touches x = 1 at m = 1."""

    def field(u, p):
        r2 = u.x**2 + u.y**2
        return u.x * (p.m - r2) - u.y - 5 * max(u.x - 1, 0), u.y * (p.m - r2) + u.x

    problem = contin.AlgebraicProblem(field, ["x", "y"], {"m": -0.2})
    rest = contin.trace(contin.solve(problem, [0.0, 0.0]), free=["m"], limits={"m": (-0.2, 0.2)})
    branch = contin.trace(rest.labelled("HB")[0], branch=1, limits={"m": (0, 1.2)})
    (touch,) = branch.labelled("GR")
    assert abs(touch["m"] - 1) < 1e-11 and branch[-1]["m"] == 1.2 and branch[-1]["max_x"] < math.sqrt(1.2)


def test_a_wheelset_reaches_its_flanges():
    """Knudsen, Slivsgaard, Rose, True, Feldberg (1994), with creep by Vermeulen and Johnson; the yaw spring is 1.2e6 N/m.

    Behind the flanges the branch turns within 1e-8 m: the critical speed. From both sides it is the same.
    """
    m, inertia, a, k1, k2, creep, limit = 1022.0, 678.0, 0.716, 1.823e5, 1.2e6, 6.563e6, 1e4

    def wheelset(u, p):
        along, across = u.v / p.V - u.yaw, a * u.rate / p.V + 0.05 * u.x / 0.4572
        slip = np.sqrt((along / 0.54219) ** 2 + (across / 0.60252) ** 2)
        w = creep * slip / limit
        pull = np.where(w < 3, creep * (1 - w / 3 + w**2 / 27), limit / np.where(w < 3, 1.0, slip))
        flange = 14.6e6 * (max(u.x - 0.0091, 0) + min(u.x + 0.0091, 0))
        return (
            u.v, -(2 * k1 * u.x + 2 * along / 0.54219 * pull + flange) / m,
            u.rate, -(2 * k2 * 0.62**2 * u.yaw + 2 * a * across / 0.60252 * pull) / inertia,
        )  # fmt: skip

    problem = contin.AlgebraicProblem(wheelset, ["x", "v", "yaw", "rate"], {"V": 60.0})
    rest = contin.trace(contin.solve(problem, [0.0] * 4), free=["V"], limits={"V": (60, 90)})
    branch = contin.trace(rest.labelled("HB")[0], branch=1, limits={"V": (70, 79.2)})
    (touch,) = branch.labelled("GR")
    assert touch.details.folds and len(touch.details.times) == 2 and abs(touch["max_x"] - 0.0091) < 1e-12
    assert branch[-1]["V"] == 79.2 and branch[-1]["max_x"] > 0.0092
    inwards = contin.trace(branch[-1], free=["V", "period"], direction=-1, limits={"V": (70, 79.2)})
    assert [point.label for point in inwards if point.label] == ["EP", "LP", "GR", "HB"] and not inwards.notes
    assert abs(inwards.labelled("GR")[0]["V"] - touch["V"]) < 1e-9
