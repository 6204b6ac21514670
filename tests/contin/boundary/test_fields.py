"""Stability in time of steady states of fields: eigenvalues on the mesh, Hopf points, counts at folds and branch points."""

import math
import pickle

import numpy as np
import pytest
from scipy.special import ellipj, ellipk

import contin
from contin.boundary import fields
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
def test_no_mesh_makes_unstable_eigenvalues(degree, monkeypatch):
    """Of the 7 d rates at Gauss points one is given by the conditions; the others have an eigenvalue each."""
    mesh = np.cumsum(np.append(0, np.random.default_rng(degree).uniform(0.1, 1, 7)))
    system = HEAT.discretized([], {}, None, mesh=(mesh - mesh[0]) / (mesh[-1] - mesh[0]), degree=degree)
    monkeypatch.setattr(fields, "_KEPT", 10_000)
    values = system.eigenvalues(np.zeros(system.size))
    assert len(values) == 7 * degree - 1 and np.all(values.real < 0)


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


def test_a_long_mesh_gives_the_eigenvalues_that_a_short_one_does():
    short, long = (BRUSSELATOR.discretized([], {"b": 5.5}, None, np.linspace(0, 1, n + 1), 4) for n in (20, 90))
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
    point = contin.trace(uniform(4.9), free=["b"], limits={"b": (4.9, 5.05)}).labelled("HB")[0]
    with pytest.raises(ProblemError, match="time-periodic states of a field"):
        contin.trace(point, branch=1)
