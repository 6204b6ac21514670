"""Algebraic problems, Hopf points, first solutions, deflation."""

import math

import numpy as np
import pytest

from contin import AlgebraicProblem, BoundaryValueProblem, ConvergenceError, MeshControl, ProblemError, solve, trace


def test_hopf_of_the_normal_form():
    """x' = mu x - 2 y - ..., y' = 2 x + mu y - ...: Hopf at mu = 0 with frequency 2."""
    problem = AlgebraicProblem(
        lambda u, p: (p.mu * u.x - 2 * u.y - u.x * (u.x**2 + u.y**2), 2 * u.x + p.mu * u.y - u.y * (u.x**2 + u.y**2)),
        ["x", "y"], {"mu": -1.0},
    )  # fmt: skip
    branch = trace(solve(problem, [0.0, 0.0]), free=["mu"], limits={"mu": (-2, 2)})
    (hopf,) = branch.labelled("HB")
    assert abs(hopf["mu"]) < 1e-10
    assert hopf.details["frequency"] == pytest.approx(2, abs=1e-9)
    assert [p.label for p in branch if p.label] == ["EP", "HB", "EP"]
    assert sorted(hopf.system.eigenvalues(hopf.x).imag) == pytest.approx([-2, 2])


def test_neutral_saddles_are_no_hopf_points():
    """Eigenvalues 1 and mu - 1: their sum passes zero at mu = 0, both real."""
    problem = AlgebraicProblem(lambda u, p: (u.x, (p.mu - 1) * u.y), ["x", "y"], {"mu": -0.5})
    branch = trace(solve(problem, [0.0, 0.0]), free=["mu"], limits={"mu": (-0.9, 0.9)})
    assert not branch.labelled("HB")


def test_filling_residuals_and_functionals():
    """A chain of n states, u_i = mu + i: written for arrays."""

    def residual(u, p, out):
        for i in range(u.size):
            out[i] = u[i] - p[0] - i

    problem = AlgebraicProblem(residual, 5, {"mu": 0.0}, functionals={"sum": lambda u, p: u.u0 + u.u4})
    point = solve(problem, parameters={"mu": 2.0})
    assert point.x == pytest.approx([2, 3, 4, 5, 6], abs=1e-13)
    assert point["sum"] == pytest.approx(8)


def bratu():
    return BoundaryValueProblem(
        lambda t, u, p: (u.v, -p.lam * math.exp(u.u)), lambda a, b, p: (a.u, b.u), ["u", "v"], {"lam": 1.0},
        functionals={"mean": lambda t, u, p: u.u},
    )  # fmt: skip


def bratu_values(lam):
    """Both values of u(1/2) at lam < fold: u(1/2) = 2 log cosh s with lam = 8 s^2 / cosh^2 s."""
    from scipy.optimize import brentq

    def miss(s):
        return 8 * s**2 / math.cosh(s) ** 2 - lam

    return [2 * math.log(math.cosh(brentq(miss, *ends, xtol=1e-15))) for ends in ((0.01, 1.19), (1.2, 20))]


def middle(point):
    return point.system.evaluate(point.x, np.array([0.5]))[0, 0]


def test_first_solutions_from_numbers_functions_arrays_and_points():
    low, high = bratu_values(1.0)
    t = np.linspace(0, 1, 9)
    arrays = (t, np.stack([16 * t * (1 - t), 16 - 32 * t], axis=1))
    assert middle(solve(bratu(), [0, 0], degree=6)) == pytest.approx(low, abs=1e-11)
    upper = solve(bratu(), lambda t: (16 * t * (1 - t), 16 - 32 * t), degree=6)
    assert middle(upper) == pytest.approx(high, abs=1e-10)
    assert middle(solve(bratu(), arrays, degree=6)) == pytest.approx(high, abs=1e-10)
    again = solve(bratu(), upper, {"lam": 1.01})
    assert middle(again) == pytest.approx(bratu_values(1.01)[1], abs=1e-10)


def test_deflation_finds_the_other_solution():
    first = solve(bratu(), [0, 0], degree=6)
    second = solve(bratu(), [0, 0.1], degree=6, others=[first])
    assert middle(second) == pytest.approx(bratu_values(1.0)[1], abs=1e-10)
    with pytest.raises(ConvergenceError, match="no further solution"):
        solve(bratu(), [0, 0.1], degree=6, others=[first, second])


@pytest.mark.parametrize("lam", [1.0, 2.0, 3.0])
@pytest.mark.parametrize("guess", ([0, 0.1], [1, 0], [0.3, 0.1], None))
def test_deflation_from_many_guesses(lam, guess):
    """Also from the known solution itself; the value from the closed form, at a place between mesh points."""
    first = solve(bratu(), [0, 0], {"lam": lam}, degree=8)
    second = solve(bratu(), first if guess is None else guess, {"lam": lam}, degree=8, others=[first])
    assert middle(second) == pytest.approx(bratu_values(lam)[1], abs=1e-8)


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
        ([0, 0], {"free": ["lam"]}, "needs 0"),
        ([0, 0], {"parameters": {"mu": 1}}, "'mu' is not one of lam"),
    ],
)
def test_bad_first_guesses(guess, options, said):
    with pytest.raises(ProblemError, match=said):
        solve(bratu(), guess, **options)


def test_a_fixed_mesh_stays():
    assert solve(bratu(), [0, 0], intervals=3, degree=4, mesh=MeshControl(every=0)).system.intervals == 3
