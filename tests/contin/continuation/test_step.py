"""One step on the unit circle, whose points and tangents are known at every arc; and the angles that a step is judged by."""

import math

import numpy as np
import pytest

from contin import AlgebraicProblem, ConvergenceError, Newton, solve, trace
from contin.continuation.rules import judged, predict
from contin.core.step import State, corrected, located, standing_at
from contin.core.trial import Linearization, Trial
from contin.lowlevel import Algebraic


def circle():
    """x^2 + a^2 = 1, the parameter a free; the inner product is that of the plane."""
    return Algebraic(AlgebraicProblem(lambda u, p: (u.x**2 + p.a**2 - 1,), ["x"], {"a": 0.0}), ["a"])


def at(arc):
    """The point of the circle at an arc, and its unit tangent."""
    return np.array([math.cos(arc), math.sin(arc)]), np.array([-math.sin(arc), math.cos(arc)])


def state_at(arc, step=0.1, previous=None):
    """A run that stands at an arc; with ``previous``, it came from so far back."""
    x, tangent = at(arc)
    if previous is None:
        return standing_at(circle(), x, tangent, step)
    return State(circle(), x, tangent, at(arc - previous)[1], math.sin(previous), step, 1.0, previous, 1, False)


def target(arc, step):
    """The point of the circle at a distance ``step`` along the tangent at an arc: sin(change of the arc) = step."""
    return at(arc + math.asin(step))


def trial_at(system, x, tangent):
    return Trial(system, np.asarray(x, float), Linearization(np.asarray(tangent, float), 1.0))


# --- predictor and corrector ----------------------------------------------------------------------------------------


def error_of_prediction(step, previous):
    guess = predict(state_at(0.7, previous=previous and math.asin(previous)), step)
    return np.linalg.norm(guess - target(0.7, step)[0])


def test_the_predictor_is_of_second_order_in_the_first_step():
    """Along the tangent: off by 1 - cos, half the square of the step."""
    assert error_of_prediction(1e-3, None) == pytest.approx(0.5e-6, rel=1e-3)
    assert error_of_prediction(0.1, None) / error_of_prediction(0.05, None) == pytest.approx(4, rel=0.01)


def test_it_is_of_third_order_with_the_curvature_of_the_last_step():
    errors = [error_of_prediction(step, step) for step in (0.1, 0.05, 0.025)]
    assert np.log2(np.divide(errors[:-1], errors[1:])) == pytest.approx([3, 3], abs=0.02)
    assert errors[0] < error_of_prediction(0.1, None) / 10


def test_a_prediction_after_a_step_of_another_length():
    """The curvature is that of the circle, whatever the step before was."""
    errors = [error_of_prediction(0.01, previous) for previous in (0.005, 0.01, 0.02)]
    assert max(errors) < 0.05 * error_of_prediction(0.01, None)


@pytest.mark.parametrize("find", [corrected, located])
@pytest.mark.parametrize("step", [0.3, -0.2, 0.9])
def test_the_corrected_point_lies_at_its_distance_along_the_tangent(find, step):
    state = state_at(0.7)
    trial = find(state, predict(state, step), step, Newton())
    x, tangent = target(0.7, step)
    assert trial.x == pytest.approx(x, abs=1e-11)
    assert state.tangent @ (trial.x - state.x) == pytest.approx(step, abs=1e-13)
    assert trial.is_linearized or find is located
    assert trial.tangent == pytest.approx(tangent, abs=1e-11)
    assert trial.iterations > 1 and trial.newton_error < 1e-11


def test_a_distance_that_the_curve_does_not_reach():
    """No point of the circle lies further than 1 along a tangent."""
    state = state_at(0.7)
    with pytest.raises(ConvergenceError):
        corrected(state, predict(state, 1.1), 1.1, Newton())


def test_a_point_that_is_located_takes_the_factors_at_hand():
    state = state_at(0.7)
    near = located(state, predict(state, 0.3), 0.3, Newton())
    trial = located(state, near.x, 0.3001, Newton(), near.factors)
    assert trial.x == pytest.approx(target(0.7, 0.3001)[0], abs=1e-12)
    assert trial.tangent == pytest.approx(target(0.7, 0.3001)[1], abs=1e-12)


def judgement(state, trial):
    """What a step is judged by whose prediction was exact."""
    return judged(state, trial.x, trial)


def test_what_was_missed_and_the_length_are_distances():
    """On the unit circle, from the angle .7 to .9: the chord is 2 sin(.1)."""
    state = state_at(0.7)
    trial = trial_at(state.system, *at(0.9))
    found = judged(state, trial.x + [3e-3, 4e-3], trial)
    assert (found.missed, found.length) == pytest.approx((5e-3, 2 * math.sin(0.1)), rel=1e-14)


# --- angles ---------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("arc", [0.0, 0.05, 1.2])
def test_the_turn_is_the_angle_between_the_tangents(arc):
    state = state_at(0.7)
    assert judgement(state, trial_at(state.system, *at(0.7 + arc))).turn == pytest.approx(arc, abs=1e-7)


def plane(states):
    """A problem of so many states and one parameter; only its inner product is used."""
    names = [f"x{i}" for i in range(states)]
    return Algebraic(AlgebraicProblem(lambda u, p, out: None, names, {"a": 0.0}), ["a"])


def cone(system, half, angle):
    """A unit tangent whose states, of size sin(half), point at an angle; the rest is the parameter."""
    return np.array([math.sin(half) * math.cos(angle), math.sin(half) * math.sin(angle), math.cos(half)])


@pytest.mark.parametrize("angle", [0.3, 1.5, math.pi])
def test_a_parameter_that_dominates_does_not_hide_a_turn_of_the_states(angle):
    """The states turn by an angle while the whole tangent hardly does: half that angle counts."""
    system = plane(2)
    state = standing_at(system, np.zeros(3), cone(system, 0.05, 0.0), 0.1)
    trial = trial_at(system, np.zeros(3), cone(system, 0.05, angle))
    whole = math.acos(state.tangent @ trial.tangent)
    assert whole < 0.11 and judgement(state, trial).turn == pytest.approx(max(whole, angle / 2), rel=1e-6)


def test_states_that_stand_still_have_no_direction():
    """A share of the states below 1e-2 is round-off of the parameter's direction: only the whole angle counts."""
    system = plane(2)
    state = standing_at(system, np.zeros(3), cone(system, 1e-3, 0.0), 0.1)
    trial = trial_at(system, np.zeros(3), cone(system, 1e-3, math.pi))
    assert judgement(state, trial).turn == pytest.approx(2e-3, rel=1e-5)


def test_states_that_begin_at_rest_do_not_shorten_the_first_step():
    """Of x = a^2 from a = 0 the tangent predicts x = 0 at the end of a step of any length."""
    parabola = AlgebraicProblem(lambda u, p: (u.x - p.a**2,), ["x"], {"a": 0.0})
    branch = trace(solve(parabola, [0.0]), free=["a"], step=0.05, max_points=1)
    assert branch.points[-1]["a"] == pytest.approx(0.05, rel=1e-12)


def test_a_tangent_that_is_not_a_number_has_no_turn():
    state = state_at(0.7)
    assert math.isnan(judgement(state, trial_at(state.system, at(0.8)[0], [math.nan, math.nan])).turn)
