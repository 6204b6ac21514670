"""Fixed points and cycles of maps, against closed forms."""

import functools
import math

import numpy as np
import pytest
from scipy.optimize import fsolve

import contin
from contin import MapProblem, ProblemError


@functools.cache
def logistic():
    problem = MapProblem(lambda u, p: (p.r * u.x * (1 - u.x),), ["x"], {"r": 0.5}, {"twice": lambda u, p: 2 * u.x})
    zero = contin.trace(contin.solve(problem, [0.0]), free=["r"], limits={"r": (0.5, 4)})
    return contin.trace(zero.labelled("BP")[0], branch=1, limits={"r": (1, 3.7)})


def henon(u, p):
    return 1 - p.a * u.x**2 + u.y, p.b * u.x


def labels(branch):
    return [point.label for point in branch if point.label]


def test_the_logistic_map_doubles_its_period():
    """Fixed points x = 1 - 1 / r; doublings at 3, 1 + sqrt(6), and 3.5440903596 (MathWorld, Logistic Map)."""
    single = logistic()
    assert labels(single) == ["BP", "PD", "EP"]
    for point in single:
        assert point["twice"] == pytest.approx(2 - 2 / point["r"], abs=1e-11)
    known, branch = [3, 1 + math.sqrt(6), 3.5440903596], single
    for number, place in enumerate(known):
        (doubling,) = branch.labelled("PD")
        assert (doubling["r"], doubling["rounds"]) == pytest.approx((place, 2**number), abs=1e-10)
        if number < 2:
            branch = contin.trace(doubling, branch=1, limits={"r": (1, 3.7)})


def test_a_doubling_left_in_another_parameter():
    """x -> r s x (1 - x) has the doublings r s = 3 and 1 + sqrt(6); r stays 3 along the second branch."""
    problem = MapProblem(lambda u, p: (p.r * p.s * u.x * (1 - u.x),), ["x"], {"r": 2.0, "s": 1.0})
    single = contin.trace(contin.solve(problem, [0.5]), free=["r"], limits={"r": (2, 3.4)})
    double = contin.trace(single.labelled("PD")[0], branch=1, free=["s"], limits={"s": (0.9, 1.2)})
    (doubling,) = double.labelled("PD")
    assert (doubling["r"], doubling["s"]) == pytest.approx((3, (1 + math.sqrt(6)) / 3), abs=1e-11)
    with pytest.raises(ProblemError, match="'q' is not one of"):
        contin.trace(single.labelled("PD")[0], branch=1, free=["q"])


def test_multipliers_of_the_logistic_map():
    """2 - r at fixed points, 4 + 2 r - r**2 at cycles of two."""
    single = logistic()
    double = contin.trace(single.labelled("PD")[0], branch=1, limits={"r": (1, 3.7)})
    for point in single.points[2:]:
        assert point.floquet().multipliers[0].real == pytest.approx(2 - point["r"], abs=1e-10)
        assert point.floquet().unstable == int(point["r"] > 3) or point.label == "PD"
    for point in double.points[2:]:
        r = point["r"]
        assert point.floquet().multipliers[0].real == pytest.approx(4 + 2 * r - r * r, abs=1e-9)


def test_special_points_of_henon():
    """A fold at a = -(1 - b)**2 / 4, a doubling at 3 (1 - b)**2 / 4, and that of cycles of two at (5 - 6 b + 5 b**2) / 4."""
    problem, b = MapProblem(henon, ["x", "y"], {"a": 0.1, "b": 0.3}), 0.3
    start = contin.solve(problem, [0.6, 0.2])
    up = contin.trace(start, free=["a"], limits={"a": (-1, 1)})
    down = contin.trace(start, free=["a"], direction=-1, limits={"a": (-1, 2)}, max_points=20)
    (doubling,) = up.labelled("PD")
    assert doubling["a"] == pytest.approx(3 * (1 - b) ** 2 / 4, abs=1e-12)
    assert down.labelled("LP")[0]["a"] == pytest.approx(-((1 - b) ** 2) / 4, abs=1e-12)
    double = contin.trace(doubling, branch=1, limits={"a": (0, 1)})
    assert double.labelled("PD")[0]["a"] == pytest.approx((5 - 6 * b + 5 * b * b) / 4, abs=1e-11)
    folds = contin.curve(down.labelled("LP")[0], "b", limits={"b": (0.2, 0.6)})
    assert folds.points[-1]["a"] == pytest.approx(-(0.4**2) / 4, abs=1e-12)


def test_a_torus_of_the_delayed_logistic_map():
    """x = 1 - 1 / r has multipliers of the product r - 1 and the sum 1: exp(-+ i pi / 3) at r = 2."""
    problem = MapProblem(lambda u, p: (p.r * u.x * (1 - u.y), u.x), ["x", "y"], {"r": 1.5})
    branch = contin.trace(contin.solve(problem, [0.3, 0.3]), free=["r"], limits={"r": (1.2, 2.5)})
    (torus,) = branch.labelled("TR")
    assert torus["r"] == pytest.approx(2, abs=1e-12)
    assert torus.details["frequency"] == pytest.approx(math.pi / 3, abs=1e-12)
    assert [point.floquet().unstable for point in (branch.points[0], branch.points[-1])] == [0, 2]


def test_a_cycle_of_three():
    """The window of period three of the logistic map opens at 1 + sqrt(8), a fold."""
    problem = MapProblem(lambda u, p: (p.r * u.x * (1 - u.x),), ["x"], {"r": 3.84})
    cycle = contin.solve(problem, [0.15], {"rounds": 3})
    branch = contin.trace(cycle, free=["r"], direction=-1, limits={"r": (3.82, 3.9)}, max_points=30)
    assert branch.labelled("LP")[0]["r"] == pytest.approx(1 + math.sqrt(8), abs=1e-11)


def logistic_iterates(x, r, rounds):
    """The points of an orbit of the logistic map, and the product of the derivatives over them."""
    points, product = [], 1.0
    for _ in range(rounds):
        points.append(x)
        x, product = r * x * (1 - x), product * r * (1 - 2 * x)
    return np.array(points), x, product


@pytest.mark.sample(1)
@pytest.mark.parametrize("which", [8, 11, 16, 18])
def test_a_cycle_of_32_keeps_to_itself(which):
    """The stable one at r = 3.569, of which a branch may begin at any point; it doubles where plain arithmetic says.

    In the chaos behind it there are millions of cycles of 32; applied 32 times the map has a slope of -800 at r = 3.6.
    """
    points = logistic_iterates(logistic_iterates(0.5, 3.569, 100_000)[1], 3.569, 33)[0]

    def critical(unknown):
        _, end, product = logistic_iterates(*unknown, 32)
        return end - unknown[0], product + 1

    known = fsolve(critical, (points[which], 3.5697), xtol=1e-12)
    problem = MapProblem(lambda u, p: (p.r * u.x * (1 - u.x),), ["x"], {"r": 3.569})
    branch = contin.trace(contin.solve(problem, [points[which]], {"rounds": 32}), free=["r"], limits={"r": (3.569, 3.6)})
    assert labels(branch) == ["EP", "PD", "EP"]
    (doubling,) = branch.labelled("PD")
    assert (doubling["x"], doubling["r"]) == pytest.approx(tuple(known), abs=1e-10)
    assert branch.points[-1]["r"] == pytest.approx(3.6, abs=1e-12)
    for point in branch:
        orbit, end, product = logistic_iterates(point["x"], point["r"], 32)
        assert np.abs(orbit - point.system.states(point.x).ravel()).max() < 1e-9
        assert np.abs(point.system.residual(point.x)).max() < 1e-12
        assert point.floquet().multipliers[0].real == pytest.approx(product, rel=1e-6)


def test_the_error_of_multipliers_of_long_cycles():
    """A cycle of 256 of the Henon map at the accumulation of doublings: its determinant is (-b)**256 in any case."""
    problem, b = MapProblem(henon, ["x", "y"], {"a": 1.058, "b": 0.3}), 0.3
    state = np.zeros(2)
    for _ in range(200_000):
        state = 1 - 1.058 * state[0] ** 2 + state[1], b * state[0]
    point = contin.solve(problem, state, {"rounds": 256})
    found = point.floquet()
    assert found.logarithms.real.sum() == pytest.approx(256 * math.log(b), rel=1e-11)
    assert np.all(found.errors < 1e-6)


def test_a_curve_of_folds_of_a_cycle_of_three():
    """x -> r s x (1 - x): the window of period three opens at r s = 1 + sqrt(8), for any s."""
    problem = MapProblem(lambda u, p: (p.r * p.s * u.x * (1 - u.x),), ["x"], {"r": 3.84, "s": 1.0})
    cycle = contin.solve(problem, [0.15], {"rounds": 3})
    branch = contin.trace(cycle, free=["r"], direction=-1, limits={"r": (3.82, 3.9)}, max_points=30)
    folds = contin.curve(branch.labelled("LP")[0], "s", limits={"s": (0.9, 1.1)})
    for point in folds:
        assert point["r"] * point["s"] == pytest.approx(1 + math.sqrt(8), abs=1e-10)


def test_a_curve_of_folds_of_henon_passes_a_resonance_and_a_fold_flip():
    """x' = a + b y - x^2, y' = x: folds at a = -(1 - b)^2 / 4, where the other multiplier is -b."""
    problem = MapProblem(lambda u, p: (p.a + p.b * u.y - u.x**2, u.x), ["x", "y"], {"a": 0.1, "b": 0.3})
    start = contin.solve(problem, [0.1, 0.1])
    (fold,) = contin.trace(start, free=["a"], direction=-1, limits={"a": (-1, 2)}, max_points=20).labelled("LP")
    for direction, label, known in ((-1, "R1", (-1, -1)), (1, "LPPD", (0, 1))):
        found = contin.curve(fold, "b", direction=direction, limits={"b": (-1.5, 1.5)})
        (point,) = found.labelled(label)
        assert (point["a"], point["b"]) == pytest.approx(known, abs=1e-9)
        assert [point.label for point in found if point.label] == ["EP", label, "EP"]
        for point in found:
            assert point["a"] == pytest.approx(-((1 - point["b"]) ** 2) / 4, abs=1e-10)


def test_a_stored_doubling_goes_on(tmp_path):
    single = logistic()
    contin.save(single, tmp_path / "map.npz")
    (doubling,) = contin.load(single.points[0].system.problem, tmp_path / "map.npz").labelled("PD")
    double = contin.trace(doubling, branch=1, limits={"r": (1, 3.5)})
    assert double.labelled("PD")[0]["r"] == pytest.approx(1 + math.sqrt(6), abs=1e-10)


def test_a_diagram_finds_all_of_it():
    start = contin.solve(logistic().points[0].system.problem, [0.0])
    found = contin.diagram(start, free=["r"], depth=2, limits={"r": (0.5, 3.5)})
    assert [(junction.point.label, junction.point["rounds"]) for junction in found.junctions] == [
        ("BP", 1),
        ("PD", 1),
        ("PD", 2),
    ]
    assert np.isfinite(found.branches[0].points[0]["r"])


@pytest.mark.parametrize(
    ("statement", "words"),
    [
        (lambda: MapProblem(lambda u, p: (u.x, u.x), ["x"], {"r": 1.0}), "map returns 2 values for the 1 states x"),
        (lambda: MapProblem(lambda u, p: (u.x,), ["x"], {"rounds": 1.0}), "rounds is a parameter of every map by itself"),
        (
            lambda: contin.solve(MapProblem(henon, ["x", "y"], {"a": 0.1, "b": 0.3}), [0, 0], {"rounds": 1.5}),
            "whole number from 1",
        ),
        (lambda: contin.trace(logistic().points[0], free=["rounds"]), "rounds must not be free"),
    ],
)
def test_what_is_refused(statement, words):
    with pytest.raises(ProblemError, match=words):
        statement()


@pytest.mark.full
def test_curves_of_period_doublings_of_henon():
    """Of the fixed point at a = 3 (1 - b)^2 / 4, of the cycle of two points at a = (1 - b)^2 + (1 + b)^2 / 4; det = -b.

    At b = -1 both multipliers are -1.
    """
    henon = MapProblem(lambda u, p: (1 + u.y - p.a * u.x**2, p.b * u.x), ["x", "y"], {"a": 0.1, "b": 0.3})
    (single,) = contin.trace(contin.solve(henon, [0.5, 0.5]), free=["a"], limits={"a": (0, 1)}).labelled("PD")
    found = contin.curve(single, "b", direction=-1, limits={"b": (-1.5, 1)})
    assert [point.label for point in found if point.label] == ["EP", "R2", "EP"]
    assert (found.labelled("R2")[0]["a"], found.labelled("R2")[0]["b"]) == pytest.approx((3, -1), abs=1e-10)
    for point in found:
        assert point["a"] == pytest.approx(0.75 * (1 - point["b"]) ** 2, abs=1e-10)
        multipliers = point.floquet().multipliers  # of a double one the root of round-off is known
        assert np.abs(multipliers + 1).min() < (1e-6 if point.label == "R2" else 1e-8)
    (double,) = contin.trace(single, branch=1, limits={"a": (0, 1)}).labelled("PD")
    for point in contin.curve(double, "b", limits={"b": (-0.5, 0.5)}):
        assert point["a"] == pytest.approx((1 - point["b"]) ** 2 + (1 + point["b"]) ** 2 / 4, abs=1e-10)


def test_a_curve_of_tori_of_a_map_passes_strong_resonances(tmp_path):
    """x' = r x (1 - (1 - e) y - e x), y' = x: at the fixed point det = (r - 1)(1 - e) and trace = 1 - (r - 1) e.

    det = 1 at r = 1 + 1 / (1 - e), where the trace is 0 at e = 1/2 (R4), -1 at 2/3 (R3), -2 at 3/4 (R2).
    """
    problem = MapProblem(lambda u, p: (p.r * u.x * (1 - (1 - p.e) * u.y - p.e * u.x), u.x), ["x", "y"], {"r": 1.5, "e": 0.0})
    (torus,) = contin.trace(contin.solve(problem, [1 / 3, 1 / 3]), free=["r"], limits={"r": (1.2, 2.5)}).labelled("TR")
    found = contin.curve(torus, "e", limits={"e": (-1, 1)})
    assert [point.label for point in found if point.label] == ["EP", "R4", "R3", "R2"]
    for label, e in (("R4", 1 / 2), ("R3", 2 / 3), ("R2", 3 / 4)):
        assert found.labelled(label)[0]["e"] == pytest.approx(e, abs=1e-9)
    for point in found:
        assert point["r"] == pytest.approx(1 + 1 / (1 - point["e"]), abs=1e-9)
        trace = 1 - point["e"] / (1 - point["e"])
        assert 2 * math.cos(point["angle"]) == pytest.approx(trace, abs=1e-8)
    contin.save(found, tmp_path / "curve.npz")
    again = contin.load(problem, tmp_path / "curve.npz")
    assert again.column("angle").tolist() == found.column("angle").tolist()
    onward = contin.trace(again.points[1], limits={"e": (-1, 0.6)})  # of the same kind of curve
    assert [point.label for point in onward if point.label][-2:] == ["R4", "EP"]


def test_a_diagram_keeps_branch_points_of_fixed_points_and_of_cycles_apart():
    """With m = 16 r (r - 1), x = 0 doubles at m = -2, and the cycle x^2 = -2 - m has a branch point at m = -3; y at r = 1/2."""
    problem = contin.MapProblem(
        lambda u, p: (u.x * (1 + 16 * p.r * (p.r - 1) + u.x**2), u.y * (p.r + 0.5 - u.y**2)), ["x", "y"], {"r": 0.05}
    )
    found = contin.diagram(contin.solve(problem, [0.0, 0.0]), free=["r"], limits={"r": (-0.05, 0.6)}, depth=2)
    points = {(junction.point.label, junction.point["rounds"], round(junction.point["r"], 6)) for junction in found.junctions}
    assert points >= {("PD", 1, 0.146447), ("BP", 1, 0.0), ("BP", 1, 0.5), ("BP", 2, 0.25), ("BP", 2, 0.5)}


@pytest.mark.parametrize("b", [1.0, 0.99, 0.9])
def test_a_fixed_point_at_half_a_round_is_one(b):
    """x' - x is known to the round-off of x = pi, and the momentum there is zero: no update of it is small relative to it."""
    problem = contin.MapProblem(
        lambda u, p: (u.x + p.b * u.y + p.K * math.sin(u.x), p.b * u.y + p.K * math.sin(u.x)), ["x", "y"], {"K": 0.5, "b": b}
    )
    for guess in ([math.pi, 0.0], [3.1, 0.01]):
        point = contin.solve(problem, guess)
        assert abs(point["x"] - math.pi) < 1e-12 and abs(point["y"]) < 1e-12
