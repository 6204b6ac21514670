"""Hopf points of equilibria whose eigenvalues are known as functions of the parameter."""

import math

import numpy as np
import pytest

from contin import AlgebraicProblem, solve, trace


def test_hopf_of_the_normal_form():
    """x' = mu x - 2 y - ..., y' = 2 x + mu y - ...: eigenvalues mu -+ 2 i."""
    problem = AlgebraicProblem(
        lambda u, p: (p.mu * u.x - 2 * u.y - u.x * (u.x**2 + u.y**2), 2 * u.x + p.mu * u.y - u.y * (u.x**2 + u.y**2)),
        ["x", "y"], {"mu": -1.0},
    )  # fmt: skip
    branch = trace(solve(problem, [0.0, 0.0]), free=["mu"], limits={"mu": (-2, 2)})
    (hopf,) = branch.labelled("HB")
    assert abs(hopf["mu"]) < 1e-10
    assert hopf.details["frequency"] == pytest.approx(2, abs=1e-9)
    assert [p.label for p in branch if p.label] == ["EP", "HB", "EP"]
    assert sorted(hopf.system.eigenvalues(hopf.x).imag) == pytest.approx([-2, 2])


def test_neutral_saddles_are_no_hopf_points():
    """Eigenvalues 1 and mu - 1: their sum passes zero at mu = 0, both real."""
    problem = AlgebraicProblem(lambda u, p: (u.x, (p.mu - 1) * u.y), ["x", "y"], {"mu": -0.5})
    branch = trace(solve(problem, [0.0, 0.0]), free=["mu"], limits={"mu": (-0.9, 0.9)})
    assert not branch.labelled("HB")


def oscillators(*rates):
    """Independent pairs of eigenvalues rate(mu) -+ i (1 + k), rates of degree two: Hopf points where one vanishes."""
    n = 2 * len(rates)

    def residual(u, p, out):
        for k in range(n // 2):
            rate = table[k, 0] + table[k, 1] * p[0] + table[k, 2] * p[0] ** 2
            out[2 * k] = rate * u[2 * k] - (1 + k) * u[2 * k + 1]
            out[2 * k + 1] = (1 + k) * u[2 * k] + rate * u[2 * k + 1]

    table = np.array(rates, dtype=float)
    return AlgebraicProblem(residual, n, {"mu": -1.0})


@pytest.mark.parametrize(
    ("rates", "places"),
    [
        pytest.param([(0.0, 1.0, 0.0), (-0.1, 1.0, 0.0)], [0.0, 0.1], marks=pytest.mark.full),  # two pairs, one after the other
        ([(0.0, 1.0, 0.0), (0.6, -1.0, 0.0)], [0.0, 0.6]),  # one comes, another goes
        ([(0.0, 1.0, 0.0), (-0.1, 1.0, 0.0), (-0.2, 1.0, 0.0)], [0.0, 0.1, 0.2]),
        ([(0.16, 0.0, -1.0)], [-0.4, 0.4]),  # the same pair, out and back
    ],
)
def test_several_hopf_points_in_one_step(rates, places):
    start = solve(oscillators(*rates))
    branch = trace(start, free=["mu"], limits={"mu": (-2, 1)}, step=1.7, change=1.4)
    assert len(branch) <= 4 + len(places)  # really one or two steps
    assert [point["mu"] for point in branch.labelled("HB")] == pytest.approx(places, abs=1e-10)


@pytest.mark.sample(5)
@pytest.mark.parametrize("nu", [0.1, 0.014, 0.0027, 0.0012, 0.00075, 0.00013])
@pytest.mark.parametrize("start", [3.1, 5.5, 7.7])
def test_a_hopf_point_in_the_same_step_as_a_fold(nu, start):
    """On x^2 = mu eigenvalues have the product 2 x and the sum nu - x: Hopf at x = nu; real, one zero, at the fold x = 0."""
    problem = AlgebraicProblem(
        lambda u, p: (u.y, p.mu - u.x**2 + (p.nu - u.x) * u.y), ["x", "y"], {"mu": 4.0, "nu": 0.1},
        functionals={"x": lambda u, p: u.x},
    )  # fmt: skip
    first = solve(problem, [start, 0.0], {"mu": start**2, "nu": nu})
    branch = trace(first, free=["mu"], direction=-1, limits={"x": (-3, 20)}, errors=False)
    assert [point.label for point in branch if point.label] == ["EP", "HB", "LP", "EP"]
    assert branch.labelled("HB")[0]["x"] == pytest.approx(nu, abs=1e-9)


def test_a_double_hopf_point():
    """Three Brusselators (A = 1) in a ring, coupled by .1, .2: b = 1 + A^2 for equal ones, 3 (.1 + .2) more for two modes."""

    def cell(x, y, x1, y1, x2, y2, b):
        return 1 - (b + 1) * x + x**2 * y + 0.1 * (x1 + x2 - 2 * x), b * x - x**2 * y + 0.2 * (y1 + y2 - 2 * y)

    def ring(u, p):
        a, b = cell(u.x1, u.y1, u.x2, u.y2, u.x3, u.y3, p.b)
        c, d = cell(u.x2, u.y2, u.x3, u.y3, u.x1, u.y1, p.b)
        e, f = cell(u.x3, u.y3, u.x1, u.y1, u.x2, u.y2, p.b)
        return a, b, c, d, e, f

    problem = AlgebraicProblem(ring, ["x1", "y1", "x2", "y2", "x3", "y3"], {"b": 1.0})
    branch = trace(solve(problem, [1, 1] * 3), free=["b"], limits={"b": (1, 5)})
    points = branch.labelled("HB")
    assert [point["b"] for point in points] == pytest.approx([2, 2.9], abs=1e-10)
    assert [point.details["pairs"] for point in points] == [1, 2]
    assert branch.stop.reason == "limit"


@pytest.mark.parametrize("gap", [0.1, 1e-3, 1e-6])
def test_pairs_that_cross_one_after_the_other(gap):
    """Eigenvalues mu -+ i and mu - gap -+ 3 i."""
    problem = AlgebraicProblem(
        lambda u, p: (p.mu * u.a - u.b, u.a + p.mu * u.b, (p.mu - gap) * u.c - 3 * u.d, 3 * u.c + (p.mu - gap) * u.d),
        ["a", "b", "c", "d"], {"mu": -1.0},
    )  # fmt: skip
    points = trace(solve(problem, [0.0] * 4), free=["mu"], limits={"mu": (-1, 1)}).labelled("HB")
    assert [point["mu"] for point in points] == pytest.approx([0, gap], abs=1e-13)
    assert [point.details["frequency"] for point in points] == pytest.approx([1, 3], abs=1e-9)
    assert all(abs(point["mu"] - exact) <= 10 * point.errors["mu"] < 1e-12 for point, exact in zip(points, (0, gap)))


@pytest.mark.sample(3)
@pytest.mark.parametrize("start", [-1.0, -0.9, -0.73])
@pytest.mark.parametrize(("w", "c"), [(2.0, 1.0), (1.5, 1.0), (2.0, 0.5)])
def test_pairs_that_cross_at_one_place(start, w, c):
    """Eigenvalues mu -+ i and c mu -+ w i: one point, also where both are located with the same bits."""
    problem = AlgebraicProblem(
        lambda u, p: (p.mu * u.a - u.b, u.a + p.mu * u.b, c * p.mu * u.c - w * u.d, w * u.c + c * p.mu * u.d),
        ["a", "b", "c", "d"], {"mu": start},
    )  # fmt: skip
    (point,) = trace(solve(problem, [0.0] * 4), free=["mu"], limits={"mu": (-2, 2)}).labelled("HB")
    assert point["mu"] == pytest.approx(0, abs=1e-13) and point.details["pairs"] == 2


def test_one_pair_comes_as_another_goes():
    """Eigenvalues mu -+ i and .05 - mu -+ 3 i: as many unstable ones before as after."""
    problem = AlgebraicProblem(
        lambda u, p: (p.mu * u.a - u.b, u.a + p.mu * u.b, (0.05 - p.mu) * u.c - 3 * u.d, 3 * u.c + (0.05 - p.mu) * u.d),
        ["a", "b", "c", "d"], {"mu": -1.0},
    )  # fmt: skip
    points = trace(solve(problem, [0.0] * 4), free=["mu"], limits={"mu": (-1, 1)}).labelled("HB")
    assert [point["mu"] for point in points] == pytest.approx([0, 0.05], abs=1e-12)


def brusselator_on_a_line(u, p, out):
    """X' and Y' at 100 places of a line of length p[0], second differences, the equilibrium held at both ends."""
    n, a, b = 100, 2.0, 5.45
    per_length = ((n + 1) / p[0]) ** 2
    for i in range(n):
        x, y = u[i], u[n + i]
        left = (u[i - 1], u[n + i - 1]) if i > 0 else (a + 0 * x, b / a + 0 * y)
        right = (u[i + 1], u[n + i + 1]) if i < n - 1 else (a + 0 * x, b / a + 0 * y)
        out[i] = 0.008 * per_length * (left[0] - 2 * x + right[0]) + a - (b + 1) * x + x * x * y
        out[n + i] = 0.004 * per_length * (left[1] - 2 * y + right[1]) + b * x - x * x * y


@pytest.mark.full
def test_hopf_points_of_many_unknowns():
    """AUTO's demo brf on 100 places. Mode k crosses where (Dx + Dy) mu = B - 1 - A^2, mu its eigenvalue of the differences."""
    n = 100
    problem = AlgebraicProblem(brusselator_on_a_line, 2 * n, {"length": 0.3})
    rest = solve(problem, np.append(np.full(n, 2.0), np.full(n, 5.45 / 2)))
    branch = trace(rest, free=["length"], limits={"length": (0.3, 1.2)})
    exact = [2 * (n + 1) * math.sin(k * math.pi / 2 / (n + 1)) * math.sqrt(0.012 / 0.45) for k in (1, 2)]
    found = branch.labelled("HB")
    assert rest.system.is_sparse or branch.points[0].system.is_sparse
    assert np.allclose([point["length"] for point in found], exact, rtol=1e-10)
    assert all(point.normal_form < 0 for point in found)


@pytest.mark.full
def test_a_large_problem_may_start_at_zero():
    """u'' + lam (u - u^3) = 0 on 200 places: a branch point at an eigenvalue of the differences."""
    n = 200

    def heated(u, p, out):
        for i in range(n):
            left = u[i - 1] if i > 0 else 0 * u[i]
            right = u[i + 1] if i < n - 1 else 0 * u[i]
            out[i] = (left - 2 * u[i] + right) * (n + 1) ** 2 / math.pi**2 + p[0] * (u[i] - u[i] ** 3)

    problem = AlgebraicProblem(heated, n, {"lam": 0.5})
    branch = trace(solve(problem, np.zeros(n)), free=["lam"], limits={"lam": (0.5, 2)})
    exact = 4 * (n + 1) ** 2 / math.pi**2 * math.sin(math.pi / 2 / (n + 1)) ** 2
    assert [point.label for point in branch if point.label] == ["EP", "BP", "EP"]
    assert abs(branch.labelled("BP")[0]["lam"] - exact) < 1e-10


@pytest.mark.sample(1)
@pytest.mark.parametrize("place", [-0.611, -0.5014, -0.2286, -0.1, 0.3, 0.77])
@pytest.mark.parametrize("coupling", [0.205, 0.21, 0.25, 0.4])
def test_two_hopf_points_close_to_each_other_in_a_long_step(place, coupling):
    """Two modes of nearly the same frequency: eigenvalues -.2 + 3 i +- sqrt(g^2 - 100 (a - c)^2) and their conjugates.

    One crosses the axis twice, at a = c -+ sqrt(g^2 - .04) / 10, which is .009 to .07 apart in steps of .5.
    """

    def field(u, p):
        apart = 10 * (p.a - place)
        x, y, v, w = u.x, u.y, u.v, u.w  # (x + i v)' = (-.2 + 3 i + i d) (x + i v) + g (y + i w), and with -d
        return (
            -0.2 * x - (3 + apart) * v + coupling * y - x**3, -0.2 * y - (3 - apart) * w + coupling * x - y**3,
            -0.2 * v + (3 + apart) * x + coupling * w - v**3, -0.2 * w + (3 - apart) * y + coupling * v - w**3,
        )  # fmt: skip

    start = solve(AlgebraicProblem(field, ["x", "y", "v", "w"], {"a": -2.0}), [0.0] * 4)
    found = trace(start, free=["a"], limits={"a": (-2, 2)}, step=0.1, max_step=0.5).labelled("HB")
    aside = math.sqrt(coupling**2 - 0.04) / 10
    assert [point["a"] for point in found] == pytest.approx([place - aside, place + aside], abs=1e-9)
