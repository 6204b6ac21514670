"""Problems as their authors write them at first: SI units, poor guesses. Each failed once; docs/outside.md has more."""

import math

import numpy as np
import pytest
from scipy.optimize import brentq

import contin

EPS0 = 8.854187812e-12  # F/m


def test_pull_in_of_a_plate_in_si_units():
    """Stiffness against the force of a capacitor: V^2 = 8 k g^3 / (27 eps0 A) at x = g/3. At V = 0 the plate does not move."""
    area, stiffness, gap = 1e-8, 5.0, 2e-6
    problem = contin.AlgebraicProblem(
        lambda u, p: np.array([stiffness * u[0] - EPS0 * area * p["V"] ** 2 / (2 * (gap - u[0]) ** 2)]), ["x"], {"V": 0.0}
    )
    branch = contin.trace(contin.solve(problem, [0.0]), free=["V"], limits={"V": (-1, 100), "x": (-1e-7, 0.99 * gap)})
    (fold,) = branch.labelled("LP")
    assert abs(fold["V"] / math.sqrt(8 * stiffness * gap**3 / (27 * EPS0 * area)) - 1) < 1e-12
    assert abs(fold["x"] / gap - 1 / 3) < 1e-6
    assert [point.label for point in branch if point.label] == ["EP", "LP", "EP"]


def test_the_step_before_a_limit_does_not_pass_a_pole():
    """Cahn-Hilliard: modes k bifurcate at eps = sqrt(1 - 3 m^2) / (k pi). A step from 0.1 to -0.1 lost three of five."""
    mass = 0.3
    problem = contin.BoundaryValueProblem(
        lambda x, u, p: [u[1], (u[0] ** 3 - u[0] - p.mu) / p.eps**2], lambda a, b, p: [a[1], b[1]], ["u", "du"],
        {"eps": 0.4, "mu": mass**3 - mass}, integrals=lambda x, u, p: u[0] - mass,
    )  # fmt: skip
    start = contin.solve(problem, [mass, 0], free=["mu"])
    settings = contin.Settings(direction=-1, limits={"eps": (0.05, 0.5)}, errors=False)
    found = [point["eps"] for point in contin.trace(start, settings, free=["eps", "mu"]).labelled("BP")]
    assert np.allclose(
        found, [math.sqrt(1 - 3 * mass**2) / (k * math.pi) for k in range(1, 6)], rtol=2e-5, atol=0
    )  # on the mesh of the run


def test_a_poor_guess_is_damped():
    """A cable of 103 m over 100 m, from a third of its sag: horizontal force w c with 2 c sinh(span / 2 c) = length."""
    weight, span, length = 12.5, 100.0, 103.0
    cable = contin.BoundaryValueProblem(
        lambda x, y, p: (y.slope, weight / p.H * math.sqrt(1 + y.slope**2)), lambda a, b, p: (a.y - 20.0, b.y - 20.0),
        ["y", "slope"], {"H": 2000.0}, integrals=lambda x, y, p: (math.sqrt(1 + y.slope**2) - length / span,), domain=(0, span),
    )  # fmt: skip
    found = contin.solve(cable, lambda x: (20 - 0.12 * x * (1 - x / span), 0.12 * (2 * x / span - 1)), free=["H"])
    exact = brentq(lambda c: 2 * c * math.sinh(span / 2 / c) - length, 10, 1e4, xtol=1e-12)
    assert abs(found["H"] / (weight * exact) - 1) < 1e-11


def test_a_branch_goes_on_at_a_corner():
    """Stommel's box model has |T - S|: the branch turns at its corner, T = S = eta1, where eta2 = eta1 eta3."""
    problem = contin.AlgebraicProblem(
        lambda u, p: (3.0 - u.T * (1 + abs(u.T - u.S)), p.eta2 - u.S * (0.3 + abs(u.T - u.S))), ["T", "S"], {"eta2": 0.0}
    )
    branch = contin.trace(contin.solve(problem, [1.3, 0.0]), free=["eta2"], limits={"eta2": (0, 2)})
    (corner,) = branch.labelled("BC")
    assert abs(corner["eta2"] - 0.9) < corner.errors["eta2"] < 1e-12 and corner.details.kind == "fold"
    assert branch.points[-1]["eta2"] == 2


def test_times_of_a_guess_may_miss_the_ends_by_round_off():
    problem = contin.BoundaryValueProblem(lambda t, u, p: (1.0,), lambda a, b, p: (a.x,), ["x"], {"a": 0.0})
    times = np.cos(np.pi / 2 * np.linspace(1, 0, 5))
    assert times[0] > 0
    found = contin.solve(problem, (times, np.zeros((5, 1))))
    assert abs(found.system.evaluate(found.x, np.array([1.0]))[0, 0] - 1) < 1e-14


def test_symmetries_are_functions_of_times_and_states():
    problem = contin.AlgebraicProblem(lambda u, p: (u.x * (p.a - u.x**2),), ["x"], {"a": -1.0})
    with pytest.raises(contin.ProblemError, match=r"symmetries: .* must take 2 arguments, times \(K,\) and states \(K, n\)"):
        contin.diagram(contin.solve(problem, [0.0]), free=["a"], symmetries=[lambda u: -u])


@pytest.mark.parametrize("capacity, start", [(0.5, 2.0), (0.1, 1.5), (0.02, 2.0)])
def test_a_population_dies_out_at_a_branch_point(capacity, start):
    """r x (1 - x/K) = x: x = K (1 - 1/r) crosses x = 0 at r = 1, and a step from r = 1.35 to 0.97 ended on x = 0."""
    growth = contin.AlgebraicProblem(lambda u, p: (p.r * u.x * (1 - u.x / capacity) - u.x,), ["x"], {"r": start})
    branch = contin.trace(contin.solve(growth, [capacity * (1 - 1 / start)]), free=["r"], direction=-1, limits={"r": (0.5, 3)})
    assert [point.label for point in branch if point.label] == ["EP", "BP", "EP"]
    assert abs(branch.labelled("BP")[0]["r"] - 1) < 1e-9 and abs(branch[-1]["x"] / capacity + 1) < 1e-9
