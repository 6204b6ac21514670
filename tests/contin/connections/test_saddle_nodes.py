"""Homoclinic orbits to saddle-nodes, against shooting with SciPy (AUTO-07p's demo ``mtn``)."""

import functools

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.optimize import root

import contin
from contin import ConnectionProblem, ProblemError

D, H = 0.01, 0.5


def plankton(u, p):
    """Scheffer's predator and prey, as in AUTO-07p's demo ``mtn``."""
    eaten = 0.4 * u.x / (0.6 + u.x)
    return (
        0.5 * u.x * (1 - u.x / p.K) - u.y * eaten + p.D * p.K,
        0.6 * eaten * u.y - 0.15 * u.y - p.G * u.y**2 / (u.y**2 + H**2),
    )


def rates(u, K, G, D=D):
    x, y = u
    eaten = 0.4 * x / (0.6 + x)
    return np.array([0.5 * x * (1 - x / K) - y * eaten + D * K, 0.6 * eaten * y - 0.15 * y - G * y * y / (y * y + H**2)])


def jacobian(u, K, G):
    x, y = u
    eaten, slope = 0.4 * x / (0.6 + x), 0.24 / (0.6 + x) ** 2
    return np.array(
        [[0.5 - x / K - y * slope, -eaten], [0.6 * slope * y, 0.6 * eaten - 0.15 - 2 * G * y * H**2 / (y * y + H**2) ** 2]]
    )


@functools.cache
def central():
    """The central orbit at K = 6, from an integration that begins beside the saddle-node in its slow direction."""
    K, guess = 6.0, [5.74, 0.51, 0.0673]
    x, y, G = root(lambda z: [*rates(z[:2], K, z[2]), 10 * np.linalg.det(jacobian(z[:2], K, z[2]))], guess, tol=1e-13).x
    values, vectors = np.linalg.eig(jacobian((x, y), K, G))
    slow = vectors[:, np.abs(values).argmin()]
    e, time = np.array([x, y]), 1000.0
    runs = [
        solve_ivp(lambda t, u: rates(u, K, G), (0, time), e + sign * 0.05 * slow, rtol=1e-10, atol=1e-10, dense_output=True)
        for sign in (1, -1)
    ]
    run = max(runs, key=lambda run: np.ptp(run.y[1]))  # the other half of the slow direction leads back
    problem = ConnectionProblem(plankton, ["x", "y"], {"K": K, "G": G, "D": D}, unstable=0, saddle_node=True)
    return contin.solve(
        problem, lambda t: run.sol(time * t), {"time": time, "from_x": x, "from_y": y}, free=["G"], intervals=400
    )  # fmt: skip


def test_the_central_orbit_lies_on_the_fold():
    """The parameter of a central orbit is that of the fold of equilibria; G = 0.06729762 in AUTO's demo."""
    orbit = central()
    assert orbit["G"] == pytest.approx(0.06729762, abs=5e-9)
    e = orbit["from_x"], orbit["from_y"]
    assert np.linalg.det(jacobian(e, 6.0, orbit["G"])) == pytest.approx(0, abs=1e-12)


def missed(K, guess, D=D):
    """Distance, at y = 2, of the orbit that leaves the saddle-node slowly from the one that comes in in the fast direction."""
    x, y, G = root(lambda z: [*rates(z[:2], K, z[2], D), 10 * np.linalg.det(jacobian(z[:2], K, z[2]))], guess, tol=1e-14).x
    e = np.array([x, y])
    values, vectors = np.linalg.eig(jacobian(e, K, G))
    at = np.abs(values).argmin()
    slow, fast, left = vectors[:, at], vectors[:, 1 - at], np.linalg.inv(vectors)
    step = 1e-4
    bent = (rates(e + step * slow, K, G, D) - 2 * rates(e, K, G, D) + rates(e - step * slow, K, G, D)) / step**2
    c = 2e-3 * np.sign(left[at] @ bent)  # on the centre manifold, c' = left.bent c^2 / 2
    start = e + c * slow - left[1 - at] @ bent / (2 * values[1 - at]) * c * c * fast

    def height(t, u):
        return u[1] - 2

    options = {"method": "DOP853", "rtol": 1e-13, "atol": 1e-14, "events": height}
    out = solve_ivp(lambda t, u: rates(u, K, G, D), (0, 3e4), start, **options)
    height.terminal = True
    back = [solve_ivp(lambda t, u: -rates(u, K, G, D), (0, 150), e + s * 1e-7 * fast, **options) for s in (1, -1)]
    (back,) = [run for run in back if len(run.t_events[0])]
    return out.y_events[0][1, 0] - back.y_events[0][0, 0]


#: Roots of `missed`, by Brent's method: ``brentq(missed, K - 1e-3, K + 1e-3, args=(guess,), xtol=1e-13)``, in 20 s.
NON_CENTRAL = {1: 6.610458649374763, -1: 5.180307602817071}


@functools.cache
def curve(direction):
    return contin.trace(central(), free=["K", "G"], direction=direction, limits={"K": (1, 20)})


@pytest.mark.sample(1)
@pytest.mark.parametrize("direction", [1, -1])
def test_central_orbits_end_at_non_central_ones(direction):
    found = curve(direction)
    assert [point.label for point in found] == ["EP"] + [""] * (len(found) - 2) + ["NCH"]
    assert found.points[-1]["K"] == pytest.approx(NON_CENTRAL[direction], abs=1e-10)


@pytest.mark.full
def test_non_central_orbits_by_shooting():
    """The orbits of the shooting meet at the K that contin finds, and pass each other beside it."""
    for direction, guess in ((1, [6.36, 0.509, 0.0693]), (-1, [4.9, 0.515, 0.0639])):
        K = curve(direction).points[-1]["K"]
        beside = [missed(K + way * 1e-4, guess) for way in (-1, 1)]
        assert beside[0] * beside[1] < 0
        assert abs(missed(K, guess)) < 1e-6 * abs(beside[1] - beside[0])


@pytest.mark.sample(1)
@pytest.mark.parametrize(("direction", "known"), [(1, (15.0379, 0.0942805)), (-1, (11.0181, 0.280979))])
def test_curves_to_saddles_leave_and_come_back(direction, known):
    """AUTO's third and fifth run end at these places of the curves of orbits to saddles."""
    end = curve(direction).points[-1]
    saddles = contin.trace(end, branch=1, limits={"K": (1, 20), "G": (0.01, known[1])})
    assert not saddles.points[0].system.problem.saddle_node
    with pytest.raises(ProblemError, match="free: the curve that leaves at NCH has the parameters"):
        contin.trace(end, branch=1, free=["K", "D"])
    assert saddles.points[-1]["G"] == pytest.approx(known[1], abs=1e-9)
    assert saddles.points[-1]["K"] == pytest.approx(known[0], abs=2e-4)  # six digits in AUTO's output
    back = contin.trace(saddles.points[-1], direction=-1, limits={"K": (1, 20)}) if direction == 1 else None
    if back is not None:
        assert back.points[-1].label == "NCH" and back.points[-1]["K"] == pytest.approx(end["K"], abs=1e-9)
        again = contin.trace(back.points[-1], branch=1, limits={"K": (6.5, 20)})
        assert again.points[0].system.problem.saddle_node and again.points[-1]["K"] == pytest.approx(6.5)


@pytest.mark.full
def test_the_time_does_not_matter_where_an_orbit_is_non_central():
    """Where the orbit comes in exponentially, the error of cutting off is below 1e-11 for all times."""
    longer = contin.curve(curve(1).points[-1], "time", limits={"time": (100, 3000)})
    assert longer.points[-1]["time"] == pytest.approx(3000)
    assert np.ptp(longer.column("K")) < 1e-10


@pytest.mark.full
def test_non_central_orbits_in_three_parameters():
    """By shooting at D = 0.0055, as at D = 0.01."""
    found = contin.curve(curve(-1).points[-1], "D", direction=-1, limits={"D": (0.005, 0.02)}, zeros={"D": [0.0055]})
    assert str(found.stop) == "reached D = 0.005"
    (point,) = found.labelled("UZ")
    K, guess = point["K"], [point["from_x"], point["from_y"], point["G"]]
    beside = [missed(K + way * 1e-4, guess, 0.0055) for way in (-1, 1)]
    assert beside[0] * beside[1] < 0
    assert abs(missed(K, guess, 0.0055)) < 1e-6 * abs(beside[1] - beside[0])


def test_what_cannot_be_is_said():
    with pytest.raises(ProblemError, match="saddle_node: orbits to a saddle-node are homoclinic; leave out stable"):
        ConnectionProblem(plankton, ["x", "y"], {"K": 6.0, "G": 0.07, "D": D}, unstable=1, stable=1, saddle_node=True)
    with pytest.raises(ProblemError, match="unstable: 2 must be a whole number from 0 to 1"):
        ConnectionProblem(plankton, ["x", "y"], {"K": 6.0, "G": 0.07, "D": D}, unstable=2, saddle_node=True)
