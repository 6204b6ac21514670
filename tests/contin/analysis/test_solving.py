"""One solution from a guess, and another one by deflation, against the closed form of Bratu's problem."""

import functools
import math

import numpy as np
import pytest
from bank.closed_forms import bratu, bratu_middles

from contin import BoundaryValueProblem, ConvergenceError, ProblemError, solve


def middle(point):
    return point.system.evaluate(point.x, np.array([0.5]))[0, 0]


@functools.cache
def lower(lam=1.0, degree=8):
    return solve(bratu(), [0, 0], {"lam": lam}, degree=degree)


T = np.linspace(0, 1, 9)
GUESSES = {
    "numbers": (lambda: [0, 0], 0),
    "a function": (lambda: lambda t: (16 * t * (1 - t), 16 - 32 * t), 1),
    "arrays": (lambda: (T, np.stack([16 * T * (1 - T), 16 - 32 * T], axis=1)), 1),
    "a point": (lambda: lower(1.01), 0),
}


@pytest.mark.parametrize("guess", GUESSES)
def test_first_solutions(guess):
    """Guesses of every kind, near the lower solution at lam = 1 or near the upper one."""
    made, which = GUESSES[guess]
    point = solve(bratu(), made(), {"lam": 1.0}, degree=6)
    assert middle(point) == pytest.approx(bratu_middles(1.0)[which], abs=1e-10)


def test_a_point_as_a_guess_brings_its_parameters():
    again = solve(bratu(), lower(1.01), degree=6)
    assert again["lam"] == 1.01 and middle(again) == pytest.approx(bratu_middles(1.01)[0], abs=1e-10)


def test_eigenvalue_as_a_free_parameter():
    """u'' + w u = 0, u(0) = u(1) = 0, u'(0) = 1: w = pi^2, found along with u."""
    problem = BoundaryValueProblem(
        lambda t, u, p: (u.v, -p.w * u.u), lambda a, b, p: (a.u, b.u, a.v - 1), ["u", "v"], {"w": 8.0}
    )  # fmt: skip
    point = solve(problem, lambda t: (math.sin(3 * t) / 3, math.cos(3 * t)), free=["w"], degree=7)
    assert point["w"] == pytest.approx(math.pi**2, abs=1e-11)


@pytest.mark.parametrize(
    ("guess", "options", "said"),
    [
        ([0, 0, 0], {}, "must be the 2 states"),
        (None, {}, "needs one"),
        ((np.array([0.0, 0.5]), np.zeros((2, 2))), {}, "cover the domain"),
        ([0, math.nan], {}, "must be finite"),
        ([0, 0], {"free": ["lam"]}, "needs 0"),
        ([0, 0], {"parameters": {"mu": 1}}, "'mu' is not one of lam"),
        ([0, 0], {"degree": 9}, "degree: 9 must be a whole number from 2 to 8"),
        ([0, 0], {"others": [3]}, "others: 3 must be a Point"),
    ],
)
def test_bad_first_guesses(guess, options, said):
    with pytest.raises(ProblemError, match=said):
        solve(bratu(), guess, **options)


# --- deflation ------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("lam", [1.0, 2.0, 3.0])
@pytest.mark.parametrize("guess", ([0, 0.1], [1, 0], [0.3, 0.1], None))
def test_deflation_from_many_guesses(lam, guess):
    """Also from the known solution itself (None); the value from the closed form, at a place between mesh points."""
    second = solve(bratu(), lower(lam) if guess is None else guess, {"lam": lam}, degree=8, others=[lower(lam)])
    assert middle(second) == pytest.approx(bratu_middles(lam)[1], abs=1e-8)


def test_where_all_solutions_are_known_there_is_no_further_one():
    first = lower(1.0, 6)
    second = solve(bratu(), [0, 0.1], {"lam": 1.0}, degree=6, others=[first])
    with pytest.raises(ConvergenceError, match="no further solution"):
        solve(bratu(), [0, 0.1], {"lam": 1.0}, degree=6, others=[first, second])
