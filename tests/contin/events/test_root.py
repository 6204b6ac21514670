"""The scalar root finder: zeros known in closed form, jumps and round-off, and few evaluations."""

import math

import numpy as np
import pytest
from scipy.optimize import brentq

from contin import AlgebraicProblem, ConvergenceError, solve, trace
from contin.events.arc import find_zero

#: Functions with a simple zero between two places. The zeros are exact numbers, but for those of x = cos x (the Dottie number)
#: and of x e^x = 1 (Lambert's W(1)), which are those of the literature.
FUNCTIONS = {
    "square": (lambda x: x * x - 2, 0.0, 2.0, math.sqrt(2)),
    "cosine": (lambda x: x - math.cos(x), 0.0, 1.0, 0.73908513321516064),
    "exponential": (lambda x: x * math.exp(x) - 1, -3.0, 2.0, 0.56714329040978387),
    "steep": (lambda x: math.tanh(50 * (x - 0.3)), 0.0, 1.0, 0.3),
    "pole near by": (lambda x: 1 / (x + 0.01) - 5, 0.0, 3.0, 0.19),
    "straight": (lambda x: 3 * (x - 0.7), 0.0, 1.0, 0.7),
    "falling": (lambda x: 1 - x**3, 0.2, 1.9, 1.0),
    "flat at one end": (lambda x: math.exp(30 * (x - 0.4)) - 1e-3, -0.6, 1.0, 0.4 - math.log(1e3) / 30),
}


def counted(function, places):
    def value(x):
        places.append(x)
        return function(x)

    return value


def ends(function, a, b):
    return (a, function(a)), (b, function(b))


@pytest.mark.parametrize("name", FUNCTIONS)
def test_zeros_to_round_off_in_few_evaluations(name):
    """Brent's method, an independent one, agrees. The answer is a place where the function was evaluated."""
    function, a, b, zero = FUNCTIONS[name]
    places = []
    found = find_zero(counted(function, places), *ends(function, a, b), 1e-13)
    assert found == pytest.approx(zero, abs=1e-12) and found == pytest.approx(brentq(function, a, b, xtol=1e-14), abs=1e-12)
    assert found in places
    assert len(places) <= 16


@pytest.mark.parametrize("name", FUNCTIONS)
def test_the_order_of_the_ends_makes_no_difference(name):
    function, a, b, zero = FUNCTIONS[name]
    assert find_zero(function, *ends(function, b, a), 1e-13) == pytest.approx(zero, abs=1e-12)


def test_a_good_guess_saves_evaluations():
    """In all; each function takes six at most from a guess that is off by 1e-4."""
    counts = {True: [], False: []}
    for guessed in counts:
        for function, a, b, zero in FUNCTIONS.values():
            places = []
            guess = zero + 1e-4 if guessed else None
            assert find_zero(counted(function, places), *ends(function, a, b), 1e-13, guess) == pytest.approx(zero, abs=1e-12)
            counts[guessed].append(len(places))
    assert max(counts[True]) <= 6 and sum(counts[True]) < sum(counts[False])


def test_a_guess_outside_the_bracket_is_not_used():
    function, a, b, zero = FUNCTIONS["cosine"]
    places = []
    assert find_zero(counted(function, places), *ends(function, a, b), 1e-13, 7.0) == pytest.approx(zero, abs=1e-12)
    assert all(a <= place <= b for place in places)


def test_an_end_that_is_the_zero_itself():
    places = []
    assert find_zero(counted(lambda x: x - 2, places), (0.0, -2.0), (2.0, 0.0), 1e-12) == 2.0
    assert places == []


def test_the_tolerance_is_one_of_the_place():
    """With a larger tolerance the answer is worse, but within it, and cheaper."""
    function, a, b, zero = FUNCTIONS["exponential"]
    errors, counts = [], []
    for tolerance in (1e-3, 1e-6, 1e-12):
        places = []
        errors.append(abs(find_zero(counted(function, places), *ends(function, a, b), tolerance) - zero))
        counts.append(len(places))
        assert errors[-1] < tolerance
    assert counts == sorted(counts) and counts[0] < counts[-1]


@pytest.mark.parametrize("noise", [1e-8, 1e-5])
def test_a_function_with_noise_is_located_to_its_noise(noise):
    """A slope of one: no place can be told from the zero by less than the noise, and few are looked at."""
    random, places = np.random.default_rng(0), []
    function = counted(lambda x: x - 0.4 + noise * random.uniform(-1, 1), places)
    assert find_zero(function, (0.0, -0.4), (1.0, 0.6), 1e-12) == pytest.approx(0.4, abs=3 * noise)
    assert len(places) <= 12  # 14 to 27 where only places at a distance of round-off are compared


@pytest.mark.parametrize(("power", "error"), [(3, 1e-8), (5, 1e-5)])
def test_a_zero_of_higher_order_is_found(power, error):
    """Values are below 1e-15 of those at the ends within this distance."""
    function = lambda x: (x - 0.3) ** power  # noqa: E731
    assert find_zero(function, *ends(function, 0.0, 1.0), 1e-12) == pytest.approx(0.3, abs=error)


def test_a_jump_is_not_taken_for_a_zero_where_the_place_is_to_be_known_better_than_round_off():
    with pytest.raises(ConvergenceError, match="no zero between the two ends"):
        find_zero(lambda x: math.copysign(1 + x, x - 0.3), (0.0, -1.0), (1.0, 2.0), 1e-25)


@pytest.mark.parametrize("function", [lambda x: math.copysign(1 + x, x - 0.3), lambda x: 1 / (x - 0.3)])
def test_a_jump_is_no_zero(function):
    with pytest.raises(ConvergenceError, match="no zero between"):
        find_zero(function, (0.0, function(0.0)), (1.0, function(1.0)), 1e-12)


def test_a_jump_is_seen_before_its_place_is_known_to_round_off():
    """An equation that ends at a jump is looked at in each of the halved steps before it; bisection takes 53 evaluations."""
    function, places = lambda x: 0.7 + 0.1 * x if x < 0.3141 else -1.0, []
    with pytest.raises(ConvergenceError, match="no zero between"):
        find_zero(counted(function, places), (0.0, 0.7), (1.0, -1.0), 1e-12)
    assert len(places) <= 40


@pytest.mark.parametrize("power", [1 / 2, 1 / 3])
def test_a_root_with_an_infinite_slope_is_a_zero(power):
    function = lambda x: math.copysign(abs(x - 0.3141) ** power, x - 0.3141)  # noqa: E731
    assert find_zero(function, *ends(function, 0.0, 1.0), 1e-12) == pytest.approx(0.3141, abs=1e-9)


def test_a_small_step_before_a_jump_is_no_zero():
    """1e-10 up to .3 and -1 beyond: small all along one side, it has no zero."""
    with pytest.raises(ConvergenceError, match="no zero"):
        find_zero(lambda x: 1e-10 * (1 - 1e-3 * x) if x < 0.3 else -1.0, (0.0, 1e-10), (1.0, -1.0), 1e-12)
    assert find_zero(lambda x: 1e-10 - x, (0.0, 1e-10), (1.0, -1.0), 1e-14) == pytest.approx(1e-10, rel=1e-6)


@pytest.mark.parametrize("between", [1e-7, 2e-6, 9e-6])
@pytest.mark.parametrize("noise", [0.0, 1e-16, 1e-15])
def test_the_second_of_two_close_zeros_seen_from_afar(between, noise):
    """Edges a_5 and b_5 of Mathieu's equation are 1.4e-5 apart, in a step of 5: secants from the dip stay in the dip."""
    random = np.random.default_rng(0)

    def function(x):
        return 0.025 * x * (x - 1.4e-5) + noise * random.uniform(-1, 1)

    found = find_zero(function, (between, function(between)), (0.43, function(0.43)), 1e-12)
    assert found == pytest.approx(1.4e-5, abs=1e-11 + 2 * noise / (0.025 * 1.4e-5))


@pytest.mark.parametrize("size", [1e-300, 1e-170, 1e170, 1e300])
def test_the_size_of_the_function_makes_no_difference(size):
    """Products of three values would be zero or infinite; the zero is W(1), as above."""
    function = FUNCTIONS["exponential"][0]

    def scaled(x):
        return size * function(x)

    places = []
    assert find_zero(counted(scaled, places), *ends(scaled, -3.0, 2.0), 1e-13) == pytest.approx(0.56714329040978387, abs=1e-12)
    assert len(places) <= 16


def test_a_branch_whose_parameter_vanishes_exponentially():
    """lam e^x = x turns at lam = 1 / e, and lam is 1e-189 at x = 440: a limit of zero is reached there but for round-off."""
    problem = AlgebraicProblem(lambda u, p: (p.lam * math.exp(u.x) - u.x,), ["x"], {"lam": 0.01})
    branch = trace(solve(problem, [0.0]), free=["lam"], limits={"lam": (0, 10)})
    (fold,) = branch.labelled("LP")
    assert fold["lam"] == pytest.approx(1 / math.e, rel=1e-12)
    assert branch.points[-1]["lam"] < 1e-15 and branch.points[-1]["x"] > 10
