"""Homoclinic orbits that are grown from their saddle."""

import numpy as np
import pytest
from cycles.noted import NOTES

import contin
from contin import AlgebraicProblem, ProblemError


def lorenz(u, p):
    return p.s * (u.y - u.x), p.r * u.x - u.y - u.x * u.z, u.x * u.y - 8 / 3 * u.z


def origin(field, parameters, **values):
    return contin.solve(AlgebraicProblem(field, ["x", "y", "z"], {**parameters, **values}), [0.0, 0.0, 0.0])


@pytest.mark.full
@pytest.mark.parametrize("r", [12.0, 20.0])
def test_lorenz_from_both_sides(r):
    """r = 13.926557407520: Doedel, Krauskopf & Osinga (2006) and others give 13.9265574075."""
    orbit = contin.homoclinic(origin(lorenz, {"s": 10.0}, r=r), free=["r"], limits={"r": (10, 25)})
    assert orbit["r"] == pytest.approx(13.926557407520, abs=1e-6) and orbit["gap"] < 2e-3
    longer = contin.trace(orbit, free=["r", "time"], primary="time", limits={"time": (3, orbit["time"] + 6)}).points[-1]
    assert longer["r"] == pytest.approx(13.926557407520, abs=1e-11)
    assert 0 < longer.errors["r"] < 1e-10


def test_backwards_in_time():
    """With time reversed the saddle has one stable eigenvalue, and the orbit is the same."""
    orbit = contin.homoclinic(
        origin(lambda u, p: tuple(-rate for rate in lorenz(u, p)), {"s": 10.0}, r=14.5), free=["r"], limits={"r": (10, 25)}
    )
    assert orbit.system.problem.unstable == 2
    assert orbit["r"] == pytest.approx(13.926557407520, abs=1e-5)


def shimizu_morioka(u, p):
    return u.y, u.x * (1 - u.z) - p.lam * u.y, -p.alpha * u.z + u.x**2


@pytest.mark.full
def test_shimizu_and_morioka():
    """By shooting: at the parameter found the orbit from the origin passes it on one side, and beside it on the other."""
    from scipy.integrate import solve_ivp

    orbit = contin.homoclinic(origin(shimizu_morioka, {"alpha": 0.45}, lam=0.9), free=["lam"], limits={"lam": (0.3, 1.5)})
    longer = contin.trace(orbit, free=["lam", "time"], primary="time", limits={"time": (3, orbit["time"] + 25)}).points[-1]

    def side(lam):
        rate = (-lam + np.sqrt(lam**2 + 4)) / 2
        run = solve_ivp(
            lambda t, u: [u[1], u[0] * (1 - u[2]) - lam * u[1], -0.45 * u[2] + u[0] ** 2], (0, 80),
            [1e-8, 1e-8 * rate, 0.0], method="DOP853", rtol=1e-12, atol=1e-14,
        )  # fmt: skip
        turns = np.flatnonzero(run.y[0] < 0)
        return bool(len(turns)) and run.t[turns[0]] < 60

    assert [side(longer["lam"] + way * 1e-8) for way in (-1, 1)] in ([True, False], [False, True])


def koper(u, p):
    return p.e * (p.k * u.y - u.x**3 + 3 * u.x - p.l), u.x - 2 * u.y + u.z, u.y - u.z


@pytest.mark.full
def test_koper_as_in_autos_demo():
    """AUTO-07p's demo ``kpr`` finds this orbit by homotopy (ISTART = 3)."""
    saddle = contin.solve(AlgebraicProblem(koper, ["x", "y", "z"], {"l": -1.85, "k": -0.15, "e": 10.0}), [-0.95] * 3)
    orbit = contin.homoclinic(saddle, free=["l"], limits={"l": (-1.87, -1.8)}, direction=-1)
    assert orbit["l"] == pytest.approx(NOTES["kpr"]["adjoint"][0]["second"], abs=2e-10)
    with pytest.raises(
        contin.ConvergenceError, match="no orbit from the equilibrium comes back to it for l from -1.87 to -1.8"
    ):
        contin.homoclinic(saddle, free=["l"], limits={"l": (-1.87, -1.8)})


def test_what_cannot_be_is_said():
    saddle = origin(lorenz, {"s": 10.0}, r=14.0)
    with pytest.raises(ProblemError, match="limits: must hold the least and the largest value of r"):
        contin.homoclinic(saddle, free=["r"])
    with pytest.raises(ProblemError, match="limits: r = 14 at the start must lie between 15 and 20"):
        contin.homoclinic(saddle, free=["r"], limits={"r": (15, 20)})
    with pytest.raises(ProblemError, match="free: q must be one of the parameters"):
        contin.homoclinic(saddle, free=["q"], limits={"q": (15, 20)})
    with pytest.raises(ProblemError, match="direction: 2 must be 1 or -1"):
        contin.homoclinic(saddle, free=["r"], limits={"r": (10, 20)}, direction=2)
    with pytest.raises(ProblemError, match="start: the equilibrium is stable, no saddle"):
        contin.homoclinic(origin(lorenz, {"s": 10.0}, r=0.5), free=["r"], limits={"r": (0, 20)})
