"""Branches by collocation on the three domains, against the exact quadrature and against each other."""

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from contin import Settings, trace
from contin.lowlevel import correct, point_of
from ribbon_model import exact
from ribbon_model.domains import HALF_LOOP, LOOP
from ribbon_model.equilibrium import directors, on_directors
from ribbon_model.laws import FLAT_ROD, ISOTROPIC_ROD, RIBBON
from ribbon_model.linear import thresholds
from ribbon_model.seeds import half_loop_branch, primary_branch
from ribbon_model.solution import Solution

NU = 0.3


@pytest.fixture(scope="module")
def branch():
    """(1, 2), the branch of Fig. 11, at the settings that scenes use by default."""
    system, x, tangent = primary_branch(RIBBON, 1, 2, NU, 10, 7)
    return trace(point_of(system, x), Settings(trivial="M2", limits={"kappa_n": (-100, 100)}, errors=True), tangent=tangent)


def test_fold_and_end_of_m1_n2(branch):
    """The fold by quadrature, and 4.08 of section 6.3; the end at 3 K^{3,2} = -0.5 by equation (27)."""
    (fold,) = branch.labelled("LP")
    assert abs(fold["kappa_n"] - 4.07566753526546525) < 1e-10
    assert round(fold["kappa_n"], 2) == 4.08
    assert fold["kappa_star"] == pytest.approx(1.5196609526, abs=1e-9)
    assert branch.stop.reason == "trivial branch"
    assert abs(branch.points[-1]["kappa_n"] + 0.5) < 1e-8
    assert branch.points[-1]["kappa_star"] == pytest.approx(3, abs=1e-9)


def test_conserved_quantities_and_closure_along_the_branch(branch):
    assert len(branch) > 20
    for point in branch.points[1:-1]:
        solution = Solution.of(point)
        kept = {name: values[:: solution.degree] for name, values in solution.invariants().items()}  # at mesh points
        assert np.abs(kept["norm"] - 1).max() < 1e-10
        assert np.ptp(kept["hamiltonian"]) < 1e-10
        strip = solution.shape()
        assert strip.arclength[-1] == pytest.approx(2 * np.pi, abs=1e-12)
        assert strip.closure() < 1e-10


def test_the_loop_closes_by_an_independent_integration(branch):
    """DOP853 over the whole length, from the constants of the cell alone: frame and centreline come back."""
    for point in branch.points[3:-1:6]:
        p = point.parameters

        def rate(s, y, p=p):
            moment = on_directors(*y[:4], p["M1"], p["M2"], 0.0)
            _, w1, w2, w3, _ = RIBBON.response(*moment, p["kappa_n"], p["nu"])
            a, b, c, d = y[:4]
            turn = np.array([[0, -w1, -w2, -w3], [w1, 0, w3, -w2], [w2, -w3, 0, w1], [w3, w2, -w1, 0]])
            return np.concatenate([turn @ [a, b, c, d] / 2, directors(*y[:4])[6:]])

        end = solve_ivp(rate, (0, 2 * np.pi), [1.0, 0, 0, 0, 0, 0, 0], method="DOP853", rtol=1e-13, atol=1e-14).y[:, -1]
        assert np.abs(end[1:]).max() < 1e-10
        assert abs(abs(end[0]) - 1) < 1e-10


def test_the_full_loop_confirms_a_shape_and_finds_it_from_afar(branch):
    """Gauge and phase fixed: the unfolded cell satisfies the loop's equations with R = 0, and Newton returns to it."""
    point = branch.points[9]
    system, guess = Solution.of(point).on(LOOP).discretized()
    row = np.zeros(system.size)
    row[system.parameter_index("kappa_n")] = 1.0
    assert np.abs(system.residual(guess)).max() < 1e-10
    disturbed = guess + 1e-3 * np.random.default_rng(0).standard_normal(guess.size)
    done = correct(system, disturbed, row, point["kappa_n"])
    values = system.all_parameters(done.x)
    assert np.abs(values[[5, 6, 7, 8]]).max() < 1e-10  # R1, R2, R3 and the unfolding parameter
    assert system.functionals(done.x) == pytest.approx([point["kappa_star"], point["energy"]], abs=1e-10)


def test_the_half_loop_finds_every_wavenumber_and_follows_the_same_branch(branch):
    """Circle bifurcations 2.5, 2.931, 3.1 of m = 1 from (27), as simple branch points; then (1, 2), with R3 free but zero."""
    system = HALF_LOOP.discretize(RIBBON, 12, 6, {"nu": NU})
    settings = Settings(limits={"kappa_n": (0, 3.15)}, max_step=0.05)
    points = trace(point_of(system, HALF_LOOP.circle(system, 1, 2.0)), settings).labelled("BP")
    expected = [thresholds(RIBBON, 1, n, NU)[0] for n in (2, 3, 4)]
    assert [point["kappa_n"] for point in points] == pytest.approx(expected, abs=1e-9)
    system, x, tangent = half_loop_branch(RIBBON, 1, 2, NU, 16, 6)
    other = trace(point_of(system, x), Settings(trivial="M2", limits={"kappa_n": (-100, 100)}, errors=True), tangent=tangent)
    assert other.labelled("LP")[0]["kappa_n"] == pytest.approx(branch.labelled("LP")[0]["kappa_n"], abs=1e-10)
    assert np.abs(other.column("R3")).max() < 1e-9
    assert other.points[-1]["kappa_n"] == pytest.approx(-0.5, abs=1e-8)


@pytest.mark.sample(1)
@pytest.mark.parametrize(("m", "n"), [(1, 3), (3, 4), (3, 5), (5, 6), (1, 4)])
def test_folds_and_ends_against_the_quadrature(m, n):
    system, x, tangent = primary_branch(RIBBON, m, n, NU, 10, 7)
    found = trace(point_of(system, x), Settings(trivial="M2", limits={"kappa_n": (-100, 100)}, errors=True), tangent=tangent)
    expected = exact.folds(m, n, NU)
    folds = found.labelled("LP")
    assert [p["kappa_n"] for p in folds] == pytest.approx([p.kappa_n for p in expected], abs=1e-9)
    assert [p["kappa_star"] for p in folds] == pytest.approx([p.kappa_star for p in expected], abs=1e-8)
    assert all(abs(p["kappa_n"] - e.kappa_n) <= 10 * p.errors["kappa_n"] + 1e-11 for p, e in zip(folds, expected))
    covering, kappa_n = exact.end(m, n, NU)
    assert found.points[-1]["kappa_n"] == pytest.approx(kappa_n, abs=1e-8)
    assert found.points[-1]["kappa_star"] == pytest.approx(covering, abs=1e-8)


def test_a_branch_that_runs_away():
    """(3, 1) has 2 n < m: it goes to kappa_n -> -infinity; at -60 it is where the quadrature says."""
    system, x, tangent = primary_branch(RIBBON, 3, 1, NU, 10, 7)
    found = trace(point_of(system, x), Settings(trivial="M2", limits={"kappa_n": (-60, 100)}), tangent=tangent)
    assert found.stop.reason == "limit" and not found.labelled("LP")
    end = exact.curve(3, 1, NU, kappa_limits=(-60.0, 100.0))[-1]
    assert found.points[-1]["kappa_n"] == pytest.approx(-60, abs=1e-10)
    assert found.points[-1]["kappa_star"] == pytest.approx(end.kappa_star, abs=1e-9)


@pytest.mark.parametrize("law", [FLAT_ROD, ISOTROPIC_ROD], ids=lambda law: law.name)
def test_rods_leave_the_circle_downwards_and_have_no_fold(law):
    """Section 6.3: for rods no fold exists on the branch from m = 1 to m = 3; it ends where (25b) says for (3, 2)."""
    system, x, tangent = primary_branch(law, 1, 2, NU, 10, 7)
    found = trace(point_of(system, x), Settings(trivial="M2", limits={"kappa_n": (-100, 100)}), tangent=tangent)
    assert not found.labelled("LP")
    assert found.points[-1]["kappa_star"] == pytest.approx(3, abs=1e-8)
    assert min(abs(found.points[-1]["kappa_n"] - k) for k in thresholds(law, 3, 2, NU)) < 1e-8


def test_what_does_not_close_is_refused():
    with pytest.raises(ValueError, match="m / n even"):
        primary_branch(RIBBON, 2, 1, NU)


@pytest.mark.full
def test_a_secondary_branch_on_the_half_loop():
    """(3, 1) for nu = .3 loses a mode of the half loop twice on its way to -infinity; the branch between has R != 0.

    The two values come from runs of their own: branch points of the primary branch, and places where the secondary one,
    followed from the first, has R = 0 again. (That an index changes near -22 is known from a Fourier computation.)
    """
    system, x, tangent = half_loop_branch(RIBBON, 3, 1, NU, 16, 6)
    primary = trace(point_of(system, x), Settings(trivial="M2", limits={"kappa_n": (-200, 100)}), tangent=tangent)
    first, second = primary.labelled("BP")
    assert first["kappa_n"] == pytest.approx(-21.6, abs=0.5)
    loop_around = trace(first, branch=1, limits={"kappa_n": (-300, 100)})
    assert loop_around.stop.reason == "closed"
    assert np.abs(loop_around.column("R3")).max() > 1
    (meeting,) = loop_around.labelled("BP")
    assert meeting["kappa_n"] == pytest.approx(second["kappa_n"], abs=1e-7)
    assert abs(meeting["R3"]) < 1e-8
