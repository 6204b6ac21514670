"""Stability in time of steady states of fields: eigenvalues on the mesh, Hopf points, counts at folds and branch points."""

import math
import pickle

import numpy as np
import pytest
import scipy.linalg
from scipy.special import ellipj, ellipk

import contin
from contin.errors import ProblemError


def dirichlet(a, b, p):
    return a.u, b.u


def neumann(a, b, p):
    return a.v, b.v


def first_order(t, u, w, p):
    return w.u


def trace(problem, guess, name, ends, **options):
    start = contin.solve(problem, guess, {name: ends[0]})
    return contin.trace(start, free=[name], limits={name: ends}, **options)


def unstable(point):
    return point.system.unstable(point.x)


HEAT = contin.BoundaryValueProblem(
    lambda t, u, p: (u.v, -p.a * u.u), dirichlet, ["u", "v"], {"a": 0.0}, rates={"v": first_order}
)


def test_eigenvalues_of_the_heat_equation_with_their_errors():
    spectrum = contin.solve(HEAT, [0, 0], {"a": 20.0}, intervals=6, degree=4).spectrum()
    exact = 20 - (np.arange(1, 13) * math.pi) ** 2
    off = np.abs(spectrum.values[:12] - exact)
    assert np.all(off <= spectrum.errors[:12]) and np.all(spectrum.errors[:5] < 1e-2) and off[0] < 1e-9
    assert spectrum.unstable == 1 and not spectrum.stable and np.all(spectrum.values.imag == 0)


@pytest.mark.parametrize("degree", [2, 3, 4, 5, 6, 7])
def test_no_mesh_makes_unstable_eigenvalues(degree):
    """Of the 3 d rates at Gauss points one is given by the conditions; the others have an eigenvalue each."""
    mesh = np.cumsum(np.append(0, np.random.default_rng(degree).uniform(0.1, 1, 3)))
    system = HEAT.discretized([], {}, None, mesh=(mesh - mesh[0]) / (mesh[-1] - mesh[0]), degree=degree)
    values = system.eigenvalues(np.zeros(system.size))
    assert len(values) == 3 * degree - 1 and np.all(values.real < 0)


def test_a_weight_that_depends_on_the_place():
    """u_t = (1 + x)^2 u'' + a u: with s = log(1 + x) it has constant coefficients, z = a - 1/4 - (n pi / log 2)^2."""
    problem = contin.BoundaryValueProblem(
        lambda t, u, p: (u.v, -p.a * u.u / (1 + t) ** 2), dirichlet, ["u", "v"], {"a": 1.0},
        rates={"v": lambda t, u, w, p: w.u / (1 + t) ** 2},
    )  # fmt: skip
    spectrum = contin.solve(problem, [0, 0]).spectrum()
    exact = 1 - 0.25 - (np.arange(1, 5) * math.pi / math.log(2)) ** 2
    assert np.all(np.abs(spectrum.values[:4] - exact) <= spectrum.errors[:4]) and spectrum.errors[0] < 1e-8


BRATU = contin.BoundaryValueProblem(
    lambda t, u, p: (u.v, -p.lam * math.exp(u.u)), dirichlet, ["u", "v"], {"lam": 0.0},
    functionals={"mean": lambda t, u, p: u.u}, rates={"v": first_order},
)  # fmt: skip


def test_one_eigenvalue_passes_zero_at_the_fold_of_bratu():
    branch = contin.trace(contin.solve(BRATU, [0, 0]), free=["lam"], limits={"mean": (-1, 4)})
    (fold,) = branch.labelled("LP")
    at = branch.points.index(fold)
    assert {unstable(point) for point in branch.points[:at]} == {0}
    assert {unstable(point) for point in branch.points[at + 1 :]} == {1}
    spectrum = fold.spectrum()
    assert abs(spectrum.values[0]) <= spectrum.errors[0] < 1e-8
    assert not branch.labelled("HB")


# --- Allen-Cahn: u_t = u'' + u - u^3 on (0, L) with u = 0 at the ends --------------------------------------------------

ALLEN_CAHN = contin.BoundaryValueProblem(
    lambda t, u, p: (u.v, -p.square * (u.u - u.u**3)), dirichlet, ["u", "v"], {"square": 1.0},
    functionals={"size": lambda t, u, p: u.u**2}, rates={"v": lambda t, u, w, p: p.square * w.u},
)  # fmt: skip


@pytest.mark.full
def test_counts_of_allen_cahn_and_its_closed_form():
    """Zero has the eigenvalues 1 - (n pi / L)^2. Of the branch with n half waves n - 1 are unstable (Chafee & Infante)."""
    zero = trace(ALLEN_CAHN, [0, 0], "square", (1.0, 100.0))
    branchings = zero.labelled("BP")
    assert [point["square"] for point in branchings] == pytest.approx([(n * math.pi) ** 2 for n in (1, 2, 3)], rel=1e-9)
    for point in zero:
        if point.label != "BP":
            expected = 1 - (np.arange(1, 7) * math.pi) ** 2 / point["square"]
            assert np.allclose(point.system.eigenvalues(point.x)[:6], expected, rtol=1e-6)
    for n, branching in enumerate(branchings, 1):
        waves = contin.trace(branching, branch=1, limits={"square": (1, 100)}, direction=1)
        assert {unstable(point) for point in waves if point.label != "BP"} == {n - 1}


def test_half_a_wave_of_allen_cahn_has_eigenvalues_of_lame_s_equation():
    """u = k b sn(b x | m), b^2 = 1 / (1 + m), k^2 = 2 m: v'' + (1 - 6 m b^2 sn^2) v = z v with v' = 0 where cn = 0.

    Lame's functions of degree 2 that satisfy that are sn dn, and sn^2 less a constant (Whittaker & Watson, chapter 23).
    """
    m = 0.5
    b, quarter, root = 1 / math.sqrt(1 + m), ellipk(m), math.sqrt(1 - m + m * m)
    problem = contin.BoundaryValueProblem(
        lambda t, u, p: (u.v, -u.u + u.u**3), neumann, ["u", "v"], {}, rates={"v": first_order},
        domain=(-quarter / b, quarter / b),
    )  # fmt: skip

    def wave(t):
        sn, cn, dn, _ = ellipj(b * t, m)
        return math.sqrt(2 * m) * b * sn, math.sqrt(2 * m) * b * b * cn * dn

    spectrum = contin.solve(problem, wave).spectrum()
    known = 1 - b**2 * np.array([2 * (1 + m - root), 1 + 4 * m, 2 * (1 + m + root)])
    assert np.all(np.abs(spectrum.values[:3] - known) <= spectrum.errors[:3]) and spectrum.errors[0] < 1e-8
    assert spectrum.unstable == 1


# --- the Brusselator on a line, the ends closed ------------------------------------------------------------------------

A, DX, DY = 2.0, 0.008, 0.004


def brusselator(t, u, p):
    grown = u.x**2 * u.y
    return u.dx, -(p.a - (p.b + 1) * u.x + grown) / DX, u.dy, -(p.b * u.x - grown) / DY


BRUSSELATOR = contin.BoundaryValueProblem(
    brusselator, lambda a, b, p: (a.dx, b.dx, a.dy, b.dy), ["x", "dx", "y", "dy"], {"a": A, "b": 4.5},
    rates={"dx": lambda t, u, w, p: w.x / DX, "dy": lambda t, u, w, p: w.y / DY},
    functionals={"mean": lambda t, u, p: u.x},
)  # fmt: skip


def uniform(b):
    return contin.solve(BRUSSELATOR, [A, 0, b / A, 0], {"b": b})


def test_hopf_points_of_the_brusselator_are_in_order_and_where_the_closed_form_has_them():
    """Mode n turns at b = 1 + a^2 + (DX + DY) (n pi)^2, with the square of the frequency det J (Nicolis & Prigogine 1977)."""
    branch = contin.trace(uniform(4.5), free=["b"], limits={"b": (4.5, 6.2)})
    found = branch.labelled("HB")
    assert len(found) == 4 and branch.notes == []
    for n, point in enumerate(found):
        q = (n * math.pi) ** 2
        b = 1 + A**2 + (DX + DY) * q
        determinant = (b - 1 - DX * q) * (-(A**2) - DY * q) + b * A**2
        assert abs(point["b"] - b) <= point.errors["b"] + 1e-11
        assert point.details["frequency"] == pytest.approx(math.sqrt(determinant), rel=1e-9)
    counts = [unstable(point) for point in branch if point.label != "HB"]
    assert counts[0] == 0 and counts[-1] == 8 and counts == sorted(counts)


def lines(n):
    """The same with differences at n nodes: equilibria of 2 n ordinary differential equations."""
    h = 1 / (n - 1)

    def field(u, p, out):
        for i in range(n):
            x, y = u[i], u[n + i]
            left, right = (i - 1 if i else 1), (i + 1 if i < n - 1 else n - 2)
            grown = x**2 * y
            out[i] = DX / h**2 * (u[left] - 2 * x + u[right]) + p[0] - (p[1] + 1) * x + grown
            out[n + i] = DY / h**2 * (u[n + left] - 2 * y + u[n + right]) + p[1] * x - grown

    names = [*(f"x{i}" for i in range(n)), *(f"y{i}" for i in range(n))]
    return contin.AlgebraicProblem(field, names, {"a": A, "b": 5.05}, count=2 * n)


@pytest.mark.full
def test_lyapunov_coefficients_are_those_of_the_reaction_and_of_the_method_of_lines():
    """The uniform mode is that of the reaction. cos(pi s) has the mean square 1/2; its squares at n nodes add to (n + 1)/2."""
    uniform_mode, first = contin.trace(uniform(4.9), free=["b"], limits={"b": (4.9, 5.2)}).labelled("HB")
    reaction = contin.AlgebraicProblem(
        lambda u, p: (p.a - (p.b + 1) * u.x + u.x**2 * u.y, p.b * u.x - u.x**2 * u.y), ["x", "y"], {"a": A, "b": 4.9}
    )
    (alone,) = trace(reaction, [A, 2.45], "b", (4.9, 5.2)).labelled("HB")
    assert uniform_mode.normal_form == pytest.approx(alone.normal_form, rel=1e-10)
    found = []
    for n in (9, 17):
        (point,) = trace(lines(n), [A] * n + [2.525] * n, "b", (5.05, 5.2)).labelled("HB")
        found.append((n + 1) * point.normal_form)
    assert first.normal_form == pytest.approx((4 * found[1] - found[0]) / 3, rel=1e-4)
    assert first.name == "Hopf, supercritical"


@pytest.mark.full
def test_a_curve_of_hopf_points_in_two_parameters_of_which_one_is_a_diffusivity():
    def field(t, u, p):
        grown = u.x**2 * u.y
        return u.dx, -(p.a - (p.b + 1) * u.x + grown) / p.d, u.dy, -2 * (p.b * u.x - grown) / p.d

    problem = contin.BoundaryValueProblem(
        field, lambda a, b, p: (a.dx, b.dx, a.dy, b.dy), ["x", "dx", "y", "dy"], {"a": A, "b": 5.05, "d": 0.008},
        rates={"dx": lambda t, u, w, p: w.x / p.d, "dy": lambda t, u, w, p: 2 * w.y / p.d},
    )  # fmt: skip
    (point,) = trace(problem, [A, 0, 2.525, 0], "b", (5.05, 5.2)).labelled("HB")
    for second, limits in (("d", (0.002, 0.012)), ("a", (1.5, 2.5))):
        hopf = contin.curve(point, second, limits={second: limits})
        for each in hopf:
            known = 1 + each["a"] ** 2 + 1.5 * each["d"] * math.pi**2
            assert each["b"] == pytest.approx(known, abs=1e-8) and each["lyapunov"] < 0
    system, x = hopf[0].system, hopf[0].x + 1e-3 * np.random.default_rng(3).standard_normal(hopf[0].x.size)
    along = np.random.default_rng(4).standard_normal(x.size)
    steps = [system.own_values(x + s * along) for s in (1e-6, -1e-6)]
    assert np.allclose(system.own_gradients(x) @ along, (steps[0] - steps[1]) / 2e-6, rtol=1e-5)


def test_a_long_mesh_gives_the_eigenvalues_that_a_short_one_does():
    short, long = (BRUSSELATOR.discretized([], {"b": 5.5}, None, np.linspace(0, 1, n + 1), 4) for n in (20, 130))
    assert not short.is_sparse and long.is_sparse
    few, many = (system.eigenvalues(system.pack([[A, 0, 2.75, 0]] * len(system.nodes), {})) for system in (short, long))
    unstable_ones = few[few.real > 0]
    assert len(unstable_ones) == 6 == np.count_nonzero(many.real > 0)
    assert np.abs(many[:, None] - unstable_ones).min(axis=0).max() < 1e-9
    x = long.pack([[A, 0, 2.75, 0]] * len(long.nodes), {})
    assert abs(long.eigenvalue_near(x, 0.2 + 2j) - few[np.abs(few - 0.2 - 2j).argmin()]) < 1e-9


# --- Swift & Hohenberg: fourth order ------------------------------------------------------------------------------------

SNAKE = contin.BoundaryValueProblem(
    lambda t, u, p: (u.b, u.c, u.d, (p.r - 1) * u.u - 2 * u.c + 1.8 * u.u**2 - u.u**3),
    lambda a, b, p: (a.b, a.d, b.b, b.d), ["u", "b", "c", "d"], {"r": -0.06}, domain=(0.0, 12 * math.pi),
    functionals={"square": lambda t, u, p: u.u**2}, rates={"d": lambda t, u, w, p: -w.u},
)  # fmt: skip
#: The same as the gradient of an energy: its index is counted from the second variation, without any eigenvalue.
ENERGY = contin.VariationalProblem(
    energy=lambda t, x, w, p: ((x.u + w.k) ** 2 - p.r * x.u**2) / 2 - 0.6 * x.u**3 + x.u**4 / 4,
    states=["u", "slope"], parameters={"r": -0.06}, kinematics=lambda t, x, w, p: (x.slope, w.k), controls=["k"],
    ends=lambda a, b, p: (a.slope, b.slope), functionals={"square": lambda t, x, w, p: x.u**2}, domain=(0, 12 * math.pi),
)  # fmt: skip


def patch(t):
    size, width = 2 * math.sqrt(0.06 / 10.68), 2 / math.sqrt(0.06)
    height = size / math.cosh(t / width)
    return height * math.cos(t), -height * (math.sin(t) + math.cos(t) * math.tanh(t / width) / width)


def snake(problem, guess):
    return contin.trace(
        contin.solve(problem, guess, intervals=40, degree=5), free=["r"], direction=-1, errors=False,
        limits={"r": (-0.5, 0), "square": (0, 6)}, mesh=contin.MeshControl(tolerance=1e-6),
    )  # fmt: skip


@pytest.mark.full
def test_folds_of_the_snake_change_the_stability_as_the_index_of_its_energy_does():
    def changes(branch, count):
        """The counts between folds, whose own is not known."""
        found = [count(point) for point in branch if point.label != "LP"]
        return [found[0], *(after for before, after in zip(found, found[1:]) if after != before)]

    by_energy = snake(ENERGY, patch)

    def guess(t):
        h = 1e-4
        u, slope = patch(t)
        before, behind = patch(t - h)[1], patch(t + h)[1]
        return u, slope, (behind - before) / (2 * h), (behind - 2 * slope + before) / h**2

    branch = snake(SNAKE, guess)
    assert len(branch.labelled("LP")) == len(by_energy.labelled("LP")) >= 3 and not branch.labelled("HB")
    assert (
        changes(branch, unstable)
        == changes(by_energy, lambda point: point.index)
        == [1, 0, 1, 0][: len(changes(branch, unstable))]
    )


def test_what_is_known_at_a_hopf_point_and_of_the_equations():
    hopf = contin.trace(uniform(4.9), free=["b"], limits={"b": (4.9, 5.2)}).labelled("HB")
    assert [point.sensitivities()["a"]["b"] for point in hopf] == pytest.approx([2 * A, 2 * A], rel=1e-6)
    text = BRUSSELATOR.equations()
    assert f"dx' = -(z1 + a - x * (b + 1)) / {DX} + x_t / {DX}" in text and "\nx' = dx\n" in text
    still = contin.BoundaryValueProblem(lambda t, u, p: (u.v, -u.u), dirichlet, ["u", "v"], {}, rates={
        "v": lambda t, u, w, p: (1 + u.u) * w.u + (1 + u.u) ** 2 * w.u
    })  # fmt: skip
    assert "r1 = " in still.equations() and "v' = -u + " in still.equations()


def test_a_pulse_of_gray_and_scott_where_half_of_the_spectrum_is_known():
    """u_t = u'' - u v^2 + (1 - u) / g and g v_t = g v'' - v + u v^2: u + g v moves by itself, with z = -1 / g - (n pi / L)^2.

    The pulse is that of Hale, Peletier & Troy (1999); it is a saddle, as small pulses are.
    """
    g, length = 0.15, 8.0
    wide = math.sqrt(1 - 4.5 * g)
    problem = contin.BoundaryValueProblem(
        lambda t, u, p: (u.p, u.u * u.v**2 - (1 - u.u) / g, u.q, (u.v - u.u * u.v**2) / g),
        lambda a, b, p: (a.p, b.p, a.q, b.q), ["u", "p", "v", "q"], {}, domain=(0.0, length),
        rates={"p": lambda t, u, w, p: w.u, "q": lambda t, u, w, p: w.v},
    )  # fmt: skip

    def pulse(t):
        low = 1 + wide * math.cosh(t / math.sqrt(g))
        slope = -3 * wide * math.sinh(t / math.sqrt(g)) / math.sqrt(g) / low**2
        return 1 - 3 * g / low, -g * slope, 3 / low, slope

    point = contin.solve(problem, pulse)
    assert np.allclose(point.system.evaluate(point.x, np.array([1.0]))[0], pulse(1.0), atol=1e-7)  # the line is cut off
    spectrum = point.spectrum()
    known = -1 / g - (np.arange(6) * math.pi / length) ** 2
    nearest = np.abs(spectrum.values[:, None] - known).argmin(axis=0)
    assert np.all(np.abs(spectrum.values[nearest] - known) <= spectrum.errors[nearest] + 1e-9) and spectrum.unstable == 1


# --- integral conditions, multipliers, and what is refused ---------------------------------------------------------------


def test_a_multiplier_follows_the_states():
    """u_t = u'' - mu + a u with the mean held: mu moves with u, and the uniform mode is no perturbation. z = a - (n pi)^2."""
    problem = contin.BoundaryValueProblem(
        lambda t, u, p: (u.v, p.mu - p.a * u.u), neumann, ["u", "v"], {"a": 1.0, "mu": 0.0},
        integrals=lambda t, u, p: (u.u,), rates={"v": first_order},
    )  # fmt: skip
    branch = contin.trace(contin.solve(problem, [0, 0], free=["mu"]), free=["a", "mu"], limits={"a": (1, 12)})
    for point in branch:
        if point.label != "BP":
            exact = point["a"] - (np.arange(1, 5) * math.pi) ** 2
            assert np.allclose(point.system.eigenvalues(point.x)[:4], exact, rtol=1e-7, atol=1e-7)
    assert [round(point["a"] / math.pi**2, 9) for point in branch.labelled("BP")] == [1.0]


def test_sizes_of_states_and_time_do_not_change_eigenvalues():
    def rhs(t, u, p):
        return 1e3 * u.v, -p.lam * 1e3 * math.exp(u.u / 1e6)

    scaled = contin.BoundaryValueProblem(
        rhs, dirichlet, ["u", "v"], {"lam": 1.0}, rates={"v": lambda t, u, w, p: 1e-3 * w.u}
    )  # u is 1e6 times Bratu's, v a thousand times
    plain, large = (trace(problem, [0, 0], "lam", (0.5, 1.0)).points[-1] for problem in (BRATU, scaled))
    assert not large.system.scales.are_one and abs(plain["lam"] - 1) + abs(large["lam"] - 1) < 1e-12
    known, found = (point.system.eigenvalues(point.x)[:4] for point in (plain, large))
    assert np.allclose(found, known, rtol=1e-7)


def stated(**options):
    given = {"rates": {"v": first_order}, **options}
    return contin.BoundaryValueProblem(lambda t, u, p: (u.v, -u.u), dirichlet, ["u", "v"], {}, **given)


@pytest.mark.parametrize(
    ("rates", "message"),
    [
        ({"w": first_order}, "rates: 'w'"),
        ({"v": lambda t, u, p: u.u}, "rates: v must be a function of 4 arguments"),
        ({"v": "u"}, "rates: v"),
        ("u", "rates: 'u'"),
        ({"v": lambda t, u, w, p: (w.u,)}, "rates: v must return one number"),
        ({"v": lambda t, u, w, p: w.z}, "z"),
    ],
)
def test_rates_that_cannot_be_used(rates, message):
    with pytest.raises(ProblemError, match=message):
        stated(rates=rates)


@pytest.mark.parametrize(
    ("rate", "message"),
    [
        (lambda t, u, w, p: w.u**2, "linear"),
        (lambda t, u, w, p: w.u + 1.0, "linear"),
        (lambda t, u, w, p: u.u, "do not depend"),
        (lambda t, u, w, p: w.u / (t - t), "not finite"),
        (lambda t, u, w, p: -w.u, "a sign is wrong"),
    ],
)
def test_rates_that_make_no_motion(rate, message):
    with pytest.raises(ProblemError, match=message):
        contin.solve(stated(rates={"v": rate}), [0.0, 0.0])


def test_a_problem_with_rates_is_data(tmp_path):
    again = pickle.loads(pickle.dumps(BRUSSELATOR))
    assert again == BRUSSELATOR and again.rates.keys() == BRUSSELATOR.rates.keys()
    branch = contin.trace(uniform(4.9), free=["b"], limits={"b": (4.9, 5.05)})
    contin.save(branch, tmp_path / "branch.npz")
    loaded = contin.load(BRUSSELATOR, tmp_path / "branch.npz")
    assert [unstable(point) for point in loaded] == [unstable(point) for point in branch]
    assert loaded.labelled("HB")[0].details["frequency"] == branch.labelled("HB")[0].details["frequency"]


def test_what_does_not_move_has_no_spectrum_and_cycles_of_fields_are_refused():
    still = contin.BoundaryValueProblem(lambda t, u, p: (u.v, -u.u), dirichlet, ["u", "v"], {})
    with pytest.raises(ProblemError, match="rates="):
        contin.solve(still, [0.0, 0.0]).spectrum()


# --- independent computations --------------------------------------------------------------------------------------------


@pytest.mark.full
def test_stability_of_the_bimodal_state_of_kuramoto_and_sivashinsky():
    """u_t = -4 u_xxxx - alpha (u_xx + u u_x), odd. Branch point and eigenvalues are compared with 24 sine modes."""
    problem = contin.BoundaryValueProblem(
        lambda t, u, p: (u.b, u.c, u.d, -p.alpha / 4 * (u.c + u.a * u.b)), lambda a, b, p: (a.a, a.c, b.a, b.c),
        ["a", "b", "c", "d"], {"alpha": 15.0}, domain=(0.0, math.pi), rates={"d": lambda t, u, w, p: -w.a / 4},
    )  # fmt: skip
    (start,) = trace(problem, [0] * 4, "alpha", (15.0, 17.0)).labelled("BP")
    branch = contin.trace(start, branch=1, limits={"alpha": (10, 25)})
    (crossed,) = [point for point in branch.labelled("BP") if abs(point["alpha"] - 16) > 1e-6]
    assert abs(crossed["alpha"] - 16.1399) < 5e-5  # Kevrekidis, Nicolaenko & Scovel 1990
    counts = [(unstable(point), point["alpha"] > crossed["alpha"]) for point in branch if point.label != "BP"]
    assert {count for count, beyond in counts if beyond} == {0} and {count for count, beyond in counts if not beyond} == {1}

    modes = np.arange(1, 25)
    last = branch[-1]

    def linear(amplitudes):
        """The matrix of v -> -4 v_xxxx - alpha (v_xx + (u v)_x) in sines, u in them given."""
        i, j = modes[:, None], modes
        u = np.concatenate([[0], amplitudes, np.zeros(3 * len(modes))])
        product = (np.where(j <= i, u[np.abs(i - j)], 0) - np.where(j > i, u[np.abs(i - j)], 0) - u[i + j]) / 2
        return np.diag(-4.0 * modes**4 + last["alpha"] * modes**2) - last["alpha"] * modes[:, None] * product

    t = np.linspace(0, math.pi, 401)
    u = last.system.evaluate(last.x, t)[:, 0]
    amplitudes = np.array([2 / math.pi * np.trapezoid(u * np.sin(k * t), t) for k in modes])
    known = np.sort(np.linalg.eigvals(linear(amplitudes)).real)[::-1]
    assert np.allclose(np.sort(last.system.eigenvalues(last.x)[:4].real)[::-1], known[:4], rtol=1e-5)


@pytest.mark.full
def test_counts_change_at_labelled_points_only():
    """In the diagram of Kuramoto and Sivashinsky up to 40: by one at folds, by two at Hopf points, by one or none at BP."""
    problem = contin.BoundaryValueProblem(
        lambda t, u, p: (u.b, u.c, u.d, -p.alpha / 4 * (u.c + u.a * u.b)), lambda a, b, p: (a.a, a.c, b.a, b.c),
        ["a", "b", "c", "d"], {"alpha": 1.0}, domain=(0.0, math.pi), rates={"d": lambda t, u, w, p: -w.a / 4},
        functionals={"energy": lambda t, u, p: u.a**2},
    )  # fmt: skip
    diagram = contin.diagram(contin.solve(problem, [0] * 4), free=["alpha"], limits={"alpha": (1, 40)})
    allowed = {(): {0}, ("LP",): {1}, ("HB",): {2}, ("BP",): {0, 1}}
    steps, hopf = 0, []
    for branch in diagram.branches:
        hopf += [point["alpha"] for point in branch.labelled("HB")]
        before, passed = None, ()
        for point in branch:
            if point.label in ("LP", "BP", "HB"):
                passed += (point.label,)
            elif not (point.label == "EP" and point["energy"] < 1e-12):  # branches close, or end, at branch points
                count = unstable(point)
                if before is not None and passed in allowed:
                    assert abs(count - before) in allowed[passed]
                    steps += 1
                before, passed = count, ()
    assert steps > 150 and any(abs(value - 30.3452) < 5e-5 for value in hopf)  # the bimodal state oscillates from there on


def chebyshev(count):
    """Return nodes between 0 and 1 and the matrix of the derivative there (Trefethen, Spectral Methods in MATLAB)."""
    x = np.cos(np.pi * np.arange(count + 1) / count)
    c = np.r_[2, np.ones(count - 1), 2] * (-1.0) ** np.arange(count + 1)
    matrix = np.outer(c, 1 / c) / (x[:, None] - x + np.eye(count + 1))
    return (x + 1) / 2, 2 * (matrix - np.diag(matrix.sum(axis=1)))


@pytest.mark.sample(3)
@pytest.mark.parametrize("seed", range(8))
def test_random_linear_fields_against_a_spectral_method(seed):
    """w_t = D w'' + B w' + C(s) w with conditions on w, or on w' and w, at both ends: counts, and eigenvalues within errors."""
    random = np.random.default_rng(seed)
    d, b = (10 ** random.uniform(-2, 0.5, 2)).tolist(), (random.normal(size=(2, 2)) * random.uniform(0, 2)).tolist()
    c = (random.normal(size=(3, 2, 2)) * 10 ** random.uniform(0, 1)).tolist()
    robin, kind = random.uniform(0, 2, (2, 2)).tolist(), random.integers(0, 2, (2, 2)).tolist()

    def entry(i, j, t):
        return c[0][i][j] + c[1][i][j] * math.cos(3 * t) + c[2][i][j] * math.sin(2 * t)

    def rhs(t, u, p):
        w, slope = (u.x, u.y), (u.dx, u.dy)
        f = [sum(entry(i, j, t) * w[j] + b[i][j] * slope[j] for j in range(2)) for i in range(2)]
        return u.dx, -f[0] / d[0], u.dy, -f[1] / d[1]

    def boundary(first, last, p):
        found = []
        for end, u in enumerate((first, last)):
            for i, (w, slope) in enumerate(((u.x, u.dx), (u.y, u.dy))):
                found.append(slope - (1 - 2 * end) * robin[end][i] * w if kind[end][i] else w)
        return found

    problem = contin.BoundaryValueProblem(
        rhs, boundary, ["x", "dx", "y", "dy"], {},
        rates={"dx": lambda t, u, w, p: w.x / d[0], "dy": lambda t, u, w, p: w.y / d[1]},
    )  # fmt: skip
    spectrum = contin.solve(problem, [0] * 4).spectrum()

    def by_chebyshev(count):
        t, slope = chebyshev(count)
        n, weights = count + 1, np.eye(2 * count + 2)
        matrix = np.block([[
            np.diag([entry(i, j, s) for s in t]) + b[i][j] * slope + (d[i] * slope @ slope if i == j else 0) for j in range(2)
        ] for i in range(2)])  # fmt: skip
        for end, at in ((0, count), (1, 0)):
            for i in range(2):
                row = np.zeros(2 * n)
                row[i * n : (i + 1) * n] = slope[at] * kind[end][i]
                row[i * n + at] += 1 - kind[end][i] - kind[end][i] * (1 - 2 * end) * robin[end][i]
                matrix[i * n + at], weights[i * n + at] = row, 0
        values = scipy.linalg.eigvals(matrix, weights)
        return values[np.isfinite(values)]

    coarse, fine = by_chebyshev(48), by_chebyshev(60)
    assert spectrum.unstable == np.count_nonzero(fine.real > 0)
    off, own = (np.abs(values[:, None] - spectrum.values[:8]) for values in (fine, coarse))
    best = np.minimum(off.min(axis=0), own.min(axis=0))
    assert np.all(best <= spectrum.errors[:8] + 1e-8)  # what round-off leaves of the spectral method
    assert np.all(spectrum.errors[:8] < 1e-4)
