"""Sizes that a run finds: what a limit, an error or a coefficient with a pole must not become, and what other units change."""

import math

import numpy as np
import pytest
from scipy.optimize import brentq
from scipy.special import ellipk, jn_zeros

import contin
from contin import AlgebraicProblem, BoundaryValueProblem, ConnectionProblem, solve, trace
from contin.continuation import scaling


def column(load=1.0, height=1.0):
    """Euler's column u'' + P sin u = 0 between hinges, in units of load and angle: buckling loads (pi k)^2."""
    return BoundaryValueProblem(
        lambda t, u, p: (u.v, -height * p.P / load * math.sin(u.u / height)), lambda a, b, p: (a.u, b.u), ["u", "v"], {"P": 0.0}
    )


def located(branch, name, unit, count):
    """Return the first branch points in a unit, none of them only possible, and the largest of their errors."""
    points = branch.labelled("BP")[:count]
    assert not any("possible" in point.name for point in points)
    return [point[name] / unit for point in points], max(point.errors[name] / unit for point in points)


# --- a limit is no size ----------------------------------------------------------------------------------------------


@pytest.mark.sample(1)
@pytest.mark.parametrize("limit", [1e3, 1e6, 1e10, 1e200, 1.7e308])
@pytest.mark.parametrize("load", [1.0, 1e-6, 1e6])
def test_buckling_loads_whatever_the_limit(limit, load):
    branch = trace(solve(column(load), [0, 0]), free=["P"], limits={"P": (0, max(limit, 1e3 * load))}, max_points=40)
    found, error = located(branch, "P", load, 6)
    assert found == pytest.approx([(math.pi * k) ** 2 for k in range(1, 7)], rel=1e-11) and error < 1e-8


@pytest.mark.sample(1)
@pytest.mark.parametrize("limits", [(-100, 100), (-1e8, 1e8), (-1e200, 1.0)])
def test_buckling_loads_of_negative_sign(limits):
    """The column pulled by -P."""
    problem = BoundaryValueProblem(
        lambda t, u, p: (u.v, p.P * math.sin(u.u)), lambda a, b, p: (a.u, b.u), ["u", "v"], {"P": 0.0}
    )
    branch = trace(solve(problem, [0, 0]), free=["P"], direction=-1, limits={"P": limits}, max_points=25)
    assert located(branch, "P", -(math.pi**2), 3)[0] == pytest.approx([1, 4, 9], rel=1e-11)


@pytest.mark.sample(2)
@pytest.mark.parametrize("limit", [20.0, 1e6, 1e200])
@pytest.mark.parametrize("coupled", [False, True])
def test_branch_points_of_equilibria_whatever_the_limit(limit, coupled):
    """x_k (a - k^2) = x_k^3, each of its own or with a linear coupling to the next: branch points at 1, 4, 9, 16."""
    names = ["x1", "x2", "x3", "x4"]

    def residual(u, p):
        rates = [(p.a - (k + 1) ** 2) * u[k] - u[k] ** 3 for k in range(4)]
        return [rates[k] + (u[k + 1] if coupled and k < 3 else 0) for k in range(4)]

    problem = AlgebraicProblem(residual, names, {"a": 0.0})
    branch = trace(solve(problem, [0.0] * 4), free=["a"], limits={"a": (0, limit)}, max_points=60)
    found, error = located(branch, "a", 1.0, 9)
    assert found == pytest.approx([1, 4, 9, 16], rel=1e-11) and error < 1e-11


@pytest.mark.parametrize("critical", [1e-3, 0.1, 2.0, 1e6])
def test_a_limit_that_equals_the_critical_value(critical):
    problem = AlgebraicProblem(lambda u, p: ((p.a - critical) * u.x - u.x**3,), ["x"], {"a": 0.0})
    branch = trace(solve(problem, [0.0]), free=["a"], limits={"a": (0, critical)})
    assert branch.points[-1]["a"] == pytest.approx(critical, rel=1e-12) and branch.points[-1].errors["a"] < 1e-12 * critical
    assert all(point["a"] == pytest.approx(critical) for point in branch.labelled("BP"))


def test_the_limit_of_a_column_at_its_buckling_load():
    branch = trace(solve(column(), [0, 0]), free=["P"], limits={"P": (0, math.pi**2)})
    assert branch.points[-1].errors["P"] < 1e-11 and branch.points[-1]["P"] == pytest.approx(math.pi**2, rel=1e-12)


def test_a_linear_problem_reaches_a_generous_limit():
    """x = a / 1e3: nothing shows a size. The steps grow."""
    problem = AlgebraicProblem(lambda u, p: (1e3 * u.x - p.a,), ["x"], {"a": 0.0})
    branch = trace(solve(problem, [0.0]), free=["a"], limits={"a": (0, 1e9)})
    assert str(branch.stop) == "reached a = 1e+09" and branch.points[-1]["x"] == pytest.approx(1e6, rel=1e-12)


# --- sizes of order one are not looked for ------------------------------------------------------------------------------


def expanded(batch):
    """Return whether derivatives of second order were made, as the Taylor expansion needs them."""
    return any(getattr(request, "order", 0) > 1 for request in batch.recorded.kept)


def test_usual_sizes_need_no_expansion():
    bratu = BoundaryValueProblem(
        lambda t, u, p: (u.v, -p.lam * math.exp(u.u)), lambda a, b, p: (a.u, b.u), ["u", "v"], {"lam": 0.0}
    )
    branch = trace(solve(bratu, [0, 0]), free=["lam"], limits={"lam": (0, 4)}, max_points=20)
    assert branch.labelled("LP")[0]["lam"] == pytest.approx(3.513830719125161, rel=1e-12)
    assert branch[0].system.scales.are_one and not expanded(bratu.batch("field"))


def chua(u, p):
    """Chua's circuit, whose current y is zero at all equilibria: no term of an expansion moves it."""
    return p.alpha * (u.y - u.x**3 / 16 + u.x / 6), u.x - u.y + u.z, -14.0 * u.y


def turning(u, p):
    """The difference d of two pendula: sin(4 d) is as far from linear for 1 as for 1000."""
    return p.alpha - u.x**2 + u.d**2, math.sin(4 * u.d) - u.z * u.d, u.x - 2 * u.z


def linear(u, p):
    """Two states with a factor that is not linear: their modes at alpha = 8 and 10 have no amplitude."""
    return p.alpha - u.x**2, (u.x**2 - 9) * u.u + u.v, u.u + (u.x**2 - 9) * u.v


@pytest.mark.parametrize(("field", "names", "guess"), [
    (chua, ["x", "y", "z"], [math.sqrt(8 / 3), 0.0, -math.sqrt(8 / 3)]), (turning, ["x", "d", "z"], [1.0, 0.0, 0.5]),
    (linear, ["x", "u", "v"], [1.0, 0.0, 0.0]),
])  # fmt: skip
def test_states_that_stay_zero_need_no_expansion(field, names, guess):
    problem = AlgebraicProblem(field, names, {"alpha": 1.0}, dynamics=False)
    branch = trace(solve(problem, guess), free=["alpha"], limits={"alpha": (0.5, 3)})
    assert branch[0].system.scales.are_one and not expanded(problem.batch("residual"))
    assert branch[-1]["alpha"] == 3 and branch[-1][names[1]] == pytest.approx(0.0, abs=1e-12)


@pytest.mark.parametrize("load", [1.0, 0.06, 125.0])
@pytest.mark.parametrize("height", [1.1e-3, 6e3, 1e6])
def test_one_unusual_amplitude_is_found(load, height):
    """The load has a usual size; that of the state shows only far from zero, or very near to it: x = height at a = 2 load."""
    problem = AlgebraicProblem(lambda u, p: ((p.a / load - 1) * u.x - u.x * (u.x / height) ** 2,), ["x"], {"a": 0.0})
    rest = trace(solve(problem, [0.0]), free=["a"], limits={"a": (0, 2 * load)})
    assert [point["a"] / load for point in rest.labelled("BP")] == pytest.approx([1.0], rel=1e-12)
    fork = trace(rest.labelled("BP")[0], branch=1, limits={"a": (0, 2 * load)})
    assert fork.stop.reason == "limit" and abs(fork.points[-1]["x"]) == pytest.approx(height, rel=1e-9)


# --- amplitudes ------------------------------------------------------------------------------------------------------


@pytest.mark.sample(1)
@pytest.mark.parametrize(("load", "height"), [(1.0, 1e-8), (1e6, 1e-5), (1e-7, 1e7), (1e9, 1e9)])
def test_the_amplitude_of_a_buckled_column_is_found(load, height):
    """The same branch in all units: at P = 20 its slopes at the hinges are those of the column with P = 20 in units of one.

    Hinges are mesh points: inside intervals solutions are known to 4e-9, and meshes may differ.
    """
    ends = []
    for of_load, of_height in ((1.0, 1.0), (load, height)):
        limits = {"P": (0, 20 * of_load)}
        straight = trace(solve(column(of_load, of_height), [0, 0]), free=["P"], limits=limits)
        buckled = trace(straight.labelled("BP")[0], branch=1, limits=limits)
        assert buckled.stop.reason == "limit"
        last = buckled.points[-1]
        ends.append(np.abs(last.system.evaluate(last.x, np.array([0.0, 1.0]))) / of_height)
    assert ends[1] == pytest.approx(ends[0], rel=1e-9, abs=1e-10)


@pytest.mark.sample(4)
@pytest.mark.parametrize("power", [2, 3, 4, 5])
@pytest.mark.parametrize("size", [1e-7, 1.0, 1e8])
def test_branches_that_leave_as_a_power(power, size):
    """a = (x / size)^(power - 1) crosses x = 0 at a = 0."""
    problem = AlgebraicProblem(lambda u, p: (p.a * u.x - u.x * (u.x / size) ** (power - 1),), ["x"], {"a": -1.0})
    rest = trace(solve(problem, [0.0]), free=["a"], limits={"a": (-1, 1)})
    assert [point["a"] for point in rest.labelled("BP")] == pytest.approx([0.0], abs=1e-12)
    fork = trace(rest.labelled("BP")[0], branch=1, limits={"a": (-1, 1)})
    assert fork.stop.reason == "limit" and abs(fork.points[-1]["x"]) == pytest.approx(size, rel=1e-9)


@pytest.mark.sample(3)
@pytest.mark.parametrize("seed", range(12))
def test_random_elasticas(seed):
    """theta' = c0 m, m' = -P c1 sin theta (1 + e cos theta), y' = c2 sin theta, clamped and free: P = (k - 1/2)^2 pi^2 unit.

    The sizes are powers of two near one, as the constants are.
    """
    random = np.random.default_rng(seed)
    c, e = 10.0 ** random.uniform(-1, 1, 3), random.uniform(-0.2, 1)
    unit = math.pi**2 / (c[0] * c[1] * (1 + e))
    problem = BoundaryValueProblem(
        lambda t, u, p: (c[0] * u.m, -p.P * c[1] * math.sin(u.th) * (1 + e * math.cos(u.th)), c[2] * math.sin(u.th)),
        lambda a, b, p: (a.th, b.m, a.y), ["th", "m", "y"], {"P": 0.0},
    )  # fmt: skip
    branch = trace(solve(problem, [0, 0, 0]), free=["P"], limits={"P": (0, 7 * unit)})
    assert located(branch, "P", unit, 9)[0] == pytest.approx([0.25, 2.25, 6.25], rel=1e-10)
    scales = branch.points[0].system.scales
    assert np.all(np.abs(np.log2([*scales.states, *scales.parameters])) <= 13)


# --- coefficients with a pole ----------------------------------------------------------------------------------------


@pytest.mark.sample(1)
@pytest.mark.parametrize("load", [0.0, 5.0])
@pytest.mark.parametrize("heated", [False, True])
def test_a_clamped_circular_plate(load, heated):
    """Von Karman's plate, compressed at its edge or heated, buckles at the squares of zeros of J_1; 1 / r^2 has a pole."""

    def rhs(t, u, p):
        thermal = p.P * u.f if heated else 0.0
        return u.w, -u.w / t + u.f / t**2 - thermal + u.f * u.g / t, u.h, -u.h / t + u.g / t**2 - u.f**2 / (2 * t)

    edge = (lambda a, b, p: (a.f, b.f, a.g, b.g)) if heated else (lambda a, b, p: (a.f, b.f, a.g, b.g + p.P))
    problem = BoundaryValueProblem(rhs, edge, ["f", "w", "g", "h"], {"P": load})
    guess = (lambda t: (0, 0, 0, 0)) if heated else (lambda t: (0, 0, -load * t, -load))
    flat = trace(solve(problem, guess), free=["P"], limits={"P": (0, 60)})
    assert located(flat, "P", 1.0, 9)[0] == pytest.approx(jn_zeros(1, 2) ** 2, rel=1e-9)
    buckled = trace(flat.labelled("BP")[0], branch=1, limits={"P": (0, 60)})
    assert str(buckled.stop) == "reached P = 60"


# --- values that are nothing but errors ------------------------------------------------------------------------------


def sandstede(u, p):
    """AUTO-07p's demos `san` and `sib`: at mu = 0 the orbit on x^2 (1 - x) = y^2, z = 0 is homoclinic with nu = 0."""
    leaf = p.nu - p.alpha * u.z
    return (
        p.a * u.x + u.y - p.a * u.x**2 + leaf * u.x * (2 - 3 * u.x),
        u.x + p.a * u.y - 1.5 * u.x**2 - 1.5 * p.a * u.x * u.y - 2 * leaf * u.y,
        p.c * u.z + p.mu * u.x + p.gamma * u.x * u.z + p.alpha * p.beta * (u.x**2 * (1 - u.x) - u.y**2),
    )


def leaf(half_time):
    """The orbit at a = 0."""

    def orbit(t):
        x = 1 / math.cosh(half_time * (t - 0.5)) ** 2
        return x, -x * math.tanh(half_time * (t - 0.5)), 0

    return orbit


ORBITS = [
    ("alpha", (0, 1), {"alpha": 0.0, "gamma": 0.0}),
    ("c", (-3, -1), {"alpha": 1.0, "gamma": 3.0}),
    ("c", (-3, -1), {"alpha": 0.5, "gamma": 3.0, "a": 0.375}),
    ("a", (-0.3, 0.3), {"alpha": 1.0, "gamma": 0.0}),
    ("gamma", (0, 2), {"alpha": 1.0, "gamma": 1.0, "beta": 0.0}),
]


@pytest.mark.full
@pytest.mark.parametrize(("name", "limits", "numbers"), ORBITS)
@pytest.mark.parametrize("direction", [1, -1])
def test_unfolding_parameters_that_are_zero(name, limits, numbers, direction):
    """The orbit is there for all values of a, c, alpha, beta, gamma: nu stays zero, z is zero but for errors."""
    values = {"a": 0.0, "c": -2.0, "alpha": 0.0, "beta": 1.0, "gamma": 0.0, "mu": 0.0, "nu": 0.0}
    problem = ConnectionProblem(sandstede, ["x", "y", "z"], {**values, **numbers}, unstable=1)
    found = solve(problem, leaf(20), {"time": 40}, free=["nu"])
    branch = trace(found, free=[name, "nu"], limits={name: limits}, direction=direction)
    end = limits[direction > 0]
    assert str(branch.stop) == f"reached {name} = {end:g}" or found[name] == end
    assert len(branch) < 30 and max(abs(branch.column("nu"))) < 1e-9
    assert abs(branch.points[-1].system.states(branch.points[-1].x)[:, 2]).max() < 1e-7


def test_what_cutting_off_an_infinite_time_leaves_is_no_size(monkeypatch):
    """The orbit does not move with alpha, but for 1e-9 of z: a search must not take that for the size of z."""
    values = {"a": 0.0, "c": -2.0, "alpha": 0.0, "beta": 1.0, "gamma": 0.0, "mu": 0.0, "nu": 0.0}
    orbit = solve(ConnectionProblem(sandstede, ["x", "y", "z"], values, unstable=1), leaf(10), {"time": 20}, free=["nu"])
    first = trace(orbit, free=["a", "nu"], limits={"a": (-0.5, 0.25)}, scales={"a": 1.0})
    monkeypatch.setattr(scaling._FirstPoint, "usual", lambda *_: False)
    branch = trace(first[-1], free=["alpha", "nu"], limits={"alpha": (-1, 1.6952)})
    assert branch[0].system.scales.are_one and len(branch) < 12
    assert [point.label for point in branch if point.label] == ["EP", "IFS", "EP"]


def test_round_off_in_a_boundary_condition_is_no_size():
    """u(1) = sin(pi) = 1.2e-16 in place of zero: the same buckling loads, and the same buckled column."""
    problem = BoundaryValueProblem(
        lambda t, u, p: (u.v, -p.P * math.sin(u.u)), lambda a, b, p: (a.u, b.u - math.sin(math.pi)), ["u", "v"], {"P": 2.0}
    )
    branch = trace(solve(problem, [0, 0]), free=["P"], limits={"P": (2, 50)})
    assert branch.points[0].system.scales.are_one
    assert located(branch, "P", math.pi**2, 3)[0] == pytest.approx([1, 4], rel=1e-9)


def test_a_parameter_that_is_an_error_and_becomes_free():
    """nu = 3e-17 is an error of an earlier solution. The run has no size for it; the fold is followed in it."""
    problem = AlgebraicProblem(lambda u, p: (p.a - u.x**2 - p.nu,), ["x"], {"a": 1.0, "nu": 3e-17})
    branch = trace(solve(problem, [1.0]), free=["a"], direction=-1, limits={"a": (-1, 2)})
    folds = contin.curve(branch.labelled("LP")[0], "nu", limits={"nu": (-1, 1)})
    assert str(folds.stop) == "reached nu = 1" and len(folds) < 40
    assert folds.column("a") == pytest.approx(folds.column("nu"), abs=1e-12)


# --- small closed curves beside states of order one -------------------------------------------------------------------

#: Equations of a closed curve of radius r, other unknowns, and the states at a = 0.
SMALL = {
    "circle": (lambda u, p, r: (u.x**2 + p.a**2 - r**2, u.y - 1 - p.a), lambda r: {"x": r, "y": 1.0}),
    "ellipse": (lambda u, p, r: (u.x**2 / 9 + p.a**2 - r**2, u.y - math.exp(p.a)), lambda r: {"x": 3 * r, "y": 1.0}),
    "sphere and plane": (
        lambda u, p, r: (u.x**2 + u.z**2 + p.a**2 - r**2, u.z - u.x, u.y - math.cos(u.x)),
        lambda r: {"x": r / math.sqrt(2), "z": r / math.sqrt(2), "y": 1.0},
    ),
    "loop beside three": (
        lambda u, p, r: (u.x**2 + p.a**2 - r**2, u.y - 1 - u.x, u.z - u.y**2, u.w - u.z * u.y),
        lambda r: {"x": r, "y": 1 + r, "z": (1 + r) ** 2, "w": (1 + r) ** 3},
    ),
}


@pytest.mark.sample(4)
@pytest.mark.parametrize("radius", [1e-3, 1e-5, 1e-7, 1e-9])
@pytest.mark.parametrize("kind", SMALL)
def test_small_closed_curves(kind, radius):
    """Where the curve is flat in a, only the second term of x shows the size of a. Folds at a = radius and -radius."""
    law, states = SMALL[kind]
    first = states(radius)
    problem = AlgebraicProblem(lambda u, p: law(u, p, radius), list(first), {"a": 0.0})
    branch = trace(solve(problem, list(first.values())), free=["a"], limits={"a": (-1, 1)})
    assert [point.label for point in branch if point.label] == ["EP", "LP", "LP", "EP"] and not branch.notes
    assert str(branch.stop) == "the branch closed on its first point"
    assert [point["a"] / radius for point in branch.labelled("LP")] == pytest.approx([1, -1], rel=1e-9)
    for point in branch:
        x, a = point["x"] / first["x"], point["a"] / radius
        assert x**2 + a**2 == pytest.approx(1, abs=1e-9)


@pytest.mark.parametrize("radius", [1e-3, 1e-5, 1e-7])
def test_a_small_closed_curve_of_a_boundary_value_problem(radius):
    """x' = 0 with x(0)^2 + a^2 = r^2, beside y'' = -pi^2 y / 4 with y(0) = 0, y(1) = 1 + a."""
    problem = BoundaryValueProblem(
        lambda t, u, p: (0 * u.x, u.v, -(math.pi**2) / 4 * u.y),
        lambda a, b, p: (a.x**2 + p.a**2 - radius**2, a.y, b.y - 1 - p.a), ["x", "y", "v"], {"a": 0.0},
    )  # fmt: skip
    start = solve(problem, lambda t: (radius, math.sin(math.pi * t / 2), math.pi / 2 * math.cos(math.pi * t / 2)))
    branch = trace(start, free=["a"], limits={"a": (-1, 1)})
    assert [point.label for point in branch if point.label] == ["EP", "LP", "LP", "EP"]
    assert [point["a"] / radius for point in branch.labelled("LP")] == pytest.approx([1, -1], rel=1e-9)


@pytest.mark.sample(1)
@pytest.mark.parametrize("seed", range(4))
def test_states_of_modes_that_are_close(seed):
    """Branches leave at eigenvalues that differ by a tenth, at an amplitude of 1e-9: the branch points are the eigenvalues."""
    random, count = np.random.default_rng(seed), 12
    basis = np.linalg.qr(random.standard_normal((count, count)))[0]
    loads = 1.1 ** np.arange(count)
    matrix = basis @ np.diag(loads) @ basis.T
    problem = AlgebraicProblem(lambda u, p: p.lam * u + 1e9 * u * u - 1e18 * u**3 - matrix @ u, count, {"lam": 0.0})
    branch = trace(solve(problem, [0.0] * count), free=["lam"], limits={"lam": (-1, 3)})
    found, error = located(branch, "lam", 1.0, count)
    assert found == pytest.approx(loads, rel=1e-12) and error < 1e-11 and not branch.notes
    assert np.all(branch[0].system.scales.states < 1e-7)


@pytest.mark.parametrize("load", [8.0, 8.5, 9.0, 9.5])
def test_what_other_modes_leave_is_no_size(load, monkeypatch):
    """The force across a column is zero by symmetry, but for 1e-13 of other modes: its size was 6e-11, P = pi^2 lost."""
    column = contin.VariationalProblem(
        energy=lambda t, x, w, p: w.angle**2 / 2 + p.P * math.cos(x.angle), states=["y", "angle"], parameters={"P": load},
        kinematics=lambda t, x, w, p: (math.sin(x.angle), w.angle), controls=["angle"], ends=lambda a, b, p: (a.y, b.y),
    )  # fmt: skip
    monkeypatch.setattr(scaling._FirstPoint, "usual", lambda *_: False)  # which some draws do not see
    branch = trace(solve(column, [0, 0]), free=["P"], limits={"P": (load, 12)})
    assert branch[0].system.scales.are_one
    assert [point["P"] for point in branch.labelled("BP")] == pytest.approx([math.pi**2], rel=1e-12)


@pytest.mark.parametrize("height", [0.02, 0.05])
def test_a_branch_that_begins_where_the_load_has_grown(height):
    """The trivial branch begins at a load of .008, and branches turn off at 8: steps are as long as the new load allows."""
    start = solve(column(0.8, height), [0, 0], {"P": 0.008})
    first = trace(start, free=["P"], limits={"P": (0, 20)}).labelled("BP")[0]
    assert first["P"] == pytest.approx(0.8 * math.pi**2, rel=1e-11)
    bent = trace(first, branch=1, limits={"P": (0, 12)})
    assert str(bent.stop) == "reached P = 12" and not bent.notes and len(bent) < 40
    slope = bent[-1].system.states(bent[-1].x)[0, 1]
    half = 0.5 * slope**2 / height**2 / (12 / 0.8)  # v^2 / 2 = P (1 - cos(largest angle)) where u = 0
    assert pytest.approx((2 * ellipk(half / 2)) ** 2, rel=1e-9) == 12 / 0.8


@pytest.mark.full
def test_round_off_of_sums_that_cancel_is_no_size():
    """A multiplier of a shallow arch is zero, a sum of two others: what is left of them moves neither with x nor with them."""
    arch = contin.VariationalProblem(
        energy=lambda t, x, w, p: (w.bend + p.e * math.sin(t)) ** 2 / 2 + x.P**2 / 8 + p.q * x.y * math.sin(t),
        states=["y", "slope", "P"], parameters={"e": 3.0, "q": 0.0}, kinematics=lambda t, x, w, p: (x.slope, w.bend, 0),
        controls=["bend"], ends=lambda a, b, p: (a.y, b.y),
        integrals={"thrust": lambda t, x, w, p: (p.e * math.cos(t)) ** 2 - x.slope**2 - x.P / 2}, domain=(0, math.pi),
    )  # fmt: skip
    for e in np.linspace(2.5, 3.5, 8):
        start = solve(arch, lambda t, e=e: (e * math.sin(t), e * math.cos(t), 0), parameters={"e": e})
        point = trace(start, free=["q"], limits={"q": (-7, 14)}, max_points=2)[-1]
        assert point.system.scales.are_one


@pytest.mark.parametrize("count", [1, 2])
@pytest.mark.parametrize("resistance", [1e-3, 1.0, 1e3, 1e6])
def test_diodes_in_series_with_a_resistor(count, resistance):
    """At V = -1 the current is 1e-14 and its exponential a line; i R + count 0.025 log(1 + i / 1e-14) = V by brentq."""

    def residual(u, p):
        drops = [*u[1:], p.V - sum(u[1:]) - u[0] * resistance]
        return [u[0] - 1e-14 * (math.exp(drop / 0.025) - 1) for drop in drops]

    diodes = contin.AlgebraicProblem(residual, ["i", "v"][:count], {"V": -1.0})
    branch = contin.trace(contin.solve(diodes, [0.0] * count), free=["V"], limits={"V": (-1, 2)})
    assert not branch.notes and [point.label for point in branch if point.label] == ["EP", "EP"] and len(branch) < 80
    for point in branch:
        if point["V"] > 0.1:
            volts = lambda i: i * resistance + count * 0.025 * math.log1p(i / 1e-14) - point["V"]  # noqa: B023, E731
            exact = brentq(volts, 0, 2 / resistance, xtol=1e-300, rtol=1e-15)
            assert abs(point["i"] - exact) < 5e-12 * (1 + exact / 0.025)  # the tolerance is 1e-12 (1 + V) of V, too
    assert branch[-1]["i"] == pytest.approx(exact, rel=1e-12, abs=1e-12)
