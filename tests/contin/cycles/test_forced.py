"""Forced systems: a prescribed period, no phase condition, no multiplier that is 1 by itself."""

import functools
import math

import numpy as np
import pytest
from cycles.noted import compare
from scipy.integrate import solve_ivp
from scipy.special import mathieu_a, mathieu_b

import contin
from contin import CycleProblem, MeshControl, ProblemError


def mathieu(t, u, p):
    return u.v, (2 * p.q * math.cos(2 * t) - p.a) * u.x


def duffing(t, u, p):
    return u.v, -0.1 * u.v - u.x - u.x**3 + p.g * math.cos(p.w * t)


def two_wells(t, u, p):
    return u.v, -0.25 * u.v + u.x - u.x**3 + p.g * math.cos(p.w * t)


def van_der_pol(t, u, p):
    return u.v, 0.2 * (1 - u.x**2) * u.v - u.x + p.g * math.cos(p.w * t)


def square(t, u, p):
    return u.x**2 + u.v**2


def around(p):
    return 2 * math.pi / p.w


def resonance(field, **values):
    """The branch of cycles in the forcing's frequency, from above down to .3."""
    problem = CycleProblem(field, ["x", "v"], {"w": 4.0, "g": 0.5}, period=around, functionals={"square": square})
    orbit = contin.solve(problem, [0, 0], values)
    return contin.trace(orbit, free=["w"], direction=-1, limits={"w": (0.3, 15)})


@pytest.mark.full
@pytest.mark.parametrize("q", [1.0, 2.0])
def test_edges_of_stability_of_mathieu(q):
    """x = 0 is a cycle for all a. A multiplier is 1 or -1 at the edges a_n(q), b_n(q), from SciPy: BP for even n, PD for odd n.

    Between a_5 and b_5 at q = 1 lie 1.4e-5, where steps are 4 long: both multipliers meet at -1, part and come back.
    """
    problem = CycleProblem(mathieu, ["x", "v"], {"a": -3.0, "q": q}, period=math.pi)
    branch = contin.trace(
        contin.solve(problem, [0, 0], degree=7), free=["a"], limits={"a": (-3, 26)}, mesh=MeshControl(min_intervals=20)
    )
    edges = [(float(mathieu_a(n, q)), n) for n in range(6)] + [(float(mathieu_b(n, q)), n) for n in range(1, 6)]
    found = [point for point in branch if point.label not in ("", "EP")]
    assert [point.label for point in found] == ["PD" if n % 2 else "BP" for _, n in sorted(edges)]
    for point, (edge, _) in zip(found, sorted(edges)):
        assert point["a"] == pytest.approx(edge, abs=1e-10)


def test_multipliers_of_mathieu_without_a_forcing():
    """q = 0: exp(+-i pi sqrt(a)), on the unit circle to the last digit; with q the product stays 1 (Liouville)."""
    problem = CycleProblem(mathieu, ["x", "v"], {"a": 0.3, "q": 0.0}, period=math.pi)
    at_rest = contin.solve(problem, [0, 0], degree=7, intervals=20, mesh=MeshControl(min_intervals=20))
    exponents = at_rest.system.eigenvalues(at_rest.x)
    assert np.all(exponents.real == 0)
    assert np.abs(np.sort(exponents.imag) - math.pi * math.sqrt(0.3) * np.array([-1, 1])).max() < 1e-12
    unstable = contin.solve(problem, at_rest, {"a": 1.0, "q": 0.5})
    exponents = unstable.system.eigenvalues(unstable.x)
    assert exponents.real.max() > 0.1 and abs(exponents.real.sum()) < 1e-12


@pytest.mark.parametrize("period", [2 * math.pi, "T", lambda p: 2 * math.pi / p.w])
def test_a_linear_oscillator(period):
    """x" + c x' + x = cos t: amplitude 1 / c, multipliers exp(2 pi (-c / 2 +- i sqrt(1 - c^2 / 4)))."""

    def field(t, u, p):
        return u.v, -p.c * u.v - u.x + math.cos(t)

    means = {"work": lambda t, u, p: u.v * math.cos(t)}
    problem = CycleProblem(
        field, ["x", "v"], {"c": 0.4, "w": 1.0, "T": 2 * math.pi}, period=period, functionals=means,
    )  # fmt: skip
    orbit = contin.solve(problem, [0, 0], degree=7)
    assert orbit["period"] == pytest.approx(2 * math.pi, abs=1e-14)
    assert orbit["max_x"] == pytest.approx(2.5, abs=1e-10) and orbit["min_v"] == pytest.approx(-2.5, abs=1e-10)
    assert orbit["work"] == pytest.approx(1.25, abs=1e-12)
    found = orbit.floquet()
    exponents = found.logarithms
    assert found.unstable == 0 and found.errors.max() < 1e-11
    assert abs(found.multipliers) == pytest.approx(math.exp(-0.4 * math.pi), abs=1e-11)
    turns = 2 * math.pi * math.sqrt(0.96) - 2 * math.pi  # the angle of a multiplier is known up to full turns
    assert exponents[exponents.imag < 0][0] == pytest.approx(complex(-0.4 * math.pi, turns), abs=1e-11)
    branch = contin.trace(orbit, free=["c"], direction=-1, limits={"c": (0.1, 1)})
    assert branch.points[-1]["max_x"] == pytest.approx(10, abs=1e-9)


def test_duffing_against_auto():
    compare(resonance(duffing), "duffing", "down", ("w", "period", "square"))


@pytest.mark.full
def test_a_strong_forcing_against_auto():
    """AUTO-07p passes the four branch points, where the symmetry x(t + T / 2) = -x(t) breaks."""
    branch = resonance(duffing, g=3.0)
    compare(branch, "duffing strong", "down", ("w", "period", "square"), beyond=(2, 3, 6, 7))
    for place in (2, 3, 6, 7):
        point = [point for point in branch.points[1:] if point.label][place]
        assert point.label == "BP" and abs(point.system.eigenvalues(point.x)).min() < 1e-9


@pytest.mark.full
def test_torus_bifurcations_against_auto():
    compare(resonance(van_der_pol, g=1.0), "forced van der pol", "down", ("w", "period", "square"))


@pytest.mark.full
def test_a_doubled_cycle_closes_after_two_periods():
    """Two wells: at the period doubling begins the branch that a time integration settles on."""
    problem = CycleProblem(two_wells, ["x", "v"], {"w": 1.0, "g": 0.0}, period=around)
    branch = contin.trace(contin.solve(problem, [1.0, 0]), free=["g"], limits={"g": (0, 0.5)})
    (first,) = branch.labelled("PD")
    double = contin.trace(first, branch=1, limits={"g": (0, 0.5)})
    assert double.points[0]["rounds"] == 2 and double.points[0]["period"] == pytest.approx(4 * math.pi, abs=1e-14)
    assert [point.label for point in double.points[1:] if point.label] == ["PD", "PD", "LP", "LP", "PD", "EP"]
    stable = contin.trace(first, branch=1, limits={"g": (0, 0.186)}).points[-1]
    settled = contin.cycle(problem, stable.system.states(stable.x)[0], {"g": 0.186})
    assert settled["rounds"] == 2 and settled["max_x"] == pytest.approx(stable["max_x"], abs=1e-9)


@pytest.mark.full
def test_a_stored_doubled_branch_goes_on(tmp_path):
    problem = CycleProblem(two_wells, ["x", "v"], {"w": 1.0, "g": 0.0}, period=around)
    branch = contin.trace(contin.solve(problem, [1.0, 0]), free=["g"], limits={"g": (0, 0.5)})
    contin.save(branch, tmp_path / "single.npz")
    (first,) = contin.load(problem, tmp_path / "single.npz").labelled("PD")
    double = contin.trace(first, branch=1, limits={"g": (0, 0.19)})
    contin.save(double, tmp_path / "double.npz")
    again = contin.load(problem, tmp_path / "double.npz")
    (second,) = again.labelled("PD")
    assert second["rounds"] == 2 and second.floquet().unstable == double.labelled("PD")[0].floquet().unstable
    fourfold = contin.trace(second, branch=1, limits={"g": (0, 0.19)})
    assert fourfold.points[0]["rounds"] == 4 and fourfold.points[0]["period"] == pytest.approx(8 * math.pi, abs=1e-12)


@pytest.mark.full
def test_the_demo_frc_against_auto():
    """FitzHugh and Nagumo's equations with a forcing, AUTO's demo ``frc``: first its amplitude, then its period to 5."""

    def field(t, u, p):
        return (
            (u.v * (u.v - p.a) * (1 - u.v) - u.w) / p.eps,
            u.v - p.d * u.w - (p.b + p.r * math.sin(p.beta * t)),
        )  # fmt: skip

    values = {"a": 0.5, "b": 0.5, "r": 0.0, "eps": 0.005, "beta": 100.0, "d": 1.0}
    problem = CycleProblem(
        field, ["v", "w"], values, period=lambda p: 2 * math.pi / p.beta,
        functionals={"square": lambda t, u, p: u.v**2 + u.w**2},
    )  # fmt: skip
    stronger = contin.trace(contin.solve(problem, [0.5, 0.0]), free=["r"], limits={"r": (0, 0.2)}).points[-1]
    slower = contin.trace(
        stronger, free=["beta"], direction=-1, limits={"beta": (1, 101), "period": (0, 5)}, zeros={"period": [1, 2, 3, 4]}
    )
    compare(slower, "frc", "slower", ("beta", "period", "square"))


@pytest.mark.parametrize(
    ("statement", "words"),
    [
        (lambda: CycleProblem(duffing, ["x", "v"], {"w": 1.0, "g": 0.1}), r"one of \(t, u, p\) needs a period"),
        (lambda: CycleProblem(lambda u, p: (u.x,), ["x"], {}, period=1.0), r"field: must be a function of \(t, u, p\)"),
        (lambda: CycleProblem(mathieu, ["x", "v"], {"a": 0.1, "q": 1.0}, period=-1), "period: -1 must be a number between 0"),
        (lambda: CycleProblem(mathieu, ["x", "v"], {"a": 0.1, "q": 1.0}, period="w"), "period: 'w' is no parameter"),
        (lambda: CycleProblem(mathieu, ["x", "v"], {"a": 0.1, "q": 1.0}, period=lambda: 1.0), "must be a function of p alone"),
        (lambda: CycleProblem(mathieu, ["x", "v"], {"a": 0.1, "rounds": 1.0}, period=1.0), "rounds is a column of every cycle"),
    ],
)
def test_what_is_refused(statement, words):
    with pytest.raises(ProblemError, match=words):
        statement()


@pytest.mark.parametrize(
    ("values", "free", "words"),
    [
        ({"rounds": 1.5}, [], r"rounds = 1\.5 must be a whole number"),
        ({}, ["rounds"], "rounds must not be free"),
        ({"w": -1.0}, [], "period: -6.28.* must be a positive number"),
    ],
)
def test_rounds_and_periods_that_are_refused(values, free, words):
    problem = CycleProblem(duffing, ["x", "v"], {"w": 1.0, "g": 0.1}, period=around)
    with pytest.raises(ProblemError, match=words):
        orbit = contin.solve(problem, [0, 0], values)
        contin.trace(orbit, free=free)


def test_a_motion_that_does_not_close():
    problem = CycleProblem(two_wells, ["x", "v"], {"w": 1.0, "g": 0.4}, period=around)
    with pytest.raises(ProblemError, match="does not close within 16 periods"):
        contin.cycle(problem, [1.0, 0.0])


def forced_van_der_pol(t, u, p):
    return u.v, 0.5 * (1 - u.x**2) * u.v - u.x + p.b * math.cos(p.w * t)


@functools.cache
def locked():
    """A cycle of three periods of the forcing, as a simulation settles on it."""
    period = 2 * math.pi / 2.9
    run = solve_ivp(
        lambda t, y: [y[1], 0.5 * (1 - y[0] ** 2) * y[1] - y[0] + 1.5 * math.cos(2.9 * t)], (0, 150 * period), [1.0, 0.0],
        rtol=1e-8, atol=1e-8, dense_output=True,
    )  # fmt: skip
    problem = CycleProblem(forced_van_der_pol, ["x", "v"], {"b": 1.5, "w": 2.9}, period=lambda p: 2 * math.pi / p.w)
    return contin.solve(problem, lambda t: tuple(run.sol(147 * period + 3 * period * t)), {"rounds": 3})


@pytest.mark.full
def test_a_loop_of_subharmonics_is_closed_when_it_has_gone_round():
    """In the tongue 1:3 the branch comes back a period of the forcing later: one loop, with the folds at which locking ends.

    Half way round, at the same frequency, is the other cycle of the tongue, which is unstable.
    """
    branch = contin.trace(locked(), free=["w"], limits={"w": (2, 4)}, max_points=400)
    assert [point.label for point in branch if point.label] == ["EP", "LP", "LP", "EP"]
    assert branch.stop.reason == "closed"
    last, first = branch.points[-2], branch.points[0]
    assert not first.floquet().unstable and not last.floquet().unstable
    times = np.arange(30) / 30
    apart = [
        np.abs(last.system.evaluate(last.x, (times + shift / 3) % 1) - first.system.evaluate(first.x, times)).max()
        for shift in range(3)
    ]
    assert apart[0] > 1 and min(apart) < 0.5  # less than a step


@pytest.mark.parametrize(("shift", "sign"), [(0, 1), (1 / 3, 1), (2 / 3, 1), (1 / 6, -1), (1 / 2, -1), (5 / 6, -1)])
def test_cycles_of_several_rounds_are_brought_in_phase(shift, sign):
    """The field is odd after half a period of the forcing: -u(t + T / 2) is a cycle where u(t) is one."""
    point = locked()
    system, x = point.system, point.x
    size = system.state_size
    image = np.append(sign * system.evaluate(x, (system.nodes + shift) % 1).ravel(), x[size:])
    found, (vector,) = system.in_phase(image, (image,), x)
    assert np.abs(found - x).max() < 1e-6
    assert np.array_equal(found, vector)


def test_a_field_that_is_not_odd_has_no_mirror_image():
    """x" + x / 4 = cos(t) + 1: the mean is 4, that of the mirror image would be -4."""
    problem = CycleProblem(
        lambda t, u, p: (u.v, -u.x / 4 - p.d * u.v + math.cos(t) + 1), ["x", "v"], {"d": 0.1}, period=2 * math.pi
    )
    point = contin.solve(problem, [4.0, 0.0])
    size = point.system.state_size
    image = np.append(-point.system.evaluate(point.x, (point.system.nodes + 0.5) % 1).ravel(), point.x[size:])
    assert np.array_equal(point.system.in_phase(point.x, (), image)[0], point.x)
