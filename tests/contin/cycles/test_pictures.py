"""Pictures of cycles: branches with their stability, and single points."""

import math

import numpy as np
import pytest
from matplotlib.figure import Figure

import contin
from contin import AlgebraicProblem, CycleProblem, ProblemError


def bautin(u, p):
    """r' = mu r + r**3 - r**5: the fold at mu = -1/4 parts unstable cycles from stable ones."""
    s = u.x**2 + u.y**2
    growth = p.mu + s - s * s
    return growth * u.x - u.y, u.x + growth * u.y


@pytest.fixture(scope="module")
def branch():
    def guess(t):
        return 1.2 * math.cos(2 * math.pi * t), 1.2 * math.sin(2 * math.pi * t)

    orbit = contin.solve(CycleProblem(bautin, ["x", "y"], {"mu": 1.0}), guess, {"period": 6.0})
    return contin.trace(orbit, free=["mu"], limits={"mu": (-1, 1.1), "max_x": (0.3, 2)}, direction=-1)


def test_largest_and_smallest_values_with_their_stability(branch):
    axes = branch.plot(axes=Figure().subplots())
    assert (axes.get_xlabel(), axes.get_ylabel()) == ("mu", "x, largest and smallest")
    top, inner_top, bottom, inner_bottom = axes.lines
    assert [line.get_linestyle() for line in axes.lines] == ["-", "--", "-", "--"]
    (fold,) = branch.labelled("LP")
    assert top.get_xdata()[-1] == inner_top.get_xdata()[0] == fold["mu"]
    for upper, lower, name in ((top, inner_top, "max_x"), (bottom, inner_bottom, "min_x")):
        assert set(branch.column(name)) <= {*upper.get_ydata(), *lower.get_ydata()}
    words = [text.get_text() for text in axes.get_legend().get_texts()]
    assert words == ["stable cycles", "unstable cycles", "end (EP)", "fold (LP)"]
    assert len(branch.plot(axes=axes).get_legend().get_texts()) == 4  # a second branch in the figure has the same legend


def test_other_columns(branch):
    assert branch.plot(y="y", axes=Figure().subplots()).get_ylabel() == "y, largest and smallest"
    axes = branch.plot(y="period", axes=Figure().subplots())
    assert axes.get_ylabel() == "period" and len(axes.lines) == 2
    with pytest.raises(ProblemError, match="y: 'z' is no column; there are mu, period, .*, x, y"):
        branch.plot(y="z")


def test_a_diagram():
    """Brusselator, a = 1: equilibria x = 1 lose their stability at b = 2, where cycles begin."""
    equations = AlgebraicProblem(
        lambda u, p: (1 - (p.b + 1) * u.x + u.x**2 * u.y, p.b * u.x - u.x**2 * u.y), ["x", "y"], {"b": 1}
    )
    found = contin.diagram(contin.solve(equations, [1, 1]), free=["b"], depth=1, limits={"b": (1, 3)})
    axes = found.plot(axes=Figure().subplots())
    assert (axes.get_xlabel(), axes.get_ylabel()) == ("b", "x, largest and smallest")
    assert [text.get_text() for text in axes.get_legend().get_texts()] == [
        "stable", "unstable", "end (EP)", "Hopf point (HB)", "stable cycles",
    ]  # fmt: skip
    before, behind, top, bottom = axes.lines[:2] + axes.lines[-2:]
    assert [line.get_linestyle() for line in (before, behind, top, bottom)] == ["-", "--", "-", "-"]
    assert before.get_ydata() == pytest.approx(1.0) and before.get_xdata()[-1] == pytest.approx(2.0)
    assert top.get_xdata()[0] == pytest.approx(2.0) and top.get_ydata()[-1] > 3 > 1 > bottom.get_ydata()[-1]
    assert before.get_color() != top.get_color()
    assert found.plot(y="y", axes=Figure().subplots()).get_ylabel() == "y, largest and smallest"
    equilibria, cycles = found.branches[0], found.branches[-1]
    for branch in (equilibria, cycles):  # a column of both: one picture
        assert branch.plot("b", "max_x", axes=Figure().subplots()).get_ylabel() == "max_x"
    assert (equilibria["max_x"] == equilibria["x"]).all() and cycles["max_x"][-1] > 3
    own = found.plot(axes=Figure().subplots(), color=["red"] * len(found.branches))
    assert {line.get_color() for line in own.lines} == {"red"}
    with pytest.raises(ProblemError, match="color: 1 given, must be one for each of the"):
        found.plot(color=["red"])


def test_the_norm_is_the_mean_over_time_on_any_mesh():
    """Of van der Pol's relaxation oscillations: by the trapezoidal rule. Nodes are dense where they are fast."""
    field = CycleProblem(lambda u, p: (u.y, p.mu * (1 - u.x**2) * u.y - u.x), ["x", "y"], {"mu": 1.0})
    orbit = contin.solve(field, lambda t: (2 * math.cos(6.283 * t), -2 * math.sin(6.283 * t)), {"period": 6.6})
    point = contin.trace(orbit, free=["mu"], limits={"mu": (0, 8)}).points[-1]
    states = point.system.evaluate(point.x, np.linspace(0, 1, 20001))
    known = math.sqrt(np.mean(np.sum(states[1:] ** 2, axis=1)))
    assert contin.Branch([point])["norm"][0] == pytest.approx(known, rel=1e-6)
    assert math.sqrt(np.mean(np.sum(point.system.states(point.x) ** 2, axis=1))) > 1.1 * known


def test_one_cycle(branch):
    first, last = branch.points[0], branch.points[-1]
    portrait, series, multipliers = last.plot(axes=Figure().subplots(1, 3))
    x, y = portrait.lines[0].get_data()
    assert x**2 + y**2 == pytest.approx(last["max_x"] ** 2, rel=1e-9)
    assert series.lines[0].get_xdata()[-1] == pytest.approx(last["period"], rel=1e-12)
    assert [text.get_text() for text in series.get_legend().get_texts()] == ["x", "y"]
    assert [text.get_text() for text in multipliers.get_legend().get_texts()] == ["1 not outside", "1 outside"]
    stable = first.plot("multipliers", axes=Figure().subplots())
    assert [text.get_text() for text in stable.get_legend().get_texts()] == ["2 not outside"]
    swapped = first.plot("portrait", states=["y", "x"], axes=Figure().subplots())
    assert (swapped.get_xlabel(), swapped.get_ylabel()) == ("y", "x")


@pytest.mark.parametrize(
    ("call", "words"),
    [
        (lambda point: point.plot("circle"), "what: 'circle' must be one of portrait, series, multipliers"),
        (lambda point: point.plot(states=["x", "w"]), "states: 'w' is no state; there are x, y"),
        (lambda point: point.plot(states=["x"]), "states: there must be two at least"),
        (lambda point: point.plot(axes=Figure().subplots(1, 2)), "axes: 2 given, must be 3"),
        (
            lambda point: contin.solve(AlgebraicProblem(bautin, ["x", "y"], {"mu": 0.5}), [0, 0]).plot(),
            "plot: the point must be a solution over t",
        ),
    ],
)
def test_what_is_refused(branch, call, words):
    with pytest.raises(ProblemError, match=words):
        call(branch.points[0])


def test_a_solution_without_multipliers():
    problem = contin.BoundaryValueProblem(
        rhs=lambda t, u, p: (u.v, -p.lam * math.exp(u.u)), boundary=lambda a, b, p: (a.u, b.u), states=["u", "v"],
        parameters={"lam": 1.0},
    )  # fmt: skip
    point = contin.solve(problem, [0, 0])
    assert len(point.plot(axes=Figure().subplots(1, 2))) == 2
    with pytest.raises(ProblemError, match="must be one of portrait, series"):
        point.plot("multipliers")


def test_equilibria_that_are_not_stable_are_dashed():
    """A pitchfork: x = 0 loses its stability at a = 0. Equations that are no equilibria are drawn without."""
    for dynamics, styles in ((True, ["-", "--"]), (False, ["-"])):
        problem = AlgebraicProblem(lambda u, p: (p.a * u.x - u.x**3,), ["x"], {"a": -1.0}, dynamics=dynamics)
        line = contin.trace(contin.solve(problem, [0.0]), free=["a"], limits={"a": (-1, 1)})
        axes = line.plot(axes=Figure().subplots())
        assert [part.get_linestyle() for part in axes.lines] == styles
        texts = [text.get_text() for text in axes.get_legend().get_texts()]
        assert texts == [*(("stable", "unstable") if dynamics else ()), "end (EP)", "branch point (BP)"]
    assert axes.lines[0].get_xdata()[-1] == 1
