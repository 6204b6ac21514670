"""Connecting orbits against closed forms, and against the homoclinic orbit of the Lorenz equations."""

import math
from functools import cache

import numpy as np
import pytest

from bank import stw
from contin import AlgebraicProblem, ConnectionProblem, CycleProblem, ProblemError, homoclinic, load, save, solve, trace


def nagumo(u, p):
    """Fronts of u_t = u_xx + u (1 - u)(u - a) that travel with the speed c."""
    return u.v, p.c * u.v - u.u * (1 - u.u) * (u.u - p.a)


def speed(a):
    """Exact: Huxley's front u = 1 / (1 + exp(-x / sqrt 2))."""
    return (1 - 2 * a) / math.sqrt(2)


def huxley(length):
    def guess(t):
        u = 1 / (1 + math.exp(-length * (t - 0.5) / math.sqrt(2)))
        return u, u * (1 - u) / math.sqrt(2)

    return guess


@cache
def front(length=40.0):
    problem = ConnectionProblem(nagumo, ["u", "v"], {"a": 0.25, "c": 0.3}, unstable=1, stable=1)
    return solve(problem, huxley(length), {"time": length, "to_u": 0.99}, free=["c"])


def test_a_front_has_its_exact_speed():
    found = front()
    assert abs(found["c"] - speed(0.25)) < 1e-12
    assert abs(found["to_u"] - 1) < 1e-14 and abs(found["from_u"]) < 1e-14


def test_the_error_of_cutting_off_is_about_the_square_of_the_gap():
    for length in (15.0, 20.0, 25.0):
        found = front(length)
        assert 0.01 * found["gap"] ** 2 < abs(found["c"] - speed(0.25)) < 2 * found["gap"] ** 2


@pytest.mark.sample(1)
@pytest.mark.parametrize("length", [10.0, 15.0, 20.0, 25.0])
def test_the_error_covers_the_time_that_is_cut_off(length):
    """The exact speed, at a first point and at a limit: the estimate is right to a third, and never too small."""
    for point in trace(front(length), free=["a", "c"], limits={"a": (0.2, 0.3)}).labelled("EP"):
        off = abs(point["c"] - speed(point["a"]))
        assert off < point.errors["c"] < 1.35 * off


def test_the_error_of_a_located_value_covers_the_time_that_is_cut_off():
    """Where c = .3, a is wrong by what c is wrong, over the slope of the exact speed."""
    branch = trace(front(15.0), free=["a", "c"], zeros={"c": [0.3]}, limits={"a": (0.2, 0.4)})
    (point,) = branch.labelled("UZ")
    off = abs(point["a"] - (1 - 0.3 * math.sqrt(2)) / 2)
    assert off < point.errors["a"] < 1.35 * off and point.errors["c"] < 1e-12


def test_a_homoclinic_orbit_stated_as_one_between_two_equilibria():
    problem = ConnectionProblem(loop, ["x", "y"], {"d": 0.01, "b": 0.0}, unstable=1, stable=1)

    def guess(t):
        x = 1.4 / math.cosh(18 * (t - 0.5)) ** 2
        return x, -x * math.tanh(18 * (t - 0.5))

    with pytest.raises(
        ProblemError, match="stable: both ends of the orbit are at the equilibrium x = 0, y = 0; leave out stable"
    ):
        solve(problem, guess, {"time": 36}, free=["d"])


def test_a_curve_of_fronts():
    branch = trace(front(), free=["a", "c"], limits={"a": (0.05, 0.45)})
    assert str(branch.stop) == "reached a = 0.45" and len(branch.points) > 3
    for point in branch.points:
        assert abs(point["c"] - speed(point["a"])) < 1e-11


def test_a_front_into_a_node():
    """Fisher's front leaves a saddle for a node: a family in its speed. At 5/sqrt 6 it is 1 / (1 + exp(x / sqrt 6))^2."""

    def fisher(u, p):
        return u.v, -p.c * u.v - u.u * (1 - u.u)

    def exact(x):
        e = math.exp(x / math.sqrt(6))
        return 1 / (1 + e) ** 2, -2 * e / math.sqrt(6) / (1 + e) ** 3

    problem = ConnectionProblem(fisher, ["u", "v"], {"c": 2.2}, unstable=1, stable=2)
    assert problem.free_size == 1 + 4  # the speed, and two coordinates of each equilibrium
    start = solve(problem, lambda t: exact(60 * (t - 0.4)), {"time": 60, "from_u": 1})
    branch = trace(start, free=["c"], zeros={"c": [5 / math.sqrt(6)]}, limits={"c": (2.01, 2.3)}, direction=-1)
    (point,) = branch.labelled("UZ")
    u = point.system.states(point.x)
    half = np.abs(u[:, 0] - 0.25).argmin()
    x = 60 * (point.system.nodes - point.system.nodes[half]) + math.sqrt(6) * math.log(1 / math.sqrt(u[half, 0]) - 1)
    assert np.abs(u - np.array([exact(each) for each in x])).max() < 1e-8


def loop(u, p):
    """At d = b the homoclinic orbit is x = 3/2 / cosh(t / 2)^2."""
    return u.y, u.x - u.x**2 + (p.d - p.b) * u.y


def test_a_homoclinic_orbit_and_its_curve():
    problem = ConnectionProblem(loop, ["x", "y"], {"d": 0.01, "b": 0.0}, unstable=1)

    def guess(t):
        x = 1.4 / math.cosh(18 * (t - 0.5)) ** 2
        return x, -x * math.tanh(18 * (t - 0.5))

    found = solve(problem, guess, {"time": 36}, free=["d"])
    assert abs(found["d"]) < 1e-12
    states = found.system.evaluate(found.x, np.linspace(0, 1, 2001))
    assert abs(states[:, 0].max() - 1.5) < 1e-3  # at one of these places
    branch = trace(found, free=["b", "d"], limits={"b": (0, 2)})
    assert abs(branch.points[-1]["d"] - 2) < 1e-11


def sandstede(u, p):
    """Sandstede (1997), AUTO-07p's demo `san`: with mu = 0 the orbit on x^2 (1 - x) = y^2 is homoclinic at nu = 0."""
    leaf = p.nu - p.alpha * u.z
    return (
        p.a * u.x + u.y - p.a * u.x**2 + leaf * u.x * (2 - 3 * u.x),
        u.x + p.a * u.y - 1.5 * u.x**2 - 1.5 * p.a * u.x * u.y - 2 * leaf * u.y,
        -2 * u.z + p.mu * u.x + p.alpha * (u.x**2 * (1 - u.x) - u.y**2),
    )


@pytest.mark.full
def test_a_homoclinic_orbit_in_space():
    """At a = 0 it is x = 1 / cosh(t / 2)^2, y = x'."""
    numbers = {"a": 0.0, "alpha": 0.3, "mu": 0.0, "nu": 0.01}
    problem = ConnectionProblem(sandstede, ["x", "y", "z"], numbers, unstable=1)

    def guess(t):
        x = 1 / math.cosh(20 * (t - 0.5)) ** 2
        return x, -x * math.tanh(20 * (t - 0.5)), 0

    found = solve(problem, guess, {"time": 40}, free=["nu"])
    assert abs(found["nu"]) < 1e-12
    x, y, _ = found.system.states(found.x)[:: found.system.degree].T  # at mesh points
    assert np.abs(x**2 * (1 - x) - y**2).max() < 1e-10
    branch = trace(found, free=["a", "nu"], limits={"a": (-0.3, 0.3)})
    assert str(branch.stop) == "reached a = 0.3" and max(abs(branch.column("nu"))) < 1e-9


@cache
def lorenz_cycle():
    def lorenz(u, p):
        return p.s * (u.y - u.x), p.r * u.x - u.y - u.x * u.z, u.x * u.y - 8 / 3 * u.z

    start = math.sqrt(8 / 3 * 19)
    rest = solve(AlgebraicProblem(lorenz, ["x", "y", "z"], {"r": 20.0, "s": 10.0}), [start, start, 19.0])
    (hopf,) = trace(rest, free=["r"], limits={"r": (15, 30)}).labelled("HB")
    return trace(hopf, branch=1, limits={"r": (13, 30), "period": (0, 3.5)}).points[-1]


@pytest.mark.full
def test_a_long_cycle_becomes_the_homoclinic_orbit_of_lorenz():
    """r = 13.926557 (Sparrow 1982); the same orbit with a longer time has the next digits."""
    orbit = homoclinic(lorenz_cycle(), free=["r"])
    assert abs(orbit["r"] - 13.926557) < 1e-5 and np.abs(orbit.system.states(orbit.x)[0]).max() < 0.5
    longer = trace(orbit, free=["r", "time"], primary="time", limits={"time": (3, 9)}).points[-1]
    assert abs(longer["r"] - 13.926557) < 6e-7
    assert longer["gap"] < 1e-7
    curve = trace(longer, free=["s", "r"], limits={"s": (9, 11)})
    assert str(curve.stop) == "reached s = 11"


def test_a_connection_is_stored_and_goes_on(tmp_path):
    branch = trace(front(), free=["a", "c"], limits={"a": (0.2, 0.3)})
    save(branch, tmp_path / "fronts.npz")
    again = load(branch.points[0].system.problem, tmp_path / "fronts.npz")
    further = trace(again.points[-1], limits={"a": (0.2, 0.4)})
    assert abs(further.points[-1]["c"] - speed(0.4)) < 1e-11


def test_what_cannot_be_is_said():
    with pytest.raises(ProblemError, match="unstable"):
        ConnectionProblem(nagumo, ["u", "v"], {"a": 0.25, "c": 0.3}, unstable=2)
    with pytest.raises(ProblemError, match="time is a parameter of every connection"):
        ConnectionProblem(nagumo, ["u", "v"], {"a": 0.25, "c": 0.3, "time": 1}, unstable=1)
    with pytest.raises(ProblemError, match="start: must be a point of a CycleProblem"):
        homoclinic(front(), free=["c"])

    def circle(u, p):
        square = u.x**2 + u.y**2
        return p.mu * u.x - u.y - u.x * square, u.x + p.mu * u.y - u.y * square

    cycle = solve(
        CycleProblem(circle, ["x", "y"], {"mu": 0.25}),
        lambda t: (math.cos(2 * math.pi * t) / 2, math.sin(2 * math.pi * t) / 2), {"period": 6},
    )  # fmt: skip
    with pytest.raises(ProblemError, match="a source, no saddle"):
        homoclinic(cycle, free=["mu"])


def test_an_orbit_that_was_used_takes_another_reference():
    """Whatever was computed before: the equations are those of a system that was made with that reference."""
    point = front()
    x, y = point.x, point.x.copy()
    y[point.system.state_size :] *= 1.05  # another saddle, with other subspaces
    used, values = point.system.with_reference(x), dict(zip(point.system.problem.parameters, point.system.all_parameters(x)))
    used.linearize(x)
    used.along(x, [x, x])
    given = point.system.free, values, point.system.scales, point.system.mesh, point.system.degree
    made = point.system.problem.discretized(*given).with_reference(y)
    (values, factors), (known, others) = used.with_reference(y).linearize(y), made.linearize(y)
    assert np.array_equal(values, known)
    right = np.ones(len(y))
    assert np.array_equal(factors.solve(right), others.solve(right))
    assert np.array_equal(used.with_reference(y).along(y, [x, x]), made.along(y, [x, x]))


def test_a_front_that_neither_end_feels_is_followed_in_few_steps():
    """AUTO's demo stw: the condensed matrix alone saw pairs of branch points, and steps were halved to the end of the run."""
    branch = trace(stw.front(), free=["p", "c"], limits={"p": (0, 1.1)}, zeros={"p": [1.0]}, max_points=60, errors=False)
    assert branch.stop.reason == "limit" and not branch.labelled("BP")
    assert abs(branch.labelled("UZ")[0]["c"]) < 1e-9  # the front stands still


@pytest.mark.sample(1)
@pytest.mark.parametrize("length", [40.0, 160.0, 640.0])
def test_a_pulse_keeps_its_place_for_any_time(length):
    """Exact: w'' = a w - w^2 + c w', w = u - a, has the pulse 3 a / 2 sech^2(sqrt(a) s / 2) with c = 0, and its tangent by a.

    At the ends of a long time it is 0 to round-off, where nothing tells how far it is moved along itself.
    """

    def field(u, p):
        w = u.u - p.a
        return u.v, p.a * w - w**2 + p.c * u.v

    def pulse(s, a):
        root = math.sqrt(a)
        w = 1.5 * a / np.cosh(root * s / 2) ** 2
        return np.array([a + w, -root * w * np.tanh(root * s / 2)])

    problem = ConnectionProblem(field, ["u", "v"], {"a": 1.0, "c": 0.0}, unstable=1)
    first = solve(problem, lambda t: pulse(length * (t - 0.5), 1.0), {"time": length, "from_u": 1.0}, free=["c"])
    branch = trace(first, free=["a", "c"], limits={"a": (0.5, 2.0)})
    assert [point.label for point in branch if point.label] == ["EP", "EP"]
    for point in branch:
        s = length * (point.system.mesh - 0.5)
        a, states = point["a"], point.system.states(point.x)[:: point.system.degree].T
        along_itself = (pulse(s + 1e-4, a) - pulse(s - 1e-4, a)) / 2e-4
        off = states - pulse(s, a)
        shift = np.vdot(off, along_itself) / np.vdot(along_itself, along_itself)
        assert abs(point["c"]) < 1e-10 and off == pytest.approx(shift * along_itself, abs=1e-10)
        # only the first guess, on its mesh, tells where the pulse is, and not the equations
        assert abs(shift) < 1e-5
        by_a = (pulse(s, a + 1e-4) - pulse(s, a - 1e-4)) / 2e-4
        along = point.system.states(point.tangent)[:: point.system.degree].T
        tangent = along / point.tangent[point.system.parameter_index("a")]
        assert tangent == pytest.approx(by_a, abs=1e-5)
