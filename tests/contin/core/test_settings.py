"""Settings are checked when they are made."""

import pytest

from contin import MeshControl, Newton, ProblemError, Settings
from contin.core.settings import settings_with


@pytest.mark.parametrize(
    ("settings", "said"),
    [
        ({"direction": 0}, "direction: 0 must be \\+1 or -1"),
        ({"step": -1.0}, "step: -1.0 must be a number between 0 and inf"),
        ({"step": 1.0, "max_step": 0.1}, "step: 1 must lie between min_step = 1e-06 and max_step = 0.1"),
        ({"max_points": 0}, "max_points: 0 must be a whole number from 1"),
        ({"limits": {"lam": (2, 1)}}, "limits: lam: \\(2, 1\\) must be two numbers, the first the smaller"),
        ({"angle": 3.0}, "angle: 3.0 must be a number between 0 and 1.5"),
        ({"folds": 1}, "folds: 1 must be True or False"),
        ({"events": [max]}, "events: .* must be an Event"),
    ],
)
def test_a_value_that_is_not_allowed_is_refused_with_the_range(settings, said):
    with pytest.raises(ProblemError, match=said):
        Settings(**settings)


@pytest.mark.parametrize(
    ("make", "said"),
    [
        (lambda: Newton(0.0), "newton tolerance: 0.0 must be a number between 0 and 1"),
        (lambda: Newton(max_iterations=0), "max_iterations: 0 must be a whole number from 1"),
        (lambda: MeshControl(tolerance=2.0), "mesh tolerance: 2.0 must be a number between 0 and 1"),
        (lambda: MeshControl(min_intervals=20, max_intervals=10), "intervals: 20 to 10 must be in order"),
        (lambda: MeshControl(every=-1), "every: -1 must be a whole number from 0"),
    ],
)
def test_so_are_those_of_newton_and_of_the_mesh(make, said):
    with pytest.raises(ProblemError, match=said):
        make()


def test_options_replace_fields():
    settings = settings_with(Settings(step=0.1), {"direction": -1})
    assert (settings.step, settings.direction) == (0.1, -1)
    with pytest.raises(ProblemError, match=r"no argument 'stepp' \(did you mean 'step'\?\); known are primary, direction"):
        settings_with(None, {"stepp": 0.1})
