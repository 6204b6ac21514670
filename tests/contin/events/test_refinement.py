"""Error estimates of special points: not smaller than the error, and none where the point is not found again."""

import math
from types import SimpleNamespace

import numpy as np
import pytest

from bank import abc, bru
from bank.case import UNDERRATED
from bank.closed_forms import bratu
from contin import BoundaryValueProblem, ConvergenceError, Settings, solve, trace
from contin.core.trial import Linearization, Trial
from contin.events import refinement
from contin.functions import round_off


def test_branch_points_on_a_coarse_mesh_are_refined_to_themselves():
    """Degree 3, as few intervals as the uniform state takes: modes crowd, and each must be refined to its own length."""
    branch = trace(solve(bru.problem(), [2, 0, 2.3, 0], degree=3), free=["L"], limits={"L": (0.01, 0.45)})
    known = sorted([*(bru.mode(n, False) for n in range(1, 6)), bru.mode(1, True), bru.mode(2, True)])
    points = branch.labelled("BP")
    assert len(points) == len(known)
    for point, length in zip(points, known):
        assert abs(point["L"] - length) < point.errors["L"] < 1e-6


class Place(float):
    """A point of a curve, by its place alone."""

    newton_error = 0.0


@pytest.mark.parametrize("zero", [1.4e-6, -2e-5, 3e-12])
def test_a_zero_of_a_function_that_bends_at_once_is_no_round_off(zero):
    """The function is 1 at the first distance of the secants: 0 was returned for the first zero, and nothing for the second."""
    test = SimpleNamespace(function=lambda s: math.tanh(1e5 * (s - zero)), label="PD")
    place, apart, _ = refinement._by_secants(lambda s, near=None: Place(s), Place(0.0), test)
    assert abs(place - zero) < 1e-13 and apart < 1e-9


@pytest.mark.parametrize(("slope", "looks"), [(2.0, 2), (-2.0, 4), (2e3, 4), (2e-3, 4), (0.0, 3), (math.nan, 3)])
def test_a_slope_from_another_mesh_is_believed_where_it_leads_to_zero(slope, looks):
    """Otherwise the function is looked at further off."""
    seen = []
    test = SimpleNamespace(function=lambda s: seen.append(s) or 2 * (s - 1e-8), label="PD")
    place, _, known = refinement._by_secants(lambda s, near=None: Place(s), Place(0.0), test, slope)
    assert place == pytest.approx(1e-8, abs=1e-15) and known == pytest.approx(2) and len(seen) == looks


@pytest.mark.parametrize(("zero", "left"), [(3e-9, 1e-8), (3e-8, 0.0)])
def test_a_zero_nearer_than_what_newtons_method_leaves_is_not_looked_for(zero, left):
    """The place is then known as well as points are; further off it is looked for."""
    seen, here = [], Place(0.0)
    here.newton_error = 1e-8
    test = SimpleNamespace(function=lambda s: seen.append(s) or 2 * (s - zero), label="PD")
    place, apart, _ = refinement._by_secants(lambda s, near=None: Place(s), here, test, 2.0)
    assert place == pytest.approx(zero, abs=1e-15) and (apart == left or not left) and len(seen) == 2 - bool(left)


def test_a_test_function_that_is_not_defined_is_looked_at_once():
    seen = []
    test = SimpleNamespace(function=lambda s: seen.append(s) or math.nan, label="IFS")
    with pytest.raises(ConvergenceError, match="not defined on the finer mesh"):
        refinement._by_secants(lambda s, near=None: Place(s), Place(0.0), test)
    assert len(seen) == 1


def test_the_slope_that_a_step_has_seen_is_that_on_finer_meshes(monkeypatch):
    """So no mesh needs a look further off."""
    seen, real = [], refinement.zero_again

    def watched(system, x, tangent, test, newton, slope):
        found = real(system, x, tangent, test, newton, slope)
        seen.extend([slope / found[2]] if test is not None and test.label == "LP" else [])
        return found

    monkeypatch.setattr(refinement, "zero_again", watched)
    trace(solve(bratu(), [0, 0], degree=4), free=["lam"], limits={"lam": (0, 4), "mean": (-1, 1)})
    assert seen and seen == pytest.approx([1.0] * len(seen), abs=1e-2)


def foundation(t, u, p):
    """An inextensible rod on a foundation of stiffness k: height, angle, moment, shear force."""
    return math.sin(u.angle), u.moment, -p.lam * math.sin(u.angle) - u.shear * math.cos(u.angle), -p.k * u.height


def test_the_error_of_a_branch_point_covers_round_off(monkeypatch):
    """A secondary one: round-off of the equations moves it by 5e-12, where two meshes agree to 3e-13 by chance."""
    problem = BoundaryValueProblem(
        foundation, lambda a, b, p: (a.height, a.moment, b.height, b.moment), ["height", "angle", "moment", "shear"],
        {"lam": 1.0, "k": 100.0},
    )  # fmt: skip
    trivial = trace(solve(problem, [0.0] * 4), free=["lam"], limits={"lam": (0, 60)})
    places, errors = [], []
    for seed in range(1, 6):
        monkeypatch.setattr(round_off, "SEED", seed)
        first = trivial.labelled("BP")[0]
        (second,) = trace(first, branch=1, limits={"lam": (0, 100)}).labelled("BP")
        places.append(second["lam"])
        errors.append(second.errors["lam"])
    assert np.all(np.abs(np.array(places) - np.mean(places)) < UNDERRATED * np.array(errors)) and max(errors) < 1e-9


def test_a_point_that_runs_away_on_finer_meshes_gets_no_label(monkeypatch):
    """It is noted, with where it was seen."""
    start = solve(bratu(), [0, 0], degree=6)
    settings = Settings(limits={"lam": (0, 4), "mean": (-1, 1)})
    coarse = trace(start, settings, free=["lam"], errors=False)

    def elsewhere(system, x, tangent, test, newton, slope):
        return Trial(system, x + 0.5, Linearization(tangent, 1.0)), 0.0, slope

    monkeypatch.setattr(refinement, "zero_again", elsewhere)
    branch = trace(start, settings, free=["lam"])
    assert not branch.labelled("LP")
    (note,) = branch.notes
    assert note.startswith("a possible LP lam was not found again on a finer mesh (between lam = ")
    low, high = map(float, note.rstrip(")").partition("lam = ")[2].split(" and "))
    assert max(low, high) < coarse.labelled("LP")[0]["lam"] and "1 note" in repr(branch)


@pytest.mark.parametrize("case", abc.CASES, ids=lambda case: case.name)
def test_errors_of_algebraic_points_are_those_of_their_location(case):
    for point, special in zip([p for p in case.run().points[1:] if p.label], case.specials):
        assert abs(point["d"] - special.values["d"]) < 4 * point.errors["d"] and 0 < point.errors["d"] < 1e-12


def test_a_point_for_which_newton_fails_on_finer_meshes_keeps_its_label(monkeypatch):
    """Nothing is known against it: its errors are NaN, and a note says so."""
    start = solve(bratu(), [0, 0], degree=6)

    def fails(system, x, tangent, test, newton, slope):
        raise ConvergenceError("Newton did not converge")

    monkeypatch.setattr(refinement, "zero_again", fails)
    branch = trace(start, free=["lam"], limits={"lam": (0, 4), "mean": (-1, 1)})
    (fold,), (note,) = branch.labelled("LP"), branch.notes
    assert fold["lam"] == pytest.approx(3.513830719125161, abs=1e-8) and fold.errors["lam"] != fold.errors["lam"]
    assert note.startswith("LP lam at lam = 3.51383") and "± is nan" in note


@pytest.mark.parametrize(("place", "noise"), [(0.0, 1e-6), (2e-7, 1e-9), (-3e-5, 0.0)])
def test_a_zero_in_round_off_is_known_to_where_the_function_grows(place, noise):
    """The distance covers the zero and is less than a thousand times what round-off leaves open."""
    random = np.random.default_rng(4)
    found = refinement._known_to(lambda s: (s - place) + noise * random.uniform(-1, 1))
    assert abs(place) <= found <= 1e3 * max(abs(place), noise)


@pytest.mark.parametrize("function", [lambda s: 1 + s, lambda s: s * s, lambda s: 0.0])
def test_what_does_not_change_its_sign_is_no_zero(function):
    with pytest.raises(ConvergenceError, match="not found again"):
        refinement._known_to(function)


@pytest.mark.parametrize(("ratio", "part"), [(2**-3, 1.0), (2**-6, 2**-3), (2**-9, 2**-6), (2**-12, 2**-6)])
def test_what_is_left_after_two_moves_follows_from_their_order(ratio, part):
    """Degree 6, meshes halved: 8 times the ratio of the moves, which counts down to 2^-9; or all of the last move."""
    assert refinement._part_by_order(1e-7, 1.0, 1e-7 * ratio, 6) == pytest.approx(part)
    assert refinement._part_by_order(1e-7, 2.0, 1e-7 * ratio**2, 6) == pytest.approx(part)  # the first of four times as many
