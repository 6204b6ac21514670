"""Extrema along branches, and with more parameters: successive continuation against closed forms and AUTO-07p's demos."""

import functools
import math

import pytest

from contin import AlgebraicProblem, BoundaryValueProblem, CycleProblem, ProblemError, curve, solve, trace


def on_sphere(u, p):
    return (u.x1**2 + p.x2**2 + p.x3**2 + p.x4**2 + p.x5**2 - 1,)


@functools.cache
def sphere():
    names = {"x2": 0.0, "x3": 0.0, "x4": 0.0, "x5": 0.0}
    return AlgebraicProblem(on_sphere, ["x1"], names, {"sum": lambda u, p: u.x1 + p.x2 + p.x3 + p.x4 + p.x5})


def test_demo_opt():
    """The sum of n coordinates of a point on the unit sphere is largest, sqrt(n), where they are 1 / sqrt(n).

    The second derivative of the sum along a great circle through that point is -sqrt(n).
    """
    branch = trace(solve(sphere(), [1.0]), free=["x2"], limits={"x2": (-2, 2)}, extrema=["sum"])
    assert [point.label for point in branch if point.label == "EX"] == ["EX", "EX"]
    point = branch.labelled("EX")[0]
    for count, name in enumerate(("x2", "x3", "x4", "x5"), start=2):
        if count > 2:
            (point,) = curve(point, name, limits={name: (-0.9, 0.9)}).labelled("EX")
        assert point["sum"] == pytest.approx(math.sqrt(count), abs=1e-13)
        assert point[name] == pytest.approx(1 / math.sqrt(count), abs=1e-11)
        for curvature in point.details.values():
            assert curvature == pytest.approx(-math.sqrt(count), abs=1e-8)


@functools.cache
def obv_branch():
    problem = BoundaryValueProblem(
        lambda t, u, p: (u.v, -p.l1 * math.exp(u.u + p.l2 * u.u**2 + p.l3 * u.u**4)), lambda a, b, p: (a.u, b.u), ["u", "v"],
        {"l1": 0.0, "l2": 0.0, "l3": 0.0},
        functionals={"objective": lambda t, u, p: (u.u - 1) ** 2 + 0.1 * (p.l1**2 + p.l2**2 + p.l3**2)},
    )  # fmt: skip
    return trace(solve(problem, [0, 0]), free=["l1"], limits={"l1": (-1, 5), "objective": (0, 10)}, extrema=["objective"])


@pytest.mark.full
def test_demo_obv():
    """AUTO-07p 0.9.2, ``obv`` with NTST = 60 and tolerances of 1e-10, NMX = 600 and 200 in the last two runs: b.1, b.2, b.3."""
    first = obv_branch().labelled("EX")[0]
    assert first["objective"] == pytest.approx(0.923446, abs=1e-6)
    assert first["l1"] == pytest.approx(0.924365, abs=1e-6)
    second = curve(first, "l2", limits={"l2": (-1, 5), "objective": (0, 10)}).labelled("EX")
    for found, known in zip(
        second[1:], [(1.0629976077, 2.2297107370, 0.76388632155), (0.36082427332, 0.68610138732, 0.85127161951)]
    ):
        assert (found["objective"], found["l1"], found["l2"]) == pytest.approx(known, abs=1e-8)
    (third,) = curve(second[-1], "l3", limits={"l3": (-1, 3), "objective": (0, 10)}).labelled("EX")
    known = 0.28459306238, 0.37721636110, 0.23782470493, 0.46760730565
    assert (third["objective"], third["l1"], third["l2"], third["l3"]) == pytest.approx(known, abs=1e-8)
    assert third.details["least_curvature"] > 0  # a minimum


@pytest.mark.full
def test_the_turn_of_a_curve_of_extrema_is_no_extremum_in_two_parameters():
    """At a fold of the curve with respect to the new parameter the derivative along the curve vanishes, too."""
    found = curve(obv_branch().labelled("EX")[0], "l2", limits={"l2": (-1, 5), "objective": (0, 10)})
    turns = [point["l2"] for point in found.labelled("LP")]
    assert len(turns) == 2
    assert min(abs(turn - point["l2"]) for turn in turns for point in found.labelled("EX")) > 1e-3


@pytest.mark.full
def test_demo_ops():
    """AUTO-07p 0.9.2, ``ops`` with NTST = 60 and tolerances of 1e-10 in c.ops, NTST = 100 in the last run of ops.auto."""

    def field(u, p):
        return (-2 * (u.x**3 / 3 - u.x) + (u.z - u.x) / p.l2 - u.y) / p.l1, u.x - p.l3, -(u.z - u.x) / p.l2

    rest = AlgebraicProblem(field, ["x", "y", "z"], {"l1": 0.5, "l2": 4.0, "l3": 0.9})
    branch = trace(solve(rest, [0.9, -2 * (0.9**3 / 3 - 0.9), 0.9]), free=["l3"], limits={"l3": (0.8, 1)})
    cycles = trace(branch.labelled("HB")[0], branch=1, free=["l3"], limits={"l3": (0.8, 1), "period": (0, 12)}, extrema=["l3"])
    assert isinstance(cycles.points[-1].system.problem, CycleProblem)
    extrema = cycles.labelled("EX")
    assert [point["l3"] for point in extrema] == pytest.approx([point["l3"] for point in cycles.labelled("LP")], abs=1e-10)
    assert extrema[0]["l3"] == pytest.approx(0.921972, abs=1e-6)
    (second,) = curve(extrema[1], "l2", direction=-1, limits={"l2": (1, 6)}).labelled("EX")
    known = 0.91775182430, 2.2062940768, 10.250502049
    assert (second["l3"], second["l2"], second["period"]) == pytest.approx(known, abs=2e-8)
    third = curve(second, "l1", direction=-1, limits={"l1": (0.09, 1)}, zeros={"l1": [0.1]}).labelled("UZ")[0]
    known = 0.93173922409, 2.1787149835, 9.1976218097
    assert (third["l3"], third["l2"], third["period"]) == pytest.approx(known, abs=2e-8)


def test_extrema_of_a_column_without_known_derivatives():
    """max_x of x' = mu x - y - x r^2, y' = x + mu y - y r^2 with mu = 1 - a^2 is sqrt(mu): largest at a = 0."""

    def field(u, p):
        square = u.x**2 + u.y**2
        return (1 - p.a**2) * u.x - u.y - u.x * square, u.x + (1 - p.a**2) * u.y - u.y * square

    problem = CycleProblem(field, ["x", "y"], {"a": -0.5, "b": 0.0})
    start = solve(problem, lambda t: (0.8 * math.cos(2 * math.pi * t), 0.8 * math.sin(2 * math.pi * t)), {"period": 6.0})
    branch = trace(start, free=["a"], limits={"a": (-0.6, 0.5)}, extrema=["max_x"])
    (largest,) = branch.labelled("EX")
    assert largest["a"] == pytest.approx(0, abs=1e-7)
    with pytest.raises(ProblemError, match="'max_x' are labelled on branches, but not followed"):
        curve(largest, "b")


def test_extrema_of_unknown_columns():
    with pytest.raises(ProblemError, match="'product' is no column of this problem"):
        trace(solve(sphere(), [1.0]), free=["x2"], extrema=["product"])


def test_a_curve_of_extrema_follows_cycles_to_a_hopf_point():
    """Demo ``ops``: extrema of p3 on cycles, whose tangents turn far on the way; no branch point is suspected.

    The curve ends where the cycles have .3 % of their largest size. Parameters differ by the square of that from those
    of Hopf points, where c2 c1 = c0 in lambda^3 + c2 lambda^2 + c1 lambda + c0, and the period from 2 pi / sqrt(c1).
    """

    def ops(u, p):
        return (-p.p4 * (u.x**3 / 3 - u.x) + (u.z - u.x) / p.p2 - u.y) / p.p1, u.x - p.p3, -(u.z - u.x) / p.p2

    values = {"p1": 0.5, "p2": 4.0, "p3": 0.9, "p4": 2.0}
    first = solve(AlgebraicProblem(ops, ["x", "y", "z"], values), [0.9, 1.314, 0.9])
    rest = trace(first, free=["p3"], limits={"p3": (0.8, 0.95)})
    limits = {"p3": (0.8992, 1), "period": (0, 12)}
    cycles = trace(rest.labelled("HB")[0], branch=1, free=["p3"], limits=limits, extrema=["p3"])
    found = curve(cycles.labelled("EX")[0], "p2", direction=-1, limits={"p2": (0.5, 6)})
    end = found[-1]
    assert end.label == "EP" and "near a Hopf point" in str(found.stop)
    assert not [note for note in found.notes if "determinant" in note]
    p1, p2, p3, p4 = (end[name] for name in values)
    a = (p4 * (1 - p3**2) - 1 / p2) / p1
    c2, c1, c0 = 1 / p2 - a, 1 / p1 - a / p2 - 1 / (p1 * p2**2), 1 / (p1 * p2)
    assert c2 * c1 == pytest.approx(c0, abs=1e-3)
    assert end["period"] == pytest.approx(2 * math.pi / math.sqrt(c1), abs=1e-3)
