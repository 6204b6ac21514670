"""Curves in two parameters compute each thing once: what their equations are made of, and their derivatives."""

import functools

import numpy as np
import pytest

from bank.gelfand import perturbed_gelfand
from contin import AlgebraicProblem, CycleProblem, curve, cycle, solve, trace
from contin.core.differences import of_function
from contin.core.newton import Newton, correct
from contin.cycles.curves import DoublingCurve, TorusCurve
from contin.defining.special_points import FoldCurve


@functools.cache
def cusp():
    """Folds of x' = mu + lam x - x^3: lam = 3 x^2, mu = -2 x^3."""
    problem = AlgebraicProblem(lambda u, p: (p.mu + p.lam * u.x - u.x**3,), ["x"], {"mu": -1.0, "lam": 1.0})
    start = trace(solve(problem, [-1.3]), free=["mu"], limits={"mu": (-1, 1)}).labelled("LP")[0]
    return curve(start, "lam", limits={"lam": (0.5, 2)})


@functools.cache
def extrema():
    branch = trace(solve(perturbed_gelfand(), [0, 0]), free=["lam"], limits={"lam": (0, 6), "mean": (-1, 3)})
    return curve(branch.labelled("LP")[0], "eps", limits={"eps": (0.15, 0.25)})


@functools.cache
def pitchforks():
    """Branch points of x' = lam x - mu x^2 - mu x^3: lam = 0."""
    problem = AlgebraicProblem(lambda u, p: (p.lam * u.x - p.mu * u.x**2 - u.x**3 * p.mu,), ["x"], {"mu": 1.0, "lam": 1.0})
    return curve(trace(solve(problem, [0.0]), free=["lam"], limits={"lam": (-1, 1)}, direction=-1).labelled("BP")[0], "mu")


@pytest.mark.parametrize("made", [cusp, extrema, pitchforks])
def test_second_derivatives(made):
    """They agree with differences of the whole residual, whose errors are 1e-6."""
    point = made().points[2]
    random = np.random.default_rng(3)
    a, b = random.standard_normal((2, point.x.size))
    w = random.standard_normal(point.system.equations)
    wanted = w @ of_function(point.system.residual, point.x, (a, b))
    assert point.system.bent(point.x, w, a) @ b == pytest.approx(wanted, rel=1e-5)


def test_both_ends_of_a_step_are_kept():
    point, other = cusp().points[1:3]
    system, calls = point.system, []

    def computed(x):
        calls.append(x)
        return len(calls)

    for x in (point.x, other.x, point.x, other.x):
        system.once(computed, x)
    assert len(calls) == 2


@pytest.mark.parametrize("stays", [True, False])
def test_a_step_ends_where_its_last_update_was_taken(stays):
    """That is within the tolerance of the curve, and what the equations are made of is known there."""
    point = cusp().points[2]
    folds, row = FoldCurve(point.system.base), point.tangent
    guess, tolerance = point.x + 1e-3 * np.ones(point.x.size), 1e-5
    done = correct(folds, guess, row, row @ point.x, Newton(tolerance), within=np.inf if stays else 0.0)
    assert np.abs(done.x - point.x).max() <= done.error * (1 + np.abs(point.x).max()) <= tolerance * 3
    assert (done.x.tobytes() in folds._known["computed"]) == stays


@functools.cache
def turning():
    """The cycle of van der Pol's equation."""
    problem = CycleProblem(lambda u, p: (p.mu * u.x - u.y - u.x**3, u.x + p.nu * u.y), ["x", "y"], {"mu": 1.0, "nu": 0.0})
    return cycle(problem, [1.0, 0.0])


def test_first_cycle_is_far_by_what_no_shift_changes():
    """The curve of folds compares the means and norms of cycles, too: without these each step shifts the first cycle."""
    orbit = turning()
    system, x = orbit.system.with_free(["mu", "period", "nu"], orbit.x)
    lasting = FoldCurve(system).lasting(x)
    assert lasting.size == 3 + 2 + 1 and np.array_equal(lasting, system.lasting(x))


def test_borders_stay_with_another_reference():
    """They are about the null vectors of the same cycle: random ones would take a second matrix."""
    orbit = turning()
    system, x = orbit.system.with_free(["mu", "period", "nu"], orbit.x)
    folds = FoldCurve(system)
    folds.own_values(x)
    other = folds.referring_to(x, np.zeros(x.size))
    assert other is not folds and other.borders is folds.borders


@pytest.mark.parametrize("which", [0, 1])
def test_sign_does_not_depend_on_borders(which):
    """Newton's method, where it goes astray, leaves borders of the other sense: the run would see a branch point."""
    point = cusp().points[2]
    x, tangent = point.x, point.tangent
    folds = FoldCurve(point.system.base)
    signs, gradients = [], []
    for _ in range(2):
        signs.append(folds.linearize(x, (tangent,))[1].sign)
        gradients.append(folds.own_gradients(x))
        folds.borders = tuple(-border if number == which else border for number, border in enumerate(folds.borders))
        folds._known.clear()
    assert signs[0] == signs[1] != 0
    assert gradients[1] == pytest.approx(gradients[0], rel=1e-12)


def test_linear_functions_do_not_bend():
    """Boundary conditions u(0) = u(1) = 0 have no second derivatives; the field has."""
    system = extrema().points[0].system.base
    inside, ends = system._terms
    assert inside.batch.bends(inside.columns)
    assert not ends.batch.bends(ends.columns)
    v, w = np.ones(system.size), np.ones(system.equations)
    assert not ends.bent(np.ones(system.size), w, v).any()


def test_no_test_functions_of_points_that_take_more_states():
    """One state has no second eigenvalue; two multipliers are those along the cycle and of what the curve consists of."""
    orbit = turning()
    cycles, _ = orbit.system.with_free(["mu", "period", "nu"], orbit.x)
    for made in (cusp().points[0].system, FoldCurve(cycles), DoublingCurve(cycles), TorusCurve(cycles)):
        own = {event.label for event in made.events()} - ({"R1"} if isinstance(made, TorusCurve) else set())
        assert not own & {"BT", "ZH", "R1", "LPPD", "LPTR"}
