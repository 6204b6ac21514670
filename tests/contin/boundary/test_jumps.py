"""Jumps of the equations that the solution decides: relays, bang-bang controls, switches with a threshold."""

import functools
import math

import numpy as np
import pytest
from scipy.linalg import expm
from scipy.optimize import brentq

import contin


def fuel(t, u, p):
    """Rest to rest over a distance 1 in the time T with the least fuel: thrust where |q| > 1; the fuel is T - sqrt(T^2 - 4)."""
    thrust = (1.0 if u.q < -1 else 0.0) - (1.0 if u.q > 1 else 0.0)
    return p.T * u.v, p.T * thrust, 0.0, -p.T * u.r, p.T * abs(thrust)


FUEL = contin.BoundaryValueProblem(
    fuel, lambda a, b, p: (a.x, a.v, b.x - 1, b.v, a.used), ["x", "v", "r", "q", "used"], {"T": 3.0}
)
GUESSES = [
    lambda t: (t, 1 / 3, -2.0, -3 + 6 * t, 0.0),
    lambda t: (3 * t**2 - 2 * t**3, 2 * t * (1 - t), -1.0, -1.5 + 3 * t, t),
]


def used(point):
    return point.system.states(point.x)[-1, -1]


@pytest.mark.parametrize("guess", GUESSES)
def test_bang_off_bang(guess):
    point = contin.solve(FUEL, guess)
    assert abs(used(point) - (3 - math.sqrt(5))) < 1e-13


@pytest.mark.parametrize("direction", [1, -1])
def test_bang_off_bang_along_the_time(direction):
    branch = contin.trace(contin.solve(FUEL, GUESSES[0]), free=["T"], limits={"T": (2.1, 5)}, direction=direction)
    assert branch.stop.reason == "limit" and not branch.notes
    for point in branch:
        assert abs(used(point) - (point["T"] - math.sqrt(point["T"] ** 2 - 4))) < 1e-11


def test_a_piece_that_vanishes_is_located():
    """The coasting piece has the length sqrt(T^2 - 4) / T."""
    branch = contin.trace(contin.solve(FUEL, GUESSES[0], {"T": 2.2}), free=["T"], limits={"T": (1, 5)}, direction=-1)
    assert branch.stop.reason == "event" and branch[-1].label == "GR"
    assert abs(branch[-1]["T"] - 2) < 1e-11


def thresholds(t, u, p):
    return u.v, -u.x - p.a * (1 if u.x > 0.3 else -1)


def shot(a):
    """x(0) = 0 and x(2) = .8 from both pieces in closed form: the speed at 0, and the time of the jump."""

    def rest(v):
        time = brentq(lambda t: a - a * math.cos(t) + v * math.sin(t) - 0.3, 0, 1.0)
        speed, left = a * math.sin(time) + v * math.cos(time), 2 - time
        return -a + (0.3 + a) * math.cos(left) + speed * math.sin(left) - 0.8, time

    speed = brentq(lambda v: rest(v)[0], 0.4, 4)
    return speed, rest(speed)[1]


def test_against_closed_forms():
    problem = contin.BoundaryValueProblem(thresholds, lambda a, b, p: (a.x, b.x - 0.8), ["x", "v"], {"a": 0.5}, domain=(0, 2))
    first = contin.solve(problem, lambda t: (0.4 * t, 0.4))
    branch = contin.trace(first, free=["a"], limits={"a": (0.1, 1)})
    for point in branch:
        speed, time = shot(point["a"])
        assert abs(point.system.states(point.x)[0, 1] - speed) < 1e-10
        assert np.abs(point.system.mesh - time).min() < 1e-10
    assert (
        branch.stop.reason == "limit" and not branch.notes and max(point.discretization_error for point in branch[1:]) < 1e-11
    )


def test_the_transposed_matrix():
    problem = contin.BoundaryValueProblem(thresholds, lambda a, b, p: (a.x, b.x - 0.8), ["x", "v"], {"a": 0.5}, domain=(0, 2))
    system, x = (
        (point := contin.trace(contin.solve(problem, lambda t: (0.4 * t, 0.4)), free=["a"], max_points=2)[0]).system,
        point.x,
    )
    random = np.random.default_rng(1)
    w, v = random.standard_normal(system.equations), random.standard_normal(system.size)
    step = 1e-6
    along = (system.residual(x + step * v) - system.residual(x - step * v)) / (2 * step)
    assert abs(system.transposed_product(x, w) @ v - w @ along) < 1e-6


def welander(u, p):
    """A box of water that is cooled and freshened from above, and mixed with the deep where it is denser (Welander 1982)."""
    k = 5.0 if p.a * u.S - u.T > p.e else 0.0
    return 1 - u.T - k * u.T, (1 - u.S) / 2 - k * u.S


def flip_flop(a, e):
    """Return period, first states and multipliers of the box from both pieces in closed form, with the saltation matrices."""
    n = np.array([-1.0, a])

    def flow(z, k, t):
        rates = np.array([1 + k, 0.5 + k])
        rest = np.array([1.0, 0.5]) / rates
        return rest + (z - rest) * np.exp(-rates * t)

    def field(z, k):
        return np.array([1.0, 0.5]) - np.array([1 + k, 0.5 + k]) * z

    def following(z, k):
        times = np.linspace(1e-3, 20, 4000)
        values = flow(z, k, times[:, None]) @ n - e
        at = int(np.flatnonzero(values[1:] * values[0] < 0)[0])
        return brentq(lambda t: n @ flow(z, k, t) - e, times[at], times[at + 1], xtol=1e-15)

    z, k, lengths, monodromy = np.array([0.3, 0.3]), 5.0, [], []
    for _ in range(40):
        t = following(z, k)
        z = flow(z, k, t)
        before, behind = field(z, k), field(z, 5.0 - k)
        jump = np.eye(2) + np.outer(behind - before, n) / (n @ before)
        monodromy.append(jump @ np.diag(np.exp(-np.array([1 + k, 0.5 + k]) * t)))
        lengths.append(t)
        k = 5.0 - k
    return lengths[-1] + lengths[-2], flow, z, k, lengths[-2:], np.linalg.eigvals(monodromy[-1] @ monodromy[-2])


def test_a_relay_and_its_multipliers():
    period, flow, z, k, (first, _), multipliers = flip_flop(1.2, -0.01)

    def guess(t):
        t = t * period
        return flow(z, k, t) if t < first else flow(flow(z, k, first), 5.0 - k, t - first)

    cycle = contin.solve(contin.CycleProblem(welander, ["T", "S"], {"a": 1.2, "e": -0.01}), guess, {"period": 1.1 * period})
    assert abs(cycle["period"] - period) < 1e-9
    assert np.allclose(np.sort(np.exp(cycle.system.eigenvalues(cycle.x)).real), np.sort(multipliers), rtol=0, atol=1e-8)
    branch = contin.trace(cycle, free=["e", "period"], limits={"e": (-0.03, -0.004)})
    assert branch.stop.reason == "limit" and not branch.notes
    for point in branch[1:]:
        wanted, *_, multipliers = flip_flop(1.2, point["e"])
        assert abs(point["period"] - wanted) < 1e-8
        assert np.allclose(np.sort(np.exp(point.system.eigenvalues(point.x)).real), np.sort(multipliers), rtol=0, atol=1e-7)


def test_a_stored_cycle_keeps_its_multipliers(tmp_path):
    problem = contin.CycleProblem(welander, ["T", "S"], {"a": 1.2, "e": -0.01})
    branch = contin.trace(contin.cycle(problem, [0.5, 0.5]), free=["e", "period"], limits={"e": (-0.011, 0)}, max_points=3)
    contin.save(branch, tmp_path / "b.npz")
    for point, again in zip(branch, contin.load(problem, tmp_path / "b.npz")):
        assert np.array_equal(point.system.eigenvalues(point.x), again.system.eigenvalues(again.x))


def test_a_threshold_that_is_touched_is_located():
    """u'' = -q - .3 [u > .1] - .3 [u > .3]: the largest u reaches .3 where the times below and above .1 are 1 / 2."""
    problem = contin.BoundaryValueProblem(
        lambda t, u, p: (u.v, -p.q - 0.3 * (u.u > 0.1) - 0.3 * (u.u > 0.3)), lambda a, b, p: (a.u, b.u), ["u", "v"], {"q": 1.0}
    )
    branch = contin.trace(
        contin.solve(problem, lambda t: (t * (1 - t), 1 - 2 * t), {"q": 2.0}), free=["q"], limits={"q": (1.9, 2.2)}
    )

    def excess(q):
        first, there = math.sqrt(2 * (0.3 * q + 0.06)), math.sqrt(0.4 * (q + 0.3))
        return (first - there) / q + math.sqrt(0.4 / (q + 0.3)) - 0.5

    (touch,) = branch.labelled("GR")
    assert "u.u > 0.3" in touch.name and touch.details.folds and branch[-1]["q"] == 2.2 and not branch.notes
    assert abs(touch["q"] - brentq(excess, 1, 3, xtol=1e-14)) < 1e-12
    below = contin.solve(problem, lambda t: (0.4 * t * (1 - t), 0.4 - 0.8 * t), {"q": 0.79})
    (first,) = contin.trace(below, free=["q"], limits={"q": (0.75, 2.0)}, max_points=8).labelled("GR")
    assert abs(first["q"] - 0.8) < 1e-12 and first.details.folds


def relay(c, w, k, force):
    """x'' + c x' + x + k [x > 1] = F cos w t."""
    problem = contin.CycleProblem(
        lambda t, u, p: (u.v, -u.x - c * u.v - k * (1.0 if u.x > 1 else 0.0) + p.F * np.cos(w * t)), ["x", "v"], {"F": force},
        period=2 * math.pi / w,
    )  # fmt: skip
    return swinging(problem, c, w, force)


def swinging(problem, c, w, force):
    """Return the cycle without any switch, from that of the linear oscillator."""
    answer = force / (1 - w**2 + 1j * w * c)
    turned = [lambda t: (answer * np.exp(2j * np.pi * t)).real, lambda t: (1j * w * answer * np.exp(2j * np.pi * t)).real]
    return contin.solve(problem, lambda t: (turned[0](t), turned[1](t)), {"F": force})


def off_the_exact_cycle(point, c, w, k):
    """Return by how much one period, in closed form between the times of the crossings, misses the threshold and the start."""
    system, period = point.system, 2 * math.pi / w
    a = np.zeros((5, 5))  # x, v, cos w t, sin w t, 1
    a[0, 1], a[1, :3], a[2, 3], a[3, 2] = 1, (-1, -c, point["F"]), -w, w
    on = a.copy()
    on[1, 4] = -k
    times = period * np.concatenate([[0], [system.mesh[each.node] for each in system.crossings(point.x)], [1]])
    sides = [float(system.evaluate(point.x, np.array([(t + s) / 2 / period]))[0, 0] > 1) for t, s in zip(times, times[1:])]
    first = np.array([*system.evaluate(point.x, np.zeros(1))[0], 1, 0, 1])
    u, off = first, []
    for length, side in zip(np.diff(times), sides):
        u = expm((on if side else a) * length) @ u
        off.append(u[0] - 1)
    return np.abs([*off[:-1], *(u - first)[:2]]).max()


@pytest.mark.parametrize(
    ("c", "w", "k", "labels"),
    [
        pytest.param(0.1, 0.7, 0.4, "GR PD", marks=pytest.mark.full),
        (0.3, 1.4, 0.4, "GR LP"),
        pytest.param(0.1, 0.7, -0.4, "GR LP", marks=pytest.mark.full),
        (0.3, 1.4, -0.4, "GR PD"),
    ],
)
def test_a_relay_that_begins_to_switch(c, w, k, labels):
    """The amplitude of the linear oscillator is 1 where F^2 = (1 - w^2)^2 + (c w)^2; from both sides it is the same point."""
    force = math.hypot(1 - w**2, c * w)
    branch = contin.trace(relay(c, w, k, 0.8 * force), free=["F"], limits={"F": (0.5 * force, 1.13 * force)})
    back = contin.trace(branch[-1], free=["F"], direction=-1, limits={"F": (0.5 * force, 1.13 * force)})
    for run, wanted in (branch, labels.split()), (back, labels.split()[::-1]):
        assert [point.label for point in run if point.label] == ["EP", *wanted, "EP"] and not run.notes
        (touch,) = run.labelled("GR")
        assert abs(touch["F"] - force) < 1e-12 and touch.details.folds is ("LP" in labels)
        for point in run.points[::4]:
            assert off_the_exact_cycle(point, c, w, k) < 1e-9
    assert back[-1]["max_x"] < 1 < branch[-1]["max_x"]


@pytest.mark.parametrize(
    ("c", "w", "label", "value", "range_"), [(0.3, 1.4, "LP", 1, (1.3, 1.5)), (0.1, 0.7, "PD", -1, (0.7, 0.72))]
)
def test_curves_in_two_parameters(c, w, label, value, range_):
    """A multiplier along the curve, by exponentials of both pieces and the saltation matrices: 1 or -1."""
    problem = contin.CycleProblem(
        lambda t, u, p: (u.v, -u.x - c * u.v - 0.4 * (u.x > 1) + p.F * np.cos(p.w * t)), ["x", "v"], {"F": 0.4, "w": w},
        period=lambda p: 2 * math.pi / p.w,
    )  # fmt: skip
    force = math.hypot(1 - w**2, c * w)
    start = swinging(problem, c, w, 0.9 * force)
    (point,) = contin.trace(start, free=["F"], limits={"F": (0.5 * force, 1.07 * force)}).labelled(label)
    curve = contin.curve(point, "w", limits={"w": range_})
    assert curve.stop.reason == "limit" and not curve.notes and len(curve) > 3
    for each in curve:
        system, x = each.system.solution, each.system.inside(each.x)
        period, steady = 2 * math.pi / each["w"], np.array([[0, 1], [-1, -c]])
        found, before, (first, last) = np.eye(2), 0.0, system.mesh[[at.node for at in system.crossings(x)]]
        inside = system.evaluate(x, np.array([(first + last) / 2]))[0, 0] > 1
        for time, sign in (first, 1 if inside else -1), (last, -1 if inside else 1):
            speed = system.evaluate(x, np.array([time]))[0, 1]
            found = np.array([[1, 0], [-0.4 * sign / speed, 1]]) @ expm(steady * period * (time - before)) @ found
            before = time
        found = expm(steady * period * (1 - before)) @ found
        assert abs(np.linalg.eigvals(found) - value).min() < 1e-7


def test_a_symmetry_breaks_between_two_stops():
    """A branch point of x'' + .1 x' + x + 10 (what of |x| is above 1) = F cos .7 t; a multiplier of both pieces is 1."""

    def field(t, u, p):
        return u.v, -u.x - 0.1 * u.v - 10 * (max(u.x - 1, 0) + min(u.x + 1, 0)) + p.F * np.cos(0.7 * t)

    problem = contin.CycleProblem(field, ["x", "v"], {"F": 0.5}, period=2 * math.pi / 0.7)
    branch = contin.trace(swinging(problem, 0.1, 0.7, 0.5), free=["F"], limits={"F": (0.4, 0.525)})
    (point,) = branch.labelled("BP")
    assert not branch.notes and point.errors["F"] < 1e-9
    system, period, found, before = point.system, 2 * math.pi / 0.7, np.eye(2), 0.0
    times = [system.mesh[each.node] for each in system.crossings(point.x)]
    for time in (*times, 1.0):
        outside = abs(system.evaluate(point.x, np.array([(before + time) / 2]))[0, 0]) > 1
        found = expm(np.array([[0, 1], [-11.0 if outside else -1.0, -0.1]]) * period * (time - before)) @ found
        before = time
    assert len(times) == 4 and abs(np.linalg.eigvals(found) - 1).min() < 1e-7
    other = contin.trace(point, branch=1, max_points=4)[-1]
    u = other.system.evaluate(other.x, np.linspace(0, 1, 500))[:, 0]
    assert abs(u.max() + u.min()) > 1e-4


def test_a_relay_that_would_slide():
    """A speed at which a friction begins: right behind it the solution sticks there, and the run ends."""
    problem = contin.CycleProblem(
        lambda t, u, p: (u.v, -u.x - 0.3 * u.v - 0.4 * (u.v > 1) + p.F * np.cos(1.4 * t)), ["x", "v"], {"F": 0.6},
        period=2 * math.pi / 1.4,
    )  # fmt: skip
    end = contin.trace(contin.cycle(problem, [0.1, 0.0]), free=["F"], limits={"F": (0.5, 2)})[-1]
    assert end.label == "GR" and abs(end["F"] - math.hypot(1 - 1.4**2, 0.3 * 1.4) / 1.4) < 1e-12


def test_corners_may_come_and_go():
    """A corner of the spring, at .3, where the load jumps at .1: the run goes on, and stays exact."""
    problem = contin.BoundaryValueProblem(
        lambda t, u, p: (u.v, -p.q - 0.3 * (u.u > 0.1) - 0.3 * max(u.u - 0.3, 0)), lambda a, b, p: (a.u, b.u), ["u", "v"],
        {"q": 1.0},
    )  # fmt: skip
    branch = contin.trace(contin.solve(problem, lambda t: (t * (1 - t), 1 - 2 * t)), free=["q"], limits={"q": (0.5, 4)})
    assert branch.stop.reason == "limit" and not branch.notes
    assert len(branch[-1].system.crossings(branch[-1].x)) == 4
    assert branch[-1].discretization_error < 1e-11


def test_a_sliding_solution_is_told():
    """u reaches .2, and the fields on both sides point there."""
    problem = contin.BoundaryValueProblem(
        lambda t, u, p: (p.a * (-1.0 if u.u > 0.2 else 1.0) + 0.1,), lambda a, b, p: (a.u,), ["u"], {"a": 1.0}
    )
    with pytest.raises(contin.ConvergenceError, match="u.u > 0.2.* at t = .*the fields on both sides point there"):
        contin.solve(problem, lambda t: (0.5 * t,))


def test_friction_that_begins_to_stick():
    """x'' + x + F sign(x') = cos(1.3 t) sticks at the turning points where w^2 X = F, X the amplitude (Den Hartog 1930)."""
    w = 1.3
    part = math.sin(math.pi / w) / (w * (1 + math.cos(math.pi / w)))
    sticks = w**2 / (w**2 - 1) / math.sqrt(1 + w**4 * part**2)
    problem = contin.CycleProblem(
        lambda t, u, p: (u.v, -u.x - p.F * np.sign(u.v) + np.cos(w * t)), ["x", "v"], {"F": 0.3}, period=lambda p: 2 * np.pi / w
    )
    start = contin.solve(problem, lambda t: (-1.2 * np.cos(2 * np.pi * t), 1.6 * np.sin(2 * np.pi * t)))
    end = contin.trace(start, free=["F"], limits={"F": (0.1, 3)})[-1]
    assert end.label == "SL" and abs(end["F"] - sticks) <= end.errors["F"] + 1e-12
    assert abs(end["max_x"] - math.sqrt(1 / (1 - w**2) ** 2 - (end["F"] * part) ** 2)) < 1e-10
    assert abs(np.exp(end.system.eigenvalues(end.x))).min() < 1e-10  # what has stuck forgets where it was


def test_a_jump_that_passes_the_end_of_the_period():
    """Dry friction on a belt: from v0 = .2 to .9563 the second jump comes to the end of the period of the forcing.

    Behind it it is the first one of the next period. The run ends where the mass would stick: the velocity is that of the belt
    and the forces but friction are as large as friction, .3, in the direction of the motion behind it.
    """

    def belt(t, u, p):
        return u.v, -u.x - 0.3 * np.sign(u.v - p.v0) - 0.05 * u.v + 1.5 * math.cos(1.3 * t)

    problem = contin.CycleProblem(belt, ["x", "v"], {"v0": 0.8}, period=2 * math.pi / 1.3)
    branch = contin.trace(contin.cycle(problem, [0.1, 0.0]), free=["v0"], limits={"v0": (0.8, 4)})
    end = branch[-1]
    assert [point.label for point in branch if point.label] == ["EP", "SL"] and end["v0"] > 2.5
    sticking = [each for each in end.system.crossings(end.x) if abs(min(each.rates)) < 1e-6]
    assert len(sticking) == 1


@pytest.mark.parametrize("seed", [9, 17, 46])
def test_random_relays(seed):
    """x' = A x - b sign(c.x): half a period h with x(h) = -x(0), by matrix exponentials. The guess begins at a jump."""
    random = np.random.default_rng(seed)
    n = int(random.integers(2, 5))
    a = random.normal(size=(n, n))
    a -= (np.linalg.eigvals(a).real.max() + random.uniform(0.1, 0.5)) * np.eye(n)
    b, c, one = random.normal(size=n), random.normal(size=n), np.eye(n)

    def first(h):
        grown = expm(a * h)
        return np.linalg.solve(grown + one, (grown - one) @ np.linalg.solve(a, b))

    lengths = np.linspace(0.02, 20, 1500)
    values = np.array([c @ first(h) for h in lengths])
    at = int(np.flatnonzero(values[1:] * values[:-1] < 0)[0])
    h = brentq(lambda h: c @ first(h), lengths[at], lengths[at + 1], xtol=1e-14)
    z = first(h)
    before, behind = -a @ z - b, -a @ z + b
    half = (one + np.outer(behind - before, c) / (c @ before)) @ expm(a * h)

    def guess(t):
        side, t = (1, 2 * h * t) if t < 0.5 else (-1, h * (2 * t - 1))
        grown = expm(a * t)
        return side * (grown @ z - (grown - one) @ np.linalg.solve(a, b)) * (1 + 0.05 * math.cos(3 * t))

    def field(u, p):
        return tuple(a @ np.array([*u]) - b * (1.0 if c @ np.array([*u]) > p.e else -1.0))

    problem = contin.CycleProblem(field, [f"x{i}" for i in range(n)], {"e": 0.0})
    cycle = contin.solve(problem, guess, {"period": 2.1 * h})
    assert abs(cycle["period"] / (2 * h) - 1) < 1e-9
    found = np.exp(cycle.system.eigenvalues(cycle.x))
    assert all(abs(found - value).min() < 1e-6 for value in np.linalg.eigvals(half @ half))


def test_the_edge_of_the_ice():
    """Budyko's climate with diffusion (North 1975), singular at the pole, x = 1: its flux is zero there up to round-off.

    The sum over Legendre polynomials, of which 280 are taken, gives Q for an edge; it is known to 1e-5.
    """
    legendre = np.polynomial.legendre

    def sun(x):
        return 1 - 0.241 * (3 * x**2 - 1)

    def field(x, u, p):
        return u.flux / (1 - x**2), (203.3 + 2.09 * u.T - p.Q * sun(x) * (0.68 if u.T > -10 else 0.38)) / 0.4363

    nodes, weights = legendre.leggauss(600)

    def sum_over(edge):
        n = np.arange(0, 561, 2)
        water, ice = edge * (nodes + 1) / 2, edge + (1 - edge) * (nodes + 1) / 2
        absorbed = [(weights * sun(x)) @ legendre.legvander(x, 560) / 2 for x in (water, ice)]
        parts = (2 * n + 1) * (0.68 * edge * absorbed[0] + 0.38 * (1 - edge) * absorbed[1])[::2]
        return (203.3 / 2.09 - 10) / np.sum(
            parts * legendre.legvander(np.array([edge]), 560)[0, ::2] / (n * (n + 1) * 0.4363 + 2.09)
        )

    def guess(fall, x):
        return 15 - fall * x**2, -2 * fall * x * (1 - x**2)

    problem = contin.BoundaryValueProblem(field, lambda a, b, p: (a.flux, b.flux), ["T", "flux"], {"Q": 344.0})
    for first, fall, limits, labels in ((342.5, 35, (342, 345), []), (347.07, 27, (347.06, 348), ["LP"])):
        start = contin.solve(problem, functools.partial(guess, fall), {"Q": first})
        branch = contin.trace(start, free=["Q"], limits={"Q": limits})
        assert [point.label for point in branch[1:-1] if point.label] == labels and branch.stop.reason == "limit"
        assert max(point.system.intervals for point in branch if not point.label) <= 100  # 9 or 58 at the start, by round-off
        for point in branch[::8]:
            (crossing,) = point.system.crossings(point.x)
            assert abs(sum_over(point.system.mesh[crossing.node]) - point["Q"]) < 1e-5
