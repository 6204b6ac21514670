"""The end on a trivial branch: the quantity crosses zero above its round-off, on the branch; Hessians on small scales."""

import math

import numpy as np
import pytest

from contin import AlgebraicProblem, Newton, solve, trace
from contin.core.trial import Trial
from contin.events.inspection import crossed, jumped, round_off
from contin.lowlevel import Algebraic, locate_branch_point


def amplitude(values):
    """Trials at values of a free parameter."""
    problem = AlgebraicProblem(lambda u, p: (u.x - p.a,), ["x"], {"a": 0.0}, {"A": lambda u, p: u.x * 3.0})
    system = Algebraic(problem, ["a"])
    return [Trial.without_tangent(system, np.array([value, value])) for value in values]


def test_a_jump_falls_to_round_off_and_a_crossing_does_not():
    large, small, noise, negative = amplitude([0.2, 1e-9, -1e-17, -0.1])
    for name, factor in (("a", 1.0), ("A", 3.0)):
        assert round_off(large, name, Newton()) == pytest.approx(factor * 1.2e-11, rel=1e-3)
        assert jumped(large, noise, name, Newton()) and not crossed(large, noise, name, Newton())
        assert crossed(large, negative, name, Newton()) and not jumped(large, negative, name, Newton())
        assert not jumped(small, noise, name, Newton())  # a decay, or nothing that can be told from it
        assert not crossed(noise, large, name, Newton())


def test_a_quantity_that_decays_to_round_off_ends_no_branch():
    """1 + exp(-5 mu) - 1 is zero in floating point from mu = 7.4 on, and exp(-5 mu) never."""
    problem = AlgebraicProblem(
        lambda u, p: (u.x - math.exp(-5 * p.mu),), ["x"], {"mu": 0.0}, {"X": lambda u, p: (1 + u.x) - 1 - 1e-17 * p.mu}
    )
    branch = trace(solve(problem, [1.0]), free=["mu"], limits={"mu": (-1, 12)}, trivial="X")
    assert branch.stop.reason == "limit" and [point.label for point in branch.points if point.label] == ["EP", "EP"]


def test_a_change_of_sign_without_a_zero_is_no_end():
    """The quantity jumps from 1 to -1 at mu = 2."""
    problem = AlgebraicProblem(lambda u, p: (u.x - p.mu,), ["x"], {"mu": 0.0}, {"X": lambda u, p: (2 - u.x) / abs(2 - u.x)})
    branch = trace(solve(problem, [0.0]), free=["mu"], limits={"mu": (-1, 4)}, trivial="X")
    last = branch.points[-1]
    assert (last.label, last.name) == ("MX", "possible trivial branch")
    assert branch.stop.reason == "no convergence" and "no zero of it" in branch.stop.message


@pytest.mark.parametrize("scale", [1.0, 1e-2, 1e-3, 1e-4])
def test_tangents_of_a_pitchfork_that_bends_on_a_small_scale(scale):
    """x (a - sqrt(scale^2 + x^2)): at (0, scale) the branch is vertical, and flat away from it."""
    problem = AlgebraicProblem(lambda u, p: (u.x * (p.a - math.sqrt(scale**2 + u.x**2)),), ["x"], {"a": 0.0})
    found = locate_branch_point(Algebraic(problem, ["a"]), np.array([0.2 * scale, 1.1 * scale]))
    assert found.x == pytest.approx([0, scale], abs=1e-12)
    upright = max(found.tangents, key=lambda tangent: abs(tangent[0]))
    assert abs(upright[1]) < 1e-5


def test_the_reason_names_equations_that_end():
    problem = AlgebraicProblem(lambda u, p: (u.x - p.mu + 0 * math.sqrt(1.5 - p.mu),), ["x"], {"mu": 0.0})
    branch = trace(solve(problem, [0.0]), free=["mu"], limits={"mu": (-1, 4)})
    assert branch.stop.reason == "no convergence" and "no finite value" in branch.stop.message
    assert branch.points[-1]["mu"] == pytest.approx(1.5, abs=1e-5)
