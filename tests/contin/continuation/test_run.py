"""Following branches: folds, user zeros, branch points, ends; errors against closed forms."""

import dataclasses
import math

import numpy as np
import pytest
from scipy.optimize import brentq
from scipy.special import ellipk

from contin import (
    AlgebraicProblem,
    BoundaryValueProblem,
    Collocation,
    Continuation,
    ConvergenceError,
    MeshControl,
    Monitor,
    ProblemError,
    Settings,
    follow,
    locate_branch_point,
    solve,
    trace,
)


def bratu():
    """u'' + lam exp(u) = 0, u(0) = u(1) = 0."""
    return BoundaryValueProblem(
        lambda t, u, p: (u.v, -p.lam * math.exp(u.u)), lambda a, b, p: (a.u, b.u), ["u", "v"], {"lam": 0.0},
        functionals={"mean": lambda t, u, p: u.u},
    )  # fmt: skip


def bratu_start(intervals=10, degree=6):
    system = Collocation(bratu(), np.linspace(0, 1, intervals + 1), degree, ["lam"], {})
    return system, np.zeros(system.size)


def bratu_fold():
    """Closed form: u = 2 log(cosh(s) / cosh(s (1 - 2 t))), lam = 8 s^2 / cosh(s)^2, largest where s tanh(s) = 1."""
    s = brentq(lambda s: s * math.tanh(s) - 1, 1, 2, xtol=1e-15)
    return 8 * s**2 / math.cosh(s) ** 2


def test_bratu_fold():
    branch = follow(*bratu_start(), Settings(limits={"lam": (-1, 4), "mean": (-1, 3)}, errors=True))
    (fold,) = branch.labelled("LP")
    assert abs(fold["lam"] - bratu_fold()) < 1e-11
    assert abs(bratu_fold() - 3.513830719125) < 1e-12
    assert fold.errors["lam"] < 1e-11
    assert branch.stop.reason == "limit"
    assert abs(branch.points[-1]["mean"] - 3) < 1e-10


def test_every_point_is_on_the_curve():
    """lam from the closed form at the midpoint value of each computed point."""
    branch = follow(*bratu_start(), Settings(limits={"mean": (-1, 2)}))
    for point in branch.points[1:]:
        middle = point.system.evaluate(point.x, np.array([0.5]))[0, 0]
        s = math.acosh(math.exp(middle / 2))
        assert abs(point["lam"] - 8 * s**2 / math.cosh(s) ** 2) < 1e-9


def test_user_zeros_on_both_sides_of_a_fold_and_own_monitors():
    def centre(trial):
        return trial.system.evaluate(trial.x, np.array([0.5]))[0, 0] - 1.0

    settings = Settings(
        limits={"mean": (-1, 3)}, zeros={"lam": [1.0, 3.0], "mean": [0.5]}, monitors=[Monitor("UZ", "centre", centre)]
    )
    branch = follow(*bratu_start(), settings)
    zeros = [(point.name, point["lam"]) for point in branch.labelled("UZ")]
    assert [name for name, _ in zeros] == ["lam = 1", "lam = 3", "mean = 0.5", "centre", "lam = 3", "lam = 1"]
    s = math.acosh(math.exp(0.5))  # the closed form of bratu_fold, with u(1/2) = 2 log cosh s
    assert abs(zeros[3][1] - 8 * s**2 / math.cosh(s) ** 2) < 1e-10
    for name, lam in zeros:
        if name.startswith("lam"):
            assert abs(lam - float(name[6:])) < 1e-12


def test_terminal_monitor_stops():
    stop = Monitor("UZ", "third", lambda trial: trial["lam"] - 1 / 3, terminal=True)
    branch = follow(*bratu_start(), Settings(monitors=[stop]))
    assert branch.stop.reason == "event"
    assert abs(branch.points[-1]["lam"] - 1 / 3) < 1e-12


def test_directions():
    system, x = bratu_start()
    down = follow(system, x, Settings(direction=-1, limits={"lam": (-2, 4)}))
    assert down.points[-1]["lam"] == pytest.approx(-2, abs=1e-12)
    assert np.all(np.diff(down.column("lam")) < 0)


def circle():
    """A constant state on a circle, u^2 + mu^2 = 1: a closed branch with two folds."""
    return BoundaryValueProblem(
        lambda t, u, p: (0.0 * u.u,), lambda a, b, p: (a.u**2 + p.mu**2 - 1,), ["u"], {"mu": 0.0}
    )  # fmt: skip


def test_closed_branch_is_recognised():
    system = Collocation(circle(), [0, 0.5, 1], 2, ["mu"], {})
    branch = follow(system, system.pack(np.ones((5, 1)), {"mu": 0.0}), Settings(max_points=400))
    assert branch.stop.reason == "closed"
    assert [round(point["mu"], 12) for point in branch.labelled("LP")] == [1.0, -1.0]
    assert branch.points[-1]["mu"] == pytest.approx(0, abs=1e-12)


def elastica():
    """theta'' + lam sin(theta) = 0 with theta' = 0 at both ends: buckling at lam = (k pi)^2."""
    return BoundaryValueProblem(
        lambda t, u, p: (u.v, -p.lam * math.sin(u.theta)), lambda a, b, p: (a.v, b.v), ["theta", "v"], {"lam": 1.0},
        functionals={"start": lambda t, u, p: u.theta},
    )  # fmt: skip


def test_branch_points_of_the_elastica_and_its_first_branch():
    """lam = (2 K(sin(a/2)))^2 on the first branch, a = theta(0) (Euler)."""
    system = Collocation(elastica(), np.linspace(0, 1, 13), 6, ["lam"], {})
    trivial = follow(system, system.pack(np.zeros((73, 2)), {"lam": 5.0}), Settings(limits={"lam": (1, 100)}, step=1))
    points = trivial.labelled("BP")
    assert [point["lam"] for point in points] == pytest.approx([(k * math.pi) ** 2 for k in (1, 2, 3)], abs=1e-8)
    first = points[0].details
    assert len(first.tangents) == 2 and first.imperfection < 1e-12
    away = max(first.tangents, key=lambda tangent: abs(tangent[0]))
    branch = follow(points[0].system, points[0].x, Settings(limits={"lam": (0, 20)}), away)
    for point in branch.points[1:]:
        angle = abs(point.system.states(point.x)[0, 0])
        assert abs(point["lam"] - (2 * ellipk(math.sin(angle / 2) ** 2)) ** 2) < 1e-9 * point["lam"]


def test_transcritical_point_has_the_two_tangents_of_the_algebraic_equation():
    """u (mu - u) = 0 for a constant state: at the origin the tangents are (0, 1) and (1, 1) / sqrt 2."""
    problem = BoundaryValueProblem(lambda t, u, p: (0.0 * u.u,), lambda a, b, p: (a.u * (p.mu - a.u),), ["u"], {"mu": 0.0})
    system = Collocation(problem, [0, 1], 2, ["mu"], {})
    found = locate_branch_point(system, np.array([0.02, 0.02, 0.02, -0.03]))
    assert np.abs(found.x).max() < 1e-12
    slopes = sorted(abs(tangent[0] / tangent[-1]) for tangent in found.tangents)
    assert slopes == pytest.approx([0, 1], abs=1e-7)


def test_no_branch_point_where_there_is_none():
    system, x = bratu_start()
    with pytest.raises(ConvergenceError):
        locate_branch_point(system, x)


def test_a_run_can_be_continued_from_its_state():
    """A run broken off and continued from its state gives bit for bit the points of one that was not."""
    settings = Settings(limits={"mean": (-1, 3)})
    whole = follow(*bratu_start(), settings)
    run = Continuation(*bratu_start(), settings)
    points = []
    for point in run:
        points.append(point)
        if not point.label and len(points) > 9:
            break
    rest = list(Continuation(None or run.state.system, run.state.x, settings, state=run.state, start=run.start))
    assert [point["lam"] for point in points + rest] == whole.column("lam").tolist()


def test_every_state_continues_to_the_same_points():
    """Also where factors of the last step are not at hand: past branch points, and past one with a kernel of dimension two."""
    double = BoundaryValueProblem(
        lambda t, u, p: (u.b, -p.lam * math.sin(u.a), u.d, -p.lam * math.sin(u.c)),
        lambda a, b, p: (a.b, b.b, a.d, b.d), ["a", "b", "c", "d"], {"lam": 5.0},
    )  # fmt: skip
    for problem in (elastica(), double):
        system = Collocation(problem, np.linspace(0, 1, 13), 6, ["lam"], {})
        settings, x = Settings(limits={"lam": (1, 50)}, step=1.0, errors=False), np.append(np.zeros(system.size - 1), 5.0)
        run, states, whole = Continuation(system, x, settings), [], []
        for point in run:
            whole.append(point["lam"])
            if not point.label:
                states.append((run.state, len(whole)))
        assert len(states) > 5
        for state, count in states[:-1]:
            rest = Continuation(state.system, state.x, settings, state=state, start=run.start)
            assert [point["lam"] for point in rest] == whole[count:]


def test_the_end_on_the_trivial_branch_is_located_without_a_search_for_branch_points():
    """x (mu - x^2 + x / 2): the branch leaves the origin, turns and meets x = 0 at mu = 0."""
    problem = AlgebraicProblem(lambda u, p: (u.x * (p.mu - u.x**2 + u.x / 2),), ["x"], {"mu": 0.5}, {"X": lambda u, p: u.x})
    start = solve(problem, [1.0])
    for search in (True, False):
        branch = trace(start, free=["mu"], direction=-1, trivial="X", branch_points=search)
        assert branch.stop.reason == "trivial branch"
        assert abs(branch.points[-1]["mu"]) < 1e-12 and abs(branch.points[-1]["X"]) < 1e-12


def test_a_right_hand_side_that_is_nan_beyond_a_wall_stops_with_advice():
    problem = BoundaryValueProblem(
        lambda t, u, p: (math.sqrt(1.5 - p.mu) + 0 * u.u,), lambda a, b, p: (a.u,), ["u"], {"mu": 0.0}
    )
    system = Collocation(problem, [0, 1], 3, ["mu"], {})
    branch = follow(system, system.pack(np.linspace(0, 1.2, 4)[:, None], {"mu": 0.0}))
    assert branch.stop.reason == "no convergence" and "min_step" in str(branch.stop)
    assert branch.points[-1].label == "MX"
    assert 1.4 < branch.points[-1]["mu"] <= 1.5


def boundary_layer():
    """eps u'' + u u' - u = 0, u(0) = 1, u(1) = 3/2 (COLSYS's shock problem): a layer of width eps as eps shrinks."""
    return BoundaryValueProblem(
        lambda t, u, p: (u.v, (u.u - u.u * u.v) / p.eps), lambda a, b, p: (a.u - 1, b.u - 1.5), ["u", "v"], {"eps": 1.0}
    )


def test_the_mesh_follows_a_layer_and_the_number_of_intervals_the_tolerance():
    system = Collocation(boundary_layer(), np.linspace(0, 1, 9), 5, ["eps"], {})
    start = np.stack([1 + system.nodes / 2, np.full_like(system.nodes, 0.5)], axis=1)
    settings = Settings(direction=-1, limits={"eps": (1e-3, 2)}, mesh=MeshControl(tolerance=1e-9), max_step=0.3)
    branch = follow(system, system.pack(start, {"eps": 1.0}), settings)
    end = branch.points[-1]
    assert end["eps"] == pytest.approx(1e-3, abs=1e-12)
    h = np.diff(end.system.mesh)
    assert h.max() / h.min() > 10
    # the outer solution is u = t + 1/2 to the right of the layer (matched asymptotics), exact up to exp(-1/eps)
    assert end.system.evaluate(end.x, np.array([0.5]))[0] == pytest.approx([1.0, 1.0], abs=1e-7)
    fine = dataclasses.replace(settings.mesh, tolerance=1e-12)
    finer = follow(system, system.pack(start, {"eps": 1.0}), dataclasses.replace(settings, mesh=fine)).points[-1]
    assert finer.system.intervals > end.system.intervals
    assert abs(finer.system.states(finer.x)[0, 1] - end.system.states(end.x)[0, 1]) < 1e-6


@pytest.mark.parametrize(
    ("settings", "said"),
    [
        ({"direction": 0}, "direction"),
        ({"step": -1.0}, "step"),
        ({"max_points": 0}, "max_points"),
        ({"limits": {"lam": (2, 1)}}, "limits"),
        ({"angle": 3.0}, "angle"),
    ],
)
def test_settings_are_checked_when_made(settings, said):
    with pytest.raises(ProblemError, match=said):
        Settings(**settings)


@pytest.mark.parametrize(
    ("settings", "said"),
    [({"primary": "nu"}, "primary"), ({"zeros": {"who": [1]}}, "'who'"), ({"trivial": "norm"}, "'norm'")],
)
def test_unknown_names_are_refused(settings, said):
    with pytest.raises(ProblemError, match=said):
        Continuation(*bratu_start(), Settings(**settings))


def test_a_run_can_start_right_at_a_fold():
    """The fold of Bratu's problem, given to 12 digits: both halves of the branch leave from there."""
    (fold,) = follow(*bratu_start(), Settings(limits={"mean": (-1, 3)}, errors=False)).labelled("LP")
    means = []
    for direction in (1, -1):
        branch = follow(fold.system, fold.x, Settings(direction=direction, limits={"lam": (3, 4)}))
        assert branch.points[-1]["lam"] == pytest.approx(3, abs=1e-10)
        means.append(branch.points[-1]["mean"])
    assert max(means) - min(means) > 0.5


def test_the_number_of_free_parameters_is_counted():
    system = Collocation(bratu(), [0, 1], 4, [], {})
    with pytest.raises(ProblemError, match="needs 1"):
        Continuation(system, np.zeros(system.size))
