"""Nothing falls between two steps: folds, user zeros, limits and Hopf points, whatever the steps are."""

import math
from types import SimpleNamespace

import numpy as np
import pytest
from bank import abc, bru, enz, opt, pp2

from contin import AlgebraicProblem, BoundaryValueProblem, Monitor, Settings, curve, solve, trace
from contin.detection import refinement
from contin.stepping.trial import Linearization, Trial


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


@pytest.mark.parametrize("apart", [1e-1, 1e-3, 1e-5])
@pytest.mark.parametrize("start", np.linspace(-1, -0.4, 13))
def test_two_folds_close_together(apart, start):
    """mu' = (x^2 - apart^2 / 4) (2 + sin x): the tangent's sign is the same at both ends of a step over both folds.

    Further off the slope is no parabola, so the place between the folds has to be found.
    """
    square = apart**2 / 4

    def residual(u, p):  # mu, integrated by hand from 0
        x, s, c = u.x, math.sin(u.x), math.cos(u.x)
        return (2 * x**3 / 3 - 2 * square * x + 2 * x * s - (x**2 - 2 - square) * c - (2 + square) - p.mu,)

    point = solve(
        AlgebraicProblem(residual, ["x"], {"mu": 0.0}),
        [start],
        {"mu": residual(SimpleNamespace(x=start), SimpleNamespace(mu=0.0))[0]},
    )
    branch = trace(point, free=["mu"], limits={"mu": (-3, 0.5)}, step=0.1)
    assert labels(branch) == ["LP", "LP", "EP"]
    assert [float(fold.x[0]) for fold in branch.labelled("LP")] == pytest.approx([-apart / 2, apart / 2], abs=1e-9)


def test_one_cubic_inflection_is_no_fold():
    """mu' = x^2 + 1e-10: the slope nearly vanishes, but does not."""
    problem = AlgebraicProblem(lambda u, p: (u.x**3 / 3 + 1e-10 * u.x - p.mu,), ["x"], {"mu": -1 / 3 - 1e-10})
    assert labels(trace(solve(problem, [-1.0]), free=["mu"], limits={"mu": (-1, 1)})) == ["EP"]


@pytest.mark.parametrize("step", [0.05, 0.5, 2.0])
def test_the_first_step_from_a_branch_point_is_looked_at(step):
    """Predators: a Hopf point one way and the limit the other way lie within the first step."""
    point = pp2.prey(1).labelled("BP")[1]
    for sign, expected in ((1, ["HB", "EP"]), (-1, ["EP"])):
        direction = 1 if point.details.tangents[1][1] * sign > 0 else -1
        branch = trace(point, branch=1, direction=direction, limits=pp2.LIMITS, step=step, accuracy=0.5, angle=1.2)
        assert labels(branch) == expected
        assert branch.points[-1]["p1"] == pytest.approx(-0.1 if sign > 0 else 1.0, abs=1e-12)


def pitchfork(stop=1.0):
    """x (mu - x^2): from the origin x^2 = mu."""
    return AlgebraicProblem(lambda u, p: (u.x * (p.mu - u.x**2),), ["x"], {"mu": -stop}, functionals={"X": lambda u, p: u.x})


def test_zeros_in_the_first_step_from_a_branch_point_but_not_the_start_itself():
    fork = trace(solve(pitchfork(), [0.0]), free=["mu"], limits={"mu": (-2, 2)}).labelled("BP")[0]
    own = Monitor("UZ", "own", lambda trial: trial.tangent[0] ** 2 - 0.9)  # (dx/ds)^2 = 1 / (1 + 4 x^2)
    zeros = {"mu": [0.0, 0.01], "X": [0.0, 0.3, -0.3]}
    branch = trace(fork, branch=1, limits={"mu": (-1, 1)}, zeros=zeros, monitors=[own], step=0.6, angle=1.4, accuracy=1.0)
    assert branch.points[1].label and not [
        p for p in branch if p.label == "LP"
    ]  # several events before the first regular point
    found = [point for point in branch if point.label == "UZ"]
    assert [point.name for point in found][:1] == ["mu = 0.01"]
    assert sorted(abs(point.x[0]) for point in found) == pytest.approx([0.1, math.sqrt(1 / 36), 0.3], abs=1e-10)


def bratu():
    return BoundaryValueProblem(
        lambda t, u, p: (u.v, -p.lam * math.exp(u.u)), lambda a, b, p: (a.u, b.u), ["u", "v"], {"lam": 0.0},
        functionals={"mean": lambda t, u, p: u.u},
    )  # fmt: skip


def test_a_start_on_a_user_zero_is_not_labelled_again():
    settings = Settings(limits={"lam": (0, 4), "mean": (-1, 1)}, zeros={"mean": [0.1, 0.3], "lam": [2.0]})
    first = trace(solve(bratu(), [0, 0], degree=6), settings, free=["lam"])
    for start in first.labelled("UZ"):
        names = {}
        for direction in (1, -1):
            branch = trace(start, settings, free=["lam"], direction=direction)
            names[direction] = [point.name for point in branch.labelled("UZ")]
            assert start.name not in names[direction] or start.name == "lam = 2"
        assert len(names[1] + names[-1]) == len(first.labelled("UZ")) - 1


@pytest.mark.parametrize("start", [0.0, -1e-13, 1e-13])
def test_a_limit_is_not_passed_from_a_start_on_it(start):
    point = solve(bratu(), [0, 0], {"lam": start}, degree=6)
    outwards = trace(point, free=["lam"], direction=-1, limits={"lam": (0, 4)})
    assert outwards.stop.reason == "limit" and outwards.points[-1]["lam"] == pytest.approx(0, abs=1e-12)
    inwards = trace(point, free=["lam"], limits={"lam": (0, 2)})
    assert inwards.points[-1]["lam"] == pytest.approx(2, abs=1e-12) and np.all(np.diff(inwards.column("lam")) > 0)


def test_a_limit_just_inside_a_fold_is_met_within_one_step():
    """lam passes the limit, turns and comes back inside one step."""
    lam = 3.5138307
    branch = trace(solve(bratu(), [0, 0], degree=6), free=["lam"], limits={"lam": (-1, lam), "mean": (-1, 3)})
    assert branch.points[-1]["lam"] == pytest.approx(lam, abs=1e-12) and labels(branch) == ["EP"]


def test_branch_points_on_a_coarse_mesh_are_refined_to_themselves():
    """Degree 3, as few intervals as the uniform state takes: modes crowd, and each must be refined to its own length."""
    branch = trace(solve(bru.problem(), [2, 0, 2.3, 0], degree=3), free=["L"], limits={"L": (0.01, 0.45)})
    known = sorted([*(bru.mode(n, False) for n in range(1, 6)), bru.mode(1, True), bru.mode(2, True)])
    points = branch.labelled("BP")
    assert len(points) == len(known)
    for point, length in zip(points, known):
        assert abs(point["L"] - length) < point.errors["L"] < 1e-6


def test_a_point_that_runs_away_on_finer_meshes_stays_as_it_was(monkeypatch):
    """No estimate is given then, rather than a wrong one."""
    start = solve(bratu(), [0, 0], degree=6)
    settings = Settings(limits={"lam": (0, 4), "mean": (-1, 1)})
    coarse = trace(start, settings, free=["lam"], errors=False)

    def elsewhere(system, x, tangent, test, newton):
        return Trial(system, x + 0.5, Linearization(tangent, 1.0))

    monkeypatch.setattr(refinement, "_zero_again", elsewhere)
    (fold,) = trace(start, settings, free=["lam"]).labelled("LP")
    assert fold["lam"] == coarse.labelled("LP")[0]["lam"] and math.isnan(fold.errors["lam"])


def test_errors_of_algebraic_points_are_those_of_their_location():
    case = abc.CASES[0]
    for point, special in zip([p for p in case.run().points[1:] if p.label], case.specials):
        assert abs(point["d"] - special.values["d"]) < 4 * point.errors["d"] and 0 < point.errors["d"] < 1e-12


def oscillators(*rates):
    """Independent pairs of eigenvalues rate(mu) -+ i (1 + k), rates of degree two: Hopf points where one vanishes."""
    n = 2 * len(rates)

    def residual(u, p, out):
        for k in range(n // 2):
            rate = table[k, 0] + table[k, 1] * p[0] + table[k, 2] * p[0] ** 2
            out[2 * k] = rate * u[2 * k] - (1 + k) * u[2 * k + 1]
            out[2 * k + 1] = (1 + k) * u[2 * k] + rate * u[2 * k + 1]

    table = np.array(rates, dtype=float)
    return AlgebraicProblem(residual, n, {"mu": -1.0})


@pytest.mark.parametrize(
    ("rates", "places"),
    [
        ([(0.0, 1.0, 0.0), (-0.1, 1.0, 0.0)], [0.0, 0.1]),  # two pairs, one after the other
        ([(0.0, 1.0, 0.0), (0.6, -1.0, 0.0)], [0.0, 0.6]),  # one comes, another goes
        ([(0.0, 1.0, 0.0), (-0.1, 1.0, 0.0), (-0.2, 1.0, 0.0)], [0.0, 0.1, 0.2]),
        ([(0.16, 0.0, -1.0)], [-0.4, 0.4]),  # the same pair, out and back
    ],
)
def test_several_hopf_points_in_one_step(rates, places):
    start = solve(oscillators(*rates))
    branch = trace(start, free=["mu"], limits={"mu": (-2, 1)}, step=1.7, change=1.4)
    assert len(branch) <= 4 + len(places)  # really one or two steps
    assert [point["mu"] for point in branch.labelled("HB")] == pytest.approx(places, abs=1e-10)


def test_borders_follow_a_curve_of_folds_that_turns_fast():
    """Stale borders make monitors jump: "possible" events where nothing happens."""
    fold = opt.circle().labelled("LP")[0]
    folds = curve(fold, "x3", primary="omega", limits={"omega": (0, 3)}, step=0.01, angle=0.7, accuracy=0.1)
    assert labels(folds) == ["LP", "BP", "EP"]
