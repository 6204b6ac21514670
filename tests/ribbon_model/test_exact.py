"""The quadrature solution against published numbers, 30-digit arithmetic and the integrated frame equations."""

import dataclasses
from fractions import Fraction

import mpmath
import numpy as np
import pytest
from scipy.integrate import solve_ivp

from ribbon_model import exact
from ribbon_model.exact import bifurcation, curve, end, folds, residuals, solve

MODES = [(m, n) for m in (1, 3, 5, 7) for n in range(1, 8) if n != m]


@pytest.mark.sample(12)
@pytest.mark.parametrize("m, n", MODES)
@pytest.mark.parametrize("nu", [-0.85, -0.3, 1e-3, 0.3, 0.5])
def test_bifurcation_is_equation_27(m, n, nu):
    """(27) as printed in Audoly & Seffen (2015), in rational arithmetic so that its 1/nu loses nothing."""
    nu = Fraction(nu)
    printed = m / nu * (1 - (1 - nu) / (2 * nu * (Fraction(n, m) ** 2 - 1) + 1))
    assert bifurcation(m, n, float(nu)) == pytest.approx(float(printed), rel=1e-13)


def test_bifurcation_limits():
    """(27) at nu -> 0 by l'Hopital is m (2 n^2/m^2 - 1); Table 3 of the paper has K^{1,2} = 2.5 at nu = .3."""
    assert bifurcation(1, 2, 0.3) == pytest.approx(2.5, rel=1e-15)
    assert bifurcation(3, 4, 0) == pytest.approx(3 * (2 * 16 / 9 - 1), rel=1e-15)
    assert bifurcation(3, 4, 1e-9) == pytest.approx(bifurcation(3, 4, 0), rel=1e-7)


@pytest.mark.sample(4)
@pytest.mark.parametrize("m, n", MODES)
def test_branch_leaves_its_circle(m, n):
    """kappa_n -> m K^{m,n} and kappa* -> m as A -> 0: extrapolated to A = 0 (error O(A^3)), and exact at A = 0."""
    start = curve(m, n, 0.3, kappa_limits=(-200, 100))[0]
    assert (start.label, start.eta_max_squared) == ("BP", 0)
    assert (start.kappa_n, start.kappa_star, start.c) == pytest.approx((bifurcation(m, n, 0.3), m, m), rel=1e-14)
    one, two, four = (solve(m, n, 0.3, start, amplitude=k * 2e-5) for k in (1, 2, 4))
    for name, limit in (("kappa_n", start.kappa_n), ("kappa_star", m)):
        at = [getattr(point, name) for point in (one, two, four)]
        assert (8 * at[0] - 6 * at[1] + at[2]) / 3 == pytest.approx(limit, rel=1e-10)


def test_fold_of_the_single_loop():
    """(1, 2) at nu = .3: the fold from an earlier, separate 30-digit quadrature (repeated below)."""
    (fold,) = folds(1, 2)
    assert fold.kappa_n == pytest.approx(4.07566753526546525, abs=1e-13)
    assert fold.kappa_star == pytest.approx(1.5196609526, abs=1e-10)


def mp_closure(c, A, kappa_n, m, n, nu):
    """Both conditions of closure with mpmath's own quadrature over theta; the azimuth is that of d_2 or d_3."""
    a, b = c - nu * kappa_n, c - kappa_n
    q = A + 4 - 2 * b / a
    mu = mpmath.sign(m - bifurcation(m, n, float(nu))) * mpmath.sqrt(b * b + a * a * A * q)

    def rates(theta):  # length and azimuth in one complex integrand
        e = A * mpmath.sin(theta) ** 2
        if 2 * b > a * A:
            azimuth = 2 * mu * (b + a * e) / ((b - a * e) ** 2 + 4 * a * a * e)
        else:
            azimuth = 2 * mu * (b - a * e) / (mu * mu - 4 * a * a * e)
        return mpmath.mpc(2 * (1 + e) / c, azimuth) / mpmath.sqrt(e + q)

    total = mpmath.quad(rates, [0, mpmath.pi / 2])
    turns = total.imag / mpmath.pi - mpmath.mpf(m) / (2 * n)
    return total.real - mpmath.pi / (2 * n), (turns - mpmath.nint(turns)) * mpmath.pi


@pytest.mark.full
@pytest.mark.parametrize("m, n, which", [(1, 2, 0), (1, 3, 1)])
def test_fold_in_thirty_digits(m, n, which):
    """mpmath: kappa_n at the fold's A and beside it by findroot on the two closures; the vertex of the parabola."""
    fold = folds(m, n)[which]
    with mpmath.workdps(30):
        nu, delta = mpmath.mpf(3) / 10, mpmath.mpf(10) ** -6

        def kappa_n(A):
            closure = lambda c, kappa_n: mp_closure(c, A, kappa_n, m, n, nu)  # noqa: E731
            return mpmath.findroot(closure, (fold.c, fold.kappa_n), tol=1e-27)[1]

        before, at, after = (kappa_n(fold.eta_max_squared + k * delta) for k in (-1, 0, 1))
        slope, curvature = (after - before) / (2 * delta), (after - 2 * at + before) / delta**2
        assert abs(slope / curvature) < 1e-10  # distance in A to the vertex; kappa_n is in error by its square
        vertex = at - slope**2 / (2 * curvature)
        assert abs(vertex - fold.kappa_n) < 1e-13
        if (m, n) == (1, 2):
            assert abs(vertex - mpmath.mpf("4.07566753526546525")) < 1e-17


@pytest.mark.sample(1)
@pytest.mark.parametrize(
    "m, n, nu, pick",
    [
        (1, 2, 0.3, "late"),
        (1, 4, 0.3, "widest"),
        (3, 1, 0.3, "late"),
        (4, 3, 0.3, "late"),
        (1, 3, 0.0, "widest"),
        (5, 6, -0.3, "late"),
        (1, 7, 0.5, "late"),
    ],
)
def test_frame_equations_close(m, n, nu, pick):
    """The full loop, integrated: M = mu e_z in the lab, omega = dH/dM from (9) in closed form, d_i' = omega x d_i.

    Frame and centreline must close, eta must reach eta_max, and (28), (7) must be the integrals over the loop.
    """
    points = curve(m, n, nu)
    point = max(points, key=lambda p: p.eta_max_squared) if pick == "widest" else points[3 * len(points) // 4]

    def strains(directors):
        moment_1, _, moment_3 = point.mu * directors[:, 2]
        p = moment_1 + (1 - nu) * point.kappa_n
        root = np.hypot(p, moment_3)
        a = (p + root) / 2
        c = nu * point.kappa_n + a
        return np.array([c * (1 + p / root) / 2, 0, c * moment_3 / (2 * root)])

    def rhs(_, y):
        directors = y[:9].reshape(3, 3)
        omega = strains(directors)
        eta_squared = (omega[2] / omega[0]) ** 2
        kappa_star = omega[0] * (1 + nu * eta_squared)
        energy = (omega[0] * (1 + eta_squared)) ** 2 / 2 - point.kappa_n * kappa_star
        turning = np.cross(omega @ directors, directors)
        return np.concatenate([turning.ravel(), directors[2], [kappa_star, energy]])

    height = (point.c - point.kappa_n) / point.mu  # d_1 . e_z where eta = 0: M_1 = b there, M_3 = 0
    side = np.sqrt(1 - height**2)
    start = np.array([[0, side, height], [0, -height, side], [1, 0, 0]])
    accuracy = {"method": "DOP853", "rtol": 1e-12, "atol": 1e-15}
    times = np.array([0, 1 / (4 * n), 1]) * 2 * np.pi
    solution = solve_ivp(rhs, times[[0, -1]], np.r_[start.ravel(), np.zeros(5)], t_eval=times, **accuracy)
    quarter, last = solution.y.T[1:]
    assert np.abs(last[:9] - start.ravel()).max() < 1e-9
    assert np.abs(last[9:12]).max() < 1e-9
    assert last[12:] / (2 * np.pi) == pytest.approx([point.kappa_star, point.energy], abs=1e-9)
    omega = strains(quarter[:9].reshape(3, 3))
    assert (omega[2] / omega[0]) ** 2 == pytest.approx(point.eta_max_squared, rel=1e-8)


def test_ends():
    """By symmetry of the closure (m and 2n - m are congruent up to sign modulo 2n); kappa_n there is (27) again."""
    assert end(1, 2, 0.3) == (3, pytest.approx(-0.5, rel=1e-14))
    assert end(5, 6, 0.3) == (7, pytest.approx(bifurcation(7, 6, 0.3), rel=1e-14))
    assert end(3, 1, 0.3) is None
    assert end(1, 7, 0.3) is None  # computed here: beta exceeds 1/nu, kappa_n passes through infinity
    assert end(1, 2, -0.5) is None  # (27) has 1 - nu beta = -2 at m = 1 and 14/9 at m = 3: infinite in between


@pytest.mark.sample(4)
@pytest.mark.parametrize("m, n", MODES)
def test_curves_close_and_stop_where_they_should(m, n):
    """Every point satisfies both closures, in the raw unknowns (c, A, kappa_n); the last one is a circle or a limit."""
    points = curve(m, n)
    defects = [residuals(p.c, p.eta_max_squared, p.kappa_n, m, n, 0.3) for p in points]
    assert np.abs(defects).max() < 1e-11  # q ~ 1e-4 on (7, 1), lost in part in A + 4 - 2 beta
    last, circle = points[-1], end(m, n, 0.3)
    if last.label == "BP":
        assert (2 * n - m, bifurcation(2 * n - m, n, 0.3)) == circle
        assert (last.kappa_star, last.kappa_n) == pytest.approx(circle, rel=1e-13)
        assert points[-2].kappa_star == pytest.approx(last.kappa_star, abs=1.0)  # continuous up to the end
    else:
        assert last.label == "EP" and last.kappa_n == pytest.approx(-100, rel=1e-11)


@pytest.mark.sample(2)
@pytest.mark.parametrize("m, n, nu", [(1, 7, 0.0), (1, 7, 0.5), (7, 2, -0.85), (1, 4, -0.85), (5, 3, -0.3), (7, 1, 0.1)])
def test_curves_at_other_poisson_ratios(m, n, nu):
    """As above, with eta_max^2 up to 10^3 and q down to 10^-31: closures hold wherever q survives the subtraction."""
    points = curve(m, n, nu, step=0.1)
    defects = [residuals(p.c, p.eta_max_squared, p.kappa_n, m, n, nu) for p in points if p.q > 1e-3]
    assert np.abs(defects).max() < 1e-9
    assert points[-1].label in ("BP", "EP")


@pytest.mark.full
def test_number_of_folds():
    """Bifurcation diagram at nu = .3: (1,3) turns twice, (3,4) once near 5.329, (5,6) never, (1,n >= 4) far out."""
    maximum, minimum = folds(1, 3)
    assert maximum.kappa_n > bifurcation(1, 3, 0.3) > minimum.kappa_n
    assert [fold.kappa_n for fold in folds(3, 4)] == pytest.approx([5.329], abs=5e-4)
    assert folds(5, 6) == [] == folds(3, 1)
    assert all(folds(1, n)[0].kappa_n > 20 and folds(1, n)[0].eta_max_squared > 9 for n in (4, 5, 6, 7))


@pytest.mark.sample(1)
@pytest.mark.parametrize("m, n", [(1, 2), (1, 4), (3, 5)])
def test_both_ends_see_the_same_branch(m, n):
    """Followed from either circle, a branch has the same folds: kappa_n, kappa* and the energy agree to round-off."""
    forth, back = folds(m, n), folds(2 * n - m, n)[::-1]
    for one, other in zip(forth, back, strict=True):
        for name in ("kappa_n", "kappa_star", "energy"):
            assert getattr(one, name) == pytest.approx(getattr(other, name), rel=1e-11)
        assert one.kappa_n == pytest.approx(other.kappa_n, rel=1e-13)


def test_branch_does_not_depend_on_nu():
    """The precession contains (A, q) only: the points of two Poisson's ratios share c, A and q, not kappa_n."""
    points = [[p for p in curve(1, 2, nu) if p.label == ""] for nu in (0.0, 0.5)]
    shared = [[(p.c, p.eta_max_squared, p.q) for p in some] for some in points]
    assert np.allclose(*shared, rtol=1e-12, atol=0)
    assert points[0][5].kappa_n != pytest.approx(points[1][5].kappa_n, rel=0.1)


def test_conjugate_quantity():
    """(28): kappa* = -dE/dkappa_n along a branch of equilibria, E = energy (7) over L; central difference."""
    at = next(p for p in curve(1, 3) if p.kappa_star > 2.5)
    one, other = (solve(1, 3, 0.3, at, kappa_n=at.kappa_n + step) for step in (1e-4, -1e-4))
    assert (other.energy - one.energy) / 2e-4 == pytest.approx(at.kappa_star, rel=1e-7)


def test_quadrature_against_the_midpoint_rule():
    """Off the branches too: midpoints in theta (exponentially convergent: analytic, periodic), for either azimuth."""
    theta = (np.arange(4000) + 0.5) * np.pi / 8000
    draw = np.random.default_rng(1)
    for _ in range(200):
        c, A, kappa_n, nu = draw.uniform(1, 9), draw.uniform(0.01, 20), draw.uniform(-30, 8), draw.uniform(0, 0.5)
        a, b, e = c - nu * kappa_n, c - kappa_n, A * np.sin(theta) ** 2
        q = A + 4 - 2 * b / a
        if a <= 0.1 or q < 0.01 or min(abs(b), abs(b - a * A)) < 0.1 * a:
            continue
        mu, root = -np.sqrt(b * b + a * a * A * q), np.sqrt(e + q)
        length = np.mean(np.pi * (1 + e) / (c * root)) - np.pi / 4
        by_d2 = np.mean(np.pi * mu * (b + a * e) / (((b - a * e) ** 2 + 4 * a * a * e) * root)) - np.pi / 4
        by_d3 = np.mean(np.pi * mu * (b - a * e) / ((mu * mu - 4 * a * a * e) * root)) - np.pi / 4
        got = residuals(c, A, kappa_n, 1, 2, nu)
        assert got[0] == pytest.approx(length, abs=1e-11)
        for azimuth in (by_d2, by_d3):
            assert abs(np.sin(got[1] - azimuth)) < 1e-10


def test_solve():
    """A point of the curve is found again from a rough guess, by either target, from an ExactPoint or a triple."""
    here = next(p for p in curve(1, 2) if p.kappa_star > 2)
    rough = here.c * 1.01, here.eta_max_squared * 0.98, here.kappa_n + 0.02
    for target in ({"kappa_n": here.kappa_n}, {"amplitude": here.eta_max_squared}):
        found = solve(1, 2, 0.3, rough, **target)
        for name, value in dataclasses.asdict(here).items():
            assert name == "label" or getattr(found, name) == pytest.approx(value, rel=1e-11)
    assert solve(1, 2, 0.3, here, kappa_n=here.kappa_n + 0.1).kappa_n == pytest.approx(here.kappa_n + 0.1, rel=1e-13)


def test_refusals(monkeypatch):
    """Input without a solution is refused with a reason."""
    with pytest.raises(ValueError, match="rigid"):
        bifurcation(2, 2, 0.3)
    with pytest.raises(ValueError, match="multiple of 2n"):
        curve(2, 1)  # found by integrating the centreline: the frame closes, the loop stays open by 2.5 at A = 2.8
    with pytest.raises(ValueError, match="nu"):
        end(1, 2, 1.0)
    with pytest.raises(ValueError, match="starts at"):
        curve(1, 2, 0.3, kappa_limits=(-10, 2))
    with pytest.raises(ValueError, match="starts at"):
        curve(1, 2, {"nu": 0.3, "Gamma": 8.0}, (-100, 3.2), law="finite width")
    with pytest.raises(ValueError, match="oscillate"):
        residuals(1.0, 0.1, -1e3, 1, 2, 0.3)
    with pytest.raises(ValueError, match="exactly one"):
        solve(1, 2, 0.3, (1.0, 0.1, 2.5))
    with pytest.raises(RuntimeError, match="no convergence"):
        solve(1, 2, 0.3, folds(1, 2)[0], kappa_n=4.2)
    monkeypatch.setattr(exact, "_HOMOCLINIC", -3.0)
    assert curve(7, 1)[-1].label == "MX"
