"""States that go slowly beside a parameter: its size makes the norm of a step, and they must not leave the branch for it."""

import numpy as np
import pytest

import contin


def reactor(u, p):
    """Autocatalysis in a stirred tank (Gray and Scott 1983), without catalyst in the inflow."""
    rate = u.a * u.b**2
    return (1 - u.a) / p.tau - rate, rate - u.b / p.tau - p.k * u.b


@pytest.mark.sample(2)
@pytest.mark.parametrize("direction", [1, -1])
@pytest.mark.parametrize("k", [0.03, 0.04, 0.05])
def test_both_folds_of_an_isola(k, direction):
    """Where a = 1/2: 4 (1 + k tau)^2 = tau. Beyond the last fold there is the state a = 1, on another branch."""
    folds = np.sort(np.roots([4 * k**2, 8 * k - 1, 4]).real)
    tau = 10.0
    a = (1 - np.sqrt(1 - 4 * (1 + k * tau) ** 2 / tau)) / 2
    problem = contin.AlgebraicProblem(reactor, ["a", "b"], {"tau": tau, "k": k})
    start = contin.solve(problem, [a, (1 - a) / (1 + k * tau)])
    branch = contin.trace(start, free=["tau"], limits={"tau": (1, 1000)}, direction=direction)
    assert branch.stop.reason == "closed"
    assert sorted(fold["tau"] for fold in branch.labelled("LP")) == pytest.approx(folds, rel=1e-9)
