"""Jacobians that a user gives."""

import numpy as np
import pytest
from scipy import sparse

from contin import AlgebraicProblem, ProblemError, curve, solve, trace

SIZE = 30


def bratu(u, p, out):
    h = 1.0 / (len(u) + 1)
    out[:] = -2 * u + h**2 * p[0] * np.exp(u)
    out[1:] += u[:-1]
    out[:-1] += u[1:]


class Counted:
    """The same as a method, which is not compiled."""

    calls = 0

    def residual(self, u, p, out):
        self.calls += 1
        bratu(u, p, out)


def derivatives(u, p):
    n = len(u)
    off = np.ones(n - 1)
    return sparse.diags_array([off, -2 + p[0] * np.exp(u) / (n + 1) ** 2, off], offsets=[-1, 0, 1])


def without_the_exponential(u, p):
    off = np.ones(len(u) - 1)
    return sparse.diags_array([off, -2 * np.ones(len(u)), off], offsets=[-1, 0, 1])


def fold(n=SIZE, residual=bratu, **given):
    problem = AlgebraicProblem(residual, n, {"lam": 0.0}, count=n, dynamics=False, **given)
    branch = trace(solve(problem, [0.0] * n), free=["lam"], limits={"lam": (0, 4)}, max_points=12)
    return branch.labelled("LP")[0]


@pytest.mark.full
@pytest.mark.parametrize("n", [SIZE, pytest.param(250, marks=pytest.mark.full)])
def test_the_fold_is_the_same(n):
    """Traced, and with a Jacobian, sparse and dense; from 200 states on the matrix is kept sparse."""
    expected = fold(n)
    for given in (derivatives, lambda u, p: derivatives(u, p).toarray()):
        found = fold(n, jacobian=given)
        assert found["lam"] == pytest.approx(expected["lam"], abs=1e-11)
    assert fold(n, jacobian=derivatives).system.is_sparse == (n == 250)


@pytest.mark.filterwarnings("ignore::contin.errors.InterpretedWarning")
def test_a_function_in_python_is_hardly_called_beside_its_jacobian():
    """For the values, and four times at least for the difference by the parameter; the first calls compare with differences."""
    model = Counted()
    problem = AlgebraicProblem(model.residual, 150, {"lam": 1.0}, count=150, dynamics=False, jacobian=derivatives)
    point = solve(problem, [0.0] * 150)
    system, x = point.system.with_free(["lam"], point.x)
    border = np.eye(system.size)[-1:]
    system.linearize(x, border)
    model.calls = 0
    system.linearize(x, border)
    assert 5 <= model.calls <= 9


def test_a_pattern_has_no_effect_any_more():
    with pytest.warns(DeprecationWarning, match="pattern= has no effect"):
        AlgebraicProblem(bratu, SIZE, {"lam": 1.0}, count=SIZE, dynamics=False, pattern=np.eye(SIZE))


def test_named_states_scales_and_a_curve_of_folds():
    """x^3 - b x + a = 0 in large units: the cusp at the origin."""
    problem = AlgebraicProblem(
        lambda u, p: (u.x**3 - p.b * u.x + p.a, u.y - 1e6 * u.x), ["x", "y"], {"a": 2.0, "b": 1.0},
        jacobian=lambda u, p: [[3 * u.x**2 - p.b, 0.0], [-1e6, 1.0]],
    )  # fmt: skip
    branch = trace(solve(problem, [-1.5, -1.5e6]), free=["a"], direction=-1, limits={"a": (-2, 3)})
    (cusp,) = curve(branch.labelled("LP")[0], "b", direction=-1, limits={"b": (-1, 2)}).labelled("CP")
    assert abs(cusp["b"]) < 1e-9


def test_stability_with_a_given_jacobian():
    problem = AlgebraicProblem(
        lambda u, p: (1 - (p.b + 1) * u.x + u.x**2 * u.y, p.b * u.x - u.x**2 * u.y), ["x", "y"], {"b": 1.0},
        jacobian=lambda u, p: ((-p.b - 1 + 2 * u.x * u.y, u.x**2), (p.b - 2 * u.x * u.y, -(u.x**2))),
    )  # fmt: skip
    (hopf,) = trace(solve(problem, [1.0, 1.0]), free=["b"], limits={"b": (0.5, 3)}).labelled("HB")
    assert hopf["b"] == pytest.approx(2, abs=1e-9)


def test_wrong_ones_are_refused():
    with pytest.raises(
        ProblemError, match=r"jacobian: the derivative of equation \d+ by u\d+ is -2, must be -1.99.* \(by differences"
    ):
        fold_at_one(jacobian=without_the_exponential)
    with pytest.raises(ProblemError, match=r"jacobian: its shape \(2, 2\) must be \(30, 30\), equations by states"):
        fold(jacobian=lambda u, p: np.eye(2))
    with pytest.raises(ProblemError, match="jacobian must take 2 arguments"):
        fold(jacobian=lambda u: u)
    with pytest.raises(ProblemError, match="jacobian: None must be a matrix of numbers|jacobian: its shape"):
        fold(jacobian=lambda u, p: None)


def fold_at_one(**given):
    problem = AlgebraicProblem(bratu, SIZE, {"lam": 1.0}, count=SIZE, dynamics=False, **given)
    return solve(problem, [0.0] * SIZE)
