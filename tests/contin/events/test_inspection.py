"""Nothing falls between two steps: user zeros, limits and folds, whatever the steps are."""

import math

import numpy as np
import pytest

import contin.events.inspection as inspection
from bank import abc, enz, pp2
from bank.closed_forms import bratu, bratu_fold, pitchfork
from contin import AlgebraicProblem, CycleProblem, Event, Settings, solve, trace


def labels(branch):
    return [point.label for point in branch.points[1:] if point.label]


@pytest.mark.parametrize(
    "options",
    [
        {"accuracy": 0.005},
        {"accuracy": 0.005, "step": 0.01},
        {"accuracy": 0.1, "angle": 0.7, "step": 0.01},
        {"accuracy": 0.1, "angle": 0.2, "step": 0.3},
        {"accuracy": 0.1, "angle": 0.35, "step": 0.5},
    ],
)
def test_both_folds_of_a_reaction_whatever_the_steps(options):
    """An inexact tangent at a shared end must not hide a fold, nor a leap over to another branch pass for one."""
    start = solve(abc.problem(), [0.0, 0.0, 0.0], {"beta": 1.21})
    branch = trace(start, free=["d"], limits={"d": (-0.1, 0.4)}, **options)
    assert labels(branch) == ["LP", "LP", "HB", "EP"]


@pytest.mark.parametrize("options", [{"angle": 0.15}, {"angle": 0.1, "step": 2.0}])
def test_folds_beside_a_branch_point(options):
    """Unequal cells: tangents from Newton's last factors are far off close to the branch point, in the middle of the loop."""
    for direction in (1, -1):
        branch = trace(enz.equal().labelled("BP")[0], branch=1, direction=direction, limits={"s0": (-1, 36)}, **options)
        assert labels(branch) == ["LP", "LP", "BP", "LP", "LP", "EP"]


def test_steps_on_a_mesh_that_only_pass_values_are_searched_for_nothing_else(monkeypatch):
    """No search for branch points along Bratu's problem, where the steps to three values and the limit are plain otherwise."""
    start, counted, count = solve(bratu(), [0.0, 0.0], intervals=8), [], inspection.BranchPointSearch._counted
    monkeypatch.setattr(inspection.BranchPointSearch, "_counted", lambda *given: counted.append(given) or count(*given))
    branch = trace(start, free=["lam"], limits={"lam": (0, 3.25)}, zeros={"lam": [1.0, 2.0, 3.0]})
    assert labels(branch) == ["UZ", "UZ", "UZ", "EP"] and not counted
    assert [point["lam"] for point in branch.labelled("UZ")] == pytest.approx([1, 2, 3], abs=1e-13)


@pytest.mark.parametrize("step", [0.05, 0.5, 2.0])
def test_the_first_step_from_a_branch_point_is_inspected(step):
    """Predators: a Hopf point one way and the limit the other way lie within the first step."""
    point = pp2.prey(1).labelled("BP")[0]
    for sign, expected in ((1, ["HB", "EP"]), (-1, ["EP"])):
        direction = 1 if point.details.tangents[1][1] * sign > 0 else -1
        branch = trace(point, branch=1, direction=direction, limits=pp2.LIMITS, step=step, accuracy=0.5, angle=1.2)
        assert labels(branch) == expected
        assert branch.points[-1]["p1"] == pytest.approx(-0.1 if sign > 0 else 1.0, abs=1e-12)


def test_zeros_in_the_first_step_from_a_branch_point_but_not_the_start_itself():
    """On x^2 = mu with (dx/ds)^2 = 1 / (1 + 4 x^2): mu = .01 at x = .1, (dx/ds)^2 = .9 at x = 1/6, and X = .28 or -.28."""
    fork = trace(solve(pitchfork(), [0.0]), free=["mu"], limits={"mu": (-2, 2)}).labelled("BP")[0]
    own = Event("UZ", "own", lambda trial: trial.tangent[0] ** 2 - 0.9)
    zeros = {"mu": [0.0, 0.01], "X": [0.0, 0.28, -0.28]}
    branch = trace(fork, branch=1, limits={"mu": (-1, 1)}, zeros=zeros, events=[own], step=0.6, angle=1.4, accuracy=1.0)
    found = branch.labelled("UZ")
    assert branch.points[1 : 1 + len(found)] == found  # all of them lie inside the first step
    assert [point.name.replace("-", "") for point in found] == ["mu = 0.01", "own", "X = 0.28"]
    assert [abs(point.x[0]) for point in found] == pytest.approx([0.1, 1 / 6, 0.28], abs=1e-10)
    assert not branch.labelled("LP")


def test_a_start_on_a_user_zero_is_not_labelled_again():
    """From each zero, both ways: together they label the other zeros once each, and the value of a start by its name twice."""
    settings = Settings(limits={"lam": (0, 4), "mean": (-1, 1)}, zeros={"mean": [0.1, 0.3], "lam": [2.0]})
    first = trace(solve(bratu(), [0, 0], degree=6), settings, free=["lam"])
    for start in first.labelled("UZ"):
        others = sorted((point["mean"], point.name) for point in first.labelled("UZ") if point is not start)
        found = []
        for direction in (1, -1):
            found += trace(start, settings, free=["lam"], direction=direction).labelled("UZ")
        again = sorted((point["mean"], point.name) for point in found)
        assert [name for _, name in again] == [name for _, name in others]
        assert [mean for mean, _ in again] == pytest.approx([mean for mean, _ in others], abs=1e-10)


@pytest.mark.sample(1)
@pytest.mark.parametrize("start", [0.0, -1e-13, 1e-13])
def test_a_limit_is_not_passed_from_a_start_on_it(start):
    point = solve(bratu(), [0, 0], {"lam": start}, degree=6)
    outwards = trace(point, free=["lam"], direction=-1, limits={"lam": (0, 4)})
    assert outwards.stop.reason == "limit" and outwards.points[-1]["lam"] == pytest.approx(0, abs=1e-12)
    inwards = trace(point, free=["lam"], limits={"lam": (0, 2)})
    assert inwards.points[-1]["lam"] == pytest.approx(2, abs=1e-12) and np.all(np.diff(inwards.column("lam")) > 0)


def test_a_limit_just_inside_a_fold_is_met_within_one_step():
    """lam passes the limit, turns and comes back inside one step."""
    lam = bratu_fold() - 2e-8
    branch = trace(solve(bratu(), [0, 0], degree=6), free=["lam"], limits={"lam": (-1, lam), "mean": (-1, 3)})
    assert branch.points[-1]["lam"] == pytest.approx(lam, abs=1e-12) and labels(branch) == ["EP"]


def test_a_limit_far_beyond_a_fold_is_met_on_the_way_back():
    """lam = 1 is a limit that the run starts on, leaves inwards and comes back to past the fold."""
    branch = trace(solve(bratu(), [0, 0], {"lam": 1.0}, degree=6), free=["lam"], limits={"lam": (1.0, 4)})
    assert labels(branch) == ["LP", "EP"] and math.isclose(branch.points[-1]["lam"], 1.0, abs_tol=1e-12)


@pytest.mark.sample(4)
@pytest.mark.parametrize("gap", [1e-1, 1e-2, 1e-3, 1e-4])
@pytest.mark.parametrize("options", [{"step": 0.05}, {"step": 2.9}, {"step": 4.0, "accuracy": 0.2, "angle": 1.4}])
@pytest.mark.parametrize("branch_points", [True, False])
def test_no_step_leads_to_the_other_arm_of_a_hyperbola(gap, options, branch_points):
    """x^2 = a^2 + gap^2 from a = -3, x > 0: the other arm, x < 0, lies straight on."""
    problem = AlgebraicProblem(lambda u, p: (u.x**2 - p.a**2 - gap**2,), ["x"], {"a": -3.0})
    branch = trace(solve(problem, [3.0]), free=["a"], limits={"a": (-3.1, 3.1)}, branch_points=branch_points, **options)
    assert labels(branch) == ["EP"] and branch.points[-1]["a"] == pytest.approx(3.1)
    assert min(point.x[0] for point in branch) > 0


@pytest.mark.sample(2)
@pytest.mark.parametrize("gap", [1e-1, 1e-2, 1e-3, 1e-4])
@pytest.mark.parametrize("branch_points", [True, False])
def test_an_arm_of_a_hyperbola_turns_back(gap, branch_points):
    """a^2 = x^2 + gap^2 from a = -3: the fold is at a = -gap, and the way back ends at a = -3.1."""
    problem = AlgebraicProblem(lambda u, p: (p.a**2 - u.x**2 - gap**2,), ["x"], {"a": -3.0})
    branch = trace(solve(problem, [3.0]), free=["a"], limits={"a": (-3.1, 3.1)}, branch_points=branch_points, step=2.9)
    assert labels(branch) == ["LP", "EP"] and branch.points[-1]["a"] == pytest.approx(-3.1)
    assert branch.labelled("LP")[0]["a"] == pytest.approx(-gap, rel=1e-8)


@pytest.mark.full
def test_a_thin_closed_branch_of_cycles():
    """(q - 1)^2 + 1e4 (a - 1)^2 = 0.04, q the squared radius: the period turns by 3 times a, and weighs 0.006 in the norm."""

    def field(u, p):
        q = u.x**2 + u.y**2
        growth, rate = (q - 1) ** 2 + 1e4 * (p.a - 1) ** 2 - 0.04, 1 + p.a**2
        return growth * u.x - u.y * rate, u.x * rate + growth * u.y

    problem = CycleProblem(field, ["x", "y"], {"a": 1.0})
    radius = math.sqrt(1.2)
    start = solve(
        problem, lambda t: (radius * math.cos(2 * math.pi * t), radius * math.sin(2 * math.pi * t)), {"period": math.pi}
    )
    branch = trace(start, free=["a"], limits={"a": (0, 2)}, scales={"a": 1e-3}, max_points=300)
    assert [point.label for point in branch if point.label] == ["EP", "LP", "LP", "EP"] and branch.stop.reason == "closed"
