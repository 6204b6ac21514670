"""Runs along a branch: where they go, what they label, why they end, and that they go on from any state."""

import itertools
import math

import numpy as np
import pytest
from scipy.optimize import brentq
from scipy.special import ellipk

from bank.closed_forms import bratu, bratu_fold, bratu_load, bratu_load_of, bratu_mean, elastica, two_elasticas
from contin import AlgebraicProblem, BoundaryValueProblem, ConvergenceError, Event, ProblemError, Settings, curve, solve, trace
from contin.lowlevel import Collocation, Continuation, point_of


def bratu_start(intervals=10, degree=6):
    system = Collocation(bratu(), np.linspace(0, 1, intervals + 1), degree, ["lam"], {})
    return system, np.zeros(system.size)


@pytest.fixture(scope="module")
def branch():
    """Bratu's problem from lam = 0 past the fold to a mean of 3."""
    return trace(
        point_of(*bratu_start()), Settings(limits={"lam": (-1, 4), "mean": (-1, 3)}, zeros={"lam": [1.0, 3.0], "mean": [0.5]})
    )


def test_the_fold_of_bratus_problem(branch):
    """Against the closed form, which the literature has to 13 digits; the error given is one."""
    assert bratu_fold() == pytest.approx(3.513830719125, abs=1e-12)
    (fold,) = branch.labelled("LP")
    assert abs(fold["lam"] - bratu_fold()) < 1e-11
    assert fold.errors["lam"] < 1e-11
    assert branch.stop.reason == "limit"
    assert branch.points[-1]["mean"] == pytest.approx(3, abs=1e-10)


def test_settings_of_the_path_are_made_once(monkeypatch):
    """Each takes a check of all fields, as long as a step of a small problem."""
    made, on_path = [], Settings.on_path
    monkeypatch.setattr(Settings, "on_path", lambda self, system: made.append(on_path(self, system)) or made[-1])
    run = Continuation(*bratu_start(), Settings(limits={"lam": (-1, 4), "mean": (-1, 3)}, path_tolerance=1e-8))
    points = list(run)
    assert len(points) > 5 and len(made) == 1 and made[0].mesh.tolerance == 1e-8
    run.settings = Settings(path_tolerance=1e-7)
    assert made[1].mesh.tolerance == 1e-7


def test_every_point_is_on_the_curve(branch):
    """Labelled ones too: lam from the closed form with the same mean of u."""
    assert len(branch) > 20
    for point in branch.points[1:]:
        s = brentq(lambda s, mean=point["mean"]: bratu_mean(s) - mean, 0.01, 5, xtol=1e-15)
        assert point["lam"] == pytest.approx(bratu_load(s), abs=1e-10)


def test_user_zeros_on_both_sides_of_a_fold(branch):
    zeros = branch.labelled("UZ")
    assert [point.name for point in zeros] == ["lam = 1", "lam = 3", "mean = 0.5", "lam = 3", "lam = 1"]
    for point in zeros:
        column, value = point.name.split(" = ")
        assert point[column] == pytest.approx(float(value), abs=1e-12)


def test_a_test_function_of_ones_own():
    """u(1/2) = 1: lam from the closed form."""
    centre = Event("UZ", "centre", lambda trial: trial.system.evaluate(trial.x, np.array([0.5]))[0, 0] - 1.0)
    (point,) = trace(point_of(*bratu_start()), Settings(limits={"mean": (-1, 1)}, events=[centre])).labelled("UZ")
    assert point.name == "centre"
    assert point["lam"] == pytest.approx(bratu_load_of(1.0), abs=1e-10)


def test_a_terminal_test_function_stops():
    stop = Event("UZ", "third", lambda trial: trial["lam"] - 1 / 3, terminal=True)
    branch = trace(point_of(*bratu_start()), Settings(events=[stop]))
    assert branch.stop.reason == "event"
    assert abs(branch.points[-1]["lam"] - 1 / 3) < 1e-12


def test_directions():
    system, x = bratu_start()
    down = trace(point_of(system, x), Settings(direction=-1, limits={"lam": (-2, 4)}))
    assert down.points[-1]["lam"] == pytest.approx(-2, abs=1e-12)
    assert np.all(np.diff(down.column("lam")) < 0)


def test_closed_branch_is_recognised():
    """A constant state on a circle, u^2 + mu^2 = 1: a closed branch with folds at mu = 1 and -1."""
    problem = BoundaryValueProblem(
        lambda t, u, p: (0.0 * u.u,), lambda a, b, p: (a.u**2 + p.mu**2 - 1,), ["u"], {"mu": 0.0}
    )  # fmt: skip
    system = Collocation(problem, [0, 0.5, 1], 2, ["mu"], {})
    branch = trace(point_of(system, system.pack(np.ones((5, 1)), {"mu": 0.0})), Settings(max_points=400))
    assert branch.stop.reason == "closed"
    assert [point["mu"] for point in branch.labelled("LP")] == pytest.approx([1.0, -1.0], abs=1e-12)
    assert branch.points[-1]["mu"] == pytest.approx(0, abs=1e-12)


def test_a_run_can_start_right_at_a_fold(branch):
    """The fold of Bratu's problem, given to 12 digits: both halves of the branch leave from there."""
    (fold,) = branch.labelled("LP")
    means = []
    for direction in (1, -1):
        half = trace(point_of(fold.system, fold.x), Settings(direction=direction, limits={"lam": (3, 4)}))
        assert half.points[-1]["lam"] == pytest.approx(3, abs=1e-10)
        means.append(half.points[-1]["mean"])
    passed = [point["mean"] for point in branch.labelled("UZ") if point.name == "lam = 3"]
    assert sorted(means) == pytest.approx(passed, abs=1e-9)  # the whole branch passes both ends on its way


def test_the_end_on_the_trivial_branch_is_located_without_a_search_for_branch_points():
    """x (mu - x^2 + x / 2): the branch leaves the origin, turns and meets x = 0 at mu = 0."""
    problem = AlgebraicProblem(lambda u, p: (u.x * (p.mu - u.x**2 + u.x / 2),), ["x"], {"mu": 0.5}, {"X": lambda u, p: u.x})
    start = solve(problem, [1.0])
    for search in (True, False):
        branch = trace(start, free=["mu"], direction=-1, trivial="X", branch_points=search)
        assert branch.stop.reason == "trivial branch"
        assert abs(branch.points[-1]["mu"]) < 1e-12 and abs(branch.points[-1]["X"]) < 1e-12


def test_a_right_hand_side_that_is_nan_beyond_a_wall_stops_with_advice():
    """u' = sqrt(1.5 - mu) is real up to mu = 1.5 only: the run comes close to it."""
    problem = BoundaryValueProblem(
        lambda t, u, p: (math.sqrt(1.5 - p.mu) + 0 * u.u,), lambda a, b, p: (a.u,), ["u"], {"mu": 0.0}
    )
    system = Collocation(problem, [0, 1], 3, ["mu"], {})
    branch = trace(point_of(system, system.pack(np.linspace(0, 1.2, 4)[:, None], {"mu": 0.0})))
    assert branch.stop.reason == "no convergence" and "min_step" in str(branch.stop)
    assert branch.points[-1].label == "MX"
    assert 1.4 < branch.points[-1]["mu"] <= 1.5


# --- a run that is broken off ---------------------------------------------------------------------------------------


def values(point):
    """All that a point holds, as bytes."""
    return point.label, point.x.tobytes(), point.tangent.tobytes(), point.arclength


@pytest.mark.sample(2)
@pytest.mark.parametrize(
    ("problem", "limits"),
    [(bratu, {"lam": (-1, 4), "mean": (-1, 3)}), (elastica, {"lam": (1, 50)}), (two_elasticas, {"lam": (1, 50)})],
    ids=["a fold", "branch points", "branch points with a kernel of dimension two"],
)
def test_every_state_continues_to_the_same_points(problem, limits):
    """Bit for bit, also where factors of the last step are not at hand: past special points of any kind.

    Three regular points on from every state, and from two states to the end.
    """
    system = Collocation(problem(), np.linspace(0, 1, 13), 6, ["lam"], {})
    x = np.append(np.zeros(system.size - 1), 0.0 if problem is bratu else 5.0)
    settings = Settings(limits=limits, step=0.05 if problem is bratu else 1.0, errors=False)
    run, states, whole = Continuation(system, x, settings), [], []
    for point in run:
        whole.append(values(point))
        if not point.label:
            states.append((run.state, len(whole)))
    assert len(states) > 5 and len(whole) > len(states) + 2
    complete = {1, len(states) // 2}
    for number, (state, count) in enumerate(states[:-1]):
        rest = Continuation(state.system, state.x, settings, state=state, start=run.start)
        points, regular = [], 0
        for point in rest:
            points.append(values(point))
            regular += not point.label
            if regular == 3 and number not in complete:
                break
        assert points == whole[count : count + len(points)]
        assert number not in complete or count + len(points) == len(whole)


def test_points_of_a_run_can_be_taken_one_by_one():
    run = Continuation(*bratu_start(), Settings(limits={"lam": (-1, 4), "mean": (-1, 3)}))
    first = list(itertools.islice(run, 4))
    assert first[0].label == "EP" and run.stop is None
    assert np.all(np.diff([point.arclength for point in first]) > 0)
    assert run.state.accepted == 3


# --- what is refused ------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("settings", "said"),
    [({"primary": "nu"}, "primary"), ({"zeros": {"who": [1]}}, "'who'"), ({"trivial": "norm"}, "'norm'")],
)
def test_unknown_names_are_refused(settings, said):
    with pytest.raises(ProblemError, match=said):
        Continuation(*bratu_start(), Settings(**settings))


def test_the_number_of_free_parameters_is_counted():
    system = Collocation(bratu(), [0, 1], 4, [], {})
    with pytest.raises(ProblemError, match="needs 1"):
        Continuation(system, np.zeros(system.size))


def test_a_branch_point_is_left_in_its_own_parameters():
    """Its tangents are those in the parameter it was found in: they say nothing of another one."""
    pitchfork = AlgebraicProblem(lambda u, p: (u.x * (p.a - p.b * u.x**2),), ["x"], {"a": -1.0, "b": 1.0})
    found = trace(solve(pitchfork, [0.0]), free=["a"], limits={"a": (-1, 1)}).labelled("BP")[0]
    with pytest.raises(ProblemError, match="free: b must be a, with which the branch point was found"):
        trace(found, branch=1, free=["b"])
    assert trace(found, branch=1, free=["a"], limits={"a": (-1, 1)}).stop.message == "reached a = 1"


def test_a_point_that_is_not_found_shortens_the_step_and_does_not_lose_the_branch():
    """What is looked for inside a step may need points that Newton's method does not find: then the step is halved."""
    parabola = AlgebraicProblem(lambda u, p: (p.a - u.x**2,), ["x"], {"a": 1.0})

    def only_in_steps_below(longest):
        def search(arc, places):
            if arc.step > longest:
                raise ConvergenceError("a point inside the step is not found")
            return []

        return Event("UZ", "shy", lambda trial: 1.0, search=search)

    def followed(longest):
        return trace(solve(parabola, [1.0]), free=["a"], direction=-1, limits={"a": (-1, 4)},
                     events=[only_in_steps_below(longest)])  # fmt: skip

    assert str(followed(0.04).stop) == "reached a = 4"
    lost = followed(0.0)
    assert (lost.points[-1].label, lost.stop.reason) == ("MX", "no convergence")
    assert "a point inside the step is not found" in lost.stop.message


def test_every_labelled_branch_point_can_be_left():
    """As AUTO's ``for x in r("BP")``: x (a - x^2) y = ... has the branches x = 0 and x^2 = a; the start of one is no find."""

    def residual(u, p):
        return u.x * (p.a - u.x**2), u.y * (p.a - 1 - u.y**2)

    problem = AlgebraicProblem(residual, ["x", "y"], {"a": -1.0})
    rest = trace(solve(problem, [0.0, 0.0]), free=["a"], limits={"a": (-1, 2)})
    assert [round(point["a"], 9) for point in rest.labelled("BP")] == [0, 1]
    fork = trace(rest.labelled("BP")[0], branch=1, limits={"a": (-1, 2)})
    assert (fork.points[0].label, fork.points[0].name) == ("BP", "start")
    assert [round(point["a"], 9) for point in fork.labelled("BP")] == [1]
    for point in (*rest.labelled("BP"), *fork.labelled("BP")):
        assert trace(point, branch=1, limits={"a": (-1, 2)}).stop.reason == "limit"


@pytest.mark.full
@pytest.mark.parametrize(("degree", "direction"), [(2, 1), (2, -1), (3, -1), (6, 1)])
def test_a_branch_is_left_for_the_other_one_where_the_first_step_takes_a_finer_mesh(degree, direction):
    """A cantilever: the branch from lam = ((n - 1/2) pi)^2 ends at lam = ((2 n - 1) K(sin(end angle / 2)))^2."""
    cantilever = BoundaryValueProblem(
        lambda t, u, p: (u.m, -p.lam * math.sin(u.th)), lambda a, b, p: (a.th, b.m), ["th", "m"], {"lam": 1.0}
    )
    limits = {"lam": (0, 100)}
    straight = trace(solve(cantilever, lambda t: (0, 0), degree=degree), free=["lam"], limits=limits, step=0.5)
    loads = straight.labelled("BP")
    assert len(loads) == 3
    for number, load in enumerate(loads, 1):
        bent = trace(load, branch=1, direction=direction, limits=limits, step=0.5)
        assert [point.label for point in bent if point.label] == ["BP", "EP"]
        modulus = math.sin(bent.points[-1].system.states(bent.points[-1].x)[-1, 0] / 2)
        assert (2 * number - 1) * ellipk(modulus**2) == pytest.approx(10, rel=1e-7)


@pytest.mark.parametrize("size", [1.0, 0.01])
def test_branches_that_cross_at_a_small_angle_are_told_apart(size):
    """x (a - 1 - x / size): the branch x = size (a - 1) crosses x = 0 at an angle of that size."""
    problem = AlgebraicProblem(lambda u, p: (u.x * (p.a - 1 - u.x / p.size),), ["x"], {"a": 0.0, "size": size})
    (crossing,) = trace(solve(problem, [0.0]), free=["a"], limits={"a": (-5, 5)}).labelled("BP")
    other = trace(crossing, branch=1, limits={"a": (-5, 5)})
    assert other.points[-1]["x"] == pytest.approx(size * (other.points[-1]["a"] - 1), rel=1e-9)


def test_both_ways_at_once():
    """x**3 - b x + a: folds at a = +-(4/27)**(1/2) of b = 1, and the fork of x (m - x**2), x = +-m**(1/2)."""
    cubic = AlgebraicProblem(lambda u, p: (u.x**3 - p.b * u.x + p.a,), ["x"], {"a": 0.0, "b": 1.0})
    branch = trace(solve(cubic, [0.0]), free=["a"], direction="both", limits={"a": (-2, 3)})
    assert [point.label for point in branch if point.label] == ["EP", "LP", "LP", "EP"]
    assert str(branch.stop) == "reached a = -2; backwards: reached a = 3" and branch["a"][0] == 3
    for fold in branch.labelled("LP"):
        assert abs(abs(fold["a"]) - math.sqrt(4 / 27)) <= max(fold.errors["a"], 1e-12)
    s, x, a = branch["arclength"], *branch.curve("x", "a")
    assert (np.diff(s) > 0).all() and np.abs(x**3 - x + a).max() < 1e-2  # the tangents are turned, too
    folds = curve(branch.labelled("LP")[0], "b", direction="both", limits={"b": (-1, 2)}, errors=False)
    assert sorted(folds["a"][[0, -1]] ** 2) == pytest.approx([4 * 8 / 27] * 2)
    fork = AlgebraicProblem(lambda u, p: (u.x * (p.m - u.x**2),), ["x"], {"m": -1.0})
    (fork_point,) = trace(solve(fork, [0.0]), free=["m"], limits={"m": (-1, 1)}).labelled("BP")
    arms = trace(fork_point, branch=1, direction="both", limits={"m": (-1, 1)})
    assert [point.label for point in arms if point.label] == ["EP", "BP", "EP"] and sorted(arms["x"][[0, -1]]) == [-1, 1]
    circle = AlgebraicProblem(lambda u, p: (u.x**2 + p.a**2 - 1,), ["x"], {"a": 0.0})
    assert trace(solve(circle, [1.0]), free=["a"], direction="both").stop.reason == "closed"


def test_cycles_that_begin_at_a_point_are_followed_once():
    normal = AlgebraicProblem(
        lambda u, p: (p.m * u.x - u.y - u.x * (u.x**2 + u.y**2), u.x + p.m * u.y - u.y * (u.x**2 + u.y**2)),
        ["x", "y"],
        {"m": -1},
    )
    (hopf,) = trace(solve(normal, [0.0, 0.0]), free=["m"], direction="both", limits={"m": (-1.2, 1)}).labelled("HB")
    both, ahead = (trace(hopf, branch=1, direction=way, limits={"m": (-1, 1)}) for way in ("both", 1))
    assert len(both) == len(ahead) and both[0].label == "HB" and both.stop == ahead.stop


@pytest.mark.parametrize("number", [0, 1])
def test_a_run_from_a_branch_point_knows_it(number):
    """Its value, its ± and its tangents are those of the labelled point, the first tangent that of the run."""
    pitchfork = AlgebraicProblem(lambda u, p: (u.x * (p.a - u.x**2),), ["x"], {"a": -1.0})
    (fork,) = trace(solve(pitchfork, [0.0]), free=["a"], limits={"a": (-1, 1)}).labelled("BP")
    start = trace(fork, branch=number, limits={"a": (-1, 1)}).points[0]
    assert start.name == "start" and start["a"] == fork["a"] and start.errors == fork.errors
    along, other = start.details.tangents
    assert abs(along @ start.tangent - 1) < 1e-12 and abs(other @ start.tangent) < 1e-12
