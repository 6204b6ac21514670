"""Curves of special points in two parameters, and sensitivities, against closed forms and differences."""

import math

import numpy as np
import pytest

from contin import AlgebraicProblem, BoundaryValueProblem, ProblemError, curve, sensitivities, solve, trace


def cusp():
    """mu + lam x - x^3: folds at mu = -+ 2 (lam / 3)^(3/2), a cusp at the origin."""
    return AlgebraicProblem(lambda u, p: (p.mu + p.lam * u.x - u.x**3,), ["x"], {"mu": -3.0, "lam": 1.0})


def perturbed_gelfand():
    """u'' + lam exp(u / (1 + eps u)) = 0, u(0) = u(1) = 0."""
    return BoundaryValueProblem(
        lambda t, u, p: (u.v, -p.lam * math.exp(u.u / (1 + p.eps * u.u))), lambda a, b, p: (a.u, b.u), ["u", "v"],
        {"lam": 0.0, "eps": 0.2}, functionals={"mean": lambda t, u, p: u.u},
    )  # fmt: skip


def gelfand_branch(eps=0.2, **options):
    start = solve(perturbed_gelfand(), [0, 0], {"eps": eps}, intervals=12, degree=6)
    return trace(start, free=["lam"], limits={"lam": (0, 6), "mean": (-1, 30)}, errors=True, **options)


def test_fold_curve_through_its_cusp():
    fold = trace(solve(cusp(), [-1.5]), free=["mu"], limits={"mu": (-3, 3)}).labelled("LP")[0]
    assert fold["mu"] == pytest.approx(2 * 3**-1.5, abs=1e-12)
    folds = curve(fold, "lam", direction=-1, limits={"lam": (-1, 2), "mu": (-2, 2)})
    for point in folds:
        assert abs(point["mu"]) == pytest.approx(2 * (abs(point["lam"]) / 3) ** 1.5, abs=1e-10)
    labels = [point.label for point in folds if point.label]
    assert labels == ["EP", "CP", "EP"]
    assert abs(folds.labelled("CP")[0]["lam"]) < 1e-10 and abs(folds.labelled("CP")[0]["mu"]) < 1e-10
    assert folds.points[-1]["mu"] < 0  # beyond the cusp, on the other sheet


def test_fold_curve_of_a_boundary_value_problem():
    """Every point of the curve is a fold of the branch at its eps; the two folds of eps = .2 merge in one cusp."""
    folds = gelfand_branch().labelled("LP")
    assert len(folds) == 2
    found = curve(folds[0], "eps", limits={"eps": (0.15, 0.3)})
    (merged,) = found.labelled("CP")
    assert found.points[-1]["eps"] == pytest.approx(0.15, abs=1e-10)
    other = gelfand_branch(merged["eps"] + 1e-4)
    assert not other.labelled("LP")
    check = found.points[3]
    again = gelfand_branch(check["eps"]).labelled("LP")
    assert min(abs(point["lam"] - check["lam"]) for point in again) < 1e-8
    passing = [p for p in found.points if p["eps"] < 0.2][:1] + [p for p in found.points if p["eps"] > 0.2][-1:]
    assert passing  # the curve passes eps = .2 again on the side of the second fold


def test_sensitivity_of_a_fold():
    fold = trace(solve(cusp(), [-1.5]), free=["mu"], limits={"mu": (-3, 3)}).labelled("LP")[0]
    assert sensitivities(fold)["lam"]["mu"] == pytest.approx(3**-0.5, abs=1e-10)  # d/dlam of 2 (lam/3)^(3/2)
    fold = gelfand_branch().labelled("LP")[0]
    h = 1e-4
    slope = (gelfand_branch(0.2 + h).labelled("LP")[0]["lam"] - gelfand_branch(0.2 - h).labelled("LP")[0]["lam"]) / (2 * h)
    assert sensitivities(fold)["eps"]["lam"] == pytest.approx(slope, abs=1e-5)


def test_sensitivity_of_a_user_zero():
    """At mean u = 1/2 held: against differences of lam between runs at neighbouring eps."""

    def held(eps):
        return gelfand_branch(eps, zeros={"mean": [0.5]}).labelled("UZ")[0]

    h = 1e-3
    slope = (held(0.2 + h)["lam"] - held(0.2 - h)["lam"]) / (2 * h)
    assert sensitivities(held(0.2))["eps"]["lam"] == pytest.approx(slope, abs=1e-6)
    with pytest.raises(ProblemError, match="'lam' must be one of"):
        sensitivities(held(0.2), by=["lam"])


def elastica():
    return BoundaryValueProblem(
        lambda t, u, p: (u.v, -p.lam * math.sin(u.theta) - p.k * u.theta), lambda a, b, p: (a.v, b.v), ["theta", "v"],
        {"lam": 5.0, "k": 0.0},
    )  # fmt: skip


def test_branch_points_in_two_parameters():
    """lam = pi^2 - k: the curve, its vanishing imperfection, and the slope -1 at one point."""
    start = solve(elastica(), [0, 0], intervals=12, degree=6)
    point = trace(start, free=["lam"], limits={"lam": (1, 20)}).labelled("BP")[0]
    assert sensitivities(point)["k"]["lam"] == pytest.approx(-1, abs=1e-8)
    for direction in (1, -1):
        found = curve(point, "k", direction=direction, limits={"k": (-5, 5)})
        assert found.points[-1]["k"] == pytest.approx(5 * direction, abs=1e-10)
        for other in found:
            assert other["lam"] + other["k"] == pytest.approx(math.pi**2, abs=1e-9)
            assert abs(other.x[-1]) < 1e-12


def test_fold_meets_a_branch_point():
    """x^2 - mu^2 - lam = 0: folds of mu in lam at mu = -+ sqrt(-lam); at lam = 0 the two lines cross."""
    problem = AlgebraicProblem(lambda u, p: (u.x**2 - p.mu**2 - p.lam,), ["x"], {"mu": -2.0, "lam": -1.0})
    fold = trace(solve(problem, [1.5]), free=["mu"], limits={"mu": (-3, 3)}).labelled("LP")[0]
    assert fold["mu"] == pytest.approx(-1, abs=1e-12)
    found = curve(fold, "lam", limits={"lam": (-4, 2), "mu": (-3, 3)})
    (meeting,) = found.labelled("BP")
    assert (meeting["lam"], meeting["mu"]) == pytest.approx((0, 0), abs=1e-10)


def test_bad_starts():
    branch = trace(solve(cusp(), [-1.5]), free=["mu"], limits={"mu": (-3, 3)})
    with pytest.raises(ProblemError, match="neither a fold nor"):
        curve(branch.points[1], "lam")
    with pytest.raises(ProblemError, match="'mu' must be a parameter that is not free"):
        curve(branch.labelled("LP")[0], "mu")
    assert np.isfinite(branch.column("mu")).all()
