"""Curves that leave from points of codimension two, against closed forms of truncated normal forms."""

import functools
import math

import numpy as np
import pytest

import contin
from contin import AlgebraicProblem, ProblemError


def hopf_curve(problem, states, free, limits, **options):
    line = contin.trace(contin.solve(problem, states), free=[free[0]], limits={free[0]: limits}, **options)
    return contin.curve(line.labelled("HB")[0], free=free, limits={free[1]: (-0.6, 0.6)})


def labels(branch):
    return [point.label for point in branch if point.label]


# --- generalized Hopf -----------------------------------------------------------------------------------------------


@functools.cache
def bautin():
    """The point mu = b = 0 of growth mu + b r**2 - r**4."""

    def field(u, p):
        s = u.x**2 + u.y**2
        growth = p.mu + p.b * s - s * s
        return growth * u.x - u.y, u.x + growth * u.y

    problem = AlgebraicProblem(field, ["x", "y"], {"mu": -1.0, "b": -0.5})
    return hopf_curve(problem, [0, 0], ["mu", "b"], (-2, 2)).labelled("GH")[0]


def test_folds_of_cycles_leave_a_generalized_hopf_point():
    """mu + b s - s**2 has a double zero s = b / 2 at b**2 + 4 mu = 0, for b > 0."""
    assert bautin().curves == ("LP",)
    found = contin.curve(bautin(), kind="LP", limits={"b": (-1, 1)})
    assert labels(found) == ["EP", "EP"] and found.points[-1]["b"] == pytest.approx(1, abs=1e-12)
    assert 0 < found.points[0]["b"] < 1e-3
    for point in found:
        assert point["b"] ** 2 + 4 * point["mu"] == pytest.approx(0, abs=1e-11)
        assert point["max_x"] ** 2 == pytest.approx(point["b"] / 2, abs=1e-6)


# --- Bogdanov-Takens ------------------------------------------------------------------------------------------------


def takens(u, p):
    return u.y, p.m + p.n * u.y - u.x**2 + u.x * u.y


@functools.cache
def takens_points():
    """The point m = n = 0, found on the curve of Hopf points and on that of folds."""
    problem = AlgebraicProblem(takens, ["x", "y"], {"m": 4.0, "n": -1.0})
    line = contin.trace(contin.solve(problem, [2, 0]), free=["m"], direction=-1, limits={"m": (-1, 5)})
    on_hopf_points = contin.curve(line.labelled("HB")[0], "n", limits={"n": (-3, 3)})
    on_folds = contin.curve(line.labelled("LP")[0], "n", limits={"n": (-3, 3)})
    return on_hopf_points.labelled("BT")[0], on_folds.labelled("BT")[0]


def test_curves_of_equilibria_pass_a_bogdanov_takens_point():
    """Folds at m = 0; Hopf points at m = n**2 with the frequency sqrt(-2 n), for n < 0."""
    on_hopf_points, on_folds = takens_points()
    assert (on_hopf_points.curves, on_folds.curves) == (("LP", "homoclinic"), ("HB", "homoclinic"))
    for direction in (1, -1):
        folds = contin.curve(on_hopf_points, kind="LP", direction=direction, limits={"n": (-3, 3)})
        assert labels(folds) == ["BT", "EP"] and folds.points[-1]["n"] == pytest.approx(3 * direction, abs=1e-12)
        assert max(abs(point["m"]) for point in folds) < 1e-10
    hopfs = contin.curve(on_folds, kind="HB", limits={"n": (-3, 3)})
    assert labels(hopfs) == ["BT", "EP"] and hopfs.points[-1]["n"] == pytest.approx(-3, abs=1e-12)
    for point in hopfs:
        assert point["m"] == pytest.approx(point["n"] ** 2, abs=1e-10)
        assert point["frequency"] ** 2 == pytest.approx(-2 * point["n"], abs=1e-10)


def crossing(m, n, way):
    """x where a branch of a manifold of the saddle x = -sqrt(m) first returns to y = 0, by SciPy's integrator."""
    from scipy.integrate import solve_ivp

    side = -math.sqrt(m)
    trace, determinant = n + side, 2 * side
    root = math.sqrt(trace**2 / 4 - determinant)
    rate = trace / 2 + way * root

    def field(t, u):
        return way * u[1], way * (m + n * u[1] - u[0] ** 2 + u[0] * u[1])

    def home(t, u):
        return u[1]

    home.terminal, home.direction = True, -way
    start = [side + 1e-8, 1e-8 * rate]
    return solve_ivp(field, (0, 200), start, method="DOP853", rtol=1e-13, atol=1e-15, events=home).y_events[0][0][0]


@pytest.mark.full
def test_homoclinic_orbits_leave_a_bogdanov_takens_point():
    """m = 49 / 25 n**2 near the point (by Melnikov's integral); elsewhere both manifolds by SciPy's integrator."""
    from scipy.optimize import brentq

    found = contin.curve(takens_points()[0], kind="homoclinic", limits={"n": (-1, 1)}, zeros={"n": [-0.1]})
    assert labels(found) == ["EP", "UZ", "EP"] and found.points[-1]["n"] == pytest.approx(-1, abs=1e-12)
    first = found.points[0]
    assert first["m"] / first["n"] ** 2 == pytest.approx(49 / 25, rel=3e-3)
    for point in (found.labelled("UZ")[0], found.points[-1]):
        n = point["n"]
        known = brentq(lambda m, n: crossing(m, n, 1) - crossing(m, n, -1), 1.5 * n * n, 1.97 * n * n, (n,), xtol=1e-13)
        assert point["m"] == pytest.approx(known, abs=1e-9)


def mixed(u, p):
    """Takens's normal form with other coefficients, in skew coordinates, and with an unstable and a stable direction."""
    x, y, z, s = u.x + 0.3 * u.y + u.x * u.y, u.y - 0.2 * u.x + 0.1 * u.z, u.z + 0.5 * u.x, u.s - u.y
    a, b = p.m + 0.4 * p.n, p.n - 0.3 * p.m
    rates = y, a + b * y + 1.5 * x**2 - 0.7 * x * y + 0.2 * z * y, 2 * z + x**2, -1.3 * s + x * y
    return rates[0] + 0.1 * rates[1], rates[1], rates[2], rates[3] - 0.2 * rates[0]


@pytest.mark.full
def test_homoclinic_orbits_in_more_dimensions():
    """No closed form: a longer orbit and a finer mesh, from the end of the curve, give the same parameter."""
    problem = AlgebraicProblem(mixed, ["x", "y", "z", "s"], {"m": -0.5, "n": 0.2})
    line = contin.trace(contin.solve(problem, [0.5, 0, 0, 0]), free=["m"], limits={"m": (-1, 1)})
    folds = contin.curve(line.labelled("LP")[0], "n", limits={"n": (-1, 1)})
    (point,) = folds.labelled("BT")
    found = contin.curve(point, kind="homoclinic", max_points=12)
    end = found.points[-1]
    assert found.stop.reason == "max points"
    longer = contin.trace(end, free=["m", "time"], primary="time", limits={"time": (1, 1.2 * end["time"])}).points[-1]
    assert longer["m"] == pytest.approx(end["m"], abs=1e-9)


# --- zero-Hopf and double Hopf --------------------------------------------------------------------------------------


@functools.cache
def zero_hopf(sign):
    """rho' = rho (b - z + z**2), z' = a + z**2 + sign rho**2, turned with the frequency 2."""

    def field(u, p):
        growth = p.b - u.z + u.z**2
        return growth * u.x - 2 * u.y, 2 * u.x + growth * u.y, p.a + u.z**2 + sign * (u.x**2 + u.y**2)

    problem = AlgebraicProblem(field, ["x", "y", "z"], {"a": -1.0, "b": 0.5})
    line = contin.trace(contin.solve(problem, [0, 0, -1]), free=["a"], limits={"a": (-2, 1)})
    return contin.curve(line.labelled("LP")[0], "b", limits={"b": (-1, 1)}, direction=-1).labelled("ZH")[0]


def test_hopf_points_pass_a_zero_hopf_point():
    """Equilibria z**2 = -a; the pair is imaginary at b = z - z**2."""
    assert zero_hopf(1).curves == ("HB", "TR")
    for direction in (1, -1):
        found = contin.curve(zero_hopf(1), kind="HB", direction=direction, limits={"b": (-0.2, 0.2)})
        assert labels(found) == ["ZH", "EP"] and found.points[-1]["b"] == pytest.approx(0.2 * direction, abs=1e-12)
        for point in found:
            z = point.system.states(point.x)[0, 2]
            assert (point["a"], point["b"]) == pytest.approx((-(z**2), z - z**2), abs=1e-10)
            assert point["frequency"] == pytest.approx(2, abs=1e-10)


@pytest.mark.full
def test_torus_bifurcations_leave_a_zero_hopf_point():
    """At z = 0, b = 0 and rho**2 = -a the trace of the amplitude equations is zero, and their frequency sqrt(2) rho."""
    found = contin.curve(zero_hopf(1), kind="TR", primary="a", limits={"a": (-0.1, 1)})
    assert labels(found) == ["EP", "EP"] and found.points[-1]["a"] == pytest.approx(-0.1, abs=1e-12)
    for point in found:
        assert point["b"] == pytest.approx(0, abs=1e-11)
        assert point["angle"] == pytest.approx(math.pi * math.sqrt(-2 * point["a"]), abs=1e-8)


def test_none_leave_where_the_cycles_are_saddles():
    """With the other sign the determinant of the amplitude equations is negative."""
    with pytest.raises(ProblemError, match="no torus bifurcations leave from this point"):
        contin.curve(zero_hopf(-1), kind="TR")


@functools.cache
def double_hopf():
    """Growths m1 - r**2 - 1.5 s**2 and m2 - 2.5 r**2 - s**2, frequencies 1 + .3 r**2 and sqrt(2)."""

    def field(u, p):
        a, b = u.x**2 + u.y**2, u.v**2 + u.w**2
        g, h, turn, other = p.m1 - a - 1.5 * b, p.m2 - 2.5 * a - b, 1 + 0.3 * a, math.sqrt(2)
        return g * u.x - turn * u.y, turn * u.x + g * u.y, h * u.v - other * u.w, other * u.v + h * u.w

    problem = AlgebraicProblem(field, ["x", "y", "v", "w"], {"m1": -1.0, "m2": -0.5})
    return hopf_curve(problem, [0] * 4, ["m1", "m2"], (-1, 1)).labelled("HH")[0]


def test_hopf_points_of_the_other_pair_leave_a_double_hopf_point():
    assert double_hopf().curves == ("HB", "TR")
    found = contin.curve(double_hopf(), kind="HB", primary="m1", limits={"m1": (-0.3, 0.3)})
    assert labels(found) == ["HH", "EP"] and found.points[-1]["m1"] == pytest.approx(0.3, abs=1e-12)
    for point in found:
        assert (point["m2"], point["frequency"]) == pytest.approx((0, math.sqrt(2)), abs=1e-10)


@pytest.mark.full
@pytest.mark.parametrize("branch", [0, 1])
def test_torus_bifurcations_leave_a_double_hopf_point(branch):
    """On the cycle r**2 = m1 the other pair is critical at m2 = 2.5 m1, on s**2 = m2 at m1 = 1.5 m2."""
    found = contin.curve(double_hopf(), kind="TR", branch=branch, limits={"m2": (-0.1, 0.1)})
    assert labels(found) == ["EP", "EP"] and found.points[-1]["m2"] == pytest.approx(0.1, abs=1e-12)
    for point in found:
        m1, m2 = point["m1"], point["m2"]
        own, other = (1 + 0.3 * m1, math.sqrt(2)) if branch == 0 else (math.sqrt(2), 1 + 0.3 * 0)
        assert (m2 if branch == 0 else m1) == pytest.approx(2.5 * m1 if branch == 0 else 1.5 * m2, abs=1e-11)
        assert point["period"] == pytest.approx(2 * math.pi / own, abs=1e-9)
        assert math.cos(point["angle"]) == pytest.approx(math.cos(2 * math.pi * other / own), abs=1e-8)


def lorenz84(u, p):
    return (
        -(u.y**2) - u.z**2 - u.x / 4 + p.F / 4, u.x * u.y - 4 * u.x * u.z - u.y + p.G, 4 * u.x * u.y + u.x * u.z - u.z,
    )  # fmt: skip


@pytest.mark.full
def test_of_lorenz_84():
    """The zero-Hopf point by SciPy: trace and determinant vanish. The torus bifurcation at F = 2 on a branch of cycles."""
    from scipy.optimize import fsolve

    def conditions(v):
        x, y, z, force, other = v
        matrix = np.array([[-0.25, -2 * y, -2 * z], [y - 4 * z, x - 1, -4 * x], [4 * y + z, 4 * x, x - 1]])
        rates = -y * y - z * z - x / 4 + force / 4, x * y - 4 * x * z - y + other, 4 * x * y + x * z - z
        return [*rates, np.linalg.det(matrix), np.trace(matrix)]

    known = fsolve(conditions, [1.1, -0.2, 0.5, 1.7, 1.7], xtol=1e-13)
    problem = AlgebraicProblem(lorenz84, ["x", "y", "z"], {"F": 2.0, "G": 0.0})
    line = contin.trace(contin.solve(problem, [2, 0, 0]), free=["G"], limits={"G": (-0.1, 4)})
    (hopf,) = line.labelled("HB")
    (point,) = contin.curve(hopf, free=["G", "F"], direction=-1, limits={"G": (1, 3)}).labelled("ZH")
    assert (point["F"], point["G"]) == pytest.approx((known[3], known[4]), abs=1e-9)
    tori = contin.curve(point, kind="TR", limits={"F": (1, 2)})
    assert labels(tori) == ["EP", "EP"]
    cycles = contin.trace(hopf, branch=1, limits={"G": (1, 3), "period": (0, 30)})
    assert tori.points[-1]["G"] == pytest.approx(cycles.labelled("TR")[0]["G"], abs=1e-8)


# --- going on, and what is refused ----------------------------------------------------------------------------------


def test_a_curve_goes_on_from_one_of_its_points():
    """From the zero-Hopf point along the folds, a = 0."""
    found = contin.curve(zero_hopf(1), limits={"b": (-1, 0.4)})
    assert labels(found) == ["EP", "EP"] and found.points[-1]["b"] == pytest.approx(0.4, abs=1e-12)
    assert max(abs(point["a"]) for point in found) < 1e-10


@pytest.mark.parametrize(
    ("options", "words"),
    [
        ({"kind": "TR"}, "kind: 'TR' must be one of the curves that leave from the start, labelled 'GH': LP"),
        ({"kind": 3}, "kind: 3 must be a name"),
        ({"kind": "LP", "branch": 2}, "branch: 2 must be a whole number"),
        ({"kind": "LP", "free": ["mu", "b"]}, "kind: is for points of codimension two of a curve, without a further parameter"),
    ],
)
def test_what_is_refused(options, words):
    with pytest.raises(ProblemError, match=words):
        contin.curve(bautin(), **options)


def test_a_kind_needs_a_point_of_a_curve():
    problem = AlgebraicProblem(takens, ["x", "y"], {"m": 4.0, "n": -1.0})
    line = contin.trace(contin.solve(problem, [2, 0]), free=["m"], direction=-1, limits={"m": (0.1, 5)})
    assert line.labelled("HB")[0].curves == ()
    with pytest.raises(ProblemError, match="kind: is for points of codimension two of a curve"):
        contin.curve(line.labelled("HB")[0], "n", kind="LP")
    assert np.isfinite(line.labelled("HB")[0]["m"])


# --- stored curves --------------------------------------------------------------------------------------------------


def test_a_stored_curve_goes_on(tmp_path):
    """The Hopf points m = n**2 of Takens's equations: the curve, another one from its end, and a branch of equilibria."""
    problem = AlgebraicProblem(takens, ["x", "y"], {"m": 4.0, "n": -1.0})
    line = contin.trace(contin.solve(problem, [2, 0]), free=["m"], direction=-1, limits={"m": (0.1, 5)})
    found = contin.curve(line.labelled("HB")[0], "n", limits={"n": (-3, 3)})
    contin.save(found, tmp_path / "hopf.npz")
    loaded = contin.load(problem, tmp_path / "hopf.npz")
    assert [(point.label, point["m"], point["frequency"]) for point in loaded] == [
        (point.label, point["m"], point["frequency"]) for point in found
    ]
    middle = next(point for point in loaded if -0.9 < point["n"] < -0.1)
    on = contin.curve(middle, direction=-1, limits={"n": (-2, 3)})
    assert (on.points[-1]["m"], on.points[-1]["n"]) == pytest.approx((4, -2), abs=1e-10)
    folds = contin.curve(loaded.points[-1], kind="LP", limits={"n": (-1, 1)})
    assert labels(folds) == ["BT", "EP"] and max(abs(point["m"]) for point in folds) < 1e-10
    branch = contin.trace(middle, free=["m"], limits={"m": (-1, 5)})
    assert branch.points[-1]["m"] == pytest.approx(5, abs=1e-12) and branch.points[0]["n"] == middle["n"]
    assert contin.solve(problem, middle)["m"] == middle["m"]
    columns = contin.lowlevel.read_columns(tmp_path / "hopf.npz")
    assert columns.columns["m"] == pytest.approx(columns.columns["n"] ** 2, abs=1e-11)
    assert columns.profiles[0][1].shape == (1, 2)


def test_a_stored_curve_of_cycles_goes_on(tmp_path):
    """The folds at b**2 + 4 mu = 0 that leave the generalized Hopf point."""
    found = contin.curve(bautin(), kind="LP", limits={"b": (-1, 0.3)})
    contin.save(found, tmp_path / "folds.npz")
    loaded = contin.load(contin.CycleProblem.of(bautin().system.base.problem), tmp_path / "folds.npz")
    on = contin.curve(loaded.points[-2], limits={"b": (0, 0.6)})
    assert on.points[-1]["b"] == pytest.approx(0.6, abs=1e-12)
    assert max(abs(point["b"] ** 2 + 4 * point["mu"]) for point in on) < 1e-10
    beside = contin.trace(loaded.points[-2], free=["mu"], direction=1, limits={"mu": (-1, 0.2), "max_x": (0, 2)})
    assert beside.points[-1]["b"] == loaded.points[-2]["b"]


def test_hopf_points_from_a_zero_hopf_point_of_a_curve_of_folds():
    """Folds at m = 0, Hopf points at m = -n^2: they touch at the zero-Hopf point, and the Hopf points go on both ways."""

    def field(u, p):
        square = u.y**2 + u.z**2
        return p.m + u.x**2 - square, p.n * u.y - u.z + u.x * u.y, p.n * u.z + u.y + u.x * u.z

    problem = contin.AlgebraicProblem(field, ["x", "y", "z"], {"m": -1.0, "n": 0.5})
    line = contin.trace(contin.solve(problem, [1.0, 0, 0]), free=["m"], limits={"m": (-2, 1)})
    folds = contin.curve(line.labelled("LP")[0], "n", limits={"n": (-1, 1)}, direction=-1)
    (point,) = folds.labelled("ZH")
    for direction in (1, -1):
        hopfs = contin.curve(point, kind="HB", limits={"n": (-1, 1)}, direction=direction)
        assert hopfs.points[0].label == "ZH" and hopfs.points[-1]["n"] == pytest.approx(direction, abs=1e-12)
        assert max(abs(each["m"] + each["n"] ** 2) + abs(each["frequency"] - 1) for each in hopfs.points) < 1e-10


def test_branches_that_cross_where_folds_meet_a_branch_point():
    """b + a x - x^2: folds at a^2 = -4 b; at b = 0 the branches x = 0 and x = a cross."""
    problem = contin.AlgebraicProblem(lambda u, p: (p.b + p.a * u.x - u.x**2,), ["x"], {"a": 1.0, "b": -0.2})
    line = contin.trace(contin.solve(problem, [0.7]), free=["a"], limits={"a": (-2, 2)}, direction=-1)
    folds = contin.curve(line.labelled("LP")[0], "b", limits={"b": (-1, 1)})
    (point,) = folds.labelled("BP")
    slopes = []
    for branch in (0, 1):
        for direction in (1, -1):
            run = contin.trace(point, free=["a"], branch=branch, direction=direction, limits={"a": (-2, 2)})
            assert run.points[0].label == "BP" and abs(abs(run.points[-1]["a"]) - 2) < 1e-12
            slopes.append(round(run.points[-1]["x"] / run.points[-1]["a"], 6) + 0.0)
    assert sorted(slopes) == [0, 0, 1, 1]
    assert contin.trace(point, free=["b"], limits={"b": (-1, 0.5)}).points[-1]["b"] == pytest.approx(0.5)  # a fold in b
