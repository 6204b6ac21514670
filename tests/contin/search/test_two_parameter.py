"""Curves of folds and of branch points in two parameters, and sensitivities, against closed forms and differences."""

import functools
import math

import numpy as np
import pytest

from bank import opt, units
from bank.closed_forms import cusp, elastica
from bank.gelfand import perturbed_gelfand
from contin import AlgebraicProblem, BoundaryValueProblem, Event, ProblemError, curve, solve, trace


def gelfand_branch(eps=0.2, highest=30.0, **options):
    start = solve(perturbed_gelfand(), [0, 0], {"eps": eps}, intervals=12, degree=6)
    return trace(start, free=["lam"], limits={"lam": (0, 6), "mean": (-1, highest)}, **options)


@functools.cache
def gelfand_folds(eps=0.2):
    return gelfand_branch(eps).labelled("LP")


@functools.cache
def cusp_branch():
    return trace(solve(cusp(), [-1.5]), free=["mu"], limits={"mu": (-3, 3)})


# --- folds ----------------------------------------------------------------------------------------------------------


def test_every_point_of_a_fold_curve_through_a_cusp():
    """mu = -+ 2 (lam / 3)^(3/2), from one sheet to the other (where the cusp is: in the bank of problems)."""
    fold = cusp_branch().labelled("LP")[0]
    folds = curve(fold, "lam", direction=-1, limits={"lam": (-1, 2), "mu": (-2, 2)})
    for point in folds:
        assert abs(point["mu"]) == pytest.approx(2 * (abs(point["lam"]) / 3) ** 1.5, abs=1e-10)
        assert 3 * point.x[0] ** 2 == pytest.approx(point["lam"], abs=1e-10)
    assert folds.points[0]["mu"] > 0 > folds.points[-1]["mu"]


@pytest.mark.parametrize("mu_unit", [1e-6, 1e-3, 1.0, 1e3, 1e6])
@pytest.mark.parametrize("lam_unit", [1e-6, 1e-3, 1.0, 1e3, 1e6])
def test_a_cusp_in_any_units(mu_unit, lam_unit):
    """At the cusp both parameters stand still; beside it the one in small units turns, whatever its share of the step is."""
    problem = AlgebraicProblem(
        lambda u, p: (p.mu / mu_unit + p.lam / lam_unit * u.x - u.x**3,), ["x"], {"mu": 0.0, "lam": lam_unit}
    )
    fold = trace(solve(problem, [-1.1]), free=["mu"], limits={"mu": (-3 * mu_unit, 3 * mu_unit)}).labelled("LP")[0]
    found = curve(fold, "lam", direction=-1, limits={"lam": (-lam_unit, 2 * lam_unit)})
    (merged,) = found.labelled("CP")
    assert (merged["lam"] / lam_unit, merged["mu"] / mu_unit, merged["x"]) == pytest.approx((0, 0, 0), abs=1e-9)


@pytest.mark.parametrize("seed", [0, 13, 15])
def test_folds_that_meet_a_branch_point_in_other_units(seed):
    """The left null vector turns by more than 90 degrees in one step there, where one equation has far larger units."""
    restated = units.restated("opt", seed)
    assert [units.complaint(restated, case) for case in restated.CASES] == ["", ""]


@pytest.mark.full
def test_fold_curve_of_a_boundary_value_problem():
    """Every point of the curve is a fold of the branch at its eps; the two folds of eps = .2 merge in one cusp."""
    folds = gelfand_folds()
    assert len(folds) == 2
    found = curve(folds[0], "eps", limits={"eps": (0.15, 0.3)}, zeros={"eps": [0.2]})
    (merged,) = found.labelled("CP")
    assert found.points[-1]["eps"] == pytest.approx(0.15, abs=1e-10)
    assert not gelfand_folds(merged["eps"] + 1e-4)
    # back at eps = .2 the curve is at the other fold
    (second,) = [point for point in found.labelled("UZ") if point.arclength > merged.arclength]
    for name in ("lam", "mean"):
        assert second[name] == pytest.approx(folds[1][name], abs=1e-8)
    regular = [point for point in found if not point.label]
    assert len(regular) > 5
    for point in regular:
        folds = gelfand_folds(point["eps"])
        assert min(abs(fold["lam"] - point["lam"]) + abs(fold["mean"] - point["mean"]) for fold in folds) < 1e-6


def test_fold_meets_a_branch_point():
    """x^2 - mu^2 - lam = 0: folds of mu in lam at mu = -+ sqrt(-lam); at lam = 0 the two lines cross."""
    problem = AlgebraicProblem(lambda u, p: (u.x**2 - p.mu**2 - p.lam,), ["x"], {"mu": -2.0, "lam": -1.0})
    fold = trace(solve(problem, [1.5]), free=["mu"], limits={"mu": (-3, 3)}).labelled("LP")[0]
    assert fold["mu"] == pytest.approx(-1, abs=1e-12)
    found = curve(fold, "lam", limits={"lam": (-4, 2), "mu": (-3, 3)})
    (meeting,) = found.labelled("BP")
    assert (meeting["lam"], meeting["mu"]) == pytest.approx((0, 0), abs=1e-10)
    for point in found:
        assert point["mu"] ** 2 + point["lam"] == pytest.approx(0, abs=1e-10)


def test_a_curve_of_folds_ends_at_a_pitchfork():
    """x (mu + a x^2 - x^4) = 0: folds at a = 2 x^2, mu = -x^4. At x = 0 the defining system is singular."""
    problem = AlgebraicProblem(lambda u, p: (u.x * (p.mu + p.a * u.x**2 - u.x**4),), ["x"], {"mu": 0.0, "a": 1.0})
    fold = trace(solve(problem, [1.0]), free=["mu"], direction=-1, limits={"mu": (-3, 3)}).labelled("LP")[0]
    found = curve(fold, "a", direction=-1, limits={"a": (-2, 2)})
    assert [point.label for point in found if point.label] == ["EP", "BP"]
    assert "beyond it the curve is its own mirror image" in found.stop.message
    end = found.points[-1]
    assert (end["a"], end["mu"], end.x[0]) == pytest.approx((0, 0, 0), abs=1e-12)


@pytest.mark.full
def test_a_curve_of_folds_ends_at_the_pitchfork_of_a_boundary_value_problem():
    """u'' + lam (u + c u^3 - u^5) = 0 with u = 0 at both ends branches off u = 0 at pi^2, downwards where c > 0."""
    problem = BoundaryValueProblem(
        lambda t, u, p: (u.v, -p.lam * (u.u + p.c * u.u**3 - u.u**5)), lambda a, b, p: (a.u, b.u), ["u", "v"],
        {"lam": 5.0, "c": 1.0}, functionals={"size": lambda t, u, p: u.u**2},
    )  # fmt: skip
    buckling = trace(solve(problem, [0, 0]), free=["lam"], limits={"lam": (5, 12)}).labelled("BP")[0]
    fold = trace(buckling, branch=1, limits={"lam": (1, 30), "size": (-1, 4)}).labelled("LP")[0]
    runs = [curve(fold, "c", direction=sense, limits={"c": (-2, 2)}) for sense in (1, -1)]
    (end,) = [point for run in runs for point in run.labelled("BP")]
    assert end["lam"] == pytest.approx(math.pi**2, abs=1e-11)
    assert abs(end["c"]) < 1e-10
    assert abs(end["c"]) < 10 * end.errors["c"] < 1e-9


def test_a_curve_of_folds_goes_through_a_transcritical_bifurcation():
    """x (mu + a x - x^2) = 0: folds at mu = -x^2, a = 2 x; at x = 0 the defining system is singular."""
    problem = AlgebraicProblem(lambda u, p: (u.x * (p.mu + p.a * u.x - u.x**2),), ["x"], {"mu": 1.0, "a": 1.0})
    fold = trace(solve(problem, [1.5]), free=["mu"], direction=-1, limits={"mu": (-3, 3)}).labelled("LP")[0]
    found = curve(fold, "a", direction=-1, limits={"a": (-2, 2)})
    (meeting,) = found.labelled("BP")
    assert (meeting["a"], meeting["mu"], meeting.x[0]) == pytest.approx((0, 0, 0), abs=1e-12)
    assert found.points[-1]["a"] == pytest.approx(-2, abs=1e-12)


def test_borders_follow_a_curve_of_folds_that_turns_fast():
    """Stale borders make test functions jump: "possible" special points where nothing happens."""
    fold = opt.circle().labelled("LP")[0]
    folds = curve(fold, "x3", primary="omega", limits={"omega": (0, 3)}, step=0.01, angle=0.7, accuracy=0.1)
    assert [point.label for point in folds.points[1:] if point.label] == ["LP", "BP", "EP"]


# --- branch points --------------------------------------------------------------------------------------------------


def test_branch_points_in_two_parameters():
    """The elastica on an elastic foundation, lam = pi^2 - k: the curve, its vanishing imperfection, and its slope."""
    start = solve(elastica(), [0, 0], intervals=12, degree=6)
    point = trace(start, free=["lam"], limits={"lam": (1, 20)}).labelled("BP")[0]
    assert point.sensitivities()["k"]["lam"] == pytest.approx(-1, abs=1e-8)
    for direction in (1, -1):
        found = curve(point, "k", direction=direction, limits={"k": (-5, 5)})
        assert found.points[-1]["k"] == pytest.approx(5 * direction, abs=1e-10)
        for other in found:
            assert other["lam"] + other["k"] == pytest.approx(math.pi**2, abs=1e-9)
            assert abs(other.x[-1]) < 1e-12


# --- sensitivities --------------------------------------------------------------------------------------------------


def test_sensitivity_of_a_fold():
    """Of the cusp's, d/dlam of 2 (lam/3)^(3/2); of Gelfand's, against the difference of the folds at two values of eps."""
    fold = cusp_branch().labelled("LP")[0]
    assert fold.sensitivities()["lam"]["mu"] == pytest.approx(3**-0.5, abs=1e-10)
    fold, h = gelfand_folds()[0], 1e-4
    slope = (gelfand_folds(0.2 + h)[0]["lam"] - gelfand_folds(0.2 - h)[0]["lam"]) / (2 * h)
    assert fold.sensitivities()["eps"]["lam"] == pytest.approx(slope, abs=1e-5)


def test_sensitivity_of_a_user_zero():
    """At mean u = 1/2 held: against differences of lam between runs at neighbouring eps."""

    def held(eps):
        return gelfand_branch(eps, highest=1.0, zeros={"mean": [0.5]}).labelled("UZ")[0]

    h, here = 1e-3, held(0.2)
    slope = (held(0.2 + h)["lam"] - held(0.2 - h)["lam"]) / (2 * h)
    assert here.sensitivities()["eps"]["lam"] == pytest.approx(slope, abs=1e-6)
    with pytest.raises(ProblemError, match="'lam' must be one of"):
        here.sensitivities(by=["lam"])


BRUSSELATOR = AlgebraicProblem(
    lambda u, p: (p.A - (p.B + 1) * u.x + u.x**2 * u.y, p.B * u.x - u.x**2 * u.y), ["x", "y"], {"A": 1.5, "B": 1.0}
)


def test_sensitivity_of_a_hopf_point():
    """Of the Brusselator's at B = 1 + A^2."""
    branch = trace(solve(BRUSSELATOR, [1.5, 0.7]), free=["B"], limits={"B": (1, 5)})
    (hopf,) = branch.labelled("HB")
    assert hopf.sensitivities()["A"]["B"] == pytest.approx(3.0, abs=1e-8)
    assert branch.points[0].sensitivities()["A"]["B"] == pytest.approx(0, abs=1e-12)  # an end: the first free parameter is held


def test_what_is_held_must_be_a_column():
    branch = trace(solve(BRUSSELATOR, [1.5, 0.7]), free=["B"], limits={"B": (1, 5)}, extrema=["B"], events=[
        Event("UZ", "large", lambda trial: trial["y"] - 2)])  # fmt: skip
    (large,) = branch.labelled("UZ")  # y = B / A = 2
    with pytest.raises(ProblemError, match="held: must be given at a point UZ 'large'"):
        large.sensitivities()
    with pytest.raises(ProblemError, match="held: 'z' is no column of this problem"):
        large.sensitivities(held="z")
    assert large.sensitivities(held="y")["A"]["B"] == pytest.approx(2, abs=1e-8)


def test_bad_starts():
    branch = cusp_branch()
    with pytest.raises(ProblemError, match="must be one of LP, BP"):
        curve(branch.points[1], "lam")
    with pytest.raises(ProblemError, match="'mu' must be a parameter that is not free"):
        curve(branch.labelled("LP")[0], "mu")


@pytest.mark.parametrize("held", ["x", lambda trial: trial["x"]])
def test_sensitivities_by_a_parameter_of_another_size(held):
    """x = a + b, and b is of the size 1e6, so it is divided by 2^20 inside: at a fixed x, da/db = -1e-6."""
    problem = AlgebraicProblem(lambda u, p: (u.x - p.a - 1e-6 * p.b,), ["x"], {"a": 1.0, "b": 3e6})
    branch = trace(solve(problem, [4.0]), free=["a"], limits={"a": (-3, 3)}, zeros={"x": [5.0]})
    (point,) = branch.labelled("UZ")
    assert point.sensitivities(held=held)["b"]["a"] == pytest.approx(-1e-6, rel=1e-9)


def test_sensitivities_of_a_branch_point_by_a_parameter_of_another_size():
    """x (x - a + b / 1e6) has its branch point at a = b / 1e6."""
    problem = AlgebraicProblem(lambda u, p: (u.x * (u.x - p.a + 1e-6 * p.b),), ["x"], {"a": 1.0, "b": 3e6})
    (point,) = trace(solve(problem, [0.0]), free=["a"], limits={"a": (0, 5)}).labelled("BP")
    assert point.sensitivities()["b"]["a"] == pytest.approx(1e-6, rel=1e-9)


@pytest.mark.sample(5)
@pytest.mark.parametrize("name", ["a = critical", "a = 0.231", "a", "x = -1.1", "b = 1"])
@pytest.mark.parametrize("label", ["UZ", "LP", "EX"])
def test_a_users_name_names_no_quantity(name, label):
    """x = -1.1 on x^3 - b x + a = 0 at a = 0.231: `curve` follows that, given as event, or asks for it."""
    problem = AlgebraicProblem(lambda u, p: (u.x**3 - p.b * u.x + p.a,), ["x"], {"a": 2.0, "b": 1.0})
    event = Event(label, name, lambda trial: trial["x"] + 1.1)
    branch = trace(solve(problem, [-1.5]), free=["a"], direction=-1, limits={"a": (-2, 3)}, events=[event])
    point = next(point for point in branch if point.name == name)
    with pytest.raises(ProblemError, match="give it as event"):
        curve(point, "b", limits={"b": (0.5, 2)})
    found = curve(point, "b", event=event, limits={"b": (0.5, 2)})
    assert found.column("x") == pytest.approx(np.full(len(found), -1.1), abs=1e-10)
    assert found.column("a") == pytest.approx(1.1**3 - 1.1 * found.column("b"), abs=1e-10)
