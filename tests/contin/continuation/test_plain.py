"""Plain steps that one call makes are those that the run makes one by one: points, labels, ends, and states to go on from."""

import dataclasses
import itertools
import math

import numpy as np
import pytest

from contin import AlgebraicProblem, Event, MapProblem, Settings
from contin.continuation import lane as runs
from contin.cycles.map_equations import MapSystem
from contin.lowlevel import Algebraic, Continuation


def lorenz(u, p):
    return p.s * (u.y - u.x), p.r * u.x - u.y - u.x * u.z, u.x * u.y - p.b * u.z


def brusselator(u, p):
    return p.a - (p.b + 1) * u.x + u.x**2 * u.y, p.b * u.x - u.x**2 * u.y


def stirred(u, p):
    rate = p.d * (1 - u.x) * math.exp(u.y)
    return -u.x + rate, -u.y + 14.0 * rate - 3.0 * u.y


def net(n, seed):
    """A net of n cells."""
    random = np.random.default_rng(seed)
    weights, bias = random.standard_normal((n, n)) * 1.6, random.standard_normal(n)

    def field(u, p):
        return tuple(-u[i] + math.tanh(sum(weights[i, j] * u[j] for j in range(n)) + p.a * bias[i]) for i in range(n))

    return AlgebraicProblem(field, [f"u{i}" for i in range(n)], {"a": 0.0})


def henon(u, p):
    return 1 - p.a * u.x**2 + u.y, p.b * u.x


def delayed(u, p):
    return p.a * u.x * (1 - u.y), u.x


def equilibria(field, states, parameters, free="a", **options):
    return lambda: Algebraic(AlgebraicProblem(field, states, parameters, **options), [free])


def circle(u, p):
    return (u.x + p.a - p.k / (2 * math.pi) * math.sin(2 * math.pi * u.x),)


def maps(field, states, parameters, angles=(), **values):
    return lambda: MapSystem(MapProblem(field, states, parameters, angles=angles), ["a"], values)


SQUARE = {"square": lambda u, p: u.x**2 + p.a}
#: By name: what makes the system, the states to start from, and settings.
RUNS = {
    "Lorenz": (
        equilibria(lorenz, ["x", "y", "z"], {"r": 2.0, "s": 10.0, "b": 8 / 3}, "r"), [1.6, 1.6, 1.0],
        {"limits": {"r": (0, 30)}},
    ),
    "Brusselator": (equilibria(brusselator, ["x", "y"], {"a": 1.0, "b": 0.5}, "b"), [1.0, 0.5], {"limits": {"b": (0, 6)}}),
    "stirred tank": (equilibria(stirred, ["x", "y"], {"d": 0.0}, "d"), [0.0, 0.0], {"limits": {"d": (-1, 0.5), "y": (-1, 9)}}),
    "cubic": (equilibria(lambda u, p: (p.a + u.x - u.x**3,), ["x"], {"a": -2.0}), [-1.5], {"limits": {"a": (-3, 2)}}),
    "circle": (equilibria(lambda u, p: (u.x**2 + p.a**2 - 1,), ["x"], {"a": 0.6}), [0.8], {}),
    "transcritical": (equilibria(lambda u, p: (p.a * u.x - u.x**2,), ["x"], {"a": -1.0}), [0.0], {"limits": {"a": (-2, 2)}}),
    "pitchfork": (equilibria(lambda u, p: (p.a * u.x - u.x**3,), ["x"], {"a": -1.0}), [0.0], {"limits": {"a": (-2, 2)}}),
    "snake": (
        equilibria(lambda u, p: (p.a - 0.1 * u.x - math.sin(u.x),), ["x"], {"a": 0.0}), [0.0], {"limits": {"a": (-1, 3)}},
    ),
    "net of 3": (lambda: Algebraic(net(3, 1), ["a"]), [0.0] * 3, {"limits": {"a": (-4, 4)}, "max_points": 300}),
    "net of 6": (lambda: Algebraic(net(6, 2), ["a"]), [0.0] * 6, {"limits": {"a": (-4, 4)}, "max_points": 300}),
    "small sizes": (
        equilibria(lambda u, p: (p.a / 1e-9 + u.x / 1e-6 - (u.x / 1e-6) ** 3,), ["x"], {"a": -2e-9}), [-1.5e-6],
        {"limits": {"a": (-3e-9, 2e-9)}},
    ),
    "large sizes": (
        equilibria(lambda u, p: (p.a * 1e-7 + u.x / 1e6 - (u.x / 1e6) ** 3,), ["x"], {"a": -2e7}), [-1.5e6],
        {"limits": {"a": (-3e7, 2e7)}},
    ),
    "outgrown": (equilibria(lambda u, p: (p.a**2 - u.x,), ["x"], {"a": 1.0}), [1.0], {"limits": {"a": (0, 1e4)}}),
    "Henon": (
        maps(henon, ["x", "y"], {"a": 0.1, "b": 0.3}), [0.8, 0.24],
        {"limits": {"a": (-2, 1)}, "step": 0.02, "max_step": 0.02},
    ),
    "delayed logistic map": (
        maps(delayed, ["x", "y"], {"a": 1.5}), [1 / 3, 1 / 3],
        {"limits": {"a": (1.1, 2.5)}, "step": 0.02, "max_step": 0.02},
    ),
    "Henon, cycle of 2": (
        maps(henon, ["x", "y"], {"a": 0.5, "b": 0.3}, rounds=2.0), [1.37, 0.01, 0.03, 0.41],
        {"limits": {"a": (0.2, 1.2)}, "step": 0.02, "max_step": 0.05},
    ),
    "locked to one round in 3": (
        maps(circle, ["x"], {"a": 0.3333, "k": 0.95}, angles={"x": 1}, rounds=3.0, winding_x=1.0), [0.1, 0.4, 0.75], {},
    ),
    "no look": (
        equilibria(lambda u, p: (p.a + u.x - u.x**3,), ["x"], {"a": -2.0}, dynamics=False), [-1.5],
        {"limits": {"a": (-3, 2)}, "folds": False, "branch_points": False},
    ),
    "user's points": (
        equilibria(lambda u, p: (p.a + u.x - u.x**3,), ["x"], {"a": -2.0}, functionals=SQUARE), [-1.5],
        {
            "limits": {"a": (-3, 5), "square": (-10, 4.3), "x": (-5, 1.9)},
            "zeros": {"a": [0.0, 0.2], "x": [0.5], "square": [1.0]},
            "extrema": ["square"], "events": [Event("UZ", "mine", lambda trial: trial.x[0] - 1.1)],
        },
    ),
}  # fmt: skip


def start(name, **changes):
    make, states, settings = RUNS[name]
    system = make()
    x = system.pack(np.array([states]), dict(zip(system.problem.parameters, system.parameters)))
    return system, x, Settings(**{"errors": False, **settings, **changes})


def made(name, **changes):
    run = Continuation(*start(name, **changes))
    return list(run), run


def one_by_one(name, **changes):
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(runs, "lane_of", lambda *_: None)
        return made(name, **changes)


def assert_alike(points, others, tolerance=1e-10):
    assert [(point.label, point.name) for point in points] == [(other.label, other.name) for other in others]
    for point, other in zip(points, others):
        for name in ("index", "nullity", "column", "value", "breaks", "index_change", "discretization_error"):
            assert getattr(point, name) == getattr(other, name), name
        assert point.label or point.iterations == other.iterations
        assert point.errors.keys() == other.errors.keys()
        assert np.allclose(point.x, other.x, rtol=tolerance, atol=tolerance)
        assert np.allclose(point.tangent, other.tangent, rtol=1e-7, atol=1e-7, equal_nan=True)
        assert point.arclength == pytest.approx(other.arclength, abs=1e-9, rel=1e-9)
        assert point.parameters == pytest.approx(other.parameters, abs=tolerance, rel=tolerance)
        assert point.functionals == pytest.approx(other.functionals, abs=tolerance, rel=tolerance)


@pytest.mark.sample(6)
@pytest.mark.parametrize("direction", [1, -1])
@pytest.mark.parametrize("name", RUNS)
def test_the_same_branch_as_one_by_one(name, direction):
    points, run = made(name, direction=direction)
    others, other = one_by_one(name, direction=direction)
    assert str(run.stop) == str(other.stop)
    assert run.notes == other.notes
    assert_alike(points, others)


@pytest.mark.parametrize(
    "name, count", [("Lorenz", 3), ("snake", 7), ("Henon", 2), ("net of 6", 9), ("small sizes", 3), ("Henon, cycle of 2", 3)]
)
def test_most_steps_are_plain(name, count, monkeypatch):
    """Those that are made one by one pass special points, or end the run, but for one or two."""
    careful = []
    step = Continuation._step
    monkeypatch.setattr(Continuation, "_step", lambda run, state: careful.append(state) or step(run, state))
    points, _ = made(name)
    assert len(careful) <= count < len(points)


@pytest.mark.sample(2)
@pytest.mark.parametrize("name", ["Lorenz", "snake", "Henon", "user's points", "large sizes"])
def test_a_run_goes_on_from_any_state(name):
    system, x, settings = start(name)
    run = Continuation(system, x, settings)
    seen = [(run.state, point) for point in run]
    for number in range(1, len(seen), 7):
        state, point = seen[number]
        if point.label:
            continue
        assert np.array_equal(state.x, point.x) and np.array_equal(state.tangent, point.tangent)
        rest = list(Continuation(system, x, settings, state=state, start=run.start))
        assert len(rest) == len(seen) - number - 1
        for one, (_, other) in zip(rest, seen[number + 1 :]):
            assert one.label == other.label
            # some of OpenBLAS's kernels add up in an order that hangs on where an array lies in memory
            assert np.allclose(one.x, other.x, rtol=1e-14, atol=1e-14)
            assert one.arclength == pytest.approx(other.arclength, rel=1e-13, abs=1e-13)


@pytest.mark.sample(2)
@pytest.mark.parametrize("most", [1, 2, 9, 10, 11, 40])
def test_max_points(most):
    points, run = made("snake", max_points=most)
    assert run.stop.reason == "max points"
    assert len([point for point in points if not point.label]) == most - 1
    assert run.state.accepted == most
    assert_alike(points, one_by_one("snake", max_points=most)[0])


def test_states_are_those_of_one_by_one():
    system, x, settings = start("snake")
    run = Continuation(system, x, settings)
    states = [run.state for _ in run]
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(runs, "lane_of", lambda *_: None)
        other = Continuation(system, x, settings)
        others = [other.state for _ in other]
    for one, two in itertools.zip_longest(states, others):
        for field in dataclasses.fields(one):
            a, b = getattr(one, field.name), getattr(two, field.name)
            if field.name != "system" and a is not None:
                assert np.allclose(a, b, rtol=1e-8, atol=1e-8, equal_nan=True), field.name


def test_points_are_pickled_alone():
    import pickle

    points, _ = made("snake")
    assert len(pickle.dumps(points[3].x)) < 500
