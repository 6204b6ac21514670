"""The law between the flat rod and the ribbon: from plate theory, its two limits, its branches against the quadrature."""

import functools
import math

import mpmath
import numpy as np
import pytest

import contin
from contin import Settings, trace
from contin.lowlevel import point_of
from ribbon_model import exact_finite_width, finite_width, law_end
from ribbon_model.domains import HALF_LOOP
from ribbon_model.laws import FINITE_WIDTH, FLAT_ROD, RIBBON, TwoBendings
from ribbon_model.linear import circle, covering, index, stability_interval, thresholds
from ribbon_model.seeds import half_loop_branch, primary_branch
from ribbon_model.solution import Solution
from ribbon_model.unfolding import factors, first_root, shooting_determinant

NU = 0.3


def wide(Gamma):
    return {"nu": NU, "Gamma": Gamma}


def derivatives(w1, w3, kappa_n, Gamma):
    """(U, U_1, U_3, U_11, U_13, U_33, U_k, U_1k, U_3k), U without the term -kappa_n**2/2."""
    strain = np.stack(np.broadcast_arrays(w1, 0.0, w3), axis=-1)
    U, d, dd = FINITE_WIDTH.derivatives(strain, kappa_n, NU, Gamma)
    mixed = (dd[..., i, j] for i, j in ((0, 0), (0, 2), (2, 2)))
    return np.array([U + kappa_n**2 / 2, d[..., 0], d[..., 2], *mixed, d[..., 3] + kappa_n, dd[..., 0, 3], dd[..., 2, 3]])


def followed(m, n, Gamma, **settings):
    system, x, tangent = primary_branch(FINITE_WIDTH, m, n, wide(Gamma), 10, 7)
    return trace(point_of(system, x), Settings(trivial="M2", limits={"kappa_n": (-100, 100)}, **settings), tangent=tangent)


@functools.cache
def branch(m, n, Gamma):
    return followed(m, n, Gamma)


def moments(random, Gamma):
    """Random strains away from omega_1 = 0, their derivatives of U, with U convex all the way to larger omega_1."""
    while True:
        w1, w3, kappa_n = random.uniform(0.8, 4), random.uniform(-3, 3), random.uniform(-4, 4)
        d = derivatives(w1 + np.linspace(0, 6, 61), w3, kappa_n, Gamma)
        if np.all((d[3] > 0) & (d[3] * d[5] - d[4] ** 2 > 0.01 * d[3])):
            return w1, w3, kappa_n, d[:, 0]


# --- the energy -------------------------------------------------------------------------------------------------------


def membrane(z):
    """Return g by its definition, in mpmath's numbers."""
    x = mpmath.root(z, 4)
    return (1 - 2 * (mpmath.cosh(x) - mpmath.cos(x)) / (x * (mpmath.sinh(x) + mpmath.sin(x)))) / z


def test_the_membrane_function_against_its_definition():
    """g and four derivatives, by mpmath with 120 digits, on both sides of the series' limit and where cosh overflows.

    Measured: 4e-16 of g, 7e-16, 2e-15, 8e-15 and 1e-13 of its derivatives at most.
    """
    orders = [finite_width.membrane]
    for _ in range(4):
        orders.append(slope_of(orders[-1]))
    with mpmath.workdps(120):
        limit = finite_width.SERIES_LIMIT
        for z in (0.01, 3.0, 16.0, 40.0, limit * (1 - 1e-15), limit, 100.0, 200.0, 1e5, 1e13):
            exact = [mpmath.diff(membrane, mpmath.mpf(z), k, h=mpmath.mpf(z) * mpmath.mpf(10) ** -20) for k in range(5)]
            errors = [abs(float(order(z) / value - 1)) for order, value in zip(orders, exact)]
            assert np.all(np.array(errors) < [1e-15, 3e-15, 1e-14, 4e-14, 3e-13]), (z, errors)
    exact = (1 / 180, -1 / 22680, 2 * 2879 / 8172964800)
    assert [order(0.0) for order in orders[:3]] == pytest.approx(exact, rel=3e-15)


def slope_of(function):
    by = contin.lowlevel.gradient(function, ["z"])
    return lambda z: by(z)[1]


@pytest.mark.parametrize("Gamma", (0.5, 10.0, 200.0))
def test_the_energy_is_the_least_of_a_plate(Gamma):
    """Plate bending and stretching of a section whose profile is a polynomial of degree 40: a linear problem, minimised."""
    from numpy.polynomial import legendre

    y, weight = legendre.leggauss(80)
    weight, basis = weight / 2, np.eye(41)
    value = legendre.legval(y, basis)
    curvature = legendre.legval(y, legendre.legder(basis, 2, axis=1).T) * 4  # by y/w in [-1/2, 1/2]
    for w1, w3, kappa_n in ((1.3, 0.7, 2.0), (-0.4, 1.1, 0.5), (3.0, 0.0, -1.0)):
        bent, stretch = w1 - kappa_n, 6 * (1 - NU**2) * Gamma**2
        twist = w3**2 * (y / 2) ** 2 / 2
        # energy = a.A.a/2 + b.a + c in the coefficients of zeta / w^2; a constant elongation comes with the constant of zeta
        A = (curvature * weight) @ curvature.T + 2 * stretch * w1**2 * (value * weight) @ value.T
        b = NU * bent * curvature @ weight - 2 * stretch * w1 * (value * weight) @ twist
        c = bent**2 / 2 + (1 - NU) * w3**2 + stretch * weight @ twist**2
        least = c - b @ np.linalg.lstsq(A, b, rcond=1e-14)[0] / 2
        assert derivatives(w1, w3, kappa_n, Gamma)[0] == pytest.approx(least, rel=1e-10)


@pytest.mark.parametrize("Gamma", (0.0, 1.0, 30.0))
def test_derivatives_of_the_energy(Gamma):
    """U, its slopes and second derivatives by mpmath, with 80 digits."""
    nu = mpmath.mpf(NU)
    plane = 1 - nu**2
    C = 3 * plane * mpmath.mpf(Gamma) ** 2

    def energy(w1, w3, kappa_n):
        bent = w1 - kappa_n
        stretched = C * membrane(C * w1**2) * (w3**2 + nu * w1 * bent) ** 2 / 2 if Gamma else 0
        return plane * bent**2 / 2 + (1 - nu) * w3**2 + stretched

    orders = [(0, 0, 0), (1, 0, 0), (0, 1, 0), (2, 0, 0), (1, 1, 0), (0, 2, 0), (0, 0, 1), (1, 0, 1), (0, 1, 1)]
    for at in ((1.3, 0.7, 2.0), (0.02, -0.4, 3.0), (-0.5, 0.3, 1.0)):
        with mpmath.workdps(80):
            exact = [float(mpmath.diff(energy, tuple(map(mpmath.mpf, at)), order, h=mpmath.mpf(10) ** -20)) for order in orders]
        assert derivatives(*at, Gamma) == pytest.approx(exact, rel=1e-12, abs=1e-13)


# --- the Legendre transform -------------------------------------------------------------------------------------------


@pytest.mark.sample(2)
@pytest.mark.parametrize("Gamma", (0.0, 0.3, 3.0, 30.0, 3e3, 1e6))
def test_the_response_inverts_the_energy(Gamma):
    random = np.random.default_rng(3)
    for _ in range(30):
        w1, w3, kappa_n, d = moments(random, Gamma)
        value, v1, v2, v3, star = FINITE_WIDTH.response(d[1], 0.4, d[2], kappa_n, NU, Gamma)
        assert (v1, v2, v3) == pytest.approx((w1, 0.0, w3), rel=1e-11, abs=1e-12)
        assert value == pytest.approx(d[1] * w1 + d[2] * w3 - d[0] + kappa_n**2 / 2, rel=1e-12, abs=1e-12)
        assert star == pytest.approx(kappa_n - d[6], rel=1e-11, abs=1e-12)


def test_the_response_carries_derivatives():
    """Exact derivatives through the search against central differences of the response, for all that it depends on."""
    random, h = np.random.default_rng(4), 1e-5
    names = ("M1", "M2", "M3", "kappa_n", "nu", "Gamma")
    batch = contin.lowlevel.Batch([lambda u, p: FINITE_WIDTH.response(*u)], [5], names, (), times=False)
    assert batch.interpreted is None
    for Gamma in (0.3, 10.0, 300.0):
        w1, w3, kappa_n, d = moments(random, Gamma)
        at = np.array([[d[1], 0.1, d[2], kappa_n, NU, Gamma]])
        none = np.empty((0, 6)), np.empty(0)
        exact = batch.jacobian(np.zeros(1), at, *none, batch.columns([]))[1][0]
        for i in (0, 2, 3, 4, 5):
            ends = [batch.values(np.zeros(1), at + k * h * np.eye(6)[i], *none)[0] for k in (1, -1)]
            assert exact[:, i] == pytest.approx((ends[0] - ends[1]) / (2 * h), rel=1e-6, abs=1e-7)


def test_limits_of_the_response():
    """Gamma = 0: the flat rod with modulus 1 - nu^2, to 3 units in the last place, with an error O(Gamma^2); ribbon:
    O(1/sqrt(Gamma))."""
    plane = 1 - NU**2
    for M1, M3, kappa_n in ((0.4, 0.3, 1.5), (-1.0, 0.5, 2.0)):
        H, w1, _, w3, star = FLAT_ROD.response(M1 / plane, 0, M3 / plane, kappa_n, NU)
        flat = np.array([plane * H + NU**2 * kappa_n**2 / 2, w1, 0, w3, plane * star + NU**2 * kappa_n])
        assert FINITE_WIDTH.response(M1, 0, M3, kappa_n, NU, 0.0) == pytest.approx(flat, rel=7e-16, abs=4e-16)
        errors = [np.abs(np.array(FINITE_WIDTH.response(M1, 0, M3, kappa_n, NU, G)) - flat).max() for G in (1e-3, 2e-3)]
        assert errors[1] / errors[0] == pytest.approx(4, rel=1e-3)
    M1, M3, kappa_n = 0.8, 0.6, 0.7
    ribbon = np.array(RIBBON.response(M1, 0, M3, kappa_n, NU))
    errors = [np.abs(np.array(FINITE_WIDTH.response(M1, 0, M3, kappa_n, NU, G)) - ribbon).max() for G in (1e8, 4e8)]
    assert errors[0] / errors[1] == pytest.approx(2, rel=1e-3) and errors[0] < 1e-4


def test_where_the_energy_is_not_convex_there_is_no_response():
    """At w^2 kappa_n / h = 100 an arc opened to xi = .85 has t < 0 (its t vanishes first at .776)."""
    d = derivatives(0.15, 0.0, 1.0, 100.0)
    assert d[5] < 0
    values = FINITE_WIDTH.response(d[1], 0.0, 0.0, 1.0, NU, 100.0)
    assert all(map(math.isnan, (values[0], values[1], values[3], values[4])))


# --- circles ----------------------------------------------------------------------------------------------------------


def test_thresholds_from_the_flat_rod_to_the_ribbon():
    for m, n in ((1, 2), (1, 5), (3, 1), (5, 6)):
        flat, ribbon = thresholds(FLAT_ROD, m, n, NU)[0], thresholds(RIBBON, m, n, NU)[0]
        assert thresholds(FINITE_WIDTH, m, n, wide(0.0))[0] == pytest.approx(flat, rel=1e-14)
        assert thresholds(FINITE_WIDTH, m, n, wide(1e12))[0] == pytest.approx(ribbon, rel=1e-4)
    # by shooting with this energy, independently of the formula
    assert [round(thresholds(FINITE_WIDTH, 1, 2, wide(G))[0], 3) for G in (1e-3, 10, 100)] == [5.615, 3.346, 2.680]


def test_circles_have_the_closed_form_of_the_plate():
    """M = (1 - nu**2 G) y - nu**2 G' y**2/4 and t = 2 (1 - nu) + 2 nu (1 - G) y, with y = 1 - kappa_n r0."""
    for m, kappa_n, nu, Gamma in ((1, 2.0, 0.3, 10.0), (3, -1.0, -0.4, 0.7), (5, 9.0, 0.45, 200.0)):
        x, y = (3 * (1 - nu**2)) ** 0.25 * math.sqrt(m * Gamma), 1 - kappa_n / m

        def G(x):
            return 2 * (mpmath.cosh(x) - mpmath.cos(x)) / (x * (mpmath.sinh(x) + mpmath.sin(x)))

        value, slope = float(G(x)), float(x * mpmath.diff(G, x))
        found = FINITE_WIDTH.on_circle(m, kappa_n, nu, Gamma)
        assert found.moment / m == pytest.approx((1 - nu**2 * value) * y - nu**2 * slope * y**2 / 4, rel=1e-12)
        assert found.twisting == pytest.approx(2 * (1 - nu) + 2 * nu * (1 - value) * y, rel=1e-12)


def test_a_mode_has_a_second_threshold_far_from_the_natural_state():
    """M = t (1 - k**2) is quadratic in kappa_n: the index of the circle changes at the second root, too."""
    numbers = {"nu": -0.89, "Gamma": 1.1}
    near, far = thresholds(FINITE_WIDTH, 3, 2, numbers)
    assert near < 3 < far and stability_interval(FINITE_WIDTH, 3, numbers)[1] == far / 3
    for side, expected in ((-1e-4, 0), (1e-4, 2)):
        assert index(FINITE_WIDTH, 3, far + side, numbers) == expected
    for kappa_n in (near, far):
        found = FINITE_WIDTH.on_circle(3, kappa_n, *numbers.values())
        assert found.moment / 3 == pytest.approx(found.twisting * (1 - (2 / 3) ** 2), rel=1e-12)
        assert found.twisting > 0 and found.bending > 0


@pytest.mark.full
def test_the_half_loop_bifurcates_at_the_thresholds():
    system = HALF_LOOP.discretize(FINITE_WIDTH, 12, 6, {"nu": NU, "Gamma": 10.0})
    start = HALF_LOOP.circle(system, 1, 2.0)
    found = trace(point_of(system, start), Settings(limits={"kappa_n": (0, 4.6)}, max_step=0.1)).labelled("BP")
    expected = [thresholds(FINITE_WIDTH, 1, n, wide(10.0))[0] for n in (2, 3)]
    assert [point["kappa_n"] for point in found] == pytest.approx(expected, abs=1e-9)
    low, high = stability_interval(FINITE_WIDTH, 1, wide(10.0))
    assert high == expected[0]
    assert [index(FINITE_WIDTH, 1, k, wide(10.0)) for k in (3.3, 3.4, 4.5, 6.0)] == [0, 2, 4, math.inf]


def test_covering_indices():
    for m, kappa_n in ((1, 4.0), (3, -0.5), (5, 30.0)):
        for law, Gamma in ((RIBBON, None), (FINITE_WIDTH, 0.0), (FINITE_WIDTH, 7.0)):
            values = circle(law, m, kappa_n, wide(Gamma))
            assert covering(law, wide(Gamma), kappa_n, values["kappa_star"], values["energy"]) == m
    for law, Gamma in ((RIBBON, 1.0), (FINITE_WIDTH, None), (FINITE_WIDTH, -1.0)):
        with pytest.raises(ValueError, match="Gamma"):
            thresholds(law, 1, 2, wide(Gamma))


# --- branches ---------------------------------------------------------------------------------------------------------


@pytest.mark.full
@pytest.mark.parametrize(("m", "n", "Gamma"), [(1, 2, 10.0), (1, 2, 100.0), (3, 4, 10.0)])
def test_folds_and_ends_against_the_quadrature(m, n, Gamma):
    found = branch(m, n, Gamma)
    points = exact_finite_width.curve(m, n, wide(Gamma))
    folds = [point for point in points if point.label == "LP"]
    assert len(folds) == 1
    for p, e in zip(found.labelled("LP"), folds, strict=True):
        assert p["kappa_n"] == pytest.approx(e.kappa_n, abs=1e-11)
        assert (p["kappa_star"], p["energy"]) == pytest.approx((e.kappa_star, e.energy), abs=1e-8)
    assert found.points[-1]["kappa_n"] == pytest.approx(points[-1].kappa_n, abs=1e-9)
    assert found.stop.reason == "trivial branch" and points[-1].omega == 2 * n - m
    middle = found.points[len(found.points) // 2]
    assert Solution.of(middle).shape().closure() < 1e-10


@pytest.mark.full
def test_a_branch_stops_where_the_law_ends():
    """(3, 1) at Gamma = 10 runs off to where U loses its convexity; the quadrature is lost at the same kappa_n."""
    found = followed(3, 1, 10.0, events=law_end.closed_tests(FINITE_WIDTH))
    assert found.stop.reason == "event" and law_end.NAME in found.stop.message
    lost = exact_finite_width.curve(3, 1, wide(10.0))[-1]
    assert lost.label == "MX" and lost.kappa_n == pytest.approx(found.points[-1]["kappa_n"], abs=0.05)
    assert not law_end.closed_tests(RIBBON)


@pytest.mark.full
@pytest.mark.parametrize(("nu", "Gamma", "fold"), [(0.28, 1.212, 45.619411), (0.32, 1.2, 43.075197)])
def test_a_second_minimum_that_is_shallow_is_not_taken(nu, Gamma, fold):
    """(2, 10): at the planar place of the cell U - M.omega has a second minimum; the fold lies beyond where it appears.

    The fold is that of degree 4 on 40 intervals. `exact_finite_width.curve` follows the branch to within 3e-4 and .05 of it.
    """
    ends = law_end.closed_tests(FINITE_WIDTH)
    for intervals, degree in ((10, 7), (40, 4)):
        system, x, tangent = primary_branch(FINITE_WIDTH, 2, 10, {"nu": nu, "Gamma": Gamma}, intervals, degree)
        found = trace(point_of(system, x), trivial="M2", limits={"kappa_n": (-100, 100)}, events=ends, tangent=tangent)
        assert [point["kappa_n"] for point in found.labelled("LP")] == pytest.approx([fold], abs=1e-6)


@pytest.mark.sample(5)
@pytest.mark.parametrize("nu", [0.1, 0.3, 0.45])
@pytest.mark.parametrize("Gamma", [1.0, 2.0, 4.0, 8.0, 11.0, 15.0, 50.0])
def test_the_law_has_the_bending_of_the_single_loop(nu, Gamma):
    """Where U - M.omega has two minima, the circle is the outer one of a wide strip and the inner one of a narrow one."""
    for n in range(2, 11):
        kappa_n = thresholds(FINITE_WIDTH, 1, n, {"nu": nu, "Gamma": Gamma})[0]
        moment = [circle(FINITE_WIDTH, 1, kappa_n, {"nu": nu, "Gamma": Gamma})["M1"], 0.0, 0.0]
        strains, _ = FINITE_WIDTH.linearized(np.array([moment]), kappa_n, nu, Gamma)
        assert strains[0] == pytest.approx([1.0, 0.0, 0.0], abs=1e-8)


@pytest.mark.full
def test_the_outer_minimum_of_a_wide_strip_is_followed():
    """(1, 4) of steel, 200 x 5 x .1 mm; the fold is that of `exact_finite_width.curve`, which is lost at 11.7665."""
    found = followed(1, 4, 7.853981634, events=law_end.closed_tests(FINITE_WIDTH))
    assert [point["kappa_n"] for point in found.labelled("LP")] == pytest.approx([17.723754], abs=1e-5)
    assert found.points[-1]["kappa_n"] == pytest.approx(11.7665, abs=0.01) and law_end.NAME in found.stop.message


def test_a_circle_at_the_other_minimum_is_refused():
    with pytest.raises(TwoBendings, match=r"m = 2, n = 7: the strain energy of the circle .* has two minima"):
        primary_branch(FINITE_WIDTH, 2, 7, {"nu": 0.45, "Gamma": 6.0}, 10, 7)
    with pytest.raises(TwoBendings, match="it holds for smaller n"):
        half_loop_branch(FINITE_WIDTH, 2, 7, {"nu": 0.45, "Gamma": 6.0}, 10, 7)
    primary_branch(FINITE_WIDTH, 2, 5, {"nu": 0.45, "Gamma": 6.0}, 10, 7)


@pytest.mark.full
def test_a_branch_on_which_the_energy_has_two_minima():
    """(1, 5), nu = .4, Gamma = 40: the minimum of U - M.omega of the neighbouring places is kept, to the circle at the other
    end.

    Its kappa_n is the closed form; the folds are those of `exact_finite_width.curve`, which takes 40 s.
    """
    system, x, tangent = primary_branch(FINITE_WIDTH, 1, 5, {"nu": 0.4, "Gamma": 40.0}, 10, 7)
    ends = law_end.closed_tests(FINITE_WIDTH)
    found = trace(point_of(system, x), trivial="M2", limits={"kappa_n": (-100, 100)}, events=ends, tangent=tangent)
    assert [point["kappa_n"] for point in found.labelled("LP")] == pytest.approx([27.387660, -43.957859], abs=1e-6)
    assert found.stop.reason == "trivial branch"
    assert found.points[-1]["kappa_n"] == pytest.approx(thresholds(FINITE_WIDTH, 9, 5, {"nu": 0.4, "Gamma": 40.0})[0], abs=1e-9)


@pytest.mark.full
@pytest.mark.parametrize(("m", "n", "nu", "Gamma", "end"), [(8, 3, 0.0478, 10.21, -59.05), (9, 5, 0.13, 1.719, 0.893)])
def test_where_the_law_ends_the_margin_says_so(m, n, nu, Gamma, end):
    """Not before: `exact_finite_width.curve` is lost at -59.0396 and at .8925."""
    system, x, tangent = primary_branch(FINITE_WIDTH, m, n, {"nu": nu, "Gamma": Gamma}, 10, 7)
    ends = law_end.closed_tests(FINITE_WIDTH)
    found = trace(point_of(system, x), trivial="M2", limits={"kappa_n": (-100, 100)}, events=ends, tangent=tangent)
    assert found.stop.reason == "event" and law_end.NAME in found.stop.message
    assert found.points[-1]["kappa_n"] == pytest.approx(end, abs=0.01)


def test_a_flat_rod_of_no_width():
    """Gamma = 0: the branch (1, 2) of the flat rod, point by point in kappa_n and omega."""
    found = followed(1, 2, 0.0, zeros={"kappa_n": [2.0]})
    system, x, tangent = primary_branch(FLAT_ROD, 1, 2, NU, 10, 7)
    flat = trace(point_of(system, x), trivial="M2", limits={"kappa_n": (-100, 100)}, zeros={"kappa_n": [2.0]}, tangent=tangent)
    ours, theirs = found.labelled("UZ")[0], flat.labelled("UZ")[0]
    assert ours["M2"] == pytest.approx((1 - NU**2) * theirs["M2"], abs=1e-9)
    assert ours["kappa_star"] == pytest.approx((1 - NU**2) * theirs["kappa_star"] + NU**2 * 2.0, abs=1e-9)
    assert not found.labelled("LP")


@pytest.mark.full
def test_the_fold_of_1_2_is_born_at_the_pitchfork():
    """Gamma is a parameter like any other: the curve of folds runs down to where it meets the branch point of the circle."""
    fold = branch(1, 2, 10.0).labelled("LP")[0]
    folds = contin.curve(fold, "Gamma", direction=-1, limits={"Gamma": (4, 20), "M2": (-1e-3, 50)})
    (birth,) = folds.labelled("BP")
    assert 4 < birth["Gamma"] < 5
    assert birth["kappa_n"] == pytest.approx(thresholds(FINITE_WIDTH, 1, 2, wide(birth["Gamma"]))[0], abs=1e-9)
    for Gamma, there in ((birth["Gamma"] - 0.05, 0), (birth["Gamma"] + 0.05, 1)):  # independently
        points = exact_finite_width.curve(1, 2, wide(Gamma))
        assert sum(point.label == "LP" for point in points) == there


# --- the unfolding arc ------------------------------------------------------------------------------------------------


def test_the_unfolding_arc():
    """Two routes agree; a wide strip is the ribbon, a narrow one the flat rod, and in between there is a least width."""
    xi = np.array([0.1, 0.45, 0.7])
    even, odd = factors(FINITE_WIDTH, wide(75.0), xi)
    t = derivatives(1 - xi, 0.0, 1.0, 75.0)[5]
    determinant = shooting_determinant(FINITE_WIDTH, wide(75.0), xi)
    assert determinant == pytest.approx(-8 * (1 - xi) ** 4 * even * odd / t, rel=1e-10)
    assert first_root(FINITE_WIDTH, wide(1e-6)) == pytest.approx(first_root(FLAT_ROD, NU), abs=1e-9)
    assert first_root(FINITE_WIDTH, wide(1e10)) == pytest.approx(first_root(RIBBON, NU), abs=1e-4)
    assert first_root(FINITE_WIDTH, wide(100.0)) == pytest.approx(
        first_root(FINITE_WIDTH, wide(100.0), method="shooting"), abs=1e-11
    )
    assert first_root(FINITE_WIDTH, wide(50.0), largest=0.99) is None
    # the smallest widths at which t vanishes somewhere in 0 < xi < 1, from a scan of the formula
    for nu, low, high in ((0.1, 173, 174), (0.2, 81, 82), (0.3, 51, 52), (0.4, 36, 37)):
        vanishes = [np.any(FINITE_WIDTH.on_circle(np.geomspace(1e-6, 1, 3000), 1.0, nu, G).twisting < 0) for G in (low, high)]
        assert vanishes == [False, True]
