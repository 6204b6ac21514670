"""The rods' quadratures against the linear theory, the integrated frame equations, the collocation; digits on demand."""

import dataclasses

import mpmath
import numpy as np
import pytest
from scipy.integrate import solve_ivp

from contin import Settings, trace
from contin.lowlevel import point_of
from ribbon_model.exact import curve, end, folds, refine, solve
from ribbon_model.laws import LAWS
from ribbon_model.linear import thresholds
from ribbon_model.seeds import primary_branch

BRANCHES = [("flat rod", 0), ("isotropic rod", 0), ("isotropic rod", 1)]
MODES = [(m, n) for m in (1, 3, 5, 7) for n in range(1, 8) if n != m]
SOME = [(1, 2), (3, 4), (7, 3), (3, 1)]
each_branch = pytest.mark.parametrize("law, root", BRANCHES)


@pytest.mark.sample(1)
@each_branch
@pytest.mark.parametrize("nu", [-0.6, 0.0, 0.3])
def test_branches_leave_and_end_on_circles(law, root, nu):
    """A = 0 is b = 0 in (25b), at both ends; the ends follow from the closure: |m' -+ n| = |m -+ n|. No fold on the way.

    The absence of folds is section 6.3 of Audoly & Seffen (2015) for (1, 2), and computed here for the others.
    """
    for m, n in MODES if nu == 0.3 else SOME:
        points = curve(m, n, nu, (-300, 300), step=0.5, law=law, root=root)
        first, last = points[0], points[-1]
        assert (first.label, first.amplitude) == ("BP", 0)
        assert first.kappa_n == pytest.approx(thresholds(LAWS[law], m, n, nu)[root], rel=1e-13)
        assert first.kappa_star == pytest.approx(m, rel=1e-13)
        assert first.mu == pytest.approx(m - first.kappa_n, rel=1e-12)  # M = m - kappa_n on a circle
        index = -2 * n - m if root else 2 * n - m
        if law == "flat rod" and index < 0:
            assert (m, n) not in SOME or end(m, n, nu, law) is None
            assert (last.label, last.kappa_n) == ("EP", pytest.approx(300, rel=1e-11))
            assert last.kappa_star == pytest.approx(index, abs=0.03)  # homoclinic to that circle
        else:
            # omega_1 < 0 is omega_1 > 0 with d_1 and kappa_n reversed: then the root of the other sign, except on root 1
            if abs(index) == n:  # K = 1 is the rigid motion there; K = -1/(1 + nu), the other root of (25b), is not
                there = n / (1 + nu)
            else:
                there = np.sign(index) * thresholds(LAWS[law], abs(index), n, nu)[0 if root else int(index < 0)]
            assert last.label == "BP"
            assert (m, n) not in SOME or end(m, n, nu, law, root) == (index, pytest.approx(there, rel=1e-13))
            assert (last.kappa_star, last.kappa_n) == pytest.approx((index, there), rel=1e-12)
            assert points[-2].kappa_star == pytest.approx(index, abs=6.0)  # continuous up to the end
        slopes = np.diff([point.kappa_n for point in points])
        assert not [point for point in points if point.label == "LP"]
        assert law == "isotropic rod" and nu == 0 or np.all(slopes > 0) or np.all(slopes < 0)


@pytest.mark.full
@each_branch
def test_small_amplitude(law, root):
    """kappa_n tends to the threshold linearly in A: extrapolated to A = 0, error O(A^3)."""
    for m, n in [(1, 2), (3, 4), (5, 2)]:
        start = curve(m, n, law=law, root=root)[0]
        values = [solve(m, n, 0.3, start, amplitude=k * 2e-5, law=law, root=root).kappa_n for k in (1, 2, 4)]
        expected = thresholds(LAWS[law], m, n, 0.3)[root]
        assert (8 * values[0] - 6 * values[1] + values[2]) / 3 == pytest.approx(expected, rel=1e-11)


@pytest.mark.sample(1)
@each_branch
@pytest.mark.parametrize("m, n, nu", [(1, 2, 0.3), (1, 4, 0.3), (3, 4, 0.5), (5, 6, -0.3), (5, 2, 0.3)])
def test_frame_equations_close(law, root, m, n, nu):
    """The full loop, integrated: M = mu e_z in the lab, omega = dH/dM by (10), (11), d_i' = omega x d_i.

    Frame and centreline must close, M_2 vanish after a quarter wave, kappa* and the energy be the integrals over the loop.
    """
    points = curve(m, n, nu, (-100, 25), law=law, root=root)
    point = points[len(points) // 2]
    alpha, beta = (0, (1 + nu) / 2) if law == "flat rod" else (1, 1 + nu)

    def rhs(_, y):
        directors = y[:9].reshape(3, 3)
        moment = point.mu * directors[:, 2]
        omega = np.array([moment[0] + point.kappa_n, alpha * moment[1], beta * moment[2]])
        energy = (omega[0] ** 2 + omega[1] ** 2 + omega[2] ** 2 / beta) / 2 - point.kappa_n * omega[0]
        turning = np.cross(omega @ directors, directors)
        return np.concatenate([turning.ravel(), directors[2], [omega[0], energy]])

    moment_1 = np.sqrt(2 * point.H) - point.kappa_n if law == "flat rod" else point.constant * point.kappa_n
    height = moment_1 / point.mu
    side = np.sqrt(1 - height**2)
    start = np.array([[0, side, height], [0, -height, side], [1, 0, 0]])
    assert (moment_1 + point.kappa_n) ** 2 + alpha * (point.mu * side) ** 2 == pytest.approx(2 * point.H, rel=1e-12)
    times = np.array([0, 1 / (4 * n), 1]) * 2 * np.pi
    accuracy = {"method": "DOP853", "rtol": 1e-12, "atol": 1e-14}
    solution = solve_ivp(rhs, times[[0, -1]], np.r_[start.ravel(), np.zeros(5)], t_eval=times, **accuracy)
    quarter, last = solution.y.T[1:]
    assert np.abs(last[:12] - np.r_[start.ravel(), np.zeros(3)]).max() < 1e-9
    assert last[12:] / (2 * np.pi) == pytest.approx([point.kappa_star, point.energy], abs=1e-9)
    assert abs(quarter[5]) < 1e-10


@pytest.mark.sample(2)
@pytest.mark.parametrize("m, n", [(1, 2), (1, 4), (3, 4), (3, 1)])
@each_branch
def test_against_the_collocation(law, root, m, n):
    """Both ends, and kappa* half-way at the collocation's own kappa_n. (3, 1) of the flat rod goes to the limit."""
    system, x, tangent = primary_branch(LAWS[law], m, n, 0.3, 8, 7, root=root)
    settings = Settings(trivial="M2", limits={"kappa_n": (-100, 60)})
    found = trace(point_of(system, x), settings, tangent=tangent).points
    points = curve(m, n, 0.3, (-100, 60), law=law, root=root)
    for one, other in ((found[0], points[0]), (found[-1], points[-1])):
        assert (one["kappa_n"], one["kappa_star"]) == pytest.approx((other.kappa_n, other.kappa_star), abs=1e-9)
    middle = found[len(found) // 2]
    near = min(points, key=lambda point: abs(point.kappa_n - middle["kappa_n"]))
    there = solve(m, n, 0.3, near, kappa_n=float(middle["kappa_n"]), law=law, root=root)
    assert middle["kappa_star"] == pytest.approx(there.kappa_star, abs=1e-7)  # a regular point, on its own mesh
    assert np.hypot(middle["M1"], middle["M2"]) == pytest.approx(abs(there.mu), abs=1e-7)


@pytest.mark.full
@pytest.mark.parametrize("law, A", [("flat rod", 1e3), ("isotropic rod", 3.0)])
def test_precession_by_the_other_directors(law, A):
    """(3, 1): azimuths of d_2, d_3 integrated by mpmath over the angle phi or M_3, close too, modulo pi."""
    point = solve(3, 1, 0.3, next(p for p in curve(3, 1, law=law) if p.amplitude > A), amplitude=A, law=law)
    flat, kappa_n, mu = law == "flat rod", point.kappa_n, point.mu
    alpha, beta = (0, 0.65) if flat else (1, 1.3)

    def rates(angle):  # phi = phi_max sin(angle), or M_3 = its maximum times sin(angle)
        if flat:
            C, largest = mpmath.sqrt(2 * point.H), 2 * mpmath.atan(mpmath.sqrt(A))
            phi = largest * mpmath.sin(angle)
            M1, M3 = C * mpmath.cos(phi) - kappa_n, C * mpmath.sin(phi) / mpmath.sqrt(beta)
            M2 = mpmath.sqrt(mu**2 - M1**2 - M3**2)
            pace = largest * mpmath.cos(angle) / (mpmath.sqrt(beta) * M2)  # phi' = sqrt(beta) M_2
        else:
            M3 = mpmath.sqrt(A) * kappa_n * mpmath.sin(angle)
            M1 = kappa_n * point.constant - 0.3 * M3**2 / (2 * kappa_n)
            M2 = mpmath.sqrt(mu**2 - M1**2 - M3**2)
            pace = mpmath.sqrt(A) * mpmath.cos(angle) / M2  # M_3' = kappa_n M_2
        along = [M1 * (M1 + kappa_n), alpha * M2**2, beta * M3**2]
        squares = [M1**2, M2**2, M3**2]
        return [pace * mu * (sum(along) - along[i]) / (mu**2 - squares[i]) for i in (1, 2)] + [pace]

    with mpmath.workdps(20):
        nodes = [0, 0.5, 1, 1.3, 1.5, 1.55, mpmath.pi / 2 - mpmath.mpf(10) ** -6]
        by_d2, by_d3, length = (mpmath.quad(lambda t, i=i: rates(t)[i], nodes) for i in (0, 1, 2))
    assert float(length) == pytest.approx(np.pi / 2, abs=1e-5)  # the last 1e-6 of the angle are left out
    for azimuth in (by_d2, by_d3):
        assert abs(np.sin(float(azimuth) - 3 * np.pi / 2)) < 1e-4


@each_branch
def test_conjugate_quantity(law, root):
    """(28): kappa* = -dE/dkappa_n along a branch of equilibria, central difference."""
    points = curve(1, 3, law=law, root=root)
    at = points[len(points) // 2]
    one, other = (solve(1, 3, 0.3, at, kappa_n=at.kappa_n + step, law=law, root=root) for step in (1e-4, -1e-4))
    assert (other.energy - one.energy) / 2e-4 == pytest.approx(at.kappa_star, rel=1e-7)


def test_both_ends_see_the_same_branch():
    """(3, 1) of the isotropic rod, and from its other end, d_1 reversed, root 1 of (1, 1): the same in -kappa_n, -kappa*."""
    forth, back = curve(3, 1, law="isotropic rod"), curve(1, 1, law="isotropic rod", root=1)
    assert back[0].kappa_n == pytest.approx(-1 / 1.3, rel=1e-14) == -forth[-1].kappa_n
    assert (back[-1].kappa_n, back[-1].kappa_star) == pytest.approx((-forth[0].kappa_n, -3), rel=1e-13)
    at = forth[len(forth) // 2]
    near = min(back, key=lambda point: abs(point.kappa_n + at.kappa_n))
    same = solve(1, 1, 0.3, near, kappa_n=-at.kappa_n, law="isotropic rod", root=1)
    assert (same.kappa_star, same.amplitude, same.energy) == pytest.approx((-at.kappa_star, at.amplitude, at.energy), rel=1e-11)


@pytest.mark.full
def test_isotropic_rod_without_poisson_effect():
    """nu = 0: M_1 is constant, M_3 harmonic: kappa_n = +-n all along the branch, U^2 + A = (m/n -+ 1)^2."""
    for root, sense in ((0, 1), (1, -1)):
        for point in curve(1, 3, 0.0, law="isotropic rod", root=root):
            assert point.kappa_n == pytest.approx(3 * sense, rel=1e-14)
            assert point.constant**2 + point.amplitude == pytest.approx((1 / 3 - sense) ** 2, rel=1e-12)
    tiny, zero = (curve(1, 3, nu, law="isotropic rod")[8] for nu in (1e-9, 0.0))
    assert tiny.kappa_star == pytest.approx(zero.kappa_star, abs=1e-7)


def test_solve():
    """A point is found again from its neighbour, by either target."""
    for law, root in BRANCHES:
        points = curve(1, 2, law=law, root=root)
        here, near = points[len(points) // 2 : len(points) // 2 + 2]
        for target in ({"kappa_n": here.kappa_n}, {"amplitude": here.amplitude}):
            found = solve(1, 2, 0.3, near, law=law, root=root, **target)
            if found.kappa_n == pytest.approx(here.kappa_n, rel=1e-6):  # an amplitude occurs twice
                for name, value in dataclasses.asdict(here).items():
                    assert name in ("label", "law") or getattr(found, name) == pytest.approx(value, rel=1e-10)
            else:
                assert "amplitude" in target


@pytest.mark.full
def test_refine_a_fold():
    """(1, 2) of the ribbon, nu = 3/10: kappa_n from an earlier, separate 30-digit quadrature (see test_exact)."""
    (fold,) = folds(1, 2)
    kappa_n, kappa_star = refine(fold, 20)
    with mpmath.workdps(25):
        assert abs(kappa_n - mpmath.mpf("4.07566753526546525")) < 1e-17
        assert float(kappa_star) == pytest.approx(fold.kappa_star, abs=1e-10)  # linear in the fold's own error


@pytest.mark.full
def test_refine_points_of_the_rods():
    """A circle gives (25b) in exact arithmetic; elsewhere kappa_n is kept and kappa* agrees with double precision."""
    with mpmath.workdps(25):
        flat = 1 + 6 / mpmath.mpf("1.3")
        isotropic = (mpmath.mpf("0.3") + mpmath.sqrt(mpmath.mpf("0.09") + 16 * mpmath.mpf("1.3"))) / mpmath.mpf("2.6")
        for law, expected in (("flat rod", flat), ("isotropic rod", isotropic)):
            points = curve(1, 2, law=law)
            kappa_n, kappa_star = refine(points[0], 18)
            assert abs(kappa_n - expected) < 1e-17 and abs(kappa_star - 1) < 1e-17
        middle = points[len(points) // 2]
        kappa_n, kappa_star = refine(middle, 15)
        assert abs(kappa_n - mpmath.mpf(repr(middle.kappa_n))) < 1e-15
        assert float(kappa_star) == pytest.approx(middle.kappa_star, rel=1e-13)


def test_refusals():
    """Input without a solution is refused with a reason."""
    with pytest.raises(ValueError, match="none of"):
        curve(1, 2, law="rope")
    with pytest.raises(ValueError, match="threshold"):
        curve(1, 2, law="flat rod", root=1)
    with pytest.raises(ValueError, match="multiple of 2n"):
        end(2, 1, 0.3, "isotropic rod")
    with pytest.raises(ValueError, match="exactly one"):
        solve(1, 2, 0.3, curve(1, 2, law="flat rod")[3], kappa_n=1.0, amplitude=0.1, law="flat rod")
    with pytest.raises(ValueError, match="starts at"):
        curve(1, 2, kappa_limits=(0, 1), law="isotropic rod")
