"""Higher derivatives of residuals that are evaluated in Python, from differences of the Jacobian that is given."""

import numpy as np
import pytest

import contin


def problem(scale=1e4):
    """Two springs in parallel, one very stiff: the sums in the residual cancel, as those of finite elements do."""

    def residual(u, p, out):
        try:  # not recorded
            stiff = scale * (u[0] - u[1])
            out[0], out[1] = stiff + p[0] * u[0] - u[0] ** 3, -stiff + p[0] * u[1] - u[1] ** 3
        except ArithmeticError:
            raise

    def jacobian(u, p):
        own = p[0] - 3 * np.asarray(u) ** 2
        return np.array([[scale + own[0], -scale], [-scale, scale + own[1]]])

    return contin.AlgebraicProblem(residual, 2, {"a": -1.0}, count=2, dynamics=False, jacobian=jacobian)


@pytest.mark.filterwarnings("ignore::contin.errors.InterpretedWarning")
def test_second_and_third_derivatives():
    system = problem().discretized(["a"], {})
    x, one, two = np.array([0.3, 0.2, 0.5]), np.array([1.0, 2.0, 0.5]), np.array([-1.0, 1.0, 1.0])
    second = -6 * x[:2] * one[:2] * two[:2] + one[2] * two[:2] + two[2] * one[:2]
    assert system.along(x, [one, two]) == pytest.approx(second, abs=3e-6)
    assert system.along(x, [one, two, one[:2]]) == pytest.approx(-6 * one[:2] ** 2 * two[:2], abs=1e-5)


@pytest.mark.filterwarnings("ignore::contin.errors.InterpretedWarning")
def test_the_branches_at_a_pitchfork():
    start = contin.solve(problem(), [0.0, 0.0])
    (fork,) = contin.trace(start, free=["a"], limits={"a": (-1, 1)}).labelled("BP")
    assert fork["a"] == pytest.approx(0, abs=1e-8)
    new = contin.trace(fork, branch=1, limits={"a": (-1, 1)})
    assert new[-1]["a"] == pytest.approx(1) and np.abs(new[-1].x[:2]) == pytest.approx(1)
