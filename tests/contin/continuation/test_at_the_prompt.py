"""For people who wait for a run: a line of progress, labels within the limits, and advice that names what helps."""

import io
import itertools
import re

import numpy as np
import pytest

import contin
from contin import AlgebraicProblem, BoundaryValueProblem, MeshControl, ProblemError
from contin.continuation import failure, progress


class Terminal(io.StringIO):
    def __init__(self, terminal):
        super().__init__()
        self.terminal = terminal

    def isatty(self):
        return self.terminal


def parabola():
    return contin.solve(AlgebraicProblem(lambda u, p: (p.a - u.x**2,), ["x"], {"a": 1.0}), [1.0])


@pytest.mark.parametrize(
    ("terminal", "wanted", "shown"), [(True, None, True), (False, None, False), (True, False, False), (False, True, True)]
)
def test_a_line_of_progress(monkeypatch, terminal, wanted, shown):
    """It is shown on a terminal or where it is asked for, overwritten in place, and cleared."""
    contin.trace(parabola(), free=["a"], direction=-1, limits={"a": (-1, 4)})  # compiled before: that shows a line of its own
    file = Terminal(terminal)
    monkeypatch.setattr(progress.sys, "stderr", file)
    monkeypatch.setattr(progress.time, "monotonic", itertools.count().__next__)  # a second later at every look
    branch = contin.trace(parabola(), free=["a"], direction=-1, limits={"a": (-1, 4)}, progress=wanted)
    assert branch.labelled("LP")
    lines = file.getvalue().split("\r")
    assert bool(file.getvalue()) == shown
    if shown:
        assert "a = 4, step " in lines[-3] and "EP LP EP" in lines[-3] and lines[-2:] == [" " * 79, ""]
        assert {len(line) for line in lines[1:-1]} == {79}


def test_progress_of_curves_and_diagrams(monkeypatch):
    file = Terminal(True)
    monkeypatch.setattr(progress.sys, "stderr", file)
    monkeypatch.setattr(progress.time, "monotonic", itertools.count().__next__)  # a second later at every look
    fork = AlgebraicProblem(lambda u, p: (p.b + p.a * u.x - u.x**3,), ["x"], {"a": -1.0, "b": 0.0})
    found = contin.diagram(contin.solve(fork, [0.0]), free=["a"], depth=1, limits={"a": (-1, 1)}, progress=True)
    assert "branch 1, depth 0: " in file.getvalue()
    start = contin.solve(fork, found.branches[-1].points[-1])
    fold = contin.trace(start, free=["b"], limits={"b": (-2, 2)}, progress=False).labelled("LP")[0]
    contin.curve(fold, "a", limits={"a": (0.5, 2)}, progress=True)
    assert "a = 2" in file.getvalue()
    with pytest.raises(ProblemError, match="progress: 'yes' must be True or False"):
        contin.trace(start, free=["b"], progress="yes")


def test_nothing_is_labelled_outside_the_limits():
    """On the line x = a the functional 1 - 4 a^2 passes .999 and comes back in one step; a = 0 lies between."""
    line = AlgebraicProblem(lambda u, p: (u.x - p.a,), ["x"], {"a": -0.5}, functionals={"h": lambda u, p: 1 - 4 * u.x**2})
    start = contin.solve(line, [-0.5])
    branch = contin.trace(start, free=["a"], limits={"a": (-1, 1), "h": (-5, 0.999)}, zeros={"a": [0.0]}, step=0.8)
    assert [point.label for point in branch] == ["EP", "EP"] and str(branch.stop) == "reached h = 0.999"
    assert branch.points[-1]["a"] == pytest.approx(-(0.00025**0.5), abs=1e-9)
    free = contin.trace(start, free=["a"], limits={"a": (-1, 1)}, zeros={"a": [0.0]}, step=0.8)
    assert len(free.labelled("UZ")) == 1


def bratu():
    return BoundaryValueProblem(
        rhs=lambda t, u, p: (u.v, -p.lam * 2.718281828459045**u.u), boundary=lambda a, b, p: (a.u, b.u), states=["u", "v"],
        parameters={"lam": 1.0},
    )  # fmt: skip


def test_labelled_points_obey_max_intervals():
    """The error estimate is made on a mesh twice as fine; the point stays on the mesh that is allowed."""
    control = MeshControl(max_intervals=12)
    branch = contin.trace(contin.solve(bratu(), [0, 0]), free=["lam"], limits={"lam": (0.1, 5)}, mesh=control)
    (fold,) = branch.labelled("LP")
    assert max(point.system.intervals for point in branch) <= 12
    assert fold["lam"] == pytest.approx(3.513830719125161, abs=10 * fold.errors["lam"]) and fold.errors["lam"] < 1e-8


def test_advice_for_a_step_that_is_too_long():
    """A circle of radius .05 with steps of .2: shorter ones succeed, and the run that follows the advice goes on."""
    circle = AlgebraicProblem(lambda u, p: (u.x**2 + p.a**2 - 0.0025,), ["x"], {"a": 0.0})
    start = contin.solve(circle, [0.05])
    failed = contin.trace(start, free=["a"], min_step=0.2, step=0.2)
    assert (
        failed.points[-1].label == "MX"
        and failed.stop.advice == "the run goes on with steps of 2e-05: set min_step to that or less"
    )
    assert contin.trace(start, free=["a"], min_step=2e-5, step=0.2).stop.reason == "closed"


@pytest.mark.parametrize("tolerance", [1e-6, 1e-3])
def test_an_advice_that_fails_when_it_is_followed_is_not_given(tolerance):
    """A reaction of order 1/2 has no positive solution beyond phi = sqrt(12): no step and no tolerance leads there."""
    dead = BoundaryValueProblem(
        lambda t, u, p: (u.v, p.phi**2 * u.x**0.5), lambda a, b, p: (a.v, b.x - 1), ["x", "v"], {"phi": 1.0}
    )
    first = contin.solve(dead, [1, 0])
    branch = contin.trace(first, free=["phi"], limits={"phi": (0.5, 6)}, newton=contin.Newton(tolerance=tolerance))
    assert branch[-1]["phi"] == pytest.approx(12**0.5, abs=0.01)
    assert "goes on" not in str(branch.stop) and "tolerance of 1" not in str(branch.stop)


def test_advice_for_a_mesh(monkeypatch):
    """Where the run goes on with the mesh halved only, the advice names the setting that allows that mesh."""
    start = contin.trace(contin.solve(bratu(), [0, 0]), free=["lam"], limits={"lam": (0.1, 3)}).points[0]
    run = contin.lowlevel.Continuation(start.system, start.x)
    count = run.state.system.intervals
    monkeypatch.setattr(failure, "_goes_on", lambda state, *_: state.system.intervals > count)
    for control, words in ((MeshControl(max_intervals=count), "max_intervals"), (MeshControl(), "min_intervals")):
        said = failure.advice(run.state, contin.Settings(mesh=control))
        assert said.startswith(f"the run goes on with {2 * count} intervals: mesh=MeshControl({words}={2 * count})")
    monkeypatch.setattr(failure, "_goes_on", lambda *_: False)
    assert failure.advice(run.state, contin.Settings()) == ""
    said = str(failure.no_convergence(run.state, contin.Settings(), contin.ConvergenceError("no")))
    assert "tried in vain: steps of 1e-10, a tolerance of 1e-07, twice the intervals; at the last point lam = 1," in said


def test_a_small_smooth_circle_has_no_corner():
    """A circle of radius 1e-6 with steps of 1e-6 at least: shorter steps go on, and nobody speaks of corners."""
    circle = AlgebraicProblem(lambda u, p: (u.x**2 + p.a**2 - 1e-12,), ["x"], {"a": 0.0})
    for scales in ({}, {"a": 1, "x": 1}):
        assert "corner" not in str(contin.trace(contin.solve(circle, [1e-6]), free=["a"], scales=scales).stop)


def test_an_advice_holds_for_more_than_a_step():
    """A root at a = 1: steps of 1e-8 succeed right before, but nothing leads past it."""
    problem = AlgebraicProblem(lambda u, p: u.x**3 + 3 * abs(p.a - 1) ** 0.5 - 2 - p.a, ["x"], {"a": 0.3})
    branch = contin.trace(contin.solve(problem, [0.5]), free=["a"], limits={"a": (0, 2)})
    assert branch.stop.reason == "no convergence" and branch.points[-1]["a"] == pytest.approx(1, abs=1e-5)
    assert "goes on" not in str(branch.stop)


@pytest.mark.full
def test_round_off_above_the_tolerance():
    """Layers of width e^-k: near k = 5.3 the corrections are round-off of 1e-8. They go on as far as that tells anything."""

    def rhs(t, u, p):
        return u.v, (u.u * u.v - u.u) * 2.718281828459045**p.k

    layer = BoundaryValueProblem(
        rhs=rhs, boundary=lambda a, b, p: (a.u + 1, b.u - 1.5), states=["u", "v"], parameters={"k": 0.0}
    )
    start = contin.solve(layer, lambda t: (-1 + 2.5 * t, 2.5))
    branch = contin.trace(start, free=["k"], limits={"k": (0, 8)}, mesh=MeshControl(max_intervals=400), branch_points=False)
    assert branch.points[-1].label == "MX" and branch.points[-1]["k"] > 5.4
    assert "tried in vain" in branch.stop.advice or "round-off here" in branch.stop.advice  # which of them, round-off decides
    errors = [point.newton_error for point in branch if not point.label]
    assert 1e-10 < max(errors) < 1e-4
    assert any("round-off above its tolerance" in note for note in branch.notes)


@pytest.mark.sample(2)
@pytest.mark.parametrize(("rate", "size"), [(100, 1.0), (300, 1.0), (300, 1e4), (1000, 1.0), (1000, 1e4), (20, 1e4)])
def test_an_advice_does_not_fail_at_once(rate, size):
    """x = a^2 with round-off of size e^(rate a): a looser tolerance that is advised leads on by at least a first step."""

    def noisy(u, p):
        return ((u.x + size * np.exp(rate * p.a)) - size * np.exp(rate * p.a) - p.a**2,)

    start = contin.solve(AlgebraicProblem(noisy, ["x"], {"a": 0.0}), [0.0])
    branch = contin.trace(start, free=["a"], limits={"a": (-1, 1)})
    assert branch.stop.reason == "no convergence"
    if advised := re.search(r"tolerance=([\d.e-]+)\)", branch.stop.advice):
        newton = contin.Newton(tolerance=float(advised[1]))
        again = contin.trace(start, free=["a"], limits={"a": (-1, 1)}, newton=newton)
        assert again.points[-1]["a"] > branch.points[-1]["a"] + 0.05
    else:
        assert branch.stop.advice.startswith("tried in vain")
