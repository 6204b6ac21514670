"""Equations that are singular everywhere: which combination is a constant is known from how they are made."""

import math

import numpy as np
import pytest

import contin
from contin.equilibria.dependence import dependence


def reaction(u, p):
    """A + B <-> C: a + c and b + c stay."""
    rate = p.k * u.a * u.b - 0.1 * u.c
    return -rate, -rate, rate


def oscillators(frequencies):
    """Kuramoto's: phases enter as differences, and the sum of the rates is that of the frequencies."""

    def rates(u, p):
        phases = [u.a, u.b, u.c]
        return [w + p.k * sum(math.sin(other - phase) for other in phases) for w, phase in zip(frequencies, phases)]

    return rates


def exchange(u, p):
    return -p.k * u.a + 0.7 * u.b, p.k * u.a - 0.3 * u.b - 0.4 * u.b, u.c - u.a


def differences(u, p):
    return math.sin(u.b - u.a) + 0.1 * p.k, math.cos(u.a - u.b) - 0.4, u.c - u.a


def volumes(u, p):
    """Burgers' equation in finite volumes between closed walls: the sum of all cells stays."""
    x = np.array(u)
    inside = [0.5 * p.k * (left**2 + right**2) - 10 * (right - left) for left, right in zip(x, x[1:])]
    flux = [0.0, *inside, 0.0]
    return [before - behind for before, behind in zip(flux, flux[1:])]


@pytest.mark.parametrize(
    "residual, message",
    [
        (reaction, "equation 1 + equation 3, equation 2 + equation 3 are 0 .*: put 2 conditions that fix a + c, b + c, "),
        (exchange, "equation 1 + equation 2 is 0 .*: put a condition that fixes a + b, .*, in place of equation 1"),
        (oscillators([0.1, 0.2, -0.3]), "equation 1 + equation 2 + equation 3 is 0 .*or holds one state"),
        (oscillators([0.1, 0.2, -0.2]), "equation 1 + equation 2 + equation 3 is 0.1 .*: there is no solution"),
        (differences, "states change together .a by 1, b by 1, c by 1.: add the equation that a is held"),
        (volumes, "equation 1 + equation 2 + equation 3 is 0 .* fixes a + b + c"),
    ],
)  # fmt: skip
@pytest.mark.parametrize("guess", [[0.3, 0.2, 0.4], [1.0, 1.0, 1.0]])
def test_what_is_singular_everywhere_is_named(residual, message, guess):
    """Also where round-off makes the equations solvable: what is found then is one of many, and chosen by it."""
    problem = contin.AlgebraicProblem(residual, ["a", "b", "c"], {"k": 0.3}, dynamics=False)
    with pytest.raises(contin.ProblemError, match=message.replace("+", "[+]")):
        contin.solve(problem, guess)


def test_the_advice_leads_on():
    """With both totals 1 fixed, c is the root of .3 (1 - c)^2 = .1 c that is below 1."""

    def fixed(u, p):
        return u.a + u.c - 1, u.b + u.c - 1, reaction(u, p)[2]

    found = contin.solve(contin.AlgebraicProblem(fixed, ["a", "b", "c"], {"k": 0.3}), [0.3, 0.2, 0.4])
    assert found.x[2] == pytest.approx((0.7 - math.sqrt(0.7**2 - 4 * 0.3**2)) / 0.6, abs=1e-14)


@pytest.mark.parametrize("size", [1e-12, 1e12])
def test_points_that_are_singular_alone(size):
    """x^2 = mu at its fold, and a branch point, with any sizes of rows: there the equations are singular, and nowhere else."""
    fold = contin.AlgebraicProblem(lambda u, p: (size * (u.x**2 - p.mu), u.y - u.x), ["x", "y"], {"mu": 0.0})
    fork = contin.AlgebraicProblem(lambda u, p: (size * (p.mu * u.x - u.x**3), u.y - u.x), ["x", "y"], {"mu": 0.0})
    for problem in (fold, fork):
        assert not dependence(contin.lowlevel.Algebraic(problem, []), np.zeros(2))
