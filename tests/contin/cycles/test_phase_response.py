"""The phase response of cycles: against closed forms, and against motions that are perturbed and integrated."""

import math

import numpy as np
import pytest
from matplotlib.figure import Figure
from scipy.integrate import solve_ivp

import contin
from contin import CycleProblem, ProblemError


def sheared(size=1.0, rate=1.0):
    """z' = rate (1 + i w) z - rate (1 + i b) |z / size|^2 z, in Cartesian coordinates."""

    def field(u, p):
        x, y = u.x / size, u.y / size
        s = x * x + y * y
        return size * rate * (x - p.w * y - s * (x - p.b * y)), size * rate * (y + p.w * x - s * (y + p.b * x))

    def guess(t):
        return size * math.cos(2 * math.pi * t), size * math.sin(2 * math.pi * t)

    problem = CycleProblem(field, ["x", "y"], {"w": 3.0, "b": 0.0})
    return lambda b, **options: contin.solve(problem, guess, {"b": b, "period": 2 * math.pi / 3 / rate}, **options)


def exact(angle, b, size=1.0, rate=1.0):
    """The phase is (angle - b log r) / omega, omega = rate (w - b)."""
    x, y = np.cos(angle), np.sin(angle)
    return np.stack([-y - b * x, x - b * y], axis=1) / (size * rate * (3 - b))


@pytest.mark.sample(3)
@pytest.mark.parametrize("b", [0.0, 0.7, -2.0])  # the radial isochron clock, and with shear both ways
@pytest.mark.parametrize("options", [{}, {"intervals": 6, "mesh": contin.MeshControl(every=0)}, {"degree": 7}])
def test_of_stuart_and_landau(b, options):
    """At the nodes and between them, within the estimated errors, which are no more than a thousand times too large."""
    orbit = sheared()(b, **options)
    response = orbit.phase_response()
    x, y = orbit.system.states(orbit.x)[0]
    for t in (response.times, np.linspace(0, response.period, 1001)):
        gap = np.abs(response(t) - exact(math.atan2(y, x) + (3 - b) * t, b)).max(axis=0)
        assert np.all(gap <= [response.errors[name] + 1e-14 for name in ("x", "y")])
    assert np.all(gap >= [1e-3 * response.errors[name] - 1e-12 for name in ("x", "y")])


def test_in_odd_units():
    """States of the size of 1e-6 in a time of 1e3."""
    orbit = sheared(1e-6, 1e-3)(0.7)
    response = orbit.phase_response()
    x, y = orbit.system.states(orbit.x)[0]
    expected = exact(math.atan2(y, x) + 1e-3 * (3 - 0.7) * response.times, 0.7, 1e-6, 1e-3)
    gap = np.abs(response.values - expected).max(axis=0)
    assert np.all(gap <= [response.errors[name] for name in ("x", "y")])
    assert max(response.errors.values()) < 2e-6 * np.abs(expected).max()  # the mesh suits states of the size 1


def van_der_pol(u, p):
    return u.v, p.mu * (1 - u.x**2) * u.v - u.x


def crossing(start, rounds):
    """The time at which x passes 0 upwards for the n-th time, by SciPy."""

    def passes(t, u):
        return u[0]

    passes.direction = 1.0
    done = solve_ivp(lambda t, u: (u[1], 2 * (1 - u[0] ** 2) * u[1] - u[0]), (0, 7.7 * rounds + 8), start, "DOP853",
                     rtol=1e-13, atol=1e-13, events=passes)  # fmt: skip
    return done.t_events[0][rounds]


@pytest.mark.full
def test_of_van_der_pol_against_perturbed_motions():
    """The motion from u(t) + v passes zero earlier by Z.v after some rounds; central differences, right to the square."""
    orbit = contin.cycle(CycleProblem(van_der_pol, ["x", "v"], {"mu": 2.0}), [1.0, 0.0])
    response = orbit.phase_response()
    for part in (0.1, 0.35, 0.55, 0.8):
        state = orbit.system.evaluate(orbit.x, np.array([part]))[0]
        value = response(part * response.period)
        for i in range(2):
            change = 1e-4 * np.eye(2)[i]
            late, early = crossing(state - change, 5), crossing(state + change, 5)
            assert value[i] == pytest.approx((late - early) / 2e-4, abs=1e-6)  # 1e-13 / 1e-4, and the square of 1e-4


def test_with_the_symmetry_stated():
    """The half of the cycle that is computed, and its image."""
    whole = contin.cycle(CycleProblem(van_der_pol, ["x", "v"], {"mu": 2.0}), [1.0, 0.0])
    problem = CycleProblem(van_der_pol, ["x", "v"], {"mu": 2.0}, symmetry=[-1, -1])
    half = contin.solve(problem, whole)
    ours, theirs = half.phase_response(), whole.phase_response()
    shift = half.system.evaluate(half.x, np.zeros(1))[0] - whole.system.evaluate(whole.x, np.zeros(1))[0]
    assert np.abs(shift).max() < 1e-8
    t = np.linspace(-3, 12, 200)
    assert np.abs(ours(t) - theirs(t)).max() < 1e-7
    assert ours.times[-1] == pytest.approx(theirs.times[-1]) and ours["v"].shape == ours.times.shape


def test_on_the_cycle_it_is_one():
    """Z.F = 1 at points of a branch, and of a curve in two parameters; where Z is not small it is as exact as estimated."""

    def lorenz(u, p):
        return 10 * (u.y - u.x), p.r * u.x - u.y - u.x * u.z, u.x * u.y - p.b * u.z

    start = contin.solve(contin.AlgebraicProblem(lorenz, ["x", "y", "z"], {"r": 22.0, "b": 8 / 3}), [7, 7, 20])
    (hopf,) = contin.trace(start, free=["r"], limits={"r": (20, 30)}).labelled("HB")
    branch = contin.trace(hopf, branch=1, limits={"r": (20, 30)})
    curve = contin.curve(branch[4], free=["r", "b"], hold="period", max_points=3)
    for point in (branch[4], branch[-1], curve[-1]):
        response, parameters = point.phase_response(), point.parameters
        base = point.system.solution
        x, y, z = base.evaluate(point.x[: base.size], response.times / response.period).T
        rates = 10 * (y - x), parameters["r"] * x - y - x * z, x * y - parameters["b"] * z
        product = sum(response[name] * rate for name, rate in zip(response.names, rates))
        noise = sum(response.errors[name] * np.abs(rate).max() for name, rate in zip(response.names, rates))
        assert np.abs(product - 1).max() < noise + 1e-6  # the rates are those of the interpolated cycle


def test_its_picture():
    orbit = sheared()(0.7)
    axes = orbit.phase_response().plot(axes=Figure().subplots())
    assert [line.get_label() for line in axes.lines[1:]] == ["x", "y"] and axes.get_xlabel() == "t"
    axes = orbit.phase_response().plot(["y"], axes=Figure().subplots())
    assert axes.get_ylabel() == "time gained per change of y"
    with pytest.raises(ProblemError, match="states: 'z' is no state; there are x, y"):
        orbit.phase_response().plot(["z"])
    with pytest.raises(KeyError, match="none of x, y"):
        orbit.phase_response()["z"]
    assert "x ± " in repr(orbit.phase_response())


def test_what_has_no_phase():
    def forced(t, u, p):
        return u.v, -0.1 * u.v - u.x + math.cos(t)

    rest = contin.solve(contin.AlgebraicProblem(van_der_pol, ["x", "v"], {"mu": 2.0}), [0, 0])
    driven = contin.solve(CycleProblem(forced, ["x", "v"], {"w": 1.0}, period=2 * math.pi), [0.0, 1.0])
    of_map = contin.solve(contin.MapProblem(lambda u, p: (2.5 * u.x * (1 - u.x),), ["x"], {}), [0.6])
    for point in (rest, driven, of_map):
        with pytest.raises(ProblemError, match="must be a cycle of an autonomous CycleProblem"):
            point.phase_response()
    pendulum = CycleProblem(lambda u, p: (u.v, -math.sin(u.x) - p.f * u.v), ["x", "v"], {"f": 0.0})
    family = contin.solve(
        pendulum, lambda t: (math.cos(2 * math.pi * t), -math.sin(2 * math.pi * t)), {"period": 6.7}, free=["f"]
    )
    with pytest.raises(ProblemError, match="a second multiplier is 1"):
        family.phase_response()
